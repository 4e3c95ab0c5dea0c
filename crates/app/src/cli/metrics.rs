//! `orograph metrics`: terrain metrics of any height file.

use std::path::{Path, PathBuf};

use orograph_graph::{Field, Measure, Report, Unit, plain};
use serde_json::{Value, json};

use super::sea::Sea;
use crate::{
    files::heightfile::{self, Scale},
    report::{
        failure::Failure,
        measure::{self, Distance},
        terminal::{self, Align, Page, Table},
    },
    stop,
};

/// Measures a height file and compares it with a reference
///
/// Reads GeoTIFF, grey PNG, OpenEXR, ESRI ASCII, SRTM (.hgt), .r16 and .r32, and fills voids. The manual describes each
/// measure: see the nodes of the category `measure` (`orograph nodes`), which run with their defaults. Curves and
/// histograms are in the JSON. With a sea (from the JSON beside the heights, or `--sea`), only the terrain above it is
/// measured.
///
/// With `--against`, the differences of elevation and slope are Wasserstein distances of their distributions, in
/// interquartile ranges of the reference; the difference of hypsometry is the mean difference of the curves. 0 is no
/// difference.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Height file
    #[arg(value_name = "HEIGHT")]
    file: PathBuf,
    /// Height file to compare with: its measures, and its heights if both have the same cells
    #[arg(long, value_name = "REF")]
    against: Option<PathBuf>,
    #[command(flatten)]
    scale: Scale,
    #[command(flatten)]
    sea: Sea,
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
    pub(super) fn run(self) -> Result<(), Failure> {
        let (registry, cancel) = (orograph_nodes::registry(), stop::on_interrupt()?);
        let measured = |path| -> Result<Measured<'_>, Failure> {
            let height = self.sea.around(heightfile::read(path, &self.scale)?);
            let report = measure::measure(&height, &registry, &cancel)?;
            Ok(Measured { path, height, report })
        };
        let field = measured(&self.file)?;
        let reference = self.against.as_deref().map(measured).transpose()?;
        let compared = reference.as_ref().map(|reference| {
            let distance = measure::distance((&field.height, &field.report), (&reference.height, &reference.report));
            (reference, distance)
        });
        if self.json {
            let mut value = as_json(&field);
            if let Some((reference, distance)) = &compared {
                value["against"] = as_json(reference);
                value["difference"] = json!(distance);
            }
            return terminal::print(&format!("{value:#}\n"));
        }
        terminal::print(&as_text(
            &field,
            compared.as_ref().map(|(reference, distance)| (*reference, distance)),
            Page::stdout(),
        ))
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

fn as_text(field: &Measured<'_>, compared: Option<(&Measured<'_>, &Distance)>, page: Page) -> String {
    let mut out = heading(field, page);
    let mut columns = vec![("measure", Align::Left), ("value", Align::Right)];
    if let Some((reference, _)) = compared {
        out.push_str(&format!("{} {}", page.dim("against"), heading(reference, page)));
        columns.extend([("reference", Align::Right), ("difference", Align::Right)]);
    }
    columns.push(("", Align::Left));
    let mut table = Table::new(&columns);
    for Measure { name, value, unit } in &field.report.measures {
        let mut row = vec![name.replace('_', " "), number(*value)];
        if let Some((reference, distance)) = compared {
            let difference = distance.measures.iter().find(|measure| measure.name == *name);
            row.push(reference.report.get(name).map_or_else(String::new, number));
            row.push(difference.map_or_else(String::new, |measure| page.bold(&signed(measure.value))));
        }
        row.push(page.dim(unit));
        table.row(row);
    }
    if let Some((_, distance)) = compared {
        let mut differ = |name: &str, value: f64, unit: &str, sign: bool| {
            let value = if sign { signed(value) } else { number(value) };
            table.row([name.to_owned(), String::new(), String::new(), page.bold(&value), page.dim(unit)]);
        };
        for Measure { name, value, unit } in &distance.distributions.measures {
            differ(&name.replace('_', " "), *value, unit, false);
        }
        if let Some(heights) = distance.heights {
            differ("heights, mean", heights.mean_m, "m", true);
            differ("heights, root mean square", heights.root_mean_square_m, "m", false);
            differ("heights, largest", heights.largest_m, "m", false);
        }
    }
    if !table.is_empty() {
        out.push('\n');
        out.push_str(&table.render(page, 0));
    }
    let notes = compared
        .iter()
        .flat_map(|(reference, distance)| reference.report.notes.iter().chain(&distance.distributions.notes));
    let mut said: Vec<&String> = Vec::new();
    for note in field.report.notes.iter().chain(notes) {
        if !said.contains(&note) {
            said.push(note);
            out.push_str(&format!("{} {note}\n", page.doubtful("note:")));
        }
    }
    if !field.report.series.is_empty() {
        let names: Vec<String> = field.report.series.iter().map(|series| series.name.replace('_', " ")).collect();
        out.push_str(&page.dim(&format!("\nwith --json: {}\n", names.join(", "))));
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
