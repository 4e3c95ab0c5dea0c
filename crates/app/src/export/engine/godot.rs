//! Terrain3D in Godot.
//!
//! Source: C. Petkovsek, R. Palmroos and contributors, "Terrain3D", documentation and importer of version 1: height,
//! control and colour maps of one size, one pixel per vertex; regions of 64 to 2048 vertices, 16 of them to each side
//! of the origin.

use orograph_graph::PortType;
use orograph_nodes::raster::{Format, Writing};
use serde_json::{Value, json};

use super::{Exported, settings};
use crate::export::piece::{Content, Piece};

/// Maximum number of vertices per side from the origin: 16 of the largest regions.
pub(super) const MOST_CELLS: u32 = 16 * 2048;

/// The largest region that divides both sides, of which 16 hold the longer one. Without one, the smallest region, from
/// Terrain3D's default 256 on, that is large enough: the last regions are then padded in the east and south.
fn region([nx, ny]: [u32; 2]) -> u32 {
    let holds = |side: &u32| 16 * side >= nx.max(ny);
    let divides = |side: &u32| nx.is_multiple_of(*side) && ny.is_multiple_of(*side);
    let whole = [2048_u32, 1024, 512, 256, 128, 64].into_iter().find(|side| divides(side) && holds(side));
    whole.or_else(|| [256, 512, 1024].into_iter().find(holds)).unwrap_or(2048)
}

/// All maps have the cells of the world, as the importer requires, so nothing is resampled.
pub(super) fn fit(output: &Exported<'_>) -> Vec<Piece> {
    let Exported { ty, value, dither, .. } = *output;
    let window = value.window();
    let map = |name: &str| {
        json!({
            "Where": format!("addons/terrain_3d/tools/importer.tscn: {name}"),
            "Vertex Spacing": window.cell_m(),
            "Region Size": region(window.cells),
            "Import Position": "0, 0",
        })
    };
    let (content, import): (Content, Value) = match ty {
        PortType::Height => {
            let mut import = map("Height File Name");
            import["Import Scale"] = 1.into();
            import["Height Offset"] = 0.into();
            (Content::Numbers(Format::Exr, Writing { red: true, ..Writing::default() }), import)
        }
        PortType::Weights => {
            let mut import = map("Control File Name");
            import["Texture IDs"] = "0 `first`, 1 `second`, 2 `third`, 3 `fourth`".into();
            (Content::Control, import)
        }
        PortType::Colour => (Content::Tint, map("Color File Name")),
        PortType::Normal => {
            let import = json!({
                "Where": "Import dock, for materials of meshes; Terrain3D makes its own from the heights",
                "Normal Map": "Enable",
            });
            (Content::Normal, import)
        }
        PortType::Mask => {
            let import = json!({
                "Where": "Import dock, for scripts and shaders; a pixel for each vertex",
                "Compress Mode": "Lossless",
            });
            (Content::numbers(PortType::Mask, Format::Png8, dither), import)
        }
        _ => return Vec::new(),
    };
    vec![Piece { field: value.clone(), content, import: settings(import), shared: 0 }]
}
