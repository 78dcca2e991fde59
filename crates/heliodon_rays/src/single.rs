//! One ray at a time.

use glam::Vec3;

use crate::layout::{LEAF, Node, Packet};
use crate::scene::TriangleScene;
use crate::shear::Shear;
use crate::types::{Hit, Ray};

struct Walker {
    shear: Shear,
    point: [f32; 3],
    t_min: f32,
}

/// Walks the hierarchy; with `ANY` stops at the first triangle found.
pub(crate) fn trace<const ANY: bool>(scene: &TriangleScene, ray: &Ray, stack: &mut Vec<(f32, u32)>) -> Hit {
    let origin: Vec3 = ray.origin - scene.center;
    let mut hit = Hit::MISS;
    let Some(shear) = Shear::new(ray.direction) else { return hit };
    if !origin.is_finite() {
        return hit;
    }
    let walker = Walker { shear, point: shear.apply(origin), t_min: ray.t_min };
    hit.t = ray.t_max;
    stack.clear();
    stack.push((f32::NEG_INFINITY, 0));
    while let Some((near, reference)) = stack.pop() {
        if near > hit.t {
            continue;
        }
        if reference & LEAF != 0 {
            walker.packet(&scene.packets[(reference & !LEAF) as usize], &mut hit);
            if ANY && hit.is_some() {
                return hit;
            }
        } else {
            walker.node(&scene.nodes[reference as usize], &hit, stack);
        }
    }
    if hit.is_some() { hit } else { Hit::MISS }
}

impl Walker {
    #[inline(always)]
    fn node(&self, node: &Node, hit: &Hit, stack: &mut Vec<(f32, u32)>) {
        let [i, j, k] = self.shear.axes;
        let [si, sj] = self.shear.slope;
        let [p, q, depth] = self.point;
        let near_first = stack.len();
        for c in 0..8 {
            let at = |max: bool, axis: usize| node.bounds[usize::from(max)][axis][c];
            let inside = at(false, i) - si * at(si > 0.0, k) <= p
                && p <= at(true, i) - si * at(si <= 0.0, k)
                && at(false, j) - sj * at(sj > 0.0, k) <= q
                && q <= at(true, j) - sj * at(sj <= 0.0, k);
            let (near, far) = if self.shear.forward { (at(false, k), at(true, k)) } else { (-at(true, k), -at(false, k)) };
            let near = (near - depth) * self.shear.t_per_depth;
            let far = (far - depth) * self.shear.t_per_depth;
            if inside && far > self.t_min && near <= hit.t {
                stack.push((near, node.child[c]));
            }
        }
        // Nearest on top.
        stack[near_first..].sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
    }

    #[inline(always)]
    fn packet(&self, packet: &Packet, hit: &mut Hit) {
        let [p, q, depth] = self.point;
        for lane in 0..8 {
            let corner = |v: usize| {
                let x = packet.vertex[v];
                let [a, b, c] = self.shear.apply(Vec3::new(x[0][lane], x[1][lane], x[2][lane]));
                [a - p, b - q, c - depth]
            };
            let (a, b, c) = (corner(0), corner(1), corner(2));
            let wa = b[0] * c[1] - b[1] * c[0];
            let wb = c[0] * a[1] - c[1] * a[0];
            let wc = a[0] * b[1] - a[1] * b[0];
            let det = wa + wb + wc;
            let inside = (wa >= 0.0 && wb >= 0.0 && wc >= 0.0) || (wa <= 0.0 && wb <= 0.0 && wc <= 0.0);
            let span = |k: usize| (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
            let (p_span, q_span, z_span) = (span(0), span(1), span(2));
            let boxed = p_span.0 <= 0.0 && p_span.1 >= 0.0 && q_span.0 <= 0.0 && q_span.1 >= 0.0;
            if !(inside && boxed && det != 0.0) {
                continue;
            }
            let distance = (wa * a[2] + wb * b[2] + wc * c[2]) / det;
            let t = distance.clamp(z_span.0, z_span.1) * self.shear.t_per_depth;
            let nearer = t < hit.t || (t == hit.t && hit.is_some() && packet.id[lane] < hit.triangle);
            if t > self.t_min && nearer {
                *hit = Hit { triangle: packet.id[lane], t, u: wb / det, v: wc / det, back: (det > 0.0) == self.shear.forward };
            }
        }
    }
}
