//! Operations on a graph, as edits.

use std::collections::{BTreeMap, BTreeSet};

use egui::{Pos2, Rect, pos2};
use orograph_graph::{Document, Edit, Fallback, Input, Node, NodeIndex, OutputType, ParamValues, Port, PortType};

use super::{
    model::{Area, Card, Model, Side, Spot, Wire, WireName},
    place,
};

/// A position as an edit has it.
pub(super) fn written(at: Pos2) -> [f64; 2] {
    [f64::from(at.x.round()), f64::from(at.y.round())]
}

/// The edit that moves a node to a position.
pub(super) fn put(node: &str, at: Pos2) -> Edit {
    Edit::SetLayout { node: node.to_owned(), at: Some(written(at)) }
}

/// The edit that sets the route of a wire.
pub(super) fn way(wire: &WireName, places: &[Pos2]) -> Edit {
    let places = places.iter().map(|at| [f64::from(at.x.round()), f64::from(at.y.round())]).collect();
    Edit::SetReroutes { node: wire.node.clone(), input: wire.input.to_owned(), places }
}

/// The edits that set the routes of wires to those in the model, if they differ.
pub(super) fn ways<'m>(
    model: &'m Model,
    before: &'m BTreeMap<usize, Vec<Pos2>>,
) -> impl Iterator<Item = Edit> + use<'m> {
    let wires = before.iter().filter_map(|(at, places)| Some((model.wires.get(*at)?, places)));
    wires.filter(|(wire, places)| wire.bends != **places).map(|(wire, _)| way(&model.wire_name(wire), &wire.bends))
}

/// The edits that write the position of every node that has none in the document, so that the canvas does not change.
pub(super) fn settle(model: &Model) -> impl Iterator<Item = Edit> {
    model.cards.iter().filter(|card| !card.placed).map(|card| put(&card.name, card.at))
}

/// The edit that connects two pins, in either order.
pub(super) fn connect(model: &Model, a: Spot, b: Spot) -> Edit {
    let (output, input) = if a.side == Side::Output { (a, b) } else { (b, a) };
    Edit::Connect {
        from: model.port_name(output),
        to: model.cards[input.card].name.clone(),
        input: model.pin(input).name.to_owned(),
    }
}

/// The edit that disconnects a wire.
pub(super) fn disconnect(wire: &WireName) -> Edit {
    Edit::Disconnect { node: wire.node.clone(), input: wire.input.to_owned() }
}

/// The edit that removes nodes and wires. Readers of a removed node, including outputs of the file, read its input
/// instead if the types allow it.
pub(super) fn remove(document: &Document, nodes: &BTreeSet<String>, wires: &BTreeSet<WireName>) -> Edit {
    let graph = document.graph();
    let gone: BTreeSet<NodeIndex> = nodes.iter().filter_map(|name| graph.find(name).ok()).collect();
    let is_cut = |node: NodeIndex, input: usize| {
        let instance = graph.instance(node);
        let input = instance.node.inputs[input].name;
        wires.iter().any(|wire| wire.node == instance.name && wire.input == input)
    };
    // The first output upstream that is not removed.
    let behind = |port: Port, takes: &dyn Fn(PortType) -> bool| {
        let mut port = port;
        loop {
            if !gone.contains(&port.node) {
                return Some(port).filter(|port| takes(graph.output_type(*port)));
            }
            let inputs = 0..graph.instance(port.node).node.inputs.len();
            let sources = inputs.filter(|input| !is_cut(port.node, *input));
            let mut sources = sources.filter_map(|input| graph.source(port.node, input));
            port = sources.find(|source| takes(graph.output_type(*source)))?;
        }
    };
    let mut edits: Vec<Edit> = wires.iter().filter(|wire| !nodes.contains(&wire.node)).map(disconnect).collect();
    for node in graph.indices().filter(|node| !gone.contains(node)) {
        let instance = graph.instance(node);
        for (position, input) in instance.node.inputs.iter().enumerate() {
            let Some(source) = graph.source(node, position).filter(|source| gone.contains(&source.node)) else {
                continue;
            };
            if is_cut(node, position) {
                continue;
            }
            if let Some(port) = behind(source, &|ty| input.ty.accepts(ty)) {
                let (to, input) = (instance.name.clone(), input.name.to_owned());
                edits.push(Edit::Connect { from: graph.port_name(port), to, input });
            }
        }
    }
    for output in document.outputs().iter().filter(|output| gone.contains(&output.port.node)) {
        if let Some(port) = behind(output.port, &|ty| ty == output.ty) {
            edits.push(Edit::SetOutput { name: output.name.clone(), from: graph.port_name(port) });
        }
    }
    edits.extend(nodes.iter().map(|name| Edit::RemoveNode { name: name.clone() }));
    Edit::All(edits)
}

