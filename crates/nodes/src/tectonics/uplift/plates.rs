//! Drifting plates: terrain rises where they collide and sinks where they diverge.
//!
//! Plates are the Voronoi cells of one site per square of a lattice; a hash gives each a drift. With weights `pₐ ∝
//! exp(−|x − a|² / 2σ²)` of the sites, the velocity `v = Σ pₐ vₐ` is that of the nearest plate, smoothed across the
//! boundaries. Its convergence is a covariance, `−∇·v = −Σ pₐ vₐ·(a − ā) / σ²`, with `ā = Σ pₐ a`. Between two sites at
//! a distance D the weights change over `σ² / D`. With `σ² = w L`, a boundary is therefore about w wide where sites are
//! L apart, and the total convergence of two plates does not depend on that width.

use orograph_graph::{memory::zeroed, mix};

use crate::{
    numerics::{math, par},
    prelude::*,
};

/// Size, boundaries and speed of plates.
pub(super) struct Plates {
    /// Mean distance of neighbouring sites.
    pub size_m: f64,
    /// Width of their boundaries.
    pub belt_m: f64,
    /// Rate where two plates at the mean distance collide head-on at full speed.
    pub rate: f64,
    /// Seed of the run.
    pub seed: u32,
}

/// A plate's centre, in lattice squares, and its velocity as a fraction of the fastest.
#[derive(Clone, Copy, Default)]
struct Site {
    at: [f64; 2],
    drift: [f64; 2],
}

/// Lattice squares searched on each side. Sites stay [`MARGIN`] away from the borders of their squares, so that one is
/// within 1.21 and all sites beyond the search are at least 2.15 away: with belts of at most a tenth of a plate, these
/// have weights below 2·10⁻⁷.
const AROUND: i64 = 2;
const MARGIN: f64 = 0.15;
/// Widest belt, as a fraction of a plate.
pub(super) const WIDEST: f64 = 0.1;

/// Number of sites that are evaluated at a place.
const SITES: usize = ((2 * AROUND + 1) * (2 * AROUND + 1)) as usize;

impl Plates {
    /// Returns the rate at every cell of the job's window.
    pub(super) fn raster(&self, job: &Job<'_>) -> Result<Vec<f32>, NodeError> {
        let window = job.window();
        let squares = |metres: f64| metres / self.size_m;
        let xs: Vec<f64> = (0..window.nx()).map(|i| squares(window.centre_m(i, 0)[0])).collect();
        let variance = squares(self.belt_m);
        let mut uplift = zeroed(window.len())?;
        par::rows(job, &mut uplift, |j, row| {
            let y = squares(window.centre_m(0, j)[1]);
            let mut square = [i64::MIN; 2];
            let mut sites = [Site::default(); SITES];
            for (value, &x) in row.iter_mut().zip(&xs) {
                let own = [x.floor() as i64, y.floor() as i64];
                if own != square {
                    square = own;
                    sites = self.sites(own);
                }
                *value = (self.rate * 2.0 * convergence(&sites, [x, y], variance)) as f32;
            }
        })?;
        Ok(uplift)
    }

    /// Returns the sites in and around a square.
    fn sites(&self, [column, row]: [i64; 2]) -> [Site; SITES] {
        let mut sites = [Site::default(); SITES];
        let squares = (-AROUND..=AROUND).flat_map(|dy| (-AROUND..=AROUND).map(move |dx| (column + dx, row + dy)));
        for (site, (column, row)) in sites.iter_mut().zip(squares) {
            // only the low 32 bits of a lattice index: the pattern repeats after four thousand million plates
            let key = mix((column as u32)
                .wrapping_mul(0x8da6_b343)
                .wrapping_add(mix((row as u32).wrapping_mul(0xd816_3841).wrapping_add(self.seed))));
            let unit = |salt: u32| f64::from(mix(key ^ salt) >> 8) / f64::from(1 << 24);
            let place = |salt: u32| MARGIN + (1.0 - 2.0 * MARGIN) * unit(salt);
            let azimuth = std::f64::consts::TAU * unit(0x9e37_79b9);
            let speed = 0.5 + 0.5 * unit(0x3c6e_f372);
            *site = Site {
                at: [column as f64 + place(0xdaa6_6d2b), row as f64 + place(0x78dd_e6e4)],
                drift: [speed * math::cos(azimuth), speed * math::sin(azimuth)],
            };
        }
        sites
    }
}

