//! The picture.

use crate::corners::{Corner, Corners, FRACTION, HALF, cross};
use crate::lanes::{Fill, LANES, Portable};
use crate::perspective::{GUARD, Perspective, Place};
use crate::weights::Weights;
use glam::Vec3;
use std::ops::Range;

/// Triangles that reach less far, in parts of a pixel, have areas that 32 bits hold.
const SMALL: i32 = 64 << FRACTION;
/// Pixels of a tile's side: 2 to this power.
const TILE: u32 = 4;
/// Pixels of a tile's side.
pub const TILE_PX: usize = 1 << TILE;
/// No triangle.
pub const NOTHING: u32 = u32::MAX;
/// The most pixels of a picture's side.
pub const MAX_SIDE: usize = 1 << 13;

/// A picture, or some rows of one.
#[derive(Clone, Debug)]
pub struct ItemBuffer {
    width: usize,
    height: usize,
    /// Pixels of a row, with some to the right that nobody asks for.
    stride: usize,
    /// Those that it holds, from the lowest; whole tiles but at the top.
    rows: Range<usize>,
    /// 1 / distance along forward; 0 where nothing is.
    nearness: Vec<f32>,
    ids: Vec<u32>,
    /// Tiles of a row.
    tiles: usize,
    /// The least nearness of each tile's pixels, or a lower bound; `stale` where it may have grown since.
    least: Vec<f32>,
    stale: Vec<bool>,
    polygons: [Vec<Place>; 2],
    corners: Corners,
}

/// Triangles and the vertices that they share, of which there are at most 256.
#[derive(Clone, Copy, Debug)]
pub struct Group<'a> {
    /// The vertices' coordinates, one axis after the other, of equal lengths.
    pub points: [&'a [f32]; 3],
    /// The numbers of each triangle's vertices, counterclockwise where its front is seen.
    pub triangles: &'a [[u8; 3]],
}

/// What a box covers of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// First and last column of tiles.
    columns: [u32; 2],
    /// First and last row of tiles.
    rows: [u32; 2],
    /// No point of the box is nearer: 1 / distance along forward.
    pub nearness: f32,
}

impl Extent {
    /// Of the box from `low` to `high` in a picture of this size; `None` where it reaches before the near plane, so that nothing can be said.
    #[must_use]
    pub fn new(perspective: &Perspective, (low, high): (Vec3, Vec3), [width, height]: [usize; 2]) -> Option<Self> {
        let (mut least, mut most) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        let mut nearest = f32::INFINITY;
        for i in 0..8 {
            let pick = |axis: usize| if i >> axis & 1 == 1 { high[axis] } else { low[axis] };
            let [x, y, w] = perspective.place(Vec3::new(pick(0), pick(1), pick(2)));
            if w < perspective.near_m || w.is_nan() {
                return None;
            }
            let at = [x / w, y / w];
            for axis in 0..2 {
                least[axis] = least[axis].min(at[axis]);
                most[axis] = most[axis].max(at[axis]);
            }
            nearest = nearest.min(w);
        }
        // A pixel more each way than the rounding of corners takes.
        let tiles = |axis: usize, side: usize| {
            let tile = |x: f32, by: f32| ((x + 1.0) * 0.5 * side as f32 + by).clamp(0.0, side as f32 - 1.0) as u32 >> TILE;
            [tile(least[axis], -1.0), tile(most[axis], 1.0)]
        };
        // and a bit nearer than the rounding of nearness
        let nearness = 1.0 / nearest * (1.0 + 8.0 * f32::EPSILON);
        Some(Self { columns: tiles(0, width), rows: tiles(1, height), nearness })
    }

    /// Whether it may cover any of these rows, which begin with a tile.
    #[must_use]
    pub fn meets(&self, rows: &Range<usize>) -> bool {
        (self.rows[0] as usize) << TILE < rows.end && (self.rows[1] as usize + 1) << TILE > rows.start
    }
}

impl ItemBuffer {
    /// A whole picture, of at most [`MAX_SIDE`] pixels a side.
    ///
    /// # Panics
    /// With no pixels or more of them.
    #[must_use]
    pub fn new(width: usize, height: usize) -> Self {
        Self::band([width, height], 0..height)
    }

