//! Diffusion along a bundle of lines of cells, all of them at once.
//!
//! A line is a row or a column. Between neighbours i − 1 and i passes, in the course of a step, e (hᵢ₋₁ − hᵢ) of the
//! old heights and c − e of the new ones, where c = D Δt / d². The explicit share e is c / 2 + 1 / 12, which makes the
//! step second-order in time and fourth-order in space (Crandall 1955), but at most c, and at most a quarter, so that
//! old heights are only averaged: nothing overshoots at any step. Where land has risen before the step, e is 0 beside
//! cells that keep their height: the old rise there includes the uplift of one cell and not that of the other.
//! Tridiagonal systems are solved by elimination without subtractions (Grassmann, Taksar and Heyman 1985), which stays
//! exact where c is so large that 1 + c equals c.

mod rows;

use self::rows::{load, store};
use super::even::Even;
use crate::numerics::simd::simd;

/// Lines of a bundle: two of the widest vectors, so that one's division waits for nobody.
pub const LANES: usize = 16;
/// A number for each line.
pub type Lanes = [f64; LANES];

/// The largest explicit share of a face: two of them leave half of a cell where it is, so that no wave changes sign.
pub const EXPLICIT: f64 = 0.25;
/// The largest square of the slope over the critical one that makes ground more mobile.
pub const STEEPEST: f64 = 0.95;
/// Steps of Newton's method for the slopes at the end of a time step.
const ITERATIONS: usize = 4;
/// Times that sinks which give are turned into land, the last time with all others of their lines.
const ROUNDS: u32 = 8;
/// The largest D Δt / d² that is distinguished from larger ones.
pub const MOST_MOBILE: f64 = 1e12;
/// Heights from here on, in metres, are holes in the data, as what is no number.
pub const HIGHEST_M: f64 = 1e15;
/// What a sink gives away, in metres, before it counts as land.
pub const GIVEN_M: f64 = 1e-9;

/// What a cell that does not rise does with what arrives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hold {
    /// It passes it on to somewhere else, and keeps its height; as long as more arrives than leaves.
    Sink,
    /// It keeps its height.
    Fixed,
}

const FREE: f64 = 0.0;
const SINK: f64 = 1.0;
const FIXED: f64 = 2.0;
/// No ground: nothing crosses its faces. So are cells of lanes without a line.
const HOLE: f64 = 3.0;

impl Hold {
    const fn code(self) -> f64 {
        match self {
            Self::Sink => SINK,
            Self::Fixed => FIXED,
        }
    }
}

/// The direction of lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Along {
    Rows,
    Columns,
}

/// What is known of the cells of a bundle before a step.
#[derive(Clone, Copy, Debug)]
pub struct Ground<'a> {
    /// Number of lines.
    pub lines: usize,
    pub along: Along,
    /// D in m²/yr, if it differs from cell to cell.
    pub diffusivity: Option<&'a [&'a [f32]]>,
    /// The smallest D, or the only one.
    pub least: f64,
    /// Mobility per D.
    pub per_diffusivity: f64,
    /// Heights of the lines before the first and after the last; empty where there is none.
    pub outer: Option<&'a [Vec<f64>; 2]>,
}

/// Lines side by side: all by cell, then by line. A face i is that between the cells i − 1 and i; the first is that
/// between the ends, if they are joined, and so is the one past the last.
#[derive(Debug)]
pub struct Bundle {
    wraps: bool,
    /// Whether the land has risen before the step, except cells that keep their height.
    risen: bool,
    /// Whether there are sinks, and whether there are holes in the data.
    sinks: bool,
    holes: bool,
    /// D Δt / d² if it is that of all cells but holes; `mobility` is then unset until `uneven`.
    same: Option<f64>,
    /// What is known of lines on which nothing differs between their ends, and whether the last step was along such.
    even: Even,
    is_even: bool,
    /// Lines and cells that were told to keep their heights.
    kept: Vec<[usize; 2]>,
    /// The rise between two cells at the critical slope in metres; infinite for linear diffusion.
    critical_m: f64,
    /// Heights before the step.
    start: Vec<Lanes>,
    /// D Δt / d² of cells.
    mobility: Vec<Lanes>,
    hold: Vec<Lanes>,
    /// Rise across the lines at cells, in metres per cell.
    across: Vec<Lanes>,
    /// What crosses faces because of the old heights, in metres over a cell.
    explicit: Vec<Lanes>,
    /// What crosses faces whatever the new heights are.
    given: Vec<Lanes>,
    /// What crosses faces per metre that the new height before it is above that behind it.
    implicit: Vec<Lanes>,
    /// The part of `implicit` that is the same on all slopes.
    level: Vec<Lanes>,
    /// Share of what a cell takes over from the one behind it in the elimination.
    ratio: Vec<Lanes>,
    /// Share of a height of 0 at the ends in the heights between them, for joined lines.
    ends: Vec<Lanes>,
    /// Heights after the step.
    end: Vec<Lanes>,
}

