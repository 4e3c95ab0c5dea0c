//! Resamples a field on coarser cells; see [`crate::numerics::coarse`].

use super::mix;
use crate::numerics::coarse::{Between, Coarse};
use crate::prelude::*;

choice! {
    /// Interpolation between the centres of coarse cells.
    pub enum Interpolation {
        /// Every place takes the value of its coarse cell: squares.
        Cells = "cells",
        /// Linear from centre to centre.
        Linear = "linear",
        /// The smooth cubic of Catmull and Rom through the centres.
        Cubic = "cubic",
    }
}

params! {
    /// Side of the coarse cells, rounded so that a whole number of them fits the world.
    cell: f64 = 200.0, Metres, 1e-3..=1e6, soft 10..=2000;
    /// Interpolation between the centres of coarse cells.
    interpolation: Interpolation = Interpolation::Cubic, One, ..;
}

inputs! {
    /// Field to resample.
    value: AnyScalar;
    /// Where the result replaces the input: fully at 1, not at all at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// The resampled values, with the meaning of the input.
    value: SameAs(value);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Resample",
    category: "filter",
    summary: "Resamples a field to coarser cells.",
    doc: include_str!("resample.md"),
    sources: &["E. Catmull and R. Rom (1974), A class of local interpolating splines"],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    // two coarse cells on either side, each up to one and a half times the requested size
    reach: Reach::Metres(|params, cell_m| {
        let coarse_m = Params::read(params).cell;
        if coarse_m <= cell_m { 0.0 } else { 4.5 * coarse_m + cell_m }
    }),
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    example: "value: \"base\", cell: 1024",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let params = Params::read(sizing.params);
    let coarser = params.cell / sizing.window.cell_m();
    if coarser <= 1.0 { 0 } else { sizing.cells(4.0 / (coarser * coarser)) }
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { value, mask } = Inputs::read(job)?;
    let params = Params::read(job.params);
    if params.cell <= job.cell_m() {
        return Ok(Given { value: Some(value.clone()) }.into());
    }
    let between = match params.interpolation {
        Interpolation::Cells => Between::Cells,
        Interpolation::Linear => Between::Linear,
        Interpolation::Cubic => Between::Cubic,
    };
    let coarse = Coarse::new(&job.window(), params.cell / job.cell_m());
    let means = coarse.means(job, value.samples())?;
    let mut out = coarse.spread(job, [0.4, 0.9], &means, between)?;
    mix(job, value.samples(), &mut out, mask)?;
    Ok(Given { value: Some(Field::new(job.window(), out)) }.into())
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge, World};

    use super::*;
    use crate::testing::{block_means, field, moments, reach_m, run as result, with_params, world};

    fn hills(cells: u32) -> Field {
        let world = World { boundary: Boundary::all(Edge::Periodic), ..world(cells, cells, 960.0 / f64::from(cells)) };
        field(world, |x, y| {
            let turn = std::f64::consts::TAU / 960.0;
            900.0 + 100.0 * libm::sin(2.0 * x * turn) * libm::cos(3.0 * y * turn) + 9.0 * libm::cos(31.0 * x * turn)
        })
    }

    /// Square cells have the mean of the terrain, at any resolution of the world; resampling twice changes nothing.
    #[test]
    fn squares_are_means() {
        let params = with_params(&NODE, "cell=60,interpolation=cells");
        for cells in [96, 192] {
            let land = hills(cells);
            let found = result(&NODE, &params, &[("value", &land)], "value");
            let side = cells as usize / 16;
            for (square, (mean, (found_mean, spread))) in block_means(&land, side)
                .iter()
                .zip(block_means(&found, side).iter().zip(spreads(&found, side)))
                .enumerate()
            {
                assert!((mean - found_mean).abs() < 1e-3 && spread == 0.0, "{square}: {mean} {found_mean} {spread}");
            }
            assert_eq!(result(&NODE, &params, &[("value", &found)], "value"), found);
        }
    }

    fn spreads(field: &Field, side: usize) -> Vec<f32> {
        let nx = field.window().nx();
        let squares = (0..nx / side).flat_map(|j| (0..nx / side).map(move |i| (i * side, j * side)));
        let spread = |(x, y)| {
            let at = |j: usize, i: usize| -> f32 { field.samples()[(y + j) * nx + x + i] };
            (0..side * side).map(|k| (at(k / side, k % side) - at(0, 0)).abs()).fold(0.0_f32, f32::max)
        };
        squares.map(spread).collect()
    }

    /// Linear terrain stays linear between centres, and waves much longer than a coarse cell are preserved.
    #[test]
    fn long_waves_and_means_stay() {
        let land = hills(192);
        for interpolation in ["cubic", "linear"] {
            let params = with_params(&NODE, &format!("cell=20,interpolation={interpolation}"));
            let found = result(&NODE, &params, &[("value", &land)], "value");
            assert!((moments(found.samples()).0 - moments(land.samples()).0).abs() < 1e-3);
            // a wave of one and a half coarse cells loses 9 m
            assert!(found.samples().iter().zip(land.samples()).all(|(a, b)| (a - b).abs() < 14.0));
        }
        let level = field(world(50, 30, 7.0), |_, _| 812.3);
        for interpolation in ["cells", "linear", "cubic"] {
            let params = with_params(&NODE, &format!("cell=33,interpolation={interpolation}"));
            assert_eq!(result(&NODE, &params, &[("value", &level)], "value"), level);
        }
    }

    #[test]
    fn nothing_changes_on_cells_of_that_size() {
        let land = hills(96);
        assert_eq!(result(&NODE, &with_params(&NODE, "cell=10"), &[("value", &land)], "value"), land);
        let most = result(&NODE, &with_params(&NODE, "cell=1000000"), &[("value", &land)], "value");
        let (mean, spread) = moments(most.samples());
        assert!((mean - moments(land.samples()).0).abs() < 1e-3 && spread < 1e-3);
    }

    #[test]
    fn windows_give_the_same_bits() {
        let land = field(world(190, 170, 7.0), |x, y| 300.0 * libm::sin(x * 0.05 + y * 0.02) * libm::cos(y * 0.3));
        for cell in [10.0, 33.0, 200.0] {
            for interpolation in ["cells", "linear", "cubic"] {
                let params = with_params(&NODE, &format!("cell={cell},interpolation={interpolation}"));
                let whole = result(&NODE, &params, &[("value", &land)], "value");
                let part = Window { origin: [83, 77], cells: [40, 30], ..*land.window() };
                let grown = land.crop(&part.grown(reach_m(&NODE, &params, 7.0)));
                assert_eq!(result(&NODE, &params, &[("value", &grown)], "value").crop(&part), whole.crop(&part));
            }
        }
    }
}
