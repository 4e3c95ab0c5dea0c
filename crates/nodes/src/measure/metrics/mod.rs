//! Measures of terrain: elevations, slopes, forms, drainage, and the marks of a computation.

mod drainage;
mod elevation;
mod fit;
mod forms;
mod land;
mod measures;
mod network;
mod order;
mod orders;
mod peaks;
mod relief;
mod slope;
mod spectrum;
mod steepness;
mod texture;
mod valleys;

pub use self::measures::MEASURES;
use self::network::Network;
pub(super) use self::{elevation::Elevations, land::Land, slope::slopes};
use crate::{
    numerics::{par, voids},
    prelude::*,
};
use orograph_graph::memory::copied;

params! {
    /// Drainage area from which a cell counts as a channel. Rivers begin at ten times as much.
    channel_area: f64 = 1e5, SquareMetres, 1.0..=1e12, soft 1e4..=1e7;
    /// Drainage area times squared slope from which a cell counts as a channel by slope.
    channel_constant: f64 = 2000.0, SquareMetres, 0.0..=1e12, soft 100.0..=10000.0;
    /// Side of the windows in which local relief is measured.
    local_window: f64 = 2500.0, Metres, 1.0..=1e6, soft 500.0..=10000.0;
    /// Least prominence of a peak.
    prominence: f64 = 100.0, Metres, 0.0..=1e5, soft 10.0..=500.0;
}

inputs! {
    /// Terrain height.
    height: Height;
    /// Where to measure: cells below 0.5 are left out.
    mask: Option<Mask>;
    /// Where the terrain is known, such as `Import.data`. Cells below 0.5 are voids, where water leaves.
    data: Option<Mask>;
}

outputs! {
    /// Measures, curves and histograms.
    report: Report;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Metrics",
    version: 2,
    migrations: &[Migration { from: 1, steps: &[] }],
    category: "measure",
    summary: "Measures of a landscape: hypsometry, relief, slopes, forms, peaks, rivers, valleys, spectrum.",
    doc: include_str!("page.md"),
    sources: &[
        "A. N. Strahler, 1952, Hypsometric (area-altitude) analysis of erosional topography, GSA Bulletin 63, 1117-1142",
        "R. E. Horton, 1945, Erosional development of streams and their drainage basins, GSA Bulletin 56, 275-370",
        "S. A. Schumm, 1956, Evolution of drainage systems and slopes in badlands at Perth Amboy, New Jersey, GSA \
         Bulletin 67, 597-646",
        "J. T. Hack, 1957, Studies of longitudinal stream profiles in Virginia and Maryland, USGS Professional Paper 294-B",
        "J. T. Perron, L. Royden, 2013, An integral approach to bedrock river profile analysis, Earth Surf. Process. \
         Landforms 38, 570-576",
        "J. Jasiewicz, T. F. Stepinski, 2013, Geomorphons: a pattern recognition approach to classification and mapping \
         of landforms, Geomorphology 182, 147-156",
        "P. D. Zimmer, E. J. Gabet, 2018, Assessing glacial modification of bedrock valleys using a novel approach, \
         Geomorphology 318, 336-347",
        "B. K. P. Horn, 1981, Hill shading and the reflectance map, Proceedings of the IEEE 69, 14-47",
        "D. R. Montgomery, W. E. Dietrich, 1992, Channel initiation and the problem of landscape scale, Science 255, 826-830",
        "S. Hergarten, J. Robl, K. Stüwe, 2016, Tectonic geomorphology at small catchment sizes - extensions of the \
         stream-power approach and the χ method, Earth Surface Dynamics 4, 1-9",
        "H. Svensson, 1959, Is the cross-section of a glacial valley a parabola?, J. Glaciology 3, 362-363",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    reads_sea: true,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    measures: MEASURES,
    resolution: Resolution::Cells("slopes and channels are measured between cells"),
    example: "height: \"base\", channel_area: 500000",
    ..Node::DEFAULT
};

/// Rivers begin at this many times `channel_area`, and at this many cells.
const RIVERS: [f64; 2] = [10.0, 30.0];

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let has_voids = sizing.is_wired(Inputs::PORTS, "data");
    let is_cut = sizing.is_wired(Inputs::PORTS, "mask") || sizing.window.world.sea_level.is_some();
    let known = if has_voids { sizing.cells(4.0) } else { 0 };
    bytes(sizing.window.len(), sizing.window.cell_m(), &Params::read(sizing.params), is_cut) + known
}

/// Bytes for the measures of that many cells; `is_cut` is true if some of them may be left out.
pub(super) fn bytes(cells: usize, cell_m: f64, params: &Params, is_cut: bool) -> u64 {
    // tables that do not depend on the terrain
    const TABLES: f64 = 1_450_000.0;
    // the order and the routing of all cells, basins, and the heights if some are left out
    let all = if is_cut { 33.0 } else { 29.0 };
    // the trees of rivers: the smaller the area at which rivers begin, the more cells belong to them
    let least = (RIVERS[0] * params.channel_area / (cell_m * cell_m)).max(RIVERS[1]);
    let rivers = 24.0 * RIVERS[1] / least;
    (TABLES + cells as f64 * (all + rivers)) as u64
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let inputs = Inputs::read(job)?;
    let height = match inputs.data {
        Some(data) => &known(inputs.height, data)?,
        None => inputs.height,
    };
    let mut report = metrics(job, height, inputs.mask, &Params::read(job.params))?;
    if inputs.mask.is_some() {
        report.notes.push("water flows outside of the mask too: basins are those of all ground".to_owned());
    }
    Ok(Given { report: Some(report) }.into())
}

