//! Drainage basins: all of them, or the catchment of a place.

#[cfg(test)]
mod tests;

use orograph_graph::{Axis, Lines, Series, memory::zeroed};

use crate::{
    numerics::{
        drained::Drained,
        math, outlines, par,
        routing::{Drainage, Grid, code::has_receiver},
    },
    prelude::*,
};

choice! {
    /// Which basins.
    pub enum Choose {
        /// Every basin that is at least `smallest`, from where its water leaves the world or ends.
        All = "all",
        /// The catchment of a place: all ground whose water passes it.
        Place = "place",
    }
}

params! {
    /// Which basins.
    choose: Choose = Choose::All, One, ..;
    /// Smallest area of a basin; smaller ones belong to none.
    smallest: f64 = 1e6, SquareMetres, 0.0..=1e15, soft 0.0..=1e8, when choose = "all";
    /// The place whose catchment is wanted.
    at: Position = Position([8192.0, 8192.0]), Metres, -1e7..=1e7, when choose = "place";
    /// Moves the place to the largest river within this distance; 0 keeps its cell.
    snap: f64 = 500.0, Metres, 0.0..=1e6, soft 0.0..=5000.0, when choose = "place";
}

inputs! {
    /// Where water runs, from `Flow`.
    flow: Flow;
}

outputs! {
    /// Number of the basin, from 1 for the largest; 0 outside.
    basin: Scalar(Count);
    /// 1 in basins, 0 outside.
    mask: Mask;
    /// 1 in cells beside another basin or ground that belongs to none, 0 elsewhere.
    divide: Mask;
    /// The divides as closed lines around each basin, whose `order` is the number of the basin.
    outlines: Lines;
    /// Number and areas of the basins, and where the catchment of a place ends.
    report: Report;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Basins",
    category: "hydrology",
    summary: "Drainage basins: all of them by size, or the catchment of a place, with their divides.",
    doc: include_str!("page.md"),
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    resolution: Resolution::Cells("cells near divides may drain to the other side"),
    example: "flow: \"flow.flow\", smallest: 4000000",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let wants = Wants::among(sizing.wanted);
    let rasters = [wants.basin, wants.mask, wants.divide].into_iter().filter(|is| *is).count() as f64;
    // receivers and numbers; before the results the order of cells, and beside them the walks of outlines
    let (held, ordered) = (1.0 + 4.0, 7.0);
    let traced = if wants.outlines { 4.1 } else { 0.1 };
    sizing.cells(held + (ordered - 4.0 * rasters).max(traced))
}

/// A basin: the cell in which it ends, and its number of cells.
#[derive(Clone, Copy)]
struct Basin {
    end: u32,
    cells: u32,
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let (params, wants) = (Params::read(job.params), Wants::of(job));
    let grid = Grid::new(&job.window())?;
    let drained = Drained::read(Inputs::read(job)?.flow);
    let codes = drained.codes(&grid);
    let mut drainage = Drainage::default();
    let mut cells = vec![1_u32; grid.cells()];
    drainage.accumulate(job, &grid, &codes, &mut cells)?;
    job.advance(0.5)?;

    let basins: Vec<Basin> = match params.choose {
        Choose::All => largest_first(&codes, &cells, params.smallest / (job.cell_m() * job.cell_m())),
        Choose::Place => {
            let end = placed(job, &grid, &drained, &params)?;
            end.map(|end| Basin { end: end as u32, cells: cells[end] }).into_iter().collect()
        }
    };
    drop(cells);
    let mut numbers: Vec<u32> = zeroed(grid.cells())?;
    basins.iter().zip(1..).for_each(|(basin, number)| numbers[basin.end as usize] = number);
    let link = |_, _, own: u32, below: u32| if own > 0 { own } else { below };
    drainage.upstream(job, &grid, &codes, &mut numbers, link)?;
    drop(drainage);
    job.advance(0.8)?;

    let differs = |cell: usize| {
        let beside = |way| grid.beside(cell as u32, codes[cell], way);
        [0, 2, 4, 6].into_iter().filter_map(beside).any(|beside| numbers[beside as usize] != numbers[cell])
    };
    let cells = |value: &(dyn Fn(usize) -> f32 + Sync)| par::field(job, [0.8, 1.0], value);
    let share = |is: bool| if is { 1.0 } else { 0.0 };
    Ok(Given {
        basin: wants.basin.then(|| cells(&|cell| numbers[cell] as f32)).transpose()?,
        mask: wants.mask.then(|| cells(&|cell| share(numbers[cell] > 0))).transpose()?,
        divide: wants.divide.then(|| cells(&|cell| share(numbers[cell] > 0 && differs(cell)))).transpose()?,
        outlines: wants.outlines.then(|| divides(job, &grid, &drained, &numbers)).transpose()?,
        report: wants.report.then(|| report(job, &params, &basins, &numbers)),
    }
    .into())
}

