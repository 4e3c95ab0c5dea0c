//! Volcanoes: stratovolcanoes and shields, with gullies, lava flows, scoria cones and a crater.
//!
//! A stratovolcano falls exponentially from its summit (J. Milne, 1878, "On the form of volcanos"), nowhere steeper
//! than the angle of repose of loose ash; a shield is nearly a cone. Where the exponential is too steep, a straight
//! cone tangent to it replaces it. `gullies`, `flows` and `shape` take this cone apart.

mod cone;
mod flows;
mod gullies;
mod shape;

use orograph_graph::memory::zeroed;

use self::{cone::Cone, gullies::Gullies, shape::Volcano};
use crate::{numerics::par, prelude::*};

choice! {
    /// Kind of volcano.
    pub enum Form {
        /// Steep at the summit, gentle at its foot: ash and short flows.
        Strato = "strato",
        /// Wide and gentle everywhere: thin lava that flows far.
        Shield = "shield",
    }
}

params! {
    /// Kind of volcano.
    form: Form = Form::Strato, One, ..;
    /// Centre, from the world's north-west corner.
    centre: Position = Position([8192.0, 8192.0]), Metres, -1e7..=1e7;
    /// Height of the summit above the foot, as it would be without a caldera.
    height: f64 = 2200.0, Metres, 0.0..=30000.0, soft 100..=5000;
    /// Distance of the foot from the centre.
    radius: f64 = 7000.0, Metres, 1.0..=1e6, soft 500..=100000;
    /// Steepest slope of a stratovolcano: loose ash rests at about 32 degrees.
    repose: f64 = 32.0, Degrees, 1.0..=60.0, soft 25..=40, when form = "strato";
    /// Radius of the caldera's rim; 0 for none.
    caldera_radius: f64 = 450.0, Metres, 0.0..=1e6, soft 0..=5000;
    /// Depth of the caldera's floor below its rim.
    caldera_depth: f64 = 250.0, Metres, 0.0..=10000.0, soft 0..=1000, given caldera_radius;
    /// How far the caldera's wall is open on one side, as a fraction of its depth: 0 for a closed rim.
    breach: f64 = 0.5, One, 0.0..=1.0, given caldera_radius;
    /// Direction of the gap, clockwise from north.
    breach_azimuth: f64 = 130.0, Degrees, -360.0..=360.0, soft 0..=360, given caldera_radius, given breach;
    /// How deep gullies cut into the flanks: 0 for none.
    gullies: f64 = 0.6, One, 0.0..=1.0;
    /// Distance between large gullies.
    gully_spacing: f64 = 600.0, Metres, 1.0..=1e6, soft 100..=3000, given gullies;
    /// Number of lava flows.
    flows: i64 = 12, Count, 0..=200, soft 0..=40;
    /// Number of scoria cones on the flanks, most of them along a rift zone through the summit.
    cones: i64 = 12, Count, 0..=200, soft 0..=40;
    /// How uneven outline, flanks and rim are: 0 for circles.
    irregularity: f64 = 0.6, One, 0.0..=1.0;
    /// Random seed.
    seed: Seed = Seed(0), Count, ..;
}

outputs! {
    /// Height above the foot.
    height: Height;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Volcano",
    version: 2,
    migrations: &[Migration {
        from: 1,
        steps: &[
            Step::Keep { name: "breach", value: "0" },
            Step::Keep { name: "gullies", value: "0" },
            Step::Keep { name: "flows", value: "0" },
            Step::Keep { name: "cones", value: "0" },
            Step::Keep { name: "irregularity", value: "0" },
        ],
    }],
    category: "generate",
    summary: "A volcano: a stratovolcano or a shield, with gullies, lava flows, scoria cones and a caldera.",
    doc: include_str!("page.md"),
    sources: &[
        "J. Milne (1878), On the form of volcanos, Geological Magazine 5 (8), 337-345",
        "C. A. Cotton (1952), Volcanoes as Landscape Forms, Whitcombe and Tombs",
        "C. A. Wood (1980), Morphometric evolution of cinder cones, Journal of Volcanology and Geothermal Research 7, \
         387-413",
    ],
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    example: "centre: (7000, 9000), height: 1800",
    ..Node::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let window = job.window();
    let seed = orograph_graph::mix(job.seed());
    let cone =
        Cone::new(params.form == Form::Shield, [params.height, params.radius], params.repose).map_err(|least| {
            NodeError::failed_with_hint(
                "the volcano is steeper than ash rests, even as a straight cone",
                format!("write a `radius` above {}", orograph_graph::plain(least)),
            )
        })?;
    let mut volcano = Volcano {
        cone,
        height_m: params.height,
        radius_m: params.radius,
        crater_m: [params.caldera_radius.min(params.radius), params.caldera_depth],
        breach: [params.breach, params.breach_azimuth.to_radians()],
        irregularity: params.irregularity,
        gullies: Gullies::new(params.gullies, params.gully_spacing, params.radius, window.cell_m(), seed),
        flows: Vec::new(),
        scoria: Vec::new(),
        cell_m: window.cell_m(),
        seed,
    };
    volcano.furnish(params.flows, params.cones);
    let even = volcano.is_even();
    let mut height = zeroed(window.len())?;
    par::rows(job, &mut height, |j, row| {
        for (i, height) in row.iter_mut().enumerate() {
            let [x, y] = window.centre_m(i, j);
            let (x, y) = (x - params.centre[0], y - params.centre[1]);
            let value = if even { volcano.even_height((x * x + y * y).sqrt()) } else { volcano.height([x, y]) };
            *height = value as f32;
        }
    })?;
    Ok(Given { height: Some(Field::new(window, height)) }.into())
}

#[cfg(test)]
mod tests;
