//! Rays against the stage's triangles, a few hundred a frame: for feet and shoulders, and for lamps.
//!
//! The clusters that culling keeps anyway, in a tree of boxes, are the hierarchy: a ray tests every chunk's box, then some twenty clusters' boxes, then some hundred triangles. A hierarchy
//! over 700,000 triangles would take some 40 MB; this one takes one.

use super::cluster_tree::ClusterTree;
use crate::daylight::chunk::KeptChunk;
use glam::Vec3;
use heliodon_math::frame::unit_or;
use std::sync::Arc;

/// Where a ray meets the ground or a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Distance along the unit direction.
    pub distance: f32,
    /// Unit normal of the triangle, on the ray's side.
    pub normal: Vec3,
    /// Which chunk the triangle is of, in the order of the bundle's.
    pub chunk: usize,
}

/// The geometry of a stage.
#[derive(Clone, Debug, Default)]
pub struct Ground {
    chunks: Vec<Arc<KeptChunk>>,
    /// Of each chunk.
    trees: Vec<Arc<ClusterTree>>,
}

impl Ground {
    /// Adds a chunk.
    pub fn push(&mut self, chunk: Arc<KeptChunk>) {
        self.trees.push(Arc::new(ClusterTree::new(&chunk.clusters)));
        self.chunks.push(chunk);
    }

    /// The chunks in the bundle's order, as far as they are there.
    #[must_use]
    pub fn chunks(&self) -> &[Arc<KeptChunk>] {
        &self.chunks
    }

    /// The box around everything, when there is anything.
    #[must_use]
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.chunks.iter().map(|chunk| chunk.bounds).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    /// The nearest triangle within `reach` from `origin` in the unit direction `direction`, from either side.
    #[must_use]
    pub fn cast(&self, origin: Vec3, direction: Vec3, reach: f32) -> Option<Touch> {
        let mut nearest = Nearest { reach, touch: None };
        self.search(
            &mut nearest,
            |nearest, bounds| enters_box(origin, direction, nearest.reach, bounds),
            |nearest, chunk, corners| {
                if let Some((distance, normal)) = meets_triangle(origin, direction, nearest.reach, corners) {
                    nearest.reach = distance;
                    nearest.touch = Some(Touch { distance, normal, chunk });
                }
            },
        );
        nearest.touch
    }

    /// The place of the stone nearest to `place`, within `reach`; the normal points to `place`.
    #[must_use]
    pub fn nearest(&self, place: Vec3, reach: f32) -> Option<Touch> {
        let mut nearest = Nearest { reach, touch: None };
        self.search(
            &mut nearest,
            |nearest, (low, high)| Some(place.distance(place.clamp(low, high))).filter(|far| *far <= nearest.reach),
            |nearest, chunk, corners| {
                let at = nearest_of_triangle(place, corners);
                let distance = place.distance(at);
                if distance < nearest.reach {
                    nearest.reach = distance;
                    nearest.touch = Some(Touch { distance, normal: facing(corners, at - place), chunk });
                }
            },
        );
        nearest.touch
    }

    /// Shows the triangles of boxes that count, with their chunks' numbers: see [`ClusterTree::search`].
    fn search(
        &self,
        nearest: &mut Nearest,
        far: impl Fn(&Nearest, (Vec3, Vec3)) -> Option<f32>,
        mut met: impl FnMut(&mut Nearest, usize, [Vec3; 3]),
    ) {
        for (number, (chunk, tree)) in self.chunks.iter().zip(&self.trees).enumerate() {
            tree.search(nearest, &far, |nearest, cluster| {
                let range = &chunk.clusters[cluster].indices;
                for triangle in chunk.indices[range.start as usize..range.end as usize].chunks_exact(3) {
                    met(nearest, number, [0, 1, 2].map(|k| chunk.positions[usize::from(triangle[k])]));
                }
            });
        }
    }
}

/// What a search has found so far.
struct Nearest {
    /// Nothing farther counts.
    reach: f32,
    touch: Option<Touch>,
}

/// How far away a ray enters a box, none within it; nothing where it passes by or is farther than `reach`.
fn enters_box(origin: Vec3, direction: Vec3, reach: f32, (low, high): (Vec3, Vec3)) -> Option<f32> {
    let inverse = direction.recip();
    let (a, b) = ((low - origin) * inverse, (high - origin) * inverse);
    // A ray in a face of the box gives NaN, which min and max pass over.
    let near = a.min(b).max_element().max(0.0);
    let far = a.max(b).min_element().min(reach);
    (near <= far || [near, far].iter().any(|t| t.is_nan())).then_some(near)
}

