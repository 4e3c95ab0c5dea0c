//! Maps values from one range to another and gives them another quantity: the converter between kinds of fields.

use crate::{
    numerics::{
        cells::blocks,
        math::{self, lane},
        simd::simd,
    },
    prelude::*,
    wgsl,
};
use orograph_graph::{ParamType, ParamValue, memory::copied};

choice! {
    /// Quantity of the result, which decides where it may be wired.
    pub enum Quantity {
        /// An elevation in metres.
        Height = "height",
        /// A selection; the result is clamped to 0..1.
        Mask = "mask",
        /// A plain number.
        Scalar = "scalar",
        /// A length in metres that is not an elevation.
        Length = "length",
        /// An angle in degrees.
        Angle = "angle",
        /// A rate of uplift, erosion or rain in metres per year.
        Rate = "rate",
        /// The coefficient of the stream-power law, in m^(1−2m)/yr.
        Erodibility = "erodibility",
        /// A diffusivity of soil in m²/yr.
        Diffusivity = "diffusivity",
        /// A temperature in °C.
        Temperature = "temperature",
        /// A rate of rain or infiltration in a storm, in mm/h.
        Rainfall = "rainfall",
        /// A drainage area in m².
        Area = "area",
        /// A lapse rate, the cooling of the air with height, in kelvins per kilometre.
        LapseRate = "lapse_rate",
    }
}

choice! {
    /// Spacing of values between the ends.
    pub enum Spacing {
        /// Evenly.
        Linear = "linear",
        /// Evenly in their logarithm, for quantities that span powers of ten; both ends of `to` must be above 0.
        Logarithmic = "logarithmic",
    }
}

params! {
    /// Input values that become the first and the second value of `to`.
    from: [f64; 2] = [0.0, 1.0], One, -1e12..=1e12;
    /// Output for the two values of `from`, in the unit of `quantity`.
    to: [f64; 2] = [0.0, 1.0], One, -1e12..=1e12;
    /// Quantity of the result, which decides where it may be wired.
    quantity: Quantity = Quantity::Mask, One, ..;
    /// Spacing of values between the ends.
    spacing: Spacing = Spacing::Linear, One, ..;
    /// Clamps the result to the two values of `to`.
    clamp: bool = true, One, ..;
}

inputs! {
    /// Field to remap.
    value: AnyScalar;
}

outputs! {
    /// The remapped values.
    value: Chosen(port_type);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Remap",
    category: "combine",
    summary: "Maps values from one range to another and gives them another quantity.",
    doc: include_str!("remap.md"),
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    refuses: Some(refuses),
    cpu: run,
    gpu: Some(&GPU),
    example: "value: \"base\", from: (0, 2000), to: (1e-6, 1e-5), quantity: erodibility, spacing: logarithmic",
    ..Node::DEFAULT
};

/// The name of the quantity that an input of this type takes. Returns None when there is none.
#[must_use]
pub fn quantity_of(input: PortType) -> Option<&'static str> {
    let ty = |name: &'static str| Quantity::from_value(&ParamValue::Choice(name)).map(Quantity::port_type);
    Quantity::OPTIONS.iter().map(|(name, _)| *name).find(|name| ty(name) == Some(input))
}

impl Quantity {
    const fn port_type(self) -> PortType {
        match self {
            Self::Height => PortType::Height,
            Self::Mask => PortType::Mask,
            Self::Scalar => PortType::Scalar(Unit::One),
            Self::Length => PortType::Scalar(Unit::Metres),
            Self::Angle => PortType::Scalar(Unit::Degrees),
            Self::Rate => PortType::Scalar(Unit::MetresPerYear),
            Self::Erodibility => PortType::Scalar(Unit::Erodibility),
            Self::Diffusivity => PortType::Scalar(Unit::SquareMetresPerYear),
            Self::Temperature => PortType::Scalar(Unit::Celsius),
            Self::Rainfall => PortType::Scalar(Unit::MillimetresPerHour),
            Self::Area => PortType::Scalar(Unit::SquareMetres),
            Self::LapseRate => PortType::Scalar(Unit::KelvinsPerKilometre),
        }
    }
}

fn port_type(params: &ParamValues) -> PortType {
    Params::read(params).quantity.port_type()
}

static GPU: GpuKernel = GpuKernel {
    shaders: &[&Shader {
        name: "combine/remap",
        source: wgsl!("combine/remap"),
        library: &[wgsl::MATH],
        values: &[("octaves", Number::F32), ("least", Number::F32), ("most", Number::F32)],
        slots: &[Slot::input("value"), Slot::output("value")],
    }],
    passes: Passes::point(|job| {
        let params = Params::read(job.params);
        let octaves = if params.spacing == Spacing::Logarithmic { params.octaves() } else { 0.0 };
        let [least, most] = params.limits();
        [("octaves", octaves), ("least", least), ("most", most)]
            .map(|(name, value)| (name, Scalar::F32(value as f32)))
            .to_vec()
    }),
    covers: |params| {
        let params = Params::read(params);
        let [from0, from1] = params.from.map(|v| v as f32);
        // in single precision both ends and what lies between them are distinct
        let apart = (from1 - from0).abs() > 1e-3 * from0.abs().max(from1.abs());
        apart && (params.spacing == Spacing::Linear || (params.to.iter().all(|v| *v > 1e-30)))
    },
    tolerance: &[Tolerance::relative(2e-5)],
    ..GpuKernel::DEFAULT
};

impl Params {
    /// log₂ of the ratio of the two ends of `to`.
    fn octaves(&self) -> f64 {
        math::log2(self.to[1] / self.to[0])
    }

