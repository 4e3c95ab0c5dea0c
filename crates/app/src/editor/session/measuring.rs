//! Measures what the file expects of a height, once it is built at the preview resolution.

use std::sync::{Arc, Mutex, PoisonError};

use orograph_graph::{Cancel, Expectations, Field, Key, Request, Value, World};

use super::worker::Order;
use crate::report::{
    expect::{Checked, Gather},
    failure::{Exit, Failure},
};

/// The number of heights whose figures are kept, so that undo and redo measure nothing.
const KEPT: usize = 16;

/// Figures, or why there are none.
type Outcome = Result<Arc<Checked>, String>;

/// A height to measure, and the figures of earlier ones.
#[derive(Debug, Default)]
pub(super) struct Measuring {
    /// The built height with its key, until it is measured.
    height: Mutex<Option<(Key, Field)>>,
    known: Vec<(Key, Arc<Expectations>, Outcome)>,
}

impl Measuring {
    /// Forgets the height of an order that was replaced.
    pub(super) fn forget(&mut self) {
        *self.height.get_mut().unwrap_or_else(PoisonError::into_inner) = None;
    }

    /// Keeps a value that was built if it is the height that the file expects something of.
    pub(super) fn keep(&self, order: &Order, request: &Request, value: &Value, key: Key) {
        let is_expected = order.expected.as_ref().is_some_and(|expected| expected.port == request.port);
        if is_expected
            && request.window.world == order.full()
            && let Some(field) = value.as_field()
        {
            *self.height.lock().unwrap_or_else(PoisonError::into_inner) = Some((key, field.clone()));
        }
    }

    /// Measures the height. Returns None when there is none, or the measuring was cancelled.
    pub(super) fn measure(&mut self, order: &Order, cancel: &Cancel) -> Option<Outcome> {
        let expected = order.expected.as_ref()?;
        let height = self.height.get_mut().unwrap_or_else(PoisonError::into_inner);
        let (key, field) = height.clone()?;
        let is_same =
            |(known, what, _): &&(Key, Arc<Expectations>, Outcome)| *known == key && *what == expected.expectations;
        let outcome = match self.known.iter().find(is_same) {
            Some((.., outcome)) => outcome.clone(),
            None => {
                let outcome = match figures(&expected.expectations, &expected.output, (order.full(), &field), cancel) {
                    Err(Failure { exit: Exit::Stopped, .. }) => return None,
                    outcome => outcome.map(Arc::new).map_err(|failure| failure.message),
                };
                self.known.truncate(KEPT - 1);
                self.known.insert(0, (key, Arc::clone(&expected.expectations), outcome.clone()));
                outcome
            }
        };
        *height = None;
        Some(outcome)
    }
}

fn figures(
    expected: &Expectations,
    output: &str,
    (world, height): (World, &Field),
    cancel: &Cancel,
) -> Result<Checked, Failure> {
    let refused = |refused: orograph_graph::memory::OutOfMemory| Failure::unable(refused.to_string());
    let mut gather = Gather::new(expected, world).map_err(refused)?;
    gather.add(height).map_err(refused)?;
    Checked::of(expected, output, gather, &orograph_nodes::registry(), cancel)
}
