//! Looking into films before they are played, on a thread of its own.

use super::made;
use super::surface::Surface;
use heliodon_bundle::BundleReader;
use heliodon_bundle::site::{Film as FilmSettings, FilmKind};
use heliodon_film::{Film, FilmError, Player, PlayerParams, ReadParams, Source};
use std::path::Path;
use std::sync::Arc;

/// The longest side that is put onto a texture, pixels: 33 MB with its double, and more than a screen shows of somebody.
const MOST_SIDE: u32 = 2048;
/// By how much, as a part, a mask may be longer or shorter than its image before it is told.
const APART: f64 = 0.02;

/// A film that can be played.
#[derive(Clone, Debug)]
pub struct Opened {
    /// What the site says of it.
    pub settings: FilmSettings,
    /// Its files; none where it is made.
    pub source: Option<Source>,
    /// Columns and rows that are shown.
    pub size: (u32, u32),
    /// What its pixels are.
    pub pixels: Pixels,
    /// The part that shows it.
    pub surface: Option<Arc<Surface>>,
}

/// What a film's pixels are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pixels {
    /// Without transparency.
    Opaque,
    /// Colours that are to be multiplied by their alpha.
    Straight,
    /// Colours that are, in linear light: of a pair.
    Premultiplied,
}

impl Opened {
    /// Looks into a film's files; what is odd about them is told.
    ///
    /// # Errors
    /// Where there is nothing to be played.
    pub fn look(folder: &Path, settings: FilmSettings, told: &mut Vec<String>) -> Result<Self, FilmError> {
        let Some(file) = &settings.file else {
            let pixels = if settings.kind == Some(FilmKind::Water) { Pixels::Straight } else { Pixels::Opaque };
            return Ok(Self { settings, source: None, size: (made::SIDE, made::SIDE), pixels, surface: None });
        };
        let image = Film::probe(folder.join(file))?;
        let name = &settings.name;
        let mut size = (image.width, image.height);
        let longest = size.0.max(size.1);
        if longest > MOST_SIDE {
            let scaled = |side: u32| (u64::from(side) * u64::from(MOST_SIDE) / u64::from(longest)).max(1) as u32;
            size = (scaled(size.0), scaled(size.1));
            told.push(format!(
                "the film {name} has {} x {} pixels; it is shown with {} x {}: scale it down",
                image.width, image.height, size.0, size.1
            ));
        }
        if image.rate_varies {
            told.push(format!(
                "the film {name} has no constant rate; it is shown at {:.3} frames a second",
                image.rate.per_second()
            ));
        }
        let (source, pixels) = match &settings.mask {
            None => (Source::Film(image.clone()), if image.alpha { Pixels::Straight } else { Pixels::Opaque }),
            Some(mask) => {
                let mask = Film::probe(folder.join(mask))?;
                told.extend(doubts(name, &image, &mask));
                (Source::Pair { image, mask }, Pixels::Premultiplied)
            }
        };
        Ok(Self { settings, source: Some(source), size, pixels, surface: None })
    }

    /// Seconds that its header tells.
    #[must_use]
    pub fn told_s(&self) -> Option<f64> {
        let film = self.source.as_ref()?.film();
        film.frames().map(|frames| film.rate.time_of(frames))
    }

    /// Begins to decode; there is nothing to decode where it is made.
    ///
    /// # Errors
    /// Without `ffmpeg`.
    pub fn play(&self) -> Result<Option<Player>, FilmError> {
        let Some(source) = self.source.clone() else { return Ok(None) };
        let params = if self.settings.repeat { PlayerParams::playing() } else { PlayerParams::once() };
        let read = ReadParams { size: Some(self.size), ..params.read };
        Player::start(source, &PlayerParams { read, ..params }).map(Some)
    }
}

/// What does not fit between an image and its mask.
fn doubts(name: &str, image: &Film, mask: &Film) -> Vec<String> {
    let mut told = Vec::new();
    if (image.width, image.height) != (mask.width, mask.height) {
        told.push(format!(
            "the film {name} has {} x {} pixels and its mask {} x {}: the mask is stretched; key it again",
            image.width, image.height, mask.width, mask.height
        ));
    }
    if let (Some(own), Some(other)) = (image.duration_s, mask.duration_s)
        && (own - other).abs() > APART * own
    {
        told.push(format!(
            "the film {name} has {own:.2} s and its mask {other:.2} s: it ends with the shorter one; key it again"
        ));
    }
    told
}

/// The bundle's films.
#[derive(Default)]
pub struct Loaded {
    /// Those that can be played.
    pub films: Vec<Opened>,
    /// Names of those that cannot.
    pub missing: Vec<String>,
    /// What is odd or missing, and why.
    pub told: Vec<String>,
}

impl Loaded {
    /// Takes one more; the part that shows it is one of the bundle's.
    pub fn take(&mut self, folder: &Path, settings: &FilmSettings, bundle: Option<&BundleReader>) {
        // what is made has no texture of its own that says where it lies
        let tile_m = settings.kind.map(|_| settings.height_m as f32);
        let surface = |part: &str| match bundle {
            Some(bundle) => Surface::read(bundle, part, tile_m),
            None => Err("there is no bundle with parts".to_owned()),
        };
        let opened = Opened::look(folder, settings.clone(), &mut self.told).map_err(|error| error.to_string());
        let opened = opened.and_then(|opened| match &settings.surface {
            None => Ok(opened),
            Some(part) => Ok(Opened { surface: Some(Arc::new(surface(part)?)), ..opened }),
        });
        match opened {
            Ok(opened) => self.films.push(opened),
            Err(why) => {
                self.told.push(format!("the film {} is not shown: {why}", settings.name));
                self.missing.push(settings.name.clone());
            }
        }
    }
}

/// Looks into them all; what fails is told, and the others are there.
pub fn run(bundle: &BundleReader) -> Loaded {
    let mut loaded = Loaded::default();
    for film in &bundle.living().films {
        loaded.take(bundle.folder(), film, Some(bundle));
    }
    loaded
}
