//! Distance to the edge of a selection or of lines, and a mask that falls off with it; see
//! [`crate::numerics::distance`] and [`crate::numerics::polylines`].

use crate::{
    numerics::{
        distance::{self, FAR},
        joins,
        lines::Ends,
        par, polylines,
    },
    prelude::*,
    wgsl,
};
use orograph_graph::{InputValue, gpu::Size};

choice! {
    /// Side of the edge on which distances are measured.
    pub enum Side {
        /// From the selection outwards; 0 inside.
        Outside = "outside",
        /// From the edge inwards; 0 outside.
        Inside = "inside",
        /// Positive outwards, negative inwards.
        Both = "both",
    }
}

params! {
    /// Side of the edge on which distances are measured.
    side: Side = Side::Outside, One, ..;
    /// Mask value from which a cell counts as selected.
    threshold: f64 = 0.5, One, 0.0..=1.0;
    /// Maximum distance; larger ones are clamped to it.
    limit: f64 = 1000.0, Metres, 1e-3..=1e7, soft 10..=10_000;
}

inputs! {
    /// Selection mask.
    selection: Option<Mask>;
    /// Lines with widths, such as those of `Path` and `Rivers`; together with a selection, the nearest of both counts.
    lines: Option<Lines>;
}

outputs! {
    /// Distance to the edge of the selection or of the lines.
    distance: Scalar(Metres);
    /// 1 near the selection, 0 from `limit` onwards.
    mask: Mask;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Distance",
    category: "select",
    summary: "Distance to a selection or to lines, and a mask that falls off with it.",
    doc: include_str!("distance.md"),
    sources: &[
        "A. Meijster, J. B. T. M. Roerdink and W. H. Hesselink (2000), A general algorithm for computing distance transforms in \
         linear time, Mathematical Morphology and its Applications to Image and Signal Processing, 331-340",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|params, cell_m| Params::read(params).limit + cell_m),
    scratch: Scratch::Bytes(scratch),
    refuses: Some(refuses),
    cpu: run,
    gpu: Some(&GPU),
    resolution: Resolution::Cells("the edge of the selection runs along the edges of cells"),
    example: "selection: \"mask\", limit: 2000, side: both",
    ..Node::DEFAULT
};

