//! Shaded relief, plain and coloured by elevation.

use orograph_graph::ParamValues;

use crate::numerics::tints::{self, Tints};
use crate::{
    numerics::{
        gradient::{Method, Surface},
        math, par,
        simd::simd,
    },
    prelude::*,
};

choice! {
    /// Light sources.
    pub enum Light {
        /// One sun: the strongest relief, but steep slopes turned away from it are black.
        Single = "single",
        /// Four suns 45° apart, weighted by how they graze the slope (Mark 1992): shows relief in the shade too.
        Oblique = "oblique",
        /// The mean of `single` and `oblique`: strong relief, open shadows.
        Blend = "blend",
    }
}

params! {
    /// Azimuth of the sun, clockwise from north.
    azimuth: f64 = 315.0, Degrees, 0.0..=360.0;
    /// Altitude of the sun above the horizon.
    altitude: f64 = 45.0, Degrees, 1.0..=90.0, soft 10.0..=80.0;
    /// One sun or several.
    light: Light = Light::Blend, One, ..;
    /// Factor on heights before shading; use 2 to 10 for gentle terrain.
    exaggeration: f64 = 1.0, One, 0.0..=1000.0, soft 0.2..=10.0;
    /// Colours by elevation; white when off.
    tints: bool = true, One, ..;
    /// Elevation of the first land colour, lowland green.
    low: f64 = 0.0, Metres, -1e5..=1e5, soft 0.0..=3000.0, when tints = true;
    /// Elevation of the last land colour, snow.
    high: f64 = 3000.0, Metres, -1e5..=1e5, soft 100.0..=9000.0, when tints = true;
    /// Colours everything below the world's sea level as water.
    water: bool = true, One, .., when tints = true;
}

inputs! {
    /// Terrain height.
    height: Height;
    /// Fraction of each cell that is drawn as water.
    wet: Option<Mask>;
}

outputs! {
    /// Reflected light, 0 in the dark to 1 facing the sun.
    shade: Mask;
    /// Elevation tints under that light, linear RGB.
    colour: Colour;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Hillshade",
    version: 2,
    migrations: &[Migration { from: 1, steps: &[] }],
    category: "render",
    summary: "Shaded relief as in cartography, plain and coloured by elevation.",
    doc: include_str!("hillshade.md"),
    sources: &[
        "B. K. P. Horn, 1981, Hill shading and the reflectance map, Proceedings of the IEEE 69(1), 14-47",
        "R. K. Mark, 1992, Multidirectional, oblique-weighted, shaded-relief image of the Island of Hawaii, USGS \
         Open-File Report 92-422",
        "E. Imhof, 1965, Kartographische Geländedarstellung, de Gruyter",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|_, cell_m| cell_m),
    reads_sea: true,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    resolution: Resolution::Cells(
        "the gradient is measured between neighbouring cells, so slopes are gentler with larger cells",
    ),
    example: "height: \"base\", light: single, high: 2500",
    ..Node::DEFAULT
};

impl Default for Params {
    fn default() -> Self {
        Self::read(&ParamValues::defaults(&Self::specs()))
    }
}

impl Params {
    /// Returns the defaults with tints over the range of a field, from sea level upwards if its world has a sea, and
    /// with gentle terrain exaggerated until it is visible.
    #[must_use]
    pub fn fitted(height: &Field) -> Self {
        let (low, high) = height.range(0).map_or((0.0, 1.0), |(low, high)| (f64::from(low), f64::from(high)));
        let surface = Surface::new(height, Method::Central);
        let (nx, ny) = (height.window().nx(), height.window().ny());
        let steepness: f64 = (0..ny)
            .map(|j| {
                let mut sum = 0.0;
                surface.row(j, |_, east, south| {
                    sum += east.iter().zip(south).map(|(&p, &q)| f64::from((p * p + q * q).sqrt())).sum::<f64>();
                });
                sum
            })
            .sum();
        let mean = steepness / (nx * ny) as f64;
        let exaggeration = if mean > 0.0 && mean.is_finite() { (0.3 / mean).clamp(1.0, 50.0) } else { 1.0 };
        let low = height.window().world.sea_level.filter(|sea| high > *sea).map_or(low, |sea| low.max(sea));
        Self { low, high, exaggeration, ..Self::default() }
    }
}

