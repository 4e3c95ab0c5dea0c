//! Maps a field through a curve: a monotone cubic through points, levels with a gamma, or a shaping function.
//!
//! The cubic is that of F. N. Fritsch and R. E. Carlson (1980), "Monotone piecewise cubic interpolation": it passes
//! through every point, has a continuous slope and never overshoots. It is evaluated as it is, without a table.

mod shaping;
pub(crate) mod spline;

use orograph_graph::memory::copied;

use self::shaping::{Arctangent, Bend, Exponential, Power, Quintic, Tangent};
use crate::{
    numerics::{
        cells::{BLOCK, blocks, masked, samples},
        simd::simd,
    },
    prelude::*,
    wgsl,
};
use spline::Spline;
pub use spline::slopes;

choice! {
    /// Kind of curve.
    pub enum Shape {
        /// Through `points`.
        Points = "points",
        /// From `in_low`..`in_high` to `out_low`..`out_high`, bent by `gamma`.
        Levels = "levels",
        /// Levels bent by eˣ: low ground flat, high ground steep.
        Exponential = "exponential",
        /// Levels bent by 6x⁵ − 15x⁴ + 10x³ on both sides of the middle: flat in the middle and at both ends.
        Quintic = "quintic",
        /// Levels bent by atan 2x: steep in the middle, flat at both ends.
        Arctangent = "arctangent",
        /// Levels bent by tan x: flat in the middle, steep at both ends.
        Tangent = "tangent",
    }
}

choice! {
    /// Values beyond the ends of the curve.
    pub enum Beyond {
        /// The curve continues straight: with its slope at the end for points, with the mean slope for all others.
        Linear = "linear",
        /// The value at the end.
        Clamp = "clamp",
    }
}

params! {
    /// Kind of curve.
    shape: Shape = Shape::Points, One, ..;
    /// Points of the curve: an input value and its output.
    points: CurvePoints = CurvePoints(vec![[0.0, 0.0], [1000.0, 1000.0]]), One, .., when shape = "points";
    /// Values beyond the ends of the curve.
    beyond: Beyond = Beyond::Linear, One, ..;
    /// The input that becomes `out_low`.
    in_low: f64 = 0.0, One, -1e9..=1e9, soft -1000..=5000, when shape = "levels" | "exponential" | "quintic" | "arctangent" | "tangent";
    /// The input that becomes `out_high`.
    in_high: f64 = 1000.0, One, -1e9..=1e9, soft -1000..=5000, when shape = "levels" | "exponential" | "quintic" | "arctangent" | "tangent";
    /// Above 1 raises the middle, below 1 lowers it.
    gamma: f64 = 1.0, One, 0.05..=20.0, soft 0.25..=4, when shape = "levels";
    /// Output for `in_low`.
    out_low: f64 = 0.0, One, -1e9..=1e9, soft -1000..=5000, when shape = "levels" | "exponential" | "quintic" | "arctangent" | "tangent";
    /// Output for `in_high`.
    out_high: f64 = 1000.0, One, -1e9..=1e9, soft -1000..=5000, when shape = "levels" | "exponential" | "quintic" | "arctangent" | "tangent";
}

