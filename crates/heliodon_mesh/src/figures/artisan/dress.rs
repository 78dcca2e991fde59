//! What they wear: pieces with a hem that is open below, whose inside goes up a little and ends there.

use super::Look;
use super::sewn::{Sewn, arm, cloth, ramp};
use crate::figures::shape::Shape;
use crate::figures::walker::rig::{Core, core};
use crate::temple::noise::fbm;
use glam::Vec3;
use std::f32::consts::TAU;

const SIDES: usize = 54;
/// How far the inside of a hem goes up, metres.
const INSIDE_M: f32 = 0.06;

/// A section of a garment: its height, its middle's z, half its width and half its depth, metres, and how deep its folds are, in parts of it.
type Section = (f32, f32, f32, f32, f32);

/// A section at a height of a line of them, straight between.
fn section(line: &[Section], y: f32) -> Section {
    let i = line.iter().rposition(|s| s.0 <= y).unwrap_or(0).min(line.len() - 2);
    let (a, b) = (line[i], line[i + 1]);
    let x = ((y - a.0) / (b.0 - a.0)).clamp(0.0, 1.0);
    let mix = |a: f32, b: f32| a + (b - a) * x;
    (y, mix(a.1, b.1), mix(a.2, b.2), mix(a.3, b.3), mix(a.4, b.4))
}

/// A garment along a line of sections from its hem upwards, closed above by the last one.
fn garment(line: &[Section], rings: usize, folds: f32, seed: u32) -> Shape {
    let ring = |at: Section, shrink: f32, lift: f32| {
        let (y, z, wide, deep, fold) = at;
        (0..SIDES)
            .map(|k| {
                let angle = TAU * k as f32 / SIDES as f32;
                let (sin, cos) = libm::sincosf(angle);
                // folds wander a little on their way down, so that they hang
                let wander = fbm(seed, Vec3::new(2.0 * sin, 1.3 * y, 2.0 * cos), 2);
                let wave =
                    libm::cosf(folds * angle + 2.2 * wander) + 0.5 * libm::cosf((folds * 0.63).round() * angle + 1.3 + wander);
                let out = shrink * (1.0 + fold * wave);
                Vec3::new(wide * out * sin, y + lift, z + deep * out * cos)
            })
            .collect::<Vec<Vec3>>()
    };
    let (hem, top) = (line[0], line[line.len() - 1]);
    let mut all = vec![ring(hem, 0.86, INSIDE_M), ring(hem, 0.95, 0.004)];
    all.extend((0..rings).map(|i| ring(section(line, hem.0 + (top.0 - hem.0) * i as f32 / (rings - 1) as f32), 1.0, 0.0)));
    Shape::of_rings(Vec3::new(0.0, hem.0 + INSIDE_M + 0.02, hem.1), &all, Vec3::new(0.0, top.0 + 0.012, top.1))
}

/// Cloth's own shades, with a border along the hem.
fn woven(look: &Look, hem_y: f32, p: Vec3) -> Vec3 {
    let shade = 1.0 + 0.1 * fbm(23, p * Vec3::new(9.0, 2.5, 9.0), 2);
    let base = if p.y < hem_y + 0.035 { look.border } else { look.cloth };
    base * shade
}

/// The working man's tunic: belted, over the left shoulder only, down to the middle of the thighs.
pub fn tunic(sewn: &mut Sewn, look: &Look) {
    const HEM: f32 = 0.6;
    let line: [Section; 12] = [
        (HEM, -0.004, 0.222, 0.185, 0.075),
        (0.72, -0.006, 0.208, 0.172, 0.06),
        (0.86, -0.01, 0.192, 0.15, 0.045),
        (0.96, -0.012, 0.18, 0.134, 0.045),
        (1.035, -0.01, 0.172, 0.128, 0.05),
        (1.06, -0.008, 0.149, 0.11, 0.03),
        (1.085, -0.01, 0.149, 0.11, 0.03),
        (1.11, -0.012, 0.166, 0.126, 0.05),
        (1.2, -0.015, 0.164, 0.128, 0.04),
        (1.32, -0.022, 0.176, 0.129, 0.025),
        (1.395, -0.03, 0.168, 0.108, 0.015),
        (1.455, -0.036, 0.1, 0.074, 0.0),
    ];
    // above a line from the left of the neck to below the right arm the breast is bare: there the cloth lies within the flesh
    let bare = |p: Vec3| ramp(-0.012, 0.012, p.y - (1.335 + 0.62 * p.x.clamp(-0.2, 0.2)) - 0.02);
    let shape = garment(&line, 46, 17.0, 31).moved(|p| {
        let axis = Vec3::new(0.0, p.y, -0.025);
        if p.y < 1.1 { p } else { p.lerp(axis, 0.28 * bare(p)) }
    });
    let color = |p: Vec3| {
        let belt = (1.058..1.088).contains(&p.y);
        if belt { Vec3::new(0.13, 0.075, 0.04) } else { woven(look, HEM, p) }
    };
    sewn.add(&shape, color, cloth);
}

