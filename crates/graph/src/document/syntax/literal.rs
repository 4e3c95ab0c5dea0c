//! The meaning of a value in a file for a parameter, an input or the world: checked, with a remedy if it does not fit.

use super::{
    Expr, ExprKind, Item,
    lex::{Bracket, quote},
};
use crate::{
    colour::Stop,
    node::{Fallback, Input},
    param::{Kind, Layer, ParamSpec, ParamValue, Stroke, Tool, Waypoint, check_value, range_text},
    unit::Unit,
    value::PortType,
};

/// A value without its span.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Literal {
    /// A number, and its integer value if it is whole, such as `1e3`.
    Number(f64, Option<i64>),
    /// Something that begins like a number but is not one.
    NotANumber(String),
    Word(String),
    Text(String),
    /// Items in round brackets without names.
    Tuple(Vec<Literal>),
    /// Items in square brackets.
    List(Vec<Literal>),
    /// Items in round brackets, each with a name.
    Record(Vec<(String, Literal)>),
    /// Any other brackets.
    Other,
    /// A value that could not be read; already reported.
    Bad,
}

/// Why a value does not fit, and a remedy.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Misfit {
    pub(crate) code: &'static str,
    pub(crate) message: String,
    pub(crate) hint: Option<String>,
}

impl Misfit {
    pub(crate) fn new(code: &'static str, message: String) -> Self {
        Self { code, message, hint: None }
    }

    pub(crate) fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }
}

impl Literal {
    /// Reads a value from its source.
    pub(crate) fn read(expr: &Expr, source: &str) -> Self {
        match &expr.kind {
            ExprKind::Number => number(&source[expr.span.clone()]),
            ExprKind::Word => match &source[expr.span.clone()] {
                "inf" => Self::Number(f64::INFINITY, None),
                "NaN" => Self::Number(f64::NAN, None),
                word => Self::Word(word.to_owned()),
            },
            ExprKind::Text(text) => Self::Text(text.clone()),
            ExprKind::Group(group) if group.close.is_none() => Self::Bad,
            ExprKind::Group(group)
                if group.name.is_none()
                    && group.bracket == Bracket::Round
                    && !group.items.is_empty()
                    && group.items.iter().all(|item| item.key.is_some()) =>
            {
                let named = |item: &Item| Some((item.key.as_ref()?.text.clone(), Self::read(&item.value, source)));
                Self::Record(group.items.iter().filter_map(named).collect())
            }
            ExprKind::Group(group) if group.name.is_some() || group.items.iter().any(|item| item.key.is_some()) => {
                Self::Other
            }
            ExprKind::Group(group) => {
                let items = group.items.iter().map(|item| Self::read(&item.value, source)).collect();
                match group.bracket {
                    Bracket::Round => Self::Tuple(items),
                    Bracket::Square => Self::List(items),
                    Bracket::Curly => Self::Other,
                }
            }
            ExprKind::Bad => Self::Bad,
        }
    }

    /// A description for messages: "the word `max`".
    pub(crate) fn describe(&self) -> String {
        match self {
            Self::Number(value, _) => format!("the number `{value}`"),
            Self::NotANumber(text) => format!("`{text}`"),
            Self::Word(word) => format!("the word `{word}`"),
            Self::Text(text) => format!("the text {}", quote(text)),
            Self::Tuple(items) => format!("{} in round brackets", things(items.len())),
            Self::List(items) => format!("a list of {}", things(items.len())),
            Self::Record(_) | Self::Other | Self::Bad => "something in brackets".to_owned(),
        }
    }

    /// Returns true if the value or a part of it was already reported.
    pub(crate) fn is_bad(&self) -> bool {
        match self {
            Self::Bad => true,
            Self::Tuple(items) | Self::List(items) => items.iter().any(Self::is_bad),
            Self::Record(items) => items.iter().any(|(_, item)| item.is_bad()),
            _ => false,
        }
    }

