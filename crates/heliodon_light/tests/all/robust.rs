//! The same answer however the work is divided; no trouble with unkind meshes.

#![expect(clippy::unwrap_used, reason = "a test that panics has failed")]

use crate::common;
use crate::common::{Lit, params};
use glam::Vec3;
use heliodon_light::{
    Baked, BouncedSun, GatherBlock, Layout, LightParams, MaskParams, PatchPlan, SunMasks, SunOnSurfaces, Surfaces, bake,
    bake_sun_masks, gather, light_patches, solve, vertex_masks,
};
use heliodon_testkit::hostile;
use heliodon_testkit::scenes::{ball, cuboid, ground, rectangle};
use proptest::prelude::*;
use std::ops::Range;

fn courtyard() -> Lit {
    let canopy = rectangle(Vec3::new(-0.7, 1.2, 0.7), Vec3::X * 1.4, Vec3::NEG_Z * 1.4, 3);
    let scene = ground(6.0, 24).and(cuboid(Vec3::new(-0.5, -0.1, -0.5), Vec3::new(0.5, 0.8, 0.5), 4)).and(canopy);
    Lit::new(scene.and(ball(0.4, 12).moved(Vec3::new(1.5, 0.2, 0.3))), 0.6)
}

fn suns() -> Vec<Vec3> {
    (0..37).map(|t| Vec3::new(t as f32 / 18.0 - 1.0, 0.7, 0.4).normalize_or_zero()).collect()
}

fn threads(count: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap()
}

/// The whole way with blocks of any size, each passed through its bytes.
fn bake_in_blocks(lit: &Lit, params: &LightParams, block: usize) -> Baked {
    let (surfaces, suns) = (lit.surfaces(), suns());
    let sight = Layout::new(&surfaces, params).unwrap().sight().to_vec();
    let mut layout = Layout::with_sight(&surfaces, params, Some(sight)).unwrap();
    let mut masks = SunMasks::default();
    for first in (0..layout.front_count()).step_by(block) {
        let range = first..(first + block).min(layout.front_count());
        let mask_params = MaskParams { points_at_once: 64 };
        masks.append(&bake_sun_masks(&surfaces, layout.points(), &suns, range, &mask_params).unwrap()).unwrap();
    }
    masks.validate().unwrap();
    let sun = Some(sun_in_blocks(&surfaces, &layout, &suns, &masks, params, block));
    let mut blocks: Vec<GatherBlock> = Vec::new();
    let mut round = 0..layout.points().len();
    while !round.is_empty() {
        for first in round.clone().step_by(block) {
            let done = gather(&surfaces, &layout, sun.as_ref(), first..(first + block).min(round.end), params).unwrap();
            blocks.push(GatherBlock::from_bytes(&done.to_bytes()).unwrap());
        }
        round = layout.add_back_sides(&surfaces, &blocks, params);
    }
    let light = solve(&surfaces, &layout, &blocks, sun.as_ref(), params).unwrap();
    let masks = vertex_masks(&layout, &masks, &light.validity);
    Baked { light, masks, gather_rays: blocks.iter().map(|b| b.rays).sum() }
}

/// Where the suns shine, in parts that were made the last first.
fn sun_in_blocks(
    surfaces: &Surfaces,
    layout: &Layout,
    suns: &[Vec3],
    masks: &SunMasks,
    params: &LightParams,
    block: usize,
) -> BouncedSun {
    let plan = PatchPlan::new(surfaces, layout, params);
    let ranges = plan.ranges(block);
    assert_eq!(
        ranges.iter().map(|range| plan.patch_count(range.clone())).sum::<usize>(),
        plan.patch_count(0..plan.triangle_count())
    );
    let light = |range: &Range<usize>| light_patches(surfaces, &plan, suns, range.clone(), params).unwrap();
    let mut lit: Vec<_> = ranges.iter().rev().map(light).collect();
    assert!(
        ranges.len() < 2 || SunOnSurfaces::new(surfaces, layout, plan.clone(), suns, lit.clone(), masks, params).is_err(),
        "out of order"
    );
    lit.reverse();
    assert!(SunOnSurfaces::new(surfaces, layout, plan.clone(), &suns[1..], lit.clone(), masks, params).is_err(), "another day");
    let sun = SunOnSurfaces::new(surfaces, layout, plan, suns, lit, masks, params).unwrap();
    let runs = SunOnSurfaces::curve_runs(layout);
    let curves = (0..runs).step_by(block).map(|first| sun.curves(surfaces, layout, first..(first + block).min(runs), params));
    let curves = curves.collect::<Vec<_>>().concat();
    sun.told_by(&curves, params)
}

