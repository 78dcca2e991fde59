//! Large scenes, built tile by tile: what building needs beside its result is for a tile, not for the whole.
//!
//! obvhs needs some 200 bytes a triangle while it builds, which is three times what it leaves. Triangles are halved at the median of
//! their centroids until a tile is small enough, a hierarchy is built over each tile, and nodes of eight join these. Answers do not depend on
//! the shape of a hierarchy; measured on a temple of ten million triangles, neither does their speed.

use glam::Vec3;
use rayon::prelude::*;

use crate::build::Quality;
use crate::hierarchy::{Hierarchy, build};
use crate::layout::{LEAF, Node};
use crate::stored::KeptTiles;

/// The most triangles of a tile.
const TILE: usize = 1 << 20;

/// Tiles that are built at the same time, each on as many threads as are free.
const AT_ONCE: usize = 2;

/// A triangle, and three times its centroid.
struct Placed {
    centre: Vec3,
    id: u32,
}

/// What joins the tiles, before they are built.
enum Joint {
    /// So many of the ids that follow.
    Tile(usize),
    /// Up to eight.
    Node(Vec<Joint>),
}

/// A hierarchy of tiles.
pub(crate) struct Tiled {
    pub whole: Hierarchy,
    /// The nodes that join tiles come first; so many.
    pub joints: usize,
    /// The tiles come behind them, in order, each with so many nodes.
    pub tiles: Vec<u32>,
}

/// A hierarchy over the triangles `ids`, which must not be empty; `corners` gives their corners. Tiles are kept, and those that were are taken:
/// which triangles each has does not depend on anything else.
pub(crate) fn build_tiles(
    mut ids: Vec<u32>,
    corners: impl Fn(u32) -> [Vec3; 3] + Sync,
    quality: Quality,
    kept: Option<&dyn KeptTiles>,
) -> Tiled {
    build_tiles_of(&mut ids, TILE, corners, quality, kept)
}

pub(crate) fn build_tiles_of(
    ids: &mut [u32],
    tile: usize,
    corners: impl Fn(u32) -> [Vec3; 3] + Sync,
    quality: Quality,
    kept: Option<&dyn KeptTiles>,
) -> Tiled {
    let build_tile = |number: usize, ids: &[u32]| {
        let taken = kept.and_then(|kept| kept.take(number)).and_then(|bytes| Hierarchy::of_bytes(&bytes));
        taken.unwrap_or_else(|| {
            let corners: Vec<[Vec3; 3]> = ids.par_iter().map(|&t| corners(t)).collect();
            let built = build(&corners, ids, quality);
            kept.inspect(|kept| kept.keep(number, &built.to_bytes()));
            built
        })
    };
    if ids.len() <= tile {
        let whole = build_tile(0, ids);
        return Tiled { tiles: vec![whole.nodes.len() as u32], whole, joints: 0 };
    }
    // comparisons that look up three corners, wherever they lie, wait for memory
    let mut placed: Vec<Placed> = ids.par_iter().map(|&id| Placed { centre: corners(id).into_iter().sum(), id }).collect();
    let joint = join(&mut placed, tile);
    ids.par_iter_mut().zip(&placed).for_each(|(id, placed)| *id = placed.id);
    drop(placed);
    let mut tiles = Vec::new();
    let mut whole = Hierarchy { nodes: Vec::new(), packets: Vec::new(), depth: 0 };
    let (depth, roots) = lay_out(&joint, &mut whole.nodes, &mut tiles);
    let joints = whole.nodes.len();
    let mut rest = &*ids;
    let ranges: Vec<(usize, usize, &[u32])> = (0..)
        .zip(tiles)
        .map(|(number, (length, parent))| {
            let (tile, after) = rest.split_at(length);
            rest = after;
            (number, parent, tile)
        })
        .collect();
    let (mut deepest, mut lengths) = (0, Vec::with_capacity(roots.len()));
    for (together, slots) in ranges.chunks(AT_ONCE).zip(roots.chunks(AT_ONCE)) {
        let built: Vec<Hierarchy> = together.par_iter().map(|&(number, _, ids)| build_tile(number, ids)).collect();
        for ((part, &(_, parent, _)), &slot) in built.into_iter().zip(together).zip(slots) {
            deepest = deepest.max(part.depth);
            lengths.push(part.nodes.len() as u32);
            let root = append(&mut whole, part);
            let bounds = whole.nodes[root as usize].all_bounds();
            whole.nodes[parent].set(slot, bounds, root);
        }
    }
    bound_joints(&mut whole.nodes);
    whole.nodes.shrink_to_fit();
    whole.packets.shrink_to_fit();
    Tiled { whole: Hierarchy { depth: depth + deepest, ..whole }, joints, tiles: lengths }
}

/// Halves the triangles until each part fits a tile; three halvings make a node.
fn join(triangles: &mut [Placed], tile: usize) -> Joint {
    if triangles.len() <= tile {
        return Joint::Tile(triangles.len());
    }
    let mut parts: Vec<&mut [Placed]> = vec![triangles];
    for _ in 0..3 {
        let halve = |part: &'_ mut [Placed]| -> Vec<usize> {
            if part.len() <= tile {
                return vec![part.len()];
            }
            let middle = halve(part);
            vec![middle, part.len() - middle]
        };
        let lengths: Vec<Vec<usize>> = parts.par_iter_mut().map(|part| halve(part)).collect();
        parts = parts
            .into_iter()
            .zip(lengths)
            .flat_map(|(part, lengths)| match lengths[..] {
                [low, _] => {
                    let (low, high) = part.split_at_mut(low);
                    vec![low, high]
                }
                _ => vec![part],
            })
            .collect();
    }
    Joint::Node(parts.into_par_iter().map(|part| join(part, tile)).collect())
}

