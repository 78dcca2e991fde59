//! The sky that is lit by, and its sun.

use super::{Args, SkyName};
use anyhow::Result;
use glam::Vec3;
use heliodon_bake::sky::lapse_params;
use heliodon_bundle::site::{InputFile, Site, TimeOfDay};
use heliodon_lightmap::lights::{Amount, DirectionalSpec, Light, LightSpec, NoFiles, Photometry};
use heliodon_math::dome::{ConstantSky, Environment, LatLongSky, OvercastSky};
use heliodon_sky::civil;
use heliodon_sky::day::{self, LapseParams};

/// Half the angle that the sun subtends, degrees.
const SUN_RADIUS_DEG: f64 = 0.2665;

/// A sky.
pub struct SkyLight {
    /// For people.
    pub name: String,
    pub dome: Box<dyn Environment>,
    /// The sun, where the sky does not show it itself.
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

/// The site's own sky at a time.
fn of_site(site: &Site, files: &[InputFile], time: TimeOfDay, sharp_sun: bool) -> Result<SkyLight> {
    let at = Some(civil::TimeOfDay { seconds: time.seconds() });
    let params = LapseParams { first: at, last: at, sky_steps: 1, sun_steps: 1, ..lapse_params(site, files)? };
    let mut map = None;
    let built = day::build(&params, &mut |sky| {
        map = Some(sky.image.clone());
        Ok(())
    })?;
    let step = built.lapse.steps.first();
    let dome: Box<dyn Environment> = match map {
        Some(map) => Box::new(LatLongSky::new(map.width, map.height, map.pixels)?),
        None => Box::new(ConstantSky(Vec3::ZERO)),
    };
    let sun = step.filter(|step| !step.sun_in_map).and_then(|step| step.sun);
    let sun = sun.map(|sun| {
        let spec = DirectionalSpec {
            name: Some("the sun".to_owned()),
            direction: sun.direction.map(f64::from),
            angular_radius_deg: if sharp_sun { 0.0 } else { SUN_RADIUS_DEG },
            colour: sun.irradiance.map(f64::from),
            amount: Amount::Irradiance(1.0),
        };
        Light::new(&LightSpec::Directional(spec), Photometry::HOUSE, &NoFiles)
    });
    let mut notes: Vec<String> = built.notes.iter().map(ToString::to_string).collect();
    if sharp_sun && step.is_some_and(|step| step.sun_in_map) {
        notes.push("--sharp-sun: the sun is part of the site's probe, and as large as it is there".to_owned());
    }
    let name = format!("the site's sky at {}", step.map_or_else(String::new, |step| step.time.clone()));
    Ok(SkyLight { name, dome, sun: sun.transpose()?, notes })
}
