//! Reads a layer block by block: scan lines or tiles, in any order of the file.

use std::io::{Read, Seek, SeekFrom};

use ::exr::{
    block::{UncompressedBlock, chunk::Chunk},
    error::Error,
    meta::{
        BlockDescription, MetaData,
        attribute::{ChannelDescription, SampleType},
    },
    prelude::{Vec2, f16},
};

use orograph_graph::memory::filled;

use crate::raster::{
    GoOn, MAX_RATIO, Problem, Sidecar, claimed_cells,
    reader::{BLOCK, Each, Head, Reader, Rows, Source},
};

/// Names of a height channel, best first.
const CHANNELS: [&str; 4] = ["Y", "Z", "height", "R"];

/// Maximum number of bytes in memory: blocks of 16 MiB, or 32 MiB in a row of tiles.
const MOST_BYTES: u64 = 60 << 20;
const EXPORT_SCAN_LINES: &str = "export it again without compression or with ZIP, as scan lines";

/// Opens the first layer.
pub(in crate::raster) fn open<'a>(mut source: Source<'a>, sidecar: Option<&Sidecar>) -> Result<Reader<'a>, Problem> {
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
    MetaData::validate(&meta.headers, false).map_err(fault)?;
    let Some(first) = meta.headers.first() else {
        return Err(Problem::damaged("it has no layers"));
    };
    let mut head = Head::new(first.layer_size.0, first.layer_size.1);
    sidecar.into_iter().for_each(|sidecar| sidecar.locate(&mut head));
    head.assumes_voids = sidecar.is_none();
    let channel = channel(&first.channels.list)?;
    let channels = &first.channels.list;
    if channels.iter().filter(|other| !other.name.eq_case_insensitive("A")).count() > 1 {
        let name = &channels[channel].name;
        head.notes.push(format!("the file has {} channels; `{name}` is read", channels.len()));
    }
    let block = match first.blocks {
        BlockDescription::ScanLines => [head.columns, first.compression.scan_lines_per_block()],
        BlockDescription::Tiles(tiles) => [tiles.tile_size.0, tiles.tile_size.1],
    };
    let offsets = offsets(&mut source, head.columns.div_ceil(block[0]), head.rows.div_ceil(block[1]))?;
    let layer = Layer { source, meta, head, channel, block, offsets };
    if layer.bytes() > MOST_BYTES {
        let [wide, high] = layer.block;
        return Err(Problem::Unsupported {
            what: format!("blocks of {wide} x {high} cells in rows of {} columns", layer.head.columns),
            remedy: EXPORT_SCAN_LINES,
        });
    }
    Ok(Reader { head: layer.head.clone(), rows: Box::new(layer) })
}

/// Chooses the channel of the heights.
fn channel(channels: &[ChannelDescription]) -> Result<usize, Problem> {
    if let Some(channel) = channels.iter().find(|channel| channel.sampling != Vec2(1, 1)) {
        return Err(Problem::Unsupported {
            what: format!("the subsampled channel `{}`", channel.name),
            remedy: "export the height channel at full resolution",
        });
    }
    let found = CHANNELS.iter().find_map(|name| channels.iter().position(|c| c.name.eq_case_insensitive(name)));
    if channels.is_empty() { Err(Problem::damaged("it has no channels")) } else { Ok(found.unwrap_or(0)) }
}

/// Reads the places of the first layer's blocks of full resolution, which follow the header, row by row.
fn offsets(source: &mut Source<'_>, across: usize, down: usize) -> Result<Vec<u64>, Problem> {
    let start = source.bytes.stream_position().map_err(Problem::Unreadable)?;
    let count = across as u64 * down as u64;
    if source.length.saturating_sub(start) / 8 < count {
        return Err(Problem::truncated(format!("it has no room for the places of its {count} blocks")));
    }
    let mut offsets: Vec<u64> = filled(count as usize, 0)?;
    for offset in &mut offsets {
        let mut bytes = [0; 8];
        source.bytes.read_exact(&mut bytes).map_err(Problem::Unreadable)?;
        *offset = u64::from_le_bytes(bytes);
        if *offset >= source.length {
            return Err(Problem::truncated(format!("a block at {offset} is beyond its end at {}", source.length)));
        }
    }
    Ok(offsets)
}

/// The layer of the heights.
struct Layer<'a> {
    source: Source<'a>,
    meta: MetaData,
    head: Head,
    /// The number of the channel of the heights.
    channel: usize,
    /// Columns and rows of a block: a tile, or scan lines.
    block: [usize; 2],
    /// The places of the blocks in the file, row by row.
    offsets: Vec<u64>,
}

