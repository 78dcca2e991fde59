//! What a pose costs: `cargo test -p heliodon_mesh --test motion -- --ignored --nocapture`.

use crate::glb::Glb;
use crate::read_with;
use glam::Vec3;
use heliodon_mesh::import::{ImportOptions, ImportReport};
use heliodon_mesh::motion::pc2::{self, PointCache};
use heliodon_mesh::motion::{MovingMesh, Pose, read_cached};
use serde_json::{Value, json};
use std::fmt::Write;
use std::time::Instant;

const JOINTS: usize = 64;

/// A tube of 225 rings of 37 vertices, each on four of 64 joints in a chain, all of which turn.
fn figure() -> Vec<u8> {
    let (rings, around) = (225_usize, 37_usize);
    let mut glb = Glb::default();
    let (mut positions, mut normals, mut joints, mut weights, mut indices) = (vec![], vec![], vec![], vec![], vec![]);
    for ring in 0..rings {
        for k in 0..around {
            let (sin, cos) = (k as f32 * std::f32::consts::TAU / around as f32).sin_cos();
            positions.push([0.2 * cos, ring as f32 * 0.01, 0.2 * sin]);
            normals.push([cos, 0.0, sin]);
            let joint = (ring * (JOINTS - 4) / rings) as u8;
            joints.extend([joint, joint + 1, joint + 2, joint + 3]);
            weights.push([0.4, 0.3, 0.2, 0.1]);
            if ring + 1 < rings {
                let (a, b) = ((ring * around + k) as u16, (ring * around + (k + 1) % around) as u16);
                let up = around as u16;
                indices.extend([a, a + up, b, b, a + up, b + up]);
            }
        }
    }
    let count = positions.len();
    assert_eq!(count, 8325);
    let position = glb.floats("VEC3", &positions);
    let normal = glb.floats("VEC3", &normals);
    let joints = glb.raw("VEC4", 5121, false, count, &joints);
    let weights = glb.floats("VEC4", &weights);
    let indices = glb.indices(&indices);
    let times: Vec<f32> = (0..30).map(|k| k as f32 / 30.0).collect();
    let times = glb.scalars(&times);
    let turns: Vec<[f32; 4]> = (0..30).map(|k| [0.0, 0.0, (k as f32 * 0.003).sin(), (k as f32 * 0.003).cos()]).collect();
    let turns = glb.floats("VEC4", &turns);
    let nodes: Vec<Value> = (0..JOINTS)
        .map(|k| json!({"translation": [0.0, 0.03, 0.0], "children": if k + 1 < JOINTS { vec![k + 1] } else { vec![] }}))
        .collect();
    let channels: Vec<Value> = (0..JOINTS).map(|k| json!({"sampler": 0, "target": {"node": k, "path": "rotation"}})).collect();
    let mut nodes = nodes;
    nodes.push(json!({"mesh": 0, "skin": 0}));
    glb.finish(json!({
        "scenes": [{"nodes": [0, JOINTS]}],
        "nodes": nodes,
        "skins": [{"joints": (0..JOINTS).collect::<Vec<_>>()}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": position, "NORMAL": normal, "JOINTS_0": joints, "WEIGHTS_0": weights}, "indices": indices}]}],
        "animations": [{"samplers": [{"input": times, "output": turns}], "channels": channels}],
    }))
}

/// A square of 57 by 57 vertices that waves.
fn cloth() -> MovingMesh {
    let side = 57;
    let mut obj = String::new();
    let point = |i: usize, t: f32| {
        let (x, y) = ((i % side) as f32 / 56.0, (i / side) as f32 / 56.0);
        Vec3::new(x, y, 0.1 * (8.0 * x + t).sin() * (5.0 * y - t).cos())
    };
    for i in 0..side * side {
        let p = point(i, 0.0);
        writeln!(obj, "v {} {} {}", p.x, p.y, p.z).unwrap();
    }
    for i in (0..side * (side - 1)).filter(|i| (i + 1) % side != 0) {
        writeln!(obj, "f {} {} {} {}", i + 1, i + 2, i + side + 2, i + side + 1).unwrap();
    }
    let positions = (0..40).flat_map(|s| (0..side * side).map(move |i| point(i, s as f32 * 0.1))).collect();
    let folder = tempfile::tempdir().unwrap();
    let (mesh, cache) = (folder.path().join("a.obj"), folder.path().join("a.pc2"));
    std::fs::write(&mesh, obj).unwrap();
    let points = PointCache { points: side * side, start_frame: 1.0, frames_per_sample: 1.0, positions };
    pc2::write(&mut std::fs::File::create(&cache).unwrap(), &points).unwrap();
    read_cached(&mesh, &cache, &ImportOptions::default(), &mut ImportReport::default()).unwrap()
}

#[test]
#[ignore = "measures"]
fn what_a_pose_costs() {
    for (name, moving) in [("figure", read_with(&figure(), &ImportOptions::default()).0), ("cloth", cloth())] {
        let mut pose = Pose::default();
        moving.pose(0, 0.0, &mut pose);
        let duration_s = moving.clips()[0].duration_s;
        let mut times: Vec<f64> = (0..400)
            .map(|k| {
                let begin = Instant::now();
                moving.pose(0, k as f32 / 400.0 * duration_s, &mut pose);
                begin.elapsed().as_secs_f64() * 1000.0
            })
            .collect();
        times.sort_by(f64::total_cmp);
        let (vertices, triangles) = (moving.rest().positions.len(), moving.rest().triangles.len());
        println!(
            "{name}: {vertices} vertices, {triangles} triangles: least {:.3} ms, median {:.3} ms a pose",
            times[0], times[200]
        );
    }
}
