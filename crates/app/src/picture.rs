//! Pictures to look at: linear RGB, three planes.

use clap::ValueEnum;
use orograph_graph::Field;
use orograph_nodes::render::hillshade;

/// How land is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum View {
    /// Tints of elevation under the light of the north-west
    Map,
    /// The light alone, on white paper
    Hillshade,
}

/// A picture of heights, with tints over their range and gentle land exaggerated until it shows.
#[must_use]
pub fn of_height(height: &Field, view: View) -> Field {
    let params = hillshade::Params { tints: view == View::Map, ..hillshade::Params::fitted(height) };
    let [_, colour] = hillshade::relief(height, &params);
    colour
}

/// A picture of one plane of numbers: black at the lowest, white at the highest.
#[must_use]
pub fn of_numbers(field: &Field) -> Field {
    let (lo, hi) = field.range(0).unwrap_or((0.0, 1.0));
    let span = if hi > lo { hi - lo } else { 1.0 };
    let grey: Vec<f32> = field.plane(0).iter().map(|v| ((v - lo) / span).clamp(0.0, 1.0)).collect();
    Field::with_planes(*field.window(), 3, grey.repeat(3))
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
