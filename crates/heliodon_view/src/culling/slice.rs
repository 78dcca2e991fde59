//! A plane through stone, and large rectangles of the plane that lie in it.

use super::rectangles::{Cells, Rectangle, area};
use glam::{DVec2, DVec3, Vec2Swizzles, Vec3};
use heliodon_math::frame::orthonormal_basis;

/// Axes of a plane: along it, and its normal, right-handed.
#[derive(Clone, Copy, Debug)]
pub struct Axes([DVec3; 3]);

impl Axes {
    /// For planes with this unit normal. Where it is level, the first axis is level too and the second points up: walls are made of level courses.
    #[must_use]
    pub fn new(normal: Vec3) -> Self {
        let n = normal.as_dvec3();
        let u = match DVec3::Y.cross(n).try_normalize().filter(|_| n.y.abs() < 0.5) {
            Some(level) => level,
            None => orthonormal_basis(normal).0.as_dvec3(),
        };
        Self([u, n.cross(u), n])
    }

    /// Coordinates of a point: along the plane, and its height over the plane through the origin.
    #[must_use]
    pub fn of(&self, point: Vec3) -> DVec3 {
        let point = point.as_dvec3();
        DVec3::from(self.0.map(|axis| axis.dot(point)))
    }

    /// The corners of a rectangle at this height.
    #[must_use]
    pub fn corners(&self, [low, high]: Rectangle, height: f64) -> [Vec3; 4] {
        let [u, v, n] = self.0;
        [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]]
            .map(|[at_u, at_v]| (u * at_u + v * at_v + n * height).as_vec3())
    }
}

/// A piece of an outline; what it encloses lies to its left.
pub type Segment = [DVec2; 2];

/// What of a triangle (in the coordinates of [`Axes::of`], counter-clockwise seen from outside) lies at `height`: the stone is to its left.
///
/// Vertices at the plane count as above it; both triangles of an edge find the same point on it, so that the outline of a closed body is closed.
#[must_use]
pub fn cut(triangle: [DVec3; 3], height: f64) -> Option<Segment> {
    let above = triangle.map(|corner| corner.z >= height);
    let crossing = |down: bool| {
        let from = (0..3).find(|&i| above[i] == down && above[(i + 1) % 3] != down)?;
        let (a, b) = (triangle[from], triangle[(from + 1) % 3]);
        let (high, low) = if down { (a, b) } else { (b, a) };
        Some(high.truncate() + (low - high).truncate() * ((high.z - height) / (high.z - low.z)))
    };
    Some([crossing(true)?, crossing(false)?])
}

/// Cells along each axis of an outline in which rectangles are looked for, and the most rectangles of it; their sides are then pushed to the outline
/// itself. Of walls, which may have windows, and of single stones, of which a wall has thousands.
const OF_WALLS: (usize, usize) = (40, 6);
const OF_STONES: (usize, usize) = (12, 2);

/// What is larger is looked at as a wall, square metres.
const WALL_M2: f64 = 4.0;

/// By how much rectangles stay within the outline, metres: what single precision leaves of a coordinate a kilometre away.
const INSET_M: f64 = 1e-4;

/// Large rectangles, along the axes, of what `outline` goes around at least once with its left side, each of which adds `least_area`.
#[must_use]
pub fn rectangles(outline: &[Segment], least_area: f64) -> Vec<Rectangle> {
    let points = || outline.iter().flatten();
    let low = points().fold(DVec2::INFINITY, |low, &point| low.min(point));
    let high = points().fold(DVec2::NEG_INFINITY, |high, &point| high.max(point));
    let size = high - low;
    // false for no points and for what is not finite
    let wide_enough = size.x * size.y >= least_area && size.min_element() > 0.0 && size.is_finite();
    if !wide_enough {
        return Vec::new();
    }
    let (cells, most) = if size.x * size.y > WALL_M2 { OF_WALLS } else { OF_STONES };
    let lines = [0, 1].map(|axis| (0..=cells).map(|i| low[axis] + size[axis] * (i as f64 / cells as f64)).collect());
    let free = within(outline, low, size / cells as f64, cells);
    let found = Cells { lines, free }.largest(most, least_area);
    let pushed = found.into_iter().map(|rectangle| {
        let [low, high] = push_out(outline, rectangle);
        [low.map(|at| at + INSET_M), high.map(|at| at - INSET_M)]
    });
    pushed.filter(|rectangle| area(rectangle) > 0.0).collect()
}

