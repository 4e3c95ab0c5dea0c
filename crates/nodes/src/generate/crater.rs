//! Impact craters: one, or a field of them with the size distribution of old surfaces.
//!
//! Profiles after R. J. Pike (1977), "Size-dependence in the shape of fresh impact craters on the moon": simple craters
//! have a depth of a fifth of their diameter. The size distribution is the steady production N(> D) ∝ D⁻² (H. J.
//! Melosh, 1989, "Impact Cratering"), for which every octave of diameters covers the same area.

use orograph_graph::mix;

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
    centre: [f64; 2] = [8192.0, 8192.0], Metres, -1e7..=1e7, when pattern = "one";
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
    /// Random seed of the field.
    seed: Seed = Seed(0), Count, .., when pattern = "field";
}

outputs! {
    /// Height above the surrounding ground.
    height: Height;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Crater",
    category: "generate",
    summary: "Impact craters: one, or a field of all sizes.",
    doc: include_str!("crater.md"),
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

/// Distances from the centre, in radii, at which the ejecta begin to fade and at which they end.
const EJECTA: [f64; 2] = [2.0, 3.0];
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
    let mut height = vec![0.0; window.len()];
    let shape = Shape { depth: params.depth, rim: params.rim, transition_m: params.transition };
    let octaves = params.octaves(job)?;
    par::bands_within(job, [0.0, 1.0], BAND, &mut height, |first, rows| {
        let band = Band { window, first };
        if params.pattern == Pattern::One {
            band.add(rows, &Crater { centre: params.centre, radius_m: 0.5 * params.diameter, fresh: 1.0 }, shape);
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
        })
    }
}

/// Shape of craters.
#[derive(Clone, Copy)]
struct Shape {
    /// Depth and rim height of simple craters, as fractions of the diameter.
    depth: f64,
    rim: f64,
    /// Diameter above which craters are complex.
    transition_m: f64,
}

/// Shape of craters of one diameter.
#[derive(Clone, Copy)]
struct Form {
    simple: Shape,
    /// Weight of the complex shape.
    complex: f64,
    /// Of the complex shape: depth as a fraction of the diameter, and floor radius as a fraction of the radius.
    shallow: f64,
    floor: f64,
}

/// Number of terraces on a complex crater's wall.
const TERRACES: f64 = 3.0;
/// Height of a central peak as a fraction of the diameter, and its radius as a fraction of the crater's.
const PEAK: [f64; 2] = [0.02, 0.2];

impl Shape {
    fn of(self, diameter_m: f64) -> Form {
        let ratio = (diameter_m / self.transition_m).max(1.0);
        Form {
            simple: self,
            complex: crate::numerics::math::smoothstep(ratio - 1.0),
            shallow: self.depth * crate::numerics::math::pow(ratio, -0.7),
            floor: (0.37 * crate::numerics::math::pow(ratio, 0.25)).min(0.75),
        }
    }
}

impl Form {
    /// Returns the height at a distance of `radii` from the centre, as a fraction of the diameter.
    fn height(&self, radii: f64) -> f64 {
        let Shape { depth, rim, .. } = self.simple;
        if radii > 1.0 {
            let fade = crate::numerics::math::smoothstep((EJECTA[1] - radii) / (EJECTA[1] - EJECTA[0]));
            return rim / (radii * radii * radii) * fade;
        }
        let simple = (depth + rim) * radii * radii - depth;
        if self.complex == 0.0 {
            return simple;
        }
        let up = ((radii - self.floor) / (1.0 - self.floor)).max(0.0);
        let turns = std::f64::consts::TAU * TERRACES;
        let wall = up - 0.8 * crate::numerics::math::sin(turns * up) / turns;
        let from_peak = (radii / PEAK[1]).min(1.0);
        let peak = PEAK[0].min(0.8 * self.shallow) * (1.0 - from_peak * from_peak) * (1.0 - from_peak * from_peak);
        let complex = (self.shallow + rim) * wall - self.shallow + peak;
        simple + self.complex * (complex - simple)
    }
}

