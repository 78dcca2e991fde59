//! The bones: closed pieces, each bound to the joints that carry it.

use super::follows::Follows;
use super::rig::{Core, Limb, Side, core, limb};
use super::skull;
use crate::export::scene::SceneMesh;
use crate::figures::shape::{Shape, Station, ball, smoothstep, sweep};
use crate::temple::noise::fbm;
use crate::{Material, Mesh, normals};
use glam::Vec3;

/// Linear albedo of dry bone.
const BONE: Vec3 = Vec3::new(0.74, 0.67, 0.54);

#[derive(Default)]
struct Skeleton {
    mesh: Mesh,
    joints: Vec<[u8; 4]>,
    weights: Vec<[f32; 4]>,
}

impl Skeleton {
    fn add(&mut self, shape: &Shape, follows: Follows) {
        let base = self.mesh.positions.len() as u32;
        self.mesh.positions.extend_from_slice(&shape.positions);
        self.mesh.triangles.extend(shape.triangles.iter().map(|t| t.map(|i| i + base)));
        for &along in &shape.along {
            let (joints, weights) = follows.at(along);
            self.joints.push(joints);
            self.weights.push(weights);
        }
        // every bone a little different, its ends, where there was gristle, darker
        let tone = fbm(7, shape.positions[0] * 40.0, 1);
        for (&p, &along) in shape.positions.iter().zip(&shape.along) {
            let ends = (2.0 * along - 1.0).abs();
            let spots = fbm(3, p * 55.0, 3);
            let light = 1.0 + 0.06 * tone + 0.12 * spots - 0.05 * ends * ends;
            let warm = 0.04 * spots + 0.05 * ends * ends;
            self.mesh
                .colors_linear
                .push((BONE * light * Vec3::new(1.0, 1.0 - 0.5 * warm, 1.0 - warm)).clamp(Vec3::ZERO, Vec3::ONE));
        }
    }

    /// A bone of the left, and its mirror.
    fn add_pair(&mut self, shape: &Shape, follows: impl Fn(Side) -> Follows) {
        self.add(shape, follows(Side::Left));
        self.add(&shape.mirrored(), follows(Side::Right));
    }

    fn pair_of(&mut self, shape: &Shape, joint: Limb) {
        self.add_pair(shape, |side| Follows::one(limb(side, joint)));
    }
}

/// The whole skeleton at rest.
pub fn skeleton() -> SceneMesh {
    let mut all = Skeleton::default();
    head(&mut all);
    spine(&mut all);
    ribs(&mut all);
    shoulders(&mut all);
    pelvis(&mut all);
    arms(&mut all);
    hands(&mut all);
    legs(&mut all);
    feet(&mut all);
    let Skeleton { mut mesh, joints, weights } = all;
    normals::compute(&mut mesh);
    mesh.materials = vec![Material { name: "bone".to_owned(), base_color_linear: Vec3::ONE, texture: None }];
    SceneMesh { name: "skeleton".to_owned(), mesh, joints, weights, targets: Vec::new() }
}

fn head(all: &mut Skeleton) {
    let head = Follows::one(core(Core::Head));
    let jaw = Follows::one(core(Core::Jaw));
    all.add(&skull::skull(), head);
    // the arch from the cheek to the ear
    let arch = sweep(
        &[([0.055, 1.62, 0.058], 0.006, 0.005), ([0.069, 1.617, 0.034], 0.006, 0.004), ([0.066, 1.62, 0.002], 0.006, 0.004)],
        Vec3::Y,
        5,
        5,
    );
    all.add_pair(&arch, |_| head);
    // the lower jaw, from one ear round the chin to the other
    let half: [Station; 5] = [
        ([0.052, 1.612, 0.006], 0.011, 0.0045),
        ([0.052, 1.575, 0.005], 0.018, 0.0045),
        ([0.046, 1.551, 0.02], 0.016, 0.005),
        ([0.034, 1.542, 0.05], 0.0145, 0.006),
        ([0.02, 1.538, 0.073], 0.0155, 0.0065),
    ];
    let mirrored = half.iter().rev().map(|&(p, a, b)| ([-p[0], p[1], p[2]], a, b));
    let whole: Vec<Station> = half.into_iter().chain([([0.0, 1.536, 0.081], 0.0175, 0.0085)]).chain(mirrored).collect();
    all.add(&sweep(&whole, Vec3::new(0.0, 0.8, 0.6), 21, 7), jaw);
    for (y, outer, follows) in [(1.5685, 0.0, head), (1.5555, -0.0015, jaw)] {
        all.add(&teeth(y, outer), follows);
    }
}

