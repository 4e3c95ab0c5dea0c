//! SVG: paths, lines, polylines, polygons, rectangles, circles and ellipses. Its units are metres of the world, x to the
//! east and y to the south.

use orograph_graph::Waypoint;
use quick_xml::{
    Reader,
    events::{BytesStart, Event},
};
use svgtypes::{PathParser, PathSegment, PointsParser, SimplePathSegment, SimplifyingPathParser, Transform};

use super::{Drawing, MOST_POINTS, Polyline, VectorError, polyline};
use crate::numerics::math;

/// Deepest nesting of groups.
const DEEPEST: usize = 256;
/// Elements whose contents are not drawn where they are written.
const HIDDEN: [&[u8]; 6] = [b"defs", b"clipPath", b"mask", b"marker", b"pattern", b"symbol"];

/// Reads the outlines of a drawing.
pub(super) fn read(bytes: &[u8]) -> Result<Drawing, VectorError> {
    let damaged = |error: &dyn std::fmt::Display| VectorError::damaged(format!("it is not SVG: {error}"));
    let mut reader = Reader::from_reader(bytes);
    let mut drawing = Drawing::default();
    // the transform of each open element, and how many of them are hidden
    let mut open: Vec<(Transform, bool)> = Vec::new();
    let mut is_svg = false;
    let mut buffer = Vec::new();
    let mut points = 0;
    loop {
        let (element, is_empty) = match reader.read_event_into(&mut buffer).map_err(|error| damaged(&error))? {
            Event::Start(element) => (element, false),
            Event::Empty(element) => (element, true),
            Event::End(_) => {
                open.pop();
                buffer.clear();
                continue;
            }
            Event::Eof => break,
            _ => {
                buffer.clear();
                continue;
            }
        };
        is_svg |= element.local_name().as_ref() == b"svg";
        let (outer, hidden) = open.last().copied().unwrap_or((Transform::default(), false));
        let own = attribute(&element, "transform")?.map_or(Ok(Transform::default()), |text| text.parse());
        let transform = combine(outer, own.map_err(|error| damaged(&error))?);
        let hidden = hidden || HIDDEN.contains(&element.local_name().as_ref());
        if !hidden {
            let before = drawing.lines.len();
            draw(&element, transform, &mut drawing)?;
            // a short text may draw long curves: it must not fill the memory before it is refused
            points += drawing.lines[before..].iter().map(|line| line.points.len()).sum::<usize>();
            if points > MOST_POINTS {
                return Err(VectorError::long());
            }
        }
        if !is_empty {
            if open.len() == DEEPEST {
                return Err(VectorError::damaged("its groups are nested too deeply"));
            }
            open.push((transform, hidden));
        }
        buffer.clear();
    }
    if is_svg { Ok(drawing) } else { Err(VectorError::damaged("it has no element `svg`")) }
}

/// The transform that applies `inner` first.
fn combine(outer: Transform, inner: Transform) -> Transform {
    let [x, y] = apply(&outer, [inner.e, inner.f]);
    Transform {
        a: outer.a * inner.a + outer.c * inner.b,
        b: outer.b * inner.a + outer.d * inner.b,
        c: outer.a * inner.c + outer.c * inner.d,
        d: outer.b * inner.c + outer.d * inner.d,
        e: x,
        f: y,
    }
}

fn apply(transform: &Transform, [x, y]: [f64; 2]) -> [f64; 2] {
    [transform.a * x + transform.c * y + transform.e, transform.b * x + transform.d * y + transform.f]
}

fn attribute(element: &BytesStart<'_>, name: &str) -> Result<Option<String>, VectorError> {
    let found =
        element.try_get_attribute(name).map_err(|error| VectorError::damaged(format!("it is not SVG: {error}")))?;
    Ok(found.map(|attribute| String::from_utf8_lossy(&attribute.value).into_owned()))
}

/// Adds the outline of an element.
fn draw(element: &BytesStart<'_>, transform: Transform, drawing: &mut Drawing) -> Result<(), VectorError> {
    let number = |name: &str| -> Result<f64, VectorError> {
        let Some(text) = attribute(element, name)? else { return Ok(0.0) };
        let length: svgtypes::Length = text.parse().map_err(|error| wrong(name, &text, &error))?;
        Ok(length.number)
    };
    let mut add = |points: Vec<[f64; 2]>, closed: bool| {
        let placed = points.into_iter().map(|at| Waypoint::new(apply(&transform, at)));
        let line = polyline(placed, closed).filter(is_finite);
        drawing.lines.extend(line);
    };
    match element.local_name().as_ref() {
        b"path" => {
            let text = attribute(element, "d")?.unwrap_or_default();
            for (points, closed) in path(&text).map_err(|error| wrong("d", &text, &error))? {
                add(points, closed);
            }
        }
        b"line" => add(vec![[number("x1")?, number("y1")?], [number("x2")?, number("y2")?]], false),
        name @ (b"polyline" | b"polygon") => {
            let text = attribute(element, "points")?.unwrap_or_default();
            add(PointsParser::from(text.as_str()).map(|(x, y)| [x, y]).collect(), name == b"polygon");
        }
        b"rect" => {
            let ([x, y], [w, h]) = ([number("x")?, number("y")?], [number("width")?, number("height")?]);
            add(vec![[x, y], [x + w, y], [x + w, y + h], [x, y + h]], true);
        }
        name @ (b"circle" | b"ellipse") => {
            let radii = if name == b"circle" { [number("r")?; 2] } else { [number("rx")?, number("ry")?] };
            let centre = [number("cx")?, number("cy")?];
            add(ellipse(centre, radii), true);
        }
        b"text" | b"image" | b"use" => drawing.skipped += 1,
        _ => {}
    }
    Ok(())
}

