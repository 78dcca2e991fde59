//! Trunk and limbs, and what hands hold.

use super::Look;
use super::sewn::{self, Sewn, Shares, arm, leg, ramp};
use crate::figures::shape::{Shape, Station, ball, sweep};
use crate::figures::walker::rig::{Core, Limb, Side, core, limb};
use glam::Vec3;

/// The soles of sandals, and what tools are made of.
const LEATHER: Vec3 = Vec3::new(0.16, 0.085, 0.045);
const WOOD: Vec3 = Vec3::new(0.33, 0.22, 0.13);
const IRON: Vec3 = Vec3::new(0.13, 0.12, 0.11);
/// Up to here the straps of sandals go, metres.
const STRAPS_TOP: f32 = 0.16;

/// The trunk, from the seat to the neck.
pub fn trunk_line() -> [Station; 8] {
    [
        ([0.0, 0.88, -0.012], 0.135, 0.105),
        ([0.0, 0.95, -0.014], 0.158, 0.112),
        ([0.0, 1.06, -0.006], 0.138, 0.098),
        ([0.0, 1.16, -0.012], 0.142, 0.102),
        ([0.0, 1.28, -0.018], 0.163, 0.118),
        ([0.0, 1.37, -0.024], 0.17, 0.112),
        ([0.0, 1.43, -0.036], 0.14, 0.082),
        ([0.0, 1.47, -0.038], 0.075, 0.062),
    ]
}

/// Trunk and shoulders.
pub fn trunk(sewn: &mut Sewn, look: &Look) {
    sewn.add(&sweep(&trunk_line(), Vec3::X, 22, 24), |_| look.skin, sewn::trunk);
    let shoulder = ball(Vec3::new(0.172, 1.388, -0.032), Vec3::new(0.056, 0.062, 0.058), 8, 14);
    sewn.add_pair(
        &shoulder,
        |_| look.skin,
        |side, p| {
            let out = ramp(0.11, 0.2, p.x.abs());
            vec![
                (core(Core::Chest), 0.4 * (1.0 - out)),
                (limb(side, Limb::Clavicle), 0.6 - 0.3 * out),
                (limb(side, Limb::UpperArm), 0.7 * out),
            ]
        },
    );
}

/// Arms, hands, legs, feet.
pub fn limbs(sewn: &mut Sewn, look: &Look) {
    let line = [
        ([0.17, 1.4, -0.032], 0.05, 0.054),
        ([0.184, 1.34, -0.032], 0.05, 0.055),
        ([0.193, 1.23, -0.036], 0.044, 0.05),
        ([0.199, 1.12, -0.04], 0.038, 0.041),
        ([0.204, 1.05, -0.038], 0.041, 0.044),
        ([0.211, 0.95, -0.03], 0.034, 0.034),
        ([0.216, 0.865, -0.02], 0.023, 0.03),
    ];
    sewn.add_pair(&sweep(&line, Vec3::X, 22, 14), |_| look.skin, arm);
    hands(sewn, look);
    let line = [
        ([0.09, 0.95, -0.008], 0.085, 0.1),
        ([0.094, 0.84, 0.0], 0.083, 0.092),
        ([0.092, 0.66, 0.008], 0.066, 0.07),
        ([0.089, 0.52, 0.004], 0.05, 0.053),
        ([0.088, 0.46, 0.0], 0.049, 0.054),
        ([0.089, 0.36, -0.016], 0.052, 0.058),
        ([0.088, 0.22, -0.01], 0.037, 0.041),
        ([0.087, 0.1, -0.004], 0.031, 0.036),
        ([0.087, 0.05, -0.002], 0.033, 0.042),
    ];
    let bands = |p: Vec3| {
        let strap = p.y < STRAPS_TOP && (libm::sinf(170.0 * p.y + 40.0 * p.x) > 0.45);
        if strap { LEATHER } else { look.skin }
    };
    sewn.add_pair(&sweep(&line, Vec3::X, 30, 16), bands, leg);
    let line = [
        ([0.087, 0.042, -0.072], 0.022, 0.03),
        ([0.087, 0.05, -0.03], 0.032, 0.046),
        ([0.088, 0.048, 0.04], 0.036, 0.044),
        ([0.091, 0.034, 0.11], 0.046, 0.029),
        ([0.094, 0.024, 0.17], 0.042, 0.018),
    ];
    let flat = |p: Vec3| Vec3::new(p.x, p.y.max(0.004), p.z);
    let foot = sweep(&line, Vec3::X, 16, 14).moved(flat);
    let color = |p: Vec3| {
        let strap = libm::sinf(95.0 * p.z) > 0.55;
        if p.y < 0.014 || strap { LEATHER } else { look.skin }
    };
    sewn.add_pair(&foot, color, |side, p| {
        let bent = ramp(0.105, 0.15, p.z);
        vec![(limb(side, Limb::Foot), 1.0 - bent), (limb(side, Limb::Toes), bent)]
    });
}

