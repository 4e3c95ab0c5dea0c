//! The camera of the 3D view by pointer and keys.

use egui::Key as Keyboard;

use crate::view::{Camera, Fly, FlyKeys, Orbit, Terrain};

/// What the mouse does.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hands {
    /// True if the primary button belongs to a tool and not to the camera.
    pub(super) tool: bool,
    /// True if the camera is moved as in Blender: with the middle button.
    pub(super) blender: bool,
}

/// What a drag of the pointer does with a camera around the terrain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Drag {
    Turn,
    Pan,
    Zoom,
}

impl Hands {
    /// What a drag does: with any button, with the primary and the middle one, and these keys. Returns None when it is not
    /// the camera's.
    fn drag(self, [any, primary, middle]: [bool; 3], modifiers: egui::Modifiers) -> Option<Drag> {
        if self.blender {
            let drag = match (modifiers.command, modifiers.shift) {
                (true, _) => Drag::Zoom,
                (_, true) => Drag::Pan,
                _ => Drag::Turn,
            };
            return middle.then_some(drag);
        }
        let turns = primary && !modifiers.shift;
        (any && !(self.tool && primary)).then_some(if turns { Drag::Turn } else { Drag::Pan })
    }
}

/// A camera that you can move.
pub(super) enum Navigation {
    Orbit(Orbit),
    Fly(Fly),
}

impl Navigation {
    pub(super) fn camera(&self) -> Camera {
        match self {
            Self::Orbit(orbit) => orbit.camera(),
            Self::Fly(fly) => fly.camera(),
        }
    }
}

/// Moves the camera by pointer and keys.
pub(super) fn move_eye(
    ui: &egui::Ui,
    response: &egui::Response,
    eye: &mut Navigation,
    terrain: &Terrain,
    exaggeration: f64,
    (size, scale, hands): ([u32; 2], f32, Hands),
) {
    let (scroll, pinch, modifiers, primary, dt) = ui.input(|input| {
        let primary = input.pointer.primary_down();
        (input.smooth_scroll_delta().y, input.zoom_delta(), input.modifiers, primary, input.stable_dt)
    });
    let delta = response.drag_delta() * scale;
    let pixels = [f64::from(delta.x), f64::from(delta.y)];
    let middle = response.dragged_by(egui::PointerButton::Middle);
    let drag = hands.drag([response.dragged(), primary, middle], modifiers);
    let notches = if response.hovered() { f64::from(scroll / 50.0 + 4.0 * pinch.log2()) } else { 0.0 };
    match eye {
        Navigation::Orbit(orbit) => {
            match drag {
                Some(Drag::Zoom) => orbit.scroll(pixels[1] / -20.0, None),
                Some(Drag::Turn) => orbit.drag(pixels, size),
                Some(Drag::Pan) => orbit.pan(pixels, size),
                None => {}
            }
            if notches != 0.0 {
                let at = response.hover_pos().map(|at| (at - response.rect.min) * scale);
                let ray = at.map(|at| orbit.camera().ray([f64::from(at.x), f64::from(at.y)], size));
                let towards = ray.and_then(|ray| Some((ray, terrain.cast(&ray, exaggeration)?)));
                orbit.scroll(notches, towards.map(|(ray, hit)| ray.origin + ray.direction * hit.distance));
            }
            orbit.limit(terrain, exaggeration);
        }
        Navigation::Fly(fly) => {
            if drag.is_some() {
                fly.look(pixels, size);
            }
            fly.scroll(notches);
            if response.hovered() && ui.ctx().memory(|memory| memory.focused().is_none()) {
                let keys = ui.input(|input| FlyKeys {
                    forward: input.key_down(Keyboard::W),
                    back: input.key_down(Keyboard::S),
                    left: input.key_down(Keyboard::A),
                    right: input.key_down(Keyboard::D),
                    up: input.key_down(Keyboard::E),
                    down: input.key_down(Keyboard::Q),
                    fast: input.modifiers.shift,
                });
                if keys != (FlyKeys { fast: keys.fast, ..FlyKeys::default() }) {
                    fly.step(keys, f64::from(dt));
                    ui.ctx().request_repaint();
                }
            }
            fly.limit(terrain, exaggeration);
        }
    }
}

#[cfg(test)]
mod tests {
    use egui::Modifiers;

    use super::*;

    /// Drags with the primary, the middle and the secondary button: without keys, with Shift, with Ctrl.
    fn drags(hands: Hands) -> [[Option<Drag>; 3]; 3] {
        let keys = [Modifiers::NONE, Modifiers::SHIFT, Modifiers::COMMAND];
        [[true, true, false], [true, false, true], [true, false, false]]
            .map(|buttons| keys.map(|keys| hands.drag(buttons, keys)))
    }

    #[test]
    fn the_middle_button_moves_the_camera_as_in_blender() {
        let [turn, pan, zoom] = [Drag::Turn, Drag::Pan, Drag::Zoom].map(Some);
        let none = [None; 3];
        for tool in [false, true] {
            assert_eq!(drags(Hands { tool, blender: true }), [none, [turn, pan, zoom], none]);
        }
        assert_eq!(drags(Hands { tool: false, blender: false }), [[turn, pan, turn], [pan; 3], [pan; 3]]);
        assert_eq!(drags(Hands { tool: true, blender: false }), [none, [pan; 3], [pan; 3]]);
        assert_eq!(Hands { tool: false, blender: false }.drag([false; 3], Modifiers::NONE), None);
    }
}
