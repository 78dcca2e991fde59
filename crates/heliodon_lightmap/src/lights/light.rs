//! One light, ready to be asked.

use crate::lights::directional::Directional;
use crate::lights::disc::Disc;
use crate::lights::local::Local;
use crate::lights::mesh::Mesh;
use crate::lights::rectangle::{Picked, Rectangle};
use crate::lights::sample::{EmitterHit, LightBounds, LightSample};
use glam::{DVec3, Vec3};
use heliodon_math::color::LUMINANCE_REC709;
use std::f64::consts::PI;

/// A light of a scene, made from a [`crate::lights::LightSpec`].
///
/// Points and normals are in the scene's coordinates (metres), normals are unit vectors, light is linear RGB in the site's unit and
/// **irradiance over pi**. All answers are finite and not negative; what is asked of a place that is not finite is dark.
#[derive(Clone, Debug)]
pub struct Light {
    title: String,
    source: Source,
    bounds: Option<LightBounds>,
}

/// Its shape, and what it gives.
#[derive(Clone, Debug)]
pub(super) enum Source {
    /// Intensity per the shape's part.
    Local {
        light: Local,
        intensity: DVec3,
    },
    /// Irradiance at normal incidence.
    Directional {
        light: Directional,
        irradiance: DVec3,
    },
    /// Radiance of a surface.
    Rectangle {
        light: Rectangle,
        radiance: DVec3,
        two_sided: bool,
    },
    Disc {
        light: Disc,
        radiance: DVec3,
        two_sided: bool,
    },
    Mesh {
        light: Mesh,
        radiance: DVec3,
        two_sided: bool,
    },
}

/// Towards what of a flat emitter a height above its plane lies: its shining side?
fn shines(height: f64, two_sided: bool) -> bool {
    height > 0.0 || (two_sided && height < 0.0)
}

/// Light as f32, where it is finite.
fn finite(light: DVec3) -> Option<Vec3> {
    let light = light.as_vec3();
    light.is_finite().then_some(light)
}

impl Source {
    fn bounds(&self) -> Option<LightBounds> {
        let hold = |points: &mut dyn Iterator<Item = Vec3>| {
            let (min, max) =
                points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), point| (low.min(point), high.max(point)));
            LightBounds { min, max }
        };
        match self {
            Self::Local { light, .. } => Some(hold(&mut std::iter::once(light.place.as_vec3()))),
            Self::Directional { .. } => None,
            Self::Rectangle { light, .. } => Some(hold(&mut light.corners().into_iter().map(|c| c.as_vec3()))),
            Self::Disc { light, .. } => {
                let n = light.normal;
                let reach = (DVec3::ONE - n * n).max(DVec3::ZERO).map(f64::sqrt) * light.radius;
                Some(hold(&mut [light.centre - reach, light.centre + reach].into_iter().map(|p| p.as_vec3())))
            }
            Self::Mesh { light, .. } => Some(hold(&mut light.positions())),
        }
    }
}

/// Meshes of more triangles than this are sampled even where closed forms could be summed.
const FEW_TRIANGLES: usize = 512;

/// So many triangles of a mesh tell where it lies: each costs a look around.
const PLACES: usize = 16;

impl Light {
    pub(super) fn of(title: String, source: Source) -> Self {
        let bounds = source.bounds();
        Self { title, source, bounds }
    }

    /// Its name in quotes, or its kind.
    #[must_use]
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Whether it is a point or a sharp direction: its shadows are sharp, one sample tells all of it, and no bounced ray meets it.
    #[must_use]
    pub fn is_delta(&self) -> bool {
        match &self.source {
            Source::Local { .. } => true,
            Source::Directional { light, .. } => light.is_sharp(),
            _ => false,
        }
    }

    /// Whether it lies infinitely far away.
    #[must_use]
    pub fn is_directional(&self) -> bool {
        matches!(self.source, Source::Directional { .. })
    }

