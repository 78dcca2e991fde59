//! Head and neck: a ball whose every direction has its own distance and colour.

use super::Look;
use super::sewn::{Sewn, bump, ramp, trunk};
use crate::figures::shape::{ball, sweep};
use crate::figures::walker::rig::{Core, core};
use crate::temple::noise::fbm;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// The middle of the head.
const MIDDLE: Vec3 = Vec3::new(0.0, 1.643, 0.004);
const RINGS: usize = 30;
const SIDES: usize = 42;

/// How much of a direction is hair, in [0, 1].
fn hair(d: Vec3, is_bald: bool) -> f32 {
    // the hairline, from the forehead over the temples to the nape
    let line = if d.z > 0.35 {
        0.38 + 0.3 * (d.z - 0.35)
    } else {
        0.38 - 0.78 * ramp(0.35, -0.15, d.z) - 0.15 * ramp(-0.1, -0.8, d.z)
    };
    let crown = if is_bald { ramp(0.55, 0.35, d.y) * ramp(0.3, 0.05, d.z) } else { 1.0 };
    ramp(line - 0.03, line + 0.06, d.y) * crown
}

/// How much of a direction is beard, in [0, 1].
fn beard(d: Vec3) -> f32 {
    let cheek = -0.12 - 0.34 * ramp(0.15, 0.75, d.z);
    let mouth = bump((Vec2::new(d.x, d.y) - Vec2::new(0.0, -0.55)).length(), 0.13) * ramp(0.4, 0.7, d.z);
    ramp(cheek, cheek - 0.12, d.y) * ramp(0.02, 0.25, d.z) * (1.0 - mouth)
}

/// The point of the skin, from the head's middle.
fn surface(d: Vec3, look: &Look) -> Vec3 {
    let below = ramp(0.1, -0.85, d.y);
    let ahead = ramp(0.25, 0.6, d.z);
    let mut p = d * Vec3::new(0.074, 0.107, 0.094);
    // the skull is long behind; the jaw narrows; the nape draws in
    p.z *= 1.0 + 0.08 * ramp(0.0, -0.7, d.z) * (1.0 - below);
    p.x *= 1.0 - 0.24 * below;
    p.z += 0.03 * below * ramp(0.1, -0.8, d.z);
    let at = Vec2::new(p.x.abs(), p.y);
    p.z += 0.006 * ahead * bump(at.y - 0.021, 0.011) * ramp(0.055, 0.035, at.x);
    p.z -= 0.011 * ahead * bump((at - Vec2::new(0.031, 0.004)).length(), 0.014);
    p.z += 0.004 * ahead * bump((at - Vec2::new(0.031, 0.003)).length(), 0.008);
    let nose = bump(at.x, 0.011) * ramp(-0.046, -0.036, at.y) * ramp(0.03, -0.034, at.y);
    p.z += 0.027 * ahead * nose;
    p.z += 0.004 * ahead * bump((at - Vec2::new(0.045, -0.026)).length(), 0.02);
    p.z += 0.006 * ahead * bump(at.x, 0.022) * (bump(at.y + 0.058, 0.006) + bump(at.y + 0.071, 0.006));
    p.z += 0.009 * ahead * bump(at.x, 0.022) * bump(at.y + 0.097, 0.014);
    let tufts = 1.0 + 0.5 * fbm(17, d * 9.0, 2);
    p += d * (0.013 * tufts * hair(d, look.is_bald));
    let bearded = beard(d) * ramp(0.0, 0.01, look.beard_m);
    p += Vec3::new(0.1 * d.x, -0.75, 0.5) * (look.beard_m * bearded * (0.4 + 0.6 * below));
    p + d * (0.006 * tufts * bearded)
}

fn color(d: Vec3, look: &Look) -> Vec3 {
    if hair(d, look.is_bald) > 0.5 || (look.beard_m > 0.0 && beard(d) > 0.5) {
        return look.hair * (1.0 + 0.3 * fbm(5, d * 14.0, 2));
    }
    let at = Vec2::new((d.x * 0.074).abs(), d.y * 0.107);
    if d.z > 0.3 {
        let eye = (at - Vec2::new(0.031, 0.004)) * Vec2::new(0.7, 1.3);
        if eye.length() < 0.0075 {
            return Vec3::new(0.07, 0.05, 0.045);
        }
        if bump(at.y - 0.024, 0.007) * ramp(0.056, 0.045, at.x) * ramp(0.006, 0.014, at.x) > 0.5 {
            return look.hair * 0.8 + look.skin * 0.2;
        }
        if at.x < 0.022 && (at.y + 0.064).abs() < 0.008 {
            return look.skin * Vec3::new(0.85, 0.6, 0.6);
        }
    }
    look.skin
}

/// Head, ears and neck.
pub fn head(sewn: &mut Sewn, look: &Look) {
    let directions = ball(Vec3::ZERO, Vec3::ONE, RINGS, SIDES).moved(|d| {
        // more columns to the front
        let around = libm::atan2f(d.x, d.z);
        let around = around - 0.4 * libm::sinf(around);
        let up = libm::asinf(d.y.clamp(-1.0, 1.0)).clamp(-0.5 * PI, 0.5 * PI);
        let ((sin, cos), (side, front)) = (libm::sincosf(up), libm::sincosf(around));
        Vec3::new(side * cos, sin, front * cos)
    });
    let colors: Vec<Vec3> = directions.positions.iter().map(|d| color(*d, look)).collect();
    let skin = directions.moved(|d| MIDDLE + surface(d, look));
    let follows = |_: Vec3| vec![(core(Core::Head), 1.0)];
    sewn.add_colored(&skin, &colors, follows);
    let ear = ball(MIDDLE + Vec3::new(0.076, -0.004, -0.008), Vec3::new(0.009, 0.03, 0.018), 6, 10);
    sewn.add_pair(&ear, |_| look.skin, |_, p| follows(p));
    let neck = sweep(
        &[([0.0, 1.42, -0.04], 0.062, 0.062), ([0.0, 1.5, -0.026], 0.056, 0.058), ([0.0, 1.585, -0.008], 0.054, 0.06)],
        Vec3::X,
        6,
        16,
    );
    sewn.add(&neck, |_| look.skin, trunk);
}