/// Returns the convergence `−∇·v` at a place, times σ², in lattice squares and fractions of the greatest speed: `Σ pₐ
/// (ā − a)·vₐ`.
///
/// Between two sites at a distance D that approach at the speed c it is `¼ c D / cosh²(d D / 2σ²)` at the distance d
/// from their boundary.
fn convergence(sites: &[Site; SITES], [x, y]: [f64; 2], variance: f64) -> f64 {
    let offsets = sites.map(|site| [site.at[0] - x, site.at[1] - y]);
    let squares = offsets.map(|[dx, dy]| dx * dx + dy * dy);
    let least = squares.iter().copied().fold(f64::INFINITY, f64::min);
    let (mut total, mut mean, mut drift, mut product) = (0.0, [0.0; 2], [0.0; 2], 0.0);
    for ((site, offset), square) in sites.iter().zip(offsets).zip(squares) {
        let exponent = (least - square) / (2.0 * variance);
        // e^-40 is below the last bit of a sum with a term of 1
        if exponent > -40.0 {
            let weight = math::exp(exponent);
            total += weight;
            for axis in 0..2 {
                mean[axis] += weight * offset[axis];
                drift[axis] += weight * site.drift[axis];
                product += weight * offset[axis] * site.drift[axis];
            }
        }
    }
    (mean[0] * drift[0] + mean[1] * drift[1]) / (total * total) - product / total
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two sites, with all others too far away to matter.
    fn pair(distance: f64, closing: f64) -> [Site; SITES] {
        let mut sites = [Site { at: [1e3, 1e3], drift: [1.0, 0.0] }; SITES];
        sites[3] = Site { at: [-0.5 * distance, 0.2], drift: [0.5 * closing, 0.7] };
        sites[8] = Site { at: [0.5 * distance, 0.2], drift: [-0.5 * closing, -0.1] };
        sites
    }

    #[test]
    fn two_plates_meet_as_the_closed_form_says() {
        for (distance, closing) in [(1.0, 2.0), (0.6, 1.3), (1.4, -0.8)] {
            let sites = pair(distance, closing);
            let mut flux = 0.0;
            for k in -400..=400 {
                let (d, variance) = (f64::from(k) * 1e-3, 0.05);
                let got = convergence(&sites, [d, 0.9], variance);
                let cosh = 0.5 * (math::exp(0.5 * d * distance / variance) + math::exp(-0.5 * d * distance / variance));
                let expected = 0.25 * closing * distance / (cosh * cosh);
                // rounding of a difference of sums of order 1
                assert!((got - expected).abs() < 1e-14, "{d}: {got} {expected}");
                flux += got / variance * 1e-3;
            }
            // the total convergence between the plates is their closing speed, whatever the width of the belt: tanh(0.4
            // · 0.6 / 0.1) = 0.984
            assert!((flux / closing - 1.0).abs() < 0.02, "{flux} {closing}");
        }
    }

    #[test]
    fn sites_beyond_reach_weigh_nothing() {
        let plates = Plates { size_m: 1.0, belt_m: WIDEST, rate: 1.0, seed: 5 };
        let mut worst = 0.0_f64;
        for k in 0..2000_u32 {
            // both sides of a border between squares, across which the evaluated sites change
            let y = f64::from(k) * 0.0173;
            let column = i64::from(k % 37) - 18;
            let [west, east] = [column - 1, column].map(|column| {
                convergence(&plates.sites([column, y.floor() as i64]), [(k % 37) as f64 - 18.0, y], WIDEST)
            });
            worst = worst.max((west - east).abs());
        }
        // 5 sites with a weight of at most e^-16, each about 3 away
        assert!(worst < 2e-6, "{worst}");
    }
}
