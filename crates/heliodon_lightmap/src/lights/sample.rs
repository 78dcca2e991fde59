//! What lights answer.

use glam::Vec3;

/// A direction to a light, and what comes from it.
///
/// With `V` = 1 where nothing lies between, at a surface of normal `n`,
///
/// ```text
/// estimate of irradiance / pi = light * max(n . direction, 0) * V
/// ```
///
/// is unbiased for uniform numbers; where a light answers no sample at all, its estimate is 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit vector from the point to the light.
    pub direction: Vec3,
    /// How far the light is, metres, infinite for directional lights. A ray that asks for visibility ends a little before, or it meets the
    /// emitter itself where that is part of the scene.
    pub distance_m: f32,
    /// Irradiance over pi at normal incidence, without the cosine at the receiver and without visibility, per sample: for surfaces radiance /
    /// (pi * density), for points intensity / (pi * distance^2). Linear RGB, finite, not negative.
    pub light: Vec3,
    /// With which density per steradian the direction was picked; `None` for lights that are points or sharp directions, which no bounced
    /// ray ever meets.
    pub pdf_sr: Option<f32>,
}

impl LightSample {
    /// This sample's weight where bounced rays, picked with density `other_pdf_sr` in its direction, count the same light too: the
    /// balance heuristic (Veach, Guibas: "Optimally Combining Sampling Techniques for Monte Carlo Rendering", SIGGRAPH 1995, eq. 8). 1 for
    /// lights that bounced rays cannot meet.
    #[must_use]
    pub fn mis_weight(&self, other_pdf_sr: f32) -> f32 {
        self.pdf_sr.map_or(1.0, |pdf| balance(pdf, other_pdf_sr))
    }
}

/// The balance heuristic's weight for what was picked with the first of two densities (per steradian, not negative); 0 where both are.
#[must_use]
pub fn balance(pdf_sr: f32, other_pdf_sr: f32) -> f32 {
    let weight = pdf_sr / (pdf_sr + other_pdf_sr);
    if weight.is_finite() { weight } else { 0.0 }
}

/// Where a ray meets an emitter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterHit {
    /// The triangle of a mesh; 0 for rectangles and discs.
    pub triangle: u32,
    /// Where, metres.
    pub position: Vec3,
}

/// A box that holds all of a light, and the sphere around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    /// The lowest coordinates, metres.
    pub min: Vec3,
    /// The highest coordinates, metres.
    pub max: Vec3,
}

impl LightBounds {
    /// The middle of the box.
    #[must_use]
    pub fn centre(&self) -> Vec3 {
        (self.min + self.max) * 0.5
    }

    /// Half the box's diagonal: the radius of the sphere around it, metres.
    #[must_use]
    pub fn radius_m(&self) -> f32 {
        (self.max - self.min).length() * 0.5
    }
}
