//! The finer part of the terrain near the camera in the 3D view: prepared on another thread, and kept while the terrain
//! is the same.

use std::sync::{
    Arc,
    mpsc::{Receiver, TryRecvError, channel},
};

use orograph_graph::Window;

use super::{
    landscape::terrain,
    surface::{Key, Surface},
};
use crate::view::{Inset, Renderer, ViewError};

/// A part, by its terrain and its window.
type Part = (Key, Window);

/// The finer part of a terrain.
#[derive(Default)]
pub(super) struct Near {
    /// The part that the renderer has.
    has: Option<Part>,
    /// A part that is being prepared on another thread.
    work: Option<(Part, Receiver<Result<Inset, ViewError>>)>,
}

impl Near {
    /// The window of the part that the renderer has.
    pub(super) fn window(&self) -> Option<Window> {
        self.has.as_ref().map(|(_, window)| *window)
    }

    /// Call it after the renderer gets another terrain.
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }

    /// Requests a finer part of the renderer's terrain; None removes it. The previous part stays until the new one is
    /// ready.
    ///
    /// # Errors
    /// When the part cannot be drawn.
    pub(super) fn want(
        &mut self,
        context: &egui::Context,
        renderer: &mut Renderer,
        surface: Option<Surface>,
    ) -> Result<(), ViewError> {
        let Some(surface) = surface else {
            self.work = None;
            return if self.has.take().is_some() { renderer.set_inset(None) } else { Ok(()) };
        };
        if let Some((part, inset)) = self.work.take() {
            match inset.try_recv() {
                Ok(inset) => {
                    self.has = Some(part);
                    inset.and_then(|inset| renderer.set_inset(Some(Arc::new(inset))))?;
                }
                Err(TryRecvError::Empty) => self.work = Some((part, inset)),
                Err(TryRecvError::Disconnected) => {}
            }
        }
        let part = (surface.key.clone(), *surface.height.window());
        let Some(coarse) = renderer.terrain().filter(|_| self.work.is_none() && self.has.as_ref() != Some(&part))
        else {
            return Ok(());
        };
        let (outbox, inbox) = channel();
        let (context, coarse) = (context.clone(), Arc::clone(coarse));
        rayon::spawn(move || {
            // Ignored: the receiver is gone once the window is closed.
            let _ = outbox.send(terrain(&surface).and_then(|part| Inset::new(&coarse, &part)));
            context.request_repaint();
        });
        self.work = Some((part, inbox));
        Ok(())
    }
}
