//! In which form outputs are written: the options of the command line.

use orograph_graph::PortType;
use orograph_nodes::raster::Format;

use crate::{
    engine::Engine,
    mesh::{MOST_TRIANGLES, MeshFormat},
};

/// In which form outputs are written.
#[derive(Clone, Debug, clap::Args)]
pub struct Form {
    /// Format of heights, masks and other scalars; colours are PNG, lines GeoJSON, reports JSON
    ///
    /// png16 and r16 hold whole numbers from 0 to 65535, png8 from 0 to 255, over the range that the JSON file beside them
    /// states: 0 to 1 for masks, lowest to highest for the rest.
    #[arg(long, default_value = "exr", value_name = "FORMAT", value_parser = formats())]
    pub format: Format,
    /// Write heights, masks, weights, colours and normals as a game engine imports them, and what to type there
    ///
    /// What to type is printed and stands in ENGINE.txt and the JSON files. What an engine has no place for is as `--format`
    /// says.
    #[arg(long, value_enum, value_name = "ENGINE")]
    pub engine: Option<Engine>,
    /// Round to whole codes at random between the two nearest: a fine grain in place of terraces
    #[arg(long)]
    pub dither: bool,
    /// Write each height as a mesh too (`NAME.glb` or `NAME.obj`), in metres with y up
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub mesh: Option<MeshFormat>,
    /// The most triangles of a mesh
    #[arg(long, value_name = "N", default_value_t = Form::TRIANGLES, requires = "mesh",
        value_parser = clap::value_parser!(u64).range(2..=MOST_TRIANGLES))]
    pub triangles: u64,
    /// Leave out the shaded pictures of heights (`NAME.preview.png`)
    #[arg(long)]
    pub no_preview: bool,
}

impl Default for Form {
    /// The defaults of the command line.
    fn default() -> Self {
        Self {
            format: Format::Exr,
            engine: None,
            dither: false,
            mesh: None,
            triangles: Self::TRIANGLES,
            no_preview: false,
        }
    }
}

impl Form {
    /// The most triangles of a mesh by default.
    const TRIANGLES: u64 = 500_000;

    /// What an engine calls the files of an output; none where it is written as without one.
    pub(super) fn ends(&self, ty: PortType) -> &'static [&'static str] {
        self.engine.map_or(&[], |engine| engine.ends(ty))
    }
}

fn formats() -> impl clap::builder::TypedValueParser<Value = Format> {
    use clap::builder::{PossibleValuesParser, TypedValueParser as _};
    let names = PossibleValuesParser::new(Format::ALL.map(Format::name));
    names.try_map(|name| Format::from_name(&name).ok_or("no such format"))
}
