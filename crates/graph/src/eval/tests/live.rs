//! A process run step by step.

use std::path::PathBuf;

use super::*;
use crate::{Moment, Process, Stroke, Tool};

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

fn live(evaluator: &Evaluator, graph: Graph) -> Live {
    let node = graph.find("storm").expect("exists");
    Live::begin(evaluator, graph, PathBuf::new(), node, world(8), &Cancel::default(), &|_| {}).expect("begins")
}

fn follow(evaluator: &Evaluator, live: &mut Live, graph: Graph) -> bool {
    let node = graph.find("storm").expect("exists");
    live.follow(evaluator, graph, PathBuf::new(), node, world(8)).expect("no fault")
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
    let outputs = live.outputs(&here, &cancel).expect("there");
    let window = Window::whole(world(8));
    assert_eq!(outputs, run(&there, &graph(), &["storm"], window).expect("runs").values);
    assert_eq!(run(&here, &graph(), &["storm"], window).expect("runs").computed(), ["storm"]);
    let fresh = evaluator(2);
    live.keep(&fresh, &outputs).expect("kept");
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
    let seen = live.outputs(&evaluator, &cancel).expect("seen at once");
    assert!(follow(&evaluator, &mut live, with_strokes(&[time, 25.0])), "what is to come can be said");
    while !live.moment().is_over() {
        live.step(&evaluator, &cancel).expect("goes on");
    }
    assert!(!follow(&evaluator, &mut live, graph()), "it has happened");
    let outputs = live.outputs(&evaluator, &cancel).expect("there");
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
    let begun = Live::begin(&evaluator, graph(), PathBuf::new(), node, world(8), &Cancel::default(), &|_| {});
    assert!(begun.expect_err("no process").to_string().contains("step by step"));
}
