//! What the numbers of a source mean: the choice that nodes without an input to take it from offer.

use crate::prelude::*;

choice! {
    /// What a value means.
    pub enum Quantity {
        /// An elevation in metres.
        Height = "height",
        /// A selection from 0 to 1.
        Mask = "mask",
        /// A plain number.
        Scalar = "scalar",
    }
}

/// The type of an output whose meaning is the parameter `quantity`.
pub(crate) fn port_type(params: &ParamValues) -> PortType {
    match params.read("quantity") {
        Quantity::Height => PortType::Height,
        Quantity::Mask => PortType::Mask,
        Quantity::Scalar => PortType::Scalar(Unit::One),
    }
}
