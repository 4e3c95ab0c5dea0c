//! Combines two fields cell by cell: arithmetic, extremes, smooth extremes and blends.
//!
//! The smooth minimum is the quadratic one of I. Quilez (2013), "Smooth minimum", in the form `min(a, b) − max(r − |a
//! − b|, 0)² / 4r`, which is exactly a or b where they differ by the radius r or more. Screen and overlay are those
//! of image compositing (World Wide Web Consortium, 2015, "Compositing and Blending Level 1").

use orograph_graph::memory::copied;

use crate::{
    numerics::{
        cells::{BLOCK, blocks, masked, samples},
        math,
        simd::simd,
    },
    prelude::*,
    wgsl,
};

choice! {
    /// How the two values are combined.
    pub enum Mode {
        /// a + b.
        Add = "add",
        /// a − b.
        Subtract = "subtract",
        /// a · b.
        Multiply = "multiply",
        /// The lower of the two.
        Min = "min",
        /// The higher of the two.
        Max = "max",
        /// The lower of the two, rounded over `radius` where they meet.
        SmoothMin = "smooth_min",
        /// The higher of the two, rounded over `radius` where they meet.
        SmoothMax = "smooth_max",
        /// (a + b) / 2.
        Average = "average",
        /// |a − b|.
        Difference = "difference",
        /// b; with a mask, a blend of the two.
        Mix = "mix",
        /// full − (full − a)(full − b) / full: each brightens the other.
        Screen = "screen",
        /// Multiplies below half of `full`, screens above: more contrast.
        Overlay = "overlay",
        /// full · (a / full)^b, with the sign of a.
        Power = "power",
        /// Where the mask is between 0 and 1 the higher of the two, with a transition over `radius`.
        HeightBlend = "height_blend",
    }
}

params! {
    /// How the two values are combined.
    mode: Mode = Mode::Add, One, ..;
    /// Difference below which the smooth extremes are rounded and `height_blend` mixes, in the unit of `a`.
    radius: f64 = 50.0, One, 0.0..=1e6, soft 0..=500, when mode = "smooth_min" | "smooth_max" | "height_blend";
    /// Value that counts as full for `screen`, `overlay`, `power` and `clamp`: 1 for masks, the summits for heights.
    full: f64 = 1.0, One, 1e-6..=1e9, soft 1..=5000;
    /// Keeps the result between 0 and `full`, as a mask must be, also where `mask` is 0 or `keep` is 1.
    clamp: bool = false, One, ..;
}

inputs! {
    /// The first field; the result has its meaning and unit.
    a: AnyScalar;
    /// The second field, or a number.
    b: AnyScalar = 0.0, -1e9..=1e9, soft -1000.0..=1000.0;
    /// Where the result replaces `a`: fully at 1, not at all at 0.
    mask: Mask = 1.0, 0.0..=1.0;
    /// Where `a` is kept regardless of the mask, for example in river beds; only `clamp` still applies.
    keep: Mask = 0.0, 0.0..=1.0;
}

