//! Tests of `Import` of rasters in another coordinate system than the world's.

use std::{f64::consts::TAU, fmt::Write as _};

use orograph_graph::{Cancel, GeoPlace, ParamValue, World};
use tempfile::TempDir;

use super::{tests::*, *};
use crate::{numerics::math, raster::Projection, testing::world};

/// Hills of 300 m with valleys every hundred cells of the file.
fn hills([longitude, latitude]: [f64; 2]) -> f64 {
    1000.0 + 300.0 * math::sin(TAU * longitude / 0.05) * math::cos(TAU * latitude / 0.07)
}

/// An ASCII grid of 300 x 260 cells of 0.0005 degrees from 9° east and 47° north on, and its name. One cell has no
/// data.
fn degrees(void: bool) -> (TempDir, String) {
    let (columns, rows, cell) = (300, 260, 0.0005);
    let mut text =
        format!("ncols {columns}\nnrows {rows}\nxllcorner 9\nyllcorner 47\ncellsize {cell}\nNODATA_value -9999\n");
    for j in 0..rows {
        for i in 0..columns {
            let at = [9.0 + (i as f64 + 0.5) * cell, 47.0 + ((rows - j) as f64 - 0.5) * cell];
            let is_void = void && (i, j) == (150, 130);
            let height = if is_void { -9999.0 } else { hills(at) };
            write!(text, "{height:.4} ").expect("a text");
        }
        text.push('\n');
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("degrees.asc");
    std::fs::write(&path, text).expect("written");
    let name = path.to_str().expect("a name").to_owned();
    (folder, name)
}

/// A world in UTM inside of the file.
fn inside(cells: u32, cell_m: f64) -> World {
    let place = Some(GeoPlace { epsg: 32632, corner_m: [501_000.0, 5_218_000.0] });
    World { place, ..world(cells, cells, cell_m) }
}

fn placed(name: &str, world: World) -> Field {
    import(name, world, &[("placement", choice("place"))])
}

#[test]
fn degrees_lie_where_their_projection_says() {
    let (_folder, name) = degrees(false);
    let system = Projection::of(32632).expect("a system");
    for (cells, cell_m) in [(200, 30.0), (300, 12.5)] {
        let field = placed(&name, inside(cells, cell_m));
        for (k, height) in field.samples().iter().enumerate() {
            let [i, j] = [k as u32 % cells, k as u32 / cells].map(|at| (f64::from(at) + 0.5) * cell_m);
            let expected = hills(system.degrees([501_000.0 + i, 5_218_000.0 - j]).expect("a position"));
            // 19 m per cell of the file where it is steepest; samples cut 0.22 m off a summit half way between them
            assert!((f64::from(*height) - expected).abs() < 0.25, "{i}, {j}: {height} instead of {expected}");
        }
    }
}

#[test]
fn larger_cells_are_means() {
    let (_folder, name) = degrees(false);
    let fine = placed(&name, inside(240, 25.0));
    let coarse = placed(&name, inside(24, 250.0));
    let block = |i: usize, j: usize| {
        let rows = (10 * j..10 * j + 10).flat_map(|j| &fine.samples()[240 * j + 10 * i..][..10]);
        rows.map(|v| f64::from(*v)).sum::<f64>() / 100.0
    };
    for (k, mean) in coarse.samples().iter().enumerate() {
        let expected = block(k % 24, k / 24);
        // of 300 m: means of the file's own cells are interpolated to the cells of the world, which lie between them
        assert!((f64::from(*mean) - expected).abs() < 6.0, "{k}: {mean} instead of {expected}");
    }
    let all = |field: &Field| mean(field.samples());
    assert!((all(&fine) - all(&coarse)).abs() < 0.2, "{} and {}", all(&fine), all(&coarse));
}

#[test]
fn a_window_of_a_warped_raster_equals_its_part_of_the_whole() {
    let (_folder, name) = degrees(true);
    for (cell_m, corner_m) in [(30.0, [501_000.0, 5_218_000.0]), (217.0, [495_000.0, 5_224_000.0])] {
        for voids in ["fill", "level"] {
            let params =
                params(&name, &[("placement", choice("place")), ("beyond", choice("level")), ("voids", choice(voids))]);
            let place = Some(GeoPlace { epsg: 32632, corner_m });
            let whole = Window::whole(World { place, ..world(60, 50, cell_m) });
            let all = outputs(&params, whole, Cancel::default()).expect("a raster");
            for (origin, cells) in [([13, 9], [30, 22]), ([0, 0], [1, 1]), ([59, 49], [1, 1]), ([40, 3], [20, 47])] {
                let part = Window { origin, cells, ..whole };
                assert_eq!(outputs(&params, part, Cancel::default()).expect("a raster"), all.crop(&part), "{cell_m}");
            }
        }
    }
}

#[test]
fn beyond_the_file_there_is_no_data() {
    let (_folder, name) = degrees(true);
    let place = Some(GeoPlace { epsg: 32632, corner_m: [498_000.0, 5_221_000.0] });
    let window = Window::whole(World { place, ..world(160, 160, 100.0) });
    let changes = [("placement", choice("place")), ("beyond", choice("level")), ("level", ParamValue::Float(-7.0))];
    let (mut outputs, told) = all(&params(&name, &changes), window, Cancel::default()).expect("a raster");
    let [value, data] = ["value", "data"].map(|output| field(&mut outputs, output));
    let system = Projection::of(32632).expect("a system");
    let (mut there, mut not) = (0, 0);
    for (k, (value, data)) in value.samples().iter().zip(data.samples()).enumerate() {
        let [i, j] = [k % 160, k / 160].map(|at| (at as f64 + 0.5) * 100.0);
        let [x, y] = system.degrees([498_000.0 + i, 5_221_000.0 - j]).expect("a position");
        // half a cell of the file around its edge is left out: it depends on the last digits
        let inside =
            |margin: f64| (9.0 + margin..9.15 - margin).contains(&x) && (47.0 + margin..47.13 - margin).contains(&y);
        if inside(0.0003) {
            there += 1;
            assert!(*value > 600.0 && *data > 0.0, "{x}, {y}: {value} {data}");
        } else if !inside(-0.0003) {
            not += 1;
            assert_eq!((*value, *data), (-7.0, 0.0), "{x}, {y}");
        }
    }
    assert!(there > 10_000 && not > 5_000, "{there} {not}");
    // only the void
    let partly = data.samples().iter().filter(|v| **v > 0.0 && **v < 1.0).count();
    assert!((1..=9).contains(&partly), "{partly}");
    assert!(told.iter().any(|remark| remark.contains("have no data")), "{told:?}");
}

#[test]
fn what_cannot_be_warped_is_refused_with_a_remedy() {
    let (_folder, name) = degrees(false);
    let fails = |name: &str, epsg, corner_m| {
        let world = World { place: Some(GeoPlace { epsg, corner_m }), ..world(40, 40, 30.0) };
        let params = params(name, &[("placement", choice("place"))]);
        match outputs(&params, Window::whole(world), Cancel::default()) {
            Err(NodeError::Failed { message, hint: Some(hint) }) => format!("{message}; {hint}"),
            other => panic!("{other:?}"),
        }
    };
    let corner = [501_000.0, 5_218_000.0];
    assert!(fails(&name, 32632, [401_000.0, 5_218_000.0]).contains("outside of the world"));
    assert!(fails(&name, 26711, corner).contains("grid of shifts"));
    assert!(fails(&name, 1025, corner).contains("no coordinate system that is known"));
    assert!(fails(&name, 1025, corner).contains("gdalwarp -t_srs EPSG:1025"));
    assert!(fails("glencoe_48x64_u16.png", 32632, corner).contains("the raster has no position"));
    // feet, although the system is a projected one
    assert!(fails(&name, 2263, corner).contains("not in metres"));
}

/// A ramp of longitude from 179° to 181° east, or to 179° west, in a world across the antimeridian.
#[test]
fn a_scene_across_the_antimeridian_is_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("ramp.asc");
    let row: String = (0..200).map(|i| format!("{} ", 179.0 + (f64::from(i) + 0.5) * 0.01)).collect();
    let name = path.to_str().expect("a name").to_owned();
    std::fs::write(path.with_extension("prj"), "GEOGCS[\"GCS_WGS_1984\"]").expect("written");
    let system = Projection::of(32660).expect("a system");
    let [x, y] = system.position([179.5, 65.5]).expect("a position");
    let place = Some(GeoPlace { epsg: 32660, corner_m: [x, y] });
    for west in [179.0, -181.0] {
        let head = format!("ncols 200\nnrows 100\nxllcorner {west}\nyllcorner 65\ncellsize 0.01\n");
        std::fs::write(&path, head + &format!("{row}\n").repeat(100)).expect("written");
        let field = placed(&name, World { place, ..world(40, 40, 1000.0) });
        for (k, value) in field.samples().iter().enumerate() {
            let [i, j] = [k % 40, k / 40].map(|at| (at as f64 + 0.5) * 1000.0);
            let [longitude, _] = system.degrees([x + i, y - j]).expect("a position");
            // a tenth of a cell of the file
            assert!((f64::from(*value) - longitude.rem_euclid(360.0)).abs() < 1e-3, "{value} {longitude}");
        }
    }
}

#[test]
fn a_scene_at_a_pole_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("pole.asc");
    let rows = format!("{}\n", "1 ".repeat(3600)).repeat(50);
    let head = "ncols 3600\nnrows 50\nxllcorner -180\nyllcorner 85\ncellsize 0.1\n";
    std::fs::write(&path, head.to_owned() + &rows).expect("written");
    let place = Some(GeoPlace { epsg: 3413, corner_m: [-200_000.0, 200_000.0] });
    let params = params(path.to_str().expect("a name"), &[("placement", choice("place"))]);
    let window = Window::whole(World { place, ..world(64, 64, 5000.0) });
    let error = outputs(&params, window, Cancel::default()).expect_err("a pole");
    assert!(error.to_string().contains("reaches a pole"), "{error}");
}
