//! What goes wrong on a device, kept for whoever asks.
//!
//! wgpu tells errors to a listener, not to whoever caused them; its error scopes are no way out, for without its feature `std` (which Bevy
//! leaves off) all threads share one stack of them.

use crate::GpuError;
use std::sync::{Arc, Mutex, PoisonError};
use wgpu::Device;

/// The first thing that went wrong; clones share it.
#[derive(Clone, Debug, Default)]
pub struct DeviceFault(Arc<Mutex<Option<String>>>);

impl DeviceFault {
    /// Listens to a device, in the place of whoever listened before.
    pub fn listen(&self, device: &Device) {
        let told = self.clone();
        device.on_uncaptured_error(Arc::new(move |error| told.tell(describe(&error))));
        let told = self.clone();
        device.set_device_lost_callback(move |_, why| told.tell(format!("the device was lost: {why}")));
    }

    /// Only the first is kept: it often causes the others.
    fn tell(&self, what: String) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(what);
    }

    /// What went wrong so far, if anything.
    #[must_use]
    pub fn first(&self) -> Option<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// # Errors
    /// What went wrong so far.
    pub fn check(&self) -> Result<(), GpuError> {
        self.first().map_or(Ok(()), |what| Err(GpuError::Device(what)))
    }
}

fn describe(error: &wgpu::Error) -> String {
    match error {
        wgpu::Error::OutOfMemory { .. } => {
            "out of memory; smaller pictures, fewer samples a pixel or smaller meshes need less".to_owned()
        }
        other => other.to_string(),
    }
}
