//! Transverse dunes: ridges whose crests wind, end and join.

use orograph_graph::{memory::zeroed, mix};

use super::{Params, SALTS, defects::Defects};
use crate::{
    numerics::{
        math,
        noise::{Basis, Fractal, sum},
        par,
    },
    prelude::*,
};

impl Params {
    /// Returns the heights of ridges.
    pub(super) fn ridges(&self, job: &Job<'_>, slip: f64) -> Result<Vec<f32>, NodeError> {
        let window = job.window();
        let [wind_x, wind_y] = self.wind();
        let fractal = |salt: u32| Fractal {
            wavelength_m: 4.0 * self.wavelength,
            octaves: 2,
            lacunarity: 2.0,
            gain: 0.4,
            tileable: false,
            seed: mix(job.seed() ^ salt),
        };
        let bends = fractal(SALTS[0]).octaves(job.world());
        let bend_m = 4.0 * self.waviness * self.wavelength;
        let bend = sum::lattices(job, &bends, Basis::Bell, bend_m)?;
        // slopes per wavelength of each octave; the second noise has twice as many octaves
        let [along, down] = self.slopes(job, fractal(SALTS[0]), bend_m)?;
        let lows = fractal(SALTS[1]).octaves(job.world());
        let low = sum::lattices(job, &lows, Basis::Bell, 1.5 * self.waviness)?;
        let mut heights = zeroed(window.len())?;
        let seed = mix(job.seed() ^ SALTS[2]);
        par::rows(job, &mut heights, |j, row| {
            let mut defects = Defects::new(self.defects, seed);
            for (i, height) in row.iter_mut().enumerate() {
                let at = j * window.nx() + i;
                let [x, y] = window.centre_m(i, j);
                let mut phase = (x * wind_x + y * wind_y + f64::from(bend[at])) / self.wavelength;
                // ratio of the local crest spacing on straight ridges to the one here
                let (mut gx, mut gy) = (wind_x + f64::from(along[at]), wind_y + f64::from(down[at]));
                let mut share = 1.0 - f64::from(low[at]).abs().min(0.5);
                if self.defects > 0.0 {
                    let shift = defects.shift([phase, (x * wind_y - y * wind_x) / self.wavelength]);
                    let [along, across] = shift.slope;
                    phase += shift.by;
                    gx += gx * along + wind_y * across;
                    gy += gy * along - wind_x * across;
                    share *= shift.share;
                }
                let closer = (gx * gx + gy * gy).sqrt().max(0.2);
                let most_m = 0.5 * slip * self.wavelength / closer;
                *height =
                    ridge(phase.rem_euclid(1.0), (share * self.height).min(most_m), self.wavelength / closer, slip)
                        as f32;
            }
        })?;
        Ok(heights)
    }

    /// Returns the slopes in m/m of the noise that bends crests, summed over its octaves.
    fn slopes(&self, job: &Job<'_>, fractal: Fractal, bend_m: f64) -> Result<[Vec<f32>; 2], NodeError> {
        let octaves = fractal.octaves(job.world());
        let mut slopes = [zeroed(job.window().len())?, zeroed(job.window().len())?];
        for octave in &octaves {
            let per_metre = 1.0 / (octave.wavelength_cells * job.cell_m());
            let part = sum::slopes(job, &[*octave], Basis::Bell, bend_m * per_metre)?;
            for (sum, part) in slopes.iter_mut().zip(&part) {
                sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
            }
        }
        Ok(slopes)
    }
}

/// Returns the height at the fraction `share` of the way between the feet of a ridge.
fn ridge(share: f64, height_m: f64, wavelength_m: f64, slip: f64) -> f64 {
    let crest = 1.0 - height_m / (wavelength_m * slip);
    if share < crest {
        height_m * (0.5 - 0.5 * math::cos(std::f64::consts::PI * share / crest))
    } else {
        (1.0 - share) * wavelength_m * slip
    }
}