    /// One sample of the light at a point, from two numbers in [0, 1) that may be stratified: see [`LightSample`] for the estimate that it
    /// makes. `None` where the light sends nothing (behind it, in its plane, out of its cone, in the very place of a point), and for the part of
    /// a near disc's samples that miss it; it counts as a sample of 0.
    #[must_use]
    pub fn sample(&self, point: Vec3, numbers: [f32; 2]) -> Option<LightSample> {
        if !point.is_finite() {
            return None;
        }
        let point = point.as_dvec3();
        let numbers = numbers.map(|u| f64::from(u).clamp(0.0, 1.0 - f64::EPSILON));
        match &self.source {
            Source::Local { light, intensity } => {
                let (direction, distance, part) = light.seen_from(point)?;
                let light = (part > 0.0).then(|| finite(*intensity * part))??;
                Some(LightSample { direction: direction.as_vec3(), distance_m: distance as f32, light, pdf_sr: None })
            }
            Source::Directional { light, irradiance } => {
                let (direction, pdf) = light.sample(numbers);
                let weight = pdf.map_or(1.0, |pdf| 1.0 / (light.normal_irradiance() * pdf));
                let light = finite(*irradiance * (weight / PI))?;
                let pdf_sr = pdf.map(|pdf| pdf as f32);
                Some(LightSample { direction: direction.as_vec3(), distance_m: f32::INFINITY, light, pdf_sr })
            }
            Source::Rectangle { light, radiance, two_sided } => {
                let picked = shines(light.height_of(point), *two_sided).then(|| light.sample(point, numbers))??;
                surface_sample(point, &picked, *radiance)
            }
            Source::Disc { light, radiance, two_sided } => {
                let picked = shines(light.height_of(point), *two_sided).then(|| light.sample(point, numbers))??;
                surface_sample(point, &picked, *radiance)
            }
            Source::Mesh { light, radiance, .. } => surface_sample(point, &light.sample(point, numbers)?, *radiance),
        }
    }

    /// All of its light at a point of unit normal `normal` where nothing lies between: irradiance over pi, with the part of the light below the
    /// surface's horizon left out. `None` only for meshes that may hide parts of themselves (not convex, or more than 512 triangles).
    #[must_use]
    pub fn closed_form(&self, point: Vec3, normal: Vec3) -> Option<Vec3> {
        if !point.is_finite() || !normal.is_finite() {
            return Some(Vec3::ZERO);
        }
        let (point, normal) = (point.as_dvec3(), normal.as_dvec3());
        let light = match &self.source {
            Source::Local { light, intensity } => light
                .seen_from(point)
                .map_or(DVec3::ZERO, |(direction, _, part)| *intensity * (part * normal.dot(direction).max(0.0))),
            Source::Directional { light, irradiance } => *irradiance * light.part(normal),
            Source::Rectangle { light, radiance, two_sided } => {
                let shines = shines(light.height_of(point), *two_sided);
                *radiance * if shines { light.irradiance_over_pi(point, normal) } else { 0.0 }
            }
            Source::Disc { light, radiance, two_sided } => {
                let shines = shines(light.height_of(point), *two_sided);
                *radiance * if shines { light.irradiance_over_pi(point, normal) } else { 0.0 }
            }
            Source::Mesh { light, radiance, .. } => *radiance * light.irradiance_over_pi(point, normal)?,
        };
        Some(finite(light).unwrap_or(Vec3::ZERO))
    }

    /// As [`Light::closed_form`], as if no part of the light hid another: what rays to its samples would bring if none met anything. `None` for
    /// meshes of more than 512 triangles, of which each takes its time.
    #[must_use]
    pub fn unhidden(&self, point: Vec3, normal: Vec3) -> Option<Vec3> {
        match &self.source {
            Source::Mesh { light, radiance, .. } if point.is_finite() && normal.is_finite() => {
                let few = light.len() <= FEW_TRIANGLES;
                let part = few.then(|| light.irradiance_of_all(point.as_dvec3(), normal.as_dvec3()))?;
                Some(finite(*radiance * part).unwrap_or(Vec3::ZERO))
            }
            _ => self.closed_form(point, normal),
        }
    }

    /// Radiance that leaves the emitter at a place in a unit direction away from it. Zero from a dark side, along the surface, and for lights
    /// without a surface.
    #[must_use]
    pub fn radiance_towards(&self, hit: &EmitterHit, direction: Vec3) -> Vec3 {
        let direction = direction.as_dvec3();
        let (normal, radiance, two_sided) = match &self.source {
            Source::Rectangle { light, radiance, two_sided } => (light.normal, radiance, two_sided),
            Source::Disc { light, radiance, two_sided } => (light.normal, radiance, two_sided),
            Source::Mesh { light, radiance, two_sided } => (light.normal(hit.triangle), radiance, two_sided),
            _ => return Vec3::ZERO,
        };
        let shines = shines(normal.dot(direction), *two_sided);
        if shines { finite(*radiance).unwrap_or(Vec3::ZERO) } else { Vec3::ZERO }
    }

