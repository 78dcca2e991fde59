//! The picture.

use crate::perspective::{GUARD, Perspective, Place};
use glam::Vec3;
use std::ops::Range;

/// Parts of a pixel that corners are rounded to: 2 to this power.
const FRACTION: u32 = 8;
/// Half a pixel in those.
const HALF: i32 = 1 << (FRACTION - 1);
/// Pixels of a tile's side: 2 to this power.
const TILE: u32 = 4;
/// Pixels of a tile's side.
pub const TILE_PX: usize = 1 << TILE;
/// No triangle.
pub const NOTHING: u32 = u32::MAX;
/// The most pixels of a picture's side.
pub const MAX_SIDE: usize = 1 << 14;

/// A picture, or some rows of one.
#[derive(Clone, Debug)]
pub struct ItemBuffer {
    width: usize,
    height: usize,
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
}

/// A corner on the picture.
#[derive(Clone, Copy, Debug, Default)]
pub struct Corner {
    x: i32,
    y: i32,
    nearness: f32,
    /// Of [`Perspective::beyond`]: what keeps it from having a place.
    beyond: u32,
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
            // Asked so that what is not a number is before it.
            if !(w >= perspective.near_m) {
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
            let tile =
                |x: f32, by: f32| ((x + 1.0) * 0.5 * side as f32 + by).clamp(0.0, side as f32 - 1.0) as u32 >> TILE;
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
        let pixels = width * rows.len();
        let all_tiles = tiles * rows.len().div_ceil(TILE_PX);
        Self {
            width,
            height,
            rows,
            nearness: vec![0.0; pixels],
            ids: vec![NOTHING; pixels],
            tiles,
            least: vec![0.0; all_tiles],
            stale: vec![false; all_tiles],
            polygons: [Vec::new(), Vec::new()],
        }
    }

    /// Which rows of the picture it holds, from the lowest.
    #[must_use]
    pub fn held(&self) -> Range<usize> {
        self.rows.clone()
    }

    /// The nearest triangle at each pixel, or [`NOTHING`], row after row from the lowest that it holds.
    pub fn rows(&self) -> impl DoubleEndedIterator<Item = &[u32]> + ExactSizeIterator {
        self.ids.chunks_exact(self.width)
    }

