//! Displacement of a field by noise or by wired fields.
//!
//! The value at x becomes that at x + d(x). The noise d is either two independent sums of octaves, or the curl of one,
//! after R. Bridson, J. Houriham and M. Nordenstam (2007), "Curl-noise for procedural fluid flow". The curl is free of
//! divergence, so that it stirs the terrain without pinching it.

use orograph_graph::{
    gpu::Size,
    memory::{copied, zeroed},
    mix,
};

use crate::numerics::lines::Ends;
use crate::{
    numerics::{
        math::lane,
        noise::{Basis, Fractal, Octave, sum, table},
        par,
        simd::simd,
    },
    prelude::*,
    wgsl,
};

choice! {
    /// Source of the displacement.
    pub enum Pattern {
        /// Independent noise along x and y: features are bent, stretched and compressed.
        Fbm = "fbm",
        /// The curl of noise: features are bent and swirled, but keep their area.
        Curl = "curl",
        /// The inputs `east` and `south`.
        Field = "field",
    }
}

params! {
    /// Source of the displacement.
    pattern: Pattern = Pattern::Fbm, One, ..;
    /// Maximum displacement; noise displaces by about a fifth of it. Wired displacements are clamped to it.
    displacement: f64 = 1000.0, Metres, 0.0..=1e6, soft 0..=5000;
    /// Wavelength of the noise's largest features.
    wavelength: f64 = 4000.0, Metres, 1.0..=1e6, soft 200..=30000, when pattern = "fbm" | "curl";
    /// Octaves of the noise, each with half the wavelength of the one before.
    octaves: i64 = 3, Count, 1..=16, when pattern = "fbm" | "curl";
    /// Ratio of the displacement by an octave to that by the one before; above ½ fine octaves fold the terrain.
    gain: f64 = 0.4, One, 0.0..=1.0, soft 0.2..=0.6, when pattern = "fbm" | "curl";
    /// Makes the noise fit together at opposite sides of the world, for tileable terrain.
    tileable: bool = false, One, .., when pattern = "fbm" | "curl";
    /// Random seed of the displacement.
    seed: Seed = Seed(0), Count, .., when pattern = "fbm" | "curl";
}

inputs! {
    /// Field to warp.
    value: AnyScalar;
    /// Factor on the displacement.
    mask: Mask = 1.0, 0.0..=1.0;
    /// Distance to the east at which a cell's value is sampled; for `field`.
    east: Option<Scalar(Metres)>;
    /// Distance to the south at which a cell's value is sampled; for `field`.
    south: Option<Scalar(Metres)>;
}

