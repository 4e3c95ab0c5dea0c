//! Arithmetic in number fields: `2 km / 3`, `(1 km - 200) * 2`.

use orograph_graph::Unit;

/// Longest text that is calculated, so that no number of brackets exhausts the stack.
const LONGEST: usize = 500;

/// The result of a calculation, as text with its unit. A text that is no calculation, or that cannot be calculated, is
/// returned as it is; the value that it is for refuses it with the reason.
pub(super) fn calculated(unit: Unit, text: &str) -> String {
    let is_value = text.len() > LONGEST || text.trim().is_empty() || unit.parse(text).is_ok();
    let result = || {
        let mut rest = Rest { text, unit };
        let result = rest.sum()?;
        rest.text.trim().is_empty().then_some(result.number).filter(|number| number.is_finite())
    };
    if is_value { text.to_owned() } else { result().map_or_else(|| text.to_owned(), |value| written(unit, value)) }
}

/// A number that you can also type with its unit, or as a calculation.
pub(super) fn typed(value: egui::DragValue<'_>, unit: Unit) -> egui::DragValue<'_> {
    value.custom_parser(move |text| unit.parse(&calculated(unit, text)).ok())
}

/// A number in the base unit as text: at a readable scale if that is exact, otherwise with twelve digits.
fn written(unit: Unit, value: f64) -> String {
    let readable = unit.display(value);
    let exact: f64 = format!("{value:.11e}").parse().unwrap_or(value);
    let same = unit.parse(&readable).is_ok_and(|parsed| (parsed - exact).abs() <= exact.abs() * 1e-11);
    // integers have no power of ten
    if same && !unit.symbol().is_empty() {
        readable
    } else {
        format!("{exact} {}", unit.symbol()).trim_end().to_owned()
    }
}

/// A part of a calculation.
#[derive(Clone, Copy)]
struct Part {
    /// In the base unit.
    number: f64,
    /// True if it has a unit. A number without one is a factor, or a value in the base unit.
    quantity: bool,
}

/// The text that is not read yet.
struct Rest<'a> {
    text: &'a str,
    unit: Unit,
}

impl Rest<'_> {
    /// Takes one of these characters, if it is next.
    fn take(&mut self, signs: &[char]) -> Option<char> {
        let text = self.text.trim_start();
        let sign = text.chars().next().filter(|next| signs.contains(next))?;
        self.text = &text[sign.len_utf8()..];
        Some(sign)
    }

    fn sum(&mut self) -> Option<Part> {
        let mut sum = self.product()?;
        while let Some(sign) = self.take(&['+', '-', '−']) {
            let next = self.product()?;
            let number = if sign == '+' { sum.number + next.number } else { sum.number - next.number };
            sum = Part { number, quantity: sum.quantity || next.quantity };
        }
        Some(sum)
    }

    fn product(&mut self) -> Option<Part> {
        let mut product = self.factor()?;
        while let Some(sign) = self.take(&['*', '×', '/', '÷']) {
            let next = self.factor()?;
            product = match (sign, product.quantity, next.quantity) {
                ('*' | '×', true, true) | ('/' | '÷', false, true) => return None,
                ('*' | '×', a, b) => Part { number: product.number * next.number, quantity: a || b },
                (_, a, b) => Part { number: product.number / next.number, quantity: a && !b },
            };
        }
        Some(product)
    }

    fn factor(&mut self) -> Option<Part> {
        if self.take(&['-', '−']).is_some() {
            let part = self.factor()?;
            return Some(Part { number: -part.number, ..part });
        }
        if self.take(&['(']).is_some() {
            let part = self.sum()?;
            return self.take(&[')']).map(|_| part);
        }
        self.number()
    }

    /// A number, with its unit if there is one.
    fn number(&mut self) -> Option<Part> {
        let text = self.text.trim_start();
        if !text.starts_with(|c: char| c.is_ascii_digit() || c == '.') {
            return None;
        }
        // The longest prefix that is a number: an `e` may belong to the exponent or to a unit.
        let ends = text.char_indices().map(|(at, c)| at + c.len_utf8());
        let read = |end: usize| text[..end].parse::<f64>().ok().map(|number| (number, &text[end..]));
        let (number, after) = ends.rev().find_map(read)?;
        let suffixes = self.unit.suffixes().iter().filter(|(name, _)| !name.is_empty());
        let suffix = suffixes.filter(|(name, _)| after.trim_start().starts_with(name));
        let Some((name, factor)) = suffix.max_by_key(|(name, _)| name.len()) else {
            self.text = after;
            return Some(Part { number, quantity: false });
        };
        self.text = &after.trim_start()[name.len()..];
        Some(Part { number: number * factor, quantity: true })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_are_calculated_with_their_units() {
        for (unit, text, result) in [
            (Unit::Metres, "2 km / 3", "666.666666667 m"),
            (Unit::Metres, "1 km / 2", "500 m"),
            (Unit::Metres, "(1 km - 200) * 2 + 50 m", "1.65 km"),
            (Unit::Metres, "3*2km", "6 km"),
            (Unit::Metres, "-2 km + 500", "-1.5 km"),
            (Unit::Metres, "24 km / 6 km * 100", "400 m"),
            (Unit::MetresPerYear, "1 mm/yr / 2", "0.5 mm/yr"),
            (Unit::Years, "3 Myr - 500 kyr", "2.5 Myr"),
            (Unit::One, "1/4 + 2e-1", "0.45"),
            (Unit::One, "512 × 3", "1536"),
            (Unit::Count, "1000 * 1000", "1000000"),
        ] {
            assert_eq!(calculated(unit, text), result, "{text}");
        }
        // values, and texts that the value refuses with the reason
        for text in ["2 km", "-5", "", "2 km * 3 km", "3 / 2 km", "2 km /", "(1 km", "1 km 5", "1 / 0", "1 mile + 2 m"]
        {
            assert_eq!(calculated(Unit::Metres, text), text);
        }
        let brackets = "(".repeat(1_000_000);
        assert_eq!(calculated(Unit::Metres, &brackets), brackets);
    }
}
