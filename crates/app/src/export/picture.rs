//! Pictures for viewing: linear RGB, three planes.

use std::borrow::Cow;

use clap::ValueEnum;
use orograph_graph::{Field, PortType, Unit, Window, World};
use orograph_nodes::{
    numerics::{light, math::f32 as math, palettes::Palette},
    render::hillshade,
};
use rayon::prelude::*;

use super::samples::Samples;

/// How heights are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum View {
    /// Elevation tints with light from the north-west
    Map,
    /// Hillshade only, in grey
    Hillshade,
}

/// A picture of a value by its type: heights as `view` selects, colours unchanged, other numbers from black to white;
/// areas and discharges on a logarithmic scale, because rivers have a million times the values of slopes.
#[must_use]
pub fn of_field(field: &Field, ty: PortType, view: View) -> Field {
    match ty {
        PortType::Height => of_height(field, view),
        PortType::Colour => field.clone(),
        PortType::Normal => of_normals(field),
        PortType::Weights => of_weights(field),
        _ => grey(field, &Scale::of(field, ty)),
    }
}

/// A picture of heights, with tints over their range; gentle relief is exaggerated until it is visible. A map has cast
/// shadows and the light of the sky, a hillshade has neither.
#[must_use]
pub fn of_height(height: &Field, view: View) -> Field {
    let light = hillshade::Params::fitted(height);
    match view {
        View::Map => map(height, light),
        View::Hillshade => {
            let [shade, _] = hillshade::relief(height, &light);
            grey(&shade, &Scale { range: [0.0, 1.0], logarithmic: false })
        }
    }
}

/// Maps of heights or of numbers that are compared: as [`of_field`], but with the scale of all of them.
#[must_use]
pub fn together(fields: &[&Field], ty: PortType) -> Vec<Field> {
    let Some((first, rest)) = fields.split_first() else { return Vec::new() };
    if ty == PortType::Height {
        let light = rest.iter().copied().fold(hillshade::Params::fitted(first), shared);
        return fields.iter().map(|height| map(height, light.clone())).collect();
    }
    let scale = rest.iter().fold(Scale::of(first, ty), |scale, field| scale.with(&Scale::of(field, ty)));
    fields.iter().map(|field| grey(field, &scale)).collect()
}

/// Heights in a light that casts shadows.
fn map(height: &Field, light: hillshade::Params) -> Field {
    let [_, colour] = hillshade::relief(height, &light.casting(height));
    colour
}

/// A light that fits other heights too: tints over the range of all, and the least exaggeration.
fn shared(light: hillshade::Params, other: &Field) -> hillshade::Params {
    let other = hillshade::Params::fitted(other);
    hillshade::Params {
        low: light.low.min(other.low),
        high: light.high.max(other.high),
        exaggeration: light.exaggeration.min(other.exaggeration),
        ..light
    }
}

/// What a picture of the viewport depends on besides what it shows.
#[derive(Clone, Copy, Debug)]
pub struct Around<'a> {
    /// The whole output, which gives the range of the tints.
    pub whole: &'a Field,
    /// What shares its tints or lies below.
    pub beside: Beside<'a>,
    /// The depth of the water on heights, in metres.
    pub water: Option<&'a Field>,
}

/// Heights beside or below what a picture shows.
#[derive(Clone, Copy, Debug)]
pub enum Beside<'a> {
    /// None.
    Nothing,
    /// Heights that share their tints with those that are shown.
    Compared(&'a Field),
    /// The terrain below a mask or numbers, on any cells, and the whole terrain, which the light fits.
    Ground {
        /// The part that is shown, or all of it.
        part: &'a Field,
        /// All of it.
        whole: &'a Field,
    },
}

impl<'a> Around<'a> {
    /// Nothing but the whole output.
    #[must_use]
    pub const fn whole(whole: &'a Field) -> Self {
        Self { whole, beside: Beside::Nothing, water: None }
    }
}

