//! Samples of rasters that may be on a device.
//!
//! A kernel on a device leaves its results there, so that the next one reads them without a way through the host. The
//! graph does not know what the device is: it holds a [`DeviceSamples`], and asks it for the samples when something on
//! the host reads them.

use std::{
    any::Any,
    fmt,
    sync::{Arc, Mutex, OnceLock, Weak},
};

use crate::eval::lock;

/// Why a device does not give samples back.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the graphics device does not give its results back: {0}")]
pub struct DeviceError(pub String);

/// Samples of a raster on a device, plane after plane.
pub trait DeviceSamples: Any + Send + Sync + fmt::Debug {
    /// Copies the samples to the host.
    ///
    /// # Errors
    /// When the device does not give them back.
    fn fetch(&self) -> Result<Vec<f32>, DeviceError>;
}

/// The samples of a raster: on the host, on a device, or on both.
pub(crate) struct Samples {
    len: usize,
    host: OnceLock<Vec<f32>>,
    device: Mutex<Option<Arc<dyn DeviceSamples>>>,
}

impl Samples {
    pub(crate) fn on_host(samples: Vec<f32>) -> Self {
        Self { len: samples.len(), host: OnceLock::from(samples), device: Mutex::default() }
    }

    pub(crate) fn on_device(len: usize, samples: Arc<dyn DeviceSamples>) -> Self {
        Self { len, host: OnceLock::new(), device: Mutex::new(Some(samples)) }
    }

    /// Number of samples.
    pub(crate) const fn len(&self) -> usize {
        self.len
    }

    pub(crate) fn host(&self) -> Option<&[f32]> {
        self.host.get().map(Vec::as_slice)
    }

    pub(crate) fn device(&self) -> Option<Arc<dyn DeviceSamples>> {
        lock(&self.device).clone()
    }

    pub(crate) fn keep_on_device(&self, samples: Arc<dyn DeviceSamples>) {
        *lock(&self.device) = Some(samples);
    }

    pub(crate) fn fetch(&self) -> Result<(), DeviceError> {
        if self.host.get().is_some() {
            return Ok(());
        }
        // the device gives its copy up only after the host has one
        let Some(device) = self.device() else { return Ok(()) };
        let samples = device.fetch()?;
        if samples.len() != self.len {
            return Err(DeviceError(format!("{} samples instead of {}", samples.len(), self.len)));
        }
        // another thread may have been faster, with the same samples
        let _ = self.host.set(samples);
        Ok(())
    }

    /// The samples on the host.
    ///
    /// # Panics
    /// When the device does not give them back.
    pub(crate) fn read(&self) -> &[f32] {
        if let Err(error) = self.fetch() {
            panic!("{error}");
        }
        self.host().unwrap_or_default()
    }

    pub(crate) fn into_host(self) -> Vec<f32> {
        self.read();
        self.host.into_inner().unwrap_or_default()
    }
}

impl fmt::Debug for Samples {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Samples").field("host", &self.host.get()).field("device", &self.device()).finish()
    }
}

/// A handle of the samples of a raster that does not keep them alive: with it, a device that is short of memory sends
/// them to the host.
#[derive(Clone, Debug)]
pub struct WeakSamples(Weak<Samples>);

impl WeakSamples {
    pub(crate) fn new(samples: &Arc<Samples>) -> Self {
        Self(Arc::downgrade(samples))
    }

    /// Returns true if no raster has the samples any more.
    #[must_use]
    pub fn is_gone(&self) -> bool {
        self.0.strong_count() == 0
    }

    /// Returns true if both are handles of the same samples.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        self.0.ptr_eq(&other.0)
    }

    /// Brings the samples to the host, and drops the copy on the device.
    ///
    /// # Errors
    /// When the device does not give them back; they then stay there.
    pub fn leave_device(&self) -> Result<(), DeviceError> {
        let Some(samples) = self.0.upgrade() else { return Ok(()) };
        samples.fetch()?;
        *lock(&samples.device) = None;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Field, Window, World};

    #[derive(Debug)]
    struct Far(Option<Vec<f32>>);

    impl DeviceSamples for Far {
        fn fetch(&self) -> Result<Vec<f32>, DeviceError> {
            self.0.clone().ok_or_else(|| DeviceError("it is gone".to_owned()))
        }
    }

    fn window() -> Window {
        Window::whole(World { size: [2.0, 1.0], cells: [2, 1], ..World::default() })
    }

    #[test]
    fn samples_come_to_the_host_when_something_reads_them() {
        let field = Field::on_device(window(), 1, Arc::new(Far(Some(vec![1.0, 2.0]))));
        let copy = field.clone();
        assert_eq!((field.host(), field.bytes()), (None, 8));
        assert_eq!(field.samples(), [1.0, 2.0]);
        assert_eq!(copy.host(), Some(&[1.0, 2.0][..]), "copies share the samples");
        field.shared().leave_device().expect("they are on the host");
        assert!(copy.device().is_none());
        drop(field);
        assert_eq!(copy.into_samples(), [1.0, 2.0]);
    }

    #[test]
    fn a_device_that_is_gone_is_an_error_and_loses_nothing_else() {
        let field = Field::on_device(window(), 1, Arc::new(Far(None)));
        assert!(field.fetch().is_err() && field.shared().leave_device().is_err() && field.device().is_some());
        let short = Field::on_device(window(), 1, Arc::new(Far(Some(vec![1.0]))));
        assert!(short.fetch().is_err_and(|error| error.to_string().contains("1 samples instead of 2")));
        let both = Field::new(window(), vec![3.0, 4.0]);
        both.keep_on_device(Arc::new(Far(None)));
        let handle = both.shared();
        handle.leave_device().expect("the host has them");
        assert_eq!(both.samples(), [3.0, 4.0]);
        drop(both);
        assert!(handle.is_gone() && handle.leave_device().is_ok());
    }
}
