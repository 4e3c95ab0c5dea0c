//! The node palette: all node types, searchable by name, category and description.

use egui::{Align, Id, Pos2, Sense, Ui, Vec2, vec2};
use orograph_graph::{Document, Edit, Node, PortType};

use super::{
    Canvas, Session, commands,
    list::{self, ListKeys},
    look::Look,
    model::{Model, PAD, PICTURE, ROW, Side, TITLE, WIDTH, WireName},
    place,
};
use crate::editor::window::names::Named as _;

/// Width of the palette, and height of its list, in points.
const SIZE: [f32; 2] = [300.0, 264.0];
/// Height of a row of the list.
const LINE: f32 = 24.0;

/// The purpose for which a node is chosen.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Purpose {
    /// Add a node without wires.
    Add,
    /// Add a node at the end of a wire from an output or to an input.
    Wire {
        /// The pin, as `node.port`.
        end: String,
        /// Its side.
        side: Side,
    },
    /// Insert a node into a wire.
    Insert(WireName),
}

/// The open palette.
#[derive(Debug)]
pub(super) struct Palette {
    /// Its position in the window.
    at: Pos2,
    /// Where to add the node, in the graph.
    place: Pos2,
    purpose: Purpose,
    query: String,
    /// Index of the highlighted type.
    marked: usize,
    /// Number of frames since it was opened.
    frames: u32,
}

impl Palette {
    pub(super) const fn new(at: Pos2, place: Pos2, purpose: Purpose) -> Self {
        Self { at, place, purpose, query: String::new(), marked: 0, frames: 0 }
    }

    /// Takes text that is typed before the palette is shown, except the space that opens it.
    pub(super) fn typed(&mut self, text: &str) {
        self.query.push_str(if self.query.is_empty() { text.trim_start() } else { text });
    }
}

/// How well a node type matches a search. Returns None when it does not match; all words of the search must match.
fn score(node: &Node, query: &str) -> Option<u32> {
    let id = node.id.to_lowercase();
    let initials: String = node.id.chars().filter(char::is_ascii_uppercase).collect::<String>().to_lowercase();
    query.to_lowercase().split_whitespace().try_fold(0, |sum, word| {
        let begins =
            |text: &str| text.to_lowercase().split(|c: char| !c.is_alphanumeric()).any(|w| w.starts_with(word));
        let found = match id.find(word) {
            _ if id == word => 200,
            _ if word.len() > 1 && initials == word => 160,
            Some(0) => 150,
            _ if word.len() > 1 && initials.starts_with(word) => 120,
            _ if node.category.starts_with(word) => 110,
            Some(_) => 100,
            None if begins(node.summary) => 60,
            None => match scattered(&id, word) {
                Some(gaps) => 50_u32.saturating_sub(gaps).max(20),
                None if word.len() > 2 && begins(node.doc) => 10,
                None => return None,
            },
        };
        Some(sum + found)
    })
}

/// The number of letters between those of `word` in `text`. Returns None when they do not occur in this order.
fn scattered(text: &str, word: &str) -> Option<u32> {
    let mut wanted = word.chars().peekable();
    let mut gaps = 0;
    for letter in text.chars() {
        if wanted.peek() == Some(&letter) {
            wanted.next();
        } else if wanted.peek().is_some() && wanted.size_hint().0 < word.len() {
            gaps += 1;
        }
    }
    (word.len() > 1 && wanted.peek().is_none()).then_some(gaps)
}

/// The node types that match a search and suit the purpose, the best first.
fn found(document: &Document, model: &Model, purpose: &Purpose, query: &str) -> Vec<&'static Node> {
    let fits = |node: &Node| match purpose {
        Purpose::Add => true,
        Purpose::Wire { end, side } => {
            let Some(ty) = pin_type(model, end, *side) else { return false };
            match side {
                Side::Output => commands::input_for(node, ty).is_some(),
                Side::Input => commands::output_for(node, ty, None).is_some(),
            }
        }
        Purpose::Insert(wire) => {
            model.wire(wire).is_some_and(|wire| commands::into_wire(model, wire, node, "x").is_some())
        }
    };
    let kinds = document.registry().listed().filter(|node| fits(node));
    let mut kinds: Vec<(u32, &Node)> = kinds.filter_map(|node| Some((score(node, query)?, node))).collect();
    kinds.sort_by_key(|(score, _)| std::cmp::Reverse(*score));
    kinds.into_iter().map(|(_, node)| node).collect()
}

fn pin_type(model: &Model, end: &str, side: Side) -> Option<PortType> {
    let (node, pin) = end.split_once('.')?;
    let card = &model.cards[model.find(node)?];
    card.pins(side).iter().find(|known| known.name == pin).map(|pin| pin.ty)
}