/// The type of an output of a new node. Returns None when it is not known yet.
fn new_output_type(node: &Node, output: usize) -> PortType {
    match node.outputs[output].ty {
        OutputType::Fixed(ty) => ty,
        OutputType::Chosen(choose) => choose(&ParamValues::defaults(&node.specs())),
        OutputType::SameAs(_) => PortType::Height,
    }
}

/// The best input of a node type for a wire of this type: a required one of exactly this type.
pub(super) fn input_for(node: &Node, ty: PortType) -> Option<&'static str> {
    let fitting = node.inputs.iter().filter(|input| input.ty.accepts(ty));
    fitting.min_by_key(|input| (input.ty != ty, input.fallback != Fallback::Required)).map(|input| input.name)
}

/// The wire from a node to a new one of a type: from the first output that a required input of the type accepts, or
/// else from the first one of the same type as an optional input.
pub(super) fn follow(card: &Card, kind: &Node, name: &str) -> Option<Edit> {
    let required = |input: &&Input, ty: PortType| input.fallback == Fallback::Required && input.ty.accepts(ty);
    let optional = |input: &&Input, ty: PortType| input.fallback == Fallback::None && input.ty == ty;
    let wire = |fits: &dyn Fn(&&Input, PortType) -> bool| {
        card.outputs.iter().find_map(|output| {
            let input = kind.inputs.iter().find(|input| fits(input, output.ty))?;
            let from = format!("{}.{}", card.name, output.name);
            Some(Edit::Connect { from, to: name.to_owned(), input: input.name.to_owned() })
        })
    };
    wire(&required).or_else(|| wire(&optional))
}

/// Gap between cards that make room for a new one.
pub(super) const GAP: f32 = 36.0;

/// The edits that move a card, and all cards that read it, to the right, so that a new card fits before it.
pub(super) fn aside(model: &Model, first: usize, right: f32) -> Vec<Edit> {
    let by = right + GAP - model.cards[first].at.x;
    if by <= 0.0 {
        return Vec::new();
    }
    let mut moved = BTreeSet::from([first]);
    let mut next = vec![first];
    while let Some(card) = next.pop() {
        let readers = model.wires.iter().filter(|wire| wire.from.card == card).map(|wire| wire.to.card);
        next.extend(readers.filter(|reader| moved.insert(*reader)));
    }
    let shifted = |card: &usize| {
        let card = &model.cards[*card];
        put(&card.name, place::on_grid(card.at + egui::vec2(by + place::STEP - 1.0, 0.0)))
    };
    moved.iter().map(shifted).collect()
}

/// The output of a node type that fits an input of this type; `wired` is the wired input of the new node and its type.
pub(super) fn output_for(node: &Node, takes: PortType, wired: Option<(&str, PortType)>) -> Option<&'static str> {
    let ty = |output: usize| match (node.outputs[output].ty, wired) {
        (OutputType::SameAs(input), Some((name, ty))) if input == name => ty,
        // It takes the type of the wire that will be connected.
        (OutputType::SameAs(input), None) if node.input(input).is_some_and(|input| input.ty.accepts(takes)) => takes,
        _ => new_output_type(node, output),
    };
    (0..node.outputs.len()).find(|output| takes.accepts(ty(*output))).map(|output| node.outputs[output].name)
}

/// The wires that insert a node type into a wire, by the name of the node: from the wire's source, and to its end.
pub(super) fn into_wire(model: &Model, wire: &Wire, kind: &Node, name: &str) -> Option<[Edit; 2]> {
    let input = input_for(kind, wire.ty)?;
    let output = output_for(kind, model.pin(wire.to).ty, Some((input, wire.ty)))?;
    Some([
        Edit::Connect { from: model.port_name(wire.from), to: name.to_owned(), input: input.to_owned() },
        Edit::Connect {
            from: format!("{name}.{output}"),
            to: model.cards[wire.to.card].name.clone(),
            input: model.pin(wire.to).name.to_owned(),
        },
    ])
}