struct Crater {
    centre: [f64; 2],
    radius_m: f64,
    /// Remaining fraction of the depth.
    fresh: f64,
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
        let nx = self.window.nx();
        let cell_m = self.window.cell_m();
        let [x0, y0] = self.window.centre_m(0, self.first);
        let reach_m = EJECTA[1] * crater.radius_m;
        let form = shape.of(2.0 * crater.radius_m);
        let span = |from_m: f64, centre_m: f64, count: usize| {
            let first = ((centre_m - reach_m - from_m) / cell_m).ceil().clamp(0.0, count as f64) as usize;
            let end = ((centre_m + reach_m - from_m) / cell_m).floor() + 1.0;
            first..(end.clamp(first as f64, count as f64) as usize)
        };
        for j in span(y0, crater.centre[1], rows.len() / nx) {
            for i in span(x0, crater.centre[0], nx) {
                let [x, y] = self.window.centre_m(i, self.first + j);
                let (dx, dy) = (x - crater.centre[0], y - crater.centre[1]);
                let square = dx * dx + dy * dy;
                if square < reach_m * reach_m {
                    let height = form.height(square.sqrt() / crater.radius_m);
                    rows[j * nx + i] += (2.0 * crater.radius_m * crater.fresh * height) as f32;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        numerics::math,
        testing::{generate, world},
    };

    #[test]
    fn one_crater_has_its_depth_its_rim_and_its_ejecta() {
        let land = generate(Window::whole(world(1024, 1024, 16.0)), &NODE, "pattern=one,diameter=4000,depth=0.2");
        let at = |metres: usize| f64::from(land.samples()[512 * 1024 + 512 + metres / 16]);
        // the cell's centre is 11 m from the crater's, where the slope is 5e-4
        assert!((at(0) + 800.0).abs() < 0.1, "{}", at(0));
        let (_, rim) = land.range(0).expect("values");
        // the crest is a cusp with a slope of 0.96, and its top may lie between cells
        assert!((150.0..160.1).contains(&f64::from(rim)), "{rim}");
        let r = math::hypot(3000.0, 8.0);
        assert!((at(3000) - 160.0 * 8e9 / (r * r * r)).abs() < 0.02, "{}", at(3000));
        assert_eq!(at(6000), 0.0);
    }

    /// A crater of twice the transition diameter is fully complex: 2^−0.7 of the depth-to-diameter ratio of a simple
    /// crater, a flat floor with a peak, and terraces that only rise outwards. At the transition it is simple.
    #[test]
    fn a_complex_crater_is_shallow_with_a_floor_a_peak_and_terraces() {
        let shape = Shape { depth: 0.16, rim: 0.04, transition_m: 10_000.0 };
        let (simple, complex) = (shape.of(10_000.0), shape.of(20_000.0));
        assert!(simple.height(0.0) == -0.16 && (simple.height(1.0) - 0.04).abs() < 1e-12);
        let floor = -0.16 * math::pow(2.0, -0.7);
        assert!((complex.height(0.0) - (floor + 0.02)).abs() < 1e-12);
        assert!((complex.height(0.3) - floor).abs() < 1e-12 && (complex.height(0.43) - floor).abs() < 1e-12);
        assert!((complex.height(1.0) - 0.04).abs() < 1e-12 && complex.height(1.1) < 0.04);
        let heights: Vec<f64> = (440..=1000).map(|k| complex.height(0.001 * f64::from(k))).collect();
        assert!(heights.windows(2).all(|pair| pair[1] > pair[0]));
        // Pike's depths in kilometres, 0.196 D^1.01 and 1.044 D^0.301, meet near 11 km; ours scale in the same way
        let pike = |d: f64| 1.044 * math::pow(d, 0.301);
        let depth = |d: f64| -shape.of(1000.0 * d).height(0.25) * d;
        assert!((depth(80.0) / depth(20.0) / (pike(80.0) / pike(20.0)) - 1.0).abs() < 0.01);
    }

    #[test]
    fn each_octave_covers_its_share_and_large_craters_are_rare() {
        let octave = Octave { largest_m: 1.0, smallest_m: 0.0, chance: 0.3 / SHARE, wear: 0.0, seed: 3 };
        let craters: Vec<Crater> = (0..300)
            .flat_map(|line| (0..300).map(move |column| (column, line)))
            .filter_map(|(c, l)| octave.crater(c, l))
            .collect();
        let area: f64 = craters.iter().map(|c| std::f64::consts::PI * c.radius_m * c.radius_m).sum();
        // 75 000 craters
        assert!((area / 90_000.0 / 0.3 - 1.0).abs() < 0.01, "{}", area / 90_000.0);
        // N(> 0.7) / N(> 0.5) = (0.7⁻² − 1) / (0.5⁻² − 1)
        let large = craters.iter().filter(|c| c.radius_m > 0.35).count() as f64 / craters.len() as f64;
        assert!((large - (1.0 / 0.49 - 1.0) / 3.0).abs() < 0.01, "{large}");
    }

    #[test]
    fn a_window_has_the_craters_of_the_whole() {
        let whole = Window::whole(world(131, 97, 120.0));
        let land = generate(whole, &NODE, "smallest=600");
        let part = Window { origin: [17, 31], cells: [83, 40], ..whole };
        assert_eq!(land.crop(&part), generate(part, &NODE, "smallest=600"));
        assert_ne!(land, generate(whole, &NODE, "smallest=600,seed=1"));
        assert!(land.range(0).is_some_and(|(low, high)| low < -100.0 && high > 10.0));
    }
}
