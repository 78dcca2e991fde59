//! Item buffers: pictures whose pixels say which triangle is seen there.
//!
//! Why pictures and not rays for the bulk: of a temple of 2 million triangles, a pixel of a picture costs a fourteenth of a ray (21 million
//! pixels a second against 1.5 million rays on one thread), because neighbouring triangles share their corners and hidden groups of
//! them are passed over at once. Rays then look for what pictures miss, and judge.
//!
//! Corners are rounded to 1/256 of a pixel before anything is drawn, and a pixel is inside by integers, edges included: no pixel falls
//! through between triangles that share an edge (as GPUs do it: J. Pineda, "A Parallel Algorithm for Polygon Rasterization", SIGGRAPH 1988).
//! Groups of triangles come front to back, and those that lie behind all pixels of the tiles that they reach are passed over (N. Greene, M. Kass, G.
//! Miller, "Hierarchical Z-Buffer Visibility", SIGGRAPH 1993, with one level).

use crate::purge::clusters::{Cluster, Clusters};
use crate::purge::face::{Before, Face, GUARD};
use crate::purge::windows::Gates;
use glam::Vec3;

/// Parts of a pixel that corners are rounded to: 2 to this power.
const FRACTION: u32 = 8;
/// Half a pixel in those.
const HALF: i32 = 1 << (FRACTION - 1);
/// Pixels of a tile's side: 2 to this power.
const TILE: u32 = 4;
/// No triangle.
pub(super) const NOTHING: u32 = u32::MAX;

/// A square picture.
pub(super) struct Picture {
    side: usize,
    /// 1 / distance along forward; 0 where nothing is.
    nearness: Vec<f32>,
    ids: Vec<u32>,
    /// Tiles of a row.
    tiles: usize,
    /// The least nearness of each tile's pixels, or a lower bound; `stale` where it may have grown since.
    least: Vec<f32>,
    stale: Vec<bool>,
    /// Groups that may show, and how far they are at least.
    queue: Vec<(u32, u32)>,
    corners: Vec<Corner>,
    polygons: [Vec<Before>; 2],
}

/// A corner on the picture.
#[derive(Clone, Copy, Default)]
struct Corner {
    x: i32,
    y: i32,
    nearness: f32,
    /// Of [`Face::beyond`]: what keeps it from having a place.
    beyond: u32,
}

impl Picture {
    /// `side` in pixels, up to 4096.
    pub fn new(side: usize) -> Self {
        let side = side.clamp(1, 4096);
        let tiles = side.div_ceil(1 << TILE);
        Self {
            side,
            tiles,
            nearness: vec![0.0; side * side],
            ids: vec![NOTHING; side * side],
            least: vec![0.0; tiles * tiles],
            stale: vec![false; tiles * tiles],
            queue: Vec::new(),
            corners: Vec::new(),
            polygons: [Vec::new(), Vec::new()],
        }
    }

    /// The nearest triangle at each pixel, or [`NOTHING`], row after row from the lowest.
    pub fn rows(&self) -> impl Iterator<Item = &[u32]> {
        self.ids.chunks_exact(self.side)
    }

    /// Draws what is seen through a face of the cube around an eye. Of triangles for which `single_sided` answers true, fronts only.
    pub fn draw(&mut self, face: &Face, gates: &Gates, model: &Clusters, single_sided: impl Fn(u32) -> bool) {
        self.nearness.fill(0.0);
        self.ids.fill(NOTHING);
        self.least.fill(0.0);
        self.stale.fill(false);
        let mut queue = std::mem::take(&mut self.queue);
        queue.clear();
        for (i, cluster) in model.clusters.iter().enumerate() {
            if let Some(distance) = distance(face, gates, cluster) {
                queue.push((distance.to_bits(), i as u32));
            }
        }
        // Distances are not negative, so their bits are in their order.
        queue.sort_unstable();
        for &(_, i) in &queue {
            let cluster = &model.clusters[i as usize];
            if !self.is_hidden(face, cluster) {
                self.draw_cluster(face, model, cluster, &single_sided);
            }
        }
        self.queue = queue;
    }

