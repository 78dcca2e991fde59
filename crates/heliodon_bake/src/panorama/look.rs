//! What lies on the lines from the middle of the room through the texels.

use crate::scene::Scene;
use glam::{UVec2, Vec3, Vec4};
use heliodon_bundle::panorama::direction_of;
use heliodon_light::RayPlace;
use heliodon_rays::{Hit, Ray, TriangleScene};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// A texel that shows the original.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texel {
    /// Column and row in the atlas of all faces.
    pub at: [u16; 2],
    /// What the line through it first meets of the original.
    pub place: RayPlace,
    /// Its colour there, linear; the last is 0 where what is drawn has a texture of its own.
    pub albedo: Vec4,
    /// 1 over how far along the face's axis what is drawn lies, metres.
    pub nearness: f32,
}

/// The original may lie so many times as far off what is drawn as preparation has measured.
const CLEARANCES: f32 = 2.0;
/// Of what was not simplified nothing is measured: what rounding makes of a distance, as a part of it.
const ROUNDED: f32 = 1.0e-4;
/// Seen flatter than this, what lies off a triangle by so much is no longer sought further along the line.
const LEAST_COSINE: f32 = 0.05;

/// The texels of all faces that show the original, face by face, each row by row. `rays` meet the original, `shown` what is drawn, triangle by triangle of
/// `drawn` in the scene; `done` is told of rows.
pub fn look(
    scene: &Scene,
    (rays, shown, drawn): (&TriangleScene, &TriangleScene, &[u32]),
    (side, middle): (u32, Vec3),
    done: &(dyn Fn(u64) + Sync),
) -> Vec<Texel> {
    let rows = AtomicU64::new(0);
    let of_row = |y: u32| -> Vec<Texel> {
        let row: Vec<Ray> = (0..3 * side)
            .map(|x| Ray {
                origin: middle,
                direction: direction_of(side, 0, UVec2::new(x, y)),
                t_min: 0.0,
                t_max: f32::INFINITY,
            })
            .collect();
        let mut hits = [vec![Hit::MISS; row.len()], vec![Hit::MISS; row.len()]];
        let [of_original, of_shown] = &mut hits;
        rays.closest(&row, of_original);
        shown.closest(&row, of_shown);
        let texel = |x: usize| {
            let there = Hit { triangle: *drawn.get(of_shown[x].triangle as usize)?, ..of_shown[x] };
            let of = texel(scene, &row[x], &of_original[x], &there)?;
            Some(Texel { at: [x as u16, y as u16], ..of })
        };
        let found = (0..row.len()).filter_map(texel).collect();
        done(rows.fetch_add(1, Ordering::Relaxed) + 1);
        found
    };
    let mut all: Vec<Texel> = (0..2 * side).into_par_iter().flat_map_iter(of_row).collect();
    all.sort_by_key(|&Texel { at: [x, y], .. }| (face(side, [x, y]), y, x));
    all
}

/// The number of the face that a texel of the atlas belongs to.
pub fn face(side: u32, [x, y]: [u16; 2]) -> u32 {
    u32::from(x) / side + 3 * (u32::from(y) / side)
}

/// What a line shows that has met the original and what is drawn, if that is the same surface.
fn texel(scene: &Scene, ray: &Ray, met: &Hit, there: &Hit) -> Option<Texel> {
    let (mesh, detail) = (&scene.mesh, scene.original.as_ref()?);
    if !met.is_some() {
        return None;
    }
    let part = scene.parts.iter().find(|part| part.triangles.contains(&(there.triangle as usize)))?;
    let corners = mesh.triangles[there.triangle as usize];
    let [a, b, c] = corners.map(|vertex| mesh.positions[vertex as usize]);
    let facing = (b - a).cross(c - a).try_normalize()?;
    let length = ray.direction.length();
    let clearance = corners.iter().map(|&vertex| detail.clearance_m[vertex as usize]).fold(0.0, f32::max);
    let cosine = (facing.dot(ray.direction) / length).abs().max(LEAST_COSINE);
    let apart = (met.t - there.t).abs() * length;
    if part.by_texels || apart * cosine > CLEARANCES * clearance + ROUNDED * there.t * length {
        return None;
    }
    let vertices = detail.triangles[met.triangle as usize];
    let weights = [1.0 - met.u - met.v, met.u, met.v];
    let mixed = |of: &dyn Fn(u32) -> Vec3| vertices.iter().zip(weights).map(|(&v, weight)| of(v) * weight).sum::<Vec3>();
    let normal = mixed(&|vertex| detail.looks.of(vertex)[1]).try_normalize()?;
    let stand_in = detail.stands_for[met.triangle as usize] as usize;
    let material = |triangle: usize| mesh.triangle_material.get(triangle).copied().unwrap_or(0);
    let own = scene.parts.iter().position(|part| part.triangles.contains(&stand_in))?;
    let albedo = if detail.colored[own] == 1 {
        let base = mesh.materials.get(usize::from(material(stand_in))).map_or(Vec3::ONE, |material| material.base_color_linear);
        mixed(&|vertex| detail.looks.of(vertex)[0]) * base
    } else {
        mesh.corner_albedo(mesh.triangles[stand_in][0] as usize, material(stand_in))
    };
    let drawn_material = mesh.materials.get(usize::from(material(there.triangle as usize)));
    let is_textured = drawn_material.is_some_and(|material| material.texture.is_some());
    Some(Texel {
        at: [0; 2],
        place: RayPlace { position: ray.origin + ray.direction * met.t, normal },
        albedo: albedo.extend(if is_textured { 0.0 } else { 1.0 }),
        // the direction is 1 along the face's axis
        nearness: 1.0 / there.t,
    })
}
