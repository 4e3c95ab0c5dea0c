//! Graph files: parsed, checked, formatted, edited at random, and brought back by undo.

use orograph_graph::{Document, Edit, ParamValue, Registry, World, format_source};

use super::{Attack, PIECES, Taken, graphs};
use crate::dice::Dice;

struct Graphs {
    sources: Vec<String>,
    registry: Registry,
    kinds: Vec<&'static str>,
}

pub(super) fn prepare() -> Box<dyn Attack> {
    let registry = orograph_nodes::registry();
    let kinds = registry.nodes().iter().map(|node| node.id).collect();
    let mut sources = graphs();
    sources.sort_by_key(String::len);
    Box::new(Graphs { sources, registry, kinds })
}

impl Attack for Graphs {
    fn case(&mut self, dice: &mut Dice) -> Result<Taken, String> {
        // More often a short one, which leaves time for more cases.
        let at = dice.number(..self.sources.len()).min(dice.number(..self.sources.len()));
        let mut source = self.sources[at].clone();
        // Sound files take every edit, damaged ones are what others send.
        if !dice.one_in(4) {
            source = dice.damaged_text(&source, &PIECES);
        }
        let mut document = Document::parse(source.clone(), &self.registry);
        let taken = Taken::text(!document.has_errors());
        if taken.accepted {
            let _ = document.expand();
        }
        if dice.one_in(4) {
            formatted(&source)?;
        }
        if dice.one_in(2) {
            return Ok(taken);
        }
        for _ in 0..dice.number(1..6) {
            let before = document.source().to_owned();
            let edit = self.edit(&document, dice);
            match document.apply(&edit) {
                Err(_) if document.source() != before => return Err(format!("a refused edit changed text: {edit:?}")),
                _ => {}
            }
        }
        let end = document.source().to_owned();
        while document.undo() {}
        if document.source() != source {
            return Err("undo did not restore the text".to_owned());
        }
        while document.redo() {}
        if document.source() == end { Ok(taken) } else { Err("redo did not restore the text".to_owned()) }
    }
}

/// Formats a text, and the result once more, which must not change it.
fn formatted(source: &str) -> Result<(), String> {
    let Ok(once) = format_source(source) else { return Ok(()) };
    match format_source(&once) {
        Ok(twice) if twice == once => Ok(()),
        _ => Err("formatting twice gave another text".to_owned()),
    }
}

impl Graphs {
    fn edit(&self, document: &Document, dice: &mut Dice) -> Edit {
        let nodes: Vec<&str> = document.nodes().iter().map(|node| node.name.as_str()).collect();
        let outputs: Vec<&str> = document.outputs().iter().map(|output| output.name.as_str()).collect();
        let name = |names: &[&str], dice: &mut Dice| match dice.number(..8) {
            0 => (*dice.pick(&["", "a", "new", "a.b", "\u{202e}x", "é", "1", "world", "x\"y", "a b"])).to_owned(),
            _ if names.is_empty() => "missing".to_owned(),
            _ => (*dice.pick(names)).to_owned(),
        };
        let node = name(&nodes, dice);
        let declared = document.node(&node).and_then(|entry| self.registry.get(&entry.kind));
        let params: Vec<&str> =
            declared.map_or(Vec::new(), |node| (node.params)().iter().map(|param| param.name).collect());
        let inputs: Vec<&str> =
            declared.map_or(Vec::new(), |node| node.inputs.iter().map(|input| input.name).collect());
        let at = dice.one_in(2).then(|| [dice.float(), dice.float()]);
        let text = || -> &str { "2 km" };
        match dice.number(..19) {
            0 => Edit::AddNode { name: name(&["n1", "n2"], dice), kind: name(&self.kinds, dice), at },
            1 => Edit::RemoveNode { name: node },
            2 => Edit::RenameNode { from: node, to: name(&["r1", "r2"], dice) },
            3 => Edit::SetParam { node, param: name(&params, dice), value: ParamValue::Float(dice.float()) },
            4 | 5 => {
                let typed = ["2 km", "0.3", "max", "(1, 2)", "base.height", "", "\"", "1e400", "[(0, 1)]", "true"];
                let typed = *dice.pick(&typed);
                let typed = if dice.one_in(3) { dice.damaged_text(typed, &PIECES) } else { typed.to_owned() };
                let all = [&params[..], &inputs[..]].concat();
                Edit::SetText { node, name: name(&all, dice), text: typed }
            }
            6 => Edit::Reset { node, name: name(&params, dice) },
            7 | 8 => Edit::Connect { from: name(&nodes, dice), to: node, input: name(&inputs, dice) },
            9 => Edit::Disconnect { node, input: name(&inputs, dice) },
            10 => Edit::SetConstant { node, input: name(&inputs, dice), value: dice.float() },
            11 => Edit::SetOutput { name: name(&outputs, dice), from: node },
            12 => Edit::RemoveOutput { name: name(&outputs, dice) },
            13 => Edit::SetWorld(World { size: [dice.float(), dice.float()], ..document.world() }),
            14 => Edit::SetLayout { node, at },
            15 => Edit::SetNote { node, note: dice.damaged_text(text(), &PIECES) },
            16 => Edit::SetMuted { node, muted: dice.one_in(2) },
            17 => {
                let typed = ["2 km", "0.3", "", "inf", "-1", "(1, 2)", "\"", "1e400"];
                let values = (0..dice.number(..5)).map(|_| dice.one_in(2).then(|| (*dice.pick(&typed)).to_owned()));
                let values = values.collect();
                Edit::SetExpected { name: (*dice.pick(&["relief", "slope.p50", "in", "cell", "x"])).to_owned(), values }
            }
            _ => Edit::Expose { node, name: name(&params, dice), to: name(&["shown", "other"], dice) },
        }
    }
}
