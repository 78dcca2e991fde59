//! Meshes with known faults.

use super::*;
use crate::shapes::{cube, joined, moebius};
use glam::{Vec2, Vec3};
use heliodon_mesh::Material;
use heliodon_testkit::hostile;
use proptest::prelude::*;

fn cleaned(mut mesh: Mesh, params: &CleanParams) -> (Mesh, CleanReport) {
    let report = clean(&mut mesh, params);
    mesh.validate().unwrap();
    (mesh, report)
}

/// Every triangle with vertices of its own.
fn soup(mesh: &Mesh) -> Mesh {
    let corners = mesh.triangles.as_flattened();
    Mesh {
        positions: corners.iter().map(|&v| mesh.positions[v as usize]).collect(),
        triangles: (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        ..Mesh::default()
    }
}

fn volume(mesh: &Mesh) -> f64 {
    let of = |t: usize| {
        let [a, b, c] = mesh.corners(t).map(Vec3::as_dvec3);
        a.dot(b.cross(c)) / 6.0
    };
    (0..mesh.triangles.len()).map(of).sum()
}

#[test]
fn a_soup_of_cubes_becomes_two_cubes() {
    let mesh = soup(&joined(&[cube(Vec3::ZERO, Vec3::ONE), cube(Vec3::splat(5.0), Vec3::splat(6.0))]));
    let (mesh, report) = cleaned(mesh, &CleanParams::default());
    assert_eq!((report.vertices_before, report.vertices_after, report.triangles_after), (72, 16, 24));
    assert_eq!((report.pieces, report.patches, report.closed_patches, report.open.edges), (2, 2, 2, 0));
    assert!(report.marks.iter().all(|&mark| mark == Mark::Kept));
    assert!((volume(&mesh) - 2.0).abs() < 1e-6);
}

#[test]
fn seams_of_texture_and_creases_survive_and_are_no_gaps() {
    let mut mesh = soup(&cube(Vec3::ZERO, Vec3::ONE));
    heliodon_mesh::normals::split_creases(&mut mesh, 1.0);
    mesh.uvs = (0..mesh.positions.len()).map(|i| if i < 6 { Vec2::ONE } else { Vec2::ZERO }).collect();
    let (mesh, report) = cleaned(mesh, &CleanParams::default());
    // four for each face, none of the faces is the first one's texture's
    assert_eq!((mesh.positions.len(), report.open.edges, report.closed_patches), (24, 0, 1));
    let smooth = CleanParams { crease_rad: std::f32::consts::PI, ..CleanParams::default() };
    let (mesh, _) = cleaned(mesh, &smooth);
    assert_eq!(mesh.positions.len(), 8 + 4, "the texture's seam stays");
}

#[test]
fn what_is_no_triangle_or_there_twice_goes() {
    let mut mesh = cube(Vec3::ZERO, Vec3::ONE);
    mesh.positions.extend([Vec3::NAN, Vec3::new(0.5, 0.0, 0.0), Vec3::splat(77.0)]);
    let again = mesh.triangles[3];
    mesh.triangles.extend([[0, 1, 8], [2, 2, 3], [0, 9, 1], [again[1], again[2], again[0]]]);
    let (mesh, report) = cleaned(mesh, &CleanParams::default());
    assert_eq!((report.non_finite.triangles, report.degenerate.triangles, report.duplicate.triangles), (1, 2, 1));
    assert_eq!(report.marks[12..], [Mark::NonFinite, Mark::Degenerate, Mark::Degenerate, Mark::Duplicate]);
    assert_eq!((mesh.triangles.len(), mesh.positions.len(), report.closed_patches), (12, 8, 1));
    assert!((report.duplicate.area_m2 - 0.5).abs() < 1e-9);
}

#[test]
fn a_flat_triangle_that_closes_a_body_stays() {
    // one triangle of a cube is cut at a vertex on its edge, the neighbour over that edge is not: a flat one lies between them
    let mut mesh = cube(Vec3::ZERO, Vec3::ONE);
    let [a, b, c] = mesh.triangles[0];
    let middle = (mesh.positions[a as usize] + mesh.positions[b as usize]) * 0.5;
    mesh.positions.push(middle);
    mesh.triangles[0] = [a, 8, c];
    mesh.triangles.extend([[8, b, c], [a, b, 8]]);
    let (left, report) = cleaned(mesh.clone(), &CleanParams::default());
    assert_eq!((report.flat.triangles, report.degenerate.triangles, report.closed_patches), (1, 0, 1));
    assert_eq!((left.triangles.len(), report.marks[13]), (14, Mark::Flat));
    // with a piece beside it missing it hangs loose, and what hung on it as well
    mesh.triangles[12] = [8, 8, 8];
    let (left, report) = cleaned(mesh, &CleanParams::default());
    assert_eq!((report.flat.triangles, report.degenerate.triangles, left.triangles.len()), (0, 2, 12));
}

#[test]
fn double_walls_do_as_they_are_told() {
    let mut mesh =
        Mesh { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2], [0, 2, 1]], ..Mesh::default() };
    mesh.triangles.push([1, 2, 0]);
    let left = [(DoubleWalls::Keep, 2, 0), (DoubleWalls::KeepFirst, 1, 1), (DoubleWalls::Remove, 0, 2)];
    for (double_walls, triangles, removed) in left {
        let (cleaned, report) = cleaned(mesh.clone(), &CleanParams { double_walls, ..CleanParams::default() });
        assert_eq!((cleaned.triangles.len(), report.double_walls_removed), (triangles, removed), "{double_walls:?}");
        assert_eq!((report.double_walls.triangles, report.duplicate.triangles), (2, 1));
    }
}

