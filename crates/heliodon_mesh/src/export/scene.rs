//! Objects that move, as glTF knows them: nodes, meshes with skins and morph targets, clips.

use crate::{Mesh, MeshError};
use glam::{Mat4, Quat, Vec3, Vec4};

/// Nodes, what hangs on them, and how they move. Metres, +Y up; a figure faces +Z.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// All nodes; those that no other names as its child stand in the scene itself.
    pub nodes: Vec<Node>,
    /// The meshes that nodes name.
    pub meshes: Vec<SceneMesh>,
    /// The skins that nodes name.
    pub skins: Vec<Skin>,
    /// Motions, each by itself.
    pub clips: Vec<Clip>,
}

/// A place that its parent carries along; it scales, then turns, then moves.
#[derive(Clone, Debug)]
pub struct Node {
    /// A name, unique where a clip's user looks for it.
    pub name: String,
    /// Where it stands in its parent, metres.
    pub translation: Vec3,
    /// How it is turned, unit.
    pub rotation: Quat,
    /// Its scale along its own axes.
    pub scale: Vec3,
    /// Nodes that it carries; no node has two parents.
    pub children: Vec<usize>,
    /// Index of its mesh.
    pub mesh: Option<usize>,
    /// Index of the skin that moves its mesh; none without a mesh.
    pub skin: Option<usize>,
}

impl Node {
    /// A node that is neither turned nor scaled.
    #[must_use]
    pub fn at(name: impl Into<String>, translation: Vec3) -> Self {
        Self {
            name: name.into(),
            translation,
            rotation: Quat::IDENTITY,
            scale: Vec3::ONE,
            children: Vec::new(),
            mesh: None,
            skin: None,
        }
    }
}

/// A mesh with what moves its vertices. Its textures are not written, and it has one material at most.
#[derive(Clone, Debug, Default)]
pub struct SceneMesh {
    /// A name.
    pub name: String,
    /// Its shape at rest.
    pub mesh: Mesh,
    /// For each vertex the four joints, as indices into the skin's; empty without a skin.
    pub joints: Vec<[u8; 4]>,
    /// For each vertex their weights, not negative, of sum 1; empty without a skin.
    pub weights: Vec<[f32; 4]>,
    /// Shapes that clips mix in.
    pub targets: Vec<MorphTarget>,
}

/// A shape that is mixed in: `position + weight * offset`.
#[derive(Clone, Debug)]
pub struct MorphTarget {
    /// A name.
    pub name: String,
    /// For each vertex how far it moves, metres.
    pub offsets: Vec<Vec3>,
}

/// Joints that vertices follow.
#[derive(Clone, Debug)]
pub struct Skin {
    /// Nodes, at most 256.
    pub joints: Vec<usize>,
    /// For each joint `joint_from_mesh` at rest; finite and affine.
    pub inverse_bind: Vec<Mat4>,
}

/// A motion.
#[derive(Clone, Debug)]
pub struct Clip {
    /// A name.
    pub name: String,
    /// What moves, at least one, each property of a node at most once.
    pub channels: Vec<Channel>,
}

/// How one property of one node moves.
#[derive(Clone, Debug)]
pub struct Channel {
    /// The node.
    pub node: usize,
    /// When its keys are, seconds, rising from 0 or later.
    pub times_s: Vec<f32>,
    /// The keys.
    pub track: Track,
    /// What is between them.
    pub interpolation: Interpolation,
}

/// The keys of a channel: as many as times, three times as many with [`Interpolation::CubicSpline`].
#[derive(Clone, Debug)]
pub enum Track {
    /// [`Node::translation`].
    Translation(Vec<Vec3>),
    /// [`Node::rotation`]; of a spline the values are unit, the tangents need not be.
    Rotation(Vec<Quat>),
    /// [`Node::scale`].
    Scale(Vec<Vec3>),
    /// Weights of the mesh's targets, all of a key in a row.
    Weights(Vec<f32>),
}

impl Track {
    /// Whether it has so many keys for a mesh of so many targets.
    fn has_keys(&self, keys: usize, targets: usize) -> bool {
        match self {
            Self::Translation(own) | Self::Scale(own) => own.len() == keys,
            Self::Rotation(own) => own.len() == keys,
            Self::Weights(own) => targets > 0 && own.len() == keys * targets,
        }
    }

