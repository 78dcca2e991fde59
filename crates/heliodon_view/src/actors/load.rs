//! Reading the bundle's actors, on a thread of its own.

use super::Person;
use super::course::Course;
use super::figure::{Figure, Model};
use super::render::Look;
use crate::daylight::layout::albedo_roots;
use crate::stage::texture::halved;
use bevy::math::{DVec3, Vec2, Vec3};
use heliodon_bundle::BundleReader;
use heliodon_bundle::grid::Grid;
use heliodon_bundle::site::{Actor, Albedo, UpAxis};
use heliodon_image::{SrgbImage, TextureWrap};
use heliodon_math::color::linear_from_srgb8_table;
use heliodon_mesh::import::{ImportOptions, ImportReport};
use heliodon_mesh::motion::{read_cached, read_moving};
use heliodon_mesh::place::{Placement, Up};
use std::sync::Arc;

/// The bundle's actors.
#[derive(Default)]
pub struct Loaded {
    /// Who acts.
    pub people: Vec<Person>,
    /// What they look like.
    pub looks: Vec<Look>,
    /// What the monument leaves of the light where they act.
    pub grid: Option<Grid>,
    /// Who could not be read, and why.
    pub failures: Vec<String>,
}

/// Reads them all; what fails is told, and the others act.
pub fn run(bundle: &BundleReader) -> Loaded {
    let mut loaded = Loaded::default();
    match bundle.read_grid() {
        Ok(grid) => loaded.grid = grid,
        Err(error) => loaded.failures.push(format!("actors stand in the open: {error}")),
    }
    for actor in bundle.actors() {
        match read(bundle, actor) {
            Ok((person, look)) => {
                loaded.people.push(person);
                loaded.looks.push(look);
            }
            Err(what) => loaded.failures.push(format!("the actor {} is missing: {what}", actor.display_name())),
        }
    }
    loaded
}

/// One actor.
fn read(bundle: &BundleReader, actor: &Actor) -> Result<(Person, Look), String> {
    let up = match actor.up {
        UpAxis::Y => Up::Y,
        UpAxis::Z => Up::Z,
    };
    let placement =
        Placement { unit: actor.unit, up, scale: [actor.scale; 3], rotate_deg: actor.rotate_deg, ..Placement::default() };
    let options = ImportOptions { placement, ..ImportOptions::default() };
    let file = bundle.folder().join(&actor.file);
    let mut report = ImportReport::default();
    let moving = match &actor.cache {
        Some(cache) => read_cached(&file, &bundle.folder().join(cache), &options, &mut report),
        None => read_moving(&file, &options, &mut report),
    };
    let moving = moving.map_err(|error| error.to_string())?;
    let clip = match &actor.animation {
        Some(name) => Some(moving.clip_named(name).ok_or_else(|| {
            let clips: Vec<&str> = moving.clips().iter().map(|clip| clip.name.as_str()).collect();
            format!("{} has no animation {name}; it has {}", actor.file, if clips.is_empty() { "none".to_owned() } else { clips.join(", ") })
        })?),
        None => (!moving.clips().is_empty()).then_some(0),
    };
    let duration_s = clip.map_or(0.0, |clip| moving.clips()[clip].duration_s);
    let model = Arc::new(Model::new(moving));
    let look = look(bundle, actor, &model)?;
    let points: Vec<Vec3> = actor.stations().into_iter().map(|point| DVec3::from(point).as_vec3()).collect();
    let course = Course::walks(points, actor.walk_speed as f32, actor.walk, (actor.turn_deg as f32).to_radians());
    let figure = Figure::new(model);
    Ok((Person { name: actor.display_name().to_owned(), figure, course, clip, speed: actor.speed as f32, duration_s }, look))
}

/// The albedo of an actor's vertices and triangles.
fn look(bundle: &BundleReader, actor: &Actor, model: &Model) -> Result<Look, String> {
    let mesh = model.moving().rest();
    let mut textures = Vec::new();
    let mut texture_of: Vec<Option<usize>> = Vec::new();
    let decode = linear_from_srgb8_table();
    let mut add = |image: &SrgbImage, wrap| {
        let mut levels = vec![image.clone()];
        while let Some(last) = levels.last().filter(|last| last.width.max(last.height) > 1) {
            levels.push(halved(last, &decode));
        }
        textures.push((levels, wrap));
        textures.len() - 1
    };
    let own = match &actor.albedo {
        None => None,
        Some(Albedo::Rgb(rgb)) => Some(DVec3::from(*rgb).as_vec3()),
        Some(Albedo::Image(name)) => {
            let image = SrgbImage::read(&bundle.folder().join(name)).map_err(|error| error.to_string())?;
            texture_of = vec![Some(add(&image, [TextureWrap::Repeat; 2])); mesh.materials.len().max(1)];
            Some(Vec3::ONE)
        }
    };
    if own.is_none() {
        let image = |material: &heliodon_mesh::Material| material.texture.as_ref().map(|texture| add(&texture.image, texture.wrap));
        texture_of = mesh.materials.iter().map(image).collect();
    }
    let albedo = |(vertex, material): (usize, u16)| albedo_roots(own.unwrap_or_else(|| mesh.corner_albedo(vertex, material)));
    let uv = |(vertex, _): (usize, u16)| mesh.uvs.get(vertex).copied().unwrap_or(Vec2::ZERO);
    let mut triangles: Vec<(Option<usize>, [u32; 3])> = model
        .triangles
        .iter()
        .map(|&t| (texture_of.get(usize::from(model.material(t[0]))).copied().flatten(), t))
        .collect();
    triangles.sort_by_key(|(texture, _)| *texture);
    let mut draws: Vec<(std::ops::Range<u32>, Option<usize>)> = Vec::new();
    for (i, (texture, _)) in (0..).zip(&triangles) {
        match draws.last_mut().filter(|(_, last)| last == texture) {
            Some((range, _)) => range.end = 3 * (i + 1),
            None => draws.push((3 * i..3 * (i + 1), *texture)),
        }
    }
    Ok(Look {
        albedo: model.corners().map(albedo).collect(),
        uvs: model.corners().map(uv).collect(),
        indices: triangles.into_iter().flat_map(|(_, t)| t).collect(),
        draws,
        textures,
    })
}
