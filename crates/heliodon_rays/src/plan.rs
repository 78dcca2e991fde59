//! Which nodes of a binary hierarchy become nodes of eight children, and which packets.
//!
//! The cheapest way by the surface area heuristic, found from the leaves up (H. Ylitie, T. Karras, S. Laine: "Efficient Incoherent Ray Traversal on
//! GPUs Through Compressed Wide BVHs", High-Performance Graphics 2017, section 3.1): for every subtree, what it costs as one child, as at most two and so on up to eight.
//! One way is added to theirs: a subtree of at most 64 triangles, in the tree's order, cut into packets that are filled evenly. On scans that is the best nearly everywhere; where
//! triangles are large and apart, as in models, packets along the tree's own cuts are met by fewer rays.

use glam::Vec3;
use obvhs::bvh2::Bvh2;

/// Triangles of a subtree at most that may be cut into eight packets as they come.
const PACKED: usize = 64;

/// What a packet costs beside its area, as a part of a mean one's: half-empty ones cost memory, and what they save is little. 0: 82 bytes a triangle on a scan of 600,000, 2: 55, for
/// rays that are as fast; on a model of 40,000 (light maps) the same within noise from 0.25 to 2.
const FILLING: f32 = 2.0;

/// What becomes of a subtree that is one child.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shape {
    /// At most eight triangles.
    Packet,
    /// Eight packets at most, filled evenly.
    Packets,
    /// Eight subtrees at most.
    Node,
}

/// What a subtree costs: as one child, and as at most 2, 3, ... 8.
#[derive(Clone, Copy, Debug)]
struct Costs {
    shape: Shape,
    of: [f32; 8],
}

pub(crate) struct Plan<'a> {
    tree: &'a Bvh2,
    /// All triangles in the tree's order, and which of them are under each node.
    triangles: Vec<u32>,
    under: Vec<[u32; 2]>,
    costs: Vec<Costs>,
}

/// Triangles of a subtree cut into packets.
pub(crate) fn even_parts<T>(triangles: &[T]) -> impl Iterator<Item = &[T]> {
    let (count, packets) = (triangles.len(), triangles.len().div_ceil(8));
    (0..packets).map(move |slot| &triangles[slot * count / packets..(slot + 1) * count / packets])
}

fn half_area(of: &[[Vec3; 2]]) -> f32 {
    let nothing = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    let [low, high] = of.iter().fold(nothing, |[low, high], of| [low.min(of[0]), high.max(of[1])]);
    let sides = high - low;
    sides.x * sides.y + sides.y * sides.z + sides.z * sides.x
}

impl<'a> Plan<'a> {
    pub fn new(tree: &'a Bvh2, corners: &[[Vec3; 3]]) -> Self {
        let mut order = Vec::with_capacity(tree.nodes.len());
        let mut under = vec![[0; 2]; tree.nodes.len()];
        let mut triangles: Vec<u32> = Vec::with_capacity(corners.len());
        let mut stack = vec![0u32];
        while let Some(i) = stack.pop() {
            order.push(i);
            let node = &tree.nodes[i as usize];
            let (before, first) = (triangles.len() as u32, node.first_index);
            if node.is_leaf() {
                triangles.extend_from_slice(&tree.primitive_indices[first as usize..(first + node.prim_count) as usize]);
            } else {
                stack.extend([first + 1, first]);
            }
            under[i as usize] = [before, triangles.len() as u32];
        }
        for &i in order.iter().rev().filter(|i| !tree.nodes[**i as usize].is_leaf()) {
            under[i as usize][1] = under[tree.nodes[i as usize].first_index as usize + 1][1];
        }
        let boxes: Vec<[Vec3; 2]> =
            triangles.iter().map(|&t| corners[t as usize]).map(|[a, b, c]| [a.min(b).min(c), a.max(b).max(c)]).collect();
        let costs = vec![Costs { shape: Shape::Packet, of: [0.0; 8] }; tree.nodes.len()];
        let mut plan = Self { tree, triangles, under, costs };
        let filling = FILLING * plan.mean_packet();
        for &i in order.iter().rev() {
            plan.costs[i as usize] = plan.cheapest(i, &boxes, filling);
        }
        plan
    }

    /// What becomes of a subtree as a child.
    pub fn shape(&self, node: u32) -> Shape {
        self.costs[node as usize].shape
    }

    /// The triangles under a node, in the tree's order.
    pub fn triangles(&self, node: u32) -> &[u32] {
        let [first, end] = self.under[node as usize];
        &self.triangles[first as usize..end as usize]
    }

    /// The children of a node of eight that has a subtree.
    pub fn open(&self, node: u32, children: &mut Vec<u32>) {
        self.part(node, 8, children);
    }

