//! All kinds of nodes, looked up by id.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use crate::{
    document::{EXPECT_FIELDS, SUBGRAPH},
    job::NodeError,
    node::{Fallback, Input, MeasureSpec, Node, OutputType},
    param::{Kind, ParamSpec, When, check_value},
    suggest::closest,
    world::Extent,
};

/// Reads the world that a raster file fills.
pub type ExtentOf = fn(&Path) -> Result<Extent, NodeError>;

/// The kinds of nodes of a program, in palette order.
#[derive(Clone, Debug, Default)]
pub struct Registry {
    extent_of: Option<ExtentOf>,
    nodes: Vec<&'static Node>,
    by_id: BTreeMap<&'static str, &'static Node>,
}

impl Registry {
    /// A registry of the listed nodes, in that order.
    #[must_use]
    pub fn new(nodes: impl IntoIterator<Item = &'static Node>) -> Self {
        let nodes: Vec<&'static Node> = nodes.into_iter().collect();
        let mut by_id = BTreeMap::new();
        for node in &nodes {
            for alias in node.aliases {
                by_id.insert(*alias, *node);
            }
        }
        by_id.extend(nodes.iter().map(|node| (node.id, *node)));
        Self { nodes, by_id, extent_of: None }
    }

    /// The same registry for files whose world may come from a raster file, read by this function.
    #[must_use]
    pub fn with_extent_of(self, extent_of: ExtentOf) -> Self {
        Self { extent_of: Some(extent_of), ..self }
    }

    /// Reads the world that a raster file fills. Returns None if the program reads no rasters.
    #[must_use]
    pub fn extent_of(&self, file: &Path) -> Option<Result<Extent, NodeError>> {
        self.extent_of.map(|of| of(file))
    }

    /// The node of that id or alias.
    #[must_use]
    pub fn get(&self, id: &str) -> Option<&'static Node> {
        self.by_id.get(id).copied().or((id == SUBGRAPH.id).then_some(&SUBGRAPH))
    }

    /// All nodes with a kernel, in palette order.
    #[must_use]
    pub fn nodes(&self) -> &[&'static Node] {
        &self.nodes
    }

    /// All nodes that a file may use: those with a kernel, and [`SUBGRAPH`], in palette order.
    pub fn listed(&self) -> impl Iterator<Item = &'static Node> {
        self.nodes.iter().copied().chain([&SUBGRAPH])
    }

    /// The measures of a height, in palette order: the names of expectations.
    pub fn measures(&self) -> impl Iterator<Item = &'static MeasureSpec> {
        self.nodes.iter().filter(|node| node.measures_height()).flat_map(|node| node.measures)
    }

    /// The id closest to a misspelt one.
    #[must_use]
    pub fn suggest(&self, id: &str) -> Option<&'static str> {
        closest(id, self.listed().map(|node| node.id))
    }

    /// Checks the declarations as data: names, documentation, defaults within ranges, versions and migrations.
    ///
    /// Returns one line per fault, each beginning with the node's id; empty for a valid registry.
    #[must_use]
    pub fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        let mut ids = BTreeSet::new();
        let mut measures = BTreeSet::new();
        for node in &self.nodes {
            for measure in node.measures.iter().filter(|measure| !measures.insert(measure.name)) {
                faults.push(format!("{}: the measure `{}` is declared twice", node.id, measure.name));
            }
            for id in node.aliases.iter().chain([&node.id]) {
                if !ids.insert(*id) {
                    faults.push(format!("{id}: the id is used twice"));
                }
            }
            let mut found = Vec::new();
            check_node(node, &mut found);
            faults.extend(found.into_iter().map(|fault| format!("{}: {fault}", node.id)));
        }
        faults
    }
}

