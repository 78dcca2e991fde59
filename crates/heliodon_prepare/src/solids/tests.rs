//! Unions whose volumes are known.

use super::*;
use crate::clean::{CleanParams, clean};
use crate::interim::tests::Shelf;
use crate::shapes::{cube, joined};
use glam::{Vec2, Vec3};
use heliodon_mesh::Material;

fn volume(mesh: &Mesh) -> f64 {
    let of = |t: usize| {
        let [a, b, c] = mesh.corners(t).map(Vec3::as_dvec3);
        a.dot(b.cross(c)) / 6.0
    };
    (0..mesh.triangles.len()).map(of).sum()
}

/// Unites, and sees to it that what comes of it is whole.
fn united(mut mesh: Mesh) -> (Mesh, SolidsReport) {
    let report = unite(&mut mesh, &SolidsParams::default());
    mesh.validate().unwrap();
    let mut again = mesh.clone();
    let cleaned = clean(&mut again, &CleanParams::default());
    assert_eq!((cleaned.open.edges, cleaned.flipped, cleaned.double_walls.triangles), (0, 0, 0), "{cleaned}");
    (mesh, report)
}

#[test]
fn overlapping_boxes_become_one_with_their_volume_and_area() {
    let (mesh, report) = united(joined(&[cube(Vec3::ZERO, Vec3::ONE), cube(Vec3::splat(0.5), Vec3::splat(1.5))]));
    assert!((volume(&mesh) - 1.875).abs() < 1e-6 && (mesh.surface_area() - 10.5).abs() < 1e-5);
    assert_eq!((report.solids, report.groups.len()), (2, 1));
    assert_eq!(report.groups[0].outcome, Outcome::United);
    assert!((report.groups[0].volume_before_m3 - 2.0).abs() < 1e-6 && (report.groups[0].volume_after_m3 - 1.875).abs() < 1e-6);
    assert!(report.to_string().contains("2 solids united"), "{report}");
}

#[test]
fn a_shared_wall_goes_from_both() {
    let (mesh, report) = united(joined(&[cube(Vec3::ZERO, Vec3::ONE), cube(Vec3::X, Vec3::new(2.0, 1.0, 1.0))]));
    assert!((volume(&mesh) - 2.0).abs() < 1e-6 && (mesh.surface_area() - 10.0).abs() < 1e-5);
    assert_eq!(report.fates.iter().filter(|&&fate| fate == Fate::Swallowed).count(), 4);
    // a smaller box against the middle of a wall: the wall has a window cut into it
    let (mesh, _) =
        united(joined(&[cube(Vec3::ZERO, Vec3::ONE), cube(Vec3::new(1.0, 0.25, 0.25), Vec3::new(2.0, 0.75, 0.75))]));
    assert!((volume(&mesh) - 1.25).abs() < 1e-6 && (mesh.surface_area() - 8.0).abs() < 1e-5);
}

#[test]
fn what_a_solid_holds_is_swallowed_unless_it_is_in_a_hollow() {
    let house = |low: f32, high: f32| {
        let mut hollow = cube(Vec3::splat(0.1), Vec3::splat(0.9));
        hollow.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        joined(&[cube(Vec3::ZERO, Vec3::ONE), hollow, cube(Vec3::splat(low), Vec3::splat(high))])
    };
    let (mesh, _) = united(house(0.4, 0.6));
    assert!((volume(&mesh) - (1.0 - 0.512 + 0.008)).abs() < 1e-5);
    assert_eq!(mesh.triangles.len(), 36);
    let (mesh, report) = united(house(0.02, 0.08));
    assert!((volume(&mesh) - (1.0 - 0.512)).abs() < 1e-5);
    assert_eq!((report.hollows, report.triangles_after), (1, 24));
}

#[test]
fn a_lone_solid_that_meets_nothing_stays_to_the_bit() {
    let mesh = joined(&[cube(Vec3::ZERO, Vec3::ONE), cube(Vec3::splat(3.0), Vec3::splat(4.0))]);
    let (same, report) = united(mesh.clone());
    assert_eq!((same.triangles, same.positions), (mesh.triangles, mesh.positions));
    assert!(report.groups.is_empty() && report.fates.iter().all(|&fate| fate == Fate::Kept));
}

