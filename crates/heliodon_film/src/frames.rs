//! Pictures of a film in order, at a constant rate.

use crate::error::COPY_AGAIN;
use crate::process::{self, Reins};
use crate::{Film, FilmError, Rate};
use std::ffi::OsString;
use std::io::Read;
use std::process::ChildStdout;
use std::sync::Arc;
use std::thread::JoinHandle;

/// The most bytes of pictures that a looping reader keeps, so that short films are decoded once.
const CACHE_BYTES: usize = 64 << 20;
/// Seconds before the end at which the next pass of a loop is started, so that its first frame is there in time.
const SUCCESSOR_S: f64 = 1.0;

/// What is read.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// One film; straight alpha where it carries any, else opaque.
    Film(Film),
    /// An image and its inverted mask, two films that one decoder reads in step: RGB is the image's as it is stored (premultiplied),
    /// alpha is 255 - mask. Of the image's size and rate; ends with the shorter one.
    Pair {
        /// Black where nothing is.
        image: Film,
        /// White where nothing is.
        mask: Film,
    },
}

impl Source {
    /// The film that gives size and rate.
    #[must_use]
    pub fn film(&self) -> &Film {
        match self {
            Self::Film(film) | Self::Pair { image: film, .. } => film,
        }
    }
}

/// How Y'CbCr becomes RGB.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Conversion {
    /// Colour samples repeated: for watching.
    Fast,
    /// Colour interpolated between its samples, exact rounding: for solving; about twice the work.
    Fine,
}

/// How a film is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReadParams {
    /// The first frame, counted from 0.
    pub start: u64,
    /// Frames a second that are delivered; `None` for the film's own. Frames are shown twice or left out where they differ.
    pub rate: Option<Rate>,
    /// Columns and rows; `None` for the film's own.
    pub size: Option<(u32, u32)>,
    /// How colours are converted.
    pub conversion: Conversion,
    /// Whether it begins again at its end, without a gap.
    pub looping: bool,
    /// Threads of the decoder; 0 for as many as there are cores. One decodes 640x1280 several times faster than it plays.
    pub threads: u32,
}

impl ReadParams {
    /// For solving: from the beginning to the end, exact, on all cores.
    #[must_use]
    pub fn archival() -> Self {
        Self { start: 0, rate: None, size: None, conversion: Conversion::Fine, looping: false, threads: 0 }
    }

    /// For watching: again and again, on one core, so that a renderer keeps the others.
    #[must_use]
    pub fn playing() -> Self {
        Self { conversion: Conversion::Fast, looping: true, threads: 1, ..Self::archival() }
    }
}

