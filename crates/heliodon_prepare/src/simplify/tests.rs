//! Tests of the whole of simplification; tiles are small, so that most vertices are near a rim.

use super::*;
use crate::interim::tests::Shelf;
use crate::{Screen, ViewCell};
use glam::{Vec2, Vec3};
use heliodon_image::SrgbImage;
use heliodon_math::frame::unit_or;
use heliodon_mesh::{Texture, TextureWrap};
use heliodon_testkit::scenes::{Scene, rectangle};
use proptest::prelude::*;
use std::collections::HashMap;

const TILE: usize = 3000;

fn simplify_in_tiles(mesh: &Mesh, views: &Views, params: &SimplifyParams, most: usize) -> Simplified {
    simplify_for((mesh, &Held::NOTHING), None, views, params, most, (&Nowhere, Tell::NOBODY))
}

fn nowhere() -> Views {
    Views { cells: Vec::new(), screen: Screen { width_px: 1024, height_px: 768, fov_rad: 1.0 } }
}

/// Tolerances in metres, geometry alone.
fn metres(error_m: f32, edge_m: f32) -> SimplifyParams {
    SimplifyParams { error_m, edge_m, normal_weight: 0.0, color_weight: 0.0, ..SimplifyParams::screen() }
}

fn mesh(scene: Scene) -> Mesh {
    Mesh { positions: scene.positions, normals: scene.normals, triangles: scene.triangles, ..Mesh::default() }
}

/// A closed ball of radius 1 of an octahedron's halved triangles.
fn ball(halvings: u32) -> Mesh {
    let mut positions = vec![Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
    let mut triangles = vec![[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5_u32]];
    for _ in 0..halvings {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push(unit_or(positions[a as usize] + positions[b as usize], Vec3::Y));
                positions.len() as u32 - 1
            })
        };
        let halve = |[a, b, c]: [u32; 3]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        triangles = triangles.into_iter().flat_map(halve).collect();
    }
    Mesh { normals: positions.clone(), positions, triangles, ..Mesh::default() }
}

/// A number in [-1, 1] for the index.
fn noise(seed: u32, index: usize) -> f32 {
    let mixed = (index as u64 ^ u64::from(seed) << 40).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    ((mixed ^ mixed >> 32).wrapping_mul(0xD6E8_FEB8_6659_FD93) >> 40) as f32 / (1 << 23) as f32 - 1.0
}

/// A rectangle in the plane z = 0, its inner vertices scattered in it by up to `shift` of a square's side.
fn scattered(size: Vec2, parts: u32, shift: f32) -> Mesh {
    let mut mesh = mesh(rectangle(Vec3::ZERO, Vec3::X * size.x, Vec3::Y * size.y, parts));
    let step = size / parts as f32;
    for (index, p) in mesh.positions.iter_mut().enumerate() {
        let [column, row] = [index as u32 % (parts + 1), index as u32 / (parts + 1)];
        let inside = !column.is_multiple_of(parts) && !row.is_multiple_of(parts);
        if inside {
            *p += shift * Vec3::new(step.x * noise(1, index), step.y * noise(2, index), 0.0);
        }
    }
    mesh
}

fn edges_m(mesh: &Mesh) -> Vec<f32> {
    let of = |t: &[u32; 3]| {
        let p = t.map(|v| mesh.positions[v as usize]);
        [p[0].distance(p[1]), p[1].distance(p[2]), p[2].distance(p[0])]
    };
    let mut edges: Vec<f32> = mesh.triangles.iter().flat_map(of).collect();
    edges.sort_by(f32::total_cmp);
    edges
}

fn area_m2(mesh: &Mesh, of: impl Fn(usize) -> bool) -> f64 {
    let area = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        f64::from(0.5 * (b - a).cross(c - a).length())
    };
    (0..mesh.triangles.len()).filter(|&t| of(t)).map(area).sum()
}