outputs! {
    /// Warped values, with the meaning of the input.
    value: SameAs(value);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Warp",
    category: "filter",
    summary: "Warps terrain by noise, by swirls or by wired displacements.",
    doc: include_str!("warp.md"),
    sources: &[
        "R. Bridson, J. Houriham, M. Nordenstam, 2007, Curl-noise for procedural fluid flow",
        "E. Catmull, R. Rom, 1974, A class of local interpolating splines",
        "I. Quilez, 2002, Domain warping",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    // the 4 x 4 stencil around the sampled position
    reach: Reach::Metres(|params, cell_m| Params::read(params).displacement + 3.0 * cell_m),
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    gpu: Some(&GPU),
    example: "value: \"base\", displacement: 5000, wavelength: 8000, octaves: 2",
    ..Node::DEFAULT
};

/// Salts of the seeds of the eastward displacement, the southward displacement, and the noise whose curl is taken.
const SALTS: [u32; 3] = [0x2c1b_3c6d, 0x297a_2d39, 0x61c8_8647];

static DISPLACE: Shader = Shader {
    name: "filter/warp_displace",
    source: wgsl!("filter/warp_displace"),
    library: &[wgsl::HASH, wgsl::LATTICE],
    values: &[("k_count", Number::U32), ("k_per_cell", Number::F32)],
    slots: &[
        Slot::words("octaves_of", "Octave"),
        Slot::input("mask"),
        Slot::input("east"),
        Slot::input("south"),
        Slot::cells("to_east", "f32").written(),
        Slot::cells("to_south", "f32").written(),
    ],
};

static TAKE: Shader = Shader {
    name: "filter/warp",
    source: wgsl!("filter/warp"),
    library: &[wgsl::MATH, wgsl::LINES],
    values: &[("k_wraps_x", Number::U32), ("k_wraps_y", Number::U32)],
    slots: &[
        Slot::input("value"),
        Slot::cells("to_east", "f32"),
        Slot::cells("to_south", "f32"),
        Slot::words("folds", "atomic<u32>").updated(),
        Slot::output("value"),
    ],
};

/// The largest displacement in metres that keeps to the tolerance. Both kernels round it to single precision, by about 1e-7
/// of it: a centimetre, which on a slope of 45° is 1e-5 of a relief of a kilometre.
const FAR_M: f64 = 1e5;

static GPU: GpuKernel = GpuKernel {
    shaders: &[&DISPLACE, &TAKE],
    passes: Passes::Recorded(record),
    // without a displacement the CPU passes the input on
    covers: |params| (f64::MIN_POSITIVE..=FAR_M).contains(&Params::read(params).displacement),
    // the rounding of a displacement of thousands of cells moves the place on a steep slope
    tolerance: &[Tolerance::relative(1e-5)],
    ..GpuKernel::DEFAULT
};

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let inputs = Inputs::read(job)?;
    let params = Params::read(job.params);
    if params.pattern == Pattern::Field {
        inputs.check_wired()?;
    }
    // all noises have the same number of octaves
    let noises = params.noises(job);
    let scale = |octave: &Octave| sum::scale(octave, params.amplitude()) * Basis::Bell.scale();
    let octaves_of = recorder.table(&table::table(&noises.concat(), Basis::Bell, scale))?;
    let count = noises.first().map_or(0, Vec::len);
    let [east, south] = [recorder.scratch(Size::Cells)?, recorder.scratch(Size::Cells)?].map(Bind::Scratch);
    recorder.pass(&Pass {
        shader: &DISPLACE,
        entry: "main",
        bind: &[("octaves_of", Bind::Scratch(octaves_of)), ("to_east", east), ("to_south", south)],
        values: &[("k_count", Scalar::U32(count as u32)), ("k_per_cell", Scalar::F32((1.0 / job.cell_m()) as f32))],
        over: Over::Cells(Rows::Around(0)),
    })?;
    job.advance(0.6)?;
    let folds = recorder.scratch(Size::Words(1))?;
    recorder.clear(folds)?;
    let window = job.window();
    let wraps = [0, 1].map(|axis| Ends::of(&window, axis) == Ends::Wrap);
    // the 4 x 4 stencil around the sampled position, which may be at the other end of a column
    let reach = (params.displacement / job.cell_m()).ceil() + 3.0;
    recorder.pass(&Pass {
        shader: &TAKE,
        entry: "main",
        bind: &[("to_east", east), ("to_south", south), ("folds", Bind::Scratch(folds))],
        values: &[("k_wraps_x", Scalar::U32(u32::from(wraps[0]))), ("k_wraps_y", Scalar::U32(u32::from(wraps[1])))],
        over: Over::Cells(if wraps[1] { Rows::All } else { Rows::Around(reach as u32) }),
    })?;
    let folded = recorder.read(folds, 1)?.first().copied().unwrap_or(0);
    warn_of_folds(job, folded as usize);
    Ok(())
}

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    // displacements to the east and south
    if Params::read(sizing.params).displacement == 0.0 { 0 } else { sizing.cells(8.0) }
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let inputs = Inputs::read(job)?;
    let Inputs { value, mask, .. } = inputs;
    let params = Params::read(job.params);
    if params.displacement == 0.0 {
        return Ok(Given { value: Some(value.clone()) }.into());
    }
    let [mut east, mut south] = params.displacements(job, &inputs)?;
    let (limit, per_cell) = (params.displacement as f32, (1.0 / job.cell_m()) as f32);
    let window = job.window();
    let nx = window.nx();
    // from metres to cells, clamped to the maximum
    par::each(east.chunks_mut(nx).zip(south.chunks_mut(nx)), |j, (east, south)| {
        shorten(east, south, mask.slice(j * nx..(j + 1) * nx), limit, per_cell);
        job.check()
    })?;
    warn_of_folds(job, folded(window.cells, &east, &south));
    let ends = [Ends::of(&window, 0), Ends::of(&window, 1)];
    let source = Source { samples: value.samples(), cells: [nx, window.ny()], ends };
    let mut out = zeroed(window.len())?;
    par::rows_within(job, [0.3, 1.0], &mut out, |j, row| {
        take_row(&source, j, [&east[j * nx..][..nx], &south[j * nx..][..nx]], row);
    })?;
    Ok(Given { value: Some(Field::new(window, out)) }.into())
}

