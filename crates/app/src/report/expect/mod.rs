//! What a graph file expects of its terrain, compared with the measures of what was built.

mod gather;

use orograph_graph::{Cancel, Expectation, Expectations, Field, Registry, Unit, World};
use serde_json::{Value, json};

pub use gather::Gather;

use super::{
    failure::Failure,
    measure::measure,
    terminal::{Align, Page, Table, counted},
};

/// What became of the expectations of a file in a build.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Expected {
    /// The file states nothing.
    #[default]
    Nothing,
    /// They are not checked, because the build was asked for something else.
    Skipped(String),
    /// They cannot be checked, because the file does not say of what.
    Unknown,
    /// They were measured.
    Checked(Checked),
}

/// Expectations with the figures that were measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Checked {
    /// The name of the output.
    pub output: String,
    /// What was measured, as text.
    pub place: String,
    /// The figures, in the order of the file.
    pub figures: Vec<Figure>,
    /// True if the cells of the world are larger than those that the file expects something of.
    pub is_coarse: bool,
    /// Remarks on the measurement.
    pub notes: Vec<String>,
}

/// A figure, and what was expected of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// The measure and its bounds.
    pub expectation: Expectation,
    /// The figure; NaN if it is undefined.
    pub value: f64,
    /// Why it is undefined, if it is and the report says so.
    pub reason: Option<String>,
}

impl Figure {
    /// Returns true if it lies within the bounds.
    #[must_use]
    pub fn is_met(&self) -> bool {
        self.expectation.holds(self.value)
    }

    /// What was missed: "`relief` is 300 m, not at least 1 km".
    #[must_use]
    pub fn text(&self) -> String {
        let Expectation { measure, .. } = self.expectation;
        match &self.reason {
            Some(reason) => format!("`{}` is undefined: {reason}", measure.name),
            None if self.value.is_nan() => format!("`{}` is undefined on this terrain", measure.name),
            None => {
                let value = self.expectation.display(self.value);
                format!("`{}` is {value}, not {}", measure.name, self.expectation.bounds_text())
            }
        }
    }
}

impl Checked {
    /// Measures a gathered heightfield.
    ///
    /// # Errors
    /// When it cannot be measured, or the measuring is cancelled.
    pub fn of(
        expected: &Expectations,
        output: &str,
        gathered: Gather,
        registry: &Registry,
        cancel: &Cancel,
    ) -> Result<Self, Failure> {
        let metres = |value: f64| Unit::Metres.display(value);
        let ([x, y], [width, height]) = gathered.part_m();
        let cell_m = gathered.cell_m();
        let place = match gathered.is_whole() {
            true => format!("cells of {}", metres(cell_m)),
            false => {
                let [x, y, width, height] = [x, y, width, height].map(metres);
                format!("{width} x {height} from ({x}, {y}), cells of {}", metres(cell_m))
            }
        };
        let finer = expected.cell_m.filter(|asked| *asked < cell_m * (1.0 - 1e-6));
        let note = |asked| {
            let cell = metres(cell_m);
            format!("expected on cells of {}, but those of the world are {cell}: misses do not count", metres(asked))
        };
        let report = measure(&gathered.finish(), registry, cancel)?;
        let figure = |expectation: &Expectation| {
            let value = report.get(expectation.measure.name).unwrap_or(f64::NAN);
            let name = expectation.measure.name;
            let word = name.split(['_', '.']).next().unwrap_or(name);
            let reason = report.notes.iter().find(|note| value.is_nan() && note.contains(word)).cloned();
            Figure { expectation: *expectation, value, reason }
        };
        let figures = expected.list.iter().map(figure).collect();
        let (is_coarse, notes) = (finer.is_some(), finer.map(note).into_iter().collect());
        Ok(Self { output: output.to_owned(), place, figures, is_coarse, notes })
    }

    /// The figures that are missed; none on cells that are too large for what is expected.
    pub fn missed(&self) -> impl Iterator<Item = &Figure> {
        self.figures.iter().filter(|figure| !self.is_coarse && !figure.is_met())
    }
}

impl Expected {
    /// The figures as data; none if nothing was measured.
    #[must_use]
    pub fn as_json(&self) -> Vec<Value> {
        let Self::Checked(Checked { figures, is_coarse, .. }) = self else { return Vec::new() };
        let figure = |figure: &Figure| {
            let Expectation { measure, bounds } = figure.expectation;
            json!({
                "measure": measure.name, "value": figure.value, "unit": measure.unit, "bounds": bounds,
                "met": figure.is_met(), "counts": !is_coarse, "reason": figure.reason,
            })
        };
        figures.iter().map(figure).collect()
    }

    /// What is missed. Returns None when all expectations are met, or none could be expected to be.
    #[must_use]
    pub fn missed(&self) -> Option<String> {
        match self {
            Self::Nothing | Self::Skipped(_) => None,
            Self::Unknown => Some("expectations cannot be checked: the file does not say of which output".to_owned()),
            Self::Checked(checked) => {
                let missed: Vec<String> = checked.missed().map(Figure::text).collect();
                let count = format!("{} of {}", missed.len(), counted(checked.figures.len(), "expectation"));
                (!missed.is_empty()).then(|| format!("{count} missed: {}", missed.join("; ")))
            }
        }
    }

    /// What is missed as a failure of a command whose files are written.
    #[must_use]
    pub fn failure(&self) -> Option<Failure> {
        let failure = Failure::wrong(self.missed()?);
        Some(match self {
            Self::Unknown => failure.hint("name the output that they are about `height`"),
            _ => failure.hint("all files are written; change the terrain, or `expect` in the graph file"),
        })
    }