/// How often each edge occurs, by position and direction.
fn edge_counts(mesh: &Mesh) -> HashMap<[[u32; 3]; 2], i32> {
    let mut counts = HashMap::new();
    let place = |v: u32| (mesh.positions[v as usize] + Vec3::ZERO).to_array().map(f32::to_bits);
    for t in &mesh.triangles {
        for i in 0..3 {
            let (a, b) = (place(t[i]), place(t[(i + 1) % 3]));
            *counts.entry([a.min(b), a.max(b)]).or_insert(0) += if a < b { 1 } else { -1 };
        }
    }
    counts
}

#[test]
fn a_ball_stays_round_within_the_tolerance() {
    let original = ball(7);
    for error_m in [0.1, 0.06] {
        let params = metres(error_m, 2.0);
        let simplified = simplify_in_tiles(&original, &nowhere(), &params, 20 * TILE);
        let (before, after) = (original.triangles.len(), simplified.mesh.triangles.len());
        assert!(after * 200 < before, "{after} of {before}");
        let report = measure(&original, &simplified.mesh, &nowhere(), &params).report;
        // A chord of the length l has the height l^2 / 8; nothing lies outside the ball.
        let sag = |p: Vec3| 1.0 - p.length();
        let deepest = (0..after).map(|t| sag(closest::center(&simplified.mesh, t))).fold(0.0, f32::max);
        assert!(deepest < 2.0 * error_m && deepest > 0.3 * error_m, "{deepest}");
        for distances in [report.from_original, report.from_simplified] {
            assert!(distances.p95_m < error_m && distances.max_m < 2.0 * error_m, "{report:?}");
        }
        assert!(report.from_original.mean_m > 0.1 * error_m, "measured at all");
    }
}

#[test]
fn a_plain_wall_keeps_vertices_for_its_light() {
    let original = scattered(Vec2::ONE, 250, 0.3);
    for (error_m, edge_m) in [(0.03, 0.03), (0.01, 0.03), (0.004, 0.05)] {
        let simplified = simplify_in_tiles(&original, &nowhere(), &metres(error_m, edge_m), TILE * 10);
        let edges = edges_m(&simplified.mesh);
        let at = |part: f64| edges[((edges.len() - 1) as f64 * part) as usize] / edge_m;
        let [longest, most, half] = [1.0, 0.95, 0.5].map(at);
        assert!(longest < 2.0 && most < 1.15 && half > 0.4 && half < 0.8, "{longest} {most} {half}");
        assert!((area_m2(&simplified.mesh, |_| true) - 1.0).abs() < 1e-4, "no fold, no hole");
    }
}

#[test]
fn density_falls_with_the_square_of_the_distance() {
    let cell = ViewCell { low: Vec3::new(-0.5, 0.0, -0.5), high: Vec3::new(0.5, 1.0, 0.5), windows: Vec::new() };
    let views = Views { cells: vec![cell], ..nowhere() };
    let wall = |z: f32| {
        let mut wall = scattered(Vec2::splat(4.0), 400, 0.3);
        wall.positions.iter_mut().for_each(|p| *p += Vec3::new(-2.0, -1.5, 0.5 + z));
        let simplified = simplify_in_tiles(&wall, &views, &SimplifyParams::screen(), 10 * TILE);
        simplified.mesh.triangles.len() as f32
    };
    let (near, far) = (wall(10.0), wall(20.0));
    assert!((3.4..4.4).contains(&(near / far)), "{near} and {far}");
}

#[test]
fn a_closed_surface_stays_closed_across_tiles() {
    let mut original = ball(6);
    // Vertices of one position move alike.
    let moved = |p: &Vec3| *p * (1.0 + 0.003 * (40.0 * p.x).sin() * (50.0 * p.y).cos() + 0.002 * (70.0 * p.z).sin());
    original.positions = original.positions.iter().map(moved).collect();
    assert!(edge_counts(&original).values().all(|&n| n == 0), "closed to begin with");
    let simplified = simplify_in_tiles(&original, &nowhere(), &metres(0.02, 0.3), TILE);
    assert!(simplified.report.passes[0].tiles > 8);
    assert!(simplified.mesh.triangles.len() * 8 < original.triangles.len());
    assert!(edge_counts(&simplified.mesh).values().all(|&n| n == 0));
    // Rims are finished by later passes: as dense as if there were none.
    let whole = simplify_in_tiles(&original, &nowhere(), &metres(0.02, 0.3), usize::MAX);
    let (tiled, whole) = (simplified.mesh.triangles.len(), whole.mesh.triangles.len());
    assert!(tiled < whole * 13 / 10, "{tiled} and {whole}");
}