    /// Some rows of a picture, counted from the lowest, which begin with a multiple of [`TILE_PX`] and end with one or with the picture.
    ///
    /// # Panics
    /// With other rows, and as [`Self::new`].
    #[must_use]
    pub fn band([width, height]: [usize; 2], rows: Range<usize>) -> Self {
        assert!([width, height].iter().all(|side| (1..=MAX_SIDE).contains(side)), "a picture of {width} x {height} pixels");
        let whole = |row: usize| row.is_multiple_of(TILE_PX);
        assert!(rows.start < rows.end && rows.end <= height && whole(rows.start), "rows {rows:?} of {height}");
        assert!(rows.end == height || whole(rows.end), "rows {rows:?} of {height}");
        let tiles = width.div_ceil(TILE_PX);
        let stride = width + LANES;
        let pixels = stride * rows.len();
        let all_tiles = tiles * rows.len().div_ceil(TILE_PX);
        Self {
            width,
            height,
            stride,
            rows,
            nearness: vec![0.0; pixels],
            ids: vec![NOTHING; pixels],
            tiles,
            least: vec![0.0; all_tiles],
            stale: vec![false; all_tiles],
            polygons: [Vec::new(), Vec::new()],
            corners: Corners::default(),
        }
    }

    /// Which rows of the picture it holds, from the lowest.
    #[must_use]
    pub fn held(&self) -> Range<usize> {
        self.rows.clone()
    }

    /// The nearest triangle at each pixel, or [`NOTHING`], row after row from the lowest that it holds.
    pub fn rows(&self) -> impl DoubleEndedIterator<Item = &[u32]> + ExactSizeIterator {
        self.ids.chunks_exact(self.stride).map(|row| &row[..self.width])
    }

    /// One of [`Self::rows`].
    #[inline(always)]
    #[must_use]
    pub fn row(&self, number: usize) -> &[u32] {
        &self.ids[number * self.stride..][..self.width]
    }

    /// 1 / distance along forward at each pixel, or 0, in the order of [`Self::rows`].
    pub fn nearness(&self) -> impl DoubleEndedIterator<Item = &[f32]> + ExactSizeIterator {
        self.nearness.chunks_exact(self.stride).map(|row| &row[..self.width])
    }

    /// Takes everything away.
    pub fn clear(&mut self) {
        self.nearness.fill(0.0);
        self.ids.fill(NOTHING);
        self.least.fill(0.0);
        self.stale.fill(false);
    }

    /// Whether everything in a box, which meets the rows, lies behind what is drawn.
    #[must_use]
    pub fn hides(&mut self, extent: &Extent) -> bool {
        let [bottom, top] = extent.rows.map(|row| row as usize);
        let first = self.rows.start >> TILE;
        let last = (self.rows.end - 1) >> TILE;
        let [left, right] = extent.columns.map(|column| column as usize);
        (bottom.max(first)..=top.min(last)).all(|y| (left..=right).all(|x| self.least_of(x, y - first) >= extent.nearness))
    }

    /// The least nearness of a tile's pixels.
    fn least_of(&mut self, x: usize, y: usize) -> f32 {
        let at = y * self.tiles + x;
        if std::mem::take(&mut self.stale[at]) {
            let (left, bottom) = (x << TILE, y << TILE);
            let (right, top) = ((left + TILE_PX).min(self.width), (bottom + TILE_PX).min(self.rows.len()));
            let mut least = f32::INFINITY;
            for row in bottom..top {
                let pixels = &self.nearness[row * self.stride + left..row * self.stride + right];
                least = pixels.iter().fold(least, |least, &x| if x < least { x } else { least });
                if least == 0.0 {
                    break;
                }
            }
            self.least[at] = least;
        }
        self.least[at]
    }

    /// Draws a group of triangles, which have these ids; backs are seen of those that are not `single_sided`.
    ///
    /// # Panics
    /// With a vertex that is not there.
    pub fn draw(
        &mut self,
        perspective: &Perspective,
        group: Group,
        id: impl Fn(usize) -> u32,
        single_sided: impl Fn(usize) -> bool,
    ) {
        #[cfg(target_arch = "x86_64")]
        if let Some(wide) = pulp::x86::V3::try_new() {
            return wide.vectorize(Wide { picture: self, perspective, group, id, single_sided, fill: wide });
        }
        self.draw_with(perspective, group, id, single_sided, Portable);
    }

