//! The light of all texels: lamps and suns, the sky, and what surfaces reflect from one to the other.
//!
//! Light is **irradiance over pi**. The first light, of lamps and sky, is sampled ([`crate::refine`]: few texels first, more where it changes). Each bounce is a
//! gather over the light that texels had from the one before, so its cost does not grow with their number, and later ones, which are weaker and smoother, ask
//! fewer and fewer texels for the same error of the whole. What has no texels (backs, and triangles that others light) reflects as well: paths go on from there.
//!
//! Texels that lie inside something take their light from the nearest ones of their chart that do not, and both sides of a border between charts are made to show the
//! same ([`crate::seams`]). Nothing shines through: rays start off the surface on the side that the texel shows, and off the sides of its triangle, so that no
//! ray starts in the plane of the wall that rises there; and what lies on both sides of a wall thinner than a texel is dark where one side is.

mod coded;
mod denoise;
mod directions;
mod fill;
mod gather;
mod kept;
mod lamps;
mod links;
mod matching;
pub mod models;
mod stage;

pub use coded::shown_srgb8;
pub use denoise::DenoiseParams;
pub use matching::{Widest, match_seams, widest};

use crate::lights::Light;
use crate::refine::{Grid, RefineParams, Refined, Sampled, refine};
pub use crate::seams::{Seams, shown_codes};
use crate::texels::Texel;
use crate::unwrap::Unwrapped;
use crate::walls::{DARK, Footing, Walls, take_from};
use denoise::denoise;
use directions::{EVEN, Lookouts};
use gather::{Arriving, Found, Gather};
use glam::Vec3;
use heliodon_image::HdrImage;
use heliodon_math::color::luminance;
use heliodon_math::dome::Environment;
use heliodon_rays::TriangleScene;
use kept::Kept;
use models::{Illumination, SurfaceModel};
use serde::{Deserialize, Serialize};
use stage::Stage;

/// What part of the light triangles reflect, linear Rec. 709, each component in [0, 1]: of a triangle, at the weights of its second and third corner.
pub type Albedo<'a> = &'a (dyn Fn(u32, f32, f32) -> Vec3 + Sync);

/// What is lit, and by what.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// Answers rays among all triangles.
    pub rays: &'a TriangleScene,
    /// Of all vertices, metres.
    pub positions: &'a [Vec3],
    /// Unit, one for each vertex.
    pub normals: &'a [Vec3],
    /// Counter-clockwise seen from the front. The first ones have texels, those of `unwrapped`; what follows only stands in the light and reflects.
    pub triangles: &'a [[u32; 3]],
    /// Where the first triangles lie in the texture.
    pub unwrapped: &'a Unwrapped,
    /// Their texels, of [`crate::texels::texels`].
    pub texels: &'a [Texel],
    /// Texels of a texture along u and v.
    pub sides: [u32; 2],
    /// What is reflected.
    pub albedo: Albedo<'a>,
    /// What shines.
    pub lights: &'a [Light],
    /// What is seen where nothing is in the way.
    pub sky: &'a dyn Environment,
}

/// How light is solved.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct SolveParams {
    /// How often light is reflected; 0 is direct light alone. Those that are too weak to be seen are left out.
    pub bounces: u32,
    /// The error that is asked for, as a part of the light around, above 0: of the samples' mean, and of interpolation. Half of it costs about four times as much.
    pub error: f32,
    /// Directions of the upper half that a texel looks in at most, 64 to 1,048,576; with no more than 512 nobody asks whether they were enough.
    pub samples: u32,
    /// Samples of a lamp with an area that a texel takes at most, 1 to 1,048,576; 48 are taken anyway.
    pub light_samples: u32,
    /// What is darker than this part of the mean light need not be exact, 0 to 10; the mean is of light cut at what 95 of 100 texels do not exceed.
    pub dark: f32,
    /// Texels between samples of the first lattice, 1 to 64, a power of two; 1 samples every texel.
    pub first_stride: u32,
    /// How far from the surface rays start, metres; none takes what rounding asks for.
    pub offset_m: Option<f32>,
    /// Smooths what noise is left; none in truth.
    pub denoise: Option<DenoiseParams>,
    /// Whether both sides of borders between charts are matched.
    pub match_seams: bool,
    /// Picks the directions.
    pub seed: u32,
}

