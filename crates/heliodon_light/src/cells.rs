//! Cells: the pieces of surface that light bounces off, and the points that light them.
//!
//! A small triangle is one cell, lit by the mean of its three vertices, whose light is solved anyway: the dense meshes of
//! scanners cost no extra points. A triangle whose longest edge exceeds the cell size is divided into `m * m` sub-cells, each
//! with a point of its own at its centre, so that a room of twelve triangles is solved as well as a scan.
//!
//! Both sides of a cell reflect. The back is lit by points of its own (the same places, normals turned about), which are made
//! only where rays have met a back: closed stones have none, the underside of an open sheet gets all it needs.

use crate::gather::{counted, sees_only_backs};
use crate::points::{Place, inward_shifts};
use crate::refine::{cells_by_sight, sight};
use crate::{GatherBlock, LightError, LightParams, PointSet, Surfaces, median_edge_m};
use glam::Vec3;
use heliodon_rays::Hit;
use std::borrow::Cow;
use std::ops::Range;

/// The bit that marks the back of a cell, or a point on the back of its site.
pub(crate) const BACK: u32 = 1 << 31;

/// The bit that marks the label of a point in free space.
const FREE: u32 = 1 << 31;

/// No point, no cell.
pub(crate) const NONE: u32 = u32::MAX;

/// A triangle that is divided into sub-cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Split {
    pub triangle: u32,
    /// Parts of each edge.
    pub parts: u32,
    /// Its first sub-cell.
    pub first: u32,
}

impl Split {
    /// The sub-cell that holds a place, counted from the first.
    pub fn sub_cell(self, u: f32, v: f32) -> u32 {
        let m = self.parts;
        let (x, y) = ((u * m as f32).max(0.0), (v * m as f32).max(0.0));
        let i = (x as u32).min(m - 1);
        let j = (y as u32).min(m - 1 - i);
        let upper = (x - i as f32) + (y - j as f32) > 1.0 && j < m - 1 - i;
        i * (2 * m - i) + 2 * j + u32::from(upper)
    }

    /// The barycentric weights of all sub-cells' centres, in order.
    pub fn centres(self) -> impl Iterator<Item = (f32, f32)> {
        let m = self.parts;
        let place = move |i: u32, j: u32, third: f32| ((i as f32 + third) / m as f32, (j as f32 + third) / m as f32);
        (0..m).flat_map(move |i| {
            (0..2 * (m - i) - 1).map(move |k| place(i, k / 2, if k % 2 == 1 { 2.0 / 3.0 } else { 1.0 / 3.0 }))
        })
    }
}

/// The cells of some surfaces and the points at which their light is solved.
///
/// A point's site is a vertex, or, after the vertices, a sub-cell; [`PointSet::sites`] with the highest bit is the back of one.
#[derive(Clone, Debug)]
pub struct Layout {
    vertex_count: u32,
    triangle_count: u32,
    splits: Vec<Split>,
    /// Index into `splits` per triangle, or `NONE`; empty where nothing is split.
    split_of_triangle: Vec<u32>,
    /// Triangle and place of each sub-cell.
    sub_cells: Vec<(u32, f32, f32)>,
    points: PointSet,
    /// The point of each vertex and sub-cell, front side.
    point_of_site: Vec<u32>,
    /// Back sites that have points: (site, point), sorted.
    back_points: Vec<(u32, u32)>,
    /// The points in free space, in the order in which they were given.
    free_points: Vec<u32>,
    /// Cells whose back has points, sorted.
    back_cells: Vec<u32>,
    /// The distance below which a hit of a triangle is followed; empty where nothing bounces.
    near_m: Vec<f32>,
    /// What each triangle fills of the views of some points; empty where it was not asked.
    seen: Vec<u32>,
    /// Of the runs of [`RUN`] points those that lie wholly on triangles which are shown, where some are and some are not.
    shown_runs: Vec<u32>,
    cell_size_m: f32,
    rounds: u32,
}

/// Points whose rays meet the cells of a layout: the layout's own, or others that light none of its cells.
#[derive(Clone, Copy)]
pub(crate) struct Among<'a> {
    pub layout: &'a Layout,
    pub points: &'a PointSet,
    /// Those from here on light no cell.
    pub first_free: u32,
}

