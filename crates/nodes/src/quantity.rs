//! Quantity of a generator's values, for nodes without an input that determines it.

use crate::prelude::*;

choice! {
    /// Quantity of a value.
    pub enum Quantity {
        /// An elevation in metres.
        Height = "height",
        /// A selection from 0 to 1.
        Mask = "mask",
        /// A plain number.
        Scalar = "scalar",
    }
}

/// Returns the type of an output whose quantity is the parameter `quantity`.
pub(crate) fn port_type(params: &ParamValues) -> PortType {
    match params.read("quantity") {
        Quantity::Height => PortType::Height,
        Quantity::Mask => PortType::Mask,
        Quantity::Scalar => PortType::Scalar(Unit::One),
    }
}

/// Rejects a mask with values outside 0 to 1.
///
/// # Errors
/// [`NodeError::Failed`].
pub(crate) fn check(quantity: Quantity, values: &[f64]) -> Result<(), NodeError> {
    match values.iter().find(|value| quantity == Quantity::Mask && !(0.0..=1.0).contains(*value)) {
        None => Ok(()),
        Some(value) => Err(NodeError::failed_with_hint(
            format!("a mask of {value} is outside 0 to 1"),
            "choose values from 0 to 1, or another `quantity`",
        )),
    }
}
