//! Films: pictures in, an H.264 MP4 out that browsers play.
//!
//! OpenH264 (BSD-2-Clause, compiled from source with the C++ compiler at hand) encodes; see `docs/decisions/009-film.md`
//! for what else was weighed. Frames are encoded as they come, so only their compressed form is kept until the end.

mod colour;
mod mp4;

use anyhow::{Context, Result, ensure};
use heliodon_image::SrgbImage;
use openh264::OpenH264API;
use openh264::encoder::{
    Complexity, Encoder, EncoderConfig, FrameRate, IntraFramePeriod, Profile, RateControlMode, UsageType, VuiConfig,
};
use openh264::formats::YUVSlices;
use std::io::BufWriter;
use std::path::Path;

/// Seconds between frames at which a player can begin, so that scrubbing answers at once.
const KEY_SECONDS: f64 = 1.0;
const NAL_TYPE_MASK: u8 = 0x1F;
const NAL_SEQUENCE_PARAMETERS: u8 = 7;
const NAL_PICTURE_PARAMETERS: u8 = 8;
const NAL_KEY_SLICE: u8 = 5;

/// A film being made.
pub struct Film {
    encoder: Encoder,
    track: mp4::Track,
    samples: Vec<mp4::Sample>,
}

/// Refuses picture sizes that a film cannot have, before any work is done.
///
/// # Errors
/// Odd numbers of columns or rows, less than 16, more than 3840 x 2160.
pub fn check_size(width: u32, height: u32) -> Result<()> {
    ensure!(width.is_multiple_of(2) && height.is_multiple_of(2), "a film needs an even width and height, not {width}x{height}");
    ensure!(width.min(height) >= 16, "a film needs at least 16x16 pixels, not {width}x{height}");
    ensure!(
        width.max(height) <= 3840 && width.min(height) <= 2160,
        "the film encoder takes at most 3840x2160 pixels, not {width}x{height}"
    );
    Ok(())
}

impl Film {
    /// A film of the given picture size at `fps` frames a second.
    ///
    /// # Errors
    /// As [`check_size`]; and if the encoder does not start.
    pub fn new(width: u32, height: u32, fps: f64) -> Result<Self> {
        check_size(width, height)?;
        ensure!((1.0..=240.0).contains(&fps), "a film needs 1 to 240 frames a second, not {fps}");
        let config = EncoderConfig::new()
            .max_frame_rate(FrameRate::from_hz(fps as f32))
            // Constant quality (OpenH264's quantiser of 26), as many bits as that takes: rate control would drop frames or band
            // the sky where the light changes fast.
            .rate_control_mode(RateControlMode::Off)
            .skip_frames(false)
            .usage_type(UsageType::CameraVideoRealTime)
            .complexity(Complexity::High)
            .profile(Profile::High)
            .intra_frame_period(IntraFramePeriod::from_num_frames((fps * KEY_SECONDS).round().max(1.0) as u32))
            // These two look at moving people, not at light on stone: one smears it, the other makes key frames at dawn.
            .background_detection(false)
            .scene_change_detect(false)
            .num_threads(0)
            .vui(VuiConfig::bt709());
        let encoder =
            Encoder::with_api_config(OpenH264API::from_source(), config).context("the film encoder does not start")?;
        let track = mp4::Track {
            width: width as u16,
            height: height as u16,
            frames_per_1000_s: (fps * 1000.0).round() as u32,
            sequence_parameters: Vec::new(),
            picture_parameters: Vec::new(),
        };
        Ok(Self { encoder, track, samples: Vec::new() })
    }

