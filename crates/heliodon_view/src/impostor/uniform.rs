//! What impostor.wgsl reads, as the processor writes it.

use bevy::math::{Mat4, Vec2, Vec3, Vec4};
use bytemuck::{Pod, Zeroable};
use heliodon_bundle::impostor::{Choice, ImpostorInfo, MAX_VIEWS};

/// `Camera` of impostor.wgsl.
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

/// Size of `Camera` in impostor.wgsl, which a test compares with what the shader's compiler says.
pub const CAMERA_BYTES: usize = size_of::<CameraUniform>();

/// `Person` of impostor.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PersonUniform {
    pub place: Vec4,
    pub turn: Vec4,
    pub light: [Vec4; 6],
    pub shadow: Vec4,
    pub worn: Vec4,
}

/// Size of `Person`.
pub const PERSON_BYTES: usize = size_of::<PersonUniform>();

/// An entry of `order`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct SeenUniform {
    person: u32,
    views: u32,
    weights: [u32; 2],
}

/// Size of an entry of `order`.
pub const SEEN_BYTES: usize = size_of::<SeenUniform>();

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
struct ViewUniform {
    right: Vec4,
    up: Vec4,
    toward: Vec4,
    window: Vec4,
}

/// `Kind` of impostor.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct KindUniform {
    reach: Vec4,
    frame: Vec4,
    views: [ViewUniform; MAX_VIEWS as usize],
}

/// Size of `Kind`.
pub const KIND_BYTES: usize = size_of::<KindUniform>();

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

impl SeenUniform {
    /// A person in the views that were chosen.
    #[must_use]
    pub fn new(person: u32, choice: &Choice) -> Self {
        let views = choice.views.iter().zip(0..).fold(0, |all, (view, k)| all | (view & 255) << (8 * k));
        let code = |weight: f32| (weight.clamp(0.0, 1.0) * 65535.0 + 0.5) as u32;
        let [a, b, c, d] = choice.weights.map(code);
        Self { person, views, weights: [a | b << 16, c | d << 16] }
    }
}

impl KindUniform {
    /// What stays of an impostor whose texture has so many levels.
    #[must_use]
    pub fn new(info: &ImpostorInfo, levels: u32) -> Self {
        let mut uniform = Self::zeroed();
        let [low, high] = info.heights_m;
        uniform.reach = Vec4::new(info.radius_m, info.around_m, 0.5 * (high - low).max(1e-4), 0.0);
        let [columns, rows] = info.grid;
        let [left, bottom, right, top] = info.windows_m.first().copied().unwrap_or([0.0, 0.0, 1.0, 1.0]);
        // the denser of the two directions, so that neither is blurred
        let texels = (info.frame_px[0] as f32 / (right - left)).min(info.frame_px[1] as f32 / (top - bottom));
        uniform.frame = Vec4::new(1.0 / columns as f32, 1.0 / rows as f32, texels, levels.saturating_sub(1) as f32);
        for ((view, [right, up, toward]), window) in uniform.views.iter_mut().zip(info.view_axes()).zip(&info.windows_m) {
            *view = ViewUniform {
                right: right.extend(window[0]),
                up: up.extend(window[3]),
                toward: toward.extend(0.0),
                window: Vec4::new(1.0 / (window[2] - window[0]), 1.0 / (window[3] - window[1]), 0.0, 0.0),
            };
        }
        uniform
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

    #[test]
    fn choices_are_packed_without_loss_that_shows() {
        let choice = Choice { views: [127, 3, 0, 64], weights: [0.6, 0.25, 0.1, 0.05] };
        let seen = SeenUniform::new(9, &choice);
        assert_eq!((seen.person, seen.views), (9, 127 | 3 << 8 | 64 << 24));
        let weight = |word: u32, shift: u32| (word >> shift & 0xffff) as f32 / 65535.0;
        let back =
            [weight(seen.weights[0], 0), weight(seen.weights[0], 16), weight(seen.weights[1], 0), weight(seen.weights[1], 16)];
        assert!(back.iter().zip(choice.weights).all(|(a, b)| (a - b).abs() < 1e-4));
    }
}
