//! Triangles joined to charts, the best pair of neighbours first (after Garland, Willmott and Heckbert: "Hierarchical Face Clustering on Polygonal
//! Surfaces", 2001).
//!
//! What joining costs grows with the size of what comes of it, so clusters grow evenly and all of it takes n log n. Joined is what stays within a cone of
//! normals, so that its projection onto a plane turns no triangle over, and within the size of the sheet.

use super::Face;
use super::neighbors::NOBODY;
use glam::Vec3;
use heliodon_math::frame::unit_or;
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

/// How much the square of a cluster's border counts beside its area times how far its normals spread: four of a hundred for a square, as much as a spread
/// of 23 degrees. More gives rounder charts, less gives flatter ones.
const BORDER_WEIGHT: f32 = 0.0025;

/// How far clusters may grow.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// The least cosine between a triangle's normal and its chart's.
    pub least_cosine: f32,
    /// The same where one of the two is small.
    pub least_cosine_small: f32,
    /// Small are clusters with no more area than this.
    pub small: f32,
    /// The longest that a cluster may be along an axis, but for triangles that are longer.
    pub longest: f32,
}

/// The triangles as they are joined.
pub(super) struct Surface<'a> {
    pub faces: &'a [Face],
    pub neighbors: &'a [[u32; 3]],
}

struct Cluster {
    /// The sum of its normals times their areas.
    normal: Vec3,
    area: f32,
    border: f32,
    low: Vec3,
    high: Vec3,
    /// No normal is farther from the sum's direction than this, in radians; not always as near as it could be.
    angle: f32,
    /// Its triangles are a list.
    first: u32,
    last: u32,
    count: u32,
    /// Counts changes, so that what was reckoned before is known for old.
    version: u32,
    /// Neighbours, and the border with each.
    beside: Vec<(u32, f32)>,
}

/// A pair that may be joined, the cheapest first.
#[derive(PartialEq)]
struct Pair {
    cost: f32,
    clusters: [u32; 2],
    versions: [u32; 2],
}

impl Eq for Pair {}

impl Ord for Pair {
    fn cmp(&self, other: &Self) -> Ordering {
        self.cost.total_cmp(&other.cost).then(self.clusters.cmp(&other.clusters)).then(self.versions.cmp(&other.versions))
    }
}

impl PartialOrd for Pair {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

struct Joining<'a> {
    surface: &'a Surface<'a>,
    limits: Limits,
    clusters: Vec<Cluster>,
    /// The next triangle of each one's cluster.
    next: Vec<u32>,
    queue: BinaryHeap<Reverse<Pair>>,
    /// The least cosine between the mean normals of two that may be joined, and of small ones: the limits' twice as far, and a little for rounding.
    least_cosines_apart: [f32; 2],
    /// Whether now only small clusters are joined, within the wider cone.
    small_ones: bool,
}

/// The triangles of each chart.
pub(super) fn clusters(surface: &Surface, limits: Limits) -> Vec<Vec<u32>> {
    let single = |t: usize| {
        let face = &surface.faces[t];
        let beside = |i: usize| (surface.neighbors[t][i], face.lengths[i]);
        let mut neighbors: Vec<(u32, f32)> = (0..3).map(beside).filter(|(other, _)| *other != NOBODY).collect();
        neighbors.sort_by_key(|(other, _)| *other);
        neighbors.dedup_by(|a, b| {
            let same = a.0 == b.0;
            if same {
                b.1 += a.1;
            }
            same
        });
        Cluster {
            normal: face.normal * face.area,
            area: face.area,
            border: face.lengths.iter().sum(),
            low: face.bounds[0],
            high: face.bounds[1],
            angle: 0.0,
            first: t as u32,
            last: t as u32,
            count: 1,
            version: 0,
            beside: neighbors,
        }
    };
    let count = surface.faces.len();
    let mut joining = Joining {
        surface,
        limits,
        clusters: (0..count).map(single).collect(),
        next: vec![NOBODY; count],
        queue: BinaryHeap::new(),
        least_cosines_apart: [limits.least_cosine, limits.least_cosine_small]
            .map(|cosine| 2.0 * cosine * cosine - 1.0 - 1.0e-3),
        small_ones: false,
    };
    joining.run();
    joining.small_ones = true;
    joining.run();
    let joined = joining.clusters.iter().filter(|cluster| cluster.count > 0);
    joined.map(|cluster| joining.triangles(cluster).collect()).collect()
}

