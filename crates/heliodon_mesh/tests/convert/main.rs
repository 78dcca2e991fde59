//! Converted models are the models that they were, within the bounds that are told; hostile ones end in words.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

mod hostile;
mod same;

use glam::{Quat, Vec2, Vec3};
use heliodon_mesh::convert::{ConvertParams, Converted, GENERATOR, NormalBits, compare, convert};
use heliodon_mesh::export::scene::{Channel, Clip, Interpolation, MorphTarget, Node, Scene, SceneMesh, Track};
use heliodon_mesh::export::{write_glb, write_ply};
use heliodon_mesh::import::{Format, ImportOptions, ImportReport};
use heliodon_mesh::motion::{self, MovingMesh};
use heliodon_mesh::{Mesh, figures};
use heliodon_testkit::hostile::files::glb;
use proptest::prelude::*;
use same::assert_same;
use serde_json::Value;
use std::path::Path;

fn read(path: &Path) -> MovingMesh {
    motion::read_moving(path, &ImportOptions::default(), &mut ImportReport::default()).unwrap()
}

fn read_back(converted: &Converted) -> MovingMesh {
    let mut report = ImportReport::default();
    let name = Path::new("back.glb");
    let model = motion::from_bytes(&converted.bytes, Format::Gltf, name, &ImportOptions::default(), &mut report).unwrap();
    model.validate().unwrap();
    assert_eq!(report.warnings, [""; 0]);
    model
}

fn document(converted: &Converted) -> Value {
    let length = u32::from_le_bytes(converted.bytes[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&converted.bytes[20..20 + length]).unwrap()
}

const PACKED: ConvertParams = ConvertParams { tolerance_m: 1.0e-3, normals: NormalBits::Sixteen, compress: true };

/// Converts a file both ways, and compares what comes back with what it was.
fn check(path: &Path, tolerance_m: f64) -> (Converted, Converted) {
    let before = read(path);
    let both = [ConvertParams::default(), PACKED].map(|params| {
        let params = ConvertParams { tolerance_m, ..params };
        let mut told = ImportReport::default();
        let converted = convert(path, &params, &mut told).unwrap();
        assert_eq!(told.warnings, [""; 0]);
        let after = read_back(&converted);
        compare(&before, &after, &converted.report).unwrap();
        assert!(converted.report.bounds.position_m <= tolerance_m);
        assert_same(&before, &after, &converted.report.bounds);
        converted
    });
    let [plain, packed] = both;
    (plain, packed)
}

#[test]
fn what_walks_walks_and_what_turns_turns() {
    let folder = tempfile::tempdir().unwrap();
    for (name, scene) in [("walker.glb", figures::walker()), ("stoneyard.glb", figures::stoneyard())] {
        let path = folder.path().join(name);
        write_glb(&path, &scene).unwrap();
        let (plain, packed) = check(&path, 1.0e-3);
        let report = &plain.report;
        assert_eq!(report.bytes.before, std::fs::metadata(&path).unwrap().len());
        assert!(report.gpu_bytes.after * 10 < report.gpu_bytes.before * 7 && report.bytes.after < report.bytes.before);
        assert!(packed.report.bytes.after < report.bytes.after);
        assert!(report.cache_misses.after < report.cache_misses.before);
        let document = document(&plain);
        assert_eq!(document["asset"]["generator"], GENERATOR);
        assert_eq!(document["extensionsRequired"], serde_json::json!(["KHR_mesh_quantization"]));
        assert_eq!(document["nodes"][0]["name"], scene.nodes[0].name);
        assert_eq!(document["animations"].as_array().unwrap().len(), scene.clips.len());
    }
}

fn flag() -> Scene {
    let at = |x: u32, y: u32| Vec3::new(x as f32 * 0.1, y as f32 * 0.1, 0.0);
    let positions: Vec<Vec3> = (0..8).flat_map(|y| (0..8).map(move |x| at(x, y))).collect();
    let cell = |x: u32, y: u32| [[y * 8 + x, y * 8 + x + 1, y * 8 + x + 8], [y * 8 + x + 1, y * 8 + x + 9, y * 8 + x + 8]];
    let triangles = (0..7).flat_map(|y| (0..7).flat_map(move |x| cell(x, y))).collect();
    let offsets = positions.iter().map(|p| Vec3::Z * (1.5 * p.x)).collect();
    let mesh = Mesh { normals: vec![Vec3::Z; positions.len()], positions, triangles, ..Mesh::default() };
    let targets = vec![MorphTarget { name: "blown".into(), offsets }];
    let channel = |track| Channel { node: 0, times_s: vec![0.0, 0.5, 1.0], track, interpolation: Interpolation::Linear };
    let turns = [0.0_f32, 1.0, 2.0].map(Quat::from_rotation_y).to_vec();
    let channels = vec![channel(Track::Weights(vec![0.0, 1.0, 0.0])), channel(Track::Rotation(turns))];
    Scene {
        nodes: vec![Node { mesh: Some(0), ..Node::at("flag", Vec3::new(3.0, 2.0, -1.0)) }],
        meshes: vec![SceneMesh { name: "flag".into(), mesh, targets, ..SceneMesh::default() }],
        skins: Vec::new(),
        clips: vec![Clip { name: "wave".into(), channels }],
    }
}

#[test]
fn what_morphs_on_a_turning_node_does_so_still() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flag.glb");
    write_glb(&path, &flag()).unwrap();
    let (plain, _) = check(&path, 1.0e-3);
    let document = document(&plain);
    // the node keeps its name and its turning; what moves weights goes to the node that undoes the grid
    let channels = document["animations"][0]["channels"].as_array().unwrap().iter().map(|c| c["target"].to_string());
    assert_eq!(channels.collect::<Vec<_>>(), [r#"{"node":1,"path":"weights"}"#, r#"{"node":0,"path":"rotation"}"#]);
    assert_eq!(document["meshes"][0]["extras"]["targetNames"][0], "blown");
}

#[test]
fn a_mesh_too_large_for_16_bits_keeps_its_floats() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flag.glb");
    write_glb(&path, &flag()).unwrap();
    let (plain, _) = check(&path, 1.0e-6);
    assert_eq!((plain.report.kept_floats, plain.report.bounds.position_m), (1, 0.0));
    assert!(plain.report.bounds.normal_deg > 0.3);
}

#[test]
fn the_same_for_any_number_of_threads_and_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walker.glb");
    write_glb(&path, &figures::walker()).unwrap();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| convert(&path, &PACKED, &mut ImportReport::default()).unwrap().bytes)
    };
    let once = with(1);
    assert_eq!(once, with(3));
    // whole numbers stay what they are
    let again = folder.path().join("again.glb");
    std::fs::write(&again, &once).unwrap();
    let twice = convert(&again, &PACKED, &mut ImportReport::default()).unwrap();
    assert_eq!(twice.report.bounds.position_m, 0.0);
    assert_same(&read(&again), &read_back(&twice), &twice.report.bounds);
}

