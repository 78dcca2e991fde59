//! What a project of photographs says of the light that they were taken in.

use super::{HourSky, ProbeLook};
use glam::{DVec2, Vec3};
use heliodon_mesh::Mesh;
use heliodon_mesh::import::{ImportError, ImportOptions};
use heliodon_photo::albedo::KnownAlbedo;
use heliodon_photo::camera::Camera;
use heliodon_photo::exif::PhotoFacts;
use heliodon_photo::project::{Project, SkyEntry, Taken, Toward, utc_offset_hours};
use heliodon_photo::texture::Survey;
use heliodon_rays::{Hit, Ray};
use heliodon_sky::SkyError;
use heliodon_sky::civil::{Date, TimeOfDay};
use heliodon_sky::mapping::{BelowHorizon, Mapping};
use heliodon_sky::model::{ModelKind, ModelParams, ModelSky};
use heliodon_sky::solar::Place;
use std::collections::BTreeSet;

/// Why nothing is known of the light.
#[derive(Debug, thiserror::Error)]
pub enum PhotoLightError {
    /// Something that the project does not say.
    #[error("{0}")]
    Missing(String),
    /// The sky cannot be made.
    #[error(transparent)]
    Sky(#[from] SkyError),
    /// What stands about cannot be read.
    #[error(transparent)]
    Mesh(#[from] ImportError),
}

/// The light of a project's photographs.
#[derive(Clone, Debug, Default)]
pub struct ProjectLight {
    /// Suns and skies.
    pub hours: Vec<HourSky>,
    /// What each is called: its day and time, or its probe.
    pub names: Vec<String>,
    /// For each photograph which of them; `None` where nothing is known of its hour.
    pub hour_of: Vec<Option<usize>>,
    /// What is missing or odd, in words.
    pub notes: Vec<String>,
}

/// An hour before its sky is made.
#[derive(Clone, Debug, PartialEq)]
enum Hour {
    Probe(String),
    Model { date: Date, time: TimeOfDay, offset_hours: f64, place_deg: [f64; 2] },
}

impl ProjectLight {
    /// The light of the photographs of these names.
    ///
    /// # Errors
    /// Where no photograph's hour is known, nobody says where north is, or a sky cannot be made.
    pub fn of(project: &Project, photographs: &[&str]) -> Result<Self, PhotoLightError> {
        let mut found = Self::default();
        let sky = project.file.sky.clone().unwrap_or_default();
        let mut hours: Vec<Hour> = Vec::new();
        for name in photographs {
            match hour(project, &sky, name) {
                Ok(hour) => {
                    let at = hours.iter().position(|other| *other == hour).unwrap_or_else(|| {
                        hours.push(hour);
                        hours.len() - 1
                    });
                    found.hour_of.push(Some(at));
                }
                Err(why) => {
                    found.notes.push(format!("{name} is left out: {why}"));
                    found.hour_of.push(None);
                }
            }
        }
        if hours.is_empty() {
            let why = found.notes.first().map_or("there is no photograph with a camera", String::as_str);
            return Err(PhotoLightError::Missing(format!("the light of no photograph is known: {why}")));
        }
        if sky.north_deg.is_none() && !says_north(project) {
            return Err(PhotoLightError::Missing(
                "nobody says where north is, and so where the sun stands: add a [[direction]] toward north, or north_deg to [sky]".into(),
            ));
        }
        let model = if hours.iter().any(|hour| matches!(hour, Hour::Model { .. })) { Some(model(&sky)?) } else { None };
        let north_deg = sky.north_deg.unwrap_or(0.0);
        for hour in &hours {
            match (hour, &model) {
                (Hour::Model { date, time, offset_hours, place_deg: [latitude_deg, longitude_deg] }, Some(model)) => {
                    let place = Place {
                        latitude_deg: *latitude_deg,
                        longitude_deg: *longitude_deg,
                        utc_offset_hours: *offset_hours,
                        north_deg,
                    };
                    let of_hour = HourSky::of_model(model, &place, *date, *time)?;
                    if of_hour.sun.is_none() {
                        found
                            .notes
                            .push(format!("{date} {time}: the sun is below the horizon; are time and utc_offset right?"));
                    }
                    found.hours.push(of_hour);
                    found.names.push(format!("{date} {time}"));
                }
                (Hour::Probe(file), _) => {
                    found.hours.push(HourSky::of_probe(&project.folder().join(file), &look(&sky, north_deg)?)?);
                    found.names.push(file.clone());
                }
                (Hour::Model { .. }, None) => {}
            }
        }
        Ok(found)
    }
}

fn hour(project: &Project, sky: &SkyEntry, name: &str) -> Result<Hour, String> {
    let entry = project.file.photo.iter().find(|entry| entry.name() == name);
    let entry = entry.ok_or("it is no photograph of the project")?;
    if let Some(probe) = &entry.probe {
        return Ok(Hour::Probe(probe.clone()));
    }
    let facts = PhotoFacts::read(&project.folder().join(&entry.file));
    let Taken { date, time, utc_offset_hours: of_photo } =
        project.taken(name, &facts).ok_or("nothing says when it was taken; add time = \"YYYY-MM-DD HH:MM\", or probe")?;
    let place_deg = match (sky.latitude_deg, sky.longitude_deg, facts.place_deg) {
        (Some(latitude), Some(longitude), _) => [latitude, longitude],
        (_, _, Some(place)) => place,
        _ => return Err("nothing says where it was taken; add latitude_deg and longitude_deg to [sky]".into()),
    };
    let offset_hours = match &sky.utc_offset {
        Some(offset) => utc_offset_hours(offset)?,
        None => of_photo.ok_or("nothing says by which clock; add utc_offset = \"+HH:MM\" to [sky]")?,
    };
    Ok(Hour::Model { date, time, offset_hours, place_deg })
}

/// Whether the project's own frame knows the compass.
fn says_north(project: &Project) -> bool {
    let level = |toward: Toward| !matches!(toward, Toward::Up | Toward::Down);
    let known = project.file.point.iter().filter(|point| point.known_m.is_some()).count();
    // three known points, not on a line, hold a frame
    project.file.direction.iter().any(|direction| level(direction.toward)) || known >= 3
}

fn model(sky: &SkyEntry) -> Result<ModelSky, SkyError> {
    let base = ModelParams::default();
    ModelSky::new(&ModelParams {
        kind: sky.model.as_deref().map_or(Ok(ModelKind::default()), ModelKind::from_name)?,
        turbidity: sky.turbidity.unwrap_or(base.turbidity),
        ground_albedo: sky.ground_albedo.map_or(base.ground_albedo, Vec3::from),
    })
}

fn look(sky: &SkyEntry, north_deg: f64) -> Result<ProbeLook, SkyError> {
    Ok(ProbeLook {
        mapping: Mapping::from_name(sky.mapping.as_deref().unwrap_or("lat-long"), sky.opening_deg)?,
        turn_deg: sky.turn_deg.unwrap_or(0.0) - north_deg,
        below_horizon: BelowHorizon::from_name(sky.below_horizon.as_deref().unwrap_or("keep"))?,
        sun_irradiance: sky.sun_irradiance.map(Vec3::from),
    })
}

/// Reads what stands about the model.
///
/// # Errors
/// A mesh that cannot be read.
pub fn surroundings(project: &Project) -> Result<Vec<Mesh>, PhotoLightError> {
    let read = |entry: &heliodon_photo::project::AroundEntry| {
        let mut mesh = heliodon_mesh::import::read(&project.folder().join(&entry.file), &ImportOptions::default())?;
        if let Some(albedo) = entry.albedo {
            mesh.colors_linear = vec![Vec3::from(albedo); mesh.positions.len()];
            mesh.materials.clear();
            mesh.triangle_material.clear();
            mesh.uvs.clear();
        }
        Ok(mesh)
    };
    project.file.around.iter().map(read).collect()
}

/// Pixels about a grey place that are looked at without a word of the project.
const GREY_RADIUS_PX: f64 = 2.0;

/// The texels of a survey that show what `[[grey]]` knows; `photographs` are the survey's. What shows nothing of the model is told in words.
#[must_use]
pub fn known_albedo(project: &Project, survey: &Survey, photographs: &[(String, Camera)]) -> (Vec<KnownAlbedo>, Vec<String>) {
    let index = survey.index();
    let (mut known, mut notes) = (Vec::new(), Vec::new());
    for grey in &project.file.grey {
        let Some(photograph) = photographs.iter().position(|(name, _)| *name == grey.photo) else {
            notes.push(format!("the grey place in {} is not used: that photograph has no camera, or no hour", grey.photo));
            continue;
        };
        let camera = &photographs[photograph].1;
        let radius = grey.radius_px.unwrap_or(GREY_RADIUS_PX);
        let reach = radius.min(1000.0).floor() as i32;
        let steps = || -reach..=reach;
        let offsets = steps().flat_map(|dy| steps().map(move |dx| DVec2::new(f64::from(dx), f64::from(dy))));
        let rays: Vec<Ray> = offsets
            .filter(|offset| offset.length() <= radius)
            .map(|offset| {
                let (origin, direction) = camera.ray(DVec2::from(grey.at) + offset);
                Ray { origin: origin.as_vec3(), direction: direction.as_vec3(), t_min: 0.0, t_max: f32::INFINITY }
            })
            .collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        survey.scene().closest(&rays, &mut hits);
        let texels: BTreeSet<usize> =
            hits.iter().filter(|hit| hit.is_some()).filter_map(|hit| index.texel(hit.triangle, hit.u, hit.v)).collect();
        if texels.is_empty() {
            notes.push(format!("the grey place in {} at {:?} shows nothing of the model", grey.photo, grey.at));
        }
        let albedo = Vec3::from(grey.albedo.rgb());
        known.extend(texels.into_iter().map(|texel| KnownAlbedo { photograph, texel: texel as u32, albedo }));
    }
    (known, notes)
}
