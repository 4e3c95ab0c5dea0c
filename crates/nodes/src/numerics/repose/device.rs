//! Slides on a graphics device: the sweeps and the pyramid of [`Slump`](super::Slump), all cells of a grid at once.

use orograph_graph::{
    Job, NodeError,
    gpu::{Bind, Number, Over, Pass, Recorder, Scalar, ScratchId, Shader, Size, Slot},
};

use super::{
    CYCLES, STEP, SWEEPS, coarser,
    sweep::{FILM, GIVEN, WALL},
};
use crate::wgsl::{self, wgsl};

/// A sweep.
pub(crate) static SWEEP: Shader = Shader {
    name: "lib/repose_sweep",
    source: wgsl!("lib/repose_sweep"),
    library: &[wgsl::LINES, wgsl::REPOSE],
    values: &[
        ("k_wide", Number::U32),
        ("k_high", Number::U32),
        ("k_wraps_x", Number::U32),
        ("k_wraps_y", Number::U32),
        ("k_layered", Number::U32),
        ("k_turn", Number::U32),
        ("k_step", Number::F32),
        ("k_tolerance", Number::F32),
        ("k_quantum", Number::F32),
        ("k_given_corner", Number::F32),
        ("k_given_face", Number::F32),
        ("k_film", Number::F32),
        ("k_wall", Number::F32),
    ],
    slots: &[
        Slot::words("land", "vec2<f32>"),
        Slot::words("loose", "f32"),
        Slot::words("moved", "f32"),
        Slot::words("next", "f32").written(),
        Slot::words("found", "atomic<u32>").updated(),
    ],
};

/// Means for coarser grids, and gains for finer ones.
pub(crate) static GRIDS: Shader = Shader {
    name: "lib/repose_grids",
    source: wgsl!("lib/repose_grids"),
    library: &[wgsl::LINES, wgsl::REPOSE],
    values: &[
        ("k_wide", Number::U32),
        ("k_high", Number::U32),
        ("k_wraps_x", Number::U32),
        ("k_wraps_y", Number::U32),
        ("k_keeps", Number::U32),
        ("k_quantum", Number::F32),
    ],
    slots: &[
        Slot::words("land", "vec2<f32>"),
        Slot::words("coarse_land", "vec2<f32>").updated(),
        Slot::words("loose", "f32"),
        Slot::words("fine", "f32"),
        Slot::words("coarse", "f32").updated(),
        Slot::words("before", "f32").updated(),
        Slot::words("moved", "f32").updated(),
    ],
};

/// Ground and rise at repose of a closed cell, as in shaders/lib/repose.
pub(crate) const CLOSED: [f32; 2] = [0.0, 1e30];

/// Sweeps between two looks at what they found, at first and at most: the host waits for each look, and sweeps after the
/// last one that was needed only copy.
const LOOKS: [usize; 2] = [8, 32];

/// A grid on the device.
struct Grid {
    cells: [usize; 2],
    /// Ground and rise at repose.
    land: ScratchId,
    loose: Option<ScratchId>,
    /// What cells have gained, and room for the result of a sweep.
    gains: [ScratchId; 2],
    /// The gains before the sweeps of this cycle; on coarse grids.
    before: Option<ScratchId>,
    quantum: f32,
}

/// A surface on the device that slides where it is steeper than repose.
pub(crate) struct Slide {
    grids: Vec<Grid>,
    wraps: [bool; 2],
    tolerance: f32,
    found: ScratchId,
}

/// The columns and rows of the finest grid: those of a raster, extended by closed cells.
pub(crate) fn padded(cells: [usize; 2], wraps: [bool; 2]) -> [usize; 2] {
    cells.map(|count| count.next_multiple_of(1 << coarser(cells, wraps)))
}

