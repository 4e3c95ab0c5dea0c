//! A mountain range along a path: a profile of the distance to the path, bent by noise and dissected by spurs and
//! valleys.

mod spurs;

use orograph_graph::memory::zeroed;

use self::spurs::{Places, Spurs};
use crate::numerics::noise::{Basis, Fractal, Octave, sum};
use crate::{
    numerics::{
        par,
        range::{Range, Stretch, fall_off, paths, squares_at},
    },
    prelude::*,
};

choice! {
    /// Cross-section of the range.
    pub enum Profile {
        /// exp(−w² / 2): a rounded crest and a distinct foot.
        Gaussian = "gaussian",
        /// 1 / (1 + w²): a narrower crest and long foothills.
        Foothills = "foothills",
        /// (1 − w / 3)², to nothing at three widths: a sharp crest and concave flanks.
        Sharp = "sharp",
    }
}

params! {
    /// Points along the crest.
    path: PathPoints = PathPoints(vec![[1500.0, 12500.0], [5500.0, 9800.0], [8200.0, 9000.0], [11000.0, 5500.0], [15000.0, 4000.0]]), Metres, -1e7..=1e7, unless lines;
    /// Height of the crest above the surrounding terrain.
    height: f64 = 2200.0, Metres, 0.0..=1e5, soft 100..=5000;
    /// Width w of the flank to the right of the path; with `profile: sharp` the foot lies three widths away.
    front: f64 = 2600.0, Metres, 1.0..=1e7, soft 200..=20000;
    /// Width w of the flank to the left of the path; with `profile: sharp` the foot lies three widths away.
    back: f64 = 4000.0, Metres, 1.0..=1e7, soft 200..=20000;
    /// Cross-section of the range.
    profile: Profile = Profile::Sharp, One, ..;
    /// How far crest and foot wind around the path: at 1, by up to three times `spacing` along each axis.
    bend: f64 = 0.6, One, 0.0..=1.0;
    /// How deep the valleys between spurs are: 0 for even flanks.
    spurs: f64 = 0.5, One, 0.0..=1.0;
    /// Distance between large spurs.
    spacing: f64 = 2500.0, Metres, 1.0..=1e6, soft 200..=10000;
    /// How steep spurs are, relative to those twice as large: near 1, small ones cover the flanks like fur.
    fine: f64 = 0.5, One, 0.0..=1.0, given spurs;
    /// How jagged crest and foot are between bends: 0 for a smooth course.
    jagged: f64 = 1.0, One, 0.0..=1.0, given bend;
    /// How much summits and passes differ from the crest's height, as a fraction of it.
    variation: f64 = 0.35, One, 0.0..=1.0;
    /// Random seed of spurs and summits.
    seed: Seed = Seed(0), Count, ..;
}

inputs! {
    /// Lines along crests, such as those of `Path`.
    lines: Option<Lines>;
}

