//! What a key tells.

use super::Part;
use super::outputs::Files;
use crate::output::{count, counted, duration};
use heliodon_capture::key::{Keyed, Keyer, Mixing, ScreenKind};
use heliodon_film::Film;
use serde::Serialize;

/// Pixels of all frames.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    pub frames: u64,
    pixels: u64,
    transparent: u64,
    partial: u64,
}

impl Counts {
    /// Counts one frame's.
    pub fn add(&mut self, keyed: &Keyed) {
        self.frames += 1;
        self.pixels += keyed.mask.len() as u64;
        self.transparent += keyed.mask.iter().filter(|&&mask| mask == 255).count() as u64;
        self.partial += keyed.mask.iter().filter(|&&mask| mask != 0 && mask != 255).count() as u64;
    }
}

/// Frames a second: of all the work, and of the solver alone.
#[derive(Clone, Copy, Debug)]
pub struct Speed {
    pub frames_per_s: f64,
    pub solver_frames_per_s: f64,
}

#[derive(Serialize)]
pub struct KeyReport {
    film: FilmReport,
    /// Of a film that was keyed; null of one that carries alpha.
    screen: Option<ScreenReport>,
    frames: u64,
    /// Of the films written: even.
    width: u32,
    height: u32,
    /// Transparent columns and rows that were added for that.
    padded: [u32; 2],
    /// Shares of all pixels, in [0, 1].
    transparent: f64,
    partial: f64,
    /// Share of pixels along the upper, left and right border that are not transparent; null of a film with alpha.
    border_covered: Option<f64>,
    border_clean: Option<bool>,
    files: Files,
    frames_per_s: f64,
    solver_frames_per_s: f64,
    pub warnings: Vec<String>,
}

#[derive(Serialize)]
struct FilmReport {
    file: String,
    codec: String,
    width: u32,
    height: u32,
    frames_per_s: f64,
    seconds: Option<f64>,
    alpha: bool,
    sound: bool,
}

#[derive(Serialize)]
struct ScreenReport {
    color: String,
    kind: &'static str,
    hue_deg: f32,
    /// Share of the pictures that looks like it, and of their border.
    share: f32,
    border_share: f32,
    /// Standard deviation of its own alpha.
    noise: f32,
    /// How much darker its darkest part is.
    unevenness: f32,
    /// What was added up where it shares a pixel with the actor.
    mixed: &'static str,
}

/// A border with more on it is not clean.
const CLEAN: f64 = 0.01;
/// Screens look like themselves on so much of the border.
const LIKELY_BORDER: f32 = 0.4;
/// Noise above which soft edges suffer.
const NOISY: f32 = 0.06;
/// A sequence that misses more frames than this, by its header, was cut off.
const MISSING: u64 = 3;

impl KeyReport {
    /// All that was found.
    pub fn new(
        film: &Film,
        part: &Part,
        keyer: Option<&Keyer>,
        counts: &Counts,
        files: Files,
        complaint: Option<&str>,
        speed: Speed,
    ) -> Self {
        let share = |pixels: u64| pixels as f64 / counts.pixels.max(1) as f64;
        let border = keyer.map(|keyer| keyer.tally().border_covered as f64 / keyer.tally().border.max(1) as f64);
        let (width, height) = (film.width.next_multiple_of(2), film.height.next_multiple_of(2));
        let screen = keyer.map(|keyer| {
            let screen = keyer.screen();
            let [r, g, b] = screen.color;
            ScreenReport {
                color: format!("#{r:02x}{g:02x}{b:02x}"),
                kind: screen.kind.name(),
                hue_deg: screen.hue_deg,
                share: screen.share,
                border_share: screen.border_share,
                noise: keyer.noise(),
                unevenness: keyer.unevenness(),
                mixed: if keyer.mixing() == Mixing::Linear { "light" } else { "codes" },
            }
        });
        let mut report = Self {
            film: FilmReport {
                file: film.path.display().to_string(),
                codec: film.codec.clone(),
                width: film.width,
                height: film.height,
                frames_per_s: film.rate.per_second(),
                seconds: film.duration_s,
                alpha: film.alpha,
                sound: film.sound.is_some(),
            },
            screen,
            frames: counts.frames,
            width,
            height,
            padded: [width - film.width, height - film.height],
            transparent: share(counts.transparent),
            partial: share(counts.partial),
            border_covered: border,
            border_clean: border.map(|border| border <= CLEAN),
            files,
            frames_per_s: speed.frames_per_s,
            solver_frames_per_s: speed.solver_frames_per_s,
            warnings: Vec::new(),
        };
        report.warn(film, part, keyer, complaint);
        report
    }

