//! Pictures to look at: linear RGB, three planes.

use clap::ValueEnum;
use orograph_graph::Field;
use orograph_nodes::{math::f32 as math, render::hillshade};
use rayon::prelude::*;

/// How land is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum View {
    /// Tints of elevation under the light of the north-west
    Map,
    /// The light alone, in grey
    Hillshade,
}

/// A picture of heights, with tints over their range and gentle land exaggerated until it shows.
#[must_use]
pub fn of_height(height: &Field, view: View) -> Field {
    let [shade, colour] = hillshade::relief(height, &hillshade::Params::fitted(height));
    match view {
        View::Map => colour,
        View::Hillshade => grey(&shade, |light| light),
    }
}

/// A picture of one plane of numbers: black at the lowest, white at the highest.
#[must_use]
pub fn of_numbers(field: &Field) -> Field {
    let (lo, hi) = field.range(0).unwrap_or((0.0, 1.0));
    let span = if hi > lo { hi - lo } else { 1.0 };
    grey(field, |v| (v - lo) / span)
}

/// Grey whose steps look equal: `level` says how far a value is on the way from black to white as the eye has it, and
/// the transfer curve of sRGB (IEC 61966-2-1) makes light of that.
fn grey(field: &Field, level: impl Fn(f32) -> f32 + Sync) -> Field {
    let light = |v: f32| if v <= 0.04045 { v / 12.92 } else { math::pow((v + 0.055) / 1.055, 2.4) };
    let plane: Vec<f32> = field.plane(0).par_iter().map(|v| light(level(*v).clamp(0.0, 1.0))).collect();
    Field::with_planes(*field.window(), 3, plane.repeat(3))
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Window, World};

    use super::*;

    #[test]
    fn pictures_have_three_planes_between_black_and_white() {
        let world = World { size: [80.0, 60.0], cells: [8, 6], ..World::default() };
        let height = Field::new(Window::whole(world), (0..48).map(|v| v as f32 * 3.0 - 20.0).collect());
        for picture in [of_height(&height, View::Map), of_height(&height, View::Hillshade), of_numbers(&height)] {
            assert_eq!(picture.planes(), 3);
            assert!(picture.samples().iter().all(|v| (0.0..=1.0).contains(v)));
        }
        assert_eq!(of_numbers(&height).range(1), Some((0.0, 1.0)));
        let level = Field::constant(Window::whole(world), 5.0);
        assert_eq!(of_numbers(&level).range(0), Some((0.0, 0.0)));
    }
}
