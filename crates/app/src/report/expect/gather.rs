//! The heightfield that expectations are about: a part of an output, averaged to cells of a fixed size, gathered from
//! the rows that a build delivers.

use orograph_graph::{
    Boundary, Edge, Expectations, Field, Window, World,
    memory::{OutOfMemory, filled, zeroed},
};

/// A millionth of a cell is a rounding error, not another cell.
const ROUNDING: f64 = 1e-6;

/// Gathers a heightfield from its rows.
#[derive(Debug)]
pub struct Gather {
    /// The world whose cells are delivered.
    from: World,
    /// The world that is measured: as large as the part.
    to: World,
    corner_m: [f64; 2],
    rows: Rows,
}

#[derive(Debug)]
enum Rows {
    /// Cells as they are, of this window.
    Copied { window: Window, samples: Vec<f32> },
    /// All of that window, in one piece.
    Shared(Field),
    /// Sums of heights and of the fraction of each cell that has heights.
    Averaged { sums: Vec<f64>, filled: Vec<f64> },
}

impl Gather {
    /// For expectations and the world that is built. The part is widened to whole cells; cells that are to be averaged
    /// fill it from its north-west corner, as far as whole ones fit.
    ///
    /// # Errors
    /// [`OutOfMemory`].
    pub fn new(expected: &Expectations, from: World) -> Result<Self, OutOfMemory> {
        let whole = [0.0, 0.0, from.size[0], from.size[1]];
        let [x, y, width, height] = expected.part_m.unwrap_or(whole);
        let (corner_m, extent_m) = ([x, y], [width, height]);
        let cell_m = from.cell_m();
        let coarse = expected.cell_m.filter(|cell| *cell > cell_m * (1.0 + ROUNDING));
        let (mut corner, mut cells) = ([0; 2], [0; 2]);
        for axis in 0..2 {
            let (start, end) = (corner_m[axis], corner_m[axis] + extent_m[axis]);
            if let Some(coarse) = coarse {
                cells[axis] = ((extent_m[axis] / coarse + ROUNDING).floor() as u32).max(1);
            } else {
                // The world of a preview may be cut to whole cells, so that the part reaches beyond it.
                let last = from.cells[axis] - 1;
                corner[axis] = ((start / cell_m + ROUNDING).floor() as u32).min(last);
                let end = ((end / cell_m - ROUNDING).ceil() as u32).min(from.cells[axis]);
                cells[axis] = end.max(corner[axis] + 1) - corner[axis];
            }
        }
        let side_m = coarse.unwrap_or(cell_m);
        let size = cells.map(|count| f64::from(count) * side_m);
        let corner_m = if coarse.is_some() { corner_m } else { corner.map(|first| f64::from(first) * cell_m) };
        let to = World { size, cells, boundary: sides(&from, corner_m, extent_m), ..from };
        let count = cells[0] as usize * cells[1] as usize;
        let rows = if coarse.is_some() {
            Rows::Averaged { sums: zeroed(count)?, filled: zeroed(count)? }
        } else {
            Rows::Copied { window: Window { world: from, origin: corner, cells }, samples: Vec::new() }
        };
        Ok(Self { from, to, corner_m, rows })
    }

    /// The part that is measured: position of its north-west corner and its extent, in metres.
    #[must_use]
    pub const fn part_m(&self) -> ([f64; 2], [f64; 2]) {
        (self.corner_m, self.to.size)
    }

    /// Side of the cells that are measured, in metres.
    #[must_use]
    pub fn cell_m(&self) -> f64 {
        self.to.cell_m()
    }

    /// Returns true if it is the whole world.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        (0..2).all(|axis| self.to.size[axis] >= self.from.size[axis] * (1.0 - ROUNDING))
    }

    /// Takes rows of the heightfield.
    ///
    /// # Errors
    /// [`OutOfMemory`].
    pub fn add(&mut self, height: &Field) -> Result<(), OutOfMemory> {
        match &mut self.rows {
            Rows::Copied { window, samples } => {
                if height.window().contains(window) {
                    self.rows = Rows::Shared(height.try_crop(window)?);
                    return Ok(());
                }
                if samples.is_empty() {
                    *samples = filled(window.len(), f32::NAN)?;
                }
                copy(height, window, samples);
            }
            Rows::Shared(_) => {}
            Rows::Averaged { sums, filled } => average(height, self.corner_m, &self.to, sums, filled)?,
        }
        Ok(())
    }

    /// The heightfield, with voids where less than half of a cell has heights.
    #[must_use]
    pub fn finish(self) -> Field {
        let samples = match self.rows {
            Rows::Copied { samples, .. } => samples,
            Rows::Shared(field) => field.into_samples(),
            Rows::Averaged { sums, filled } => {
                let mean = |(sum, filled): (&f64, &f64)| if *filled >= 0.5 { (sum / filled) as f32 } else { f32::NAN };
                sums.iter().zip(&filled).map(mean).collect()
            }
        };
        Field::new(Window::whole(self.to), samples)
    }
}