    /// The density per steradian with which [`Light::sample`] picks that place of the emitter from a point; 0 where it never does.
    #[must_use]
    pub fn pdf_sr(&self, point: Vec3, hit: &EmitterHit) -> f32 {
        let (point, position) = (point.as_dvec3(), hit.position.as_dvec3());
        let pdf = match &self.source {
            Source::Rectangle { light, two_sided, .. } if shines(light.height_of(point), *two_sided) => {
                light.pdf_sr(point, position)
            }
            Source::Disc { light, two_sided, .. } if shines(light.height_of(point), *two_sided) => {
                light.pdf_sr(point, position)
            }
            Source::Mesh { light, .. } => light.pdf_sr(point, hit.triangle, position),
            _ => 0.0,
        };
        // what is too dense for an f32 is as good as a point
        if pdf.is_nan() { 0.0 } else { (pdf as f32).min(f32::MAX) }
    }

    /// Radiance of a directional light's disc for a ray that leaves the scene in a unit direction; zero beside it, and for all other lights.
    #[must_use]
    pub fn radiance_from_afar(&self, direction: Vec3) -> Vec3 {
        match &self.source {
            Source::Directional { light, irradiance } if light.holds(direction.as_dvec3()) => {
                finite(*irradiance / light.normal_irradiance()).unwrap_or(Vec3::ZERO)
            }
            _ => Vec3::ZERO,
        }
    }

    /// The density per steradian with which [`Light::sample`] picks a unit direction to a directional light's disc; 0 for all other lights.
    #[must_use]
    pub fn pdf_from_afar_sr(&self, direction: Vec3) -> f32 {
        match &self.source {
            Source::Directional { light, .. } => light.pdf_sr(direction.as_dvec3()) as f32,
            _ => 0.0,
        }
    }

    /// Where a ray of unit direction first meets the emitter, and how far on (metres, above 0): for emitters that are not part of the scene's
    /// own triangles. It takes each triangle of a mesh in turn.
    #[must_use]
    pub fn intersect(&self, origin: Vec3, direction: Vec3) -> Option<(f32, EmitterHit)> {
        let (from, along) = (origin.as_dvec3(), direction.as_dvec3());
        let (triangle, t) = match &self.source {
            Source::Rectangle { light, .. } => (0, light.intersect(from, along)?),
            Source::Disc { light, .. } => (0, light.intersect(from, along)?),
            Source::Mesh { light, .. } => light.intersect(from, along)?,
            _ => return None,
        };
        Some((t as f32, EmitterHit { triangle, position: (from + along * t).as_vec3() }))
    }

    /// Its flux in all directions together, in the site's unit of radiance times m2 sr. A directional light's is what falls on a scene of
    /// that radius (metres), on which no other light depends.
    #[must_use]
    pub fn power(&self, scene_radius_m: f32) -> Vec3 {
        let flat = |radiance: DVec3, area: f64, two_sided: bool| radiance * (PI * area * if two_sided { 2.0 } else { 1.0 });
        let power = match &self.source {
            Source::Local { light, intensity } => *intensity * light.solid_angle(),
            Source::Directional { irradiance, .. } => *irradiance * (PI * f64::from(scene_radius_m).powi(2)),
            Source::Rectangle { light, radiance, two_sided } => flat(*radiance, light.area(), *two_sided),
            Source::Disc { light, radiance, two_sided } => flat(*radiance, light.area(), *two_sided),
            Source::Mesh { light, radiance, two_sided } => flat(*radiance, light.area(), *two_sided),
        };
        power.as_vec3().min(Vec3::splat(f32::MAX))
    }

