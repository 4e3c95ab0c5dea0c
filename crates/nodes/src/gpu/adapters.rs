//! The adapters of the machine.

use std::time::Duration;

use orograph_graph::{Cancel, Field, Window, World};

use super::{Gpu, GpuOptions, Trouble};

/// A graphics adapter: a card, or a driver in software.
#[derive(Debug)]
pub struct Adapter {
    pub(super) inner: wgpu::Adapter,
    info: wgpu::AdapterInfo,
}

/// All adapters, the fastest kinds first.
#[derive(Debug)]
pub struct Adapters(pub Vec<Adapter>);

impl Adapters {
    /// Finds them. The variables `WGPU_BACKEND` and `WGPU_ADAPTER_NAME` limit the search: to an interface of the
    /// driver, and to adapters whose name contains a text.
    #[must_use]
    pub fn find() -> Self {
        // OpenGL gives compute shaders no storage
        let all = wgpu::Backends::VULKAN | wgpu::Backends::DX12 | wgpu::Backends::METAL;
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
        descriptor.backends &= all;
        if wgpu::Instance::enabled_backend_features().is_empty() {
            return Self(Vec::new());
        }
        let instance = wgpu::Instance::new(descriptor);
        let found = pollster::block_on(instance.enumerate_adapters(all));
        let mut adapters: Vec<Adapter> =
            found.into_iter().map(|inner| Adapter { info: inner.get_info(), inner }).collect();
        if let Ok(name) = std::env::var("WGPU_ADAPTER_NAME") {
            adapters.retain(|adapter| adapter.name().to_lowercase().contains(&name.to_lowercase()));
        }
        adapters.retain(|adapter| {
            adapter.inner.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS)
        });
        adapters.sort_by_key(|adapter| rank(adapter.info.device_type));
        Self(adapters)
    }

    /// Returns false if the machine has no card, as far as can be told without loading a driver: that takes a fifth of a
    /// second and 50 MiB, and much longer where memory is short.
    #[must_use]
    pub fn may_be_real() -> bool {
        if !cfg!(target_os = "linux") {
            return true;
        }
        let names =
            |folder: &str| std::fs::read_dir(folder).into_iter().flatten().flatten().map(|file| file.file_name());
        // the kernel's interfaces to cards, those of single makers, and that of a virtual machine on Windows
        let cards = ["nvidia", "dxg", "mali", "kgsl"];
        names("/dev/dri").any(|name| name.to_string_lossy().starts_with("renderD"))
            || names("/dev").any(|name| cards.iter().any(|card| name.to_string_lossy().starts_with(card)))
    }

    /// The fastest kind. Returns None when there is no adapter, or none but drivers in software and `real` is set.
    #[must_use]
    pub fn best(&self, real: bool) -> Option<&Adapter> {
        self.0.first().filter(|adapter| !(real && adapter.is_software()))
    }
}

/// The place of a kind of adapter among all: the fastest kinds come first.
const fn rank(kind: wgpu::DeviceType) -> u8 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

/// Distinguishes an adapter from others whose results may have other bytes.
fn identity(info: &wgpu::AdapterInfo) -> String {
    let wgpu::AdapterInfo { name, vendor, device, driver, driver_info, backend, .. } = info;
    format!("gpu {vendor:x}:{device:x} {name} {backend:?} {driver} {driver_info}")
}

/// What a device does in a second, measured on a small raster.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speed {
    /// Cells per second of a kernel that reads one raster and writes one.
    pub point: f64,
    /// Cells per second of an octave of noise.
    pub noise: f64,
}

