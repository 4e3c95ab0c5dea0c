//! Transforms of lines of complex numbers on a graphics device, in single precision: what a kernel records for them.
//!
//! Each pass reads one buffer and writes another, with the factors of [`super::Plan`]. Lines that run down the columns
//! of an array need no transposition: adjacent invocations have adjacent columns.

use orograph_graph::{
    NodeError,
    gpu::{Bind, Number, Over, Pass, Recorder, Scalar, ScratchId, Shader, Size, Slot},
};

use super::{Bluestein, Complex, Plan, radices, root};
use crate::wgsl::wgsl;

/// The passes of all transforms.
pub(crate) static SHADER: Shader = Shader {
    name: "lib/fourier",
    source: wgsl!("lib/fourier"),
    library: &[],
    values: &[
        ("k_length", Number::U32),
        ("k_part", Number::U32),
        ("k_lines", Number::U32),
        ("k_pitch", Number::U32),
        ("k_down", Number::U32),
    ],
    slots: &[
        Slot::words("source", "vec2<f32>"),
        Slot::words("factors", "vec2<f32>"),
        Slot::words("result", "vec2<f32>").written(),
    ],
};

/// How lines lie in an array of complex numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lines {
    /// Number of lines.
    pub count: usize,
    /// Places between the beginnings of two rows of the array.
    pub pitch: usize,
    /// True if lines are columns of the array, false if they are rows.
    pub down: bool,
}

/// The tables of transforms of one length.
pub(crate) struct Transform {
    length: usize,
    radices: Vec<usize>,
    /// e^(−2πi k / length).
    roots: ScratchId,
    chirp: Option<Chirp>,
}

/// Bluestein's convolution.
struct Chirp {
    padded: Box<Transform>,
    waves: ScratchId,
    kernel: ScratchId,
}

impl Transform {
    /// Makes the tables for lines of that length, at least 1.
    ///
    /// # Errors
    /// When the device has no memory for them.
    pub fn new(recorder: &mut dyn Recorder, length: usize) -> Result<Self, NodeError> {
        let Some(radices) = radices(length) else {
            let Bluestein { waves, mut mirrored } = Bluestein::new(length);
            let padded = mirrored.len();
            Plan::new(padded).transform(&mut mirrored);
            let chirp = Chirp {
                padded: Box::new(Self::new(recorder, padded)?),
                waves: table(recorder, waves)?,
                kernel: table(recorder, Bluestein::kernel(&mirrored))?,
            };
            return Ok(Self { length, radices: Vec::new(), roots: chirp.waves, chirp: Some(chirp) });
        };
        let roots = table(recorder, (0..length).map(|k| root(k, length)))?;
        Ok(Self { length, radices, roots, chirp: None })
    }

    /// Places that a line needs in both buffers, at least the length.
    pub fn room(&self) -> usize {
        self.chirp.as_ref().map_or(self.length, |chirp| chirp.padded.length)
    }

    /// Replaces the first places of each line of the first buffer by their transform `Xₖ = Σ xⱼ e^(−2πi jk / length)`.
    /// Returns the buffer with the result first, and the other one, whose contents are undefined.
    ///
    /// # Errors
    /// When the run is cancelled, or the device fails.
    pub fn run(
        &self,
        recorder: &mut dyn Recorder,
        mut buffers: [ScratchId; 2],
        lines: Lines,
    ) -> Result<[ScratchId; 2], NodeError> {
        if let Some(chirp) = &self.chirp {
            let room = chirp.padded.length;
            step(recorder, "chirp_begin", &mut buffers, chirp.waves, lines, [room, self.length, room])?;
            buffers = chirp.padded.run(recorder, buffers, lines)?;
            step(recorder, "chirp_turn", &mut buffers, chirp.kernel, lines, [room, self.length, room])?;
            buffers = chirp.padded.run(recorder, buffers, lines)?;
            step(recorder, "chirp_end", &mut buffers, chirp.waves, lines, [room, self.length, self.length])?;
            return Ok(buffers);
        }
        let mut part = 1;
        for &radix in &self.radices {
            let entry = match radix {
                2 => "by_2",
                3 => "by_3",
                4 => "by_4",
                5 => "by_5",
                _ => "by_8",
            };
            step(recorder, entry, &mut buffers, self.roots, lines, [self.length, part, self.length / radix])?;
            part *= radix;
        }
        Ok(buffers)
    }
}

/// Runs a pass with `along` invocations for each line, and exchanges the buffers.
fn step(
    recorder: &mut dyn Recorder,
    entry: &'static str,
    buffers: &mut [ScratchId; 2],
    factors: ScratchId,
    lines: Lines,
    [length, part, along]: [usize; 3],
) -> Result<(), NodeError> {
    let values = [
        ("k_length", length),
        ("k_part", part),
        ("k_lines", lines.count),
        ("k_pitch", lines.pitch),
        ("k_down", usize::from(lines.down)),
    ]
    .map(|(name, value)| (name, Scalar::U32(value as u32)));
    let [source, result] = *buffers;
    let bind =
        [("source", source), ("factors", factors), ("result", result)].map(|(name, id)| (name, Bind::Scratch(id)));
    let over = if lines.down { over(lines.count, along) } else { over(along, lines.count) };
    recorder.pass(&Pass { shader: &SHADER, entry, bind: &bind, values: &values, over })?;
    *buffers = [result, source];
    Ok(())
}

/// The places of an array.
pub(crate) fn over(columns: usize, rows: usize) -> Over {
    Over::Array([columns, rows].map(|count| count as u32))
}

/// Reserves a buffer of that many complex numbers.
///
/// # Errors
/// When the device has no memory for it.
pub(crate) fn complex(recorder: &mut dyn Recorder, count: usize) -> Result<ScratchId, NodeError> {
    recorder.scratch(Size::Words(2 * count))
}

fn table(recorder: &mut dyn Recorder, values: impl IntoIterator<Item = Complex>) -> Result<ScratchId, NodeError> {
    let words: Vec<u32> = values.into_iter().flatten().map(|part| (part as f32).to_bits()).collect();
    recorder.table(&words)
}