impl Canvas {
    pub(super) fn palette_ui(&mut self, ui: &mut Ui, session: &mut Session) {
        let Some(mut palette) = self.palette.take() else { return };
        let kinds = found(session.document(), &self.model, &palette.purpose, &palette.query);
        let keys = ListKeys::take(ui);
        palette.marked = keys.marked(palette.marked, kinds.len());
        let mut chosen = None;
        let area = egui::Area::new(Id::new("palette"))
            .order(egui::Order::Foreground)
            .fixed_pos(palette.at + vec2(-24.0, -18.0))
            .constrain_to(ui.ctx().content_rect().shrink(6.0))
            .show(ui.ctx(), |ui| {
                egui::Frame::popup(ui.style()).show(ui, |ui| {
                    ui.set_width(SIZE[0].min(ui.ctx().content_rect().width() - 40.0));
                    if let Some(kind) = palette.show(ui, &self.model, &kinds, keys.moves()) {
                        chosen = Some(kind);
                    }
                });
            });
        if keys.enter && chosen.is_none() {
            // Letters may have arrived in the same frame.
            let kinds = found(session.document(), &self.model, &palette.purpose, &palette.query);
            chosen = kinds.get(palette.marked).copied();
        }
        palette.frames += 1;
        let outside = list::left(ui, palette.frames, area.response.rect);
        match chosen {
            Some(kind) => {
                self.insert(ui, session, &palette, kind);
            }
            None if keys.escape || outside => {}
            None => self.palette = Some(palette),
        }
        if self.palette.is_none() {
            ui.memory_mut(|memory| memory.request_focus(Id::new("canvas")));
        }
    }

    /// Adds the chosen type, with the requested wires.
    fn insert(&mut self, ui: &Ui, session: &mut Session, palette: &Palette, kind: &'static Node) {
        let model = &self.model;
        let name = orograph_graph::fresh_name(&kind.id.to_lowercase(), |name| model.find(name).is_some());
        let first_pin = TITLE + PICTURE + 2.0 * PAD + ROW / 2.0;
        let mut room = None;
        let (wires, corner) = match &palette.purpose {
            Purpose::Add => {
                let selected = session.selected().and_then(|node| model.find(node));
                let wire = selected.and_then(|card| commands::follow(&model.cards[card], kind, &name));
                (wire.into_iter().collect::<Vec<_>>(), vec2(WIDTH / 2.0, TITLE / 2.0))
            }
            Purpose::Wire { end, side } => {
                let Some(ty) = pin_type(model, end, *side) else { return };
                let connect =
                    |from: String, to: String, input: &str| Edit::Connect { from, to, input: input.to_owned() };
                match side {
                    Side::Output => {
                        let input = commands::input_for(kind, ty);
                        let wire = input.map(|input| connect(end.clone(), name.clone(), input));
                        (wire.into_iter().collect(), vec2(0.0, first_pin))
                    }
                    Side::Input => {
                        let output = commands::output_for(kind, ty, None);
                        let wire = output.zip(end.split_once('.'));
                        let wire = wire
                            .map(|(output, (node, input))| connect(format!("{name}.{output}"), node.to_owned(), input));
                        (wire.into_iter().collect(), vec2(WIDTH, first_pin))
                    }
                }
            }
            Purpose::Insert(wire) => {
                let wire = model.wire(wire);
                room = wire.map(|wire| [wire.from.card, wire.to.card]);
                let wires = wire.and_then(|wire| commands::into_wire(model, wire, kind, &name));
                (wires.into_iter().flatten().collect(), vec2(WIDTH / 2.0, TITLE / 2.0))
            }
        };
        let rows = kind.inputs.len().max(kind.outputs.len()) as f32;
        let size = vec2(WIDTH, TITLE + PICTURE + 3.0 * PAD + rows * ROW);
        let mut at = self.beside_overview(place::on_grid(palette.place - corner), size);
        let mut moved = Vec::new();
        if let Some([from, to]) = room {
            // between the ends of the wire, which make room
            let left = model.cards[from].rect().right() + commands::GAP;
            at.x = at.x.max(place::on_grid(egui::pos2(left + place::STEP - 1.0, 0.0)).x);
            moved = commands::aside(model, to, at.x + WIDTH);
        }
        let add = Edit::AddNode {
            name: name.clone(),
            kind: kind.id.to_owned(),
            at: Some([f64::from(at.x), f64::from(at.y)]),
        };
        let edit = Edit::All(commands::settle(model).chain(moved).chain([add]).chain(wires).collect());
        self.moved = true;
        if self.apply(ui, session, &edit) {
            self.wires.clear();
            session.select_only(&name);
        }
    }
}

