//! Nodes as text for the clipboard: a graph file of the copied nodes, with the wires into them.

use std::collections::{BTreeMap, BTreeSet};

use egui::{Pos2, Vec2};
use orograph_graph::{Document, Edit, LooseWire, NodeEntry, fresh_name};

use super::model::Model;

/// The text of the copied nodes, with all wires into them and their positions.
pub(super) fn text(document: &Document, model: &Model, names: &BTreeSet<String>) -> Result<String, String> {
    let place = |at: Pos2| [f64::from(at.x.round()), f64::from(at.y.round())];
    let places = model.cards.iter().map(|card| (card.name.clone(), place(card.at))).collect();
    document.excerpt(names, &places).map_err(|error| error.to_string())
}

/// The graph in a text: a whole file, its field `nodes: {...}`, or the content of the braces. The files that it names
/// are those of a document.
pub(super) fn read(text: &str, like: &Document) -> Option<Document> {
    let forms = [text.to_owned(), format!("({text})"), format!("(nodes: {text})"), format!("(nodes: {{{text}}})")];
    let documents = forms.into_iter().map(|form| Document::parse_in(form, like.folder(), like.registry()));
    let sound = |document: &Document| document.problems().iter().all(|problem| problem.code != "syntax");
    documents.into_iter().find(|document| sound(document) && !document.nodes().is_empty())
}

/// The result of a paste.
pub(super) struct Pasted {
    pub(super) edits: Vec<Edit>,
    /// The names of the new nodes.
    pub(super) names: Vec<String>,
    /// The outputs of wires that were left out because no compatible output has that name.
    pub(super) left: Vec<String>,
}

impl Pasted {
    /// A message about the wires that were left out. Returns None when there are none.
    pub(super) fn message(&self) -> Option<String> {
        let ends: BTreeSet<&str> = self.left.iter().map(String::as_str).collect();
        let ends: Vec<String> = ends.into_iter().map(|end| format!("`{end}`")).collect();
        match self.left.len() {
            0 => None,
            1 => Some(format!("One wire was left out: no compatible output here is named {}", ends.join(", "))),
            many => Some(format!("{many} wires were left out: no compatible output here is named {}", ends.join(", "))),
        }
    }
}

/// Returns true if the output that a wire of a copy reads is in the document, with a compatible type.
fn fits(document: &Document, copy: &Document, wire: &LooseWire) -> bool {
    let graph = copy.graph();
    let input = graph.find(&wire.node).ok().and_then(|node| graph.instance(node).node.input(wire.input));
    let port = document.graph().port(&wire.from);
    input.zip(port.ok()).is_some_and(|(input, port)| input.ty.accepts(document.graph().output_type(port)))
}

/// The edits that add the nodes of a text, with unused names. Their centre goes to `at`; without it they keep the
/// positions of the text, moved by `shift`. Wires from nodes that are not in the text connect to the outputs of the
/// document with the same names if the types are compatible; others are left out.
pub(super) fn paste(document: &Document, text: &str, at: Option<Pos2>, shift: Vec2) -> Result<Pasted, String> {
    let pasted = with_wires(document, text, at, shift, |copy, wire| fits(document, copy, wire))?;
    // A wire of the document that refers to a name in the text may close a cycle with a wire from outside.
    let outside = document.loose_wires().iter().any(|wire| {
        pasted.names.iter().any(|name| wire.from.split_once('.').map_or(wire.from.as_str(), |(node, _)| node) == name)
    });
    if outside && document.clone().apply(&Edit::All(pasted.edits.clone())).is_err() {
        return with_wires(document, text, at, shift, |_, _| false);
    }
    Ok(pasted)
}

