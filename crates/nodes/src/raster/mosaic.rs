//! Joins rasters that lie side by side on one grid, such as SRTM tiles, into one.
//!
//! Where they overlap, as SRTM tiles do by a row of posts, the one that is given first counts, unless it has a void
//! there. So voids at the edge of a tile are later filled from both of its sides.

use std::path::{Path, PathBuf};

use orograph_graph::{Field, GeoPlace, Window, World, memory::filled};

use super::{
    Cell, Content, Format, GoOn, Head, MAX_CELLS, MAX_COLUMNS, Problem, RasterError, Reader, Writing, whole::whole,
};

/// How far a raster may be from the grid of the first one, in cells.
const TOLERANCE: f64 = 0.01;

/// The grid of rasters, and where they lie on it.
struct Grid {
    epsg: u32,
    cell: f64,
    /// Its north-west corner.
    corner: [f64; 2],
    columns: usize,
    rows: usize,
    /// Column and row of the north-west corner of each raster.
    offsets: Vec<[usize; 2]>,
}

/// What to say of files with so many cells in all, joined to a raster with so many, if most of it lies in no file.
fn far_apart(covered: usize, all: usize) -> Option<String> {
    let share = 100.0 - 100.0 * covered as f64 / all as f64;
    (all > 0 && share > 50.0)
        .then(|| format!("the files are far apart: {share:.0} % of the joined cells lie in none of them"))
}

/// Joins raster files into a cloud-optimised GeoTIFF, whose voids are the cells without data in all of them. Returns
/// what is assumed about the files, each a sentence without a full stop.
///
/// # Errors
/// The problems of a file, and [`Problem::OffGrid`] if the files do not share a grid; [`Problem::Unwritable`].
pub fn join(files: &[PathBuf], to: &Path, go_on: GoOn<'_>) -> Result<Vec<String>, RasterError> {
    let heads = files.iter().map(|file| Reader::open(file).map(|reader| reader.head));
    let heads: Vec<Head> = heads.collect::<Result<_, _>>()?;
    let grid = Grid::of(&heads).map_err(|(at, problem)| problem.of(&files[at]))?;
    let mut samples = filled(grid.columns * grid.rows, f32::NAN).map_err(|refused| Problem::from(refused).of(to))?;
    for (file, [left, top]) in files.iter().zip(&grid.offsets) {
        let reader = Reader::open(file)?;
        let (columns, coding) = (reader.head.columns, reader.head.coding);
        let range = coding.and_then(|coding| coding.range).unwrap_or_default();
        let read = reader.read(go_on, &mut |first, block| {
            if let Some(coding) = coding {
                coding.decode(range, block);
            }
            for (row, at) in block.chunks_exact(columns).zip(top + first..) {
                let out = samples.get_mut(at * grid.columns + left..).and_then(|out| out.get_mut(..columns));
                let out = out.ok_or_else(|| Problem::Damaged("another program changes it at present".to_owned()))?;
                for (out, v) in out.iter_mut().zip(row).filter(|(out, _)| out.is_nan()) {
                    *out = *v;
                }
            }
            Ok(())
        });
        match read {
            // a tile of the open sea
            Ok(_) | Err(Problem::AllVoid) => {}
            Err(problem) => return Err(problem.of(file)),
        }
    }
    let field = Field::new(grid.window(), samples);
    whole(to, Content::Numbers(Format::Cog, Writing::default()), &field, None, go_on)?;
    let covered: usize = heads.iter().map(|head| head.columns * head.rows).sum();
    let apart = far_apart(covered, grid.columns * grid.rows);
    let mut notes: Vec<String> = heads.into_iter().flat_map(|head| head.notes).collect();
    notes.sort_unstable();
    notes.dedup();
    notes.extend(apart);
    Ok(notes)
}

