//! The world of a raster.

use std::path::Path;

use super::*;
use crate::{Extent, GeoPlace, NodeError};

/// `dem.tif` and `odd.tif` exist, the latter with a remark.
fn extent(path: &Path) -> Result<Extent, NodeError> {
    let place = Some(GeoPlace { epsg: 32611, corner_m: [378_000.0, 3_812_000.0] });
    let extent = Extent { size: [900.0, 600.0], cells: [90, 60], place, remarks: Vec::new() };
    match path.to_str() {
        Some("maps/dem.tif") => Ok(extent),
        Some("maps/odd.tif") => Ok(Extent { place: None, remarks: vec!["it is odd".to_owned()], ..extent }),
        _ => Err(NodeError::failed_with_hint("there is no such file", "check the name")),
    }
}

fn file(world: &str) -> Document {
    let text = format!(r#"(world: ({world}), nodes: {{ "base": Ridged }}, outputs: {{ "o": "base" }})"#);
    Document::parse_in(text, "maps", &registry().with_extent_of(extent))
}

#[test]
fn a_world_may_come_from_a_raster() {
    let document = file(r#"from: "dem.tif", seed: 3, boundary: wall"#);
    assert_eq!(document.problems(), []);
    let world = document.world();
    assert_eq!((world.size, world.cells, world.seed), ([900.0, 600.0], [90, 60], 3));
    assert_eq!(world.place.map(|place| place.epsg), Some(32611));
    assert_eq!(document.files(), [Path::new("maps/dem.tif").to_owned()].into());
    for (cells, expected) in [("180", [180, 120]), ("(45, 30)", [45, 30])] {
        let world = file(&format!(r#"from: "dem.tif", cells: {cells}"#)).world();
        assert_eq!((world.size, world.cells), ([900.0, 600.0], expected));
    }
    let odd = file(r#"from: "odd.tif""#);
    assert_eq!((odd.problems()[0].message.as_str(), odd.has_errors()), ("it is odd", false));
    let renamed = document.with_file_names(&|node, param, file| Some(format!("{node}/{param}/{file}")));
    assert!(renamed.expect("a text").contains(r#"from: "world/from/dem.tif""#));
}

#[test]
fn what_contradicts_a_raster_or_is_none_is_refused() {
    for (text, told) in [
        (r#"from: "none.tif""#, "there is no such file; check the name"),
        ("from: 7", "`from` is the number `7`, but takes a file name; write the name of a raster in quotes"),
        (r#"from: "dem.tif", size: (900, 600)"#, "gives the world its `size`, but the file also states one; remove"),
        (r#"from: "dem.tif", place: (epsg: 32611, corner: (0, 0))"#, "gives the world its `place`"),
        (r#"from: "dem.tif", cells: (90, 61)"#, "they must be square"),
    ] {
        let document = file(text);
        let [problem] = document.problems() else { panic!("{text}: {:?}", document.problems()) };
        let said = format!("{}; {}", problem.message, problem.hint.as_deref().unwrap_or(""));
        assert!(said.contains(told), "{text}: {said}");
    }
    let without = Document::parse(r#"(world: (from: "dem.tif"), nodes: {})"#, &registry());
    assert!(without.problems().iter().any(|problem| problem.message.contains("reads no rasters")));
}

/// An edit of what the raster gives replaces it by numbers; other edits keep it.
#[test]
fn edits_keep_the_raster_while_they_can() {
    let mut document = file(r#"from: "dem.tif""#);
    let change = |document: &mut Document, world: World| {
        document.apply(&Edit::SetWorld(world)).expect("an edit");
        assert_eq!(document.world(), world, "{}", document.source());
        assert_eq!(document.problems(), []);
    };
    let world = document.world();
    change(&mut document, World { seed: 9, ..world });
    change(&mut document, World { cells: [180, 120], seed: 9, ..world });
    change(&mut document, World { seed: 9, ..world });
    assert!(document.source().contains(r#"(from: "dem.tif", seed: 9)"#), "{}", document.source());
    change(&mut document, World { size: [1800.0, 1200.0], ..world });
    assert_eq!(document.world_raster(), None);
    assert!(document.source().contains("corner: (378000, 3812000)"), "{}", document.source());
}