impl Adapter {
    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.info.name
    }

    /// The interface to its driver, such as `Vulkan`.
    #[must_use]
    pub fn interface(&self) -> String {
        format!("{:?}", self.info.backend)
    }

    /// Its driver and the version of it.
    #[must_use]
    pub fn driver(&self) -> String {
        format!("{} {}", self.info.driver, self.info.driver_info).trim().to_owned()
    }

    /// The name of its kind.
    #[must_use]
    pub const fn kind(&self) -> &'static str {
        match self.info.device_type {
            wgpu::DeviceType::DiscreteGpu => "graphics card",
            wgpu::DeviceType::IntegratedGpu => "integrated graphics",
            wgpu::DeviceType::VirtualGpu => "virtual graphics",
            wgpu::DeviceType::Cpu => "software",
            wgpu::DeviceType::Other => "other",
        }
    }

    /// Returns true for a driver that computes on the processor.
    #[must_use]
    pub const fn is_software(&self) -> bool {
        matches!(self.info.device_type, wgpu::DeviceType::Cpu)
    }

    /// Largest raster that a shader can bind, in bytes.
    #[must_use]
    pub fn largest_binding(&self) -> u64 {
        self.inner.limits().max_storage_buffer_binding_size
    }

    /// Largest buffer, in bytes.
    #[must_use]
    pub fn largest_buffer(&self) -> u64 {
        self.inner.limits().max_buffer_size
    }

    /// Number of buffers that a shader can bind.
    #[must_use]
    pub fn buffers(&self) -> u32 {
        self.inner.limits().max_storage_buffers_per_shader_stage
    }

    /// Distinguishes it from adapters whose results may have other bytes.
    pub(super) fn identity(&self) -> String {
        identity(&self.info)
    }

    /// The size limit of values that stay on it. No interface tells how much memory a card has; what does not fit
    /// beside other programs goes to the host when the driver refuses it.
    pub(super) const fn budget(&self) -> u64 {
        match self.info.device_type {
            wgpu::DeviceType::DiscreteGpu => 4 << 30,
            _ => 1 << 30,
        }
    }

    /// Measures its speed on a raster of 1024 x 1024 cells; takes a few tenths of a second.
    ///
    /// # Errors
    /// [`Trouble`] when its driver does not work.
    pub fn speed(&self) -> Result<Speed, Trouble> {
        let gpu = Gpu::new(self, &GpuOptions::default())?;
        let world = World { size: [1024.0; 2], cells: [1024; 2], ..World::default() };
        let window = Window::whole(world);
        let field = Field::constant(window, 1.0);
        let cells = window.len() as f64;
        let rate = |time: Duration| cells / time.as_secs_f64().max(1e-9);
        let cancel = Cancel::default();
        let point = gpu.time(&crate::combine::combine::NODE, window, &[("a", &field), ("b", &field)], &cancel)?;
        let noise = gpu.time(&crate::generate::perlin::NODE, window, &[], &cancel)?;
        // octaves of the default wavelength of 4000 m down to 2.4 cells of 1 m
        Ok(Speed { point: rate(point), noise: rate(noise) * 11.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A laptop with two graphics adapters and a driver in software: the card comes first, and results of one are never
    /// taken for those of another, nor those of one version of a driver for those of the next.
    #[test]
    fn of_two_adapters_the_card_comes_first_and_each_has_its_own_keys() {
        let info = |kind, name: &str, version: &str| {
            let mut info = wgpu::AdapterInfo::new(kind, wgpu::Backend::Vulkan);
            (info.name, info.driver_info) = (name.to_owned(), version.to_owned());
            info
        };
        let mut all = [
            info(wgpu::DeviceType::Cpu, "software", "25.0"),
            info(wgpu::DeviceType::IntegratedGpu, "integrated", "25.0"),
            info(wgpu::DeviceType::DiscreteGpu, "card", "25.0"),
            info(wgpu::DeviceType::DiscreteGpu, "card", "25.1"),
        ];
        all.sort_by_key(|info| rank(info.device_type));
        assert_eq!(all.each_ref().map(|info| info.name.as_str()), ["card", "card", "integrated", "software"]);
        let keys: std::collections::BTreeSet<String> = all.iter().map(identity).collect();
        assert_eq!(keys.len(), all.len());
        let same = identity(&info(wgpu::DeviceType::DiscreteGpu, "card", "25.0"));
        assert!(keys.contains(&same), "the same card has the same keys in each run of the program");
    }
}