/// A picture of a part of the world as the viewport shows it, in the tints of the whole: as [`of_field`], but without
/// the shadows of terrain, which may be outside the part, and with numbers that have a unit in the colours of
/// [`palette_of`] and not in greys, which light and shadow of a 3D view would change.
#[must_use]
pub fn of_part(part: &Field, ty: PortType, around: Around<'_>) -> Field {
    let Around { whole, beside, water } = around;
    match ty {
        PortType::Height => {
            let light = hillshade::Params::fitted(whole);
            let light = if let Beside::Compared(other) = beside { shared(light, other) } else { light };
            let [_, colour] = hillshade::relief(part, &light);
            match water {
                Some(water) => flooded(&colour, &on_cells(water, part.window())),
                None => colour,
            }
        }
        PortType::Mask => match beside {
            Beside::Ground { part: ground, whole } => reddened(part, &light_on(ground, whole, part.window())),
            _ => grey(part, &Scale::linear(whole)),
        },
        PortType::Colour | PortType::Normal | PortType::Weights => of_field(part, ty, View::Map),
        PortType::Scalar(_) => {
            let colours = coloured(part, &Scale::of(whole, ty), palette_of(ty));
            match beside {
                Beside::Ground { part: ground, whole } => {
                    let level = Field::constant(Window::whole(World { cells: [3, 3], ..World::default() }), 0.0);
                    let level = light_on(&level, whole, level.window())[4];
                    lit(&colours, &light_on(ground, whole, part.window()), level)
                }
                _ => colours,
            }
        }
        _ => grey(part, &Scale::linear(whole)),
    }
}

/// A raster on the cells of a window: as it is, or between its own.
fn on_cells<'a>(field: &'a Field, window: &Window) -> Cow<'a, Field> {
    if field.window() == window {
        return Cow::Borrowed(field);
    }
    let (own, sampler) = (field.window(), Samples::of(field));
    let cell_m = own.world.cell_m();
    let corner = own.origin.map(f64::from);
    let value = |cell: usize| {
        let place = window.centre_m(cell % window.nx(), cell / window.nx());
        sampler.at(0, [0, 1].map(|axis| place[axis] / cell_m - corner[axis] - 0.5))
    };
    Cow::Owned(Field::new(*window, (0..window.len()).into_par_iter().map(value).collect()))
}

/// The light on a terrain, in the cells of a window, between 0 and 1.
fn light_on(ground: &Field, whole: &Field, window: &Window) -> Vec<f32> {
    let [shade, _] = hillshade::relief(&on_cells(ground, window), &hillshade::Params::fitted(whole));
    shade.plane(0).par_iter().map(|shade| light_of(*shade)).collect()
}

/// Colours in the light on the terrain below them. On level ground, whose light is `level`, they are those of a legend;
/// in the darkest place a quarter of them is left.
fn lit(colours: &Field, light: &[f32], level: f32) -> Field {
    const LEAST: f32 = 0.25;
    const MOST: f32 = 1.3;
    let plane = |plane: usize| {
        let lit = move |(colour, light): (&f32, &f32)| {
            (colour * (LEAST + (1.0 - LEAST) * (light / level).min(MOST))).min(1.0)
        };
        colours.plane(plane).par_iter().zip(light).map(lit)
    };
    Field::with_planes(*colours.window(), 3, (0..3).into_par_iter().flat_map(plane).collect())
}

/// A mask in red over the light on the terrain below it.
fn reddened(mask: &Field, light: &[f32]) -> Field {
    /// In linear RGB.
    const RED: [f32; 3] = [0.8, 0.08, 0.04];
    const COVER: f32 = 0.7;
    let plane = |red: f32| {
        mask.plane(0).par_iter().zip(light).map(move |(mask, light)| {
            let cover = COVER * mask.clamp(0.0, 1.0);
            light + (red * (0.3 + 0.7 * light) - light) * cover
        })
    };
    Field::with_planes(*mask.window(), 3, RED.into_par_iter().flat_map(plane).collect())
}

