//! Nodes that run on levels: each level is planned, stored and reused by itself, and reported as a part of one run.

use std::{collections::BTreeSet, fs, path::PathBuf, time::Duration};

use super::*;
use crate::{Below, Coarser, Levels, State};

/// Cells a side of the coarsest level.
const COARSEST: u32 = 8;

/// What a kernel was asked for: its seed, which differs between the tests, its cells and whether it gave outputs and a
/// state.
type Call = (u32, u32, bool, bool);

static CALLS: Mutex<Vec<Call>> = Mutex::new(Vec::new());

/// The kernels that ran since the last time, in order.
fn calls(seed: u32) -> Vec<(u32, bool, bool)> {
    let mut all = CALLS.lock().expect("no panic");
    let own = all.iter().filter(|call| call.0 == seed).map(|&(_, cells, outputs, state)| (cells, outputs, state));
    let own = own.collect();
    all.retain(|call| call.0 != seed);
    own
}

fn below(world: &World) -> Option<Below> {
    let cells = world.cells[0];
    let level = |cells: u32| World { cells: [cells; 2], ..*world };
    match cells {
        ..COARSEST => Some(Below::Results(level(COARSEST))),
        COARSEST => Some(Below::Results(level(2 * COARSEST))),
        _ => Some(Below::State(level(((cells - 1) / COARSEST + 1).next_power_of_two() / 2 * COARSEST))),
    }
}

/// On each level its input, and the quarter of what the level below left; warns of its cells.
static LEVELLED: Node = Node {
    id: "Levelled",
    inputs: ONE,
    outputs: &[HEIGHT[0], Output::gives("double", PortType::Height, "D.")],
    params: Params::specs,
    reach: Reach::World,
    levels: Some(Levels {
        below: |_, world| below(world),
        state: |sizing| {
            let is_level = sizing.window.cells[0].is_multiple_of(COARSEST)
                && (sizing.window.cells[0] / COARSEST).is_power_of_two();
            if is_level { sizing.cells(4.0) } else { 0 }
        },
        work: |_, world| f64::from(world.cells[0]),
    }),
    cpu: |job| {
        let seed = Params::read(job.params).seed.0;
        let (cells, wants) = (job.window().cells[0], [0, 1].map(|output| job.wanted.contains(output)));
        CALLS.lock().expect("no panic").push((seed, cells, wants.contains(&true), job.level.gives_state));
        let side = cells as usize;
        if let Coarser::Results(outputs) = &job.level.below {
            let mut outputs = outputs.clone();
            let mut given = Outputs::default();
            for name in ["height", "double"] {
                let Some(Value::Field(field)) = outputs.take(name) else { continue };
                let by = field.window().nx() / side;
                let at = |cell: usize| field.samples()[(cell / side * field.window().nx() + cell % side) * by];
                given = given.with(name, Field::new(job.window(), (0..side * side).map(at).collect()));
            }
            return Ok(given);
        }
        job.warn(format!("on {cells} cells"));
        job.advance(0.5)?;
        let input = crate::InputReader::new(job).required::<Field>("height")?.samples();
        let land: Vec<f32> = match &job.level.below {
            Coarser::State(state) => {
                let coarse = (state.rasters[0].len() as f64).sqrt() as usize;
                let under =
                    |cell: usize| state.rasters[0][cell / side * coarse / side * coarse + cell % side * coarse / side];
                (0..side * side).map(|cell| input[cell] + 0.25 * under(cell)).collect()
            }
            _ => input.to_vec(),
        };
        let mut given = Outputs::default();
        for ((output, factor), wanted) in [("height", 1.0), ("double", 2.0)].into_iter().zip(wants) {
            if wanted {
                let samples = land.iter().map(|v| v * factor).collect();
                given = given.with(output, Field::new(job.window(), samples));
            }
        }
        let state = job.level.gives_state.then(|| State { rasters: vec![land], numbers: vec![f64::from(cells)] });
        Ok(given.with_state(state))
    },
    ..Node::DEFAULT
};

fn graph(seed: u32) -> Graph {
    Build::default()
        .node("base", &WAVES, &[])
        .node("levels", &LEVELLED, &[("height", "base")])
        .set("levels", "seed", ParamValue::Seed(seed))
        .0
}

fn on(cells: u32) -> Window {
    Window::whole(World { cells: [cells; 2], ..world(64) })
}

#[test]
fn finer_cells_pass_the_last_level_only() {
    let (graph, evaluator) = (graph(1), evaluator(2));
    run(&evaluator, &graph, &["levels"], on(32)).expect("runs");
    assert_eq!(calls(1), [(8, false, true), (16, false, true), (32, true, true)]);
    run(&evaluator, &graph, &["levels"], on(64)).expect("runs");
    assert_eq!(calls(1), [(64, true, true)]);
    // between two levels, and with another output
    run(&evaluator, &graph, &["levels.double"], on(50)).expect("runs");
    assert_eq!(calls(1), [(50, true, false)]);
    // a level that is requested by itself runs from its own beginning, below which all is there
    run(&evaluator, &graph, &["levels"], on(16)).expect("runs");
    assert_eq!(calls(1), [(16, true, false)]);
    run(&evaluator, &graph, &["levels"], on(16)).expect("runs");
    assert_eq!(calls(1), []);
}

