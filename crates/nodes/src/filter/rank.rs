//! Order statistics of the surroundings of each cell, such as their median: exact, at the same cost for any radius.
//!
//! The surroundings of up to some thirty cells are sorted by a network of exchanges (K. E. Batcher, 1968, "Sorting networks
//! and their applications", in the form of D. E. Knuth's algorithm M), sixteen places and more at once.
//!
//! Larger ones are counted in histograms, one for each column of cells, which the surroundings take up and leave behind as
//! they move (S. Perreault and P. Hébert, 2007, "Median filtering in constant time"). What differs from the source: values are
//! not quantised. Cells are taken in blocks, and each block sorts what it sees; a bin holds a run of that order. So the bin of
//! the wanted rank is found by counting, and the value in it by going through the few members of the bin that lie in the
//! surroundings: it is one of the values of the land, to the last bit, whatever the blocks. And surroundings are no squares,
//! which leave square marks, but circles of `STEPS` steps, a histogram of its own for each: of the circle's area, with an edge
//! that stays within 8 % of the radius.

use orograph_graph::{Job, NodeError};
use rayon::prelude::*;

use super::{
    coarse::{Between, Coarse},
    lines::Ends,
};
use crate::{
    math::{from_ordered, ordered},
    simd::simd,
};

/// The widest surroundings in cells; wider ones are counted in coarser cells of this share of the radius.
const MOST: f64 = 128.0;
/// Cells that a network sorts at most: a circle of 3.6 cells.
const SORTED: usize = 37;
/// Places that a network works on at once.
const LANES: usize = 32;
/// Runs of the order of a block's values.
const BINS: usize = 256;
/// Bins that are counted together first.
const GROUP: usize = 16;
/// How many such groups there are.
const GROUPS: usize = BINS / GROUP;
/// Members of a bin that are looked at together.
const MEMBERS: usize = 32;
/// Rectangles that a circle is made of.
const STEPS: usize = 4;
/// Half the sides of these rectangles, of a circle of radius 1: their corners lie on a circle that is as much larger as their
/// union is smaller.
const SIDES: [f64; STEPS] = [0.210_68, 0.599_96, 0.897_90, 1.059_15];

/// How land goes on beyond the edges of a world that is not periodic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beyond {
    /// Mirrored, so that there are no other values.
    Mirrored,
    /// Turned about the outermost cells, so that slopes go on.
    Straight,
}

/// Metres around a cell that are read.
#[must_use]
pub fn reach_m(radius_m: f64, cell_m: f64) -> f64 {
    if radius_m < cell_m { 0.0 } else { 1.2 * radius_m + 3.0 * cell_m }
}

/// Of the values within a radius of each cell the one that `share` of them are below, from 0, the least, to 1, the
/// largest; a half is the median. `progress` is the part of the job's progress that this is.
///
/// Where the world is periodic it goes on at the other side. A radius below one cell changes nothing.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn rank(
    job: &Job<'_>,
    progress: [f32; 2],
    samples: &[f32],
    radius_m: f64,
    share: f64,
    beyond: Beyond,
) -> Result<Vec<f32>, NodeError> {
    let window = job.window();
    let ends = [0, 1].map(|axis| Ends::of(&window, axis));
    let radius = radius_m / job.cell_m();
    if radius < 1.0 {
        return Ok(samples.to_vec());
    }
    if radius <= MOST {
        let cells = [window.nx(), window.ny()];
        return Padded::new(samples, cells, ends, beyond, radius).rank(job, progress, share);
    }
    let coarse = Coarse::new(&window, radius / MOST);
    let means = coarse.means(job, samples)?;
    let [x, y] = coarse.steps();
    let radius = (2.0 * radius / (x + y)).clamp(1.0, MOST);
    let ranked = Padded::new(&means, coarse.cells(), ends, beyond, radius).rank(job, progress, share)?;
    coarse.spread(job, [progress[1]; 2], &ranked, Between::Cubic)
}

/// A raster with as much around it as the surroundings of its outermost cells take.
struct Padded {
    samples: Vec<f32>,
    /// Columns of `samples`.
    width: usize,
    /// Cells around the raster.
    margin: usize,
    /// Columns and rows of the raster.
    cells: [usize; 2],
    circle: Circle,
}

/// The cells around one.
enum Circle {
    /// Few: how far along x and y each is.
    Cells(Vec<[i64; 2]>),
    Steps(Steps),
}

