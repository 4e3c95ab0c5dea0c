//! Rows of cells with room for ghosts, laid out for wide loads: cells begin on a cache line, and the rows that a step
//! works on at one time are spread over the sets of a cache.

/// Samples of a cache line.
const LINE: usize = 16;
/// Rows kept by a ring: at least as many as there are between the first and the last stage that use it, and a ghost
/// row.
const DEPTH: usize = 5;

/// Rows of equal length. Cells begin one cache line into each, so that there is a ghost before and after them.
#[derive(Debug)]
pub(super) struct Rows {
    samples: Vec<f32>,
    first: usize,
    stride: usize,
    nx: usize,
}

impl Rows {
    /// `count` rows of `nx` cells, all 0. Sets of rows used at one time should have different `place`s.
    pub fn new(nx: usize, count: usize, place: usize) -> Self {
        // an odd number of lines, so that the rows of a set are spread as well
        let stride = (((nx + 2).div_ceil(LINE) + 1) | 1) * LINE;
        let skew = place * 5 % 64 * LINE;
        let samples = vec![0.0; count * stride + skew + LINE];
        let first = samples.as_ptr().align_offset(LINE * size_of::<f32>()).min(LINE) + skew;
        Self { samples, first, stride, nx }
    }

    fn start(&self, row: usize) -> usize {
        self.first + row * self.stride + LINE
    }

    /// The cells of a row and one sample more, which is the last face of rows of faces.
    pub fn faces(&self, row: usize) -> &[f32] {
        &self.samples[self.start(row)..][..=self.nx]
    }

    /// The same, to be written.
    pub fn faces_mut(&mut self, row: usize) -> &mut [f32] {
        let start = self.start(row);
        &mut self.samples[start..][..=self.nx]
    }

    /// The cells of a row.
    pub fn cells(&self, row: usize) -> &[f32] {
        &self.samples[self.start(row)..][..self.nx]
    }

    /// The same, to be written.
    pub fn cells_mut(&mut self, row: usize) -> &mut [f32] {
        let start = self.start(row);
        &mut self.samples[start..][..self.nx]
    }

    /// A row with its ghosts.
    pub fn whole(&self, row: usize) -> &[f32] {
        &self.samples[self.start(row) - 1..][..self.nx + 2]
    }

    /// The same, to be written.
    pub fn whole_mut(&mut self, row: usize) -> &mut [f32] {
        let start = self.start(row) - 1;
        &mut self.samples[start..][..self.nx + 2]
    }
}

/// Rows by number, the newest [`DEPTH`] of them, each with a ghost cell at both ends.
#[derive(Debug)]
pub(super) struct Ring(Rows);

impl Ring {
    /// A ring of rows of `nx` cells; `place` as in [`Rows::new`].
    pub fn new(nx: usize, place: usize) -> Self {
        Self(Rows::new(nx, DEPTH, place))
    }

    fn slot(y: isize) -> usize {
        y.rem_euclid(DEPTH as isize) as usize
    }

    /// The row with its ghosts.
    pub fn whole(&self, y: isize) -> &[f32] {
        self.0.whole(Self::slot(y))
    }

    /// The row with its ghosts, to be written.
    pub fn whole_mut(&mut self, y: isize) -> &mut [f32] {
        self.0.whole_mut(Self::slot(y))
    }

    /// The cells of a row.
    pub fn cells(&self, y: isize) -> &[f32] {
        self.0.cells(Self::slot(y))
    }

    /// The cells of a row, to be written.
    pub fn cells_mut(&mut self, y: isize) -> &mut [f32] {
        self.0.cells_mut(Self::slot(y))
    }

    /// The cells of a row and one sample more, which is the last face of rows of faces.
    pub fn faces(&self, y: isize) -> &[f32] {
        self.0.faces(Self::slot(y))
    }

    /// The same, to be written.
    pub fn faces_mut(&mut self, y: isize) -> &mut [f32] {
        self.0.faces_mut(Self::slot(y))
    }

    /// Fills the ghosts: from the other end in a periodic world, otherwise with the nearest cell.
    pub fn close(&mut self, y: isize, joined: bool) {
        let row = self.whole_mut(y);
        let (first, last) = (1, row.len() - 2);
        row[0] = row[if joined { last } else { first }];
        row[last + 1] = row[if joined { first } else { last }];
    }

    /// Copies row `from` over row `to`.
    pub fn copy(&mut self, from: isize, to: isize) {
        let (from, to) = (self.0.start(Self::slot(from)) - 1, self.0.start(Self::slot(to)) - 1);
        self.0.samples.copy_within(from..from + self.0.nx + 2, to);
    }
}
