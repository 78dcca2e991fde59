//! What a moving eye need not draw: triangles behind nearer stone or between the pixels' centres.
//!
//! Where a processor draws, every triangle costs, and most of what a moving eye faces does not show. A frame of such an eye draws
//! the triangles first that the frame before showed, reads their depth, and then, of all others, those that may lie before it
//! (two-pass occlusion culling). A cluster or a triangle is left out only if its bounding box holds no pixel's centre or lies
//! behind the depth of every one that it holds: the picture is the one with all triangles. The frame waits for the depth; a
//! driver on the processor waits between two passes anyway.

use super::chunk::KeptChunk;
use super::cluster::Cluster;
use super::layout::GROUP;
use super::pages::GpuChunk;
use super::seen::{NumberSet, Seen};
use super::view::ClusterRef;
use crate::readback::TextureReadback;
use bevy::prelude::UVec4;
use bevy::render::renderer::RenderDevice;
use bevy::tasks::ComputeTaskPool;
use glam::{Mat4, UVec2, Vec2, Vec3, Vec3A};
use wgpu::{CommandEncoder, PollType, Texture};

/// Frames with fewer triangles draw all of them: waiting for the depth would cost more.
pub const LEAST_TRIANGLES: u64 = 50_000;

/// Pixels of a tile's side.
const TILE: u32 = 4;

/// Boxes of more pixels are held against tiles.
const MOST_PIXELS: u32 = 64;

/// How far a vertex may move when it is drawn, in pixels: Vulkan promises four bits below the pixel.
const SNAP_PX: f32 = 1.0 / 16.0;

/// What rounding may make of a depth, relative. Slivers are interpolated with large slopes.
const DEPTH_SLACK: f32 = 1e-3;

/// A camera's depth, where the processor can read it.
#[derive(Debug)]
pub struct DepthReadback(TextureReadback);

impl DepthReadback {
    /// For pictures of this size.
    #[must_use]
    pub fn new(device: &RenderDevice, size: UVec2) -> Self {
        Self(TextureReadback::new(device, "stone_depth", size, size_of::<f32>() as u32))
    }

    /// The size of its pictures.
    #[must_use]
    pub fn size(&self) -> UVec2 {
        self.0.size()
    }

    /// Copies `depth` here.
    pub fn copy(&self, encoder: &mut CommandEncoder, depth: &Texture) {
        self.0.copy(encoder, depth);
    }

    /// Waits for what was copied and submitted, and looks at it; `None` if there is none to be had.
    pub fn read<T>(&self, device: &RenderDevice, viewport: UVec4, look: impl FnOnce(&DepthPicture<'_>) -> T) -> Option<T> {
        let size = self.size();
        if viewport.x + viewport.z > size.x || viewport.y + viewport.w > size.y {
            return None;
        }
        self.0.map(|_| {});
        device.wgpu_device().poll(PollType::wait_indefinitely()).ok()?;
        let mapped = self.0.mapped();
        let stride = self.0.padded_bytes() / size_of::<f32>();
        let found = look(&DepthPicture::new(bytemuck::cast_slice(&mapped), stride, viewport));
        drop(mapped);
        self.0.unmap();
        Some(found)
    }
}

/// What may show of `clusters`, and of that what is not in `known` (of each chunk), if something is known.
#[must_use]
pub fn may_show(
    chunks: &[GpuChunk],
    clusters: &[ClusterRef],
    known: Option<&[NumberSet]>,
    picture: &DepthPicture<'_>,
    clip_from_world: &Mat4,
) -> (Seen, Seen) {
    let found: Vec<(u32, Vec<u32>, Vec<u32>)> = ComputeTaskPool::get().scope(|scope| {
        for group in clusters.chunk_by(|a, b| a.chunk == b.chunk) {
            let chunk = group[0].chunk;
            let kept = &chunks[chunk as usize].kept;
            scope.spawn(async move {
                let clusters = group.iter().map(|one| &kept.clusters[one.cluster as usize]);
                let shown = picture.may_show(kept, clusters, clip_from_world);
                let new = known.map_or_else(Vec::new, |known| {
                    shown.iter().copied().filter(|&number| !known[chunk as usize].contains(number)).collect()
                });
                (chunk, shown, new)
            });
        }
    });
    let shown = Seen::triangles(chunks, found.iter().map(|(chunk, shown, _)| (*chunk, &shown[..])));
    (shown, Seen::triangles(chunks, found.iter().map(|(chunk, _, new)| (*chunk, &new[..]))))
}

/// The depth of a view's pixels, and the farthest in each tile. Depth is reversed: 0 where nothing is.
#[derive(Clone, Debug)]
pub struct DepthPicture<'a> {
    /// From the view's first pixel on.
    depth: &'a [f32],
    stride: usize,
    size: UVec2,
    columns: usize,
    farthest: Vec<f32>,
}

