//! The sea level of a file, and that of nodes that once had their own.

use super::*;

/// A file with a world and nodes, one of which is `base`.
fn file(world: &str, nodes: &str) -> Document {
    parse(&format!(r#"({world}nodes: {{ "base": Ridged, {nodes} }}, outputs: {{ "o": "base" }})"#))
}

#[track_caller]
fn problem(document: &Document) -> String {
    match document.problems() {
        [one] => format!("{}; {}", one.message, one.hint.as_deref().unwrap_or("")),
        other => panic!("{other:?}"),
    }
}

/// The sea level of a file without problems.
#[track_caller]
fn sea(world: &str, nodes: &str) -> Option<f64> {
    let document = file(world, nodes);
    assert_eq!(document.problems(), []);
    document.world().sea_level
}

#[test]
fn the_world_has_a_sea_level() {
    assert_eq!(sea("", ""), None);
    assert_eq!(sea("world: (seed: 3), ", ""), None);
    for (text, level) in [("0", 0.0), ("\"0 m\"", 0.0), ("-12.5", -12.5), ("\"-1 km\"", -1000.0), ("12e3", 12e3)] {
        assert_eq!(sea(&format!("world: (sea_level: {text}), "), ""), Some(level), "{text}");
    }
}

#[test]
fn invalid_sea_levels_are_refused() {
    for (text, told) in [
        ("NaN", "`sea_level` is not a number (NaN); write a finite number"),
        ("inf", "infinite"),
        ("12000.1", "`sea_level` is 12.0001 km, but must be a length from -12 km to 12 km; leave it out"),
        ("\"-13 km\"", "`sea_level` is -13 km"),
        ("\"2 yr\"", "is not a unit of a length"),
        ("\"high\"", "cannot be read"),
        ("none", "`sea_level` is the word `none`, but takes a length; write `sea_level: \"0 m\"`, or leave it out"),
        ("(0, 1)", "but takes a length"),
        ("[]", "but takes a length"),
        ("true", "but takes a length"),
    ] {
        let document = file(&format!("world: (seed: 3, sea_level: {text}), "), "");
        assert!(problem(&document).contains(told), "{text}: {}", problem(&document));
        assert_eq!((document.world().sea_level, document.world().seed), (None, 3), "{text}");
    }
    assert!(problem(&file("world: (sealevel: 0), ", "")).contains("did you mean `sea_level`?"));
}

#[test]
fn the_sea_of_an_older_node_becomes_the_worlds() {
    let coast = r#""a": Coast(height: "base", "#;
    assert_eq!(sea("", &format!("{coast}version: 1, water: \"50 m\")")), Some(50.0));
    assert_eq!(sea("", &format!("{coast}version: 2, sea_level: -3)")), Some(-3.0));
    assert_eq!(sea("", &format!("{coast}version: 2, sea_level: -12000)")), None, "its word for no sea");
    assert_eq!(sea("", &format!("{coast}version: 2)")), None);
    // nodes that agree with each other and with the world
    let two = format!(r#"{coast}version: 2, sea_level: 50), "b": Coast(version: 1, height: "a", water: 50)"#);
    assert_eq!(sea("", &two), Some(50.0));
    assert_eq!(sea("world: (sea_level: \"0.05 km\"), ", &two), Some(50.0));
    // a node without its own level takes the world's
    assert_eq!(sea("world: (sea_level: 7), ", &format!("{coast}version: 3)")), Some(7.0));
    assert_eq!(sea("world: (sea_level: 7), ", &format!("{coast}version: 1, slope: 0.2)")), Some(7.0));
}

#[test]
fn seas_that_disagree_are_reported() {
    let coast = |name: &str, text: &str| format!(r#""{name}": Coast(height: "base", {text}), "#);
    let told = |world: &str, texts: [&str; 2]| problem(&file(world, &(coast("a", texts[0]) + &coast("b", texts[1]))));
    assert_eq!(
        told("", ["version: 1, water: 50", "version: 1, water: 60"]),
        "`a` has a sea at 50 m and `b` has a sea at 60 m, but a world has one sea; write its level into `world` as \
         `sea_level`, and remove it from the nodes"
    );
    assert!(
        told("", ["version: 1, slope: 0.2", "version: 1, water: 60"])
            .starts_with("`b` has a sea at 60 m and `a` has no sea, but")
    );
    assert!(
        told("", ["version: 3", "version: 1, water: 60"]).contains("`a` has no sea"),
        "written for a world without one"
    );
    assert_eq!(
        told("world: (sea_level: 0), ", ["version: 1, slope: 0.2", "version: 1, water: 60"]),
        "`b` has a sea at 60 m, but the world's `sea_level` is a sea at 0 m; remove it from the node; a world has one sea"
    );
    // the world's own mistake is reported once
    assert!(told("world: (sea_level: NaN), ", ["version: 1, water: 50", "version: 1, water: 60"]).contains("NaN"));
    let bad = file("", r#""a": Coast(version: 1, height: "base", water: "deep")"#);
    assert!(problem(&bad).contains("`a.sea_level` cannot be read"), "{}", problem(&bad));
    let gone = file("", r#""a": Coast(height: "base", version: 3, sea_level: 5)"#);
    assert!(problem(&gone).ends_with("the sea belongs to the world: write `world: (sea_level: \"0 m\")`"));
    let named = "parameters: { \"sea\": \"a.sea_level\" }, ";
    let named = problem(&file(named, &coast("a", "version: 2, sea_level: 5")));
    assert!(named.contains("has no parameter `sea_level`") && named.contains("belongs to the world"), "{named}");
}

#[test]
fn a_file_that_is_used_brings_the_sea_of_its_older_nodes() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, world: &str, coast: &str| {
        let nodes = format!(r#""base": Ridged, "coast": Coast(height: "base"{coast})"#);
        let source = format!(r#"({world}nodes: {{ {nodes} }}, outputs: {{ "height": "coast" }})"#);
        std::fs::write(folder.path().join(name), source).expect("written");
    };
    write("old.ron", "", ", water: 50");
    write("dry.ron", "", "");
    write("new.ron", "world: (sea_level: 9), ", "");
    let using = |world: &str, files: &[&str]| {
        let uses = files.iter().enumerate().map(|(at, file)| format!(r#""n{at}": Subgraph(file: "{file}"), "#));
        let source = format!(r#"({world}nodes: {{ {} }}, outputs: {{ "o": "n0" }})"#, uses.collect::<String>());
        Document::parse_at(source, folder.path().join("outer.ron"), &registry())
    };
    let level = |world: &str, files: &[&str]| {
        let document = using(world, files);
        assert_eq!(document.problems(), []);
        document.world().sea_level
    };
    assert_eq!((level("", &["old.ron"]), level("", &["old.ron", "old.ron"])), (Some(50.0), Some(50.0)));
    assert_eq!((level("", &["dry.ron"]), level("", &["new.ron"])), (None, None), "worlds are those of the outer file");
    assert_eq!(level("world: (sea_level: 50), ", &["old.ron", "dry.ron"]), Some(50.0));
    let told = problem(&using("", &["old.ron", "dry.ron"]));
    assert!(told.starts_with("`n0` has a sea at 50 m and `n1` has no sea"), "{told}");
    assert!(problem(&using("world: (sea_level: 1), ", &["old.ron"])).contains("`n0` has a sea at 50 m"));
}

#[test]
fn an_edit_moves_the_sea_of_a_node_to_the_world() {
    let source = r#"(world: (seed: 7), nodes: { "base": Ridged, "a": Coast(height: "base", water: "50 m" /* kept */),
        "b": Coast(version: 1, height: "a", water: 50) }, outputs: { "o": "b" })"#;
    let slope = Edit::SetText { node: "a".into(), name: "slope".into(), text: "0.2".into() };
    let mut document = parse(source);
    document.apply(&slope).expect("applied");
    assert_eq!(document.world(), World { seed: 7, sea_level: Some(50.0), ..World::default() });
    assert!(document.source().contains(r#"world: (seed: 7, sea_level: "50 m")"#), "{}", document.source());
    assert!(document.source().contains(r#""b": Coast(version: 1, height: "a", water: 50)"#), "{}", document.source());
    document.undo();
    assert_eq!(document.source(), source);

    // changing another field of the world keeps the sea level where it is written
    let world = document.world();
    document.apply(&Edit::SetWorld(World { seed: 8, ..world })).expect("applied");
    assert_eq!(document.source(), source.replace("seed: 7", "seed: 8"));
    for (level, text) in [(Some(60.0), "seed: 8, sea_level: \"60 m\""), (None, "seed: 8")] {
        document.apply(&Edit::SetWorld(World { seed: 8, sea_level: level, ..world })).expect("applied");
        assert_eq!((document.world().sea_level, document.problems()), (level, &[][..]));
        assert!(document.source().contains(&format!("world: ({text})")), "{}", document.source());
        assert!(!document.source().contains("water"), "{}", document.source());
    }
    let mut bare = parse("(nodes: {})");
    bare.apply(&Edit::SetWorld(World { sea_level: Some(-0.5), ..World::default() })).expect("applied");
    assert_eq!(bare.source(), "(nodes: {}, world: (sea_level: \"-0.5 m\"))");
    let refused = bare.apply(&Edit::SetWorld(World { sea_level: Some(f64::NAN), ..World::default() }));
    assert!(refused.is_err());
}

#[test]
fn two_changes_of_the_world_are_merged() {
    let base = r#"(world: (seed: 7, sea_level: "0 m"), nodes: { "base": Ridged }, outputs: { "o": "base" })"#;
    let sea = base.replace("0 m", "40 m");
    let seed = base.replace("seed: 7", "seed: 8");
    assert_eq!(parse(&sea).merge(base, &seed), Ok(sea.replace("seed: 7", "seed: 8")));
    let other = base.replace("0 m", "-10 m");
    assert_eq!(parse(&sea).merge(base, &other), Err(vec!["world.sea_level".to_owned()]));
    let none = base.replace(r#", sea_level: "0 m""#, "");
    assert_eq!(parse(&none).merge(base, &seed), Ok(seed.replace(r#", sea_level: "0 m""#, "")));
}
