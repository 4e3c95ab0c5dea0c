//! Numbers: a slider over the usual range, and a field for any value with its unit.

use egui::{Slider, Ui};
use orograph_graph::{ParamValue, Unit};

use super::{
    form::{Entry, FRAME, Form, wide},
    value::{Asked, Place},
};

/// How a number runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    /// What the slider covers.
    pub(super) soft: [f64; 2],
    /// Value when the file says nothing.
    pub(super) default: f64,
    /// Whether it is a whole number.
    pub(super) whole: bool,
}

/// The least length of a slider, in points.
const LEAST: f32 = 24.0;

/// A range of at least so many times its lower end is dragged by ratios.
const DECADES: f64 = 100.0;

impl Scale {
    /// The smallest value above zero of a slider that goes by ratios; `None` for one that goes by steps.
    fn by_ratios(self) -> Option<f64> {
        let [low, high] = self.soft;
        if low > 0.0 {
            (high / low >= DECADES).then_some(low)
        } else {
            let usual = self.default;
            (low == 0.0 && usual > 0.0 && high / usual >= DECADES && !self.whole).then_some(usual / DECADES)
        }
    }
}

/// A value with as few digits as dragging over a range can tell apart.
pub(super) fn short(value: f64, range: f64) -> f64 {
    // One part in five hundred, cut to a power of ten. Above one it is a whole number, below it one over a whole number, so
    // that the result is the number nearest to its few digits.
    let least = range / 500.0;
    if least >= 1.0 {
        let mut step = 1.0;
        while step * 10.0 <= least {
            step *= 10.0;
        }
        (value / step).round() * step
    } else {
        let mut parts = 1.0;
        while 1.0 / parts > least && parts < 1e15 {
            parts *= 10.0;
        }
        (value * parts).round() / parts
    }
}

/// What may be typed for a unit.
pub(super) fn hint(unit: Unit) -> String {
    let mut units: Vec<&str> = unit.suffixes().iter().map(|(name, _)| *name).filter(|name| !name.is_empty()).collect();
    units.dedup();
    if units.is_empty() { "A number".to_owned() } else { format!("A number, with or without {}", units.join(", ")) }
}

/// A slider and a field; gives what is done to them.
pub(super) fn show(
    ui: &mut Ui,
    form: &mut Form,
    place: Place<'_>,
    unit: Unit,
    scale: Scale,
    now: f64,
) -> Option<Asked> {
    let value = |number: f64| match scale.whole {
        true => ParamValue::Int(number.round() as i64),
        false => ParamValue::Float(number),
    };
    let room = ui.available_width();
    let gap = ui.spacing().item_spacing.x;
    let text = if scale.whole { format!("{now}") } else { unit.display(now) };
    // The number is whole, whatever becomes of the slider.
    let number = wide(ui, text.split(' ').next().unwrap_or(&text)) + FRAME + 2.0;
    let width = if room < 130.0 { room } else { (room * 0.42).clamp(76.0, 120.0).max(number).min(room) };
    let mut asked = None;
    if room - width - gap >= LEAST {
        asked = slider(ui, place, scale, now, room - width - gap).map(|number| Asked::Drag(value(number)));
    }
    let hover = hint(unit);
    let entry = Entry { salt: "number", text: &text, hint: "", hover: &hover, width, label: Some(place.label) };
    form.quantity(ui, place.line, entry).map(Asked::Text).or(asked)
}

/// The slider; gives the number it was moved to.
fn slider(ui: &mut Ui, place: Place<'_>, scale: Scale, now: f64, width: f32) -> Option<f64> {
    // The range holds the present value, but must not change below the pointer.
    let held = place.line.with("range");
    let [low, high] = ui.data(|data| data.get_temp(held)).unwrap_or([scale.soft[0].min(now), scale.soft[1].max(now)]);
    let mut number = now;
    let mut slider = Slider::new(&mut number, low..=high).show_value(false);
    if let Some(smallest) = scale.by_ratios() {
        slider = slider.logarithmic(true).smallest_positive(smallest);
    }
    if scale.whole {
        slider = slider.integer();
    }
    let response = ui
        .scope(|ui| {
            ui.spacing_mut().slider_width = width;
            ui.add(slider)
        })
        .inner
        .labelled_by(place.label);
    if response.dragged() {
        ui.data_mut(|data| data.insert_temp(held, [low, high]));
    } else {
        ui.data_mut(|data| data.remove::<[f64; 2]>(held));
    }
    (response.changed() && number != now).then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_ranges_are_dragged_by_ratios() {
        let scale = |soft, default| Scale { soft, default, whole: false };
        assert_eq!(scale([1.0, 1e6], 8000.0).by_ratios(), Some(1.0));
        assert_eq!(scale([20.0, 45.0], 35.0).by_ratios(), None);
        assert_eq!(scale([0.0, 1e-4], 1e-6).by_ratios(), Some(1e-8));
        assert_eq!(scale([0.0, 1.0], 1.0).by_ratios(), None);
        assert_eq!(scale([-1e3, 1e6], 1.0).by_ratios(), None);
        assert_eq!(
            (short(0.123_456, 1.0), short(1234.4, 3000.0), short(77_777.0, 60_000.0)),
            (0.123, 1234.0, 77_800.0)
        );
        assert!(hint(Unit::Metres).contains("km") && hint(Unit::One).contains('%'));
    }
}