    /// Adds the next frame; alpha is ignored.
    ///
    /// # Errors
    /// If the picture has another size than the film, or the encoder fails.
    pub fn push(&mut self, frame: &SrgbImage) -> Result<()> {
        let (width, height) = (frame.width as usize, frame.height as usize);
        ensure!(
            (width, height) == (usize::from(self.track.width), usize::from(self.track.height)),
            "frame {} is {width}x{height}, the film {}x{}",
            self.samples.len(),
            self.track.width,
            self.track.height
        );
        let planes = colour::planes(frame);
        let source = YUVSlices::new((&planes.y, &planes.cb, &planes.cr), (width, height), (width, width / 2, width / 2));
        let milliseconds = self.samples.len() as u64 * 1_000_000 / u64::from(self.track.frames_per_1000_s);
        let stream = self
            .encoder
            .encode_at(&source, openh264::Timestamp::from_millis(milliseconds))
            .with_context(|| format!("frame {} cannot be encoded", self.samples.len()))?;
        let mut sample = mp4::Sample { data: Vec::new(), key: false };
        for layer in (0..stream.num_layers()).filter_map(|index| stream.layer(index)) {
            for unit in (0..layer.nal_count()).filter_map(|index| layer.nal_unit(index)) {
                let unit = without_start_code(unit);
                match unit.first().map(|byte| byte & NAL_TYPE_MASK) {
                    Some(NAL_SEQUENCE_PARAMETERS) => self.track.sequence_parameters = unit.to_vec(),
                    Some(NAL_PICTURE_PARAMETERS) => self.track.picture_parameters = unit.to_vec(),
                    Some(kind) => {
                        sample.key |= kind == NAL_KEY_SLICE;
                        sample.data.extend((unit.len() as u32).to_be_bytes());
                        sample.data.extend(unit);
                    }
                    None => {}
                }
            }
        }
        ensure!(!sample.data.is_empty(), "the encoder dropped frame {}", self.samples.len());
        self.samples.push(sample);
        Ok(())
    }

    /// Writes the film; the file appears whole or not at all.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(self, path: &Path) -> Result<()> {
        crate::files::write_whole(path, |file| {
            let mut out = BufWriter::new(file);
            mp4::write(&mut out, &self.track, &self.samples)
        })
    }
}

fn without_start_code(unit: &[u8]) -> &[u8] {
    let zeros = unit.iter().take_while(|&&byte| byte == 0).count();
    if zeros >= 2 && unit.get(zeros) == Some(&1) { &unit[zeros + 1..] } else { unit }
}

#[cfg(test)]
mod tests {
    use super::*;
    use openh264::decoder::Decoder;
    use openh264::formats::YUVSource;

    /// A colour ramp that moves, so that frames differ and errors show.
    fn frame(number: u32) -> SrgbImage {
        let (width, height) = (96, 64);
        let pixels = (0..width * height)
            .map(|index| {
                let (x, y) = (index % width, index / width);
                [(x * 2 + number * 3) as u8, (y * 3) as u8, (200 - x) as u8, 255]
            })
            .collect();
        SrgbImage { width, height, pixels }
    }

    #[test]
    fn a_decoder_gets_the_pictures_back() {
        let mut film = Film::new(96, 64, 24.0).unwrap();
        for number in 0..30 {
            film.push(&frame(number)).unwrap();
        }
        assert!(film.samples[0].key && film.samples[24].key && !film.samples[1].key);
        let mut decoder = Decoder::new().unwrap();
        let mut stream = Vec::new();
        for set in [&film.track.sequence_parameters, &film.track.picture_parameters] {
            stream.extend([0, 0, 0, 1]);
            stream.extend(set);
        }
        decoder.decode(&stream).unwrap();
        let mut worst = 0.0_f64;
        for (number, sample) in film.samples.iter().enumerate() {
            let (length, unit) = sample.data.split_at(4);
            assert_eq!(u32::from_be_bytes(length.try_into().unwrap()) as usize, unit.len());
            let annex_b: Vec<u8> = [&[0, 0, 0, 1], unit].concat();
            let picture = decoder.decode(&annex_b).unwrap().expect("a frame for each sample");
            let wanted = colour::planes(&frame(number as u32)).y;
            let stride = picture.strides().0;
            let error: f64 = (0..64)
                .flat_map(|row| (0..96).map(move |column| (row, column)))
                .map(|(row, column)| {
                    let difference = f64::from(picture.y()[row * stride + column]) - f64::from(wanted[row * 96 + column]);
                    difference * difference
                })
                .sum();
            worst = worst.max(error / (96.0 * 64.0));
        }
        // 38 dB: artefacts below what one sees in moving pictures
        assert!(worst < 10.0, "mean squared error {worst}");
    }

    #[test]
    fn sizes_that_a_film_cannot_have_are_refused() {
        for (width, height) in [(97, 64), (96, 63), (8, 8), (4096, 2160), (0, 0)] {
            assert!(check_size(width, height).is_err(), "{width}x{height}");
        }
        assert!(check_size(1024, 768).is_ok() && check_size(2160, 3840).is_ok());
        assert!(Film::new(96, 64, f64::NAN).is_err());
    }
}
