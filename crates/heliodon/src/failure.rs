//! How the program ends.

use std::process::ExitCode;

/// Arguments that are each well formed but cannot be meant together, or cannot be done: exit code 2, like clap's own.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct WrongArguments(pub String);

/// Returns with [`WrongArguments`].
macro_rules! wrong_arguments {
    ($($text:tt)*) => {
        return Err(anyhow::Error::new($crate::failure::WrongArguments(format!($($text)*))))
    };
}
pub(crate) use wrong_arguments;

/// Tells what failed and chooses the exit code: 1 failed, 2 wrong arguments. A reader of our output who has gone away
/// (`heliodon inspect x | head -1`) is no failure.
#[expect(clippy::print_stderr, reason = "the one place where the program's errors are told")]
pub fn report(error: &anyhow::Error) -> ExitCode {
    let broken_pipe = |cause: &(dyn std::error::Error + 'static)| cause.downcast_ref::<crate::output::ReaderGone>().is_some();
    if error.chain().any(broken_pipe) {
        return ExitCode::SUCCESS;
    }
    if let Some(wrong) = error.downcast_ref::<WrongArguments>() {
        eprintln!("error: {wrong}\n\nFor more information, try '--help'.");
        return ExitCode::from(2);
    }
    eprintln!("error: {}", one_message(error));
    ExitCode::FAILURE
}

/// The chain of causes in one line. Libraries that put their source into their own text would repeat it: a cause that the
/// text so far already ends with is left out.
fn one_message(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain() {
        let cause = cause.to_string();
        if text.is_empty() {
            text = cause;
        } else if !text.contains(&cause) {
            text.push_str(": ");
            text.push_str(&cause);
        }
    }
    text
}

/// What Bevy and its window library panic with where the machine lacks something, and what to tell instead.
const MISSING: &[(&str, &str)] = &[
    (
        "Unable to find a GPU",
        "there is no graphics driver; without a GPU, Mesa's software Vulkan will do (Debian, Ubuntu: apt-get install mesa-vulkan-drivers)",
    ),
    (
        "Failed to build event loop",
        "there is no display to open a window on; `heliodon render` and `heliodon demo --headless` make pictures without one",
    ),
];

/// Makes a panic say what it is: something that the machine lacks, or our bug.
#[expect(clippy::print_stderr, reason = "a panic hook has nothing else")]
pub fn install_panic_hook() {
    std::panic::set_hook(Box::new(|info| {
        let what = info.payload_as_str().unwrap_or("no message");
        if let Some((_, lack)) = MISSING.iter().find(|(begins, _)| what.contains(begins)) {
            eprintln!("error: {lack}");
            return;
        }
        let place = info.location().map_or_else(String::new, |place| format!(" ({}:{})", place.file(), place.line()));
        eprintln!("error: this is a bug in heliodon {}: {what}{place}", env!("CARGO_PKG_VERSION"));
        eprintln!("Nothing that was finished is lost. Please report it with the command that you ran and its input.");
    }));
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context;

    #[test]
    fn a_cause_is_told_once() {
        let inner = std::io::Error::other("disk full");
        let error = Err::<(), _>(inner).context("cannot write a.ply: disk full").context("baking").unwrap_err();
        assert_eq!(one_message(&error), "baking: cannot write a.ply: disk full");
    }
}