fn check_node(node: &'static Node, faults: &mut Vec<String>) {
    if !is_pascal_case(node.id) {
        faults.push("the id is not one word in PascalCase".into());
    }
    check_sentence("summary", node.summary, faults);
    if node.doc.is_empty() {
        faults.push("it has no documentation".into());
    }
    if node.category.is_empty() || !is_snake_case(node.category) {
        faults.push("the category is not a word in lower case".into());
    }
    if node.outputs.is_empty() {
        faults.push("it has no output".into());
    }
    let mut names = BTreeSet::new();
    for input in node.inputs {
        check_name(input.name, input.doc, &mut names, faults);
        check_fallback(input, faults);
    }
    for spec in node.specs() {
        check_name(spec.name, spec.doc, &mut names, faults);
        if let Err(error) = check_value(&spec, &spec.kind.default_value()) {
            faults.push(format!("default of {error}"));
        }
        check_ranges(spec.name, &spec.kind, faults);
        check_settings(node, &spec, faults);
    }
    let mut outputs = BTreeSet::new();
    for output in node.outputs {
        check_name(output.name, output.doc, &mut outputs, faults);
        if let OutputType::SameAs(input) = output.ty
            && node.input(input).is_none()
        {
            faults.push(format!("output `{}` is typed by `{input}`, which is not an input", output.name));
        }
    }
    for measure in node.measures {
        check_measure(measure, faults);
    }
    for (step, from) in node.migrations.iter().zip(1..) {
        if step.from != from {
            faults.push(format!("migration {} starts from version {}", from, step.from));
        }
    }
    if node.migrations.len() as u32 + 1 != node.version {
        faults.push(format!("version {} needs {} migrations", node.version, node.version.saturating_sub(1)));
    }
}

fn check_sentence(what: &str, text: &str, faults: &mut Vec<String>) {
    let first = text.lines().next().unwrap_or("").trim();
    if first.is_empty() || !first.ends_with('.') || first.chars().count() > 120 {
        faults.push(format!("the first line of the {what} is not a sentence of at most 120 characters"));
    }
}

fn check_name(name: &'static str, doc: &str, names: &mut BTreeSet<&'static str>, faults: &mut Vec<String>) {
    if !is_snake_case(name) {
        faults.push(format!("`{name}` is not in snake case"));
    }
    if !names.insert(name) {
        faults.push(format!("`{name}` is declared twice"));
    }
    if name == "version" {
        faults.push("`version` is the name of a node's version in a file".into());
    }
    check_sentence(&format!("documentation of `{name}`"), doc, faults);
}

/// A measure has a name that is not a field of `expect`.
fn check_measure(measure: &MeasureSpec, faults: &mut Vec<String>) {
    if EXPECT_FIELDS.contains(&measure.name) || !measure.name.split('.').all(is_snake_case) {
        faults.push(format!("the measure `{}` is not in snake case, or it is a field of `expect`", measure.name));
    }
    check_sentence(&format!("documentation of the measure `{}`", measure.name), measure.doc, faults);
}

fn check_fallback(input: &Input, faults: &mut Vec<String>) {
    if let Fallback::Constant { default, hard, soft } = input.fallback {
        check_order(input.name, hard, soft, default, faults);
        if input.ty.planes() != Some(1) {
            faults.push(format!("`{}` cannot be a number", input.name));
        }
    }
}

fn check_ranges(name: &str, kind: &Kind, faults: &mut Vec<String>) {
    match kind {
        Kind::Float { default, hard, soft } => check_order(name, *hard, *soft, *default, faults),
        Kind::Int { default, hard, soft } => {
            check_order(name, hard.map(|v| v as f64), soft.map(|v| v as f64), *default as f64, faults);
        }
        _ => {}
    }
}

