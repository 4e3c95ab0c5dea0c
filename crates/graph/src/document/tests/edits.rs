//! Tests of edits: written text, refusals, undo.

use proptest::prelude::*;

use super::*;
use crate::{Boundary, Edge, GeoPlace, ParamValue};

/// The example with a comment in every possible place.
const COMMENTED: &str = r#"// start
( // root
    format: 1, // one
    /* before */ world: (size: (16384, 16384) /* size */, seed: 7), // world
    // nodes
    nodes: { // open
        "base":   Ridged(wavelength: 6000, /* octaves */ octaves: 12), // base
        // rivers
        "rivers": StreamPower(
            // from the base
            height: "base", // wire
            erodibility: 4e-6, // rocks
            duration: 2e6 // years
            // last
        ), // rivers
        "scree":  Thermal(version: 3, height: "rivers.height", talus: 33), /* scree */
        // end of nodes
    },
    outputs: { "height": "scree", /* flow */ "flow": "rivers.area" }, // outputs
    layout: { "base": (0, 0), "rivers": (240, 80) }, // layout
    // end
)
// after
"#;

/// Lines that an edit removed and added.
fn changed(edit: Edit) -> (Vec<String>, Vec<String>) {
    let mut document = parse(COMMENTED);
    document.apply(&edit).unwrap_or_else(|error| panic!("{edit:?}: {error}"));
    let after = document.source().to_owned();
    let lines = |text: &str, other: &str| {
        text.lines().filter(|line| !other.lines().any(|o| o == *line)).map(|l| l.trim().to_owned()).collect::<Vec<_>>()
    };
    assert!(document.undo());
    assert_eq!(document.source(), COMMENTED);
    (lines(COMMENTED, &after), lines(&after, COMMENTED))
}

fn one(edit: Edit) -> String {
    let (_, added) = changed(edit.clone());
    assert_eq!(added.len(), 1, "{edit:?}: {added:?}");
    added.into_iter().next().unwrap_or_default()
}

fn text(node: &str, name: &str, text: &str) -> Edit {
    Edit::SetText { node: node.into(), name: name.into(), text: text.into() }
}

