//! What each camera sees of the stone: its uniform, and the draws that culling leaves.

use super::pages::GpuChunk;
use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec2, Vec3, Vec4};

/// `View` of view.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ViewUniform {
    /// World to clip space.
    pub clip_from_world: Mat4,
    /// Clip space at the near plane to directions; to one and the same in a parallel projection.
    pub direction_from_clip: Mat4,
    /// Direction to the sun; chord to the outside of the disc's edge.
    pub sun_direction: Vec4,
    /// Exposed radiance of the disc; 1 / its edge's width.
    pub sun_disc: Vec4,
    /// Weights of the two sky maps, exposure included; 1 where what is guessed is told from what was seen; 1 where details are shown.
    pub sky_weights: Vec4,
    /// The eye, and 1; in a parallel projection 0, for everything is as far from it.
    pub eye: Vec4,
}

/// Size of `View` in view.wgsl, which a test compares with what the shader's compiler says.
pub const VIEW_BYTES: usize = 2 * 64 + 4 * 16;
const _: () = assert!(size_of::<ViewUniform>() == VIEW_BYTES);

/// Where a view is seen from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Eye {
    /// From a point, in perspective.
    At(Vec3),
    /// From afar, along this unit direction: a parallel (orthographic) projection.
    Along(Vec3),
}

impl Eye {
    /// [`ViewUniform::eye`].
    #[must_use]
    pub fn uniform(self) -> Vec4 {
        match self {
            Self::At(eye) => eye.extend(1.0),
            Self::Along(_) => Vec4::ZERO,
        }
    }

    /// How far a box is.
    fn distance(self, (low, high): (Vec3, Vec3)) -> f32 {
        match self {
            Self::At(eye) => eye.distance(eye.clamp(low, high)),
            Self::Along(forward) => forward.dot((low + high) * 0.5) - forward.abs().dot((high - low) * 0.5),
        }
    }
}

/// What a picture is seen by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// The camera.
    pub clip_from_world: Mat4,
    /// Where it is.
    pub eye: Eye,
    /// Pixels of the picture.
    pub size: Vec2,
}

impl Look {
    /// Where details are seen from in these pictures, the first of which is an eye's own: from the middle between both.
    #[must_use]
    pub fn middle(looks: &[Self], own: Eye) -> Eye {
        match looks {
            [Self { eye: Eye::At(a), .. }, Self { eye: Eye::At(b), .. }] => Eye::At((*a + *b) * 0.5),
            _ => own,
        }
    }
}

/// A cluster of a chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ClusterRef {
    /// Index of the chunk.
    pub chunk: u32,
    /// Index of the cluster in it.
    pub cluster: u32,
}

/// Inward planes (left, right, bottom, top, near) of a view with reversed depth, with unit normals.
#[must_use]
pub fn frustum_planes(clip_from_world: &Mat4) -> [Vec4; 5] {
    let rows = clip_from_world.transpose();
    let (x, y, z, w) = (rows.x_axis, rows.y_axis, rows.z_axis, rows.w_axis);
    [w + x, w - x, w + y, w - y, w - z].map(|plane| {
        let length = plane.truncate().length();
        if length > 0.0 { plane / length } else { plane }
    })
}

