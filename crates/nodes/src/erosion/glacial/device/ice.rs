//! The buffers and passes of ice on a device.

use orograph_graph::gpu::{ScratchId, Size};

use super::{
    super::{
        climate::{Climate, Layer, PER_DEGREE, TABLE_C},
        glacier::Glacier,
        grid::Grid,
        march::{Flowing, Ledger},
        sheet::{Change, ROUNDS, Sheet},
    },
    ACCEPT, BALANCE, BOOK, CHANGE, FACES, LINES, SIDES, VALUES,
};
use crate::{
    numbers::{Numbers, side},
    numerics::{ledger, par},
    prelude::*,
    wgsl,
};

/// Ice on a device, which flows on a bed that the host changes between two marches.
pub(super) struct DeviceIce {
    grid: Grid,
    /// The height from which the ground is measured, so that small differences of high ground keep their digits.
    datum_m: f64,
    values: Numbers,
    bed: ScratchId,
    thickness: ScratchId,
    next: ScratchId,
    balance: ScratchId,
    delta: ScratchId,
    ends: ScratchId,
    ratio: ScratchId,
    /// Flux, gain and loss of west and of north faces.
    faces: [[ScratchId; 3]; 2],
    found: ScratchId,
    /// What each cell has gained, what melted there and what left the world, since the start of the march.
    book: ScratchId,
    /// The sums of the rows of these.
    sums: ScratchId,
    levels: ScratchId,
    rainfall: ScratchId,
    lapse_rates: ScratchId,
    table: ScratchId,
}

impl DeviceIce {
    /// Reserves the buffers; there is no ice yet.
    pub fn new(glacier: &Glacier, sheet: &Sheet, recorder: &mut dyn Recorder) -> Result<Self, NodeError> {
        let grid = glacier.grid;
        let (nx, ny) = (grid.nx, grid.ny);
        let empty = Layer::Constant(0.0);
        let (levels, rainfall, lapse_rates, table) = match &glacier.climate {
            Climate::Ela { ela, .. } => (ela, &empty, &empty, vec![0.0]),
            Climate::Temperature { temperature, precipitation, lapse_rate, snow, melt } => {
                (temperature, precipitation, lapse_rate, snow.iter().chain(melt).copied().collect())
            }
        };
        let entries = table.len() / 2;
        let mut values = Numbers::new(VALUES);
        for (name, value) in [
            ("k_nx", nx as u32),
            ("k_ny", ny as u32),
            ("k_level_step", step(levels)),
            ("k_rain_step", step(rainfall)),
            ("k_lapse_step", step(lapse_rates)),
            ("k_entries", entries as u32),
        ] {
            values.put(name, Scalar::U32(value));
        }
        for (name, edge) in ["side_west", "side_east", "side_north", "side_south"].into_iter().zip(grid.edges) {
            values.put(name, side(edge));
        }
        let datum_m = (glacier.start.iter().sum::<f64>() / grid.len() as f64).round();
        for (name, value) in [
            ("k_dx", grid.cell_m[0]),
            ("k_dy", grid.cell_m[1]),
            ("k_deformation", sheet.rheology.deformation),
            ("k_sliding", sheet.rheology.sliding),
            ("k_yield", sheet.rheology.yield_m),
            ("k_coldest", TABLE_C[0]),
            ("k_per_degree", PER_DEGREE),
            ("k_datum", datum_m),
        ] {
            values.put(name, Scalar::F32(value as f32));
        }
        let padded = grid.padded_len();
        let mut words = |count: usize| recorder.scratch(Size::Words(count));
        let faces = [(nx + 1) * ny, nx * (ny + 1)];
        let [across, down] = faces
            .map(|count| -> Result<[ScratchId; 3], NodeError> { Ok([words(count)?, words(count)?, words(count)?]) });
        let ice = Self {
            grid,
            datum_m,
            values,
            bed: words(padded)?,
            thickness: words(padded)?,
            next: words(nx * ny)?,
            balance: words(nx * ny)?,
            delta: words(nx * ny)?,
            ends: words(nx * ny)?,
            ratio: words(nx * ny)?,
            faces: [across?, down?],
            found: words(2)?,
            book: words(3 * nx * ny)?,
            sums: words(3 * ny)?,
            levels: recorder.table(&bits(levels))?,
            rainfall: recorder.table(&bits(rainfall))?,
            lapse_rates: recorder.table(&bits(lapse_rates))?,
            table: recorder.table(&table.iter().map(|value| (*value as f32).to_bits()).collect::<Vec<u32>>())?,
        };
        recorder.clear(ice.thickness)?;
        Ok(ice)
    }