/// A row of teeth: an arch whose height and depth swell at every tooth.
fn teeth(y: f32, outer: f32) -> Shape {
    const TEETH: usize = 12;
    let arch = |t: f32| {
        let (sin, cos) = libm::sincosf(std::f32::consts::PI * (t - 0.5));
        [(0.0275 + outer) * sin, y, 0.043 + (0.042 + outer) * cos]
    };
    let stations: Vec<Station> = (0..=2 * TEETH)
        .map(|i| {
            let between = i % 2 == 0;
            (arch(i as f32 / (2 * TEETH) as f32), if between { 0.0048 } else { 0.0072 }, if between { 0.0024 } else { 0.0042 })
        })
        .collect();
    sweep(&stations, Vec3::Y, 2 * TEETH + 1, 5)
}

/// The middle of the spine's bodies, from the sacrum's top to the skull.
fn spine_line(y: f32) -> f32 {
    // hollow at the loins, round at the ribs, hollow at the neck
    const LINE: [(f32, f32); 8] = [
        (1.0, -0.036),
        (1.06, -0.026),
        (1.13, -0.03),
        (1.22, -0.055),
        (1.32, -0.075),
        (1.42, -0.062),
        (1.49, -0.034),
        (1.58, -0.018),
    ];
    let i = LINE.iter().rposition(|(at, _)| *at <= y).unwrap_or(0).min(LINE.len() - 2);
    let ((y0, z0), (y1, z1)) = (LINE[i], LINE[i + 1]);
    let x = ((y - y0) / (y1 - y0)).clamp(0.0, 1.0);
    z0 + (z1 - z0) * x * x * (3.0 - 2.0 * x)
}

/// What is at a height of the trunk follows: the joints below and above it, by how near they are.
fn trunk(y: f32) -> Follows {
    const JOINTS: [(Core, f32); 6] = [
        (Core::Pelvis, 1.0),
        (Core::Lumbar, 1.08),
        (Core::Thorax, 1.2),
        (Core::Chest, 1.36),
        (Core::Neck, 1.52),
        (Core::Head, 1.6),
    ];
    let i = JOINTS.iter().rposition(|(_, at)| *at <= y).unwrap_or(0).min(JOINTS.len() - 2);
    let x = ((y - JOINTS[i].1) / (JOINTS[i + 1].1 - JOINTS[i].1)).clamp(0.0, 1.0);
    Follows::mix(core(JOINTS[i].0), core(JOINTS[i + 1].0), smoothstep(x))
}

