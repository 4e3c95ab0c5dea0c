//! The schema of a whole graph file.

use orograph_graph::{Edge, GeoPlace, MeasureSpec, Node, OutputType, Registry, Unit, World};
use serde_json::{Map, Value, json};

use super::values::{self, NAME, input, pair, parameter, quantity, reference};

/// The JSON Schema of graph files with these nodes.
#[must_use]
pub fn schema(registry: &Registry) -> Value {
    let mut definitions = values::definitions();
    let mut kinds = Map::new();
    for node in registry.listed() {
        definitions.insert(format!("node{}", node.id), of_node(node));
        for id in node.aliases.iter().chain([&node.id]) {
            kinds.insert((*id).to_owned(), reference(&format!("node{}", node.id)));
        }
    }
    definitions.insert(
        "node".to_owned(),
        json!({
            "type": "object",
            "description": "A node: its kind, and in it the inputs and parameters that differ from their defaults.",
            "properties": kinds,
            "additionalProperties": false,
            "minProperties": 1,
            "maxProperties": 1,
        }),
    );
    let place = json!({ "type": "array", "prefixItems": [{ "type": "number" }, { "type": "number" }], "items": false, "minItems": 2 });
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Orograph graph file",
        "description": "A graph file as JSON, as `orograph schema GRAPH.ron` prints it. `x-unit` is the unit of plain \
            numbers, `x-usual` the range of the editor's slider, `x-when` the settings with which a parameter has an \
            effect, `x-unless-zero` the numbers that must not be 0 for that, `x-if-empty` the table that must be empty, \
            `x-if-wired` and `x-unless-wired` the input on which that depends, `x-port` the type of an input \
            or an output, and `x-required` marks an input that needs a wire.",
        "type": "object",
        "required": ["nodes"],
        "additionalProperties": false,
        "properties": {
            "format": { "const": 1, "description": "The version of the file format." },
            "world": world(),
            "inputs": exposed("feeds", "Inputs of nodes that the file exposes to other graphs.", false),
            "parameters": exposed("drives", "Values that the file exposes by name.", true),
            "nodes": map(reference("node"), "The nodes, by name."),
            "muted": { "type": "array", "items": reference("name"), "description": "Nodes that the build bypasses." },
            "outputs": map(reference("wire"), "The files to write, by name."),
            "expect": expect(registry.measures()),
            "layout": map(place.clone(), "Positions of nodes on the canvas."),
            "reroutes": {
                "type": "object",
                "description": "Points that the wire into an input (`node.input`) passes on the canvas.",
                "additionalProperties": { "type": "array", "items": place },
            },
            "notes": map(json!({ "type": "string" }), "Notes of nodes on the canvas."),
            "frames": frames(&place),
        },
        "$defs": definitions,
    })
}

/// An object whose members are named like nodes.
fn map(of: Value, description: &str) -> Value {
    json!({
        "type": "object", "description": description, "propertyNames": { "pattern": NAME }, "additionalProperties": of,
    })
}