outputs! {
    /// Height above the surrounding terrain.
    height: Height;
    /// The profile without spurs and summits, 1 on the winding crest.
    mask: Mask;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Range",
    version: 3,
    // spurs of 0.6 that hardly get gentler make 45 % of the land steeper than 45°
    migrations: &[
        Migration { from: 1, steps: &[Step::Keep { name: "spurs", value: "0.6" }] },
        Migration {
            from: 2,
            steps: &[
                Step::Keep { name: "front", value: "1500" },
                Step::Keep { name: "back", value: "2500" },
                Step::Keep { name: "spurs", value: "0.2" },
                Step::Keep { name: "fine", value: "0.78" },
                Step::Keep { name: "jagged", value: "0" },
            ],
        },
    ],
    category: "generate",
    summary: "A mountain range along a path, with spurs and summits.",
    doc: include_str!("page.md"),
    sources: &[
        "T. Tricard, S. Efremov, C. Zanni, F. Neyret, J. Martínez, S. Lefebvre, 2019, Procedural phasor noise, ACM Transactions on Graphics 38",
        "H. Hnaidi, E. Guérin, S. Akkouche, A. Peytavie, E. Galin, 2010, Feature based terrain generation using diffusion equation",
        "J.-D. Génevaux et al., 2015, Terrain modelling from feature primitives, Computer Graphics Forum 34",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    example: "height: 3000, front: 3000, back: 4000, spacing: 3500, seed: 8",
    ..Node::DEFAULT
};

/// Octaves of the bends, the last as long as the spacing of spurs, and of those that make the course jagged.
const BENDS: i64 = 3;
const JAGS: i64 = 6;
/// The shortest waves that places show, in steps between them.
const LEAST_STEPS: f64 = 4.0;

/// Salts of the noise that varies the crest and of the noises that displace it to the east and to the south.
const SALTS: [u32; 3] = [0x510e_527f, 0x9b05_688c, 0x1f83_d9ab];

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    // displacements and distances, or distances and the terrain under spurs
    sizing.cells((12.5 - 4.0 * Wants::among(sizing.wanted).count() as f64).max(0.0))
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let window = job.window();
    let nx = window.nx();
    let course = Course::new(job, &params)?;
    let xs: Vec<f64> = (0..nx).map(|i| window.centre_m(i, 0)[0]).collect();
    let bends = course.bends(|octaves, bend_m| sum::lattices(job, octaves, Basis::Bell, bend_m))?;
    let mut mask = zeroed(window.len())?;
    par::rows_within(job, [0.1, 0.2], &mut mask, |j, row| {
        let bends = bends.each_ref().map(|bend| &bend[j * nx..][..nx]);
        course.squares(&xs, window.centre_m(0, j)[1], bends, row);
    })?;
    drop(bends);
    let wants = Wants::of(job);
    let risen = || -> Result<Field, NodeError> {
        let spurs = Spurs::new(job, [params.spurs, params.spacing, params.fine], |places| course.heights(job, places))?;
        let crest = params.fractal(job, SALTS[0], 2.0, 4).octaves(job.world());
        let mut height = sum::lattices(job, &crest, Basis::Bell, params.variation)?;
        par::rows_within(job, [0.4, 0.9], &mut height, |j, row| {
            let mut share = mask[j * nx..][..nx].to_vec();
            params.profile.of(&mut share);
            for (height, share) in row.iter_mut().zip(share) {
                *height = params.height as f32 * (1.0 + *height) * share;
            }
            spurs.carve(&xs, window.centre_m(0, j)[1], row, false);
        })?;
        Ok(Field::new(window, height))
    };
    let height = wants.height.then(risen).transpose()?;
    if wants.mask {
        par::rows_within(job, [0.9, 1.0], &mut mask, |_, row| params.profile.of(row))?;
    }
    Ok(Given { height, mask: wants.mask.then(|| Field::new(window, mask)) }.into())
}

impl Params {
    /// Returns octaves of noise, the first with a wavelength of `spacings` times the spacing of spurs.
    fn fractal(&self, job: &Job<'_>, salt: u32, spacings: f64, octaves: i64) -> Fractal {
        Fractal {
            wavelength_m: spacings * self.spacing,
            octaves,
            lacunarity: 2.0,
            gain: 0.5,
            tileable: false,
            seed: orograph_graph::mix(job.seed() ^ salt),
        }
    }
}

/// The course of the range.
struct Course<'a> {
    params: &'a Params,
    stretches: Vec<Stretch>,
    /// Noise that displaces it to the east and to the south: octaves down to the spacing of spurs, then those that make
    /// the course jagged.
    bends: [Vec<Octave>; 2],
}

