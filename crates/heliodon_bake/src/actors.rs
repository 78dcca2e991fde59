//! The actors of a site: their files, which a bundle takes in, and whether they can be played.

use crate::error::BakeError;
use crate::plan::Plan;
use crate::referenced::{clip_names, referenced_files};
use heliodon_bundle::site::{Actor, Albedo, InputFile, InputKind, Site};
use heliodon_bundle::{ActorFile, ActorMeta};
use heliodon_mesh::import::{ImportOptions, read};
use std::path::Path;

/// Reads every actor's model once, so that one that cannot be read is told before anything long begins, and looks for the clip
/// that is asked for. What each vertex does over time is the viewer's business.
///
/// # Errors
/// A model that cannot be read, an animation that is not in it.
pub fn check_actors(site: &Site, files: &[InputFile]) -> Result<(), BakeError> {
    for (i, actor) in site.actors.iter().enumerate() {
        let Some(file) = files.iter().find(|file| file.kind == InputKind::Actor(i)) else { continue };
        read(&file.path, &ImportOptions::default())?;
        let Some(wanted) = &actor.animation else { continue };
        let clips = clip_names(&file.path);
        if !clips.contains(wanted) {
            let there = match &clips[..] {
                [] => "it has none".to_owned(),
                clips => format!("it has {}", clips.join(", ")),
            };
            let message = format!("{} has no animation `{wanted}`", file.name);
            let key = ["actor", &i.to_string(), "animation"];
            return Err(site.error_at(&key, message, format!("{there}; without the key the first is played")).into());
        }
    }
    Ok(())
}

/// What the bundle takes in of each actor.
pub(crate) fn actor_metas(plan: &Plan) -> Vec<ActorMeta> {
    plan.site.actors.iter().enumerate().map(|(i, actor)| actor_meta(plan, i, actor)).collect()
}

fn actor_meta(plan: &Plan, index: usize, actor: &Actor) -> ActorMeta {
    let of_kind = |kind: InputKind| plan.files.iter().find(|file| file.kind == kind);
    let mut actor = actor.relative_to(plan.site.site.origin);
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
