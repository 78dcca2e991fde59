//! A device without a window, and what can go wrong with one.

use crate::DeviceFault;
use wgpu::{
    Adapter, Backends, Device, DeviceDescriptor, Instance, InstanceDescriptor, PowerPreference, Queue, RequestAdapterOptions,
};

/// Why a GPU gave no answer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GpuError {
    /// There is none.
    #[error(
        "there is no GPU that wgpu can use ({0}); install a Vulkan driver (software: mesa-vulkan-drivers), or compute on the processor"
    )]
    NoAdapter(String),
    /// It failed, or went away.
    #[error("the GPU failed: {0}")]
    Device(String),
    /// A buffer would be larger than the device allows.
    #[error("{what} need {needed_bytes} bytes, and this GPU has buffers of at most {most_bytes}; {remedy}")]
    TooLarge {
        /// What does not fit.
        what: &'static str,
        /// Bytes that it needs.
        needed_bytes: u64,
        /// Bytes of the device's largest buffer.
        most_bytes: u64,
        /// What to do.
        remedy: &'static str,
    },
    /// What was given does not go together.
    #[error("{0}")]
    Input(&'static str),
}

/// A device of one's own.
#[derive(Clone, Debug)]
pub struct Headless {
    /// The GPU.
    pub adapter: Adapter,
    /// The device.
    pub device: Device,
    /// Its queue.
    pub queue: Queue,
    /// What goes wrong on it.
    pub fault: DeviceFault,
}

/// The fastest GPU at hand, with its own limits; software counts where there is nothing else.
///
/// # Errors
/// [`GpuError::NoAdapter`], or what the driver says.
pub fn headless() -> Result<Headless, GpuError> {
    // OpenGL, which other crates of a program may switch on, has not what is needed.
    let backends = Backends::from_env().unwrap_or(Backends::PRIMARY);
    let instance = Instance::new(InstanceDescriptor { backends, ..InstanceDescriptor::new_without_display_handle() });
    let options = RequestAdapterOptions { power_preference: PowerPreference::HighPerformance, ..Default::default() };
    let adapter =
        pollster::block_on(instance.request_adapter(&options)).map_err(|error| GpuError::NoAdapter(error.to_string()))?;
    let descriptor =
        DeviceDescriptor { label: Some("heliodon"), required_limits: adapter.limits(), ..DeviceDescriptor::default() };
    let (device, queue) =
        pollster::block_on(adapter.request_device(&descriptor)).map_err(|error| GpuError::Device(error.to_string()))?;
    let fault = DeviceFault::default();
    fault.listen(&device);
    Ok(Headless { adapter, device, queue, fault })
}
