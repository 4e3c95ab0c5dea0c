//! Shaded relief, plain and coloured by elevation.

mod cast;
mod device;

use std::{convert::Infallible, path::PathBuf};

use orograph_graph::{Cancel, InputValue, LevelJob, ParamValues, Wanted, Warnings, memory::zeroed};

use self::cast::{Cast, rays, reach_m};
use crate::{
    numerics::{
        cells::BLOCK,
        gradient::{Method, Surface},
        math, par,
        simd::simd,
        tints::{self, Tints},
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
    /// Strength of cast shadows, and of the dimmer light where terrain hides a part of the sky: 0 for neither.
    shadows: f64 = 0.8, One, 0.0..=1.0;
    /// Distance over which terrain casts shadows and hides the sky.
    distance: f64 = 4000.0, Metres, 1.0..=1e6, soft 200.0..=20000.0, given shadows;
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
    version: 3,
    migrations: &[
        Migration { from: 1, steps: &[] },
        Migration { from: 2, steps: &[Step::Keep { name: "shadows", value: "0" }] },
    ],
    category: "render",
    summary: "Shaded relief as in cartography, plain and coloured by elevation.",
    doc: include_str!("page.md"),
    sources: &[
        "B. K. P. Horn, 1981, Hill shading and the reflectance map, Proceedings of the IEEE 69(1), 14-47",
        "R. K. Mark, 1992, Multidirectional, oblique-weighted, shaded-relief image of the Island of Hawaii, USGS \
         Open-File Report 92-422",
        "E. Imhof, 1965, Kartographische Geländedarstellung, de Gruyter",
        "K. Zakšek, K. Oštir and Ž. Kokalj, 2011, Sky-view factor as a relief visualization technique, Remote Sensing 3, \
         398-415",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|params, cell_m| {
        let params = Params::read(params);
        if params.shadows > 0.0 { reach_m(params.distance, cell_m) } else { cell_m }
    }),
    reads_sea: true,
    scratch: Scratch::Bytes(scratch),
    refuses: Some(refuses),
    cpu: run,
    gpu: Some(&device::GPU),
    resolution: Resolution::Cells(
        "the gradient is measured between neighbouring cells, so slopes are gentler with larger cells",
    ),
    example: "height: \"base\", altitude: 30, high: 2500",
    ..Node::DEFAULT
};

impl Default for Params {
    fn default() -> Self {
        Self::read(&ParamValues::defaults(&Self::specs()))
    }
}

impl Params {
    /// Returns the defaults without shadows, with tints over the range of a field, from sea level upwards if its world
    /// has a sea, and with gentle terrain exaggerated until it is visible.
    #[must_use]
    pub fn fitted(height: &Field) -> Self {
        let (low, high) = height.range(0).map_or((0.0, 1.0), |(low, high)| (f64::from(low), f64::from(high)));
        let (mean, steep) = slopes(height);
        // gentle ground becomes visible, unless a steep part of it, such as the lee of dunes, would become a wall
        let exaggeration =
            if mean > 0.0 && mean.is_finite() { (0.3 / mean).min(1.0 / steep).clamp(1.0, 50.0) } else { 1.0 };
        let low = height.window().world.sea_level.filter(|sea| high > *sea).map_or(low, |sea| low.max(sea));
        Self { low, high, exaggeration, shadows: 0.0, ..Self::default() }
    }

    /// Returns the same light from a lower sun, with shadows as long as the relief of a field casts them.
    #[must_use]
    pub fn casting(self, height: &Field) -> Self {
        /// In degrees: shadows begin at slopes of mountains.
        const LOW_SUN: f64 = 32.0;
        let relief_m = height.range(0).map_or(0.0, |(low, high)| f64::from(high) - f64::from(low));
        let longest_m = self.exaggeration * relief_m / math::tan(LOW_SUN.to_radians());
        let distance = longest_m.max(8.0 * height.window().cell_m()).min(1e6);
        Self { altitude: LOW_SUN, shadows: Self::default().shadows, distance, ..self }
    }
}

/// Returns the mean slope of a field, and the slope that 0.5 % of its cells reach, to about a twelfth.
fn slopes(height: &Field) -> (f64, f64) {
    /// Bits of a squared slope that choose its bin: sign, exponent and three of the fraction.
    const BIN: u32 = 20;
    const STEEPEST: f64 = 0.005;
    let surface = Surface::new(height, Method::Central);
    let (nx, ny) = (height.window().nx(), height.window().ny());
    let mut bins = vec![0_u32; 1 << (32 - BIN)];
    let mut sum = 0.0;
    for j in 0..ny {
        let mut along = 0.0;
        surface.row(j, |_, east, south| {
            for (&p, &q) in east.iter().zip(south) {
                let squared = p * p + q * q;
                along += f64::from(squared.sqrt());
                bins[(squared.to_bits() >> BIN) as usize] += 1;
            }
        });
        sum += along;
    }
    let cells = (nx * ny) as f64;
    let mut left = (STEEPEST * cells) as u32;
    let steepest = bins.iter().rposition(|&count| {
        let is_here = left < count;
        left = left.saturating_sub(count);
        is_here
    });
    let steep = f32::from_bits((steepest.unwrap_or(0) as u32) << BIN).sqrt();
    (sum / cells, f64::from(steep))
}

/// Computes the shaded relief of a heightfield: `shade`, one plane, and `colour`, three planes of linear RGB. Where
/// there is no memory for horizons, it has no shadows.
#[must_use]
pub fn relief(height: &Field, params: &Params) -> [Field; 2] {
    let values = ParamValues::defaults(&Params::specs());
    let job = Job {
        node: &NODE,
        params: &values,
        inputs: Vec::<InputValue>::new(),
        level: LevelJob::default(),
        window: *height.window(),
        wanted: Wanted::ALL,
        folder: PathBuf::new(),
        cancel: Cancel::default(),
        progress: &|_| {},
        warnings: Warnings::default(),
        glimpses: None,
    };
    let window = *height.window();
    let (mut shade, mut colour) = (vec![0.0; window.len()], vec![0.0; 3 * window.len()]);
    let cast = Cast::new(&job, height, params).ok().flatten();
    let Ok(()) = paint(height, None, params, cast.as_ref(), [&mut shade, &mut colour], || Ok::<_, Infallible>(()));
    [Field::new(window, shade), Field::with_planes(window, 3, colour)]
}

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let params = Params::read(sizing.params);
    // the shade, which is computed even if only the colours are wanted
    let shade = if Wants::among(sizing.wanted).shade { 0 } else { sizing.cells(4.0) };
    if params.shadows > 0.0 { shade + rays(&params, &sizing.window.world).bytes(&sizing.window) } else { shade }
}

