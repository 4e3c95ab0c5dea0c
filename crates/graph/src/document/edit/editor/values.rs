//! Edits of the values in the brackets of nodes.

use super::Editor;
use crate::{
    closest,
    document::{
        check::{
            args::{args, kind_of, migrate, version},
            problems::list,
            sea::{self, Own, moved_hint},
        },
        edit::EditError,
        syntax::{
            lex::quote,
            literal::{Literal, constant, number_text, param, value_text},
            parse_value,
        },
    },
    node::{Fallback, Node},
    param::{Kind, ParamValue},
};

impl Editor<'_> {
    pub(in crate::document) fn set_param(
        &mut self,
        node: &str,
        name: &str,
        value: &ParamValue,
    ) -> Result<(), EditError> {
        let kind = self.current(node)?;
        match kind.specs().iter().find(|spec| spec.name == name) {
            Some(spec) if spec.kind.default_value() == *value => self.reset(node, name),
            _ => self.set(node, name, &value_text(value)),
        }
    }

    pub(in crate::document) fn set_constant(&mut self, node: &str, name: &str, value: f64) -> Result<(), EditError> {
        let kind = self.current(node)?;
        match kind.input(name).map(|input| input.fallback) {
            Some(Fallback::Constant { default, .. }) if default == value => self.reset(node, name),
            _ => self.set(node, name, &number_text(value)),
        }
    }

    pub(in crate::document) fn set_text(&mut self, node: &str, name: &str, text: &str) -> Result<(), EditError> {
        let kind = self.current(node)?;
        let text = text.trim();
        let spec = kind.specs().into_iter().find(|spec| spec.name == name);
        let literal = |text: &str| parse_value(text).map_or(Literal::Bad, |expr| Literal::read(&expr, text));
        let fits = match (literal(text), &spec) {
            (Literal::Text(_), _) => true,
            (Literal::Bad | Literal::Other | Literal::NotANumber(_), _) => false,
            (_, Some(spec)) => spec.kind != Kind::File,
            (value, None) => matches!(value, Literal::Number(..)),
        };
        let written = if fits { text.to_owned() } else { quote(text) };
        let default = match (&spec, kind.input(name)) {
            (Some(spec), _) => param(spec, &literal(&written)) == Ok(spec.kind.default_value()),
            (None, Some(input)) => match input.fallback {
                Fallback::Constant { default, .. } => constant(input, &literal(&written)) == Ok(default),
                _ => false,
            },
            (None, None) => false,
        };
        if default { self.reset(node, name) } else { self.set(node, name, &written) }
    }

    /// Migrates a node in the text to the version that this program supports, so that its names and values are current.
    pub(in crate::document) fn current(&mut self, name: &str) -> Result<&'static Node, EditError> {
        let item = self.item(name)?;
        let (node, group) = self.known(item).ok_or_else(|| EditError::Placeholder(name.to_owned()))?;
        let written = group.map_or(Some(1), |group| version(group, &self.draft.source)).unwrap_or(1);
        if written >= node.version {
            return Ok(node);
        }
        let (mut changes, mut added, mut removed) = (Vec::new(), Vec::new(), Vec::new());
        let mut moved = None;
        if let Some(group) = group {
            let mut named = args(group, &self.draft.source);
            let all: Vec<usize> = named.iter().filter_map(|arg| arg.item).collect();
            moved = migrate(&mut named, node, written, &(0..0));
            removed = all.into_iter().filter(|at| named.iter().all(|arg| arg.item != Some(*at))).collect();
            for arg in named {
                match arg.item {
                    Some(_) => {
                        changes.push((arg.name_span, arg.name));
                        if arg.rewritten {
                            changes.push((arg.span, arg.literal.write()));
                        }
                    }
                    None => added.push((arg.name, arg.literal.write())),
                }
            }
        } else {
            let mut named = Vec::new();
            migrate(&mut named, node, written, &(0..0));
            added.extend(named.into_iter().map(|arg| (arg.name, arg.literal.write())));
        }
        self.draft.change(changes);
        for position in removed.into_iter().rev() {
            self.remove_from_node(name, position)?;
        }
        self.write_arg(name, "version", &node.version.to_string())?;
        for (arg, text) in added {
            self.write_arg(name, &arg, &text)?;
        }
        if let Some(moved) = moved
            && let Ok(Some(Own { level: Some(_), .. })) = sea::of_node(node, name, &(0..0), Some(&moved))
        {
            self.give_sea(moved.literal.write());
        }
        Ok(node)
    }

    pub(in crate::document) fn set(&mut self, node: &str, name: &str, text: &str) -> Result<(), EditError> {
        let kind = self.current(node)?;
        has_value(kind, node, name)?;
        self.write_arg(node, name, text)?;
        let wire = parse_value(text).is_some_and(|value| Literal::read(&value, text).as_wire().is_some());
        if wire { Ok(()) } else { self.set_reroutes(node, name, &[]) }
    }

    /// Writes a value into a node's brackets without migrating the node.
    fn write_arg(&mut self, node: &str, name: &str, text: &str) -> Result<(), EditError> {
        let item = self.item(node)?;
        let named = format!("{name}: {text}");
        let changes = match kind_of(&item.value) {
            Some((_, Some(group))) => match group.get(name) {
                Some(arg) => vec![(arg.value.span.clone(), text.to_owned())],
                None => self.draft.insertion(group, &named, false),
            },
            Some((kind, None)) => vec![(kind.end..kind.end, format!("({named})"))],
            None => return Err(EditError::Placeholder(node.to_owned())),
        };
        self.draft.change(changes);
        Ok(())
    }

    pub(in crate::document) fn reset(&mut self, node: &str, name: &str) -> Result<(), EditError> {
        let kind = self.current(node)?;
        has_value(kind, node, name)?;
        let group = kind_of(&self.item(node)?.value).and_then(|(_, group)| group);
        match group.and_then(|group| group.position(name)) {
            Some(position) => {
                self.remove_from_node(node, position)?;
                self.set_reroutes(node, name, &[])
            }
            None => Ok(()),
        }
    }

    fn remove_from_node(&mut self, node: &str, position: usize) -> Result<(), EditError> {
        if let Some((_, Some(group))) = kind_of(&self.item(node)?.value) {
            let changes = self.draft.removal(group, position);
            self.draft.change(changes);
        }
        Ok(())
    }
}

/// Returns true if a kind of node has an input or a parameter of that name.
pub(super) fn has_value(kind: &Node, node: &str, name: &str) -> Result<(), EditError> {
    let specs = kind.specs();
    let names = || kind.inputs.iter().map(|input| input.name).chain(specs.iter().map(|spec| spec.name));
    if names().any(|known| known == name) {
        return Ok(());
    }
    let message = format!("`{node}` ({}) has no input or parameter `{name}`", kind.id);
    if let Some(hint) = moved_hint(kind, name) {
        return Err(EditError::Refused { message, hint: Some(hint) });
    }
    let hint = closest(name, names()).map(|near| format!("did you mean `{near}`?"));
    let hint = hint.unwrap_or_else(|| format!("it has {}", list(names())));
    Err(EditError::Refused { message, hint: Some(hint) })
}