impl Among<'_> {
    /// What tells a point's random numbers from others': of one in free space, its place among its like, however many points come before.
    pub fn label_of(self, point: u32) -> u32 {
        point.checked_sub(self.first_free).map_or(point, |free| free | FREE)
    }
}

/// Cells are at most this many median edges long, so that a triangle among many like it is not divided.
const CELL_PER_EDGE: f32 = 4.0;
/// And at most this part of the scene's diagonal, so that a few large faces are.
const CELLS_PER_DIAGONAL: f32 = 64.0;
/// And at least this part of it: finer ones no longer change what bounces.
const FINEST_CELLS_PER_DIAGONAL: f32 = 512.0;
/// A back that is met by fewer rays in all than one for each of so many samples stays black: a scan's few open seams show much
/// of its inside to few rays (a third of the bunny's vertices would be gathered for 200 at the rims of its holes), an open sheet
/// is met by hundreds.
const SAMPLES_PER_BACK_HIT: u32 = 32;
/// Cells of triangles that are seen much are at least this many median edges long.
const FINEST_CELLS_PER_EDGE: f32 = 2.0;
/// Neighbouring points whose rays make good beams.
const RUN: usize = 8;
/// The growth of the cell size where there would be too many cells.
const CELL_GROWTH: f32 = 1.25;
/// Hits nearer than this part of their cell's longest edge are followed: beyond, the vertices' mean stands for what is seen.
const NEAR_PER_CELL: f32 = 0.5;
/// The most parts of one edge.
const MAX_PARTS: u32 = 1024;

/// The edge length from which triangles are divided into cells, in metres: four median edges, at least a 512th and at most a
/// 64th of the scene's diagonal. Infinite for a scene without size.
#[must_use]
pub fn default_cell_size_m(surfaces: &Surfaces) -> f32 {
    let Some((low, high)) = surfaces.rays.bounds() else { return f32::INFINITY };
    let diagonal = low.distance(high);
    let size = (CELL_PER_EDGE * median_edge_m(surfaces.positions, surfaces.triangles))
        .clamp(diagonal / FINEST_CELLS_PER_DIAGONAL, diagonal / CELLS_PER_DIAGONAL);
    if size > 0.0 { size } else { f32::INFINITY }
}

impl Layout {
    /// Divides large triangles into cells and lays out the points: all vertices and all sub-cells.
    ///
    /// # Errors
    /// Surfaces or parameters that are not valid.
    pub fn new(surfaces: &Surfaces, params: &LightParams) -> Result<Self, LightError> {
        Self::with_sight(surfaces, params, None)
    }

    /// As [`Layout::new`], which takes most of its time to look how much of the points' views each triangle fills: what [`Layout::sight`]
    /// says of the same surfaces and parameters saves that.
    ///
    /// # Errors
    /// As [`Layout::new`].
    pub fn with_sight(surfaces: &Surfaces, params: &LightParams, sight: Option<Vec<u32>>) -> Result<Self, LightError> {
        params.validate()?;
        surfaces.validate()?;
        let mut cell_size_m = params.cell_size_m.unwrap_or_else(|| default_cell_size_m(surfaces));
        // without bounces no cell is ever asked for its light
        let divided = if params.bounces == 0 { 0 } else { surfaces.triangles.len() as u32 };
        let longest: Vec<f32> = (0..divided).map(|t| longest_edge(surfaces, t)).collect();
        // a division never makes less than four cells, so the limit is reached at a finite size
        while longest.iter().map(|&l| u64::from(parts(l, cell_size_m)).pow(2)).filter(|&n| n > 1).sum::<u64>()
            > params.max_sub_cells as u64
        {
            cell_size_m *= CELL_GROWTH;
        }
        let mut layout = Self {
            vertex_count: surfaces.positions.len() as u32,
            triangle_count: surfaces.triangles.len() as u32,
            splits: Vec::new(),
            split_of_triangle: Vec::new(),
            sub_cells: Vec::new(),
            points: PointSet::default(),
            point_of_site: Vec::new(),
            back_points: Vec::new(),
            free_points: Vec::new(),
            back_cells: Vec::new(),
            near_m: Vec::new(),
            seen: Vec::new(),
            shown_runs: Vec::new(),
            cell_size_m,
            rounds: 0,
        };
        let finest_m = FINEST_CELLS_PER_EDGE * median_edge_m(surfaces.positions, surfaces.triangles);
        let (by_sight, seen) = cells_by_sight(surfaces, &longest, finest_m, params, sight);
        layout.seen = seen;
        for (triangle, (&l, by_sight)) in longest.iter().zip(by_sight).enumerate() {
            let parts = parts(l, cell_size_m).max(by_sight);
            layout.near_m.push(NEAR_PER_CELL * l / parts as f32);
            if parts > 1 {
                let split = Split { triangle: triangle as u32, parts, first: layout.sub_cells.len() as u32 };
                layout.sub_cells.extend(split.centres().map(|(u, v)| (split.triangle, u, v)));
                layout.splits.push(split);
            }
        }
        let cells = layout.triangle_count as usize + layout.sub_cells.len();
        if cells >= BACK as usize || layout.site_count() >= BACK as usize {
            return Err(LightError::TooMany { what: "cells", count: cells.max(layout.site_count()) });
        }
        if !layout.splits.is_empty() {
            layout.split_of_triangle = vec![NONE; layout.triangle_count as usize];
            for (i, split) in layout.splits.iter().enumerate() {
                layout.split_of_triangle[split.triangle as usize] = i as u32;
            }
        }
        let sites: Vec<u32> = (0..layout.site_count() as u32).collect();
        layout.points = layout.points_at(surfaces, &sites, params.offset_m);
        layout.point_of_site = vec![NONE; layout.site_count()];
        for (point, &site) in layout.points.sites.iter().enumerate() {
            layout.point_of_site[site as usize] = point as u32;
        }
        layout.shown_runs = layout.find_shown_runs(surfaces);
        Ok(layout)
    }

