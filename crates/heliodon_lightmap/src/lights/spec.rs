//! Lights as a site file describes them.
//!
//! Names and defaults are those of `[[light]]` where it has them (`place`, `look_at`, `angle_deg`, `edge`), so a lamp that the viewer
//! lights in every frame and one that is baked are written alike and fall off alike.

use crate::lights::error::LightSpecError;
use crate::lights::units::{Amount, Quantity};
use serde::{Deserialize, Serialize};

/// One light of a site; in TOML the table's `kind` says which.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum LightSpec {
    /// A point that shines to all sides.
    Point(PointSpec),
    /// A point that shines into a cone.
    Spot(SpotSpec),
    /// A point that shines as an IES LM-63 file says.
    Ies(IesSpec),
    /// Light from infinitely far away: a sun.
    Directional(DirectionalSpec),
    /// A rectangle that shines: a window, a panel.
    Rectangle(RectangleSpec),
    /// A disc that shines.
    Disc(DiscSpec),
    /// Triangles that shine.
    Mesh(MeshSpec),
}

/// A point that shines to all sides alike, with the inverse square of the distance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointSpec {
    /// The light's name, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Where it is, metres.
    pub place: [f64; 3],
    /// Its colour, linear Rec. 709, not negative; only its tint counts where the amount is photometric.
    #[serde(default = "white")]
    pub colour: [f64; 3],
    /// Flux or intensity.
    pub amount: Amount,
}

/// A point that shines into a cone, with the inverse square of the distance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpotSpec {
    /// The light's name, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Where it is, metres.
    pub place: [f64; 3],
    /// The point on the cone's axis that it looks at, metres.
    pub look_at: [f64; 3],
    /// The opening of the outer cone, degrees, greater than 0 and at most 360.
    #[serde(default = "angle_deg")]
    pub angle_deg: f64,
    /// The part of the outer cone's half angle in which the light fades: the inner cone's half angle is `(1 - edge)` times the
    /// outer's. 0 a sharp edge, 1 it fades from the axis on.
    #[serde(default = "edge")]
    pub edge: f64,
    /// Its colour, linear Rec. 709, not negative; only its tint counts where the amount is photometric.
    #[serde(default = "white")]
    pub colour: [f64; 3],
    /// Flux of the whole cone, or intensity within the inner cone.
    pub amount: Amount,
}

/// A luminaire with the measured distribution of an IES LM-63 file, taken as a point: right from about five times its size on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IesSpec {
    /// The light's name, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The IES file.
    pub file: String,
    /// Where the photometric centre is, metres.
    pub place: [f64; 3],
    /// The point that the luminaire's nadir (vertical angle 0) looks at, metres; straight down without it. The luminaire is tilted there
    /// by the shortest way.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub look_at: Option<[f64; 3]>,
    /// Turns the luminaire about its own vertical axis before it is tilted, degrees, counterclockwise seen from above. At 0 the
    /// file's horizontal angle 0 lies east (+X) and 90 lies north (-Z).
    #[serde(default)]
    pub turn_deg: f64,
    /// Its colour, linear Rec. 709, not negative; only its tint counts where the amount is photometric.
    #[serde(default = "white")]
    pub colour: [f64; 3],
    /// Flux, or the highest intensity, instead of what the file says; the distribution stays.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub amount: Option<Amount>,
    /// A further factor: a dimmer, or dirt (the light loss factor). 0 or more.
    #[serde(default = "one")]
    pub factor: f64,
}

/// Light from infinitely far away, of the same strength everywhere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DirectionalSpec {
    /// The light's name, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// From the surface to the light, of any length but zero.
    pub direction: [f64; 3],
    /// Half the angle that its disc of uniform radiance subtends, degrees, 0 to 80: 0 gives sharp shadows, the sun has 0.2665.
    #[serde(default)]
    pub angular_radius_deg: f64,
    /// Its colour, linear Rec. 709, not negative; only its tint counts where the amount is photometric.
    #[serde(default = "white")]
    pub colour: [f64; 3],
    /// Illuminance or irradiance at normal incidence; with an angular radius also luminance or radiance.
    pub amount: Amount,
}

