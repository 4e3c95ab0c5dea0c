//! Clamps values between two limits, with soft knees.

use orograph_graph::memory::copied;

use super::combine::rounding;
use crate::{
    numerics::{
        cells::{BLOCK, blocks, masked, samples},
        simd::simd,
    },
    prelude::*,
    wgsl,
};

params! {
    /// Distance from a limit within which values bend towards it, in the unit of the input; 0 for a sharp edge.
    knee: f64 = 0.0, One, 0.0..=1e9, soft 0..=500;
}

inputs! {
    /// Field to clamp.
    value: AnyScalar;
    /// The lower limit, a number or a field.
    low: AnyScalar = 0.0, -1e9..=1e9, soft -1000.0..=5000.0;
    /// The upper limit, a number or a field.
    high: AnyScalar = 1000.0, -1e9..=1e9, soft -1000.0..=5000.0;
    /// Where the result replaces the input: fully at 1, not at all at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// The values between the limits, with the meaning of the input.
    value: SameAs(value);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Clamp",
    category: "combine",
    summary: "Clamps values between two limits, with a sharp edge or a soft knee.",
    doc: include_str!("clamp.md"),
    sources: &["I. Quilez, 2013, Smooth minimum"],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    gpu: Some(&GPU),
    example: "value: \"base\", low: 500, high: 2200, knee: 200",
    ..Node::DEFAULT
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&Shader {
        name: "combine/clamp",
        source: wgsl!("combine/clamp"),
        library: &[wgsl::MATH],
        values: &[],
        slots: &[
            Slot::input("value"),
            Slot::input("low"),
            Slot::input("high"),
            Slot::input("mask"),
            Slot::output("value"),
        ],
    }],
    passes: Passes::POINT,
    tolerance: &[Tolerance::ROUNDING],
    ..GpuKernel::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { value, low, high, mask } = Inputs::read(job)?;
    let knee = Params::read(job.params).knee as f32;
    let mut out = copied(value.samples())?;
    blocks(job, [0.0, 1.0], &mut out, |cells, first| {
        let (mut spare_low, mut spare_high, mut spare_mask) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
        let low = samples(low, first, cells.len(), &mut spare_low);
        let high = samples(high, first, cells.len(), &mut spare_high);
        let mask = samples(mask, first, cells.len(), &mut spare_mask);
        limit(cells, low, high, mask, knee);
    })?;
    Ok(Given { value: Some(Field::new(job.window(), out)) }.into())
}

simd! {
    fn limit(values: &mut [f32], low: &[f32], high: &[f32], mask: &[f32], knee: f32) {
        for (((value, &low), &high), &mask) in values.iter_mut().zip(low).zip(high).zip(mask) {
            let knee = knee.min(0.5 * (high - low)).max(0.0);
            let below = value.min(high) - rounding(*value, high, knee);
            let inside = below.max(low) + rounding(below, low, knee);
            *value = masked(*value, inside, mask);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{at_every_level, field, run as result, with_params, world};

    fn ramp() -> Field {
        field(world(3001, 1, 1.0), |x, _| x - 1000.5)
    }

    /// With the default limits of 0 and 1000.
    #[test]
    fn values_are_between_the_limits_and_keep_their_bits_inside() {
        let ramp = ramp();
        let sharp = result(&NODE, &with_params(&NODE, ""), &[("value", &ramp)], "value");
        assert!(ramp.samples().iter().zip(sharp.samples()).all(|(before, after)| *after == before.clamp(0.0, 1000.0)));
        let soft = result(&NODE, &with_params(&NODE, "knee=200"), &[("value", &ramp)], "value");
        for (before, after) in ramp.samples().iter().zip(soft.samples()) {
            if (200.0..=800.0).contains(before) {
                assert_eq!(before, after);
            } else if *before >= 1200.0 || *before <= -200.0 {
                assert_eq!(*after, before.clamp(0.0, 1000.0));
            } else if *before > 800.0 {
                let expected = before - (before - 800.0) * (before - 800.0) / 800.0;
                assert!((after - expected).abs() < 1e-3, "{before} {after} {expected}");
            }
        }
        // monotone, and the slope is continuous: it goes from 0 to 1 over 400 m
        assert!(soft.samples().windows(3).all(|v| {
            let bend = (v[2] - v[1]) - (v[1] - v[0]);
            v[2] >= v[1] && bend.abs() < 1.1 / 400.0
        }));
        at_every_level(|| result(&NODE, &with_params(&NODE, "knee=200"), &[("value", &ramp)], "value"));
    }

    #[test]
    fn wide_knees_and_crossed_limits_stay_between_them() {
        let ramp = ramp();
        let soft = result(&NODE, &with_params(&NODE, "knee=1e9"), &[("value", &ramp)], "value");
        assert_eq!(soft.range(0), Some((0.0, 1000.0)));
        assert!(soft.samples().is_sorted());
        let crossed = field(ramp.window().world, |_, _| 2000.0);
        let found = result(&NODE, &with_params(&NODE, "knee=10"), &[("value", &ramp), ("low", &crossed)], "value");
        assert!(found.samples().iter().all(|&v| v == 2000.0));
    }

    #[test]
    fn a_wired_limit_is_a_limit() {
        let ramp = ramp();
        let ceiling = field(ramp.window().world, |x, _| 0.25 * x);
        let found = result(&NODE, &with_params(&NODE, ""), &[("value", &ramp), ("high", &ceiling)], "value");
        for (at, &found) in found.samples().iter().enumerate() {
            assert_eq!(found, ramp.samples()[at].min(ceiling.samples()[at]).max(0.0));
        }
    }
}
