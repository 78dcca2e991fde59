//! Which colour the screen has.

use super::{KeyError, Picture, ScreenChoice};

/// What kind of colour a screen has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScreenKind {
    /// Hue 90 to 160 degrees.
    Green,
    /// Hue 195 to 260 degrees.
    Blue,
    /// A wall of some other hue.
    Other,
}

impl ScreenKind {
    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Green => "green",
            Self::Blue => "blue",
            Self::Other => "other",
        }
    }
}

/// A screen, as it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Screen {
    /// The median of its sRGB codes over all pictures.
    pub color: [u8; 3],
    /// What it is.
    pub kind: ScreenKind,
    /// Hue in degrees, [0, 360): 120 is green, 240 blue.
    pub hue_deg: f32,
    /// How far from grey, in [0, 1].
    pub saturation: f32,
    /// Share of all pixels that look like it, in [0, 1].
    pub share: f32,
    /// Share of the pixels along the upper, left and right border that look like it, in [0, 1].
    pub border_share: f32,
}

/// Degrees of hue in a bin.
const BIN_DEG: f32 = 3.0;
const BINS: usize = 120;
/// Bins to each side that count as one colour.
const WINDOW: usize = 5;
/// Hues of screens that are looked for: yellow-green to green, cyan to blue.
const GREEN_DEG: std::ops::Range<f32> = 50.0..172.0;
const BLUE_DEG: std::ops::Range<f32> = 185.0..265.0;
/// Colours with less saturation or brightness than this say nothing of hue.
const MIN_SATURATION: f32 = 0.25;
const MIN_VALUE: f32 = 0.12;
/// How many pixels of a picture are looked at, about.
const SAMPLES: usize = 100_000;
/// How much more a pixel in the outer eighth counts: actors stand in the middle.
const BORDER_WEIGHT: f32 = 3.0;
/// With less of the pictures like a screen, there is none.
const MIN_SHARE: f32 = 0.02;

/// Hue in degrees, saturation and value in [0, 1] (Smith, "Color gamut transform pairs", SIGGRAPH 1978).
pub(super) fn hue_saturation_value([r, g, b]: [u8; 3]) -> (f32, f32, f32) {
    let (high, low) = (r.max(g).max(b), r.min(g).min(b));
    if high == low {
        return (0.0, 0.0, f32::from(high) / 255.0);
    }
    let span = f32::from(high - low);
    let [fr, fg, fb] = [r, g, b].map(f32::from);
    let sixth = if high == g {
        2.0 + (fb - fr) / span
    } else if high == r {
        (fg - fb) / span
    } else {
        4.0 + (fr - fg) / span
    };
    ((sixth * 60.0 + 360.0) % 360.0, span / f32::from(high), f32::from(high) / 255.0)
}

fn distance_deg(a: f32, b: f32) -> f32 {
    let d = (a - b).abs() % 360.0;
    d.min(360.0 - d)
}

