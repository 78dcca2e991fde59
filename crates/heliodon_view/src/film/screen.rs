//! A film on the stage: whether it plays, which second it is at, and what it shows.

use super::clock::FilmClock;
use super::lead::Leader;
use super::load::Opened;
use super::made::{RATE_PER_S, picture};
use super::voice::Voice;
use crate::sound::Sounds;
use bevy::math::Vec3;
use heliodon_bundle::site::Way;
use heliodon_film::{Frame, Player};
use heliodon_sound::SourceId;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long a picture is waited for where it has to be there.
const PATIENCE: Duration = Duration::from_secs(20);
/// Above what stands on the ground sound comes from, as a part of its height: a mouth.
const MOUTH: f32 = 0.88;

/// A film on the stage.
#[derive(Debug)]
pub struct Screen {
    /// What is played.
    pub opened: Opened,
    player: Option<Player>,
    clock: FilmClock,
    playing: Option<Playing>,
    leader: Option<Leader>,
    shown: Option<Arc<Frame>>,
    /// The film's length, once it is known, seconds.
    length_s: Option<f64>,
    broken: bool,
    /// Pictures that were shown, each once; and missed by players that are gone.
    shown_frames: u64,
    missed_before: u64,
}

/// A film that plays.
#[derive(Debug)]
struct Playing {
    /// Whether a script hears of its end.
    asked: bool,
    sound: Sound,
}

/// How far its sound is.
#[derive(Debug)]
enum Sound {
    /// Begins with the first picture.
    Waits,
    /// Heard, and whether it is paused.
    Heard { voice: Voice, source: SourceId, paused: bool },
    /// There is none.
    None,
}

/// How a frame treats films.
#[derive(Clone, Copy, Debug)]
pub struct Passing {
    /// How much time passes, seconds.
    pub seconds: f64,
    /// Whether the hour stands still.
    pub hour_stands: bool,
    /// Whether pictures have to be those of their time, however long that takes.
    pub waits: bool,
    /// Where films are in their time, for pictures that depend on nothing before them.
    pub at_s: Option<f64>,
    /// Whether anybody looks.
    pub seen: bool,
    /// The visitor's eyes.
    pub visitor: Option<Vec3>,
}

/// What comes of it.
#[derive(Debug, Default)]
pub struct Outcome {
    /// A script hears of its end.
    pub ended: bool,
    /// What went wrong, once.
    pub problem: Option<String>,
}

impl Screen {
    /// A film that is ready to play, or plays from the beginning; `prepared` ones decode their first pictures already.
    #[must_use]
    pub fn new(opened: Opened, paths: &[Way], prepared: bool) -> (Self, Option<String>) {
        let path = opened.settings.leads.as_ref().and_then(|name| paths.iter().find(|way| way.name == *name));
        let points = path.map(|way| way.points.iter().map(|point| Vec3::from(point.map(|v| v as f32))).collect());
        let mut screen = Self {
            player: None,
            clock: FilmClock::default(),
            playing: None,
            leader: points.map(Leader::new),
            shown: None,
            length_s: None,
            broken: false,
            shown_frames: 0,
            missed_before: 0,
            opened,
        };
        let mut problem = None;
        if screen.opened.settings.plays {
            screen.begin(false);
        }
        if prepared || screen.playing.is_some() {
            problem = screen.prepare();
        }
        (screen, problem)
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.opened.settings.name
    }

    /// Starts from its beginning, also where it plays.
    pub fn begin(&mut self, asked: bool) {
        self.clock = FilmClock::at(0.0);
        self.shown = None;
        self.playing = Some(Playing { asked, sound: Sound::Waits });
    }

    /// Takes it away, and winds it back.
    pub fn stop(&mut self, sounds: Option<&mut Sounds>) {
        self.hush(sounds);
        self.playing = None;
        self.shown = None;
        if let Some(player) = &self.player {
            // the beginning is there when it is wanted next
            let _ = player.frame_at(0.0);
        }
    }

    /// Whether it plays.
    #[must_use]
    pub fn is_playing(&self) -> bool {
        self.playing.is_some()
    }