impl<'a> DepthPicture<'a> {
    /// Of the pixels in `viewport` (left, top, width, height) of a picture with rows of `stride`.
    #[must_use]
    pub fn new(depth: &'a [f32], stride: usize, viewport: UVec4) -> Self {
        let [left, top, width, height] = viewport.to_array().map(|v| v as usize);
        let depth = &depth[top * stride + left..];
        let columns = width.div_ceil(TILE as usize);
        let mut farthest = vec![f32::INFINITY; columns * height.div_ceil(TILE as usize)];
        for (y, row) in depth.chunks(stride).take(height).enumerate() {
            let tiles = &mut farthest[y / TILE as usize * columns..][..columns];
            for (tile, pixels) in tiles.iter_mut().zip(row[..width].chunks(TILE as usize)) {
                *tile = pixels.iter().fold(*tile, |least, &depth| least.min(depth));
            }
        }
        Self { depth, stride, size: UVec2::new(viewport.z, viewport.w), columns, farthest }
    }

    /// Numbers of the triangles of `clusters` that may show.
    fn may_show<'c>(&self, chunk: &KeptChunk, clusters: impl Iterator<Item = &'c Cluster>, clip_from_world: &Mat4) -> Vec<u32> {
        let size = self.size.as_vec2();
        let to_pixels = Mat4::from_translation((size * 0.5).extend(0.0))
            * Mat4::from_scale(Vec3::new(size.x * 0.5, size.y * -0.5, 1.0))
            * *clip_from_world;
        let mut points: Vec<Vec3A> = vec![Vec3A::ZERO; chunk.positions.len()];
        let mut placed = vec![false; points.len().div_ceil(GROUP as usize)];
        let mut shown = Vec::new();
        for cluster in clusters {
            if !self.box_may_show(&to_pixels, cluster.center, cluster.half) {
                continue;
            }
            for &group in &cluster.groups {
                if !std::mem::replace(&mut placed[usize::from(group)], true) {
                    let first = usize::from(group) * GROUP as usize;
                    let places = points[first..].iter_mut().zip(&chunk.positions[first..]);
                    places.take(GROUP as usize).for_each(|(point, &position)| *point = pixel_of(&to_pixels, position));
                }
            }
            let triangles = cluster.indices.start / 3..cluster.indices.end / 3;
            shown.extend(triangles.filter(|&number| {
                let [a, b, c] = chunk.triangle(number).map(|vertex| points[usize::from(vertex)]);
                self.may_hold(a.min(b).min(c), a.max(b).max(c))
            }));
        }
        shown
    }

    fn box_may_show(&self, to_pixels: &Mat4, center: Vec3, half: Vec3) -> bool {
        let middle = *to_pixels * center.extend(1.0);
        let [x, y, z] = [to_pixels.x_axis * half.x, to_pixels.y_axis * half.y, to_pixels.z_axis * half.z];
        // An eye at or in the box sees it.
        if middle.w - x.w.abs() - y.w.abs() - z.w.abs() <= 0.0 {
            return true;
        }
        let (mut low, mut high) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
        for corner in [x + y + z, x + y - z, x - y + z, x - y - z] {
            for clip in [middle + corner, middle - corner] {
                let point = Vec3A::from_vec4(clip) / clip.w;
                (low, high) = (low.min(point), high.max(point));
            }
        }
        self.may_hold(low, high)
    }

    /// Whether a pixel's centre lies in a box (pixels, depth) that is not behind what the pixel shows.
    fn may_hold(&self, low: Vec3A, high: Vec3A) -> bool {
        if high.z == f32::INFINITY {
            return true;
        }
        let last = self.size.as_vec2() - 1.0;
        let [low, far] = [(low - 0.5 - SNAP_PX).ceil(), (high - 0.5 + SNAP_PX).floor()].map(|at| Vec2::new(at.x, at.y));
        let (low, far) = (low.max(Vec2::ZERO), far.min(last));
        if low.x > far.x || low.y > far.y {
            return false;
        }
        let nearest = high.z * (1.0 + DEPTH_SLACK);
        let (low, far) = (low.as_uvec2(), far.as_uvec2());
        let extent = far - low + 1;
        let (values, stride, low, far) = if extent.x.saturating_mul(extent.y) <= MOST_PIXELS {
            (self.depth, self.stride, low, far)
        } else {
            (&self.farthest[..], self.columns, low / TILE, far / TILE)
        };
        (low.y..=far.y).any(|y| {
            let row = &values[y as usize * stride..];
            row[low.x as usize..=far.x as usize].iter().any(|&depth| nearest >= depth)
        })
    }
}

