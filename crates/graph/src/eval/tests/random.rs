//! Values of random graphs do not depend on windows, number of threads or state of the caches.

use proptest::prelude::*;

use super::*;

const SIDE: u32 = 24;

/// A node of one of four kinds, wired to two of those before it, with a parameter.
type Part = (usize, prop::sample::Index, prop::sample::Index, f64);

fn graph(parts: &[Part]) -> Graph {
    let mut build = Build::default().node("n0", &WAVES, &[]);
    for (at, (kind, first, second, number)) in parts.iter().enumerate() {
        let name = format!("n{}", at + 1);
        let [first, second] = [first, second].map(|index| format!("n{}", index.index(at + 1)));
        build = match kind {
            0 => build.node(&name, &WAVES, &[]).set(&name, "level", ParamValue::Float(*number)),
            1 => build.node(&name, &ADD, &[("height", &first), ("other", &second)]),
            2 => build.node(&name, &BLUR, &[("height", &first)]).set(&name, "radius", ParamValue::Float(*number)),
            _ => build.node(&name, &ANOMALY, &[("height", &first)]),
        };
    }
    build.0
}

fn window() -> impl Strategy<Value = Window> {
    let side = || (0..SIDE).prop_flat_map(|origin| (Just(origin), 1..=SIDE - origin));
    (side(), side()).prop_map(|((x, nx), (y, ny))| Window {
        origin: [x, y],
        cells: [nx, ny],
        ..Window::whole(world(SIDE))
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn parts_equal_the_parts_of_the_whole(
        parts in prop::collection::vec((0..4usize, any::<prop::sample::Index>(), any::<prop::sample::Index>(), 0.0..6.0), 1..12),
        requests in prop::collection::vec((any::<prop::sample::Index>(), window()), 1..4),
        threads in 1..4usize,
    ) {
        let graph = graph(&parts);
        let port = |index: &prop::sample::Index| {
            graph.port(&format!("n{}", index.index(parts.len() + 1))).expect("exists")
        };
        let requests: Vec<(Port, Window)> = requests.iter().map(|(at, window)| (port(at), *window)).collect();
        let whole = Window::whole(world(SIDE));
        let wholes: Vec<(Port, Window)> = requests.iter().map(|(port, _)| (*port, whole)).collect();
        let expected = run_requests(&evaluator(1), &graph, &wholes).expect("runs").values;

        let evaluator = evaluator(threads);
        for round in 0..2 {
            let got = run_requests(&evaluator, &graph, &requests).expect("runs").values;
            for ((got, all), (_, window)) in got.iter().zip(&expected).zip(&requests) {
                prop_assert_eq!(got.as_field(), Some(&all.as_field().expect("a field").crop(window)), "round {}", round);
            }
        }
        // one by one, with a cache filled for other windows
        for ((port, window), all) in requests.iter().zip(&expected) {
            let got = run_requests(&evaluator, &graph, &[(*port, *window)]).expect("runs").values.remove(0);
            prop_assert_eq!(got.as_field(), Some(&all.as_field().expect("a field").crop(window)));
        }
    }

    #[test]
    fn bands_make_up_what_is_built_at_once(
        parts in prop::collection::vec((0..4usize, any::<prop::sample::Index>(), any::<prop::sample::Index>(), 0.0..6.0), 1..12),
        ends in prop::collection::vec((any::<prop::sample::Index>(), any::<bool>()), 1..5),
        window in window(),
        band_cells in 1..400u32,
        threads in 1..4usize,
        warm in any::<bool>(),
    ) {
        let graph = graph(&parts);
        let port = |index: &prop::sample::Index| {
            graph.port(&format!("n{}", index.index(parts.len() + 1))).expect("exists")
        };
        let requests: Vec<Request> = ends.iter().map(|(at, _)| Request { port: port(at), window }).collect();
        let evaluation = Evaluation { graph: &graph, folder: Path::new(""), requests: &requests, byproducts: &[] };
        let cancel = Cancel::default();
        let expected = evaluator(1).evaluate(&evaluation, &cancel, &|_| {});
        let evaluator = evaluator(threads);
        if warm {
            let one = Evaluation { requests: &requests[..1], ..evaluation };
            evaluator.evaluate(&one, &cancel, &|_| {});
        }
        let streamed: Vec<bool> = ends.iter().map(|(_, streamed)| *streamed).collect();
        let given: Mutex<Vec<Vec<Field>>> = Mutex::new(vec![Vec::new(); requests.len()]);
        evaluator.build_in_stages(&evaluation, &window, &streamed, band_cells, &cancel, &|_| {}, &|request, delivery| {
            let value = delivery.expect("built").value;
            given.lock().expect("no panic")[request].push(value.as_field().expect("a field").clone());
        });
        for ((bands, expected), streamed) in given.into_inner().expect("no panic").iter().zip(&expected).zip(&streamed) {
            let expected = expected.as_ref().expect("built").as_field().expect("a field");
            prop_assert!(!bands.is_empty() && (*streamed || bands.len() == 1));
            let mut row = window.origin[1];
            for band in bands {
                prop_assert_eq!(band.window().origin[1], row);
                prop_assert_eq!(band, &expected.crop(band.window()));
                row += band.window().cells[1];
            }
            prop_assert_eq!(row, window.origin[1] + window.cells[1]);
        }
    }
}
