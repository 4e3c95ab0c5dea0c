//! Classifies terrain into ridges, slopes and valleys, at a length in metres.

use crate::{
    numerics::{gaussian::Gaussian, lines::separable, par},
    prelude::*,
};

params! {
    /// Size of the neighbourhood that a place is compared with: the standard deviation of a Gaussian.
    radius: f64 = 300.0, Metres, 0.1..=1e5, soft 50..=3000;
    /// Deviation at which the masks are a half; they rise from 0 to 1 between a deviation of 0 and twice this value.
    threshold: f64 = 1.0, One, 0.01..=10.0, soft 0.2..=3.0;
}

inputs! {
    /// Terrain height.
    height: Height;
}

outputs! {
    /// Height above the mean of the surroundings.
    position: Scalar(Metres);
    /// `position` divided by its root mean square in the surroundings.
    deviation: Scalar(One);
    /// Where the terrain is higher than its surroundings.
    ridges: Mask;
    /// Where the terrain is lower than its surroundings.
    valleys: Mask;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Position",
    category: "select",
    summary: "Height of a place above its surroundings: ridges and valleys.",
    doc: include_str!("position.md"),
    sources: &[
        "A. D. Weiss (2001), Topographic position and landforms analysis, ESRI User Conference",
        "J. De Reu and others (2013), Application of the topographic position index to heterogeneous landscapes, \
         Geomorphology 186, 39-49",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|params, cell_m| 2.0 * Gaussian::reach_m(Params::read(params).radius, cell_m)),
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    example: "height: \"base\", radius: 800",
    ..Node::DEFAULT
};

/// Heights in metres below which terrain counts as level: a millimetre.
const LEVEL_M: f32 = 1e-3;

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let wants = Wants::among(sizing.wanted);
    let smooth = Gaussian::bytes(Params::read(sizing.params).radius, &sizing.window);
    let given = sizing.cells(4.0 * wants.count() as f64);
    if !(wants.deviation || wants.ridges || wants.valleys) {
        return smooth;
    }
    // positions, their squares and the smoothed squares; then positions, deviations and masks
    let masks = [wants.ridges, wants.valleys].iter().filter(|wanted| **wanted).count();
    (sizing.cells(12.0) + smooth).max(sizing.cells(8.0 + 4.0 * masks as f64)).saturating_sub(given)
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let height = Inputs::read(job)?.height.samples();
    let filter = Gaussian::new(params.radius / job.cell_m());
    let mut position = separable(job, [0.0, 0.4], height, &filter)?;
    par::change_with(&mut position, height, |smoothed, height| *smoothed = height - *smoothed);
    let wants = Wants::of(job);
    let field = |samples| Field::new(job.window(), samples);
    if !(wants.deviation || wants.ridges || wants.valleys) {
        return Ok(Given { position: wants.position.then(|| field(position)), ..Given::default() }.into());
    }
    let squares = par::map_of(&position, |position| position * position);
    let mut deviation = separable(job, [0.4, 0.8], &squares, &filter)?;
    drop(squares);
    par::change_with(&mut deviation, &position, |mean, position| *mean = position / (mean.sqrt() + LEVEL_M));
    job.advance(0.9)?;
    let mask = |side: f32| {
        let share = |v: &f32| crate::numerics::math::lane::smoothstep(side * v / (2.0 * params.threshold as f32));
        field(par::map_of(&deviation, share))
    };
    Ok(Given {
        position: wants.position.then(|| field(position)),
        ridges: wants.ridges.then(|| mask(1.0)),
        valleys: wants.valleys.then(|| mask(-1.0)),
        deviation: wants.deviation.then(|| field(deviation)),
    }
    .into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{field, outputs, with_params, world};

    #[test]
    fn crests_and_troughs_are_told_apart_whatever_their_height() {
        for amplitude_m in [2.0, 500.0] {
            let land = field(world(240, 30, 10.0), |x, _| {
                0.2 * x + amplitude_m * libm::sin(std::f64::consts::TAU * x / 400.0)
            });
            let mut found = outputs(&NODE, &with_params(&NODE, "radius=150"), &[("height", &land)]).expect("runs");
            let mut output = |name| found.take(name).expect("declared").as_field().expect("a field").clone();
            let (position, deviation) = (output("position"), output("deviation"));
            let (ridges, valleys) = (output("ridges"), output("valleys"));
            // crest at 100 m, trough at 300 m of each wave; the third wave is away from the edges
            let (crest, trough, flank) = (3600 + 90, 3600 + 110, 3600 + 100);
            // four boxes transmit (sin 2.04 / 2.04)⁴ = 3.7 % of a wave of 2.7 radii, and the cell's centre is 5 m from
            // the crest
            assert!((f64::from(position.samples()[crest]) / amplitude_m - 0.96).abs() < 0.005);
            assert!(
                (deviation.samples()[crest] - std::f32::consts::SQRT_2).abs() < 0.05,
                "{}",
                deviation.samples()[crest]
            );
            assert!(deviation.samples()[flank].abs() < 0.3);
            assert!(ridges.samples()[crest] > 0.7 && ridges.samples()[trough] == 0.0);
            assert!(valleys.samples()[trough] > 0.7 && valleys.samples()[crest] == 0.0);
        }
    }

    #[test]
    fn level_ground_is_neither() {
        let flat = field(world(20, 20, 10.0), |_, _| 1234.5);
        let mut found = outputs(&NODE, &with_params(&NODE, ""), &[("height", &flat)]).expect("runs");
        for name in ["position", "deviation", "ridges", "valleys"] {
            let value = found.take(name).expect("declared");
            assert!(value.as_field().expect("a field").samples().iter().all(|v| *v == 0.0), "{name}");
        }
    }
}
