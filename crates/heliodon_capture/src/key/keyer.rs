//! A film's keyer: prepared from a few frames, then given all of them in order.

use super::edges::{Before, shrunk, softened};
use super::figure::{close_holes, inside, keep_largest};
use super::matte::{Matte, Metric, Setup, rough, solve};
use super::mixing::votes_for_light;
use super::plate::{self, Look, Plate};
use super::screen::{self, Screen};
use super::space::{Space, Wedge};
use super::spill::Spill;
use super::{KeyError, KeyParams, Keyed, Mixing, Picture};
use rayon::prelude::*;

/// What was found over all frames that were keyed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Frames.
    pub frames: u64,
    /// Pixels of all of them, those that are wholly transparent, and those that are partly.
    pub pixels: u64,
    /// See above.
    pub transparent: u64,
    /// See above.
    pub partial: u64,
    /// Pixels along the upper, left and right border, and those of them that are not transparent.
    pub border: u64,
    /// See above.
    pub border_covered: u64,
    /// Frames in which hardly any screen was to be seen.
    pub without_screen: u64,
}

/// Keys a film. Frames are given in order, for light and alpha are followed from one to the next.
#[derive(Clone, Debug)]
pub struct Keyer {
    params: KeyParams,
    screen: Screen,
    setup: Setup,
    look: Look,
    spill: Spill,
    plate: Plate,
    size: (usize, usize),
    noise: f32,
    unevenness: f32,
    kept: Option<Vec<bool>>,
    before: Before,
    tally: Tally,
}

/// Half of the wedge before pure green and blue, and before what lies far from both.
const ACCEPTANCE_PURE_DEG: f32 = 60.0;
const ACCEPTANCE_OTHER_DEG: f32 = 40.0;
/// Degrees from the pure hue at which the one ends, and the other begins.
const PURE_WITHIN_DEG: (f32, f32) = (30.0, 60.0);
/// The black point's range, in alpha.
const BLACK: (f32, f32) = (0.02, 0.2);
/// How many frames the kind of mixing is judged by, and which mean of votes for light is one for codes.
const MIXING_FRAMES: usize = 4;
const MIXING_MARGIN: f64 = -0.05;
/// Fewer half-covered pixels say nothing of it.
const MIXING_VOTERS: u64 = 200;

