//! Volcanoes: stratovolcanoes and shields, with a caldera.
//!
//! A stratovolcano falls exponentially from its summit (J. Milne, 1878, "On the form of volcanos"), nowhere steeper
//! than the angle of repose of loose ash; a shield is nearly a cone. Where the exponential is too steep, a straight
//! cone tangent to it replaces it.

use crate::{
    numerics::{math, par},
    prelude::*,
};

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
    centre: [f64; 2] = [8192.0, 8192.0], Metres, -1e7..=1e7;
    /// Height of the summit above the foot, as it would be without a caldera.
    height: f64 = 2200.0, Metres, 0.0..=30000.0, soft 100..=5000;
    /// Distance of the foot from the centre.
    radius: f64 = 7000.0, Metres, 1.0..=1e6, soft 500..=100000;
    /// Steepest slope of a stratovolcano: loose ash rests at about 32 degrees.
    repose: f64 = 32.0, Degrees, 1.0..=60.0, soft 25..=40, when form = "strato";
    /// Radius of the caldera's rim; 0 for none.
    caldera_radius: f64 = 450.0, Metres, 0.0..=1e6, soft 0..=5000;
    /// Depth of the caldera's floor below its rim.
    caldera_depth: f64 = 250.0, Metres, 0.0..=10000.0, soft 0..=1000;
}

outputs! {
    /// Height above the foot.
    height: Height;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Volcano",
    category: "generate",
    summary: "A volcano: a stratovolcano or a shield, with a caldera.",
    doc: include_str!("volcano.md"),
    sources: &["J. Milne (1878), On the form of volcanos, Geological Magazine 5 (8), 337-345"],
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    example: "centre: (7000, 9000), height: 1800",
    ..Node::DEFAULT
};

/// Decay length of the exponential as a fraction of the radius.
const LENGTH: f64 = 0.35;
/// Exponent of a shield's profile.
const SHIELD: f64 = 1.2;
/// Slope of a caldera's walls: tan 60°.
const WALL: f64 = 1.732_050_807_568_877_2;

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let cone = Cone::new(&params)?;
    let window = job.window();
    let rim_m = params.caldera_radius.min(params.radius);
    let rim = cone.height(rim_m);
    let mut height = vec![0.0; window.len()];
    par::rows(job, &mut height, |j, row| {
        for (i, height) in row.iter_mut().enumerate() {
            let [x, y] = window.centre_m(i, j);
            let (dx, dy) = (x - params.centre[0], y - params.centre[1]);
            let distance_m = (dx * dx + dy * dy).sqrt();
            let mut value = cone.height(distance_m);
            if distance_m < rim_m {
                let wall = rim - WALL * (rim_m - distance_m);
                value = value.min(wall.max(rim - params.caldera_depth));
            }
            *height = value as f32;
        }
    })?;
    Ok(Given { height: Some(Field::new(window, height)) }.into())
}

/// The profile without a caldera.
#[derive(Clone, Copy, Debug)]
enum Cone {
    Shield {
        height_m: f64,
        radius_m: f64,
    },
    /// Straight out to the distance `straight_m`, exponential beyond.
    Strato {
        scale_m: f64,
        radius_m: f64,
        straight_m: f64,
        slope: f64,
    },
}

