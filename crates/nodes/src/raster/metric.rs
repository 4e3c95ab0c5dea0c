//! Conversion of a raster's own grid to metres.
//!
//! Degrees are converted by the lengths of a degree of longitude and of latitude on the WGS84 ellipsoid at the latitude
//! of the raster's centre (J. P. Snyder, 1987, "Map Projections: A Working Manual", USGS Professional Paper 1395,
//! equations 4-19 and 4-21): a local equirectangular approximation. Web Mercator, whose easting and northing are those
//! of a sphere with WGS84's semi-major axis (IOGP Guidance Note 7-2, method 1024), is converted in the same way: at 57°
//! a metre on the ground is 1.83 m of the map. The relative error of lengths is about `tan(latitude)` times the
//! distance from the centre in radians: 1 % at 64 km north or south of the centre at 45 degrees.

use orograph_graph::{Field, NodeError, Window, World};

use super::{Cell, Head, MAX_CELLS, Problem, Raster, extent::zone, fill_voids, presence, resample, resample::GridAxis};
use crate::numerics::math;

/// Semi-major axis of WGS84 in metres.
const WGS84_A_M: f64 = 6_378_137.0;
/// Squared first eccentricity of WGS84.
const WGS84_E2: f64 = 0.006_694_379_990_141_317;

/// Radians in a degree.
const RADIAN: f64 = core::f64::consts::PI / 180.0;
/// Relative error of lengths at the north or the south end above which there is a remark.
const LARGE_ERROR: f64 = 0.01;

/// A latitude.
#[derive(Clone, Copy, Debug)]
struct Latitude {
    sin: f64,
    cos: f64,
}

impl Latitude {
    /// Returns None beyond the poles.
    fn of_degrees(degrees: f64) -> Option<Self> {
        let (sin, cos) = (math::sin(degrees * RADIAN), math::cos(degrees * RADIAN));
        (degrees.abs() <= 90.0).then_some(Self { sin, cos })
    }

    /// The latitude of a northing of Web Mercator.
    fn of_northing(northing_m: f64) -> Option<Self> {
        let e = math::exp(northing_m / WGS84_A_M);
        let (sin, cos) = ((e * e - 1.0) / (e * e + 1.0), 2.0 * e / (e * e + 1.0));
        (cos > 0.0 && sin.is_finite()).then_some(Self { sin, cos })
    }

    /// Returns the metres in a radian of longitude and in one of latitude.
    fn metres_per_radian(self) -> [f64; 2] {
        let w2 = 1.0 - WGS84_E2 * self.sin * self.sin;
        [WGS84_A_M * self.cos / w2.sqrt(), WGS84_A_M * (1.0 - WGS84_E2) / (w2 * w2.sqrt())]
    }
}

impl Head {
    /// Returns the latitude after that many rows, from the north. Returns None if it is not known or beyond the poles.
    fn latitude(&self, rows: f64) -> Option<Latitude> {
        let [_, north] = self.origin?;
        match self.cell? {
            Cell::Metres(_) => None,
            Cell::Degrees([_, dy]) => Latitude::of_degrees(north - dy * rows),
            Cell::Mercator([_, dy]) => Latitude::of_northing(north - dy * rows),
        }
    }

    /// Returns the latitude at the centre; closer to a pole than one degree, a degree of longitude has hardly a length.
    fn middle(&self) -> Result<Latitude, Problem> {
        let middle = self.latitude(0.5 * self.rows as f64).ok_or(Problem::NoLatitude)?;
        if middle.cos > 0.017_452 { Ok(middle) } else { Err(Problem::NoLatitude) }
    }

