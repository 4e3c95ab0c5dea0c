//! Parallel kernels, cancellation and progress.

use std::{
    sync::atomic::{AtomicUsize, Ordering},
    time::Duration,
};

use super::*;

static MET: AtomicUsize = AtomicUsize::new(0);

/// Waits until two kernels of its kind run at once.
static MEETS: Node = Node {
    id: "Meets",
    outputs: HEIGHT,
    params: Params::specs,
    cpu: |job| {
        MET.fetch_add(1, Ordering::SeqCst);
        for _ in 0..2000 {
            if MET.load(Ordering::SeqCst) >= 2 {
                return height(job, |_, _| 1.0);
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Err(NodeError::failed("nobody came within ten seconds"))
    },
    ..Node::DEFAULT
};

/// Runs until it is cancelled, for at most a minute.
static ENDLESS: Node = Node {
    id: "Endless",
    outputs: HEIGHT,
    params: Params::specs,
    cpu: |job| {
        for i in 0..30_000 {
            job.advance(i as f32 / 30_000.0)?;
            std::thread::sleep(Duration::from_millis(2));
        }
        Err(NodeError::failed("nobody cancelled it"))
    },
    ..Node::DEFAULT
};

static HALF_DONE_RUNS: AtomicUsize = AtomicUsize::new(0);

/// Counts its runs and is half done until it is cancelled, for at most a minute.
static HALF_DONE: Node = Node {
    id: "HalfDone",
    outputs: HEIGHT,
    cpu: |job| {
        HALF_DONE_RUNS.fetch_add(1, Ordering::SeqCst);
        for _ in 0..30_000 {
            job.advance(0.5)?;
            std::thread::sleep(Duration::from_millis(2));
        }
        Err(NodeError::failed("nobody cancelled it"))
    },
    ..Node::DEFAULT
};

static TIMES: AtomicUsize = AtomicUsize::new(0);

/// Counts its runs and takes a while.
static TAKES_TIME: Node = Node {
    id: "TakesTime",
    outputs: HEIGHT,
    cpu: |job| {
        TIMES.fetch_add(1, Ordering::SeqCst);
        std::thread::sleep(Duration::from_millis(300));
        height(job, |i, _| i as f32)
    },
    ..Node::DEFAULT
};

static FAILS: Node = Node { id: "Fails", outputs: HEIGHT, cpu: |_| Err(NodeError::failed("no")), ..Node::DEFAULT };

/// Reports a thousand fractions at once.
static EAGER: Node = Node {
    id: "Eager",
    outputs: HEIGHT,
    cpu: |job| {
        for i in 0..1000 {
            job.advance(i as f32 / 1000.0)?;
        }
        height(job, |_, _| 0.0)
    },
    ..Node::DEFAULT
};

/// Offers three intermediate results before its final one.
static GROWS: Node = Node {
    id: "Grows",
    outputs: HEIGHT,
    cpu: |job| {
        for state in 1..=3 {
            job.glimpse(|| Outputs::one("height", Field::constant(job.window(), state as f32)));
        }
        height(job, |_, _| 9.0)
    },
    ..Node::DEFAULT
};

/// Warns twice with the same message.
static DOUBTS: Node = Node {
    id: "Doubts",
    outputs: HEIGHT,
    cpu: |job| {
        job.warn("cells are wide");
        job.warn("cells are wide");
        height(job, |_, _| 0.0)
    },
    ..Node::DEFAULT
};

fn pair(left: &'static Node, right: &'static Node) -> Graph {
    Build::default()
        .node("left", left, &[])
        .node("right", right, &[])
        .node("both", &ADD, &[("height", "left"), ("other", "right")])
        .0
}

#[test]
fn independent_nodes_run_in_parallel() {
    let graph = Build(pair(&MEETS, &MEETS)).set("right", "level", ParamValue::Float(1.0)).0;
    assert!(run(&evaluator(2), &graph, &["both"], Window::whole(world(4))).is_ok());
}

/// Two equal nodes are computed once, in a store that keeps nothing: neither waits for the other.
#[test]
fn equal_nodes_are_computed_once() {
    static RUNS: AtomicUsize = AtomicUsize::new(0);
    static COUNTED: Node = Node {
        id: "Counted",
        outputs: HEIGHT,
        cpu: |job| {
            RUNS.fetch_add(1, Ordering::SeqCst);
            std::thread::sleep(Duration::from_millis(50));
            height(job, |i, _| i as f32)
        },
        ..Node::DEFAULT
    };
    let graph = Build(pair(&COUNTED, &COUNTED)).node("after", &ADD, &[("height", "right")]).0;
    for threads in [1, 2, 4] {
        RUNS.store(0, Ordering::SeqCst);
        let options = EvaluatorOptions { threads: NonZero::new(threads), ..keeping(0, None) };
        let evaluator = Evaluator::new(options).expect("an evaluator");
        let outcome = run(&evaluator, &graph, &["both", "after", "right"], Window::whole(world(4))).expect("runs");
        assert_eq!(RUNS.load(Ordering::SeqCst), 1, "{threads} threads");
        assert_eq!(outcome.computed(), ["after", "both", "left"]);
        assert_eq!(outcome.from(Origin::Memory), ["right"], "the other has its result");
        let at = |value: &Value| value.as_field().expect("a field").plane(0)[3];
        assert_eq!(outcome.values.iter().map(at).collect::<Vec<_>>(), [6.0, 4.0, 3.0]);
    }
}

/// An error after the first bands of a request is its answer: nobody takes the bands for the whole.
#[test]
fn an_error_in_a_later_band_is_delivered() {
    static FAILS_BELOW: Node = Node {
        id: "FailsBelow",
        outputs: HEIGHT,
        cpu: |job| match job.window().origin[1] {
            0 => height(job, |_, _| 1.0),
            _ => Err(NodeError::failed("no")),
        },
        ..Node::DEFAULT
    };
    let graph = Build::default().node("one", &FAILS_BELOW, &[]).0;
    let window = Window::whole(world(8));
    let requests = [Request { port: graph.port("one").expect("exists"), window }];
    let evaluation = Evaluation { graph: &graph, folder: Path::new(""), requests: &requests, byproducts: &[] };
    let answers = Mutex::new(Vec::new());
    let deliver = |_, delivery: Delivery| answers.lock().expect("no panic").push(delivery.is_ok());
    evaluator(1).build_in_stages(&evaluation, &window, &[true], 16, &Cancel::default(), &|_| {}, &deliver);
    assert_eq!(answers.into_inner().expect("no panic"), [true, false]);
}

/// Two kernels that do not end before they are cancelled, one of them while the other still runs.
#[test]
fn a_cancellation_ends_kernels_in_their_middle() {
    let graph = pair(&ENDLESS, &WAVES);
    let cancel = Cancel::default();
    let events = |event: Event| {
        if matches!(event, Event::NodeProgress { fraction, .. } if fraction > 0.0) {
            cancel.cancel();
        }
    };
    let requests = [(graph.port("both").expect("exists"), Window::whole(world(16)))];
    let result = evaluate(&evaluator(2), &graph, &requests, &cancel, &events);
    assert_eq!(result.err(), Some(EvalError::Cancelled));
}

/// Counts to a second, unless it is cancelled.
static SLOW: Node = Node {
    id: "Slow",
    outputs: HEIGHT,
    cpu: |job| {
        for _ in 0..100 {
            job.check()?;
            std::thread::sleep(Duration::from_millis(2));
        }
        height(job, |_, _| 5.0)
    },
    ..Node::DEFAULT
};

#[test]
fn a_failure_leaves_the_other_requests_alone() {
    let graph = Build(pair(&SLOW, &FAILS)).node("after", &ADD, &[("height", "left")]).0;
    let window = Window::whole(world(4));
    let request = |end: &str| Request { port: graph.port(end).expect("exists"), window };
    let outside = Request { window: Window { cells: [9, 9], ..window }, ..request("left") };
    let requests = [request("both"), request("after"), outside, request("right")];
    let evaluation = Evaluation { graph: &graph, folder: Path::new(""), requests: &requests, byproducts: &[] };
    for threads in [1, 2] {
        let answers = evaluator(threads).evaluate(&evaluation, &Cancel::default(), &|_| {});
        let failed =
            |answer: &Result<Value, EvalError>| matches!(answer, Err(EvalError::Node { node, .. }) if node == "right");
        assert!(failed(&answers[0]) && failed(&answers[3]), "{answers:?}");
        assert_eq!(answers[1].as_ref().ok().and_then(Value::as_field).and_then(|f| f.range(0)), Some((6.0, 6.0)));
        assert!(matches!(answers[2], Err(EvalError::Request(_))));
    }
}

#[test]
fn what_is_ready_is_delivered_before_the_rest_and_released() {
    let graph = pair(&SLOW, &WAVES);
    let window = Window::whole(world(64));
    let requests = ["right", "both"].map(|end| Request { port: graph.port(end).expect("exists"), window });
    let evaluation = Evaluation { graph: &graph, folder: Path::new(""), requests: &requests, byproducts: &[] };
    let told = Mutex::new(Vec::new());
    let note = |what: String| told.lock().expect("no panic").push(what);
    let events = |event: Event| {
        if let Event::NodeFinished { name, .. } = event {
            note(format!("finished {name}"));
        }
    };
    evaluator(2).deliver(&evaluation, &Cancel::default(), &events, &|request, delivery| {
        assert!(delivery.is_ok());
        note(format!("delivered {request}"));
    });
    let told = told.into_inner().expect("no panic");
    let place = |what: &str| told.iter().position(|told| told == what).expect("happened");
    assert!(place("delivered 0") < place("finished left"), "{told:?}");
    assert!(place("finished both") < place("delivered 1"), "{told:?}");
}

#[test]
fn a_cancellation_before_the_start_runs_nothing() {
    let cancel = Cancel::default();
    cancel.cancel();
    let graph = pair(&WAVES, &WAVES);
    let requests = [(graph.port("both").expect("exists"), Window::whole(world(16)))];
    let started = AtomicUsize::new(0);
    let events = |event: Event| {
        if matches!(event, Event::NodeStarted { .. }) {
            started.fetch_add(1, Ordering::Relaxed);
        }
    };
    let result = evaluate(&evaluator(2), &graph, &requests, &cancel, &events);
    assert_eq!((result.err(), started.into_inner()), (Some(EvalError::Cancelled), 0));
}

#[test]
fn progress_rises_and_is_reported_sparingly() {
    let graph = Build::default().node("eager", &EAGER, &[]).0;
    let fractions = Mutex::new(Vec::new());
    let start = event::now();
    let events = |event: Event| {
        if let Event::NodeProgress { fraction, .. } = event {
            fractions.lock().expect("no panic").push(fraction);
        }
    };
    let requests = [(graph.port("eager").expect("exists"), Window::whole(world(4)))];
    evaluate(&evaluator(1), &graph, &requests, &Cancel::default(), &events).expect("runs");
    let fractions = fractions.into_inner().expect("no panic");
    assert!(fractions.is_sorted() && !fractions.is_empty());
    // one at once, then one every 50 ms
    assert!(fractions.len() as u128 <= 1 + start.elapsed().as_millis() / 50, "{}", fractions.len());
}

#[test]
fn a_progressive_preview_shows_terrain_grow() {
    let graph = Build::default().node("land", &GROWS, &[]).0;
    let requests = [(graph.port("land").expect("exists"), Window::whole(world(4)))];
    let seen = |glimpses: Option<Duration>| {
        let seen = Mutex::new(Vec::new());
        let events = |event: Event| {
            if let Event::NodeGlimpse { values, .. } = event {
                let heights = values.iter().map(|(output, value)| {
                    assert_eq!(*output, 0);
                    value.as_field().and_then(|field| field.range(0))
                });
                seen.lock().expect("no panic").extend(heights);
            }
        };
        let evaluator = with(EvaluatorOptions { glimpses, ..EvaluatorOptions::default() });
        let values = evaluate(&evaluator, &graph, &requests, &Cancel::default(), &events).expect("runs");
        assert_eq!(values[0].as_field().and_then(|field| field.range(0)), Some((9.0, 9.0)));
        seen.into_inner().expect("no panic")
    };
    assert_eq!(seen(Some(Duration::ZERO)), [1.0, 2.0, 3.0].map(|height| Some((height, height))));
    assert_eq!(seen(Some(Duration::from_secs(3600))), []);
    assert_eq!(seen(None), []);
}

#[test]
fn a_warning_is_reported_once_per_evaluation_also_from_the_store() {
    let graph = Build::default().node("land", &DOUBTS, &[]).0;
    let evaluator = evaluator(1);
    let told = || {
        let warnings = Mutex::new(Vec::new());
        let events = |event: Event| {
            if let Event::Warning { name, message, .. } = event {
                warnings.lock().expect("no panic").push(format!("{name}: {message}"));
            }
        };
        let requests = [(graph.port("land").expect("exists"), Window::whole(world(4)))];
        evaluate(&evaluator, &graph, &requests, &Cancel::default(), &events).expect("runs");
        warnings.into_inner().expect("no panic")
    };
    assert_eq!(told(), ["land: cells are wide"]);
    assert_eq!(told(), ["land: cells are wide"], "from memory");
}

#[test]
fn evaluations_of_several_threads_share_an_evaluator() {
    let evaluator = evaluator(2);
    let graph = pair(&WAVES, &WAVES);
    let window = Window::whole(world(32));
    let values: Vec<Value> = std::thread::scope(|scope| {
        let all: Vec<_> = (0..4)
            .map(|_| scope.spawn(|| run(&evaluator, &graph, &["both"], window).expect("runs").values.remove(0)))
            .collect();
        all.into_iter().map(|one| one.join().expect("no panic")).collect()
    });
    assert!(values.windows(2).all(|pair| pair[0] == pair[1]));
}

/// Evaluators on one store, as of a viewport and of an export: the second waits for the kernel of the first, and goes
/// on by itself when the first is cancelled.
#[test]
fn evaluations_at_the_same_time_run_a_kernel_once() {
    let store = Arc::new(Store::new(1 << 20, None));
    let both = || [0; 2].map(|_| with(EvaluatorOptions { store: Arc::clone(&store), ..EvaluatorOptions::default() }));
    let graph = Build::default().node("slow", &TAKES_TIME, &[]).node("sum", &ADD, &[("height", "slow")]).0;
    let window = Window::whole(world(8));
    let values: Vec<Vec<Value>> = std::thread::scope(|scope| {
        let threads = both().map(|evaluator| {
            let graph = &graph;
            scope.spawn(move || run(&evaluator, graph, &["sum"], window).expect("a result").values)
        });
        threads.into_iter().map(|thread| thread.join().expect("no panic")).collect()
    });
    assert_eq!((TIMES.load(Ordering::SeqCst), &values[0]), (1, &values[1]));

    let graph = Build::default().node("half", &HALF_DONE, &[]).0;
    let [first, second] = both();
    let cancel = Cancel::default();
    // what each evaluation reports of the kernel: starts, then progress in tenths
    let reports = [0; 2].map(|_| [const { AtomicUsize::new(0) }; 2]);
    let run = |evaluator: Evaluator, number: usize, cancel: Cancel| {
        let port = graph.port("half").expect("exists");
        let [starts, tenths]: &[AtomicUsize; 2] = &reports[number];
        let heard = |event: Event| match event {
            Event::NodeStarted { .. } => _ = starts.fetch_add(1, Ordering::SeqCst),
            Event::NodeProgress { fraction, .. } => tenths.store((10.0 * fraction) as usize, Ordering::SeqCst),
            _ => {}
        };
        evaluate(&evaluator, &graph, &[(port, window)], &cancel, &heard).expect_err("cancelled")
    };
    let run = &run;
    let wait_for = |number: usize, wanted: [usize; 2]| {
        while [0, 1].map(|what| reports[number][what].load(Ordering::SeqCst)) != wanted {
            std::thread::sleep(Duration::from_millis(5));
        }
    };
    std::thread::scope(|scope| {
        let first = scope.spawn({
            let cancel = cancel.clone();
            move || run(first, 0, cancel)
        });
        wait_for(0, [1, 5]);
        let later = Cancel::default();
        let second = scope.spawn({
            let later = later.clone();
            move || run(second, 1, later)
        });
        // the second waits, and reports the progress of the first
        wait_for(1, [1, 5]);
        assert_eq!(HALF_DONE_RUNS.load(Ordering::SeqCst), 1);
        cancel.cancel();
        wait_for(1, [2, 5]);
        assert_eq!(HALF_DONE_RUNS.load(Ordering::SeqCst), 2);
        later.cancel();
        for thread in [first, second] {
            assert_eq!(thread.join().expect("no panic"), EvalError::Cancelled);
        }
    });
}
