//! Octaves as a table for shaders; `shaders/lib/lattice.wgsl` reads it.

use super::{Basis, Octave, basis::Draws, lattice::Axis};

/// Words of an octave in the table.
pub(crate) const WORDS: usize = 12;

/// Returns the table of octaves of a kind of noise, each with its scale.
pub(crate) fn table(octaves: &[Octave], basis: Basis, scale: impl Fn(&Octave) -> f32) -> Vec<u32> {
    let mut words = Vec::with_capacity(octaves.len() * WORDS);
    for octave in octaves {
        octave.axes.iter().for_each(|axis| words.extend(axis_words(axis)));
        let scale = scale(octave);
        let [value_step, value_least] = Draws::new(basis, scale).values();
        words.extend([octave.seed, scale.to_bits(), value_step.to_bits(), value_least.to_bits()]);
    }
    words
}

/// A step fits a word: a wavelength of an octave is at least 2.4 cells.
fn axis_words(axis: &Axis) -> [u32; 4] {
    [axis.base as u32, (axis.base >> 32) as u32, axis.step as u32, axis.period as u32]
}

/// The number of a kind of noise in shaders.
pub(crate) const fn number(basis: Basis) -> u32 {
    match basis {
        Basis::Bell => 0,
        Basis::Classic => 1,
        Basis::Value => 2,
    }
}
