//! Value, simplex and cellular noise, alone or as a sum of octaves.
//!
//! S. Worley (1996), "A cellular texture basis function"; D. S. Ebert and others (2003), "Texturing and Modeling",
//! chapter 4. Differences are described in the modules `cells` and `basis` of [`crate::numerics::noise`].

use crate::numerics::noise::{
    Basis, Fractal, Octave,
    cells::{self, Cells, Chebyshev, Euclidean, Manhattan, Measure, Parts},
    raster,
    simplex::{self, Simplex},
    sum, table,
};
use crate::{prelude::*, wgsl};

choice! {
    /// Kind of noise.
    pub enum Kind {
        /// Random values, smoothly interpolated: soft knolls and hollows, from −1 to 1.
        Value = "value",
        /// Gradients at the corners of triangles: hills without visible rows and columns, from −1 to 1.
        Simplex = "simplex",
        /// The distance to the nearest of scattered points: round basins that meet in sharp crests.
        Nearest = "nearest",
        /// The distance to the second nearest point: overlapping scales.
        Second = "second",
        /// The second distance minus the first: plates, 0 along the borders between them and highest at their points.
        Borders = "borders",
    }
}

choice! {
    /// How distances are measured.
    pub enum Metric {
        /// Straight-line distance: round cells.
        Euclidean = "euclidean",
        /// Along x and then y: diamonds.
        Manhattan = "manhattan",
        /// The larger of the distances along x and y: squares.
        Chebyshev = "chebyshev",
    }
}

params! {
    /// Kind of noise.
    kind: Kind = Kind::Simplex, One, ..;
    /// Size of the largest cells: the mean distance between points.
    wavelength: f64 = 5000.0, Metres, 1.0..=1e6, soft 200..=30000;
    /// Number of octaves, from coarse to fine; those too fine for the cells are replaced by their mean.
    octaves: i64 = 10, Count, 1..=24, soft 1..=12;
    /// Ratio of the wavelength of an octave to that of the next finer one.
    lacunarity: f64 = 2.0, One, 1.1..=8.0, soft 1.7..=3.0;
    /// Ratio of the amplitude of an octave to that of the one before.
    gain: f64 = 0.5, One, 0.0..=1.0, soft 0.3..=0.7;
    /// Height of a value of 1, or of a distance of one wavelength.
    amplitude: f64 = 400.0, Metres, 0.0..=1e6, soft 0..=4000;
    /// How far points are displaced from a regular grid: 0 not at all, 1 anywhere in their cells.
    jitter: f64 = 1.0, One, 0.0..=1.0, when kind = "nearest" | "second" | "borders";
    /// How distances are measured; not used by `value` and `simplex`.
    metric: Metric = Metric::Euclidean, One, .., when kind = "nearest" | "second" | "borders";
    /// Makes opposite sides of the world fit together; wavelengths are then rounded to whole fractions of its sides.
    ///
    /// `simplex` noise cannot be tiled.
    tileable: bool = false, One, ..;
    /// Random seed of the pattern.
    seed: Seed = Seed(0), Count, ..;
}

outputs! {
    /// Elevation: `amplitude` times the noise.
    height: Height;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Noise",
    version: 2,
    migrations: &[Migration {
        from: 1,
        steps: &[
            Step::Keep { name: "kind", value: "borders" },
            Step::Keep { name: "octaves", value: "1" },
            Step::Keep { name: "wavelength", value: "2500" },
            Step::Keep { name: "amplitude", value: "600" },
        ],
    }],
    category: "generate",
    summary: "Hills that show no grid, plates, basins or scales: simplex, cellular (Worley) and value noise.",
    doc: include_str!("noise.md"),
    sources: &[
        "S. Worley, 1996, A cellular texture basis function",
        "S. Gustavson, 2005, Simplex noise demystified",
        "D. S. Ebert, F. K. Musgrave, D. Peachey, K. Perlin, S. Worley, 2003, Texturing and Modeling, chapter 4",
    ],
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    gpu: Some(&GPU),
    example: "kind: nearest, wavelength: 3000, octaves: 3, gain: 0.4, amplitude: 900, seed: 4",
    ..Node::DEFAULT
};

