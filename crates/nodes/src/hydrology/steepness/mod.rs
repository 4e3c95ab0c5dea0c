//! Channel steepness, chi and the length of rivers.
//!
//! Chi is the integral of Perron and Royden (2013). Steepness is the fall along a reach over the growth of its chi, which
//! is less scattered than the slope of single cells (Wobus et al. 2006).

mod profile;
#[cfg(test)]
mod tests;

use orograph_graph::memory::zeroed;

use crate::{
    numerics::{
        drained::Drained,
        math, par,
        routing::{
            Drainage, Grid,
            code::{self, has_receiver},
            donors,
        },
    },
    prelude::*,
};

params! {
    /// Concavity of rivers in balance: their slope falls with this power of the drainage area.
    concavity: f64 = 0.45, One, 0.0..=2.0, soft 0.2..=0.8;
    /// Drainage area above which there is a channel.
    channel_area: f64 = 1e6, SquareMetres, 0.0..=1e15, soft 1e4..=1e8;
    /// Length of the reach along which steepness is measured, half of it to either side.
    reach: f64 = 1000.0, Metres, 0.0..=1e6, soft 100.0..=10000.0;
    /// Drainage area at which chi grows by a metre per metre of river.
    reference_area: f64 = 1e6, SquareMetres, 1.0..=1e15, soft 1.0..=1e8;
    /// Height above which chi grows, so that basins can be compared from one height. By default it grows everywhere.
    base: f64 = -12_000.0, Metres, -12_000.0..=1e4, soft -100.0..=3000.0;
    /// Gives hillslopes the steepness and chi of the channel below them; otherwise they have 0.
    hillslopes: bool = true, One, ..;
}

inputs! {
    /// Where water runs, from `Flow`.
    flow: Flow;
}

outputs! {
    /// Steepness of the channel: slope times drainage area to the power of `concavity`, both in metres.
    steepness: Scalar(One);
    /// Chi of the channel: the integral of (`reference_area` / drainage area) to the power of `concavity`, upstream.
    chi: Scalar(Metres);
    /// Length of the way of the water from each cell to where it leaves the world.
    distance: Scalar(Metres);
    /// Quantiles of the steepness, and the profile of the largest river, along its length and along chi.
    report: Report;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Steepness",
    category: "hydrology",
    summary: "Channel steepness and chi: where rivers are steep for the area they drain, and where divides move.",
    doc: include_str!("page.md"),
    sources: &[
        "C. Wobus et al. (2006), Tectonics from topography: procedures, promise, and pitfalls, GSA Special Paper 398, 55-74",
        "J. T. Perron and L. Royden (2013), An integral approach to bedrock river profile analysis, Earth Surface Processes \
         and Landforms 38, 570-576",
        "S. D. Willett, S. W. McCoy, J. T. Perron, L. Goren and C.-Y. Chen (2014), Dynamic reorganization of river basins, \
         Science 343, 1248765",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    resolution: Resolution::Cells(
        "a channel is one cell wide, and longer where more of its bends show in smaller cells",
    ),
    example: "flow: \"flow.flow\", channel_area: 500000",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    // tables of the quantiles
    const TABLES: u64 = 1_600_000;
    let wants = Wants::among(sizing.wanted);
    let when = |is: bool, bytes: f64| if is { bytes } else { 0.0 };
    // receivers, the order of cells, weights
    let held = 1.0 + 7.0 + 4.0;
    let [steepness, chi, distance] = [wants.steepness, wants.chi, wants.distance].map(|is| when(is, 4.0));
    // the largest donors and the steepness; for the report that of the channels too, and in order
    let measured = when(wants.steepness || wants.report, 8.0) + when(wants.report, 8.0);
    // a sum in double precision beside the results
    let summed = steepness + when(wants.chi || wants.distance, 8.0) + chi + distance;
    let peak = held + measured.max(summed);
    sizing.cells(peak - steepness - chi - distance) + if wants.report { TABLES } else { 0 }
}

/// Marks a channel cell without a channel above it.
const NONE: u32 = u32::MAX;

/// The channels of a landscape.
struct Channels<'a> {
    grid: &'a Grid,
    drained: &'a Drained<'a>,
    codes: &'a [u8],
    cell_m: f64,
    /// (Reference area / drainage area) to the power of the concavity in channels, 0 elsewhere.
    weights: Vec<f32>,
}

