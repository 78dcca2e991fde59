//! Rooms with their own echo: what a box of stone does to a sound within it.

mod decay;
mod fdn;

pub(crate) use fdn::Fdn;

use crate::RATE_HZ;
use crate::head::SPEED_OF_SOUND_M_S;
use glam::Vec3;
use thiserror::Error;

/// The middles of the bands that a room's reverberation times are told for, hertz.
pub const BANDS_HZ: [f32; 3] = [250.0, 1000.0, 4000.0];

/// Reverberation times that can be asked for, seconds: below, an early reflection says it all; beyond, no building.
pub const RT60_S: [f32; 2] = [0.1, 20.0];

/// Sides that a room may have, metres.
pub const SIDES_M: [f32; 2] = [1.0, 500.0];

/// The part of a sound in another room that comes through to the listener's with that room's echo: -20 dB.
pub(crate) const LEAK: f32 = 0.1;

/// A room: a box along the world's axes, inside which sounds and listeners hear its echo. Where boxes overlap the smallest counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Room {
    /// What messages call it.
    pub name: String,
    /// Its lower corner, metres.
    pub min: Vec3,
    /// Its upper corner, metres.
    pub max: Vec3,
    /// The time in which an echo falls by 60 dB at 250, 1000 and 4000 Hz, seconds. More: larger, harder.
    pub rt60_s: [f32; 3],
    /// How loud the echo is against what theory says of such a room, from 0 (none) to 4; 1 is right.
    pub wet: f32,
    /// The share of the ambience outside that is heard within: 0 behind closed doors, 1 in a courtyard.
    pub openness: f32,
}

/// Why a room cannot be.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("room {name:?}: {what}; {remedy}")]
pub struct RoomError {
    /// The room's name.
    pub name: String,
    /// What is wrong.
    pub what: String,
    /// What to do about it.
    pub remedy: &'static str,
}

/// What absorbs how much in common rooms, to make a [`Room`] of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Walls {
    /// Bare marble or limestone, such as a cella.
    Stone,
    /// Plaster on brick.
    Plaster,
    /// Timber walls and ceiling.
    Wood,
    /// Walls of earth, cloth and straw.
    Soft,
}

impl Walls {
    /// Mean absorption at [`BANDS_HZ`]. From the tables in H. Kuttruff, "Room Acoustics", with what stands in rooms allowed for.
    #[must_use]
    pub fn absorption(self) -> [f32; 3] {
        match self {
            Self::Stone => [0.03, 0.04, 0.06],
            Self::Plaster => [0.05, 0.06, 0.08],
            Self::Wood => [0.15, 0.10, 0.10],
            Self::Soft => [0.20, 0.40, 0.55],
        }
    }
}

impl Room {
    /// A room between two corners whose reverberation time is Eyring's for such walls:
    /// `0.161 V / (-S ln(1 - absorption) + 4 m V)`, with what air takes at each band.
    #[must_use]
    pub fn with_walls(name: &str, min: Vec3, max: Vec3, walls: Walls) -> Self {
        let (sides, name) = (max - min, name.to_owned());
        let volume = sides.x * sides.y * sides.z;
        let surface = 2.0 * (sides.x * sides.y + sides.y * sides.z + sides.z * sides.x);
        // ISO 9613-1, 20 degrees, half humid: 1.3, 4.7 and 29.7 dB a kilometre, as the exponent m of energy a metre
        let air = [0.0003, 0.0011, 0.0068];
        let rt60_s = std::array::from_fn(|band| {
            let walls = -surface * libm::logf(1.0 - walls.absorption()[band]);
            (0.161 * volume / (walls + 4.0 * air[band] * volume)).clamp(RT60_S[0], RT60_S[1])
        });
        Self { name, min, max, rt60_s, wet: 1.0, openness: 0.2 }
    }

    /// Whether it can be heard.
    ///
    /// # Errors
    ///
    /// Numbers that are not finite or outside their ranges.
    pub fn validate(&self) -> Result<(), RoomError> {
        let refuse = |what: String, remedy| Err(RoomError { name: self.name.clone(), what, remedy });
        if !self.min.is_finite() || !self.max.is_finite() {
            return refuse(format!("its corners {} and {} are not finite", self.min, self.max), "give three numbers for each");
        }
        if !(self.max - self.min).to_array().iter().all(|side| (SIDES_M[0]..=SIDES_M[1]).contains(side)) {
            return refuse(
                format!("its sides are {} m", self.max - self.min),
                "max lies 1 to 500 m beyond min along every axis; correct min and max",
            );
        }
        if !self.rt60_s.iter().all(|time| (RT60_S[0]..=RT60_S[1]).contains(time)) {
            return refuse(format!("its reverberation times are {:?} s", self.rt60_s), "give three from 0.1 to 20 seconds");
        }
        if !(0.0..=4.0).contains(&self.wet) {
            return refuse(format!("its echo's level is {}", self.wet), "give 0 to 4; 1 is what theory says");
        }
        if !(0.0..=1.0).contains(&self.openness) {
            return refuse(format!("its openness is {}", self.openness), "give 0 to 1");
        }
        Ok(())
    }

