//! Connected components of a selection: areas, numbers, and a mask of those that are large enough.

use orograph_graph::Edge;

use crate::numerics::par;
use crate::{numerics::components::components, prelude::*};

choice! {
    /// Which cells count as connected.
    pub enum Connection {
        /// Cells that share an edge or a corner.
        Corners = "corners",
        /// Cells that share an edge.
        Edges = "edges",
    }
}

params! {
    /// Mask value from which a cell counts as selected.
    threshold: f64 = 0.5, One, 1e-6..=1.0;
    /// Which cells count as connected.
    connection: Connection = Connection::Corners, One, ..;
    /// Minimum area of a component.
    least_area: f64 = 100_000.0, SquareMetres, 0.0..=1e15, soft 0..=1e7;
    /// Maximum area of a component.
    most_area: f64 = 1e15, SquareMetres, 0.0..=1e15, soft 0..=1e7;
    /// Keeps only the largest component; the first from the north-west if two are equal.
    largest: bool = false, One, ..;
    /// Holes smaller than this are filled first: connected unselected regions that do not reach the world's side.
    least_hole: f64 = 0.0, SquareMetres, 0.0..=1e15, soft 0..=1e7;
}

inputs! {
    /// Selection mask.
    selection: Mask;
}

outputs! {
    /// The selection where its component is kept.
    mask: Mask;
    /// Number of the kept component, 0 outside.
    number: Scalar(Count);
    /// Area of the kept component, 0 outside.
    area: Scalar(SquareMetres);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Components",
    category: "select",
    summary: "Connected components of a selection, numbered and measured, without those that are too small.",
    doc: include_str!("components.md"),
    sources: &[
        "A. Rosenfeld and J. L. Pfaltz (1966), Sequential operations in digital picture processing, Journal of the ACM 13, 471-494",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    scratch: Scratch::Bytes(scratch),
    refuses: Some(refuses),
    cpu: run,
    resolution: Resolution::Cells("regions that connect across one cell may not connect across smaller ones"),
    example: "selection: \"mask\", least_area: 3e6",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    // the component of each cell, and the cells of filled holes
    sizing.cells(4.0 + if Params::read(sizing.params).least_hole > 0.0 { 1.0 } else { 0.0 })
}

/// Refuses a range that falls.
fn refuses(stated: &Stated<'_>) -> Result<(), NodeError> {
    let params = Params::read(stated.params);
    if params.least_area > params.most_area {
        return Err(NodeError::failed_with_hint(
            format!("`least_area` is {} m², above `most_area`, {} m²", params.least_area, params.most_area),
            "exchange the two",
        ));
    }
    Ok(())
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    refuses(&Stated::of_job(job))?;
    let selection = Inputs::read(job)?.selection.samples();
    let cell_m2 = job.cell_m() * job.cell_m();
    let corners = params.connection == Connection::Corners;
    let selected = |at: usize| f64::from(selection[at]) >= params.threshold;
    let filled =
        if params.least_hole > 0.0 { holes(job, !corners, params.least_hole / cell_m2, selected)? } else { Vec::new() };
    job.advance(0.4)?;
    let filled = |at: usize| filled.get(at).is_some_and(|filled| *filled);
    let found = components(job, corners, |at| selected(at) || filled(at))?;
    job.advance(0.8)?;

    let area_m2 = |cells: u32| f64::from(cells) * cell_m2;
    let fits = |cells: u32| (params.least_area..=params.most_area).contains(&area_m2(cells));
    let most = found.cells.iter().copied().filter(|cells| fits(*cells)).max();
    let mut kept = 0_u32;
    let numbers: Vec<u32> = found
        .cells
        .iter()
        .map(|cells| {
            let keep = if params.largest { kept == 0 && Some(*cells) == most } else { fits(*cells) };
            kept += u32::from(keep);
            if keep { kept } else { 0 }
        })
        .collect();
    let number_of = |at: usize| match found.of[at] {
        0 => 0,
        component => numbers[component as usize - 1],
    };
    let field = |value: &(dyn Fn(usize) -> f32 + Sync)| Field::new(job.window(), par::map(selection.len(), value));
    let mask = |at| match number_of(at) {
        0 => 0.0,
        _ if filled(at) => 1.0,
        _ => selection[at],
    };
    let area = |at| if number_of(at) > 0 { area_m2(found.cells[found.of[at] as usize - 1]) as f32 } else { 0.0 };
    let wants = Wants::of(job);
    Ok(Given {
        mask: wants.mask.then(|| field(&mask)),
        number: wants.number.then(|| field(&|at| number_of(at) as f32)),
        area: wants.area.then(|| field(&area)),
    }
    .into())
}

/// Returns the cells in holes of fewer cells than a limit.
fn holes(
    job: &Job<'_>,
    corners: bool,
    least_cells: f64,
    selected: impl Fn(usize) -> bool,
) -> Result<Vec<bool>, NodeError> {
    let found = components(job, corners, |at| !selected(at))?;
    let (nx, ny) = (job.window().nx(), job.window().ny());
    let mut small: Vec<bool> = found.cells.iter().map(|cells| f64::from(*cells) < least_cells).collect();
    let boundary = job.world().boundary;
    let joined = |a: Edge, b: Edge| a == Edge::Periodic || b == Edge::Periodic;
    let mut open = |at: usize| {
        if found.of[at] > 0 {
            small[found.of[at] as usize - 1] = false;
        }
    };
    if !joined(boundary.west, boundary.east) {
        (0..ny).for_each(|j| [j * nx, (j + 1) * nx - 1].into_iter().for_each(&mut open));
    }
    if !joined(boundary.north, boundary.south) {
        (0..nx).for_each(|i| [i, (ny - 1) * nx + i].into_iter().for_each(&mut open));
    }
    Ok(par::map_of(&found.of, |component| *component > 0 && small[*component as usize - 1]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{field, outputs, run as result, run_in, with_params, world};

    /// Squares of 100, 300 and 500 m, the last with a hole of 100 m, and a ring that is open to the north side.
    fn squares() -> Field {
        field(world(200, 100, 10.0), |x, y| {
            let square = |cx: f64, cy: f64, side: f64| 2.0 * (x - cx).abs().max((y - cy).abs()) < side;
            let ring = square(1700.0, 100.0, 400.0) && !square(1700.0, 50.0, 200.0);
            let solid = square(100.0, 500.0, 100.0) || square(500.0, 500.0, 300.0);
            if solid || ring || (square(1100.0, 500.0, 500.0) && !square(1100.0, 500.0, 100.0)) { 0.75 } else { 0.25 }
        })
    }

    fn at(field: &Field, x_m: usize, y_m: usize) -> f32 {
        field.samples()[y_m / 10 * 200 + x_m / 10]
    }

    #[test]
    fn parts_are_kept_by_area() {
        let found =
            |changes: &str, output| result(&NODE, &with_params(&NODE, changes), &[("selection", &squares())], output);
        let area = found("least_area=0", "area");
        let ring = 400.0 * 300.0 - 200.0 * 150.0; // 100 m of both lie outside the world
        for (x, y, expected) in [(100, 500, 1e4), (500, 500, 9e4), (900, 500, 24e4), (1550, 100, ring), (300, 500, 0.0)]
        {
            assert_eq!(f64::from(at(&area, x, y)), expected, "{x} {y}");
        }
        // in the order of first cells: the ring, the large square, the middle one
        let number = found("least_area=50000", "number");
        assert_eq!(
            [1550, 900, 500, 100].map(|x| at(&number, x, if x == 1550 { 100 } else { 500 })),
            [1.0, 2.0, 3.0, 0.0]
        );
        let mask = found("least_area=50000,most_area=100000", "mask");
        assert_eq!(
            [1550, 900, 500, 100].map(|x| at(&mask, x, if x == 1550 { 100 } else { 500 })),
            [0.75, 0.0, 0.75, 0.0]
        );
        let largest = found("least_area=0,largest=true", "mask");
        assert_eq!(largest.samples().iter().map(|v| f64::from(*v)).sum::<f64>(), 0.75 * 2400.0);
    }

    #[test]
    fn holes_are_filled_but_bays_are_not() {
        let fill = |changes: &str| result(&NODE, &with_params(&NODE, changes), &[("selection", &squares())], "mask");
        assert_eq!(at(&fill("least_area=0,least_hole=10000"), 1100, 500), 0.0); // 10 000 m² is not below
        let filled = fill("least_area=0,least_hole=10001");
        assert_eq!((at(&filled, 1100, 500), at(&filled, 900, 500)), (1.0, 0.75));
        assert_eq!(at(&fill("least_area=0,least_hole=1e9"), 1700, 50), 0.0);
        assert_eq!(at(&fill("least_area=0,least_hole=1e9"), 300, 900), 0.0);
    }

    #[test]
    fn corners_count_where_asked() {
        let stairs = field(world(30, 30, 1.0), |x, y| if x.floor() == y.floor() { 1.0 } else { 0.0 });
        let count = |changes: &str| {
            result(&NODE, &with_params(&NODE, changes), &[("selection", &stairs)], "number")
                .range(0)
                .map(|(_, most)| most)
        };
        assert_eq!(count("least_area=0,connection=corners"), Some(1.0));
        assert_eq!(count("least_area=0,connection=edges"), Some(30.0));
    }

    #[test]
    fn empty_and_full_selections_and_wrong_ranges() {
        for (value, expected) in [(0.0, 0.0), (1.0, 1.0)] {
            let all = field(world(7, 5, 1000.0), |_, _| value);
            let params = with_params(&NODE, "least_hole=1e12");
            let mut found = outputs(&NODE, &params, &[("selection", &all)]).expect("a result");
            for (name, factor) in [("mask", 1.0), ("number", 1.0), ("area", 35e6)] {
                let found = found.take(name).expect("declared");
                let found = found.as_field().expect("a field");
                assert!(found.samples().iter().all(|v| *v == expected * factor), "{name} {value}");
            }
            assert!(outputs(&NODE, &with_params(&NODE, "least_area=5,most_area=4"), &[("selection", &all)]).is_err());
            assert_eq!(
                run_in(1, &NODE, &params, &[("selection", &all)]),
                run_in(3, &NODE, &params, &[("selection", &all)])
            );
        }
    }
}
