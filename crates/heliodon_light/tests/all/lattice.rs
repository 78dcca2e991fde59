//! The light of lattices in free space, against what can be reckoned.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use crate::common::{Lit, UNIFORM_SKY, params};
use glam::Vec3;
use heliodon_light::{
    BouncedSun, LatticeLight, Layout, LightParams, MaskParams, VertexLight, bake_sun_masks, gather, lattice_places, solve_all,
};
use heliodon_math::frame::unit_or;
use heliodon_testkit::scenes::{Scene, cuboid, ground};
use std::ops::Range;

/// Where a lattice of these cells lies.
fn places(cells: &[[u32; 3]], origin: Vec3, spacing_m: f32) -> Vec<Vec3> {
    cells.iter().map(|cell| origin + spacing_m * Vec3::from_array(cell.map(|c| c as f32))).collect()
}

/// A row of cells along +X.
fn row(count: u32) -> Vec<[u32; 3]> {
    (0..count).map(|x| [x, 0, 0]).collect()
}

struct Baked {
    lattice: LatticeLight,
    of_vertices: VertexLight,
}

/// Everything from the layout on, the points in free space in blocks of so many.
fn bake(lit: &Lit, suns: &[Vec3], cells: &[[u32; 3]], positions: &[Vec3], params: &LightParams, per_block: usize) -> Baked {
    let surfaces = lit.surfaces();
    let mut layout = Layout::new(&surfaces, params).unwrap();
    let sun = BouncedSun::new(&surfaces, &layout, suns, params).unwrap();
    let mut blocks = vec![gather(&surfaces, &layout, sun.as_ref(), 0..layout.points().len(), params).unwrap()];
    // as a shard does that knows no back sides
    let mut early = layout.clone();
    let early_free = early.add_free_points(&lattice_places(positions));
    let backs = layout.add_back_sides(&surfaces, &blocks, params);
    blocks.push(gather(&surfaces, &layout, sun.as_ref(), backs, params).unwrap());
    let free = layout.add_free_points(&lattice_places(positions));
    let ranges: Vec<Range<usize>> =
        free.clone().step_by(per_block).map(|first| first..(first + per_block).min(free.end)).collect();
    for range in ranges {
        let block = gather(&surfaces, &layout, sun.as_ref(), range.clone(), params).unwrap();
        let early_range = range.start - free.start + early_free.start..range.end - free.start + early_free.start;
        let of_shard = gather(&surfaces, &early, sun.as_ref(), early_range, params).unwrap();
        assert_eq!(of_shard.moved_to(range.start), block);
        block.validate(&layout, sun.as_ref().map_or(0, BouncedSun::function_count), params).unwrap();
        blocks.push(block);
    }
    let (of_vertices, light) = solve_all(&surfaces, &layout, &blocks, sun.as_ref(), params, None, None).unwrap();
    light.validate(&of_vertices).unwrap();
    let masks = bake_sun_masks(&surfaces, layout.points(), suns, free, &MaskParams::default()).unwrap();
    let lattice = LatticeLight::new(cells, light, &layout.free_masks(&masks)).unwrap();
    lattice.validate().unwrap();
    Baked { lattice, of_vertices }
}

/// The light of a uniform sky of radiance 1 on the six sides of a point.
fn sky(lattice: &LatticeLight, point: usize) -> [f32; 6] {
    std::array::from_fn(|axis| lattice.sky_transfer[(6 * point + axis) * 4] * UNIFORM_SKY)
}

/// A slab over all that lies at x < 0, its underside 3 m up.
fn half_roofed() -> Lit {
    Lit::new(cuboid(Vec3::new(-40.0, 3.0, -40.0), Vec3::new(0.0, 3.2, 40.0), 8), 0.0)
}

#[test]
fn beneath_a_wide_roof_it_is_dark_and_the_sun_comes_as_far_as_its_slope_allows() {
    let lit = half_roofed();
    let cells = row(64);
    let positions = places(&cells, Vec3::new(-15.75, 1.0, 0.0), 0.5);
    let suns = [Vec3::Y, unit_or(Vec3::new(1.0, 1.0, 0.0), Vec3::Y), Vec3::X, Vec3::ZERO];
    let baked = bake(&lit, &suns, &cells, &positions, &params(1024, 0), 1024);
    let lattice = &baked.lattice;
    assert!(lattice.valid.iter().all(|&valid| valid == 1));
    for (point, at) in positions.iter().enumerate() {
        assert_eq!(lattice.masks.is_lit(point, 0), at.x > 0.0, "{at}");
        assert_eq!(lattice.masks.is_lit(point, 1), at.x > -2.0, "{at}");
        assert!(lattice.masks.is_lit(point, 2), "along the horizon, which only one of the six sides faces");
        assert!(!lattice.masks.is_lit(point, 3), "a step without a sun");
        // of what a side facing up sees, the edge of a half plane cuts (1 - x / r) / 2; the far edges 40 m off add little. From outside
        // the edge is that of the slab's upper side.
        let along = (1.0 + at.x / at.x.hypot(if at.x > 0.0 { 2.2 } else { 2.0 })) / 2.0;
        let six = sky(lattice, point);
        assert!((six[2] - along).abs() < 0.01, "{at}: {} and not {along}", six[2]);
        assert!((six[3] - 1.0).abs() < 0.005, "{at}: nothing lies below, {}", six[3]);
    }
    let (deep, open) = (sky(lattice, 0), sky(lattice, 63));
    assert!(deep[2] < 0.01 && open[2] > 0.99, "{deep:?} {open:?}");
}