/// A circle made of rectangles.
#[derive(Clone, Copy, Debug)]
struct Steps {
    /// Half the width of each, less half a cell, from the narrowest and highest to the widest and lowest.
    widths: [i16; STEPS],
    /// Half the height of each.
    heights: [i16; STEPS],
}

impl Circle {
    fn new(radius: f64) -> Self {
        let reach = radius.min(SORTED as f64).floor() as i64;
        let all = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| [x, y]));
        let cells: Vec<[i64; 2]> = all.filter(|[x, y]| (x * x + y * y) as f64 <= radius * radius).collect();
        if cells.len() <= SORTED {
            return Self::Cells(cells);
        }
        let widths = SIDES.map(|side| (side * radius - 0.5).round().max(0.0) as i16);
        let [a, b, c, d] = widths;
        Self::Steps(Steps { widths, heights: [d, c, b, a] })
    }

    fn reach(&self) -> usize {
        match self {
            Self::Cells(cells) => cells.iter().flatten().copied().max().unwrap_or(0) as usize,
            Self::Steps(steps) => steps.reach(),
        }
    }

    /// How many cells there are.
    fn count(&self) -> usize {
        match self {
            Self::Cells(cells) => cells.len(),
            Self::Steps(steps) => (0..STEPS)
                .flat_map(|step| steps.rows(step).map(|rows| (2 * steps.widths[step] as usize + 1) * rows.count()))
                .sum(),
        }
    }
}

impl Steps {
    const fn reach(&self) -> usize {
        self.heights[0] as usize
    }

    /// Whether a cell so far along both axes belongs to the circle.
    #[inline(always)]
    fn contains(&self, x: i16, y: i16) -> bool {
        let mut inside = false;
        for (&width, &height) in self.widths.iter().zip(&self.heights) {
            inside |= (x <= width) & (y <= height);
        }
        inside
    }

    /// The rows, counted from the middle, that are as wide as a step and not wider, above and below the middle.
    fn rows(&self, step: usize) -> [std::ops::Range<i64>; 2] {
        let outer = i64::from(self.heights[step]);
        match self.heights.get(step + 1) {
            Some(&inner) => [-outer..-i64::from(inner), i64::from(inner) + 1..outer + 1],
            None => [-outer..outer + 1, 0..0],
        }
    }
}

impl Padded {
    fn new(samples: &[f32], cells: [usize; 2], ends: [Ends; 2], beyond: Beyond, radius: f64) -> Self {
        let circle = Circle::new(radius);
        let margin = circle.reach();
        let [nx, ny] = cells;
        let width = nx + 2 * margin;
        // the cell that stands at a place, and the one that it is turned about
        let source = |at: usize, axis: usize| {
            let (at, last) = (at as i64 - margin as i64, cells[axis] as i64 - 1);
            if beyond == Beyond::Mirrored || ends[axis] == Ends::Wrap || (0..=last).contains(&at) {
                return (ends[axis].index(at, cells[axis]), None);
            }
            let edge = if at < 0 { 0 } else { last };
            ((2 * edge - at).clamp(0, last) as usize, Some(edge as usize))
        };
        let columns: Vec<_> = (0..width).map(|i| source(i, 0)).collect();
        let turned = |here: f32, edge: f32| edge + (edge - here);
        let along = |row: usize, out: &mut [f32]| {
            let row = &samples[row * nx..][..nx];
            for (out, &(i, edge)) in out.iter_mut().zip(&columns) {
                *out = edge.map_or(row[i], |edge| turned(row[i], row[edge]));
            }
        };
        let mut padded = vec![0.0; width * (ny + 2 * margin)];
        padded.par_chunks_mut(width).enumerate().for_each_init(
            || vec![0.0; width],
            |spare, (j, out)| {
                let (row, edge) = source(j, 1);
                along(row, out);
                if let Some(edge) = edge {
                    along(edge, spare);
                    out.iter_mut().zip(spare).for_each(|(out, edge)| *out = turned(*out, *edge));
                }
            },
        );
        Self { samples: padded, width, margin, cells, circle }
    }

    fn rank(&self, job: &Job<'_>, progress: [f32; 2], share: f64) -> Result<Vec<f32>, NodeError> {
        let rank = (share * (self.circle.count() - 1) as f64).round() as usize;
        job.advance(progress[0])?;
        let out = match &self.circle {
            Circle::Cells(cells) => self.sorted(job, cells, rank)?,
            Circle::Steps(steps) => self.counted(job, steps, rank)?,
        };
        job.advance(progress[1])?;
        Ok(out)
    }

