//! Tests of every node: its declaration is valid, it runs at its extremes, its bytes do not depend on threads or SIMD
//! level, a window equals that part of the whole world, and another resolution gives the same terrain.

use std::{
    num::NonZero,
    sync::{Arc, mpsc},
    thread,
    time::{Duration, Instant},
};

use orograph_graph::{
    Cancel, EvalError, Evaluation, Evaluator, EvaluatorOptions, Exactness, Field, GeoPlace, InputValue, Kind, Measure,
    Node, OutputType, ParamSpec, ParamValue, ParamValues, PortType, Request, Resolution, Store, Strata, Value, When,
    Window, World,
};
use orograph_nodes::{numerics::simd, registry};
use orograph_tests::{
    Case, Difference, STEPPED, cases, data_folder, differences, evaluate, evaluate_window, example, extreme_worlds,
    inputs, lengths, options, others, plain, set, wired, world,
};

/// Runs a check for every node and collects all failures, so that one faulty node does not hide another.
fn for_every_node(check: impl Fn(&'static Node) -> Result<(), String>) {
    let found: Vec<String> = registry()
        .nodes()
        .iter()
        .filter_map(|node| check(node).err().map(|what| format!("{}: {what}", node.id)))
        .collect();
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

fn run(case: &Case, cells: u32, threads: usize) -> Result<Vec<Value>, String> {
    evaluate(case, world(cells), threads).map_err(|error| format!("{}: {error}", case.name))
}

#[test]
fn every_declaration_is_valid() {
    assert_eq!(registry().faults(), Vec::<String>::new());
}

#[test]
fn every_node_runs_at_its_extremes_or_refuses_with_a_remedy() {
    for_every_node(|node| {
        for case in cases(node) {
            match evaluate(&case, world(48), 2) {
                Ok(values) => {
                    assert_eq!(values.len(), node.outputs.len());
                    values.iter().try_for_each(|value| declared(node, value))?;
                }
                // a combination that makes no sense may be refused, but only with a remedy
                Err(EvalError::Node { hint: Some(_), .. }) if case.name != "example" => {}
                Err(error) => return Err(format!("{}: {error}", case.name)),
            }
        }
        Ok(())
    });
}

/// The work depends on the number of cells, not on lengths in cells, up to the limits of lengths and of worlds.
#[test]
fn lengths_far_beyond_the_world_and_below_its_cells_cost_no_time() {
    let evaluator = Evaluator::new(EvaluatorOptions {
        store: Arc::new(Store::new(0, None)),
        threads: NonZero::new(1),
        ..EvaluatorOptions::default()
    })
    .expect("an evaluator");
    for_every_node(|node| {
        let cases = lengths(node);
        let found: Vec<String> = cases
            .iter()
            .flat_map(|case| extreme_worlds().map(|world| far_beyond(&evaluator, case, world)))
            .filter_map(Result::err)
            .collect();
        if found.is_empty() { Ok(()) } else { Err(found.join("\n    ")) }
    });
}

/// Much longer than a kernel takes on a busy machine, to end or to stop; one whose time grows with its lengths would take
/// hours.
const PATIENCE: Duration = Duration::from_secs(30);

/// Checks that a case ends, or stops when told if that is all that is asked of it.
#[expect(clippy::disallowed_methods, reason = "it tests how long a kernel takes, not its result")]
fn far_beyond(evaluator: &Evaluator, case: &Case, world: World) -> Result<(), String> {
    let is_stepped = STEPPED.contains(&case.kind().id);
    let patience = if is_stepped { Duration::from_millis(30) } else { PATIENCE };
    let requests: Vec<Request> =
        case.outputs().into_iter().map(|port| Request { port, window: Window::whole(world) }).collect();
    let folder = data_folder();
    let evaluation = Evaluation { graph: &case.graph, folder: &folder, requests: &requests, byproducts: &[] };
    let (start, cancel) = (Instant::now(), Cancel::default());
    let (ended, end) = mpsc::channel::<()>();
    let answers = thread::scope(|scope| {
        let cancel = &cancel;
        scope.spawn(move || {
            if end.recv_timeout(patience).is_err() {
                cancel.cancel();
            }
        });
        let answers = evaluator.evaluate(&evaluation, cancel, &|_| {});
        // the receiver is gone if the time was over
        let _ = ended.send(());
        answers
    });
    let place = format!("{} in a world of {} m", case.name, world.size[0]);
    let spent = start.elapsed();
    if spent > patience + PATIENCE {
        return Err(format!("{place} does not stop within {spent:?}"));
    }
    let wrong = |error: &EvalError| match error {
        EvalError::Cancelled => !is_stepped,
        EvalError::Node { hint, .. } => hint.is_none(),
        _ => true,
    };
    match answers.iter().filter_map(|answer| answer.as_ref().err()).find(|error| wrong(error)) {
        Some(error) => Err(format!("{place}: {error}")),
        None => Ok(()),
    }
}

/// Checks that a node that declares its measures reports no others.
fn declared(node: &Node, value: &Value) -> Result<(), String> {
    let Value::Report(report) = value else { return Ok(()) };
    let is_declared =
        |measure: &Measure| node.measures.iter().any(|spec| spec.name == measure.name && spec.unit == measure.unit);
    match report.measures.iter().find(|measure| !is_declared(measure)) {
        Some(Measure { name, unit, .. }) if !node.measures.is_empty() || node.category == "measure" => {
            Err(format!("the measure `{name}` in \"{unit}\" is not declared"))
        }
        _ => Ok(()),
    }
}

#[test]
fn every_input_that_takes_numbers_can_be_fed() {
    let remap = registry().get("Remap").expect("a node");
    let specs = remap.specs();
    let quantity = specs.iter().find(|spec| spec.name == "quantity").expect("a parameter");
    let choose = match remap.outputs[0].ty {
        OutputType::Chosen(choose) => Some(choose),
        OutputType::Fixed(_) | OutputType::SameAs(_) => None,
    };
    let choose = choose.expect("its quantity is a parameter");
    let given: Vec<PortType> = options(&quantity.kind)
        .into_iter()
        .map(|option| {
            let mut params = ParamValues::defaults(&specs);
            params.set("quantity", option);
            choose(&params)
        })
        .collect();
    for_every_node(|node| {
        let takes_numbers = |ty: PortType| matches!(ty, PortType::Height | PortType::Mask | PortType::Scalar(_));
        let mut inputs = node.inputs.iter().filter(|input| takes_numbers(input.ty));
        match inputs.find(|input| !given.iter().any(|given| input.ty.accepts(*given))) {
            Some(input) => Err(format!("`Remap` cannot give {} for `{}`", input.ty, input.name)),
            None => Ok(()),
        }
    });
}

/// A parameter that is declared to have no effect with a setting, or with or without a wire, has none.
#[test]
fn parameters_without_effect_change_nothing() {
    for_every_node(|node| {
        let specs = node.specs();
        for spec in &specs {
            for when in spec.when {
                let position = |name: &str| node.inputs.iter().position(|input| input.name == name);
                match when {
                    When::Setting { param, is } => {
                        let governs = specs.iter().find(|other| other.name == *param).ok_or("no such parameter")?;
                        for value in
                            options(&governs.kind).into_iter().filter(|value| !is.contains(&&*value.to_string()))
                        {
                            rests(node, spec, when, |case| Some(set(case, &[(governs.name, value.clone())])))?;
                        }
                    }
                    When::NonZero(name) => {
                        let governs = specs.iter().find(|other| other.name == *name).ok_or("no such parameter")?;
                        let zero = match governs.kind {
                            Kind::Int { .. } => ParamValue::Int(0),
                            _ => ParamValue::Float(0.0),
                        };
                        rests(node, spec, when, |case| Some(set(case, &[(governs.name, zero.clone())])))?;
                    }
                    When::Empty(name) => {
                        let governs = specs.iter().find(|other| other.name == *name).ok_or("no such parameter")?;
                        for full in others(&governs.kind).into_iter().filter(|value| !value.is_empty()) {
                            rests(node, spec, when, |case| Some(set(case, &[(governs.name, full.clone())])))?;
                        }
                    }
                    When::Wired(name) => {
                        let input = position(name).ok_or("no such input")?;
                        rests(node, spec, when, |mut case| {
                            case.graph.disconnect(case.node, input);
                            Some(case)
                        })?;
                    }
                    When::Unwired(name) => rests(node, spec, when, |case| {
                        let is_wired = case.graph.is_wired(case.node, name);
                        is_wired.then_some(case)
                    })?,
                }
            }
        }
        Ok(())
    });
}

/// Where the elevation model lies that the example of `Import` reads.
const GLENCOE: GeoPlace = GeoPlace { epsg: 27_700, corner_m: [212000.0, 773600.0] };

/// Checks that a parameter has no effect in cases where a condition does not hold, of which at least one must run.
fn rests(
    node: &'static Node,
    spec: &ParamSpec,
    when: &When,
    without: impl Fn(Case) -> Option<Case>,
) -> Result<(), String> {
    let mut runs = false;
    for case in [example(node), wired(node), plain(node)].into_iter().filter_map(without) {
        let place = Some(GLENCOE).filter(|_| node.reads_place);
        let outputs = |case: &Case| evaluate(case, World { place, ..world(48) }, 2).map_err(|error| error.to_string());
        let before = outputs(&case);
        runs |= before.is_ok();
        for other in others(&spec.kind) {
            if outputs(&set(case.clone(), &[(spec.name, other.clone())])) != before {
                return Err(format!("`{}: {other}` changes the result where it is not true that {when}", spec.name));
            }
        }
    }
    if runs { Ok(()) } else { Err(format!("`{}` cannot be tried where it is not true that {when}", spec.name)) }
}

#[test]
fn equal_bytes_on_one_and_several_threads_and_twice() {
    for_every_node(|node| {
        if node.exactness != Exactness::Exact {
            return Ok(());
        }
        let case = example(node);
        let once = run(&case, 96, 1)?;
        for (what, threads) in [("one thread again", 1), ("3 threads", 3), ("3 threads again", 3)] {
            if run(&case, 96, threads)? != once {
                return Err(format!("other bytes on {what}"));
            }
        }
        Ok(())
    });
}

#[test]
fn equal_bytes_at_every_simd_width() {
    for_every_node(|node| {
        if node.exactness != Exactness::Exact {
            return Ok(());
        }
        // 83 cells: rows are not multiples of a SIMD vector
        for case in [example(node)] {
            let widest = run(&case, 83, 2)?;
            for level in [simd::Level::Baseline, simd::Level::Avx2] {
                if simd::at(level, || run(&case, 83, 2))? != widest {
                    return Err(format!("{}: other bytes at {level:?}", case.name));
                }
            }
        }
        Ok(())
    });
}

/// The raster of a value that can be cropped.
fn raster(value: &Value) -> Option<&Field> {
    value.as_field().or_else(|| value.as_strata().map(Strata::offset))
}

#[test]
fn a_window_with_its_halo_equals_the_window_of_the_whole() {
    for_every_node(|node| {
        let case = example(node);
        let whole = run(&case, 96, 2)?;
        let inside = Window { origin: [31, 22], cells: [40, 33], ..Window::whole(world(96)) };
        let corner = Window { origin: [0, 60], cells: [17, 36], ..Window::whole(world(96)) };
        for window in [inside, corner] {
            let part = evaluate_window(&case, window, 2).map_err(|error| error.to_string())?;
            for ((whole, part), output) in whole.iter().zip(&part).zip(node.outputs) {
                if let (Some(whole), Some(part)) = (raster(whole), raster(part))
                    && whole.crop(&window) != *part
                {
                    return Err(format!("`{}` differs in the window at {:?}", output.name, window.origin));
                }
            }
        }
        Ok(())
    });
}

/// Exactly the nodes that declare it depend on the sea level; results of the others are reused when it changes.
#[test]
fn the_sea_changes_what_nodes_declare_that_it_does() {
    for_every_node(|node| {
        let mut changes = false;
        for case in [example(node), wired(node), plain(node)] {
            let dry = Window::whole(world(64));
            let inputs = inputs(&case, dry);
            let on = |window: &Window, value: &Value| match value {
                Value::Field(field) => Value::Field(field.crop(window)),
                Value::Strata(strata) => strata.on(strata.offset().crop(window)).into(),
                other => other.clone(),
            };
            let results = |sea_level: Option<f64>| -> Option<Vec<Value>> {
                let window = Window::whole(World { sea_level, ..world(64) });
                let inputs = inputs.iter().map(|input| match input {
                    InputValue::Value(value) => InputValue::Value(on(&window, value)),
                    other => other.clone(),
                });
                let outputs = (node.cpu)(&case.job(inputs.collect(), window)).ok()?;
                Some(outputs.into_iter_named().map(|(_, value)| on(&dry, &value)).collect())
            };
            let without = results(None);
            changes |= [0.0, 600.0, 12_000.0].into_iter().any(|level| results(Some(level)) != without);
        }
        match (changes, node.reads_sea) {
            (true, false) => Err("depends on the sea level; set `reads_sea`".to_owned()),
            (false, true) => Err("does not depend on the sea level".to_owned()),
            _ => Ok(()),
        }
    });
}

/// Results differ by no more than declared at two pairs of cell sizes; smoothed over eight cells, so that detail does
/// not count, by no more than 2 %, unless more than the usual 5 % is declared.
#[test]
fn another_resolution_gives_the_same_terrain() {
    for_every_node(|node| {
        let Resolution::Within(declared) = node.resolution else { return Ok(()) };
        let (case, declared) = (example(node), f64::from(declared));
        for cells in [128, 256] {
            for Difference { output, cells: by_cells, smoothed } in differences(&case, cells)? {
                if by_cells > declared || (declared <= 0.0501 && smoothed > 0.02) {
                    return Err(format!(
                        "`{output}` differs by {by_cells:.4} of its spread from {cells} cells on, smoothed {smoothed:.4}, declared {declared}"
                    ));
                }
            }
        }
        Ok(())
    });
}