impl Cone {
    fn new(params: &Params) -> Result<Self, NodeError> {
        let Params { height, radius, .. } = *params;
        if params.form == Form::Shield {
            return Ok(Self::Shield { height_m: height, radius_m: radius });
        }
        let slope = math::tan(params.repose.to_radians());
        let length_m = LENGTH * radius;
        // height of a summit with a straight flank out to that distance
        let summit =
            |straight_m: f64| slope * (length_m * (1.0 - math::exp((straight_m - radius) / length_m)) + straight_m);
        if height >= summit(radius) {
            return Err(NodeError::failed_with_hint(
                "the volcano is steeper than ash rests, even as a straight cone",
                format!("write a `radius` above {}", orograph_graph::plain((height / slope).ceil())),
            ));
        }
        if height <= summit(0.0) {
            let scale_m = height / (1.0 - math::exp(-1.0 / LENGTH));
            return Ok(Self::Strato { scale_m, radius_m: radius, straight_m: 0.0, slope });
        }
        let (mut low, mut high) = (0.0, radius);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if summit(middle) < height { low = middle } else { high = middle }
        }
        let scale_m = slope * length_m * math::exp(low / length_m);
        Ok(Self::Strato { scale_m, radius_m: radius, straight_m: low, slope })
    }

    fn height(&self, distance_m: f64) -> f64 {
        match *self {
            Self::Shield { height_m, radius_m } => height_m * math::pow((1.0 - distance_m / radius_m).max(0.0), SHIELD),
            Self::Strato { scale_m, radius_m, straight_m, slope } => {
                let curved_m = distance_m.clamp(straight_m, radius_m);
                let curve = scale_m * (math::exp(-(curved_m / radius_m) / LENGTH) - math::exp(-1.0 / LENGTH));
                curve + slope * (straight_m - distance_m).max(0.0)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{generate, outputs_on, with_params, world};

    /// Returns a profile from the centre to the east.
    fn profile(changes: &str) -> Vec<f32> {
        let land = generate(Window::whole(world(1025, 1025, 16.0)), &NODE, changes);
        land.samples()[511 * 1025 + 511..][..514].to_vec()
    }

    #[test]
    fn a_stratovolcano_is_as_high_as_asked_and_nowhere_steeper_than_repose() {
        for (height, repose) in [(2200.0_f64, 32.0_f64), (600.0, 32.0), (3500.0, 30.0)] {
            let profile = profile(&format!("height={height},repose={repose},caldera_radius=0"));
            // the middle of the world is 8 m from the centre of the nearest cell
            assert!((f64::from(profile[0]) - height).abs() < 10.0, "{}", profile[0]);
            let steepest = math::tan(repose.to_radians());
            let slopes: Vec<f64> = profile.windows(2).map(|pair| f64::from(pair[0] - pair[1]) / 16.0).collect();
            // rounding of thousands of metres in single precision over 16 m
            assert!(slopes[1..].iter().all(|slope| (-1e-4..steepest + 1e-4).contains(slope)), "{slopes:?}");
            // concave without a break: the slope changes by at most 2 % of the steepest per cell
            assert!(slopes[20..430].windows(2).all(|pair| pair[1] <= pair[0] + 1e-4 && pair[0] - pair[1] < 0.02));
            assert_eq!(profile[440], 0.0);
        }
    }

    #[test]
    fn a_shield_is_its_power_and_a_caldera_a_floor_with_steep_walls() {
        let profile = profile("form=shield,height=800,caldera_radius=1600,caldera_depth=300");
        let cone = |r: f64| 800.0 * math::pow(1.0 - r / 7000.0, 1.2);
        let distance = |k: usize| math::hypot(16.0 * k as f64 - 8.0, 8.0);
        for k in [120, 200, 400] {
            assert!((f64::from(profile[k]) - cone(distance(k))).abs() < 0.1, "{k}: {}", profile[k]);
        }
        assert!((f64::from(profile[3]) - (cone(1600.0) - 300.0)).abs() < 1e-3);
        assert!((f64::from(profile[98] - profile[97]) / 16.0 - 1.732).abs() < 0.01);
    }

    #[test]
    fn a_volcano_too_steep_for_ash_is_refused_with_the_radius_it_needs() {
        let params = with_params(&NODE, "height=3000,radius=2000");
        let error = outputs_on(Window::whole(world(8, 8, 10.0)), &NODE, &params, &[]);
        assert!(matches!(error, Err(NodeError::Failed { hint: Some(hint), .. }) if hint.contains("above 4802")));
    }
}
