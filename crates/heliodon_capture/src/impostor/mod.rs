//! Models captured from many sides: [`heliodon_bundle::impostor`] says what comes of it.
//!
//! Each view is a parallel projection, drawn with many samples a texel and averaged: albedo, normals and depths over what is covered, and how much that is. Beyond it
//! they go on, so that no background is ever mixed in. A view's window is as small as all of its frames allow.

mod fill;
mod fit;
mod openness;
pub mod preview;
mod view;

pub use fit::Framing;
use fit::{LEAST_MARGIN_TEXELS, MARGIN_TEXELS, Poses};
use glam::{Vec2, Vec3};
use heliodon_bundle::impostor::{Impostor, ImpostorClip, ImpostorInfo, MAX_FRAMES, MAX_LAYER_SIDE, MAX_VIEWS, Ring};
use heliodon_image::ktx2::{Ktx2, TexelFormat};
use heliodon_image::{Bc7Quality, encode_bc7};
use heliodon_mesh::albedo::MeshAlbedo;
use heliodon_mesh::motion::MovingMesh;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use thiserror::Error;
use view::Viewed;

/// Levels of the texture: the coarsest has a quarter of the texels along each side.
const LEVELS: usize = 3;
/// Sides of frames are multiples of this, so that even the coarsest level's blocks hold one frame.
pub const FRAME_STEP: u32 = 4 << (LEVELS - 1);
/// The most samples along each side of a texel.
pub const MAX_SAMPLES: u32 = 8;

/// How a model is captured.
#[derive(Clone, Debug, PartialEq)]
pub struct CaptureParams {
    /// From where; the more views, the less their blends have to make up, and the more memory.
    pub rings: Vec<Ring>,
    /// Texels of a frame along its sides, multiples of [`FRAME_STEP`]; without, as many as pixels at `distance_m`.
    pub frame_px: Option<[u32; 2]>,
    /// How the model stands in them: fitted, unless somebody places it.
    pub framing: Framing,
    /// From how far away it will be looked at, metres: nearer than that, texels are larger than pixels.
    pub distance_m: f32,
    /// Pixels that a radian in the middle of the display has: of one of 1,024 pixels and 60 degrees 887.
    pub px_per_radian: f32,
    /// Numbers of the clips that it shall perform; none of them for all, or the rest of a model without any.
    pub clips: Vec<usize>,
    /// Frames of a second of a clip. Between frames nothing is made up.
    pub frames_per_s: f32,
    /// Samples along each side of a texel, 1 to [`MAX_SAMPLES`].
    pub samples: u32,
    /// Rays of a vertex that find out how open it is; 0 leaves the model's own darkness of the sky out.
    pub openness_rays: u32,
    /// How long blocks are searched for.
    pub quality: Bc7Quality,
}

impl CaptureParams {
    /// Somebody among many, seen by who stands or flies a little higher: 40 views.
    #[must_use]
    pub fn crowd() -> Self {
        Self {
            rings: vec![Ring::around(-8.0, 12), Ring::around(8.0, 16), Ring::around(30.0, 12)],
            frame_px: None,
            framing: Framing::default(),
            distance_m: 10.0,
            px_per_radian: 887.0,
            clips: Vec::new(),
            frames_per_s: 20.0,
            samples: 4,
            openness_rays: 64,
            quality: Bc7Quality::Usual,
        }
    }

    /// To try things out: few views, few samples, in seconds.
    #[must_use]
    pub fn preview() -> Self {
        Self {
            rings: vec![Ring::around(5.0, 8), Ring::around(30.0, 6)],
            frames_per_s: 8.0,
            samples: 2,
            openness_rays: 16,
            quality: Bc7Quality::Draft,
            ..Self::crowd()
        }
    }
}

/// Why a model cannot be captured.
#[derive(Debug, Error, PartialEq)]
pub enum CaptureError {
    /// The model has nothing to show.
    #[error("the model {0}")]
    Model(String),
    /// The parameters do not fit.
    #[error("{what}; {remedy}")]
    Params {
        /// What is wrong.
        what: String,
        /// What to do.
        remedy: &'static str,
    },
}

fn unfit(what: String, remedy: &'static str) -> CaptureError {
    CaptureError::Params { what, remedy }
}

