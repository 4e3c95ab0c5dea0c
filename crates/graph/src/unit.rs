//! Units: the meaning of a number, and how it is typed and printed.
//!
//! Inside the program every quantity is in its base unit (metres, years, degrees). A file or a command line may use
//! `"2 km"` or `"35 deg"`, and printed quantities are scaled to be readable.

use std::fmt;

/// The physical unit of a parameter, an input or an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Unit {
    /// A dimensionless ratio, such as a slope in metres per metre or a gain.
    One,
    /// Lengths and elevations, in metres.
    Metres,
    /// Areas, in square metres.
    SquareMetres,
    /// Curvatures and spatial frequencies, per metre.
    PerMetre,
    /// Spans of geological time, in years.
    Years,
    /// Rates of uplift, erosion and rain, in metres per year.
    MetresPerYear,
    /// Fluxes of sediment, in cubic metres per year.
    CubicMetresPerYear,
    /// Diffusivities, in square metres per year.
    SquareMetresPerYear,
    /// Angles, in degrees.
    Degrees,
    /// Compass directions, in degrees clockwise from north: 0 and 360 are the same.
    Azimuth,
    /// Counts.
    Count,
    /// The coefficient K of the stream-power law, in m^(1−2m)/yr: its dimension depends on the exponent m.
    Erodibility,
    /// Spans of a flood or a storm, in seconds.
    Seconds,
    /// Rates of decay, per second.
    PerSecond,
    /// Speeds, in metres per second.
    MetresPerSecond,
    /// Rates of rain and infiltration, in millimetres per hour.
    MillimetresPerHour,
    /// Discharge of a river, in cubic metres per second.
    CubicMetresPerSecond,
    /// Discharge per metre of width, in square metres per second.
    SquareMetresPerSecond,
    /// Manning's roughness, in s/m^(1/3).
    Roughness,
    /// Rates of decay and relaxation, per year.
    PerYear,
    /// Temperatures, in degrees Celsius.
    Celsius,
    /// Lapse rates (cooling of the air with height), in kelvins per kilometre.
    KelvinsPerKilometre,
    /// Pressure or shear stress, Pa.
    Pascals,
    /// Flux of radiation, in watts per square metre.
    WattsPerSquareMetre,
}

