//! The films that a key writes: all of them whole, or none.

use super::{Args, Part};
use crate::files;
use anyhow::{Context, Result, bail};
use heliodon_capture::key::{Blending, Keyed};
use heliodon_film::{Film, FilmFormat, FilmWriter, SoundSource, WriteParams};
use heliodon_mesh::export::beside;
use serde::Serialize;
use std::ffi::OsString;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Where everything was written.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Files {
    /// Premultiplied, black where nothing is, with the sound.
    pub image: PathBuf,
    /// White where nothing is.
    pub mask: PathBuf,
    /// VP9 with alpha.
    pub webm: Option<PathBuf>,
    /// The contact sheet.
    pub sheet: Option<PathBuf>,
}

/// A file that is written beside its place; removed where it does not get there.
struct Staged {
    target: PathBuf,
    beside: PathBuf,
}

impl Staged {
    fn new(target: PathBuf) -> Self {
        Self { beside: beside(&target), target }
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        // once it is in its place there is nothing here
        let _ = fs::remove_file(&self.beside);
    }
}

/// The films while they are written.
pub struct Outputs {
    // writers before the files that they write: they are dropped in this order
    image: FilmWriter,
    mask: FilmWriter,
    webm: Option<FilmWriter>,
    staged: Vec<Staged>,
    files: Files,
    /// Columns and rows of the films.
    size: (u32, u32),
}

impl Outputs {
    /// Looks whether all can be written, and begins.
    pub fn plan(args: &Args, film: &Film, part: &Part) -> Result<Self> {
        let name = match &args.output {
            Some(name) => name.clone(),
            None => default_name(&args.video),
        };
        if name.file_name().is_none() {
            bail!("{}: is no name for films; give one as in -o films/guide", name.display());
        }
        let named = |ending: &str| {
            let mut whole = OsString::from(&name);
            whole.push(ending);
            PathBuf::from(whole)
        };
        let files = Files {
            image: named(".image.mp4"),
            mask: named(".mask.mp4"),
            webm: args.webm.then(|| named(".webm")),
            sheet: args.sheet.clone(),
        };
        for path in [&files.image, &files.mask].into_iter().chain(&files.webm).chain(&files.sheet) {
            files::check_place(path)?;
            if files::is_within(&args.video, path) {
                bail!("{} would be written over, and it is read here; give another name with -o", args.video.display());
            }
        }
        let size = (film.width.next_multiple_of(2), film.height.next_multiple_of(2));
        let sound =
            film.sound.as_ref().map(|_| SoundSource { film: film.clone(), start_s: part.start_s(), length_s: args.seconds });
        let plain = WriteParams { quality: args.quality, ..WriteParams::archival(size.0, size.1, film.rate) };
        let with_sound = WriteParams { sound, ..plain.clone() };
        let staged: Vec<Staged> =
            [&files.image, &files.mask].into_iter().chain(&files.webm).map(|path| Staged::new(path.clone())).collect();
        let webm = WriteParams { format: FilmFormat::Vp9 { alpha: true }, quality: args.quality + 6, ..with_sound.clone() };
        Ok(Self {
            image: FilmWriter::rgba(&staged[0].beside, &with_sound)?,
            mask: FilmWriter::grey(&staged[1].beside, &plain)?,
            webm: staged.get(2).map(|staged| FilmWriter::rgba(&staged.beside, &webm)).transpose()?,
            staged,
            files,
            size,
        })
    }

    /// Writes a frame to all of them.
    pub fn write(&mut self, keyed: Keyed, blending: Blending) -> Result<()> {
        let keyed = keyed.padded(self.size.0 as usize, self.size.1 as usize);
        let written = self.image.write_rgba(&keyed.image).and_then(|()| self.mask.write_grey(&keyed.mask));
        self.told(written)?;
        if let Some(webm) = &mut self.webm {
            let written = webm.write_rgba(&keyed.straight(blending));
            self.told(written)?;
        }
        Ok(())
    }

    /// Speaks of the files' own names, not of those beside them.
    fn told(&self, done: Result<(), heliodon_film::FilmError>) -> Result<()> {
        done.map_err(|error| {
            let text = self.staged.iter().fold(error.to_string(), |text, staged| {
                text.replace(&staged.beside.display().to_string(), &staged.target.display().to_string())
            });
            anyhow::Error::msg(text)
        })
    }

    /// Ends them, and puts all in their places.
    pub fn finish(self, sheet: Option<Vec<u8>>) -> Result<Files> {
        let Self { image, mask, webm, staged, files, .. } = self;
        image.finish()?;
        mask.finish()?;
        webm.map(FilmWriter::finish).transpose()?;
        for Staged { target, beside } in &staged {
            fs::rename(beside, target).with_context(|| format!("cannot write {}", target.display()))?;
        }
        if let (Some(path), Some(sheet)) = (&files.sheet, sheet) {
            files::write_whole(path, |file| file.write_all(&sheet))?;
        }
        Ok(files)
    }
}

/// The film's own name without its ending, beside it; of numbered pictures their folder's.
fn default_name(video: &Path) -> PathBuf {
    if video.to_string_lossy().contains('%')
        && let Some(folder) = video.parent().filter(|folder| folder.file_name().is_some())
    {
        return folder.to_owned();
    }
    video.with_extension("")
}