static SHADER: Shader = Shader {
    name: "generate/noise",
    source: wgsl!("generate/noise"),
    library: &[wgsl::HASH, wgsl::LATTICE],
    values: &[("count", Number::U32), ("start", Number::F32), ("near_part", Number::F32), ("second_part", Number::F32)],
    slots: &[Slot::words("octaves_of", "Octave"), Slot::words("directions", "f32"), Slot::output("height")],
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&SHADER],
    passes: Passes::Recorded(record),
    covers: |params| {
        let params = Params::read(params);
        !(params.kind == Kind::Simplex && params.tileable)
    },
    tolerance: &[Tolerance::relative(4e-6)],
    ..GpuKernel::DEFAULT
};

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let params = Params::read(job.params);
    let octaves = params.fractal(job.seed()).octaves(job.world());
    let (start, factor) = match (params.kind, params.metric) {
        (Kind::Value, _) => (0.0, 1.0),
        (Kind::Simplex, _) => (0.0, simplex::SCALE),
        (_, Metric::Euclidean) => (params.rest::<Euclidean>(&octaves), 1.0),
        (_, Metric::Manhattan) => (params.rest::<Manhattan>(&octaves), 1.0),
        (_, Metric::Chebyshev) => (params.rest::<Chebyshev>(&octaves), 1.0),
    };
    let words = table::table(&octaves, Basis::Value, |octave| sum::scale(octave, params.amplitude) * factor);
    let octaves_of = recorder.table(&words)?;
    let directions = recorder.table(&simplex::directions().map(f32::to_bits))?;
    let [near_part, second_part] = params.parts();
    recorder.pass(&Pass {
        shader: &SHADER,
        entry: "main",
        bind: &[("octaves_of", Bind::Scratch(octaves_of)), ("directions", Bind::Scratch(directions))],
        values: &[
            ("count", Scalar::U32(octaves.len() as u32)),
            ("start", Scalar::F32(start)),
            ("near_part", Scalar::F32(near_part)),
            ("second_part", Scalar::F32(second_part)),
        ],
        over: Over::Cells(Rows::Around(0)),
    })
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    if params.kind == Kind::Simplex && params.tileable {
        return Err(NodeError::failed_with_hint(
            "triangles do not fit together at the sides of a world",
            "choose another `kind`, or take `Perlin`, for tiles",
        ));
    }
    let octaves = params.fractal(job.seed()).octaves(job.world());
    let samples = match (params.kind, params.metric) {
        (Kind::Value, _) => sum::lattices(job, &octaves, Basis::Value, params.amplitude)?,
        (Kind::Simplex, _) => {
            let layer = |octave: &Octave| Simplex::new(*octave, sum::scale(octave, params.amplitude) * simplex::SCALE);
            raster::raster(job, || octaves.iter().map(layer).collect::<Vec<_>>(), &sum::Sum { start: 0.0 })?
        }
        (_, Metric::Euclidean) => params.cells::<Euclidean>(job, &octaves)?,
        (_, Metric::Manhattan) => params.cells::<Manhattan>(job, &octaves)?,
        (_, Metric::Chebyshev) => params.cells::<Chebyshev>(job, &octaves)?,
    };
    Ok(Given { height: Some(Field::new(job.window(), samples)) }.into())
}

