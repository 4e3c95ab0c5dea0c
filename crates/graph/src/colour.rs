//! Colours as written in a file.

use std::{fmt, str::FromStr};

/// A colour in sRGB (IEC 61966-2-1), 8 bits each of red, green and blue; written `#rrggbb`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Srgb(pub [u8; 3]);

impl Srgb {
    /// The colour of a hexadecimal number `0xRRGGBB`.
    #[must_use]
    pub const fn hex(code: u32) -> Self {
        let [_, red, green, blue] = code.to_be_bytes();
        Self([red, green, blue])
    }
}

impl fmt::Display for Srgb {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [red, green, blue] = self.0;
        write!(f, "#{red:02x}{green:02x}{blue:02x}")
    }
}

/// A text that is not a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a colour is `#` and six hexadecimal digits, such as `#7a9e77`")]
pub struct NoColour;

impl FromStr for Srgb {
    type Err = NoColour;

    fn from_str(text: &str) -> Result<Self, NoColour> {
        let digits = text.strip_prefix('#').ok_or(NoColour)?;
        if digits.len() != 6 || !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
            return Err(NoColour);
        }
        u32::from_str_radix(digits, 16).map(Self::hex).map_err(|_| NoColour)
    }
}

/// A colour at a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// The value.
    pub at: f64,
    /// Its colour.
    pub colour: Srgb,
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "({}, \"{}\")", crate::plain(self.at), self.colour)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_read_as_they_are_written() {
        for code in [0, 0x7a_9e_77, 0x01_02_03, 0xff_ff_ff] {
            let colour = Srgb::hex(code);
            assert_eq!(colour.to_string().parse(), Ok(colour));
        }
        assert_eq!("#FFa001".parse(), Ok(Srgb([255, 160, 1])));
        for text in ["", "#", "7a9e77", "#7a9e7", "#7a9e777", "#+a9e77", "#7a9é7", "red"] {
            assert_eq!(text.parse::<Srgb>(), Err(NoColour), "{text}");
        }
    }
}