/// Margins between the cards of a frame and its edges: left and right, top (with the title bar), and bottom.
const AROUND: [f32; 3] = [24.0, 48.0, 24.0];
/// The smallest margins, used next to other cards.
const LEAST: [f32; 3] = [6.0, 36.0, 6.0];
/// Sizes of an empty frame; the largest that fits is used.
const EMPTY: [egui::Vec2; 3] = [egui::vec2(360.0, 216.0), egui::vec2(240.0, 144.0), egui::vec2(144.0, 96.0)];
/// How far from the pointer to look for free space, in grid steps.
const REACH: i32 = 40;

/// A frame around cards and everything between them; without cards, an empty frame near a position, where there is
/// space. Its edge cuts no card. `seen` is the visible part of the graph.
pub(super) fn frame(model: &Model, cards: &[usize], name: &str, at: Pos2, seen: Rect) -> Edit {
    let rect = if cards.is_empty() { room(model, at, seen) } else { around(model, cards) };
    let area = Area { name: name.to_owned(), rect, note: String::new(), colour: None };
    let frame = Edit::SetFrame { name: name.to_owned(), frame: Some(area.frame()) };
    Edit::All(settle(model).chain([frame]).collect())
}

/// A rectangle around cards, and around those that it would cut.
fn around(model: &Model, cards: &[usize]) -> Rect {
    let mut inside = cards.iter().fold(Rect::NOTHING, |all, card| all.union(model.cards[*card].rect()));
    let padded = |inside: Rect, [side, above, below]: [f32; 3]| {
        let rect = Rect::from_min_max(inside.min - egui::vec2(side, above), inside.max + egui::vec2(side, below));
        Rect::from_min_max(place::on_grid(rect.min), place::on_grid(rect.max))
    };
    loop {
        let touched = |rect: Rect| {
            let others = model.cards.iter().map(Card::rect).filter(move |card| !inside.contains_rect(*card));
            others.filter(move |card| card.intersects(rect.shrink(0.5)))
        };
        let wide = padded(inside, AROUND);
        if touched(wide).next().is_none() {
            return wide;
        }
        let narrow = padded(inside, LEAST);
        match touched(narrow).reduce(Rect::union) {
            None => return narrow,
            Some(more) => inside = inside.union(more),
        }
    }
}

/// A free rectangle with its corner near a position: it overlaps no card and cuts no frame.
fn room(model: &Model, at: Pos2, seen: Rect) -> Rect {
    let at = place::on_grid(at);
    let free = |rect: Rect| {
        let apart = |card: &Card| !card.rect().expand(2.0 * place::STEP).intersects(rect);
        let uncut = |area: &Area| area.rect.contains_rect(rect) || !area.rect.intersects(rect);
        model.cards.iter().all(apart) && model.areas.iter().all(uncut)
    };
    for size in EMPTY {
        let steps = || (-REACH..=REACH).map(|step| step as f32 * place::STEP);
        let places = steps().flat_map(|x| steps().map(move |y| Rect::from_min_size(at + egui::vec2(x, y), size)));
        // Positions outside the visible part are worse.
        let cost = |rect: &Rect| {
            let hidden = rect.size() - rect.intersect(seen).size().max(egui::Vec2::ZERO);
            (rect.min - at).length() + 2.0 * (hidden.x + hidden.y)
        };
        let mut places: Vec<Rect> = places.collect();
        places.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
        if let Some(found) = places.into_iter().find(|rect| free(*rect)) {
            return found;
        }
    }
    let below = model.extent().max.y + 2.0 * place::STEP;
    Rect::from_min_size(place::on_grid(egui::pos2(at.x, below)), EMPTY[0])
}

/// Ways to align cards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::editor) enum Alignment {
    Left,
    Top,
    /// Equal gaps from the leftmost to the rightmost card.
    Across,
    /// Equal gaps from the topmost to the lowest card.
    Down,
}

impl Alignment {
    pub(in crate::editor) const ALL: [Self; 4] = [Self::Left, Self::Top, Self::Across, Self::Down];

