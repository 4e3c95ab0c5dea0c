//! The parameters that a fit varies: their ranges, their scale and their notation in the file.

use orograph_graph::{Document, Unit, plain};

use super::place::{self, Declared, Vary};
use crate::{build::request::Setting, report::failure::Failure};

/// A positive range that spans more than this factor is searched by factors.
const FACTOR: f64 = 30.0;

/// Side of the first simplex, as a share of the range.
pub(super) const FIRST: f64 = 0.15;

/// A number of a graph that is varied within a range.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its name on the command line.
    pub place: String,
    /// Its unit.
    pub unit: Unit,
    /// The range of the search.
    pub range: [f64; 2],
    /// The range that a file may use.
    pub hard: [f64; 2],
    /// Its value in the file, or the end of the range that is nearest to it.
    pub start: f64,
    whole: bool,
    /// The unit that the file is written in, with its factor; None for a number without a unit.
    suffix: Option<(&'static str, f64)>,
}

impl Parameter {
    /// Finds the parameter in a document.
    ///
    /// # Errors
    /// When there is no such parameter, it is no number, or the range is empty or not within the declared one.
    pub fn of(document: &Document, vary: &Vary) -> Result<Self, Failure> {
        let place = &vary.place;
        let wrong = |what: &str| Failure::wrong(format!("`--vary {place}`: {what}"));
        let (node, name, Declared { unit, value, hard, soft, whole }) = place::find(document, place, &wrong)?;
        let range = match &vary.range {
            Some(text) => {
                place::typed(text, unit).map_err(|why| wrong(&why).hint("write `=LO..HI`, such as `=500 m..2 km`"))?
            }
            None => [soft[0].min(value), soft[1].max(value)],
        };
        place::check_range(range, hard, unit, &wrong)?;
        let suffix = place::written_unit(document, &node, &name, unit);
        let start = value.clamp(range[0], range[1]);
        let found = Self { place: place.clone(), unit, range, hard, start, whole, suffix };
        Ok(Self { start: found.stated(start), ..found })
    }

    /// True if the range is searched by factors.
    #[must_use]
    pub fn is_logarithmic(&self) -> bool {
        self.range[0] > 0.0 && self.range[1] > FACTOR * self.range[0]
    }

    /// Where a value lies in the range: 0 at its lowest, 1 at its highest value.
    #[must_use]
    pub fn position(&self, value: f64) -> f64 {
        let [lo, hi] = self.range;
        if self.is_logarithmic() { libm::log(value / lo) / libm::log(hi / lo) } else { (value - lo) / (hi - lo) }
    }

    /// The value at a position as the file would state it; positions outside of the range are reflected at its ends.
    #[must_use]
    pub fn value(&self, position: f64) -> f64 {
        let [lo, hi] = self.range;
        let folded = (position - 2.0 * (0.5 * position).floor()).clamp(0.0, 2.0);
        let inside = if folded > 1.0 { 2.0 - folded } else { folded };
        let value =
            if self.is_logarithmic() { lo * libm::exp(inside * libm::log(hi / lo)) } else { lo + inside * (hi - lo) };
        self.stated(value).clamp(lo, hi)
    }

    /// A value to the digits that the file states.
    #[must_use]
    pub fn stated(&self, value: f64) -> f64 {
        let value = if self.whole { value.round() } else { value };
        self.unit.parse(&self.written(value)).unwrap_or(value)
    }

    /// A step of the search: this share of the range, but at least one for integers, and at most the value in the file,
    /// where a range reaches far above it. A negative share gives a step downwards.
    #[must_use]
    pub fn step(&self, share: f64) -> f64 {
        let width = self.range[1] - self.range[0];
        let far = if self.is_logarithmic() || self.start == 0.0 { 1.0 } else { self.start.abs() / (FIRST * width) };
        let step = share * far.min(1.0);
        if self.whole { step.abs().max(1.0 / width).copysign(share) } else { step }
    }

