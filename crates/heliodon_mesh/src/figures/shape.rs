//! Closed pieces that figures are put together from.

use glam::Vec3;
use heliodon_math::frame::unit_or;
use std::f32::consts::TAU;

/// A closed surface, each vertex once, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default)]
pub struct Shape {
    pub positions: Vec<Vec3>,
    /// How far along the piece each vertex is, in [0, 1].
    pub along: Vec<f32>,
    pub triangles: Vec<[u32; 3]>,
}

/// A point of a piece's axis with half its width along the side and across it, metres.
pub type Station = ([f32; 3], f32, f32);

/// From 0 to 1 as `x` does, level at both ends: Hermite's cubic of the slopes 0.
pub fn smoothstep(x: f32) -> f32 {
    x * x * (3.0 - 2.0 * x)
}

/// A piece with elliptic sections along a smooth line through the stations, ends rounded: `rings * sides + 2` vertices. Stations and rings are
/// two at the least, sides three.
/// `side` is the way of the first radius, as far as it is square to the line.
pub fn sweep(stations: &[Station], side: Vec3, rings: usize, sides: usize) -> Shape {
    pleated(stations, side, rings, sides, |_, _| 1.0)
}

/// A sweep whose sections are not quite elliptic: `swell` multiplies the radii at a place along the piece, in [0, 1], and an angle in radians.
pub fn pleated(stations: &[Station], side: Vec3, rings: usize, sides: usize, swell: impl Fn(f32, f32) -> f32) -> Shape {
    let line: Vec<(Vec3, f32, f32)> = (0..rings).map(|i| on_line(stations, i as f32 / (rings - 1) as f32)).collect();
    let mut shape = Shape::default();
    let tangent = |i: usize| unit_or(line[(i + 1).min(rings - 1)].0 - line[i.saturating_sub(1)].0, Vec3::Y);
    let cap = |at: usize, way: f32| line[at].0 + tangent(at) * (way * 0.55 * line[at].1.min(line[at].2));
    shape.push(cap(0, -1.0), 0.0);
    for (i, &(centre, wide, thick)) in line.iter().enumerate() {
        let t = tangent(i);
        let u = unit_or(side - t * side.dot(t), t.any_orthonormal_vector());
        let v = t.cross(u);
        for k in 0..sides {
            let (angle, along) = (TAU * k as f32 / sides as f32, i as f32 / (rings - 1) as f32);
            let ((sin, cos), swell) = (libm::sincosf(angle), swell(along, angle));
            shape.push(centre + u * (wide * cos * swell) + v * (thick * sin * swell), along);
        }
    }
    shape.push(cap(rings - 1, 1.0), 1.0);
    shape.join_rings(rings, sides);
    shape
}

/// A ball with three radii, its poles below and above: `rings * sides + 2` vertices.
pub fn ball(centre: Vec3, radii: Vec3, rings: usize, sides: usize) -> Shape {
    let mut shape = Shape::default();
    shape.push(centre - Vec3::Y * radii.y, 0.0);
    for i in 1..=rings {
        let (up_sin, up_cos) = libm::sincosf(0.5 * TAU * i as f32 / (rings + 1) as f32);
        for k in 0..sides {
            let (sin, cos) = libm::sincosf(TAU * k as f32 / sides as f32);
            // rings run as a sweep's do whose line goes up and whose side is Z
            let p = Vec3::new(up_sin * sin, -up_cos, up_sin * cos);
            shape.push(centre + p * radii, i as f32 / (rings + 1) as f32);
        }
    }
    shape.push(centre + Vec3::Y * radii.y, 1.0);
    shape.join_rings(rings, sides);
    shape
}

impl Shape {
    /// A piece through rings of equally many places, each counter-clockwise seen from the side of the last, between two poles.
    pub fn of_rings(first: Vec3, rings: &[Vec<Vec3>], last: Vec3) -> Self {
        let mut shape = Self::default();
        shape.push(first, 0.0);
        for (i, ring) in rings.iter().enumerate() {
            ring.iter().for_each(|p| shape.push(*p, (i + 1) as f32 / (rings.len() + 1) as f32));
        }
        shape.push(last, 1.0);
        shape.join_rings(rings.len(), rings.first().map_or(0, Vec::len));
        shape
    }

