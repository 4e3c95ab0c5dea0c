//! Runs what a kernel records on a device.
//!
//! Passes are gathered and submitted when they would keep the device busy for about 40 ms. How long they take follows
//! from measurements: the time per cell of each entry point, taken from the submits before. A pass over cells or an array
//! is divided into dispatches of whole rows, so that none takes longer; where a raster is larger than a binding, a
//! dispatch over cells binds only its rows and those that its cells read.

use std::{
    collections::{BTreeMap, HashMap},
    sync::Arc,
    time::{Duration, Instant},
};

use orograph_graph::{
    Field, InputValue, Job, NodeError, Outputs, Value,
    gpu::{Bind, FIRST_SLOT, Over, Pass, Recorder, Role, Rows, ScratchId, Size, Slot, WORKGROUP},
};

use super::{
    Entry, Gpu,
    clock::Clock,
    device::{Pipeline, Trouble},
    lock,
    memory::{ANSWER, Block, Resident},
};

/// How long a submit should keep the device busy.
const BUSY: Duration = Duration::from_millis(40);
/// Cells of the first dispatch of an entry point, whose speed is not known.
const FIRST_CELLS: f64 = 262_144.0;
/// Rows in a binding begin at multiples of this many rows, so that offsets are aligned whatever the length of a row.
const ALIGNED_ROWS: u32 = 64;
/// Bind groups that are kept for the next passes with the same numbers.
const MOST_GROUPS_KEPT: usize = 1024;
/// Dispatches along an axis.
const MOST_GROUPS: u32 = 65_535;

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

/// An input on the device.
enum Input {
    Raster(Resident),
    /// A buffer of one number.
    Number(Block),
}

/// A recorded command.
enum Command {
    Dispatch { pipeline: Arc<Pipeline>, group: wgpu::BindGroup, groups: [u32; 3] },
    Clear(wgpu::Buffer),
}

