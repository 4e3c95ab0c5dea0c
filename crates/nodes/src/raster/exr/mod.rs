//! OpenEXR: floating-point numbers in named channels.
//!
//! Source: Academy Software Foundation, "OpenEXR File Layout". Read: of the first layer the channel `Y`, else `Z`,
//! `height` or `R`, else the first; 16-bit and 32-bit floats and integers. Written: one channel of 32-bit floats, `Y`
//! or `R`.

mod read;
#[cfg(test)]
mod tests;
mod write;

pub(super) use read::open;
pub(super) use write::{BEFORE_ROW, before_row, header};
