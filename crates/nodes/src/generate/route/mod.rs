//! The way of a road or a path over terrain.

mod search;
#[cfg(test)]
mod tests;

use orograph_graph::{Line, Lines, Vertex, memory::filled};

use self::search::{Ground, Search};
use crate::{
    numerics::{along::averaged, cover},
    prelude::*,
    raster::{GridAxis, resample},
};

params! {
    /// Places that the way visits, from the start to the end.
    path: PathPoints = PathPoints(vec![[2000.0, 13000.0], [13500.0, 3000.0]]), Metres, -1e7..=1e7;
    /// Rise over run at which a metre costs as much as two on level ground.
    ///
    /// On steeper ground the way bends to and fro, at three quarters of this grade.
    grade: f64 = 0.1, One, 0.005..=2.0;
    /// Times that ground which is to be avoided costs more than other ground: `avoid` of 1, and the sea.
    detour: f64 = 20.0, One, 1.0..=1e4, soft 1..=100;
    /// Side of the cells on which the way is sought, whatever the cells of the world; at least an eighth of those.
    spacing: f64 = 20.0, Metres, 0.1..=1e5, soft 5..=200;
    /// Length over which bends are rounded; the longer, the fewer they are.
    ///
    /// Turning back costs as much as four times this length on level ground.
    rounding: f64 = 100.0, Metres, 0.0..=1e5, soft 0..=1000;
    /// Width of the way.
    width: f64 = 8.0, Metres, 0.0..=1e5, soft 0..=50;
}

inputs! {
    /// Terrain height.
    height: Height;
    /// Ground that the way goes around: towns, woods, wet ground.
    avoid: Mask = 0.0, 0.0..=1.0;
}

