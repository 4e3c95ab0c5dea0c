//! The `world` of a graph file.

use std::{ops::Range, path::Path};

use super::problems::Problems;
use crate::document::syntax::{
    Expr, ExprKind, Group,
    literal::{Literal, Misfit, pair, quantity},
};
use crate::{
    closest,
    diagnostic::Diagnostic,
    job::NodeError,
    param::range_text,
    registry::Registry,
    unit::Unit,
    world::{Boundary, Edge, Extent, GeoPlace, World, WorldError, bytes},
};

const FIELDS: [&str; 7] = ["from", "size", "cells", "seed", "boundary", "sea_level", "place"];
/// The field of the raster that gives size, cells and place.
pub(crate) const FROM: &str = "from";
/// The field of the sea level.
pub(crate) const SEA_LEVEL: &str = "sea_level";
/// The field of the place on Earth, and its own fields.
pub(crate) const PLACE: &str = "place";
const PLACE_FIELDS: [&str; 2] = ["epsg", "corner"];
const SIDES: [&str; 4] = ["west", "east", "north", "south"];

/// Where rasters that give a world its size are found, and how they are read.
pub(crate) struct Rasters<'a> {
    pub(crate) registry: &'a Registry,
    /// The folder that names are relative to.
    pub(crate) folder: &'a Path,
}

/// The raster that gives the world its size, as the file names it.
pub(crate) fn from_of(value: &Expr, source: &str) -> Option<String> {
    match Literal::read(&value.as_group()?.get(FROM)?.value, source) {
        Literal::Text(file) if !file.is_empty() => Some(file),
        _ => None,
    }
}

/// Reads `(size: .., cells: .., seed: .., boundary: .., sea_level: .., place: ..)`; fields that are missing or invalid
/// get defaults.
///
/// A single number of cells is the number along x; the number along y follows from the size, so that cells are square.
/// With `from`, size and place are those of a raster, and so are the cells if no others are given.
pub(crate) fn read(value: &Expr, source: &str, rasters: &Rasters<'_>, problems: &mut Problems) -> World {
    let default = World::default();
    let Some(group) = value.as_group().filter(|group| group.name.is_none()) else {
        problems.misplaced(value, "world", "brackets such as `(size: (16384, 16384), cells: (1024, 1024))`", source);
        return default;
    };
    problems.names(group, "`world`", &FIELDS);
    let mut world = default;
    let field = |name: &str| group.get(name).map(|item| (Literal::read(&item.value, source), item.value.span.clone()));
    let mut sound = true;

    let from = field(FROM).map(|(literal, span)| {
        let mut extent = None;
        let found = extent_of(&literal, rasters);
        sound &= problems.take(found, &literal, &span, |found| extent = Some(found));
        for remark in extent.iter().flat_map(|extent| &extent.remarks) {
            problems.push(Diagnostic::warning("world", span.clone(), remark.clone()));
        }
        for name in ["size", PLACE].into_iter().filter(|name| group.get(name).is_some()) {
            let what = format!("`{FROM}` gives the world its `{name}`, but the file also states one");
            problems.push(Diagnostic::error("world", span.clone(), what).hint(format!("remove `{FROM}` or `{name}`")));
        }
        extent
    });
    if let Some(Some(extent)) = &from {
        (world.size, world.cells, world.place) = (extent.size, extent.cells, extent.place);
    }
    if let Some((literal, span)) = field("size").filter(|_| from.is_none()) {
        sound &= problems.take(size(&literal), &literal, &span, |size| world.size = size);
    }
    let mut along_x = from.is_none().then_some(default.cells[0]);
    if let Some((literal, span)) = field("cells") {
        sound &= problems.take(cells(&literal), &literal, &span, |cells| match cells {
            (nx, None) => along_x = Some(nx),
            (nx, Some(ny)) => {
                along_x = None;
                world.cells = [nx, ny];
            }
        });
    }
    if let Some(nx) = along_x {
        world = world.with_cells_along_x(nx);
    }
    if let Some((literal, span)) = field("seed") {
        problems.take(seed(&literal), &literal, &span, |seed| world.seed = seed);
    }
    if let Some(item) = group.get("boundary") {
        world.boundary = boundary(&item.value, source, problems);
    }
    if let Some((literal, span)) = field(SEA_LEVEL) {
        problems.take(sea_level(&literal), &literal, &span, |level| world.sea_level = Some(level));
    }
    if let Some(item) = group.get(PLACE).filter(|_| from.is_none()) {
        world.place = place(&item.value, source, problems);
    }
    if sound && let Err(error) = world.check() {
        problems.push(impossible(&error, group, value));
        (world.size, world.cells, world.place) = (default.size, default.cells, None);
    } else if !sound {
        (world.size, world.cells) = (default.size, default.cells);
    }
    world
}

