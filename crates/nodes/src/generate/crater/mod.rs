//! Impact craters: one, or a field of them with the size distribution of old surfaces.
//!
//! Profiles after R. J. Pike (1977), "Size-dependence in the shape of fresh impact craters on the moon": simple craters
//! have a depth of a fifth of their diameter. The size distribution is the steady production N(> D) ∝ D⁻² (H. J.
//! Melosh, 1989, "Impact Cratering"), for which every octave of diameters covers the same area.

mod form;

use orograph_graph::{memory::zeroed, mix};

use self::form::{EJECTA, Own, Shape};
use crate::{numerics::par, prelude::*};

choice! {
    /// Number of craters.
    pub enum Pattern {
        /// One, at `centre`.
        One = "one",
        /// As many as `cover` requires, at random positions.
        Field = "field",
    }
}

params! {
    /// Number of craters.
    pattern: Pattern = Pattern::Field, One, ..;
    /// Centre of the single crater, from the world's north-west corner.
    centre: Position = Position([8192.0, 8192.0]), Metres, -1e7..=1e7, when pattern = "one";
    /// Rim-to-rim diameter of the single crater, or of the largest.
    diameter: f64 = 4000.0, Metres, 0.01..=1e6, soft 100..=20000;
    /// Diameter of the smallest crater of a field.
    smallest: f64 = 150.0, Metres, 0.01..=1e6, soft 10..=1000, when pattern = "field";
    /// Fraction of the ground that the craters of each octave of diameters cover.
    cover: f64 = 0.12, One, 0.0..=0.36, soft 0..=0.3, when pattern = "field";
    /// Depth of a fresh crater below the surrounding ground, as a fraction of its diameter.
    depth: f64 = 0.16, One, 0.0..=0.5, soft 0.05..=0.25;
    /// Height of a fresh crater's rim above the surrounding ground, as a fraction of its diameter.
    rim: f64 = 0.04, One, 0.0..=0.2, soft 0..=0.08;
    /// Diameter above which craters are complex: 15 km on the Moon, 7 on Mars, 3 on Earth.
    transition: f64 = 15000.0, Metres, 1.0..=1e6, soft 1000..=20000;
    /// Fraction of depth and rim that the oldest craters of a field have lost.
    wear: f64 = 0.8, One, 0.0..=1.0, when pattern = "field";
    /// How uneven rims, walls, terraces and peaks are: 0 for bodies of revolution with sharp rims.
    irregularity: f64 = 0.6, One, 0.0..=1.0;
    /// How rough the ejecta are: hummocks near the rim, radial ridges beyond; 0 for an even blanket.
    ejecta: f64 = 0.6, One, 0.0..=1.0;
    /// Random seed.
    seed: Seed = Seed(0), Count, ..;
}

outputs! {
    /// Height above the surrounding ground.
    height: Height;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Crater",
    version: 2,
    migrations: &[Migration {
        from: 1,
        steps: &[Step::Keep { name: "irregularity", value: "0" }, Step::Keep { name: "ejecta", value: "0" }],
    }],
    category: "generate",
    summary: "Impact craters: one, or a field of all sizes.",
    doc: include_str!("page.md"),
    sources: &[
        "R. J. Pike (1977), Size-dependence in the shape of fresh impact craters on the moon, in Impact and Explosion \
         Cratering, Pergamon",
        "H. J. Melosh (1989), Impact Cratering: A Geologic Process, Oxford University Press",
    ],
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    example: "diameter: 6000, smallest: 1500",
    ..Node::DEFAULT
};

/// Diameter of the smallest crater that is drawn, in cells.
const CELLS: f64 = 4.0;
/// Average fraction of a square that a crater of its octave covers, with squares as wide as the octave's largest
/// crater: `π/4 · ∫ D⁻¹ dD / ∫ D⁻³ dD` from ½ to 1.
const SHARE: f64 = std::f64::consts::FRAC_PI_4 * std::f64::consts::LN_2 / 1.5;
/// Rows per task.
const BAND: usize = 32;
/// Number of lattice squares after which the pattern repeats.
const FAR: f64 = 2_147_483_648.0;

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let window = job.window();
    let mut height = zeroed(window.len())?;
    let shape = Shape {
        depth: params.depth,
        rim: params.rim,
        transition_m: params.transition,
        irregularity: params.irregularity,
        ejecta: params.ejecta,
    };
    let octaves = params.octaves(job)?;
    par::bands_within(job, [0.0, 1.0], BAND, &mut height, |first, rows| {
        let band = Band { window, first };
        if params.pattern == Pattern::One {
            let key = mix(job.seed());
            band.add(
                rows,
                &Crater { centre: params.centre.0, radius_m: 0.5 * params.diameter, fresh: 1.0, key },
                shape,
            );
            return job.check();
        }
        for octave in &octaves {
            let reach_m = 0.5 * EJECTA[1] * octave.largest_m;
            let [columns, lines] = band.squares(rows, reach_m, octave.largest_m);
            for line in lines[0]..=lines[1] {
                job.check()?;
                for column in columns[0]..=columns[1] {
                    if let Some(crater) = octave.crater(column, line) {
                        band.add(rows, &crater, shape);
                    }
                }
            }
        }
        Ok(())
    })?;
    Ok(Given { height: Some(Field::new(window, height)) }.into())
}