    /// The second of it that is shown.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.clock.seconds()
    }

    /// Seconds of its sound that wait to be heard; none while nothing is, and none of what has all been decoded.
    #[cfg(test)]
    pub fn waiting_s(&self) -> Option<f64> {
        match &self.playing.as_ref()?.sound {
            Sound::Heard { voice, .. } => Some(voice.waiting_s()),
            _ => None,
        }
    }

    /// What is to be seen of it.
    #[must_use]
    pub fn picture(&self) -> Option<&Arc<Frame>> {
        self.shown.as_ref().filter(|_| self.playing.is_some() && !self.broken)
    }

    /// Pictures that were shown, and that were not there in time.
    #[must_use]
    pub fn counted(&self) -> (u64, u64) {
        (self.shown_frames, self.missed_before + self.player.as_ref().map_or(0, Player::missed))
    }

    /// Where the middle of its lower edge is.
    #[must_use]
    pub fn place(&self) -> Vec3 {
        let own = Vec3::from(self.opened.settings.place.map(|v| v as f32));
        self.leader.as_ref().map_or(own, Leader::place)
    }

    /// Where its sound comes from.
    #[must_use]
    pub fn mouth(&self) -> Vec3 {
        let up = if self.opened.surface.is_some() { 0.0 } else { MOUTH * self.opened.settings.height_m as f32 };
        self.place() + Vec3::Y * up
    }

    /// Time passes.
    pub fn pass(&mut self, passing: &Passing, mut sounds: Option<&mut Sounds>) -> Outcome {
        let mut outcome = Outcome::default();
        let Some(playing) = &mut self.playing else { return outcome };
        if self.broken {
            // who waits for its end waits no longer
            outcome.ended = playing.asked;
            self.playing = None;
            return outcome;
        }
        if let (Some(leader), Some(visitor)) = (&mut self.leader, passing.visitor) {
            leader.pass(passing.seconds as f32, visitor);
        }
        let paused = self.opened.settings.with_clock && passing.hour_stands && passing.at_s.is_none();
        self.tick(passing, paused, sounds.as_deref_mut());
        if passing.seen {
            outcome.problem = self.look(passing.waits);
        }
        if outcome.problem.is_some() {
            self.broken = true;
            self.hush(sounds.as_deref_mut());
            return outcome;
        }
        self.join(passing, sounds.as_deref_mut());
        if self.is_over(passing) {
            if passing.at_s.is_some() {
                // another picture may be of another time
                self.shown = None;
            } else {
                outcome.ended = self.playing.as_ref().is_some_and(|playing| playing.asked);
                self.stop(sounds);
            }
        }
        outcome
    }

    /// The clock goes on.
    fn tick(&mut self, passing: &Passing, paused: bool, sounds: Option<&mut Sounds>) {
        if let Some(at_s) = passing.at_s {
            self.clock = FilmClock::at(at_s.max(0.0));
            return;
        }
        let Some(playing) = &mut self.playing else { return };
        let mut heard_s = None;
        if let (Sound::Heard { voice, source, paused: was }, Some(sounds)) = (&mut playing.sound, sounds) {
            voice.set_pass_s(self.length_s.or_else(|| self.opened.told_s()));
            if paused != *was {
                *was = paused;
                sounds.pause_feed(*source, paused);
            }
            heard_s = sounds.clock().and_then(|clock| voice.heard_s(&clock, Instant::now()));
        }
        // a film begins when its first picture is there
        let begun = self.shown.is_some() || !passing.seen;
        if begun && !paused {
            self.clock.pass(passing.seconds, heard_s);
        }
    }

    /// Takes the picture of its time; what went wrong, if anything did.
    fn look(&mut self, waits: bool) -> Option<String> {
        let problem = self.prepare();
        if problem.is_some() {
            return problem;
        }
        if let Some(kind) = self.opened.settings.kind {
            let number = (self.clock.seconds() * RATE_PER_S) as u64;
            if self.shown.as_ref().is_none_or(|shown| shown.number != number) {
                self.shown_frames += 1;
                self.shown = Some(Arc::new(picture(kind, number)));
            }
            return None;
        }
        let player = self.player.as_ref()?;
        let begun = Instant::now();
        let shown = loop {
            let shown = player.frame_at(self.clock.seconds());
            let there = shown.as_ref().is_some_and(|shown| shown.frame.number == shown.wanted);
            if there || !waits || player.problem().is_some() || begun.elapsed() > PATIENCE {
                break shown;
            }
            std::thread::sleep(Duration::from_millis(1));
        };
        let rate = player.rate();
        self.length_s = player.length().map(|frames| rate.time_of(frames)).or(self.length_s);
        if let Some(problem) = player.problem() {
            return Some(problem.to_string());
        }
        if let Some(shown) = shown {
            let another = self.shown.as_ref().is_none_or(|before| !Arc::ptr_eq(before, &shown.frame));
            // a picture of before it was wound back is none of the beginning
            if another && (self.shown.is_some() || shown.frame.number <= shown.wanted) {
                self.shown_frames += 1;
                self.shown = Some(shown.frame);
            }
        }
        None
    }

    /// Starts its decoder, where none is.
    fn prepare(&mut self) -> Option<String> {
        if self.player.is_some() || self.broken {
            return None;
        }
        match self.opened.play() {
            Ok(player) => self.player = player,
            Err(error) => {
                self.broken = true;
                return Some(error.to_string());
            }
        }
        None
    }

    /// Lets its sound begin with its first picture.
    fn join(&mut self, passing: &Passing, sounds: Option<&mut Sounds>) {
        let (mouth, settings) = (self.mouth(), &self.opened.settings);
        let Some(playing) = &mut self.playing else { return };
        match (&mut playing.sound, sounds) {
            (Sound::Heard { source, .. }, Some(sounds)) => {
                if self.clock.lost_sound() {
                    sounds.leave(*source);
                    playing.sound = Sound::None;
                } else if self.leader.is_some() {
                    sounds.move_feed(*source, mouth);
                }
            }
            (Sound::Waits, Some(sounds)) if self.shown.is_some() && !passing.waits && settings.volume > 0.0 => {
                if sounds.is_loading() {
                    return;
                }
                let length_s = self.length_s.or_else(|| self.opened.told_s());
                let source = self.opened.source.as_ref();
                playing.sound = match source.and_then(|source| Voice::begin(source.film(), settings.repeat, length_s)) {
                    Some((voice, reader)) => match sounds.join(reader, mouth, settings.volume as f32) {
                        Some(source) => Sound::Heard { voice, source, paused: false },
                        None => Sound::None,
                    },
                    None => Sound::None,
                };
            }
            _ => {}
        }
    }

    fn hush(&mut self, sounds: Option<&mut Sounds>) {
        if let Some(Playing { sound: sound @ Sound::Heard { .. }, .. }) = &mut self.playing
            && let Sound::Heard { source, .. } = std::mem::replace(sound, Sound::None)
            && let Some(sounds) = sounds
        {
            sounds.leave(source);
        }
    }

    /// Whether what does not repeat has come to its end.
    fn is_over(&self, passing: &Passing) -> bool {
        if self.opened.settings.repeat {
            return false;
        }
        let seen_s = self.player.as_ref().and_then(Player::end_s);
        let end_s = seen_s.or_else(|| self.opened.told_s().filter(|_| !passing.seen));
        end_s.is_some_and(|end_s| self.clock.seconds() >= end_s)
    }
}
