//! Heights in the form that game engines import, and what to type there.
//!
//! Sources: Epic Games, "Landscape Technical Guide" (valid sizes; heights of 1/128 cm times the scale around 32768); Unity
//! Technologies, "Terrain settings" and "Working with heightmaps"; Terrain3D, "Import Formats".

use clap::ValueEnum;
use orograph_graph::{Field, NodeError};
use orograph_nodes::raster::{Format, GoOn, Writing};
use serde_json::{Map, Value, json};

use crate::vertices::{at_vertices, extent, spacing};

/// A game engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Engine {
    /// A landscape of Unreal Engine: 16-bit PNG of 127 to 8129 vertices a side
    Unreal,
    /// A terrain of Unity: raw 16-bit codes of 33 to 4097 vertices a side
    Unity,
    /// Terrain3D in Godot: OpenEXR in metres
    Godot,
}

/// A height as an engine takes it.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The heights at the engine's vertices.
    pub height: Field,
    /// How they are written.
    pub writing: Writing,
    /// What to type there, by the engine's own names.
    pub import: Map<String, Value>,
}

impl Engine {
    /// The format of the file.
    #[must_use]
    pub const fn format(self) -> Format {
        match self {
            Self::Unreal => Format::Png16,
            Self::Unity => Format::R16,
            Self::Godot => Format::Exr,
        }
    }

    /// Its name.
    #[must_use]
    pub const fn title(self) -> &'static str {
        match self {
            Self::Unreal => "Unreal Engine",
            Self::Unity => "Unity",
            Self::Godot => "Godot, Terrain3D",
        }
    }

    /// Heights as it takes them. `dither` is for its 16-bit codes.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`] when `go_on` said no.
    pub fn fit(self, height: &Field, dither: bool, go_on: GoOn<'_>) -> Result<Fitted, NodeError> {
        match self {
            Self::Unreal => unreal(height, dither, go_on),
            Self::Unity => unity(height, dither, go_on),
            Self::Godot => Ok(godot(height)),
        }
    }
}

/// Squares along a side of a component of a landscape: two sections of 63 or of 127.
const COMPONENTS: [u32; 2] = [126, 254];
/// The most components along a side.
const MOST_COMPONENTS: u32 = 32;

fn unreal(height: &Field, dither: bool, go_on: GoOn<'_>) -> Result<Fitted, NodeError> {
    let cells = height.window().cells;
    let [small, large] = COMPONENTS;
    let squares = if cells.iter().all(|n| *n <= MOST_COMPONENTS * (small + 2)) { small } else { large };
    let components = cells.map(|n| ((n + squares / 2) / squares).clamp(1, MOST_COMPONENTS));
    let vertices = components.map(|n| n * squares + 1);
    let grid = at_vertices(height, vertices, go_on)?;
    let [low, high] = span(&grid);
    let [x_cm, y_cm] = spacing(height, vertices).map(|metres| 100.0 * metres);
    // 65535 codes of 1/128 cm times the scale; code 32768 lies at the actor's own height
    let z_scale = (high - low) * 100.0 * 128.0 / 65_535.0;
    let section = squares / 2;
    let import = settings(json!({
        "Section Size": format!("{section}x{section} Quads"),
        "Sections Per Component": "2x2 Sections",
        "Number of Components": format!("{} x {}", components[0], components[1]),
        "Overall Resolution": format!("{} x {}", vertices[0], vertices[1]),
        "Location Z": low * 100.0 + 256.0 * z_scale,
        "Scale X": x_cm,
        "Scale Y": y_cm,
        "Scale Z": z_scale,
    }));
    Ok(Fitted { height: grid, writing: Writing { range: Some([low, high]), dither, red: false }, import })
}

fn unity(height: &Field, dither: bool, go_on: GoOn<'_>) -> Result<Fitted, NodeError> {
    let longest = height.window().cells[0].max(height.window().cells[1]);
    let sizes = (5..=12).map(|power| (1_u32 << power) + 1);
    let side = sizes.min_by_key(|side| side.abs_diff(longest)).unwrap_or(4097);
    let grid = at_vertices(height, [side; 2], go_on)?;
    let [low, high] = span(&grid);
    let [width, length] = extent(height);
    let import = settings(json!({
        "Heightmap Resolution": side,
        "Depth": "Bit 16",
        "Byte Order": "Windows",
        "Flip Vertically": true,
        "Terrain Width": width,
        "Terrain Length": length,
        "Terrain Height": high - low,
        "Position Y": low,
    }));
    Ok(Fitted { height: grid, writing: Writing { range: Some([low, high]), dither, red: false }, import })
}

fn godot(height: &Field) -> Fitted {
    let [nx, ny] = height.window().cells;
    let regions = [2048_u32, 1024, 512, 256, 128, 64];
    // where none divides both sides, the regions at the east and south are filled up
    let region = regions.into_iter().find(|side| nx % side == 0 && ny % side == 0).unwrap_or(256);
    let import = settings(json!({
        "Import Scale": 1,
        "Height Offset": 0,
        "Vertex Spacing": height.window().cell_m(),
        "Region Size": region,
    }));
    Fitted { height: height.clone(), writing: Writing { red: true, ..Writing::default() }, import }
}

/// What is typed into an engine: numbers of nine digits, which tell single precision apart.
fn settings(value: Value) -> Map<String, Value> {
    let Value::Object(mut map) = value else { return Map::new() };
    for value in map.values_mut() {
        if let Some(number) = value.as_f64().filter(|_| value.is_f64())
            && let Ok(short) = format!("{number:.8e}").parse::<f64>()
        {
            *value = short.into();
        }
    }
    map
}

