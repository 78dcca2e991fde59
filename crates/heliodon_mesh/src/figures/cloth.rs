//! A curtain that hangs by its upper edge and moves in the wind.
//!
//! Macklin, Müller, Chentanez: "XPBD: Position-Based Simulation of Compliant Constrained Dynamics", MIG 2016; Macklin, Storey,
//! Lu, Terdiman, Chentanez, Jeschke, Müller: "Small Steps in Physics Simulation", SCA 2019 (one iteration a substep, many
//! substeps); Kim, Chentanez, Müller: "Long Range Attachments", SCA 2012 (no vertex farther from the rod than the cloth is long).
//!
//! Constraints are met one after another in a fixed order on one thread, with square roots and libm only: the same bits
//! everywhere. The wind has the loop's period, but folds do not fall twice alike: towards the end of the loop the cloth is pulled
//! to where it was a period ago, by the same solver. To fade one end into the other instead would crumple it, by 70 % of a
//! thread's length where folds differ.

use crate::figures::shape::smoothstep;
use crate::{Mesh, normals};
use glam::{Vec2, Vec3};
use heliodon_math::frame::unit_or;
use std::f32::consts::TAU;

/// Vertices along each side.
pub const SIDE: usize = 57;
/// Frames a second.
pub const FPS: f32 = 25.0;
/// Frames; the last is the first again, so that a loop lasts [`LOOP_S`] and a player that mixes frames meets no jump.
pub const FRAMES: usize = PERIOD_FRAMES + 1;
/// How long the motion lasts until it repeats, seconds.
pub const LOOP_S: f32 = PERIOD_FRAMES as f32 / FPS;

const PERIOD_FRAMES: usize = 100;
/// Frames at the loop's end over which it is led back to its beginning.
const RETURN_FRAMES: usize = 50;
/// What is left of the way at the end of a substep, at most: a tenth after a frame.
const RETURN_PULL: f32 = 0.15;
/// Frames that share what is left at the very end, less than a millimetre or two.
const MEND_FRAMES: usize = 10;
/// Rounds over the threads of each finished frame, which take out what stretch the small steps have left.
const TIGHTEN_ROUNDS: usize = 50;
/// How long a thread should be in a finished frame, of its length at rest.
const THREAD_RANGE: (f32, f32) = (0.96, 1.025);
/// Frames before the loop, in which the cloth forgets how it was hung.
const WARM_FRAMES: usize = PERIOD_FRAMES;
/// The cloth's width and height, metres.
const SIZE: Vec2 = Vec2::new(1.75, 1.9);
/// Height of the rod over the ground.
const ROD_HEIGHT: f32 = 2.2;
/// Width of the gathered upper edge.
const ROD_WIDTH: f32 = 1.12;
/// Folds along it.
const PLEATS: f32 = 4.5;

const SUBSTEPS: usize = 16;
const GRAVITY: f32 = -9.81;
/// Share of the velocity that is lost in a second, to air and in the weave.
const DAMPING_PER_S: f32 = 1.3;
/// XPBD compliance of the bending constraints, m/N for a vertex of mass 1 kg: softer folds more sharply.
const BEND_COMPLIANCE: f32 = 2.0e-3;
/// Compliance of the diagonals: the weave shears more easily than its threads stretch.
const SHEAR_COMPLIANCE: f32 = 1.0e-5;
/// Acceleration for each m/s of air that blows through the surface.
const AIR_PER_S: f32 = 3.2;
/// Vertices that are no neighbours stay this far apart, metres; the threads are 31 mm long.
const THICKNESS: f32 = 0.024;
/// Pairs nearer than this are watched until the next frame.
const WATCH: f32 = 0.055;
/// Vertices within so many threads of one another are neighbours.
const NEIGHBOURS: usize = 2;

