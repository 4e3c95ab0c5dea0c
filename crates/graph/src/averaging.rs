//! How results on finer cells become those on larger ones.

use crate::{unit::Unit, value::PortType};

/// How the values of finer cells become that of the cell that they divide.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Averaging {
    /// Their mean.
    Mean,
    /// The largest: drainage areas, discharges and what lies along rivers, for which the mean with the slopes beside
    /// would be neither.
    Largest,
    /// The commonest; of several, the first from the north-west. For numbers of layers, basins and lakes.
    Commonest,
    /// The direction of the sum of unit vectors, in degrees clockwise from north; values below 0 stand for none.
    Direction,
    /// The mean of vectors, scaled to length one.
    UnitVector,
}

impl Averaging {
    /// That of an output of this type whose node declares no other.
    #[must_use]
    pub const fn of(ty: PortType) -> Self {
        match ty {
            PortType::Normal => Self::UnitVector,
            PortType::Scalar(Unit::Count) => Self::Commonest,
            PortType::Scalar(Unit::SquareMetres | Unit::CubicMetresPerYear | Unit::CubicMetresPerSecond) => {
                Self::Largest
            }
            _ => Self::Mean,
        }
    }
}
