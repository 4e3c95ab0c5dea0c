//! Removes spikes and pits: cells that differ from the median of their neighbourhood; see [`crate::numerics::rank`].

use super::mix;
use crate::numerics::{
    par,
    rank::{Beyond, rank, reach_m},
};
use crate::prelude::*;

choice! {
    /// Which outliers are removed.
    pub enum Side {
        /// Spikes and pits.
        Both = "both",
        /// Cells above their surroundings.
        Spikes = "spikes",
        /// Cells below their surroundings.
        Pits = "pits",
    }
}

params! {
    /// Distance within which values count; spikes must be narrower than half of it.
    radius: f64 = 50.0, Metres, 0.0..=1e5, soft 10..=500;
    /// Local standard deviations by which a cell must differ from the median to be removed.
    threshold: f64 = 5.0, One, 0.0..=1000.0, soft 2..=20;
    /// Height added to the limit that `threshold` sets: smaller deviations are never removed.
    prominence: f64 = 2.0, Metres, 0.0..=1e5, soft 0..=50;
    /// Which outliers are removed.
    side: Side = Side::Both, One, ..;
}

inputs! {
    /// Terrain height.
    height: Height;
    /// Where spikes are removed: fully at 1, not at all at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// Terrain without spikes and pits.
    height: Height;
    /// 1 where a spike or a pit was.
    removed: Mask;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Despike",
    category: "filter",
    summary: "Removes single spikes and pits and leaves all other cells as they are.",
    doc: include_str!("despike.md"),
    sources: &[
        "F. R. Hampel (1974), The influence curve and its role in robust estimation, Journal of the American Statistical \
         Association 69, 383-393",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|params, cell_m| 2.0 * reach_m(Params::read(params).radius, cell_m)),
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    resolution: Resolution::Cells("spikes are single cells"),
    example: "height: \"base\", radius: 700, threshold: 2.5",
    ..Node::DEFAULT
};

/// Standard deviations of a Gaussian per median absolute deviation.
const DEVIATIONS: f32 = 1.482_602_2;

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let wants = Wants::among(sizing.wanted);
    // medians, and absolute deviations from them, whose medians are computed next
    let ranked = sizing.cells(8.0) + crate::numerics::rank::bytes(&sizing.window, Params::read(sizing.params).radius);
    ranked.max(sizing.cells(16.0)) - sizing.cells(4.0 * wants.count() as f64)
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { height, mask } = Inputs::read(job)?;
    let params = Params::read(job.params);
    let height = height.samples();
    let median = rank(job, [0.0, 0.45], height, params.radius, 0.5, Beyond::Straight)?;
    let distances = par::map(height.len(), |at| (height[at] - median[at]).abs());
    let usual = rank(job, [0.45, 0.9], &distances, params.radius, 0.5, Beyond::Mirrored)?;
    let removed = par::map(height.len(), |at| {
        let (z, m, usual) = (height[at], median[at], usual[at]);
        let most = params.threshold as f32 * DEVIATIONS * usual + params.prominence as f32;
        let above = match params.side {
            Side::Both => (z - m).abs(),
            Side::Spikes => z - m,
            Side::Pits => m - z,
        };
        if above > most { 1.0 } else { 0.0 }
    });
    drop((distances, usual));
    let wants = Wants::of(job);
    let field = |samples| Field::new(job.window(), samples);
    let despiked = || {
        let mut out = par::map(height.len(), |at| if removed[at] > 0.0 { median[at] } else { height[at] });
        mix(job, height, &mut out, mask).map(|()| field(out))
    };
    Ok(Given { height: wants.height.then(despiked).transpose()?, removed: wants.removed.then(|| field(removed)) }
        .into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{field, run as result, with_params, world};

    /// Spikes and pits on a cliff and on a plain are removed, and all other cells keep their bits.
    #[test]
    fn spikes_go_and_all_else_keeps_its_bits() {
        let land = |x: f64, y: f64| 0.8 * x + 20.0 * libm::sin(x * 0.02) * libm::cos(y * 0.015);
        let spike = |x: f64, y: f64| {
            if (x - 102.5).abs() < 1.0 && (y - 52.5).abs() < 1.0 {
                60.0
            } else if (x - 302.5).abs() < 3.0 && (y - 252.5).abs() < 6.0 {
                -45.0
            } else {
                0.0
            }
        };
        let world = world(90, 80, 5.0);
        let (clean, dirty) = (field(world, land), field(world, |x, y| land(x, y) + spike(x, y)));
        let params = with_params(&NODE, "radius=25");
        let found = result(&NODE, &params, &[("height", &dirty)], "height");
        let removed = result(&NODE, &params, &[("height", &dirty)], "removed");
        for (at, (&found, &clean)) in found.samples().iter().zip(clean.samples()).enumerate() {
            if clean == dirty.samples()[at] {
                assert_eq!((found, removed.samples()[at]), (clean, 0.0), "{at}");
            } else {
                // the median is a value from up to 25 m away
                assert!((found - clean).abs() < 6.0 && removed.samples()[at] == 1.0, "{at}: {found} {clean}");
            }
        }
        let spikes = result(&NODE, &with_params(&NODE, "radius=25,side=spikes"), &[("height", &dirty)], "removed");
        assert_eq!(spikes.samples().iter().sum::<f32>(), 1.0);
        assert_eq!(result(&NODE, &params, &[("height", &clean)], "height"), clean);
    }

    #[test]
    fn nothing_changes_where_nothing_may() {
        let rough = field(world(40, 19, 5.0), |x, y| 900.0 * libm::sin(x * y));
        for changes in ["radius=4", "threshold=1000", "prominence=100000"] {
            assert_eq!(result(&NODE, &with_params(&NODE, changes), &[("height", &rough)], "height"), rough);
        }
    }
}
