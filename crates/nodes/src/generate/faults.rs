//! Terrain displaced by straight faults, random or along a path.
//!
//! Random faults after B. B. Mandelbrot (1975), "Stochastic models for the earth's relief": the sum of many steps along
//! random lines. Differences: steps are smooth, with a width in metres, and the throw of the k-th fault decreases as
//! 1/√k, so that a few large ones determine the shape of the terrain. Faults end: their length is in proportion to
//! their throw (P. A. Cowie and C. H. Scholz, 1992), which is greatest in the middle and falls to nothing at the tips.

use orograph_graph::{memory::zeroed, mix};

use crate::{
    numerics::{math, par, simd::simd},
    prelude::*,
};

choice! {
    /// Where the faults are.
    pub enum Pattern {
        /// Many, at random.
        Random = "random",
        /// One, along `path`.
        Path = "path",
    }
}

params! {
    /// Where the faults are.
    pattern: Pattern = Pattern::Random, One, ..;
    /// Number of faults.
    faults: i64 = 40, Count, 1..=2000, soft 1..=400, when pattern = "random";
    /// Height of the largest step, or of the one along the path.
    throw: f64 = 400.0, Metres, -1e5..=1e5, soft 0..=2000;
    /// Length of the largest fault; smaller ones are shorter in proportion to their throw; 0 gives lines across the world.
    length: f64 = 30000.0, Metres, 0.0..=1e7, soft 0..=50000, when pattern = "random";
    /// Half the width of the zone that contains 71 % of the largest step; with a `length`, smaller ones are narrower.
    width: f64 = 120.0, Metres, 0.1..=1e6, soft 10..=2000;
    /// Direction of the faults, clockwise from north.
    azimuth: f64 = 30.0, Degrees, -360.0..=360.0, soft 0..=180, when pattern = "random";
    /// Width of the range of directions around `azimuth`: 180 for any direction.
    spread: f64 = 40.0, Degrees, 0.0..=180.0, when pattern = "random";
    /// Trace of the single fault, which continues straight beyond its ends; the terrain to its right sinks.
    path: PathPoints = PathPoints(vec![[3000.0, 15000.0], [6000.0, 9500.0], [10500.0, 7000.0], [13000.0, 1000.0]]), Metres, -1e7..=1e7, when pattern = "path";
    /// Random seed of the faults.
    seed: Seed = Seed(0), Count, .., when pattern = "random";
}

outputs! {
    /// Height above and below the unbroken terrain.
    height: Height;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Faults",
    version: 2,
    migrations: &[Migration {
        from: 1,
        steps: &[
            Step::Keep { name: "length", value: "0" },
            Step::Keep { name: "faults", value: "150" },
            Step::Keep { name: "spread", value: "180" },
        ],
    }],
    category: "generate",
    summary: "Terrain broken by faults: many at random, or one along a path.",
    doc: include_str!("faults.md"),
    sources: &[
        "B. B. Mandelbrot (1975), Stochastic models for the Earth's relief, the shape and the fractal dimension of the \
         coastlines, and the number-area rule for islands, PNAS 72 (10), 3825-3828",
        "P. A. Cowie and C. H. Scholz (1992), Displacement-length scaling relationship for faults: data synthesis and \
         discussion, Journal of Structural Geology 14, 1149-1156",
    ],
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    example: "faults: 40, throw: 700, length: 30000, width: 200, spread: 40",
    ..Node::DEFAULT
};

/// A straight fault.
#[derive(Clone, Copy)]
struct Fault {
    /// Coefficients of the distance to the left of the fault, in widths: `left · (x, y) + offset`.
    left: [f64; 2],
    offset: f64,
    /// Half of the throw.
    half_m: f32,
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let window = job.window();
    let xs: Vec<f64> = (0..window.nx()).map(|i| window.centre_m(i, 0)[0]).collect();
    let mut height = zeroed(window.len())?;
    if params.pattern == Pattern::Path {
        par::rows(job, &mut height, |j, row| {
            let y = window.centre_m(0, j)[1];
            for (height, &x) in row.iter_mut().zip(&xs) {
                let left = left_of(&params.path.0, [x, y]) / params.width;
                *height = (0.5 * params.throw * left / (1.0 + left * left).sqrt()) as f32;
            }
        })?;
    } else if params.length > 0.0 {
        let faults = params.tipped(job);
        par::rows(job, &mut height, |j, row| {
            let y = window.centre_m(0, j)[1];
            faults.iter().filter(|fault| fault.reaches(y)).for_each(|fault| add_tipped(row, &xs, y, fault));
        })?;
    } else {
        let faults = params.faults(job);
        par::rows(job, &mut height, |j, row| {
            let y = window.centre_m(0, j)[1];
            faults.iter().for_each(|fault| add(row, &xs, fault.left[1] * y + fault.offset, *fault));
        })?;
    }
    Ok(Given { height: Some(Field::new(window, height)) }.into())
}

