//! What a mesh reflects: vertex colour times material times texture, at a point, over a triangle, at a corner.
//!
//! Textures are averaged over what a value stands for, through a pyramid of halved images: a point of light transport stands for
//! a patch of `footprint_m`, a triangle's mean for the triangle. So a wall of two triangles
//! with a fine texture and a dense scan with a coarse one both reflect what they should, without noise from single texels.

mod pyramid;

use crate::measure::UNSAID_ALBEDO;
use crate::{Mesh, Texture};
use glam::{Vec2, Vec3};
use pyramid::Pyramid;
use std::sync::Arc;

/// Samples along a triangle's edge for its mean, at most, and how many texels each stands for.
const MOST_MEAN_STEPS: f32 = 16.0;
const TEXELS_A_STEP: f32 = 4.0;

/// The albedo of a mesh's surface, ready to be asked from many threads.
pub struct MeshAlbedo<'m> {
    mesh: &'m Mesh,
    footprint_m: f32,
    /// For each material its texture's pyramid.
    pyramids: Vec<Option<Arc<Pyramid>>>,
}

impl<'m> MeshAlbedo<'m> {
    /// `footprint_m` is the size of the patch that [`MeshAlbedo::albedo`] averages textures over; 0 takes them as sharp as they are.
    /// Where the mesh has neither colours nor materials, its albedo is [`Mesh::UNSAID_ALBEDO`].
    #[must_use]
    pub fn new(mesh: &'m Mesh, footprint_m: f32) -> Self {
        let mut built: Vec<(*const Texture, Arc<Pyramid>)> = Vec::new();
        let pyramids = mesh
            .materials
            .iter()
            .map(|material| {
                let texture = material.texture.as_ref().filter(|_| !mesh.uvs.is_empty())?;
                let known = built.iter().find(|(of, _)| *of == Arc::as_ptr(texture)).map(|(_, pyramid)| pyramid.clone());
                Some(known.unwrap_or_else(|| {
                    let pyramid = Arc::new(Pyramid::new(texture.clone()));
                    built.push((Arc::as_ptr(texture), pyramid.clone()));
                    pyramid
                }))
            })
            .collect();
        Self { mesh, footprint_m, pyramids }
    }

    /// The linear albedo at the point `(1 - u - v) a + u b + v c` of a triangle with the corners a, b, c.
    #[must_use]
    pub fn albedo(&self, triangle: u32, u: f32, v: f32) -> Vec3 {
        let triangle = triangle as usize;
        let weights = [1.0 - u - v, u, v];
        let Some(pyramid) = self.pyramid(triangle) else { return self.plain(triangle, weights) };
        let Span { texels, area_m2, .. } = self.span(triangle, pyramid);
        let patch = self.footprint_m * self.footprint_m;
        // a patch larger than its triangle would reach into the atlas's other charts
        let covered = if area_m2 > patch { texels * (patch / area_m2) } else { texels };
        self.textured(triangle, weights, pyramid, covered)
    }

    /// The mean linear albedo over a triangle.
    #[must_use]
    pub fn mean(&self, triangle: u32) -> Vec3 {
        let triangle = triangle as usize;
        let Some(pyramid) = self.pyramid(triangle) else { return self.plain(triangle, [1.0 / 3.0; 3]) };
        let span = self.span(triangle, pyramid);
        let steps = (span.longest / TEXELS_A_STEP).ceil().clamp(1.0, MOST_MEAN_STEPS);
        let covered = span.texels / (steps * steps);
        let (mut sum, count) = (Vec3::ZERO, steps as u32);
        // The centres of the triangles that `steps` cuts along each edge make.
        for i in 0..count {
            for j in 0..count - i {
                let at = |du: f32, dv: f32| {
                    let (u, v) = ((i as f32 + du) / steps, (j as f32 + dv) / steps);
                    self.textured(triangle, [1.0 - u - v, u, v], pyramid, covered)
                };
                sum += at(1.0 / 3.0, 1.0 / 3.0);
                if i + j + 1 < count {
                    sum += at(2.0 / 3.0, 2.0 / 3.0);
                }
            }
        }
        sum / (steps * steps)
    }

    fn material(&self, triangle: usize) -> usize {
        self.mesh.triangle_material.get(triangle).map_or(0, |&m| usize::from(m))
    }

    fn pyramid(&self, triangle: usize) -> Option<&Pyramid> {
        self.pyramids.get(self.material(triangle))?.as_deref()
    }

    /// Colour times material, without a texture.
    fn plain(&self, triangle: usize, weights: [f32; 3]) -> Vec3 {
        let material = self.material(triangle) as u16;
        let corners = self.mesh.triangles[triangle].map(|i| self.mesh.corner_albedo(i as usize, material));
        corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
    }

    fn textured(&self, triangle: usize, weights: [f32; 3], pyramid: &Pyramid, texels: f32) -> Vec3 {
        let corners = self.mesh.triangles[triangle].map(|i| self.mesh.uvs[i as usize]);
        let uv = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2];
        self.plain(triangle, weights) * pyramid.sample(uv, texels)
    }

    fn span(&self, triangle: usize, pyramid: &Pyramid) -> Span {
        let size = pyramid.size();
        let [a, b, c] = self.mesh.triangles[triangle].map(|i| self.mesh.uvs[i as usize] * size);
        let [p, q, r] = self.mesh.corners(triangle);
        Span {
            texels: (b - a).perp_dot(c - a).abs() * 0.5,
            longest: [a - b, b - c, c - a].into_iter().map(Vec2::length).fold(0.0, f32::max),
            area_m2: (q - p).cross(r - p).length() * 0.5,
        }
    }
}

