//! Automatic matching by COLMAP, where it is installed.
//!
//! Run as a program, not linked: it is large, brings its own CUDA, and a project is as well marked by hand.

use crate::formats::{FormatError, ImportedCameras, colmap};
use std::ffi::{OsStr, OsString};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The folder beside the project that COLMAP works in.
pub const COLMAP_FOLDER: &str = "colmap";

/// Why nothing was matched.
#[derive(Debug, thiserror::Error)]
pub enum MatchError {
    /// COLMAP is not there.
    #[error(
        "COLMAP is not installed (no program `{0}`): Debian and Ubuntu have it as `apt-get install colmap`, others at https://colmap.github.io; \
         or mark points by hand"
    )]
    NotInstalled(String),
    /// Too few photographs.
    #[error("the project has {0} photographs, and matching needs two")]
    TooFew(usize),
    /// A photograph lies outside the project's folder, or there is none.
    #[error("{0}: COLMAP needs the photographs inside the project's folder")]
    Photograph(String),
    /// A folder or list could not be written.
    #[error("{file}: {why}")]
    Write {
        /// Which.
        file: String,
        /// The system's words.
        why: String,
    },
    /// A step failed.
    #[error("colmap {step} failed{why}; its log is {log}")]
    Step {
        /// Which.
        step: String,
        /// The log's last line.
        why: String,
        /// Where it is.
        log: String,
    },
    /// Nothing came of it.
    #[error("COLMAP found no two photographs that fit together: they need to overlap by half or more")]
    Nothing,
    /// What it wrote cannot be read.
    #[error(transparent)]
    Format(#[from] FormatError),
}

/// What COLMAP made.
#[derive(Clone, Debug)]
pub struct Matched {
    /// Its cameras and points.
    pub cameras: ImportedCameras,
    /// The model's folder, from the project's own.
    pub model: String,
    /// How many separate models it made; the one with most photographs was taken.
    pub models: usize,
}

/// Finds features, matches all pairs and maps. `program` is `colmap` or the path of one; `photos` are files from `folder`; `stage` is told
/// what happens.
///
/// # Errors
/// Where COLMAP is not installed, a step fails, or nothing comes of it.
pub fn run(program: &OsStr, folder: &Path, photos: &[String], stage: &mut dyn FnMut(&str)) -> Result<Matched, MatchError> {
    if photos.len() < 2 {
        return Err(MatchError::TooFew(photos.len()));
    }
    if let Some(photo) = photos.iter().find(|p| !folder.join(p).is_file() || Path::new(p).is_absolute()) {
        return Err(MatchError::Photograph(photo.clone()));
    }
    let work = folder.join(COLMAP_FOLDER);
    let sparse = work.join("sparse");
    let written =
        |file: &Path, error: std::io::Error| MatchError::Write { file: file.display().to_string(), why: error.to_string() };
    // A map of another day would be read for this one's.
    if sparse.is_dir() {
        std::fs::remove_dir_all(&sparse).map_err(|e| written(&sparse, e))?;
    }
    std::fs::create_dir_all(&sparse).map_err(|e| written(&sparse, e))?;
    let list = work.join("photos.txt");
    std::fs::write(&list, photos.join("\n") + "\n").map_err(|e| written(&list, e))?;
    let database = work.join("database.db");
    let mut step = |name: &str, arguments: &[(&str, &OsStr)]| -> Result<(), MatchError> {
        stage(&format!("colmap {name}"));
        let log = work.join(format!("{name}.log"));
        let output = std::fs::File::create(&log).map_err(|e| written(&log, e))?;
        let errors = output.try_clone().map_err(|e| written(&log, e))?;
        let words: Vec<OsString> =
            arguments.iter().flat_map(|(key, value)| [OsString::from(key), OsString::from(value)]).collect();
        let status = Command::new(program)
            .arg(name)
            .args(words)
            // Without a display Qt would end the program before it begins.
            .env("QT_QPA_PLATFORM", "offscreen")
            .stdin(Stdio::null())
            .stdout(output)
            .stderr(errors)
            .status();
        let fault = |why: String| MatchError::Step { step: name.to_owned(), why, log: log.display().to_string() };
        match status {
            Ok(status) if status.success() => Ok(()),
            Ok(_) => {
                let text = std::fs::read_to_string(&log).unwrap_or_default();
                let last = text.lines().rev().find(|l| !l.trim().is_empty());
                Err(fault(last.map(|l| format!(": {}", l.trim())).unwrap_or_default()))
            }
            Err(error) if error.kind() == ErrorKind::NotFound => {
                Err(MatchError::NotInstalled(program.to_string_lossy().into_owned()))
            }
            Err(error) => Err(fault(format!(": {error}"))),
        }
    };
    // With a GPU first. Without one, or without a display for OpenGL, COLMAP fails; which option says so depends on its version.
    let mut attempts = |name: &str, arguments: &[(&str, &OsStr)], options: [&str; 2]| {
        let first = step(name, arguments);
        if !matches!(first, Err(MatchError::Step { .. })) {
            return first;
        }
        for option in options {
            if step(name, &[arguments, &[(option, OsStr::new("0"))]].concat()).is_ok() {
                return Ok(());
            }
        }
        first
    };
    let (database, images) = (database.as_os_str(), folder.as_os_str());
    let model = ("--ImageReader.camera_model", OsStr::new("RADIAL"));
    let files = [("--database_path", database), ("--image_path", images), ("--image_list_path", list.as_os_str()), model];
    attempts("feature_extractor", &files, ["--SiftExtraction.use_gpu", "--FeatureExtraction.use_gpu"])?;
    let options = ["--SiftMatching.use_gpu", "--FeatureMatching.use_gpu"];
    attempts("exhaustive_matcher", &[("--database_path", database)], options)?;
    step("mapper", &[("--database_path", database), ("--image_path", images), ("--output_path", sparse.as_os_str())])?;
    largest_model(&sparse)
}

