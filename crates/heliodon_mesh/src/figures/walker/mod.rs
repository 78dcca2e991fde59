//! A skeleton that walks: some two hundred bones of which each shades others, the kind of figure on which light that is
//! computed anew for every frame shows what it can do.
//!
//! It walks in place. Whoever moves its root along +Z by [`WALK_SPEED_M_S`] sees its feet stand still while they are down.

mod bones;
pub(super) mod follows;
pub(super) mod gait;
pub(super) mod rig;
mod skull;
#[cfg(test)]
mod tests;

use crate::export::scene::{Channel, Clip, Interpolation, Node, Scene, SceneMesh, Skin, Track};
use glam::{DVec3, Mat4, Vec3};
use rig::{COUNT, Core, Pose};

/// How fast the clip "walk" walks, metres a second along +Z.
pub const WALK_SPEED_M_S: f32 = 1.25;
/// How long two steps take, seconds: the length of the clip "walk".
pub const WALK_LOOP_S: f32 = 1.1;
/// The length of the clip "idle", seconds.
pub const IDLE_LOOP_S: f32 = 4.0;
/// Keys of the walk, the last the same as the first: 40 a second hold the feet within a millimetre of their way.
const WALK_KEYS: usize = 45;
const IDLE_KEYS: usize = 41;

/// Makes the figure: one mesh of about 8,325 vertices with a skin of 30 joints, feet on y = 0, 1.75 m high, facing +Z; the clips
/// "walk" and "idle" loop, their last key the same as the first.
#[must_use]
pub fn walker() -> Scene {
    let rest = rig::rest();
    let clips =
        vec![clip("walk", WALK_LOOP_S, WALK_KEYS, &rest, gait::walk), clip("idle", IDLE_LOOP_S, IDLE_KEYS, &rest, gait::idle)];
    figure("skeleton", bones::skeleton(), clips)
}

/// A mesh on the joints.
pub(super) fn figure(name: &str, mesh: SceneMesh, clips: Vec<Clip>) -> Scene {
    let rest = rig::rest();
    let mut nodes: Vec<Node> = rest
        .iter()
        .map(|joint| {
            Node::at(
                joint.name.clone(),
                (joint.place - joint.parent.map_or(DVec3::ZERO, |parent| rest[parent].place)).as_vec3(),
            )
        })
        .collect();
    for (index, joint) in rest.iter().enumerate() {
        if let Some(parent) = joint.parent {
            nodes[parent].children.push(index);
        }
    }
    nodes.push(Node { mesh: Some(0), skin: Some(0), ..Node::at(name, Vec3::ZERO) });
    let skin = Skin {
        joints: (0..COUNT).collect(),
        inverse_bind: rest.iter().map(|joint| Mat4::from_translation(-joint.place.as_vec3())).collect(),
    };
    Scene { nodes, meshes: vec![mesh], skins: vec![skin], clips }
}

/// A clip that loops: a pose for each share of it, in [0, 1).
pub(super) fn clip(
    name: &str,
    length_s: f32,
    keys: usize,
    rest: &[rig::Rest],
    pose: impl Fn(&[rig::Rest], f64) -> Pose,
) -> Clip {
    let last = keys - 1;
    let mut poses: Vec<Pose> = (0..last).map(|i| pose(rest, i as f64 / last as f64)).collect();
    poses.push(poses[0].clone());
    keyed(name, length_s, rest, &poses)
}

/// A clip of poses that are evenly spread over it.
pub(super) fn keyed(name: &str, length_s: f32, rest: &[rig::Rest], poses: &[Pose]) -> Clip {
    let (keys, last) = (poses.len(), poses.len() - 1);
    let times_s: Vec<f32> = (0..keys).map(|i| length_s * i as f32 / last as f32).collect();
    let pelvis = rig::core(Core::Pelvis);
    let from_root = rest[pelvis].place;
    let channel = |node, track| Channel { node, times_s: times_s.clone(), track, interpolation: Interpolation::Linear };
    let mut channels =
        vec![channel(pelvis, Track::Translation(poses.iter().map(|pose| (from_root + pose.pelvis).as_vec3()).collect()))];
    // all joints but the root, which is the viewer's to move: so no clip leaves behind what another has turned
    channels.extend(
        (pelvis..COUNT)
            .map(|joint| channel(joint, Track::Rotation(poses.iter().map(|pose| pose.turns[joint].as_quat()).collect()))),
    );
    Clip { name: name.to_owned(), channels }
}