/// A box seen from inside: its fronts look inwards, and another around it makes it a wall.
fn closed_room() -> Scene {
    cuboid(Vec3::splat(-2.0), Vec3::splat(2.0), 8).inside_out().and(cuboid(Vec3::splat(-2.5), Vec3::splat(2.5), 8))
}

#[test]
fn a_closed_box_is_dark_and_its_walls_take_light_of_the_nearest_open_point() {
    let lit = Lit::new(closed_room(), 0.5);
    let cells = row(24);
    // from the middle through the wall, from 2 to 2.5 m, into the open
    let positions = places(&cells, Vec3::new(0.125, 0.1, 0.07), 0.25);
    let baked = bake(&lit, &[Vec3::Y], &cells, &positions, &params(256, 4), 1024);
    for (point, at) in positions.iter().enumerate() {
        let six = sky(&baked.lattice, point);
        let within = (2.0..2.5).contains(&at.x);
        assert_eq!(baked.lattice.valid[point] == 0, within, "{at}");
        match baked.lattice.source[point] as usize {
            from if from != point => {
                assert!(within && positions[from].distance(*at) <= 0.26);
                assert_eq!(six, sky(&baked.lattice, from));
            }
            _ if at.x < 2.0 => assert!(six.iter().all(|light| *light == 0.0), "{at}: {six:?}"),
            _ => assert!(six[0] > 0.99 && baked.lattice.masks.is_lit(point, 0), "{at}: {six:?}"),
        }
    }
}

#[test]
fn a_wide_ground_reflects_what_it_gets() {
    let lit = Lit::new(ground(200.0, 64), 0.5);
    let cells = [[0, 0, 0], [0, 1, 0], [0, 4, 0]];
    let positions = places(&cells, Vec3::new(0.1, -0.2, 0.1), 0.5);
    let suns = [Vec3::Y, Vec3::new(0.6, 0.8, 0.0)];
    let Baked { lattice, .. } = bake(&lit, &suns, &cells, &positions, &params(1024, 2), 1024);
    assert_eq!(lattice.valid, [0, 1, 1], "below the sheet of ground");
    for point in 1..3 {
        let six = sky(&lattice, point);
        for (axis, expected) in [0.75, 0.75, 1.0, 0.5, 0.75, 0.75].into_iter().enumerate() {
            assert!((six[axis] - expected).abs() < 0.01, "{six:?}");
        }
    }
    assert_eq!(sky(&lattice, 0), sky(&lattice, 1), "filled");
    assert!(!lattice.sun_bounce.is_empty());
}

#[test]
fn the_light_of_vertices_is_the_same_with_and_without_and_all_of_it_for_any_division() {
    let scene = ground(12.0, 24).and(cuboid(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 2.0, 1.0), 6));
    let lit = Lit::new(scene, 0.5);
    let cells: Vec<[u32; 3]> = (0..12 * 12 * 5).map(|i| [i % 12, i / 12 % 5, i / 60]).collect();
    let positions = places(&cells, Vec3::new(-2.8, -0.3, -2.8), 0.5);
    let suns: Vec<Vec3> = (0..40).map(|t| unit_or(Vec3::new(t as f32 - 20.0, 12.0, 5.0), Vec3::Y)).collect();
    let params = params(64, 3);
    let all = bake(&lit, &suns, &cells, &positions, &params, 8192);
    let few = bake(&lit, &suns, &cells, &positions, &LightParams { hit_budget_bytes: 0, ..params.clone() }, 1024);
    let none = bake(&lit, &suns, &[], &[], &params, 1024);
    assert!(all.lattice == few.lattice && all.of_vertices == few.of_vertices && all.of_vertices == none.of_vertices);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let single = pool.install(|| bake(&lit, &suns, &cells, &positions, &params, 2048));
    assert!(all.lattice == single.lattice);
    assert!(all.lattice.valid.contains(&0) && all.lattice.valid.contains(&1));
}