impl Keyer {
    /// Finds the screen in some frames of a film, best spread over all of it.
    ///
    /// # Errors
    /// Parameters outside of their range, no pictures, pictures of several sizes, or no screen in them.
    pub fn prepare(pictures: &[Picture<'_>], params: &KeyParams) -> Result<Self, KeyError> {
        params.validate()?;
        let first = pictures.first().ok_or(KeyError::NoPictures)?;
        let size = (first.width, first.height);
        if let Some(other) = pictures.iter().find(|p| (p.width, p.height) != size || p.pixels.len() != size.0 * size.1) {
            return Err(KeyError::Picture {
                width: other.width as u32,
                height: other.height as u32,
                pixels: other.pixels.len(),
            });
        }
        let screen = screen::find(pictures, params.screen)?;
        let kept = (!params.keep.is_empty()).then(|| inside(&params.keep, size.0, size.1));
        let with = |mixing: Mixing| Self::with(pictures, params, screen, mixing, kept.clone());
        if params.mixing != Mixing::Find {
            return with(params.mixing);
        }
        let keyer = with(Mixing::Linear)?;
        let step = pictures.len().div_ceil(MIXING_FRAMES).max(1);
        let (mut votes, mut voters) = (0.0, 0);
        for picture in pictures.iter().step_by(step) {
            let mut plate = keyer.plate.clone();
            plate.follow(&plate::cells(picture, &keyer.setup.space, &keyer.look));
            let (sum, count) = votes_for_light(picture, &plate, &keyer.setup);
            (votes, voters) = (votes + sum, voters + count);
        }
        if voters >= MIXING_VOTERS && votes < MIXING_MARGIN * voters as f64 { with(Mixing::Encoded) } else { Ok(keyer) }
    }

    fn with(
        pictures: &[Picture<'_>],
        params: &KeyParams,
        screen: Screen,
        mixing: Mixing,
        kept: Option<Vec<bool>>,
    ) -> Result<Self, KeyError> {
        let first = pictures.first().ok_or(KeyError::NoPictures)?;
        let (width, height) = (first.width, first.height);
        let space = Space::new(mixing);
        let color = space.of([screen.color[0], screen.color[1], screen.color[2], 255]);
        let half_deg = params.acceptance_deg.unwrap_or_else(|| acceptance_deg(screen.hue_deg));
        let wedge = Wedge::around(color, half_deg).ok_or(KeyError::GreyScreen { color: screen.color })?;
        let look = Look::of(color, wedge);
        let frames: Vec<plate::Cells> = pictures.iter().map(|picture| plate::cells(picture, &space, &look)).collect();
        let no_screen = KeyError::NoScreen { wanted: screen.kind.name(), share: screen.share };
        let over_time = plate::over_time(&frames).ok_or(no_screen)?;
        let brightness = over_time.colors.iter().map(|c| c[0] + c[1] + c[2]);
        let (low, high) = brightness.fold((f32::INFINITY, 0.0_f32), |(low, high), b| (low.min(b), high.max(b)));
        let plate = Plate::new(over_time, width, height);
        let noise = noise(pictures, &frames, &plate, &space, &wedge);
        let setup = Setup {
            space,
            wedge,
            metric: Metric::new(params.subsampled),
            black: (noise * params.black_sigmas).clamp(BLACK.0, BLACK.1),
            white: params.white_margin,
            margin: if params.subsampled { 2 } else { 1 },
        };
        Ok(Self {
            spill: Spill::new(&screen, wedge, params.spill, params.spill_grey),
            params: params.clone(),
            screen,
            setup,
            look,
            plate,
            size: (width, height),
            noise,
            unevenness: if high > 0.0 { 1.0 - low / high } else { 0.0 },
            kept,
            before: Before::default(),
            tally: Tally::default(),
        })
    }

    /// The screen.
    #[must_use]
    pub fn screen(&self) -> &Screen {
        &self.screen
    }

    /// The standard deviation of the screen's own alpha, in [0, 1]: noise of the camera and the codec.
    #[must_use]
    pub fn noise(&self) -> f32 {
        self.noise
    }

    /// How much darker the screen's darkest part is than its lightest, in [0, 1], in the space of mixing.
    #[must_use]
    pub fn unevenness(&self) -> f32 {
        self.unevenness
    }

    /// Which kind of mixing is assumed, or was found.
    #[must_use]
    pub fn mixing(&self) -> Mixing {
        if self.setup.space.linear { Mixing::Linear } else { Mixing::Encoded }
    }

    /// What was found in the frames so far.
    #[must_use]
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// Keys the next frame.
    ///
    /// # Errors
    /// A picture of another size than those that this keyer was prepared with.
    pub fn key(&mut self, picture: &Picture<'_>) -> Result<Keyed, KeyError> {
        let (width, height) = self.size;
        if (picture.width, picture.height) != self.size || picture.pixels.len() != width * height {
            let (width, height) = (picture.width as u32, picture.height as u32);
            return Err(KeyError::Picture { width, height, pixels: picture.pixels.len() });
        }
        let shown = self.plate.follow(&plate::cells(picture, &self.setup.space, &self.look));
        let Matte { alpha: mut solved, rough, foreground } = solve(picture, &self.plate, &self.setup);
        if self.params.close_holes {
            close_holes(&mut solved, width, |k| rough[k] <= 2.0 * self.setup.black);
        }
        let mut alpha = solved.clone();
        self.before.steady(picture.pixels, &mut alpha, self.params.steadiness);
        if let Some(kept) = &self.kept {
            alpha.iter_mut().zip(kept).filter(|(_, kept)| !**kept).for_each(|(alpha, _)| *alpha = 0.0);
        }
        if self.params.largest_only {
            keep_largest(&mut alpha, width);
        }
        if self.params.shrink_px > 0.0 {
            alpha = shrunk(alpha, width, self.params.shrink_px);
        }
        if self.params.soften_px > 0.0 {
            alpha = softened(alpha, width, self.params.soften_px);
        }
        let mut image = vec![[0; 4]; alpha.len()];
        image.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            for (x, out) in row.iter_mut().enumerate() {
                let k = y * width + x;
                // as it is stored: the image must fit the mask to the bit
                let code = (alpha[k].clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
                if code == 0 {
                    continue;
                }
                let alpha = f32::from(code) / 255.0;
                let (color, screen) = (self.setup.space.of(picture.pixels[k]), self.plate.at(x, y));
                let own = |c: usize| (color[c] - (1.0 - solved[k]) * screen[c]).max(0.0);
                let premultiplied = if alpha <= solved[k] {
                    let scale = alpha / solved[k];
                    std::array::from_fn(|c| own(c) * scale)
                } else {
                    // what is covered more than was found there takes the colour of what is near
                    let near =
                        foreground.as_ref().map_or(color, |grid| grid.at((x as f32 + 0.5) * 0.5, (y as f32 + 0.5) * 0.5));
                    std::array::from_fn(|c| own(c) + (alpha - solved[k]) * near[c])
                };
                let clean = self.spill.removed(premultiplied, screen).map(|x| x.min(alpha));
                let [r, g, b] = self.setup.space.store(clean, alpha, self.params.blending);
                *out = [r, g, b, code];
            }
        });
        let mask: Vec<u8> = image.iter().map(|pixel| 255 - pixel[3]).collect();
        self.count(&mask, shown);
        Ok(Keyed { width, height, image, mask })
    }

    fn count(&mut self, mask: &[u8], shown: f32) {
        let (width, height) = self.size;
        let tally = &mut self.tally;
        tally.frames += 1;
        tally.pixels += mask.len() as u64;
        tally.transparent += mask.iter().filter(|&&m| m == 255).count() as u64;
        tally.partial += mask.iter().filter(|&&m| m != 255 && m != 0).count() as u64;
        let sides = (1..height).flat_map(|y| [y * width, y * width + width - 1]);
        for k in (0..width).chain(sides) {
            tally.border += 1;
            tally.border_covered += u64::from(mask[k] < 230);
        }
        tally.without_screen += u64::from(shown < 0.05);
    }
}

/// Half of the wedge for a hue: walls of other hues are nearer to skin.
fn acceptance_deg(hue_deg: f32) -> f32 {
    let off = (hue_deg - 120.0).abs().min((hue_deg - 240.0).abs());
    let t = ((off - PURE_WITHIN_DEG.0) / (PURE_WITHIN_DEG.1 - PURE_WITHIN_DEG.0)).clamp(0.0, 1.0);
    ACCEPTANCE_PURE_DEG + (ACCEPTANCE_OTHER_DEG - ACCEPTANCE_PURE_DEG) * t
}

/// The standard deviation of the screen's own alpha, by its median absolute deviation in cells that are screen.
fn noise(pictures: &[Picture<'_>], frames: &[plate::Cells], over_time: &Plate, space: &Space, wedge: &Wedge) -> f32 {
    let step = pictures.len().div_ceil(MIXING_FRAMES).max(1);
    let mut found = Vec::new();
    for (picture, cells) in pictures.iter().zip(frames).step_by(step) {
        let mut plate = over_time.clone();
        plate.follow(cells);
        let size = plate::cell_size(picture.width, picture.height);
        let alpha = rough(picture, &plate, space, wedge);
        for (k, &a) in alpha.iter().enumerate().step_by(7) {
            let cell = k / picture.width / size * cells.columns + k % picture.width / size;
            if cells.colors[cell].is_some() && a.abs() < 0.3 {
                found.push(a.abs());
            }
        }
    }
    if found.is_empty() {
        return BLACK.0;
    }
    let middle = found.len() / 2;
    // of a normal distribution the median of |x| is 0.6745 sigma
    *found.select_nth_unstable_by(middle, f32::total_cmp).1 / 0.6745
}
