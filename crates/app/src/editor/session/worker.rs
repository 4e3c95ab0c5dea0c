//! The worker: builds what the editor shows on its own thread, so that the window never waits.
//!
//! An [`Order`] lists the outputs to show. The newest order wins: an older one is cancelled, and its finished results
//! stay in the store, so that a node that an edit does not affect is not run again. Each order builds the shown node
//! with few cells first, then the thumbnails of the other nodes, then the shown node at the preview resolution. All of
//! this is one evaluation, in which a failing node does not affect unrelated nodes. The finer part of a close view
//! comes then, and last the measures of a shown height that the file states expectations about. When an order is
//! finished and no other follows, its results are written to the store's folder, where the next run of the program
//! finds them.

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
    Backend as _, Cancel, Cpu, Delivered, EvalError, Evaluation, Evaluator, EvaluatorOptions, Event, Expectations,
    Graph, Moment, Origin, Port, Request, Store, Value, Window, World,
};

use super::live::LiveRun;
pub use super::live::{Ask, Subject};
use super::measuring::Measuring;
use crate::{
    build::backend::BackendName,
    report::{expect::Checked, failure::Failure},
};

/// Cells along the longer side of the first, quick preview.
pub const QUICK_CELLS: u32 = 128;
/// Interval of progressive previews.
const GLIMPSES: Duration = Duration::from_millis(200);
/// Idle time before results are written to the store's folder.
const REST: Duration = Duration::from_secs(1);

/// The outputs to show of a graph.
#[derive(Clone, Debug)]
pub struct Order {
    /// Orders with the same number differ only in [`Self::part`], so that the rest is not built twice.
    pub number: u64,
    /// The state of the document; returned with every message.
    pub revision: u64,
    /// The graph, including the nodes of the files that it uses.
    pub graph: Arc<Graph>,
    /// The folder that its files are relative to.
    pub folder: PathBuf,
    /// The world of the document.
    pub world: World,
    /// The outputs to show in the viewport.
    pub shown: Vec<Wanted>,
    /// The outputs to show as thumbnails: one of every node, in topological order.
    pub small: Vec<Wanted>,
    /// Outputs that are stored at the preview resolution if their kernel runs anyway: those that other nodes read, and
    /// the document's own, which an export needs.
    pub byproducts: Vec<Port>,
    /// Preview resolution: cells along the longer side.
    pub cells: u32,
    /// The finer part to show, if any.
    pub part: Option<Part>,
    /// What to measure when everything is built, if anything.
    pub expected: Option<Expected>,
}

/// What the file expects of one of the shown outputs.
#[derive(Clone, Debug)]
pub struct Expected {
    /// The output in the order's graph.
    pub port: Port,
    /// Its name among the outputs of the file.
    pub output: String,
    /// What is expected.
    pub expectations: Arc<Expectations>,
}

/// A finer part: a part of the world with its own cells.
#[derive(Clone, Debug)]
pub struct Part {
    /// The outputs.
    pub wanted: Vec<Wanted>,
    /// The cells.
    pub window: Window,
}

/// An output to show.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// The name of the node in the document.
    pub node: String,
    /// The output, as `node.port`.
    pub name: String,
    /// The output in the order's graph.
    pub port: Port,
}

/// A message of the worker.
#[derive(Clone, Debug)]
pub enum News {
    /// A kernel of a node of the document is running.
    Running {
        /// The state of the document of the order.
        revision: u64,
        /// The node's name.
        node: String,
        /// The finished part, 0 to 1.
        fraction: f32,
    },
    /// A kernel of a node has finished.
    Finished {
        /// The state of the document of the order.
        revision: u64,
        /// The node's name.
        node: String,
        /// How long it ran, or how long the cache lookup took.
        time: Duration,
        /// Size of its results in bytes.
        bytes: usize,
        /// Cells along the longer side.
        cells: u32,
        /// True if the kernel ran.
        computed: bool,
        /// True if a device ran it, or the stored result is that of one.
        on_device: bool,
    },
    /// An output has been built.
    Built {
        /// The state of the document of the order.
        revision: u64,
        /// The output, as `node.port`.
        name: String,
        /// Cells along the longer side.
        cells: u32,
        /// The value.
        value: Value,
    },
    /// The finer part of an output has been built, or cannot be built.
    Part {
        /// The state of the document of the order.
        revision: u64,
        /// The output, as `node.port`.
        name: String,
        /// The part.
        window: Window,
        /// The value, or why it cannot be built.
        value: Result<Value, EvalError>,
    },
    /// An intermediate result of the shown node while its kernel runs.
    Glimpsed {
        /// The state of the document of the order.
        revision: u64,
        /// The output, as `node.port`.
        name: String,
        /// Cells along the longer side.
        cells: u32,
        /// The value.
        value: Value,
    },
    /// The current outputs of the node that runs live.
    Live {
        /// The node's name.
        node: String,
        /// The current moment.
        moment: Moment,
        /// True if it is paused for a stroke.
        held: bool,
        /// Cells along the longer side.
        cells: u32,
        /// The outputs, as `node.port`, with their values.
        values: Vec<(String, Value)>,
        /// The warnings since its start.
        warnings: Vec<String>,
        /// True if a device runs it.
        on_device: bool,
    },
    /// The live run has failed.
    LiveFailed {
        /// The node's name.
        node: String,
        /// The reason.
        error: EvalError,
    },
    /// A node warns that its result may not be what the user intended.
    Warned {
        /// The state of the document of the order.
        revision: u64,
        /// The node's name.
        node: String,
        /// The text.
        message: String,
    },
    /// An output cannot be built.
    Failed {
        /// The state of the document of the order.
        revision: u64,
        /// The node that was requested.
        node: String,
        /// The reason.
        error: EvalError,
    },
    /// Everything in an order has been built or has failed.
    Done {
        /// The state of the document of the order.
        revision: u64,
    },
    /// What the file expects has been measured, or cannot be measured.
    Measured {
        /// The state of the document of the order.
        revision: u64,
        /// The figures, or why there are none.
        checked: Result<Arc<Checked>, String>,
    },
}

