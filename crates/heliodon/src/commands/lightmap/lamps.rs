//! Lights of a site and of files of their own.

use anyhow::{Context, Result};
use heliodon_bake::lamps;
use heliodon_bundle::site::{Lamp, Site};
use heliodon_lightmap::lights::ies::MAX_BYTES;
use heliodon_lightmap::lights::{
    Amount, EmissiveTriangles, IesProfile, Light, LightFiles, LightSpec, Photometry, PointSpec, SpotSpec,
};
use heliodon_mesh::import::{ImportOptions, read};
use heliodon_mesh::place::Placement;
use heliodon_rays::TriangleScene;
use serde::Deserialize;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A file of lights.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct LightsFile {
    /// Lumens of one unit of white flux, for all its lights; without it the house's.
    lumens_per_unit: Option<f64>,
    #[serde(rename = "light", default)]
    lights: Vec<LightSpec>,
}

/// Files beside that of the lights, in metres and +Y up, moved by minus the site's origin.
struct Beside {
    folder: PathBuf,
    origin: [f64; 3],
}

impl LightFiles for Beside {
    fn ies(&self, file: &str) -> Result<Arc<IesProfile>, String> {
        let unread = |error: std::io::Error| format!("{error}; its name is relative to the lights' own file");
        let opened = File::open(self.folder.join(file)).map_err(unread)?;
        let mut bytes = Vec::new();
        // one more than are allowed, so that it is told
        opened.take(MAX_BYTES as u64 + 1).read_to_end(&mut bytes).map_err(unread)?;
        IesProfile::from_bytes(&bytes).map(Arc::new).map_err(|error| error.to_string())
    }

    fn mesh(&self, file: &str) -> Result<EmissiveTriangles, String> {
        // moved before it is rounded, as parts are
        let placement = Placement { origin: self.origin, ..Placement::default() };
        let options = ImportOptions { placement, ..ImportOptions::default() };
        let mesh = read(&self.folder.join(file), &options).map_err(|error| error.to_string())?;
        Ok(EmissiveTriangles { positions: mesh.positions, triangles: mesh.triangles })
    }
}

/// The lights of `site.toml` and of a file, and the files that these were read from.
///
/// # Errors
/// What is wrong with the first light that is.
pub fn lights(site: &Site, file: Option<&Path>) -> Result<(Vec<Light>, Vec<PathBuf>)> {
    let origin = site.site.origin;
    let (mut lights, mut files) = (Vec::new(), Vec::new());
    for lamp in site.lamps.iter().filter(|lamp| is_lit(lamp)) {
        let light = Light::new(&spec(lamp).relative_to(origin), Photometry::HOUSE, &heliodon_lightmap::lights::NoFiles);
        lights.push(light.with_context(|| site.path().display().to_string())?);
    }
    if let Some(file) = file {
        let name = || file.display().to_string();
        let text = std::fs::read_to_string(file).with_context(|| format!("{}: the lights cannot be read", file.display()))?;
        let found: LightsFile = toml::from_str(&text).with_context(name)?;
        let photometry = found.lumens_per_unit.map_or(Photometry::HOUSE, |lumens_per_unit| Photometry { lumens_per_unit });
        let folder = file.parent().unwrap_or(Path::new("")).to_owned();
        let beside = Beside { folder, origin };
        files.push(file.to_owned());
        for spec in &found.lights {
            lights.push(Light::new(&spec.relative_to(origin), photometry, &beside).with_context(name)?);
            files.extend(spec.file().map(|file| beside.folder.join(file)));
        }
    }
    Ok((lights, files))
}

/// Lamps that give no more of any colour are black: files of lights take no such colour, but one in `site.toml` may be off.
pub const BLACK: f64 = 1e-9;

fn is_lit(lamp: &Lamp) -> bool {
    lamp.intensity.iter().any(|&c| c > BLACK)
}

/// A line for each lamp of `[[light]]` that says what holds only where lamps are lit in every frame; one without a name is told by
/// its number, from 1.
pub fn unheeded(site: &Site) -> Vec<String> {
    let told = |(index, lamp): (usize, &Lamp)| {
        let shadows = (!lamp.shadows).then(|| "shadows = false (in a light map it casts them)".to_owned());
        let is_own = lamp.reach_m != Lamp::at(lamp.place, lamp.intensity).reach_m;
        let reach = is_own.then(|| format!("reach_m = {} (in a light map it reaches however far)", lamp.reach_m));
        let said: Vec<String> = shadows.into_iter().chain(reach).filter(|_| is_lit(lamp)).collect();
        let name = lamp.name.clone().unwrap_or_else(|| (index + 1).to_string());
        (!said.is_empty()).then(|| format!("light {name}: {} is for the viewer alone", said.join(" and ")))
    };
    site.lamps.iter().enumerate().filter_map(told).collect()
}

/// A lamp of `[[light]]`, as it is baked: with the square of the distance, however far it reaches.
fn spec(lamp: &Lamp) -> LightSpec {
    let (name, place, colour) = (lamp.name.clone(), lamp.place, lamp.intensity);
    let amount = Amount::RadiantIntensity(1.0);
    match lamp.look_at {
        None => LightSpec::Point(PointSpec { name, place, colour, amount }),
        Some(look_at) => {
            LightSpec::Spot(SpotSpec { name, place, look_at, angle_deg: lamp.angle_deg, edge: lamp.edge, colour, amount })
        }
    }
}

/// A warning for each lamp of which no place is found that lies outside of all that is closed.
pub fn inside_something(lights: &[Light], rays: &TriangleScene) -> Vec<String> {
    // a pane may lie on a wall, and a mesh that shines may be a part as well
    let before_m = rays.start_offset();
    let is_inside = |light: &&Light| {
        let places = light.places(before_m);
        !places.is_empty() && places.into_iter().all(|place| lamps::is_enclosed(place, rays))
    };
    lights.iter().filter(is_inside).map(|light| lamps::doubt(light.title())).collect()
}