    /// Each expectation with its figure and its bounds, for the terminal.
    #[must_use]
    pub fn render(&self, page: Page) -> String {
        let checked = match self {
            Self::Nothing | Self::Unknown => return String::new(),
            Self::Skipped(why) => return format!("{} expectations are not checked: {why}\n", page.doubtful("note:")),
            Self::Checked(checked) => checked,
        };
        let mut table = Table::new(&[("", Align::Left), ("", Align::Right), ("", Align::Left), ("", Align::Left)]);
        for figure in &checked.figures {
            let Expectation { measure, .. } = figure.expectation;
            table.row([
                page.name(measure.name),
                figure.expectation.display(figure.value),
                figure.expectation.bounds_text(),
                match figure.is_met() {
                    true => page.good("met"),
                    false if checked.is_coarse => page.dim("does not count"),
                    false => page.bad("missed"),
                },
            ]);
        }
        let notes: String = checked.notes.iter().map(|note| format!("{} {note}\n", page.doubtful("note:"))).collect();
        let heading =
            format!("expectations of {} {}", page.name(&checked.output), page.dim(&format!("({})", checked.place)));
        format!("\n{heading}\n{}{notes}\n", table.render(page, 2))
    }
}

/// Gathers the heightfield that expectations are about while a build delivers it.
#[derive(Debug)]
pub struct Watch<'a> {
    expected: &'a Expectations,
    output: &'a str,
    gather: Gather,
}

impl<'a> Watch<'a> {
    /// For the expectations of a file.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub fn new(expected: &'a Expectations, output: &'a str, world: World) -> Result<Self, Failure> {
        let gather = Gather::new(expected, world).map_err(refused)?;
        Ok(Self { expected, output, gather })
    }

    /// Takes rows of an output.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub fn add(&mut self, output: &str, rows: &Field) -> Result<(), Failure> {
        if output == self.output { self.gather.add(rows).map_err(refused) } else { Ok(()) }
    }

    /// Measures what was gathered.
    ///
    /// # Errors
    /// When it cannot be measured, or the measuring is cancelled. All files are then written.
    pub fn finish(self, registry: &Registry, cancel: &Cancel) -> Result<Expected, Failure> {
        let checked = Checked::of(self.expected, self.output, self.gather, registry, cancel);
        checked.map(Expected::Checked).map_err(|failure| {
            let why = if cancel.is_cancelled() { "stopped".to_owned() } else { failure.message };
            Failure { message: format!("all files are written, but expectations are not checked: {why}"), ..failure }
        })
    }
}

fn refused(refused: orograph_graph::memory::OutOfMemory) -> Failure {
    Failure::unable(format!("cannot check what the file expects: {refused}"))
        .hint("give `expect` a `cell`, on which it is measured")
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Document, Window};

    use super::*;

    fn checked(expect: &str, heights: impl Fn(u32) -> f32) -> Checked {
        let registry = orograph_nodes::registry();
        let source = format!(
            "(world: (size: 1600, cells: 16), nodes: {{ \"a\": Constant }}, outputs: {{ \"height\": \"a\" }}, \
             expect: {{ {expect} }})"
        );
        let document = Document::parse(source, &registry);
        assert_eq!(document.problems(), []);
        let expected = document.expectations().expect("something");
        let mut gather = Gather::new(expected, document.world()).expect("memory");
        let samples = (0..256).map(heights).collect();
        gather.add(&Field::new(Window::whole(document.world()), samples)).expect("memory");
        Checked::of(expected, "height", gather, &registry, &Cancel::default()).expect("it can be measured")
    }

    #[test]
    fn figures_are_compared_with_their_bounds() {
        let found = checked("\"relief\": (\"1 km\", inf), \"elevation.max\": (0, 300)", |at| (at % 16) as f32 * 10.0);
        assert_eq!(found.figures.iter().map(Figure::is_met).collect::<Vec<_>>(), [false, true]);
        let expected = Expected::Checked(found);
        assert_eq!(
            expected.missed().as_deref(),
            Some("1 of 2 expectations missed: `relief` is 150 m, not at least 1 km")
        );
        let text = expected.render(Page { width: 80, colour: false, terminal: false });
        assert!(text.contains("expectations of height (cells of 100 m)") && text.contains("150 m"), "{text}");
        assert_eq!(expected.as_json()[0]["bounds"], json!([1000.0, null]));
        assert_eq!(expected.as_json()[0]["counts"], json!(true));
    }

    #[test]
    fn misses_on_cells_that_are_too_large_do_not_count() {
        let found = checked("\"relief\": (\"1 km\", inf), \"cell\": 50", |at| (at % 16) as f32 * 10.0);
        let note = "expected on cells of 50 m, but those of the world are 100 m: misses do not count";
        assert_eq!(found.notes, [note]);
        let expected = Expected::Checked(found);
        assert_eq!(expected.missed(), None);
        assert_eq!([&expected.as_json()[0]["met"], &expected.as_json()[0]["counts"]], [&json!(false); 2]);
        let text = expected.render(Page { width: 80, colour: false, terminal: false });
        assert!(text.contains("does not count") && text.contains(note) && !text.contains("missed"), "{text}");
    }

    #[test]
    fn undefined_figures_are_missed_with_the_reason() {
        let found = checked("\"hypsometric_integral\": (-inf, inf)", |_| 7.0);
        let expected = Expected::Checked(found);
        let missed = "1 of 1 expectation missed: `hypsometric_integral` is undefined on this terrain";
        assert_eq!(expected.missed().as_deref(), Some(missed));
        assert_eq!(expected.as_json()[0]["value"], Value::Null);
        let empty = checked("\"spectrum.beta\": (0, 9)", |at| if at == 3 { f32::NAN } else { at as f32 });
        assert!(empty.figures[0].text().contains("the spectrum needs 32 x 32 cells"), "{empty:?}");
    }
}
