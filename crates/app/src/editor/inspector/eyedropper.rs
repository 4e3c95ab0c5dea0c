//! An eyedropper: takes the colour of a point of the window, such as one of the terrain in the viewport.

use egui::{Area, ColorImage, Context, CursorIcon, Event, Id, Key, Order, Pos2, Sense, Ui, UserData, ViewportCommand};
use orograph_graph::Srgb;

use crate::editor::window::names::Named as _;

/// Frames to wait for the picture of the window.
const PATIENCE: u32 = 120;

/// What the eyedropper does.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    /// The next click takes a colour.
    Aiming,
    /// A point was clicked; this many frames ago the picture of the window was ordered.
    Waiting(Pos2, u32),
}

/// The eyedropper of a colour field.
#[derive(Clone, Copy, Debug)]
struct Eyedropper {
    field: Id,
    stage: Stage,
    /// The last pass in which its field was shown; without its field it ends.
    pass: u64,
}

/// The button, of the colour field with this id and this name. Returns a colour once it is taken; Escape cancels.
pub(super) fn button(ui: &mut Ui, field: Id, what: &str) -> Option<Srgb> {
    let (id, pass) = (Id::new("eyedropper"), ui.ctx().cumulative_pass_nr());
    let response = ui.add(egui::Button::new("💧").small().frame(false));
    let response = response.named(format!("Take a colour from the window as {what}"));
    if response.on_hover_text("Take a colour from the window: click a point of it").clicked() {
        ui.data_mut(|data| data.insert_temp(id, Eyedropper { field, stage: Stage::Aiming, pass }));
        return None;
    }
    let Eyedropper { stage, .. } = ui
        .data(|data| data.get_temp::<Eyedropper>(id))
        .filter(|eyedropper| eyedropper.field == field && eyedropper.pass + 1 >= pass)?;
    let next = match stage {
        _ if ui.input(|input| input.key_pressed(Key::Escape)) => Err(None),
        Stage::Aiming => Ok(aim(ui.ctx()).map_or(stage, |at| Stage::Waiting(at, 0))),
        Stage::Waiting(at, frames) => match pictured(ui.ctx()) {
            Some(image) => Err(colour(&image, at, ui.ctx().pixels_per_point())),
            None if frames < PATIENCE => Ok(Stage::Waiting(at, frames + 1)),
            None => Err(None),
        },
    };
    match next {
        Ok(stage) => {
            ui.data_mut(|data| data.insert_temp(id, Eyedropper { field, stage, pass }));
            ui.ctx().request_repaint();
            None
        }
        Err(colour) => {
            ui.data_mut(|data| data.remove::<Eyedropper>(id));
            colour
        }
    }
}

/// Catches the click that takes the colour, and orders a picture of the window. Returns the clicked point.
fn aim(context: &Context) -> Option<Pos2> {
    let screen = context.content_rect();
    let area = Area::new(Id::new("eyedropper aim")).order(Order::Foreground).fixed_pos(screen.min);
    let response = area.show(context, |ui| ui.allocate_rect(screen, Sense::click())).inner;
    let at = response.interact_pointer_pos().filter(|_| response.clicked());
    response.on_hover_cursor(CursorIcon::Crosshair);
    if at.is_some() {
        context.send_viewport_cmd(ViewportCommand::Screenshot(UserData::default()));
    }
    at
}

/// The picture of the window, if it has come.
fn pictured(context: &Context) -> Option<std::sync::Arc<ColorImage>> {
    context.input(|input| {
        input.events.iter().find_map(|event| match event {
            Event::Screenshot { image, .. } => Some(image.clone()),
            _ => None,
        })
    })
}

/// The colour of a point of the window.
fn colour(image: &ColorImage, at: Pos2, pixels_per_point: f32) -> Option<Srgb> {
    let [x, y] = [at.x, at.y].map(|points| (points * pixels_per_point) as usize);
    let inside = x < image.width() && y < image.height();
    inside.then(|| {
        let [red, green, blue, _] = image.pixels[y * image.width() + x].to_array();
        Srgb([red, green, blue])
    })
}
