//! Which lamps reach a place: for what is lit as a whole and not fragment by fragment.

use super::Lamp;
use crate::stage::ground::Ground;
use bevy::math::{IVec3, Vec3};
use heliodon_math::frame::unit_or;
use std::f32::consts::FRAC_1_PI;

/// What lies so near to a lamp or to the place hides neither from the other, metres: a lamp's own body, the ground beneath the feet.
const OFF_M: f32 = 0.25;

/// Side of the cells of space that rays are cast from, metres: who moves within one is hidden from the same lamps.
const CELL_M: f32 = 0.1;

/// Which lamps reach a place. Rays are cast from the middle of the cell that the place lies in, so that what is found does not depend on where it was before, and only where cell, lamp or
/// stone are others than they were.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Reach {
    cell: IVec3,
    chunks: usize,
    /// Of each lamp that it was asked of: its place, and whether stone hides it.
    known: Vec<(Vec3, bool)>,
}

impl Reach {
    /// Unit directions to those of [`lit`](super::uniform::lit) lamps that reach a place, and their irradiance / pi at normal incidence there; the stone is in the way of those whose light
    /// has shadows.
    pub(crate) fn of(&mut self, place: Vec3, lit: &[Lamp], ground: &Ground) -> impl Iterator<Item = (Vec3, Vec3)> {
        let (cell, chunks) = ((place / CELL_M).floor().as_ivec3(), ground.chunks().len());
        if (self.cell, self.chunks) != (cell, chunks) {
            *self = Self { cell, chunks, known: std::mem::take(&mut self.known) };
            self.known.clear();
        }
        let from = (cell.as_vec3() + 0.5) * CELL_M;
        // beyond all of them, a lamp that is nowhere: asked anew
        self.known.resize(lit.len(), (Vec3::NAN, false));
        lit.iter().zip(&mut self.known).filter_map(move |(lamp, known)| {
            let (to, irradiance) = arrives(lamp, place)?;
            if lamp.shadows && known.0 != lamp.place {
                *known = (lamp.place, is_hidden(from, lamp.place, ground));
            }
            (!lamp.shadows || !known.1).then_some((to, irradiance))
        })
    }
}

fn is_hidden(from: Vec3, lamp: Vec3, ground: &Ground) -> bool {
    let reach = from.distance(lamp) - 2.0 * OFF_M;
    let to = unit_or(lamp - from, Vec3::Y);
    reach > 0.0 && ground.cast(from + to * OFF_M, to, reach).is_some()
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

/// The most that a lamp may give to anything within `radius` of a place and no nearer to it than `least_m`: the greatest channel of [`arrives`]; 0 beyond reach and cone.
pub(crate) fn arrives_within(lamp: &Lamp, place: Vec3, radius: f32, least_m: f32) -> f32 {
    let away = place - lamp.place;
    let nearest = (away.length() - radius).max(least_m);
    let outside = lamp.cone.map_or(f32::NEG_INFINITY, |cone| {
        let ahead = away.dot(cone.direction);
        let aside = (away.length_squared() - ahead * ahead).max(0.0).sqrt();
        aside * libm::cosf(cone.half_angle_rad) - ahead * libm::sinf(cone.half_angle_rad)
    });
    let left = (nearest / lamp.reach_m).powi(2);
    let window = (1.0 - left * left).clamp(0.0, 1.0);
    if outside >= radius { 0.0 } else { lamp.intensity.max_element() * (FRAC_1_PI * window * window / (nearest * nearest)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lamps::Cone;
    use crate::stage::ground::tests::floor;
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
        assert_eq!(Reach::default().of(Vec3::ZERO, &[lamp, spot], &Ground::default()).count(), 2);
    }

    #[test]
    fn what_a_lamp_may_give_within_a_ball_is_no_less_than_what_it_gives_there() {
        let cone = Some(Cone { direction: unit_or(Vec3::new(0.3, -1.0, 0.2), Vec3::NEG_Y), half_angle_rad: 0.5, edge: 0.3 });
        let lamp =
            Lamp { place: Vec3::new(0.0, 3.0, 0.0), intensity: Vec3::splat(8.0), cone: None, reach_m: 5.0, shadows: true };
        let mut random = heliodon_math::random::Pcg32::new(3, 1);
        for lamp in [lamp, Lamp { cone, ..lamp }] {
            let (mut lit, mut dark) = (0, 0);
            for _ in 0..2000 {
                let [middle, off] = [4.0, 0.5].map(|far| Vec3::from([0, 1, 2].map(|_| random.range_f32(-far, far))));
                let within = arrives_within(&lamp, middle, off.length(), 0.01);
                let there = arrives(&lamp, middle + off).map_or(0.0, |(_, light)| light.max_element());
                assert!(within >= there * 0.999, "{middle} and {off}: {within} of {there}");
                (lit, dark) = (lit + u32::from(there > 0.0), dark + u32::from(within == 0.0));
            }
            assert!(lit > 100 && dark > 100, "{lit} lit, {dark} dark");
        }
    }

    #[test]
    fn rays_are_cast_again_where_place_lamp_or_stone_is_another() {
        let lamp =
            Lamp { place: Vec3::new(0.2, 3.0, 0.0), intensity: Vec3::splat(8.0), cone: None, reach_m: 100.0, shadows: true };
        let (open, mut roofed, mut reach) = (Ground::default(), Ground::default(), Reach::default());
        roofed.push(floor(2.0));
        let place = Vec3::new(0.03, 1.0, 0.03);
        assert_eq!(reach.of(place, &[lamp], &open).count(), 1);
        assert_eq!(reach.of(place, &[lamp], &roofed).count(), 0, "the stone is another");
        assert_eq!(reach.of(place, &[], &roofed).count(), 0);
        let below = Lamp { place: Vec3::new(0.2, 1.6, 0.0), ..lamp };
        assert_eq!(reach.of(place, &[below, lamp], &roofed).count(), 1, "the lamp is another");
        assert_eq!(reach.of(place + Vec3::Y * 2.0, &[below, lamp], &roofed).count(), 1, "the place is another");
        let bright = Lamp { intensity: Vec3::ONE, shadows: false, ..lamp };
        assert_eq!(reach.of(place, &[bright], &roofed).count(), 1, "nothing hides what casts no shadows");
        // what a lamp gives is its own at every time, what is known is only what hides it
        let first: Vec<_> = reach.of(place, &[below], &roofed).collect();
        let dimmed = Lamp { intensity: below.intensity * 0.5, ..below };
        let second: Vec<_> = reach.of(place, &[dimmed], &roofed).collect();
        assert_eq!((first[0].0, first[0].1 * 0.5), second[0]);
    }
}
