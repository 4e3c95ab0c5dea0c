//! A landscape of Unreal Engine.
//!
//! Sources: Epic Games, "Landscape Technical Guide" (valid sizes; heights of 1/128 cm times the scale around 32768),
//! "Creating and Using Custom Heightmaps and Layers" (layers of 8 bits and one channel, as many pixels as vertices),
//! "Texture Support and Settings" (powers of two), "Landscape Material Expressions" (coordinates count squares).

use orograph_graph::{Field, NodeError, PortType};
use orograph_nodes::raster::{Format, apportioned};
use serde_json::{Map, Value, json};

use super::{Exported, codes, mask_at, normal_texture, settings, span, texture};
use crate::export::{
    piece::{Content, Piece},
    vertices::{at_vertices, spacing},
};

/// Squares along a side of a component of a landscape: two sections of 63 or of 127.
const COMPONENTS: [u32; 2] = [126, 254];
/// Maximum number of components along a side.
const MOST_COMPONENTS: u32 = 32;

/// The division of a landscape, or of each of its tiles, into components.
struct Landscape {
    /// Squares along a side of a component.
    squares: u32,
    components: [u32; 2],
    vertices: [u32; 2],
}

impl Landscape {
    fn of(cells: [u32; 2]) -> Self {
        let [small, large] = COMPONENTS;
        let squares = if cells.iter().all(|n| *n <= MOST_COMPONENTS * (small + 2)) { small } else { large };
        let components = cells.map(|n| ((n + squares / 2) / squares).clamp(1, MOST_COMPONENTS));
        Self { squares, components, vertices: components.map(|n| n * squares + 1) }
    }

    fn resolution(&self) -> String {
        format!("{} x {}", self.vertices[0], self.vertices[1])
    }

    /// Maps a texture over the whole landscape once: its coordinates count squares, with one scale for both axes.
    fn texture(&self, srgb: bool, compression: &str) -> Map<String, Value> {
        let mut import = settings(json!({
            "Where": "Content Browser, Import; in the landscape's material a Texture Sample",
            "sRGB": srgb,
            "Compression Settings": compression,
        }));
        let [across, down] = self.vertices.map(|n| n - 1);
        import.insert("Landscape Layer Coords, Mapping Scale".to_owned(), across.into());
        if across != down {
            let times = settings(json!({"V times": f64::from(across) / f64::from(down)}));
            import.extend(times);
        }
        import
    }
}

pub(super) fn fit(output: &Exported<'_>) -> Result<Vec<Piece>, NodeError> {
    let Exported { ty, value, tiles, go_on, .. } = *output;
    let landscape = Landscape::of(tiles.cells(value.window().cells));
    let vertices = tiles.whole(landscape.vertices, 1);
    Ok(match ty {
        PortType::Height => vec![height(&landscape, vertices, output)?],
        PortType::Mask => {
            let (field, content) = mask_at(vertices, output)?;
            vec![Piece { field, content, import: layer(&landscape, "the file of its layer"), shared: 1 }]
        }
        PortType::Weights => {
            // the layers sum to 255 in all four files only if no value is rounded again
            let parts = apportioned(&at_vertices(value, vertices, go_on)?);
            let piece = |(plane, name): (usize, &str)| Piece {
                field: Field::new(*parts.window(), parts.plane(plane).to_vec()),
                content: Content::numbers(PortType::Mask, Format::Png8, false),
                import: layer(&landscape, &format!("the file of the layer of `{name}`, weight-blended")),
                shared: 1,
            };
            ["first", "second", "third", "fourth"].into_iter().enumerate().map(piece).collect()
        }
        PortType::Colour => {
            let import = landscape.texture(true, "Default");
            vec![Piece { field: texture(output)?, content: Content::Colour, import, shared: 0 }]
        }
        PortType::Normal => {
            let import = landscape.texture(false, "Normalmap");
            vec![Piece { field: normal_texture(output)?, content: Content::Normal, import, shared: 0 }]
        }
        _ => Vec::new(),
    })
}

fn layer(landscape: &Landscape, which: &str) -> Map<String, Value> {
    settings(json!({
        "Where": format!("Landscape mode, Manage, New, Import from File: Layers, {which}"),
        "Overall Resolution": landscape.resolution(),
    }))
}

fn height(landscape: &Landscape, vertices: [u32; 2], output: &Exported<'_>) -> Result<Piece, NodeError> {
    let Exported { value: height, dither, go_on, .. } = *output;
    let Landscape { squares, components, .. } = *landscape;
    let grid = at_vertices(height, vertices, go_on)?;
    let [low, high] = span(&grid);
    let [x_cm, y_cm] = spacing(height, vertices).map(|metres| 100.0 * metres);
    // 65535 codes of 1/128 cm times the scale; code 32768 is at the actor's own height
    let z_scale = (high - low) * 100.0 * 128.0 / 65_535.0;
    let section = squares / 2;
    let import = settings(json!({
        "Where": "Landscape mode, Manage, New, Import from File: Heightmap File",
        "Section Size": format!("{section}x{section} Quads"),
        "Sections Per Component": "2x2 Sections",
        "Number of Components": format!("{} x {}", components[0], components[1]),
        "Overall Resolution": landscape.resolution(),
        "Location Z": low * 100.0 + 256.0 * z_scale,
        "Scale X": x_cm,
        "Scale Y": y_cm,
        "Scale Z": z_scale,
    }));
    Ok(Piece { field: grid, content: codes(Format::Png16, [low, high], dither), import, shared: 1 })
}
