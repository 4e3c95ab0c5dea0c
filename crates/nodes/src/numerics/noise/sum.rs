//! The plain sum of octaves: fractional Brownian motion.
//!
//! F. K. Musgrave, C. E. Kolb and R. S. Mace (1989), "The synthesis and rendering of eroded fractal terrains".

use orograph_graph::{Job, NodeError};

use super::{
    Basis, Octave,
    raster::{self, Combine, Lanes, Noise},
    sheet::Sheets,
};

/// Returns the sum of octaves of lattice noise, within ± `amplitude`, in its unit.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub(crate) fn lattices(job: &Job<'_>, octaves: &[Octave], basis: Basis, amplitude: f64) -> Result<Vec<f32>, NodeError> {
    let sheets = || Sheets::new(octaves, basis, |octave| scale(octave, amplitude) * basis.scale());
    raster::raster(job, sheets, &Sum { start: 0.0 })
}

/// As [`lattices`], at the first `cells` places of the octaves' own axes, see [`Octave::seen`].
///
/// # Errors
/// [`NodeError::Cancelled`].
pub(crate) fn places(
    job: &Job<'_>,
    cells: [usize; 2],
    octaves: &[Octave],
    basis: Basis,
    amplitude: f64,
) -> Result<Vec<f32>, NodeError> {
    let sheets = || Sheets::new(octaves, basis, |octave| scale(octave, amplitude) * basis.scale());
    raster::places(job, cells, sheets, &Sum { start: 0.0 })
}

/// Returns the slopes along x and y of a sum of octaves, each per its own wavelength, times `amplitude` and its weight.
/// Their standard deviation is [`SLOPE`] times that of [`lattices`] for the same octaves of [`Basis::Bell`].
///
/// # Errors
/// [`NodeError::Cancelled`].
pub(crate) fn slopes(
    job: &Job<'_>,
    octaves: &[Octave],
    basis: Basis,
    amplitude: f64,
) -> Result<[Vec<f32>; 2], NodeError> {
    let sheets = || Sheets::sloped(octaves, basis, |octave| scale(octave, amplitude) * basis.scale());
    Ok([raster::raster(job, sheets, &Slope::<0>)?, raster::raster(job, sheets, &Slope::<1>)?])
}

/// Standard deviation of the slope of an octave of [`Basis::Bell`], per wavelength and axis, over that of its height.
pub(crate) const SLOPE: f64 = 2.337;

/// The sum of the slopes along an axis.
struct Slope<const AXIS: usize>;

impl<const AXIS: usize> Combine for Slope<AXIS> {
    type State = Lanes;
    type Layer = ();
    const SLOPES: bool = true;

    fn layer(&self, _: usize) {}

    fn start(&self) -> Lanes {
        Lanes::splat(0.0)
    }

    #[inline(always)]
    fn octave((): &(), noise: &Noise, sums: &mut Lanes) {
        for (sum, slope) in sums.0.iter_mut().zip(noise.slope[AXIS]) {
            *sum += slope;
        }
    }

    #[inline(always)]
    fn finish(&self, sums: &Lanes) -> Lanes {
        *sums
    }
}

/// Returns the amplitude of an octave.
pub(crate) fn scale(octave: &Octave, amplitude: f64) -> f32 {
    (amplitude * octave.share * octave.fade) as f32
}

/// The sum of octaves, starting from a number.
pub(crate) struct Sum {
    /// The number.
    pub start: f32,
}

impl Combine for Sum {
    type State = Lanes;
    type Layer = ();

    fn layer(&self, _: usize) {}

    fn start(&self) -> Lanes {
        Lanes::splat(self.start)
    }

    #[inline(always)]
    fn octave((): &(), noise: &Noise, heights: &mut Lanes) {
        for (height, noise) in heights.0.iter_mut().zip(noise.value) {
            *height += noise;
        }
    }

    #[inline(always)]
    fn finish(&self, heights: &Lanes) -> Lanes {
        *heights
    }
}
