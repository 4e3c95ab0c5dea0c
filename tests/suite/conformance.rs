//! Every node, whatever it does: its declaration is sound, it runs at its extremes, its bytes do not depend on threads or
//! SIMD width, a window of it is a window of the whole, and another resolution is the same land.

use orograph_graph::{EvalError, Exactness, Field, Node, Resolution, Value, Window};
use orograph_nodes::{registry, simd};
use orograph_tests::{Case, cases, evaluate, evaluate_window, example, world};

/// Calls a check for every node and collects what it finds, so that one faulty node does not hide another.
fn for_every_node(check: impl Fn(&'static Node) -> Result<(), String>) {
    let found: Vec<String> = registry()
        .nodes()
        .iter()
        .filter_map(|node| check(node).err().map(|what| format!("{}: {what}", node.id)))
        .collect();
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

fn run(case: &Case, cells: u32, threads: usize) -> Result<Vec<Value>, String> {
    evaluate(case, world(cells), threads).map_err(|error| format!("{}: {error}", case.name))
}

#[test]
fn every_declaration_is_sound() {
    assert_eq!(registry().faults(), Vec::<String>::new());
}

#[test]
fn every_node_runs_at_its_extremes_or_refuses_with_a_remedy() {
    for_every_node(|node| {
        for case in cases(node) {
            match evaluate(&case, world(48), 2) {
                Ok(values) => assert_eq!(values.len(), node.outputs.len()),
                // a combination that makes no sense may be refused, but not without saying what would help
                Err(EvalError::Node { hint: Some(_), .. }) if case.name != "example" => {}
                Err(error) => return Err(format!("{}: {error}", case.name)),
            }
        }
        Ok(())
    });
}

#[test]
fn equal_bytes_on_one_and_several_threads_and_twice() {
    for_every_node(|node| {
        if node.exactness != Exactness::Exact {
            return Ok(());
        }
        let case = example(node);
        let once = run(&case, 96, 1)?;
        for (what, threads) in [("one thread again", 1), ("3 threads", 3), ("3 threads again", 3)] {
            if run(&case, 96, threads)? != once {
                return Err(format!("other bytes on {what}"));
            }
        }
        Ok(())
    });
}

#[test]
fn equal_bytes_at_every_simd_width() {
    for_every_node(|node| {
        if node.exactness != Exactness::Exact {
            return Ok(());
        }
        // 83 cells: no row is a multiple of a vector
        for case in [example(node)] {
            let widest = run(&case, 83, 2)?;
            for level in [simd::Level::Baseline, simd::Level::Avx2] {
                simd::limit(level);
                let narrower = run(&case, 83, 2);
                simd::limit(simd::Level::Avx512);
                if narrower? != widest {
                    return Err(format!("{}: other bytes at {level:?}", case.name));
                }
            }
        }
        Ok(())
    });
}

#[test]
fn a_window_with_its_halo_equals_the_window_of_the_whole() {
    for_every_node(|node| {
        let case = example(node);
        let whole = run(&case, 96, 2)?;
        let inside = Window { origin: [31, 22], cells: [40, 33], ..Window::whole(world(96)) };
        let corner = Window { origin: [0, 60], cells: [17, 36], ..Window::whole(world(96)) };
        for window in [inside, corner] {
            let part = evaluate_window(&case, window, 2).map_err(|error| error.to_string())?;
            for ((whole, part), output) in whole.iter().zip(&part).zip(node.outputs) {
                if let (Some(whole), Some(part)) = (whole.as_field(), part.as_field())
                    && whole.crop(&window) != *part
                {
                    return Err(format!("`{}` differs in the window at {:?}", output.name, window.origin));
                }
            }
        }
        Ok(())
    });
}

#[test]
fn another_resolution_is_the_same_land() {
    for_every_node(|node| {
        let Resolution::Within(tolerance) = node.resolution else { return Ok(()) };
        let case = example(node);
        let (coarse, fine) = (run(&case, 128, 2)?, run(&case, 256, 2)?);
        for ((coarse, fine), output) in coarse.iter().zip(&fine).zip(node.outputs) {
            if let (Some(coarse), Some(fine)) = (coarse.as_field(), fine.as_field()) {
                let difference = relative_difference(coarse, &halved(fine));
                if difference > f64::from(tolerance) {
                    return Err(format!(
                        "`{}` differs by {difference:.3} of its spread, declared {tolerance}",
                        output.name
                    ));
                }
            }
        }
        Ok(())
    });
}

/// The mean of each 2 x 2 cells.
fn halved(fine: &Field) -> Vec<f32> {
    let (nx, ny, planes) = (fine.window().nx(), fine.window().ny(), fine.planes());
    let mut out = Vec::with_capacity(fine.samples().len() / 4);
    for plane in (0..planes).map(|plane| fine.plane(plane)) {
        for j in (0..ny).step_by(2) {
            for i in (0..nx).step_by(2) {
                let at = |i: usize, j: usize| f64::from(plane[j * nx + i]);
                out.push((0.25 * (at(i, j) + at(i + 1, j) + at(i, j + 1) + at(i + 1, j + 1))) as f32);
            }
        }
    }
    out
}

fn square(x: f64) -> f64 {
    x * x
}

/// Root mean square of the difference over the standard deviation.
fn relative_difference(coarse: &Field, fine: &[f32]) -> f64 {
    let count = fine.len() as f64;
    let mean = fine.iter().map(|v| f64::from(*v)).sum::<f64>() / count;
    let variance = fine.iter().map(|v| square(f64::from(*v) - mean)).sum::<f64>() / count;
    let error =
        coarse.samples().iter().zip(fine).map(|(a, b)| square(f64::from(*a) - f64::from(*b))).sum::<f64>() / count;
    // a field that is the same everywhere has no spread to compare with
    if variance > 0.0 { (error / variance).sqrt() } else { error.sqrt() }
}
