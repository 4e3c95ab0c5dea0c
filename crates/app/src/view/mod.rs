//! The 3D view: a renderer on wgpu, cameras, and rays that find the terrain under a pixel.
//!
//! It draws into any texture, so that an editor's window and a picture without a window come from the same code:
//!
//! - [`Land`] is what is looked at: heights, and if wanted colours, water and a mask.
//! - [`Inset`] is a part of it at finer cells.
//! - [`Scene`] says how: camera, sun, haze, exaggeration, contour lines.
//! - [`Renderer`] holds what lies on the graphics card and records the passes of a picture.
//! - [`Orbit`] and [`Fly`] turn drags and keys into a [`Camera`].
//! - [`Offscreen`] is a device of its own for pictures without a window.
//!
//! Places are metres from the north-west corner of the land's window: x east, y up, z south, which is right-handed.
//! Heights on the y axis are exaggerated; whatever goes in or comes out as a height is not.
//!
//! No wgpu error panics here: what a device refuses comes back as a [`ViewError`].

mod bounds;
mod camera;
mod controls;
mod error;
mod gpu;
mod inset;
mod land;
mod lod;
mod maps;
mod offscreen;
mod ray;
mod renderer;
mod scene;
mod sky;
mod sun;
mod sweep;
mod uniforms;

pub use camera::{Camera, Ray};
pub use controls::{Fly, FlyKeys, Orbit};
pub use error::ViewError;
pub use inset::Inset;
pub use land::Land;
pub use offscreen::{Offscreen, drawn};
pub use ray::Hit;
pub use renderer::{Drawn, Renderer};
pub use scene::{Background, Colouring, Contours, Scene};
pub use sun::Sun;

#[cfg(test)]
mod tests;
