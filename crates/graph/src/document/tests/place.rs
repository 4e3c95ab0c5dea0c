//! Where on Earth the world of a file lies.

use super::*;
use crate::GeoPlace;

fn file(world: &str) -> Document {
    parse(&format!(r#"(world: ({world}), nodes: {{ "base": Ridged }}, outputs: {{ "o": "base" }})"#))
}

#[track_caller]
fn place(world: &str) -> Option<GeoPlace> {
    let document = file(world);
    assert_eq!(document.problems(), []);
    document.world().place
}

#[test]
fn a_world_may_have_a_place() {
    assert_eq!(place("seed: 3"), None);
    let found = place(r#"seed: 3, place: (epsg: 32611, corner: ("378 km", 3812000.5))"#);
    assert_eq!(found, Some(GeoPlace { epsg: 32611, corner_m: [378e3, 3_812_000.5] }));
}

#[test]
fn invalid_places_are_refused() {
    for (text, told) in [
        ("(epsg: 4326, corner: (0, 0))", "EPSG:4326 is not a projected coordinate system in metres"),
        ("(epsg: 3857, corner: (0, 0))", "EPSG:3857 is not a projected"),
        ("(epsg: 7, corner: (0, 0))", "EPSG:7 is not"),
        ("(epsg: -1, corner: (0, 0))", "which is no EPSG code"),
        ("(epsg: 99999999999, corner: (0, 0))", "which is no EPSG code"),
        ("(epsg: \"UTM\", corner: (0, 0))", "but takes an EPSG code"),
        ("(epsg: 32611)", "`place` needs `corner`"),
        ("(corner: (0, 0))", "`place` needs `epsg`"),
        ("(epsg: 32611, corner: 5)", "but takes a pair of lengths"),
        ("(epsg: 32611, corner: (0, 1e9))", "1000000000 m is not an easting or a northing"),
        ("(epsg: 32611, corner: (NaN, 0))", "not a number"),
        ("(epsg: 32611, corner: (0, \"2 yr\"))", "is not a unit of a length"),
        ("(epsg: 32611, corners: (0, 0), corner: (0, 0))", "did you mean `corner`"),
        ("32611", "brackets such as"),
    ] {
        let document = file(&format!("seed: 3, place: {text}"));
        let [problem] = document.problems() else { panic!("{text}: {:?}", document.problems()) };
        let said = format!("{}; {}", problem.message, problem.hint.as_deref().unwrap_or(""));
        assert!(said.contains(told), "{text}: {said}");
        assert_eq!(document.world().seed, 3, "{text}");
    }
}

#[test]
fn places_are_edited_and_compared() {
    let mut document = file("seed: 3");
    let at = |corner_m| Some(GeoPlace { epsg: 32632, corner_m });
    for place in [at([5e5, -2.5]), at([1.0, 2.0]), None] {
        let world = World { place, ..document.world() };
        document.apply(&Edit::SetWorld(world)).expect("an edit");
        assert_eq!(document.world(), world, "{}", document.source());
        assert_eq!(document.problems(), []);
    }
    let (there, nowhere) = (file("place: (epsg: 32632, corner: (5, 6))"), file("seed: 0"));
    assert_eq!(diff(&nowhere, &there), ["world.place none → EPSG:32632 at 5 m, 6 m"]);
}