/// Refuses a range of tints that falls.
fn refuses(stated: &Stated<'_>) -> Result<(), NodeError> {
    let params = Params::read(stated.params);
    if params.low > params.high {
        return Err(NodeError::failed_with_hint(
            format!("`low` is {} m, above `high`, {} m", params.low, params.high),
            "exchange the two",
        ));
    }
    Ok(())
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { height, wet } = Inputs::read(job)?;
    let params = Params::read(job.params);
    refuses(&Stated::of_job(job))?;
    let (window, wants) = (job.window(), Wants::of(job));
    let (mut shade, mut colour) =
        (zeroed(window.len())?, if wants.colour { zeroed(3 * window.len())? } else { Vec::new() });
    let cast = Cast::new(job, height, &params)?;
    paint(height, wet, &params, cast.as_ref(), [&mut shade, &mut colour], || job.check())?;
    Ok(Given {
        shade: wants.shade.then(|| Field::new(window, shade)),
        colour: wants.colour.then(|| Field::with_planes(window, 3, colour)),
    }
    .into())
}

/// Shades all rows, and writes the three planes of `colour` unless it is empty. Calls `check` before each row, which may
/// cancel.
fn paint<E: Send>(
    height: &Field,
    wet: Option<&Field>,
    params: &Params,
    cast: Option<&Cast<'_>>,
    [shade, colour]: [&mut [f32]; 2],
    check: impl Fn() -> Result<(), E> + Sync,
) -> Result<(), E> {
    let window = *height.window();
    let nx = window.nx();
    let surface = Surface::new(height, Method::Horn);
    let sun = Sun::new(params);
    let sea_m = window.world.sea_level.filter(|_| params.water);
    let land = params.tints.then(|| Tints::new(params.low, params.high, sea_m));
    let water = sun.lit(tints::open_water(), sun.sin_altitude, 1.0);
    // light on a row, and the part of the sky that each of its cells sees
    let light = |j: usize, shade: &mut [f32], sky: &mut [f32]| {
        let mut lit = vec![1.0; if cast.is_some() { nx } else { 0 }];
        if let Some(cast) = cast {
            cast.row(j, &mut lit, sky);
        }
        surface.row(j, |start, east, south| {
            let cells = start..start + east.len();
            let given = cast.map(|_| [&lit[cells.clone()], &sky[cells.clone()]]);
            sun.shade(east, south, given, &mut shade[cells]);
        });
    };
    if colour.is_empty() {
        return par::each(shade.chunks_mut(nx), |j, shade| {
            check()?;
            light(j, shade, &mut vec![1.0; nx]);
            Ok::<_, E>(())
        });
    }
    let (red, rest) = colour.split_at_mut(window.len());
    let (green, blue) = rest.split_at_mut(window.len());
    let rgb = red.chunks_mut(nx).zip(green.chunks_mut(nx)).zip(blue.chunks_mut(nx));
    let rows = shade.chunks_mut(nx).zip(rgb).zip(height.plane(0).chunks(nx));
    par::each(rows, |j, ((shade, ((red, green), blue)), heights)| {
        check()?;
        let mut sky = vec![1.0; nx];
        light(j, shade, &mut sky);
        let rgb = red.iter_mut().zip(green.iter_mut()).zip(blue.iter_mut());
        for (((&shade, &sky), &height), ((red, green), blue)) in shade.iter().zip(&sky).zip(heights).zip(rgb) {
            let tint = land.as_ref().map_or([1.0; 3], |tints| tints.of(height));
            [*red, *green, *blue] = sun.lit(tint, shade, sky);
        }
        if let Some(wet) = wet {
            let wet = &wet.plane(0)[j * nx..(j + 1) * nx];
            for (plane, water) in [red, green, blue].into_iter().zip(water) {
                plane.iter_mut().zip(wet).for_each(|(v, wet)| *v += (water - *v) * wet.clamp(0.0, 1.0));
            }
        }
        Ok(())
    })
}

