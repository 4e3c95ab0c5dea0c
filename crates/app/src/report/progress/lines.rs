//! Plain lines, for logs: one per node, and regular progress of slow nodes.

use std::{
    collections::BTreeMap,
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};

use orograph_graph::{Event, NodeIndex, Origin, bytes};

use super::{Progress, seconds};
use crate::{
    machine,
    report::terminal::{Page, counted, remark},
};

/// Interval of progress lines of a node.
const SILENCE: Duration = Duration::from_secs(10);

/// Writes lines to standard error.
#[derive(Debug)]
pub struct Lines {
    page: Page,
    heard: Mutex<BTreeMap<NodeIndex, Instant>>,
}

impl Lines {
    /// Lines for this stream.
    #[must_use]
    pub fn new(page: Page) -> Self {
        Self { page, heard: Mutex::default() }
    }
}

impl Progress for Lines {
    fn event(&self, kind: &'static str, event: &Event) {
        let mut heard = self.heard.lock().unwrap_or_else(PoisonError::into_inner);
        match event {
            Event::Planned { compute, cached } => {
                let cached = if *cached > 0 { format!(", {cached} from the cache") } else { String::new() };
                remark(&format!("{} to compute{cached}\n", counted(*compute, "node")));
            }
            Event::NodeStarted { node, .. } => {
                heard.insert(*node, machine::now());
            }
            Event::NodeProgress { node, name, fraction } => {
                if let Some(time) = heard.get_mut(node).filter(|time| time.elapsed() >= SILENCE) {
                    *time = machine::now();
                    remark(&format!("{name} ({kind}): {:.0} %\n", fraction * 100.0));
                }
            }
            // Only the editor shows progressive previews.
            Event::NodeGlimpse { .. } => {}
            Event::NodeFinished { node, name, time, bytes: size, origin, backend, .. } => {
                heard.remove(node);
                let how = match origin {
                    Origin::Computed if *backend == "cpu" => format!("computed in {}", seconds(*time)),
                    Origin::Computed => format!("computed on the {} in {}", backend.to_uppercase(), seconds(*time)),
                    Origin::Memory => "from memory".to_owned(),
                    Origin::Disk => format!("from the cache in {}", seconds(*time)),
                };
                remark(&format!("{name} ({kind}): {how}, {}\n", bytes(*size as u64)));
            }
            Event::Warning { name, message, .. } => {
                remark(&format!("{} `{name}`: {message}\n", self.page.doubtful("warning:")));
            }
        }
    }
}
