//! The bytes of cells in a file.

use ::png::{BitDepth, ColorType};
use orograph_graph::Field;

use super::{
    Content, Format,
    codes::{Codes, Room},
    srgb::Srgb,
    texture::{control_row, normal_row, weights_row},
};
use crate::numerics::par;

/// Encoding of a cell.
pub(super) enum Cells {
    /// 32-bit floating-point numbers, little-endian.
    Reals {
        plane: usize,
    },
    /// Integer codes.
    Codes {
        plane: usize,
        codes: Codes,
        order: Order,
    },
    /// Red, green and blue with the sRGB curve, in the given number of bytes.
    Light {
        curve: Box<Srgb>,
        bytes: usize,
    },
    Normal,
    Weights,
    Control,
}

/// Width and byte order of a code.
#[derive(Clone, Copy)]
pub(super) enum Order {
    One,
    HighFirst,
    LowFirst,
}

/// Minimum number of bytes per parallel task.
const TURN: usize = 1 << 14;

impl Cells {
    pub(super) fn of(content: Content) -> Self {
        match content {
            Content::Numbers(format, writing) => {
                let plane = writing.plane;
                let Some(full) = format.largest_code() else { return Self::Reals { plane } };
                let order = match format {
                    Format::Png8 => Order::One,
                    Format::R16 => Order::LowFirst,
                    _ => Order::HighFirst,
                };
                let range = writing.range.unwrap_or_default();
                Self::Codes { plane, codes: Codes { range, full, dither: writing.dither }, order }
            }
            Content::Colour => Self::Light { curve: Box::new(Srgb::new()), bytes: 3 },
            Content::Tint => Self::Light { curve: Box::new(Srgb::new()), bytes: 4 },
            Content::Normal => Self::Normal,
            Content::Weights => Self::Weights,
            Content::Control => Self::Control,
        }
    }

    /// Returns the number of bytes of a cell.
    pub(super) const fn step(&self) -> usize {
        match self {
            Self::Codes { order: Order::One, .. } => 1,
            Self::Codes { .. } => 2,
            Self::Light { bytes, .. } => *bytes,
            Self::Reals { .. } | Self::Weights | Self::Control => 4,
            Self::Normal => 6,
        }
    }

    /// Returns the PNG colour type and bit depth. Returns None when PNG has none.
    pub(super) const fn in_png(&self) -> Option<(ColorType, BitDepth)> {
        match self {
            Self::Codes { order: Order::One, .. } => Some((ColorType::Grayscale, BitDepth::Eight)),
            Self::Codes { order: Order::HighFirst, .. } => Some((ColorType::Grayscale, BitDepth::Sixteen)),
            Self::Normal => Some((ColorType::Rgb, BitDepth::Sixteen)),
            Self::Light { bytes: 3, .. } => Some((ColorType::Rgb, BitDepth::Eight)),
            Self::Light { .. } | Self::Weights => Some((ColorType::Rgba, BitDepth::Eight)),
            Self::Reals { .. } | Self::Codes { .. } | Self::Control => None,
        }
    }

    /// Fills rows of a field from row `first` on; `before` makes the bytes that precede each row from its number in the
    /// field.
    pub(super) fn rows<const N: usize>(
        &self,
        field: &Field,
        first: usize,
        out: &mut [u8],
        before: impl Fn(usize) -> [u8; N] + Sync,
    ) {
        let nx = field.window().nx();
        let length = N + self.step() * nx;
        let rows = TURN / length + 1;
        par::all(out.chunks_mut(rows * length), |part, out| {
            let mut room = Room::new(if matches!(self, Self::Codes { .. }) { nx } else { 0 });
            for (j, out) in (first + part * rows..).zip(out.chunks_mut(length)) {
                let (head, out) = out.split_at_mut(N);
                head.copy_from_slice(&before(j));
                self.row(field, j, out, &mut room);
            }
        });
    }

    fn row(&self, field: &Field, j: usize, out: &mut [u8], room: &mut Room) {
        let nx = field.window().nx();
        let of = |plane: usize| &field.plane(plane)[j * nx..(j + 1) * nx];
        match self {
            Self::Reals { plane } => each(out, of(*plane), f32::to_le_bytes),
            Self::Codes { plane, codes, order } => {
                let codes = codes.row(of(*plane), field.window(), j, room);
                match order {
                    Order::One => each(out, codes, |code| [code as u8]),
                    Order::HighFirst => each(out, codes, u16::to_be_bytes),
                    Order::LowFirst => each(out, codes, u16::to_le_bytes),
                }
            }
            Self::Light { curve, bytes: 3 } => curve.row::<3>(field, j, out),
            Self::Light { curve, .. } => {
                out.fill(127);
                curve.row::<4>(field, j, out);
            }
            Self::Normal => normal_row(field, j, out),
            Self::Weights => weights_row(field, j, out),
            Self::Control => control_row(field, j, out),
        }
    }
}

/// Writes the bytes of numbers consecutively.
fn each<T: Copy, const N: usize>(out: &mut [u8], numbers: &[T], bytes: impl Fn(T) -> [u8; N]) {
    for (out, number) in out.as_chunks_mut::<N>().0.iter_mut().zip(numbers) {
        *out = bytes(*number);
    }
}