/// A curtain and how it moves.
#[derive(Clone, Debug)]
pub struct Cloth {
    /// Its first frame: positions, normals, texture coordinates, triangles; open, one layer, [`SIDE`] x [`SIDE`] vertices in
    /// rows from the rod down.
    pub mesh: Mesh,
    /// Positions of all vertices, metres, [`FPS`] to the second; the last frame equals the first.
    pub frames: Vec<Vec<Vec3>>,
}

/// Makes the curtain: 1.9 m high from y = 0.3, hung from a rod along X, billowing along Z. Takes about a second.
#[must_use]
pub fn cloth() -> Cloth {
    let mut simulation = Simulation::new();
    let mut before = Vec::with_capacity(WARM_FRAMES);
    for frame in 0..WARM_FRAMES {
        simulation.frame(frame, None);
        before.push(simulation.positions.clone());
    }
    let mut frames = vec![simulation.positions.clone()];
    for frame in 0..PERIOD_FRAMES {
        let begin = PERIOD_FRAMES - RETURN_FRAMES;
        let share = frame.saturating_sub(begin) as f32 / RETURN_FRAMES as f32;
        let to = (frame > begin).then(|| (before[frame - 1].as_slice(), before[frame].as_slice(), RETURN_PULL * share * share));
        simulation.frame(frame, to);
        frames.push(simulation.positions.clone());
    }
    close(&mut frames);
    frames.iter_mut().for_each(|frame| simulation.tighten(frame));
    let at = |column: usize, row: usize| (row * SIDE + column) as u32;
    let mut triangles = Vec::with_capacity(2 * (SIDE - 1) * (SIDE - 1));
    for row in 0..SIDE - 1 {
        for column in 0..SIDE - 1 {
            let (a, b) = (at(column, row), at(column + 1, row));
            let (c, d) = (at(column, row + 1), at(column + 1, row + 1));
            // diagonals that alternate favour no direction of folds
            if (row + column) % 2 == 0 {
                triangles.extend([[a, c, d], [a, d, b]]);
            } else {
                triangles.extend([[a, c, b], [b, c, d]]);
            }
        }
    }
    let step = 1.0 / (SIDE - 1) as f32;
    let uvs = (0..SIDE * SIDE).map(|i| Vec2::new((i % SIDE) as f32, (i / SIDE) as f32) * step).collect();
    let mut mesh = Mesh { positions: frames[0].clone(), uvs, triangles, ..Mesh::default() };
    normals::compute(&mut mesh);
    Cloth { mesh, frames }
}

/// Moves the last frames a little, so that the very last is the first.
fn close(frames: &mut [Vec<Vec3>]) {
    let last = frames.len() - 1;
    let off: Vec<Vec3> = frames[0].iter().zip(&frames[last]).map(|(first, last)| *first - *last).collect();
    for back in 0..MEND_FRAMES {
        let x = 1.0 - back as f32 / MEND_FRAMES as f32;
        for (p, &off) in frames[last - back].iter_mut().zip(&off) {
            *p += off * smoothstep(x);
        }
    }
    frames[last] = frames[0].clone();
}

/// A distance that is kept.
struct Link {
    a: u32,
    b: u32,
    rest: f32,
    compliance: f32,
}

struct Simulation {
    positions: Vec<Vec3>,
    previous: Vec<Vec3>,
    velocities: Vec<Vec3>,
    links: Vec<Link>,
    /// Length of a thread between two rows.
    drop: f32,
    watched: Vec<(u32, u32)>,
}

