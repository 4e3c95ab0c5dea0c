//! Layers of rock: outcrops, folds and faults against closed forms, generated tables, sizes.

use orograph_graph::{Boundary, Edge, Layer, ParamValue, Value, World};

use super::NODE;
use crate::{numerics::math, prelude::*, testing};

/// A table of layers of 100 m each, with the numbers 1 to `count`.
fn table(count: usize) -> ParamValue {
    ParamValue::Layers(vec![Layer { thickness: 100.0, ..Layer::USUAL }; count])
}

/// The layers that a terrain cuts.
fn layers(height: &Field, changes: &str, table: ParamValue) -> Vec<f32> {
    let mut params = testing::with_params(&NODE, changes);
    params.set("layers", table);
    testing::run(&NODE, &params, &[("height", height)], "layer").into_samples()
}

fn flat(height_m: f32) -> Field {
    Field::constant(Window::whole(testing::world(200, 200, 10.0)), height_m)
}

const PLAIN: &str = "swells=0,winding=0,beyond=extend";

#[test]
fn flat_layers_are_cut_at_their_elevations() {
    let slope = testing::field(testing::world(200, 3, 10.0), |x, _| x);
    let found = layers(&slope, &format!("{PLAIN},dip=0,top=1500"), table(20));
    for (cell, layer) in found.iter().take(200).enumerate() {
        let x = 10.0 * (cell as f64 + 0.5);
        let expected = if x > 1500.0 { 1.0 } else { ((1500.0 - x) / 100.0).floor() + 1.0 };
        assert_eq!(f64::from(*layer), expected, "{x}");
    }
}

/// One layer is everywhere, and ten thousand are found like few, also where the ground is above and below all of them.
#[test]
fn one_layer_and_ten_thousand_fill_the_ground() {
    let slope = testing::field(testing::world(200, 3, 10.0), |x, _| 6.0 * x - 99.7);
    for beyond in ["extend", "repeat"] {
        let found = layers(&slope, &format!("swells=0,winding=0,beyond={beyond},dip=0,top=1000"), table(1));
        assert!(found.iter().all(|layer| *layer == 1.0), "{beyond}");
    }
    let thin = ParamValue::Layers(vec![Layer { thickness: 1.0, ..Layer::USUAL }; Layer::MOST]);
    let found = layers(&slope, &format!("{PLAIN},dip=0,top=10000"), thin);
    for (layer, height) in found.iter().zip(slope.samples()) {
        assert_eq!(f64::from(*layer), (10_001.0 - f64::from(*height)).floor().clamp(1.0, 1e4), "{height}");
    }
}

/// Over flat ground a layer is t / sin(dip) wide, along the strike; on a slope that falls with the dip it is wider.
#[test]
fn tilted_layers_crop_out_along_analytic_lines() {
    for dip in [10.0_f64, 45.0, 90.0, -30.0] {
        // the strike is north, so that layers descend to the east
        let found = layers(&flat(0.0), &format!("{PLAIN},strike=0,dip={dip},top=0"), table(40));
        let sine = math::sin(dip.to_radians());
        for (cell, layer) in found.iter().enumerate() {
            let x = 10.0 * ((cell % 200) as f64 + 0.5) - 1000.0;
            let expected = (-x * sine / 100.0).floor().clamp(0.0, 39.0) + 1.0;
            assert_eq!(f64::from(*layer), expected, "dip {dip}, {x}");
        }
    }
    // a slope of 5° against layers that dip by 10° in the same direction
    let (slope, dip) = (5.0_f64.to_radians(), 10.0_f64.to_radians());
    let height = testing::field(testing::world(3000, 1, 1.0), |x, _| -(x - 1500.0) * math::tan(slope));
    let found = layers(&height, &format!("{PLAIN},strike=0,dip=10,top=0,beyond=repeat"), table(30));
    let contacts: Vec<usize> = (1..3000).filter(|&cell| found[cell] != found[cell - 1]).collect();
    // along the ground a layer is t / sin(dip − slope) long
    let spacing = 100.0 / math::sin(dip - slope) * math::cos(slope);
    for pair in contacts.windows(2) {
        assert!(((pair[1] - pair[0]) as f64 - spacing).abs() <= 1.0, "{pair:?}, expected {spacing}");
    }
    assert!(contacts.len() >= 2, "{contacts:?}");
}

