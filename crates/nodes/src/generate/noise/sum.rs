//! The plain sum of octaves: fractional Brownian motion.
//!
//! F. K. Musgrave, C. E. Kolb and R. S. Mace (1989), "The synthesis and rendering of eroded fractal terrains".

use orograph_graph::{Job, NodeError};

use super::{
    Basis, Octave,
    raster::{self, Combine, Lanes, Noise},
    sheet::Sheet,
};

/// The sum of octaves of lattice noise, between ± `amplitude`, in the unit of that.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub(crate) fn lattices(job: &Job<'_>, octaves: &[Octave], basis: Basis, amplitude: f64) -> Result<Vec<f32>, NodeError> {
    let sheet = |octave: &Octave| Sheet::new(*octave, basis, scale(octave, amplitude) * basis.scale());
    raster::raster(job, || octaves.iter().map(sheet).collect(), &Sum { start: 0.0 })
}

/// An octave's share of the amplitude.
pub(crate) fn scale(octave: &Octave, amplitude: f64) -> f32 {
    (amplitude * octave.share * octave.fade) as f32
}

/// The sum of octaves and a number.
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
