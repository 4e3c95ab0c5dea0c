//! Numbers: a slider over the usual range, and a field for any value with its unit.

use egui::{Slider, Ui};
use orograph_graph::{ParamValue, Unit};

use super::{
    form::{FRAME, FormState, TextField, wide},
    value::{Place, ValueChange},
};

/// The scale of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    /// The range of the slider.
    pub(super) soft: [f64; 2],
    /// The default value.
    pub(super) default: f64,
    /// True for an integer.
    pub(super) whole: bool,
}

/// The smallest length of a slider, in points.
const LEAST: f32 = 24.0;

/// A range whose ends differ by at least this factor has a logarithmic slider.
const DECADES: f64 = 100.0;

impl Scale {
    /// The smallest value above zero of a logarithmic slider. Returns None for a linear one.
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

/// A value with as few digits as dragging over a range can distinguish.
pub(in crate::editor) fn short(value: f64, range: f64) -> f64 {
    // One part in five hundred, rounded down to a power of ten. It is an integer above one and the inverse of an
    // integer below, so that the result is the number nearest to its few digits.
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

/// The allowed input for a unit.
pub(super) fn hint(unit: Unit) -> String {
    let mut units: Vec<&str> = unit.suffixes().iter().map(|(name, _)| *name).filter(|name| !name.is_empty()).collect();
    units.dedup();
    if units.is_empty() { "A number".to_owned() } else { format!("A number; optional units: {}", units.join(", ")) }
}

/// A slider and a field; returns the change that was made.
pub(super) fn show(
    ui: &mut Ui,
    form: &mut FormState,
    place: Place<'_>,
    unit: Unit,
    scale: Scale,
    now: f64,
) -> Option<ValueChange> {
    let value = |number: f64| match scale.whole {
        true => ParamValue::Int(number.round() as i64),
        false => ParamValue::Float(number),
    };
    let room = ui.available_width();
    let gap = ui.spacing().item_spacing.x;
    let text = if scale.whole { format!("{now}") } else { unit.display(now) };
    // The number is never truncated, whatever width remains for the slider.
    let number = wide(ui, text.split(' ').next().unwrap_or(&text)) + FRAME + 2.0;
    let width = if room < 130.0 { room } else { (room * 0.42).clamp(76.0, 120.0).max(number).min(room) };
    let mut asked = None;
    if room - width - gap >= LEAST {
        asked = slider(ui, place, scale, now, room - width - gap).map(|number| ValueChange::Drag(value(number)));
    }
    let hover = hint(unit);
    let entry =
        TextField { salt: "number", text: &text, hint: "", hover: &hover, width, label: Some(place.label), name: "" };
    form.quantity(ui, place.line, unit, entry).map(ValueChange::Text).or(asked)
}

/// The slider; returns the new number.
fn slider(ui: &mut Ui, place: Place<'_>, scale: Scale, now: f64, width: f32) -> Option<f64> {
    // The range includes the current value, but must not change during a drag.
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
    fn wide_ranges_have_logarithmic_sliders() {
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
