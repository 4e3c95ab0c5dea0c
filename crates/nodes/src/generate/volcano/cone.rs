//! The profile of a volcano.

use crate::numerics::math;

/// Decay length of the exponential as a fraction of the radius.
const LENGTH: f64 = 0.35;
/// Exponent of a shield's profile.
const SHIELD: f64 = 1.2;

/// The profile without a caldera.
#[derive(Clone, Copy, Debug)]
pub(super) enum Cone {
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
    /// Finds the profile of that height and radius.
    ///
    /// # Errors
    /// A stratovolcano that would be steeper than ash rests even as a straight cone: the smallest radius it needs.
    pub fn new(shield: bool, [height, radius]: [f64; 2], repose: f64) -> Result<Self, f64> {
        if shield {
            return Ok(Self::Shield { height_m: height, radius_m: radius });
        }
        let slope = math::tan(repose.to_radians());
        let length_m = LENGTH * radius;
        // height of a summit with a straight flank out to that distance
        let summit =
            |straight_m: f64| slope * (length_m * (1.0 - math::exp((straight_m - radius) / length_m)) + straight_m);
        if height >= summit(radius) {
            return Err((height / slope).ceil());
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

    /// Returns the height at a distance from the centre.
    pub fn height(&self, distance_m: f64) -> f64 {
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
