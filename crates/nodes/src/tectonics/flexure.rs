//! Bending of the lithosphere under loads of rock.
//!
//! D. L. Turcotte and G. Schubert (2002), "Geodynamics": a thin elastic plate on a fluid, `D ∇⁴w + (ρₘ − ρ_f) g w =
//! q`, solved in wave numbers: `ŵ = q̂ / (D k⁴ + (ρₘ − ρ_f) g)`. The plate continues beyond the world without load.

mod device;

use orograph_graph::memory::zeroed;

use crate::{
    numerics::{fourier::grid::Grid, math, par},
    prelude::*,
};

choice! {
    /// Filling of the depression that a load makes.
    pub enum Fill {
        /// Nothing: 0 kg/m³.
        Air = "air",
        /// The sea: 1030 kg/m³.
        Water = "water",
        /// Sediment: 2300 kg/m³.
        Sediment = "sediment",
    }
}

params! {
    /// Elastic thickness of the lithosphere; 0 lets each place float independently.
    elastic_thickness: f64 = 15000.0, Metres, 0.0..=100000.0, soft 2000.0..=50000.0;
    /// Filling of the depression that a load makes.
    fill: Fill = Fill::Air, One, ..;
}

inputs! {
    /// Thickness of rock added; negative where rock is removed.
    load: Scalar(Metres);
}

outputs! {
    /// Upward movement of the terrain.
    deflection: Scalar(Metres);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Flexure",
    category: "tectonics",
    summary: "Bends the lithosphere under added rock and lets it rebound where rock is removed.",
    doc: include_str!("flexure.md"),
    sources: &[
        "D. L. Turcotte and G. Schubert (2002), Geodynamics, 2nd edition, Cambridge University Press, chapter 3",
        "A. B. Watts (2001), Isostasy and Flexure of the Lithosphere, Cambridge University Press",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    gpu: Some(&device::GPU),
    example: "load: \"base\", elastic_thickness: 2000",
    ..Node::DEFAULT
};

/// Young's modulus in Pa.
const YOUNG: f64 = 7e10;
/// Poisson's ratio.
const POISSON: f64 = 0.25;
/// Density of the crust in kg/m³.
const CRUST: f64 = 2700.0;
/// Density of the mantle in kg/m³.
const MANTLE: f64 = 3300.0;
/// Gravity in m/s².
const GRAVITY: f64 = 9.81;

/// Minimum number of cells per α, if the raster has them.
const CELLS_PER_ALPHA: f64 = 16.0;
/// Margin without load around the world in units of α: deflections decay to e⁻⁶, 0.25 %, across it.
const MARGIN: f64 = 6.0;

/// A plate on a fluid.
#[derive(Clone, Copy)]
struct Plate {
    /// Flexural rigidity D in N m.
    rigidity: f64,
    /// Specific weight of the displaced mantle less that of the filling, in N/m³: the restoring force per metre of
    /// deflection.
    restoring: f64,
}

impl Params {
    fn plate(&self) -> Plate {
        let fill = match self.fill {
            Fill::Air => 0.0,
            Fill::Water => 1030.0,
            Fill::Sediment => 2300.0,
        };
        let thickness = self.elastic_thickness;
        Plate {
            rigidity: YOUNG * thickness * thickness * thickness / (12.0 * (1.0 - POISSON * POISSON)),
            restoring: (MANTLE - fill) * GRAVITY,
        }
    }
}

impl Plate {
    /// Deflection of a load that is much wider than α, in metres per metre.
    fn local(&self) -> f64 {
        -CRUST * GRAVITY / self.restoring
    }

    /// The flexural parameter α in metres.
    fn alpha_m(&self) -> f64 {
        (4.0 * self.rigidity / self.restoring).sqrt().sqrt()
    }
}

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let plate = Params::read(sizing.params).plate();
    if plate.rigidity == 0.0 {
        return 0;
    }
    // two complex grids during the transposition, before the deflection is allocated
    let (_, side) = plate.grid(&sizing.window);
    let grid = (side * side * size_of::<[f64; 2]>()) as u64;
    (2 * grid).saturating_sub(sizing.cells(4.0)).max(grid)
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let plate = Params::read(job.params).plate();
    let window = job.window();
    let load = Inputs::read(job)?.load.samples();
    if plate.rigidity == 0.0 {
        let local = plate.local() as f32;
        let mut deflection = zeroed(window.len())?;
        par::rows(job, &mut deflection, |j, row| {
            for (value, load) in row.iter_mut().zip(&load[j * window.nx()..]) {
                *value = local * load;
            }
        })?;
        return Ok(Given { deflection: Some(Field::new(window, deflection)) }.into());
    }
    let (coarser, side) = plate.grid(&window);
    let grid = Grid { side, values: restricted(load, window.nx(), coarser, side)? };
    // from waves across the grid to radians per metre
    let per_metre = std::f64::consts::TAU / (side as f64 * coarser as f64 * job.cell_m());
    let bent = grid.convolve(job, |m, n| {
        let square = (m * m + n * n) * per_metre * per_metre;
        -CRUST * GRAVITY / (plate.rigidity * square * square + plate.restoring)
    })?;
    let columns: Vec<Taps> = (0..window.nx()).map(|i| Taps::new(i, coarser, side)).collect();
    let mut deflection = zeroed(window.len())?;
    par::rows_within(job, [0.9, 1.0], &mut deflection, |j, row| {
        let rows = Taps::new(j, coarser, side);
        for (value, column) in row.iter_mut().zip(&columns) {
            *value = rows.sum(|j| column.sum(|i| bent.values[j * side + i][0])) as f32;
        }
    })?;
    Ok(Given { deflection: Some(Field::new(window, deflection)) }.into())
}