/// Water over colours: the deeper, the less of the ground is seen.
fn flooded(colours: &Field, depths: &Field) -> Field {
    /// In linear RGB.
    const WATER: [f32; 3] = [0.03, 0.14, 0.30];
    /// The least cover of water, and the depth at which two thirds of the rest are covered, in metres.
    const COVER: (f32, f32) = (0.55, 10.0);
    /// Water that is not drawn: a film after rain.
    const FILM_M: f32 = 0.02;
    let cover = |depth_m: f32| match depth_m > FILM_M {
        true => 1.0 - (1.0 - COVER.0) * math::exp(-depth_m / COVER.1),
        false => 0.0,
    };
    let covers: Vec<f32> = depths.plane(0).iter().map(|depth_m| cover(*depth_m)).collect();
    let plane = |(plane, water): (usize, f32)| {
        colours.plane(plane).iter().zip(&covers).map(move |(colour, cover)| colour + (water - colour) * cover)
    };
    Field::with_planes(*colours.window(), 3, WATER.into_iter().enumerate().flat_map(plane).collect())
}

/// The palette of numbers in the viewport: one without a seam for directions.
#[must_use]
pub const fn palette_of(ty: PortType) -> Palette {
    match ty {
        PortType::Scalar(Unit::Azimuth) => Palette::Compass,
        _ => Palette::Viridis,
    }
}

/// Colours in a table of a palette.
pub(crate) const TINTS: usize = 256;

/// The colours of a palette from first to last in linear RGB, perceptually even.
pub(crate) fn tints(palette: Palette) -> Vec<[f32; 3]> {
    let stops = palette.stops(0.0, 1.0);
    let oklab = |colour| light::oklab(light::linear(colour));
    let tint = |step: usize| {
        let at = step as f64 / (TINTS - 1) as f64;
        let next = stops.iter().position(|stop| stop.at >= at).unwrap_or(stops.len() - 1).max(1);
        let (a, b) = (&stops[next - 1], &stops[next]);
        let t = (at - a.at) / (b.at - a.at);
        let (from, to) = (oklab(a.colour), oklab(b.colour));
        light::rgb([0, 1, 2].map(|c| from[c] + (to[c] - from[c]) * t)).map(|v| v.clamp(0.0, 1.0) as f32)
    };
    (0..TINTS).map(tint).collect()
}

/// The positions of numbers between the two ends of a range of greys or colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// The numbers at both ends.
    range: [f32; 2],
    /// True if equal factors have equal distances. Smaller numbers than the first are at the first end.
    logarithmic: bool,
}

impl Scale {
    /// The scale that fits all numbers of a field: areas and discharges on a logarithmic scale from the smallest
    /// positive one, because rivers have a million times the values of slopes.
    #[must_use]
    pub fn of(numbers: &Field, ty: PortType) -> Self {
        match ty {
            PortType::Scalar(Unit::SquareMetres | Unit::CubicMetresPerSecond | Unit::CubicMetresPerYear) => {
                let (_, high) = numbers.range(0).unwrap_or((0.0, 1.0));
                let least = numbers.plane(0).iter().copied().filter(|v| *v > 0.0).fold(f32::INFINITY, f32::min);
                Self { range: [least, high], logarithmic: true }
            }
            // level ground, which faces nowhere, is -1
            PortType::Scalar(Unit::Azimuth) => Self { range: [0.0, 360.0], logarithmic: false },
            _ => Self::linear(numbers),
        }
    }

    /// The scale that fits the numbers of both.
    fn with(self, other: &Self) -> Self {
        Self { range: [self.range[0].min(other.range[0]), self.range[1].max(other.range[1])], ..self }
    }

    fn linear(numbers: &Field) -> Self {
        let (low, high) = numbers.range(0).unwrap_or((0.0, 1.0));
        Self { range: [low, high], logarithmic: false }
    }

    /// The position of a number: 0 at the first end, 1 at the last.
    fn level(&self, v: f32) -> f32 {
        let [low, high] = self.range;
        if self.logarithmic {
            let decades = if low < high { math::ln(high / low) } else { 1.0 };
            if v > low { math::ln(v / low) / decades } else { 0.0 }
        } else {
            (v - low) / if high > low { high - low } else { 1.0 }
        }
    }

