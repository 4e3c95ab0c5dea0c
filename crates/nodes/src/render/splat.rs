//! Weights of up to four ground layers in each cell, for terrain materials in game engines.

use orograph_graph::memory::zeroed;

use crate::{
    numerics::{math::lane, par, simd::simd},
    prelude::*,
};

choice! {
    /// How masks become weights.
    pub enum Mode {
        /// Each layer covers those before it according to its mask, as paint does.
        Stack = "stack",
        /// Each layer gets its part of the sum of all masks, independent of their order.
        Share = "share",
    }
}

params! {
    /// How masks become weights.
    mode: Mode = Mode::Stack, One, ..;
    /// Exponent applied to the weights before they are normalised again: above 1, borders between layers are crisper.
    sharpness: f64 = 1.0, One, 0.1..=64.0, soft 0.5..=8.0;
}

inputs! {
    /// The layer in red, which also fills what the others leave free.
    first: Option<Mask>;
    /// The layer in green.
    second: Option<Mask>;
    /// The layer in blue.
    third: Option<Mask>;
    /// The layer in alpha.
    fourth: Option<Mask>;
}

outputs! {
    /// Weights of the four layers, which sum to one.
    weights: Weights;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Splat",
    category: "render",
    summary: "A splat map: the weights of up to four ground layers, which sum to one.",
    doc: include_str!("splat.md"),
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    resolution: Resolution::Within(0.1),
    example: "second: \"mask\", sharpness: 2",
    ..Node::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let Inputs { first, second, third, fourth } = Inputs::read(job)?;
    let masks = [first, second, third, fourth].map(|layer| layer.map(|mask| mask.plane(0)));
    let window = job.window();
    let (nx, len) = (window.nx(), window.len());
    let mut weights = zeroed(4 * len)?;
    let (first, rest) = weights.split_at_mut(len);
    let (second, rest) = rest.split_at_mut(len);
    let (third, fourth) = rest.split_at_mut(len);
    let rows = first.chunks_mut(nx).zip(second.chunks_mut(nx)).zip(third.chunks_mut(nx)).zip(fourth.chunks_mut(nx));
    par::each(rows, |j, (((first, second), third), fourth)| {
        job.check()?;
        let mut rows = [first, second, third, fourth];
        for (row, mask) in rows.iter_mut().zip(masks) {
            if let Some(mask) = mask {
                row.copy_from_slice(&mask[j * nx..(j + 1) * nx]);
            }
        }
        shares(rows, params.mode, params.sharpness as f32);
        Ok::<_, NodeError>(())
    })?;
    Ok(Given { weights: Some(Field::with_planes(window, 4, weights)) }.into())
}

