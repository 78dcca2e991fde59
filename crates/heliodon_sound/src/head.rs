//! What geometry says of a sound at two ears: how long it is on its way, how loud and how bright it arrives.
//!
//! The head is a rigid sphere of radius `a` (half the spacing of the ears) with the ears at the ends of its X axis.
//!
//! **Way.** A sound at the distance `D` from the head's centre, at the angle `theta` between the directions to the sound and to the
//! ear, reaches the ear along the shortest way outside the sphere:
//!
//! ```text
//! cos theta >= a / D (the ear is seen)   way = sqrt(D^2 + a^2 - 2 D a cos theta)
//! otherwise (around the head)            way = sqrt(D^2 - a^2) + a (theta - acos(a / D))
//! ```
//!
//! For a distant sound at the lateral angle `phi` the difference of both ears is `a (sin phi + phi)`: R. S. Woodworth and
//! H. Schlosberg, "Experimental Psychology", 1954. Here it holds for near sounds too. The delay is `way / c`.
//!
//! **Level.** `gain (reference / max(way, radius))^rolloff`, for each ear by its own way.
//!
//! **Head shadow.** C. P. Brown and R. O. Duda, "A structural model for binaural sound synthesis", IEEE Transactions on Speech
//! and Audio Processing 6(5), 1998, equations 2 and 3: one pole and one zero, 1 at low frequencies and `alpha(theta)` at
//! high ones,
//!
//! ```text
//! H = (1 + j alpha w / 2 w0) / (1 + j w / 2 w0)   w0 = c / a
//! alpha = (1 + m / 2) + (1 - m / 2) cos(180 theta / 150)   m = 0.1, theta in degrees
//! ```
//!
//! Why no measured head (HRTF): a set of another's ears puts sounds at wrong heights as often as at right ones, needs a file with
//! terms of its own and some 40 times the arithmetic; a sphere has everybody's differences of time and level.

use glam::{Quat, Vec3};

/// The speed of sound in air of 20 degrees Celsius, metres a second.
pub const SPEED_OF_SOUND_M_S: f32 = 343.2;

/// From one ear to the other through the head, metres, as it comes: twice the radius that Woodworth's formula is used with.
pub const EAR_SPACING_M: f32 = 0.175;

/// The farthest that a way is taken to be, metres: beyond, only the level of silence differs.
const FARTHEST_M: f32 = 1.0e6;

/// The angle of the deepest shadow, and what is left there: Brown and Duda's theta_min and alpha_min.
const SHADOW_ANGLE_RAD: f32 = 150.0 / 180.0 * std::f32::consts::PI;
const SHADOW_LEAST: f32 = 0.1;

/// The left and the right ear, as everything that is kept for both is ordered.
pub const EARS: [f32; 2] = [-1.0, 1.0];

/// Where a head is: `world_from_head`. It looks along its -Z, +Y is up, +X to its right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Head {
    /// Its centre, metres.
    pub position: Vec3,
    /// Turns directions of the head into those of the world; of length one.
    pub orientation: Quat,
    /// From ear to ear, metres, above 0.
    pub ear_spacing_m: f32,
}

impl Default for Head {
    fn default() -> Self {
        Self { position: Vec3::ZERO, orientation: Quat::IDENTITY, ear_spacing_m: EAR_SPACING_M }
    }
}

/// What reaches one ear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EarPath {
    /// The shortest way to it around the head, metres.
    pub way_m: f32,
    /// The level at high frequencies against that at low ones, from 0.1 in the head's shadow to 2 at the ear itself: `alpha`.
    pub shadow: f32,
}

impl Head {
    /// Its radius, metres.
    #[must_use]
    pub fn radius_m(&self) -> f32 {
        self.ear_spacing_m * 0.5
    }

    /// What reaches the left (0) and the right (1) ear from `place`, and the distance from the head's centre, metres. All numbers
    /// are finite wherever `place` is.
    #[must_use]
    pub fn paths(&self, place: Vec3) -> ([EarPath; 2], f32) {
        let p_head = self.orientation.conjugate() * (place - self.position);
        let distance = p_head.length();
        if !distance.is_finite() || distance > FARTHEST_M {
            return ([EarPath { way_m: FARTHEST_M, shadow: 1.0 }; 2], FARTHEST_M);
        }
        (EARS.map(|side| self.path(p_head, distance, side)), distance)
    }