    /// Returns what is assumed for the size of a cell in metres, each a sentence without a full stop.
    #[must_use]
    pub fn scale_remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        if let Some(Cell::Metres([dx, dy])) = self.cell
            && (dx / dy - 1.0).abs() > 1e-6
        {
            remarks.push(format!("cells of {dx} x {dy} m are resampled to squares of {dy} m"));
        }
        let (Some(cell), Ok(middle), Ok(Some(size))) = (self.cell, self.middle(), self.cell_m()) else {
            return remarks;
        };
        if let Cell::Mercator([width, _]) = cell {
            remarks.push(format!(
                "the file is in Web Mercator; its cells of {width:.3} m are {:.3} m wide on the ground at its centre",
                size[0]
            ));
        }
        let ends =
            [0.0, self.rows as f64].map(|rows| self.latitude(rows).map_or(1.0, |end| end.cos / middle.cos - 1.0));
        let error = ends[0].abs().max(ends[1].abs());
        if error > LARGE_ERROR {
            remarks.push(format!(
                "cells are measured at the centre of the file; at its north and south ends they are off by up to \
                 {:.0} %; reproject it first: `gdalwarp -t_srs EPSG:{} in.tif out.tif`",
                100.0 * error,
                self.zone()
            ));
        }
        remarks
    }

    /// Returns the EPSG code of the zone of UTM in which the centre lies.
    fn zone(&self) -> u32 {
        let [west, north] = self.origin.unwrap_or_default();
        zone(match self.cell {
            Some(Cell::Degrees([dx, dy])) => {
                [west + 0.5 * dx * self.columns as f64, north - 0.5 * dy * self.rows as f64]
            }
            Some(Cell::Mercator([dx, dy])) => {
                let east = west + 0.5 * dx * self.columns as f64;
                // only the hemisphere counts
                [east / WGS84_A_M / RADIAN, (north - 0.5 * dy * self.rows as f64).signum()]
            }
            _ => [0.0, 0.0],
        })
    }

    /// Returns the width and height of a cell in metres on the ground. Returns None if the file has none.
    ///
    /// # Errors
    /// [`Problem::NoLatitude`] for cells in degrees or Web Mercator at an unknown latitude, [`Problem::Damaged`] for
    /// impossible sizes.
    pub fn cell_m(&self) -> Result<Option<[f64; 2]>, Problem> {
        let size = match self.cell {
            None => return Ok(None),
            Some(Cell::Metres(size)) => size,
            Some(Cell::Degrees([dx, dy])) => {
                let [across, along] = self.middle()?.metres_per_radian();
                [dx * (across * RADIAN), dy * (along * RADIAN)]
            }
            Some(Cell::Mercator([dx, dy])) => {
                let middle = self.middle()?;
                let [across, along] = middle.metres_per_radian();
                [dx * across / WGS84_A_M, dy * along * middle.cos / WGS84_A_M]
            }
        };
        let [dx, dy] = size;
        if !size.iter().all(|d| (1e-6..=1e7).contains(d)) || dx > 1000.0 * dy || dy > 1000.0 * dx {
            return Err(Problem::Damaged(format!("its cells are {dx} x {dy} m")));
        }
        Ok(Some(size))
    }
}

/// A raster as a heightfield over its own world.
#[derive(Clone, Debug, PartialEq)]
pub struct Heights {
    /// The heights, with voids filled.
    pub field: Field,
    /// 1 where the raster has data and 0 in voids. None if there are no voids.
    pub data: Option<Field>,
}

impl Heights {
    /// Returns the heights with NaN where the raster has no data, or data in a part of the cell only.
    #[must_use]
    pub fn with_voids(self) -> Field {
        let Some(data) = self.data else { return self.field };
        let cells = self.field.samples().iter().zip(data.samples());
        let samples = cells.map(|(&height, &data)| if data < 1.0 { f32::NAN } else { height });
        Field::new(*self.field.window(), samples.collect())
    }
}

