//! By rays or by depth maps.

use crate::GpuError;
use crate::hierarchy::Hierarchy;
use wgpu::Device;

/// How a GPU finds out what reaches what.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// A depth map for each direction.
    DepthMaps(DepthMaps),
    /// A ray for each point and direction.
    Rays(Rays),
    /// What [`Answered::expected`] says; depth maps where the hierarchy of the triangles is more than a binding of the device holds.
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
    /// Which of both is expected to be faster for a mesh, however many directions are asked: all that either does, it does for each of them.
    ///
    /// A ray visits about twice `log2(triangles)` boxes, and half of a mesh's points face a direction: `points log2(triangles)` visits. A depth map sets each triangle up,
    /// draws its texels (some eighteen, half of them hidden), and looks four up for each point. Argued and not measured on a GPU of its own: one that visits 15,000 million boxes
    /// in a second (500 million rays of 30) sets up 1,500 million small triangles and fills 50,000 million texels, so that a triangle costs 13 visits.
    ///
    /// So rays, wherever a mesh has not many more points than triangles. Measured on software Vulkan (llvmpipe, two cores), where rays are no slower either: a walker's 8,415
    /// vertices and 15,898 triangles from 258 directions 0.76 s by rays and 1.26 by maps, 35,112 and 69,168 of a pebble 3.59 and 3.65, from 1,026 directions 15.8 and 18.0.
    /// A processor's own rays take a twentieth. Where points are many more than triangles nothing was measured.
    #[must_use]
    pub fn expected(points: usize, triangles: usize) -> Self {
        let (points, triangles) = (points as f64, triangles as f64);
        if points * triangles.max(2.0).log2() <= 13.0 * triangles + 4.0 * points { Self::Rays } else { Self::DepthMaps }
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
                if fits { Answered::expected(points, triangles) } else { Answered::DepthMaps }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_are_asked_by_rays_and_many_points_over_few_triangles_by_depth_maps() {
        for (points, triangles) in [(0, 0), (3, 1), (35_000, 70_000), (1_000_000, 2_000_000)] {
            assert_eq!(Answered::expected(points, triangles), Answered::Rays, "{points} {triangles}");
        }
        assert_eq!(Answered::expected(1_000_000, 1000), Answered::DepthMaps);
    }
}
