//! The window of `heliodon photo mark` by itself: `cargo run -p heliodon_mark --example mark PROJECT`.

use std::path::PathBuf;
use std::process::ExitCode;

#[expect(clippy::print_stderr, reason = "the only way to tell why there is no window")]
fn main() -> ExitCode {
    let Some(project) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!("give the folder of a project");
        return ExitCode::from(2);
    };
    match heliodon_mark::run(&project) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