fn world() -> Value {
    let length = quantity(Unit::Metres, [0.0, World::MOST_SIDE_M]);
    let cells = json!({ "type": "integer", "minimum": 1, "maximum": World::MAX_SIDE });
    let edge = json!({ "enum": Edge::NAMES.map(|(name, _)| name) });
    let default = World::default();
    let [low, high] = GeoPlace::CODES;
    let corner = pair(&quantity(Unit::Metres, [-GeoPlace::MOST_M, GeoPlace::MOST_M]));
    json!({
        "type": "object",
        "description": "Size, resolution and seed of the terrain.",
        "additionalProperties": false,
        "properties": {
            "from": {
                "type": "string",
                "description": "A raster, relative to the file, that gives the world its size, its cells and its place.",
            },
            "size": {
                "description": "Width and height in metres; one number for a square.",
                "anyOf": [length, pair(&length)], "default": default.size,
            },
            "cells": {
                "description": "Cells along x and y; one number is the number along x. Cells are square.",
                "anyOf": [cells, pair(&cells)], "default": default.cells[0],
            },
            "seed": { "type": "integer", "minimum": 0, "maximum": u32::MAX, "default": default.seed },
            "boundary": {
                "description": "What happens at the sides; one word, or one for each side.",
                "default": default.boundary.west.name(),
                "anyOf": [edge, {
                    "type": "object", "additionalProperties": false,
                    "properties": { "west": edge, "east": edge, "north": edge, "south": edge },
                }],
            },
            "sea_level": quantity(Unit::Metres, World::SEA_LEVELS),
            "place": {
                "type": "object",
                "description": "Where on Earth the world lies: a projected coordinate system in metres, and easting and \
                    northing of the north-west corner.",
                "required": ["epsg", "corner"],
                "additionalProperties": false,
                "properties": { "epsg": { "type": "integer", "minimum": low, "maximum": high }, "corner": corner },
            },
        },
    })
}

/// The section of exposed inputs or parameters.
fn exposed(verb: &str, description: &str, ranged: bool) -> Value {
    let places = json!({ "anyOf": [
        { "type": "string" },
        { "type": "array", "items": { "type": "string" }, "minItems": 1 },
    ] });
    let mut properties = json!({ verb: places, "doc": { "type": "string" } });
    if ranged {
        let end = json!({ "type": ["number", "string"] });
        properties["range"] = pair(&end);
    }
    let record = json!({
        "type": "object", "required": [verb], "additionalProperties": false, "properties": properties,
    });
    let mut schema = map(json!({ "anyOf": [places, record] }), description);
    schema["propertyNames"] =
        json!({ "pattern": "^[A-Za-z_][A-Za-z0-9_]*$", "not": { "enum": ["file", "seed", "version"] } });
    schema
}

fn expect<'a>(measures: impl Iterator<Item = &'a MeasureSpec>) -> Value {
    let end = json!({ "type": ["number", "string"] });
    let mut properties = Map::new();
    properties.insert(
        "in".to_owned(),
        json!({
            "type": "array", "items": quantity(Unit::Metres, [f64::NEG_INFINITY, f64::INFINITY]), "minItems": 4, "maxItems": 4,
            "description": "The part that is measured: x and y of its north-west corner, width and height.",
        }),
    );
    let mut cell = quantity(Unit::Metres, [World::LEAST_CELL_M, World::MOST_SIDE_M]);
    cell["description"] = json!("Side of the cells on which it is measured.");
    properties.insert("cell".to_owned(), cell);
    for measure in measures {
        let mut bounds = pair(&end);
        bounds["description"] = json!(measure.doc);
        bounds["x-unit"] = json!(measure.unit);
        properties.insert(measure.name.to_owned(), bounds);
    }
    json!({
        "type": "object",
        "description": "Measures of the terrain with their lowest and highest figure; `\"inf\"` leaves a side open.",
        "additionalProperties": false,
        "properties": properties,
    })
}

fn frames(place: &Value) -> Value {
    json!({
        "type": "object",
        "description": "Areas behind the nodes on the canvas.",
        "additionalProperties": {
            "type": "object",
            "additionalProperties": false,
            "properties": {
                "at": place, "size": place, "note": { "type": "string" }, "colour": reference("colour"),
            },
        },
    })
}

