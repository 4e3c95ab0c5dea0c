//! The manual and the help.

use super::Place;

#[test]
fn the_manual_lists_and_describes_nodes() {
    let place = Place::new();
    assert!(place.run(&["nodes"]).done().out.contains("Hillshade"));
    let page = place.run(&["nodes", "Hillshade"]).done().out;
    for text in ["azimuth", "default 315°", "0° to 360°", "must be wired", "- oblique  ", "Sources", "Example"] {
        assert!(page.contains(text), "`{text}` is not in:\n{page}");
    }
    assert!(!page.contains('\x1b'), "no colours in a pipe");
    assert!(place.run(&["nodes", "Hillshade", "--format", "md"]).done().out.starts_with("# Hillshade\n"));
    let all: serde_json::Value =
        serde_json::from_str(&place.run(&["nodes", "--format", "json"]).done().out).expect("JSON");
    assert!(all.as_array().is_some_and(|nodes| nodes.iter().any(|node| node["id"] == "Hillshade")));
    place.run(&["nodes", "Hilshade"]).ended(1, &["did you mean `Hillshade`?"]);
}

#[test]
fn help_succeeds_and_a_wrong_command_fails() {
    let place = Place::new();
    assert!(place.run(&["--help"]).done().out.contains("Exit codes"));
    assert!(place.run(&["run", "--help"]).done().out.contains("\"event\":\"done\""));
    assert!(place.run(&["--version"]).done().out.starts_with("orograph "));
    place.run(&["biuld"]).ended(1, &["biuld"]);
    // Without a command the editor opens, for which the tests have no display.
    #[cfg(feature = "editor")]
    place.run(&[]).ended(2, &["display", "orograph run"]);
    #[cfg(not(feature = "editor"))]
    place.run(&[]).ended(1, &["this build has no editor"]);
}
