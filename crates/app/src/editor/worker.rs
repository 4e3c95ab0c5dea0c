//! The worker: builds what the editor shows, on its own thread, so that the window never waits.
//!
//! An [`Order`] says what is to be seen. The newest order wins: an older one is cancelled, and what it had finished stays
//! in the store, so that a node which an edit does not concern is not run again. Of each order the shown node comes first
//! with few cells, then the pictures of the other nodes, then the shown node with the cells that were asked for; all of it
//! is one evaluation, in which a node that fails does not affect the others. A part of the world at finer cells comes last,
//! when all that is done. An order that is done and not followed by
//! another one is written to the store's folder, where the next run of the program finds it.

use std::{
    path::PathBuf,
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Receiver, RecvTimeoutError, Sender, channel},
    },
    thread,
    time::Duration,
};

use orograph_graph::{
    Cancel, Delivered, EvalError, Evaluation, Evaluator, EvaluatorOptions, Event, Graph, Moment, Origin, Port, Request,
    Store, Value, Window, World,
};

use super::live::Bench;
pub use super::live::{Ask, Subject};
use crate::failure::Failure;

/// Cells along the longer side of the first, quick picture.
pub const QUICK_CELLS: u32 = 128;
/// How often land is shown while it grows.
const GLIMPSES: Duration = Duration::from_millis(200);
/// How long nothing is edited before results are written to the store's folder.
const REST: Duration = Duration::from_secs(1);

/// What is to be seen of a graph.
#[derive(Clone, Debug)]
pub struct Order {
    /// Orders with the same number differ in [`Self::part`] alone, so that the rest is not carried out twice.
    pub number: u64,
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
    /// Outputs that are stored with as many cells as what is shown large if their kernel runs anyway: those that other
    /// nodes read, and the document's own, which an export asks for.
    pub byproducts: Vec<Port>,
    /// Cells along the longer side of what is shown large.
    pub cells: u32,
    /// What is shown at finer cells, if anything.
    pub part: Option<Part>,
}

