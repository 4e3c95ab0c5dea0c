//! The worker: builds what the editor shows, on its own thread, so that the window never waits.
//!
//! An [`Order`] says what is to be seen. The newest order wins: an older one is cancelled, and what it had finished stays
//! in the evaluator's cache, so that a node which an edit does not concern is not run again. Of each order the shown
//! node is built first with few cells, then the pictures of the other nodes, then the shown node with the cells that
//! were asked for. Each node is asked for by itself, so that one that fails, or panics, takes no other with it.

use std::{
    path::PathBuf,
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Receiver, Sender, channel},
    },
    thread,
    time::Duration,
};

use orograph_graph::{
    Cancel, EvalError, Evaluator, EvaluatorOptions, Event, Graph, Moment, Origin, Port, Value, Window, World,
};

use super::live::Bench;
pub use super::live::{Ask, Subject};
use crate::failure::Failure;

/// Cells along the longer side of the first, quick picture.
pub const QUICK_CELLS: u32 = 128;
/// Bytes of results that are kept.
const MEMORY: usize = 2 << 30;

/// How often land is shown while it grows.
const GLIMPSES: Duration = Duration::from_millis(200);

/// What is to be seen of a graph.
#[derive(Clone, Debug)]
pub struct Order {
    /// Which state of the document it is of; told back with everything.
    pub revision: u64,
    /// The graph, with the nodes of the files that it uses.
    pub graph: Arc<Graph>,
    /// What its files are relative to.
    pub folder: PathBuf,
    /// The document's world.
    pub world: World,
    /// What is shown large, if anything.
    pub shown: Vec<Wanted>,
    /// What is shown small: an output of every node, in the order in which they follow from each other.
    pub small: Vec<Wanted>,
    /// Cells along the longer side of what is shown large.
    pub cells: u32,
}

/// An output that is to be seen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// The node's name in the document.
    pub node: String,
    /// The output, as `node.port`.
    pub name: String,
    /// The output in the order's graph.
    pub port: Port,
}

/// What the worker tells.
#[derive(Clone, Debug)]
pub enum News {
    /// A kernel of a node of the document runs.
    Running {
        /// Of which order.
        revision: u64,
        /// The node's name.
        node: String,
        /// The finished part, 0 to 1.
        fraction: f32,
    },
    /// A kernel of a node has ended.
    Finished {
        /// Of which order.
        revision: u64,
        /// The node's name.
        node: String,
        /// How long it ran, or took to be found in the cache.
        time: Duration,
        /// Bytes of its results.
        bytes: usize,
        /// Cells along the longer side.
        cells: u32,
        /// Whether it ran.
        computed: bool,
    },
    /// An output is there.
    Built {
        /// Of which order.
        revision: u64,
        /// The output, as `node.port`.
        name: String,
        /// Cells along the longer side.
        cells: u32,
        /// What it is.
        value: Value,
    },
    /// An output of the shown node as it is while its kernel goes on.
    Glimpsed {
        /// Of which order.
        revision: u64,
        /// The output, as `node.port`.
        name: String,
        /// Cells along the longer side.
        cells: u32,
        /// What it is.
        value: Value,
    },
    /// The outputs of the node that is run live, as they are now.
    Live {
        /// Of which order.
        revision: u64,
        /// Where it is.
        moment: Moment,
        /// Whether it stands still while something is painted.
        held: bool,
        /// Cells along the longer side.
        cells: u32,
        /// The outputs, as `node.port`, with what they are.
        values: Vec<(String, Value)>,
    },
    /// The node that is run live cannot go on.
    LiveFailed {
        /// Of which order.
        revision: u64,
        /// Why.
        error: EvalError,
    },
    /// A node tells that its result may not be what was meant.
    Warned {
        /// Of which order.
        revision: u64,
        /// The node's name.
        node: String,
        /// In words.
        message: String,
    },
    /// An output cannot be built.
    Failed {
        /// Of which order.
        revision: u64,
        /// The node that was asked for.
        node: String,
        /// Why.
        error: EvalError,
    },
    /// All of an order is there, or has failed.
    Done {
        /// Of which order.
        revision: u64,
    },
}

/// The worker's end at the window.
#[derive(Debug)]
pub struct Worker {
    orders: Option<Sender<Order>>,
    news: Receiver<News>,
    running: Arc<Mutex<Cancel>>,
    thread: Option<thread::JoinHandle<()>>,
    bench: Bench,
}

impl Worker {
    /// Starts the worker. `wake` is called whenever there are news.
    ///
    /// # Errors
    /// When the system gives no threads.
    pub fn start(wake: impl Fn() + Send + Sync + 'static) -> Result<Self, Failure> {
        let options =
            EvaluatorOptions { memory_budget: MEMORY, glimpses: Some(GLIMPSES), ..EvaluatorOptions::default() };
        let evaluator = Arc::new(Evaluator::new(options).map_err(|error| Failure::unable(error.to_string()))?);
        let wake: Arc<dyn Fn() + Send + Sync> = Arc::new(wake);
        let (orders, inbox) = channel();
        let (outbox, news) = channel();
        let running = Arc::new(Mutex::new(Cancel::default()));
        let bench = Bench::start(Arc::clone(&evaluator), outbox.clone(), Arc::clone(&wake))?;
        let desk = Desk { evaluator, outbox, running: Arc::clone(&running), wake };
        let thread = thread::Builder::new()
            .name("worker".to_owned())
            .spawn(move || desk.work(&inbox))
            .map_err(|error| Failure::unable(format!("cannot start the worker thread: {error}")))?;
        Ok(Self { orders: Some(orders), news, running, thread: Some(thread), bench })
    }