impl Bundle {
    /// Lines of `cells` cells, joined at their ends if `wraps`; `risen` if the heights of free cells include an uplift.
    #[must_use]
    pub fn new(cells: usize, wraps: bool, risen: bool, critical_m: f64) -> Self {
        let wraps = wraps && cells > 1;
        let lanes = |used: bool| vec![[0.0; LANES]; if used { cells } else { 0 }];
        let faces = |used: bool| vec![[0.0; LANES]; if used { cells + 1 } else { 0 }];
        let steepens = critical_m < f64::INFINITY;
        Self {
            wraps,
            risen,
            sinks: false,
            holes: false,
            same: None,
            even: Even::default(),
            is_even: false,
            kept: Vec::new(),
            critical_m,
            start: lanes(true),
            mobility: lanes(true),
            hold: lanes(true),
            across: lanes(steepens),
            explicit: faces(steepens),
            given: faces(true),
            implicit: faces(true),
            level: faces(steepens),
            ratio: lanes(true),
            ends: lanes(wraps),
            end: lanes(true),
        }
    }

    /// Reads heights, as slices of rows of the raster, and makes holes in the data walls.
    pub fn load(&mut self, heights: &[&mut [f64]], ground: &Ground<'_>) {
        self.free();
        if std::mem::take(&mut self.holes) {
            self.hold.fill([FREE; LANES]);
        }
        self.same = ground.diffusivity.is_none().then(|| mobility(ground.least, ground));
        load(self, heights, ground);
        if self.critical_m < f64::INFINITY {
            self.uneven();
        }
        if let Some(outer) = ground.outer {
            across(self, outer, ground.lines);
        }
    }

    /// Sets what a cell that is no hole does with what arrives.
    #[inline(always)]
    pub fn hold(&mut self, line: usize, i: usize, hold: Hold) {
        if self.hold[i][line] != HOLE {
            // a river at a side of the world is held twice
            if self.hold[i][line] == FREE {
                self.kept.push([line, i]);
            }
            self.hold[i][line] = hold.code();
            self.sinks |= hold == Hold::Sink;
        }
    }

    /// Lets all ground move again.
    fn free(&mut self) {
        self.sinks = false;
        for [line, i] in self.kept.drain(..) {
            self.hold[i][line] = FREE;
        }
    }

    /// Sets the mobility of each cell where it is the same everywhere.
    fn uneven(&mut self) {
        if let Some(same) = self.same.take() {
            for (mobility, hold) in self.mobility.iter_mut().zip(&self.hold) {
                *mobility = hold.map(|hold| if hold == HOLE { 0.0 } else { same });
            }
        }
    }

    /// The mobility of all cells, if nothing differs between the ends of the lines.
    fn evenly(&self) -> Option<f64> {
        let cells = self.start.len();
        let plain = !(self.wraps || self.risen || self.holes) && cells > 1;
        self.same.filter(|_| plain && self.kept.iter().all(|&[_, i]| i == 0 || i + 1 == cells))
    }

