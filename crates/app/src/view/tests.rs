//! Tests of pictures, on any graphics device. They are small, because a software driver is slow.

mod inset;

use std::sync::Arc;

use glam::DVec3;
use orograph_nodes::numerics::math;

use super::{Camera, Cover, Offscreen, Orbit, Scene, Sun, Terrain};
use crate::testing::field;

const SIZE: [u32; 2] = [256, 160];

/// A device. Returns None, with a message, when there is none.
fn device(test: &str) -> Option<Offscreen> {
    (!crate::device::skips(test)).then(|| Offscreen::new().expect("a device was found"))
}

/// Hills and valleys of 400 m over 12.8 km.
fn hills() -> Arc<Terrain> {
    let height = field([256, 256], 50.0, |x, y| {
        400.0 * math::sin(x / 700.0) * math::cos(y / 900.0) + 60.0 * math::sin((x + 2.0 * y) / 230.0) + 500.0
    });
    Arc::new(Terrain::new(&height).expect("heights"))
}

fn scene_of(terrain: &Terrain) -> Scene {
    Scene::new(Orbit::framing(terrain, 1.0, SIZE).camera())
}

/// The mean brightness of the pixels around a point of the picture.
fn brightness(picture: &[u8], [x, y]: [f64; 2]) -> f64 {
    let (x, y) = (x.round() as i64, y.round() as i64);
    let pixels = (y - 2..=y + 2).flat_map(|j| (x - 2..=x + 2).map(move |i| (i, j)));
    let sum: u32 = pixels
        .flat_map(|(i, j)| {
            let at = 4 * (j * i64::from(SIZE[0]) + i) as usize;
            picture[at..at + 3].iter().map(|v| u32::from(*v))
        })
        .sum();
    f64::from(sum) / 75.0
}

#[test]
fn a_picture_is_the_same_twice() {
    let Some(device) = device("a_picture_is_the_same_twice") else { return };
    let terrain = hills();
    let scene = scene_of(&terrain);
    let one = device.picture(&terrain, &scene, SIZE).expect("drawn");
    let mut renderer = device.renderer().expect("a renderer");
    renderer.set_terrain(Arc::clone(&terrain)).expect("shown");
    let other = Scene { camera: Camera { fov_y: 1.0, ..scene.camera }, seconds: 5.0, ..scene.clone() };
    device.drawn(&mut renderer, &other, [100, 70]).expect("drawn");
    let (two, drawn) = device.drawn(&mut renderer, &scene, SIZE).expect("drawn");
    assert!(one == two, "a renderer that has drawn other pictures gives another one");
    assert!(drawn.triangles > 1000);
    assert!(one.chunks_exact(4).any(|pixel| pixel[..3] != one[..3]), "the picture is empty");
}

#[test]
fn the_sun_lights_the_slopes_that_face_it() {
    let Some(device) = device("the_sun_lights_the_slopes_that_face_it") else { return };
    // a ridge from north to south
    let height = field([128, 128], 50.0, |x, _| 900.0 - 0.3 * (x - 3200.0).abs());
    let terrain = Arc::new(Terrain::new(&height).expect("heights"));
    let camera = Camera::looking_at(DVec3::new(3200.0, 9000.0, 3201.0), DVec3::new(3200.0, 0.0, 3200.0), 0.8);
    let slopes = [1600.0, 4800.0].map(|x| camera.pixel(DVec3::new(x, 420.0, 3200.0), SIZE).expect("seen"));
    for (azimuth_deg, west_is_lit) in [(270.0, true), (90.0, false)] {
        let scene = Scene { sun: Sun { azimuth_deg, elevation_deg: 30.0 }, ..Scene::new(camera) };
        let picture = device.picture(&terrain, &scene, SIZE).expect("drawn");
        let [west, east] = slopes.map(|place| brightness(&picture, place));
        assert_eq!(west > east + 20.0, west_is_lit, "{west} {east}");
        assert_eq!(east > west + 20.0, !west_is_lit, "{west} {east}");
    }
}