/// A kind of node. Parameters of older versions are not described; files in these are migrated when they are read.
fn of_node(node: &'static Node) -> Value {
    let mut properties = Map::new();
    properties.insert(
        "version".to_owned(),
        json!({ "type": "integer", "minimum": 1, "maximum": node.version, "default": 1 }),
    );
    properties.extend(node.inputs.iter().map(|declared| (declared.name.to_owned(), input(declared))));
    properties.extend(node.specs().iter().map(|spec| (spec.name.to_owned(), parameter(spec))));
    let outputs = node.outputs.iter().map(|output| {
        let ty = match output.ty {
            OutputType::Fixed(ty) => values::port(ty),
            OutputType::SameAs(input) => format!("same as `{input}`"),
            OutputType::Chosen(_) => "as the parameters set it".to_owned(),
        };
        json!({ "name": output.name, "x-port": ty, "description": output.doc })
    });
    let mut schema = json!({
        "type": "object",
        "title": node.id,
        "description": node.summary,
        "x-category": node.category,
        "x-version": node.version,
        "x-outputs": outputs.collect::<Vec<_>>(),
    });
    // a graph file as a node has what the file exposes as well
    let is_open = node.is_subgraph();
    if node.version == 1 {
        schema["properties"] = Value::Object(properties);
        schema["additionalProperties"] = json!(is_open);
        return schema;
    }
    schema["if"] = json!({ "properties": { "version": { "const": node.version } }, "required": ["version"] });
    schema["then"] = json!({ "properties": properties, "additionalProperties": is_open });
    schema["else"] =
        json!({ "properties": { "version": { "type": "integer", "minimum": 1, "maximum": node.version - 1 } } });
    schema
}

#[cfg(test)]
mod tests {
    use orograph_graph::Document;

    use super::*;

    /// The loader knows each field of the schema, and the schema each field that the loader knows.
    #[test]
    fn fields_are_those_of_the_loader() {
        let registry = orograph_nodes::registry();
        let schema = schema(&registry);
        let names = |schema: &Value| -> Vec<String> {
            schema["properties"].as_object().expect("an object").keys().cloned().collect()
        };
        let listed = |source: String| -> Vec<String> {
            let document = Document::parse(source, &registry);
            let hint = document.problems().iter().find(|problem| problem.message.contains("zzzzzzzz"));
            let hint = hint.and_then(|problem| problem.hint.clone()).expect("a problem that lists the fields");
            hint.split('`').skip(1).step_by(2).map(str::to_owned).collect()
        };
        for (known, source) in [
            (names(&schema), "(zzzzzzzz: 1)"),
            (names(&schema["properties"]["world"]), "(world: (zzzzzzzz: 1))"),
            (names(&schema["properties"]["world"]["properties"]["place"]), "(world: (place: (zzzzzzzz: 1)))"),
            (names(&schema["properties"]["frames"]["additionalProperties"]), "(frames: { \"f\": (zzzzzzzz: 1) })"),
        ] {
            let (mut known, mut listed) = (known, listed(source.to_owned()));
            known.sort();
            listed.sort();
            assert_eq!(known, listed, "{source}");
        }
    }

    #[test]
    fn nodes_are_those_of_the_registry() {
        let registry = orograph_nodes::registry();
        let schema = schema(&registry);
        for node in registry.listed() {
            let entry = &schema["$defs"][format!("node{}", node.id)];
            let entry = if node.version > 1 { &entry["then"] } else { entry };
            let names = node.inputs.iter().map(|input| input.name.to_owned());
            for name in names.chain(node.specs().iter().map(|spec| spec.name.to_owned())) {
                assert!(entry["properties"][&name]["description"].is_string(), "{}.{name}", node.id);
            }
            for id in node.aliases.iter().chain([&node.id]) {
                assert!(schema["$defs"]["node"]["properties"][*id].is_object(), "{id}");
            }
        }
        let stream = &schema["$defs"]["nodeStreamPower"]["then"]["properties"];
        assert_eq!(stream["duration"]["x-unit"], "yr");
        assert_eq!(stream["height"]["x-required"], true);
        assert_eq!(schema["$defs"]["quantityYears"]["type"], "string");
        // every reference leads somewhere
        let text = schema.to_string();
        for target in text.split("#/$defs/").skip(1).map(|rest| rest.split('"').next().unwrap_or_default()) {
            assert!(schema["$defs"][target].is_object(), "{target}");
        }
    }
}
