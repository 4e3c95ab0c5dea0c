//! Cuts terrain into steps, as left by layers of rock or by river terraces.

use crate::{
    numerics::{
        cells::{BLOCK, blocks, masked, samples},
        math,
        simd::simd,
    },
    prelude::*,
};

choice! {
    /// Placement of the steps.
    pub enum Steps {
        /// Everywhere, with the height `step`.
        Even = "even",
        /// At the heights of `layers`.
        Layers = "layers",
    }
}

params! {
    /// Placement of the steps.
    steps: Steps = Steps::Even, One, ..;
    /// Height of a step.
    step: f64 = 100.0, Metres, 0.01..=1e5, soft 5..=500, when steps = "even";
    /// How steep risers and how flat treads are: 1 leaves the terrain unchanged, from 8 upwards treads are level.
    sharpness: f64 = 3.0, One, 1.0..=32.0, soft 1..=12, when steps = "even";
    /// Height of each tread above `base`, in ascending order, and the sharpness of the riser that begins there.
    layers: StepPoints = StepPoints(vec![[0.0, 2.0], [200.0, 8.0], [350.0, 4.0], [800.0, 12.0], [950.0, 3.0], [1400.0, 1.0]]), One, .., when steps = "layers";
}

inputs! {
    /// Terrain height.
    height: Height;
    /// A height at which a tread lies, per cell if wired.
    base: Scalar(Metres) = 0.0, -1e6..=1e6, soft -1000.0..=1000.0;
    /// Where terraces are cut: fully at 1, not at all at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// Terraced terrain.
    height: Height;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Terrace",
    category: "filter",
    summary: "Cuts terrain into steps with a height in metres.",
    doc: include_str!("terrace.md"),
    sources: &[
        "F. K. Musgrave, C. E. Kolb and R. S. Mace, 1989, The synthesis and rendering of eroded fractal terrains",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    example: "height: \"base\", step: 400, sharpness: 6",
    ..Node::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { height, base, mask } = Inputs::read(job)?;
    let params = Params::read(job.params);
    let layers = match params.steps {
        Steps::Even => Vec::new(),
        Steps::Layers => layers(&params.layers.0)?,
    };
    let level =
        if layers.is_empty() { params.sharpness == 1.0 } else { layers.iter().all(|layer| layer.sharpness == 1.0) };
    if level {
        return Ok(Given { height: Some(height.clone()) }.into());
    }
    let mut out = height.samples().to_vec();
    blocks(job, [0.0, 1.0], &mut out, |cells, first| {
        let (mut spare_base, mut spare_mask) = ([0.0; BLOCK], [0.0; BLOCK]);
        let base = samples(base, first, cells.len(), &mut spare_base);
        let mask = samples(mask, first, cells.len(), &mut spare_mask);
        if layers.is_empty() {
            cut(cells, base, mask, params.step as f32, params.sharpness as f32);
        } else {
            cut_layers(cells, base, mask, &layers);
        }
    })?;
    Ok(Given { height: Some(Field::new(job.window(), out)) }.into())
}

/// A step between two treads of a table.
#[derive(Clone, Copy, Debug)]
struct Layer {
    tread: f32,
    step: f32,
    sharpness: f32,
}

/// Returns the steps of a table.
fn layers(table: &[[f64; 2]]) -> Result<Vec<Layer>, NodeError> {
    let is_wrong = |[height, sharpness]: &&[f64; 2]| height.abs() > 1e6 || !(1.0..=32.0).contains(sharpness);
    if let Some([height, sharpness]) = table.iter().find(is_wrong) {
        return Err(NodeError::failed_with_hint(
            format!("there is a layer at {height} m with a sharpness of {sharpness}"),
            "give each layer a height within 1000 km and a sharpness from 1 to 32",
        ));
    }
    let layer = |pair: &[[f64; 2]]| Layer {
        tread: pair[0][0] as f32,
        step: ((pair[1][0] - pair[0][0]) as f32).max(f32::MIN_POSITIVE),
        sharpness: pair[0][1] as f32,
    };
    Ok(table.windows(2).map(layer).collect())
}

/// Maps the position `rest` within a step to the new one; both are 0 to 1.
#[inline(always)]
fn riser(rest: f32, sharpness: f32) -> f32 {
    // distance from the nearer tread: 0 there, 1 in the middle of the riser
    let upper = rest > 0.5;
    let near = if upper { 2.0 - 2.0 * rest } else { 2.0 * rest };
    let lift = 0.5 * math::lane::pow(near, sharpness);
    if upper { 1.0 - lift } else { lift }
}

simd! {
    fn cut(heights: &mut [f32], base: &[f32], mask: &[f32], step: f32, sharpness: f32) {
        for ((height, &base), &mask) in heights.iter_mut().zip(base).zip(mask) {
            let u = (*height - base) / step;
            let tread = u.floor();
            *height = masked(*height, base + step * (tread + riser(u - tread, sharpness)), mask);
        }
    }
}

simd! {
    fn cut_layers(heights: &mut [f32], base: &[f32], mask: &[f32], layers: &[Layer]) {
        let last = layers[layers.len() - 1];
        for ((height, &base), &mask) in heights.iter_mut().zip(base).zip(mask) {
            let above = *height - base;
            let mut here = layers[0];
            for layer in layers {
                here = if above >= layer.tread { *layer } else { here };
            }
            let rest = ((above - here.tread) / here.step).clamp(0.0, 1.0);
            let stepped = base + here.tread + here.step * riser(rest, here.sharpness);
            let outside = (above < here.tread) | (above >= last.tread + last.step) | (here.sharpness == 1.0);
            *height = masked(*height, if outside { *height } else { stepped }, mask);
        }
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::ParamValue;

    use super::*;
    use crate::testing::{at_every_level, field, outputs, run as result, run_in, with_params, world};

    #[test]
    fn treads_and_middles_of_risers_stay_and_order_is_kept() {
        let slope = field(world(801, 1, 1.0), |x, _| (x - 0.5) * 0.5 - 100.0); // −100 to 300 m
        let cut = result(&NODE, &with_params(&NODE, "step=50,sharpness=4"), &[("height", &slope)], "height");
        assert!(cut.samples().is_sorted());
        for (before, after) in slope.samples().iter().zip(cut.samples()) {
            if (before / 25.0).fract() == 0.0 {
                assert!((before - after).abs() < 1e-3, "{before} {after}"); // rounding of the power
            }
            assert!((before - after).abs() < 25.0);
        }
        // a quarter of a step up: ½ (½)⁴ of it
        assert!((cut.samples()[225] - 50.0 / 32.0).abs() < 1e-3, "{}", cut.samples()[225]);
    }

    #[test]
    fn nothing_changes_at_sharpness_one_or_without_a_mask() {
        let land = field(world(70, 9, 5.0), |x, y| 900.0 * libm::sin(x * y));
        assert_eq!(result(&NODE, &with_params(&NODE, "sharpness=1"), &[("height", &land)], "height"), land);
        let nowhere = field(world(70, 9, 5.0), |_, _| 0.0);
        assert_eq!(result(&NODE, &with_params(&NODE, ""), &[("height", &land), ("mask", &nowhere)], "height"), land);
    }

    /// Treads of a table are unchanged, as are the middle of each riser and all terrain beyond the table.
    #[test]
    fn layers_lie_where_the_table_says() {
        let slope = field(world(1601, 1, 1.0), |x, _| (x - 0.5) - 200.0); // −200 to 1400 m
        let table = [[0.0, 4.0], [100.0, 1.0], [300.0, 12.0], [700.0, 2.0], [800.0, 1.0]];
        let through = |table: &[[f64; 2]]| {
            let mut params = with_params(&NODE, "steps=layers");
            params.set("layers", ParamValue::Curve(table.to_vec()));
            params
        };
        let cut = result(&NODE, &through(&table), &[("height", &slope)], "height");
        assert!(cut.samples().is_sorted());
        for (before, after) in slope.samples().iter().zip(cut.samples()) {
            if !(0.0..800.0).contains(before) || (100.0..300.0).contains(before) {
                assert_eq!(before, after);
            } else if [0.0, 50.0, 300.0, 500.0, 700.0, 750.0].contains(before) {
                assert!((before - after).abs() < 1e-3, "{before} {after}");
            }
        }
        assert!((cut.samples()[200 + 400] - 300.0 - 200.0 / 4096.0).abs() < 1e-3, "{}", cut.samples()[600]);
        at_every_level(|| result(&NODE, &through(&table), &[("height", &slope)], "height"));
        let even = [[-10.0, 1.0], [2000.0, 1.0]];
        assert_eq!(result(&NODE, &through(&even), &[("height", &slope)], "height"), slope);
        let wrong = outputs(&NODE, &through(&[[0.0, 0.5], [9.0, 1.0]]), &[("height", &slope)]);
        assert!(wrong.expect_err("too soft").to_string().contains("sharpness of 0.5"));
    }

    #[test]
    fn a_wired_base_is_a_base() {
        let land = field(world(300, 5, 5.0), |x, y| x + 3.0 * y);
        let level = field(world(300, 5, 5.0), |_, _| 30.0);
        let fixed = field(world(300, 5, 5.0), |x, y| x + 3.0 * y - 30.0);
        let params = with_params(&NODE, "step=64");
        let wired = result(&NODE, &params, &[("height", &land), ("base", &level)], "height");
        let moved = result(&NODE, &params, &[("height", &fixed)], "height");
        assert!(wired.samples().iter().zip(moved.samples()).all(|(a, b)| (a - b - 30.0).abs() < 1e-3));
        at_every_level(|| run_in(2, &NODE, &params, &[("height", &land), ("base", &level)]));
    }
}
