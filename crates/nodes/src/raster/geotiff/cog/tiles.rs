//! Tiles of a level, and the rows of the next one.

use std::io;

use libdeflater::{CompressionLvl, Compressor};

use crate::numerics::par;

/// Cells on a side of a tile.
pub(super) const TILE: usize = 512;
/// The default of the programs that write the format, which compresses heights nearly as well as the strongest level.
const EFFORT: i32 = 6;
/// Bytes of a row of a tile.
const ROW: usize = size_of::<f32>() * TILE;

/// Returns the compressed tile whose first column this is, from the rows of a row of tiles. Beyond the raster its cells
/// repeat the last ones.
pub(super) fn compressed(band: &[f32], columns: usize, first: usize) -> io::Result<Vec<u8>> {
    let rows = band.len() / columns;
    let mut bytes = vec![0; TILE * ROW];
    for (j, out) in bytes.chunks_exact_mut(ROW).enumerate() {
        let row = j.min(rows - 1) * columns;
        predict(&band[row + first..row + columns.min(first + TILE)], out);
    }
    let mut compressor = Compressor::new(CompressionLvl::new(EFFORT).unwrap_or_default());
    let mut packed = vec![0; compressor.zlib_compress_bound(bytes.len())];
    let length = compressor.zlib_compress(&bytes, &mut packed).map_err(io::Error::other)?;
    packed.truncate(length);
    Ok(packed)
}

/// Predictor 3: the first bytes of all numbers, which are nearly constant, then their second bytes and so on, each as
/// the difference from the byte before.
fn predict(samples: &[f32], out: &mut [u8]) {
    let last = samples.last().copied().unwrap_or(0.0);
    let cells = samples.iter().copied().chain(std::iter::repeat(last)).take(TILE);
    for (i, sample) in cells.enumerate() {
        for (plane, byte) in sample.to_bits().to_be_bytes().into_iter().enumerate() {
            out[plane * TILE + i] = byte;
        }
    }
    let mut before = 0;
    for byte in out {
        let own = *byte;
        *byte = own.wrapping_sub(before);
        before = own;
    }
}

/// Returns the rows of half as many columns and rows: means of the samples that are no voids.
pub(super) fn halved(band: &[f32], columns: usize) -> Vec<f32> {
    let rows = band.len() / columns;
    let across = columns.div_ceil(2);
    let mut half = vec![0.0; rows.div_ceil(2) * across];
    par::all(half.chunks_exact_mut(across), |j, out| {
        let above = &band[2 * j * columns..][..columns];
        let below = if 2 * j + 1 < rows { &band[(2 * j + 1) * columns..][..columns] } else { &[] };
        for (i, out) in out.iter_mut().enumerate() {
            let pair = 2 * i..columns.min(2 * i + 2);
            *out = mean(above[pair.clone()].iter().chain(below.get(pair).unwrap_or_default()));
        }
    });
    half
}

/// The mean of numbers, NaN if there are none.
fn mean<'a>(samples: impl Iterator<Item = &'a f32>) -> f32 {
    let (sum, count) = samples
        .filter(|sample| !sample.is_nan())
        .fold((0.0, 0.0), |(sum, count), sample| (sum + f64::from(*sample), count + 1.0));
    if count > 0.0 { (sum / count) as f32 } else { f32::NAN }
}