impl Default for SolveParams {
    fn default() -> Self {
        Self {
            bounces: 4,
            error: 0.02,
            samples: 2048,
            light_samples: 256,
            dark: 0.05,
            first_stride: 8,
            offset_m: None,
            denoise: None,
            match_seams: true,
            seed: 1,
        }
    }
}

impl SolveParams {
    /// For a first look: a tenth of the time, light in blotches.
    #[must_use]
    pub fn preview() -> Self {
        Self {
            bounces: 2,
            error: 0.08,
            samples: 256,
            light_samples: 64,
            denoise: Some(DenoiseParams::default()),
            ..Self::default()
        }
    }

    /// For keeping: no error that can be seen.
    #[must_use]
    pub fn archival() -> Self {
        Self { bounces: 16, error: 0.005, samples: 8192, light_samples: 1024, dark: 0.02, ..Self::default() }
    }
}

/// Why light was not solved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// Arrays that contradict one another.
    #[error("{0}")]
    Mismatch(String),
    /// A setting out of its range.
    #[error("{setting} is {value}; it is to be {allowed}")]
    Setting {
        /// Its name.
        setting: &'static str,
        /// What was given.
        value: String,
        /// What may be.
        allowed: &'static str,
    },
}

/// How light is told: by which models.
#[derive(Clone, Copy)]
pub struct Models<'a> {
    /// What arrives.
    pub illumination: &'a dyn Illumination,
    /// What surfaces make of it.
    pub surface: &'a dyn SurfaceModel,
}

/// What was done.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Notes {
    /// The names of the models.
    pub illumination: String,
    /// Of surfaces.
    pub surface: String,
    /// All texels, and how many were sampled for each light: first that of lamps and sky, then bounce by bounce. Fewer than were asked for: the rest cannot be seen.
    pub texels: usize,
    /// See `texels`.
    pub sampled: Vec<usize>,
    /// Texels that lie inside something.
    pub inside: usize,
    /// Texels with a wall on them that is thinner than they are: dark where one of its sides is.
    pub parted: usize,
    /// Rays that were traced.
    pub rays: u64,
    /// Whether it was smoothed: then errors are no more what was asked for.
    pub denoised: bool,
    /// By how much both sides of borders between charts differ at most.
    pub widest_seam: f32,
    /// The same in codes of eight bits ([`shown_codes`]), where white is what 95 of 100 texels do not exceed.
    pub widest_seam_codes: f32,
    /// At how many places of borders both sides are matched, and how many were left, since nobody sees them: all texels there lie inside something, or something lies on them.
    pub seam_places: [usize; 2],
    /// The mean light of all texels that are covered and valid.
    pub mean: [f32; 3],
}

/// The light of all texels.
#[derive(Clone, Debug, PartialEq)]
pub struct LightMap {
    /// Irradiance over pi of each texel, or what the surface model shows for it.
    pub light: Vec<Vec3>,
    /// Whether it lies where light can be; others have borrowed what those beside them have, or show what there is inside.
    pub valid: Vec<bool>,
    /// Borders between charts, whose sides are made to show the same; where dark and lit texels lie beside one within something, or with a wall on it, none of these becomes brighter.
    pub seams: Seams,
    /// How it came to be.
    pub notes: Notes,
}

/// Samples are no further from each other than so many times the harmonic mean distance of what they see.
const REACH: f32 = 1.0;
/// Texels that lie inside something borrow from no further away: filtering asks for one, and one more is asked for by the next smaller version.
const FILTERED: u32 = 2;
/// Texels whose mean tells how bright the scene is.
const LOOKS: usize = 1024;
/// Samples and light that surfaces share: a part of the mean that is certain to this is left out.
const UNSEEN: f32 = 0.1;