impl Simulation {
    fn new() -> Self {
        let threads = (SIDE - 1) as f32;
        let (width, drop) = (SIZE.x / threads, SIZE.y / threads);
        let rod = gathered_edge(width);
        let positions: Vec<Vec3> = (0..SIDE * SIDE).map(|i| rod[i % SIDE] - Vec3::Y * (drop * (i / SIDE) as f32)).collect();
        let mut links = Vec::new();
        let mut link = |i: usize, right: usize, down: usize, compliance: f32, leans_left: bool| {
            let (column, row) = (i % SIDE, i / SIDE);
            if column + right < SIDE && row + down < SIDE {
                let far = i + right + down * SIDE;
                let (a, b) = if leans_left { (i + right, far - right) } else { (i, far) };
                let rest = Vec2::new(right as f32 * width, down as f32 * drop).length();
                links.push(Link { a: a as u32, b: b as u32, rest, compliance });
            }
        };
        // bending first, threads last: what comes last is met best
        for i in 0..SIDE * SIDE {
            link(i, 2, 0, BEND_COMPLIANCE, false);
            link(i, 0, 2, BEND_COMPLIANCE, false);
        }
        for i in 0..SIDE * SIDE {
            link(i, 1, 1, SHEAR_COMPLIANCE, false);
            link(i, 1, 1, SHEAR_COMPLIANCE, true);
        }
        for i in 0..SIDE * SIDE {
            link(i, 0, 1, 0.0, false);
            link(i, 1, 0, 0.0, false);
        }
        let previous = positions.clone();
        let velocities = vec![Vec3::ZERO; positions.len()];
        Self { positions, previous, velocities, links, drop, watched: Vec::new() }
    }

    /// One frame; `to` leads to a place: where it is before and after the frame, and how much of the way is gone in a substep.
    fn frame(&mut self, frame: usize, to: Option<(&[Vec3], &[Vec3], f32)>) {
        self.watch();
        let dt = 1.0 / (FPS * SUBSTEPS as f32);
        for substep in 0..SUBSTEPS {
            let time = (frame % PERIOD_FRAMES) as f32 / FPS + substep as f32 * dt;
            if substep % 8 == 0 {
                self.blow(time, 8.0 * dt);
            }
            let keep = 1.0 - DAMPING_PER_S * dt;
            for i in SIDE..self.positions.len() {
                let v = (self.velocities[i] + Vec3::Y * (GRAVITY * dt)) * keep;
                self.previous[i] = self.positions[i];
                self.positions[i] += v * dt;
            }
            if let Some((before, after, pull)) = to {
                let x = (substep + 1) as f32 / SUBSTEPS as f32;
                for (p, (&before, &after)) in self.positions.iter_mut().zip(before.iter().zip(after)) {
                    *p += (before + (after - before) * x - *p) * pull;
                }
            }
            keep_lengths(&self.links, &mut self.positions, dt);
            self.keep_apart();
            self.keep_near_rod();
            for i in SIDE..self.positions.len() {
                self.velocities[i] = (self.positions[i] - self.previous[i]) / dt;
            }
        }
    }

    /// Pushes vertices along their normals by the air that moves against them.
    fn blow(&mut self, time: f32, dt: f32) {
        let p = &self.positions;
        for row in 1..SIDE {
            for column in 0..SIDE {
                let i = row * SIDE + column;
                let across = p[i + usize::from(column + 1 < SIDE)] - p[i - usize::from(column > 0)];
                let down = p[i + if row + 1 < SIDE { SIDE } else { 0 }] - p[i - SIDE];
                let normal = unit_or(down.cross(across), Vec3::ZERO);
                let against = wind(p[i], time) - self.velocities[i];
                self.velocities[i] += normal * (normal.dot(against) * AIR_PER_S * dt);
            }
        }
    }

    /// Mends threads that are longer or shorter than they may be, down from the rod and up to it in turn.
    fn tighten(&self, frame: &mut [Vec3]) {
        let threads = self.links.iter().filter(|link| link.compliance == 0.0);
        let mut mend = |link: &Link| {
            let (a, b) = (link.a as usize, link.b as usize);
            let d = frame[b] - frame[a];
            let length = d.length();
            let wanted = length.clamp(link.rest * THREAD_RANGE.0, link.rest * THREAD_RANGE.1);
            if length != wanted && length > 0.0 {
                let step = d * ((length - wanted) / (length * (moves(a) + moves(b)).max(1.0)));
                frame[a] += step * moves(a);
                frame[b] -= step * moves(b);
            }
        };
        for _ in 0..TIGHTEN_ROUNDS / 2 {
            threads.clone().for_each(&mut mend);
            threads.clone().rev().for_each(&mut mend);
        }
    }

