//! Writes a project of simulated photographs to try the window with: `cargo run -p heliodon_mark --example simulated DIR [WIDTH]`.
//!
//! One mark in it is wrong, and two corners are not marked yet.

mod scene;

use scene::Scene;
use std::path::PathBuf;
use std::process::ExitCode;

#[expect(clippy::print_stderr, reason = "the only way to tell what is wrong")]
fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    let Some(folder) = arguments.next().map(PathBuf::from) else {
        eprintln!("give a folder to write to, and the width of the photographs");
        return ExitCode::from(2);
    };
    let width = arguments.next().and_then(|width| width.to_str()?.parse().ok()).unwrap_or(1600);
    if let Err(error) = std::fs::create_dir_all(&folder) {
        eprintln!("{}: {error}", folder.display());
        return ExitCode::FAILURE;
    }
    let scene = Scene::new(width, 5);
    scene.write_photographs(&folder);
    let is_left = |corner: &str, number: usize| corner == "tower-ne-top" || (corner == "house-se-top" && number > 1);
    scene.write_project(&folder, is_left, Some(("tower-se-top", 2)));
    ExitCode::SUCCESS
}