    /// Whether everything in a group's bounds lies behind what is drawn.
    fn is_hidden(&mut self, face: &Face, cluster: &Cluster) -> bool {
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        let mut nearest = f32::INFINITY;
        for i in 0..8 {
            let pick = |axis: usize| if i >> axis & 1 == 1 { cluster.high[axis] } else { cluster.low[axis] };
            let [x, y, w] = face.place(Vec3::new(pick(0), pick(1), pick(2)));
            if w < face.near_m {
                return false;
            }
            let at = [x / w, y / w];
            for axis in 0..2 {
                low[axis] = low[axis].min(at[axis]);
                high[axis] = high[axis].max(at[axis]);
            }
            nearest = nearest.min(w);
        }
        let side = self.side as f32;
        // A pixel more each way than the rounding of corners takes.
        let tile = |x: f32, by: f32| (((x + 1.0) * 0.5 * side + by).clamp(0.0, side - 1.0) as usize) >> TILE;
        let [x0, y0] = low.map(|x| tile(x, -1.0));
        let [x1, y1] = high.map(|x| tile(x, 1.0));
        // and a bit nearer than the rounding of nearness
        let nearness = 1.0 / nearest * (1.0 + 8.0 * f32::EPSILON);
        (y0..=y1).all(|y| (x0..=x1).all(|x| self.least_of(x, y) >= nearness))
    }

    /// The least nearness of a tile's pixels.
    fn least_of(&mut self, x: usize, y: usize) -> f32 {
        let at = y * self.tiles + x;
        if std::mem::take(&mut self.stale[at]) {
            let (left, bottom) = (x << TILE, y << TILE);
            let (right, top) = ((left + (1 << TILE)).min(self.side), (bottom + (1 << TILE)).min(self.side));
            let mut least = f32::INFINITY;
            for row in bottom..top {
                let pixels = &self.nearness[row * self.side + left..row * self.side + right];
                least = pixels.iter().fold(least, |least, &x| if x < least { x } else { least });
                if least == 0.0 {
                    break;
                }
            }
            self.least[at] = least;
        }
        self.least[at]
    }

    fn draw_cluster(&mut self, face: &Face, model: &Clusters, cluster: &Cluster, single_sided: impl Fn(u32) -> bool) {
        let [first, last] = cluster.vertices.map(|i| i as usize);
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        corners.extend(model.vertices[first..last].iter().map(|&p| self.corner(face, face.place(p))));
        let [from, to] = cluster.triangles.map(|i| i as usize);
        for (t, &id) in model.corners[from..to].iter().zip(&model.ids[from..to]) {
            let abc = t.map(|i| corners[i as usize]);
            if abc.iter().fold(0, |any, c| any | c.beyond) == 0 {
                self.draw_triangle(abc, id, &single_sided);
            } else if abc.iter().fold(u32::MAX, |all, c| all & c.beyond) == 0 {
                let places = t.map(|i| face.place(model.vertices[first + i as usize]));
                self.draw_cut(face, places, id, &single_sided);
            }
        }
        self.corners = corners;
    }

    #[inline(always)]
    fn corner(&self, face: &Face, at: Before) -> Corner {
        let beyond = face.beyond(at, GUARD);
        if beyond != 0 {
            return Corner { beyond, ..Corner::default() };
        }
        let [x, y, w] = at;
        let nearness = 1.0 / w;
        // Rounded down from above zero: the guard's width is added first, and taken off again.
        let parts = (self.side << FRACTION) as f32;
        let place = |x: f32| ((x * nearness + GUARD + 1.0) * 0.5 * parts + 0.5) as i32 - (GUARD * 0.5 * parts) as i32;
        Corner { x: place(x), y: place(y), nearness, beyond }
    }