/// Brings the lower half along the longest axis of the centroids to the front; returns how many they are.
fn halve(triangles: &mut [Placed]) -> usize {
    let (low, high) = bounds(triangles.par_iter().map(|placed| (placed.centre, placed.centre)));
    let axis = (high - low).max_position();
    let middle = triangles.len() / 2;
    triangles.select_nth_unstable_by(middle, |a, b| a.centre[axis].total_cmp(&b.centre[axis]).then(a.id.cmp(&b.id)));
    middle
}

/// Around all of these bounds.
pub(crate) fn bounds(all: impl ParallelIterator<Item = (Vec3, Vec3)>) -> (Vec3, Vec3) {
    all.reduce(|| (Vec3::INFINITY, Vec3::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// Makes the nodes that join the tiles, parents before children, and lists the tiles in order: how many triangles, and whose child. Returns the
/// depth of these nodes, and the slot of each tile.
fn lay_out(joint: &Joint, nodes: &mut Vec<Node>, tiles: &mut Vec<(usize, usize)>) -> (usize, Vec<usize>) {
    let Joint::Node(children) = joint else { return (0, Vec::new()) };
    let own = nodes.len();
    nodes.push(Node::EMPTY);
    let (mut depth, mut slots) = (0, Vec::new());
    for (slot, child) in children.iter().enumerate() {
        match child {
            Joint::Tile(length) => {
                tiles.push((*length, own));
                slots.push(slot);
            }
            Joint::Node(_) => {
                nodes[own].child[slot] = nodes.len() as u32;
                let (below, more) = lay_out(child, nodes, tiles);
                depth = depth.max(below);
                slots.extend(more);
            }
        }
    }
    (depth + 1, slots)
}

/// Puts a tile's nodes and packets behind the others; returns the number of its root.
pub(crate) fn append(whole: &mut Hierarchy, part: Hierarchy) -> u32 {
    let (root, first_packet) = (whole.nodes.len() as u32, whole.packets.len() as u32);
    whole.nodes.extend(part.nodes.into_iter().map(|mut node| {
        for reference in &mut node.child {
            *reference = match *reference {
                Node::NO_CHILD => Node::NO_CHILD,
                leaf if leaf & LEAF != 0 => leaf + first_packet,
                child => child + root,
            };
        }
        node
    }));
    whole.packets.extend(part.packets);
    root
}

/// Gives the joining nodes the bounds of joining nodes below them.
fn bound_joints(nodes: &mut [Node]) {
    for i in (0..nodes.len()).rev() {
        for slot in 0..8 {
            let reference = nodes[i].child[slot];
            let bounded = nodes[i].bounds[0][0][slot] <= nodes[i].bounds[1][0][slot];
            if reference != Node::NO_CHILD && reference & LEAF == 0 && !bounded {
                let bounds = nodes[reference as usize].all_bounds();
                nodes[i].set(slot, bounds, reference);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BuildParams, Hit, Ray, TriangleScene};
    use heliodon_math::random::{hash3_u32, unit_f32};

    /// Small triangles here and there in a box.
    fn soup(count: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let number = |i: u32, k: u32| unit_f32(hash3_u32(7, i, k));
        let place = |i: u32, k: u32| Vec3::new(number(i, k), number(i, k + 1), number(i, k + 2));
        let positions = (0..count).flat_map(|i| {
            let at = place(i, 0) * Vec3::new(30.0, 5.0, 9.0);
            [at, at + place(i, 3) * 0.5, at + place(i, 6) * 0.5]
        });
        (positions.collect(), (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
    }

    #[test]
    fn tiles_answer_as_one() {
        let (positions, triangles) = soup(5000);
        let mut whole = TriangleScene::build(&positions, &triangles, &BuildParams::default()).unwrap();
        let rays: Vec<Ray> = (0..4000_u32)
            .map(|i| {
                let number = |k: u32| unit_f32(hash3_u32(9, i, k));
                let origin = Vec3::new(number(0) * 30.0, number(1) * 5.0, number(2) * 9.0);
                let direction = Vec3::new(number(3) - 0.5, number(4) - 0.5, number(5) - 0.5);
                Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
            })
            .collect();
        let ask = |scene: &TriangleScene| {
            let mut hits = vec![Hit::MISS; rays.len()];
            scene.closest(&rays, &mut hits);
            hits
        };
        let expected = ask(&whole);
        assert!(expected.iter().filter(|hit| hit.triangle != crate::NO_HIT).count() > 1000);
        let centre = whole.center;
        // 5000 triangles: 8, 64 and more tiles, so that nodes join nodes
        for tile in [700, 90, 40] {
            let mut ids: Vec<u32> = (0..5000).collect();
            let corners = |t: u32| triangles[t as usize].map(|i| positions[i as usize] - centre);
            let built = build_tiles_of(&mut ids, tile, corners, Quality::Balanced, None).whole;
            assert!(built.packets.iter().flat_map(|p| p.triangles()).count() == 5000);
            (whole.nodes, whole.packets, whole.stack) = (built.nodes, built.packets, 7 * built.depth + 8);
            assert_eq!(ask(&whole), expected, "tiles of {tile}");
            whole.refit(&positions, &triangles, &BuildParams::default()).unwrap();
            assert_eq!(ask(&whole), expected, "tiles of {tile}, refitted");
        }
    }
}
