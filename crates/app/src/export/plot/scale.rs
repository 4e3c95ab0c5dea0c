//! An axis of a plot: linear or logarithmic, with ticks at round numbers.

use std::ops::Range;

use orograph_graph::plain;
use orograph_nodes::numerics::math;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

/// An axis from the lowest to the highest number.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scale {
    pub(super) log: bool,
    range: [f64; 2],
}

impl Scale {
    /// The axis that shows these numbers, with a margin. Numbers that it cannot show are left out. Returns None when
    /// there are none.
    pub(super) fn around(numbers: impl Iterator<Item = f64>, log: bool) -> Option<Self> {
        let shown = numbers.filter(|value| value.is_finite() && (!log || *value > 0.0));
        let [low, high] =
            shown.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)]);
        if low > high {
            return None;
        }
        let of = |value: f64| if log { math::log10(value) } else { value };
        let (start, end) = (of(low), of(high));
        let span = match end - start {
            span if span > 0.0 => span,
            _ if log || start == 0.0 => 1.0,
            _ => 0.1 * start.abs(),
        };
        let margin = 0.04 * span;
        // Fractions and histograms stand on zero.
        let first = if !log && (0.0..=margin).contains(&low) { 0.0 } else { start - margin };
        Some(Self { log, range: [first, end + margin] })
    }

    /// Where a number is on the axis: 0 at its start, 1 at its end.
    pub(super) fn place(&self, value: f64) -> f64 {
        let value = if self.log { math::log10(value) } else { value };
        (value - self.range[0]) / (self.range[1] - self.range[0])
    }

    /// The numbers at which there are ticks with labels, at most `most`.
    pub(super) fn ticks(&self, most: usize) -> Vec<f64> {
        let [start, end] = self.range;
        let wide = (end - start) / most.max(2) as f64;
        let round = |step: f64| {
            let power = math::pow(10.0, math::log10(step).floor());
            [1.0, 2.0, 5.0, 10.0]
                .into_iter()
                .map(|factor| factor * power)
                .find(|round| *round >= step * (1.0 - 1e-9))
                .unwrap_or(step)
        };
        let step = if self.log { round(wide).max(1.0).round() } else { round(wide) };
        let (first, last) = ((start / step - 1e-9).ceil() as i64, (end / step + 1e-9).floor() as i64);
        let decades = (first..=last).map(|at| at as f64 * step);
        if !self.log {
            return decades.collect();
        }
        let decades: Vec<f64> = decades.map(|power| math::pow(10.0, power)).collect();
        if decades.len() >= 2 {
            return decades;
        }
        // Less than two decades: round numbers between them.
        let powers = start.floor() as i32..=end.ceil() as i32;
        let between = powers.flat_map(|power| [1.0, 2.0, 5.0].map(|factor| factor * math::pow(10.0, f64::from(power))));
        between.filter(|value| (start..=end).contains(&math::log10(*value))).collect()
    }

    /// The lines between the ticks of a logarithmic axis.
    fn minor(&self) -> Vec<f64> {
        let [start, end] = self.range;
        if !self.log || end - start > 8.0 {
            return Vec::new();
        }
        let powers = start.floor() as i32..=end.ceil() as i32;
        let between =
            powers.flat_map(|power| (2..10).map(move |factor| f64::from(factor) * math::pow(10.0, f64::from(power))));
        between.filter(|value| (start..=end).contains(&math::log10(*value))).collect()
    }
}

impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (start, end): (i32, i32)) -> i32 {
        start + (self.place(*value) * f64::from(end - start)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        // The light lines of the grid are drawn on their own.
        if hint.weight().allow_light_points() { self.minor() } else { self.ticks(hint.max_num_points()) }
    }

    fn range(&self) -> Range<f64> {
        let [start, end] = self.range.map(|value| if self.log { math::pow(10.0, value) } else { value });
        start..end
    }
}

impl ValueFormatter<f64> for Scale {
    fn format_ext(&self, value: &f64) -> String {
        tick(*value, self.log)
    }
}

/// Round numbers in a range, for at most `most` ticks and one more.
#[must_use]
pub fn round_values(range: [f64; 2], most: usize) -> Vec<f64> {
    Scale { log: false, range }.ticks(most)
}

/// The text of a number at a tick. On a logarithmic axis large and small ones are written with a power of ten.
#[must_use]
pub fn tick(value: f64, log: bool) -> String {
    let power = (math::log10(value) + 1e-9).floor();
    if log && value > 0.0 && power.abs() > 3.0 {
        let exponent = superscript(power as i32);
        let factor = value / math::pow(10.0, power);
        let is_power = (factor - 1.0).abs() < 1e-6;
        return if is_power { format!("10{exponent}") } else { format!("{} × 10{exponent}", plain(factor)) };
    }
    // Sums of steps are not exact.
    plain(if value.abs() < 1e-12 { 0.0 } else { value }).replace('-', "−")
}

/// A whole number as an exponent.
fn superscript(power: i32) -> String {
    let digit = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        other => other.to_digit(10).and_then(|digit| char::from_u32(0x2070 + digit)).unwrap_or(other),
    };
    power.to_string().chars().map(digit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn around(numbers: &[f64], log: bool) -> Scale {
        Scale::around(numbers.iter().copied(), log).expect("there are numbers")
    }

    #[test]
    fn ticks_are_round_and_within_the_axis() {
        assert_eq!(around(&[0.0, 1.0], false).ticks(6), [0.0, 0.2, 0.4, 0.6000000000000001, 0.8, 1.0]);
        assert_eq!(around(&[-3.0, 97.0], false).ticks(6), [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]);
        assert_eq!(around(&[12.0, 4e6], true).ticks(8), [10.0, 100.0, 1000.0, 1e4, 1e5, 1e6]);
        assert_eq!(around(&[15.0, 60.0], true).ticks(8), [20.0, 50.0]);
        assert!(around(&[5.0], false).ticks(5).len() >= 2 && !around(&[5.0], true).ticks(5).is_empty());
        assert_eq!(Scale::around([f64::NAN, -1.0].into_iter(), true), None);
        for (value, text) in [(0.6000000000000001, "0.6"), (-20.0, "−20"), (1e-13, "0"), (1e6, "1000000")] {
            assert_eq!(tick(value, false), text);
        }
        assert_eq!(["10⁴", "10⁻⁵", "100"], [1e4, 1e-5, 100.0].map(|value| tick(value, true)));
        assert_eq!(["5 × 10⁶", "2 × 10⁻⁴", "2000"], [5e6, 2e-4, 2e3].map(|value| tick(value, true)));
    }

    #[test]
    fn numbers_are_placed_along_the_axis() {
        let log = around(&[1.0, 10_000.0], true);
        assert!((log.place(100.0) - 0.5).abs() < 1e-9 && log.map(&100.0, (1000, 0)) == 500);
        assert_eq!(around(&[0.0, 100.0], false).place(0.0), 0.0);
    }
}
