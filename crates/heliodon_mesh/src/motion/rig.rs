//! Nodes, skins and morph targets, and the pose that they make at a time.
//!
//! Nodes are composed in `f64`, with the placement as the root's parent, so that a pose is placed as the rest mesh is. Vertices that hang
//! on a node are placed in `f64` too, and give the importer's own bits; skinned ones are blended in `f32`, four numbers at a time (8,325
//! vertices with four joints each in 0.2 ms), about their middle, which keeps survey coordinates' digits.

use super::Pose;
use super::part::{Drive, Part};
use super::renewal::Renewal;
use super::rigid::{Rigid, rigid};
use super::track::Track;
use crate::Mesh;
use crate::import::Imported;
use crate::place::Affine;
use glam::{DMat3, DQuat, DVec3, DVec4, Vec3, Vec3A};
use std::sync::Arc;

/// Translation, rotation and scale of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Trs {
    pub translation: DVec3,
    pub rotation: DQuat,
    pub scale: DVec3,
}

impl Trs {
    /// Scaled, then turned, then shifted.
    pub fn affine(&self) -> Affine {
        Affine::new(DMat3::from_quat(self.rotation) * DMat3::from_diagonal(self.scale), self.translation)
    }
}

/// The rotation that four numbers mean; none where they have no direction.
pub(crate) fn unit_quaternion([x, y, z, w]: [f64; 4]) -> DQuat {
    DVec4::new(x, y, z, w).try_normalize().map_or(DQuat::IDENTITY, DQuat::from_vec4)
}

#[derive(Clone, Debug)]
pub(crate) struct RigNode {
    /// Stands before its children.
    pub parent: Option<usize>,
    pub trs: Trs,
    /// Instead of `trs`; such a node cannot be animated.
    pub matrix: Option<Affine>,
}

impl RigNode {
    pub fn local(&self, trs: &Trs) -> Affine {
        self.matrix.unwrap_or_else(|| trs.affine())
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Skin {
    /// Nodes.
    pub joints: Vec<usize>,
    /// For each joint, `joint_from_mesh` as it was when the mesh was bound.
    pub binds: Vec<Affine>,
    /// The middle of its vertices in mesh space; they are stored relative to it.
    pub centre: DVec3,
}

/// What a track drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    Translation(usize),
    Rotation(usize),
    Scale(usize),
    /// Morph weights, so many from this one on.
    Weights(usize, usize),
}

impl Target {
    pub fn node(self) -> Option<usize> {
        match self {
            Self::Translation(node) | Self::Rotation(node) | Self::Scale(node) => Some(node),
            Self::Weights(..) => None,
        }
    }
}

#[derive(Clone, Debug)]
pub(crate) struct RigClip {
    pub name: String,
    pub duration_s: f32,
    pub channels: Vec<(Target, Arc<Track>)>,
    /// For each part whether the clip moves it; filled by [`Rig::settle`].
    pub moves: Vec<bool>,
    pub rigid: Rigid,
}

/// What moves a mesh.
#[derive(Clone, Debug)]
pub(crate) struct Rig {
    pub site_from_scene: Affine,
    /// Parents before children.
    pub nodes: Vec<RigNode>,
    pub skins: Vec<Skin>,
    /// Morph weights of all nodes with targets, one node's after the other's.
    pub weights: Vec<f64>,
    /// In the order of their vertices.
    pub parts: Vec<Part>,
    pub clips: Vec<RigClip>,
    /// Where morphing changes normals in a way that the file does not say.
    pub renewal: Option<Renewal>,
}

/// A joint's `site_from_mesh`, from relative to the skin's centre.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointMatrix {
    pub columns: [Vec3A; 4],
}

/// What a pose needs on its way; kept so that the next pose allocates nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scratch {
    trs: Vec<Trs>,
    globals: Vec<Affine>,
    weights: Vec<f64>,
    pub joints: Vec<JointMatrix>,
    pub morphed: [Vec<Vec3>; 2],
    pub renewed: Vec<Vec3>,
}

impl Scratch {
    /// The morph weights that were sampled last.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The node's `site_from_node` that was sampled last.
    pub fn global(&self, node: usize) -> Affine {
        self.globals[node]
    }
}

