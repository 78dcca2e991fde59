//! One number for the sources of all that decides what a bake computes.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The crates whose code decides a bake's result, in their folders beside one another.
pub const CRATES: [&str; 12] = [
    "heliodon_bake",
    "heliodon_bundle",
    "heliodon_image",
    "heliodon_light",
    "heliodon_lightmap",
    "heliodon_math",
    "heliodon_mesh",
    "heliodon_photo",
    "heliodon_prepare",
    "heliodon_raster",
    "heliodon_rays",
    "heliodon_sky",
];

/// Sixteen hexadecimal digits that change with the sources and manifests of the crates in `folder`; the same on every machine and for
/// either kind of line ends. `None` where the crates do not lie beside one another.
pub fn revision(folder: &Path) -> io::Result<Option<String>> {
    if CRATES.iter().any(|name| !folder.join(name).join("src").is_dir()) {
        return Ok(None);
    }
    let mut hash = Fnv::new();
    for name in CRATES {
        let mut files = vec![folder.join(name).join("Cargo.toml")];
        collect(&folder.join(name).join("src"), &mut files)?;
        let mut told: Vec<(String, PathBuf)> = files.into_iter().map(|file| (told_name(&file, folder), file)).collect();
        told.sort();
        for (name, file) in told {
            let mut content = fs::read(&file)?;
            content.retain(|&byte| byte != b'\r');
            hash.add(name.as_bytes());
            hash.add(&content);
        }
    }
    Ok(Some(hash.digits()))
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, files)?;
        } else {
            files.push(path);
        }
    }
    Ok(())
}

fn told_name(file: &Path, folder: &Path) -> String {
    let parts = file.strip_prefix(folder).unwrap_or(file).components();
    parts.map(|part| part.as_os_str().to_string_lossy().into_owned()).collect::<Vec<_>>().join("/")
}

/// FNV-1a of 128 bits (Fowler, Noll, Vo): a build script needs no library for it, and nobody forges sources to keep an old bundle.
struct Fnv(u128);

impl Fnv {
    fn new() -> Self {
        Self(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d)
    }

    /// Adds bytes, after their number.
    fn add(&mut self, bytes: &[u8]) {
        for byte in (bytes.len() as u64).to_le_bytes().iter().chain(bytes) {
            self.0 = (self.0 ^ u128::from(*byte)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b);
        }
    }

    fn digits(&self) -> String {
        format!("{:016x}", (self.0 >> 64) as u64 ^ self.0 as u64)
    }
}
