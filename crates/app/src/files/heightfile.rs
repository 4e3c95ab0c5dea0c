//! Height files that are read directly, without a graph.

use std::path::Path;

use orograph_graph::{Window, World, files};
use orograph_nodes::raster::{self, Heights, Problem};

use crate::report::{failure::Failure, terminal};

/// What becomes of voids, unless they are left out.
pub const FILLED: &str = "are filled from those around";

/// Properties that a height file may not state itself.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct Scale {
    /// Cell size of a height file in metres, if the file does not state it or states it wrong
    #[arg(long, value_name = "METRES", value_parser = length, allow_hyphen_values = true)]
    pub cell: Option<f64>,
    /// Heights in metres of the lowest and the highest code of a 16-bit or 8-bit file, if no file beside it states them
    #[arg(long, value_name = "LO,HI", value_parser = range, allow_hyphen_values = true)]
    pub range: Option<[f64; 2]>,
}

impl Scale {
    /// The name of the first option that was given.
    #[must_use]
    pub const fn given(&self) -> Option<&'static str> {
        match self {
            Self { cell: Some(_), .. } => Some("--cell"),
            Self { range: Some(_), .. } => Some("--range"),
            _ => None,
        }
    }
}

fn length(text: &str) -> Result<f64, String> {
    match orograph_graph::Unit::Metres.parse(text) {
        Ok(metres) if metres > 0.0 => Ok(metres),
        Ok(_) => Err("a cell has an extent above zero".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

fn range(text: &str) -> Result<[f64; 2], String> {
    let (lo, hi) = text.split_once(',').ok_or("write two heights with a comma between, such as `0,2500`")?;
    let metres = |text: &str| orograph_graph::Unit::Metres.parse(text).map_err(|error| error.to_string());
    match [metres(lo)?, metres(hi)?] {
        [lo, hi] if lo < hi => Ok([lo, hi]),
        _ => Err("the first must be the lower one".to_owned()),
    }
}

/// Reads a height file of any known format, with voids filled, over its own world, with the sea level of its side file.
/// Prints what is assumed about it; `done` says what becomes of voids, such as `are filled`.
///
/// # Errors
/// When it is not a height file, or neither the file nor `scale` states its cell size or the heights of its codes.
pub fn read(path: &Path, scale: &Scale, done: &str) -> Result<Heights, Failure> {
    files::settle(path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new(".")));
    let raster = raster::read(path).map_err(|error| {
        let remedy = match &error.problem {
            Problem::Missing => "check the name",
            _ => error.remedy(),
        };
        let failure = match &error.problem {
            Problem::Unreadable(_) | Problem::OutOfMemory(_) => Failure::unable(error.to_string()),
            _ => Failure::wrong(error.to_string()),
        };
        failure.hint(remedy)
    })?;
    let wrong = |what: &str, hint: &str| Failure::wrong(format!("`{}` {what}", path.display())).hint(hint);
    if raster.head.coding.is_some_and(|coding| coding.range.is_none()) && scale.range.is_none() {
        return Err(wrong("has integer codes without a height range", "add the range: `--range 0,2500`"));
    }
    let (head, voids) = (raster.head.clone(), raster.voids);
    let warn = |what: &str| terminal::warn(&format!("`{}`: {what}", path.display()));
    if scale.range.is_some() && head.coding.is_none_or(|coding| coding.range.is_some()) {
        warn("`--range` has no effect, as the file states its heights");
    }
    let heights = raster::height_field(raster, scale.range.unwrap_or([0.0, 1.0]), scale.cell);
    let Heights { field, data } = heights.map_err(|problem| match problem {
        Problem::NoCellSize => wrong("does not state its cell size", "add it in metres: `--cell 30`"),
        problem @ Problem::OutOfMemory(_) => {
            Failure::unable(format!("`{}`: {problem}", path.display())).hint(problem.remedy())
        }
        problem => Failure::wrong(format!("`{}`: {problem}", path.display())).hint(problem.remedy()),
    })?;
    let of_scale = if scale.cell.is_none() { head.scale_remarks() } else { Vec::new() };
    for remark in head.notes.iter().cloned().chain(of_scale).chain(voids.remarks(&head, done)) {
        warn(&remark);
    }
    if let Some(quantity) = raster::other_quantity(path) {
        warn(&format!("the file beside it says that it holds {quantity}; its values are read as heights in metres"));
    }
    let sea_level = raster::sea_level(path).map_err(|error| {
        let remedy = error.remedy();
        Failure::wrong(error.to_string()).hint(remedy)
    })?;
    let window = *field.window();
    let window = Window { world: World { sea_level, ..window.world }, ..window };
    Ok(Heights { field: field.crop(&window), data: data.map(|data| data.crop(&window)) })
}