#[test]
fn vertices_are_those_of_the_original() {
    let mut original = scattered(Vec2::new(2.0, 1.0), 100, 0.3);
    original.colors_linear = (0..original.positions.len()).map(|i| Vec3::splat(0.5 + 0.1 * noise(5, i))).collect();
    let simplified = simplify_in_tiles(
        &original,
        &nowhere(),
        &SimplifyParams { error_m: 0.02, edge_m: 0.1, ..SimplifyParams::screen() },
        TILE,
    );
    let report = &simplified.report;
    assert_eq!((report.triangles_before, report.vertices_before), (20_000, 101 * 101));
    assert_eq!(
        (report.triangles_after, report.vertices_after),
        (simplified.mesh.triangles.len(), simplified.mesh.positions.len())
    );
    assert!(report.triangles_after < 10_000);
    assert_eq!(simplified.original_vertex.len(), simplified.mesh.positions.len());
    for (vertex, &was) in simplified.original_vertex.iter().enumerate() {
        assert_eq!(simplified.mesh.positions[vertex], original.positions[was as usize]);
        assert_eq!(simplified.mesh.normals[vertex], original.normals[was as usize]);
        assert_eq!(simplified.mesh.colors_linear[vertex], original.colors_linear[was as usize]);
    }
    simplified.mesh.validate().unwrap();
}

#[test]
fn colours_hold_where_they_change_and_not_where_they_do_not() {
    let mut original = scattered(Vec2::ONE, 200, 0.3);
    let dark = |p: &Vec3| if (p.x - 0.5).hypot(p.y - 0.5) < 0.25 { Vec3::splat(0.1) } else { Vec3::splat(0.8) };
    original.colors_linear = original.positions.iter().map(dark).collect();
    let plain = simplify_in_tiles(&original, &nowhere(), &metres(0.01, 0.1), 10 * TILE);
    let seen = simplify_in_tiles(&original, &nowhere(), &SimplifyParams { color_weight: 2.0, ..metres(0.01, 0.1) }, 10 * TILE);
    assert!(seen.mesh.triangles.len() < original.triangles.len() / 4);
    // The picture is off where a triangle's colour is not that of its middle.
    let off = |mesh: &Mesh| {
        area_m2(mesh, |t| {
            let mean = mesh.triangles[t].iter().map(|&v| mesh.colors_linear[v as usize].x).sum::<f32>() / 3.0;
            (mean - dark(&closest::center(mesh, t)).x).abs() > 0.2
        })
    };
    assert!(off(&seen.mesh) < 0.5 * off(&plain.mesh), "{} and {}", off(&seen.mesh), off(&plain.mesh));
}

fn picture(name: &str) -> Option<Arc<Texture>> {
    let image = SrgbImage::filled(1, 1, [9; 4]);
    Some(Arc::new(Texture { source: name.into(), image, wrap: [TextureWrap::Repeat; 2] }))
}

#[test]
fn materials_keep_their_places() {
    let mut original = scattered(Vec2::ONE, 200, 0.3);
    let material = |texture| Material { name: String::new(), base_color_linear: Vec3::ONE, texture };
    let b = picture("b");
    original.materials = [picture("a"), b.clone(), b].map(material).to_vec();
    original.uvs = original.positions.iter().map(|p| p.truncate()).collect();
    let disc = |t: usize| {
        let p = closest::center(&original, t);
        if (p.x - 0.5).hypot(p.y - 0.5) < 0.3 { 1 + (t % 2) as u16 } else { 0 }
    };
    original.triangle_material = (0..original.triangles.len()).map(disc).collect();
    let simplified = simplify_in_tiles(&original, &nowhere(), &metres(0.005, 0.05), TILE).mesh;
    assert!(simplified.triangles.len() < original.triangles.len() / 5, "{}", simplified.triangles.len());
    simplified.validate().unwrap();
    let inside = area_m2(&simplified, |t| simplified.triangle_material[t] == 1);
    assert!((inside - std::f64::consts::PI * 0.09).abs() < 0.005, "{inside}");
    assert!((area_m2(&simplified, |_| true) - 1.0).abs() < 1e-4);
    for t in 0..simplified.triangles.len() {
        let p = closest::center(&simplified, t);
        let depth = 0.3 - (p.x - 0.5).hypot(p.y - 0.5);
        assert!(depth.abs() < 0.02 || (simplified.triangle_material[t] == 1) == (depth > 0.0), "{p}");
    }
}

