//! What each camera sees of the stone: its uniform, and the draws that culling leaves.

use super::pages::GpuChunk;
use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec3, Vec4};
use std::ops::Range;

/// `View` of view.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ViewUniform {
    /// World to clip space.
    pub clip_from_world: Mat4,
    /// Clip space at the near plane to directions.
    pub direction_from_clip: Mat4,
    /// Direction to the sun; chord to the outside of the disc's edge.
    pub sun_direction: Vec4,
    /// Exposed radiance of the disc; 1 / its edge's width.
    pub sun_disc: Vec4,
    /// Weights of the two sky maps, exposure included.
    pub sky_weights: Vec4,
}

/// Size of `View` in view.wgsl, which a test compares with what the shader's compiler says.
pub const VIEW_BYTES: usize = 2 * 64 + 3 * 16;
const _: () = assert!(size_of::<ViewUniform>() == VIEW_BYTES);

/// One indexed draw.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Draw {
    /// Page of the buffers.
    pub page: usize,
    /// Texture, if any.
    pub texture: Option<u32>,
    /// What is added to each index.
    pub base_vertex: u32,
    /// Range of the page's indices.
    pub indices: Range<u32>,
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

/// Clusters that are not drawn although between two that are: fewer than these indices cost less than another draw.
const BRIDGED_INDICES: u32 = 3 * 128;

/// A block of vertices that a view meets: its chunk, and its number in it.
pub type VisibleBlock = (usize, u16);

/// The draws of all chunks that a view meets, the nearest chunk first, and the blocks of vertices that they show; a block may be
/// told more than once. Clusters that are bridged show nothing, so that their light does not matter.
pub fn cull(chunks: &[GpuChunk], clip_from_world: &Mat4, eye: Vec3, draws: &mut Vec<Draw>, visible: &mut Vec<VisibleBlock>) {
    let planes = frustum_planes(clip_from_world);
    let mut order: Vec<(f32, usize)> = Vec::new();
    for (index, chunk) in chunks.iter().enumerate() {
        let (low, high) = chunk.kept.bounds;
        let (center, half) = ((low + high) * 0.5, (high - low) * 0.5);
        let inside = planes.iter().all(|plane| {
            let normal = plane.truncate();
            normal.dot(center) + plane.w >= -normal.abs().dot(half)
        });
        if inside {
            order.push((eye.distance_squared(eye.clamp(low, high)), index));
        }
    }
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    for (_, index) in order {
        let chunk = &chunks[index];
        let mut open: Option<Range<u32>> = None;
        let mut push = |range: Range<u32>| {
            draws.push(Draw {
                page: chunk.page,
                texture: chunk.texture,
                base_vertex: chunk.base_vertex,
                indices: chunk.first_index + range.start..chunk.first_index + range.end,
            });
        };
        for cluster in &chunk.kept.clusters {
            if cluster.faces_away(eye) || !cluster.meets(&planes) {
                continue;
            }
            visible.extend(cluster.blocks.iter().map(|&block| (index, block)));
            open = match open.take() {
                Some(range) if cluster.indices.start - range.end <= BRIDGED_INDICES => Some(range.start..cluster.indices.end),
                Some(range) => {
                    push(range);
                    Some(cluster.indices.clone())
                }
                None => Some(cluster.indices.clone()),
            };
        }
        if let Some(range) = open {
            push(range);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::daylight::chunk::KeptChunk;
    use crate::daylight::cluster::cluster;
    use std::sync::Arc;

    fn quad_at(center: Vec3, first_index: u32) -> GpuChunk {
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
            }),
            texture: None,
            lit_at: vec![0],
        }
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
        let (mut draws, mut visible) = (Vec::new(), Vec::new());
        cull(&chunks, &clip, Vec3::ZERO, &mut draws, &mut visible);
        assert_eq!(visible, [(1, 0), (0, 0)]);
        assert_eq!(draws.iter().map(|draw| draw.indices.start).collect::<Vec<_>>(), [6, 0]);
        // From behind, the quads show their backs.
        let turned = clip * Mat4::look_at_rh(Vec3::new(0.0, 0.0, -40.0), Vec3::ZERO, Vec3::Y);
        (draws, visible) = (Vec::new(), Vec::new());
        cull(&chunks, &turned, Vec3::new(0.0, 0.0, -40.0), &mut draws, &mut visible);
        assert!(draws.is_empty() && visible.is_empty());
    }
}
