//! Plots of the curves in a report, as PNG and SVG, with those of references.

mod draw;
mod scale;

use std::path::{Path, PathBuf};

use orograph_graph::{Axis, Series};
use orograph_nodes::raster;

pub use scale::{round_values, tick};

use crate::report::failure::{Failure, reason};

/// Width and height of a plot in pixels.
const SIZE: [u32; 2] = [1200, 800];
/// Samples of a picture for each pixel and side; their mean smooths the lines.
const SAMPLES: u32 = 2;
/// The largest number of points of a curve that are drawn: more than the pixels of the width.
const MOST_POINTS: usize = 4000;

/// The colours of a plot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Theme {
    /// Dark lines on white
    #[default]
    Light,
    /// Light lines on dark grey
    Dark,
}

/// The largest number of curves in a plot.
pub const CURVES: usize = 5;

/// A plot: one curve, or several to compare.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// The name of the series.
    pub name: String,
    x: Label,
    y: Label,
    curves: Vec<Curve>,
}

/// The text of an axis, and whether it is logarithmic.
#[derive(Clone, Debug, PartialEq)]
struct Label {
    text: String,
    log: bool,
}

/// A named curve.
#[derive(Clone, Debug, PartialEq)]
struct Curve {
    label: String,
    /// Of a histogram, its outline.
    points: Vec<[f64; 2]>,
    /// The bars of a histogram: where each begins and ends, and its height. Empty for a curve.
    bars: Vec<[f64; 3]>,
}

impl Plot {
    /// The plots of curves: those of one name share a plot, that of what was measured before those of references.
    /// `label` is the text of the former in the legend. Names without a point are left out.
    #[must_use]
    pub fn of(label: &str, series: &[Series]) -> Vec<Self> {
        let plot = |own: &Series| {
            let others = series.iter().filter(|other| other.name == own.name && other.of.is_some());
            let mut curves: Vec<Curve> =
                std::iter::once(own).chain(others).map(|curve| Curve::of(label, curve)).collect();
            let is_drawn = !curves[0].points.is_empty();
            curves.truncate(CURVES);
            is_drawn.then(|| Self { name: own.name.clone(), x: Label::of(&own.x), y: Label::of(&own.y), curves })
        };
        series.iter().filter(|series| series.of.is_none()).filter_map(plot).collect()
    }

    /// Writes it as `NAME.png` and `NAME.svg` into a folder; earlier files of these names are replaced.
    ///
    /// # Errors
    /// When they cannot be drawn or written.
    pub fn write(&self, folder: &Path, theme: Theme) -> Result<[PathBuf; 2], Failure> {
        let wrong = |error: &str| Failure::unable(format!("`{}` cannot be drawn: {error}", self.name));
        let name = self.name.replace(|c: char| !c.is_alphanumeric() && !matches!(c, '_' | '.' | '-'), "_");
        let paths = ["png", "svg"].map(|ending| folder.join(format!("{name}.{ending}")));
        let svg = draw::svg(self, theme).map_err(|error| wrong(&error))?;
        let pixels = draw::pixels(self, theme).map_err(|error| wrong(&error))?;
        let [png_path, svg_path] = &paths;
        let write = |path: &Path, bytes: &[u8]| {
            let written = raster::replace(path, |file| file.write_all(bytes));
            written.map_err(|error| {
                let remedy = error.remedy();
                Failure::unable(error.to_string()).hint(remedy)
            })
        };
        write(png_path, &encoded(&pixels).map_err(|error| wrong(&error.to_string()))?)?;
        write(svg_path, svg.as_bytes())?;
        Ok(paths)
    }
}

impl Label {
    fn of(axis: &Axis) -> Self {
        Self { text: title(axis), log: axis.log }
    }
}

/// The text of an axis: its label with its unit.
#[must_use]
pub fn title(axis: &Axis) -> String {
    match axis.unit.as_str() {
        "" => axis.label.clone(),
        unit => format!("{} ({unit})", axis.label),
    }
}

