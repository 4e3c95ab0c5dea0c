//! Compare: how far a terrain is from a reference or a kind of real terrain, and how real it looks by numbers.

mod curves;
mod distributions;
mod kinds;
mod measures;
mod real;
mod reference;
mod score;

use std::path::PathBuf;

use orograph_graph::{Cancel, LevelJob, Series, Wanted, Warnings, World};

use self::measures::COMPARED;
pub use self::{
    curves::POINTS,
    kinds::{Kind, Span},
    measures::MEASURES,
    real::{Real, Tile},
    reference::Reference,
    score::{Part, Score},
};
use super::metrics::{self, Land};
use crate::{
    prelude::*,
    raster::{GridAxis, resample},
};

params! {
    /// Kind of terrain to compare with, unless a reference is wired.
    kind: Kind = Kind::None, One, ..;
}

inputs! {
    /// Terrain height.
    height: Height;
    /// Terrain to compare with.
    reference: Option<Height>;
}

outputs! {
    /// The realism score with its parts, and the distance of each measure.
    report: Report;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Compare",
    version: 2,
    migrations: &[Migration { from: 1, steps: &[] }],
    category: "measure",
    summary: "A score of realism, and the distance from real terrain in units of its natural spread.",
    doc: include_str!("page.md"),
    sources: &[
        "O. Argudo, E. Galin, A. Peytavie, A. Paris, J. Gain, E. Guérin, 2019, Orometry-based terrain analysis and \
         synthesis, ACM Trans. Graph. 38(6)",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    reads_sea: true,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    measures: MEASURES,
    resolution: Resolution::Cells("terrain is measured at cells of 90 m"),
    example: "height: \"base\", kind: fluvial",
    ..Node::DEFAULT
};

/// Cells at which terrain is compared, in metres, and the largest and the smallest that are left as they are.
const CELL_M: f64 = 90.0;
const LEFT_M: [f64; 2] = [75.0, 105.0];

/// Memory that the kernel needs in addition to its inputs and outputs: a terrain at the cells of the comparison, and the
/// rows that averaging has narrowed or the measures.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let (cell_m, has_sea) = (sizing.window.cell_m(), sizing.window.world.sea_level.is_some());
    let params = metrics::Params::read(&defaults());
    let measured = |cells: usize, cell_m: f64| metrics::bytes(cells, cell_m, &params, has_sea);
    if cell_m >= LEFT_M[0] {
        return measured(sizing.window.len(), cell_m);
    }
    let share = cell_m / CELL_M;
    let averaged = (sizing.window.len() as f64 * share * share) as usize;
    4 * averaged as u64 + measured(averaged, CELL_M).max(sizing.cells(4.0 * share))
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let (inputs, params) = (Inputs::read(job)?, Params::read(job.params));
    let mut report = Report::default();
    let (land, note) = averaged(inputs.height, &|| job.check())?;
    report.notes.extend(note);
    let measured = measures(&land, &job.cancel)?;
    job.advance(0.5)?;
    let score = Score::of(&measured);
    if score.least().is_nan() {
        report.notes.push("too small for a score: it needs slopes, rivers and valleys".to_owned());
    }
    let values = [score.least(), score.parts[0], score.parts[1], score.parts[2]];
    for (spec, value) in MEASURES.iter().zip(values) {
        report.measure(spec.name, value, spec.unit);
    }
    match inputs.reference {
        None => {
            distances(&measured, &mut report, |name| params.kind.natural(name));
            let models = params.kind.beside().iter();
            let beside = models.flat_map(|model| curves::of(model).iter().map(|curve| curve.clone().of(model)));
            beside_each_other(&measured, beside.collect(), &mut report);
        }
        Some(reference) => {
            let reference = Reference::of(reference, &job.cancel)?;
            let beside = reference.own.series.iter().map(|curve| curve.clone().of("reference"));
            beside_each_other(&measured, beside.collect(), &mut report);
            report.notes.extend(reference.note.clone());
            distances(&measured, &mut report, |name| reference.natural(name));
            distributions::measure(&Land::of(&land, None), &Land::of(&reference.land, None), &mut report);
        }
    }
    Ok(Given { report: Some(report) }.into())
}

