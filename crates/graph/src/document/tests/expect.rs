//! Tests of `expect`: what is read, what is refused, and that edits keep it.

use super::*;

/// A file with these fields of `expect`, and these outputs.
fn file(expect: &str, outputs: &str) -> Document {
    parse(&format!(
        "(world: (size: \"16 km\", cells: 64), nodes: {{ \"a\": Ridged, \"b\": Ridged }}, \
         outputs: {{ {outputs} }}, expect: {{ {expect} }})"
    ))
}

/// The problems of a file that expects this, each with its hint.
fn problems(expect: &str) -> Vec<String> {
    let document = file(expect, "\"height\": \"a\"");
    let said = |p: &Diagnostic| {
        let marked = &document.source()[p.span.clone()];
        format!("{marked}: {}; {}", p.message, p.hint.as_deref().unwrap_or("–"))
    };
    document.problems().iter().map(said).collect()
}

#[test]
fn bounds_are_read_in_the_unit_of_the_measure() {
    let document = file(
        r#""in": ("1 km", 0, 8000, "8 km"), "cell": "250 m", "relief": ("1 km", inf), "slope.p50": (-inf, "0.5 rad"),
        "hypsometric_integral": ("40 %", 0.6), "drainage_density": (0.5, 2)"#,
        "\"height\": \"a\"",
    );
    assert_eq!(document.problems(), []);
    let found = document.expectations().expect("the file expects something");
    assert_eq!(found.output.as_deref(), Some("height"));
    assert_eq!((found.part_m, found.cell_m), (Some([1000.0, 0.0, 8000.0, 8000.0]), Some(250.0)));
    let texts: Vec<_> = found.list.iter().map(|one| format!("{} {}", one.measure.name, one.bounds_text())).collect();
    assert_eq!(
        texts,
        [
            "relief at least 1 km",
            "slope.p50 at most 28.6479°",
            "hypsometric_integral 0.4 to 0.6",
            "drainage_density 0.5 km/km² to 2 km/km²"
        ]
    );
    let (relief, integral) = (found.list[0], found.list[2]);
    assert!(relief.holds(1000.0) && !relief.holds(999.9) && !relief.holds(f64::NAN));
    assert_eq!(integral.display(0.512_345), "0.5123");
    assert_eq!(integral.display(0.600_01), "0.60001", "a miss does not look like a hit");
    assert_eq!((relief.display(1234.56).as_str(), relief.display(f64::NAN).as_str()), ("1.235 km", "undefined"));
}

#[test]
fn the_measured_output_is_height_or_the_only_height() {
    let output = |outputs: &str| {
        let document = file("\"relief\": (0, 1)", outputs);
        let problems: Vec<_> = document.problems().iter().map(|p| p.message.clone()).collect();
        (document.expectations().and_then(|found| found.output.clone()), problems, document.has_errors())
    };
    assert_eq!(output("\"x\": \"a\", \"height\": \"b\""), (Some("height".into()), vec![], false));
    assert_eq!(output("\"x\": \"a\", \"height\": \"b.slope\""), (Some("x".into()), vec![], false));
    for (outputs, said) in [
        ("\"x\": \"a\", \"y\": \"b\"", "may be about any of `x`, `y`"),
        ("\"x\": \"a.slope\"", "no output is a height"),
    ] {
        let (found, problems, has_errors) = output(outputs);
        assert!(found.is_none() && problems.len() == 1 && problems[0].contains(said) && !has_errors, "{problems:?}");
    }
    assert_eq!(output("").1, ["the file has no outputs, so a run writes nothing"]);
}

