//! What an eye sees of a model through one side of the cube around it, as an item buffer.
//!
//! Why pictures and not rays for the bulk: of a temple of 2 million triangles, a pixel of a picture costs a fourteenth of a ray (21 million
//! pixels a second against 1.5 million rays on one thread), because neighbouring triangles share their corners and hidden groups of
//! them are passed over at once. Rays then look for what pictures miss, and judge.

use crate::purge::clusters::{Cluster, Clusters};
use crate::purge::windows::Gates;
use glam::Vec3;
use heliodon_raster::{Extent, ItemBuffer, Perspective};

/// A square picture.
pub(super) struct Picture {
    side: usize,
    items: ItemBuffer,
    /// Groups that may show, and how far they are at least.
    queue: Vec<(u32, u32)>,
}

impl Picture {
    /// `side` in pixels, up to 4096.
    pub fn new(side: usize) -> Self {
        let side = side.clamp(1, 4096);
        Self { side, items: ItemBuffer::new(side, side), queue: Vec::new() }
    }

    /// The nearest triangle at each pixel, or [`heliodon_raster::NOTHING`], row after row from the lowest.
    pub fn rows(&self) -> impl Iterator<Item = &[u32]> {
        self.items.rows()
    }

    /// Draws what is seen through a face of the cube around an eye. Of triangles for which `single_sided` answers true, fronts only.
    pub fn draw(&mut self, face: &Perspective, gates: &Gates, model: &Clusters, single_sided: impl Fn(u32) -> bool) {
        self.items.clear();
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
            let extent = Extent::new(face, (cluster.low, cluster.high), [self.side; 2]);
            if !extent.is_some_and(|extent| self.items.hides(&extent)) {
                let ids = &model.ids[cluster.triangles[0] as usize..cluster.triangles[1] as usize];
                self.items.draw(face, model.group(cluster), |i| ids[i], |i| single_sided(ids[i]));
            }
        }
        self.queue = queue;
    }
}

/// How far a group is from the eye at least, along forward; `None` if the face or the windows do not show it.
fn distance(face: &Perspective, gates: &Gates, cluster: &Cluster) -> Option<f32> {
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
    use heliodon_testkit::scenes::{ball, cuboid, ground};

    #[test]
    fn pixels_hold_what_rays_meet_whatever_was_passed_over() {
        let scene = ground(60.0, 20)
            .moved(Vec3::NEG_Y)
            .and(ball(1.0, 60).moved(Vec3::new(3.0, 0.0, 0.0)))
            .and(ball(1.0, 60).moved(Vec3::new(9.0, 0.0, 0.0)))
            .and(cuboid(Vec3::new(-4.0, -1.0, -3.0), Vec3::new(-3.0, 4.0, 3.0), 9));
        let surface = Surface { positions: &scene.positions, triangles: &scene.triangles, single_sided: &[] };
        let model = Clusters::new(&surface);
        let rays = TriangleScene::build(&scene.positions, &scene.triangles, &BuildParams::default()).unwrap();
        let side = 200;
        let mut picture = Picture::new(side);
        for eye in [Vec3::ZERO, Vec3::new(0.0, 1.0, 2.0), Vec3::new(-2.99, 0.0, 0.0)] {
            let open = Gates::new(eye, &ViewCell { low: Vec3::ZERO, high: Vec3::ZERO, windows: Vec::new() }, 0.0);
            let (mut other, mut met) = (0, 0);
            for face in cube(eye, 1e-3, 77) {
                picture.draw(&face, &open, &model, |_| false);
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
            // edges are rounded to 1/256 of a pixel, so a pixel differs where its middle lies that close to one: of triangles
            // some 4 pixels wide, a hundredth
            assert!(met > 100_000 && other < met / 50, "{other} of {met} pixels differ at {eye}");
        }
    }
}