/// What distinguishes a bind group: shader, parameters, and the buffers with their offsets.
type GroupKey = (&'static str, Vec<u8>, Vec<(wgpu::Buffer, u64, u64)>);

/// Buffers that a process keeps from call to call.
pub(super) type Kept = Vec<(Size, Block)>;

/// A run of a kernel.
pub(super) struct Run<'a> {
    gpu: &'a Gpu,
    job: &'a Job<'a>,
    inputs: Vec<Input>,
    /// The planes of each wanted output.
    outputs: Vec<Vec<Block>>,
    scratch: Kept,
    /// Raised by a sample that is not finite.
    fault: Block,
    /// Bound where an entry point uses nothing: to read, to write.
    unused: [Block; 2],
    pending: Vec<Command>,
    /// Nanoseconds that the pending commands are expected to take, per entry point.
    expected: BTreeMap<Entry, f64>,
    groups: HashMap<GroupKey, wgpu::BindGroup>,
    /// Outputs that are no rasters.
    given: Vec<(&'static str, Value)>,
    trouble: Option<Trouble>,
}

impl<'a> Run<'a> {
    /// Brings inputs to the device and reserves the outputs.
    pub(super) fn begin(gpu: &'a Gpu, job: &'a Job<'a>) -> Result<Self, Trouble> {
        let memory = &gpu.memory;
        let write = |block: &Block, bytes: &[u8]| {
            memory.device.caught(|| memory.device.queue.write_buffer(&block.buffer, 0, bytes))
        };
        let input = |input: &InputValue| match input {
            InputValue::Value(Value::Field(field)) => Ok(Input::Raster(memory.resident(field)?)),
            InputValue::Value(_) => Err(Trouble::Input),
            InputValue::Constant(_) | InputValue::Absent => {
                let number = if let InputValue::Constant(v) = input { *v as f32 } else { 0.0 };
                let block = memory.block(16)?;
                write(&block, &number.to_le_bytes())?;
                Ok(Input::Number(block))
            }
        };
        let inputs = job.inputs.iter().map(input).collect::<Result<_, Trouble>>()?;
        let bytes = 4 * job.window.len() as u64;
        let mut outputs = Vec::with_capacity(job.node.outputs.len());
        for at in 0..job.node.outputs.len() {
            let planes = if job.wanted.contains(at) { job.planes(at) } else { 0 };
            let blocks: Result<Vec<Block>, Trouble> = (0..planes).map(|_| memory.block(bytes)).collect();
            outputs.push(blocks?);
        }
        if gpu.poison {
            let nan = vec![0xff; bytes as usize];
            outputs.iter().flatten().try_for_each(|block| write(block, &nan))?;
        }
        let fault = memory.block(16)?;
        write(&fault, &[0; 16])?;
        let unused = [memory.block(256)?, memory.block(256)?];
        Ok(Self {
            gpu,
            job,
            inputs,
            outputs,
            scratch: Vec::new(),
            fault,
            unused,
            pending: Vec::new(),
            expected: BTreeMap::new(),
            groups: HashMap::new(),
            given: Vec::new(),
            trouble: None,
        })
    }

    /// The same, with the buffers that calls before have reserved, which [`Self::keep`] takes back.
    pub(super) fn resume(gpu: &'a Gpu, job: &'a Job<'a>, kept: &mut Kept) -> Result<Self, Trouble> {
        let run = Self::begin(gpu, job)?;
        Ok(Self { scratch: std::mem::take(kept), ..run })
    }

    /// Gives the buffers back for the next call, after which nothing can be recorded.
    pub(super) fn keep(&mut self, kept: &mut Kept) {
        *kept = std::mem::take(&mut self.scratch);
    }

    /// Submits the rest, and returns the results, which stay on the device. Results with a sample that is not finite
    /// come to the host, where the evaluator finds it.
    pub(super) fn finish(mut self, recorded: Result<(), NodeError>) -> Result<Outputs, Stop> {
        let fault = self.fault.buffer.clone();
        let read =
            recorded.and_then(|()| self.submit(Some((&fault, 16)))).map(|flag| flag.iter().any(|byte| *byte != 0));
        let device = &self.gpu.memory.device;
        let is_faulty = match (read, self.trouble.take()) {
            (_, Some(trouble)) => return Err(Stop::Trouble(trouble)),
            // a kernel that reads its inputs on the host finds them lost with the device
            (Err(error), None) => return Err(device.check().err().map_or(Stop::Node(error), Stop::Trouble)),
            (Ok(is_faulty), None) => is_faulty,
        };
        let mut outputs = Outputs::default();
        for (output, planes) in self.job.node.outputs.iter().zip(std::mem::take(&mut self.outputs)) {
            if planes.is_empty() {
                continue;
            }
            let field: Field = self.gpu.memory.field(self.job.window, planes);
            if is_faulty {
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

    fn pipeline(&self, pass: &Pass<'_>) -> Result<Arc<Pipeline>, Trouble> {
        let Pass { shader, entry, .. } = *pass;
        let is_wide = matches!(pass.over, Over::Cells(_) | Over::Array(_));
        let key = (self.job.node.id, (shader.name, entry));
        if let Some(known) = lock(&self.gpu.pipelines).get(&key) {
            return known.clone().map_err(Trouble::Shader);
        }
        let made = self.gpu.memory.device.pipeline(self.job.node, shader, entry, is_wide).map(Arc::new);
        let kept = match &made {
            Ok(pipeline) => Ok(Arc::clone(pipeline)),
            Err(Trouble::Shader(why)) => Err(why.clone()),
            Err(_) => return made,
        };
        lock(&self.gpu.pipelines).insert(key, kept);
        made
    }

    /// The buffer of a slot, and whether it has a number for each cell.
    fn buffer(&self, pass: &Pass<'_>, slot: &Slot) -> Option<(&wgpu::Buffer, bool)> {
        let node = self.job.node;
        let input = |name: &str, plane: usize| {
            let at = node.inputs.iter().position(|input| input.name == name)?;
            match &self.inputs[at] {
                Input::Raster(resident) => Some((&resident.planes.get(plane)?.buffer, true)),
                Input::Number(block) => Some((&block.buffer, false)),
            }
        };
        let output = |name: &str, plane: usize| {
            let planes = &self.outputs[node.output_index(name)?];
            Some((&planes.get(plane)?.buffer, true))
        };
        match (pass.bound(slot), slot.role) {
            (Some(Bind::Input(name, plane)), _) => input(name, plane),
            (Some(Bind::Output(name, plane)), _) => output(name, plane),
            (Some(Bind::Scratch(id)), _) => {
                self.scratch.get(id.0).map(|(size, block)| (&block.buffer, *size == Size::Cells))
            }
            (None, Role::Input(plane)) => input(slot.name, plane),
            (None, Role::Output(plane)) => output(slot.name, plane),
            (None, Role::Cells | Role::Words) => None,
        }
    }

    /// The bind group of a pass whose buffers of cells are bound from row `first` on, for `rows` rows.
    fn group(
        &mut self,
        pass: &Pass<'_>,
        pipeline: &Pipeline,
        [first, row]: [u32; 2],
        rows: u32,
    ) -> Result<wgpu::BindGroup, Trouble> {
        let params = pass.shader.params(self.job, pass.values, [first, row]);
        let line = 4 * u64::from(self.job.window.cells[0]);
        let bound: Vec<(wgpu::Buffer, u64, u64)> = pass
            .shader
            .slots
            .iter()
            .map(|slot| match self.buffer(pass, slot) {
                Some((buffer, true)) => (buffer.clone(), u64::from(first) * line, u64::from(rows) * line),
                Some((buffer, false)) => (buffer.clone(), 0, buffer.size()),
                None => {
                    let unused = &self.unused[usize::from(slot.access != orograph_graph::gpu::Access::Read)].buffer;
                    (unused.clone(), 0, unused.size())
                }
            })
            .collect();
        let key = (pass.shader.name, params, bound);
        if let Some(group) = self.groups.get(&key) {
            return Ok(group.clone());
        }
        let device = &self.gpu.memory.device;
        let (_, params, bound) = &key;
        let group = device.caught(|| {
            let uniform = device.device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: params.len() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            device.queue.write_buffer(&uniform, 0, params);
            let part = |buffer, offset, size| {
                wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                    buffer,
                    offset,
                    size: std::num::NonZero::new(size),
                })
            };
            let mut entries = vec![
                wgpu::BindGroupEntry { binding: 0, resource: part(&uniform, 0, 0) },
                wgpu::BindGroupEntry { binding: 1, resource: part(&self.fault.buffer, 0, 16) },
            ];
            entries.extend((FIRST_SLOT..).zip(bound).map(|(binding, (buffer, offset, size))| wgpu::BindGroupEntry {
                binding,
                resource: part(buffer, *offset, *size),
            }));
            device.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(pass.shader.name),
                layout: &pipeline.layout,
                entries: &entries,
            })
        })?;
        self.groups.insert(key, group.clone());
        Ok(group)
    }

    /// Rows of a dispatch that fit a binding with the rows that their cells read.
    fn rows_of_binding(&self, rows: Rows) -> Result<u32, Trouble> {
        let limit = self.gpu.memory.device.limits.max_storage_buffer_binding_size;
        let [nx, ny] = self.job.window.cells;
        let line = 4 * u64::from(nx);
        let fitting = u32::try_from(limit / line).unwrap_or(u32::MAX);
        if fitting >= ny {
            return Ok(ny);
        }
        match rows {
            // room for the alignment of the first row as well
            Rows::Around(around) if fitting > 2 * around + 2 * ALIGNED_ROWS => Ok(fitting - 2 * around - ALIGNED_ROWS),
            Rows::Around(_) | Rows::All => Err(Trouble::TooLarge(orograph_graph::bytes(line * u64::from(ny)))),
        }
    }

    /// Adds a pass over an array of invocations, such as one for each cell, as one or more dispatches. A workgroup has a tile
    /// of so many columns and rows of it. `fitting` rows of the raster fit a binding with those around them.
    fn divided(
        &mut self,
        pass: &Pass<'_>,
        pipeline: &Arc<Pipeline>,
        [nx, ny]: [u32; 2],
        [wide, high]: [u32; 2],
        (rows, fitting): (Rows, u32),
    ) -> Result<(), NodeError> {
        let name = (pass.shader.name, pass.entry);
        let (all, tiles) = (self.job.window.cells[1], ny.div_ceil(high));
        let of_row = f64::from(nx) * f64::from(high);
        let mut row = 0;
        while row < tiles {
            let known = lock(&self.gpu.rates).get(&name).copied();
            let busy = BUSY.as_nanos() as f64;
            let (most, rate) = known.map_or((FIRST_CELLS, busy / FIRST_CELLS), |rate| (busy / rate, rate));
            let count = ((most / of_row) as u32).clamp(1, MOST_GROUPS).min(tiles - row);
            let (count, first, end) = match rows {
                Rows::Around(around) if fitting < all => {
                    let count = count.min((fitting / high).max(1));
                    let first = (row * high).saturating_sub(around) / ALIGNED_ROWS * ALIGNED_ROWS;
                    (count, first, ((row + count) * high).saturating_add(around).min(all))
                }
                Rows::Around(_) | Rows::All => (count, 0, all),
            };
            let group =
                self.group(pass, pipeline, [first, row], end - first).map_err(|trouble| self.failed(trouble))?;
            let (pipeline, groups) = (Arc::clone(pipeline), [nx.div_ceil(wide), count, 1]);
            let takes = rate * of_row * f64::from(count);
            self.add(Command::Dispatch { pipeline, group, groups }, name, takes, known.is_none())?;
            row += count;
        }
        Ok(())
    }

    /// Adds a command that is expected to take so many nanoseconds, and submits if the device has enough to do. A
    /// command of unknown speed is submitted alone.
    fn add(&mut self, command: Command, name: Entry, takes: f64, alone: bool) -> Result<(), NodeError> {
        let expected: f64 = self.expected.values().sum();
        if alone || expected + takes > 1.25 * BUSY.as_nanos() as f64 {
            self.flush()?;
        }
        self.pending.push(command);
        *self.expected.entry(name).or_default() += takes;
        if alone { self.flush() } else { Ok(()) }
    }

    /// Replaces the contents of a buffer that no pending pass reads or writes.
    fn upload(&mut self, scratch: ScratchId, words: &[u32]) -> Result<(), NodeError> {
        let (device, buffer) = (&self.gpu.memory.device, &self.scratch[scratch.0].1.buffer);
        let written = device.caught(|| device.queue.write_buffer(buffer, 0, bytemuck::cast_slice(words)));
        written.map_err(|trouble| self.failed(trouble))
    }

    /// Submits what is pending, and waits for it.
    fn flush(&mut self) -> Result<(), NodeError> {
        if self.pending.is_empty() { self.job.check() } else { self.submit(None).map(|_| ()) }
    }

    /// Submits what is pending, waits for it, and notes how long it took. Returns the first bytes of a buffer after
    /// that, which cost no second wait.
    fn submit(&mut self, answer: Option<(&wgpu::Buffer, u64)>) -> Result<Vec<u8>, NodeError> {
        self.job.check()?;
        let (memory, pending) = (&self.gpu.memory, std::mem::take(&mut self.pending));
        let device = &memory.device;
        let clock = self.gpu.clock.as_ref();
        let start = now();
        let submitted = device.caught(|| {
            let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            if let Some(clock) = clock {
                clock.begin(&mut encoder);
            }
            let mut commands = pending.iter().peekable();
            while let Some(command) = commands.peek() {
                if let Command::Clear(buffer) = command {
                    encoder.clear_buffer(buffer, 0, None);
                    commands.next();
                    continue;
                }
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                while let Some(Command::Dispatch { pipeline, group, groups: [x, y, z] }) = commands.peek() {
                    pass.set_pipeline(&pipeline.compute);
                    pass.set_bind_group(0, group, &[]);
                    pass.dispatch_workgroups(*x, *y, *z);
                    commands.next();
                }
            }
            if let Some(clock) = clock {
                clock.end(&mut encoder);
            }
            let host = answer.map(|(buffer, bytes)| {
                let host = memory.answer();
                encoder.copy_buffer_to_buffer(buffer, 0, &host, 0, bytes);
                (host, bytes)
            });
            device.queue.submit([encoder.finish()]);
            if let Some(clock) = clock {
                clock.ask();
            }
            host.inspect(|(host, bytes)| host.map_async(wgpu::MapMode::Read, 0..*bytes, |_| ()))
        });
        let taken = submitted.and_then(|host| {
            device.wait()?;
            clock.map_or(Ok(()), Clock::add)?;
            host.map_or_else(|| Ok(Vec::new()), |(host, bytes)| memory.take_answer(host, bytes))
        });
        let taken = taken.map_err(|trouble| self.failed(trouble))?;
        let took = start.elapsed().as_nanos() as f64;
        let expected: f64 = self.expected.values().sum();
        let mut rates = lock(&self.gpu.rates);
        for (name, part) in std::mem::take(&mut self.expected) {
            // with what an unknown one was expected to take per cell
            let rate = rates.get(&name).copied().unwrap_or(BUSY.as_nanos() as f64 / FIRST_CELLS);
            if part > 0.0 {
                // the first measurement of a kernel includes its translation by the driver
                rates.insert(name, (rate * (took / expected).clamp(0.05, 2.0)).max(1e-3));
            }
        }
        drop(rates);
        if self.groups.len() > MOST_GROUPS_KEPT {
            self.groups.clear();
        }
        self.job.check().map(|()| taken)
    }
}