#[test]
fn a_preview_is_a_level_of_the_same_run() {
    let graph = graph(2);
    let port = graph.port("levels").expect("exists");
    for (preview, expected) in [
        (16, vec![(8, false, true), (16, true, true), (32, true, true)]),
        // the results of the coarsest are those of the next one, which goes on from its state
        (8, vec![(8, false, true), (16, true, true), (8, true, false), (32, true, true)]),
        (4, vec![(8, false, true), (16, true, true), (8, true, false), (4, true, false), (32, true, true)]),
    ] {
        let got = run_requests(&evaluator(1), &graph, &[(port, on(preview)), (port, on(32))]).expect("runs");
        assert_eq!(calls(2), expected);
        for (value, cells) in got.values.iter().zip([preview, 32]) {
            assert_eq!(*value, run(&evaluator(1), &graph, &["levels"], on(cells)).expect("runs").values[0]);
        }
        calls(2);
    }
}

#[test]
fn a_chain_shares_the_levels_of_what_it_reads() {
    let chain =
        Build(graph(7)).node("second", &LEVELLED, &[("height", "levels")]).set("second", "seed", ParamValue::Seed(7));
    let evaluator = evaluator(2);
    run(&evaluator, &chain.0, &["second"], on(32)).expect("runs");
    // the first node gives its outputs on each level, the second only on the last
    let first = [(8, false, true), (16, true, true), (8, true, false), (32, true, true)];
    let second = [(8, false, true), (16, false, true), (32, true, true)];
    let sorted = |mut calls: Vec<(u32, bool, bool)>| {
        calls.sort_unstable();
        calls
    };
    assert_eq!(sorted(calls(7)), sorted([&first[..], &second[..]].concat()));
    let got = run(&evaluator, &chain.0, &["second"], on(64)).expect("runs");
    assert_eq!(calls(7), [(64, true, true); 2]);
    assert_eq!(got.values, run(&self::evaluator(1), &chain.0, &["second"], on(64)).expect("runs").values);

    // results on the coarsest level are taken from the next, on which the second node reads what the first gives there
    let [coarsest, next] = [8, 16].map(|cells| {
        let values = run(&self::evaluator(1), &chain.0, &["second"], on(cells)).expect("runs").values;
        values[0].as_field().expect("a field").samples().to_vec()
    });
    let every_second: Vec<f32> = (0..64).map(|cell| next[cell / 8 * 2 * 16 + cell % 8 * 2]).collect();
    assert_eq!(coarsest, every_second);
}

#[test]
fn results_do_not_depend_on_what_is_stored() {
    let graph = graph(3);
    let ends = ["levels", "levels.double"];
    let expected = run(&evaluator(1), &graph, &ends, on(64)).expect("runs").values;
    let expected_off = run(&evaluator(1), &graph, &ends, on(40)).expect("runs").values;
    // stores of all sizes, of which most evict the states of some levels
    for budget in (0..40).map(|at| at * 1500) {
        let evaluator = with(keeping(budget, None));
        for cells in [8, 32, 16, 4, 64, 40] {
            let got = run(&evaluator, &graph, &ends, on(cells)).expect("runs").values;
            assert!(cells != 64 || got == expected, "{budget}");
            assert!(cells != 40 || got == expected_off, "{budget}");
        }
    }
    // with too little memory for states that nobody reads, they are not kept
    let least = |limit| EvaluatorOptions { memory_limit: Some(limit), ..EvaluatorOptions::default() };
    let enough = (0..200).map(|at| at * 1000).find(|limit| {
        let got = run(&with(least(*limit)), &graph, &ends[..1], on(64));
        got.is_ok_and(|got| got.values[0] == expected[0])
    });
    // the input, the output and the state of the level below, and of no other
    assert_eq!(enough, Some(37_000));
    calls(3);
    run(&with(least(enough.expect("a limit"))), &graph, &ends[..1], on(64)).expect("runs");
    assert_eq!(calls(3).last(), Some(&(64, true, false)));
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = |folder: &Path| fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    entries(folder).filter(|path| path.is_dir()).flat_map(|shard| entries(&shard).collect::<Vec<_>>()).collect()
}