    /// Cubic metres.
    #[must_use]
    pub fn volume_m3(&self) -> f32 {
        let sides = self.max - self.min;
        sides.x * sides.y * sides.z
    }

    /// Square metres of its six sides.
    #[must_use]
    pub fn surface_m2(&self) -> f32 {
        let sides = self.max - self.min;
        2.0 * (sides.x * sides.y + sides.y * sides.z + sides.z * sides.x)
    }

    /// The mean way between two walls, metres: `4 V / S`.
    #[must_use]
    pub fn mean_free_path_m(&self) -> f32 {
        4.0 * self.volume_m3() / self.surface_m2()
    }

    /// Where a sound's echo is as loud as the sound itself, metres: `0.057 sqrt(V / T)` (H. Kuttruff, "Room Acoustics").
    #[must_use]
    pub fn critical_distance_m(&self) -> f32 {
        0.057 * (self.volume_m3() / self.rt60_s[1]).sqrt()
    }

    /// The amplitude that a wall sends back: the root of what Eyring's absorption for [`Room::rt60_s`] at 1 kHz leaves.
    #[must_use]
    pub fn reflection(&self) -> f32 {
        libm::expf(-0.161 * self.volume_m3() / (self.surface_m2() * self.rt60_s[1]) * 0.5)
    }

    /// Whether a place is inside.
    #[must_use]
    pub fn contains(&self, place: Vec3) -> bool {
        place.cmpge(self.min).all() && place.cmple(self.max).all()
    }

    /// The distance from a place to the box; 0 inside.
    #[must_use]
    pub fn distance_m(&self, place: Vec3) -> f32 {
        (place.clamp(self.min, self.max) - place).length()
    }

    /// The six mirror images of a place in it, first order: J. B. Allen and D. A. Berkley, "Image method for efficiently simulating
    /// small-room acoustics", Journal of the Acoustical Society of America 65(4), 1979.
    #[must_use]
    pub fn images(&self, place: Vec3) -> [Vec3; 6] {
        let Vec3 { x, y, z } = place;
        [
            Vec3::new(2.0 * self.min.x - x, y, z),
            Vec3::new(2.0 * self.max.x - x, y, z),
            Vec3::new(x, 2.0 * self.min.y - y, z),
            Vec3::new(x, 2.0 * self.max.y - y, z),
            Vec3::new(x, y, 2.0 * self.min.z - z),
            Vec3::new(x, y, 2.0 * self.max.z - z),
        ]
    }

    /// Samples of the mean way between two walls.
    pub(crate) fn mean_delay(&self) -> f32 {
        self.mean_free_path_m() / SPEED_OF_SOUND_M_S * RATE_HZ as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_marble_hall_rings_for_seconds_and_a_tent_does_not() {
        let cella = Room::with_walls("cella", Vec3::ZERO, Vec3::new(19.0, 12.0, 29.0), Walls::Stone);
        cella.validate().expect("a room");
        assert!((3.0..9.0).contains(&cella.rt60_s[1]) && cella.rt60_s[2] < cella.rt60_s[1], "{:?}", cella.rt60_s);
        assert!((1.5..3.5).contains(&cella.critical_distance_m()), "{}", cella.critical_distance_m());
        let tent = Room::with_walls("tent", Vec3::ZERO, Vec3::splat(3.0), Walls::Soft);
        assert!(tent.rt60_s[1] < 0.3 && tent.reflection() < cella.reflection());
    }

    #[test]
    fn images_are_behind_the_walls() {
        let room = Room::with_walls("room", Vec3::ZERO, Vec3::new(4.0, 3.0, 5.0), Walls::Stone);
        for image in room.images(Vec3::new(1.0, 1.0, 1.0)) {
            assert!(!room.contains(image));
        }
        assert_eq!(room.distance_m(Vec3::new(-2.0, 1.0, 1.0)), 2.0);
    }

    #[test]
    fn odd_rooms_are_refused_by_name() {
        let good = Room::with_walls("naos", Vec3::ZERO, Vec3::splat(5.0), Walls::Stone);
        for bad in [
            Room { max: Vec3::splat(f32::NAN), ..good.clone() },
            Room { max: Vec3::splat(-1.0), ..good.clone() },
            Room { rt60_s: [0.0, 1.0, 1.0], ..good.clone() },
            Room { rt60_s: [1.0, f32::NAN, 1.0], ..good.clone() },
            Room { wet: -1.0, ..good.clone() },
            Room { openness: f32::INFINITY, ..good.clone() },
        ] {
            let told = bad.validate().expect_err("refused").to_string();
            assert!(told.contains("naos") && told.contains(';'), "{told}");
        }
    }
}
