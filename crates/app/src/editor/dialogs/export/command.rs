//! The command line that exports the same files.

use std::{fmt::Write as _, path::Path};

use clap::ValueEnum;
use orograph_nodes::raster::Format;

use crate::export::outputs::OutputOptions;

/// `orograph run ...` for a file. `only` is empty for all outputs; `cells` is empty for the file's own. `supersample` is
/// the number of finer cells along the side of each cell.
pub(super) fn line(
    file: &Path,
    folder: &Path,
    only: &[String],
    options: &OutputOptions,
    cells: &str,
    supersample: u32,
) -> String {
    let path = |path: &Path| quoted(&path.display().to_string());
    let mut line = format!("orograph run {} -o {}", path(file), path(folder));
    let mut add = |option: &str, value: &str| {
        // Writing to a string cannot fail.
        let _ = write!(line, " --{option}");
        if !value.is_empty() {
            let _ = write!(line, " {}", quoted(value));
        }
    };
    for name in only {
        add("only", name);
    }
    if !cells.is_empty() {
        add("cells", cells);
    }
    if supersample > 1 {
        add("supersample", &supersample.to_string());
    }
    if options.format != Format::Exr {
        add("format", options.format.name());
    }
    if let Some(engine) = options.engine {
        add("engine", &name_of(engine));
    }
    if let Some(tiles) = options.tiles {
        add("tiles", &tiles.to_string());
    }
    if options.dither {
        add("dither", "");
    }
    if let Some(mesh) = options.mesh {
        add("mesh", &name_of(mesh));
        add("triangles", &options.triangles.to_string());
    }
    if let Some(lines) = options.lines {
        add("lines", &name_of(lines));
    }
    if let Some(holes) = &options.holes {
        add("holes", holes);
    }
    if options.no_preview {
        add("no-preview", "");
    }
    line
}

/// The name of a value on the command line.
fn name_of(value: impl ValueEnum) -> String {
    value.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
}

/// A word quoted for a shell if necessary.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./:=+,@%\\".contains(c);
    if !word.is_empty() && word.chars().all(plain) && !(cfg!(unix) && word.contains('\\')) {
        return word.to_owned();
    }
    if cfg!(windows) { format!("\"{word}\"") } else { format!("'{}'", word.replace('\'', r"'\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::{engine::Engine, geojson::LinesIn, mesh::MeshFormat, tiles::Tiles};

    #[test]
    fn the_command_line_lists_only_changed_options() {
        let plain = OutputOptions::default();
        assert_eq!(line(Path::new("a.ron"), Path::new("out"), &[], &plain, "", 1), "orograph run a.ron -o out");
        let options = OutputOptions {
            format: Format::Png16,
            engine: Some(Engine::Unreal),
            tiles: Tiles::of([4, 2]),
            dither: true,
            mesh: Some(MeshFormat::Glb),
            triangles: 9,
            lines: Some(LinesIn::Metres),
            holes: Some("dem.data".to_owned()),
            no_preview: true,
        };
        let said = line(Path::new("a b.ron"), Path::new("out"), &["height".into()], &options, "64", 2);
        assert!(said.starts_with(if cfg!(windows) { "orograph run \"a b.ron\"" } else { "orograph run 'a b.ron'" }));
        assert!(said.ends_with(
            "-o out --only height --cells 64 --supersample 2 --format png16 --engine unreal --tiles 4x2 --dither --mesh glb --triangles 9 \
             --lines metres --holes dem.data --no-preview"
        ));
    }
}
