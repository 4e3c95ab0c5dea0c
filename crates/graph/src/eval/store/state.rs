//! The encoding of a state on disk: the number of numbers and of rasters, the lengths of the rasters, and the numbers,
//! all little-endian.

use std::io;

use super::entry::{damaged, zeroed};
use crate::state::State;

const WORD: usize = size_of::<u64>();

/// Size of an encoded state.
pub(super) fn encoded_bytes(state: &State) -> u64 {
    ((2 + state.rasters.len()) * WORD + state.bytes()) as u64
}

/// Encodes a state.
///
/// # Errors
/// When there is no memory for it.
pub(super) fn encode(state: &State) -> io::Result<Vec<u8>> {
    let mut bytes: Vec<u8> = zeroed(encoded_bytes(state) as usize)?;
    let lengths = [state.numbers.len(), state.rasters.len()].into_iter().chain(state.rasters.iter().map(Vec::len));
    let words = lengths.map(|length| length as u64).chain(state.numbers.iter().map(|number| number.to_bits()));
    let before = (2 + state.rasters.len() + state.numbers.len()) * WORD;
    let (head, samples) = bytes.split_at_mut(before);
    head.as_chunks_mut().0.iter_mut().zip(words).for_each(|(to, word)| *to = word.to_le_bytes());
    let all = state.rasters.iter().flatten();
    samples.as_chunks_mut().0.iter_mut().zip(all).for_each(|(to, sample)| *to = sample.to_le_bytes());
    Ok(bytes)
}

/// Decodes a state.
///
/// # Errors
/// When the bytes are none, or there is no memory for it.
pub(super) fn decode(bytes: &[u8]) -> io::Result<State> {
    let mut rest = bytes;
    let [numbers, rasters] = [words(&mut rest, 1)?[0], words(&mut rest, 1)?[0]];
    let lengths = words(&mut rest, rasters)?;
    let numbers = words(&mut rest, numbers)?.into_iter().map(f64::from_bits).collect();
    let mut state = State { rasters: Vec::new(), numbers };
    for length in lengths {
        let mut samples: Vec<f32> = zeroed(length.min(rest.len() as u64) as usize)?;
        let part = take(&mut rest, length, size_of::<f32>())?;
        samples.iter_mut().zip(part.as_chunks().0).for_each(|(to, bytes)| *to = f32::from_le_bytes(*bytes));
        state.rasters.push(samples);
    }
    if rest.is_empty() { Ok(state) } else { Err(damaged("has the wrong length")) }
}

fn words(rest: &mut &[u8], count: u64) -> io::Result<Vec<u64>> {
    let part = take(rest, count, WORD)?;
    Ok(part.as_chunks().0.iter().map(|bytes| u64::from_le_bytes(*bytes)).collect())
}

/// The bytes of `count` items of a size.
fn take<'a>(rest: &mut &'a [u8], count: u64, size: usize) -> io::Result<&'a [u8]> {
    let bytes = usize::try_from(count).ok().and_then(|count| count.checked_mul(size));
    let (part, left) =
        bytes.and_then(|bytes| rest.split_at_checked(bytes)).ok_or_else(|| damaged("has the wrong length"))?;
    *rest = left;
    Ok(part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_comes_back_as_it_was() {
        for state in [
            State::default(),
            State { rasters: vec![vec![1.5, -0.0], vec![], vec![f32::MAX]], numbers: vec![0.1, -1e300] },
        ] {
            let bytes = encode(&state).expect("memory");
            assert_eq!(bytes.len() as u64, encoded_bytes(&state));
            assert_eq!(decode(&bytes).expect("a state"), state);
            assert!(decode(&bytes[..bytes.len() - 1]).is_err());
        }
        assert!(decode(&[0xff; 40]).is_err());
    }
}
