//! The Python package `orograph`: graphs of terrain nodes on NumPy arrays.
//!
//! This crate is the compiled half, `orograph._orograph`; the Python half in `python/orograph` gives it its shape.
//! Arrays pass without NumPy's C interface: inputs by the buffer protocol, outputs by `__array_interface__`, which names
//! the samples in place. Without the feature `extension` the crate is empty.

#[cfg(feature = "extension")]
mod errors;
#[cfg(feature = "extension")]
mod graph;
#[cfg(feature = "extension")]
mod module;
#[cfg(feature = "extension")]
mod raster;
#[cfg(feature = "extension")]
mod run;
#[cfg(feature = "extension")]
mod session;