impl<'a> Course<'a> {
    fn new(job: &Job<'_>, params: &'a Params) -> Result<Self, NodeError> {
        let paths = paths(Inputs::read(job)?.lines, &params.path.0);
        let stretches = Range { paths, widths_m: [params.front, params.back] }.stretches();
        let bends = [SALTS[1], SALTS[2]].map(|salt| {
            let broad = params.fractal(job, salt, 4.0, BENDS);
            let whole = Fractal { octaves: BENDS + JAGS, ..broad };
            let per_broad = whole.amplitudes().sum::<f64>() / broad.amplitudes().sum::<f64>();
            let jags = whole.octaves(job.world()).into_iter().skip(BENDS as usize);
            let jags = jags.map(|octave| Octave { share: octave.share * per_broad * params.jagged, ..octave });
            let jags = jags.filter(|octave| octave.share > 0.0);
            broad.octaves(job.world()).into_iter().chain(jags).collect()
        });
        Ok(Self { params, stretches, bends })
    }

    /// Returns the displacements to the east and to the south at which the range is sampled, in metres.
    fn bends(&self, noise: impl Fn(&[Octave], f64) -> Result<Vec<f32>, NodeError>) -> Result<[Vec<f32>; 2], NodeError> {
        let bend_m = 3.0 * self.params.bend * self.params.spacing;
        let [east, south] = &self.bends;
        Ok([noise(east, bend_m)?, noise(south, bend_m)?])
    }

    /// Computes the squared distances of a row of places to the crest, in widths.
    fn squares(&self, xs: &[f64], y: f64, [east, south]: [&[f32]; 2], squares: &mut [f32]) {
        let xs: Vec<f64> = xs.iter().zip(east).map(|(x, bend)| x + f64::from(*bend)).collect();
        let ys: Vec<f64> = south.iter().map(|bend| y + f64::from(*bend)).collect();
        squares_at(&self.stretches, &xs, &ys, squares);
    }

    /// Returns the heights at places, without spurs and summits.
    fn heights(&self, job: &Job<'_>, places: &Places) -> Result<Vec<f32>, NodeError> {
        let bends = self.bends(|octaves, bend_m| {
            let step_cells = places.step_m / job.cell_m();
            // jags between the places would give them random slopes
            let is_seen = |(k, octave): &(usize, &Octave)| {
                *k < BENDS as usize || octave.wavelength_cells >= LEAST_STEPS * step_cells
            };
            let seen = octaves.iter().enumerate().filter(is_seen);
            let seen = seen.map(|(_, octave)| octave.seen(step_cells, places.first));
            sum::places(job, places.cells, &seen.collect::<Vec<_>>(), Basis::Bell, bend_m)
        })?;
        let (xs, nx) = (places.xs(), places.cells[0]);
        let mut heights = vec![0.0; nx * places.cells[1]];
        par::each(heights.chunks_mut(nx), |j, row| {
            self.squares(&xs, places.y(j), bends.each_ref().map(|bend| &bend[j * nx..][..nx]), row);
            self.params.profile.of(row);
            row.iter_mut().for_each(|height| *height *= self.params.height as f32);
            job.check()
        })?;
        Ok(heights)
    }
}