    /// A value in the notation of the file: with the unit that is there now, to six digits.
    #[must_use]
    pub fn written(&self, value: f64) -> String {
        match self.suffix {
            Some((suffix, factor)) => format!("{} {suffix}", plain(value / factor)),
            None => plain(value),
        }
    }

    /// The change of the graph to a value.
    #[must_use]
    pub fn setting(&self, value: f64) -> Setting {
        Setting { place: self.place.clone(), value: self.written(value) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: &str = "(nodes: {
        \"a\": Perlin(amplitude: \"0.5 km\", wavelength: 800, octaves: 6),
        \"b\": StreamPower(version: 5, height: \"a\", uplift: \"2 mm/yr\", /* of age */ duration: \"2 Myr\"),
    }, outputs: { \"height\": \"b\" }, parameters: { \"age\": \"b.duration\" })";

    fn parameter(vary: &str) -> Result<Parameter, Failure> {
        let document = Document::parse(SOURCE, &orograph_nodes::registry());
        assert_eq!(document.problems(), []);
        Parameter::of(&document, &vary.parse().expect("a parameter"))
    }

    #[test]
    fn values_keep_the_unit_of_the_file() {
        for (vary, start, written) in [
            ("a.amplitude", 500.0, "0.5 km"),
            ("a.wavelength", 800.0, "800"),
            ("b.uplift", 0.002, "2 mm/yr"),
            ("age", 2e6, "2 Myr"),
        ] {
            let parameter = parameter(vary).expect(vary);
            assert_eq!((parameter.start, parameter.written(parameter.start).as_str()), (start, written), "{vary}");
        }
        let age = parameter("age").expect("a time");
        assert_eq!(age.written(1_234_567.89), "1.23457 Myr");
        assert_eq!(age.stated(1_234_567.89), 1_234_570.0);
        assert_eq!(parameter("a.octaves=3..9").expect("an integer").stated(4.6), 5.0);
    }

    #[test]
    fn positions_fill_the_range_and_are_reflected_at_its_ends() {
        for (vary, middle) in [("a.amplitude=\"100..900 m\"", 500.0), ("a.amplitude=10 m..1 km", 100.0)] {
            let parameter = parameter(vary).expect(vary);
            for (position, reflected) in [(0.3, 0.3), (-0.3, 0.3), (1.2, 0.8), (2.3, 0.3), (-1.2, 0.8)] {
                let value = parameter.value(position);
                assert!((parameter.position(value) - reflected).abs() < 1e-4, "{position}: {value}");
            }
            assert_eq!([0.0, 0.5, 1.0].map(|at| parameter.value(at)), [parameter.range[0], middle, parameter.range[1]]);
        }
    }

    #[test]
    fn ranges_share_a_unit_and_must_fit() {
        assert_eq!(parameter("age=1..3 Myr").expect("a range").range, [1e6, 3e6]);
        assert_eq!(parameter("age=500 kyr..3 Myr").expect("a range").range, [5e5, 3e6]);
        assert_eq!(parameter("b.uplift=1e-4..1e-2").expect("a range").range, [1e-4, 1e-2]);
        assert_eq!(parameter("age=3..9 Myr").expect("a range").start, 3e6, "the nearest end");
        for (vary, hint) in [
            ("age=3..1 Myr", "write `=1 Myr..3 Myr`"),
            ("a.octaves=0..5", "`=1..5`"),
            ("a.octave", "did you mean `octaves`?"),
            ("agee", "did you mean `age`?"),
            ("b.strata", "the numbers of `b` are"),
            ("age=1..3 km", "write `=LO..HI`"),
        ] {
            let failure = parameter(vary).expect_err(vary);
            assert!(failure.hint.as_ref().is_some_and(|text| text.contains(hint)), "{vary}: {failure:?}");
        }
        for text in ["", ".x", "a.", "a.b=3", "=1..2"] {
            assert!(text.parse::<Vary>().is_err(), "{text}");
        }
    }
}
