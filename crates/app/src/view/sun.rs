//! The position of the sun.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use orograph_nodes::numerics::math;

use super::camera::direction;

/// The position of the sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Degrees clockwise from north.
    pub azimuth_deg: f64,
    /// Degrees above the horizon; below 0 it is night.
    pub elevation_deg: f64,
}

impl Default for Sun {
    /// A late afternoon, whose raking light shows the form of slopes.
    fn default() -> Self {
        Self { azimuth_deg: 240.0, elevation_deg: 30.0 }
    }
}

impl Sun {
    /// The sun at a solar hour (12 is noon), a latitude in degrees north and a day of the year.
    ///
    /// The declination is that of Cooper (P. I. Cooper, 1969, The absorption of radiation in solar stills), accurate to
    /// about a degree; the equation of time and refraction are neglected.
    #[must_use]
    pub fn at(hour: f64, latitude_deg: f64, day: f64) -> Self {
        let declination = 23.45_f64.to_radians() * math::sin(TAU * (284.0 + day) / 365.0);
        let latitude = latitude_deg.clamp(-90.0, 90.0).to_radians();
        let turn = (hour - 12.0) * PI / 12.0;
        let (sin_l, cos_l) = (math::sin(latitude), math::cos(latitude));
        let (sin_d, cos_d) = (math::sin(declination), math::cos(declination));
        let east = -cos_d * math::sin(turn);
        let north = sin_d * cos_l - cos_d * math::cos(turn) * sin_l;
        let up = sin_d * sin_l + cos_d * math::cos(turn) * cos_l;
        let azimuth = math::atan2(east, north).to_degrees().rem_euclid(360.0);
        Self { azimuth_deg: azimuth, elevation_deg: math::atan2(up, math::hypot(east, north)).to_degrees() }
    }

    /// Unit vector towards the sun: x east, y up, z south.
    #[must_use]
    pub fn towards(&self) -> DVec3 {
        direction(self.azimuth_deg.to_radians(), self.elevation_deg.clamp(-90.0, 90.0).to_radians())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sun_goes_its_way() {
        // noon at the equinox (the declination is zero on day 81): in the south, 90° minus the latitude above the
        // horizon
        let noon = Sun::at(12.0, 46.0, 81.0);
        assert!((noon.elevation_deg - 44.0).abs() < 0.1 && (noon.azimuth_deg - 180.0).abs() < 0.1, "{noon:?}");
        let morning = Sun::at(6.0, 46.0, 81.0);
        assert!(morning.elevation_deg.abs() < 0.1 && (morning.azimuth_deg - 90.0).abs() < 0.1, "{morning:?}");
        assert!(Sun::at(16.0, 46.0, 172.0).azimuth_deg > 200.0);
        assert!(Sun::at(0.0, 46.0, 172.0).elevation_deg < 0.0);
        let west = Sun { azimuth_deg: 270.0, elevation_deg: 0.0 }.towards();
        assert!((west - DVec3::NEG_X).length() < 1e-12);
    }
}
