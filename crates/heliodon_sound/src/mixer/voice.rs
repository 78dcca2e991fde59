//! A voice: a source as both ears hear it.

use super::rooms::{MAX_ROOMS, RoomSet};
use super::source::{SourceSettings, Travel};
use crate::filter::{AIR_DB_PER_M, OCCLUDED_DB, OCCLUDED_TREBLE_DB};
use crate::filter::{Dull, Glide, Line, Shadow, ShadowPole, dull_coefficient, gain_from_db};
use crate::head::{Head, SPEED_OF_SOUND_M_S};
use crate::kernel::{AHEAD, Kernel, RING, Ring, TAPS};
use crate::{RATE_HZ, SLICE};
use glam::Vec3;

/// The longest delay, samples: what a ring holds, less a slice and the kernel.
const LONGEST: f32 = (RING - 2 * SLICE - 2 * TAPS) as f32;

/// A way that changes by more than this at once has not been walked: 1.5 metres, samples. It is faded over instead of wound to.
const JUMP: f32 = 1.5 / SPEED_OF_SOUND_M_S * RATE_HZ as f32;

/// Slices that such a fade takes, and one from or to silence when a voice is given or taken: 21 ms.
const FADE_SLICES: f32 = 16.0;

/// What is common to all voices of a slice.
#[derive(Debug)]
pub(crate) struct Hall<'a> {
    pub(crate) kernel: &'a Kernel,
    pub(crate) head: Head,
    pub(crate) pole: ShadowPole,
    /// Of [`Glide`]s.
    pub(crate) rate: f32,
    pub(crate) rooms: Option<&'a RoomSet>,
    /// The listener's room.
    pub(crate) room: Option<usize>,
    /// Whether these rooms give way to others: nothing more is sent to them.
    pub(crate) changing: bool,
}

/// What one ear is to hear.
#[derive(Clone, Copy, Debug)]
struct EarTarget {
    delay: f32,
    gain: f32,
    alpha: f32,
    dull: f32,
}

/// What one ear hears.
#[derive(Clone, Copy, Debug, Default)]
struct Ear {
    delay: Glide,
    gain: Glide,
    alpha: Glide,
    dull: Glide,
    air: Dull,
    shadow: Shadow,
}

impl Ear {
    fn at(target: &EarTarget) -> Self {
        Self {
            delay: Glide::at(target.delay),
            gain: Glide::at(target.gain),
            alpha: Glide::at(target.alpha),
            dull: Glide::at(target.dull),
            ..Self::default()
        }
    }

    fn target(&self) -> EarTarget {
        let [delay, gain, alpha, dull] = [self.delay, self.gain, self.alpha, self.dull].map(|glide| glide.value());
        EarTarget { delay, gain, alpha, dull }
    }
}

/// One mirror image of the source in a room's wall, for both ears: its delays and its level.
#[derive(Clone, Copy, Debug, Default)]
struct Image {
    delay: [Glide; 2],
    gain: Glide,
    air: [Dull; 2],
}

/// A source's way to both ears.
#[derive(Debug)]
pub(crate) struct Voice {
    /// The source's slot; none: free.
    pub(crate) source: Option<u32>,
    /// Whether its source is no longer among the loudest: it fades, and is free then.
    pub(crate) leaves: bool,
    pub(crate) ring: Ring,
    now: [Ear; 2],
    /// Where it was before it jumped, while that fades.
    before: [Ear; 2],
    /// From 0 (just jumped) to 1.
    arrived: f32,
    /// From 0 to 1: given and taken voices fade.
    level: f32,
    images: [Image; 6],
    /// The room whose walls the images are of.
    mirrored: Option<usize>,
    sends: [Glide; MAX_ROOMS],
}

impl Voice {
    pub(crate) fn new() -> Self {
        Self {
            source: None,
            leaves: false,
            ring: Ring::new(),
            now: [Ear::default(); 2],
            before: [Ear::default(); 2],
            arrived: 1.0,
            level: 0.0,
            images: [Image::default(); 6],
            mirrored: None,
            sends: [Glide::default(); MAX_ROOMS],
        }
    }

