//! How an edit changes the text: each of its steps is a splice at the places of the tree, which is then read again.

use std::ops::Range;

use super::{
    args::{args, kind_of, migrate, version},
    edit::EditError,
    exposed::{Section, is_list, places, places_of},
    frames::Frame,
    lex::{Bracket, quote},
    literal::{Literal, constant, is_name, number_text, param, value_text},
    problems::Problems,
    splice::Draft,
    subgraph::{self, Home, Loader},
    syntax::{self, Group, Item, parse_value},
    world,
};
use crate::{
    closest,
    node::{Fallback, Node},
    param::{Kind, ParamValue},
    registry::Registry,
    world::{Boundary, Edge, World},
};

/// A text that stands for a wire.
struct WireUse {
    /// The text with its quotes.
    span: Range<usize>,
    /// The part after the name, with its point.
    port: String,
    /// The node and its input; `None` where it stands in a node that is not known.
    input: Option<(String, String)>,
}

/// Carries out edits on a draft.
pub(super) struct Editor<'a> {
    draft: &'a mut Draft,
    registry: &'a Registry,
    home: &'a Home,
}

impl<'a> Editor<'a> {
    pub(super) fn new(draft: &'a mut Draft, registry: &'a Registry, home: &'a Home) -> Self {
        Self { draft, registry, home }
    }

    fn items(&self, field: &str) -> &[Item] {
        self.draft.field(field).map_or(&[], |group| &group.items)
    }

    pub(super) fn item(&self, name: &str) -> Result<&Item, EditError> {
        self.draft.field("nodes").and_then(|nodes| nodes.get(name)).ok_or_else(|| {
            let names = self.items("nodes").iter().filter_map(|item| item.key.as_ref());
            let suggestion = closest(name, names.map(|key| key.text.as_str())).map(str::to_owned);
            EditError::UnknownNode { name: name.to_owned(), suggestion }
        })
    }

    /// The place of an output's name.
    fn output(&self, name: &str) -> Result<Range<usize>, EditError> {
        let item = self.draft.field("outputs").and_then(|outputs| outputs.get(name));
        item.and_then(|item| item.key.as_ref())
            .map(|key| key.span.clone())
            .ok_or_else(|| EditError::UnknownOutput(name.to_owned()))
    }