    /// Limits of results.
    fn limits(&self) -> [f64; 2] {
        let ([to0, to1], most) = (self.to, f64::from(f32::MAX));
        let (low, high) = if self.clamp { (to0.min(to1), to0.max(to1)) } else { (-most, most) };
        let is_mask = self.quantity == Quantity::Mask;
        let (low, high) = if is_mask { (low.clamp(0.0, 1.0), high.clamp(0.0, 1.0)) } else { (low, high) };
        [low.max(-most), high.min(most)]
    }
}

/// Refuses ranges between which nothing lies.
fn refuses(stated: &Stated<'_>) -> Result<(), NodeError> {
    let params = Params::read(stated.params);
    let ([from0, from1], [to0, to1]) = (params.from, params.to);
    if from0 == from1 {
        return Err(NodeError::failed_with_hint(
            format!("both values of `from` are {from0}, so nothing lies between them"),
            "give `from` two different values",
        ));
    }
    if params.spacing == Spacing::Logarithmic && (to0 <= 0.0 || to1 <= 0.0) {
        return Err(NodeError::failed_with_hint(
            format!("a logarithmic spacing from {to0} to {to1} does not exist"),
            "make both values of `to` greater than 0, or choose `spacing: linear`",
        ));
    }
    Ok(())
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let ([from0, from1], [to0, to1]) = (params.from, params.to);
    refuses(&Stated::of_job(job))?;
    let logarithmic = params.spacing == Spacing::Logarithmic;
    let map = Map {
        from0,
        from1,
        shares: if params.clamp { [0.0, 1.0] } else { [f64::MIN, f64::MAX] },
        to: [to0, to1],
        octaves: if logarithmic { params.octaves() } else { 0.0 },
        ends: params.limits(),
    };
    let mut out = copied(Inputs::read(job)?.value.samples())?;
    blocks(job, [0.0, 1.0], &mut out, |cells, _| {
        if logarithmic {
            logarithmically(cells, &map);
        } else {
            linearly(cells, &map);
        }
    })?;
    Ok(Given { value: Some(Field::new(job.window(), out)) }.into())
}

/// Maps one range to another in double precision: the ends must be exact, and a rate of 1e-12 must be representable.
struct Map {
    from0: f64,
    from1: f64,
    /// Limits of values, as fractions of the range `from`.
    shares: [f64; 2],
    to: [f64; 2],
    /// log₂ of the ratio of the two ends of `to`.
    octaves: f64,
    /// Limits of results.
    ends: [f64; 2],
}

impl Map {
    #[inline(always)]
    fn share(&self, x: f32) -> f64 {
        ((f64::from(x) - self.from0) / (self.from1 - self.from0)).max(self.shares[0]).min(self.shares[1])
    }

    #[inline(always)]
    fn kept(&self, value: f64) -> f32 {
        value.max(self.ends[0]).min(self.ends[1]) as f32
    }
}

simd! {
    fn linearly(cells: &mut [f32], map: &Map) {
        for cell in cells {
            let share = map.share(*cell);
            *cell = map.kept(map.to[0] * (1.0 - share) + map.to[1] * share);
        }
    }
}

simd! {
    fn logarithmically(cells: &mut [f32], map: &Map) {
        for cell in cells {
            *cell = map.kept(map.to[0] * lane::exp2_double(map.octaves * map.share(*cell)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{field, run as result, world};
    use orograph_graph::ParamValue;

    fn remapped(from: [f64; 2], to: [f64; 2], quantity: &'static str, spacing: &'static str, clamp: bool) -> Vec<f32> {
        let input = field(world(5, 1, 1.0), |x, _| (x - 0.5) * 250.0); // 0, 250, 500, 750, 1000
        let mut params = ParamValues::defaults(&NODE.specs());
        params.set("from", ParamValue::Point(from));
        params.set("to", ParamValue::Point(to));
        params.set("quantity", ParamValue::Choice(quantity));
        params.set("spacing", ParamValue::Choice(spacing));
        params.set("clamp", ParamValue::Bool(clamp));
        result(&NODE, &params, &[("value", &input)], "value").samples().to_vec()
    }

    #[test]
    fn values_are_spread_evenly_and_ends_are_exact() {
        assert_eq!(remapped([0.0, 1000.0], [10.0, 20.0], "height", "linear", true), [10.0, 12.5, 15.0, 17.5, 20.0]);
        assert_eq!(remapped([1000.0, 0.0], [10.0, 20.0], "height", "linear", true), [20.0, 17.5, 15.0, 12.5, 10.0]);
        let spread = remapped([0.0, 1000.0], [1e-6, 1e-2], "erodibility", "logarithmic", true);
        for (value, expected) in spread.iter().zip([1e-6_f32, 1e-5, 1e-4, 1e-3, 1e-2]) {
            // error of the library's logarithm, far below the last bit of an f32 away from the ends
            assert!((value / expected - 1.0).abs() < 1e-6, "{value} {expected}");
        }
    }

    #[test]
    fn what_lies_beyond_is_kept_or_goes_on() {
        assert_eq!(remapped([250.0, 750.0], [0.0, 1.0], "scalar", "linear", true), [0.0, 0.0, 0.5, 1.0, 1.0]);
        assert_eq!(remapped([250.0, 750.0], [0.0, 1.0], "scalar", "linear", false), [-0.5, 0.0, 0.5, 1.0, 1.5]);
        assert_eq!(remapped([250.0, 750.0], [0.0, 1.0], "mask", "linear", false), [0.0, 0.0, 0.5, 1.0, 1.0]);
    }
}
