//! `orograph metrics`: terrain metrics of any height file.

use std::path::{Path, PathBuf};

use orograph_graph::{Cancel, Field, Measure, Registry, Report, Series, Unit, plain};
use orograph_nodes::measure::compare::Kind;
use serde_json::{Value, json};

use super::sea::Sea;
use crate::{
    export::plot::{self, Plot, Theme},
    files::heightfile::{self, Scale},
    report::{
        failure::Failure,
        measure::{self, Against, Distance},
        terminal::{self, Align, Page, Table},
    },
    stop,
};

/// Measures a height file and compares it with a reference
///
/// Reads GeoTIFF, grey PNG, OpenEXR, ESRI ASCII, SRTM (.hgt), .r16 and .r32. Cells without data are not measured, and
/// water leaves there. The manual describes each measure: see the nodes of the category `measure` (`orograph nodes`),
/// which run with their defaults. Curves and histograms are in the JSON; `--plots` draws them. With a sea (from the
/// JSON beside the heights, or `--sea`), only the terrain above it is measured.
///
/// The score tells how realistic the terrain is: 1 is real land. With `--against`, the column `spreads` has the
/// distance of each measure in units of its natural spread, both averaged to cells of 90 m; see `Compare` in the
/// manual.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Height file
    #[arg(value_name = "HEIGHT")]
    file: PathBuf,
    /// Height file to compare with, or a kind of terrain: fluvial, glaciated, stratified, lowland, alps, himalaya,
    /// highlands, canyon
    #[arg(long, value_name = "FILE|KIND")]
    against: Option<PathBuf>,
    #[command(flatten)]
    scale: Scale,
    #[command(flatten)]
    sea: Sea,
    /// Folder for plots of the curves, each as PNG and SVG, with those of the reference; created if it does not exist.
    /// With a kind, curves are measured on 90 m cells
    #[arg(long, value_name = "DIR")]
    plots: Option<PathBuf>,
    /// Colours of the plots
    #[arg(long, value_enum, default_value_t = Theme::Light, requires = "plots")]
    theme: Theme,
    /// Print as JSON, with curves and histograms
    #[arg(long)]
    json: bool,
}

/// A height file with its measures.
struct Measured<'a> {
    path: &'a Path,
    height: Field,
    report: Report,
}

