//! Drawing of cards and wires.

use std::time::Duration;

use egui::{
    Align2, Color32, CornerRadius, FontId, Mesh, Painter, Pos2, Rect, Shape, Stroke, StrokeKind, Vec2,
    epaint::CubicBezierShape, pos2, text::LayoutJob, vec2,
};
use orograph_graph::{PortType, bytes};

use super::{
    super::session::{NodeInfo, NodeState},
    lens::Lens,
    look::Look,
    model::{Area, Card, PAD, PICTURE, Pin, ROW, Side, TITLE, WIDTH},
    thumbs::Thumb,
};

/// Below the first zoom, rows of pins have no text; below the second, cards have no titles.
const READABLE: [f32; 2] = [0.5, 0.2];
/// The smallest text, in points.
const SMALLEST: f32 = 9.0;
/// Radius of a pin.
const PIN: f32 = 4.5;
/// Distance between the dots of the background.
const DOTS: f32 = 24.0;

/// A painter of the graph.
#[derive(Clone)]
pub(super) struct Brush {
    pub(super) painter: Painter,
    pub(super) lens: Lens,
    pub(super) look: Look,
}

/// The highlights of a card.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Emphasis {
    pub(super) chosen: bool,
    pub(super) hovered: bool,
    /// True if the viewport shows this node.
    pub(super) shown: bool,
    /// True if a wire is being drawn that fits no pin of this card.
    pub(super) faded: bool,
}

impl Brush {
    fn scaled(&self, size: f32) -> f32 {
        size * self.lens.zoom
    }

    /// A text size in half points, so that zooming does not rasterise ever new glyphs.
    fn font(&self, size: f32) -> FontId {
        FontId::proportional(((self.scaled(size) * 2.0).round() / 2.0).max(SMALLEST))
    }

    /// One line of text, cut at a width in units of the graph; returns its width.
    fn text(&self, at: Pos2, align: Align2, text: &str, size: f32, colour: Color32, width: f32) -> f32 {
        let mut job = LayoutJob::simple_singleline(text.to_owned(), self.font(size), colour);
        job.wrap.max_width = self.scaled(width);
        job.wrap.max_rows = 1;
        job.wrap.break_anywhere = true;
        let galley = self.painter.layout_job(job);
        let rect = align.anchor_size(self.lens.to_screen(at), galley.size());
        self.painter.galley(rect.min, galley, colour);
        rect.width() / self.lens.zoom
    }

    /// The width of a text, in units of the graph.
    fn width(&self, text: &str, size: f32) -> f32 {
        let galley = self.painter.layout_no_wrap(text.to_owned(), self.font(size), self.look.text);
        galley.size().x / self.lens.zoom
    }

    /// Wrapped text in a rectangle of the graph.
    fn passage(&self, rect: Rect, text: &str, size: f32, colour: Color32, rows: usize) {
        let mut job = LayoutJob::simple(text.to_owned(), self.font(size), colour, self.scaled(rect.width()));
        job.wrap.max_rows = rows;
        let galley = self.painter.layout_job(job);
        self.painter.galley(self.lens.to_screen(rect.min), galley, colour);
    }

    /// The background, with dots that show how far the view is panned.
    pub(super) fn ground(&self) {
        self.painter.rect_filled(self.lens.rect, CornerRadius::ZERO, self.look.ground);
        let mut step = DOTS;
        while self.scaled(step) < 15.0 {
            step *= 2.0;
        }
        let seen = self.lens.seen();
        let mut mesh = Mesh::default();
        let size = if self.scaled(DOTS) > 20.0 { 2.0 } else { 1.5 };
        let [columns, rows] = [(seen.width() / step) as usize + 2, (seen.height() / step) as usize + 2];
        let first = pos2((seen.min.x / step).floor() * step, (seen.min.y / step).floor() * step);
        for row in 0..rows {
            for column in 0..columns {
                let at = self.lens.to_screen(first + vec2(column as f32, row as f32) * step);
                mesh.add_colored_rect(Rect::from_center_size(at, Vec2::splat(size)), self.look.dots);
            }
        }
        self.painter.add(Shape::mesh(mesh));
    }

