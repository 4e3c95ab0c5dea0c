//! Writes cloud-optimised GeoTIFF: tiles compressed by deflate, and overviews.
//!
//! The order in the file is that of the format's users, who read parts of it over a network: the directories of all
//! levels, the tiles of the smallest overview, those of the next larger one, and at last those of the raster itself.
//! The directories name the place of each tile and an overview is complete only with the last row, so tiles wait in a
//! second temporary file.
//!
//! Sources: OGC 21-026, "OGC Cloud Optimized GeoTIFF Standard" (2023); Adobe Photoshop, "TIFF Technical Note 3" (2005).

mod directory;
#[cfg(test)]
mod tests;
mod tiles;

use std::{
    io::{self, Read, Seek, SeekFrom, Write},
    path::Path,
};

use orograph_graph::Window;

use self::{
    directory::{Image, Tile, head},
    tiles::{TILE, compressed, halved},
};
use super::write::CLASSIC_MOST;
use crate::{
    numerics::par,
    raster::{GoOn, RasterError, part::Part},
};

/// A raster and its overviews, of which some rows of tiles are complete.
pub(in crate::raster) struct Cog {
    /// The raster and its overviews, each half as large as the one before.
    levels: Vec<Level>,
    /// The tiles so far, as they were completed.
    waiting: Part,
    /// Bytes of the waiting tiles.
    bytes: u64,
}

/// The raster or one of its overviews.
struct Level {
    columns: usize,
    rows: usize,
    /// Complete rows of tiles, in rows of cells.
    done: usize,
    /// The samples of the row of tiles that is not yet complete.
    band: Vec<f32>,
    /// Where the complete tiles wait.
    tiles: Vec<Tile>,
}

impl Cog {
    /// Begins the raster of a window, for the file at `path`.
    pub(in crate::raster) fn begin(path: &Path, window: &Window) -> Result<Self, RasterError> {
        let mut levels = Vec::new();
        let mut size = [window.nx(), window.ny()];
        loop {
            let [columns, rows] = size;
            levels.push(Level { columns, rows, done: 0, band: Vec::new(), tiles: Vec::new() });
            if columns <= TILE && rows <= TILE {
                break;
            }
            size = size.map(|side| side.div_ceil(2));
        }
        Ok(Self { levels, waiting: Part::begin(path)?, bytes: 0 })
    }

    /// Appends rows of samples.
    pub(in crate::raster) fn rows(&mut self, samples: &[f32], go_on: GoOn<'_>) -> io::Result<()> {
        self.append(0, samples, go_on)
    }

    fn append(&mut self, level: usize, mut samples: &[f32], go_on: GoOn<'_>) -> io::Result<()> {
        while !samples.is_empty() {
            let Level { columns, rows, done, band, .. } = &mut self.levels[level];
            let full = TILE.min(*rows - *done) * *columns;
            if band.capacity() < full {
                band.try_reserve_exact(full - band.len())?;
            }
            let (now, later) = samples.split_at((full - band.len()).min(samples.len()));
            band.extend_from_slice(now);
            samples = later;
            if band.len() == full {
                self.complete(level, go_on)?;
            }
        }
        Ok(())
    }

    /// Compresses a complete row of tiles, and appends its rows to the next overview.
    fn complete(&mut self, level: usize, go_on: GoOn<'_>) -> io::Result<()> {
        let Level { columns, .. } = self.levels[level];
        let mut band = std::mem::take(&mut self.levels[level].band);
        let tiles = par::collect(0..columns.div_ceil(TILE), |_, along| {
            if go_on() { compressed(&band, columns, along * TILE) } else { Err(io::Error::other("stopped")) }
        })?;
        for tile in tiles {
            self.waiting.write_all(&tile)?;
            self.levels[level].tiles.push(Tile { at: self.bytes, bytes: tile.len() as u64 });
            self.bytes += tile.len() as u64;
        }
        if level + 1 < self.levels.len() {
            self.append(level + 1, &halved(&band, columns), go_on)?;
        }
        let complete = &mut self.levels[level];
        complete.done += band.len() / columns;
        band.clear();
        complete.band = if complete.done < complete.rows { band } else { Vec::new() };
        Ok(())
    }

    /// Writes the whole file, once all rows are there. `has_voids` is true if any sample is NaN.
    pub(in crate::raster) fn finish(
        mut self,
        to: &mut Part,
        window: &Window,
        has_voids: bool,
        go_on: GoOn<'_>,
    ) -> io::Result<()> {
        let is_big = self.bytes > CLASSIC_MOST;
        let waiting: Vec<Image> = self
            .levels
            .into_iter()
            .map(|level| Image { cells: [level.columns, level.rows], tiles: level.tiles })
            .collect();
        // the directories have the same length wherever the tiles are
        let mut at = head(&waiting, window, has_voids, is_big).len() as u64;
        let mut images = waiting.clone();
        for tile in images.iter_mut().rev().flat_map(|image| &mut image.tiles) {
            tile.at = at;
            at += tile.bytes;
        }
        to.write_all(&head(&images, window, has_voids, is_big))?;
        let mut from = self.waiting.reader()?;
        let mut buffer = Vec::new();
        for Tile { at, bytes } in waiting.iter().rev().flat_map(|image| &image.tiles) {
            if !go_on() {
                return Err(io::Error::other("stopped"));
            }
            buffer.resize(*bytes as usize, 0);
            // tiles of one level follow each other except for those of others in between
            from.seek(SeekFrom::Start(*at))?;
            from.read_exact(&mut buffer)?;
            to.write_all(&buffer)?;
        }
        Ok(())
    }
}
