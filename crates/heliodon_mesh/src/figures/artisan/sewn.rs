//! A figure while it is put together: closed pieces, each vertex with its colour and what it follows.

use crate::export::scene::SceneMesh;
use crate::figures::shape::{Shape, smoothstep};
use crate::figures::walker::follows::four;
use crate::figures::walker::rig::{Core, Limb, Side, core, limb};
use crate::{Material, Mesh, normals};
use glam::Vec3;

/// Shares of joints.
pub type Shares = Vec<(usize, f32)>;

/// The pieces so far.
#[derive(Default)]
pub struct Sewn {
    mesh: Mesh,
    joints: Vec<[u8; 4]>,
    weights: Vec<[f32; 4]>,
}

impl Sewn {
    /// Adds a piece.
    pub fn add(&mut self, shape: &Shape, color_linear: impl Fn(Vec3) -> Vec3, follows: impl Fn(Vec3) -> Shares) {
        let colors: Vec<Vec3> = shape.positions.iter().map(|p| color_linear(*p)).collect();
        self.add_colored(shape, &colors, follows);
    }

    /// Adds a piece that has a colour for each vertex.
    pub fn add_colored(&mut self, shape: &Shape, colors_linear: &[Vec3], follows: impl Fn(Vec3) -> Shares) {
        let base = self.mesh.positions.len() as u32;
        self.mesh.positions.extend_from_slice(&shape.positions);
        self.mesh.triangles.extend(shape.triangles.iter().map(|t| t.map(|i| i + base)));
        self.mesh.colors_linear.extend(colors_linear.iter().map(|color| color.clamp(Vec3::ZERO, Vec3::ONE)));
        for &p in &shape.positions {
            let mut shares = follows(p);
            // a vertex has room for four: the least go
            shares.sort_by(|a, b| b.1.total_cmp(&a.1));
            let (joints, weights) = four(&shares);
            self.joints.push(joints);
            self.weights.push(weights);
        }
    }

    /// Adds a piece of the left and its mirror.
    pub fn add_pair(&mut self, shape: &Shape, color_linear: impl Fn(Vec3) -> Vec3, follows: impl Fn(Side, Vec3) -> Shares) {
        self.add(shape, &color_linear, |p| follows(Side::Left, p));
        self.add(&shape.mirrored(), &color_linear, |p| follows(Side::Right, p));
    }

    /// The whole figure.
    pub fn finish(self, name: &str) -> SceneMesh {
        let Self { mut mesh, joints, weights } = self;
        normals::compute(&mut mesh);
        mesh.materials = vec![Material { name: name.to_owned(), base_color_linear: Vec3::ONE, texture: None }];
        SceneMesh { name: name.to_owned(), mesh, joints, weights, targets: Vec::new() }
    }
}

/// 0 at `low`, 1 at `high`, smooth between; `low` may be the greater one.
pub fn ramp(low: f32, high: f32, x: f32) -> f32 {
    smoothstep(((x - low) / (high - low)).clamp(0.0, 1.0))
}

/// A bell around 0.
pub fn bump(x: f32, width: f32) -> f32 {
    libm::expf(-(x / width) * (x / width))
}

/// Shares of the two joints between whose places, which rise, something is.
fn between(joints: &[(usize, f32)], at: f32) -> Shares {
    let i = joints.iter().rposition(|(_, place)| *place <= at).unwrap_or(0).min(joints.len() - 2);
    let x = ramp(joints[i].1, joints[i + 1].1, at);
    vec![(joints[i].0, 1.0 - x), (joints[i + 1].0, x)]
}

/// What the trunk follows, from the hips to the head.
pub fn trunk(p: Vec3) -> Shares {
    let joints = [
        (core(Core::Pelvis), 1.0),
        (core(Core::Lumbar), 1.08),
        (core(Core::Thorax), 1.2),
        (core(Core::Chest), 1.36),
        (core(Core::Chest), 1.47),
        (core(Core::Neck), 1.52),
        (core(Core::Head), 1.57),
    ];
    between(&joints, p.y)
}

/// What an arm follows, from the wrist to the shoulder.
pub fn arm(side: Side, p: Vec3) -> Shares {
    let joint = |joint: Limb| limb(side, joint);
    let joints = [
        (joint(Limb::Hand), 0.845),
        (joint(Limb::Forearm), 0.885),
        (joint(Limb::Forearm), 1.06),
        (joint(Limb::UpperArm), 1.15),
        (joint(Limb::UpperArm), 1.36),
        (joint(Limb::Clavicle), 1.47),
    ];
    between(&joints, p.y)
}

/// What a leg follows, from the ankle to the hip.
pub fn leg(side: Side, p: Vec3) -> Shares {
    let joint = |joint: Limb| limb(side, joint);
    let joints = [
        (joint(Limb::Foot), 0.05),
        (joint(Limb::Shin), 0.1),
        (joint(Limb::Shin), 0.43),
        (joint(Limb::Thigh), 0.55),
        (joint(Limb::Thigh), 0.82),
        (core(Core::Pelvis), 0.98),
    ];
    between(&joints, p.y)
}

/// What cloth follows: above the hips the trunk, below, the more the lower, the legs on either side, and never quite.
pub fn cloth(p: Vec3) -> Shares {
    const MOST: f32 = 0.88;
    if p.y >= 1.0 {
        return trunk(p);
    }
    let (low, left, below) = (MOST * ramp(1.0, 0.66, p.y), ramp(-0.1, 0.1, p.x), ramp(0.56, 0.4, p.y));
    let mut shares = vec![(core(Core::Pelvis), 1.0 - low)];
    for (side, share) in [(Side::Left, low * left), (Side::Right, low * (1.0 - left))] {
        shares.push((limb(side, Limb::Thigh), share * (1.0 - below)));
        shares.push((limb(side, Limb::Shin), share * below));
    }
    shares
}
