//! What cover.wgsl reads, as the processor writes it.

use super::subject::{LAYERS, Subject};
use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Vec3, Vec4};

/// Things that may be covered, faded or marked at one time, and the one that is not; `COVERS` in cover.wgsl. All of it stays below the 64 KiB that a uniform may have.
pub const SLOTS: usize = 160;

/// Bits of an instance's number that tell which actor it is; the others tell what it wears.
pub const OWN_BITS: u32 = 4;

/// `Cover` of cover.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct CoverUniform {
    local_from_world: [Vec4; 3],
    front: [Vec4; LAYERS],
    coat: [Vec4; LAYERS],
    kind: [Vec4; LAYERS],
    look: Vec4,
    around: [Vec4; 7],
}

/// Size of `Cover`, which a test compares with what the shader's compiler says.
pub const COVER_BYTES: usize = size_of::<CoverUniform>();

/// What `Covers` of cover.wgsl begins with.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct CoversHead {
    /// Unit direction to the sun.
    pub sun_direction: Vec4,
    /// Its exposed irradiance at normal incidence / pi.
    pub sun_over_pi: Vec4,
    /// What marks shine in; their pulse.
    pub mark: Vec4,
}

/// Size of `Covers`, likewise.
pub const COVERS_BYTES: usize = size_of::<CoversHead>() + SLOTS * COVER_BYTES;
const _: () = assert!(COVERS_BYTES <= 64 << 10);

/// Patches in which a layer spreads, for each length of what it spreads over.
const PATCHES: f32 = 14.0;

/// How large something is, and what its own colour is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// To its own space; that of parts is the world.
    pub local_from_world: Affine3A,
    /// Its box in that space, least and greatest corner.
    pub bounds: (Vec3, Vec3),
    /// The mean luminance of its albedo, without a texture.
    pub mean: f32,
}

impl Default for Extent {
    fn default() -> Self {
        Self { local_from_world: Affine3A::IDENTITY, bounds: (Vec3::ZERO, Vec3::ONE), mean: 0.5 }
    }
}

impl CoverUniform {
    /// Of something of an extent, with the radiance around it.
    #[must_use]
    pub fn new(subject: &Subject, extent: &Extent, around: [Vec3; 7]) -> Self {
        let mut uniform = Self::zeroed();
        let rows = glam::Mat4::from(extent.local_from_world).transpose();
        uniform.local_from_world = [rows.x_axis, rows.y_axis, rows.z_axis];
        let (low, high) = extent.bounds;
        for (i, layer) in subject.layers.iter().enumerate() {
            let Some(layer) = layer else { continue };
            uniform.front[i] = match layer.origin {
                // as far as its farthest corner is
                Some(origin) => {
                    let far = (low - origin).abs().max((high - origin).abs()).length();
                    origin.extend(1.0 / far.max(1e-3))
                }
                None => Vec3::new(0.0, low.y, 0.0).extend(-1.0 / (high.y - low.y).max(1e-3)),
            };
            let material = &layer.material;
            uniform.coat[i] = Vec3::from(material.albedo.map(|v| v as f32)).extend(layer.amount());
            uniform.kind[i] = Vec4::new(material.grain as f32, material.metal as f32, 0.0, 0.0);
        }
        let patches = PATCHES / low.distance(high).max(1e-3);
        uniform.look = Vec4::new(subject.opacity(), subject.mark(), extent.mean, patches);
        uniform.around = around.map(|radiance| radiance.extend(0.0));
        uniform
    }
}