    /// Given to a source, which is where it is: `softly` where it has long been sounding.
    pub(crate) fn give(&mut self, source: u32, settings: &SourceSettings, hall: &Hall<'_>, softly: bool) {
        self.ring.clear();
        let targets = targets(settings, hall);
        self.now = targets.map(|target| Ear::at(&target));
        (self.source, self.leaves, self.arrived, self.level) = (Some(source), false, 1.0, if softly { 0.0 } else { 1.0 });
        (self.images, self.mirrored) = ([Image::default(); 6], None);
        self.sends = sends(settings, hall).map(Glide::at);
    }

    /// How many samples back it is heard at most.
    pub(crate) fn reach(&self) -> usize {
        self.now.iter().map(|ear| ear.delay.value() as usize).max().unwrap_or(0) + 2 * TAPS + AHEAD
    }

    /// A slice of both ears, of what was just written to the ring, and of what rooms hear of it. Returns false once it has left.
    pub(crate) fn slice(
        &mut self,
        settings: &SourceSettings,
        hall: &Hall<'_>,
        reflects: bool,
        out: &mut [[f32; SLICE]; 2],
        buses: &mut [[f32; SLICE]; MAX_ROOMS],
    ) -> bool {
        let wanted = targets(settings, hall);
        let jumped = |ears: &[Ear; 2]| (0..2).any(|ear| (wanted[ear].delay - ears[ear].delay.value()).abs() > JUMP);
        let mut targets = wanted;
        if jumped(&self.now) {
            if self.arrived >= 1.0 {
                self.before = self.now;
                self.now = wanted.map(|target| Ear::at(&target));
                self.arrived = 0.0;
            } else {
                // a second jump waits for the first to be over
                targets = [self.now[0].target(), self.now[1].target()];
            }
        }
        let step = 1.0 / FADE_SLICES;
        let level_to = (self.level + if self.leaves { -step } else { step }).clamp(0.0, 1.0);
        let arrived_to = (self.arrived + step).min(1.0);
        let mut wet = [0.0; SLICE];
        let line = |from: f32, to: f32| Line { from, step: (to - from) / SLICE as f32 };
        if self.arrived < 1.0 {
            let weight = line(self.level * (1.0 - self.arrived), level_to * (1.0 - arrived_to));
            let stays = [self.before[0].target(), self.before[1].target()];
            hear(&self.ring, &mut self.before, &stays, hall, weight, out, &mut wet);
        }
        let weight = line(self.level * self.arrived, level_to * arrived_to);
        hear(&self.ring, &mut self.now, &targets, hall, weight, out, &mut wet);
        let weight = line(self.level, level_to);
        self.reflect(settings, hall, reflects, weight, out);
        for (send, (to, bus)) in self.sends.iter_mut().zip(sends(settings, hall).into_iter().zip(buses)) {
            let line = send.slice(to, hall.rate);
            if line.from != 0.0 || line.step != 0.0 {
                for (k, (sample, wet)) in bus.iter_mut().zip(&wet).enumerate() {
                    *sample += wet * line.at(k);
                }
            }
        }
        (self.level, self.arrived) = (level_to, arrived_to);
        !(self.leaves && self.level <= 0.0)
    }

    /// The first reflections from the walls of the room that source and listener are both in.
    fn reflect(
        &mut self,
        settings: &SourceSettings,
        hall: &Hall<'_>,
        reflects: bool,
        weight: Line,
        out: &mut [[f32; SLICE]; 2],
    ) {
        let room =
            hall.room.filter(|room| reflects && hall.rooms.is_some_and(|set| set.room_of(settings.place) == Some(*room)));
        let silent = self.images.iter().all(|image| image.gain.value() < 1.0e-6);
        if silent {
            self.mirrored = room;
        }
        let Some(walls) = self.mirrored.and_then(|room| hall.rooms.and_then(|set| set.get(room))) else { return };
        let heard = room.is_some() && room == self.mirrored && !hall.changing;
        let base = self.ring.written() as f64 - (SLICE + AHEAD) as f64;
        let offset = travel_offset(settings, hall);
        for (image, place) in self.images.iter_mut().zip(walls.images(settings.place)) {
            let (paths, _) = hall.head.paths(place);
            let delays = paths.map(|path| (path.way_m / SPEED_OF_SOUND_M_S * RATE_HZ as f32 - offset).clamp(0.0, LONGEST));
            let away = (0..2).any(|ear| (delays[ear] - image.delay[ear].value()).abs() > JUMP);
            let level = settings.level((paths[0].way_m + paths[1].way_m) * 0.5) * walls.reflection() * walls.wet.min(1.0);
            let gain = if heard && !away { level } else { 0.0 };
            if away && image.gain.value() < 1.0e-6 {
                image.delay = delays.map(Glide::at);
            }
            let line = image.gain.slice(gain, hall.rate);
            if line.from == 0.0 && line.step == 0.0 {
                continue;
            }
            // a wall takes some of the treble
            let dull = dull_coefficient(2.0 + AIR_DB_PER_M * paths[0].way_m);
            for ear in 0..2 {
                let target = if away { image.delay[ear].value() } else { delays[ear] };
                let delay = image.delay[ear].slice(target, hall.rate);
                for (k, sample) in out[ear].iter_mut().enumerate() {
                    let heard = self.ring.read(hall.kernel, base + k as f64 - f64::from(delay.at(k)));
                    *sample += image.air[ear].next(dull, heard) * line.at(k) * weight.at(k);
                }
            }
        }
    }
}