impl Params {
    fn faults(&self, job: &Job<'_>) -> Vec<Fault> {
        let size = job.world().size;
        let middle = size.map(|side| 0.5 * side);
        let radius_m = math::hypot(middle[0], middle[1]);
        let fault = |k: i64| {
            let key = mix(job.seed().wrapping_add(k as u32));
            let unit = |salt: u32| f64::from(mix(key ^ salt) >> 8) / f64::from(1 << 24);
            let azimuth = (self.azimuth + self.spread * (unit(0x9e37_79b9) - 0.5)).to_radians();
            // distance of the line from the middle of the world, uniform within the circumscribed circle
            let away_m = radius_m * (2.0 * unit(0x3c6e_f372) - 1.0);
            // the direction is (sin, −cos), so its left is (−cos, −sin)
            let left = [-math::cos(azimuth) / self.width, -math::sin(azimuth) / self.width];
            let offset = -(left[0] * middle[0] + left[1] * middle[1]) - away_m / self.width;
            let sign = if unit(0xdaa6_6d2b) < 0.5 { 0.5 } else { -0.5 };
            Fault { left, offset, half_m: (sign * self.throw / (k as f64).sqrt()) as f32 }
        };
        (1..=self.faults).map(fault).collect()
    }

    /// Returns faults with ends, in and around the world.
    fn tipped(&self, job: &Job<'_>) -> Vec<Tipped> {
        let size = job.world().size;
        let fault = |k: i64| {
            let key = mix(job.seed().wrapping_add(k as u32));
            let unit = |salt: u32| f64::from(mix(key ^ salt) >> 8) / f64::from(1 << 24);
            let azimuth = (self.azimuth + self.spread * (unit(0x9e37_79b9) - 0.5)).to_radians();
            let share = 1.0 / (k as f64).sqrt();
            let half_m = 0.5 * self.length * share * (0.7 + 0.6 * unit(0x1715_609d));
            // centres as far outside as a fault reaches: the sides of the world are like its middle
            let centre = [(size[0], 0x3c6e_f372), (size[1], 0x78dd_e6e4)]
                .map(|(side, salt)| -half_m + (side + 2.0 * half_m) * unit(salt));
            let sign = if unit(0xdaa6_6d2b) < 0.5 { 0.5 } else { -0.5 };
            Tipped {
                centre,
                along: [math::sin(azimuth) / half_m, -math::cos(azimuth) / half_m],
                // small faults have narrow zones
                per_half: (half_m / (self.width * share.sqrt())) as f32,
                bow: (0.5 * (unit(0x2f0b_4dd1) - 0.5)) as f32,
                bends: [unit(0xa54f_f53a), unit(0x510e_527f)].map(|unit| (2.0 * unit - 1.0) as f32),
                half_m,
                throw_m: (sign * self.throw * share) as f32,
            }
        };
        (1..=self.faults).map(fault).collect()
    }
}

/// Displacements die out at this many half lengths from a fault.
const AWAY: f32 = 0.9;

/// A fault that ends.
struct Tipped {
    centre: [f64; 2],
    /// Direction, per half length.
    along: [f64; 2],
    /// Half length in widths.
    per_half: f32,
    /// How far its ends lie to the left of its middle's tangent, in half lengths.
    bow: f32,
    /// How strongly it bends twice, and three times, −1 to 1.
    bends: [f32; 2],
    half_m: f64,
    /// Half of the throw in the middle.
    throw_m: f32,
}

impl Tipped {
    /// Returns true if it displaces terrain in a row.
    fn reaches(&self, y: f64) -> bool {
        (y - self.centre[1]).abs() <= self.half_m
    }
}

simd! {
    /// Adds a fault with ends to a row.
    fn add_tipped(row: &mut [f32], xs: &[f64], y: f64, fault: &Tipped) {
        let down = y - fault.centre[1];
        let [east, south] = fault.along;
        for (height, x) in row.iter_mut().zip(xs) {
            let across = x - fault.centre[0];
            // in half lengths along the fault and to its left
            let u = (across * east + down * south) as f32;
            let v = (across * south - down * east) as f32;
            let near = 1.0 - u * u - v * v / (AWAY * AWAY);
            let near = if near > 0.0 { near } else { 0.0 };
            // a trace with bends instead of a ruler's
            let w = if u > -1.0 { u } else { -1.0 };
            let w = if w < 1.0 { w } else { 1.0 };
            let square = w * w;
            let trace = fault.bow * square
                + 0.3 * fault.bends[0] * w * (square - 0.6)
                + 0.6 * fault.bends[1] * square * (square - 0.8);
            let left = (v - trace) * fault.per_half;
            let step = fault.throw_m * (near * near) * (left / (1.0 + left * left).sqrt());
            *height += if near > 0.0 { step } else { 0.0 };
        }
    }
}

