//! Benchmarks the time per cell of every node, at 512, 1024 and 2048 cells per side: `cargo bench -p orograph-tests`,
//! with a node's name after `--` for that node alone. After criterion's own report it prints a table in nanoseconds per
//! cell. `examples/speed.rs` is faster and less accurate: the table of all nodes in a few minutes.
//!
//! The group `radii` then measures filters with a radius, at several radii in cells and 1024 cells per side.
//!
//! Each node runs on its example. Its inputs are computed before; only its own kernel is timed, on all cores.

use std::path::PathBuf;

use criterion::{BenchmarkGroup, BenchmarkId, Criterion, Throughput, measurement::WallTime};
use orograph_graph::Window;
use orograph_nodes::registry;
use orograph_tests::{Case, REACHING, example, inputs, reaching, world};

/// Cells per side.
const SIDES: [u32; 3] = [512, 1024, 2048];

/// Radii in cells.
const RADII: [u32; 4] = [4, 16, 64, 256];

fn nodes(c: &mut Criterion) {
    for node in registry().nodes() {
        let mut group = c.benchmark_group(node.id);
        group.sample_size(10);
        for cells in SIDES {
            time(&mut group, BenchmarkId::from_parameter(cells), &example(node), cells);
        }
        group.finish();
    }
}

fn radii(c: &mut Criterion) {
    let mut group = c.benchmark_group("radii");
    group.sample_size(10);
    for filter in REACHING {
        for cells in RADII {
            let case = reaching(filter, f64::from(cells) * Window::whole(world(SIDES[1])).cell_m());
            time(&mut group, BenchmarkId::new(filter.0, cells), &case, SIDES[1]);
        }
    }
    group.finish();
}

/// Times the kernel of a case on `cells` per side.
fn time(group: &mut BenchmarkGroup<'_, WallTime>, id: BenchmarkId, case: &Case, cells: u32) {
    let window = Window::whole(world(cells));
    let job = case.job(inputs(case, window), window);
    group.throughput(Throughput::Elements(window.len() as u64));
    group.bench_function(id, |b| b.iter(|| (case.kind().cpu)(&job)));
}

/// Prints criterion's measurements of this run and earlier ones as nanoseconds per cell.
fn table() {
    println!("\n{:<14} {:>10} {:>10} {:>10}   ns per cell (median)", "node", SIDES[0], SIDES[1], SIDES[2]);
    for node in registry().nodes() {
        let row = SIDES.map(|cells| {
            median_ns(node.id, cells)
                .map_or("-".to_owned(), |ns| format!("{:.2}", ns / f64::from(cells) / f64::from(cells)))
        });
        println!("{:<14} {:>10} {:>10} {:>10}", node.id, row[0], row[1], row[2]);
    }
}

/// The median that criterion stored for a node, in nanoseconds per run.
fn median_ns(id: &str, cells: u32) -> Option<f64> {
    let target = std::env::var_os("CARGO_TARGET_DIR")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../target"), PathBuf::from);
    let path = target.join(format!("criterion/{id}/{cells}/new/estimates.json"));
    let estimates: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok()?;
    estimates["median"]["point_estimate"].as_f64()
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    nodes(&mut criterion);
    radii(&mut criterion);
    criterion.final_summary();
    table();
}
