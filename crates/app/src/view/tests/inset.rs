//! Tests of insets: parts of the terrain at finer cells.

use std::sync::Arc;

use glam::DVec3;
use orograph_graph::{Field, Window, World};
use orograph_nodes::numerics::math;

use super::{SIZE, device};
use crate::{
    testing::field,
    view::{Background, Camera, Inset, Offscreen, Scene, Sun, Terrain},
};

/// Side of the world in metres; cells are 50 m.
const SIDE: f64 = 6400.0;

fn coarse(height: impl Fn(f64, f64) -> f64) -> Arc<Terrain> {
    Arc::new(Terrain::new(&field([128, 128], 50.0, height)).expect("heights"))
}

/// The part from 2000 m to 4400 m along x and y, at cells of `cell_m`.
fn part(terrain: &Terrain, cell_m: f64, height: impl Fn(f64, f64) -> f64) -> Arc<Inset> {
    part_from(terrain, cell_m, [2000.0, 2000.0], height)
}

fn part_from(terrain: &Terrain, cell_m: f64, corner: [f64; 2], height: impl Fn(f64, f64) -> f64) -> Arc<Inset> {
    let cells = |metres: f64| (metres / cell_m).round() as u32;
    let world = World { size: [SIDE; 2], cells: [cells(SIDE); 2], ..World::default() };
    let window = Window { world, origin: corner.map(cells), cells: [cells(2400.0); 2] };
    let samples = (0..window.len()).map(|at| {
        let [x, y] = window.centre_m(at % window.nx(), at / window.nx());
        height(x, y) as f32
    });
    let part = Terrain::new(&Field::new(window, samples.collect())).expect("heights");
    Arc::new(Inset::new(terrain, &part).expect("a part"))
}

fn slope(x: f64, y: f64) -> f64 {
    700.0 + 0.12 * x - 0.3 * y
}

/// A camera south of the middle of the inset, at an elevation in degrees.
fn camera(elevation_deg: f64, distance: f64) -> Camera {
    let target = DVec3::new(3200.0, slope(3200.0, 3200.0), 3200.0);
    let [level, up] = [math::cos(elevation_deg.to_radians()), math::sin(elevation_deg.to_radians())];
    Camera::looking_at(target + DVec3::new(0.3 * level, up, 0.95 * level) * distance, target, 0.7)
}

/// Pictures of the terrain without and with the inset.
fn both(device: &Offscreen, terrain: &Arc<Terrain>, inset: &Arc<Inset>, scene: &Scene) -> [Vec<u8>; 2] {
    let mut renderer = device.renderer().expect("a renderer");
    renderer.set_terrain(Arc::clone(terrain)).expect("shown");
    let before = device.drawn(&mut renderer, scene, SIZE).expect("drawn").0;
    renderer.set_inset(Some(Arc::clone(inset))).expect("shown");
    let with = device.drawn(&mut renderer, scene, SIZE).expect("drawn").0;
    renderer.set_inset(None).expect("shown");
    assert!(device.drawn(&mut renderer, scene, SIZE).expect("drawn").0 == before, "the part is gone again");
    [before, with]
}

fn difference(a: &[u8], b: &[u8]) -> u8 {
    a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
}

#[test]
fn a_part_that_says_nothing_new_changes_no_pixel() {
    let Some(device) = device("a_part_that_says_nothing_new_changes_no_pixel") else { return };
    let terrain = coarse(slope);
    for cell_m in [25.0, 6.25] {
        for elevation_deg in [15.0, 35.0, 75.0] {
            let inset = part(&terrain, cell_m, slope);
            for scene in [Scene::new(camera(elevation_deg, 2500.0)), Scene::new(camera(elevation_deg, 9000.0))] {
                let [before, with] = both(&device, &terrain, &inset, &scene);
                let most = difference(&before, &with);
                assert!(most <= 2, "{cell_m} {elevation_deg}: {most}");
            }
        }
    }
}

#[test]
fn finer_cells_show_where_they_are_and_nowhere_else() {
    let Some(device) = device("finer_cells_show_where_they_are_and_nowhere_else") else { return };
    let terrain = coarse(slope);
    let finer = |x: f64, y: f64| slope(x, y) + 15.0 * math::sin(x / 26.0) * math::cos(y / 23.0);
    let inset = part(&terrain, 6.25, finer);
    // no shadows, which reach beyond the inset
    let scene = Scene { haze: 0.0, shadows: false, ..Scene::new(camera(40.0, 3500.0)) };
    let [before, with] = both(&device, &terrain, &inset, &scene);
    let [west, north, east, south] = inset.rectangle();
    let (mut inside, mut changed) = (0, 0);
    for (at, (a, b)) in (0_u32..).zip(before.chunks_exact(4).zip(with.chunks_exact(4))) {
        let pixel = [f64::from(at % SIZE[0]) + 0.5, f64::from(at / SIZE[0]) + 0.5];
        let Some(hit) = terrain.cast(&scene.camera.ray(pixel, SIZE), 1.0) else { continue };
        let [x, y] = hit.place;
        // distance from the edge of the inset in metres
        let within = (x - west).min(east - x).min(y - north).min(south - y);
        if within > 200.0 {
            inside += 1;
            changed += usize::from(difference(a, b) > 6);
        } else if within < -30.0 {
            assert!(difference(a, b) <= 2, "{within} m inside: {a:?} {b:?}");
        }
    }
    assert!(inside > 3000 && 2 * changed > inside, "{changed} of {inside}");
}

