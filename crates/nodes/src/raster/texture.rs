//! Textures that hold numbers rather than colours: normals and the shares of layers. They carry no curve of sRGB.

use std::path::Path;

use orograph_graph::Field;
use rayon::prelude::*;

use super::{
    GoOn, RasterError, png,
    save::{persist, stage},
};

/// Writes unit normals, -1 to 1 in each of three planes, as 16-bit red, green and blue: -1 is 0, 1 is 65535.
///
/// # Errors
/// As [`super::write_colour`].
///
/// # Panics
/// When the field has fewer than three planes: a caller's mistake, never a file's.
pub fn write_normal(path: &Path, field: &Field, go_on: GoOn<'_>) -> Result<(), RasterError> {
    let [columns, rows] = field.window().cells;
    let planes = [0, 1, 2].map(|plane| field.plane(plane));
    let mut codes = vec![0_u16; 3 * field.window().len()];
    codes.par_chunks_mut(3).enumerate().for_each(|(cell, out)| {
        for (out, plane) in out.iter_mut().zip(planes) {
            *out = ((plane[cell] * 0.5 + 0.5) * 65_535.0).round() as u16;
        }
    });
    persist(stage(path, go_on, |to| png::write_rgb16(to, columns, rows, &codes))?, path)
}

/// Writes the shares of four layers as 8-bit red, green, blue and alpha that sum to 255 in every cell.
///
/// # Errors
/// As [`super::write_colour`].
///
/// # Panics
/// When the field has fewer than four planes: a caller's mistake, never a file's.
pub fn write_weights(path: &Path, field: &Field, go_on: GoOn<'_>) -> Result<(), RasterError> {
    let [columns, rows] = field.window().cells;
    let planes = [0, 1, 2, 3].map(|plane| field.plane(plane));
    let mut bytes = vec![0; 4 * field.window().len()];
    bytes.par_chunks_mut(4).enumerate().for_each(|(cell, out)| {
        out.copy_from_slice(&parts_of_255(planes.map(|plane| plane[cell])));
    });
    persist(stage(path, go_on, |to| png::write_rgba(to, columns, rows, &bytes))?, path)
}

/// Whole parts of 255 nearest to shares: each rounded down, and what is left of 255 given to the largest remainders, among
/// equal ones to the first (A. Hamilton's method of apportionment, 1792). Shares without a sum are the first's alone.
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
    use orograph_graph::{Window, World};

    use super::*;

    fn field(planes: usize, value: impl Fn(usize, usize) -> f32) -> Field {
        let world = World { size: [50.0, 30.0], cells: [5, 3], ..World::default() };
        let window = Window::whole(world);
        let samples = (0..planes).flat_map(|plane| (0..15).map(move |cell| (plane, cell)));
        Field::with_planes(window, planes, samples.map(|(plane, cell)| value(plane, cell)).collect())
    }

    /// The samples of a PNG file.
    fn read(path: &Path) -> (::png::ColorType, Vec<u8>) {
        let mut reader = ::png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
        reader.set_transformations(::png::Transformations::IDENTITY);
        let mut reader = reader.read_info().unwrap();
        assert!(reader.info().srgb.is_none() && reader.info().gama_chunk.is_none());
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut bytes).unwrap();
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
    fn files_hold_the_numbers_without_a_curve() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("weights.png");
        write_weights(&path, &field(4, |plane, cell| if plane == cell % 4 { 1.0 } else { 0.0 }), &|| true).unwrap();
        let (colour, bytes) = read(&path);
        assert_eq!(colour, ::png::ColorType::Rgba);
        assert_eq!(bytes[..8], [255, 0, 0, 0, 0, 255, 0, 0]);
        let path = folder.path().join("normal.png");
        write_normal(&path, &field(3, |plane, _| [-1.0, 0.0, 1.0][plane]), &|| true).unwrap();
        let (colour, bytes) = read(&path);
        assert_eq!(colour, ::png::ColorType::Rgb);
        assert_eq!(bytes[..6], [0, 0, 128, 0, 255, 255]);
    }
}