impl Curve {
    fn of(label: &str, series: &Series) -> Self {
        let label = series.of.clone().unwrap_or_else(|| label.to_owned());
        if let Some(mut bars) = series.bars() {
            bars.retain(|bar| bar[2].is_finite());
            // empty bars at the end only make the others narrower
            let end = bars.iter().rposition(|bar| bar[2] > 0.0).map_or(0, |last| last + 1);
            bars.truncate(end);
            return Self { label, points: outline(&bars), bars };
        }
        let is_shown = |value: f64, axis: &Axis| value.is_finite() && (!axis.log || value > 0.0);
        let points = series.x.values.iter().zip(&series.y.values).map(|(x, y)| [*x, *y]);
        let points: Vec<_> = points.filter(|[x, y]| is_shown(*x, &series.x) && is_shown(*y, &series.y)).collect();
        let step = points.len().div_ceil(MOST_POINTS).max(1);
        let last = points.last().copied().filter(|_| step > 1);
        Self { label, points: points.into_iter().step_by(step).chain(last).collect(), bars: Vec::new() }
    }
}

/// The line around the bars of a histogram, from the ground at the left to the ground at the right.
fn outline(bars: &[[f64; 3]]) -> Vec<[f64; 2]> {
    let ends = bars.first().zip(bars.last()).map(|(first, last)| [[first[0], 0.0], [last[1], 0.0]]);
    let tops = bars.iter().flat_map(|&[from, to, height]| [[from, height], [to, height]]);
    let Some([left, right]) = ends else { return Vec::new() };
    std::iter::once(left).chain(tops).chain([right]).collect()
}

/// Creates the folder for plots.
///
/// # Errors
/// When it cannot be created.
pub fn folder(path: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(path).map_err(|error| {
        Failure::unable(format!("the folder `{}` cannot be made: {}", path.display(), reason(&error)))
            .hint("choose another folder with `--plots`")
    })
}