/// A problem with size or cells, at the field that causes it.
fn impossible(error: &WorldError, group: &Group, value: &Expr) -> Diagnostic {
    let place = |name: &str| {
        // what a raster gives is at its name
        let item = group.get(name).or_else(|| group.get(FROM));
        item.map(|item| item.value.span.clone())
    };
    let (span, hint) = match error {
        WorldError::Empty(..) => (place("cells"), "for example `cells: (1024, 1024)`"),
        WorldError::TooLarge(..) => (place("cells"), "choose fewer cells; a larger terrain needs larger cells"),
        WorldError::NoExtent(..) => (place("size"), "for example `size: (\"16 km\", \"16 km\")`"),
        WorldError::TooFine(_) => {
            (place("size").or_else(|| place("cells")), "a size without a unit is in metres; choose a larger one")
        }
        WorldError::TooWide(_) => (place("size"), "a size without a unit is in metres; choose a smaller one"),
        WorldError::NotSquare(..) => (
            place("cells").or_else(|| place("size")),
            "with one number, `cells: 1024`, the other side follows from the size",
        ),
        WorldError::SeaLevel(_) => (place(SEA_LEVEL), "for example `sea_level: \"0 m\"`"),
        WorldError::System(_) => (place(PLACE), "choose the zone of UTM in which it lies, such as `epsg: 32632`"),
        WorldError::Corner(_) => (place(PLACE), "for example `corner: (\"378 km\", \"3812 km\")`"),
    };
    Diagnostic::error("world", span.unwrap_or_else(|| value.span.clone()), error.to_string()).hint(hint)
}

/// Reads what a raster says about the world.
fn extent_of(literal: &Literal, rasters: &Rasters<'_>) -> Result<Extent, Misfit> {
    let Literal::Text(file) = literal else {
        return Err(Misfit::new("type", format!("`{FROM}` is {}, but takes a file name", literal.describe()))
            .hint("write the name of a raster in quotes: `from: \"dem.tif\"`"));
    };
    match rasters.registry.extent_of(&rasters.folder.join(file)) {
        Some(Ok(extent)) => Ok(extent),
        Some(Err(NodeError::Failed { message, hint })) => {
            let misfit = Misfit::new("file", message);
            Err(hint.into_iter().fold(misfit, |misfit, hint| misfit.hint(hint)))
        }
        Some(Err(error)) => Err(Misfit::new("file", error.to_string())),
        None => Err(Misfit::new("file", format!("`{file}` cannot be read here: this program reads no rasters"))),
    }
}

fn size(literal: &Literal) -> Result<[f64; 2], Misfit> {
    match pair("size", Unit::Metres, literal) {
        Some(size) => size,
        None if matches!(literal, Literal::Tuple(_) | Literal::List(_)) => Err(Misfit::new(
            "type",
            format!("`size` is {}, but takes a length or a pair of lengths", literal.describe()),
        )
        .hint("write `size: (16384, 16384)` or `size: \"16 km\"`")),
        None => quantity("size", Unit::Metres, literal).map(|side| [side, side]),
    }
}

/// Cells along x, and along y if given.
fn cells(literal: &Literal) -> Result<(u32, Option<u32>), Misfit> {
    match literal {
        Literal::Tuple(items) if items.len() == 2 => Ok((count(&items[0])?, Some(count(&items[1])?))),
        other => Ok((count(other)?, None)),
    }
}

fn count(literal: &Literal) -> Result<u32, Misfit> {
    match literal {
        Literal::Number(_, Some(cells)) => u32::try_from(*cells).map_err(|_| {
            if *cells < 0 {
                return Misfit::new("world", format!("`cells` is {cells}, but a world has at least 1 x 1"));
            }
            let memory = bytes(cells.unsigned_abs().saturating_mul(4));
            let most = World::MAX_SIDE;
            Misfit::new(
                "world",
                format!("a single row of {cells} cells needs {memory}; the limit is {most} cells a side"),
            )
        }),
        other => Err(Misfit::new("type", format!("`cells` is {}, but takes whole numbers", other.describe()))
            .hint("write `cells: (1024, 1024)` or `cells: 1024`")),
    }
}

fn seed(literal: &Literal) -> Result<u32, Misfit> {
    match literal {
        Literal::Number(_, Some(seed)) => u32::try_from(*seed)
            .map_err(|_| Misfit::new("range", format!("`seed` is {seed}, but must be from 0 to {}", u32::MAX))),
        other => Err(Misfit::new("type", format!("`seed` is {}, but takes a whole number", other.describe()))),
    }
}