    fn path(&self, p_head: Vec3, distance: f32, side: f32) -> EarPath {
        let radius = self.radius_m();
        // a sound at the centre itself is as far from both ears, and in no shadow
        let cosine = if distance > 0.0 { (side * p_head.x / distance).clamp(-1.0, 1.0) } else { 0.0 };
        let angle = libm::acosf(cosine);
        let straight = (distance * distance + radius * radius - 2.0 * distance * radius * cosine).max(0.0).sqrt();
        let way_m = if distance <= radius || cosine * distance >= radius {
            straight
        } else {
            (distance * distance - radius * radius).sqrt() + radius * (angle - libm::acosf(radius / distance))
        };
        EarPath { way_m, shadow: shadow(angle) }
    }
}

/// Brown and Duda's `alpha` at the angle between ear and sound, radians.
#[must_use]
pub fn shadow(angle_rad: f32) -> f32 {
    let half = SHADOW_LEAST * 0.5;
    (1.0 + half) + (1.0 - half) * libm::cosf(angle_rad / SHADOW_ANGLE_RAD * std::f32::consts::PI)
}

/// Magnitude and phase (radians) of the head's shadow at a frequency, for `alpha` and a radius in metres.
#[must_use]
pub fn shadow_response(alpha: f32, radius_m: f32, frequency_hz: f32) -> (f32, f32) {
    let x = std::f32::consts::TAU * frequency_hz * radius_m / (2.0 * SPEED_OF_SOUND_M_S);
    let magnitude = ((1.0 + alpha * alpha * x * x) / (1.0 + x * x)).sqrt();
    (magnitude, libm::atanf(alpha * x) - libm::atanf(x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_sounds_differ_as_woodworth_says() {
        let head = Head::default();
        for degrees in [0.0_f32, 20.0, 45.0, 70.0, 90.0] {
            let lateral = degrees.to_radians();
            let place = Vec3::new(lateral.sin(), 0.0, -lateral.cos()) * 1000.0;
            let ([left, right], _) = head.paths(place);
            let expected = head.radius_m() * (lateral.sin() + lateral);
            assert!((left.way_m - right.way_m - expected).abs() < 2e-4, "{degrees}: {}", left.way_m - right.way_m);
        }
    }

    #[test]
    fn the_way_is_continuous_where_the_ear_disappears() {
        let head = Head::default();
        let mut last = None::<f32>;
        for step in 0..3600_u16 {
            let angle = f32::from(step) * std::f32::consts::TAU / 3600.0;
            let ([left, _], distance) = head.paths(Vec3::new(angle.sin(), 0.0, angle.cos()) * 0.4);
            assert!((distance - 0.4).abs() < 1e-6);
            assert!(last.is_none_or(|last| (left.way_m - last).abs() < 3e-4));
            last = Some(left.way_m);
        }
    }

    #[test]
    fn odd_places_are_finite() {
        let head = Head::default();
        for place in
            [Vec3::ZERO, Vec3::splat(1e30), Vec3::splat(f32::NAN), Vec3::new(f32::INFINITY, 0.0, 0.0), Vec3::X * 0.0875]
        {
            let (ears, distance) = head.paths(place);
            assert!(distance.is_finite() && ears.iter().all(|ear| ear.way_m.is_finite() && ear.shadow.is_finite()), "{place}");
        }
    }

    #[test]
    fn the_shadow_is_deepest_behind_the_head() {
        assert!((shadow(0.0) - 2.0).abs() < 1e-6 && (shadow(SHADOW_ANGLE_RAD) - 0.1).abs() < 1e-6);
        let (low, _) = shadow_response(0.1, 0.0875, 20.0);
        let (high, _) = shadow_response(0.1, 0.0875, 20_000.0);
        assert!((low - 1.0).abs() < 0.01 && high < 0.13, "{low} {high}");
    }
}
