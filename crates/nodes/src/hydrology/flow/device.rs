//! Drainage on a graphics device: all that is decided by whole numbers, and so equal to the CPU.
//!
//! Receivers are those of [`receivers::d8`]. Basins are the trees of cells below pits, found by pointers that reach
//! twice as far with each pass. In each round every basin takes its lowest pass, in the order of the spanning tree of
//! [`crate::numerics::routing::basins`], and the way from its bottom to the pass is turned around; at least half of the
//! bottoms vanish (Borůvka's algorithm on cells, as Jain, Kerbl, Gain, Finley and Cordonnier 2024, "FastFlow", do).
//! The tree of passes is unique, so that receivers are those that [`Depressions::carve`] leaves. The level of water is
//! the greatest height along the way out, and a drainage area the number of cells whose way passes.
//!
//! [`receivers::d8`]: crate::numerics::routing::receivers::d8
//! [`Depressions::carve`]: crate::numerics::routing::Depressions::carve

use orograph_graph::{
    InputValue,
    gpu::{ScratchId, Size, WORKGROUP},
};

use super::{Params, Routing, SECONDS_PER_YEAR, Sinks, Wants, runoff};
use crate::{
    numerics::{
        math,
        routing::{Grid, Outlet},
    },
    prelude::*,
    wgsl,
};

/// Numbers of all shaders: the sides of the world, the lowest height on land, whether `data` is wired, a factor.
const VALUES: &[(&str, Number)] = &[
    ("k_west", Number::U32),
    ("k_east", Number::U32),
    ("k_north", Number::U32),
    ("k_south", Number::U32),
    ("k_wrap_x", Number::U32),
    ("k_wrap_y", Number::U32),
    ("k_sea", Number::F32),
    ("k_voids", Number::U32),
    ("k_each", Number::F32),
];

macro_rules! shader {
    ($name:literal, $slots:expr) => {
        Shader { name: $name, source: wgsl!($name), library: &[wgsl::LINES, wgsl::FLOW], values: VALUES, slots: $slots }
    };
}

static RECEIVE: Shader = shader!(
    "hydrology/flow_receive",
    &[Slot::input("height"), Slot::input("data"), Slot::cells("code", "u32").written()]
);

static FOLLOW: Shader = shader!(
    "hydrology/flow_follow",
    &[
        Slot::cells("code", "u32"),
        Slot::cells("pointer", "u32"),
        Slot::cells("next", "u32").written(),
        Slot::cells("marks", "atomic<u32>").updated(),
        Slot::words("changed", "atomic<u32>").updated(),
    ]
);

static PASS: Shader = shader!(
    "hydrology/flow_pass",
    &[
        Slot::input("height"),
        Slot::cells("bottom", "u32"),
        Slot::cells("heights", "atomic<u32>").updated(),
        Slot::cells("links", "atomic<u32>").updated(),
        Slot::words("left", "atomic<u32>").updated(),
    ]
);

static TURN: Shader = shader!(
    "hydrology/flow_turn",
    &[
        Slot::cells("code", "u32"),
        Slot::cells("bottom", "u32"),
        Slot::cells("heights", "u32"),
        Slot::cells("links", "u32"),
        Slot::cells("marks", "u32").updated(),
        Slot::cells("turned", "u32").written(),
    ]
);

static GATHER: Shader = shader!(
    "hydrology/flow_gather",
    &[
        Slot::input("height"),
        Slot::cells("pointer", "u32"),
        Slot::cells("next", "u32").written(),
        Slot::cells("low", "u32"),
        Slot::cells("sum", "atomic<u32>").updated(),
        Slot::words("changed", "atomic<u32>").updated(),
    ]
);

static RUNOFF: Shader = shader!(
    "hydrology/flow_runoff",
    &[
        Slot::input("runoff"),
        Slot::cells("pointer", "u32"),
        Slot::cells("low", "u32"),
        Slot::cells("high", "u32"),
        Slot::cells("sum", "atomic<u32>").updated(),
        Slot::cells("sum_high", "atomic<u32>").updated(),
        Slot::words("most", "atomic<u32>").updated(),
    ]
);

static REAPPEAR: Shader = shader!(
    "hydrology/flow_reappear",
    &[Slot::cells("bottom", "u32"), Slot::cells("turned", "u32"), Slot::cells("beyond", "u32").written()]
);

