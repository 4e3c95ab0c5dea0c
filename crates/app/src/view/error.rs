//! What can go wrong between here and the screen.

use std::future::Future;

/// Why nothing was drawn.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ViewError {
    /// There is no device that can draw.
    #[error("no graphics device was found: {0}")]
    NoAdapter(String),
    /// The device ended, was lost, or refused.
    #[error("the graphics device failed: {0}")]
    Device(String),
    /// The device has too little memory for this land or this size of picture.
    #[error("the graphics device has too little memory")]
    OutOfMemory,
    /// What is to be drawn is not of one piece.
    #[error("{0}")]
    Land(String),
    /// A number of the scene is none, or makes no picture.
    #[error("{0}")]
    Scene(String),
}

impl ViewError {
    /// What would help.
    #[must_use]
    pub const fn remedy(&self) -> &'static str {
        match self {
            Self::NoAdapter(_) => {
                "install a Vulkan driver; a software one does, such as the package `mesa-vulkan-drivers` with `libvulkan1`"
            }
            Self::Device(_) => "renew the graphics driver, or choose a software one with `VK_DRIVER_FILES`",
            Self::OutOfMemory => "ask for fewer cells or a smaller picture",
            Self::Scene(_) => "give finite numbers, an angle of view below 180° and a factor on heights above 0",
            Self::Land(_) => "give values of the same window as the heights",
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

/// Runs what makes things on a device, and gives what the device says against it.
pub(super) fn caught<T>(device: &wgpu::Device, make: impl FnOnce() -> T) -> Result<T, ViewError> {
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let rules = device.push_error_scope(wgpu::ErrorFilter::Validation);
    // What the device's own compiler cannot do, such as that of OpenGL.
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