impl Plate {
    /// Returns the number of window cells per cell of the bent grid along a side, and the number of cells along a side
    /// of that grid.
    fn grid(&self, window: &Window) -> (usize, usize) {
        // a limit on stiff plates over tiny cells, which keeps the sizes representable
        let alpha_cells = (self.alpha_m() / window.cell_m()).min(1e9);
        let mut coarser = 1;
        while 2.0 * coarser as f64 * CELLS_PER_ALPHA <= alpha_cells {
            coarser *= 2;
        }
        // two more cells for the interpolation
        let margin = (MARGIN * alpha_cells / coarser as f64).ceil() as usize + 2;
        (coarser, (window.nx().max(window.ny()).div_ceil(coarser) + margin).next_power_of_two())
    }
}

/// Computes means of squares of `coarser` cells, in the corner of a grid of zeros.
fn restricted(load: &[f32], nx: usize, coarser: usize, side: usize) -> Result<Vec<[f64; 2]>, NodeError> {
    let mut grid: Vec<[f64; 2]> = zeroed(side * side)?;
    let share = 1.0 / (coarser as f64 * coarser as f64);
    for (j, row) in load.chunks_exact(nx).enumerate() {
        let out = &mut grid[j / coarser * side..][..side];
        for (cells, out) in row.chunks(coarser).zip(out) {
            out[0] += share * cells.iter().map(|&load| f64::from(load)).sum::<f64>();
        }
    }
    Ok(grid)
}

/// Indices of four neighbours on the coarse grid, which wraps, and their weights.
struct Taps {
    cells: [usize; 4],
    weights: [f64; 4],
}

impl Taps {
    /// Returns the interpolation weights for the centre of a fine cell.
    fn new(cell: usize, coarser: usize, side: usize) -> Self {
        if coarser == 1 {
            return Self { cells: [cell; 4], weights: [1.0, 0.0, 0.0, 0.0] };
        }
        let at = (cell as f64 + 0.5) / coarser as f64 - 0.5 + side as f64;
        let (first, t) = (at.floor() as usize - 1, at - at.floor());
        Self { cells: [0, 1, 2, 3].map(|k| (first + k) % side), weights: math::catmull_rom(t) }
    }

    fn sum(&self, value: impl Fn(usize) -> f64) -> f64 {
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| self.weights[k] * value(self.cells[k]));
        (a + b) + (c + d)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{field, run, run_in, with_params, world};