impl Grid {
    /// Returns the grid of rasters. Errors have the number of the raster.
    fn of(heads: &[Head]) -> Result<Self, (usize, Problem)> {
        let off = |at: usize, what: String| (at, Problem::OffGrid(what));
        let mut places = Vec::with_capacity(heads.len());
        for (at, head) in heads.iter().enumerate() {
            let (Some(origin), Some(epsg), Some(cell)) = (head.origin, head.epsg, head.cell) else {
                return Err(off(at, "it names no coordinate system and no position".to_owned()));
            };
            if head.coding.is_some_and(|coding| coding.range.is_none()) {
                return Err(off(at, "it has codes over an unknown range".to_owned()));
            }
            let (Cell::Metres(cell) | Cell::Degrees(cell) | Cell::Mercator(cell)) = cell;
            if head.unit_m != 1.0 || (cell[0] - cell[1]).abs() * head.columns as f64 > TOLERANCE * cell[0] {
                return Err(off(at, "its cells are not square, or in feet".to_owned()));
            }
            places.push((origin, epsg, cell[0]));
        }
        let Some(([west, north], epsg, cell)) = places.first().copied() else {
            return Err((0, Problem::Empty { columns: 0, rows: 0 }));
        };
        // from the corner of the first one
        let mut offsets = Vec::with_capacity(heads.len());
        for (at, ((origin, other, size), head)) in places.iter().zip(heads).enumerate() {
            if *other != epsg {
                return Err(off(at, format!("it is in EPSG:{other}, the first one in EPSG:{epsg}")));
            }
            let offset = [(origin[0] - west) / cell, (north - origin[1]) / cell];
            let side = head.columns.max(head.rows) as f64;
            if (size - cell).abs() * side > TOLERANCE * cell
                || offset.iter().any(|offset| (offset - offset.round()).abs() > TOLERANCE)
            {
                return Err(off(at, "its cells are of another size, or lie between those of the others".to_owned()));
            }
            if offset.iter().any(|offset| offset.abs() > MAX_CELLS as f64) {
                return Err(off(at, "it lies far from them".to_owned()));
            }
            offsets.push(offset.map(|offset| offset.round() as i64));
        }
        let first = [0, 1].map(|axis| offsets.iter().map(|offset| offset[axis]).min().unwrap_or(0));
        let corner = [west + first[0] as f64 * cell, north - first[1] as f64 * cell];
        let offsets: Vec<[usize; 2]> =
            offsets.iter().map(|offset| [0, 1].map(|axis| (offset[axis] - first[axis]) as usize)).collect();
        let size = |axis: usize, cells: fn(&Head) -> usize| {
            heads.iter().zip(&offsets).map(|(head, offset)| offset[axis] + cells(head)).max().unwrap_or(0)
        };
        let grid = Self {
            epsg,
            cell,
            corner,
            columns: size(0, |head| head.columns),
            rows: size(1, |head| head.rows),
            offsets,
        };
        let (columns, rows) = (grid.columns as u64, grid.rows as u64);
        if columns > MAX_COLUMNS || columns * rows > MAX_CELLS {
            return Err((0, Problem::TooLarge { columns, rows }));
        }
        Ok(grid)
    }

    /// The window of a world with the cells of the grid, whose lengths are in the units of its coordinates.
    fn window(&self) -> Window {
        let cells = [self.columns as u32, self.rows as u32];
        let place = Some(GeoPlace { epsg: self.epsg, corner_m: self.corner });
        Window::whole(World { size: cells.map(|side| f64::from(side) * self.cell), cells, place, ..World::default() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::read;

    /// A tile of 4 x 4 posts.
    fn tile(folder: &Path, name: &str, post: impl Fn(usize, usize) -> i16) -> PathBuf {
        let path = folder.join(name);
        let bytes: Vec<u8> = (0..16).flat_map(|at| post(at % 4, at / 4).to_be_bytes()).collect();
        std::fs::write(&path, bytes).expect("written");
        path
    }

    #[test]
    fn files_far_apart_are_named() {
        assert_eq!(far_apart(75, 100), None);
        assert!(far_apart(5, 100).is_some_and(|said| said.contains("95 % of the joined cells lie in none")));
    }

    #[test]
    fn tiles_side_by_side_become_one_raster() {
        let folder = tempfile::tempdir().expect("a folder");
        // a void at the common row of the first two; the fourth corner has no tile
        let north_west = tile(folder.path(), "N47E007.hgt", |i, j| if j == 3 && i == 1 { -32_768 } else { 700 });
        let south_west = tile(folder.path(), "N46E007.hgt", |i, _| 600 + i as i16);
        let north_east = tile(folder.path(), "N47E008.hgt", |_, j| 800 + j as i16);
        let to = folder.path().join("joined.tif");
        join(&[north_west.clone(), south_west, north_east], &to, &|| true).expect("joined");
        let joined = read(&to).expect("readable");
        assert_eq!((joined.head.columns, joined.head.rows, joined.head.epsg), (7, 7, Some(4326)));
        let Some(Cell::Degrees([dx, dy])) = joined.head.cell else { panic!("{:?}", joined.head) };
        let [west, north] = joined.head.origin.expect("a corner");
        for (found, expected) in [(dx, 1.0 / 3.0), (dy, 1.0 / 3.0), (west, 7.0 - 1.0 / 6.0), (north, 48.0 + 1.0 / 6.0)]
        {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        let at = |i: usize, j: usize| joined.samples[j * 7 + i];
        assert_eq!([at(0, 0), at(3, 0), at(4, 0), at(6, 2)], [700.0, 700.0, 800.0, 802.0]);
        assert_eq!([at(0, 3), at(1, 3), at(2, 6)], [700.0, 601.0, 602.0]);
        assert!(at(4, 4).is_nan() && joined.voids.cells == 9, "{:?}", joined.voids);

        let unknown = tile(folder.path(), "tile.hgt", |_, _| 5);
        let between = folder.path().join("N47E009.asc");
        let header = "ncols 2\nnrows 2\nxllcorner 9.4\nyllcorner 47\ncellsize 0.3333333333333\n1 2\n3 4\n";
        std::fs::write(&between, header).expect("written");
        std::fs::write(between.with_extension("prj"), "GEOGCS[\"GCS_WGS_1984\"]").expect("written");
        for (other, words) in [(unknown, "no position"), (between, "between those")] {
            let error = join(&[north_west.clone(), other.clone()], &to, &|| true).expect_err("refused");
            assert!(error.to_string().contains(words) && error.path == other, "{error}");
        }
    }
}