/// Computes the shaded relief of a heightfield: `shade`, one plane, and `colour`, three planes of linear RGB.
#[must_use]
pub fn relief(height: &Field, params: &Params) -> [Field; 2] {
    let window = *height.window();
    let mut colour = vec![0.0; 3 * window.len()];
    match paint(height, None, params, Some(&mut colour), || Ok::<_, std::convert::Infallible>(())) {
        Ok(shade) => [Field::new(window, shade), Field::with_planes(window, 3, colour)],
        Err(never) => match never {},
    }
}

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    // the shade, which is computed even if only the colours are wanted
    if Wants::among(sizing.wanted).shade { 0 } else { sizing.cells(4.0) }
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { height, wet } = Inputs::read(job)?;
    let params = Params::read(job.params);
    if params.low > params.high {
        return Err(NodeError::failed_with_hint(
            format!("`low` is {} m, above `high`, {} m", params.low, params.high),
            "exchange the two",
        ));
    }
    let (window, wants) = (job.window(), Wants::of(job));
    let mut colour = wants.colour.then(|| vec![0.0; 3 * window.len()]);
    let shade = paint(height, wet, &params, colour.as_deref_mut(), || job.check())?;
    Ok(Given {
        shade: wants.shade.then(|| Field::new(window, shade)),
        colour: colour.map(|colour| Field::with_planes(window, 3, colour)),
    }
    .into())
}

/// Shades all rows and writes the three planes of `colour`, if any. Calls `check` before each row, which may cancel.
fn paint<E: Send>(
    height: &Field,
    wet: Option<&Field>,
    params: &Params,
    colour: Option<&mut [f32]>,
    check: impl Fn() -> Result<(), E> + Sync,
) -> Result<Vec<f32>, E> {
    let window = *height.window();
    let nx = window.nx();
    let surface = Surface::new(height, Method::Horn);
    let sun = Sun::new(params);
    let sea_m = window.world.sea_level.filter(|_| params.water);
    let land = params.tints.then(|| Tints::new(params.low, params.high, sea_m));
    let water = sun.lit(tints::open_water(), sun.sin_altitude);
    let light = |j: usize, shade: &mut [f32]| {
        surface.row(j, |start, east, south| sun.shade(east, south, &mut shade[start..start + east.len()]));
    };
    let mut shade = vec![0.0; window.len()];
    let Some(colour) = colour else {
        par::each(shade.chunks_mut(nx), |j, shade| {
            check()?;
            light(j, shade);
            Ok::<_, E>(())
        })?;
        return Ok(shade);
    };
    let (red, rest) = colour.split_at_mut(window.len());
    let (green, blue) = rest.split_at_mut(window.len());
    let rgb = red.chunks_mut(nx).zip(green.chunks_mut(nx)).zip(blue.chunks_mut(nx));
    let rows = shade.chunks_mut(nx).zip(rgb).zip(height.plane(0).chunks(nx));
    par::each(rows, |j, ((shade, ((red, green), blue)), heights)| {
        check()?;
        light(j, shade);
        let rgb = red.iter_mut().zip(green.iter_mut()).zip(blue.iter_mut());
        for (((&shade, &height), ((red, green), blue)), _) in shade.iter().zip(heights).zip(rgb).zip(0..nx) {
            let tint = land.as_ref().map_or([1.0; 3], |tints| tints.of(height));
            [*red, *green, *blue] = sun.lit(tint, shade);
        }
        if let Some(wet) = wet {
            let wet = &wet.plane(0)[j * nx..(j + 1) * nx];
            for (plane, water) in [red, green, blue].into_iter().zip(water) {
                plane.iter_mut().zip(wet).for_each(|(v, wet)| *v += (water - *v) * wet.clamp(0.0, 1.0));
            }
        }
        Ok(())
    })?;
    Ok(shade)
}

/// Directions and weights of light.
struct Sun {
    /// Unit vectors towards the sun in the plane (east, south): the main sun, then the four of oblique light.
    towards: [[f32; 2]; 5],
    cos_altitude: f32,
    sin_altitude: f32,
    exaggeration: f32,
    /// Weight of oblique light.
    oblique: f32,
}

