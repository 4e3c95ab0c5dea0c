//! Errors of the 3D view.

use std::future::Future;

/// Why the 3D view cannot be drawn.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ViewError {
    /// No graphics device can draw it.
    #[error("no graphics driver was found that can draw in 3D")]
    NoAdapter,
    /// The only driver supports OpenGL alone, which cannot draw into the texture formats that 3D needs.
    #[error("3D needs Vulkan, and the graphics driver of this machine has only OpenGL")]
    OpenGl,
    /// The graphics device reported an error or was lost.
    #[error("the graphics device failed: {0}")]
    Device(String),
    /// The device has too little memory for the terrain or the size of the picture.
    #[error("the graphics device has too little memory")]
    OutOfMemory,
    /// The fields of the terrain do not match.
    #[error("{0}")]
    Terrain(String),
    /// A number of the scene is not finite or outside its range.
    #[error("{0}")]
    Scene(String),
}

impl ViewError {
    /// What you can do about it.
    #[must_use]
    pub const fn remedy(&self) -> &'static str {
        match self {
            Self::NoAdapter | Self::OpenGl => {
                "install a Vulkan driver; a software driver works, such as the package `mesa-vulkan-drivers` with `libvulkan1`"
            }
            Self::Device(_) => "update the graphics driver, or choose a software one with `VK_DRIVER_FILES`",
            Self::OutOfMemory => "use fewer cells or a smaller picture",
            Self::Scene(_) => "use finite numbers, a field of view below 180° and a vertical exaggeration above 0",
            Self::Terrain(_) => "use fields with the same window as the heights",
        }
    }
}

impl From<wgpu::Error> for ViewError {
    fn from(error: wgpu::Error) -> Self {
        match error {
            wgpu::Error::OutOfMemory { .. } => Self::OutOfMemory,
            other => Self::Device(first_line(&other.to_string())),
        }
    }
}

fn first_line(text: &str) -> String {
    let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    lines.join("; ")
}

/// Runs calls that create resources on a device; returns the first error that the device reports.
pub(super) fn caught<T>(device: &wgpu::Device, make: impl FnOnce() -> T) -> Result<T, ViewError> {
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let rules = device.push_error_scope(wgpu::ErrorFilter::Validation);
    // failures of the driver's own shader compiler, such as that of OpenGL
    let inner = device.push_error_scope(wgpu::ErrorFilter::Internal);
    let made = make();
    let errors = [settled(inner.pop()), settled(rules.pop()), settled(memory.pop())];
    match errors.into_iter().flatten().next() {
        Some(error) => Err(error.into()),
        None => Ok(made),
    }
}

fn settled<T>(future: impl Future<Output = T>) -> T {
    pollster::block_on(future)
}
