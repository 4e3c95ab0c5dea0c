//! File formats, and the metadata of a file.

use orograph_graph::{Field, PortType, Window};

/// A format for heights, masks and scalars.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR, 32-bit floats, uncompressed.
    Exr,
    /// 16-bit grey PNG: codes over a range.
    Png16,
    /// 8-bit grey PNG: codes over a range, for masks.
    Png8,
    /// GeoTIFF, 32-bit floats, with cell size.
    Tiff,
    /// The same as cloud-optimised GeoTIFF: compressed tiles and overviews.
    Cog,
    /// Raw 16-bit codes over a range, little-endian.
    R16,
    /// Raw 32-bit floats, little-endian.
    R32,
}

impl Format {
    /// Every format, best first.
    pub const ALL: [Self; 7] = [Self::Exr, Self::Png16, Self::Png8, Self::Tiff, Self::Cog, Self::R16, Self::R32];

    /// Returns the name of the format on a command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Exr => "exr",
            Self::Png16 => "png16",
            Self::Png8 => "png8",
            Self::Tiff => "tiff",
            Self::Cog => "cog",
            Self::R16 => "r16",
            Self::R32 => "r32",
        }
    }

    /// Returns the extension of its files.
    #[must_use]
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Exr => "exr",
            Self::Png16 | Self::Png8 => "png",
            Self::Tiff | Self::Cog => "tif",
            Self::R16 => "r16",
            Self::R32 => "r32",
        }
    }

    /// Returns the format with that name. Returns None if there is none.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.name() == name)
    }

    /// Returns the largest code of a format of integer codes. Returns None if the format stores floating-point numbers.
    #[must_use]
    pub const fn largest_code(self) -> Option<u16> {
        match self {
            Self::Png16 | Self::R16 => Some(u16::MAX),
            Self::Png8 => Some(255),
            Self::Exr | Self::Tiff | Self::Cog | Self::R32 => None,
        }
    }
}

/// Options for writing samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Writing {
    /// Values of the lowest and the largest code of a format of codes; values beyond are clamped. `None` uses the
    /// minimum and maximum. Tiles of one world need the same range to match.
    pub range: Option<[f64; 2]>,
    /// Dithers: rounds at random to one of the two nearest codes, so that the mean is the value. Gentle slopes then
    /// show a grain of half a step instead of terraces. The draw depends only on the cell's position in the world.
    pub dither: bool,
    /// Names the channel of an OpenEXR file `R`, which some programs require, instead of `Y`.
    pub red: bool,
    /// The plane to write, if the field has several.
    pub plane: usize,
}

/// Metadata of a sidecar that the raster itself does not give.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Meta {
    /// Quantity of the values, such as `height`.
    pub quantity: String,
    /// Symbol of their unit.
    pub unit: String,
    /// Finer cells along the side of each cell that the values were computed from, if there were several.
    pub supersample: Option<u32>,
    /// Hash of the graph that built the values.
    pub graph_hash: Option<String>,
    /// Import settings for another program.
    pub import: Option<serde_json::Map<String, serde_json::Value>>,
    /// The window of the world that the raster shows, if its grid differs from that of the world.
    pub shows: Option<Window>,
}

/// The content of a file, and its format.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Content {
    /// The samples of one plane.
    Numbers(Format, Writing),
    /// Three planes of linear RGB, 0 to 1, as an 8-bit sRGB picture.
    Colour,
    /// As `Colour`, with an alpha of 127, for the colour map of Terrain3D: its alpha makes ground rougher above one
    /// half and wetter below, and 127 is the default of unpainted ground.
    Tint,
    /// Unit normals, -1 to 1 in each of three planes, as 16-bit red, green and blue: -1 is 0, 1 is 65535.
    Normal,
    /// The weights of four layers as 8-bit red, green, blue and alpha that sum to 255 in every cell.
    Weights,
    /// The weights of four layers as a control map of Terrain3D: OpenEXR with bit fields as numbers.
    ///
    /// A cell has two textures, the layers of the largest weights, numbered from 0: the lower number is the base, the
    /// higher one the overlay, blended by its fraction of their sum. An overlay that would cover the base completely
    /// becomes the base. The other two layers are left out.
    Control,
}

impl Content {
    /// Returns the content of scalars in a format: masks over 0 to 1, others over their own range.
    #[must_use]
    pub fn numbers(ty: PortType, format: Format, dither: bool) -> Self {
        let range = (ty == PortType::Mask).then_some([0.0, 1.0]);
        Self::Numbers(format, Writing { range, dither, ..Writing::default() })
    }

    /// Returns the same content of another plane.
    #[must_use]
    pub fn of_plane(self, plane: usize) -> Self {
        match self {
            Self::Numbers(format, writing) => Self::Numbers(format, Writing { plane, ..writing }),
            other => other,
        }
    }

    /// Returns true if the whole raster must be known before the first row can be written: in a format of codes over
    /// the range of the raster itself. [`Self::over`] returns a content that does not need it.
    #[must_use]
    pub const fn needs_whole(&self) -> bool {
        matches!(self, Self::Numbers(format, writing) if format.largest_code().is_some() && writing.range.is_none())
    }

    /// Returns the same content with the range of this raster.
    #[must_use]
    pub fn over(self, whole: &Field) -> Self {
        match self {
            Self::Numbers(format, writing) if self.needs_whole() => {
                let range = whole.range(writing.plane).map_or([0.0, 0.0], |(lo, hi)| [f64::from(lo), f64::from(hi)]);
                Self::Numbers(format, Writing { range: Some(range), ..writing })
            }
            other => other,
        }
    }

    /// Returns the minimum number of planes that a field needs for it.
    pub(super) const fn planes(&self) -> usize {
        match self {
            Self::Numbers(_, writing) => writing.plane + 1,
            Self::Colour | Self::Tint | Self::Normal => 3,
            Self::Weights | Self::Control => 4,
        }
    }
}