fn wrong(name: &str, text: &str, error: &dyn std::fmt::Display) -> VectorError {
    let start: String = text.chars().take(40).collect();
    VectorError::damaged(format!("the attribute `{name}` is `{start}`: {error}"))
}

fn is_finite(line: &Polyline) -> bool {
    line.points.iter().flat_map(|point| point.at).all(f64::is_finite)
}

/// Points around an ellipse.
fn ellipse([x, y]: [f64; 2], [rx, ry]: [f64; 2]) -> Vec<[f64; 2]> {
    const POINTS: u32 = 64;
    let turn = |k: u32| std::f64::consts::TAU * f64::from(k) / f64::from(POINTS);
    (0..POINTS).map(|k| [x + rx * math::cos(turn(k)), y + ry * math::sin(turn(k))]).collect()
}

/// The points of a piece of a path, and whether it is closed.
type Piece = (Vec<[f64; 2]>, bool);

/// The pieces of a path, curves as straight pieces; of a path that is too long, more of them than are read.
fn path(text: &str) -> Result<Vec<Piece>, svgtypes::Error> {
    // the simplifying parser stops at an error without reporting it
    PathParser::from(text).try_for_each(|segment| segment.map(|_: PathSegment| ()))?;
    let mut pieces: Vec<Piece> = Vec::new();
    let mut before = 0;
    for segment in SimplifyingPathParser::from(text) {
        let segment = segment?;
        if let SimplePathSegment::MoveTo { x, y } = segment {
            before += pieces.last().map_or(0, |(points, _)| points.len());
            pieces.push((vec![[x, y]], false));
            continue;
        }
        // after a closed piece, the next begins at its start
        if pieces.last().is_none_or(|(_, closed)| *closed) {
            before += pieces.last().map_or(0, |(points, _)| points.len());
            let start = pieces.last().and_then(|(points, _)| points.first()).copied().unwrap_or_default();
            pieces.push((vec![start], false));
        }
        let Some((points, closed)) = pieces.last_mut() else { continue };
        if before + points.len() > MOST_POINTS {
            break;
        }
        let from = points.last().copied().unwrap_or_default();
        match segment {
            SimplePathSegment::MoveTo { .. } => {}
            SimplePathSegment::LineTo { x, y } => points.push([x, y]),
            SimplePathSegment::CurveTo { x1, y1, x2, y2, x, y } => cubic([from, [x1, y1], [x2, y2], [x, y]], points),
            SimplePathSegment::Quadratic { x1, y1, x, y } => {
                let third = |end: [f64; 2]| [0, 1].map(|axis| end[axis] + 2.0 / 3.0 * ([x1, y1][axis] - end[axis]));
                cubic([from, third(from), third([x, y]), [x, y]], points);
            }
            SimplePathSegment::ClosePath => *closed = true,
        }
    }
    Ok(pieces)
}

/// Adds points along a cubic curve, which deviate from it by at most a two-thousandth of its length.
fn cubic([a, b, c, d]: [[f64; 2]; 4], points: &mut Vec<[f64; 2]>) {
    const FINE: f64 = 2000.0;
    let apart = |from: [f64; 2], to: [f64; 2]| {
        let [x, y] = [to[0] - from[0], to[1] - from[1]];
        (x * x + y * y).sqrt()
    };
    let length = apart(a, b) + apart(b, c) + apart(c, d);
    let bend = |from: [f64; 2], at: [f64; 2], to: [f64; 2]| {
        let [x, y] = [0, 1].map(|axis| from[axis] - 2.0 * at[axis] + to[axis]);
        (x * x + y * y).sqrt()
    };
    let most = bend(a, b, c).max(bend(b, c, d));
    let count = if length > 0.0 { (0.75 * most * FINE / length).sqrt().ceil().clamp(1.0, 64.0) as u32 } else { 1 };
    for k in 1..=count {
        let t = f64::from(k) / f64::from(count);
        let s = 1.0 - t;
        let weights = [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t];
        let at =
            |axis: usize| weights[0] * a[axis] + weights[1] * b[axis] + weights[2] * c[axis] + weights[3] * d[axis];
        points.push(if k == count { d } else { [at(0), at(1)] });
    }
}
