//! Tiles of one surface, and what becomes of the border between them.

use super::*;
use crate::Nowhere;
use crate::shapes::{cube, grid, joined};
use crate::simplify::{SimplifyParams, simplify, simplify_further, simplify_holding};
use crate::{Screen, Tell, Views};
use heliodon_mesh::topology::{Edges, places};
use std::collections::BTreeSet;

const MOST: usize = 1_000_000;

fn bumpy(x: f32, z: f32) -> f32 {
    0.05 * (9.0 * x).sin() * (7.0 * z).cos() + 0.01 * (61.0 * x).sin() * (47.0 * z).sin()
}

/// Bumpy ground of 2 m by 1 m in two tiles, whose border at x = 1 is the same.
fn tiles(quads: u32) -> [Mesh; 2] {
    let tile = |first: f32| {
        let mut tile = grid(quads, |_, _| 0.0);
        tile.positions.iter_mut().for_each(|p| *p = Vec3::new(p.x + first, bumpy(p.x + first, p.z), p.z));
        tile
    };
    [tile(0.0), tile(1.0)]
}

fn shared(meshes: &mut [Mesh], weld_m: f32) -> Vec<Shared> {
    let mut neighbors: Vec<Neighbor> = meshes.iter_mut().map(|mesh| Neighbor { mesh, weld_m }).collect();
    share(&mut neighbors, MOST).unwrap()
}

fn nowhere() -> Views {
    Views { cells: Vec::new(), screen: Screen { width_px: 1024, height_px: 768, fov_rad: 1.0 } }
}

/// Limits that leave next to nothing.
fn strong() -> SimplifyParams {
    SimplifyParams { error_m: 0.1, edge_m: 1.0, ..SimplifyParams::screen() }
}

/// The edges without a neighbour, by the bits of their ends.
fn open_edges(mesh: &Mesh) -> BTreeSet<[[u32; 3]; 2]> {
    let mut open = BTreeSet::new();
    Edges::new(&mesh.triangles, &places(&mesh.positions, 0.0), |_| true).for_each(|ends, sides| {
        if sides.len() == 1 {
            let [a, b] = ends.map(|v| place_bits(mesh.positions[v as usize]));
            open.insert([a.min(b), a.max(b)]);
        }
    });
    open
}

/// Those of the edges of which both ends have this x.
fn at(edges: &BTreeSet<[[u32; 3]; 2]>, x: f32) -> BTreeSet<[[u32; 3]; 2]> {
    edges.iter().filter(|ends| ends.iter().all(|p| p[0] == x.to_bits())).copied().collect()
}

#[test]
fn the_border_of_two_tiles_is_the_same_after_strong_simplification() {
    let mut meshes = tiles(60);
    let simple = |meshes: &[Mesh; 2], shared: &[Shared]| -> Vec<Mesh> {
        let one =
            |(mesh, shared): (&Mesh, &Shared)| simplify_holding(mesh, &shared.held, &nowhere(), &strong(), Tell::NOBODY).mesh;
        meshes.iter().zip(shared).map(one).collect()
    };
    let alone = simple(&meshes, &vec![Shared::default(); 2]);
    let [left, right] = [0, 1].map(|tile| at(&open_edges(&alone[tile]), 1.0));
    assert!(left.len() < 30, "{} edges", left.len());
    // the same places on both sides at x = 1 only by chance
    assert_ne!(left, right, "to begin with a crack opens");

    let original = meshes.clone();
    let found = shared(&mut meshes, 0.0);
    assert!(meshes.iter().zip(&original).all(|(a, b)| a.positions == b.positions && a.triangles == b.triangles));
    for shared in &found {
        let BorderReport { shared_places, held_places, moved_vertices, split_triangles, first } = shared.report;
        assert_eq!((shared_places, held_places, moved_vertices, split_triangles), (61, 61, 0, 0));
        assert_eq!(first.unwrap()[0], 1.0);
    }
    let made = simple(&meshes, &found);
    let [left, right] = [0, 1].map(|tile| at(&open_edges(&made[tile]), 1.0));
    assert_eq!((left.len(), &left), (60, &right));
    assert_eq!(left, at(&open_edges(&original[0]), 1.0));
    assert_eq!(open_edges(&joined(&made)).iter().filter(|ends| ends.iter().all(|p| p[0] == 1.0_f32.to_bits())).count(), 0);
    assert!(made.iter().all(|mesh| mesh.triangles.len() * 8 < original[0].triangles.len()), "inside as coarse as ever");
    // and when all is simplified once more
    for (tile, shared) in found.iter().enumerate() {
        let params = SimplifyParams { error_m: 0.3, edge_m: 3.0, ..strong() };
        let positions = &original[tile].positions;
        let again = simplify_further(&made[tile], &shared.held, positions, &nowhere(), &params, (&Nowhere, Tell::NOBODY)).mesh;
        assert_eq!(at(&open_edges(&again), 1.0), left);
    }
}

