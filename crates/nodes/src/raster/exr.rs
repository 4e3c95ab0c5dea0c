//! OpenEXR: floating-point numbers in named channels.
//!
//! Source: Academy Software Foundation, "OpenEXR File Layout". Read: of the first layer the channel `Y`, else `Z`,
//! `height` or `R`, else the first; 16-bit and 32-bit floats and integers. Written: one channel of 32-bit floats, `Y`
//! or `R`.

use std::io::{self, Seek};

use ::exr::{
    compression::Compression,
    error::Error,
    meta::{
        BlockDescription, MetaData,
        attribute::{ChannelDescription, LineOrder, SampleType},
        header::Header,
        magic_number,
    },
    prelude::{FlatSamples, ReadChannels, ReadLayers, SmallVec, read as reader},
};

use orograph_graph::memory::collected;

use super::{
    GoOn, MAX_RATIO, Problem, Sidecar, claimed_cells,
    reader::{Each, Head, Reader, Rows, Source},
};

/// Names of a height channel, best first.
const CHANNELS: [&str; 4] = ["Y", "Z", "height", "R"];

/// Opens the first layer.
pub(super) fn open<'a>(mut source: Source<'a>, sidecar: Option<&Sidecar>) -> Result<Reader<'a>, Problem> {
    let meta = MetaData::read_from_buffered(&mut source.bytes, false).map_err(fault)?;
    for header in &meta.headers {
        if header.deep {
            return Err(Problem::Unsupported {
                what: "deep data".into(),
                remedy: "export a flat image with one height channel",
            });
        }
        let [columns, rows] = [header.layer_size.0 as u64, header.layer_size.1 as u64];
        claimed_cells(columns, rows, header.channels.bytes_per_pixel as u64, source.length, MAX_RATIO)?;
    }
    let Some(first) = meta.headers.first() else {
        return Err(Problem::damaged("it has no layers"));
    };
    source.bytes.rewind().map_err(Problem::Unreadable)?;
    let mut head = Head::new(first.layer_size.0, first.layer_size.1);
    sidecar.into_iter().for_each(|sidecar| sidecar.locate(&mut head));
    head.assumes_voids = sidecar.is_none();
    let cell_bytes = first.channels.bytes_per_pixel;
    Ok(Reader { head: head.clone(), rows: Box::new(Layer { source, head, cell_bytes }) })
}

/// A layer, which is unpacked whole.
struct Layer<'a> {
    source: Source<'a>,
    head: Head,
    cell_bytes: usize,
}

impl Rows for Layer<'_> {
    /// Works on the calling thread: the crate's own thread pool would ignore the requested number of threads.
    fn read(self: Box<Self>, _: GoOn<'_>, each: &mut Each<'_>) -> Result<(), Problem> {
        let image = reader()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .non_parallel()
            .from_buffered(self.source.bytes)
            .map_err(fault)?;
        let layer = image.layer_data;
        if (layer.size.0, layer.size.1) != (self.head.columns, self.head.rows) {
            return Err(Problem::damaged("its first layer cannot be read"));
        }
        let channels = layer.channel_data.list;
        let found = CHANNELS.iter().find_map(|name| channels.iter().position(|c| c.name.eq_case_insensitive(name)));
        let Some(channel) = channels.into_iter().nth(found.unwrap_or(0)) else {
            return Err(Problem::damaged("it has no channels"));
        };
        let mut samples = match channel.sample_data {
            FlatSamples::F32(samples) => samples,
            FlatSamples::F16(samples) => collected(samples.iter().map(|v| v.to_f32()))?,
            FlatSamples::U32(samples) => collected(samples.iter().map(|v| *v as f32))?,
        };
        if samples.len() != self.head.columns * self.head.rows {
            return Err(Problem::Unsupported {
                what: format!("the subsampled channel `{}`", channel.name),
                remedy: "export the height channel at full resolution",
            });
        }
        each(0, &mut samples)
    }

    fn bytes(&self) -> u64 {
        (self.head.columns * self.head.rows * (self.cell_bytes + size_of::<f32>())) as u64
    }

    fn block_rows(&self, head: &Head) -> usize {
        head.rows
    }
}

fn fault(error: Error) -> Problem {
    match error {
        Error::NotSupported(what) => Problem::Unsupported {
            what: what.into_owned(),
            remedy: "export it again without compression or with ZIP, as scan lines",
        },
        Error::Io(_) => Problem::truncated("it ends in the middle of a block"),
        other => Problem::damaged(other.to_string()),
    }
}

/// Bytes before each row of an uncompressed file: its number and its length.
pub(super) const BEFORE_ROW: usize = 8;

/// Returns the bytes before the rows: the header of one channel of 32-bit floats with that name, `Y` by convention, and
/// the offsets of the rows.
///
/// The file is uncompressed: the noise-like mantissas of a 2048 x 2048 terrain shrink by only 1 % (ZIP1) to 9 %
/// (ZIP16), and compression takes 30 to 50 times as long.
pub(super) fn header([columns, rows]: [u32; 2], channel: &str) -> io::Result<Vec<u8>> {
    let channel = ChannelDescription::named(channel, SampleType::F32);
    let size = (columns as usize, rows as usize);
    let header = Header::new("height".into(), size, SmallVec::from_elem(channel, 1)).with_encoding(
        Compression::Uncompressed,
        BlockDescription::ScanLines,
        LineOrder::Increasing,
    );
    let headers = [header];
    let mut bytes = Vec::new();
    let mut encode = || {
        magic_number::write(&mut bytes)?;
        MetaData::validate(&headers, true)?.write(&mut bytes)?;
        Header::write_all(&headers, &mut bytes, false)
    };
    encode().map_err(io::Error::other)?;
    let row = BEFORE_ROW as u64 + 4 * u64::from(columns);
    let first = bytes.len() as u64 + 8 * u64::from(rows);
    bytes.extend((0..u64::from(rows)).flat_map(|j| (first + j * row).to_le_bytes()));
    Ok(bytes)
}

/// The bytes before a row.
pub(super) fn before_row(row: usize, columns: usize) -> [u8; BEFORE_ROW] {
    (row as u64 | (4 * columns as u64) << 32).to_le_bytes()
}
