//! The live run: runs the process of one node step by step on its own thread, so that you can watch and paint on it.
//!
//! A request names the node and the state of the graph. If the graph changes in a way that would not have changed any
//! step taken so far, the process continues; otherwise it restarts.

use std::{
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Receiver, RecvTimeoutError, Sender, channel},
    },
    thread,
    time::{Duration, Instant},
};

use orograph_graph::{Cancel, EvalError, Evaluator, Live, LiveNode, Wanted};

use super::worker::News;
use crate::report::failure::Failure;

/// The interval of progress reports.
const LOOKS: Duration = Duration::from_millis(100);

/// The node to run, and the state of the graph.
#[derive(Clone, Debug)]
pub struct Subject {
    /// The name of the node in the document.
    pub name: String,
    /// The node in the graph that includes the files it uses, with the requested cells.
    pub node: LiveNode,
    /// The outputs of the node, as `node.port`.
    pub ports: Vec<String>,
    /// Those of them to report on the way; all are reported at the end.
    pub shown: Wanted,
}

/// A request to the live run.
#[derive(Debug)]
pub enum Ask {
    /// Run this node: continue if possible, otherwise from the start.
    Run(Box<Subject>),
    /// Run continuously, or stop.
    Go(bool),
    /// Take this many steps.
    Steps(u32),
    /// Let the whole run last at least this long.
    Pace(Duration),
    /// Pause while something is painted, whatever else was requested.
    Hold(bool),
    /// Restart.
    Restart,
    /// End the live run.
    End,
}

/// The handle of the live run, used by the session.
#[derive(Debug)]
pub(crate) struct LiveRun {
    asks: Option<Sender<Ask>>,
    switches: Arc<Mutex<Switches>>,
    thread: Option<thread::JoinHandle<()>>,
}

/// Cancels a starting process and a running one.
#[derive(Debug, Default)]
struct Switches {
    begin: Cancel,
    process: Cancel,
}

impl LiveRun {
    pub(crate) fn start(
        evaluator: Arc<Evaluator>,
        outbox: Sender<News>,
        wake: Arc<dyn Fn() + Send + Sync>,
    ) -> Result<Self, Failure> {
        let (asks, inbox) = channel();
        let switches: Arc<Mutex<Switches>> = Arc::default();
        let work = Work {
            evaluator,
            outbox,
            wake,
            switches: Arc::clone(&switches),
            subject: None,
            live: None,
            goes: false,
            held: false,
            steps: 0,
            pace: Duration::ZERO,
            due: None,
            shown: None,
        };
        let thread = thread::Builder::new()
            .name("live run".to_owned())
            .spawn(move || work.work(&inbox))
            .map_err(|error| Failure::unable(format!("cannot start a thread: {error}")))?;
        Ok(Self { asks: Some(asks), switches, thread: Some(thread) })
    }

    pub(crate) fn ask(&self, ask: Ask) {
        let mut switches = self.switches.lock().unwrap_or_else(PoisonError::into_inner);
        if matches!(ask, Ask::Run(_) | Ask::Restart | Ask::End) {
            std::mem::take(&mut switches.begin).cancel();
        }
        if matches!(ask, Ask::Restart | Ask::End) {
            std::mem::take(&mut switches.process).cancel();
        }
        if let Some(asks) = &self.asks {
            // The thread only ends when this end is dropped.
            let _ = asks.send(ask);
        }
    }
}

impl Drop for LiveRun {
    fn drop(&mut self) {
        self.ask(Ask::End);
        self.asks = None;
        if let Some(thread) = self.thread.take() {
            // A panic in the thread has already been reported.
            let _ = thread.join();
        }
    }
}

/// The thread of the live run.
struct Work {
    evaluator: Arc<Evaluator>,
    outbox: Sender<News>,
    wake: Arc<dyn Fn() + Send + Sync>,
    switches: Arc<Mutex<Switches>>,
    subject: Option<Box<Subject>>,
    /// The process, with its cancel switch.
    live: Option<(Live, Cancel)>,
    goes: bool,
    held: bool,
    steps: u32,
    /// The least time that the whole run lasts.
    pace: Duration,
    /// When that allows the next step.
    due: Option<Instant>,
    /// When progress was last reported.
    shown: Option<Instant>,
}

