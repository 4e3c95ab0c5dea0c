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
/// Height gradients; it needs [`LINES`] and the numbers of [`crate::numerics::joins`].
pub(crate) const GRADIENT: &str = wgsl!("lib/gradient");
/// The edges of a range; it needs [`MATH`].
pub(crate) const WITHIN: &str = wgsl!("lib/within");
/// Hashes of integers.
pub(crate) const HASH: &str = wgsl!("lib/hash");
/// Lattice noise; it needs [`HASH`].
pub(crate) const LATTICE: &str = wgsl!("lib/lattice");
/// Sides of the world.
pub(crate) const SIDES: &str = wgsl!("lib/sides");
/// Lines that are solved in parts, and how many of them together.
pub(crate) const PARTS: &str = wgsl!("lib/parts");
pub(crate) const LINES_TOGETHER: u32 = 8;
/// Lines beyond their ends.
pub(crate) const LINES: &str = wgsl!("lib/lines");
/// Holes and the rim of a storm; it needs [`MATH`] and [`SIDES`].
pub(crate) const PIPE: &str = wgsl!("lib/pipe");
/// Discharge through faces; it needs [`PIPE`].
pub(crate) const PIPE_FACES: &str = wgsl!("lib/pipe_faces");
/// Bed and water beyond the sides; it needs [`PIPE`].
pub(crate) const PIPE_GHOSTS: &str = wgsl!("lib/pipe_ghosts");
/// Neighbours and receivers on a raster; it needs [`LINES`].
pub(crate) const FLOW: &str = wgsl!("lib/flow");
/// Closed cells of slides.
pub(crate) const REPOSE: &str = wgsl!("lib/repose");
/// Faces between cells that creep.
pub(crate) const CREEP_FACES: &str = wgsl!("lib/creep_faces");
/// Solutions for lines of cells that creep; it needs [`PARTS`] and [`CREEP_FACES`].
pub(crate) const CREEP_PARTS: &str = wgsl!("lib/creep_parts");
/// The ice grid; it needs [`SIDES`].
pub(crate) const ICE: &str = wgsl!("lib/ice");
/// Horizons in one direction; it needs [`LINES`].
pub(crate) const HORIZON: &str = wgsl!("lib/horizon");
/// The hidden part of the sky, by horizons.
pub(crate) const SKY: &str = wgsl!("lib/sky");
/// Sunlight between moments; it needs [`GRADIENT`] and what that needs.
pub(crate) const SUNLIGHT: &str = wgsl!("lib/sunlight");
