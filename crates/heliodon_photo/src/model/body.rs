//! What shapes are made into: vertices, triangles, and faces that can be laid flat.

use earcut::Earcut;
use glam::{DMat3, DVec2, DVec3};

/// A shape's surface. A face is what a texture shows without a break: a polygon, or the side of a shaft unrolled.
#[derive(Clone, Debug, Default)]
pub(super) struct Body {
    pub positions: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    pub faces: Vec<u32>,
    pub face_count: u32,
    /// Where each triangle's corners lie on its face, metres.
    pub flat: Vec<[DVec2; 3]>,
    /// Whether light runs on smoothly over each face.
    pub smooth: Vec<bool>,
}

/// One level of what is turned about an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Level {
    pub height_m: f64,
    pub radius_m: f64,
}

/// The polygon's normal, twice its area long (Newell).
pub(super) fn newell(ring: &[DVec3]) -> DVec3 {
    let Some(&first) = ring.first() else { return DVec3::ZERO };
    (0..ring.len()).map(|i| (ring[i] - first).cross(ring[(i + 1) % ring.len()] - first)).sum()
}

impl Body {
    pub fn vertex(&mut self, position: DVec3) -> u32 {
        self.positions.push(position);
        self.positions.len() as u32 - 1
    }

    pub fn face(&mut self, is_smooth: bool) -> u32 {
        self.smooth.push(is_smooth);
        self.face_count += 1;
        self.face_count - 1
    }

    fn triangle(&mut self, face: u32, corners: [u32; 3], flat: [DVec2; 3]) {
        self.triangles.push(corners);
        self.faces.push(face);
        self.flat.push(flat);
    }

    /// A polygon over vertices, counter-clockwise from outside, as a face of its own. Whether it could be triangulated: it has an area, and
    /// its sides do not cross.
    pub fn polygon(&mut self, ring: &[u32]) -> bool {
        let places: Vec<DVec3> = ring.iter().map(|&v| self.positions[v as usize]).collect();
        let Some(normal) = newell(&places).try_normalize() else { return false };
        let sides = (0..places.len()).map(|i| places[(i + 1) % places.len()] - places[i]);
        // along the longest side, so that rectangles lie straight in a texture
        let longest = sides.fold(DVec3::ZERO, |longest, side| if side.length() > longest.length() { side } else { longest });
        let Some(right) = (longest - normal * longest.dot(normal)).try_normalize() else { return false };
        let up = normal.cross(right);
        let flat: Vec<DVec2> = places.iter().map(|p| *p - places[0]).map(|p| DVec2::new(p.dot(right), p.dot(up))).collect();
        let triangles = triangulated(&flat);
        let area =
            |ring: &[DVec2]| (1..ring.len() - 1).map(|i| (ring[i] - ring[0]).perp_dot(ring[i + 1] - ring[0])).sum::<f64>();
        let areas: Vec<f64> = triangles.iter().map(|t| area(&t.map(|c| flat[c]))).collect();
        let covered: f64 = areas.iter().sum();
        let least = areas.iter().fold(0.0, |least: f64, area| least.min(*area));
        // where sides cross, triangles cover more than the polygon has, leave some of it, or turn over
        if (covered - area(&flat)).abs() > CROSSED * covered || least < -CROSSED * covered || covered <= 0.0 {
            return false;
        }
        let face = self.face(false);
        for corners in triangles {
            self.triangle(face, corners.map(|c| ring[c]), corners.map(|c| flat[c]));
        }
        true
    }