/// Returns the basins that are not too small, the largest first; of equal ones that whose end comes first, row by row.
fn largest_first(codes: &[u8], cells: &[u32], fewest: f64) -> Vec<Basin> {
    let basin = |end: usize| Basin { end: end as u32, cells: cells[end] };
    let ends = (0..codes.len()).filter(|&cell| !has_receiver(codes[cell])).map(basin);
    let mut basins: Vec<Basin> = ends.filter(|basin| f64::from(basin.cells) >= fewest).collect();
    basins.sort_by_key(|basin| (std::cmp::Reverse(basin.cells), basin.end));
    basins
}

/// Returns the cell of the place, or that of the river beside it. Warns if the place is not in the world.
fn placed(job: &Job<'_>, grid: &Grid, drained: &Drained<'_>, params: &Params) -> Result<Option<usize>, NodeError> {
    let (window, Position([x, y])) = (job.window(), params.at);
    let Some([i, j]) = window.cell_at([x, y]) else {
        job.warn("the place is outside the world, so there is no basin".to_owned());
        return Ok(None);
    };
    let (mut end, mut area_m2) = (j * window.nx() + i, drained.area_m2[j * window.nx() + i]);
    // how far the place is from the centre of its cell; farther than the world is wide, there are no other cells
    let [cx, cy] = window.centre_m(i, j);
    let [dx, dy] = [cx - x, cy - y];
    let far = |count: usize| ((params.snap / job.cell_m()).ceil() as i32).saturating_add(1).min(count as i32);
    let (across, down) = (far(window.nx()), far(window.ny()));
    for south in -down..=down {
        job.check()?;
        for east in -across..=across {
            let ([column, row], is_inside) = grid.nearest([i as i32 + east, j as i32 + south]);
            let cell = row * window.nx() + column;
            let [x, y] = [dx + f64::from(east) * job.cell_m(), dy + f64::from(south) * job.cell_m()];
            let is_near = is_inside && x * x + y * y <= params.snap * params.snap;
            if is_near && drained.area_m2[cell] > area_m2 {
                (end, area_m2) = (cell, drained.area_m2[cell]);
            }
        }
    }
    Ok(Some(end))
}

/// Returns a closed line around each part of a basin, and around the ground inside that drains elsewhere. Its elevation
/// is that of the highest cell at each corner.
fn divides(job: &Job<'_>, grid: &Grid, drained: &Drained<'_>, numbers: &[u32]) -> Result<Lines, NodeError> {
    let (nx, ny) = (grid.nx as i64, grid.ny as i64);
    let elevation_m = |[x, y]: outlines::Corner| {
        let around = [[x - 1, y - 1], [x, y - 1], [x - 1, y], [x, y]];
        let inside = around.into_iter().filter(|[x, y]| (0..nx).contains(x) && (0..ny).contains(y));
        let levels = inside.map(|[x, y]| f64::from(drained.level_m[(y * nx + x) as usize]));
        levels.fold(f64::NEG_INFINITY, f64::max)
    };
    let parts = outlines::parts(job, grid.nx, numbers)?;
    let lines = parts
        .iter()
        .flat_map(|part| part.rings.iter().map(|ring| outlines::line(ring, job.cell_m(), part.region, elevation_m)));
    Ok(Lines::open(lines.collect()))
}

/// The number and the areas of the basins; of the catchment of a place, where it ends too.
fn report(job: &Job<'_>, params: &Params, basins: &[Basin], numbers: &[u32]) -> Report {
    let cell_m2 = job.cell_m() * job.cell_m();
    let mut cells = vec![0_u64; basins.len() + 1];
    numbers.iter().for_each(|&number| cells[number as usize] += 1);
    let areas: Vec<f64> = cells[1..].iter().map(|&cells| cells as f64 * cell_m2).collect();
    let inside: u64 = cells[1..].iter().sum();
    let mut report = Report::default();
    report.measure("basins", basins.len() as f64, "");
    report.measure("area", inside as f64 * cell_m2, "m²");
    report.measure("coverage", inside as f64 / numbers.len().max(1) as f64, "");
    report.measure("largest_area", areas.first().copied().unwrap_or(0.0), "m²");
    if let (Choose::Place, [basin]) = (params.choose, basins) {
        let (window, Position(at)) = (job.window(), params.at);
        let end = basin.end as usize;
        let outlet = window.centre_m(end % window.nx(), end / window.nx());
        report.measure("outlet_x", outlet[0], "m");
        report.measure("outlet_y", outlet[1], "m");
        report.measure("outlet_moved", math::hypot(outlet[0] - at[0], outlet[1] - at[1]), "m");
    } else if !areas.is_empty() {
        let numbers = Axis::new("basin", "", (1..=areas.len()).map(|number| number as f64).collect());
        report.series.push(Series::new("areas", numbers, Axis::logarithmic("area", "m²", areas)));
    }
    report
}