    /// A wire along its route points.
    pub(super) fn wire(&self, places: &[Pos2], colour: Color32, width: f32) {
        let stroke = Stroke::new((self.scaled(width)).clamp(width * 0.6, width * 1.6), colour);
        for points in self.lens.way(places) {
            if Rect::from_points(&points).expand(width).intersects(self.lens.rect) {
                self.painter.add(CubicBezierShape::from_points_stroke(points, false, Color32::TRANSPARENT, stroke));
            }
        }
    }

    /// A route point of a wire.
    pub(super) fn bend(&self, at: Pos2, colour: Color32, chosen: bool, hovered: bool) {
        let at = self.lens.to_screen(at);
        let radius = self.scaled(if hovered { 5.5 } else { 4.0 }).max(2.0);
        let edge = if chosen { self.look.chosen } else { self.look.outline };
        self.painter.circle(at, radius, colour, Stroke::new(if chosen { 2.0 } else { 1.0 }, edge));
    }

    /// The note of a card, below it.
    fn note(&self, card: &Card) {
        const ROWS: usize = 4;
        let at = pos2(card.at.x, card.rect().max.y + 5.0);
        let mut job = LayoutJob::simple(card.note.clone(), self.font(11.0), self.look.text, self.scaled(WIDTH - 10.0));
        job.wrap.max_rows = ROWS;
        let galley = self.painter.layout_job(job);
        let corner = self.lens.to_screen(at);
        let back = Rect::from_min_size(corner, vec2(self.scaled(WIDTH), galley.size().y + self.scaled(4.0)));
        self.painter.rect_filled(back, CornerRadius::same(2), self.look.ground.gamma_multiply(0.8));
        let bar = Rect::from_min_size(back.min, vec2(self.scaled(2.0).max(1.0), back.height()));
        self.painter.rect_filled(bar, CornerRadius::ZERO, self.look.weak);
        self.painter.galley(corner + vec2(self.scaled(8.0), self.scaled(2.0)), galley, self.look.text);
    }

    /// A frame behind the cards.
    pub(super) fn area(&self, area: &Area, chosen: bool, hovered: bool) {
        let rect = self.lens.rect_to_screen(area.rect);
        if !rect.intersects(self.lens.rect) {
            return;
        }
        let look = &self.look;
        let own = area.colour.map(|colour| Color32::from_rgb(colour.0[0], colour.0[1], colour.0[2]));
        let colour = own.unwrap_or(look.weak);
        let round = CornerRadius::same(self.scaled(6.0).clamp(1.0, 12.0) as u8);
        self.painter.rect_filled(rect, round, colour.gamma_multiply(if look.dark { 0.16 } else { 0.22 }));
        let head = self.lens.rect_to_screen(area.head());
        self.painter.rect_filled(head, CornerRadius { sw: 0, se: 0, ..round }, colour.gamma_multiply(0.3));
        let (width, edge) = match (chosen, hovered) {
            (true, _) => (2.0, look.chosen),
            (_, true) => (1.5, colour),
            _ => (1.0, colour.gamma_multiply(0.7)),
        };
        self.painter.rect_stroke(rect, round, Stroke::new(width, edge), StrokeKind::Inside);
        let room = area.rect.width() - 20.0;
        let at = area.rect.min + vec2(10.0, 15.0);
        self.text(at, Align2::LEFT_CENTER, &area.name, 15.0, look.text, room);
        if !area.note.is_empty() && self.lens.zoom >= READABLE[0] {
            let note = Rect::from_min_max(area.rect.min + vec2(10.0, 36.0), area.rect.max - vec2(10.0, 6.0));
            let rows = (note.height() / 16.0).max(1.0) as usize;
            self.passage(note, &area.note, 12.0, look.text.gamma_multiply(0.85), rows);
        }
        let corner = self.lens.rect_to_screen(area.corner());
        for share in [0.35, 0.7] {
            let [a, b] = [
                corner.right_bottom() - vec2(corner.width() * share, 3.0),
                corner.right_bottom() - vec2(3.0, corner.height() * share),
            ];
            self.painter.line_segment([a, b], Stroke::new(1.0, edge));
        }
    }

