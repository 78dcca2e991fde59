//! What is seen of an impostor, computed on the processor: the reference of the viewer's shader.

use super::{Choice, Impostor, ImpostorInfo};
use glam::{Vec2, Vec3, Vec4};

/// How much of a texel is covered, at least, where its depth leads anywhere.
const COVERED: f32 = 0.02;
/// Rays more aslant to a picture than this, as the cosine, are not followed to its depth.
const ASLANT: f32 = 0.3;

/// Decoded texels of an impostor, to be looked at.
#[derive(Clone, Debug)]
pub struct Look {
    info: ImpostorInfo,
    axes: Vec<[Vec3; 3]>,
    size: [u32; 2],
    layers: Vec<Vec<[u8; 4]>>,
}

/// What a ray finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Looked {
    /// Linear albedo.
    pub albedo: Vec3,
    /// The covered part, 0 to 1.
    pub cover: f32,
    /// Unit normal in the model's space.
    pub normal: Vec3,
    /// How much of the sky the model leaves to it, 0 to 1.
    pub openness: f32,
    /// Where, in the model's space.
    pub place: Vec3,
}

impl Look {
    /// Decodes all texels of the finest level.
    #[must_use]
    pub fn new(impostor: &Impostor) -> Self {
        let info = impostor.info.clone();
        let layers = (0..impostor.texture.layers).map(|layer| impostor.layer(layer, 0).1).collect();
        let axes = info.view_axes().collect();
        Self { size: info.layer_px(), info, axes, layers }
    }

    /// What it is.
    #[must_use]
    pub fn info(&self) -> &ImpostorInfo {
        &self.info
    }

    /// What a ray from an eye along a unit direction sees of a frame, both in the model's space, in the chosen views, each looked for `steps` times by its depths; none
    /// where it misses the model's sphere.
    #[must_use]
    pub fn at(&self, frame: u32, choice: &Choice, eye: Vec3, direction: Vec3, steps: u32) -> Option<Looked> {
        let middle = self.info.middle();
        let facing = (eye - middle).try_normalize()?;
        let along = direction.dot(facing);
        if along >= 0.0 {
            return None;
        }
        let start = eye + direction * ((middle - eye).dot(facing) / along) - middle;
        if start.length() > self.info.radius_m * 1.05 {
            return None;
        }
        let (mut sum, mut covered) = ([Vec4::ZERO; 3], 0.0);
        let mut openness = 0.0;
        for (&view, &weight) in choice.views.iter().zip(&choice.weights).filter(|(_, weight)| **weight > 0.0) {
            let [right, up, toward] = *self.axes.get(view as usize)?;
            let mut at = start;
            let slope = direction.dot(toward);
            for _ in 0..steps {
                let shape = self.texel(2 * view + 1, frame, view, Vec2::new(at.dot(right), at.dot(up)));
                let Some(shape) = shape.filter(|_| slope < -ASLANT) else { break };
                let depth = (shape.w * 2.0 - 1.0) * self.info.radius_m;
                at += direction * ((depth - at.dot(toward)) / slope).clamp(-self.info.radius_m, self.info.radius_m);
            }
            let place = Vec2::new(at.dot(right), at.dot(up));
            let Some((color, shape)) =
                self.texel(2 * view, frame, view, place).zip(self.texel(2 * view + 1, frame, view, place))
            else {
                continue;
            };
            let part = weight * color.w;
            covered += part;
            let across = Vec2::new(shape.x, shape.y) * 2.0 - 1.0;
            let normal = right * across.x + up * across.y + toward * (1.0 - across.length_squared()).max(0.0).sqrt();
            sum[0] += (color * color) * part;
            sum[1] += normal.extend(0.0) * part;
            sum[2] += at.extend(0.0) * part;
            openness += shape.z * part;
        }
        let whole = 1.0 / covered.max(1e-6);
        let seen = covered > COVERED * 0.1;
        seen.then(|| Looked {
            albedo: sum[0].truncate() * whole,
            cover: covered.min(1.0),
            normal: sum[1].truncate().try_normalize().unwrap_or(facing),
            openness: openness * whole,
            place: sum[2].truncate() * whole + middle,
        })
    }

    /// A texel at a place of a view's picture, between the four around it; none outside of its window.
    fn texel(&self, layer: u32, frame: u32, view: u32, place: Vec2) -> Option<Vec4> {
        let [left, bottom, right, top] = *self.info.windows_m.get(view as usize)?;
        let part = Vec2::new((place.x - left) / (right - left), (top - place.y) / (top - bottom));
        if !(part.cmpge(Vec2::ZERO).all() && part.cmple(Vec2::ONE).all()) {
            return None;
        }
        let [width, height] = self.info.frame_px;
        let corner = self.info.frame_corner(frame) * Vec2::new(self.size[0] as f32, self.size[1] as f32);
        let at = part * Vec2::new(width as f32, height as f32) - 0.5;
        let first = at.floor();
        let share = at - first;
        let texels = self.layers.get(layer as usize)?;
        let one = |dx: f32, dy: f32| {
            let within = (first + Vec2::new(dx, dy)).clamp(Vec2::ZERO, Vec2::new(width as f32 - 1.0, height as f32 - 1.0));
            let [x, y] = (corner + within).to_array().map(|v| v as usize);
            Vec4::from(texels[y * self.size[0] as usize + x].map(|code| f32::from(code) / 255.0))
        };
        Some(one(0.0, 0.0).lerp(one(1.0, 0.0), share.x).lerp(one(0.0, 1.0).lerp(one(1.0, 1.0), share.x), share.y))
    }
}