outputs! {
    /// The result, with the meaning of `a`.
    value: SameAs(a);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Combine",
    category: "combine",
    summary: "Combines two fields, cell by cell: sums, products, extremes, blends.",
    doc: include_str!("combine.md"),
    sources: &["I. Quilez, 2013, Smooth minimum", "World Wide Web Consortium, 2015, Compositing and Blending Level 1"],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    gpu: Some(&GPU),
    example: "a: \"base\", b: 900, mode: smooth_max, radius: 200",
    ..Node::DEFAULT
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&Shader {
        name: "combine/combine",
        source: wgsl!("combine/combine"),
        library: &[wgsl::MATH],
        values: &[],
        slots: &[Slot::input("a"), Slot::input("b"), Slot::input("mask"), Slot::input("keep"), Slot::output("value")],
    }],
    passes: Passes::POINT,
    tolerance: &[Tolerance::relative(2e-5)],
    ..GpuKernel::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { a, b, mask, keep } = Inputs::read(job)?;
    let params = Params::read(job.params);
    let mut out = copied(a.samples())?;
    blocks(job, [0.0, 1.0], &mut out, |cells, first| {
        let (mut spare_b, mut spare_mask) = ([0.0; BLOCK], [0.0; BLOCK]);
        let b = samples(b, first, cells.len(), &mut spare_b);
        let mut free = [0.0; BLOCK];
        let mut mask = samples(mask, first, cells.len(), &mut spare_mask);
        if keep.constant() != Some(0.0) {
            let mut spare = [0.0; BLOCK];
            let keep = samples(keep, first, cells.len(), &mut spare);
            for ((free, mask), keep) in free.iter_mut().zip(mask).zip(keep) {
                *free = mask * (1.0 - keep);
            }
            mask = &free[..cells.len()];
        }
        combine(cells, b, mask, params.mode, params.radius as f32, params.full as f32);
        if params.clamp {
            cells.iter_mut().for_each(|v| *v = v.clamp(0.0, params.full as f32));
        }
    })?;
    Ok(Given { value: Some(Field::new(job.window(), out)) }.into())
}

/// Returns the correction of the smooth minimum or maximum: its distance below or above the plain one.
#[inline(always)]
pub(super) fn rounding(a: f32, b: f32, radius: f32) -> f32 {
    let overlap = (radius - (a - b).abs()).max(0.0);
    if radius > 0.0 { overlap * overlap / (4.0 * radius) } else { 0.0 }
}

#[inline(always)]
fn each(a: &mut [f32], b: &[f32], mask: &[f32], result: impl Fn(f32, f32) -> f32) {
    for ((a, &b), &mask) in a.iter_mut().zip(b).zip(mask) {
        *a = masked(*a, result(*a, b), mask);
    }
}

