//! The rock at the surface: folded beds, bodies of harder and softer rock, joints and faults.
//!
//! Beds are layers of equal thickness and random hardness that dip across the strike and are folded in long waves along
//! it; the terrain cuts them. Within beds, hardness varies in long waves stretched along the strike (log-normal, like
//! measured strengths of rock), and bands of broken rock follow faults and joints.

use orograph_graph::{memory::zeroed, mix};

use crate::{
    numerics::{
        joins::{Joins, Weights},
        math, par,
        waves::{SHORTEST_CELLS, Sampler, Waves},
    },
    prelude::*,
};

params! {
    /// Direction of the strike, along which beds, folds and grain run, clockwise from north.
    strike: f64 = 60.0, Degrees, -360.0..=360.0, soft 0..=180;
    /// Angle at which beds descend to the right of the strike.
    dip: f64 = 25.0, Degrees, -90.0..=90.0;
    /// Thickness of a bed.
    bed: f64 = 250.0, Metres, 1.0..=1e5, soft 20..=2000;
    /// How much the hardness of beds differs: the standard deviation of the natural logarithm of the rate.
    beds: f64 = 0.4, One, 0.0..=3.0, soft 0..=1;
    /// Standard deviation of the distance, across the beds, by which folds displace them.
    fold_height: f64 = 600.0, Metres, 0.0..=1e5, soft 0..=3000;
    /// Wavelength of the folds across the strike.
    fold_length: f64 = 6e3, Metres, 10.0..=1e6, soft 1000..=30e3, given fold_height;
    /// How much the hardness varies within beds, measured as in `beds`.
    variation: f64 = 0.4, One, 0.0..=3.0, soft 0..=1;
    /// Size of the largest bodies of harder or softer rock, across the strike.
    size: f64 = 8e3, Metres, 1.0..=1e7, soft 500..=50e3;
    /// How much faster broken rock on faults and joints erodes: the natural logarithm of the factor.
    broken: f64 = 0.8, One, 0.0..=5.0, soft 0..=2;
    /// Distance between faults that cross the strike; those along it are twice as far apart, joints four times as close.
    spacing: f64 = 5e3, Metres, 10.0..=1e6, soft 500..=50e3, given broken;
    /// Erosion rate of average rock, for the `reference_rate` of `StreamPower`.
    rate: f64 = 4e-4, MetresPerYear, 0.0..=1.0, soft 0.0..=0.005;
    /// Steepest slope of average rock.
    repose: f64 = 38.0, Degrees, 0.0..=90.0, soft 20..=60;
    /// Standard deviation of the steepest slope from place to place. Harder rock holds steeper slopes.
    repose_variation: f64 = 7.0, Degrees, 0.0..=45.0, soft 0..=15;
    /// Random seed of beds, bodies and faults.
    seed: Seed = Seed(0), Count, ..;
}

inputs! {
    /// Terrain whose surface cuts the beds.
    height: Height;
}

