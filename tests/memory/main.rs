//! Compares the memory that every kernel declares with its use; a separate program because of its allocator.
//!
//! Each case of each node runs on one thread, with all outputs requested. The declaration must be within 20 % of the
//! measurement, or within a byte per cell: tables, rows and columns per thread, and lists of a few per cent of the
//! cells are not declared. In a small world tables and rows may exceed that, so a case that differs is measured again
//! in worlds of twice the side, in which tables per cell are a quarter and rows per cell half as large.

use orograph_nodes::registry;
use orograph_tests::{Counting, cases, scratch};

#[global_allocator]
static MEMORY: Counting = Counting::new();

/// Cells per side; the larger worlds are for cases that differ in the smaller ones.
const SIDES: [u32; 3] = [256, 512, 1024];

/// Cases whose memory is unknown before the run: node, case, and reason.
const UNKNOWN: [(&str, &str, &str); 2] = [
    ("Rivers", "heads=slope_area", "nearly every cell is a river, and lines hold 23 bytes per cell; 2 are declared"),
    ("Rivers", "least", "every cell is a river, and lines hold 24 bytes per cell; 2 are declared"),
];

#[test]
fn every_kernel_uses_what_it_declares() {
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
