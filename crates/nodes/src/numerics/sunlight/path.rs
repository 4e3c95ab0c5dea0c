//! Position of the sun, and irradiance of its beam.

use std::f64::consts::{PI, TAU};

use crate::numerics::math;

/// Irradiance above the atmosphere at the mean distance of the sun, in W/m² (G. Kopp and J. L. Lean, 2011).
pub const SOLAR_CONSTANT: f64 = 1361.0;

/// Seconds of a day.
pub const DAY_S: f64 = 86_400.0;

/// Half of the sun's angular diameter in degrees.
const RADIUS_DEG: f64 = 0.266;

/// A day near the middle of each month with about the mean declination of the month (S. A. Klein, 1977).
pub const MONTHS: [f64; 12] = [17.0, 47.0, 75.0, 105.0, 135.0, 162.0, 198.0, 228.0, 258.0, 288.0, 318.0, 344.0];

/// The sun at one moment.
#[derive(Clone, Copy, Debug)]
pub struct Position {
    /// Unit vector towards the sun: east, south, up.
    pub towards: [f64; 3],
    /// Azimuth in degrees clockwise from north, 0 to 360.
    pub azimuth: f64,
    /// Tangent of the altitude.
    pub tangent: f64,
    /// Irradiance of a surface that faces the sun, in W/m².
    pub beam: f64,
}

/// An arc of the sun's path: positions at equal time steps.
#[derive(Clone, Debug)]
pub struct Arc {
    /// Positions, at least two.
    pub positions: Vec<Position>,
    /// Time step in seconds.
    pub step_s: f64,
}

impl Position {
    fn new([east, south, up]: [f64; 3], above_air: f64, transmittance: f64) -> Self {
        let level = math::hypot(east, south).max(1e-9);
        let altitude = math::atan2(up, level).to_degrees().max(0.0);
        // F. Kasten and A. T. Young, 1989: relative air mass
        let air = 1.0 / (math::sin(altitude.to_radians()) + 0.50572 * math::pow(altitude + 6.07995, -1.6364));
        Self {
            towards: [east, south, up],
            azimuth: math::atan2(east, -south).to_degrees().rem_euclid(360.0),
            tangent: up / level,
            beam: above_air * math::pow(transmittance, air),
        }
    }
}

/// Returns the sun's arc from sunrise to sunset above a level horizon, in that many steps. Returns None in polar night.
pub fn day(day: f64, latitude_deg: f64, steps: u32, transmittance: f64) -> Option<Arc> {
    let declination = declination(day);
    let latitude = latitude_deg.to_radians();
    let half = half_day(latitude, declination);
    if half <= 0.0 {
        return None;
    }
    let (sin, cos) = (math::sin(latitude), math::cos(latitude));
    let (rise, turn) = (math::sin(declination), math::cos(declination));
    let positions = (0..=steps).map(|step| {
        let hour = half * (2.0 * f64::from(step) / f64::from(steps) - 1.0);
        let north = cos * rise - sin * turn * math::cos(hour);
        let up = sin * rise + cos * turn * math::cos(hour);
        Position::new([-turn * math::sin(hour), -north, up.max(0.0)], above_air(day), transmittance)
    });
    Some(Arc { positions: positions.collect(), step_s: DAY_S * half / PI / f64::from(steps) })
}

/// Returns a fixed sun that lasts a day, as an arc from its lower to its upper edge, which softens shadows.
pub fn fixed(azimuth_deg: f64, altitude_deg: f64, transmittance: f64) -> Arc {
    let azimuth = azimuth_deg.to_radians();
    let positions = [-RADIUS_DEG, RADIUS_DEG].map(|edge| {
        let altitude = (altitude_deg + edge).clamp(0.0, 90.0).to_radians();
        let level = math::cos(altitude);
        let towards = [level * math::sin(azimuth), -level * math::cos(azimuth), math::sin(altitude)];
        Position::new(towards, SOLAR_CONSTANT, transmittance)
    });
    Arc { positions: positions.to_vec(), step_s: DAY_S }
}

/// Returns the declination of the sun in radians (J. W. Spencer, 1971).
pub fn declination(day: f64) -> f64 {
    let year = TAU * (day - 1.0) / 365.0;
    let wave = |k: f64| (math::cos(k * year), math::sin(k * year));
    let [(c1, s1), (c2, s2), (c3, s3)] = [1.0, 2.0, 3.0].map(wave);
    0.006_918 - 0.399_912 * c1 + 0.070_257 * s1 - 0.006_758 * c2 + 0.000_907 * s2 - 0.002_697 * c3 + 0.001_48 * s3
}

/// Returns the irradiance above the atmosphere at the earth's distance on a day, in W/m² (J. W. Spencer, 1971).
fn above_air(day: f64) -> f64 {
    let year = TAU * (day - 1.0) / 365.0;
    let (c1, s1, c2, s2) = (math::cos(year), math::sin(year), math::cos(2.0 * year), math::sin(2.0 * year));
    SOLAR_CONSTANT * (1.000_11 + 0.034_221 * c1 + 0.001_28 * s1 + 0.000_719 * c2 + 0.000_077 * s2)
}

/// Returns the hour angle of sunset in radians: `cos ω = −tan φ tan δ`, 0 in polar night, π in polar day.
pub fn half_day(latitude: f64, declination: f64) -> f64 {
    let cos = (-math::tan(latitude) * math::tan(declination)).clamp(-1.0, 1.0);
    math::atan2((1.0 - cos * cos).sqrt(), cos)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sun_stands_where_almanacs_say() {
        // solstices and equinoxes, within the 0.035° of the series and the days of leap years
        for (day, degrees) in [(172.0, 23.44), (355.0, -23.44), (80.0, 0.0), (266.0, 0.0)] {
            assert!((declination(day).to_degrees() - degrees).abs() < 0.4, "{day}");
        }
        let arc = super::day(172.0, 45.0, 48, 0.7).expect("a day");
        let noon = arc.positions[24];
        assert!((noon.azimuth - 180.0).abs() < 1e-6);
        assert!((math::atan(noon.tangent).to_degrees() - (45.0 + 23.44)).abs() < 0.1);
        let rise = arc.positions[0];
        // cos A = sin δ / cos φ
        let expected = math::atan2((1.0 - 0.5626 * 0.5626_f64).sqrt(), 0.5626).to_degrees();
        assert!((rise.azimuth - expected).abs() < 0.3 && rise.tangent.abs() < 1e-9, "{}", rise.azimuth);
        // the longest day at 45°: 15.4 h
        assert!((arc.step_s * 48.0 / 3600.0 - 15.43).abs() < 0.05);
        for position in arc.positions {
            let square: f64 = position.towards.iter().map(|v| v * v).sum();
            assert!((square - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn poles_have_day_or_night() {
        assert!(super::day(172.0, -90.0, 8, 0.7).is_none());
        let arc = super::day(172.0, 90.0, 8, 0.7).expect("a day");
        assert!((arc.step_s * 8.0 - DAY_S).abs() < 1e-6);
        assert!(arc.positions.iter().all(|position| (position.tangent - 0.4336).abs() < 1e-3)); // tan 23.44°
        let low = fixed(90.0, 1.0, 0.7);
        assert!(low.positions[0].beam < low.positions[1].beam && low.positions[1].beam < 0.1 * SOLAR_CONSTANT);
    }
}
