//! What a step of `Glacial` costs per cell of its ice grid, beside copying the state that it reads and writes.

use std::{hint::black_box, time::Instant};

use orograph_graph::{Document, Sizing, Value, Wanted, Window, World};
use orograph_nodes::registry;
use orograph_tests::{Case, data_folder, inputs};

/// Side of the world and of an ice cell, in metres.
const WORLD_M: f64 = 60_000.0;
const ICE_CELL_M: f64 = 75.0;

/// Bytes of an ice cell that a step changes: its thickness in double precision and the fluxes through two faces.
const STATE: usize = 24;

/// Mountains of 2 km, of which ice covers the highest parts.
fn glacier(method: &str) -> Case {
    let source = format!(
        r#"(
            nodes: {{
                "base": Ridged(wavelength: "15 km", octaves: 10, amplitude: "2 km"),
                "node": Glacial(version: 2, method: {method}, height: "base", ela: 1500, duration: "100 kyr", ice_cell: {ICE_CELL_M}),
            }},
            outputs: {{ "node": "node" }},
        )"#
    );
    let graph = Document::parse(source, &registry()).graph().clone();
    let node = graph.find("node").expect("just written");
    Case { name: method.to_owned(), graph, node }
}

/// Prints the table.
pub fn table(side: u32) -> Result<(), String> {
    let world = World { size: [WORLD_M; 2], cells: [side; 2], ..World::default() };
    let window = Window::whole(world);
    let ice_cells = (WORLD_M / ICE_CELL_M) * (WORLD_M / ICE_CELL_M);
    // the rasters of one output do not hide what the ice needs
    let on_ice = World { cells: [(WORLD_M / ICE_CELL_M) as u32; 2], ..world };
    println!("| method | s | steps of the ice | ns per ice cell and step | copies of the state | bytes per ice cell |");
    println!("| --- | ---: | ---: | ---: | ---: | ---: |");
    let copy = copied(ice_cells as usize);
    for method in ["full", "fast"] {
        let case = glacier(method);
        let values = inputs(&case, window);
        let begun = Instant::now();
        let start = super::thread_ns(begun);
        let job = case.job(values, window);
        let mut outputs = (case.kind().cpu)(&job).map_err(|error| error.to_string())?;
        let ns = super::thread_ns(begun) - start;
        let report = outputs.take("report");
        let steps = report.as_ref().and_then(Value::as_report).and_then(|report| report.get("ice_steps"));
        let params = &case.graph.instance(case.node).params;
        let wired: Vec<bool> = case.kind().inputs.iter().map(|input| input.name == "height").collect();
        let (window, wanted) = (Window::whole(on_ice), Wanted::NONE.with(0));
        let sizing = Sizing { params, window, wired: &wired, wanted, folder: &data_folder() };
        let bytes = 4.0 + case.kind().scratch.bytes(&sizing) as f64 / ice_cells;
        let of_step = steps.filter(|steps| *steps > 0.0).map(|steps| ns / steps / ice_cells);
        let text = |value: Option<f64>, digits: usize| value.map_or("".to_owned(), |value| format!("{value:.digits$}"));
        println!(
            "| {method} | {:.1} | {} | {} | {} | {bytes:.0} |",
            1e-9 * ns,
            text(steps, 0),
            text(of_step, 1),
            text(of_step.map(|ns| ns / copy), 1),
        );
    }
    Ok(())
}

/// Nanoseconds per cell to read and write the state of this many cells: the median of eleven copies.
fn copied(cells: usize) -> f64 {
    let (from, mut to) = (vec![1_u8; STATE * cells], vec![0_u8; STATE * cells]);
    let mut times: Vec<f64> = (0..11)
        .map(|_| {
            let begun = Instant::now();
            let start = super::thread_ns(begun);
            black_box(&mut to).copy_from_slice(black_box(&from));
            (super::thread_ns(begun) - start) / cells as f64
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
