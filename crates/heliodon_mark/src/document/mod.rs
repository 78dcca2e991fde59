//! A project's file as it is worked on: edited without losing its comments and layout, undone and redone, saved.

mod edit;
mod files;
mod history;
mod merge;
#[cfg(test)]
mod tests;

pub use edit::Edit;

use files::Files;
use heliodon_photo::project::{PROJECT_FILE_NAME, Project};
use history::History;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use toml_edit::DocumentMut;

/// Endings of files that a folder without a project is taken to have as photographs.
const PHOTOGRAPHS: [&str; 5] = ["jpg", "jpeg", "png", "tif", "tiff"];

/// Why something cannot be done to a document, in words.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct DocumentError(pub String);

/// What became of a wish to save.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Saved {
    /// It is written.
    Written,
    /// Another program wrote the file since: nothing was written.
    ChangedOutside,
}

/// A project that is worked on.
#[derive(Debug)]
pub struct Document {
    text: String,
    project: Project,
    history: History,
    files: Files,
    left_by_a_crash: Option<String>,
    theirs: Option<String>,
}

impl Document {
    /// Opens a project, given its file or its folder. A folder of photographs without a project becomes one, written when it is saved.
    ///
    /// # Errors
    /// Where it cannot be read or is wrong, with the place; where there are neither a project nor photographs.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, DocumentError> {
        let path = path.as_ref();
        let path = if path.is_dir() { path.join(PROJECT_FILE_NAME) } else { path.to_owned() };
        // a name that was misspelt begins no project where it happens to point
        if path.file_name().is_none_or(|name| name != PROJECT_FILE_NAME) && !path.exists() {
            return Err(DocumentError(format!("{}: there is no such folder or project", path.display())));
        }
        let told = |error: io::Error| DocumentError(format!("{}: the project cannot be read: {error}", path.display()));
        let (files, held) = Files::open(&path).map_err(told)?;
        let text = match held {
            Some(text) => text,
            None => begun(&path)?,
        };
        let project = Project::parse(&text, files.path()).map_err(|error| DocumentError(error.to_string()))?;
        let left = files.left_by_a_crash().filter(|left| *left != text && Project::parse(left, files.path()).is_ok());
        Ok(Self { text, project, history: History::default(), files, left_by_a_crash: left, theirs: None })
    }

    /// The project as it is now.
    #[must_use]
    pub fn project(&self) -> &Project {
        &self.project
    }

    /// The file as it would be written now.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The project's file.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.files.path()
    }

    /// Whether there is something to save.
    #[must_use]
    pub fn is_changed(&self) -> bool {
        self.files.held() != Some(&self.text)
    }

    /// How many steps can be undone, and how many redone.
    #[must_use]
    pub fn steps(&self) -> (usize, usize) {
        self.history.len()
    }

    /// Does something to the project.
    ///
    /// # Errors
    /// Where it cannot be done, or the project would be wrong after it; it then stays as it was.
    pub fn edit(&mut self, edit: &Edit) -> Result<(), DocumentError> {
        self.edit_in_a_run(edit, None)
    }

    /// The same, undone together with those of the same name just before it: steps of a pixel that move one mark.
    ///
    /// # Errors
    /// As [`edit`](Self::edit).
    pub fn edit_in_a_run(&mut self, edit: &Edit, run: Option<&str>) -> Result<(), DocumentError> {
        let mut doc: DocumentMut = self.text.parse().map_err(|error: toml_edit::TomlError| DocumentError(error.to_string()))?;
        edit.apply(&mut doc).map_err(DocumentError)?;
        self.become_text(doc.to_string(), edit.what(), run)
    }

    fn become_text(&mut self, text: String, what: String, run: Option<&str>) -> Result<(), DocumentError> {
        if text == self.text {
            return Ok(());
        }
        let parsed = Project::parse(&text, self.files.path());
        self.project = parsed.map_err(|error| DocumentError(format!("{what}: {}", error.message)))?;
        self.history.push(&self.text, &text, what, run.map(str::to_owned));
        self.text = text;
        Ok(())
    }

    /// What follows is undone by itself.
    pub fn end_run(&mut self) {
        self.history.rest();
    }

    /// Undoes the last step, and tells what that was.
    pub fn undo(&mut self) -> Option<String> {
        let told = self.history.undo(&self.text)?;
        self.travel(told)
    }

    /// Does again what was undone last, and tells what that was.
    pub fn redo(&mut self) -> Option<String> {
        let told = self.history.redo(&self.text)?;
        self.travel(told)
    }

    fn travel(&mut self, (text, what): (String, String)) -> Option<String> {
        // It was a project once, and still is.
        self.project = Project::parse(&text, self.files.path()).ok()?;
        self.text = text;
        Some(what)
    }

    /// Writes the project to its file, whole or not at all; not over what another program wrote since.
    ///
    /// # Errors
    /// Where the folder cannot be written to.
    pub fn save(&mut self) -> Result<Saved, DocumentError> {
        self.end_run();
        if self.changed_outside().is_some() {
            return Ok(Saved::ChangedOutside);
        }
        self.files.write(&self.text).map_err(|error| self.told(&error))?;
        Ok(Saved::Written)
    }

    fn told(&self, error: &io::Error) -> DocumentError {
        DocumentError(format!("{} cannot be written: {error}", self.files.path().display()))
    }

    /// Writes unsaved work beside the file, to be found after a crash, and takes it away where there no longer is any. Tells whether there was something new to write.
    ///
    /// # Errors
    /// Where the folder cannot be written to.
    pub fn autosave(&mut self) -> Result<bool, DocumentError> {
        if self.left_by_a_crash.is_some() {
            return Ok(false);
        }
        if !self.is_changed() {
            // what was undone, or given up for what another program wrote, is nothing to be found again
            self.files.forget_own_autosave();
            return Ok(false);
        }
        self.files.autosave(&self.text).map_err(|error| self.told(&error))
    }

    /// Whether work was found that a crash left unsaved.
    #[must_use]
    pub fn has_left_work(&self) -> bool {
        self.left_by_a_crash.is_some()
    }

    /// Takes up the work that a crash left; it can be undone.
    ///
    /// # Errors
    /// Where it is no project.
    pub fn take_up(&mut self) -> Result<(), DocumentError> {
        match self.left_by_a_crash.take() {
            Some(left) => self.become_text(left, "unsaved work taken up".to_owned(), None),
            None => Ok(()),
        }
    }

    /// Lets go of the work that a crash left, and of unsaved work at the end.
    pub fn forget_unsaved(&mut self) {
        self.left_by_a_crash = None;
        self.files.forget_autosave();
    }

    /// What another program wrote to the file since it was read, where it differs.
    pub fn changed_outside(&mut self) -> Option<&str> {
        if let Some(theirs) = self.files.changed_outside() {
            self.theirs = Some(theirs);
        }
        if self.theirs.as_deref() == self.files.held() {
            self.theirs = None;
        }
        self.theirs.as_deref()
    }

    /// Takes over what another program wrote; what was here can be had back by undoing.
    ///
    /// # Errors
    /// Where it is no project, with the place; all stays as it was.
    pub fn take_theirs(&mut self) -> Result<(), DocumentError> {
        let Some(theirs) = self.theirs.clone() else { return Ok(()) };
        self.become_text(theirs.clone(), "file read again".to_owned(), None)?;
        self.files.accept(&theirs);
        self.theirs = None;
        Ok(())
    }

    /// Holds on to what is here: the next save replaces what another program wrote.
    pub fn keep_ours(&mut self) {
        if let Some(theirs) = self.theirs.take() {
            self.files.accept(&theirs);
        }
    }
}

/// A project of the photographs in a folder.
fn begun(path: &Path) -> Result<String, DocumentError> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let is_photograph = |file: &PathBuf| {
        let ending = file.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        file.is_file() && ending.is_some_and(|ending| PHOTOGRAPHS.contains(&ending.as_str()))
    };
    let entries = fs::read_dir(folder).map_err(|error| DocumentError(format!("{}: {error}", folder.display())))?;
    let mut found: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(is_photograph).collect();
    found.sort();
    if found.is_empty() {
        let why = format!("{}: neither {PROJECT_FILE_NAME} nor photographs (JPEG, PNG or TIFF) are here", folder.display());
        return Err(DocumentError(why));
    }
    let mut doc = DocumentMut::new();
    let mut project = toml_edit::Table::new();
    let name = fs::canonicalize(folder).ok().and_then(|f| Some(f.file_name()?.to_string_lossy().into_owned()));
    project.insert("name", toml_edit::value(name.unwrap_or_default()));
    doc.insert("project", toml_edit::Item::Table(project));
    for file in found.iter().filter_map(|file| file.file_name()) {
        Edit::AddPhoto { file: file.to_string_lossy().into_owned() }.apply(&mut doc).map_err(DocumentError)?;
    }
    Ok(doc.to_string())
}
