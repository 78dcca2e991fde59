//! How the skeleton walks and stands.
//!
//! The feet are given and the legs follow (two bones have one answer), because a foot on the ground may not slide: the heel
//! rolls, the sole lies, the ball stays while the heel rises. Pelvis, spine and arms follow the courses that gait laboratories
//! measure (Perry, Burnfield: "Gait Analysis", 2nd edition 2010), as one or two waves each.

use super::rig::{self, ANKLE, BALL, Core, HEEL, HIP, KNEE, Limb, Pose, Rest, Side};
use glam::{DMat3, DQuat, DVec3};
use std::f64::consts::TAU;

/// How far the ground goes back in a loop, metres.
const STRIDE: f64 = super::WALK_SPEED_M_S as f64 * super::WALK_LOOP_S as f64;
/// Shares of the loop, from the heel's strike on: the sole lies from, the heel rises from, the toes leave.
const FLAT: f64 = 0.1;
const RISE: f64 = 0.36;
const LEAVE: f64 = 0.61;
/// The foot's slope at the strike (toes up) and where the toes leave (heel up), radians.
const STRIKE_RAD: f64 = -0.36;
const LEAVE_RAD: f64 = 1.12;
/// Where the ankle would be at the strike if the sole lay, before the hips, metres.
const REACH: f64 = 0.34;
/// How far from the middle the feet go, metres, and how far they turn out, radians.
const TRACK: f64 = 0.055;
const TOE_OUT_RAD: f64 = 0.09;
/// How much lower than at rest the hips are on average, and how far they rise and fall, metres.
const CROUCH: f64 = 0.041;
const BOB: f64 = 0.017;
/// Shares of the leg's length that it is never longer than: a straight knee cannot say which way it bends.
const LONGEST_LEG: f64 = 0.999;

fn unit_or(v: DVec3, fallback: DVec3) -> DVec3 {
    v.try_normalize().unwrap_or(fallback)
}

fn wave(turns: f64) -> f64 {
    libm::cos(TAU * turns)
}

/// Turns about X, then Z, then Y.
pub fn degrees(x: f64, y: f64, z: f64) -> DQuat {
    // libm's sines, not the platform's
    let axis = |angle: f64, axis: DVec3| {
        let (sin, cos) = libm::sincos(0.5 * angle.to_radians());
        DQuat::from_xyzw(axis.x * sin, axis.y * sin, axis.z * sin, cos)
    };
    axis(y, DVec3::Y) * axis(z, DVec3::Z) * axis(x, DVec3::X)
}

fn pitch(radians: f64) -> DQuat {
    degrees(radians.to_degrees(), 0.0, 0.0)
}

/// How a foot points that is turned out so far.
pub fn turned_out(side: Side, radians: f64) -> DQuat {
    degrees(0.0, side.sign() * radians.to_degrees(), 0.0)
}

/// Where an ankle is and how foot and toes slope, toes down positive.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    pub ankle: DVec3,
    pub foot_rad: f64,
    pub toes_rad: f64,
}

/// A foot on the ground; `share` of the loop since its strike; `yaw` is how it turns out.
fn stance(share: f64, yaw: DQuat) -> Step {
    let flat = DVec3::new(0.0, ANKLE, REACH - STRIDE * share);
    let heel = HEEL - DVec3::Y * ANKLE;
    let ball = BALL - DVec3::Y * ANKLE;
    if share < FLAT {
        let x = share / FLAT;
        let slope = STRIKE_RAD * (1.0 - x * x * (3.0 - 2.0 * x));
        // the heel rolls on its round
        let moved = heel + DVec3::Z * (HEEL.y * slope) - pitch(slope) * heel;
        return Step { ankle: flat + yaw * moved, foot_rad: slope, toes_rad: slope };
    }
    let x = ((share - RISE) / (LEAVE - RISE)).max(0.0);
    let slope = LEAVE_RAD * x * x * (1.6 - 0.6 * x);
    Step { ankle: flat + yaw * (ball - pitch(slope) * ball), foot_rad: slope, toes_rad: 0.0 }
}

