//! A node that runs live: step by step, while you watch and paint on it.
//!
//! While it runs, no node after it is built. Strokes are data of the node, each with the time at which it acts, so that
//! the shown state always equals that of a build from the start.

use std::{
    collections::{BTreeMap, BTreeSet},
    time::Duration,
};

use orograph_graph::{EvalError, Graph, LiveNode, Moment, NodeIndex, Port, Value, Wanted};

use super::{
    Built, NodeState, Session,
    past::Past,
    worker::{self, Ask, Order, Subject},
};

/// A node that runs live.
#[derive(Clone, Debug)]
pub struct Simulation {
    node: String,
    /// True if it runs continuously.
    goes: bool,
    /// Its current moment; None until it has started.
    moment: Option<Moment>,
    /// True if it was asked to pause for a stroke, and true if it has paused.
    hold: [bool; 2],
    /// The failure that stopped it.
    trouble: Option<String>,
    /// Increases with every update.
    step: u64,
    values: BTreeMap<String, Built>,
    past: Past,
    /// The least time that the whole run lasts, in seconds.
    pace: f64,
}

impl Simulation {
    /// The node.
    #[must_use]
    pub fn node(&self) -> &str {
        &self.node
    }

    /// Returns true if it runs continuously.
    #[must_use]
    pub const fn goes(&self) -> bool {
        self.goes
    }

    /// Its current moment. Returns None until it has started.
    #[must_use]
    pub const fn moment(&self) -> Option<Moment> {
        self.moment
    }

    /// Returns true if it has finished.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.moment.is_some_and(|moment| moment.is_over())
    }

    /// The failure that stopped it. Returns None when there is none.
    #[must_use]
    pub fn trouble(&self) -> Option<&str> {
        self.trouble.as_deref()
    }

    /// Returns true once it has given outputs, if a port (`node.port`) is of its node.
    pub(super) fn has_values_of(&self, port: &str) -> bool {
        !self.values.is_empty() && is_of(port, &self.node)
    }

    /// An output: at the present moment, or at the earlier one that is shown.
    pub(super) fn built(&self, port: &str) -> Option<&Built> {
        self.past.values().unwrap_or(&self.values).get(port)
    }

    /// The least time that the whole run lasts, in seconds; 0 at full speed.
    #[must_use]
    pub const fn pace(&self) -> f64 {
        self.pace
    }

    /// The earlier moment that is shown, as its simulated time. Returns None while the present is shown.
    #[must_use]
    pub fn shown_time(&self) -> Option<f64> {
        self.past.shown()
    }
}

/// Returns true if an output (`node.port`) is of a node.
fn is_of(port: &str, node: &str) -> bool {
    port.split_once('.').is_some_and(|(name, _)| name == node)
}

/// The live run of this node. Returns None if another node runs: reports of the previous one can arrive late.
fn simulation_of<'s>(simulation: &'s mut Option<Simulation>, node: &str) -> Option<&'s mut Simulation> {
    simulation.as_mut().filter(|simulation| simulation.node == node)
}

impl Session {
    /// The node that runs live. Returns None when there is none.
    #[must_use]
    pub const fn simulation(&self) -> Option<&Simulation> {
        self.simulation.as_ref()
    }

    /// The node of the document with this name. Returns None when it cannot run live.
    fn simulated(&self, node: &str) -> Option<NodeIndex> {
        let graph = self.document.graph();
        let index = graph.find(node).ok()?;
        let muted = self.document.is_muted(index);
        graph.instance(index).node.process.filter(|_| !muted).map(|_| index)
    }

    /// Returns true if a node can run live.
    #[must_use]
    pub fn can_simulate(&self, node: &str) -> bool {
        self.simulated(node).is_some()
    }

    /// Starts the live run of a node; it waits at its start.
    pub fn simulate(&mut self, node: &str) {
        if !self.can_simulate(node) || self.simulation.as_ref().is_some_and(|simulation| simulation.node == node) {
            return;
        }
        self.end_simulation();
        self.simulation = Some(Simulation {
            node: node.to_owned(),
            goes: false,
            moment: None,
            hold: [false; 2],
            trouble: None,
            step: 0,
            values: BTreeMap::new(),
            past: Past::default(),
            pace: 0.0,
        });
        self.stale = true;
    }

    /// Ends the live run: the node is built like any other again.
    pub fn end_simulation(&mut self) {
        if self.simulation.take().is_some() {
            self.worker.run_live(Ask::End);
            self.stale = true;
        }
    }

    /// Runs it continuously, or pauses it.
    pub fn run_simulation(&mut self, goes: bool) {
        if let Some(simulation) = &mut self.simulation {
            simulation.goes = goes;
            self.worker.run_live(Ask::Go(goes));
        }
    }

