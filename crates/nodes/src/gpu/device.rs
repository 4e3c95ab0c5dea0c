//! A device: errors, loss, compiled shaders.

use std::{
    collections::HashSet,
    sync::{Arc, Mutex},
};

use orograph_graph::{
    Node,
    gpu::{Access, FIRST_SLOT, Shader, WORKGROUP},
};

use super::{Adapter, GpuOptions, lock};

/// The largest binding that kernels use, whatever the device has. Shaders number cells by whole numbers of 32 bits, and
/// the passes of `hydrology/flow_pass` have three bits more in the same word, so that a raster has less than 2^29 cells.
const MOST_BINDING: u64 = (1 << 31) - 4;
const _: () = assert!((MOST_BINDING / 4) << 3 <= u32::MAX as u64, "the number of a cell and three bits fit a word");

/// Invocations of a workgroup along a row on a graphics card. With [`WORKGROUP`] a large one starts workgroups more slowly
/// than it could read and write their cells.
const WIDE_WORKGROUP: u32 = 256;

/// Why a kernel does not run on a device.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Trouble {
    /// The device or its driver failed; it cannot be used any more.
    #[error("the graphics device failed: {0}")]
    Lost(String),
    /// It refused a command; others may work.
    #[error("the graphics driver refuses to work: {0}")]
    Refused(String),
    /// It has too little memory.
    #[error("the graphics device has too little memory")]
    Memory,
    /// A raster is larger than the device can bind.
    #[error("a raster of {0} is larger than the graphics device can bind")]
    TooLarge(String),
    /// The driver refuses a shader.
    #[error("the graphics driver refuses a shader: {0}")]
    Shader(String),
    /// An input is no raster.
    #[error("an input is not a raster")]
    Input,
}

impl Trouble {
    /// What you can do about it.
    #[must_use]
    pub const fn remedy(&self) -> &'static str {
        match self {
            Self::Lost(_) | Self::Refused(_) => "update the graphics driver, or use `--backend cpu`",
            Self::Memory => "close other programs that use the graphics card, or use fewer cells",
            Self::TooLarge(_) => "the result is that of `--backend cpu`; fewer cells run on the device",
            Self::Shader(_) => "update the graphics driver; other nodes still run on the device",
            Self::Input => "the result is that of `--backend cpu`",
        }
    }
}

impl From<wgpu::Error> for Trouble {
    fn from(error: wgpu::Error) -> Self {
        match error {
            wgpu::Error::OutOfMemory { .. } => Self::Memory,
            other => Self::Refused(one_line(&other.to_string())),
        }
    }
}

pub(super) fn one_line(text: &str) -> String {
    let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    lines.join("; ")
}

/// A compiled entry point.
#[derive(Debug)]
pub(super) struct Pipeline {
    pub(super) compute: wgpu::ComputePipeline,
    pub(super) layout: wgpu::BindGroupLayout,
    /// Invocations of a workgroup along a row.
    pub(super) workgroup: u32,
}

/// A device and its queue.
#[derive(Debug)]
pub(super) struct Device {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) limits: wgpu::Limits,
    /// Invocations of a workgroup along a row, in passes over cells.
    workgroup: u32,
    lost: Arc<Mutex<Option<String>>>,
}