    /// Begins a march on the bed of a sheet, whose ice is that of the last march.
    pub fn begin(&mut self, recorder: &mut dyn Recorder, sheet: &Sheet, shift_m: f64) -> Result<(), NodeError> {
        self.values.put("k_shift", Scalar::F32(shift_m as f32));
        let bed = par::map_of(&sheet.bed, |level| ((level - self.datum_m) as f32).to_bits());
        recorder.write(self.bed, &bed)?;
        recorder.clear(self.book)?;
        self.surround(recorder)
    }

    /// Ends a march: the sheet gets its ice and fluxes, the ledger its sums.
    pub fn end(&self, recorder: &mut dyn Recorder, sheet: &mut Sheet, sums: &mut Ledger) -> Result<(), NodeError> {
        let Grid { nx, ny, .. } = self.grid;
        let thickness = recorder.read(self.thickness, self.grid.padded_len())?;
        let east = recorder.read(self.faces[0][0], (nx + 1) * ny)?;
        let south = recorder.read(self.faces[1][0], nx * (ny + 1))?;
        sheet.take([&thickness, &east, &south]);
        let bind = [("book", self.book), ("sums", self.sums)];
        self.pass(recorder, (&BOOK, "main"), &bind, Over::Groups([ny as u32, 3, 1]))?;
        let rows = recorder.read(self.sums, 3 * ny)?;
        let mut of = rows.chunks(ny).map(|part| ledger::sums(part, |metres| [metres])[0]);
        let mut sum = || of.next().unwrap_or_default();
        (sums.gained_m, sums.melted_m, sums.left_m) = (sum(), sum(), sum());
        Ok(())
    }

    fn pass(
        &self,
        recorder: &mut dyn Recorder,
        (shader, entry): (&'static Shader, &'static str),
        bind: &[(&'static str, ScratchId)],
        over: Over,
    ) -> Result<(), NodeError> {
        let bind: Vec<(&'static str, Bind)> = bind.iter().map(|&(name, id)| (name, Bind::Scratch(id))).collect();
        recorder.pass(&Pass { shader, entry, bind: &bind, values: &self.values, over })
    }

    /// Cells of the ice grid, and so many columns and rows more.
    const fn cells(&self, more: [u32; 2]) -> Over {
        Over::Array([self.grid.nx as u32 + more[0], self.grid.ny as u32 + more[1]])
    }

    /// Sets what lies beyond the sides.
    fn surround(&self, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
        let bind = [("bed", self.bed), ("thickness", self.thickness)];
        self.pass(recorder, (&SIDES, "beside"), &bind, Over::Array([self.grid.ny as u32, 1]))?;
        self.pass(recorder, (&SIDES, "above"), &bind, Over::Array([self.grid.stride() as u32, 1]))
    }

    /// A pass of [`CHANGE`].
    fn change(&self, recorder: &mut dyn Recorder, entry: &'static str, more: [u32; 2]) -> Result<(), NodeError> {
        let bind = [
            ("thickness", self.thickness),
            ("east", self.faces[0][0]),
            ("south", self.faces[1][0]),
            ("balance", self.balance),
            ("delta", self.delta),
            ("next", self.next),
            ("found", self.found),
        ];
        self.pass(recorder, (&CHANGE, entry), &bind, self.cells(more))
    }

    /// The fluxes along x (0) or y (1).
    fn flow(&self, recorder: &mut dyn Recorder, along: usize) -> Result<(), NodeError> {
        let [flux, gain, loss] = self.faces[along];
        let bind = [("bed", self.bed), ("thickness", self.thickness), ("flux", flux), ("gain", gain), ("loss", loss)];
        let more = [[1, 0], [0, 1]][along];
        self.pass(recorder, (&FACES, "main"), &bind, self.cells(more))
    }

    /// The systems along x (0) or y (1).
    fn solve(&self, recorder: &mut dyn Recorder, along: usize) -> Result<(), NodeError> {
        let [flux, gain, loss] = self.faces[along];
        let bind = [
            ("gain", gain),
            ("loss", loss),
            ("delta", self.delta),
            ("ends", self.ends),
            ("ratio", self.ratio),
            ("flux", flux),
        ];
        let lines = [self.grid.ny, self.grid.nx][along] as u32;
        self.pass(recorder, (&LINES, "lines"), &bind, Over::Groups([lines.div_ceil(wgsl::LINES_TOGETHER), 1, 1]))
    }

    /// Sets the direction of what is recorded next.
    fn turn(&mut self, along: usize, dt_yr: f64) {
        self.values.put("k_columns", Scalar::U32(along as u32));
        self.values.put("k_scale", Scalar::F32((dt_yr / self.grid.cell_m[along]) as f32));
    }
}

/// Ice during a march.
pub(super) struct Marching<'a> {
    pub ice: &'a mut DeviceIce,
    pub recorder: &'a mut dyn Recorder,
}

impl Marching<'_> {
    /// The thickness after the step: the greatest change, and whether a cell is overdrawn.
    fn apply(&mut self) -> Result<(f64, bool), NodeError> {
        self.recorder.clear(self.ice.found)?;
        self.ice.change(self.recorder, "apply", [0, 0])?;
        let found = self.recorder.read(self.ice.found, 2)?;
        let at = |k: usize| found.get(k).copied().unwrap_or_default();
        Ok((f64::from(f32::from_bits(at(0))), at(1) != 0))
    }
}

impl Flowing for Marching<'_> {
    fn renew(&mut self, _: f64) -> Result<(), NodeError> {
        let ice = &self.ice;
        let bind = [
            ("bed", ice.bed),
            ("thickness", ice.thickness),
            ("levels", ice.levels),
            ("rainfall", ice.rainfall),
            ("lapse_rates", ice.lapse_rates),
            ("table", ice.table),
            ("balance", ice.balance),
        ];
        ice.pass(self.recorder, (&BALANCE, "main"), &bind, ice.cells([0, 0]))
    }

