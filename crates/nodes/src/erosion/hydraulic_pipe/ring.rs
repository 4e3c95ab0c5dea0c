//! The few rows around the one being swept, each with a ghost cell at both ends.

/// Rows kept at a time; a power of two above the number of rows between the first and the last stage of a sweep.
const DEPTH: usize = 8;

/// Rows by number, the newest [`DEPTH`] of them.
#[derive(Debug)]
pub(super) struct Ring {
    samples: Vec<f32>,
    width: usize,
}

impl Ring {
    /// Rows of `nx` cells and two ghosts.
    pub fn new(nx: usize) -> Self {
        Self { samples: vec![0.0; DEPTH * (nx + 2)], width: nx + 2 }
    }

    fn start(&self, y: isize) -> usize {
        y.rem_euclid(DEPTH as isize) as usize * self.width
    }

    /// The row with its ghosts.
    pub fn whole(&self, y: isize) -> &[f32] {
        &self.samples[self.start(y)..][..self.width]
    }

    /// The row with its ghosts, to be written.
    pub fn whole_mut(&mut self, y: isize) -> &mut [f32] {
        let start = self.start(y);
        &mut self.samples[start..][..self.width]
    }

    /// The cells of a row.
    pub fn cells(&self, y: isize) -> &[f32] {
        &self.whole(y)[1..self.width - 1]
    }

    /// The cells of a row, to be written.
    pub fn cells_mut(&mut self, y: isize) -> &mut [f32] {
        let end = self.width - 1;
        &mut self.whole_mut(y)[1..end]
    }

    /// Fills the ghosts: from the other end where the sides are joined, else with the nearest cell.
    pub fn close(&mut self, y: isize, joined: bool) {
        let row = self.whole_mut(y);
        let (first, last) = (1, row.len() - 2);
        row[0] = row[if joined { last } else { first }];
        row[last + 1] = row[if joined { first } else { last }];
    }

    /// Copies row `from` over row `to`.
    pub fn copy(&mut self, from: isize, to: isize) {
        let (from, to) = (self.start(from), self.start(to));
        self.samples.copy_within(from..from + self.width, to);
    }
}