    /// Pairs of vertices that may touch before the next frame, in the order of the vertices.
    fn watch(&mut self) {
        let cell = |x: f32| (x / WATCH).floor() as i32;
        let key = |p: Vec3| (cell(p.x), cell(p.y), cell(p.z));
        let mut cells: Vec<((i32, i32, i32), u32)> =
            self.positions.iter().enumerate().map(|(i, &p)| (key(p), i as u32)).collect();
        cells.sort_unstable();
        self.watched.clear();
        for (i, &p) in self.positions.iter().enumerate() {
            let (x, y, z) = key(p);
            for (dx, dy) in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy))) {
                // cells along z stand in a row
                let begin = cells.partition_point(|(key, _)| *key < (x + dx, y + dy, z - 1));
                for &(_, j) in cells[begin..].iter().take_while(|(key, _)| *key <= (x + dx, y + dy, z + 1)) {
                    let j = j as usize;
                    let near = (i % SIDE).abs_diff(j % SIDE) <= NEIGHBOURS && (i / SIDE).abs_diff(j / SIDE) <= NEIGHBOURS;
                    if j > i && !near && p.distance_squared(self.positions[j]) < WATCH * WATCH {
                        self.watched.push((i as u32, j as u32));
                    }
                }
            }
        }
    }

    fn keep_apart(&mut self) {
        for &(a, b) in &self.watched {
            let (a, b) = (a as usize, b as usize);
            let d = self.positions[b] - self.positions[a];
            let squared = d.length_squared();
            if squared < THICKNESS * THICKNESS && squared > 0.0 {
                let length = squared.sqrt();
                let push = d * (0.5 * (THICKNESS - length) / length);
                // layers that touch rub: half of their sliding is lost
                let slide = ((self.positions[b] - self.previous[b]) - (self.positions[a] - self.previous[a])) * 0.25;
                for (i, way) in [(a, -1.0), (b, 1.0)] {
                    if i >= SIDE {
                        self.positions[i] += (push - slide) * way;
                    }
                }
            }
        }
    }

    fn keep_near_rod(&mut self) {
        for i in SIDE..self.positions.len() {
            let rod = self.positions[i % SIDE];
            let longest = self.drop * (i / SIDE) as f32;
            let d = self.positions[i] - rod;
            let squared = d.length_squared();
            if squared > longest * longest {
                self.positions[i] = rod + d * (longest / squared.sqrt());
            }
        }
    }
}

/// The inverse of a vertex's mass: the rod's are held.
fn moves(vertex: usize) -> f32 {
    if vertex < SIDE { 0.0 } else { 1.0 }
}

/// Moves the ends of links, one link after another.
fn keep_lengths(links: &[Link], positions: &mut [Vec3], dt: f32) {
    for link in links {
        let (a, b) = (link.a as usize, link.b as usize);
        let masses = moves(a) + moves(b);
        let d = positions[b] - positions[a];
        let length = d.length();
        if masses > 0.0 && length > 0.0 {
            let step = d * ((length - link.rest) / (length * (masses + link.compliance / (dt * dt))));
            positions[a] += step * moves(a);
            positions[b] -= step * moves(b);
        }
    }
}

/// The air's velocity, m/s: gusts that wander along the curtain; all have whole periods in a loop.
fn wind(p: Vec3, time: f32) -> Vec3 {
    let turn = TAU * time / LOOP_S;
    let gust = 1.4 + 1.9 * libm::sinf(turn - 0.9 * p.x) + 0.8 * libm::sinf(2.0 * turn + 2.3 * p.x + 0.6);
    let flutter = 0.7 * libm::sinf(5.0 * turn - 4.1 * p.x + 1.7 * p.y) + 0.5 * libm::sinf(7.0 * turn + 5.3 * p.x - 2.9 * p.y);
    Vec3::new(0.9 * libm::sinf(turn + 1.0) + 0.4 * libm::sinf(3.0 * turn), 0.15 * flutter, gust + flutter)
}

