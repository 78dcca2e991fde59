//! A hierarchy as plain bytes, for who keeps what took long to build: of 50 million triangles half a minute.
//!
//! It is kept tile by tile, as it is built: who is interrupted loses a second's work, and nothing is written twice.

use crate::hierarchy::Hierarchy;
use crate::layout::{LEAF, Node};
use crate::scene::TriangleScene;
use crate::tiles::append;
use bytemuck::{Pod, cast_slice, cast_slice_mut};
use glam::Vec3;

/// Where what is built of a hierarchy is kept: in the order of this machine's memory, no format for others. Whoever keeps it sees to it that it stays
/// whole, and hands it out for the same triangles and [`crate::BuildParams`] only. Tiles of several such builds may be mixed: each answers as any other does that was
/// built over its triangles.
pub trait KeptTiles: Sync {
    /// A tile that was kept, or nothing.
    fn take(&self, tile: usize) -> Option<Vec<u8>>;

    /// Keeps a tile, or does not: building goes on all the same.
    fn keep(&self, tile: usize, bytes: &[u8]);

    /// What was kept beside the tiles, if all is there.
    fn take_rest(&self) -> Option<Vec<u8>>;

    /// Keeps what there is beside the tiles. With it, all is there.
    fn keep_rest(&self, bytes: &[u8]);
}

/// The numbers of the rest before the nodes that join tiles, and of a tile before its nodes.
const OF_REST: usize = 12;
const OF_TILE: usize = 3;

impl Hierarchy {
    /// A tile as it is kept.
    pub fn to_bytes(&self) -> Vec<u8> {
        let numbers: [u32; OF_TILE] = [self.nodes.len() as u32, self.packets.len() as u32, self.depth as u32];
        [cast_slice(&numbers), cast_slice(&self.nodes), cast_slice(&self.packets)].concat()
    }

    /// The tile that was kept, or nothing where it is none.
    pub fn of_bytes(bytes: &[u8]) -> Option<Self> {
        let (numbers, bytes) = bytes.split_at_checked(OF_TILE * size_of::<u32>())?;
        let [nodes, packets, depth] = collect::<u32>(numbers)?[..] else { return None };
        let (of_nodes, of_packets) = bytes.split_at_checked(nodes as usize * size_of::<Node>())?;
        let tile = Self { nodes: collect(of_nodes)?, packets: collect(of_packets)?, depth: depth as usize };
        (tile.packets.len() == packets as usize && tile.is_sound()).then_some(tile)
    }

    /// Whether all nodes' children are there.
    fn is_sound(&self) -> bool {
        let is_there = |&child: &u32| match child & LEAF {
            0 => (child as usize) < self.nodes.len(),
            _ => ((child & !LEAF) as usize) < self.packets.len(),
        };
        !self.nodes.is_empty() && self.nodes.iter().all(|node| node.child.iter().all(is_there))
    }
}

/// Numbers from their bytes, which lie anywhere; nothing where some are left over.
fn collect<T: Pod>(bytes: &[u8]) -> Option<Vec<T>> {
    let mut values = vec![T::zeroed(); bytes.len() / size_of::<T>()];
    let into = cast_slice_mut(&mut values);
    (into.len() == bytes.len()).then(|| into.copy_from_slice(bytes))?;
    Some(values)
}

impl TriangleScene {
    /// What [`TriangleScene::restored`] needs beside the tiles, of a scene of so many joining nodes and tiles of so many.
    pub(crate) fn rest(&self, joints: usize, tiles: &[u32]) -> Vec<u8> {
        let (low, high) = self.bounds().unwrap_or_default();
        let mut numbers = vec![tiles.len() as u32, joints as u32, self.depth() as u32];
        numbers.extend([self.center, low, high].iter().flat_map(|place| place.to_array().map(f32::to_bits)));
        let joints = cast_slice(&self.nodes[..joints]);
        [cast_slice(&numbers), cast_slice(tiles), joints, cast_slice(&self.left_out)].concat()
    }

