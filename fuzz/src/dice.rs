//! Random choices that depend only on a number, and damage to bytes.

use std::ops::RangeBounds;

/// A source of random choices.
#[derive(Debug)]
pub struct Dice(fastrand::Rng);

impl Dice {
    /// The choices of a case.
    pub fn new(case: u64) -> Self {
        Self(fastrand::Rng::with_seed(case))
    }

    /// A number in a range.
    pub fn number(&mut self, range: impl RangeBounds<usize>) -> usize {
        self.0.usize(range)
    }

    /// True once in so many times.
    pub fn one_in(&mut self, times: usize) -> bool {
        self.0.usize(..times) == 0
    }

    /// One of several items; there must be one.
    pub fn pick<'a, T>(&mut self, items: &'a [T]) -> &'a T {
        &items[self.0.usize(..items.len())]
    }

    /// A number with many digits, an end of a range, or an ordinary one.
    pub fn float(&mut self) -> f64 {
        match self.0.usize(..4) {
            0 => *self.pick(&[0.0, -0.0, 1.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, 1e-320]),
            1 => f64::from_bits(self.0.u64(..)),
            2 => self.0.i32(-100..100).into(),
            _ => (self.0.f64() - 0.5) * 1e5,
        }
    }

    /// Damages bytes in one to eight places: bits, bytes and numbers of several sizes; parts are removed, repeated,
    /// moved, cut off, or replaced by a piece.
    pub fn damage(&mut self, bytes: &mut Vec<u8>, pieces: &[&[u8]]) {
        for _ in 0..=self.0.usize(..8) {
            self.damage_once(bytes, pieces);
            if self.0.bool() {
                return;
            }
        }
    }

    fn damage_once(&mut self, bytes: &mut Vec<u8>, pieces: &[&[u8]]) {
        if bytes.is_empty() {
            let piece = *self.pick::<&[u8]>(pieces);
            bytes.extend_from_slice(piece);
            return;
        }
        // The first bytes hold most of what is not data.
        let end = if self.0.bool() { bytes.len() } else { bytes.len().min(256) };
        let at = self.0.usize(..end);
        let longest = if self.one_in(4) { bytes.len() } else { 16 };
        let length = self.0.usize(..=longest.min(bytes.len() - at));
        match self.0.usize(..10) {
            0 => bytes[at] ^= 1 << self.0.u8(..8),
            1 => bytes[at] = self.0.u8(..),
            2 => bytes[at] = *self.pick(&[0, 1, 0x7f, 0x80, 0xff, b'0', b'9', b'"', b'(', b')']),
            3 | 4 => self.overwrite(bytes, at),
            5 => drop(bytes.drain(at..at + length)),
            6 => {
                let part = bytes[at..at + length].to_vec();
                let to = self.0.usize(..=bytes.len());
                bytes.splice(to..to, part);
            }
            7 => bytes.truncate(at),
            _ => {
                let piece = self.pick(pieces).to_vec();
                bytes.splice(at..at + length, piece);
            }
        }
    }

    /// Writes a number of two, four or eight bytes, in either order.
    fn overwrite(&mut self, bytes: &mut [u8], at: usize) {
        let size = *self.pick(&[2, 4, 8]);
        let number = match self.0.usize(..3) {
            0 => *self.pick(&[0, 1, u64::MAX, 1 << 31, 1 << 63, 1 << 32, 0x7fff_ffff, 0xffff, 0x8000]),
            1 => self.0.u64(..0x1_0000),
            _ => self.0.u64(..),
        };
        let (little, big) = (number.to_le_bytes(), number.to_be_bytes());
        let digits = if self.0.bool() { &little[..size] } else { &big[8 - size..] };
        bytes[at..].iter_mut().zip(digits).for_each(|(to, from)| *to = *from);
    }

    /// As [`Self::damage`], for text.
    pub fn damaged_text(&mut self, text: &str, pieces: &[&[u8]]) -> String {
        let mut bytes = text.as_bytes().to_vec();
        self.damage(&mut bytes, pieces);
        String::from_utf8(bytes).unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned())
    }
}
