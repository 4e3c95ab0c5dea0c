//! Dunes in closed form: transverse ridges and barchans, with a gentle windward side and a slip face at repose on the
//! lee side.
//!
//! Proportions of barchans after P. Hersen (2004), "On the crescentic shape of barchan dunes": one and a half times as
//! wide as long, about eleven times as wide as high. Differences: profiles are prescribed, not computed from wind and
//! sand.

use orograph_graph::mix;

use crate::numerics::noise::{Basis, Fractal, place, sum};
use crate::{
    numerics::{math, par},
    prelude::*,
};

choice! {
    /// Kind of dunes.
    pub enum Form {
        /// Long ridges across the wind: for plenty of sand.
        Transverse = "transverse",
        /// Crescents on bare ground, whose horns point downwind: for little sand.
        Barchan = "barchan",
    }
}

params! {
    /// Kind of dunes.
    form: Form = Form::Transverse, One, ..;
    /// Distance between crests, or the mean distance between crescents.
    wavelength: f64 = 600.0, Metres, 0.1..=1e6, soft 20..=4000;
    /// Height of ridges, or of the largest crescents.
    height: f64 = 36.0, Metres, 0.0..=1e5, soft 1..=300;
    /// Direction that the wind blows towards, clockwise from north.
    azimuth: f64 = 60.0, Degrees, -360.0..=360.0, soft 0..=360;
    /// Angle of the slip face.
    repose: f64 = 33.0, Degrees, 10.0..=45.0, soft 30..=35;
    /// How much ridges wind and vary in height: 0 for straight, even ridges.
    waviness: f64 = 0.5, One, 0.0..=1.0, when form = "transverse";
    /// How much crescents differ: in size, in the length of their horns, in direction, and in number from place to place.
    variety: f64 = 0.7, One, 0.0..=1.0, when form = "barchan";
    /// Random seed of the dunes.
    seed: Seed = Seed(0), Count, ..;
}

outputs! {
    /// Height above the ground.
    height: Height;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Dunes",
    version: 2,
    migrations: &[Migration { from: 1, steps: &[Step::Keep { name: "variety", value: "0" }] }],
    category: "generate",
    summary: "Sand dunes: transverse ridges or barchans with slip faces.",
    doc: include_str!("dunes.md"),
    sources: &[
        "P. Hersen (2004), On the crescentic shape of barchan dunes, European Physical Journal B 37, 507-514",
        "N. Lancaster (1995), Geomorphology of Desert Dunes, Routledge",
    ],
    outputs: Given::PORTS,
    params: Params::specs,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    example: "version: 2, wavelength: 3500, height: 210, waviness: 0.4",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    match Params::read(sizing.params).form {
        // displacement and lowering of crests, and two slopes
        Form::Transverse => sizing.cells(16.0),
        Form::Barchan => 0,
    }
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let slip = math::tan(params.repose.to_radians());
    let most_m = match params.form {
        // half of the wavelength is available for the slip face
        Form::Transverse => 0.5 * params.wavelength * slip,
        // no farther than the neighbouring lattice squares
        Form::Barchan => params.wavelength / REACH,
    };
    if params.height > most_m {
        return Err(NodeError::failed_with_hint(
            "the dunes are too high for their distance",
            format!("write `height: {}` or less", orograph_graph::plain((most_m * 10.0).floor() / 10.0)),
        ));
    }
    let samples = match params.form {
        Form::Transverse => params.ridges(job, slip)?,
        Form::Barchan => params.crescents(job, slip)?,
    };
    Ok(Given { height: Some(Field::new(job.window(), samples)) }.into())
}

/// Distance from a barchan's centre to its farthest point, in heights, with a margin.
const REACH: f64 = 9.0;
/// Half width, length of the windward side, and length of the horns, in heights.
const HALF_WIDTH: f64 = 5.5;
const WINDWARD: f64 = 6.0;
const HORNS: f64 = 6.6;
/// Salts of the noise that bends crests and of the noise that lowers them.
const SALTS: [u32; 2] = [0x6a09_e667, 0xbb67_ae85];

impl Params {
    /// Returns the unit vector of the wind direction.
    fn wind(&self) -> [f64; 2] {
        let azimuth = self.azimuth.to_radians();
        [math::sin(azimuth), -math::cos(azimuth)]
    }