/// Adds the distance of each measure from its natural middle, in natural spreads.
fn distances(measured: &Report, report: &mut Report, natural: impl Fn(&str) -> Option<[f64; 2]>) {
    let mut worst: Vec<(&str, f64)> = Vec::new();
    for name in COMPARED {
        let (Some(value), Some([middle, spread])) = (measured.get(name), natural(name)) else { continue };
        let distance = (value - middle) / spread.max(score::least(name));
        if distance.is_finite() {
            report.measure(&format!("distance.{name}"), distance, "");
            worst.push((name, distance.abs()));
        }
    }
    if let Some((name, distance)) = worst.iter().max_by(|a, b| a.1.total_cmp(&b.1)) {
        report.notes.push(format!("farthest from nature: {name}, by {distance:.1} spreads"));
    }
}

/// Adds the curves of the terrain and those of its references, if there are any.
fn beside_each_other(measured: &Report, references: Vec<Series>, report: &mut Report) {
    if !references.is_empty() {
        report.series.extend(measured.series.iter().cloned().chain(references));
    }
}

/// The default parameters of Metrics.
fn defaults() -> ParamValues {
    ParamValues::defaults(&metrics::NODE.specs())
}

/// All measures of a field.
fn measures(field: &Field, cancel: &Cancel) -> Result<Report, NodeError> {
    let params = defaults();
    let part = Job {
        node: &metrics::NODE,
        params: &params,
        inputs: Vec::new(),
        level: LevelJob::default(),
        window: *field.window(),
        wanted: Wanted::ALL,
        folder: PathBuf::new(),
        cancel: cancel.clone(),
        progress: &|_| {},
        warnings: Warnings::default(),
        glimpses: None,
    };
    metrics::metrics(&part, field, None, &metrics::Params::read(&params))
}

/// Returns the terrain at cells of 90 m, if its own are smaller, and a note if they are larger.
///
/// # Errors
/// The error of `check`.
pub fn averaged(
    height: &Field,
    check: &(dyn Fn() -> Result<(), NodeError> + Sync),
) -> Result<(Field, Option<String>), NodeError> {
    let window = height.window();
    let cell_m = window.cell_m();
    if cell_m >= LEFT_M[0] {
        let note = (cell_m > LEFT_M[1]).then(|| {
            let cell = Unit::Metres.display(cell_m);
            format!("cells of {cell} are compared with real land at cells of 80 to 100 m: its slopes are steeper")
        });
        return Ok((height.clone(), note));
    }
    let cells = [window.nx(), window.ny()].map(|cells| ((cells as f64 * cell_m / CELL_M).round() as u32).max(1));
    let axes =
        [window.nx(), window.ny()].map(|source| GridAxis { source, offset: 0.0, step: CELL_M / cell_m }.snapped());
    let samples = resample(height.plane(0), axes, [0, 0], cells, None, check)?;
    let world = World {
        size: cells.map(|cells| f64::from(cells) * CELL_M),
        cells,
        ..World { sea_level: window.world.sea_level, ..World::default() }
    };
    Ok((Field::new(Window::whole(world), samples), None))
}

/// The four quarters of a field: north-west, north-east, south-west, south-east.
#[must_use]
pub fn quarters(field: &Field) -> [Field; 4] {
    let (nx, ny) = (field.window().nx(), field.window().ny());
    [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[right, low]| {
        let (x0, y0) = (right * (nx / 2), low * (ny / 2));
        let (w, h) = ((nx / 2).max(1), (ny / 2).max(1));
        let rows = (y0..y0 + h).flat_map(|j| field.plane(0)[j * nx + x0.min(nx - w)..][..w].iter().copied());
        let cell_m = field.window().cell_m();
        let world = World {
            size: [w as f64 * cell_m, h as f64 * cell_m],
            cells: [w as u32, h as u32],
            sea_level: field.window().world.sea_level,
            ..World::default()
        };
        Field::new(Window::whole(world), rows.collect())
    })
}

#[cfg(test)]
mod tests;
