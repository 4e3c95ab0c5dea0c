//! What `--vary` names: numbers of nodes and of the file, as declared and as written, and inputs that become fields.

use std::str::FromStr;

use orograph_graph::{Document, Fallback, Instance, Kind, NodeIndex, ParamValue, Unit, closest, range_text};

use crate::report::failure::Failure;

/// `NODE.PARAM` or the name of a parameter of the file, or `NODE.INPUT@WAVELENGTH` for a field, with an optional range
/// `=LO..HI`.
#[derive(Clone, Debug, PartialEq)]
pub struct Vary {
    pub(super) place: String,
    pub(super) range: Option<String>,
    /// The shortest wavelength of a field in metres; None for a number.
    pub(super) wavelength_m: Option<f64>,
}

impl FromStr for Vary {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (place, range) = match text.split_once('=') {
            Some((place, range)) => (place, Some(range.trim().to_owned())),
            None => (text, None),
        };
        let (place, wavelength) = match place.split_once('@') {
            Some((place, wavelength)) => (place, Some(wavelength.trim().trim_matches('"'))),
            None => (place, None),
        };
        let length = |text: &str| Unit::Metres.parse(text).ok().filter(|length| *length > 0.0 && length.is_finite());
        let wavelength_m = wavelength.map(|text| {
            length(text).ok_or_else(|| format!("`{text}` is not a wavelength; write `node.input@\"5 km\"`"))
        });
        let wavelength_m = wavelength_m.transpose()?;
        let parts: Vec<&str> = place.splitn(2, '.').map(str::trim).collect();
        if parts.iter().any(|part| part.is_empty()) {
            return Err("no parameter is named; write `node.param` or `node.param=LO..HI`".to_owned());
        }
        if range.as_ref().is_some_and(|range| !range.contains("..")) {
            return Err("there is no `..` in the range; write `node.param=LO..HI`, such as `=500 m..2 km`".to_owned());
        }
        Ok(Self { place: parts.join("."), range, wavelength_m })
    }
}

impl Vary {
    /// The name of the parameter.
    #[must_use]
    pub fn place(&self) -> &str {
        &self.place
    }

    /// Returns true if it is a field and not a number.
    #[must_use]
    pub const fn is_field(&self) -> bool {
        self.wavelength_m.is_some()
    }
}

/// A number as declared.
#[derive(Clone, Copy, Debug)]
pub(super) struct Declared {
    pub(super) unit: Unit,
    /// The value in the file.
    pub(super) value: f64,
    /// The range that a file may use.
    pub(super) hard: [f64; 2],
    /// The range of the slider.
    pub(super) soft: [f64; 2],
    /// True for integers.
    pub(super) whole: bool,
}

/// The node and the parameter that a name refers to; of a parameter of the file, the first place.
pub(super) fn find(
    document: &Document,
    place: &str,
    wrong: &dyn Fn(&str) -> Failure,
) -> Result<(String, String, Declared), Failure> {
    match place.split_once('.') {
        Some((node, name)) => Ok((node.to_owned(), name.to_owned(), of_node(document, node, name, wrong)?)),
        None => of_file(document, place, wrong),
    }
}

/// A similar name, as a remedy.
fn near(word: &str, known: &[&str]) -> Option<String> {
    closest(word, known.iter().copied()).map(|near| format!("did you mean `{near}`?"))
}

/// A node by its name.
pub(super) fn node(document: &Document, name: &str, wrong: &dyn Fn(&str) -> Failure) -> Result<NodeIndex, Failure> {
    let names: Vec<&str> = document.nodes().iter().map(|entry| entry.name.as_str()).collect();
    let Some(entry) = document.node(name) else {
        let hint = near(name, &names).unwrap_or_else(|| format!("the nodes are {}", names.join(", ")));
        return Err(wrong(&format!("there is no node `{name}`")).hint(hint));
    };
    entry.index.ok_or_else(|| {
        wrong(&format!("`{name}` is a node of an unknown kind")).hint("`orograph nodes` lists the kinds")
    })
}

/// A parameter or an input of a node.
fn of_node(document: &Document, node: &str, name: &str, wrong: &dyn Fn(&str) -> Failure) -> Result<Declared, Failure> {
    let index = self::node(document, node, wrong)?;
    let instance = document.graph().instance(index);
    let specs = instance.node.specs();
    if let Some(spec) = specs.iter().find(|spec| spec.name == name) {
        let value = instance.params.get(name);
        return declared(&spec.kind, value, spec.unit).ok_or_else(|| {
            wrong(&format!("it is not a number, but {}", spec.kind.describe(spec.unit))).hint(numbers(instance))
        });
    }
    let Some(at) = instance.node.inputs.iter().position(|input| input.name == name) else {
        let known: Vec<&str> =
            specs.iter().map(|spec| spec.name).chain(instance.node.inputs.iter().map(|input| input.name)).collect();
        let hint = near(name, &known).unwrap_or_else(|| numbers(instance));
        return Err(wrong(&format!("`{node}` ({}) has no input or parameter `{name}`", instance.node.id)).hint(hint));
    };
    let input = &instance.node.inputs[at];
    if document.graph().source(index, at).is_some() {
        return Err(
            wrong("it is wired, so it has no number of its own").hint("vary a parameter of the node that it reads")
        );
    }
    match input.fallback {
        Fallback::Constant { default, hard, soft } => {
            let value = instance.constants[at].unwrap_or(default);
            Ok(Declared { unit: input.ty.unit(), value, hard, soft, whole: false })
        }
        _ => Err(wrong("it takes a wire and no number").hint(numbers(instance))),
    }
}

