//! What an eye's rays meet first.

use heliodon_rays::{Hit, Ray, TriangleScene};

/// Backs of single-sided triangles that one ray looks through at most.
const THROUGH: usize = 64;

/// A model as it is drawn: of triangles that are drawn single-sided, only fronts are there.
#[derive(Clone, Copy)]
pub(super) struct Sight<'a> {
    pub scene: &'a TriangleScene,
    /// For each triangle, or empty where none is.
    pub single_sided: &'a [bool],
}

impl Sight<'_> {
    /// The first triangle that each ray sees. `rays` are moved past what they look through.
    pub fn first(&self, rays: &mut [Ray], hits: &mut Vec<Hit>) {
        hits.clear();
        hits.resize(rays.len(), Hit::MISS);
        self.scene.closest(rays, hits);
        if self.single_sided.is_empty() {
            return;
        }
        for (ray, hit) in rays.iter_mut().zip(hits) {
            for _ in 0..THROUGH {
                if !(hit.is_some() && hit.back && self.single_sided[hit.triangle as usize]) {
                    break;
                }
                ray.t_min = hit.t;
                self.scene.closest(std::slice::from_ref(ray), std::slice::from_mut(hit));
            }
        }
    }
}
