//! The light sphere: nested sets of directions from which light is asked for.
//!
//! M. Sattler, R. Sarlette, G. Zachmann, R. Klein: "Hardware-accelerated ambient occlusion computation", VMV 2004, section 3.4: the
//! vertices of an octahedron, whose edges are halved and pushed out to the sphere again and again. A finer sphere begins with the
//! coarser one's directions, so that what is known of these need not be asked anew.
//!
//! Where the paper gives each direction the same weight, here each has the solid angle of its spherical Voronoi cell: the cells of
//! k = 1026 differ by a factor of two.

use glam::{DVec3, Vec3};
use std::collections::HashMap;
use std::f64::consts::PI;
use std::ops::Range;

/// The finest level: 262,146 directions.
pub const MAX_LEVEL: u32 = 8;

/// Directions with weights, nested by level.
#[derive(Clone, Debug, PartialEq)]
pub struct LightSphere {
    level: u32,
    directions: Vec<Vec3>,
    weights: Vec<f32>,
}

impl LightSphere {
    /// The sphere of a level: the octahedron at 0.
    ///
    /// # Panics
    /// Above [`MAX_LEVEL`].
    #[must_use]
    pub fn new(level: u32) -> Self {
        assert!(level <= MAX_LEVEL, "level {level} of at most {MAX_LEVEL}");
        let (points, faces) = subdivided(level);
        let mut cells = vec![0.0; points.len()];
        // The faces are those of the points' convex hull, hence Delaunay: a test holds them to it. So a cell's corners are the
        // circumcentres of its point's faces, and each face gives each of its points the two triangles between the point, the
        // middles of its edges and the circumcentre.
        for face in faces {
            let [a, b, c] = face.map(|i| points[i as usize]);
            let center = unit((b - a).cross(c - a));
            for (i, from, to) in [(face[0], c, b), (face[1], a, c), (face[2], b, a)] {
                let p = points[i as usize];
                cells[i as usize] += solid_angle([p, unit(p + to), center]) + solid_angle([p, center, unit(p + from)]);
            }
        }
        Self {
            level,
            directions: points.iter().map(|p| p.as_vec3()).collect(),
            weights: cells.iter().map(|&w| w as f32).collect(),
        }
    }

    /// How many directions a level has, k: 6, 18, 66, 258, 1026, ...
    #[must_use]
    pub fn count(level: u32) -> usize {
        2 + (4 << (2 * level))
    }

    /// The level.
    #[must_use]
    pub fn level(&self) -> u32 {
        self.level
    }

    /// Unit directions to the light; those of a coarser level come first.
    #[must_use]
    pub fn directions(&self) -> &[Vec3] {
        &self.directions
    }

    /// Solid angle of each direction's Voronoi cell, in steradians; together 4 pi.
    #[must_use]
    pub fn weights(&self) -> &[f32] {
        &self.weights
    }

    /// The directions that this level adds to the next coarser one.
    #[must_use]
    pub fn added(&self) -> Range<usize> {
        let coarser = if self.level == 0 { 0 } else { Self::count(self.level - 1) };
        coarser..self.directions.len()
    }
}

/// Points on the sphere and the faces between them, counter-clockwise from outside.
fn subdivided(level: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut points = vec![DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    let mut faces: Vec<[u32; 3]> = vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    for _ in 0..level {
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                points.push(unit(points[a as usize] + points[b as usize]));
                points.len() as u32 - 1
            })
        };
        faces = faces
            .into_iter()
            .flat_map(|[a, b, c]| {
                let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    (points, faces)
}

/// Of a vector that is known not to be zero.
fn unit(v: DVec3) -> DVec3 {
    v / v.length()
}

/// Solid angle of a spherical triangle, negative if clockwise from outside (A. Van Oosterom, J. Strackee: "The Solid Angle of a
/// Plane Triangle", IEEE Transactions on Biomedical Engineering 30(2), 1983).
fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    let angle = 2.0 * libm::atan2(a.dot(b.cross(c)), 1.0 + a.dot(b) + b.dot(c) + c.dot(a));
    if angle > 2.0 * PI { angle - 4.0 * PI } else { angle }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finer_spheres_begin_with_the_coarser_ones() {
        let finest = LightSphere::new(5);
        for level in 0..5 {
            let sphere = LightSphere::new(level);
            assert_eq!(sphere.directions().len(), LightSphere::count(level));
            assert_eq!(sphere.directions(), &finest.directions()[..LightSphere::count(level)]);
            assert_eq!(sphere.added().end, LightSphere::count(level));
        }
        assert_eq!([0, 1, 2, 3, 4].map(LightSphere::count), [6, 18, 66, 258, 1026]);
        assert_eq!((LightSphere::new(0).added(), finest.added()), (0..6, 1026..4098));
    }

    #[test]
    fn the_faces_are_a_convex_hull() {
        for level in 0..=6 {
            let (points, faces) = subdivided(level);
            let mut opposite: HashMap<[u32; 2], DVec3> = HashMap::new();
            for face in &faces {
                for k in 0..3 {
                    opposite.insert([face[k], face[(k + 1) % 3]], points[face[(k + 2) % 3] as usize]);
                }
            }
            for face in &faces {
                let [a, b, c] = face.map(|i| points[i as usize]);
                let normal = unit((b - a).cross(c - a));
                assert!(normal.dot(a) > 0.0, "outwards");
                for k in 0..3 {
                    let across = opposite[&[face[(k + 1) % 3], face[k]]];
                    assert!(normal.dot(across - a) < 0.0, "level {level}: a dent at {a}");
                }
            }
        }
    }

    #[test]
    fn weights_are_the_areas_of_voronoi_cells() {
        for level in 0..=6 {
            let weights = LightSphere::new(level).weights().to_vec();
            let sum: f64 = weights.iter().map(|&w| f64::from(w)).sum();
            assert!((sum / (4.0 * PI) - 1.0).abs() < 1e-6, "level {level}: {sum}");
            assert!(weights.iter().all(|&w| w > 0.0));
        }
        // By where many even points are nearest.
        let sphere = LightSphere::new(2);
        let mut counts = vec![0u32; sphere.directions().len()];
        let points = crate::sphere::fibonacci_sphere(400_000);
        for p in &points {
            let nearest = (0..counts.len()).max_by(|&a, &b| {
                let [a, b] = [a, b].map(|i| sphere.directions()[i].dot(*p));
                a.total_cmp(&b)
            });
            counts[nearest.unwrap()] += 1;
        }
        for (&count, &weight) in counts.iter().zip(sphere.weights()) {
            let share = count as f32 / points.len() as f32 * (4.0 * PI) as f32;
            assert!((share / weight - 1.0).abs() < 0.01, "{share} {weight}");
        }
    }
}
