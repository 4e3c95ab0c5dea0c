//! Rasters on wires.

use std::sync::Arc;

use rayon::prelude::*;

use crate::{
    device::{DeviceError, DeviceSamples, Samples, WeakSamples},
    memory::{OutOfMemory, with_capacity},
    world::Window,
};

/// A row-major raster of `f32` with the window of the world that it covers. Copies share the samples.
///
/// The samples may be on a device that computed them; they come to the host when [`Self::fetch`] asks for them.
///
/// Shape: `planes` x `ny` x `nx`, plane after plane; one plane for heights, masks and scalars, two for vectors (x east,
/// y south), three for linear RGB colour.
#[derive(Clone, Debug)]
pub struct Field {
    window: Window,
    planes: usize,
    samples: Arc<Samples>,
}

impl PartialEq for Field {
    /// Equal windows and equal bytes; two NaNs with the same bits are equal.
    fn eq(&self, other: &Self) -> bool {
        self.window == other.window
            && self.planes == other.planes
            && self.samples().iter().zip(other.samples()).all(|(a, b)| a.to_bits() == b.to_bits())
    }
}

impl Field {
    /// A raster of one plane from its samples, row by row from the north-west corner.
    ///
    /// # Panics
    /// When there are not exactly `window.len()` samples: a bug in a kernel, never the fault of a file.
    #[must_use]
    pub fn new(window: Window, samples: Vec<f32>) -> Self {
        Self::with_planes(window, 1, samples)
    }

    /// A raster of several planes from its samples, plane after plane.
    ///
    /// # Panics
    /// When there are not exactly `planes * window.len()` samples: a bug in a kernel, never the fault of a file.
    #[must_use]
    pub fn with_planes(window: Window, planes: usize, samples: Vec<f32>) -> Self {
        assert_eq!(samples.len(), planes * window.len(), "samples do not fill the window");
        Self { window, planes, samples: Arc::new(Samples::on_host(samples)) }
    }

    /// A raster whose samples are on a device.
    #[must_use]
    pub fn on_device(window: Window, planes: usize, samples: Arc<dyn DeviceSamples>) -> Self {
        Self { window, planes, samples: Arc::new(Samples::on_device(planes * window.len(), samples)) }
    }

    /// Brings the samples to the host, if they are not there.
    ///
    /// # Errors
    /// When the device does not give them back.
    pub fn fetch(&self) -> Result<(), DeviceError> {
        self.samples.fetch()
    }

    /// The samples on the host. Returns None when they are only on a device.
    #[must_use]
    pub fn host(&self) -> Option<&[f32]> {
        self.samples.host()
    }

    /// The copy of the samples on a device. Returns None when there is none.
    #[must_use]
    pub fn device(&self) -> Option<Arc<dyn DeviceSamples>> {
        self.samples.device()
    }

    /// Keeps a copy of the samples on a device, so that they are uploaded once.
    pub fn keep_on_device(&self, samples: Arc<dyn DeviceSamples>) {
        self.samples.keep_on_device(samples);
    }

    /// A handle of the samples that does not keep them alive.
    #[must_use]
    pub fn shared(&self) -> WeakSamples {
        WeakSamples::new(&self.samples)
    }

    /// A raster with the same value everywhere, for tests and examples; a kernel allocates with
    /// [`filled`](crate::memory::filled).
    #[must_use]
    pub fn constant(window: Window, value: f32) -> Self {
        Self::new(window, vec![value; window.len()])
    }

    /// The window it covers.
    #[must_use]
    pub const fn window(&self) -> &Window {
        &self.window
    }

    /// Number of planes.
    #[must_use]
    pub const fn planes(&self) -> usize {
        self.planes
    }

    /// All samples, plane after plane, row after row.
    ///
    /// # Panics
    /// When the samples are only on a device that does not give them back. The evaluator [fetches](Self::fetch) what
    /// kernels and readers on the host receive.
    #[must_use]
    pub fn samples(&self) -> &[f32] {
        self.samples.read()
    }

    /// The samples of one plane.
    #[must_use]
    pub fn plane(&self, plane: usize) -> &[f32] {
        let len = self.window.len();
        &self.samples()[plane * len..(plane + 1) * len]
    }

    /// Returns the samples, without a copy if nothing else shares them.
    #[must_use]
    pub fn into_samples(self) -> Vec<f32> {
        Arc::try_unwrap(self.samples).map_or_else(|shared| shared.read().to_vec(), Samples::into_host)
    }

