//! Textures for game engines: normals and layer weights, which are numbers without the sRGB curve, and the maps of
//! Terrain3D, a terrain system for Godot.
//!
//! Source of the maps: C. Petkovsek, R. Palmroos and contributors, "Terrain3D", documentation of version 1 ("Control
//! Map Format"; "Import and Export").

use orograph_graph::Field;

use crate::numerics::par;

/// Fills the pixels of row `j` of unit normals: 16-bit red, green and blue, big-endian.
pub(super) fn normal_row(field: &Field, j: usize, out: &mut [u8]) {
    let nx = field.window().nx();
    let planes = [0, 1, 2].map(|plane| &field.plane(plane)[j * nx..(j + 1) * nx]);
    for (cell, out) in out.as_chunks_mut::<6>().0.iter_mut().enumerate() {
        for (out, plane) in out.as_chunks_mut().0.iter_mut().zip(planes) {
            *out = (((plane[cell] * 0.5 + 0.5) * 65_535.0).round() as u16).to_be_bytes();
        }
    }
}

/// Fills the pixels of row `j` of the weights of four layers.
pub(super) fn weights_row(field: &Field, j: usize, out: &mut [u8]) {
    let nx = field.window().nx();
    let planes = [0, 1, 2, 3].map(|plane| &field.plane(plane)[j * nx..(j + 1) * nx]);
    for (cell, out) in out.as_chunks_mut::<4>().0.iter_mut().enumerate() {
        *out = parts_of_255(planes.map(|plane| plane[cell]));
    }
}

/// Fills the cells of row `j` of a control map of Terrain3D, little-endian.
pub(super) fn control_row(field: &Field, j: usize, out: &mut [u8]) {
    let nx = field.window().nx();
    let planes = [0, 1, 2, 3].map(|plane| &field.plane(plane)[j * nx..(j + 1) * nx]);
    for (cell, out) in out.as_chunks_mut::<4>().0.iter_mut().enumerate() {
        *out = control(planes.map(|plane| plane[cell])).to_le_bytes();
    }
}

/// Returns the weights of four layers as 255ths that sum to one in every cell: the values that
/// [`Content::Weights`](super::Content::Weights) writes.
///
/// # Panics
/// If the field has fewer than four planes.
#[must_use]
pub fn apportioned(field: &Field) -> Field {
    let planes = [0, 1, 2, 3].map(|plane| field.plane(plane));
    let len = field.window().len();
    let mut samples = vec![0.0; 4 * len];
    let (first, rest) = samples.split_at_mut(len);
    let (second, rest) = rest.split_at_mut(len);
    let (third, fourth) = rest.split_at_mut(len);
    let nx = field.window().nx();
    let rows = first.chunks_mut(nx).zip(second.chunks_mut(nx)).zip(third.chunks_mut(nx)).zip(fourth.chunks_mut(nx));
    par::all(rows, |j, (((first, second), third), fourth)| {
        for i in 0..nx {
            let parts = parts_of_255(planes.map(|plane| plane[j * nx + i]));
            [first[i], second[i], third[i], fourth[i]] = parts.map(|part| f32::from(part) / 255.0);
        }
    });
    Field::with_planes(*field.window(), 4, samples)
}

/// Returns the bits of a cell of a control map: five for the base texture, five for the overlay texture, eight for the
/// blend. The other bits, for rotation, scale and holes, are 0.
fn control(shares: [f32; 4]) -> u32 {
    let shares = shares.map(|share| if share > 0.0 { f64::from(share) } else { 0.0 });
    let mut order = [0_usize, 1, 2, 3];
    order.sort_by(|a, b| shares[*b].total_cmp(&shares[*a]));
    let (base, over) = (order[0].min(order[1]), order[0].max(order[1]));
    let sum = shares[base] + shares[over];
    let blend = if sum > 0.0 && sum.is_finite() { (shares[over] / sum * 255.0).round() as u32 } else { 0 };
    let (base, over, blend) = if blend == 255 { (over, over, 0) } else { (base, over, blend) };
    (base as u32) << 27 | (over as u32) << 22 | blend << 14
}

