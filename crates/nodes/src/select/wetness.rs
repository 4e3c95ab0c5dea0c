//! Topographic wetness index from drainage area and slope.

use orograph_graph::memory::zeroed;

use super::within;
use crate::{
    numerics::{
        drained::Drained,
        gradient::{Method, Surface},
        math, par,
    },
    prelude::*,
};

params! {
    /// Minimum slope, in metres per metre; gentler ground counts as this steep.
    least_slope: f64 = 0.001, One, 1e-6..=1.0, soft 1e-4..=0.1;
    /// Index from which the mask is 1.
    from: f64 = 10.0, One, -50.0..=50.0, soft 4..=16;
    /// Width of the soft edge below `from`.
    falloff: f64 = 3.0, One, 0.0..=50.0, soft 0..=8;
}

inputs! {
    /// Drainage, from `Flow`.
    flow: Flow;
}

outputs! {
    /// The index ln(a / tan β), with a in metres.
    wetness: Scalar(One);
    /// 1 on wet ground.
    mask: Mask;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Wetness",
    category: "select",
    summary: "Wetness of the ground: the topographic wetness index, and a mask of wet ground.",
    doc: include_str!("wetness.md"),
    sources: &[
        "K. J. Beven and M. J. Kirkby (1979), A physically based, variable contributing area model of basin hydrology, Hydrological \
         Sciences Bulletin 24, 43-69",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|_, cell_m| cell_m),
    scratch: Scratch::PerCell(4.0),
    cpu: run,
    resolution: Resolution::Cells("rivers are one cell wide and slopes are those between neighbouring cells"),
    example: "flow: \"flow.flow\"",
    ..Node::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let drained = Drained::read(Inputs::read(job)?.flow);
    let window = job.window();
    let nx = window.nx();
    let level = Field::new(window, drained.level_m.to_vec());
    let surface = Surface::new(&level, Method::Horn);
    let (cell_m, least) = (job.cell_m() as f32, params.least_slope as f32);
    let mut wetness = zeroed(window.len())?;
    par::rows_within(job, [0.0, 0.8], &mut wetness, |j, row| {
        let area = &drained.area_m2[j * nx..][..nx];
        surface.row(j, |start, east, south| {
            let cells = row[start..].iter_mut().zip(&area[start..]).zip(east.iter().zip(south));
            for ((wetness, &area), (&p, &q)) in cells {
                let slope = (p * p + q * q).sqrt().max(least);
                *wetness = math::f32::ln((area / cell_m).max(f32::MIN_POSITIVE)) - math::f32::ln(slope);
            }
        });
    })?;
    let wants = Wants::of(job);
    let mask = |_, row: &mut [f32]| within(row, [params.from as f32, f32::MAX], params.falloff as f32);
    let field = |samples| Field::new(window, samples);
    Ok(Given {
        mask: wants
            .mask
            .then(|| par::rows_from(job, [0.8, 1.0], &mut wetness, wants.wetness, mask))
            .transpose()?
            .map(field),
        wetness: wants.wetness.then(|| field(wetness)),
    }
    .into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        hydrology::flow,
        testing::{field, run as result, run_in, with_params, world},
    };

    /// On a plane, each cell drains the k cells above it: ln(k d / s).
    #[test]
    fn a_plane_gets_wetter_by_the_logarithm_of_its_length() {
        for (slope, counts_as) in [(0.125, 0.125), (0.000_01, 0.001)] {
            let land = field(world(12, 60, 8.0), |_, y| 500.0 - slope * y);
            let drained =
                result(&flow::NODE, &with_params(&flow::NODE, "depressions=keep"), &[("height", &land)], "flow");
            let found = result(&NODE, &with_params(&NODE, ""), &[("flow", &drained)], "wetness");
            for j in 1..58 {
                let row = Drained::read(&drained).area_m2[j * 12 + 6] / 64.0;
                let expected = libm::log(f64::from(row) * 8.0 / counts_as);
                let index = f64::from(found.samples()[j * 12 + 6]);
                // heights in single precision
                assert!((index - expected).abs() < 1e-3, "{slope} {j}: {index} {expected}");
                // the first row is a base side, whose cells have no receiver
                assert!(slope < 0.1 || (row - j as f32).abs() < 1.5, "{j}: {row}");
            }
        }
    }

    #[test]
    fn the_mask_rises_below_its_threshold() {
        let land = field(world(80, 80, 20.0), |x, y| 100.0 + 0.2 * y + 30.0 * libm::sin(x / 90.0));
        let drained = result(&flow::NODE, &with_params(&flow::NODE, "routing=mfd"), &[("height", &land)], "flow");
        let params = with_params(&NODE, "from=9,falloff=2");
        let index = result(&NODE, &params, &[("flow", &drained)], "wetness");
        let mask = result(&NODE, &params, &[("flow", &drained)], "mask");
        for (index, mask) in index.samples().iter().zip(mask.samples()) {
            assert!(index.is_finite());
            assert_eq!(*index >= 9.0, *mask == 1.0, "{index} {mask}");
            assert!(*index > 7.0 || *mask == 0.0, "{index} {mask}");
        }
        assert_eq!(run_in(1, &NODE, &params, &[("flow", &drained)]), run_in(3, &NODE, &params, &[("flow", &drained)]));
    }
}