#[test]
fn pieces_keep_the_look_of_what_they_come_from() {
    let material = |name: &str| Material { name: name.into(), base_color_linear: Vec3::ONE, texture: None };
    let dressed = |mut mesh: Mesh, material: Material, color: f32| {
        heliodon_mesh::normals::split_creases(&mut mesh, 1.0);
        mesh.colors_linear = vec![Vec3::splat(color); mesh.positions.len()];
        // texture coordinates that are known everywhere
        mesh.uvs = mesh.positions.iter().map(|p| Vec2::new(p.x + 2.0 * p.y, p.z - p.y)).collect();
        mesh.triangle_material = vec![0; mesh.triangles.len()];
        mesh.materials = vec![material];
        mesh
    };
    let column = dressed(cube(Vec3::new(0.31, -0.2, 0.37), Vec3::new(0.62, 3.0, 0.71)), material("column"), 0.25);
    let (mesh, report) =
        united(joined(&[dressed(cube(Vec3::NEG_Y, Vec3::new(1.0, 0.0, 1.0)), material("slab"), 0.75), column]));
    assert!((volume(&mesh) - (1.0 + 0.31 * 0.34 * 3.0)).abs() < 1e-5);
    assert!(report.fates.contains(&Fate::Cut));
    for (t, &material) in mesh.triangle_material.iter().enumerate() {
        let [a, b, c] = mesh.corners(t);
        let normal = (b - a).cross(c - a).try_normalize().unwrap();
        for v in mesh.triangles[t].map(|v| v as usize) {
            let p = mesh.positions[v];
            assert!(mesh.normals[v].distance(normal) < 1e-3);
            assert!(mesh.uvs[v].distance(Vec2::new(p.x + 2.0 * p.y, p.z - p.y)) < 1e-5);
            let slab = mesh.materials[usize::from(material)].name == "slab";
            assert_eq!(mesh.colors_linear[v], Vec3::splat(if slab { 0.75 } else { 0.25 }));
        }
    }
    let of_column = mesh.triangle_material.iter().filter(|&&m| mesh.materials[usize::from(m)].name == "column").count();
    assert!(of_column >= 10);
}

#[test]
fn many_random_boxes_enclose_what_a_count_of_cells_says() {
    // boxes on a grid, so that the union's volume is a count, and many walls are shared
    let mut random = 7_u64;
    let mut next = |n: u64| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) % n
    };
    let mut filled = vec![false; 1000];
    let mut boxes = Vec::new();
    for _ in 0..60 {
        let low = [next(8), next(8), next(8)];
        let high = low.map(|low| low + 1 + next(2));
        for cell in 0..1000 {
            let at = [cell % 10, cell / 10 % 10, cell / 100];
            filled[cell as usize] |= (0..3).all(|k| low[k] <= at[k] && at[k] < high[k]);
        }
        let point = |p: [u64; 3]| Vec3::from_array(p.map(|x| x as f32));
        boxes.push(cube(point(low), point(high)));
    }
    let mesh = joined(&boxes);
    let (made, _) = united(mesh.clone());
    let cells = filled.iter().filter(|filled| **filled).count() as f64;
    assert!((volume(&made) - cells).abs() < 1e-4 * cells, "{} of {cells}", volume(&made));
    let with = |threads| {
        let (pool, mut mesh) = (rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap(), mesh.clone());
        let report = pool.install(|| unite(&mut mesh, &SolidsParams::default()));
        (mesh.positions, mesh.triangles, report)
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn groups_that_are_united_already_are_not_united_again() {
    // pairs that overlap, lone boxes, and a group that is too large
    let pair = |i: u32| {
        let at = Vec3::X * (4 * i) as f32;
        joined(&[cube(at, at + 1.0), cube(at + 0.5 + (i % 2) as f32, at + 1.5 + (i % 2) as f32)])
    };
    let large: Vec<Mesh> =
        (0..5).map(|i| cube(Vec3::splat(-9.0 - 0.5 * i as f32), Vec3::splat(-8.0 - 0.5 * i as f32))).collect();
    let mesh = joined(&(0..12).map(pair).chain([joined(&large)]).collect::<Vec<_>>());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let made = |interim: &dyn Interim| {
        let (mut mesh, params) = (mesh.clone(), SolidsParams { most_triangles: 30, ..SolidsParams::default() });
        let report = pool.install(|| unite_resuming(&mut mesh, &params, (interim, Tell::NOBODY)));
        (mesh.positions, mesh.triangles, report)
    };
    let whole = made(&Nowhere);
    assert_eq!(whole.2.groups.len(), 6 + 1);
    // a shelf does not keep the same twice
    let mut shelf = Shelf::default();
    shelf.most = 3;
    assert!(made(&shelf) == whole && shelf.len() == 3);
    assert!(made(&shelf) == whole && shelf.len() == 3);
}

#[test]
fn what_is_buried_goes_and_what_peeps_out_stays() {
    let sheet = |low: Vec3, a: Vec3, b: Vec3| Mesh {
        positions: vec![low, low + a, low + b],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let mesh = joined(&[
        cube(Vec3::ZERO, Vec3::ONE),
        sheet(Vec3::splat(0.2), Vec3::X * 0.5, Vec3::Y * 0.5),
        sheet(Vec3::splat(0.2), Vec3::X * 0.9, Vec3::Z * 0.5),
        // in the very face of the cube
        sheet(Vec3::new(0.2, 0.2, 1.0), Vec3::X * 0.5, Vec3::Y * 0.5),
    ]);
    let mut left = mesh.clone();
    let report = unite(&mut left, &SolidsParams::default());
    assert_eq!(report.fates[12..], [Fate::Buried, Fate::Kept, Fate::Kept]);
    assert_eq!((report.buried.triangles, left.triangles.len(), report.not_solid), (1, 14, 3));
    assert!((report.buried.area_m2 - 0.125).abs() < 1e-6);
    for params in [
        SolidsParams { buried: Buried::Keep, ..SolidsParams::default() },
        SolidsParams { eyes: vec![Vec3::splat(0.5)], ..SolidsParams::default() },
    ] {
        let mut left = mesh.clone();
        assert_eq!(unite(&mut left, &params).buried.triangles, 0, "kept, or seen by the eye in the room");
    }
    let painted = paint(&mesh, &report.fates);
    painted.validate().unwrap();
    assert_eq!(painted.triangles.len(), 15);
    assert_eq!(painted.colors_linear[painted.triangles[12][0] as usize], color(Fate::Buried));
}

#[test]
fn groups_too_large_are_told_and_left() {
    let mesh = joined(&[cube(Vec3::ZERO, Vec3::ONE), cube(Vec3::splat(0.5), Vec3::splat(1.5))]);
    let mut left = mesh.clone();
    let report = unite(&mut left, &SolidsParams { most_triangles: 23, ..SolidsParams::default() });
    assert_eq!(left.triangles, mesh.triangles);
    assert_eq!(report.groups[0].outcome, Outcome::TooLarge);
    assert!(report.fates.iter().all(|&fate| fate == Fate::Refused));
    assert_eq!(serde_json::to_value(&report).unwrap()["groups"][0]["outcome"], "too_large");
}

#[test]
fn the_hostile_corpus_is_survived() {
    for heliodon_testkit::hostile::Hostile { name, scene } in heliodon_testkit::hostile::meshes() {
        let mut mesh = Mesh { positions: scene.positions, triangles: scene.triangles, ..Mesh::default() };
        unite(&mut mesh, &SolidsParams::default());
        assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < mesh.positions.len()), "{name}");
    }
}

