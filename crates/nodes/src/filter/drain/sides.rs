//! Sides of cuts: around a cut of depth D, the terrain is lowered by D (1 − (r / R)²)² up to the distance R, which adds a
//! slope of at most 1.54 D / R. It keeps its own forms, which a surface of fixed shape would erase.

use orograph_graph::{Job, NodeError};

use crate::numerics::{par, routing::Grid, simd::simd};

/// Rows that one thread works on.
const BAND: usize = 64;
/// Radius of a cut over the distance at which cuts may follow each other without visible scallops.
const SPACING: f32 = 8.0;

/// The longest distance in cells: more than the side of any world.
const FARTHEST: f32 = 65_536.0;
/// The steepest slope of (1 − x²)².
const STEEPEST: f64 = 1.539_600_7;

/// A place where the terrain was cut.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// Column and row; beyond the world for images across periodic sides.
    at: [i32; 2],
    /// Depth, and height of the floor, in metres.
    depth_m: f32,
    floor_m: f32,
    /// Square of the distance in cells at which the lowering ends.
    end2: f32,
}

simd! {
    /// Lowers a row. `first` is the offset of its first cell from the cut, `dy2` the square of that of the row.
    fn lower_row(before: &[f32], out: &mut [f32], first: f32, dy2: f32, depth_m: f32, floor_m: f32, per_end2: f32) {
        let len = out.len();
        let before = &before[..len];
        for x in 0..len {
            let dx = first + x as f32;
            let share = (1.0 - (dx * dx + dy2) * per_end2).max(0.0);
            let lowered = (before[x] - depth_m * (share * share)).max(floor_m);
            out[x] = if lowered < out[x] { lowered } else { out[x] };
        }
    }
}

/// Returns the cuts: where `bed` is below `land`, thinned where they are much closer to each other than wide.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn cuts(job: &Job<'_>, land: &[f32], bed: &[f32], slope: f64) -> Result<Vec<Cut>, NodeError> {
    let nx = job.window().nx();
    let per_depth = (STEEPEST / (slope * job.cell_m())) as f32;
    let rows = par::collect(land.chunks(nx).zip(bed.chunks(nx)), |y, (land, bed)| {
        job.check()?;
        let mut found: Vec<([u32; 3], Cut)> = Vec::new();
        for (x, (&land, &bed)) in land.iter().zip(bed).enumerate() {
            let depth_m = land - bed;
            let radius = depth_m * per_depth;
            if radius > 1.0 {
                // one of each square and each class of widths
                let class = ((radius / SPACING).max(1.0) as u32).ilog2();
                let cut = Cut { at: [x as i32, y as i32], depth_m, floor_m: bed, end2: radius * radius };
                found.push(([class, y as u32 >> class, x as u32 >> class], cut));
            }
        }
        Ok::<_, NodeError>(found)
    })?;
    let mut cuts = rows.concat();
    // the deepest of each
    cuts.sort_by(|(a, cut), (b, other)| a.cmp(b).then(other.depth_m.total_cmp(&cut.depth_m)));
    cuts.dedup_by_key(|(square, _)| *square);
    Ok(cuts.into_iter().map(|(_, cut)| cut).collect())
}

/// Lowers the terrain beside the cuts: `bed`, or `land` where that is higher, but not below the floor of a cut, nor below
/// the sea.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn open(job: &Job<'_>, grid: &Grid, cuts: &[Cut], land: &[f32], bed: &mut [f32]) -> Result<(), NodeError> {
    let sea_m = job.sea_level().map_or(f32::NEG_INFINITY, |sea_m| sea_m as f32);
    let bands = bands(grid, cuts);
    let parts = bed.chunks_mut(BAND * grid.nx).zip(land.chunks(BAND * grid.nx)).zip(&bands);
    par::each_with(parts, Vec::new, |before, band, ((bed, land), cuts)| {
        if cuts.is_empty() {
            return job.check();
        }
        // the sea is not lowered
        before.clear();
        before.extend(
            land.iter().zip(&*bed).map(|(&land, &bed)| if land < sea_m { f32::INFINITY } else { land.max(bed) }),
        );
        for (at, cut) in cuts.iter().enumerate() {
            if at % 256 == 0 {
                job.check()?;
            }
            for (j, (row, before)) in bed.chunks_mut(grid.nx).zip(before.chunks(grid.nx)).enumerate() {
                let dy = (band * BAND + j) as f32 - cut.at[1] as f32;
                let half2 = cut.end2 - dy * dy;
                if half2 < 0.0 {
                    continue;
                }
                let half = half2.sqrt().min(FARTHEST) as i32;
                let [from, to] = [cut.at[0] - half, cut.at[0] + half + 1].map(|x| x.clamp(0, grid.nx as i32) as usize);
                let first = from as f32 - cut.at[0] as f32;
                let floor_m = cut.floor_m.max(sea_m);
                lower_row(&before[from..to], &mut row[from..to], first, dy * dy, cut.depth_m, floor_m, 1.0 / cut.end2);
            }
        }
        Ok(())
    })
}

/// Returns the cuts that reach each band of rows, also those across periodic sides.
fn bands(grid: &Grid, cuts: &[Cut]) -> Vec<Vec<Cut>> {
    let (nx, ny) = (grid.nx as i32, grid.ny as i32);
    let mut bands: Vec<Vec<Cut>> = vec![Vec::new(); grid.ny.div_ceil(BAND)];
    for cut in cuts {
        let reach = cut.end2.sqrt().min(FARTHEST) as i32;
        let images = |wraps: bool, size: i32, at: i32| {
            let wrapped = [(-size, at + reach >= size), (0, true), (size, at - reach < 0)];
            wrapped.into_iter().filter(move |(by, is)| *is && (wraps || *by == 0)).map(move |(by, _)| at + by)
        };
        for y in images(grid.wraps()[1], ny, cut.at[1]) {
            let [first, last] = [y - reach, y + reach].map(|y| y.clamp(0, ny - 1) as usize / BAND);
            for x in images(grid.wraps()[0], nx, cut.at[0]) {
                bands[first..=last].iter_mut().for_each(|band| band.push(Cut { at: [x, y], ..*cut }));
            }
        }
    }
    bands
}
