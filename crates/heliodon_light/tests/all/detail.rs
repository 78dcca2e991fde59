//! Light at the vertices of a simplification, among the triangles that were simplified.

#![expect(clippy::unwrap_used, reason = "a test that panics has failed")]

use crate::common::{Lit, UNIFORM_SKY, params};
use glam::Vec3;
use heliodon_light::{
    Baked, Detail, Layout, LightError, LightParams, MaskParams, PatchPlan, SunOnSurfaces, Surfaces, bake, bake_sun_masks,
    light_patches,
};
use heliodon_testkit::scenes::{Scene, cuboid, ground, rectangle};
use std::ops::Range;

/// A room open to the south, with a block on its floor: faces of `parts` pieces an edge.
fn room(parts: u32) -> Scene {
    let (x, y, z) = (Vec3::X * 4.0, Vec3::Y * 3.0, Vec3::Z * 4.0);
    rectangle(Vec3::ZERO, z, x, parts)
        .and(rectangle(y, x, z, parts))
        .and(rectangle(Vec3::ZERO, y, z, parts))
        .and(rectangle(x, z, y, parts))
        .and(rectangle(Vec3::ZERO, x, y, parts))
        .and(cuboid(Vec3::new(1.5, 0.0, 1.5), Vec3::new(2.5, 1.0, 2.5), parts / 2))
}

/// For each triangle of `fine` the one of `coarse` that has the nearest centre among those that look the same way.
fn stand_ins(fine: &Scene, coarse: &Scene) -> Vec<u32> {
    let of = |scene: &Scene| -> Vec<(Vec3, Vec3)> {
        let corners = scene.triangles.iter().map(|t| t.map(|i| scene.positions[i as usize]));
        corners.map(|[a, b, c]| ((a + b + c) / 3.0, (b - a).cross(c - a).normalize_or_zero())).collect()
    };
    let coarse = of(coarse);
    let nearest = |(centre, normal): (Vec3, Vec3)| {
        let same_way = (0..coarse.len()).filter(|&t| coarse[t].1.dot(normal) > 0.5);
        same_way.min_by(|&a, &b| coarse[a].0.distance(centre).total_cmp(&coarse[b].0.distance(centre))).unwrap() as u32
    };
    of(fine).into_iter().map(nearest).collect()
}

fn among(fine: &Lit, coarse: &Lit, stands_for: &[u32], clearance_m: &[f32], params: &LightParams, suns: &[Vec3]) -> Baked {
    let detail = Some(Detail { stands_for, clearance_m, shown: &[] });
    let surfaces = Surfaces { rays: &fine.rays, detail, ..coarse.surfaces() };
    bake(&surfaces, suns, !suns.is_empty(), params).unwrap()
}

fn uniform(baked: &Baked, vertex: usize) -> f32 {
    baked.light.sky_light(vertex, &[Vec3::splat(UNIFORM_SKY), Vec3::ZERO, Vec3::ZERO, Vec3::ZERO]).x
}

#[test]
fn what_stands_for_itself_changes_no_bit() {
    let lit = Lit::new(room(6), 0.6);
    let params = params(128, 3);
    let suns = [Vec3::new(0.3, 0.8, 0.52), Vec3::new(-0.5, 0.5, 0.7)].map(Vec3::normalize_or_zero);
    let plain = bake(&lit.surfaces(), &suns, true, &params).unwrap();
    let itself: Vec<u32> = (0..lit.scene.triangles.len() as u32).collect();
    let same = among(&lit, &lit, &itself, &vec![0.0; lit.scene.positions.len()], &params, &suns);
    assert_eq!(plain.masks, same.masks);
    // places of hits are rounded otherwise, which moves a few of them over the border of a patch or a cell
    let pairs = plain.light.sky_transfer.iter().zip(&same.light.sky_transfer);
    let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(worst < 2e-3, "{worst}");
}

#[test]
fn light_at_few_vertices_is_that_of_the_fine_room() {
    let (fine, coarse) = (Lit::new(room(16), 0.7), Lit::new(room(8), 0.7));
    let stands_for = stand_ins(&fine.scene, &coarse.scene);
    let params = params(128, 4);
    let suns = [Vec3::new(0.3, 0.8, 0.52).normalize_or_zero()];
    let whole = bake(&fine.surfaces(), &suns, true, &params).unwrap();
    let few = among(&fine, &coarse, &stands_for, &vec![0.0; coarse.scene.positions.len()], &params, &suns);
    let (mut compared, mut sky, mut sun) = (0, [0.0; 2], [0.0; 2]);
    for (v, (place, normal)) in coarse.scene.positions.iter().zip(&coarse.scene.normals).enumerate() {
        let same = |&w: &usize| fine.scene.positions[w].distance(*place) < 1e-4 && fine.scene.normals[w].dot(*normal) > 0.99;
        let Some(w) = (0..fine.scene.positions.len()).find(same) else { continue };
        if few.light.validity.valid[v] == 0 || whole.light.validity.valid[w] == 0 {
            continue;
        }
        let add = |sums: &mut [f32; 2], a: f32, b: f32| {
            sums[0] += (a - b).abs();
            sums[1] += b;
        };
        add(&mut sky, uniform(&few, v), uniform(&whole, w));
        add(&mut sun, few.light.bounced_sun(v, 0).x, whole.light.bounced_sun(w, 0).x);
        compared += 1;
    }
    // where walls meet, vertices half a metre apart know less than those a quarter apart
    assert!(compared > 300 && sky[0] < 0.03 * sky[1] && sun[0] < 0.05 * sun[1], "{compared}: {sky:?} {sun:?}");
}