impl Params {
    /// Returns the displacements to the east and to the south in metres.
    fn displacements(&self, job: &Job<'_>, inputs: &Inputs<'_>) -> Result<[Vec<f32>; 2], NodeError> {
        let amplitude = self.amplitude();
        match (self.pattern, self.noises(job).as_slice()) {
            (Pattern::Curl, [octaves]) => {
                let [along, mut down] = sum::slopes(job, octaves, Basis::Bell, amplitude)?;
                down.iter_mut().for_each(|down| *down = -*down);
                Ok([down, along])
            }
            (Pattern::Fbm, [across, down]) => {
                let one = |octaves: &[Octave]| sum::lattices(job, octaves, Basis::Bell, amplitude);
                Ok([one(across)?, one(down)?])
            }
            _ => {
                inputs.check_wired()?;
                let samples = |field: Option<&Field>| {
                    field.map_or_else(|| zeroed(job.window().len()), |field| copied(field.samples()))
                };
                Ok([samples(inputs.east)?, samples(inputs.south)?])
            }
        }
    }

    /// Returns the octaves of the noises: those of the displacements along x and y, that whose curl is taken, or none.
    fn noises(&self, job: &Job<'_>) -> Vec<Vec<Octave>> {
        let salts: &[u32] = match self.pattern {
            Pattern::Fbm => &SALTS[..2],
            Pattern::Curl => &SALTS[2..],
            Pattern::Field => &[],
        };
        salts.iter().map(|salt| self.fractal(job.seed() ^ salt).octaves(job.world())).collect()
    }

    /// Returns the amplitude of the noises: each axis is limited to √½ of the maximum, so that their vector sum does not
    /// exceed it.
    fn amplitude(&self) -> f64 {
        let part_m = self.displacement * std::f64::consts::FRAC_1_SQRT_2;
        if self.pattern == Pattern::Curl { part_m / sum::SLOPE } else { part_m }
    }

    fn fractal(&self, seed: u32) -> Fractal {
        Fractal {
            wavelength_m: self.wavelength,
            octaves: self.octaves,
            lacunarity: 2.0,
            gain: self.gain,
            tileable: self.tileable,
            seed: mix(seed),
        }
    }
}

impl Inputs<'_> {
    /// Checks that there is a displacement.
    fn check_wired(&self) -> Result<(), NodeError> {
        if self.east.is_some() || self.south.is_some() {
            return Ok(());
        }
        Err(NodeError::failed_with_hint(
            "there is no displacement",
            "wire metres to `east` or `south`, or choose another `pattern`",
        ))
    }
}

/// Returns the number of cells where the terrain folds over itself: where the Jacobian determinant of x + d(x) is not
/// above 0. Displacements are in cells.
fn folded([nx, ny]: [u32; 2], east: &[f32], south: &[f32]) -> usize {
    let (nx, ny) = (nx as usize, ny as usize);
    if nx < 3 || ny < 3 {
        return 0;
    }
    let folds = |at: usize| {
        let slope = |field: &[f32], step: usize| 0.5 * (field[at + step] - field[at - step]);
        let stretch = (1.0 + slope(east, 1)) * (1.0 + slope(south, nx));
        stretch - slope(east, nx) * slope(south, 1) <= 0.0
    };
    let folded_of = |_, j: usize| (1..nx - 1).filter(|i| folds(j * nx + i)).count();
    par::collect_all(1..ny - 1, folded_of).into_iter().sum()
}

/// Warns if that many cells are more than a few of those inside the window.
fn warn_of_folds(job: &Job<'_>, folded: usize) {
    let [nx, ny] = job.window().cells.map(|cells| (cells.max(3) - 2) as usize);
    let share = folded as f64 / (nx * ny) as f64;
    if share > 0.001 {
        job.warn(format!(
            "the terrain folds over itself in {:.1} % of the cells; a smaller `displacement` or `gain`, or a \
             longer `wavelength`, avoids it",
            100.0 * share
        ));
    }
}

/// Source of the values.
struct Source<'a> {
    samples: &'a [f32],
    cells: [usize; 2],
    ends: [Ends; 2],
}

simd! {
    /// Clamps displacements to the maximum, and converts metres to cells.
    fn shorten(east: &mut [f32], south: &mut [f32], mask: Lane<'_>, limit: f32, per_cell: f32) {
        let shorten = |(east, south): (&mut f32, &mut f32), mask: f32| {
            let length = (*east * *east + *south * *south).sqrt();
            let factor = mask * (limit / if length > limit { length } else { limit }) * per_cell;
            (*east, *south) = (*east * factor, *south * factor);
        };
        let places = east.iter_mut().zip(south);
        match mask {
            Lane::Constant(mask) => places.for_each(|place| shorten(place, mask)),
            Lane::Samples(masks) => places.zip(masks).for_each(|(place, &mask)| shorten(place, mask)),
        }
    }
}

