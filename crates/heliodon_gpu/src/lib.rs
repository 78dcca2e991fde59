//! Heliodon's questions about light, answered on a GPU by wgpu: on a device of its own, or on the one that a viewer draws with.
//!
//! [`VisibilityGpu`] answers what `heliodon_rays::TriangleScene::visibility` answers by rays, by a depth map for each direction, and keeps
//! the matrix where it was computed.

mod device;
mod fault;
mod readback;
pub mod visibility;

pub use device::{GpuError, Headless, headless};
pub use fault::DeviceFault;
pub use visibility::{DepthMaps, VisibilityGpu};
pub use wgpu;
