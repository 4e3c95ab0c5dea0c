//! Compares the memory that every kernel declares with its use; a separate program because of its allocator.
//!
//! Each case of each node runs on one thread, with all outputs requested. The declaration must be within 20 % of the
//! measurement, or within a byte per cell: small tables, rows and columns per thread, and lists of a few per cent of
//! the cells are not declared. In a small world tables and rows may exceed that, so a case that differs is measured
//! again in worlds of twice the side, in which tables per cell are a quarter and rows per cell half as large. Tables of
//! more than 384 KiB are declared, which is measured in a world of 64 x 64 cells.

use std::sync::Mutex;

use orograph_graph::ParamValue;
use orograph_nodes::registry;
use orograph_tests::{Counting, STEPPED, cases, example, extreme_worlds, lengths, scratch, scratch_in, set};

#[global_allocator]
static MEMORY: Counting = Counting::new();

/// Cells per side; the larger worlds are for cases that differ in the smaller ones.
const SIDES: [u32; 3] = [256, 512, 1024];

/// Cases whose memory is unknown before the run: node, case, and reason.
const UNKNOWN: [(&str, &str, &str); 2] = [
    ("Rivers", "heads=slope_area", "nearly every cell is a river, and lines hold 23 bytes per cell; 2 are declared"),
    ("Rivers", "least", "every cell is a river, and lines hold 24 bytes per cell; 2 are declared"),
];

/// Only one test may allocate at a time.
static ALONE: Mutex<()> = Mutex::new(());

/// Bytes that a kernel may need in a world of 16 x 16 cells: tables that do not depend on the world.
const SMALL: u64 = 4 << 20;

/// Lengths far beyond the world, and below its cells, need no more memory than the cells do.
#[test]
fn lengths_need_no_memory() {
    let _alone = ALONE.lock();
    let registry = registry();
    let nodes = registry.nodes().iter().filter(|node| !STEPPED.contains(&node.id));
    let large: Vec<String> = nodes
        .flat_map(|node| lengths(node))
        .flat_map(|case| extreme_worlds().map(|world| (scratch_in(&MEMORY, &case, world, 1), world.size[0])))
        .filter_map(|(found, side)| found.filter(|found| found.measured > SMALL).map(|found| (found, side)))
        .map(|(found, side)| format!("{} {} in a world of {side} m: {} bytes", found.id, found.case, found.measured))
        .collect();
    assert!(large.is_empty(), "{}", large.join("\n"));
}

/// Bytes that are not declared: rows and small tables.
const ROWS: u64 = 384 << 10;

/// In a small world, tables and lists that hardly grow with the world count more than the cells.
#[test]
fn small_worlds_need_what_is_declared() {
    let _alone = ALONE.lock();
    let mut faults = Vec::new();
    for case in registry().nodes().iter().flat_map(|node| cases(node)) {
        // here its kernel passes all levels itself, which the evaluator plans and counts one by one
        if case.kind().id == "StreamPower" && case.name == "schedule=coarse_to_fine" {
            continue;
        }
        let Some(found) = scratch(&MEMORY, &case, 64, 1) else { continue };
        let (used, declared) = (found.given + found.measured, found.given + found.declared);
        if used > declared + declared / 4 + ROWS {
            faults.push(format!("{} {}: {used} bytes, {declared} declared", found.id, found.case));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// A picture of 5000 x 5000 cells takes 25 MB unpacked, and 100 MB as numbers.
#[test]
fn a_large_file_needs_little_memory() {
    let _alone = ALONE.lock();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("large.png");
    image::GrayImage::new(5000, 5000).save(&path).expect("a picture");
    let import = registry().get("Import").expect("a node");
    let file = ParamValue::File(path.to_str().expect("a name").to_owned());
    let found = scratch(&MEMORY, &set(example(import), &[("file", file)]), 16, 1).expect("readable");
    assert!(found.measured < SMALL && found.declared < SMALL, "{found:?}");
    assert!(found.measured as f64 <= 1.25 * found.declared as f64, "{found:?}");
}

#[test]
fn every_kernel_uses_what_it_declares() {
    let _alone = ALONE.lock();
    let mut faults = Vec::new();
    for case in registry().nodes().iter().flat_map(|node| cases(node)) {
        if UNKNOWN.iter().any(|(node, name, _)| *node == case.kind().id && *name == case.name) {
            continue;
        }
        let mut last = None;
        for side in SIDES {
            last = scratch(&MEMORY, &case, side, 1).filter(|found| !found.holds());
            if last.is_none() {
                break;
            }
        }
        if let Some(found) = last {
            let [measured, declared] = [found.measured, found.declared].map(|bytes| found.per_cell(bytes));
            let fault = format!("{} {}: {measured:.2} bytes per cell, {declared:.2} declared", found.id, found.case);
            println!("{fault}");
            faults.push(fault);
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