    fn push(&mut self, p: Vec3, along: f32) {
        self.positions.push(p);
        self.along.push(along);
    }

    /// Triangles of a piece whose vertices are a pole, rings, and a pole.
    fn join_rings(&mut self, rings: usize, sides: usize) {
        let at = |ring: usize, k: usize| (1 + ring * sides + k % sides) as u32;
        let last = (1 + rings * sides) as u32;
        for k in 0..sides {
            self.triangles.push([0, at(0, k + 1), at(0, k)]);
            for ring in 0..rings - 1 {
                let [a, b, c, d] = [at(ring, k), at(ring, k + 1), at(ring + 1, k), at(ring + 1, k + 1)];
                self.triangles.extend([[a, b, d], [a, d, c]]);
            }
            self.triangles.push([last, at(rings - 1, k), at(rings - 1, k + 1)]);
        }
    }

    /// The piece as a mirror at x = 0 shows it.
    pub fn mirrored(&self) -> Self {
        Self {
            positions: self.positions.iter().map(|p| Vec3::new(-p.x, p.y, p.z)).collect(),
            along: self.along.clone(),
            triangles: self.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect(),
        }
    }

    /// The piece with every vertex moved.
    pub fn moved(mut self, place: impl Fn(Vec3) -> Vec3) -> Self {
        self.positions.iter_mut().for_each(|p| *p = place(*p));
        self
    }
}

/// The smooth line (Catmull, Rom 1974) through the stations at `t` in [0, 1].
fn on_line(stations: &[Station], t: f32) -> (Vec3, f32, f32) {
    let spans = (stations.len() - 1) as f32;
    let span = ((t * spans) as usize).min(stations.len() - 2);
    let x = t * spans - span as f32;
    let get = |i: usize| &stations[i.min(stations.len() - 1)];
    let four = [get(span.saturating_sub(1)), get(span), get(span + 1), get(span + 2)];
    let mix = |[a, b, c, d]: [f32; 4]| {
        0.5 * (2.0 * b + x * ((c - a) + x * ((2.0 * a - 5.0 * b + 4.0 * c - d) + x * (3.0 * (b - c) + d - a))))
    };
    let centre = Vec3::from_array(std::array::from_fn(|axis| mix(four.map(|s| s.0[axis]))));
    // a curve that overshoots between radii must not turn them inside out
    let radius = |pick: fn(&Station) -> f32| {
        let r = four.map(pick);
        mix(r).clamp(0.6 * r[1].min(r[2]), 1.4 * r[1].max(r[2]))
    };
    (centre, radius(|s| s.1), radius(|s| s.2))
}

/// Whether every edge has a triangle on either side, each in its direction.
#[cfg(test)]
pub fn is_closed(triangles: &[[u32; 3]]) -> bool {
    let mut edges: Vec<(u32, u32)> = triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
    edges.sort_unstable();
    edges.windows(2).all(|pair| pair[0] != pair[1]) && edges.iter().all(|&(a, b)| edges.binary_search(&(b, a)).is_ok())
}

/// Six times the volume that triangles enclose; negative where they are turned inside out.
#[cfg(test)]
pub fn volume(positions: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
    triangles.iter().map(|t| t.map(|i| positions[i as usize])).map(|[a, b, c]| a.dot(b.cross(c))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_closed_and_right_side_out() {
        let bent = sweep(&[([0.0; 3], 0.1, 0.2), ([0.0, 1.0, 0.3], 0.2, 0.1), ([1.0, 1.0, 0.5], 0.1, 0.1)], Vec3::Z, 7, 6);
        let round = ball(Vec3::X, Vec3::splat(2.0), 12, 16);
        for shape in [&bent, &round, &bent.mirrored()] {
            assert!(is_closed(&shape.triangles) && volume(&shape.positions, &shape.triangles) > 0.0);
        }
        assert_eq!((bent.positions.len(), round.positions.len()), (44, 194));
        let volume = volume(&round.positions, &round.triangles) / 6.0;
        assert!((volume / (4.0 / 3.0 * std::f32::consts::PI * 8.0) - 1.0).abs() < 0.06, "{volume}");
    }
}
