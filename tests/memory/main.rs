//! The memory that every kernel declares against what it uses, in a program of its own for the sake of its allocator.
//!
//! Each case of each node runs on one thread, with all outputs wanted. What is declared must be within 20 % of what is measured, or
//! within a byte per cell: tables, rows and columns that each thread keeps, and lists of a few per cent of the cells are not
//! declared. In worlds of 512 cells a side tables and rows may be more than that, so that a case that differs is measured again in
//! one of twice the side, where they are a quarter and a half of it.

use orograph_nodes::registry;
use orograph_tests::{Counting, cases, scratch};

#[global_allocator]
static MEMORY: Counting = Counting::new();

/// Cells a side, and the same for cases that differ.
const SIDES: [u32; 2] = [512, 1024];

/// Cases whose memory is not known before the run: node, case, and why.
const UNKNOWN: [(&str, &str, &str); 2] = [
    ("Rivers", "heads=slope_area", "nearly every cell is a river, and lines hold 23 bytes per cell; 2 are declared"),
    ("Rivers", "least", "every cell is a river, and lines hold 24 bytes per cell; 2 are declared"),
];

#[test]
fn every_kernel_uses_what_it_declares() {
    let mut faults = Vec::new();
    for case in registry().nodes().iter().flat_map(|node| cases(node)) {
        let is_unknown = UNKNOWN.iter().any(|(node, name, _)| *node == case.kind().id && *name == case.name);
        let found = SIDES.iter().map_while(|side| scratch(&MEMORY, &case, *side, 1));
        let Some(differs) = found.take_while(|found| !found.holds()).last() else { continue };
        if differs.cells == (SIDES[1] * SIDES[1]) as usize && !is_unknown {
            let [measured, declared] = [differs.measured, differs.declared].map(|bytes| differs.per_cell(bytes));
            faults
                .push(format!("{} {}: {measured:.2} bytes per cell, {declared:.2} declared", differs.id, differs.case));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
