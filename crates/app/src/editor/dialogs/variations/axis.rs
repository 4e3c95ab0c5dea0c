//! A side of a grid of two parameters: the parameter, and the range of its values.

use egui::{ComboBox, Label, RichText, TextEdit, Ui};
use orograph_graph::{Edit, Fallback, Graph, Kind, NodeIndex, ParamValue, Port, Unit};

use crate::editor::{Session, arithmetic::calculated, inspector::short, window::names::Named as _};

/// A number of a node: a parameter, or an input without a wire.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Subject {
    node: String,
    name: &'static str,
    unit: Unit,
    /// The range that a file may use, and that of the slider.
    hard: [f64; 2],
    soft: [f64; 2],
    now: f64,
    kind: Number,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Number {
    Real,
    Whole,
    Input,
}

impl Subject {
    /// The numbers that the output depends on; those of selected nodes first, then the nearest upstream.
    pub(super) fn all(session: &Session, port: Port) -> Vec<Self> {
        let (document, graph) = (session.document(), session.document().graph());
        let upstream = graph.upstream([port.node]);
        let mut nodes: Vec<NodeIndex> = graph.topological().into_iter().rev().collect();
        nodes.retain(|node| upstream.contains(node) && !document.is_muted(*node));
        nodes.sort_by_key(|node| !session.is_selected(&graph.instance(*node).name));
        nodes.into_iter().flat_map(|node| Self::of_node(graph, node)).collect()
    }

    fn of_node(graph: &Graph, node: NodeIndex) -> Vec<Self> {
        let instance = graph.instance(node);
        let is_wired = |input: &str| graph.is_wired(node, input);
        let params = instance.node.specs().into_iter().filter(|spec| spec.idle(&instance.params, is_wired).is_none());
        let params = params.filter_map(|spec| {
            let (hard, soft, now, kind) = match (&spec.kind, instance.params.get(spec.name)?) {
                (Kind::Float { hard, soft, .. }, ParamValue::Float(now)) => (*hard, *soft, *now, Number::Real),
                (Kind::Int { hard, soft, .. }, ParamValue::Int(now)) => {
                    let real = |range: &[i64; 2]| range.map(|value| value as f64);
                    (real(hard), real(soft), *now as f64, Number::Whole)
                }
                _ => return None,
            };
            Some(Self { node: instance.name.clone(), name: spec.name, unit: spec.unit, hard, soft, now, kind })
        });
        let inputs = instance.node.inputs.iter().enumerate().filter_map(|(position, input)| {
            let Fallback::Constant { default, hard, soft } = input.fallback else { return None };
            let now = instance.constants.get(position).copied().flatten().unwrap_or(default);
            let (node_name, unit) = (instance.name.clone(), input.ty.unit());
            let free = graph.source(node, position).is_none();
            free.then_some(Self { node: node_name, name: input.name, unit, hard, soft, now, kind: Number::Input })
        });
        params.chain(inputs).collect()
    }

    /// Its name: `node.parameter`.
    pub(super) fn label(&self) -> String {
        format!("{}.{}", self.node, self.name)
    }

    /// A value as text, with its unit.
    pub(super) fn text(&self, value: f64) -> String {
        if self.kind == Number::Whole { format!("{value}") } else { self.unit.display(value) }
    }

    /// The edit that sets it.
    pub(super) fn edit(&self, value: f64) -> Edit {
        let (node, name) = (self.node.clone(), self.name.to_owned());
        match self.kind {
            Number::Real => Edit::SetParam { node, param: name, value: ParamValue::Float(value) },
            Number::Whole => Edit::SetParam { node, param: name, value: ParamValue::Int(value as i64) },
            Number::Input => Edit::SetConstant { node, input: name, value },
        }
    }

    /// A range with the present value in its middle: half of it to one and a half, or less if a file may not use that;
    /// that of the slider if the value is zero or at an end of what a file may use.
    fn range(&self) -> [f64; 2] {
        let [low, high] = self.hard;
        let half = 0.5 * self.now.abs();
        let half = if self.kind == Number::Whole { half.ceil() } else { half };
        let half = half.min(self.now - low).min(high - self.now);
        if half > 0.0 { [self.now - half, self.now + half] } else { self.soft }
    }
}

/// A side of the grid.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    pub(super) subject: Subject,
    /// The typed ends of the range.
    ends: [String; 2],
}

impl Axis {
    pub(super) fn new(subject: Subject) -> Self {
        let ends = subject.range().map(|value| subject.text(value));
        Self { subject, ends }
    }

