//! The values of other layers at the pointer: what the shown output lies on, the other outputs of its node, and the
//! outputs of the file, as far as they are built.

use egui::{Align2, Id, Painter, Rect, Response, Sense, Ui, Vec2, WidgetInfo, WidgetType, pos2, vec2};
use orograph_graph::{Port, PortType, Value};

use super::{Shown, draw::Projection, label, map};
use crate::editor::Session;

/// Height of a line, and the distance between columns, in points.
const LINE: f32 = 21.0;
const BETWEEN: f32 = 20.0;

/// Draws the values above the value of the shown output, in columns from the right where there are many.
pub(super) fn show(
    ui: &Ui,
    (response, painter): (&Response, &Painter),
    projection: &Projection<'_>,
    session: &Session,
    shown: &Shown,
) {
    let place = response.hover_pos().and_then(|at| (projection.to_world)(at));
    let Some(place) = place else { return };
    let texts = texts(session, shown, place);
    let corner = response.rect.right_bottom() - vec2(10.0, 10.0);
    let rows = ((response.rect.height() / LINE) as usize).saturating_sub(2).max(1);
    let mut right = corner.x;
    for column in texts.chunks(rows) {
        let lines = column.iter().zip(1_u16..).map(|(text, line)| {
            let at = pos2(right, corner.y - LINE * f32::from(line));
            label(painter, at, Align2::RIGHT_BOTTOM, text).left()
        });
        right = lines.fold(right, f32::min) - BETWEEN;
        if right < response.rect.left() {
            break;
        }
    }
    let all = ui.interact(Rect::from_min_size(corner, Vec2::ZERO), Id::new("values at the pointer"), Sense::hover());
    all.widget_info(|| WidgetInfo::labeled(WidgetType::Label, true, texts.join(", ")));
}

/// The values at a position, each with its output.
fn texts(session: &Session, shown: &Shown, place: [f64; 2]) -> Vec<String> {
    let graph = session.document().graph();
    let mut ports: Vec<Port> = Vec::new();
    if let Ok(port) = graph.port(shown.name()) {
        ports.extend(session.ground_of(port));
        let count = graph.instance(port.node).node.outputs.len();
        ports.extend((0..count).map(|output| Port { output, ..port }));
    }
    ports.extend(session.document().outputs().iter().map(|output| output.port));
    let mut names = Vec::new();
    for port in ports {
        let name = graph.port_name(port);
        if name != shown.port && !names.iter().any(|(known, _)| *known == name) {
            names.push((name, graph.output_type(port)));
        }
    }
    names.into_iter().filter_map(|(name, ty)| value(session, &name, ty, place)).collect()
}

/// The value of an output at a position. Returns None when it is not built, or not a field.
fn value(session: &Session, name: &str, ty: PortType, place: [f64; 2]) -> Option<String> {
    let built = session.built(name).filter(|built| built.revision == session.revision())?;
    let Value::Field(field) = &built.value else { return None };
    // on larger cells than the preview, the value is that of a thumbnail
    let about = if built.cells < session.cells() { "about " } else { "" };
    Some(format!("{name}  {about}{}", map::value(ty, field, place)?))
}