    fn find_shown_runs(&self, surfaces: &Surfaces) -> Vec<u32> {
        let shown = surfaces.detail.map_or(&[][..], |detail| detail.shown);
        if shown.is_empty() {
            return Vec::new();
        }
        let mut sites = vec![false; self.site_count()];
        for &vertex in shown.iter().flat_map(|range| surfaces.triangles[range.clone()].as_flattened()) {
            sites[vertex as usize] = true;
        }
        for (site, &(triangle, ..)) in sites[surfaces.positions.len()..].iter_mut().zip(&self.sub_cells) {
            *site = shown.iter().any(|range| range.contains(&(triangle as usize)));
        }
        let runs = self.points.sites.chunks(RUN).enumerate();
        runs.filter(|(_, run)| run.iter().all(|&site| sites[site as usize])).map(|(run, _)| run as u32).collect()
    }

    /// Runs of at most [`RUN`] neighbouring points, at most so many of them, evenly spread over all that is shown.
    pub(crate) fn spread_runs(&self, most: usize) -> Vec<Range<usize>> {
        let points = self.front_count();
        let (runs, all) = (points.div_ceil(RUN), self.shown_runs.is_empty());
        let candidates = if all { runs } else { self.shown_runs.len() };
        let count = candidates.min(most);
        let run_of = |i: usize| {
            let candidate = i * candidates / count;
            if all { candidate } else { self.shown_runs[candidate] as usize }
        };
        (0..count).map(run_of).map(|run| run * RUN..((run + 1) * RUN).min(points)).collect()
    }

    /// How much of the points' views each triangle fills; nothing where nobody had to look.
    #[must_use]
    pub fn sight(&self) -> &[u32] {
        &self.seen
    }

    /// The points, in the order of blocks and masks.
    #[must_use]
    pub fn points(&self) -> &PointSet {
        &self.points
    }

    /// The first so many points lie on fronts, all that vertices may show; the others are back sides and free space.
    #[must_use]
    pub fn front_count(&self) -> usize {
        self.site_count()
    }

