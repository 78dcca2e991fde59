//! The scripts and texts of a site or a bundle, read and checked against what is there.

use crate::diagnostic::{Diagnostic, Place, Severity};
use crate::names::{Kind, Names};
use crate::program::{Program, Source};
use crate::texts::Texts;
use heliodon_bundle::site::{Actor, Lamp, Living};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// The longest script or table of texts that is read.
const MAX_FILE_BYTES: u64 = 4 << 20;

/// What a story is made of.
#[derive(Clone, Debug)]
pub struct Book {
    /// The scripts that can run.
    pub program: Program,
    /// What they say; none where the site has no table of texts, or one that cannot be read.
    pub texts: Option<Texts>,
    /// Everything that is wrong or odd with them.
    pub told: Vec<Diagnostic>,
}

/// Everything that a site has a name for, but for animations, which its models know.
#[must_use]
pub fn names<'a>(
    living: &Living,
    actors: &[Actor],
    lamps: &[Lamp],
    parts: impl IntoIterator<Item = &'a str>,
    texts: Option<&Texts>,
) -> Names {
    let mut names = Names::unchecked();
    let (things, people): (Vec<&Actor>, Vec<&Actor>) = actors.iter().partition(|actor| actor.thing.is_some());
    names.add(Kind::Thing, things.into_iter().map(Actor::display_name));
    names.add(Kind::Actor, people.into_iter().map(Actor::display_name));
    names.add(Kind::Part, parts);
    names.add(Kind::Light, lamps.iter().filter_map(|lamp| lamp.name.as_deref()));
    names.add(Kind::Region, living.regions.iter().map(|region| region.name.as_str()));
    names.add(Kind::View, living.views.iter().map(|view| view.name.as_str()));
    names.add(Kind::Path, living.paths.iter().map(|way| way.name.as_str()));
    names.add(Kind::Material, living.materials.iter().map(|material| material.name.as_str()));
    names.add(Kind::Film, living.films.iter().map(|film| film.name.as_str()));
    names.add(Kind::Sound, living.sounds.iter().map(|sound| sound.name.as_str()));
    names.add(Kind::Particles, living.particles.iter().map(|particles| particles.name.as_str()));
    names.add(Kind::Text, texts.iter().flat_map(|texts| texts.keys()));
    names
}

impl Book {
    /// Reads the files that `living` names from `folder`, and compiles them. What cannot be read is told, and the rest is there.
    #[must_use]
    pub fn read<'a>(
        folder: &Path,
        living: &Living,
        actors: &[Actor],
        lamps: &[Lamp],
        parts: impl IntoIterator<Item = &'a str>,
    ) -> Self {
        let mut told = Vec::new();
        let mut read = |file: &str| match read_text(&folder.join(file)) {
            Ok(text) => Some(text),
            Err(why) => {
                told.push(Diagnostic::new(file, Place(None), why, "look where the site's folder is"));
                None
            }
        };
        let story = living.story.as_ref();
        let table = story.and_then(|story| story.texts.as_deref()).and_then(|file| Some((file, read(file)?)));
        let sources: Vec<Source> =
            story.iter().flat_map(|story| &story.scripts).filter_map(|file| Some(Source::new(file, read(file)?))).collect();
        let texts = table.and_then(|(file, text)| Texts::parse(&text, file).map_err(|fault| told.push(fault)).ok());
        told.extend(texts.iter().flat_map(Texts::missing));
        let (program, more) = Program::compile(&sources, &names(living, actors, lamps, parts, texts.as_ref()));
        told.extend(more);
        Self { program, texts, told }
    }

    /// What keeps scripts from running.
    pub fn errors(&self) -> impl Iterator<Item = &Diagnostic> {
        self.told.iter().filter(|told| told.severity == Severity::Error)
    }
}

/// When a story's files were written last, in their order: another answer asks for them to be read again.
#[must_use]
pub fn written(folder: &Path, living: &Living) -> Vec<Option<SystemTime>> {
    let story = living.story.as_ref();
    let files = story.into_iter().flat_map(|story| story.scripts.iter().chain(&story.texts));
    files.map(|file| PathBuf::from(folder).join(file).metadata().and_then(|about| about.modified()).ok()).collect()
}

fn read_text(path: &Path) -> Result<String, String> {
    let about = path.metadata().map_err(|error| format!("the file cannot be read: {error}"))?;
    if about.len() > MAX_FILE_BYTES {
        return Err(format!("the file has {} bytes, {MAX_FILE_BYTES} at most are read", about.len()));
    }
    std::fs::read_to_string(path).map_err(|error| format!("the file cannot be read: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_bundle::site::{Region, Story};

    #[test]
    fn a_site_s_story_is_checked_against_its_names() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.rhai"), "when_enter(\"hall\", || subtitle(\"hello\"));").unwrap();
        std::fs::write(folder.path().join("t.toml"), "languages = [\"en\"]\n[texts.hello]\nen = \"Hello\"\n").unwrap();
        let region = |name: &str| Region { name: name.into(), min: [0.0; 3], max: [1.0; 3] };
        let story = |scripts: &[&str]| Story {
            scripts: scripts.iter().map(|&script| script.to_owned()).collect(),
            texts: Some("t.toml".into()),
            language: None,
            font: None,
            remembers: true,
        };
        let mut living = Living { regions: vec![region("hall")], story: Some(story(&["a.rhai"])), ..Living::default() };
        let read = |living: &Living| Book::read(folder.path(), living, &[], &[], []);
        let book = read(&living);
        assert!(book.told.is_empty() && book.program.is_sound() && book.texts.is_some(), "{:?}", book.told);
        assert_eq!(written(folder.path(), &living).iter().flatten().count(), 2);
        living.regions = vec![region("court")];
        let told = read(&living).errors().map(ToString::to_string).collect::<Vec<_>>();
        assert!(told.len() == 1 && told[0].starts_with("a.rhai:1:12: there is no region `hall`"), "{told:?}");
        living.story = Some(story(&["none.rhai"]));
        assert!(read(&living).errors().any(|told| told.file == "none.rhai" && told.message.contains("cannot be read")));
    }
}