/// A foot at any share of the loop, in [0, 1).
fn step(share: f64, yaw: DQuat) -> Step {
    if share < LEAVE {
        return stance(share, yaw);
    }
    // Hermite's curve through the air, at the speeds at which the ground lets go and takes again
    const TICK: f64 = 1.0e-3;
    let (from, to) = (stance(LEAVE, yaw), stance(0.0, yaw));
    let air = 1.0 - LEAVE;
    let leaving = (from.ankle - stance(LEAVE - TICK, yaw).ankle) * (air / TICK);
    // the heel comes down, it does not graze
    let landing = (stance(TICK, yaw).ankle - to.ankle) * (0.8 * air / TICK) - DVec3::Y * 0.09;
    let x = (share - LEAVE) / air;
    let hermite = |a: f64, out: f64, b: f64, into: f64| {
        let (x2, x3) = (x * x, x * x * x);
        (2.0 * x3 - 3.0 * x2 + 1.0) * a + (x3 - 2.0 * x2 + x) * out + (3.0 * x2 - 2.0 * x3) * b + (x3 - x2) * into
    };
    let axis = |i: usize| hermite(from.ankle[i], leaving[i], to.ankle[i], landing[i]);
    // early, where the toes still hang
    let up = libm::sin(0.5 * TAU * libm::pow(x, 0.6));
    let lift = 0.045 * up * up;
    let foot_rad = hermite(from.foot_rad, 0.15, to.foot_rad, -0.12);
    let fold = (x / 0.6).min(1.0);
    let toes_rad = foot_rad * fold * fold * (3.0 - 2.0 * fold);
    Step { ankle: DVec3::new(axis(0), axis(1) + lift, axis(2)), foot_rad, toes_rad }
}

/// The pose at `share` of the walk's loop, in [0, 1); the left heel strikes at 0.
pub fn walk(rest: &[Rest], share: f64) -> Pose {
    let mut pose = Pose::rest();
    // lowest where both feet are down, over the standing foot at the side
    pose.pelvis =
        DVec3::new(0.021 * wave(share - 0.3), -CROUCH - BOB * wave(2.0 * (share - 0.05)), 0.006 * wave(2.0 * (share + 0.1)));
    let swing = wave(share);
    let drop = wave(share - 0.17);
    let turns = &mut pose.turns;
    turns[rig::core(Core::Pelvis)] = degrees(4.0 + 1.0 * wave(2.0 * share), -5.5 * swing, 3.5 * drop);
    turns[rig::core(Core::Lumbar)] = degrees(-1.0, 3.2 * swing, -1.8 * drop);
    turns[rig::core(Core::Thorax)] = degrees(-0.5 - 0.5 * wave(2.0 * share), 3.8 * swing, -1.6 * drop);
    turns[rig::core(Core::Chest)] = degrees(1.0, 4.0 * swing, -drop);
    turns[rig::core(Core::Neck)] = degrees(-1.0, -2.4 * swing, 0.5 * drop);
    turns[rig::core(Core::Head)] = degrees(-2.0 - 0.6 * wave(2.0 * share), -2.8 * swing, 0.4 * drop);
    turns[rig::core(Core::Jaw)] = degrees(2.5, 0.0, 0.0);
    for side in Side::BOTH {
        let share = share + if side == Side::Left { 0.0 } else { 0.5 };
        let forward = 3.0 - 23.0 * wave(share - 0.04);
        let bent = 21.0 - 13.0 * wave(share - 0.09);
        arm(&mut pose, side, forward, 3.0, bent);
        pose.turns[rig::limb(side, Limb::Clavicle)] = degrees(0.0, side.sign() * 3.0 * wave(share - 0.04), 0.0);
    }
    for side in Side::BOTH {
        let share = share + if side == Side::Left { 0.0 } else { 0.5 };
        let yaw = turned_out(side, TOE_OUT_RAD);
        let mut foot = step(share - share.floor(), yaw);
        foot.ankle.x += side.sign() * TRACK;
        leg(&mut pose, rest, side, &foot, yaw);
    }
    pose
}