static LAKES: Shader = shader!(
    "hydrology/flow_lakes",
    &[
        Slot::input("height"),
        Slot::cells("level", "u32"),
        Slot::cells("first", "atomic<u32>").updated(),
        Slot::cells("numbers", "u32").written(),
        Slot::words("tallies", "u32").updated(),
        Slot::words("changed", "atomic<u32>").updated(),
    ]
);

static WRITE: Shader = shader!(
    "hydrology/flow_write",
    &[
        Slot::input("height"),
        Slot::cells("words", "u32"),
        Slot::cells("more", "u32"),
        Slot::cells("plane", "f32").written(),
    ]
);

pub(super) static GPU: GpuKernel = GpuKernel {
    shaders: &[&RECEIVE, &FOLLOW, &PASS, &TURN, &GATHER, &RUNOFF, &REAPPEAR, &LAKES, &WRITE],
    passes: Passes::Recorded(record),
    // shares of a cell are summed in double precision on the CPU; paths over lakes and cuts depend on an order of cells
    covers: |params| {
        let params = Params::read(params);
        params.routing == Routing::D8 && !matches!(params.depressions, Sinks::Fill | Sinks::Breach)
    },
    // whole numbers are equal, but for the sign of a level of 0; products with the area of a cell are rounded, and sums
    // of runoff to single precision: 2.4e-7 of each on rough land
    tolerance: &[
        Tolerance::ROUNDING,
        Tolerance::ROUNDING,
        Tolerance::ROUNDING,
        Tolerance::EXACT,
        Tolerance::EXACT,
        Tolerance::EXACT,
        Tolerance::EXACT,
    ],
    ..GpuKernel::DEFAULT
};

/// Passes after which pointers reach the bottoms of small basins.
const SMALL: u32 = 6;
/// Passes that join lakes between two looks whether they are done.
const JOINS: u32 = 3;

/// A run of the kernel.
struct Routed<'a, 'r> {
    job: &'a Job<'a>,
    recorder: &'r mut dyn Recorder,
    values: Vec<(&'static str, Scalar)>,
    /// One word: whether anything changed, how many are left, the highest.
    word: ScratchId,
    /// Pointers.
    ways: [ScratchId; 3],
    /// Heights and links of passes, and marks; later greatest heights and sums.
    numbers: [ScratchId; 3],
}

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let (params, wants) = (Params::read(job.params), Wants::of(job));
    let mut cells = || recorder.scratch(Size::Cells);
    let (code, mut codes) = (cells()?, [cells()?, cells()?]);
    let (ways, numbers) = ([cells()?, cells()?, cells()?], [cells()?, cells()?, cells()?]);
    let word = recorder.scratch(Size::Words(1))?;
    let values = values(job)?;
    let mut routed = Routed { job, recorder, values, word, ways, numbers };
    routed.pass(&RECEIVE, "main", &[("code", code)])?;
    job.advance(0.1)?;

    let (sinks, fills) = (params.depressions, wants.flow || wants.conditioned || wants.lake_depth || wants.lake);
    if fills || sinks != Sinks::Keep {
        codes = routed.carve(code, codes)?;
    }
    job.advance(0.4)?;
    let beyond = codes[1];
    if sinks == Sinks::Jump {
        routed.reappear(code, codes[0], beyond)?;
    }
    let level = if fills { Some(routed.level(codes[0])?) } else { None };
    job.advance(0.6)?;

    let own = if sinks == Sinks::Carve { codes[0] } else { code };
    let start = |routed: &mut Routed<'_, '_>, next| match sinks {
        Sinks::Jump => routed.pass(&FOLLOW, "to_reappear", &[("code", own), ("pointer", beyond), ("next", next)]),
        _ => routed.pass(&FOLLOW, "to_receiver", &[("code", own), ("next", next)]),
    };
    routed.amounts(&wants, start)?;
    job.advance(0.9)?;
    if wants.direction || wants.flow {
        let entry = if sinks == Sinks::Jump { "jumping_direction" } else { "direction" };
        routed.write(
            entry,
            &[("words", own), ("more", beyond)],
            &[("direction", wants.direction, 0), ("flow", wants.flow, 0)],
            1.0,
        )?;
    }
    if let Some(level) = level {
        let from = [("words", level)];
        routed.write("level", &from, &[("conditioned", wants.conditioned, 0), ("flow", wants.flow, 3)], 1.0)?;
        routed.write("depth", &from, &[("lake_depth", wants.lake_depth, 0)], 1.0)?;
        if wants.lake {
            routed.lakes(level)?;
        }
    }
    job.advance(1.0)
}