    /// Advances it by this many steps.
    pub fn step_simulation(&mut self, steps: u32) {
        if self.simulation.is_some() {
            self.worker.run_live(Ask::Steps(steps));
        }
    }

    /// Lets the whole run last at least this many seconds; 0 for full speed.
    pub fn pace_simulation(&mut self, seconds: f64) {
        if let Some(simulation) = &mut self.simulation {
            simulation.pace = seconds.clamp(0.0, 86_400.0);
            self.worker.run_live(Ask::Pace(Duration::from_secs_f64(simulation.pace)));
        }
    }

    /// Restarts it.
    pub fn restart_simulation(&mut self) {
        if let Some(simulation) = &mut self.simulation {
            simulation.moment = None;
            simulation.past = Past::default();
            self.worker.run_live(Ask::Restart);
            self.stale = true;
        }
    }

    /// The earlier moments of the live run that can be shown, as simulated times in seconds, the first one first. There
    /// are none if the shown output is that of another node.
    #[must_use]
    pub fn earlier_times(&self) -> Vec<f64> {
        let simulation = self.simulation.as_ref().and_then(|simulation| Some((simulation, simulation.moment?.now)));
        let Some(((simulation, now), port)) = simulation.zip(self.shown()) else { return Vec::new() };
        simulation.past.times(&port, now)
    }

    /// Shows an earlier moment of the live run, one of [`Self::earlier_times`]; None shows the present. The run itself
    /// does not change.
    pub fn show_time(&mut self, time: Option<f64>) {
        if let Some(simulation) = &mut self.simulation {
            simulation.past.show(time);
        }
    }

    /// Shows the present again if the shown output has no picture of the earlier moment.
    pub(super) fn leave_past(&mut self) {
        let Some(values) = self.simulation.as_ref().and_then(|simulation| simulation.past.values()) else { return };
        if self.shown().is_some_and(|port| !values.contains_key(&port)) {
            self.show_time(None);
        }
    }

    /// The current time for a stroke on a node: 0 for a node that does not run live. Asks a running node to pause;
    /// returns None until it has. Then [`Self::release_simulation`] lets it continue. The present is shown again.
    pub fn time_of_stroke(&mut self, node: &str) -> Option<f64> {
        let Some(simulation) = self.simulation.as_mut().filter(|simulation| simulation.node == node) else {
            return Some(0.0);
        };
        simulation.past.show(None);
        if simulation.goes && !simulation.hold[0] {
            simulation.hold[0] = true;
            self.worker.run_live(Ask::Hold(true));
        }
        let paused = !simulation.goes || simulation.hold[1];
        simulation.moment.filter(|_| paused).map(|moment| moment.time())
    }

    /// Resumes it after a stroke.
    pub fn release_simulation(&mut self) {
        if let Some(simulation) = self.simulation.as_mut().filter(|simulation| simulation.hold[0]) {
            simulation.hold = [false; 2];
            self.worker.run_live(Ask::Hold(false));
        }
    }

    /// After a change of the document: ends the live run if its node is gone.
    pub(super) fn leave_what_is_gone(&mut self) {
        if self.simulation.as_ref().is_some_and(|simulation| self.simulated(&simulation.node).is_none()) {
            self.end_simulation();
        }
    }

    /// The node that runs live and all nodes after it; empty when it has finished.
    pub(super) fn behind_simulation(&self) -> BTreeSet<NodeIndex> {
        let under_way = self.simulation.as_ref().filter(|simulation| !simulation.is_over());
        let Some(first) = under_way.and_then(|simulation| self.simulated(&simulation.node)) else {
            return BTreeSet::new();
        };
        let graph = self.document.graph();
        let mut behind = BTreeSet::from([first]);
        for node in graph.topological() {
            let inputs = graph.instance(node).node.inputs.len();
            if (0..inputs).filter_map(|input| graph.source(node, input)).any(|from| behind.contains(&from.node)) {
                behind.insert(node);
            }
        }
        behind
    }

    /// The outputs that are on the screen, as `node.port`: in the viewport, with the terrain that they lie on, and in the
    /// inspector, which shows the first of a node where the viewport shows another.
    fn seen_ports(&self) -> BTreeSet<String> {
        let graph = self.document.graph();
        let first = self.selected().and_then(|node| graph.port(node).ok()).map(|port| graph.port_name(port));
        let names = [self.shown(), self.compared.clone(), first].into_iter().flatten().chain(self.also.iter().cloned());
        let names: BTreeSet<String> = names.collect();
        let ground = |name: &String| Some(graph.port_name(self.ground_of(graph.port(name).ok()?)?));
        let grounds: Vec<String> = names.iter().filter_map(ground).collect();
        names.into_iter().chain(grounds).collect()
    }

