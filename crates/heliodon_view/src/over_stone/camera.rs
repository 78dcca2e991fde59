//! The cameras of what is laid over the stone: what their shaders know of them, and what they are on the GPU.

use super::SeenCamera;
use crate::tonemap::{DisplayKey, ToneCurve};
use bevy::ecs::query::QueryItem;
use bevy::prelude::*;
use bevy::render::render_resource::binding_types::{texture_depth_2d, texture_depth_2d_multisampled, uniform_buffer_sized};
use bevy::render::render_resource::*;
use bevy::render::renderer::{RenderDevice, RenderQueue};
use bevy::render::view::ViewDepthTexture;
use bytemuck::{Pod, Zeroable};
use std::num::NonZeroU64;

/// `Camera` of camera.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct CameraUniform {
    pub clip_from_world: Mat4,
    pub eye: Vec4,
    pub forward: Vec4,
    pub depth: Vec4,
    pub sun_direction: Vec4,
    pub sun_over_pi: Vec4,
    pub shadow: Vec4,
    pub world_from_clip: Mat4,
    pub viewport: Vec4,
}

/// Size of `Camera` in camera.wgsl, which a test compares with what the shader's compiler says.
pub const CAMERA_BYTES: usize = size_of::<CameraUniform>();

/// Distance at which the eye of a parallel projection is taken to be, metres: rays of somebody two metres wide then differ by less than a thousandth.
const FAR_M: f32 = 4000.0;

impl CameraUniform {
    /// A camera with its projection, of a picture that begins at a pixel and has so many.
    #[must_use]
    pub fn new(world_from_view: Mat4, clip_from_view: Mat4, clip_from_world: Mat4, (corner, size): (Vec2, Vec2)) -> Self {
        let forward = -world_from_view.z_axis.truncate();
        let at = world_from_view.w_axis.truncate();
        let parallel = clip_from_view.w_axis.w == 1.0;
        let eye = if parallel { at - forward * FAR_M } else { at };
        // With w = d and z_clip = -a d + b, z is b / d - a, so that d is b / (z + a); in parallel projections z is -a d + b itself.
        let (a, b) = (clip_from_view.z_axis.z, clip_from_view.w_axis.z);
        let pixels = clip_from_view.y_axis.y * 0.5 * size.y;
        let depth = if parallel {
            // (z - b) / -a, as (x z + y) / (z + w) with w large
            let large = 1e7;
            Vec4::new(-large / a, b * large / a, pixels * FAR_M, large)
        } else {
            Vec4::new(0.0, b, pixels, a)
        };
        Self {
            clip_from_world,
            eye: eye.extend(1.0),
            forward: forward.extend(-forward.dot(at)),
            depth,
            sun_direction: Vec4::ZERO,
            sun_over_pi: Vec4::ZERO,
            shadow: Vec4::Y,
            world_from_clip: clip_from_world.inverse(),
            viewport: Vec4::new(corner.x, corner.y, 2.0 / size.x.max(1.0), 2.0 / size.y.max(1.0)),
        }
    }

    /// Under a sun of this exposed irradiance at normal incidence, and shadows from a direction.
    #[must_use]
    pub fn under(self, sun_direction: Vec3, sun_irradiance: Vec3, shadow: Vec3) -> Self {
        let sun_over_pi = (sun_irradiance * std::f32::consts::FRAC_1_PI).extend(0.0);
        Self { sun_direction: sun_direction.extend(0.0), sun_over_pi, shadow: shadow.extend(0.0), ..self }
    }
}

/// A camera whose picture something can be laid over.
pub struct Seen<'a> {
    /// It in the render world, and in the main one.
    pub entities: (Entity, Entity),
    /// Where its picture begins, and its size, pixels.
    pub corner: UVec2,
    /// See `corner`.
    pub size: UVec2,
    /// Samples of a pixel.
    pub samples: u32,
    /// What its target shows.
    pub display: DisplayKey,
    /// World to clip space.
    pub clip_from_world: Mat4,
    /// What shaders know of it, without any light.
    pub uniform: CameraUniform,
    /// Its depth.
    pub depth: &'a ViewDepthTexture,
}

