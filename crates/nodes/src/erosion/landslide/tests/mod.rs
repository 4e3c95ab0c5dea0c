//! Tests of landslides: closed forms, published exponents, runouts, balances, and runs on land of many kinds.

mod events;
mod laws;
mod odd;
mod runouts;

use orograph_graph::{Boundary, Edge, World};

use super::NODE;
use crate::{numerics::math, prelude::*, testing};

struct Found {
    height: Vec<f32>,
    scars: Vec<f32>,
    deposit: Vec<f32>,
    soil: Vec<f32>,
    report: Report,
}

impl Found {
    fn measure(&self, name: &str) -> f64 {
        self.report.get(name).expect("a measure")
    }

    /// A volume of a balance; 0 if there is no such material.
    fn volume(&self, material: &str, name: &str) -> f64 {
        self.report.balance_of(material).map_or(0.0, |balance| balance.get(name).expect("a volume"))
    }

    fn rock(&self) -> f64 {
        self.volume("rock", "became_debris")
    }

    fn slides(&self) -> f64 {
        self.measure("rock_slides") + self.measure("soil_slides")
    }

    /// The values of the table of events.
    fn column(&self, series: &str, of_y: bool) -> &[f64] {
        let series = self.report.series.iter().find(|found| found.name == series).expect("a series");
        if of_y { &series.y.values } else { &series.x.values }
    }
}

fn found(mut outputs: Outputs) -> Found {
    let report = outputs.take("report").expect("an output").as_report().expect("a report").clone();
    let mut take = |name| outputs.take(name).expect("an output").as_field().expect("a field").clone().into_samples();
    let found =
        Found { height: take("height"), scars: take("scars"), deposit: take("deposit"), soil: take("soil"), report };
    let all = [&found.height, &found.scars, &found.deposit, &found.soil];
    assert!(all.into_iter().flatten().all(|value| value.is_finite()));
    assert!(all[1..].iter().all(|field| field.iter().all(|thickness| *thickness >= 0.0)));
    assert!(found.report.ledger.iter().all(|balance| balance.error.abs() < 1e-9), "{:?}", found.report.ledger);
    found
}

fn slide(changes: &str, fields: &[(&str, &Field)]) -> Found {
    found(testing::outputs(&NODE, &testing::with_params(&NODE, changes), fields).expect("a result"))
}

fn everywhere(like: &Field, value: f32) -> Field {
    Field::constant(*like.window(), value)
}

/// Mountains with straight slopes of about 35 to 45°, as functions of place.
fn mountains(cells: [u32; 2], cell_m: f64, boundary: Boundary) -> Field {
    let world = World { boundary, ..testing::world(cells[0], cells[1], cell_m) };
    testing::field(world, |x, y| {
        let wave = |at: f64, length_m: f64| 1.0 - (2.0 * ((at / length_m).rem_euclid(1.0) - 0.5)).abs();
        let bend = 180.0 * math::sin(x / 310.0) + 150.0 * math::cos(y / 270.0);
        900.0 * wave(x + 0.3 * y + bend, 2600.0) + 350.0 * wave(y - 0.4 * x + bend, 1100.0) + 90.0 * wave(x - y, 410.0)
    })
}

const OPEN: Boundary = Boundary { west: Edge::Open, east: Edge::Open, north: Edge::Open, south: Edge::Open };
