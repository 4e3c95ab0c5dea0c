//! The beginning of the file: one directory for each level, in the order of their size.
//!
//! This module writes the directories itself: the `tiff` crate writes the values of tags before their directory, which
//! places the first directory behind the table of the tiles, where programs that read over a network do not look for
//! it.

use orograph_graph::Window;

use super::tiles::TILE;
use crate::raster::geotiff::{directory::tag, place::Place};

/// The type of an image: 1 for an overview.
const NEW_SUBFILE_TYPE: u16 = 254;

/// The raster or an overview.
#[derive(Clone)]
pub(super) struct Image {
    /// Columns and rows.
    pub(super) cells: [usize; 2],
    /// The tiles, row by row.
    pub(super) tiles: Vec<Tile>,
}

/// Where the bytes of a tile are.
#[derive(Clone, Copy)]
pub(super) struct Tile {
    pub(super) at: u64,
    pub(super) bytes: u64,
}

/// The values of a tag.
enum Values {
    Text(String),
    Shorts(Vec<u16>),
    Longs(Vec<u32>),
    Reals(Vec<f64>),
    /// Places in a file of more than 4 GB.
    Places(Vec<u64>),
}

impl Values {
    /// The number of their type in the file, how many there are, and their bytes.
    fn encoded(&self) -> (u16, usize, Vec<u8>) {
        match self {
            Self::Text(text) => (2, text.len() + 1, text.bytes().chain([0]).collect()),
            Self::Shorts(values) => (3, values.len(), values.iter().flat_map(|v| v.to_le_bytes()).collect()),
            Self::Longs(values) => (4, values.len(), values.iter().flat_map(|v| v.to_le_bytes()).collect()),
            Self::Reals(values) => (12, values.len(), values.iter().flat_map(|v| v.to_le_bytes()).collect()),
            Self::Places(values) => (16, values.len(), values.iter().flat_map(|v| v.to_le_bytes()).collect()),
        }
    }
}

/// Returns the bytes before the first tile: the header and the directories. Their number does not depend on the places.
pub(super) fn head(images: &[Image], window: &Window, has_voids: bool, is_big: bool) -> Vec<u8> {
    let mut out: Vec<u8> = if is_big {
        vec![b'I', b'I', 43, 0, 8, 0, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0]
    } else {
        vec![b'I', b'I', 42, 0, 8, 0, 0, 0]
    };
    for (level, image) in images.iter().enumerate() {
        let mut tags = tags(image, has_voids, is_big);
        if level > 0 {
            tags.push((NEW_SUBFILE_TYPE, Values::Longs(vec![1])));
        } else {
            let Place { scale, tiepoint, keys, citation } = Place::of(window);
            tags.push((tag::MODEL_PIXEL_SCALE, Values::Reals(scale.to_vec())));
            tags.push((tag::MODEL_TIEPOINT, Values::Reals(tiepoint.to_vec())));
            tags.push((tag::GEO_KEY_DIRECTORY, Values::Shorts(keys.to_vec())));
            tags.extend(citation.map(|text| (tag::GEO_ASCII_PARAMS, Values::Text(text.to_owned()))));
        }
        tags.sort_by_key(|(name, _)| *name);
        append(&mut out, &tags, level + 1 == images.len(), is_big);
    }
    out
}

/// The tags that each level has.
fn tags(image: &Image, has_voids: bool, is_big: bool) -> Vec<(u16, Values)> {
    let [columns, rows] = image.cells.map(|side| Values::Longs(vec![side as u32]));
    let short = |value| Values::Shorts(vec![value]);
    let places = image.tiles.iter().map(|tile| tile.at);
    let places =
        if is_big { Values::Places(places.collect()) } else { Values::Longs(places.map(|at| at as u32).collect()) };
    let mut tags = vec![
        (tag::IMAGE_WIDTH, columns),
        (tag::IMAGE_LENGTH, rows),
        (tag::BITS_PER_SAMPLE, short(32)),
        // deflate
        (tag::COMPRESSION, short(8)),
        // 0 is black
        (tag::PHOTOMETRIC, short(1)),
        (tag::SAMPLES_PER_PIXEL, short(1)),
        (tag::PLANAR_CONFIGURATION, short(1)),
        // of floating-point numbers
        (tag::PREDICTOR, short(3)),
        (tag::TILE_WIDTH, short(TILE as u16)),
        (tag::TILE_LENGTH, short(TILE as u16)),
        (tag::TILE_OFFSETS, places),
        (tag::TILE_BYTE_COUNTS, Values::Longs(image.tiles.iter().map(|tile| tile.bytes as u32).collect())),
        // floating-point numbers
        (tag::SAMPLE_FORMAT, short(3)),
    ];
    if has_voids {
        tags.push((tag::GDAL_NODATA, Values::Text("nan".to_owned())));
    }
    tags
}

/// Appends a directory and the values that do not fit into it.
fn append(out: &mut Vec<u8>, tags: &[(u16, Values)], is_last: bool, is_big: bool) {
    let word = if is_big { 8 } else { 4 };
    let number = |value: usize| (value as u64).to_le_bytes().into_iter().take(word);
    let (counter, entry) = if is_big { (8, 20) } else { (2, 12) };
    let start = out.len() + counter + entry * tags.len() + word;
    let mut values: Vec<u8> = Vec::new();
    out.extend((tags.len() as u64).to_le_bytes().into_iter().take(counter));
    for (name, tag) in tags {
        let (kind, count, bytes) = tag.encoded();
        out.extend(name.to_le_bytes().into_iter().chain(kind.to_le_bytes()).chain(number(count)));
        if bytes.len() <= word {
            out.extend(bytes.iter().copied().chain(std::iter::repeat(0)).take(word));
        } else {
            out.extend(number(start + values.len()));
            values.extend(&bytes);
            // values begin at even places
            values.resize(values.len().next_multiple_of(8), 0);
        }
    }
    let next = if is_last { 0 } else { start + values.len() };
    out.extend(number(next));
    out.extend(values);
}