/// Whether a ray meets a box within `reach`.
pub(crate) fn meets_box(origin: Vec3, direction: Vec3, reach: f32, bounds: (Vec3, Vec3)) -> bool {
    enters_box(origin, direction, reach, bounds).is_some()
}

/// How far away a ray meets a triangle from either side, and the unit normal on the ray's side.
///
/// Moeller and Trumbore: "Fast, Minimum Storage Ray/Triangle Intersection", 1997.
pub(crate) fn meets_triangle(origin: Vec3, direction: Vec3, reach: f32, corners: [Vec3; 3]) -> Option<(f32, Vec3)> {
    let [a, b, c] = corners;
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(ac);
    let determinant = ab.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let s = origin - a;
    let u = s.dot(p) / determinant;
    let q = s.cross(ab);
    let v = direction.dot(q) / determinant;
    let distance = ac.dot(q) / determinant;
    let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance >= 0.0 && distance < reach;
    inside.then(|| (distance, facing(corners, direction)))
}

/// A triangle's unit normal on the side from which something comes along a direction.
fn facing([a, b, c]: [Vec3; 3], along: Vec3) -> Vec3 {
    let normal = unit_or((b - a).cross(c - a), Vec3::Y);
    if normal.dot(along) > 0.0 { -normal } else { normal }
}

