//! The files that a site names.

use super::Site;
use super::types::Albedo;
use crate::config::ConfigError;
use std::path::{Component, Path, PathBuf};

/// What a file is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum InputKind {
    /// Geometry of the part with that index.
    Geometry(usize),
    /// The albedo image of the part with that index.
    Albedo(usize),
    /// The image that says what the albedo of the part with that index rests on.
    Evidence(usize),
    /// The `views.json` of the part with that index; it names images in turn.
    Views(usize),
    /// The image of a detail: the index of its part, and its own among those of the part.
    Detail(usize, usize),
    /// An HDR image of the sky.
    Probe,
    /// The model of the actor with that index.
    Actor(usize),
    /// The vertex cache of the actor with that index.
    ActorCache(usize),
    /// The albedo image of the actor with that index.
    ActorAlbedo(usize),
    /// A film, sound, script or table of texts.
    Living,
}

impl InputKind {
    /// Whether it is shown on a surface of which light knows nothing: details and views.
    #[must_use]
    pub fn is_detail(self) -> bool {
        matches!(self, Self::Detail(..) | Self::Views(_))
    }

    /// The part to whose mesh, as it is read, the file belongs: its geometry, its albedo image, and what that rests on.
    #[must_use]
    pub fn mesh_part(self) -> Option<usize> {
        match self {
            Self::Geometry(part) | Self::Albedo(part) | Self::Evidence(part) => Some(part),
            Self::Views(_)
            | Self::Detail(..)
            | Self::Probe
            | Self::Actor(_)
            | Self::ActorCache(_)
            | Self::ActorAlbedo(_)
            | Self::Living => None,
        }
    }
}

/// A file that a site names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputFile {
    /// What it is for.
    pub kind: InputKind,
    /// Where it is: the site's folder, joined with `name`.
    pub path: PathBuf,
    /// Its path relative to the site's folder, with `/` between folders, as messages and manifests give it.
    pub name: String,
}

/// What manifests call a path, or a pattern of paths, from the site's folder: as it stands, with `/` between folders, where it stays in that folder; otherwise only
/// its last name, for manifests tell nothing of the machine.
#[must_use]
pub fn told_path(path: &Path) -> String {
    // `../scans/a.ply` of a site in `.` is outside of it as well
    let inside = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    let told = if inside { path } else { path.file_name().map_or(path, Path::new) };
    let parts: Vec<_> = told.components().map(|part| part.as_os_str().to_string_lossy()).collect();
    parts.join("/")
}

impl Site {
    /// All files that the site names: geometry by part, each part's sorted by name, with its albedo image, what that rests on, its views and its details' images after it; then the
    /// probes, sorted by name; then each actor's model, vertex cache and albedo image; then films, sounds, scripts and texts. Files that these name in turn (materials, textures) are not among them.
    ///
    /// # Errors
    /// A file that is not there, or a pattern that nothing matches.
    pub fn input_files(&self) -> Result<Vec<InputFile>, ConfigError> {
        let mut files = Vec::new();
        for (i, part) in self.parts.iter().enumerate() {
            let index = i.to_string();
            let at = |key| vec!["part".to_owned(), index.clone(), key];
            self.expand(&part.file, &at("file".to_owned()), InputKind::Geometry(i), &mut files)?;
            if let Some(Albedo::Image(image)) = &part.albedo {
                self.expand_one(image, &at("albedo".to_owned()), InputKind::Albedo(i), &mut files)?;
            }
            if let Some(image) = &part.evidence {
                self.expand_one(image, &at("evidence".to_owned()), InputKind::Evidence(i), &mut files)?;
            }
            if let Some(views) = &part.views {
                self.expand_one(views, &at("views".to_owned()), InputKind::Views(i), &mut files)?;
            }
            for (k, detail) in part.detail.iter().enumerate() {
                if let Some(image) = &detail.file {
                    let at = [at("detail".to_owned()), vec![k.to_string(), "file".to_owned()]].concat();
                    self.expand_one(image, &at, InputKind::Detail(i, k), &mut files)?;
                }
            }
        }
        if let Some(probes) = &self.sky.probes {
            self.expand(probes, &["sky".to_owned(), "probes".to_owned()], InputKind::Probe, &mut files)?;
        }
        for (i, actor) in self.actors.iter().enumerate() {
            let image = match &actor.albedo {
                Some(Albedo::Image(image)) => Some(image),
                _ => None,
            };
            for (key, name, kind) in [
                ("file", Some(&actor.file), InputKind::Actor(i)),
                ("cache", actor.cache.as_ref(), InputKind::ActorCache(i)),
                ("albedo", image, InputKind::ActorAlbedo(i)),
            ] {
                if let Some(name) = name {
                    self.expand_one(name, &["actor".to_owned(), i.to_string(), key.to_owned()], kind, &mut files)?;
                }
            }
        }
        self.living_files(&mut files)?;
        Ok(files)
    }

