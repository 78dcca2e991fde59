//! Films are written: pictures in, a container out.

use crate::frames::seek;
use crate::process::{self, Reins};
use crate::{Film, FilmError, Rate};
use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ChildStdin;
use std::sync::Arc;
use std::thread::JoinHandle;

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilmFormat {
    /// H.264 High profile, 4:2:0, BT.709, in MP4 with its index first: what every player and every decoder in hardware knows. No alpha; even sides.
    H264,
    /// VP9 in WebM, 4:2:0, with alpha where it is asked for: what browsers take.
    Vp9 {
        /// Whether alpha is written; colours then are straight.
        alpha: bool,
    },
    /// PNG files, numbered by a `%04d` in the name, with alpha.
    Pictures,
}

/// Sound that is taken from another film.
#[derive(Clone, Debug, PartialEq)]
pub struct SoundSource {
    /// Which.
    pub film: Film,
    /// The second of it that belongs to the first picture.
    pub start_s: f64,
    /// Seconds of it; `None` for all.
    pub length_s: Option<f64>,
}

/// How a film is written.
#[derive(Clone, Debug, PartialEq)]
pub struct WriteParams {
    /// Container, codec, alpha.
    pub format: FilmFormat,
    /// Columns; even for H.264.
    pub width: u32,
    /// Rows; even for H.264.
    pub height: u32,
    /// Frames a second.
    pub rate: Rate,
    /// The codec's quality, from 0 (nearly without loss) to 40 (small): its constant rate factor. 6 more halve an H.264 film.
    pub quality: u32,
    /// Sound, copied where the container takes its codec, else encoded anew.
    pub sound: Option<SoundSource>,
}

impl WriteParams {
    /// For keeping: H.264 at a quality at which edges of mattes hold, without sound.
    #[must_use]
    pub fn archival(width: u32, height: u32, rate: Rate) -> Self {
        Self { format: FilmFormat::H264, width, height, rate, quality: 14, sound: None }
    }
}

/// What the pixels are that come in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pixels {
    Rgba,
    Grey,
}

/// Writes a film frame by frame. Dropped before [`FilmWriter::finish`], it ends its encoder and leaves a broken file behind, which is the
/// caller's to remove.
#[derive(Debug)]
pub struct FilmWriter {
    path: PathBuf,
    frame_bytes: usize,
    pixels: Pixels,
    stdin: Option<ChildStdin>,
    reins: Arc<Reins>,
    name: u64,
    complaints: Option<JoinHandle<String>>,
}

/// Threads of the encoder: a fixed number, for what x264 writes depends on it.
const ENCODER_THREADS: &str = "4";
/// Seconds between frames at which a player can begin.
const KEY_SECONDS: f64 = 1.0;

impl FilmWriter {
    /// Begins a film of RGBA pictures, 8 bits, sRGB; alpha counts only where the format has it, and colours then are straight.
    ///
    /// # Errors
    /// Odd or empty sizes, or no `ffmpeg`.
    pub fn rgba(path: &Path, params: &WriteParams) -> Result<Self, FilmError> {
        Self::begin(path, params, Pixels::Rgba)
    }

    /// Begins a film of grey pictures, 8 bits.
    ///
    /// # Errors
    /// As [`FilmWriter::rgba`].
    pub fn grey(path: &Path, params: &WriteParams) -> Result<Self, FilmError> {
        Self::begin(path, params, Pixels::Grey)
    }

    fn begin(path: &Path, params: &WriteParams, pixels: Pixels) -> Result<Self, FilmError> {
        let WriteParams { width, height, .. } = *params;
        if width == 0 || height == 0 {
            return Err(FilmError::write(path, "its pictures have no pixels", "give it a size"));
        }
        if params.format == FilmFormat::H264 && !(width.is_multiple_of(2) && height.is_multiple_of(2)) {
            let problem = format!("H.264 needs even sides, not {width}x{height}");
            return Err(FilmError::write(path, problem, "add a column or a row"));
        }
        let mut command = process::command("ffmpeg");
        command.stdin(std::process::Stdio::piped()).stdout(std::process::Stdio::null());
        let format = if pixels == Pixels::Rgba { "rgba" } else { "gray" };
        command.args(["-y", "-f", "rawvideo", "-pix_fmt", format, "-video_size", &format!("{width}x{height}")]);
        command.args(["-framerate", &params.rate.argument(), "-i", "pipe:0"]);
        if let Some(sound) = &params.sound {
            command.args(seek(sound.start_s));
            if let Some(seconds) = sound.length_s {
                command.args(["-t", &format!("{seconds:.6}")]);
            }
            command.args(process::input(&sound.film.path));
        }
        command.args(["-map", "0:v:0"]);
        command.args(encoder(params));
        command.args(sound_encoder(params));
        command.args(["-map_metadata", "-1", "-map_chapters", "-1", "-bitexact"]).arg(process::file_url(path));
        let mut child = process::spawn(&mut command, "ffmpeg")?;
        let complaints = Some(process::listen(child.stderr.take()));
        let stdin = child.stdin.take();
        let reins = Reins::new();
        let name = reins.adopt(child);
        let bytes = if pixels == Pixels::Rgba { 4 } else { 1 };
        let frame_bytes = width as usize * height as usize * bytes;
        Ok(Self { path: path.to_owned(), frame_bytes, pixels, stdin, reins, name, complaints })
    }