fn encoded(pixels: &[u8]) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, SIZE[0], SIZE[1]);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use orograph_nodes::numerics::math;

    use super::*;

    fn curves(shift: f64) -> Vec<Series> {
        let areas: Vec<f64> = (0..40).map(|at| math::pow(10.0, 4.0 + 0.1 * f64::from(at))).collect();
        let slopes = areas.iter().map(|area| (1.0 + shift) * math::pow(*area, -0.45)).collect();
        let heights: Vec<f64> = (0..=100).map(|at| f64::from(at) / 100.0).collect();
        let above = heights.iter().map(|z| math::pow(1.0 - z, 1.0 + shift)).collect();
        vec![
            Series::new(
                "slope_area",
                Axis::logarithmic("drainage area", "m²", areas),
                Axis::logarithmic("slope", "", slopes),
            ),
            Series::new(
                "hypsometric_curve",
                Axis::new("share of the area at or above", "", above),
                Axis::new("relative height", "", heights),
            ),
            Series::new("none", Axis::new("x", "", vec![f64::NAN]), Axis::new("y", "", vec![1.0])),
        ]
    }

    /// Curves of what was measured, and the same as those of a reference.
    fn beside(made: &[Series], real: Vec<Series>) -> Vec<Series> {
        made.iter().cloned().chain(real.into_iter().map(|curve| curve.of("real.tif"))).collect()
    }

    #[test]
    fn plots_have_labels_and_both_curves_and_the_same_bytes_again() {
        let made = curves(0.0);
        let plots = Plot::of("made.exr", &beside(&made, curves(0.6)));
        assert_eq!(
            plots.iter().map(|plot| plot.name.as_str()).collect::<Vec<_>>(),
            ["slope_area", "hypsometric_curve"]
        );
        let place = tempfile::tempdir().expect("a folder");
        let folder = std::env::var_os("OROGRAPH_PICTURES").map_or_else(|| place.path().to_owned(), PathBuf::from);
        for (plot, theme) in plots.iter().zip([Theme::Light, Theme::Dark]) {
            let [png, svg] = plot.write(&folder, theme).expect("written");
            let text = std::fs::read_to_string(&svg).expect("text");
            let said =
                if plot.name == "slope_area" { ["drainage area (m²)", "10⁶"] } else { ["relative height", "0.4"] };
            for part in said.into_iter().chain(["made.exr", "real.tif", "<svg"]) {
                assert!(text.contains(part), "{part} is not in {text}");
            }
            let strokes = theme.curves().map(|colour| text.matches(&*colour).count());
            assert!(strokes[..2].iter().all(|count| *count > 0), "{strokes:?}");
            let picture = image::open(&png).expect("a picture").to_rgb8();
            assert_eq!(picture.dimensions(), (SIZE[0], SIZE[1]));
            let bytes = [&png, &svg].map(|path| std::fs::read(path).expect("bytes"));
            plot.write(&folder, theme).expect("written");
            assert_eq!([&png, &svg].map(|path| std::fs::read(path).expect("bytes")), bytes);
        }
        assert_eq!(Plot::of("made.exr", &made)[0].curves.len(), 1);
        let many = (0..9).fold(made.clone(), |curves, _| beside(&curves, made.clone()));
        assert_eq!(Plot::of("made.exr", &many)[0].curves.len(), CURVES);
    }

    #[test]
    fn a_histogram_is_drawn_as_bars_and_that_of_the_reference_as_an_outline() {
        let histogram = |peak: f64| {
            let share = |at: f64| 0.06 * math::exp(-(at - peak) * (at - peak) / 200.0);
            let slopes: Vec<f64> = (0..90).map(f64::from).collect();
            let shares = slopes.iter().map(|at| if *at < 70.0 { share(*at) } else { 0.0 }).collect();
            let [slopes, shares] = [Axis::new("slope from", "°", slopes), Axis::new("share of the area", "", shares)];
            vec![Series::new("slope_histogram", slopes, shares)]
        };
        let plots = Plot::of("made.exr", &beside(&histogram(30.0), histogram(24.0)));
        let [own, other]: &[Curve; 2] = plots[0].curves.as_slice().try_into().expect("two curves");
        assert_eq!((own.bars.len(), own.bars[69][1], other.points.len()), (70, 70.0, 2 * 70 + 2));
        assert_eq!((own.points[0], own.points[2], own.points[141]), ([0.0; 2], [1.0, own.bars[0][2]], [70.0, 0.0]));
        let place = tempfile::tempdir().expect("a folder");
        let folder = std::env::var_os("OROGRAPH_PICTURES").map_or_else(|| place.path().to_owned(), PathBuf::from);
        for theme in [Theme::Light, Theme::Dark] {
            let [_, svg] = plots[0].write(&folder, theme).expect("written");
            let text = std::fs::read_to_string(&svg).expect("text");
            let bars = text.matches("<rect").count();
            assert!(bars >= 70, "{bars} rectangles");
        }
    }

    #[test]
    fn many_points_are_thinned_and_the_ends_stay() {
        let values: Vec<f64> = (0..100_000).map(f64::from).collect();
        let series = Series::new("n", Axis::new("x", "", values.clone()), Axis::new("y", "", values));
        let points = Curve::of("a", &series).points;
        assert!(points.len() <= MOST_POINTS + 1);
        assert_eq!((points[0], points[points.len() - 1]), ([0.0; 2], [99_999.0; 2]));
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_an_error() {
        let place = tempfile::tempdir().expect("a folder");
        let file = place.path().join("file");
        std::fs::write(&file, "").expect("written");
        let failure = folder(&file.join("plots")).expect_err("a file is in the way");
        assert!(failure.message.contains("cannot be made"), "{failure}");
    }
}