/// A suffix that may be typed, with its factor to the base unit.
type Suffix = (&'static str, f64);

impl Unit {
    /// Every unit, in declaration order.
    pub const ALL: [Self; 24] = [
        Self::One,
        Self::Metres,
        Self::SquareMetres,
        Self::PerMetre,
        Self::Years,
        Self::MetresPerYear,
        Self::CubicMetresPerYear,
        Self::SquareMetresPerYear,
        Self::Degrees,
        Self::Azimuth,
        Self::Count,
        Self::Erodibility,
        Self::Seconds,
        Self::PerSecond,
        Self::MetresPerSecond,
        Self::MillimetresPerHour,
        Self::CubicMetresPerSecond,
        Self::SquareMetresPerSecond,
        Self::Roughness,
        Self::PerYear,
        Self::Celsius,
        Self::KelvinsPerKilometre,
        Self::Pascals,
        Self::WattsPerSquareMetre,
    ];

    /// The symbol of the base unit; empty for pure numbers.
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::One | Self::Count => "",
            Self::Metres => "m",
            Self::SquareMetres => "m²",
            Self::PerMetre => "1/m",
            Self::Years => "yr",
            Self::MetresPerYear => "m/yr",
            Self::CubicMetresPerYear => "m³/yr",
            Self::SquareMetresPerYear => "m²/yr",
            Self::Degrees | Self::Azimuth => "°",
            Self::Erodibility => "m^(1−2m)/yr",
            Self::Seconds => "s",
            Self::PerSecond => "1/s",
            Self::MetresPerSecond => "m/s",
            Self::MillimetresPerHour => "mm/h",
            Self::CubicMetresPerSecond => "m³/s",
            Self::SquareMetresPerSecond => "m²/s",
            Self::Roughness => "s/m^(1/3)",
            Self::PerYear => "1/yr",
            Self::Celsius => "°C",
            Self::KelvinsPerKilometre => "K/km",
            Self::Pascals => "Pa",
            Self::WattsPerSquareMetre => "W/m²",
        }
    }

    /// The unit of that symbol; a plain number if it is empty, and an angle if it is °.
    #[must_use]
    pub fn of_symbol(symbol: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|unit| unit.symbol() == symbol)
    }

    /// The unit with its quantity, for messages: "a length in m".
    #[must_use]
    pub const fn describe(self) -> &'static str {
        match self {
            Self::One => "a plain number",
            Self::Metres => "a length in m",
            Self::SquareMetres => "an area in m²",
            Self::PerMetre => "a number per metre",
            Self::Years => "a time in yr",
            Self::MetresPerYear => "a rate in m/yr",
            Self::CubicMetresPerYear => "a flux in m³/yr",
            Self::SquareMetresPerYear => "a diffusivity in m²/yr",
            Self::Degrees => "an angle in °",
            Self::Azimuth => "a direction in °",
            Self::Count => "a count",
            Self::Erodibility => "an erodibility in m^(1−2m)/yr",
            Self::Seconds => "a time in s",
            Self::PerSecond => "a rate per second",
            Self::MetresPerSecond => "a speed in m/s",
            Self::MillimetresPerHour => "a rate in mm/h",
            Self::CubicMetresPerSecond => "a discharge in m³/s",
            Self::SquareMetresPerSecond => "a discharge per width in m²/s",
            Self::Roughness => "a roughness in s/m^(1/3)",
            Self::PerYear => "a rate per year",
            Self::Celsius => "a temperature in °C",
            Self::KelvinsPerKilometre => "a lapse rate in K/km",
            Self::Pascals => "a stress in Pa",
            Self::WattsPerSquareMetre => "a flux in W/m²",
        }
    }

    /// Suffixes that may be typed after a number, the base unit first, then from small to large.
    #[must_use]
    pub const fn suffixes(self) -> &'static [Suffix] {
        match self {
            Self::One | Self::Count => &[("", 1.0), ("%", 0.01)],
            Self::Metres => &[("m", 1.0), ("mm", 1e-3), ("cm", 1e-2), ("km", 1e3), ("ft", 0.3048)],
            Self::SquareMetres => &[("m²", 1.0), ("m2", 1.0), ("ha", 1e4), ("km²", 1e6), ("km2", 1e6)],
            Self::PerMetre => &[("1/m", 1.0), ("1/km", 1e-3)],
            Self::Years => &[("yr", 1.0), ("a", 1.0), ("y", 1.0), ("kyr", 1e3), ("ka", 1e3), ("Myr", 1e6), ("Ma", 1e6)],
            Self::MetresPerYear => &[
                ("m/yr", 1.0),
                ("m/a", 1.0),
                ("mm/yr", 1e-3),
                ("mm/a", 1e-3),
                ("cm/yr", 1e-2),
                ("m/kyr", 1e-3),
                ("m/Myr", 1e-6),
                ("km/Myr", 1e-3),
            ],
            Self::CubicMetresPerYear => &[("m³/yr", 1.0), ("m3/yr", 1.0), ("km³/yr", 1e9), ("km3/yr", 1e9)],
            Self::SquareMetresPerYear => &[("m²/yr", 1.0), ("m2/yr", 1.0), ("m²/kyr", 1e-3), ("m2/kyr", 1e-3)],
            Self::Degrees | Self::Azimuth => &[("°", 1.0), ("deg", 1.0), ("rad", 180.0 / std::f64::consts::PI)],
            Self::Erodibility => &[("m^(1−2m)/yr", 1.0), ("m^(1-2m)/yr", 1.0)],
            Self::Seconds => &[("s", 1.0), ("min", 60.0), ("h", 3600.0), ("d", 86400.0)],
            Self::PerSecond => &[("1/s", 1.0), ("1/min", 1.0 / 60.0), ("1/h", 1.0 / 3600.0)],
            Self::MetresPerSecond => &[("m/s", 1.0), ("mm/s", 1e-3), ("cm/s", 1e-2), ("km/h", 1.0 / 3.6)],
            Self::MillimetresPerHour => &[("mm/h", 1.0), ("m/s", 3.6e6)],
            Self::CubicMetresPerSecond => &[("m³/s", 1.0), ("m3/s", 1.0), ("l/s", 1e-3)],
            Self::SquareMetresPerSecond => &[("m²/s", 1.0), ("m2/s", 1.0)],
            Self::Roughness => &[("s/m^(1/3)", 1.0)],
            Self::PerYear => &[("1/yr", 1.0), ("1/a", 1.0), ("1/kyr", 1e-3), ("1/Myr", 1e-6)],
            Self::Celsius => &[("°C", 1.0), ("C", 1.0)],
            Self::KelvinsPerKilometre => &[("K/km", 1.0), ("K/m", 1e3)],
            Self::Pascals => &[("Pa", 1.0), ("kPa", 1e3)],
            Self::WattsPerSquareMetre => &[("W/m²", 1.0), ("W/m2", 1.0), ("kW/m²", 1e3), ("kW/m2", 1e3)],
        }
    }

    /// Reads a number with an optional suffix of this unit, such as `2 km`, `35deg` or `0.5`.
    ///
    /// # Errors
    /// [`UnitError`] when the text does not start with a number or the suffix is not one of [`Self::suffixes`].
    pub fn parse(self, text: &str) -> Result<f64, UnitError> {
        let text = text.trim();
        let (number, suffix) = split_number(text).ok_or_else(|| UnitError::NotANumber(text.to_owned()))?;
        if suffix.is_empty() {
            return Ok(number);
        }
        self.suffixes()
            .iter()
            .find(|(name, _)| *name == suffix)
            .map(|(_, factor)| number * factor)
            .ok_or_else(|| UnitError::UnknownSuffix { suffix: suffix.to_owned(), expected: self })
    }

    /// A value at the most readable scale of the unit: `2 km`, `35°`, `1.5 mm/yr`.
    #[must_use]
    pub fn display(self, value: f64) -> String {
        let scales: &[Suffix] = match self {
            Self::Metres => &[("km", 1e3), ("m", 1.0)],
            Self::SquareMetres => &[("km²", 1e6), ("m²", 1.0)],
            Self::Years => &[("Myr", 1e6), ("kyr", 1e3), ("yr", 1.0)],
            Self::MetresPerYear => &[("m/yr", 1.0), ("mm/yr", 1e-3)],
            Self::Degrees | Self::Azimuth => return format!("{}°", plain(value)),
            other => &[(other.symbol(), 1.0)],
        };
        let magnitude = value.abs();
        let (name, factor) = scales
            .iter()
            .find(|(_, factor)| magnitude >= *factor)
            .or_else(|| if magnitude == 0.0 { scales.iter().find(|(_, f)| *f == 1.0) } else { scales.last() })
            .copied()
            .unwrap_or(("", 1.0));
        let number = plain(value / factor);
        if name.is_empty() { number } else { format!("{number} {name}") }
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.symbol())
    }
}

