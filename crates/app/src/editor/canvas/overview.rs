//! The overview: the whole graph in a corner while a part of it is out of view.

use egui::{CornerRadius, Id, Pos2, Rect, Sense, Stroke, StrokeKind, Ui, Vec2, pos2, vec2};

use super::{Canvas, lens::Lens, paint::Brush, place};

/// Its size, and its distance from the corner, in points.
pub(super) const SIZE: Vec2 = vec2(168.0, 108.0);
pub(super) const MARGIN: f32 = 10.0;

impl Canvas {
    /// Its place in the window. Returns None while it is not shown.
    fn overview_rect(&self) -> Option<Rect> {
        let (all, lens) = (self.model.extent(), self.lens?);
        let room = lens.rect.width() > 2.4 * SIZE.x && lens.rect.height() > 2.0 * SIZE.y;
        let is_shown = room && !self.without_map && all.is_positive() && !lens.seen().contains_rect(all);
        is_shown.then(|| Rect::from_min_size(lens.rect.right_bottom() - SIZE - Vec2::splat(MARGIN), SIZE))
    }

    /// Pans so that nodes that were just pasted or duplicated are in view and not below the overview.
    pub(super) fn bring_into_view(&mut self) {
        let added = std::mem::take(&mut self.added);
        let bounds = self.model.bounds(|card| added.contains(&card.name)).expand(place::STEP);
        let Some(lens) = self.lens.as_mut().filter(|_| bounds.is_positive()) else { return };
        let seen = lens.seen();
        let shift = |axis: usize| match bounds.max[axis] - bounds.min[axis] > seen.max[axis] - seen.min[axis] {
            true => bounds.center()[axis] - seen.center()[axis],
            false => (bounds.min[axis] - seen.min[axis]).min(0.0) + (bounds.max[axis] - seen.max[axis]).max(0.0),
        };
        lens.centre += vec2(shift(0), shift(1));
        let (left, lens) = (lens.seen().left(), *lens);
        let Some(map) = self.overview_rect().map(|map| lens.to_graph(map.min)) else { return };
        if bounds.right() > map.x && bounds.bottom() > map.y {
            let aside = (bounds.right() - map.x).min((bounds.left() - left).max(0.0));
            self.lens = Some(Lens { centre: lens.centre + vec2(aside, 0.0), ..lens });
        }
    }

    /// The position beside the overview for a new card that would be below it.
    pub(super) fn beside_overview(&self, at: Pos2, size: Vec2) -> Pos2 {
        let (Some(map), Some(lens)) = (self.overview_rect(), self.lens) else { return at };
        let map = Rect::from_min_max(lens.to_graph(map.min), lens.to_graph(map.max)).expand(place::STEP);
        if !Rect::from_min_size(at, size).intersects(map) {
            return at;
        }
        pos2(((map.left() - size.x) / place::STEP).floor() * place::STEP, at.y)
    }

    /// Draws it. A click or a drag there moves the view.
    pub(super) fn overview(&mut self, ui: &mut Ui, brush: &Brush) {
        let held = self.held_overview.take();
        let Some(rect) = self.overview_rect() else { return };
        let seen = brush.lens.seen();
        // During a drag it keeps its extent: otherwise the view would flee from a pointer near the border.
        let world = held.unwrap_or_else(|| self.model.extent().union(seen).expand(20.0));
        let scale = (rect.width() / world.width()).min(rect.height() / world.height());
        let to_map = |at: Pos2| rect.center() + (at - world.center()) * scale;
        let painter = brush.painter.with_clip_rect(rect.intersect(brush.painter.clip_rect()));
        let look = &brush.look;
        painter.rect_filled(rect, CornerRadius::same(4), look.well);
        for card in &self.model.cards {
            let small = Rect::from_min_max(to_map(card.rect().min), to_map(card.rect().max));
            let small = Rect::from_center_size(small.center(), small.size().max(Vec2::splat(2.0)));
            painter.rect_filled(small, CornerRadius::ZERO, look.title(card.category).lerp_to_gamma(look.text, 0.15));
        }
        let frame = Rect::from_min_max(to_map(seen.min), to_map(seen.max));
        painter.rect_stroke(frame, CornerRadius::same(1), Stroke::new(1.5, look.text), StrokeKind::Inside);
        painter.rect_stroke(rect, CornerRadius::same(4), Stroke::new(1.0, look.outline), StrokeKind::Inside);
        let response = ui.interact(rect, Id::new("canvas overview"), Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::Other, true, "overview"));
        self.held_overview = response.is_pointer_button_down_on().then_some(world);
        if (response.dragged() || response.clicked())
            && let (Some(point), Some(lens)) = (response.interact_pointer_pos(), &mut self.lens)
        {
            lens.centre = world.center() + (point - rect.center()) / scale;
            self.moved = true;
        }
    }
}
