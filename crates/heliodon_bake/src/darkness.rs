//! Vertices without light: those that lie inside something and have no lit one to borrow from.
//!
//! Stones that are buried, and feet of columns that stand in others, have such vertices by the hundred, and nobody ever sees them. They are
//! told of only where a face of theirs can be seen: as a warning where it is a part worth mending, such as furniture under a roof of a single
//! sheet, of which rays meet the back; in one line for all where it is a chip of stone in a joint here and there.

use crate::report::Reporter;
use crate::scene::Scene;
use glam::Vec3;
use heliodon_bundle::site::Part;
use heliodon_light::Validity;
use heliodon_math::sphere::fibonacci_sphere;
use heliodon_rays::{Ray, TriangleScene};
use rayon::prelude::*;

/// Faces of a part that are looked at, at most; of more, every n-th. Four times as many took as long as a thirtieth of the temple's bake at 60,000
/// triangles, all of it left to the merge of shards.
const FACES: usize = 1024;
/// Places of a face, as barycentric coordinates u, v: its middle, and those of its edges.
const PLACES: [(f32, f32); 4] = [(1.0 / 3.0, 1.0 / 3.0), (0.5, 0.5), (0.5, 0.0), (0.0, 0.5)];
/// Directions over the whole sphere; those above the horizon look for the open.
const DIRECTIONS: u32 = 128;
/// A place is seen where more than this part of these directions leads into the open: out of no more surfaces than into. Under a sheet of ground, or
/// within stone, none does.
const OPEN: f32 = 0.05;

/// The part of a part's area from which on its black faces are worth a warning.
const WORTH_MENDING: f64 = 0.01;

/// Tells of faces that stay black where they can be seen.
pub fn tell_of_darkness(
    parts: &[Part],
    scene: &Scene,
    rays: &TriangleScene,
    validity: &Validity,
    offset_m: f32,
    reporter: &dyn Reporter,
) {
    let upwards: Vec<Vec3> = fibonacci_sphere(DIRECTIONS).into_iter().filter(|direction| direction.y > 0.0).collect();
    let mut chips: Vec<u32> = Vec::new();
    for (part, range) in parts.iter().zip(&scene.parts) {
        let triangles = &scene.mesh.triangles[range.triangles.clone()];
        let is_lost = |triangle: &&[u32; 3]| triangle.iter().all(|&vertex| validity.is_lost(vertex));
        let lost: Vec<&[u32; 3]> = triangles.iter().filter(is_lost).collect();
        let stride = lost.len().div_ceil(FACES).max(1);
        let is_dark = |face: &&[u32; 3]| is_seen(scene, rays, face, offset_m, &upwards);
        let looked_at: Vec<&[u32; 3]> = lost.iter().step_by(stride).copied().collect();
        let dark: Vec<&[u32; 3]> = looked_at.par_iter().filter(|face| is_dark(face)).copied().collect();
        let area = |triangles: &mut dyn Iterator<Item = &[u32; 3]>| triangles.map(|face| area_of(scene, face)).sum::<f64>();
        let dark_area = area(&mut dark.iter().copied()) * stride as f64;
        let mut vertices: Vec<u32> = dark.iter().copied().flatten().copied().collect();
        vertices.sort_unstable();
        vertices.dedup();
        if dark_area <= WORTH_MENDING * area(&mut triangles.iter()) {
            chips.extend(vertices);
        } else if let Some(&first) = vertices.first() {
            reporter.warning(&format!(
                "part {}: {} lie inside or behind something, and no vertex near them is outside ({}): their surfaces stay black; \
                 close what is above them (a roof has two sides), or give large polygons that run into others more vertices",
                part.display_name(),
                count(vertices.len(), stride),
                place(scene, first)
            ));
        }
    }
    if let Some(&first) = chips.first() {
        let count = count(chips.len(), 1);
        reporter.note(&format!(
            "{count} of small faces in joints and corners have no lit one near and stay black ({})",
            place(scene, first)
        ));
    }
}

fn count(vertices: usize, stride: usize) -> String {
    format!("{}{vertices} vertices", if stride > 1 { "at least " } else { "" })
}

fn place(scene: &Scene, vertex: u32) -> String {
    let at = scene.mesh.positions[vertex as usize];
    format!("the first at {:.2}, {:.2}, {:.2} m", at.x, at.y, at.z)
}

fn area_of(scene: &Scene, face: &[u32; 3]) -> f64 {
    let [a, b, c] = face.map(|vertex| scene.mesh.positions[vertex as usize]);
    0.5 * f64::from((b - a).cross(c - a).length())
}

fn is_seen(scene: &Scene, rays: &TriangleScene, face: &[u32; 3], offset_m: f32, upwards: &[Vec3]) -> bool {
    let [a, b, c] = face.map(|vertex| scene.mesh.positions[vertex as usize]);
    let off = (b - a).cross(c - a).normalize_or_zero() * offset_m;
    let mut counts = vec![0; upwards.len()];
    PLACES.iter().any(|&(u, v)| {
        let place = a + (b - a) * u + (c - a) * v;
        let ray = |&direction: &Vec3| {
            // off the side to which it goes, so that it does not cross the face itself
            let origin = place + off * direction.dot(off).signum();
            Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
        };
        rays.enclosures(&upwards.iter().map(ray).collect::<Vec<_>>(), &mut counts);
        let open = counts.iter().filter(|&&count| count <= 0).count();
        open as f32 > OPEN * upwards.len() as f32
    })
}