    /// The number at a position. Returns None if there are no numbers.
    #[must_use]
    pub fn number(&self, level: f32) -> Option<f32> {
        let [low, high] = self.range;
        let inside = match self.logarithmic {
            true => low * math::pow(high / low, level),
            false => low + (high - low) * level,
        };
        let v = if level <= 0.0 {
            low
        } else if level >= 1.0 {
            high
        } else {
            inside
        };
        v.is_finite().then_some(v)
    }
}

/// Numbers in the colours of a palette; level ground, which faces nowhere, in grey.
fn coloured(field: &Field, scale: &Scale, palette: Palette) -> Field {
    const NOWHERE: [f32; 3] = [0.4; 3];
    let tints = tints(palette);
    let tint = |v: f32| match palette {
        Palette::Compass if v < 0.0 => NOWHERE,
        _ => tints[(scale.level(v).clamp(0.0, 1.0) * (TINTS - 1) as f32 + 0.5) as usize],
    };
    let numbers = field.plane(0);
    let samples = (0..3).into_par_iter().flat_map(|plane| numbers.par_iter().map(move |v| tint(*v)[plane]));
    Field::with_planes(*field.window(), 3, samples.collect())
}

/// Block averages of cells; the blocks are as large as needed for no side to have more than `most` of them. Blocks at
/// the east and south sides may be partial.
#[cfg(any(test, feature = "editor"))]
pub(crate) fn shrunk(field: &Field, most: u32) -> Field {
    let mut shrinking = Shrinking::new(field.window(), field.planes(), most);
    if shrinking.side == 1 {
        return field.clone();
    }
    shrinking.rows(field);
    shrinking.finish()
}

/// [`shrunk`] of a raster that arrives in bands of rows.
pub(crate) struct Shrinking {
    window: Window,
    /// Cells along a side of a block.
    side: usize,
    /// Number of rows received.
    done: usize,
    planes: Vec<Squares>,
}

/// The blocks of a plane.
struct Squares {
    means: Vec<f32>,
    /// Partial sums of blocks whose last row has not arrived.
    open: Vec<f64>,
}

impl Shrinking {
    pub(crate) fn new(window: &Window, planes: usize, most: u32) -> Self {
        let side = window.cells[0].max(window.cells[1]).div_ceil(most) as usize;
        let squares = |_| Squares { means: Vec::new(), open: Vec::new() };
        Self { window: *window, side, done: 0, planes: (0..planes).map(squares).collect() }
    }

    /// Adds the next rows.
    pub(crate) fn rows(&mut self, band: &Field) {
        let (nx, ny, side) = (self.window.nx(), self.window.ny(), self.side);
        let (first, end) = (self.done, self.done + band.window().ny());
        for (plane, squares) in self.planes.iter_mut().enumerate() {
            let samples = band.plane(plane);
            if side == 1 {
                squares.means.extend_from_slice(samples);
                continue;
            }
            let open = &squares.open;
            let sums = |square: usize| {
                let rows = (square * side).max(first)..((square + 1) * side).min(end);
                let mut sums = if square * side < first { open.clone() } else { vec![0.0; nx.div_ceil(side)] };
                for row in samples[(rows.start - first) * nx..(rows.end - first) * nx].chunks_exact(nx) {
                    for (sum, part) in sums.iter_mut().zip(row.chunks(side)) {
                        *sum += part.iter().map(|v| f64::from(*v)).sum::<f64>();
                    }
                }
                sums
            };
            let all: Vec<Vec<f64>> = (first / side..end.div_ceil(side)).into_par_iter().map(sums).collect();
            for (square, sums) in (first / side..).zip(all) {
                let last = ((square + 1) * side).min(ny);
                if last > end {
                    squares.open = sums;
                    continue;
                }
                let cells = |i: usize| (side.min(nx - i * side) * (last - square * side)) as f64;
                squares.means.extend(sums.iter().enumerate().map(|(i, sum)| (sum / cells(i)) as f32));
            }
        }
        self.done = end;
    }