#[test]
fn cracks_close_within_the_weld_s_reach_only() {
    let mut mesh = soup(&cube(Vec3::ZERO, Vec3::ONE));
    for (i, p) in mesh.positions.iter_mut().enumerate() {
        *p += Vec3::new((i % 3) as f32, (i % 5) as f32, (i % 2) as f32) * 1e-4;
    }
    let (_, report) = cleaned(mesh.clone(), &CleanParams::default());
    assert!(report.open.edges > 10 && report.closed_patches == 0);
    let (welded, report) = cleaned(mesh, &CleanParams { weld_m: 1e-3, ..CleanParams::default() });
    assert_eq!((report.open.edges, report.closed_patches, welded.positions.len()), (0, 1, 8));
    assert!(report.moved_vertices > 10);
}

#[test]
fn dust_goes_and_the_largest_piece_never_does() {
    let dust = cube(Vec3::splat(3.0), Vec3::splat(3.01));
    let mesh = joined(&[dust, cube(Vec3::ZERO, Vec3::ONE)]);
    let with = |isolated_m| CleanParams { isolated_m, ..CleanParams::default() };
    let (left, report) = cleaned(mesh.clone(), &with(0.1));
    assert_eq!((report.isolated_bits, report.isolated.triangles, report.pieces, left.triangles.len()), (1, 12, 1, 12));
    assert!((report.isolated.area_m2 - 6e-4).abs() < 1e-7);
    assert_eq!(cleaned(mesh.clone(), &with(0.01)).1.isolated_bits, 0);
    assert_eq!(cleaned(mesh, &with(100.0)).0.triangles.len(), 12);
}