    /// The bypass through a muted card.
    pub(super) fn passed(&self, card: &Card, pin: usize, ty: PortType) {
        let [from, to] = [card.pin_at(Side::Input, pin), card.pin_at(Side::Output, 0)];
        self.wire(&[from, to], self.look.port(ty).gamma_multiply(0.8), 2.0);
    }

    /// A pin: filled if connected, a ring if free.
    pub(super) fn pin(&self, at: Pos2, pin: &Pin, faded: bool, hovered: bool) {
        let at = self.lens.to_screen(at);
        let radius = self.scaled(if hovered { PIN * 1.4 } else { PIN }).max(1.5);
        let colour = self.look.port(pin.ty).gamma_multiply(if faded { 0.25 } else { 1.0 });
        let edge = if pin.missing { self.look.text } else { colour };
        let fill = if pin.wired { colour } else { self.look.well };
        self.painter.circle(at, radius + 1.0, self.look.outline, Stroke::NONE);
        self.painter.circle(at, radius - 0.5, fill, Stroke::new(self.scaled(1.8).max(1.0), edge));
    }

    /// A card, without its pins.
    pub(super) fn card(&self, card: &Card, info: &NodeInfo, thumb: Option<&Thumb>, emphasis: Emphasis, time: f64) {
        let look = &self.look;
        let rect = self.lens.rect_to_screen(card.rect());
        let round = CornerRadius::same(self.scaled(6.0).clamp(1.0, 12.0) as u8);
        let failed = matches!(info.state, NodeState::Failed { .. });
        let shadow = rect.translate(vec2(0.0, self.scaled(2.0))).expand(self.scaled(1.5));
        self.painter.rect_filled(shadow, round, Color32::from_black_alpha(if look.dark { 70 } else { 28 }));
        self.painter.rect_filled(rect, round, look.body);
        let mut title = rect;
        title.max.y = title.min.y + self.scaled(TITLE);
        let top = if card.collapsed { round } else { CornerRadius { sw: 0, se: 0, ..round } };
        self.painter.rect_filled(title, top, look.title(card.category));
        if self.lens.zoom >= READABLE[1] {
            self.title(card, info, emphasis, time);
        }
        if !card.collapsed {
            self.picture(card, info, thumb);
            if self.lens.zoom >= READABLE[0] {
                self.rows(card);
            }
        }
        if let NodeState::Running { fraction } = info.state {
            let mut bar = title;
            bar.min.y = bar.max.y - self.scaled(3.0).max(2.0);
            self.painter.rect_filled(bar, CornerRadius::ZERO, look.well);
            bar.max.x = bar.min.x + bar.width() * fraction.clamp(0.03, 1.0);
            self.painter.rect_filled(bar, CornerRadius::ZERO, look.busy);
        }
        let (width, colour) = match emphasis {
            Emphasis { chosen: true, .. } => (2.0, look.chosen),
            _ if failed => (1.5, look.bad),
            Emphasis { hovered: true, .. } => (1.0, look.weak),
            _ => (1.0, look.outline),
        };
        self.painter.rect_stroke(rect, round, Stroke::new(width, colour), StrokeKind::Outside);
        if card.index.is_none() && !emphasis.chosen {
            let corners = [rect.left_top(), rect.right_top(), rect.right_bottom(), rect.left_bottom(), rect.left_top()];
            self.painter.extend(Shape::dashed_line(&corners, Stroke::new(1.5, look.doubtful), 6.0, 4.0));
        }
        if !card.note.is_empty() && self.lens.zoom >= READABLE[0] {
            self.note(card);
        }
        if card.muted {
            let veil = look.ground.gamma_multiply(0.5);
            self.painter.rect_filled(rect, round, veil);
        }
        if emphasis.faded {
            self.painter.rect_filled(rect, round, look.ground.gamma_multiply(0.55));
        }
    }

