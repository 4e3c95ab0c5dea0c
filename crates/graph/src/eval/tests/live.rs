//! A process run step by step.

use std::{
    path::PathBuf,
    sync::atomic::{AtomicI64, Ordering},
};

use super::*;
use crate::{Cpu, Moment, Process, Stroke, Tool, Wanted};

mod storm {
    use crate::{TimedStrokes, params};

    params! {
        /// Number of its steps.
        steps: i64 = 4, Count, 0..=100;
        /// Strokes on the way.
        strokes: TimedStrokes = TimedStrokes(Vec::new()), Metres, -1e6..=1e6;
    }
}

/// Adds 1 m in each step of 10 s, and the strokes of that time.
struct Storm {
    params: storm::Params,
    done: i64,
    gained: f32,
}

impl Storm {
    fn due(&self, from: f64) -> f32 {
        let strokes =
            self.params.strokes.0.iter().filter(|stroke| from < stroke.time && stroke.time <= self.moment().now);
        strokes.map(|stroke| stroke.strength as f32).sum()
    }
}

impl Process for Storm {
    fn moment(&self) -> Moment {
        let time = |steps: i64| 10.0 * steps as f64;
        Moment {
            now: time(self.done),
            since: (self.done > 0).then(|| time(self.done - 1)),
            end: time(self.params.steps),
        }
    }

    fn step(&mut self, job: &Job<'_>) -> Result<(), NodeError> {
        job.check()?;
        self.gained += 1.0 + self.due(self.moment().since.unwrap_or(-1.0));
        self.done += 1;
        assert!(self.gained < 1e4, "overflow");
        Ok(())
    }

    fn outputs(&self, job: &Job<'_>) -> Result<Outputs, NodeError> {
        let (land, gained) = (
            crate::InputReader::new(job).required::<Field>("height")?.samples(),
            self.gained + self.due(self.moment().since.unwrap_or(-1.0)),
        );
        let nx = job.window().nx();
        height(job, |i, j| land[j * nx + i] + gained)
    }

    fn take(&mut self, params: &ParamValues) -> bool {
        let params = storm::Params::read(params);
        let past = |params: &storm::Params| -> Vec<Stroke> {
            let all = params.strokes.0.iter().cloned();
            all.filter(|stroke| self.moment().since.is_some_and(|since| stroke.time <= since)).collect()
        };
        let fits = params.steps == self.params.steps && past(&params) == past(&self.params);
        if fits {
            self.params = params;
        }
        fits
    }
}

fn begin(job: &Job<'_>) -> Result<Box<dyn Process>, NodeError> {
    Ok(Box::new(Storm { params: storm::Params::read(job.params), done: 0, gained: 0.0 }))
}

static STORM: Node = Node {
    id: "Storm",
    inputs: ONE,
    outputs: HEIGHT,
    params: storm::Params::specs,
    reach: Reach::World,
    cpu: |job| {
        let mut storm = begin(job)?;
        while !storm.moment().is_over() {
            storm.step(job)?;
        }
        storm.outputs(job)
    },
    process: Some(begin),
    ..Node::DEFAULT
};

fn graph() -> Graph {
    Build::default().node("land", &WAVES, &[]).node("storm", &STORM, &[("height", "land")]).0
}

fn with_strokes(times: &[f64]) -> Graph {
    let stroke = |time: &f64| Stroke {
        tool: Tool::Raise,
        radius: 1.0,
        strength: 100.0 + time,
        hardness: 0.5,
        time: *time,
        points: vec![[0.0, 0.0]],
    };
    let mut graph = graph();
    set(&mut graph, "storm", "strokes", ParamValue::Strokes(times.iter().map(stroke).collect()));
    graph
}

fn storm_of(graph: Graph) -> LiveNode {
    LiveNode { node: graph.find("storm").expect("exists"), graph, folder: PathBuf::new(), world: world(8) }
}

fn live(evaluator: &Evaluator, graph: Graph) -> Live {
    Live::begin(evaluator, storm_of(graph), &Cancel::default(), &|_| {}).expect("begins")
}

fn outputs(live: &mut Live, evaluator: &Evaluator) -> Result<Vec<Value>, EvalError> {
    let outputs = live.outputs(evaluator, Wanted::ALL, &Cancel::default())?;
    Ok(outputs.into_iter().flatten().collect())
}

fn follow(evaluator: &Evaluator, live: &mut Live, graph: Graph) -> bool {
    live.follow(evaluator, storm_of(graph), &Cancel::default()).expect("no fault")
}