#[test]
fn the_lesser_part_turns_and_bodies_look_outwards() {
    for (turned, inside_out) in [(vec![3, 7], 0), ((0..12).filter(|t| *t != 5).collect::<Vec<_>>(), 12)] {
        let mut mesh = cube(Vec3::ZERO, Vec3::ONE);
        for &t in &turned {
            mesh.triangles[t].swap(0, 1);
        }
        let report_only = CleanParams { winding: Winding::Report, ..CleanParams::default() };
        let (same, told) = cleaned(mesh.clone(), &report_only);
        assert_eq!((same.triangles, told.flipped), (mesh.triangles.clone(), 0));
        let (mended, report) = cleaned(mesh, &CleanParams::default());
        assert_eq!(
            (report.inconsistent.triangles, report.inside_out.triangles),
            (turned.len().min(1 + turned.len() % 11) as u64, inside_out)
        );
        assert_eq!((told.inconsistent, told.inside_out), (report.inconsistent, report.inside_out));
        assert_eq!(report.flipped, turned.len() as u64);
        assert!((volume(&mended) - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_vertex_far_away_hides_nothing_that_is_inside_out() {
    let mut mesh = joined(&[cube(Vec3::ZERO, Vec3::ONE), cube(Vec3::splat(5.0), Vec3::splat(6.0))]);
    mesh.normals.clear();
    mesh.triangles[12..].iter_mut().for_each(|triangle| triangle.swap(1, 2));
    let vertex = mesh.positions.len() as u32;
    mesh.positions.extend([Vec3::splat(3e37), Vec3::new(-3e37, 3e37, 0.0), Vec3::X]);
    mesh.triangles.insert(0, [vertex, vertex + 1, vertex + 2]);
    let (_, report) = cleaned(mesh, &CleanParams::default());
    assert_eq!((report.closed_patches, report.flipped, report.inside_out.triangles), (2, 12, 12));
}

#[test]
fn normals_turn_only_where_they_look_away() {
    let mut mesh = cube(Vec3::ZERO, Vec3::ONE);
    mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    // the file's normals were right, only its winding was not
    mesh.normals = mesh.positions.iter().map(|p| (*p - 0.5) / 0.75_f32.sqrt()).collect();
    let outwards = mesh.normals.clone();
    let (mended, report) = cleaned(mesh.clone(), &CleanParams::default());
    assert_eq!((report.flipped, report.flipped_normals), (12, 0));
    assert_eq!(mended.normals, outwards);
    mesh.normals.iter_mut().for_each(|n| *n = -*n);
    let (mended, report) = cleaned(mesh, &CleanParams::default());
    assert_eq!(report.flipped_normals, 8);
    assert_eq!(mended.normals, outwards);
}

#[test]
fn hollows_and_rooms_look_inwards() {
    let inwards = |low: f32, high: f32| {
        let mut mesh = cube(Vec3::splat(low), Vec3::splat(high));
        mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        mesh
    };
    let (house, report) = cleaned(joined(&[cube(Vec3::ZERO, Vec3::ONE), inwards(0.1, 0.9)]), &CleanParams::default());
    assert_eq!((report.hollows, report.flipped), (1, 0));
    assert!((volume(&house) - (1.0 - 0.512)).abs() < 1e-5);
    let room = inwards(0.0, 4.0);
    let eyes = vec![Vec3::new(1.0, 1.6, 1.0)];
    let (_, report) = cleaned(room.clone(), &CleanParams { eyes, ..CleanParams::default() });
    assert_eq!((report.hollows, report.flipped), (1, 0));
    let (_, report) = cleaned(room, &CleanParams { eyes: vec![Vec3::splat(9.0)], ..CleanParams::default() });
    assert_eq!((report.hollows, report.flipped), (0, 12));
}

#[test]
fn a_moebius_strip_is_told_and_left() {
    let strip = moebius(24);
    let (left, report) = cleaned(strip.clone(), &CleanParams::default());
    assert_eq!(left.triangles, strip.triangles);
    assert_eq!((report.one_sided.triangles, report.flipped, report.inconsistent.triangles), (48, 0, 0));
    assert_eq!((report.rims, report.closed_patches), (1, 0), "its rim is one run");
    assert!((report.longest_rim_m - report.open.length_m).abs() < 1e-9);
}

#[test]
fn edges_of_three_are_kept_and_do_not_pass_the_winding_on() {
    // a cube with a fin on one edge, and a hole of one triangle
    let mut mesh = cube(Vec3::ZERO, Vec3::ONE);
    mesh.positions.push(Vec3::new(0.5, -0.2, 0.0));
    mesh.triangles.push([0, 1, 8]);
    let removed = mesh.triangles.remove(2);
    let (_, report) = cleaned(mesh.clone(), &CleanParams::default());
    let at = |t: usize| [removed, [0, 1, 8]][t].map(|v| mesh.positions[v as usize]);
    let length = |[a, b, c]: [Vec3; 3]| f64::from(a.distance(b) + b.distance(c) + c.distance(a));
    assert_eq!((report.non_manifold.edges, report.open.edges, report.rims, report.patches), (1, 5, 2, 2));
    assert!((report.longest_rim_m - length(at(0))).abs() < 1e-6);
    assert!((report.open.length_m - length(at(0)) - length(at(1)) + 1.0).abs() < 1e-6);
}

#[test]
fn bodies_that_share_a_wall_are_closed_together() {
    let boxes = joined(&[cube(Vec3::ZERO, Vec3::ONE), cube(Vec3::X, Vec3::new(2.0, 1.0, 1.0))]);
    let (left, report) = cleaned(boxes.clone(), &CleanParams::default());
    assert_eq!((report.patches, report.closed_patches, report.double_walls.triangles), (1, 1, 4));
    assert_eq!((left.triangles.len(), report.flipped), (24, 0));
    let mut inside_out = boxes;
    inside_out.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    let (left, report) = cleaned(inside_out, &CleanParams::default());
    assert_eq!((report.inside_out.triangles, report.flipped), (24, 24));
    assert!((volume(&left) - 2.0).abs() < 1e-6);
}

#[test]
fn what_is_painted_has_a_colour_for_each_mark() {
    let mut mesh = cube(Vec3::ZERO, Vec3::ONE);
    mesh.positions.push(Vec3::NAN);
    mesh.triangles.extend([mesh.triangles[0], [0, 1, 8]]);
    let original = mesh.clone();
    let report = clean(&mut mesh, &CleanParams::default());
    let painted = paint(&original, &report.marks);
    painted.validate().unwrap();
    assert_eq!((painted.triangles.len(), painted.positions.len()), (13, 11));
    for (t, mark) in report.marks[..13].iter().enumerate() {
        assert!(painted.triangles[t].iter().all(|&v| painted.colors_linear[v as usize] == color(*mark)));
        assert_eq!(painted.corners(t), original.corners(t));
    }
}

#[test]
fn the_report_speaks_to_people_and_programs() {
    let mut mesh = cube(Vec3::ZERO, Vec3::ONE);
    mesh.triangles.push(mesh.triangles[0]);
    let report = clean(&mut mesh, &CleanParams::default());
    let text = report.to_string();
    assert!(text.contains("13 triangles over 8 vertices, now 12 over 8"), "{text}");
    assert!(text.contains("1 triangles (0.500 m2) there twice, removed, first at"), "{text}");
    assert_eq!(text.lines().count(), 3, "{text}");
    let json = serde_json::to_value(&report).unwrap();
    assert_eq!(json["duplicate"]["triangles"], 1);
    assert!(json.get("marks").is_none());
}

#[test]
fn the_hostile_corpus_is_survived() {
    for hostile::Hostile { name, scene } in hostile::meshes() {
        for weld_m in [0.0, 0.01] {
            let hostile::Hostile { scene, .. } = hostile::Hostile { name, scene: scene.clone() };
            let mut mesh =
                Mesh { positions: scene.positions, normals: scene.normals, triangles: scene.triangles, ..Mesh::default() };
            let mut parted = mesh.clone();
            clean(&mut mesh, &CleanParams { weld_m, isolated_m: 0.1, ..CleanParams::default() });
            mesh.validate().unwrap_or_else(|error| panic!("{name}: {error}"));
            let report = clean(&mut parted, &CleanParams { weld_m, ..mending() });
            parted.validate().unwrap_or_else(|error| panic!("{name}: {error}"));
            assert_eq!(report.marks.len() as u64, report.triangles_before, "{name}");
        }
    }
}

#[test]
fn threads_do_not_change_anything() {
    let boxes = [cube(Vec3::ZERO, Vec3::ONE), cube(Vec3::X, Vec3::ONE + Vec3::X), with_a_t_junction()];
    let mesh = soup(&joined(&[moebius(100), joined(&boxes)]));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (mesh, report) = pool.install(|| cleaned(mesh.clone(), &CleanParams::modelled()));
        (mesh.positions, mesh.triangles, report)
    };
    assert_eq!(with(1), with(3));
}

/// Coordinates that are often the same, sometimes nearly, and sometimes none.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        8 => (0..4_i32).prop_map(|i| i as f32),
        2 => (0..4_i32, 0..3_i32).prop_map(|(i, j)| i as f32 + j as f32 * 4.0e-3),
        1 => prop_oneof![Just(f32::NAN), Just(f32::INFINITY), Just(-0.0), Just(3.0e38), Just(1.0e-42)],
    ]
}

fn garbage() -> impl Strategy<Value = Mesh> {
    let positions = prop::collection::vec([coordinate(), coordinate(), coordinate()].prop_map(Vec3::from_array), 1..30);
    (positions, prop::collection::vec(any::<[u8; 3]>(), 0..80), any::<bool>(), any::<bool>()).prop_map(
        |(positions, triangles, normals, uvs)| {
            let count = positions.len();
            let odd =
                |i: usize| Vec3::new((i % 3) as f32 - 1.0, (i % 2) as f32, if i.is_multiple_of(7) { f32::NAN } else { 1.0 });
            Mesh {
                normals: if normals { (0..count).map(odd).collect() } else { Vec::new() },
                uvs: if uvs { (0..count).map(|i| Vec2::splat((i % 2) as f32)).collect() } else { Vec::new() },
                triangle_material: Vec::new(),
                triangles: triangles.into_iter().map(|t| t.map(|v| u32::from(v) % count as u32)).collect(),
                positions,
                ..Mesh::default()
            }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(400) })]

    #[test]
    fn cleaning_twice_is_cleaning_once(mut mesh in garbage(), weld in 0..3_u8, isolated in 0..3_u8) {
        let params = CleanParams {
            weld_m: [0.0, 5.0e-3, 1.0][usize::from(weld)],
            isolated_m: [0.0, 1.0, 3.0][usize::from(isolated)],
            ..CleanParams::default()
        };
        let report = clean(&mut mesh, &params);
        prop_assert!(mesh.validate().is_ok());
        prop_assert_eq!(report.marks.iter().filter(|mark| !mark.is_removed()).count(), mesh.triangles.len());
        let once = mesh.clone();
        let again = clean(&mut mesh, &params);
        prop_assert_eq!(&mesh.positions, &once.positions);
        prop_assert_eq!(&mesh.normals, &once.normals);
        prop_assert_eq!(&mesh.triangles, &once.triangles);
        prop_assert_eq!((again.flipped, again.mended_attributes, again.moved_vertices), (0, 0, 0));
        let edges = |report: &CleanReport| (report.open.edges, report.non_manifold.edges, report.rims, report.pieces, report.patches);
        prop_assert_eq!(edges(&again), edges(&report));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(400) })]

    #[test]
    fn whatever_is_parted_is_a_mesh(mut mesh in garbage(), weld in 0..3_u8, isolated in 0..3_u8) {
        let (weld_m, isolated_m) = ([0.0, 5.0e-3, 1.0][usize::from(weld)], [0.0, 1.0, 3.0][usize::from(isolated)]);
        let before = mesh.triangles.len();
        let report = clean(&mut mesh, &CleanParams { weld_m, isolated_m, ..mending() });
        prop_assert!(mesh.validate().is_ok());
        prop_assert_eq!(report.marks.len(), before);
        let kept = report.marks.iter().filter(|mark| !mark.is_removed()).count();
        prop_assert!(report.t_junctions_mended.vertices > 0 || kept == mesh.triangles.len());
    }
}