impl<'a> Seen<'a> {
    /// None of a camera that draws nowhere, or whose depth cannot be read yet.
    pub fn new(
        (entity, main, camera, camera_3d, view, msaa, depth): QueryItem<'a, 'a, SeenCamera>,
        curve: ToneCurve,
    ) -> Option<Self> {
        // Bevy gives depth its usages a frame after they are asked for.
        let readable = TextureUsages::from(camera_3d.depth_texture_usages).contains(TextureUsages::TEXTURE_BINDING)
            && depth.texture.usage().contains(TextureUsages::TEXTURE_BINDING);
        let size = camera.physical_viewport_size.filter(|_| readable)?;
        let corner = camera.viewport.as_ref().map_or(UVec2::ZERO, |viewport| viewport.physical_position);
        let world_from_view = view.world_from_view.to_matrix();
        let clip_from_world = view.clip_from_world.unwrap_or_else(|| view.clip_from_view * world_from_view.inverse());
        let uniform =
            CameraUniform::new(world_from_view, view.clip_from_view, clip_from_world, (corner.as_vec2(), size.as_vec2()));
        let display = DisplayKey { curve, format: view.target_format };
        Some(Self {
            entities: (entity, main.id()),
            corner,
            size,
            samples: msaa.samples(),
            display,
            clip_from_world,
            uniform,
            depth,
        })
    }
}

/// How passes are bound to a camera.
pub struct CameraLayouts {
    /// To it and its depth: with one sample a pixel, and with several.
    pub over: [BindGroupLayoutDescriptor; 2],
    /// To it alone, where its depth is written.
    pub solid: BindGroupLayoutDescriptor,
}

impl Default for CameraLayouts {
    fn default() -> Self {
        let camera = || uniform_buffer_sized(false, NonZeroU64::new(CAMERA_BYTES as u64));
        let over = |depth| {
            let entries = BindGroupLayoutEntries::sequential(ShaderStages::VERTEX_FRAGMENT, (camera(), depth));
            BindGroupLayoutDescriptor::new("over_camera", &entries)
        };
        let alone = BindGroupLayoutEntries::single(ShaderStages::VERTEX, camera());
        Self {
            over: [over(texture_depth_2d()), over(texture_depth_2d_multisampled())],
            solid: BindGroupLayoutDescriptor::new("over_camera_solid", &alone),
        }
    }
}

/// A camera on the GPU, bound as [`CameraLayouts`] say.
pub struct BoundCamera {
    uniform: Buffer,
    /// With its depth.
    pub over: BindGroup,
    /// Without it.
    pub solid: BindGroup,
}

impl BoundCamera {
    /// Writes what shaders know of a camera, and binds the depth that it has in this frame.
    pub fn write(
        before: Option<Self>,
        (device, queue): (&RenderDevice, &RenderQueue),
        cache: &PipelineCache,
        layouts: &CameraLayouts,
        (seen, uniform): (&Seen<'_>, &CameraUniform),
    ) -> Self {
        let buffer = before.map(|camera| camera.uniform).unwrap_or_else(|| {
            let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
            let size = CAMERA_BYTES as u64;
            device.create_buffer(&BufferDescriptor { label: Some("over_camera"), size, usage, mapped_at_creation: false })
        });
        queue.write_buffer(&buffer, 0, bytemuck::bytes_of(uniform));
        let layout = cache.get_bind_group_layout(&layouts.over[usize::from(seen.samples > 1)]);
        let entries = BindGroupEntries::sequential((buffer.as_entire_binding(), seen.depth.view()));
        let over = device.create_bind_group("over_camera", &layout, &entries);
        let layout = cache.get_bind_group_layout(&layouts.solid);
        let solid = device.create_bind_group("over_camera", &layout, &BindGroupEntries::single(buffer.as_entire_binding()));
        Self { uniform: buffer, over, solid }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_are_metres_along_forward() {
        let world_from_view = Mat4::from_translation(Vec3::new(1.0, 2.0, 3.0)) * Mat4::from_rotation_y(0.7);
        let projections = [
            Mat4::perspective_infinite_reverse_rh(1.0, 1.3, 0.1),
            Mat4::perspective_rh(1.0, 1.3, 80.0, 0.1),
            Mat4::orthographic_rh(-4.0, 4.0, -3.0, 3.0, 80.0, 0.1),
        ];
        for clip_from_view in projections {
            let clip_from_world = clip_from_view * world_from_view.inverse();
            let camera =
                CameraUniform::new(world_from_view, clip_from_view, clip_from_world, (Vec2::ZERO, Vec2::new(1024.0, 768.0)));
            for metres in [0.5, 3.0, 40.0] {
                let place = world_from_view.transform_point3(Vec3::new(0.3, -0.2, -metres));
                let clip = clip_from_world * place.extend(1.0);
                let z = clip.z / clip.w;
                let found = (camera.depth.x * z + camera.depth.y) / (z + camera.depth.w);
                assert!((found - metres).abs() < 2e-3 * metres, "{clip_from_view}: {found} for {metres}");
                let own = camera.forward.truncate().dot(place) + camera.forward.w;
                assert!((own - metres).abs() < 1e-4 * metres.max(1.0));
            }
        }
    }
}
