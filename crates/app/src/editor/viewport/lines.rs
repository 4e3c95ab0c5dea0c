//! Lines, such as rivers, on the map.

use egui::{Color32, Painter, Pos2, Rect, Stroke};
use orograph_graph::Lines;

use super::camera::Camera;

/// Minimum distance between drawn vertices in points; closer ones would not be visible.
const APART: f32 = 1.5;
/// Width of a line of the first order, and the addition for each further order up to a limit, in points.
const WIDTH: [f32; 3] = [1.2, 0.4, 3.6];
const COLOUR: Color32 = Color32::from_rgb(24, 92, 178);

/// Draws lines: as wide as they are in the world, but wide enough to be visible, and wider with their order.
pub(super) fn draw(painter: &Painter, camera: Camera, pane: Rect, lines: &Lines) {
    let visible = painter.clip_rect();
    for line in &lines.lines {
        let mut points: Vec<Pos2> = Vec::new();
        let (mut bounds, mut width_m) = (Rect::NOTHING, 0.0_f64);
        for (at, vertex) in line.vertices.iter().enumerate() {
            let point = camera.to_screen(pane, vertex.position_m);
            bounds.extend_with(point);
            width_m = width_m.max(vertex.width_m);
            let is_end = at + 1 == line.vertices.len();
            if is_end || points.last().is_none_or(|last| last.distance(point) > APART) {
                points.push(point);
            }
        }
        if !visible.intersects(bounds.expand(2.0)) {
            continue;
        }
        let [first, more, most] = WIDTH;
        let least = (first + more * line.order.saturating_sub(1) as f32).min(most);
        let width = ((width_m / camera.metres) as f32).max(least);
        painter.line(points, Stroke::new(width, COLOUR));
    }
}