static SHADER: Shader = Shader {
    name: "select/distance",
    source: wgsl!("select/distance"),
    library: &[wgsl::MATH, wgsl::LINES],
    values: &[
        ("k_threshold", Number::F32),
        ("k_side", Number::U32),
        ("k_step", Number::U32),
        ("k_limit", Number::U32),
        ("k_widest", Number::U32),
        joins::NUMBERS[0],
        joins::NUMBERS[1],
    ],
    slots: &[
        Slot::input("selection"),
        Slot::cells("column", "u32").updated(),
        Slot::cells("next", "u32").written(),
        Slot::cells("squared", "u32").updated(),
        Slot::cells("other", "u32"),
        Slot::output("distance"),
        Slot::output("mask"),
    ],
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&SHADER],
    passes: Passes::Recorded(record),
    // squares of distances are equal; their roots are rounded
    tolerance: &[Tolerance::relative(1e-6), Tolerance::absolute(1e-5)],
    ..GpuKernel::DEFAULT
};

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    // lines, which are no raster, are left to the CPU
    if !job.inputs.iter().any(InputValue::is_wired) {
        return Err(nothing());
    }
    let (params, window) = (Params::read(job.params), job.window());
    let limit = distance::cells(params.limit, job.cell_m()).saturating_add(1).min(distance::MOST_CELLS);
    let [across, down] = joins::numbers(&window);
    // the least number that single precision has from the threshold on
    let nearest = params.threshold as f32;
    let threshold = if f64::from(nearest) < params.threshold { nearest.next_up() } else { nearest };
    let widest = if Ends::of(&window, 0) == Ends::Wrap { window.cells[0] / 2 + 1 } else { window.cells[0] };
    let [mut column, mut next] = [recorder.scratch(Size::Cells)?, recorder.scratch(Size::Cells)?];
    let mut bind = Vec::new();
    let numbers = |side: bool, step: u32| {
        [
            ("k_threshold", Scalar::F32(threshold)),
            ("k_side", Scalar::U32(u32::from(side))),
            ("k_step", Scalar::U32(step)),
            ("k_limit", Scalar::U32(limit)),
            ("k_widest", Scalar::U32(widest)),
            across,
            down,
        ]
    };
    let sides = match params.side {
        Side::Outside => &[(true, "squared")][..],
        Side::Inside => &[(false, "other")],
        Side::Both => &[(true, "squared"), (false, "other")],
    };
    for &(side, name) in sides {
        let mut pass = |entry, bind: &[(&'static str, Bind)], step: u32, rows| {
            let values = &numbers(side, step);
            recorder.pass(&Pass { shader: &SHADER, entry, bind, values, over: Over::Cells(rows) })
        };
        pass("begin", &[("column", Bind::Scratch(column))], 1, Rows::Around(0))?;
        let mut step = 1;
        while step <= limit.min(window.cells[1]) {
            let rows = joins::rows(&window, step);
            pass("step_on", &[("column", Bind::Scratch(column)), ("next", Bind::Scratch(next))], step, rows)?;
            std::mem::swap(&mut column, &mut next);
            step *= 2;
        }
        let squared = recorder.scratch(Size::Cells)?;
        let found = [("column", Bind::Scratch(column)), ("squared", Bind::Scratch(squared))];
        let values = &numbers(side, 1);
        let over = Over::Cells(Rows::Around(0));
        recorder.pass(&Pass { shader: &SHADER, entry: "across", bind: &found, values, over })?;
        bind.push((name, Bind::Scratch(squared)));
        job.advance(0.5)?;
    }
    let values = &numbers(true, 1);
    recorder.pass(&Pass { shader: &SHADER, entry: "main", bind: &bind, values, over: Over::Cells(Rows::Around(0)) })
}

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let sides = if Params::read(sizing.params).side == Side::Both { 2.0 } else { 1.0 };
    // squared distances on either side, and the result
    let given = 4.0 * Wants::among(sizing.wanted).count() as f64;
    sizing.cells((4.0 + 4.0 * sides - given).max(0.0))
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let mut distance = match Inputs::read(job)? {
        Inputs { selection: Some(selection), lines } => {
            let mut distance = of_selection(job, &params, selection.samples())?;
            if let Some(lines) = lines {
                polylines::approach(job, lines, &mut distance)?;
                clamp(&mut distance, &params);
            }
            distance
        }
        Inputs { lines: Some(lines), .. } => {
            let mut distance = vec![params.limit as f32; job.window().len()];
            polylines::approach(job, lines, &mut distance)?;
            clamp(&mut distance, &params);
            distance
        }
        Inputs { .. } => return Err(nothing()),
    };
    let wants = Wants::of(job);
    let chosen = |_, row: &mut [f32]| {
        row.iter_mut().for_each(|distance| *distance = mask(f64::from(*distance), params.side, params.limit));
    };
    let field = |samples| Field::new(job.window(), samples);
    Ok(Given {
        mask: wants
            .mask
            .then(|| par::rows_from(job, [0.9, 1.0], &mut distance, wants.distance, chosen))
            .transpose()?
            .map(field),
        distance: wants.distance.then(|| field(distance)),
    }
    .into())
}

/// Refuses a node without any input.
fn refuses(stated: &Stated<'_>) -> Result<(), NodeError> {
    if [stated.feed("selection"), stated.feed("lines")] == [Feed::Nothing; 2] {
        return Err(nothing());
    }
    Ok(())
}

fn nothing() -> NodeError {
    let hint = "wire a mask into `selection`, or lines into `lines`";
    NodeError::failed_with_hint("there is nothing to measure distances from", hint)
}

/// Limits distances to the side and the limit.
fn clamp(distance: &mut [f32], params: &Params) {
    let limit = params.limit as f32;
    let [least, most] = match params.side {
        Side::Outside => [0.0, limit],
        Side::Inside => [-limit, 0.0],
        Side::Both => [-limit, limit],
    };
    par::change(distance, |distance| *distance = distance.clamp(least, most));
}