/// Solves the light of all texels of a scene. Takes Rayon's current pool; the same for any number of threads.
///
/// # Errors
/// Arrays that contradict one another, settings out of range.
pub fn solve(scene: &Scene, models: &Models, params: &SolveParams) -> Result<LightMap, SolveError> {
    scene.validate()?;
    params.validate()?;
    let (mut stage, albedo) = Stage::new(scene, params.offset_m.unwrap_or_else(|| scene.rays.start_offset()));
    let grid = Grid::new(scene.texels, &scene.unwrapped.chart, stage.places.clone());
    let blocks = (2 * params.samples).div_ceil(EVEN);
    let lookouts = Lookouts::new(&stage, blocks, params.seed, models.illumination);
    let mut rays = 0;
    let mut kept = Kept::default();
    let mut first = |texels: &[u32], floor: f32| {
        let gather = Gather {
            stage: &stage,
            models,
            params,
            lookouts: &lookouts,
            arriving: Arriving::Sky,
            beside: &[],
            valid: &[],
            floor,
        };
        let (mut found, of_sky) = gather.all(&mut kept, texels);
        let mut light: Vec<Vec3> = found.iter().map(|found| found.light).collect();
        rays += of_sky + lamps::add_lamps(&stage, models, params, floor, texels, &mut light);
        found.iter_mut().zip(light).for_each(|(found, light)| found.light = light);
        found
    };
    let floor = params.dark * brightness(scene.texels.len(), |texels| first(texels, f32::MAX));
    let mut first_at_floor = |texels: &[u32]| sampled(first(texels, floor));
    let mut refined = refine(&grid, 3, &refine_params(params, floor, Vec::new()), &mut first_at_floor);
    let (start, is_own) = (|texel: u32| stage.start(texel), |triangle: u32, texel: u32| scene.is_own(triangle, texel));
    let footing = Footing { rays: scene.rays, grid: &grid, start: &start, is_own: &is_own };
    let all: Vec<u32> = (0..grid.len() as u32).collect();
    let (lain_on, mut asked) = footing.lain_on(&all);
    let mut parted = vec![false; scene.texels.len()];
    let walls = loop {
        let stands: Vec<bool> = refined.valid.iter().zip(&lain_on).map(|(valid, lain_on)| *valid && !lain_on).collect();
        let (walls, traced) = Walls::find(&footing, &stands, &|_, _| true);
        asked += traced;
        parted.fill(false);
        walls.texels().for_each(|texel| parted[texel as usize] = true);
        if !sample_parted(&mut refined, &parted, &mut first_at_floor) {
            break walls;
        }
    };
    rays += asked;
    let Refined { values, valid, samples, .. } = refined;
    let mut notes_sampled = vec![samples];
    let mut light = colors(&values);
    let reflected_of =
        |light: &[Vec3]| -> Vec<Vec3> { light.iter().zip(&albedo).map(|(light, albedo)| light * albedo).collect() };
    let mut reflected = vec![reflected_of(&light)];
    stage.whole = valid.iter().zip(&parted).map(|(valid, parted)| *valid && !parted).collect();
    stage.parted = parted;
    rays += kept.part(&stage, &lookouts);
    let borrowers = grid.borrowers(&valid, FILTERED);

    for _ in 0..models.illumination.bounces(params.bounces) {
        let beside: Vec<f32> = light.iter().map(|light| light.max_element()).collect();
        // What borrows need not be asked, nor what lies inside something and was dark until now.
        let was_lit = |texel: usize| reflected.len() == 1 || beside[texel] > params.error * floor;
        let is_idle = |texel: u32| borrowers[texel as usize] || (!valid[texel as usize] && !was_lit(texel as usize));
        let mut gathered = |texels: &[u32]| {
            let arriving = Arriving::Reflected(&reflected);
            let gather =
                Gather { stage: &stage, models, params, lookouts: &lookouts, arriving, beside: &beside, valid: &valid, floor };
            let asked: Vec<u32> = texels.iter().copied().filter(|texel| !is_idle(*texel)).collect();
            let (some, traced) = gather.all(&mut kept, &asked);
            rays += traced;
            let mut found = vec![Found::NOTHING; texels.len()];
            let places = (0..texels.len()).filter(|&i| !is_idle(texels[i]));
            // whether a texel is valid is known
            places.zip(some).for_each(|(i, some)| found[i] = Found { valid: valid[texels[i] as usize], ..some });
            sampled(found)
        };
        let mut refined = refine(&grid, 3, &refine_params(params, floor, beside.clone()), &mut gathered);
        sample_parted(&mut refined, &stage.parted, &mut gathered);
        notes_sampled.push(refined.samples);
        let more = colors(&refined.values);
        let most = more.iter().zip(&beside).map(|(more, beside)| more.max_element() / (beside + floor).max(f32::MIN_POSITIVE));
        let is_unseen = most.fold(0.0, f32::max) < UNSEEN * params.error;
        light.iter_mut().zip(&more).for_each(|(light, more)| *light += more);
        reflected.push(reflected_of(&more));
        if is_unseen {
            break;
        }
    }
    drop(reflected);
    if let Some(settings) = &params.denoise {
        denoise(&grid, &mut light, settings);
    }
    let bright = bright(seen(scene.texels, &light, &valid).map(luminance).collect());
    light.iter_mut().zip(&stage.places).for_each(|(light, place)| *light = models.surface.shown(*light, place, bright));
    let darkened = walls.darkened(DARK, |texel| light[texel as usize].max_element());
    take_from(&darkened, &mut light, 1);
    let parted = stage.parted.iter().filter(|parted| **parted).count();
    let seen: Vec<bool> = valid.iter().zip(&lain_on).map(|(valid, lain_on)| *valid && !lain_on).collect();
    let seams = matching::seams(scene, &grid, &seen, &stage.whole, &light);
    let seen_apart = if params.match_seams { match_seams(&seams, &mut light) } else { widest(&seams, &light) };
    let mut notes = Notes {
        illumination: models.illumination.name().to_owned(),
        surface: models.surface.name().to_owned(),
        texels: light.len(),
        sampled: notes_sampled,
        inside: valid.iter().filter(|valid| !**valid).count(),
        rays,
        parted,
        denoised: params.denoise.is_some(),
        widest_seam: seen_apart.value,
        widest_seam_codes: seen_apart.codes,
        seam_places: seen_apart.places,
        mean: [0.0; 3],
    };
    notes.mean = mean(scene.texels, &light, &valid).to_array();
    Ok(LightMap { light, valid, seams, notes })
}