#[test]
fn swept_shadows_are_where_rays_to_the_sun_are_stopped() {
    let Some(device) = device("swept_shadows_are_where_rays_to_the_sun_are_stopped") else { return };
    let height = field([200, 200], 20.0, |x, y| {
        let hill = |cx: f64, cy: f64, r: f64| 1.0 / (1.0 + ((x - cx) * (x - cx) + (y - cy) * (y - cy)) / (r * r));
        600.0 * hill(1300.0, 1500.0, 350.0) + 450.0 * hill(2600.0, 2500.0, 250.0)
    });
    let terrain = Arc::new(Terrain::new(&height).expect("heights"));
    let camera = Camera::looking_at(DVec3::new(2000.0, 12_000.0, 2001.0), DVec3::new(2000.0, 0.0, 2000.0), 0.33);
    for azimuth_deg in [250.0, 20.0] {
        let sun = Sun { azimuth_deg, elevation_deg: 20.0 };
        let scene = Scene { sun, haze: 0.0, colouring: super::Colouring::Clay, ..Scene::new(camera) };
        let picture = device.picture(&terrain, &scene, SIZE).expect("drawn");
        let open = device.picture(&terrain, &Scene { shadows: false, ..scene.clone() }, SIZE).expect("drawn");
        let (mut hidden, mut wrong, mut looked) = (0, 0, 0);
        for (i, j) in (4..SIZE[0] - 4).step_by(5).flat_map(|i| (4..SIZE[1] - 4).step_by(5).map(move |j| (i, j))) {
            let pixel = [f64::from(i) + 0.5, f64::from(j) + 0.5];
            let Some(hit) = terrain.cast(&camera.ray(pixel, SIZE), 1.0) else { continue };
            let place = |[x, z]: [f64; 2]| DVec3::new(x, terrain.height_at([x, z]), z);
            let [x, z] = hit.place;
            let to_east = place([x + 10.0, z]) - place([x - 10.0, z]);
            let to_south = place([x, z + 10.0]) - place([x, z - 10.0]);
            // slopes that hardly face the sun are as dark without a shadow
            if to_south.cross(to_east).normalize().dot(sun.towards()) < 0.15 {
                continue;
            }
            let start = place(hit.place) + DVec3::Y * 0.5;
            let stopped = terrain.cast(&super::Ray { origin: start, direction: sun.towards() }, 1.0).is_some();
            let level = |picture: &[u8]| brightness(picture, [f64::from(i), f64::from(j)]);
            let dark = level(&picture) < 0.82 * level(&open);
            looked += 1;
            hidden += usize::from(stopped);
            wrong += usize::from(dark != stopped);
        }
        // at the edge of a shadow a mean of 25 pixels can fall on either side
        assert!(looked > 500 && hidden * 50 > looked, "{looked} {hidden}");
        assert!(wrong * 50 < looked, "{wrong} of {looked} pixels, {hidden} of them hidden");
    }
}

#[test]
fn no_cracks_between_levels_of_detail() {
    let Some(device) = device("no_cracks_between_levels_of_detail") else { return };
    // rough terrain, in which a crack would be wide, and levels of detail that change within the picture
    let height = field([700, 700], 10.0, |x, y| {
        120.0 * math::sin(x / 13.0) * math::sin(y / 17.0) + 300.0 * math::cos(x / 900.0) + 500.0
    });
    let terrain = Arc::new(Terrain::new(&height).expect("heights"));
    // from above, so that terrain fills the picture; a crack would show the sky or a wall
    let middle = DVec3::new(3500.0, 0.0, 3500.0);
    let camera = Camera::looking_at(DVec3::new(3500.0, 2600.0, 5200.0), middle, 0.7);
    let scene = Scene { show_levels: true, haze: 0.0, shadows: false, detail_px: 9.0, ..Scene::new(camera) };
    let mut renderer = device.renderer().expect("a renderer");
    renderer.set_terrain(Arc::clone(&terrain)).expect("shown");
    let bare = Scene { background: super::Background::Plain([50.0, 0.0, 50.0]), ..scene };
    let (picture, drawn) = device.drawn(&mut renderer, &bare, SIZE).expect("drawn");
    let cracks = picture
        .chunks_exact(4)
        .filter(|pixel| pixel[0] > pixel[1].saturating_add(60) && pixel[2] > pixel[1].saturating_add(60));
    assert_eq!(cracks.count(), 0);
    assert!(drawn.tiles > 50, "{drawn:?}");
}

#[test]
fn the_sky_is_blue_above_and_red_around_a_low_sun() {
    let Some(device) = device("the_sky_is_blue_above_and_red_around_a_low_sun") else { return };
    let terrain = hills();
    let eye = DVec3::new(6400.0, 3000.0, 6400.0);
    let colour = |sun: Sun, heading: f64, pitch: f64| {
        let camera = Camera::heading(eye, heading.to_radians(), pitch.to_radians(), 0.05);
        let picture = device.picture(&terrain, &Scene { sun, ..Scene::new(camera) }, [8, 8]).expect("drawn");
        [0, 1, 2].map(|c| i32::from(picture[4 * 36 + c]))
    };
    let noon = Sun { azimuth_deg: 180.0, elevation_deg: 60.0 };
    let [red, _, blue] = colour(noon, 0.0, 70.0);
    assert!(blue > red + 40, "{red} {blue}");
    let evening = Sun { azimuth_deg: 270.0, elevation_deg: 1.0 };
    let [red, _, blue] = colour(evening, 270.0, 4.0);
    assert!(red > blue + 20, "{red} {blue}");
    let [away, _, blue] = colour(evening, 90.0, 40.0);
    assert!(blue > away && red > away, "{away} {blue}");
}

