//! Child processes: started without a shell, their complaints kept, never left behind.

use crate::FilmError;
use std::ffi::{OsStr, OsString};
use std::io::Read;
use std::path::Path;
use std::process::{Child, ChildStderr, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// The containers that are opened, by `ffmpeg`'s names of their readers. Playlists (`hls`, `concat`, `dash`) name other files and places, and text is
/// drawn as a film (`tty`): none of them is here.
pub const FORMATS: &str = "mov,mp4,matroska,webm,avi,ogg,mpegts,mpeg,flv,asf,mxf,gif,apng,ivf,h264,hevc,obu,image2,png_pipe,jpeg_pipe,webp_pipe,y4m,yuv4mpegpipe";

/// The most that is kept of what a process complains, in bytes; the rest is read and forgotten.
const MAX_COMPLAINTS: usize = 8 << 10;

/// A program with the arguments that every run of it has.
pub(crate) fn command(program: &'static str) -> Command {
    let mut command = Command::new(program);
    command.args(["-v", "error", "-hide_banner"]).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// The arguments of a file that is read: whatever its name, it is a file, and of a container.
pub(crate) fn input(path: &Path) -> [OsString; 6] {
    ["-protocol_whitelist", "file,pipe", "-format_whitelist", FORMATS, "-i"]
        .map(OsString::from)
        .into_iter()
        .chain([file_url(path)])
        .collect::<Vec<_>>()
        .try_into()
        .unwrap_or_default()
}

/// A file's name that can be neither an option nor another protocol.
pub(crate) fn file_url(path: &Path) -> OsString {
    let mut url = OsString::from("file:");
    url.push(path);
    url
}

/// Starts it.
pub(crate) fn spawn(command: &mut Command, program: &'static str) -> Result<Child, FilmError> {
    command.spawn().map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => FilmError::NoProgram { program },
        _ => FilmError::Program { program, problem: error.to_string() },
    })
}

/// The last line that says something, of what a process complained, without addresses in memory and without our `file:`.
pub(crate) fn last_complaint(complaints: &str) -> Option<String> {
    let line = complaints.lines().rev().map(str::trim).find(|line| !line.is_empty())?;
    // "[mov,mp4 @ 0x55cb] moov atom not found"
    let line = if line.starts_with('[') { line.split_once("] ").map_or(line, |(_, text)| text) } else { line };
    Some(line.replace("file:", ""))
}

/// Reads what a process complains on a thread of its own, so that it never waits for us.
pub(crate) fn listen(stderr: Option<ChildStderr>) -> JoinHandle<String> {
    std::thread::spawn(move || {
        let Some(mut stderr) = stderr else { return String::new() };
        let (mut kept, mut buffer) = (Vec::new(), [0; 1024]);
        while let Ok(count @ 1..) = stderr.read(&mut buffer) {
            let room = MAX_COMPLAINTS - kept.len().min(MAX_COMPLAINTS);
            kept.extend_from_slice(&buffer[..count.min(room)]);
        }
        String::from_utf8_lossy(&kept).into_owned()
    })
}

/// What a process did, all of it: for the short ones.
pub(crate) fn output<S: AsRef<OsStr>>(
    program: &'static str,
    arguments: impl IntoIterator<Item = S>,
) -> Result<(ExitStatus, Vec<u8>, String), FilmError> {
    let failed = |error: std::io::Error| FilmError::Program { program, problem: error.to_string() };
    let mut child = spawn(command(program).args(arguments), program)?;
    let complaints = listen(child.stderr.take());
    let mut bytes = Vec::new();
    let read = child.stdout.take().map_or(Ok(0), |mut stdout| stdout.read_to_end(&mut bytes));
    let status = child.wait().map_err(failed)?;
    read.map_err(failed)?;
    Ok((status, bytes, complaints.join().unwrap_or_default()))
}

/// The processes that a reader has, which another thread may end at any time.
#[derive(Debug, Default)]
pub(crate) struct Reins(Mutex<Held>);

#[derive(Debug, Default)]
struct Held {
    stopped: bool,
    next: u64,
    children: Vec<(u64, Child)>,
}

impl Reins {
    pub(crate) fn new() -> Arc<Self> {
        Arc::new(Self::default())
    }

    fn held(&self) -> MutexGuard<'_, Held> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a process in; its name among the others.
    pub(crate) fn adopt(&self, mut child: Child) -> u64 {
        let mut held = self.held();
        if held.stopped {
            // it may have ended by itself
            let _ = child.kill();
        }
        held.next += 1;
        let name = held.next;
        held.children.push((name, child));
        name
    }

    /// Waits for one that has nothing more to say.
    pub(crate) fn wait(&self, name: u64) -> Option<ExitStatus> {
        let child = {
            let mut held = self.held();
            let at = held.children.iter().position(|(other, _)| *other == name)?;
            held.children.swap_remove(at).1
        };
        reap(child, false)
    }

    /// Ends one.
    pub(crate) fn end(&self, name: u64) {
        let mut held = self.held();
        if let Some(at) = held.children.iter().position(|(other, _)| *other == name) {
            let (_, child) = held.children.swap_remove(at);
            reap(child, true);
        }
    }

    /// Ends all, and whatever is still to be adopted. Returns at once; who reads from them meets their end.
    pub(crate) fn stop(&self) {
        let mut held = self.held();
        held.stopped = true;
        for (_, child) in &mut held.children {
            let _ = child.kill();
        }
    }

    pub(crate) fn is_stopped(&self) -> bool {
        self.held().stopped
    }
}

impl Drop for Reins {
    fn drop(&mut self) {
        let held = self.0.get_mut().unwrap_or_else(PoisonError::into_inner);
        for (_, child) in held.children.drain(..) {
            reap(child, true);
        }
    }
}

/// Waits for a process, so that no zombie stays; a killed one has ended in a moment.
fn reap(mut child: Child, kill: bool) -> Option<ExitStatus> {
    if kill {
        let _ = child.kill();
    }
    child.wait().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_files_and_complaints_are_for_people() {
        assert_eq!(file_url(Path::new("-x.mp4")), OsString::from("file:-x.mp4"));
        assert_eq!(file_url(Path::new("http://a/b.mp4")), OsString::from("file:http://a/b.mp4"));
        assert_eq!(input(Path::new("concat:a|b"))[5], OsString::from("file:concat:a|b"));
        assert_eq!(
            last_complaint("[mov,mp4 @ 0x55]  a\n[x @ 0x1] moov atom not found\n\n").as_deref(),
            Some("moov atom not found")
        );
        assert_eq!(last_complaint("file:a.mp4: Invalid data").as_deref(), Some("a.mp4: Invalid data"));
        assert_eq!(last_complaint("\n"), None);
    }

    #[test]
    fn a_program_that_is_not_there_is_told_with_its_remedy() {
        let error = output("heliodon-has-no-such-program", ["-x"]).unwrap_err().to_string();
        assert!(error.contains("not installed") && error.contains("apt-get install ffmpeg"), "{error}");
    }

    #[test]
    #[cfg(unix)]
    fn what_is_stopped_ends_at_once() {
        let reins = Reins::new();
        let child = Command::new("sleep").arg("100").spawn().unwrap();
        let name = reins.adopt(child);
        reins.stop();
        assert!(!reins.wait(name).unwrap().success());
        let late = reins.adopt(Command::new("sleep").arg("100").spawn().unwrap());
        assert!(!reins.wait(late).unwrap().success() && reins.is_stopped());
    }
}