/// A box of which one edge has a vertex more on one side than on the other.
fn with_a_t_junction() -> Mesh {
    let mut mesh = cube(Vec3::ZERO, Vec3::ONE);
    let [a, b, c] = mesh.triangles[0];
    let middle = (mesh.positions[a as usize] + mesh.positions[b as usize]) * 0.5;
    mesh.positions.push(middle);
    mesh.triangles[0] = [a, 8, c];
    mesh.triangles.push([8, b, c]);
    mesh
}

#[test]
fn a_t_junction_is_counted_placed_and_coloured() {
    let (_, whole) = cleaned(cube(Vec3::ZERO, Vec3::ONE), &CleanParams::default());
    assert_eq!(whole.t_junctions, VertexFinding::default());
    let mesh = with_a_t_junction();
    let (_, report) = cleaned(mesh.clone(), &CleanParams::default());
    assert_eq!(report.t_junctions, VertexFinding { vertices: 1, first: Some(mesh.positions[8].to_array()) });
    // one long edge and two short ones
    assert_eq!((report.open.edges, report.rims), (3, 1));
    let marked: Vec<usize> = (0..13).filter(|&t| report.marks[t] == Mark::TJunction).collect();
    let [t] = marked[..] else { panic!("{marked:?}") };
    let [a, b, _] = mesh.triangles[0];
    assert!(t != 0 && mesh.triangles[t].contains(&a) && !mesh.triangles[t].contains(&8), "its other side");
    assert!(mesh.triangles[12].contains(&b) && report.marks[12] == Mark::Open);
    let told = report.to_string();
    assert!(told.contains("1 vertices on the inside of edges without a neighbour (T-junctions), first at ("), "{told}");
    let json = serde_json::to_value(&report).unwrap();
    assert_eq!(json["t_junctions"]["vertices"], 1);
    assert!(paint(&mesh, &report.marks).colors_linear.contains(&color(Mark::TJunction)));
}