/// What solids bury of each of some meshes that all have solids.
fn among(meshes: &[Mesh]) -> Vec<BuriedAmong> {
    let members: Vec<Member> = meshes.iter().map(|mesh| Member { mesh, has_solids: true, seen: &[] }).collect();
    assert!(meet(&members));
    buried_among(&members, &[])
}

/// A box whose long edges were halved.
fn block(low: Vec3, high: Vec3, longest_m: f32) -> Mesh {
    let mut mesh = cube(low, high);
    crate::split::split(&mut mesh, |_, _| longest_m, 1_000_000).unwrap();
    mesh
}

#[test]
fn a_wall_between_two_meshes_is_buried_however_it_is_divided() {
    for (one, other) in [(2.0, 2.0), (0.2, 0.2), (0.2, 0.07), (2.0, 0.3)] {
        // turned, so that no plane is an axis'; half a thousandth of a weld apart
        let turn = glam::Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.9, -0.4);
        let mut meshes = [block(Vec3::ZERO, Vec3::ONE, one), block(Vec3::X, Vec3::new(2.0, 1.0, 1.0), other)];
        let walls = meshes.each_ref().map(|mesh| {
            let on_wall = |t: &u32| mesh.corners(*t as usize).iter().all(|p| p.x == 1.0);
            (0..mesh.triangles.len() as u32).filter(on_wall).collect::<Vec<_>>()
        });
        meshes.iter_mut().for_each(|mesh| mesh.positions.iter_mut().for_each(|p| *p = turn * *p + Vec3::new(3.0, -2.0, 9.0)));
        let buried = among(&meshes);
        for (buried, wall) in buried.iter().zip(&walls) {
            assert_eq!(&buried.triangles, wall, "{one} {other}");
            assert!((buried.found.area_m2 - 1.0).abs() < 1e-4 && buried.found.triangles == wall.len() as u64);
        }
    }
    // a step of a tenth of a millimetre is no wall that is shared
    let apart = [cube(Vec3::ZERO, Vec3::ONE), cube(Vec3::X * 1.0001, Vec3::new(2.0, 1.0, 1.0))];
    let members = apart.each_ref().map(|mesh| Member { mesh, has_solids: true, seen: &[] });
    assert!(!meet(&members) && buried_among(&members, &[]).iter().all(|buried| buried.triangles.is_empty()));
}