    /// 1 / distance along forward at each pixel, or 0, in the order of [`Self::rows`].
    pub fn nearness(&self) -> impl DoubleEndedIterator<Item = &[f32]> + ExactSizeIterator {
        self.nearness.chunks_exact(self.width)
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
                let pixels = &self.nearness[row * self.width + left..row * self.width + right];
                least = pixels.iter().fold(least, |least, &x| if x < least { x } else { least });
                if least == 0.0 {
                    break;
                }
            }
            self.least[at] = least;
        }
        self.least[at]
    }

    /// A corner's place on the picture.
    #[inline(always)]
    #[must_use]
    pub fn corner(&self, perspective: &Perspective, at: Place) -> Corner {
        let beyond = perspective.beyond(at, GUARD);
        if beyond != 0 {
            return Corner { beyond, ..Corner::default() };
        }
        let [x, y, w] = at;
        let nearness = 1.0 / w;
        // Rounded down from above zero: the guard's width is added first, and taken off again.
        let place = |x: f32, side: usize| {
            let parts = (side << FRACTION) as f32;
            ((x * nearness + GUARD + 1.0) * 0.5 * parts + 0.5) as i32 - (GUARD * 0.5 * parts) as i32
        };
        Corner { x: place(x, self.width), y: place(y, self.height), nearness, beyond }
    }

    /// Draws a triangle, counterclockwise where its front is seen; one whose back is only if it is not `single_sided`. `places` are its corners', for one
    /// that reaches behind the eye or far beyond the picture.
    #[inline(always)]
    pub fn draw(
        &mut self,
        perspective: &Perspective,
        corners: [Corner; 3],
        places: impl FnOnce() -> [Place; 3],
        id: u32,
        single_sided: bool,
    ) {
        if corners.iter().fold(0, |any, c| any | c.beyond) == 0 {
            self.draw_whole(corners, id, single_sided);
        } else if corners.iter().fold(u32::MAX, |all, c| all & c.beyond) == 0 {
            self.draw_cut(perspective, places(), id, single_sided);
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
        let corner = |p: &Place| Some(self.corner(&lenient, *p)).filter(|c| c.beyond == 0);
        let corners: Option<Vec<Corner>> = polygon.iter().map(corner).collect();
        if let Some([a, rest @ ..]) = corners.as_deref() {
            for bc in rest.windows(2) {
                self.draw_whole([*a, bc[0], bc[1]], id, single_sided);
            }
        }
        self.polygons = [polygon, spare];
    }

    #[inline]
    fn draw_whole(&mut self, [a, mut b, mut c]: [Corner; 3], id: u32, single_sided: bool) {
        // Pixels whose middles lie in the bounds.
        let first = |x: i32, least: usize| ((x - HALF + (1 << FRACTION) - 1) >> FRACTION).max(least as i32);
        let last = |x: i32, end: usize| ((x - HALF) >> FRACTION).min(end as i32 - 1);
        let (x0, x1) = (first(a.x.min(b.x).min(c.x), 0), last(a.x.max(b.x).max(c.x), self.width));
        let (y0, y1) = (first(a.y.min(b.y).min(c.y), self.rows.start), last(a.y.max(b.y).max(c.y), self.rows.end));
        if x0 > x1 || y0 > y1 {
            return;
        }
        let cross = |p: Corner, q: Corner, x: i32, y: i32| {
            i64::from(q.x - p.x) * i64::from(y - p.y) - i64::from(q.y - p.y) * i64::from(x - p.x)
        };
        let mut doubled = cross(a, b, c.x, c.y);
        if doubled == 0 || (doubled < 0 && single_sided) {
            return;
        }
        if doubled < 0 {
            (b, c, doubled) = (c, b, -doubled);
        }
        let (x, y) = ((x0 << FRACTION) + HALF, (y0 << FRACTION) + HALF);
        let mut row = [cross(b, c, x, y), cross(c, a, x, y), cross(a, b, x, y)];
        let step = |p: Corner, q: Corner| [i64::from(p.y - q.y) << FRACTION, i64::from(q.x - p.x) << FRACTION];
        let steps = [step(b, c), step(c, a), step(a, b)];
        let share = 1.0 / doubled as f32;
        let (to_b, to_c) = ((b.nearness - a.nearness) * share, (c.nearness - a.nearness) * share);
        let mut any = false;
        let [left, right] = [x0, x1].map(|x| x as usize);
        let [bottom, top] = [y0, y1].map(|y| y as usize - self.rows.start);
        for y in bottom..=top {
            let pixels = y * self.width + left..=y * self.width + right;
            let mut edge = row;
            for (nearest, shown) in self.nearness[pixels.clone()].iter_mut().zip(&mut self.ids[pixels]) {
                if edge[0] | edge[1] | edge[2] >= 0 {
                    let nearness = a.nearness + (edge[1] as f32 * to_b + edge[2] as f32 * to_c);
                    if nearness > *nearest {
                        *nearest = nearness;
                        *shown = id;
                        any = true;
                    }
                }
                edge = core::array::from_fn(|i| edge[i] + steps[i][0]);
            }
            row = core::array::from_fn(|i| row[i] + steps[i][1]);
        }
        if any {
            for y in bottom >> TILE..=top >> TILE {
                self.stale[y * self.tiles + (left >> TILE)..=y * self.tiles + (right >> TILE)].fill(true);
            }
        }
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
        for (id, triangle) in scene.triangles.iter().enumerate() {
            let places = triangle.map(|vertex| eye.place(scene.positions[vertex as usize]));
            picture.draw(eye, places.map(|place| picture.corner(eye, place)), || places, id as u32, single_sided);
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
                    for ((id, nearness), hit) in row.iter().zip(nearness).zip(&hits).filter(|((id, _), hit)| **id == hit.triangle) {
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
        let wall = cuboid(Vec3::new(-2.0, -2.0, -6.0), Vec3::new(2.0, 1.5, -5.0), 3);
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
                let small = cuboid(low, high, 1);
                for triangle in &small.triangles {
                    let places = triangle.map(|vertex| face.place(small.positions[vertex as usize]));
                    band.draw(&face, places.map(|place| band.corner(&face, place)), || places, 77_777, false);
                }
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
        let places = [[f32::NAN, 0.0, 1.0], [1.0, -1.0, 1.0], [0.0, 1.0, 1.0]];
        picture.draw(&face, places.map(|place| picture.corner(&face, place)), || places, 1, false);
        assert_eq!(drawn(&picture), 0);
        assert_eq!(Extent::new(&face, (Vec3::splat(f32::NAN), Vec3::ONE), [32, 32]), None);
    }
}
