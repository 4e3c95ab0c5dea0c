//! Conversion of a raster's own grid to metres.
//!
//! Degrees are converted by the lengths of a degree of longitude and of latitude on the WGS84 ellipsoid at the latitude
//! of the raster's centre (J. P. Snyder, 1987, "Map Projections: A Working Manual", USGS Professional Paper 1395,
//! equations 4-19 and 4-21): a local equirectangular approximation. The relative error of east-west lengths is about
//! `tan(latitude)` times the distance from the centre in radians: 1 % at 64 km north or south of the centre at 45
//! degrees.

use orograph_graph::{Field, NodeError, Window, World};

use super::{Cell, Head, MAX_CELLS, Problem, Raster, fill_voids, resample, resample::GridAxis};
use crate::numerics::math;

/// Semi-major axis of WGS84 in metres.
const WGS84_A_M: f64 = 6_378_137.0;
/// Squared first eccentricity of WGS84.
const WGS84_E2: f64 = 0.006_694_379_990_141_317;

/// Returns the metres in a degree of longitude and in one of latitude.
fn metres_per_degree(latitude_deg: f64) -> [f64; 2] {
    let radian = core::f64::consts::PI / 180.0;
    let (sin, cos) = (math::sin(latitude_deg * radian), math::cos(latitude_deg * radian));
    let w2 = 1.0 - WGS84_E2 * sin * sin;
    let across = WGS84_A_M * cos / w2.sqrt();
    let along = WGS84_A_M * (1.0 - WGS84_E2) / (w2 * w2.sqrt());
    [across * radian, along * radian]
}

impl Head {
    /// Returns the width and height of a cell in metres. Returns None if the file has none.
    ///
    /// # Errors
    /// [`Problem::NoLatitude`] for cells in degrees at an unknown latitude, [`Problem::Damaged`] for impossible sizes.
    pub fn cell_m(&self) -> Result<Option<[f64; 2]>, Problem> {
        let size = match self.cell {
            None => return Ok(None),
            Some(Cell::Metres(size)) => size,
            Some(Cell::Degrees([dx, dy])) => {
                let [_, north] = self.origin.ok_or(Problem::NoLatitude)?;
                let middle = north - 0.5 * dy * self.rows as f64;
                // closer to a pole, the length of a degree of longitude is close to 0
                if middle.is_nan() || middle.abs() > 89.0 {
                    return Err(Problem::NoLatitude);
                }
                let [mx, my] = metres_per_degree(middle);
                [dx * mx, dy * my]
            }
        };
        let [dx, dy] = size;
        if !size.iter().all(|d| (1e-6..=1e7).contains(d)) || dx > 1000.0 * dy || dy > 1000.0 * dx {
            return Err(Problem::Damaged(format!("its cells are {dx} x {dy} m")));
        }
        Ok(Some(size))
    }
}

/// Returns the raster as a heightfield over its own world, with its cells and cell size, and with voids filled.
///
/// `range` is the range of codes if the file has none; `cell_m` replaces the file's cell size. Cells that are not
/// square, such as those in degrees, are resampled along x to their north-south size.
///
/// # Errors
/// [`Problem::NoCellSize`] if neither the file nor the caller gives it, and the problems of [`Head::cell_m`].
pub fn height_field(raster: Raster, range: [f64; 2], cell_m: Option<f64>) -> Result<Field, Problem> {
    let [dx, dy] = match cell_m {
        Some(d) => [d, d],
        None => raster.head.cell_m()?.ok_or(Problem::NoCellSize)?,
    };
    let Raster { head: Head { columns, rows, .. }, mut samples } = raster.decoded(range);
    let failed = |error| match error {
        NodeError::OutOfMemory(refused) => Problem::OutOfMemory(refused),
        never => Problem::Damaged(never.to_string()),
    };
    fill_voids(columns, rows, &mut samples, &|| Ok(())).map_err(failed)?;
    let mut cells = [columns as u64, rows as u64];
    if (dx - dy).abs() > 1e-6 * dx {
        cells[0] = ((columns as f64 * dx / dy).round() as u64).max(1);
    }
    let too_large = Problem::TooLarge { columns: cells[0], rows: cells[1] };
    let side = |count: u64| u32::try_from(count).ok().filter(|count| *count <= World::MAX_SIDE);
    let (Some(nx), Some(ny), true) = (side(cells[0]), side(cells[1]), cells[0] * cells[1] <= MAX_CELLS) else {
        return Err(too_large);
    };
    if nx as usize != columns {
        let axes = [
            GridAxis { source: columns, offset: 0.0, step: columns as f64 / f64::from(nx) },
            GridAxis { source: rows, offset: 0.0, step: 1.0 },
        ];
        samples = resample(&samples, axes, [0, 0], [nx, ny], None, &|| Ok(())).map_err(failed)?;
    }
    let world = World { size: [f64::from(nx) * dy, f64::from(ny) * dy], cells: [nx, ny], ..World::default() };
    Ok(Field::new(Window::whole(world), samples))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_degree_has_its_known_length() {
        // NIMA TR8350.2 (2000): 111.320 km and 110.574 km at the equator, 111.694 km along a meridian at the pole,
        // 78.847 km and 111.132 km at 45 degrees; stated to the metre.
        for (latitude, expected) in
            [(0.0, [111_320.0, 110_574.0]), (45.0, [78_847.0, 111_132.0]), (90.0, [0.0, 111_694.0])]
        {
            let found = metres_per_degree(latitude);
            for (f, e) in found.into_iter().zip(expected) {
                assert!((f - e).abs() < 1.0, "{latitude}: {found:?}");
            }
        }
    }

    #[test]
    fn cells_in_degrees_become_square() {
        let mut raster = Raster { head: Head::new(20, 10), samples: (0..200).map(|v| v as f32).collect() };
        raster.head.cell = Some(Cell::Degrees([0.01, 0.01]));
        assert!(matches!(raster.head.cell_m(), Err(Problem::NoLatitude)));
        raster.head.origin = Some([8.0, 60.05]);
        let field = height_field(raster.clone(), [0.0, 1.0], None).unwrap();
        let window = field.window();
        // at 60 degrees a degree of longitude is 55.8 km, one of latitude 111.4 km
        assert_eq!(window.cells, [10, 10]);
        assert!((window.cell_m() - 1114.1).abs() < 0.5, "{}", window.cell_m());
        assert_eq!(window.world.check(), Ok(()));
        let plain = height_field(raster, [0.0, 1.0], Some(30.0)).unwrap();
        assert_eq!((plain.window().cells, plain.window().cell_m()), ([20, 10], 30.0));
    }

    #[test]
    fn a_raster_without_a_cell_size_says_so() {
        let mut raster = Raster { head: Head::new(2, 2), samples: vec![1.0; 4] };
        assert!(matches!(height_field(raster.clone(), [0.0, 1.0], None), Err(Problem::NoCellSize)));
        raster.head.cell = Some(Cell::Metres([1e-300, 1e300]));
        assert!(matches!(height_field(raster, [0.0, 1.0], None), Err(Problem::Damaged(_))));
    }
}
