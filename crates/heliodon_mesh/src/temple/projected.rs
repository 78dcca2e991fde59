//! How large triangles are in a picture: the check that shadows have sharp edges.

use super::sizing::{FOCAL_PX, PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX};
use crate::Mesh;
use glam::Vec3;
use heliodon_math::frame::unit_or;

/// A pinhole camera with square pixels; up is +Y.
#[derive(Clone, Copy, Debug)]
pub struct PictureCamera {
    /// The eye.
    pub eye: Vec3,
    /// A point in the middle of the picture.
    pub look_at: Vec3,
    /// Size of the picture in pixels.
    pub size: (u32, u32),
    /// Pixels per unit of tangent.
    pub focal_px: f32,
}

impl PictureCamera {
    /// The picture of 1024 x 768 pixels and 50 degrees that the temple is cut for.
    pub fn standard(eye: Vec3, look_at: Vec3) -> Self {
        Self { eye, look_at, size: (PICTURE_WIDTH_PX as u32, PICTURE_HEIGHT_PX as u32), focal_px: FOCAL_PX }
    }
}

/// A triangle that shows in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProjectedTriangle {
    /// Index of the mesh in the list.
    pub mesh: u32,
    /// Index of the triangle in the mesh.
    pub triangle: u32,
    /// Area in square pixels.
    pub area_px: f32,
    /// Longest side in pixels.
    pub side_px: f32,
    /// Which side that is: side k runs from corner k to the next.
    pub longest: u8,
    /// Pixels whose nearest surface it is.
    pub pixels: u32,
}

/// The nearest surface at every pixel.
pub(super) struct DepthPicture {
    camera: PictureCamera,
    axes: [Vec3; 3],
    /// Reciprocal depth and what was drawn there.
    nearest: Vec<(f32, u32)>,
}

impl DepthPicture {
    pub(super) fn new(camera: PictureCamera) -> Self {
        let forward = unit_or(camera.look_at - camera.eye, Vec3::NEG_Z);
        let right = unit_or(forward.cross(Vec3::Y), Vec3::X);
        let pixels = camera.size.0 as usize * camera.size.1 as usize;
        Self { camera, axes: [right, right.cross(forward), forward], nearest: vec![(0.0, u32::MAX); pixels] }
    }

    /// Screen position and reciprocal depth, unless the point lies behind the eye.
    pub(super) fn project(&self, p: Vec3) -> Option<Vec3> {
        let d = p - self.camera.eye;
        let depth = d.dot(self.axes[2]);
        (depth > 0.05).then(|| {
            let scale = self.camera.focal_px / depth;
            let (width, height) = self.camera.size;
            Vec3::new(
                0.5 * width as f32 + d.dot(self.axes[0]) * scale,
                0.5 * height as f32 - d.dot(self.axes[1]) * scale,
                1.0 / depth,
            )
        })
    }

    /// Draws a projected triangle as `id`; answers its area in square pixels, or `None` where it is turned away or outside.
    pub(super) fn draw(&mut self, [a, b, c]: [Vec3; 3], id: u32) -> Option<f32> {
        let (width, height) = (self.camera.size.0 as usize, self.camera.size.1 as usize);
        // y grows downwards on the screen, so counter-clockwise in space is negative here
        let area = -0.5 * ((b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y));
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let inside = high.x >= 0.0 && high.y >= 0.0 && low.x < width as f32 && low.y < height as f32;
        if area <= 0.0 || !inside {
            return None;
        }
        let clamp = |x: f32, n: usize| (x.max(0.0) as usize).min(n - 1);
        for y in clamp(low.y, height)..=clamp(high.y, height) {
            for x in clamp(low.x, width)..=clamp(high.x, width) {
                let (px, py) = (x as f32 + 0.5, y as f32 + 0.5);
                let edge = |p: Vec3, q: Vec3| (q.x - p.x) * (py - p.y) - (q.y - p.y) * (px - p.x);
                let (u, v, w) = (edge(b, c), edge(c, a), edge(a, b));
                if u <= 0.0 && v <= 0.0 && w <= 0.0 {
                    let inverse_depth = -(u * a.z + v * b.z + w * c.z) / (2.0 * area);
                    let cell = &mut self.nearest[y * width + x];
                    if inverse_depth > cell.0 {
                        *cell = (inverse_depth, id);
                    }
                }
            }
        }
        Some(area)
    }

    /// What won each pixel, without the empty ones.
    pub(super) fn winners(&self) -> impl Iterator<Item = u32> + '_ {
        self.nearest.iter().map(|&(_, id)| id).filter(|&id| id != u32::MAX)
    }
}

/// The triangles that win at least one pixel of the picture, with their projected sizes. Triangles that reach behind the eye
/// are left out.
pub fn visible_triangles(meshes: &[&Mesh], camera: &PictureCamera) -> Vec<ProjectedTriangle> {
    let mut picture = DepthPicture::new(*camera);
    let mut found: Vec<ProjectedTriangle> = Vec::new();
    for (m, mesh) in meshes.iter().enumerate() {
        let points: Vec<Option<Vec3>> = mesh.positions.iter().map(|&p| picture.project(p)).collect();
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let [Some(a), Some(b), Some(c)] = triangle.map(|i| points[i as usize]) else { continue };
            let Some(area_px) = picture.draw([a, b, c], found.len() as u32) else { continue };
            let flat = |v: Vec3| Vec3::new(v.x, v.y, 0.0).length();
            let sides = [flat(b - a), flat(c - b), flat(a - c)];
            let longest = (0..3_u8).max_by(|&i, &j| sides[usize::from(i)].total_cmp(&sides[usize::from(j)])).unwrap_or(0);
            let side_px = sides[usize::from(longest)];
            found.push(ProjectedTriangle { mesh: m as u32, triangle: t as u32, area_px, side_px, longest, pixels: 0 });
        }
    }
    for id in picture.winners() {
        found[id as usize].pixels += 1;
    }
    found.retain(|t| t.pixels > 0);
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_metre_facing_the_eye_has_its_area() {
        let quad = |z: f32| Mesh {
            positions: [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, y)| Vec3::new(x, y, z)).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        let (near, far) = (quad(-10.0), quad(-20.0));
        let camera = PictureCamera::standard(Vec3::ZERO, Vec3::NEG_Z);
        let seen = visible_triangles(&[&near, &far], &camera);
        // the far square lies behind the near one
        assert_eq!(seen.len(), 2);
        let expected = 0.5 * (FOCAL_PX / 10.0) * (FOCAL_PX / 10.0);
        for triangle in &seen {
            assert_eq!(triangle.mesh, 0);
            assert!((triangle.area_px - expected).abs() < 0.5);
        }
        let pixels: u32 = seen.iter().map(|t| t.pixels).sum();
        assert!((pixels as f32 - 2.0 * expected).abs() < 200.0);
        // turned away, nothing shows
        let back = Mesh { triangles: vec![[0, 2, 1], [0, 3, 2]], ..quad(-10.0) };
        assert!(visible_triangles(&[&back], &camera).is_empty());
    }
}
