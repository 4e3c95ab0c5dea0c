//! A device without a window, and pictures read back from it.

use std::sync::{Arc, Mutex, PoisonError};

use super::{
    error::ViewError,
    renderer::{Drawn, Renderer},
    scene::Scene,
    terrain::Terrain,
};

/// A device that draws pictures into memory. Any Vulkan driver works, including a software driver.
#[derive(Debug)]
pub struct Offscreen {
    device: wgpu::Device,
    queue: wgpu::Queue,
    name: String,
    /// The first device error outside an error scope.
    said: Arc<Mutex<Option<ViewError>>>,
}

/// The format of pictures: sRGB codes.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

impl Offscreen {
    /// Selects a device: a graphics card, else a software driver. `WGPU_BACKEND` and `WGPU_ADAPTER_NAME` restrict the
    /// choice.
    ///
    /// # Errors
    /// When there is none.
    pub fn new() -> Result<Self, ViewError> {
        pollster::block_on(Self::found())
    }

    async fn found() -> Result<Self, ViewError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..wgpu::RequestAdapterOptions::default()
        };
        let adapter = instance.request_adapter(&options).await.map_err(|_| ViewError::NoAdapter)?;
        let descriptor = wgpu::DeviceDescriptor { label: Some("orograph"), ..wgpu::DeviceDescriptor::default() };
        let device = adapter.request_device(&descriptor).await;
        let (device, queue) = device.map_err(|error| ViewError::Device(error.to_string()))?;
        let said = Arc::new(Mutex::new(None));
        let hear = Arc::clone(&said);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            hear.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(ViewError::from(error));
        }));
        Ok(Self { device, queue, name: adapter.get_info().name, said })
    }

    /// The name of the device.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The device.
    #[must_use]
    pub const fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// Its queue.
    #[must_use]
    pub const fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// A renderer for [`Self::picture`].
    ///
    /// # Errors
    /// When the device lacks a feature that the renderer needs.
    pub fn renderer(&self) -> Result<Renderer, ViewError> {
        Renderer::new(&self.device, &self.queue, FORMAT)
    }

    /// Draws a terrain; returns the picture as sRGB codes, four bytes per pixel, rows from the top.
    ///
    /// # Errors
    /// When the device cannot draw it.
    pub fn picture(&self, terrain: &Arc<Terrain>, scene: &Scene, size: [u32; 2]) -> Result<Vec<u8>, ViewError> {
        let mut renderer = self.renderer()?;
        renderer.set_terrain(Arc::clone(terrain))?;
        Ok(self.drawn(&mut renderer, scene, size)?.0)
    }

    /// Draws the terrain of a renderer.
    ///
    /// # Errors
    /// When the device cannot draw it.
    pub fn drawn(&self, renderer: &mut Renderer, scene: &Scene, size: [u32; 2]) -> Result<(Vec<u8>, Drawn), ViewError> {
        let drawn = drawn(&self.device, &self.queue, FORMAT, renderer, scene, size);
        match self.said.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(error) => Err(error),
            None => drawn,
        }
    }
}

/// Draws the terrain of a renderer for this format, on its device, and reads the picture back: four bytes per pixel,
/// rows from the top.
///
/// # Errors
/// When the device cannot draw it.
pub fn drawn(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    format: wgpu::TextureFormat,
    renderer: &mut Renderer,
    scene: &Scene,
    size: [u32; 2],
) -> Result<(Vec<u8>, Drawn), ViewError> {
    let [width, height] = size;
    let most = device.limits().max_texture_dimension_2d;
    if width == 0 || height == 0 || width > most || height > most {
        return Err(ViewError::Device(format!(
            "cannot draw a picture of {width} x {height} pixels; each side can have 1 to {most}"
        )));
    }
    let extent = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
    let row = (width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let (texture, buffer) = super::error::caught(device, || {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size: extent,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: u64::from(row) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        (texture, buffer)
    })?;
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let drawn = renderer.draw(&mut encoder, &view, size, scene)?;
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None },
        },
        extent,
    );
    let submitted = super::error::caught(device, || queue.submit([encoder.finish()]))?;
    buffer.map_async(wgpu::MapMode::Read, .., |_| ());
    let wait = wgpu::PollType::Wait { submission_index: Some(submitted), timeout: None };
    device.poll(wait).map_err(|error| ViewError::Device(error.to_string()))?;
    let bytes = buffer.get_mapped_range(..).map_err(|error| ViewError::Device(error.to_string()))?;
    let rows = bytes.chunks_exact(row as usize).flat_map(|bytes| &bytes[..4 * width as usize]);
    Ok((rows.copied().collect(), drawn))
}
