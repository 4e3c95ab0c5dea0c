//! Writes uncompressed rows.

use std::io;

use ::exr::{
    compression::Compression,
    meta::{
        BlockDescription, MetaData,
        attribute::{ChannelDescription, LineOrder, SampleType},
        header::Header,
        magic_number,
    },
    prelude::SmallVec,
};

/// Bytes before each row of an uncompressed file: its number and its length.
pub(in crate::raster) const BEFORE_ROW: usize = 8;

/// Returns the bytes before the rows: the header of one channel of 32-bit floats with that name, `Y` by convention, and
/// the offsets of the rows.
///
/// The file is uncompressed: the noise-like mantissas of a 2048 x 2048 terrain shrink by only 1 % (ZIP1) to 9 %
/// (ZIP16), and compression takes 30 to 50 times as long.
pub(in crate::raster) fn header([columns, rows]: [u32; 2], channel: &str) -> io::Result<Vec<u8>> {
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
pub(in crate::raster) fn before_row(row: usize, columns: usize) -> [u8; BEFORE_ROW] {
    (row as u64 | (4 * columns as u64) << 32).to_le_bytes()
}
