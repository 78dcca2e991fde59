//! Polygons into triangles: convex ones as a fan, others by cutting ears, without new vertices.

use glam::{DVec2, DVec3, Vec3Swizzles};

/// Cutting ears takes time with the square of the corners, which a small file can have many of; a larger polygon becomes a fan.
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

/// Cuts one ear after the other, of all the one whose smallest angle is largest: slivers catch light badly.
fn cut_ears(flat: &[DVec2], out: &mut Vec<[usize; 3]>) {
    let count = flat.len();
    let mut outline = Outline {
        flat,
        corners: (0..count)
            .map(|i| Corner { before: (i + count - 1) % count, after: (i + 1) % count, ..Corner::default() })
            .collect(),
    };
    (0..count).for_each(|i| outline.reshape(i));
    let mut left: Vec<usize> = (0..count).collect();
    while left.len() > 3 {
        let mut best: Option<(f64, usize)> = None;
        for (at, &i) in left.iter().enumerate() {
            let Some(quality) = outline.corners[i].quality else { continue };
            if best.is_none_or(|(least, _)| quality > least) && !outline.is_blocked(i) {
                best = Some((quality, at));
            }
        }
        // A polygon that crosses itself may have no ear left: any corner does then.
        let ear = left.remove(best.map_or(1, |(_, at)| at));
        let Corner { before, after, .. } = outline.corners[ear];
        out.push([before, ear, after]);
        outline.corners[ear].gone = true;
        outline.corners[before].after = after;
        outline.corners[after].before = before;
        outline.reshape(before);
        outline.reshape(after);
    }
    out.push([left[0], left[1], left[2]]);
}

/// What is left of a polygon.
struct Outline<'a> {
    flat: &'a [DVec2],
    corners: Vec<Corner>,
}

#[derive(Clone, Copy, Default)]
struct Corner {
    before: usize,
    after: usize,
    gone: bool,
    /// How good a triangle it makes with its neighbours; none where the outline turns inwards.
    quality: Option<f64>,
    /// Corners before this one are known not to lie in that triangle. Corners only ever go, so that this only grows while the
    /// triangle stays the same, and all cuts together look at each pair of corners a few times at most.
    searched: usize,
}

impl Outline<'_> {
    fn turn(&self, a: usize, b: usize, c: usize) -> f64 {
        (self.flat[b] - self.flat[a]).perp_dot(self.flat[c] - self.flat[a])
    }

    /// Takes note of a corner's triangle, which is a new one.
    fn reshape(&mut self, corner: usize) {
        let flat = self.flat;
        let Corner { before: a, after: c, .. } = self.corners[corner];
        let area = self.turn(a, corner, c);
        let longest = flat[a]
            .distance_squared(flat[corner])
            .max(flat[corner].distance_squared(flat[c]))
            .max(flat[c].distance_squared(flat[a]));
        let quality = if longest > 0.0 { area / longest } else { 0.0 };
        self.corners[corner].quality = (area >= 0.0).then_some(quality);
        self.corners[corner].searched = 0;
    }

    /// Whether another corner lies in a corner's triangle.
    fn is_blocked(&mut self, corner: usize) -> bool {
        let flat = self.flat;
        let Corner { before: a, after: c, searched, .. } = self.corners[corner];
        let b = corner;
        let blocks = |&p: &usize| {
            !self.corners[p].gone
                && ![a, b, c].contains(&p)
                && ![flat[a], flat[b], flat[c]].contains(&flat[p])
                && self.turn(a, b, p) >= 0.0
                && self.turn(b, c, p) >= 0.0
                && self.turn(c, a, p) >= 0.0
        };
        let found = (searched..flat.len()).find(blocks).unwrap_or(flat.len());
        self.corners[corner].searched = found;
        found < flat.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

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

    /// A thin ribbon that goes up and down, in which nearly every triangle of neighbours holds a far corner.
    fn ribbon(corners: u32) -> Vec<DVec3> {
        let at = |i: u32, below: f64| DVec3::new(f64::from(i), if i.is_multiple_of(2) { 100.0 } else { 0.0 } - below, 0.0);
        (0..corners / 2).map(|i| at(i, 0.0)).chain((0..corners / 2).rev().map(|i| at(i, 0.1))).collect()
    }

    #[test]
    fn large_polygons_take_time_with_their_square() {
        let corners = ribbon(1024);
        let flat = project(corners.len(), |i| corners[i]);
        let mut out = Vec::new();
        let begun = Instant::now();
        cut_ears(&flat, &mut out);
        let seconds = begun.elapsed().as_secs_f64();
        let begun = Instant::now();
        assert_eq!(out, cut_simply(&flat));
        // 5 ms and 360 ms; at 2,048 corners 30 ms and 2.2 s
        assert!(seconds * 8.0 < begun.elapsed().as_secs_f64(), "{seconds} s");
    }

    /// What [`cut_ears`] must give, said simply: all ears are looked for anew before each cut.
    fn cut_simply(flat: &[DVec2]) -> Vec<[usize; 3]> {
        let turn = |a: usize, b: usize, c: usize| (flat[b] - flat[a]).perp_dot(flat[c] - flat[a]);
        let mut left: Vec<usize> = (0..flat.len()).collect();
        let mut out = Vec::new();
        while left.len() > 3 {
            let count = left.len();
            let mut best = (f64::NEG_INFINITY, 1);
            for i in 0..count {
                let (a, b, c) = (left[(i + count - 1) % count], left[i], left[(i + 1) % count]);
                let longest =
                    [(a, b), (b, c), (c, a)].map(|(p, q)| flat[p].distance_squared(flat[q])).into_iter().fold(0.0, f64::max);
                let quality = if longest > 0.0 { turn(a, b, c) / longest } else { 0.0 };
                let inside = |&&p: &&usize| {
                    ![flat[a], flat[b], flat[c]].contains(&flat[p])
                        && turn(a, b, p) >= 0.0
                        && turn(b, c, p) >= 0.0
                        && turn(c, a, p) >= 0.0
                };
                if quality > best.0 && turn(a, b, c) >= 0.0 && left.iter().find(inside).is_none() {
                    best = (quality, i);
                }
            }
            let ear = best.1;
            out.push([left[(ear + count - 1) % count], left[ear], left[(ear + 1) % count]]);
            left.remove(ear);
        }
        out.push([left[0], left[1], left[2]]);
        out
    }

    proptest::proptest! {
        #[test]
        fn ears_are_cut_as_if_all_were_looked_for_anew(corners in proptest::collection::vec((0_i8..12, 0_i8..12), 4..40)) {
            let flat: Vec<DVec2> = corners.iter().map(|&(x, y)| DVec2::new(f64::from(x), f64::from(y))).collect();
            let mut out = Vec::new();
            cut_ears(&flat, &mut out);
            proptest::prop_assert_eq!(out, cut_simply(&flat));
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