/// The sides of a part: those of the world that it reaches, and open ones, which water leaves, inside of it.
fn sides(world: &World, corner_m: [f64; 2], extent_m: [f64; 2]) -> Boundary {
    let ends = |axis: usize, [low, high]: [Edge; 2]| {
        let slack = world.cell_m() * ROUNDING;
        let at_low = corner_m[axis] <= slack;
        let at_high = corner_m[axis] + extent_m[axis] >= world.size[axis] - slack;
        let side = |reached: bool, edge: Edge| match edge {
            Edge::Periodic if !(at_low && at_high) => Edge::Open,
            edge if reached => edge,
            _ => Edge::Open,
        };
        [side(at_low, low), side(at_high, high)]
    };
    let Boundary { west, east, north, south } = world.boundary;
    let ([west, east], [north, south]) = (ends(0, [west, east]), ends(1, [north, south]));
    Boundary { west, east, north, south }
}

/// Copies what a raster has of a window.
fn copy(height: &Field, window: &Window, samples: &mut [f32]) {
    let has = height.window();
    let end = |of: &Window, axis: usize| of.origin[axis] + of.cells[axis];
    let first = has.origin[1].max(window.origin[1]);
    for y in first..end(has, 1).min(end(window, 1)) {
        let from = (y - has.origin[1]) as usize * has.nx() + (window.origin[0] - has.origin[0]) as usize;
        let to = (y - window.origin[1]) as usize * window.nx();
        samples[to..to + window.nx()].copy_from_slice(&height.plane(0)[from..from + window.nx()]);
    }
}