#[test]
fn compression_that_is_not_written_is_undone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("it.glb");
    for compressed in heliodon_testkit::draco::all() {
        std::fs::write(&path, glb(&compressed.json(), compressed.stream)).unwrap();
        let (plain, packed) = check(&path, 1.0e-3);
        assert_eq!(document(&plain)["extensionsRequired"], serde_json::json!(["KHR_mesh_quantization"]));
        for converted in [plain, packed] {
            assert!(!document(&converted).to_string().contains("draco"));
            assert_eq!(converted.report.triangles.after, compressed.triangles as u64);
        }
    }
}

#[test]
fn vertices_and_triangles_that_are_nothing_go() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("soup.obj");
    let quad =
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 0\nv 0.500000001 0.5 0\nf 1 2 3\nf 4 5 6\nf 1 7 8\n";
    std::fs::write(&path, quad).unwrap();
    let converted = convert(&path, &ConvertParams::default(), &mut ImportReport::default()).unwrap();
    let report = &converted.report;
    assert_eq!((report.triangles.after, report.vertices.after), (2, 4), "{report:?}");
    assert_eq!(read_back(&converted).rest().triangles.len(), 2);
}

fn meshes() -> impl Strategy<Value = Mesh> {
    let number = -20.0_f32..20.0;
    let vertex = (number.clone(), number.clone(), number, 0.0_f32..1.0, 0.0_f32..1.0, -1.0_f32..1.0);
    let corners = proptest::collection::vec((0_u32..24, 0_u32..24, 0_u32..24), 1..40);
    (proptest::collection::vec(vertex, 24), corners, 0.1_f32..4.0).prop_filter_map(
        "no triangle",
        |(vertices, corners, wide)| {
            let triangles: Vec<[u32; 3]> =
                corners.into_iter().map(|(a, b, c)| [a, b, c]).filter(|[a, b, c]| a != b && b != c && c != a).collect();
            let normal = |v: &(f32, f32, f32, f32, f32, f32)| Vec3::new(v.5, v.3 - 0.5, v.4 - 0.3).normalize_or(Vec3::Y);
            (!triangles.is_empty()).then(|| Mesh {
                positions: vertices.iter().map(|v| Vec3::new(v.0, v.1, v.2)).collect(),
                normals: vertices.iter().map(normal).collect(),
                uvs: vertices.iter().map(|v| Vec2::new(v.3, v.5) * wide).collect(),
                colors_linear: vertices.iter().map(|v| Vec3::new(v.4, v.3, v.5.abs())).collect(),
                triangles,
                ..Mesh::default()
            })
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]
    #[test]
    fn any_mesh_comes_back_within_its_bounds(mesh in meshes(), shift in -50.0_f32..50.0) {
        let folder = tempfile::tempdir().unwrap();
        let node = Node { mesh: Some(0), scale: Vec3::new(0.5, 2.0, 1.0), ..Node::at("it", Vec3::new(shift, 1.0, -shift)) };
        let mesh = SceneMesh { name: "it".into(), mesh, ..SceneMesh::default() };
        let scene = Scene { nodes: vec![node], meshes: vec![mesh], skins: Vec::new(), clips: Vec::new() };
        let path = folder.path().join("it.glb");
        write_glb(&path, &scene).unwrap();
        check(&path, 2.0e-3);
    }

    #[test]
    fn any_scan_comes_back_within_its_bounds(mesh in meshes()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("it.ply");
        write_ply(&path, &mesh, None).unwrap();
        check(&path, 2.0e-3);
    }
}