impl Args {
    fn measured<'a>(
        &self,
        path: &'a Path,
        scale: &Scale,
        registry: &Registry,
        cancel: &Cancel,
    ) -> Result<Measured<'a>, Failure> {
        let height = self.sea.around(heightfile::read(path, scale, "are left out")?.with_voids());
        let report = measure::measure(&height, registry, cancel)?;
        Ok(Measured { path, height, report })
    }

    pub(super) fn run(self) -> Result<(), Failure> {
        let (registry, cancel) = (orograph_nodes::registry(), stop::on_interrupt()?);
        let field = self.measured(&self.file, &self.scale, &registry, &cancel)?;
        let kind = self.against.as_deref().map(kind).transpose()?.flatten();
        let file = self.against.as_deref().filter(|_| kind.is_none());
        // what the reference says of itself counts more than what is said of the other file
        let measured = |path, scale: &_| self.measured(path, scale, &registry, &cancel);
        let reference = match file {
            Some(path) => Some(measured(path, &Scale::default()).or_else(|_| measured(path, &self.scale))?),
            None => None,
        };
        let distance = match (&reference, kind) {
            (Some(reference), _) => {
                let (own, other) = ((&field.height, &field.report), (&reference.height, &reference.report));
                Some(measure::distance(own, other, &cancel)?)
            }
            (None, Some(kind)) => {
                let compared = measure::compare(&field.height, Against::Kind(kind), &cancel)?;
                Some(Distance { compared, ..Distance::default() })
            }
            (None, None) => None,
        };
        let kinds = distance.as_ref().filter(|_| kind.is_some()).map(|distance| distance.compared.series.as_slice());
        let draw = |folder| self.draw(folder, &field, reference.as_ref(), kinds.unwrap_or_default());
        let plots = self.plots.as_deref().map(draw).transpose()?;
        if self.json {
            let mut value = as_json(&field);
            if let Some(plots) = &plots {
                value["plots"] = json!(plots.iter().map(|path| path.display().to_string()).collect::<Vec<_>>());
            }
            match (&reference, kind) {
                (Some(reference), _) => value["against"] = as_json(reference),
                (None, Some(kind)) => value["against"] = json!({ "kind": kind.name() }),
                (None, None) => {}
            }
            if let Some(distance) = &distance {
                value["difference"] = json!(distance);
            }
            return terminal::print(&format!("{value:#}\n"));
        }
        let against = kind.map(|kind| format!("{} (a kind of real terrain)\n", kind.name()));
        let page = Page::stdout();
        let against = against.or_else(|| reference.as_ref().map(|reference| heading(reference, page)));
        let compared = against.zip(distance.as_ref()).map(|(heading, distance)| Compared {
            heading,
            report: reference.as_ref().map(|reference| &reference.report),
            distance,
        });
        terminal::print(&as_text(&field, compared.as_ref(), page))?;
        let Some(plots) = plots else { return Ok(()) };
        let names: Vec<String> = plots.iter().map(|path| path.display().to_string()).collect();
        terminal::print(&format!("\n{} {}\n", Page::stdout().good("wrote"), names.join(", ")))
    }

    /// Writes the plots; returns their files. `compared` has the curves of a comparison with a kind.
    fn draw(
        &self,
        folder: &Path,
        field: &Measured<'_>,
        reference: Option<&Measured<'_>>,
        compared: &[Series],
    ) -> Result<Vec<PathBuf>, Failure> {
        let name =
            |measured: &Measured<'_>| measured.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let (mut made, mut real) = (name(field), reference.map(name).unwrap_or_default());
        if made == real {
            made = field.path.display().to_string();
            real = reference.map(|reference| reference.path.display().to_string()).unwrap_or_default();
        }
        let mut series = if compared.is_empty() { field.report.series.clone() } else { compared.to_vec() };
        let beside = reference.iter().flat_map(|reference| &reference.report.series);
        series.extend(beside.map(|curve| curve.clone().of(&real)));
        plot::folder(folder)?;
        let mut files = Vec::new();
        for plot in Plot::of(&made, &series) {
            files.extend(plot.write(folder, self.theme)?);
        }
        Ok(files)
    }
}

fn as_json(measured: &Measured<'_>) -> Value {
    let window = measured.height.window();
    json!({
        "file": measured.path.display().to_string(),
        "cells": window.cells,
        "cell_m": window.cell_m(),
        "range_m": measured.height.range(0),
        "sea_level_m": window.world.sea_level,
        "measures": measured.report.measures,
        "series": measured.report.series,
        "notes": measured.report.notes,
    })
}

/// What a file is compared with.
struct Compared<'a> {
    heading: String,
    /// Its measures, if it is a file.
    report: Option<&'a Report>,
    distance: &'a Distance,
}

/// The kind of terrain that is named, if there is no file of the name.
fn kind(name: &Path) -> Result<Option<Kind>, Failure> {
    let text = name.to_string_lossy();
    let kinds = || Kind::ALL.iter().filter(|kind| **kind != Kind::None);
    if name.is_file() || !text.chars().all(|letter| letter.is_ascii_alphabetic()) {
        return Ok(None);
    }
    let names: Vec<&str> = kinds().map(|kind| kind.name()).collect();
    let found = kinds().find(|kind| kind.name() == text);
    let remedy = || {
        let near = orograph_graph::closest(&text, names.iter().copied());
        near.map_or_else(|| format!("the kinds are {}", names.join(", ")), |near| format!("did you mean `{near}`?"))
    };
    found
        .map(|kind| Some(*kind))
        .ok_or_else(|| Failure::wrong(format!("`{text}` is neither a file nor a kind of terrain")).hint(remedy()))
}