/// Returns the distances to the edge of a selection.
fn of_selection(job: &Job<'_>, params: &Params, selection: &[f32]) -> Result<Vec<f32>, NodeError> {
    let selected = |at: usize| f64::from(selection[at]) >= params.threshold;
    let limit_cells = distance::cells(params.limit, job.cell_m()).saturating_add(1);
    let measure = |share, side: bool| -> Result<Option<Vec<u32>>, NodeError> {
        distance::squared(job, share, limit_cells, |at| selected(at) == side).map(Some)
    };
    let outwards = if params.side == Side::Inside { None } else { measure([0.0, 0.5], true)? };
    let inwards = if params.side == Side::Outside { None } else { measure([0.5, 0.9], false)? };

    // subtracts the half cell between the centre of the nearest cell of the other side and the edge
    let metres = |squared: u32| match squared {
        0 => 0.0,
        FAR => params.limit,
        squared => ((f64::from(squared).sqrt() - 0.5) * job.cell_m()).min(params.limit),
    };
    let of = |side: &Option<Vec<u32>>, at: usize| side.as_ref().map_or(0.0, |squared| metres(squared[at]));
    Ok(par::map(selection.len(), |at| (of(&outwards, at) - of(&inwards, at)) as f32))
}

/// Returns the mask value at a distance.
fn mask(distance_m: f64, side: Side, limit_m: f64) -> f32 {
    let share = match side {
        Side::Outside => 1.0 - distance_m / limit_m,
        Side::Inside => 1.0 + distance_m / limit_m,
        Side::Both => 0.5 - 0.5 * distance_m / limit_m,
    };
    crate::numerics::math::smoothstep(share) as f32
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Line, Lines, Vertex};

    use super::*;
    use crate::testing::{field, outputs_on, run as result, run_in, run_with, with_params, world};

    fn disc(cells: u32, cell_m: f64) -> Field {
        field(world(cells, cells, cell_m), |x, y| if libm::hypot(x - 500.0, y - 500.0) < 200.0 { 1.0 } else { 0.0 })
    }

    /// Distances from a disc are those from the circle, to the resolution of its edge cells.
    #[test]
    fn distances_from_a_disc_are_those_from_its_circle() {
        for (cells, cell_m) in [(100, 10.0), (400, 2.5)] {
            let distance = result(
                &NODE,
                &with_params(&NODE, "side=both, limit=600"),
                &[("selection", &disc(cells, cell_m))],
                "distance",
            );
            for (at, &found) in distance.samples().iter().enumerate() {
                let [x, y] = distance.window().centre_m(at % cells as usize, at / cells as usize);
                let expected = libm::hypot(x - 500.0, y - 500.0) - 200.0;
                assert!((f64::from(found) - expected).abs() < 0.8 * cell_m, "{x} {y}: {found} {expected}");
            }
        }
    }

    #[test]
    fn sides_and_limits_hold() {
        let disc = disc(100, 10.0);
        for side in ["outside", "inside", "both"] {
            let params = with_params(&NODE, &format!("side={side}, limit=150"));
            let distance = result(&NODE, &params, &[("selection", &disc)], "distance");
            let (low, high) = distance.range(0).expect("finite");
            let expected = match side {
                "outside" => (0.0, 150.0),
                "inside" => (-150.0, 0.0),
                _ => (-150.0, 150.0),
            };
            assert_eq!((low, high), expected, "{side}");
            let mask = result(&NODE, &params, &[("selection", &disc)], "mask");
            assert_eq!(mask.range(0), Some((0.0, 1.0)), "{side}");
        }
        for (value, expected) in [(0.0, 150.0), (1.0, 0.0)] {
            let all = field(world(20, 20, 10.0), |_, _| value);
            let distance = result(&NODE, &with_params(&NODE, "limit=150"), &[("selection", &all)], "distance");
            assert!(distance.samples().iter().all(|found| *found == expected), "{value}");
        }
        let none = with_params(&NODE, "limit=0.001");
        assert!(
            result(&NODE, &none, &[("selection", &disc)], "mask")
                .samples()
                .iter()
                .zip(disc.samples())
                .all(|(a, b)| a == b)
        );
    }

    #[test]
    fn windows_and_threads_give_the_same_bits() {
        let disc = disc(200, 5.0);
        let params = with_params(&NODE, "side=both, limit=90");
        let whole = result(&NODE, &params, &[("selection", &disc)], "distance");
        let part = Window { origin: [30, 60], cells: [70, 50], ..*disc.window() };
        let grown = disc.crop(&part.grown(95.0));
        assert_eq!(result(&NODE, &params, &[("selection", &grown)], "distance").crop(&part), whole.crop(&part));
        assert_eq!(
            run_in(1, &NODE, &params, &[("selection", &disc)]),
            run_in(3, &NODE, &params, &[("selection", &disc)])
        );
    }

    /// Distances from a bent line with a varying width equal those of a search over all of its segments; a selection
    /// beside it counts where it is nearer; windows give the same bits.
    #[test]
    fn distances_from_lines_are_exact() {
        let at = |x: f64, y: f64, width_m: f64| Vertex { position_m: [x, y], width_m, ..Vertex::default() };
        let vertices: Vec<Vertex> = (0..300)
            .map(|k| {
                let turn = 0.11 * f64::from(k);
                at(
                    500.0 + 1.6 * f64::from(k) * libm::cos(turn),
                    480.0 + 1.5 * f64::from(k) * libm::sin(turn),
                    8.0 + 0.1 * f64::from(k),
                )
            })
            .collect();
        let lines = Lines::open(vec![Line { order: 1, downstream: None, vertices: vertices.clone() }]);
        let reference = |[x, y]: [f64; 2]| {
            let piece = |pair: &[Vertex]| {
                let ([ax, ay], [bx, by]) = (pair[0].position_m, pair[1].position_m);
                let (dx, dy) = (bx - ax, by - ay);
                let t = (((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
                let half = 0.5 * (pair[0].width_m + (pair[1].width_m - pair[0].width_m) * t);
                libm::hypot(x - ax - t * dx, y - ay - t * dy) - half
            };
            vertices.windows(2).map(piece).fold(f64::INFINITY, f64::min)
        };
        let world = world(100, 100, 10.0);
        let measured = |window: Window, side: &str, selection: Option<&Field>| {
            let params = with_params(&NODE, &format!("side={side}, limit=150"));
            let value = |name: &str| match name {
                "lines" => Some(lines.clone().into()),
                _ => selection.map(|field| orograph_graph::Value::Field(field.clone())),
            };
            let wanted = orograph_graph::Wanted::ALL;
            let (outputs, _) = run_with(wanted, &orograph_graph::Cancel::default(), window, &NODE, &params, &value);
            outputs.expect("a result").take("distance").expect("an output").as_field().expect("a field").clone()
        };
        let whole = Window::whole(world);
        for (side, low, high) in [("both", -150.0, 150.0), ("outside", 0.0, 150.0), ("inside", -150.0, 0.0)] {
            let found = measured(whole, side, None);
            for (at, found) in found.samples().iter().enumerate() {
                let expected = reference(whole.centre_m(at % 100, at / 100)).clamp(low, high);
                assert!((f64::from(*found) - expected).abs() < 1e-4, "{side} {at}: {found} {expected}");
            }
        }
        let part = Window { origin: [17, 30], cells: [55, 41], ..whole };
        assert_eq!(measured(part, "both", None), measured(whole, "both", None).crop(&part));
        let disc = disc(100, 10.0);
        let [both, alone] = [Some(&disc), None].map(|selection| measured(whole, "both", selection));
        let selection = result(&NODE, &with_params(&NODE, "side=both, limit=150"), &[("selection", &disc)], "distance");
        for ((both, alone), selection) in both.samples().iter().zip(alone.samples()).zip(selection.samples()) {
            assert_eq!(*both, alone.min(*selection));
        }
        let nothing = outputs_on(whole, &NODE, &with_params(&NODE, ""), &[]);
        assert!(matches!(nothing, Err(NodeError::Failed { hint: Some(_), .. })));
    }
}
