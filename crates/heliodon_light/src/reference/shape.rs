//! Pictures of one geometry that show another's light: how far a simplification is off by its shape alone.
//!
//! Whatever is taken from the original into textures of what was simplified (light, normals, colours), it can at best show at each place what the
//! original has there. A traced picture with all of that, on the simplified shape, is therefore as near to the original's as any such texture comes.

use super::only_what_is_met;
use crate::{LightError, Surfaces};
use heliodon_rays::{Hit, Ray};

/// The geometry that is seen, in place of that which paths travel through.
#[derive(Clone, Copy)]
pub struct Shape<'a> {
    /// Its triangles with their normals; what they reflect is not asked. Rays meet these very triangles: there is no [`Detail`](crate::Detail).
    pub surfaces: &'a Surfaces<'a>,
    /// For each of its triangles how far it may lie off what it stands for, as an angle in radians seen from the eye: finite, at least 0. One of 0 shows
    /// what is seen straight on.
    pub reach_rad: &'a [f32],
}

impl Shape<'_> {
    /// Whether its parts agree.
    ///
    /// # Errors
    /// Invalid surfaces, or not one reach in its range for each triangle.
    pub fn validate(&self) -> Result<(), LightError> {
        only_what_is_met(self.surfaces)?;
        let (triangles, reaches) = (self.surfaces.triangles.len(), self.reach_rad.len());
        if triangles != reaches {
            return Err(LightError::Mismatch(format!("a shape of {triangles} triangles with {reaches} reaches")));
        }
        match self.reach_rad.iter().find(|reach| !(reach.is_finite() && **reach >= 0.0)) {
            Some(reach) => {
                let (value, allowed) = (reach.to_string(), "a finite angle in radians, not negative");
                Err(LightError::Parameter { name: "reach_rad", value, allowed })
            }
            None => Ok(()),
        }
    }

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
        let place = self.surfaces.position_at(hit.triangle, hit.u, hit.v);
        let (_, normal) = self.surfaces.leave(ray.direction, hit, 0.0);
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