/// What a capture will be, before anything is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct CapturePlan {
    /// The impostor but for its texels.
    pub info: ImpostorInfo,
    /// Bytes of its texture, as a device holds it.
    pub bytes: u64,
}

/// Finds out what a capture will be.
///
/// # Errors
/// As [`capture`].
pub fn plan(model: &MovingMesh, name: &str, params: &CaptureParams) -> Result<CapturePlan, CaptureError> {
    let fitted = prepare(model, name, params)?;
    fitted.check_framing()?;
    Ok(fitted.plan)
}

/// A model in its frames, not drawn yet.
struct Fitted {
    plan: CapturePlan,
    poses: Poses,
    /// What each view shows of all frames.
    shown: Vec<[Vec2; 2]>,
}

impl Fitted {
    /// The view in which the model comes nearest to its frames' border, and how near, texels.
    fn nearest_border(&self) -> (usize, f32) {
        let info = &self.plan.info;
        let margins = info.windows_m.iter().zip(&self.shown).map(|(window, shown)| fit::margin(*window, shown, info.frame_px));
        margins.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default()
    }

    /// No view may cut the model.
    fn check_framing(&self) -> Result<(), CaptureError> {
        match self.nearest_border() {
            (_, margin) if margin >= LEAST_MARGIN_TEXELS => Ok(()),
            (view, margin) => {
                let what = format!("the model comes within {margin:.1} texels of its frames' border in view {view}");
                Err(unfit(what, "zoom less, or shift it less"))
            }
        }
    }
}

fn prepare(model: &MovingMesh, name: &str, params: &CaptureParams) -> Result<Fitted, CaptureError> {
    check(params)?;
    if model.rest().triangles.is_empty() {
        return Err(CaptureError::Model("has no faces: points and lines cannot be captured".to_owned()));
    }
    let clips = clips(model, params)?;
    let poses = Poses::new(model, &clips).map_err(CaptureError::Model)?;
    let mut info = ImpostorInfo {
        version: 1,
        name: name.to_owned(),
        center: poses.center.to_array(),
        radius_m: poses.radius_m,
        around_m: poses.around_m,
        heights_m: poses.heights_m,
        rings: params.rings.clone(),
        windows_m: Vec::new(),
        frame_px: [FRAME_STEP; 2],
        grid: [1; 2],
        clips: clips.iter().map(|(_, clip)| clip.clone()).collect(),
        distance_m: params.distance_m,
    };
    let axes: Vec<[Vec3; 3]> = info.view_axes().collect();
    let shown: Vec<[Vec2; 2]> = axes.par_iter().map(|axes| poses.extent(axes)).collect();
    let frame_px = params.frame_px.unwrap_or_else(|| fit::frame_px(&shown, params.distance_m, params.px_per_radian));
    let most = MAX_LAYER_SIDE / MAX_SAMPLES * 4;
    if frame_px.iter().any(|&side| side == 0 || side % FRAME_STEP != 0 || side > most) {
        let what = format!("frames of {} x {} texels", frame_px[0], frame_px[1]);
        return Err(unfit(what, "their sides are multiples of 16 up to 2,048: give a size, or a greater distance"));
    }
    info.windows_m = shown.iter().map(|shown| params.framing.apply(fit::window(shown, frame_px))).collect();
    info.frame_px = frame_px;
    info.grid = fit::grid(info.frames(), frame_px).ok_or_else(|| {
        let what = format!("{} frames of {} x {} texels do not fit on a layer", info.frames(), frame_px[0], frame_px[1]);
        unfit(what, "take fewer frames a second, fewer clips, or smaller frames")
    })?;
    info.validate().map_err(CaptureError::Model)?;
    let texture = empty_texture(&info);
    let bytes = (0..LEVELS).map(|level| texture.level_bytes(level)).sum();
    Ok(Fitted { plan: CapturePlan { info, bytes }, poses, shown })
}

fn empty_texture(info: &ImpostorInfo) -> Ktx2 {
    let [width, height] = info.layer_px();
    Ktx2 { format: TexelFormat::Bc7, width, height, layers: 2 * info.views(), levels: Vec::new() }
}