#[test]
fn the_finer_side_splits_the_coarser_one_s_border() {
    // what one file's role or texels leave unsplit, another's do not
    let mut meshes = tiles(4);
    split(&mut meshes[0], |_, _| 0.03, MOST).unwrap();
    // the other is split as well where it has an edge of its own that is too long
    split(&mut meshes[1], |middle, _| if middle.z > 0.5 { 0.01 } else { f32::INFINITY }, MOST).unwrap();
    let before = meshes.clone();
    assert_ne!(at(&open_edges(&meshes[0]), 1.0), at(&open_edges(&meshes[1]), 1.0));
    let found = shared(&mut meshes, 0.0);
    let [left, right] = [0, 1].map(|tile| at(&open_edges(&meshes[tile]), 1.0));
    assert_eq!(left, right);
    // 16 a quad where z is below 1/2, 32 beyond
    assert_eq!(left.len(), 2 * 16 + 2 * 32);
    assert!(found.iter().all(|shared| shared.report.split_triangles > 0 && shared.report.held_places == 97), "{found:?}");
    for (mesh, before) in meshes.iter().zip(&before) {
        mesh.validate().unwrap();
        assert!((mesh.surface_area() - before.surface_area()).abs() < 1e-5);
        assert!(mesh.triangles.len() < before.triangles.len() + 200, "only along the border");
        assert_eq!(
            open_edges(mesh).len(),
            open_edges(before).len() + at(&open_edges(mesh), 1.0).len() - at(&open_edges(before), 1.0).len()
        );
    }
}

#[test]
fn what_is_within_the_weld_s_reach_is_moved_and_what_is_not_is_not() {
    let off = |index: usize| 4.0e-6 * Vec3::new((index % 3) as f32 - 1.0, (index % 5) as f32 - 2.0, (index % 2) as f32);
    let moved = || {
        let mut meshes = tiles(8);
        meshes[1].positions.iter_mut().enumerate().for_each(|(index, p)| *p += off(index));
        // split apart, on edges that are no longer the same to the bit; one of them is not split at all
        split(&mut meshes[0], |_, _| 0.07, MOST).unwrap();
        meshes
    };
    let (mut meshes, first) = (moved(), moved()[0].clone());
    let apart = shared(&mut meshes, 0.0);
    assert!(apart.iter().all(|shared| shared.report.shared_places < 3), "{apart:?}");
    let mut meshes = moved();
    let found = shared(&mut meshes, 2.0e-5);
    assert_eq!(meshes[0].positions, first.positions, "the earlier one stays");
    assert!(found[1].report.moved_vertices > 5 && found[1].report.split_triangles > 7, "{found:?}");
    assert_eq!((found[0].report.held_places, found[1].report.held_places), (17, 17), "{found:?}");
    let open = open_edges(&joined(&meshes));
    assert!(open.iter().all(|ends| ends.iter().any(|p| (f32::from_bits(p[0]) - 1.0).abs() > 1e-4)), "no edge alone at x = 1");
}

#[test]
fn what_does_not_touch_is_left_alone() {
    let [first, mut second] = tiles(6);
    // their boxes overlap, and no vertex is common
    second.positions.iter_mut().for_each(|p| *p += Vec3::new(-0.51, 0.003, 0.0));
    let mut meshes = [first, second, cube(Vec3::splat(40.0), Vec3::splat(41.0))];
    let before = meshes.clone();
    let found = shared(&mut meshes, 0.0);
    assert!(found.iter().all(|shared| shared == &Shared::default() && shared.report.is_empty()), "{found:?}");
    for (mesh, before) in meshes.iter().zip(&before) {
        assert_eq!((&mesh.positions, &mesh.triangles), (&before.positions, &before.triangles));
        let holding = simplify_holding(mesh, &Held::NOTHING, &nowhere(), &strong(), Tell::NOBODY).mesh;
        assert_eq!(holding.triangles, simplify(mesh, &nowhere(), &strong()).mesh.triangles);
    }
    let mut alone = tiles(3);
    assert_eq!(shared(&mut alone[..1], 1.0), [Shared::default()]);
    assert_eq!(shared(&mut [], 1.0), []);
}

#[test]
fn within_what_coincides_only_the_rim_is_held() {
    // two blocks, finely divided, wall to wall: of the wall between them the rim is held, for their other faces meet there
    let block = |low: Vec3, high: Vec3| {
        let mut block = cube(low, high);
        split(&mut block, |_, _| 0.2, MOST).unwrap();
        block
    };
    let mut blocks = [block(Vec3::ZERO, Vec3::ONE), block(Vec3::X, Vec3::new(2.0, 1.0, 1.0))];
    let found = shared(&mut blocks, 0.0);
    for shared in found {
        assert_eq!((shared.report.shared_places, shared.report.held_places), (81, 32));
        assert!(shared.held.holds(Vec3::new(1.0, 0.0, 0.125)) && !shared.held.holds(Vec3::new(1.0, 0.5, 0.5)));
    }
}

#[test]
fn threads_do_not_matter() {
    let work = || {
        let mut meshes = tiles(20);
        split(&mut meshes[0], |_, _| 0.02, MOST).unwrap();
        meshes[1].positions.iter_mut().for_each(|p| p.y += 2.0e-6);
        let found = shared(&mut meshes, 1.0e-5);
        let simple = simplify_holding(&meshes[1], &found[1].held, &nowhere(), &strong(), Tell::NOBODY).mesh;
        (meshes.map(|mesh| (mesh.positions, mesh.triangles)), found, simple.positions, simple.triangles)
    };
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    assert!(pool(1).install(work) == pool(5).install(work));
}
