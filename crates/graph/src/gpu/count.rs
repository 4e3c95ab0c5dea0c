//! Counts what a kernel runs, without a device.

use super::{
    record::{Bind, Over, Pass, Recorder, ScratchId, Size},
    shader::{Access, Role, Slot},
};
use crate::{
    job::{InputValue, Job, NodeError},
    value::Value,
};

/// What a kernel has run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Passes: dispatches, if the window fits a binding and the device is not busy for long.
    pub passes: u64,
    /// Bytes per cell that the passes read and write, each raster once in each pass; in other passes each buffer that
    /// is named.
    pub bytes: u64,
    /// The least number of bytes per cell that any kernel must move: each raster that is wired to an input and each wanted
    /// output, once.
    pub least: u64,
    /// Bytes per cell of scratch buffers.
    pub scratch: u64,
    /// How often it waited for something that it read back.
    pub reads: u64,
}

/// A recorder that counts.
pub struct Count<'a> {
    job: &'a Job<'a>,
    work: Work,
    sizes: Vec<Size>,
    /// Bytes that passes read and write which are not over cells, and bytes of buffers of words.
    words: [u64; 2],
    answer: u32,
}

impl<'a> Count<'a> {
    /// A recorder for a job. All words that are read back are `answer`.
    #[must_use]
    pub fn new(job: &'a Job<'a>, answer: u32) -> Self {
        let read = job.inputs.iter().map(|input| match input {
            InputValue::Value(Value::Field(field)) => field.planes(),
            InputValue::Value(_) | InputValue::Constant(_) | InputValue::Absent => 0,
        });
        let written = (0..job.node.outputs.len()).filter(|output| job.wanted.contains(*output));
        let planes = read.sum::<usize>() + written.map(|output| job.planes(output)).sum::<usize>();
        // rasters on the host are not moved
        let planes = if job.node.has_ports_on_host() { 0 } else { planes };
        Self {
            job,
            work: Work { least: 4 * planes as u64, ..Work::default() },
            sizes: Vec::new(),
            words: [0; 2],
            answer,
        }
    }

    /// What was counted.
    #[must_use]
    pub fn work(&self) -> Work {
        let [bytes, scratch] = self.words.map(|bytes| bytes / self.job.window.len() as u64);
        Work { bytes: self.work.bytes + bytes, scratch: self.work.scratch + scratch, ..self.work }
    }

    /// Returns true if a raster is bound to a slot, rather than a number, a table or nothing.
    fn is_raster(&self, pass: &Pass<'_>, slot: &Slot) -> bool {
        let node = self.job.node;
        let is_wired = |name: &str| self.job.input(name).is_some_and(InputValue::is_wired);
        let is_wanted = |name: &str| node.output_index(name).is_some_and(|output| self.job.wanted.contains(output));
        match (pass.bound(slot), slot.role) {
            (Some(Bind::Input(name, _)), _) => is_wired(name),
            (Some(Bind::Output(name, _)), _) => is_wanted(name),
            (Some(Bind::Scratch(id)), _) => self.sizes.get(id.0) == Some(&Size::Cells),
            (None, Role::Input(_)) => is_wired(slot.name),
            (None, Role::Output(_)) => is_wanted(slot.name),
            (None, Role::Cells | Role::Words) => false,
        }
    }
}

impl Recorder for Count<'_> {
    fn scratch(&mut self, size: Size) -> Result<ScratchId, NodeError> {
        self.sizes.push(size);
        match size {
            Size::Cells => self.work.scratch += 4,
            Size::Words(words) => self.words[1] += 4 * words as u64,
        }
        Ok(ScratchId(self.sizes.len() - 1))
    }

    fn table(&mut self, words: &[u32]) -> Result<ScratchId, NodeError> {
        self.scratch(Size::Words(words.len()))
    }

    fn write(&mut self, scratch: ScratchId, _: &[u32]) -> Result<(), NodeError> {
        self.clear(scratch)
    }

    fn clear(&mut self, scratch: ScratchId) -> Result<(), NodeError> {
        match self.sizes.get(scratch.0) {
            Some(Size::Cells) => self.work.bytes += 4,
            Some(Size::Words(words)) => self.words[0] += 4 * *words as u64,
            None => {}
        }
        Ok(())
    }

    fn pass(&mut self, pass: &Pass<'_>) -> Result<(), NodeError> {
        self.work.passes += 1;
        let moved = |slot: &Slot| match slot.access {
            Access::Read | Access::Write => 4,
            Access::Update => 8,
        };
        let slots = pass.shader.slots.iter();
        match pass.over {
            Over::Cells(_) | Over::Tiles(..) => {
                self.work.bytes += slots.filter(|slot| self.is_raster(pass, slot)).map(moved).sum::<u64>()
            }
            Over::Array(_) | Over::Groups(_) => {
                let cells = self.job.window.len() as u64;
                let size = |slot: &Slot| match pass.bound(slot) {
                    Some(Bind::Scratch(id)) => match self.sizes.get(id.0) {
                        Some(Size::Words(words)) => *words as u64,
                        Some(Size::Cells) => cells,
                        None => 0,
                    },
                    Some(Bind::Input(..) | Bind::Output(..)) => cells,
                    None => 0,
                };
                self.words[0] += slots.map(|slot| size(slot) * moved(slot)).sum::<u64>();
            }
        }
        Ok(())
    }

    fn read(&mut self, _: ScratchId, words: usize) -> Result<Vec<u32>, NodeError> {
        self.work.reads += 1;
        Ok(vec![self.answer; words])
    }

    fn give(&mut self, _: &'static str, _: Value) {}
}