simd! {
    fn combine(a: &mut [f32], b: &[f32], mask: &[f32], mode: Mode, radius: f32, full: f32) {
        match mode {
            Mode::Add => each(a, b, mask, |a, b| a + b),
            Mode::Subtract => each(a, b, mask, |a, b| a - b),
            Mode::Multiply => each(a, b, mask, |a, b| a * b),
            Mode::Min => each(a, b, mask, |a, b| a.min(b)),
            Mode::Max => each(a, b, mask, |a, b| a.max(b)),
            Mode::SmoothMin => each(a, b, mask, |a, b| a.min(b) - rounding(a, b, radius)),
            Mode::SmoothMax => each(a, b, mask, |a, b| a.max(b) + rounding(a, b, radius)),
            Mode::Average => each(a, b, mask, |a, b| (a + b) * 0.5),
            Mode::Difference => each(a, b, mask, |a, b| (a - b).abs()),
            Mode::Mix => each(a, b, mask, |_, b| b),
            Mode::Screen => each(a, b, mask, |a, b| full - (full - a) * (full - b) / full),
            Mode::Overlay => each(a, b, mask, |a, b| {
                let (low, high) = (2.0 * a * b / full, full - 2.0 * (full - a) * (full - b) / full);
                if a + a < full { low } else { high }
            }),
            // not a closure: the compiler does not always inline those into the loop
            Mode::Power => {
                for ((a, &b), &mask) in a.iter_mut().zip(b).zip(mask) {
                    *a = masked(*a, (full * math::lane::pow(a.abs() / full, b)).copysign(*a), mask);
                }
            }
            // includes the mask, so that both ends are exact
            Mode::HeightBlend => {
                for ((a, &b), &mask) in a.iter_mut().zip(b).zip(mask) {
                    let above = (b - *a) / radius.max(f32::MIN_POSITIVE);
                    let above = above.clamp(-1e9, 1e9);
                    *a = masked(*a, b, (mask + 2.0 * mask * (1.0 - mask) * above).clamp(0.0, 1.0));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{at_every_level, field, run, with_params, world};

    fn pair() -> (Field, Field) {
        let world = world(1500, 3, 1.0);
        (field(world, |x, y| libm::sin(x * 0.1) * 90.0 + y), field(world, |x, _| libm::cos(x * 0.07) * 110.0 - 3.0))
    }

    fn run_pair(params: &ParamValues, a: &Field, b: &Field) -> Field {
        run(&NODE, params, &[("a", a), ("b", b)], "value")
    }

    fn each(changes: &str, check: impl Fn(f32, f32, f32)) {
        let (a, b) = pair();
        let params = with_params(&NODE, changes);
        at_every_level(|| run_pair(&params, &a, &b));
        let result = run_pair(&params, &a, &b);
        for ((&a, &b), &got) in a.samples().iter().zip(b.samples()).zip(result.samples()) {
            check(a, b, got);
        }
    }

    #[test]
    fn plain_modes_are_what_they_say() {
        each("mode=add", |a, b, got| assert_eq!(got, a + b));
        each("mode=subtract", |a, b, got| assert_eq!(got, a - b));
        each("mode=multiply", |a, b, got| assert_eq!(got, a * b));
        each("mode=min", |a, b, got| assert_eq!(got, a.min(b)));
        each("mode=max", |a, b, got| assert_eq!(got, a.max(b)));
        each("mode=average", |a, b, got| assert_eq!(got, (a + b) / 2.0));
        each("mode=difference", |a, b, got| assert_eq!(got, (a - b).abs()));
        each("mode=mix", |_, b, got| assert_eq!(got, b));
        each("mode=add,clamp=true,full=40", |a, b, got| assert_eq!(got, (a + b).clamp(0.0, 40.0)));
    }

    /// The smooth minimum is the lerp of the definition. It equals the minimum beyond the radius, is a quarter of the
    /// radius below it where the two are equal, and mirrors the smooth maximum.
    #[test]
    fn smooth_extremes_keep_their_identities() {
        let radius = 30.0_f32;
        each("mode=smooth_min,radius=30", |a, b, got| {
            let h = (0.5 + 0.5 * (b - a) / radius).clamp(0.0, 1.0);
            let defined = b + (a - b) * h - radius * h * (1.0 - h);
            assert!((got - defined).abs() < 3e-5, "{a} {b}: {got} {defined}"); // values of 100 in single precision
            assert!(got <= a.min(b) && got >= a.min(b) - radius / 4.0);
            if (a - b).abs() >= radius {
                assert_eq!(got, a.min(b));
            }
        });
        let (a, b) = pair();
        let negative = |f: &Field| Field::new(*f.window(), f.samples().iter().map(|v| -v).collect());
        let low = run_pair(&with_params(&NODE, "mode=smooth_min,radius=30"), &a, &b);
        let high = run_pair(&with_params(&NODE, "mode=smooth_max,radius=30"), &negative(&b), &negative(&a));
        assert_eq!(negative(&low), high);
        each("mode=smooth_min,radius=0", |a, b, got| assert_eq!(got, a.min(b)));
    }

    #[test]
    fn blends_of_masks_stay_masks_and_keep_their_ends() {
        let world = world(33, 33, 1.0);
        let (a, b) = (field(world, |x, _| (x - 0.5) / 32.0), field(world, |_, y| (y - 0.5) / 32.0));
        for mode in ["screen", "overlay", "power", "multiply", "average"] {
            let result = run_pair(&with_params(&NODE, &format!("mode={mode}")), &a, &b);
            for ((&a, &b), &got) in a.samples().iter().zip(b.samples()).zip(result.samples()) {
                assert!((-1e-6..=1.0 + 1e-6).contains(&got), "{mode} {a} {b}: {got}");
                let expected = match mode {
                    "screen" => a + b - a * b,
                    "overlay" if a < 0.5 => 2.0 * a * b,
                    "overlay" => 1.0 - 2.0 * (1.0 - a) * (1.0 - b),
                    "power" if a == 0.0 => 0.0,
                    "power" => math::f32::pow(a, b),
                    "multiply" => a * b,
                    _ => (a + b) / 2.0,
                };
                assert!((got - expected).abs() < 1e-6, "{mode} {a} {b}: {got} {expected}");
            }
        }
    }

    #[test]
    fn the_mask_keeps_a_or_takes_the_result_exactly() {
        let (a, b) = pair();
        let mask = field(a.window().world, |x, _| {
            if x < 500.0 {
                0.0
            } else if x < 1000.0 {
                1.0
            } else {
                0.25
            }
        });
        let result = run(&NODE, &with_params(&NODE, "mode=add"), &[("a", &a), ("b", &b), ("mask", &mask)], "value");
        for (at, &got) in result.samples().iter().enumerate() {
            let (a, sum) = (a.samples()[at], a.samples()[at] + b.samples()[at]);
            match at % 1500 {
                0..500 => assert_eq!(got.to_bits(), a.to_bits()),
                500..1000 => assert_eq!(got.to_bits(), sum.to_bits()),
                _ => assert!((got - (0.75 * a + 0.25 * sum)).abs() < 2e-5),
            }
        }
    }

    /// Detail next to rivers leaves the river beds bit for bit unchanged.
    #[test]
    fn what_is_kept_stays() {
        let (a, b) = pair();
        let rivers = field(a.window().world, |x, _| if (x as u32).is_multiple_of(7) { 1.0 } else { 0.0 });
        let half = field(a.window().world, |_, _| 0.5);
        let params = with_params(&NODE, "mode=add");
        let whole = run_pair(&params, &a, &b);
        let found = run(&NODE, &params, &[("a", &a), ("b", &b), ("keep", &rivers)], "value");
        for (at, found) in found.samples().iter().enumerate() {
            let expected = if rivers.samples()[at] == 1.0 { a.samples()[at] } else { whole.samples()[at] };
            assert_eq!(found.to_bits(), expected.to_bits());
        }
        let both = run(&NODE, &params, &[("a", &a), ("b", &b), ("mask", &half), ("keep", &half)], "value");
        for (at, found) in both.samples().iter().enumerate() {
            assert!((found - (a.samples()[at] + 0.25 * b.samples()[at])).abs() < 2e-5);
        }
    }

    /// With a mask of 0.5: the higher of the two where they differ by the radius or more, and their mean where they are
    /// equal.
    #[test]
    fn a_blend_by_height_takes_the_higher() {
        let (a, b) = pair();
        let params = with_params(&NODE, "mode=height_blend,radius=30");
        for (mask, at_most) in [(0.0, 0.0), (1.0, 1.0), (0.5, 0.5)] {
            let mask = field(a.window().world, |_, _| mask);
            let found = run(&NODE, &params, &[("a", &a), ("b", &b), ("mask", &mask)], "value");
            for ((&a, &b), &found) in a.samples().iter().zip(b.samples()).zip(found.samples()) {
                let share = if at_most == 0.5 { (0.5 + 0.5 * (b - a) / 30.0).clamp(0.0, 1.0) } else { at_most };
                assert!((found - (a * (1.0 - share) + b * share)).abs() < 1e-4, "{a} {b} {found}");
                if at_most != 0.5 || (b - a).abs() > 30.0 {
                    assert_eq!(found, if share == 1.0 { b } else { a });
                }
            }
        }
    }

    #[test]
    fn a_number_that_changes_nothing_gives_the_input() {
        let (a, _) = pair();
        let result = run(&NODE, &with_params(&NODE, "mode=add"), &[("a", &a)], "value");
        assert_eq!(result, a);
    }

    #[test]
    fn powers_never_break() {
        let world = world(40, 40, 1.0);
        let (a, b) = (field(world, |x, _| (x - 20.5) * 1e8), field(world, |_, y| (y - 20.0) * 5e7));
        for full in ["1e-6", "1", "1e9"] {
            let result = run_pair(&with_params(&NODE, &format!("mode=power,full={full}")), &a, &b);
            assert!(result.samples().iter().all(|v| !v.is_nan()));
        }
    }
}