/// Returns the raster as a heightfield over its own world, with its cells and cell size, and with voids filled.
///
/// `range` is the range of codes if the file has none; `cell_m` replaces the file's cell size. Cells that are not
/// square, such as those in degrees, are resampled along x to their north-south size.
///
/// # Errors
/// [`Problem::NoCellSize`] if neither the file nor the caller gives it, and the problems of [`Head::cell_m`].
pub fn height_field(raster: Raster, range: [f64; 2], cell_m: Option<f64>) -> Result<Heights, Problem> {
    let [dx, dy] = match cell_m {
        Some(d) => [d, d],
        None => raster.head.cell_m()?.ok_or(Problem::NoCellSize)?,
    };
    let Raster { head: Head { columns, rows, .. }, mut samples, voids } = raster.decoded(range);
    let failed = |error| match error {
        NodeError::OutOfMemory(refused) => Problem::OutOfMemory(refused),
        never => Problem::Damaged(never.to_string()),
    };
    let data = (voids.cells > 0).then(|| presence(&samples)).transpose()?;
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
    let axes = [
        GridAxis { source: columns, offset: 0.0, step: columns as f64 / f64::from(nx) },
        GridAxis { source: rows, offset: 0.0, step: 1.0 },
    ];
    let world = World { size: [f64::from(nx) * dy, f64::from(ny) * dy], cells: [nx, ny], ..World::default() };
    let field = |samples: Vec<f32>| {
        let samples = match nx as usize == columns {
            true => samples,
            false => resample(&samples, axes, [0, 0], [nx, ny], None, &|| Ok(())).map_err(failed)?,
        };
        Ok::<_, Problem>(Field::new(Window::whole(world), samples))
    };
    Ok(Heights { field: field(samples)?, data: data.map(field).transpose()? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Voids;

    #[test]
    fn a_degree_has_its_known_length() {
        // NIMA TR8350.2 (2000): 111.320 km and 110.574 km at the equator, 111.694 km along a meridian at the pole,
        // 78.847 km and 111.132 km at 45 degrees; stated to the metre.
        for (latitude, expected) in
            [(0.0, [111_320.0, 110_574.0]), (45.0, [78_847.0, 111_132.0]), (90.0, [0.0, 111_694.0])]
        {
            let found = Latitude::of_degrees(latitude).expect("a latitude").metres_per_radian();
            for (f, e) in found.into_iter().zip(expected) {
                assert!((f * RADIAN - e).abs() < 1.0, "{latitude}: {found:?}");
            }
        }
    }

    fn raster(columns: usize, rows: usize) -> Raster {
        let samples = (0..columns * rows).map(|v| v as f32).collect();
        Raster { head: Head::new(columns, rows), samples, voids: Voids::default() }
    }

    /// IOGP Guidance Note 7-2 (2019), method 1024: 24°22'54.433" N, 100°20' W is at easting -11169055.58 m and northing
    /// 2800000.00 m. The cell there is 27.34005 m by 27.18804 m on the ground
    /// (PROJ 9.5, distances on the ellipsoid between the middles of its sides).
    #[test]
    fn web_mercator_is_measured_on_the_ground() {
        let latitude = Latitude::of_northing(2_800_000.0).expect("a latitude");
        let degrees = math::atan2(latitude.sin, latitude.cos) / RADIAN;
        assert!((degrees - (24.0 + 22.0 / 60.0 + 54.433 / 3600.0)).abs() < 1e-7, "{degrees}");
        let mut head = raster(20, 10).head;
        head.cell = Some(Cell::Mercator([30.0, 30.0]));
        assert!(matches!(head.cell_m(), Err(Problem::NoLatitude)));
        head.origin = Some([-11_169_055.58, 2_800_150.0]);
        let [width, height] = head.cell_m().expect("a place").expect("a size");
        assert!((width - 27.340_048).abs() < 1e-6 && (height - 27.188_039).abs() < 1.1e-6, "{width} {height}");
        let remarks = head.scale_remarks();
        assert!(remarks.len() == 1 && remarks[0].contains("27.34"), "{remarks:?}");
        // 1200 km from north to south
        head.rows = 40_000;
        head.origin = Some([-11_169_055.58, 3_400_000.0]);
        let remarks = head.scale_remarks();
        assert!(remarks.len() == 2 && remarks[1].contains("EPSG:32614"), "{remarks:?}");
        for northing in [1e9, -1e9, f64::NAN] {
            head.origin = Some([0.0, northing]);
            assert!(matches!(head.cell_m(), Err(Problem::NoLatitude)), "{northing}");
        }
    }

    #[test]
    fn cells_in_degrees_become_square() {
        let mut raster = raster(20, 10);
        raster.head.cell = Some(Cell::Degrees([0.01, 0.01]));
        assert!(matches!(raster.head.cell_m(), Err(Problem::NoLatitude)));
        raster.head.origin = Some([8.0, 60.05]);
        let field = height_field(raster.clone(), [0.0, 1.0], None).unwrap().field;
        let window = field.window();
        // at 60 degrees a degree of longitude is 55.8 km, one of latitude 111.4 km
        assert_eq!(window.cells, [10, 10]);
        assert!((window.cell_m() - 1114.1).abs() < 0.5, "{}", window.cell_m());
        assert_eq!(window.world.check(), Ok(()));
        let plain = height_field(raster, [0.0, 1.0], Some(30.0)).unwrap().field;
        assert_eq!((plain.window().cells, plain.window().cell_m()), ([20, 10], 30.0));
    }

    #[test]
    fn voids_are_known_after_they_are_filled() {
        let mut holed = raster(20, 10);
        holed.head.cell = Some(Cell::Metres([10.0, 10.0]));
        assert_eq!(height_field(holed.clone(), [0.0, 1.0], None).unwrap().data, None);
        holed.samples[45] = f32::NAN;
        holed.voids.cells = 1;
        let Heights { field, data } = height_field(holed, [0.0, 1.0], None).unwrap();
        let data = data.expect("voids");
        assert!(field.samples()[45].is_finite());
        assert!(data.samples().iter().enumerate().all(|(at, v)| *v == f32::from(u8::from(at != 45))));
    }

    #[test]
    fn a_raster_without_a_cell_size_says_so() {
        let mut raster = raster(2, 2);
        assert!(matches!(height_field(raster.clone(), [0.0, 1.0], None), Err(Problem::NoCellSize)));
        raster.head.cell = Some(Cell::Metres([1e-300, 1e300]));
        assert!(matches!(height_field(raster, [0.0, 1.0], None), Err(Problem::Damaged(_))));
    }
}
