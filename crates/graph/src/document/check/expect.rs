//! The `expect` of a file: measures of its terrain with the bounds that they must lie in.

use super::{Checker, problems::list};
use crate::{
    closest,
    diagnostic::Diagnostic,
    document::syntax::{
        Expr, Group,
        literal::{Literal, Misfit, quantity},
    },
    node::MeasureSpec,
    unit::{Unit, plain},
    value::PortType,
};

/// The fields of `expect` that are no measures.
pub(crate) const FIELDS: [&str; 2] = ["in", "cell"];
/// The output that is measured, unless the file has only one height.
const HEIGHT: &str = "height";

/// What must hold of the terrain of a file when it is run.
#[derive(Clone, Debug, PartialEq)]
pub struct Expectations {
    /// The name of the output that is measured; `None` if the file has no such output.
    pub output: Option<String>,
    /// The part of the world that is measured, in metres: x and y of its north-west corner, width and height; `None`
    /// for the whole.
    pub part_m: Option<[f64; 4]>,
    /// Side in metres of the cells on which it is measured; `None` for the cells of the world.
    pub cell_m: Option<f64>,
    /// What is expected, in file order; at least one measure.
    pub list: Vec<Expectation>,
}

/// A measure with its bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expectation {
    /// The measure.
    pub measure: &'static MeasureSpec,
    /// The lowest and the highest figure, both included; infinite for an open side.
    pub bounds: [f64; 2],
}

impl Expectation {
    /// Returns true if a figure lies within the bounds; NaN does not.
    #[must_use]
    pub fn holds(&self, figure: f64) -> bool {
        (self.bounds[0]..=self.bounds[1]).contains(&figure)
    }

    /// A figure with its unit, with the digits that show on which side of the bounds it lies.
    #[must_use]
    pub fn display(&self, figure: f64) -> String {
        let rounded: f64 = format!("{figure:.3e}").parse().unwrap_or(figure);
        if figure.is_nan() {
            "undefined".to_owned()
        } else if self.holds(rounded) == self.holds(figure) {
            self.text(rounded)
        } else {
            format!("{figure} {}", self.measure.unit).trim_end().to_owned()
        }
    }

    /// A number with its unit.
    fn text(&self, value: f64) -> String {
        match Unit::of_symbol(self.measure.unit) {
            Some(unit) => unit.display(value),
            None => format!("{} {}", plain(value), self.measure.unit),
        }
    }

    /// The lowest and the highest figure as they can be typed, with the unit; empty for an open side.
    #[must_use]
    pub fn typed(&self) -> [String; 2] {
        self.bounds.map(|bound| match Unit::of_symbol(self.measure.unit) {
            _ if bound.is_infinite() => String::new(),
            Some(unit) => unit.display(bound),
            None => plain(bound),
        })
    }

    /// The bounds as text: `0.4 to 0.6`, `at least 3 km`.
    #[must_use]
    pub fn bounds_text(&self) -> String {
        let [low, high] = self.bounds;
        match (low.is_finite(), high.is_finite()) {
            (true, true) => format!("{} to {}", self.text(low), self.text(high)),
            (true, false) => format!("at least {}", self.text(low)),
            (false, true) => format!("at most {}", self.text(high)),
            (false, false) => "any number".to_owned(),
        }
    }
}

impl Checker<'_> {
    /// Reads the brackets of `expect`, and reports their problems.
    pub(super) fn expect(&mut self, group: &Group, root: &Group) {
        let mut list = Vec::new();
        for (name, item) in self.problems.duplicates(group, "in `expect`") {
            if FIELDS.contains(&name) {
                continue;
            }
            let Some(measure) = self.registry.measures().find(|measure| measure.name == name) else {
                let span = item.key.as_ref().map_or_else(|| item.span(), |key| key.span.clone());
                self.problems.push(self.unknown_measure(name, span));
                continue;
            };
            let literal = Literal::read(&item.value, self.source);
            let bounds = bounds(measure, &literal, &item.value, self.source);
            let take = |bounds| list.push(Expectation { measure, bounds });
            self.problems.take(bounds, &literal, &item.value.span, take);
        }
        let world_is_sound = root.get("world").is_none_or(|item| !self.problems.has_any_in(&item.span()));
        let size = world_is_sound.then_some(self.out.world.size);
        let (mut part_m, mut cell_m) = (None, None);
        let [place, cell] = FIELDS;
        if let Some(item) = group.get(place) {
            let literal = Literal::read(&item.value, self.source);
            self.problems.take(part(&literal, size), &literal, &item.value.span, |part| part_m = Some(part));
        }
        if let Some(item) = group.get(cell) {
            let literal = Literal::read(&item.value, self.source);
            let extent = part_m.map(|[_, _, width, height]| [width, height]).or(size);
            self.problems.take(cell_size(&literal, extent), &literal, &item.value.span, |cell| cell_m = Some(cell));
        }
        if !list.is_empty() {
            let output = self.measured_output(group);
            self.out.expectations = Some(Expectations { output, part_m, cell_m, list }.into());
        }
    }

    fn unknown_measure(&self, name: &str, span: std::ops::Range<usize>) -> Diagnostic {
        let known = || self.registry.measures().map(|measure| measure.name).chain(FIELDS);
        let problem = Diagnostic::error("unknown-measure", span, format!("there is no measure `{name}`"));
        // a name without its last parts is completed
        let longer = || known().find(|other| other.split('.').next() == Some(name));
        match closest(name, known()).or_else(longer) {
            Some(near) => problem.hint(format!("did you mean `{near}`?")),
            None => problem.hint("`orograph nodes Metrics` lists the measures"),
        }
    }

    /// The name of the output that is measured, or a warning that there is none.
    fn measured_output(&mut self, group: &Group) -> Option<String> {
        let heights = self.out.outputs.iter().filter(|output| output.ty == PortType::Height);
        let heights: Vec<&str> = heights.map(|output| output.name.as_str()).collect();
        let (message, hint) = match heights.as_slice() {
            [only] => return Some((*only).to_owned()),
            several if several.contains(&HEIGHT) => return Some(HEIGHT.to_owned()),
            // the outputs have problems of their own
            [] if self.out.outputs.is_empty() => return None,
            [] => (
                "no output is a height, so that expectations cannot be checked".to_owned(),
                "add the height to `outputs`",
            ),
            several => (
                format!("expectations cannot be checked: they may be about any of {}", list(several.iter().copied())),
                "name the output that they are about `height`",
            ),
        };
        // A warning: removing an output is no mistake while a graph is being made.
        self.problems.push(Diagnostic::warning("expect-output", group.open..group.open + 1, message).hint(hint));
        None
    }
}

