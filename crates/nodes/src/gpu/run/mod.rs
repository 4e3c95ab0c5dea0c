//! Runs what a kernel records on a device.
//!
//! Passes are submitted a few at a time, so that the device works while the host records the next ones. The host waits
//! for a number that it reads, at the end, and when the device has work for about 40 ms, after which a run can be
//! cancelled. How long passes take follows from measurements: the time per cell of each entry point, taken between the
//! waits before. A pass over cells or an array is divided into dispatches of whole rows, so that none takes longer; where
//! a raster is larger than a binding, a dispatch over cells binds only its rows and those that its cells read.

mod passes;
mod submit;

use std::{
    collections::{BTreeMap, HashMap},
    sync::Arc,
    time::Instant,
};

use orograph_graph::{
    Field, InputValue, Job, NodeError, Outputs, Value,
    gpu::{JobNumbers, Size},
};
pub(super) use submit::UNIFORM_BYTES;

use super::{
    Entry, Gpu,
    device::{Pipeline, Trouble},
    memory::{Block, Resident},
};

/// Why a run ends without results.
pub(super) enum Stop {
    /// The kernel failed or was cancelled.
    Node(NodeError),
    /// The device failed.
    Trouble(Trouble),
}

impl Stop {
    /// The trouble of a run that nothing cancels and whose kernel does not fail.
    pub(super) fn into_trouble(self) -> Trouble {
        match self {
            Self::Node(error) => Trouble::Lost(error.to_string()),
            Self::Trouble(trouble) => trouble,
        }
    }
}

impl From<Trouble> for Stop {
    fn from(trouble: Trouble) -> Self {
        Self::Trouble(trouble)
    }
}

/// The rows of a dispatch.
struct Band {
    /// The first row of the buffers of cells that is bound, and how many are.
    first: u32,
    rows: u32,
    /// The first row that it computes.
    row: u32,
}

/// A recorded command.
enum Command {
    Dispatch {
        pipeline: Arc<Pipeline>,
        group: wgpu::BindGroup,
        /// Where its parameter struct is in the buffer of those.
        params: u32,
        groups: [u32; 3],
    },
    Clear(wgpu::Buffer),
}

