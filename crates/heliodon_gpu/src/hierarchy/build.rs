//! The shape of a hierarchy: which triangles lie together.
//!
//! Binned surface area heuristic (I. Wald: "On fast Construction of SAH-based Bounding Volume Hierarchies", IEEE Symposium on Interactive Ray Tracing 2007). It
//! is made once for a mesh, where vertices move only boxes change: a Morton order is made faster, but its hierarchy has every ray visit more, in every frame.

use glam::Vec3;

/// Triangles of a leaf at most; a triangle is taken to cost what a box does.
pub(super) const LEAF: usize = 4;
/// Places along each axis at which a split is tried.
const BINS: usize = 16;
/// Deeper than this, halves are even: a hierarchy of points in a heap stays as deep as the logarithm of their number.
const DEEPEST: u32 = 48;
/// Subtrees of more triangles are made side by side.
const PARALLEL: usize = 8192;

/// A node, before those under it: the first child follows it, the second follows the first one's subtree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Branch {
    /// The first of the places under it, and how many there are.
    pub first: u32,
    pub count: u32,
    /// Nodes under it and itself; 1 is a leaf.
    pub size: u32,
}

/// The triangles in an order in which those of each node follow one another, and the nodes in the order of a walk.
pub(super) struct Topology {
    pub order: Vec<u32>,
    pub branches: Vec<Branch>,
}

#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: Vec3,
    high: Vec3,
}

impl Bounds {
    const NOTHING: Self = Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };

    fn and(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn half_area(self) -> f32 {
        let e = (self.high - self.low).max(Vec3::ZERO);
        e.x * e.y + e.y * e.z + e.z * e.x
    }

    /// Twice its middle.
    fn middle(self) -> Vec3 {
        self.low + self.high
    }
}

impl Topology {
    /// `corners` of each triangle, finite and not beyond 1e12. The same for any number of threads.
    pub fn new(corners: &[[Vec3; 3]]) -> Self {
        let bounds: Vec<Bounds> =
            corners.iter().map(|[a, b, c]| Bounds { low: a.min(*b).min(*c), high: a.max(*b).max(*c) }).collect();
        let mut order: Vec<u32> = (0..corners.len() as u32).collect();
        let branches = if order.is_empty() { Vec::new() } else { branch(&bounds, &mut order, 0, 0) };
        Self { order, branches }
    }
}

/// The nodes over the triangles that `order` names, which it sorts.
fn branch(bounds: &[Bounds], order: &mut [u32], first: usize, depth: u32) -> Vec<Branch> {
    let count = order.len();
    let mut own = vec![Branch { first: first as u32, count: count as u32, size: 1 }];
    let Some(middle) = split(bounds, order, depth) else { return own };
    let (left, right) = order.split_at_mut(middle);
    let (left, right) = if count > PARALLEL {
        rayon::join(|| branch(bounds, left, first, depth + 1), || branch(bounds, right, first + middle, depth + 1))
    } else {
        (branch(bounds, left, first, depth + 1), branch(bounds, right, first + middle, depth + 1))
    };
    own[0].size += (left.len() + right.len()) as u32;
    own.extend(left);
    own.extend(right);
    own
}

/// How many triangles come into the first half, now in front; none where they are one leaf.
fn split(bounds: &[Bounds], order: &mut [u32], depth: u32) -> Option<usize> {
    let count = order.len();
    if count <= 1 {
        return None;
    }
    let of = |i: u32| bounds[i as usize];
    let (mut all, mut middles) = (Bounds::NOTHING, Bounds::NOTHING);
    for &i in &*order {
        let (bounds, middle) = (of(i), of(i).middle());
        all = all.and(bounds);
        middles = middles.and(Bounds { low: middle, high: middle });
    }
    let extent = middles.high - middles.low;
    let scale = extent.map(|e| if e > 0.0 { BINS as f32 * (1.0 - 1e-6) / e } else { 0.0 });
    let bin = |i: u32| ((of(i).middle() - middles.low) * scale).as_uvec3().min(glam::UVec3::splat(BINS as u32 - 1));
    let mut bins = [[(Bounds::NOTHING, 0_u32); BINS]; 3];
    for &i in &*order {
        let at = bin(i);
        for (axis, bins) in bins.iter_mut().enumerate() {
            let (bounds, count) = &mut bins[at[axis] as usize];
            (*bounds, *count) = (bounds.and(of(i)), *count + 1);
        }
    }
    let best = (0..3).filter(|&axis| extent[axis] > 0.0).filter_map(|axis| cheapest(&bins[axis]).map(|best| (axis, best)));
    let best = best.min_by(|(_, (a, _)), (_, (b, _))| a.total_cmp(b)).filter(|_| depth < DEEPEST);
    // A box is asked as a triangle is: a leaf costs its triangles, two halves two boxes and what is expected in them.
    let whole = all.half_area();
    match best {
        Some((_, (cost, _))) if count <= LEAF && 2.0 * whole + cost >= count as f32 * whole => None,
        Some((axis, (_, last))) => Some(partition(order, |i| bin(i)[axis] <= last)),
        None if count <= LEAF => None,
        None => Some(count / 2),
    }
}