    /// Whether rotations are turns, and nothing else; tangents, which are two of `each` three, need not be.
    fn is_unit(&self, each: usize) -> bool {
        let Self::Rotation(keys) = self else { return true };
        keys.iter().skip(each / 2).step_by(each).all(|key| (key.length() - 1.0).abs() < UNIT_TOLERANCE)
    }

    fn is_finite(&self) -> bool {
        match self {
            Self::Translation(keys) | Self::Scale(keys) => keys.iter().all(|key| key.is_finite()),
            Self::Rotation(keys) => keys.iter().all(|key| key.is_finite()),
            Self::Weights(keys) => keys.iter().all(|key| key.is_finite()),
        }
    }
}

/// What is between two keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// The straight line, or the shortest turn.
    Linear,
    /// The key before.
    Step,
    /// Hermite's curve; each key is a tangent that leads in, the value, and a tangent that leads out, per second.
    CubicSpline,
}

/// A scene whose parts contradict one another.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// A mesh of its own.
    #[error("mesh {name}: {fault}")]
    Mesh {
        /// Which.
        name: String,
        /// What is wrong.
        fault: MeshError,
    },
    /// Anything else.
    #[error("{kind} {index}: {fault}")]
    Part {
        /// Of what kind.
        kind: &'static str,
        /// Which.
        index: usize,
        /// What is wrong.
        fault: &'static str,
    },
}

/// How far weights of a vertex may be from 1 in sum: four of them rounded to 2^-24, and three sums.
const WEIGHTS_TOLERANCE: f32 = 4.0e-7;
/// How far a stored turn's length may be from 1; products of some ten unit quaternions stay below.
const UNIT_TOLERANCE: f32 = 1.0e-5;

impl Scene {
    /// One mesh that stands still.
    #[must_use]
    pub fn of_mesh(name: &str, mesh: Mesh) -> Self {
        let part = SceneMesh { name: name.to_owned(), mesh, joints: Vec::new(), weights: Vec::new(), targets: Vec::new() };
        let node = Node { mesh: Some(0), ..Node::at(name, Vec3::ZERO) };
        Self { nodes: vec![node], meshes: vec![part], skins: Vec::new(), clips: Vec::new() }
    }

    /// Checks every promise that the fields' documentation makes.
    ///
    /// # Errors
    /// The first promise that is broken.
    pub fn validate(&self) -> Result<(), SceneError> {
        // a GLB file has a node and some data, or it is none
        part("node")(0, !self.nodes.is_empty() && !self.meshes.is_empty(), "is missing, or there is no mesh to hang on it")?;
        self.validate_nodes()?;
        self.meshes.iter().enumerate().try_for_each(|(index, mesh)| validate_mesh(index, mesh))?;
        let ensure = part("skin");
        for (index, skin) in self.skins.iter().enumerate() {
            ensure(index, skin.joints.iter().all(|&node| node < self.nodes.len()), "names a node that does not exist")?;
            ensure(index, (1..=256).contains(&skin.joints.len()), "has not 1 to 256 joints")?;
            ensure(index, skin.joints.len() == skin.inverse_bind.len(), "has not as many matrices as joints")?;
            let affine = |m: &Mat4| m.is_finite() && m.row(3) == Vec4::W;
            ensure(index, skin.inverse_bind.iter().all(affine), "has a matrix that is not finite or not affine")?;
        }
        for (index, clip) in self.clips.iter().enumerate() {
            part("clip")(index, !clip.channels.is_empty(), "moves nothing")?;
            clip.channels.iter().enumerate().try_for_each(|(index, channel)| self.validate_channel(index, channel))?;
            let key = |c: &Channel| (c.node, std::mem::discriminant(&c.track));
            let twice = clip.channels.iter().enumerate().find(|(i, c)| clip.channels[..*i].iter().any(|d| key(d) == key(c)));
            part("channel")(twice.map_or(0, |(i, _)| i), twice.is_none(), "moves what another of its clip moves")?;
        }
        Ok(())
    }

