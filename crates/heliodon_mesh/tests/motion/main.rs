//! Models that move: exact poses of small files written here, hostile ones, and what a pose costs.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

mod cache;
mod glb;
mod hostile;
mod shared;
mod timing;

use glam::Vec3;
use glb::{Glb, HALF, U8, arm, arm_with, float_weights, morphing, objects};
use heliodon_mesh::import::{self, Format, ImportOptions, ImportReport};
use heliodon_mesh::motion::{self, MovingMesh, Pose};
use heliodon_mesh::place::{Placement, Unit, Up};
use serde_json::{Value, json};
use std::path::Path;

fn read_with(bytes: &[u8], options: &ImportOptions) -> (MovingMesh, ImportReport) {
    let mut report = ImportReport::default();
    let moving = motion::from_bytes(bytes, Format::Gltf, Path::new("test.glb"), options, &mut report).unwrap();
    moving.validate().unwrap();
    (moving, report)
}

fn read(bytes: &[u8]) -> MovingMesh {
    let (moving, report) = read_with(bytes, &ImportOptions::default());
    assert_eq!(report.warnings, [""; 0]);
    moving
}

fn posed(moving: &MovingMesh, clip: usize, time_s: f32) -> Pose {
    let mut pose = Pose::default();
    moving.pose(clip, time_s, &mut pose);
    pose
}

fn near(a: &[Vec3], b: &[Vec3]) {
    within(1e-6, a, b);
}

fn within(tolerance: f32, a: &[Vec3], b: &[Vec3]) {
    assert_eq!(a.len(), b.len());
    assert!(a.iter().zip(b).all(|(a, b)| a.distance(*b) < tolerance), "{a:?}\n{b:?}");
}

const ARM: [[f32; 3]; 6] =
    [[0.0, 0.5, 0.0], [0.0, -0.5, 0.0], [1.0, 0.5, 0.0], [1.0, -0.5, 0.0], [2.0, 0.5, 0.0], [2.0, -0.5, 0.0]];

#[test]
fn an_arm_bends_at_its_elbow() {
    let moving = read(&arm(float_weights));
    near(&moving.rest().positions, &ARM.map(Vec3::from));
    assert_eq!((moving.clips().len(), moving.clip_named("bend"), moving.clips()[0].duration_s), (1, Some(0), 2.0));
    assert_eq!(moving.clip_named("stretch"), None);
    assert!(!moving.rigid(0) && moving.rigid_at(0, 1.0).is_none());
    let bent = posed(&moving, 0, 2.0);
    // the forearm stands up; the elbow's vertices stand half way between where either joint would have them
    let expected = [[0.0, 0.5, 0.0], [0.0, -0.5, 0.0], [0.75, 0.25, 0.0], [1.25, -0.25, 0.0], [0.5, 1.0, 0.0], [1.5, 1.0, 0.0]];
    near(&bent.positions, &expected.map(Vec3::from));
    let (up, between, back) = (Vec3::Y, Vec3::new(-HALF, HALF, 0.0), Vec3::NEG_X);
    near(&bent.normals, &[up, up, between, between, back, back]);
    // half way it has turned by half of the angle
    let half = posed(&moving, 0, 1.0);
    near(&half.positions[4..5], &[Vec3::new(1.0 + HALF - 0.5 * HALF, HALF + 0.5 * HALF, 0.0)]);
    // times outside are clamped, and a clip that is not there is the rest
    near(&posed(&moving, 0, 99.0).positions, &bent.positions);
    near(&posed(&moving, 0, f32::NAN).positions, &moving.rest().positions);
    near(&posed(&moving, 7, 1.0).positions, &moving.rest().positions);
}