impl Joining<'_> {
    fn triangles(&self, cluster: &Cluster) -> impl Iterator<Item = u32> {
        let after = |&t: &u32| Some(self.next[t as usize]).filter(|&next| next != NOBODY);
        std::iter::successors(Some(cluster.first), after)
    }

    fn run(&mut self) {
        for index in 0..self.clusters.len() as u32 {
            for place in 0..self.clusters[index as usize].beside.len() {
                let other = self.clusters[index as usize].beside[place].0;
                if index < other {
                    self.propose(index, other);
                }
            }
        }
        while let Some(Reverse(pair)) = self.queue.pop() {
            let [a, b] = pair.clusters;
            if pair.versions == [a, b].map(|c| self.clusters[c as usize].version)
                && let Some(angle) = self.joined_angle(a, b)
            {
                self.join(a, b, angle);
            }
        }
    }

    fn propose(&mut self, a: u32, b: u32) {
        let (a, b) = (a.min(b), a.max(b));
        let [one, other] = [a, b].map(|c| &self.clusters[c as usize]);
        if one.area == 0.0 || other.area == 0.0 || !self.fits(one, other) {
            return;
        }
        // whose normals are further apart than the cone is wide have no common axis within it
        let cosine = if self.small_ones { self.least_cosines_apart[1] } else { self.least_cosines_apart[0] };
        if one.normal.dot(other.normal) < cosine * one.normal.length() * other.normal.length() {
            return;
        }
        let shared = one.beside.binary_search_by_key(&b, |(c, _)| *c).map_or(0.0, |place| one.beside[place].1);
        let area = one.area + other.area;
        let spread = (area - (one.normal + other.normal).length()).max(0.0);
        let border = one.border + other.border - 2.0 * shared;
        // small ones go where their border is, whatever it costs there
        let cost = if self.small_ones { -shared } else { spread + BORDER_WEIGHT * border * border };
        let versions = [one.version, other.version];
        self.queue.push(Reverse(Pair { cost, clusters: [a, b], versions }));
    }

    fn least_cosine(&self) -> f32 {
        if self.small_ones { self.limits.least_cosine_small } else { self.limits.least_cosine }
    }

    fn fits(&self, one: &Cluster, other: &Cluster) -> bool {
        let side = |low: Vec3, high: Vec3| (high - low).max_element();
        let both = side(one.low.min(other.low), one.high.max(other.high));
        let already = side(one.low, one.high).max(side(other.low, other.high));
        let is_small = one.area.min(other.area) <= self.limits.small;
        (both <= self.limits.longest || both <= already) && (!self.small_ones || is_small)
    }

    /// How far both clusters' normals would be from their common one, or none where that is too far.
    fn joined_angle(&self, a: u32, b: u32) -> Option<f32> {
        let most = libm::acosf(self.least_cosine());
        let pair = [a, b].map(|c| &self.clusters[c as usize]);
        // what faces both ways alike has no axis
        let axis = (pair[0].normal + pair[1].normal).try_normalize()?;
        let mut angle = 0.0_f32;
        // the smaller one first: it costs less to ask
        let order = if pair[0].count <= pair[1].count { pair } else { [pair[1], pair[0]] };
        for cluster in order {
            let turned = angle_between(axis, unit_or(cluster.normal, Vec3::ZERO));
            let mut of_cluster = turned + cluster.angle;
            if of_cluster > most {
                let worst = |t: u32| self.surface.faces[t as usize].normal.dot(axis);
                let cosine = self.triangles(cluster).map(worst).fold(1.0_f32, f32::min);
                of_cluster = libm::acosf(cosine.clamp(-1.0, 1.0));
            }
            if of_cluster > most {
                return None;
            }
            angle = angle.max(of_cluster);
        }
        Some(angle)
    }

    fn join(&mut self, a: u32, b: u32, angle: f32) {
        let taken = std::mem::replace(&mut self.clusters[b as usize], Cluster::none());
        let kept = std::mem::replace(&mut self.clusters[a as usize], Cluster::none());
        let shared = kept.beside.binary_search_by_key(&b, |(c, _)| *c).map_or(0.0, |place| kept.beside[place].1);
        let beside = merged(&kept.beside, &taken.beside, a, b);
        for &(other, _) in &taken.beside {
            if other != a {
                rename(&mut self.clusters[other as usize].beside, b, a);
            }
        }
        self.next[kept.last as usize] = taken.first;
        self.clusters[b as usize].version = taken.version + 1;
        self.clusters[a as usize] = Cluster {
            normal: kept.normal + taken.normal,
            area: kept.area + taken.area,
            border: kept.border + taken.border - 2.0 * shared,
            low: kept.low.min(taken.low),
            high: kept.high.max(taken.high),
            angle,
            first: kept.first,
            last: taken.last,
            count: kept.count + taken.count,
            version: kept.version + 1,
            beside,
        };
        for place in 0..self.clusters[a as usize].beside.len() {
            let other = self.clusters[a as usize].beside[place].0;
            self.propose(a, other);
        }
    }
}

impl Cluster {
    fn none() -> Self {
        let (normal, low, high) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
        Self {
            normal,
            area: 0.0,
            border: 0.0,
            low,
            high,
            angle: 0.0,
            first: 0,
            last: 0,
            count: 0,
            version: 0,
            beside: Vec::new(),
        }
    }
}

/// The neighbours of two clusters together, without themselves.
fn merged(one: &[(u32, f32)], other: &[(u32, f32)], a: u32, b: u32) -> Vec<(u32, f32)> {
    let mut all: Vec<(u32, f32)> = Vec::with_capacity(one.len() + other.len());
    let (mut i, mut j) = (0, 0);
    while i < one.len() || j < other.len() {
        let from_one = j == other.len() || i < one.len() && one[i].0 <= other[j].0;
        let next = if from_one { one[i] } else { other[j] };
        (i, j) = if from_one { (i + 1, j) } else { (i, j + 1) };
        match all.last_mut() {
            Some(last) if last.0 == next.0 => last.1 += next.1,
            _ if next.0 == a || next.0 == b => {}
            _ => all.push(next),
        }
    }
    all
}

/// `from` is now called `to`, which is less.
fn rename(beside: &mut Vec<(u32, f32)>, from: u32, to: u32) {
    let Ok(place) = beside.binary_search_by_key(&from, |(c, _)| *c) else { return };
    let (_, length) = beside.remove(place);
    match beside.binary_search_by_key(&to, |(c, _)| *c) {
        Ok(place) => beside[place].1 += length,
        Err(place) => beside.insert(place, (to, length)),
    }
}

fn angle_between(a: Vec3, b: Vec3) -> f32 {
    libm::atan2f(a.cross(b).length(), a.dot(b))
}