#[test]
fn states_are_read_from_disk_and_damaged_ones_are_made_again() {
    let graph = graph(4);
    let expected = run(&evaluator(1), &graph, &["levels"], on(32)).expect("runs").values;
    calls(4);
    // nothing, one byte, half of the file
    for damage in 0..4 {
        let folder = tempfile::tempdir().expect("a folder");
        let place =
            StoreFolder { folder: folder.path().to_owned(), budget: 1 << 30, worth: Duration::ZERO, trust: Trust::Own };
        let fresh = || with(keeping(0, Some(place.clone())));
        run(&fresh(), &graph, &["levels"], on(16)).expect("runs");
        assert_eq!(calls(4).len(), 2);
        for path in files(folder.path()) {
            let mut bytes = fs::read(&path).expect("read");
            match damage {
                0 => {}
                1 => *bytes.last_mut().expect("bytes") ^= 1,
                2 => bytes.truncate(bytes.len() / 2),
                _ => bytes = vec![b'x'; 40],
            }
            fs::write(&path, bytes).expect("written");
        }
        let ignored = Mutex::new(false);
        let events = |event: Event| {
            if let Event::Warning { message, .. } = event {
                *ignored.lock().expect("no panic") |= message.contains("ignored");
            }
        };
        let request = [(graph.port("levels").expect("exists"), on(32))];
        let got = evaluate(&fresh(), &graph, &request, &Cancel::default(), &events).expect("runs");
        assert_eq!(got, expected, "{damage}");
        let again: BTreeSet<u32> = calls(4).iter().map(|call| call.0).collect();
        assert_eq!(again, if damage == 0 { [32].into() } else { [8, 16, 32].into() }, "{damage}");
        assert_eq!(ignored.into_inner().expect("no panic"), damage > 0);
    }
}

#[test]
fn levels_are_reported_as_one_run() {
    let graph = graph(5);
    let events = Mutex::new(Vec::new());
    let evaluation = [(graph.port("levels").expect("exists"), on(64))];
    evaluate(&evaluator(2), &graph, &evaluation, &Cancel::default(), &|event| {
        events.lock().expect("no panic").push(event)
    })
    .expect("runs");
    let events = events.into_inner().expect("no panic");
    let of = |which: &dyn Fn(&Event) -> bool| events.iter().filter(|event| which(event)).count();
    assert!(events.contains(&Event::Planned { compute: 2, cached: 0 }), "{events:?}");
    assert_eq!(of(&|event| matches!(event, Event::NodeStarted { .. })), 2);
    assert_eq!(of(&|event| matches!(event, Event::NodeFinished { cells: [64, 64], .. })), 2);
    assert_eq!(of(&|event| matches!(event, Event::NodeFinished { .. })), 2);
    let fractions: Vec<f32> = events
        .iter()
        .filter_map(|event| if let Event::NodeProgress { fraction, .. } = event { Some(*fraction) } else { None })
        .collect();
    assert!(fractions.is_sorted() && fractions.len() == 4 && fractions[0] < 0.1, "{fractions:?}");
    let warned: Vec<&String> = events
        .iter()
        .filter_map(|event| if let Event::Warning { message, .. } = event { Some(message) } else { None })
        .collect();
    assert_eq!(warned, ["on 64 cells"]);
    // what is computed from a level of more cells warns as that does, and again from the store
    let evaluator = evaluator(1);
    for _ in 0..2 {
        assert_eq!(run(&evaluator, &graph, &["levels"], on(4)).expect("runs").warnings, ["on 16 cells"]);
    }
}

#[test]
fn a_build_in_stages_passes_the_levels_too() {
    let graph = Build(graph(6)).node("soft", &BLUR, &[("height", "levels")]).0;
    let window = on(64);
    let expected = run(&evaluator(1), &graph, &["soft"], window).expect("runs").values;
    calls(6);
    let port = graph.port("soft").expect("exists");
    let requests = [Request { port, window }];
    let evaluation = Evaluation { graph: &graph, folder: Path::new(""), requests: &requests, byproducts: &[] };
    for budget in [0, 1 << 20] {
        let evaluator = with(keeping(budget, None));
        let (rows, all) = (Mutex::new(Vec::new()), Mutex::new(Vec::new()));
        let deliver = |_, delivery: Delivery| rows.lock().expect("no panic").push(delivery.expect("a value").value);
        let events = |event: Event| all.lock().expect("no panic").push(event);
        evaluator.build_in_stages(&evaluation, &window, &[true], 640, &Cancel::default(), &events, &deliver);
        let rows = rows.into_inner().expect("no panic");
        let samples = rows.iter().flat_map(|rows| rows.as_field().expect("rows").samples()).copied().collect();
        assert_eq!(Value::Field(Field::new(window, samples)), expected[0]);
        // a state that only a later run may read is not made for a store that keeps nothing
        assert_eq!(calls(6), [(8, false, true), (16, false, true), (32, false, true), (64, true, budget > 0)]);
        let events = all.into_inner().expect("no panic");
        let levels =
            events.iter().filter(|event| matches!(event, Event::NodeStarted { name, .. } if &**name == "levels"));
        assert_eq!(levels.count(), 1);
        assert!(events.contains(&Event::Planned { compute: 3, cached: 0 }));
        let finished =
            events.iter().filter(|event| matches!(event, Event::NodeFinished { name, .. } if &**name == "levels"));
        assert_eq!(finished.count(), 1);
        let warned = events.iter().filter(|event| matches!(event, Event::Warning { .. }));
        assert_eq!(warned.count(), 1, "each stage knows the warnings of those before");
    }
}