/// The bounds of a measure.
fn bounds(measure: &MeasureSpec, literal: &Literal, value: &Expr, source: &str) -> Result<[f64; 2], Misfit> {
    let name = measure.name;
    let items = match literal {
        Literal::Tuple(items) if items.len() == 2 => items,
        other => {
            let message = format!("`{name}` is {}, but takes a lowest and a highest figure", other.describe());
            return Err(Misfit::new("type", message)
                .hint("write `(0.4, 0.6)`; `inf` or `-inf` leaves a side open: `(0.4, inf)`"));
        }
    };
    let [low, high] = [bound(measure, &items[0])?, bound(measure, &items[1])?];
    if low > high {
        let written = value.as_group().map(|group| &group.items[..]).unwrap_or_default();
        let texts: Vec<&str> = written.iter().rev().map(|item| &source[item.value.span.clone()]).collect();
        return Err(Misfit::new("bounds", format!("the lowest figure of `{name}` is above the highest"))
            .hint(format!("write `({})`", texts.join(", "))));
    }
    if low == f64::INFINITY || high == f64::NEG_INFINITY {
        return Err(Misfit::new("bounds", format!("no figure of `{name}` lies within these bounds"))
            .hint("an open side is `-inf` as the lowest figure, or `inf` as the highest"));
    }
    Ok([low, high])
}

/// A bound: a number, a quantity in quotes, or infinity.
fn bound(measure: &MeasureSpec, literal: &Literal) -> Result<f64, Misfit> {
    match (literal, Unit::of_symbol(measure.unit)) {
        (Literal::Number(value, _), _) if value.is_infinite() => Ok(*value),
        (Literal::Text(text), None) => {
            let message = format!("`{}` is the text \"{text}\", but takes a number of {}", measure.name, measure.unit);
            Err(Misfit::new("unit", message).hint("write the number alone"))
        }
        (_, unit) => quantity(measure.name, unit.unwrap_or(Unit::One), literal),
    }
}

/// The part of the world that is measured. `size` is the size of the world, if it is known.
fn part(literal: &Literal, size: Option<[f64; 2]>) -> Result<[f64; 4], Misfit> {
    let items = match literal {
        Literal::Tuple(items) if items.len() == 4 => items,
        other => {
            let message = format!("`in` is {}, but takes a position and an extent", other.describe());
            return Err(Misfit::new("type", message)
                .hint("write x, y, width and height: `(\"2 km\", \"2 km\", \"4 km\", \"4 km\")`"));
        }
    };
    let mut part = [0.0; 4];
    for (value, item) in part.iter_mut().zip(items) {
        *value = quantity("in", Unit::Metres, item)?;
    }
    let [x, y, width, height] = part;
    if width <= 0.0 || height <= 0.0 {
        return Err(Misfit::new("range", "`in` has no extent; width and height must be above zero".to_owned()));
    }
    // A rounding error is not outside.
    let fits = |from: f64, extent: f64, size: f64| from >= 0.0 && from + extent <= size * (1.0 + 1e-9);
    match size {
        Some([east, south]) if !fits(x, width, east) || !fits(y, height, south) => {
            let metres = |value: f64| Unit::Metres.display(value);
            let message = format!(
                "`in` from ({}, {}) to ({}, {}) is not within the world of {} x {}",
                metres(x),
                metres(y),
                metres(x + width),
                metres(y + height),
                metres(east),
                metres(south)
            );
            Err(Misfit::new("range", message).hint("the third and fourth number are width and height"))
        }
        _ => Ok(part),
    }
}

/// Side of the cells that are measured. `extent` is that of the part that they fill, if it is known.
fn cell_size(literal: &Literal, extent: Option<[f64; 2]>) -> Result<f64, Misfit> {
    let cell = quantity("cell", Unit::Metres, literal)?;
    let most = extent.map_or(f64::INFINITY, |[width, height]| width.min(height));
    if cell > 0.0 && cell <= most {
        return Ok(cell);
    }
    let shown = Unit::Metres.display(cell);
    let message = if cell > 0.0 {
        format!("`cell` is {shown}, but the part that is measured has only {}", Unit::Metres.display(most))
    } else {
        format!("`cell` is {shown}, but must be above zero")
    };
    Err(Misfit::new("range", message))
}