    /// The value of a rank, by networks.
    fn sorted(&self, job: &Job<'_>, around: &[[i64; 2]], rank: usize) -> Result<Vec<f32>, NodeError> {
        let [nx, ny] = self.cells;
        let exchanges = network(around.len());
        let mut out = vec![0.0; nx * ny];
        out.par_chunks_mut(nx).enumerate().try_for_each(|(j, row)| {
            job.check()?;
            let mut values = vec![[0.0; LANES]; around.len()];
            for (k, out) in row.chunks_mut(LANES).enumerate() {
                let first = (j + self.margin) * self.width + self.margin + k * LANES;
                for (values, [x, y]) in values.iter_mut().zip(around) {
                    let from = (first as i64 + y * self.width as i64 + x) as usize;
                    values[..out.len()].copy_from_slice(&self.samples[from..from + out.len()]);
                }
                exchange(&mut values, &exchanges);
                out.copy_from_slice(&values[rank][..out.len()]);
            }
            Ok::<_, NodeError>(())
        })?;
        Ok(out)
    }

    /// The value of a rank, by histograms.
    fn counted(&self, job: &Job<'_>, steps: &Steps, rank: usize) -> Result<Vec<f32>, NodeError> {
        let [nx, ny] = self.cells;
        let side = (3 * steps.reach()).clamp(64, 256);
        let corners: Vec<[usize; 2]> =
            (0..ny).step_by(side).flat_map(|y| (0..nx).step_by(side).map(move |x| [x, y])).collect();
        let found = corners.par_iter().map_init(Block::default, |block, &[x, y]| {
            job.check()?;
            let cells = [side.min(nx - x), side.min(ny - y)];
            block.load(self, [x, y], cells, steps);
            Ok(block.rank(cells, steps, rank))
        });
        let found: Vec<Vec<f32>> = found.collect::<Result<_, NodeError>>()?;
        let mut out = vec![0.0; nx * ny];
        for ([x, y], values) in corners.into_iter().zip(&found) {
            let width = side.min(nx - x);
            for (j, row) in values.chunks_exact(width).enumerate() {
                out[(y + j) * nx + x..][..width].copy_from_slice(row);
            }
        }
        Ok(out)
    }
}

/// Pairs of places to be put in order, one after the other, so that as many values are sorted.
fn network(count: usize) -> Vec<[usize; 2]> {
    let mut pairs = Vec::new();
    let top = count.next_power_of_two() / 2;
    let mut p = top;
    while p > 0 {
        let (mut q, mut rest, mut distance) = (top, 0, p);
        loop {
            pairs.extend((0..count - distance).filter(|i| i & p == rest).map(|i| [i, i + distance]));
            if q == p {
                break;
            }
            (distance, rest, q) = (q - p, p, q / 2);
        }
        p /= 2;
    }
    pairs
}

simd! {
    fn exchange(values: &mut [[f32; LANES]], pairs: &[[usize; 2]]) {
        for &[low, high] in pairs {
            let (mut a, mut b) = (values[low], values[high]);
            for lane in 0..LANES {
                let (x, y) = (a[lane], b[lane]);
                a[lane] = if y < x { y } else { x };
                b[lane] = if y < x { x } else { y };
            }
            (values[low], values[high]) = (a, b);
        }
    }
}

/// Cells whose surroundings are counted together, with what is around them.
#[derive(Default)]
struct Block {
    /// Columns, with those around.
    width: usize,
    /// Values in their order, and where in the block they are.
    values: Vec<f32>,
    xs: Vec<i16>,
    ys: Vec<i16>,
    /// The bin of each cell.
    bins: Vec<u8>,
    /// Ranks per bin.
    ranks: usize,
    /// For each step and column, how many cells of each bin lie in the step's rows.
    columns: Vec<[[u16; GROUP]; GROUPS]>,
    /// How many of each group of bins.
    groups: Vec<[u16; GROUPS]>,
    order: Vec<u64>,
    spare: Vec<u64>,
}

