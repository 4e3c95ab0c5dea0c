//! What is assumed about a file or done to its cells, for the user to read.

use orograph_graph::memory::{OutOfMemory, collected};

use super::Head;

/// Values that programs write for "no data" and that no ground has; they are voids in files that declare no value.
const CUSTOMARY: [f32; 3] = [-9999.0, -32_767.0, -32_768.0];

/// Returns 1 for every number and 0 for every void.
///
/// # Errors
/// [`OutOfMemory`].
pub fn presence(samples: &[f32]) -> Result<Vec<f32>, OutOfMemory> {
    collected(samples.iter().map(|v| if v.is_nan() { 0.0 } else { 1.0 }))
}

/// The cells of a file without data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Voids {
    /// Their number.
    pub cells: usize,
    /// How many of them have a value that is customary for "no data", but that the file does not declare.
    pub assumed: usize,
}

impl Voids {
    /// Replaces customary values by NaN.
    pub(super) fn assume(&mut self, samples: &mut [f32]) {
        let is_customary = |v: f32| CUSTOMARY.iter().fold(false, |any, customary| any | (v == *customary));
        if !samples.iter().fold(false, |any, v| any | is_customary(*v)) {
            return;
        }
        for v in samples.iter_mut().filter(|v| is_customary(**v)) {
            *v = f32::NAN;
            self.assumed += 1;
        }
    }

    /// Returns what to say about them, each a sentence without a full stop. `done` says what became of them, such as
    /// `are filled`.
    #[must_use]
    pub fn remarks(&self, head: &Head, done: &str) -> Vec<String> {
        let Self { cells, assumed } = *self;
        let total = head.columns * head.rows;
        let assumed = (assumed > 0).then(|| {
            format!(
                "the file does not declare a value for no data; -9999, -32767 and -32768 are taken as such ({assumed} \
                 of {total} cells)"
            )
        });
        let all = (cells > 0).then(|| format!("{cells} of {total} cells of the file have no data and {done}"));
        assumed.into_iter().chain(all).collect()
    }
}
