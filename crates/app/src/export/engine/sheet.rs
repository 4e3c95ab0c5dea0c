//! The import settings as a text file beside the outputs.

use super::Engine;
use crate::export::outputs::Written;

/// The text for all files with import settings. Returns None when there are none.
#[must_use]
pub fn sheet(engine: Engine, files: &[Written]) -> Option<String> {
    let mut text = format!(
        "Import settings of {} for the files in this folder. Their first row is in the north.\n{}\n",
        engine.title(),
        engine.remark()
    );
    let imported = files.iter().filter_map(|file| Some((file.path.file_name()?, file.import.as_ref()?)));
    let mut any = false;
    for (name, import) in imported {
        any = true;
        text += &format!("\n{}\n", name.display());
        let width = import.settings.keys().map(|name| name.chars().count()).max().unwrap_or(0);
        for (name, value) in import.lines() {
            text += &format!("    {name:width$}  {value}\n");
        }
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
