//! The cells around one: a circle.

/// Rectangles of a circle.
pub const STEPS: usize = 4;
/// Half the sides of these rectangles, of a circle of radius 1: their corners lie on a circle that is as much larger
/// as their union is smaller.
const SIDES: [f64; STEPS] = [0.210_68, 0.599_96, 0.897_90, 1.059_15];
/// Circles of at most this many cells are sorted by a network: radius up to 2.8 cells.
const SORTED: usize = 25;
/// Circles of at most this many cells are exact, as four rectangles can represent them: radius up to 3.6 cells.
const EXACT: usize = 37;

/// The cells around one.
pub enum Circle {
    /// Few: how far along x and y each is.
    Cells(Vec<[i64; 2]>),
    Steps(Steps),
}

/// A circle made of rectangles, the same along both axes.
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    /// Half the width of each, less half a cell, from the narrowest and highest to the widest and lowest. Backwards
    /// they are the heights.
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

    /// Returns true if a cell at these offsets belongs to the circle.
    #[inline(always)]
    pub fn contains(&self, x: i16, y: i16) -> bool {
        let [narrow, less, more, wide] = self.widths;
        // the same along both axes, so that two rectangles are enough
        let (near, far) = (x.min(y), x.max(y));
        ((near <= narrow) & (far <= wide)) | ((near <= less) & (far <= more))
    }

    /// The rows, counted from the uppermost, and how many cells each has on either side of its middle.
    pub fn rows(&self) -> impl Iterator<Item = (usize, usize)> {
        let (reach, widths) = (self.reach(), self.widths.map(|width| width as usize));
        (0..=2 * reach).map(move |row| {
            let step = widths.iter().filter(|height| **height < row.abs_diff(reach)).count();
            (row, widths[STEPS - 1 - step])
        })
    }

    /// Columns of one height that lie side by side: the first of them, counted from the leftmost, how many there are,
    /// and how many cells each has on either side of its middle.
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
