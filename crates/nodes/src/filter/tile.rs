//! Makes opposite sides of a field match.

use orograph_graph::memory::copied;

use super::mix;
use crate::{
    numerics::{math, par},
    prelude::*,
};

choice! {
    /// Pairs of sides that are made to fit.
    pub enum Sides {
        /// All.
        All = "all",
        /// West and east.
        WestEast = "west_east",
        /// North and south.
        NorthSouth = "north_south",
    }
}

params! {
    /// Distance from the sides within which the field changes; limited to half of the world's width.
    margin: f64 = 3000.0, Metres, 0.0..=1e7, soft 0..=8000;
    /// Pairs of sides that are made to fit.
    sides: Sides = Sides::All, One, ..;
}

inputs! {
    /// Field to make seamless.
    value: AnyScalar;
    /// Where the result replaces the input: fully at 1, not at all at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// Seamless field, with the meaning of the input.
    value: SameAs(value);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Tile",
    category: "filter",
    summary: "Makes a field tileable: opposite sides fit, so that copies lie side by side without a seam.",
    doc: include_str!("tile.md"),
    sources: &[
        "E. Heitz and F. Neyret (2018), High-performance by-example noise using a histogram-preserving blending operator, \
         Proceedings of the ACM on Computer Graphics and Interactive Techniques 1 (2)",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    scratch: Scratch::PerCell(4.0),
    cpu: run,
    example: "value: \"base\", margin: 4000",
    ..Node::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { value, mask } = Inputs::read(job)?;
    let params = Params::read(job.params);
    let window = job.window();
    let (nx, ny) = (window.nx(), window.ny());
    let mut out = copied(value.samples())?;
    if params.sides != Sides::NorthSouth {
        let shares = shares(nx, params.margin / job.cell_m());
        blend(job, [0.0, 0.5], &mut out, |j, i| j * nx + (i + nx / 2) % nx, |_, i| shares[i])?;
    }
    if params.sides != Sides::WestEast {
        let shares = shares(ny, params.margin / job.cell_m());
        blend(job, [0.5, 0.9], &mut out, |j, i| (j + ny / 2) % ny * nx + i, |j, _| shares[j])?;
    }
    mix(job, value.samples(), &mut out, mask)?;
    Ok(Given { value: Some(Field::new(window, out)) }.into())
}

/// Returns the weight of the shifted field for each of `n` cells along an axis.
fn shares(n: usize, margin_cells: f64) -> Vec<f64> {
    let margin = margin_cells.min(0.5 * n as f64);
    let share = |at: usize| {
        // from the nearer side to the cell's centre
        let inside = at.min(n - 1 - at) as f64 + 0.5;
        if inside < margin { 1.0 - math::smoothstep(inside / margin) } else { 0.0 }
    };
    (0..n).map(share).collect()
}

/// Blends the field with its shifted copy, whose weights are `share`.
fn blend(
    job: &Job<'_>,
    progress: [f32; 2],
    field: &mut Vec<f32>,
    moved: impl Fn(usize, usize) -> usize + Sync,
    share: impl Fn(usize, usize) -> f64 + Sync,
) -> Result<(), NodeError> {
    let nx = job.window().nx();
    let old = std::mem::take(field);
    let sum = |of: &(dyn Fn(usize, usize) -> f64 + Sync)| -> f64 {
        par::collect_all(0..old.len() / nx, |_, j| (0..nx).map(|i| of(j, i)).sum::<f64>()).iter().sum()
    };
    let here = |j: usize, i: usize| f64::from(old[j * nx + i]);
    let there = |j: usize, i: usize| f64::from(old[moved(j, i)]);
    let mean = sum(&here) / old.len() as f64;
    let variance = sum(&|j, i| (here(j, i) - mean) * (here(j, i) - mean));
    let covariance = sum(&|j, i| (here(j, i) - mean) * (there(j, i) - mean));
    let correlation = if variance > 0.0 { (covariance / variance).clamp(0.0, 1.0) } else { 1.0 };
    field.clone_from(&old);
    par::rows_within(job, progress, field, |j, row| {
        for (i, value) in row.iter_mut().enumerate() {
            let a = share(j, i);
            if a > 0.0 {
                let root = ((1.0 - a) * (1.0 - a) + a * a + 2.0 * a * (1.0 - a) * correlation).sqrt();
                *value = (mean + ((1.0 - a) * (here(j, i) - mean) + a * (there(j, i) - mean)) / root) as f32;
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        generate::noise,
        testing::{field, generate, moments, run as result, run_in, with_params, world},
    };

    fn slope(nx: u32, ny: u32) -> Field {
        field(world(nx, ny, 10.0), |x, y| {
            2.0 * x - y + 80.0 * libm::sin(x * 0.011 + 1.0) * libm::cos(y * 0.017) + 20.0 * libm::sin(x * 0.05)
        })
    }

    /// Values and slopes change no more across the joined sides than inside.
    #[test]
    fn there_is_no_seam() {
        for (nx, ny) in [(200_u32, 160_u32), (201, 163)] {
            let land = slope(nx, ny);
            let tile = result(&NODE, &with_params(&NODE, "margin=400"), &[("value", &land)], "value");
            let (nx, ny) = (nx as usize, ny as usize);
            let at = |j: usize, i: usize| tile.samples()[j % ny * nx + i % nx];
            let worst = |of: &dyn Fn(usize, usize) -> f32, places: &[usize], along: usize| {
                places
                    .iter()
                    .flat_map(|&i| (0..along).map(move |j| (j, i)))
                    .map(|(j, i)| of(j, i).abs())
                    .fold(0.0, f32::max)
            };
            let step_x = |j: usize, i: usize| at(j, i + 1) - at(j, i);
            let bend_x = |j: usize, i: usize| at(j, i + 2) - 2.0 * at(j, i + 1) + at(j, i);
            let step_y = |i: usize, j: usize| at(j + 1, i) - at(j, i);
            let bend_y = |i: usize, j: usize| at(j + 2, i) - 2.0 * at(j + 1, i) + at(j, i);
            let inside: Vec<usize> = (0..nx - 3).collect();
            assert!(worst(&step_x, &[nx - 1], ny) <= worst(&step_x, &inside, ny));
            assert!(worst(&bend_x, &[nx - 1, nx - 2], ny) <= worst(&bend_x, &inside, ny));
            let inside: Vec<usize> = (0..ny - 3).collect();
            assert!(worst(&step_y, &[ny - 1], nx) <= worst(&step_y, &inside, nx));
            assert!(worst(&bend_y, &[ny - 1, ny - 2], nx) <= worst(&bend_y, &inside, nx));
            // the input itself has a step of 4000 m
            assert!((land.samples()[nx - 1] - land.samples()[0]).abs() > 3000.0);
            for j in 41..ny - 41 {
                assert_eq!(tile.samples()[j * nx + 41..][..nx - 82], land.samples()[j * nx + 41..][..nx - 82]);
            }
        }
    }

    /// Noise is as rough in the margins as inside; a linear blend would lose a third of it in the middle.
    #[test]
    fn noise_stays_as_rough() {
        let noise = generate(Window::whole(world(512, 512, 10.0)), &noise::NODE, "wavelength=200,octaves=2");
        let tile = result(&NODE, &with_params(&NODE, "margin=1200"), &[("value", &noise)], "value");
        let band = |field: &Field| -> Vec<f32> {
            (0..512).flat_map(|j| field.samples()[j * 512 + 40..][..40].to_vec()).collect()
        };
        let (before, after) = (moments(&band(&noise)).1, moments(&band(&tile)).1);
        assert!((after / before - 1.0).abs() < 0.1, "{before} {after}");
    }

    #[test]
    fn nothing_changes_without_a_margin_or_where_all_is_level() {
        let land = slope(40, 30);
        assert_eq!(result(&NODE, &with_params(&NODE, "margin=0"), &[("value", &land)], "value"), land);
        let level = field(world(33, 1, 5.0), |_, _| 812.3);
        assert_eq!(result(&NODE, &with_params(&NODE, ""), &[("value", &level)], "value"), level);
        let params = with_params(&NODE, "margin=90");
        assert_eq!(run_in(1, &NODE, &params, &[("value", &land)]), run_in(3, &NODE, &params, &[("value", &land)]));
    }
}