#[test]
fn water_and_the_sea_cover_the_land() {
    let Some(device) = device("water_and_the_sea_cover_the_land") else { return };
    let height = field([96, 96], 30.0, |x, _| 0.1 * x);
    let depth = field([96, 96], 30.0, |_, y| if y > 1440.0 { 20.0 } else { 0.0 });
    let terrain = Arc::new(
        Terrain::new(&height)
            .and_then(|terrain| terrain.covered(Cover { water: Some(&depth), ..Cover::default() }))
            .expect("fits"),
    );
    let camera = Camera::looking_at(DVec3::new(1440.0, 5000.0, 1441.0), DVec3::new(1440.0, 0.0, 1440.0), 0.7);
    let scene = Scene { sea_level: Some(72.0), haze: 0.0, ..Scene::new(camera) };
    let picture = device.picture(&terrain, &scene, SIZE).expect("drawn");
    let blue = |x: f64, y: f64| {
        let at = camera.pixel(DVec3::new(x, 0.1 * x, y), SIZE).expect("seen").map(|v| v as usize);
        let pixel = &picture[4 * (at[1] * SIZE[0] as usize + at[0])..][..3];
        i32::from(pixel[2]) - i32::from(pixel[0])
    };
    // sea in the west, water in the south, dry ground in the north-east
    for (x, y, wet) in [(300.0, 700.0, true), (2300.0, 2200.0, true), (2300.0, 700.0, false)] {
        assert_eq!(blue(x, y) > 20, wet, "at {x} {y}: {}", blue(x, y));
    }
}

#[test]
fn what_a_device_refuses_is_an_error() {
    let Some(device) = device("what_a_device_refuses_is_an_error") else { return };
    let terrain = hills();
    let scene = scene_of(&terrain);
    assert!(device.picture(&terrain, &scene, [0, 10]).is_err());
    assert!(device.picture(&terrain, &scene, [1 << 20, 10]).is_err());
    let nowhere = Camera { eye: DVec3::NAN, ..scene.camera };
    for wrong in [
        Scene { camera: nowhere, ..scene.clone() },
        Scene { exaggeration: 0.0, ..scene.clone() },
        Scene { sun: Sun { azimuth_deg: f64::INFINITY, ..scene.sun }, ..scene.clone() },
        Scene { haze: f64::NAN, ..scene.clone() },
    ] {
        let refused = device.picture(&terrain, &wrong, [16, 16]);
        assert!(matches!(refused, Err(super::ViewError::Scene(_))), "{refused:?}");
    }
    // the device still works
    assert!(device.picture(&terrain, &scene, [16, 16]).is_ok());
}

#[test]
fn odd_worlds_are_drawn() {
    let Some(device) = device("odd_worlds_are_drawn") else { return };
    for (cells, cell_m) in [([1, 1], 30.0), ([3, 500], 30.0), ([64, 64], 0.001), ([64, 64], 10_000.0)] {
        let height = field(cells, cell_m, |x, y| 0.2 * cell_m * math::sin(x / cell_m) + 0.01 * y);
        let terrain = Arc::new(Terrain::new(&height).expect("heights"));
        let picture = device.picture(&terrain, &scene_of(&terrain), [64, 40]).expect("drawn");
        let middle = &picture[4 * (20 * 64 + 32)..][..3];
        assert!(middle != &picture[..3], "{cells:?}: nothing in the middle");
    }
}