/// The setting of a `when` must name a choice or a switch of the node, and some but not all of its values; an input must be
/// one that may be left without a wire.
fn check_settings(node: &Node, spec: &ParamSpec, faults: &mut Vec<String>) {
    for when in spec.when {
        let (param, is) = match when {
            When::Setting { param, is } => (param, is),
            When::NonZero(param) => {
                let number = |other: &ParamSpec| match other.kind {
                    Kind::Float { hard: [low, high], .. } => low <= 0.0 && high >= 0.0,
                    Kind::Int { hard: [low, high], .. } => low <= 0 && high >= 0,
                    _ => false,
                };
                if !node.specs().iter().any(|other| other.name == *param && other.name != spec.name && number(other)) {
                    faults
                        .push(format!("`{}` has an effect where {when}, which is no number that may be 0", spec.name));
                }
                continue;
            }
            When::Empty(param) => {
                let list = |other: &ParamSpec| other.kind.default_value().is_empty();
                if !node.specs().iter().any(|other| other.name == *param && other.name != spec.name && list(other)) {
                    faults.push(format!("`{}` has an effect where {when}, which is no table", spec.name));
                }
                continue;
            }
            When::Wired(input) | When::Unwired(input) => {
                let optional = |other: &&Input| other.name == *input && other.fallback != Fallback::Required;
                if !node.inputs.iter().any(|other| optional(&other)) {
                    faults.push(format!("`{}` has an effect where {when}, which is no optional input", spec.name));
                }
                continue;
            }
        };
        let other = node.specs().into_iter().find(|other| other.name == *param && other.name != spec.name);
        let names = match other.map(|other| other.kind) {
            Some(Kind::Choice { options, .. }) => options.iter().map(|(name, _)| *name).collect(),
            Some(Kind::Bool { .. }) => vec!["false", "true"],
            _ => Vec::new(),
        };
        if is.iter().any(|name| !names.contains(name)) || is.len() >= names.len() || is.is_empty() {
            faults.push(format!("`{}` has an effect where {when}, which is not a setting of the node", spec.name));
        }
    }
}

fn check_order(name: &str, hard: [f64; 2], soft: [f64; 2], default: f64, faults: &mut Vec<String>) {
    let ordered = hard[0] <= soft[0] && soft[0] <= soft[1] && soft[1] <= hard[1];
    if !ordered || !(hard[0]..=hard[1]).contains(&default) {
        faults.push(format!("the ranges of `{name}` are not nested: {hard:?}, {soft:?}, {default}"));
    }
}

fn is_snake_case(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
}