fn as_text(field: &Measured<'_>, compared: Option<&Compared<'_>>, page: Page) -> String {
    let mut out = heading(field, page);
    let mut columns = vec![("measure", Align::Left), ("value", Align::Right)];
    let reference = compared.and_then(|compared| compared.report);
    if let Some(compared) = compared {
        out.push_str(&format!("{} {}", page.dim("against"), compared.heading));
        if reference.is_some() {
            columns.extend([("reference", Align::Right), ("difference", Align::Right)]);
        }
        columns.push(("spreads", Align::Right));
    }
    columns.push(("", Align::Left));
    let mut table = Table::new(&columns);
    for Measure { name, value, unit } in &field.report.measures {
        let mut row = vec![name.clone(), number(*value)];
        if let Some(compared) = compared {
            let distance = compared.distance;
            if let Some(reference) = reference {
                let difference = distance.measures.iter().find(|measure| measure.name == *name);
                row.push(reference.get(name).map_or_else(String::new, number));
                row.push(difference.map_or_else(String::new, |measure| signed(measure.value)));
            }
            let spreads = distance.compared.get(&format!("distance.{name}"));
            row.push(spreads.map_or_else(String::new, |spreads| page.bold(&signed((1e2 * spreads).round() / 1e2))));
        }
        row.push(page.dim(unit));
        table.row(row);
    }
    if let Some(compared) = compared.filter(|_| reference.is_some()) {
        let mut differ = |name: &str, value: f64, unit: &str, sign: bool| {
            let value = if sign { signed(value) } else { number(value) };
            table.row([name.to_owned(), String::new(), String::new(), value, String::new(), page.dim(unit)]);
        };
        for name in ["elevation_distance", "slope_distance", "hypsometry_distance"] {
            compared.distance.compared.get(name).into_iter().for_each(|value| differ(name, value, "", false));
        }
        if let Some(heights) = compared.distance.heights {
            differ("heights, mean", heights.mean_m, "m", true);
            differ("heights, root mean square", heights.root_mean_square_m, "m", false);
            differ("heights, largest", heights.largest_m, "m", false);
        }
    }
    if !table.is_empty() {
        out.push('\n');
        out.push_str(&table.render(page, 0));
    }
    let others = reference.into_iter().chain(compared.map(|compared| &compared.distance.compared));
    let mut said: Vec<&String> = Vec::new();
    for note in field.report.notes.iter().chain(others.flat_map(|report| &report.notes)) {
        if !said.contains(&note) {
            said.push(note);
            out.push_str(&format!("{} {note}\n", page.doubtful("note:")));
        }
    }
    if !field.report.series.is_empty() {
        let names: Vec<String> = field.report.series.iter().map(|series| series.name.clone()).collect();
        out.push_str(&page.dim(&format!("\nwith --json and --plots: {}\n", names.join(", "))));
    }
    out
}

/// File, cells and range in one line.
fn heading(measured: &Measured<'_>, page: Page) -> String {
    let window = measured.height.window();
    let [nx, ny] = window.cells;
    let (lo, hi) = measured.height.range(0).unwrap_or_default();
    format!(
        "{}  {nx} x {ny} cells of {}, {} to {} m\n",
        page.name(&measured.path.display().to_string()),
        Unit::Metres.display(window.cell_m()),
        number(f64::from(lo)),
        number(f64::from(hi)),
    )
}

/// Five significant digits; a dash for an undefined value.
fn number(value: f64) -> String {
    if value.is_finite() { plain(format!("{value:.4e}").parse().unwrap_or(value)) } else { "–".to_owned() }
}

fn signed(value: f64) -> String {
    if value > 0.0 { format!("+{}", number(value)) } else { number(value).replace('-', "−") }
}