    /// Makes a step.
    pub fn step(&mut self) {
        let steepens = self.critical_m < f64::INFINITY;
        let even = self.evenly();
        self.is_even = even.is_some();
        if let Some(mobility) = even {
            self.even.prepare(mobility, self.start.len());
        } else if steepens {
            steep_faces(self)
        } else {
            self.uneven();
            faces(self)
        }
        // What would give more than it gets is no sink, which may bring others to give.
        for round in 0..=ROUNDS {
            if steepens {
                self.end.copy_from_slice(&self.start);
                for _ in 0..ITERATIONS {
                    tangents(self);
                    eliminate(self);
                }
                // Whether or not the slopes have converged, all heights are now between those at the start.
                secants(self);
            }
            if self.is_even {
                self.even.solve(&self.start, [&self.hold[0], &self.hold[self.start.len() - 1]], &mut self.end);
            } else {
                eliminate(self);
            }
            if round == ROUNDS || !self.sinks || !release(self, round + 1 == ROUNDS) {
                break;
            }
        }
    }

    /// Writes the heights after the step; holes keep what they have.
    pub fn store(&self, heights: &mut [&mut [f64]], along: Along) {
        store(self, heights, along);
    }

    /// Adds what cells that keep their heights get in the step, in metres over a cell.
    #[inline(always)]
    pub fn add_arriving(&self, lost: &mut [&mut [f64]], along: Along) {
        for &[line, i] in &self.kept {
            if self.hold[i][line] != FREE {
                let lost = if along == Along::Rows { &mut lost[line][i] } else { &mut lost[i][line] };
                *lost += self.arriving(line, i);
            }
        }
    }

    /// Begins another step where the last one ended, with all ground free again.
    pub fn go_on(&mut self) {
        self.free();
        std::mem::swap(&mut self.start, &mut self.end);
    }

    /// What cell `i` of a line gets, in metres over a cell.
    #[must_use]
    #[inline(always)]
    pub fn arriving(&self, line: usize, i: usize) -> f64 {
        self.crossing(line, i) - self.crossing(line, i + 1)
    }

    /// What crosses face `i`, in metres over a cell: nothing between two cells that keep their heights.
    #[inline(always)]
    fn crossing(&self, line: usize, i: usize) -> f64 {
        let [before, after] = beside(i, self.start.len());
        if self.hold[before][line] != FREE && self.hold[after][line] != FREE {
            return 0.0;
        }
        let (given, implicit) = if !self.is_even {
            (self.given[i][line], self.implicit[i][line])
        } else if i == 0 || i == self.start.len() {
            (0.0, 0.0)
        } else {
            (self.even.explicit * (self.start[before][line] - self.start[after][line]), self.even.implicit)
        };
        given + implicit * (self.end[before][line] - self.end[after][line])
    }
}

/// A diffusivity in m²/yr from what is given.
#[inline(always)]
pub fn diffusivity(given: f32) -> f64 {
    if given > 0.0 { f64::from(given).min(1e6) } else { 0.0 }
}

/// D Δt / d² for a D.
#[inline(always)]
fn mobility(diffusivity: f64, ground: &Ground<'_>) -> f64 {
    (diffusivity * ground.per_diffusivity).min(MOST_MOBILE)
}

simd! {
    /// Computes rises per cell across the lines, from what is before a line to what is behind it, where there is land.
    fn across(bundle: &mut Bundle, outer: &[Vec<f64>; 2], lines: usize) {
        let [before, behind] = outer;
        for (i, across) in bundle.across.iter_mut().enumerate() {
            let mut heights = [f64::NAN; LANES + 2];
            heights[0] = before.get(i).copied().unwrap_or(f64::NAN);
            for (lane, (start, hold)) in bundle.start[i].iter().zip(bundle.hold[i]).enumerate() {
                heights[lane + 1] = if hold == FREE { *start } else { f64::NAN };
            }
            heights[lines + 1] = behind.get(i).copied().unwrap_or(f64::NAN);
            for lane in 0..LANES {
                let [before, here, behind] = [heights[lane], heights[lane + 1], heights[lane + 2]];
                let (is_before, is_behind) = (before.abs() < HIGHEST_M, behind.abs() < HIGHEST_M);
                let (low, high) = (if is_before { before } else { here }, if is_behind { behind } else { here });
                let share = if is_before && is_behind { 0.5 } else { 1.0 };
                across[lane] = if here.abs() < HIGHEST_M { share * (high - low) } else { 0.0 };
            }
        }
    }
}