/// Skylight on all slopes, and sunlight on level ground: cool shadows, warm light.
const SKY: [f32; 3] = [0.16, 0.18, 0.23];
const SUN: [f32; 3] = [0.70, 0.68, 0.63];

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

    /// Computes the light on a run of cells; `cast` has the part of the sun and the part of the sky that each sees.
    fn shade(&self, east: &[f32], south: &[f32], cast: Option<[&[f32]; 2]>, out: &mut [f32]) {
        match cast {
            Some([lit, sky]) => shade(self, [east, south], [lit, sky], out),
            None => {
                const OPEN: [f32; BLOCK] = [1.0; BLOCK];
                shade(self, [east, south], [&OPEN; 2].map(|open| &open[..east.len()]), out);
            }
        }
    }

    /// Returns a tint under light. Level ground is a little below full brightness, so that sunlit slopes stand out from
    /// it.
    fn lit(&self, tint: [f32; 3], shade: f32, sky: f32) -> [f32; 3] {
        let sunlight = shade / self.sin_altitude;
        [0, 1, 2].map(|c| (tint[c] * (SKY[c] * sky + SUN[c] * sunlight)).min(1.0))
    }
}

simd! {
    fn shade(sun: &Sun, slopes: [&[f32]; 2], cast: [&[f32]; 2], out: &mut [f32]) {
        /// Avoids a division of zero by zero on level ground, which has no oblique light.
        const LEVEL: f32 = 1e-12;
        let ([east, south], [lit, sky]) = (slopes, cast);
        for ((((out, &p), &q), &lit), &sky) in out.iter_mut().zip(east).zip(south).zip(lit).zip(sky) {
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
            let oblique = oblique / (2.0 * steepness + 4.0 * LEVEL) * sky;
            let single = light[0] * lit;
            let blend = single + (oblique - single) * sun.oblique;
            *out = if blend < 1.0 { blend } else { 1.0 };
        }
    }
}

#[cfg(test)]
mod tests;