/// Returns the heights, with NaN where the terrain is not known.
fn known(height: &Field, data: &Field) -> Result<Field, NodeError> {
    let mut samples = copied(height.plane(0))?;
    par::change_with(&mut samples, data.plane(0), |height, &data| {
        if voids::is_void(data) {
            *height = f32::NAN;
        }
    });
    Ok(Field::new(*height.window(), samples))
}

/// Measures a heightfield over the job's window.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn metrics(job: &Job<'_>, height: &Field, mask: Option<&Field>, params: &Params) -> Result<Report, NodeError> {
    let mut report = Report::default();
    let check = || job.check();
    put(&mut report, "cell_size", height.window().cell_m());
    let land = Land::of(height, mask);
    share(&land, &mut report);
    elevation::measure(&land, &mut report);
    relief::measure(&land, params.local_window, &mut report);
    job.advance(0.1)?;
    let slopes = slope::slopes(&land, &check)?;
    slope::measure(&slopes, &mut report);
    drop(slopes);
    slope::aspects(&land, &mut report);
    job.advance(0.2)?;
    let slope_p50 = report.get("slope.p50").unwrap_or(f64::NAN);
    // Water and peaks follow one cell after the other; the others leave processors to them.
    let (surface, [peaks, water]) =
        par::both(|| surface(&land, slope_p50, params, &check), || streams(job, &land, params));
    for part in [surface, peaks, water] {
        extend(&mut report, part?);
    }
    Ok(report)
}

/// Texture, spectrum and forms.
fn surface(
    land: &Land<'_>,
    slope_p50: f64,
    params: &Params,
    check: &dyn Fn() -> Result<(), NodeError>,
) -> Result<Report, NodeError> {
    let mut report = Report::default();
    texture::measure(land, slope_p50, &mut report);
    texture::positions(land, params.local_window, &mut report);
    check()?;
    spectrum::measure(land, &mut report);
    check()?;
    forms::measure(land, &mut report);
    Ok(report)
}

/// Peaks, and all that follows the way of water.
fn streams(job: &Job<'_>, land: &Land<'_>, params: &Params) -> [Result<Report, NodeError>; 2] {
    let order = order::from_the_top(land.height.plane(0));
    let peaks = || {
        let mut report = Report::default();
        peaks::measure(land, &order, params, &mut report, &|| job.check()).map(|()| report)
    };
    let (water, peaks) = par::both(|| water(job, land, &order, params), peaks);
    [peaks, water]
}

/// All that follows the way of water.
fn water(job: &Job<'_>, land: &Land<'_>, order: &[u32], params: &Params) -> Result<Report, NodeError> {
    let network = Network::of(land, order, &|| job.check())?;
    job.advance(0.7)?;
    let cell_m2 = land.cell_m() * land.cell_m();
    let river_m2 = (RIVERS[0] * params.channel_area).max(RIVERS[1] * cell_m2);
    let channels = || {
        let mut report = Report::default();
        let orders = orders::orders(&network, river_m2);
        drainage::pits(land, &network, &mut report);
        drainage::density(land, &network, params, &mut report);
        drainage::marks(land, &network, river_m2, &mut report);
        drainage::basins(land, &network, &orders, &mut report);
        orders::horton(land, &network, &orders, &mut report);
        report
    };
    let rivers = || {
        let mut report = Report::default();
        orders::hack(land, &network, river_m2, &mut report);
        steepness::measure(land, &network, river_m2, &mut report);
        steepness::chi(&network, river_m2, &mut report);
        let trunks = network.trunks();
        drainage::profile(land, &network, &trunks, river_m2, &mut report);
        valleys::measure(land, &network, &trunks, &mut report);
        report
    };
    let (mut report, rivers) = par::both(channels, rivers);
    job.advance(0.95)?;
    extend(&mut report, rivers);
    Ok(report)
}

/// Adds the parts of another report.
fn extend(report: &mut Report, part: Report) {
    report.measures.extend(part.measures);
    report.series.extend(part.series);
    report.notes.extend(part.notes);
}

/// The share of land, in a world with a sea.
fn share(land: &Land<'_>, report: &mut Report) {
    let Some(sea_m) = land.sea_m else { return };
    let cells = land.height.window().len() as u64;
    put(report, "sea_level", sea_m);
    put(report, "land_share", (cells - land.sea_cells) as f64 / cells as f64);
    if land.sea_cells == cells {
        report.notes.push("all of it lies below the sea".to_owned());
    }
}

/// Adds a measure, with the unit of its declaration.
fn put(report: &mut Report, name: &str, value: f64) {
    let unit = MEASURES.iter().find(|measure| measure.name == name).map_or("", |measure| measure.unit);
    report.measure(name, value, unit);
}

/// Returns a histogram of the samples; those for which `bin` returns None are not counted.
fn histogram(samples: &[f32], bins: usize, bin: impl Fn(f32) -> Option<usize> + Sync) -> Vec<u64> {
    let count = |_, part: &[f32]| {
        let mut counts = vec![0_u64; bins];
        part.iter().filter_map(|&sample| bin(sample)).for_each(|bin| counts[bin] += 1);
        counts
    };
    let parts = par::collect_all(samples.chunks(1 << 16), count);
    (0..bins).map(|bin| parts.iter().map(|counts| counts[bin]).sum()).collect()
}

#[cfg(test)]
mod tests;