#[test]
fn texture_seams_hold() {
    // Left and right half have their own vertices along x = 1/2, and coordinates that have nothing to do with one another.
    let half = |x: f32| {
        let mut half = scattered(Vec2::new(0.5, 1.0), 100, 0.3);
        half.uvs =
            half.positions.iter().map(|p| if x > 0.0 { Vec2::new(1.0 - p.y, p.x) } else { p.truncate() * 0.4 }).collect();
        half.positions.iter_mut().for_each(|p| p.x += x);
        half
    };
    let (mut original, right) = (half(0.0), half(0.5));
    let first = original.positions.len() as u32;
    original.positions.extend(right.positions);
    original.normals.extend(right.normals);
    original.uvs.extend(right.uvs);
    original.triangles.extend(right.triangles.iter().map(|t| t.map(|v| v + first)));
    original.materials = vec![Material { name: String::new(), base_color_linear: Vec3::ONE, texture: picture("a") }];
    let simplified = simplify_in_tiles(&original, &nowhere(), &metres(0.005, 0.1), TILE);
    let mesh = &simplified.mesh;
    assert!(mesh.triangles.len() < original.triangles.len() / 10, "{}", mesh.triangles.len());
    let right = |v: u32| simplified.original_vertex[v as usize] >= first;
    for t in &mesh.triangles {
        assert!(t.iter().all(|&v| right(v)) || t.iter().all(|&v| !right(v)), "no triangle spans the seam");
    }
    assert!((area_m2(mesh, |t| right(mesh.triangles[t][0])) - 0.5).abs() < 1e-4);
    let border = |(edge, n): (&[[u32; 3]; 2], &i32)| *n != 0 && edge.iter().all(|p| f32::from_bits(p[0]) == 0.5);
    assert!(!edge_counts(mesh).iter().any(border), "no crack along the seam");
}

#[test]
fn threads_change_nothing() {
    let original = ball(6);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let simplified = simplify_in_tiles(&original, &nowhere(), &metres(0.001, 0.1), TILE);
            let measured = measure(&original, &simplified.mesh, &nowhere(), &metres(0.001, 0.1));
            let nearest = nearest_triangles(&original, &simplified.mesh, &nowhere(), &metres(0.001, 0.1));
            (simplified.mesh.triangles, simplified.original_vertex, simplified.report, measured, nearest)
        })
    };
    assert_eq!(with(1), with(2));
}

#[test]
fn both_sides_of_a_thin_wall_find_their_own() {
    let front = rectangle(Vec3::ZERO, Vec3::X, Vec3::Y, 60);
    let back = rectangle(Vec3::NEG_Z * 0.0005, Vec3::Y, Vec3::X, 60);
    let split = front.triangles.len();
    let original = mesh(front.and(back));
    let params = metres(0.002, 0.1);
    let simplified = simplify_in_tiles(&original, &nowhere(), &params, TILE);
    let nearest = nearest_triangles(&original, &simplified.mesh, &nowhere(), &params);
    for (t, &found) in nearest.triangle.iter().enumerate() {
        let [a, b, c] = simplified.mesh.corners(found as usize);
        assert_eq!((b - a).cross(c - a).z > 0.0, t < split);
        assert!(nearest.distance_m[t] < 1e-6);
    }
}