#[test]
fn an_anticline_is_at_the_centre_and_a_syncline_half_a_fold_beside_it() {
    // the strike is north; the fold runs along the columns
    let changes = format!("{PLAIN},strike=0,dip=0,top=-50,fold_height=300,fold_length=1000");
    let found = layers(&flat(0.0), &changes, table(20));
    let at = |x: f64| found[100 * 200 + ((x / 10.0) as usize)];
    // on the crest the ground cuts 50 m + 300 m into the column, in the trough it is above it
    assert_eq!((at(1000.0), at(500.0), at(1500.0), at(1990.0)), (3.0, 1.0, 1.0, 3.0));
    for x in [105, 135, 185] {
        assert!(found.iter().skip(x).step_by(200).all(|layer| *layer == found[x]), "column {x}");
    }
}

#[test]
fn a_fault_lowers_the_rock_to_its_right() {
    let mut params = testing::with_params(&NODE, &format!("{PLAIN},dip=0,top=-50,throw=200"));
    params.set("layers", table(20));
    // northwards through the middle: the east is to the right
    params.set("fault", ParamValue::Path(vec![[1000.0, 2000.0], [1000.0, 0.0]]));
    let found = testing::run(&NODE, &params, &[("height", &flat(-349.0))], "layer");
    for (cell, layer) in found.samples().iter().enumerate() {
        assert_eq!(*layer, if cell % 200 >= 100 { 1.0 } else { 3.0 }, "{cell}");
    }
}

/// In a periodic world tilted and broken layers turn back before the eastern side, and meet those of the western one.
#[test]
fn layers_meet_across_joined_sides() {
    let world = World { boundary: Boundary::all(Edge::Periodic), ..testing::world(200, 200, 10.0) };
    let height = Field::constant(Window::whole(world), 0.0);
    for changes in ["dip=20,strike=30", "dip=5,fold_height=200,fold_length=700", "dip=0,throw=150"] {
        let params = testing::with_params(&NODE, changes);
        let strata = testing::run(&NODE, &params, &[("height", &height)], "hardness");
        let steps = |from: usize, to: usize, by: usize| {
            (0..200).filter(|at| strata.samples()[from + at * by] != strata.samples()[to + at * by]).count()
        };
        let inside = |step: usize, by: usize| {
            let of = |at: usize| steps(at * step, (at + 1) * step, by);
            (0..199).map(of).max().unwrap_or(0)
        };
        let [across, down] = [steps(199, 0, 200), steps(199 * 200, 0, 1)];
        // layers that dip steeply along a side change from cell to cell
        assert!(across <= inside(1, 200).max(2) && down <= inside(200, 1).max(2), "{changes}: {across} {down}");
        assert!(changes.contains("throw") || steps(140, 0, 200) > 2 * inside(1, 200), "{changes}");
    }
}

#[test]
fn generated_layers_alternate_and_keep_their_contrast() {
    let changes = "count=41,contrast=9,thickness=50,dip=0";
    let params = testing::with_params(&NODE, changes);
    let mut outputs = testing::outputs(&NODE, &params, &[("height", &flat(0.0))]).expect("strata");
    let value = outputs.take("strata").expect("an output");
    let strata = value.as_strata().expect("strata");
    let layers = &strata.column().layers;
    let mean = layers.iter().map(|layer| layer.thickness).sum::<f64>() / 41.0;
    // 41 draws with a deviation of half the mean
    assert!((mean / 50.0 - 1.0).abs() < 0.25, "{mean}");
    for pair in layers.windows(2) {
        let ratio = (pair[0].hardness / pair[1].hardness).max(pair[1].hardness / pair[0].hardness);
        assert!((5.0..17.0).contains(&ratio), "{pair:?}");
    }
    assert_eq!(layers.iter().step_by(2).filter(|layer| layer.hardness > 1.0).count(), 21);
}

/// The value holds the table once and one number per cell.
#[test]
fn the_size_hardly_depends_on_the_number_of_layers() {
    let bytes = |count: usize| {
        let params = testing::with_params(&NODE, &format!("count={count}"));
        let mut outputs = testing::outputs(&NODE, &params, &[("height", &flat(0.0))]).expect("strata");
        outputs.take("strata").as_ref().map(Value::bytes).expect("strata")
    };
    let raster = 200 * 200 * size_of::<f32>();
    assert!(bytes(8) < raster + 1024 && bytes(200) < raster + 16 * 1024, "{} {}", bytes(8), bytes(200));
    assert_eq!(bytes(200) - bytes(8), 192 * size_of::<Layer>());
}