#[test]
fn t_junctions_are_found_within_the_weld_s_reach_and_wherever_the_mesh_is() {
    let count = |shift: Vec3, off: Vec3, weld_m: f32| {
        let mut mesh = with_a_t_junction();
        mesh.positions[8] += off;
        mesh.positions.iter_mut().for_each(|p| *p = *p * 0.73 + shift);
        cleaned(mesh, &CleanParams { weld_m, ..CleanParams::default() }).1.t_junctions.vertices
    };
    let side = Vec3::new(3.0e-4, 3.0e-4, 3.0e-4);
    assert_eq!(count(Vec3::ZERO, side, 0.0), 0, "a hole, and a vertex beside it");
    assert_eq!(count(Vec3::ZERO, side, 1.0e-3), 1);
    // rounded to f32 a kilometre off
    assert_eq!(count(Vec3::new(1234.567, -876.543, 999.321), Vec3::ZERO, 0.0), 1);
}

/// A wall of two triangles on the rim of ground of `parts` by `parts` squares, askew.
fn wall_on_ground(parts: u32) -> Mesh {
    let wall = Mesh {
        positions: vec![Vec3::ZERO, Vec3::Z, Vec3::new(0.0, 1.0, 1.0), Vec3::Y],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let mut mesh = joined(&[crate::shapes::grid(parts, |_, _| 0.0), wall]);
    let turn = glam::Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.9, -0.4);
    mesh.positions.iter_mut().for_each(|p| *p = turn * *p + Vec3::new(0.3, -0.2, 5.0));
    mesh
}