fn refine_params(params: &SolveParams, floor: f32, beside: Vec<f32>) -> RefineParams {
    RefineParams {
        first_stride: params.first_stride,
        error: params.error,
        floor,
        beside,
        borrowed_from: FILTERED,
        reach: REACH,
        ..RefineParams::default()
    }
}

/// Samples texels with a wall on them after all that were interpolated: what stands on them is narrower than they are, and those beside them need not know of it. Returns whether any
/// turned out to lie inside something: a chart's rim had what those beside it agreed on, so it keeps that as one that borrows, and no wall parts it from them.
fn sample_parted(refined: &mut Refined, parted: &[bool], sample: &mut dyn FnMut(&[u32]) -> Sampled) -> bool {
    let is_asked = |&texel: &usize| parted[texel] && refined.valid[texel] && !refined.sampled[texel];
    let asked: Vec<u32> = (0..parted.len()).filter(is_asked).map(|texel| texel as u32).collect();
    let found = sample(&asked);
    for ((texel, values), valid) in asked.iter().map(|&t| t as usize).zip(found.values.as_chunks::<3>().0).zip(found.valid) {
        refined.valid[texel] = valid;
        if valid {
            refined.values[3 * texel..][..3].copy_from_slice(values);
            refined.sampled[texel] = true;
            refined.samples += 1;
        }
    }
    asked.iter().any(|&texel| !refined.valid[texel as usize])
}

fn sampled(found: Vec<Found>) -> Sampled {
    Sampled {
        values: found.iter().flat_map(|found| found.light.to_array()).collect(),
        valid: found.iter().map(|found| found.valid).collect(),
        reach_m: found.iter().map(|found| found.reach_m).collect(),
    }
}

/// Light, which a chart's rim may have been continued to less than nothing of.
fn colors(values: &[f32]) -> Vec<Vec3> {
    values.as_chunks::<3>().0.iter().map(|&color| Vec3::from_array(color).max(Vec3::ZERO)).collect()
}

/// The mean light of texels from all over the scene, each no brighter than nearly all are: one beside a lamp says nothing of the others.
fn brightness(texels: usize, light: impl FnOnce(&[u32]) -> Vec<Found>) -> f32 {
    let stride = texels.div_ceil(LOOKS).max(1);
    let some: Vec<u32> = (0..texels as u32).step_by(stride).collect();
    let mut valid: Vec<f32> = light(&some).iter().filter(|found| found.valid).map(|found| found.light.max_element()).collect();
    let bright = nearly_brightest(&mut valid);
    valid.iter().map(|light| light.min(bright)).sum::<f32>() / valid.len().max(1) as f32
}