#[test]
fn clearance_covers_what_was_flattened() {
    let mut original = scattered(Vec2::ONE, 100, 0.0);
    let bump = original.positions.iter().position(|p| p.distance(Vec3::new(0.5, 0.5, 0.0)) < 1e-4).unwrap();
    original.positions[bump].z = 0.003;
    let params = metres(0.05, 0.1);
    let mut flat = simplify_in_tiles(&scattered(Vec2::ONE, 100, 0.0), &nowhere(), &params, TILE).mesh;
    flat.positions.push(Vec3::splat(7.0));
    let measured = measure(&original, &flat, &nowhere(), &params);
    assert_eq!(measured.clearance_m.len(), flat.positions.len());
    assert_eq!(measured.clearance_m.last(), Some(&0.0), "no triangle uses it");
    let near = measured.clearance_m.iter().filter(|&&c| (c - 0.003).abs() < 1e-6).count();
    assert!((3..=8).contains(&near), "{near}");
    assert!((measured.report.from_original.max_m - 0.003).abs() < 1e-6);
    assert!(measured.report.from_original.p95_m < 1e-6);
}

/// A wall with spikes of single vertices, and closed stones of eight triangles that float off it.
fn thorny_wall() -> Mesh {
    let mut wall = scattered(Vec2::splat(2.0), 200, 0.3);
    for index in 0..wall.positions.len() {
        let [column, row] = [index % 201, index / 201];
        if column % 9 == 4 && row % 7 == 3 {
            wall.positions[index].z += 0.05 * noise(3, index);
        }
    }
    for stone in 0..60 {
        let (small, first) = (ball(0), wall.positions.len() as u32);
        let middle = Vec3::new(1.0 + 0.9 * noise(7, stone), 1.0 + 0.9 * noise(8, stone), 0.2 + 0.1 * noise(9, stone));
        wall.positions.extend(small.positions.iter().map(|p| middle + *p * 0.01));
        wall.normals.extend(small.normals);
        wall.triangles.extend(small.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    wall
}

#[test]
fn no_place_is_farther_off_than_allowed() {
    let original = thorny_wall();
    let params = metres(0.012, 0.1);
    for most in [TILE, usize::MAX] {
        let simplified = simplify_in_tiles(&original, &nowhere(), &params, most);
        assert!(simplified.mesh.triangles.len() * 4 < original.triangles.len(), "{:?}", simplified.report);
        assert!(simplified.report.passes[0].again > 0, "held at least once: {:?}", simplified.report);
        let report = measure(&original, &simplified.mesh, &nowhere(), &params).report;
        assert!(report.from_original.max_m <= params.error_m, "{report:?}");
    }
}

#[test]
fn simplified_again_it_still_keeps_to_the_original() {
    let original = thorny_wall();
    let once = simplify_in_tiles(&original, &nowhere(), &metres(0.006, 0.05), TILE).mesh;
    let params = metres(0.009, 0.1);
    let twice =
        simplify_further(&once, &Held::NOTHING, &original.positions, &nowhere(), &params, (&Nowhere, Tell::NOBODY)).mesh;
    assert!(twice.triangles.len() * 3 < once.triangles.len() * 2, "{} of {}", twice.triangles.len(), once.triangles.len());
    let report = measure(&original, &twice, &nowhere(), &params).report;
    assert!(report.from_original.max_m <= params.error_m, "{report:?}");
}

#[test]
fn what_would_vanish_is_left_as_little_and_not_whole() {
    let sizes = |of: &Mesh| {
        [0.3, 0.6, 1.2, 2.4].map(|error_m| {
            let params = metres(error_m, 10.0 * error_m);
            let left = simplify_in_tiles(of, &nowhere(), &params, 10 * TILE).mesh;
            let surface = closest::Surface::new(&left);
            for &p in &of.positions {
                assert!(surface.any_within(p, error_m, None).is_some(), "{p} at {error_m}");
            }
            left.triangles.len()
        })
    };
    let (stone, wall) = (sizes(&ball(5)), sizes(&scattered(Vec2::new(2.0, 1.0), 60, 0.3)));
    assert!(stone.iter().chain(&wall).all(|&left| left < 60), "{stone:?} {wall:?}");
}

#[test]
fn hostile_meshes_do_no_harm() {
    for hostile in heliodon_testkit::hostile::meshes() {
        let original = mesh(hostile.scene);
        let params = metres(0.1, 0.5);
        let simplified = simplify(&original, &nowhere(), &params);
        assert!(simplified.mesh.triangles.len() <= original.triangles.len(), "{}", hostile.name);
        let measured = measure(&original, &simplified.mesh, &nowhere(), &params);
        assert_eq!(measured.clearance_m.len(), simplified.mesh.positions.len(), "{}", hostile.name);
        let nearest = nearest_triangles(&original, &simplified.mesh, &nowhere(), &params);
        assert_eq!(nearest.triangle.len(), original.triangles.len(), "{}", hostile.name);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn any_soup_gives_a_mesh(
        places in prop::collection::vec((0..6_i8, 0..6_i8, 0..3_i8), 1..60),
        corners in prop::collection::vec((any::<u32>(), any::<u32>(), any::<u32>()), 0..120),
        looks in any::<u64>(),
        error_m in 0.0..3.0_f32,
        most in 3..60_usize,
    ) {
        let positions: Vec<Vec3> = places.iter().map(|&(x, y, z)| Vec3::new(f32::from(x), f32::from(y), f32::from(z))).collect();
        let count = positions.len() as u32;
        let material = |x: f32| Material { name: String::new(), base_color_linear: Vec3::splat(x), texture: picture("a") };
        let original = Mesh {
            normals: vec![Vec3::Y; positions.len()],
            uvs: positions.iter().map(|p| p.truncate()).collect(),
            colors_linear: positions.iter().map(|p| *p / 6.0).collect(),
            triangles: corners.iter().map(|&(a, b, c)| [a % count, b % count, c % count]).collect(),
            triangle_material: (0..corners.len()).map(|t| (looks >> (t % 64) & 1) as u16).collect(),
            materials: vec![material(0.1), material(0.2)],
            positions,
        };
        let simplified = simplify_in_tiles(&original, &nowhere(), &metres(error_m, 2.0 * error_m), most);
        prop_assert!(simplified.mesh.validate().is_ok());
        prop_assert!(simplified.mesh.triangles.len() <= original.triangles.len());
        prop_assert!(simplified.original_vertex.iter().all(|&v| v < count));
        let measured = measure(&original, &simplified.mesh, &nowhere(), &metres(error_m, 1.0));
        prop_assert!(measured.clearance_m.iter().all(|c| c.is_finite() && *c >= 0.0));
    }
}

/// What is on the shelf after a few batches is not left there again, and nothing else comes of it.
#[test]
fn who_goes_on_ends_with_the_same() {
    // two threads, whatever the machine has: batches are small then
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let (views, params) = (nowhere(), metres(0.01, 0.1));
    let mesh = scattered(Vec2::splat(4.0), 150, 0.3);
    let simplified = |interim: &dyn Interim| {
        let made = pool.install(|| simplify_for((&mesh, &Held::NOTHING), None, &views, &params, TILE, (interim, Tell::NOBODY)));
        (made.mesh.positions, made.mesh.triangles, made.original_vertex, made.report)
    };
    let whole = simplified(&Nowhere);
    assert!(whole.1.len() < mesh.triangles.len() / 2 && whole.3.passes.len() > 1);
    let simple = Mesh { positions: whole.0.clone(), triangles: whole.1.clone(), ..Mesh::default() };
    let measured =
        |interim: &dyn Interim| pool.install(|| measure_resuming(&mesh, &simple, &views, &params, (interim, Tell::NOBODY)));
    let nearest = |interim: &dyn Interim| {
        pool.install(|| nearest_triangles_resuming(&mesh, &simple, &views, &params, (interim, Tell::NOBODY)))
    };
    let mut shelves = [Shelf::default(), Shelf::default(), Shelf::default()];
    for most in [1, 2, 2] {
        shelves.iter_mut().for_each(|shelf| shelf.most = most);
        assert!(simplified(&shelves[0]) == whole);
        assert_eq!(measured(&shelves[1]), measured(&Nowhere));
        assert_eq!(nearest(&shelves[2]), nearest(&Nowhere));
        assert_eq!(shelves.each_ref().map(Shelf::len), [most; 3]);
    }
}