/// The clusters that any of these views meets, in the order in which they are drawn: those that show a front, the chunk that is nearest to the first view
/// first; then those that show nothing but backs, unless they are part of a closed body. Stone is seen from both sides, but most backs lie
/// behind fronts, and there the depth test refuses them before they are shaded.
#[must_use]
pub fn cull(chunks: &[GpuChunk], looks: &[Look]) -> Vec<ClusterRef> {
    let Some(first) = looks.first() else { return Vec::new() };
    let planes: Vec<[Vec4; 5]> = looks.iter().map(|look| frustum_planes(&look.clip_from_world)).collect();
    let mut order: Vec<(f32, usize)> = Vec::new();
    for (index, chunk) in chunks.iter().enumerate() {
        let (low, high) = chunk.kept.bounds;
        let (center, half) = ((low + high) * 0.5, (high - low) * 0.5);
        let is_inside = |planes: &[Vec4; 5]| {
            planes.iter().all(|plane| {
                let normal = plane.truncate();
                normal.dot(center) + plane.w >= -normal.abs().dot(half)
            })
        };
        if planes.iter().any(is_inside) {
            order.push((first.eye.distance((low, high)), index));
        }
    }
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let (mut seen, mut backs) = (Vec::new(), Vec::new());
    for (_, index) in order {
        for (number, cluster) in chunks[index].kept.clusters.iter().enumerate() {
            if planes.iter().any(|planes| cluster.meets(planes)) {
                let side = match looks.iter().all(|look| cluster.faces_away(look.eye)) {
                    true if chunks[index].closed => continue,
                    true => &mut backs,
                    false => &mut seen,
                };
                side.push(ClusterRef { chunk: index as u32, cluster: number as u32 });
            }
        }
    }
    seen.append(&mut backs);
    seen
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::daylight::chunk::KeptChunk;
    use crate::daylight::cluster::cluster;
    use crate::daylight::seen::{Draw, Seen};
    use std::sync::{Arc, OnceLock};

    /// A square of two metres and two triangles.
    pub fn quad_at(center: Vec3, first_index: u32) -> GpuChunk {
        let positions: Vec<Vec3> =
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| center + Vec3::new(x, y, 0.0)).into();
        let made = cluster(&positions, &[[0, 1, 2], [0, 2, 3]]);
        GpuChunk {
            page: 0,
            base_vertex: 0,
            first_index,
            kept: Arc::new(KeptChunk {
                bounds: (center - Vec3::new(1.0, 1.0, 0.0), center + Vec3::new(1.0, 1.0, 0.0)),
                positions,
                indices: made.indices,
                clusters: made.clusters,
                albedo: vec![u32::MAX; 4],
            }),
            parts: OnceLock::new(),
            part: 0,
            texture: None,
            detail: None,
            kind: crate::daylight::pipelines::StoneKind::Plain,
            closed: false,
            lit_at: vec![0],
        }
    }

    fn look(clip_from_world: Mat4, eye: Eye) -> Look {
        Look { clip_from_world, eye, size: Vec2::new(1024.0, 768.0) }
    }

    #[test]
    fn what_one_eye_of_two_sees_is_kept_for_both() {
        let x = |x: f32| quad_at(Vec3::new(x, 0.0, -4.0), 0);
        let mut chunks = [x(-4.0), x(0.0), x(4.0), x(40.0)];
        let clip = Mat4::perspective_infinite_reverse_rh(1.0, 1.0, 0.1);
        let eye = |x: f32| look(clip * Mat4::from_translation(Vec3::NEG_X * x), Eye::At(Vec3::X * x));
        let of = |looks: &[Look], chunks: &[GpuChunk]| cull(chunks, looks).iter().map(|one| one.chunk).collect::<Vec<_>>();
        assert_eq!((of(&[eye(-1.5)], &chunks), of(&[eye(1.5)], &chunks)), (vec![1, 0], vec![1, 2]));
        assert_eq!(of(&[eye(-1.5), eye(1.5)], &chunks), [1, 0, 2]);
        // A back of a closed body that one of them sees the front of.
        for chunk in &mut chunks {
            chunk.closed = true;
        }
        let behind = look(
            clip * Mat4::from_rotation_y(std::f32::consts::PI) * Mat4::from_translation(Vec3::Z * 8.0),
            Eye::At(Vec3::Z * -8.0),
        );
        assert!(of(&[behind], &chunks).is_empty());
        assert_eq!(of(&[eye(0.0), behind], &chunks)[..1], [1]);
        assert_eq!(Look::middle(&[eye(-1.0), eye(2.0)], Eye::At(Vec3::ZERO)), Eye::At(Vec3::X * 0.5));
    }

    #[test]
    fn culling_keeps_what_is_seen_and_sorts_it_by_distance() {
        let chunks = [
            quad_at(Vec3::new(0.0, 0.0, -20.0), 0),
            quad_at(Vec3::new(0.0, 0.0, -5.0), 6),
            quad_at(Vec3::new(0.0, 0.0, 5.0), 12),
            quad_at(Vec3::new(40.0, 0.0, -5.0), 18),
        ];
        let clip = Mat4::perspective_infinite_reverse_rh(1.0, 1.0, 0.1);
        let seen = cull(&chunks, &[look(clip, Eye::At(Vec3::ZERO))]);
        assert_eq!(seen.iter().map(|one| one.chunk).collect::<Vec<_>>(), [1, 0]);
        assert_eq!(Seen::clusters(&chunks, &seen, &[]).draws, [1, 0].map(|chunk| Draw { chunk, indices: 0..6 }));
    }

    #[test]
    fn backs_come_last_however_near() {
        let mut chunks = [quad_at(Vec3::new(0.0, 0.0, -5.0), 0), quad_at(Vec3::new(0.0, 0.0, -20.0), 6)];
        let mut turned = (*chunks[0].kept).clone();
        turned.clusters[0].cone_axis *= -1.0;
        chunks[0].kept = Arc::new(turned);
        let clip = Mat4::perspective_infinite_reverse_rh(1.0, 1.0, 0.1);
        let seen = cull(&chunks, &[look(clip, Eye::At(Vec3::ZERO))]);
        assert_eq!(seen.iter().map(|one| one.chunk).collect::<Vec<_>>(), [1, 0]);
        chunks[0].closed = true;
        let seen = cull(&chunks, &[look(clip, Eye::At(Vec3::ZERO))]);
        assert_eq!(seen.iter().map(|one| one.chunk).collect::<Vec<_>>(), [1]);
    }

    #[test]
    fn parallel_views_see_stone_beside_and_behind_the_eye() {
        // A plan from above: the camera looks down, and what lies far from its axis shows its front as what lies on it.
        let chunks = [quad_at(Vec3::new(30.0, 0.0, -5.0), 0), quad_at(Vec3::new(-30.0, 0.0, 20.0), 6)];
        let clip = Mat4::orthographic_rh(-40.0, 40.0, -40.0, 40.0, 100.0, -100.0);
        for (forward, wanted) in [(Vec3::NEG_Z, [1, 0]), (Vec3::Z, [0, 1])] {
            let seen = cull(&chunks, &[look(clip, Eye::Along(forward))]);
            assert_eq!(seen.iter().map(|one| one.chunk).collect::<Vec<_>>(), wanted);
        }
        let mut closed = chunks;
        closed.iter_mut().for_each(|chunk| chunk.closed = true);
        for (forward, wanted) in [(Vec3::NEG_Z, 2), (Vec3::Z, 0)] {
            let seen = cull(&closed, &[look(clip, Eye::Along(forward))]);
            assert_eq!(seen.len(), wanted);
        }
    }
}
