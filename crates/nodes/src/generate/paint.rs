//! Terrain painted by hand with brush strokes.

use orograph_graph::{
    Strokes, Tool,
    memory::{copied, zeroed},
};

use crate::{
    numerics::{
        gaussian::Gaussian,
        lines::separable,
        strokes::{Path, act},
    },
    prelude::*,
};

/// Standard deviation of the smoothing Gaussian as a fraction of the brush radius: features narrower than the brush are
/// smoothed.
const SMOOTHING: f64 = 1.0 / 3.0;

params! {
    /// Strokes, in the order in which they were painted.
    ///
    /// A stroke has a `tool` (`raise`, `lower`, `smooth`, `mask` or `erase`), a `radius` in metres, a `strength`
    /// (metres for `raise` and `lower`, default 10; a fraction for the others, default 1), a `hardness` (the fraction
    /// of the radius within which it acts fully, default 0.5) and `points`.
    strokes: Strokes = Strokes(Vec::new()), Metres, -1e7..=1e7;
}

inputs! {
    /// Terrain to paint on; a plain at 0 m if not wired.
    height: Option<Height>;
}

outputs! {
    /// Terrain with the strokes applied.
    height: Height;
    /// Mask painted with `mask` and `erase`; 0 elsewhere.
    mask: Mask;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Paint",
    category: "generate",
    summary: "Terrain raised, lowered and smoothed by hand, and a mask painted by hand.",
    doc: include_str!("paint.md"),
    sources: &[
        "E. Catmull and R. Rom (1974), A class of local interpolating splines, Computer Aided Geometric Design, 317-326",
        "C. Yuksel, S. Schaefer and J. Keyser (2011), Parameterization and applications of Catmull-Rom curves, Computer-Aided \
         Design 43, 747-755",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|params, cell_m| {
        let smooth = Params::read(params).strokes.0.into_iter().filter(|stroke| stroke.tool == Tool::Smooth);
        smooth.map(|stroke| Gaussian::reach_m(SMOOTHING * stroke.radius, cell_m)).sum()
    }),
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    example: "height: \"base\", strokes: [\
              (tool: raise, radius: 900, strength: 600, points: [(1500, 6500), (3500, 5000), (4500, 2500), (6800, 1800)]), \
              (tool: lower, radius: 500, strength: 400, hardness: 0.2, points: [(6500, 6500), (4800, 5200)]), \
              (tool: smooth, radius: 900, points: [(1500, 1500), (2500, 2500)]), \
              (tool: mask, radius: 1200, hardness: 0.7, points: [(2500, 4500), (5500, 3500)]), \
              (tool: erase, radius: 400, points: [(3200, 4800), (3600, 3200)])]",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let strokes = Params::read(sizing.params).strokes.0;
    let smooths = Wants::among(sizing.wanted).height && strokes.iter().any(|stroke| stroke.tool == Tool::Smooth);
    // the smoothed terrain and its weight
    if smooths { sizing.cells(8.0) } else { 0 }
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let strokes = Params::read(job.params).strokes.0;
    let paths: Vec<Path> = strokes.iter().map(|stroke| Path::new(stroke, job.world())).collect();
    let (marks, works): (Vec<&Path>, Vec<&Path>) =
        paths.iter().partition(|path| matches!(path.tool, Tool::Mask | Tool::Erase));
    let wants = Wants::of(job);
    let marked = || {
        let mut mask = zeroed(job.window().len())?;
        act(job, [0.0, 0.2], &marks, &mut mask, |path, value, weight| match path.tool {
            Tool::Mask => value + (1.0 - value) * weight,
            _ => value - value * weight,
        })
        .map(|()| Field::new(job.window(), mask))
    };
    let mask = wants.mask.then(marked).transpose()?;
    if !wants.height {
        return Ok(Given { mask, ..Given::default() }.into());
    }
    let mut height = match Inputs::read(job)?.height {
        Some(land) => copied(land.samples())?,
        None => zeroed(job.window().len())?,
    };
    // consecutive strokes that do not smooth need one pass over the terrain
    let runs: Vec<&[&Path]> = works.chunk_by(|a, b| a.tool != Tool::Smooth && b.tool != Tool::Smooth).collect();
    for (at, run) in runs.iter().enumerate() {
        let part = |k: usize| 0.2 + 0.8 * (at * 2 + k) as f32 / (runs.len() * 2) as f32;
        match run {
            [path] if path.tool == Tool::Smooth => {
                let filter = Gaussian::new(SMOOTHING * path.radius_m / job.cell_m());
                let smooth = separable(job, [part(0), part(1)], &height, &filter)?;
                let mut weights = vec![0.0; height.len()];
                act(job, [part(1), part(2)], run, &mut weights, |_, _, weight| weight)?;
                for ((height, smooth), weight) in height.iter_mut().zip(&smooth).zip(&weights) {
                    *height += (smooth - *height) * weight;
                }
            }
            run => act(job, [part(0), part(2)], run, &mut height, |path, value, weight| match path.tool {
                Tool::Raise => value + weight,
                _ => value - weight,
            })?,
        }
    }
    Ok(Given { height: Some(Field::new(job.window(), height)), mask }.into())
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge, ParamValue, Stroke, Window, World};

    use super::*;
    use crate::numerics::math::smoothstep;
    use crate::numerics::{along::distance, strokes::curve};
    use crate::testing::{at_every_level, field, outputs_on, reach_m, run as result, run_in, with_params, world};

    fn stroke(tool: Tool, radius: f64, strength: f64, points: &[[f64; 2]]) -> Stroke {
        Stroke { tool, radius, strength, hardness: 0.5, time: 0.0, points: points.to_vec() }
    }

    fn params(strokes: &[Stroke]) -> ParamValues {
        let mut params = with_params(&NODE, "");
        params.set("strokes", ParamValue::Strokes(strokes.to_vec()));
        params
    }

    fn painted(world: World, strokes: &[Stroke], name: &str) -> Field {
        let mut outputs = outputs_on(Window::whole(world), &NODE, &params(strokes), &[]).expect("a result");
        outputs.take(name).expect("an output").as_field().expect("a field").clone()
    }

    #[test]
    fn a_dot_is_round_and_as_high_as_it_says() {
        let dot = [stroke(Tool::Raise, 300.0, 40.0, &[[500.0, 600.0]])];
        let land = painted(world(100, 120, 10.0), &dot, "height");
        for (at, height) in land.samples().iter().enumerate() {
            let [x, y] = land.window().centre_m(at % 100, at / 100);
            let part = distance([x, y], [500.0, 600.0]) / 300.0;
            let weight = if part < 1.0 { 1.0 - smoothstep(((part - 0.5) / 0.5).max(0.0)) } else { 0.0 };
            assert!((f64::from(*height) - 40.0 * weight).abs() < 1e-5, "{x} {y}: {height}");
        }
    }

    #[test]
    fn a_straight_stroke_is_level_along_its_middle_however_many_points_it_has() {
        let few = [[100.0, 500.0], [900.0, 500.0]];
        let many: Vec<[f64; 2]> = (0..=400).map(|k| [100.0 + 2.0 * f64::from(k), 500.0]).collect();
        let [few, many] = [&few[..], &many]
            .map(|points| painted(world(100, 100, 10.0), &[stroke(Tool::Lower, 50.0, 7.0, points)], "height"));
        for (a, b) in few.samples().iter().zip(many.samples()) {
            assert!((a - b).abs() < 1e-5, "{a} {b}");
        }
        assert!((10..90).all(|i| few.samples()[50 * 100 + i] == -7.0));
    }

    #[test]
    fn a_curve_goes_through_its_points_and_does_not_overshoot() {
        let points = [[0.0, 0.0], [100.0, 0.0], [100.0, 100.0], [101.0, 100.0], [300.0, 100.0]];
        let corners = curve(&points, 4.0);
        assert!(points.iter().all(|point| corners.contains(point)));
        // the bounding box of the control polygon, extended by a tenth of the longest side
        assert!(corners.iter().all(|[x, y]| (-1.0..=300.0).contains(x) && (-20.0..=120.0).contains(y)), "{corners:?}");
        assert_eq!(curve(&[[3.0, 4.0]; 3], 4.0), [[3.0, 4.0]]);
        // points of a circle give the circle: a straight segment of 45 degrees would be 7.6 m of 100 m off
        let circle: Vec<[f64; 2]> = (0..=8)
            .map(|k| f64::from(k) * std::f64::consts::FRAC_PI_4)
            .map(|angle| [100.0 * libm::cos(angle), 100.0 * libm::sin(angle)])
            .collect();
        let inner = &curve(&circle, 4.0)[32..=6 * 32];
        assert!(inner.iter().all(|place| (distance(*place, [0.0; 2]) - 100.0).abs() < 1.0));
    }

    #[test]
    fn the_order_counts_and_a_mask_stays_one() {
        let world = world(60, 60, 10.0);
        let middle = |tool, strength| stroke(tool, 100.0, strength, &[[305.0, 305.0]]);
        let at = |field: &Field| field.samples()[30 * 60 + 30];
        let mask = |strokes: &[Stroke]| at(&painted(world, strokes, "mask"));
        assert_eq!(mask(&[middle(Tool::Mask, 0.5), middle(Tool::Mask, 0.5)]), 0.75);
        assert_eq!(mask(&[middle(Tool::Mask, 0.5), middle(Tool::Erase, 1.0)]), 0.0);
        assert_eq!(mask(&[middle(Tool::Erase, 1.0), middle(Tool::Mask, 0.5)]), 0.5);
        let height = |strokes: &[Stroke]| at(&painted(world, strokes, "height"));
        let (raise, smooth) = (middle(Tool::Raise, 40.0), middle(Tool::Smooth, 1.0));
        assert_eq!(height(&[raise.clone(), raise.clone()]), 80.0);
        assert_eq!(height(&[smooth.clone(), raise.clone()]), 40.0);
        let smoothed = height(&[raise, smooth]);
        assert!((10.0..39.9).contains(&smoothed), "{smoothed}");
    }

    #[test]
    fn a_periodic_world_is_painted_across_its_edges() {
        let world = World { boundary: Boundary::all(Edge::Periodic), ..world(64, 64, 10.0) };
        let line =
            |dx: f64, dy: f64| [stroke(Tool::Raise, 90.0, 9.0, &[[300.0 + dx, 300.0 + dy], [400.0 + dx, 310.0 + dy]])];
        let (still, moved) = (painted(world, &line(0.0, 0.0), "height"), painted(world, &line(320.0, 320.0), "height"));
        for at in 0..64 * 64 {
            let (i, j) = (at % 64, at / 64);
            let there = (j + 32) % 64 * 64 + (i + 32) % 64;
            assert!((still.samples()[at] - moved.samples()[there]).abs() < 1e-5);
        }
    }

    #[test]
    fn the_same_land_at_every_number_of_cells() {
        let strokes = [
            stroke(Tool::Raise, 200.0, 60.0, &[[150.0, 800.0], [500.0, 500.0], [850.0, 200.0]]),
            stroke(Tool::Smooth, 150.0, 0.8, &[[500.0, 500.0], [850.0, 200.0]]),
        ];
        let (coarse, fine) =
            (painted(world(100, 100, 10.0), &strokes, "height"), painted(world(200, 200, 5.0), &strokes, "height"));
        for at in 0..100 * 100 {
            let (i, j) = (at % 100, at / 100);
            let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(a, b)| fine.samples()[(2 * j + b) * 200 + 2 * i + a]);
            let mean = four.iter().sum::<f32>() / 4.0;
            // 60 m of height that fall over 100 m curve by 0.14 m within a cell, and the filter adds a little; the
            // curve is straight, since a bend sharper than the brush makes a crease
            assert!((coarse.samples()[at] - mean).abs() < 0.2, "{i} {j}: {} {mean}", coarse.samples()[at]);
        }
    }

    #[test]
    fn windows_threads_and_widths_of_vectors_give_the_same_bits() {
        let hills = field(world(211, 190, 5.0), |x, y| 300.0 * libm::sin(x * 0.05 + y * 0.02) * libm::cos(y * 0.3));
        let strokes = [
            stroke(Tool::Raise, 80.0, 60.0, &[[150.0, 300.0], [500.0, 500.0], [700.0, 850.0]]),
            stroke(Tool::Smooth, 60.0, 0.8, &[[400.0, 400.0], [700.0, 450.0]]),
            stroke(Tool::Mask, 60.0, 0.8, &[[400.0, 400.0]]),
            stroke(Tool::Smooth, 30.0, 1.0, &[[500.0, 300.0], [500.0, 600.0]]),
        ];
        let params = params(&strokes);
        let whole = result(&NODE, &params, &[("height", &hills)], "height");
        let part = Window { origin: [83, 77], cells: [60, 50], ..*hills.window() };
        let grown = hills.crop(&part.grown(reach_m(&NODE, &params, 5.0)));
        assert!(!grown.window().is_whole());
        assert_eq!(result(&NODE, &params, &[("height", &grown)], "height").crop(&part), whole.crop(&part));
        assert_eq!(run_in(1, &NODE, &params, &[("height", &hills)]), run_in(3, &NODE, &params, &[("height", &hills)]));
        at_every_level(|| run_in(2, &NODE, &params, &[("height", &hills)]));
    }

    #[test]
    fn extremes_are_cheap_and_finite() {
        let world = world(40, 30, 5.0);
        let far = [[-1e7, -1e7], [1e7, 1e7], [-1e7, 1e7]];
        for (radius, points) in [(0.01, &far[..]), (1e6, &far), (0.01, &[[100.0, 75.0]; 2]), (1e6, &[[0.0; 2]])] {
            for hardness in [0.0, 1.0] {
                let strokes = [Tool::Raise, Tool::Smooth, Tool::Mask]
                    .map(|tool| Stroke { hardness, ..stroke(tool, radius, 1.0, points) });
                for name in ["height", "mask"] {
                    let field = painted(world, &strokes, name);
                    assert!(field.samples().iter().all(|value| (0.0..=1.0).contains(value)), "{radius} {name}");
                }
            }
        }
    }
}