#[test]
fn what_cannot_be_expected_is_refused_with_a_remedy() {
    for (expect, said) in [
        (r#""relif": (0, 1)"#, r#""relif": there is no measure `relif`; did you mean `relief`?"#),
        (r#""slope": (0, 1)"#, r#""slope": there is no measure `slope`; did you mean `slope.p50`?"#),
        (r#""beauty": (0, 1)"#, "`orograph nodes Metrics` lists the measures"),
        (
            r#""relief": 3"#,
            "3: `relief` is the number `3`, but takes a lowest and a highest figure; write `(0.4, 0.6)`",
        ),
        (r#""relief": (0, 1, 2)"#, "is 3 items in round brackets"),
        (
            r#""relief": ("3 km", "1 km")"#,
            r#"the lowest figure of `relief` is above the highest; write `("1 km", "3 km")`"#,
        ),
        (r#""relief": ("3 yr", 9)"#, "`yr` is not a unit of a length in m"),
        (r#""drainage_density": ("2 km", 9)"#, "takes a number of km/km²; write the number alone"),
        (r#""relief": (NaN, 9)"#, "`relief` is not a number (NaN)"),
        (r#""relief": (inf, inf)"#, "no figure of `relief` lies within these bounds"),
        (r#""relief": (max, 9)"#, "`relief` is the word `max`"),
        (r#""relief": (0, 1), "in": (0, 0, 0, 5)"#, "`in` has no extent"),
        (r#""relief": (0, 1), "in": (0, 0, 5)"#, "takes a position and an extent"),
        (
            r#""relief": (0, 1), "in": ("12 km", 0, "5 km", "5 km")"#,
            "`in` from (12 km, 0 m) to (17 km, 5 km) is not within the world of 16 km x 16 km",
        ),
        (r#""relief": (0, 1), "in": (-1, 0, 5, 5)"#, "is not within the world"),
        (r#""relief": (0, 1), "cell": 0"#, "`cell` is 0 m, but must be above zero"),
        (r#""relief": (0, 1), "cell": "20 km""#, "`cell` is 20 km, but the part that is measured has only 16 km"),
        (r#""relief": (0, 1), "in": (0, 0, 90, 200), "cell": 100"#, "has only 90 m"),
        (r#""relief": (0, 1), "cell": (1, 2)"#, "`cell` is 2 items in round brackets"),
        (r#""relief": (0, 1), "relief": (0, 2)"#, "`relief` appears twice in `expect`"),
    ] {
        let found = problems(expect);
        assert!(found.len() == 1 && found[0].contains(said), "{expect}: {found:?}");
    }
    assert_eq!(parse("(nodes: {}, outputs: { }, expect: 3)").problems().len(), 2);
    // the size of the world is unknown
    let document = parse(
        "(world: (size: -1), nodes: { \"a\": Ridged }, outputs: { \"h\": \"a\" }, expect: { \"relief\": (0, 1), \"in\": (0, 0, 9e9, 9) })",
    );
    assert_eq!(document.problems().len(), 1, "{:?}", document.problems());
}

#[test]
fn edits_keep_what_is_expected() {
    let mut document = parse(ALPS);
    let build = document.build();
    let section = "expect: { \"cell\": \"90 m\", \"relief\": (\"2 km\", inf), \"slope.p50\": (23, 32) },\n";
    let edits = [
        Edit::RenameOutput { from: "height".into(), to: "land".into() },
        Edit::RenameNode { from: "scree".into(), to: "talus".into() },
        Edit::RemoveOutput { name: "land".into() },
    ];
    for edit in &edits {
        document.apply(edit).expect("is possible");
        assert!(document.source().contains(section) && !document.has_errors());
        let output = document.expectations().and_then(|found| found.output.as_deref());
        assert_eq!(output, (document.outputs().len() == 3).then_some("land"));
    }
    edits.iter().for_each(|_| assert!(document.undo()));
    assert_eq!(document.source(), ALPS);
    let expected = document.expectations().cloned();
    let other = parse(&ALPS.replace("(23, 32)", "(20, 32)"));
    assert_ne!(other.expectations().cloned(), expected);
    // a world that lacks the measured part is refused
    let with_part = ALPS.replace("\"cell\": \"90 m\"", "\"in\": (0, 0, 16384, 16384)");
    let mut document = parse(&with_part);
    let small = World { size: [8192.0, 8192.0], ..document.world() };
    let refused = document.apply(&Edit::SetWorld(small)).expect_err("the part is outside").to_string();
    assert!(refused.contains("is not within the world of 8.192 km x 8.192 km"), "{refused}");
    assert!(document.source() == with_part && document.build() != build);
}

#[test]
fn expectations_are_added_changed_and_removed_in_place() {
    let mut document = parse("(\n    nodes: { \"a\": Ridged },\n    outputs: { \"height\": \"a\" },\n)\n");
    let start = document.source().to_owned();
    let edit = |name: &str, values: &[Option<&str>]| Edit::SetExpected {
        name: name.into(),
        values: values.iter().map(|value| value.map(str::to_owned)).collect(),
    };
    let listed = |document: &Document| document.expectations().map(|found| found.list.len());
    document.apply(&edit("relief", &[Some("2 km"), Some("")])).expect("is possible");
    assert!(document.source().contains(r#"expect: { "relief": ("2 km", inf) }"#), "{}", document.source());
    // the other bound stays as it is written
    document.apply(&edit("relief", &[None, Some("3500")])).expect("is possible");
    document.apply(&edit("slope.p50", &[Some(" "), Some("0.5 rad")])).expect("is possible");
    document.apply(&edit("cell", &[Some("90 m")])).expect("is possible");
    document.apply(&edit("in", &["0", "1 km", "2 km", "2 km"].map(Some))).expect("is possible");
    let text = r#""relief": ("2 km", 3500), "slope.p50": (-inf, "0.5 rad"), "cell": "90 m", "in": (0, "1 km", "2 km", "2 km")"#;
    assert!(document.source().contains(text), "{}", document.source());
    let expected = document.expectations().expect("expectations");
    assert_eq!(expected.list[0].typed(), ["2 km", "3.5 km"]);
    assert_eq!((expected.list[1].typed()[0].as_str(), expected.cell_m), ("", Some(90.0)));
    for (name, values, said) in [
        ("releif", &[Some("1"), Some("2")][..], "did you mean `relief`?"),
        ("relief", &[Some("4 km"), None], "the lowest figure of `relief` is above the highest"),
        ("relief", &[Some("4 years"), None], "is not a unit of a length"),
        ("relief", &[Some("1"), Some("2"), Some("3")], "takes a lowest and a highest figure"),
        ("cell", &[Some("-3")], "must be above zero"),
        ("spectrum.beta", &[], "no entry `spectrum.beta`"),
    ] {
        let before = document.source().to_owned();
        let refused = document.apply(&edit(name, values)).expect_err(said).to_string();
        assert!(refused.contains(said) && document.source() == before, "{refused}");
    }
    // typed text cannot leave its place
    assert!(document.apply(&edit("relief", &[Some("1), \"x\": (2"), None])).is_err());
    for name in ["relief", "slope.p50", "in", "cell"] {
        document.apply(&edit(name, &[])).expect("is possible");
    }
    assert_eq!((document.source(), listed(&document)), (start.as_str(), None));
    (0..4).for_each(|_| assert!(document.undo()));
    assert_eq!(listed(&document), Some(2));
}

#[test]
fn only_the_file_itself_is_expected_to_hold() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("alps.ron"), ALPS).expect("written");
    let source = "(nodes: { \"a\": Subgraph(file: \"alps.ron\") }, outputs: { \"height\": \"a\" })";
    let document = Document::parse_in(source, folder.path(), &registry());
    assert_eq!(document.problems(), []);
    assert!(document.expectations().is_none());
}

#[test]
fn changes_of_different_measures_are_merged() {
    let mine = parse(&ALPS.replace("(\"2 km\", inf)", "(\"1 km\", inf)"));
    let theirs = ALPS.replace("(23, 32)", "(20, 32)");
    let merged = mine.merge(ALPS, &theirs).expect("no conflict");
    assert!(merged.contains("\"relief\": (\"1 km\", inf), \"slope.p50\": (20, 32)"), "{merged}");
    assert!(mine.merge(ALPS, &ALPS.replace("(\"2 km\", inf)", "(\"3 km\", inf)")).is_err());
}
