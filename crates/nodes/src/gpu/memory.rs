//! Memory of a device: blocks, values that stay there, and their way to the host.

use std::{
    collections::BTreeMap,
    sync::{
        Arc, Mutex,
        atomic::{AtomicU64, Ordering},
    },
};

use orograph_graph::{DeviceError, DeviceSamples, Field, WeakSamples, memory::with_capacity};

use super::{device::Device, device::Trouble, lock};

/// Largest part of a raster that is copied at a time.
const PART: u64 = 32 << 20;

/// Longest answer that comes to the host with the end of a submit, in bytes.
pub(super) const ANSWER: u64 = 1024;
/// Bytes of the flag of faults, which comes before it.
pub(super) const FLAG: u64 = 16;

/// Smallest block: a table without entries has room for one of any kind, as its binding requires.
const LEAST: u64 = 256;

/// Memory of a device under a limit. Buffers that are dropped are kept for others of their size: a new buffer is filled
/// with zeros first, which costs as much as a kernel.
#[derive(Debug)]
pub(super) struct Memory {
    pub(super) device: Device,
    budget: u64,
    /// What the device has at most, if that is less than it says; for tests.
    most: u64,
    /// Bytes of all blocks, in use and free.
    held: AtomicU64,
    free: Mutex<BTreeMap<u64, Vec<wgpu::Buffer>>>,
    /// A buffer that the host can read, for the next answer.
    answer: Mutex<Option<wgpu::Buffer>>,
    /// The same for parts of rasters: drivers take milliseconds to make a large one.
    staging: Mutex<Option<wgpu::Buffer>>,
    /// Values on the device, the least recently used first.
    values: Mutex<Vec<WeakSamples>>,
}

/// A buffer; it returns to the free ones when it is dropped.
#[derive(Debug)]
pub(super) struct Block {
    pub(super) buffer: wgpu::Buffer,
    memory: Arc<Memory>,
}

impl Drop for Block {
    fn drop(&mut self) {
        let memory = &self.memory;
        let bytes = self.buffer.size();
        if memory.device.is_lost() || memory.held() > memory.budget {
            memory.held.fetch_sub(bytes, Ordering::Relaxed);
        } else {
            lock(&memory.free).entry(bytes).or_default().push(self.buffer.clone());
        }
    }
}

impl Memory {
    pub(super) fn new(device: Device, budget: u64, most: u64) -> Self {
        Self {
            device,
            budget,
            most,
            held: AtomicU64::new(0),
            free: Mutex::default(),
            answer: Mutex::default(),
            staging: Mutex::default(),
            values: Mutex::default(),
        }
    }

    pub(super) fn held(&self) -> u64 {
        self.held.load(Ordering::Relaxed)
    }

    /// A block of at least that many bytes, with undefined contents. If the limit or the device leaves no room, the
    /// least recently used values go to the host.
    pub(super) fn block(self: &Arc<Self>, bytes: u64) -> Result<Block, Trouble> {
        let bytes = bytes.max(LEAST).next_multiple_of(16);
        if bytes > self.device.limits.max_buffer_size {
            return Err(Trouble::TooLarge(orograph_graph::bytes(bytes)));
        }
        if let Some(buffer) = lock(&self.free).get_mut(&bytes).and_then(Vec::pop) {
            return Ok(Block { buffer, memory: Arc::clone(self) });
        }
        while self.held() + bytes > self.budget && self.make_room()? {}
        loop {
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
            let descriptor = wgpu::BufferDescriptor { label: None, size: bytes, usage, mapped_at_creation: false };
            let has_room = self.held() + bytes <= self.most;
            let create = || self.device.caught(|| self.device.device.create_buffer(&descriptor));
            match has_room.then(create).unwrap_or(Err(Trouble::Memory)) {
                Ok(buffer) => {
                    self.held.fetch_add(bytes, Ordering::Relaxed);
                    return Ok(Block { buffer, memory: Arc::clone(self) });
                }
                Err(Trouble::Memory) if self.make_room()? => {}
                Err(trouble) => return Err(trouble),
            }
        }
    }

    /// Frees buffers that are not in use, or sends the least recently used value to the host. Returns false when there
    /// is nothing left.
    fn make_room(&self) -> Result<bool, Trouble> {
        let free: Vec<wgpu::Buffer> = std::mem::take(&mut *lock(&self.free)).into_values().flatten().collect();
        if !free.is_empty() {
            self.held.fetch_sub(free.iter().map(wgpu::Buffer::size).sum(), Ordering::Relaxed);
            return Ok(true);
        }
        let oldest = {
            let mut values = lock(&self.values);
            values.retain(|value| !value.is_gone());
            if values.is_empty() { None } else { Some(values.remove(0)) }
        };
        match oldest {
            Some(value) => value.leave_device().map(|()| true).map_err(|DeviceError(why)| Trouble::Lost(why)),
            None => Ok(false),
        }
    }

