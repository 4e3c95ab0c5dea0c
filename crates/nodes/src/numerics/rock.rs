//! How hard rock is and how steeply it stands from place to place: the fields that processes share.
//!
//! Both are sums of waves as functions of position. Nodes with the same seed, size and deviation therefore see the same
//! rock, whatever their cells.

use orograph_graph::{Edge, Job, Lane, NodeError, mix};

use super::{
    math,
    noise::{Basis, Fractal, Octave, sum},
    par,
    waves::Waves,
};

/// Spectral slopes of the hardness, of the slope at which rock gives way and of the length of hillslopes.
const SPECTRAL_SLOPES: [f64; 3] = [2.5, 2.4, 3.0];
/// How much longer rock is along its strike than across it.
const STRETCH: f64 = 2.5;
/// Waves are cut off at so many standard deviations.
pub(crate) const MOST_DEVIATIONS: f32 = 2.5;
/// Correlation of the slope at which rock gives way with its hardness.
const HARD_IS_STEEP: f32 = 0.5;

/// Bodies of rock in a world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bodies {
    /// Size of the largest bodies in metres.
    pub longest_m: f64,
    /// The shortest waves in metres.
    pub shortest_m: f64,
}

impl Bodies {
    /// Returns how soft the rock of each cell is, in standard deviations from the mean.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub(crate) fn softness(&self, job: &Job<'_>) -> Result<Vec<f32>, NodeError> {
        self.waves(job, 0, STRETCH)
    }

    /// Returns the tangent of the steepest slope of each cell, for rock of which `repose` is the mean and
    /// `deviation_deg` the standard deviation. `softness` is that of [`Self::softness`].
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub(crate) fn steepest(
        &self,
        job: &Job<'_>,
        repose: Lane<'_>,
        deviation_deg: f64,
        softness: &[f32],
    ) -> Result<Vec<f32>, NodeError> {
        let mut steepest = self.waves(job, 1, 1.0)?;
        let own = (1.0 - HARD_IS_STEEP * HARD_IS_STEEP).sqrt();
        par::change_at(&mut steepest, |cell, steepest| {
            let waves = (own * *steepest - HARD_IS_STEEP * softness[cell]).clamp(-MOST_DEVIATIONS, MOST_DEVIATIONS);
            let mean = f64::from(repose.at(cell));
            *steepest = if mean < 90.0 {
                let mean = mean.max(0.0);
                let degrees = (mean + deviation_deg * f64::from(waves)).clamp(0.3 * mean, 89.0);
                math::tan(degrees.to_radians()) as f32
            } else {
                // and where `repose` is void
                f32::INFINITY
            };
        });
        Ok(steepest)
    }

    /// Returns how long the hillslopes of each cell are, in standard deviations of the logarithm from the mean.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub(crate) fn hillslopes(&self, job: &Job<'_>) -> Result<Vec<f32>, NodeError> {
        self.waves(job, 2, STRETCH)
    }

    fn waves(&self, job: &Job<'_>, which: usize, stretch: f64) -> Result<Vec<f32>, NodeError> {
        let seed = mix(job.seed() ^ mix(0x5EED_0001 + which as u32));
        let grain = grain(job.seed());
        let waves = Waves { longest_m: self.longest_m, spectral_slope: SPECTRAL_SLOPES[which], stretch, grain, seed };
        waves.field(job, &job.window(), self.shortest_m)
    }
}

/// The direction of the strike of the rock for a seed, in radians.
#[must_use]
pub(crate) fn grain(seed: u32) -> f64 {
    f64::from(mix(seed)) * (std::f64::consts::PI / 4_294_967_296.0)
}

/// The longest wavelength of knolls, in lengths of hillslopes.
const LONGEST_KNOLLS: f64 = 0.5;
/// The part of the first octave of knolls in the sum of all.
const FIRST_OCTAVE: f64 = 0.5;
/// Standard deviation of the slope of an octave of knolls along one axis, per wavelength, for an amplitude of 1.
const OCTAVE_SLOPE: f64 = 0.49;

/// The knolls and hollows of hillslopes on rock that is harder or softer over short distances, in metres of height per
/// slope of the hillslope: octaves of equal slope, whose standard deviation is `roughness`, from half of `hillslope_m`
/// down to a few cells.
#[derive(Debug)]
pub(crate) struct Knolls {
    octaves: Vec<Octave>,
    amplitude_m: f64,
}

impl Knolls {
    /// The knolls that the cells of a job can hold.
    pub(crate) fn new(job: &Job<'_>, roughness: f64, hillslope_m: f64) -> Self {
        let wavelength_m = LONGEST_KNOLLS * hillslope_m;
        if roughness <= 0.0 || wavelength_m <= 0.0 {
            return Self { octaves: Vec::new(), amplitude_m: 0.0 };
        }
        let seed = mix(job.seed() ^ mix(0x5EED_0003));
        let world = job.window().world;
        let octaves = |tileable: bool| {
            Fractal { wavelength_m, octaves: 24, lacunarity: 2.0, gain: 0.5, tileable, seed }.octaves(&world)
        };
        // joined sides need lattices that repeat there
        let is_joined = [world.boundary.west, world.boundary.north].map(|side| side == Edge::Periodic);
        let axes = |(plain, tiled): (&Octave, &Octave)| {
            std::array::from_fn(|axis| if is_joined[axis] { tiled.axes[axis] } else { plain.axes[axis] })
        };
        // waves that are squeezed into a small world would be steeper
        let squeezed = |(plain, tiled): (&Octave, &Octave)| {
            let shorter = |axis: usize| plain.axes[axis].step as f64 / tiled.axes[axis].step as f64;
            (0..2).filter(|axis| is_joined[*axis]).map(shorter).fold(1.0, f64::min)
        };
        // all waves at full height that cells can represent
        let full = |both: (Octave, Octave)| {
            Octave {
                fade: 1.0,
                axes: axes((&both.0, &both.1)),
                share: both.0.share * squeezed((&both.0, &both.1)),
                ..both.0
            }
            .seen(1.0, [0; 2])
        };
        let octaves = octaves(false).into_iter().zip(octaves(true)).map(full).collect();
        Self { octaves, amplitude_m: roughness * wavelength_m / (OCTAVE_SLOPE * FIRST_OCTAVE) }
    }

    /// The sum of all octaves. Empty where there are none, or cells are too large for them.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub(crate) fn all(&self, job: &Job<'_>) -> Result<Vec<f32>, NodeError> {
        if self.octaves.is_empty() { Ok(Vec::new()) } else { self.of(job, &self.octaves) }
    }

    /// The wavelength of each octave in cells.
    pub(crate) fn wavelengths(&self) -> impl Iterator<Item = f64> {
        self.octaves.iter().map(|octave| octave.wavelength_cells)
    }

    /// One octave.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub(crate) fn octave(&self, job: &Job<'_>, k: usize) -> Result<Vec<f32>, NodeError> {
        self.of(job, &self.octaves[k..=k])
    }

    fn of(&self, job: &Job<'_>, octaves: &[Octave]) -> Result<Vec<f32>, NodeError> {
        let window = job.window();
        sum::places(job, [window.nx(), window.ny()], octaves, Basis::Bell, self.amplitude_m)
    }
}

/// Returns the tangent of a steepest slope in degrees; infinite for 90° and for a void.
pub(crate) fn tangent(degrees: f32) -> f64 {
    let degrees = f64::from(degrees).clamp(0.0, 90.0);
    if degrees < 90.0 { math::tan(degrees.to_radians()) } else { f64::INFINITY }
}