#[test]
fn no_cracks_at_the_edge_of_a_part() {
    let Some(device) = device("no_cracks_at_the_edge_of_a_part") else { return };
    // rough coarse terrain, and an inset that is rougher and at another height
    let rough = |x: f64, y: f64| slope(x, y) + 60.0 * math::sin(x / 71.0) * math::sin(y / 83.0);
    let finer = |x: f64, y: f64| rough(x, y) + 40.0 + 25.0 * math::sin(x / 17.0) * math::cos(y / 13.0);
    let terrain = coarse(rough);
    for (cell_m, corner) in [(12.5, [2000.0; 2]), (3.125, [2000.0; 2]), (6.25, [2000.0, 4000.0])] {
        let inset = part_from(&terrain, cell_m, corner, finer);
        for (elevation_deg, distance) in [(30.0, 1200.0), (50.0, 2400.0), (80.0, 3500.0), (60.0, 900.0)] {
            // terrain fills the picture; a crack would show the background
            let camera = camera(elevation_deg, distance);
            let background = Background::Plain([50.0, 0.0, 50.0]);
            let scene = Scene { background, haze: 0.0, shadows: false, detail_px: 6.0, ..Scene::new(camera) };
            let all_land = (0..SIZE[0]).all(|x| terrain.cast(&camera.ray([f64::from(x), 0.0], SIZE), 1.0).is_some());
            assert!(all_land, "{elevation_deg} {distance}");
            let [_, with] = both(&device, &terrain, &inset, &scene);
            let cracks = with
                .chunks_exact(4)
                .filter(|pixel| pixel[0] > pixel[1].saturating_add(40) && pixel[2] > pixel[1].saturating_add(40));
            assert_eq!(cracks.count(), 0, "{cell_m} {elevation_deg} {distance}");
        }
    }
}

#[test]
fn shadows_cross_the_edge_of_a_part() {
    let Some(device) = device("shadows_cross_the_edge_of_a_part") else { return };
    // a ridge west of the inset, which shades it, and a narrower one in it
    let ridge = |x: f64, at: f64, high: f64| high / (1.0 + ((x - at) / 90.0) * ((x - at) / 90.0));
    let terrain = coarse(|x, _| 400.0 + ridge(x, 1500.0, 900.0));
    let finer = |x: f64, y: f64| {
        let wall = if (y - 3200.0).abs() < 500.0 { ridge(x, 3600.0, 120.0) } else { 0.0 };
        400.0 + ridge(x, 1500.0, 900.0) + wall
    };
    let inset = part(&terrain, 6.25, finer);
    let target = DVec3::new(3200.0, 400.0, 3200.0);
    let camera = Camera::looking_at(target + DVec3::new(0.0, 5000.0, 10.0), target, 0.6);
    let sun = Sun { azimuth_deg: 270.0, elevation_deg: 25.0 };
    let scene = Scene { sun, haze: 0.0, colouring: crate::view::Colouring::Clay, ..Scene::new(camera) };
    let [before, with] = both(&device, &terrain, &inset, &scene);
    let light = |picture: &[u8], x: f64, y: f64| {
        let [i, j] = camera.pixel(DVec3::new(x, 400.0, y), SIZE).expect("seen").map(|v| v as usize);
        i32::from(picture[4 * (j * SIZE[0] as usize + i) + 1])
    };
    // in the shadow of the ridge on both sides of the edge of the inset, and in the sun behind it
    for x in [1950.0, 2100.0, 2400.0] {
        assert!((light(&before, x, 3200.0) - light(&with, x, 3200.0)).abs() <= 8, "{x}");
    }
    assert!(light(&before, 2400.0, 3200.0) + 25 < light(&before, 3300.0, 3200.0));
    // the narrower ridge casts a shadow
    assert!(light(&with, 3750.0, 3200.0) + 25 < light(&before, 3750.0, 3200.0));
    assert!((light(&with, 3750.0, 2300.0) - light(&before, 3750.0, 2300.0)).abs() <= 3);
}