    /// Vertices of the surfaces.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.vertex_count as usize
    }

    /// Cells that the division of large triangles made.
    #[must_use]
    pub fn sub_cell_count(&self) -> usize {
        self.sub_cells.len()
    }

    /// The edge length from which triangles were divided, in metres.
    #[must_use]
    pub fn cell_size_m(&self) -> f32 {
        self.cell_size_m
    }

    /// The point on the front of a vertex, or of a cell as [`crate::Validity::source`] names it.
    #[must_use]
    pub fn front_point(&self, site: u32) -> u32 {
        self.point_of_site[site as usize]
    }

    /// Gives points to the back sides that the rays of valid points have met, and returns the range of the new points; an
    /// empty one once no more are needed. `blocks` are those of all points so far, in order; each round's new points must be
    /// gathered before the next. Without kept hits the blocks name the cells met all the same.
    pub fn add_back_sides(&mut self, surfaces: &Surfaces, blocks: &[GatherBlock], params: &LightParams) -> Range<usize> {
        let first = self.points.len();
        if self.rounds >= params.back_side_rounds {
            return first..first;
        }
        self.rounds += 1;
        let met = counted(blocks.iter().flat_map(|b| b.back_cells.iter().copied()).collect());
        let often = (params.samples / SAMPLES_PER_BACK_HIT).max(1);
        let cells: Vec<u32> = met.into_iter().filter(|&[_, count]| count >= often).map(|[cell, _]| cell).collect();
        let mut sites: Vec<u32> = cells.iter().flat_map(|&cell| self.sites_of_cell(surfaces, cell)).collect();
        sites.sort_unstable();
        sites.dedup();
        sites.retain(|&site| self.back_point(site).is_none());
        let mut sites: Vec<u32> = sites.into_iter().map(|site| site | BACK).collect();
        // the insides of closed stones stay dark without points
        let probes = self.points_at(surfaces, &sites, params.offset_m);
        let closed = sees_only_backs(surfaces, &probes, params);
        let mut closed: Vec<u32> =
            probes.sites.iter().zip(closed).filter(|(_, closed)| *closed).map(|(&site, _)| site).collect();
        closed.sort_unstable();
        sites.retain(|site| closed.binary_search(site).is_err());
        self.back_cells = cells;
        let more = self.points_at(surfaces, &sites, params.offset_m);
        self.points.append(more);
        self.back_points.extend((first..self.points.len()).map(|p| (self.points.sites[p] & !BACK, p as u32)));
        self.back_points.sort_unstable();
        first..self.points.len()
    }

    /// Appends points in free space, whose sites count from 0.
    pub(crate) fn append_free(&mut self, places: impl Iterator<Item = Place>) -> Range<usize> {
        let first = self.points.len();
        let mut more = PointSet::new(places);
        self.free_points = vec![NONE; more.len()];
        for (i, site) in more.sites.iter_mut().enumerate() {
            self.free_points[*site as usize] = (first + i) as u32;
            // of no vertex and no cell
            *site = NONE;
        }
        self.points.append(more);
        first..self.points.len()
    }

    /// The layout's own points among its cells.
    pub(crate) fn own(&self) -> Among<'_> {
        Among { layout: self, points: &self.points, first_free: (self.points.len() - self.free_points.len()) as u32 }
    }

    /// The points in free space, in the order in which they were given.
    pub(crate) fn free_points(&self) -> &[u32] {
        &self.free_points
    }

    /// Divided triangles and the sites of their cells.
    pub(crate) fn divided(&self) -> impl Iterator<Item = (u32, Range<u32>)> {
        let first = self.vertex_count;
        self.splits.iter().map(move |s| (s.triangle, first + s.first..first + s.first + s.parts * s.parts))
    }

    /// Where the rays of a site start.
    pub(crate) fn origin_of(&self, site: u32) -> Vec3 {
        self.points.origins[self.point_of_site[site as usize] as usize]
    }

    /// Vertices and sub-cells.
    pub(crate) fn site_count(&self) -> usize {
        self.vertex_count as usize + self.sub_cells.len()
    }

    /// Cells with a front: one number for each triangle (unused for a divided one), then the sub-cells.
    pub(crate) fn front_cell_count(&self) -> usize {
        self.triangle_count as usize + self.sub_cells.len()
    }

    /// Cells whose back has points.
    pub(crate) fn back_cells(&self) -> &[u32] {
        &self.back_cells
    }

    /// The cell at a place of a triangle.
    #[inline]
    pub(crate) fn cell_at(&self, triangle: u32, u: f32, v: f32) -> u32 {
        match self.split_of_triangle.get(triangle as usize) {
            Some(&split) if split != NONE => {
                let split = self.splits[split as usize];
                self.triangle_count + split.first + split.sub_cell(u, v)
            }
            _ => triangle,
        }
    }

    /// The cell of a hit, with the bit of the side that was met.
    #[inline]
    pub(crate) fn cell_of_hit(&self, hit: &Hit) -> u32 {
        self.cell_at(hit.triangle, hit.u, hit.v) | if hit.back { BACK } else { 0 }
    }

    /// Whether a hit (of a unit direction) is to be followed.
    #[inline]
    pub(crate) fn is_near(&self, hit: &Hit) -> bool {
        self.near_m.get(hit.triangle as usize).is_some_and(|&near| hit.t < near)
    }

    /// What each triangle fills of the views of some points; nothing where nothing bounces.
    pub(crate) fn seen(&self, surfaces: &Surfaces, params: &LightParams) -> Cow<'_, [u32]> {
        if !self.seen.is_empty() || self.near_m.is_empty() {
            return Cow::Borrowed(&self.seen);
        }
        let longest: Vec<f32> = (0..self.triangle_count).map(|t| longest_edge(surfaces, t)).collect();
        Cow::Owned(sight(surfaces, &longest, params))
    }

    /// The triangle of a cell, and the centre of a sub-cell.
    pub(crate) fn place_of_cell(&self, cell: u32) -> (u32, Option<(f32, f32)>) {
        match cell.checked_sub(self.triangle_count) {
            Some(sub) => {
                let (triangle, u, v) = self.sub_cells[sub as usize];
                (triangle, Some((u, v)))
            }
            None => (cell, None),
        }
    }

    /// The sites that light a cell: the three vertices, or the sub-cell's own (three times).
    #[inline]
    pub(crate) fn sites_of_cell(&self, surfaces: &Surfaces, cell: u32) -> [u32; 3] {
        match cell.checked_sub(self.triangle_count) {
            Some(sub) => [self.vertex_count + sub; 3],
            None => surfaces.triangles[cell as usize],
        }
    }

    pub(crate) fn back_point(&self, site: u32) -> Option<u32> {
        self.back_points.binary_search_by_key(&site, |p| p.0).ok().map(|i| self.back_points[i].1)
    }

    fn points_at(&self, surfaces: &Surfaces, sites: &[u32], offset_m: f32) -> PointSet {
        let (vertices, sub_cells) = (self.vertex_count, &self.sub_cells);
        let inward = inward_shifts(surfaces.positions, surfaces.triangles);
        let place = |&site: &u32| {
            let (index, side) = (site & !BACK, if site & BACK == 0 { 1.0 } else { -1.0 });
            match index.checked_sub(vertices) {
                None => {
                    let v = index as usize;
                    let (position, normal) = (surfaces.positions[v], surfaces.normals[v] * side);
                    Place { position, normal, inward: inward[v], lift_m: offset_m + surfaces.vertex_clearance_m(v), site }
                }
                Some(sub) => {
                    let (t, u, v) = sub_cells[sub as usize];
                    let (position, normal) = (surfaces.position_at(t, u, v), surfaces.normal_at(t, u, v) * side);
                    Place { position, normal, inward: Vec3::ZERO, lift_m: offset_m + surfaces.clearance_m(t), site }
                }
            }
        };
        PointSet::new(sites.iter().map(place))
    }
}