    /// Sends the current state to the live run.
    pub(super) fn follow_simulation(&self, order: &Order) {
        let Some(simulation) = &self.simulation else { return };
        let Some(index) = self.simulated(&simulation.node) else { return };
        let Some(port) = self.document.expand().port(Port { node: index, output: 0 }) else { return };
        let graph = self.document.graph();
        let outputs = graph.instance(index).node.outputs;
        let ports: Vec<String> = outputs.iter().map(|output| format!("{}.{}", simulation.node, output.name)).collect();
        let seen = self.seen_ports();
        let at = |(at, port): (usize, &String)| seen.contains(port).then_some(at);
        let shown = ports.iter().enumerate().filter_map(at).fold(Wanted::NONE, Wanted::with);
        self.worker.run_live(Ask::Run(Box::new(Subject {
            name: simulation.node.clone(),
            node: LiveNode {
                graph: Graph::clone(&order.graph),
                folder: order.folder.clone(),
                world: worker::coarser(order.world, order.cells),
                node: port.node,
            },
            ports,
            shown,
        })));
    }

    /// Takes over the outputs of the live run. Returns false if they are those of another node.
    pub(super) fn hear_simulation(
        &mut self,
        node: &str,
        moment: Moment,
        held: bool,
        cells: u32,
        values: Vec<(String, Value)>,
    ) -> bool {
        let Some(simulation) = simulation_of(&mut self.simulation, node) else { return false };
        let was_over = simulation.is_over();
        (simulation.moment, simulation.trouble) = (Some(moment), None);
        simulation.hold[1] = held && simulation.hold[0];
        simulation.step += 1;
        let (revision, step) = (self.revision, simulation.step);
        simulation.values =
            values.into_iter().map(|(port, value)| (port, Built { revision, cells, step, value })).collect();
        if !moment.is_over() {
            simulation.past.keep(moment.now, moment.end, &simulation.values);
        }
        simulation.goes &= !moment.is_over();
        self.stale |= was_over != moment.is_over();
        let fraction = if moment.end > 0.0 { (moment.now / moment.end) as f32 } else { 1.0 };
        let state = if moment.is_over() { NodeState::Fresh } else { NodeState::Running { fraction } };
        self.nodes.entry(simulation.node.clone()).or_default().state = state;
        true
    }

    pub(super) fn hear_of_simulated(&mut self, warnings: Vec<String>, on_device: bool) {
        if let Some(simulation) = &self.simulation {
            let info = self.nodes.entry(simulation.node.clone()).or_default();
            (info.warnings, info.on_device) = (warnings, on_device);
        }
    }

    pub(super) fn hear_trouble(&mut self, node: &str, error: &EvalError) {
        let Some(simulation) = simulation_of(&mut self.simulation, node) else { return };
        simulation.goes = false;
        simulation.trouble = Some(error.to_string());
        let state = NodeState::Failed { message: error.to_string(), hint: error.hint(), at: None };
        self.nodes.entry(simulation.node.clone()).or_default().state = state;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STORMS: &str = r#"(
        world: (size: 640, cells: 16),
        nodes: {
            "base": Perlin(),
            "storm": HydraulicPipe(height: "base", duration: 300),
            "flood": HydraulicPipe(height: "base", duration: 300),
        },
    )"#;

    fn session() -> Session {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("storms.ron");
        std::fs::write(&file, STORMS).expect("written");
        let store = crate::build::storage::in_memory();
        Session::open(Some(file), orograph_nodes::registry(), store, || {}).expect("the file can be read")
    }

    /// Reports of the node that ran before can arrive after another node was started.
    #[test]
    fn late_reports_of_the_node_before_are_not_taken() {
        let mut session = session();
        session.simulate("storm");
        session.simulate("flood");
        let moment = Moment { now: 20.0, since: Some(10.0), end: 300.0 };
        assert!(!session.hear_simulation("storm", moment, false, 16, Vec::new()));
        session.hear_trouble("storm", &EvalError::Cancelled);
        let now = session.simulation().expect("it runs");
        assert_eq!((now.node(), now.moment(), now.trouble()), ("flood", None, None));
        assert!(!matches!(session.node("storm").state, NodeState::Failed { .. } | NodeState::Running { .. }));

        assert!(session.hear_simulation("flood", moment, false, 16, Vec::new()));
        assert_eq!(session.simulation().and_then(Simulation::moment), Some(moment));
        session.hear_trouble("flood", &EvalError::Cancelled);
        assert!(session.simulation().is_some_and(|simulation| simulation.trouble().is_some()));
    }
}
