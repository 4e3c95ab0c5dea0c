//! The median of the neighbourhood, or any other percentile; see [`crate::numerics::rank`].

use super::mix;
use crate::numerics::rank::{Beyond, rank, reach_m};
use crate::prelude::*;

params! {
    /// Distance within which values count.
    radius: f64 = 100.0, Metres, 0.0..=1e6, soft 0..=1000;
    /// Percentage of the values around a place that are lower than the result.
    ///
    /// 50 for the median, 0 for the lowest of all, 100 for the highest.
    percentile: f64 = 50.0, One, 0.0..=100.0;
}

inputs! {
    /// Field to smooth.
    value: AnyScalar;
    /// Strength of the smoothing: full at 1, none at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// The medians, with the meaning of the input.
    value: SameAs(value);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Median",
    category: "filter",
    summary: "Replaces each value by the median of the values around it: smooths and keeps edges.",
    doc: include_str!("median.md"),
    sources: &[
        "B. Weiss (2025), Fast isotropic median filtering, SIGGRAPH Conference Papers, arXiv:2505.22938",
        "K. E. Batcher (1968), Sorting networks and their applications, AFIPS Spring Joint Computer Conference, 307-314",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|params, cell_m| reach_m(Params::read(params).radius, cell_m)),
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    example: "value: \"base\", radius: 900",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    // the result is an output, not scratch memory
    crate::numerics::rank::bytes(&sizing.window, Params::read(sizing.params).radius) - sizing.cells(4.0)
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { value, mask } = Inputs::read(job)?;
    let params = Params::read(job.params);
    let mut out = rank(job, [0.0, 0.9], value.samples(), params.radius, 0.01 * params.percentile, Beyond::Mirrored)?;
    mix(job, value.samples(), &mut out, mask)?;
    Ok(Given { value: Some(Field::new(job.window(), out)) }.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{at_every_level, field, run as result, run_in, with_params, world};

    /// A wall keeps its bits and a line of one cell disappears, whatever the radius.
    #[test]
    fn edges_stay_and_lines_go() {
        let wall = |x: f64| if x < 200.0 { 100.0 } else { 731.0 };
        let edge = field(world(80, 60, 5.0), |x, _| wall(x));
        let line = field(world(80, 60, 5.0), |x, y| if (y - 152.5).abs() < 1.0 { 5000.0 } else { wall(x) });
        for radius in [7.5, 11.0, 18.5, 40.0, 90.0] {
            let params = with_params(&NODE, &format!("radius={radius}"));
            assert_eq!(result(&NODE, &params, &[("value", &edge)], "value"), edge, "{radius}");
            let found = result(&NODE, &params, &[("value", &line)], "value");
            assert!(found.range(0).expect("finite").1 <= 731.0, "{radius}");
        }
    }

    #[test]
    fn nothing_changes_below_a_cell_or_without_a_mask() {
        let hills = field(world(40, 9, 5.0), |x, y| libm::sin(x * y));
        assert_eq!(result(&NODE, &with_params(&NODE, "radius=4.9"), &[("value", &hills)], "value"), hills);
        let nowhere = field(world(40, 9, 5.0), |_, _| 0.0);
        let fields = [("value", &hills), ("mask", &nowhere)];
        assert_eq!(result(&NODE, &with_params(&NODE, "radius=30"), &fields, "value"), hills);
    }

    /// The maximum within a radius is never below that of a smaller circle, and the minimum is that of the negative,
    /// negated.
    #[test]
    fn extremes_are_mirror_images() {
        let hills = field(world(90, 70, 5.0), |x, y| 100.0 * libm::sin(x * 0.07) * libm::cos(y * 0.2));
        let mirrored = field(world(90, 70, 5.0), |x, y| -100.0 * libm::sin(x * 0.07) * libm::cos(y * 0.2));
        let most = result(&NODE, &with_params(&NODE, "radius=35,percentile=100"), &[("value", &hills)], "value");
        let least = result(&NODE, &with_params(&NODE, "radius=35,percentile=0"), &[("value", &mirrored)], "value");
        assert!(most.samples().iter().zip(least.samples()).all(|(a, b)| *a == -*b));
        assert!(most.samples().iter().zip(hills.samples()).all(|(most, value)| most >= value));
    }

    #[test]
    fn windows_threads_and_widths_of_vectors_give_the_same_bits() {
        let hills = field(world(150, 140, 5.0), |x, y| 300.0 * libm::sin(x * 0.05 + y * 0.02) * libm::cos(y * 0.3));
        for radius in [7.0, 45.0, 800.0] {
            let params = with_params(&NODE, &format!("radius={radius}"));
            let whole = result(&NODE, &params, &[("value", &hills)], "value");
            let part = Window { origin: [63, 57], cells: [40, 30], ..*hills.window() };
            let grown = hills.crop(&part.grown(reach_m(radius, 5.0)));
            assert_eq!(result(&NODE, &params, &[("value", &grown)], "value").crop(&part), whole.crop(&part));
            assert_eq!(
                run_in(1, &NODE, &params, &[("value", &hills)]),
                run_in(3, &NODE, &params, &[("value", &hills)])
            );
            at_every_level(|| run_in(2, &NODE, &params, &[("value", &hills)]));
        }
    }
}