outputs! {
    /// Erosion rate of the rock under the reference river of `StreamPower`; wire it to `reference_rate`.
    rate: Scalar(MetresPerYear);
    /// Steepest slope of the rock; wire it to `repose`.
    repose: Scalar(Degrees);
    /// Hardness: the natural logarithm of the erosion rate of average rock divided by that of the rock here.
    hardness: Scalar(One);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Rock",
    category: "tectonics",
    summary: "The rock at the surface: folded beds, harder and softer bodies, joints and faults.",
    doc: include_str!("rock.md"),
    sources: &[
        "K. Perlin (2002), Improving noise, ACM Transactions on Graphics 21, 681-682",
        "J. G. Ramsay and M. I. Huber (1987), The Techniques of Modern Structural Geology 2: Folds and Fractures, \
         Academic Press",
        "D. W. Burbank and R. S. Anderson (2011), Tectonic Geomorphology, Wiley-Blackwell",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    resolution: Resolution::Cells("bodies of rock shorter than four cells are left out"),
    example: "height: \"base\", strike: 60, dip: 25",
    ..Node::DEFAULT
};

/// Variations are clamped at this number of standard deviations.
const MOST_DEVIATIONS: f64 = 2.5;
/// Correlation of the angle of repose with hardness.
const HARD_IS_STEEP: f64 = 0.5;
/// How much longer bodies are along the strike than across it.
const BODIES_STRETCH: f64 = 2.5;
/// Thickness of the transition between two beds, as a fraction of a bed.
const CONTACT: f64 = 0.15;
/// Half width of a band of broken rock, as a fraction of the spacing.
const BROKEN_SHARE: f64 = 0.04;

/// The hardness, if it is not an output.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    sizing.cells(if Wants::among(sizing.wanted).hardness { 0.0 } else { 4.0 })
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let height = Inputs::read(job)?.height.samples();
    let (window, rock, wants) = (job.window(), Rock::new(&params, job), Wants::of(job));
    let nx = window.nx();
    let mut hardness = zeroed(window.len())?;
    par::rows_within(job, [0.0, 0.6], &mut hardness, |j, row| {
        let [bodies, folds, winding] = [&rock.bodies, &rock.folds, &rock.winding].map(|waves| waves.row(&window, j));
        for (i, hardness) in row.iter_mut().enumerate() {
            let (at, z) = (window.centre_m(i, j), f64::from(height[j * nx + i]));
            let waving = Waving { bodies: bodies[i], folds: folds[i], winding: winding[i] };
            *hardness = match &rock.joins {
                Some([random, mean]) if random.changes(at) => {
                    random.blend(at, |at| rock.sound(at, z, &rock.waving(at)))
                        - mean.blend(at, |at| rock.weakened(at, &rock.waving(at)))
                }
                _ => rock.sound(at, z, &waving) - rock.weakened(at, &waving),
            } as f32;
        }
    })?;
    let field = |samples: Vec<f32>| Field::new(window, samples);
    let rate_of = |hard: &f32| (params.rate * math::exp(-f64::from(*hard))) as f32;
    let rate = wants.rate.then(|| field(par::map_of(&hardness, rate_of)));
    let mut repose = None;
    if wants.repose {
        let mut slopes = zeroed(window.len())?;
        par::rows_within(job, [0.6, 1.0], &mut slopes, |j, row| {
            for (i, (slope, stands)) in row.iter_mut().zip(rock.stands.row(&window, j)).enumerate() {
                *slope = rock.repose(stands, f64::from(hardness[j * nx + i])) as f32;
            }
        })?;
        repose = Some(field(slopes));
    }
    Ok(Given { rate, repose, hardness: wants.hardness.then(|| field(hardness)) }.into())
}

/// The random fields at a position.
struct Waving {
    bodies: f64,
    folds: f64,
    winding: f64,
}

/// The rock as a function of position.
struct Rock<'a> {
    params: &'a Params,
    /// Unit vectors along the strike and across it, to the right.
    axes: [[f64; 2]; 2],
    dips: [f64; 2],
    folds: Sampler,
    bodies: Sampler,
    stands: Sampler,
    winding: Sampler,
    /// Where the rock of a place changes into that beyond a joined side: beds and bodies, and how broken it is.
    joins: Option<[Joins; 2]>,
    seed: u32,
    deviation: f64,
}

impl<'a> Rock<'a> {
    fn new(params: &'a Params, job: &Job<'_>) -> Self {
        let (azimuth, dip) = (params.strike.to_radians(), params.dip.to_radians());
        // y is south
        let along = [math::sin(azimuth), -math::cos(azimuth)];
        let grain = math::atan2(along[1], along[0]);
        let waves = |which: u32, longest_m: f64, spectral_slope: f64, stretch: f64| {
            let seed = mix(job.seed() ^ mix(0x0520_C001 + which));
            Waves { longest_m, spectral_slope, stretch, grain, seed }
        };
        let shortest_m = SHORTEST_CELLS * job.cell_m();
        let deviation = math::hypot(params.beds, params.variation).max(1e-6);
        Self {
            params,
            axes: [along, [-along[1], along[0]]],
            dips: [math::sin(dip), math::cos(dip)],
            folds: waves(0, params.fold_length, 4.0, 5.0).endless(shortest_m),
            bodies: waves(1, params.size, 2.5, BODIES_STRETCH).endless(shortest_m),
            stands: waves(2, params.size, 2.4, 1.0).sampler(shortest_m, job.world()),
            winding: waves(3, 2.0 * params.spacing, 4.0, 1.0).endless(shortest_m),
            joins: [Weights::Random { longest_m: BODIES_STRETCH * params.size }, Weights::Mean]
                .map(|weights| Joins::of(job.world(), params.size, weights))
                .into_iter()
                .collect::<Option<Vec<_>>>()
                .and_then(|joins| joins.try_into().ok()),
            seed: mix(job.seed() ^ 0x0520_C0DE),
            deviation,
        }
    }