impl Params {
    /// Returns the sum of octaves of cellular noise. Octaves that the raster cannot represent are replaced by their
    /// mean, which is not 0, unlike that of other noise: omitting them would lower the terrain.
    fn cells<M: Measure>(&self, job: &Job<'_>, octaves: &[Octave]) -> Result<Vec<f32>, NodeError> {
        let (jitter, parts) = (self.jitter as f32, self.parts());
        let start = self.rest::<M>(octaves);
        let layer = |octave: &Octave| {
            let scale = sum::scale(octave, self.amplitude);
            Cells::<M>::new(*octave, jitter, parts.map(|part| part * scale))
        };
        raster::raster(job, || octaves.iter().map(layer).collect::<Vec<_>>(), &sum::Sum { start })
    }

    /// Returns the mean of the octaves that the raster cannot represent.
    fn rest<M: Measure>(&self, octaves: &[Octave]) -> f32 {
        let held: f64 = octaves.iter().map(|octave| octave.share * octave.fade).sum();
        (self.amplitude * cells::mean::<M>(self.jitter as f32, self.parts()) * (1.0 - held)) as f32
    }

    fn fractal(&self, seed: u32) -> Fractal {
        let finer = if self.kind == Kind::Simplex { simplex::FINER } else { 1.0 };
        Fractal {
            wavelength_m: finer * self.wavelength,
            octaves: self.octaves,
            lacunarity: self.lacunarity,
            gain: self.gain,
            tileable: self.tileable,
            seed,
        }
    }