impl Rig {
    /// The values of the nodes and weights at a time of a clip, and where the nodes are by them.
    pub(super) fn sample(&self, clip: Option<&RigClip>, time_s: f32, scratch: &mut Scratch) {
        let Scratch { trs, weights, globals, .. } = scratch;
        trs.clear();
        trs.extend(self.nodes.iter().map(|node| node.trs));
        weights.clear();
        weights.extend_from_slice(&self.weights);
        for (target, track) in clip.iter().flat_map(|clip| &clip.channels) {
            match *target {
                Target::Weights(first, count) => track.sample(time_s, &mut weights[first..first + count]),
                target => drive(target, track, time_s, trs),
            }
        }
        globals.clear();
        for (node, trs) in self.nodes.iter().zip(&*trs) {
            let parent = node.parent.map_or(self.site_from_scene, |parent| globals[parent]);
            globals.push(parent.after(&node.local(trs)));
        }
    }

    /// The node's `site_from_node` at each of the times.
    pub fn node_at_times(&self, node: usize, clip: &RigClip, times_s: impl Iterator<Item = f32>) -> Vec<Affine> {
        let mut scratch = Scratch::default();
        let at = |time_s| {
            self.sample(Some(clip), time_s, &mut scratch);
            scratch.globals[node]
        };
        times_s.map(at).collect()
    }

    /// The node's `site_from_node` at a time of a clip, or by default.
    pub fn node_at(&self, node: usize, clip: Option<&RigClip>, time_s: f32) -> Affine {
        let mut site_from_node = Affine::IDENTITY;
        let mut next = Some(node);
        while let Some(node) = next {
            let mut trs = self.nodes[node].trs;
            let channels = clip.iter().flat_map(|clip| &clip.channels);
            for (target, track) in channels.filter(|(target, _)| target.node() == Some(node)) {
                drive_one(*target, track, time_s, &mut trs);
            }
            site_from_node = self.nodes[node].local(&trs).after(&site_from_node);
            next = self.nodes[node].parent;
        }
        self.site_from_scene.after(&site_from_node)
    }

    /// Fills the pose; parts that do not move take their rest. Without a clip those that need settling stand by default.
    pub fn pose(&self, clip: Option<&RigClip>, time_s: f32, rest: &Mesh, pose: &mut Pose) {
        let Pose { positions, normals, scratch } = pose;
        positions.clone_from(&rest.positions);
        normals.clone_from(&rest.normals);
        let moves = |k: usize| match clip {
            Some(clip) => clip.moves[k],
            None => self.parts[k].settles,
        };
        self.sample(clip, time_s, scratch);
        let mut renews = false;
        let mut at_hand = None;
        for (k, part) in self.parts.iter().enumerate().filter(|(k, _)| moves(*k)) {
            let site_from_mesh = match part.drive {
                Drive::Scene => self.site_from_scene,
                Drive::Node(node) => scratch.globals[node],
                Drive::Skin(skin, _) => {
                    if at_hand != Some(skin) {
                        self.joint_matrices(skin, scratch);
                        at_hand = Some(skin);
                    }
                    Affine::IDENTITY
                }
            };
            let [base, base_normals] = &mut scratch.morphed;
            let (base, base_normals) = part.morphed(&scratch.weights, base, base_normals);
            match &part.drive {
                Drive::Skin(_, influences) => {
                    part.blend(base, base_normals, influences, &scratch.joints, positions, normals);
                }
                _ => part.carry(base, base_normals, &site_from_mesh, positions, normals),
            }
            renews |= self.parts[k].renews();
        }
        if let Some(renewal) = self.renewal.as_ref().filter(|_| renews) {
            renewal.renew(rest, positions, &mut scratch.renewed);
            for part in self.parts.iter().enumerate().filter(|(k, part)| moves(*k) && part.renews()).map(|(_, part)| part) {
                (0..part.len()).map(|i| part.vertex(i)).for_each(|v| normals[v] = scratch.renewed[v]);
            }
        }
    }

    pub(super) fn joint_matrices(&self, skin: usize, scratch: &mut Scratch) {
        let Skin { joints, binds, centre } = &self.skins[skin];
        scratch.joints.clear();
        scratch.joints.extend(
            joints.iter().zip(binds).map(|(&joint, bind)| JointMatrix::of(&scratch.globals[joint].after(bind), *centre)),
        );
    }

