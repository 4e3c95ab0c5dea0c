//! Coordinate systems of the EPSG register: longitude and latitude of WGS84 to their coordinates and back.
//!
//! The formulas are those of the `proj4rs` crate, the parameters of the systems come from the `crs-definitions` crate.
//! Positions agree with PROJ to a micrometre where the datum is WGS84 or counts as such (ETRS89, NAD83, GDA), and to a
//! centimetre where the datum is shifted by three or seven parameters; these parameters themselves are good to some
//! metres. Systems whose datum needs a grid of shifts are refused.

use std::fmt;

use crs_definitions::from_code;
use proj4rs::{Proj, transform::transform};

/// Longitude and latitude of WGS84.
const WGS84: &str = "+proj=longlat +datum=WGS84 +no_defs";

/// A coordinate system.
pub struct Projection {
    epsg: u32,
    system: Proj,
    wgs84: Proj,
    is_shifted: bool,
}

/// Why positions cannot be converted to a coordinate system.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SystemError {
    /// No such code.
    #[error("EPSG:{0} is no coordinate system that is known here")]
    Unknown(u32),
    /// Its datum is defined by a grid.
    #[error("the datum of EPSG:{0} needs a grid of shifts, which is not included")]
    Grid(u32),
    /// A kind of projection that is not implemented.
    #[error("the projection of EPSG:{0} is not implemented")]
    Unsupported(u32),
}

impl fmt::Debug for Projection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "EPSG:{}", self.epsg)
    }
}

/// Returns the description of a system by its code, as well-known text of version 1 (OGC 01-009). Returns None if it is
/// not known.
#[must_use]
pub fn well_known_text(epsg: u32) -> Option<&'static str> {
    Some(u16::try_from(epsg).ok().and_then(from_code)?.wkt).filter(|text| !text.is_empty())
}

impl Projection {
    /// Returns the system of a code.
    ///
    /// # Errors
    /// See [`SystemError`].
    pub fn of(epsg: u32) -> Result<Self, SystemError> {
        let known = u16::try_from(epsg).ok().and_then(from_code).ok_or(SystemError::Unknown(epsg))?.proj4;
        let mut words = known.split_whitespace();
        // NAD27 is defined by grids only
        let needs_grid =
            |word: &str| word == "+datum=NAD27" || word.starts_with("+nadgrids=") && word != "+nadgrids=@null";
        if words.any(needs_grid) {
            return Err(SystemError::Grid(epsg));
        }
        let of = |text: &str| Proj::from_proj_string(text).map_err(|_| SystemError::Unsupported(epsg));
        Ok(Self { epsg, system: of(known)?, wgs84: of(WGS84)?, is_shifted: is_shifted(known) })
    }

    /// The code.
    #[must_use]
    pub const fn epsg(&self) -> u32 {
        self.epsg
    }

    /// Returns true if its coordinates are degrees.
    #[must_use]
    pub fn is_geographic(&self) -> bool {
        self.system.is_latlong()
    }

    /// Metres in a unit of its coordinates; 1 if these are degrees.
    #[must_use]
    pub fn unit_m(&self) -> f64 {
        if self.is_geographic() { 1.0 } else { self.system.to_meter() }
    }

    /// Returns true if its coordinates are metres in a plane.
    #[must_use]
    pub fn is_in_metres(&self) -> bool {
        !self.is_geographic() && !self.system.is_geocent() && (self.unit_m() - 1.0).abs() < 1e-9
    }

    /// Returns true if its datum differs from WGS84 by more than a metre, so that positions are good to some metres.
    #[must_use]
    pub const fn is_shifted(&self) -> bool {
        self.is_shifted
    }

    /// Returns longitude and latitude in degrees of a position in this system. Returns None outside of its domain.
    #[must_use]
    pub fn degrees(&self, position: [f64; 2]) -> Option<[f64; 2]> {
        let position = if self.is_geographic() { position.map(f64::to_radians) } else { position };
        converted(&self.system, &self.wgs84, position).map(|position| position.map(f64::to_degrees))
    }

    /// Returns the position in this system of a longitude and a latitude in degrees. Returns None outside of its
    /// domain.
    #[must_use]
    pub fn position(&self, degrees: [f64; 2]) -> Option<[f64; 2]> {
        let position = converted(&self.wgs84, &self.system, degrees.map(f64::to_radians))?;
        Some(if self.is_geographic() { position.map(f64::to_degrees) } else { position })
    }
}

fn converted(from: &Proj, to: &Proj, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let mut position = (x, y, 0.0);
    transform(from, to, &mut position).ok()?;
    let (x, y, _) = position;
    (x.is_finite() && y.is_finite()).then_some([x, y])
}

