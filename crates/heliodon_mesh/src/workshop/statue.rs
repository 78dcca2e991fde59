//! The colossal seated god: ivory skin, golden robe, Victory on his right hand, a sceptre in his left.
//!
//! Made in the figure's own space: he looks along +Z, his left is +X, height zero is the top of his footstool. Standing he would
//! be 11.2 m tall; the lengths of his limbs are those of a man, scaled.

use super::palette::{Material, Palette};
use super::pieces::{pole, smooth};
use crate::figures::shape::{Shape, Station, ball, pleated, sweep};
use crate::temple::solid::SolidMesh;
use glam::Vec3;
use std::f32::consts::TAU;

/// Sides and rings of large limbs.
const SIDES: usize = 14;
const RINGS: usize = 7;
/// Sides of pleated cloth: enough for its folds.
const CLOTH_SIDES: usize = 44;

/// The palm of the right hand, where Victory stands.
const PALM: Vec3 = Vec3::new(-1.92, 5.19, 2.28);
/// The sceptre's axis.
const SCEPTRE: (f32, f32) = (2.3, 1.68);

/// Folds of cloth: `count` around the piece, of a depth that grows along it from `near` to `far`.
fn folds(count: f32, near: f32, far: f32) -> impl Fn(f32, f32) -> f32 {
    move |along, angle| {
        let depth = near + (far - near) * along;
        // a second wave wanders along the piece, so that no two folds are alike
        let wave = libm::cosf(count * angle) + 0.55 * libm::cosf((count * 0.62).round() * angle + 2.6 * along + 0.7);
        1.0 + depth * wave
    }
}