    /// The text of a wire: a string that does not begin like a number.
    pub(crate) fn as_wire(&self) -> Option<&str> {
        match self {
            Self::Text(text) if !begins_like_a_number(text) => Some(text),
            _ => None,
        }
    }

    /// The literal as written in a file.
    pub(crate) fn write(&self) -> String {
        let list = |items: &[Self]| items.iter().map(Self::write).collect::<Vec<_>>().join(", ");
        match self {
            Self::Number(_, Some(whole)) => whole.to_string(),
            Self::Number(value, None) => number_text(*value),
            Self::NotANumber(text) | Self::Word(text) => text.clone(),
            Self::Text(text) => quote(text),
            Self::Tuple(items) => format!("({})", list(items)),
            Self::List(items) => format!("[{}]", list(items)),
            Self::Record(items) => {
                let items = items.iter().map(|(name, item)| format!("{name}: {}", item.write()));
                format!("({})", items.collect::<Vec<_>>().join(", "))
            }
            Self::Other | Self::Bad => "()".to_owned(),
        }
    }
}

fn things(count: usize) -> String {
    if count == 1 { "1 item".to_owned() } else { format!("{count} items") }
}

/// Returns true if a text is a quantity such as `2 km` rather than a wire.
pub(crate) fn begins_like_a_number(text: &str) -> bool {
    text.trim_start().starts_with(|c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.'))
}

/// Returns true if a text can name a node or an output: a letter or `_`, then letters, digits, `_` and `-`.
pub(crate) fn is_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && text.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-'))
}

fn number(text: &str) -> Literal {
    let plain: String = text.chars().filter(|c| *c != '_').collect();
    let (sign, digits) = match plain.strip_prefix('-') {
        Some(rest) => (-1, rest),
        None => (1, plain.strip_prefix('+').unwrap_or(&plain)),
    };
    for (prefix, radix) in [("0x", 16), ("0b", 2), ("0o", 8)] {
        if let Some(digits) = digits.strip_prefix(prefix) {
            let starts_with_digit = digits.starts_with(|c: char| c.is_ascii_hexdigit());
            return match i64::from_str_radix(digits, radix) {
                Ok(value) if starts_with_digit => Literal::Number((sign * value) as f64, Some(sign * value)),
                _ => Literal::NotANumber(text.to_owned()),
            };
        }
    }
    match plain.parse::<f64>() {
        Ok(value) => Literal::Number(value, plain.parse().ok().or_else(|| whole(value))),
        Err(_) => Literal::NotANumber(text.to_owned()),
    }
}

/// A number as an integer, if it is whole and small enough for all integers near it to be distinct.
fn whole(value: f64) -> Option<i64> {
    (value.fract() == 0.0 && value.abs() < 9.007_199_254_740_992e15).then_some(value as i64)
}

/// The shortest text that parses to the same number.
pub(crate) fn number_text(value: f64) -> String {
    let (plain, power) = (format!("{value}"), format!("{value:e}"));
    let magnitude = value.abs();
    if value == 0.0 || ((1e-4..1e6).contains(&magnitude) || plain.len() <= power.len()) { plain } else { power }
}

/// A checked value as written in a file.
pub(crate) fn value_text(value: &ParamValue) -> String {
    let pair = |[x, y]: &[f64; 2]| format!("({}, {})", number_text(*x), number_text(*y));
    match value {
        ParamValue::Float(v) => number_text(*v),
        ParamValue::Int(v) => v.to_string(),
        ParamValue::Bool(v) => v.to_string(),
        ParamValue::Choice(name) => (*name).to_owned(),
        ParamValue::Seed(v) => v.to_string(),
        ParamValue::Point(point) => pair(point),
        ParamValue::Curve(points) | ParamValue::Path(points) => {
            format!("[{}]", points.iter().map(pair).collect::<Vec<_>>().join(", "))
        }
        ParamValue::Waypoints(points) => {
            format!("[{}]", points.iter().map(waypoint_text).collect::<Vec<_>>().join(", "))
        }
        ParamValue::Stops(stops) => {
            let stop = |stop: &Stop| format!("({}, {})", number_text(stop.at), quote(&stop.colour.to_string()));
            format!("[{}]", stops.iter().map(stop).collect::<Vec<_>>().join(", "))
        }
        ParamValue::Layers(layers) => format!("[{}]", layers.iter().map(layer_text).collect::<Vec<_>>().join(", ")),
        ParamValue::Strokes(strokes) => {
            format!("[{}]", strokes.iter().map(stroke_text).collect::<Vec<_>>().join(", "))
        }
        ParamValue::File(name) => quote(name),
    }
}

