//! Image-based characters: pictures of a model from many sides, in one texture array, of which those are shown that were taken from where the eye is.
//!
//! G. Papaioannou, A. Gaitatzes, D. Christopoulos: "Enhancing Virtual Reality Walkthroughs of Archaeological Sites", VAST 2003, section 3.1. Pictures are taken in
//! rings of equal elevation, with as many views each as it is looked at from there; the views nearest to the eye are blended. Beyond the paper each texel knows its
//! normal, how open it is, and its depth: the hour's light shades it, and what a view shows is looked for where the eye's ray meets the surface, not where it meets the
//! picture, so that blended views agree (relief texture mapping, after M. Oliveira, G. Bishop, D. McAllister, SIGGRAPH 2000).
//!
//! A file is a KTX 2.0 array of BC7: layer 2v holds the frames of view v, in rows from the top left, as the square roots of the linear albedo and the part of the texel
//! that is covered; layer 2v + 1 its unit normal along the view's right and up from -1 to 1, how much of the sky the model leaves to it, and its depth from -radius (0) to radius
//! towards the eye. Behind what is covered colours and depths go on, so that filtering takes in nothing foreign. [`ImpostorInfo`] is its text by the key [`INFO_KEY`], as JSON.

mod choice;
mod look;

pub use choice::{Choice, axes};
pub use look::{Look, Looked};

use glam::{Vec2, Vec3};
use heliodon_image::ImageError;
use heliodon_image::decode_bc7;
use heliodon_image::ktx2::{Ktx2, TexelFormat};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The key of the text that describes an impostor in its file.
pub const INFO_KEY: &str = "heliodon.impostor";
/// How impostors' files end.
pub const IMPOSTOR_ENDING: &str = ".impostor.ktx2";
/// The version of what is written.
const VERSION: u32 = 1;
/// The most views: two layers each, and portable devices have 256.
pub const MAX_VIEWS: u32 = 128;
/// The largest side of a layer, texels.
pub const MAX_LAYER_SIDE: u32 = 4096;
/// The most frames.
pub const MAX_FRAMES: u32 = 1024;

/// Views of one elevation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ring {
    /// How far above the model's middle they are taken from, degrees, -90 to 90.
    pub elevation_deg: f32,
    /// How many.
    pub views: u32,
    /// The first one's azimuth, degrees: 0 before the model (+Z), 90 at +X.
    pub from_deg: f32,
    /// Where the last one is; with 360 degrees and more from the first they go round evenly.
    pub to_deg: f32,
}

impl Ring {
    /// So many views all around.
    #[must_use]
    pub const fn around(elevation_deg: f32, views: u32) -> Self {
        Self { elevation_deg, views, from_deg: 0.0, to_deg: 360.0 }
    }

    /// Whether they go all around.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.to_deg - self.from_deg >= 360.0
    }

    /// The azimuth of a view, degrees.
    #[must_use]
    pub fn azimuth_deg(&self, view: u32) -> f32 {
        let span = self.to_deg - self.from_deg;
        let part = if self.is_closed() {
            view as f32 * (360.0 / self.views.max(1) as f32)
        } else if self.views > 1 {
            view as f32 * (span / (self.views - 1) as f32)
        } else {
            0.5 * span
        };
        self.from_deg + part
    }
}

/// A motion that was captured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImpostorClip {
    /// Its name in the model.
    pub name: String,
    /// How long it lasts, seconds; above 0 where it has more than one frame.
    pub duration_s: f32,
    /// Its first frame.
    pub first: u32,
    /// How many frames it has, at least 1, evenly over its duration; after the last comes the first again.
    pub frames: u32,
}

/// What an impostor is but for its texels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImpostorInfo {
    /// Version of the format: 1.
    pub version: u32,
    /// The model's name.
    pub name: String,
    /// The middle of the model over all its frames, metres, in its own space: origin between its feet, +Y up, front towards +Z.
    pub center: [f32; 3],
    /// No part of the model is ever farther from there, metres.
    pub radius_m: f32,
    /// Nor from the vertical line through it.
    pub around_m: f32,
    /// The lowest and the highest point of all frames, metres above the origin.
    pub heights_m: [f32; 2],
    /// Its views, ring after ring, with rising elevation.
    pub rings: Vec<Ring>,
    /// Of each view what its frames show, along its right and up from the middle, metres: left, bottom, right, top.
    pub windows_m: Vec<[f32; 4]>,
    /// Texels of a frame along its sides.
    pub frame_px: [u32; 2],
    /// Frames beside and above one another in a layer.
    pub grid: [u32; 2],
    /// What it performs; the model at rest is a clip of one frame.
    pub clips: Vec<ImpostorClip>,
    /// The distance from which a texel is as large as a pixel of the display that it was made for, metres.
    pub distance_m: f32,
}