    #[inline(always)]
    fn draw_with(
        &mut self,
        perspective: &Perspective,
        group: Group,
        id: impl Fn(usize) -> u32,
        single_sided: impl Fn(usize) -> bool,
        fill: impl Fill,
    ) {
        self.corners.place(perspective, [self.width, self.height], group.points);
        let known = group.points[0].len();
        for (number, triangle) in group.triangles.iter().enumerate() {
            let (a, b, c) = (self.corners.at(triangle[0]), self.corners.at(triangle[1]), self.corners.at(triangle[2]));
            if a.beyond | b.beyond | c.beyond == 0 {
                self.draw_whole([a, b, c], id(number), single_sided(number), fill);
            } else if a.beyond & b.beyond & c.beyond == 0 {
                let numbers = triangle.map(usize::from);
                assert!(numbers.iter().all(|&vertex| vertex < known), "a vertex that is not there");
                let places = numbers.map(|vertex| perspective.place(Vec3::from_array(group.points.map(|axis| axis[vertex]))));
                self.draw_cut(perspective, places, id(number), single_sided(number));
            }
        }
    }

    #[cold]
    fn draw_cut(&mut self, perspective: &Perspective, places: [Place; 3], id: u32, single_sided: bool) {
        let [mut polygon, mut spare] = std::mem::take(&mut self.polygons);
        polygon.clear();
        polygon.extend(places);
        // A little within, so that rounding leaves the new corners inside.
        perspective.cut(&mut polygon, &mut spare, 0.999 * GUARD);
        // The near plane's new corners are as near as it, up to rounding.
        let lenient = Perspective { near_m: 0.9 * perspective.near_m, ..*perspective };
        let size = [self.width, self.height];
        let corner = |p: &Place| Some(Corner::new(&lenient, size, *p)).filter(|c| c.beyond == 0);
        let corners: Option<Vec<Corner>> = polygon.iter().map(corner).collect();
        if let Some([a, rest @ ..]) = corners.as_deref() {
            for bc in rest.windows(2) {
                self.draw_whole([*a, bc[0], bc[1]], id, single_sided, Portable);
            }
        }
        self.polygons = [polygon, spare];
    }

    #[inline(always)]
    fn draw_whole(&mut self, [a, mut b, mut c]: [Corner; 3], id: u32, single_sided: bool, fill: impl Fill) {
        // Pixels whose middles lie in the bounds.
        let first = |x: i32, least: usize| ((x - HALF + (1 << FRACTION) - 1) >> FRACTION).max(least as i32);
        let last = |x: i32, end: usize| ((x - HALF) >> FRACTION).min(end as i32 - 1);
        let [low, high] = [[a.x.min(b.x).min(c.x), a.y.min(b.y).min(c.y)], [a.x.max(b.x).max(c.x), a.y.max(b.y).max(c.y)]];
        let (y0, y1) = (first(low[1], self.rows.start), last(high[1], self.rows.end));
        let (x0, x1) = (first(low[0], 0), last(high[0], self.width));
        if x0 > x1 || y0 > y1 {
            return;
        }
        let mut doubled = cross(a, b, c.x, c.y);
        if doubled == 0 || (doubled < 0 && single_sided) {
            return;
        }
        if doubled < 0 {
            (b, c, doubled) = (c, b, -doubled);
        }
        let start = [(x0 << FRACTION) + HALF, (y0 << FRACTION) + HALF];
        let share = 1.0 / doubled as f32;
        let slope = [(b.nearness - a.nearness) * share, (c.nearness - a.nearness) * share];
        let [left, right] = [x0, x1].map(|x| x as usize);
        let [bottom, top] = [y0, y1].map(|y| y as usize - self.rows.start);
        let bounds = [left, right, bottom, top];
        let any = if (high[0] - low[0]).max(high[1] - low[1]) < SMALL {
            self.fill_small([a, b, c], start, slope, bounds, (id, fill))
        } else {
            self.fill([a, b, c], start, slope, bounds, id)
        };
        if any {
            for y in bottom >> TILE..=top >> TILE {
                self.stale[y * self.tiles + (left >> TILE)..=y * self.tiles + (right >> TILE)].fill(true);
            }
        }
    }