fn hands(sewn: &mut Sewn, look: &Look) {
    let follows = |side: Side, p: Vec3| -> Shares {
        let (fingers, tips) = (ramp(0.8, 0.765, p.y), ramp(0.742, 0.715, p.y));
        vec![
            (limb(side, Limb::Hand), 1.0 - fingers),
            (limb(side, Limb::Fingers), fingers * (1.0 - tips)),
            (limb(side, Limb::FingerTips), fingers * tips),
        ]
    };
    let palm =
        [([0.217, 0.87, -0.018], 0.021, 0.028), ([0.219, 0.82, -0.016], 0.018, 0.041), ([0.22, 0.775, -0.016], 0.015, 0.042)];
    sewn.add_pair(&sweep(&palm, Vec3::X, 9, 12), |_| look.skin, follows);
    for (finger, long) in [0.085, 0.094, 0.088, 0.07].into_iter().enumerate() {
        let z = 0.015 - 0.0205 * finger as f32;
        let line = [([0.22, 0.785, z], 0.0095, 0.0095), ([0.22, 0.775 - long, z], 0.0075, 0.0075)];
        sewn.add_pair(&sweep(&line, Vec3::X, 8, 7), |_| look.skin, follows);
    }
    let thumb =
        [([0.214, 0.845, 0.008], 0.014, 0.014), ([0.206, 0.8, 0.034], 0.011, 0.011), ([0.202, 0.765, 0.046], 0.009, 0.009)];
    sewn.add_pair(&sweep(&thumb, Vec3::X, 7, 8), |_| look.skin, |side, _| vec![(limb(side, Limb::Thumb), 1.0)]);
}

/// A box with rounded ends between two places, as a hand's tools have.
fn bar(from: Vec3, to: Vec3, radius: f32, sides: usize) -> Shape {
    sweep(&[(from.to_array(), radius, radius), (to.to_array(), radius, radius)], Vec3::X, 4, sides)
}

/// A mallet in the right hand, a chisel in the left. At rest they lie along Z, square to the arm that hangs.
pub fn tools(sewn: &mut Sewn) {
    let follows = |side: Side| move |_: Vec3| vec![(limb(side, Limb::Hand), 1.0)];
    let grip = Vec3::new(0.207, 0.775, -0.015);
    let right = grip * Vec3::new(-1.0, 1.0, 1.0);
    sewn.add(&bar(right - Vec3::Z * 0.07, right + Vec3::Z * 0.2, 0.014, 8), |_| WOOD * 1.2, follows(Side::Right));
    let head = right + Vec3::Z * 0.22;
    sewn.add(&bar(head - Vec3::Y * 0.062, head + Vec3::Y * 0.062, 0.055, 16), |_| WOOD, follows(Side::Right));
    sewn.add(&bar(grip - Vec3::Z * 0.17, grip + Vec3::Z * 0.09, 0.01, 8), |_| IRON, follows(Side::Left));
}

/// A chest before the breast, which goes with it.
pub fn chest(sewn: &mut Sewn) {
    let (low, high) = (Vec3::new(-0.2, 1.0, 0.23), Vec3::new(0.2, 1.2, 0.5));
    let ring = |y: f32, inset: f32| {
        // four sides of three places each, so that the corners stay corners
        let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)].map(|(x, z): (f32, f32)| {
            let half = (high - low) * 0.5 - Vec3::splat(inset);
            let middle = (low + high) * 0.5;
            Vec3::new(middle.x + x * half.x, y, middle.z + z * half.z)
        });
        (0..12).map(|k| corners[k / 3].lerp(corners[(k / 3 + 1) % 4], [0.03, 0.5, 0.97][k % 3])).collect::<Vec<_>>()
    };
    let rings = [
        ring(low.y, 0.0),
        ring(low.y + 0.02, 0.0),
        ring(1.15, 0.0),
        ring(1.151, -0.012),
        ring(high.y, -0.012),
        ring(high.y, 0.0),
    ];
    let middle = (low + high) * 0.5;
    let shape = Shape::of_rings(middle.with_y(low.y), &rings, middle.with_y(high.y));
    let plank = |p: Vec3| WOOD * if p.y > 1.15 { 0.72 } else { 1.0 };
    sewn.add(&shape, plank, |_| vec![(core(Core::Chest), 1.0)]);
}
