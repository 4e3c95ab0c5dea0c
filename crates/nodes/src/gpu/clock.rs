//! The device's own clock: how long it works on submits.

use std::{
    sync::atomic::{AtomicU32, AtomicU64, Ordering},
    time::Duration,
};

use super::device::{Device, Trouble};

/// Submits between two waits, at most.
pub(super) const MOST_SUBMITS: u32 = 1024;

/// Bytes of the two times of a submit.
const BYTES: u64 = 16;

/// Adds up the time between the first and the last command of each submit.
pub(super) struct Clock {
    queries: wgpu::QuerySet,
    times: wgpu::Buffer,
    host: wgpu::Buffer,
    /// Nanoseconds of a tick.
    tick_ns: f32,
    /// Submits since the last wait.
    submits: AtomicU32,
    busy_ns: AtomicU64,
}

impl Clock {
    /// Returns None if the device has no clock.
    pub(super) fn new(device: &Device) -> Result<Option<Self>, Trouble> {
        if !device.device.features().contains(Device::CLOCK) {
            return Ok(None);
        }
        let made = device.caught(|| Self {
            queries: device.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("times"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * MOST_SUBMITS,
            }),
            times: device.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("times"),
                size: BYTES * u64::from(MOST_SUBMITS),
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            host: device.host_buffer(BYTES * u64::from(MOST_SUBMITS)),
            tick_ns: device.queue.get_timestamp_period(),
            submits: AtomicU32::new(0),
            busy_ns: AtomicU64::new(0),
        });
        made.map(Some)
    }

    pub(super) fn busy(&self) -> Duration {
        Duration::from_nanos(self.busy_ns.load(Ordering::Relaxed))
    }

    /// Notes the time before the first command of a submit.
    pub(super) fn begin(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.write_timestamp(&self.queries, 2 * self.submits.load(Ordering::Relaxed));
    }

    /// Notes the time after its last command.
    pub(super) fn end(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.write_timestamp(&self.queries, 2 * self.submits.fetch_add(1, Ordering::Relaxed) + 1);
    }

    /// Has the times of all submits since the last wait copied, before a wait.
    pub(super) fn copy(&self, encoder: &mut wgpu::CommandEncoder) {
        let submits = self.submits.load(Ordering::Relaxed);
        encoder.resolve_query_set(&self.queries, 0..2 * submits, &self.times, 0);
        encoder.copy_buffer_to_buffer(&self.times, 0, &self.host, 0, BYTES * u64::from(submits));
    }

    /// Asks for these times, once the copy has been submitted.
    pub(super) fn ask(&self) {
        self.host.map_async(wgpu::MapMode::Read, 0..BYTES * u64::from(self.submits.load(Ordering::Relaxed)), |_| ());
    }

    /// Adds the times of submits that are done.
    pub(super) fn add(&self) -> Result<(), Trouble> {
        let bytes = BYTES * u64::from(self.submits.swap(0, Ordering::Relaxed));
        let mapped = self.host.get_mapped_range(0..bytes).map_err(|error| Trouble::Lost(error.to_string()))?;
        let time = |bytes: &[u8]| bytes.first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
        let ticks = |submit: &[u8]| time(&submit[8..]).saturating_sub(time(submit));
        let ticks: u64 = mapped.chunks_exact(BYTES as usize).map(ticks).sum();
        drop(mapped);
        self.host.unmap();
        self.busy_ns.fetch_add((ticks as f64 * f64::from(self.tick_ns)) as u64, Ordering::Relaxed);
        Ok(())
    }
}