    fn waving(&self, at: [f64; 2]) -> Waving {
        Waving { bodies: self.bodies.at(at), folds: self.folds.at(at), winding: self.winding.at(at) }
    }

    fn place(&self, at: [f64; 2]) -> [f64; 2] {
        self.axes.map(|axis| at[0] * axis[0] + at[1] * axis[1])
    }

    /// The hardness of sound rock: of its body and its bed.
    fn sound(&self, at: [f64; 2], z: f64, waving: &Waving) -> f64 {
        let [_, across] = self.place(at);
        let bodies = waving.bodies.clamp(-MOST_DEVIATIONS, MOST_DEVIATIONS);
        self.params.variation * bodies + self.params.beds * self.bed(across, z, waving.folds)
    }

    /// By how much broken rock is weaker.
    fn weakened(&self, at: [f64; 2], waving: &Waving) -> f64 {
        let [along, across] = self.place(at);
        self.params.broken * self.broken(along, across, waving.winding)
    }

    /// Returns the hardness of the bed at a position, drawn between ±√3 for a standard deviation of 1.
    fn bed(&self, across: f64, z: f64, folds: f64) -> f64 {
        let up = across * self.dips[0] + z * self.dips[1] + self.params.fold_height * folds;
        let bed = up / self.params.bed;
        let own = bed.floor();
        let draw = |bed: f64| (self.draw(bed as i64 as u32, 1) * 2.0 - 1.0) * 3.0_f64.sqrt();
        let share = math::smoothstep((bed - own - (1.0 - CONTACT)) / CONTACT);
        draw(own) * (1.0 - share) + draw(own + 1.0) * share
    }

    /// Returns the degree of fracturing, 0 to 1: by faults along the strike and across it, and by joints between them.
    fn broken(&self, along: f64, across: f64, winding: f64) -> f64 {
        let (spacing, winding) = (self.params.spacing, 0.25 * winding);
        let set = |distance: f64, spacing: f64, salt: u32| {
            let place = distance / spacing + winding;
            let nearest = (place + 0.5).floor();
            let width = (place - nearest) / BROKEN_SHARE;
            self.draw(nearest as i64 as u32, salt) / (1.0 + width * width)
        };
        let faults = set(across + 0.2 * along, 2.0 * spacing, 2).max(set(along + 0.35 * across, spacing, 3));
        let joints = set(along - 0.6 * across, 0.25 * spacing, 4).max(set(along + 0.9 * across, 0.25 * spacing, 5));
        faults.max(0.4 * joints)
    }

    fn repose(&self, stands: f64, hardness: f64) -> f64 {
        let own = (1.0 - HARD_IS_STEEP * HARD_IS_STEEP).sqrt();
        let waves = own * stands + HARD_IS_STEEP * hardness / self.deviation;
        let mean = self.params.repose;
        let varied = mean + self.params.repose_variation * waves.clamp(-MOST_DEVIATIONS, MOST_DEVIATIONS);
        varied.clamp(0.3 * mean, 89.0_f64.max(mean))
    }

    /// Returns a random number from 0 to 1 for a number.
    fn draw(&self, number: u32, salt: u32) -> f64 {
        f64::from(mix(number ^ mix(self.seed ^ salt)) >> 8) * (1.0 / 16_777_216.0)
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge, World};

    use super::*;
    use crate::testing;