impl Slide {
    /// Prepares the grids of a raster. `land` has the ground and the rise at repose of the cells of [`padded`]. `loose` is
    /// the thickness of their loose layer with the least rise at repose; if `None`, everything is loose.
    ///
    /// # Errors
    /// That of the recorder.
    pub(crate) fn new(
        recorder: &mut dyn Recorder,
        (cells, wraps): ([usize; 2], [bool; 2]),
        (land, loose): (ScratchId, Option<(ScratchId, f32)>),
        tolerance: f32,
    ) -> Result<Self, NodeError> {
        let mut slide =
            Self { grids: Vec::new(), wraps, tolerance, found: recorder.scratch(Size::Words(2 * LOOKS[1]))? };
        let levels = coarser(cells, wraps);
        let mut cells = padded(cells, wraps);
        for level in 0..=levels {
            let size = Size::Words(cells[0] * cells[1]);
            let mut raster = || recorder.scratch(size);
            let grid = match slide.grids.last() {
                None => Grid {
                    cells,
                    land,
                    loose: loose.map(|(loose, _)| loose),
                    gains: [raster()?, raster()?],
                    before: None,
                    quantum: loose.map_or(0.0, |(_, least)| super::quantum(least)),
                },
                Some(finer) => Grid {
                    cells,
                    land: recorder.scratch(Size::Words(2 * cells[0] * cells[1]))?,
                    loose: loose.map(|_| recorder.scratch(size)).transpose()?,
                    gains: [recorder.scratch(size)?, recorder.scratch(size)?],
                    before: Some(recorder.scratch(size)?),
                    quantum: 2.0 * finer.quantum,
                },
            };
            slide.grids.push(grid);
            if level > 0 {
                slide.between(recorder, level, "average_land", |fine, coarse| {
                    vec![("land", fine.land), ("coarse_land", coarse.land)]
                })?;
                if loose.is_some() {
                    slide.between(recorder, level, "average", |fine, coarse| {
                        let layers = [("fine", fine.loose), ("coarse", coarse.loose)];
                        layers.into_iter().filter_map(|(name, id)| Some((name, id?))).collect()
                    })?;
                }
            }
            cells = cells.map(|count| count / 2);
        }
        recorder.clear(slide.grids[0].gains[0])?;
        Ok(slide)
    }

    /// The gains of the cells of [`padded`].
    pub(crate) fn moved(&self) -> ScratchId {
        self.grids[0].gains[0]
    }

    /// Sweeps, coarse grids first, until no slope exceeds repose. Returns true if that state was reached.
    ///
    /// # Errors
    /// That of the recorder, or [`NodeError::Cancelled`].
    pub(crate) fn settle(&mut self, recorder: &mut dyn Recorder, job: &Job<'_>) -> Result<bool, NodeError> {
        let coarsest = self.grids.len() - 1;
        let is_layered = self.grids[0].loose.is_some();
        let sweeps = if coarsest == 0 { SWEEPS * CYCLES } else { SWEEPS };
        for cycle in 0..if is_layered { 1 } else { CYCLES } {
            for level in 1..=coarsest {
                self.between(recorder, level, "average", |fine, coarse| {
                    let before = coarse.before.map(|before| ("before", before));
                    [("fine", fine.gains[0]), ("coarse", coarse.gains[0])].into_iter().chain(before).collect()
                })?;
            }
            let mut tolerance = self.tolerance / (1 << coarsest) as f32;
            for level in (0..=coarsest).rev() {
                let done = (coarsest - level) as f32 / (coarsest + 1) as f32;
                job.advance(if cycle == 0 { done } else { 1.0 })?;
                let [steep, changed] = self.sweep(recorder, level, tolerance, sweeps)?;
                if level == 0 && !(steep && changed) {
                    return Ok(!steep);
                }
                if level > 0 {
                    self.between(recorder, level, "prolong", |fine, coarse| {
                        let always = [
                            ("land", fine.land),
                            ("coarse_land", coarse.land),
                            ("coarse", coarse.gains[0]),
                            ("moved", fine.gains[0]),
                        ];
                        let layers = [("before", coarse.before), ("loose", fine.loose)];
                        let layers = layers.into_iter().filter_map(|(name, id)| Some((name, id?)));
                        always.into_iter().chain(layers).collect()
                    })?;
                    tolerance *= 2.0;
                }
            }
        }
        Ok(false)
    }

