//! Land and inputs of all kinds.

use orograph_graph::Cancel;

use super::*;

#[test]
fn nothing_happens_without_time_rate_or_slopes() {
    let land = mountains([80, 80], 25.0, OPEN);
    for changes in ["duration=0", "rate=0", "cohesion=1e8"] {
        let found = slide(changes, &[("height", &land)]);
        assert!(found.height == land.samples() && found.slides() == 0.0, "{changes}");
        assert!(found.scars.iter().chain(&found.deposit).chain(&found.soil).all(|value| *value == 0.0));
        assert!(found.report.series.is_empty());
    }
    for (nx, ny) in [(1, 1), (60, 1), (1, 60), (2, 2), (50, 40)] {
        for edge in [Edge::Open, Edge::Wall, Edge::Periodic, Edge::Base] {
            let world = World { boundary: Boundary::all(edge), ..testing::world(nx, ny, 20.0) };
            let flat = testing::field(world, |_, _| 700.0);
            let [soil, wet] = [2.0, 1.0].map(|value| everywhere(&flat, value));
            let fields = [("height", &flat), ("soil", &soil), ("wetness", &wet)];
            assert_eq!(slide("rate=500,soil_rate=500,cohesion=0", &fields).slides(), 0.0);
            let steep = testing::field(world, |x, y| math::tan(f64::to_radians(89.0)) * (x + y));
            let fields = [("height", &steep), ("soil", &soil), ("wetness", &wet)];
            slide("rate=500,soil_rate=500", &fields);
        }
    }
    let many = testing::outputs(&NODE, &testing::with_params(&NODE, "rate=1e4,duration=1e9"), &[("height", &land)]);
    assert!(many.is_err_and(|error| error.to_string().contains("places would be tested")));
    let [mut odd, mut half] = [OPEN; 2];
    odd.west = Edge::Periodic;
    half.south = Edge::Periodic;
    for boundary in [odd, half] {
        let land = mountains([40, 40], 25.0, boundary);
        let refused = testing::outputs(&NODE, &testing::with_params(&NODE, ""), &[("height", &land)]);
        assert!(refused.is_err_and(|error| error.to_string().contains("periodic")));
    }
}

#[test]
fn voids_and_cliffs_are_sound() {
    let land = mountains([80, 80], 25.0, OPEN);
    let holed = |field: &Field| {
        let mut samples = field.samples().to_vec();
        samples[700] = f32::NAN;
        samples[1500..1540].fill(f32::NAN);
        samples[3000] = f32::INFINITY;
        Field::new(*field.window(), samples)
    };
    let [soil, wet, repose] = [1.0, 1.0, 30.0].map(|value| holed(&everywhere(&land, value)));
    let holed_land = holed(&land);
    let fields = [("height", &holed_land), ("soil", &soil), ("wetness", &wet), ("repose", &repose)];
    assert!(slide("rate=20", &fields).slides() > 10.0);
    slide("rate=20,variation_size=0", &fields);
    let nothing = everywhere(&land, f32::NAN);
    assert_eq!(slide("rate=20", &[("height", &nothing)]).slides(), 0.0);
    let cliff = testing::field(land.window().world, |x, _| if x < 1000.0 { 900.0 } else { 0.0 });
    assert!(slide("rate=20", &[("height", &cliff)]).slides() > 0.0);
    // water below 0 and above 1 is none and all
    let [thick, none, full, least, most] = [1.0, 0.0, 1.0, -3.0, 5.0].map(|value| everywhere(&land, value));
    let wetted = |wet: &Field| slide("rate=0", &[("height", &land), ("soil", &thick), ("wetness", wet)]).height;
    assert!(wetted(&least) == wetted(&none) && wetted(&most) == wetted(&full) && wetted(&none) != wetted(&full));
    let negative = everywhere(&land, -1.0);
    let (outputs, warnings) = testing::outputs_and_warnings(
        &Cancel::default(),
        *land.window(),
        &NODE,
        &testing::with_params(&NODE, ""),
        &[("height", &land), ("soil", &negative)],
    );
    assert_eq!(found(outputs.expect("a result")).measure("soil_slides"), 0.0);
    assert!(warnings.iter().any(|warning| warning.contains("negative")), "{warnings:?}");
}

#[test]
fn the_same_for_any_thread_count_and_simd_level() {
    let land = mountains([150, 120], 25.0, OPEN);
    let [soil, wet] = [2.0, 1.0].map(|value| everywhere(&land, value));
    let params = testing::with_params(&NODE, "rate=10");
    let fields = [("height", &land), ("soil", &soil), ("wetness", &wet)];
    assert_eq!(testing::run_in(1, &NODE, &params, &fields), testing::run_in(5, &NODE, &params, &fields));
    testing::at_every_level(|| testing::outputs(&NODE, &params, &fields));
    let cancel = Cancel::default();
    cancel.cancel();
    let stopped = testing::outputs_until(&cancel, *land.window(), &NODE, &params, &fields);
    assert!(matches!(stopped, Err(NodeError::Cancelled)));
}