/// What is wrong with an impostor.
#[derive(Debug, Error)]
pub enum ImpostorError {
    /// The texture.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// What is said about it.
    #[error("{name}: {problem}; capture it again with `heliodon impostor`")]
    Unfit {
        /// The file.
        name: String,
        /// What is wrong.
        problem: String,
    },
}

/// An impostor with its texels.
#[derive(Clone, Debug, PartialEq)]
pub struct Impostor {
    /// What it is.
    pub info: ImpostorInfo,
    /// Two layers of BC7 for each view, and smaller levels.
    pub texture: Ktx2,
}

impl ImpostorInfo {
    /// How many views there are.
    #[must_use]
    pub fn views(&self) -> u32 {
        self.rings.iter().map(|ring| ring.views).sum()
    }

    /// How many frames of all clips.
    #[must_use]
    pub fn frames(&self) -> u32 {
        self.clips.iter().map(|clip| clip.frames).sum()
    }

    /// Texels of a layer along its sides.
    #[must_use]
    pub fn layer_px(&self) -> [u32; 2] {
        [0, 1].map(|axis| self.grid[axis] * self.frame_px[axis])
    }

    /// The middle of the model.
    #[must_use]
    pub fn middle(&self) -> Vec3 {
        Vec3::from(self.center)
    }

    /// Two successive frames of a clip at a time, which goes round, and how much of the second is in it, 0 to 1. Without such a clip, of the first.
    #[must_use]
    pub fn frames_at(&self, clip: usize, time_s: f32) -> ([u32; 2], f32) {
        let Some(clip) = self.clips.get(clip).or_else(|| self.clips.first()) else { return ([0; 2], 0.0) };
        let round = if clip.duration_s > 0.0 { (time_s / clip.duration_s).rem_euclid(1.0) } else { 0.0 };
        let at = round * clip.frames as f32;
        let first = (at as u32).min(clip.frames - 1);
        let frames = [first, (first + 1) % clip.frames].map(|frame| clip.first + frame);
        (frames, at - first as f32)
    }

    /// The upper left corner of a frame in its layer, from 0 to 1.
    #[must_use]
    pub fn frame_corner(&self, frame: u32) -> Vec2 {
        let [columns, rows] = self.grid;
        Vec2::new((frame % columns) as f32 / columns as f32, (frame / columns) as f32 / rows as f32)
    }

