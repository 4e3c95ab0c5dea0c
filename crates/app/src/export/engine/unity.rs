//! A terrain of Unity.
//!
//! Sources: Unity Technologies, "Terrain settings", "Working with heightmaps", "Terrain Layers", the package Terrain
//! Tools ("Terrain Toolbox", splatmaps), and the terrain's shaders, which place the centres of a control texture's
//! outermost texels on the edges of the terrain: its texels are vertices too.

use orograph_graph::{Field, NodeError, PortType};
use orograph_nodes::raster::{Format, GoOn};
use serde_json::{Value, json};

use super::{codes, mask_at, normal_texture, settings, short, span, texture};
use crate::export::{
    piece::{Content, Piece},
    vertices::{at_vertices, extent},
};

/// Vertices per side: the terrain has as many in both directions, whatever its width and length.
fn side(cells: [u32; 2]) -> u32 {
    let longest = cells[0].max(cells[1]);
    (5..=12).map(|power| (1_u32 << power) + 1).min_by_key(|side| side.abs_diff(longest)).unwrap_or(4097)
}

pub(super) fn fit(ty: PortType, value: &Field, dither: bool, go_on: GoOn<'_>) -> Result<Vec<Piece>, NodeError> {
    let texels = side(value.window().cells) - 1;
    let (field, content, import) = match ty {
        PortType::Height => return Ok(vec![height(value, dither, go_on)?]),
        PortType::Mask => {
            let (field, content) = mask_at([texels; 2], value, dither, go_on)?;
            let import = json!({
                "Where": "Assets, as a texture for scripts and shaders; its texels are those of the control texture",
                "Control Texture Resolution": texels,
                "sRGB": false,
                "Read/Write": true,
                "Max Size": texels,
                "Compression": "None",
            });
            (field, content, import)
        }
        PortType::Weights => {
            let import = json!({
                "Where": "Window, Terrain, Terrain Toolbox, Terrain Utilities, Terrain Splatmaps (package Terrain Tools)",
                "Control Texture Resolution": texels,
                "sRGB": false,
                "Read/Write": true,
                "Max Size": texels,
                "Format": "RGBA 32 bit",
                "Compression": "None",
            });
            (at_vertices(value, [texels; 2], go_on)?, Content::Weights, import)
        }
        PortType::Colour => {
            let field = texture(value, go_on)?;
            let import = json!({
                "Where": "Terrain Layer: Diffuse",
                "sRGB": true,
                "Max Size": longest(&field),
                "Tiling Settings, Size": tiling(value),
            });
            (field, Content::Colour, import)
        }
        PortType::Normal => {
            let field = normal_texture(value, go_on)?;
            let import = json!({
                "Where": "Terrain Layer: Normal Map",
                "Texture Type": "Normal map",
                "Max Size": longest(&field),
                "Tiling Settings, Size": tiling(value),
            });
            (field, Content::Normal, import)
        }
        _ => return Ok(Vec::new()),
    };
    Ok(vec![Piece { field, content, import: settings(import) }])
}

fn longest(field: &Field) -> Value {
    let [nx, ny] = field.window().cells;
    nx.max(ny).into()
}

/// The size of a tile that covers the whole terrain.
fn tiling(field: &Field) -> String {
    let [width, length] = extent(field).map(short);
    format!("{width} x {length}")
}

fn height(height: &Field, dither: bool, go_on: GoOn<'_>) -> Result<Piece, NodeError> {
    let side = side(height.window().cells);
    let grid = at_vertices(height, [side; 2], go_on)?;
    let [low, high] = span(&grid);
    let [width, length] = extent(height);
    let import = settings(json!({
        "Where": "Terrain, Terrain Settings, Texture Resolutions: Import Raw",
        "Heightmap Resolution": side,
        "Depth": "Bit 16",
        "Byte Order": "Windows",
        "Flip Vertically": true,
        "Terrain Width": width,
        "Terrain Length": length,
        "Terrain Height": high - low,
        "Position Y": low,
        "Control Texture Resolution": side - 1,
    }));
    Ok(Piece { field: grid, content: codes(Format::R16, [low, high], dither), import })
}