/// A rectangle of uniform radiance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RectangleSpec {
    /// The light's name, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Lower left, lower right and upper left corner seen from the side that it shines to, metres: as a room's windows seen from inside.
    pub corners: [[f64; 3]; 3],
    /// Whether it shines to both sides.
    #[serde(default)]
    pub two_sided: bool,
    /// Its colour, linear Rec. 709, not negative; only its tint counts where the amount is photometric.
    #[serde(default = "white")]
    pub colour: [f64; 3],
    /// Flux (of both sides together), luminance or radiance, or intensity along the normal.
    pub amount: Amount,
}

/// A disc of uniform radiance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DiscSpec {
    /// The light's name, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Its centre, metres.
    pub place: [f64; 3],
    /// A point on its axis on the side that it shines to, metres.
    pub look_at: [f64; 3],
    /// Its radius, metres, greater than 0.
    pub radius_m: f64,
    /// Whether it shines to both sides.
    #[serde(default)]
    pub two_sided: bool,
    /// Its colour, linear Rec. 709, not negative; only its tint counts where the amount is photometric.
    #[serde(default = "white")]
    pub colour: [f64; 3],
    /// Flux (of both sides together), luminance or radiance, or intensity along the normal.
    pub amount: Amount,
}

/// Triangles of uniform radiance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshSpec {
    /// The light's name, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The mesh's file.
    pub file: String,
    /// Whether triangles shine to both sides; else to that from which their corners go counterclockwise.
    #[serde(default)]
    pub two_sided: bool,
    /// Its colour, linear Rec. 709, not negative; only its tint counts where the amount is photometric.
    #[serde(default = "white")]
    pub colour: [f64; 3],
    /// Flux (of all triangles and sides together), luminance or radiance.
    pub amount: Amount,
}

fn white() -> [f64; 3] {
    [1.0; 3]
}

fn one() -> f64 {
    1.0
}

fn angle_deg() -> f64 {
    60.0
}

fn edge() -> f64 {
    0.3
}

/// What one of the units is told of, for messages.
const FLUX_OR_INTENSITY: &str = "flux_lm, intensity_cd, radiant_flux or radiant_intensity";
const AT_NORMAL_INCIDENCE: &str =
    "illuminance_lx or irradiance at normal incidence, or with angular_radius_deg above 0 as luminance_cd_m2 or radiance";
const OF_A_FLAT: &str = "flux_lm, luminance_cd_m2, intensity_cd, radiant_flux, radiance or radiant_intensity";
const OF_A_MESH: &str = "flux_lm, luminance_cd_m2, radiant_flux or radiance";

impl LightSpec {
    /// The light's name in quotes, or its kind where it has none: for messages.
    #[must_use]
    pub fn title(&self) -> String {
        self.name().map_or_else(|| format!("of kind {}", self.kind()), |name| format!("{name:?}"))
    }

    /// Its name, if it has one.
    #[must_use]
    pub fn name(&self) -> Option<&str> {
        match self {
            Self::Point(s) => s.name.as_deref(),
            Self::Spot(s) => s.name.as_deref(),
            Self::Ies(s) => s.name.as_deref(),
            Self::Directional(s) => s.name.as_deref(),
            Self::Rectangle(s) => s.name.as_deref(),
            Self::Disc(s) => s.name.as_deref(),
            Self::Mesh(s) => s.name.as_deref(),
        }
    }

