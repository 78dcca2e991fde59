//! By rays or by depth maps.

use crate::GpuError;
use crate::hierarchy::Hierarchy;
use wgpu::{Device, DeviceType};

/// How a GPU finds out what reaches what.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// A depth map for each direction.
    DepthMaps(DepthMaps),
    /// A ray for each point and direction.
    Rays(Rays),
    /// Whichever [`Answered::expected`] holds for faster.
    Auto,
}

/// How a matrix was computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answered {
    /// By [`DepthMaps`].
    DepthMaps,
    /// By [`Rays`].
    Rays,
}

impl Answered {
    /// PLACEHOLDER
    #[must_use]
    pub fn expected(_points: usize, _triangles: usize, _software: bool) -> Self {
        Self::Rays
    }
}

/// How fine the depth maps are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthMaps {
    /// Pixels of each direction's map. More: sharper shadows, and time with the square. `None` for as many as the mesh's edges warrant,
    /// from 128 to 2048.
    pub size_px: Option<u32>,
    /// How much nearer to the light than a point the map must be to occlude it: a factor, 1 by default, on what the slope and the mesh's
    /// roughness around the point ask for (a quarter of a texel where it is flat; `test.wgsl`). Less: contact shadows closer to the
    /// contact, and acne, where a surface shadows itself.
    pub bias: f32,
}

impl Default for DepthMaps {
    fn default() -> Self {
        Self { size_px: None, bias: 1.0 }
    }
}

/// Where rays start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rays {
    /// How far off the surface, in metres, at least 0. More: contacts are lost that are closer. Less: facets of a smooth surface darken one another. `None` for a
    /// ten-thousandth of the triangles' diagonal, or what rounding asks for where that is more.
    pub offset_m: Option<f32>,
}

impl From<DepthMaps> for Method {
    fn from(maps: DepthMaps) -> Self {
        Self::DepthMaps(maps)
    }
}

impl From<Rays> for Method {
    fn from(rays: Rays) -> Self {
        Self::Rays(rays)
    }
}

impl Method {
    /// Which of both it is for a mesh.
    pub(crate) fn answers(self, device: &Device, points: usize, triangles: usize) -> Answered {
        match self {
            Self::DepthMaps(_) => Answered::DepthMaps,
            Self::Rays(_) => Answered::Rays,
            Self::Auto => {
                let limits = device.limits();
                let fits = Hierarchy::bytes(triangles) <= limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
                let software = device.adapter_info().device_type == DeviceType::Cpu;
                if fits { Answered::expected(points, triangles, software) } else { Answered::DepthMaps }
            }
        }
    }

    /// # Errors
    /// An offset that is none.
    pub(crate) fn check(self) -> Result<(), GpuError> {
        if self.rays().offset_m.is_some_and(|offset_m| !(offset_m >= 0.0 && offset_m.is_finite())) {
            return Err(GpuError::Input("rays start off the surface by a finite distance, 0 at the least"));
        }
        Ok(())
    }

    pub(crate) fn maps(self) -> DepthMaps {
        if let Self::DepthMaps(maps) = self { maps } else { DepthMaps::default() }
    }

    pub(crate) fn rays(self) -> Rays {
        if let Self::Rays(rays) = self { rays } else { Rays::default() }
    }
}