/// The pose at `share` of the loop of standing, in [0, 1).
pub fn idle(rest: &[Rest], share: f64) -> Pose {
    let mut pose = Pose::rest();
    let (sway, breath) = (wave(share), wave(2.0 * share + 0.2));
    pose.pelvis = DVec3::new(0.014 * sway, -0.014, 0.004 * wave(share + 0.3));
    let turns = &mut pose.turns;
    turns[rig::core(Core::Pelvis)] = degrees(1.0, 1.5 * sway, 1.6 * sway);
    turns[rig::core(Core::Lumbar)] = degrees(0.0, -0.5 * sway, -1.2 * sway);
    turns[rig::core(Core::Thorax)] = degrees(-0.6 * breath, 0.0, -0.8 * sway);
    turns[rig::core(Core::Chest)] = degrees(-1.2 * breath, -sway, -0.4 * sway);
    turns[rig::core(Core::Neck)] = degrees(0.8 * breath, 3.5 * wave(share + 0.15), 0.4 * sway);
    turns[rig::core(Core::Head)] = degrees(0.9 * breath, 5.0 * wave(share + 0.12), 0.4 * sway);
    turns[rig::core(Core::Jaw)] = degrees(2.0 + 0.8 * breath, 0.0, 0.0);
    for side in Side::BOTH {
        arm(&mut pose, side, 1.0 + 1.2 * breath, 2.0 + 0.8 * breath, 13.0);
        pose.turns[rig::limb(side, Limb::Clavicle)] = degrees(0.0, 0.0, side.sign() * 0.8 * breath);
        let ankle = DVec3::new(side.sign() * 0.095, ANKLE, -side.sign() * 0.012);
        leg(&mut pose, rest, side, &Step { ankle, foot_rad: 0.0, toes_rad: 0.0 }, turned_out(side, 0.14));
    }
    pose
}

/// Sets an arm: degrees that it is swung forward, lifted to the side, and bent.
pub fn arm(pose: &mut Pose, side: Side, forward: f64, out: f64, bent: f64) {
    let mut set = |joint: Limb, turn: DQuat| pose.turns[rig::limb(side, joint)] = turn;
    let sign = side.sign();
    set(Limb::UpperArm, degrees(-forward, 0.0, sign * out));
    set(Limb::Forearm, degrees(-bent, 0.0, -sign * 2.0));
    set(Limb::Hand, degrees(4.0, -sign * 12.0, -sign * 3.0));
    set(Limb::Fingers, degrees(0.0, 0.0, -sign * 20.0));
    set(Limb::FingerTips, degrees(0.0, 0.0, -sign * 28.0));
    set(Limb::Thumb, degrees(-8.0, 0.0, -sign * 10.0));
}

/// Sets a leg so that its ankle and foot are where they should be; the pelvis stands already.
pub fn leg(pose: &mut Pose, rest: &[Rest], side: Side, step: &Step, yaw: DQuat) {
    let world = pose.world(rest);
    let (hip, _) = world[rig::limb(side, Limb::Thigh)];
    let (_, pelvis) = world[rig::core(Core::Pelvis)];
    let (thigh, shin) = (HIP - KNEE, KNEE - ANKLE);
    let to = step.ankle - hip;
    let length = to.length().min(LONGEST_LEG * (thigh + shin));
    let way = unit_or(to, DVec3::NEG_Y);
    // the knee goes before the line from hip to ankle, to where the foot points
    let forward = yaw * DVec3::Z;
    let forward = unit_or(forward - way * forward.dot(way), DVec3::Z);
    let along = (thigh * thigh - shin * shin + length * length) / (2.0 * length);
    let before = (thigh * thigh - along * along).max(0.0).sqrt();
    let knee = way * along + forward * before;
    let turn = |down: DVec3| {
        let up = unit_or(-down, DVec3::Y);
        let right = unit_or(up.cross(forward), DVec3::X);
        DQuat::from_mat3(&DMat3::from_cols(right, up, right.cross(up)))
    };
    let thigh_turn = turn(knee);
    let shin_turn = turn(way * length - knee);
    let foot_turn = yaw * pitch(step.foot_rad);
    let toes_turn = yaw * pitch(step.toes_rad);
    let mut set = |joint: Limb, turn: DQuat| pose.turns[rig::limb(side, joint)] = turn.normalize();
    set(Limb::Thigh, pelvis.inverse() * thigh_turn);
    set(Limb::Shin, thigh_turn.inverse() * shin_turn);
    set(Limb::Foot, shin_turn.inverse() * foot_turn);
    set(Limb::Toes, foot_turn.inverse() * toes_turn);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn legs_are_long_enough_for_every_step() {
        let rest = rig::rest();
        for i in 0..200 {
            let pose = walk(&rest, i as f64 / 200.0);
            let world = pose.world(&rest);
            for side in Side::BOTH {
                let share = i as f64 / 200.0 + if side == Side::Left { 0.0 } else { 0.5 };
                let wanted = step(share - share.floor(), turned_out(side, TOE_OUT_RAD)).ankle;
                let (is, _) = world[rig::limb(side, Limb::Foot)];
                assert!(((is.y - wanted.y).abs()).max((is.z - wanted.z).abs()) < 2e-4, "{i} {side:?}: {is} for {wanted}");
            }
        }
    }
}