    /// A line load of q newtons a metre: `w = w₀ e^(−x/α) (cos x/α + sin x/α)`, `w₀ = q α³ / 8D` (Turcotte and
    /// Schubert).
    #[test]
    fn a_line_load_bends_the_plate_as_the_closed_form_says() {
        for (thickness, cell_m) in [(1000.0, 500.0), (3000.0, 500.0), (2000.0, 60.0)] {
            let params = with_params(&NODE, &format!("elastic_thickness={thickness}"));
            let plate = Params::read(&params).plate();
            let alpha = plate.alpha_m();
            // the ends are 8 α away
            let cells = (16.0 * alpha / cell_m) as u32 | 1;
            let middle = cell_m * f64::from(cells) / 2.0;
            let line =
                field(world(cells, cells, cell_m), |x, _| if (x - middle).abs() < 0.4 * cell_m { 100.0 } else { 0.0 });
            let deflection = run(&NODE, &params, &[("load", &line)], "deflection");
            let deepest = CRUST * GRAVITY * 100.0 * cell_m * alpha * alpha * alpha / (8.0 * plate.rigidity);
            let row = &deflection.samples()[(cells / 2 * cells) as usize..][..cells as usize];
            for (i, got) in row.iter().enumerate() {
                let x = ((i as f64 + 0.5) * cell_m - middle).abs() / alpha;
                let expected = -deepest * math::exp(-x) * (math::cos(x) + math::sin(x));
                // cells of α / 16 to α / 8 and a margin of 6 α: half a percent of the deepest
                assert!((f64::from(*got) - expected).abs() < 0.01 * deepest, "{thickness} {x}: {got} {expected}");
            }
            assert!((f64::from(row[cells as usize / 2]) / -deepest - 1.0).abs() < 0.02);
        }
    }

    #[test]
    fn without_a_plate_each_place_floats_by_itself() {
        let load = field(world(70, 50, 100.0), |x, y| if x + y > 5000.0 { 300.0 } else { -20.0 });
        let deflection = run(&NODE, &with_params(&NODE, "elastic_thickness=0"), &[("load", &load)], "deflection");
        for (got, load) in deflection.samples().iter().zip(load.samples()) {
            // two roundings to single precision of 250 m
            assert!((got + load * 2700.0 / 3300.0).abs() < 3e-5, "{got} {load}");
        }
        let wet = run(&NODE, &with_params(&NODE, "elastic_thickness=0,fill=water"), &[("load", &load)], "deflection");
        assert!((wet.samples()[0] - 20.0 * 2700.0 / 2270.0).abs() < 1e-5);
    }

    /// The weight of the displaced mantle equals that of the load: the bending stresses have no resultant.
    #[test]
    fn the_displaced_mantle_weighs_what_the_load_weighs() {
        let params = with_params(&NODE, "elastic_thickness=500");
        let load =
            field(
                world(200, 160, 500.0),
                |x, y| if math::hypot(x - 50_000.0, y - 40_000.0) < 4000.0 { 900.0 } else { 0.0 },
            );
        let total = |field: &Field| field.samples().iter().map(|&v| f64::from(v)).sum::<f64>();
        let deflection = run(&NODE, &params, &[("load", &load)], "deflection");
        // α is 3.1 km and the sides are 11 α away
        assert!((total(&deflection) / total(&load) + 2700.0 / 3300.0).abs() < 1e-3);
    }

    #[test]
    fn threads_give_the_same_bits_and_any_size_is_taken() {
        for (nx, ny, cell_m) in [(1, 1, 900.0), (1, 1, 1e-3), (1, 9, 1e5), (83, 40, 900.0)] {
            let load = field(world(nx, ny, cell_m), |x, y| 100.0 * math::sin(x / 4000.0) + y / 100.0);
            let params = with_params(&NODE, "elastic_thickness=7000");
            assert_eq!(run_in(1, &NODE, &params, &[("load", &load)]), run_in(3, &NODE, &params, &[("load", &load)]));
        }
    }
}