inputs! {
    /// Field to remap.
    value: AnyScalar;
    /// Where the result replaces the input: fully at 1, not at all at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// The remapped values, with the meaning of the input.
    value: SameAs(value);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Curve",
    category: "combine",
    summary: "Remaps values along a smooth curve through points, by levels and gamma, or by a shaping function.",
    doc: include_str!("curve.md"),
    sources: &[
        "F. N. Fritsch, R. E. Carlson, 1980, Monotone piecewise cubic interpolation",
        "G. Dahan (2025), La création et la manipulation de champs de hauteur, travail d'initiative personnelle encadré",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    gpu: Some(&GPU),
    example: "value: \"base\", points: [(0, 0), (1500, 300), (1900, 1600), (4000, 3000)]",
    ..Node::DEFAULT
};

static SHADER: Shader = Shader {
    name: "combine/curve",
    source: wgsl!("combine/curve"),
    library: &[wgsl::MATH],
    values: &[("count", Number::U32), ("per_range", Number::F32), ("bent", Number::F32)],
    slots: &[Slot::words("pieces", "Piece"), Slot::input("value"), Slot::input("mask"), Slot::output("value")],
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&SHADER],
    passes: Passes::Recorded(record),
    // a curve that changes nothing keeps the bits of its input
    covers: |params| {
        let curve = Curve::of(&Params::read(params));
        curve.is_ok_and(|curve| !matches!(curve, Curve::Identity { .. }))
    },
    tolerance: &[Tolerance::relative(1e-5)],
    ..GpuKernel::DEFAULT
};

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let (words, per_range, bent) = match Curve::of(&Params::read(job.params))? {
        Curve::Points(spline) => (spline.words(), 0.0, 0.0),
        Curve::Levels(Levels { per_range, power, .. }) => (vec![0; spline::WORDS], per_range, power),
        Curve::Identity { .. } => return Err(NodeError::failed("this curve changes nothing")),
    };
    let pieces = recorder.table(&words)?;
    recorder.pass(&Pass {
        shader: &SHADER,
        entry: "main",
        bind: &[("pieces", Bind::Scratch(pieces))],
        values: &[
            ("count", Scalar::U32((words.len() / spline::WORDS) as u32)),
            ("per_range", Scalar::F32(per_range)),
            ("bent", Scalar::F32(bent)),
        ],
        over: Over::Cells(Rows::Around(0)),
    })
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { value, mask } = Inputs::read(job)?;
    let curve = Curve::of(&Params::read(job.params))?;
    if matches!(curve, Curve::Identity { ends: None }) {
        return Ok(Given { value: Some(value.clone()) }.into());
    }
    let mut out = copied(value.samples())?;
    blocks(job, [0.0, 1.0], &mut out, |cells, first| {
        let mut spare = [0.0; BLOCK];
        let mask = samples(mask, first, cells.len(), &mut spare);
        let mut mapped = [0.0; BLOCK];
        let mapped = &mut mapped[..cells.len()];
        mapped.copy_from_slice(cells);
        curve.apply(mapped);
        blend(cells, mapped, mask);
    })?;
    Ok(Given { value: Some(Field::new(job.window(), out)) }.into())
}

/// A curve with precomputed coefficients.
#[derive(Debug)]
enum Curve {
    /// Every value keeps its bits; values beyond `ends`, if given, are clamped.
    Identity {
        ends: Option<[f32; 2]>,
    },
    Points(Spline),
    Levels(Levels),
}

impl Curve {
    fn of(params: &Params) -> Result<Self, NodeError> {
        let clamp = params.beyond == Beyond::Clamp;
        match params.shape {
            Shape::Points => Ok(Self::points(&params.points.0, clamp)),
            _ => Self::levels(params, clamp),
        }
    }

    fn points(points: &[[f64; 2]], clamp: bool) -> Self {
        if points.iter().all(|[x, y]| x == y) {
            let [first, .., last] = points else { return Self::Identity { ends: None } };
            Self::Identity { ends: clamp.then_some([first[0] as f32, last[0] as f32]) }
        } else {
            Self::Points(Spline::new(points, clamp))
        }
    }

    fn levels(params: &Params, clamp: bool) -> Result<Self, NodeError> {
        let Params { in_low, in_high, out_low, out_high, gamma, .. } = *params;
        if in_low as f32 >= in_high as f32 {
            return Err(NodeError::failed_with_hint(
                format!("`in_low` is {in_low} and `in_high` is {in_high}; it must be the higher"),
                "to turn the curve around, exchange `out_low` and `out_high`",
            ));
        }
        let shape = params.shape;
        if shape == Shape::Levels && gamma == 1.0 && in_low == out_low && in_high == out_high {
            return Ok(Self::Identity { ends: clamp.then_some([in_low as f32, in_high as f32]) });
        }
        Ok(Self::Levels(Levels {
            low: in_low as f32,
            per_range: (1.0 / (in_high - in_low)) as f32,
            out: [out_low as f32, out_high as f32],
            shape,
            power: (1.0 / gamma) as f32,
            clamp,
        }))
    }

    fn apply(&self, values: &mut [f32]) {
        match self {
            Self::Identity { ends: Some([low, high]) } => values.iter_mut().for_each(|v| *v = v.clamp(*low, *high)),
            Self::Identity { ends: None } => {}
            Self::Points(spline) => spline.apply(values),
            Self::Levels(levels) => match levels.shape {
                Shape::Exponential => apply_levels(values, levels, Exponential),
                Shape::Quintic => apply_levels(values, levels, Quintic),
                Shape::Arctangent => apply_levels(values, levels, Arctangent),
                Shape::Tangent => apply_levels(values, levels, Tangent),
                Shape::Levels | Shape::Points => apply_levels(values, levels, Power(levels.power)),
            },
        }
    }
}

