//! Texts of shaders: those of nodes, and the library that they share.

/// The text of a shader in `shaders/`, without the extension.
macro_rules! wgsl {
    ($name:literal) => {
        include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shaders/", $name, ".wgsl"))
    };
}
pub(crate) use wgsl;

/// Functions of numbers.
pub(crate) const MATH: &str = wgsl!("lib/math");
/// Height gradients.
pub(crate) const GRADIENT: &str = wgsl!("lib/gradient");
/// The edges of a range; it needs [`MATH`].
pub(crate) const WITHIN: &str = wgsl!("lib/within");
/// Lattice noise.
pub(crate) const LATTICE: &str = wgsl!("lib/lattice");
