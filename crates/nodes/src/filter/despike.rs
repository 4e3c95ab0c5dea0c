//! Spikes and pits taken out: cells that stand out from the median around them; see [`super::rank`].

use rayon::prelude::*;

use super::{
    mix,
    rank::{Beyond, rank, reach_m},
};
use crate::prelude::*;

choice! {
    /// What is taken out.
    pub enum Side {
        /// Spikes and pits.
        Both = "both",
        /// What stands above its surroundings.
        Spikes = "spikes",
        /// What lies below them.
        Pits = "pits",
    }
}

params! {
    /// Distance within which values count; spikes must be narrower than half of that.
    radius: f64 = 50.0, Metres, 0.0..=1e5, soft 10..=500;
    /// How many times as far as usual around it a place must be from the median to be taken out.
    threshold: f64 = 5.0, One, 0.0..=1000.0, soft 2..=20;
    /// How far from the median it must be at least.
    prominence: f64 = 2.0, Metres, 0.0..=1e5, soft 0..=50;
    /// What is taken out.
    side: Side = Side::Both, One, ..;
}

inputs! {
    /// The land.
    height: Height;
    /// Where spikes are looked for: fully at 1, not at all at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// The land without them.
    height: Height;
    /// 1 where a spike or a pit was.
    removed: Mask;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Despike",
    category: "filter",
    summary: "Takes single spikes and pits out of land and leaves all other cells as they are.",
    doc: "With m the median of the heights within the `radius` and s the median of |z − m| within the same radius, times 1.4826, \
          a place that is farther than `threshold` · s + `prominence` from m becomes m; everything else keeps its bits. s is the \
          standard deviation where heights are spread as a Gaussian, but no spike can raise it.\n\n\
          What differs from the filter of Hampel: each place's deviation is taken from its own median, so that a slope is no \
          deviation and spikes are found on cliffs as on plains. Beyond the edges of the world slopes go on.\n\n\
          **Advice.** For scanned land with errors: birds, masts, sparks of a radar. `removed` shows what was taken out; when it \
          shows crests, raise `threshold` or choose a smaller radius. A radius below one cell changes nothing.",
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
    resolution: Resolution::Cells("a spike is a matter of single cells"),
    example: "height: \"base\", radius: 700, threshold: 2.5",
    ..Node::DEFAULT
};

/// Standard deviations of a Gaussian per median of the distances from its middle.
const DEVIATIONS: f32 = 1.482_602_2;

/// What the kernel holds beside its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let wants = Wants::among(sizing.wanted);
    // medians and distances from them, whose medians are sought
    let ranked = sizing.cells(8.0) + super::rank::bytes(&sizing.window, Params::read(sizing.params).radius);
    ranked.max(sizing.cells(16.0)) - sizing.cells(4.0 * wants.count() as f64)
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { height, mask } = Inputs::read(job)?;
    let params = Params::read(job.params);
    let height = height.samples();
    let median = rank(job, [0.0, 0.45], height, params.radius, 0.5, Beyond::Straight)?;
    let distances: Vec<f32> = height.par_iter().zip(&median).map(|(z, m)| (z - m).abs()).collect();
    let usual = rank(job, [0.45, 0.9], &distances, params.radius, 0.5, Beyond::Mirrored)?;
    let removed: Vec<f32> = height
        .par_iter()
        .zip(&median)
        .zip(&usual)
        .map(|((z, m), usual)| {
            let most = params.threshold as f32 * DEVIATIONS * usual + params.prominence as f32;
            let above = match params.side {
                Side::Both => (z - m).abs(),
                Side::Spikes => z - m,
                Side::Pits => m - z,
            };
            if above > most { 1.0 } else { 0.0 }
        })
        .collect();
    drop((distances, usual));
    let wants = Wants::of(job);
    let field = |samples| Field::new(job.window(), samples);
    let despiked = || {
        let cells = height.par_iter().zip(&median).zip(&removed);
        let mut out: Vec<f32> = cells.map(|((z, m), removed)| if *removed > 0.0 { *m } else { *z }).collect();
        mix(job, height, &mut out, mask).map(|()| field(out))
    };
    Ok(Given { height: wants.height.then(despiked).transpose()?, removed: wants.removed.then(|| field(removed)) }
        .into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{field, run as result, with_params, world};

    /// Spikes and pits on a cliff and on a plain go, and nothing else changes by a bit.
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
                // the median is that of places up to 25 m away
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
