//! Several selected nodes: their names, and the parameters and number inputs that all of them have, edited at once.

use egui::{RichText, Ui};
use orograph_graph::{Fallback, Kind, ParamSpec, ParamValue};

use super::{
    form::{self, FormState, section},
    row::{Subject, row},
    target::Target,
};
use crate::editor::Session;

/// A value that all selected nodes have.
struct Common {
    spec: ParamSpec,
    /// The values of the nodes, in the order of the selection.
    values: Vec<ParamValue>,
    places: Vec<Target>,
}

/// Shows the selected nodes.
pub(super) fn show(ui: &mut Ui, form: &mut FormState, session: &mut Session) {
    let names: Vec<String> = session.selection().map(str::to_owned).collect();
    form::title(ui, &format!("{} nodes", names.len()));
    for name in &names {
        if ui.link(name).clicked() {
            session.select_only(name);
        }
    }
    let common = common(session, &names);
    if common.is_empty() {
        return;
    }
    section(ui, "In all of them");
    for Common { spec, values, places } in common {
        let target = Target::Several { name: spec.name.to_owned(), places };
        let changed = values.iter().any(|value| *value != spec.kind.default_value());
        row(ui, form, session, Subject { target: &target, spec: &spec, value: &values[0], changed });
        if values.iter().any(|value| *value != values[0]) {
            ui.label(RichText::new("different values; a change sets all of them").small().weak());
        }
    }
}

/// The values that all nodes have: the same name, kind and unit.
fn common(session: &Session, names: &[String]) -> Vec<Common> {
    let of_nodes: Vec<Vec<(ParamSpec, ParamValue, Target)>> = names.iter().map(|name| values(session, name)).collect();
    let Some((first, others)) = of_nodes.split_first() else { return Vec::new() };
    let is_same = |a: &ParamSpec, b: &ParamSpec| {
        let plain = |spec: &ParamSpec| spec.kind.clone().with_default(&first_default(spec));
        a.name == b.name && a.unit == b.unit && plain(a) == plain(b)
    };
    let find = |values: &[(ParamSpec, ParamValue, Target)], spec: &ParamSpec| {
        values.iter().find(|(other, ..)| is_same(spec, other)).map(|(_, value, target)| (value.clone(), target.clone()))
    };
    let all = first.iter().filter(|(spec, ..)| !matches!(spec.kind, Kind::Strokes { .. }));
    all.filter_map(|(spec, value, target)| {
        let rest: Vec<_> = others.iter().map(|values| find(values, spec)).collect::<Option<_>>()?;
        let (mut values, mut places) = (vec![value.clone()], vec![target.clone()]);
        for (value, place) in rest {
            values.push(value);
            places.push(place);
        }
        // what the settings of one node disable can still matter for another
        Some(Common { spec: ParamSpec { when: &[], ..spec.clone() }, values, places })
    })
    .collect()
}

/// A default that does not depend on the node, so that kinds can be compared without their defaults.
fn first_default(spec: &ParamSpec) -> ParamValue {
    match &spec.kind {
        Kind::Float { hard, .. } => ParamValue::Float(hard[0]),
        Kind::Int { hard, .. } => ParamValue::Int(hard[0]),
        Kind::Bool { .. } => ParamValue::Bool(false),
        Kind::Seed { .. } => ParamValue::Seed(0),
        Kind::Choice { options, .. } => ParamValue::Choice(options[0].0),
        kind => kind.default_value(),
    }
}

/// The parameters of a node, and its inputs that have a number.
fn values(session: &Session, name: &str) -> Vec<(ParamSpec, ParamValue, Target)> {
    let graph = session.document().graph();
    let Ok(index) = graph.find(name) else { return Vec::new() };
    let instance = graph.instance(index);
    let target = |param: &str| (name.to_owned(), param.to_owned());
    let inputs = instance.node.inputs.iter().enumerate().filter_map(|(position, input)| {
        let Fallback::Constant { default, hard, soft } = input.fallback else { return None };
        if graph.source(index, position).is_some() {
            return None;
        }
        let kind = Kind::Float { default, hard, soft };
        let spec = ParamSpec { name: input.name, doc: input.doc, unit: input.ty.unit(), kind, when: &[] };
        let value = ParamValue::Float(instance.constants[position].unwrap_or(default));
        let (node, name) = target(input.name);
        Some((spec, value, Target::Input { node, name }))
    });
    let params = instance.node.specs().into_iter().map(|spec| {
        let value = instance.params.get(spec.name).cloned().unwrap_or_else(|| spec.kind.default_value());
        let (node, name) = target(spec.name);
        (spec, value, Target::Param { node, name })
    });
    inputs.chain(params).collect()
}