    /// Its kind as a site file names it.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Point(_) => "point",
            Self::Spot(_) => "spot",
            Self::Ies(_) => "ies",
            Self::Directional(_) => "directional",
            Self::Rectangle(_) => "rectangle",
            Self::Disc(_) => "disc",
            Self::Mesh(_) => "mesh",
        }
    }

    /// The file that it needs, if any.
    #[must_use]
    pub fn file(&self) -> Option<&str> {
        match self {
            Self::Ies(s) => Some(&s.file),
            Self::Mesh(s) => Some(&s.file),
            _ => None,
        }
    }

    /// The light moved by minus a site's origin (metres), as the site's parts are; directions and meshes' files stay.
    #[must_use]
    pub fn relative_to(&self, origin: [f64; 3]) -> Self {
        let moved = |point: &mut [f64; 3]| *point = [0, 1, 2].map(|axis| point[axis] - origin[axis]);
        let mut spec = self.clone();
        match &mut spec {
            Self::Point(s) => moved(&mut s.place),
            Self::Spot(s) => {
                moved(&mut s.place);
                moved(&mut s.look_at);
            }
            Self::Ies(s) => {
                moved(&mut s.place);
                s.look_at.iter_mut().for_each(moved);
            }
            Self::Rectangle(s) => s.corners.iter_mut().for_each(moved),
            Self::Disc(s) => {
                moved(&mut s.place);
                moved(&mut s.look_at);
            }
            Self::Directional(_) | Self::Mesh(_) => {}
        }
        spec
    }

    /// Whether every number lies in its range and the amount is in a unit that this kind of light has. What a file holds is not looked at.
    ///
    /// # Errors
    /// The first thing that is wrong, with the field's name and what is allowed.
    pub fn validate(&self) -> Result<(), LightSpecError> {
        let check = Check { spec: self };
        let (colour, amount) = match self {
            Self::Point(s) => (s.colour, Some(s.amount)),
            Self::Spot(s) => (s.colour, Some(s.amount)),
            Self::Ies(s) => (s.colour, s.amount),
            Self::Directional(s) => (s.colour, Some(s.amount)),
            Self::Rectangle(s) => (s.colour, Some(s.amount)),
            Self::Disc(s) => (s.colour, Some(s.amount)),
            Self::Mesh(s) => (s.colour, Some(s.amount)),
        };
        check.colour(colour)?;
        if let Some(amount) = amount {
            check.amount(amount)?;
        }
        match self {
            Self::Point(s) => check.point("place", s.place),
            Self::Spot(s) => {
                check.axis(s.place, s.look_at)?;
                check.range("angle_deg", s.angle_deg, s.angle_deg > 0.0 && s.angle_deg <= 360.0, "above 0 and at most 360")?;
                check.range("edge", s.edge, (0.0..=1.0).contains(&s.edge), "between 0 and 1")
            }
            Self::Ies(s) => {
                check.point("place", s.place)?;
                if let Some(look_at) = s.look_at {
                    check.axis(s.place, look_at)?;
                }
                check.range("turn_deg", s.turn_deg, s.turn_deg.abs() <= 3600.0, "between -3600 and 3600")?;
                check.range("factor", s.factor, s.factor.is_finite() && s.factor >= 0.0, "a finite number, 0 or more")
            }
            Self::Directional(s) => {
                check.points("direction", &[s.direction], "finite and not zero", |[d]| length(d) > 0.0)?;
                let radius = s.angular_radius_deg;
                check.range("angular_radius_deg", radius, (0.0..=80.0).contains(&radius), "between 0 and 80")
            }
            Self::Rectangle(s) => check.rectangle(s.corners),
            Self::Disc(s) => {
                check.axis(s.place, s.look_at)?;
                check.range("radius_m", s.radius_m, s.radius_m > 0.0 && s.radius_m <= FARTHEST_M, "above 0 and at most 1e9")
            }
            Self::Mesh(_) => Ok(()),
        }
    }
}

/// Places beyond a million kilometres are a slip: squares of their distances would leave single precision.
const FARTHEST_M: f64 = 1e9;

/// The most that the corner of a rectangle may differ from a right angle (radians) before it counts as another shape.
const SQUARE_RAD: f64 = 2e-3;

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| a[axis] - b[axis])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

