//! Heights and mobilities of a bundle, from rows of a raster and back.

use super::{Along, Bundle, FREE, Ground, HIGHEST_M, HOLE, LANES, Lanes, diffusivity, mobility};
use crate::numerics::simd::simd;

simd! {
    /// Reads heights and mobilities.
    pub(super) fn load(bundle: &mut Bundle, heights: &[&mut [f64]], ground: &Ground<'_>) {
        match ground.along {
            Along::Columns => {
                for (i, row) in heights.iter().enumerate() {
                    let mut given = [f64::NAN; LANES];
                    given.iter_mut().zip(&**row).for_each(|(given, height)| *given = *height);
                    let mobile = ground.diffusivity.map(|diffusivities| {
                        let mut mobile = [0.0; LANES];
                        mobile.iter_mut().zip(diffusivities[i]).for_each(|(mobile, &given)| {
                            *mobile = mobility(diffusivity(given).max(ground.least), ground);
                        });
                        mobile
                    });
                    set(bundle, i, &given, mobile.as_ref());
                }
            }
            Along::Rows => {
                // a few cells of each line at a time, which stay in the first cache
                for first in (0..bundle.start.len()).step_by(LANES) {
                    let mut given = [[f64::NAN; LANES]; LANES];
                    for (given, row) in given.iter_mut().zip(heights) {
                        given.iter_mut().zip(&row[first..]).for_each(|(given, height)| *given = *height);
                    }
                    let given = transposed(&given);
                    let mobile = ground.diffusivity.map(|diffusivities| {
                        let mut mobile = [[0.0; LANES]; LANES];
                        for (mobile, row) in mobile.iter_mut().zip(diffusivities) {
                            mobile.iter_mut().zip(&row[first..]).for_each(|(mobile, &given)| {
                                *mobile = mobility(diffusivity(given).max(ground.least), ground);
                            });
                        }
                        transposed(&mobile)
                    });
                    let cells = LANES.min(bundle.start.len() - first);
                    for (i, given) in given.iter().take(cells).enumerate() {
                        set(bundle, first + i, given, mobile.as_ref().map(|mobile| &mobile[i]));
                    }
                }
            }
        }
    }
}

/// Returns the columns of a square as rows: in blocks of four by four, which vectors transpose in their registers.
#[inline(always)]
fn transposed(from: &[Lanes; LANES]) -> [Lanes; LANES] {
    let mut to = [[0.0; LANES]; LANES];
    for i in (0..LANES).step_by(4) {
        for j in (0..LANES).step_by(4) {
            for k in 0..4 {
                to[j + k][i] = from[i][j + k];
                to[j + k][i + 1] = from[i + 1][j + k];
                to[j + k][i + 2] = from[i + 2][j + k];
                to[j + k][i + 3] = from[i + 3][j + k];
            }
        }
    }
    to
}

/// Returns a square of cells from one on, all lines of them; past the last cell it is empty.
#[inline(always)]
fn square(lanes: &[Lanes], first: usize) -> [Lanes; LANES] {
    if let Some(square) = lanes[first..].first_chunk() {
        return *square;
    }
    let mut square = [[0.0; LANES]; LANES];
    square.iter_mut().zip(&lanes[first..]).for_each(|(to, from)| *to = *from);
    square
}

simd! {
    /// Writes heights.
    pub(super) fn store(bundle: &Bundle, heights: &mut [&mut [f64]], along: Along) {
        let write = |to: &mut [f64], ends: &[f64], holds: &[f64]| {
            for ((height, &end), &hold) in to.iter_mut().zip(ends).zip(holds) {
                *height = if hold == HOLE { *height } else { end };
            }
        };
        match along {
            Along::Columns => {
                for ((row, end), hold) in heights.iter_mut().zip(&bundle.end).zip(&bundle.hold) {
                    write(row, end, hold);
                }
            }
            Along::Rows => {
                for first in (0..bundle.end.len()).step_by(LANES) {
                    let ends = transposed(&square(&bundle.end, first));
                    let holds = if bundle.holes { transposed(&square(&bundle.hold, first)) } else { [[FREE; LANES]; LANES] };
                    for (line, row) in heights.iter_mut().enumerate() {
                        write(&mut row[first..], &ends[line], &holds[line]);
                    }
                }
            }
        }
    }
}

/// Sets a cell of all lines: free, or a hole where there is no height.
#[inline(always)]
fn set(bundle: &mut Bundle, i: usize, given: &Lanes, mobile: Option<&Lanes>) {
    let start = &mut bundle.start[i];
    let mut holes = [FREE; LANES];
    for lane in 0..LANES {
        let ground = given[lane].abs() < HIGHEST_M;
        start[lane] = if ground { given[lane] } else { 0.0 };
        holes[lane] = if ground { FREE } else { HOLE };
    }
    if holes.iter().sum::<f64>() > 0.0 {
        bundle.holes = true;
        bundle.hold[i] = holes;
    }
    if let Some(mobile) = mobile {
        for ((mobility, mobile), hole) in bundle.mobility[i].iter_mut().zip(mobile).zip(holes) {
            *mobility = if hole == FREE { *mobile } else { 0.0 };
        }
    }
}
