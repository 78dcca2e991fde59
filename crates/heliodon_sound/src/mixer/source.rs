//! A source: what plays, where, how loud, and whether it does.

use super::reader::{Content, Reader};
use crate::head::SPEED_OF_SOUND_M_S;
use crate::kernel::Kernel;
use crate::{RATE_HZ, SLICE};
use glam::Vec3;
use std::f32::consts::PI;

/// How a sound's way through the air takes time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Travel {
    /// As it does: a hammer 34 metres away is heard a tenth of a second after it is seen, and whatever moves changes its
    /// pitch (Doppler; by `1 + v / c`, for its way is taken as it is when it is heard: a seventeenth of a semitone less than
    /// physics' `1 / (1 - v / c)` at 20 metres a second). Ways beyond 460 metres take as long as those.
    #[default]
    Air,
    /// Not at all, but for the difference between the ears: for a film's sound, which would leave its picture. No Doppler.
    Immediate,
}

/// What a source is like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SourceSettings {
    /// Where it is, metres.
    pub place: Vec3,
    /// Its level, 0 to 64; 1 leaves the samples as they are at [`Self::reference_m`].
    pub gain: f32,
    /// The distance at which its level is [`Self::gain`], metres. More: it carries farther.
    pub reference_m: f32,
    /// Nearer than this, metres, it gets no louder: about the size of what sounds.
    pub radius_m: f32,
    /// The exponent of its fall with distance: 1 is what air does (6 dB when it doubles), 0 none at all.
    pub rolloff: f32,
    /// How much of it is hidden behind the monument, 0 to 1.
    pub occlusion: f32,
    /// Whether it begins again at its end. Feeds do not.
    pub looping: bool,
    /// The speed at which it is played, 0.25 to 4; clips only.
    pub rate: f32,
    /// How its way takes time.
    pub travel: Travel,
    /// Whether it sounds from the beginning on, or waits for [`crate::Control::start`].
    pub playing: bool,
    /// Whether it stays when it has come to its end, so that it can be started again; otherwise it is removed.
    pub stays: bool,
}

impl Default for SourceSettings {
    fn default() -> Self {
        Self {
            place: Vec3::ZERO,
            gain: 1.0,
            reference_m: 1.0,
            radius_m: 0.3,
            rolloff: 1.0,
            occlusion: 0.0,
            looping: false,
            rate: 1.0,
            travel: Travel::Air,
            playing: true,
            stays: false,
        }
    }
}

impl SourceSettings {
    /// Its level at the end of a way of so many metres, without what stands in between.
    #[must_use]
    pub fn level(&self, way_m: f32) -> f32 {
        let ratio = self.reference_m / way_m.max(self.radius_m);
        // inverse distance is by far the most common
        if self.rolloff == 1.0 { self.gain * ratio } else { self.gain * libm::powf(ratio, self.rolloff) }
    }
}

/// Samples over which a beginning rises, and over which an end falls.
pub(crate) const RISE: u32 = 64;
pub(crate) const FALL: u32 = 480;

/// What a source does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum State {
    Still,
    Playing,
    /// It falls silent, and then does what it was told.
    Falling(u32, Then),
    /// It has come to its end; what is on its way is still heard.
    Over,
    /// It is to be taken away when nothing of it is on its way any more.
    Gone,
}

/// What follows a fall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Then {
    Stop,
    Seek(f64),
    Remove,
}

/// A source in the mixer's table.
#[derive(Debug)]
pub(crate) struct Source {
    pub(crate) reader: Reader,
    pub(crate) settings: SourceSettings,
    pub(crate) generation: u32,
    pub(crate) state: State,
    /// Samples since it began, up to [`RISE`].
    pub(crate) risen: u32,
    /// Frames since it began or was wound: what is older was never sent.
    pub(crate) played: u64,
    /// The frame of the next slice at which it begins.
    pub(crate) begins_at: usize,
    pub(crate) voice: Option<u16>,
    pub(crate) loudness: f32,
    /// Slices in which what it sent is still on its way.
    pub(crate) tail: u32,
    /// Whether it is among the loudest, as they were last chosen.
    pub(crate) chosen: bool,
}

impl Source {
    pub(crate) fn new(content: Content, settings: SourceSettings, generation: u32) -> Self {
        let loudness = content.loudness();
        Self {
            reader: Reader::new(content, settings.looping, settings.rate),
            settings,
            generation,
            state: State::Still,
            risen: 0,
            played: 0,
            begins_at: 0,
            voice: None,
            loudness,
            tail: 0,
            chosen: false,
        }
    }

