//! The device's own clock: how long it works on submits.

use std::{
    sync::atomic::{AtomicU64, Ordering},
    time::Duration,
};

use super::device::{Device, Trouble};

/// Bytes of the two times of a submit.
const BYTES: u64 = 16;

/// Adds up the time between the first and the last command of each submit.
pub(super) struct Clock {
    queries: wgpu::QuerySet,
    times: wgpu::Buffer,
    host: wgpu::Buffer,
    /// Nanoseconds of a tick.
    tick_ns: f32,
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
                count: 2,
            }),
            times: device.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("times"),
                size: BYTES,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            host: device.host_buffer(BYTES),
            tick_ns: device.queue.get_timestamp_period(),
            busy_ns: AtomicU64::new(0),
        });
        made.map(Some)
    }

    pub(super) fn busy(&self) -> Duration {
        Duration::from_nanos(self.busy_ns.load(Ordering::Relaxed))
    }

    /// Notes the time before the first command.
    pub(super) fn begin(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.write_timestamp(&self.queries, 0);
    }

    /// Notes the time after the last command.
    pub(super) fn end(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.write_timestamp(&self.queries, 1);
        encoder.resolve_query_set(&self.queries, 0..2, &self.times, 0);
        encoder.copy_buffer_to_buffer(&self.times, 0, &self.host, 0, BYTES);
    }

    /// Asks for the times of what has been submitted.
    pub(super) fn ask(&self) {
        self.host.map_async(wgpu::MapMode::Read, 0..BYTES, |_| ());
    }

    /// Adds the time of a submit that is done.
    pub(super) fn add(&self) -> Result<(), Trouble> {
        let mapped = self.host.get_mapped_range(0..BYTES).map_err(|error| Trouble::Lost(error.to_string()))?;
        let [start, end] = [0, 8].map(|at| mapped[at..].first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes)));
        drop(mapped);
        self.host.unmap();
        let ns = end.saturating_sub(start) as f64 * f64::from(self.tick_ns);
        self.busy_ns.fetch_add(ns as u64, Ordering::Relaxed);
        Ok(())
    }
}