    /// Fills the pixels of a small triangle, some in a row at once.
    #[inline(always)]
    fn fill_small(
        &mut self,
        [a, b, c]: [Corner; 3],
        [x, y]: [i32; 2],
        slope: [f32; 2],
        [left, right, bottom, top]: [usize; 4],
        (id, fill): (u32, impl Fill),
    ) -> bool {
        let first = |p: Corner, q: Corner| (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
        let across = [(b.y - c.y) << FRACTION, (c.y - a.y) << FRACTION, (a.y - b.y) << FRACTION];
        let up = [(c.x - b.x) << FRACTION, (a.x - c.x) << FRACTION, (b.x - a.x) << FRACTION];
        let mut row = [fill.ramp(first(b, c), across[0]), fill.ramp(first(c, a), across[1]), fill.ramp(first(a, b), across[2])];
        let next = |edges: [_; 3], by: [i32; 3]| {
            [fill.stepped(edges[0], by[0]), fill.stepped(edges[1], by[1]), fill.stepped(edges[2], by[2])]
        };
        let right_by = [across[0] * LANES as i32, across[1] * LANES as i32, across[2] * LANES as i32];
        let mut any = false;
        for y in bottom..=top {
            let mut edges = row;
            for x in (left..=right).step_by(LANES) {
                let at = y * self.stride + x;
                // rows have as many pixels more
                if let (Some(nearest), Some(shown)) = (self.nearness[at..].first_chunk_mut(), self.ids[at..].first_chunk_mut())
                {
                    any |= fill.fill(edges, a.nearness, slope, id, (nearest, shown));
                }
                edges = next(edges, right_by);
            }
            row = next(row, up);
        }
        any
    }

    /// Fills the pixels of any triangle.
    #[inline(always)]
    fn fill(
        &mut self,
        [a, b, c]: [Corner; 3],
        [x, y]: [i32; 2],
        slope: [f32; 2],
        [left, right, bottom, top]: [usize; 4],
        id: u32,
    ) -> bool {
        let mut row = [cross(b, c, x, y), cross(c, a, x, y), cross(a, b, x, y)];
        let step = |p: Corner, q: Corner| [i64::from(p.y - q.y) << FRACTION, i64::from(q.x - p.x) << FRACTION];
        let steps = [step(b, c), step(c, a), step(a, b)];
        let mut any = false;
        for y in bottom..=top {
            let pixels = y * self.stride + left..=y * self.stride + right;
            let mut edge = row;
            for (nearest, shown) in self.nearness[pixels.clone()].iter_mut().zip(&mut self.ids[pixels]) {
                if edge[0] | edge[1] | edge[2] >= 0 {
                    let nearness = a.nearness + (edge[1] as f32 * slope[0] + edge[2] as f32 * slope[1]);
                    if nearness > *nearest {
                        *nearest = nearness;
                        *shown = id;
                        any = true;
                    }
                }
                edge = core::array::from_fn(|k| edge[k] + steps[k][0]);
            }
            row = core::array::from_fn(|k| row[k] + steps[k][1]);
        }
        any
    }

    /// The weights of a triangle's corners over its pixels.
    #[must_use]
    pub fn weights(&self, perspective: &Perspective, points: [Vec3; 3]) -> Weights {
        Weights::new(perspective, [self.width, self.height], points)
    }
}

/// A call of [`ItemBuffer::draw_with`].
#[cfg(target_arch = "x86_64")]
struct Wide<'a, F, G, H> {
    picture: &'a mut ItemBuffer,
    perspective: &'a Perspective,
    group: Group<'a>,
    id: F,
    single_sided: G,
    fill: H,
}