/// Adds rows to the means of coarser cells, each height by the area that it shares with a cell.
fn average(
    height: &Field,
    corner_m: [f64; 2],
    to: &World,
    sums: &mut [f64],
    filled: &mut [f64],
) -> Result<(), OutOfMemory> {
    let window = height.window();
    let columns = to.cells[0] as usize;
    // The cells that a row or a column of the raster shares something with, at most two, with the fraction of their
    // side.
    let shares = |axis: usize, cell: usize| {
        let place = |cell: f64| (cell * window.cell_m() - corner_m[axis]) / to.cell_m();
        let first = f64::from(window.origin[axis]) + cell as f64;
        let (low, high) = (place(first).max(0.0), place(first + 1.0).min(f64::from(to.cells[axis])));
        let shared = move |at: usize| {
            let share = high.min(at as f64 + 1.0) - low.max(at as f64);
            (share > 0.0 && at < to.cells[axis] as usize).then_some((at, share))
        };
        let at = low as usize;
        [shared(at), shared(at + 1)].into_iter().flatten()
    };
    let (mut line, mut line_filled): (Vec<f64>, Vec<f64>) = (zeroed(columns)?, zeroed(columns)?);
    for (j, row) in height.plane(0).chunks(window.nx()).enumerate() {
        if shares(1, j).next().is_none() {
            continue;
        }
        line.fill(0.0);
        line_filled.fill(0.0);
        for (i, &z) in row.iter().enumerate().filter(|(_, z)| z.is_finite()) {
            for (at, share) in shares(0, i) {
                line[at] += share * f64::from(z);
                line_filled[at] += share;
            }
        }
        for (at, share) in shares(1, j) {
            let start = at * columns;
            sums[start..start + columns].iter_mut().zip(&line).for_each(|(sum, value)| *sum += share * value);
            let whole = filled[start..start + columns].iter_mut().zip(&line_filled);
            whole.for_each(|(sum, value)| *sum += share * value);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use orograph_graph::Unit;

    use super::*;

    fn expected(part_m: Option<[f64; 4]>, cell_m: Option<f64>) -> Expectations {
        Expectations { output: None, part_m, cell_m, list: Vec::new() }
    }

    fn gathered(expected: &Expectations, height: &Field, rows_each: usize) -> Field {
        let world = height.window().world;
        let mut gather = Gather::new(expected, world).expect("there is memory");
        for first in (0..world.cells[1]).step_by(rows_each) {
            let cells = [world.cells[0], (world.cells[1] - first).min(rows_each as u32)];
            gather.add(&height.crop(&Window { world, origin: [0, first], cells })).expect("there is memory");
        }
        gather.finish()
    }

    /// Heights of 10 i + 100 j.
    fn ramp(cells: [u32; 2]) -> Field {
        let world = World { size: cells.map(|count| f64::from(count) * 10.0), cells, ..World::default() };
        let samples = (0..cells[1]).flat_map(|j| (0..cells[0]).map(move |i| (10 * i + 100 * j) as f32));
        Field::new(Window::whole(world), samples.collect())
    }

    #[test]
    fn a_part_is_widened_to_whole_cells_whatever_the_rows() {
        let height = ramp([8, 6]);
        for rows in [1, 2, 6] {
            let part = gathered(&expected(Some([15.0, 20.0, 20.0, 15.0]), None), &height, rows);
            assert_eq!(part.samples(), [210.0, 220.0, 230.0, 310.0, 320.0, 330.0], "{rows}");
            assert_eq!((part.window().world.size, part.window().cell_m()), ([30.0, 20.0], 10.0));
            assert_eq!(gathered(&expected(None, None), &height, rows).samples(), height.samples());
        }
        // finer cells than those of the world
        assert_eq!(gathered(&expected(None, Some(3.0)), &height, 6).samples(), height.samples());
    }

    #[test]
    fn cells_are_means_by_area_and_do_not_depend_on_the_resolution() {
        let height = ramp([8, 6]);
        for rows in [1, 4, 6] {
            let half = gathered(&expected(None, Some(20.0)), &height, rows);
            assert_eq!(&half.samples()[..4], [55.0, 75.0, 95.0, 115.0], "{rows}");
            // two cells and a half in each: the third takes half of a column and half of a row
            let odd = gathered(&expected(Some([0.0, 0.0, 50.0, 50.0]), Some(25.0)), &height, rows);
            assert_eq!((odd.samples()[0], odd.window().cells), (8.0 + 80.0, [2, 2]), "{rows}");
        }
        let fine = World { cells: [16, 12], ..height.window().world };
        let doubled: Vec<f32> = (0..12)
            .flat_map(|j| (0..16).map(move |i| (i / 2, j / 2)))
            .map(|(i, j)| (10 * i + 100 * j) as f32)
            .collect();
        let fine = Field::new(Window::whole(fine), doubled);
        let both =
            [&height, &fine].map(|height| gathered(&expected(Some([5.0, 0.0, 60.0, 60.0]), Some(20.0)), height, 6));
        for (a, b) in both[0].samples().iter().zip(both[1].samples()) {
            assert!((a - b).abs() < 1e-3, "{a} {b}");
        }
        // a cell of which most is void is void
        let mut samples = height.samples().to_vec();
        [0, 1, 8].into_iter().for_each(|at| samples[at] = f32::NAN);
        samples[2] = f32::NAN;
        let holes = gathered(&expected(None, Some(20.0)), &Field::new(*height.window(), samples), 6);
        assert!(holes.samples()[0].is_nan() && (holes.samples()[1] - 280.0 / 3.0).abs() < 1e-3);
    }

    #[test]
    fn sides_inside_the_world_let_water_out() {
        let world = World { boundary: Boundary::all(Edge::Periodic), ..World::default() };
        let part = |part: [f64; 4]| Gather::new(&expected(Some(part), None), world).expect("memory").to.boundary;
        let metres = |text: &str| Unit::Metres.parse(text).expect("a length");
        let all = metres("16.384 km");
        assert_eq!(part([0.0, 0.0, all, all]), world.boundary);
        let strip = part([0.0, 32.0, all, 320.0]);
        assert_eq!(
            (strip.west, strip.east, strip.north, strip.south),
            (Edge::Periodic, Edge::Periodic, Edge::Open, Edge::Open)
        );
        let walled = World { boundary: Boundary::all(Edge::Wall), ..world };
        let corner = Gather::new(&expected(Some([0.0, 0.0, 320.0, 320.0]), Some(64.0)), walled).expect("memory");
        assert_eq!((corner.to.boundary.west, corner.to.boundary.east), (Edge::Wall, Edge::Open));
        assert!(!corner.is_whole() && corner.part_m() == ([0.0, 0.0], [320.0, 320.0]));
    }
}
