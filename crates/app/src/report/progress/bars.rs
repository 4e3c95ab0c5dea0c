//! Progress bars on a terminal: one for all nodes, one for each running node.

use std::{
    collections::BTreeMap,
    sync::{Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use orograph_graph::{Event, NodeIndex};

use super::Progress;
use crate::{build::request::Request, machine, report::terminal::Page};

/// Steps of a node's bar.
const STEPS: u64 = 1000;

/// Draws bars below the last line of standard error and removes them at the end.
#[derive(Debug)]
pub struct Bars {
    page: Page,
    all: MultiProgress,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    overall: Option<ProgressBar>,
    nodes: BTreeMap<NodeIndex, ProgressBar>,
    /// Width of the longest name.
    column: usize,
}

impl Bars {
    /// Bars for this terminal.
    #[must_use]
    pub fn new(page: Page) -> Self {
        Self { page, all: MultiProgress::new(), state: Mutex::default() }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn style(&self, template: &str, colour: &str) -> ProgressStyle {
        let width = (self.page.width / 3).clamp(10, 40);
        let colour = if self.page.colour { format!(".{colour}") } else { String::new() };
        let bar = if colour.is_empty() { format!("{{bar:{width}}}") } else { format!("{{bar:{width}{colour}}}") };
        ProgressStyle::with_template(&template.replace("{bar}", &bar))
            .unwrap_or_else(|_| ProgressStyle::default_bar())
            .progress_chars("━╸─")
    }
}

/// Updates a bar's time in the background, if there is memory for the thread.
fn tick(bar: &ProgressBar) {
    if machine::has_room_for(1) {
        bar.enable_steady_tick(Duration::from_millis(200));
    }
}

impl Progress for Bars {
    fn started(&self, request: &Request, _: usize) {
        let names = request.graph.indices().map(|node| request.graph.instance(node).name.len());
        self.state().column = names.max().unwrap_or(0).min(24);
    }

    fn event(&self, kind: &'static str, event: &Event) {
        let mut state = self.state();
        match event {
            Event::Planned { compute, cached } => {
                let bar = self.all.add(ProgressBar::new((compute + cached) as u64));
                bar.set_style(self.style("{msg} {bar} {pos}/{len} nodes  {elapsed}", "green"));
                let column = state.column.max("building".len());
                bar.set_message(format!("{:column$}", "building"));
                tick(&bar);
                state.overall = Some(bar);
            }
            Event::NodeStarted { node, name } => {
                let bar = self.all.add(ProgressBar::new(STEPS));
                bar.set_style(self.style("{prefix} {bar} {percent:>3} %  {elapsed:>4}  {msg}", "cyan"));
                let column = state.column.max("building".len());
                bar.set_prefix(format!("{name:column$}"));
                bar.set_message(self.page.dim(kind));
                tick(&bar);
                state.nodes.insert(*node, bar);
            }
            Event::NodeProgress { node, fraction, .. } => {
                if let Some(bar) = state.nodes.get(node) {
                    bar.set_position((f64::from(*fraction) * STEPS as f64) as u64);
                }
            }
            // Only the editor shows progressive previews.
            Event::NodeGlimpse { .. } => {}
            Event::NodeFinished { node, .. } => {
                if let Some(bar) = state.nodes.remove(node) {
                    bar.finish_and_clear();
                    self.all.remove(&bar);
                }
                if let Some(bar) = &state.overall {
                    bar.inc(1);
                }
            }
            Event::Warning { name, message, .. } => {
                let text = format!("{} `{name}`: {message}", self.page.doubtful("warning:"));
                // Ignored: the terminal may be gone.
                let _ = self.all.println(text);
            }
        }
    }

    fn writing(&self) {
        let state = self.state();
        if let Some(bar) = &state.overall {
            let column = state.column.max("building".len());
            bar.set_message(format!("{:column$}", "writing"));
        }
    }

    fn ended(&self) {
        let mut state = self.state();
        for bar in std::mem::take(&mut state.nodes).into_values().chain(state.overall.take()) {
            bar.finish_and_clear();
        }
    }
}