impl Layer<'_> {
    /// Returns the rows of blocks that are unpacked at a time.
    fn blocks_down(&self) -> usize {
        (BLOCK / (self.head.columns * self.block[1])).max(1)
    }

    /// Unpacks the block at a place of the grid of blocks into rows of the image, the first of which is `from`.
    fn unpack(&mut self, [along, down]: [usize; 2], from: usize, samples: &mut [f32]) -> Result<(), Problem> {
        let columns = self.head.columns;
        let offset = self.offsets[down * columns.div_ceil(self.block[0]) + along];
        self.source.bytes.seek(SeekFrom::Start(offset)).map_err(Problem::Unreadable)?;
        let chunk = Chunk::read(&mut self.source.bytes, &self.meta).map_err(fault)?;
        let block = UncompressedBlock::decompress_chunk(chunk, &self.meta, false).map_err(fault)?;
        let place = Vec2(along * self.block[0], down * self.block[1]);
        let expected = Vec2(self.block[0].min(columns - place.0), self.block[1].min(self.head.rows - place.1));
        let index = block.index;
        if (index.layer, index.level, index.pixel_position, index.pixel_size) != (0, Vec2(0, 0), place, expected) {
            return Err(Problem::damaged(format!("another block is where block {along}, {down} should be")));
        }
        let channels = &self.meta.headers[0].channels;
        let kind = channels.list[self.channel].sample_type;
        for line in block.lines(channels).filter(|line| line.location.channel == self.channel) {
            let first = (line.location.position.1 - from) * columns + line.location.position.0;
            let out = &mut samples[first..first + line.location.sample_count];
            match kind {
                SampleType::F32 => line.read_samples_into_slice(out).map_err(fault)?,
                SampleType::F16 => copy(line.read_samples::<f16>(), f16::to_f32, out)?,
                SampleType::U32 => copy(line.read_samples::<u32>(), |v| v as f32, out)?,
            }
        }
        Ok(())
    }
}

/// Converts the samples of a line.
fn copy<T>(
    samples: impl Iterator<Item = Result<T, Error>>,
    real: impl Fn(T) -> f32,
    out: &mut [f32],
) -> Result<(), Problem> {
    for (out, sample) in out.iter_mut().zip(samples) {
        *out = real(sample.map_err(fault)?);
    }
    Ok(())
}

impl Rows for Layer<'_> {
    /// Works on the calling thread: the crate's own thread pool would ignore the requested number of threads.
    fn read(mut self: Box<Self>, go_on: GoOn<'_>, each: &mut Each<'_>) -> Result<(), Problem> {
        let (columns, rows) = (self.head.columns, self.head.rows);
        let [across, down] = [columns.div_ceil(self.block[0]), rows.div_ceil(self.block[1])];
        let high = self.block_rows(&self.head);
        let mut samples = filled(high * columns, 0.0)?;
        for first in (0..down).step_by(self.blocks_down()) {
            let from = first * self.block[1];
            let samples = &mut samples[..high.min(rows - from) * columns];
            for number in first..(first + self.blocks_down()).min(down) {
                for along in 0..across {
                    if !go_on() {
                        return Err(Problem::Stopped);
                    }
                    self.unpack([along, number], from, samples)?;
                }
            }
            each(from, samples)?;
        }
        Ok(())
    }

    fn bytes(&self) -> u64 {
        let cell_bytes = self.meta.headers.first().map_or(0, |header| header.channels.bytes_per_pixel);
        // a block as it is in the file, unpacked, and in between
        let block_cells = self.block[0].min(self.head.columns) * self.block[1].min(self.head.rows);
        let blocks = cell_bytes.saturating_mul(3 * block_cells);
        let rows = size_of::<f32>() * self.head.columns * self.block_rows(&self.head);
        blocks.saturating_add(8 * self.offsets.len() + rows) as u64
    }

    fn block_rows(&self, head: &Head) -> usize {
        (self.blocks_down() * self.block[1]).min(head.rows)
    }
}

fn fault(error: Error) -> Problem {
    match error {
        Error::NotSupported(what) => Problem::Unsupported { what: what.into_owned(), remedy: EXPORT_SCAN_LINES },
        Error::Io(_) => Problem::truncated("it ends in the middle of a block"),
        other => Problem::damaged(other.to_string()),
    }
}