#[cfg(target_arch = "x86_64")]
impl<F: Fn(usize) -> u32, G: Fn(usize) -> bool, H: Fill> pulp::NullaryFnOnce for Wide<'_, F, G, H> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.picture.draw_with(self.perspective, self.group, self.id, self.single_sided, self.fill);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_rays::{BuildParams, Hit, Ray, TriangleScene};
    use heliodon_testkit::scenes::{Scene, ball, cuboid, ground};

    const TO: [[Vec3; 3]; 6] = [
        [Vec3::X, Vec3::Y, Vec3::NEG_Z],
        [Vec3::NEG_X, Vec3::Y, Vec3::Z],
        [Vec3::Z, Vec3::Y, Vec3::X],
        [Vec3::NEG_Z, Vec3::Y, Vec3::NEG_X],
        [Vec3::X, Vec3::NEG_Z, Vec3::NEG_Y],
        [Vec3::X, Vec3::Z, Vec3::Y],
    ];

    fn cube(eye: Vec3) -> [Perspective; 6] {
        TO.map(|axes| Perspective { eye, axes, near_m: 1e-3 })
    }

    fn draw(picture: &mut ItemBuffer, eye: &Perspective, scene: &Scene, single_sided: bool) {
        picture.clear();
        add(picture, eye, scene, 0, single_sided);
    }

    fn add(picture: &mut ItemBuffer, eye: &Perspective, scene: &Scene, first: u32, single_sided: bool) {
        for (number, triangles) in scene.triangles.chunks(50).enumerate() {
            let points: Vec<Vec3> = triangles.iter().flatten().map(|&vertex| scene.positions[vertex as usize]).collect();
            let axes: [Vec<f32>; 3] = core::array::from_fn(|axis| points.iter().map(|point| point[axis]).collect());
            let triangles: Vec<[u8; 3]> = (0..triangles.len() as u8).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let group = Group { points: axes.each_ref().map(|axis| &axis[..]), triangles: &triangles };
            picture.draw(eye, group, |i| first + (50 * number + i) as u32, |_| single_sided);
        }
    }

    fn drawn(picture: &ItemBuffer) -> usize {
        picture.rows().flatten().filter(|&&id| id != NOTHING).count()
    }

    fn still_life() -> Scene {
        ground(60.0, 20)
            .moved(Vec3::NEG_Y)
            .and(ball(1.0, 60).moved(Vec3::new(3.0, 0.0, 0.0)))
            .and(cuboid(Vec3::new(-4.0, -1.0, -3.0), Vec3::new(-3.0, 4.0, 3.0), 9))
            .and(cuboid(Vec3::new(5.0, -1.0, -3.0), Vec3::new(6.0, 4.0, 3.0), 1))
    }

    #[test]
    fn pixels_hold_what_rays_meet() {
        let scene = still_life();
        let rays = TriangleScene::build(&scene.positions, &scene.triangles, &BuildParams::default()).unwrap();
        let [width, height] = [260, 200];
        let mut picture = ItemBuffer::new(width, height);
        for eye in [Vec3::new(0.01, 0.02, 0.0), Vec3::new(0.0, 1.0, 2.0), Vec3::new(-2.99, 0.01, 0.0)] {
            let (mut other, mut met) = (0, 0);
            for face in cube(eye) {
                draw(&mut picture, &face, &scene, false);
                let [right, up, forward] = face.axes;
                let middle = |i: usize, side: usize| (2 * i + 1) as f32 / side as f32 - 1.0;
                for (y, (row, nearness)) in picture.rows().zip(picture.nearness()).enumerate() {
                    let ray = |x| Ray {
                        origin: eye,
                        direction: forward + middle(x, width) * right + middle(y, height) * up,
                        t_min: 0.0,
                        t_max: f32::INFINITY,
                    };
                    let asked: Vec<Ray> = (0..width).map(ray).collect();
                    let mut hits = vec![Hit::MISS; width];
                    rays.closest(&asked, &mut hits);
                    other += row.iter().zip(&hits).filter(|(id, hit)| **id != hit.triangle).count();
                    met += hits.iter().filter(|hit| hit.is_some()).count();
                    for ((id, nearness), hit) in
                        row.iter().zip(nearness).zip(&hits).filter(|((id, _), hit)| **id == hit.triangle)
                    {
                        let wanted = if hit.is_some() { 1.0 / hit.t } else { 0.0 };
                        assert!((nearness - wanted).abs() <= 2e-3 * wanted, "{id}: {nearness} for {wanted}");
                    }
                }
            }
            // edges are rounded to 1/256 of a pixel, so a pixel differs where its middle lies that close to one: of triangles
            // some 4 pixels wide, a hundredth
            assert!(met > 100_000 && other < met / 50, "{other} of {met} pixels differ at {eye}");
        }
    }

    #[test]
    fn bands_are_rows_of_the_picture() {
        let scene = still_life();
        let size = [150, 100];
        let mut whole = ItemBuffer::new(size[0], size[1]);
        let mut bands = [0..32, 32..48, 48..100].map(|rows| ItemBuffer::band(size, rows));
        for face in cube(Vec3::new(0.3, 0.7, 0.1)) {
            draw(&mut whole, &face, &scene, false);
            bands.iter_mut().for_each(|band| draw(band, &face, &scene, false));
            assert!(whole.rows().eq(bands.iter().flat_map(ItemBuffer::rows)));
            assert!(whole.nearness().eq(bands.iter().flat_map(ItemBuffer::nearness)));
        }
    }

    #[test]
    fn what_is_hidden_would_change_nothing() {
        let wall = cuboid(Vec3::new(-2.0, -2.0, -6.0), Vec3::new(2.0, 4.0, -5.0), 3);
        let [face, ..] = cube(Vec3::ZERO);
        let size = [120, 90];
        let mut bands = [0..48, 48..90].map(|rows| ItemBuffer::band(size, rows));
        bands.iter_mut().for_each(|band| draw(band, &face, &wall, false));
        let mut hidden = [0, 0];
        for i in 0..400 {
            let middle = Vec3::new((i % 20) as f32 * 0.5 - 5.0, (i / 20) as f32 * 0.5 - 5.0, -4.0 - (i % 7) as f32);
            let (low, high) = (middle - 0.3, middle + 0.3);
            let extent = Extent::new(&face, (low, high), size).unwrap();
            for (band, hidden) in bands.iter_mut().zip(&mut hidden) {
                if !extent.meets(&band.held()) || !band.hides(&extent) {
                    continue;
                }
                let before = band.clone();
                add(band, &face, &cuboid(low, high, 1), 77_777, false);
                *hidden += 1;
                assert!(band.rows().eq(before.rows()), "box {i}");
            }
        }
        assert!(hidden.iter().all(|&hidden| hidden > 10), "{hidden:?}");
        let around = (Vec3::splat(-1.0), Vec3::ONE);
        assert_eq!(Extent::new(&face, around, size), None);
    }

    #[test]
    fn nothing_shows_through_a_closed_ball() {
        let inner = ball(0.9, 90);
        let scene = inner.clone().and(ball(0.905, 131));
        let mut picture = ItemBuffer::new(300, 300);
        for eye in [Vec3::new(1.4, 0.0, 0.0), Vec3::new(0.5, 1.0, 0.9)] {
            for face in cube(eye) {
                draw(&mut picture, &face, &scene, false);
                assert!(picture.rows().flatten().all(|&id| id == NOTHING || id as usize >= inner.triangles.len()));
            }
        }
    }

    #[test]
    fn backs_of_single_sided_triangles_are_not_drawn() {
        let scene = ball(1.0, 30);
        let mut picture = ItemBuffer::new(64, 64);
        for face in cube(Vec3::ZERO) {
            draw(&mut picture, &face, &scene, true);
            assert_eq!(drawn(&picture), 0);
            draw(&mut picture, &face, &scene, false);
            assert_eq!(drawn(&picture), 64 * 64, "without a gap");
        }
    }

    #[test]
    fn what_is_no_number_is_not_drawn() {
        let [face, ..] = cube(Vec3::ZERO);
        let mut picture = ItemBuffer::new(32, 32);
        let points: [&[f32]; 3] = [&[f32::NAN, 1.0, 0.0], &[0.0, -1.0, 1.0], &[-1.0, -1.0, -1.0]];
        picture.draw(&face, Group { points, triangles: &[[0, 1, 2]] }, |_| 1, |_| false);
        assert_eq!(drawn(&picture), 0);
        assert_eq!(Extent::new(&face, (Vec3::splat(f32::NAN), Vec3::ONE), [32, 32]), None);
    }
}