fn largest_model(sparse: &Path) -> Result<Matched, MatchError> {
    let mut folders: Vec<PathBuf> = std::fs::read_dir(sparse)
        .map(|all| all.filter_map(Result::ok).map(|entry| entry.path()).filter(|path| path.is_dir()).collect())
        .unwrap_or_default();
    folders.sort();
    let mut best: Option<(ImportedCameras, PathBuf)> = None;
    for folder in &folders {
        let cameras = colmap::read(folder)?;
        if best.as_ref().is_none_or(|(b, _)| cameras.cameras.len() > b.cameras.len()) {
            best = Some((cameras, folder.clone()));
        }
    }
    let Some((cameras, path)) = best.filter(|(c, _)| c.cameras.len() >= 2) else { return Err(MatchError::Nothing) };
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(Matched { cameras, model: format!("{COLMAP_FOLDER}/sparse/{name}"), models: folders.len() })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A program that stands in for COLMAP: fails on a GPU as an old version without one does, and maps two photographs.
    #[cfg(unix)]
    #[test]
    fn what_colmap_writes_is_read_back() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let photos = ["a.jpg".to_owned(), "b.jpg".to_owned(), "c.jpg".to_owned()];
        for photo in &photos {
            std::fs::write(folder.path().join(photo), b"").unwrap();
        }
        let program = folder.path().join("stand-in");
        let script = r#"#!/bin/sh
case "$1 $*" in
  mapper*)
    for argument in "$@"; do out="$argument"; done
    mkdir -p "$out/0" "$out/1"
    printf '1 PINHOLE 640 480 500 500 320 240\n' | tee "$out/0/cameras.txt" > "$out/1/cameras.txt"
    printf '1 1 0 0 0 0 0 0 1 a.jpg\n\n' > "$out/0/images.txt"
    printf '1 1 0 0 0 0 0 0 1 b.jpg\n\n2 1 0 0 0 1 0 0 1 c.jpg\n\n' > "$out/1/images.txt" ;;
  *SiftExtraction.use_gpu\ 0*|*SiftMatching.use_gpu\ 0*) ;;
  *) echo "cannot make an OpenGL context"; exit 1 ;;
esac
"#;
        std::fs::write(&program, script).unwrap();
        std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
        let mut stages = Vec::new();
        let matched = run(program.as_os_str(), folder.path(), &photos, &mut |s| stages.push(s.to_owned())).unwrap();
        assert_eq!((matched.model.as_str(), matched.models, matched.cameras.cameras.len()), ("colmap/sparse/1", 2, 2));
        assert_eq!(stages.last().map(String::as_str), Some("colmap mapper"));
    }

    #[test]
    fn a_missing_colmap_is_said_with_how_to_install_it() {
        let folder = tempfile::tempdir().unwrap();
        let photos = ["a.jpg".to_owned(), "b.jpg".to_owned()];
        let run = |program: &str| run(OsStr::new(program), folder.path(), &photos, &mut |_| {}).unwrap_err().to_string();
        assert!(run("no-such-colmap").contains("a.jpg"));
        for photo in &photos {
            std::fs::write(folder.path().join(photo), b"").unwrap();
        }
        assert!(run("no-such-colmap").contains("apt-get install colmap"));
        // A program that fails is told with its step and log.
        #[cfg(unix)]
        assert!(run("false").contains("colmap feature_extractor failed"));
        // One that does nothing makes no model.
        #[cfg(unix)]
        assert!(run("true").contains("no two photographs"));
    }
}
