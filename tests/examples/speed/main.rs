//! Time per cell of every node as a table: `cargo run --release -p orograph-tests --example speed`. Arguments after
//! `--`: a side in cells and names of nodes, or `radii` for nodes with a radius at several radii, `layers` for nodes
//! that read layers of rock, `growth` and names of nodes for several numbers of cells, or `ice` for the steps of
//! `Glacial`; see `docs/speed.md`.
//!
//! Each node runs on its example on the test terrain, on one thread, with its inputs computed before. The result is the
//! mean of the runs that fit into a fraction of a second, in nanoseconds of that thread per cell of the world:
//! processor time if the system reports it, so that other load on the machine hardly matters, otherwise elapsed time.
//! Systems report it in steps of milliseconds, so that single runs cannot be timed.

#![expect(clippy::disallowed_methods, reason = "it measures time")]

mod ice;

use std::{
    error::Error,
    time::{Duration, Instant},
};

use orograph_graph::{InputValue, Window};
use orograph_nodes::{
    numerics::{memory::LargePages, simd},
    registry,
};
use orograph_tests::{Case, REACHING, example, inputs, layered, reaching, world};

#[global_allocator]
static MEMORY: LargePages = LargePages;

/// Runs are repeated until they have taken this long in total.
const ENOUGH: Duration = Duration::from_millis(500);

/// Radii in cells.
const RADII: [u32; 4] = [4, 16, 64, 256];

fn main() -> Result<(), Box<dyn Error>> {
    let (sides, names): (Vec<String>, Vec<String>) =
        std::env::args().skip(1).partition(|arg| arg.parse::<u32>().is_ok());
    let side = sides.first().map_or(Ok(1024), |side| side.parse())?;
    println!(
        "{side} x {side} cells, one thread, {} SIMD, {}.\n",
        format!("{:?}", simd::level()).to_uppercase(),
        machine()
    );
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    if names == ["radii"] {
        return Ok(one.install(|| radii(side))?);
    }
    if names == ["layers"] {
        return Ok(one.install(|| layers(side))?);
    }
    if names == ["ice"] {
        return Ok(one.install(|| ice::table(side))?);
    }
    if let Some((_, names)) = names.split_first().filter(|(first, _)| *first == "growth") {
        return Ok(one.install(|| growth(names))?);
    }
    println!("| category | node | ns per cell |\n| --- | --- | ---: |");
    for node in registry().nodes().iter().filter(|node| names.is_empty() || names.iter().any(|name| name == node.id)) {
        let case = example(node);
        let window = Window::whole(world(side));
        let values = inputs(&case, window);
        let mean = one.install(|| mean(&case, &values, window))?;
        println!("| {} | {} | {:.2} |", node.category, node.id, mean / window.len() as f64);
    }
    Ok(())
}

/// Times of nodes with a radius, at several radii in cells.
fn radii(side: u32) -> Result<(), String> {
    println!("| filter | {} |", RADII.map(|cells| format!("{cells} cells")).join(" | "));
    println!("| --- |{}", " ---: |".repeat(RADII.len()));
    let window = Window::whole(world(side));
    for filter in REACHING {
        print!("| {} |", filter.0);
        for cells in RADII {
            let case = reaching(filter, f64::from(cells) * window.cell_m());
            print!(" {:.1} |", mean(&case, &inputs(&case, window), window)? / window.len() as f64);
        }
        println!();
    }
    Ok(())
}

/// Numbers of layers of nearly equal rock.
const LAYERS: [u32; 3] = [0, 8, 200];
/// Rounds in turn over the numbers of layers, of which the medians are shown.
const ROUNDS: usize = 5;

/// Times of nodes that read layers of rock: without layers, and how much longer with some.
fn layers(side: u32) -> Result<(), String> {
    println!("| node | without, ns per cell | 8 layers | 200 layers, against 8 |\n| --- | ---: | ---: | ---: |");
    let window = Window::whole(world(side));
    for node in registry().nodes().iter().filter(|node| node.input("strata").is_some()) {
        let cases = LAYERS.map(|layers| layered(node, layers));
        let values = cases.each_ref().map(|case| inputs(case, window));
        let mut rounds = LAYERS.map(|_| Vec::new());
        for _ in 0..ROUNDS {
            for ((case, values), times) in cases.iter().zip(&values).zip(&mut rounds) {
                times.push(mean(case, values, window)? / window.len() as f64);
            }
        }
        let [without, few, many] = rounds.map(|mut times| {
            times.sort_by(f64::total_cmp);
            times[ROUNDS / 2]
        });
        let more = |times: f64, base: f64| (times / base - 1.0) * 100.0;
        println!("| {} | {without:.0} | {:+.1} % | {:+.1} % |", node.id, more(few, without), more(many, few));
    }
    Ok(())
}

/// Sides in cells of the table of growth.
const SIDES: [u32; 4] = [512, 1024, 2048, 4096];

/// Times of nodes on the same world in more and more cells.
fn growth(names: &[String]) -> Result<(), String> {
    let registry = registry();
    if let Some(unknown) = names.iter().find(|name| registry.get(name).is_none()) {
        return Err(format!("no node is named {unknown}"));
    }
    if names.is_empty() {
        return Err("name the nodes".to_owned());
    }
    println!("| node | {} | 4096 over 512 |", SIDES.map(|side| format!("{side}")).join(" | "));
    println!("| --- |{}", " ---: |".repeat(SIDES.len() + 1));
    for node in registry.nodes().iter().filter(|node| names.iter().any(|name| name == node.id)) {
        let case = example(node);
        let mut times = Vec::new();
        for side in SIDES {
            let window = Window::whole(world(side));
            times.push(mean(&case, &inputs(&case, window), window)? / window.len() as f64);
        }
        let texts: Vec<String> = times.iter().map(|ns| format!("{ns:.0}")).collect();
        println!("| {} | {} | {:.2} |", node.id, texts.join(" | "), times[SIDES.len() - 1] / times[0]);
    }
    Ok(())
}

/// Nanoseconds of this thread: processor time if the system reports it, otherwise the time since `begun`.
fn thread_ns(begun: Instant) -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let processor = told.split(' ').next().and_then(|ns| ns.parse().ok());
    processor.unwrap_or_else(|| begun.elapsed().as_secs_f64() * 1e9)
}

/// The mean time of the runs of a kernel, in nanoseconds.
fn mean(case: &Case, values: &[InputValue], window: Window) -> Result<f64, String> {
    let node = case.kind();
    let (begun, mut runs) = (Instant::now(), 0_u32);
    let start = thread_ns(begun);
    while runs == 0 || begun.elapsed() < ENOUGH {
        let job = case.job(values.to_vec(), window);
        (node.cpu)(&job).map_err(|error| format!("{}: {error}", node.id))?;
        runs += 1;
    }
    Ok((thread_ns(begun) - start) / f64::from(runs))
}

/// The name of the processor, if the system reports it.
fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name =
        info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':')).map(|(_, name)| name.trim());
    name.map_or_else(|| std::env::consts::ARCH.to_owned(), str::to_owned)
}
