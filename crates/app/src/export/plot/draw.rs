//! Draws a plot: axes, grid, curves and legend.

use std::sync::Once;

use epaint_default_fonts::UBUNTU_LIGHT;
use plotters::{
    chart::{ChartBuilder, SeriesLabelPosition},
    coord::Shift,
    drawing::{DrawingArea, IntoDrawingArea},
    element::{DashedPathElement, IntoDynElement, PathElement, Rectangle},
    prelude::{BitMapBackend, DrawingBackend, SVGBackend},
    series::{DashedLineSeries, LineSeries},
    style::{Color, FontStyle, IntoFont, RGBColor, ShapeStyle, TextStyle, register_font},
};

use super::{CURVES, Curve, Plot, SAMPLES, SIZE, Theme, scale::Scale};
use crate::report::reading::words;

/// The family of the texts: in an SVG that of the viewer, in a picture the font of the program.
const FONT: &str = "sans-serif";

/// How opaque the bars of a histogram are, so that the outline of the reference shows through.
const BARS: f64 = 0.55;

/// The dashes of each curve and the gaps between them; the first is drawn through.
const DASHES: [(u32, u32); CURVES] = [(1, 0), (14, 8), (5, 6), (26, 6), (9, 14)];

/// Colours of a theme.
struct Colours {
    ground: RGBColor,
    text: RGBColor,
    grid: RGBColor,
    minor: RGBColor,
    curves: [RGBColor; CURVES],
}

impl Theme {
    /// Curves have colours of Okabe and Ito, which colour-blind people tell apart.
    const fn colours(self) -> Colours {
        match self {
            Self::Light => Colours {
                ground: RGBColor(255, 255, 255),
                text: RGBColor(34, 34, 34),
                grid: RGBColor(205, 205, 205),
                minor: RGBColor(234, 234, 234),
                curves: [
                    RGBColor(0, 114, 178),
                    RGBColor(213, 94, 0),
                    RGBColor(0, 158, 115),
                    RGBColor(204, 121, 167),
                    RGBColor(230, 159, 0),
                ],
            },
            Self::Dark => Colours {
                ground: RGBColor(27, 30, 34),
                text: RGBColor(230, 230, 230),
                grid: RGBColor(78, 84, 92),
                minor: RGBColor(48, 52, 58),
                curves: [
                    RGBColor(86, 180, 233),
                    RGBColor(230, 159, 0),
                    RGBColor(0, 158, 115),
                    RGBColor(204, 121, 167),
                    RGBColor(240, 228, 66),
                ],
            },
        }
    }

    /// The red, green and blue of a curve's colour; every [`CURVES`] curves the colours start again.
    #[must_use]
    pub const fn colour(self, curve: usize) -> [u8; 3] {
        let RGBColor(r, g, b) = self.colours().curves[curve % CURVES];
        [r, g, b]
    }

    /// The colours of the curves as an SVG writes them.
    #[cfg(test)]
    pub(super) fn curves(self) -> [String; CURVES] {
        self.colours().curves.map(|RGBColor(r, g, b)| format!("#{r:02X}{g:02X}{b:02X}"))
    }
}

/// A plot as the text of an SVG file.
pub(super) fn svg(plot: &Plot, theme: Theme) -> Result<String, String> {
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, (SIZE[0], SIZE[1])).into_drawing_area();
        draw(&root, plot, theme, 1)?;
    }
    Ok(text)
}

/// A plot as the RGB pixels of a picture.
pub(super) fn pixels(plot: &Plot, theme: Theme) -> Result<Vec<u8>, String> {
    let [width, height] = SIZE.map(|side| side * SAMPLES);
    let mut fine = vec![0; (3 * width * height) as usize];
    {
        let root = BitMapBackend::with_buffer(&mut fine, (width, height)).into_drawing_area();
        draw(&root, plot, theme, SAMPLES)?;
    }
    let at = |x: u32, y: u32, channel: u32| u32::from(fine[(3 * (y * width + x) + channel) as usize]);
    let mean = |x: u32, y: u32, channel: u32| {
        let samples = (0..SAMPLES).flat_map(|j| (0..SAMPLES).map(move |i| (i, j)));
        let sum: u32 = samples.map(|(i, j)| at(SAMPLES * x + i, SAMPLES * y + j, channel)).sum();
        (sum / (SAMPLES * SAMPLES)) as u8
    };
    let places = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
    Ok(places.flat_map(|(x, y)| [0, 1, 2].map(|channel| mean(x, y, channel))).collect())
}

fn register() {
    static ONCE: Once = Once::new();
    // The font is part of the program and has been read in tests.
    ONCE.call_once(|| drop(register_font(FONT, FontStyle::Normal, UBUNTU_LIGHT)));
}

