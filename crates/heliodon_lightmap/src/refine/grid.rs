//! The texels of each chart as a grid of its own, and what lies beside what on it.

use crate::texels::Texel;
use glam::Vec3;
use rayon::prelude::*;

/// Where a texel's place lies, and what it faces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Metres.
    pub position: Vec3,
    /// Unit.
    pub normal: Vec3,
}

pub(super) const NOBODY: u32 = u32::MAX;

/// A chart's rectangle of cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChartGrid {
    /// The texel of its lowest x and y.
    first: [i32; 2],
    pub width: i32,
    pub height: i32,
    /// Its first cell.
    pub cells: usize,
}

impl ChartGrid {
    /// The cell of a texel, if it lies in the rectangle.
    fn cell(&self, x: i32, y: i32) -> Option<usize> {
        let inside = (0..self.width).contains(&x) && (0..self.height).contains(&y);
        inside.then(|| self.cells + (y * self.width + x) as usize)
    }
}

/// All texels that are to be lit, each in the grid of its chart.
#[derive(Clone, Debug)]
pub struct Grid {
    pub(super) places: Vec<Place>,
    pub(super) charts: Vec<ChartGrid>,
    /// The texel of each cell, or [`NOBODY`].
    pub(super) cells: Vec<u32>,
    /// Of each texel: its chart's grid, and where it lies there.
    at: Vec<(u32, [i32; 2])>,
    /// Whether each lies on the surface; only filtering asks for the others.
    pub(super) covered: Vec<bool>,
}

impl Grid {
    /// Of the texels of [`crate::texels::texels`], the charts of triangles ([`crate::unwrap::Unwrapped::chart`]), and the place of each texel.
    ///
    /// # Panics
    /// When there are not as many places as texels, or a texel names a triangle that has no chart.
    #[must_use]
    pub fn new(texels: &[Texel], chart_of_triangle: &[u32], places: Vec<Place>) -> Self {
        assert_eq!(texels.len(), places.len(), "a place for each texel");
        let chart_of = |texel: &Texel| (chart_of_triangle[texel.triangle as usize], texel.sheet);
        let (mut charts, mut cells, mut at) = (Vec::new(), Vec::new(), Vec::with_capacity(texels.len()));
        for of_chart in texels.chunk_by(|a, b| chart_of(a) == chart_of(b)) {
            let corner = |texel: &Texel| [i32::from(texel.x), i32::from(texel.y)];
            let low = of_chart.iter().map(corner).fold([i32::MAX; 2], |low, p| [low[0].min(p[0]), low[1].min(p[1])]);
            let high = of_chart.iter().map(corner).fold([0; 2], |high, p| [high[0].max(p[0]), high[1].max(p[1])]);
            let chart = ChartGrid { first: low, width: high[0] - low[0] + 1, height: high[1] - low[1] + 1, cells: cells.len() };
            cells.resize(cells.len() + (chart.width * chart.height) as usize, NOBODY);
            for texel in of_chart {
                let [x, y] = corner(texel);
                let (x, y) = (x - chart.first[0], y - chart.first[1]);
                cells[chart.cells + (y * chart.width + x) as usize] = at.len() as u32;
                at.push((charts.len() as u32, [x, y]));
            }
            charts.push(chart);
        }
        Self { places, charts, cells, at, covered: texels.iter().map(|texel| texel.is_covered).collect() }
    }

    /// How many texels there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// The places of the texels, in their order.
    #[must_use]
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// The texel so far beside one in its chart.
    pub(crate) fn beside(&self, texel: u32, dx: i32, dy: i32) -> Option<u32> {
        let (chart, [x, y]) = self.at[texel as usize];
        let cell = self.charts[chart as usize].cell(x + dx, y + dy)?;
        Some(self.cells[cell]).filter(|texel| *texel != NOBODY)
    }

    /// Whether a texel stands on the lattice of a stride, along x and y. Lattices begin a texel inside of a chart's rectangle: its very rim is often
    /// one that only filtering asks for.
    pub(super) fn on_lattice(&self, texel: u32, stride: i32) -> [bool; 2] {
        let (_, [x, y]) = self.at[texel as usize];
        [(x - 1).rem_euclid(stride) == 0, (y - 1).rem_euclid(stride) == 0]
    }

    /// The texels that come with a stride, ascending: those on its lattice that are on none of twice the stride; with the first, all on it.
    pub(super) fn of_stride(&self, stride: i32, is_first: bool) -> Vec<u32> {
        let comes = |texel: &u32| self.on_lattice(*texel, stride) == [true; 2];
        let known = |texel: &u32| !is_first && self.on_lattice(*texel, 2 * stride) == [true; 2];
        (0..self.len() as u32).into_par_iter().filter(|texel| comes(texel) && !known(texel)).collect()
    }
}
