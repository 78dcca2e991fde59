//! Sounds that are made, not recorded: nothing has to be downloaded to hear a site, and every one of them can be made again, to
//! the bit, from its kind and a number.
//!
//! Loops have no seam: whatever runs over their end goes on at their beginning, filters included. They are models of what makes the sound
//! (ringing bodies, bubbles, tymbals, voices), not of any recording.

mod canvas;
mod crafts;
mod creatures;
mod people;
mod weather;

use crate::RATE_HZ;
use crate::clip::Clip;
use canvas::Canvas;
use heliodon_math::random::Pcg32;
use thiserror::Error;

/// Lengths that can be asked for, seconds.
pub const LENGTHS_S: [f64; 2] = [0.1, 300.0];

/// The shortest loop, seconds: shorter ones are heard to repeat.
pub const SHORTEST_LOOP_S: f64 = 2.0;

/// Peak and root mean square that sounds are brought to, whichever is met first.
const PEAK: f64 = 0.7;
const RMS: f64 = 0.1;

/// Silence before a sound that begins at once, seconds: a source rises in its first 64 samples.
const LEAD_S: f64 = 0.002;

macro_rules! kinds {
    ($($kind:ident $name:literal $seconds:literal $channels:literal $looping:literal $what:literal;)*) => {
        /// What can be generated.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum SoundKind {
            $(#[doc = $what] $kind,)*
        }

        impl SoundKind {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$kind,)*];

            /// Its name in files and commands.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self { $(Self::$kind => $name,)* }
            }

            /// What it is, in a line.
            #[must_use]
            pub fn what(self) -> &'static str {
                match self { $(Self::$kind => $what,)* }
            }

            /// How long it is by itself, seconds.
            #[must_use]
            pub fn seconds(self) -> f64 {
                match self { $(Self::$kind => $seconds,)* }
            }

            /// 2 where it is all around, 1 where it has a place.
            #[must_use]
            pub fn channels(self) -> usize {
                match self { $(Self::$kind => $channels,)* }
            }

            /// Whether it goes on for ever.
            #[must_use]
            pub fn is_loop(self) -> bool {
                match self { $(Self::$kind => $looping,)* }
            }
        }
    };
}

kinds! {
    Fire "fire" 20.0 1 true "A fire of wood: a roar, hissing, crackling.";
    Chisel "chisel" 0.7 1 false "A wooden mallet on an iron chisel on marble; chips fall.";
    Wood "wood" 0.5 1 false "A knock on a beam.";
    Pour "pour" 4.0 1 false "Metal poured from a ladle into a mould: it gurgles and hisses.";
    Gold "gold" 0.5 1 false "A small hammer on a sheet of gold that lies on pitch.";
    Wind "wind" 30.0 2 true "Wind in gusts.";
    Cicadas "cicadas" 20.0 2 true "Cicadas in pines, on a hot day.";
    Crickets "crickets" 20.0 2 true "Crickets and tree crickets, at night.";
    Birds "birds" 45.0 2 true "Small birds, here and there.";
    StepsStone "steps-stone" 0.45 1 false "One step of a sandal on stone.";
    StepsEarth "steps-earth" 0.45 1 false "One step of a sandal on earth and grit.";
    Water "water" 15.0 1 true "Water that runs into a basin.";
    Crowd "crowd" 25.0 2 true "A crowd that murmurs, no word of which is one.";
    Chime "chime" 2.5 1 false "Three soft notes: well done.";
    Cloth "cloth" 0.9 1 false "A garment that is moved.";
    Dust "dust" 2.0 1 false "Grit and dust that trickle down.";
}

impl SoundKind {
    /// The kind of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.name() == name)
    }
}

/// What to generate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GenerateParams {
    /// What.
    pub kind: SoundKind,
    /// Which of all of its kind.
    pub seed: u64,
    /// Its length, [`LENGTHS_S`]; of a loop from [`SHORTEST_LOOP_S`] on. A stroke that is cut short falls to silence.
    pub seconds: f64,
    /// 1, or 2: each ear its own, for ambience.
    pub channels: usize,
}

/// A sound that cannot be generated.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum GenerateError {
    /// Its length.
    #[error("a sound of {0} s; give 0.1 to 300 seconds, and 2 or more for one that repeats")]
    Seconds(f64),
    /// Its channels.
    #[error("a sound of {0} channels; give 1 or 2")]
    Channels(usize),
}

