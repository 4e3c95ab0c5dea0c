//! What the surface of a terrain shows of strata.

use orograph_graph::{Strata, memory::zeroed};

use crate::{
    numerics::{
        beds::{Beds, Ground},
        light::linear,
        par,
    },
    prelude::*,
};

/// Strata, and the terrain that cuts them.
pub struct Surface<'a> {
    /// The rock.
    pub strata: &'a Strata,
    /// The terrain.
    pub height: &'a Field,
}

impl Surface<'_> {
    /// Number of the layer, from 1.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`], also of the other functions.
    pub fn layer(&self, job: &Job<'_>) -> Result<Field, NodeError> {
        self.each(job, |layer| (layer + 1) as f32)
    }

    /// Hardness.
    pub fn hardness(&self, job: &Job<'_>) -> Result<Field, NodeError> {
        let layers = &self.strata.column().layers;
        self.each(job, |layer| layers[layer].hardness as f32)
    }

    /// The steepest slope in degrees.
    pub fn repose(&self, job: &Job<'_>) -> Result<Field, NodeError> {
        let layers = &self.strata.column().layers;
        self.each(job, |layer| layers[layer].repose as f32)
    }

    /// The colour as linear RGB.
    pub fn colour(&self, job: &Job<'_>) -> Result<Field, NodeError> {
        let window = *self.height.window();
        let colours: Vec<[f64; 3]> = self.strata.column().layers.iter().map(|layer| linear(layer.colour)).collect();
        let mut samples = zeroed(3 * window.len())?;
        let mut planes = samples.chunks_exact_mut(window.len()).enumerate();
        planes.try_for_each(|(plane, samples)| self.fill(job, samples, |layer| colours[layer][plane] as f32))?;
        Ok(Field::with_planes(window, 3, samples))
    }

    fn each(&self, job: &Job<'_>, of: impl Fn(usize) -> f32 + Sync) -> Result<Field, NodeError> {
        let mut samples = zeroed(self.height.window().len())?;
        self.fill(job, &mut samples, of)?;
        Ok(Field::new(*self.height.window(), samples))
    }

    fn fill(&self, job: &Job<'_>, samples: &mut [f32], of: impl Fn(usize) -> f32 + Sync) -> Result<(), NodeError> {
        let beds = Beds::of_layers(self.strata.column());
        let ground = Ground { beds: &beds, offset: self.strata.offset().samples() };
        let (nx, heights) = (self.height.window().nx(), self.height.samples());
        par::rows_within(job, [0.7, 1.0], samples, |j, row| {
            for (cell, sample) in (j * nx..).zip(row) {
                *sample = of(ground.at(cell, f64::from(heights[cell])).layer);
            }
        })
    }
}