fn with_wires(
    document: &Document,
    text: &str,
    at: Option<Pos2>,
    shift: Vec2,
    keeps: impl Fn(&Document, &LooseWire) -> bool,
) -> Result<Pasted, String> {
    let Some(mut copy) = read(text, document) else {
        return Err("the clipboard has no nodes; copy nodes, or the text of a graph file".to_owned());
    };
    let model = Model::of(&copy, &BTreeSet::new(), &mut BTreeMap::new());
    let places: BTreeMap<String, Pos2> = model.cards.iter().map(|card| (card.name.clone(), card.at)).collect();
    let shift = at.map_or(shift, |at| at - model.bounds(|_| true).center());
    let taken: BTreeSet<&str> = document.nodes().iter().map(|entry| entry.name.as_str()).collect();
    let mut names: Vec<String> = copy.nodes().iter().map(|entry| entry.name.clone()).collect();
    // A new name must not be one that a wire from outside refers to.
    let waits =
        copy.loose_wires().iter().map(|wire| wire.from.split_once('.').map_or(wire.from.as_str(), |(name, _)| name));
    let mut used: BTreeSet<String> = names.iter().map(String::as_str).chain(waits).map(str::to_owned).collect();
    let mut renames = Vec::new();
    let mut moved = Vec::new();
    for name in &mut names {
        let place = places.get(name).copied().unwrap_or_default() + shift;
        if taken.contains(name.as_str()) {
            let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
            let to = fresh_name(stem, |name| taken.contains(name) || used.contains(name));
            used.insert(to.clone());
            renames.push(Edit::RenameNode { from: name.clone(), to: to.clone() });
            *name = to;
        }
        moved.push(place);
    }
    copy.apply(&Edit::All(renames)).map_err(|error| error.to_string())?;
    let left: Vec<LooseWire> = copy.loose_wires().iter().filter(|wire| !keeps(&copy, wire)).cloned().collect();
    let cut = left.iter().map(|wire| Edit::Disconnect { node: wire.node.clone(), input: wire.input.to_owned() });
    copy.apply(&Edit::All(cut.collect())).map_err(|error| error.to_string())?;
    let written = |entry: &NodeEntry| copy.source()[entry.kind_span.start..entry.span.end].to_owned();
    let added = copy.nodes().iter().zip(moved).map(|(entry, at)| Edit::AddWritten {
        name: entry.name.clone(),
        text: written(entry),
        at: Some([f64::from(at.x.round()), f64::from(at.y.round())]),
    });
    let muted = copy.nodes().iter().filter(|entry| entry.muted);
    let muted = muted.map(|entry| Edit::SetMuted { node: entry.name.clone(), muted: true });
    let notes = copy.nodes().iter().filter(|entry| !entry.note.is_empty());
    let notes = notes.map(|entry| Edit::SetNote { node: entry.name.clone(), note: entry.note.clone() });
    let place = |[x, y]: &[f64; 2]| [x + f64::from(shift.x.round()), y + f64::from(shift.y.round())];
    let ways = copy.reroutes().iter().map(|way| Edit::SetReroutes {
        node: way.node.clone(),
        input: way.input.clone(),
        places: way.places.iter().map(place).collect(),
    });
    let left = left.into_iter().map(|wire| wire.from).collect();
    Ok(Pasted { edits: added.chain(muted).chain(notes).chain(ways).collect(), names, left })
}

#[cfg(test)]
mod tests {
    use egui::vec2;

    use super::*;

    const SOURCE: &str = "(nodes: {\n    // the ground\n    \"a\": Ridged(wavelength: \"5 km\" /* long */),\n    \
                          \"b\": Terrace(height: \"a\"),\n    \"c\": Terrace(height: \"b\"),\n}, outputs: { \"o\": \"c\" })";

    fn document() -> Document {
        Document::parse(SOURCE, &orograph_nodes::registry())
    }

    fn model(document: &Document) -> Model {
        Model::of(document, &BTreeSet::new(), &mut BTreeMap::new())
    }

    fn copied(document: &Document, names: &[&str]) -> String {
        let names = names.iter().map(|name| (*name).to_owned()).collect();
        text(document, &model(document), &names).expect("nodes can be copied")
    }

    fn source_of(document: &Document, node: &str, input: usize) -> Option<String> {
        let graph = document.graph();
        let node = graph.find(node).expect("it is there");
        graph.source(node, input).map(|port| graph.port_name(port))
    }

    #[test]
    fn a_copy_is_a_graph_file_with_the_wires_into_its_nodes() {
        let document = document();
        let text = copied(&document, &["b", "c"]);
        let copy = Document::parse(text.clone(), document.registry());
        assert_eq!(copy.nodes().len(), 2, "{text}");
        assert_eq!(source_of(&copy, "c", 0).as_deref(), Some("b.height"));
        let loose = LooseWire { node: "b".into(), input: "height", from: "a".into() };
        assert_eq!(copy.loose_wires(), [loose]);
        assert!(copied(&document, &["a"]).contains("/* long */"));
    }

    #[test]
    fn pasted_nodes_get_new_names_and_keep_their_wires() {
        let mut document = document();
        let text = copied(&document, &["a", "b"]);
        let pasted = paste(&document, &text, None, vec2(24.0, 24.0)).expect("there are nodes");
        assert_eq!(pasted.names, ["a2", "b2"]);
        document.apply(&Edit::All(pasted.edits)).expect("they can be pasted");
        let graph = document.graph();
        let b2 = graph.find("b2").expect("it was pasted");
        assert_eq!(graph.source(b2, 0).map(|port| graph.port_name(port)).as_deref(), Some("a2.height"));
        assert!(document.source().contains("\"a2\": Ridged(wavelength: \"5 km\" /* long */)"), "{}", document.source());
        assert!(document.undo());
        assert_eq!(document.source(), SOURCE);
    }