simd! {
    /// Adds a fault to a row; `part` is the contribution of the row to the distance.
    fn add(row: &mut [f32], xs: &[f64], part: f64, fault: Fault) {
        for (height, x) in row.iter_mut().zip(xs) {
            let left = (fault.left[0] * x + part) as f32;
            *height += fault.half_m * (left / (1.0 + left * left).sqrt());
        }
    }
}

/// Returns the distance of a place to a path that continues beyond its ends, positive to its left.
fn left_of(path: &[[f64; 2]], place: [f64; 2]) -> f64 {
    let last = path.len().saturating_sub(2);
    let (mut nearest, mut side) = (f64::INFINITY, 0.0);
    for (k, pair) in path.windows(2).enumerate() {
        let [[x0, y0], [x1, y1]] = [pair[0], pair[1]];
        let (ex, ey, dx, dy) = (x1 - x0, y1 - y0, place[0] - x0, place[1] - y0);
        let length = (ex * ex + ey * ey).sqrt();
        if length == 0.0 {
            continue;
        }
        let along = (dx * ex + dy * ey) / (length * length);
        let low = if k == 0 { f64::NEG_INFINITY } else { 0.0 };
        let high = if k == last { f64::INFINITY } else { 1.0 };
        let t = along.clamp(low, high);
        let (px, py) = (dx - t * ex, dy - t * ey);
        let distance = (px * px + py * py).sqrt();
        // y points south, so the left of (ex, ey) is (ey, −ex)
        let left = (dx * ey - dy * ex) / length;
        // at a corner both segments are equally near; the one whose line is farther away determines the side
        let tie = (distance - nearest).abs() <= 1e-9 * (distance + 1.0);
        if (tie && left.abs() > f64::abs(side)) || (!tie && distance < nearest) {
            side = left;
        }
        nearest = nearest.min(distance);
    }
    if side < 0.0 { -nearest } else { nearest }
}

#[cfg(test)]
mod tests {
    use orograph_graph::ParamValue;

    use super::*;
    use crate::testing::{at_every_level, generate, moments, outputs_on, with_params, world};

    #[test]
    fn one_fault_is_its_step() {
        let window = Window::whole(world(200, 200, 20.0));
        let land = generate(window, &NODE, "faults=1,length=0,throw=100,width=50,azimuth=0,spread=0,seed=4");
        let row = &land.samples()[..200];
        assert!((1..200).all(|j| land.samples()[j * 200..][..200] == *row));
        let sign = if row[0] > row[199] { 1.0 } else { -1.0 };
        // the steepest slope is throw / 2 width, and beyond the crossing the step follows its formula
        let crossing = (0..199).find(|i| (row[*i] > 0.0) != (row[i + 1] > 0.0)).expect("a crossing");
        let t = f64::from(row[crossing] / (row[crossing] - row[crossing + 1]));
        for (i, h) in row.iter().enumerate() {
            let x = (crossing as f64 + t - i as f64) * 20.0 / 50.0;
            assert!((sign * f64::from(*h) - 50.0 * x / (1.0 + x * x).sqrt()).abs() < 0.5, "{i}");
        }
    }

    /// For random lines the structure function is proportional to the distance: E (z(a) − z(b))² ∝ |a − b|, H = ½, at
    /// distances greater than the widths and much smaller than the world. Over ten seeds, the sum over 1/k leaves a
    /// scatter of about 15 % in the exponent.
    #[test]
    fn random_faults_are_as_rough_as_brownian_land() {
        let window = Window::whole(world(256, 256, 64.0));
        let square = |step: usize| {
            let mut sum = 0.0;
            for seed in 0..10 {
                let land = generate(window, &NODE, &format!("faults=400,spread=180,length=0,width=10,seed={seed}"));
                let at = |i: usize, j: usize| f64::from(land.samples()[j * 256 + i]);
                for (i, j) in (0..256 - step).flat_map(|i| (0..256).step_by(5).map(move |j| (i, j))) {
                    sum += (at(i + step, j) - at(i, j)) * (at(i + step, j) - at(i, j)) / (256 - step) as f64;
                }
            }
            sum
        };
        let exponent = math::log2(square(32) / square(4)) / 3.0;
        assert!((exponent - 1.0).abs() < 0.15, "{exponent}");
    }