/// What distinguishes a bind group: the shader, and the buffers with their offsets.
type GroupKey = (&'static str, Vec<(wgpu::Buffer, u64, u64)>);

/// What a process keeps from call to call.
#[derive(Default)]
pub(super) struct Kept {
    scratch: Vec<(Size, Block)>,
    small: Option<Small>,
    groups: HashMap<GroupKey, wgpu::BindGroup>,
}

/// The small buffers of a run.
struct Small {
    /// The number of each input that is no raster.
    numbers: Vec<Option<(f32, Block)>>,
    /// Raised by a sample that is not finite.
    fault: Block,
    /// Bound where an entry point uses nothing: to read, to write.
    unused: [Block; 2],
}

/// A run of a kernel.
pub(super) struct Run<'a> {
    gpu: &'a Gpu,
    job: &'a Job<'a>,
    numbers: JobNumbers,
    /// The inputs that are rasters.
    rasters: Vec<Option<Resident>>,
    /// The planes of each wanted output.
    outputs: Vec<Vec<Block>>,
    scratch: Vec<(Size, Block)>,
    small: Small,
    pending: Vec<Command>,
    /// Parameter structs of the pending commands.
    params: Vec<u32>,
    /// When the first submit since the last wait was made, and how many there were.
    sent: Option<(Instant, u32)>,
    /// Nanoseconds that the commands since the last wait are expected to take, per entry point.
    expected: BTreeMap<Entry, f64>,
    groups: HashMap<GroupKey, wgpu::BindGroup>,
    /// Outputs that no shader writes.
    given: Vec<(&'static str, Value)>,
    /// Whether the flag was raised before the last wait.
    is_faulty: bool,
    trouble: Option<Trouble>,
}

impl<'a> Run<'a> {
    /// Brings inputs to the device and reserves the outputs.
    pub(super) fn begin(gpu: &'a Gpu, job: &'a Job<'a>) -> Result<Self, Trouble> {
        Self::resume(gpu, job, &mut Kept::default())
    }

    /// The same, with what calls before have made, which [`Self::leave`] gives back.
    pub(super) fn resume(gpu: &'a Gpu, job: &'a Job<'a>, kept: &mut Kept) -> Result<Self, Trouble> {
        let memory = &gpu.memory;
        let write = |block: &Block, bytes: &[u8]| {
            memory.device.caught(|| memory.device.queue.write_buffer(&block.buffer, 0, bytes))
        };
        let Kept { scratch, small, groups } = std::mem::take(kept);
        let mut small = match small {
            Some(small) => small,
            None => {
                let fault = memory.block(16)?;
                write(&fault, &[0; 16])?;
                let numbers = job.inputs.iter().map(|_| None).collect();
                Small { numbers, fault, unused: [memory.block(256)?, memory.block(256)?] }
            }
        };
        let is_on_host = job.node.has_ports_on_host();
        let mut rasters = Vec::with_capacity(job.inputs.len());
        for (input, known) in job.inputs.iter().zip(&mut small.numbers) {
            let number = match input {
                _ if is_on_host => {
                    rasters.push(None);
                    continue;
                }
                InputValue::Value(Value::Field(field)) => {
                    rasters.push(Some(memory.resident(field)?));
                    continue;
                }
                InputValue::Value(_) => return Err(Trouble::Input),
                InputValue::Constant(v) => *v as f32,
                InputValue::Absent => 0.0,
            };
            rasters.push(None);
            if known.as_ref().is_none_or(|(known, _)| known.to_bits() != number.to_bits()) {
                let block = memory.block(16)?;
                write(&block, &number.to_le_bytes())?;
                *known = Some((number, block));
            }
        }
        let bytes = 4 * job.window.len() as u64;
        let mut outputs = Vec::with_capacity(job.node.outputs.len());
        for at in 0..job.node.outputs.len() {
            let planes = if !is_on_host && job.wanted.contains(at) { job.planes(at) } else { 0 };
            let blocks: Result<Vec<Block>, Trouble> = (0..planes).map(|_| memory.block(bytes)).collect();
            outputs.push(blocks?);
        }
        if gpu.poison {
            let nan = vec![0xff; bytes as usize];
            outputs.iter().flatten().try_for_each(|block| write(block, &nan))?;
        }
        Ok(Self {
            gpu,
            job,
            numbers: JobNumbers::of(job),
            rasters,
            outputs,
            scratch,
            small,
            pending: Vec::new(),
            params: Vec::new(),
            sent: None,
            expected: BTreeMap::new(),
            groups,
            given: Vec::new(),
            is_faulty: false,
            trouble: None,
        })
    }

    /// Submits the rest, and returns the results, which stay on the device. Results with a sample that is not finite
    /// come to the host, where the evaluator finds it.
    pub(super) fn finish(mut self, recorded: Result<(), NodeError>) -> Result<Outputs, Stop> {
        self.end(recorded)
    }

    /// The same for a call of a process, which gives back what the next one needs.
    pub(super) fn leave(mut self, recorded: Result<(), NodeError>, kept: &mut Kept) -> Result<Outputs, Stop> {
        let outputs = self.end(recorded);
        let Self { scratch, small, groups, is_faulty, .. } = self;
        *kept = Kept { scratch, small: (!is_faulty).then_some(small), groups };
        outputs
    }

    fn end(&mut self, recorded: Result<(), NodeError>) -> Result<Outputs, Stop> {
        let waited = recorded.and_then(|()| self.flush());
        let device = &self.gpu.memory.device;
        match (waited, self.trouble.take()) {
            (_, Some(trouble)) => return Err(Stop::Trouble(trouble)),
            // a kernel that reads its inputs on the host finds them lost with the device
            (Err(error), None) => return Err(device.check().err().map_or(Stop::Node(error), Stop::Trouble)),
            (Ok(()), None) => {}
        }
        let mut outputs = Outputs::default();
        for (output, planes) in self.job.node.outputs.iter().zip(std::mem::take(&mut self.outputs)) {
            if planes.is_empty() {
                continue;
            }
            // groups with the buffers of results, which leave the device on their own
            self.groups.clear();
            let field: Field = self.gpu.memory.field(self.job.window, planes);
            if self.is_faulty {
                field.fetch().map_err(|error| Trouble::Lost(error.0))?;
            }
            outputs = outputs.with(output.name, field);
        }
        for (name, value) in std::mem::take(&mut self.given) {
            outputs = outputs.with(name, value);
        }
        Ok(outputs)
    }

    /// Notes why the device fails, and returns an error that ends the kernel.
    fn failed(&mut self, trouble: Trouble) -> NodeError {
        let error = NodeError::failed(trouble.to_string());
        self.trouble.get_or_insert(trouble);
        error
    }
}

/// The current time, for the length of submits only; no result depends on it.
#[expect(clippy::disallowed_methods, reason = "durations divide work into submits, and never enter a result")]
pub(super) fn now() -> Instant {
    Instant::now()
}