    fn outputs(changes: &str) -> Outputs {
        outputs_in(testing::world(200, 200, 50.0), changes)
    }

    fn outputs_in(world: World, changes: &str) -> Outputs {
        let height = Field::constant(Window::whole(world), 300.0);
        testing::outputs(&NODE, &testing::with_params(&NODE, changes), &[("height", &height)]).expect("rock")
    }

    fn samples(outputs: &mut Outputs, name: &str) -> Vec<f32> {
        outputs.take(name).expect("an output").as_field().expect("a field").clone().into_samples()
    }

    /// Beds of 250 m that dip by 25° are 600 m wide, and change in a seventh of that.
    #[test]
    fn rock_goes_on_across_joined_sides() {
        let sides = Boundary { west: Edge::Periodic, east: Edge::Periodic, ..Boundary::all(Edge::Open) };
        let mut joined =
            outputs_in(World { boundary: sides, ..testing::world(200, 200, 25.0) }, "size=1000,spacing=4000");
        let steps = |samples: &[f32], [here, next]: [usize; 2]| -> f32 {
            (0..200).map(|y| (samples[y * 200 + here] - samples[y * 200 + next]).abs()).sum()
        };
        for name in ["hardness", "repose"] {
            let samples = samples(&mut joined, name);
            let inside = (20..140).step_by(3).map(|x| steps(&samples, [x, x + 1])).fold(0.0, f32::max);
            let seam = steps(&samples, [199, 0]);
            assert!(seam < 1.2 * inside, "{name}: {seam} {inside}");
            // what is not blended would be as different as any two columns
            assert!(steps(&samples, [130, 0]) > 2.0 * inside, "{name}");
        }
    }

    #[test]
    fn even_rock_is_mean_rock() {
        let mut even = outputs("beds=0,variation=0,broken=0,repose_variation=0,rate=0.001,repose=35");
        assert!(samples(&mut even, "rate").iter().all(|&rate| rate == 0.001));
        assert!(samples(&mut even, "repose").iter().all(|&repose| repose == 35.0));
        assert!(samples(&mut even, "hardness").iter().all(|&hardness| hardness == 0.0));
    }

    /// Flat terrain cuts unfolded beds in stripes along the strike, bed / sin(dip) wide.
    #[test]
    fn dipping_beds_are_stripes_along_the_strike() {
        // the strike is east: rows are along it
        let mut beds = outputs("strike=90,dip=30,bed=250,fold_height=0,variation=0,broken=0,repose_variation=0");
        let hardness = samples(&mut beds, "hardness");
        let rows: Vec<f32> = (0..200).map(|y| hardness[y * 200]).collect();
        for (cell, hard) in hardness.iter().enumerate() {
            assert!((hard - rows[cell / 200]).abs() < 1e-5, "{cell}");
        }
        let contacts = rows.windows(2).filter(|pair| pair[0] != pair[1]).count();
        // 10 km over 500 m is 20 contacts, each 75 m wide: two or three of the rows of 50 m
        assert!((20..=60).contains(&contacts), "{contacts}");
    }

    #[test]
    fn broken_rock_is_weaker_and_hard_rock_stands_steeper() {
        let mut sound = outputs("broken=0");
        let mut broken = outputs("broken=1");
        let pairs = samples(&mut sound, "rate").into_iter().zip(samples(&mut broken, "rate"));
        let (mut faster, mut count) = (0, 0);
        for (sound, broken) in pairs {
            assert!(broken >= sound && broken <= sound * std::f32::consts::E * 1.0001);
            faster += usize::from(broken > 1.3 * sound);
            count += 1;
        }
        assert!((count / 20..count / 2).contains(&faster), "{faster} of {count}");
        let (hardness, repose) = (samples(&mut sound, "hardness"), samples(&mut sound, "repose"));
        let (mean_hard, mean_steep) = (testing::moments(&hardness).0, testing::moments(&repose).0);
        let along: f64 =
            hardness.iter().zip(&repose).map(|(h, r)| (f64::from(*h) - mean_hard) * (f64::from(*r) - mean_steep)).sum();
        assert!(along > 0.0);
    }
}