/// Lowest and highest height; a metre for level ground, since an engine's terrain has an extent.
fn span(height: &Field) -> [f64; 2] {
    let (low, high) = height.range(0).map_or((0.0, 0.0), |(low, high)| (f64::from(low), f64::from(high)));
    [low, if high > low { high } else { low + 1.0 }]
}

#[cfg(test)]
mod tests {

    use super::*;
    use crate::testing::field;

    fn fit(engine: Engine, height: &Field) -> Fitted {
        engine.fit(height, false, &|| true).expect("not stopped")
    }

    fn number(fitted: &Fitted, name: &str) -> f64 {
        fitted.import[name].as_f64().expect("a number to type")
    }

    /// The sizes that Epic recommends, from the nearest powers of two.
    #[test]
    fn landscapes_have_sizes_that_unreal_takes() {
        for (cells, vertices, components) in [
            (64, 127, "1 x 1"),
            (256, 253, "2 x 2"),
            (512, 505, "4 x 4"),
            (1024, 1009, "8 x 8"),
            (2048, 2017, "16 x 16"),
        ] {
            let fitted = fit(Engine::Unreal, &field([cells; 2], 4.0, |x, y| x + y));
            assert_eq!(fitted.height.window().cells, [vertices; 2]);
            assert_eq!(fitted.import["Number of Components"], components);
            let spacing = f64::from(cells) * 400.0 / f64::from(vertices - 1);
            assert!((number(&fitted, "Scale X") / spacing - 1.0).abs() < 5e-9, "nine digits of {spacing}");
        }
        let wide = fit(Engine::Unreal, &field([4200, 40], 2.0, |x, _| x));
        assert_eq!(wide.height.window().cells, [4319, 255]);
        assert_eq!(wide.import["Section Size"], "127x127 Quads");
    }

    /// Decoded as Unreal does, the lowest and highest codes are the lowest and highest heights.
    #[test]
    fn codes_become_heights_again_in_unreal() {
        let fitted = fit(Engine::Unreal, &field([256; 2], 8.0, |x, y| 0.4 * x - 0.2 * y - 90.0));
        let [low, high] = fitted.writing.range.expect("codes over a range");
        let metres = |code: f64| {
            (number(&fitted, "Location Z") + (code - 32_768.0) / 128.0 * number(&fitted, "Scale Z")) / 100.0
        };
        // numbers of nine digits: half a unit of the last is 5e-9 of some 1e4 cm
        assert!((metres(0.0) - low).abs() < 1e-6 && (metres(65_535.0) - high).abs() < 1e-6);
    }

    #[test]
    fn terrains_have_sizes_that_unity_takes() {
        for (cells, side) in [([20, 10], 33), ([512, 512], 513), ([1024, 500], 1025), ([5000, 40], 4097)] {
            let fitted = fit(Engine::Unity, &field(cells, 3.0, |x, y| 50.0 + x * 0.1 + y));
            assert_eq!(fitted.height.window().cells, [side; 2]);
            assert_eq!(number(&fitted, "Terrain Width"), f64::from(cells[0]) * 3.0);
            assert_eq!(number(&fitted, "Terrain Length"), f64::from(cells[1]) * 3.0);
            let [low, high] = fitted.writing.range.expect("codes over a range");
            let typed = [number(&fitted, "Position Y"), number(&fitted, "Terrain Height")];
            let near = |[typed, whole]: [f64; 2]| (typed - whole).abs() <= 5e-9 * whole.abs(); // nine digits
            assert!(near([typed[0], low]) && near([typed[1], high - low]), "{typed:?} {low} {high}");
        }
    }

    /// A plane is a plane again at finer vertices; at coarser ones, the mean of whole and cut cells lies up to an eighth of a
    /// cell beside its place.
    #[test]
    fn vertices_have_the_heights_of_their_places() {
        for (cells, most) in [(90, 1e-3), (300, 10.0 / 8.0 * (0.3 + 0.2))] {
            let plane = |x: f64, y: f64| 0.3 * x - 0.2 * y + 7.0;
            let fitted = fit(Engine::Unreal, &field([cells; 2], 10.0, plane));
            let vertices = fitted.height.window().cells[0] as usize;
            let spacing = number(&fitted, "Scale X") / 100.0;
            for j in 3..vertices - 3 {
                for i in 3..vertices - 3 {
                    let expected = plane(i as f64 * spacing, j as f64 * spacing);
                    let got = f64::from(fitted.height.samples()[j * vertices + i]);
                    assert!((got - expected).abs() < most, "{i} {j}: {got} {expected}"); // heights are single precision
                }
            }
        }
    }

    #[test]
    fn terrain3d_takes_the_heights_as_they_are() {
        let height = field([192, 128], 5.0, |x, _| x);
        let fitted = fit(Engine::Godot, &height);
        assert_eq!(fitted.height, height);
        assert_eq!((number(&fitted, "Region Size"), number(&fitted, "Vertex Spacing")), (64.0, 5.0));
        assert!(fitted.writing.red && fitted.writing.range.is_none());
    }

    #[test]
    fn level_and_tiny_worlds_have_an_extent() {
        for engine in [Engine::Unreal, Engine::Unity, Engine::Godot] {
            let fitted = fit(engine, &field([1, 1], 1000.0, |_, _| -5.0));
            assert!(fitted.height.samples().iter().all(|v| *v == -5.0));
            assert!(fitted.writing.range.is_none_or(|range| range == [-5.0, -4.0]), "{engine:?}");
        }
        assert!(Engine::Unity.fit(&field([9, 9], 1.0, |x, _| x), false, &|| false).is_err());
    }
}
