//! Measures of the form of terrain that distinguish real mountains from slopes of a single angle.
//!
//! Elevation models of mountains with cells of 30 to 90 m have a ratio of the 95 % slope to the median of 1.6 to 2.8,
//! 17 to 24 % of their area in one bin of 5 degrees, and no planes of five by five cells.

use orograph_graph::Field;
use orograph_nodes::numerics::math;

/// Slope from which cells count for [`Look::ratio`] and [`Look::fullest_bin`], in degrees; excludes valley floors and
/// plains.
const STEEP: f64 = 5.0;
/// Slope from which windows count for [`Look::planar`], in degrees.
const STEEPER: f64 = 15.0;
/// Maximum distance of a planar window from its plane, as a fraction of the plane's drop.
const PLANE: f64 = 0.01;

/// The limits of [`Look::faults`]: minimum ratio, maximum fullest bin, maximum planar fraction.
const LIMITS: [f64; 3] = [1.4, 0.28, 0.005];

/// Measures of terrain above sea level.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// Median slope of the cells steeper than 5°, in degrees.
    pub median: f64,
    /// Their 95th percentile of slope, divided by the median.
    pub ratio: f64,
    /// The largest fraction of them in one bin of 5°.
    pub fullest_bin: f64,
    /// Fraction of the windows of 5 × 5 cells steeper than 15° that are planar to 1 % of their drop.
    pub planar: f64,
}

impl Look {
    /// Measures heights. Returns None when fewer than a hundred cells are steeper than 5°.
    #[must_use]
    pub fn of(land: &Field) -> Option<Self> {
        let (nx, ny) = (land.window().nx(), land.window().ny());
        let (cell_m, sea_m) = (land.window().cell_m(), land.window().world.sea_level.unwrap_or(f64::NEG_INFINITY));
        let at = |x: usize, y: usize| f64::from(land.samples()[y * nx + x]);
        let mut slopes = Vec::new();
        let (mut windows, mut planes) = (0_u32, 0_u32);
        for y in 2..ny.saturating_sub(2) {
            for x in (2..nx.saturating_sub(2)).filter(|&x| at(x, y) > sea_m) {
                let (east, south) = (at(x + 1, y) - at(x - 1, y), at(x, y + 1) - at(x, y - 1));
                let degrees = math::atan(math::hypot(east, south) / (2.0 * cell_m)).to_degrees();
                if degrees > STEEP {
                    slopes.push(degrees);
                }
                if degrees > STEEPER {
                    windows += 1;
                    planes += u32::from(is_plane(|dx, dy| at(x + dx - 2, y + dy - 2)));
                }
            }
        }
        if slopes.len() < 100 {
            return None;
        }
        slopes.sort_unstable_by(f64::total_cmp);
        let mut bins = [0_usize; 19];
        slopes.iter().for_each(|degrees| bins[(degrees / 5.0) as usize] += 1);
        let exceeded_by = |share: f64| slopes[((1.0 - share) * (slopes.len() - 1) as f64) as usize];
        Some(Self {
            median: exceeded_by(0.5),
            ratio: exceeded_by(0.05) / exceeded_by(0.5),
            fullest_bin: bins.into_iter().max().unwrap_or(0) as f64 / slopes.len() as f64,
            planar: f64::from(planes) / f64::from(windows.max(1)),
        })
    }

    /// The differences from real mountains. Returns None when there are none.
    #[must_use]
    pub fn faults(&self) -> Option<String> {
        let [ratio, bin, planar] = LIMITS;
        let faults = [
            (self.ratio < ratio).then(|| format!("p95/p50 of slope {:.3}, at least {ratio}", self.ratio)),
            (self.fullest_bin > bin).then(|| format!("fullest bin {:.3}, at most {bin}", self.fullest_bin)),
            (self.planar > planar).then(|| format!("planar share {:.4}, at most {planar}", self.planar)),
        ];
        let faults: Vec<String> = faults.into_iter().flatten().collect();
        (!faults.is_empty()).then(|| faults.join("; "))
    }
}

/// Returns true if 5 × 5 heights lie on their best-fitting plane.
fn is_plane(height: impl Fn(usize, usize) -> f64) -> bool {
    let cells = || (0..25).map(|k| (k % 5, k / 5));
    let mean = cells().map(|(x, y)| height(x, y)).sum::<f64>() / 25.0;
    // squares of -2..=2 along one side add up to 50 over the window
    let along = |of: fn((usize, usize)) -> usize| {
        cells().map(|cell| (of(cell) as f64 - 2.0) * height(cell.0, cell.1)).sum::<f64>() / 50.0
    };
    let (east, south) = (along(|(x, _)| x), along(|(_, y)| y));
    let left = |(x, y): (usize, usize)| height(x, y) - mean - east * (x as f64 - 2.0) - south * (y as f64 - 2.0);
    let rms = (cells().map(|cell| left(cell) * left(cell)).sum::<f64>() / 25.0).sqrt();
    rms < PLANE * 4.0 * math::hypot(east, south)
}
