//! Lamps that light nothing where they stand.

use glam::{DVec3, Vec3};
use heliodon_bundle::site::Site;
use heliodon_math::sphere::fibonacci_sphere;
use heliodon_rays::{Ray, TriangleScene};

/// Directions in which a place is asked whether it lies inside of something: all must say so, for a lamp in an open shade is well placed.
const LOOKS: u32 = 64;

/// Whether a place lies inside of something closed.
#[must_use]
pub fn is_enclosed(place: Vec3, rays: &TriangleScene) -> bool {
    let ray = |direction| Ray { origin: place, direction, t_min: 0.0, t_max: f32::INFINITY };
    let looks: Vec<Ray> = fibonacci_sphere(LOOKS).into_iter().map(ray).collect();
    let mut counts = vec![0; looks.len()];
    rays.enclosures(&looks, &mut counts);
    counts.iter().all(|count| *count > 0)
}

/// What is wrong with a lamp that [`is_enclosed`].
#[must_use]
pub fn doubt(name: &str) -> String {
    format!("light {name} lies inside of something closed, and lights nothing outside of it: move its place")
}

/// A line for each lamp of `[[light]]` that lies inside of something closed; one without a name is told by its number, from 1.
#[must_use]
pub fn doubts(site: &Site, rays: &TriangleScene) -> Vec<String> {
    let origin = DVec3::from(site.site.origin);
    let enclosed =
        site.lamps.iter().enumerate().filter(|(_, lamp)| is_enclosed((DVec3::from(lamp.place) - origin).as_vec3(), rays));
    enclosed.map(|(index, lamp)| doubt(lamp.name.as_deref().unwrap_or(&(index + 1).to_string()))).collect()
}