    fn ridges(&self, job: &Job<'_>, slip: f64) -> Result<Vec<f32>, NodeError> {
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
        let mut heights = vec![0.0; window.len()];
        par::rows(job, &mut heights, |j, row| {
            for (i, height) in row.iter_mut().enumerate() {
                let at = j * window.nx() + i;
                let [x, y] = window.centre_m(i, j);
                let phase = (x * wind_x + y * wind_y + f64::from(bend[at])) / self.wavelength;
                // ratio of the local crest spacing on straight ridges to the one here
                let (gx, gy) = (wind_x + f64::from(along[at]), wind_y + f64::from(down[at]));
                let closer = (gx * gx + gy * gy).sqrt().max(0.2);
                let share = 1.0 - f64::from(low[at]).abs().min(0.5);
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
        let mut slopes = [vec![0.0; job.window().len()], vec![0.0; job.window().len()]];
        for octave in &octaves {
            let per_metre = 1.0 / (octave.wavelength_cells * job.cell_m());
            let part = sum::slopes(job, &[*octave], Basis::Bell, bend_m * per_metre)?;
            for (sum, part) in slopes.iter_mut().zip(&part) {
                sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
            }
        }
        Ok(slopes)
    }

    fn crescents(&self, job: &Job<'_>, slip: f64) -> Result<Vec<f32>, NodeError> {
        let window = job.window();
        let seed = mix(job.seed() ^ SALTS[0]);
        let [wind_x, wind_y] = self.wind();
        let mut heights = vec![0.0; window.len()];
        par::rows(job, &mut heights, |j, row| {
            // small crescents lie on lattices of their own
            for octave in 0..if self.variety > 0.0 { OCTAVES } else { 1 } {
                let lattice = Lattice { octave, wide_m: self.wavelength / f64::from(1 << octave), seed };
                let line = square(window.centre_m(0, j)[1], lattice.wide_m);
                let mut known: Option<(i64, Vec<Crescent>)> = None;
                for (i, height) in row.iter_mut().enumerate() {
                    let [x, y] = window.centre_m(i, j);
                    let column = square(x, lattice.wide_m);
                    // all samples of a square have the same neighbours
                    let around = match known.take() {
                        Some((of, around)) if of == column => around,
                        _ => self.around(&lattice, column, line),
                    };
                    let tallest = around.iter().map(|crescent| {
                        let (dx, dy) = (x - crescent.centre[0], y - crescent.centre[1]);
                        let (along_m, across_m) = (dx * wind_x + dy * wind_y, dx * wind_y - dy * wind_x);
                        let [cos, sin] = crescent.turn;
                        crescent.height(along_m * cos - across_m * sin, across_m * cos + along_m * sin, slip)
                    });
                    *height = tallest.fold(f64::from(*height), f64::max) as f32;
                    known = Some((column, around));
                }
            }
        })?;
        Ok(heights)
    }

    /// Returns the barchans of a lattice square and its neighbours.
    fn around(&self, lattice: &Lattice, column: i64, line: i64) -> Vec<Crescent> {
        let squares =
            (line - 1..=line + 1).flat_map(|line| (column - 1..=column + 1).map(move |column| [column, line]));
        squares.filter_map(|square| self.crescent(lattice, square)).collect()
    }

    /// Returns the barchan of a lattice square.
    fn crescent(&self, lattice: &Lattice, square: [i64; 2]) -> Option<Crescent> {
        let Lattice { octave, wide_m, seed } = *lattice;
        let key = place::key_at(seed.wrapping_add(octave), square);
        let unit = |salt: u32| f64::from(mix(key ^ salt) >> 8) / f64::from(1 << 24);
        let centre = [(square[0] as f64 + unit(0x3c6e_f372)) * wide_m, (square[1] as f64 + unit(0xdaa6_6d2b)) * wide_m];
        let even = 0.5 + 0.5 * unit(0x78dd_e6e4);
        if self.variety == 0.0 {
            let height_m = self.height * even;
            return (unit(0x9e37_79b9) < 0.7).then_some(Crescent { centre, height_m, turn: [1.0, 0.0], skew: 0.0 });
        }
        // swarms and bare ground between them, the same for all sizes
        let swarm = place::at(centre.map(|metres| metres / (3.5 * self.wavelength)), seed ^ SALTS[1]);
        let small = f64::from(octave) / f64::from(OCTAVES);
        let chance = (0.7 - 0.45 * small) * (1.0 + 2.2 * self.variety * swarm).max(0.0);
        let chance = if octave == 0 { chance } else { self.variety * chance };
        // many small ones and few large ones
        let size = even * (1.0 - self.variety * (0.7 - 0.7 * unit(0x1715_609d) * unit(0x2f0b_4dd1)));
        let height_m = self.height / f64::from(1 << octave) * size.max(0.12);
        let turn = 0.3 * self.variety * (unit(0x5be0_cd19) + unit(0x510e_527f) - 1.0);
        // horns reach no farther than the neighbouring squares
        let room = ((wide_m / height_m - REACH) / 2.5).clamp(0.0, 1.0);
        let skew = 0.75 * self.variety * room * (unit(0xa54f_f53a) + unit(0x3c6e_f371) - 1.0);
        (unit(0x9e37_79b9) < chance).then(|| Crescent {
            centre,
            height_m,
            turn: [math::cos(turn), math::sin(turn)],
            skew,
        })
    }
}

/// A lattice of squares with at most one barchan each.
struct Lattice {
    octave: u32,
    wide_m: f64,
    seed: u32,
}

/// Lattices of barchans, each with squares and heights half as large as the one before.
const OCTAVES: u32 = 3;

/// Returns the index of the lattice square of a position.
fn square(at_m: f64, width_m: f64) -> i64 {
    (at_m / width_m).floor().clamp(-2_147_483_648.0, 2_147_483_647.0) as i64
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

/// A barchan.
struct Crescent {
    /// Position of its highest point.
    centre: [f64; 2],
    height_m: f64,
    /// Cosine and sine of the angle between its own wind and that of the field.
    turn: [f64; 2],
    /// How much longer one horn is than the other.
    skew: f64,
}

impl Crescent {
    /// Returns the height at a position, along and across the wind from the centre.
    fn height(&self, along_m: f64, across_m: f64, slip: f64) -> f64 {
        if self.height_m <= 0.0 {
            return 0.0;
        }
        let (u, v) = (along_m / self.height_m, across_m / (HALF_WIDTH * self.height_m));
        let body = 1.0 - v * v;
        if body <= 0.0 {
            return 0.0;
        }
        // the crest becomes lower and recedes downwind towards the horns
        let (top, crest) = (body * body, HORNS * v * v * (1.0 + self.skew * v));
        let windward = WINDWARD * body;
        let share = (u - (crest - windward)) / windward;
        if share <= 0.0 {
            0.0
        } else if share <= 1.0 {
            self.height_m * top * (0.5 - 0.5 * math::cos(std::f64::consts::PI * share))
        } else {
            // gentler along the wind where the crest is oblique, so that the slip face is at repose down its slope
            let skew = HORNS * v * (2.0 + 3.0 * self.skew * v) / HALF_WIDTH;
            self.height_m * (top - (u - crest) * slip / (1.0 + skew * skew).sqrt()).max(0.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{generate, outputs_on, with_params, world};

    fn slopes(field: &Field) -> impl Iterator<Item = f64> + '_ {
        let (nx, ny, cell_m) = (field.window().nx(), field.window().ny(), field.window().cell_m());
        let h = move |i: usize, j: usize| f64::from(field.samples()[j * nx + i]);
        (1..ny - 1).flat_map(move |j| {
            (1..nx - 1).map(move |i| math::hypot(h(i + 1, j) - h(i - 1, j), h(i, j + 1) - h(i, j - 1)) / (2.0 * cell_m))
        })
    }

    /// Straight ridges have the requested height, a slip face at repose over H / tan φ, and a mean height of H / 2 on
    /// both sides.
    #[test]
    fn ridges_have_their_height_and_their_slip_face() {
        let window = Window::whole(world(1200, 3, 1.0));
        let land = generate(window, &NODE, "waviness=0,azimuth=90,wavelength=300,height=18,repose=33");
        let profile = &land.samples()[1200..2400];
        let most = profile.iter().fold(0.0_f32, |most, h| most.max(*h));
        assert!((17.6..=18.0).contains(&most), "{most}"); // a crest may be half a cell from a centre
        let mean = profile.iter().map(|h| f64::from(*h)).sum::<f64>() / 1200.0;
        assert!((mean - 9.0).abs() < 0.02, "{mean}");
        let slip = math::tan(33.0_f64.to_radians());
        let falling: Vec<f64> =
            profile.windows(2).map(|pair| f64::from(pair[0] - pair[1])).filter(|d| *d > 0.3).collect();
        let steep = falling.iter().filter(|d| (*d - slip).abs() < 1e-4).count();
        // 27.7 m of 300 m, less the two cells at its ends, four times
        assert!((100..=112).contains(&steep) && falling.iter().all(|d| *d < slip + 1e-4), "{steep}");
    }

    /// Also on winding ridges, nine tenths of the steep terrain on lee sides is within two degrees of repose, apart
    /// from edges, where differences over two cells and the slope along the crest reduce it.
    #[test]
    fn winding_ridges_slip_at_repose_too() {
        let window = Window::whole(world(700, 700, 2.0));
        let land = generate(window, &NODE, "waviness=0.4,wavelength=300,height=18,repose=33");
        let angles: Vec<f64> = slopes(&land).map(|s| math::atan(s).to_degrees()).filter(|a| *a > 28.0).collect();
        let near = angles.iter().filter(|a| (*a - 33.0).abs() < 2.0).count();
        assert!(angles.len() > 15_000 && near as f64 > 0.85 * angles.len() as f64, "{near} of {}", angles.len());
    }

    #[test]
    fn a_barchan_is_a_crescent_nowhere_steeper_than_repose() {
        let slip = math::tan(33.0_f64.to_radians());
        let crescent = Crescent { centre: [0.0; 2], height_m: 10.0, turn: [1.0, 0.0], skew: 0.0 };
        assert!((crescent.height(0.0, 0.0, slip) - 10.0).abs() < 1e-9);
        assert!((crescent.height(5.0, 0.0, slip) - (10.0 - 5.0 * slip)).abs() < 1e-9);
        assert_eq!(crescent.height(-60.0, 0.0, slip), 0.0);
        // the ends of the horns, 11 heights apart
        assert!(crescent.height(53.0, 50.0, slip) > 0.0 && crescent.height(30.0, 0.0, slip) == 0.0);
        let h = |u: f64, v: f64| crescent.height(u, v, slip);
        for (a, b) in (-180..300).flat_map(|a| (-140..=140).map(move |b| (0.4 * f64::from(a), 0.4 * f64::from(b)))) {
            let steep = math::hypot(h(a + 0.01, b) - h(a - 0.01, b), h(a, b + 0.01) - h(a, b - 0.01)) / 0.02;
            assert!(steep < slip * 1.02, "({a}, {b}): {}", math::atan(steep).to_degrees());
            assert!(h(a, b) == 0.0 || math::hypot(a, b) < REACH * 10.0);
        }
    }

    /// Field data: barchans are about a tenth as high as their horns are apart (P. Hersen, 2004), also the skewed ones;
    /// their sizes spread over a factor of ten, most are small, and swarms alternate with bare ground.
    #[test]
    fn barchans_differ_and_keep_their_proportions() {
        let params = Params::read(&with_params(&NODE, "form=barchan,wavelength=600,height=36"));
        let slip = math::tan(33.0_f64.to_radians());
        let crescents = |octave: u32| -> Vec<Crescent> {
            let lattice = Lattice { octave, wide_m: 600.0 / f64::from(1 << octave), seed: 9 };
            let squares = (0..40).flat_map(|line| (0..40).map(move |column| [column, line]));
            squares.filter_map(|square| params.crescent(&lattice, square)).collect()
        };
        let all: Vec<Crescent> = (0..OCTAVES).flat_map(crescents).collect();
        let mut heights: Vec<f64> = all.iter().map(|crescent| crescent.height_m).collect();
        heights.sort_by(f64::total_cmp);
        let at = |share: f64| heights[(share * (heights.len() - 1) as f64) as usize];
        assert!(at(1.0) <= 36.0 && at(0.99) > 6.0 * at(0.05) && at(0.5) < 0.45 * at(0.99), "{} {}", at(0.05), at(0.99));
        for crescent in all.iter().take(200) {
            let h = crescent.height_m;
            // where it ends across the wind
            let wide = (0..200)
                .map(|k| 0.1 * f64::from(k))
                .filter(|v| (-100..200).any(|u| crescent.height(0.1 * f64::from(u) * h, v * h, slip) > 0.02 * h));
            let half = wide.fold(0.0, f64::max);
            assert!((0.085..0.125).contains(&(1.0 / (2.0 * half))), "{half}");
        }
        // counts in blocks of five squares vary more than those of independent draws
        let first = crescents(0);
        let mut counts = [0.0_f64; 64];
        for crescent in &first {
            let [x, y] = crescent.centre.map(|metres| ((metres / 3000.0) as usize).min(7));
            counts[y * 8 + x] += 1.0;
        }
        let mean = counts.iter().sum::<f64>() / 64.0;
        let variance = counts.iter().map(|count| (count - mean) * (count - mean)).sum::<f64>() / 64.0;
        assert!(variance > 1.4 * mean * (1.0 - mean / 25.0), "{variance} {mean}");
    }

    #[test]
    fn a_window_has_the_dunes_of_the_whole() {
        for form in ["transverse", "barchan"] {
            let changes = format!("form={form},wavelength=900,height=50");
            let whole = Window::whole(world(131, 97, 60.0));
            let land = generate(whole, &NODE, &changes);
            let part = Window { origin: [17, 31], cells: [83, 40], ..whole };
            assert_eq!(land.crop(&part), generate(part, &NODE, &changes));
            assert_ne!(land, generate(whole, &NODE, &format!("{changes},seed=1")));
            assert!(land.range(0).is_some_and(|(low, high)| low >= 0.0 && high > 25.0 && high <= 50.0));
        }
    }

    #[test]
    fn dunes_too_high_are_refused() {
        let params = with_params(&NODE, "form=barchan,wavelength=90,height=20");
        let error = outputs_on(Window::whole(world(8, 8, 10.0)), &NODE, &params, &[]);
        assert!(matches!(error, Err(NodeError::Failed { hint: Some(hint), .. }) if hint.contains("height: 10")));
    }
}