/// Pixels and depth of a point; depth without end where it is not before the eye.
fn pixel_of(to_pixels: &Mat4, position: Vec3) -> Vec3A {
    let clip = *to_pixels * position.extend(1.0);
    if clip.w > 0.0 { Vec3A::from_vec4(clip) / clip.w } else { Vec3A::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::daylight::view::tests::quad_at;

    const SIZE: UVec4 = UVec4::new(8, 4, 40, 24);

    /// The depth of a wall at 10 m over the left half of a view of 90 degrees, at [`SIZE`] in a picture of 64 by 32 pixels.
    fn half_a_wall() -> (Vec<f32>, Mat4) {
        let clip = Mat4::perspective_infinite_reverse_rh(std::f32::consts::FRAC_PI_2, 40.0 / 24.0, 0.1);
        let depth = clip.project_point3(Vec3::new(0.0, 0.0, -10.0)).z;
        let row: Vec<f32> = (0..64).map(|x| if x < 28 { depth } else { 0.0 }).collect();
        (row.repeat(32), clip)
    }

    /// The triangles that may show of squares of two metres at these places, known ones apart.
    fn shown(places: &[Vec3], known: Option<&[NumberSet]>, (depth, clip): &(Vec<f32>, Mat4)) -> [Vec<(u32, u32)>; 2] {
        ComputeTaskPool::get_or_init(Default::default);
        let chunks: Vec<GpuChunk> = places.iter().map(|&place| quad_at(place, 0)).collect();
        let clusters: Vec<ClusterRef> = (0..chunks.len() as u32).map(|chunk| ClusterRef { chunk, cluster: 0 }).collect();
        let picture = DepthPicture::new(depth, 64, SIZE);
        let (shown, new) = may_show(&chunks, &clusters, known, &picture, clip);
        [shown, new].map(|seen| {
            let single = seen.single.unwrap();
            seen.draws
                .iter()
                .flat_map(|draw| draw.indices.clone().step_by(3).map(|at| (draw.chunk, single[at as usize / 3])))
                .collect()
        })
    }

    #[test]
    fn what_lies_behind_a_wall_does_not_show_and_what_looks_out_does() {
        let wall = half_a_wall();
        let hidden = |x: f32, z: f32| shown(&[Vec3::new(x, 0.0, -z)], None, &wall)[0].is_empty();
        assert!(hidden(-5.0, 20.0));
        assert!(!hidden(-5.0, 10.0), "it is the wall");
        assert!(!hidden(-5.0, 5.0), "it is before the wall");
        assert!(!hidden(0.5, 20.0), "it looks out beside the wall");
        assert!(!hidden(5.0, 20.0), "there is no wall");
        assert!(hidden(-33.5, 20.0), "behind the wall, half of it beyond the view's edge");
        assert!(!hidden(16.0, 10.0), "half of it beyond the view's edge");
        assert!(hidden(5.0, 20_000.0), "between the pixels' centres");
        assert!(!hidden(0.0, -1e-9), "not before the eye: for the frustum to leave out");
    }

    #[test]
    fn what_is_known_is_not_drawn_again() {
        let wall = half_a_wall();
        let places = [Vec3::new(-5.0, 0.0, -20.0), Vec3::new(5.0, 0.0, -20.0), Vec3::new(-5.0, 0.0, -5.0)];
        let all = [(1, 0), (1, 1), (2, 0), (2, 1)];
        assert_eq!(shown(&places, None, &wall), [all.to_vec(), vec![]]);
        let mut known = vec![NumberSet::default(); 3];
        assert_eq!(shown(&places, Some(&known), &wall), [all.to_vec(), all.to_vec()]);
        known[1].extend([0, 1]);
        known[2].extend([1]);
        assert_eq!(shown(&places, Some(&known), &wall), [all.to_vec(), vec![(2, 0)]]);
    }

    #[test]
    fn parallel_views_have_no_vanishing_point() {
        let clip = Mat4::orthographic_rh(-20.0, 20.0, -12.0, 12.0, 100.0, 0.0);
        let depth = clip.project_point3(Vec3::new(0.0, 0.0, -10.0)).z;
        let view = (vec![depth; 64 * 32], clip);
        let hidden = |z: f32| shown(&[Vec3::new(15.0, 5.0, -z)], None, &view)[0].is_empty();
        assert!(hidden(20.0) && !hidden(10.0) && !hidden(5.0));
    }

    #[test]
    fn large_boxes_ask_the_farthest_pixel_of_tiles() {
        let (mut depth, _) = half_a_wall();
        depth.fill(0.5);
        // The last pixel but one of the view, in its last tile.
        depth[(4 + 23) * 64 + 8 + 38] = 0.25;
        let picture = DepthPicture::new(&depth, 64, SIZE);
        assert_eq!((picture.columns, picture.farthest.iter().filter(|&&depth| depth == 0.25).count()), (10, 1));
        let before = |low: [f32; 2], high: [f32; 2], z: f32| {
            picture.may_hold(Vec3A::new(low[0], low[1], 0.0), Vec3A::new(high[0], high[1], z))
        };
        assert!(!before([0.0; 2], [30.0, 24.0], 0.4) && before([0.0; 2], [30.0, 24.0], 0.6));
        assert!(before([0.0; 2], [40.0, 24.0], 0.4), "one of its tiles has a pixel that is farther");
        assert!(!before([36.0, 20.0], [38.0, 24.0], 0.4) && before([38.0, 20.0], [40.0, 24.0], 0.4));
        assert!(!before([3.6, 3.6], [4.4, 4.4], 0.9), "no pixel's centre");
        assert!(before([3.6, 3.6], [4.46, 4.46], 0.9), "a vertex may be moved to one");
    }
}
