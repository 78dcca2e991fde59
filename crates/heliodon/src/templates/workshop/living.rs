//! The workshop's story: its things, materials, sounds and scripts.

use anyhow::{Context, Result};
use heliodon_bundle::site::SiteFile;
use heliodon_mesh::export::write_ply;
use heliodon_mesh::workshop::WorkshopThing;
use std::path::Path;

/// What is the same in every workshop, as its author would write it.
const TABLES: &str = include_str!("site-part.toml");
const FILES: [(&str, &str); 2] = [("story.rhai", include_str!("story.rhai")), ("texts.toml", include_str!("texts.toml"))];

/// Writes things, scripts and texts, and tells the site of them; answers the files' names.
pub fn furnish(folder: &Path, things: &[WorkshopThing], site: &mut SiteFile) -> Result<Vec<String>> {
    let living = SiteFile::parse(TABLES, "site-part.toml")?;
    site.regions = living.regions;
    site.views = living.views;
    site.paths = living.paths;
    site.materials = living.materials;
    site.particles = living.particles;
    site.sounds = living.sounds;
    site.echoes = living.echoes;
    site.story = living.story;
    site.actors = living.actors;
    let mut files = Vec::new();
    for thing in things {
        let file = format!("{}.ply", thing.name);
        write_ply(&folder.join(&file), &thing.mesh, None).with_context(|| format!("cannot write {file}"))?;
        for actor in site.actors.iter_mut().filter(|actor| actor.file == file) {
            actor.place = Some(thing.place.to_array().map(f64::from));
        }
        files.push(file);
    }
    for (file, text) in FILES {
        std::fs::write(folder.join(file), text).with_context(|| format!("cannot write {file}"))?;
        files.push(file.to_owned());
    }
    Ok(files)
}
