//! The rooms of a mixer, and their echoes.

use crate::filter::Glide;
use crate::room::{Fdn, LEAK, Room};
use crate::{RATE_HZ, SLICE};
use glam::Vec3;

/// Rooms that a mixer holds.
pub const MAX_ROOMS: usize = 16;

/// The time constant in which echoes come and go as a listener walks from room to room, seconds.
pub(crate) const CROSSING_S: f32 = 0.12;

/// Made outside the audio thread, moved into it.
#[derive(Debug)]
pub(crate) struct RoomSet {
    rooms: Vec<Room>,
    echoes: Vec<Fdn>,
    heard: [Glide; MAX_ROOMS],
    /// From 1 to 0 as it gives way to others.
    fade: f32,
}

impl RoomSet {
    pub(crate) fn new(rooms: Vec<Room>) -> Self {
        let echoes = rooms.iter().map(Fdn::new).collect();
        Self { rooms, echoes, heard: [Glide::default(); MAX_ROOMS], fade: 1.0 }
    }

    pub(crate) fn get(&self, room: usize) -> Option<&Room> {
        self.rooms.get(room)
    }

    /// The smallest room that a place is in.
    pub(crate) fn room_of(&self, place: Vec3) -> Option<usize> {
        let inside = self.rooms.iter().enumerate().filter(|(_, room)| room.contains(place));
        inside.min_by(|(_, a), (_, b)| a.volume_m3().total_cmp(&b.volume_m3())).map(|(room, _)| room)
    }

    /// The level of a room's echo for a source of level 1 at one metre: as loud as the source itself at the critical distance.
    pub(crate) fn echo(&self, room: usize) -> f32 {
        let room = &self.rooms[room];
        // 12 dB above the source at a metre: a bath tub
        (room.wet / room.critical_distance_m().max(0.05)).min(4.0)
    }

    /// How much of the ambience outside is heard at a place.
    pub(crate) fn openness(&self, room: Option<usize>) -> f32 {
        room.and_then(|room| self.rooms.get(room)).map_or(1.0, |room| room.openness)
    }

    /// Adds all echoes. `rate` is of glides with [`CROSSING_S`]. Returns false when it has given way.
    pub(crate) fn slice(
        &mut self,
        listener: Vec3,
        room: Option<usize>,
        buses: Option<&[[f32; SLICE]; MAX_ROOMS]>,
        rate: f32,
        out: &mut [[f32; SLICE]; 2],
    ) -> bool {
        let step = if buses.is_some() { 0.0 } else { SLICE as f32 / (0.1 * RATE_HZ as f32) };
        let fade_to = (self.fade - step).max(0.0);
        let silence = [0.0; SLICE];
        for (k, (echo, place)) in self.echoes.iter_mut().zip(&self.rooms).enumerate() {
            let away = place.mean_free_path_m();
            let target = if room == Some(k) { 1.0 } else { LEAK * away / (away + place.distance_m(listener)) };
            let line = self.heard[k].slice(target, rate);
            let to = self.heard[k].value();
            let input = buses.map_or(&silence, |buses| &buses[k]);
            echo.slice(input, [line.from * self.fade, to * fade_to], out);
        }
        self.fade = fade_to;
        self.fade > 0.0
    }
}
