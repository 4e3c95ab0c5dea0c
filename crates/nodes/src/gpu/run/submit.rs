//! How dispatches are submitted, what the host waits for, and how long they take.

use std::time::Duration;

use orograph_graph::NodeError;

use super::{
    super::{
        clock::{Clock, MOST_SUBMITS},
        device::Trouble,
        lock,
        memory::FLAG,
    },
    Command, Run, now,
};

/// How much work the device should have before the host waits for it.
pub(super) const BUSY: Duration = Duration::from_millis(40);
/// Cells of the first dispatch of an entry point, whose speed is not known.
pub(super) const FIRST_CELLS: f64 = 262_144.0;
/// Commands that are submitted together: a submit costs the host as much as recording a few of them.
const COMMANDS: usize = 16;
/// Bytes of the parameter structs of the commands of a submit; those of a command take less than 1 KiB.
pub(in super::super) const UNIFORM_BYTES: u64 = 1024 * COMMANDS as u64;
/// Bind groups that are kept for the next passes with the same buffers.
const MOST_GROUPS_KEPT: usize = 1024;

impl Run<'_> {
    /// Submits what is pending if that is enough commands.
    pub(super) fn send_enough(&mut self) -> Result<(), NodeError> {
        if self.pending.len() >= COMMANDS { self.send() } else { Ok(()) }
    }

    /// Submits what is pending, without waiting for it.
    pub(super) fn send(&mut self) -> Result<(), NodeError> {
        self.job.check()?;
        if self.sent.is_some_and(|(_, submits)| submits + 1 >= MOST_SUBMITS) {
            return self.wait(None).map(|_| ());
        }
        self.submit(|_| ()).map_err(|trouble| self.failed(trouble))
    }

    /// Submits what is pending, and waits for all that was submitted.
    pub(super) fn flush(&mut self) -> Result<(), NodeError> {
        if self.pending.is_empty() && self.sent.is_none() {
            return self.job.check();
        }
        self.wait(None).map(|_| ())
    }

    /// Submits what is pending, with what `last` adds to it.
    pub(super) fn submit<T>(&mut self, last: impl FnOnce(&mut wgpu::CommandEncoder) -> T) -> Result<T, Trouble> {
        let (gpu, pending, params) = (self.gpu, std::mem::take(&mut self.pending), std::mem::take(&mut self.params));
        let device = &gpu.memory.device;
        self.sent.get_or_insert_with(|| (now(), 0)).1 += 1;
        device.caught(|| {
            if !params.is_empty() {
                device.queue.write_buffer(&gpu.uniforms, 0, bytemuck::cast_slice(&params));
            }
            let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            if let Some(clock) = &gpu.clock {
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
                while let Some(Command::Dispatch { pipeline, group, params, groups: [x, y, z] }) = commands.peek() {
                    pass.set_pipeline(&pipeline.compute);
                    pass.set_bind_group(0, group, &[*params]);
                    pass.dispatch_workgroups(*x, *y, *z);
                    commands.next();
                }
            }
            if let Some(clock) = &gpu.clock {
                clock.end(&mut encoder);
            }
            let added = last(&mut encoder);
            device.queue.submit([encoder.finish()]);
            added
        })
    }

    /// Submits what is pending, waits for all that was submitted, and notes how long it took. Returns the first bytes of
    /// a buffer after that, which cost no second wait.
    pub(super) fn wait(&mut self, answer: Option<(&wgpu::Buffer, u64)>) -> Result<Vec<u8>, NodeError> {
        self.job.check()?;
        let (memory, clock) = (&self.gpu.memory, self.gpu.clock.as_ref());
        let device = &memory.device;
        let fault = self.small.fault.buffer.clone();
        let bytes = FLAG + answer.map_or(0, |(_, bytes)| bytes);
        let submitted = self.submit(|encoder| {
            let host = memory.answer();
            encoder.copy_buffer_to_buffer(&fault, 0, &host, 0, FLAG);
            if let Some((buffer, bytes)) = answer {
                encoder.copy_buffer_to_buffer(buffer, 0, &host, FLAG, bytes);
            }
            if let Some(clock) = clock {
                clock.copy(encoder);
            }
            host
        });
        let taken = submitted.and_then(|host| {
            device.caught(|| {
                host.map_async(wgpu::MapMode::Read, 0..bytes, |_| ());
                if let Some(clock) = clock {
                    clock.ask();
                }
            })?;
            device.wait()?;
            clock.map_or(Ok(()), Clock::add)?;
            memory.take_answer(host, bytes)
        });
        let mut taken = taken.map_err(|trouble| self.failed(trouble))?;
        self.is_faulty |= taken.drain(..FLAG as usize).any(|byte| byte != 0);
        self.note_rates();
        if self.groups.len() > MOST_GROUPS_KEPT {
            self.groups.clear();
        }
        self.job.check().map(|()| taken)
    }

    /// Notes the speed of the entry points since the last wait.
    fn note_rates(&mut self) {
        let took = self.sent.take().map_or(0.0, |(start, _)| start.elapsed().as_nanos() as f64);
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
    }
}