/// Checks that name the light.
struct Check<'a> {
    spec: &'a LightSpec,
}

impl Check<'_> {
    fn bad(&self, field: &'static str, value: String, allowed: &'static str) -> Result<(), LightSpecError> {
        Err(LightSpecError::Field { light: self.spec.title(), field, value, allowed })
    }

    /// `holds` is false for what is not a number.
    fn range(&self, field: &'static str, value: f64, holds: bool, allowed: &'static str) -> Result<(), LightSpecError> {
        if holds { Ok(()) } else { self.bad(field, value.to_string(), allowed) }
    }

    fn points<const N: usize>(
        &self,
        field: &'static str,
        points: &[[f64; 3]; N],
        allowed: &'static str,
        holds: impl Fn([[f64; 3]; N]) -> bool,
    ) -> Result<(), LightSpecError> {
        let in_range = points.as_flattened().iter().all(|x| x.abs() <= FARTHEST_M);
        if in_range && holds(*points) { Ok(()) } else { self.bad(field, format!("{points:?}"), allowed) }
    }

    fn point(&self, field: &'static str, point: [f64; 3]) -> Result<(), LightSpecError> {
        self.points(field, &[point], "finite, within 1e9 metres of the origin", |_| true)
    }

    fn axis(&self, place: [f64; 3], look_at: [f64; 3]) -> Result<(), LightSpecError> {
        self.point("place", place)?;
        self.points("look_at", &[look_at], "finite, and another point than place", |[to]| length(minus(to, place)) > 0.0)
    }

    fn rectangle(&self, corners: [[f64; 3]; 3]) -> Result<(), LightSpecError> {
        let sides = |[a, b, c]: [[f64; 3]; 3]| (minus(b, a), minus(c, a));
        self.points(
            "corners",
            &corners,
            "finite and three different points: lower left, lower right, upper left",
            |corners| {
                let (x, y) = sides(corners);
                length(x) > 0.0 && length(y) > 0.0
            },
        )?;
        let right_angle = "the lower left, lower right and upper left corner of a rectangle, with a right angle at the first";
        self.points("corners", &corners, right_angle, |corners| {
            let (x, y) = sides(corners);
            dot(x, y).abs() <= SQUARE_RAD * length(x) * length(y)
        })
    }

    fn colour(&self, colour: [f64; 3]) -> Result<(), LightSpecError> {
        let holds = colour.iter().all(|&x| (0.0..=1e9).contains(&x)) && colour.iter().any(|&x| x > 1e-9);
        let allowed = "three numbers from 0 to 1e9 (linear red, green, blue), not all 0";
        if holds { Ok(()) } else { self.bad("colour", format!("{colour:?}"), allowed) }
    }

    fn amount(&self, amount: Amount) -> Result<(), LightSpecError> {
        let value = amount.value();
        self.range(amount.unit(), value, (0.0..=1e15).contains(&value), "a number from 0 to 1e15")?;
        use Quantity::{Flux, Intensity, Irradiance, Radiance};
        let quantity = amount.quantity();
        let (fits, allowed) = match self.spec {
            LightSpec::Point(_) | LightSpec::Spot(_) | LightSpec::Ies(_) => {
                (matches!(quantity, Flux | Intensity), FLUX_OR_INTENSITY)
            }
            LightSpec::Directional(s) => {
                (quantity == Irradiance || (quantity == Radiance && s.angular_radius_deg > 0.0), AT_NORMAL_INCIDENCE)
            }
            LightSpec::Rectangle(_) | LightSpec::Disc(_) => (quantity != Irradiance, OF_A_FLAT),
            LightSpec::Mesh(_) => (matches!(quantity, Flux | Radiance), OF_A_MESH),
        };
        if fits {
            return Ok(());
        }
        Err(LightSpecError::Unit { light: self.spec.title(), kind: self.spec.kind(), unit: amount.unit(), allowed })
    }
}
