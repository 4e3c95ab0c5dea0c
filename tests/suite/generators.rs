//! Measures of the terrain that generators make with their defaults: slopes, spectrum, directions, and no closed
//! depressions where `Drain` follows.

use orograph::report::measure::measure;
use orograph_graph::{Cancel, Document};
use orograph_nodes::registry;
use orograph_tests::{relief, root};

/// Noises that stand for mountains or hills: node, parameters, and the limits of the spectral exponent. Real mountains
/// have 3.2 to 4.2; kinds with smooth valleys have more.
const NOISES: [(&str, &str, [f64; 2]); 12] = [
    ("Perlin", "", [3.4, 4.4]),
    ("Noise", "", [2.9, 3.8]),
    ("Ridged", "", [3.5, 4.4]),
    ("Spectral", "", [3.3, 4.2]),
    ("Diffused", "", [3.4, 4.4]),
    ("Fractal", "kind: billow", [3.0, 4.0]),
    ("Fractal", "kind: eroded", [3.6, 4.6]),
    ("Fractal", "kind: blend", [3.7, 4.7]),
    ("Fractal", "kind: heterogeneous", [3.8, 4.8]),
    ("Fractal", "kind: swiss", [4.0, 5.0]),
    ("Fractal", "kind: hybrid", [4.5, 5.5]),
    ("Fractal", "kind: jordan", [4.1, 5.1]),
];

/// Slopes have no preferred directions, are no steeper than those of real mountains, and hills no smoother.
#[test]
fn noise_has_slopes_of_all_directions_and_drains_behind_a_drain() {
    let registry = registry();
    let node = |id: &str, arguments: &str| registry.get(id).expect("a node").written(arguments);
    let mut faults = Vec::new();
    for (id, arguments, beta) in NOISES {
        let text = format!(
            "(world: (size: \"25.6 km\", cells: 256, seed: 3, boundary: inland), nodes: {{ \"raw\": {}, \"drained\": {} }}, \
             outputs: {{ \"raw\": \"raw\", \"drained\": \"drained\" }})",
            node(id, arguments),
            node("Drain", "height: \"raw\""),
        );
        let document = Document::parse(text, &registry);
        let lands = relief::built_outputs(&document, &root(), 256, ["raw", "drained"]).expect("two rasters");
        let [raw, drained] = lands.map(|land| measure(&land, &registry, &Cancel::default()).expect("measures"));
        let name = format!("{id} {arguments}");
        println!(
            "{name}: beta {:.2}, pits {:.3}",
            raw.get("spectrum.beta").expect("one"),
            raw.get("pits.share").expect("one")
        );
        let fold = 0.05;
        for (report, measure, least, most) in [
            (&raw, "spectrum.beta", beta[0], beta[1]),
            (&raw, "slope.p95", 12.0, 48.0),
            (&raw, "aspect.four_fold", -fold, fold),
            (&raw, "aspect.eight_fold", -fold, fold),
            // real terrain has at most a twentieth of its cells in closed depressions
            (&raw, "pits.share", 0.1, 0.4),
            (&drained, "pits.share", 0.0, 0.001),
            (&drained, "aspect.eight_fold", -fold, fold),
        ] {
            let value = report.get(measure).expect("a measure");
            if !(least..=most).contains(&value) {
                faults.push(format!("{name}: {measure} is {value:.3}, not in {least} to {most}"));
            }
        }
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}