#[test]
fn quantised_weights_bend_it_the_same_way() {
    let bytes = |glb: &mut Glb| {
        let row = |a: u8, b: u8| [a, b, 0, 0].repeat(2);
        glb.raw("VEC4", U8, true, 6, &[row(255, 0), row(51, 204), row(0, 255)].concat())
    };
    let bent = posed(&read(&arm(bytes)), 0, 2.0);
    near(&bent.positions[2..3], &[Vec3::new(1.0, 0.5, 0.0) * 0.2 + Vec3::new(0.5, 0.0, 0.0) * 0.8]);
    near(&bent.positions[4..5], &[Vec3::new(0.5, 1.0, 0.0)]);
}

#[test]
fn the_default_pose_is_that_of_the_joints_where_they_stand() {
    let raised = |_: &mut Glb, mut document: Value| {
        document["nodes"][1]["translation"] = json!([0.0, 3.0, 0.0]);
        document["nodes"][2]["scale"] = json!([1.0, 4.0, 1.0]);
        document["animations"] = json!([]);
        document
    };
    let moving = read(&arm_with(float_weights, raised));
    assert!(moving.clips().is_empty() && moving.rigid(0));
    near(&moving.rest().positions[4..], &[Vec3::new(2.0, 5.0, 0.0), Vec3::new(2.0, 1.0, 0.0)]);
    near(&moving.rest().normals, &[Vec3::Y; 6]);
}

#[test]
fn a_mirrored_skeleton_turns_its_triangles_round() {
    let mirrored = |_: &mut Glb, mut document: Value| {
        document["nodes"][1]["scale"] = json!([-1.0, 1.0, 1.0]);
        document
    };
    let (plain, moving) = (read(&arm(float_weights)), read(&arm_with(float_weights, mirrored)));
    let [a, b, c] = plain.rest().triangles[0];
    assert_eq!(moving.rest().triangles[0], [a, c, b]);
    let bent = posed(&moving, 0, 2.0);
    near(&bent.positions[4..], &[Vec3::new(-0.5, 1.0, 0.0), Vec3::new(-1.5, 1.0, 0.0)]);
    near(&bent.normals[4..], &[Vec3::X; 2]);
}

