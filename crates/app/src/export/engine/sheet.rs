//! The import settings as a text file beside the outputs.

use super::Engine;
use crate::export::outputs::{Import, Written};

/// The text for all files with import settings. Returns None when there are none.
#[must_use]
pub fn sheet(engine: Engine, files: &[Written]) -> Option<String> {
    let mut text = format!(
        "Import settings of {} for the files in this folder. Their first row is in the north.\n{}\n",
        engine.title(),
        engine.remark()
    );
    let mut any = false;
    for (file, _, lines) in Import::of(files) {
        any = true;
        let name = file.path.file_name().unwrap_or_default();
        text += &format!("\n{}\n", name.display());
        let width = lines.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
        for (name, value) in lines {
            text += &format!("    {name:width$}  {value}\n");
        }
    }
    if files.iter().filter_map(|file| file.import.as_ref()).any(|import| import.tile != [0, 0]) {
        text += "\nA tile has the settings of the first tile of its raster, x0_y0, except for those listed under its name.\n";
    }
    any.then_some(text)
}

impl Engine {
    /// The settings common to all files of the engine.
    const fn remark(self) -> &'static str {
        match self {
            Self::Unreal => {
                "Heights and layers have one pixel per vertex. Enter the location and the scales before the import."
            }
            Self::Unity => "Set both resolutions of the terrain before the import, and its position after it.",
            Self::Godot => {
                "Set the region size and the vertex spacing first. Import all maps at once: they have the same size."
            }
        }
    }
}