    /// The kind of a node, and its brackets. A `Subgraph` has what its file declares, where the file can be used.
    fn known<'i>(&self, item: &'i Item) -> Option<(&'static Node, Option<&'i Group>)> {
        let (kind, group) = kind_of(&item.value)?;
        let mut node = self.registry.get(&self.draft.source[kind])?;
        if node.is_subgraph()
            && let Some(file) = subgraph::file_of(group, &self.draft.source)
            && let Ok(inner) = Loader::new(self.home).load(&self.home.folder.join(file), self.registry)
        {
            node = subgraph::interface(&inner);
        }
        let version = group.map_or(Some(1), |group| version(group, &self.draft.source))?;
        (version <= node.version).then_some((node, group))
    }

    pub(super) fn add_node(&mut self, name: &str, kind: &str, at: Option<[f64; 2]>) -> Result<(), EditError> {
        if !is_name(kind) {
            return Err(refused(format!("`{}` is no kind of node", kind.escape_debug())));
        }
        let version = self.registry.get(kind).map_or(1, |node| node.version);
        let version = if version > 1 { format!("version: {version}") } else { String::new() };
        self.add_written(name, &format!("{kind}({version})"), at)
    }

    /// Adds a node as it is written in a file.
    pub(super) fn add_written(&mut self, name: &str, text: &str, at: Option<[f64; 2]>) -> Result<(), EditError> {
        if self.draft.field("nodes").is_some_and(|nodes| nodes.get(name).is_some()) {
            return Err(refused(format!("there is a node `{name}` already")));
        }
        let (tree, problems) = syntax::parse(text);
        if !problems.is_empty() || tree.root.as_ref().and_then(kind_of).is_none() {
            return Err(refused(format!("`{}` is no node", text.escape_debug())));
        }
        self.insert_entry("nodes", name, text);
        if at.is_some() {
            self.set_layout(name, at);
        }
        Ok(())
    }

    pub(super) fn remove_node(&mut self, name: &str) -> Result<(), EditError> {
        self.item(name)?;
        for (node, input) in self.wires(name).into_iter().filter_map(|wire| wire.input) {
            if node != name {
                self.reset(&node, &input)?;
            }
        }
        let outputs: Vec<String> = self
            .items("outputs")
            .iter()
            .filter(|item| wire_end(item, &self.draft.source).is_some_and(|end| node_of(&end) == name))
            .filter_map(|item| item.key.as_ref().map(|key| key.text.clone()))
            .collect();
        for output in outputs {
            self.remove_entry("outputs", &output);
        }
        self.forget_places(name);
        self.set_muted(name, false)?;
        self.remove_entry("layout", name);
        self.remove_entry("nodes", name);
        Ok(())
    }

    pub(super) fn rename_node(&mut self, from: &str, to: &str) -> Result<(), EditError> {
        self.item(from)?;
        if from != to && self.item(to).is_ok() {
            return Err(refused(format!("there is a node `{to}` already")));
        }
        let mut changes = Vec::new();
        for field in ["nodes", "layout"] {
            let keys = self.items(field).iter().filter_map(|item| item.key.as_ref());
            changes.extend(keys.filter(|key| key.text == from).map(|key| (key.span.clone(), quote(to))));
        }
        changes.extend(self.muted(from).map(|item| (item.value.span.clone(), quote(to))));
        for wire in self.wires(from) {
            changes.push((wire.span, quote(&format!("{to}{}", wire.port))));
        }
        for item in self.items("outputs") {
            if let Some(end) = wire_end(item, &self.draft.source).filter(|end| node_of(end) == from) {
                changes.push((item.value.span.clone(), quote(&format!("{to}{}", &end[from.len()..]))));
            }
        }
        for section in Section::ALL {
            for item in self.items(section.field()) {
                let of_node = places(&item.value, section, &self.draft.source);
                let of_node = of_node.into_iter().filter(|(text, _)| node_of(text) == from);
                changes.extend(of_node.map(|(text, span)| (span, quote(&format!("{to}{}", &text[from.len()..])))));
            }
        }
        self.draft.change(changes);
        Ok(())
    }

    /// Takes the places of a node out of the file's `inputs` and `parameters`, with the names that lead nowhere else.
    fn forget_places(&mut self, node: &str) {
        for section in Section::ALL {
            loop {
                let found = self.items(section.field()).iter().enumerate().find_map(|(position, item)| {
                    let all = places(&item.value, section, &self.draft.source);
                    let gone = all.iter().find(|(text, _)| node_of(text) == node).map(|(_, span)| span.clone())?;
                    Some((position, item.value.span.clone(), gone, all.len()))
                });
                let Some((position, value, gone, count)) = found else { break };
                let Some(group) = self.draft.field(section.field()) else { break };
                let changes = match count {
                    1 => self.draft.removal(group, position),
                    _ => self.draft.removal_within(value, &gone),
                };
                if changes.is_empty() {
                    break;
                }
                self.draft.change(changes);
            }
        }
    }

    /// Sets a parameter of the file at all its places.
    pub(super) fn set_named(&mut self, name: &str, text: &str) -> Result<(), EditError> {
        let section = Section::Parameters;
        let Some(item) = self.draft.field(section.field()).and_then(|group| group.get(name)) else {
            return Err(self.unknown_name(name, &[section]));
        };
        for (place, _) in places(&item.value, section, &self.draft.source) {
            if let Some((node, part)) = place.split_once('.') {
                self.set_text(node, part, text)?;
            }
        }
        Ok(())
    }

    /// That no entry has this name, with one that is near, or all there are.
    fn unknown_name(&self, name: &str, sections: &[Section]) -> EditError {
        let items = sections.iter().flat_map(|section| self.items(section.field()));
        let names: Vec<&str> = items.filter_map(|item| Some(item.key.as_ref()?.text.as_str())).collect();
        let hint = match closest(name, names.iter().copied()) {
            Some(near) => Some(format!("did you mean `{near}`?")),
            None if names.is_empty() => Some("write `node.param`".to_owned()),
            None => Some(format!("it has {}", super::problems::list(names))),
        };
        EditError::UnknownParameter { name: name.to_owned(), hint }
    }

    /// Gives a value of a node a name of the file.
    pub(super) fn expose(&mut self, node: &str, name: &str, to: &str) -> Result<(), EditError> {
        let kind = self.current(node)?;
        has_value(kind, node, name)?;
        let body = kind_of(&self.item(node)?.value).and_then(|(_, group)| group);
        let wired =
            body.and_then(|group| group.get(name)).and_then(|item| wire_end(item, &self.draft.source)).is_some();
        let section = match kind.input(name) {
            Some(input) if wired || !matches!(input.fallback, Fallback::Constant { .. }) => Section::Inputs,
            _ => Section::Parameters,
        };
        let place = quote(&format!("{node}.{name}"));
        let Some(item) = self.draft.field(section.field()).and_then(|group| group.get(to)) else {
            self.insert_entry(section.field(), to, &place);
            return Ok(());
        };
        let Some(said) = places_of(&item.value, section) else { return Ok(()) };
        let changes = match said.as_group().filter(|group| is_list(group)) {
            Some(group) => self.draft.insertion(group, &place, false),
            None => vec![(said.span.clone(), format!("[{}, {place}]", &self.draft.source[said.span.clone()]))],
        };
        self.draft.change(changes);
        Ok(())
    }

    /// The section in which a name stands.
    fn section_of(&self, name: &str) -> Result<Section, EditError> {
        let stands =
            |section: &Section| self.draft.field(section.field()).is_some_and(|group| group.get(name).is_some());
        Section::ALL.into_iter().find(stands).ok_or_else(|| self.unknown_name(name, &Section::ALL))
    }

    pub(super) fn conceal(&mut self, name: &str) -> Result<(), EditError> {
        let section = self.section_of(name)?;
        self.remove_entry(section.field(), name);
        Ok(())
    }

    pub(super) fn rename_named(&mut self, from: &str, to: &str) -> Result<(), EditError> {
        let section = self.section_of(from)?;
        let key =
            self.draft.field(section.field()).and_then(|group| group.get(from)).and_then(|item| item.key.as_ref());
        if let Some(span) = key.map(|key| key.span.clone()) {
            self.draft.change(vec![(span, quote(to))]);
        }
        Ok(())
    }

    /// All texts in nodes that are wires from a node; in nodes that are not known, all that look like one.
    fn wires(&self, from: &str) -> Vec<WireUse> {
        let source = self.draft.source.as_str();
        let mut uses = Vec::new();
        for item in self.items("nodes") {
            let Some(group) = kind_of(&item.value).and_then(|(_, group)| group) else { continue };
            let mut named = args(group, source);
            // A file that cannot be used does not say which texts are wires.
            let known = self.known(item).map(|(node, _)| node).filter(|node| !std::ptr::eq(*node, &subgraph::SUBGRAPH));
            if let Some(node) = known {
                migrate(&mut named, node, version(group, source).unwrap_or(1), &(0..0));
            }
            for arg in named {
                let end = arg.literal.as_wire().filter(|end| node_of(end) == from);
                if let Some(end) = end
                    && arg.item.is_some()
                    && known.is_none_or(|node| node.input(&arg.name).is_some())
                {
                    let key = item.key.as_ref().map_or_else(String::new, |key| key.text.clone());
                    let port = end[from.len()..].to_owned();
                    uses.push(WireUse { span: arg.span, port, input: known.map(|_| (key, arg.name)) });
                }
            }
        }
        uses
    }

    pub(super) fn remove_output(&mut self, name: &str) -> Result<(), EditError> {
        self.output(name)?;
        self.remove_entry("outputs", name);
        Ok(())
    }

    pub(super) fn rename_output(&mut self, from: &str, to: &str) -> Result<(), EditError> {
        let span = self.output(from)?;
        self.draft.change(vec![(span, quote(to))]);
        Ok(())
    }

    pub(super) fn set_param(&mut self, node: &str, name: &str, value: &ParamValue) -> Result<(), EditError> {
        let kind = self.current(node)?;
        match kind.specs().iter().find(|spec| spec.name == name) {
            Some(spec) if spec.kind.default_value() == *value => self.reset(node, name),
            _ => self.set(node, name, &value_text(value)),
        }
    }

    pub(super) fn set_constant(&mut self, node: &str, name: &str, value: f64) -> Result<(), EditError> {
        let kind = self.current(node)?;
        match kind.input(name).map(|input| input.fallback) {
            Some(Fallback::Constant { default, .. }) if default == value => self.reset(node, name),
            _ => self.set(node, name, &number_text(value)),
        }
    }

    pub(super) fn set_text(&mut self, node: &str, name: &str, text: &str) -> Result<(), EditError> {
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

    /// Brings a node to the version that this program knows, in the text, so that its names and values are today's.
    fn current(&mut self, name: &str) -> Result<&'static Node, EditError> {
        let item = self.item(name)?;
        let (node, group) = self.known(item).ok_or_else(|| EditError::Placeholder(name.to_owned()))?;
        let written = group.map_or(Some(1), |group| version(group, &self.draft.source)).unwrap_or(1);
        if written >= node.version {
            return Ok(node);
        }
        let (mut changes, mut added, mut removed) = (Vec::new(), Vec::new(), Vec::new());
        if let Some(group) = group {
            let mut named = args(group, &self.draft.source);
            let all: Vec<usize> = named.iter().filter_map(|arg| arg.item).collect();
            migrate(&mut named, node, written, &(0..0));
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
        Ok(node)
    }

    pub(super) fn set(&mut self, node: &str, name: &str, text: &str) -> Result<(), EditError> {
        let kind = self.current(node)?;
        has_value(kind, node, name)?;
        self.write_arg(node, name, text)
    }

    /// Writes a value in a node's brackets as they stand.
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

    pub(super) fn reset(&mut self, node: &str, name: &str) -> Result<(), EditError> {
        let kind = self.current(node)?;
        has_value(kind, node, name)?;
        let group = kind_of(&self.item(node)?.value).and_then(|(_, group)| group);
        match group.and_then(|group| group.position(name)) {
            Some(position) => self.remove_from_node(node, position),
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

    /// A wire without the name of the first output, which is understood.
    pub(super) fn short_wire(&self, end: &str) -> String {
        let node = self.item(node_of(end)).ok().and_then(|item| self.known(item));
        match (end.split_once('.'), node) {
            (Some((name, port)), Some((node, _))) if node.output_index(port) == Some(0) => name.to_owned(),
            _ => end.to_owned(),
        }
    }

    pub(super) fn set_layout(&mut self, node: &str, at: Option<[f64; 2]>) {
        match at {
            Some([x, y]) => self.set_entry("layout", node, &format!("({}, {})", number_text(x), number_text(y))),
            None => self.remove_entry("layout", node),
        }
    }

    pub(super) fn set_entry(&mut self, field: &str, name: &str, text: &str) {
        match self.draft.field(field).and_then(|group| group.get(name)) {
            Some(item) => {
                let change = (item.value.span.clone(), text.to_owned());
                self.draft.change(vec![change]);
            }
            None => self.insert_entry(field, name, text),
        }
    }

    /// Adds `"name": text` to a field of the file, which is added where it is missing.
    fn insert_entry(&mut self, field: &str, name: &str, text: &str) {
        if self.draft.field(field).is_none() {
            self.set_root(field, "{}");
        }
        let Some(group) = self.draft.field(field) else { return };
        let key = quote(name);
        // The value stands below the one before it, where there is room.
        let column = group.items.last().and_then(|item| {
            let gap = item.span().start..item.value.span.start;
            (!self.draft.source[gap.clone()].contains('\n')).then_some(gap.len())
        });
        let width = match field {
            "nodes" => column.unwrap_or(0).max(key.len() + 2) - 1,
            _ => key.len() + 1,
        };
        let entry = format!("{:<width$} {text}", format!("{key}:"));
        let changes = self.draft.insertion(group, &entry, field == "nodes");
        self.draft.change(changes);
    }

    fn remove_entry(&mut self, field: &str, name: &str) {
        let Some(group) = self.draft.field(field) else { return };
        if let Some(position) = group.position(name) {
            let changes = self.draft.removal(group, position);
            self.draft.change(changes);
        }
    }

    fn set_root(&mut self, field: &str, text: &str) {
        let Some(root) = self.draft.root() else { return };
        let changes = match root.get(field) {
            Some(item) => vec![(item.value.span.clone(), text.to_owned())],
            None => self.draft.insertion(root, &format!("{field}: {text}"), true),
        };
        self.draft.change(changes);
    }

    /// The entries of a node in `muted`.
    fn muted(&self, node: &str) -> impl Iterator<Item = &Item> {
        let names = |item: &&Item| Literal::read(&item.value, &self.draft.source) == Literal::Text(node.to_owned());
        self.items("muted").iter().filter(names)
    }

    pub(super) fn set_muted(&mut self, node: &str, muted: bool) -> Result<(), EditError> {
        self.item(node)?;
        let stands = self.muted(node).next().is_some();
        if muted && !stands {
            match self.draft.root().and_then(|root| root.get("muted")).map(|item| item.value.as_group()) {
                None => self.set_root("muted", &format!("[{}]", quote(node))),
                Some(Some(list)) if list.bracket == Bracket::Square => {
                    let changes = self.draft.insertion(list, &quote(node), false);
                    self.draft.change(changes);
                }
                Some(_) => return Err(refused("what the file says as `muted` is no list".to_owned())),
            }
        }
        while !muted && self.muted(node).next().is_some() {
            let Some(list) = self.draft.field("muted") else { break };
            let names = |item: &Item| Literal::read(&item.value, &self.draft.source) == Literal::Text(node.to_owned());
            let Some(position) = list.items.iter().position(names) else { break };
            let changes = self.draft.removal(list, position);
            self.draft.change(changes);
        }
        if stands && !muted {
            self.remove_empty("muted");
        }
        Ok(())
    }

    /// Removes a field of the file that has become empty, with nothing lost.
    fn remove_empty(&mut self, field: &str) {
        let Some(root) = self.draft.root() else { return };
        let (Some(position), Some(group)) = (root.position(field), self.draft.field(field)) else { return };
        let inner = group.open + 1..group.close.unwrap_or(group.open + 1);
        if self.draft.source[inner].trim().is_empty() {
            let changes = self.draft.removal(root, position);
            self.draft.change(changes);
        }
    }

    pub(super) fn set_frame(&mut self, name: &str, frame: Option<&Frame>) -> Result<(), EditError> {
        let Some(frame) = frame else {
            self.frame(name)?;
            self.remove_entry("frames", name);
            self.remove_empty("frames");
            return Ok(());
        };
        let fields = frame.fields();
        let group = |editor: &Self| {
            let item = editor.draft.field("frames")?.get(name)?;
            item.value.as_group().filter(|group| group.name.is_none() && group.bracket == Bracket::Round).cloned()
        };
        if group(self).is_none() {
            let said = fields.iter().filter_map(|(field, text)| Some(format!("{field}: {}", text.as_ref()?)));
            let text = format!("({})", said.collect::<Vec<_>>().join(", "));
            self.set_entry("frames", name, &text);
            return Ok(());
        }
        for (field, text) in fields {
            let Some(group) = group(self) else { break };
            let changes = match (text, group.position(field)) {
                (Some(text), Some(at)) => vec![(group.items[at].value.span.clone(), text)],
                (Some(text), None) => self.draft.insertion(&group, &format!("{field}: {text}"), false),
                (None, Some(at)) => self.draft.removal(&group, at),
                (None, None) => Vec::new(),
            };
            self.draft.change(changes);
        }
        Ok(())
    }

    pub(super) fn rename_frame(&mut self, from: &str, to: &str) -> Result<(), EditError> {
        let span = self.frame(from)?;
        if from != to && self.frame(to).is_ok() {
            return Err(refused(format!("there is a frame `{to}` already")));
        }
        self.draft.change(vec![(span, quote(to))]);
        Ok(())
    }

    /// The place of a frame's name.
    fn frame(&self, name: &str) -> Result<Range<usize>, EditError> {
        let item = self.draft.field("frames").and_then(|frames| frames.get(name));
        let key = item.and_then(|item| item.key.as_ref());
        key.map(|key| key.span.clone()).ok_or_else(|| EditError::UnknownFrame(name.to_owned()))
    }

    pub(super) fn set_world(&mut self, world: &World) {
        let default = World::default();
        let now = self.world();
        let pair = |[x, y]: [String; 2]| format!("({x}, {y})");
        if now.is_none_or(|now| now.seed != world.seed) {
            self.set_world_field("seed", (world.seed != default.seed).then(|| world.seed.to_string()));
        }
        if now.is_none_or(|now| now.boundary != world.boundary) {
            let text = (world.boundary != default.boundary).then(|| boundary_text(&world.boundary));
            self.set_world_field("boundary", text);
        }
        if now.is_none_or(|now| now.size != world.size) {
            let text = (world.size != default.size).then(|| pair(world.size.map(number_text)));
            self.set_world_field("size", text);
        }
        let differs = |now: World| now.size != world.size || now.cells != world.cells;
        if self.world().is_none_or(differs) {
            self.set_world_field("cells", None);
            // Without a word the cells follow from the size, which may be what is wanted.
            if self.world().is_none_or(differs) {
                self.set_world_field("cells", Some(pair(world.cells.map(|cells| cells.to_string()))));
            }
        }
    }

    /// The world the file says; `None` where that is wrong.
    fn world(&self) -> Option<World> {
        let Some(item) = self.draft.root().and_then(|root| root.get("world")) else { return Some(World::default()) };
        let mut problems = Problems::new(Vec::new());
        let world = world::read(&item.value, &self.draft.source, &mut problems);
        problems.is_empty().then_some(world)
    }

    fn set_world_field(&mut self, name: &str, text: Option<String>) {
        let world = self.draft.root().and_then(|root| root.get("world")).map(|item| &item.value);
        match (world.and_then(|value| value.as_group()), text) {
            (Some(group), Some(text)) => {
                let changes = match group.get(name) {
                    Some(item) => vec![(item.value.span.clone(), text)],
                    None => self.draft.insertion(group, &format!("{name}: {text}"), false),
                };
                self.draft.change(changes);
            }
            (Some(group), None) => {
                if let Some(position) = group.position(name) {
                    let changes = self.draft.removal(group, position);
                    self.draft.change(changes);
                }
            }
            (None, Some(text)) => self.set_root("world", &format!("({name}: {text})")),
            (None, None) => {}
        }
    }
}

fn refused(message: String) -> EditError {
    EditError::Refused { message, hint: None }
}

/// Whether a kind of node has an input or a parameter of that name.
fn has_value(kind: &Node, node: &str, name: &str) -> Result<(), EditError> {
    let specs = kind.specs();
    let names = || kind.inputs.iter().map(|input| input.name).chain(specs.iter().map(|spec| spec.name));
    if names().any(|known| known == name) {
        return Ok(());
    }
    let message = format!("`{node}` ({}) has no input or parameter `{name}`", kind.id);
    let hint = closest(name, names()).map(|near| format!("did you mean `{near}`?"));
    Err(EditError::Refused { message, hint })
}

/// What an entry is wired to.
fn wire_end(item: &Item, source: &str) -> Option<String> {
    Literal::read(&item.value, source).as_wire().map(str::to_owned)
}

/// The node that a wire's end names.
fn node_of(end: &str) -> &str {
    end.split_once('.').map_or(end, |(name, _)| name)
}

fn boundary_text(boundary: &Boundary) -> String {
    let sides =
        [("west", boundary.west), ("east", boundary.east), ("north", boundary.north), ("south", boundary.south)];
    if sides.iter().all(|(_, edge)| *edge == boundary.west) {
        return boundary.west.name().to_owned();
    }
    let said = sides.iter().filter(|(_, edge)| *edge != Edge::default());
    format!("({})", said.map(|(side, edge)| format!("{side}: {}", edge.name())).collect::<Vec<_>>().join(", "))
}
