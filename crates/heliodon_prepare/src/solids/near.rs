//! Boxes that are asked whether one of them holds a point.

use super::among::Bounds;
use glam::Vec3;

/// Cells along a side at most.
const MOST_CELLS: f64 = 64.0;
/// What lies in more cells than this is asked by itself.
const WIDE_CELLS: usize = 64;

/// Boxes in a grid: of thousands of bodies few are near a place.
pub(super) struct Boxes {
    around: Bounds,
    per_m: Vec3,
    side: usize,
    cells: Vec<Vec<Bounds>>,
    wide: Vec<Bounds>,
}

impl Boxes {
    /// None of no boxes.
    pub fn new(boxes: &[Bounds]) -> Option<Self> {
        let around = boxes.iter().copied().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
        let side = (2.0 * (boxes.len() as f64).cbrt()).clamp(1.0, MOST_CELLS) as usize;
        let per_m = side as f32 / (around.1 - around.0).max(Vec3::splat(f32::MIN_POSITIVE));
        let mut grid = Self { around, per_m, side, cells: vec![Vec::new(); side.pow(3)], wide: Vec::new() };
        for &one in boxes {
            let (low, high) = (grid.cell(one.0), grid.cell(one.1));
            let spans: usize = (0..3).map(|axis| high[axis] - low[axis] + 1).product();
            if spans > WIDE_CELLS {
                grid.wide.push(one);
                continue;
            }
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        let index = grid.index([x, y, z]);
                        grid.cells[index].push(one);
                    }
                }
            }
        }
        Some(grid)
    }

    /// Whether a point lies in the box around all of them.
    pub fn are_around(&self, p: Vec3) -> bool {
        holds(self.around, p)
    }

    /// Whether a box holds a point.
    pub fn hold(&self, p: Vec3) -> bool {
        self.are_around(p) && self.cells[self.index(self.cell(p))].iter().chain(&self.wide).any(|&one| holds(one, p))
    }

    fn cell(&self, p: Vec3) -> [usize; 3] {
        ((p - self.around.0) * self.per_m).to_array().map(|at| (at as usize).min(self.side - 1))
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (x * self.side + y) * self.side + z
    }
}

fn holds((low, high): Bounds, p: Vec3) -> bool {
    low.cmple(p).all() && high.cmpge(p).all()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_says_what_asking_each_box_says() {
        // small ones, flat ones, one around many, one far off
        let mut boxes: Vec<Bounds> = (0..500_u32)
            .map(|i| {
                let low = Vec3::new((i * 7 % 41) as f32, (i * 13 % 37) as f32, (i * 29 % 23) as f32) * 0.25;
                (low, low + Vec3::new(0.1, 0.2, (i % 5) as f32 * 0.3))
            })
            .collect();
        boxes.push((Vec3::splat(2.0), Vec3::splat(7.0)));
        boxes.push((Vec3::splat(90.0), Vec3::splat(91.0)));
        let grid = Boxes::new(&boxes).unwrap();
        assert_eq!(grid.wide.len(), 0, "its cells are larger than all but what is far off");
        let mut held = 0;
        for i in 0..20_000_u32 {
            let p = Vec3::new((i % 29) as f32, (i / 29 % 31) as f32, (i / 899) as f32) * 0.43 - 1.0;
            assert_eq!(grid.hold(p), boxes.iter().any(|&one| holds(one, p)), "{p}");
            held += u32::from(grid.hold(p));
        }
        assert!((500..15_000).contains(&held), "{held}");
        let corners = boxes.iter().flat_map(|&(low, high)| [low, high]);
        assert!(corners.into_iter().all(|p| grid.hold(p)));
        boxes.pop();
        assert!(!Boxes::new(&boxes).unwrap().wide.is_empty());
        assert!(Boxes::new(&[]).is_none());
    }
}