    /// Size of its samples in bytes, wherever they are.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.samples.len() * size_of::<f32>()
    }

    /// A message on the first sample that is NaN or infinite, with its cell in the world. Returns None when there is
    /// none.
    pub(crate) fn fault(&self) -> Option<String> {
        const CHUNK: usize = 1 << 16;
        let samples = self.samples();
        // Without an early exit inside a chunk the loop is vectorised.
        let chunk = samples
            .par_chunks(CHUNK)
            .position_first(|chunk| chunk.iter().fold(false, |bad, v| bad | !v.is_finite()))?;
        let at = chunk * CHUNK + samples[chunk * CHUNK..].iter().position(|v| !v.is_finite())?;
        let window = self.window();
        let (plane, cell) = (at / window.len(), at % window.len());
        let i = window.origin[0] as usize + cell % window.nx();
        let j = window.origin[1] as usize + cell / window.nx();
        let of_plane = if self.planes() > 1 { format!(" of plane {plane}") } else { String::new() };
        Some(format!("returned {} at cell ({i}, {j}){of_plane}", samples[at]))
    }

    /// Smallest and largest sample of a plane. Returns None when it has no finite sample.
    #[must_use]
    pub fn range(&self, plane: usize) -> Option<(f32, f32)> {
        // independent lanes; no comparison with NaN is true
        let (mut low, mut high) = ([f32::INFINITY; 16], [f32::NEG_INFINITY; 16]);
        let (whole, rest) = self.plane(plane).as_chunks::<16>();
        let mut last = [f32::NAN; 16];
        last[..rest.len()].copy_from_slice(rest);
        for lanes in whole.iter().chain([&last]) {
            for ((low, high), v) in low.iter_mut().zip(&mut high).zip(lanes) {
                let v = if v.abs() < f32::INFINITY { *v } else { f32::NAN };
                *low = if v < *low { v } else { *low };
                *high = if v > *high { v } else { *high };
            }
        }
        // zero without a sign, which would depend on the lane
        let lo = low.into_iter().fold(f32::INFINITY, f32::min) + 0.0;
        let hi = high.into_iter().fold(f32::NEG_INFINITY, f32::max) + 0.0;
        (lo <= hi).then_some((lo, hi))
    }

    /// The part that covers `window`, for tests; the evaluator uses [`Self::try_crop`].
    ///
    /// # Panics
    /// As [`Self::try_crop`], and when there is not enough memory.
    #[must_use]
    pub fn crop(&self, window: &Window) -> Self {
        self.try_crop(window).expect("there is memory for a part")
    }

    /// The part that covers `window`, in the world of `window`, which may have another sea level.
    ///
    /// # Errors
    /// [`OutOfMemory`].
    ///
    /// # Panics
    /// When `window` is not inside this raster's window: a bug in the evaluator, never the fault of a file.
    pub fn try_crop(&self, window: &Window) -> Result<Self, OutOfMemory> {
        if self.window == *window {
            return Ok(self.clone());
        }
        assert!(self.window.contains(window), "cannot crop beyond the raster");
        if self.window.cells == window.cells {
            return Ok(Self { window: *window, ..self.clone() });
        }
        let x0 = (window.origin[0] - self.window.origin[0]) as usize;
        let y0 = (window.origin[1] - self.window.origin[1]) as usize;
        let mut samples = with_capacity(self.planes * window.len())?;
        for plane in 0..self.planes {
            let plane = self.plane(plane);
            for j in 0..window.ny() {
                let start = (y0 + j) * self.window.nx() + x0;
                samples.extend_from_slice(&plane[start..start + window.nx()]);
            }
        }
        Ok(Self::with_planes(*window, self.planes, samples))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;

    #[test]
    fn a_crop_keeps_places() {
        let world = World { size: [4.0, 3.0], cells: [4, 3], ..World::default() };
        let field = Field::new(Window::whole(world), (0..12).map(|v| v as f32).collect());
        let part = field.crop(&Window { world, origin: [1, 1], cells: [2, 2] });
        assert_eq!(part.samples(), [5.0, 6.0, 9.0, 10.0]);
        let flooded = Window::whole(World { sea_level: Some(2.0), ..world });
        assert_eq!(field.crop(&flooded), Field::new(flooded, field.samples().to_vec()));
        assert_eq!(field.range(0), Some((0.0, 11.0)));
    }

    #[test]
    fn a_range_is_that_of_finite_samples() {
        let world = World { size: [37.0, 1.0], cells: [37, 1], ..World::default() };
        let range = |samples: Vec<f32>| Field::new(Window::whole(world), samples).range(0);
        // the lowest, the highest and the NaN sample at each position in turn
        for at in 0..37 {
            let mut samples = vec![1.0; 37];
            samples[at] = -3.0;
            samples[(at + 5) % 37] = 7.0;
            samples[(at + 9) % 37] = f32::NAN;
            samples[(at + 20) % 37] = [f32::INFINITY, f32::NEG_INFINITY][at % 2];
            assert_eq!(range(samples), Some((-3.0, 7.0)));
        }
        assert_eq!(range(vec![f32::NAN; 37]), None);
        let (low, high) = range(vec![-0.0; 37]).expect("finite");
        assert!(low.is_sign_positive() && high.is_sign_positive(), "a zero has no sign");
    }
}