    #[test]
    fn pasted_nodes_keep_the_inputs_of_the_originals() {
        let mut document = document();
        let text = copied(&document, &["c"]);
        let pasted = paste(&document, &text, None, Vec2::ZERO).expect("there are nodes");
        assert_eq!(pasted.message(), None);
        document.apply(&Edit::All(pasted.edits)).expect("they can be pasted");
        assert_eq!(source_of(&document, "c2", 0).as_deref(), Some("b.height"));
    }

    #[test]
    fn incompatible_wires_are_left_out_with_a_message() {
        let model = Document::parse(
            "(nodes: { \"a\": Ridged(), \"m\": Slope(height: \"a\"), \"t\": Terrace(height: \"a\", mask: \"m\") })",
            &orograph_nodes::registry(),
        );
        let text = copied(&model, &["t"]);
        // `a` is a height there as well, but `m` is not a mask, and `t` is another node.
        let mut other = Document::parse(
            "(nodes: { \"a\": Ridged(), \"m\": Ridged(), \"t\": Ridged() })",
            &orograph_nodes::registry(),
        );
        let pasted = paste(&other, &text, None, Vec2::ZERO).expect("there are nodes");
        assert_eq!((pasted.left.clone(), pasted.names.clone()), (vec!["m".to_owned()], vec!["t2".to_owned()]));
        assert_eq!(pasted.message().as_deref(), Some("One wire was left out: no compatible output here is named `m`"));
        other.apply(&Edit::All(pasted.edits)).expect("they can be pasted");
        assert_eq!((source_of(&other, "t2", 0).as_deref(), source_of(&other, "t2", 2)), (Some("a.height"), None));
        assert!(!other.has_errors(), "{:?}", other.problems());
        let empty = Document::parse("(nodes: {})", &orograph_nodes::registry());
        let pasted = paste(&empty, &text, None, Vec2::ZERO).expect("there are nodes");
        let message = "2 wires were left out: no compatible output here is named `a`, `m`";
        assert_eq!(pasted.message().as_deref(), Some(message));
    }

    #[test]
    fn a_paste_never_closes_a_cycle() {
        // `b` refers to a missing `c`, and a `c` that reads `b` is pasted.
        let mut document =
            Document::parse("(nodes: { \"a\": Ridged(), \"b\": Terrace(height: \"c\") })", &orograph_nodes::registry());
        let pasted = paste(&document, "{ \"c\": Terrace(height: \"b\") }", None, Vec2::ZERO).expect("there are nodes");
        assert_eq!(pasted.left, ["b"]);
        document.apply(&Edit::All(pasted.edits)).expect("they can be pasted");
        assert_eq!(source_of(&document, "b", 0).as_deref(), Some("c.height"));
        assert_eq!(source_of(&document, "c", 0), None);
    }

    #[test]
    fn notes_and_routes_are_copied_with_their_nodes() {
        let mut document = document();
        let route = |node: &str| Edit::SetReroutes {
            node: node.to_owned(),
            input: "height".to_owned(),
            places: vec![[10.0, 20.0]],
        };
        let note = Edit::SetNote { node: "b".to_owned(), note: "steep".to_owned() };
        document.apply(&Edit::All(vec![route("b"), route("c"), note])).expect("they are there");
        let text = copied(&document, &["a", "b"]);
        let pasted = paste(&document, &text, None, vec2(24.0, 48.0)).expect("there are nodes");
        document.apply(&Edit::All(pasted.edits)).expect("they can be pasted");
        let way = document.reroutes().iter().find(|way| way.node == "b2").expect("it came along");
        assert_eq!(way.places, [[34.0, 68.0]]);
        assert!(document.nodes().iter().any(|entry| entry.name == "b2" && entry.note == "steep"));
        // The route of a wire from outside is copied if the wire is.
        let alone = copied(&document, &["c"]);
        assert!(alone.contains("reroutes"), "{alone}");
        let mut other = Document::parse("(nodes: { \"x\": Ridged() })", document.registry());
        let pasted = paste(&other, &alone, None, Vec2::ZERO).expect("there are nodes");
        other.apply(&Edit::All(pasted.edits)).expect("they can be pasted");
        assert_eq!(other.reroutes(), []);
    }

    #[test]
    fn parts_of_files_can_be_pasted_and_other_texts_cannot() {
        let document = document();
        for text in ["nodes: { \"x\": Ridged() }", "{ \"x\": Ridged }", "\"x\": Ridged(),"] {
            let pasted = paste(&document, text, Some(Pos2::ZERO), Vec2::ZERO).expect("there is a node");
            assert_eq!(pasted.names, ["x"], "{text}");
        }
        for text in ["", "a hill", "(nodes: {})", "{ \"x\": ", "[1, 2]"] {
            assert!(paste(&document, text, None, Vec2::ZERO).is_err(), "{text}");
        }
    }
}
