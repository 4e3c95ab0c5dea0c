//! The command line that writes the same files.

use std::{fmt::Write as _, path::Path};

use clap::ValueEnum;
use orograph_nodes::raster::Format;

use crate::outputs::Form;

/// `orograph run ...` for a file. `only` is empty for all outputs, `cells` for those of the file.
pub(super) fn line(file: &Path, folder: &Path, only: &[String], form: &Form, cells: &str) -> String {
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
    if form.format != Format::Exr {
        add("format", form.format.name());
    }
    if let Some(engine) = form.engine {
        add("engine", &name_of(engine));
    }
    if form.dither {
        add("dither", "");
    }
    if let Some(mesh) = form.mesh {
        add("mesh", &name_of(mesh));
        add("triangles", &form.triangles.to_string());
    }
    if form.no_preview {
        add("no-preview", "");
    }
    line
}

/// The name of a value on the command line.
fn name_of(value: impl ValueEnum) -> String {
    value.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
}

/// A word as a shell takes it: in quotes where it has more than plain signs.
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
    use crate::{engine::Engine, mesh::MeshFormat};

    #[test]
    fn the_line_says_what_differs_from_the_defaults() {
        let plain = Form::default();
        assert_eq!(line(Path::new("a.ron"), Path::new("out"), &[], &plain, ""), "orograph run a.ron -o out");
        let form = Form {
            format: Format::Png16,
            engine: Some(Engine::Unreal),
            dither: true,
            mesh: Some(MeshFormat::Glb),
            triangles: 9,
            no_preview: true,
        };
        let said = line(Path::new("a b.ron"), Path::new("out"), &["height".into()], &form, "64");
        assert!(said.starts_with(if cfg!(windows) { "orograph run \"a b.ron\"" } else { "orograph run 'a b.ron'" }));
        assert!(said.ends_with(
            "-o out --only height --cells 64 --format png16 --engine unreal --dither --mesh glb --triangles 9 --no-preview"
        ));
    }
}