impl Channels<'_> {
    fn has(&self, cell: usize) -> bool {
        self.weights[cell] > 0.0
    }

    /// Length of the link from a cell to its receiver.
    fn length_m(&self, link: u8) -> f64 {
        self.cell_m * code::length(link)
    }

    /// Returns the channel cell with the largest area that drains into each channel cell; the first of equal ones.
    fn donors(&self, job: &Job<'_>) -> Result<Vec<u32>, NodeError> {
        let Self { grid, codes, drained, .. } = self;
        let mut donors = zeroed(grid.cells())?;
        par::each(donors.chunks_mut(grid.nx), |y, donors: &mut [u32]| {
            job.check()?;
            for (x, donor) in donors.iter_mut().enumerate() {
                let cell = (y * grid.nx + x) as u32;
                let channels =
                    donors::of(grid, codes, cell).map(|(_, from)| from).filter(|&from| self.has(from as usize));
                let area = |from: u32| drained.area_m2[from as usize];
                let largest = channels.reduce(|most, from| if area(from) > area(most) { from } else { most });
                *donor = largest.filter(|_| self.has(cell as usize)).unwrap_or(NONE);
            }
            Ok::<_, NodeError>(())
        })?;
        Ok(donors)
    }

    /// Returns the steepness of a channel cell, times the power of the reference area: the fall along the reach around
    /// it over the growth of chi.
    fn steepness(&self, donors: &[u32], cell: usize, half_m: f64) -> f64 {
        let level = |cell: usize| f64::from(self.drained.level_m[cell]);
        let (mut low, mut length_m, mut chi) = (cell, 0.0, 0.0);
        // a channel has a slope even if the reach is shorter than a link
        while has_receiver(self.codes[low]) && (length_m < half_m || chi == 0.0) {
            let link = self.length_m(self.codes[low]);
            length_m += link;
            chi += link * f64::from(self.weights[low]);
            low = self.grid.receiver(low as u32, self.codes[low]) as usize;
            if !self.has(low) {
                break;
            }
        }
        let (mut high, mut length_m) = (cell, 0.0);
        while donors[high] != NONE && (length_m < half_m || chi == 0.0) {
            high = donors[high] as usize;
            let link = self.length_m(self.codes[high]);
            length_m += link;
            chi += link * f64::from(self.weights[high]);
        }
        if chi > 0.0 { (level(high) - level(low)) / chi } else { 0.0 }
    }
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let (params, wants) = (Params::read(job.params), Wants::of(job));
    let grid = Grid::new(&job.window())?;
    let drained = Drained::read(Inputs::read(job)?.flow);
    let codes = drained.codes(&grid);
    let mut drainage = Drainage::default();
    drainage.accumulate(job, &grid, &codes, &mut vec![1_u32; grid.cells()])?;
    job.advance(0.3)?;

    let weights = par::map(grid.cells(), |cell| {
        let area_m2 = f64::from(drained.area_m2[cell]);
        let is_channel = area_m2 > params.channel_area;
        if is_channel { math::exp(params.concavity * math::ln(params.reference_area / area_m2)) as f32 } else { 0.0 }
    });
    if !par::any(&weights, |weight| *weight > 0.0) {
        job.warn("no cell drains more than `channel_area`, so there is no steepness and no chi".to_owned());
    }
    let channels = Channels { grid: &grid, drained: &drained, codes: &codes, cell_m: job.cell_m(), weights };
    // on hillslopes as wished, and 0 in cells that drain to no channel
    let shown = |cell: usize| params.hillslopes || channels.has(cell);
    let field = |samples| Field::new(job.window(), samples);

    let mut report = None;
    let steepness = if wants.steepness || wants.report {
        let donors = channels.donors(job)?;
        // slope times the power of the area: chi has that of the reference area
        let per = math::exp(params.concavity * math::ln(params.reference_area));
        let mut values = zeroed(grid.cells())?;
        par::rows_within(job, [0.3, 0.6], &mut values, |y, row: &mut [f32]| {
            for (x, value) in row.iter_mut().enumerate() {
                let cell = y * grid.nx + x;
                if channels.has(cell) {
                    *value = (per * channels.steepness(&donors, cell, 0.5 * params.reach)) as f32;
                }
            }
        })?;
        report = wants.report.then(|| profile::report(&channels, &donors, &values, params.base));
        drop(donors);
        if params.hillslopes && wants.steepness {
            let link = |cell: usize, _, own, below| if channels.has(cell) { own } else { below };
            drainage.upstream(job, &grid, &codes, &mut values, link)?;
        }
        wants.steepness.then(|| field(values))
    } else {
        None
    };
    job.advance(0.6)?;

    let summed = |step: &(dyn Fn(usize, f64) -> f64 + Sync), shown: &(dyn Fn(usize) -> bool + Sync)| {
        let mut sums: Vec<f64> = zeroed(grid.cells())?;
        let link = |cell: usize, code: u8, _, below: f64| below + step(cell, channels.length_m(code));
        drainage.upstream(job, &grid, &codes, &mut sums, link)?;
        Ok::<_, NodeError>(field(par::map(sums.len(), |cell| if shown(cell) { sums[cell] as f32 } else { 0.0 })))
    };
    let grows = |cell: usize| f64::from(drained.level_m[cell]) > params.base;
    let chi = |cell: usize, length_m: f64| {
        if grows(cell) { length_m * f64::from(channels.weights[cell]) } else { 0.0 }
    };
    let chi = wants.chi.then(|| summed(&chi, &shown)).transpose()?;
    if chi.as_ref().is_some_and(|chi: &Field| chi.samples().iter().all(|chi| *chi == 0.0)) && params.base > -12_000.0 {
        job.warn("no channel is higher than `base`, so chi is 0 everywhere".to_owned());
    }
    job.advance(0.8)?;
    let distance = wants.distance.then(|| summed(&|_, length_m| length_m, &|_| true)).transpose()?;
    Ok(Given { steepness, chi, distance, report }.into())
}
