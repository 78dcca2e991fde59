//! The files of actors, films, sounds and scripts in a bundle: copied, so that a bundle needs nothing of its site.

use crate::site::{Actor, Albedo, Living};
use crate::storage::{HashedFile, StoredFile, WriteFault, io_fault};
use crate::writer::WriteError;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

/// The folder of a bundle that holds a folder for each actor.
pub const ACTORS_FOLDER: &str = "actors";

/// The folder of a bundle that holds films, sounds, scripts and texts, each with its path from the site's folder.
pub const LIVING_FOLDER: &str = "living";

/// A file of an actor: where it is, and its path in the actor's folder with `/` between folders.
///
/// What a model names keeps its path from the model, so that the model still finds it; what lies outside of the model's folder comes
/// to lie beside it, where importers look next.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ActorFile {
    /// Where it is now.
    pub source: PathBuf,
    /// Its path below `actors/NAME/`.
    pub name: String,
}

/// An actor with its files, as a bundle takes it in.
#[derive(Clone, Debug, PartialEq)]
pub struct ActorMeta {
    /// The actor as the manifest will have it, but for its files: `file`, `cache` and an albedo image are paths in its folder, which
    /// are among `files`.
    pub actor: Actor,
    /// All its files.
    pub files: Vec<ActorFile>,
}

/// Copies an actor's files below `folder`, and answers with the actor as the manifest has it and with what was copied: nothing where one `before` has the same files.
pub(crate) fn copy_actor(
    folder: &Path,
    meta: &ActorMeta,
    before: &[ActorMeta],
) -> Result<(Actor, Vec<StoredFile>), WriteError> {
    let name = meta.actor.display_name().to_owned();
    let unfit = |what: String| WriteError::Unfit(format!("actor `{name}`: {what}"));
    let known = before.iter().find(|known| known.files == meta.files);
    let owner = known.unwrap_or(meta).actor.display_name();
    let mut stored: Vec<StoredFile> = Vec::new();
    for file in meta.files.iter().filter(|_| known.is_none()) {
        let path = in_bundle(&name, &file.name);
        if !crate::reader::is_plain_path(&path) {
            return Err(unfit(format!("`{}` cannot be a file of a bundle; give it a plain name", file.name)));
        }
        if stored.iter().any(|known| known.path.eq_ignore_ascii_case(&path)) {
            return Err(unfit(format!("two of its files are called `{}`; rename one", file.name)));
        }
        stored.push(copy(&file.source, folder, &path)?);
    }
    let taken = |named: &str| {
        let there = meta.files.iter().any(|file| file.name == named);
        let path = in_bundle(owner, named);
        if there { Ok(path) } else { Err(unfit(format!("`{named}` is not among its files"))) }
    };
    let actor = Actor {
        name: Some(name.clone()),
        file: taken(&meta.actor.file)?,
        cache: meta.actor.cache.as_deref().map(taken).transpose()?,
        albedo: match &meta.actor.albedo {
            Some(Albedo::Image(image)) => Some(Albedo::Image(taken(image)?)),
            other => other.clone(),
        },
        ..meta.actor.clone()
    };
    Ok((actor, stored))
}

/// Copies what [`Living`] names from the site's folder below `folder`, and answers with it as the manifest has it and with what was copied.
pub(crate) fn copy_living(folder: &Path, site: &Path, living: &Living) -> Result<(Living, Vec<StoredFile>), WriteError> {
    let (mut taken, mut stored): (Living, Vec<StoredFile>) = (living.clone(), Vec::new());
    let mut sources: Vec<(String, String)> = Vec::new();
    for name in taken.files_mut() {
        if let Some((_, path)) = sources.iter().find(|(source, _)| source == name) {
            name.clone_from(path);
            continue;
        }
        // what lies outside of the site's folder comes to lie in it
        let within =
            if crate::reader::is_plain_path(name) { name.as_str() } else { name.rsplit(['/', '\\']).next().unwrap_or(name) };
        let path = format!("{LIVING_FOLDER}/{within}");
        if !crate::reader::is_plain_path(&path) || stored.iter().any(|known| known.path.eq_ignore_ascii_case(&path)) {
            return Err(WriteError::Unfit(format!("`{name}` cannot be a file of a bundle beside the others; rename it")));
        }
        stored.push(copy(&site.join(&*name), folder, &path)?);
        sources.push((name.clone(), path.clone()));
        *name = path;
    }
    Ok((taken, stored))
}

fn in_bundle(actor: &str, file: &str) -> String {
    format!("{ACTORS_FOLDER}/{actor}/{file}")
}

/// Copies a file to its path below a folder, and hashes what it has copied.
fn copy(source: &Path, folder: &Path, path: &str) -> Result<StoredFile, WriteFault> {
    let target = folder.join(path);
    if let Some(parent) = target.parent() {
        fs::create_dir_all(parent).map_err(io_fault(parent))?;
    }
    let mut from = File::open(source).map_err(io_fault(source))?;
    let mut to = HashedFile::create(&target)?;
    let mut block = vec![0; 1 << 20];
    loop {
        match from.read(&mut block).map_err(io_fault(source))? {
            0 => return to.finish(path),
            n => to.write(&block[..n])?,
        }
    }
}

/// The folders that the files of a bundle lie in, but its own.
pub(crate) fn folders_of(files: &[StoredFile]) -> Vec<&str> {
    let mut folders: Vec<&str> =
        files.iter().flat_map(|file| file.path.match_indices('/').map(|(i, _)| &file.path[..i])).collect();
    folders.sort_unstable();
    folders.dedup();
    folders
}
