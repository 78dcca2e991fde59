//! What a bundle was made of and what became of it: the part of the manifest that tells of preparation, and whether the inputs are still what they were.

use crate::site::{SITE_FILE_NAME, Site};
use crate::storage::StoredFile;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

/// What preparation made of the files' geometry. Bundles of sites without `[prepare]`, and those that were written before this was kept, have none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Prepared {
    /// The parts, in the order of the manifest's.
    pub parts: Vec<PreparedPart>,
    /// What looking for what nobody sees came to; none where nobody looked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub purge: Option<PurgeCheck>,
}

/// What became of a part's triangles, in the order in which it happened.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PreparedPart {
    /// Vertices in its files.
    pub vertices_read: u64,
    /// Triangles in its files.
    pub triangles_read: u64,
    /// Triangles after cleaning and uniting.
    pub triangles_cleaned: u64,
    /// Triangles after splitting what is coarse: what rays of light meet.
    pub triangles_original: u64,
    /// Triangles that are drawn.
    pub triangles_drawn: u64,
    /// Triangles that nobody sees, which only hold the light that they reflect.
    pub triangles_hidden: u64,
    /// The error that was allowed in the end, pixels of the display: as `[prepare]` says, or more where the number of triangles wanted it; 0 without rooms.
    pub error_px: f64,
    /// The edge that was allowed in the end, in the same pixels; 0 without rooms.
    pub edge_px: f64,
    /// As `error_px` of a site without rooms, metres; 0 with any.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub error_m: f64,
    /// As `edge_px` of a site without rooms, metres; 0 with any.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub edge_m: f64,
    /// How often cleaning found each kind of fault; those that it did not find are left out.
    pub found: BTreeMap<String, u64>,
    /// How far what was simplified is off the original, where it was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<MeasuredError>,
}

impl PreparedPart {
    /// The limits of simplification in words, in pixels or, without rooms, in metres.
    #[must_use]
    pub fn limits(&self) -> String {
        let Self { error_px, edge_px, error_m, edge_m, .. } = self;
        if *error_m > 0.0 {
            format!("{error_m:.4} m of error and edges of {edge_m:.3} m")
        } else {
            format!("{error_px:.2} px of error and edges of {edge_px:.1} px")
        }
    }
}

/// Manifests of sites with rooms are as they were before there were limits in metres.
fn is_zero(length_m: &f64) -> bool {
    *length_m == 0.0
}

/// How far the original's vertices are off what is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasuredError {
    /// The mean, pixels of the display from the nearest room; 0 without rooms, as the next two.
    pub mean_px: f64,
    /// What 95 of 100 do not exceed, pixels.
    pub p95_px: f64,
    /// The greatest, pixels.
    pub max_px: f64,
    /// The mean, metres.
    pub mean_m: f64,
    /// The greatest, metres.
    pub max_m: f64,
}

impl fmt::Display for MeasuredError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { mean_px, p95_px, max_px, mean_m, max_m } = self;
        if *max_px > 0.0 {
            write!(
                f,
                "{mean_px:.2} px in the mean, {p95_px:.2} px at the 95th percentile, {max_px:.1} px ({max_m:.4} m) at most"
            )
        } else {
            write!(f, "{mean_m:.4} m in the mean, {max_m:.4} m at most")
        }
    }
}

/// Frames from random eyes with what nobody sees and without it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PurgeCheck {
    /// Pixels that showed something.
    pub pixels: u64,
    /// Of these, how many show another triangle afterwards.
    pub wrong: u64,
}

/// Whether an input is still what the bundle was made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum InputState {
    /// The same bytes.
    Same,
    /// Others.
    Changed,
    /// There is no such file.
    Missing,
}

/// Compares the inputs of a bundle with the files of a site's folder, each hashed whole where its size is right. Those outside of the folder, of which
/// manifests hold the names only, are looked for where `site.toml` says now, and beside the files that it names.
#[must_use]
pub fn compare_inputs(inputs: &[StoredFile], folder: &Path) -> Vec<InputState> {
    // a site that has a fault by now still has its other files
    let named: Vec<PathBuf> = match Site::read(folder).and_then(|site| site.input_files()) {
        Ok(files) => files.into_iter().map(|file| file.path).collect(),
        Err(_) => Vec::new(),
    };
    let state = |input: &StoredFile| {
        let elsewhere = named.iter().filter(|path| path.file_name().is_some_and(|name| *name == *input.path));
        let beside = named.iter().filter_map(|path| Some(path.parent()?.join(&input.path)));
        let places = std::iter::once(folder.join(&input.path)).chain(elsewhere.cloned()).chain(beside);
        let states = places.filter(|path| path.is_file()).map(|path| compare(input, &path));
        // of several files of one name any may be meant
        states.fold(InputState::Missing, |found, state| match (found, state) {
            (InputState::Same, _) | (_, InputState::Same) => InputState::Same,
            _ => InputState::Changed,
        })
    };
    inputs.iter().map(state).collect()
}

fn compare(input: &StoredFile, path: &Path) -> InputState {
    let as_long = fs::metadata(path).is_ok_and(|data| data.len() == input.bytes);
    let same = as_long && StoredFile::hash(path, &input.path).is_ok_and(|now| now.blake3 == input.blake3);
    if same { InputState::Same } else { InputState::Changed }
}

/// The folder of the site that a bundle was made of, if it stands where bakes put it: in that folder.
#[must_use]
pub fn site_beside(bundle: &Path) -> Option<PathBuf> {
    let folder = bundle.canonicalize().ok()?.parent()?.to_owned();
    folder.join(SITE_FILE_NAME).is_file().then_some(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_are_found_changed_and_missed() {
        let root = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = root.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, text).unwrap();
            path
        };
        let site =
            "[site]\nname = \"a\"\n[[part]]\nfile = \"../outside/b.ply\"\n[sky]\nprobes = \"a.hdr\"\nmapping = \"lat-long\"\n";
        write("site/site.toml", site);
        let input = |name: &str, path: &str, text: &str| StoredFile::hash(&write(path, text), name).unwrap();
        let inputs = [
            input("a.hdr", "site/a.hdr", "sky"),
            input("b.ply", "outside/b.ply", "mesh"),
            input("b.png", "outside/b.png", "picture"),
            input("deep/c.bin", "site/deep/c.bin", "buffer"),
        ];
        let states = || compare_inputs(&inputs, &root.path().join("site"));
        assert_eq!(states(), [InputState::Same; 4]);
        write("site/a.hdr", "sly");
        write("outside/b.png", "a larger picture");
        fs::remove_file(root.path().join("site/deep/c.bin")).unwrap();
        assert_eq!(states(), [InputState::Changed, InputState::Same, InputState::Changed, InputState::Missing]);
        // without the site's own word only what lies in its folder is found
        write("site/site.toml", "no site");
        assert_eq!(states()[..2], [InputState::Changed, InputState::Missing]);
        assert_eq!(site_beside(&root.path().join("site/deep")).unwrap(), root.path().join("site").canonicalize().unwrap());
        assert_eq!(site_beside(&root.path().join("site")), None);
    }
}