#[test]
fn threads_blocks_and_memory_do_not_change_a_bit() {
    let lit = courtyard();
    let params = params(24, 3);
    let one = threads(1).install(|| bake(&lit.surfaces(), &suns(), true, &params).unwrap());
    one.light.validate().unwrap();
    let many = threads(4).install(|| bake(&lit.surfaces(), &suns(), true, &params).unwrap());
    assert!(one == many, "threads");
    assert!(threads(3).install(|| bake_in_blocks(&lit, &params, 700)) == one, "blocks of 700");
    let no_memory = LightParams { hit_budget_bytes: 0, ..params };
    let traced_again = bake(&lit.surfaces(), &suns(), true, &no_memory).unwrap();
    assert!(traced_again == one, "rays traced again for each bounce");
    assert!(threads(2).install(|| bake_in_blocks(&lit, &no_memory, 1024)) == one, "blocks without hits");
    let (surfaces, layout) = (lit.surfaces(), Layout::new(&lit.surfaces(), &params).unwrap());
    let gathered = |params: &LightParams| gather(&surfaces, &layout, None, 0..700, params).unwrap();
    let mut block = gathered(&params);
    block.stay_within_budget(&layout, &params);
    assert!(block == gathered(&params) && block.hits.iter().all(Option::is_some), "what fits stays");
    block.stay_within_budget(&layout, &no_memory);
    assert!(block == gathered(&no_memory), "a block of one with more memory");
}

#[test]
fn nine_coefficients_begin_with_the_four_and_rgb_of_grey_is_mono() {
    let lit = courtyard();
    let four = bake(&lit.surfaces(), &[], false, &params(24, 2)).unwrap().light;
    let nine = LightParams { coefficients: 9, channels: heliodon_light::Channels::Rgb, ..params(24, 2) };
    let nine = bake(&lit.surfaces(), &[], false, &nine).unwrap().light;
    for (a, b) in four.sky_transfer.chunks_exact(4).zip(nine.sky_transfer.chunks_exact(27)) {
        for i in 0..4 {
            assert!((0..3).all(|c| (a[i] - b[i * 3 + c]).abs() < 1e-5), "{a:?} {b:?}");
        }
    }
}

#[test]
fn vertices_inside_a_stone_borrow_from_outside() {
    // a tall box stands in the ground; its lower corners lie below
    let lit = Lit::new(ground(4.0, 20).and(cuboid(Vec3::new(-0.5, -0.5, -0.5), Vec3::new(0.5, 1.0, 0.5), 6)), 0.5);
    let baked = bake(&lit.surfaces(), &suns(), true, &params(64, 2)).unwrap();
    let validity = &baked.light.validity;
    let mut below = 0;
    for (v, p) in lit.scene.positions.iter().enumerate() {
        // the sides of the box below the ground, and the ground within the box; its underside looks into the open
        let sides = lit.scene.normals[v].y == 0.0;
        let inside = (p.y < -0.01 && sides) || (p.y == 0.0 && p.abs().max_element() < 0.49);
        if inside {
            below += 1;
            assert_eq!(validity.valid[v], 0, "{p} lies inside");
            let source = validity.source[v] as usize;
            assert!(lit.scene.normals[v].dot(lit.scene.normals[source]) > 0.9, "{p} borrows from another side");
            assert_eq!(validity.valid[source], 1, "{p} borrows from {}", lit.scene.positions[source]);
            assert_eq!(baked.masks.of_point(v), baked.masks.of_point(source));
        } else if p.y > 0.01 || (p.y == 0.0 && p.abs().max_element() > 0.6) {
            assert_eq!(validity.valid[v], 1, "{p} lies outside");
        }
    }
    assert!(below > 50);
}