/// The handle of the worker, used by the session.
#[derive(Debug)]
pub struct Worker {
    orders: Option<Sender<Order>>,
    news: Receiver<News>,
    running: Arc<Mutex<Cancel>>,
    thread: Option<thread::JoinHandle<()>>,
    live_run: LiveRun,
    evaluator: Arc<Evaluator>,
}

impl Worker {
    /// Starts the worker. Calls `wake` for every new message.
    ///
    /// # Errors
    /// When the system cannot start a thread.
    pub fn start(store: Arc<Store>, wake: impl Fn() + Send + Sync + 'static) -> Result<Self, Failure> {
        let (backend, device) = BackendName::both();
        let glimpses = Some(GLIMPSES);
        let options = EvaluatorOptions { backend, device, store, glimpses, ..EvaluatorOptions::default() };
        let evaluator = Arc::new(Evaluator::new(options).map_err(|error| Failure::unable(error.to_string()))?);
        let wake: Arc<dyn Fn() + Send + Sync> = Arc::new(wake);
        let (orders, inbox) = channel();
        let (outbox, news) = channel();
        let running = Arc::new(Mutex::new(Cancel::default()));
        let live_run = LiveRun::start(Arc::clone(&evaluator), outbox.clone(), Arc::clone(&wake))?;
        let worker = WorkerThread { evaluator: Arc::clone(&evaluator), outbox, running: Arc::clone(&running), wake };
        let thread = thread::Builder::new()
            .name("worker".to_owned())
            .spawn(move || worker.work(&inbox))
            .map_err(|error| Failure::unable(format!("cannot start the worker thread: {error}")))?;
        Ok(Self { orders: Some(orders), news, running, thread: Some(thread), live_run, evaluator })
    }

    /// Submits an order, which replaces the one before.
    pub fn submit(&self, order: Order) {
        let mut running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        running.cancel();
        // The new order has its own cancel switch.
        *running = Cancel::default();
        if let Some(orders) = &self.orders {
            // The worker only ends when this end is dropped.
            let _ = orders.send(order);
        }
    }

    /// The evaluator, with the results of everything shown so far.
    #[must_use]
    pub const fn evaluator(&self) -> &Arc<Evaluator> {
        &self.evaluator
    }

    /// Sends a request to the live run.
    pub fn run_live(&self, ask: Ask) {
        self.live_run.ask(ask);
    }

    /// The messages of the worker, oldest first.
    pub fn news(&self) -> impl Iterator<Item = News> {
        self.news.try_iter()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.running.lock().unwrap_or_else(PoisonError::into_inner).cancel();
        self.orders = None;
        if let Some(thread) = self.thread.take() {
            // A panic in the thread has already been reported.
            let _ = thread.join();
        }
    }
}

/// The thread of the worker.
struct WorkerThread {
    evaluator: Arc<Evaluator>,
    outbox: Sender<News>,
    running: Arc<Mutex<Cancel>>,
    wake: Arc<dyn Fn() + Send + Sync>,
}