    /// The blocks of all rows.
    pub(crate) fn finish(self) -> Field {
        let (planes, side) = (self.planes.len(), self.side);
        let mut means = self.planes.into_iter().map(|squares| squares.means);
        let mut samples = means.next().unwrap_or_default();
        means.for_each(|means| samples.extend_from_slice(&means));
        if side == 1 {
            return Field::with_planes(self.window, planes, samples);
        }
        let cells = self.window.cells.map(|count| count.div_ceil(side as u32));
        let size = cells.map(|count| f64::from(count) * side as f64 * self.window.cell_m());
        Field::with_planes(Window::whole(World { size, cells, ..self.window.world }), planes, samples)
    }
}

/// Perceptually uniform grey: the scale gives the perceived position of a number between black and white, and the
/// transfer curve of sRGB (IEC 61966-2-1) converts it to light.
fn grey(field: &Field, scale: &Scale) -> Field {
    let plane: Vec<f32> = field.plane(0).par_iter().map(|v| light_of(scale.level(*v))).collect();
    Field::with_planes(*field.window(), 3, plane.repeat(3))
}

/// The light of a level between black and white.
fn light_of(level: f32) -> f32 {
    let v = level.clamp(0.0, 1.0);
    if v <= 0.04045 { v / 12.92 } else { math::pow((v + 0.055) / 1.055, 2.4) }
}

/// The linear RGB of a picture of sRGB codes, four bytes per pixel.
#[must_use]
pub fn of_codes(codes: &[u8], size: [u32; 2]) -> Field {
    let table: Vec<f32> = (0..=255_u8).map(|code| light_of(f32::from(code) / 255.0)).collect();
    let world = World { size: size.map(f64::from), cells: size, ..World::default() };
    let plane = |plane: usize| codes.chunks_exact(4).map(move |pixel| pixel[plane]);
    let samples = (0..3).flat_map(plane).map(|code| table[usize::from(code)]).collect();
    Field::with_planes(Window::whole(world), 3, samples)
}

/// A picture of unit normals as in normal maps: level ground is light blue.
#[must_use]
pub fn of_normals(field: &Field) -> Field {
    let samples = field.samples().par_iter().map(|v| light_of(v * 0.5 + 0.5)).collect();
    Field::with_planes(*field.window(), 3, samples)
}

