//! Outputs in the form that game engines import, and the import settings.
//!
//! Each engine has its own file. All files of an output align: data of the terrain's vertices is sampled at them, from
//! edge to edge; a texture over the whole terrain has pixels that fill the world, as cells do.

mod godot;
mod sheet;
#[cfg(test)]
mod tests;
mod unity;
mod unreal;

use clap::ValueEnum;
use orograph_graph::{Field, NodeError, PortType, Window};
use orograph_nodes::raster::{Format, GoOn, Writing};
use serde_json::{Map, Value, json};

pub use self::sheet::sheet;
use super::{
    piece::{Content, Piece},
    tiles::Tiles,
    vertices::{at_pixels, at_vertices},
};
use crate::report::failure::Failure;

/// A game engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Engine {
    /// A landscape of Unreal Engine: 16-bit PNG of 127 to 8129 vertices per side, layers of 8 bits at the same vertices
    Unreal,
    /// A terrain of Unity: raw 16-bit codes of 33 to 4097 vertices per side, control textures with one texel less
    Unity,
    /// Terrain3D in Godot: OpenEXR in metres, control and colour maps of the same cells
    Godot,
}

impl Engine {
    /// Its name.
    #[must_use]
    pub const fn title(self) -> &'static str {
        match self {
            Self::Unreal => "Unreal Engine",
            Self::Unity => "Unity",
            Self::Godot => "Godot, Terrain3D",
        }
    }

    /// The name of the text file of import settings.
    #[must_use]
    pub const fn sheet_name(self) -> &'static str {
        match self {
            Self::Unreal => "unreal.txt",
            Self::Unity => "unity.txt",
            Self::Godot => "godot.txt",
        }
    }

    /// The endings of the file names of an output; empty for outputs that the engine cannot import.
    #[must_use]
    pub const fn ends(self, ty: PortType) -> &'static [&'static str] {
        match (self, ty) {
            (Self::Unity, PortType::Height) => &[".r16"],
            (Self::Godot, PortType::Height) => &[".exr"],
            (Self::Unreal, PortType::Weights) => &[".first.png", ".second.png", ".third.png", ".fourth.png"],
            (Self::Godot, PortType::Weights) => &[".control.exr"],
            (_, PortType::Height | PortType::Mask | PortType::Colour | PortType::Normal | PortType::Weights) => {
                &[".png"]
            }
            _ => &[],
        }
    }

    /// Refuses what the engine cannot import, before anything is computed: a world that is too large, and tiles.
    ///
    /// # Errors
    /// The failure states the maximum.
    pub fn check(self, cells: [u32; 2], tiles: Option<Tiles>) -> Result<(), Failure> {
        if self == Self::Godot && tiles.is_some() {
            return Err(
                Failure::wrong("Terrain3D imports whole maps, and divides them itself").hint("leave out `--tiles`")
            );
        }
        let most = godot::MOST_CELLS;
        if self == Self::Godot && cells.iter().any(|n| *n > most) {
            let [nx, ny] = cells;
            let message = format!("Terrain3D takes at most {most} cells a side; this world has {nx} x {ny}");
            return Err(Failure::wrong(message).hint("ask for fewer with `--cells`"));
        }
        Ok(())
    }

    /// An output as the engine imports it, a piece for each of [`Self::ends`]. A piece has the rasters of all tiles as one.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`] when the export is stopped.
    pub fn fit(self, output: &Exported<'_>) -> Result<Vec<Piece>, NodeError> {
        match self {
            Self::Unreal => unreal::fit(output),
            Self::Unity => unity::fit(output),
            Self::Godot => Ok(godot::fit(output)),
        }
    }

    /// Adds the position of a part of the world to the import settings of its heights.
    pub fn place(self, import: &mut Map<String, Value>, part: &Window) {
        let is_height = |name: &str| import.contains_key(name);
        let metres = |cells: [u32; 2]| cells.map(|cells| f64::from(cells) * part.cell_m());
        let ([east, south], [width, length], world_m) =
            (metres(part.origin), metres(part.cells), metres(part.world.cells));
        let position = match self {
            // centimetres, with y to the south; the location is the centre, and that of the whole world is the origin
            Self::Unreal if is_height("Scale Z") => json!({
                "Location X": millionths(100.0 * (east + 0.5 * (width - world_m[0]))),
                "Location Y": millionths(100.0 * (south + 0.5 * (length - world_m[1]))),
            }),
            // z points north, and a terrain lies at its south-west corner
            Self::Unity if is_height("Terrain Height") => {
                json!({"Position X": millionths(east), "Position Z": millionths(world_m[1] - south - length)})
            }
            _ => return,
        };
        import.extend(settings(position));
    }
}

