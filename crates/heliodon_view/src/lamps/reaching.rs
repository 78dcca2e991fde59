//! Which lamps reach a place: for what is lit as a whole and not fragment by fragment.

use super::Lamp;
use crate::stage::ground::Ground;
use bevy::math::Vec3;
use heliodon_math::frame::unit_or;
use std::f32::consts::FRAC_1_PI;

/// What lies so near to a lamp or to the place hides neither from the other, metres: a lamp's own body, the ground beneath the feet.
const OFF_M: f32 = 0.25;

/// Unit directions to those of [`lit`](super::uniform::lit) lamps that reach a place, and their irradiance / pi at normal incidence there; the stone is in the way of those whose light has
/// shadows.
pub(crate) fn reaching(place: Vec3, lit: &[Lamp], ground: &Ground) -> impl Iterator<Item = (Vec3, Vec3)> {
    let hidden = move |to: Vec3, away_m: f32| {
        let reach = away_m - 2.0 * OFF_M;
        reach > 0.0 && ground.cast(place + to * OFF_M, to, reach).is_some()
    };
    lit.iter().filter_map(move |lamp| {
        let (to, irradiance) = arrives(lamp, place)?;
        let stopped = lamp.shadows && hidden(to, lamp.place.distance(place));
        (!stopped).then_some((to, irradiance))
    })
}

/// A lamp's direction and irradiance / pi at normal incidence where nothing is in its way, as lamps.wgsl has it.
pub(crate) fn arrives(lamp: &Lamp, place: Vec3) -> Option<(Vec3, Vec3)> {
    let away = lamp.place - place;
    let square = away.length_squared().max(1e-4);
    let to = unit_or(away, Vec3::Y);
    let left = square / (lamp.reach_m * lamp.reach_m);
    let window = (1.0 - left * left).clamp(0.0, 1.0);
    let inside = lamp.cone.map_or(1.0, |cone| {
        let edge = libm::cosf(cone.half_angle_rad);
        let full = libm::cosf(cone.half_angle_rad * (1.0 - cone.edge));
        ((-cone.direction.dot(to) - edge) / (full - edge).max(1e-4)).clamp(0.0, 1.0)
    });
    let falls = FRAC_1_PI / square * window * window * inside * inside * (3.0 - 2.0 * inside);
    (falls > 0.0).then_some((to, lamp.intensity * falls))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lamps::Cone;
    use std::f32::consts::FRAC_PI_4;

    #[test]
    fn a_lamp_falls_with_the_square_and_keeps_to_its_cone() {
        let lamp =
            Lamp { place: Vec3::new(0.0, 2.0, 0.0), intensity: Vec3::splat(8.0), cone: None, reach_m: 100.0, shadows: true };
        let (to, near) = arrives(&lamp, Vec3::ZERO).unwrap();
        assert_eq!(to, Vec3::Y);
        assert!((near.x - 2.0 * FRAC_1_PI).abs() < 1e-4);
        assert!(arrives(&lamp, Vec3::new(200.0, 0.0, 0.0)).is_none(), "beyond its reach");
        let cone = Some(Cone { direction: Vec3::NEG_Y, half_angle_rad: FRAC_PI_4, edge: 0.1 });
        let spot = Lamp { cone, ..lamp };
        assert_eq!(arrives(&spot, Vec3::ZERO).unwrap().1, near);
        assert!(arrives(&spot, Vec3::new(3.0, 0.0, 0.0)).is_none());
        assert_eq!(reaching(Vec3::ZERO, &[lamp, spot], &Ground::default()).count(), 2);
    }
}