fn spine(all: &mut Skeleton) {
    const VERTEBRAE: usize = 24;
    let mut y = 1.012;
    for i in 0..VERTEBRAE {
        // loins 0..5, ribs 5..17, neck 17..24
        let size = 1.0 - i as f32 / (VERTEBRAE - 1) as f32;
        let pitch = 0.0142 + 0.0188 * size;
        let middle = y + 0.5 * pitch;
        y += pitch;
        let z = spine_line(middle);
        let lean = (spine_line(middle + 0.01) - spine_line(middle - 0.01)) / 0.02;
        let (half, r) = (0.36 * pitch, 0.0105 + 0.0125 * size);
        let follows = trunk(middle);
        let body = [
            ([0.0, middle - half, z - lean * half], r * 1.18, r * 0.95),
            ([0.0, middle, z], r * 1.0, r * 0.82),
            ([0.0, middle + half, z + lean * half], r * 1.15, r * 0.92),
        ];
        all.add(&sweep(&body, Vec3::X, 3, 8), follows);
        // the thorn to the back: level at the loins, steep at the ribs, short at the neck
        let (long, sink) = match i {
            0..5 => (0.034, 0.010),
            5..17 => (0.034, 0.026),
            17 => (0.034, 0.012),
            _ => (0.018, 0.008),
        };
        let root = z - r * 0.7;
        let thorn = [
            ([0.0, middle, root], 0.005, 0.0055),
            ([0.0, middle - 0.4 * sink, root - 0.55 * long], 0.0032, 0.006),
            ([0.0, middle - sink, root - long], 0.0042, 0.0075),
        ];
        all.add(&sweep(&thorn, Vec3::X, 3, 4), follows);
        let (wide, back) = match i {
            0..5 => (0.040, 0.012),
            5..17 => (0.027 + 0.001 * (i as f32 - 5.0), 0.018),
            _ => (0.023, 0.006),
        };
        let wing = |x: f32, back: f32, thick: f32| ([x, middle + 0.002, z - 0.75 * r - back], thick, thick * 0.9);
        let wings = [
            wing(-wide, back, 0.0045),
            wing(-0.4 * wide, 0.3 * back, 0.0035),
            wing(0.4 * wide, 0.3 * back, 0.0035),
            wing(wide, back, 0.0045),
        ];
        all.add(&sweep(&wings, Vec3::Y, 4, 4), follows);
    }
}

fn ribs(all: &mut Skeleton) {
    // the breastbone: handle, body, and the small tip
    let breastbone = [
        ([0.0, 1.428, 0.037], 0.026, 0.006),
        ([0.0, 1.392, 0.054], 0.019, 0.006),
        ([0.0, 1.36, 0.064], 0.014, 0.005),
        ([0.0, 1.31, 0.075], 0.018, 0.005),
        ([0.0, 1.265, 0.079], 0.016, 0.005),
        ([0.0, 1.235, 0.078], 0.006, 0.003),
    ];
    all.add(&sweep(&breastbone, Vec3::X, 8, 6), trunk(1.36));
    for i in 0..12 {
        let t = i as f32 / 11.0;
        // where it leaves the spine, how wide and deep it swings, how far it falls to the front
        let y = 1.442 - 0.305 * t;
        let z = spine_line(y) - 0.012;
        let barrel = libm::sinf(std::f32::consts::PI * (0.2 + 0.62 * t).min(1.0));
        let wide = 0.058 + 0.078 * barrel - 0.004 * t;
        let front = (0.046 + 0.04 * libm::sinf(std::f32::consts::PI * (0.12 + 0.6 * t))) - 0.02 * t * t;
        let fall = 0.03 + 0.085 * (1.0 - (1.0 - t) * (1.0 - t));
        let (flat, thin) = (0.0068 - 0.0012 * t, 0.0033);
        let mut line: Vec<Station> = vec![
            ([0.014, y, z], flat * 0.8, thin),
            ([0.3 * wide, y + 0.004, z - 0.022], flat, thin),
            ([0.72 * wide, y - 0.12 * fall, z - 0.013], flat, thin),
            ([0.97 * wide, y - 0.42 * fall, z + 0.035], flat, thin),
            ([wide, y - 0.68 * fall, 0.5 * (z + front) + 0.008], flat, thin),
            ([0.86 * wide, y - 0.92 * fall, front - 0.022], flat, thin),
        ];
        match i {
            // gristle leads to the breastbone: level above, up to it below
            0..7 => {
                let to = 1.412 - 0.026 * i as f32;
                let depth = 0.042 + 0.0055 * i as f32;
                let edge = y - fall;
                line.push((
                    [0.55 * wide, edge.min(to) - 0.006 * t, (front + 0.008).min(depth + 0.012)],
                    flat * 0.95,
                    thin * 1.2,
                ));
                line.push(([0.02, to, depth], flat * 0.9, thin * 1.3));
            }
            // these lean on the one above
            7..10 => {
                let late = (i - 7) as f32;
                line.push(([0.62 * wide, y - fall * 0.98 + 0.002, front - 0.004], flat * 0.9, thin * 1.2));
                line.push(([0.034 + 0.017 * late, 1.222 - 0.026 * late, 0.07 - 0.006 * late], flat * 0.8, thin * 1.2));
            }
            // the last two end in the flesh
            10 => line.truncate(5),
            _ => line.truncate(4),
        }
        let rings = [13, 10][usize::from(i >= 10)];
        let (begin, end) = (trunk(y), trunk(y - 0.55 * fall));
        all.add_pair(&sweep(&line, Vec3::Y, rings, 5), |_| Follows::from_to(begin, end));
    }
}

