//! Reading and making the bundle's sounds, on a thread of its own.

use heliodon_bundle::BundleReader;
use heliodon_bundle::site::SoundSource;
use heliodon_sound::Clip;
use heliodon_sound::file::read_clip;
use heliodon_sound::generate::{GenerateParams, SoundKind, generate};
use std::sync::Arc;

/// The bundle's sounds.
#[derive(Default)]
pub struct Loaded {
    /// Those that are there.
    pub sounds: Vec<(SoundSource, Arc<Clip>)>,
    /// What is not, and why.
    pub failures: Vec<String>,
}

/// Reads them all; what fails is told, and the others are there.
pub fn run(bundle: &BundleReader) -> Loaded {
    let mut loaded = Loaded::default();
    for sound in &bundle.living().sounds {
        let clip = match &sound.file {
            Some(file) => {
                read_clip(&bundle.folder().join(file)).map(|(clip, _)| Arc::new(clip)).map_err(|error| error.to_string())
            }
            None => made(sound),
        };
        match clip {
            Ok(clip) => loaded.sounds.push((sound.clone(), clip)),
            Err(why) => loaded.failures.push(format!("the sound {} is missing: {why}", sound.name)),
        }
    }
    loaded
}

/// A sound that is made.
pub fn made(sound: &SoundSource) -> Result<Arc<Clip>, String> {
    let name = sound.kind.as_deref().unwrap_or_default();
    let kind = SoundKind::named(name).ok_or_else(|| {
        let known: Vec<&str> = SoundKind::ALL.iter().map(|kind| kind.name()).collect();
        format!("there is no kind `{name}`; there are: {}", known.join(", "))
    })?;
    let mut params = GenerateParams { seed: sound.seed, ..GenerateParams::new(kind) };
    if sound.place.is_some() {
        // what has a place is one sound for both ears
        params.channels = 1;
    }
    generate(&params).map(Arc::new).map_err(|error| error.to_string())
}