impl Palette {
    /// The search field and its results; returns the type that was clicked.
    fn show(&mut self, ui: &mut Ui, model: &Model, kinds: &[&'static Node], follow: bool) -> Option<&'static Node> {
        let look = Look::of(ui.visuals());
        let hint = match &self.purpose {
            Purpose::Add => "Search nodes".to_owned(),
            Purpose::Wire { end, side } => match (side, pin_type(model, end, *side)) {
                (Side::Output, Some(ty)) => format!("Nodes that accept {}", ty.one()),
                (Side::Input, Some(ty)) => format!("Nodes that output {}", ty.one()),
                (_, None) => "Search nodes".to_owned(),
            },
            Purpose::Insert(_) => "Nodes that fit this wire".to_owned(),
        };
        let edit = egui::TextEdit::singleline(&mut self.query)
            .id(Id::new("palette search"))
            .hint_text(hint)
            .desired_width(f32::INFINITY)
            .margin(vec2(6.0, 5.0));
        let response = ui.add(edit).named("search nodes");
        response.request_focus();
        if response.changed() {
            self.marked = 0;
        }
        ui.add_space(4.0);
        let mut clicked = None;
        egui::ScrollArea::vertical().max_height(SIZE[1]).min_scrolled_height(60.0).auto_shrink([false, true]).show(
            ui,
            |ui| {
                ui.spacing_mut().item_spacing = Vec2::ZERO;
                for (position, kind) in kinds.iter().enumerate() {
                    let line = line(ui, &look, kind, position == self.marked);
                    if line.hovered() && ui.input(|input| input.pointer.delta() != Vec2::ZERO) {
                        self.marked = position;
                    }
                    if position == self.marked && follow {
                        line.scroll_to_me(None);
                    }
                    if line.clicked() {
                        clicked = Some(*kind);
                    }
                }
            },
        );
        ui.separator();
        ui.allocate_ui_with_layout(vec2(ui.available_width(), 32.0), egui::Layout::top_down(Align::Min), |ui| {
            ui.set_min_height(32.0);
            match kinds.get(self.marked) {
                Some(kind) => ui.label(egui::RichText::new(kind.summary).small()),
                None => ui.label(
                    egui::RichText::new("No nodes found. Try fewer letters, or a word from the description.").small(),
                ),
            };
        });
        clicked
    }
}

/// A row of the list: the type, and its category.
fn line(ui: &mut Ui, look: &Look, kind: &Node, marked: bool) -> egui::Response {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), LINE), Sense::click());
    response.widget_info(|| egui::WidgetInfo::selected(egui::WidgetType::SelectableLabel, true, marked, kind.id));
    if ui.is_rect_visible(rect) {
        let visuals = ui.visuals();
        let (ink, weak) = match marked {
            true => (visuals.strong_text_color(), visuals.text_color()),
            false => (visuals.text_color(), visuals.weak_text_color()),
        };
        if marked {
            ui.painter().rect_filled(rect, 3.0, visuals.selection.bg_fill.gamma_multiply(0.7));
        }
        let bar = egui::Rect::from_min_size(rect.min + vec2(4.0, 5.0), vec2(4.0, LINE - 10.0));
        ui.painter().rect_filled(bar, 1.0, look.title(kind.category));
        let [left, right] = [rect.left_center() + vec2(16.0, 0.0), rect.right_center() - vec2(10.0, 0.0)];
        ui.painter().text(left, egui::Align2::LEFT_CENTER, kind.id, egui::FontId::proportional(13.5), ink);
        ui.painter().text(right, egui::Align2::RIGHT_CENTER, kind.category, egui::FontId::proportional(11.0), weak);
    }
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    fn first(query: &str) -> Vec<&'static str> {
        let document = Document::empty(&orograph_nodes::registry());
        found(&document, &Model::default(), &Purpose::Add, query).iter().take(3).map(|node| node.id).collect()
    }

    #[test]
    fn node_types_are_found_by_name_initials_category_and_words() {
        assert_eq!(first("streampower")[0], "StreamPower");
        assert_eq!(first("stream")[0], "StreamPower");
        assert_eq!(first("sp")[0], "StreamPower");
        assert_eq!(first("terr")[0], "Terrace");
        assert_eq!(first("strmpw")[0], "StreamPower");
        let registry = orograph_nodes::registry();
        let family = first("hydrology");
        assert!(
            family.iter().all(|id| registry.get(id).is_some_and(|node| node.category == "hydrology")),
            "{family:?}"
        );
        assert!(first("rivers cut").contains(&"StreamPower"), "{:?}", first("rivers cut"));
        assert!(first("qqqq").is_empty());
        assert_eq!(first("").len(), 3);
    }
}