impl Work {
    fn work(mut self, inbox: &Receiver<Ask>) {
        loop {
            let ask = if self.moves() {
                match inbox.recv_timeout(self.wait()) {
                    Ok(ask) => Some(ask),
                    Err(RecvTimeoutError::Timeout) => None,
                    Err(RecvTimeoutError::Disconnected) => return,
                }
            } else {
                match inbox.recv() {
                    Ok(ask) => Some(ask),
                    Err(_) => return,
                }
            };
            let done = match ask {
                Some(ask) => self.take(ask),
                None => self.step(),
            };
            if let Err(error) = done {
                self.live = None;
                if let Some(subject) = self.subject.as_ref().filter(|_| error != EvalError::Cancelled) {
                    self.tell(News::LiveFailed { node: subject.name.clone(), error });
                }
            }
        }
    }

    /// Returns true if there is a next step to take.
    fn moves(&self) -> bool {
        let Some((live, _)) = &self.live else { return false };
        let goes_on = !self.held && (self.goes || self.steps > 0);
        !live.moment().is_over() && (live.is_behind() || goes_on)
    }

    /// How long the next step has to wait. Steps that were asked for do not wait, nor do those after a lost device.
    fn wait(&self) -> Duration {
        let is_paced = self.steps == 0 && self.live.as_ref().is_some_and(|(live, _)| !live.is_behind());
        let due = self.due.filter(|_| is_paced);
        due.map_or(Duration::ZERO, |due| due.saturating_duration_since(Instant::now()))
    }

    fn tell(&self, news: News) {
        // Ignored: nobody receives it once the window is closed.
        let _ = self.outbox.send(news);
        (self.wake)();
    }

    fn take(&mut self, ask: Ask) -> Result<(), EvalError> {
        match ask {
            Ask::Run(subject) => {
                let subject = self.subject.insert(subject);
                let follows = match &mut self.live {
                    Some((live, cancel)) => live.follow(&self.evaluator, subject.node.clone(), cancel)?,
                    None => false,
                };
                if !follows {
                    return self.begin();
                }
            }
            Ask::Go(goes) => self.goes = goes,
            Ask::Steps(steps) => self.steps += steps,
            Ask::Pace(pace) => (self.pace, self.due) = (pace, None),
            Ask::Hold(held) => self.held = held,
            Ask::Restart => return self.begin(),
            Ask::End => {
                (self.subject, self.live) = (None, None);
                (self.goes, self.held, self.steps) = (false, false, 0);
                (self.pace, self.due) = (Duration::ZERO, None);
            }
        }
        self.show()
    }

    fn begin(&mut self) -> Result<(), EvalError> {
        self.live = None;
        let Some(subject) = &self.subject else { return Ok(()) };
        let (begin, process) = {
            let switches = self.switches.lock().unwrap_or_else(PoisonError::into_inner);
            (switches.begin.clone(), switches.process.clone())
        };
        let live = Live::begin(&self.evaluator, subject.node.clone(), &begin, &|_| {})?;
        self.live = Some((live, process));
        self.show()
    }

    fn step(&mut self) -> Result<(), EvalError> {
        let began = Instant::now();
        let Some((live, cancel)) = &mut self.live else { return Ok(()) };
        // After a lost device it first comes back to where it was; those steps do not count.
        let was_behind = live.is_behind();
        let before = live.moment();
        live.step(&self.evaluator, cancel)?;
        let counts = !was_behind && !live.is_behind();
        self.steps -= u32::from(counts && self.steps > 0);
        if counts && before.end > 0.0 {
            let passed = ((live.moment().now - before.now) / before.end).clamp(0.0, 1.0);
            self.due = Some(self.due.map_or(began, |due| due.max(began)) + self.pace.mul_f64(passed));
        }
        if !self.moves() || self.wait() > LOOKS || self.shown.is_none_or(|shown| shown.elapsed() >= LOOKS) {
            self.show()?;
        }
        Ok(())
    }