impl GenerateParams {
    /// As its kind is by itself.
    #[must_use]
    pub fn new(kind: SoundKind) -> Self {
        Self { kind, seed: 0, seconds: kind.seconds(), channels: kind.channels() }
    }

    /// Whether it can be made.
    ///
    /// # Errors
    ///
    /// What [`GenerateError`] lists.
    pub fn validate(&self) -> Result<(), GenerateError> {
        let least = if self.kind.is_loop() { SHORTEST_LOOP_S } else { LENGTHS_S[0] };
        if !(least..=LENGTHS_S[1]).contains(&self.seconds) {
            return Err(GenerateError::Seconds(self.seconds));
        }
        if !(1..=2).contains(&self.channels) {
            return Err(GenerateError::Channels(self.channels));
        }
        Ok(())
    }
}

fn one(kind: SoundKind, seconds: f64, random: &mut Pcg32) -> Vec<f64> {
    let mut canvas = Canvas::new(seconds, kind.is_loop());
    match kind {
        SoundKind::Fire => weather::fire(&mut canvas, random),
        SoundKind::Wind => weather::wind(&mut canvas, random),
        SoundKind::Water => weather::water(&mut canvas, random),
        SoundKind::Dust => weather::dust(&mut canvas, random),
        SoundKind::Chisel => crafts::chisel(&mut canvas, random),
        SoundKind::Wood => crafts::wood(&mut canvas, random),
        SoundKind::Pour => crafts::pour(&mut canvas, random),
        SoundKind::Gold => crafts::gold(&mut canvas, random),
        SoundKind::Chime => crafts::chime(&mut canvas, random),
        SoundKind::Cicadas => creatures::cicadas(&mut canvas, random),
        SoundKind::Crickets => creatures::crickets(&mut canvas, random),
        SoundKind::Birds => creatures::birds(&mut canvas, random),
        SoundKind::StepsStone => people::step(&mut canvas, random, true),
        SoundKind::StepsEarth => people::step(&mut canvas, random, false),
        SoundKind::Crowd => people::crowd(&mut canvas, random),
        SoundKind::Cloth => people::cloth(&mut canvas, random),
    }
    // nothing below hearing, and no standing pressure
    canvas.filter(canvas::Pass::High, 25.0, 0.7);
    if !kind.is_loop() {
        canvas.fade_out((seconds * 0.2).min(0.2));
    }
    canvas.samples
}

/// Makes a sound: the same samples for the same parameters, on every machine.
///
/// # Errors
///
/// Parameters out of range.
pub fn generate(params: &GenerateParams) -> Result<Clip, GenerateError> {
    params.validate()?;
    let stream = |ear: u64| Pcg32::new(params.seed, (params.kind as u64) * 2 + ear);
    let mut ears: Vec<Vec<f64>> =
        (0..params.channels).map(|ear| one(params.kind, params.seconds, &mut stream(ear as u64))).collect();
    if let [left, right] = &mut ears[..] {
        // what is all around is nearer to one ear or the other, and never in one alone
        for (l, r) in left.iter_mut().zip(right) {
            (*l, *r) = (*l * 0.9 + *r * 0.43, *r * 0.9 + *l * 0.43);
        }
    }
    let all = || ears.iter().flatten();
    let peak = all().fold(0.0, |peak: f64, sample| peak.max(sample.abs())).max(1.0e-9);
    let rms = (all().map(|s| s * s).sum::<f64>() / all().count() as f64).sqrt().max(1.0e-9);
    let scale = (PEAK / peak).min(RMS / rms);
    let samples = (0..ears[0].len()).flat_map(|k| ears.iter().map(move |ear| (ear[k] * scale) as f32)).collect();
    // its samples are finite, and it is as long as was checked above
    Clip::new(samples, params.channels).map_err(|_| GenerateError::Seconds(params.seconds))
}

/// Seconds of a clip at [`RATE_HZ`], for messages.
#[must_use]
pub fn seconds_of(clip: &Clip) -> f64 {
    clip.frames() as f64 / f64::from(RATE_HZ)
}

#[cfg(test)]
mod tests;