    /// Writes the next picture of a film that was begun with [`FilmWriter::rgba`].
    ///
    /// # Errors
    /// Another size than was said, or whatever the encoder complains of: a full disk.
    pub fn write_rgba(&mut self, pixels: &[[u8; 4]]) -> Result<(), FilmError> {
        self.write(Pixels::Rgba, bytemuck::cast_slice(pixels))
    }

    /// Writes the next picture of a film that was begun with [`FilmWriter::grey`].
    ///
    /// # Errors
    /// As [`FilmWriter::write_rgba`].
    pub fn write_grey(&mut self, pixels: &[u8]) -> Result<(), FilmError> {
        self.write(Pixels::Grey, pixels)
    }

    fn write(&mut self, kind: Pixels, bytes: &[u8]) -> Result<(), FilmError> {
        if kind != self.pixels || bytes.len() != self.frame_bytes {
            return Err(FilmError::write(
                &self.path,
                "a picture of another size or kind than was said",
                "give all pictures one size",
            ));
        }
        let Some(stdin) = &mut self.stdin else { return Err(self.failure(None)) };
        match stdin.write_all(bytes) {
            Ok(()) => Ok(()),
            Err(error) => Err(self.failure(Some(error.to_string()))),
        }
    }

    /// Ends the film; it is whole after that.
    ///
    /// # Errors
    /// Whatever the encoder complains of.
    pub fn finish(mut self) -> Result<(), FilmError> {
        self.stdin = None;
        match self.reins.wait(self.name) {
            Some(status) if status.success() => Ok(()),
            _ => Err(self.failure(None)),
        }
    }

    /// Why the encoder has ended.
    fn failure(&mut self, otherwise: Option<String>) -> FilmError {
        self.stdin = None;
        self.reins.end(self.name);
        let said =
            self.complaints.take().and_then(|complaints| complaints.join().ok()).and_then(|c| process::last_complaint(&c));
        let problem = said.or(otherwise).unwrap_or_else(|| "the encoder ended before its time".into());
        let remedy = if problem.contains("Unknown encoder") {
            "install an ffmpeg with libx264 and libvpx"
        } else {
            "look whether there is room, and whether the folder can be written to"
        };
        FilmError::write(&self.path, problem, remedy)
    }
}

impl Drop for FilmWriter {
    fn drop(&mut self) {
        self.stdin = None;
        self.reins.end(self.name);
        if let Some(complaints) = self.complaints.take() {
            let _ = complaints.join();
        }
    }
}

/// The arguments of picture and container.
fn encoder(params: &WriteParams) -> Vec<OsString> {
    let key = ((params.rate.per_second() * KEY_SECONDS).round() as u32).max(1).to_string();
    let quality = params.quality.min(40).to_string();
    let arguments: Vec<&str> = match params.format {
        FilmFormat::H264 => {
            let mut all = vec![
                "-vf",
                "scale=flags=bicubic+accurate_rnd+full_chroma_inp:out_color_matrix=bt709:out_range=tv,format=yuv420p",
            ];
            all.extend(["-c:v", "libx264", "-preset", "fast", "-profile:v", "high", "-crf", &quality, "-g", &key]);
            all.extend(["-threads", ENCODER_THREADS, "-movflags", "+faststart", "-f", "mp4"]);
            all
        }
        FilmFormat::Vp9 { alpha } => {
            let filter = if alpha {
                "scale=flags=bicubic+accurate_rnd+full_chroma_inp:out_color_matrix=bt709:out_range=tv,format=yuva420p"
            } else {
                "scale=flags=bicubic+accurate_rnd+full_chroma_inp:out_color_matrix=bt709:out_range=tv,format=yuv420p"
            };
            let mut all = vec!["-vf", filter, "-c:v", "libvpx-vp9", "-crf", &quality, "-b:v", "0", "-g", &key];
            // with alternate reference frames libvpx refuses alpha
            all.extend([
                "-deadline",
                "good",
                "-cpu-used",
                "4",
                "-row-mt",
                "1",
                "-auto-alt-ref",
                "0",
                "-threads",
                ENCODER_THREADS,
            ]);
            all.extend(["-f", "webm"]);
            all
        }
        FilmFormat::Pictures => return ["-c:v", "png", "-pix_fmt", "rgba", "-f", "image2"].map(OsString::from).into(),
    };
    let colours = ["-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"];
    arguments.into_iter().chain(colours).map(OsString::from).collect()
}

/// The arguments of the sound: copied where the container takes it.
fn sound_encoder(params: &WriteParams) -> Vec<OsString> {
    let Some(codec) = params.sound.as_ref().and_then(|sound| sound.film.sound.as_ref()).map(|sound| sound.codec.as_str())
    else {
        return Vec::new();
    };
    let (copied, otherwise): (&[&str], [&str; 2]) = match params.format {
        FilmFormat::H264 => (&["aac", "mp3", "ac3", "eac3", "alac"], ["aac", "192k"]),
        FilmFormat::Vp9 { .. } => (&["opus", "vorbis"], ["libopus", "160k"]),
        FilmFormat::Pictures => return Vec::new(),
    };
    let chosen: Vec<&str> = if copied.contains(&codec) {
        vec!["-map", "1:a:0", "-c:a", "copy"]
    } else {
        vec!["-map", "1:a:0", "-c:a", otherwise[0], "-b:a", otherwise[1]]
    };
    chosen.into_iter().map(OsString::from).collect()
}
