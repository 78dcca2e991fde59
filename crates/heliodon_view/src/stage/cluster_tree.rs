//! A chunk's clusters in a tree of boxes, so that a ray or a place looks at some twenty of them and not at a thousand.

use crate::daylight::cluster::Cluster;
use glam::Vec3;

/// Clusters of a leaf at most.
const LEAF: usize = 2;

/// The tree. It is a twentieth of what the clusters are.
#[derive(Clone, Debug, Default)]
pub struct ClusterTree {
    /// The root comes first; each node before what is below it.
    nodes: Vec<Node>,
    /// Clusters, leaf by leaf.
    order: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    low: Vec3,
    high: Vec3,
    /// Of a leaf the first of `order`; else the first of two nodes.
    first: u32,
    /// Clusters of a leaf; else none.
    count: u32,
}

impl ClusterTree {
    /// Halves the clusters along their widest axis, again and again.
    #[must_use]
    pub fn new(clusters: &[Cluster]) -> Self {
        let order: Vec<u32> = (0..clusters.len() as u32).collect();
        let mut tree = Self { nodes: Vec::with_capacity(clusters.len()), order };
        if clusters.is_empty() {
            return tree;
        }
        tree.nodes.push(tree.around(clusters, 0, clusters.len()));
        let mut open = vec![0];
        while let Some(at) = open.pop() {
            let Node { low, high, first, count } = tree.nodes[at];
            let (first, count) = (first as usize, count as usize);
            if count <= LEAF {
                continue;
            }
            let axis = (high - low).max_position();
            let half = count / 2;
            let along = |number: &u32| clusters[*number as usize].center[axis];
            // equal ones in the order of their numbers: the same tree every time
            tree.order[first..first + count].select_nth_unstable_by(half, |a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
            let below = tree.nodes.len();
            tree.nodes.push(tree.around(clusters, first, half));
            tree.nodes.push(tree.around(clusters, first + half, count - half));
            tree.nodes[at] = Node { first: below as u32, count: 0, ..tree.nodes[at] };
            open.extend([below, below + 1]);
        }
        tree
    }

    /// A leaf of some clusters.
    fn around(&self, clusters: &[Cluster], first: usize, count: usize) -> Node {
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &number in &self.order[first..first + count] {
            let cluster = &clusters[number as usize];
            (low, high) = (low.min(cluster.center - cluster.half), high.max(cluster.center + cluster.half));
        }
        // a hair more: middle and half are rounded
        let hair = Vec3::splat(1e-6) * (low.abs().max(high.abs()) + 1.0);
        Node { low: low - hair, high: high + hair, first: first as u32, count: count as u32 }
    }

    /// Goes through the clusters that may count, the nearest boxes first: `far` tells how far a box is, or that it does not count, and `met` looks into a cluster; both know what has been
    /// found by then from `state`.
    pub fn search<S>(&self, state: &mut S, far: impl Fn(&S, (Vec3, Vec3)) -> Option<f32>, mut met: impl FnMut(&mut S, usize)) {
        // deeper than any tree of as many clusters as a chunk may have
        let mut open: Vec<u32> = Vec::with_capacity(32);
        let counts = |state: &S, at: u32| self.nodes.get(at as usize).and_then(|node| far(state, (node.low, node.high)));
        open.extend(counts(state, 0).map(|_| 0));
        while let Some(at) = open.pop() {
            let node = self.nodes[at as usize];
            // something nearer may have been found since
            if far(state, (node.low, node.high)).is_none() {
                continue;
            }
            if node.count > 0 {
                for &number in &self.order[node.first as usize..(node.first + node.count) as usize] {
                    met(state, number as usize);
                }
                continue;
            }
            let [a, b] = [node.first, node.first + 1].map(|at| counts(state, at).map(|far| (far, at)));
            match (a, b) {
                (Some(a), Some(b)) => {
                    let (near, beyond) = if a.0 <= b.0 { (a.1, b.1) } else { (b.1, a.1) };
                    open.extend([beyond, near]);
                }
                (one, other) => open.extend(one.or(other).map(|(_, at)| at)),
            }
        }
    }
}
