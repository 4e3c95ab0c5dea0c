//! Islands: terrain that falls to the sea with the distance from the world's sides, a point or a wired outline.

use crate::numerics::noise::{Basis, Fractal, Octave, sum};
use crate::{
    numerics::{math::smoothstep, par},
    prelude::*,
};

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
    centre: Position = Position([8192.0, 8192.0]), Metres, -1e7..=1e7, when form = "disc";
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
    /// How far the outline departs from the form, as a fraction of its radius.
    irregularity: f64 = 0.5, One, 0.0..=1.0, when form = "edges" | "disc";
    /// How much the coast differs from place to place: ragged where exposed, smooth and flat where sheltered.
    variety: f64 = 0.7, One, 0.0..=1.0;
    /// Height of cliffs on exposed coasts.
    cliffs: f64 = 50.0, Metres, 0.0..=5000.0, soft 0..=300;
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
    version: 2,
    migrations: &[Migration {
        from: 1,
        steps: &[
            Step::Keep { name: "irregularity", value: "0" },
            Step::Keep { name: "variety", value: "0" },
            Step::Keep { name: "cliffs", value: "0" },
        ],
    }],
    category: "generate",
    summary: "Lowers terrain to the sea around it: islands and coasts.",
    doc: include_str!("page.md"),
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    scratch: Scratch::Bytes(scratch),
    refuses: Some(refuses),
    cpu: run,
    example: "height: \"base\", slope: 2500, seed: 3",
    ..Node::DEFAULT
};

/// Octaves of the coast whose roughness is the same everywhere; that of finer ones differs from place to place.
const BAYS: usize = 2;
/// Salts of the noises of outline and exposure.
const SALTS: [u32; 2] = [0x510e_527f, 0x9b05_688c];

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let params = Params::read(sizing.params);
    let noises = u32::from(params.varies()) * 2 + u32::from(params.wide_m(sizing.window.world.size) > 0.0);
    sizing.cells(4.0 * f64::from(noises))
}

/// Refuses an outline that is not wired.
fn refuses(stated: &Stated<'_>) -> Result<(), NodeError> {
    if Params::read(stated.params).form == Form::Outline && stated.feed("distance") == Feed::Nothing {
        return Err(NodeError::failed_with_hint(
            "there is no outline",
            "wire the distance of `Shape` to `distance`, or choose another `form`",
        ));
    }
    Ok(())
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { height, distance: wired } = Inputs::read(job)?;
    let params = Params::read(job.params);
    let window = job.window();
    refuses(&Stated::of_job(job))?;
    let size = window.world.size;
    let noise = |wavelength_m: f64, octaves: i64, seed: u32| {
        let fractal = Fractal { wavelength_m, octaves, lacunarity: 2.0, gain: 0.5, tileable: false, seed };
        fractal.octaves(job.world())
    };
    let salted = |salt: u32| orograph_graph::mix(job.seed() ^ salt);
    let coast = noise(params.wavelength, 8, job.seed());
    let (bays, details) = coast.split_at(if params.varies() { coast.len().min(BAYS) } else { coast.len() });
    let mut inland = sum::lattices(job, bays, Basis::Bell, params.roughness)?;
    let varies = |octaves: &[Octave], amplitude: f64| {
        params.varies().then(|| sum::lattices(job, octaves, Basis::Bell, amplitude)).transpose()
    };
    let details = varies(details, params.roughness)?;
    let exposure = varies(&noise(1.6 * params.wavelength, 2, salted(SALTS[1])), 1.0)?;
    let wide_m = params.wide_m(size);
    let wide = (wide_m > 0.0)
        .then(|| sum::lattices(job, &noise(1.1 * params.extent_m(size), 3, salted(SALTS[0])), Basis::Bell, wide_m))
        .transpose()?;
    let exposed = |at: usize| exposure.as_ref().map_or(0.5, |exposure| params.exposed(exposure[at]));
    par::rows_within(job, [0.5, 0.8], &mut inland, |j, row| {
        for (i, inland) in row.iter_mut().enumerate() {
            let [x, y] = window.centre_m(i, j);
            let at = j * window.nx() + i;
            let mut bent = f64::from(*inland);
            if let Some(details) = &details {
                // a mean of 1 over all coasts
                bent += f64::from(details[at]) * (1.0 + params.variety * (2.2 * exposed(at) - 1.1)).max(0.0);
            }
            let even = match (params.form, wired) {
                (Form::Edges, _) | (Form::Outline, None) => {
                    let inside_m = inside(size, [x, y]);
                    if let Some(wide) = &wide {
                        // the sides of the world stay in the sea
                        bent += f64::from(wide[at]) * smoothstep(inside_m / params.margin.max(1.0));
                    }
                    inside_m - params.margin
                }
                (Form::Disc, _) => {
                    bent += wide.as_ref().map_or(0.0, |wide| f64::from(wide[at]));
                    let (dx, dy) = (x - params.centre[0], y - params.centre[1]);
                    params.radius - (dx * dx + dy * dy).sqrt()
                }
                (Form::Outline, Some(distance)) => -f64::from(distance.samples()[at]),
            };
            *inland = (even + bent) as f32;
        }
    })?;
    let [sea, depth] = [params.sea, params.depth].map(|part| part as f32);
    let [per_slope, per_shelf] = [params.slope, params.shelf].map(|part| (1.0 / part) as f32);
    let wants = Wants::of(job);
    let land = |j, row: &mut [f32]| {
        for (i, out) in row.iter_mut().enumerate() {
            let (inland, at) = (*out, j * window.nx() + i);
            *out = if inland < 0.0 {
                sea - depth * rise(-inland * per_shelf)
            } else if params.varies() {
                let above = height.at(at) - sea;
                let [cliff, plain] = params.shore(f64::from(inland), exposed(at));
                let cliff = (cliff as f32).min(above.max(0.0));
                sea + cliff + (above - cliff) * rise(plain as f32 * per_slope)
            } else {
                sea + (height.at(at) - sea) * rise(inland * per_slope)
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

impl Params {
    /// Returns true if the coast differs from place to place.
    fn varies(&self) -> bool {
        self.variety > 0.0 || self.cliffs > 0.0
    }

    /// Returns about the radius of the form.
    fn extent_m(&self, [width, height]: [f64; 2]) -> f64 {
        match self.form {
            Form::Edges => (0.5 * width.min(height) - self.margin).max(0.0),
            Form::Disc => self.radius,
            Form::Outline => 0.0,
        }
    }

    /// Returns how far the outline departs from the form at most.
    fn wide_m(&self, size: [f64; 2]) -> f64 {
        2.6 * self.irregularity * self.extent_m(size)
    }

    /// Returns how exposed a coast is, from 0 to 1.
    fn exposed(&self, noise: f32) -> f64 {
        smoothstep(0.5 + 1.5 * f64::from(noise))
    }

    /// Returns the height of the cliff at a distance inland, and the distance by which the land behind it rises: less
    /// on sheltered coasts, which begin flat.
    fn shore(&self, inland_m: f64, exposed: f64) -> [f64; 2] {
        let cliff_m = self.cliffs * smoothstep((exposed - 0.45) / 0.35);
        // cliffs are about 55° steep
        let cliff = cliff_m * (inland_m / (0.7 * cliff_m).max(1e-3)).min(1.0);
        let flat_m = 0.15 * self.variety * self.slope * (1.0 - exposed);
        [cliff, inland_m * inland_m / (inland_m + flat_m).max(1e-9)]
    }
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
mod tests;
