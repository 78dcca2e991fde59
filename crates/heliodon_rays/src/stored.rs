//! A hierarchy as plain bytes, for who keeps what took long to build: of 50 million triangles half a minute.

use crate::hierarchy::Hierarchy;
use crate::layout::{LEAF, Node, Packet};
use crate::scene::TriangleScene;
use bytemuck::{Zeroable, cast_slice, cast_slice_mut};
use glam::Vec3;
use rayon::prelude::*;

/// A scene as bytes, in the order of this machine's memory: no format for others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredScene<'a> {
    /// The hierarchy's nodes.
    pub nodes: &'a [u8],
    /// Its triangles.
    pub packets: &'a [u8],
    /// How many there are, and where.
    pub rest: Vec<u8>,
}

/// The numbers of the rest before those of what was left out.
const FIRST: usize = 13;

impl TriangleScene {
    /// What [`TriangleScene::restored`] needs.
    #[must_use]
    pub fn stored(&self) -> StoredScene<'_> {
        let (low, high) = self.bounds().unwrap_or((Vec3::INFINITY, Vec3::NEG_INFINITY));
        let mut numbers = vec![self.nodes.len() as u32, self.packets.len() as u32, self.depth() as u32];
        numbers.push(u32::from(self.bounds().is_some()));
        numbers.extend([self.center, low, high].iter().flat_map(|place| place.to_array().map(f32::to_bits)));
        numbers.extend(&self.left_out);
        StoredScene {
            nodes: cast_slice(&self.nodes),
            packets: cast_slice(&self.packets),
            rest: numbers.into_iter().flat_map(u32::to_le_bytes).collect(),
        }
    }

    /// The scene that was stored: its answers are the same to the bit. `rest` is what [`TriangleScene::stored`] gave; into bytes of the right number
    /// `nodes` and `packets` put theirs, or tell that they cannot. None where that is not what was stored, as far as that can be told: whoever keeps it
    /// sees to it that it stays whole.
    #[must_use]
    pub fn restored(
        rest: &[u8],
        nodes: impl FnOnce(&mut [u8]) -> bool,
        packets: impl FnOnce(&mut [u8]) -> bool,
    ) -> Option<Self> {
        let (numbers, odd) = rest.as_chunks::<4>();
        let numbers: Vec<u32> = numbers.iter().map(|number| u32::from_le_bytes(*number)).collect();
        let (first, left_out) = numbers.split_at_checked(FIRST).filter(|_| odd.is_empty())?;
        let place = |at: usize| Vec3::from_array([0, 1, 2].map(|axis| f32::from_bits(first[at + axis])));
        let (node_count, packet_count) = (first[0] as usize, first[1] as usize);
        if first[3] == 0 {
            return Some(Self::empty(left_out.to_vec()));
        }
        let mut all_nodes = vec![Node::zeroed(); node_count];
        let mut all_packets = vec![Packet::zeroed(); packet_count];
        if !nodes(cast_slice_mut(&mut all_nodes)) || !packets(cast_slice_mut(&mut all_packets)) {
            return None;
        }
        let is_there = |&child: &u32| match child & LEAF {
            0 => (child as usize) < node_count,
            _ => ((child & !LEAF) as usize) < packet_count,
        };
        if all_nodes.is_empty() || !all_nodes.par_iter().all(|node| node.child.iter().all(is_there)) {
            return None;
        }
        let hierarchy = Hierarchy { nodes: all_nodes, packets: all_packets, depth: first[2] as usize };
        Some(Self::new(hierarchy, left_out.to_vec(), place(4), (place(7), place(10))))
    }
}

#[cfg(test)]
mod tests {
    use crate::{BuildParams, Hit, Ray, TriangleScene};
    use glam::Vec3;
    use heliodon_math::random::Pcg32;

    fn soup(count: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let mut random = Pcg32::new(3, 7);
        let mut vector = |size: f32| Vec3::from_array([0; 3].map(|_| random.range_f32(-size, size)));
        let mut positions = Vec::new();
        for _ in 0..count {
            let middle = vector(10.0);
            positions.extend([middle + vector(0.5), middle + vector(0.5), middle + vector(0.5)]);
        }
        positions[4] = Vec3::NAN;
        (positions, (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect())
    }

    fn restored(scene: &TriangleScene) -> Option<TriangleScene> {
        let stored = scene.stored();
        let fill = |from: &[u8], into: &mut [u8]| {
            into.copy_from_slice(from);
            true
        };
        TriangleScene::restored(&stored.rest, |into| fill(stored.nodes, into), |into| fill(stored.packets, into))
    }

    #[test]
    fn what_was_stored_answers_the_same() {
        for count in [2, 9, 5000] {
            let (positions, triangles) = soup(count);
            let scene = TriangleScene::build(&positions, &triangles, &BuildParams::default()).unwrap();
            let again = restored(&scene).unwrap();
            let ray = |origin, direction| Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
            let mut random = Pcg32::new(5, 7);
            let mut vector = |size: f32| Vec3::from_array([0; 3].map(|_| random.range_f32(-size, size)));
            let rays: Vec<Ray> = (0..2000).map(|_| ray(vector(12.0), vector(1.0))).collect();
            let hits = |scene: &TriangleScene| {
                let mut hits = vec![Hit::MISS; rays.len()];
                scene.closest(&rays, &mut hits);
                format!("{hits:?}")
            };
            assert_eq!(hits(&scene), hits(&again));
            assert_eq!((scene.bounds(), scene.center()), (again.bounds(), again.center()));
            assert_eq!((scene.triangle_count(), scene.wear()), (again.triangle_count(), again.wear()));
            assert_eq!(scene.start_offset(), again.start_offset());
        }
        let nothing = TriangleScene::build(&[], &[], &BuildParams::default()).unwrap();
        assert_eq!(restored(&nothing).unwrap().bounds(), None);
    }

    #[test]
    fn what_was_not_stored_is_none() {
        let (positions, triangles) = soup(500);
        let scene = TriangleScene::build(&positions, &triangles, &BuildParams::default()).unwrap();
        let stored = scene.stored();
        let zeros = |_: &mut [u8]| true;
        assert!(TriangleScene::restored(&stored.rest[..20], zeros, zeros).is_none(), "too short");
        assert!(TriangleScene::restored(&stored.rest[..stored.rest.len() - 1], zeros, zeros).is_none(), "half a number");
        assert!(TriangleScene::restored(&stored.rest, |_| false, zeros).is_none(), "no nodes");
        let ones = |into: &mut [u8]| {
            into.fill(0xFF);
            true
        };
        assert!(TriangleScene::restored(&stored.rest, ones, zeros).is_none(), "children that are not there");
    }
}
