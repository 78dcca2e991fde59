//! What is in a film.

use crate::error::COPY_AGAIN;
use crate::{FilmError, MAX_SIDE, Rate, process};
use serde::Deserialize;
use std::ffi::OsString;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// What a film is, by its header.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// The file, or a pattern of numbered pictures (`walk/%04d.png`).
    pub path: PathBuf,
    /// Columns as they are shown: upright, with square pixels; 1 to [`MAX_SIDE`].
    pub width: u32,
    /// Rows, likewise.
    pub height: u32,
    /// Frames a second that are delivered: the header's, or for films of varying rate their mean.
    pub rate: Rate,
    /// Whether the header has a rate; without one it was found from the frames' times, or is [`Rate::ASSUMED`].
    pub rate_known: bool,
    /// Whether frames do not come at a constant rate, so that some are shown twice or left out to make it so.
    pub rate_varies: bool,
    /// Seconds, where the header tells them.
    pub duration_s: Option<f64>,
    /// `ffmpeg`'s name of the codec.
    pub codec: String,
    /// Whether pixels carry alpha.
    pub alpha: bool,
    /// Whether colour has fewer samples than brightness (4:2:0, 4:2:2).
    pub subsampled: bool,
    /// The sound of the first stream that has any.
    pub sound: Option<Sound>,
    /// The decoder that gives alpha where `ffmpeg`'s own drops it.
    pub(crate) decoder: Option<&'static str>,
    /// The matrix between Y'CbCr and RGB, where the film does not say.
    pub(crate) matrix: Option<&'static str>,
    pub(crate) sequence: bool,
}