    fn title(&self, card: &Card, info: &NodeInfo, emphasis: Emphasis, time: f64) {
        let left = card.at + vec2(PAD + 4.0, 0.0);
        let room = WIDTH - 2.0 * PAD - 28.0;
        let kind_shown = self.lens.zoom >= READABLE[0];
        let (y, size) = if kind_shown { (12.0, 13.5) } else { (TITLE / 2.0, 19.0) };
        self.text(left + vec2(0.0, y), Align2::LEFT_CENTER, &card.name, size, self.look.text, room);
        if kind_shown {
            let kind = if card.kind.is_empty() { "not a node" } else { &card.kind };
            let colour = self.look.text.gamma_multiply(0.78);
            self.text(left + vec2(0.0, 26.0), Align2::LEFT_CENTER, kind, 10.5, colour, room);
        }
        self.badge(card.at + vec2(WIDTH - 14.0, y), card, info, time);
        if emphasis.shown && kind_shown {
            self.eye(card.at + vec2(WIDTH - 14.0, 26.0));
        }
    }

    /// Draws the eye icon of the node that the viewport shows.
    fn eye(&self, at: Pos2) {
        let (at, width) = (self.lens.to_screen(at), self.scaled(5.5));
        let [left, right] = [at - vec2(width, 0.0), at + vec2(width, 0.0)];
        let stroke = Stroke::new(self.scaled(1.2).max(1.0), self.look.text);
        for side in [-1.0, 1.0] {
            let bow = vec2(0.0, side * width * 0.85);
            let points = [left, left + vec2(width * 0.6, 0.0) + bow, right - vec2(width * 0.6, 0.0) + bow, right];
            self.painter.add(CubicBezierShape::from_points_stroke(points, false, Color32::TRANSPARENT, stroke));
        }
        self.painter.circle_filled(at, width * 0.36, self.look.text);
    }

    /// Draws the state of the node as an icon that differs in shape and not only in colour.
    fn badge(&self, at: Pos2, card: &Card, info: &NodeInfo, time: f64) {
        let look = &self.look;
        let centre = self.lens.to_screen(at);
        let radius = self.scaled(5.0).max(2.0);
        let ring = |colour| self.painter.circle_stroke(centre, radius, Stroke::new(self.scaled(1.5).max(1.0), colour));
        let sign = |sign: &str, colour: Color32| {
            self.painter.circle_filled(centre, radius * 1.25, colour);
            let ink = if look.dark { Color32::BLACK } else { Color32::WHITE };
            self.text(at, Align2::CENTER_CENTER, sign, 10.0, ink, 20.0);
        };
        match &info.state {
            _ if card.index.is_none() => sign("?", look.doubtful),
            _ if card.muted => {
                ring(look.text);
                let slash = Vec2::splat(radius * 0.7);
                self.painter
                    .line_segment([centre - slash, centre + slash], Stroke::new(self.scaled(1.5).max(1.0), look.text));
            }
            NodeState::Failed { at: None, .. } => sign("!", look.bad),
            NodeState::Failed { .. } => {
                ring(look.bad);
            }
            NodeState::Running { .. } => {
                let turn = (time * 5.0) as f32;
                let points = (0..=10).map(|step| {
                    let angle = turn + step as f32 * 0.42;
                    centre + radius * Vec2::angled(angle)
                });
                self.painter.add(Shape::line(points.collect(), Stroke::new(self.scaled(2.0).max(1.0), look.busy)));
            }
            NodeState::Fresh if !info.warnings.is_empty() => sign("!", look.doubtful),
            NodeState::Fresh => {
                self.painter.circle_filled(centre, radius * 0.75, look.good);
            }
            _ => {
                ring(look.weak);
            }
        }
    }