#[test]
fn a_beams_end_within_a_block_lies_inside_even_where_other_beams_hide_the_block() {
    // a corridor of four beams through a block and out of it on both sides; a fifth ends in its middle and sees hardly anything else
    let block = cuboid(Vec3::splat(-1.0), Vec3::ONE, 8);
    let (near, far) = (0.11, 0.2);
    let around = [(-far, -far, far, -near), (-far, near, far, far), (-far, -near, -near, near), (near, -near, far, near)];
    let beam = |x: f32, (y0, z0, y1, z1)| cuboid(Vec3::new(-1.5, y0, z0), Vec3::new(x, y1, z1), 12);
    let scene = around.into_iter().fold(block, |scene, around| scene.and(beam(1.5, around)));
    let first = scene.positions.len();
    let lit = Lit::new(scene.and(beam(0.0, (-0.1, -0.1, 0.1, 0.1))), 0.5);
    let light = bake(&lit.surfaces(), &[], false, &params(128, 2)).unwrap().light;
    let mut within = 0;
    for v in (first..light.vertex_count()).filter(|&v| lit.scene.positions[v].x > -0.8) {
        within += 1;
        assert_eq!(light.validity.valid[v], 0, "{} is said to be outside", lit.scene.positions[v]);
    }
    assert!(within > 50);
    let outside = (0..first).filter(|&v| lit.scene.positions[v].abs().max_element() > 1.2);
    for v in outside.filter(|&v| lit.scene.positions[v].abs().min_element() > 0.15) {
        assert_eq!(light.validity.valid[v], 1, "{} is said to be inside", lit.scene.positions[v]);
    }
}

#[test]
fn a_shaft_whose_corners_all_lie_inside_others_is_lit_by_its_middle() {
    // as a column of long faces whose rings stand in its base and its capital
    let base = cuboid(Vec3::new(-0.3, -0.2, -0.3), Vec3::new(0.3, 0.0, 0.3), 8);
    let capital = cuboid(Vec3::new(-0.3, 1.0, -0.3), Vec3::new(0.3, 1.2, 0.3), 8);
    let shaft = cuboid(Vec3::new(-0.1, -0.05, -0.1), Vec3::new(0.1, 1.05, 0.1), 1);
    let first = base.positions.len() + capital.positions.len();
    let lit = Lit::new(base.and(capital).and(shaft), 0.5);
    let params = LightParams { cell_size_m: Some(0.1), ..params(128, 2) };
    let light = bake(&lit.surfaces(), &suns(), true, &params).unwrap().light;
    light.validate().unwrap();
    let sides: Vec<usize> = (first..light.vertex_count()).filter(|&v| lit.scene.normals[v].y == 0.0).collect();
    assert_eq!(sides.len(), 16);
    for v in sides {
        assert_eq!(light.validity.valid[v], 0);
        let open = light.sky_transfer[v * 4] * common::UNIFORM_SKY;
        assert!((0.2..1.0).contains(&open), "light {open} at {}", lit.scene.positions[v]);
    }
}

#[test]
fn hostile_meshes_do_no_harm() {
    for hostile in hostile::meshes() {
        let Ok(rays) = heliodon_rays::TriangleScene::build(
            &hostile.scene.positions,
            &hostile.scene.triangles,
            &heliodon_rays::BuildParams::default(),
        ) else {
            continue;
        };
        let lit = Lit { scene: hostile.scene, rays, albedo: heliodon_light::ConstantAlbedo(Vec3::splat(0.5)) };
        let params = LightParams { max_sub_cells: 2000, ..params(8, 2) };
        let baked = bake(&lit.surfaces(), &suns(), true, &params).unwrap_or_else(|e| panic!("{}: {e}", hostile.name));
        baked.light.validate().unwrap_or_else(|e| panic!("{}: {e}", hostile.name));
        baked.masks.validate().unwrap_or_else(|e| panic!("{}: {e}", hostile.name));
        assert_eq!(baked.light.vertex_count(), lit.scene.positions.len());
    }
}