simd! {
    /// Converts masks to weights, in place.
    fn shares(rows: [&mut [f32]; 4], mode: Mode, sharpness: f32) {
        let [first, second, third, fourth] = rows;
        for (((a, b), c), d) in first.iter_mut().zip(&mut *second).zip(&mut *third).zip(&mut *fourth) {
            let (mut p, mut q) = (a.clamp(0.0, 1.0), b.clamp(0.0, 1.0));
            let (mut r, s) = (c.clamp(0.0, 1.0), d.clamp(0.0, 1.0));
            if mode == Mode::Stack {
                let below = (1.0 - r) * (1.0 - s);
                (p, q, r) = ((1.0 - q) * below, q * below, r * (1.0 - s));
            }
            let sum = (p + q) + (r + s);
            let empty = sum <= 0.0;
            let scale = if empty { 1.0 } else { 1.0 / sum };
            p = if empty { 1.0 } else { p };
            (*a, *b, *c, *d) = (p * scale, q * scale, r * scale, s * scale);
        }
        if sharpness != 1.0 {
            for (((a, b), c), d) in first.iter_mut().zip(&mut *second).zip(&mut *third).zip(&mut *fourth) {
                // the largest is 1 before the power, so that the sum is never 0
                let per_most = 1.0 / (a.max(*b)).max(c.max(*d));
                let (p, q) = (lane::pow(*a * per_most, sharpness), lane::pow(*b * per_most, sharpness));
                let (r, s) = (lane::pow(*c * per_most, sharpness), lane::pow(*d * per_most, sharpness));
                let per_sum = 1.0 / ((p + q) + (r + s));
                (*a, *b, *c, *d) = (p * per_sum, q * per_sum, r * per_sum, s * per_sum);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::math;
    use crate::testing::{at_every_level, field, outputs_on, run, run_in, with_params, world};

    const LAYERS: [&str; 4] = ["first", "second", "third", "fourth"];

    fn masks() -> [Field; 4] {
        let wave = |k: f64| field(world(120, 30, 1.0), move |x, y| 0.5 + 0.5 * libm::sin(x / 9.0 + k * y / 7.0));
        [wave(0.3), wave(1.0), wave(-1.7), wave(2.9)]
    }

    fn all(masks: &[Field; 4]) -> [(&'static str, &Field); 4] {
        [0, 1, 2, 3].map(|k| (LAYERS[k], &masks[k]))
    }

    #[test]
    fn shares_sum_to_one_in_every_mode() {
        let masks = masks();
        for changes in ["mode=stack", "mode=share", "mode=share,sharpness=0.1", "mode=stack,sharpness=64"] {
            let weights = run(&NODE, &with_params(&NODE, changes), &all(&masks), "weights");
            for cell in 0..masks[0].window().len() {
                let shares = [0, 1, 2, 3].map(|plane| weights.plane(plane)[cell]);
                assert!(shares.iter().all(|share| (0.0..=1.0).contains(share)), "{changes} {shares:?}");
                assert!((shares.iter().sum::<f32>() - 1.0).abs() < 1e-6, "{changes} {shares:?}"); // four roundings
            }
        }
    }

    #[test]
    fn a_stack_is_paint_over_paint_and_a_share_a_part_of_the_sum() {
        let masks = masks();
        let [stack, share, crisp] = ["mode=stack", "mode=share", "mode=share,sharpness=3"]
            .map(|changes| run(&NODE, &with_params(&NODE, changes), &all(&masks), "weights"));
        for cell in 0..masks[0].window().len() {
            let m = [0, 1, 2, 3].map(|layer| f64::from(masks[layer].samples()[cell]));
            let mut painted = [1.0, 0.0, 0.0, 0.0];
            for layer in 1..4 {
                painted = painted.map(|v| v * (1.0 - m[layer]));
                painted[layer] = m[layer];
            }
            let parts = |power: f64| {
                let sum: f64 = m.iter().map(|v| math::pow(*v, power)).sum();
                m.map(|v| math::pow(v, power) / sum)
            };
            for (weights, expected) in [(&stack, painted), (&share, parts(1.0)), (&crisp, parts(3.0))] {
                for (layer, expected) in expected.into_iter().enumerate() {
                    let got = f64::from(weights.plane(layer)[cell]);
                    assert!((got - expected).abs() < 2e-6, "{layer}: {got} {expected}"); // powers to 1e-6
                }
            }
        }
    }

    #[test]
    fn where_nothing_is_selected_the_first_layer_is_alone() {
        let empty = field(world(9, 4, 1.0), |_, _| 0.0);
        let window = *empty.window();
        for changes in ["mode=stack", "mode=share", "mode=share,sharpness=5"] {
            let params = with_params(&NODE, changes);
            for inputs in [vec![], vec![("third", &empty)], vec![("first", &empty), ("fourth", &empty)]] {
                let weights = outputs_on(window, &NODE, &params, &inputs).expect("a result").take("weights");
                let weights = weights.as_ref().and_then(|value| value.as_field()).expect("a field");
                assert!(weights.plane(0).iter().all(|v| *v == 1.0), "{changes}");
                assert!(weights.samples()[window.len()..].iter().all(|v| *v == 0.0), "{changes}");
            }
        }
    }

    #[test]
    fn threads_and_simd_levels_give_the_same_bits() {
        let masks = masks();
        let params = with_params(&NODE, "sharpness=2.5");
        assert_eq!(run_in(1, &NODE, &params, &all(&masks)), run_in(4, &NODE, &params, &all(&masks)));
        at_every_level(|| run_in(2, &NODE, &params, &all(&masks)));
    }
}