    /// The thumbnail, and beside it its range, time and memory.
    fn picture(&self, card: &Card, info: &NodeInfo, thumb: Option<&Thumb>) {
        if card.index.is_none() {
            return;
        }
        let look = &self.look;
        let far = self.lens.zoom < READABLE[0];
        let square = if far { card.body() } else { card.picture() };
        let well = self.lens.rect_to_screen(square);
        let report = thumb.is_some_and(|thumb| thumb.texture.is_none());
        let mut back = well;
        let has_text = report || matches!(info.state, NodeState::Failed { .. } | NodeState::Unwired { .. });
        if has_text && !far {
            back.max.x = self.lens.to_screen(card.at).x + self.scaled(WIDTH - PAD);
        }
        self.painter.rect_filled(back, CornerRadius::same(2), look.well);
        let pale = !matches!(info.state, NodeState::Fresh);
        if let Some((texture, shape)) = thumb.and_then(|thumb| Some((thumb.texture.as_ref()?, thumb.shape))) {
            let rect = Rect::from_center_size(well.center(), well.size() * shape);
            let uv = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
            let tint = Color32::WHITE.gamma_multiply(if pale { 0.55 } else { 1.0 });
            self.painter.image(texture.id(), rect, uv, tint);
        }
        if far {
            if report {
                self.bars(square);
            }
            return;
        }
        let column =
            Rect::from_min_max(pos2(square.max.x + PAD, square.min.y), pos2(card.at.x + WIDTH - PAD, square.max.y));
        let stopped = matches!(info.state, NodeState::Failed { .. } | NodeState::Unwired { .. });
        if stopped && thumb.is_some() {
            let cover = self.lens.rect_to_screen(Rect::from_min_max(square.min, column.max));
            self.painter.rect_filled(cover, CornerRadius::same(2), look.well.gamma_multiply(0.86));
        }
        if let NodeState::Failed { message, at, .. } = &info.state {
            let all = Rect::from_min_max(square.min, column.max).shrink(2.0);
            let message = at.as_ref().map_or_else(|| message.clone(), |at| format!("waiting for `{at}`, which failed"));
            self.passage(all, &message, 10.5, if at.is_some() { look.weak } else { look.bad }, 6);
            return;
        }
        if let Some(lacks) = info.state.lacks() {
            self.passage(Rect::from_min_max(square.min, column.max).shrink(4.0), &lacks, 10.5, look.text, 6);
            return;
        }
        let line = |row: f32, text: &str, colour| {
            self.text(pos2(column.min.x, row), Align2::LEFT_CENTER, text, 10.5, colour, column.width());
        };
        if let Some(thumb) = thumb {
            for (row, text) in thumb.lines.iter().take(if report { 6 } else { 2 }).enumerate() {
                let y = square.min.y + 7.0 + 14.0 * row as f32;
                if report {
                    let at = pos2(square.min.x + 4.0, y + 2.0);
                    self.text(at, Align2::LEFT_CENTER, text, 10.5, look.text, WIDTH - 2.0 * PAD - 8.0);
                } else {
                    line(y, text, look.text);
                }
            }
        }
        if report {
            return;
        }
        let state = match info.state {
            NodeState::Running { fraction } => Some(format!("{:.0} %", fraction * 100.0)),
            _ if card.muted => Some("muted".to_owned()),
            NodeState::Waiting => Some("waiting".to_owned()),
            _ => None,
        };
        if let Some(state) = state {
            line(square.max.y - 35.0, &state, look.weak);
        }
        if let Some((time, _)) = info.time {
            line(square.max.y - 21.0, &span(time), look.weak);
            line(square.max.y - 7.0, &bytes(info.bytes as u64), look.weak);
        }
    }