/// A parameter of the file, with its first place.
fn of_file(
    document: &Document,
    name: &str,
    wrong: &dyn Fn(&str) -> Failure,
) -> Result<(String, String, Declared), Failure> {
    let all = document.parameters();
    let Some(found) = all.iter().find(|parameter| parameter.name == name) else {
        let names: Vec<&str> = all.iter().map(|parameter| parameter.name.as_str()).collect();
        let hint = match closest(name, names.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None if names.is_empty() => "write `--vary NODE.PARAM`".to_owned(),
            None => format!("it has {}; or write `--vary NODE.PARAM`", names.join(", ")),
        };
        return Err(wrong(&format!("the file has no parameter `{name}`")).hint(hint));
    };
    let place = &found.places[0];
    let declared = declared(&found.kind, Some(&found.kind.default_value()), found.unit).ok_or_else(|| {
        wrong(&format!("it is not a number, but {}", found.kind.describe(found.unit)))
            .hint("vary a parameter that is a number")
    })?;
    Ok((document.graph().instance(place.node).name.clone(), place.name.to_owned(), declared))
}

/// Returns None if the kind is not a number.
fn declared(kind: &Kind, value: Option<&ParamValue>, unit: Unit) -> Option<Declared> {
    match (kind, value) {
        (Kind::Float { hard, soft, .. }, Some(ParamValue::Float(value))) => {
            Some(Declared { unit, value: *value, hard: *hard, soft: *soft, whole: false })
        }
        (Kind::Int { hard, soft, .. }, Some(ParamValue::Int(value))) => {
            let [hard, soft] = [hard, soft].map(|range| range.map(|end| end as f64));
            Some(Declared { unit, value: *value as f64, hard, soft, whole: true })
        }
        _ => None,
    }
}

/// The numbers of a node, as a remedy.
fn numbers(instance: &Instance) -> String {
    let specs = instance.node.specs();
    let is_number = |kind: &Kind| matches!(kind, Kind::Float { .. } | Kind::Int { .. });
    let params = specs.iter().filter(|spec| is_number(&spec.kind)).map(|spec| spec.name);
    let inputs = instance.node.inputs.iter().filter(|input| matches!(input.fallback, Fallback::Constant { .. }));
    let names: Vec<&str> = params.chain(inputs.map(|input| input.name)).collect();
    format!("the numbers of `{}` are {}", instance.name, names.join(", "))
}

/// `LO..HI`; a unit after the second number applies to both.
pub(super) fn typed(text: &str, unit: Unit) -> Result<[f64; 2], String> {
    let (lo, hi) = text.trim_matches('"').split_once("..").ok_or("there is no `..` in the range")?;
    let (lo, hi) = (lo.trim(), hi.trim());
    let shared = match lo.parse::<f64>() {
        Ok(_) => hi.trim_start_matches(|c: char| c.is_ascii_digit() || matches!(c, '.' | '+' | '-')),
        Err(_) => "",
    };
    // what begins with an exponent is no unit
    let shared = if hi.parse::<f64>().is_ok() { "" } else { shared };
    let read = |text: &str| unit.parse(text).map_err(|error| error.to_string());
    Ok([read(&format!("{lo} {shared}")).or_else(|_| read(lo))?, read(hi)?])
}

/// Refuses a range without ends, one that is empty, or one that is not within the declared one.
pub(super) fn check_range(
    range: [f64; 2],
    hard: [f64; 2],
    unit: Unit,
    wrong: &dyn Fn(&str) -> Failure,
) -> Result<(), Failure> {
    if range.iter().any(|end| !end.is_finite()) {
        return Err(wrong("its range has no end").hint("give the range: write `=LO..HI`"));
    }
    let text = |range: [f64; 2]| range.map(|end| unit.display(end)).join("..");
    if range[0] >= range[1] {
        let hint = if range[0] > range[1] { text([range[1], range[0]]) } else { "LO..HI".to_owned() };
        return Err(wrong(&format!("the range {} is empty", text(range))).hint(format!("write `={hint}`")));
    }
    if range[0] < hard[0] || range[1] > hard[1] {
        let inner = [range[0].max(hard[0]), range[1].min(hard[1])];
        let hint = if inner[0] < inner[1] { format!("; write `={}`", text(inner)) } else { String::new() };
        let what = format!("the range {} is not within the declared one", text(range));
        return Err(wrong(&what).hint(format!("it takes values{}{hint}", range_text(hard, unit))));
    }
    Ok(())
}

/// The unit in which the file states a value, if it does.
pub(super) fn written_unit(document: &Document, node: &str, name: &str, unit: Unit) -> Option<(&'static str, f64)> {
    let entry = document.source().get(document.node(node)?.span.clone())?;
    let after = entry.match_indices(name).find_map(|(at, _)| {
        let starts = !entry[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
        entry[at + name.len()..].trim_start().strip_prefix(':').filter(|_| starts)
    })?;
    let quoted = after.trim_start().strip_prefix('"')?.split('"').next()?;
    let named = |(suffix, _): &&(&str, f64)| !suffix.is_empty() && quoted.trim_end().ends_with(suffix);
    unit.suffixes().iter().filter(named).max_by_key(|(suffix, _)| suffix.len()).copied()
}
