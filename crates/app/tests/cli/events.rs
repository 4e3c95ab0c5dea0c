//! Lines of JSON for programs: `run --json`, `check --json`; and what `schema` prints.

use serde_json::{Value, json};

use super::{Place, SMALL, json_lines};

fn of<'a>(lines: &'a [Value], event: &str) -> Vec<&'a Value> {
    lines.iter().filter(|line| line["event"] == event).collect()
}

#[test]
fn written_files_have_their_hash() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    let lines = json_lines(&place.run(&["run", "g.ron", "--json"]).done().out);
    let written = of(&lines, "output");
    assert_eq!(written.len(), 4);
    for line in written {
        let bytes = place.bytes(line["file"].as_str().expect("a path"));
        assert_eq!(line["hash"], blake3::hash(&bytes).to_string(), "{line}");
        assert_eq!(line["bytes"], bytes.len());
    }
}

/// Each key of the lines of a run is in the text of `run --help`.
#[test]
fn the_help_lists_every_key_of_a_line() {
    let place = Place::new();
    place.write("g.ron", &SMALL.replace("    outputs:", "    expect: { \"relief\": (0, 1) },\n    outputs:"));
    let help = place.run(&["run", "--help"]).done().out;
    for line in json_lines(&place.run(&["run", "g.ron", "--json", "--cells", "16"]).done().out) {
        let event = line["event"].as_str().expect("an event");
        let (_, after) = help.split_once(&format!("{{\"event\":\"{event}\"")).expect("described");
        let described = after.split("{\"event\"").next().unwrap_or_default();
        for key in line.as_object().expect("an object").keys().filter(|key| *key != "event") {
            assert!(described.contains(&format!("\"{key}\":")), "{event}: {key}");
        }
    }
}

#[test]
fn problems_of_a_file_come_one_per_line() {
    let place = Place::new();
    place.write("bad.ron", &SMALL.replace("Slope(", "Slop(").replace("value: 700", "value: \"3 kg\""));
    for command in ["run", "check"] {
        let lines = json_lines(&place.run(&[command, "bad.ron", "--json"]).ended(1, &[]).out);
        let problems = of(&lines, "problem");
        let places: Vec<_> = problems.iter().map(|line| json!([line["code"], line["line"], line["column"]])).collect();
        assert_eq!(places, [json!(["unit", 6, 34]), json!(["unknown-node", 8, 18])], "{lines:?}");
        assert_eq!((&problems[1]["file"], &problems[1]["severity"]), (&"bad.ron".into(), &"error".into()));
        assert_eq!(problems[1]["help"], "did you mean `Slope`?");
        let last = lines.last().expect("a line");
        match command {
            "run" => assert_eq!(
                (&last["event"], &last["code"], &last["exit"]),
                (&"error".into(), &"problems".into(), &1.into())
            ),
            _ => {
                assert_eq!((&last["event"], &last["errors"], &last["nodes"]), (&"checked".into(), &2.into(), &3.into()))
            }
        }
    }
    for command in ["run", "check", "watch"] {
        let lines = json_lines(&place.run(&[command, "none.ron", "--json"]).ended(1, &["none.ron"]).out);
        assert_eq!((lines.len(), &lines[0]["event"]), (1, &"error".into()), "{lines:?}");
        assert_eq!(lines[0]["code"], "missing-file", "{command}");
        assert!(lines[0]["message"].as_str().is_some_and(|message| message.contains("none.ron")), "{lines:?}");
    }
}

/// Warnings do not stop a build; they come before it.
#[test]
fn warnings_of_a_file_are_problems_too() {
    let place = Place::new();
    place.write("g.ron", &SMALL.replace("outputs:", "layout: { \"gone\": (0, 0) }, outputs:"));
    let lines = json_lines(&place.run(&["run", "g.ron", "--json"]).done().out);
    let first = &lines[0];
    assert_eq!(
        (&first["event"], &first["severity"], &first["code"]),
        (&"problem".into(), &"warning".into(), &"unknown-layout".into())
    );
    assert_eq!(lines[1]["event"], "start");
}

#[test]
fn a_failing_node_is_named_with_its_place() {
    let place = Place::new();
    place.write("land.tif", "no raster");
    place.write("g.ron", &SMALL.replace("Constant(value: 700)", "Import(version: 2, file: \"land.tif\")"));
    let ran = place.run(&["run", "g.ron", "--json"]).ended(1, &["   at: g.ron:6:9"]);
    let line = json_lines(&ran.out).pop().expect("a line");
    let shown = json!([line["event"], line["code"], line["node"], line["file"], line["line"], line["column"]]);
    assert_eq!(shown, json!(["error", "node-failed", "plain", "g.ron", 6, 9]));
}

#[test]
fn the_remedy_of_a_wrong_setting_is_its_help() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    let ran = place.run(&["run", "g.ron", "--json", "--set", "plian.value=3"]).ended(1, &["did you mean `plain`?"]);
    let line = json_lines(&ran.out).pop().expect("a line");
    assert_eq!(line["help"], "did you mean `plain`?", "{line}");
    assert!(line["message"].as_str().is_some_and(|message| message.ends_with("no node `plian`")), "{line}");
}

#[test]
fn the_schema_and_a_file_in_its_form() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    let schema: Value = serde_json::from_str(&place.run(&["schema"]).done().out).expect("JSON");
    assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
    assert_eq!(schema["$defs"]["nodeStreamPower"]["then"]["properties"]["duration"]["x-unit"], "yr");
    let file: Value = serde_json::from_str(&place.run(&["schema", "g.ron"]).done().out).expect("JSON");
    assert_eq!(file["nodes"]["plain"], json!({ "Constant": { "value": 700 } }));
    assert_eq!(file["outputs"]["picture"], "relief.colour");
    place.write("bad.ron", "(nodes: {");
    place.run(&["schema", "bad.ron"]).ended(1, &["is not closed"]);
}