    /// Levels from the bottom up about an axis that starts at `origin`; `frame` has the axis as its y, and angles run from x towards -z, so that
    /// sides face outwards. Vertices lie where the polygon has the circle's area.
    pub fn turned(&mut self, origin: DVec3, frame: DMat3, levels: &[Level], sides: u32, caps: bool) {
        let sides = sides.max(3);
        let angle = std::f64::consts::TAU / f64::from(sides);
        let fair = (angle / libm::sin(angle)).sqrt();
        let around = |i: u32| DVec3::new(libm::cos(angle * f64::from(i)), 0.0, -libm::sin(angle * f64::from(i)));
        let rows: Vec<Vec<u32>> = levels
            .iter()
            .map(|level| {
                let at = |out: DVec3| origin + frame * (out * (level.radius_m * fair) + DVec3::Y * level.height_m);
                if level.radius_m <= 0.0 {
                    return vec![self.vertex(at(DVec3::ZERO)); sides as usize];
                }
                (0..sides).map(|i| self.vertex(at(around(i)))).collect()
            })
            .collect();
        let mut band = 0;
        while band + 1 < levels.len() {
            // what narrows little unrolls as one face; what narrows much would be drawn out
            let mut end = band + 1;
            while end + 1 < levels.len() && alike(&levels[band..=end + 1]) {
                end += 1;
            }
            self.unrolled(&rows[band..=end], &levels[band..=end], angle);
            band = end;
        }
        if caps && let (Some(first), Some(last)) = (rows.first(), rows.last()) {
            let under: Vec<u32> = first.iter().rev().copied().collect();
            self.polygon(&under);
            self.polygon(last);
        }
    }

    fn unrolled(&mut self, rows: &[Vec<u32>], levels: &[Level], angle: f64) {
        let face = self.face(true);
        let middle = levels.iter().map(|level| level.radius_m).sum::<f64>() / levels.len() as f64;
        let sides = rows[0].len();
        let steep = levels.len() == 2 && !alike(levels);
        let sector = steep.then_some(|(level, angle): (Level, f64)| on_sector(levels, level, angle));
        let mut low = 0.0;
        for (pair, level) in rows.windows(2).zip(levels.windows(2)) {
            let slant = libm::hypot(level[1].height_m - level[0].height_m, level[1].radius_m - level[0].radius_m);
            let high = low + slant;
            for i in 0..sides {
                let next = (i + 1) % sides;
                let (left, right) = (angle * middle * i as f64, angle * middle * (i + 1) as f64);
                let corners = [pair[0][i], pair[0][next], pair[1][next], pair[1][i]];
                let mut flat = [(left, low), (right, low), (right, high), (left, high)].map(DVec2::from);
                if let Some(sector) = sector {
                    let [from, to] = [i, i + 1].map(|i| angle * i as f64);
                    flat = [(level[0], from), (level[0], to), (level[1], to), (level[1], from)].map(sector);
                }
                for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
                    // at a tip both ends of a side are one vertex
                    if corners[a] != corners[b] && corners[b] != corners[c] && corners[c] != corners[a] {
                        self.triangle(face, [corners[a], corners[b], corners[c]], [flat[a], flat[b], flat[c]]);
                    }
                }
            }
            low = high;
        }
    }

    /// A strip between two rows of vertices, unrolled as one face; it faces the side from which the first row runs to the right below the second.
    pub fn strip(&mut self, below: &[u32], above: &[u32]) {
        let face = self.face(below.len() > 2);
        let place = |v: u32| self.positions[v as usize];
        let mut left = 0.0;
        let mut pieces = Vec::new();
        for (low, high) in below.windows(2).zip(above.windows(2)) {
            let height = place(low[0]).distance(place(high[0]));
            let right = left + 0.5 * (place(low[0]).distance(place(low[1])) + place(high[0]).distance(place(high[1])));
            let flat = [(left, 0.0), (right, 0.0), (right, height), (left, height)].map(DVec2::from);
            pieces.push(([low[0], low[1], high[1]], [flat[0], flat[1], flat[2]]));
            pieces.push(([low[0], high[1], high[0]], [flat[0], flat[2], flat[3]]));
            left = right;
        }
        pieces.into_iter().for_each(|(corners, flat)| self.triangle(face, corners, flat));
    }

    /// Adds another's surface.
    pub fn append(&mut self, other: &Self) {
        let (vertices, faces) = (self.positions.len() as u32, self.face_count);
        self.positions.extend(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|corners| corners.map(|v| v + vertices)));
        self.faces.extend(other.faces.iter().map(|face| face + faces));
        self.flat.extend(&other.flat);
        self.smooth.extend(&other.smooth);
        self.face_count += other.face_count;
    }

    /// The same moved by `place`; `mirrored` where that turns left into right, so that fronts stay fronts.
    pub fn moved(&self, mirrored: bool, place: impl Fn(DVec3) -> DVec3) -> Self {
        let mut body = self.clone();
        body.positions.iter_mut().for_each(|p| *p = place(*p));
        if mirrored {
            body.flip();
        }
        body
    }

    /// Turns all fronts into backs.
    pub fn flip(&mut self) {
        self.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        self.flat.iter_mut().for_each(|corners| corners.swap(1, 2));
    }
}

