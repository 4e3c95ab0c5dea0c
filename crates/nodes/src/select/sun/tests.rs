//! The sun on planes, at walls and at the poles, compared with closed forms.

use std::f64::consts::PI;

use super::{path, *};
use crate::{
    numerics::math,
    testing::{at_every_level, field, outputs, reach_m, run as result, run_in, with_params, world},
};

/// Returns the value of an output in the middle of a plane of 20 x 20 cells with slopes to the east and south.
fn on_plane(slopes: [f64; 2], changes: &str, output: &str) -> f64 {
    let land = field(world(20, 20, 10.0), |x, y| slopes[0] * x + slopes[1] * y);
    f64::from(result(&NODE, &with_params(&NODE, changes), &[("height", &land)], output).samples()[10 * 20 + 10])
}

/// The length of the day on level terrain is 24 h acos(−tan φ tan δ) / π, and the mean irradiance above the atmosphere
/// is S / π (ω sin φ sin δ + cos φ cos δ sin ω).
#[test]
fn level_land_has_the_whole_day() {
    for (latitude, day) in [(45.0, 172), (45.0, 355), (0.0, 80), (-60.0, 20), (66.0, 172)] {
        let changes = format!("latitude={latitude},day={day},transmittance=1");
        let (phi, delta) = (f64::to_radians(latitude), path::declination(f64::from(day)));
        let half = path::half_day(phi, delta);
        let duration = on_plane([0.0; 2], &changes, "duration");
        // 48 sums in single precision
        assert!((duration / DAY_S - half / PI).abs() < 1e-5, "{latitude} {day}: {duration}");
        assert!((on_plane([0.0; 2], &changes, "sunlit") - 1.0).abs() < 1e-5);
        let year = 2.0 * PI * f64::from(day - 1) / 365.0;
        let near = 1.000_11
            + 0.034_221 * math::cos(year)
            + 0.001_28 * math::sin(year)
            + 0.000_719 * math::cos(2.0 * year)
            + 0.000_077 * math::sin(2.0 * year);
        let level = half * math::sin(phi) * math::sin(delta) + math::cos(phi) * math::cos(delta) * math::sin(half);
        let expected = path::SOLAR_CONSTANT * near * level / PI;
        let found = on_plane([0.0; 2], &changes, "irradiance");
        // linear interpolation between 49 moments of a half wave loses (π / 48)² / 12 of it
        assert!((found / expected - 1.0).abs() < 6e-4, "{latitude} {day}: {found} {expected}");
    }
}

/// At the equator on an equinox the sun moves in the vertical plane from east to west. A plane that rises to the west
/// by β is sunlit from sunrise until the sun sets behind it, after 180° − β.
#[test]
fn a_plane_has_the_sun_until_it_sinks_behind_it() {
    let day = 80;
    let delta = path::declination(f64::from(day));
    assert!(delta.abs() < 0.01);
    for slope in [0.25, 0.7] {
        for (east, way) in [(-slope, "west"), (slope, "east")] {
            let sunlit = on_plane([east, 0.0], &format!("latitude=0,day={day},azimuths=128"), "sunlit");
            let expected = 1.0 - math::atan(slope) / PI;
            // the sun's path deviates from that plane by 0.4°
            assert!((sunlit - expected).abs() < 0.003, "{way} {slope}: {sunlit} {expected}");
        }
    }
    // a south-facing slope receives more winter sun than a north-facing one
    let [south, north] = [-0.5, 0.5].map(|slope| on_plane([0.0, slope], "latitude=50,day=355", "exposure"));
    assert!(south > 3.0 * north, "{south} {north}");
}

/// A wall of 100 m casts a shadow of 100 m / tan h.
#[test]
fn a_wall_casts_its_shadow() {
    for (azimuth, altitude, length_m) in [(90.0, 45.0, 100.0), (90.0, 20.0, 274.7), (60.0, 30.0, 150.0)] {
        let land = field(world(200, 200, 4.0), |x, _| if x < 600.0 { 0.0 } else { 100.0 });
        let changes = format!("period=fixed,azimuth={azimuth},altitude={altitude}");
        let sunlit = result(&NODE, &with_params(&NODE, &changes), &[("height", &land)], "sunlit");
        let row = &sunlit.samples()[100 * 200..101 * 200];
        let shade_m: f64 = row[..150].iter().map(|sunlit| 4.0 * f64::from(1.0 - sunlit)).sum();
        // within a sampling step, 2 % of the length, and a cell
        assert!((shade_m - length_m).abs() < 0.02 * length_m + 4.0, "{azimuth} {altitude}: {shade_m} {length_m}");
        assert!(row[150..].iter().all(|sunlit| *sunlit > 0.999_999));
    }
}

/// A slope that faces a fixed sun receives its full beam; one that faces away receives nothing.
#[test]
fn exposure_is_the_cosine() {
    let of = |slope: f64| on_plane([slope, 0.0], "period=fixed,azimuth=90,altitude=45", "exposure");
    assert!((of(0.0) - 0.5_f64.sqrt()).abs() < 1e-4);
    assert!((of(-1.0) - 1.0).abs() < 1e-4);
    assert_eq!(of(1.5), 0.0);
}

#[test]
fn nights_of_the_poles_are_dark_and_their_days_are_long() {
    assert_eq!(on_plane([0.2, 0.1], "latitude=85,day=355", "exposure"), 0.0);
    assert_eq!(on_plane([0.2, 0.1], "latitude=85,day=355", "duration"), 0.0);
    assert!((on_plane([0.0; 2], "latitude=90,day=172", "duration") - DAY_S).abs() < 1.0);
    let year = on_plane([0.0; 2], "latitude=0,period=year", "duration");
    assert!((year - 0.5 * DAY_S).abs() < 10.0, "{year}");
}

#[test]
fn all_is_within_its_range_and_the_same_bits_everywhere() {
    let land = field(world(300, 60, 25.0), |x, y| 400.0 * libm::sin(x / 170.0) * libm::cos(y / 230.0));
    for changes in
        ["day=355,azimuths=8,distance=900", "period=year,azimuths=8,distance=900", "period=fixed,distance=900"]
    {
        let params = with_params(&NODE, changes);
        let inputs = [("height", &land)];
        let mut all = outputs(&NODE, &params, &inputs).expect("a result");
        for (name, most) in [("exposure", 1.0), ("sunlit", 1.0), ("duration", 86_400.0), ("irradiance", 1361.0)] {
            let value = all.take(name).expect("declared");
            let samples = value.as_field().expect("a field").samples();
            assert!(samples.iter().all(|v| (0.0..=most).contains(v)), "{changes} {name}");
        }
        assert_eq!(run_in(1, &NODE, &params, &inputs), run_in(3, &NODE, &params, &inputs));
        at_every_level(|| run_in(2, &NODE, &params, &inputs));
        let part = Window { origin: [90, 20], cells: [70, 20], ..*land.window() };
        let grown = land.crop(&part.grown(reach_m(&NODE, &params, 25.0)));
        let whole = result(&NODE, &params, &inputs, "exposure");
        assert_eq!(
            result(&NODE, &params, &[("height", &grown)], "exposure").crop(&part),
            whole.crop(&part),
            "{changes}"
        );
    }
}
