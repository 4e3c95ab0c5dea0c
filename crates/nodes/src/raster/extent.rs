//! The world that a raster fills: its size, its cells and its place on Earth.
//!
//! A raster in metres gives its own. For one in degrees, in Web Mercator or in feet, the world is in a metric system
//! that fits: the zone of UTM in which the middle of the raster lies, or the polar stereographic system of UPS beyond
//! 84 degrees north and 80 degrees south. It is the largest rectangle that the raster fills, so that it has no cells
//! without data at its sides. Its cells are as large as those of the raster from north to south.

use std::path::Path;

use orograph_graph::{Extent, GeoPlace, NodeError, WorldError};

use super::{Cell, Head, Problem, Projection, Reader, SystemError};

/// Positions on each side of the raster that are converted.
const STEPS: usize = 64;
/// The farthest that a raster may reach from the meridian of its middle, in degrees of a great circle: lengths in UTM
/// are then wrong by half a percent.
const MOST_FROM_MIDDLE: f64 = 6.0;
/// UPS north and south.
const POLAR: [u32; 2] = [32_661, 32_761];

/// Why a raster has no place in a metric system.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
enum Unfit {
    #[error(transparent)]
    System(#[from] SystemError),
    #[error("it reaches too far for one zone of UTM")]
    Wide,
    #[error("it lies across a pole or outside of its coordinate system")]
    Beyond,
}

/// Returns the world of a raster file, with everything that is assumed about the file.
///
/// # Errors
/// As [`Reader::open`] and [`extent`].
pub fn extent_of(path: &Path) -> Result<Extent, NodeError> {
    let head = Reader::open(path)?.head;
    let mut extent = extent(&head).map_err(|problem| problem.of(path))?;
    extent.remarks.splice(0..0, head.notes);
    Ok(extent)
}

/// Returns the world of a raster.
///
/// # Errors
/// [`Problem::NoCellSize`] if the file has none, and the problems of [`Head::cell_m`].
pub fn extent(head: &Head) -> Result<Extent, Problem> {
    let size = head.cell_m()?.ok_or(Problem::NoCellSize)?;
    let is_metric = matches!(head.cell, Some(Cell::Metres(_))) && head.unit_m == 1.0;
    let plain = plain(head, size);
    if !is_metric && head.origin.is_some() {
        return Ok(metric(head, size[1]).unwrap_or_else(|unfit| {
            let why = [format!("the world gets no place: {unfit}")];
            Extent { remarks: why.into_iter().chain(head.scale_remarks()).collect(), ..plain }
        }));
    }
    let Some((epsg, corner_m)) = head.epsg.zip(head.origin).filter(|_| is_metric) else {
        return Ok(Extent { remarks: head.scale_remarks(), ..plain });
    };
    let placed = Extent { place: Some(GeoPlace { epsg, corner_m }), ..plain.clone() };
    Ok(match placed.world().check() {
        Err(WorldError::System(_)) => {
            let why = format!("the world gets no place: EPSG:{epsg} is not a projected coordinate system");
            Extent { remarks: vec![why], ..plain }
        }
        _ => placed,
    })
}

/// The size and the cells of a raster with cells of that size. Cells that are not square, such as those in degrees,
/// take their north-south size.
fn plain(head: &Head, [dx, dy]: [f64; 2]) -> Extent {
    let columns = if (dx - dy).abs() > 1e-6 * dx { head.columns as f64 * dx / dy } else { head.columns as f64 };
    let cells = [columns, head.rows as f64].map(count);
    Extent { size: cells.map(|cells| f64::from(cells) * dy), cells, place: None, remarks: Vec::new() }
}

fn count(cells: f64) -> u32 {
    cells.round().clamp(1.0, f64::from(u32::MAX)) as u32
}

/// The rectangle that a raster fills in the metric system of its middle, with cells of that size.
fn metric(head: &Head, cell_m: f64) -> Result<Extent, Unfit> {
    let (Some(origin), Some(cell)) = (head.origin, head.cell) else { return Err(Unfit::Beyond) };
    let (raster, cell, from) = match cell {
        Cell::Metres(cell) => {
            let epsg = head.epsg.ok_or(Unfit::Beyond)?;
            (Projection::of(epsg)?, cell.map(|side| side / head.unit_m), format!("EPSG:{epsg}"))
        }
        Cell::Degrees(cell) => (Projection::of(head.epsg.unwrap_or(4326))?, cell, "degrees".to_owned()),
        Cell::Mercator(cell) => (Projection::of(3857)?, cell, "Web Mercator".to_owned()),
    };
    let sides = [cell[0] * head.columns as f64, cell[1] * head.rows as f64];
    let at = |[x, y]: [f64; 2]| {
        let position = [origin[0] + x * sides[0], origin[1] - y * sides[1]];
        raster.degrees(position).ok_or(Unfit::Beyond)
    };
    let middle = at([0.5, 0.5])?;
    let epsg = zone(middle);
    let metric = Projection::of(epsg)?;
    // the positions on a side, from its one end to the other
    let side = |from: [f64; 2], to: [f64; 2]| -> Result<Vec<[f64; 2]>, Unfit> {
        let along = |k: usize| {
            let t = k as f64 / STEPS as f64;
            let degrees = at([0, 1].map(|axis| from[axis] + t * (to[axis] - from[axis])))?;
            let turned = degrees[0] - middle[0] - 360.0 * ((degrees[0] - middle[0]) / 360.0).round();
            if !POLAR.contains(&epsg)
                && turned.abs() * crate::numerics::math::cos(degrees[1].to_radians()) > MOST_FROM_MIDDLE
            {
                return Err(Unfit::Wide);
            }
            metric.position(degrees).ok_or(Unfit::Beyond)
        };
        (0..=STEPS).map(along).collect()
    };
    let (nw, ne, sw, se) = ([0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]);
    let (north, south, west, east) = (side(nw, ne)?, side(sw, se)?, side(nw, sw)?, side(ne, se)?);
    let least = |side: &[[f64; 2]], axis: usize| side.iter().fold(f64::MAX, |least, at| least.min(at[axis]));
    let most = |side: &[[f64; 2]], axis: usize| side.iter().fold(f64::MIN, |most, at| most.max(at[axis]));
    let inner = [most(&west, 0), least(&east, 0), most(&south, 1), least(&north, 1)];
    // to the millimetre, so that a file can state it
    let cell_m = ((cell_m * 1000.0).round() / 1000.0).max(0.001);
    let [west, east, south, north] = inner;
    let corner = [(west / cell_m).ceil() * cell_m, (north / cell_m).floor() * cell_m];
    let cells = [((east - corner[0]) / cell_m).floor(), ((corner[1] - south) / cell_m).floor()];
    if cells.iter().any(|cells| *cells < 1.0) {
        return Err(Unfit::Beyond);
    }
    let cells = cells.map(count);
    let corner_m = corner.map(|metres| (metres * 1000.0).round() / 1000.0);
    let remarks = vec![format!(
        "it is in {from}; the world is in EPSG:{epsg}, where the raster fills {} x {} cells of {cell_m} m",
        cells[0], cells[1]
    )];
    let size = cells.map(|cells| f64::from(cells) * cell_m);
    Ok(Extent { size, cells, place: Some(GeoPlace { epsg, corner_m }), remarks })
}

/// The EPSG code of the zone of UTM, or of the system of UPS, in which a longitude and a latitude lie.
pub(super) fn zone([longitude, latitude]: [f64; 2]) -> u32 {
    if latitude > 84.0 {
        return POLAR[0];
    }
    if latitude < -80.0 {
        return POLAR[1];
    }
    let zone = ((longitude + 180.0).rem_euclid(360.0) / 6.0) as u32 + 1;
    zone.min(60) + if latitude < 0.0 { 32_700 } else { 32_600 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(columns: usize, rows: usize, origin: [f64; 2], cell: Cell, epsg: Option<u32>) -> Head {
        let mut head = Head::new(columns, rows);
        (head.origin, head.cell, head.epsg) = (Some(origin), Some(cell), epsg);
        head
    }

    /// Every corner of the world of a raster lies in the raster, and the world covers most of it.
    #[test]
    fn degrees_and_web_mercator_get_a_metric_world_inside() {
        let degrees =
            |west: f64, north: f64| head(3600, 1800, [west, north], Cell::Degrees([1.0 / 3600.0; 2]), Some(4326));
        let mercator = head(2000, 1500, [-233_000.0, 7_040_000.0], Cell::Mercator([30.0; 2]), Some(3857));
        for (head, epsg) in [
            (degrees(9.0, 47.5), 32632),
            (degrees(-70.2, -33.1), 32719),
            (degrees(179.5, 65.0), 32601),
            (degrees(-180.5, 65.0), 32601),
            (mercator, 32630),
        ] {
            let extent = extent(&head).expect("a world");
            let world = extent.world();
            assert_eq!(world.check(), Ok(()), "{extent:?}");
            let place = world.place.expect("a place");
            assert_eq!(place.epsg, epsg);
            assert!(extent.remarks[0].contains(&format!("EPSG:{epsg}")), "{:?}", extent.remarks);
            let metric = Projection::of(epsg).expect("a system");
            let raster = Projection::of(head.epsg.expect("a code")).expect("a system");
            let [Some(Cell::Degrees(cell) | Cell::Mercator(cell)), _] = [head.cell, None] else { panic!("a cell") };
            for [x, y] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
                let at = [place.corner_m[0] + x * world.size[0], place.corner_m[1] - y * world.size[1]];
                let at = raster.position(metric.degrees(at).expect("degrees")).expect("a position");
                let [west, north] = head.origin.expect("a corner");
                let mut column = (at[0] - west) / cell[0];
                if raster.is_geographic() {
                    column = ((at[0] - west).rem_euclid(360.0)) / cell[0];
                }
                let row = (north - at[1]) / cell[1];
                assert!((0.0..=head.columns as f64).contains(&column), "{epsg}: column {column}");
                assert!((0.0..=head.rows as f64).contains(&row), "{epsg}: row {row}");
            }
            let [dx, dy] = head.cell_m().expect("a size").expect("a size");
            let area = dx * dy * (head.columns * head.rows) as f64;
            let share = world.size[0] * world.size[1] / area;
            assert!((0.9..1.01).contains(&share), "{epsg}: {share}");
        }
    }

    #[test]
    fn feet_are_no_metres() {
        // 1 km north and east of the origin of New York Long Island in feet
        let mut feet = head(1000, 800, [984_250.0, 200_000.0], Cell::Metres([3.048; 2]), Some(2263));
        feet.unit_m = 1200.0 / 3937.0;
        let extent = extent(&feet).expect("a world");
        assert_eq!(extent.place.expect("a place").epsg, 32618);
        assert!((980..=1000).contains(&extent.cells[0]), "{:?}", extent.cells);
        let [x, y] = extent.place.expect("a place").corner_m;
        assert!((580_000.0..590_000.0).contains(&x) && (4_490_000.0..4_520_000.0).contains(&y), "{x} {y}");
    }

    #[test]
    fn what_fits_no_zone_has_a_size_and_no_place() {
        let globe = head(3600, 1800, [-180.0, 90.0], Cell::Degrees([0.1; 2]), Some(4326));
        let grids = head(100, 100, [-100.0, 40.0], Cell::Degrees([0.001; 2]), Some(4267));
        for (head, why) in [(globe, "one zone"), (grids, "grid of shifts")] {
            let extent = extent(&head).expect("a world");
            assert_eq!(extent.place, None);
            assert!(extent.remarks[0].contains(why), "{:?}", extent.remarks);
        }
        // the Arctic
        let arctic = head(600, 600, [10.0, 86.0], Cell::Degrees([0.01, 0.001]), Some(4326));
        assert_eq!(extent(&arctic).expect("a world").place.map(|place| place.epsg), Some(32661));
        let none = head(10, 10, [0.0, 0.0], Cell::Metres([5.0; 2]), None);
        assert_eq!(extent(&none).expect("a world").place, None);
        assert!(matches!(extent(&Head::new(3, 3)), Err(Problem::NoCellSize)));
    }
}
