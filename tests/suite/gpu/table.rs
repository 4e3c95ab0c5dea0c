//! `docs/gpu.md`: what each kernel moves and dispatches, counted without a device; `cargo bless` updates it.

use std::fmt::Write as _;

use orograph_graph::{
    Window,
    gpu::{Count, Passes, Tolerance, Work, record},
};
use orograph_tests::{blessing, example, gpu::nodes, inputs, world};

/// Where the table begins and ends in the page.
const MARKS: [&str; 2] = ["<!-- kernels -->\n", "<!-- end of kernels -->\n"];

fn tolerance(tolerance: &Tolerance) -> String {
    let mut parts = Vec::new();
    if tolerance.absolute > 0.0 {
        parts.push(format!("{}", tolerance.absolute));
    }
    if tolerance.relative > 0.0 {
        parts.push(format!("{:e} of the range", tolerance.relative));
    }
    let mut text = if parts.is_empty() { "none".to_owned() } else { parts.join(" + ") };
    if tolerance.outliers > 0.0 {
        let _ = write!(text, ", except in {} %", tolerance.outliers * 100.0);
    }
    text
}

/// The counts of each kernel with the example of its node, all outputs wanted and all inputs of the example wired.
fn counted() -> Vec<(&'static orograph_graph::Node, Work)> {
    let count = |node| {
        let case = example(node);
        let window = Window::whole(world(64));
        let job = case.job(inputs(&case, window), window);
        let mut count = Count::new(&job, 0);
        record(node.gpu.expect("a kernel for the GPU"), &job, &mut count).expect("a kernel is recorded");
        (node, count.work())
    };
    nodes().into_iter().map(count).collect()
}

#[test]
fn every_kernel_is_in_the_manual_with_what_it_moves() {
    let mut table = String::from(
        "| node | passes | bytes per cell | at least | scratch | tolerance |\n|---|--:|--:|--:|--:|---|\n",
    );
    for (node, work) in counted() {
        let kernel = node.gpu.expect("a kernel for the GPU");
        assert_eq!(kernel.tolerance.len(), node.outputs.len(), "{} states the tolerance of each output", node.id);
        if let Passes::One { .. } = kernel.passes {
            assert_eq!(work.passes, 1);
        }
        assert!(work.least <= work.bytes, "{}: {work:?}", node.id);
        let mut tolerances: Vec<String> = kernel.tolerance.iter().map(tolerance).collect();
        tolerances.dedup();
        let (id, category) = (node.id, node.category);
        // a kernel whose inputs and outputs stay on the host
        let least = if work.least > 0 { work.least.to_string() } else { "–".to_owned() };
        let _ = writeln!(
            table,
            "| [{id}](nodes/{id}.md) ({category}) | {} | {} | {least} | {} | {} |",
            work.passes,
            work.bytes,
            work.scratch,
            tolerances.join("; ")
        );
    }
    let path = orograph_tests::root().join("docs/gpu.md");
    let page = std::fs::read_to_string(&path).expect("docs/gpu.md");
    let (before, rest) = page.split_once(MARKS[0]).expect("the mark before the table");
    let (_, after) = rest.split_once(MARKS[1]).expect("the mark after the table");
    let renewed = format!("{before}{}{table}{}{after}", MARKS[0], MARKS[1]);
    if blessing() {
        std::fs::write(&path, &renewed).expect("the page is written");
    } else {
        assert!(renewed == page, "docs/gpu.md differs from what is counted; run `cargo bless`");
    }
}