fn waypoint_text(point: &Waypoint) -> String {
    let [x, y] = point.at.map(number_text);
    let mut said = vec![format!("at: ({x}, {y})")];
    for (name, value) in [("height", point.height), ("width", point.width)] {
        said.extend(value.map(|value| format!("{name}: {}", number_text(value))));
    }
    if said.len() == 1 { format!("({x}, {y})") } else { format!("({})", said.join(", ")) }
}

fn stroke_text(stroke: &Stroke) -> String {
    let mut said = vec![format!("tool: {}", stroke.tool.name()), format!("radius: {}", number_text(stroke.radius))];
    if stroke.strength != stroke.tool.usual_strength() {
        said.push(format!("strength: {}", number_text(stroke.strength)));
    }
    if stroke.hardness != Stroke::USUAL_HARDNESS {
        said.push(format!("hardness: {}", number_text(stroke.hardness)));
    }
    if stroke.time != 0.0 {
        said.push(format!("time: {}", number_text(stroke.time)));
    }
    let points = stroke.points.iter().map(|[x, y]| format!("({}, {})", number_text(*x), number_text(*y)));
    said.push(format!("points: [{}]", points.collect::<Vec<_>>().join(", ")));
    format!("({})", said.join(", "))
}

fn layer_text(layer: &Layer) -> String {
    let mut said = vec![format!("thickness: {}", number_text(layer.thickness))];
    let usual = Layer::USUAL;
    if layer.hardness != usual.hardness {
        said.push(format!("hardness: {}", number_text(layer.hardness)));
    }
    if layer.repose != usual.repose {
        said.push(format!("repose: {}", number_text(layer.repose)));
    }
    if layer.colour != usual.colour {
        said.push(format!("colour: {}", quote(&layer.colour.to_string())));
    }
    format!("({})", said.join(", "))
}