simd! {
    /// Computes the values of a row from displacements in cells.
    fn take_row(source: &Source<'_>, row: usize, displacements: [&[f32]; 2], out: &mut [f32]) {
        let [east, south] = displacements;
        for ((i, out), (&east, &south)) in out.iter_mut().enumerate().zip(east.iter().zip(south)) {
            *out = source.at([i, row], [east, south]);
        }
    }
}

impl Source<'_> {
    /// Returns the value at a displacement in cells from a cell: Catmull-Rom interpolation along x and then along y,
    /// each clamped to the two nearest values.
    #[inline(always)]
    fn at(&self, cell: [usize; 2], displacement: [f32; 2]) -> f32 {
        // only the displacement is split into cells and fraction, so that a window has the same bits as the world
        let whole = displacement.map(f32::floor);
        let [across, down] = [0, 1].map(|axis| lane::catmull_rom(displacement[axis] - whole[axis]));
        let first = [0, 1].map(|axis| cell[axis] as i64 + whole[axis] as i64 - 1);
        let [nx, ny] = self.cells;
        let [i, j] = first.map(|first| usize::try_from(first).unwrap_or(usize::MAX));
        let mut along = [0.0; 4];
        if i < nx.saturating_sub(3) && j < ny.saturating_sub(3) {
            for (k, along) in along.iter_mut().enumerate() {
                let row = &self.samples[(j + k) * nx + i..][..4];
                *along = between([row[0], row[1], row[2], row[3]], across);
            }
        } else {
            for (along, row) in along.iter_mut().zip(self.beyond(first)) {
                *along = between(row, across);
            }
        }
        between(along, down)
    }

    /// Returns the 4 x 4 stencil at a cell where it crosses the sides of the window.
    #[cold]
    fn beyond(&self, first: [i64; 2]) -> [[f32; 4]; 4] {
        let [columns, rows] = [0, 1].map(|axis| {
            let place = |k| self.ends[axis].index(first[axis] + k, self.cells[axis]);
            [0, 1, 2, 3].map(place)
        });
        rows.map(|row| columns.map(|column| self.samples[row * self.cells[0] + column]))
    }
}