impl Sun {
    fn new(params: &Params) -> Self {
        let altitude = params.altitude.to_radians();
        let towards = [0.0, -90.0, -45.0, 0.0, 45.0].map(|turn: f64| {
            let azimuth = (params.azimuth + turn).to_radians();
            [math::sin(azimuth) as f32, -math::cos(azimuth) as f32]
        });
        let oblique = match params.light {
            Light::Single => 0.0,
            Light::Oblique => 1.0,
            Light::Blend => 0.5,
        };
        Self {
            towards,
            cos_altitude: math::cos(altitude) as f32,
            sin_altitude: math::sin(altitude) as f32,
            exaggeration: params.exaggeration as f32,
            oblique,
        }
    }

    fn shade(&self, east: &[f32], south: &[f32], out: &mut [f32]) {
        shade(self, east, south, out);
    }

    /// Returns a tint under light. Level ground is a little below full brightness, so that sunlit slopes stand out from
    /// it.
    fn lit(&self, tint: [f32; 3], shade: f32) -> [f32; 3] {
        /// Skylight on all slopes and sunlight on level ground: cool shadows, warm light.
        const SKY: [f32; 3] = [0.16, 0.18, 0.23];
        const SUN: [f32; 3] = [0.70, 0.68, 0.63];
        let sunlight = shade / self.sin_altitude;
        [0, 1, 2].map(|c| (tint[c] * (SKY[c] + SUN[c] * sunlight)).min(1.0))
    }
}