#[test]
fn simplified_stone_does_not_shadow_itself() {
    // rough ground, a centimetre deep, and the plane of its mean that stands for it
    let mut rough = ground(1.0, 64);
    let height = |i: usize| if i.is_multiple_of(2) { 0.01 } else { -0.01 };
    rough.positions.iter_mut().enumerate().for_each(|(i, p)| p.y += height(i + i / 65));
    let (rough, flat) = (Lit::new(rough, 0.0), Lit::new(ground(1.0, 8), 0.0));
    let stands_for = stand_ins(&rough.scene, &flat.scene);
    let count = flat.scene.positions.len();
    let light_with = |clearance: f32| {
        let suns = [Vec3::new(0.8, 0.6, 0.0)];
        let baked = among(&rough, &flat, &stands_for, &vec![clearance; count], &params(256, 0), &suns);
        let lit = (0..count).filter(|&v| baked.masks.is_lit(v, 0)).count() as f32 / count as f32;
        (lit, (0..count).map(|v| uniform(&baked, v)).sum::<f32>() / count as f32)
    };
    let (lit, light) = light_with(0.0101);
    assert!(lit == 1.0 && (light - 1.0).abs() < 1e-3, "{lit} {light}");
    let (lit, light) = light_with(0.0);
    assert!(lit < 0.8 && light < 0.95, "without clearance it would: {lit} {light}");
}

#[test]
fn the_day_is_told_by_what_is_shown() {
    let (shown, mut hidden) = (room(8), room(8));
    hidden.positions.iter_mut().for_each(|p| p.x += 20.0);
    let (vertices, triangles) = (shown.positions.len(), shown.triangles.len());
    let lit = Lit::new(shown.and(hidden), 0.6);
    let itself: Vec<u32> = (0..lit.scene.triangles.len() as u32).collect();
    let clearance_m = vec![0.0; lit.scene.positions.len()];
    let (suns, params) = ([Vec3::new(0.3, 0.8, 0.52).normalize_or_zero()], params(64, 1));
    // how many points decide, and whether all of them are shown
    let decide = |shown: &[Range<usize>]| {
        let detail = Some(Detail { stands_for: &itself, clearance_m: &clearance_m, shown });
        let surfaces = Surfaces { detail, ..lit.surfaces() };
        let layout = Layout::new(&surfaces, &params).unwrap();
        let plan = PatchPlan::new(&surfaces, &layout, &params);
        let sunlit = light_patches(&surfaces, &plan, &suns, 0..plan.triangle_count(), &params).unwrap();
        let fronts = 0..layout.front_count();
        let masks = bake_sun_masks(&surfaces, layout.points(), &suns, fronts, &MaskParams::default()).unwrap();
        let sun = SunOnSurfaces::new(&surfaces, &layout, plan, &suns, vec![sunlit], &masks, &params).unwrap();
        let runs = 0..SunOnSurfaces::curve_runs(&layout);
        let (_, traces) = sun.curves_knowing(&surfaces, &layout, runs, &params, None);
        let points: Vec<usize> = traces.into_iter().flat_map(|traces| traces.range).collect();
        (points.len(), points.iter().all(|&point| layout.points().origins[point].x < 15.0))
    };
    let ((all, of_all), (few, of_few)) = (decide(&[]), decide(&[0..triangles / 2, triangles / 2..triangles]));
    assert!(!of_all && of_few && few > vertices / 2 && few <= all / 2, "{few} of {all}");
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let lit = Lit::new(ground(1.0, 2), 0.5);
    let (vertices, triangles) = (lit.scene.positions.len(), lit.scene.triangles.len());
    let refused = |stands_for: &[u32], clearance_m: &[f32]| {
        let surfaces = Surfaces { detail: Some(Detail { stands_for, clearance_m, shown: &[] }), ..lit.surfaces() };
        matches!(bake(&surfaces, &[], false, &params(16, 1)), Err(LightError::Mismatch(_)))
    };
    assert!(!refused(&vec![0; triangles], &vec![0.0; vertices]));
    assert!(refused(&vec![triangles as u32; triangles], &vec![0.0; vertices]));
    assert!(refused(&vec![0; triangles - 1], &vec![0.0; vertices]), "one for each triangle of the rays");
    assert!(refused(&vec![0; triangles], &vec![0.0; vertices - 1]));
    assert!(refused(&vec![0; triangles], &vec![f32::NAN; vertices]));
    let beyond = [0..1, 1..triangles + 1];
    let detail = Detail { stands_for: &vec![0; triangles], clearance_m: &vec![0.0; vertices], shown: &beyond };
    let surfaces = Surfaces { detail: Some(detail), ..lit.surfaces() };
    assert!(matches!(bake(&surfaces, &[], false, &params(16, 1)), Err(LightError::Mismatch(_))), "shown and not there");
}
