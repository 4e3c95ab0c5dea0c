//! Islands: terrain that falls to the sea with the distance from the world's sides, a point or a wired outline.

use crate::numerics::noise::{Basis, Fractal, sum};
use crate::{numerics::par, prelude::*};

choice! {
    /// What the coast follows.
    pub enum Form {
        /// The edges of the world, `margin` away from them.
        Edges = "edges",
        /// A circle of `radius` around `centre`.
        Disc = "disc",
        /// Where the input `distance` is 0; land is where it is negative, as in the output of `Shape`.
        Outline = "outline",
    }
}

params! {
    /// What the coast follows.
    form: Form = Form::Edges, One, ..;
    /// Distance of the coast from the edges of the world.
    margin: f64 = 2500.0, Metres, 0.0..=1e7, soft 0..=8000, when form = "edges";
    /// Centre of the circle, from the world's north-west corner.
    centre: [f64; 2] = [8192.0, 8192.0], Metres, -1e7..=1e7, when form = "disc";
    /// Radius of the circle.
    radius: f64 = 6000.0, Metres, 0.01..=1e7, soft 500..=20000, when form = "disc";
    /// Distance inland from the coast over which the terrain reaches its full height.
    slope: f64 = 4000.0, Metres, 0.01..=1e7, soft 100..=10000;
    /// Elevation of the coast. Give it the world's `sea_level`, so that the coast is the shore.
    sea: f64 = 0.0, Metres, -1e5..=1e5, soft -500..=500;
    /// Depth of the sea floor.
    depth: f64 = 300.0, Metres, 0.0..=1e5, soft 0..=2000;
    /// Distance from the coast over which the floor falls to its depth.
    shelf: f64 = 2000.0, Metres, 0.01..=1e7, soft 100..=10000;
    /// Maximum reach of bays and capes; on average they reach a sixth of it.
    roughness: f64 = 3000.0, Metres, 0.0..=1e6, soft 0..=5000;
    /// Wavelength of the largest bays.
    wavelength: f64 = 5000.0, Metres, 1.0..=1e6, soft 500..=20000;
    /// Random seed of the coast.
    seed: Seed = Seed(0), Count, ..;
}

inputs! {
    /// Elevation inland: a wired height, or one number for everywhere.
    height: Scalar(Metres) = 500.0, -1e6..=1e6, soft 0.0..=3000.0;
    /// Distance to the coast, negative on land; for `outline`.
    distance: Option<Scalar(Metres)>;
}

outputs! {
    /// Elevation.
    height: Height;
    /// Distance d inland from the coast, negative at sea.
    inland: Scalar(Metres);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Island",
    category: "generate",
    summary: "Lowers terrain to the sea around it: islands and coasts.",
    doc: include_str!("island.md"),
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    example: "height: 800, roughness: 2500, seed: 3",
    ..Node::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { height, distance: wired } = Inputs::read(job)?;
    let params = Params::read(job.params);
    let window = job.window();
    if params.form == Form::Outline && wired.is_none() {
        return Err(NodeError::failed_with_hint(
            "there is no outline",
            "wire the distance of `Shape` to `distance`, or choose another `form`",
        ));
    }
    let fractal = Fractal {
        wavelength_m: params.wavelength,
        octaves: 8,
        lacunarity: 2.0,
        gain: 0.5,
        tileable: false,
        seed: job.seed(),
    };
    let mut inland = sum::lattices(job, &fractal.octaves(job.world()), Basis::Bell, params.roughness)?;
    let size = window.world.size;
    par::rows_within(job, [0.5, 0.8], &mut inland, |j, row| {
        for (i, inland) in row.iter_mut().enumerate() {
            let [x, y] = window.centre_m(i, j);
            let even = match (params.form, wired) {
                (Form::Edges, _) | (Form::Outline, None) => inside(size, [x, y]) - params.margin,
                (Form::Disc, _) => {
                    let (dx, dy) = (x - params.centre[0], y - params.centre[1]);
                    params.radius - (dx * dx + dy * dy).sqrt()
                }
                (Form::Outline, Some(distance)) => -f64::from(distance.samples()[j * window.nx() + i]),
            };
            *inland = (even + f64::from(*inland)) as f32;
        }
    })?;
    let [sea, depth] = [params.sea, params.depth].map(|part| part as f32);
    let [per_slope, per_shelf] = [params.slope, params.shelf].map(|part| (1.0 / part) as f32);
    let wants = Wants::of(job);
    let land = |j, row: &mut [f32]| {
        for (i, out) in row.iter_mut().enumerate() {
            let inland = *out;
            *out = if inland >= 0.0 {
                sea + (height.at(j * window.nx() + i) - sea) * rise(inland * per_slope)
            } else {
                sea - depth * rise(-inland * per_shelf)
            };
        }
    };
    let field = |samples| Field::new(window, samples);
    Ok(Given {
        height: wants
            .height
            .then(|| par::rows_from(job, [0.8, 1.0], &mut inland, wants.inland, land))
            .transpose()?
            .map(field),
        inland: wants.inland.then(|| field(inland)),
    }
    .into())
}