impl Profile {
    /// Converts squared distances in widths to fractions of the height.
    fn of(self, row: &mut [f32]) {
        match self {
            Self::Gaussian => fall_off(row, 1.0),
            Self::Foothills => row.iter_mut().for_each(|value| *value = 1.0 / (1.0 + *value)),
            Self::Sharp => row.iter_mut().for_each(|value| {
                let left = (1.0 - value.sqrt() * (1.0 / 3.0)).max(0.0);
                *value = left * left;
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::ParamValue;

    use super::*;
    use crate::testing::{block_means, generate, moments, outputs_on, run_with, with_params, world};

    fn range(changes: &str) -> [Field; 2] {
        let mut params = with_params(&NODE, changes);
        params.set("path", ParamValue::Path(vec![[2000.0, 3000.0], [5000.0, 3000.0], [8000.0, 3000.0]]));
        let mut outputs = outputs_on(Window::whole(world(100, 60, 100.0)), &NODE, &params, &[]).expect("a result");
        ["height", "mask"].map(|name| outputs.take(name).expect("an output").as_field().expect("a field").clone())
    }

    /// To rounding: the path is half a cell from cell centres and heads east, so that south is its front.
    #[test]
    fn an_even_range_is_its_profile() {
        type Shape = fn(f64) -> f64;
        let shapes: [(&str, Shape); 3] = [
            ("gaussian", |w| crate::numerics::math::exp(-0.5 * w * w)),
            ("foothills", |w| 1.0 / (1.0 + w * w)),
            ("sharp", |w| (1.0 - w / 3.0).max(0.0) * (1.0 - w / 3.0).max(0.0)),
        ];
        for (name, shape) in shapes {
            let [height, mask] =
                range(&format!("profile={name},height=1000,front=500,back=900,bend=0,spurs=0,variation=0"));
            for j in 0..60 {
                let right = 100.0 * f64::from(j) + 50.0 - 3000.0;
                let expected = shape(if right > 0.0 { right / 500.0 } else { right / -900.0 });
                let at = j as usize * 100 + 50;
                assert!((f64::from(height.samples()[at]) - 1000.0 * expected).abs() < 2e-3, "{name} {right}");
                assert!((f64::from(mask.samples()[at]) - expected).abs() < 2e-6, "{name} {right}");
            }
        }
    }

    /// A path as a line gives the same bytes as a parameter; with many points, those that cannot be the nearest are
    /// skipped without a difference.
    #[test]
    fn lines_make_the_range_of_their_points() {
        let points: Vec<[f64; 2]> =
            (0..200).map(|k| [50.0 * f64::from(k), 3000.0 + 900.0 * libm::sin(0.2 * f64::from(k))]).collect();
        let mut params = with_params(&NODE, "front=400,back=700,spurs=0,spacing=800");
        params.set("path", ParamValue::Path(points.clone()));
        let window = Window::whole(world(90, 60, 100.0));
        let mask = |outputs: Outputs| {
            let mut outputs = outputs;
            outputs.take("mask").expect("an output").as_field().expect("a field").clone()
        };
        let drawn = mask(outputs_on(window, &NODE, &params, &[]).expect("a result"));
        let vertex = |at: &[f64; 2]| orograph_graph::Vertex { position_m: *at, ..orograph_graph::Vertex::default() };
        let vertices = points.iter().map(vertex).collect();
        let line = orograph_graph::Line { order: 1, downstream: None, vertices };
        let lines = orograph_graph::Lines { draped: true, ..orograph_graph::Lines::open(vec![line]) };
        let defaults = with_params(&NODE, "front=400,back=700,spurs=0,spacing=800");
        let (wanted, cancel) = (orograph_graph::Wanted::ALL, orograph_graph::Cancel::default());
        let value = |name: &str| (name == "lines").then(|| lines.clone().into());
        let wired = mask(run_with(wanted, &cancel, window, &NODE, &defaults, &value).0.expect("a result"));
        assert_eq!(drawn, wired);
        // each segment alone, the highest counts
        let mut highest = vec![0.0_f32; window.len()];
        for pair in points.windows(2) {
            params.set("path", ParamValue::Path(pair.to_vec()));
            let one = mask(outputs_on(window, &NODE, &params, &[]).expect("a result"));
            highest.iter_mut().zip(one.samples()).for_each(|(high, one)| *high = high.max(*one));
        }
        assert_eq!(drawn.samples(), highest);
    }

    /// Spurs run down the flanks: along a straight range, the squared slopes of the change by spurs are more than twice
    /// those down it. Nothing is below the foot, and the mean profile is preserved.
    #[test]
    fn spurs_run_down_the_flanks() {
        let even = range("front=900,back=900,bend=0,spurs=0,variation=0");
        let spurred = range("front=900,back=900,bend=0,spurs=1,variation=0");
        assert_eq!(even[1], spurred[1]);
        assert!(spurred[0].samples().iter().all(|h| *h >= 0.0));
        let changed: Vec<f32> = spurred[0].samples().iter().zip(even[0].samples()).map(|(a, b)| a - b).collect();
        let mut squares = [0.0; 2];
        for (i, j) in (25..75).flat_map(|i| (15..27).chain(33..45).map(move |j| (i, j))) {
            let at = j * 100 + i;
            let slope = |step: usize| f64::from(changed[at + step] - changed[at - step]);
            squares = [squares[0] + slope(1) * slope(1), squares[1] + slope(100) * slope(100)];
        }
        assert!(squares[0] > 2.0 * squares[1], "{squares:?}");
        let [least, most] = changed.iter().fold([0.0_f32; 2], |[l, m], c| [l.min(*c), m.max(*c)]);
        assert!(least < -50.0 && most > 50.0, "{least} {most}");
    }

    /// The crest deviates from the path by no more than its bound, and somewhere by at least a third of it.
    #[test]
    fn the_crest_bends() {
        let [_, mask] = range("front=800,back=800,bend=1,spacing=400,spurs=0");
        let crest = (25..75).map(|i| {
            let row = (0..60).max_by(|a, b| mask.samples()[a * 100 + i].total_cmp(&mask.samples()[b * 100 + i]));
            (f64::from(row.expect("rows") as u32) + 0.5 - 30.0) * 100.0
        });
        let farthest = crest.fold(0.0_f64, |most, away| most.max(away.abs()));
        assert!((300.0..=1250.0).contains(&farthest), "{farthest}");
    }

    /// Slopes of steep real ranges on cells of 30 to 90 m: medians of 13 to 29°, 95th percentiles of 34 to 48°.
    #[test]
    fn flanks_are_as_steep_as_real_ones() {
        let window = Window::whole(world(256, 256, 64.0));
        let land = generate(window, &NODE, "");
        let h = land.samples();
        let angle = |at: usize| {
            let [x, y] = [f64::from(h[at + 1] - h[at - 1]), f64::from(h[at + 256] - h[at - 256])];
            crate::numerics::math::atan(crate::numerics::math::hypot(x, y) / 128.0).to_degrees()
        };
        let inside = (256..255 * 256).filter(|at| (1..255).contains(&(at % 256)) && h[*at] > 50.0);
        let mut angles: Vec<f64> = inside.map(angle).collect();
        angles.sort_by(f64::total_cmp);
        let at = |share: f64| angles[(share * angles.len() as f64) as usize];
        assert!((13.0..29.0).contains(&at(0.5)) && (34.0..48.0).contains(&at(0.95)), "{} {}", at(0.5), at(0.95));
    }

    /// A finer raster only adds detail: means over 800 m are those of the coarse raster, to 2 % of the standard
    /// deviation.
    #[test]
    fn finer_cells_only_add_detail() {
        let land = |cells: u32, cell_m: f64| {
            let window = Window::whole(world(cells, cells, cell_m));
            generate(window, &NODE, "seed=3")
        };
        let (coarse, fine) = (land(160, 100.0), land(640, 25.0));
        let (_, std) = moments(coarse.samples());
        let (coarse, fine) = (block_means(&coarse, 8), block_means(&fine, 32));
        let difference: Vec<f32> = coarse.iter().zip(&fine).map(|(a, b)| a - b).collect();
        let (offset, rms) = moments(&difference);
        assert!(rms < 0.02 * std && offset.abs() < 0.01 * std, "{rms} {offset} {std}");
    }

    #[test]
    fn nothing_extreme_breaks_it() {
        for changes in [
            "spacing=1",
            "spacing=1e6,height=1e5,front=1,back=1,spurs=1,bend=1,variation=1",
            "height=0",
            "spurs=1,profile=foothills",
        ] {
            for cell_m in [1e-3, 1.0, 1e4] {
                let field = generate(Window::whole(world(70, 5, cell_m)), &NODE, changes);
                assert!(field.samples().iter().all(|h| h.is_finite() && *h >= 0.0), "{changes} {cell_m}");
            }
        }
    }
}
