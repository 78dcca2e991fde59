//! A mason's yard at work: things of stone that roll, turn, swing and pass, and shade one another.
//!
//! All stand on a slab whose top is at [`FLOOR`]. Nothing meets: the drum rolls along the back, the capital turns on its table,
//! the block swings from the crane's jib over the middle, the ball goes to and fro under the arch.

use crate::export::scene::{Channel, Clip, Interpolation, Node, Scene, SceneMesh, Track};
use crate::figures::shape::{Shape, sweep};
use crate::temple::noise::fbm;
use crate::{Material, Mesh, normals};
use glam::{Quat, Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// The length of the clip "day", seconds; its last keys are its first.
pub const LOOP_S: f32 = 12.0;
/// Height of the slab on which all stands, metres.
pub const FLOOR: f32 = 0.15;

/// Edges where faces meet at more than this are hard.
const CREASE_RAD: f32 = 0.6;
/// How far apart vertices are at most, metres: light is computed at them. The slab's are farther apart.
const GRAIN: f32 = 0.05;
const SLAB_GRAIN: f32 = 0.075;
const MARBLE: Vec3 = Vec3::new(0.72, 0.69, 0.62);
const TUFF: Vec3 = Vec3::new(0.55, 0.43, 0.29);
const OAK: Vec3 = Vec3::new(0.24, 0.15, 0.08);
const HEMP: Vec3 = Vec3::new(0.42, 0.34, 0.21);

const DRUM_RADIUS: f32 = 0.42;
const DRUM_WAY: f32 = 1.5;
const BALL_RADIUS: f32 = 0.3;
const BALL_WAY: f32 = 1.25;
/// Half the arch's opening, and how high its sides are before they bend.
const ARCH_HALF: f32 = 0.5;
const ARCH_SIDES: f32 = 0.75;
/// Where the rope begins, over the slab, and how long it is down to the block's middle.
const ROPE_TOP: f32 = 2.55;
const ROPE: f32 = 1.75;
const SWING_RAD: f32 = 0.3;
/// Swings in a loop: a pendulum of this length takes 2.7 s for each in earth's gravity.
const SWINGS: usize = 4;

/// Makes the yard: slab, arch, ball, drum, capital with its table, crane with rope and block; marble, tuff, oak. The clip "day"
/// moves them by straight keys, and the crane's rope by a cubic curve.
#[must_use]
pub fn stoneyard() -> Scene {
    let mut scene = Scene::default();
    let floor = Vec3::Y * FLOOR;
    place(&mut scene, "slab", prism(Vec3::new(2.6, 0.5 * FLOOR, 2.15), SLAB_GRAIN), TUFF, None, Vec3::Y * (0.5 * FLOOR));
    place(&mut scene, "arch", arch(), MARBLE, None, floor + Vec3::new(-1.5, 0.0, 0.7));
    let ball = crate::figures::shape::ball(Vec3::ZERO, Vec3::splat(BALL_RADIUS), 25, 40);
    let ball = place(&mut scene, "ball", whole(ball), MARBLE, None, floor + Vec3::new(-1.5, BALL_RADIUS, 0.7));
    let drum = place(&mut scene, "drum", drum_mesh(), MARBLE, None, floor + Vec3::new(0.0, DRUM_RADIUS, -1.55));
    let table = place(
        &mut scene,
        "table",
        lathe(&[(0.36, 0.0), (0.36, 0.06), (0.2, 0.1), (0.2, 0.38), (0.38, 0.42), (0.38, 0.5)], 48, None),
        OAK,
        None,
        floor + Vec3::new(1.75, 0.0, 1.2),
    );
    let capital = place(&mut scene, "capital", capital_mesh(), MARBLE, Some(table), Vec3::Y * 0.501);
    let mast = Vec3::new(1.1, 0.0, -0.35);
    place(
        &mut scene,
        "mast",
        lathe(&[(0.13, 0.0), (0.13, 0.02), (0.09, 0.05), (0.075, 2.8)], 20, None),
        OAK,
        None,
        floor + mast,
    );
    let pole = |length: f32, radius: f32| {
        whole(sweep(&[([0.0; 3], radius, radius), ([length, 0.0, 0.0], 0.75 * radius, 0.75 * radius)], Vec3::Y, 32, 12))
    };
    let jib = scene.nodes.len();
    place(&mut scene, "jib", pole(1.28, 0.07), OAK, None, floor + mast + Vec3::new(0.0, ROPE_TOP + 0.08, 0.0));
    let rope = whole(sweep(&[([0.0; 3], 0.013, 0.013), ([0.0, -(ROPE - 0.24), 0.0], 0.013, 0.013)], Vec3::X, 32, 8));
    let rope = place(&mut scene, "rope", rope, HEMP, Some(jib), Vec3::new(1.2, -0.08, 0.0));
    place(&mut scene, "block", prism(Vec3::new(0.34, 0.24, 0.24), GRAIN), TUFF, Some(rope), Vec3::NEG_Y * ROPE);
    scene.clips = vec![Clip { name: "day".to_owned(), channels: motions(&scene, ball, drum, capital, jib, rope) }];
    scene
}

fn about(axis: Vec3, angle: f32) -> Quat {
    let (sin, cos) = libm::sincosf(0.5 * angle);
    Quat::from_xyzw(axis.x * sin, axis.y * sin, axis.z * sin, cos)
}

fn motions(scene: &Scene, ball: usize, drum: usize, capital: usize, jib: usize, rope: usize) -> Vec<Channel> {
    const KEYS: usize = 97;
    let share = |i: usize, keys: usize| i as f32 / (keys - 1) as f32;
    let times = |keys: usize| -> Vec<f32> { (0..keys).map(|i| LOOP_S * share(i, keys)).collect() };
    let linear = |node, track| Channel { node, times_s: times(KEYS), track, interpolation: Interpolation::Linear };
    // the last share is the first: not a rounding off
    let keys = |at: &dyn Fn(f32) -> f32| -> Vec<f32> { (0..KEYS).map(|i| at(share(i % (KEYS - 1), KEYS))).collect() };
    let rolled = keys(&|x| DRUM_WAY * libm::sinf(TAU * x));
    let gone = keys(&|x| BALL_WAY * libm::cosf(TAU * x));
    let (drum_at, ball_at) = (scene.nodes[drum].translation, scene.nodes[ball].translation);
    let turned = keys(&|x| TAU * x);
    // the jib points over the middle, to the left and front
    let slewed = keys(&|x| -0.7 * PI + 0.12 * libm::sinf(TAU * x));
    let vectors = |values: &[f32], at: Vec3, axis: Vec3| Track::Translation(values.iter().map(|&v| at + axis * v).collect());
    let turns = |values: &[f32], axis: Vec3, per: f32| Track::Rotation(values.iter().map(|&v| about(axis, v * per)).collect());
    // the rope swings along the jib: its angle's cosine, as slope and value at every quarter
    let swing_keys = 4 * SWINGS + 1;
    let mut swing = Vec::with_capacity(3 * swing_keys);
    for i in 0..swing_keys {
        let (angle, speed) = match i % 4 {
            0 => (SWING_RAD, 0.0),
            1 => (0.0, -1.0),
            2 => (-SWING_RAD, 0.0),
            _ => (0.0, 1.0),
        };
        // what a curve through the quarters of a cosine wants is the cosine's own slope
        let slope = speed * SWING_RAD * TAU * SWINGS as f32 / LOOP_S;
        let turn = about(Vec3::Z, angle);
        let tangent = Quat::from_xyzw(0.0, 0.0, 0.5 * slope * turn.w, -0.5 * slope * turn.z);
        swing.extend([tangent, turn, tangent]);
    }
    vec![
        linear(drum, vectors(&rolled, drum_at, Vec3::X)),
        linear(drum, turns(&rolled, Vec3::Z, -1.0 / DRUM_RADIUS)),
        linear(ball, vectors(&gone, ball_at, Vec3::Z)),
        linear(ball, turns(&gone, Vec3::X, 1.0 / BALL_RADIUS)),
        linear(capital, turns(&turned, Vec3::Y, 1.0)),
        linear(jib, turns(&slewed, Vec3::Y, 1.0)),
        Channel {
            node: rope,
            times_s: times(swing_keys),
            track: Track::Rotation(swing),
            interpolation: Interpolation::CubicSpline,
        },
    ]
}

/// Adds a node with a mesh of one albedo, grained like stone or wood; answers the node.
fn place(scene: &mut Scene, name: &str, mut mesh: Mesh, albedo: Vec3, parent: Option<usize>, at: Vec3) -> usize {
    let seed = scene.meshes.len() as u32 + 11;
    normals::split_creases(&mut mesh, CREASE_RAD);
    let tone = |p: &Vec3| {
        let light = 1.0 + 0.16 * fbm(seed, *p * 5.0, 4) + 0.05 * fbm(seed + 1, *p * 31.0, 2);
        (albedo * light).clamp(Vec3::ZERO, Vec3::ONE)
    };
    mesh.colors_linear = mesh.positions.iter().map(tone).collect();
    mesh.materials = vec![Material { name: name.to_owned(), base_color_linear: Vec3::ONE, texture: None }];
    scene.nodes.push(Node { mesh: Some(scene.meshes.len()), ..Node::at(name, at) });
    scene.meshes.push(SceneMesh { name: name.to_owned(), mesh, ..SceneMesh::default() });
    let node = scene.nodes.len() - 1;
    if let Some(parent) = parent {
        scene.nodes[parent].children.push(node);
    }
    node
}

fn whole(shape: Shape) -> Mesh {
    Mesh { positions: shape.positions, triangles: shape.triangles, ..Mesh::default() }
}

/// A box about the origin, half as large as said.
fn prism(half: Vec3, grain: f32) -> Mesh {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let cells = |i: usize| libm::ceilf(2.0 * half[i] / grain).max(1.0) as u32;
            let (nu, nv) = (cells(u), cells(v));
            let base = mesh.positions.len() as u32;
            for j in 0..=nv {
                for i in 0..=nu {
                    let mut p = Vec3::ZERO;
                    p[axis] = sign * half[axis];
                    p[u] = half[u] * (2.0 * i as f32 / nu as f32 - 1.0);
                    p[v] = half[v] * (2.0 * j as f32 / nv as f32 - 1.0);
                    mesh.positions.push(p);
                }
            }
            for j in 0..nv {
                for i in 0..nu {
                    let a = base + j * (nu + 1) + i;
                    let (b, c, d) = (a + 1, a + nu + 1, a + nu + 2);
                    mesh.triangles.extend(if sign > 0.0 { [[a, b, d], [a, d, c]] } else { [[a, d, b], [a, c, d]] });
                }
            }
        }
    }
    mesh
}