/// A triangle's size in its texture and in space.
struct Span {
    texels: f32,
    longest: f32,
    area_m2: f32,
}

impl Mesh {
    /// The linear albedo that counts where nothing else is said.
    pub const UNSAID_ALBEDO: Vec3 = Vec3::splat(UNSAID_ALBEDO);

    /// The linear albedo of a vertex as a corner of triangles of a material, without the material's texture: colour times base colour.
    /// A vertex between two materials has two of them.
    ///
    /// # Panics
    /// Where colours are there but none for that vertex.
    #[must_use]
    pub fn corner_albedo(&self, vertex: usize, material: u16) -> Vec3 {
        let base = self.materials.get(usize::from(material)).map(|material| material.base_color_linear);
        match (self.colors_linear.is_empty(), base) {
            (true, base) => base.unwrap_or(Self::UNSAID_ALBEDO),
            (false, base) => self.colors_linear[vertex] * base.unwrap_or(Vec3::ONE),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, TextureWrap};
    use heliodon_image::SrgbImage;

    fn textured(image: SrgbImage, uvs: [[f32; 2]; 4]) -> Mesh {
        let texture = Texture { source: "test".into(), image, wrap: [TextureWrap::Repeat; 2] };
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y],
            uvs: uvs.map(Vec2::from).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            materials: vec![Material {
                name: String::new(),
                base_color_linear: Vec3::new(1.0, 0.5, 0.25),
                texture: Some(Arc::new(texture)),
            }],
            ..Mesh::default()
        }
    }

    fn checkers(size: u32, square: u32) -> SrgbImage {
        let mut image = SrgbImage::filled(size, size, [0, 0, 0, 255]);
        for (i, pixel) in image.pixels.iter_mut().enumerate() {
            let (x, y) = (i as u32 % size, i as u32 / size);
            if (x / square + y / square).is_multiple_of(2) {
                *pixel = [255; 4];
            }
        }
        image
    }

    const WHOLE: [[f32; 2]; 4] = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];

    #[test]
    fn a_large_triangle_reflects_its_texture_s_mean_not_one_texel() {
        for (size, square) in [(256, 1), (256, 32), (100, 5), (37, 1)] {
            let mesh = textured(checkers(size, square), WHOLE);
            let albedo = MeshAlbedo::new(&mesh, 10.0);
            let means = (albedo.mean(0) + albedo.mean(1)) * 0.5;
            assert!((means - Vec3::new(0.5, 0.25, 0.125)).abs().max_element() < 0.02, "{size} {square}: {means}");
            assert!((albedo.albedo(0, 0.3, 0.3) - Vec3::new(0.5, 0.25, 0.125)).abs().max_element() < 0.02);
        }
    }

    #[test]
    fn a_small_footprint_sees_the_texels() {
        let mesh = textured(checkers(4, 2), WHOLE);
        let albedo = MeshAlbedo::new(&mesh, 0.0);
        // (0.25, 0.25) of the image is in its white top left, (0.75, 0.25) in its black top right
        assert!(albedo.albedo(1, 0.25, 0.5).x > 0.99);
        assert_eq!(albedo.albedo(0, 0.0, 0.75), Vec3::ZERO);
        assert!(albedo.albedo(0, 0.5, 0.25).abs_diff_eq(Vec3::new(1.0, 0.5, 0.25), 1e-6));
    }

    #[test]
    fn colours_materials_and_their_absence() {
        let mut mesh = textured(checkers(4, 2), WHOLE);
        mesh.materials[0].texture = None;
        assert_eq!(mesh.corner_albedo(0, 0), Vec3::new(1.0, 0.5, 0.25));
        mesh.colors_linear = vec![Vec3::splat(0.5); 4];
        assert_eq!(MeshAlbedo::new(&mesh, 1.0).albedo(1, 0.2, 0.2), Vec3::new(0.5, 0.25, 0.125));
        mesh.materials.clear();
        assert_eq!(mesh.corner_albedo(3, 0), Vec3::splat(0.5));
        mesh.colors_linear.clear();
        assert_eq!(MeshAlbedo::new(&mesh, 1.0).mean(0), Mesh::UNSAID_ALBEDO);
    }

    #[test]
    fn a_vertex_between_materials_has_the_albedo_of_each() {
        let mut mesh = textured(checkers(4, 2), WHOLE);
        let plain = |x: f32| Material { name: String::new(), base_color_linear: Vec3::splat(x), texture: None };
        mesh.materials = vec![plain(0.25), plain(0.5)];
        mesh.triangle_material = vec![0, 1];
        let albedo = MeshAlbedo::new(&mesh, 0.0);
        assert_eq!([albedo.mean(0), albedo.mean(1)].map(|c| (c.x * 1e6).round()), [250_000.0, 500_000.0]);
        assert_eq!([0, 1].map(|material| mesh.corner_albedo(2, material)), [Vec3::splat(0.25), Vec3::splat(0.5)]);
    }
}