/// Rises from 0 to 1, steepest at 0.
#[inline(always)]
fn rise(t: f32) -> f32 {
    let t = t.min(1.0);
    t * (2.0 - t)
}

/// Returns the distance inwards from the sides of the world, (Σ dᵢ⁻²)^−½: close to a side the distance to it, without a
/// crease where two are equally near.
fn inside(size: [f64; 2], place: [f64; 2]) -> f64 {
    let sides = [place[0], size[0] - place[0], place[1], size[1] - place[1]];
    1.0 / sides.iter().map(|side| 1.0 / (side * side)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{field, outputs_on, with_params, world};

    fn island(changes: &str, fields: &[(&str, &Field)]) -> [Field; 2] {
        let params = with_params(&NODE, changes);
        let window = Window::whole(world(160, 120, 100.0));
        let mut outputs = outputs_on(window, &NODE, &params, fields).expect("a result");
        ["height", "inland"].map(|name| outputs.take(name).expect("an output").as_field().expect("a field").clone())
    }

    #[test]
    fn the_coast_follows_the_edges_and_the_profile_is_its_formula() {
        let [height, inland] = island("roughness=0,margin=2000,slope=3000,shelf=1000,depth=200,sea=10", &[]);
        let at = |i: usize, j: usize| (height.samples()[j * 160 + i], inland.samples()[j * 160 + i]);
        // a row halfway between north and south of 16 km x 12 km
        for i in [0, 15, 25, 40, 80] {
            let x = 100.0 * i as f64 + 50.0;
            let sum: f64 = [x, 16_000.0 - x, 6050.0, 5950.0].iter().map(|side| 1.0 / (side * side)).sum();
            let d = 1.0 / sum.sqrt() - 2000.0;
            let t = (if d > 0.0 { d / 3000.0 } else { -d / 1000.0 }).min(1.0);
            let expected = 10.0 + t * (2.0 - t) * if d > 0.0 { 490.0 } else { -200.0 };
            assert!(
                (f64::from(at(i, 60).1) - d).abs() < 1e-3 && (f64::from(at(i, 60).0) - expected).abs() < 1e-3,
                "{i}"
            );
        }
        // rises monotonically from the edge to the middle, along any row and column
        assert!((1..80).all(|i| (0..120).all(|j| at(i, j).0 >= at(i - 1, j).0)));
    }

    #[test]
    fn it_takes_land_and_an_outline() {
        let world = world(160, 120, 100.0);
        let hills = field(world, |x, _| 300.0 + 0.01 * x);
        let distance = field(world, |x, _| 8000.0 - x);
        let changes = "form=outline,roughness=0,slope=1000,depth=50,shelf=100";
        let [height, _] = island(changes, &[("height", &hills), ("distance", &distance)]);
        assert_eq!(height.samples()[70], -50.0);
        assert_eq!(height.samples()[100], hills.samples()[100]);
        let params = with_params(&NODE, "form=outline");
        let error = outputs_on(Window::whole(world), &NODE, &params, &[]);
        assert!(matches!(error, Err(NodeError::Failed { hint: Some(_), .. })));
    }

    /// The circle keeps its area to 5 %: bays and capes balance.
    #[test]
    fn bays_and_capes_move_the_coast_both_ways() {
        let [_, inland] = island("form=disc,radius=3500,roughness=1500,wavelength=1500", &[]);
        // its centre, (8192, 8192), is 300 m from the southern third of this world
        let land = inland.samples().iter().filter(|d| **d > 0.0).count() as f64 * 1e4;
        let circle = std::f64::consts::PI * 3500.0 * 3500.0;
        assert!((land / circle - 1.0).abs() < 0.05, "{}", land / circle);
        let rough = inland.samples().iter().filter(|d| d.abs() < 50.0).count() as f64;
        let smooth =
            island("form=disc,radius=3500,roughness=0", &[])[1].samples().iter().filter(|d| d.abs() < 50.0).count();
        assert!(rough > 1.15 * smooth as f64, "{rough} {smooth}");
    }
}