/// Which of `cells` by `cells` cells from `low` on lie within the outline and are not touched by it.
fn within(outline: &[Segment], low: DVec2, cell: DVec2, cells: usize) -> Vec<bool> {
    let mut touched = vec![false; cells * cells];
    let mut crossings: Vec<Vec<(f64, i32)>> = vec![Vec::new(); cells];
    let index = |at: f64| (at.floor().max(0.0) as usize).min(cells - 1);
    for segment in outline {
        let [a, b] = segment.map(|point| (point - low) / cell);
        let rows = index(a.y.min(b.y) - CELL_SLACK)..=index(a.y.max(b.y) + CELL_SLACK);
        for row in rows {
            let [from, to] = across_strip([a, b], row as f64 - CELL_SLACK, row as f64 + 1.0 + CELL_SLACK);
            touched[row * cells..][index(from - CELL_SLACK)..=index(to + CELL_SLACK)].fill(true);
            let middle = row as f64 + 0.5;
            let (above_a, above_b) = (a.y >= middle, b.y >= middle);
            if above_a != above_b {
                let at = a.x + (b.x - a.x) * ((middle - a.y) / (b.y - a.y));
                crossings[row].push((at, if above_b { -1 } else { 1 }));
            }
        }
    }
    let mut free = vec![false; cells * cells];
    for (row, crossings) in crossings.iter_mut().enumerate() {
        crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut passed, mut winding) = (0, 0);
        for column in 0..cells {
            while let Some((_, turn)) = crossings.get(passed).filter(|(at, _)| *at < column as f64 + 0.5) {
                winding += turn;
                passed += 1;
            }
            free[row * cells + column] = winding >= 1 && !touched[row * cells + column];
        }
    }
    free
}

/// What rounding may do to a place in cells.
const CELL_SLACK: f64 = 1e-9;

/// From where to where, along the first axis, a segment is between two heights; all of it where it does not cross them.
fn across_strip([a, b]: Segment, bottom: f64, top: f64) -> [f64; 2] {
    let (low, high) = if a.y <= b.y { (a, b) } else { (b, a) };
    let rise = high.y - low.y;
    let at = |y: f64| if rise > 0.0 { low.x + (high.x - low.x) * ((y - low.y) / rise).clamp(0.0, 1.0) } else { low.x };
    let (from, to) = if rise > 0.0 { (at(bottom), at(top)) } else { (low.x, high.x) };
    [from.min(to), from.max(to)]
}

