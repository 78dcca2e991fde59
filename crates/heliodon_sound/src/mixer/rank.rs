//! Which sources are rendered: the loudest, as many as there are voices.

use super::Mixer;
use super::source::RISE;
use super::voice::{Hall, audible};
use crate::head::Head;
use std::sync::atomic::Ordering;

/// Slices between two choices: 11 ms.
const EVERY: u64 = 8;

/// What is rendered is given this much before what is not, so that two of one level do not change places all the time: 3.5 dB.
const KEPT: f32 = 1.5;

/// Softer than this at the ear nobody hears it: -110 dB of full scale.
const INAUDIBLE: f32 = 3.0e-6;

/// Sources that may be woken in one slice: what they sent before has to be worked out.
const WOKEN: usize = 2;

/// The list that is chosen from, kept so that nothing is allocated.
#[derive(Debug)]
pub(super) struct Ranking {
    scores: Vec<(f32, u32)>,
    /// Whether something began, or could not be woken yet.
    pub(super) again: bool,
}

impl Ranking {
    pub(super) fn new(sources: usize) -> Self {
        Self { scores: Vec::with_capacity(sources), again: false }
    }
}

impl Mixer {
    /// Gives and takes voices, where it is time to.
    pub(super) fn choose(&mut self) {
        let slices = self.frame / crate::SLICE as u64;
        if !self.ranking.again && !slices.is_multiple_of(EVERY) {
            return;
        }
        self.ranking.again = false;
        let head: Head = self.head;
        let scores = &mut self.ranking.scores;
        scores.clear();
        for slot in &self.alive {
            let Some(source) = &mut self.sources[*slot as usize] else { continue };
            source.chosen = false;
            if !source.is_sounding() {
                continue;
            }
            let kept = if source.voice.is_some() { KEPT } else { 1.0 };
            let score = source.score(audible(source.settings.place, &head)) * kept;
            if score > INAUDIBLE {
                scores.push((score, *slot));
            }
        }
        let voices = self.settings.voices;
        let louder = |a: &(f32, u32), b: &(f32, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        if scores.len() > voices {
            scores.select_nth_unstable_by(voices, louder);
            scores.truncate(voices);
        }
        scores.sort_unstable_by(louder);
        for (_, slot) in scores.iter() {
            if let Some(source) = &mut self.sources[*slot as usize] {
                source.chosen = true;
            }
        }
        for voice in &mut self.voices {
            let source = voice.source.and_then(|slot| self.sources[slot as usize].as_ref());
            // what has been sent and is on its way keeps its voice
            voice.leaves = source.is_some_and(|source| !source.chosen && source.is_sounding());
        }
        self.give();
        let given = self.voices.iter().filter(|voice| voice.source.is_some()).count();
        self.figures.voices.store(given as u32, Ordering::Relaxed);
    }

    fn give(&mut self) {
        let room = self.rooms.as_ref().and_then(|set| set.room_of(self.head.position));
        let rooms = self.rooms.as_deref();
        let hall = Hall {
            kernel: &self.kernel,
            head: self.head,
            pole: self.pole,
            rate: self.rates[0],
            rooms,
            room,
            changing: self.incoming.is_some(),
        };
        self.reflects.fill(false);
        let (mut woken, mut free) = (0, 0);
        for (rank, (_, slot)) in self.ranking.scores.iter().enumerate() {
            let Some(source) = &mut self.sources[*slot as usize] else { continue };
            let index = match source.voice {
                Some(voice) => usize::from(voice),
                None => {
                    while free < self.voices.len() && self.voices[free].source.is_some() {
                        free += 1;
                    }
                    let softly = source.played > 0;
                    if free == self.voices.len() || softly && woken == WOKEN {
                        self.ranking.again |= free < self.voices.len();
                        continue;
                    }
                    let voice = &mut self.voices[free];
                    voice.give(*slot, &source.settings, &hall, softly);
                    if softly {
                        woken += 1;
                        source.risen = RISE;
                        let ago = (voice.reach() as u64).min(source.played) as usize;
                        for ago in (1..=ago).rev() {
                            voice.ring.write(&[source.reader.before(&self.kernel, ago)]);
                        }
                    }
                    source.voice = Some(free as u16);
                    free
                }
            };
            self.reflects[index] = rank < self.settings.reflected;
        }
    }
}