    /// Notes that a value on the device was used.
    fn used(&self, field: &Field) {
        let value = field.shared();
        let mut values = lock(&self.values);
        values.retain(|known| !known.is_gone() && !known.is_same(&value));
        values.push(value);
    }

    /// The samples of a raster on this device, uploaded if they are not there.
    pub(super) fn resident(self: &Arc<Self>, field: &Field) -> Result<Resident, Trouble> {
        let device = field.device();
        let known = device.as_deref().and_then(|samples| (samples as &dyn std::any::Any).downcast_ref::<Resident>());
        if let Some(resident) = known.filter(|resident| Arc::ptr_eq(&resident.memory, self)) {
            self.used(field);
            return Ok(resident.clone());
        }
        field.fetch().map_err(|DeviceError(why)| Trouble::Lost(why))?;
        let planes = (0..field.planes()).map(|plane| {
            let samples = field.plane(plane);
            let block = self.block(size_of_val(samples) as u64)?;
            self.device.caught(|| self.device.queue.write_buffer(&block.buffer, 0, bytemuck::cast_slice(samples)))?;
            Ok(block)
        });
        let planes: Vec<Block> = planes.collect::<Result<_, Trouble>>()?;
        let resident = Resident { planes: planes.into(), cells: field.window().len(), memory: Arc::clone(self) };
        field.keep_on_device(Arc::new(resident.clone()));
        self.used(field);
        Ok(resident)
    }

    /// A raster of samples that a kernel has written.
    pub(super) fn field(self: &Arc<Self>, window: orograph_graph::Window, planes: Vec<Block>) -> Field {
        let count = planes.len();
        let resident = Resident { planes: planes.into(), cells: window.len(), memory: Arc::clone(self) };
        let field = Field::on_device(window, count, Arc::new(resident));
        self.used(&field);
        field
    }

    /// A buffer for the flag of faults and an answer of up to [`ANSWER`] bytes. Call it where errors are caught.
    pub(super) fn answer(&self) -> wgpu::Buffer {
        lock(&self.answer).take().unwrap_or_else(|| self.device.host_buffer(FLAG + ANSWER))
    }

    /// The first bytes of an answer that has been mapped, after the device has ended its work.
    pub(super) fn take_answer(&self, answer: wgpu::Buffer, bytes: u64) -> Result<Vec<u8>, Trouble> {
        let taken = mapped(&answer, bytes, <[u8]>::to_vec)?;
        *lock(&self.answer) = Some(answer);
        Ok(taken)
    }

    /// Copies bytes of a buffer to the host, part by part.
    pub(super) fn read(&self, buffer: &wgpu::Buffer, bytes: u64, mut take: impl FnMut(&[u8])) -> Result<(), Trouble> {
        let device = &self.device;
        let kept = lock(&self.staging).take().filter(|kept| kept.size() >= bytes.min(PART));
        let host = kept.map_or_else(|| device.caught(|| device.host_buffer(bytes.min(PART))), Ok)?;
        for start in (0..bytes).step_by(PART as usize) {
            let size = PART.min(bytes - start);
            device.caught(|| {
                let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                encoder.copy_buffer_to_buffer(buffer, start, &host, 0, size);
                device.queue.submit([encoder.finish()]);
                host.map_async(wgpu::MapMode::Read, 0..size, |_| ());
            })?;
            device.wait()?;
            mapped(&host, size, &mut take)?;
        }
        *lock(&self.staging) = Some(host);
        Ok(())
    }
}

/// Reads the first bytes of a buffer that has been mapped.
fn mapped<T>(buffer: &wgpu::Buffer, bytes: u64, take: impl FnOnce(&[u8]) -> T) -> Result<T, Trouble> {
    let mapped = buffer.get_mapped_range(0..bytes).map_err(|error| Trouble::Lost(error.to_string()))?;
    let taken = take(&mapped);
    drop(mapped);
    buffer.unmap();
    Ok(taken)
}

/// The samples of a raster on a device, a block for each plane.
#[derive(Clone, Debug)]
pub(super) struct Resident {
    pub(super) planes: Arc<[Block]>,
    cells: usize,
    memory: Arc<Memory>,
}

impl DeviceSamples for Resident {
    fn fetch(&self) -> Result<Vec<f32>, DeviceError> {
        let mut samples: Vec<f32> =
            with_capacity(self.planes.len() * self.cells).map_err(|error| DeviceError(error.to_string()))?;
        for block in self.planes.iter() {
            let read = self.memory.read(&block.buffer, 4 * self.cells as u64, |bytes| {
                samples.extend(bytes.as_chunks::<4>().0.iter().map(|word| f32::from_le_bytes(*word)));
            });
            read.map_err(|trouble| {
                self.memory.device.give_up(&trouble);
                DeviceError(trouble.to_string())
            })?;
        }
        Ok(samples)
    }
}
