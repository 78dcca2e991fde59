//! From a light's description to the light.

use crate::lights::directional::Directional;
use crate::lights::disc::Disc;
use crate::lights::error::LightSpecError;
use crate::lights::ies::IesProfile;
use crate::lights::light::{Light, Source};
use crate::lights::local::{Cone, Local, Luminaire, Shape};
use crate::lights::mesh::{EmissiveTriangles, Mesh};
use crate::lights::rectangle::Rectangle;
use crate::lights::spec::{DirectionalSpec, DiscSpec, IesSpec, LightSpec, MeshSpec, RectangleSpec, SpotSpec};
use crate::lights::units::{Amount, Photometry, Quantity};
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;

/// Where lights find the files that they name: the solver itself opens none. Messages say what is wrong with the file and what to do.
pub trait LightFiles {
    /// The photometry of an IES file.
    ///
    /// # Errors
    /// Why there is none.
    fn ies(&self, file: &str) -> Result<Arc<IesProfile>, String>;

    /// The triangles of a mesh, in the coordinates of the scene.
    ///
    /// # Errors
    /// Why there are none.
    fn mesh(&self, file: &str) -> Result<EmissiveTriangles, String>;
}

/// No files: for lights that name none.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoFiles;

impl LightFiles for NoFiles {
    fn ies(&self, _file: &str) -> Result<Arc<IesProfile>, String> {
        Err("no files are read here".to_owned())
    }

    fn mesh(&self, _file: &str) -> Result<EmissiveTriangles, String> {
        Err("no files are read here".to_owned())
    }
}

impl Light {
    /// A light from its description, in the coordinates that the description is in.
    ///
    /// # Errors
    /// What [`LightSpec::validate`] finds, files that cannot be used, and light beyond single precision.
    pub fn new(spec: &LightSpec, photometry: Photometry, files: &dyn LightFiles) -> Result<Self, LightSpecError> {
        spec.validate()?;
        let bad = |field, value: String, allowed| LightSpecError::Field { light: spec.title(), field, value, allowed };
        let per_unit = photometry.lumens_per_unit;
        if !(1e-6..=1e9).contains(&per_unit) {
            return Err(bad("lumens_per_unit", per_unit.to_string(), "between 1e-6 and 1e9"));
        }
        let in_file = |file: &str, message| LightSpecError::File { light: spec.title(), file: file.to_owned(), message };
        let no_shape = |field| bad(field, "too small or too near another point".to_owned(), "larger than rounding");
        let (source, strength) = match spec {
            LightSpec::Point(s) => point(s.place, Shape::Even, s.colour, s.amount, photometry),
            LightSpec::Spot(s) => {
                let shape = Shape::Cone(cone(s).ok_or_else(|| no_shape("look_at"))?);
                point(s.place, shape, s.colour, s.amount, photometry)
            }
            LightSpec::Ies(s) => {
                let profile = files.ies(&s.file).map_err(|message| in_file(&s.file, message))?;
                let luminaire = luminaire(s, profile).ok_or_else(|| no_shape("look_at"))?;
                let dark = s.amount.is_some() && luminaire.profile.flux_lm() * luminaire.factor <= 0.0;
                if dark {
                    return Err(in_file(&s.file, "gives no light that an amount could scale: leave amount out".to_owned()));
                }
                measured(s, luminaire, photometry)
            }
            LightSpec::Directional(s) => directional(s, photometry).ok_or_else(|| no_shape("direction"))?,
            LightSpec::Rectangle(s) => rectangle(s, photometry).ok_or_else(|| no_shape("corners"))?,
            LightSpec::Disc(s) => disc(s, photometry).ok_or_else(|| no_shape("look_at"))?,
            LightSpec::Mesh(s) => {
                let triangles = files.mesh(&s.file).map_err(|message| in_file(&s.file, message))?;
                let light = Mesh::new(triangles, s.two_sided).map_err(|message| in_file(&s.file, message))?;
                mesh(s, light, photometry)
            }
        };
        // the cube of the largest number that is still told from the next: what follows multiplies it by squares
        let in_range = strength.is_finite() && strength.max_element() <= 1e30;
        if !in_range {
            return Err(bad("amount", strength.max_element().to_string(), "at most 1e30 for the size and colour of the light"));
        }
        Ok(Self::of(spec.title(), source))
    }
}

