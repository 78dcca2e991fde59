//! Walls, floors and roofs: thick sheets that are cut by a grid, some of whose cells are open.
//!
//! A grid and not a polygon with holes: no corner lies on another face's edge, so the light of two neighbours agrees along the
//! whole of it, and the sheet is closed without a triangulation of polygons.

use super::pieces::add_polygon;
use crate::temple::solid::SolidMesh;
use glam::Vec3;

/// A side of a sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    Front,
    Back,
}

/// Which face of a sheet is to be coloured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// A cell's, by column and row.
    Cell(Side, usize, usize),
    /// Between the sides: at the rim, or in an opening.
    Reveal,
}

/// A sheet of `columns` x `rows` cells.
pub struct Slab<P, O, C> {
    pub columns: usize,
    pub rows: usize,
    /// The place of a grid point (0..=columns, 0..=rows) on a side. Seen from the front, columns run to the right and rows up.
    pub place: P,
    /// Whether a cell (column, row) is open.
    pub open: O,
    /// The linear albedo of a face.
    pub color_linear: C,
}

impl<P, O, C> Slab<P, O, C>
where
    P: Fn(Side, usize, usize) -> Vec3,
    O: Fn(usize, usize) -> bool,
    C: Fn(Face) -> Vec3,
{
    /// The closed sheet.
    pub fn build(&self) -> SolidMesh {
        let mut mesh = SolidMesh::default();
        let solid = |i: isize, j: isize| {
            let (Ok(i), Ok(j)) = (usize::try_from(i), usize::try_from(j)) else { return false };
            i < self.columns && j < self.rows && !(self.open)(i, j)
        };
        for j in 0..self.rows {
            for i in (0..self.columns).filter(|&i| !(self.open)(i, j)) {
                let ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                let front = ring.map(|(i, j)| (self.place)(Side::Front, i, j));
                let back = ring.map(|(i, j)| (self.place)(Side::Back, i, j));
                let color = |side| (self.color_linear)(Face::Cell(side, i, j));
                add_polygon(&mut mesh, &front, color(Side::Front));
                add_polygon(&mut mesh, &[back[3], back[2], back[1], back[0]], color(Side::Back));
                let (x, y) = (i as isize, j as isize);
                for (k, beyond) in [(x, y - 1), (x + 1, y), (x, y + 1), (x - 1, y)].into_iter().enumerate() {
                    if !solid(beyond.0, beyond.1) {
                        let l = (k + 1) % 4;
                        add_polygon(&mut mesh, &[front[k], back[k], back[l], front[l]], (self.color_linear)(Face::Reveal));
                    }
                }
            }
        }
        mesh
    }
}