/// The place of a triangle that is nearest to another.
///
/// C. Ericson: "Real-Time Collision Detection", 2005, section 5.1.5.
pub(crate) fn nearest_of_triangle(place: Vec3, [a, b, c]: [Vec3; 3]) -> Vec3 {
    // of an edge without length its beginning
    let share = |along: f32, whole: f32| if whole > 0.0 { along / whole } else { 0.0 };
    let (ab, ac, ap) = (b - a, c - a, place - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = place - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * share(d1, d1 - d3);
    }
    let cp = place - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * share(d2, d2 - d6);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * share(d4 - d3, (d4 - d3) + (d5 - d6));
    }
    let whole = va + vb + vc;
    a + ab * share(vb, whole) + ac * share(vc, whole)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::daylight::cluster::cluster;
    use heliodon_math::random::Pcg32;

    /// Forty metres of ground at a height.
    pub(crate) fn floor(height: f32) -> Arc<KeptChunk> {
        let n = 40;
        let at = |i: i32, j: i32| Vec3::new(i as f32 - 20.0, height, j as f32 - 20.0);
        let positions: Vec<Vec3> = (0..=n).flat_map(|j| (0..=n).map(move |i| at(i, j))).collect();
        let mut triangles = Vec::new();
        for j in 0..n as u32 {
            for i in 0..n as u32 {
                let a = j * (n as u32 + 1) + i;
                triangles.push([a, a + n as u32 + 1, a + 1]);
                triangles.push([a + 1, a + n as u32 + 1, a + n as u32 + 2]);
            }
        }
        let made = cluster(&positions, &triangles);
        let positions: Vec<Vec3> = made.vertices.iter().map(|&v| positions[v as usize]).collect();
        let bounds = (Vec3::new(-20.0, height, -20.0), Vec3::new(20.0, height, 20.0));
        Arc::new(KeptChunk { positions, indices: made.indices, clusters: made.clusters, bounds, albedo: Vec::new() })
    }

    #[test]
    fn feet_find_the_upper_of_two_floors() {
        let mut ground = Ground::default();
        ground.push(floor(0.0));
        ground.push(floor(1.0));
        let touch = ground.cast(Vec3::new(3.3, 2.5, -7.7), Vec3::NEG_Y, 10.0);
        let touch = touch.expect("a floor is below");
        assert!((touch.distance - 1.5).abs() < 1e-5 && touch.normal.dot(Vec3::Y) > 0.999);
        assert_eq!(ground.cast(Vec3::new(3.3, 2.5, -7.7), Vec3::NEG_Y, 1.0), None);
        assert_eq!(ground.cast(Vec3::new(30.0, 2.5, 0.0), Vec3::NEG_Y, 10.0), None);
        assert_eq!(ground.cast(Vec3::new(3.3, 0.5, -7.7), Vec3::Y, 10.0).map(|t| t.normal.y < -0.9), Some(true));
    }

    #[test]
    fn the_nearest_stone_is_found_and_which_it_is() {
        let mut ground = Ground::default();
        ground.push(floor(0.0));
        ground.push(floor(1.0));
        let touch = ground.nearest(Vec3::new(3.3, 0.8, -7.7), 0.5).unwrap();
        assert!((touch.distance - 0.2).abs() < 1e-5 && touch.normal.dot(Vec3::NEG_Y) > 0.999 && touch.chunk == 1);
        // beyond an edge, and out of reach
        let touch = ground.nearest(Vec3::new(20.3, -0.4, 0.2), 0.6).unwrap();
        assert!((touch.distance - 0.5).abs() < 1e-5 && touch.chunk == 0);
        assert_eq!(ground.nearest(Vec3::new(3.3, 0.5, -7.7), 0.4), None);
        assert_eq!(ground.cast(Vec3::new(3.3, 2.5, -7.7), Vec3::NEG_Y, 10.0).map(|touch| touch.chunk), Some(1));
    }

    #[test]
    fn what_is_found_is_what_every_triangle_tells() {
        let mut random = Pcg32::new(7, 1);
        let mut between = |low: f32, high: f32| random.range_f32(low, high);
        let mut ground = Ground::default();
        for height in [-3.0, 0.5, 2.0] {
            let mut chunk = Arc::unwrap_or_clone(floor(height));
            chunk.positions.iter_mut().for_each(|place| place.y += 0.2 * libm::sinf(3.0 * place.x) * libm::cosf(2.0 * place.z));
            for cluster in &mut chunk.clusters {
                cluster.half.y += 0.2;
            }
            ground.push(Arc::new(chunk));
        }
        let corners: Vec<[Vec3; 3]> = ground
            .chunks()
            .iter()
            .flat_map(|chunk| {
                chunk.indices.chunks_exact(3).map(|triangle| [0, 1, 2].map(|k| chunk.positions[usize::from(triangle[k])]))
            })
            .collect();
        for _ in 0..300 {
            let [origin, toward] =
                [12.0, 1.0].map(|far: f32| Vec3::new(between(-far, far), between(-far, far), between(-far, far)));
            let direction = unit_or(toward, Vec3::X);
            let wanted = corners
                .iter()
                .filter_map(|corners| meets_triangle(origin, direction, 9.0, *corners))
                .map(|met| met.0)
                .reduce(f32::min);
            assert_eq!(ground.cast(origin, direction, 9.0).map(|touch| touch.distance), wanted, "{origin} {direction}");
            let wanted = corners.iter().map(|corners| origin.distance(nearest_of_triangle(origin, *corners))).reduce(f32::min);
            assert_eq!(ground.nearest(origin, 4.0).map(|touch| touch.distance), wanted.filter(|far| *far < 4.0), "{origin}");
        }
    }

    #[test]
    fn the_nearest_place_of_a_triangle_is_nowhere_farther_than_any_other() {
        let triangle = [Vec3::new(0.2, 0.0, 0.1), Vec3::new(1.4, 0.3, -0.2), Vec3::new(0.5, 1.1, 0.4)];
        let mixed = |u: f32, v: f32| triangle[0] * (1.0 - u - v) + triangle[1] * u + triangle[2] * v;
        for number in 0..400 {
            let at = |k: u32| (number * k % 101) as f32 / 25.0 - 1.5;
            let place = Vec3::new(at(7), at(13), at(29));
            let found = place.distance(nearest_of_triangle(place, triangle));
            let grid = (0..=60).flat_map(|i| (0..=60 - i).map(move |j| (i as f32 / 60.0, j as f32 / 60.0)));
            let least = grid.map(|(u, v)| place.distance(mixed(u, v))).fold(f32::INFINITY, f32::min);
            assert!(found <= least + 1e-5 && found > least - 0.03, "{place}: {found}, {least}");
        }
        // a triangle that is none
        assert_eq!(nearest_of_triangle(Vec3::Y, [Vec3::ZERO; 3]), Vec3::ZERO);
    }

    #[test]
    fn nothing_is_met_in_an_empty_stage() {
        assert_eq!(Ground::default().cast(Vec3::ZERO, Vec3::NEG_Y, 1e9), None);
        assert_eq!(Ground::default().bounds(), None);
    }
}