    /// Checks every promise of the fields.
    ///
    /// # Errors
    /// The first promise that is broken, in words.
    pub fn validate(&self) -> Result<(), String> {
        let finite = |numbers: &[f32]| numbers.iter().all(|v| v.is_finite());
        if self.version != VERSION {
            return Err(format!("it is of version {}, not {VERSION}", self.version));
        }
        let sizes = [self.radius_m, self.around_m].iter().all(|m| *m > 0.0 && m.is_finite());
        if !finite(&self.center) || !finite(&self.heights_m) || !sizes {
            return Err("its middle and its radius are no numbers of metres".to_owned());
        }
        let ring_fits = |ring: &Ring| {
            (-90.0..=90.0).contains(&ring.elevation_deg)
                && (1..=MAX_VIEWS).contains(&ring.views)
                && finite(&[ring.from_deg, ring.to_deg])
                && (ring.from_deg < ring.to_deg || (ring.views == 1 && ring.from_deg == ring.to_deg))
        };
        if self.rings.is_empty() || self.rings.len() > MAX_VIEWS as usize || !self.rings.iter().all(ring_fits) {
            return Err("its rings have no views, or from nowhere".to_owned());
        }
        if !self.rings.windows(2).all(|pair| pair[0].elevation_deg < pair[1].elevation_deg) {
            return Err("its rings do not rise one above the other".to_owned());
        }
        if self.views() > MAX_VIEWS || self.windows_m.len() != self.views() as usize {
            return Err(format!("it has {} views with {} windows, at most {MAX_VIEWS}", self.views(), self.windows_m.len()));
        }
        let window_fits = |w: &[f32; 4]| finite(w) && w[0] < w[2] && w[1] < w[3];
        if !self.windows_m.iter().all(window_fits) {
            return Err("its views show nothing".to_owned());
        }
        let sides = self.frame_px.iter().chain(&self.grid).all(|side| (1..=MAX_LAYER_SIDE).contains(side));
        if !sides || self.frame_px.iter().any(|side| side % 4 != 0) || self.layer_px().iter().any(|&side| side > MAX_LAYER_SIDE)
        {
            return Err(format!("its layers have {:?} frames of {:?} texels", self.grid, self.frame_px));
        }
        let mut next = 0;
        for clip in &self.clips {
            let lasts = clip.duration_s.is_finite() && (clip.duration_s > 0.0 || (clip.frames == 1 && clip.duration_s == 0.0));
            if clip.first != next || !(1..=MAX_FRAMES).contains(&clip.frames) || !lasts {
                return Err(format!("its clip \"{}\" has no frames in turn", clip.name));
            }
            next += clip.frames;
        }
        if next == 0 || next > self.grid[0] * self.grid[1] {
            return Err(format!("it has {next} frames on {} places", self.grid[0] * self.grid[1]));
        }
        if !(self.distance_m > 0.0 && self.distance_m.is_finite()) {
            return Err("it is made for no distance".to_owned());
        }
        Ok(())
    }
}

impl Impostor {
    /// The file's bytes.
    ///
    /// # Errors
    /// What does not fit together.
    pub fn to_bytes(&self, name: &str) -> Result<Vec<u8>, ImpostorError> {
        self.check(name)?;
        let info = serde_json::to_string(&self.info).map_err(|error| unfit(name, error.to_string()))?;
        Ok(self.texture.to_bytes_with(&[("KTXorientation", "rd"), ("KTXwriter", "Heliodon"), (INFO_KEY, &info)], name)?)
    }

    /// What a file is, without unpacking its texels.
    ///
    /// # Errors
    /// Files of something else.
    pub fn info_of(bytes: &[u8], name: &str) -> Result<ImpostorInfo, ImpostorError> {
        let shape = Ktx2::shape_of(bytes, name)?;
        let text = Ktx2::text_of(bytes, INFO_KEY).ok_or_else(|| unfit(name, "it is a texture, but no impostor".to_owned()))?;
        let info: ImpostorInfo =
            serde_json::from_str(text).map_err(|error| unfit(name, format!("its description: {error}")))?;
        info.validate().map_err(|problem| unfit(name, problem))?;
        let fits = shape.format == TexelFormat::Bc7 && shape.size == info.layer_px() && shape.layers == 2 * info.views();
        if fits { Ok(info) } else { Err(unfit(name, format!("its description is not that of a texture of {shape}"))) }
    }

    /// An impostor from the bytes of a file.
    ///
    /// # Errors
    /// Files of something else, broken ones.
    pub fn from_bytes(bytes: &[u8], name: &str) -> Result<Self, ImpostorError> {
        let info = Self::info_of(bytes, name)?;
        let texture = Ktx2::from_bytes(bytes, name)?;
        let impostor = Self { info, texture };
        impostor.check(name)?;
        Ok(impostor)
    }

    fn check(&self, name: &str) -> Result<(), ImpostorError> {
        self.info.validate().map_err(|problem| unfit(name, problem))?;
        let Ktx2 { format, width, height, layers, levels } = &self.texture;
        let fits = *format == TexelFormat::Bc7 && [*width, *height] == self.info.layer_px() && *layers == 2 * self.info.views();
        let whole = levels.iter().enumerate().all(|(k, level)| level.len() as u64 == self.texture.level_bytes(k));
        if fits && whole && !levels.is_empty() {
            return Ok(());
        }
        Err(unfit(name, format!("its texture is {}", self.texture.shape())))
    }

