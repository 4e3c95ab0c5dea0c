//! Helpers for tests of several modules.

use orograph_graph::{Field, Window, World};

/// The field of a function of a cell centre's position in metres.
pub fn field(cells: [u32; 2], cell_m: f64, value: impl Fn(f64, f64) -> f64) -> Field {
    let world = World { size: cells.map(|n| f64::from(n) * cell_m), cells, ..World::default() };
    let window = Window::whole(world);
    let samples = (0..window.len()).map(|at| {
        let [x, y] = window.centre_m(at % window.nx(), at / window.nx());
        value(x, y) as f32
    });
    Field::new(window, samples.collect())
}