/// Levels with precomputed constants.
#[derive(Clone, Copy, Debug)]
struct Levels {
    low: f32,
    per_range: f32,
    out: [f32; 2],
    shape: Shape,
    power: f32,
    clamp: bool,
}

simd! {
    fn apply_levels<B: Bend>(values: &mut [f32], levels: &Levels, bend: B) {
        let Levels { low, per_range, out: [out_low, out_high], clamp, .. } = *levels;
        for value in values {
            let place = (*value - low) * per_range;
            let inside = place.clamp(0.0, 1.0);
            let bent = bend.bend(inside);
            let u = if clamp { bent } else { bent + (place - inside) };
            *value = out_low * (1.0 - u) + out_high * u;
        }
    }
}

simd! {
    fn blend(old: &mut [f32], new: &[f32], mask: &[f32]) {
        for ((old, &new), &mask) in old.iter_mut().zip(new).zip(mask) {
            *old = masked(*old, new, mask);
        }
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::ParamValue;

    use super::*;
    use crate::{
        numerics::math,
        testing::{at_every_level, field, outputs, run, with_params, world},
    };

    fn ramp() -> Field {
        field(world(3000, 2, 1.0), |x, y| x - 500.3 + y * 0.25)
    }

    fn through(points: &[[f64; 2]], changes: &str) -> ParamValues {
        let mut params = with_params(&NODE, changes);
        params.set("points", ParamValue::Curve(points.to_vec()));
        params
    }

    #[test]
    fn identity_settings_give_the_input_to_the_last_bit() {
        let ramp = ramp();
        for params in [
            with_params(&NODE, ""),
            through(&[[-7.0, -7.0], [0.1, 0.1], [300.0, 300.0]], ""),
            with_params(&NODE, "shape=levels"),
            with_params(&NODE, "shape=levels,in_low=-3,out_low=-3,in_high=9,out_high=9"),
        ] {
            assert_eq!(run(&NODE, &params, &[("value", &ramp)], "value"), ramp);
        }
        let clamped = run(&NODE, &with_params(&NODE, "beyond=clamp"), &[("value", &ramp)], "value");
        assert!(clamped.samples().iter().zip(ramp.samples()).all(|(got, v)| *got == v.clamp(0.0, 1000.0)));
    }

    /// The curve passes through every point, rises where the points rise, is flat between equal points and does not
    /// overshoot.
    #[test]
    fn a_curve_is_monotone_between_its_points_and_passes_through_them() {
        let points = [[0.0, 10.0], [100.0, 12.0], [150.0, 400.0], [600.0, 400.0], [900.0, 380.0], [2000.0, 381.0]];
        let params = through(&points, "beyond=clamp");
        let ramp = ramp();
        at_every_level(|| run(&NODE, &params, &[("value", &ramp)], "value"));
        let curve = run(&NODE, &params, &[("value", &ramp)], "value");
        let (x, y) = (&ramp.samples()[..3000], &curve.samples()[..3000]);
        for pair in points.windows(2) {
            let rising = (pair[1][1] - pair[0][1]) as f32;
            for i in (1..3000).filter(|&i| f64::from(x[i - 1]) >= pair[0][0] && f64::from(x[i]) <= pair[1][0]) {
                let step = (y[i] - y[i - 1]) * rising.signum();
                // 1e-4: roundings of values of 400 in single precision
                assert!(step > -1e-4 && (rising != 0.0 || y[i] == pair[0][1] as f32), "{} {step}", x[i]);
            }
        }
        let at = field(world(6, 1, 1.0), |x, _| points[(x - 0.5) as usize][0]);
        let got = run(&NODE, &params, &[("value", &at)], "value");
        assert!(got.samples().iter().zip(points).all(|(got, [_, y])| *got == y as f32), "{:?}", got.samples());
        assert_eq!((y[0], y[2999]), (10.0, 381.0));
    }

    /// Even samples of y = x², for which the slope formula of the method is exact; tested between two inner points.
    #[test]
    fn values_between_points_are_the_cubic() {
        let points: Vec<[f64; 2]> = (0..6).map(f64::from).map(|x| [x, x * x]).collect();
        let value = field(world(100, 1, 0.03), |x, _| 1.0 + x);
        let got = run(&NODE, &through(&points, ""), &[("value", &value)], "value");
        for (x, got) in value.samples().iter().zip(got.samples()) {
            assert!((got - x * x).abs() < 3e-6 * x * x, "{x}: {got}");
        }
    }

    #[test]
    fn the_ends_go_on_straight() {
        let ramp = ramp();
        let got = run(&NODE, &through(&[[0.0, 0.0], [100.0, 50.0], [200.0, 150.0]], ""), &[("value", &ramp)], "value");
        for (x, got) in ramp.samples().iter().zip(got.samples()) {
            if *x < 0.0 {
                assert!((got - 0.5 * x).abs() < 1e-4);
            } else if *x > 200.0 {
                assert!((got - (x - 50.0)).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn levels_map_the_ends_and_bend_the_middle() {
        let value = field(world(5, 1, 250.0), |x, _| x - 125.0);
        let params = with_params(&NODE, "shape=levels,gamma=2,out_low=100,out_high=300,beyond=clamp");
        let got = run(&NODE, &params, &[("value", &value)], "value");
        for (k, got) in got.samples().iter().enumerate() {
            let expected = 100.0 + 200.0 * (k as f32 / 4.0).sqrt();
            assert!((got - expected).abs() < 1e-4, "{k}: {got} {expected}");
        }
        let wrong = with_params(&NODE, "shape=levels,in_low=5,in_high=5");
        let error = outputs(&NODE, &wrong, &[("value", &value)]).expect_err("an empty range").to_string();
        assert!(error.contains("`in_low` is 5"), "{error}");
        let straight = with_params(&NODE, "shape=levels,gamma=0.5,in_high=500,out_high=100");
        let got = run(&NODE, &straight, &[("value", &value)], "value");
        assert!((got.samples()[4] - 200.0).abs() < 1e-3, "{:?}", got.samples()); // 1000 of 500 is twice the range
    }

    #[test]
    fn shaping_functions_keep_both_ends_and_go_on_straight() {
        type Function = fn(f64) -> f64;
        let value = field(world(401, 1, 1.0), |x, _| 10.0 * (x - 0.5) - 500.0);
        let shapes: [(&str, Function); 4] = [
            ("exponential", |x| 2.0 * (math::exp(x) - 1.0)),
            ("quintic", |x| {
                let t = x.abs();
                (6.0 * math::pow(t, 5.0) - 15.0 * math::pow(t, 4.0) + 10.0 * t * t * t) * x.signum()
            }),
            ("arctangent", |x| 2.0 * math::atan(2.0 * x)),
            ("tangent", |x| 0.5 * math::tan(x)),
        ];
        for (name, shape) in shapes {
            let params = with_params(&NODE, &format!("shape={name},in_high=2000,out_low=50,out_high=750"));
            at_every_level(|| run(&NODE, &params, &[("value", &value)], "value"));
            let got = run(&NODE, &params, &[("value", &value)], "value");
            let at = |metres: usize| got.samples()[(metres + 500) / 10];
            assert_eq!((at(0), at(2000)), (50.0, 750.0), "{name}");
            // two roundings of a thousand
            assert!((at(3000) - 1100.0).abs() < 3e-4, "{name}: {}", at(3000));
            for (value, got) in value.samples().iter().zip(got.samples()) {
                let x = f64::from(*value) / 1000.0 - 1.0;
                if x.abs() <= 1.0 {
                    let expected = 50.0 + 700.0 * (shape(x) - shape(-1.0)) / (shape(1.0) - shape(-1.0));
                    // 3e-7 of the range from the functions, and two roundings
                    assert!((f64::from(*got) - expected).abs() < 5e-4, "{name} {x}: {got} {expected}");
                }
            }
        }
    }

    #[test]
    fn a_full_mask_takes_the_curve_and_an_empty_one_the_input() {
        let ramp = ramp();
        let params = through(&[[0.0, 5.0], [100.0, 80.0]], "");
        let curve = run(&NODE, &params, &[("value", &ramp)], "value");
        for (value, expected) in [(0.0, &ramp), (1.0, &curve)] {
            let mask = field(ramp.window().world, |_, _| value);
            assert_eq!(&run(&NODE, &params, &[("value", &ramp), ("mask", &mask)], "value"), expected);
        }
    }
}