    /// The scene whose building [`TriangleScene::build_keeping`] ended: its answers are the same to the bit. None where not all of it is there.
    #[must_use]
    pub fn restored(kept: &dyn KeptTiles) -> Option<Self> {
        let rest = kept.take_rest()?;
        let (numbers, rest) = rest.split_at_checked(OF_REST * size_of::<u32>())?;
        let numbers = collect::<u32>(numbers)?;
        let place = |at: usize| Vec3::from_array([0, 1, 2].map(|axis| f32::from_bits(numbers[at + axis])));
        let (tiles, rest) = rest.split_at_checked(numbers[0] as usize * size_of::<u32>())?;
        let (joints, left_out) = rest.split_at_checked(numbers[1] as usize * size_of::<Node>())?;
        let mut whole = Hierarchy { nodes: collect(joints)?, packets: Vec::new(), depth: numbers[2] as usize };
        for (number, nodes) in collect::<u32>(tiles)?.into_iter().enumerate() {
            // one of another build may have more: joining nodes name other places then
            let tile = Hierarchy::of_bytes(&kept.take(number)?).filter(|tile| tile.nodes.len() as u32 == nodes)?;
            append(&mut whole, tile);
        }
        whole.nodes.shrink_to_fit();
        whole.packets.shrink_to_fit();
        whole.is_sound().then(|| Self::new(whole, collect(left_out).unwrap_or_default(), place(3), (place(6), place(9))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::Quality;
    use crate::layout::Packet;
    use crate::tiles::build_tiles_of;
    use crate::{BuildParams, Hit, Ray};
    use heliodon_math::random::Pcg32;
    use std::collections::BTreeMap;
    use std::sync::Mutex;

    #[derive(Default)]
    struct Shelf {
        tiles: Mutex<BTreeMap<usize, Vec<u8>>>,
        rest: Mutex<Option<Vec<u8>>>,
    }

    impl KeptTiles for Shelf {
        fn take(&self, tile: usize) -> Option<Vec<u8>> {
            self.tiles.lock().unwrap().get(&tile).cloned()
        }

        fn keep(&self, tile: usize, bytes: &[u8]) {
            assert!(self.tiles.lock().unwrap().insert(tile, bytes.to_vec()).is_none(), "{tile} was kept before");
        }

        fn take_rest(&self) -> Option<Vec<u8>> {
            self.rest.lock().unwrap().clone()
        }

        fn keep_rest(&self, bytes: &[u8]) {
            *self.rest.lock().unwrap() = Some(bytes.to_vec());
        }
    }

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

    fn hits(scene: &TriangleScene) -> String {
        let ray = |origin, direction| Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
        let mut random = Pcg32::new(5, 7);
        let mut vector = |size: f32| Vec3::from_array([0; 3].map(|_| random.range_f32(-size, size)));
        let rays: Vec<Ray> = (0..2000).map(|_| ray(vector(12.0), vector(1.0))).collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        scene.closest(&rays, &mut hits);
        format!("{hits:?}")
    }

    #[test]
    fn what_was_kept_answers_the_same() {
        for count in [2, 9, 5000] {
            let (positions, triangles) = soup(count);
            let params = BuildParams::default();
            let shelf = Shelf::default();
            let scene = TriangleScene::build_keeping(&positions, &triangles, &params, &shelf).unwrap();
            assert_eq!(hits(&scene), hits(&TriangleScene::build(&positions, &triangles, &params).unwrap()));
            let again = TriangleScene::restored(&shelf).unwrap();
            assert_eq!(hits(&scene), hits(&again));
            assert_eq!((scene.bounds(), scene.center()), (again.bounds(), again.center()));
            assert_eq!((scene.triangle_count(), scene.wear()), (again.triangle_count(), again.wear()));
            assert_eq!(scene.start_offset(), again.start_offset());
        }
    }

    #[test]
    fn tiles_that_are_there_are_not_built_again() {
        let (positions, triangles) = soup(5000);
        let mut ids: Vec<u32> = (2..5000).collect();
        let corners = |t: u32| triangles[t as usize].map(|i| positions[i as usize]);
        let bounds = (Vec3::splat(-11.0), Vec3::splat(11.0));
        let mut build = |shelf: &Shelf, tile: usize| {
            let built = build_tiles_of(&mut ids, tile, corners, Quality::Balanced, Some(shelf));
            let scene = TriangleScene::new(built.whole, vec![0, 1], Vec3::ZERO, bounds);
            shelf.keep_rest(&scene.rest(built.joints, &built.tiles));
            scene
        };
        for tile in [5000, 700, 90] {
            let shelf = Shelf::default();
            let scene = build(&shelf, tile);
            let tiles = shelf.tiles.lock().unwrap().len();
            assert!((4998_usize.div_ceil(tile)..).contains(&tiles));
            assert_eq!(hits(&TriangleScene::restored(&shelf).unwrap()), hits(&scene));
            // half of them are lost: keeping one twice is an error
            shelf.tiles.lock().unwrap().retain(|tile, _| tile % 2 == 0);
            assert!(tiles == 1 || TriangleScene::restored(&shelf).is_none(), "one is missing");
            assert_eq!(hits(&build(&shelf, tile)), hits(&scene));
            assert_eq!(shelf.tiles.lock().unwrap().len(), tiles);
        }
    }

    #[test]
    fn what_was_not_kept_is_none() {
        let (positions, triangles) = soup(500);
        let shelf = Shelf::default();
        assert!(TriangleScene::restored(&shelf).is_none());
        TriangleScene::build_keeping(&positions, &triangles, &BuildParams::default(), &shelf).unwrap();
        let (tile, rest) = (shelf.take(0).unwrap(), shelf.take_rest().unwrap());
        let restored = |tile: &[u8], rest: &[u8]| {
            let shelf = Shelf::default();
            shelf.keep(0, tile);
            shelf.keep_rest(rest);
            TriangleScene::restored(&shelf)
        };
        assert!(restored(&tile, &rest).is_some());
        assert!(restored(&tile, &rest[..20]).is_none(), "too short");
        assert!(restored(&tile[..tile.len() - 1], &rest).is_none(), "half a number");
        assert!(restored(&tile[..tile.len() - size_of::<Packet>()], &rest).is_none(), "a packet is missing");
        assert!(restored(&[], &rest).is_none(), "nothing");
        let fewer = Shelf::default();
        TriangleScene::build_keeping(&positions, &triangles[..300], &BuildParams::default(), &fewer).unwrap();
        assert!(restored(&fewer.take(0).unwrap(), &rest).is_none(), "a tile of other nodes");
        let mut odd = tile.clone();
        odd[OF_TILE * 4..OF_TILE * 4 + size_of::<Node>()].fill(0xFF);
        assert!(restored(&odd, &rest).is_none(), "children that are not there");
    }
}