fn shoulders(all: &mut Skeleton) {
    let clavicle = [
        ([0.018, 1.427, 0.036], 0.0085, 0.0085),
        ([0.06, 1.437, 0.047], 0.006, 0.006),
        ([0.11, 1.446, 0.03], 0.0055, 0.0055),
        ([0.15, 1.446, -0.004], 0.007, 0.005),
        ([0.163, 1.444, -0.024], 0.008, 0.005),
    ];
    let chest = Follows::one(core(Core::Chest));
    let at_shoulder = |side| Follows::one(limb(side, Limb::Clavicle));
    all.add_pair(&sweep(&clavicle, Vec3::Z, 9, 6), |side| Follows::from_to(chest, at_shoulder(side)));
    // the blade: a thin triangle on the ribs, its ridge, and the socket
    let blade = [
        ([0.098, 1.29, -0.122], 0.008, 0.003),
        ([0.1, 1.325, -0.124], 0.026, 0.0032),
        ([0.104, 1.365, -0.118], 0.04, 0.0035),
        ([0.11, 1.4, -0.104], 0.048, 0.0042),
        ([0.112, 1.428, -0.084], 0.04, 0.0035),
    ];
    all.add_pair(&sweep(&blade, Vec3::new(0.85, 0.0, 0.45), 8, 8), at_shoulder);
    let ridge = [
        ([0.066, 1.398, -0.124], 0.005, 0.004),
        ([0.11, 1.418, -0.122], 0.009, 0.005),
        ([0.155, 1.44, -0.085], 0.009, 0.005),
        ([0.176, 1.441, -0.036], 0.013, 0.005),
    ];
    all.add_pair(&sweep(&ridge, Vec3::new(0.3, 0.3, -0.9), 8, 6), at_shoulder);
    let socket = ball(Vec3::new(0.153, 1.402, -0.045), Vec3::new(0.012, 0.02, 0.014), 4, 6);
    all.add_pair(&socket, at_shoulder);
}

fn pelvis(all: &mut Skeleton) {
    let hip = Follows::one(core(Core::Pelvis));
    let sacrum = [
        ([0.0, 1.012, -0.04], 0.05, 0.024),
        ([0.0, 0.975, -0.062], 0.042, 0.018),
        ([0.0, 0.935, -0.078], 0.028, 0.012),
        ([0.0, 0.9, -0.075], 0.014, 0.008),
        ([0.0, 0.875, -0.06], 0.006, 0.005),
    ];
    all.add(&sweep(&sacrum, Vec3::X, 9, 10), hip);
    // the wing: from the socket up, flaring to the crest
    let wing = [
        ([0.082, 0.925, -0.006], 0.026, 0.019),
        ([0.082, 0.955, -0.018], 0.037, 0.012),
        ([0.096, 0.99, -0.014], 0.064, 0.006),
        ([0.114, 1.025, -0.008], 0.076, 0.006),
        ([0.123, 1.046, -0.004], 0.062, 0.0075),
    ];
    all.add_pair(&sweep(&wing, Vec3::new(-0.42, 0.12, 1.0), 10, 12), |_| hip);
    // from the wing to the sacrum
    let joint =
        [([0.094, 0.99, -0.062], 0.026, 0.009), ([0.062, 0.98, -0.066], 0.03, 0.012), ([0.03, 0.97, -0.062], 0.022, 0.012)];
    all.add_pair(&sweep(&joint, Vec3::Y, 5, 7), |_| hip);
    // pubis and sitting bone, about their opening
    let arch: [Station; 8] = [
        ([0.078, 0.918, 0.018], 0.012, 0.013),
        ([0.045, 0.914, 0.046], 0.009, 0.008),
        ([0.016, 0.905, 0.056], 0.012, 0.01),
        ([0.014, 0.882, 0.048], 0.012, 0.008),
        ([0.036, 0.858, 0.022], 0.007, 0.006),
        ([0.056, 0.844, -0.01], 0.012, 0.012),
        ([0.066, 0.866, -0.034], 0.014, 0.013),
        ([0.08, 0.908, -0.026], 0.018, 0.014),
    ];
    all.add_pair(&sweep(&arch, Vec3::new(0.6, 0.2, 0.75), 15, 6), |_| hip);
    all.add(&ball(Vec3::new(0.0, 0.894, 0.054), Vec3::new(0.008, 0.018, 0.008), 4, 6), hip);
}