/// The sound of a film.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sound {
    /// Samples a second.
    pub rate_hz: u32,
    /// Channels.
    pub channels: u32,
    /// `ffmpeg`'s name of the codec.
    pub codec: String,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Probed {
    streams: Vec<Stream>,
    format: Format,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Format {
    duration: Option<String>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Stream {
    codec_type: String,
    codec_name: String,
    width: u32,
    height: u32,
    pix_fmt: String,
    color_space: Option<String>,
    sample_aspect_ratio: Option<String>,
    r_frame_rate: String,
    avg_frame_rate: String,
    duration: Option<String>,
    sample_rate: Option<String>,
    channels: u32,
    tags: Tags,
    disposition: Disposition,
    side_data_list: Vec<SideData>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Tags {
    #[serde(alias = "ALPHA_MODE")]
    alpha_mode: Option<String>,
    #[serde(alias = "DURATION")]
    duration: Option<String>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Disposition {
    attached_pic: u8,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct SideData {
    rotation: Option<f64>,
}

impl Film {
    /// Looks into a film's header.
    ///
    /// # Errors
    /// No such file, no film, no picture in it, a film that was cut off before its index, or no `ffprobe`.
    pub fn probe(path: impl AsRef<Path>) -> Result<Self, FilmError> {
        let path = path.as_ref();
        let sequence = is_sequence(path);
        if !sequence {
            look_at(path)?;
        }
        let mut arguments: Vec<OsString> = ["-of", "json", "-show_format", "-show_streams"].map(OsString::from).into();
        arguments.extend(sequence_arguments(sequence, Rate::ASSUMED));
        arguments.extend(process::input(path));
        let (status, bytes, complaints) = process::output("ffprobe", arguments)?;
        let probed: Probed = serde_json::from_slice(&bytes).unwrap_or_default();
        if !status.success() || probed.streams.is_empty() {
            return Err(unreadable(path, sequence, &complaints));
        }
        let pictures = |s: &&Stream| s.codec_type == "video" && s.disposition.attached_pic == 0;
        let Some(stream) = probed.streams.iter().find(pictures) else {
            return Err(FilmError::unusable(
                path,
                "there is sound in it, but no moving picture",
                "give the film itself, or export it with its picture",
            ));
        };
        let (width, height) = shown_size(stream);
        if stream.width == 0 || stream.height == 0 {
            return Err(FilmError::unusable(path, "its header gives the picture no size", COPY_AGAIN));
        }
        if width.max(height) > MAX_SIDE {
            return Err(FilmError::unusable(
                path,
                format!("its pictures are {width}x{height}; a side can have at most {MAX_SIDE} pixels"),
                "scale it down",
            ));
        }
        let duration_s = seconds(stream.duration.as_deref())
            .or_else(|| seconds(stream.tags.duration.as_deref()))
            .or_else(|| seconds(probed.format.duration.as_deref()));
        let (rate, rate_known, rate_varies) = match rate_of(stream) {
            Some((rate, varies)) => (rate, true, varies),
            None => (rate_by_times(path, &process::input(path))?.unwrap_or(Rate::ASSUMED), false, false),
        };
        let decoder = match (stream.tags.alpha_mode.as_deref(), stream.codec_name.as_str()) {
            (Some("1"), "vp8") => Some("libvpx"),
            (Some("1"), "vp9") => Some("libvpx-vp9"),
            _ => None,
        };
        let coded_in_rgb = ["rgb", "bgr", "gbr", "argb", "abgr", "pal8"].iter().any(|name| stream.pix_fmt.starts_with(name));
        let matrix_told = stream.color_space.as_deref().is_some_and(|space| !["unknown", "reserved"].contains(&space));
        let sound = probed.streams.iter().find(|s| s.codec_type == "audio").and_then(|s| {
            let rate_hz = s.sample_rate.as_deref()?.parse().ok().filter(|&rate| rate > 0)?;
            (s.channels > 0).then(|| Sound { rate_hz, channels: s.channels, codec: s.codec_name.clone() })
        });
        Ok(Self {
            path: path.to_owned(),
            width,
            height,
            rate,
            rate_known,
            rate_varies,
            duration_s,
            codec: stream.codec_name.clone(),
            alpha: decoder.is_some() || has_alpha(&stream.pix_fmt),
            subsampled: stream.pix_fmt.contains("420") || stream.pix_fmt.contains("422") || stream.pix_fmt.contains("nv12"),
            sound,
            decoder,
            // what players do: the matrix of high definition where the picture is that large, of television where not
            matrix: (!coded_in_rgb && !matrix_told).then_some(if width.max(height) >= 1280 { "bt709" } else { "bt601" }),
            sequence,
        })
    }

    /// How many frames there are by the header's duration. A film that was cut off has fewer.
    #[must_use]
    pub fn frames(&self) -> Option<u64> {
        self.duration_s.map(|seconds| ((seconds * self.rate.per_second()).round() as u64).max(1))
    }

    /// The arguments that open it, what belongs before `-i` included.
    pub(crate) fn input(&self) -> Vec<OsString> {
        let mut arguments = sequence_arguments(self.sequence, self.rate);
        if let Some(decoder) = self.decoder {
            arguments.extend(["-c:v".into(), decoder.into()]);
        }
        arguments.extend(process::input(&self.path));
        arguments
    }
}

/// Whether a name is a pattern of numbered pictures, and no file.
fn is_sequence(path: &Path) -> bool {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let number =
        name.split('%').nth(1).is_some_and(|rest| rest.trim_start_matches(|c: char| c.is_ascii_digit()).starts_with('d'));
    number && !path.exists()
}

fn sequence_arguments(sequence: bool, rate: Rate) -> Vec<OsString> {
    if sequence { vec!["-f".into(), "image2".into(), "-framerate".into(), rate.argument().into()] } else { Vec::new() }
}

/// Refuses what is no file before a program is asked, which would say less.
fn look_at(path: &Path) -> Result<(), FilmError> {
    let told = |error: std::io::Error| FilmError::unusable(path, format!("cannot be read: {error}"), "give a film's file");
    let metadata = std::fs::metadata(path).map_err(told)?;
    if metadata.is_dir() {
        return Err(FilmError::unusable(
            path,
            "is a folder",
            "give a film's file, or a pattern of pictures as in folder/%04d.png",
        ));
    }
    if !metadata.is_file() {
        return Err(FilmError::unusable(path, "is no ordinary file", "give a film's file"));
    }
    if metadata.len() == 0 {
        return Err(FilmError::unusable(path, "is empty", COPY_AGAIN));
    }
    Ok(())
}

/// Why nothing could be read, by what the file begins with: of a text that is called .mp4 `ffprobe` only says that it misses an index.
fn unreadable(path: &Path, sequence: bool, complaints: &str) -> FilmError {
    let said = process::last_complaint(complaints).unwrap_or_else(|| "nothing was found in it".into());
    if sequence {
        return FilmError::unusable(
            path,
            format!("no pictures are named so ({said})"),
            "give a pattern as in folder/%04d.png, numbers from 0 to 4 on",
        );
    }
    let mut head = [0; 12];
    let read = File::open(path).and_then(|mut file| file.read(&mut head)).unwrap_or(0);
    let head = &head[..read];
    let mp4 = head.get(4..8).is_some_and(|kind| {
        [b"ftyp", b"moov", b"mdat", b"free", b"wide", b"skip"].contains(&kind.try_into().unwrap_or(b"    "))
    });
    let webm = head.starts_with(&[0x1a, 0x45, 0xdf, 0xa3]);
    if mp4 && complaints.contains("moov atom not found") {
        return FilmError::unusable(path, "was cut off: the index, which stands at its end, is missing", COPY_AGAIN);
    }
    if mp4 || webm {
        return FilmError::unusable(path, format!("its header is broken ({said})"), COPY_AGAIN);
    }
    FilmError::unusable(path, "is no film that can be read", "give an MP4 or WebM file with H.264, VP8, VP9 or AV1")
}

/// `12.5`, or `00:01:02.5` as Matroska's tags have it.
fn seconds(text: Option<&str>) -> Option<f64> {
    let mut total = 0.0;
    for part in text?.split(':') {
        total = total * 60.0 + part.trim().parse::<f64>().ok()?;
    }
    (total.is_finite() && total > 0.0).then_some(total)
}

/// The header's rate, and whether frames vary from it.
fn rate_of(stream: &Stream) -> Option<(Rate, bool)> {
    // the rate of which all times are multiples, and the mean
    let (base, mean) = (Rate::parse(&stream.r_frame_rate), Rate::parse(&stream.avg_frame_rate));
    match (base, mean) {
        (Some(base), Some(mean)) => {
            let ratio = base.per_second() / mean.per_second();
            let plausible = (0.5..=240.0).contains(&base.per_second());
            if plausible && (0.98..=1.02).contains(&ratio) {
                Some((base, false))
            } else {
                Some((Rate::nearest(mean.per_second()), true))
            }
        }
        (Some(only), None) | (None, Some(only)) if (0.5..=240.0).contains(&only.per_second()) => Some((only, false)),
        _ => None,
    }
}

/// The rate by the times of the first frames, of films whose header has none.
fn rate_by_times(path: &Path, input: &[OsString]) -> Result<Option<Rate>, FilmError> {
    let asked = ["-select_streams", "V:0", "-show_entries", "packet=pts_time", "-read_intervals", "%+#120", "-of", "csv=p=0"];
    let (_, bytes, _) = process::output("ffprobe", asked.iter().map(OsString::from).chain(input.iter().cloned()))?;
    let text = String::from_utf8_lossy(&bytes);
    let mut times: Vec<f64> = text.lines().filter_map(|line| line.trim_matches([',', ' ']).parse().ok()).collect();
    times.sort_by(f64::total_cmp);
    let (Some(first), Some(last)) = (times.first(), times.last()) else {
        return Err(FilmError::unusable(path, "there is no frame in it", COPY_AGAIN));
    };
    let span = last - first;
    Ok((times.len() > 1 && span > 0.0).then(|| Rate::nearest((times.len() - 1) as f64 / span)))
}

/// Columns and rows upright and with square pixels.
fn shown_size(stream: &Stream) -> (u32, u32) {
    let aspect = stream.sample_aspect_ratio.as_deref().and_then(|text| {
        let (x, y) = text.split_once(':')?;
        let (x, y): (f64, f64) = (x.parse().ok()?, y.parse().ok()?);
        // what is outside of this is a broken header rather than a lens
        (x > 0.0 && y > 0.0 && (0.1..=10.0).contains(&(x / y))).then_some(x / y)
    });
    let width = (f64::from(stream.width) * aspect.unwrap_or(1.0)).round().max(1.0) as u32;
    let turned = stream.side_data_list.iter().find_map(|data| data.rotation).unwrap_or(0.0);
    if (turned / 90.0).round().abs() % 2.0 == 1.0 { (stream.height, width) } else { (width, stream.height) }
}

/// Whether a pixel format of `ffmpeg` has alpha.
fn has_alpha(format: &str) -> bool {
    ["yuva", "rgba", "bgra", "argb", "abgr", "gbrap", "ya8", "ya16", "pal8", "rgba64", "bgra64"]
        .iter()
        .any(|name| format.starts_with(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream(base: &str, mean: &str) -> Stream {
        Stream { r_frame_rate: base.into(), avg_frame_rate: mean.into(), ..Stream::default() }
    }

    #[test]
    fn rates_are_told_from_time_bases() {
        let television = Rate { numerator: 30_000, denominator: 1001 };
        assert_eq!(rate_of(&stream("30000/1001", "4170000/138461")), Some((television, false)));
        assert_eq!(
            rate_of(&stream("90000/1", "24000/1001")).map(|(rate, varies)| (rate.numerator, varies)),
            Some((24_000, true))
        );
        assert_eq!(rate_of(&stream("0/0", "0/0")), None);
        assert_eq!(rate_of(&stream("1000/1", "0/0")), None);
        assert_eq!(rate_of(&stream("25/1", "0/0")), Some((Rate::ASSUMED, false)));
    }

    #[test]
    fn headers_are_read_as_people_see_the_film() {
        assert_eq!(seconds(Some("00:01:02.500000000")), Some(62.5));
        assert_eq!((seconds(Some("N/A")), seconds(Some("0.0")), seconds(None)), (None, None, None));
        let phone =
            Stream { width: 1920, height: 1080, side_data_list: vec![SideData { rotation: Some(-90.0) }], ..Stream::default() };
        assert_eq!(shown_size(&phone), (1080, 1920));
        let wide = Stream { width: 720, height: 576, sample_aspect_ratio: Some("64:45".into()), ..Stream::default() };
        assert_eq!(shown_size(&wide), (1024, 576));
        assert!(has_alpha("yuva420p") && has_alpha("rgba") && !has_alpha("yuv420p") && !has_alpha("rgb24"));
        assert!(
            is_sequence(Path::new("a/%04d.png")) && is_sequence(Path::new("%d.png")) && !is_sequence(Path::new("100 %.mp4"))
        );
    }
}