    /// Runs a pass between a grid and the one finer than it, with these buffers.
    fn between(
        &self,
        recorder: &mut dyn Recorder,
        level: usize,
        entry: &'static str,
        bind: impl Fn(&Grid, &Grid) -> Vec<(&'static str, ScratchId)>,
    ) -> Result<(), NodeError> {
        let (fine, coarse) = (&self.grids[level - 1], &self.grids[level]);
        let bound = bind(fine, coarse);
        // gains are kept; they are multiples of the quantum of their grid, as are those that go to the finer one
        let keeps = bound.iter().any(|(name, _)| *name == "before");
        let quantum = if entry == "prolong" { fine.quantum } else { coarse.quantum };
        let bind: Vec<_> = bound.into_iter().map(|(name, id)| (name, Bind::Scratch(id))).collect();
        let values = [
            &self.place(level)[..],
            &[("k_keeps", Scalar::U32(u32::from(keeps))), ("k_quantum", Scalar::F32(quantum))],
        ];
        let over = Over::Array(coarse.cells.map(|count| count as u32));
        recorder.pass(&Pass { shader: &GRIDS, entry, bind: &bind, values: &values.concat(), over })
    }

    /// The numbers of a grid in shaders.
    fn place(&self, level: usize) -> [(&'static str, Scalar); 4] {
        let [wide, high] = self.grids[level].cells.map(|count| count as u32);
        let [x, y] = self.wraps.map(u32::from);
        [("k_wide", wide), ("k_high", high), ("k_wraps_x", x), ("k_wraps_y", y)].map(|(name, v)| (name, Scalar::U32(v)))
    }

    /// Sweeps a grid until it rests or nothing changes. Returns whether the last sweep found steep slopes, and whether it
    /// changed anything.
    fn sweep(
        &mut self,
        recorder: &mut dyn Recorder,
        level: usize,
        tolerance: f32,
        most: usize,
    ) -> Result<[bool; 2], NodeError> {
        let place = self.place(level);
        let found = self.found;
        let grid = &mut self.grids[level];
        let single = [
            ("k_step", STEP),
            ("k_tolerance", tolerance),
            ("k_quantum", grid.quantum / STEP),
            ("k_given_corner", GIVEN[0] / STEP),
            ("k_given_face", GIVEN[1] / STEP),
            ("k_film", FILM),
            ("k_wall", WALL),
        ]
        .map(|(name, v)| (name, Scalar::F32(v)));
        let (mut done, mut look) = (0, LOOKS[0]);
        while done < most {
            let count = look.min(most - done);
            recorder.clear(found)?;
            for turn in 0..count {
                let [moved, next] = grid.gains;
                let bound = [("land", grid.land), ("moved", moved), ("next", next), ("found", found)];
                let loose = grid.loose.map(|loose| ("loose", loose));
                let bind: Vec<_> = bound.into_iter().chain(loose).map(|(name, id)| (name, Bind::Scratch(id))).collect();
                let whole = [("k_layered", usize::from(grid.loose.is_some())), ("k_turn", turn)]
                    .map(|(name, v)| (name, Scalar::U32(v as u32)));
                recorder.pass(&Pass {
                    shader: &SWEEP,
                    entry: "sweep",
                    bind: &bind,
                    values: &[&place[..], &whole, &single].concat(),
                    over: Over::Array(grid.cells.map(|count| count as u32)),
                })?;
                grid.gains = [next, moved];
            }
            let words = recorder.read(found, 2 * count)?;
            let turns = words.as_chunks::<2>().0.iter().map(|turn| turn.map(|word| word != 0));
            if let Some(last) = turns.into_iter().find(|turn| *turn != [true; 2]) {
                return Ok(last);
            }
            done += count;
            look = (2 * look).min(LOOKS[1]);
        }
        Ok([true; 2])
    }
}