#[test]
fn of_a_wall_only_what_the_other_covers_is_buried() {
    let meshes = [block(Vec3::ZERO, Vec3::ONE, 0.2), cube(Vec3::new(1.0, 0.25, 0.25), Vec3::new(2.0, 0.75, 0.75))];
    let [large, small] = &among(&meshes)[..] else { panic!() };
    assert!((large.found.area_m2 - 0.25).abs() < 1e-6 && (small.found.area_m2 - 0.25).abs() < 1e-6, "{large:?}");
}

#[test]
fn what_looks_out_between_a_large_triangle_s_corners_and_middle_is_seen() {
    let slab = |side: f32| cube(Vec3::new(0.0, -1.0, 0.0), Vec3::new(side, 0.0, side));
    // a block that leaves a ledge of two centimetres
    let flush = |low: f32, high: f32| cube(Vec3::new(low, 0.0, low), Vec3::new(high, 2.0, high));
    let [below, _] = &among(&[slab(10.0), flush(0.02, 9.98)])[..] else { panic!() };
    assert!(below.triangles.is_empty(), "the ledge is seen: {below:?}");
    let [below, above] = &among(&[slab(10.0), flush(0.0, 10.0)])[..] else { panic!() };
    assert_eq!((below.triangles.len(), above.triangles.len()), (2, 2), "without a ledge nothing is");
    // four blocks around a shaft that no corner, middle or edge of the large triangles is in
    let block = |[x, to_x]: [f32; 2], [z, to_z]: [f32; 2]| cube(Vec3::new(x, 0.0, z), Vec3::new(to_x, 9.0, to_z));
    let around = joined(&[
        block([0.0, 8.0], [0.0, 50.0]),
        block([12.0, 50.0], [0.0, 50.0]),
        block([8.0, 12.0], [0.0, 28.0]),
        block([8.0, 12.0], [32.0, 50.0]),
    ]);
    let mut solid = around.clone();
    unite(&mut solid, &SolidsParams::default());
    let [below, _] = &among(&[slab(50.0), solid])[..] else { panic!() };
    assert_eq!(below.triangles.len(), 1, "the shaft's floor is seen");
}

#[test]
fn what_stands_in_another_mesh_s_solid_is_buried_and_what_looks_out_is_not() {
    let inner = cube(Vec3::splat(0.4), Vec3::splat(0.6));
    let through = block(Vec3::new(0.4, 0.9, 0.4), Vec3::new(0.6, 1.5, 0.6), 0.07);
    let sheet = Mesh {
        positions: vec![Vec3::splat(0.1), Vec3::new(0.9, 0.2, 0.1), Vec3::new(0.2, 0.9, 0.3)],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let meshes = [cube(Vec3::ZERO, Vec3::ONE), inner, through.clone(), sheet];
    let members = [0, 1, 2, 3].map(|m| Member { mesh: &meshes[m], has_solids: m == 0, seen: &[] });
    let [big, inner, half, sheet] = &buried_among(&members, &[])[..] else { panic!() };
    assert!(big.triangles.is_empty(), "seen from outside");
    assert_eq!((inner.triangles.len(), sheet.triangles.len()), (12, 1));
    assert!(!half.triangles.is_empty());
    let top = |t: u32| through.corners(t as usize).iter().map(|p| p.y).fold(0.0, f32::max);
    assert!(half.triangles.iter().all(|&t| top(t) <= 1.0));
    assert!((0..through.triangles.len() as u32).all(|t| half.triangles.contains(&t) || top(t) > 0.99));
    // with an eye in it the big one is a room, and no solid
    assert!(buried_among(&members, &[Vec3::splat(0.8)]).iter().all(|buried| buried.triangles.is_empty()));
    // whom somebody sees is not buried, whatever is around it
    let seen: Vec<bool> = (0..12).map(|t| t % 3 == 0).collect();
    let looked_at = [members[0], Member { seen: &seen, ..members[1] }];
    let left = &buried_among(&looked_at, &[])[1];
    assert!(left.triangles.len() == 8 && left.triangles.iter().all(|t| t % 3 != 0));
    // nothing has solids, and nothing is near
    assert!(!meet(&[0, 1].map(|m| Member { mesh: &meshes[m], has_solids: false, seen: &[] })));
    let far = cube(Vec3::splat(5.0), Vec3::splat(6.0));
    assert!(!meet(&[Member { mesh: &far, has_solids: true, seen: &[] }, members[0]]));
}

#[test]
fn sheets_back_to_back_and_the_same_solid_twice_are_seen() {
    let sheet = |turned: bool| Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![if turned { [0, 2, 1] } else { [0, 1, 2] }],
        ..Mesh::default()
    };
    let same = || cube(Vec3::ZERO, Vec3::ONE);
    for meshes in [[sheet(false), sheet(true)], [same(), same()]] {
        assert!(among(&meshes).iter().all(|buried| buried.triangles.is_empty()));
    }
}