/// What 95 of 100 values are no greater than; 0 where there is none. Reorders them.
pub fn nearly_brightest(values: &mut [f32]) -> f32 {
    let place = values.len() * 95 / 100;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(place, f32::total_cmp).1 }
}

/// What 95 of 100 values do not exceed, or where these are black, of those that are not.
fn bright(mut values: Vec<f32>) -> f32 {
    let bright = nearly_brightest(&mut values);
    if bright > 0.0 {
        return bright;
    }
    values.retain(|value| *value > 0.0);
    nearly_brightest(&mut values)
}

/// The light of all texels that are covered and valid.
fn seen<'a>(texels: &'a [Texel], light: &'a [Vec3], valid: &'a [bool]) -> impl Iterator<Item = Vec3> {
    let all = texels.iter().zip(light).zip(valid);
    all.filter(|((texel, _), valid)| texel.is_covered && **valid).map(|((_, light), _)| *light)
}

fn mean(texels: &[Texel], light: &[Vec3], valid: &[bool]) -> Vec3 {
    let sum: glam::DVec3 = seen(texels, light, valid).map(Vec3::as_dvec3).sum();
    (sum / seen(texels, light, valid).count().max(1) as f64).as_vec3()
}

impl Scene<'_> {
    fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }

    /// Whether a triangle that was met is of the chart of a texel.
    fn is_own(&self, triangle: u32, texel: u32) -> bool {
        let chart = &self.unwrapped.chart;
        chart.get(triangle as usize) == chart.get(self.texels[texel as usize].triangle as usize)
    }

    /// What is reflected at a place: no more than all light, and nothing of what is no number.
    fn handed_on(&self, triangle: u32, u: f32, v: f32) -> Vec3 {
        let albedo = (self.albedo)(triangle, u, v);
        if albedo.is_finite() { albedo.clamp(Vec3::ZERO, Vec3::ONE) } else { Vec3::ZERO }
    }

    /// Whether all arrays agree.
    ///
    /// # Errors
    /// What does not.
    pub fn validate(&self) -> Result<(), SolveError> {
        let wrong = |what: String| Err(SolveError::Mismatch(what));
        let (positions, normals) = (self.positions.len(), self.normals.len());
        if positions != normals {
            return wrong(format!("{normals} normals for {positions} positions"));
        }
        if let Some(triangle) = self.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= positions)) {
            return wrong(format!("triangle {triangle} names a vertex that does not exist"));
        }
        let unwrapped = self.unwrapped.triangles.len();
        if unwrapped > self.triangles.len() || self.rays.triangle_count() > self.triangles.len() {
            return wrong(format!(
                "{} triangles, of which {unwrapped} were unwrapped and rays meet {}",
                self.triangles.len(),
                self.rays.triangle_count()
            ));
        }
        let [width, height] = self.sides;
        let outside = |texel: &Texel| {
            texel.triangle as usize >= unwrapped
                || u32::from(texel.x) >= width
                || u32::from(texel.y) >= height
                || u32::from(texel.sheet) >= self.unwrapped.packing.sheets
        };
        match self.texels.iter().position(outside) {
            Some(texel) => wrong(format!("texel {texel} lies outside of {width} by {height}, or on no triangle")),
            None => Ok(()),
        }
    }
}

impl SolveParams {
    /// Whether all settings lie in their ranges.
    ///
    /// # Errors
    /// The first that does not.
    pub fn validate(&self) -> Result<(), SolveError> {
        let wrong = |setting, value: String, allowed| Err(SolveError::Setting { setting, value, allowed });
        let positive = |x: f32| x.is_finite() && x > 0.0;
        if !positive(self.error) {
            return wrong("error", self.error.to_string(), "above 0");
        }
        if !(64..=1 << 20).contains(&self.samples) {
            return wrong("samples", self.samples.to_string(), "64 to 1,048,576");
        }
        if !(1..=1 << 20).contains(&self.light_samples) {
            return wrong("light_samples", self.light_samples.to_string(), "1 to 1,048,576");
        }
        if !(0.0..=10.0).contains(&self.dark) {
            return wrong("dark", self.dark.to_string(), "0 to 10");
        }
        if !(self.first_stride.is_power_of_two() && self.first_stride <= 64) {
            return wrong("first_stride", self.first_stride.to_string(), "1, 2, 4, 8, 16, 32 or 64");
        }
        if let Some(denoise) = &self.denoise {
            if !(1..=6).contains(&denoise.rounds) {
                return wrong("denoise.rounds", denoise.rounds.to_string(), "1 to 6");
            }
            if !positive(denoise.contrast) {
                return wrong("denoise.contrast", denoise.contrast.to_string(), "above 0");
            }
        }
        match self.offset_m {
            Some(offset_m) if !positive(offset_m) => wrong("offset_m", offset_m.to_string(), "above 0"),
            _ => Ok(()),
        }
    }
}