/// The length of the longest edge of a triangle, 0 of one that is never met.
fn longest_edge(surfaces: &Surfaces, triangle: u32) -> f32 {
    let [a, b, c] = surfaces.corners(triangle);
    let longest: Vec3 = Vec3::new(a.distance(b), b.distance(c), c.distance(a));
    // what has no area or no place is never met by a ray
    if longest.is_finite() && (b - a).cross(c - a).length_squared() > 0.0 { longest.max_element() } else { 0.0 }
}

fn parts(longest_edge_m: f32, cell_size_m: f32) -> u32 {
    ((longest_edge_m / cell_size_m).ceil() as u32).clamp(1, MAX_PARTS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sub_cell_holds_its_own_centre() {
        for parts in [1, 2, 3, 7, 64] {
            let split = Split { triangle: 0, parts, first: 0 };
            let centres: Vec<_> = split.centres().collect();
            assert_eq!(centres.len() as u32, parts * parts);
            for (i, &(u, v)) in centres.iter().enumerate() {
                assert_eq!(split.sub_cell(u, v), i as u32, "{parts} parts at {u} {v}");
            }
        }
    }

    #[test]
    fn places_on_and_beyond_the_edge_belong_to_some_sub_cell() {
        let split = Split { triangle: 0, parts: 5, first: 0 };
        for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (1.1, -0.1), (-0.0, 1.0001), (0.999_999, 0.000_1)] {
            assert!(split.sub_cell(u, v) < 25, "{u} {v}");
        }
    }
}