    /// Begins, at a frame of the next slice. Returns whether it was silent.
    pub(crate) fn start(&mut self, at: usize) -> bool {
        match self.state {
            State::Still | State::Over => {
                if self.state == State::Over {
                    self.reader.seek(0.0);
                }
                (self.state, self.risen, self.played, self.begins_at) = (State::Playing, 0, 0, at);
                true
            }
            // it was to stop, and goes on from where it is
            State::Falling(_, Then::Stop) => {
                (self.state, self.risen) = (State::Playing, 0);
                false
            }
            _ => false,
        }
    }

    /// Falls silent if it is heard, and then does what is to follow.
    pub(crate) fn fall(&mut self, then: Then) {
        match (self.state, then) {
            (State::Gone | State::Falling(_, Then::Remove), _) | (State::Over, Then::Stop) => {}
            (State::Playing, _) if self.voice.is_some() => self.state = State::Falling(FALL, then),
            (State::Falling(left, _), _) => self.state = State::Falling(left, then),
            _ => self.follow(then),
        }
    }

    pub(crate) fn follow(&mut self, then: Then) {
        match then {
            Then::Stop => self.state = State::Still,
            Then::Remove => self.state = State::Gone,
            Then::Seek(seconds) => {
                self.reader.seek(seconds);
                (self.risen, self.played) = (0, 0);
                match self.state {
                    State::Falling(..) => self.state = State::Playing,
                    State::Over => self.state = State::Still,
                    _ => {}
                }
            }
        }
    }

    /// The next slice of what it sends, mixed to one channel, its beginning and its end softened; `frame` is the one after it.
    pub(crate) fn send(&mut self, kernel: &Kernel, rate: f32, frame: u64, out: &mut [f32; SLICE]) {
        let from = std::mem::take(&mut self.begins_at);
        let mut channels = [[0.0; SLICE]; 2];
        let over = self.reader.slice(kernel, rate, from, frame, &mut channels);
        let stereo = self.reader.content.channels() == 2;
        for (k, sample) in out.iter_mut().enumerate() {
            *sample = if stereo { (channels[0][k] + channels[1][k]) * 0.5 } else { channels[0][k] };
            if k < from {
                *sample = 0.0;
            } else if self.risen < RISE {
                self.risen += 1;
                *sample *= 0.5 - 0.5 * libm::cosf(PI * (self.risen as f32 - 0.5) / RISE as f32);
            }
            if let State::Falling(left, _) = &mut self.state {
                *left = left.saturating_sub(1);
                *sample *= 0.5 - 0.5 * libm::cosf(PI * *left as f32 / FALL as f32);
            }
        }
        self.advanced(from, over);
    }

    /// A slice goes by unheard.
    pub(crate) fn pass(&mut self, frame: u64) {
        let from = std::mem::take(&mut self.begins_at);
        let over = self.reader.pass(from, frame);
        self.risen = RISE;
        if let State::Falling(left, _) = &mut self.state {
            *left = 0;
        }
        self.advanced(from, over);
    }

    fn advanced(&mut self, from: usize, over: bool) {
        self.played += (SLICE - from) as u64;
        match self.state {
            State::Falling(0, then) => self.follow(then),
            State::Playing | State::Falling(_, Then::Stop | Then::Seek(_)) if over => self.state = State::Over,
            State::Falling(_, Then::Remove) if over => self.state = State::Gone,
            _ => {}
        }
    }

    pub(crate) fn is_sounding(&self) -> bool {
        matches!(self.state, State::Playing | State::Falling(..))
    }

    /// Its level at a distance, with what stands in between, as the loudest are chosen by.
    pub(crate) fn score(&self, distance: f32) -> f32 {
        self.settings.level(distance) * (1.0 - 0.7 * self.settings.occlusion) * self.loudness
    }

    /// Slices that its sound is on its way to a listener at a distance, and then some for filters to fall silent.
    pub(crate) fn way_slices(&self, distance: f32) -> u32 {
        let way = if self.settings.travel == Travel::Air { distance.min(470.0) / SPEED_OF_SOUND_M_S } else { 0.0 };
        ((way + 0.06) * RATE_HZ as f32 / SLICE as f32) as u32
    }
}