/// The cells before and behind a face.
#[inline(always)]
const fn beside(face: usize, cells: usize) -> [usize; 2] {
    if face == 0 || face == cells { [cells - 1, 0] } else { [face - 1, face] }
}

/// 1 for a cell whose height may change, else 0.
#[inline(always)]
pub fn moves(hold: f64) -> f64 {
    if hold == FREE { 1.0 } else { 0.0 }
}

/// D Δt / d² on the face between two cells: the harmonic mean, so that nothing crosses the edge of what does not move.
#[inline(always)]
pub fn harmonic(a: f64, b: f64) -> f64 {
    2.0 * a * b / (a + b + f64::MIN_POSITIVE)
}

/// The explicit share of what is c in all.
#[inline(always)]
pub fn explicit(c: f64) -> f64 {
    let fourth_order = 0.5 * c + 1.0 / 12.0;
    let most = if c < EXPLICIT { c } else { EXPLICIT };
    if fourth_order < most { fourth_order } else { most }
}

/// 0 on a face beside a cell that keeps its height, where the land has risen before the step; else 1.
#[inline(always)]
fn old_counts(risen: bool, before: f64, after: f64) -> f64 {
    if risen && moves(before) * moves(after) == 0.0 { 0.0 } else { 1.0 }
}

/// How much more mobile ground is at a square of the slope over the critical one.
#[inline(always)]
fn steepened(square: f64) -> f64 {
    1.0 / (1.0 - if square < STEEPEST { square } else { STEEPEST })
}

simd! {
    /// Coefficients of linear diffusion.
    fn faces(bundle: &mut Bundle) {
        let cells = bundle.start.len();
        for face in usize::from(!bundle.wraps)..cells + usize::from(bundle.wraps) {
            let [before, after] = beside(face, cells);
            let (mobile, start, hold) = (&bundle.mobility, &bundle.start, &bundle.hold);
            for lane in 0..LANES {
                let c = harmonic(mobile[before][lane], mobile[after][lane]);
                let e = explicit(c) * old_counts(bundle.risen, hold[before][lane], hold[after][lane]);
                bundle.given[face][lane] = e * (start[before][lane] - start[after][lane]);
                bundle.implicit[face][lane] = c - e;
            }
        }
    }
}

simd! {
    /// Coefficients of diffusion that depends on the slope, as far as they do not depend on the slope after the step.
    fn steep_faces(bundle: &mut Bundle) {
        let cells = bundle.start.len();
        let scale = 1.0 / bundle.critical_m;
        for face in usize::from(!bundle.wraps)..cells + usize::from(bundle.wraps) {
            let [before, after] = beside(face, cells);
            let (mobile, start, across) = (&bundle.mobility, &bundle.start, &bundle.across);
            let hold = &bundle.hold;
            for lane in 0..LANES {
                let level = harmonic(mobile[before][lane], mobile[after][lane]);
                let down = start[before][lane] - start[after][lane];
                let (along, across) = (down * scale, 0.5 * (across[before][lane] + across[after][lane]) * scale);
                let factor = steepened(along * along + across * across);
                let e = explicit(level * factor) * old_counts(bundle.risen, hold[before][lane], hold[after][lane]);
                bundle.explicit[face][lane] = e * down;
                bundle.level[face][lane] = level - e / factor;
            }
        }
    }
}

simd! {
    /// Coefficients of Newton's method at the heights of the last iterate.
    fn tangents(bundle: &mut Bundle) {
        slopes(bundle, true);
    }
}

simd! {
    /// Coefficients with which the heights of the last iterate have the right flux.
    fn secants(bundle: &mut Bundle) {
        slopes(bundle, false);
    }
}

#[inline(always)]
fn slopes(bundle: &mut Bundle, tangents: bool) {
    let cells = bundle.start.len();
    let scale = 1.0 / bundle.critical_m;
    for face in usize::from(!bundle.wraps)..cells + usize::from(bundle.wraps) {
        let [before, after] = beside(face, cells);
        let (end, across) = (&bundle.end, &bundle.across);
        for lane in 0..LANES {
            let (level, down) = (bundle.level[face][lane], end[before][lane] - end[after][lane]);
            let (along, across) = (down * scale, 0.5 * (across[before][lane] + across[after][lane]) * scale);
            let square = along * along + across * across;
            let secant = steepened(square);
            let bend = if tangents && square < STEEPEST { 2.0 * along * along * secant * secant } else { 0.0 };
            bundle.given[face][lane] = bundle.explicit[face][lane] - level * bend * down;
            bundle.implicit[face][lane] = level * (secant + bend);
        }
    }
}

