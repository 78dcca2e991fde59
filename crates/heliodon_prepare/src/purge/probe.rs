//! Rays from many eyes to many points of the faces that no picture showed.
//!
//! After P. Wonka, M. Wimmer, K. Zhou, S. Maierhofer, G. Hesina, A. Reshetov, "Guided Visibility Sampling", SIGGRAPH 2006: whatever a ray
//! meets first is visible, aimed at or not; and where something new is seen, more is found beside it, so its neighbours are aimed at
//! again (their adaptive border sampling, here with the mesh's own neighbours in place of an enlarged polygon).

use crate::ViewCell;
use crate::purge::Surface;
use crate::purge::bits::Bits;
use crate::purge::search::{DRAWN, Search};
use crate::purge::sight::Sight;
use crate::purge::windows::{Gates, SLACK};
use glam::Vec3;
use heliodon_math::random::{hash3_u32, unit_f32};
use heliodon_rays::Ray;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// Neighbouring faces that are looked at from one eye: rays from one point to places close to each other share what they read.
const RUN: usize = 64;

/// A room's eyes that are not in stone.
pub(super) struct Looks<'a> {
    pub cell: &'a ViewCell,
    pub eyes: &'a [Vec3],
}

impl Looks<'_> {
    /// Of the eyes at the box's corners (the first of all) the one farthest before a face's plane, or behind it for a `side` of -1.
    fn most_open(&self, surface: &Surface, triangle: u32, side: f32) -> Vec3 {
        let [a, b, c] = surface.triangles[triangle as usize].map(|i| surface.positions[i as usize]);
        let normal = side * (b - a).cross(c - a);
        let before = |eye: &Vec3| normal.dot(*eye - a);
        let farther = |best: Vec3, &eye: &Vec3| if before(&eye) > before(&best) { eye } else { best };
        self.eyes.iter().take(8).fold(self.eyes[0], farther)
    }
}

/// Aims at all faces that are not `seen` and not `certain` to be unseen, adds what is met to `seen`, and answers how many rays it took.
pub(super) fn probe(search: &Search, room: &Looks, certain: impl Fn(usize) -> bool, seen: &Bits) -> u64 {
    let Search { scene, surface, weld, model, params, tell, .. } = *search;
    let sight = Sight { scene, single_sided: surface.single_sided };
    let mut left = vec![0u8; surface.triangles.len()];
    let open = |t: usize| !seen.contains(t) && !certain(t);
    (0..left.len()).filter(|&t| open(t)).for_each(|t| left[t] = params.face_rays);
    weld.around(
        surface.triangles,
        |t| seen.contains(t),
        |t| left[t] = left[t].max(if open(t) { params.border_rays } else { 0 }),
    );
    let mut rays = 0;
    for round in 0..u32::from(params.face_rays) + 4 * u32::from(params.border_rays) {
        let aimed: Vec<u32> = model.ids.iter().copied().filter(|&t| left[t as usize] > 0).collect();
        if aimed.is_empty() {
            break;
        }
        aimed.iter().for_each(|&t| left[t as usize] -= 1);
        let share = |rounds: u32| f64::from(rounds) / f64::from(rounds + u32::from(params.face_rays.max(1)));
        let done = tell.within(DRAWN, 1.0).within(share(round), share(round + 1)).count(aimed.len());
        let before = seen.clone();
        let cast = AtomicU64::new(0);
        aimed.par_chunks(RUN).for_each(|run| {
            let random = room.eyes[hash3_u32(params.seed, round, run[0]) as usize % room.eyes.len()];
            let aim = |&t: &u32| {
                // Every second ray comes from where the face is seen most openly; by turns its front and its back.
                let eye = match round % 4 {
                    1 => room.most_open(surface, t, 1.0),
                    3 if !surface.is_single_sided(t as usize) => room.most_open(surface, t, -1.0),
                    _ => random,
                };
                let direction = point_on(surface, t, round, params.seed) - eye;
                Ray { origin: eye, direction, t_min: 0.0, t_max: f32::INFINITY }
            };
            let passes =
                |ray: &Ray| room.cell.windows.is_empty() || Gates::new(ray.origin, room.cell, SLACK).passes(ray.direction);
            let mut rays: Vec<Ray> = run.iter().map(aim).filter(passes).collect();
            let mut hits = Vec::new();
            sight.first(&mut rays, &mut hits);
            hits.iter().filter(|hit| hit.is_some()).for_each(|hit| seen.insert(hit.triangle as usize));
            cast.fetch_add(rays.len() as u64, Ordering::Relaxed);
            done.add(run.len());
        });
        rays += cast.into_inner();
        aimed.iter().filter(|&&t| seen.contains(t as usize)).for_each(|&t| left[t as usize] = 0);
        let is_new = |t: usize| seen.contains(t) && !before.contains(t);
        weld.around(surface.triangles, is_new, |t| {
            if !seen.contains(t) && !certain(t) {
                left[t] = params.border_rays;
            }
        });
    }
    rays
}

/// The k-th random point of a triangle.
fn point_on(surface: &Surface, triangle: u32, k: u32, seed: u32) -> Vec3 {
    let [a, b, c] = surface.triangles[triangle as usize].map(|i| surface.positions[i as usize]);
    let random = |which: u32| unit_f32(hash3_u32(seed ^ which, k, triangle));
    let (across, along) = (random(0x5851_f42d).sqrt(), random(0x1405_7b7e));
    a + across * ((b - a) + along * (c - b))
}
