//! How outputs are written: the options of the command line.

use orograph_graph::PortType;
use orograph_nodes::raster::Format;

use crate::export::{
    engine::Engine,
    geojson::LinesIn,
    mesh::{MOST_TRIANGLES, MeshFormat},
    tiles::Tiles,
};

/// How outputs are written.
#[derive(Clone, Debug, clap::Args)]
pub struct OutputOptions {
    /// Format of heights, masks and other scalars; colours are PNG, lines GeoJSON, reports JSON
    ///
    /// png16 and r16 store integers from 0 to 65535, png8 from 0 to 255, over the range that the JSON file beside them
    /// states: 0 to 1 for masks, lowest to highest for everything else.
    #[arg(long, default_value = "exr", value_name = "FORMAT", value_parser = formats())]
    pub format: Format,
    /// Write heights, masks, weights, colours and normals for import in a game engine, with its import settings
    ///
    /// The import settings are printed and written to ENGINE.txt and the JSON files. Outputs that the engine cannot
    /// import are written in `--format`.
    #[arg(long, value_enum, value_name = "ENGINE")]
    pub engine: Option<Engine>,
    /// Divide every raster into equal tiles of one range, with names such as `NAME_x0_y0.png` from the north-west
    ///
    /// Tiles have equal numbers of cells. With `--engine`, they have sizes that the engine imports, and neighbours share
    /// the vertices of their common edge. Previews and meshes stay whole.
    #[arg(long, value_name = "N|CxR", conflicts_with = "window")]
    pub tiles: Option<Tiles>,
    /// Dither to avoid banding: round at random to one of the two nearest codes
    #[arg(long)]
    pub dither: bool,
    /// Also write each height, and the lakes of `Lakes.outlines`, as a mesh (`NAME.glb` or `NAME.obj`), in metres with
    /// y up
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub mesh: Option<MeshFormat>,
    /// Maximum number of triangles of a mesh
    #[arg(long, value_name = "N", default_value_t = OutputOptions::TRIANGLES, requires = "mesh",
        value_parser = clap::value_parser!(u64).range(2..=MOST_TRIANGLES))]
    pub triangles: u64,
    /// Coordinates of lines; without it, degrees of WGS84 where the world has a `place`, and metres elsewhere
    #[arg(long, value_enum, value_name = "COORDINATES")]
    pub lines: Option<LinesIn>,
    /// Write heights, masks and other scalars without data where this mask is below one half, such as `dem.data`
    ///
    /// The files then have NaN there, which GeoTIFF declares as no data and Terrain3D shows as holes.
    #[arg(long, value_name = "NODE.PORT")]
    pub holes: Option<String>,
    /// Do not write the shaded pictures of heights (`NAME.preview.png`)
    #[arg(long)]
    pub no_preview: bool,
}

impl Default for OutputOptions {
    /// The defaults of the command line.
    fn default() -> Self {
        Self {
            format: Format::Exr,
            engine: None,
            tiles: None,
            dither: false,
            mesh: None,
            triangles: Self::TRIANGLES,
            lines: None,
            holes: None,
            no_preview: false,
        }
    }
}

impl OutputOptions {
    /// The default maximum number of triangles of a mesh.
    const TRIANGLES: u64 = 500_000;

    /// The tiles; None for a single one.
    #[must_use]
    pub fn tiles(&self) -> Option<Tiles> {
        self.tiles.filter(|tiles| *tiles != Tiles::WHOLE)
    }

    /// Returns true if outputs of this type are written in the chosen format.
    #[must_use]
    pub fn has_format(&self, ty: PortType) -> bool {
        let has_numbers = matches!(
            ty,
            PortType::Height | PortType::Mask | PortType::Scalar(_) | PortType::AnyScalar | PortType::Vector(_)
        );
        has_numbers && self.ends(ty).is_empty()
    }

    /// The file name endings of an output for the engine; empty if the output is written as without an engine.
    pub(super) fn ends(&self, ty: PortType) -> &'static [&'static str] {
        self.engine.map_or(&[], |engine| engine.ends(ty))
    }
}

fn formats() -> impl clap::builder::TypedValueParser<Value = Format> {
    use clap::builder::{PossibleValuesParser, TypedValueParser as _};
    let names = PossibleValuesParser::new(Format::ALL.map(Format::name));
    names.try_map(|name| Format::from_name(&name).ok_or("no such format"))
}
