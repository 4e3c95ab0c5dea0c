//! Steps in the height of land, as layers of rock or the banks of a river leave them.

use crate::{
    cells::{BLOCK, blocks, masked, samples},
    math,
    prelude::*,
    simd::simd,
};

params! {
    /// Height of a step.
    step: f64 = 100.0, Metres, 0.01..=1e5, soft 5..=500;
    /// How steep risers and how flat treads are: 1 leaves the land as it is, from 8 on treads are level.
    sharpness: f64 = 3.0, One, 1.0..=32.0, soft 1..=12;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Terrace",
    category: "filter",
    summary: "Cuts land into steps of a height in metres.",
    doc: "With u the height above `base` in steps, i its whole part and f the rest, a place goes to the height \
          `base + step (i + g(f))`: g is ½ (2 f)ᵏ in the lower half of a step and 1 − ½ (2 − 2 f)ᵏ in the upper one, with k the \
          `sharpness`. So treads lie at whole steps and risers half-way between; heights keep their order, and the middle of a \
          riser is k times as steep as the land was.\n\n\
          `base` may be wired: steps follow it, so a tilted plane tilts the layers, and gentle noise of half a step takes away \
          the look of contour lines.\n\n\
          **Advice.** This is a picture of layers. For rock that really resists in layers, give `StreamPower` an erodibility and \
          a repose that follow them, and let rivers find them.",
    sources: &[
        "F. K. Musgrave, C. E. Kolb and R. S. Mace, 1989, The synthesis and rendering of eroded fractal terrains",
    ],
    inputs: &[
        Input::needs("height", PortType::Height, "The land."),
        Input::number(
            "base",
            Unit::Metres,
            0.0,
            [-1e6, 1e6],
            [-1000.0, 1000.0],
            "A height at which a tread lies, per cell if wired.",
        ),
        Input::mask("mask", "Where the land is cut: fully at 1, not at all at 0."),
    ],
    outputs: &[Output::gives("height", PortType::Height, "The land in steps.")],
    params: Params::specs,
    cpu: run,
    example: "height: \"base\", step: 200",
    ..Node::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let height = job.field("height")?;
    if params.sharpness == 1.0 {
        return Ok(Outputs::one("height", height.clone()));
    }
    let (base, mask) = (job.lane("base"), job.lane("mask"));
    let mut out = height.samples().to_vec();
    blocks(job, [0.0, 1.0], &mut out, |cells, first| {
        let (mut spare_base, mut spare_mask) = ([0.0; BLOCK], [0.0; BLOCK]);
        let base = samples(base, first, cells.len(), &mut spare_base);
        let mask = samples(mask, first, cells.len(), &mut spare_mask);
        cut(cells, base, mask, params.step as f32, params.sharpness as f32);
    })?;
    Ok(Outputs::one("height", Field::new(job.window(), out)))
}

simd! {
    fn cut(heights: &mut [f32], base: &[f32], mask: &[f32], step: f32, sharpness: f32) {
        for ((height, &base), &mask) in heights.iter_mut().zip(base).zip(mask) {
            let u = (*height - base) / step;
            let tread = u.floor();
            // from the nearer tread, 0 to 1 at the middle of the riser
            let rest = u - tread;
            let upper = rest > 0.5;
            let near = if upper { 2.0 - 2.0 * rest } else { 2.0 * rest };
            let lift = 0.5 * math::lane::pow(near, sharpness);
            let share = if upper { 1.0 - lift } else { lift };
            *height = masked(*height, base + step * (tread + share), mask);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{at_every_level, field, run as result, run_in, with_params, world};

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