    fn validate_nodes(&self) -> Result<(), SceneError> {
        let ensure = part("node");
        let mut parent = vec![None; self.nodes.len()];
        for (index, node) in self.nodes.iter().enumerate() {
            let placed = node.translation.is_finite() && node.scale.is_finite();
            ensure(index, placed && (node.rotation.length() - 1.0).abs() < UNIT_TOLERANCE, "has no proper place")?;
            ensure(index, node.mesh.is_none_or(|mesh| mesh < self.meshes.len()), "names a mesh that does not exist")?;
            ensure(index, node.skin.is_none_or(|skin| skin < self.skins.len()), "names a skin that does not exist")?;
            ensure(index, node.mesh.is_some() || node.skin.is_none(), "has a skin without a mesh")?;
            if let (Some(mesh), Some(skin)) = (node.mesh, node.skin) {
                let joints = self.skins[skin].joints.len();
                let mesh = &self.meshes[mesh];
                ensure(index, !mesh.joints.is_empty(), "has a skin for a mesh without weights")?;
                let known = mesh.joints.iter().flatten().all(|&joint| usize::from(joint) < joints);
                ensure(index, known, "has a mesh that names a joint which its skin has not")?;
            }
            for &child in &node.children {
                ensure(
                    index,
                    child < self.nodes.len() && parent[child].is_none(),
                    "carries a node that is not, or is carried already",
                )?;
                parent[child] = Some(index);
            }
        }
        // whoever has more ancestors than there are nodes is his own
        for index in 0..self.nodes.len() {
            let depth = std::iter::successors(parent[index], |&up| parent[up]).take(self.nodes.len()).count();
            ensure(index, depth < self.nodes.len(), "carries itself")?;
        }
        Ok(())
    }

    fn validate_channel(&self, index: usize, channel: &Channel) -> Result<(), SceneError> {
        let ensure = part("channel");
        ensure(index, channel.node < self.nodes.len(), "names a node that does not exist")?;
        let targets = self.nodes[channel.node].mesh.map_or(0, |mesh| self.meshes[mesh].targets.len());
        let each = if channel.interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        let times = &channel.times_s;
        ensure(
            index,
            !times.is_empty() && channel.track.has_keys(each * times.len(), targets),
            "has not as many keys as times",
        )?;
        let rising = times[0] >= 0.0 && times.windows(2).all(|pair| pair[0] < pair[1]) && times.iter().all(|t| t.is_finite());
        ensure(index, rising, "has times that do not rise from 0 on")?;
        ensure(index, channel.track.is_finite(), "has a key that is not finite")?;
        ensure(index, channel.track.is_unit(each), "has a rotation that is not unit")
    }
}

fn part(kind: &'static str) -> impl Fn(usize, bool, &'static str) -> Result<(), SceneError> {
    move |index, good, fault| if good { Ok(()) } else { Err(SceneError::Part { kind, index, fault }) }
}

fn validate_mesh(index: usize, part_mesh: &SceneMesh) -> Result<(), SceneError> {
    let SceneMesh { name, mesh, joints, weights, targets } = part_mesh;
    mesh.validate().map_err(|fault| SceneError::Mesh { name: name.clone(), fault })?;
    let ensure = part("mesh");
    let vertices = mesh.positions.len();
    ensure(index, vertices > 0 && !mesh.triangles.is_empty(), "has no triangles")?;
    ensure(index, mesh.materials.len() <= 1, "has more than one material")?;
    ensure(index, joints.len() == weights.len() && [0, vertices].contains(&joints.len()), "has not a weight for each vertex")?;
    let good = |w: &[f32; 4]| w.iter().all(|&w| w >= 0.0) && (w.iter().sum::<f32>() - 1.0).abs() < WEIGHTS_TOLERANCE;
    ensure(index, weights.iter().all(good), "has weights that are negative or whose sum is not 1")?;
    let complete = |target: &MorphTarget| target.offsets.len() == vertices && target.offsets.iter().all(|d| d.is_finite());
    ensure(index, targets.iter().all(complete), "has a target without a finite offset for each vertex")
}