impl Recorder for Run<'_> {
    fn scratch(&mut self, size: Size) -> Result<ScratchId, NodeError> {
        let bytes = match size {
            Size::Cells => 4 * self.job.window.len() as u64,
            Size::Words(words) => 4 * words.max(1) as u64,
        };
        // words are bound as a whole
        if matches!(size, Size::Words(_)) && bytes > self.gpu.memory.device.limits.max_storage_buffer_binding_size {
            return Err(self.failed(Trouble::TooLarge(orograph_graph::bytes(bytes))));
        }
        let block = self.gpu.memory.block(bytes).map_err(|trouble| self.failed(trouble))?;
        if self.gpu.poison {
            let (device, nan) = (&self.gpu.memory.device, vec![0xff; block.buffer.size() as usize]);
            let written = device.caught(|| device.queue.write_buffer(&block.buffer, 0, &nan));
            written.map_err(|trouble| self.failed(trouble))?;
        }
        self.scratch.push((size, block));
        Ok(ScratchId(self.scratch.len() - 1))
    }

    fn table(&mut self, words: &[u32]) -> Result<ScratchId, NodeError> {
        let id = self.scratch(Size::Words(words.len()))?;
        // no pass so far has it
        self.upload(id, words).map(|()| id)
    }

    fn write(&mut self, scratch: ScratchId, words: &[u32]) -> Result<(), NodeError> {
        // what is written arrives before the next submit
        self.flush()?;
        self.upload(scratch, words)
    }

    fn clear(&mut self, scratch: ScratchId) -> Result<(), NodeError> {
        let buffer = self.scratch[scratch.0].1.buffer.clone();
        self.add(Command::Clear(buffer), ("", "clear"), 0.0, false)
    }

    fn pass(&mut self, pass: &Pass<'_>) -> Result<(), NodeError> {
        self.job.check()?;
        let pipeline = self.pipeline(pass).map_err(|trouble| self.failed(trouble))?;
        match pass.over {
            Over::Cells(rows) => {
                let fitting = self.rows_of_binding(rows).map_err(|trouble| self.failed(trouble))?;
                self.divided(pass, &pipeline, self.job.window.cells, [pipeline.workgroup, 1], (rows, fitting))
            }
            Over::Array(places) => {
                let fitting = self.rows_of_binding(Rows::All).map_err(|trouble| self.failed(trouble))?;
                self.divided(pass, &pipeline, places, [pipeline.workgroup, 1], (Rows::All, fitting))
            }
            Over::Tiles(tile, rows) => {
                let fitting = self.rows_of_binding(rows).map_err(|trouble| self.failed(trouble))?;
                self.divided(pass, &pipeline, self.job.window.cells, tile, (rows, fitting))
            }
            Over::Groups(groups) => {
                let ny = self.job.window.cells[1];
                let whole = self.rows_of_binding(Rows::All);
                let group = whole.and_then(|_| self.group(pass, &pipeline, [0, 0], ny));
                let group = group.map_err(|trouble| self.failed(trouble))?;
                let name = (pass.shader.name, pass.entry);
                let cells = groups.iter().map(|count| f64::from(*count)).product::<f64>() * f64::from(WORKGROUP);
                let known = lock(&self.gpu.rates).get(&name).copied();
                let takes = known.unwrap_or(BUSY.as_nanos() as f64 / FIRST_CELLS) * cells;
                self.add(Command::Dispatch { pipeline, group, groups }, name, takes, known.is_none())
            }
        }
    }

    fn read(&mut self, scratch: ScratchId, words: usize) -> Result<Vec<u32>, NodeError> {
        let (buffer, bytes) = (self.scratch[scratch.0].1.buffer.clone(), 4 * words as u64);
        let mut read = Vec::with_capacity(words);
        let mut take = |bytes: &[u8]| {
            read.extend(bytes.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)));
        };
        if bytes <= ANSWER {
            take(&self.submit(Some((&buffer, bytes)))?);
        } else {
            self.flush()?;
            self.gpu.memory.read(&buffer, bytes, take).map_err(|trouble| self.failed(trouble))?;
        }
        Ok(read)
    }

    fn give(&mut self, output: &'static str, value: Value) {
        self.given.push((output, value));
    }
}

/// The current time, for the length of submits only; no result depends on it.
#[expect(clippy::disallowed_methods, reason = "durations divide work into submits, and never enter a result")]
pub(super) fn now() -> Instant {
    Instant::now()
}