    /// Draws the icon of a report, which has no thumbnail.
    fn bars(&self, square: Rect) {
        let side = square.width();
        for (column, height) in [(0.2, 0.3), (0.42, 0.55), (0.64, 0.42)] {
            let foot = square.left_bottom() + vec2(column, -0.2) * side;
            let bar = Rect::from_min_max(foot - vec2(0.0, height * side), foot + vec2(0.16 * side, 0.0));
            let colour = self.look.port(PortType::Report).gamma_multiply(0.7);
            self.painter.rect_filled(self.lens.rect_to_screen(bar), CornerRadius::same(1), colour);
        }
    }

    fn rows(&self, card: &Card) {
        let look = &self.look;
        let top = card.at.y + card.rows_top();
        let y = |row: usize| top + (row as f32 + 0.5) * ROW;
        for row in 0..card.inputs.len().max(card.outputs.len()) {
            let [left, right] = [pos2(card.at.x + 10.0, y(row)), pos2(card.at.x + WIDTH - 10.0, y(row))];
            let mut room = right.x - left.x;
            let mut taken = 0.0;
            if let Some(pin) = card.inputs.get(row) {
                taken = self.text(left, Align2::LEFT_CENTER, pin.name, 11.5, look.text, room * 0.75) + 6.0;
                room -= taken;
            }
            if let Some(pin) = card.outputs.get(row) {
                room -= self.text(right, Align2::RIGHT_CENTER, pin.name, 11.5, look.text, room) + 6.0;
            }
            let missing = |pin: &Pin| pin.missing.then(|| "not wired".to_owned());
            // A constant is left out rather than cut.
            if let Some(constant) = card.inputs.get(row).and_then(|pin| pin.constant_text().or_else(|| missing(pin)))
                && self.width(&constant, 11.5) <= room
            {
                self.text(left + vec2(taken, 0.0), Align2::LEFT_CENTER, &constant, 11.5, look.weak, room);
            }
        }
    }

    /// The pins of a card. `fits` returns true for a pin at which the wire being drawn can end.
    pub(super) fn pins(&self, card: &Card, fits: impl Fn(Side, usize) -> bool, hovered: Option<(Side, usize)>) {
        for side in [Side::Input, Side::Output] {
            for (position, pin) in card.pins(side).iter().enumerate() {
                if card.collapsed && !pin.wired && position > 0 {
                    continue;
                }
                let here = hovered == Some((side, position));
                self.pin(card.pin_at(side, position), pin, !fits(side, position), here);
            }
        }
    }

    /// The selection rectangle.
    pub(super) fn net(&self, rect: Rect) {
        let rect = self.lens.rect_to_screen(rect);
        let colour = self.look.busy;
        self.painter.rect(
            rect,
            CornerRadius::same(2),
            colour.gamma_multiply(0.12),
            Stroke::new(1.0, colour),
            StrokeKind::Inside,
        );
    }
}

/// The thumbnail leaves room for the text beside it.
const _: () = assert!(PICTURE + 2.0 * PAD < WIDTH, "there is room beside the picture");

/// A duration as text.
pub(super) fn span(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    match seconds {
        s if s < 1e-3 => format!("{:.0} µs", s * 1e6),
        s if s < 1.0 => format!("{:.0} ms", s * 1e3),
        s if s < 100.0 => format!("{s:.1} s"),
        s => format!("{:.0} min", s / 60.0),
    }
}

/// The legend of port types and their colours.
pub(super) fn legend(ui: &mut egui::Ui, look: &Look, meanings: &[(&str, PortType)]) {
    egui::Grid::new("legend").num_columns(2).spacing([6.0, 2.0]).show(ui, |ui| {
        for (name, ty) in meanings {
            let (rect, _) = ui.allocate_exact_size(Vec2::splat(12.0), egui::Sense::hover());
            ui.painter().circle_filled(rect.center(), 5.0, look.port(*ty));
            ui.label(*name);
            ui.end_row();
        }
    });
}
