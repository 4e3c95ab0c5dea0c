//! The GPU backend: shaders without a device, and on one the parity of every kernel with the CPU. See `docs/gpu.md`.

mod creep;
mod drainage;
mod ice;
mod live;
mod parity;
mod running;
mod shaders;
mod slides;
mod soak;
mod storm;
mod table;
mod waves;
