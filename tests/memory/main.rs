//! Compares the memory that every kernel declares with its use; a separate program because of its allocator.
//!
//! Each case of each node runs on one thread, with all outputs requested, beside other cases on other threads. The
//! declaration must be within 20 % of the measurement, or within a byte per cell: small tables, rows and columns per
//! thread, and lists of a few per cent of the cells are not declared. In a small world tables and rows may exceed that,
//! so a case that differs is measured again in worlds of twice the side, in which tables per cell are a quarter and rows
//! per cell half as large. Tables of more than 384 KiB are declared, which is measured in a world of 64 x 64 cells.

use std::{
    num::NonZero,
    sync::atomic::{AtomicUsize, Ordering::Relaxed},
    thread,
};

use orograph_graph::ParamValue;
use orograph_nodes::registry;
use orograph_tests::{Case, Counting, STEPPED, cases, example, extreme_worlds, lengths, scratch, scratch_in, set};

#[global_allocator]
static MEMORY: Counting = Counting::new();

/// Cells per side; the larger worlds are for cases that differ in the smaller ones.
const SIDES: [u32; 3] = [256, 512, 1024];

/// Cases whose memory is unknown before the run: node, case, and reason.
const UNKNOWN: [(&str, &str, &str); 3] = [
    ("Rivers", "heads=slope_area", "nearly every cell is a river, and lines hold 23 bytes per cell; 2 are declared"),
    (
        "Basins",
        "least",
        "every place where water ends has a basin, and outlines hold 11 bytes per cell; 4 are declared",
    ),
    ("Rivers", "least", "every cell is a river, and lines hold 24 bytes per cell; 2 are declared"),
];

/// What `of` says of each case, on as many threads as there are processors. These wait for the kernels' own threads, so
/// they are none of rayon's, which would take up the next case while they wait.
fn of_each<T: Send>(cases: impl Iterator<Item = Case>, of: impl Fn(&Case) -> Option<T> + Sync) -> Vec<T> {
    let cases: Vec<Case> = cases.collect();
    let next = AtomicUsize::new(0);
    let work = || std::iter::from_fn(|| cases.get(next.fetch_add(1, Relaxed))).filter_map(&of).collect::<Vec<T>>();
    let threads = thread::available_parallelism().map_or(1, NonZero::get);
    thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        workers.into_iter().flat_map(|worker| worker.join().expect("no panic")).collect()
    })
}

/// Bytes that a kernel may need in a world of 16 x 16 cells: tables that do not depend on the world.
const SMALL: u64 = 4 << 20;

/// Lengths far beyond the world, and below its cells, need no more memory than the cells do.
#[test]
fn lengths_need_no_memory() {
    let registry = registry();
    let nodes = registry.nodes().iter().filter(|node| !STEPPED.contains(&node.id));
    let large: Vec<String> = of_each(nodes.flat_map(|node| lengths(node)), |case| {
        let found =
            extreme_worlds().into_iter().filter_map(|world| Some((scratch_in(&MEMORY, case, world, 1)?, world)));
        let (found, world) =
            found.max_by_key(|(found, _)| found.measured).filter(|(found, _)| found.measured > SMALL)?;
        Some(format!("{} {} in a world of {} m: {} bytes", found.id, found.case, world.size[0], found.measured))
    });
    assert!(large.is_empty(), "{}", large.join("\n"));
}

/// Bytes that are not declared: rows and small tables.
const ROWS: u64 = 384 << 10;

/// In a small world, tables and lists that hardly grow with the world count more than the cells.
#[test]
fn small_worlds_need_what_is_declared() {
    let faults: Vec<String> = of_each(registry().nodes().iter().flat_map(|node| cases(node)), |case| {
        // here its kernel passes all levels itself, which the evaluator plans and counts one by one
        if case.kind().id == "StreamPower" && case.name == "schedule=coarse_to_fine" {
            return None;
        }
        let found = scratch(&MEMORY, case, 64, 1)?;
        let (used, declared) = (found.given + found.measured, found.given + found.declared);
        (used > declared + declared / 4 + ROWS)
            .then(|| format!("{} {}: {used} bytes, {declared} declared", found.id, found.case))
    });
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// A picture of 5000 x 5000 cells takes 25 MB unpacked, and 100 MB as numbers.
#[test]
fn a_large_file_needs_little_memory() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("large.png");
    image::GrayImage::new(5000, 5000).save(&path).expect("a picture");
    let import = registry().get("Import").expect("a node");
    let file = ParamValue::File(path.to_str().expect("a name").to_owned());
    let found = scratch(&MEMORY, &set(example(import), &[("file", file)]), 16, 1).expect("readable");
    assert!(found.measured < SMALL && found.declared < SMALL, "{found:?}");
    assert!(found.measured as f64 <= 1.25 * found.declared as f64, "{found:?}");
}

/// Its voids are filled from the whole file.
#[test]
fn a_large_file_with_voids_needs_little_memory() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("large.r32");
    let sample = |at: usize| if at.is_multiple_of(3) { f32::NAN } else { at as f32 };
    let bytes: Vec<u8> = (0..2000 * 2000).flat_map(|at| sample(at).to_le_bytes()).collect();
    std::fs::write(&path, bytes).expect("written");
    let import = registry().get("Import").expect("a node");
    let file = ParamValue::File(path.to_str().expect("a name").to_owned());
    let found = scratch(&MEMORY, &set(example(import), &[("file", file)]), 16, 1).expect("readable");
    assert!(found.measured < 2 * SMALL && found.declared < 2 * SMALL, "{found:?}");
    assert!(found.measured as f64 <= 1.25 * found.declared as f64, "{found:?}");
}

/// A case of a process whose steps are as short as its cells, over a twentieth of the time: all steps need the same memory,
/// and in the larger worlds a whole storm takes minutes.
fn brief(case: Case) -> Case {
    let now = case.graph.instance(case.node).params.get("duration").cloned();
    match now {
        Some(ParamValue::Float(seconds)) if STEPPED.contains(&case.kind().id) => {
            set(case, &[("duration", ParamValue::Float(seconds / 20.0))])
        }
        _ => case,
    }
}

#[test]
fn every_kernel_uses_what_it_declares() {
    let registry = registry();
    let cases = registry.nodes().iter().flat_map(|node| cases(node)).map(brief);
    let faults: Vec<String> = of_each(cases, |case| {
        if UNKNOWN.iter().any(|(node, name, _)| *node == case.kind().id && *name == case.name) {
            return None;
        }
        let mut last = None;
        for side in SIDES {
            last = scratch(&MEMORY, case, side, 1).filter(|found| !found.holds());
            if last.is_none() {
                break;
            }
        }
        let found = last?;
        let [measured, declared] = [found.measured, found.declared].map(|bytes| found.per_cell(bytes));
        Some(format!("{} {}: {measured:.2} bytes per cell, {declared:.2} declared", found.id, found.case))
    });
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