/// Captures a model; `tell` hears how much is done, 0 to 1. The same result for any number of threads.
///
/// # Errors
/// A model without faces or of no size, parameters out of range, and more frames than a layer holds.
pub fn capture(
    model: &MovingMesh,
    name: &str,
    params: &CaptureParams,
    tell: &(dyn Fn(f32) + Sync),
) -> Result<Impostor, CaptureError> {
    let fitted = prepare(model, name, params)?;
    fitted.check_framing()?;
    let Fitted { plan: CapturePlan { info, .. }, mut poses, .. } = fitted;
    if params.openness_rays > 0 {
        openness::fill(model.rest(), &mut poses, params.openness_rays);
    }
    let axes: Vec<[Vec3; 3]> = info.view_axes().collect();
    let albedo = MeshAlbedo::new(model.rest(), 0.5 * params.distance_m / params.px_per_radian);
    let done = AtomicUsize::new(0);
    let whole = axes.len() as f32;
    let levels: Vec<Vec<[Vec<u8>; 2]>> = axes
        .par_iter()
        .zip(&info.windows_m)
        .map(|(axes, window)| {
            let layers =
                view::draw(model.rest(), &albedo, &poses, &Viewed { info: &info, axes, window, samples: params.samples });
            let encoded = layers
                .into_iter()
                .map(|level| level.texels.map(|texels| encode_bc7(&texels, level.size[0], level.size[1], params.quality)));
            let encoded = encoded.collect();
            tell((done.fetch_add(1, Ordering::Relaxed) + 1) as f32 / whole);
            encoded
        })
        .collect();
    let mut texture = empty_texture(&info);
    texture.levels = (0..LEVELS).map(|level| levels.iter().flat_map(|view| view[level].concat()).collect()).collect();
    Ok(Impostor { info, texture })
}

fn check(params: &CaptureParams) -> Result<(), CaptureError> {
    let views: u32 = params.rings.iter().map(|ring| ring.views).fold(0, u32::saturating_add);
    if views == 0 || views > MAX_VIEWS {
        return Err(unfit(format!("{views} views"), "there are 1 to 128, over all rings"));
    }
    for number in [params.distance_m, params.px_per_radian, params.frames_per_s, params.framing.zoom] {
        if !(number > 0.0 && number.is_finite()) {
            return Err(unfit(format!("a distance, a resolution, a rate or a zoom of {number}"), "give a number above 0"));
        }
    }
    if !params.framing.shift.iter().all(|shift| shift.is_finite()) {
        return Err(unfit("a shift that is no number".to_owned(), "give parts of a frame"));
    }
    if !(1..=MAX_SAMPLES).contains(&params.samples) {
        return Err(unfit(format!("{} samples along a texel's side", params.samples), "1 to 8 can be taken"));
    }
    Ok(())
}

/// The clips that are captured, each with its number in the model; the rest has none.
fn clips(model: &MovingMesh, params: &CaptureParams) -> Result<Vec<(Option<usize>, ImpostorClip)>, CaptureError> {
    let all: Vec<usize> = if params.clips.is_empty() { (0..model.clips().len()).collect() } else { params.clips.clone() };
    let mut found = Vec::new();
    let mut first = 0;
    for number in all {
        let clip = model
            .clips()
            .get(number)
            .ok_or_else(|| unfit(format!("clip {number} of {}", model.clips().len()), "name one that the model has"))?;
        let frames = (clip.duration_s * params.frames_per_s).round().max(1.0);
        if frames > MAX_FRAMES as f32 {
            let what = format!("the clip \"{}\" has {frames} frames in its {} s", clip.name, clip.duration_s);
            return Err(unfit(what, "take fewer frames a second, or another clip"));
        }
        let frames = frames as u32;
        let duration_s = if frames > 1 { clip.duration_s } else { 0.0 };
        found.push((Some(number), ImpostorClip { name: clip.name.clone(), duration_s, first, frames }));
        first += frames;
    }
    if found.is_empty() {
        found.push((None, ImpostorClip { name: "rest".to_owned(), duration_s: 0.0, first: 0, frames: 1 }));
    }
    Ok(found)
}

/// Transparent texels around what a frame shows, on the finest level.
pub const MARGIN: u32 = MARGIN_TEXELS;
