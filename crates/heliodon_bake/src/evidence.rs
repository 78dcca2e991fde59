//! What colours rest on: the evidence images of a site's parts, kept as the alpha of the albedo images that they tell of.

use crate::scene::Scene;
use glam::{Vec2, Vec3};
use heliodon_image::SrgbImage;
use heliodon_mesh::Mesh;
use std::collections::VecDeque;

/// Points along each side of a triangle at most that its share is taken from.
const MOST_STEPS: usize = 64;

/// Lays evidence over an albedo: its alpha becomes the evidence's grey (white: seen, mid grey and darker: guessed). What lies on no surface, which is
/// black, takes the nearest texel's, so that coarser levels of the image do not mix it in at the borders of charts.
///
/// # Errors
/// If the two have not the same size, in words.
pub(crate) fn lay(albedo: &mut SrgbImage, evidence: &SrgbImage) -> Result<(), String> {
    let (size, wanted) = ([evidence.width, evidence.height], [albedo.width, albedo.height]);
    if size != wanted {
        let ([width, height], [w, h]) = (size, wanted);
        return Err(format!("the evidence is {width} x {height} texels, the albedo that it tells of {w} x {h}"));
    }
    let mut codes: Vec<u8> = evidence.pixels.iter().map(|&[red, ..]| red).collect();
    spread(&mut codes, evidence.width as usize);
    for (pixel, code) in albedo.pixels.iter_mut().zip(codes) {
        pixel[3] = code;
    }
    Ok(())
}

/// Gives every 0 of a picture so wide what the nearest other one has, by steps along rows and columns; of a picture without another it makes 255.
fn spread(codes: &mut [u8], width: usize) {
    let mut border: VecDeque<usize> = (0..codes.len()).filter(|&at| codes[at] > 0).collect();
    if border.is_empty() {
        codes.fill(u8::MAX);
    }
    while let Some(at) = border.pop_front() {
        let (x, code) = (at % width, codes[at]);
        let beside = [(x > 0).then(|| at - 1), (x + 1 < width).then_some(at + 1), at.checked_sub(width), Some(at + width)];
        for next in beside.into_iter().flatten() {
            if codes.get(next) == Some(&0) {
                codes[next] = code;
                border.push_back(next);
            }
        }
    }
}

/// The share of a part's surface that was seen, 0 to 1; of what has no image nothing was.
pub(crate) fn seen_share(scene: &Scene, part: usize) -> f64 {
    let (mut seen, mut whole) = (0.0, 0.0);
    for triangle in scene.parts[part].drawn_triangles() {
        let [a, b, c] = scene.mesh.triangles[triangle].map(|vertex| scene.mesh.positions[vertex as usize]);
        let area = f64::from((b - a).cross(c - a).length());
        whole += area;
        seen += area * mean_evidence(&scene.mesh, triangle);
    }
    if whole > 0.0 { seen / whole } else { 0.0 }
}

/// How much of a triangle was seen, 0 to 1.
fn mean_evidence(mesh: &Mesh, triangle: usize) -> f64 {
    let material = mesh.triangle_material.get(triangle).map_or(0, |&material| usize::from(material));
    let Some(texture) = mesh.materials.get(material).and_then(|material| material.texture.as_ref()) else { return 0.0 };
    let image = &texture.image;
    let [a, b, c] = mesh.triangles[triangle].map(|vertex| mesh.uvs[vertex as usize]);
    let size = Vec2::new(image.width as f32, image.height as f32);
    let texels = [b - a, c - b, a - c].map(|side| (side * size).length()).into_iter().fold(0.0, f32::max);
    let steps = (texels.ceil() as usize).clamp(1, MOST_STEPS);
    let mut seen = 0usize;
    let mut count = 0usize;
    for row in 0..steps {
        for column in 0..steps - row {
            let weights = Vec3::new(0.0, row as f32 + 1.0 / 3.0, column as f32 + 1.0 / 3.0) / steps as f32;
            let uv = a * (1.0 - weights.y - weights.z) + b * weights.y + c * weights.z;
            seen += usize::from(image.sample_bilinear(uv.x, uv.y, texture.wrap).w > 0.75);
            count += 1;
        }
    }
    seen as f64 / count as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::PartRange;
    use heliodon_image::TextureWrap;
    use heliodon_mesh::{Material, Texture};
    use std::sync::Arc;

    fn grey(width: u32, codes: &[u8]) -> SrgbImage {
        SrgbImage {
            width,
            height: codes.len() as u32 / width,
            pixels: codes.iter().map(|&code| [code, code, code, 255]).collect(),
        }
    }

    #[test]
    fn alpha_says_what_was_seen_and_nothing_lies_between_charts() {
        let mut albedo = grey(4, &[10; 8]);
        lay(&mut albedo, &grey(4, &[255, 0, 0, 128, 255, 0, 0, 128])).unwrap();
        let alpha: Vec<u8> = albedo.pixels.iter().map(|pixel| pixel[3]).collect();
        assert_eq!(alpha, [255, 255, 128, 128, 255, 255, 128, 128]);
        assert!(albedo.pixels.iter().all(|pixel| pixel[..3] == [10; 3]));
        let error = lay(&mut albedo, &grey(2, &[255; 8])).unwrap_err();
        assert!(error.contains("2 x 4") && error.contains("4 x 2"), "{error}");
        lay(&mut albedo, &grey(4, &[0; 8])).unwrap();
        assert!(albedo.pixels.iter().all(|pixel| pixel[3] == 255));
    }

    #[test]
    fn the_share_that_was_seen_is_of_the_surface_not_of_the_image() {
        // the left half of the image was seen; three quarters of the surface show it
        let mut image = grey(64, &[200; 64 * 64]);
        let codes: Vec<u8> = (0..64 * 64).map(|at| if at % 64 < 32 { 255 } else { 128 }).collect();
        lay(&mut image, &grey(64, &codes)).unwrap();
        let texture = Arc::new(Texture { source: "atlas.png".to_owned(), image, wrap: [TextureWrap::Repeat; 2] });
        let square = |x: f32, width: f32| [[x, 0.0], [x + width, 0.0], [x + width, 1.0], [x, 1.0]];
        let corners = |squares: [[[f32; 2]; 4]; 2]| squares.into_iter().flatten().map(Vec2::from).collect::<Vec<_>>();
        let mesh = Mesh {
            positions: corners([square(0.0, 3.0), square(3.0, 1.0)]).into_iter().map(|at| at.extend(0.0)).collect(),
            uvs: corners([square(0.0, 0.5), square(0.5, 0.5)]),
            triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
            materials: vec![Material { name: String::new(), base_color_linear: Vec3::ONE, texture: Some(texture) }],
            ..Mesh::default()
        };
        let range = PartRange { vertices: 0..8, triangles: 0..4, drawn: 4, files: 1, by_texels: false };
        let scene = Scene { mesh, parts: vec![range], warnings: Vec::new(), original: None, prepared: None };
        assert!((seen_share(&scene, 0) - 0.75).abs() < 0.02, "{}", seen_share(&scene, 0));
    }
}
