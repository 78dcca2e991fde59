//! Scenes whose light is known in closed form.

use glam::Vec3;
use heliodon_math::frame::unit_or;
use heliodon_math::sphere::fibonacci_sphere;

/// Triangles over vertices that have normals of their own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Vertex positions in metres.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals.
    pub normals: Vec<Vec3>,
    /// Vertex indices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
}

impl Scene {
    /// Both scenes together; the other's vertices and triangles follow this one's.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.normals.extend(other.normals);
        self.triangles.extend(other.triangles.into_iter().map(|t| t.map(|i| i + first)));
        self
    }

    /// The scene somewhere else.
    #[must_use]
    pub fn moved(mut self, by: Vec3) -> Self {
        self.positions.iter_mut().for_each(|p| *p += by);
        self
    }

    /// The scene inside out: fronts become backs.
    #[must_use]
    pub fn inside_out(mut self) -> Self {
        self.normals.iter_mut().for_each(|n| *n = -*n);
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        self
    }
}

/// A rectangle with one corner at `corner`, spanned by `a` and `b`, facing `a x b`, of `parts * parts` squares.
#[must_use]
pub fn rectangle(corner: Vec3, a: Vec3, b: Vec3, parts: u32) -> Scene {
    let normal = unit_or(a.cross(b), Vec3::Y);
    let side = parts + 1;
    let mut scene = Scene::default();
    for i in 0..side * side {
        let (u, v) = ((i % side) as f32 / parts as f32, (i / side) as f32 / parts as f32);
        scene.positions.push(corner + a * u + b * v);
        scene.normals.push(normal);
    }
    for i in (0..parts).flat_map(|row| (0..parts).map(move |column| row * side + column)) {
        scene.triangles.push([i, i + 1, i + side + 1]);
        scene.triangles.push([i, i + side + 1, i + side]);
    }
    scene
}

/// A level square of side `size` about the origin, facing up.
#[must_use]
pub fn ground(size: f32, parts: u32) -> Scene {
    rectangle(Vec3::new(-size, 0.0, size) * 0.5, Vec3::X * size, Vec3::NEG_Z * size, parts)
}

/// A box from `low` to `high` that faces outwards, each face a rectangle of its own; [`Scene::inside_out`] makes a room of it.
#[must_use]
pub fn cuboid(low: Vec3, high: Vec3, parts: u32) -> Scene {
    let size = high - low;
    let (x, y, z) = (Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z);
    rectangle(low, z, y, parts)
        .and(rectangle(low + x, y, z, parts))
        .and(rectangle(low, x, z, parts))
        .and(rectangle(low + y, z, x, parts))
        .and(rectangle(low, y, x, parts))
        .and(rectangle(low + z, x, y, parts))
}

/// A ball of the given radius about the origin with smooth normals: a latitude-longitude mesh of `rings` rings.
#[must_use]
pub fn ball(radius: f32, rings: u32) -> Scene {
    let columns = 2 * rings;
    let mut scene = Scene::default();
    for ring in 0..=rings {
        let polar = std::f32::consts::PI * ring as f32 / rings as f32;
        for column in 0..columns {
            let azimuth = std::f32::consts::TAU * column as f32 / columns as f32;
            let r = libm::sinf(polar);
            let n = Vec3::new(r * libm::cosf(azimuth), libm::cosf(polar), r * libm::sinf(azimuth));
            scene.normals.push(unit_or(n, Vec3::Y));
            scene.positions.push(n * radius);
        }
    }
    for ring in 0..rings {
        for column in 0..columns {
            let (a, b) = (ring * columns + column, ring * columns + (column + 1) % columns);
            let (c, d) = (a + columns, b + columns);
            // at the poles one of the two has no area
            if ring > 0 {
                scene.triangles.push([a, b, c]);
            }
            if ring + 1 < rings {
                scene.triangles.push([b, d, c]);
            }
        }
    }
    scene
}

/// The form factor of two equal parallel squares of side `size`, opposite each other at `distance` (J. R. Howell: "A Catalog
/// of Radiation Heat Transfer Configuration Factors", C-11): the part of what one emits that meets the other.
#[must_use]
pub fn opposite_squares_form_factor(size: f64, distance: f64) -> f64 {
    let x = size / distance;
    let x2 = x * x;
    let root = (1.0 + x2).sqrt();
    2.0 / (std::f64::consts::PI * x2)
        * ((((1.0 + x2) * (1.0 + x2)) / (1.0 + 2.0 * x2)).ln() / 2.0 + 2.0 * x * root * libm::atan(x / root)
            - 2.0 * x * libm::atan(x))
}

/// The form factor from a small level patch to a parallel rectangle above it of `width` by `depth` at `height`, one corner
/// straight above the patch (Howell, B-3).
#[must_use]
pub fn corner_form_factor(width: f64, depth: f64, height: f64) -> f64 {
    let (a, b) = (width / height, depth / height);
    let (ra, rb) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
    (a / ra * libm::atan(b / ra) + b / rb * libm::atan(a / rb)) / std::f64::consts::TAU
}

/// The part of a point's cosine-weighted hemisphere about `normal` that `blocked` covers, by a sum over `count` directions.
#[must_use]
pub fn covered_part(normal: Vec3, count: u32, blocked: impl Fn(Vec3) -> bool) -> f64 {
    let (mut covered, mut all) = (0.0, 0.0);
    for d in fibonacci_sphere(count) {
        let cos = f64::from(d.dot(normal).max(0.0));
        all += cos;
        covered += if blocked(d) { cos } else { 0.0 };
    }
    covered / all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outward(scene: &Scene, centre: Vec3) -> bool {
        scene.triangles.iter().all(|t| {
            let [a, b, c] = t.map(|i| scene.positions[i as usize]);
            let n = (b - a).cross(c - a);
            n.dot((a + b + c) / 3.0 - centre) > 0.0 && t.iter().all(|&i| scene.normals[i as usize].dot(n) > 0.0)
        })
    }

    #[test]
    fn solids_face_outwards() {
        assert!(outward(&cuboid(Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0), 3), Vec3::new(0.5, 1.0, 1.5)));
        assert!(outward(&ball(2.0, 12), Vec3::ZERO));
        assert!(ground(4.0, 2).normals.iter().all(|&n| n == Vec3::Y));
    }

    #[test]
    fn form_factors_agree_with_tables_and_sums() {
        // unit squares at unit distance: 0.1998 in every table
        assert!((opposite_squares_form_factor(1.0, 1.0) - 0.199_825).abs() < 1e-5);
        let blocked = |d: Vec3| d.y > 0.0 && (0.0..2.0).contains(&(d.x / d.y)) && (0.0..1.5).contains(&(d.z / d.y));
        let sum = covered_part(Vec3::Y, 200_000, blocked);
        assert!((sum - corner_form_factor(2.0, 1.5, 1.0)).abs() < 1e-3, "{sum}");
    }
}