impl LightMap {
    /// Whether all light is finite and not negative, and there is as much of everything as there are texels.
    ///
    /// # Errors
    /// What is wrong.
    pub fn validate(&self) -> Result<(), SolveError> {
        let texels = self.light.len();
        if [self.valid.len(), self.seams.texel_count(), self.notes.texels] != [texels; 3] {
            return Err(SolveError::Mismatch(format!("{} lights and {} marks", self.light.len(), self.valid.len())));
        }
        match self.light.iter().position(|light| !light.is_finite() || light.min_element() < 0.0) {
            Some(texel) => Err(SolveError::Mismatch(format!("texel {texel} has the light {}", self.light[texel]))),
            None => Ok(()),
        }
    }

    /// One texture, its first row that of v = 0. What no texel has takes what the nearest one has, so that smaller versions of a chart, as far as the margin around it goes,
    /// hold nothing of another.
    ///
    /// # Panics
    /// When the texels are not those that were solved.
    #[must_use]
    pub fn image(&self, texels: &[Texel], sheet: u16, sides: [u32; 2]) -> HdrImage {
        image(texels, &self.light, sheet, sides)
    }
}

/// As [`LightMap::image`], of other colours of the texels.
///
/// # Panics
/// When there is not a colour for each texel.
#[must_use]
pub fn image(texels: &[Texel], light: &[Vec3], sheet: u16, [width, height]: [u32; 2]) -> HdrImage {
    assert_eq!(texels.len(), light.len(), "a colour for each texel");
    let mut image = HdrImage::filled(width, height, Vec3::ZERO);
    let mut known = vec![false; image.pixels.len()];
    for (texel, light) in texels.iter().zip(light).filter(|(texel, _)| texel.sheet == sheet) {
        let at = usize::from(texel.y) * width as usize + usize::from(texel.x);
        (image.pixels[at], known[at]) = (*light, true);
    }
    fill::fill(&mut image, known);
    image
}

