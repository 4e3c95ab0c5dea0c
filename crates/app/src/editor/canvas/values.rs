//! Parameters copied from one node to others of its kind: values, not wires.

use std::collections::BTreeSet;

use orograph_graph::{Document, Edit, Fallback, Instance};

use super::{
    clip,
    model::{Card, Model},
};
use crate::report::terminal::counted;

/// The text of a node without the wires into it.
pub(super) fn copied(document: &Document, model: &Model, card: &Card) -> Result<String, String> {
    let text = clip::text(document, model, &BTreeSet::from([card.name.clone()]))?;
    let mut copy = Document::parse_in(text, document.folder(), document.registry());
    let cut = copy.loose_wires().iter();
    let cut = cut.map(|wire| Edit::Disconnect { node: wire.node.clone(), input: wire.input.to_owned() });
    copy.apply(&Edit::All(cut.collect())).map_err(|error| error.to_string())?;
    Ok(copy.source().to_owned())
}

/// The edits that give nodes the parameters in a text.
#[derive(Debug)]
pub(super) struct Pasted {
    pub(super) edits: Vec<Edit>,
    /// Number of nodes of the kind in the text.
    pub(super) nodes: usize,
    /// Number of nodes of other kinds, which stay as they are.
    pub(super) others: usize,
}

impl Pasted {
    /// A message about the result.
    pub(super) fn message(&self) -> String {
        let set = match self.edits.is_empty() {
            true => "The parameters are the same already".to_owned(),
            false => format!("Set the parameters of {}", counted(self.nodes, "node")),
        };
        match self.others {
            0 => set,
            1 => format!("{set}; 1 node of another kind was left as it is"),
            others => format!("{set}; {others} nodes of other kinds were left as they are"),
        }
    }
}

/// The edits that give the named nodes the parameters of the first node of their kind in a text. Wires stay.
pub(super) fn pasted(document: &Document, text: &str, names: &BTreeSet<String>) -> Result<Pasted, String> {
    let copy =
        clip::read(text, document).ok_or_else(|| "the clipboard has no parameters; copy them first".to_owned())?;
    let (graph, models) = (document.graph(), copy.graph());
    let models: Vec<&Instance> = models.indices().map(|node| models.instance(node)).collect();
    let mut pasted = Pasted { edits: Vec::new(), nodes: 0, others: 0 };
    for name in names {
        let target = graph.find(name).ok();
        let model = target.and_then(|node| models.iter().find(|model| is_like(model, graph.instance(node))));
        let (Some(node), Some(model)) = (target, model) else {
            pasted.others += 1;
            continue;
        };
        pasted.nodes += 1;
        let wired = |position: usize| graph.source(node, position).is_some();
        pasted.edits.extend(values(name, model, graph.instance(node), wired));
    }
    if pasted.nodes == 0 {
        let kinds: BTreeSet<&str> = models.iter().map(|model| model.node.id).collect();
        let kinds: Vec<&str> = kinds.into_iter().collect();
        return Err(format!("the clipboard has the parameters of {}; select nodes of that kind", kinds.join(", ")));
    }
    Ok(pasted)
}

/// Returns true if two nodes are of one kind; uses of a graph file, if they have the same file.
fn is_like(model: &Instance, target: &Instance) -> bool {
    let file = |instance: &Instance| instance.params.get("file").cloned();
    model.node.id == target.node.id && (!model.node.is_subgraph() || file(model) == file(target))
}

/// The edits that give a node the parameters and numbers of another.
fn values(name: &str, model: &Instance, target: &Instance, wired: impl Fn(usize) -> bool) -> Vec<Edit> {
    let params = model.params.iter().filter(|(param, value)| target.params.get(param) != Some(*value));
    let mut edits: Vec<Edit> = params
        .map(|(param, value)| Edit::SetParam { node: name.to_owned(), param: param.to_owned(), value: value.clone() })
        .collect();
    for (position, input) in target.node.inputs.iter().enumerate() {
        let Fallback::Constant { default, .. } = input.fallback else { continue };
        let number = |instance: &Instance| {
            let position = instance.node.inputs.iter().position(|other| other.name == input.name)?;
            Some(instance.constants.get(position).copied().flatten().unwrap_or(default))
        };
        if let Some(value) = number(model).filter(|value| number(target) != Some(*value) && !wired(position)) {
            edits.push(Edit::SetConstant { node: name.to_owned(), input: input.name.to_owned(), value });
        }
    }
    edits
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    const SOURCE: &str = r#"(nodes: {
        "a": Terrace(version: 2, height: "g", step: 70, mask: 0.5),
        "b": Terrace(version: 2, height: "a", step: 20, mask: "m.mask"),
        "c": Terrace(height: "b", mask: 0.25),
        "g": Ridged(seed: 4),
        "m": Slope(height: "g"),
    }, outputs: { "o": "c" })"#;

    fn names(names: &[&str]) -> BTreeSet<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    #[test]
    fn values_are_copied_and_wires_are_not() {
        let mut document = Document::parse(SOURCE, &orograph_nodes::registry());
        let model = Model::of(&document, &BTreeSet::new(), &mut BTreeMap::new());
        let text = copied(&document, &model, &model.cards[0]).expect("it can be copied");
        assert!(text.contains("step: 70") && !text.contains("\"g\""), "{text}");
        let pasted = pasted(&document, &text, &names(&["b", "c", "g"])).expect("there are such nodes");
        assert_eq!(pasted.message(), "Set the parameters of 2 nodes; 1 node of another kind was left as it is");
        document.apply(&Edit::All(pasted.edits)).expect("they fit");
        let graph = document.graph();
        for (name, wire, mask) in [("b", "a", None), ("c", "b", Some(0.5))] {
            let node = graph.find(name).expect("it is there");
            let instance = graph.instance(node);
            assert_eq!(instance.params.read::<f64>("step"), 70.0, "{name}");
            let position = instance.node.inputs.iter().position(|input| input.name == "mask").expect("declared");
            assert_eq!(instance.constants[position], mask, "{name}");
            assert_eq!(graph.source(node, 0).map(|port| graph.instance(port.node).name.as_str()), Some(wire));
            assert_eq!(graph.source(node, position).is_some(), name == "b");
        }
        assert!(document.undo());
        assert_eq!(document.source(), SOURCE);
    }

    #[test]
    fn other_kinds_and_other_texts_are_refused() {
        let document = Document::parse(SOURCE, &orograph_nodes::registry());
        let refusal = |text: &str| pasted(&document, text, &names(&["m"])).expect_err("it does not fit");
        assert_eq!(refusal("a hill"), "the clipboard has no parameters; copy them first");
        assert_eq!(
            refusal("{ \"x\": Ridged(seed: 9) }"),
            "the clipboard has the parameters of Ridged; select nodes of that kind"
        );
    }
}