/// A misfit if a record has a field that it does not know.
fn unknown_field(what: &str, spec: &ParamSpec, fields: &[(String, Literal)], known: &[&'static str]) -> Option<Misfit> {
    let (name, _) = fields.iter().find(|(name, _)| !known.contains(&name.as_str()))?;
    let misfit = Misfit::new("unknown-field", format!("a {what} of `{}` has no field `{name}`", spec.name));
    Some(match crate::closest(name, known.iter().copied()) {
        Some(near) => misfit.hint(format!("did you mean `{near}`?")),
        None => misfit.hint(format!("it has {}", crate::document::check::problems::list(known.iter().copied()))),
    })
}

/// Reads a layer of rock: a record of `thickness` and optional fields.
fn layer(spec: &ParamSpec, literal: &Literal) -> Option<Result<Layer, Misfit>> {
    const FIELDS: [&str; 4] = ["thickness", "hardness", "repose", "colour"];
    let Literal::Record(fields) = literal else { return None };
    if let Some(misfit) = unknown_field("layer", spec, fields, &FIELDS) {
        return Some(Err(misfit));
    }
    let field = |name: &str| fields.iter().find(|(field, _)| field == name).map(|(_, value)| value);
    let number = |name: &str, unit: Unit, usual: f64| {
        field(name).map_or(Ok(usual), |literal| quantity(&format!("{}.{name}", spec.name), unit, literal))
    };
    let thickness = field("thickness")?;
    Some((|| {
        let colour = match field("colour") {
            None => Layer::USUAL.colour,
            Some(Literal::Text(text)) => text
                .parse()
                .map_err(|error| Misfit::new("value", format!("`{}.colour` is `{text}`; {error}", spec.name)))?,
            Some(other) => {
                let message = format!("`{}.colour` is {}, but takes a colour", spec.name, other.describe());
                return Err(Misfit::new("type", message).hint("write it in quotes: \"#b08050\""));
            }
        };
        Ok(Layer {
            thickness: quantity(&format!("{}.thickness", spec.name), Unit::Metres, thickness)?,
            hardness: number("hardness", Unit::One, Layer::USUAL.hardness)?,
            repose: number("repose", Unit::Degrees, Layer::USUAL.repose)?,
            colour,
        })
    })())
}

/// Reads a point of a path: a pair, or a record of `at` and optional fields.
fn waypoint(spec: &ParamSpec, literal: &Literal) -> Option<Result<Waypoint, Misfit>> {
    let Literal::Record(fields) = literal else {
        return pair(spec.name, spec.unit, literal).map(|at| at.map(Waypoint::new));
    };
    if let Some(misfit) = unknown_field("point", spec, fields, &["at", "height", "width"]) {
        return Some(Err(misfit));
    }
    let field = |name: &str| fields.iter().find(|(field, _)| field == name).map(|(_, value)| value);
    let number = |name: &str| {
        field(name).map(|literal| quantity(&format!("{}.{name}", spec.name), Unit::Metres, literal)).transpose()
    };
    let at = pair(spec.name, spec.unit, field("at")?)?;
    Some((|| Ok(Waypoint { at: at?, height: number("height")?, width: number("width")? }))())
}

/// Reads a stroke: a record of `tool`, `radius`, `points`, and optional fields.
fn stroke(spec: &ParamSpec, literal: &Literal) -> Option<Result<Stroke, Misfit>> {
    const FIELDS: [&str; 6] = ["tool", "radius", "strength", "hardness", "time", "points"];
    let Literal::Record(fields) = literal else { return None };
    if let Some(misfit) = unknown_field("stroke", spec, fields, &FIELDS) {
        return Some(Err(misfit));
    }
    let field = |name: &str| fields.iter().find(|(field, _)| field == name).map(|(_, value)| value);
    let (Some(Literal::Word(word)), Some(radius), Some(Literal::List(points))) =
        (field("tool"), field("radius"), field("points"))
    else {
        return None;
    };
    let timed = matches!(spec.kind, Kind::Strokes { timed: true, .. });
    let Some(tool) = Tool::named(word, timed) else {
        let names = Tool::all(timed).iter().map(|tool| tool.name());
        let misfit = Misfit::new("value", format!("a stroke of `{}` has the tool `{word}`", spec.name));
        return Some(Err(misfit.hint(format!("there are {}", crate::document::check::problems::list(names)))));
    };
    let number = |name: &str, unit: Unit, usual: f64| {
        field(name).map_or(Ok(usual), |literal| quantity(&format!("{}.{name}", spec.name), unit, literal))
    };
    let points: Option<Vec<_>> = points.iter().map(|point| pair(spec.name, Unit::Metres, point)).collect();
    let points = points?;
    Some((|| {
        Ok(Stroke {
            tool,
            radius: quantity(&format!("{}.radius", spec.name), Unit::Metres, radius)?,
            strength: number("strength", tool.unit(), tool.usual_strength())?,
            hardness: number("hardness", Unit::One, Stroke::USUAL_HARDNESS)?,
            time: number("time", Unit::Seconds, 0.0)?,
            points: points.into_iter().collect::<Result<_, _>>()?,
        })
    })())
}

/// Reads a number or a quantity in quotes.
pub(crate) fn quantity(name: &str, unit: Unit, literal: &Literal) -> Result<f64, Misfit> {
    match literal {
        Literal::Number(value, _) if value.is_finite() => Ok(*value),
        Literal::Number(value, _) => {
            let text = if value.is_nan() { "not a number (NaN)" } else { "infinite, or too large for a number" };
            Err(Misfit::new("value", format!("`{name}` is {text}")).hint("write a finite number"))
        }
        Literal::Text(text) => unit.parse(text).map_err(|error| {
            let misfit = Misfit::new("unit", format!("`{name}` cannot be read: {error}"));
            misfit.hint(format!("write {}", unit_example(unit)))
        }),
        Literal::NotANumber(text) => {
            let misfit = Misfit::new("value", format!("`{name}` is `{text}`, which is not a number"));
            Err(match unit.parse(text) {
                Ok(_) => misfit.hint(format!("write a number with a unit in quotes: \"{text}\"")),
                Err(_) => misfit.hint(format!("write {}", unit_example(unit))),
            })
        }
        other => {
            let misfit =
                Misfit::new("type", format!("`{name}` is {}, but takes {}", other.describe(), unit.describe()));
            Err(misfit.hint(format!("write {}", unit_example(unit))))
        }
    }
}

fn unit_example(unit: Unit) -> String {
    let typed = |(suffix, factor): &&(&str, f64)| *factor == 1.0 && !suffix.is_empty() && suffix.is_ascii();
    match unit.suffixes().iter().find(typed) {
        Some((suffix, _)) => format!("a number, or a quantity in quotes such as \"2 {suffix}\""),
        None => "a number".to_owned(),
    }
}

/// Reads a pair of quantities.
pub(crate) fn pair(name: &str, unit: Unit, literal: &Literal) -> Option<Result<[f64; 2], Misfit>> {
    match literal {
        Literal::Tuple(items) if items.len() == 2 => {
            let x = quantity(name, unit, &items[0]);
            Some(x.and_then(|x| Ok([x, quantity(name, unit, &items[1])?])))
        }
        _ => None,
    }
}

/// Reads a colour stop: a value and its colour.
fn stop(name: &str, unit: Unit, literal: &Literal) -> Option<Result<Stop, Misfit>> {
    let Literal::Tuple(items) = literal else { return None };
    let [at, Literal::Text(colour)] = items.as_slice() else { return None };
    let colour = colour.parse().map_err(|error| Misfit::new("value", format!("`{name}` has `{colour}`; {error}")));
    Some(quantity(name, unit, at).and_then(|at| Ok(Stop { at, colour: colour? })))
}

/// Reads and checks the value of a parameter.
pub(crate) fn param(spec: &ParamSpec, literal: &Literal) -> Result<ParamValue, Misfit> {
    let name = spec.name;
    let wrong = || {
        let allowed = spec.kind.describe(spec.unit);
        Misfit::new("type", format!("`{name}` is {}, but takes {allowed}", literal.describe()))
    };
    let value = match (&spec.kind, literal) {
        (Kind::Float { .. }, _) => ParamValue::Float(quantity(name, spec.unit, literal)?),
        (Kind::Int { .. }, Literal::Number(_, Some(value))) => ParamValue::Int(*value),
        (Kind::Int { .. }, Literal::Text(text)) => {
            let value = quantity(name, spec.unit, &Literal::Text(text.clone()))?;
            ParamValue::Int(whole(value).ok_or_else(wrong)?)
        }
        (Kind::Bool { .. }, Literal::Word(word)) if word == "true" || word == "false" => {
            ParamValue::Bool(word == "true")
        }
        (Kind::Choice { options, .. }, Literal::Word(word) | Literal::Text(word)) => {
            let found = options.iter().find(|(option, _)| option == word).ok_or_else(|| {
                let near = crate::closest(word, options.iter().map(|(option, _)| *option));
                match near {
                    Some(near) => wrong().hint(format!("did you mean `{near}`?")),
                    None => wrong(),
                }
            })?;
            if matches!(literal, Literal::Text(_)) {
                return Err(wrong().hint(format!("write `{word}` without quotes")));
            }
            ParamValue::Choice(found.0)
        }
        (Kind::Seed { .. }, Literal::Number(_, Some(value))) => {
            let seed = u32::try_from(*value).map_err(|_| {
                let allowed = spec.kind.describe(spec.unit);
                Misfit::new("range", format!("`{name}` is {value}, but must be {allowed}"))
            })?;
            ParamValue::Seed(seed)
        }
        (Kind::Point { .. }, _) => ParamValue::Point(pair(name, spec.unit, literal).ok_or_else(wrong)??),
        (Kind::Curve { .. }, Literal::List(items)) => {
            let points = items.iter().map(|item| pair(name, spec.unit, item).ok_or_else(wrong)?);
            ParamValue::Curve(points.collect::<Result<_, _>>()?)
        }
        (Kind::Path { .. }, Literal::List(items)) => {
            let points = items.iter().map(|item| pair(name, spec.unit, item).ok_or_else(wrong)?);
            ParamValue::Path(points.collect::<Result<_, _>>()?)
        }
        (Kind::Waypoints { .. }, Literal::List(items)) => {
            let points = items.iter().map(|item| waypoint(spec, item).ok_or_else(wrong)?);
            ParamValue::Waypoints(points.collect::<Result<_, _>>()?)
        }
        (Kind::Stops { .. }, Literal::List(items)) => {
            let stops = items.iter().map(|item| stop(name, spec.unit, item).ok_or_else(wrong)?);
            ParamValue::Stops(stops.collect::<Result<_, _>>()?)
        }
        (Kind::Layers { .. }, Literal::List(items)) => {
            let layers = items.iter().map(|item| layer(spec, item).ok_or_else(wrong)?);
            ParamValue::Layers(layers.collect::<Result<_, _>>()?)
        }
        (Kind::Strokes { .. }, Literal::List(items)) => {
            let strokes = items.iter().map(|item| stroke(spec, item).ok_or_else(wrong)?);
            ParamValue::Strokes(strokes.collect::<Result<_, _>>()?)
        }
        (Kind::File, Literal::Text(text)) => ParamValue::File(text.clone()),
        (Kind::Int { .. } | Kind::Seed { .. }, Literal::NotANumber(_)) => {
            return Err(quantity(name, spec.unit, literal).err().unwrap_or_else(wrong));
        }
        (Kind::Choice { .. }, Literal::Number(..)) | (Kind::File, Literal::Word(_)) => {
            return Err(wrong().hint("write a file name in quotes, a choice without"));
        }
        _ => return Err(wrong()),
    };
    check_value(spec, &value).map_err(|message| Misfit::new("range", message))?;
    Ok(value)
}

/// Reads and checks the number that replaces an input's wire.
pub(crate) fn constant(input: &Input, literal: &Literal) -> Result<f64, Misfit> {
    let name = input.name;
    let Fallback::Constant { hard, .. } = input.fallback else {
        let misfit =
            Misfit::new("type", format!("`{name}` is {}, but takes a wire from a {}", literal.describe(), input.ty));
        return Err(misfit.hint(format!("write the name of a node in quotes: {name}: \"node\"")));
    };
    let unit = input.ty.unit();
    let value = quantity(name, unit, literal).map_err(|misfit| match literal {
        Literal::Word(word) => Misfit { hint: Some(format!("write a wire in quotes: \"{word}\"")), ..misfit },
        _ => misfit,
    })?;
    if (hard[0]..=hard[1]).contains(&value) {
        return Ok(value);
    }
    let what = if input.ty == PortType::Mask { "a mask" } else { unit.describe() };
    let message = format!("`{name}` is {}, but must be {what}{}", unit.display(value), range_text(hard, unit));
    Err(Misfit::new("range", message))
}

#[cfg(test)]
mod tests;
