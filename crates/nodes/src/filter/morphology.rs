//! Dilation, erosion, opening and closing of masks and heights by a disc with a radius in metres.

use super::mix;
use crate::numerics::{
    extremes::{disc, highest, lowest},
    joins, par,
};
use crate::{prelude::*, wgsl};
use orograph_graph::gpu::{ScratchId, Size};

choice! {
    /// Operation with the disc.
    pub enum Operation {
        /// The highest value within the disc: masks grow.
        Dilate = "dilate",
        /// The lowest value within the disc: masks shrink.
        Erode = "erode",
        /// Eroded, then dilated: features narrower than the disc disappear, the rest keeps its size.
        Open = "open",
        /// Dilated, then eroded: gaps narrower than the disc close, the rest keeps its size.
        Close = "close",
        /// Dilated minus eroded: a band along edges; for heights, the relief within the disc.
        Outline = "outline",
        /// The value minus the opened one: features narrower than the disc, such as crests and spires.
        TopHat = "top_hat",
        /// The closed value minus the value: gaps and ravines narrower than the disc.
        BottomHat = "bottom_hat",
    }
}

params! {
    /// Operation with the disc.
    operation: Operation = Operation::Open, One, ..;
    /// Radius of the disc. A radius that does not reach the next cell changes nothing.
    radius: f64 = 100.0, Metres, 0.0..=1e5, soft 0..=1000;
}

inputs! {
    /// A mask, a height or any other field.
    value: AnyScalar;
    /// Where the result replaces the input: fully at 1, not at all at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// The result, with the meaning of the input.
    value: SameAs(value);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Morphology",
    category: "filter",
    summary: "Dilates, erodes, opens and closes masks or heights by a disc with a radius in metres.",
    doc: include_str!("morphology.md"),
    sources: &[
        "J. Serra (1982), Image Analysis and Mathematical Morphology, Academic Press",
        "S. R. Sternberg (1986), Grayscale morphology, Computer Vision, Graphics, and Image Processing 35, 333-355",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|params, _| {
        let params = Params::read(params);
        let passes = match params.operation {
            Operation::Dilate | Operation::Erode | Operation::Outline => 1.0,
            _ => 2.0,
        };
        passes * params.radius
    }),
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    gpu: Some(&GPU),
    resolution: Resolution::Cells("the disc consists of whole cells"),
    example: "value: \"mask\", operation: outline, radius: 500",
    ..Node::DEFAULT
};

static SHADER: Shader = Shader {
    name: "filter/morphology",
    source: wgsl!("filter/morphology"),
    library: &[wgsl::MATH, wgsl::LINES],
    values: &[
        ("k_sign", Number::F32),
        ("k_span", Number::I32),
        ("k_rows", Number::I32),
        ("k_from", Number::U32),
        ("k_to", Number::U32),
        joins::NUMBERS[0],
        joins::NUMBERS[1],
    ],
    slots: &[
        Slot::input("value"),
        Slot::input("mask"),
        Slot::cells("before", "f32"),
        Slot::cells("line", "f32").updated(),
        Slot::cells("best", "f32").updated(),
        Slot::cells("next", "f32").written(),
        Slot::words("halves", "i32"),
        Slot::output("value"),
    ],
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&SHADER],
    passes: Passes::Recorded(record),
    // the mask blends
    tolerance: &[Tolerance::ROUNDING],
    ..GpuKernel::DEFAULT
};

/// Columns and rows of cells of a workgroup that looks at the lines of a disc.
const TILE: [u32; 2] = [64, 4];

/// Records searches for the highest value in a disc.
struct Search<'r> {
    recorder: &'r mut dyn Recorder,
    /// Cells on either side of the middle in each row of the disc, from the middle outward.
    halves: Vec<u32>,
    table: ScratchId,
    lines: [ScratchId; 2],
    rows: i32,
    most: i32,
    window: Window,
}

impl<'r> Search<'r> {
    fn new(job: &Job<'_>, recorder: &'r mut dyn Recorder) -> Result<Self, NodeError> {
        let window = job.window();
        let disc = disc(Params::read(job.params).radius / job.cell_m(), window.nx(), window.ny());
        let half = |&(_, half): &(i64, usize)| u32::try_from(half).unwrap_or(u32::MAX);
        let halves: Vec<u32> = disc.iter().filter(|(row, _)| *row >= 0).map(half).collect();
        let rows = i32::try_from(halves.len() - 1).unwrap_or(i32::MAX);
        let most = i32::try_from(halves[0]).unwrap_or(i32::MAX);
        let table = recorder.table(&halves)?;
        let lines = [recorder.scratch(Size::Cells)?, recorder.scratch(Size::Cells)?];
        Ok(Self { recorder, halves, table, lines, rows, most, window })
    }

