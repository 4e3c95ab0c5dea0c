//! A dome of uplift.

use crate::{math, par, prelude::*};

params! {
    /// Place of the highest rate, from the world's north-west corner.
    centre: [f64; 2] = [8192.0, 8192.0], Metres, -1e7..=1e7;
    /// Distance from the centre at which the rate has fallen to 61 % (one standard deviation).
    radius: f64 = 5000.0, Metres, 1.0..=1e7, soft 500..=50000;
    /// Rate at the centre; the land sinks where it is below 0.
    rate: f64 = 0.001, MetresPerYear, -1.0..=1.0, soft 0..=0.005;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Uplift",
    category: "tectonics",
    summary: "A dome of uplift: fastest in the middle, fading outwards.",
    doc: "U = U₀ exp(−r² / 2R²), with U₀ the `rate`, R the `radius` and r the distance to the `centre`. Within one \
          radius of the centre land rises at 61 % of the rate or more, within two at 14 %, beyond three at 1 %.\n\n\
          Stable continents rise at 0.01 to 0.05 mm/yr, old mountains at 0.05 to 0.3, the Alps at 0.5 to 1.5, the \
          Himalaya and Taiwan at 2 to 6. Wire it to the uplift of a node that erodes for as long as the land rises. The \
          default centre is the middle of a default world.",
    sources: &[
        "J. Braun and S. D. Willett (2013), A very efficient O(n), implicit and parallel method to solve the stream \
         power equation governing fluvial incision and landscape evolution, Geomorphology 180-181, 170-179",
    ],
    outputs: &[Output::gives("uplift", PortType::Scalar(Unit::MetresPerYear), "Rate at which the land rises.")],
    params: Params::specs,
    reach: Reach::Point,
    cpu: run,
    example: "centre: (8000, 8000), radius: 5000, rate: 0.001",
    ..Node::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Params { centre, radius, rate } = Params::read(job.params);
    let window = job.window();
    // The exponential of the sum of two squares is the product of one for each.
    let falloff = |at_m: f64, centre_m: f64| {
        let distance = (at_m - centre_m) / radius;
        math::exp(-0.5 * distance * distance)
    };
    let columns: Vec<f64> = (0..window.nx()).map(|i| falloff(window.centre_m(i, 0)[0], centre[0])).collect();
    let mut uplift = vec![0.0; window.len()];
    par::rows(job, &mut uplift, |j, row| {
        let along = rate * falloff(window.centre_m(0, j)[1], centre[1]);
        for (uplift, across) in row.iter_mut().zip(&columns) {
            *uplift = (along * across) as f32;
        }
    })?;
    Ok(Outputs::one("uplift", Field::new(window, uplift)))
}

#[cfg(test)]
mod tests {
    use orograph_graph::ParamValue;

    use super::*;
    use crate::testing;

    #[test]
    fn a_gaussian_of_the_distance() {
        let window = Window::whole(testing::world(40, 30, 100.0));
        let mut params = testing::with_params(&NODE, "radius=900,rate=0.002");
        params.set("centre", ParamValue::Point([1250.0, 3150.0]));
        let mut outputs = testing::outputs_on(window, &NODE, &params, &[]).expect("a result");
        let uplift = outputs.take("uplift").expect("an output").as_field().expect("a field").clone();
        for (at, value) in uplift.samples().iter().enumerate() {
            let [x, y] = window.centre_m(at % 40, at / 40);
            let distance = math::hypot(x - 1250.0, y - 3150.0);
            let expected = 0.002 * math::exp(-distance * distance / (2.0 * 900.0 * 900.0));
            // A few roundings in double precision and one to single: 1e-7 of the value.
            assert!((f64::from(*value) - expected).abs() <= 1e-7 * expected, "{value} is not {expected}");
        }
        assert_eq!(
            uplift.samples()[29 * 40 + 12],
            (0.002 * math::exp(-0.5 * (200.0_f64 / 900.0 * 200.0 / 900.0))) as f32
        );
    }
}
