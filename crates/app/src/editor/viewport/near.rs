//! The finer cells near the eye in 3D: made beside the window, and kept while they are of the land that is drawn.

use std::sync::{
    Arc,
    mpsc::{Receiver, TryRecvError, channel},
};

use orograph_graph::Window;

use super::{
    landscape::land,
    surface::{Key, Surface},
};
use crate::view::{Inset, Renderer, ViewError};

/// Which part of which land it is.
type Part = (Key, Window);

/// The part of a land that is drawn at finer cells.
#[derive(Default)]
pub(super) struct Near {
    /// What the renderer has.
    has: Option<Part>,
    /// A part that is being made.
    work: Option<(Part, Receiver<Result<Inset, ViewError>>)>,
}

impl Near {
    /// The window that the renderer has.
    pub(super) fn window(&self) -> Option<Window> {
        self.has.as_ref().map(|(_, window)| *window)
    }

    /// After the renderer got another land.
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }

    /// Asks for a part of the renderer's land, or for none. Until it is there the one before stays.
    ///
    /// # Errors
    /// When it cannot be drawn.
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
        let Some(coarse) = renderer.land().filter(|_| self.work.is_none() && self.has.as_ref() != Some(&part)) else {
            return Ok(());
        };
        let (outbox, inbox) = channel();
        let (context, coarse) = (context.clone(), Arc::clone(coarse));
        rayon::spawn(move || {
            // Nobody waits for it any more when the window is closed.
            let _ = outbox.send(land(&surface).and_then(|part| Inset::new(&coarse, &part)));
            context.request_repaint();
        });
        self.work = Some((part, inbox));
        Ok(())
    }
}
