//! The outputs of a file.

use std::collections::BTreeMap;

use petgraph::stable_graph::NodeIndex;

use super::{Checker, OutputDecl, wires};
use crate::{
    diagnostic::Diagnostic,
    document::syntax::{Group, literal::Literal},
    graph::Port,
    value::PortType,
};

impl Checker<'_> {
    pub(super) fn outputs(
        &mut self,
        root: &Group,
        entries: &BTreeMap<String, Option<NodeIndex>>,
        types: &BTreeMap<Port, PortType>,
    ) {
        let group = match root.get("outputs") {
            Some(item) => match self.map(&item.value, "outputs", "`{ \"name\": \"node.port\", … }`") {
                Some(group) => group,
                None => return,
            },
            None => root,
        };
        if group.items.is_empty() || std::ptr::eq(group, root) {
            if self.problems.has_syntax_in(&(0..self.source.len())) {
                return;
            }
            let place = group.open..group.open + 1;
            let problem = Diagnostic::warning("no-outputs", place, "the file has no outputs, so a run writes nothing");
            self.problems.push(problem.hint("write `outputs: { \"height\": \"node\" }`"));
            return;
        }
        for (name, item) in self.problems.duplicates(group, "in `outputs`") {
            self.check_name(name, item, "an output");
            let literal = Literal::read(&item.value, self.source);
            let span = &item.value.span;
            let Some(end) = literal.as_wire() else {
                let takes = "a node, or one of its outputs, in quotes";
                self.problems.misplaced(&item.value, name, takes, self.source);
                continue;
            };
            let what = format!("output `{name}`");
            if let Some(port) = wires::resolve(&self.out.graph, end, &what, span, entries, &mut self.problems) {
                // An unknown type is treated as a height, as in the graph.
                let ty = types.get(&port).copied().unwrap_or(PortType::Height);
                if !ty.is_writable() {
                    let message = format!("output `{name}` is {}, which cannot be written to a file", ty.one());
                    let problem = Diagnostic::error("not-writable", span.clone(), message);
                    let hint = self.writable(port, types);
                    self.problems.push(problem.hint(hint));
                }
                self.out.outputs.push(OutputDecl {
                    name: name.to_owned(),
                    port,
                    ty,
                    layers: [true; 4],
                    span: item.span(),
                });
            }
        }
    }

    /// Advice on what to write instead of an output that cannot be written.
    fn writable(&self, port: Port, types: &BTreeMap<Port, PortType>) -> String {
        let outputs = 0..self.out.graph.instance(port.node).node.outputs.len();
        let ports = outputs.map(|output| Port { node: port.node, output });
        let names: Vec<String> = ports
            .filter(|port| types.get(port).is_some_and(|ty| ty.is_writable()))
            .map(|port| format!("`{}`", self.out.graph.port_name(port)))
            .collect();
        match names.split_last() {
            Some((last, [])) => format!("write {last}"),
            Some((last, rest)) => format!("write {} or {last}", rest.join(", ")),
            None => "wire it to a node, and write what that gives".to_owned(),
        }
    }
}
