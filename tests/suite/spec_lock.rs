//! The lock of declarations: the meaning of a file must never change for a given version of a node.
//!
//! `golden/specs.txt` contains every declaration of every version so far. A file contains only values that differ from
//! the default, so a default, range or port may change only together with the version, and then with a migration.

use std::{collections::BTreeMap, fmt::Write as _};

use orograph_graph::{Fallback, Kind, Node, OutputType};
use orograph_nodes::registry;
use orograph_tests::{blessing, golden_folder, write_golden};

const LOCK: &str = "specs.txt";

/// Everything of a declaration that affects the meaning of a file, one line each.
fn declaration(node: &Node) -> Vec<String> {
    let mut lines = Vec::new();
    for alias in node.aliases {
        lines.push(format!("alias {alias}"));
    }
    for input in node.inputs {
        let fallback = match input.fallback {
            Fallback::Required => "required".to_owned(),
            Fallback::None => "optional".to_owned(),
            Fallback::Constant { default, hard, .. } => format!("{default} in {hard:?}"),
        };
        lines.push(format!("input {}: {:?}, {fallback}", input.name, input.ty));
    }
    for spec in node.specs() {
        let kind = match &spec.kind {
            Kind::Float { default, hard, .. } => format!("{default} in {hard:?}"),
            Kind::Int { default, hard, .. } => format!("{default} in {hard:?}"),
            Kind::Bool { default } => format!("{default}"),
            Kind::Choice { default, options } => {
                let names: Vec<&str> = options.iter().map(|(name, _)| *name).collect();
                format!("{default} of {}", names.join("|"))
            }
            Kind::Seed { default } => format!("seed {default}"),
            Kind::Point { default, hard, .. } => format!("{default:?} in {hard:?}"),
            Kind::Curve { default, .. } => format!("curve {default:?}"),
            Kind::Path { default, hard, .. } => format!("path {default:?} in {hard:?}"),
            Kind::Waypoints { default, hard } => {
                let points = default.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
                format!("points [{points}] in {hard:?}")
            }
            Kind::Stops { default } => {
                format!("stops {}", default.iter().map(ToString::to_string).collect::<Vec<_>>().join(" "))
            }
            Kind::Layers { default } => format!("layers, by default {default:?}"),
            Kind::Strokes { hard, timed: false } => format!("strokes in {hard:?}"),
            Kind::Strokes { hard, timed: true } => format!("timed strokes in {hard:?}"),
            Kind::File => "file".to_owned(),
        };
        lines.push(format!("param {} [{:?}]: {kind}", spec.name, spec.unit));
    }
    for output in node.outputs {
        let ty = match output.ty {
            OutputType::Fixed(ty) => format!("{ty:?}"),
            OutputType::SameAs(input) => format!("as {input}"),
            OutputType::Chosen(_) => "by parameters".to_owned(),
        };
        lines.push(format!("output {}: {ty}", output.name));
    }
    lines
}

type Lock = BTreeMap<String, Vec<String>>;

fn read_lock(text: &str) -> Lock {
    let mut lock = Lock::new();
    let mut head = String::new();
    for line in text.lines() {
        if let Some(detail) = line.strip_prefix("  ") {
            lock.entry(head.clone()).or_default().push(detail.to_owned());
        } else if !line.is_empty() {
            head = line.to_owned();
            lock.entry(head.clone()).or_default();
        }
    }
    lock
}

/// Returns true if a declaration has everything that was locked, and beyond it only optional inputs, outputs, and more
/// options at the end of a choice: without wires to them and values for them, files mean what they meant. An input that
/// was required may become optional, because every file has a wire into it.
fn only_grows(locked: &[String], now: &[String]) -> bool {
    let is_new_port =
        |line: &String| line.starts_with("output ") || line.starts_with("input ") && line.ends_with(", optional");
    let grows = |before: &String, line: &String| {
        let is_freed = before.strip_suffix("required").is_some_and(|rest| line.strip_suffix("optional") == Some(rest));
        let more = line.strip_prefix(before.as_str());
        is_freed || more.is_some_and(|more| more.is_empty() || before.contains(" of ") && more.starts_with('|'))
    };
    locked.iter().all(|before| now.iter().any(|line| grows(before, line)))
        && now.iter().all(|line| locked.iter().any(|before| grows(before, line)) || is_new_port(line))
}

#[test]
fn a_declaration_changes_only_with_its_version() {
    let mut lock = read_lock(&std::fs::read_to_string(golden_folder().join(LOCK)).unwrap_or_default());
    let mut problems = Vec::new();
    let mut grown = false;
    for node in registry().nodes() {
        let key = format!("{} v{}", node.id, node.version);
        let now = declaration(node);
        match lock.get(&key) {
            Some(locked) if *locked == now => {}
            Some(locked) if only_grows(locked, &now) => {
                grown = true;
                lock.insert(key, now);
            }
            Some(locked) => {
                let differing: Vec<&String> = now
                    .iter()
                    .filter(|l| !locked.contains(l))
                    .chain(locked.iter().filter(|l| !now.contains(l)))
                    .collect();
                problems.push(format!("{key} has changed: {differing:#?}\nincrease its version and add a migration"));
            }
            None => {
                grown = true;
                lock.insert(key, now);
            }
        }
    }
    assert!(problems.is_empty(), "\n{}", problems.join("\n"));
    if blessing() {
        let mut text = String::new();
        for (key, lines) in &lock {
            writeln!(text, "{key}").expect("writing to memory");
            for line in lines {
                writeln!(text, "  {line}").expect("writing to memory");
            }
        }
        write_golden(LOCK, text.as_bytes());
    } else {
        assert!(!grown, "there is a new node, version or port; run `cargo bless` to lock its declaration");
    }
}

#[test]
fn nothing_that_was_locked_is_gone() {
    let lock = read_lock(&std::fs::read_to_string(golden_folder().join(LOCK)).unwrap_or_default());
    let registry = registry();
    for key in lock.keys() {
        let id = key.split(' ').next().expect("a key has an id");
        assert!(registry.get(id).is_some(), "{id} is gone; keep its id as an alias of its replacement");
    }
}