    /// Reports the progress.
    fn show(&mut self) -> Result<(), EvalError> {
        let (Some((live, cancel)), Some(subject)) = (&mut self.live, &self.subject) else { return Ok(()) };
        let is_over = live.moment().is_over();
        let values = live.outputs(&self.evaluator, if is_over { Wanted::ALL } else { subject.shown }, cancel)?;
        // outputs of a lost device are those of a new start
        let moment = live.moment();
        if moment.is_over() {
            live.keep(&self.evaluator, &values)?;
            (self.goes, self.steps) = (false, 0);
        }
        let values =
            subject.ports.iter().zip(values).filter_map(|(port, value)| Some((port.clone(), value?))).collect();
        let [nx, ny] = live.cells();
        let (warnings, on_device) = (live.warnings().to_vec(), live.is_on_device());
        let news = News::Live {
            node: subject.name.clone(),
            moment,
            held: self.held && !live.is_behind(),
            cells: nx.max(ny),
            values,
            warnings,
            on_device,
        };
        self.tell(news);
        self.shown = Some(Instant::now());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #[cfg(feature = "gpu")]
    use std::io::Write as _;
    use std::{path::PathBuf, sync::mpsc::Receiver};

    use orograph_graph::{Document, EvaluatorOptions, Value};
    #[cfg(feature = "gpu")]
    use orograph_nodes::gpu::{Adapters, Gpu, GpuOptions};

    use super::*;

    /// The longest wait for a report, on a busy machine; only a live run that hangs takes longer.
    const PATIENCE: Duration = Duration::from_secs(300);

    const STORM: &str = r#"(
        world: (size: 640, cells: 64, seed: 3),
        nodes: {
            "base":  Perlin(wavelength: 500, amplitude: 90),
            "storm": HydraulicPipe(height: "base", duration: 300, rain: 60, width: 60),
        },
        outputs: { "height": "storm" },
    )"#;

    /// The request to run `storm` in a document of this text.
    fn subject(text: &str) -> Box<Subject> {
        let document = Document::parse(text.to_owned(), &orograph_nodes::registry());
        let graph = document.graph().clone();
        let node = graph.find("storm").expect("exists");
        let outputs = graph.instance(node).node.outputs.iter();
        Box::new(Subject {
            name: "storm".to_owned(),
            ports: outputs.map(|output| format!("storm.{}", output.name)).collect(),
            shown: Wanted::NONE.with(1),
            node: LiveNode { graph, folder: PathBuf::new(), node, world: document.world() },
        })
    }

    /// A live run with these options, and its reports.
    fn run(options: EvaluatorOptions) -> (LiveRun, Receiver<News>) {
        let evaluator = Arc::new(Evaluator::new(options).expect("threads start"));
        let (outbox, news) = channel();
        (LiveRun::start(evaluator, outbox, Arc::new(|| {})).expect("a thread starts"), news)
    }

    /// A graph that cannot be followed replaces the one before: starting again does not run the old one.
    #[test]
    fn a_graph_that_cannot_be_followed_is_the_one_that_starts_again() {
        let (live, news) = run(EvaluatorOptions::default());
        live.ask(Ask::Run(subject(STORM)));
        let begun = news.recv_timeout(PATIENCE);
        assert!(matches!(begun, Ok(News::Live { .. })), "{begun:?}");
        for ask in [Ask::Run(subject(&STORM.replace("height: \"base\", ", ""))), Ask::Restart] {
            live.ask(ask);
            let failed = news.recv_timeout(PATIENCE);
            assert!(matches!(&failed, Ok(News::LiveFailed { node, .. }) if node == "storm"), "{failed:?}");
        }
    }

