//! Kernels return exactly the requested outputs, and each output is independent of the others requested.

use orograph_graph::{Job, NodeError, Outputs, Value, Wanted, Window};
use orograph_nodes::registry;
use orograph_tests::{Case, cases, example, inputs, world};

type Named = Vec<(&'static str, Value)>;

fn named(outputs: Outputs) -> Named {
    outputs.into_iter_named().collect()
}

/// Returns true if both are the same; NaN measures count as equal.
fn same(a: &Named, b: &Named) -> bool {
    let report = |(name, value): &(&str, Value)| value.as_report().map(|report| format!("{name} {report:?}"));
    let field =
        |(name, value): &(&str, Value)| (value.as_report().is_none()).then(|| (name.to_string(), value.clone()));
    a.iter().map(report).eq(b.iter().map(report)) && a.iter().map(field).eq(b.iter().map(field))
}

/// Compares the result for each single output with the results for all of them.
fn each_alone(case: &Case, give: impl Fn(Wanted) -> Result<Named, NodeError>) -> Result<(), String> {
    // another test covers errors of nodes
    let Ok(all) = give(Wanted::ALL) else { return Ok(()) };
    let (kind, names) = (case.kind(), all.iter().map(|(name, _)| *name));
    if !names.eq(kind.outputs.iter().map(|output| output.name)) {
        return Err(format!("{}: some outputs are missing", case.name));
    }
    for (at, value) in all.into_iter().enumerate() {
        let alone = give(Wanted::NONE.with(at)).map_err(|error| format!("{}: {}: {error}", case.name, value.0))?;
        if !same(&alone, &vec![value]) {
            let given: Vec<&str> = alone.iter().map(|(name, _)| *name).collect();
            return Err(format!("{}: {} differs alone, or is not alone: {given:?}", case.name, kind.outputs[at].name));
        }
    }
    Ok(())
}

#[test]
fn each_output_is_given_alone_as_among_all() {
    let window = Window::whole(world(32));
    let mut found = Vec::new();
    for node in registry().nodes() {
        for case in cases(node) {
            let inputs = inputs(&case, window);
            let give = |wanted| (node.cpu)(&Job { wanted, ..case.job(inputs.clone(), window) }).map(named);
            if let Err(what) = each_alone(&case, give) {
                found.push(format!("{}: {what}", node.id));
            }
        }
    }
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

/// The requested outputs of a process may change while it runs.
#[test]
fn a_process_gives_each_output_alone_as_among_all() {
    let window = Window::whole(world(32));
    for node in registry().nodes() {
        let (case, Some(begin)) = (example(node), node.process) else { continue };
        let read = inputs(&case, window);
        let job = |wanted: Wanted| Job { wanted, ..case.job(read.clone(), window) };
        let mut process = begin(&job(Wanted::NONE)).expect("a process");
        process.step(&job(Wanted::NONE)).expect("a step");
        let checked = each_alone(&case, |wanted| process.outputs(&job(wanted)).map(named));
        assert_eq!(checked, Ok(()), "{}", case.kind().id);
    }
}