/// Whether the parameters of a system shift its datum.
fn is_shifted(parameters: &str) -> bool {
    let value = |name: &str| parameters.split_whitespace().find_map(|word| word.strip_prefix(name));
    match (value("+datum="), value("+towgs84=")) {
        (Some(datum), _) => !["WGS84", "NAD83"].contains(&datum),
        (None, Some(shift)) => shift.split(',').any(|number| number.parse() != Ok(0.0)),
        (None, None) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Positions by PROJ 9.5.1: the code, longitude, latitude, easting, northing, and the tolerance in metres.
    const BY_PROJ: [(u32, [f64; 2], [f64; 2], f64); 14] = [
        (32632, [9.3, 47.1], [522765.0760426, 5216320.5038455], 1e-06),
        (32719, [-70.2, -33.1], [388024.2972503, 6336986.5378444], 1e-06),
        (25832, [9.3, 47.1], [522765.0760428, 5216320.5037241], 1e-06),
        (3857, [-2.1, 53.2], [-233770.9306659, 7020078.5326421], 1e-06),
        (2193, [172.0, -43.0], [1518491.3521690, 5238700.0748942], 1e-06),
        (3413, [-45.0, 72.0], [0.0000000, -1965440.6647604], 1e-06),
        (5070, [-110.0, 40.0], [-1180436.3071452, 1974084.2872638], 1e-06),
        (3035, [15.3, 49.9], [4701443.2135005, 2990129.7846021], 1e-06),
        (2154, [5.1, 47.0], [859552.8310245, 6657652.6322455], 1e-06),
        (27700, [-2.1, 53.2], [393417.1367681, 366996.1503543], 0.01),
        (2056, [9.3, 47.1], [2741292.3440090, 1218230.9867045], 0.01),
        (28992, [5.1, 52.1], [135321.2181264, 456900.4281491], 0.01),
        (4258, [9.3, 47.1], [9.3000000, 47.1000000], 1e-09),
        // in feet
        (2263, [-73.98, 40.75], [989791.4573486, 212522.5192393], 1e-06),
    ];

    #[test]
    fn positions_are_those_of_proj_and_return() {
        for (epsg, degrees, expected, tolerance_m) in BY_PROJ {
            let system = Projection::of(epsg).expect("a system");
            let found = system.position(degrees).expect("a position");
            for axis in [0, 1] {
                let error = (found[axis] - expected[axis]).abs();
                assert!(error <= tolerance_m, "EPSG:{epsg}: {found:?} instead of {expected:?}");
            }
            let back = system.degrees(found).expect("a position");
            // a tenth of a millimetre, and two millimetres where the datum is shifted there and back
            let error = if system.is_shifted() { 2e-8 } else { 1e-9 };
            assert!(
                (back[0] - degrees[0]).abs() < error && (back[1] - degrees[1]).abs() < error,
                "EPSG:{epsg}: {back:?}"
            );
        }
    }

    #[test]
    fn what_cannot_be_converted_is_refused() {
        let error = |epsg| Projection::of(epsg).expect_err("no system");
        assert_eq!(error(70_000), SystemError::Unknown(70_000));
        assert_eq!(error(1), SystemError::Unknown(1));
        // NAD27 by NADCON's grids
        assert_eq!(error(26711), SystemError::Grid(26711));
        assert!(Projection::of(32632).expect("a system").position([9.0, 95.0]).is_none());
    }

    /// No code of the register and no position makes the formulas panic.
    #[test]
    fn no_system_fails_at_any_position() {
        let (mut systems, mut returned) = (0, 0);
        for system in (1024..=32_766).filter_map(|epsg| Projection::of(epsg).ok()) {
            systems += 1;
            for degrees in [[9.0, 47.0], [-180.0, 90.0], [180.0, -90.0], [0.0, 0.0], [1e9, 1e9], [f64::NAN, 5.0]] {
                let Some(position) = system.position(degrees) else { continue };
                returned += usize::from(system.degrees(position).is_some());
            }
            assert!(system.degrees([f64::NAN; 2]).is_none(), "{system:?}");
            let _ = (system.degrees([1e300, -1e300]), system.degrees([-1e8, 1e8]));
        }
        assert!(systems > 4000 && returned > systems, "{systems} {returned}");
    }

    #[test]
    fn datums_that_differ_are_told() {
        let is_shifted = |epsg| Projection::of(epsg).expect("a system").is_shifted();
        assert!([27700, 2056, 28992].into_iter().all(is_shifted));
        assert!(![32632, 25832, 2193, 3857, 4326].into_iter().any(is_shifted));
    }
}