impl Block {
    /// Takes the values around cells from [x, y] on, and sorts them.
    fn load(&mut self, from: &Padded, [x, y]: [usize; 2], cells: [usize; 2], steps: &Steps) {
        let [width, height] = cells.map(|count| count + 2 * steps.reach());
        self.width = width;
        self.order.clear();
        for j in 0..height {
            let row = &from.samples[(y + j) * from.width + x..][..width];
            self.order.extend(row.iter().enumerate().map(|(i, value)| ordered(*value) << 32 | (j * width + i) as u64));
        }
        sort(&mut self.order, &mut self.spare);
        let count = self.order.len();
        self.ranks = count.div_ceil(BINS).next_multiple_of(MEMBERS);
        for list in [&mut self.xs, &mut self.ys] {
            list.clear();
            list.reserve(count);
        }
        self.values.clear();
        self.bins.resize(count, 0);
        for (rank, &entry) in self.order.iter().enumerate() {
            let at = entry as u32 as usize;
            self.values.push(from_ordered(entry >> 32));
            self.xs.push((at % width) as i16);
            self.ys.push((at / width) as i16);
            self.bins[at] = (rank / self.ranks) as u8;
        }
        self.columns.clear();
        self.columns.resize(STEPS * width, [[0; GROUP]; GROUPS]);
        self.groups.clear();
        self.groups.resize(STEPS * width, [0; GROUPS]);
    }

    /// The value of a rank around each cell.
    fn rank(&mut self, [nx, ny]: [usize; 2], steps: &Steps, rank: usize) -> Vec<f32> {
        let mut out = vec![0.0; nx * ny];
        for (j, row) in out.chunks_exact_mut(nx).enumerate() {
            let middle = (j + steps.reach()) as i64;
            for step in 0..STEPS {
                for rows in steps.rows(step).into_iter().filter(|rows| !rows.is_empty()) {
                    if j == 0 {
                        rows.for_each(|row| self.count(step, middle + row, 1));
                    } else {
                        self.count(step, middle + rows.end - 1, 1);
                        self.count(step, middle + rows.start - 1, u16::MAX);
                    }
                }
            }
            along(row, self, middle as i16, steps, rank as u32);
        }
        out
    }

    /// Adds a row of cells to the columns of a step; `u16::MAX` takes it away.
    fn count(&mut self, step: usize, row: i64, times: u16) {
        let bins = &self.bins[row as usize * self.width..][..self.width];
        let columns = self.columns[step * self.width..].iter_mut().zip(&mut self.groups[step * self.width..]);
        for ((column, groups), &bin) in columns.zip(bins) {
            let (group, bin) = (usize::from(bin) / GROUP, usize::from(bin) % GROUP);
            column[group][bin] = column[group][bin].wrapping_add(times);
            groups[group] = groups[group].wrapping_add(times);
        }
    }
}

/// Sorts by the upper halves of numbers, which keep their order where these are equal: by digits, the last ones first.
fn sort(numbers: &mut Vec<u64>, spare: &mut Vec<u64>) {
    const DIGITS: [u32; 3] = [32, 43, 54];
    const DIGIT: usize = 1 << 11;
    let digit = |number: u64, shift: u32| (number >> shift) as usize % DIGIT;
    let mut places = [[0_u32; DIGIT]; DIGITS.len()];
    for &number in numbers.iter() {
        for (places, shift) in places.iter_mut().zip(DIGITS) {
            places[digit(number, shift)] += 1;
        }
    }
    spare.resize(numbers.len(), 0);
    for (mut places, shift) in places.into_iter().zip(DIGITS) {
        let mut before = 0;
        for place in &mut places {
            (*place, before) = (before, before + *place);
        }
        for &number in numbers.iter() {
            let place = &mut places[digit(number, shift)];
            spare[*place as usize] = number;
            *place += 1;
        }
        std::mem::swap(numbers, spare);
    }
}