    fn warn(&mut self, film: &Film, part: &Part, keyer: Option<&Keyer>, complaint: Option<&str>) {
        let name = film.path.display();
        let mut told = Vec::new();
        if let Some(expected) = part.expected.filter(|expected| self.frames + MISSING < *expected) {
            told.push(format!(
                "{name}: ends after {} of {} frames; it was cut off, so copy or export it again",
                count(self.frames),
                count(expected)
            ));
        } else if let Some(said) = complaint {
            told.push(format!("{name}: the decoder found damage in it ({said}); what it made of that was keyed"));
        }
        if !film.rate_known {
            told.push(format!("{name}: its header has no frame rate; {:.3} a second were taken", film.rate.per_second()));
        } else if film.rate_varies {
            told.push(format!(
                "{name}: its frames do not come at a constant rate; {:.3} a second were made of them, some twice or not at all",
                film.rate.per_second()
            ));
        }
        if let Some(keyer) = keyer {
            let (screen, tally) = (keyer.screen(), keyer.tally());
            if screen.border_share < LIKELY_BORDER {
                told.push(format!(
                    "this does not look like a screen: only {:.0} % of the picture's border has its colour; look at --sheet, give its colour with --screen, or cut with --keep",
                    screen.border_share * 100.0
                ));
            }
            if screen.kind == ScreenKind::Other {
                told.push(format!(
                    "the screen is neither green nor blue (hue {:.0} degrees): what is near its hue becomes transparent; look at --sheet",
                    screen.hue_deg
                ));
            }
            if keyer.noise() > NOISY {
                told.push(format!(
                    "the screen is noisy ({:.1} % of alpha): edges are less sure; film with more light, or try --preset rough",
                    keyer.noise() * 100.0
                ));
            }
            if tally.without_screen * 20 > tally.frames {
                told.push(format!("in {} hardly any screen is to be seen", counted(tally.without_screen, "frame", "frames")));
            }
            if self.border_clean == Some(false) {
                told.push(format!(
                    "the border is not clean: {:.1} % of it is covered, on the left, right or at the top; cut with --keep, or --largest",
                    self.border_covered.unwrap_or(0.0) * 100.0
                ));
            }
        }
        if self.transparent < 0.001 {
            told.push("nothing is transparent: the whole picture would cover the scene".to_owned());
        } else if self.transparent > 0.999 {
            told.push("everything is transparent: nobody would be seen".to_owned());
        }
        self.warnings = told;
    }
}

/// For people.
pub fn describe(report: &KeyReport) -> String {
    let KeyReport { film, frames, transparent, partial, .. } = report;
    let sound = if film.sound { "with sound" } else { "silent" };
    let mut text = format!(
        "{}: {} {}x{}, {:.3} frames a second, {sound}\n",
        film.file, film.codec, film.width, film.height, film.frames_per_s
    );
    match &report.screen {
        Some(screen) => {
            text += &format!(
                "screen: {} ({}), on {:.0} % of the pictures and {:.0} % of their border; noise {:.1} %, {:.0} % darker at its darkest; edges mixed as {}\n",
                screen.color,
                screen.kind,
                screen.share * 100.0,
                screen.border_share * 100.0,
                screen.noise * 100.0,
                screen.unevenness * 100.0,
                screen.mixed
            );
        }
        None => text += "it carries alpha, which was taken as it is\n",
    }
    let shares = format!("{:.1} % transparent, {:.1} % partly", transparent * 100.0, partial * 100.0);
    let border = match report.border_clean {
        Some(true) => ", the border is clean",
        Some(false) => ", the border is not clean",
        None => "",
    };
    let seconds = *frames as f64 / film.frames_per_s;
    text += &format!(
        "{} ({}): {shares}{border}; {:.1} frames a second, {:.1} of them solved alone\n",
        counted(*frames, "frame", "frames"),
        duration(seconds),
        report.frames_per_s,
        report.solver_frames_per_s
    );
    if report.padded != [0, 0] {
        let [columns, rows] = report.padded;
        let added = [(columns, "a column at the right"), (rows, "a row below")];
        let added: Vec<&str> = added.iter().filter(|(count, _)| *count > 0).map(|(_, what)| *what).collect();
        text += &format!(
            "H.264 needs even sides: {} was added, transparent, {}x{}\n",
            added.join(" and "),
            report.width,
            report.height
        );
    }
    text += &format!("Written to {} and {}", report.files.image.display(), report.files.mask.display());
    for file in report.files.webm.iter().chain(&report.files.sheet) {
        text += &format!(", {}", file.display());
    }
    text + ".\n"
}