    /// Some places from which it shines: a point's own; middle and edge of a flat emitter; of a mesh the middles of some triangles. Surfaces have them `before_m` metres
    /// before each side that shines. None of a directional light.
    #[must_use]
    pub fn places(&self, before_m: f32) -> Vec<Vec3> {
        let flat = |middle: DVec3, edge: [DVec3; 4], normal: DVec3| {
            edge.into_iter().chain([middle]).map(|place| (place, normal)).collect::<Vec<_>>()
        };
        let (places, two_sided) = match &self.source {
            Source::Local { light, .. } => return vec![light.place.as_vec3()],
            Source::Directional { .. } => return Vec::new(),
            Source::Rectangle { light, two_sided, .. } => {
                let corners = light.corners();
                (flat(0.5 * (corners[0] + corners[2]), corners, light.normal), *two_sided)
            }
            Source::Disc { light, two_sided, .. } => (flat(light.centre, light.rim(), light.normal), *two_sided),
            Source::Mesh { light, two_sided, .. } => (light.some_middles(PLACES), *two_sided),
        };
        let before_m = f64::from(before_m);
        let sides: &[f64] = if two_sided { &[1.0, -1.0] } else { &[1.0] };
        let before =
            places.iter().flat_map(|(place, normal)| sides.iter().map(move |side| *place + *normal * (side * before_m)));
        before.map(|place| place.as_vec3()).collect()
    }

    /// A box that holds it; `None` for directional lights.
    #[must_use]
    pub fn bounds(&self) -> Option<LightBounds> {
        self.bounds
    }

    /// No less than the luminance of its light (irradiance over pi) at a point of unit normal `normal`, whatever lies between: for choosing
    /// among many lights by [`crate::lights::pick_light`]. 0 only where nothing can come.
    #[must_use]
    pub fn upper_bound(&self, point: Vec3, normal: Vec3) -> f32 {
        let before = |height: f64, two_sided: bool| two_sided || height > 0.0;
        let (radiance, area, before) = match &self.source {
            Source::Local { .. } | Source::Directional { .. } => {
                return self.closed_form(point, normal).map_or(0.0, heliodon_math::color::luminance);
            }
            Source::Rectangle { light, radiance, two_sided } => {
                (radiance, light.area(), before(light.height_of(point.as_dvec3()), *two_sided))
            }
            Source::Disc { light, radiance, two_sided } => {
                (radiance, light.area(), before(light.height_of(point.as_dvec3()), *two_sided))
            }
            Source::Mesh { light, radiance, .. } => (radiance, light.area(), true),
        };
        let Some(bounds) = self.bounds.filter(|_| before) else { return 0.0 };
        let share = share_of_sphere(bounds, area, point, normal);
        (radiance.dot(LUMINANCE_REC709.as_dvec3()) * share) as f32
    }
}

/// No less than the irradiance over pi from surfaces of radiance one and so much area within bounds, taken as facing the point.
fn share_of_sphere(bounds: LightBounds, area: f64, point: Vec3, normal: Vec3) -> f64 {
    // wider than its rounding, so that what touches the sphere counts as within
    let radius = f64::from(bounds.radius_m()) * (1.0 + 1e-6);
    let to = (bounds.centre() - point).as_dvec3();
    let distance = to.length();
    if distance.is_nan() || distance <= radius {
        return if distance.is_finite() { 1.0 } else { 0.0 };
    }
    let sine = radius / distance;
    // the least angle between the normal and a direction within the sphere's cone
    let angle = libm::acos((to.dot(normal.as_dvec3()) / distance).clamp(-1.0, 1.0)) - libm::asin(sine);
    let cosine = libm::cos(angle.max(0.0)).max(0.0);
    // the whole cone at normal incidence, or all of its directions, or all of the area, at the best cosine
    let cone = 2.0 * (1.0 - (1.0 - sine * sine).sqrt());
    (sine * sine).min(cosine * cone.min(area / (PI * (distance - radius).powi(2))))
}

/// A sample of a surface of some radiance. Nothing where the point lies on it, or where single precision ends.
fn surface_sample(point: DVec3, picked: &Picked, radiance: DVec3) -> Option<LightSample> {
    let to = picked.position - point;
    let direction = to.try_normalize()?.as_vec3();
    let pdf = picked.pdf_sr as f32;
    let light = finite(radiance / (PI * picked.pdf_sr))?;
    (pdf.is_finite() && pdf > 0.0).then_some(LightSample {
        direction,
        distance_m: to.length() as f32,
        light,
        pdf_sr: Some(pdf),
    })
}
