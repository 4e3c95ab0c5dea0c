//! The names of an output's files.

use orograph_graph::{OutputDecl, PortType, Window};

use super::Form;
use crate::failure::Failure;

/// The end of the name of a picture of heights.
pub(super) const PREVIEW: &str = ".preview.png";

/// The names of the files of an output's rasters; none where it has none.
pub(super) fn rasters(output: &OutputDecl, form: &Form) -> Vec<String> {
    let (name, extension) = (&output.name, form.format.extension());
    let ends = form.ends(output.ty);
    if !ends.is_empty() {
        return ends.iter().map(|end| format!("{name}{end}")).collect();
    }
    match output.ty {
        // the check of a document has refused it
        PortType::Flow | PortType::Lines | PortType::Report => Vec::new(),
        PortType::Colour | PortType::Normal | PortType::Weights => vec![format!("{name}.png")],
        PortType::Vector(_) => ["x", "y"].map(|axis| format!("{name}.{axis}.{extension}")).to_vec(),
        PortType::Height | PortType::Mask | PortType::Scalar(_) | PortType::AnyScalar => {
            vec![format!("{name}.{extension}")]
        }
    }
}

/// Returns true if a JSON file is written beside each raster of an output: beside pictures where an engine imports them, and
/// where they show a part of the world, whose place no PNG tells.
pub(super) fn is_described(output: &OutputDecl, form: &Form, window: &Window) -> bool {
    let picture = matches!(output.ty, PortType::Colour | PortType::Normal | PortType::Weights);
    !picture || !form.ends(output.ty).is_empty() || !window.is_whole()
}

/// The names of what is drawn or built from an output's heights.
pub(super) fn views(output: &OutputDecl, form: &Form) -> Vec<String> {
    if output.ty != PortType::Height {
        return Vec::new();
    }
    let preview = (!form.no_preview).then(|| format!("{}{PREVIEW}", output.name));
    let mesh = form.mesh.map(|mesh| format!("{}.{}", output.name, mesh.extension()));
    preview.into_iter().chain(mesh).collect()
}

/// The names of all files that an output may have.
pub(super) fn names(output: &OutputDecl, form: &Form) -> Vec<String> {
    let name = &output.name;
    match output.ty {
        PortType::Lines => vec![format!("{name}.geojson")],
        PortType::Report => vec![format!("{name}.json")],
        _ => {
            let rasters = rasters(output, form);
            let sidecars = rasters.iter().map(|name| sidecar(name)).collect::<Vec<_>>();
            [rasters, sidecars, views(output, form)].concat()
        }
    }
}

/// The name of the JSON file beside a raster.
pub(super) fn sidecar(name: &str) -> String {
    format!("{name}.json")
}

/// Refuses names that are no names of files everywhere.
pub(super) fn check_name(name: &str) -> Result<(), Failure> {
    let odd = |c: char| c.is_control() || matches!(c, '/' | '\\' | ':' | '*' | '?' | '"' | '<' | '>' | '|');
    if name.is_empty() || name.starts_with('.') || name.contains(odd) || name.len() > 200 {
        return Err(Failure::wrong(format!("the output `{}` cannot be the name of a file", name.escape_debug()))
            .hint("rename it in `outputs`, with letters, digits, `_` and `-`"));
    }
    Ok(())
}

/// What a file of that type holds.
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
        assert_eq!(check_name("flow-accumulation_2.x"), Ok(()));
    }
}
