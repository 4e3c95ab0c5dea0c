//! Prints a table of the memory that every kernel uses besides its inputs and outputs: `cargo run --release -p
//! orograph-tests --example scratch`, with names of nodes after `--` for only those, or with `all` for all of their
//! cases.
//!
//! Each node runs on the test terrain, with its inputs computed before. The table has bytes per cell at the kernel's
//! peak, in worlds of 256 and 512 cells per side on one thread, and of 512 on two, and the node's declaration. Without
//! `all` it shows the case with the largest memory.

use orograph_tests::{Counting, Scratch, scratches};

#[global_allocator]
static MEMORY: Counting = Counting::new();

/// Cells per side, and threads.
const RUNS: [(u32, usize); 3] = [(256, 1), (512, 1), (512, 2)];

fn main() {
    let (all, names): (Vec<String>, Vec<String>) = std::env::args().skip(1).partition(|name| name == "all");
    println!("Bytes per cell.\n");
    println!("| node | case | 256, one thread | 512, one thread | 512, two threads | declared | |");
    println!("| --- | --- | ---: | ---: | ---: | ---: | --- |");
    let mut most: Option<Vec<Scratch>> = None;
    for measured in scratches(&MEMORY, &names, &RUNS) {
        if !all.is_empty() {
            print(&measured);
            continue;
        }
        let is_next = most.as_ref().is_some_and(|most| most[0].id != measured[0].id);
        if is_next && let Some(most) = most.take() {
            print(&most);
        }
        if most.as_ref().is_none_or(|most| most[1].measured < measured[1].measured) {
            most = Some(measured);
        }
    }
    if let Some(most) = most {
        print(&most);
    }
}

fn print(measured: &[Scratch]) {
    let [small, large, threads] = measured else { return };
    let told = |run: &Scratch| format!("{:.2}", run.per_cell(run.measured));
    let verdict = if measured.iter().all(Scratch::holds) { "" } else { "differs" };
    println!(
        "| {} | {} | {} | {} | {} | {:.2} | {verdict} |",
        large.id,
        large.case,
        told(small),
        told(large),
        told(threads),
        large.per_cell(large.declared)
    );
}