#[test]
fn its_end_equals_an_evaluation_and_is_not_computed_again() {
    let (here, there) = (evaluator(2), evaluator(2));
    let cancel = Cancel::default();
    let mut live = live(&here, graph());
    let mut steps = 0;
    while !live.moment().is_over() {
        live.step(&here, &cancel).expect("goes on");
        steps += 1;
    }
    assert_eq!((steps, live.moment().now), (4, 40.0));
    live.step(&here, &cancel).expect("stays");
    let outputs = outputs(&mut live, &here).expect("there");
    let window = Window::whole(world(8));
    assert_eq!(outputs, run(&there, &graph(), &["storm"], window).expect("runs").values);
    assert_eq!(run(&here, &graph(), &["storm"], window).expect("runs").computed(), ["storm"]);
    let fresh = evaluator(2);
    live.keep(&fresh, &outputs.iter().cloned().map(Some).collect::<Vec<_>>()).expect("kept");
    assert_eq!(run(&fresh, &graph(), &["storm"], window).expect("found").computed(), [""; 0]);
}

#[test]
fn strokes_on_the_way_equal_a_run_from_the_start() {
    let evaluator = evaluator(1);
    let cancel = Cancel::default();
    let mut live = live(&evaluator, graph());
    for _ in 0..2 {
        live.step(&evaluator, &cancel).expect("goes on");
    }
    let time = live.moment().time();
    assert_eq!(time, 20.0);
    assert!(!follow(&evaluator, &mut live, with_strokes(&[10.0])), "that time has passed");
    assert!(follow(&evaluator, &mut live, with_strokes(&[time])));
    let seen = outputs(&mut live, &evaluator).expect("seen at once");
    assert!(follow(&evaluator, &mut live, with_strokes(&[time, 25.0])), "what is to come can be said");
    while !live.moment().is_over() {
        live.step(&evaluator, &cancel).expect("goes on");
    }
    assert!(!follow(&evaluator, &mut live, graph()), "it has happened");
    let outputs = outputs(&mut live, &evaluator).expect("there");
    assert_ne!(seen, outputs);
    let window = Window::whole(world(8));
    assert_eq!(outputs, run(&evaluator, &with_strokes(&[time, 25.0]), &["storm"], window).expect("runs").values);
    let mut other = with_strokes(&[time, 25.0]);
    set(&mut other, "land", "level", ParamValue::Float(3.0));
    assert!(!follow(&evaluator, &mut live, other), "the land is another");
}

#[test]
fn faults_name_the_node() {
    let evaluator = evaluator(1);
    let cancel = Cancel::default();
    let mut heavy = with_strokes(&[0.0]);
    let ParamValue::Strokes(mut strokes) =
        heavy.instance(heavy.find("storm").expect("exists")).params.get("strokes").expect("declared").clone()
    else {
        panic!("strokes")
    };
    strokes[0].strength = 1e4;
    set(&mut heavy, "storm", "strokes", ParamValue::Strokes(strokes));
    let mut live = live(&evaluator, heavy);
    let fault = live.step(&evaluator, &cancel).expect_err("it panics");
    assert!(fault.to_string().contains("storm") && fault.to_string().contains("overflow"), "{fault}");
    cancel.cancel();
    let mut live = self::live(&evaluator, graph());
    assert_eq!(live.step(&evaluator, &cancel), Err(EvalError::Cancelled));
    let node = graph().find("land").expect("exists");
    let begun = Live::begin(&evaluator, LiveNode { node, ..storm_of(graph()) }, &Cancel::default(), &|_| {});
    assert!(begun.expect_err("no process").to_string().contains("step by step"));
}

/// A device that runs storms. It fails after so many steps, and is then lost if that is so.
struct Device {
    steps: AtomicI64,
    is_lost: bool,
}

impl Device {
    fn new(steps: i64, is_lost: bool) -> Arc<Self> {
        Arc::new(Self { steps: AtomicI64::new(steps), is_lost })
    }
}

impl Backend for Device {
    fn name(&self) -> &'static str {
        "device"
    }

    fn supports(&self, node: &Node, _: &ParamValues) -> bool {
        node.id == STORM.id && !(self.is_lost && self.steps.load(Ordering::Relaxed) <= 0)
    }

    fn run(&self, _: &Node, _: &Job<'_>) -> Result<Option<Outputs>, NodeError> {
        Ok(None)
    }

    fn begin(self: Arc<Self>, node: &Node, job: &Job<'_>) -> Result<Option<Box<dyn Process>>, NodeError> {
        let device = Arc::clone(&self);
        Ok(Arc::new(Cpu).begin(node, job)?.map(|storm| Box::new(Failing { storm, device }) as Box<dyn Process>))
    }
}

struct Failing {
    storm: Box<dyn Process>,
    device: Arc<Device>,
}

impl Process for Failing {
    fn moment(&self) -> Moment {
        self.storm.moment()
    }

