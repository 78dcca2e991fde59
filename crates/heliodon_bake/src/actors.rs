//! The actors of a site: their files, which a bundle takes in, and whether they can be played.

use crate::error::BakeError;
use crate::referenced::referenced_files;
use heliodon_bundle::impostor::Impostor;
use heliodon_bundle::site::{Actor, Albedo, Ground, InputFile, InputKind, Site};
use heliodon_bundle::{ActorFile, ActorMeta};
use heliodon_mesh::import::{ImportOptions, ImportReport};
use heliodon_mesh::motion::{read_cached, read_moving};
use std::path::Path;

/// What the bake wants to know of an actor's model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figure {
    /// The height of its lowest point at rest over its own origin, metres; of one that stands on its origin 0.
    pub low_m: f64,
    /// The height of its highest point at rest over its own origin, metres.
    pub high_m: f64,
    /// What was left out of its files or looked odd there.
    pub warnings: Vec<String>,
}

/// Reads every actor's model once, with its vertex cache and placed as the viewer will, so that one that cannot be played is told before
/// anything long begins, and looks for the clip that is asked for. One figure for each of the site's actors.
///
/// # Errors
/// A model or a vertex cache that cannot be read, a cache of another number of vertices, an animation that is not there.
pub fn read_figures(site: &Site, files: &[InputFile]) -> Result<Vec<Figure>, BakeError> {
    let of_kind = |kind: InputKind| files.iter().find(|file| file.kind == kind);
    let read = |(i, actor): (usize, &Actor)| {
        let Some(model) = of_kind(InputKind::Actor(i)) else { return Ok(Figure::default()) };
        if actor.is_impostor() {
            return read_impostor(site, i, actor, model);
        }
        let options = ImportOptions { placement: actor.placement(), ..ImportOptions::default() };
        let mut report = ImportReport::default();
        let moving = match of_kind(InputKind::ActorCache(i)) {
            Some(cache) => read_cached(&model.path, &cache.path, &options, &mut report)?,
            None => read_moving(&model.path, &options, &mut report)?,
        };
        has_animation(site, i, model, moving.clips().iter().map(|clip| clip.name.as_str()))?;
        let (low, high) = moving.rest().bounds().unwrap_or_default();
        let told = |warning: String| format!("actor {}: {warning}", actor.display_name());
        let warnings = report.warnings.into_iter().map(told).collect();
        Ok(Figure { low_m: low.y.into(), high_m: high.y.into(), warnings })
    };
    site.actors.iter().enumerate().map(read).collect()
}

/// Whether the clip that an actor asks for is among those that its file has.
fn has_animation<'a>(
    site: &Site,
    index: usize,
    model: &InputFile,
    clips: impl Iterator<Item = &'a str>,
) -> Result<(), BakeError> {
    let Some(wanted) = &site.actors[index].animation else { return Ok(()) };
    let clips: Vec<&str> = clips.collect();
    if clips.contains(&wanted.as_str()) {
        return Ok(());
    }
    let there = if clips.is_empty() { "it has none".to_owned() } else { format!("it has {}", clips.join(", ")) };
    let message = format!("{} has no animation `{wanted}`", model.name);
    let key = ["actor", &index.to_string(), "animation"];
    Err(site.error_at(&key, message, format!("{there}; without the key the first is played")).into())
}

/// An impostor's figure; its texels are read by who shows it.
fn read_impostor(site: &Site, index: usize, actor: &Actor, file: &InputFile) -> Result<Figure, BakeError> {
    let refuse = |what: String| {
        let key = ["actor", &index.to_string(), "file"];
        BakeError::from(site.error_at(&key, what, "capture the model again with `heliodon impostor`"))
    };
    let bytes = std::fs::read(&file.path).map_err(|error| refuse(format!("{}: {error}", file.name)))?;
    let info = Impostor::info_of(&bytes, &file.name).map_err(|error| refuse(error.to_string()))?;
    has_animation(site, index, file, info.clips.iter().map(|clip| clip.name.as_str()))?;
    let [low_m, high_m] = info.heights_m.map(|height| f64::from(height) * actor.scale);
    Ok(Figure { low_m, high_m, warnings: Vec::new() })
}

/// What the bundle takes in of each actor; `actors` are the site's in the bundle's space, on the ground where they follow it.
pub(crate) fn actor_metas(files: &[InputFile], actors: Vec<Actor>) -> Vec<ActorMeta> {
    actors.into_iter().enumerate().map(|(i, actor)| actor_meta(files, i, actor)).collect()
}

fn actor_meta(inputs: &[InputFile], index: usize, mut actor: Actor) -> ActorMeta {
    let of_kind = |kind: InputKind| inputs.iter().find(|file| file.kind == kind);
    // its heights are what was asked for, and nobody who reads the bundle has a ground to ask
    actor.ground = Ground::default();
    actor.name = Some(actor.display_name().to_owned());
    let mut files: Vec<ActorFile> = Vec::new();
    let Some(model) = of_kind(InputKind::Actor(index)) else { return ActorMeta { actor, files } };
    let folder = model.path.parent().unwrap_or(Path::new(""));
    let mut take = |source: &Path| {
        let name = name_beside(folder, source);
        if !files.iter().any(|known| known.source == source) {
            files.push(ActorFile { source: source.to_owned(), name: name.clone() });
        }
        name
    };
    actor.file = take(&model.path);
    actor.cache = of_kind(InputKind::ActorCache(index)).map(|cache| take(&cache.path));
    if let Some(image) = of_kind(InputKind::ActorAlbedo(index)) {
        actor.albedo = Some(Albedo::Image(take(&image.path)));
    }
    for named in referenced_files(&model.path) {
        take(&named);
    }
    ActorMeta { actor, files }
}

/// A file's path from a model's folder; outside of it its name alone, for importers that do not find a file where it should be look for it
/// beside the model.
fn name_beside(folder: &Path, file: &Path) -> String {
    let within = file.strip_prefix(folder).ok();
    let plain = |path: &&Path| path.components().all(|part| matches!(part, std::path::Component::Normal(_)));
    let name = within.filter(plain).or_else(|| file.file_name().map(Path::new)).unwrap_or(file);
    let parts: Vec<_> = name.components().map(|part| part.as_os_str().to_string_lossy()).collect();
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_keep_their_path_from_the_model() {
        let name = |file: &str| name_beside(Path::new("site/people"), Path::new(file));
        assert_eq!(name("site/people/walker.glb"), "walker.glb");
        assert_eq!(name("site/people/maps/skin.png"), "maps/skin.png");
        assert_eq!(name("site/cloth.pc2"), "cloth.pc2");
        assert_eq!(name("site/people/../maps/skin.png"), "skin.png");
        assert_eq!(name_beside(Path::new(""), Path::new("walker.glb")), "walker.glb");
    }
}