    /// Binds the rig to the mesh that the importer made of the same vertices, and puts that into the default pose; no rig where
    /// nothing moves it.
    pub fn settle(mut self, imported: Imported) -> (Mesh, Option<Self>) {
        let Imported { mut mesh, appended } = imported;
        let own = mesh.positions.len() - appended.len();
        for (k, &repeated) in appended.iter().enumerate() {
            let part = self.parts.partition_point(|part| part.first <= repeated as usize).saturating_sub(1);
            if let Some(part) = self.parts.get_mut(part) {
                part.repeat(repeated as usize - part.first, (own + k) as u32);
            }
        }
        for part in &mut self.parts {
            part.take_normals(&mesh);
        }
        self.centre_skins();
        if self.parts.iter().any(Part::renews) {
            let together = |a: usize, b: usize| self.driver(a) == self.driver(b);
            self.renewal = Some(Renewal::new(&mesh, together));
        }
        if self.parts.iter().any(|part| part.settles) {
            let mut pose = Pose::default();
            self.pose(None, 0.0, &mesh, &mut pose);
            mesh.positions = pose.positions;
            mesh.normals = pose.normals;
        }
        for k in 0..self.clips.len() {
            let moves = self.moved_parts(&self.clips[k]);
            self.clips[k].moves = moves;
            self.clips[k].rigid = rigid(&self, &self.clips[k]);
        }
        let moving = !self.clips.is_empty();
        (mesh, Some(self).filter(|_| moving))
    }

    /// What a vertex hangs on: none, a node, or a skin.
    fn driver(&self, vertex: usize) -> [Option<usize>; 2] {
        let own = |part: &Part| (part.first..part.first + part.own_count()).contains(&vertex);
        let at = self.parts.partition_point(|part| part.first <= vertex).saturating_sub(1);
        let repeats = |part: &&Part| part.extra.binary_search(&(vertex as u32)).is_ok();
        let part = self.parts.get(at).filter(|part| own(part)).or_else(|| self.parts.iter().find(repeats));
        match part.map(|part| &part.drive) {
            Some(Drive::Node(node)) => [Some(*node), None],
            Some(Drive::Skin(skin, _)) => [None, Some(*skin)],
            Some(Drive::Scene) | None => [None, None],
        }
    }

    fn centre_skins(&mut self) {
        for (k, skin) in self.skins.iter_mut().enumerate() {
            let of_skin = |part: &&mut Part| matches!(part.drive, Drive::Skin(of, _) if of == k);
            let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            for p in self.parts.iter_mut().filter(of_skin).flat_map(|part| &part.base) {
                (low, high) = (low.min(*p), high.max(*p));
            }
            if low.cmple(high).all() {
                skin.centre = (low.as_dvec3() + high.as_dvec3()) * 0.5;
            }
            for p in self.parts.iter_mut().filter(of_skin).flat_map(|part| &mut part.base) {
                *p = (p.as_dvec3() - skin.centre).as_vec3();
            }
        }
    }

    /// For each node whether the clip moves it, itself or by an ancestor.
    pub fn moved_nodes(&self, clip: &RigClip) -> Vec<bool> {
        let mut moved = vec![false; self.nodes.len()];
        for node in clip.channels.iter().filter_map(|(target, _)| target.node()) {
            moved[node] = true;
        }
        for (k, node) in self.nodes.iter().enumerate() {
            moved[k] |= node.parent.is_some_and(|parent| moved[parent]);
        }
        moved
    }

    fn moved_parts(&self, clip: &RigClip) -> Vec<bool> {
        let moved = self.moved_nodes(clip);
        let skins: Vec<bool> = self.skins.iter().map(|skin| skin.joints.iter().any(|&joint| moved[joint])).collect();
        let mut weighted = vec![false; self.weights.len()];
        for (target, _) in &clip.channels {
            if let Target::Weights(first, count) = *target {
                weighted[first..first + count].fill(true);
            }
        }
        let driven = |part: &Part| match part.drive {
            Drive::Scene => false,
            Drive::Node(node) => moved[node],
            Drive::Skin(skin, _) => skins[skin],
        };
        self.parts.iter().map(|part| driven(part) || part.morphs_by(&weighted)).collect()
    }
}

fn drive(target: Target, track: &Track, time_s: f32, trs: &mut [Trs]) {
    if let Some(trs) = target.node().and_then(|node| trs.get_mut(node)) {
        drive_one(target, track, time_s, trs);
    }
}

fn drive_one(target: Target, track: &Track, time_s: f32, trs: &mut Trs) {
    let mut value = [0.0; 4];
    track.sample(time_s, &mut value);
    let [x, y, z, _] = value;
    match target {
        Target::Translation(_) => trs.translation = DVec3::new(x, y, z),
        Target::Rotation(_) => trs.rotation = unit_quaternion(value),
        Target::Scale(_) => trs.scale = DVec3::new(x, y, z),
        Target::Weights(..) => {}
    }
}