/// Returns the weights as integers that sum to 255: each is rounded down, and the remainder of 255 goes to the largest
/// fractional parts, the first of equal ones (A. Hamilton's method of apportionment, 1792). If the weights sum to 0,
/// the first gets 255.
fn parts_of_255(shares: [f32; 4]) -> [u8; 4] {
    let shares = shares.map(|share| if share > 0.0 { f64::from(share) } else { 0.0 });
    let sum: f64 = shares.iter().sum();
    if sum <= 0.0 || !sum.is_finite() {
        return [255, 0, 0, 0];
    }
    let exact = shares.map(|share| share / sum * 255.0);
    let mut parts = exact.map(|part| part as u8);
    let mut order = [0, 1, 2, 3];
    order.sort_by(|a, b| exact[*b].fract().total_cmp(&exact[*a].fract()));
    let given: u32 = parts.iter().map(|part| u32::from(*part)).sum();
    for layer in order.into_iter().take(255_u32.saturating_sub(given) as usize) {
        parts[layer] += 1;
    }
    parts
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use orograph_graph::{Window, World};

    use super::{super::Content, *};

    fn write(path: &Path, content: Content, field: &Field) {
        super::super::whole::whole(path, content, field, None, &|| true).expect("written");
    }

    fn field(planes: usize, value: impl Fn(usize, usize) -> f32) -> Field {
        let world = World { size: [50.0, 30.0], cells: [5, 3], ..World::default() };
        let window = Window::whole(world);
        let samples = (0..planes).flat_map(|plane| (0..15).map(move |cell| (plane, cell)));
        Field::with_planes(window, planes, samples.map(|(plane, cell)| value(plane, cell)).collect())
    }

    /// Returns the colour type and the samples of a PNG file.
    fn read(path: &Path) -> (::png::ColorType, Vec<u8>) {
        let mut reader = ::png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).expect("there")));
        reader.set_transformations(::png::Transformations::IDENTITY);
        let mut reader = reader.read_info().expect("a PNG");
        assert!(reader.info().srgb.is_none() && reader.info().gama_chunk.is_none());
        let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
        reader.next_frame(&mut bytes).expect("pixels");
        (reader.info().color_type, bytes)
    }

    #[test]
    fn parts_sum_to_255_and_are_the_nearest() {
        for step in 0..5000_u32 {
            let draw = |salt: u32| (orograph_graph::mix(step * 4 + salt) % 1000) as f32;
            let raw = [draw(0), draw(1), draw(2) * 0.01, draw(3)];
            let sum: f32 = raw.iter().sum();
            let parts = parts_of_255(raw.map(|v| v / sum.max(1e-9)));
            assert_eq!(parts.iter().map(|part| u32::from(*part)).sum::<u32>(), 255, "{raw:?}");
            for (part, raw) in parts.into_iter().zip(raw) {
                assert!((f32::from(part) - 255.0 * raw / sum.max(1e-9)).abs() < 1.0 + 1e-4, "{raw} {parts:?}");
            }
        }
        assert_eq!(parts_of_255([0.25; 4]), [64, 64, 64, 63]);
        assert_eq!(parts_of_255([1.0 / 3.0, 0.0, 1.0 / 3.0, 1.0 / 3.0]), [85, 0, 85, 85]);
        assert_eq!(parts_of_255([0.0, 0.0, 0.0, 1e-30]), [0, 0, 0, 255]);
        for nothing in [[0.0; 4], [f32::NAN; 4], [-1.0, 0.0, 0.0, 0.0]] {
            assert_eq!(parts_of_255(nothing), [255, 0, 0, 0]);
        }
    }

    #[test]
    fn shares_in_255ths_are_those_of_the_file() {
        let raw = field(4, |plane, cell| ((plane * 7 + cell * 5) % 11) as f32);
        let parts = apportioned(&raw);
        for cell in 0..15 {
            let expected = parts_of_255([0, 1, 2, 3].map(|plane| raw.plane(plane)[cell]));
            let again = [0, 1, 2, 3].map(|plane| parts.plane(plane)[cell]);
            assert_eq!(again.map(|part| (part * 255.0).round() as u8), expected);
            assert_eq!(parts_of_255(again), expected, "and stay so");
        }
    }

    #[test]
    fn control_maps_have_the_two_largest_layers() {
        let parts = |bits: u32| [bits >> 27, bits >> 22 & 31, bits >> 14 & 255];
        assert_eq!(parts(control([1.0, 0.0, 0.0, 0.0])), [0, 1, 0]);
        assert_eq!(parts(control([0.0, 0.0, 1.0, 0.0])), [2, 2, 0], "alone, not as a cover");
        assert_eq!(parts(control([0.1, 0.3, 0.0, 0.6])), [1, 3, 170]);
        assert_eq!(parts(control([0.1, 0.6, 0.0, 0.3])), [1, 3, 85], "the order of layers, not of shares");
        assert_eq!(parts(control([0.5, 0.0, 0.5, 0.0])), [0, 2, 128]);
        for nothing in [[0.0; 4], [f32::NAN; 4]] {
            assert_eq!(parts(control(nothing)), [0, 1, 0]);
        }
    }

    /// A decoder returns exactly the written bits.
    #[test]
    fn control_maps_keep_their_bits() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("layers.control.exr");
        let shares = field(4, |plane, cell| ((plane * 5 + cell * 3) % 7) as f32);
        write(&path, Content::Control, &shares);
        let image = ::exr::prelude::read_first_flat_layer_from_file(&path).expect("a file");
        let channel = &image.layer_data.channel_data.list[0];
        assert!(channel.name.eq_case_insensitive("R"));
        let bits: Vec<u32> = channel.sample_data.values_as_f32().map(f32::to_bits).collect();
        let expected = (0..15).map(|cell| control([0, 1, 2, 3].map(|plane| shares.plane(plane)[cell])));
        assert_eq!(bits, expected.collect::<Vec<_>>());
    }

    #[test]
    fn tints_have_the_curve_and_an_even_roughness() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("colour.png");
        write(&path, Content::Tint, &field(3, |plane, _| [0.0, 0.2140, 1.0][plane]));
        let mut reader = ::png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&path).expect("there")));
        reader.set_transformations(::png::Transformations::IDENTITY);
        let mut reader = reader.read_info().expect("a PNG");
        assert!(reader.info().srgb.is_some());
        let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
        reader.next_frame(&mut bytes).expect("pixels");
        assert_eq!(bytes[..8], [0, 127, 255, 127, 0, 127, 255, 127]);
    }

    #[test]
    fn files_hold_the_numbers_without_a_curve() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("weights.png");
        write(&path, Content::Weights, &field(4, |plane, cell| if plane == cell % 4 { 1.0 } else { 0.0 }));
        let (colour, bytes) = read(&path);
        assert_eq!(colour, ::png::ColorType::Rgba);
        assert_eq!(bytes[..8], [255, 0, 0, 0, 0, 255, 0, 0]);
        let path = folder.path().join("normal.png");
        write(&path, Content::Normal, &field(3, |plane, _| [-1.0, 0.0, 1.0][plane]));
        let (colour, bytes) = read(&path);
        assert_eq!(colour, ::png::ColorType::Rgb);
        assert_eq!(bytes[..6], [0, 0, 128, 0, 255, 255]);
    }
}
