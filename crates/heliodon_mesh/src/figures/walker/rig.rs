//! The joints of the skeleton, and poses of them. In `f64`, whose quaternions glam computes alike on every machine: those of
//! `f32` add up in another order where there is SIMD.

use glam::{DQuat, DVec3};

/// Joints in the middle; those of the limbs follow, the left ones first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Core {
    Root,
    Pelvis,
    Lumbar,
    Thorax,
    Chest,
    Neck,
    Head,
    Jaw,
}

/// Joints of either side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limb {
    Clavicle,
    UpperArm,
    Forearm,
    Hand,
    Fingers,
    FingerTips,
    Thumb,
    Thigh,
    Shin,
    Foot,
    Toes,
}

/// A side of the body; left is +X.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    Left,
    Right,
}

impl Side {
    /// Both, in the order of the joints.
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];

    /// The sign of x there.
    pub fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

/// Name, parent, and place at rest, metres.
const CORE: [(&str, Option<Core>, [f64; 3]); 8] = [
    ("root", None, [0.0, 0.0, 0.0]),
    ("pelvis", Some(Core::Root), [0.0, 0.955, 0.0]),
    ("lumbar", Some(Core::Pelvis), [0.0, 1.03, -0.04]),
    ("thorax", Some(Core::Lumbar), [0.0, 1.16, -0.03]),
    ("chest", Some(Core::Thorax), [0.0, 1.29, -0.055]),
    ("neck", Some(Core::Chest), [0.0, 1.465, -0.045]),
    ("head", Some(Core::Neck), [0.0, 1.575, -0.012]),
    ("jaw", Some(Core::Head), [0.0, 1.6, 0.008]),
];

enum Above {
    Core(Core),
    Limb(Limb),
}

/// Name, parent, and place of the left one at rest, metres. The leg hangs straight down, so that a turn of the thigh is the
/// way of the thigh.
const LIMBS: [(&str, Above, [f64; 3]); 11] = [
    ("clavicle", Above::Core(Core::Chest), [0.02, 1.428, 0.03]),
    ("upper-arm", Above::Limb(Limb::Clavicle), [0.178, 1.405, -0.03]),
    ("forearm", Above::Limb(Limb::UpperArm), [0.2, 1.105, -0.04]),
    ("hand", Above::Limb(Limb::Forearm), [0.216, 0.862, -0.02]),
    ("fingers", Above::Limb(Limb::Hand), [0.22, 0.775, -0.015]),
    ("finger-tips", Above::Limb(Limb::Fingers), [0.22, 0.732, -0.015]),
    ("thumb", Above::Limb(Limb::Hand), [0.214, 0.838, 0.012]),
    ("thigh", Above::Core(Core::Pelvis), [0.088, HIP, 0.0]),
    ("shin", Above::Limb(Limb::Thigh), [0.088, KNEE, 0.0]),
    ("foot", Above::Limb(Limb::Shin), [0.088, ANKLE, 0.0]),
    ("toes", Above::Limb(Limb::Foot), [0.088, BALL.y, BALL.z]),
];

/// Heights of the leg's joints at rest, metres.
pub const HIP: f64 = 0.925;
pub const KNEE: f64 = 0.49;
pub const ANKLE: f64 = 0.075;
/// The axis of the ball of the foot, and how high it is over the ground.
pub const BALL: DVec3 = DVec3::new(0.0, 0.013, 0.125);
/// The middle of the round heel, and its radius.
pub const HEEL: DVec3 = DVec3::new(0.0, 0.03, -0.045);

/// Joints in all.
pub const COUNT: usize = CORE.len() + 2 * LIMBS.len();

/// The number of a joint in the middle.
pub fn core(joint: Core) -> usize {
    joint as usize
}

/// The number of a limb's joint.
pub fn limb(side: Side, joint: Limb) -> usize {
    CORE.len() + side as usize * LIMBS.len() + joint as usize
}

/// A joint at rest, where nothing is turned.
pub struct Rest {
    pub name: String,
    pub parent: Option<usize>,
    /// In the mesh's space.
    pub place: DVec3,
}

/// All joints at rest; parents stand before their children.
pub fn rest() -> Vec<Rest> {
    let middle = CORE.iter().map(|(name, parent, place)| Rest {
        name: (*name).to_owned(),
        parent: parent.map(core),
        place: DVec3::from_array(*place),
    });
    let limbs = Side::BOTH.into_iter().flat_map(|side| {
        LIMBS.iter().map(move |(name, parent, place)| Rest {
            name: format!("{name}-{}", if side == Side::Left { "left" } else { "right" }),
            parent: Some(match parent {
                Above::Core(joint) => core(*joint),
                Above::Limb(joint) => limb(side, *joint),
            }),
            place: DVec3::from_array(*place) * DVec3::new(side.sign(), 1.0, 1.0),
        })
    });
    middle.chain(limbs).collect()
}

/// How the skeleton stands at one moment.
#[derive(Clone, Debug)]
pub struct Pose {
    /// How far the pelvis is from its place at rest, metres.
    pub pelvis: DVec3,
    /// The turn of each joint in its parent.
    pub turns: [DQuat; COUNT],
}

impl Pose {
    /// As modelled.
    pub fn rest() -> Self {
        Self { pelvis: DVec3::ZERO, turns: [DQuat::IDENTITY; COUNT] }
    }

    /// Place and turn of every joint in the figure's space.
    pub fn world(&self, rest: &[Rest]) -> Vec<(DVec3, DQuat)> {
        let mut world: Vec<(DVec3, DQuat)> = Vec::with_capacity(rest.len());
        for (index, joint) in rest.iter().enumerate() {
            let placed = match joint.parent {
                None => (joint.place, self.turns[index]),
                Some(parent) => {
                    let own =
                        joint.place - rest[parent].place + if index == core(Core::Pelvis) { self.pelvis } else { DVec3::ZERO };
                    let (p, q) = world[parent];
                    (p + q * own, q * self.turns[index])
                }
            };
            world.push(placed);
        }
        world
    }
}