fn is_pascal_case(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_uppercase()) && name.chars().all(|c| c.is_ascii_alphanumeric())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Migration, Output, PortType, Unit};

    const SOUND: Node = Node {
        id: "Sound",
        category: "test",
        summary: "A sentence.",
        doc: "Text.",
        outputs: &[Output::gives("height", PortType::Height, "A sentence.")],
        ..Node::DEFAULT
    };
    static FINE: Node = SOUND;
    static ALIASED: Node = Node { id: "Renamed", aliases: &["Former"], ..SOUND };

    fn faults(node: &'static Node) -> String {
        Registry::new([node]).faults().join("\n")
    }

    #[test]
    fn nodes_are_found_by_id_and_by_former_id() {
        let registry = Registry::new([&FINE, &ALIASED]);
        assert_eq!(registry.faults(), Vec::<String>::new());
        assert_eq!(registry.get("Former").map(|node| node.id), Some("Renamed"));
        assert_eq!(registry.suggest("Sonud"), Some("Sound"));
        assert!(registry.get("sound").is_none());
    }

    #[test]
    fn bad_names_and_sentences_are_found() {
        static BAD: Node = Node {
            id: "bad_id",
            summary: "no full stop",
            doc: "",
            inputs: &[Input::mask("Mask", "A sentence.")],
            ..SOUND
        };
        let found = faults(&BAD);
        for part in ["PascalCase", "summary is not a sentence", "no documentation", "`Mask` is not in snake case"] {
            assert!(found.contains(part), "{part} is not in:\n{found}");
        }
    }

    #[test]
    fn ids_and_names_that_clash_are_found() {
        static TWICE: Node =
            Node { inputs: &[Input::mask("mask", "A sentence."), Input::mask("mask", "A sentence.")], ..SOUND };
        assert!(faults(&TWICE).contains("`mask` is declared twice"));
        assert!(Registry::new([&FINE, &TWICE]).faults().join("\n").contains("used twice"));
    }

    #[test]
    fn ranges_and_defaults_that_do_not_fit_are_found() {
        static LOOSE: Node = Node {
            inputs: &[Input::number("rate", Unit::One, 2.0, [0.0, 1.0], [0.0, 3.0], "A sentence.")],
            params: || {
                vec![ParamSpec {
                    name: "gain",
                    doc: "A sentence.",
                    unit: Unit::One,
                    kind: Kind::Float { default: 5.0, hard: [0.0, 1.0], soft: [0.0, 1.0] },
                    when: &[],
                }]
            },
            ..SOUND
        };
        let found = faults(&LOOSE);
        assert!(found.contains("ranges of `rate` are not nested") && found.contains("default of `gain`"), "{found}");
    }

    #[test]
    fn settings_that_no_choice_has_are_found() {
        static ODD: Node = Node {
            params: || {
                let switch = Kind::Bool { default: false };
                let spec =
                    |name, when| ParamSpec { name, doc: "A sentence.", unit: Unit::One, kind: switch.clone(), when };
                vec![
                    spec("dry", &[]),
                    spec("fine", &[When::Setting { param: "dry", is: &["true"] }]),
                    spec("always", &[When::Setting { param: "dry", is: &["true", "false"] }]),
                    spec("never", &[When::Setting { param: "dry", is: &["wet"] }]),
                    spec("lost", &[When::Setting { param: "gone", is: &["true"] }]),
                    spec("own", &[When::Setting { param: "own", is: &["true"] }]),
                    spec("fed", &[When::Wired("mask")]),
                    spec("bare", &[When::Unwired("mask")]),
                    spec("stray", &[When::Unwired("dry")]),
                    spec("none", &[When::NonZero("dry")]),
                    spec("some", &[When::NonZero("amount")]),
                    spec("drawn", &[When::Empty("dry")]),
                    ParamSpec {
                        kind: Kind::Float { default: 5.0, hard: [0.0, 9.0], soft: [0.0, 9.0] },
                        ..spec("amount", &[])
                    },
                ]
            },
            inputs: &[Input::mask("mask", "A sentence.")],
            ..SOUND
        };
        let found = faults(&ODD);
        assert_eq!(found.matches("which is not a setting of the node").count(), 4, "{found}");
        assert!(
            found.contains("`stray` has an effect where `dry` is not wired, which is no optional input"),
            "{found}"
        );
        assert!(found.contains("`drawn` has an effect where `dry` is empty, which is no table"), "{found}");
        assert!(found.contains("`none` has an effect where `dry` is not 0, which is no number"), "{found}");
        assert!(!["`fine`", "`fed`", "`bare`", "`some`"].iter().any(|sound| found.contains(sound)), "{found}");
    }

    #[test]
    fn measures_have_distinct_names_and_sentences() {
        const RELIEF: MeasureSpec = MeasureSpec { name: "peaks.max", unit: "m", doc: "A sentence." };
        static RULER: Node = Node { category: "measure", inputs: &[HEIGHT], measures: &[RELIEF], id: "Ruler", ..SOUND };
        static OTHER: Node = Node {
            measures: &[
                RELIEF,
                MeasureSpec { name: "cell", ..RELIEF },
                MeasureSpec { doc: "none", name: "a.B", unit: "" },
            ],
            ..SOUND
        };
        const HEIGHT: Input = Input::needs("height", PortType::Height, "A sentence.");
        let registry = Registry::new([&RULER, &FINE]);
        assert_eq!(registry.faults(), Vec::<String>::new());
        assert_eq!(registry.measures().collect::<Vec<_>>(), [&RELIEF]);
        let found = Registry::new([&RULER, &OTHER]).faults().join("\n");
        for part in
            ["`peaks.max` is declared twice", "`cell` is not in", "`a.B` is not in", "of the measure `a.B` is not"]
        {
            assert!(found.contains(part), "{part} is not in:\n{found}");
        }
    }

    #[test]
    fn versions_need_their_migrations() {
        static NEWER: Node = Node { version: 2, ..SOUND };
        static WRONG: Node = Node { version: 2, migrations: &[Migration { from: 3, steps: &[] }], ..SOUND };
        assert!(faults(&NEWER).contains("version 2 needs 1 migrations"));
        assert!(faults(&WRONG).contains("starts from version 3"));
    }
}