/// The numbers of all shaders.
fn values(job: &Job<'_>) -> Result<Vec<(&'static str, Scalar)>, NodeError> {
    let grid = Grid::new(&job.window())?;
    let side = |outlet| match outlet {
        Outlet::No => 0,
        Outlet::Base => 1,
        Outlet::Open => 2,
    };
    let [west, east, north, south] = grid.sides().map(side);
    let [wrap_x, wrap_y] = grid.wraps().map(u32::from);
    // the least number of single precision from the level on
    let sea = job.sea_level().map_or(f32::MIN, |level| {
        let nearest = level as f32;
        if f64::from(nearest) < level { nearest.next_up() } else { nearest }
    });
    let whole = [
        ("k_west", west),
        ("k_east", east),
        ("k_north", north),
        ("k_south", south),
        ("k_wrap_x", wrap_x),
        ("k_wrap_y", wrap_y),
        ("k_voids", u32::from(job.input("data").is_some_and(InputValue::is_wired))),
    ];
    let mut values: Vec<_> = whole.into_iter().map(|(name, v)| (name, Scalar::U32(v))).collect();
    values.extend([("k_sea", Scalar::F32(sea)), ("k_each", Scalar::F32(1.0))]);
    Ok(values)
}

/// Binary digits of a number.
const fn bits(count: usize) -> u32 {
    usize::BITS - count.leading_zeros()
}