#[test]
fn a_long_edge_beside_many_short_ones_has_all_of_their_vertices() {
    let mesh = wall_on_ground(200);
    let (_, report) = cleaned(mesh, &CleanParams { weld_m: 1.0e-5, ..CleanParams::default() });
    assert_eq!(report.t_junctions.vertices, 199, "{report}");
}

/// What mending is asked of, beside nothing else.
fn mending() -> CleanParams {
    CleanParams { t_junctions: TJunctions::Mend, ..CleanParams::default() }
}

fn area(mesh: &Mesh) -> f64 {
    (0..mesh.triangles.len()).map(|t| double_area(mesh, t).length() * 0.5).sum()
}

#[test]
fn a_body_that_is_open_at_a_t_junction_alone_is_closed() {
    let mut mesh = with_a_t_junction();
    let material = |name: &str| Material { name: name.into(), base_color_linear: Vec3::ONE, texture: None };
    mesh.materials = ["stone", "wood"].map(material).into();
    mesh.triangle_material = (0..13).map(|t| u16::from(t % 2 == 1)).collect();
    let (_, told) = cleaned(mesh.clone(), &CleanParams::default());
    let parted = told.marks.iter().position(|&mark| mark == Mark::TJunction).unwrap();
    let (mended, report) = cleaned(mesh.clone(), &mending());
    assert_eq!(report.t_junctions_mended, VertexFinding { vertices: 1, first: Some(mesh.positions[8].to_array()) });
    assert_eq!((report.t_junctions.vertices, report.open.edges, report.rims, report.closed_patches), (0, 0, 0, 1), "{report}");
    assert_eq!((mended.positions.len(), mended.triangles.len(), report.marks.len()), (9, 14, 13));
    assert_eq!(report.marks[parted], Mark::TJunction);
    assert!((volume(&mended) - 1.0).abs() < 1e-6 && (area(&mended) - 6.0).abs() < 1e-6);
    // the second part is of the first one's stone
    assert_eq!(mended.triangle_material[13], mesh.triangle_material[parted]);
    assert!(
        report.to_string().contains("1 vertices on the inside of edges without a neighbour (T-junctions), mended by parting"),
        "{report}"
    );
    assert!(paint(&mesh, &report.marks).colors_linear.contains(&color(Mark::TJunction)));
    let (again, report) = cleaned(mended.clone(), &mending());
    assert_eq!((again.triangles, report.t_junctions_mended.vertices), (mended.triangles, 0));
}