    /// The mean area of what fits into one packet, and its parent does not.
    fn mean_packet(&self) -> f32 {
        let fits = |i: u32| self.triangles(i).len() <= 8;
        let (mut sum, mut count) = (0.0, 0);
        for (i, node) in self.tree.nodes.iter().enumerate() {
            if !node.is_leaf() && !fits(i as u32) {
                for child in [node.first_index, node.first_index + 1].into_iter().filter(|child| fits(*child)) {
                    sum += f64::from(self.tree.nodes[child as usize].aabb().half_area());
                    count += 1;
                }
            }
        }
        (sum / f64::from(count.max(1))) as f32
    }

    /// Both children's costs.
    fn halves(&self, node: u32) -> [[f32; 8]; 2] {
        let first = self.tree.nodes[node as usize].first_index as usize;
        [self.costs[first].of, self.costs[first + 1].of]
    }

    fn cheapest(&self, i: u32, boxes: &[[Vec3; 2]], filling: f32) -> Costs {
        let node = &self.tree.nodes[i as usize];
        let own = node.aabb().half_area();
        let [first, end] = self.under[i as usize].map(|of| of as usize);
        if end - first <= 8 {
            return Costs { shape: Shape::Packet, of: [own + filling; 8] };
        }
        let mut of = [f32::INFINITY; 8];
        let [left, right] = self.halves(i);
        for children in 2..=8 {
            of[children - 1] = (1..children).fold(f32::INFINITY, |least, l| least.min(left[l - 1] + right[children - l - 1]));
        }
        let packed = end - first <= PACKED;
        let as_packets =
            packed.then(|| own + even_parts(&boxes[first..end]).map(|part| half_area(part) + filling).sum::<f32>());
        let as_node = own + of[7];
        let (shape, least) = match as_packets.filter(|cost| *cost <= as_node) {
            Some(cost) => (Shape::Packets, cost),
            None => (Shape::Node, as_node),
        };
        of[0] = least;
        for children in 1..8 {
            of[children] = of[children].min(of[children - 1]);
        }
        Costs { shape, of }
    }

    /// A subtree as at most so many children.
    fn within(&self, node: u32, mut most: usize, children: &mut Vec<u32>) {
        let of = &self.costs[node as usize].of;
        while most > 1 && of[most - 2] <= of[most - 1] {
            most -= 1;
        }
        if most == 1 {
            children.push(node);
        } else {
            self.part(node, most, children);
        }
    }

    /// Both parts of a subtree, as so many children together.
    fn part(&self, node: u32, most: usize, children: &mut Vec<u32>) {
        let [left, right] = self.halves(node);
        let cost = |l: usize| left[l - 1] + right[most - l - 1];
        let of_left = (2..most).fold(1, |best, l| if cost(l) < cost(best) { l } else { best });
        let first = self.tree.nodes[node as usize].first_index;
        self.within(first, of_left, children);
        self.within(first + 1, most - of_left, children);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::Quality;
    use crate::hierarchy::build;
    use crate::layout::LEAF;
    use heliodon_math::random::Pcg32;

    #[test]
    fn every_triangle_is_in_one_packet_and_clusters_are_kept_apart() {
        let mut rng = Pcg32::new(7, 1);
        let mut point = |size: f32| size * Vec3::from_array(core::array::from_fn(|_| rng.range_f32(-1.0, 1.0)));
        // six in each of ten places: cut evenly, packets would hold those of two
        let mut clusters: Vec<[Vec3; 3]> = Vec::new();
        for _ in 0..10 {
            let middle = point(100.0);
            clusters.extend((0..6).map(|_| [middle + point(0.1), middle + point(0.1), middle + point(0.1)]));
        }
        let mut scattered: Vec<[Vec3; 3]> = Vec::new();
        for _ in 0..5000 {
            let at = point(10.0);
            scattered.push([at, at + point(0.5), at + point(0.5)]);
        }
        for (corners, quality) in [(&clusters, Quality::Balanced), (&scattered, Quality::Fast), (&scattered, Quality::High)] {
            let ids: Vec<u32> = (0..corners.len() as u32).collect();
            let built = build(corners, &ids, quality);
            let mut met: Vec<u32> =
                built.packets.iter().flat_map(|p| p.triangles().map(|(_, id)| id).collect::<Vec<_>>()).collect();
            met.sort_unstable();
            assert_eq!(met, ids);
            let packets = built.nodes.iter().flat_map(|node| node.child).filter(|child| child & LEAF != 0).count();
            assert_eq!(packets, built.packets.len());
            assert!(packets <= corners.len() / 4, "{packets} packets for {} triangles", corners.len());
        }
        let built = build(&clusters, &(0..60).collect::<Vec<_>>(), Quality::Balanced);
        let largest = built.packets.iter().map(|packet| {
            let of: Vec<Vec3> = packet.triangles().map(|(_, id)| clusters[id as usize][0]).collect();
            of.iter().map(|x| x.distance(of[0])).fold(0.0, f32::max)
        });
        // (the binary hierarchy itself is not perfect)
        let mixed = largest.filter(|size| *size > 1.0).count();
        assert!(mixed <= 1, "{mixed} of {}", built.packets.len());
    }
}
