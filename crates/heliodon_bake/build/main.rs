//! Gives the bake its revision: what bundles and kept work say of the code that made them (see `src/key.rs`).
#![expect(clippy::print_stdout, reason = "a build script talks to Cargo on standard output")]

mod sources;

use std::path::Path;

fn main() -> std::io::Result<()> {
    // registries keep each crate in a folder of its own: there the version stands for the sources, which never change
    let revision = match sources::revision(Path::new(".."))? {
        Some(revision) => {
            for folder in sources::CRATES {
                println!("cargo::rerun-if-changed=../{folder}/src");
                println!("cargo::rerun-if-changed=../{folder}/Cargo.toml");
            }
            println!("cargo::rerun-if-changed=build");
            revision
        }
        None => "release".to_owned(),
    };
    println!("cargo::rustc-env=HELIODON_BAKE_REVISION={revision}");
    Ok(())
}