#[test]
fn an_edit_changes_one_place() {
    let set = |param: &str, value| Edit::SetParam { node: "base".into(), param: param.into(), value };
    assert_eq!(
        one(set("octaves", ParamValue::Int(5))),
        r#""base":   Ridged(wavelength: 6000, /* octaves */ octaves: 5), // base"#
    );
    assert_eq!(
        one(set("octaves", ParamValue::Int(8))),
        r#""base":   Ridged(wavelength: 6000, /* octaves */), // base"#,
        "the default is not written"
    );
    assert_eq!(
        one(set("shape", ParamValue::Choice("billow"))),
        r#""base":   Ridged(wavelength: 6000, /* octaves */ octaves: 12, shape: billow), // base"#
    );
    assert_eq!(
        one(set("wavelength", ParamValue::Float(8000.0))),
        r#""base":   Ridged(/* octaves */ octaves: 12), // base"#
    );
    assert_eq!(
        changed(text("rivers", "mask", "0.5")),
        (vec!["duration: 2e6 // years".into()], vec!["duration: 2e6, // years".into(), "mask: 0.5,".into()])
    );
    assert_eq!(
        changed(text("rivers", "duration", "3 Myr")),
        (vec!["duration: 2e6 // years".into()], vec![r#"duration: "3 Myr" // years"#.into()])
    );
    assert_eq!(
        changed(Edit::Reset { node: "rivers".into(), name: "erodibility".into() }),
        (vec!["erodibility: 4e-6, // rocks".into()], vec!["// rocks".into()])
    );
    assert_eq!(
        one(Edit::Connect { from: "base.height".into(), to: "scree".into(), input: "height".into() }),
        r#""scree":  Thermal(version: 3, height: "base", talus: 33), /* scree */"#
    );
    assert_eq!(
        one(Edit::SetConstant { node: "scree".into(), input: "talus".into(), value: 35.0 }),
        r#""scree":  Thermal(version: 3, height: "rivers.height"), /* scree */"#
    );
    assert_eq!(
        one(Edit::SetOutput { name: "rock".into(), from: "base".into() }),
        r#"outputs: { "height": "scree", /* flow */ "flow": "rivers.area", "rock": "base" }, // outputs"#
    );
    assert_eq!(
        one(Edit::RemoveOutput { name: "height".into() }),
        r#"outputs: { /* flow */ "flow": "rivers.area" }, // outputs"#
    );
    assert_eq!(one(Edit::SetLayout { node: "rivers".into(), at: None }), r#"layout: { "base": (0, 0) }, // layout"#);
    assert_eq!(
        one(Edit::AddNode { name: "x".into(), kind: "Thermal".into(), at: None }),
        r#""x":      Thermal(version: 3),"#
    );
}

#[test]
fn wires_outputs_and_positions_follow_a_node() {
    let (_, added) = changed(Edit::RenameNode { from: "rivers".into(), to: "water".into() });
    assert_eq!(
        added,
        [
            r#""water": StreamPower("#,
            r#""scree":  Thermal(version: 3, height: "water.height", talus: 33), /* scree */"#,
            r#"outputs: { "height": "scree", /* flow */ "flow": "water.area" }, // outputs"#,
            r#"layout: { "base": (0, 0), "water": (240, 80) }, // layout"#,
        ]
    );
    let mut document = parse(COMMENTED);
    document.apply(&Edit::RemoveNode { name: "rivers".into() }).expect("removed");
    let codes: Vec<_> = document.problems().iter().map(|p| p.code).collect();
    assert_eq!(codes, ["unwired"], "what it fed lacks a wire, nothing else is wrong");
    assert_eq!(document.outputs().len(), 1);
    for comment in ["// start", "// root", "/* before */", "// base", "        // rivers\n", "/* flow */", "// after"] {
        assert!(document.source().contains(comment), "{comment} is gone:\n{}", document.source());
    }
}

#[test]
fn the_world_changes_where_it_differs() {
    let world = parse(COMMENTED).world();
    assert_eq!(
        one(Edit::SetWorld(World { seed: 0, ..world })),
        "/* before */ world: (size: (16384, 16384) /* size */), // world"
    );
    assert_eq!(
        one(Edit::SetWorld(World { cells: [512, 512], boundary: Boundary::all(Edge::Wall), ..world })),
        "/* before */ world: (size: (16384, 16384) /* size */, seed: 7, boundary: wall, cells: (512, 512)), // world"
    );
    let wide = World { size: [8000.0, 4000.0], cells: [200, 100], ..world };
    for source in [COMMENTED, "(nodes: {})", "(world: (cells: 64), nodes: {})", "(world: (size: \"2 km\"), nodes: {})"]
    {
        let mut document = parse(source);
        document.apply(&Edit::SetWorld(wide)).expect("fits");
        assert_eq!(document.world(), wide, "{}", document.source());
        document.apply(&Edit::SetWorld(World::default())).expect("fits");
        assert_eq!(document.world(), World::default(), "{}", document.source());
    }
    let none = World { cells: [0, 0], ..world };
    assert!(parse(COMMENTED).apply(&Edit::SetWorld(none)).is_err());
}

#[test]
fn a_graph_is_made_from_nothing() {
    let mut document = Document::empty(&registry());
    for edit in [
        Edit::AddNode { name: "base".into(), kind: "Ridged".into(), at: Some([0.0, 0.0]) },
        Edit::AddNode { name: "talus".into(), kind: "Thermal".into(), at: Some([240.0, 0.0]) },
        Edit::Connect { from: "base".into(), to: "talus".into(), input: "height".into() },
        text("talus", "talus", "30deg"),
        text("base", "centre", "(1, 2)"),
        text("base", "file", "a b.tif"),
        Edit::SetOutput { name: "height".into(), from: "talus".into() },
    ] {
        document.apply(&edit).unwrap_or_else(|error| panic!("{edit:?}: {error}"));
    }
    assert_eq!(document.problems(), []);
    assert_eq!(
        document.source(),
        r#"(
    format: 1,
    world: (boundary: inland),
    nodes: {
        "base": Ridged(centre: (1, 2), file: "a b.tif"),
        "talus": Thermal(version: 3, height: "base", talus: "30deg"),
    },
    layout: { "base": (0, 0), "talus": (240, 0) },
    outputs: { "height": "talus" },
)
"#
    );
}

#[test]
fn invalid_edits_are_refused() {
    let refused = |edit: Edit| {
        let mut document = parse(COMMENTED);
        let error = document.apply(&edit).expect_err("refused").to_string();
        assert_eq!(document.source(), COMMENTED, "{edit:?}");
        assert!(!document.can_undo());
        error
    };
    let connect = |from: &str, to: &str| Edit::Connect { from: from.into(), to: to.into(), input: "height".into() };
    assert!(refused(connect("scree", "rivers")).contains("cycle: rivers → scree → rivers"));
    assert!(refused(connect("base.slope", "scree")).contains("gives a scalar (°)"));
    assert!(refused(connect("bse", "scree")).contains("did you mean `base`?"));
    assert!(refused(text("base", "octaves", "99")).contains("from 1 to 24"));
    assert!(refused(text("base", "wavelength", "2 yr")).contains("not a unit of a length"));
    assert!(refused(text("base", "shape", "round")).contains("one of `sharp`, `billow`"));
    assert!(refused(text("base", "wavelenght", "2 km")).contains("did you mean `wavelength`?"));
    assert!(refused(text("scree", "version", "2")).contains("no input or parameter `version`"));
    assert!(refused(text("bace", "wavelength", "2 km")).contains("did you mean `base`?"));
    assert!(refused(Edit::AddNode { name: "base".into(), kind: "Ridged".into(), at: None }).contains("already"));
    assert!(refused(Edit::AddNode { name: "b".into(), kind: "Rigded".into(), at: None }).contains("`Ridged`"));
    assert!(refused(Edit::AddNode { name: "b\"".into(), kind: "Ridged".into(), at: None }).contains("cannot name"));
    assert!(refused(Edit::RenameNode { from: "base".into(), to: "scree".into() }).contains("already"));
    assert!(refused(Edit::RenameNode { from: "base".into(), to: "a.b".into() }).contains("cannot name"));
    assert!(refused(Edit::RemoveOutput { name: "rock".into() }).contains("no output `rock`"));
    let both = Edit::All(vec![text("base", "octaves", "5"), text("base", "octaves", "99")]);
    assert!(refused(both).contains("from 1 to 24"));
    let mut broken = parse("(nodes: {)");
    assert!(matches!(broken.apply(&text("a", "b", "1")), Err(EditError::Notation(_))));
}

#[test]
fn placeholders_are_kept_and_older_nodes_are_migrated() {
    let source = r#"(
    nodes: {
        "a": Ridged,
        "b": Volcano(lava: "a", depth: [1, { "x": (y: 'c') }]),
        "c": Thermal(height: "a", angle: 30, gpu: true /* ? */, share: 20),
    },
    outputs: { "o": "c" },
)"#
    .replace("'c'", "\"a\"");
    let mut document = parse(&source);
    let codes: Vec<_> = document.problems().iter().map(|problem| problem.code).collect();
    assert_eq!(codes, ["unknown-node", "no-version"]);
    assert!(document.nodes()[1].index.is_none());
    document.apply(&Edit::RenameNode { from: "a".into(), to: "base".into() }).expect("renamed");
    assert!(
        document.source().contains(r#"Volcano(lava: "base", depth: [1, { "x": (y: "a") }])"#),
        "{}",
        document.source()
    );
    assert!(matches!(document.apply(&text("b", "lava", "1")), Err(EditError::Placeholder(_))));
    document.apply(&text("c", "talus", "33")).expect("set");
    assert!(
        document.source().contains(r#"Thermal(height: "base", talus: 33, /* ? */ share: 0.2, version: 3, passes: 40)"#),
        "{}",
        document.source()
    );
    document.apply(&text("base", "octaves", "5")).expect("brackets are added");
    assert!(document.source().contains(r#""base": Ridged(octaves: 5),"#));
}

/// Any edit, of names that exist and of names that do not.
fn any_edit() -> impl Strategy<Value = Edit> {
    let node = || prop::sample::select(vec!["base", "rivers", "scree", "new", "other", "zzz"]).prop_map(str::to_owned);
    let name = || {
        prop::sample::select(vec!["height", "octaves", "wavelength", "talus", "mask", "duration", "shape", "profile"])
            .prop_map(str::to_owned)
    };
    let kind =
        prop::sample::select(vec!["Ridged", "StreamPower", "Thermal", "Metrics", "Nope"]).prop_map(str::to_owned);
    let wire = prop::sample::select(vec!["base", "base.slope", "rivers.height", "scree", "new", "rivers.area"])
        .prop_map(str::to_owned);
    let typed = prop::sample::select(vec![
        "3",
        "0.5",
        "2 km",
        "billow",
        "\"base\"",
        "rivers",
        "[(0, 0), (1, 2)]",
        "8",
        "é\"\\",
        "",
    ])
    .prop_map(str::to_owned);
    let measure = prop::sample::select(vec!["relief", "slope.p50", "cell", "in", "height"]).prop_map(str::to_owned);
    let at = prop::option::of((-1000..1000_i32, 0..1000_i32).prop_map(|(x, y)| [f64::from(x), f64::from(y) / 4.0]));
    let leaf = prop_oneof![
        (node(), kind, at.clone()).prop_map(|(name, kind, at)| Edit::AddNode { name, kind, at }),
        node().prop_map(|name| Edit::RemoveNode { name }),
        (node(), node()).prop_map(|(from, to)| Edit::RenameNode { from, to }),
        (node(), name(), typed.clone()).prop_map(|(node, name, text)| Edit::SetText { node, name, text }),
        (node(), name()).prop_map(|(node, name)| Edit::Reset { node, name }),
        (measure, prop::collection::vec(prop::option::of(typed), 0..3))
            .prop_map(|(name, values)| Edit::SetExpected { name, values }),
        (wire.clone(), node(), name()).prop_map(|(from, to, input)| Edit::Connect { from, to, input }),
        (node(), name(), 0.0..80.0_f64).prop_map(|(node, input, value)| Edit::SetConstant { node, input, value }),
        (node(), wire).prop_map(|(name, from)| Edit::SetOutput { name, from }),
        node().prop_map(|name| Edit::RemoveOutput { name }),
        (node(), node()).prop_map(|(from, to)| Edit::RenameOutput { from, to }),
        (1..4_u32, 1..4_u32, 0..3_u32, 0..4_usize, prop::option::of(-9.0..9.0_f64), prop::option::of(1..4_u32))
            .prop_map(|(x, y, seed, edge, sea_level, zone)| {
                let (size, cells) = ([f64::from(x) * 1000.0, f64::from(y) * 1000.0], [x * 64, y * 64]);
                let boundary = Boundary::all(Edge::NAMES[edge].1);
                let place = zone.map(|zone| GeoPlace { epsg: 32_600 + zone, corner_m: [f64::from(zone), -7.5] });
                Edit::SetWorld(World { size, cells, seed, boundary, sea_level, place })
            }),
        (node(), at).prop_map(|(node, at)| Edit::SetLayout { node, at }),
    ];
    prop_oneof![9 => leaf.clone(), 1 => prop::collection::vec(leaf, 0..4).prop_map(Edit::All)]
}

fn comments(source: &str) -> Vec<String> {
    crate::document::syntax::lex::lex(source).comments.into_iter().map(|c| source[c.span].to_owned()).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn undo_restores_every_byte(
        edits in prop::collection::vec(any_edit(), 1..12),
        start in prop::sample::select(vec![COMMENTED, ALPS, "(nodes:{\"base\":Ridged})"]),
        crlf: bool,
    ) {
        let start = if crlf { start.replace('\n', "\r\n") } else { start.to_owned() };
        let mut document = parse(&start);
        let mut states = vec![start];
        for edit in &edits {
            let before = comments(document.source());
            if document.apply(edit).is_ok() {
                prop_assert!(document.problems().iter().all(|p| p.code != "syntax"), "{edit:?}\n{}", document.source());
                let again = Document::parse(document.source(), &registry());
                prop_assert_eq!(again.problems(), document.problems());
                prop_assert!(ron2::ast::parse_document(document.source()).is_ok(), "{}", document.source());
                if document.source() != states[states.len() - 1] {
                    states.push(document.source().to_owned());
                }
                // Comments around what an edit removes stay; those inside a removed node go with it.
                let removes = format!("{edit:?}").contains("RemoveNode");
                if !removes {
                    prop_assert_eq!(comments(document.source()), before, "{:?}", edit);
                }
            } else {
                prop_assert_eq!(document.source(), &states[states.len() - 1]);
            }
        }
        for state in states.iter().rev().skip(1) {
            prop_assert!(document.undo());
            prop_assert_eq!(document.source(), state);
        }
        prop_assert!(!document.undo());
        for state in states.iter().skip(1) {
            prop_assert!(document.redo());
            prop_assert_eq!(document.source(), state);
        }
        prop_assert!(!document.redo());
    }
}