    /// The texels of a layer of a level, decoded, with its sides.
    #[must_use]
    pub fn layer(&self, layer: u32, level: usize) -> ([u32; 2], Vec<[u8; 4]>) {
        let side = |texels: u32| (texels >> level).max(1);
        let [width, height] = [side(self.texture.width), side(self.texture.height)];
        let bytes = (self.texture.level_bytes(level) / u64::from(self.texture.layers)) as usize;
        ([width, height], decode_bc7(&self.texture.levels[level][layer as usize * bytes..][..bytes], width, height))
    }
}

fn unfit(name: &str, problem: String) -> ImpostorError {
    ImpostorError::Unfit { name: name.to_owned(), problem }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) fn info() -> ImpostorInfo {
        ImpostorInfo {
            version: VERSION,
            name: "somebody".to_owned(),
            center: [0.0, 0.9, 0.0],
            radius_m: 1.0,
            around_m: 0.5,
            heights_m: [0.0, 1.8],
            rings: vec![
                Ring::around(-10.0, 4),
                Ring::around(5.0, 8),
                Ring { from_deg: -40.0, to_deg: 40.0, ..Ring::around(40.0, 3) },
            ],
            windows_m: vec![[-0.5, -1.0, 0.5, 1.0]; 15],
            frame_px: [16, 32],
            grid: [2, 2],
            clips: vec![
                ImpostorClip { name: "rest".to_owned(), duration_s: 0.0, first: 0, frames: 1 },
                ImpostorClip { name: "walk".to_owned(), duration_s: 1.2, first: 1, frames: 3 },
            ],
            distance_m: 12.0,
        }
    }

    fn impostor() -> Impostor {
        let info = info();
        let [width, height] = info.layer_px();
        let mut texture = Ktx2 { format: TexelFormat::Bc7, width, height, layers: 30, levels: Vec::new() };
        texture.levels = (0..2).map(|level| (0..texture.level_bytes(level)).map(|i| (i % 251) as u8).collect()).collect();
        Impostor { info, texture }
    }

    #[test]
    fn files_come_back_as_they_were_written() {
        let written = impostor();
        let bytes = written.to_bytes("a").unwrap();
        assert_eq!(Impostor::from_bytes(&bytes, "a").unwrap(), written);
        assert_eq!(Impostor::info_of(&bytes, "a").unwrap(), written.info);
        assert_eq!(written.layer(29, 1).0, [16, 32]);
    }

    #[test]
    fn broken_files_are_refused_in_words() {
        let bytes = impostor().to_bytes("a").unwrap();
        for len in (0..bytes.len()).step_by(7) {
            assert!(Impostor::from_bytes(&bytes[..len], "a").is_err(), "{len} of {}", bytes.len());
        }
        for at in 0..bytes.len() {
            let mut other = bytes.clone();
            other[at] ^= 0x15;
            drop(Impostor::from_bytes(&other, "a"));
        }
        type Wrong = fn(&mut ImpostorInfo);
        let wrongs: [Wrong; 8] = [
            |info| info.version = 9,
            |info| info.radius_m = f32::NAN,
            |info| info.rings.clear(),
            |info| info.rings.swap(0, 1),
            |info| info.windows_m.truncate(3),
            |info| info.frame_px = [15, 32],
            |info| info.clips[1].first = 2,
            |info| info.grid = [1, 2],
        ];
        for (i, wrong) in wrongs.into_iter().enumerate() {
            let mut impostor = impostor();
            wrong(&mut impostor.info);
            let error = impostor.to_bytes("somebody.ktx2").unwrap_err().to_string();
            assert!(error.contains("somebody.ktx2") && error.contains("capture it again"), "{i}: {error}");
        }
        let plain = Ktx2 { format: TexelFormat::R32Uint, width: 1, height: 1, layers: 1, levels: vec![vec![0; 4]] };
        let error = Impostor::info_of(&plain.to_bytes("a").unwrap(), "a").unwrap_err().to_string();
        assert!(error.contains("no impostor"), "{error}");
    }

    #[test]
    fn clips_go_round() {
        let info = info();
        assert_eq!(info.frames_at(0, 17.0), ([0, 0], 0.0));
        assert_eq!(info.frames_at(1, 0.0), ([1, 2], 0.0));
        let (frames, part) = info.frames_at(1, 1.2 * 7.0 + 1.0);
        assert_eq!(frames, [3, 1]);
        assert!((part - 0.5).abs() < 1e-4, "{part}");
        assert_eq!(info.frames_at(9, -0.1).0, [0, 0]);
    }
}