simd! {
    fn shade(sun: &Sun, east: &[f32], south: &[f32], out: &mut [f32]) {
        /// Avoids a division of zero by zero on level ground, which has no oblique light.
        const LEVEL: f32 = 1e-12;
        for ((out, &p), &q) in out.iter_mut().zip(east).zip(south) {
            let (p, q) = (p * sun.exaggeration, q * sun.exaggeration);
            let steepness = p * p + q * q;
            let length = (1.0 + steepness).sqrt();
            let mut light = [0.0; 5];
            let mut oblique = 0.0;
            for (k, [x, y]) in sun.towards.iter().enumerate() {
                let facing = (sun.sin_altitude - sun.cos_altitude * (p * x + q * y)) / length;
                light[k] = if facing > 0.0 { facing } else { 0.0 };
                let across = p * y - q * x;
                oblique += if k > 0 { (across * across + LEVEL) * light[k] } else { 0.0 };
            }
            // the four squared sines add up to two for any aspect
            let oblique = oblique / (2.0 * steepness + 4.0 * LEVEL);
            let blend = light[0] + (oblique - light[0]) * sun.oblique;
            *out = if blend < 1.0 { blend } else { 1.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{self, at_every_level, field, run, run_in, with_params, world};

    fn hills() -> Field {
        field(world(300, 40, 25.0), |x, y| 900.0 * libm::sin(x / 700.0) * libm::cos(y / 300.0) + 200.0)
    }

    /// The cosine between normal and sun, on planes of known orientation.
    #[test]
    fn planes_reflect_by_lamberts_law() {
        let params = with_params(&NODE, "light=single, azimuth=315, altitude=30");
        let shade_of = |east: f64, south: f64| {
            let height = field(world(6, 6, 10.0), |x, y| east * x + south * y);
            run(&NODE, &params, &[("height", &height)], "shade").samples()[14]
        };
        assert!((shade_of(0.0, 0.0) - 0.5).abs() < 1e-6);
        // falls to the north-west at 60°: perpendicular to the sun's rays
        let t = 3.0_f64.sqrt() * 0.5_f64.sqrt();
        assert!((shade_of(t, t) - 1.0).abs() < 1e-6);
        // falls to the south-east at 60°: in shade
        assert_eq!(shade_of(-t, -t), 0.0);
    }

    #[test]
    fn level_ground_is_the_sine_of_the_altitude_in_every_light() {
        let flat = field(world(5, 5, 10.0), |_, _| 120.0);
        for light in ["single", "oblique", "blend"] {
            let params = with_params(&NODE, &format!("light={light}, altitude=30"));
            let shade = run(&NODE, &params, &[("height", &flat)], "shade");
            assert!(shade.samples().iter().all(|s| (s - 0.5).abs() < 1e-6), "{light}");
        }
    }

    /// On a steep slope facing away from the sun, a single sun leaves everything black, and four suns show the gullies.
    #[test]
    fn oblique_light_shows_forms_in_the_shade() {
        // falls to the south-east at 1.4 m/m, with gullies down the slope
        let slope = field(world(64, 64, 10.0), |x, y| 4.0 * libm::sin((x - y) / 30.0) - x - y);
        let contrast = |light: &str| {
            let params = with_params(&NODE, &format!("light={light}"));
            let (low, high) = run(&NODE, &params, &[("height", &slope)], "shade").range(0).unwrap();
            high - low
        };
        assert_eq!(contrast("single"), 0.0);
        assert!(contrast("oblique") > 0.02, "{}", contrast("oblique"));
    }

    #[test]
    fn wet_cells_are_drawn_as_level_water() {
        let height = hills();
        let wet = field(world(300, 40, 25.0), |x, _| if x < 2500.0 { 0.0 } else { f64::from(x > 5000.0) * 0.5 + 0.5 });
        let params = ParamValues::defaults(&NODE.specs());
        let dry = run(&NODE, &params, &[("height", &height)], "colour");
        let drawn = run(&NODE, &params, &[("height", &height), ("wet", &wet)], "colour");
        let level = field(world(1, 1, 25.0), |_, _| 0.0);
        let water =
            run(&NODE, &params, &[("height", &level), ("wet", &Field::constant(*level.window(), 1.0))], "colour");
        for plane in 0..3 {
            for ((drawn, dry), wet) in drawn.plane(plane).iter().zip(dry.plane(plane)).zip(wet.samples()) {
                let expected = dry + (water.plane(plane)[0] - dry) * wet;
                assert!((drawn - expected).abs() < 1e-6, "{drawn}, not {expected}");
            }
        }
    }

    /// Everything below the world's sea level is blue; nothing is if the world has no sea.
    #[test]
    fn only_a_sea_is_drawn_as_water() {
        let plain = field(world(40, 4, 25.0), |x, _| x - 500.0);
        let blue = |height: &Field, changes: &str| -> Vec<bool> {
            let colour = run(&NODE, &with_params(&NODE, changes), &[("height", height)], "colour");
            colour.plane(2).iter().zip(colour.plane(0)).map(|(blue, red)| blue > red).collect()
        };
        assert!(blue(&plain, "").iter().all(|blue| !blue), "no sea");
        for level in [-200.0, 0.0, 100.0] {
            let below: Vec<bool> = plain.samples().iter().map(|&height| f64::from(height) < level).collect();
            assert_eq!(blue(&testing::at_sea(&plain, level), ""), below, "{level}");
        }
        assert!(blue(&testing::at_sea(&plain, 0.0), "water=false").iter().all(|blue| !blue));
        let sea = testing::at_sea(&plain, 0.0);
        assert_eq!((Params::fitted(&plain).low, Params::fitted(&sea).low), (-487.5, 0.0));
    }

    #[test]
    fn windows_threads_and_simd_levels_give_the_same_bits() {
        let height = hills();
        let params = ParamValues::defaults(&NODE.specs());
        let inputs = [("height", &height)];
        let one = run_in(1, &NODE, &params, &inputs);
        assert_eq!(one, run_in(4, &NODE, &params, &inputs));
        at_every_level(|| run_in(2, &NODE, &params, &inputs));
        let part = Window { origin: [30, 11], cells: [260, 20], ..*height.window() };
        for output in ["shade", "colour"] {
            let whole = run(&NODE, &params, &inputs, output);
            let grown = run(&NODE, &params, &[("height", &height.crop(&part.grown(25.0)))], output);
            assert_eq!(grown.crop(&part), whole.crop(&part));
        }
        assert_eq!(relief(&height, &Params::default())[1], run(&NODE, &params, &inputs, "colour"));
    }

    #[test]
    fn colours_stay_within_range_on_any_land() {
        let cliff = field(world(4, 4, 1e-3), |x, _| if x > 2e-3 { 1e9 } else { -1e9 });
        for height in [cliff, field(world(1, 7, 1.0), |_, y| y), field(world(3, 1, 1.0), |_, _| 0.0), hills()] {
            for changes in
                ["light=oblique, exaggeration=1000, altitude=1", "exaggeration=0", "tints=false, azimuth=360"]
            {
                let params = with_params(&NODE, changes);
                for output in ["shade", "colour"] {
                    let field = run(&NODE, &params, &[("height", &height)], output);
                    assert!(field.samples().iter().all(|v| (0.0..=1.0).contains(v)), "{changes}");
                }
            }
            let fitted = Params::fitted(&height);
            assert!(fitted.low <= fitted.high && fitted.exaggeration >= 1.0);
        }
    }
}
