//! The skull: a ball whose every direction has its own distance.

use crate::figures::shape::{Shape, ball, smoothstep};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// The middle of the braincase.
pub const MIDDLE: Vec3 = Vec3::new(0.0, 1.662, -0.008);
const RINGS: usize = 24;
const SIDES: usize = 38;

fn bump(distance_squared: f32, width: f32) -> f32 {
    libm::expf(-distance_squared / (width * width))
}

fn smooth(low: f32, high: f32, x: f32) -> f32 {
    smoothstep(((x - low) / (high - low)).clamp(0.0, 1.0))
}

/// Braincase and face, without the jaw.
pub fn skull() -> Shape {
    ball(Vec3::ZERO, Vec3::ONE, RINGS, SIDES).moved(|d| {
        // more columns to the front, more rings about the eyes and the nose
        let around = libm::atan2f(d.x, d.z);
        let around = around - 0.42 * libm::sinf(around);
        let up = libm::asinf(d.y.clamp(-1.0, 1.0));
        let up =
            up - 0.2 * libm::sinf(2.0 * (up + 0.35)) + 0.2 * libm::sinf(0.7) * (1.0 - (up / (0.5 * PI)) * (up / (0.5 * PI)));
        let (sin, cos) = libm::sincosf(up.clamp(-0.5 * PI, 0.5 * PI));
        let (side, front) = libm::sincosf(around);
        MIDDLE + surface(Vec3::new(side * cos, sin, front * cos))
    })
}

/// The point of the surface, from the middle of the braincase, for a direction.
fn surface(d: Vec3) -> Vec3 {
    let front = smooth(-0.1, 0.75, d.z);
    let below = smooth(0.1, -0.75, d.y);
    // the braincase: long, flat below
    let mut p = d * Vec3::new(0.073, 0.088, 0.093);
    p.x *= 1.0 + 0.05 * smooth(0.1, -0.6, d.z);
    p.y += 0.014 * below * (1.0 - front) * smooth(0.2, -0.6, d.z);
    // the face goes down and narrows to the teeth
    let face = front * below;
    p.y -= 0.031 * face;
    p.z -= 0.004 * face;
    p.z += 0.026 * face * smooth(-0.2, -0.75, d.y) * (1.0 - smooth(0.04, 0.06, p.x.abs()));
    p.x *= 1.0 - 0.3 * face * smooth(-0.35, -0.9, d.y);
    let at = Vec2::new(p.x.abs(), p.y);
    let ahead = smooth(0.3, 0.6, d.z);
    // brows over the eyes, the eyes' hollows, cheekbones
    p.z += 0.007 * ahead * bump((at - Vec2::new(0.03, 0.014)).length_squared(), 0.018);
    let eye = (at - Vec2::new(0.0325, -0.0125)) * Vec2::new(1.0, 1.12);
    let hollow = ahead * smooth(0.0285, 0.009, eye.length());
    p.z -= 0.036 * hollow;
    p.x -= p.x.signum() * 0.006 * hollow;
    let cheek = ahead * bump((at - Vec2::new(0.051, -0.045)).length_squared(), 0.017);
    p.z += 0.007 * cheek;
    p.x += p.x.signum() * 0.006 * cheek;
    // below the cheeks it falls in
    let fallen = ahead * bump((at - Vec2::new(0.046, -0.082)).length_squared(), 0.018);
    p.x -= p.x.signum() * 0.008 * fallen;
    p.z -= 0.012 * fallen;
    // the nose: a ridge, and a pear-shaped hole
    p.z += 0.012 * ahead * bump(at.x * at.x, 0.0085) * smooth(-0.034, -0.022, at.y) * smooth(0.006, -0.014, at.y);
    let wide = 0.006 + 0.0085 * smooth(-0.032, -0.056, at.y);
    let nose = smooth(wide + 0.003, wide - 0.003, at.x) * smooth(-0.031, -0.036, at.y) * smooth(-0.064, -0.057, at.y);
    p.z -= 0.024 * ahead * nose;
    // the temples
    let temple = smooth(0.035, 0.065, p.x.abs()) * bump((Vec2::new(p.y + 0.012, p.z - 0.042)).length_squared(), 0.026);
    p.x -= p.x.signum() * 0.011 * temple;
    p
}