/// Returns the weighted sum of four values, clamped to the two in the middle.
#[inline(always)]
fn between(values: [f32; 4], weights: [f32; 4]) -> f32 {
    let sum = (values[0] * weights[0] + values[1] * weights[1]) + (values[2] * weights[2] + values[3] * weights[3]);
    // unlike `min` and `clamp`, which handle NaN, one instruction each
    let (low, high) = if values[1] < values[2] { (values[1], values[2]) } else { (values[2], values[1]) };
    let sum = if sum < low { low } else { sum };
    if sum < high { sum } else { high }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Cancel, Edge, World};

    use super::*;
    use crate::testing::{field, moments, outputs_and_warnings, run as result, with_params, world};

    /// Returns the displacements in metres to the east and south, measured on two planes, which the interpolation
    /// reproduces exactly.
    fn displacements(world: World, changes: &str) -> [Vec<f32>; 2] {
        let params = with_params(&NODE, changes);
        let x = result(&NODE, &params, &[("value", &field(world, |x, _| x))], "value");
        let y = result(&NODE, &params, &[("value", &field(world, |_, y| y))], "value");
        let window = Window::whole(world);
        let centre = |at: usize| window.centre_m(at % window.nx(), at / window.nx());
        let less = |out: &Field, axis: usize| -> Vec<f32> {
            out.samples().iter().enumerate().map(|(at, v)| v - centre(at)[axis] as f32).collect()
        };
        [less(&x, 0), less(&y, 1)]
    }

    /// Returns the cells whose values are sampled inside the world.
    fn inner(samples: &[f32], side: usize, margin: usize) -> Vec<f32> {
        let rows = samples.chunks_exact(side).skip(margin).take(side - 2 * margin);
        rows.flat_map(|row| row[margin..side - margin].to_vec()).collect()
    }

    #[test]
    fn no_displacement_is_the_land_itself() {
        let land = field(world(40, 30, 10.0), |x, y| 100.0 * libm::sin(0.01 * x + 0.02 * y));
        let none = with_params(&NODE, "displacement=0");
        assert_eq!(result(&NODE, &none, &[("value", &land)], "value"), land);
        let masked = field(world(40, 30, 10.0), |_, _| 0.0);
        let all = with_params(&NODE, "");
        assert_eq!(result(&NODE, &all, &[("value", &land), ("mask", &masked)], "value"), land);
    }

    /// Displacements by whole cells are exact; beyond the sides the terrain is mirrored, or wraps around in a periodic
    /// world.
    #[test]
    fn a_wired_displacement_moves_the_land() {
        for edge in [Edge::Base, Edge::Periodic] {
            let world = World { boundary: Boundary::all(edge), ..world(40, 30, 10.0) };
            let land = field(world, |x, y| 100.0 * libm::sin(0.01 * x * x + 0.02 * y));
            let [east, south] = [field(world, |_, _| 30.0), field(world, |_, _| -20.0)];
            let params = with_params(&NODE, "pattern=field,displacement=200");
            let moved = result(&NODE, &params, &[("value", &land), ("east", &east), ("south", &south)], "value");
            for (i, j) in (0..40).flat_map(|i| (0..30).map(move |j| (i, j))) {
                let from = match edge {
                    Edge::Periodic => (j + 28) % 30 * 40 + (i + 3) % 40,
                    _ => {
                        let (i, j) = (if i < 37 { i + 3 } else { 79 - i - 3 }, if j > 1 { j - 2 } else { 1 - j });
                        j * 40 + i
                    }
                };
                assert_eq!(moved.samples()[j * 40 + i], land.samples()[from], "{edge:?} {i} {j}");
            }
            // 36 m of displacement, (30, -20), are clamped to 18 m: (15, -10)
            let params = with_params(&NODE, "pattern=field,displacement=18.027756");
            let plane = field(world, |x, _| x);
            let cut = result(&NODE, &params, &[("value", &plane), ("east", &east), ("south", &south)], "value");
            assert!((cut.samples()[10 * 40 + 10] - (105.0 + 15.0)).abs() < 1e-3);
        }
        let lone = with_params(&NODE, "pattern=field");
        let land = field(world(8, 8, 10.0), |x, _| x);
        let error = crate::testing::outputs(&NODE, &lone, &[("value", &land)]);
        assert!(matches!(error, Err(NodeError::Failed { hint: Some(_), .. })));
    }

    /// Noise displaces by up to the declared maximum, a fifth of it on average. Curl noise is free of divergence to 1 %
    /// of the gradients, from differences over two cells.
    #[test]
    fn noise_displaces_as_far_as_declared_and_its_curl_without_divergence() {
        let changes = "displacement=400,wavelength=1000,octaves=1";
        for pattern in ["fbm", "curl"] {
            let changes = format!("pattern={pattern},{changes}");
            let [east, south] = displacements(world(700, 700, 25.0), &changes).map(|part| inner(&part, 700, 40));
            for part in [&east, &south] {
                let (mean, std) = moments(part);
                // about 15 hills along a side
                let expected = 400.0 * std::f64::consts::FRAC_1_SQRT_2 * 0.2055;
                assert!(
                    mean.abs() < 0.25 * std && (std / expected - 1.0).abs() < 0.1,
                    "{pattern} {mean} {std} {expected}"
                );
            }
            let n = 620;
            let (mut divergence, mut gradient) = (0.0, 0.0);
            for (i, j) in (1..n - 1).flat_map(|i| (1..n - 1).map(move |j| (i, j))) {
                let at = j * n + i;
                let x = f64::from(east[at + 1] - east[at - 1]);
                let y = f64::from(south[at + n] - south[at - n]);
                divergence += (x + y) * (x + y);
                gradient += x * x + y * y;
            }
            let share = (divergence / gradient).sqrt();
            assert!(if pattern == "curl" { share < 0.01 } else { share > 0.8 }, "{pattern}: {share}");
        }
    }

    #[test]
    fn a_mask_stays_between_0_and_1_and_folds_are_told() {
        let world = world(120, 90, 20.0);
        let mask =
            field(world, |x, y| if crate::numerics::math::hypot(x - 1000.0, y - 900.0) < 500.0 { 1.0 } else { 0.0 });
        let params = with_params(&NODE, "displacement=2000,wavelength=700,gain=0.9");
        let (out, warnings) =
            outputs_and_warnings(&Cancel::default(), Window::whole(world), &NODE, &params, &[("value", &mask)]);
        let out = out.expect("a result").take("value").expect("an output");
        let out = out.as_field().expect("a field");
        assert!(out.samples().iter().all(|v| (0.0..=1.0).contains(v)));
        assert!(warnings.len() == 1 && warnings[0].contains("folds over itself"), "{warnings:?}");
        let params = with_params(&NODE, "displacement=300,wavelength=2000,octaves=1");
        let (_, warnings) =
            outputs_and_warnings(&Cancel::default(), Window::whole(world), &NODE, &params, &[("value", &mask)]);
        assert!(warnings.is_empty(), "{warnings:?}");
    }
}
