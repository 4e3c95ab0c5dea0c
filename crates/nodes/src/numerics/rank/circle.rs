//! The neighbourhood of a cell: a circle.

/// Number of rectangles that approximate a circle.
pub const STEPS: usize = 4;
/// Half sides of these rectangles for a circle of radius 1: their corners lie on a circle that is enlarged to
/// compensate for the smaller area of their union.
const SIDES: [f64; STEPS] = [0.210_68, 0.599_96, 0.897_90, 1.059_15];
/// Circles of at most this many cells are sorted by a network: radius up to 2.8 cells.
const SORTED: usize = 25;
/// Circles of at most this many cells are exact, since four rectangles can represent them: radius up to 3.6 cells.
const EXACT: usize = 37;

/// The neighbourhood of a cell.
pub enum Circle {
    /// A small circle: the offsets of its cells along x and y.
    Cells(Vec<[i64; 2]>),
    Steps(Steps),
}

/// A union of rectangles that is symmetric in x and y.
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    /// Half widths of the rectangles, less half a cell, from the narrowest and highest to the widest and lowest. In
    /// reverse order they are the half heights.
    widths: [i16; STEPS],
}

impl Circle {
    pub fn new(radius: f64) -> Self {
        let reach = radius.min(EXACT as f64).floor() as i64;
        let inside = |x: i64, y: i64| (x * x + y * y) as f64 <= radius * radius;
        let all = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| [x, y]));
        let cells: Vec<[i64; 2]> = all.filter(|[x, y]| inside(*x, *y)).collect();
        if cells.len() <= SORTED {
            return Self::Cells(cells);
        }
        let widths = if cells.len() <= EXACT {
            let half = |x: i64| (0..=reach).rev().find(|y| inside(x, *y)).unwrap_or(0);
            let corner = (0..=reach).rev().find(|at| inside(*at, *at)).unwrap_or(0);
            [half(reach), corner, half(corner), reach].map(|width| width as i16)
        } else {
            SIDES.map(|side| (side * radius - 0.5).round().max(0.0) as i16)
        };
        Self::Steps(Steps { widths })
    }

    pub fn reach(&self) -> usize {
        match self {
            Self::Cells(cells) => cells.iter().flatten().copied().max().unwrap_or(0) as usize,
            Self::Steps(steps) => steps.reach(),
        }
    }

    /// Returns the number of cells.
    pub fn count(&self) -> usize {
        match self {
            Self::Cells(cells) => cells.len(),
            Self::Steps(steps) => steps.rows().map(|(_, half)| 2 * half + 1).sum(),
        }
    }
}

impl Steps {
    pub const fn reach(&self) -> usize {
        self.widths[STEPS - 1] as usize
    }

    /// Returns true if a cell at these absolute offsets belongs to the circle.
    #[inline(always)]
    pub fn contains(&self, x: i16, y: i16) -> bool {
        let [narrow, less, more, wide] = self.widths;
        // symmetric in x and y, so that two rectangles are enough
        let (near, far) = (x.min(y), x.max(y));
        ((near <= narrow) & (far <= wide)) | ((near <= less) & (far <= more))
    }

    /// Returns the rows, counted from the uppermost, with the number of cells on either side of the middle.
    pub fn rows(&self) -> impl Iterator<Item = (usize, usize)> {
        let (reach, widths) = (self.reach(), self.widths.map(|width| width as usize));
        (0..=2 * reach).map(move |row| {
            let step = widths.iter().filter(|height| **height < row.abs_diff(reach)).count();
            (row, widths[STEPS - 1 - step])
        })
    }

    /// Returns groups of adjacent columns of equal height: the first column, counted from the leftmost, the number of
    /// columns, and the number of cells above and below the middle.
    pub fn stretches(&self) -> [[usize; 3]; 2 * STEPS - 1] {
        let (reach, widths) = (self.reach(), self.widths.map(|width| width as usize));
        let mut out = [[0; 3]; 2 * STEPS - 1];
        for step in 0..STEPS {
            let half = widths[STEPS - 1 - step];
            let Some(inner) = step.checked_sub(1).map(|inner| widths[inner]) else {
                out[0] = [reach - widths[0], 2 * widths[0] + 1, half];
                continue;
            };
            let columns = widths[step] - inner;
            out[2 * step - 1] = [reach - widths[step], columns, half];
            out[2 * step] = [reach + inner + 1, columns, half];
        }
        out
    }
}
