//! The actors' files in a bundle: copied into a folder of their own each, so that a bundle needs nothing of its site.

use crate::site::{Actor, Albedo};
use crate::storage::{HashedFile, StoredFile, WriteFault, io_fault};
use crate::writer::WriteError;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

/// The folder of a bundle that holds a folder for each actor.
pub const ACTORS_FOLDER: &str = "actors";

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

/// Copies an actor's files below `folder`, and answers with the actor as the manifest has it and with what was copied.
pub(crate) fn copy_actor(folder: &Path, meta: &ActorMeta) -> Result<(Actor, Vec<StoredFile>), WriteError> {
    let name = meta.actor.display_name().to_owned();
    let unfit = |what: String| WriteError::Unfit(format!("actor `{name}`: {what}"));
    let mut stored: Vec<StoredFile> = Vec::new();
    for file in &meta.files {
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
        let path = in_bundle(&name, named);
        let there = stored.iter().any(|file| file.path == path);
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