/// Triangles are off a polygon's area by less than this part, a hundred thousand times what rounding does, where its sides do not cross.
const CROSSED: f64 = 1.0e-6;

/// Radii of one face that is unrolled as a rectangle are within this factor of one another.
const ALIKE: f64 = 1.25;

/// Where a place of a cone between two levels lies when that is cut open and laid flat: a sector of a ring about the cone's tip.
fn on_sector(levels: &[Level], level: Level, angle: f64) -> DVec2 {
    let (low, high) = (levels[0], levels[levels.len() - 1]);
    let widens = high.radius_m - low.radius_m;
    let slant = libm::hypot(high.height_m - low.height_m, widens);
    let from_tip = level.radius_m * slant / widens.abs();
    let turn = angle * widens.abs() / slant;
    // from the tip upwards where it widens, downwards where it narrows, so that the same side is seen
    DVec2::new(libm::sin(turn), libm::cos(turn) * widens.signum()) * from_tip
}

fn alike(levels: &[Level]) -> bool {
    let (least, most) = levels.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), l| (a.min(l.radius_m), b.max(l.radius_m)));
    most <= ALIKE * least
}

/// A simple polygon's triangles by ears, each of its vertices a corner of one: earcut leaves out vertices on a straight side, but a neighbour may end there,
/// and there would be a crack.
fn triangulated(ring: &[DVec2]) -> Vec<[usize; 3]> {
    let mut indices: Vec<u32> = Vec::new();
    Earcut::new().earcut(ring.iter().map(|p| p.to_array()), &[], &mut indices);
    let mut triangles: Vec<[usize; 3]> =
        indices.chunks_exact(3).map(|t| [t[0] as usize, t[1] as usize, t[2] as usize]).collect();
    let area = |t: &[usize; 3]| (ring[t[1]] - ring[t[0]]).perp_dot(ring[t[2]] - ring[t[0]]);
    // whichever way the clipper winds them
    triangles.iter_mut().filter(|t| area(t) < 0.0).for_each(|t| t.swap(1, 2));
    let n = ring.len();
    let mut is_used = vec![false; n];
    triangles.iter().flatten().for_each(|&v| is_used[v] = true);
    for start in (0..n).filter(|&v| is_used[v]).collect::<Vec<_>>() {
        let mut from = start;
        let mut next = (start + 1) % n;
        let mut missing = Vec::new();
        while !is_used[next] && next != start {
            missing.push(next);
            next = (next + 1) % n;
        }
        for vertex in missing {
            let side = |t: &[usize; 3]| (0..3).find(|&k| t[k] == from && t[(k + 1) % 3] == next);
            let Some((index, k)) = triangles.iter().enumerate().find_map(|(i, t)| side(t).map(|k| (i, k))) else { break };
            let apex = triangles[index][(k + 2) % 3];
            triangles[index] = [from, vertex, apex];
            triangles.push([vertex, next, apex]);
            from = vertex;
        }
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_vertex_of_a_polygon_is_used_and_its_area_is_kept() {
        // an L with vertices on its straight sides
        let ring = [(0, 0), (1, 0), (2, 0), (2, 1), (1, 1), (1, 2), (1, 3), (0, 3), (0, 1)];
        let ring: Vec<DVec2> = ring.iter().map(|&(x, y)| DVec2::new(f64::from(x), f64::from(y))).collect();
        let triangles = triangulated(&ring);
        let area: f64 = triangles.iter().map(|t| 0.5 * (ring[t[1]] - ring[t[0]]).perp_dot(ring[t[2]] - ring[t[0]])).sum();
        assert!((area - 4.0).abs() < 1e-12, "{area}");
        assert_eq!(triangles.len(), ring.len() - 2);
        assert!((0..ring.len()).all(|v| triangles.iter().flatten().any(|&c| c == v)));
    }
}
