//! What many triangles looked like, at the few vertices that stand for them.
//!
//! A vertex that simplification leaves has the colour and the normal of its own place, which on pebbles and grass says little of the places
//! that its triangles now cover: the picture would be blotched with what chance left. Here vertices take those values whose
//! interpolation over the triangles is closest to the original's, in the sense of least squares weighted by area. Where nothing was
//! simplified that is what they had.

use super::closest::{center, weights_of_closest};
use super::nearest::Nearest;
use glam::Vec3;
use heliodon_math::frame::unit_or;
use heliodon_mesh::Mesh;

/// What a vertex looks like: its linear colour, and its normal.
pub type Look = [Vec3; VALUES];

const VALUES: usize = 2;
/// Rounds of the solver: what a vertex alone has of its own is halved in each.
const ROUNDS: usize = 8;
/// Normals turn by less than 60 degrees: what would turn farther stands across an edge.
const AGREES: f32 = 0.5;

/// What a triangle stands for: the products of its corners' weights, and of these and the values, summed over the areas of the original's triangles.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// Of the weights of corners 0 and 0, 1 and 1, 2 and 2, 0 and 1, 1 and 2, 2 and 0.
    weights: [f32; 6],
    values: [Look; 3],
}

impl Sums {
    fn add(&mut self, area: f32, weights: Vec3, values: Look) {
        let [a, b, c] = weights.to_array();
        let products = [a * a, b * b, c * c, a * b, b * c, c * a];
        self.weights.iter_mut().zip(products).for_each(|(sum, product)| *sum += area * product);
        for (sums, weight) in self.values.iter_mut().zip([a, b, c]) {
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += area * weight * value);
        }
    }

    /// The weight of each corner, and how far the values that the corners give are from those that they should.
    fn residuals(&self, corners: [Look; 3]) -> [(f32, Look); 3] {
        let [aa, bb, cc, ab, bc, ca] = self.weights;
        let rows = [[aa, ab, ca], [ab, bb, bc], [ca, bc, cc]];
        core::array::from_fn(|corner| {
            let row = rows[corner];
            let of = |value: usize| {
                let given = corners[0][value] * row[0] + corners[1][value] * row[1] + corners[2][value] * row[2];
                self.values[corner][value] - given
            };
            (row.iter().sum(), core::array::from_fn(of))
        })
    }
}

/// Colours and normals of the simplified vertices, where the mesh has them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Averages {
    /// Linear, in [0, 1]; as long as the simplified mesh's.
    pub colors_linear: Vec<Vec3>,
    /// Of length 1; as long as the simplified mesh's.
    pub normals: Vec<Vec3>,
}

/// The colours and normals with which a simplified mesh looks most like its original, whose vertices have the look that `look` tells. `stands_for`
/// says for each triangle of the original which of the simplified mesh stands for it, as [`super::nearest_triangles`] finds.
///
/// # Panics
/// When `stands_for` has not as many triangles as the original, or a triangle names a vertex that does not exist.
#[must_use]
pub fn averages(original: &Mesh, look: impl Fn(u32) -> Look, simplified: &Mesh, stands_for: &[u32]) -> Averages {
    assert_eq!(stands_for.len(), original.triangles.len(), "triangles of the original");
    let mut sums = vec![Sums::default(); simplified.triangles.len()];
    for (t, &to) in stands_for.iter().enumerate() {
        if to == Nearest::NONE {
            continue;
        }
        let corners = original.corners(t);
        let across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let area = across.length();
        if !(area > 0.0 && area.is_finite()) {
            continue;
        }
        let target = simplified.corners(to as usize);
        let weights = weights_of_closest(target, center(original, t));
        let [a, b, c] = original.triangles[t].map(&look);
        let mut values = core::array::from_fn(|value| (a[value] + b[value] + c[value]) / 3.0);
        // the other side of a thin wall says nothing of this one's slope
        let facing = unit_or((target[1] - target[0]).cross(target[2] - target[0]), across / area);
        if values[1].dot(facing) < AGREES * values[1].length() {
            values[1] = facing;
        }
        sums[to as usize].add(area, weights, values);
    }
    let before: Vec<Look> = (0..simplified.positions.len() as u32).map(|vertex| look_of(simplified, vertex)).collect();
    let mut values = before.clone();
    for _ in 0..ROUNDS {
        let mut changes = vec![(0.0_f32, [Vec3::ZERO; VALUES]); values.len()];
        for (triangle, sums) in simplified.triangles.iter().zip(&sums) {
            let residuals = sums.residuals(triangle.map(|vertex| values[vertex as usize]));
            for (&vertex, (weight, residual)) in triangle.iter().zip(residuals) {
                let (all, change) = &mut changes[vertex as usize];
                *all += weight;
                change.iter_mut().zip(residual).for_each(|(change, residual)| *change += residual);
            }
        }
        for (values, (weight, change)) in values.iter_mut().zip(changes) {
            if weight > 0.0 {
                values.iter_mut().zip(change).for_each(|(value, change)| *value += change / weight);
            }
        }
    }
    let color = |[color, _]: &Look| color.clamp(Vec3::ZERO, Vec3::ONE);
    let normal = |([_, normal], [_, before]): (&Look, &Look)| {
        let normal = unit_or(*normal, *before);
        if normal.dot(*before) > AGREES { normal } else { *before }
    };
    let has = |values: &[Vec3]| !values.is_empty();
    Averages {
        colors_linear: if has(&simplified.colors_linear) { values.iter().map(color).collect() } else { Vec::new() },
        normals: if has(&simplified.normals) { values.iter().zip(&before).map(normal).collect() } else { Vec::new() },
    }
}

