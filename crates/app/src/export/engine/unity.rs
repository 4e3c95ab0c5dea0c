//! A terrain of Unity.
//!
//! Sources: Unity Technologies, "Terrain settings", "Working with heightmaps", "Terrain Layers", the package Terrain
//! Tools ("Terrain Toolbox", splatmaps), and the terrain's shaders, which place the centres of a control texture's
//! outermost texels on the edges of the terrain: its texels are vertices too.

use orograph_graph::{Field, NodeError, PortType};
use orograph_nodes::raster::Format;
use serde_json::{Value, json};

use super::{Exported, codes, mask_at, normal_texture, settings, short, span, texture};
use crate::export::{
    piece::{Content, Piece},
    tiles::Tiles,
    vertices::{at_vertices, extent},
};

/// Vertices per side: the terrain has as many in both directions, whatever its width and length.
fn side(cells: [u32; 2]) -> u32 {
    let longest = cells[0].max(cells[1]);
    (5..=12).map(|power| (1_u32 << power) + 1).min_by_key(|side| side.abs_diff(longest)).unwrap_or(4097)
}

pub(super) fn fit(output: &Exported<'_>) -> Result<Vec<Piece>, NodeError> {
    let Exported { ty, value, tiles, go_on, .. } = *output;
    let texels = side(tiles.cells(value.window().cells)) - 1;
    let control = tiles.whole([texels; 2], 1);
    let mut shared = 1;
    let (field, content, import) = match ty {
        PortType::Height => return Ok(vec![height(output)?]),
        PortType::Mask => {
            let (field, content) = mask_at(control, output)?;
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
            (at_vertices(value, control, go_on)?, Content::Weights, import)
        }
        PortType::Colour => {
            let field = texture(output)?;
            shared = 0;
            let import = json!({
                "Where": "Terrain Layer: Diffuse",
                "sRGB": true,
                "Max Size": longest(&field, tiles),
                "Tiling Settings, Size": tiling(value, tiles),
            });
            (field, Content::Colour, import)
        }
        PortType::Normal => {
            let field = normal_texture(output)?;
            shared = 0;
            let import = json!({
                "Where": "Terrain Layer: Normal Map",
                "Texture Type": "Normal map",
                "Max Size": longest(&field, tiles),
                "Tiling Settings, Size": tiling(value, tiles),
            });
            (field, Content::Normal, import)
        }
        _ => return Ok(Vec::new()),
    };
    Ok(vec![Piece { field, content, import: settings(import), shared }])
}

/// The longer side of a tile's texture.
fn longest(field: &Field, tiles: Tiles) -> Value {
    let [nx, ny] = tiles.cells(field.window().cells);
    nx.max(ny).into()
}

/// Width and length of a terrain, of which the whole has several.
fn sides(field: &Field, tiles: Tiles) -> [f64; 2] {
    let (size, counts) = (extent(field), tiles.counts());
    [0, 1].map(|axis| size[axis] / f64::from(counts[axis]))
}

/// The size of a texture that covers the whole terrain.
fn tiling(field: &Field, tiles: Tiles) -> String {
    let [width, length] = sides(field, tiles).map(short);
    format!("{width} x {length}")
}

fn height(output: &Exported<'_>) -> Result<Piece, NodeError> {
    let Exported { value: height, tiles, dither, go_on, .. } = *output;
    let side = side(tiles.cells(height.window().cells));
    let grid = at_vertices(height, tiles.whole([side; 2], 1), go_on)?;
    let [low, high] = span(&grid);
    let [width, length] = sides(height, tiles);
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
    Ok(Piece { field: grid, content: codes(Format::R16, [low, high], dither), import, shared: 1 })
}