fn arms(all: &mut Skeleton) {
    let upper = [
        ([0.172, 1.412, -0.032], 0.019, 0.019),
        ([0.181, 1.39, -0.03], 0.021, 0.021),
        ([0.184, 1.35, -0.03], 0.0125, 0.0125),
        ([0.19, 1.26, -0.033], 0.0105, 0.0105),
        ([0.196, 1.17, -0.038], 0.0115, 0.0105),
        ([0.199, 1.125, -0.04], 0.023, 0.0115),
        ([0.2, 1.108, -0.04], 0.026, 0.013),
    ];
    all.pair_of(&sweep(&upper, Vec3::X, 11, 8), Limb::UpperArm);
    let ulna = [
        ([0.192, 1.126, -0.06], 0.0095, 0.0095),
        ([0.192, 1.1, -0.054], 0.0125, 0.011),
        ([0.197, 1.06, -0.052], 0.009, 0.009),
        ([0.206, 0.98, -0.046], 0.0075, 0.007),
        ([0.212, 0.9, -0.038], 0.006, 0.006),
        ([0.214, 0.874, -0.034], 0.0085, 0.008),
    ];
    all.pair_of(&sweep(&ulna, Vec3::X, 9, 6), Limb::Forearm);
    let radius = [
        ([0.212, 1.094, -0.034], 0.0105, 0.0105),
        ([0.212, 1.076, -0.034], 0.0075, 0.0075),
        ([0.22, 1.0, -0.02], 0.0075, 0.007),
        ([0.219, 0.91, -0.01], 0.009, 0.008),
        ([0.217, 0.874, -0.01], 0.0115, 0.0145),
    ];
    // what turns with the hand near it
    all.add_pair(&sweep(&radius, Vec3::X, 9, 6), |side| {
        let (arm, hand) = (limb(side, Limb::Forearm), limb(side, Limb::Hand));
        Follows::from_to(Follows::one(arm), Follows::mix(arm, hand, 0.25))
    });
}

