//! Prints a table of the declared resolution tolerance and the measured differences of every node: `cargo run --release
//! -p orograph-tests --example resolution`, with names of nodes after `--` for only those; see `docs/checks.md`.

use std::error::Error;

use orograph_graph::Resolution;
use orograph_nodes::registry;
use orograph_tests::{differences, example};

fn main() -> Result<(), Box<dyn Error>> {
    let names: Vec<String> = std::env::args().skip(1).collect();
    println!("| node | output | declared | 128, 256 cells | 256, 512 | smoothed: 128, 256 | 256, 512 |");
    println!("| --- | --- | ---: | ---: | ---: | ---: | ---: |");
    for node in registry().nodes().iter().filter(|node| names.is_empty() || names.iter().any(|name| name == node.id)) {
        let declared = match node.resolution {
            Resolution::Within(tolerance) => format!("{:.1} %", 100.0 * tolerance),
            Resolution::Cells(_) if names.is_empty() => continue,
            Resolution::Cells(_) => "by cells".to_owned(),
        };
        let case = example(node);
        for (coarse, fine) in differences(&case, 128)?.iter().zip(differences(&case, 256)?) {
            let [a, b, c, d] = [coarse.cells, fine.cells, coarse.smoothed, fine.smoothed].map(|share| 100.0 * share);
            println!("| {} | {} | {declared} | {a:.2} | {b:.2} | {c:.2} | {d:.2} |", node.id, fine.output);
        }
    }
    Ok(())
}
