//! Octaves of a fractal sum: wavelengths, weights and seeds, and which of them a raster can represent.

use orograph_graph::{World, mix};

use super::lattice::Axis;

/// A fractal sum in world units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fractal {
    /// Wavelength of the first octave in metres.
    pub wavelength_m: f64,
    /// Octaves requested; those too fine for the raster are omitted.
    pub octaves: i64,
    /// Ratio of each octave's wavelength to that of the next.
    pub lacunarity: f64,
    /// Ratio of each octave's amplitude to that of the one before.
    pub gain: f64,
    /// Makes opposite sides of the world match; wavelengths are then rounded to whole fractions of its sides.
    pub tileable: bool,
    /// Seed of the run.
    pub seed: u32,
}

/// One octave on a raster.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Octave {
    /// Positions in its lattice along x and y.
    pub axes: [Axis; 2],
    /// Seed of its draws.
    pub seed: u32,
    /// Wavelength in cells.
    pub wavelength_cells: f64,
    /// Its weight as a fraction of all requested octaves: gainᵏ / Σ gainᵏ.
    pub share: f64,
    /// Fraction that the raster can represent: 1 for wavelengths of 4.8 cells and more, 0 for 2.4 and less.
    pub fade: f64,
}

impl Octave {
    /// Returns the same octave sampled every `cells` cells of the world, less than a wavelength, at places counted from
    /// the world's corner, starting with column and row `first`.
    pub fn seen(&self, cells: f64, first: [i64; 2]) -> Self {
        let axes = [0, 1].map(|axis| self.axes[axis].seen(cells, first[axis]));
        Self { axes, ..*self }
    }
}

impl Fractal {
    /// Returns the octaves that the cells of a world can represent, from coarse to fine.
    ///
    /// 99 % of the energy of gradient noise is below 1.2 cycles per wavelength, so 2.4 cells per wavelength are needed;
    /// the fade ends at twice that. An octave's weight is its fraction of all requested octaves, whether or not the
    /// raster can represent them, so that a finer raster only adds detail.
    pub fn octaves(&self, world: &World) -> Vec<Octave> {
        let cell_m = world.cell_m();
        let total: f64 = self.amplitudes().sum();
        let wavelengths = std::iter::successors(Some(self.wavelength_m), |w| Some(w / self.lacunarity));
        self.amplitudes()
            .zip(wavelengths)
            .zip(0..)
            .map_while(|((amplitude, wavelength_m), k)| {
                let wavelength_cells = wavelength_m / cell_m;
                let fade = crate::numerics::math::smoothstep((wavelength_cells - 2.4) / (4.8 - 2.4));
                if fade <= 0.0 {
                    return None;
                }
                let seed = mix(self.seed.wrapping_add(k));
                let shifts = [mix(seed ^ 0x9e37_79b9), mix(seed ^ 0x3c6e_f372)];
                let axes = std::array::from_fn(|axis| {
                    let cells = f64::from(world.cells[axis]);
                    let periods = (cells / wavelength_cells).round().max(1.0);
                    if self.tileable {
                        Axis::new(periods / cells, shifts[axis], periods as i32)
                    } else {
                        Axis::new(1.0 / wavelength_cells, shifts[axis], 0)
                    }
                });
                Some(Octave { axes, seed, wavelength_cells, share: amplitude / total, fade })
            })
            .collect()
    }

    /// Returns all requested octaves at full weight, sampled evenly over the cells of their lattices with phases that
    /// differ from octave to octave: for measuring the moments of sums and recursions.
    pub fn spread(&self) -> Vec<Octave> {
        let total: f64 = self.amplitudes().sum();
        let octave = |(k, amplitude): (u32, f64)| {
            let seed = mix(k);
            let shifts = [mix(seed ^ 0x9e37_79b9), mix(seed ^ 0x3c6e_f372)];
            let step = 0.381 + 0.0137 * f64::from(k);
            let axes = shifts.map(|shift| Axis::new(step, shift, 0));
            Octave { axes, seed, wavelength_cells: 1e6, share: amplitude / total, fade: 1.0 }
        };
        (0..).zip(self.amplitudes()).map(octave).collect()
    }

    /// Returns gainᵏ of every requested octave.
    pub fn amplitudes(&self) -> impl Iterator<Item = f64> {
        let gain = self.gain;
        let octaves = usize::try_from(self.octaves).unwrap_or(0);
        std::iter::successors(Some(1.0), move |a| Some(a * gain)).take(octaves)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRACTAL: Fractal =
        Fractal { wavelength_m: 4000.0, octaves: 16, lacunarity: 2.0, gain: 0.5, tileable: false, seed: 7 };

    fn octaves(cell_m: f64) -> Vec<Octave> {
        FRACTAL.octaves(&crate::testing::world(100, 100, cell_m))
    }

    #[test]
    fn the_raster_decides_how_many_octaves_there_are_and_nothing_else() {
        let (coarse, fine) = (octaves(20.0), octaves(10.0));
        // 4000 m / 20 m = 200 cells; 200 / 2⁶ = 3.1 cells is the last wavelength above 2.4
        assert_eq!((coarse.len(), fine.len()), (7, 8));
        for (a, b) in coarse.iter().zip(&fine) {
            assert_eq!((a.seed, a.share.to_bits()), (b.seed, b.share.to_bits()));
        }
        assert_eq!((coarse[5].fade, fine[6].fade), (1.0, 1.0));
        assert!(coarse[6].fade > 0.0 && coarse[6].fade < 1.0);
        // the weights of all requested octaves sum to 1
        let all: f64 = octaves(1e-3).iter().map(|octave| octave.share).sum();
        assert!((all - 1.0).abs() < 1e-12, "{all}");
    }

    #[test]
    fn a_wavelength_below_the_cells_leaves_no_octave() {
        assert!(octaves(4000.0).is_empty());
        assert!(octaves(1e300).is_empty());
    }
}