fn hands(all: &mut Skeleton) {
    for (y, z) in [(0.862, -0.03), (0.862, -0.011), (0.85, -0.034), (0.85, -0.018), (0.849, -0.003)] {
        all.pair_of(&ball(Vec3::new(0.217, y, z), Vec3::new(0.0085, 0.0085, 0.0095), 3, 4), Limb::Hand);
    }
    // from the forefinger, which is foremost, to the little one
    for (finger, (shift, long)) in [(0.016, 0.97), (0.0, 1.06), (-0.0155, 1.0), (-0.03, 0.8)].into_iter().enumerate() {
        let z = -0.016 + shift;
        let knuckle = 0.775 - 0.004 * finger as f32 + if finger == 0 { -0.002 } else { 0.0 };
        let x = 0.22;
        let bone = |from: f32, to: f32, r: f32, z0: f32, z1: f32| {
            let middle = 0.5 * (from + to);
            sweep(
                &[
                    ([x, from, z0], r * 1.25, r * 1.2),
                    ([x, middle, 0.5 * (z0 + z1)], r * 0.8, r * 0.8),
                    ([x, to, z1], r * 1.15, r * 1.1),
                ],
                Vec3::Z,
                3,
                5,
            )
        };
        all.pair_of(&bone(0.842, knuckle + 0.002, 0.005, -0.017 + 0.62 * shift, z), Limb::Hand);
        let lengths = [0.041 * long, 0.026 * long, 0.019 * long];
        let spread = 0.1 * shift;
        let mut y = knuckle - 0.003;
        for (segment, &length) in lengths.iter().enumerate() {
            let r = 0.0045 - 0.0006 * segment as f32;
            let follows = if segment == 0 { Limb::Fingers } else { Limb::FingerTips };
            let out = |y: f32| z + spread * (knuckle - y) / 0.04;
            all.pair_of(&bone(y, y - length + 0.003, r, out(y), out(y - length)), follows);
            y -= length;
        }
    }
    let thumb = |from: [f32; 3], to: [f32; 3], r: f32| {
        let middle = std::array::from_fn(|i| 0.5 * (from[i] + to[i]));
        sweep(&[(from, r * 1.25, r * 1.2), (middle, r * 0.85, r * 0.8), (to, r * 1.15, r * 1.1)], Vec3::X, 3, 5)
    };
    all.pair_of(&thumb([0.213, 0.846, 0.008], [0.207, 0.811, 0.026], 0.0055), Limb::Thumb);
    all.pair_of(&thumb([0.2065, 0.808, 0.0275], [0.203, 0.782, 0.037], 0.005), Limb::Thumb);
    all.pair_of(&thumb([0.2025, 0.779, 0.038], [0.201, 0.758, 0.043], 0.0045), Limb::Thumb);
}

fn legs(all: &mut Skeleton) {
    let shaft = [
        ([0.136, 0.925, -0.012], 0.014, 0.016),
        ([0.13, 0.895, -0.008], 0.021, 0.018),
        ([0.124, 0.85, -0.002], 0.0165, 0.0165),
        ([0.116, 0.74, 0.006], 0.0135, 0.0145),
        ([0.104, 0.62, 0.004], 0.014, 0.015),
        ([0.094, 0.55, -0.002], 0.022, 0.017),
        ([0.089, 0.515, -0.005], 0.037, 0.024),
        ([0.088, 0.492, -0.008], 0.036, 0.027),
    ];
    all.pair_of(&sweep(&shaft, Vec3::X, 12, 10), Limb::Thigh);
    let neck = [
        ([0.126, 0.893, -0.006], 0.017, 0.015),
        ([0.108, 0.91, -0.002], 0.0125, 0.0125),
        ([0.094, 0.921, 0.0], 0.0155, 0.0155),
    ];
    all.pair_of(&sweep(&neck, Vec3::Z, 4, 8), Limb::Thigh);
    all.pair_of(&ball(Vec3::new(0.088, HIP_BALL, 0.0), Vec3::splat(0.0235), 5, 8), Limb::Thigh);
    // the kneecap goes half with the shin
    let cap = ball(Vec3::new(0.089, 0.505, 0.038), Vec3::new(0.02, 0.022, 0.009), 3, 7);
    all.add_pair(&cap, |side| Follows::mix(limb(side, Limb::Thigh), limb(side, Limb::Shin), 0.5));
    let tibia = [
        ([0.087, 0.474, -0.004], 0.037, 0.025),
        ([0.087, 0.452, -0.002], 0.034, 0.024),
        ([0.085, 0.41, 0.004], 0.0165, 0.0175),
        ([0.083, 0.3, 0.003], 0.0125, 0.0145),
        ([0.084, 0.18, 0.0], 0.0115, 0.0125),
        ([0.084, 0.115, 0.0], 0.0165, 0.0155),
        ([0.082, 0.094, 0.0], 0.0215, 0.017),
        ([0.068, 0.078, 0.002], 0.008, 0.009),
    ];
    all.pair_of(&sweep(&tibia, Vec3::X, 12, 8), Limb::Shin);
    let fibula = [
        ([0.121, 0.448, -0.018], 0.011, 0.011),
        ([0.121, 0.42, -0.02], 0.007, 0.007),
        ([0.118, 0.28, -0.014], 0.006, 0.006),
        ([0.113, 0.13, -0.01], 0.0065, 0.007),
        ([0.111, 0.085, -0.008], 0.009, 0.011),
        ([0.11, 0.068, -0.008], 0.006, 0.008),
    ];
    all.pair_of(&sweep(&fibula, Vec3::X, 9, 6), Limb::Shin);
}

