//! A mask of a range of values: heights, areas, depths, distances or any other field.

use orograph_graph::memory::zeroed;

use super::within;
use crate::{
    numerics::{math, par},
    prelude::*,
    wgsl,
};

choice! {
    /// Scale of the range and its edges.
    pub enum Scale {
        /// Differences count.
        Linear = "linear",
        /// Ratios count, for quantities that span powers of ten, such as drainage area; values of 0 and less are
        /// below any range.
        Logarithmic = "logarithmic",
    }
}

params! {
    /// Lowest value that is fully selected.
    from: f64 = 1000.0, One, -1e12..=1e12, soft -1000..=5000;
    /// Highest value that is fully selected.
    to: f64 = 1e12, One, -1e12..=1e12, soft -1000..=5000;
    /// Width of the soft edge outside each end of the range, in the unit of the values.
    ///
    /// On a logarithmic scale, it is measured in powers of ten.
    falloff: f64 = 50.0, One, 0.0..=1e12, soft 0..=500;
    /// Scale of the range and its edges.
    scale: Scale = Scale::Linear, One, ..;
    /// Selects what lies outside the range instead.
    invert: bool = false, One, ..;
}

inputs! {
    /// Field to select from.
    value: AnyScalar;
}

outputs! {
    /// 1 where the value is within the range.
    mask: Mask;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Select",
    category: "select",
    summary: "A mask of a range of values: heights, areas, depths or any other field.",
    doc: include_str!("select.md"),
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    refuses: Some(refuses),
    cpu: run,
    gpu: Some(&GPU),
    example: "value: \"base\", from: 800, to: 1400, falloff: 150",
    ..Node::DEFAULT
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&Shader {
        name: "select/select",
        source: wgsl!("select/select"),
        library: &[wgsl::MATH, wgsl::WITHIN],
        values: &[("low", Number::F32), ("high", Number::F32)],
        slots: &[Slot::input("value"), Slot::output("mask")],
    }],
    passes: Passes::point(|job| {
        let [low, high] = Params::read(job.params).range();
        vec![("low", Scalar::F32(low)), ("high", Scalar::F32(high))]
    }),
    covers: |params| {
        let params = Params::read(params);
        params.from <= params.to
    },
    // on a logarithmic scale a sharp edge lies between two numbers
    tolerance: &[Tolerance::absolute(1e-4).except(0.005)],
    ..GpuKernel::DEFAULT
};

impl Params {
    /// Returns the range on its scale.
    fn range(&self) -> [f32; 2] {
        let end = |value: f64| if self.scale == Scale::Logarithmic { order(value as f32) } else { value as f32 };
        [end(self.from), end(self.to)]
    }
}

/// Refuses a range that falls.
fn refuses(stated: &Stated<'_>) -> Result<(), NodeError> {
    let params = Params::read(stated.params);
    if params.from > params.to {
        return Err(NodeError::failed_with_hint(
            format!("`from` is {}, above `to`, {}", params.from, params.to),
            "exchange the two, and set `invert: true` to select what is outside",
        ));
    }
    Ok(())
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    refuses(&Stated::of_job(job))?;
    let logarithmic = params.scale == Scale::Logarithmic;
    let range = params.range();
    let (values, nx) = (Inputs::read(job)?.value.samples(), job.window().nx());
    let mut mask = zeroed(values.len())?;
    par::rows(job, &mut mask, |j, row| {
        row.copy_from_slice(&values[j * nx..][..nx]);
        if logarithmic {
            row.iter_mut().for_each(|value| *value = order(*value));
        }
        within(row, range, params.falloff as f32);
        if params.invert {
            row.iter_mut().for_each(|mask| *mask = 1.0 - *mask);
        }
    })?;
    Ok(Given { mask: Some(Field::new(job.window(), mask)) }.into())
}

/// Returns the decimal logarithm, or a value below all others for values that have none.
fn order(value: f32) -> f32 {
    if value > 0.0 { math::f32::log10(value) } else { -1e6 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{field, outputs, run as result, with_params, world};

    #[test]
    fn edges_are_as_wide_as_asked() {
        let value = field(world(400, 2, 1.0), |x, _| x * 10.0 - 5.0); // 0, 10, 20, ...
        let mask = |changes: &str| result(&NODE, &with_params(&NODE, changes), &[("value", &value)], "mask");
        let linear = mask("from=1000,to=2000,falloff=200");
        for (at, expected) in
            [(79, 0.0), (80, 0.0), (90, 0.5), (100, 1.0), (150, 1.0), (200, 1.0), (210, 0.5), (221, 0.0)]
        {
            assert_eq!(linear.samples()[at], expected, "{at}");
        }
        let inverted = mask("from=1000,to=2000,falloff=200,invert=true");
        assert!(linear.samples().iter().zip(inverted.samples()).all(|(a, b)| a + b == 1.0));
        // from 100 upwards on a logarithmic scale: half selected at 100 / √10
        let ratio = mask("from=100,falloff=1,scale=logarithmic");
        assert_eq!((ratio.samples()[0], ratio.samples()[1], ratio.samples()[10]), (0.0, 0.0, 1.0));
        assert!((ratio.samples()[3] - 0.466).abs() < 1e-3, "30 is 0.477 of the way from 10"); // 3 t² − 2 t³ at 0.477
    }

    #[test]
    fn an_empty_range_is_refused() {
        let value = field(world(2, 2, 1.0), |_, _| 0.0);
        assert!(outputs(&NODE, &with_params(&NODE, "from=5,to=4"), &[("value", &value)]).is_err());
        let point = result(&NODE, &with_params(&NODE, "from=0,to=0,falloff=0"), &[("value", &value)], "mask");
        assert_eq!(point.samples(), [1.0; 4]);
    }
}