/// Reads the sea level in metres.
pub(crate) fn sea_level(literal: &Literal) -> Result<f64, Misfit> {
    if matches!(literal, Literal::Word(_)) {
        return Err(Misfit::new("type", format!("`{SEA_LEVEL}` is {}, but takes a length", literal.describe()))
            .hint("write `sea_level: \"0 m\"`, or leave it out for a world without a sea"));
    }
    let level = quantity(SEA_LEVEL, Unit::Metres, literal)?;
    let [low, high] = World::SEA_LEVELS;
    if (low..=high).contains(&level) {
        return Ok(level);
    }
    let (level, allowed) = (Unit::Metres.display(level), range_text(World::SEA_LEVELS, Unit::Metres));
    Err(Misfit::new("range", format!("`{SEA_LEVEL}` is {level}, but must be a length{allowed}"))
        .hint("leave it out for a world without a sea"))
}

/// Reads `(epsg: .., corner: (.., ..))`. Returns None after a problem.
fn place(value: &Expr, source: &str, problems: &mut Problems) -> Option<GeoPlace> {
    const EXAMPLE: &str = "brackets such as `(epsg: 32611, corner: (\"378 km\", \"3812 km\"))`";
    let Some(group) = value.as_group().filter(|group| group.name.is_none()) else {
        problems.misplaced(value, PLACE, EXAMPLE, source);
        return None;
    };
    problems.names(group, "`place`", &PLACE_FIELDS);
    let (mut epsg, mut corner_m) = (None, None);
    for item in PLACE_FIELDS.iter().filter_map(|name| group.get(name)) {
        let literal = Literal::read(&item.value, source);
        if item.key.as_ref().is_some_and(|key| key.text == PLACE_FIELDS[0]) {
            problems.take(code(&literal), &literal, &item.value.span, |code| epsg = Some(code));
        } else {
            problems.take(corner(&literal), &literal, &item.value.span, |corner| corner_m = Some(corner));
        }
    }
    for name in PLACE_FIELDS.iter().filter(|name| group.get(name).is_none()) {
        let problem = Diagnostic::error("world", value.span.clone(), format!("`place` needs `{name}`"));
        problems.push(problem.hint("its EPSG code, and the easting and the northing of the north-west corner"));
    }
    Some(GeoPlace { epsg: epsg?, corner_m: corner_m? })
}

fn code(literal: &Literal) -> Result<u32, Misfit> {
    match literal {
        Literal::Number(_, Some(code)) => {
            u32::try_from(*code).map_err(|_| Misfit::new("range", format!("`epsg` is {code}, which is no EPSG code")))
        }
        other => Err(Misfit::new("type", format!("`epsg` is {}, but takes an EPSG code", other.describe()))
            .hint("write `epsg: 32611`")),
    }
}

fn corner(literal: &Literal) -> Result<[f64; 2], Misfit> {
    pair("corner", Unit::Metres, literal).unwrap_or_else(|| {
        Err(Misfit::new("type", format!("`corner` is {}, but takes a pair of lengths", literal.describe()))
            .hint("write the easting and the northing: `corner: (\"378 km\", \"3812 km\")`"))
    })
}

fn boundary(value: &Expr, source: &str, problems: &mut Problems) -> Boundary {
    let mut boundary = Boundary::default();
    match &value.kind {
        ExprKind::Group(group) if group.name.is_none() => {
            problems.names(group, "`boundary`", &SIDES);
            let sides = [&mut boundary.west, &mut boundary.east, &mut boundary.north, &mut boundary.south];
            for (name, side) in SIDES.into_iter().zip(sides) {
                if let Some(item) = group.get(name) {
                    let literal = Literal::read(&item.value, source);
                    problems.take(edge(&literal), &literal, &item.value.span, |edge| *side = edge);
                }
            }
            let opposite = [(boundary.west, boundary.east), (boundary.north, boundary.south)];
            if opposite.iter().any(|(a, b)| (*a == Edge::Periodic) != (*b == Edge::Periodic)) {
                let problem = Diagnostic::error(
                    "boundary",
                    value.span.clone(),
                    "a periodic side needs the opposite side periodic too",
                );
                problems.push(problem.hint("what leaves on one side comes in on the other"));
            }
        }
        _ => {
            let literal = Literal::read(value, source);
            let span: &Range<usize> = &value.span;
            problems.take(edge(&literal), &literal, span, |edge| boundary = Boundary::all(edge));
        }
    }
    boundary
}

fn edge(literal: &Literal) -> Result<Edge, Misfit> {
    let names = || Edge::NAMES.map(|(name, _)| format!("`{name}`")).join(", ");
    let wrong = || Misfit::new("type", format!("a side is {}, but takes one of {}", literal.describe(), names()));
    match literal {
        Literal::Word(word) => {
            Edge::NAMES.iter().find(|(name, _)| name == word).map(|(_, edge)| *edge).ok_or_else(|| {
                match closest(word, Edge::NAMES.iter().map(|(name, _)| *name)) {
                    Some(near) => wrong().hint(format!("did you mean `{near}`?")),
                    None => wrong(),
                }
            })
        }
        _ => Err(wrong()),
    }
}