/// Every pixel that is looked at, and whether it lies at the border where screens are seen.
fn samples<'a>(pictures: &'a [Picture<'a>]) -> impl Iterator<Item = ([u8; 3], bool)> + 'a {
    pictures.iter().flat_map(|picture| {
        let step = libm::sqrt(picture.pixels.len() as f64 / SAMPLES as f64).ceil().max(1.0) as usize;
        let (w, h) = (picture.width, picture.height);
        (step / 2..h).step_by(step).flat_map(move |y| {
            (step / 2..w).step_by(step).map(move |x| {
                let [r, g, b, _] = picture.pixels[y * w + x];
                ([r, g, b], x * 8 < w || (w - 1 - x) * 8 < w || y * 8 < h)
            })
        })
    })
}

/// Finds the screen in pictures of a film.
pub(super) fn find(pictures: &[Picture<'_>], choice: ScreenChoice) -> Result<Screen, KeyError> {
    if pictures.is_empty() {
        return Err(KeyError::NoPictures);
    }
    let (wanted, centre) = match choice {
        ScreenChoice::Find => ("green or blue", None),
        ScreenChoice::Green => ("green", None),
        ScreenChoice::Blue => ("blue", None),
        ScreenChoice::Color(color) => {
            let (hue, saturation, _) = hue_saturation_value(color);
            if saturation < 0.15 {
                return Err(KeyError::GreyScreen { color });
            }
            ("such a", Some((hue, saturation)))
        }
    };
    let mut bins = [0.0_f64; BINS];
    for (color, border) in samples(pictures) {
        let (hue, saturation, value) = hue_saturation_value(color);
        if saturation >= MIN_SATURATION.min(centre.map_or(1.0, |c| c.1 * 0.6)) && value >= MIN_VALUE {
            let weight = saturation * value * if border { BORDER_WEIGHT } else { 1.0 };
            bins[((hue / BIN_DEG) as usize).min(BINS - 1)] += f64::from(weight);
        }
    }
    let allowed = |hue: f32| match (choice, centre) {
        (_, Some((centre, _))) => distance_deg(hue, centre) < 25.0,
        (ScreenChoice::Green, _) => GREEN_DEG.contains(&hue),
        (ScreenChoice::Blue, _) => BLUE_DEG.contains(&hue),
        _ => GREEN_DEG.contains(&hue) || BLUE_DEG.contains(&hue),
    };
    let window = |bin: usize| (0..=2 * WINDOW).map(|k| bins[(bin + k + BINS - WINDOW) % BINS]).sum::<f64>();
    let peak = (0..BINS).filter(|&bin| allowed((bin as f32 + 0.5) * BIN_DEG)).max_by(|&a, &b| window(a).total_cmp(&window(b)));
    let hue = (peak.unwrap_or(0) as f32 + 0.5) * BIN_DEG;
    // the median of what has that hue, then of what is also as saturated
    let mut floor = (MIN_SATURATION, MIN_VALUE);
    let mut found = None;
    for _ in 0..2 {
        let [mut codes, mut saturations] = [[[0_u64; 256]; 3], [[0; 256]; 3]];
        let (mut count, mut all, mut border_count, mut border_all) = (0_u64, 0_u64, 0_u64, 0_u64);
        for (color, border) in samples(pictures) {
            let (h, s, v) = hue_saturation_value(color);
            all += 1;
            border_all += u64::from(border);
            if distance_deg(h, hue) < BIN_DEG * (WINDOW as f32 + 1.5) && s >= floor.0 && v >= floor.1 {
                count += 1;
                border_count += u64::from(border);
                let weight = if border { BORDER_WEIGHT as u64 } else { 1 };
                (0..3).for_each(|c| codes[c][usize::from(color[c])] += weight);
                saturations[0][(s * 255.0) as usize] += weight;
            }
        }
        let share = count as f32 / all.max(1) as f32;
        if count == 0 || share < MIN_SHARE {
            return Err(KeyError::NoScreen { wanted, share });
        }
        let color = [median(&codes[0]), median(&codes[1]), median(&codes[2])];
        let (hue_deg, saturation, value) = hue_saturation_value(color);
        floor = (f32::from(median(&saturations[0])) / 255.0 * 0.7, (value * 0.25).max(MIN_VALUE));
        let kind = match hue_deg {
            90.0..160.0 => ScreenKind::Green,
            195.0..260.0 => ScreenKind::Blue,
            _ => ScreenKind::Other,
        };
        let border_share = border_count as f32 / border_all.max(1) as f32;
        found = Some(Screen { color, kind, hue_deg, saturation, share, border_share });
    }
    found.ok_or(KeyError::NoPictures)
}

fn median(histogram: &[u64; 256]) -> u8 {
    let half = histogram.iter().sum::<u64>() / 2;
    let mut below = 0;
    for (code, count) in (0..=255_u8).zip(histogram) {
        below += count;
        if below > half {
            return code;
        }
    }
    255
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hues_are_as_everywhere() {
        assert_eq!(hue_saturation_value([0, 255, 0]), (120.0, 1.0, 1.0));
        assert_eq!(hue_saturation_value([0, 0, 255]).0, 240.0);
        assert_eq!(hue_saturation_value([255, 0, 1]).0.round(), 360.0);
        assert_eq!(hue_saturation_value([128, 128, 128]), (0.0, 0.0, 128.0 / 255.0));
        assert_eq!((distance_deg(350.0, 10.0), distance_deg(10.0, 350.0), distance_deg(0.0, 180.0)), (20.0, 20.0, 180.0));
    }

    fn half(screen: [u8; 3], actor: [u8; 3]) -> Vec<[u8; 4]> {
        (0..64 * 64)
            .map(|k| {
                let color = if (20..44).contains(&(k % 64)) && k / 64 > 10 { actor } else { screen };
                [color[0], color[1], color[2], 255]
            })
            .collect()
    }

    #[test]
    fn screens_are_told_from_clothes() {
        for (screen, actor, kind) in [
            ([40, 180, 60], [30, 40, 200], ScreenKind::Green),
            ([30, 60, 190], [40, 180, 60], ScreenKind::Blue),
            ([170, 180, 10], [20, 20, 22], ScreenKind::Other),
        ] {
            let pixels = half(screen, actor);
            let picture = Picture::new(64, 64, &pixels).unwrap();
            let found = find(&[picture], ScreenChoice::Find).unwrap();
            assert_eq!((found.color, found.kind), (screen, kind));
            assert!(found.border_share > 0.6 && found.share > 0.5, "{found:?}");
        }
        let grey = half([120; 3], [200, 150, 120]);
        let grey = Picture::new(64, 64, &grey).unwrap();
        assert!(find(&[grey], ScreenChoice::Find).unwrap_err().to_string().contains("no green or blue screen"));
        assert!(find(&[grey], ScreenChoice::Color([100, 101, 102])).unwrap_err().to_string().contains("nearly grey"));
        assert_eq!(find(&[], ScreenChoice::Find), Err(KeyError::NoPictures));
    }
}