/// Why a text is not a quantity of the expected unit.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnitError {
    /// The text does not begin with a number.
    #[error("`{0}` is not a number")]
    NotANumber(String),
    /// The suffix does not belong to the unit.
    #[error("`{suffix}` is not a unit of {}; write one of {}", .expected.describe(), list(.expected.suffixes()))]
    UnknownSuffix {
        /// The typed suffix.
        suffix: String,
        /// The unit that was expected.
        expected: Unit,
    },
}

fn list(suffixes: &[Suffix]) -> String {
    let names: Vec<String> =
        suffixes.iter().filter(|(name, _)| !name.is_empty()).map(|(name, _)| format!("`{name}`")).collect();
    names.join(", ")
}

/// Splits `2.5e3 km` into the number and the trimmed rest.
fn split_number(text: &str) -> Option<(f64, &str)> {
    // The longest prefix that is a number: an `e` may belong to the exponent or to a unit.
    let ends = text.char_indices().map(|(at, c)| at + c.len_utf8());
    let mut best = None;
    for end in ends {
        let head = &text[..end];
        if !head.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.')) {
            break;
        }
        if let Ok(number) = head.parse::<f64>()
            && number.is_finite()
        {
            best = Some((number, text[end..].trim()));
        }
    }
    best
}

/// A number with at most six significant digits and no trailing zeros; very large and small ones with a power of ten.
#[must_use]
pub fn plain(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{}", value + 0.0);
    }
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    let magnitude = rounded.abs();
    if (1e-3..1e7).contains(&magnitude) { format!("{rounded}") } else { format!("{rounded:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn typed_quantities_become_base_units() {
        for (unit, text, expected) in [
            (Unit::Metres, "2 km", 2000.0),
            (Unit::Metres, "2km", 2000.0),
            (Unit::Metres, "-1.5e2", -150.0),
            (Unit::Degrees, "35 deg", 35.0),
            (Unit::Degrees, "35°", 35.0),
            (Unit::Years, "2e6", 2e6),
            (Unit::Years, "2 Myr", 2e6),
            (Unit::MetresPerYear, "1 mm/yr", 1e-3),
            (Unit::SquareMetres, "0.1 km²", 1e5),
            (Unit::One, "50 %", 0.5),
        ] {
            let value = unit.parse(text).expect(text);
            assert!((value - expected).abs() <= 1e-12 * expected.abs(), "{text}: {value}");
        }
    }

    #[test]
    fn a_wrong_suffix_names_the_right_ones() {
        let error = Unit::Metres.parse("2 yr").expect_err("a time is no length").to_string();
        assert!(error.contains("`yr`") && error.contains("`km`"), "{error}");
        assert!(matches!(Unit::Metres.parse("inf"), Err(UnitError::NotANumber(_))));
        assert!(matches!(Unit::Metres.parse(""), Err(UnitError::NotANumber(_))));
        assert!(Unit::Metres.parse("1e999").is_err());
    }

    #[test]
    fn quantities_print_at_a_readable_scale() {
        assert_eq!(Unit::Metres.display(2000.0), "2 km");
        assert_eq!(Unit::Metres.display(0.0), "0 m");
        assert_eq!(Unit::MetresPerYear.display(0.0015), "1.5 mm/yr");
        assert_eq!(Unit::Degrees.display(35.0), "35°");
        assert_eq!(Unit::Years.display(2.5e6), "2.5 Myr");
        assert_eq!(Unit::Erodibility.display(2e-6), "2e-6 m^(1−2m)/yr");
    }

    #[test]
    fn every_base_symbol_parses_back() {
        for unit in Unit::ALL {
            assert_eq!(unit.parse(&format!("3 {}", unit.symbol())), Ok(3.0), "{unit:?}");
        }
    }
}