    /// Its name in menus.
    pub(in crate::editor) const fn name(self) -> &'static str {
        match self {
            Self::Left => "Left edges",
            Self::Top => "Top edges",
            Self::Across => "Distribute horizontally",
            Self::Down => "Distribute vertically",
        }
    }
}

/// Aligns cards. Returns None when there is nothing to align.
pub(super) fn align(model: &Model, cards: &[usize], how: Alignment) -> Option<Edit> {
    let rects: Vec<_> = cards.iter().map(|card| model.cards[*card].rect()).collect();
    let all = rects.iter().copied().reduce(Rect::union)?;
    let mut places: BTreeMap<usize, Pos2> = BTreeMap::new();
    match how {
        Alignment::Left => places.extend(cards.iter().map(|card| (*card, pos2(all.min.x, model.cards[*card].at.y)))),
        Alignment::Top => places.extend(cards.iter().map(|card| (*card, pos2(model.cards[*card].at.x, all.min.y)))),
        Alignment::Across | Alignment::Down => {
            let axis = usize::from(how == Alignment::Down);
            let mut order = cards.to_vec();
            order.sort_by(|a, b| model.cards[*a].at[axis].total_cmp(&model.cards[*b].at[axis]));
            let filled: f32 = rects.iter().map(|rect| rect.size()[axis]).sum();
            // Overlapping cards are put side by side.
            let gap = ((all.size()[axis] - filled) / (cards.len() as f32 - 1.0).max(1.0)).max(place::STEP);
            let mut next = all.min[axis];
            for card in order {
                let mut at = model.cards[card].at;
                at[axis] = next;
                next += model.cards[card].size()[axis] + gap;
                places.insert(card, at);
            }
        }
    }
    moved(model, places)
}

/// Arranges cards in layers along the wires among them; the top left corner stays.
pub(super) fn arrange(model: &Model, cards: &[usize]) -> Option<Edit> {
    let corner = cards.iter().map(|card| model.cards[*card].rect()).reduce(Rect::union)?.min;
    let corner = place::on_grid(corner).to_vec2();
    let places = place::layered(model, |card| cards.contains(&card));
    let moved = moved(model, places.into_iter().map(|(card, at)| (card, at + corner)).collect())?;
    // Routes for the old positions are removed.
    let among: BTreeSet<&str> = cards.iter().map(|card| model.cards[*card].name.as_str()).collect();
    let ways = model.ways_among(|name| among.contains(name));
    let straight = ways.into_keys().map(|at| way(&model.wire_name(&model.wires[at]), &[]));
    Some(Edit::All(straight.chain([moved]).collect()))
}

/// Moves cards to positions, in one edit; all other positions are written too.
pub(super) fn moved(model: &Model, places: BTreeMap<usize, Pos2>) -> Option<Edit> {
    let changed: BTreeMap<usize, Pos2> =
        places.into_iter().filter(|(card, at)| (*at - model.cards[*card].at).length() > 0.5).collect();
    if changed.is_empty() {
        return None;
    }
    let others = model.cards.iter().enumerate().filter(|(card, other)| !other.placed && !changed.contains_key(card));
    let others = others.map(|(_, card)| put(&card.name, card.at));
    let moved = changed.iter().map(|(card, at)| put(&model.cards[*card].name, *at));
    Some(Edit::All(moved.chain(others).collect()))
}

#[cfg(test)]
mod tests {
    use orograph_graph::Registry;

    use super::*;

    fn registry() -> Registry {
        orograph_nodes::registry()
    }

    #[test]
    fn readers_of_a_removed_node_read_its_input() {
        let mut document = Document::parse(
            "(nodes: { \"a\": Ridged(), \"b\": Terrace(height: \"a\"), \"c\": Terrace(height: \"b\"), \
             \"d\": Terrace(height: \"c\") }, outputs: { \"o\": \"c\" })",
            &registry(),
        );
        assert!(!document.has_errors(), "{:?}", document.problems());
        let both = BTreeSet::from(["b".to_owned(), "c".to_owned()]);
        document.apply(&remove(&document, &both, &BTreeSet::new())).expect("nodes may be removed");
        let graph = document.graph();
        let d = graph.find("d").expect("it is still there");
        assert_eq!(graph.source(d, 0).map(|port| graph.port_name(port)).as_deref(), Some("a.height"));
        assert_eq!(document.outputs().len(), 1);
        assert_eq!(document.nodes().len(), 2);
        assert!(document.undo());
        assert_eq!(document.nodes().len(), 4);
    }

