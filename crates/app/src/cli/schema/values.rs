//! Schemas of single values: quantities, wires, parameters and inputs.

use orograph_graph::{
    Fallback, Input, Kind, Layer, ParamSpec, PortType, Stroke, Tool, Unit, Waypoint, When, range_text,
};
use serde_json::{Map, Value, json};

/// A number as it is typed in a quantity.
const NUMBER: &str = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?";
/// A name of a node or an output.
pub const NAME: &str = "^[A-Za-z_][A-Za-z0-9_-]*$";
/// A name of a node, or of one of its outputs.
pub const WIRE: &str = r"^[A-Za-z_][A-Za-z0-9_-]*(?:\.[A-Za-z_][A-Za-z0-9_]*)?$";
const COLOUR: &str = "^#[0-9A-Fa-f]{6}$";

/// A reference to a definition.
pub fn reference(path: &str) -> Value {
    json!({ "$ref": format!("#/$defs/{path}") })
}

/// The definitions that values refer to: wires, and quantities of each unit.
pub fn definitions() -> Map<String, Value> {
    let mut all = Map::new();
    all.insert(
        "name".to_owned(),
        json!({ "type": "string", "pattern": NAME, "maxLength": 200, "description": "The name of a node." }),
    );
    let wire = "A wire: the name of a node (its first output), or `node.output`.";
    all.insert("wire".to_owned(), json!({ "type": "string", "pattern": WIRE, "description": wire }));
    let colour = "Red, green and blue in sRGB.";
    all.insert("colour".to_owned(), json!({ "type": "string", "pattern": COLOUR, "description": colour }));
    for unit in Unit::ALL {
        let suffixes: Vec<&str> = unit.suffixes().iter().map(|(suffix, _)| *suffix).collect();
        let escaped: Vec<String> = suffixes.iter().map(|suffix| escaped(suffix)).collect();
        let description = match unit.symbol() {
            "" => "A number as text; `%` divides it by 100.".to_owned(),
            symbol => format!("A number with its unit, in {symbol} or another of: {}.", suffixes.join(", ")),
        };
        let pattern = format!(r"^\s*{NUMBER}\s*(?:{})?\s*$", escaped.join("|"));
        all.insert(text_of(unit), json!({ "type": "string", "pattern": pattern, "description": description }));
    }
    all
}

/// The name of the definition of quantities of a unit.
fn text_of(unit: Unit) -> String {
    format!("quantity{unit:?}")
}

/// A text in which no character has a meaning in a regular expression.
fn escaped(text: &str) -> String {
    let is_special =
        |c: char| matches!(c, '^' | '$' | '(' | ')' | '.' | '*' | '+' | '?' | '|' | '[' | ']' | '{' | '}' | '\\');
    text.chars().flat_map(|c| is_special(c).then_some('\\').into_iter().chain([c])).collect()
}

/// A number in the unit, within a range, or a quantity with its unit.
pub fn quantity(unit: Unit, range: [f64; 2]) -> Value {
    json!({ "anyOf": [number("number", range), reference(&text_of(unit))] })
}

fn number(kind: &str, [low, high]: [f64; 2]) -> Value {
    let mut schema = json!({ "type": kind });
    if low.is_finite() {
        schema["minimum"] = whole(low);
    }
    if high.is_finite() {
        schema["maximum"] = whole(high);
    }
    schema
}

/// A number without a fraction that is not needed.
fn whole(value: f64) -> Value {
    if value.fract() == 0.0 && value.abs() < 1e15 { json!(value as i64) } else { json!(value) }
}

/// A pair of the same.
pub fn pair(of: &Value) -> Value {
    json!({ "type": "array", "prefixItems": [of, of], "items": false, "minItems": 2 })
}

/// An input: a wire, or a number if it has one to fall back to.
pub fn input(input: &Input) -> Value {
    let unit = input.ty.unit();
    let mut schema = match input.fallback {
        Fallback::Constant { default, hard, soft } => {
            let choices = [number("number", hard), reference(&text_of(unit)), reference("wire")];
            let mut schema = json!({ "anyOf": choices, "default": whole(default) });
            if soft != hard {
                schema["x-usual"] = json!(soft.map(whole));
            }
            schema
        }
        Fallback::Required | Fallback::None => reference("wire"),
    };
    schema["description"] = json!(input.doc);
    schema["x-port"] = json!(input.ty.to_string());
    if input.fallback == Fallback::Required {
        schema["x-required"] = json!(true);
    }
    described(schema, unit)
}

/// The unit, unless it is a plain number.
fn described(mut schema: Value, unit: Unit) -> Value {
    if !unit.symbol().is_empty() {
        schema["x-unit"] = json!(unit.symbol());
    }
    schema
}