    /// A triangle that reaches behind the eye or far beyond the picture.
    #[cold]
    fn draw_cut(&mut self, face: &Face, places: [Before; 3], id: u32, single_sided: impl Fn(u32) -> bool) {
        let [mut polygon, mut spare] = std::mem::take(&mut self.polygons);
        polygon.clear();
        polygon.extend(places);
        // A little within, so that rounding leaves the new corners inside.
        face.cut(&mut polygon, &mut spare, 0.999 * GUARD);
        // The near plane's new corners are as near as it, up to rounding.
        let lenient = Face { near_m: 0.9 * face.near_m, ..*face };
        let corner = |p: &Before| Some(self.corner(&lenient, *p)).filter(|c| c.beyond == 0);
        let corners: Option<Vec<Corner>> = polygon.iter().map(corner).collect();
        if let Some([a, rest @ ..]) = corners.as_deref() {
            for bc in rest.windows(2) {
                self.draw_triangle([*a, bc[0], bc[1]], id, &single_sided);
            }
        }
        self.polygons = [polygon, spare];
    }

    #[inline]
    fn draw_triangle(&mut self, [a, mut b, mut c]: [Corner; 3], id: u32, single_sided: impl Fn(u32) -> bool) {
        // Pixels whose middles lie in the bounds.
        let first = |x: i32| ((x - HALF + (1 << FRACTION) - 1) >> FRACTION).max(0);
        let last = |x: i32| ((x - HALF) >> FRACTION).min(self.side as i32 - 1);
        let (x0, x1) = (first(a.x.min(b.x).min(c.x)), last(a.x.max(b.x).max(c.x)));
        let (y0, y1) = (first(a.y.min(b.y).min(c.y)), last(a.y.max(b.y).max(c.y)));
        if x0 > x1 || y0 > y1 {
            return;
        }
        let cross = |p: Corner, q: Corner, x: i32, y: i32| {
            i64::from(q.x - p.x) * i64::from(y - p.y) - i64::from(q.y - p.y) * i64::from(x - p.x)
        };
        let mut doubled = cross(a, b, c.x, c.y);
        if doubled == 0 || (doubled < 0 && single_sided(id)) {
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
        for y in y0..=y1 {
            let at = y as usize * self.side;
            let mut edge = row;
            for x in x0..=x1 {
                if edge[0] | edge[1] | edge[2] >= 0 {
                    let nearness = a.nearness + (edge[1] as f32 * to_b + edge[2] as f32 * to_c);
                    let pixel = at + x as usize;
                    if nearness > self.nearness[pixel] {
                        self.nearness[pixel] = nearness;
                        self.ids[pixel] = id;
                        any = true;
                    }
                }
                edge = core::array::from_fn(|i| edge[i] + steps[i][0]);
            }
            row = core::array::from_fn(|i| row[i] + steps[i][1]);
        }
        if any {
            for y in y0 as usize >> TILE..=y1 as usize >> TILE {
                self.stale[y * self.tiles + (x0 as usize >> TILE)..=y * self.tiles + (x1 as usize >> TILE)].fill(true);
            }
        }
    }
}

/// How far a group is from the eye at least, along forward; `None` if the face or the windows do not show it.
fn distance(face: &Face, gates: &Gates, cluster: &Cluster) -> Option<f32> {
    let middle = 0.5 * (cluster.low + cluster.high) - face.eye;
    let half = 0.5 * (cluster.high - cluster.low);
    let [right, up, forward] = face.axes;
    // The greatest that a linear function of the points of the box becomes.
    let most = |n: Vec3| n.dot(middle) + n.abs().dot(half);
    let far = most(forward);
    // Rounding may take a box at the border for one outside, but by less than anything that fills a pixel's middle.
    let slack = 1e-6 * (middle.abs().max_element() + half.max_element());
    let shown = far >= face.near_m
        && [forward - right, forward + right, forward - up, forward + up].into_iter().all(|n| most(n) >= -slack)
        && (gates.is_open() || gates.may_show(cluster.low - face.eye, cluster.high - face.eye));
    shown.then(|| (forward.dot(middle) - forward.abs().dot(half)).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ViewCell;
    use crate::purge::Surface;
    use crate::purge::face::cube;
    use heliodon_rays::{BuildParams, Hit, Ray, TriangleScene};
    use heliodon_testkit::scenes::{Scene, ball, cuboid, ground};

    fn open() -> Gates {
        Gates::new(Vec3::ZERO, &ViewCell { low: Vec3::ZERO, high: Vec3::ZERO, windows: Vec::new() }, 0.0)
    }

    /// Of all pixels of a cube: how many hold another triangle than a ray meets, and how many met one.
    fn against_rays(scene: &Scene, eye: Vec3, side: usize) -> (usize, usize) {
        let surface = Surface { positions: &scene.positions, triangles: &scene.triangles, single_sided: &[] };
        let model = Clusters::new(&surface);
        let rays = TriangleScene::build(&scene.positions, &scene.triangles, &BuildParams::default()).unwrap();
        let mut picture = Picture::new(side);
        let (mut other, mut met) = (0, 0);
        for face in cube(eye, 1e-3, 77) {
            picture.draw(&face, &open(), &model, |_| false);
            let [right, up, forward] = face.axes;
            let middle = |i: usize| (2 * i + 1) as f32 / side as f32 - 1.0;
            for (y, row) in picture.rows().enumerate() {
                let ray = |x| Ray {
                    origin: eye,
                    direction: forward + middle(x) * right + middle(y) * up,
                    t_min: 0.0,
                    t_max: f32::INFINITY,
                };
                let asked: Vec<Ray> = (0..side).map(ray).collect();
                let mut hits = vec![Hit::MISS; side];
                rays.closest(&asked, &mut hits);
                other += row.iter().zip(&hits).filter(|(id, hit)| **id != hit.triangle).count();
                met += hits.iter().filter(|hit| hit.is_some()).count();
            }
        }
        (other, met)
    }

    #[test]
    fn pixels_hold_what_rays_meet() {
        let scene = ground(60.0, 20)
            .moved(Vec3::NEG_Y)
            .and(ball(1.0, 60).moved(Vec3::new(3.0, 0.0, 0.0)))
            .and(cuboid(Vec3::new(-4.0, -1.0, -3.0), Vec3::new(-3.0, 4.0, 3.0), 9))
            .and(cuboid(Vec3::new(5.0, -1.0, -3.0), Vec3::new(6.0, 4.0, 3.0), 1));
        for eye in [Vec3::ZERO, Vec3::new(0.0, 1.0, 2.0), Vec3::new(-2.99, 0.0, 0.0)] {
            let (other, met) = against_rays(&scene, eye, 200);
            // edges are rounded to 1/256 of a pixel, so a pixel differs where its middle lies that close to one: of triangles
            // some 4 pixels wide, a hundredth
            assert!(met > 100_000 && other < met / 50, "{other} of {met} pixels differ at {eye}");
        }
    }

    #[test]
    fn nothing_shows_through_a_closed_ball() {
        let inner = ball(0.9, 90);
        let scene = inner.clone().and(ball(0.905, 131));
        let surface = Surface { positions: &scene.positions, triangles: &scene.triangles, single_sided: &[] };
        let model = Clusters::new(&surface);
        let mut picture = Picture::new(300);
        for (i, eye) in [Vec3::new(1.4, 0.0, 0.0), Vec3::new(0.5, 1.0, 0.9)].into_iter().enumerate() {
            for face in cube(eye, 1e-3, i as u32) {
                picture.draw(&face, &open(), &model, |_| false);
                assert!(picture.rows().flatten().all(|&id| id == NOTHING || id as usize >= inner.triangles.len()));
            }
        }
    }

    #[test]
    fn backs_of_single_sided_triangles_are_not_drawn() {
        let scene = ball(1.0, 30);
        let surface = Surface { positions: &scene.positions, triangles: &scene.triangles, single_sided: &[] };
        let model = Clusters::new(&surface);
        let mut picture = Picture::new(64);
        let drawn = |picture: &Picture| picture.rows().flatten().filter(|&&id| id != NOTHING).count();
        for face in cube(Vec3::ZERO, 1e-3, 5) {
            picture.draw(&face, &open(), &model, |_| true);
            assert_eq!(drawn(&picture), 0);
            picture.draw(&face, &open(), &model, |_| false);
            assert_eq!(drawn(&picture), 64 * 64, "without a gap");
        }
    }
}