/// Draws a plot with all lengths multiplied by `zoom`.
fn draw<DB: DrawingBackend>(root: &DrawingArea<DB, Shift>, plot: &Plot, theme: Theme, zoom: u32) -> Result<(), String> {
    register();
    let colours = theme.colours();
    let wrong = |error: &dyn std::fmt::Display| error.to_string();
    let numbers =
        |axis: usize| plot.curves.iter().flat_map(move |curve| curve.points.iter().map(move |point| point[axis]));
    let (Some(x), Some(y)) = (Scale::around(numbers(0), plot.x.log), Scale::around(numbers(1), plot.y.log)) else {
        return Err("it has no points".to_owned());
    };
    let font = |size: u32| TextStyle::from((FONT, f64::from(size * zoom)).into_font()).color(&colours.text);
    let line =
        |colour: &RGBColor, width: u32| ShapeStyle { color: colour.to_rgba(), filled: false, stroke_width: width };
    root.fill(&colours.ground).map_err(|error| wrong(&error))?;
    let corner = emptiest(&plot.curves, &x, &y);
    let mut chart = ChartBuilder::on(root)
        .caption(words(&plot.name), font(30))
        .margin(24 * zoom)
        .margin_right(40 * zoom)
        .x_label_area_size(76 * zoom)
        .y_label_area_size(104 * zoom)
        .build_cartesian_2d(x.clone(), y.clone())
        .map_err(|error| wrong(&error))?;
    chart
        .configure_mesh()
        .x_desc(plot.x.text.as_str())
        .y_desc(plot.y.text.as_str())
        .axis_desc_style(font(24))
        .label_style(font(20))
        .x_labels(10)
        .y_labels(8)
        .bold_line_style(line(&colours.grid, zoom))
        .light_line_style(line(&colours.minor, zoom))
        .axis_style(line(&colours.text, zoom))
        .set_all_tick_mark_size(6 * zoom)
        .draw()
        .map_err(|error| wrong(&error))?;
    for (at, Curve { label, points, bars }) in plot.curves.iter().enumerate() {
        let style = line(&colours.curves[at], if bars.is_empty() { 3 } else { 2 } * zoom);
        let fill = colours.curves[at].mix(BARS).filled();
        if at == 0 {
            let bar = |&[from, to, height]: &[f64; 3]| Rectangle::new([(from, 0.0), (to, height)], fill);
            chart.draw_series(bars.iter().map(bar)).map_err(|error| wrong(&error))?;
        }
        let points = points.iter().map(|[x, y]| (*x, *y));
        let (is_bars, half) = (!bars.is_empty(), (9 * zoom) as i32);
        let (dash, gap) = DASHES[at];
        let (dash, gap) = ((dash * zoom) as i32, (gap * zoom) as i32);
        let end = (52 * zoom) as i32;
        // References are dashed, so that the curves differ without their colours.
        let series = if at == 0 {
            chart.draw_series(LineSeries::new(points, style))
        } else {
            chart.draw_series(DashedLineSeries::new(points, dash, gap, style))
        };
        series.map_err(|error| wrong(&error))?.label(label).legend(move |(left, middle)| {
            let path = [(left, middle), (left + end, middle)];
            if at == 0 && is_bars {
                Rectangle::new([(left, middle - half), (left + end, middle + half)], fill).into_dyn()
            } else if at == 0 {
                PathElement::new(path, style).into_dyn()
            } else {
                DashedPathElement::new(path, dash, gap, style).into_dyn()
            }
        });
    }
    chart
        .configure_series_labels()
        .position(corner)
        .margin(16 * zoom)
        .legend_area_size(64 * zoom)
        .label_font(font(22))
        .background_style(colours.ground.mix(0.9))
        .border_style(line(&colours.grid, zoom))
        .draw()
        .map_err(|error| wrong(&error))?;
    root.present().map_err(|error| wrong(&error))
}

/// The corner in which the fewest points are, for the legend.
fn emptiest(curves: &[Curve], x: &Scale, y: &Scale) -> SeriesLabelPosition {
    let count = |right: bool, upper: bool| {
        let near = |place: f64, high: bool| if high { place > 0.6 } else { place < 0.4 };
        let inside = |[px, py]: &&[f64; 2]| near(x.place(*px), right) && near(y.place(*py), upper);
        curves.iter().map(|curve| curve.points.iter().filter(inside).count()).sum::<usize>()
    };
    let corners = [
        (SeriesLabelPosition::UpperRight, count(true, true)),
        (SeriesLabelPosition::UpperLeft, count(false, true)),
        (SeriesLabelPosition::LowerRight, count(true, false)),
        (SeriesLabelPosition::LowerLeft, count(false, false)),
    ];
    corners.into_iter().min_by_key(|(_, count)| *count).map_or(SeriesLabelPosition::UpperRight, |(corner, _)| corner)
}