/// Moves the sides of a rectangle that no segment enters outward, one after the other, until they meet one.
fn push_out(outline: &[Segment], mut rectangle: Rectangle) -> Rectangle {
    for axis in [0, 1] {
        let turned = |point: DVec2| if axis == 0 { point } else { point.yx() };
        let middle = 0.5 * (rectangle[0][axis] + rectangle[1][axis]);
        let (bottom, top) = (rectangle[0][1 - axis], rectangle[1][1 - axis]);
        let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
        for segment in outline {
            let segment = segment.map(turned);
            // What only touches the sides does not enter.
            if segment[0].y.max(segment[1].y) <= bottom || segment[0].y.min(segment[1].y) >= top {
                continue;
            }
            let [least, most] = across_strip(segment, bottom, top);
            if least >= middle {
                to = to.min(least);
            } else {
                from = from.max(most);
            }
        }
        // An outline that is open says nothing of its open side.
        if from.is_finite() && to.is_finite() {
            (rectangle[0][axis], rectangle[1][axis]) = (from, to);
        }
    }
    rectangle
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outline(points: &[[f64; 2]]) -> Vec<Segment> {
        let point = |i: usize| DVec2::from(points[i % points.len()]);
        (0..points.len()).map(|i| [point(i), point(i + 1)]).collect()
    }

    fn close(a: &Rectangle, b: &Rectangle) -> bool {
        a.as_flattened().iter().zip(b.as_flattened()).all(|(a, b)| (a - b).abs() < 2.0 * INSET_M)
    }

    #[test]
    fn a_rectangle_is_found_to_its_edges() {
        let found = rectangles(&outline(&[[0.3, 0.1], [5.7, 0.1], [5.7, 2.9], [0.3, 2.9]]), 0.5);
        assert!(found.len() == 1 && close(&found[0], &[[0.3, 0.1], [5.7, 2.9]]), "{found:?}");
        let turned = rectangles(&outline(&[[0.3, 2.9], [5.7, 2.9], [5.7, 0.1], [0.3, 0.1]]), 0.5);
        assert!(turned.is_empty(), "the other way round it is a hole");
    }

    #[test]
    fn a_wall_with_a_window_has_four_and_none_in_the_window() {
        let mut wall = outline(&[[0.0, 0.0], [10.0, 0.0], [10.0, 4.0], [0.0, 4.0]]);
        wall.extend(outline(&[[4.0, 1.0], [4.0, 3.0], [6.0, 3.0], [6.0, 1.0]]));
        let found = rectangles(&wall, 1.0);
        let wanted =
            [[[0.0, 0.0], [4.0, 4.0]], [[6.0, 0.0], [10.0, 4.0]], [[0.0, 0.0], [10.0, 1.0]], [[0.0, 3.0], [10.0, 4.0]]];
        assert_eq!(found.len(), 4, "{found:?}");
        for wanted in &wanted {
            assert!(found.iter().any(|found| close(found, wanted)), "{wanted:?} of {found:?}");
        }
    }

    #[test]
    fn rectangles_stay_within_slanted_and_round_outlines() {
        let round: Vec<[f64; 2]> =
            (0..60).map(|k| (f64::from(k) * std::f64::consts::TAU / 60.0).sin_cos()).map(|(s, c)| [3.0 * c, 3.0 * s]).collect();
        let found = rectangles(&outline(&round), 0.5);
        assert!(area(&found[0]) > 0.9 * 18.0, "the largest is the square in the circle: {found:?}");
        for [low, high] in &found {
            for corner in [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]] {
                assert!(DVec2::from(corner).length() <= 3.0, "{corner:?}");
            }
        }
    }

    #[test]
    fn a_cut_keeps_the_stone_to_its_left_and_is_closed() {
        // A tetrahedron, seen from outside counter-clockwise.
        let corners = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0]].map(DVec3::from);
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        for height in [0.5, 1.0, 3.0] {
            let segments: Vec<Segment> = faces.iter().filter_map(|face| cut(face.map(|i: usize| corners[i]), height)).collect();
            let doubled: f64 = segments.iter().map(|[a, b]| a.perp_dot(*b)).sum();
            assert!((doubled - (4.0 - height).powi(2)).abs() < 1e-12, "{height}: {segments:?}");
            for [_, end] in &segments {
                assert!(segments.iter().any(|[begin, _]| begin == end), "{height}: {segments:?}");
            }
        }
        assert_eq!(faces.iter().filter_map(|face| cut(face.map(|i: usize| corners[i]), 4.5)).count(), 0);
    }

    #[test]
    fn axes_are_right_handed_and_upright_for_walls() {
        for normal in [Vec3::X, Vec3::Z, Vec3::Y, Vec3::NEG_Y, Vec3::new(0.6, 0.0, -0.8)] {
            let axes = Axes::new(normal);
            let [low, high] = [[1.0, 2.0], [3.0, 5.0]];
            for corner in axes.corners([low, high], 7.0) {
                let at = axes.of(corner);
                assert!((at.z - 7.0).abs() < 1e-5 && at.x > 0.99 && at.x < 3.01 && at.y > 1.99 && at.y < 5.01, "{at}");
            }
            let [a, b, c, _] = axes.corners([low, high], 0.0);
            assert!((b - a).cross(c - b).dot(normal) > 0.0);
        }
        assert!((Axes::new(Vec3::X).of(Vec3::Y).y - 1.0).abs() < 1e-9);
    }
}
