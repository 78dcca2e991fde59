//! COLMAP's steps as runs of its program, each with a log.

use super::MatchError;
use std::ffi::{OsStr, OsString};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};

/// An option and its value.
pub(super) type Argument<'a> = (&'a str, &'a OsStr);

/// A program that is taken for COLMAP, and the folder that it works in.
pub(super) struct Program<'a> {
    pub(super) program: &'a OsStr,
    pub(super) work: &'a Path,
    pub(super) stage: &'a mut dyn FnMut(&str),
}

impl Program<'_> {
    /// Where a step's words are kept.
    pub(super) fn log(&self, step: &str) -> PathBuf {
        self.work.join(format!("{step}.log"))
    }

    /// All that a step has said; nothing where it did not run.
    pub(super) fn said(&self, step: &str) -> String {
        std::fs::read(self.log(step)).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default()
    }

    /// Runs a step; what it says is added to its log.
    pub(super) fn step(&mut self, step: &str, arguments: &[Argument<'_>]) -> Result<(), MatchError> {
        (self.stage)(&format!("colmap {step}"));
        let log = self.log(step);
        let unwritten = |error: std::io::Error| MatchError::Write { file: log.display().to_string(), why: error.to_string() };
        let mut file = std::fs::OpenOptions::new().create(true).append(true).open(&log).map_err(unwritten)?;
        let words: Vec<OsString> =
            arguments.iter().flat_map(|(key, value)| [OsString::from(key), OsString::from(value)]).collect();
        let begin = file.metadata().map_err(unwritten)?.len();
        writeln!(file, "$ colmap {step} {}", words.join(OsStr::new(" ")).to_string_lossy()).map_err(unwritten)?;
        let errors = file.try_clone().map_err(unwritten)?;
        let status = Command::new(self.program)
            .arg(step)
            .args(words)
            // Without a display Qt would end the program before it begins.
            .env("QT_QPA_PLATFORM", "offscreen")
            .stdin(Stdio::null())
            .stdout(file)
            .stderr(errors)
            .status();
        let fault = |why: String| MatchError::Step { step: step.to_owned(), why, log: log.display().to_string() };
        match status {
            Ok(status) if status.success() => Ok(()),
            Ok(status) => {
                let text = self.said(step);
                let text = usize::try_from(begin).ok().and_then(|at| text.get(at..)).unwrap_or(&text);
                Err(fault(ended(status) + &complaint(text)))
            }
            Err(error) if error.kind() == ErrorKind::NotFound => {
                Err(MatchError::NotInstalled(self.program.to_string_lossy().into_owned()))
            }
            Err(error) => Err(fault(format!(": {error}"))),
        }
    }

    /// Runs a step of features on a GPU, and where that fails without one. `family` is what the step's options are called by, which versions
    /// from 3.12 on call `Feature` and those before `Sift`; `options` go with it.
    pub(super) fn feature_step(
        &mut self,
        step: &str,
        arguments: &[Argument<'_>],
        family: &str,
        options: &[Argument<'_>],
    ) -> Result<(), MatchError> {
        let mut told = None;
        // Without a GPU, or a display for OpenGL, the first two end at once; so do those whose options the version does not know.
        for (gpu, version) in [("1", "Sift"), ("1", "Feature"), ("0", "Sift"), ("0", "Feature")] {
            let mut named: Vec<(String, &OsStr)> = vec![(format!("--{version}{family}.use_gpu"), OsStr::new(gpu))];
            named.extend(options.iter().map(|(key, value)| (format!("--{version}{family}.{key}"), *value)));
            let named: Vec<Argument<'_>> = named.iter().map(|(key, value)| (key.as_str(), *value)).collect();
            let result = self.step(step, &[arguments, &named].concat());
            let Err(error) = result else { return Ok(()) };
            let MatchError::Step { why, .. } = &error else { return Err(error) };
            // What an option is called says least of what is wrong.
            if told.is_none() || !why.contains("unrecogni") {
                told = Some(error);
            }
        }
        told.map_or(Ok(()), Err)
    }
}

/// How a program ended that did not end well, where that says more than its words.
fn ended(status: ExitStatus) -> String {
    if status.code().is_none() { format!(" ({status})") } else { String::new() }
}

/// The line of a log that says what is wrong: glog's fatal one or an error; else the last that is not a trace.
fn complaint(log: &str) -> String {
    let lines = || log.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with(['@', '*', '$']));
    let fatal = lines().find(|line| line.contains("Check failed") || line.contains("unrecogni"));
    let error = || lines().rev().find(|line| line.contains("ERROR") || line.contains("rror:"));
    let line = fatal.or_else(error).or_else(|| lines().next_back());
    // Date, thread and place in the source come before the bracket.
    line.map(|line| format!(": {}", line.split_once("] ").map_or(line, |(_, words)| words))).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_logs_complaint_is_found_among_traces() {
        let fatal = "QStandardPaths: XDG_RUNTIME_DIR not set\nF2026 30418 opengl_utils.cc:56] Check failed: context_.create() \n\
                     *** Check failure stack trace: ***\n    @     0x7f2cc22a51ed  google::LogMessage::Fail()\n";
        assert_eq!(complaint(fatal), ": Check failed: context_.create()");
        assert_eq!(complaint("Loading\nERROR: failed to create sparse model\n\n"), ": ERROR: failed to create sparse model");
        assert_eq!(complaint("E0 option_manager.cc] unrecognised option '--x'\n"), ": unrecognised option '--x'");
        assert_eq!(complaint("one\ntwo\n"), ": two");
        assert_eq!(complaint(""), "");
    }
}