    fn attempt(&mut self, dt_yr: f64) -> Result<Change, NodeError> {
        let [over_x, over_y] = self.ice.grid.cell_m.map(|cell_m| (dt_yr / cell_m) as f32);
        for (name, value) in [("k_dt", dt_yr as f32), ("k_over_x", over_x), ("k_over_y", over_y)] {
            self.ice.values.put(name, Scalar::F32(value));
        }
        for along in [1, 0] {
            self.ice.turn(along, dt_yr);
            self.ice.flow(self.recorder, along)?;
        }
        self.ice.change(self.recorder, "begin", [0, 0])?;
        for along in [0, 1] {
            self.ice.turn(along, dt_yr);
            self.ice.solve(self.recorder, along)?;
        }
        // a first round does nothing where no cell is overdrawn, and few steps have none
        let mut most_m = 0.0;
        for round in 1..=ROUNDS {
            self.ice.values.put("k_last", Scalar::U32(u32::from(round == ROUNDS)));
            self.ice.change(self.recorder, "limit", [0, 0])?;
            self.ice.change(self.recorder, "give", [1, 1])?;
            let is_overdrawn;
            (most_m, is_overdrawn) = self.apply()?;
            if !is_overdrawn {
                break;
            }
        }
        Ok(Change { most_m, ..Change::default() })
    }

    fn accept(&mut self) -> Result<(), NodeError> {
        let ice = &self.ice;
        let bind = [
            ("next", ice.next),
            ("thickness", ice.thickness),
            ("balance", ice.balance),
            ("east", ice.faces[0][0]),
            ("south", ice.faces[1][0]),
            ("book", ice.book),
        ];
        ice.pass(self.recorder, (&ACCEPT, "main"), &bind, ice.cells([0, 0]))?;
        ice.surround(self.recorder)
    }
}

/// The samples of a layer: one if it is a constant.
fn bits(layer: &Layer) -> Vec<u32> {
    match layer {
        Layer::Constant(value) => vec![(*value as f32).to_bits()],
        Layer::Cells(cells) => cells.iter().map(|value| value.to_bits()).collect(),
    }
}

/// From the sample of a cell to that of the next.
const fn step(layer: &Layer) -> u32 {
    match layer {
        Layer::Constant(_) => 0,
        Layer::Cells(_) => 1,
    }
}
