//! Orders to the worker, and the results that it reports.

use std::sync::Arc;

use orograph_graph::EvalError;

use super::{
    Built, NodeState, Session,
    worker::{Expected, News, Order, QUICK_CELLS, Wanted},
};

impl Session {
    /// Receives messages of the worker and sends it changes. Called every frame; returns at once.
    pub fn poll(&mut self) {
        self.look_outside();
        self.tell_trouble();
        let news: Vec<News> = self.worker.news().collect();
        for news in news {
            self.hear(news);
        }
        self.leave_past();
        if self.stale {
            self.watch_files();
        }
        if std::mem::take(&mut self.stale) {
            self.busy = true;
            self.orders += 1;
            self.forget_ordered_detail();
            let order = self.order();
            self.follow_simulation(&order);
            self.worker.submit(order);
        }
        self.order_detail();
    }

    pub(super) fn order(&self) -> Order {
        let expanded = self.document.expand();
        let graph = self.document.graph();
        let wanted = |port: orograph_graph::Port| {
            Some(Wanted {
                node: graph.instance(port.node).name.clone(),
                name: graph.port_name(port),
                port: expanded.port(port)?,
            })
        };
        let first = |node| wanted(orograph_graph::Port { node, output: 0 });
        let with_outputs =
            graph.topological().into_iter().filter(|node| !graph.instance(*node).node.outputs.is_empty());
        let behind = self.behind_simulation();
        let small = with_outputs.filter(|node| !behind.contains(node)).filter_map(first).collect();
        let names = [self.shown(), self.compared.clone()].into_iter().flatten().chain(self.also.iter().cloned());
        let mut shown: Vec<Wanted> = Vec::new();
        let ports = names.filter_map(|name| graph.port(&name).ok()).filter(|port| !behind.contains(&port.node));
        for wanted in ports.filter_map(wanted) {
            if !shown.contains(&wanted) {
                shown.push(wanted);
            }
        }
        let read = graph.indices().flat_map(|node| {
            let inputs = 0..graph.instance(node).node.inputs.len();
            inputs.filter_map(move |input| graph.source(node, input))
        });
        let expected = self.document.expectations().and_then(|expectations| {
            let output = expanded.outputs.iter().find(|output| Some(&output.name) == expectations.output.as_ref())?;
            let is_shown = shown.iter().any(|shown| shown.port == output.port);
            is_shown.then(|| Expected {
                port: output.port,
                output: output.name.clone(),
                expectations: Arc::clone(expectations),
            })
        });
        let byproducts =
            read.filter_map(|port| expanded.port(port)).chain(expanded.outputs.iter().map(|output| output.port));
        Order {
            number: self.orders,
            revision: self.revision,
            byproducts: byproducts.collect(),
            folder: self.document.folder().to_owned(),
            world: self.document.world(),
            shown,
            small,
            cells: self.cells,
            part: None,
            expected,
            graph: self.preferred.applied(expanded.graph),
        }
    }

    fn hear(&mut self, news: News) {
        match news {
            News::Running { revision, node, fraction } if revision == self.revision => {
                self.nodes.entry(node).or_default().state = NodeState::Running { fraction };
            }
            News::Finished { revision, node, time, bytes, cells, computed, on_device } if revision == self.revision => {
                let info = self.nodes.entry(node).or_default();
                info.state = NodeState::Fresh;
                info.on_device = on_device;
                if computed {
                    info.time = Some((time, cells));
                    info.bytes = bytes;
                    info.warnings.clear();
                }
            }
            // This result was reported before a lower resolution was requested.
            News::Built { cells, .. } | News::Glimpsed { cells, .. } if cells > self.cells.max(QUICK_CELLS) => {}
            News::Built { revision, name, cells, value } => {
                if let Some((node, _)) = name.split_once('.')
                    && revision == self.revision
                {
                    self.nodes.entry(node.to_owned()).or_default().state = NodeState::Fresh;
                }
                let built = self.built.entry(name).or_default();
                let level = usize::from(cells > QUICK_CELLS);
                built[level] = Some(Built { revision, cells, step: 0, value });
                // while more cells are still to come, an intermediate result of a finer level is closer to them
                if cells >= self.cells || built[2].as_ref().is_some_and(|glimpse| glimpse.cells <= cells) {
                    built[2] = None;
                }
            }
            News::Glimpsed { revision, name, cells, value } if revision == self.revision => {
                let [.., glimpse] = self.built.entry(name).or_default();
                let step = glimpse.as_ref().map_or(1, |glimpse| glimpse.step + 1);
                *glimpse = Some(Built { revision, cells, step, value });
            }
            News::Warned { revision, node, message } if revision == self.revision => {
                let warnings = &mut self.nodes.entry(node).or_default().warnings;
                if !warnings.contains(&message) {
                    warnings.push(message);
                }
            }
            News::Failed { revision, node, error } if revision == self.revision => {
                let at = error.node().filter(|at| *at != node).map(str::to_owned);
                let state = match error {
                    EvalError::Unwired { input, .. } => NodeState::Unwired { input, at },
                    error => NodeState::Failed { message: error.to_string(), hint: error.hint(), at },
                };
                self.nodes.entry(node).or_default().state = state;
            }
            News::Part { revision, name, window, value } => self.hear_detail(revision, name, window, value),
            News::Live { node, moment, held, cells, values, warnings, on_device, .. } => {
                if self.hear_simulation(&node, moment, held, cells, values) {
                    self.hear_of_simulated(warnings, on_device);
                }
            }
            News::LiveFailed { node, error, .. } => self.hear_trouble(&node, &error),
            News::Measured { revision, checked } if revision == self.revision => {
                self.checked = Some(super::Measured { revision, checked });
            }
            News::Done { revision } if revision == self.revision => self.busy = false,
            News::Running { .. }
            | News::Glimpsed { .. }
            | News::Finished { .. }
            | News::Warned { .. }
            | News::Failed { .. }
            | News::Measured { .. }
            | News::Done { .. } => {}
        }
    }
}