#[test]
fn a_joint_that_scales_unevenly_keeps_normals_upright() {
    let slanted = |glb: &mut Glb, mut document: Value| {
        let normal = glb.floats("VEC3", &[[HALF, HALF, 0.0]; 6]);
        document["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normal.into();
        let times = glb.scalars(&[0.0]);
        let scale = glb.floats("VEC3", &[[1.0, 3.0, 1.0]]);
        document["animations"][0]["samplers"] = json!([{"input": times, "output": scale}]);
        document["animations"][0]["channels"][0]["target"]["path"] = "scale".into();
        document
    };
    let pose = posed(&read(&arm_with(float_weights, slanted)), 0, 0.0);
    near(&pose.positions[4..], &[Vec3::new(2.0, 1.5, 0.0), Vec3::new(2.0, -1.5, 0.0)]);
    near(&pose.normals[4..5], &[Vec3::new(3.0, 1.0, 0.0) / 10_f32.sqrt()]);
}

#[test]
fn objects_move_on_their_own() {
    let moving = read(&objects());
    let still = import::from_bytes(
        &objects(),
        Format::Gltf,
        Path::new("test.glb"),
        &ImportOptions::default(),
        &mut ImportReport::default(),
    )
    .unwrap();
    assert_eq!((&moving.rest().positions, &moving.rest().normals), (&still.positions, &still.normals));
    assert_eq!(moving.rest().triangles, still.triangles);
    let names: Vec<&str> = moving.clips().iter().map(|clip| clip.name.as_str()).collect();
    assert_eq!(names, ["slide", "animation 1"]);
    for (time_s, x) in [(0.0, 1.0), (0.99, 1.0), (1.0, 2.0), (1.9, 2.0), (2.0, 5.0)] {
        let pose = posed(&moving, 0, time_s);
        assert_eq!(pose.positions[0], Vec3::X * x, "{time_s}");
        assert_eq!(pose.positions[3..], still.positions[3..]);
    }
    let turned = posed(&moving, 1, 1.5);
    assert_eq!(turned.positions[..3], still.positions[..3]);
    // a quarter turn about +Y takes +X to -Z; from the turn to its negative nothing moves
    near(&turned.positions[3..6], &[Vec3::new(0.0, 2.0, 0.0), Vec3::new(0.0, 2.0, -1.0), Vec3::new(-1.0, 2.0, 0.0)]);
    near(&turned.positions[6..], &[Vec3::new(0.0, 3.0, 0.0), Vec3::new(0.0, 3.0, -2.0), Vec3::new(-2.0, 3.0, 0.0)]);
    near(&turned.normals[3..], &[Vec3::Y; 6]);
    let eighth = posed(&moving, 1, 0.75);
    near(&eighth.positions[4..5], &[Vec3::new(HALF, 2.0, -HALF)]);
    assert!(!moving.rigid(0) && !moving.rigid(1));
}

/// The objects, of which only the second and its child are shown.
fn one_body(change: impl FnOnce(&mut Value)) -> Vec<u8> {
    let whole = objects();
    let length = u32::from_le_bytes(whole[12..16].try_into().unwrap()) as usize;
    let mut document: Value = serde_json::from_slice(&whole[20..20 + length]).unwrap();
    document["nodes"][0].as_object_mut().unwrap().remove("mesh");
    change(&mut document);
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let rest = &whole[20 + length..];
    let word = |n: usize| (n as u32).to_le_bytes();
    [&whole[..8], &word(20 + json.len() + rest.len()), &word(json.len()), b"JSON", &json, rest].concat()
}

#[test]
fn a_clip_of_one_body_is_rigid_and_says_how() {
    let placement = Placement { unit: Unit::Centimetre, up: Up::Z, translate: [1.0, 2.0, 3.0], ..Placement::default() };
    let options = ImportOptions { placement, ..ImportOptions::default() };
    let (moving, _) = read_with(&one_body(|_| {}), &options);
    assert!(moving.rigid(0), "it moves nothing");
    assert!(moving.rigid_at(0, 1.0).unwrap().abs_diff_eq(glam::DAffine3::IDENTITY, 0.0));
    assert!(moving.rigid(1));
    for time_s in [0.0, 0.7, 2.0] {
        let motion = moving.rigid_at(1, time_s).unwrap();
        let pose = posed(&moving, 1, time_s);
        let moved: Vec<Vec3> =
            moving.rest().positions.iter().map(|p| motion.transform_point3(p.as_dvec3()).as_vec3()).collect();
        near(&pose.positions, &moved);
        let turned: Vec<Vec3> =
            moving.rest().normals.iter().map(|n| motion.transform_vector3(n.as_dvec3()).as_vec3()).collect();
        near(&pose.normals, &turned);
    }
    // turned below a parent that is wider than high, it shears
    let sheared = one_body(|document| {
        document["nodes"][0] = json!({"scale": [1.0, 1.0, 3.0], "children": [1]});
    });
    assert!(!read(&sheared).rigid(1));
    // and a placement that is wider than high shears it, too
    let placement = Placement { scale: [1.0, 1.0, 2.0], ..Placement::default() };
    assert!(!read_with(&one_body(|_| {}), &ImportOptions { placement, ..ImportOptions::default() }).0.rigid(1));
}

#[test]
fn a_morph_goes_half_way() {
    let moving = read(&morphing(true));
    // the second target's default weight shifts the rest by 2.5
    let rest = [[0.0, 0.0, 2.5], [1.0, 0.0, 2.5], [1.0, 0.0, 1.5], [0.0, 0.0, 1.5]].map(Vec3::from);
    near(&moving.rest().positions, &rest);
    let half = posed(&moving, 0, 0.5);
    let mut lifted = rest;
    lifted[2].y = 1.0;
    near(&half.positions, &lifted);
    near(&half.normals, &[Vec3::new(HALF, HALF, 0.0); 4]);
    assert!(!moving.rigid(0));
}

#[test]
fn a_morph_of_positions_only_gets_normals_of_its_own() {
    let moving = read(&morphing(false));
    near(&moving.rest().normals, &[Vec3::Y; 4]);
    let half = posed(&moving, 0, 0.5);
    let (right, left) = (Vec3::new(0.0, 1.0, 1.0) * HALF, Vec3::new(-1.0, 1.0, 0.0) * HALF);
    near(&half.normals[1..2], &[right]);
    near(&half.normals[3..], &[left]);
    assert!(half.normals[0].dot(right) > 0.8 && half.normals[0].dot(left) > 0.8);
}

#[test]
fn poses_are_placed_as_the_rest_is() {
    let placement = Placement {
        unit: Unit::Centimetre,
        up: Up::Z,
        scale: [1.0, -2.0, 3.0],
        rotate_deg: [10.0, 20.0, 30.0],
        translate: [5.0, 6.0, 7.0],
        origin: [1.0, 0.0, 2.0],
    };
    let (options, affine) = (ImportOptions { placement, ..ImportOptions::default() }, placement.affine().unwrap());
    // normals computed of triangles of 1 cm, 5 m away, where positions are rounded to 5e-7 m
    for (bytes, clip, tolerance) in [(arm(float_weights), 0, 1e-6), (objects(), 1, 1e-4), (morphing(true), 0, 1e-6)] {
        let (plain, (placed, _)) = (read(&bytes), read_with(&bytes, &options));
        for time_s in [0.0, 0.6, 2.0] {
            let (plain, placed) = (posed(&plain, clip, time_s), posed(&placed, clip, time_s));
            let positions: Vec<Vec3> = plain.positions.iter().map(|p| affine.position(p.as_dvec3()).as_vec3()).collect();
            near(&placed.positions, &positions);
            let normals: Vec<Vec3> = plain.normals.iter().map(|n| affine.normal(n.as_dvec3())).collect();
            within(tolerance, &placed.normals, &normals);
        }
        // fronts stay fronts: the triangles of a mirrored part are turned round
        let corners = |moving: &MovingMesh| moving.rest().triangles[0];
        assert_ne!(corners(&plain), corners(&placed));
    }
}

#[test]
fn survey_coordinates_keep_their_digits_in_every_pose() {
    let far = |_: &mut Glb, mut document: Value| {
        document["nodes"][1]["translation"] = json!([476_000.25, 120.0, -4_202_000.5]);
        document
    };
    let placement = Placement { origin: [476_000.0, 120.0, -4_202_000.0], ..Placement::default() };
    let (moving, _) = read_with(&arm_with(float_weights, far), &ImportOptions { placement, ..ImportOptions::default() });
    near(&posed(&moving, 0, 2.0).positions[4..5], &[Vec3::new(0.75, 1.0, -0.5)]);
}

#[test]
fn hard_edges_move_with_what_they_were_split_from() {
    // without normals, folded along its middle, split there by a crease
    let folded = |glb: &mut Glb, mut document: Value| {
        let rows: Vec<[f32; 3]> = ARM.iter().map(|[x, y, _]| [*x, *y, if *x == 1.0 { 1.0 } else { 0.0 }]).collect();
        let position = glb.floats("VEC3", &rows);
        let attributes = &mut document["meshes"][0]["primitives"][0]["attributes"];
        attributes["POSITION"] = position.into();
        attributes.as_object_mut().unwrap().remove("NORMAL");
        document
    };
    let options = ImportOptions { crease_deg: Some(30.0), ..ImportOptions::default() };
    let (moving, _) = read_with(&arm_with(float_weights, folded), &options);
    assert_eq!(moving.rest().positions.len(), 8);
    let pose = posed(&moving, 0, 1.3);
    let split = |v: usize| {
        let rest = &moving.rest().positions;
        (0..6).find(|&own| rest[own] == rest[v]).unwrap()
    };
    for v in 6..8 {
        assert_eq!(pose.positions[v], pose.positions[split(v)]);
        assert!(pose.normals[v].dot(pose.normals[split(v)]) < 0.5);
    }
}

#[test]
fn what_of_an_animation_cannot_be_used_is_told() {
    let broken = |glb: &mut Glb, mut document: Value| {
        let nan = glb.scalars(&[0.0, f32::NAN]);
        let back = glb.scalars(&[1.0, 0.5]);
        let one = glb.scalars(&[0.0]);
        let animation = &mut document["animations"][0];
        let output = animation["samplers"][0]["output"].clone();
        for (k, input) in [nan, back, one].into_iter().enumerate() {
            animation["samplers"].as_array_mut().unwrap().push(json!({"input": input, "output": output}));
            animation["channels"]
                .as_array_mut()
                .unwrap()
                .push(json!({"sampler": k + 1, "target": {"node": 1, "path": "rotation"}}));
        }
        for target in [
            json!({"node": 9, "path": "rotation"}),
            json!({"node": 1, "path": "pointer"}),
            json!({"node": 1, "path": "weights"}),
            json!({"path": "rotation"}),
        ] {
            animation["channels"].as_array_mut().unwrap().push(json!({"sampler": 0, "target": target}));
        }
        animation["channels"].as_array_mut().unwrap().push(json!({"sampler": 5, "target": {"node": 1, "path": "scale"}}));
        let joints = glb.raw("VEC4", U8, false, 6, &[0, 1, 9, 0].repeat(6));
        let weights = glb.floats("VEC4", &[[0.0, 1.0, 1.0, 0.0]; 6]);
        let attributes = &mut document["meshes"][0]["primitives"][0]["attributes"];
        attributes["JOINTS_0"] = joints.into();
        attributes["WEIGHTS_0"] = weights.into();
        document
    };
    let (moving, report) = read_with(&arm_with(float_weights, broken), &ImportOptions::default());
    let told = [
        "channels[1] the time of its key 1 is NaN",
        "channels[2] the time of its key 1 is not later",
        "channels[3] its 1 keys ask for 4 numbers, but there are 8",
        "nodes[9] is named, but there are 3",
        "channels[5] drives \"pointer\"",
        "channels[6] drives the morph weights",
        "channels[8] names sampler 5",
        "6 weights are for joints beyond their skin",
    ];
    assert_eq!(report.warnings.len(), told.len(), "{:?}", report.warnings);
    for (warning, told) in report.warnings.iter().zip(told) {
        assert!(warning.contains(told), "{warning}");
    }
    near(&posed(&moving, 0, 2.0).positions[4..5], &[Vec3::new(0.5, 1.0, 0.0)]);
}

#[test]
fn broken_skins_are_refused() {
    let refused = |change: fn(&mut Value)| {
        let bytes = arm_with(float_weights, |_, mut document| {
            change(&mut document);
            document
        });
        let mut report = ImportReport::default();
        let options = ImportOptions::default();
        motion::from_bytes(&bytes, Format::Gltf, Path::new("test.glb"), &options, &mut report).unwrap_err().to_string()
    };
    for (change, told) in [
        ((|d| d["skins"][0]["joints"] = json!([1, 8])) as fn(&mut Value), "nodes[8]: is named, but there are 3"),
        (|d| d["skins"][0]["joints"] = json!([]), "skins[0]: has 0 joints"),
        (|d| d["skins"][0]["joints"] = json!([1, 2, 1]), "skins[0]: has 2 inverse bind matrices for 3 joints"),
        (|d| d["skins"] = json!([]), "skins[0]: is named, but there are 0"),
        (|d| d["nodes"][2]["children"] = json!([1]), "nodes[1]: is reached twice"),
        (
            |d| {
                d["nodes"].as_array_mut().unwrap().push(json!({"children": [4]}));
                d["nodes"].as_array_mut().unwrap().push(json!({"children": [3]}));
                d["skins"][0]["joints"] = json!([1, 4]);
            },
            "nodes[4]: hangs on itself",
        ),
        (|d| d["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(4), "accessors[4]: is of type SCALAR"),
    ] {
        let error = refused(change);
        assert!(error.contains(told), "{error}");
    }
}

#[test]
fn what_was_scaled_to_nothing_can_grow() {
    let growing = |glb: &mut Glb, mut document: Value| {
        let times = glb.scalars(&[0.0, 1.0]);
        let scale = glb.floats("VEC3", &[[0.0; 3], [1.0; 3]]);
        document["nodes"][0] = json!({"mesh": 0, "scale": [0.0, 0.0, 0.0]});
        document["animations"][0]["samplers"] = json!([{"input": times, "output": scale}]);
        document["animations"][0]["channels"] = json!([{"sampler": 0, "target": {"node": 0, "path": "scale"}}]);
        document
    };
    let moving = read(&arm_with(float_weights, growing));
    assert_eq!(moving.rest().positions, [Vec3::ZERO; 6]);
    near(&posed(&moving, 0, 1.0).positions, &ARM.map(Vec3::from));
    assert!(!moving.rigid(0));
}

#[test]
fn every_other_format_is_still() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let moving = motion::read_moving(&path, &ImportOptions::default(), &mut ImportReport::default()).unwrap();
    assert!(moving.clips().is_empty());
    near(&posed(&moving, 0, 1.0).positions, &moving.rest().positions);
    let path = folder.path().join("arm.glb");
    std::fs::write(&path, arm(float_weights)).unwrap();
    let moving = motion::read_moving(&path, &ImportOptions::default(), &mut ImportReport::default()).unwrap();
    assert_eq!(moving.clips().len(), 1);
    // the still import goes on to say what it does not do
    let mut report = ImportReport::default();
    import::read_reporting(&path, &ImportOptions::default(), &mut report).unwrap();
    assert!(report.warnings[0].contains("has skins, which are not applied"));
}

/// Positions by [`motion::rules`], as whoever poses a mesh elsewhere computes them.
fn by_rules(moving: &MovingMesh, palette: &motion::Palette) -> Vec<Vec3> {
    let rules = moving.rules();
    rules.validate().unwrap();
    let sizes = [palette.matrices.len(), palette.weights.len(), palette.moves.len()];
    assert_eq!(sizes, [rules.matrices, rules.weights, rules.renews.len()]);
    let place = |(v, rule): (usize, &motion::rules::VertexRule)| {
        if !rule.part.is_some_and(|part| palette.moves[part as usize]) {
            return moving.rest().positions[v];
        }
        if rules.cached {
            return palette.positions[v];
        }
        let deltas = &rules.deltas[rule.deltas.start as usize..rule.deltas.end as usize];
        let p = deltas.iter().fold(rule.position, |p, d| p + d.position * palette.weights[d.weight as usize]);
        let influences = &rules.influences[rule.influences.start as usize..rule.influences.end as usize];
        let through = |&(m, share): &(u32, f32)| glam::Mat4::from_cols_array_2d(&palette.matrices[m as usize]) * share;
        let sum = influences.iter().map(through).fold(glam::Mat4::ZERO, |sum, m| sum + m);
        sum.transform_point3(p)
    };
    rules.vertices.iter().enumerate().map(place).collect()
}

#[test]
fn rules_and_palettes_say_what_poses_do() {
    for bytes in [arm(float_weights), objects(), morphing(true), morphing(false)] {
        let moving = read(&bytes);
        let mut palette = motion::Palette::default();
        for clip in 0..=moving.clips().len() {
            for time_s in [0.0, 0.3, 0.9, 5.0] {
                moving.palette(clip, time_s, &mut palette);
                within(2e-6, &by_rules(&moving, &palette), &posed(&moving, clip, time_s).positions);
            }
        }
        let renews = moving.rules().renews.contains(&true);
        assert_eq!(renews, bytes == morphing(false), "normals are computed only where nothing says them");
    }
    let (still, mut palette) = (MovingMesh::still(read(&objects()).rest().clone()), motion::Palette::default());
    still.palette(0, 1.0, &mut palette);
    assert_eq!(by_rules(&still, &palette), still.rest().positions);
}