/// The upper edge: points on a wavy line, each a thread's length from the last.
fn gathered_edge(thread: f32) -> Vec<Vec3> {
    // pleats are neither equally deep nor equally wide
    let line = |s: f32| {
        let phase = TAU * PLEATS * (s + 0.018 * libm::sinf(TAU * 1.5 * s + 0.4));
        let deep = 1.0 + 0.22 * libm::sinf(TAU * 1.2 * s + 0.8);
        Vec2::new(s * ROD_WIDTH, deep * libm::sinf(phase))
    };
    // the depth for which the line is as long as the cloth is wide
    let points = |depth: f32| {
        let mut edge = vec![line(0.0) * Vec2::new(1.0, depth)];
        const FINE: u32 = 20_000;
        for i in 1..=FINE {
            let p = line(i as f32 / FINE as f32) * Vec2::new(1.0, depth);
            if edge.last().is_some_and(|last| last.distance(p) >= thread) {
                edge.push(p);
            }
        }
        edge
    };
    let (mut low, mut high) = (0.0_f32, 0.5);
    for _ in 0..24 {
        let depth = 0.5 * (low + high);
        if points(depth).len() > SIDE { high = depth } else { low = depth }
    }
    let mut edge = points(high);
    edge.truncate(SIDE);
    let middle = edge.iter().fold((f32::MAX, f32::MIN), |(low, high), p| (low.min(p.x), high.max(p.x)));
    edge.iter().map(|p| Vec3::new(p.x - 0.5 * (middle.0 + middle.1), ROD_HEIGHT, p.y)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curtain_hangs_and_loops() {
        let begun = std::time::Instant::now();
        let Cloth { mesh, frames } = cloth();
        println!("{:.2} s", begun.elapsed().as_secs_f64());
        mesh.validate().unwrap();
        assert_eq!((mesh.positions.len(), mesh.uvs.len(), frames.len()), (3249, 3249, 101));
        assert!(mesh.positions == frames[0] && frames[0] == frames[100]);
        let (low, high) = mesh.bounds().unwrap();
        assert!(low.y > 0.2 && high.y < 2.21 && low.x > -1.0 && high.x < 1.0, "{low} {high}");
        // the largest step of a vertex over the seam is like that of any two frames
        let step = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        let steps: Vec<f32> = frames.windows(2).map(|pair| step(&pair[0], &pair[1])).collect();
        let usual = steps[30..99].iter().copied().fold(0.0, f32::max);
        assert!(steps[99] < 1.2 * usual && steps[..30].iter().all(|&s| s < 1.2 * usual), "{steps:?}");
        assert!(usual > 0.01 && usual < 0.25, "{usual}");
        assert!(frames.iter().all(|frame| frame[..SIDE] == frames[0][..SIDE]), "the rod holds");
    }

    #[test]
    fn its_threads_keep_their_length() {
        let threads = (SIDE - 1) as f32;
        let mut worst = 0.0_f32;
        let frames = cloth().frames;
        for frame in &frames {
            for i in 0..SIDE * SIDE {
                if i % SIDE + 1 < SIDE {
                    worst = worst.max((frame[i].distance(frame[i + 1]) * threads / SIZE.x - 1.0).abs());
                }
                if i / SIDE + 1 < SIDE {
                    worst = worst.max((frame[i].distance(frame[i + SIDE]) * threads / SIZE.y - 1.0).abs());
                }
            }
        }
        println!("stretch {worst}");
        assert!(worst < 0.05, "{worst}");
    }
}