/// A parameter of a node.
pub fn parameter(spec: &ParamSpec) -> Value {
    let unit = spec.unit;
    let any = [f64::NEG_INFINITY, f64::INFINITY];
    let list = |item: Value, least: usize| json!({ "type": "array", "items": item, "minItems": least });
    let mut usual = None;
    let mut schema = match &spec.kind {
        Kind::Float { default, hard, soft } => {
            usual = (soft != hard).then(|| json!(soft.map(whole)));
            let mut schema = quantity(unit, *hard);
            schema["default"] = whole(*default);
            schema
        }
        Kind::Int { default, hard, soft } => {
            usual = (soft != hard).then(|| json!(soft));
            let whole = number("integer", hard.map(|v| v as f64));
            json!({ "anyOf": [whole, reference(&text_of(unit))], "default": default })
        }
        Kind::Bool { default } => json!({ "type": "boolean", "default": default }),
        Kind::Choice { default, options } => {
            let of = |(name, doc): &(&str, &str)| json!({ "const": name, "description": doc });
            json!({ "oneOf": options.iter().map(of).collect::<Vec<_>>(), "default": default })
        }
        Kind::Seed { default } => {
            let mut schema = number("integer", [0.0, f64::from(u32::MAX)]);
            schema["default"] = json!(default);
            schema
        }
        Kind::Point { default, hard, .. } => {
            let mut schema = pair(&quantity(unit, *hard));
            schema["default"] = json!(default.map(whole));
            schema
        }
        Kind::Curve { default, .. } => {
            let mut schema = list(pair(&quantity(unit, any)), 2);
            schema["default"] = json!(default);
            schema
        }
        Kind::Path { default, hard, .. } => {
            let mut schema = list(pair(&quantity(unit, *hard)), 2);
            schema["default"] = json!(default);
            schema
        }
        Kind::Waypoints { default, hard } => {
            let at = pair(&quantity(unit, *hard));
            let mut schema = list(json!({ "anyOf": [at, waypoint(&at)] }), 2);
            schema["default"] = default.iter().map(written).collect();
            schema
        }
        Kind::Stops { default } => {
            let stop = json!({
                "type": "array", "prefixItems": [quantity(unit, any), reference("colour")], "items": false, "minItems": 2,
            });
            let mut schema = list(stop, 1);
            schema["default"] = default.iter().map(|stop| json!([stop.at, stop.colour.to_string()])).collect();
            schema
        }
        Kind::Layers { .. } => list(layer(), 0),
        Kind::Strokes { hard, timed } => list(stroke(unit, *hard, *timed), 0),
        Kind::File => json!({ "type": "string" }),
    };
    if let Some(usual) = usual {
        schema["x-usual"] = usual;
    }
    let mut settings = Map::new();
    let mut amounts: Vec<&str> = Vec::new();
    for when in spec.when {
        match when {
            When::Setting { param, is } => _ = settings.insert((*param).to_owned(), json!(is)),
            When::NonZero(param) => amounts.push(param),
            When::Empty(param) => schema["x-if-empty"] = json!(param),
            When::Wired(input) => schema["x-if-wired"] = json!(input),
            When::Unwired(input) => schema["x-unless-wired"] = json!(input),
        }
    }
    if !settings.is_empty() {
        schema["x-when"] = Value::Object(settings);
    }
    if !amounts.is_empty() {
        schema["x-unless-zero"] = json!(amounts);
    }
    schema["description"] = json!(spec.doc);
    described(schema, unit)
}

/// A point of a path with numbers.
fn waypoint(at: &Value) -> Value {
    json!({
        "type": "object",
        "required": ["at"],
        "additionalProperties": false,
        "properties": {
            "at": at,
            "height": quantity(Unit::Metres, Waypoint::HEIGHTS),
            "width": quantity(Unit::Metres, Waypoint::WIDTHS),
        },
    })
}

/// A point of a path as it is written: a pair, or an object if it has numbers.
fn written(point: &Waypoint) -> Value {
    let numbers = [("height", point.height), ("width", point.width)];
    let mut object = Map::from_iter([("at".to_owned(), json!(point.at))]);
    object.extend(numbers.into_iter().filter_map(|(name, value)| Some((name.to_owned(), json!(value?)))));
    if object.len() == 1 { json!(point.at) } else { Value::Object(object) }
}

fn layer() -> Value {
    json!({
        "type": "object",
        "required": ["thickness"],
        "additionalProperties": false,
        "properties": {
            "thickness": quantity(Unit::Metres, Layer::THICKNESSES),
            "hardness": quantity(Unit::One, Layer::HARDNESSES),
            "repose": quantity(Unit::Degrees, Layer::REPOSES),
            "colour": reference("colour"),
        },
    })
}

fn stroke(unit: Unit, hard: [f64; 2], timed: bool) -> Value {
    let tools: Vec<&str> = Tool::all(timed).iter().map(|tool| tool.name()).collect();
    let strengths = Tool::all(timed).iter().map(|tool| quantity(tool.unit(), tool.strengths()));
    let mut schema = json!({
        "type": "object",
        "required": ["tool", "radius", "points"],
        "additionalProperties": false,
        "properties": {
            "tool": { "enum": tools },
            "radius": quantity(Unit::Metres, Stroke::RADII),
            "strength": { "anyOf": strengths.collect::<Vec<_>>() },
            "hardness": quantity(Unit::One, [0.0, 1.0]),
            "points": { "type": "array", "items": pair(&quantity(unit, hard)), "minItems": 1 },
        },
    });
    if timed {
        schema["properties"]["time"] = quantity(Unit::Seconds, Stroke::TIMES);
    }
    schema
}

/// The type of an output as text, with its range if it has one.
pub fn port(ty: PortType) -> String {
    let range = if ty == PortType::Mask { range_text([0.0, 1.0], Unit::One) } else { String::new() };
    format!("{ty}{range}")
}
