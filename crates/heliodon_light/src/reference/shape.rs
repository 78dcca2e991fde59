//! Pictures of one geometry that show another's light: how far a simplification is off by its shape alone.
//!
//! Whatever is taken from the original into textures of what was simplified (light, normals, colours), it can at best show at each place what the
//! original has there. A traced picture with all of that, on the simplified shape, is therefore as near to the original's as any such texture comes.

use crate::Surfaces;
use heliodon_rays::{Hit, Ray};

/// The geometry that is seen, in place of that which paths travel through.
#[derive(Clone, Copy)]
pub struct Shape<'a> {
    /// Its triangles with their normals; what they reflect is not asked.
    pub surfaces: &'a Surfaces<'a>,
    /// For each of its triangles how far it may lie off what it stands for, as an angle in radians seen from the eye.
    pub reach_rad: &'a [f32],
}

impl Shape<'_> {
    /// What places that rays met on this shape show of `original`, and the rays that look for it there: along the place's normal from outside,
    /// as far as the shape may be off.
    ///
    /// Where nothing is found, and where rays met nothing of the shape, they are what they were; those of the first kind show what they meet of
    /// the original.
    pub(super) fn shown(&self, original: &Surfaces, rays: Vec<Ray>, met: &[Hit]) -> (Vec<Ray>, Vec<Hit>) {
        let inwards: Vec<Ray> = rays.iter().zip(met).map(|(ray, hit)| self.inwards(ray, hit)).collect();
        let mut found = closest(original, &inwards);
        let lost: Vec<usize> = (0..rays.len()).filter(|&i| met[i].is_some() && !found[i].is_some()).collect();
        let straight: Vec<Ray> = lost.iter().map(|&i| rays[i]).collect();
        let mut looks = rays;
        for (look, (inwards, hit)) in looks.iter_mut().zip(inwards.into_iter().zip(&found)) {
            if hit.is_some() {
                *look = inwards;
            }
        }
        for (i, hit) in lost.into_iter().zip(closest(original, &straight)) {
            found[i] = hit;
        }
        (looks, found)
    }

    fn inwards(&self, ray: &Ray, hit: &Hit) -> Ray {
        if !hit.is_some() {
            // meets nothing
            return Ray { t_max: 0.0, ..*ray };
        }
        let (place, normal) = self.surfaces.leave(ray.direction, hit, 0.0);
        let reach_m = self.reach_rad[hit.triangle as usize] * hit.t;
        Ray { origin: place + normal * reach_m, direction: -normal, t_min: 0.0, t_max: 2.0 * reach_m }
    }
}

/// The nearest of the surfaces along each ray.
pub(super) fn closest(surfaces: &Surfaces, rays: &[Ray]) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS; rays.len()];
    surfaces.rays.closest(rays, &mut hits);
    hits
}
