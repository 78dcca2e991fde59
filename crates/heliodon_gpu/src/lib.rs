//! Heliodon's questions about light, answered on a GPU by wgpu: on a device of its own, or on the one that a viewer draws with.
//!
//! [`VisibilityGpu`] answers what `heliodon_rays::TriangleScene::visibility` answers on the processor, by rays of its own or by a depth map for each direction,
//! and keeps the matrix where it was computed.

mod buffers;
mod device;
mod fault;
mod hierarchy;
mod morton;
mod readback;
pub mod visibility;

pub use device::{GpuError, Headless, headless};
pub use fault::DeviceFault;
pub use visibility::{Answered, DepthMaps, Method, Rays, VisibilityGpu};
pub use wgpu;