impl WorkerThread {
    fn work(&self, inbox: &Receiver<Order>) {
        let mut settled: Option<Order> = None;
        let (mut done, mut measuring) = (None, Measuring::default());
        loop {
            let received = match &settled {
                Some(_) => inbox.recv_timeout(REST),
                None => inbox.recv().map_err(|_| RecvTimeoutError::Disconnected),
            };
            match received {
                Ok(order) => settled = self.carry_out_newest(order, inbox, &mut done, &mut measuring),
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

    /// Carries out an order, or the newest order after it, as far as it is not done yet. `done` is the number of the
    /// last order that was carried out. Returns None when it was cancelled.
    fn carry_out_newest(
        &self,
        mut order: Order,
        inbox: &Receiver<Order>,
        done: &mut Option<u64>,
        measuring: &mut Measuring,
    ) -> Option<Order> {
        let cancel = {
            // No order can be submitted while this lock is held, so the switch belongs to the newest order.
            let running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(newest) = inbox.try_iter().last() {
                order = newest;
            }
            running.clone()
        };
        if *done != Some(order.number) {
            measuring.forget();
            self.carry_out(&order, &cancel, measuring);
            if cancel.is_cancelled() {
                return None;
            }
            *done = Some(order.number);
            self.tell(News::Done { revision: order.revision });
        }
        if let Some(part) = &order.part {
            self.build_part(&order, part, &cancel);
        }
        if let Some(checked) = measuring.measure(&order, &cancel) {
            self.tell(News::Measured { revision: order.revision, checked });
        }
        (!cancel.is_cancelled()).then_some(order)
    }

    fn tell(&self, news: News) {
        // Ignored: nobody receives it once the window is closed.
        let _ = self.outbox.send(news);
        (self.wake)();
    }

    fn carry_out(&self, order: &Order, cancel: &Cancel, measuring: &Measuring) {
        let (wanted, requests) = order.requests();
        let byproducts = order.byproducts();
        let evaluation = order.evaluation(&requests, &byproducts);
        let events = |event: Event| self.pass_on(order, event);
        self.evaluator.deliver(&evaluation, cancel, &events, &|request, delivery| {
            let (Wanted { node, name, .. }, revision) = (wanted[request], order.revision);
            match delivery {
                Ok(Delivered { value, key }) => {
                    measuring.keep(order, &requests[request], &value, key);
                    let cells = longer(requests[request].window.world.cells);
                    self.tell(News::Built { revision, name: name.clone(), cells, value });
                }
                Err(EvalError::Cancelled) => {}
                Err(error) => self.tell(News::Failed { revision, node: node.clone(), error }),
            }
        });
    }

    /// Builds the finer part. The nodes keep the state and the time of the whole.
    fn build_part(&self, order: &Order, Part { wanted, window }: &Part, cancel: &Cancel) {
        let requests: Vec<Request> =
            wanted.iter().map(|wanted| Request { port: wanted.port, window: *window }).collect();
        let evaluation = order.evaluation(&requests, &[]);
        self.evaluator.deliver(&evaluation, cancel, &|_| {}, &|request, delivery| {
            let (revision, name, window) = (order.revision, wanted[request].name.clone(), *window);
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
            Event::NodeFinished { name, cells, time, bytes, origin, backend, .. } => {
                let (node, computed) = (outer(&name).to_owned(), origin == Origin::Computed);
                let (cells, on_device) = (longer(cells), backend != Cpu.name());
                self.tell(News::Finished { revision, node, time, bytes, cells, computed, on_device });
            }
            Event::NodeGlimpse { node, values, .. } => {
                let watched = |output: usize| order.shown.iter().find(|shown| shown.port == Port { node, output });
                for (output, value) in values {
                    let cells = value.as_field().map_or(0, |field| longer(field.window().world.cells));
                    if let Some(Wanted { name, .. }) = watched(output).filter(|_| cells >= QUICK_CELLS) {
                        self.tell(News::Glimpsed { revision, name: name.clone(), cells, value });
                    }
                }
            }
            Event::Warning { name, message, .. } => {
                self.tell(News::Warned { revision, node: outer(&name).to_owned(), message });
            }
        }
    }

    /// Writes the results of an order to the store's folder. If that fails, nothing is lost: they are computed again.
    fn keep(&self, order: &Order, cancel: &Cancel) {
        let (_, requests) = order.requests();
        let _ = self.evaluator.persist(&order.evaluation(&requests, &[]), cancel);
    }
}

impl Order {
    fn quick(&self) -> World {
        coarser(self.world, QUICK_CELLS.min(self.cells))
    }

    /// The world at the preview resolution.
    pub(super) fn full(&self) -> World {
        coarser(self.world, self.cells)
    }

    /// The requests of the order, the most urgent first.
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
pub(crate) fn longer(cells: [u32; 2]) -> u32 {
    cells[0].max(cells[1])
}

/// The node of the document that a node of the expanded graph belongs to.
pub(crate) fn outer(name: &str) -> &str {
    name.split_once('/').map_or(name, |(outer, _)| outer)
}

/// The same world with at most this many cells along its longer side. If no such number of cells is square, the size is
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