    /// Returns the factors of the distances to the nearest and second nearest point.
    const fn parts(&self) -> Parts {
        match self.kind {
            Kind::Value | Kind::Simplex | Kind::Nearest => [1.0, 0.0],
            Kind::Second => [0.0, 1.0],
            Kind::Borders => [-1.0, 1.0],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        numerics::noise::lattice::{Axis, hash, hash_row},
        testing::{at_every_level, block_means, generate, moments, seams, with_params, world},
    };

    const KINDS: [&str; 5] = ["kind=value", "kind=simplex", "kind=nearest", "kind=second", "kind=borders"];

    /// Compares with all points within five cells, in double precision: the search of the row kernel misses none. To
    /// 1e-6 of a cell, a few roundings of numbers up to 3.
    #[test]
    fn distances_are_those_to_the_nearest_of_all_points() {
        for (metric, changes) in
            [(Metric::Euclidean, "jitter=1"), (Metric::Manhattan, "jitter=0.7"), (Metric::Chebyshev, "jitter=1")]
        {
            let window = Window { world: world(700, 600, 10.0), origin: [301, 77], cells: [150, 140] };
            let changes =
                |kind| format!("{kind},octaves=1,wavelength=130,amplitude=1,{changes},metric={}", metric.name());
            let [nearest, second] = ["kind=nearest", "kind=second"].map(|kind| generate(window, &NODE, &changes(kind)));
            let params = Params::read(&with_params(&NODE, &changes("kind=nearest")));
            let seed = orograph_graph::mix(orograph_graph::mix(0));
            let fractal =
                Fractal { wavelength_m: 130.0, octaves: 1, lacunarity: 2.0, gain: 0.5, tileable: false, seed };
            let octave = fractal.octaves(&window.world)[0];
            for at in (0..window.len()).step_by(7) {
                let cell = [301 + (at % 150) as u32, 77 + (at / 150) as u32];
                let [x, y] = [octave.axes[0].at(cell[0]), octave.axes[1].at(cell[1])];
                let mut ranks: Vec<f64> = (-5..=5)
                    .flat_map(|j| (-5..=5).map(move |i| (i, j)))
                    .map(|(i, j)| {
                        let hash = hash(Axis::cell(x) + i, hash_row(Axis::cell(y) + j, octave.seed));
                        let place = |bits: u32| 0.5 + params.jitter * (f64::from(bits & 0xffff) / 65_536.0 - 0.5);
                        let [dx, dy] = [
                            place(hash >> 16) + f64::from(i) - f64::from(Axis::fraction(x)),
                            place(hash) + f64::from(j) - f64::from(Axis::fraction(y)),
                        ];
                        match metric {
                            Metric::Euclidean => crate::numerics::math::hypot(dx, dy),
                            Metric::Manhattan => dx.abs() + dy.abs(),
                            Metric::Chebyshev => dx.abs().max(dy.abs()),
                        }
                    })
                    .collect();
                ranks.sort_by(f64::total_cmp);
                for (field, rank) in [(&nearest, ranks[0]), (&second, ranks[1])] {
                    let got = f64::from(field.samples()[at]);
                    assert!((got - rank.min(2.0)).abs() < 1e-6, "{metric:?} {cell:?}: {got} {rank}");
                }
            }
        }
    }

    #[test]
    fn a_tile_has_the_bits_of_the_whole_at_every_simd_level() {
        let world = world(400, 300, 12.5);
        for kind in KINDS {
            let changes = format!("{kind},wavelength=800,octaves=9,lacunarity=1.7,gain=0.7");
            let whole = generate(Window::whole(world), &NODE, &changes);
            at_every_level(|| generate(Window::whole(world), &NODE, &changes));
            for (origin, cells) in [([0, 0], [1, 1]), ([255, 63], [3, 3]), ([123, 77], [200, 150])] {
                let window = Window { world, origin, cells };
                assert_eq!(generate(window, &NODE, &changes), whole.crop(&window), "{kind}");
            }
        }
    }

    /// Points of a Poisson process have a mean nearest distance of ½; one point in each cell is more regular. A regular
    /// grid has the mean distance to the centre of a square, 0.3826.
    #[test]
    fn the_means_are_known() {
        let grid = cells::mean::<Euclidean>(0.0, [1.0, 0.0]);
        assert!((grid - 0.3826).abs() < 0.002, "{grid}");
        let grid = cells::mean::<Chebyshev>(0.0, [1.0, 0.0]); // ∫ of the larger of |x| and |y|
        assert!((grid - 1.0 / 3.0).abs() < 0.002, "{grid}");
        let even = cells::mean::<Euclidean>(1.0, [1.0, 0.0]);
        assert!(even > 0.3826 && even < 0.5, "{even}");
        let window = Window::whole(world(1024, 1024, 10.0));
        let (mean, _) = moments(generate(window, &NODE, "kind=nearest,octaves=1,wavelength=107,amplitude=1").samples());
        assert!((mean - even).abs() < 0.008, "{mean} {even}"); // 9000 cells, deviation 0.2 each
    }

    /// Means over squares of 8 coarse cells differ by detail that they do not filter out, and by the error of the mean
    /// where octaves are omitted.
    #[test]
    fn finer_cells_only_add_detail() {
        for kind in KINDS {
            let changes = format!("{kind},wavelength=4000,octaves=12,amplitude=1000");
            let coarse = generate(Window::whole(world(256, 256, 64.0)), &NODE, &changes);
            let fine = generate(Window::whole(world(512, 512, 32.0)), &NODE, &changes);
            let (_, std) = moments(coarse.samples());
            let (coarse, fine) = (block_means(&coarse, 8), block_means(&fine, 16));
            let difference: Vec<f32> = coarse.iter().zip(&fine).map(|(a, b)| a - b).collect();
            let (offset, rms) = moments(&difference);
            assert!(rms < 0.03 * std && offset.abs() < 0.01 * std, "{changes}: {rms} {offset} of {std}");
        }
    }

    #[test]
    fn opposite_sides_of_a_tile_fit_together() {
        for kind in KINDS.into_iter().filter(|kind| *kind != "kind=simplex") {
            let field = generate(
                Window::whole(world(256, 192, 10.0)),
                &NODE,
                &format!("{kind},octaves=1,wavelength=470,tileable=true"),
            );
            let [within, across] = seams(&field);
            assert!(across <= 1.1 * within, "{kind}: {across} {within}");
        }
    }

    /// Reference for simplex noise in the plane, in double precision: the sum over all kernels within reach, found from
    /// all lattice points nearby and not from the enclosing triangle. To a few roundings of the offsets.
    #[test]
    fn simplex_noise_is_the_sum_of_all_kernels_around() {
        let window = Window { world: world(700, 600, 10.0), origin: [301, 77], cells: [150, 140] };
        let field = generate(window, &NODE, "kind=simplex,octaves=1,wavelength=130,amplitude=1");
        let seed = orograph_graph::mix(orograph_graph::mix(0));
        let fractal = Fractal { wavelength_m: 104.0, octaves: 1, lacunarity: 2.0, gain: 0.5, tileable: false, seed };
        let octave = fractal.octaves(&window.world)[0];
        let (skew, unskew) = (0.5 * (3.0_f64.sqrt() - 1.0), (3.0 - 3.0_f64.sqrt()) / 6.0);
        for at in (0..window.len()).step_by(7) {
            let cell = [301 + (at % 150) as u32, 77 + (at / 150) as u32];
            let [x, y] = [0, 1].map(|axis| octave.axes[axis].at(cell[axis]) as f64 / 4_294_967_296.0);
            let [i, j] = [x, y].map(|part| (part + skew * (x + y)).floor() as i32);
            let mut expected = 0.0;
            for (i, j) in (-2..=3).flat_map(|b| (-2..=3).map(move |a| (i + a, j + b))) {
                let back = unskew * f64::from(i + j);
                let (dx, dy) = (x - f64::from(i) + back, y - f64::from(j) + back);
                let rest = (0.5 - dx * dx - dy * dy).max(0.0);
                let direction = ((hash(i, hash_row(j, octave.seed)) >> 8) as usize * 24) >> 24;
                let angle = (7.5 + 15.0 * direction as f64).to_radians();
                expected += rest
                    * rest
                    * rest
                    * rest
                    * (dx * crate::numerics::math::cos(angle) + dy * crate::numerics::math::sin(angle));
            }
            let got = f64::from(field.samples()[at]);
            assert!((got - 99.836_85 * expected).abs() < 2e-5, "{cell:?}: {got} {expected}");
        }
    }

    /// On about 55 000 triangles: within ±1 and close to it, with the documented standard deviation, and isotropic
    /// power to 10 %.
    #[test]
    fn simplex_noise_is_even() {
        let window = Window::whole(world(2048, 2048, 10.0));
        let field = generate(window, &NODE, "kind=simplex,octaves=1,wavelength=107,amplitude=1");
        let (mean, std) = moments(field.samples());
        let most = field.samples().iter().fold(0.0_f32, |most, n| most.max(n.abs()));
        assert!(mean.abs() < 0.005 && (std / 0.54 - 1.0).abs() < 0.03, "{mean} {std}");
        assert!(most > 0.9 && most <= 1.000_01, "{most}");
        let powers = crate::testing::power_by_direction(&NODE, "kind=simplex,wavelength=12,octaves=2,amplitude=1");
        assert!(powers.iter().all(|p| (p - 1.0).abs() < 0.1), "{powers:?}");
    }

    #[test]
    fn nothing_extreme_breaks_it() {
        for (cell_m, kind) in [1e-3, 1.0, 1e6].into_iter().flat_map(|cell_m| KINDS.map(|kind| (cell_m, kind))) {
            for changes in [
                "wavelength=1",
                "wavelength=1e6,octaves=24,lacunarity=1.1,gain=1",
                "jitter=0,amplitude=1e6",
                "octaves=3,gain=0",
            ] {
                let field = generate(Window::whole(world(70, 5, cell_m)), &NODE, &format!("{kind},{changes}"));
                let most = Params::read(&with_params(&NODE, &format!("{kind},{changes}"))).amplitude as f32 * 2.000_1;
                assert!(field.samples().iter().all(|h| h.abs() <= most), "{kind} {changes} {cell_m}");
            }
        }
    }
}
