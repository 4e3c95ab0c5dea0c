//! The 3D view: a wgpu renderer, cameras, and rays that find the terrain under a pixel.
//!
//! It draws into any texture, so that the editor's window and a picture without a window use the same code:
//!
//! - [`Terrain`] is the terrain: heights, and optionally a [`Cover`]: colours, water, a mask and lines.
//! - [`Inset`] is a part of it at finer cells.
//! - [`Scene`] has camera, sun, haze, exaggeration and contour lines.
//! - [`Renderer`] owns the resources on the graphics card and records the passes of a picture.
//! - [`Orbit`] and [`Fly`] turn drags and keys into a [`Camera`].
//! - [`Offscreen`] is a device for pictures without a window.
//!
//! Positions are metres from the north-west corner of the terrain's window: x east, y up, z south, which is
//! right-handed. The y axis is exaggerated; heights in arguments and results are not.
//!
//! No wgpu error panics here: errors of the device become a [`ViewError`].

mod bounds;
mod camera;
mod controls;
mod error;
mod gpu;
mod inset;
mod lines;
mod lod;
mod maps;
mod offscreen;
mod ray;
mod renderer;
mod scene;
mod sky;
mod sun;
mod sweep;
mod terrain;
mod uniforms;

pub use camera::{Camera, Ray};
pub use controls::{Fly, FlyKeys, Orbit};
pub use error::ViewError;
pub use inset::Inset;
pub use lines::coverage;
pub use offscreen::{Offscreen, drawn};
pub use ray::Hit;
pub use renderer::{Drawn, Renderer};
pub use scene::{Background, Colouring, Contours, Scene};
pub use sun::Sun;
pub use terrain::{Cover, Terrain};

#[cfg(test)]
mod tests;
