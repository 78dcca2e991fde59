//! The sky that is lit by, and its sun.

use super::lamps::BLACK;
use super::{Args, SkyName};
use crate::failure::wrong_arguments;
use anyhow::Result;
use glam::Vec3;
use heliodon_bake::sky::lapse_params;
use heliodon_bundle::site::{InputFile, Site, TimeOfDay};
use heliodon_lightmap::lights::{Amount, DirectionalSpec, Light, LightSpec, NoFiles, Photometry};
use heliodon_math::dome::{ConstantSky, Environment, LatLongSky, OvercastSky};
use heliodon_sky::civil;
use heliodon_sky::day::{self, SkySource};

/// Half the angle that the sun subtends, degrees.
const SUN_RADIUS_DEG: f64 = 0.2665;

/// A sky.
pub struct SkyLight {
    /// For people.
    pub name: String,
    pub dome: Box<dyn Environment>,
    /// The sun, which the sky does not show itself.
    pub sun: Option<Light>,
    /// What the maker of the site should know.
    pub notes: Vec<String>,
}

/// The sky of a name, as it was asked for.
///
/// # Errors
/// Probes that cannot be read, and a sky that cannot be made.
pub fn light(site: &Site, files: &[InputFile], name: SkyName, args: &Args) -> Result<SkyLight> {
    let radiance = Vec3::splat(args.radiance.unwrap_or(1.0) as f32);
    let plain = |name: &str, dome: Box<dyn Environment>| SkyLight { name: name.to_owned(), dome, sun: None, notes: Vec::new() };
    match name {
        SkyName::None => Ok(plain("no sky", Box::new(ConstantSky(Vec3::ZERO)))),
        SkyName::Even => Ok(plain("an even sky", Box::new(ConstantSky(radiance)))),
        SkyName::Overcast => Ok(plain("an overcast sky", Box::new(OvercastSky { zenith: radiance }))),
        SkyName::Site => of_site(site, files, args.time.unwrap_or(TimeOfDay::NOON), args.sharp_sun),
    }
}

/// Refuses a time where the site's own sky has none.
///
/// # Errors
/// That, and probes of which the times are not known.
pub fn check(site: &Site, files: &[InputFile], name: SkyName, args: &Args) -> Result<()> {
    if name != SkyName::Site || args.time.is_none() {
        return Ok(());
    }
    if let SkySource::Probes(series) = lapse_params(site, files)?.source
        && series.is_single()
    {
        wrong_arguments!("--time does nothing: the site's only probe stands for all times; leave it out");
    }
    Ok(())
}

/// The site's own sky at a time.
fn of_site(site: &Site, files: &[InputFile], time: TimeOfDay, sharp_sun: bool) -> Result<SkyLight> {
    let at = day::sky_at(&lapse_params(site, files)?, civil::TimeOfDay { seconds: time.seconds() })?;
    let dome = Box::new(LatLongSky::new(at.map.width, at.map.height, at.map.pixels)?);
    let sun = at.sun.map(|sun| (sun.direction.map(f64::from), sun.irradiance.map(f64::from)));
    // a site may say that a clipped sun gives nothing
    let sun = sun.filter(|(_, irradiance)| irradiance.iter().any(|&c| c > BLACK));
    let sun = sun.map(|(direction, colour)| {
        let spec = DirectionalSpec {
            name: Some("the sun".to_owned()),
            direction,
            angular_radius_deg: if sharp_sun { 0.0 } else { SUN_RADIUS_DEG },
            colour,
            amount: Amount::Irradiance(1.0),
        };
        Light::new(&LightSpec::Directional(spec), Photometry::HOUSE, &NoFiles)
    });
    let mut notes: Vec<String> = at.notes.iter().map(ToString::to_string).collect();
    if sharp_sun && sun.is_none() {
        notes.push("--sharp-sun does nothing: the site's sky has no sun then".to_owned());
    }
    Ok(SkyLight { name: format!("the site's sky at {}", at.time), dome, sun: sun.transpose()?, notes })
}