/// A ring of leaves around a head.
fn wreath(centre: Vec3, radius: f32, tube: f32) -> Shape {
    const AROUND: usize = 24;
    const SECTION: usize = 5;
    let mut shape = Shape::default();
    for i in 0..AROUND {
        let (sin, cos) = libm::sincosf(TAU * i as f32 / AROUND as f32);
        let outwards = Vec3::new(sin, 0.0, cos);
        // leaves: every second ring stands out
        let wide = tube * if i % 2 == 0 { 1.25 } else { 0.7 };
        for k in 0..SECTION {
            let (s, c) = libm::sincosf(TAU * k as f32 / SECTION as f32);
            // higher behind than over the forehead
            let tilt = Vec3::Y * (-0.22 * radius * cos);
            shape.positions.push(centre + tilt + outwards * (radius + wide * 0.6 * c) + Vec3::Y * (wide * s));
        }
    }
    let at = |i: usize, k: usize| ((i % AROUND) * SECTION + k % SECTION) as u32;
    for i in 0..AROUND {
        for k in 0..SECTION {
            let [a, b, c, d] = [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)];
            shape.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    shape
}

/// A bearded head whose middle is `centre`, one unit being a metre of the statue; skin, then hair.
pub fn head(centre: Vec3) -> (Vec<Shape>, Vec<Shape>) {
    let at = |x: f32, y: f32, z: f32| centre + Vec3::new(x, y, z);
    let station = |x: f32, y: f32, z: f32, wide: f32, thick: f32| -> Station { (at(x, y, z).to_array(), wide, thick) };
    let skin = vec![
        ball(at(0.0, 0.0, 0.0), Vec3::new(0.53, 0.68, 0.62), 12, 16),
        ball(at(0.0, -0.38, 0.17), Vec3::new(0.41, 0.35, 0.41), 8, 14),
        sweep(
            &[
                station(0.0, 0.16, 0.57, 0.06, 0.06),
                station(0.0, -0.04, 0.66, 0.085, 0.09),
                station(0.0, -0.18, 0.64, 0.13, 0.07),
            ],
            Vec3::X,
            6,
            8,
        ),
        sweep(
            &[
                station(-0.4, 0.16, 0.42, 0.09, 0.09),
                station(0.0, 0.22, 0.57, 0.09, 0.08),
                station(0.4, 0.16, 0.42, 0.09, 0.09),
            ],
            Vec3::Y,
            9,
            8,
        ),
        ball(at(0.0, -0.36, 0.55), Vec3::new(0.15, 0.06, 0.09), 4, 8),
    ];
    let curls = |along: f32, angle: f32| 1.0 + 0.07 * libm::cosf(9.0 * angle + 9.0 * along) * (1.0 - along * along);
    let beard = pleated(
        &[
            station(0.0, -0.25, 0.27, 0.46, 0.3),
            station(0.0, -0.52, 0.35, 0.45, 0.33),
            station(0.0, -0.85, 0.36, 0.32, 0.26),
            station(0.0, -1.08, 0.33, 0.12, 0.12),
        ],
        Vec3::X,
        9,
        27,
        curls,
    );
    let lock = sweep(
        &[station(0.47, -0.1, -0.2, 0.2, 0.22), station(0.6, -0.72, -0.14, 0.17, 0.16), station(0.68, -1.2, 0.16, 0.09, 0.08)],
        Vec3::X,
        7,
        10,
    );
    let mirrored = lock.clone().moved(|p| p - centre).mirrored().moved(|p| p + centre);
    let hair = vec![ball(at(0.0, 0.13, -0.16), Vec3::new(0.62, 0.66, 0.62), 8, 14), beard, lock, mirrored];
    (skin, hair)
}

/// A limb with its mirror image on the other side.
fn both(shape: Shape) -> [Shape; 2] {
    let other = shape.mirrored();
    [shape, other]
}

/// Trunk, arms, feet.
fn body() -> Vec<Shape> {
    let limb = |stations: &[Station]| sweep(stations, Vec3::X, RINGS, SIDES);
    let mut skin = vec![
        sweep(
            &[
                ([0.0, 3.1, -0.35], 1.15, 0.85),
                ([0.0, 4.2, -0.3], 1.0, 0.72),
                ([0.0, 5.2, -0.24], 1.14, 0.78),
                ([0.0, 6.05, -0.18], 1.36, 0.82),
                ([0.0, 6.62, -0.2], 1.22, 0.62),
                ([0.0, 6.95, -0.15], 0.6, 0.46),
            ],
            Vec3::X,
            14,
            20,
        ),
        sweep(
            &[([0.0, 6.6, -0.2], 0.52, 0.46), ([0.0, 7.15, -0.05], 0.41, 0.42), ([0.0, 7.6, 0.06], 0.42, 0.44)],
            Vec3::X,
            7,
            18,
        ),
        ball(Vec3::new(0.0, 4.75, 0.18), Vec3::new(0.72, 0.62, 0.36), 6, 12),
        // the right arm rests, palm upwards
        limb(&[([-1.4, 6.48, -0.2], 0.46, 0.46), ([-1.76, 5.62, -0.02], 0.43, 0.43), ([-2.0, 4.88, 0.35], 0.33, 0.33)]),
        limb(&[([-2.0, 4.9, 0.2], 0.34, 0.33), ([-2.02, 4.93, 1.0], 0.35, 0.33), ([-1.95, 5.06, 1.95], 0.21, 0.18)]),
        sweep(
            &[([-1.95, 5.06, 1.85], 0.2, 0.16), ([-1.92, 5.08, 2.25], 0.29, 0.13), ([-1.88, 5.1, 2.72], 0.2, 0.07)],
            Vec3::X,
            8,
            14,
        ),
        // the left is raised and holds the sceptre
        limb(&[([1.4, 6.48, -0.2], 0.46, 0.46), ([1.95, 5.9, 0.12], 0.41, 0.41), ([2.3, 5.42, 0.58], 0.33, 0.33)]),
        limb(&[([2.3, 5.38, 0.5], 0.34, 0.34), ([2.35, 6.0, 1.04], 0.33, 0.31), ([2.31, 6.78, 1.5], 0.2, 0.2)]),
        ball(Vec3::new(SCEPTRE.0, 6.98, SCEPTRE.1 - 0.04), Vec3::new(0.24, 0.25, 0.26), 8, 12),
    ];
    skin.extend(both(ball(Vec3::new(0.52, 5.92, 0.34), Vec3::new(0.6, 0.42, 0.36), 6, 12)));
    skin.extend(both(ball(Vec3::new(1.36, 6.4, -0.2), Vec3::new(0.54, 0.55, 0.53), 6, 12)));
    let foot = sweep(
        &[
            ([0.95, 0.23, 2.5], 0.25, 0.24),
            ([0.97, 0.27, 3.1], 0.3, 0.28),
            ([1.02, 0.17, 3.62], 0.36, 0.18),
            ([1.05, 0.1, 4.02], 0.27, 0.1),
        ],
        Vec3::X,
        8,
        12,
    );
    // the left foot is a little before the right one
    let [left, right] = both(foot);
    skin.extend([left.moved(|p| p + Vec3::Z * 0.22), right]);
    skin
}

/// The robe: over the legs, rolled about the hips, over the left shoulder, and down from the left arm.
fn robe() -> Vec<Shape> {
    let knees = pleated(
        &[
            ([0.72, 3.34, -0.4], 0.8, 0.8),
            ([0.86, 3.36, 1.2], 0.76, 0.74),
            ([1.0, 3.2, 2.55], 0.62, 0.6),
            ([1.02, 2.55, 3.0], 0.57, 0.56),
            ([1.0, 1.5, 3.0], 0.52, 0.54),
            ([0.97, 0.3, 2.95], 0.44, 0.42),
        ],
        Vec3::X,
        12,
        26,
        folds(8.0, 0.012, 0.045),
    );
    let [left, right] = both(knees);
    vec![
        left.moved(|p| p + Vec3::Z * (0.22 * (1.0 - p.y / 3.6).max(0.0))),
        right,
        pleated(
            &[
                ([0.0, 3.2, -0.85], 1.4, 0.82),
                ([0.0, 3.3, 0.4], 1.6, 0.78),
                ([0.0, 3.15, 1.6], 1.62, 0.62),
                ([0.0, 2.6, 2.5], 1.5, 0.48),
                ([0.0, 1.6, 2.72], 1.36, 0.42),
                ([0.0, 0.36, 2.8], 1.5, 0.52),
            ],
            Vec3::X,
            18,
            CLOTH_SIDES,
            folds(11.0, 0.012, 0.085),
        ),
        pleated(
            &[
                ([-1.3, 3.75, -0.5], 0.3, 0.34),
                ([-0.95, 3.98, 0.35], 0.33, 0.3),
                ([-0.2, 4.12, 0.62], 0.34, 0.3),
                ([0.6, 4.22, 0.6], 0.34, 0.32),
                ([1.2, 4.35, 0.12], 0.4, 0.34),
            ],
            Vec3::Y,
            10,
            20,
            folds(6.0, 0.05, 0.07),
        ),
        pleated(
            &[
                ([1.1, 3.5, 0.1], 0.8, 0.4),
                ([1.04, 4.8, 0.38], 0.62, 0.3),
                ([0.92, 5.9, 0.5], 0.52, 0.24),
                ([0.9, 6.75, 0.12], 0.52, 0.2),
                ([0.92, 6.5, -0.62], 0.56, 0.2),
                ([0.9, 5.2, -0.92], 0.62, 0.18),
                ([0.8, 3.3, -0.9], 0.64, 0.18),
            ],
            Vec3::X,
            18,
            20,
            folds(7.0, 0.06, 0.06),
        ),
        pleated(
            &[([2.2, 5.55, 0.28], 0.42, 0.36), ([2.4, 4.7, 0.25], 0.34, 0.36), ([2.42, 3.2, 0.3], 0.3, 0.46)],
            Vec3::X,
            8,
            20,
            folds(7.0, 0.03, 0.1),
        ),
    ]
}

/// Victory, 1.8 m tall: skin, then gold.
fn victory() -> (Vec<Shape>, Vec<Shape>) {
    let at = |x: f32, y: f32, z: f32| PALM + Vec3::new(x, y, z);
    let station = |x: f32, y: f32, z: f32, wide: f32, thick: f32| -> Station { (at(x, y, z).to_array(), wide, thick) };
    let robe = pleated(
        &[
            station(0.0, 0.03, -0.02, 0.36, 0.32),
            station(0.0, 0.5, 0.02, 0.25, 0.23),
            station(0.0, 0.92, 0.03, 0.2, 0.18),
            station(0.0, 1.12, 0.0, 0.17, 0.14),
            station(0.0, 1.38, 0.0, 0.21, 0.15),
            station(0.0, 1.5, 0.0, 0.1, 0.09),
        ],
        Vec3::X,
        8,
        18,
        |along, angle| 1.0 + 0.1 * (1.0 - along) * libm::cosf(9.0 * angle),
    );
    let wing = sweep(
        &[
            station(0.06, 1.02, -0.14, 0.09, 0.06),
            station(0.26, 1.34, -0.25, 0.19, 0.07),
            station(0.46, 1.72, -0.34, 0.17, 0.06),
            station(0.6, 2.1, -0.4, 0.06, 0.04),
        ],
        Vec3::new(1.0, -1.0, 0.0),
        8,
        8,
    );
    let arm = sweep(
        &[station(0.19, 1.36, 0.0, 0.06, 0.06), station(0.3, 1.1, 0.14, 0.05, 0.05), station(0.2, 1.16, 0.4, 0.04, 0.04)],
        Vec3::X,
        7,
        8,
    );
    let mirror = |shape: &Shape| shape.clone().moved(|p| p - PALM).mirrored().moved(|p| p + PALM);
    let skin = vec![
        mirror(&arm),
        arm,
        ball(at(0.0, 1.66, 0.02), Vec3::new(0.11, 0.145, 0.125), 8, 12),
        sweep(&[station(0.0, 1.44, 0.0, 0.06, 0.06), station(0.0, 1.6, 0.0, 0.055, 0.055)], Vec3::X, 3, 8),
    ];
    let hair = ball(at(0.0, 1.69, -0.03), Vec3::new(0.125, 0.13, 0.13), 6, 10);
    (skin, vec![robe, mirror(&wing), wing, hair])
}

/// The sceptre, with an eagle on it.
fn sceptre(core: Vec3) -> Vec<SolidMesh> {
    let (x, z) = SCEPTRE;
    let at = |dx: f32, y: f32, dz: f32| Vec3::new(x + dx, y, z + dz);
    let wing = |way: f32| {
        let station = |dx: f32, y: f32, dz: f32, wide: f32| -> Station { (at(way * dx, y, dz).to_array(), wide, 0.045) };
        let line = [station(0.03, 8.56, 0.0, 0.08), station(0.2, 8.66, -0.05, 0.11), station(0.38, 8.73, -0.09, 0.05)];
        sweep(&line, Vec3::new(way, -1.0, 0.0), 7, 8)
    };
    let mut solids = vec![
        pole(at(0.0, -0.47, 0.0), at(0.0, 8.36, 0.0), (0.075, 0.06), 12, core),
        smooth(ball(at(0.0, 8.36, 0.0), Vec3::new(0.16, 0.1, 0.16), 6, 12), core),
    ];
    let body = ball(at(0.0, 8.6, 0.02), Vec3::new(0.11, 0.2, 0.14), 8, 10);
    let beak = ball(at(0.0, 8.8, 0.09), Vec3::new(0.07, 0.075, 0.1), 6, 8);
    solids.extend([body, beak, wing(1.0), wing(-1.0)].map(|shape| smooth(shape, core)));
    solids
}

/// The figure with what it holds, part by part, still bare: the wooden core that ivory, glass and gold will cover.
pub fn figure(palette: &mut Palette) -> Vec<(&'static str, Vec<SolidMesh>)> {
    let core = palette.pick(Material::Plank);
    let bare = |shapes: Vec<Shape>| shapes.into_iter().map(|shape| smooth(shape, core)).collect::<Vec<_>>();
    let centre = Vec3::new(0.0, 7.95, 0.16);
    let (face, mut hair) = head(centre);
    hair.push(wreath(centre + Vec3::new(0.0, 0.36, -0.1), 0.62, 0.1));
    let (mut winged, of_gold) = victory();
    winged.extend(of_gold);
    vec![
        ("zeus-face", bare(face)),
        ("zeus-body", bare(body())),
        ("zeus-hair", bare(hair)),
        ("zeus-robe", bare(robe())),
        ("zeus-victory", bare(winged)),
        ("zeus-sceptre", sceptre(core)),
    ]
}
