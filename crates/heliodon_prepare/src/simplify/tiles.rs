//! Cutting triangles into tiles that are simplified on their own.

use super::fineness::Fineness;
use super::tile::Face;
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;

/// Triangles of a tile at most, for [`Tiles::cut`]: what one call of meshoptimizer works on stays within a few tens of
/// megabytes, and a tile's rim is still short beside its inside.
pub(super) const MOST: usize = 131_072;
/// Tiles are cut further until all their places are about as far from the eyes, since one tolerance serves the whole tile: its
/// farthest place is this many times farther than its nearest at most ...
const SPREAD: f32 = 1.2;
/// ... but tiles of no more than this part of the most are not cut any more.
const FEWEST: usize = 16;

/// An order of the triangles and the tiles as ranges of it.
pub(super) struct Tiles {
    pub order: Vec<u32>,
    pub ranges: Vec<Range<usize>>,
}

impl Tiles {
    /// Cuts at this share of the faces along the longest axis, until tiles have at most `most`. Other shares give other cuts.
    pub fn cut(positions: &[Vec3], faces: &[Face], fineness: &Fineness, share: f32, most: usize) -> Self {
        let center = |face: &Face| face.corners.iter().map(|&v| positions[v as usize]).sum::<Vec3>() * (1.0 / 3.0);
        let centers: Vec<Vec3> = faces.par_iter().map(center).collect();
        let mut order: Vec<u32> = (0..faces.len() as u32).collect();
        let mut lengths = Vec::new();
        if !order.is_empty() {
            Cut { centers: &centers, fineness, share, most }.cut(&mut order, &mut lengths);
        }
        let mut start = 0;
        let range = |length: usize| {
            start += length;
            start - length..start
        };
        Self { ranges: lengths.into_iter().map(range).collect(), order }
    }
}

struct Cut<'a> {
    centers: &'a [Vec3],
    fineness: &'a Fineness<'a>,
    share: f32,
    most: usize,
}

impl Cut<'_> {
    fn cut(&self, triangles: &mut [u32], lengths: &mut Vec<usize>) {
        let (low, high) = triangles.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &t| {
            (low.min(self.centers[t as usize]), high.max(self.centers[t as usize]))
        });
        if triangles.len() <= self.most / FEWEST || triangles.len() <= self.most && self.fineness.spread(low, high) <= SPREAD {
            // What selection left in no order of its own becomes the mesh's, neighbours beside neighbours.
            triangles.sort_unstable();
            lengths.push(triangles.len());
            return;
        }
        let axis = (high - low).max_position();
        let key = |t: &u32| self.centers[*t as usize][axis];
        let middle = (triangles.len() as f64 * f64::from(self.share)) as usize;
        triangles.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
        let (left, right) = triangles.split_at_mut(middle);
        let mut more = Vec::new();
        rayon::join(|| self.cut(left, lengths), || self.cut(right, &mut more));
        lengths.append(&mut more);
    }
}