/// A picture of the weights of four layers: red, green and blue light, and white for the fourth.
#[must_use]
pub fn of_weights(field: &Field) -> Field {
    let fourth = field.plane(3);
    let planes = (0..3).flat_map(|k| field.plane(k).iter().zip(fourth).map(|(own, fourth)| own + fourth));
    Field::with_planes(*field.window(), 3, planes.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_preview_keeps_its_maximum_size() {
        let world = World { size: [70.0, 30.0], cells: [7, 3], ..World::default() };
        let height = Field::new(Window::whole(world), (0..21).map(|v| v as f32).collect());
        assert_eq!(shrunk(&height, 7), height);
        let small = shrunk(&height, 4);
        // blocks of 2 x 2 cells, in the east 1 x 2, in the south 2 x 1
        assert_eq!(small.samples(), [4.0, 6.0, 8.0, 9.5, 14.5, 16.5, 18.5, 20.0]);
        assert_eq!((small.window().cells, small.window().cell_m()), ([4, 2], 20.0));
    }

    /// A hill and a mountain that are compared: the hill has the tints of the mountain's foot, and numbers one scale.
    #[test]
    fn compared_values_share_their_scale() {
        let world = World { size: [800.0, 800.0], cells: [8, 8], ..World::default() };
        let ramp = |top: f32| Field::new(Window::whole(world), (0..64).map(|k| top * k as f32 / 63.0).collect());
        let (hill, mountain) = (ramp(100.0), ramp(1000.0));
        let numbers = PortType::Scalar(Unit::One);
        let highest = |field: &Field| field.plane(0).iter().copied().fold(0.0, f32::max);
        assert_eq!(highest(&of_field(&hill, numbers, View::Map)), 1.0);
        let [small, large] = &together(&[&hill, &mountain], numbers)[..] else { unreachable!("two pictures") };
        // a tenth of the scale, in linear light
        assert!(highest(small) < 0.05 && highest(large) == 1.0, "{}", highest(small));
        let map = |field: &Field| of_field(field, PortType::Height, View::Map);
        let maps = together(&[&hill, &mountain], PortType::Height);
        assert!(maps[0] != map(&hill) && maps[1] == map(&mountain));
    }

    /// Any division of the rows into bands gives the same blocks, of which the last are partial.
    #[test]
    fn blocks_do_not_depend_on_the_bands() {
        let world = World { size: [531.0, 47.0], cells: [531, 47], ..World::default() };
        let window = Window::whole(world);
        let value = |at: usize| orograph_graph::mix(at as u32) as f32 * 1e-5;
        let field = Field::with_planes(window, 2, (0..2 * window.len()).map(value).collect());
        for most in [600, 531, 200, 100, 7] {
            let whole = shrunk(&field, most);
            for height in [1, 4, 5, 13, 46] {
                let mut shrinking = Shrinking::new(&window, 2, most);
                for first in (0..47).step_by(height as usize) {
                    let band = Window { origin: [0, first], cells: [531, height.min(47 - first)], ..window };
                    shrinking.rows(&field.crop(&band));
                }
                assert_eq!(shrinking.finish(), whole, "{most}, {height}");
            }
        }
    }

    #[test]
    fn a_part_has_the_colours_of_the_whole() {
        let world = World { size: [80.0, 60.0], cells: [8, 6], ..World::default() };
        let whole = Field::new(Window::whole(world), (0..48).map(|v| v as f32 * 3.0 + 1.0).collect());
        let window = Window { origin: [2, 1], cells: [4, 3], ..Window::whole(world) };
        let part = whole.crop(&window);
        for ty in [PortType::Mask, PortType::Scalar(Unit::Metres), PortType::Scalar(Unit::SquareMetres)] {
            assert_eq!(
                of_part(&part, ty, Around::whole(&whole)),
                of_part(&whole, ty, Around::whole(&whole)).crop(&window),
                "{ty:?}"
            );
        }
        assert_ne!(of_part(&part, PortType::Height, Around::whole(&whole)), of_height(&part, View::Map));
    }

    /// The numbers at the ends and in the middle of a scale are those that the picture shows there.
    #[test]
    fn scales_fit_their_numbers() {
        let world = World { size: [50.0, 10.0], cells: [5, 1], ..World::default() };
        let numbers = Field::new(Window::whole(world), vec![0.0, 10.0, 1000.0, 100.0, 40.0]);
        let metres = Scale::of(&numbers, PortType::Scalar(Unit::Metres));
        assert_eq!([0.0, 0.5, 1.0].map(|level| metres.number(level)), [Some(0.0), Some(500.0), Some(1000.0)]);
        assert_eq!([0.0, 500.0, 1000.0].map(|v| metres.level(v)), [0.0, 0.5, 1.0]);
        let areas = Scale::of(&numbers, PortType::Scalar(Unit::SquareMetres));
        assert_eq!([0.0, 1.0].map(|level| areas.number(level)), [Some(10.0), Some(1000.0)]);
        assert!(areas.number(0.5).is_some_and(|v| (v - 100.0).abs() < 1e-3) && areas.level(0.0) == 0.0);
        assert_eq!(
            Scale::of(&Field::constant(Window::whole(world), 0.0), PortType::Scalar(Unit::SquareMetres)).number(0.0),
            None
        );
        let picture = of_part(&numbers, PortType::Scalar(Unit::Metres), Around::whole(&numbers));
        let pixel = |picture: &Field, at: usize| [0, 1, 2].map(|plane| picture.plane(plane)[at]);
        let ends = tints(Palette::Viridis);
        assert_eq!((pixel(&picture, 0), pixel(&picture, 2)), (ends[0], ends[TINTS - 1]));
        // just east and just west of north look alike, and level ground differs from both
        let directions = Field::new(Window::whole(world), vec![0.5, 359.5, 180.0, -1.0, 90.0]);
        let picture = of_part(&directions, PortType::Scalar(Unit::Azimuth), Around::whole(&directions));
        let apart = |a: usize, b: usize| {
            let (a, b) = (pixel(&picture, a), pixel(&picture, b));
            a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f32>()
        };
        assert!(apart(0, 1) < 0.02 && apart(0, 3) > 0.1 && apart(0, 2) > 0.5, "a circle of hues");
    }

    /// Numbers are brighter on slopes that face the light, a mask is red on grey, and water is blue where it stands.
    #[test]
    fn masks_numbers_and_water_lie_on_the_terrain_of_a_map() {
        let window = Window::whole(World { size: [80.0, 60.0], cells: [8, 6], ..World::default() });
        // a ridge along the middle column: its western side faces the light
        let ridge: Vec<f32> = (0..48).map(|cell| 40.0 - 8.0 * ((cell % 8) as f32 - 3.5).abs()).collect();
        let ground = Field::new(window, ridge);
        let below = Beside::Ground { part: &ground, whole: &ground };
        let around = |water| Around { whole: &ground, beside: below, water };
        let even = Field::constant(window, 0.5);
        let sum = |picture: &Field, cell: usize| (0..3).map(|plane| picture.plane(plane)[cell]).sum::<f32>();
        let numbers = of_part(&even, PortType::Scalar(Unit::Metres), Around { whole: &even, ..around(None) });
        assert!(sum(&numbers, 17) > 1.5 * sum(&numbers, 22), "{} {}", sum(&numbers, 17), sum(&numbers, 22));
        let mask = of_part(&even, PortType::Mask, Around { whole: &even, ..around(None) });
        assert!(mask.plane(0)[17] > 1.3 * mask.plane(1)[17], "red");
        // the same slope in half as many cells, where the terrain is not built as far as the numbers
        let coarse = Window::whole(World { cells: [4, 3], ..window.world });
        let coarse = Field::new(coarse, (0..12).map(|cell| 40.0 - 16.0 * ((cell % 4) as f32 - 1.5).abs()).collect());
        let beside = Beside::Ground { part: &coarse, whole: &ground };
        let numbers = of_part(&even, PortType::Scalar(Unit::Metres), Around { whole: &even, beside, water: None });
        assert_eq!(numbers.window(), &window);
        assert!(sum(&numbers, 17) > 1.5 * sum(&numbers, 22), "{} {}", sum(&numbers, 17), sum(&numbers, 22));
        let pool = Field::new(window, (0..48).map(|cell| if cell % 8 > 5 { 3.0 } else { 0.0 }).collect());
        let [dry, wet] = [None, Some(&pool)].map(|water| of_part(&ground, PortType::Height, around(water)));
        assert_eq!(dry.plane(2)[17], wet.plane(2)[17]);
        assert!(wet.plane(2)[23] > 1.5 * wet.plane(0)[23] && dry.plane(2)[23] < 1.2 * dry.plane(0)[23], "blue");
    }

    #[test]
    fn pictures_have_three_planes_between_black_and_white() {
        let world = World { size: [80.0, 60.0], cells: [8, 6], ..World::default() };
        let height = Field::new(Window::whole(world), (0..48).map(|v| v as f32 * 3.0 - 20.0).collect());
        for picture in [
            of_height(&height, View::Map),
            of_height(&height, View::Hillshade),
            of_field(&height, PortType::Mask, View::Map),
        ] {
            assert_eq!(picture.planes(), 3);
            assert!(picture.samples().iter().all(|v| (0.0..=1.0).contains(v)));
        }
        let normals = of_normals(&Field::with_planes(Window::whole(world), 3, [-1.0, 0.0, 1.0].repeat(48)));
        assert_eq!(normals.range(0), Some((0.0, 1.0)));
        let shares = of_weights(&Field::with_planes(Window::whole(world), 4, vec![0.25; 192]));
        assert_eq!((shares.planes(), shares.range(2)), (3, Some((0.5, 0.5))));
        assert_eq!(of_field(&height, PortType::Mask, View::Map).range(1), Some((0.0, 1.0)));
        let level = Field::constant(Window::whole(world), 5.0);
        assert_eq!(of_field(&level, PortType::Mask, View::Map).range(0), Some((0.0, 0.0)));
    }
}