impl Device {
    /// What a device with a clock for submits has.
    pub(super) const CLOCK: wgpu::Features =
        wgpu::Features::TIMESTAMP_QUERY.union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);

    /// Opens an adapter, with all its limits or those that every WebGPU device has.
    pub(super) fn open(adapter: &Adapter, options: &GpuOptions) -> Result<Self, Trouble> {
        let all = adapter.inner.limits();
        let limits = if options.plain_limits { wgpu::Limits::default() } else { all };
        let largest = limits.max_storage_buffer_binding_size.min(MOST_BINDING);
        let limits = wgpu::Limits { max_storage_buffer_binding_size: largest, ..limits };
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("kernels"),
            required_limits: limits.clone(),
            required_features: if options.clock {
                adapter.inner.features() & Self::CLOCK
            } else {
                wgpu::Features::empty()
            },
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) = pollster::block_on(adapter.inner.request_device(&descriptor))
            .map_err(|error| Trouble::Lost(one_line(&error.to_string())))?;
        let lost = Arc::new(Mutex::new(None));
        let (on_error, on_loss) = (Arc::clone(&lost), Arc::clone(&lost));
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            lock(&on_error).get_or_insert_with(|| one_line(&error.to_string()));
        }));
        device.set_device_lost_callback(move |_, message| {
            lock(&on_loss).get_or_insert_with(|| format!("it was lost ({})", one_line(&message)));
        });
        let suited = if adapter.is_software() { WORKGROUP } else { WIDE_WORKGROUP };
        let workgroup = options.workgroup.unwrap_or(suited);
        Ok(Self { device, queue, limits, workgroup, lost })
    }

    /// Returns true if it cannot be used any more.
    pub(super) fn is_lost(&self) -> bool {
        lock(&self.lost).is_some()
    }

    /// Uses it no more.
    pub(super) fn give_up(&self, trouble: &Trouble) {
        lock(&self.lost).get_or_insert_with(|| trouble.to_string());
    }

    /// Destroys it.
    pub(super) fn lose(&self) {
        self.device.destroy();
    }

    /// The error that was reported outside of [`Self::caught`].
    pub(super) fn check(&self) -> Result<(), Trouble> {
        lock(&self.lost).clone().map_or(Ok(()), |why| Err(Trouble::Lost(why)))
    }

    /// Runs calls on the device; returns the first error that it reports.
    pub(super) fn caught<T>(&self, call: impl FnOnce() -> T) -> Result<T, Trouble> {
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let rules = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        // failures of the driver's own shader compiler
        let inner = self.device.push_error_scope(wgpu::ErrorFilter::Internal);
        let made = call();
        let errors = [inner.pop(), rules.pop(), memory.pop()].map(pollster::block_on);
        match errors.into_iter().flatten().next() {
            // a lost device refuses every call; the next poll reports the loss
            Some(error) => {
                let _ = self.device.poll(wgpu::PollType::Poll);
                self.check().and(Err(error.into()))
            }
            None => self.check().map(|()| made),
        }
    }

    /// A buffer that the host can read.
    pub(super) fn host_buffer(&self, size: u64) -> wgpu::Buffer {
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        self.device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
    }

    /// Waits until everything submitted is done.
    pub(super) fn wait(&self) -> Result<(), Trouble> {
        let polled = self.device.poll(wgpu::PollType::wait_indefinitely());
        polled.map_err(|error| Trouble::Lost(one_line(&error.to_string())))?;
        self.check()
    }

    /// Compiles an entry point of a shader of a node. `is_wide` chooses the workgroups of a graphics card, unless
    /// invocations share memory, which is as large as the workgroup in the text.
    pub(super) fn pipeline(
        &self,
        node: &Node,
        shader: &Shader,
        entry: &str,
        is_wide: bool,
    ) -> Result<Pipeline, Trouble> {
        let (most, needs) = (self.limits.max_storage_buffers_per_shader_stage, shader.slots.len() as u32 + 1);
        if needs > most {
            return Err(Trouble::Shader(format!("`{}` needs {needs} buffers, and the device has {most}", shader.name)));
        }
        let variables: HashSet<String> = shader.slots.iter().map(orograph_graph::gpu::Slot::variable).collect();
        debug_assert_eq!(variables.len(), shader.slots.len(), "`{}` has a slot twice", shader.name);
        let workgroup = if is_wide && !shader.source.contains("var<workgroup>") { self.workgroup } else { WORKGROUP };
        let made = self.caught(|| {
            let size = |count: u32| format!("@workgroup_size({count})");
            let text = shader.text(node).replace(&size(WORKGROUP), &size(workgroup));
            let source = wgpu::ShaderSource::Wgsl(text.into());
            let module =
                self.device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(shader.name), source });
            let layout = self.layout(shader);
            let layouts = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(shader.name),
                bind_group_layouts: &[Some(&layout)],
                immediate_size: 0,
            });
            let compute = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(shader.name),
                layout: Some(&layouts),
                module: &module,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            });
            Pipeline { compute, layout, workgroup }
        });
        made.map_err(|trouble| match trouble {
            Trouble::Refused(why) => Trouble::Shader(format!("`{}`, {why}", shader.name)),
            other => other,
        })
    }

    fn layout(&self, shader: &Shader) -> wgpu::BindGroupLayout {
        let buffer = |binding: u32, ty: wgpu::BufferBindingType| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            // parameter structs of many passes are in one buffer
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: binding == 0, min_binding_size: None },
            count: None,
        };
        let storage = |read_only: bool| wgpu::BufferBindingType::Storage { read_only };
        let mut entries = vec![buffer(0, wgpu::BufferBindingType::Uniform), buffer(1, storage(false))];
        let slots = (FIRST_SLOT..).zip(shader.slots);
        entries.extend(slots.map(|(binding, slot)| buffer(binding, storage(slot.access == Access::Read))));
        let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some(shader.name), entries: &entries };
        self.device.create_bind_group_layout(&descriptor)
    }
}