/// How many levels of a light map with such a margin between charts hold nothing of another chart where one is filtered, the first counted. On level L a filter reaches
/// 3 2^(L-1) - 1 texels of the first beyond those that it takes on that one, on both sides of the margin; a texel stands for two by two of the level before as long as
/// the side is even.
#[must_use]
pub fn clean_levels(margin: u32, [width, height]: [u32; 2]) -> u32 {
    let halvings = (width | height).trailing_zeros().min(16);
    1 + (1..=halvings).take_while(|&level| margin >= 2 * ((3 << (level - 1)) - 1)).count() as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packing::PackParams;
    use crate::unwrap::{UnwrapParams, unwrap};
    use glam::Vec2;
    use heliodon_image::Wrap;

    #[test]
    fn no_level_of_a_chart_holds_light_of_another() {
        // eighty squares that face two ways, lit by their numbers
        let square = |i: u8| {
            let at = Vec3::new(f32::from(i % 10), 0.0, f32::from(i / 10)) * 1.5;
            [Vec3::ZERO, Vec3::X, Vec3::new(0.7, 0.0, 1.2), Vec3::Z].map(|p| at + p)
        };
        let positions: Vec<Vec3> = (0..80).flat_map(square).collect();
        let triangles: Vec<[u32; 3]> =
            (0..80).flat_map(|i| [[0, 1, 2], [0, 2, 3]].map(|t: [u32; 3]| t.map(|v| v + 4 * i))).collect();
        for (margin, levels) in [(0, 1), (3, 1), (4, 2), (10, 3), (22, 4)] {
            let side = 512;
            assert_eq!(clean_levels(margin, [side; 2]), levels);
            let pack = PackParams { width: side, height: side, margin, ..PackParams::default() };
            let unwrapped = unwrap(&positions, &triangles, &[], &UnwrapParams { pack, ..UnwrapParams::default() }).unwrap();
            let texels = crate::texels::texels(&unwrapped, side, side);
            let chart = |t: usize| Vec3::splat(1.0 + unwrapped.chart[t] as f32);
            let light: Vec<Vec3> = texels.iter().map(|texel| chart(texel.triangle as usize)).collect();
            let mut level = image(&texels, &light, 0, [side; 2]);
            for number in 0..levels {
                for (t, corners) in unwrapped.triangles.iter().enumerate() {
                    let [a, b, c] = corners.map(|v| unwrapped.uvs[v as usize] * level.width as f32);
                    let shares =
                        (0..=20_u8).flat_map(|i| (0..=20 - i).map(move |j| [f32::from(i), f32::from(j)].map(|x| x / 20.0)));
                    for [u, v] in shares {
                        let p: Vec2 = a + (b - a) * u + (c - a) * v;
                        let seen = level.sample_bilinear(p.x, p.y, Wrap::Clamp);
                        assert!((seen - chart(t)).length() < 0.01, "margin {margin}, level {number}: {seen} of {}", chart(t));
                    }
                }
                let finer = level;
                level = HdrImage::from_fn(finer.width / 2, finer.height / 2, |x, y| {
                    let four = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[dx, dy]| finer.pixel(2 * x + dx, 2 * y + dy));
                    four.iter().sum::<Vec3>() / 4.0
                });
            }
        }
        assert_eq!(clean_levels(64, [100, 64]), 3);
        assert_eq!(clean_levels(64, [33, 64]), 1);
    }

    #[test]
    fn settings_out_of_range_are_named() {
        let of = |rounds: u32, contrast: f32| {
            let denoise = Some(DenoiseParams { rounds, contrast });
            SolveParams { denoise, ..SolveParams::default() }.validate()
        };
        assert!(of(3, 0.1).is_ok());
        for (rounds, contrast) in [(0, 0.1), (7, 0.1), (3, 0.0), (3, f32::NAN), (3, f32::INFINITY)] {
            assert!(matches!(of(rounds, contrast), Err(SolveError::Setting { .. })), "{rounds} {contrast}");
        }
    }

    #[test]
    fn texels_with_a_wall_on_them_that_lie_inside_are_told_and_keep_what_was_agreed() {
        let mut refined =
            Refined { values: vec![0.5; 12], sampled: vec![false, true, false, false], valid: vec![true; 4], samples: 1 };
        let mut asked = Vec::new();
        let mut sample = |texels: &[u32]| {
            asked.push(texels.to_vec());
            let inside = |texel: &u32| *texel == 2;
            Sampled {
                values: texels.iter().flat_map(|texel| if inside(texel) { [0.0; 3] } else { [2.0; 3] }).collect(),
                valid: texels.iter().map(|texel| !inside(texel)).collect(),
                reach_m: vec![1.0; texels.len()],
            }
        };
        let parted = [true, true, true, false];
        assert!(sample_parted(&mut refined, &parted, &mut sample));
        assert_eq!(refined.valid, [true, true, false, true]);
        assert_eq!(refined.sampled, [true, true, false, false]);
        assert_eq!(refined.values, [[2.0; 3], [0.5; 3], [0.5; 3], [0.5; 3]].concat());
        // those are no more asked
        assert!(!sample_parted(&mut refined, &parted, &mut sample));
        assert_eq!(asked, [vec![0, 2], vec![]]);
    }

    #[test]
    fn one_bright_texel_does_not_say_how_bright_it_is() {
        let found = |texels: &[u32]| {
            let light = |&texel: &u32| Vec3::splat(if texel == 0 { 1.0e9 } else { 2.0 });
            texels.iter().map(|texel| Found { light: light(texel), valid: true, reach_m: 1.0 }).collect::<Vec<_>>()
        };
        assert_eq!(brightness(1000, found), 2.0);
        assert_eq!(brightness(0, found), 0.0);
        assert_eq!(nearly_brightest(&mut [3.0, 1.0, 2.0]), 3.0);
    }
}
