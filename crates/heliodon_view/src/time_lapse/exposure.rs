//! The exposure: automatic from the lapse, smoothed in time, and stops by hand on top.

use bevy::prelude::Resource;

/// Seconds after which half of a change is followed: a sun that comes out dazzles for a moment.
const HALF_LIFE_S: f32 = 0.3;

/// Exposure in stops.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct Exposure {
    /// Stops by hand, on top of the automatic ones, or alone without them.
    pub manual_stops: f32,
    /// Whether the lapse's exposure is left where it is instead of being followed.
    pub held: bool,
    automatic_stops: f32,
}

impl Exposure {
    /// The exposure in use.
    #[must_use]
    pub fn stops(&self) -> f32 {
        self.automatic_stops + self.manual_stops
    }

    /// Sets the exposure to `stops` and holds it.
    pub fn fix(&mut self, stops: f32) {
        (self.automatic_stops, self.manual_stops, self.held) = (stops, 0.0, true);
    }

    /// Comes nearer to the lapse's exposure; `seconds` may be infinite. The lapse already follows only about two thirds of
    /// the change in stops, so that dawn stays darker than noon.
    pub(crate) fn follow(&mut self, lapse_stops: f32, seconds: f32) {
        if self.held {
            return;
        }
        let left = (-seconds / HALF_LIFE_S).exp2();
        self.automatic_stops = lapse_stops + (self.automatic_stops - lapse_stops) * left;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_a_change_is_followed_in_the_half_life() {
        let mut exposure = Exposure::default();
        exposure.follow(4.0, HALF_LIFE_S);
        assert!((exposure.stops() - 2.0).abs() < 1e-6);
        exposure.follow(4.0, f32::INFINITY);
        exposure.manual_stops = -1.5;
        assert!((exposure.stops() - 2.5).abs() < 1e-6);
        exposure.held = true;
        exposure.follow(-10.0, 1.0);
        assert!((exposure.stops() - 2.5).abs() < 1e-6);
    }
}
