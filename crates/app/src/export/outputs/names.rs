//! The names of an output's files.

use orograph_graph::{OutputDecl, PortType, Window};

use super::OutputOptions;
use crate::{export::tiles::Tiles, files::is_device, report::failure::Failure};

/// The ending of the name of a preview of heights.
pub(super) const PREVIEW: &str = ".preview.png";

/// The file names of an output's rasters, those of the tiles of each after one another; empty if it has none.
pub(super) fn rasters(output: &OutputDecl, options: &OutputOptions) -> Vec<String> {
    let names = wholes(output, options);
    match options.tiles() {
        Some(tiles) => names.iter().flat_map(|name| tiles.each().map(|tile| Tiles::name(name, tile))).collect(),
        None => names,
    }
}

/// The file names of an output's rasters without tiles.
fn wholes(output: &OutputDecl, options: &OutputOptions) -> Vec<String> {
    let (name, extension) = (&output.name, options.format.extension());
    let ends = options.ends(output.ty);
    if !ends.is_empty() {
        return ends
            .iter()
            .zip(written(output, ends.len()))
            .filter(|(_, is)| *is)
            .map(|(end, _)| format!("{name}{end}"))
            .collect();
    }
    match output.ty {
        // the check of the document has refused these types
        PortType::Flow | PortType::Strata | PortType::Lines | PortType::Report => Vec::new(),
        PortType::Colour | PortType::Normal | PortType::Weights => vec![format!("{name}.png")],
        PortType::Vector(_) => ["x", "y"].map(|axis| format!("{name}.{axis}.{extension}")).to_vec(),
        PortType::Height | PortType::Mask | PortType::Scalar(_) | PortType::AnyScalar => {
            vec![format!("{name}.{extension}")]
        }
    }
}

/// Which of several files of an output are written. Of weights with a file per layer, only layers that can have
/// coverage.
pub(super) fn written(output: &OutputDecl, files: usize) -> impl Iterator<Item = bool> {
    let all = [true; 4];
    let each = if output.ty == PortType::Weights && files == output.layers.len() { output.layers } else { all };
    each.into_iter().take(files)
}

/// Returns true if a JSON file is written beside each raster of an output: always except for pictures of the whole
/// world without an engine; a PNG cannot state the position of a window or a tile.
pub(super) fn is_described(output: &OutputDecl, options: &OutputOptions, window: &Window) -> bool {
    let picture = matches!(output.ty, PortType::Colour | PortType::Normal | PortType::Weights);
    !picture || !options.ends(output.ty).is_empty() || !window.is_whole() || options.tiles().is_some()
}

/// The names of the preview of an output's heights, and of the mesh of its heights or of the areas that its lines
/// bound.
pub(super) fn views(output: &OutputDecl, options: &OutputOptions) -> Vec<String> {
    let preview = output.ty == PortType::Height && !options.no_preview;
    let preview = preview.then(|| format!("{}{PREVIEW}", output.name));
    let mesh = options.mesh.filter(|_| matches!(output.ty, PortType::Height | PortType::Lines));
    let mesh = mesh.map(|mesh| format!("{}.{}", output.name, mesh.extension()));
    preview.into_iter().chain(mesh).collect()
}

/// The names of all possible files of an output.
pub(super) fn names(output: &OutputDecl, options: &OutputOptions) -> Vec<String> {
    let name = &output.name;
    match output.ty {
        PortType::Lines => [vec![format!("{name}.geojson")], views(output, options)].concat(),
        PortType::Report => vec![format!("{name}.json")],
        _ => {
            let rasters = rasters(output, options);
            let sidecars = rasters.iter().map(|name| sidecar(name)).collect::<Vec<_>>();
            [rasters, sidecars, views(output, options)].concat()
        }
    }
}

/// The name of the JSON file beside a raster.
pub(super) fn sidecar(name: &str) -> String {
    format!("{name}.json")
}

/// Refuses names that are not valid file names on every system.
pub(super) fn check_name(name: &str) -> Result<(), Failure> {
    if is_device(name) {
        return Err(Failure::wrong(format!("the output `{name}` cannot be the name of a file on Windows"))
            .hint("rename it in `outputs`"));
    }
    let odd = |c: char| c.is_control() || matches!(c, '/' | '\\' | ':' | '*' | '?' | '"' | '<' | '>' | '|');
    if name.is_empty() || name.starts_with('.') || name.contains(odd) || name.len() > 200 {
        return Err(Failure::wrong(format!("the output `{}` cannot be the name of a file", name.escape_debug()))
            .hint("rename it in `outputs`, with letters, digits, `_` and `-`"));
    }
    Ok(())
}

/// The content of a file by type.
pub(super) const fn quantity(ty: PortType) -> &'static str {
    match ty {
        PortType::Height => "height",
        PortType::Mask => "mask",
        PortType::Scalar(_) | PortType::AnyScalar => "scalar",
        PortType::Vector(_) => "vector",
        PortType::Colour => "colour",
        PortType::Normal => "normal",
        PortType::Weights => "weights",
        PortType::Flow => "flow",
        PortType::Strata => "strata",
        PortType::Lines => "lines",
        PortType::Report => "report",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_leave_the_folder_are_refused() {
        for name in ["", "../up", "a/b", ".hidden", "a:b", "a\nb", "c:\\d"] {
            assert_eq!(check_name(name).expect_err(name).exit, crate::Exit::Wrong);
        }
        for name in ["con", "NUL", "Aux.height", "com1", "LPT9"] {
            assert!(check_name(name).expect_err(name).message.contains("Windows"), "{name}");
        }
        for name in ["flow-accumulation_2.x", "contours", "com", "lpt10"] {
            assert_eq!(check_name(name), Ok(()));
        }
    }
}