/// Samples by which a source without a way through the air is early: all but the difference between the ears.
fn travel_offset(settings: &SourceSettings, hall: &Hall<'_>) -> f32 {
    match settings.travel {
        Travel::Air => 0.0,
        Travel::Immediate => {
            let distance = hall.head.position.distance(settings.place);
            (distance - hall.head.radius_m()).max(0.0) / SPEED_OF_SOUND_M_S * RATE_HZ as f32
        }
    }
}

fn targets(settings: &SourceSettings, hall: &Hall<'_>) -> [EarTarget; 2] {
    let (paths, distance) = hall.head.paths(settings.place);
    let offset = travel_offset(settings, hall);
    let occluded = gain_from_db(-OCCLUDED_DB * settings.occlusion);
    let dull = dull_coefficient(AIR_DB_PER_M * distance + OCCLUDED_TREBLE_DB * settings.occlusion);
    paths.map(|path| EarTarget {
        delay: (path.way_m / SPEED_OF_SOUND_M_S * RATE_HZ as f32 - offset).clamp(0.0, LONGEST),
        gain: settings.level(path.way_m) * occluded,
        alpha: path.shadow,
        dull,
    })
}

/// What each room hears: the source's own, and the listener's where it is another.
fn sends(settings: &SourceSettings, hall: &Hall<'_>) -> [f32; MAX_ROOMS] {
    let mut sends = [0.0; MAX_ROOMS];
    let Some(set) = hall.rooms.filter(|_| !hall.changing) else { return sends };
    let own = set.room_of(settings.place);
    if let Some(own) = own {
        sends[own] = settings.gain * settings.reference_m * set.echo(own);
    }
    if let Some(room) = hall.room
        && own != Some(room)
        && let Some(walls) = set.get(room)
    {
        // what arrives fills the room as a source at its edge would
        let distance = hall.head.position.distance(settings.place);
        let occluded = gain_from_db(-OCCLUDED_DB * settings.occlusion);
        let within = (walls.mean_free_path_m() * 0.5).min(distance);
        sends[room] = settings.level(distance) * occluded * within * set.echo(room);
    }
    sends
}

fn hear(
    ring: &Ring,
    ears: &mut [Ear; 2],
    targets: &[EarTarget; 2],
    hall: &Hall<'_>,
    weight: Line,
    out: &mut [[f32; SLICE]; 2],
    wet: &mut [f32; SLICE],
) {
    let base = ring.written() as f64 - (SLICE + AHEAD) as f64;
    for (side, ((ear, target), out)) in ears.iter_mut().zip(targets).zip(out).enumerate() {
        let delay = ear.delay.slice(target.delay, hall.rate);
        let gain = ear.gain.slice(target.gain, hall.rate);
        let alpha = ear.alpha.slice(target.alpha, hall.rate);
        let dull = ear.dull.slice(target.dull, hall.rate);
        for (k, out) in out.iter_mut().enumerate() {
            let heard = ring.read(hall.kernel, base + k as f64 - f64::from(delay.at(k)));
            // rooms hear what the left ear does, without what its head does to it
            if side == 0 {
                wet[k] += heard * weight.at(k);
            }
            let dulled = ear.air.next(dull.at(k), heard);
            *out += ear.shadow.next(&hall.pole, alpha.at(k), dulled) * gain.at(k) * weight.at(k);
        }
    }
}

/// A place that no source is farther from the listener than.
pub(crate) fn audible(place: Vec3, head: &Head) -> f32 {
    head.position.distance(place)
}