    /// The values of a number of steps, evenly spaced; integers at most once each.
    ///
    /// # Errors
    /// The reason, when an end cannot be read or is not allowed, or the range is empty.
    pub(super) fn values(&self, steps: usize) -> Result<Vec<f64>, String> {
        let Subject { unit, hard, kind, .. } = self.subject;
        let end = |text: &String| -> Result<f64, String> {
            let value = unit.parse(text).map_err(|error| format!("{}: {error}", self.subject.label()))?;
            match (hard[0]..=hard[1]).contains(&value) {
                true => Ok(value),
                false => Err(format!(
                    "{} can be {} to {}",
                    self.subject.label(),
                    self.subject.text(hard[0]),
                    self.subject.text(hard[1])
                )),
            }
        };
        let (from, to) = (end(&self.ends[0])?, end(&self.ends[1])?);
        if from >= to {
            return Err(format!("{}: \"from\" must be less than \"to\"", self.subject.label()));
        }
        let step = |at: usize| {
            let value = from + (to - from) * at as f64 / (steps.max(2) - 1) as f64;
            if kind == Number::Whole { value.round() } else { short(value, to - from).clamp(from, to) }
        };
        let mut values: Vec<f64> = (0..steps).map(step).collect();
        values.dedup();
        Ok(values)
    }

    /// The row with the parameter and its range. Returns true if one of them was changed.
    pub(super) fn ui(&mut self, ui: &mut Ui, what: &str, subjects: &[Subject], other: &Subject) -> bool {
        let mut changed = false;
        ui.horizontal_wrapped(|ui| {
            // The lists of both rows are aligned.
            let label = ui.scope(|ui| {
                ui.set_min_width(44.0);
                ui.label(what)
            });
            let label = label.inner;
            let combo = ComboBox::from_id_salt(what).selected_text(self.subject.label()).width(190.0);
            let response = combo.show_ui(ui, |ui| {
                for subject in subjects.iter().filter(|subject| *subject != other) {
                    if ui.selectable_label(*subject == self.subject, subject.label()).clicked() {
                        *self = Self::new(subject.clone());
                        changed = true;
                    }
                }
            });
            response.response.labelled_by(label.id);
            for (text, word) in self.ends.iter_mut().zip(["from", "to"]) {
                ui.label(word);
                let field = ui.add(TextEdit::singleline(text).desired_width(82.0)).named(format!("{what} {word}"));
                if field.lost_focus() {
                    *text = calculated(self.subject.unit, text);
                    changed = true;
                }
            }
            let now = RichText::new(format!("now {}", self.subject.text(self.subject.now))).weak();
            ui.add(Label::new(now).extend());
        });
        changed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn subject(now: f64, kind: Number) -> Subject {
        let (hard, soft) = ([0.0, 1e6], [100.0, 5000.0]);
        Subject { node: "a".to_owned(), name: "size", unit: Unit::Metres, hard, soft, now, kind }
    }

    #[test]
    fn the_present_value_is_in_the_middle() {
        let axis = Axis::new(subject(800.0, Number::Real));
        assert_eq!(axis.values(3), Ok(vec![400.0, 800.0, 1200.0]));
        assert_eq!(axis.values(5), Ok(vec![400.0, 600.0, 800.0, 1000.0, 1200.0]));
        let at_zero = Axis::new(subject(0.0, Number::Real));
        assert_eq!(at_zero.values(3), Ok(vec![100.0, 2550.0, 5000.0]));
        let whole = Axis::new(Subject { unit: Unit::Count, ..subject(3.0, Number::Whole) });
        assert_eq!(whole.values(5), Ok(vec![1.0, 2.0, 3.0, 4.0, 5.0]));
        let low = Axis::new(Subject { hard: [-900.0, 1e6], ..subject(-800.0, Number::Real) });
        assert_eq!(low.values(3), Ok(vec![-900.0, -800.0, -700.0]));
        let few = Axis { ends: ["2".to_owned(), "4".to_owned()], ..whole };
        assert_eq!(few.values(5), Ok(vec![2.0, 3.0, 4.0]));
    }

    #[test]
    fn wrong_ranges_are_refused_with_the_reason() {
        let with = |from: &str, to: &str| {
            let ends = [from.to_owned(), to.to_owned()];
            Axis { subject: subject(800.0, Number::Real), ends }.values(3)
        };
        assert_eq!(with("1 km", "2 km"), Ok(vec![1000.0, 1500.0, 2000.0]));
        assert_eq!(with("2 km", "1 km"), Err("a.size: \"from\" must be less than \"to\"".to_owned()));
        assert_eq!(with("-1", "5"), Err("a.size can be 0 m to 1000 km".to_owned()));
        assert!(with("1 yr", "5").is_err_and(|reason| reason.contains("a.size: ")));
    }
}