    fn step(&mut self, job: &Job<'_>) -> Result<(), NodeError> {
        if self.device.steps.fetch_sub(1, Ordering::Relaxed) <= 0 {
            job.warn("the device failed".to_owned());
            return Err(NodeError::failed("gone"));
        }
        self.storm.step(job)
    }

    fn outputs(&self, job: &Job<'_>) -> Result<Outputs, NodeError> {
        self.storm.outputs(job)
    }

    fn take(&mut self, params: &ParamValues) -> bool {
        self.storm.take(params)
    }

    fn has_lost_device(&self) -> bool {
        self.device.steps.load(Ordering::Relaxed) < 0
    }
}

/// A device that fails in the third step, for this process alone or for good: the CPU starts again, with the stroke
/// that was painted, and catches up; its end is that of an evaluation, and is kept.
#[test]
fn the_cpu_takes_over_from_a_device_that_fails() {
    let cancel = Cancel::default();
    for is_lost in [false, true] {
        let evaluator = with(EvaluatorOptions { backend: Device::new(2, is_lost), ..EvaluatorOptions::default() });
        let mut live = live(&evaluator, graph());
        let step = |live: &mut Live| live.step(&evaluator, &cancel).expect("goes on");
        step(&mut live);
        assert!(follow(&evaluator, &mut live, with_strokes(&[10.0])));
        step(&mut live);
        assert!((live.moment().now, live.is_behind(), live.warnings().len()) == (20.0, false, 0));
        step(&mut live);
        assert_eq!((live.moment().now, live.is_behind()), (0.0, true));
        assert_eq!(live.warnings(), ["the device failed"]);
        step(&mut live);
        assert!(live.is_behind());
        step(&mut live);
        assert!(!live.is_behind(), "at the time at which the device failed");
        assert!(follow(&evaluator, &mut live, with_strokes(&[10.0, 25.0])), "it goes on as before");
        while !live.moment().is_over() {
            step(&mut live);
        }
        let values = live.outputs(&evaluator, Wanted::ALL, &cancel).expect("there");
        live.keep(&evaluator, &values).expect("kept");
        let window = Window::whole(world(8));
        let found = run(&evaluator, &with_strokes(&[10.0, 25.0]), &["storm"], window).expect("found");
        assert_eq!(found.computed(), [""; 0]);
        let cpu = run(&self::evaluator(1), &with_strokes(&[10.0, 25.0]), &["storm"], window).expect("runs");
        assert_eq!((found.values, values.len()), (cpu.values, 1));
    }
}

/// A device that is lost while the run is paused, which the next change of the graph finds.
#[test]
fn a_paused_run_catches_up_after_a_lost_device() {
    let cancel = Cancel::default();
    let device = Device::new(2, true);
    let options = EvaluatorOptions { backend: Arc::clone(&device) as Arc<dyn Backend>, ..EvaluatorOptions::default() };
    let evaluator = with(options);
    let mut live = live(&evaluator, graph());
    for _ in 0..2 {
        live.step(&evaluator, &cancel).expect("goes on");
    }
    assert!(follow(&evaluator, &mut live, with_strokes(&[15.0])), "no restart");
    assert!(live.is_behind());
    while live.is_behind() {
        live.step(&evaluator, &cancel).expect("goes on");
    }
    assert_eq!(live.moment().now, 20.0);
}

/// The results of the CPU are not kept as those of a device that runs the kernel, but not the process.
#[test]
fn results_are_kept_only_as_those_of_the_backend_that_gave_them() {
    struct Batch;
    impl Backend for Batch {
        fn name(&self) -> &'static str {
            "batch"
        }

        fn supports(&self, node: &Node, _: &ParamValues) -> bool {
            node.id == STORM.id
        }

        fn run(&self, node: &Node, job: &Job<'_>) -> Result<Option<Outputs>, NodeError> {
            (node.cpu)(job).map(Some)
        }

        fn begin(self: Arc<Self>, _: &Node, _: &Job<'_>) -> Result<Option<Box<dyn Process>>, NodeError> {
            Ok(None)
        }
    }
    let cancel = Cancel::default();
    let evaluator = with(EvaluatorOptions { backend: Arc::new(Batch), ..EvaluatorOptions::default() });
    let mut live = live(&evaluator, graph());
    while !live.moment().is_over() {
        live.step(&evaluator, &cancel).expect("goes on");
    }
    let values = live.outputs(&evaluator, Wanted::ALL, &cancel).expect("there");
    live.keep(&evaluator, &values).expect("no fault");
    let found = run(&evaluator, &graph(), &["storm"], Window::whole(world(8))).expect("runs");
    assert_eq!(found.computed(), ["storm"]);
}