type Made = (Source, DVec3);

fn point(place: [f64; 3], shape: Shape, colour: [f64; 3], amount: Amount, photometry: Photometry) -> Made {
    let light = Local { place: place.into(), shape };
    let rgb = photometry.rgb(colour, amount);
    let intensity = if amount.quantity() == Quantity::Flux { rgb / light.solid_angle() } else { rgb };
    (Source::Local { light, intensity }, intensity)
}

fn cone(s: &SpotSpec) -> Option<Cone> {
    let axis = (DVec3::from(s.look_at) - DVec3::from(s.place)).try_normalize()?;
    let outer_rad = (0.5 * s.angle_deg).to_radians();
    Some(Cone::new(axis, outer_rad * (1.0 - s.edge), outer_rad))
}

fn luminaire(s: &IesSpec, profile: Arc<IesProfile>) -> Option<Luminaire> {
    let aim = s.look_at.map_or(Some(DVec3::NEG_Y), |at| (DVec3::from(at) - DVec3::from(s.place)).try_normalize())?;
    Some(Luminaire::new(profile, aim, s.turn_deg.to_radians()))
}

fn measured(s: &IesSpec, luminaire: Luminaire, photometry: Photometry) -> Made {
    let highest = luminaire.profile.highest_cd() * luminaire.factor;
    let light = Local { place: s.place.into(), shape: Shape::Luminaire(luminaire) };
    // the light of one of the file's candelas
    let per_candela = match s.amount {
        None => photometry.rgb(s.colour, Amount::IntensityCd(1.0)),
        Some(amount) => {
            let whole = if amount.quantity() == Quantity::Flux { light.solid_angle() } else { highest };
            photometry.rgb(s.colour, amount) / whole
        }
    };
    let intensity = per_candela * s.factor;
    (Source::Local { light, intensity }, intensity * highest)
}

fn directional(s: &DirectionalSpec, photometry: Photometry) -> Option<Made> {
    let light = Directional::new(DVec3::from(s.direction).try_normalize()?, s.angular_radius_deg.to_radians());
    let rgb = photometry.rgb(s.colour, s.amount);
    let irradiance = if s.amount.quantity() == Quantity::Radiance { rgb * light.normal_irradiance() } else { rgb };
    let highest = if light.is_sharp() { irradiance } else { irradiance / light.normal_irradiance() };
    Some((Source::Directional { light, irradiance }, highest))
}

/// Radiance of a surface from whatever was given.
fn radiance(colour: [f64; 3], amount: Amount, area: f64, two_sided: bool, photometry: Photometry) -> DVec3 {
    let rgb = photometry.rgb(colour, amount);
    match amount.quantity() {
        Quantity::Flux => rgb / (PI * area * if two_sided { 2.0 } else { 1.0 }),
        Quantity::Intensity => rgb / area,
        Quantity::Radiance | Quantity::Irradiance => rgb,
    }
}

fn rectangle(s: &RectangleSpec, photometry: Photometry) -> Option<Made> {
    let [corner, right, top] = s.corners.map(DVec3::from);
    let light = Rectangle::new(corner, right - corner, top - corner)?;
    let radiance = radiance(s.colour, s.amount, light.area(), s.two_sided, photometry);
    Some((Source::Rectangle { light, radiance, two_sided: s.two_sided }, radiance))
}

fn disc(s: &DiscSpec, photometry: Photometry) -> Option<Made> {
    let centre = DVec3::from(s.place);
    let light = Disc::new(centre, (DVec3::from(s.look_at) - centre).try_normalize()?, s.radius_m)?;
    let radiance = radiance(s.colour, s.amount, light.area(), s.two_sided, photometry);
    Some((Source::Disc { light, radiance, two_sided: s.two_sided }, radiance))
}

fn mesh(s: &MeshSpec, light: Mesh, photometry: Photometry) -> Made {
    let radiance = radiance(s.colour, s.amount, light.area(), s.two_sided, photometry);
    (Source::Mesh { light, radiance, two_sided: s.two_sided }, radiance)
}
