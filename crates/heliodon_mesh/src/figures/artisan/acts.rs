//! What they do: poses at a share of a clip, in [0, 1).

use crate::figures::walker::gait::{self, Step, arm, degrees, leg, turned_out};
use crate::figures::walker::rig::{self, ANKLE, Core, Limb, Pose, Rest, Side};
use glam::DVec3;
use std::f64::consts::TAU;

fn wave(turns: f64) -> f64 {
    libm::cos(TAU * turns)
}

/// From 0 to 1, level at both ends; beyond them, at them.
fn eased(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// An arm before the body: degrees that it is lifted forward, turned inwards and bent.
fn reach(pose: &mut Pose, side: Side, forward: f64, inwards: f64, bent: f64) {
    arm(pose, side, forward, 3.0, bent);
    let sign = side.sign();
    pose.turns[rig::limb(side, Limb::UpperArm)] = degrees(-forward, -sign * inwards, sign * 4.0);
}

/// Closes a hand around something.
fn grip(pose: &mut Pose, side: Side) {
    let sign = side.sign();
    let mut set = |joint: Limb, z: f64| pose.turns[rig::limb(side, joint)] = degrees(0.0, 0.0, -sign * z);
    set(Limb::Fingers, 72.0);
    set(Limb::FingerTips, 95.0);
    set(Limb::Thumb, 30.0);
}

/// Stands easily, and breathes.
pub fn stand(rest: &[Rest], share: f64) -> Pose {
    gait::idle(rest, share)
}

/// Lifts the right arm and shows where to go; stays so.
pub fn point(rest: &[Rest], share: f64) -> Pose {
    let mut pose = gait::idle(rest, 0.0);
    let lifted = eased(share / 0.7);
    reach(&mut pose, Side::Right, 4.0 + 74.0 * lifted, -8.0 * lifted, 14.0 - 8.0 * lifted);
    let set = |joint: Limb| rig::limb(Side::Right, joint);
    pose.turns[set(Limb::Fingers)] = degrees(0.0, 0.0, 20.0 * (1.0 - lifted) + 4.0);
    pose.turns[set(Limb::FingerTips)] = degrees(0.0, 0.0, 28.0 * (1.0 - lifted) + 4.0);
    pose.turns[rig::core(Core::Chest)] = degrees(0.0, 7.0 * lifted, 0.0);
    pose
}

/// Feet one before the other, knees a little bent, as somebody stands who works.
fn stance(pose: &mut Pose, rest: &[Rest]) {
    for (side, z) in [(Side::Left, 0.13), (Side::Right, -0.13)] {
        let ankle = DVec3::new(side.sign() * 0.12, ANKLE, z);
        leg(pose, rest, side, &Step { ankle, foot_rad: 0.0, toes_rad: 0.0 }, turned_out(side, 0.2));
    }
}

/// One blow of the mallet onto the chisel.
pub fn hammer(rest: &[Rest], share: f64) -> Pose {
    // up slowly, down fast, and a little rebound
    let raised = if share < 0.55 {
        eased(share / 0.55)
    } else if share < 0.68 {
        let x = (share - 0.55) / 0.13;
        1.0 - x * x
    } else {
        0.1 * libm::sin(std::f64::consts::PI * (share - 0.68) / 0.32)
    };
    let mut pose = Pose::rest();
    pose.pelvis = DVec3::new(0.0, -0.05, 0.02);
    let turns = &mut pose.turns;
    turns[rig::core(Core::Pelvis)] = degrees(7.0, 4.0 * raised, 0.0);
    turns[rig::core(Core::Lumbar)] = degrees(7.0 - 3.0 * raised, 2.0 * raised, 0.0);
    turns[rig::core(Core::Thorax)] = degrees(6.0 - 3.0 * raised, -4.0 * raised, 0.0);
    turns[rig::core(Core::Chest)] = degrees(4.0 - 2.0 * raised, -7.0 * raised, 0.0);
    turns[rig::core(Core::Neck)] = degrees(6.0, 0.0, 0.0);
    turns[rig::core(Core::Head)] = degrees(10.0, 5.0 * raised, 0.0);
    reach(&mut pose, Side::Right, 30.0 + 34.0 * raised, 24.0 - 18.0 * raised, 66.0 + 30.0 * raised);
    pose.turns[rig::limb(Side::Right, Limb::Hand)] = degrees(28.0 - 40.0 * raised, 14.0, 0.0);
    reach(&mut pose, Side::Left, 36.0, 26.0, 52.0);
    pose.turns[rig::limb(Side::Left, Limb::Hand)] = degrees(12.0, -8.0, 0.0);
    Side::BOTH.into_iter().for_each(|side| grip(&mut pose, side));
    stance(&mut pose, rest);
    pose
}

/// Holds his tools and waits.
pub fn hold(rest: &[Rest], share: f64) -> Pose {
    let mut pose = gait::idle(rest, share);
    for side in Side::BOTH {
        reach(&mut pose, side, 8.0, 4.0, 38.0 + 1.5 * wave(share));
        grip(&mut pose, side);
    }
    pose
}

/// Both arms up, and up and down with them.
pub fn cheer(rest: &[Rest], share: f64) -> Pose {
    let mut pose = gait::idle(rest, 0.0);
    let up = 0.5 - 0.5 * wave(share);
    pose.pelvis.y = -0.03 + 0.014 * up;
    pose.turns[rig::core(Core::Chest)] = degrees(-4.0, 0.0, 0.0);
    pose.turns[rig::core(Core::Head)] = degrees(-14.0, 4.0 * wave(share), 0.0);
    for side in Side::BOTH {
        reach(&mut pose, side, 136.0 + 22.0 * up, -12.0, 46.0 - 30.0 * up);
        grip(&mut pose, side);
    }
    stance(&mut pose, rest);
    pose
}

/// Lays the arms about a chest.
fn embrace(pose: &mut Pose) {
    for side in Side::BOTH {
        reach(pose, side, 30.0, 2.0, 62.0);
        pose.turns[rig::limb(side, Limb::Fingers)] = degrees(0.0, 0.0, -side.sign() * 30.0);
    }
    // leans back against the weight
    let loins = &mut pose.turns[rig::core(Core::Lumbar)];
    *loins *= degrees(-4.0, 0.0, 0.0);
}

/// Walks with the chest.
pub fn carry(rest: &[Rest], share: f64) -> Pose {
    let mut pose = gait::walk(rest, share);
    embrace(&mut pose);
    pose
}

/// Stands with the chest.
pub fn carry_standing(rest: &[Rest], share: f64) -> Pose {
    let mut pose = gait::idle(rest, share);
    embrace(&mut pose);
    pose
}