simd! {
    /// The value of a rank around each cell of a row, whose middle is row `y` of the block.
    fn along(out: &mut [f32], block: &Block, y: i16, steps: &Steps, rank: u32) {
        let reach = steps.reach();
        let widths = steps.widths.map(|width| width as usize);
        let all: usize = widths.iter().map(|width| 2 * width + 1).sum();
        let mut groups = [0_u16; GROUPS];
        // the bins of a group are counted where the rank lies in it, from the last place where it did or anew
        let (mut bins, mut counted) = ([[0_u16; GROUP]; GROUPS], [None; GROUPS]);
        for (i, out) in out.iter_mut().enumerate() {
            let x = i + reach;
            for (step, width) in widths.into_iter().enumerate() {
                let line = &block.groups[step * block.width..][..block.width];
                if i == 0 {
                    for column in &line[x - width..=x + width] {
                        add(&mut groups, column);
                    }
                } else {
                    add(&mut groups, &line[x + width]);
                    take(&mut groups, &line[x - 1 - width]);
                }
            }
            let (group, rest) = place_of(&groups, rank);
            let mut counts = bins[group];
            let since = counted[group].filter(|since| 2 * STEPS * (x - since) <= all);
            for (step, width) in widths.into_iter().enumerate() {
                let line = &block.columns[step * block.width..][..block.width];
                if let Some(since) = since {
                    for x in since + 1..=x {
                        add(&mut counts, &line[x + width][group]);
                        take(&mut counts, &line[x - 1 - width][group]);
                    }
                } else {
                    if step == 0 {
                        counts = [0; GROUP];
                    }
                    for column in &line[x - width..=x + width] {
                        add(&mut counts, &column[group]);
                    }
                }
            }
            (bins[group], counted[group]) = (counts, Some(x));
            let (bin, rest) = place_of(&counts, rest);
            let first = (group * GROUP + bin) * block.ranks;
            let end = (first + block.ranks).min(block.values.len());
            let at = member(&block.xs[first..end], &block.ys[first..end], x as i16, y, steps, rest);
            *out = block.values[first + at];
        }
    }
}

#[inline(always)]
fn add<const N: usize>(counts: &mut [u16; N], more: &[u16; N]) {
    let mut sum = *counts;
    for k in 0..N {
        sum[k] = sum[k].wrapping_add(more[k]);
    }
    *counts = sum;
}

#[inline(always)]
fn take<const N: usize>(counts: &mut [u16; N], less: &[u16; N]) {
    let mut rest = *counts;
    for k in 0..N {
        rest[k] = rest[k].wrapping_sub(less[k]);
    }
    *counts = rest;
}

/// In which of some counts a rank lies, and its rank there.
#[inline(always)]
fn place_of<const N: usize>(counts: &[u16; N], rank: u32) -> (usize, u32) {
    let mut rest = rank;
    let mut place = 0;
    while place + 1 < N && rest >= u32::from(counts[place]) {
        rest -= u32::from(counts[place]);
        place += 1;
    }
    (place, rest)
}