/// A part of the world at cells of its own.
#[derive(Clone, Debug)]
pub struct Part {
    /// The output.
    pub wanted: Wanted,
    /// The cells.
    pub window: Window,
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
    /// The part of an output at finer cells is there, or cannot be built.
    Part {
        /// Of which order.
        revision: u64,
        /// The output, as `node.port`.
        name: String,
        /// The part.
        window: Window,
        /// What it is, or why it cannot be built.
        value: Result<Value, EvalError>,
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
    evaluator: Arc<Evaluator>,
}

impl Worker {
    /// Starts the worker. `wake` is called whenever there are news.
    ///
    /// # Errors
    /// When the system gives no threads.
    pub fn start(store: Arc<Store>, wake: impl Fn() + Send + Sync + 'static) -> Result<Self, Failure> {
        let options = EvaluatorOptions { store, glimpses: Some(GLIMPSES), ..EvaluatorOptions::default() };
        let evaluator = Arc::new(Evaluator::new(options).map_err(|error| Failure::unable(error.to_string()))?);
        let wake: Arc<dyn Fn() + Send + Sync> = Arc::new(wake);
        let (orders, inbox) = channel();
        let (outbox, news) = channel();
        let running = Arc::new(Mutex::new(Cancel::default()));
        let bench = Bench::start(Arc::clone(&evaluator), outbox.clone(), Arc::clone(&wake))?;
        let desk = Desk { evaluator: Arc::clone(&evaluator), outbox, running: Arc::clone(&running), wake };
        let thread = thread::Builder::new()
            .name("worker".to_owned())
            .spawn(move || desk.work(&inbox))
            .map_err(|error| Failure::unable(format!("cannot start the worker thread: {error}")))?;
        Ok(Self { orders: Some(orders), news, running, thread: Some(thread), bench, evaluator })
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

    /// The evaluator, with the results of all that has been shown.
    #[must_use]
    pub const fn evaluator(&self) -> &Arc<Evaluator> {
        &self.evaluator
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
        let mut settled: Option<Order> = None;
        let mut done = None;
        loop {
            let received = match &settled {
                Some(_) => inbox.recv_timeout(REST),
                None => inbox.recv().map_err(|_| RecvTimeoutError::Disconnected),
            };
            match received {
                Ok(order) => settled = self.carry_out_newest(order, inbox, &mut done),
                Err(RecvTimeoutError::Timeout) => {
                    let running = self.running.lock().unwrap_or_else(PoisonError::into_inner).clone();
                    settled.take().iter().for_each(|order| self.keep(order, &running));
                }
                Err(RecvTimeoutError::Disconnected) => {
                    settled.iter().for_each(|order| self.keep(order, &Cancel::default()));
                    return;
                }
            }
        }
    }

    /// Carries out an order, or the newest one after it, as far as it is not done. `done` is the number of the order that
    /// was carried out last. Returns None when it was cancelled.
    fn carry_out_newest(&self, mut order: Order, inbox: &Receiver<Order>, done: &mut Option<u64>) -> Option<Order> {
        let cancel = {
            // Nobody submits while this is held, so that the switch is that of the newest order.
            let running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(newest) = inbox.try_iter().last() {
                order = newest;
            }
            running.clone()
        };
        if *done != Some(order.number) {
            self.carry_out(&order, &cancel);
            if cancel.is_cancelled() {
                return None;
            }
            *done = Some(order.number);
            self.tell(News::Done { revision: order.revision });
        }
        if let Some(part) = &order.part {
            self.build_part(&order, part, &cancel);
        }
        (!cancel.is_cancelled()).then_some(order)
    }

    fn tell(&self, news: News) {
        // Nobody listens any more when the window is closed.
        let _ = self.outbox.send(news);
        (self.wake)();
    }

    fn carry_out(&self, order: &Order, cancel: &Cancel) {
        let (wanted, requests) = order.requests();
        let byproducts = order.byproducts();
        let evaluation = order.evaluation(&requests, &byproducts);
        let events = |event: Event| self.pass_on(order, event);
        self.evaluator.deliver(&evaluation, cancel, &events, &|request, delivery| {
            let (Wanted { node, name, .. }, revision) = (wanted[request], order.revision);
            match delivery {
                Ok(Delivered { value, .. }) => {
                    let cells = longer(requests[request].window.world.cells);
                    self.tell(News::Built { revision, name: name.clone(), cells, value });
                }
                Err(EvalError::Cancelled) => {}
                Err(error) => self.tell(News::Failed { revision, node: node.clone(), error }),
            }
        });
    }

    /// Builds the part at finer cells. Nodes keep the state and the time of the whole.
    fn build_part(&self, order: &Order, Part { wanted, window }: &Part, cancel: &Cancel) {
        let requests = [Request { port: wanted.port, window: *window }];
        let evaluation = order.evaluation(&requests, &[]);
        self.evaluator.deliver(&evaluation, cancel, &|_| {}, &|_, delivery| {
            let (revision, name, window) = (order.revision, wanted.name.clone(), *window);
            match delivery.map(|delivered| delivered.value) {
                Err(EvalError::Cancelled) => {}
                value => self.tell(News::Part { revision, name, window, value }),
            }
        });
    }

    fn pass_on(&self, order: &Order, event: Event) {
        let revision = order.revision;
        match event {
            Event::Planned { .. } => {}
            Event::NodeStarted { name, .. } => {
                self.tell(News::Running { revision, node: outer(&name).to_owned(), fraction: 0.0 });
            }
            Event::NodeProgress { name, fraction, .. } => {
                self.tell(News::Running { revision, node: outer(&name).to_owned(), fraction });
            }
            Event::NodeFinished { name, cells, time, bytes, origin, .. } => {
                let (node, computed) = (outer(&name).to_owned(), origin == Origin::Computed);
                self.tell(News::Finished { revision, node, time, bytes, cells: longer(cells), computed });
            }
            Event::NodeGlimpse { node, values, .. } => {
                let watched = |output: usize| order.shown.iter().find(|shown| shown.port == Port { node, output });
                for (output, value) in values {
                    let cells = value.as_field().map_or(0, |field| longer(field.window().world.cells));
                    if let Some(Wanted { name, .. }) = watched(output).filter(|_| cells > QUICK_CELLS) {
                        self.tell(News::Glimpsed { revision, name: name.clone(), cells, value });
                    }
                }
            }
            Event::Warning { name, message, .. } => {
                self.tell(News::Warned { revision, node: outer(&name).to_owned(), message });
            }
        }
    }

    /// Writes what an order asked for to the store's folder. Where that does not work nothing is lost: it is computed again.
    fn keep(&self, order: &Order, cancel: &Cancel) {
        let (_, requests) = order.requests();
        let _ = self.evaluator.persist(&order.evaluation(&requests, &[]), cancel);
    }
}

impl Order {
    fn quick(&self) -> World {
        coarser(self.world, QUICK_CELLS.min(self.cells))
    }

    fn full(&self) -> World {
        coarser(self.world, self.cells)
    }

    /// What is asked for, the most urgent first.
    fn requests(&self) -> (Vec<&Wanted>, Vec<Request>) {
        let (quick, full) = (self.quick(), self.full());
        let small = self.small.iter().filter(|small| !self.shown.contains(small));
        let at_first = self.shown.iter().chain(small).map(|wanted| (wanted, quick));
        let then = self.shown.iter().filter(|_| full != quick).map(|wanted| (wanted, full));
        let request = |(wanted, world): (_, World)| -> (&Wanted, Request) {
            let wanted: &Wanted = wanted;
            (wanted, Request { port: wanted.port, window: Window::whole(world) })
        };
        at_first.chain(then).map(request).unzip()
    }

    fn byproducts(&self) -> Vec<Request> {
        let window = Window::whole(self.full());
        self.byproducts.iter().map(|port| Request { port: *port, window }).collect()
    }

    fn evaluation<'a>(&'a self, requests: &'a [Request], byproducts: &'a [Request]) -> Evaluation<'a> {
        Evaluation { graph: &self.graph, folder: &self.folder, requests, byproducts }
    }
}

/// Cells along the longer side.
pub(super) fn longer(cells: [u32; 2]) -> u32 {
    cells[0].max(cells[1])
}

/// The node of the document that a node of the expanded graph belongs to.
pub(super) fn outer(name: &str) -> &str {
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
