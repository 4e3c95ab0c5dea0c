//! Colours by value: a colour ramp through stops, and a second ramp controlled by a second value.
//!
//! Between stops, colours are interpolated in OKLab (B. Ottosson, 2020), in linear light, or not at all. OKLab needs no
//! root here: the cube roots of the stops' cone responses are interpolated, and only their cubes are computed.

use orograph_graph::{Srgb, Stop, memory::zeroed};

use crate::numerics::{
    light::{linear, oklab, rgb},
    palettes::Palette,
    par,
};
use crate::prelude::*;

choice! {
    /// Interpolation of colours between stops.
    pub enum Between {
        /// In OKLab: perceptually even.
        Even = "even",
        /// In linear light.
        Light = "light",
        /// Each colour up to the next stop.
        Steps = "steps",
    }
}

choice! {
    /// Values at which a ready-made palette begins and ends.
    pub enum Range {
        /// The lowest and the highest value of the input in the whole world.
        Fitted = "fitted",
        /// `low` and `high`.
        Set = "set",
    }
}

fn two(low: u32, high: u32) -> ColourStops {
    ColourStops(vec![Stop { at: 0.0, colour: Srgb::hex(low) }, Stop { at: 1000.0, colour: Srgb::hex(high) }])
}

params! {
    /// Colours: a ready-made palette, or `stops`.
    palette: Palette = Palette::Alpine, One, ..;
    /// Custom colours: values of the input and their colours.
    stops: ColourStops = two(0x3b_4a_2f, 0xf7_f9_fb), One, .., when palette = "stops";
    /// Values at which a ready-made palette begins and ends.
    range: Range = Range::Fitted, One, ..;
    /// Value of the first colour of a ready-made palette.
    low: f64 = 0.0, One, -1e9..=1e9, soft -1000..=5000, when range = "set";
    /// Value of the last colour of a ready-made palette.
    high: f64 = 3000.0, One, -1e9..=1e9, soft -1000..=5000, when range = "set";
    /// Interpolation of colours between stops.
    between: Between = Between::Even, One, ..;
    /// Colours where `second` is high, along the same values.
    second_palette: Palette = Palette::Rock, One, ..;
    /// Custom colours where `second` is high.
    second_stops: ColourStops = two(0x3d_3a_37, 0xbd_b5_a8), One, .., when second_palette = "stops";
    /// Value of `second` up to which only the first colours show.
    second_from: f64 = 25.0, One, -1e9..=1e9, soft 0..=90;
    /// Value of `second` from which only the second colours show.
    second_to: f64 = 40.0, One, -1e9..=1e9, soft 0..=90;
}

inputs! {
    /// Field to colour.
    value: AnyScalar;
    /// Field that controls the second colours, such as the slope.
    second: Option<AnyScalar>;
}

outputs! {
    /// The colours, linear RGB.
    colour: Colour;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Ramp",
    version: 2,
    migrations: &[Migration { from: 1, steps: &[Step::Keep { name: "range", value: "set" }] }],
    category: "render",
    summary: "Colours by value, and by a second value such as the slope.",
    doc: include_str!("ramp.md"),
    sources: &["B. Ottosson, 2020, A perceptual color space for image processing"],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|params, _| if Params::read(params).is_fitted() { f64::INFINITY } else { 0.0 }),
    cpu: run,
    resolution: Resolution::Within(0.1),
    example: "value: \"base\", second: \"mask\", second_from: 0.4, second_to: 0.8",
    ..Node::DEFAULT
};

impl Params {
    /// Returns true if a ready-made palette is used.
    fn uses_range(&self) -> bool {
        self.palette != Palette::Stops || self.second_palette != Palette::Stops
    }

    /// Returns true if the colours depend on the lowest and the highest value. With `stops`, a ready-made second palette
    /// goes from the first stop to the last.
    fn is_fitted(&self) -> bool {
        self.range == Range::Fitted && self.palette != Palette::Stops
    }