#[test]
fn what_lies_between_two_corners_is_between_their_looks() {
    // a triangle over two small ones, which look otherwise
    let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    let mesh = Mesh {
        positions: vec![
            corner(0.0, 0.0),
            corner(4.0, 0.0),
            corner(0.0, 3.0),
            corner(0.0, 0.0),
            corner(1.0, 0.0),
            corner(4.0, 0.0),
            corner(1.0, -2.0),
        ],
        normals: [[Vec3::Z; 3].as_slice(), &[Vec3::Y; 4]].concat(),
        uvs: [[0.0, 0.0], [4.0, 8.0], [0.0, 3.0], [9.0, 9.0], [9.0, 9.0], [9.0, 9.0], [9.0, 9.0]].map(Vec2::from).into(),
        colors_linear: [[Vec3::ZERO, Vec3::X, Vec3::Y].as_slice(), &[Vec3::ONE; 4]].concat(),
        triangles: vec![[0, 1, 2], [3, 6, 4], [4, 6, 5]],
        ..Mesh::default()
    };
    let (mended, report) = cleaned(mesh, &mending());
    assert_eq!((report.t_junctions_mended.vertices, mended.triangles.len(), mended.positions.len()), (1, 4, 8));
    let new = mended.positions.len() - 1;
    let look = (mended.positions[new], mended.normals[new], mended.uvs[new], mended.colors_linear[new]);
    assert_eq!(look, (corner(1.0, 0.0), Vec3::Z, Vec2::new(1.0, 2.0), Vec3::X * 0.25));
}

#[test]
fn edges_with_vertices_on_all_sides_are_parted_into_triangles_with_area() {
    // a large triangle in a ring of small ones: each of its edges has many vertices
    let corners = [Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 4.0];
    for count in [1, 2, 7] {
        let (mut positions, mut triangles) = (corners.to_vec(), vec![[0, 1, 2]]);
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            let outside = (a + b) * 0.5 * 1.8 - (corners[0] + corners[1] + corners[2]) / 3.0 * 0.8;
            for i in 0..=count {
                let at = |i: usize| a.lerp(b, i as f32 / (count + 1) as f32);
                let first = positions.len() as u32;
                positions.extend([at(i), outside, at(i + 1)]);
                triangles.push([first, first + 1, first + 2]);
            }
        }
        let mesh = Mesh { positions, triangles, ..Mesh::default() };
        let before = area(&mesh);
        let (mended, report) = cleaned(mesh, &mending());
        assert_eq!(report.t_junctions_mended.vertices, 3 * count as u64, "{report}");
        assert_eq!(report.t_junctions.vertices, 0, "{report}");
        assert_eq!(mended.triangles.len(), 3 * (count + 1) + 1 + 3 * count);
        assert!((area(&mended) - before).abs() < 1e-4);
        assert!((0..mended.triangles.len()).all(|t| double_area(&mended, t).z > 1e-3), "none is flat or turned over");
    }
}

#[test]
fn a_wall_on_fine_ground_takes_all_of_its_vertices() {
    let mesh = wall_on_ground(50);
    let before = (area(&mesh), mesh.triangles.len());
    let (mended, report) = cleaned(mesh, &CleanParams { isolated_m: 0.0, ..CleanParams::modelled() });
    assert_eq!((report.t_junctions_mended.vertices, report.t_junctions.vertices), (49, 0), "{report}");
    assert_eq!(mended.triangles.len(), before.1 + 49);
    assert!((area(&mended) - before.0).abs() < 1e-5);
}