/// An output to be exported.
#[derive(Clone, Copy)]
pub struct Exported<'a> {
    /// Its type.
    pub ty: PortType,
    /// Its raster.
    pub value: &'a Field,
    /// The tiles into which it is divided.
    pub tiles: Tiles,
    /// Whether integer codes are dithered.
    pub dither: bool,
    /// Returns false when the export is stopped.
    pub go_on: GoOn<'a>,
}

/// A number without rounding errors below a millionth, and without the sign of zero.
fn millionths(number: f64) -> f64 {
    (number * 1e6).round() / 1e6 + 0.0
}

/// A mask at vertices, in 8 bits.
fn mask_at(vertices: [u32; 2], mask: &Exported<'_>) -> Result<(Field, Content), NodeError> {
    let content = Content::numbers(PortType::Mask, Format::Png8, mask.dither);
    Ok((at_vertices(mask.value, vertices, mask.go_on)?, content))
}

/// Colours as a texture for each tile, with powers of two as its size: other sizes get no mip-maps (Unreal Engine) or are
/// resized to powers of two (Unity).
fn texture(colour: &Exported<'_>) -> Result<Field, NodeError> {
    let power = |cells: u32| (0..=13).map(|power| 1_u32 << power).min_by_key(|side| side.abs_diff(cells)).unwrap_or(1);
    let Exported { value, tiles, go_on, .. } = *colour;
    at_pixels(value, tiles.whole(tiles.cells(value.window().cells).map(power), 0), go_on)
}

/// Normals as a texture for each tile, normalised again.
fn normal_texture(normal: &Exported<'_>) -> Result<Field, NodeError> {
    let (texture, normal) = (texture(normal)?, normal.value);
    if texture.window().cells == normal.window().cells {
        return Ok(texture);
    }
    let (window, len) = (*texture.window(), texture.window().len());
    let mut samples = texture.into_samples();
    let (x, rest) = samples.split_at_mut(len);
    let (y, z) = rest.split_at_mut(len);
    for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
        let length = (*x * *x + *y * *y + *z * *z).sqrt();
        // opposite normals can cancel; the ground is level then
        [*x, *y, *z] = if length > 0.0 { [*x / length, *y / length, *z / length] } else { [0.0, 0.0, 1.0] };
    }
    Ok(Field::with_planes(window, 3, samples))
}

/// Codes over the range of heights.
fn codes(format: Format, range: [f64; 2], dither: bool) -> Content {
    Content::Numbers(format, Writing { range: Some(range), dither, ..Writing::default() })
}

/// Minimum and maximum height; one metre apart for level ground, because an engine's terrain needs an extent.
fn span(height: &Field) -> [f64; 2] {
    let (low, high) = height.range(0).map_or((0.0, 0.0), |(low, high)| (f64::from(low), f64::from(high)));
    [low, if high > low { high } else { low + 1.0 }]
}

/// Import settings; numbers have nine digits, enough to identify single precision.
fn settings(value: Value) -> Map<String, Value> {
    let Value::Object(mut map) = value else { return Map::new() };
    for value in map.values_mut() {
        if let Some(number) = value.as_f64().filter(|_| value.is_f64()) {
            *value = short(number).into();
        }
    }
    map
}

/// A number of nine digits.
fn short(number: f64) -> f64 {
    format!("{number:.8e}").parse().unwrap_or(number)
}
