//! What to type, as a text to keep beside the files.

use super::Engine;
use crate::outputs::Written;

/// The text for all files that have something to type; `None` when none has.
#[must_use]
pub fn sheet(engine: Engine, files: &[Written]) -> Option<String> {
    let mut text = format!(
        "What to type in {} for the files of this folder. Their rows lie north first.\n{}\n",
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
    /// What holds for all of its files.
    const fn remark(self) -> &'static str {
        match self {
            Self::Unreal => {
                "Heights and layers have one pixel for each vertex. Type the location and the scales before the import."
            }
            Self::Unity => "Set both resolutions of the terrain before the import, and its position after it.",
            Self::Godot => {
                "Set the region size and the vertex spacing first. Import all maps at once: they have the same size."
            }
        }
    }
}
