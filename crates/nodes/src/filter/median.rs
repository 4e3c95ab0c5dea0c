//! The median of the surroundings, or any other percentile; see [`super::rank`].

use super::{
    mix,
    rank::{Beyond, rank, reach_m},
};
use crate::prelude::*;

params! {
    /// Distance within which values count.
    radius: f64 = 100.0, Metres, 0.0..=1e6, soft 0..=1000;
    /// Share of the values around a place, in percent, that is lower than what it becomes.
    ///
    /// 50 for the median, 0 for the lowest of all, 100 for the highest.
    percentile: f64 = 50.0, One, 0.0..=100.0;
}

inputs! {
    /// What is smoothed.
    value: AnyScalar;
    /// Where it is smoothed: fully at 1, not at all at 0.
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
    summary: "Gives each place the middle one of the values around it: smooths and keeps edges.",
    doc: "The values whose places are within the `radius` are put in order, and the place takes the one in the middle, or at \
          another `percentile`. Half of the surroundings may be wrong without an effect: spikes, pits and noise go, while the \
          edge of a cliff or a mask stays where it is and stays sharp. What is narrower than the radius goes as a whole; corners \
          are rounded.\n\n\
          With `percentile` 0 and 100 it is the lowest and the highest value within the radius: the first widens valleys and \
          the dark parts of masks, the second crests and the bright parts; one after the other closes gaps or removes specks.\n\n\
          The result is exact: one of the values of the land, up to a radius of 128 cells. The surroundings are a circle; above \
          3.6 cells one of four steps, which has the same area and an edge within 8 % of the radius. Wider ones are counted in \
          coarser cells of a 128th of the radius. A radius of 64 cells takes some three times as long as one of 4. At the edges of \
          the world the land is mirrored; where the world is periodic it goes on at the other side. A radius below one cell \
          changes nothing.",
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

/// What the kernel holds beside its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    // without the result
    super::rank::bytes(&sizing.window, Params::read(sizing.params).radius) - sizing.cells(4.0)
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

    /// A wall stays to the bit, a line of one cell goes, whatever the radius.
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

    /// The largest value within a radius is never below a smaller circle's, and the least is its mirror image.
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