/// A solid turned about Y: radii and heights from the bottom's edge to the top's; `shape` changes a radius by its angle.
fn lathe(profile: &[(f32, f32)], sides: usize, shape: Option<&dyn Fn(f32, f32) -> f32>) -> Mesh {
    let mut rings = vec![(0.0, profile[0].1)];
    let corners: Vec<Vec2> = std::iter::once((0.0, profile[0].1))
        .chain(profile.iter().copied())
        .chain(profile.last().map(|p| (0.0, p.1)))
        .map(Vec2::from)
        .collect();
    for pair in corners.windows(2) {
        let steps = libm::ceilf(pair[0].distance(pair[1]) / GRAIN).max(1.0) as u32;
        rings.extend((1..=steps).map(|i| pair[0].lerp(pair[1], i as f32 / steps as f32)).map(|p| (p.x, p.y)));
    }
    // the poles are the first and the last ring
    let inner = &rings[1..rings.len() - 1];
    let mut mesh = Mesh { positions: vec![Vec3::Y * rings[0].1], ..Mesh::default() };
    for &(radius, y) in inner {
        for k in 0..sides {
            let angle = TAU * k as f32 / sides as f32;
            let (sin, cos) = libm::sincosf(angle);
            let r = radius * shape.map_or(1.0, |shape| shape(angle, y));
            mesh.positions.push(Vec3::new(r * sin, y, r * cos));
        }
    }
    mesh.positions.push(Vec3::Y * rings[rings.len() - 1].1);
    let at = |ring: usize, k: usize| (1 + ring * sides + k % sides) as u32;
    let last = mesh.positions.len() as u32 - 1;
    for k in 0..sides {
        mesh.triangles.push([0, at(0, k + 1), at(0, k)]);
        for ring in 0..inner.len() - 1 {
            let [a, b, c, d] = [at(ring, k), at(ring, k + 1), at(ring + 1, k), at(ring + 1, k + 1)];
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
        mesh.triangles.push([last, at(inner.len() - 1, k), at(inner.len() - 1, k + 1)]);
    }
    mesh
}

/// A fluted drum that lies along Z.
fn drum_mesh() -> Mesh {
    const FLUTES: f32 = 20.0;
    const HALF: f32 = 0.3;
    // twenty hollows with sharp edges between, as deep as Doric ones are
    let flute = |angle: f32, _: f32| {
        let across = angle * FLUTES / TAU;
        let x = 2.0 * (across - across.floor()) - 1.0;
        1.0 - 0.055 * (1.0 - x * x)
    };
    let mut mesh = lathe(&[(DRUM_RADIUS, -HALF), (DRUM_RADIUS, HALF)], 120, Some(&flute));
    mesh.positions.iter_mut().for_each(|p| *p = Vec3::new(p.x, -p.z, p.y));
    mesh
}

/// A Doric capital: neck, rings, cushion, and the square plate.
fn capital_mesh() -> Mesh {
    let cushion = [
        (0.2, 0.0),
        (0.195, 0.07),
        (0.205, 0.075),
        (0.205, 0.085),
        (0.198, 0.09),
        (0.215, 0.1),
        (0.255, 0.135),
        (0.29, 0.165),
        (0.307, 0.19),
        (0.3, 0.205),
    ];
    let mut mesh = lathe(&cushion, 64, None);
    let plate = prism(Vec3::new(0.33, 0.06, 0.33), GRAIN);
    let base = mesh.positions.len() as u32;
    mesh.positions.extend(plate.positions.iter().map(|&p| p + Vec3::Y * 0.26));
    mesh.triangles.extend(plate.triangles.iter().map(|t| t.map(|i| i + base)));
    mesh
}

/// An arch over a way along Z: a beam with a square section that goes up, round and down.
fn arch() -> Mesh {
    const THICK: f32 = 0.3;
    const DEEP_HALF: f32 = 0.25;
    let middle = ARCH_HALF + 0.5 * THICK;
    let round = PI * middle;
    let length = 2.0 * ARCH_SIDES + round;
    let steps = libm::ceilf(length / GRAIN) as usize;
    // place on the line, and the way outwards
    let line = |s: f32| {
        if s < ARCH_SIDES {
            (Vec2::new(-middle, s), Vec2::NEG_X)
        } else if s > ARCH_SIDES + round {
            (Vec2::new(middle, length - s), Vec2::X)
        } else {
            let (sin, cos) = libm::sincosf((s - ARCH_SIDES) / middle);
            let out = Vec2::new(-cos, sin);
            (out * middle + Vec2::Y * ARCH_SIDES, out)
        }
    };
    let (wide, deep) = ((THICK / GRAIN) as usize, (2.0 * DEEP_HALF / GRAIN) as usize);
    // the section's outline, outwards and along Z, counter-clockwise seen from ahead
    let mut outline = Vec::new();
    let (w, d) = (0.5 * THICK, DEEP_HALF);
    let corners = [Vec2::new(-w, -d), Vec2::new(w, -d), Vec2::new(w, d), Vec2::new(-w, d)];
    for side in 0..4 {
        let count = if side % 2 == 0 { wide } else { deep };
        outline.extend((0..count).map(|i| corners[side].lerp(corners[(side + 1) % 4], i as f32 / count as f32)));
    }
    let sides = outline.len();
    let mut mesh = Mesh::default();
    for i in 0..=steps {
        let (at, out) = line(length * i as f32 / steps as f32);
        mesh.positions.extend(outline.iter().map(|o| (at + out * o.x).extend(o.y)));
    }
    let at = |i: usize, k: usize| (i * sides + k % sides) as u32;
    for i in 0..steps {
        for k in 0..sides {
            let [a, b, c, d] = [at(i, k), at(i, k + 1), at(i + 1, k), at(i + 1, k + 1)];
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    // the feet stand on the slab: fans do
    for k in 1..sides - 1 {
        mesh.triangles.push([at(0, 0), at(0, k + 1), at(0, k)]);
        mesh.triangles.push([at(steps, 0), at(steps, k), at(steps, k + 1)]);
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figures::shape::volume;
    use crate::figures::tests::{assert_closed, assert_loops, glb_bytes};

    #[test]
    fn everything_is_closed_and_loops() {
        let scene = stoneyard();
        scene.validate().unwrap();
        assert_eq!(scene.meshes.len(), 10);
        for part in &scene.meshes {
            assert_closed(&part.name, &part.mesh);
            assert!(volume(&part.mesh.positions, &part.mesh.triangles) > 0.0, "{}", part.name);
        }
        assert_loops(&scene);
        assert!(scene.clips[0].channels.iter().any(|c| c.interpolation == Interpolation::CubicSpline));
        assert_eq!(glb_bytes(&scene), glb_bytes(&stoneyard()));
    }

    #[test]
    fn the_ball_passes_under_the_arch_and_the_drum_rolls() {
        let scene = stoneyard();
        const { assert!(BALL_RADIUS < ARCH_HALF && 2.0 * BALL_RADIUS < ARCH_SIDES) };
        // a wheel's lowest point stands still: the way is the turn times the radius
        let drum = scene.nodes.iter().position(|node| node.name == "drum").unwrap();
        let mut tracks = scene.clips[0].channels.iter().filter(|c| c.node == drum);
        let (Some(Track::Translation(way)), Some(Track::Rotation(turn))) =
            (tracks.next().map(|c| &c.track), tracks.next().map(|c| &c.track))
        else {
            panic!("the drum's tracks");
        };
        for i in 1..way.len() {
            let angle = 2.0 * (turn[i] * turn[i - 1].inverse()).xyz().length().asin();
            assert!((angle * DRUM_RADIUS - way[i].distance(way[i - 1])).abs() < 1e-4);
        }
    }
}