    fn framed(source: &str, cards: &[&str], at: Pos2) -> (Model, Rect) {
        let mut document = Document::parse(source, &registry());
        let model = |document: &Document| Model::of(document, &BTreeSet::new(), &mut BTreeMap::new());
        let before = model(&document);
        let cards: Vec<usize> = cards.iter().map(|name| before.find(name).expect("it is there")).collect();
        let seen = Rect::from_min_size(pos2(-600.0, -400.0), egui::vec2(1600.0, 1400.0));
        document.apply(&frame(&before, &cards, "f", at, seen)).expect("a frame may stand there");
        let after = model(&document);
        let rect = after.areas[after.area("f").expect("it was added")].rect;
        (after, rect)
    }

    /// The cards that the edge of a frame cuts, and those inside it.
    fn cut_and_held(model: &Model, rect: Rect) -> (usize, Vec<&str>) {
        let held: Vec<&Card> = model.cards.iter().filter(|card| rect.contains_rect(card.rect())).collect();
        let met = model.cards.iter().filter(|card| rect.intersects(card.rect())).count();
        (met - held.len(), held.into_iter().map(|card| card.name.as_str()).collect())
    }

    const SPREAD: &str = "(nodes: { \"a\": Ridged(), \"b\": Terrace(height: \"a\"), \"c\": Slope(height: \"b\"), \"d\": Ridged() }, \
         layout: { \"a\": (0, 0), \"b\": (300, 60), \"c\": (600, 0), \"d\": (20, 306) })";

    #[test]
    fn an_empty_frame_is_placed_in_free_space() {
        for at in [pos2(90.0, 90.0), pos2(-100.0, -30.0), pos2(420.0, 40.0), pos2(200.0, 100.0), pos2(0.0, 600.0)] {
            let (model, rect) = framed(SPREAD, &[], at);
            assert_eq!(cut_and_held(&model, rect), (0, Vec::new()), "{at} {rect}");
            assert!((rect.min - at).length() < 400.0, "{at} {rect}");
        }
        // Where there is space it starts at the pointer.
        assert_eq!(framed(SPREAD, &[], pos2(0.0, 660.0)).1, Rect::from_min_size(pos2(0.0, 660.0), EMPTY[0]));
        // It may lie in another frame, but does not cut it.
        let within = SPREAD.replace("layout:", "frames: { \"o\": (at: (0, 600), size: (480, 300)) }, layout:");
        let (model, rect) = framed(&within, &[], pos2(60.0, 640.0));
        let other = model.areas[model.area("o").expect("it is there")].rect;
        assert!(other.contains_rect(rect) || !other.intersects(rect), "{other} {rect}");
    }

    #[test]
    fn a_frame_includes_nodes_that_it_would_cut() {
        let (model, rect) = framed(SPREAD, &["a", "c"], Pos2::ZERO);
        assert_eq!(cut_and_held(&model, rect), (0, vec!["a", "b", "c"]), "{rect}");
        // Below `a` there is space for the smallest margins, but not for those of a free-standing frame.
        let (model, rect) = framed(SPREAD, &["d"], Pos2::ZERO);
        assert_eq!(cut_and_held(&model, rect).0, 0, "{rect}");
        let (model, rect) = framed(SPREAD, &["b"], Pos2::ZERO);
        assert_eq!(cut_and_held(&model, rect), (0, vec!["b"]));
        assert_eq!(rect.min, pos2(276.0, 12.0));
    }

    #[test]
    fn every_node_from_heights_to_heights_can_be_inserted_in_a_wire() {
        for node in registry().nodes() {
            let Some(input) = input_for(node, PortType::Height) else { continue };
            let given = output_for(node, PortType::Height, Some((input, PortType::Height)));
            if let Some(OutputType::SameAs(typed_by)) = node.outputs.first().map(|output| output.ty)
                && typed_by == input
            {
                assert!(given.is_some(), "{}", node.id);
            }
        }
    }
}