/// The sides of the block's shadow on the plain are drawn as smooth as other edges: where the light is half that
/// between shadow and sun, they do not step from pixel to pixel.
#[test]
fn the_sides_of_the_shadow_on_the_plain_are_smooth() {
    let Some(device) = device("the_sides_of_the_shadow_on_the_plain_are_smooth") else { return };
    let terrain = Arc::new(Terrain::new(&field([64, 64], 200.0, |_, _| 2000.0)).expect("heights"));
    let sun = Sun { azimuth_deg: 287.0, elevation_deg: 8.0 };
    let scene = Scene { sun, haze: 0.0, ..scene_of(&terrain) };
    let picture = device.picture(&terrain, &scene, SIZE).expect("drawn");
    let away = DVec3::new(-sun.towards().x, 0.0, -sun.towards().z).normalize();
    // the side of the shadow that begins at the south-west corner
    let corner = DVec3::new(0.0, terrain.base(1.0), terrain.size_m()[1]);
    let light = |x: usize, y: usize| {
        let at = 4 * (y * SIZE[0] as usize + x);
        picture[at..at + 3].iter().map(|v| f64::from(*v)).sum::<f64>()
    };
    let mut off = std::collections::BTreeMap::new();
    for step in 0..1400 {
        // away from the wall, whose lower edge is next to the shadow's at first
        let Some([px, py]) = scene.camera.pixel(corner + away * (1500.0 + f64::from(step)), SIZE) else { continue };
        let (x, y) = (px.floor() as usize, py.floor() as usize);
        assert!(x < SIZE[0] as usize && (7..SIZE[1] as usize - 7).contains(&y), "{px} {py}");
        if (px - x as f64 - 0.5).abs() > 0.03 {
            continue;
        }
        let column: Vec<f64> = (y - 6..=y + 6).map(|y| light(x, y)).collect();
        let half = 0.5 * (column[3] + column[10]);
        let at = column.windows(2).position(|pair| (pair[0] < half) != (pair[1] < half)).expect("an edge");
        let part = (half - column[at]) / (column[at + 1] - column[at]);
        off.insert(x, (y - 6 + at) as f64 + 0.5 + part - py);
    }
    let mean = off.values().sum::<f64>() / off.len() as f64;
    let spread = (off.values().map(|off| (off - mean) * (off - mean)).sum::<f64>() / off.len() as f64).sqrt();
    assert!(off.len() > 10 && mean.abs() < 0.5 && spread < 0.12, "{} columns, {mean} {spread}", off.len());
}

/// From close by, an even slope has texture, brighter and darker by some per cent; from afar not a byte of it.
#[test]
fn ground_has_texture_from_close_by() {
    let Some(device) = device("ground_has_texture_from_close_by") else { return };
    let height = field([256, 256], 50.0, |x, _| 0.3 * x + 500.0);
    let terrain = Arc::new(Terrain::new(&height).expect("heights"));
    let ground = |x: f64| DVec3::new(x, 0.3 * x + 500.0, 6400.0);
    let near = Camera::looking_at(ground(6400.0) + DVec3::new(0.0, 60.0, 0.1), ground(6400.0), 0.8);
    let far = scene_of(&terrain).camera;
    let spread = |camera: Camera, texture: f64| {
        let picture = device.picture(&terrain, &Scene { texture, ..Scene::new(camera) }, SIZE).expect("drawn");
        let (low, high) =
            picture.chunks_exact(4).fold((255, 0), |(low, high), pixel| (pixel[1].min(low), pixel[1].max(high)));
        (high - low, picture)
    };
    let (even, rough) = (spread(near, 0.0).0, spread(near, 1.0).0);
    assert!(even < 8 && (20..120).contains(&rough), "{even} without texture, {rough} with it");
    assert!(spread(far, 0.0).1 == spread(far, 1.0).1, "texture is seen from afar");
}

/// Clouds put their fraction of level ground in the shade, in patches with sunlit gaps.
#[test]
fn clouds_shade_their_fraction_of_the_ground() {
    let Some(device) = device("clouds_shade_their_fraction_of_the_ground") else { return };
    let terrain = Arc::new(Terrain::new(&field([256, 256], 100.0, |_, _| 500.0)).expect("heights"));
    let middle = DVec3::new(12_800.0, 500.0, 12_800.0);
    let camera = Camera::looking_at(middle + DVec3::new(0.0, 14_000.0, 0.1), middle, 1.0);
    let green = |clouds: f64| -> Vec<u8> {
        let scene = Scene { clouds, haze: 0.0, texture: 0.0, colouring: super::Colouring::Clay, ..Scene::new(camera) };
        let picture = device.picture(&terrain, &scene, SIZE).expect("drawn");
        picture.chunks_exact(4).map(|pixel| pixel[1]).collect()
    };
    let (clear, overcast) = (green(0.0), green(1.0));
    let half_way = |at: usize| (u16::from(clear[at]) + u16::from(overcast[at])) / 2;
    assert!((0..clear.len()).all(|at| overcast[at] + 20 < clear[at]), "clouds take light");
    for share in [0.2, 0.5, 0.8] {
        let some = green(share);
        let shaded = (0..some.len()).filter(|&at| u16::from(some[at]) < half_way(at)).count() as f64;
        // five of the largest clouds lie along a side: their fraction varies from place to place
        assert!((shaded / some.len() as f64 - share).abs() < 0.12, "{share}: {}", shaded / some.len() as f64);
    }
}