/// The master's long tunic with sleeves, and a cloak over the left shoulder and round the hips.
pub fn robe(sewn: &mut Sewn, look: &Look) {
    const HEM: f32 = 0.1;
    let line: [Section; 10] = [
        (HEM, -0.005, 0.235, 0.2, 0.09),
        (0.4, -0.006, 0.218, 0.185, 0.075),
        (0.7, -0.008, 0.205, 0.168, 0.06),
        (0.9, -0.012, 0.192, 0.146, 0.045),
        (1.03, -0.01, 0.178, 0.132, 0.045),
        (1.08, -0.01, 0.162, 0.12, 0.035),
        (1.2, -0.014, 0.17, 0.128, 0.035),
        (1.32, -0.022, 0.184, 0.13, 0.022),
        (1.4, -0.03, 0.186, 0.112, 0.012),
        (1.462, -0.037, 0.112, 0.078, 0.0),
    ];
    sewn.add(&garment(&line, 58, 19.0, 37), |p| woven(look, HEM, p), cloth);
    let sleeve: [Section; 5] = [
        (1.13, -0.04, 0.074, 0.08, 0.07),
        (1.22, -0.036, 0.07, 0.076, 0.05),
        (1.33, -0.033, 0.069, 0.073, 0.03),
        (1.4, -0.032, 0.062, 0.064, 0.0),
        (1.445, -0.032, 0.03, 0.036, 0.0),
    ];
    let sleeve = garment(&sleeve, 18, 7.0, 41).moved(|p| p + Vec3::X * (0.184 - 0.05 * (p.y - 1.34)));
    sewn.add_pair(
        &sleeve,
        |p| woven(look, 1.12, p),
        |side, p| {
            // the elbow bends within the sleeve, and draws its hem along by half
            let mut shares = arm(side, p.with_y(p.y.max(1.12)));
            if p.y > 1.4 {
                shares.push((core(Core::Chest), 0.6));
            }
            shares
        },
    );
    cloak(sewn, look);
}

/// The cloak: a band that lies round the hips, rises over the breast to the left shoulder and falls down the back.
fn cloak(sewn: &mut Sewn, look: &Look) {
    const HEM: f32 = 0.36;
    let line: [Section; 9] = [
        (HEM, -0.006, 0.252, 0.215, 0.07),
        (0.6, -0.008, 0.236, 0.198, 0.06),
        (0.85, -0.012, 0.217, 0.172, 0.05),
        (1.0, -0.012, 0.203, 0.156, 0.05),
        (1.1, -0.012, 0.195, 0.15, 0.05),
        (1.2, -0.015, 0.194, 0.148, 0.045),
        (1.32, -0.022, 0.202, 0.146, 0.03),
        (1.41, -0.03, 0.2, 0.126, 0.02),
        (1.475, -0.037, 0.12, 0.086, 0.0),
    ];
    // it ends along a slanting line: from the right hip to the left side of the neck, in front and behind
    let edge = |p: Vec3| 1.13 + 1.5 * (p.x + 0.02).max(-0.06);
    let shape = garment(&line, 52, 13.0, 43).moved(|p| {
        let within = ramp(-0.02, 0.02, p.y - edge(p));
        let roll = 0.035 * ramp(-0.1, -0.03, p.y - edge(p)) * (1.0 - within);
        let axis = Vec3::new(0.0, p.y, -0.022);
        let out = (p - axis) * Vec3::new(1.0, 0.0, 1.0);
        axis + out * (1.0 - 0.3 * within) * (1.0 + roll / 0.17)
    });
    let mantle = Look { cloth: Vec3::new(0.33, 0.085, 0.07), border: Vec3::new(0.55, 0.48, 0.36), ..*look };
    sewn.add(&shape, |p| woven(&mantle, HEM, p), cloth);
}