simd! {
    /// Solves for the heights at the end.
    fn eliminate(bundle: &mut Bundle) {
        let cells = bundle.start.len();
        let first = usize::from(bundle.wraps);
        let (mut kept, mut solved) = ([1.0; LANES], [0.0; LANES]);
        let mut ends = [0.0; LANES];
        for i in first..cells {
            let (given, implicit) = (&bundle.given[i..i + 2], &bundle.implicit[i..i + 2]);
            let (start, hold) = (&bundle.start[i], &bundle.hold[i]);
            let (ratio, end) = (&mut bundle.ratio[i], &mut bundle.end[i]);
            for lane in 0..LANES {
                let moves = moves(hold[lane]);
                let (before, after) = (moves * implicit[0][lane], moves * implicit[1][lane]);
                let rhs = start[lane] + moves * (given[0][lane] - given[1][lane]);
                // 1 + before + after, less what is eliminated: without a subtraction.
                let stays = 1.0 + before * kept[lane];
                let pivot = 1.0 / (stays + after);
                ratio[lane] = after * pivot;
                kept[lane] = stays * pivot;
                solved[lane] = (rhs + before * solved[lane]) * pivot;
                end[lane] = solved[lane];
                if first == 1 {
                    ends[lane] = (1.0 + before * ends[lane]) * pivot;
                    bundle.ends[i][lane] = ends[lane];
                }
            }
        }
        let (mut behind, mut ends) = ([0.0; LANES], [0.0; LANES]);
        for i in (first..cells).rev() {
            let (ratio, end) = (&bundle.ratio[i], &mut bundle.end[i]);
            for lane in 0..LANES {
                end[lane] += ratio[lane] * behind[lane];
                behind[lane] = end[lane];
                if first == 1 {
                    bundle.ends[i][lane] += ratio[lane] * ends[lane];
                    ends[lane] = bundle.ends[i][lane];
                }
            }
        }
        if first == 1 {
            close(bundle);
        }
    }
}

/// Joins the ends of lines that were solved with a height of 0 at the first cell.
#[inline(always)]
fn close(bundle: &mut Bundle) {
    let cells = bundle.start.len();
    for lane in 0..LANES {
        let moves = moves(bundle.hold[0][lane]);
        let (before, after) = (moves * bundle.implicit[0][lane], moves * bundle.implicit[1][lane]);
        let rhs = bundle.start[0][lane] + moves * (bundle.given[0][lane] - bundle.given[1][lane]);
        let stays = 1.0 + before * bundle.ends[cells - 1][lane] + after * bundle.ends[1][lane];
        bundle.end[0][lane] = (rhs + before * bundle.end[cells - 1][lane] + after * bundle.end[1][lane]) / stays;
    }
    let joined = bundle.end[0];
    for (end, ends) in bundle.end.iter_mut().zip(&bundle.ends).skip(1) {
        for ((end, ends), joined) in end.iter_mut().zip(ends).zip(joined) {
            *end += joined * (1.0 - ends);
        }
    }
}

/// Turns sinks that would give into land, or `all` sinks of lines where one would. Says whether there were any.
fn release(bundle: &mut Bundle, all: bool) -> bool {
    let cells = bundle.start.len();
    let mut gives = [false; LANES];
    for i in 0..cells {
        for (lane, gives) in gives.iter_mut().enumerate() {
            if bundle.hold[i][lane] == SINK && bundle.arriving(lane, i) < -GIVEN_M {
                *gives = true;
                bundle.hold[i][lane] = FREE;
            }
        }
    }
    let any = gives.contains(&true);
    if all && any {
        for hold in &mut bundle.hold {
            for (hold, gives) in hold.iter_mut().zip(gives) {
                *hold = if gives && *hold == SINK { FREE } else { *hold };
            }
        }
    }
    any
}