outputs! {
    /// The way, without elevations of its own.
    lines: Lines;
    /// Fraction of each cell that the way covers with its width.
    mask: Mask;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Route",
    category: "generate",
    summary: "The least-cost way between places over terrain, with hairpins where it is steep: roads and paths.",
    doc: include_str!("page.md"),
    sources: &[
        "E. Galin, A. Peytavie, N. Maréchal and E. Guérin (2010), Procedural generation of roads, Computer Graphics Forum \
         29 (2), 429-438",
        "P. E. Hart, N. J. Nilsson and B. Raphael (1968), A formal basis for the heuristic determination of minimum cost \
         paths, IEEE Transactions on Systems Science and Cybernetics 4 (2), 100-107",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    reads_sea: true,
    scratch: Scratch::Bytes(|sizing| {
        let [columns, rows] = Params::read(sizing.params).cells(&sizing.window);
        let cells = sizing.window.len() as u64;
        // the search is over before the mask is drawn
        (BYTES * columns.saturating_mul(rows).min(MOST)).saturating_sub(4 * cells).max(cells / 2)
    }),
    cpu: run,
    resolution: Resolution::Cells("one of two ways of nearly the same cost is taken, and a way is as narrow as cells"),
    example: "height: \"base\", spacing: 64, grade: 0.2, width: 400",
    ..Node::DEFAULT
};

/// Bytes for a cell of the search: heights, factors, costs, strides and the queue.
const BYTES: u64 = 41;
/// Half of the cost of turning back, in lengths over which bends are rounded.
const TURN: f64 = 2.0;
/// Maximum number of cells of the search.
const MOST: u64 = 1 << 22;

/// Least side of the cells of the search, in cells of the world: there is no terrain in between.
const FINEST: f64 = 0.125;

impl Params {
    /// Side of the cells of the search.
    fn spacing_m(&self, window: &Window) -> f64 {
        self.spacing.max(FINEST * window.cell_m())
    }

    /// The cells of the search along both axes.
    fn cells(&self, window: &Window) -> [u64; 2] {
        window.world.size.map(|size| (size / self.spacing_m(window)).ceil().max(1.0) as u64)
    }
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let (Inputs { height, avoid }, wants) = (Inputs::read(job)?, Wants::of(job));
    let params = Params::read(job.params);
    let window = job.window();
    let [columns, rows] = params.cells(&window);
    let spacing_m = params.spacing_m(&window);
    if columns.saturating_mul(rows) > MOST {
        let least = spacing_m * (columns as f64 * rows as f64 / MOST as f64).sqrt();
        let remedy = format!("use a `spacing` of at least {}", Unit::Metres.display((least + 0.5).ceil()));
        let what = format!("{columns} x {rows} cells of the search are more than {MOST}");
        return Err(NodeError::failed_with_hint(what, remedy));
    }
    let cells = [columns, rows].map(|count| count as u32);
    let axes = [window.nx(), window.ny()]
        .map(|source| GridAxis { source, offset: 0.0, step: spacing_m / window.cell_m() }.snapped());
    let check = || job.check();
    let sampled = |samples: &[f32]| resample(samples, axes, [0, 0], cells, None, &check);
    let heights = sampled(height.samples())?;
    let mut factors = match avoid {
        Lane::Samples(avoid) => sampled(avoid)?,
        Lane::Constant(avoid) => filled(heights.len(), avoid)?,
    };
    let sea_m = job.world().sea_level.unwrap_or(f64::NEG_INFINITY);
    for (factor, height) in factors.iter_mut().zip(&heights) {
        let avoid = if f64::from(*height) < sea_m { 1.0 } else { factor.clamp(0.0, 1.0) };
        *factor = 1.0 + (params.detour as f32 - 1.0) * avoid;
    }
    job.advance(0.1)?;
    let (columns, rows) = (columns as usize, rows as usize);
    let ground = Ground {
        columns,
        rows,
        cell_m: spacing_m,
        heights: &heights,
        factors: &factors,
        grade: params.grade,
        turn: TURN * params.rounding,
    };
    let way = params.way(job, Search::new(ground)?, [columns, rows])?;
    let lines = Lines { draped: true, ..Lines::open(way.into_iter().collect()) };
    let mask = wants.mask.then(|| cover::draw(job, &lines)).transpose()?;
    Ok(Given { lines: wants.lines.then_some(lines), mask: mask.map(|mask| Field::new(window, mask)) }.into())
}

impl Params {
    /// The line through all places. Returns None if they are all the same.
    fn way(&self, job: &Job<'_>, mut search: Search<'_>, counts: [usize; 2]) -> Result<Option<Line>, NodeError> {
        let spacing_m = self.spacing_m(&job.window());
        let size = job.world().size;
        let inside = |at: [f64; 2]| [0, 1].map(|axis| at[axis].clamp(0.0, size[axis]));
        let mut places: Vec<[f64; 2]> = self.path.0.iter().map(|at| inside(*at)).collect();
        if places != self.path.0 {
            job.warn("places outside of the world are moved to its sides");
        }
        places.dedup();
        let cell = |at: [f64; 2]| {
            let [x, y] = [0, 1].map(|axis| ((at[axis] / spacing_m) as usize).min(counts[axis] - 1));
            y * counts[0] + x
        };
        let centre = |cell: usize| [cell % counts[0], cell / counts[0]].map(|at| (at as f64 + 0.5) * spacing_m);
        let mut points = Vec::new();
        for (leg, pair) in places.windows(2).enumerate() {
            let found = search.way([cell(pair[0]), cell(pair[1])], &|| job.check())?;
            // the ends are the places themselves
            let between = found.iter().skip(1).take(found.len().saturating_sub(2)).map(|cell| centre(*cell));
            let leg_points: Vec<[f64; 2]> = [pair[0]].into_iter().chain(between).chain([pair[1]]).collect();
            points.extend(self.rounded(&leg_points, spacing_m).into_iter().skip(usize::from(leg > 0)));
            job.advance(0.1 + 0.8 * (leg + 1) as f32 / (places.len() - 1) as f32)?;
        }
        let vertex = |at: [f64; 2]| Vertex { position_m: inside(at), width_m: self.width, ..Vertex::default() };
        let vertices: Vec<Vertex> = points.into_iter().map(vertex).collect();
        Ok((vertices.len() > 1).then_some(Line { order: 1, downstream: None, vertices }))
    }

    /// Points half a cell apart along a way whose bends are rounded. Its ends stay.
    fn rounded(&self, points: &[[f64; 2]], spacing_m: f64) -> Vec<[f64; 2]> {
        let length = |pair: &[[f64; 2]]| {
            let [x, y] = [0, 1].map(|axis| pair[1][axis] - pair[0][axis]);
            (x * x + y * y).sqrt()
        };
        let whole: f64 = points.windows(2).map(length).sum();
        let count = (2.0 * whole / spacing_m).ceil().max(1.0) as usize;
        let mut even = Vec::with_capacity(count + 1);
        let (mut pieces, mut before) = (points.windows(2).peekable(), 0.0);
        for k in 0..=count {
            let way = whole * k as f64 / count as f64;
            while let Some(pair) = pieces.peek().copied() {
                let long = length(pair);
                if way <= before + long || k == count {
                    let share = if long > 0.0 { ((way - before) / long).clamp(0.0, 1.0) } else { 0.0 };
                    even.push([0, 1].map(|axis| pair[0][axis] + (pair[1][axis] - pair[0][axis]) * share));
                    break;
                }
                before += long;
                pieces.next();
            }
        }
        if let (Some(last), Some(end)) = (even.last_mut(), points.last()) {
            *last = *end;
        }
        // two box filters in sequence form a triangular kernel of that length
        let side = (0.25 * self.rounding * count as f64 / whole.max(1e-9)).round() as usize;
        let smooth = |axis: usize| {
            let values: Vec<f64> = even.iter().map(|point| point[axis]).collect();
            averaged(&averaged(&values, side), side)
        };
        smooth(0).into_iter().zip(smooth(1)).map(|(x, y)| [x, y]).collect()
    }
}
