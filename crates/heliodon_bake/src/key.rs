//! What decides a bake's result, as one hash: the name under which its finished work is kept.

use crate::names::SceneDigests;
use heliodon_bundle::StoredFile;
use heliodon_bundle::site::{Bake, Site, told_path};
use serde::Serialize;
use std::path::Path;

/// The program, its version, and a revision that changes with the sources of all that decides what a bake computes, made by
/// the build script. Bundles and kept work of another revision are made anew.
pub const TOOL: &str = concat!("heliodon ", env!("CARGO_PKG_VERSION"), " ", env!("HELIODON_BAKE_REVISION"));

/// What manifests call a file: its path from the site's folder with `/` between folders; outside of the site only its name,
/// for manifests tell nothing of the machine.
#[must_use]
pub fn told_name(site: &Path, path: &Path) -> String {
    told_path(path.strip_prefix(site).unwrap_or_else(|_| path.file_name().map_or(path, Path::new)))
}

/// Hashes runs of bytes, each after its length.
#[derive(Clone, Debug, Default)]
pub struct Digest(blake3::Hasher);

impl Digest {
    /// That of one run.
    #[must_use]
    pub fn of(bytes: &[u8]) -> [u8; 32] {
        let mut digest = Self::default();
        digest.run(bytes);
        digest.bytes()
    }

    /// Adds a run.
    pub fn run(&mut self, bytes: &[u8]) {
        self.0.update(&(bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
    }

    /// Adds what has a JSON form: plain structs of numbers and words always have one; without it the hash is only less specific.
    pub fn json(&mut self, value: &impl Serialize) {
        self.run(&serde_json::to_vec(value).unwrap_or_default());
    }

    /// The hash.
    #[must_use]
    pub fn bytes(&self) -> [u8; 32] {
        *self.0.finalize().as_bytes()
    }

    /// Thirty-two hexadecimal digits of it, for names of folders.
    #[must_use]
    pub fn folder_digits(&self) -> String {
        self.0.finalize().to_hex()[..32].to_owned()
    }

    /// Sixteen hexadecimal digits of it, for names of blocks.
    #[must_use]
    pub fn digits(&self) -> String {
        self.0.finalize().to_hex()[..16].to_owned()
    }
}

/// The key of a bake: program, parameters, geometry and albedo as they were read, and the probes. It names the folder; what is in it has names of
/// its own ([`crate::names`]).
///
/// The geometry's content is hashed rather than its files, for files name others (materials, textures, buffers); names, rooms,
/// actors and comments in `site.toml` change no light of a vertex and are left out; so is the grid's spacing.
#[must_use]
pub fn bake_key(site: &Site, scene: &SceneDigests, probes: &[&StoredFile]) -> String {
    let mut digest = Digest::default();
    let info = &site.site;
    digest.run(TOOL.as_bytes());
    digest.json(&site.sky);
    digest.json(&Bake { grid_m: None, ..site.bake.clone() });
    digest.json(&(info.latitude_deg, info.longitude_deg, info.utc_offset, info.north_deg));
    digest.json(&probes);
    digest.run(&scene.geometry);
    digest.run(&scene.albedo);
    digest.folder_digits()
}

#[cfg(test)]
#[path = "../build/sources.rs"]
mod sources;

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn every_crate_that_a_bake_uses_counts_in_its_revision() {
        let manifest = fs::read_to_string("Cargo.toml").unwrap();
        let (_, used) = manifest.split_once("\n[dependencies]\n").unwrap();
        let used = used
            .lines()
            .take_while(|line| !line.starts_with('['))
            .filter_map(|line| line.split('.').next().filter(|name| name.starts_with("heliodon_")));
        let used: Vec<&str> = used.collect();
        assert!(used.len() >= 7, "{used:?}");
        assert!(used.iter().all(|name| sources::CRATES.contains(name)), "{used:?}");
        assert_eq!(TOOL.split(' ').next_back(), sources::revision(Path::new("..")).unwrap().as_deref());
    }

    #[test]
    fn the_revision_changes_with_any_source_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, content: &str| {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, content).unwrap();
        };
        let revision = || sources::revision(folder.path()).unwrap();
        for name in sources::CRATES {
            assert_eq!(revision(), None, "not all crates are there");
            write(&format!("{name}/Cargo.toml"), "[package]\n");
            write(&format!("{name}/src/deep/er.rs"), "fn f() {}\nfn g() {}\n");
        }
        let first = revision().unwrap();
        assert_eq!(first.len(), 16);
        write("heliodon_light/src/deep/er.rs", "fn f() {}\r\nfn g() {}\r\n");
        write("heliodon_light/tests/er.rs", "a test");
        assert_eq!(revision().as_ref(), Some(&first));
        write("heliodon_light/src/deep/er.rs", "fn f() {}\nfn h() {}\n");
        let second = revision().unwrap();
        write("heliodon_light/src/more.rs", "");
        assert!(second != first && revision().unwrap() != second);
    }

    #[test]
    fn manifests_name_no_folder_outside_of_the_site() {
        let told = |path: &str| told_name(Path::new("sites/temple"), Path::new(path));
        assert_eq!(told("sites/temple/scans/west.ply"), "scans/west.ply");
        assert_eq!(told("/home/someone/west.ply"), "west.ply");
        assert_eq!(told("sites/temple/../secret/west.ply"), "west.ply");
        assert_eq!(told_name(Path::new("."), Path::new("./scans/west.ply")), "scans/west.ply");
    }
}