    /// What a live run has reported.
    #[cfg_attr(not(feature = "gpu"), expect(dead_code, reason = "only a test of devices reads all of it"))]
    struct Seen {
        moment: orograph_graph::Moment,
        values: Vec<(String, Value)>,
        warnings: Vec<String>,
        on_device: bool,
    }

    fn next(news: &Receiver<News>) -> Seen {
        match news.recv_timeout(PATIENCE).expect("it reports") {
            News::Live { moment, values, warnings, on_device, .. } => Seen { moment, values, warnings, on_device },
            other => panic!("no news of the live run: {other:?}"),
        }
    }

    /// A run with a pace lasts that long, reports on the way, and ends as one without.
    #[test]
    fn a_paced_run_lasts_as_long_as_asked() {
        let ends = |pace: Duration| {
            let (live, news) = run(EvaluatorOptions::default());
            live.ask(Ask::Run(subject(STORM)));
            live.ask(Ask::Pace(pace));
            live.ask(Ask::Go(true));
            let (begun, mut reports) = (Instant::now(), 0);
            loop {
                let seen = next(&news);
                if seen.moment.is_over() {
                    return (begun.elapsed(), reports, seen.values);
                }
                reports += 1;
            }
        };
        let (_, _, free) = ends(Duration::ZERO);
        let (lasted, reports, paced) = ends(Duration::from_secs(3));
        assert!(lasted >= Duration::from_millis(2700), "{lasted:?}");
        assert!(reports >= 10, "{reports} reports on the way");
        assert!(free == paced);
    }

    /// A device that is lost while the run goes on: pictures keep coming, and it ends as on the CPU alone. One that is
    /// lost during a pause: it comes back to the moment of the pause, and waits there.
    #[cfg(feature = "gpu")]
    #[test]
    fn a_lost_device_does_not_stop_a_live_run() {
        let adapters = Adapters::find();
        let Some(adapter) = adapters.best(false) else {
            assert!(std::env::var_os("OROGRAPH_ALL_TESTS").is_none(), "no graphics driver was found");
            // A message that libtest does not capture; one that cannot be written does not fail the test.
            let _ = writeln!(std::io::stderr(), "SKIPPED a lost device in a live run: no graphics driver was found");
            return;
        };
        let run = |gpu: Option<Arc<Gpu>>| {
            let (live, news) = run(gpu.map_or_else(EvaluatorOptions::default, |gpu| EvaluatorOptions {
                backend: gpu,
                ..EvaluatorOptions::default()
            }));
            live.ask(Ask::Run(subject(STORM)));
            (live, news)
        };
        let to_the_end = |news: &Receiver<News>| loop {
            let seen = next(news);
            if seen.moment.is_over() {
                return seen;
            }
        };
        let (alone, news) = run(None);
        alone.ask(Ask::Go(true));
        let cpu = to_the_end(&news);
        assert!(!cpu.on_device && cpu.values.len() == 7, "at the end all outputs");
        for is_paused in [false, true] {
            let gpu = Arc::new(Gpu::new(adapter, &GpuOptions::default()).expect("the driver works"));
            let (live, news) = run(Some(Arc::clone(&gpu)));
            let first = next(&news);
            assert!(first.on_device && first.warnings.is_empty(), "{:?}", first.warnings);
            assert_eq!(first.values.iter().map(|(port, _)| port.as_str()).collect::<Vec<_>>(), ["storm.water"]);
            live.ask(Ask::Steps(2));
            let mut now = 0.0;
            for _ in 0..2 {
                now = next(&news).moment.now;
            }
            assert!(now > 0.0);
            gpu.lose();
            live.ask(if is_paused { Ask::Steps(1) } else { Ask::Go(true) });
            let mut seen = next(&news);
            while seen.on_device || seen.moment.now < now {
                seen = next(&news);
            }
            assert!(!seen.on_device && seen.warnings.iter().any(|said| said.contains("computed on the CPU")));
            live.ask(Ask::Go(true));
            let end = if seen.moment.is_over() { seen } else { to_the_end(&news) };
            assert!(end.values == cpu.values, "as on the CPU alone");
        }
    }
}
