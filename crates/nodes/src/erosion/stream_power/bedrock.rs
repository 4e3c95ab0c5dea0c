//! Layers of rock that rise with the land and that rivers cut into.

use orograph_graph::{
    Strata,
    memory::{OutOfMemory, zeroed},
};

use super::incision::Law;
use crate::{
    numerics::{
        beds::{Beds, Ground},
        math, par,
    },
    prelude::*,
};

/// The most layers that a step cuts one after the other; what is left of the step is taken at the mean hardness.
const MOST_CUTS: u32 = 8;

/// The rock under every cell.
#[derive(Debug)]
pub struct Bedrock<'a> {
    beds: Beds,
    offset: &'a [f32],
    uplift: Lane<'a>,
    /// How far rock has risen since the start, for an uplift of 1 m/yr.
    risen_yr: f64,
    /// The layer at the surface when the step began; a column has at most 10 000.
    layers: Vec<u16>,
    /// The tangent of the steepest slope of a cell over that of its layer, where it varies.
    stands: Option<Vec<f32>>,
}

impl<'a> Bedrock<'a> {
    /// The rock at the start. `stands` are the tangents of the steepest slopes that rock of `repose` has where they
    /// vary from place to place.
    ///
    /// # Errors
    /// [`OutOfMemory`].
    pub fn new(
        strata: &'a Strata,
        uplift: Lane<'a>,
        repose: Lane<'_>,
        mut stands: Option<Vec<f32>>,
    ) -> Result<Self, OutOfMemory> {
        for (cell, stands) in stands.iter_mut().flatten().enumerate() {
            let mean = math::tan(f64::from(repose.at(cell)).to_radians());
            *stands = if stands.is_finite() && mean > 0.0 { (f64::from(*stands) / mean) as f32 } else { 1.0 };
        }
        let layers = zeroed(strata.offset().samples().len())?;
        let (beds, offset) = (Beds::of_rock(strata.column()), strata.offset().samples());
        Ok(Self { beds, offset, uplift, risen_yr: 0.0, layers, stands })
    }

    /// One over the hardness of the column in the mean.
    #[must_use]
    pub fn mean_weakness(&self) -> f64 {
        self.beds.mean_weakness()
    }

    /// Looks up what lies at the surface after rock has risen for `risen_yr` times the uplift. The tangents of the
    /// steepest slopes go into `steepest`.
    pub fn look_up(&mut self, risen_yr: f64, heights: &[f64], steepest: &mut [f32]) {
        self.risen_yr = risen_yr;
        let (uplift, stands) = (self.uplift, self.stands.as_deref());
        let ground = Ground { beds: &self.beds, offset: self.offset };
        let size = 1 << 14;
        let parts = self.layers.chunks_mut(size).zip(steepest.chunks_mut(size)).zip(heights.chunks(size));
        par::all(parts, |part, ((layers, steepest), heights)| {
            for (at, height) in heights.iter().enumerate() {
                let cell = part * size + at;
                let layer = ground.at(cell, height - f64::from(uplift.at(cell)) * risen_yr).layer;
                layers[at] = layer as u16;
                let stands = stands.map_or(1.0, |stands| f64::from(stands[cell]));
                steepest[at] = (ground.beds.tangents[layer] * stands) as f32;
            }
        });
    }

    /// One over the hardness at the surface of a cell when the step began.
    #[must_use]
    #[inline(always)]
    pub fn weakness(&self, cell: usize) -> f64 {
        self.beds.weakness[usize::from(self.layers[cell])]
    }

    const fn ground(&self) -> Ground<'_> {
        Ground { beds: &self.beds, offset: self.offset }
    }

    /// One over the hardness of a cell at an elevation, before the rock has risen.
    #[must_use]
    pub fn weakness_at_start(&self, cell: usize, elevation_m: f64) -> f64 {
        self.ground().weakness(cell, elevation_m)
    }

    /// What is left of the drop from a cell to `below` after a step, layer by layer. `coefficient` is that of rock of
    /// hardness 1 for the whole step.
    ///
    /// In a layer a drop b becomes x in the share s of the step for which x + s C xⁿ = b. Where it is cut through
    /// before the step ends, x is what is left at its base, and the next layer has the rest of the step. So the result
    /// hardly depends on the length of the step.
    #[must_use]
    pub fn left(&self, law: &Law, n: f64, cell: usize, coefficient: f64, [height, below]: [f64; 2]) -> f64 {
        let risen_m = f64::from(self.uplift.at(cell)) * self.risen_yr;
        let ground = self.ground();
        let mut bed = ground.at(cell, height - risen_m);
        let (mut height, mut rest) = (height, 1.0);
        for _ in 0..MOST_CUTS {
            let own = law.times(coefficient, law.coefficient(self.beds.weakness[bed.layer]));
            let drop = height - below;
            let left = law.left(law.times(own, law.coefficient(rest)), drop);
            let base = ground.base_m(cell, bed) + risen_m;
            if below + left >= base || base <= below {
                return left;
            }
            let at_base = base - below;
            let power = if n == 1.0 { at_base } else { math::pow(at_base, n) };
            rest -= (drop - at_base).max(0.0) / (law.value(own) * power);
            if rest <= 0.0 {
                return at_base;
            }
            (height, bed) = (base, self.beds.below(bed));
        }
        // layers that are thin against the step: time adds up over them, and so does hardness
        let mean = law.times(coefficient, law.coefficient(rest / self.beds.mean_hardness));
        law.left(mean, height - below)
    }

    /// The rock where it is after a run in which it has risen for `risen_yr` times the uplift.
    #[must_use]
    pub fn moved(strata: &Strata, uplift: Lane<'_>, risen_yr: f64) -> Strata {
        let (offset, cosine) = (strata.offset(), strata.column().cosine);
        let moved = par::map(offset.samples().len(), |cell| {
            (f64::from(offset.samples()[cell]) + cosine * f64::from(uplift.at(cell)) * risen_yr) as f32
        });
        strata.on(Field::new(*offset.window(), moved))
    }
}