/// The expected cost of the cheapest cut through the bins, and the last bin before it.
fn cheapest(bins: &[(Bounds, u32); BINS]) -> Option<(f32, u32)> {
    let mut behind = [0.0; BINS];
    let (mut bounds, mut count) = (Bounds::NOTHING, 0);
    for k in (1..BINS).rev() {
        (bounds, count) = (bounds.and(bins[k].0), count + bins[k].1);
        behind[k] = if count > 0 { bounds.half_area() * count as f32 } else { f32::INFINITY };
    }
    (bounds, count) = (Bounds::NOTHING, 0);
    let mut best: Option<(f32, u32)> = None;
    for k in 0..BINS - 1 {
        (bounds, count) = (bounds.and(bins[k].0), count + bins[k].1);
        let cost = bounds.half_area() * count as f32 + behind[k + 1];
        if count > 0 && cost.is_finite() && best.is_none_or(|(least, _)| cost < least) {
            best = Some((cost, k as u32));
        }
    }
    best
}

/// Brings what belongs in front there, in the order that it has; answers how many.
fn partition(order: &mut [u32], front: impl Fn(u32) -> bool) -> usize {
    let (mut ahead, mut back) = (0, Vec::new());
    for k in 0..order.len() {
        let i = order[k];
        if front(i) {
            order[ahead] = i;
            ahead += 1;
        } else {
            back.push(i);
        }
    }
    order[ahead..].copy_from_slice(&back);
    ahead
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each triangle once; children cover what their parent does; leaves are small.
    fn check(corners: &[[Vec3; 3]]) {
        let Topology { order, branches } = Topology::new(corners);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.iter().copied().eq(0..corners.len() as u32));
        for (i, node) in branches.iter().enumerate() {
            if node.size == 1 {
                assert!((1..=LEAF as u32).contains(&node.count), "{node:?}");
                continue;
            }
            let left = branches[i + 1];
            let right = branches[i + 1 + left.size as usize];
            assert_eq!([left.first, right.first], [node.first, node.first + left.count]);
            assert_eq!([left.count + right.count, left.size + right.size + 1], [node.count, node.size]);
        }
        assert_eq!(branches.first().map_or(0, |root| root.size as usize), branches.len());
    }

    #[test]
    fn hierarchies_hold_each_triangle_once() {
        let at = |p: Vec3| [p, p + Vec3::X * 0.1, p + Vec3::Y * 0.1];
        check(&[]);
        check(&[at(Vec3::ZERO)]);
        check(&vec![at(Vec3::ONE); 100]);
        check(&heliodon_math::sphere::fibonacci_sphere(20_000).into_iter().map(at).collect::<Vec<_>>());
        // each twice as far as the one before
        check(&(0..39).map(|i| at(Vec3::X * (i as f32).exp2())).collect::<Vec<_>>());
        check(&[[Vec3::splat(1e12), Vec3::splat(-1e12), Vec3::ZERO]; 9]);
    }

    #[test]
    fn a_hierarchy_is_the_same_for_any_number_of_threads() {
        let corners: Vec<[Vec3; 3]> =
            heliodon_math::sphere::fibonacci_sphere(30_000).into_iter().map(|p| [p, p * 1.01, p + Vec3::X * 0.01]).collect();
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| Topology::new(&corners))
        };
        let (one, four) = (on(1), on(4));
        assert_eq!(one.order, four.order);
        assert_eq!(one.branches, four.branches);
    }
}
