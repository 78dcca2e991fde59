use super::rig::{Limb, Side};
use super::*;
use crate::figures::shape::is_closed;
use crate::figures::tests::{assert_loops, glb_bytes};

/// Vertices of the figure at a time of a clip, as a viewer skins them.
fn skinned(scene: &Scene, clip: &Clip, time_s: f32) -> Vec<Vec3> {
    let mut nodes = scene.nodes.clone();
    for channel in &clip.channels {
        let after = channel.times_s.partition_point(|&t| t <= time_s).clamp(1, channel.times_s.len() - 1);
        let (t0, t1) = (channel.times_s[after - 1], channel.times_s[after]);
        let x = (time_s - t0) / (t1 - t0);
        match &channel.track {
            Track::Translation(keys) => nodes[channel.node].translation = keys[after - 1].lerp(keys[after], x),
            Track::Rotation(keys) => nodes[channel.node].rotation = keys[after - 1].slerp(keys[after], x),
            _ => panic!("a walker's joints move and turn only"),
        }
    }
    let mut world = vec![Mat4::IDENTITY; nodes.len()];
    // parents stand before their children
    for i in 0..nodes.len() {
        world[i] *= Mat4::from_scale_rotation_translation(nodes[i].scale, nodes[i].rotation, nodes[i].translation);
        for &child in &nodes[i].children {
            world[child] = world[i];
        }
    }
    let skin = &scene.skins[0];
    let joints: Vec<Mat4> = skin.joints.iter().zip(&skin.inverse_bind).map(|(&node, inverse)| world[node] * *inverse).collect();
    let part = &scene.meshes[0];
    let places = part.mesh.positions.iter().zip(&part.joints).zip(&part.weights);
    places.map(|((&p, j), w)| (0..4).map(|i| joints[usize::from(j[i])].transform_point3(p) * w[i]).sum()).collect()
}

#[test]
fn the_skeleton_is_of_closed_bones_of_a_grown_up() {
    let scene = walker();
    scene.validate().unwrap();
    let mesh = &scene.meshes[0].mesh;
    assert!((8159..=8491).contains(&mesh.positions.len()), "{}", mesh.positions.len());
    assert!(is_closed(&mesh.triangles));
    let (low, high) = mesh.bounds().unwrap();
    assert!(low.y.abs() < 3e-3 && (high.y - 1.75).abs() < 1e-3, "{low} {high}");
    assert!((low.x + high.x).abs() < 1e-5 && high.z > -low.z, "it is even, and its toes point to +Z");
    assert_eq!(glb_bytes(&scene), glb_bytes(&walker()));
}

#[test]
fn clips_loop_and_leave_no_joint_out() {
    let scene = walker();
    assert_loops(&scene);
    let lengths: Vec<_> =
        scene.clips.iter().map(|c| (c.name.as_str(), c.channels[0].times_s.last().copied().unwrap())).collect();
    assert_eq!(lengths, [("walk", WALK_LOOP_S), ("idle", IDLE_LOOP_S)]);
    // the same joints in both, so that one clip leaves nothing of the other behind
    let moved = |clip: &Clip| clip.channels.iter().map(|c| c.node).collect::<Vec<_>>();
    assert_eq!(moved(&scene.clips[0]), moved(&scene.clips[1]));
    // no vertex leaps from one key to the next, nor over the seam
    for clip in &scene.clips {
        let times = &clip.channels[0].times_s;
        let poses: Vec<_> = times.iter().map(|&t| skinned(&scene, clip, t)).collect();
        for pair in poses.windows(2) {
            let leap = pair[0].iter().zip(&pair[1]).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
            assert!(leap < 0.12, "{}: {leap}", clip.name);
        }
    }
}

#[test]
fn feet_neither_sink_nor_slide() {
    const TICKS: usize = 220;
    let scene = walker();
    let feet: Vec<u8> = Side::BOTH
        .into_iter()
        .flat_map(|side| [rig::limb(side, Limb::Foot) as u8, rig::limb(side, Limb::Toes) as u8])
        .collect();
    let of_foot: Vec<usize> =
        (0..scene.meshes[0].joints.len()).filter(|&i| feet.contains(&scene.meshes[0].joints[i][0])).collect();
    for (clip, speed) in scene.clips.iter().zip([WALK_SPEED_M_S, 0.0]) {
        let length = clip.channels[0].times_s.last().copied().unwrap();
        let mut deepest = f32::MAX;
        let mut farthest = 0.0_f32;
        let mut lifted = 0;
        // where each vertex touched the ground, in the space in which the ground stands
        let mut touched: Vec<Option<(Vec3, Vec3)>> = vec![None; of_foot.len()];
        for tick in 0..2 * TICKS {
            let time = length * tick as f32 / TICKS as f32;
            let places = skinned(&scene, clip, length * (tick % TICKS) as f32 / TICKS as f32);
            deepest = places.iter().map(|p| p.y).fold(deepest, f32::min);
            lifted += usize::from(!of_foot.iter().any(|&i| places[i].y < 0.006));
            for (slot, &i) in touched.iter_mut().zip(&of_foot) {
                let p = (places[i] + Vec3::Z * (speed * time)) * Vec3::new(1.0, 0.0, 1.0);
                if places[i].y < 0.004 {
                    let (low, high) = slot.map_or((p, p), |(low, high)| (low.min(p), high.max(p)));
                    farthest = farthest.max(low.distance(high));
                    *slot = Some((low, high));
                } else {
                    *slot = None;
                }
            }
        }
        println!("{}: lowest {deepest} m, slides {farthest} m", clip.name);
        assert!(deepest > -0.01, "{}: {deepest}", clip.name);
        assert!(farthest < 0.02, "{}: {farthest}", clip.name);
        assert_eq!(lifted, 0, "{}: a walker is never without a foot on the ground", clip.name);
    }
}