impl Params {
    /// Returns the octaves of diameters, from the largest down.
    fn octaves(&self, job: &Job<'_>) -> Result<Vec<Octave>, NodeError> {
        if self.pattern == Pattern::One {
            return Ok(Vec::new());
        }
        if self.smallest > self.diameter {
            return Err(NodeError::failed_with_hint(
                "the smallest crater is larger than the largest",
                format!("write `smallest: {}` or less", orograph_graph::plain(self.diameter)),
            ));
        }
        let smallest_m = self.smallest.max(CELLS * job.cell_m());
        let mut octaves = Vec::new();
        let mut largest_m = self.diameter;
        while largest_m >= smallest_m {
            let seed = mix(job.seed().wrapping_add(octaves.len() as u32));
            octaves.push(Octave { largest_m, smallest_m, chance: self.cover / SHARE, wear: self.wear, seed });
            largest_m *= 0.5;
        }
        Ok(octaves)
    }
}

/// Craters from half a diameter to that diameter: at most one in each square of a lattice.
struct Octave {
    largest_m: f64,
    /// Smallest diameter.
    smallest_m: f64,
    /// Probability that a square has a crater.
    chance: f64,
    wear: f64,
    seed: u32,
}

impl Octave {
    fn crater(&self, column: i64, line: i64) -> Option<Crater> {
        let row = mix((line as u32).wrapping_mul(0xd816_3841).wrapping_add(self.seed));
        let key = mix((column as u32).wrapping_mul(0x8da6_b343).wrapping_add(row));
        let unit = |salt: u32| (f64::from(mix(key ^ salt) >> 8) + 0.5) / f64::from(1 << 24);
        if unit(0x9e37_79b9) >= self.chance {
            return None;
        }
        let diameter_m = self.largest_m / (1.0 + 3.0 * unit(0x3c6e_f372)).sqrt();
        (diameter_m >= self.smallest_m).then(|| Crater {
            centre: [
                (column as f64 + unit(0xdaa6_6d2b)) * self.largest_m,
                (line as f64 + unit(0x78dd_e6e4)) * self.largest_m,
            ],
            radius_m: 0.5 * diameter_m,
            fresh: 1.0 - self.wear * unit(0x1715_609d),
            key,
        })
    }
}

struct Crater {
    centre: [f64; 2],
    radius_m: f64,
    /// Remaining fraction of the depth.
    fresh: f64,
    key: u32,
}

/// A band of rows of a window.
struct Band {
    window: Window,
    first: usize,
}

impl Band {
    /// Returns the first and last squares along x and y, of width `width_m`, that may hold a crater reaching these
    /// rows.
    fn squares(&self, rows: &[f32], reach_m: f64, width_m: f64) -> [[i64; 2]; 2] {
        let last = self.first + rows.len() / self.window.nx() - 1;
        let [low, high] = [self.window.centre_m(0, self.first), self.window.centre_m(self.window.nx() - 1, last)];
        let square = |at_m: f64| (at_m / width_m).floor().clamp(-FAR, FAR) as i64;
        [0, 1].map(|axis| [square(low[axis] - reach_m), square(high[axis] + reach_m)])
    }

    /// Adds a crater to the rows.
    fn add(&self, rows: &mut [f32], crater: &Crater, shape: Shape) {
        let radius_m = crater.radius_m;
        let form = shape.of(2.0 * radius_m);
        let own = Own { fresh: crater.fresh, key: crater.key, cell: self.window.cell_m() / radius_m };
        if form.is_even(&own) {
            self.draw(rows, crater, |[x, y]| form.even((x * x + y * y).sqrt() / radius_m) * own.fresh);
        } else {
            self.draw(rows, crater, |[x, y]| form.height([x / radius_m, y / radius_m], &own));
        }
    }

    /// Adds a height, given as a fraction of the diameter at a place in metres from the centre, where a crater reaches.
    fn draw(&self, rows: &mut [f32], crater: &Crater, height: impl Fn([f64; 2]) -> f64) {
        let nx = self.window.nx();
        let cell_m = self.window.cell_m();
        let [x0, y0] = self.window.centre_m(0, self.first);
        let reach_m = EJECTA[1] * crater.radius_m;
        let span = |from_m: f64, centre_m: f64, count: usize| {
            let first = ((centre_m - reach_m - from_m) / cell_m).ceil().clamp(0.0, count as f64) as usize;
            let end = ((centre_m + reach_m - from_m) / cell_m).floor() + 1.0;
            first..(end.clamp(first as f64, count as f64) as usize)
        };
        let columns = span(x0, crater.centre[0], nx);
        for j in span(y0, crater.centre[1], rows.len() / nx) {
            for (i, sum) in columns.clone().zip(&mut rows[j * nx..][columns.clone()]) {
                let [x, y] = self.window.centre_m(i, self.first + j);
                let (dx, dy) = (x - crater.centre[0], y - crater.centre[1]);
                let square = dx * dx + dy * dy;
                if square < reach_m * reach_m {
                    *sum += (2.0 * crater.radius_m * height([dx, dy])) as f32;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
