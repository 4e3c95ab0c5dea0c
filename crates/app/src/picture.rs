//! Pictures to look at: linear RGB, three planes.

use clap::ValueEnum;
use orograph_graph::{Field, PortType, Unit, Window, World};
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

/// A picture of a value of that meaning: heights as `view` says, colours as they are, other numbers
/// from black to white; areas and discharges by their logarithms, since rivers have a million times those of slopes.
#[must_use]
pub fn of_field(field: &Field, ty: PortType, view: View) -> Field {
    match ty {
        PortType::Height => of_height(field, view),
        PortType::Colour => field.clone(),
        PortType::Normal => of_normals(field),
        PortType::Weights => of_weights(field),
        PortType::Scalar(Unit::SquareMetres | Unit::CubicMetresPerSecond | Unit::CubicMetresPerYear) => of_sizes(field),
        _ => of_numbers(field),
    }
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

/// The most pixels of a preview along its longer side.
const PREVIEW_SIDE: u32 = 2048;

/// A picture of heights that any viewer opens: the map, of larger cells where there are more than 2048 along a side.
#[must_use]
pub fn preview(height: &Field) -> Field {
    of_height(&shrunk(height, PREVIEW_SIDE), View::Map)
}

/// The means of squares of cells, as large as it takes for no side to have more than `most` of them. Those at the east
/// and south sides may be cut.
pub(crate) fn shrunk(field: &Field, most: u32) -> Field {
    let window = field.window();
    let side = window.cells[0].max(window.cells[1]).div_ceil(most) as usize;
    if side == 1 {
        return field.clone();
    }
    let cells = window.cells.map(|count| count.div_ceil(side as u32));
    let size = cells.map(|count| f64::from(count) * side as f64 * window.cell_m());
    let nx = window.nx();
    let rows = |plane: usize| {
        field.plane(plane).par_chunks(side * nx).flat_map_iter(move |band| {
            let mean = move |first: usize| {
                let columns = first..(first + side).min(nx);
                let (mut sum, mut count) = (0.0, 0.0);
                for row in band.chunks_exact(nx) {
                    sum += row[columns.clone()].iter().map(|v| f64::from(*v)).sum::<f64>();
                    count += columns.len() as f64;
                }
                (sum / count) as f32
            };
            (0..nx).step_by(side).map(mean)
        })
    };
    let samples = (0..field.planes()).into_par_iter().flat_map(rows).collect();
    Field::with_planes(Window::whole(World { size, cells, ..window.world }), field.planes(), samples)
}

/// A picture of one plane of numbers: black at the lowest, white at the highest.
#[must_use]
pub fn of_numbers(field: &Field) -> Field {
    let (lo, hi) = field.range(0).unwrap_or((0.0, 1.0));
    let span = if hi > lo { hi - lo } else { 1.0 };
    grey(field, |v| (v - lo) / span)
}

/// A picture of one plane of positive numbers of very different sizes: black at the least, white at the greatest, their
/// logarithms between.
#[must_use]
pub fn of_sizes(field: &Field) -> Field {
    let (_, hi) = field.range(0).unwrap_or((0.0, 1.0));
    let least = field.plane(0).iter().copied().filter(|v| *v > 0.0).fold(f32::INFINITY, f32::min);
    let decades = if least < hi { math::ln(hi / least) } else { 1.0 };
    grey(field, |v| if v > least { math::ln(v / least) / decades } else { 0.0 })
}

/// Grey whose steps look equal: `level` says how far a value is on the way from black to white as the eye has it, and
/// the transfer curve of sRGB (IEC 61966-2-1) makes light of that.
fn grey(field: &Field, level: impl Fn(f32) -> f32 + Sync) -> Field {
    let plane: Vec<f32> = field.plane(0).par_iter().map(|v| light(level(*v))).collect();
    Field::with_planes(*field.window(), 3, plane.repeat(3))
}

/// The light of a level between black and white.
fn light(level: f32) -> f32 {
    let v = level.clamp(0.0, 1.0);
    if v <= 0.04045 { v / 12.92 } else { math::pow((v + 0.055) / 1.055, 2.4) }
}

/// The linear RGB of a picture that is there as codes of sRGB, four bytes a pixel.
#[must_use]
pub fn of_codes(codes: &[u8], size: [u32; 2]) -> Field {
    let table: Vec<f32> = (0..=255_u8).map(|code| light(f32::from(code) / 255.0)).collect();
    let world = World { size: size.map(f64::from), cells: size, ..World::default() };
    let plane = |plane: usize| codes.chunks_exact(4).map(move |pixel| pixel[plane]);
    let samples = (0..3).flat_map(plane).map(|code| table[usize::from(code)]).collect();
    Field::with_planes(Window::whole(world), 3, samples)
}

/// A picture of unit normals as their textures are usually seen: level ground is light blue.
#[must_use]
pub fn of_normals(field: &Field) -> Field {
    let samples = field.samples().par_iter().map(|v| light(v * 0.5 + 0.5)).collect();
    Field::with_planes(*field.window(), 3, samples)
}

/// A picture of the shares of four layers: red, green and blue light, and white for the fourth.
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
    fn a_preview_has_no_more_cells_than_it_may() {
        let world = World { size: [70.0, 30.0], cells: [7, 3], ..World::default() };
        let height = Field::new(Window::whole(world), (0..21).map(|v| v as f32).collect());
        assert_eq!(shrunk(&height, 7), height);
        let small = shrunk(&height, 4);
        // squares of 2 x 2 cells, those in the east of 1 x 2, in the south of 2 x 1
        assert_eq!(small.samples(), [4.0, 6.0, 8.0, 9.5, 14.5, 16.5, 18.5, 20.0]);
        assert_eq!((small.window().cells, small.window().cell_m()), ([4, 2], 20.0));
    }

    #[test]
    fn pictures_have_three_planes_between_black_and_white() {
        let world = World { size: [80.0, 60.0], cells: [8, 6], ..World::default() };
        let height = Field::new(Window::whole(world), (0..48).map(|v| v as f32 * 3.0 - 20.0).collect());
        for picture in [of_height(&height, View::Map), of_height(&height, View::Hillshade), of_numbers(&height)] {
            assert_eq!(picture.planes(), 3);
            assert!(picture.samples().iter().all(|v| (0.0..=1.0).contains(v)));
        }
        let normals = of_normals(&Field::with_planes(Window::whole(world), 3, [-1.0, 0.0, 1.0].repeat(48)));
        assert_eq!(normals.range(0), Some((0.0, 1.0)));
        let shares = of_weights(&Field::with_planes(Window::whole(world), 4, vec![0.25; 192]));
        assert_eq!((shares.planes(), shares.range(2)), (3, Some((0.5, 0.5))));
        assert_eq!(of_numbers(&height).range(1), Some((0.0, 1.0)));
        let level = Field::constant(Window::whole(world), 5.0);
        assert_eq!(of_numbers(&level).range(0), Some((0.0, 0.0)));
    }
}
