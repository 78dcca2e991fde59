//! Triangles that come to lie on others of their chart: folds, spirals and shells that stay within a cone of normals.

use glam::{UVec2, Vec2};

/// Triangles that reach into one another by less than this part of their chart's size only touch: coordinates are rounded, and neighbours share edges.
const TOUCH: f32 = 1.0e-5;

/// Cells of a grid for each triangle, at most.
const CELLS: f32 = 4.0;

/// A triangle, and its least and greatest coordinates.
type Bounded = ([Vec2; 3], Vec2, Vec2);

/// Sorts a chart's triangles, given in their order, into layers within which none covers another; most charts are one layer.
pub(super) fn layers(triangles: &[[Vec2; 3]]) -> Vec<Vec<u32>> {
    let bounded = |triangle: &[Vec2; 3]| {
        let (low, high) = bounds(triangle);
        (*triangle, low, high)
    };
    let triangles: Vec<Bounded> = triangles.iter().map(bounded).collect();
    let (low, high) =
        triangles.iter().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, high), (_, of, to)| (low.min(*of), high.max(*to)));
    let touch = TOUCH * (high - low).max_element();
    let mut rest: Vec<u32> = (0..triangles.len() as u32).collect();
    let mut layers = Vec::new();
    while !rest.is_empty() {
        let mut grid = Grid::new(&triangles, low, high);
        let (mut layer, mut covered) = (Vec::with_capacity(rest.len()), Vec::new());
        for &t in &rest {
            let triangle = &triangles[t as usize];
            if grid.near(triangle).any(|other| overlap(triangle, &triangles[other as usize], touch)) {
                covered.push(t);
            } else {
                grid.put(triangle, t);
                layer.push(t);
            }
        }
        layers.push(layer);
        rest = covered;
    }
    layers
}

fn bounds(points: &[Vec2]) -> (Vec2, Vec2) {
    points.iter().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)))
}

/// No entry.
const NONE: u32 = u32::MAX;

/// Cells of a size so that a triangle lies in few of them, and few triangles in each.
struct Grid {
    low: Vec2,
    /// Cells for a metre, and along each axis.
    scale: f32,
    cells: UVec2,
    /// For each cell its last entry: a triangle, and the entry before.
    last: Vec<u32>,
    entries: Vec<(u32, u32)>,
}

impl Grid {
    fn new(triangles: &[Bounded], low: Vec2, high: Vec2) -> Self {
        let count = triangles.len().max(1) as f32;
        let mean = triangles.iter().map(|(_, low, high)| (high - low).max_element()).sum::<f32>() / count;
        let size = (high - low).max(Vec2::splat(f32::MIN_POSITIVE));
        // what is thin has no more cells along than there are triangles, and what is wide not many more
        let most = (CELLS * count / (size.x * size.y)).sqrt().min(CELLS * count / size.max_element());
        let scale = (1.0 / mean).min(most);
        let scale = if scale.is_finite() { scale } else { 0.0 };
        let cells = (size * scale).as_uvec2() + 1;
        Self { low, scale, cells, last: vec![NONE; (cells.x * cells.y) as usize], entries: Vec::with_capacity(triangles.len()) }
    }

    fn keys(&self, (_, low, high): &Bounded) -> impl Iterator<Item = usize> + use<> {
        let key = |p: Vec2| ((p - self.low) * self.scale).as_uvec2().min(self.cells - 1);
        let (low, high, across) = (key(*low), key(*high), self.cells.x);
        (low.y..=high.y).flat_map(move |y| (low.x..=high.x).map(move |x| (y * across + x) as usize))
    }

    fn near(&self, triangle: &Bounded) -> impl Iterator<Item = u32> {
        let entry = |at: u32| self.entries.get(at as usize);
        let of_cell = move |cell: usize| std::iter::successors(entry(self.last[cell]), move |(_, before)| entry(*before));
        self.keys(triangle).flat_map(of_cell).map(|(triangle, _)| *triangle)
    }

    fn put(&mut self, triangle: &Bounded, t: u32) {
        for cell in self.keys(triangle) {
            self.entries.push((t, self.last[cell]));
            self.last[cell] = self.entries.len() as u32 - 1;
        }
    }
}

/// Whether two triangles reach into one another by more than so much: along no side of either do they part.
fn overlap((a, low_a, high_a): &Bounded, (b, low_b, high_b): &Bounded, touch: f32) -> bool {
    if (high_a.min(*high_b) - low_a.max(*low_b)).min_element() <= touch {
        return false;
    }
    let parts = |of: &[Vec2; 3]| {
        (0..3).any(|i| {
            let Some(along) = (of[(i + 1) % 3] - of[i]).try_normalize() else { return false };
            let across = along.perp();
            let range = |t: &[Vec2; 3]| {
                let at = t.map(|p| across.dot(p - of[i]));
                (at[0].min(at[1]).min(at[2]), at[0].max(at[1]).max(at[2]))
            };
            let (a, b) = (range(a), range(b));
            a.1.min(b.1) - a.0.max(b.0) <= touch
        })
    };
    !parts(a) && !parts(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x: f32, y: f32) -> [[Vec2; 3]; 2] {
        let at = |i: f32, j: f32| Vec2::new(x + i, y + j);
        [[at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0)], [at(0.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]]
    }

    #[test]
    fn neighbours_touch_and_what_lies_above_is_told() {
        let floor: Vec<[Vec2; 3]> = (0..100).flat_map(|i| square((i % 10) as f32, (i / 10) as f32)).collect();
        assert_eq!(layers(&floor).len(), 1);
        let mut stairs = floor.clone();
        stairs.extend(square(3.5, 3.5));
        stairs.extend(square(20.0, 3.5));
        assert_eq!(layers(&stairs).iter().map(Vec::len).collect::<Vec<_>>(), [202, 2]);
        assert_eq!(layers(&[floor[0], floor[0], floor[0]]).len(), 3);
    }

    #[test]
    fn slivers_and_points_cover_nothing() {
        let line = [Vec2::ZERO, Vec2::ONE, Vec2::splat(2.0)];
        assert_eq!(layers(&[line, [Vec2::ONE; 3], line]).len(), 1);
        assert!(layers(&[]).is_empty());
    }
}
