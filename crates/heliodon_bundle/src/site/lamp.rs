//! `[[light]]`: lamps, which light stone and actors beside sun and sky.

use heliodon_math::frame::unit_or;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[[light]]`: a lamp. It shines to all sides, or, where it has `look_at`, into a cone. The viewer computes its light in every frame,
/// with the shadows of stone and actors; a bake holds nothing of it. `heliodon lightmap` solves it, bounces included.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Lamp {
    /// The lamp's name, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Where it is, in the coordinates of the parts before the site's `origin` is subtracted; in a manifest, after.
    pub place: [f64; 3],
    /// What it gives: linear RGB irradiance at normal incidence one metre away (radiant intensity), in the sky's radiance unit times
    /// steradians, as the sun's irradiance. It falls with the square of the distance.
    pub intensity: [f64; 3],
    /// A point that a spot light looks at, in the coordinates of `place`. Without it the lamp shines to all sides.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub look_at: Option<[f64; 3]>,
    /// The opening of a spot light's cone, degrees.
    #[serde(default = "angle_deg")]
    #[schemars(range(min = 1, max = 170))]
    pub angle_deg: f64,
    /// The part of the cone's half angle in which the light fades towards its edge: 0 a sharp edge, 1 it fades from the middle on.
    #[serde(default = "edge")]
    #[schemars(range(min = 0, max = 1))]
    pub edge: f64,
    /// How far it reaches in the viewer, metres: there its light is faded out. In a light map it reaches however far.
    #[serde(default = "reach_m")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub reach_m: f64,
    /// Whether stone and actors cast shadows in its light in the viewer. In a light map stone does.
    #[serde(default = "shadows")]
    pub shadows: bool,
}

impl Lamp {
    /// A lamp that shines to all sides, everything else as it comes.
    #[must_use]
    pub fn at(place: [f64; 3], intensity: [f64; 3]) -> Self {
        Self {
            name: None,
            place,
            intensity,
            look_at: None,
            angle_deg: angle_deg(),
            edge: edge(),
            reach_m: reach_m(),
            shadows: shadows(),
        }
    }

    /// The unit direction in which a spot light shines; none for a lamp that shines to all sides.
    #[must_use]
    pub fn direction(&self) -> Option<glam::Vec3> {
        let along = glam::DVec3::from(self.look_at?) - glam::DVec3::from(self.place);
        Some(unit_or(along.as_vec3(), glam::Vec3::NEG_Y))
    }

    /// The lamp moved by minus the site's origin: from the site's coordinates to the bundle's.
    #[must_use]
    pub fn relative_to(&self, origin: [f64; 3]) -> Self {
        let moved = |point: [f64; 3]| [0, 1, 2].map(|axis| point[axis] - origin[axis]);
        Self { place: moved(self.place), look_at: self.look_at.map(moved), ..self.clone() }
    }
}

pub(super) fn angle_deg() -> f64 {
    60.0
}

pub(super) fn edge() -> f64 {
    0.3
}

pub(super) fn reach_m() -> f64 {
    20.0
}

fn shadows() -> bool {
    true
}