/// One picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Which, counted from 0 at the film's beginning; goes on over the ends of loops. It is to be shown at `number / rate` seconds.
    pub number: u64,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` pixels, sRGB-encoded RGB and alpha, row-major from the top left.
    pub pixels: Vec<[u8; 4]>,
}

/// Ends a reader from another thread: at once, whatever it waits for.
#[derive(Clone, Debug)]
pub struct Stopper(Arc<Reins>);

impl Stopper {
    pub(crate) fn of(reins: Arc<Reins>) -> Self {
        Self(reins)
    }

    /// Ends the decoder; the reader's next frame is none.
    pub fn stop(&self) {
        self.0.stop();
    }
}

/// A running decoder.
#[derive(Debug)]
struct Pass {
    name: u64,
    stdout: ChildStdout,
    complaints: JoinHandle<String>,
}

/// Reads a film's frames one after the other.
///
/// Dropped at any time, it ends its decoder, waits for no more than that, and leaves no zombie.
#[derive(Debug)]
pub struct FrameReader {
    source: Source,
    params: ReadParams,
    rate: Rate,
    size: (u32, u32),
    reins: Arc<Reins>,
    pass: Option<Pass>,
    successor: Option<Pass>,
    /// The number that the next frame has.
    next: u64,
    /// Frames that this pass has given, and which frame of the film it began with.
    given: u64,
    began: u64,
    /// The film's frames, once its end was met.
    length: Option<u64>,
    /// All frames of a first pass from the beginning, while there is room; emptied when there is none.
    cache: Option<Vec<Vec<[u8; 4]>>>,
    complaint: Option<String>,
}

impl FrameReader {
    /// Starts a decoder.
    ///
    /// # Errors
    /// If there is no `ffmpeg`. What is wrong with the film is told with the first frame.
    pub fn open(source: Source, params: &ReadParams) -> Result<Self, FilmError> {
        let film = source.film();
        let size = params.size.unwrap_or((film.width, film.height));
        let rate = params.rate.unwrap_or(film.rate);
        let mut reader = Self {
            params: *params,
            rate,
            size,
            reins: Reins::new(),
            pass: None,
            successor: None,
            next: params.start,
            given: 0,
            began: params.start,
            length: None,
            cache: (params.looping && params.start == 0).then(Vec::new),
            complaint: None,
            source,
        };
        reader.pass = Some(reader.begin(params.start)?);
        Ok(reader)
    }

    /// Columns and rows of every frame.
    #[must_use]
    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// Frames a second.
    #[must_use]
    pub fn rate(&self) -> Rate {
        self.rate
    }

    /// The film's frames, once its end was met in a pass from the beginning; before, nobody knows for sure.
    #[must_use]
    pub fn length(&self) -> Option<u64> {
        self.length
    }

    /// What the decoder complained of by the time of the last pass's end: films that are damaged or cut off.
    #[must_use]
    pub fn complaint(&self) -> Option<&str> {
        self.complaint.as_deref()
    }

    /// Ends this reader from elsewhere.
    #[must_use]
    pub fn stopper(&self) -> Stopper {
        Stopper(self.reins.clone())
    }

    /// The next frame; `None` at the end of what does not loop, and once stopped.
    ///
    /// # Errors
    /// Where not even one frame can be decoded, with what the decoder says.
    pub fn next_frame(&mut self) -> Result<Option<Frame>, FilmError> {
        let mut pixels = Vec::new();
        Ok(self.read_into(&mut pixels)?.map(|number| Frame { number, width: self.size.0, height: self.size.1, pixels }))
    }

    /// The next frame, into memory that was used before; its number, or `None` as in [`Self::next_frame`].
    ///
    /// # Errors
    /// As [`Self::next_frame`].
    pub fn read_into(&mut self, pixels: &mut Vec<[u8; 4]>) -> Result<Option<u64>, FilmError> {
        let count = self.size.0 as usize * self.size.1 as usize;
        // what was in it is written over
        pixels.resize(count, [0; 4]);
        loop {
            if let (None, Some(cache), Some(length)) = (&self.pass, &self.cache, self.length) {
                if self.reins.is_stopped() {
                    return Ok(None);
                }
                let Some(kept) = cache.get((self.next % length.max(1)) as usize) else { return Ok(None) };
                pixels.copy_from_slice(kept);
                return Ok(Some(self.take_number()));
            }
            let Some(pass) = &mut self.pass else { return Ok(None) };
            if fill(&mut pass.stdout, bytemuck::cast_slice_mut(pixels)) {
                self.keep(pixels);
                self.given += 1;
                self.prepare_successor();
                return Ok(Some(self.take_number()));
            }
            self.end_pass()?;
        }
    }

    /// Lets the next frame have another number, where a pass of a loop later than the first one is begun with.
    pub(crate) fn count_from(&mut self, number: u64) {
        self.next = number;
    }

    fn take_number(&mut self) -> u64 {
        self.next += 1;
        self.next - 1
    }

    /// Keeps a frame of the first pass while all of them have room.
    fn keep(&mut self, pixels: &[[u8; 4]]) {
        let Some(cache) = &mut self.cache else { return };
        if (cache.len() + 1) * size_of_val(pixels) > CACHE_BYTES {
            self.cache = None;
        } else {
            cache.push(pixels.to_vec());
        }
    }

    /// Starts the next pass of a loop shortly before this one's end.
    fn prepare_successor(&mut self) {
        if !self.params.looping || self.successor.is_some() || self.cache.is_some() {
            return;
        }
        let film_frames = self.source.film().duration_s.map(|seconds| (seconds * self.rate.per_second()).round() as u64);
        let ahead = (SUCCESSOR_S * self.rate.per_second()).ceil() as u64;
        if self.length.or(film_frames).is_some_and(|frames| self.began + self.given + ahead >= frames) {
            // without one it is started at the end, and told there if it cannot
            self.successor = self.begin(0).ok();
        }
    }

    /// The end of a pass: what was complained, and what comes next.
    fn end_pass(&mut self) -> Result<(), FilmError> {
        let Some(Pass { name, stdout, complaints }) = self.pass.take() else { return Ok(()) };
        drop(stdout);
        self.reins.wait(name);
        let complaint = process::last_complaint(&complaints.join().unwrap_or_default());
        if self.reins.is_stopped() {
            return Ok(());
        }
        if self.given == 0 && self.began == 0 {
            let said = complaint.map_or_else(String::new, |said| format!(" ({said})"));
            let path = &self.source.film().path;
            return Err(FilmError::unusable(path, format!("not one frame of it can be decoded{said}"), COPY_AGAIN));
        }
        if complaint.is_some() {
            self.complaint = complaint;
        }
        // a pass that was begun behind the end gives none, and knows no length
        if self.given > 0 {
            self.length = Some(self.began + self.given);
        }
        if !self.params.looping {
            return Ok(());
        }
        (self.given, self.began) = (0, 0);
        if self.cache.is_none() {
            let next = match self.successor.take() {
                Some(successor) => successor,
                None => self.begin(0)?,
            };
            self.pass = Some(next);
        }
        Ok(())
    }

    /// Starts a decoder at a frame of the film.
    fn begin(&self, start: u64) -> Result<Pass, FilmError> {
        let mut command = process::command("ffmpeg");
        command.arg("-nostdin");
        // a quarter of a frame before its time: rounded, it is never just behind it
        let seek = (start > 0).then(|| format!("{:.6}", (start as f64 - 0.25) / self.rate.per_second()));
        let mut open = |film: &Film| {
            command.args(["-threads", &self.params.threads.to_string()]);
            if let Some(seek) = &seek {
                command.args(["-ss", seek]);
            }
            command.args(film.input());
        };
        match &self.source {
            Source::Film(film) => {
                open(film);
                command.args(["-map", "0:V:0", "-vf", &format!("{},format=rgba", self.filter(film))]);
            }
            Source::Pair { image, mask } => {
                open(image);
                open(mask);
                let graph = format!(
                    "[0:V:0]{},format=rgba[image];[1:V:0]{},format=gray,negate[alpha];[image][alpha]alphamerge=shortest=1,format=rgba",
                    self.filter(image),
                    self.filter(mask)
                );
                command.args(["-filter_complex", &graph]);
            }
        }
        command.args(["-an", "-sn", "-dn", "-f", "rawvideo", "-threads", "1", "pipe:1"]);
        let mut child = process::spawn(&mut command, "ffmpeg")?;
        let complaints = process::listen(child.stderr.take());
        let stdout = child.stdout.take();
        let name = self.reins.adopt(child);
        let stdout = stdout.ok_or_else(|| FilmError::Program { program: "ffmpeg", problem: "it has no output".into() })?;
        Ok(Pass { name, stdout, complaints })
    }

    /// A constant rate from time 0 on, the wished size, RGB by the film's own matrix.
    fn filter(&self, film: &Film) -> String {
        let flags = match self.params.conversion {
            Conversion::Fast => "fast_bilinear",
            Conversion::Fine => "bicubic+accurate_rnd+full_chroma_int+full_chroma_inp",
        };
        let matrix = film.matrix.map_or_else(String::new, |matrix| format!(":in_color_matrix={matrix}"));
        format!("fps={}:start_time=0,scale={}:{}:flags={flags}{matrix}", self.rate.argument(), self.size.0, self.size.1)
    }
}

impl Drop for FrameReader {
    fn drop(&mut self) {
        self.reins.stop();
        for pass in self.pass.take().into_iter().chain(self.successor.take()) {
            self.reins.end(pass.name);
            // its pipe has closed with it
            let _ = pass.complaints.join();
        }
    }
}

/// Fills a whole picture; `false` where the pipe ended before.
fn fill(stdout: &mut ChildStdout, mut rest: &mut [u8]) -> bool {
    while !rest.is_empty() {
        match stdout.read(rest) {
            Ok(0) => return false,
            Ok(count) => rest = &mut rest[count..],
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(_) => return false,
        }
    }
    true
}

/// Arguments for a part of the sound, as [`crate::SoundReader`] and the writer ask for it.
pub(crate) fn seek(start_s: f64) -> Vec<OsString> {
    if start_s > 0.0 { vec!["-ss".into(), format!("{start_s:.6}").into()] } else { Vec::new() }
}