impl Routed<'_, '_> {
    fn pass(
        &mut self,
        shader: &'static Shader,
        entry: &'static str,
        bound: &[(&'static str, ScratchId)],
    ) -> Result<(), NodeError> {
        let bind: Vec<_> = bound.iter().map(|&(name, id)| (name, Bind::Scratch(id))).collect();
        self.recorder.pass(&Pass { shader, entry, bind: &bind, values: &self.values, over: Over::Cells(Rows::All) })
    }

    fn set_factor(&mut self, each: f64) {
        self.values.retain(|(name, _)| *name != "k_each");
        self.values.push(("k_each", Scalar::F32(each as f32)));
    }

    /// Passes after which pointers have usually left the world.
    fn across(&self) -> u32 {
        let window = self.job.window();
        bits(window.nx().max(window.ny())) + 2
    }

    /// Runs `step` `first` times, then two at a time until a pass changes nothing. Returns the number of passes.
    fn until_still(
        &mut self,
        first: u32,
        mut step: impl FnMut(&mut Self) -> Result<(), NodeError>,
    ) -> Result<u32, NodeError> {
        let most = bits(self.job.window().len());
        let (mut done, mut goal) = (0, first.min(most));
        loop {
            while done < goal {
                if done + 1 == goal {
                    self.recorder.clear(self.word)?;
                }
                step(self)?;
                done += 1;
            }
            if done >= most || self.recorder.read(self.word, 1)? == [0] {
                return Ok(done);
            }
            goal = (goal + 2).min(most);
        }
    }

    /// Finds the bottom of the basin of each cell; `self.ways[0]` becomes that. Returns the number of passes, at least
    /// `first` in large worlds.
    fn bottoms(&mut self, code: ScratchId, first: u32) -> Result<u32, NodeError> {
        self.pass(&FOLLOW, "to_bottom", &[("code", code), ("next", self.ways[0])])?;
        self.until_still(first, |routed| {
            let [pointer, next, _] = routed.ways;
            routed.ways.swap(0, 1);
            routed.pass(&FOLLOW, "reach", &[("pointer", pointer), ("next", next), ("changed", routed.word)])
        })
    }

    /// Turns receivers around until no water stays. Returns the buffer with the result first.
    fn carve(&mut self, code: ScratchId, [mut turned, mut spare]: [ScratchId; 2]) -> Result<[ScratchId; 2], NodeError> {
        let (mut from, mut reaches) = (code, SMALL);
        // each round leaves half of the bottoms at most
        for _ in 0..bits(self.job.window().len()) {
            reaches = self.bottoms(from, reaches)?;
            let ([bottom, ..], [heights, links, marks]) = (self.ways, self.numbers);
            for buffer in [heights, links, self.word] {
                self.recorder.clear(buffer)?;
            }
            let passes = [("bottom", bottom), ("heights", heights), ("links", links), ("left", self.word)];
            self.pass(&PASS, "lowest", &passes[..2])?;
            self.pass(&PASS, "first_of_lowest", &passes[..3])?;
            self.pass(&PASS, "decide", &passes)?;
            let left = self.recorder.read(self.word, 1)?;
            let turn = [
                ("bottom", bottom),
                ("heights", heights),
                ("links", links),
                ("marks", marks),
                ("code", from),
                ("turned", turned),
            ];
            self.pass(&TURN, "begin", &turn[..4])?;
            let [mut pointer, mut next] = [self.ways[1], self.ways[2]];
            self.pass(&FOLLOW, "to_bottom", &[("code", from), ("next", pointer)])?;
            // one more than reach the bottom: each pass marks what was reached before it
            for _ in 0..=reaches {
                self.pass(&FOLLOW, "reach_marking", &[("pointer", pointer), ("next", next), ("marks", marks)])?;
                std::mem::swap(&mut pointer, &mut next);
            }
            self.pass(&TURN, "main", &turn)?;
            (from, turned, spare) = (turned, spare, turned);
            if left == [0] {
                break;
            }
        }
        Ok([from, turned])
    }

    /// Finds where the water of each depression goes on; `beyond` becomes that.
    fn reappear(&mut self, code: ScratchId, turned: ScratchId, beyond: ScratchId) -> Result<(), NodeError> {
        self.bottoms(code, SMALL)?;
        self.pass(&REAPPEAR, "begin", &[("beyond", beyond)])?;
        self.pass(&REAPPEAR, "main", &[("bottom", self.ways[0]), ("turned", turned), ("beyond", beyond)])
    }

    /// Finds the greatest height on the way of each cell out of the world.
    fn level(&mut self, turned: ScratchId) -> Result<ScratchId, NodeError> {
        self.pass(&FOLLOW, "to_receiver", &[("code", turned), ("next", self.ways[0])])?;
        self.pass(&GATHER, "own_height", &[("sum", self.numbers[0])])?;
        self.until_still(self.across(), |routed| {
            let ([pointer, next, _], [low, sum, _]) = (routed.ways, routed.numbers);
            routed.ways.swap(0, 1);
            routed.numbers.swap(0, 1);
            let bound = [("pointer", pointer), ("next", next), ("low", low), ("sum", sum), ("changed", routed.word)];
            routed.pass(&GATHER, "greatest", &bound)
        })?;
        // out of the way of sums
        self.numbers.rotate_left(1);
        Ok(self.numbers[2])
    }

    /// Writes drainage areas and discharges. `start` makes the first pointers.
    fn amounts(
        &mut self,
        wants: &Wants,
        start: impl Fn(&mut Self, ScratchId) -> Result<(), NodeError>,
    ) -> Result<(), NodeError> {
        let cell_m2 = self.job.cell_m() * self.job.cell_m();
        let per_s = cell_m2 / SECONDS_PER_YEAR;
        let (area, discharge) = (wants.area || wants.flow, wants.discharge || wants.flow);
        let constant = match self.job.input("runoff") {
            Some(InputValue::Constant(rate)) => Some(runoff(*rate as f32)),
            Some(InputValue::Value(_)) => None,
            Some(InputValue::Absent) | None => Some(0.0),
        };
        if area || discharge && constant.is_some() {
            start(self, self.ways[0])?;
            self.pass(&GATHER, "ones", &[("sum", self.numbers[0])])?;
            self.until_still(self.across(), |routed| {
                let ([pointer, next, _], [low, sum, _]) = (routed.ways, routed.numbers);
                routed.ways.swap(0, 1);
                routed.numbers.swap(0, 1);
                routed.recorder.clear(sum)?;
                let bound =
                    [("pointer", pointer), ("next", next), ("low", low), ("sum", sum), ("changed", routed.word)];
                routed.pass(&GATHER, "add", &bound)
            })?;
            let from = [("words", self.numbers[0])];
            self.write("amount", &from, &[("area", wants.area, 0), ("flow", wants.flow, 1)], cell_m2)?;
            if let Some(rate) = constant {
                let to = &[("discharge", wants.discharge, 0), ("flow", wants.flow, 2)];
                self.write("amount", &from, to, per_s * rate)?;
            }
        }
        if discharge && constant.is_none() {
            self.runoff(wants, start, per_s)?;
        }
        Ok(())
    }

    /// Writes discharges from a raster of runoff.
    fn runoff(
        &mut self,
        wants: &Wants,
        start: impl Fn(&mut Self, ScratchId) -> Result<(), NodeError>,
        per_s: f64,
    ) -> Result<(), NodeError> {
        self.recorder.clear(self.word)?;
        self.pass(&RUNOFF, "highest", &[("most", self.word)])?;
        let highest = self.recorder.read(self.word, 1)?.first().copied().map_or(0.0, f32::from_bits);
        // the highest is below 2 to the power of `exponent`; sums over all cells have 63 bits at most
        let exponent = (highest.to_bits() >> 23) as i32 - 126;
        let room = u64::BITS - 1 - bits(self.job.window().len());
        let scale = math::exp2(f64::from((room as i32 - exponent).clamp(-100, 100)));
        self.set_factor(scale);
        let mut lows = [self.numbers[0], self.numbers[1]];
        let mut highs = [self.recorder.scratch(Size::Cells)?, self.recorder.scratch(Size::Cells)?];
        self.pass(&RUNOFF, "begin", &[("sum", lows[0]), ("sum_high", highs[0])])?;
        start(self, self.ways[0])?;
        self.until_still(self.across(), |routed| {
            let [pointer, next, _] = routed.ways;
            routed.recorder.clear(lows[1])?;
            routed.recorder.clear(highs[1])?;
            let sums = [("low", lows[0]), ("high", highs[0]), ("sum", lows[1]), ("sum_high", highs[1])];
            routed.pass(&RUNOFF, "add_wide", &[&[("pointer", pointer)][..], &sums].concat())?;
            routed.pass(&FOLLOW, "reach", &[("pointer", pointer), ("next", next), ("changed", routed.word)])?;
            routed.ways.swap(0, 1);
            lows.swap(0, 1);
            highs.swap(0, 1);
            Ok(())
        })?;
        let from = [("words", lows[0]), ("more", highs[0])];
        self.write("wide_amount", &from, &[("discharge", wants.discharge, 0), ("flow", wants.flow, 2)], per_s / scale)
    }

    /// Numbers lakes and writes the numbers.
    fn lakes(&mut self, level: ScratchId) -> Result<(), NodeError> {
        let [first, numbers, _] = self.ways;
        let window = self.job.window();
        let blocks = window.nx().div_ceil(WORKGROUP as usize) * window.ny();
        let tallies = self.recorder.scratch(Size::Words(blocks))?;
        self.pass(&LAKES, "begin", &[("level", level), ("first", first)])?;
        loop {
            for last in 1..=JOINS {
                if last == JOINS {
                    self.recorder.clear(self.word)?;
                }
                self.pass(&LAKES, "join", &[("first", first), ("changed", self.word)])?;
                self.pass(&LAKES, "shorten", &[("first", first)])?;
                self.pass(&LAKES, "shorten", &[("first", first)])?;
            }
            if self.recorder.read(self.word, 1)? == [0] {
                break;
            }
        }
        self.pass(&LAKES, "tally", &[("first", first), ("tallies", tallies)])?;
        self.recorder.pass(&Pass {
            shader: &LAKES,
            entry: "sum_up",
            bind: &[("tallies", Bind::Scratch(tallies))],
            values: &self.values,
            over: Over::Groups([1; 3]),
        })?;
        self.pass(&LAKES, "number", &[("first", first), ("tallies", tallies), ("numbers", numbers)])?;
        let from = [("words", first), ("more", numbers)];
        self.write("lake", &from, &[("lake", true, 0)], 1.0)
    }

    /// Writes planes of outputs, each if it is wanted, by an entry point of [`WRITE`].
    fn write(
        &mut self,
        entry: &'static str,
        from: &[(&'static str, ScratchId)],
        to: &[(&'static str, bool, usize)],
        each: f64,
    ) -> Result<(), NodeError> {
        self.set_factor(each);
        for &(output, _, plane) in to.iter().filter(|(_, wanted, _)| *wanted) {
            let mut bind: Vec<_> = from.iter().map(|&(name, id)| (name, Bind::Scratch(id))).collect();
            bind.push(("plane", Bind::Output(output, plane)));
            let over = Over::Cells(Rows::All);
            self.recorder.pass(&Pass { shader: &WRITE, entry, bind: &bind, values: &self.values, over })?;
        }
        Ok(())
    }
}