    /// Returns the values of the first and the last colour of ready-made palettes. They differ, also for constant input,
    /// which gets the first colour.
    fn ends(&self, value: &Field) -> Result<[f64; 2], NodeError> {
        if self.is_fitted() {
            let (low, high) = value.range(0).unwrap_or_default();
            return Ok(apart([low, high].map(f64::from)));
        }
        if self.range == Range::Fitted {
            let at = |stop: Option<&Stop>| stop.map_or(0.0, |stop| stop.at);
            return Ok(apart([at(self.stops.0.first()), at(self.stops.0.last())]));
        }
        rises("low", self.low, "high", self.high, self.uses_range())?;
        Ok([self.low, self.high])
    }
}

/// Moves the end of a range away from its start if both are equal.
fn apart([low, high]: [f64; 2]) -> [f64; 2] {
    [low, if high > low { high } else { low + 1e-5 * low.abs() + 1e-9 }]
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let inputs = Inputs::read(job)?;
    let params = Params::read(job.params);
    let [low, high] = params.ends(inputs.value)?;
    let second = inputs.second;
    rises("second_from", params.second_from, "second_to", params.second_to, second.is_some())?;
    let ready = |palette: Palette, own: ColourStops| match palette {
        Palette::Stops => own.0,
        _ => palette.stops(low, high),
    };
    let first = Ramp::new(&ready(params.palette, params.stops), params.between);
    let other = Ramp::new(&ready(params.second_palette, params.second_stops), params.between);
    let (from, span) = (params.second_from as f32, (params.second_to - params.second_from) as f32);
    let values = inputs.value.plane(0);
    let second = second.map(|field| field.plane(0));
    let window = job.window();
    let (nx, len) = (window.nx(), window.len());
    let mut colour = zeroed(3 * len)?;
    let (red, rest) = colour.split_at_mut(len);
    let (green, blue) = rest.split_at_mut(len);
    par::each(red.chunks_mut(nx).zip(green.chunks_mut(nx)).zip(blue.chunks_mut(nx)), |j, ((red, green), blue)| {
        job.check()?;
        let cells = j * nx..(j + 1) * nx;
        for (i, value) in values[cells.clone()].iter().enumerate() {
            let share = second.map_or(0.0, |second| ((second[cells.start + i] - from) / span).clamp(0.0, 1.0));
            let colour = match share {
                0.0 => first.of(*value),
                1.0 => other.of(*value),
                _ => {
                    let (a, b) = (first.of(*value), other.of(*value));
                    [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * share)
                }
            };
            [red[i], green[i], blue[i]] = colour;
        }
        Ok::<_, NodeError>(())
    })?;
    Ok(Given { colour: Some(Field::with_planes(window, 3, colour)) }.into())
}

/// Rejects a range whose end is not above its start, if it is used.
fn rises(low_name: &str, low: f64, high_name: &str, high: f64, used: bool) -> Result<(), NodeError> {
    if !used || (low as f32) < high as f32 {
        return Ok(());
    }
    let message = format!("`{low_name}` is {low} and `{high_name}` is {high}; the second must be the higher");
    Err(NodeError::failed_with_hint(message, "exchange the two; own `stops` can turn the colours around"))
}

/// Stops with precomputed colours.
#[derive(Debug)]
struct Ramp {
    /// Values of the stops, ascending.
    at: Vec<f32>,
    /// Colours of the stops in linear light.
    light: Vec<[f32; 3]>,
    /// Colours of the stops in the space of interpolation: OKLab or linear light.
    mixed: Vec<[f32; 3]>,
    between: Between,
}

impl Ramp {
    fn new(stops: &[Stop], between: Between) -> Self {
        let light: Vec<[f64; 3]> = stops.iter().map(|stop| linear(stop.colour)).collect();
        let single = |colour: [f64; 3]| colour.map(|v| v as f32);
        Self {
            at: stops.iter().map(|stop| stop.at as f32).collect(),
            mixed: light.iter().map(|c| single(if between == Between::Even { oklab(*c) } else { *c })).collect(),
            light: light.into_iter().map(single).collect(),
            between,
        }
    }