    #[test]
    fn no_seed_has_the_land_of_another_and_every_window_is_the_wholes() {
        let whole = Window::whole(world(131, 97, 120.0));
        at_every_level(|| generate(whole, &NODE, ""));
        let land = generate(whole, &NODE, "");
        let part = Window { origin: [17, 31], cells: [83, 40], ..whole };
        assert_eq!(land.crop(&part), generate(part, &NODE, ""));
        assert_ne!(land, generate(whole, &NODE, "seed=1"));
        let (_, std) = moments(land.samples());
        assert!(std > 25.0 && std < 1000.0, "{std}");
    }

    #[test]
    fn a_path_has_the_high_land_on_its_left_all_along() {
        let mut params = with_params(&NODE, "pattern=path,throw=100,width=30");
        // heading east and then south, the left side is north and east
        params.set("path", ParamValue::Path(vec![[200.0, 500.0], [600.0, 500.0], [600.0, 800.0]]));
        let mut outputs = outputs_on(Window::whole(world(100, 100, 10.0)), &NODE, &params, &[]).expect("a result");
        let land = outputs.take("height").expect("an output");
        let land = land.as_field().expect("a field");
        let at = |x: usize, y: usize| land.samples()[y / 10 * 100 + x / 10];
        assert!(at(5, 400) > 45.0 && at(5, 600) < -45.0 && at(400, 990) < -45.0 && at(800, 990) > 45.0);
        assert!(at(700, 400) > 45.0 && at(500, 600) < -45.0);
        let x = 65.0 / 30.0_f64;
        assert!((f64::from(at(400, 430)) - 50.0 * x / (1.0 + x * x).sqrt()).abs() < 1e-3);
        // continuous: the steepest slope is throw / 2 width over a cell
        let steepest = (0..100).flat_map(|j| (1..100).map(move |i| (i, j)));
        assert!(
            steepest
                .into_iter()
                .all(|(i, j)| (land.samples()[j * 100 + i] - land.samples()[j * 100 + i - 1]).abs() < 17.0)
        );
    }

    /// The step of a fault with ends is its throw in the middle, falls to nothing at the tips, and the terrain beyond
    /// is untouched: along the trace the throw is (1 − u²)², u being the distance from the middle in half lengths.
    #[test]
    fn a_fault_tapers_to_its_tips() {
        let params = Params::read(&with_params(&NODE, "faults=1,throw=100,width=20,length=4000"));
        let fault = Tipped {
            centre: [5000.0, 5000.0],
            along: [0.0, -1.0 / 2000.0],
            per_half: 100.0,
            bow: 0.0,
            bends: [0.0; 2],
            half_m: 2000.0,
            throw_m: 50.0,
        };
        let xs: Vec<f64> = (0..1000).map(|i| 10.0 * f64::from(i) + 5.0).collect();
        let step = |y: f64| {
            let mut row = vec![0.0; 1000];
            add_tipped(&mut row, &xs, y, &fault);
            let [low, high] = row.iter().fold([f32::MAX, f32::MIN], |[l, h], z| [l.min(*z), h.max(*z)]);
            assert!(row[..300].iter().chain(&row[700..]).all(|z| *z == 0.0));
            f64::from(high - low)
        };
        for u in [0.0, 0.3, 0.6, 0.9] {
            let expected = 100.0 * (1.0 - u * u) * (1.0 - u * u);
            assert!((step(5000.0 + 2000.0 * u) - expected).abs() < 0.12 * expected + 0.3, "{u}");
        }
        assert!(step(7001.0) == 0.0 && !fault.reaches(7001.0) && fault.reaches(6999.0));
        // throw over length: 0.01 to 0.05 (Cowie and Scholz 1992) for the defaults
        let usual = Params::read(&with_params(&NODE, ""));
        assert!((0.01..0.05).contains(&(usual.throw / usual.length)));
        let window = Window::whole(world(64, 64, 250.0));
        crate::testing::with_job(window, |job| {
            assert!(params.tipped(job).iter().all(|fault| (1400.0..2600.0).contains(&fault.half_m)));
        });
    }

    /// Faults with ends leave level terrain between them, and disturb some of it.
    #[test]
    fn faults_with_ends_leave_terrain_between_them() {
        let window = Window::whole(world(256, 256, 64.0));
        let level = |changes: &str| {
            let land = generate(window, &NODE, &format!("faults=12,throw=300,width=60,{changes}"));
            let h = land.samples();
            let is_level = |at: &usize| (h[at + 1] - h[*at]).abs() + (h[at + 256] - h[*at]).abs() < 0.01;
            (0..255 * 256).filter(|at| at % 256 < 255).filter(is_level).count() as f64 / (255.0 * 255.0)
        };
        let share = level("length=6000");
        assert!((0.15..0.95).contains(&share), "{share}");
    }
}
