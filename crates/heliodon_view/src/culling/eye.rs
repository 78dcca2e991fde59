//! Whether an eye is out in the open, where what lies in stone hides what is behind it.

use crate::daylight::chunk::KeptChunk;
use crate::daylight::seen::NumberSet;
use glam::{DVec2, Vec3};

/// Which triangles of a chunk belong to closed bodies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Solid {
    /// All of them.
    All,
    /// None.
    None,
    /// These, by their number in the chunk.
    Some(NumberSet),
}

impl Solid {
    fn has(&self, number: u32) -> bool {
        match self {
            Self::All => true,
            Self::None => false,
            Self::Some(triangles) => triangles.contains(number),
        }
    }
}

/// Whether no closed body is around `eye` or reaches nearer to it than `clear_m`.
///
/// How often the bodies go around the eye is how often a ray upward leaves them, less how often it enters them: each point of the plan belongs to one side
/// of every edge, so that no ray passes between two triangles or through both.
pub fn is_in_the_open<'a>(chunks: impl Iterator<Item = (&'a KeptChunk, &'a Solid)>, eye: Vec3, clear_m: f32) -> bool {
    let mut around = 0;
    for (chunk, solid) in chunks.filter(|(_, solid)| **solid != Solid::None) {
        if !may_concern(chunk.bounds, eye, clear_m) {
            continue;
        }
        for cluster in &chunk.clusters {
            if !may_concern((cluster.center - cluster.half, cluster.center + cluster.half), eye, clear_m) {
                continue;
            }
            for number in (cluster.indices.start / 3..cluster.indices.end / 3).filter(|&number| solid.has(number)) {
                let triangle = chunk.triangle(number).map(|vertex| chunk.positions[usize::from(vertex)]);
                if distance_squared(eye, triangle) < clear_m * clear_m {
                    return false;
                }
                around += passes_above(eye, triangle);
            }
        }
    }
    around == 0
}

/// Whether a box is near the eye, or above it.
fn may_concern((low, high): (Vec3, Vec3), eye: Vec3, near: f32) -> bool {
    let (low, high) = (low - near, high + near);
    low.x <= eye.x && eye.x <= high.x && low.z <= eye.z && eye.z <= high.z && high.y >= eye.y
}

/// 1 where a ray upward leaves through a triangle's front, -1 where it enters through it, 0 where it passes by.
fn passes_above(eye: Vec3, triangle: [Vec3; 3]) -> i32 {
    let plan =
        |point: Vec3| DVec2::new(f64::from(point.x), f64::from(point.z)) - DVec2::new(f64::from(eye.x), f64::from(eye.z));
    let corners = triangle.map(plan);
    // How often the triangle's edges pass the half line along the first axis, going up the second: the winding number of its plan.
    let mut winding = 0;
    for i in 0..3 {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        let (above_a, above_b) = (a.y >= 0.0, b.y >= 0.0);
        if above_a != above_b {
            let (low, high) = if above_a { (b, a) } else { (a, b) };
            // The same for both triangles of an edge, whichever way they pass it.
            if low.perp_dot(high) > 0.0 {
                winding += if above_b { 1 } else { -1 };
            }
        }
    }
    if winding == 0 {
        return 0;
    }
    let [a, b, c] = triangle.map(|point| point.as_dvec3() - eye.as_dvec3());
    let normal = (b - a).cross(c - a);
    // The height of the triangle's plane over the eye, times the normal's upward component.
    let height = a.dot(normal) * normal.y.signum();
    // Seen from above, x to the right and z down: what turns one way in plan looks down.
    if height > 0.0 { -winding } else { 0 }
}

/// Squared distance from a point to a triangle.
///
/// Christer Ericson: "Real-Time Collision Detection", 2005, section 5.1.5.
fn distance_squared(point: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let (ab, ac) = (b - a, c - a);
    let on_edge = |from: Vec3, along: Vec3| {
        let length_squared = along.length_squared();
        let t = if length_squared > 0.0 { ((point - from).dot(along) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
        (from + along * t).distance_squared(point)
    };
    let edges = on_edge(a, ab).min(on_edge(a, ac)).min(on_edge(b, c - b));
    let Some(normal) = ab.cross(ac).try_normalize() else { return edges };
    let inside = |from: Vec3, along: Vec3| along.cross(point - from).dot(normal) >= 0.0;
    if inside(a, ab) && inside(b, c - b) && inside(c, a - c) { (point - a).dot(normal).powi(2) } else { edges }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::daylight::cluster::cluster;
    use heliodon_math::random::Pcg32;

    /// An icosahedron-like ball of triangles: octahedron, subdivided twice, around `center`.
    fn ball(center: Vec3, radius: f32) -> KeptChunk {
        let mut faces: Vec<[Vec3; 3]> = Vec::new();
        for x in [Vec3::X, Vec3::NEG_X] {
            for y in [Vec3::Y, Vec3::NEG_Y] {
                for z in [Vec3::Z, Vec3::NEG_Z] {
                    let outward = x.cross(y).dot(z) > 0.0;
                    faces.push(if outward { [x, y, z] } else { [x, z, y] });
                }
            }
        }
        for _ in 0..2 {
            let middle = |a: Vec3, b: Vec3| heliodon_math::frame::unit_or(a + b, a);
            let split = |[a, b, c]: [Vec3; 3]| {
                let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            };
            faces = faces.into_iter().flat_map(split).collect();
        }
        let positions: Vec<Vec3> = faces.iter().flatten().map(|&point| center + point * radius).collect();
        let triangles: Vec<[u32; 3]> = (0..faces.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let made = cluster(&positions, &triangles);
        let positions: Vec<Vec3> = made.vertices.iter().map(|&vertex| positions[vertex as usize]).collect();
        KeptChunk {
            positions,
            indices: made.indices,
            clusters: made.clusters,
            bounds: (center - radius, center + radius),
            albedo: Vec::new(),
        }
    }

    #[test]
    fn eyes_in_stone_and_near_it_are_not_in_the_open() {
        let balls = [ball(Vec3::new(0.5, 2.0, -1.0), 2.0), ball(Vec3::new(0.5, 9.0, -1.0), 2.0)];
        let open = |eye: Vec3, clear: f32| is_in_the_open(balls.iter().zip([&Solid::All, &Solid::All]), eye, clear);
        let mut random = Pcg32::new(3, 9);
        let mut next = || 12.0 * random.next_f32() - 4.0;
        let (mut inside, mut outside) = (0, 0);
        for _ in 0..3000 {
            // The first is straight below a vertex of both.
            let eye = if inside + outside == 0 { Vec3::new(0.5, -1.0, -1.0) } else { Vec3::new(next(), next(), next()) };
            let nearest = [2.0, 9.0].map(|y| eye.distance(Vec3::new(0.5, y, -1.0))).into_iter().fold(f32::INFINITY, f32::min);
            // Between the ball's corners the surface is up to 6 % nearer to its middle.
            if nearest < 1.85 {
                assert!(!open(eye, 0.0), "{eye}");
                inside += 1;
            } else if nearest > 2.0 {
                assert!(open(eye, 0.0), "{eye}");
                assert!(nearest < 2.3 || open(eye, 0.3), "{eye}");
                assert!(nearest > 2.1 || !open(eye, 0.3), "{eye}");
                outside += 1;
            }
        }
        assert!(inside > 20 && outside > 1000, "{inside} {outside}");
        assert!(is_in_the_open([(&balls[0], &Solid::None)].into_iter(), Vec3::new(0.5, 2.0, -1.0), 0.1));
    }
}
