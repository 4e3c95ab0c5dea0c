//! Test terrain, defined by a formula in world coordinates, so that it is the same at every resolution, in every
//! window, and independent of the nodes under test.

use orograph_graph::{Field, Job, Node, NodeError, Output, Outputs, PortType, World, mix};
use orograph_nodes::numerics::math;

/// A world of 16 km per side with base level on all sides.
#[must_use]
pub fn world(cells: u32) -> World {
    World { size: [16_384.0, 16_384.0], cells: [cells, cells], seed: 7, ..World::default() }
}

/// Hills with wavelengths from 9 km down to 600 m, about 1500 m of relief, and closed depressions.
pub static LAND: Node = Node {
    id: "TestLand",
    category: "test",
    summary: "Hills by a formula.",
    doc: "Test input.",
    outputs: &[Output::gives("height", PortType::Height, "Elevation.")],
    cpu: |job| Ok(Outputs::one("height", surface(job, |h| 900.0 + 450.0 * h)?)),
    ..Node::DEFAULT
};

/// A smooth mask that reaches both 0 and 1.
pub static SELECTION: Node = Node {
    id: "TestSelection",
    category: "test",
    summary: "A selection by a formula.",
    doc: "Test input.",
    outputs: &[Output::gives("mask", PortType::Mask, "Selection.")],
    cpu: |job| Ok(Outputs::one("mask", surface(job, |h| (0.5 + 0.5 * h).clamp(0.0, 1.0))?)),
    ..Node::DEFAULT
};

/// Sums plane waves of decreasing amplitude, rotated by the golden angle, with phases derived from the node's kind.
#[expect(clippy::unnecessary_wraps, reason = "the shape of a kernel's own functions")]
fn surface(job: &Job<'_>, map: impl Fn(f64) -> f64) -> Result<Field, NodeError> {
    const WAVES: u32 = 12;
    let waves: Vec<[f64; 4]> = (0..WAVES)
        .map(|k| {
            let wavelength_m = 9000.0 * math::pow(0.78, f64::from(k));
            let azimuth = 2.399_963 * f64::from(k);
            let number = std::f64::consts::TAU / wavelength_m;
            let phase = f64::from(mix(k + job.node.id.len() as u32)) * 1e-9;
            [number * math::cos(azimuth), number * math::sin(azimuth), phase, math::pow(0.62, f64::from(k))]
        })
        .collect();
    let window = job.window();
    let mut samples = Vec::with_capacity(window.len());
    for j in 0..window.ny() {
        for i in 0..window.nx() {
            let [x, y] = window.centre_m(i, j);
            let height: f64 = waves.iter().map(|[kx, ky, phase, a]| a * math::sin(kx * x + ky * y + phase)).sum();
            samples.push(map(height) as f32);
        }
    }
    Ok(Field::new(window, samples))
}
