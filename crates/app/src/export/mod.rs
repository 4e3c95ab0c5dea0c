//! Terrain for other programs: files of every output, meshes, vector lines and what game engines import.

pub mod cube;
pub mod engine;
pub mod geojson;
pub mod mesh;
pub mod outputs;
pub mod picture;
pub mod piece;
pub mod plot;
pub(crate) mod samples;
pub(crate) mod surface;
pub mod tiles;
pub(crate) mod vertices;