#[test]
fn a_kilometre_away_light_is_the_same() {
    let near = courtyard();
    // a power of two keeps the offsets of all vertices exact enough to compare
    let far = Lit::new(near.scene.clone().moved(Vec3::new(1024.0, -1024.0, 512.0)), 0.6);
    let params = LightParams { offset_m: 2e-3, ..params(64, 2) };
    let [near, far] = [near, far].map(|lit| bake(&lit.surfaces(), &[], false, &params).unwrap().light);
    let mut differences: Vec<f32> = near.sky_transfer.iter().zip(&far.sky_transfer).map(|(a, b)| (a - b).abs()).collect();
    differences.sort_unstable_by(f32::total_cmp);
    // coordinates there are multiples of 1/16384 m: a ray that passes an edge may now meet it, which changes a coefficient by up
    // to 2 / 64 * 0.49; hardly a point has more than three such rays
    let [p90, p99] = [90, 99].map(|p| differences[differences.len() * p / 100]);
    assert!(p90 < 0.5 / 64.0 && p99 < 3.0 / 64.0, "90th percentile {p90}, 99th {p99}");
}

#[test]
fn wrong_input_is_told_not_suffered() {
    let lit = Lit::new(ground(1.0, 2), 0.5);
    let surfaces = lit.surfaces();
    let bad = |params: LightParams| bake(&surfaces, &[], false, &params).is_err();
    assert!(bad(LightParams { samples: 0, ..params(8, 1) }));
    assert!(bad(LightParams { coefficients: 5, ..params(8, 1) }));
    assert!(bad(LightParams { offset_m: f32::NAN, ..params(8, 1) }));
    assert!(bad(LightParams { cell_size_m: Some(0.0), ..params(8, 1) }));
    assert!(bake(&surfaces, &vec![Vec3::Y; 1025], false, &params(8, 1)).is_err());
    assert!(bake(&surfaces, &[Vec3::NAN, Vec3::ZERO], true, &params(8, 1)).is_ok());
    let short = heliodon_light::Surfaces { normals: &lit.scene.normals[1..], ..surfaces };
    assert!(bake(&short, &[], false, &params(8, 1)).is_err());
    let triangles = [[0, 1, 99]];
    let beyond = heliodon_light::Surfaces { triangles: &triangles, ..surfaces };
    assert!(bake(&beyond, &[], false, &params(8, 1)).is_err());
    let layout = Layout::new(&surfaces, &params(8, 1)).unwrap();
    let all = gather(&surfaces, &layout, None, 0..layout.points().len(), &params(8, 1)).unwrap();
    assert!(solve(&surfaces, &layout, &[], None, &params(8, 1)).is_err());
    assert!(solve(&surfaces, &layout, &[all.clone(), all.clone()], None, &params(8, 1)).is_err());
    assert!(solve(&surfaces, &layout, std::slice::from_ref(&all), None, &params(16, 1)).is_err());
    let sun = BouncedSun::new(&surfaces, &layout, &[Vec3::Y], &params(8, 1)).unwrap();
    assert!(solve(&surfaces, &layout, &[all], sun.as_ref(), &params(8, 1)).is_err(), "gathered without that sun");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn soups_of_triangles_are_lit_with_finite_numbers(
        corners in prop::collection::vec(prop::array::uniform3(-1.0_f32..1.0), 3..60),
        scale in prop::sample::select(vec![1e-6_f32, 1.0, 1e4]),
    ) {
        let positions: Vec<Vec3> = corners.iter().map(|&c| Vec3::from_array(c) * scale).collect();
        let triangles: Vec<[u32; 3]> = (0..positions.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let normals: Vec<Vec3> = positions.iter().map(|p| p.normalize_or_zero()).collect();
        let lit = Lit::new(heliodon_testkit::scenes::Scene { positions, normals, triangles }, 0.5);
        let params = LightParams { max_sub_cells: 500, offset_m: 1e-4 * scale, ..params(8, 2) };
        let baked = bake(&lit.surfaces(), &[Vec3::Y, Vec3::X], true, &params).unwrap();
        prop_assert!(baked.light.validate().is_ok());
        // no more light than the sky has, bounces at albedo 1/2 included
        let open = baked.light.sky_transfer.chunks_exact(4).map(|t| t[0] * common::UNIFORM_SKY).fold(0.0, f32::max);
        prop_assert!(open <= 1.0 + 1e-3, "{open}");
    }
}
