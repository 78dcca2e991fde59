//! Polygons into triangles: convex ones as a fan, others by cutting ears, without new vertices.

use glam::{DVec2, DVec3, Vec3Swizzles};

/// Cutting ears takes time with the square of the corners; a larger polygon becomes a fan.
pub(crate) const MOST_CORNERS_TO_CUT: usize = 2048;

/// The corners of the triangles, as indices into the polygon, in its winding; nothing for fewer than three corners.
///
/// `position` answers where a corner is. Triangles that lie wrongly (a self-crossing polygon) cannot be avoided, but there are
/// always `count - 2` of them.
pub(crate) fn triangulate(count: usize, position: impl Fn(usize) -> DVec3, out: &mut Vec<[usize; 3]>) {
    out.clear();
    if count <= 3 || count > MOST_CORNERS_TO_CUT {
        out.extend((2..count).map(|i| [0, i - 1, i]));
        return;
    }
    let flat = project(count, position);
    let turn = |a: usize, b: usize, c: usize| (flat[b] - flat[a]).perp_dot(flat[c] - flat[a]);
    let convex = (0..count).all(|i| turn(i, (i + 1) % count, (i + 2) % count) >= 0.0);
    if convex {
        out.extend((2..count).map(|i| [0, i - 1, i]));
        return;
    }
    cut_ears(&flat, out);
}

/// The polygon seen along its normal (Newell's), counter-clockwise.
fn project(count: usize, position: impl Fn(usize) -> DVec3) -> Vec<DVec2> {
    let first = position(0);
    let corners: Vec<DVec3> = (0..count).map(|i| position(i) - first).collect();
    let mut normal = DVec3::ZERO;
    for (i, &a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % count];
        normal += (a - b).yzx() * (a + b).zxy();
    }
    let size = normal.abs();
    let [u, v] = if size.z >= size.x && size.z >= size.y {
        [0, 1]
    } else if size.x >= size.y {
        [1, 2]
    } else {
        [2, 0]
    };
    let towards_viewer = if [normal.x, normal.y, normal.z][3 - u - v] < 0.0 { -1.0 } else { 1.0 };
    corners.iter().map(|p| DVec2::new(p[u] * towards_viewer, p[v])).collect()
}

fn cut_ears(flat: &[DVec2], out: &mut Vec<[usize; 3]>) {
    let turn = |a: usize, b: usize, c: usize| (flat[b] - flat[a]).perp_dot(flat[c] - flat[a]);
    let mut left: Vec<usize> = (0..flat.len()).collect();
    while left.len() > 3 {
        let count = left.len();
        // Of the ears, the one whose smallest angle is largest: slivers catch light badly.
        let mut best: Option<(f64, usize)> = None;
        for i in 0..count {
            let (a, b, c) = (left[(i + count - 1) % count], left[i], left[(i + 1) % count]);
            let area = turn(a, b, c);
            if area < 0.0 {
                continue;
            }
            let longest =
                flat[a].distance_squared(flat[b]).max(flat[b].distance_squared(flat[c])).max(flat[c].distance_squared(flat[a]));
            let quality = if longest > 0.0 { area / longest } else { 0.0 };
            if best.is_some_and(|(least, _)| quality <= least) {
                continue;
            }
            let blocked = left.iter().any(|&p| {
                p != a
                    && p != b
                    && p != c
                    && flat[p] != flat[a]
                    && flat[p] != flat[b]
                    && flat[p] != flat[c]
                    && turn(a, b, p) >= 0.0
                    && turn(b, c, p) >= 0.0
                    && turn(c, a, p) >= 0.0
            });
            if !blocked {
                best = Some((quality, i));
            }
        }
        // A polygon that crosses itself may have no ear left: any corner does then.
        let ear = best.map_or(1, |(_, i)| i);
        out.push([left[(ear + count - 1) % count], left[ear], left[(ear + 1) % count]]);
        left.remove(ear);
    }
    out.push([left[0], left[1], left[2]]);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[DVec3], triangles: &[[usize; 3]]) -> (f64, f64) {
        triangles.iter().fold((0.0, 0.0), |(signed, whole), t| {
            let [a, b, c] = t.map(|i| corners[i]);
            let z = (b - a).cross(c - a).z / 2.0;
            (signed + z, whole + z.abs())
        })
    }

    fn cut(corners: &[DVec3]) -> Vec<[usize; 3]> {
        let mut out = Vec::new();
        triangulate(corners.len(), |i| corners[i], &mut out);
        assert_eq!(out.len(), corners.len() - 2);
        out
    }

    #[test]
    fn a_concave_outline_is_covered_once() {
        let comb = [(0., 0.), (7., 0.), (7., 3.), (6., 1.), (5., 3.), (4., 1.), (3., 3.), (2., 1.), (1., 3.), (0., 1.)];
        let mut corners: Vec<DVec3> = comb.iter().map(|&(x, y)| DVec3::new(x, y, 0.3)).collect();
        for turn in 0..corners.len() {
            corners.rotate_left(1);
            let triangles = cut(&corners);
            let (signed, whole) = area(&corners, &triangles);
            let outline: f64 = (0..corners.len())
                .map(|i| corners[i].truncate().perp_dot(corners[(i + 1) % corners.len()].truncate()) / 2.0)
                .sum();
            assert!((signed - outline).abs() < 1e-12 && (whole - outline).abs() < 1e-12, "turned by {turn}");
        }
    }

    #[test]
    fn a_dart_is_cut_at_its_hollow() {
        let dart = [(0., 0.), (4., -1.), (1., 0.), (4., 1.)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let (signed, whole) = area(&dart, &cut(&dart));
        assert!((signed - whole).abs() < 1e-12);
    }

    #[test]
    fn winding_is_kept_in_any_plane() {
        for normal in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z] {
            let (u, v) = normal.any_orthonormal_pair();
            let corners = [(0., 0.), (2., 0.), (2., 2.), (1., 0.5), (0., 2.)].map(|(x, y)| u * x + v * y);
            for t in cut(&corners) {
                let [a, b, c] = t.map(|i| corners[i]);
                assert!((b - a).cross(c - a).dot(u.cross(v)) > 0.0);
            }
        }
    }

    #[test]
    fn nonsense_still_gives_as_many_triangles() {
        cut(&[DVec3::ZERO; 7]);
        cut(&[DVec3::NAN; 9]);
        cut(&[0.0, 5.0, 1.0, 4.0, 2.0, 3.0].map(|x| DVec3::new(x, (x * 7.0) % 3.0, 0.0)));
        let mut out = Vec::new();
        triangulate(2, |_| DVec3::ZERO, &mut out);
        assert!(out.is_empty());
    }
}