    /// Returns the colour of a value in linear light: exactly the stop's colour at a stop, and that of the nearest end
    /// beyond the ends.
    fn of(&self, value: f32) -> [f32; 3] {
        let above = self.at.partition_point(|at| *at <= value);
        let below = above.saturating_sub(1);
        if above == 0 || above == self.at.len() || self.at[below] == value || self.between == Between::Steps {
            return self.light[below];
        }
        let t = (value - self.at[below]) / (self.at[above] - self.at[below]);
        let (a, b) = (self.mixed[below], self.mixed[above]);
        let mixed = [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * t);
        match self.between {
            Between::Even => rgb(mixed.map(f64::from)).map(|v| v.clamp(0.0, 1.0) as f32),
            _ => mixed,
        }
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::ParamValue;

    use super::*;
    use crate::testing::{self, field, outputs, run, run_in, with_params, world};

    fn stops(text: &[(f64, u32)]) -> ParamValue {
        ParamValue::Stops(text.iter().map(|(at, code)| Stop { at: *at, colour: Srgb::hex(*code) }).collect())
    }

    fn own(text: &[(f64, u32)], changes: &str) -> ParamValues {
        let mut params = with_params(&NODE, &format!("palette=stops,second_palette=stops,{changes}"));
        params.set("stops", stops(text));
        params
    }

    fn at(colour: &Field, cell: usize) -> [f32; 3] {
        [0, 1, 2].map(|plane| colour.plane(plane)[cell])
    }

    /// Reference: the sRGB byte of a linear value by definition.
    fn byte(linear: f32) -> u8 {
        let v = f64::from(linear);
        let code = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * libm::pow(v, 1.0 / 2.4) - 0.055 };
        (255.0 * code).round() as u8
    }

    #[test]
    fn stops_have_their_own_colours_in_light_and_in_bytes() {
        let three = [(-50.0, 0x10_20_f0), (0.0, 0x7a_9e_77), (800.0, 0xfb_fa_f8)];
        // cells at -50, 0, 800 and beyond both ends
        let places = [-50.0, 0.0, 800.0, -1e6, 1e9];
        let value = field(world(5, 1, 1.0), |x, _| places[x as usize]);
        for between in ["even", "light", "steps"] {
            let colour = run(&NODE, &own(&three, &format!("between={between}")), &[("value", &value)], "colour");
            for (cell, stop) in [0, 1, 2, 0, 2].into_iter().enumerate() {
                let code = Srgb::hex(three[stop].1);
                assert_eq!(at(&colour, cell), linear(code).map(|v| v as f32), "{between} {cell}");
                assert_eq!(at(&colour, cell).map(byte), code.0, "{between} {cell}");
            }
        }
    }