/// What a vertex of a mesh looks like; zero where the mesh does not say.
#[must_use]
pub fn look_of(mesh: &Mesh, vertex: u32) -> Look {
    [&mesh.colors_linear, &mesh.normals].map(|values| values.get(vertex as usize).copied().unwrap_or(Vec3::ZERO))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn averages_of(original: &Mesh, simplified: &Mesh, stands_for: &[u32]) -> Averages {
        averages(original, |vertex| look_of(original, vertex), simplified, stands_for)
    }

    /// A plate of `side` times `side` squares of a metre in all, whose vertices have these colours.
    fn plate(side: u32, color: impl Fn(Vec3) -> Vec3) -> Mesh {
        let at = |i: u32| Vec3::new((i % (side + 1)) as f32, 0.0, -((i / (side + 1)) as f32)) / side as f32;
        let positions: Vec<Vec3> = (0..(side + 1) * (side + 1)).map(at).collect();
        let squares = (0..side * side).map(|i| i / side * (side + 1) + i % side);
        Mesh {
            normals: vec![Vec3::Y; positions.len()],
            colors_linear: positions.iter().map(|&p| color(p)).collect(),
            triangles: squares.flat_map(|v| [[v, v + 1, v + side + 2], [v, v + side + 2, v + side + 1]]).collect(),
            positions,
            ..Mesh::default()
        }
    }

    /// The triangle of a coarse plate that each one of a fine plate lies in.
    fn within(fine: &Mesh, coarse: &Mesh) -> Vec<u32> {
        let nearest = |t| {
            let point = center(fine, t);
            let inside = |of: &usize| {
                let corners = coarse.corners(*of);
                let weights = weights_of_closest(corners, point);
                (corners[0] * weights.x + corners[1] * weights.y + corners[2] * weights.z).distance(point) < 1e-4
            };
            (0..coarse.triangles.len()).find(inside).unwrap() as u32
        };
        (0..fine.triangles.len()).map(nearest).collect()
    }

    #[test]
    fn speckles_become_what_they_are_together() {
        let speckled = plate(48, |p| Vec3::splat(if (p.x * 48.0 + p.z * -48.0 * 7.0) as i32 % 3 == 0 { 0.9 } else { 0.3 }));
        let chance = plate(4, |p| Vec3::splat(if p.x > 0.5 { 0.9 } else { 0.3 }));
        let found = averages_of(&speckled, &chance, &within(&speckled, &chance));
        for color in &found.colors_linear {
            assert!((color.x - 0.5).abs() < 0.03, "{color}");
        }
        assert!(found.normals.iter().all(|normal| normal.dot(Vec3::Y) > 0.9999));
    }

    #[test]
    fn what_was_not_simplified_stays_and_what_is_linear_too() {
        let noise = |p: Vec3| Vec3::new(0.5 + 0.4 * (p.x * 91.0).sin(), 0.5 + 0.4 * (p.z * 57.0).sin(), 0.2);
        let mesh = plate(12, noise);
        let same: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let kept = averages_of(&mesh, &mesh, &same);
        assert!(kept.colors_linear.iter().zip(&mesh.colors_linear).all(|(a, b)| a.abs_diff_eq(*b, 1e-5)));
        let ramp = |p: Vec3| Vec3::new(p.x, -p.z, 0.5);
        let (fine, coarse) = (plate(40, ramp), plate(5, |_| Vec3::ZERO));
        let found = averages_of(&fine, &coarse, &within(&fine, &coarse));
        for (color, &p) in found.colors_linear.iter().zip(&coarse.positions) {
            assert!(color.abs_diff_eq(ramp(p), 0.03), "{color} at {p}");
        }
    }

    #[test]
    fn waves_become_a_plain_and_edges_stay() {
        let mut waves = plate(48, |_| Vec3::ONE);
        let slope = |p: &Vec3| if (p.x * 48.0).round() % 2.0 == 0.0 { 0.7 } else { -0.7 };
        waves.normals = waves.positions.iter().map(|p| unit_or(Vec3::new(slope(p), 1.0, 0.0), Vec3::Y)).collect();
        let mut coarse = plate(4, |_| Vec3::ONE);
        coarse.normals.fill(unit_or(Vec3::new(0.8, 1.0, 0.0), Vec3::Y));
        // one vertex belongs to a wall
        coarse.normals[12] = Vec3::X;
        let found = averages_of(&waves, &coarse, &within(&waves, &coarse));
        for (i, normal) in found.normals.iter().enumerate() {
            assert_eq!(normal.dot(Vec3::Y) > 0.99, i != 12, "{normal}");
        }
    }

    #[test]
    fn nothing_comes_of_nothing() {
        let mesh = plate(2, |_| Vec3::ONE);
        let found = averages_of(&mesh, &mesh, &[Nearest::NONE; 8]);
        assert_eq!((found.colors_linear, found.normals), (mesh.colors_linear.clone(), mesh.normals.clone()));
        assert_eq!(averages_of(&Mesh::default(), &Mesh::default(), &[]), Averages::default());
    }
}
