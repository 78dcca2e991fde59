//! The workshop's story: its things, people, materials, sounds and scripts.

use super::people;
use anyhow::{Context, Result};
use heliodon_bundle::site::{Site, SiteFile};
use heliodon_mesh::export::write_ply;
use heliodon_mesh::workshop::WorkshopThing;
use std::path::Path;

/// What is the same in every workshop, as its author would write it.
const TABLES: &str = include_str!("site-part.toml");
const FILES: [(&str, &str); 3] = [
    ("story.rhai", include_str!("story.rhai")),
    ("texts.toml", include_str!("texts.toml")),
    ("tour.play", include_str!("tour.play")),
];

/// Writes things, people, scripts and texts, and tells the site of them; answers the files' names.
pub fn furnish(folder: &Path, things: &[WorkshopThing], site: &mut SiteFile) -> Result<Vec<String>> {
    let text = format!("{}\n{TABLES}", site.to_toml_string());
    *site = Site::parse(&text, "the workshop's tables")?.file().clone();
    let mut files = people::capture_all(folder)?;
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