#[test]
fn a_sliver_that_would_be_turned_over_is_left() {
    // a vertex within the weld's reach of the long edge, on the far side of the corner before it
    let reach = 1.0e-3_f32;
    let mesh = Mesh {
        positions: vec![
            Vec3::ZERO,
            Vec3::X,
            Vec3::new(0.5, 0.2 * reach, 0.0),
            Vec3::new(0.0, -1.0, 0.0),
            Vec3::new(0.45, 0.9 * reach, 0.0),
            Vec3::new(1.0, -1.0, 0.0),
        ],
        triangles: vec![[0, 1, 2], [3, 5, 4]],
        ..Mesh::default()
    };
    let (mended, report) = cleaned(mesh.clone(), &CleanParams { weld_m: reach, ..mending() });
    assert_eq!((report.t_junctions_mended.vertices, report.t_junctions.vertices), (0, 1), "{report}");
    assert_eq!((mended.triangles, mended.positions), (mesh.triangles, mesh.positions));
}

#[test]
fn dust_that_fills_a_gap_between_junctions_stays_and_doubles_go() {
    // a small triangle whose corners lie inside the edges of those around it is none of the dust
    let [a, b, c] = [Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 4.0];
    let [p, q, r] = [a.lerp(b, 0.5), b.lerp(c, 0.5), c.lerp(a, 0.5)];
    let around = |from: Vec3, to: Vec3, out: Vec3| [from, out, to];
    let inner = [[p, q, r]];
    let ring = [
        around(p.lerp(q, -0.5), p.lerp(q, 1.5), b),
        around(q.lerp(r, -0.5), q.lerp(r, 1.5), c),
        around(r.lerp(p, -0.5), r.lerp(p, 1.5), a),
    ];
    let corners: Vec<Vec3> = inner.iter().chain(&ring).flatten().copied().collect();
    let triangles = (0..4).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let mesh = Mesh { positions: corners, triangles, ..Mesh::default() };
    let kept = |params: CleanParams| cleaned(mesh.clone(), &CleanParams { isolated_m: 4.0, ..params }).1.isolated.triangles;
    assert_eq!((kept(CleanParams::default()), kept(mending())), (1, 0));
    // a triangle and its half
    let double = Mesh { positions: vec![a, b, c, p], triangles: vec![[0, 1, 2], [3, 1, 2]], ..Mesh::default() };
    let (left, report) = cleaned(double, &mending());
    assert_eq!((report.t_junctions_mended.vertices, report.duplicate.triangles, left.triangles.len()), (1, 1, 2), "{report}");
}

#[test]
fn junctions_that_would_be_too_many_are_told_only() {
    // edges that overlap on a line have each other's ends on them
    let positions = (1..1800).flat_map(|i| {
        let x = i as f32;
        [Vec3::new(-x, 0.0, 0.0), Vec3::new(x, 0.0, 0.0), Vec3::new(0.0, 1.0, x)]
    });
    let positions: Vec<Vec3> = positions.collect();
    let triangles: Vec<[u32; 3]> = (0..positions.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let mesh = Mesh { positions, triangles, ..Mesh::default() };
    let (left, report) = cleaned(mesh.clone(), &mending());
    assert_eq!((report.t_junctions_mended.vertices, left.triangles.len()), (0, mesh.triangles.len()));
    assert!(report.t_junctions.vertices > 3000, "{report}");
}

#[test]
fn a_vertex_too_near_a_corner_does_not_keep_the_others_of_its_edge() {
    // five metres of edge, with a vertex in the middle and one eight micrometres before the corner
    let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    let near = 5.0 - 8.0e-6;
    let positions = vec![
        corner(0.0, 0.0),
        corner(5.0, 0.0),
        corner(0.0, 5.0),
        corner(0.0, -3.0),
        corner(2.5, 0.0),
        corner(near, 0.0),
        corner(2.5, -3.0),
    ];
    let mesh = Mesh { positions, triangles: vec![[0, 1, 2], [0, 3, 4], [4, 6, 5]], ..Mesh::default() };
    let (mended, report) = cleaned(mesh, &mending());
    let told = (report.t_junctions_mended.first, report.t_junctions.first);
    assert_eq!(told, (Some([2.5, 0.0, 0.0]), Some([near, 0.0, 0.0])), "{report}");
    assert_eq!((report.t_junctions_mended.vertices, report.t_junctions.vertices, mended.triangles.len()), (1, 1, 4));
}
