//! Triangles that come to lie on others of their chart: folds, spirals and shells that stay within a cone of normals.

use glam::Vec2;
use std::collections::HashMap;

/// Triangles that reach into one another by less than this part of their chart's size only touch: coordinates are rounded, and neighbours share edges.
const TOUCH: f32 = 1.0e-5;

/// Sorts a chart's triangles, given in their order, into layers within which none covers another; most charts are one layer.
pub(super) fn layers(triangles: &[[Vec2; 3]]) -> Vec<Vec<u32>> {
    let (low, high) = bounds(triangles.as_flattened());
    let size = (high - low).max_element();
    let cell = cell_size(triangles, size);
    let mut rest: Vec<u32> = (0..triangles.len() as u32).collect();
    let mut layers = Vec::new();
    while !rest.is_empty() {
        let mut grid = Grid { cell, low, cells: HashMap::new() };
        let (mut layer, mut covered) = (Vec::with_capacity(rest.len()), Vec::new());
        for &t in &rest {
            let triangle = &triangles[t as usize];
            let meets = |other: &u32| overlap(triangle, &triangles[*other as usize], TOUCH * size);
            if grid.near(triangle).any(|others| others.iter().any(meets)) {
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

/// So that a triangle lies in few cells and a cell holds few triangles.
fn cell_size(triangles: &[[Vec2; 3]], size: f32) -> f32 {
    let extents: f32 = triangles.iter().map(|t| (bounds(t).1 - bounds(t).0).max_element()).sum();
    let mean = extents / triangles.len().max(1) as f32;
    mean.max(size / 1024.0).max(f32::MIN_POSITIVE)
}

fn bounds(points: &[Vec2]) -> (Vec2, Vec2) {
    points.iter().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)))
}

struct Grid {
    cell: f32,
    low: Vec2,
    cells: HashMap<[i32; 2], Vec<u32>>,
}

impl Grid {
    fn keys(&self, triangle: &[Vec2; 3]) -> impl Iterator<Item = [i32; 2]> + use<> {
        let (low, high) = bounds(triangle);
        let key = |p: Vec2| ((p - self.low) / self.cell).floor().as_ivec2();
        let (low, high) = (key(low), key(high));
        (low.y..=high.y).flat_map(move |y| (low.x..=high.x).map(move |x| [x, y]))
    }

    fn near(&self, triangle: &[Vec2; 3]) -> impl Iterator<Item = &Vec<u32>> {
        self.keys(triangle).filter_map(|key| self.cells.get(&key))
    }

    fn put(&mut self, triangle: &[Vec2; 3], t: u32) {
        for key in self.keys(triangle) {
            self.cells.entry(key).or_default().push(t);
        }
    }
}

/// Whether two triangles reach into one another by more than so much: along no side of either do they part.
fn overlap(a: &[Vec2; 3], b: &[Vec2; 3], touch: f32) -> bool {
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