/// Which of the members of a bin is that of a rank among those around a cell.
#[inline(always)]
fn member(xs: &[i16], ys: &[i16], x: i16, y: i16, steps: &Steps, rank: u32) -> usize {
    let mut rest = rank;
    let mut first = 0;
    for (xs, ys) in xs.chunks(MEMBERS).zip(ys.chunks(MEMBERS)) {
        let mut inside = [0_u16; MEMBERS];
        for ((inside, &px), &py) in inside.iter_mut().zip(xs).zip(ys) {
            *inside = u16::from(steps.contains(px.wrapping_sub(x).wrapping_abs(), py.wrapping_sub(y).wrapping_abs()));
        }
        let sum = u32::from(inside.iter().fold(0_u16, |sum, inside| sum.wrapping_add(*inside)));
        if rest < sum {
            let ranks = inside.iter().scan(0, |seen, &inside| {
                *seen += u32::from(inside);
                Some(*seen)
            });
            return first + ranks.take_while(|seen| *seen <= rest).count();
        }
        rest -= sum;
        first += xs.len();
    }
    first.saturating_sub(1)
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge, Window, World, mix};

    use super::*;
    use crate::testing::{with_job, world};

    fn ranked(window: Window, samples: &[f32], radius_m: f64, share: f64) -> Vec<f32> {
        with_job(window, |job| rank(job, [0.0, 1.0], samples, radius_m, share, Beyond::Mirrored)).expect("a result")
    }

    /// Sorts the surroundings of each cell.
    fn brute_force(window: &Window, samples: &[f32], radius: f64, share: f64) -> Vec<f32> {
        let ends = [0, 1].map(|axis| Ends::of(window, axis));
        let circle = Circle::new(radius);
        let reach = circle.reach() as i64;
        let inside = |x: i64, y: i64| match &circle {
            Circle::Cells(cells) => cells.contains(&[x, y]),
            Circle::Steps(steps) => steps.contains(x.abs() as i16, y.abs() as i16),
        };
        let around: Vec<[i64; 2]> = (-reach..=reach)
            .flat_map(|y| (-reach..=reach).map(move |x| [x, y]))
            .filter(|[x, y]| inside(*x, *y))
            .collect();
        assert_eq!(around.len(), circle.count());
        let (nx, ny) = (window.nx(), window.ny());
        (0..nx * ny)
            .map(|at| {
                let value = |[x, y]: &[i64; 2]| {
                    let row = ends[1].index((at / nx) as i64 + y, ny);
                    samples[row * nx + ends[0].index((at % nx) as i64 + x, nx)]
                };
                let mut values: Vec<f32> = around.iter().map(value).collect();
                values.sort_by(f32::total_cmp);
                values[(share * (values.len() - 1) as f64).round() as usize]
            })
            .collect()
    }

    fn rough(count: usize) -> Vec<f32> {
        // signs, equal values and values of all sizes
        (0..count as u32).map(|at| ((mix(at) % 997) as f32 - 400.0) * (mix(at + 7) % 5) as f32 * 0.37).collect()
    }

    #[test]
    fn values_are_those_of_sorted_surroundings() {
        for (nx, ny, radius, edge) in [
            (70, 45, 1.0, Edge::Base),
            (70, 45, 1.5, Edge::Periodic),
            (33, 70, 2.9, Edge::Base),
            (70, 45, 3.5, Edge::Wall),
            (70, 45, 3.7, Edge::Base),
            (150, 90, 5.3, Edge::Periodic),
            (150, 90, 12.0, Edge::Base),
            (1, 90, 8.0, Edge::Base),
            (5, 3, 30.0, Edge::Periodic),
        ] {
            let window = Window::whole(World { boundary: Boundary::all(edge), ..world(nx, ny, 1.0) });
            let samples = rough(window.len());
            for share in [0.0, 0.2, 0.5, 1.0] {
                let expected = brute_force(&window, &samples, radius, share);
                assert!(ranked(window, &samples, radius, share) == expected, "{nx} x {ny} {radius} {share}");
            }
        }
    }

    /// On a plane the median is the plane, up to its edges, where slopes go on.
    #[test]
    fn slopes_go_on_where_they_are_to() {
        let window = Window::whole(world(60, 40, 1.0));
        let samples: Vec<f32> = (0..window.len()).map(|at| 2.0 * (at % 60) as f32 - 3.0 * (at / 60) as f32).collect();
        for radius in [2.0, 6.0, 90.0] {
            let ends = [Ends::Mirror; 2];
            let padded = Padded::new(&samples, [60, 40], ends, Beyond::Straight, radius);
            let at = |x: usize, y: usize| padded.samples[(y + padded.margin) * padded.width + x + padded.margin];
            assert_eq!(at(59, 39), samples[samples.len() - 1]);
            if padded.margin < 30 {
                assert!((0..padded.samples.len()).all(|at| {
                    let place = |at: usize| at as f32 - padded.margin as f32;
                    padded.samples[at] == 2.0 * place(at % padded.width) - 3.0 * place(at / padded.width)
                }));
            }
        }
    }

    #[test]
    fn circles_have_the_area_of_circles() {
        for radius in [4.0, 7.5, 20.0, 63.0, 128.0] {
            let circle = Circle::new(radius);
            let share = circle.count() as f64 / (std::f64::consts::PI * radius * radius);
            // half a cell at an edge of 6 radii
            assert!((share - 1.0).abs() < 0.9 / radius, "{radius}: {share}");
            assert!(circle.count() < usize::from(u16::MAX));
        }
    }

    /// Beyond 128 cells coarser ones of a 128th of the radius are counted; on land of waves as long as the radius that is
    /// less than a percent of their height.
    #[test]
    fn wide_surroundings_are_counted_in_coarser_cells() {
        let window = Window::whole(world(420, 6, 1.0));
        let wave = |at: usize| (100.0 * libm::sin(0.04 * (at % 420) as f64)) as f32 + (mix(at as u32) % 16) as f32;
        let samples: Vec<f32> = (0..window.len()).map(wave).collect();
        let expected = brute_force(&window, &samples, 150.0, 0.5);
        let found = ranked(window, &samples, 150.0, 0.5);
        for (found, expected) in found.iter().zip(&expected) {
            assert!((found - expected).abs() < 3.0, "{found} {expected}");
        }
    }
}
