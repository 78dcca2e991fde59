//! Heliodon's questions about light, answered on a GPU by wgpu: on a device of its own, or on the one that a viewer draws with.
//!
//! [`VisibilityGpu`] answers what `heliodon_rays::TriangleScene::visibility` answers on the processor, by rays of its own or by a depth map for each direction,
//! and keeps the matrix where it was computed. [`MovingGpu`] poses and lights a mesh that moves into buffers that are drawn, and reads nothing back.

mod buffers;
mod device;
mod fault;
mod hierarchy;
mod morton;
pub mod moving;
mod readback;
pub mod visibility;

pub use device::{GpuError, Headless, headless};
pub use fault::DeviceFault;
pub use moving::{MovingFrame, MovingGpu, MovingPipelines};
pub use visibility::{Answered, DepthMaps, Method, Rays, VisibilityGpu};
pub use wgpu;