    #[test]
    fn half_way_is_the_mean_of_what_is_mixed() {
        let two = [(0.0, 0x20_60_a0), (100.0, 0xe0_a0_40)];
        let value = field(world(1, 1, 1.0), |_, _| 50.0);
        let [a, b] = two.map(|(_, code)| linear(Srgb::hex(code)));
        let mean = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|c| (a[c] + b[c]) / 2.0);
        for (between, expected) in
            [("light", mean(a, b)), ("even", rgb(mean(oklab(a), oklab(b)))), ("steps", linear(Srgb::hex(two[0].1)))]
        {
            let colour = run(&NODE, &own(&two, &format!("between={between}")), &[("value", &value)], "colour");
            for (got, expected) in at(&colour, 0).into_iter().zip(expected) {
                assert!((f64::from(got) - expected).abs() < 1e-6, "{between}: {got} {expected}"); // single precision
            }
        }
    }

    #[test]
    fn one_stop_is_one_colour_and_grey_in_light_is_the_value() {
        let value = field(world(64, 1, 1.0), |x, _| x / 64.0);
        let one = run(&NODE, &own(&[(5.0, 0x7a_9e_77)], ""), &[("value", &value)], "colour");
        assert!((0..64).all(|cell| at(&one, cell) == at(&one, 0)));
        let grey = with_params(&NODE, "palette=grey,between=light,range=set,high=1");
        let grey = run(&NODE, &grey, &[("value", &value)], "colour");
        for plane in 0..3 {
            assert_eq!(grey.plane(plane), value.samples());
        }
    }

    #[test]
    fn the_second_value_brings_the_second_colours_in() {
        let value = field(world(5, 1, 1.0), |_, _| 500.0);
        let second = field(world(5, 1, 1.0), |x, _| [0.0, 25.0, 32.5, 40.0, 90.0][x as usize]);
        let params = with_params(&NODE, "range=set,high=1000,between=light");
        let alone = run(&NODE, &params, &[("value", &value)], "colour");
        let both = run(&NODE, &params, &[("value", &value), ("second", &second)], "colour");
        let rock = with_params(&NODE, "range=set,high=1000,between=light,palette=rock");
        let rock = run(&NODE, &rock, &[("value", &value)], "colour");
        for cell in [0, 1] {
            assert_eq!(at(&both, cell), at(&alone, cell));
        }
        for cell in [3, 4] {
            assert_eq!(at(&both, cell), at(&rock, cell));
        }
        for c in 0..3 {
            let mean = (at(&alone, 2)[c] + at(&rock, 2)[c]) / 2.0;
            assert!((at(&both, 2)[c] - mean).abs() < 1e-6); // single precision
        }
    }

    #[test]
    fn ranges_that_do_not_rise_are_refused_where_they_are_used() {
        let value = field(world(2, 2, 1.0), |x, _| x);
        let error = |params: &ParamValues, inputs: &[(&str, &Field)]| {
            outputs(&NODE, params, inputs).err().map(|error| error.to_string())
        };
        let flat = with_params(&NODE, "range=set,low=5,high=5");
        assert!(error(&flat, &[("value", &value)]).is_some_and(|text| text.contains("`low` is 5")));
        assert_eq!(error(&own(&[(0.0, 0)], "range=set,low=5,high=5"), &[("value", &value)]), None);
        let turned = with_params(&NODE, "second_from=40,second_to=30");
        assert_eq!(error(&turned, &[("value", &value)]), None);
        assert!(error(&turned, &[("value", &value), ("second", &value)]).is_some_and(|t| t.contains("second_from")));
    }

    #[test]
    fn a_fitted_palette_begins_at_the_lowest_value_and_ends_at_the_highest() {
        let value = field(world(64, 1, 1.0), |x, _| 3.0 * x - 700.0);
        let [low, high] = [value.samples()[0], value.samples()[63]];
        let fitted = run(&NODE, &with_params(&NODE, "between=light"), &[("value", &value)], "colour");
        let set = with_params(&NODE, &format!("between=light,range=set,low={low},high={high}"));
        assert_eq!(fitted, run(&NODE, &set, &[("value", &value)], "colour"));
        // a narrow range is a range
        let narrow = field(world(64, 1, 1.0), |x, _| 1e-10 * (1.0 + x / 64.0));
        let colour = run(&NODE, &with_params(&NODE, "palette=grey,between=light"), &[("value", &narrow)], "colour");
        assert!(colour.samples()[0] < 0.01 && colour.samples()[63] > 0.99);
        // own stops need no other cells
        assert_eq!(testing::reach_m(&NODE, &own(&[(0.0, 0), (9.0, 0xff)], ""), 1.0), 0.0);
        let of_stops = with_params(&NODE, "palette=stops");
        assert_eq!(testing::reach_m(&NODE, &of_stops, 1.0), 0.0);
        for constant in [0.0, -3.0, 1e9] {
            let level = field(world(3, 2, 1.0), |_, _| constant);
            let colour = run(&NODE, &with_params(&NODE, "palette=grey"), &[("value", &level)], "colour");
            assert!(colour.samples().iter().all(|v| *v == 0.0), "{constant}");
        }
    }

    #[test]
    fn colours_are_within_range_and_the_same_on_any_number_of_threads() {
        let value = field(world(200, 30, 20.0), |x, y| 1500.0 + 1e3 * libm::sin(x / 300.0) + y);
        for (palette, _) in Palette::OPTIONS {
            let params = with_params(&NODE, &format!("palette={palette}"));
            let one = run_in(1, &NODE, &params, &[("value", &value)]);
            assert_eq!(one, run_in(4, &NODE, &params, &[("value", &value)]));
            let colour = run(&NODE, &params, &[("value", &value)], "colour");
            assert!(colour.samples().iter().all(|v| (0.0..=1.0).contains(v)), "{palette}");
        }
    }
}