    /// Takes an order, in place of the one before.
    pub fn submit(&self, order: Order) {
        let mut running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        running.cancel();
        // The order to come has a switch of its own.
        *running = Cancel::default();
        if let Some(orders) = &self.orders {
            // The worker only ends when this end is dropped.
            let _ = orders.send(order);
        }
    }

    /// Asks for a node to be run step by step.
    pub fn run_live(&self, ask: Ask) {
        self.bench.ask(ask);
    }

    /// What it has to tell, oldest first.
    pub fn news(&self) -> impl Iterator<Item = News> {
        self.news.try_iter()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.running.lock().unwrap_or_else(PoisonError::into_inner).cancel();
        self.orders = None;
        if let Some(thread) = self.thread.take() {
            // A panic in it has been told already.
            let _ = thread.join();
        }
    }
}

/// The worker's own end.
struct Desk {
    evaluator: Arc<Evaluator>,
    outbox: Sender<News>,
    running: Arc<Mutex<Cancel>>,
    wake: Arc<dyn Fn() + Send + Sync>,
}

impl Desk {
    fn work(&self, inbox: &Receiver<Order>) {
        while let Ok(mut order) = inbox.recv() {
            let cancel = {
                // Nobody submits while this is held, so that the switch is that of the newest order.
                let running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
                if let Some(newest) = inbox.try_iter().last() {
                    order = newest;
                }
                running.clone()
            };
            if self.carry_out(&order, &cancel).is_some() {
                self.tell(News::Done { revision: order.revision });
            }
        }
    }

    fn tell(&self, news: News) {
        // Nobody listens any more when the window is closed.
        let _ = self.outbox.send(news);
        (self.wake)();
    }

    /// `None` when it was cancelled.
    fn carry_out(&self, order: &Order, cancel: &Cancel) -> Option<()> {
        let quick = coarser(order.world, QUICK_CELLS.min(order.cells));
        let full = coarser(order.world, order.cells);
        for wanted in order.shown.iter().chain(order.small.iter().filter(|small| !order.shown.contains(small))) {
            self.build(order, wanted, quick, cancel)?;
        }
        if full != quick {
            for wanted in &order.shown {
                self.build(order, wanted, full, cancel)?;
            }
        }
        Some(())
    }

    fn build(&self, order: &Order, wanted: &Wanted, world: World, cancel: &Cancel) -> Option<()> {
        let revision = order.revision;
        let cells = world.cells[0].max(world.cells[1]);
        let events = |event: Event| match event {
            Event::Planned { .. } => {}
            Event::NodeStarted { name, .. } => {
                self.tell(News::Running { revision, node: outer(&name).to_owned(), fraction: 0.0 });
            }
            Event::NodeProgress { name, fraction, .. } => {
                self.tell(News::Running { revision, node: outer(&name).to_owned(), fraction });
            }
            Event::NodeFinished { name, time, bytes, origin, .. } => {
                let (node, computed) = (outer(&name).to_owned(), origin == Origin::Computed);
                self.tell(News::Finished { revision, node, time, bytes, cells, computed });
            }
            Event::NodeGlimpse { node, values, .. } if cells > QUICK_CELLS => {
                let watched = |output: usize| order.shown.iter().find(|shown| shown.port == Port { node, output });
                for (output, value) in values {
                    if let Some(Wanted { name, .. }) = watched(output) {
                        self.tell(News::Glimpsed { revision, name: name.clone(), cells, value });
                    }
                }
            }
            Event::NodeGlimpse { .. } => {}
            Event::Warning { name, message, .. } => {
                self.tell(News::Warned { revision, node: outer(&name).to_owned(), message });
            }
        };
        let request = [(wanted.port, Window::whole(world))];
        match self.evaluator.evaluate(&order.graph, &order.folder, &request, cancel, &events) {
            Ok(mut values) => {
                if let Some(value) = values.pop() {
                    self.tell(News::Built { revision, name: wanted.name.clone(), cells, value });
                }
            }
            Err(EvalError::Cancelled) => return None,
            Err(error) => self.tell(News::Failed { revision, node: wanted.node.clone(), error }),
        }
        Some(())
    }
}

/// The node of the document that a node of the expanded graph belongs to.
fn outer(name: &str) -> &str {
    name.split_once('/').map_or(name, |(outer, _)| outer)
}

/// The same world with at most so many cells along its longer side. Where no such number of cells is square the size is
/// cut to whole cells.
#[must_use]
pub fn coarser(world: World, most: u32) -> World {
    let axis = usize::from(world.size[1] > world.size[0]);
    if world.cells[axis] <= most || most == 0 {
        return world;
    }
    let cell_m = world.size[axis] / f64::from(most);
    let mut coarse = World { cells: [most; 2], ..world };
    coarse.cells[1 - axis] = ((world.size[1 - axis] / cell_m).round() as u32).max(1);
    coarse.size[1 - axis] = f64::from(coarse.cells[1 - axis]) * cell_m;
    coarse
}