    /// Films, sounds, scripts and texts.
    fn living_files(&self, files: &mut Vec<InputFile>) -> Result<(), ConfigError> {
        let mut named: Vec<(Vec<String>, &str)> = Vec::new();
        for (i, film) in self.films.iter().enumerate() {
            let at = |key: &str| ["film", &i.to_string(), key].map(str::to_owned).to_vec();
            named.extend(film.file.as_deref().map(|file| (at("file"), file)));
            named.extend(film.mask.as_deref().map(|mask| (at("mask"), mask)));
        }
        for (i, sound) in self.sounds.iter().enumerate() {
            let at = ["sound", &i.to_string(), "file"].map(str::to_owned).to_vec();
            named.extend(sound.file.as_deref().map(|file| (at, file)));
        }
        if let Some(story) = &self.story {
            for (i, script) in story.scripts.iter().enumerate() {
                named.push((["story", "scripts", &i.to_string()].map(str::to_owned).to_vec(), script));
            }
            named.extend(story.texts.as_deref().map(|texts| (["story", "texts"].map(str::to_owned).to_vec(), texts)));
            named.extend(story.font.as_deref().map(|font| (["story", "font"].map(str::to_owned).to_vec(), font)));
        }
        for (at, name) in named {
            self.expand_one(name, &at, InputKind::Living, files)?;
        }
        Ok(())
    }

    /// The files of one part's geometry, sorted by name.
    ///
    /// # Errors
    /// As [`Site::input_files`].
    ///
    /// # Panics
    /// If the site has no part of that index.
    pub fn part_files(&self, part: usize) -> Result<Vec<InputFile>, ConfigError> {
        let mut files = Vec::new();
        let at = ["part".to_owned(), part.to_string(), "file".to_owned()];
        self.expand(&self.parts[part].file, &at, InputKind::Geometry(part), &mut files)?;
        Ok(files)
    }

    fn expand(&self, pattern: &str, at: &[String], kind: InputKind, files: &mut Vec<InputFile>) -> Result<(), ConfigError> {
        // a file whose very name holds a `[` or `*` is that file
        if !pattern.contains(['*', '?', '[']) || self.folder().join(pattern).is_file() {
            return self.expand_one(pattern, at, kind, files);
        }
        let folder = glob::Pattern::escape(&self.folder().to_string_lossy());
        let full = Path::new(&folder).join(pattern);
        let wrong_pattern = |error: &glob::PatternError| {
            self.source.error_at(at, format!("`{pattern}` is no pattern: {}", error.msg), "mend it, or name a file".to_owned())
        };
        let options =
            glob::MatchOptions { case_sensitive: true, require_literal_separator: true, require_literal_leading_dot: true };
        let before = files.len();
        for entry in glob::glob_with(&full.to_string_lossy(), options).map_err(|e| wrong_pattern(&e))? {
            let path = entry.map_err(|error| {
                let message = format!("`{}` cannot be read: {}", error.path().display(), error.error());
                self.source.error_at(at, message, "check its permissions".to_owned())
            })?;
            if path.is_file() {
                files.push(InputFile { kind, name: self.relative_name(&path), path });
            }
        }
        if files.len() == before {
            let message = format!("nothing matches `{pattern}` in {}", self.folder().display());
            return Err(self.source.error_at(at, message, "paths start from the site's folder".to_owned()));
        }
        files[before..].sort_by(|a, b| a.name.cmp(&b.name));
        Ok(())
    }

    fn expand_one(&self, name: &str, at: &[String], kind: InputKind, files: &mut Vec<InputFile>) -> Result<(), ConfigError> {
        let path = self.folder().join(name);
        if !path.is_file() {
            let message = if path.is_dir() { format!("`{name}` is a folder") } else { format!("there is no file `{name}`") };
            let remedy = format!("looked for {}; paths start from the site's folder", path.display());
            return Err(self.source.error_at(at, message, remedy));
        }
        files.push(InputFile { kind, name: self.relative_name(&path), path });
        Ok(())
    }

    fn relative_name(&self, path: &Path) -> String {
        let relative = path.strip_prefix(self.folder()).unwrap_or(path);
        let parts: Vec<_> = relative.components().map(|c| c.as_os_str().to_string_lossy()).collect();
        if relative.has_root() { relative.to_string_lossy().into_owned() } else { parts.join("/") }
    }
}