    fn pass(
        &mut self,
        entry: &'static str,
        bind: &[(&'static str, Bind)],
        (sign, span): (f32, i32),
        around: i32,
    ) -> Result<(), NodeError> {
        let (rows, [across, down]) = (joins::rows(&self.window, around.unsigned_abs()), joins::numbers(&self.window));
        // rows of the disc whose lines two of the length `span` cover
        let is_covered = |half: &u32| (span..2 * span).contains(&(2 * *half as i32 + 1));
        let [from, to] = [self.halves.iter().position(is_covered), self.halves.iter().rposition(is_covered)];
        self.recorder.pass(&Pass {
            shader: &SHADER,
            entry,
            bind,
            values: &[
                ("k_sign", Scalar::F32(sign)),
                ("k_span", Scalar::I32(span)),
                ("k_rows", Scalar::I32(self.rows)),
                ("k_from", Scalar::U32(from.unwrap_or(1) as u32)),
                ("k_to", Scalar::U32(to.unwrap_or(0) as u32)),
                across,
                down,
            ],
            over: if entry == "raise" { Over::Tiles(TILE, rows) } else { Over::Cells(rows) },
        })
    }

    /// Returns the highest of the values times `sign`.
    fn highest(&mut self, job: &Job<'_>, before: Bind, sign: f32) -> Result<ScratchId, NodeError> {
        let best = self.recorder.scratch(Size::Cells)?;
        let [mut line, mut next] = self.lines.map(Bind::Scratch);
        let (best_of, halves) = (Bind::Scratch(best), Bind::Scratch(self.table));
        self.pass("begin", &[("before", before), ("line", line), ("best", best_of)], (sign, 1), 0)?;
        let mut span = 1;
        loop {
            let rows = self.rows;
            self.pass("raise", &[("line", line), ("best", best_of), ("halves", halves)], (sign, span), rows)?;
            job.advance(0.5)?;
            if 2 * span > 2 * self.most + 1 {
                return Ok(best);
            }
            self.pass("double", &[("line", line), ("next", next)], (sign, span), 0)?;
            std::mem::swap(&mut line, &mut next);
            span *= 2;
        }
    }
}

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let mut search = Search::new(job, recorder)?;
    let value = Bind::Input("value", 0);
    // the sign of each search: the lowest value is the highest of those turned, and stays turned
    let (first, second) = match Params::read(job.params).operation {
        Operation::Dilate => (1.0, None),
        Operation::Erode => (-1.0, None),
        Operation::Open | Operation::TopHat => (-1.0, Some(-1.0)),
        Operation::Close | Operation::BottomHat => (1.0, Some(-1.0)),
        Operation::Outline => (1.0, Some(-1.0)),
    };
    let found = search.highest(job, value, first)?;
    let is_outline = Params::read(job.params).operation == Operation::Outline;
    let (found, other, sign) = match second {
        None => (found, None, first),
        Some(sign) if is_outline => (found, Some(search.highest(job, value, sign)?), first),
        Some(sign) => (search.highest(job, Bind::Scratch(found), sign)?, None, first * sign),
    };
    let mut bind = vec![("before", Bind::Scratch(found))];
    bind.extend(other.map(|other| ("best", Bind::Scratch(other))));
    search.pass("main", &bind, (sign, 1), 0)
}

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let params = Params::read(sizing.params);
    let nx = sizing.window.nx() as f64;
    // lines with their halo
    let lines = 4.0 * (1.0 + 2.0 * (params.radius / sizing.window.cell_m()).min(nx) / nx);
    let held = match params.operation {
        Operation::Dilate => 0.0,
        Operation::Erode | Operation::Open => 4.0,
        Operation::Close | Operation::Outline | Operation::TopHat | Operation::BottomHat => 8.0,
    };
    sizing.cells(held + lines)
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { value, mask } = Inputs::read(job)?;
    let params = Params::read(job.params);
    let samples = value.samples();
    let radius = params.radius / job.cell_m();
    let dilated = |samples: &[f32], share| highest(job, share, samples, radius);
    let eroded = |samples: &[f32], share| lowest(job, share, samples, radius);
    let (early, late) = ([0.0, 0.45], [0.45, 0.9]);
    let less = |mut from: Vec<f32>, taken: &[f32]| {
        par::change_with(&mut from, taken, |from, taken| *from -= taken);
        from
    };
    let mut out = match params.operation {
        Operation::Dilate => dilated(samples, [0.0, 0.9])?,
        Operation::Erode => eroded(samples, [0.0, 0.9])?,
        Operation::Open => dilated(&eroded(samples, early)?, late)?,
        Operation::Close => eroded(&dilated(samples, early)?, late)?,
        Operation::Outline => less(dilated(samples, early)?, &eroded(samples, late)?),
        Operation::TopHat => less(samples.to_vec(), &dilated(&eroded(samples, early)?, late)?),
        Operation::BottomHat => less(eroded(&dilated(samples, early)?, late)?, samples),
    };
    mix(job, samples, &mut out, mask)?;
    Ok(Given { value: Some(Field::new(job.window(), out)) }.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{at_every_level, field, run as result, run_in, with_params, world};

    fn disc_of(radius_m: f64) -> Field {
        field(world(120, 120, 10.0), |x, y| if libm::hypot(x - 605.0, y - 605.0) <= radius_m { 1.0 } else { 0.0 })
    }

    fn done(value: &Field, changes: &str) -> Field {
        result(&NODE, &with_params(&NODE, changes), &[("value", value)], "value")
    }

    fn area(mask: &Field) -> f64 {
        mask.samples().iter().map(|v| f64::from(*v) * 100.0).sum()
    }

    /// The area of a disc changes as its radius grows or shrinks.
    #[test]
    fn a_disc_becomes_a_wider_or_a_narrower_disc() {
        for (operation, radius_m) in [("dilate", 350.0), ("erode", 50.0), ("open", 200.0), ("close", 200.0)] {
            let found = area(&done(&disc_of(200.0), &format!("operation={operation},radius=150")));
            let expected = std::f64::consts::PI * radius_m * radius_m;
            // the area of a rasterised disc is that of the circle to within a cell along its edge
            assert!(
                (found - expected).abs() < 2.0 * std::f64::consts::PI * radius_m * 7.0,
                "{operation}: {found} {expected}"
            );
        }
        let outline = area(&done(&disc_of(200.0), "operation=outline,radius=50"));
        let expected = std::f64::consts::PI * (250.0 * 250.0 - 150.0 * 150.0);
        assert!((outline / expected - 1.0).abs() < 0.04, "{outline} {expected}");
    }

    #[test]
    fn opening_takes_what_is_narrow_and_keeps_the_rest() {
        // a square of 400 m with a spur of 30 m
        let land = field(world(120, 120, 10.0), |x, y| {
            let square = (x - 400.0).abs() < 200.0 && (y - 600.0).abs() < 200.0;
            if square || ((600.0..900.0).contains(&x) && (y - 600.0).abs() < 15.0) { 80.0 } else { 0.0 }
        });
        let opened = done(&land, "operation=open,radius=50");
        let at = |field: &Field, x: usize, y: usize| field.samples()[y * 120 + x];
        assert_eq!((at(&opened, 40, 60), at(&opened, 75, 60), at(&opened, 22, 60)), (80.0, 0.0, 80.0));
        let hat = done(&land, "operation=top_hat,radius=50");
        for cell in 0..land.samples().len() {
            assert_eq!(hat.samples()[cell] + opened.samples()[cell], land.samples()[cell]);
        }
        // opening is idempotent, and closing is opening of the negative
        assert_eq!(done(&opened, "operation=open,radius=50"), opened);
        let negative =
            field(world(120, 120, 10.0), |x, y| -f64::from(at(&land, (x / 10.0) as usize, (y / 10.0) as usize)));
        let closed = done(&negative, "operation=close,radius=50");
        assert!(closed.samples().iter().zip(opened.samples()).all(|(a, b)| *a == -*b));
    }

    #[test]
    fn no_radius_and_no_mask_change_nothing() {
        let land = field(world(60, 50, 10.0), |x, y| x * 0.7 + 31.0 * libm::sin(y / 40.0));
        for operation in ["dilate", "erode", "open", "close"] {
            assert_eq!(done(&land, &format!("operation={operation},radius=9.9")), land, "{operation}");
        }
        let none = Field::constant(*land.window(), 0.0);
        let params = with_params(&NODE, "operation=dilate");
        assert_eq!(result(&NODE, &params, &[("value", &land), ("mask", &none)], "value"), land);
    }

    #[test]
    fn windows_threads_and_simd_levels_give_the_same_bits() {
        let land = field(world(150, 90, 10.0), |x, y| 200.0 * libm::sin(x / 110.0) * libm::cos(y / 70.0));
        let params = with_params(&NODE, "operation=bottom_hat,radius=85");
        let inputs = [("value", &land)];
        assert_eq!(run_in(1, &NODE, &params, &inputs), run_in(3, &NODE, &params, &inputs));
        at_every_level(|| run_in(2, &NODE, &params, &inputs));
        let part = Window { origin: [40, 30], cells: [50, 30], ..*land.window() };
        let grown = land.crop(&part.grown(170.0));
        let whole = result(&NODE, &params, &inputs, "value");
        assert_eq!(result(&NODE, &params, &[("value", &grown)], "value").crop(&part), whole.crop(&part));
    }
}
