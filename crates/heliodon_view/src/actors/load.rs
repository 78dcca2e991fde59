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
use heliodon_bundle::site::{Actor, Albedo};
use heliodon_image::{SrgbImage, TextureWrap};
use heliodon_math::color::linear_from_srgb8_table;
use heliodon_mesh::import::{ImportOptions, ImportReport};
use heliodon_mesh::motion::{MovingMesh, read_cached, read_moving};
use heliodon_mesh::{Material, Texture};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

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
    for actor in bundle.actors().iter().filter(|actor| !actor.is_impostor()) {
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
    let options = ImportOptions { placement: actor.placement(), ..ImportOptions::default() };
    let file = bundle.folder().join(&actor.file);
    let mut report = ImportReport::default();
    let moving = match &actor.cache {
        Some(cache) => read_cached(&file, &bundle.folder().join(cache), &options, &mut report),
        None => read_moving(&file, &options, &mut report),
    };
    let mut moving = moving.map_err(|error| error.to_string())?;
    if let Some(frames_per_s) = actor.cache_frames_per_s {
        moving.set_cache_frames_per_s(frames_per_s as f32);
    }
    let clip = match &actor.animation {
        Some(name) => Some(moving.clip_named(name).ok_or_else(|| {
            let clips: Vec<&str> = moving.clips().iter().map(|clip| clip.name.as_str()).collect();
            let known = if clips.is_empty() { "none".to_owned() } else { clips.join(", ") };
            format!("{} has no animation {name}; it has {known}", actor.file)
        })?),
        None => None,
    };
    let material = match &actor.albedo {
        None => None,
        Some(Albedo::Rgb(rgb)) => {
            Some(Material { name: String::new(), base_color_linear: DVec3::from(*rgb).as_vec3(), texture: None })
        }
        Some(Albedo::Image(name)) => {
            let image = SrgbImage::read(bundle.folder().join(name)).map_err(|error| error.to_string())?;
            let texture = Texture { source: name.clone(), image, wrap: [TextureWrap::Repeat; 2] };
            Some(Material { name: String::new(), base_color_linear: Vec3::ONE, texture: Some(Arc::new(texture)) })
        }
    };
    let points: Vec<Vec3> = actor.stations().into_iter().map(|point| DVec3::from(point).as_vec3()).collect();
    let course = Course::walks(points, actor.walk_speed as f32, actor.walk, (actor.turn_deg as f32).to_radians());
    Ok(person(actor.display_name(), moving, clip, actor.speed as f32, course, material.as_ref()))
}

/// Somebody who performs a clip, the first unless another is named, on a course; `material` in place of whatever the mesh has.
pub fn person(
    name: &str,
    moving: MovingMesh,
    clip: Option<usize>,
    speed: f32,
    course: Course,
    material: Option<&Material>,
) -> (Person, Look) {
    let clip = clip.or_else(|| (!moving.clips().is_empty()).then_some(0));
    let duration_s = clip.map_or(0.0, |clip| moving.clips()[clip].duration_s);
    let model = Arc::new(Model::new(moving));
    let look = Look { model: Some(Arc::clone(&model)), ..look(&model, material) };
    let stands = course.at(0.0);
    let bounds = (stands.translation.into(), stands.translation.into());
    let figure = Figure::new(model);
    (Person { name: name.to_owned(), figure, course, clip, speed, duration_s, stands, bounds, pose: None, poses: 0 }, look)
}

/// The albedo of a model's vertices and triangles.
fn look(model: &Model, material: Option<&Material>) -> Look {
    let mesh = model.moving().rest();
    let materials = material.map_or(mesh.materials.as_slice(), std::slice::from_ref);
    let which = |number: u16| if material.is_some() { 0 } else { usize::from(number) };
    let decode = linear_from_srgb8_table();
    let mut textures = Vec::new();
    let mut add = |texture: &Arc<Texture>| {
        let mut levels = vec![texture.image.clone()];
        while let Some(last) = levels.last().filter(|last| last.width.max(last.height) > 1) {
            levels.push(halved(last, &decode));
        }
        textures.push((levels, texture.wrap));
        textures.len() - 1
    };
    let texture_of: Vec<Option<usize>> = materials.iter().map(|material| material.texture.as_ref().map(&mut add)).collect();
    let albedo = |(vertex, number): (usize, u16)| {
        albedo_roots(material.map_or_else(|| mesh.corner_albedo(vertex, number), |material| material.base_color_linear))
    };
    let uv = |(vertex, _): (usize, u16)| mesh.uvs.get(vertex).copied().unwrap_or(Vec2::ZERO);
    let textured = |t: &[u32; 3]| texture_of.get(which(model.material(t[0]))).copied().flatten();
    let mut triangles: Vec<(Option<usize>, [u32; 3])> = model.triangles.iter().map(|t| (textured(t), *t)).collect();
    triangles.sort_by_key(|(texture, _)| *texture);
    let mut draws: Vec<(Range<u32>, Option<usize>)> = Vec::new();
    for (i, (texture, _)) in (0..).zip(&triangles) {
        match draws.last_mut().filter(|(_, last)| last == texture) {
            Some((range, _)) => range.end = 3 * (i + 1),
            None => draws.push((3 * i..3 * (i + 1), *texture)),
        }
    }
    Look {
        albedo: model.corners().map(albedo).collect(),
        uvs: model.corners().map(uv).collect(),
        indices: triangles.into_iter().flat_map(|(_, t)| t).collect(),
        draws,
        textures,
        model: None,
        refused: AtomicBool::new(false),
    }
}