const HIP_BALL: f32 = super::rig::HIP as f32;

fn feet(all: &mut Skeleton) {
    let x = 0.088;
    // heel: round where it rolls
    let heel = [
        ([x, 0.032, -0.062], 0.017, 0.017),
        ([x, 0.03, -0.045], 0.022, 0.0295),
        ([x, 0.042, -0.015], 0.018, 0.018),
        ([x + 0.006, 0.042, 0.02], 0.015, 0.015),
    ];
    all.pair_of(&sweep(&heel, Vec3::X, 9, 8), Limb::Foot);
    let ankle = [
        ([x - 0.002, 0.072, -0.018], 0.015, 0.009),
        ([x - 0.002, 0.073, 0.004], 0.018, 0.0165),
        ([x - 0.008, 0.06, 0.032], 0.014, 0.013),
    ];
    all.pair_of(&sweep(&ankle, Vec3::X, 5, 8), Limb::Foot);
    for (dx, y, z, r) in [(-0.016, 0.053, 0.05, 0.013), (0.001, 0.05, 0.05, 0.012), (0.018, 0.041, 0.045, 0.0125)] {
        all.pair_of(&ball(Vec3::new(x + dx, y, z), Vec3::new(0.01, r, 0.017), 3, 6), Limb::Foot);
    }
    // from the great toe outwards
    for toe in 0..5 {
        let t = toe as f32;
        let great = toe == 0;
        let root = Vec3::new(x - 0.02 + 0.0115 * t, 0.05 - 0.0055 * t, 0.064 - 0.003 * t);
        let knuckle = Vec3::new(x - 0.031 + 0.0175 * t, 0.0125, 0.125);
        let (r, thick) = if great { (0.009, 0.0088) } else { (0.006, 0.0058) };
        let middle = 0.5 * (root + knuckle) + Vec3::Y * 0.004;
        let end = Vec3::new(knuckle.x, 0.0125, knuckle.z);
        let metatarsal = [
            (root.to_array(), r * 1.15, thick * 1.3),
            (middle.to_array(), r * 0.75, thick * 0.75),
            (end.to_array(), r * 1.1, 0.0118),
        ];
        all.pair_of(&sweep(&metatarsal, Vec3::X, 5, 5), Limb::Foot);
        let long = [0.062, 0.058, 0.052, 0.046, 0.039][toe];
        let lie = if great { 0.0105 } else { 0.0085 };
        let bow = if great { 0.0 } else { 0.0055 };
        let mut at = knuckle + Vec3::Z * 0.009;
        let bones: &[f32] = if great { &[0.55, 0.45] } else { &[0.5, 0.27, 0.23] };
        let (mut done, count) = (0.0, bones.len());
        for (segment, share) in bones.iter().enumerate() {
            done += share;
            let height = if segment + 1 == count { lie - 0.001 } else { lie + bow };
            let to = Vec3::new(knuckle.x + (t - 1.5) * 0.002 * done, height, knuckle.z + 0.009 + long * done);
            let r = r * if segment == 0 { 0.85 } else { 0.8 };
            let inset = (to - at) * 0.06;
            let line = [
                ((at + inset).to_array(), r * 1.1, r * 1.05),
                (((at + to) * 0.5).to_array(), r * 0.75, r * 0.72),
                ((to - inset).to_array(), r, r * 0.95),
            ];
            all.pair_of(&sweep(&line, Vec3::X, 3, 5), Limb::Toes);
            at = to;
        }
    }
}
