//! A source of particles, and what is known of its surroundings.

use super::births::Span;
use crate::stage::ground::Ground;
use glam::Vec3;
use heliodon_bundle::site::{ParticleKind, Particles as Table};
use heliodon_math::frame::unit_or;
use heliodon_math::random::hash2_u32;

/// Points along each side at which it is known how high the ground beneath a source is.
const SIDE: usize = 5;
/// How far below a source the ground is looked for, metres.
const DEEP_M: f32 = 60.0;
/// Directions in which it is looked whether a source is under the sky.
const SKYWARD: u32 = 24;

/// A source.
#[derive(Clone, Debug)]
pub struct Source {
    /// Its name for scripts.
    pub name: String,
    /// What it gives.
    pub kind: ParticleKind,
    /// Where.
    pub place: Vec3,
    /// How far to all sides, metres.
    pub extent: Vec3,
    /// How many, beside what is usual.
    pub density: f32,
    /// How large, beside what is usual.
    pub size: f32,
    /// Of what is random.
    pub seed: u32,
    /// When.
    pub span: Span,
    /// Once it was looked at.
    pub around: Option<Around>,
}

/// What is around a source.
#[derive(Clone, Debug, PartialEq)]
pub struct Around {
    /// Heights of the ground, row by row along Z, from the source's least corner on; far below where there is none.
    floor: [[f32; SIDE]; SIDE],
    /// The part of the sky above that is seen from there.
    pub openness: f32,
}

impl Source {
    /// What the site says.
    #[must_use]
    pub fn new(table: &Table, number: u32) -> Self {
        let point = |point: [f64; 3]| Vec3::from(point.map(|v| v as f32));
        Self {
            name: table.name.clone(),
            kind: table.kind,
            place: point(table.place),
            extent: point(table.extent),
            density: table.density as f32,
            size: table.size as f32,
            seed: hash2_u32(number, 0x00a1_12e5),
            span: if table.plays { Span::ALWAYS } else { Span::NEVER },
            around: None,
        }
    }

    /// Looks at the ground beneath and the sky above.
    pub fn look_around(&mut self, ground: &Ground) {
        self.around.get_or_insert_with(|| {
            let mut floor = [[self.place.y - DEEP_M; SIDE]; SIDE];
            // below a roof that it drips from, not upon it
            let top = self.place.y - self.extent.y;
            // what does not fall needs no ground
            if matches!(self.kind, ParticleKind::Water | ParticleKind::Sparks) {
                for (row, z) in floor.iter_mut().zip(0..) {
                    for (height, x) in row.iter_mut().zip(0..) {
                        let part = Vec3::new(x as f32, 0.0, z as f32) / (SIDE - 1) as f32 * 2.0 - 1.0;
                        let above =
                            Vec3::new(self.place.x + part.x * self.extent.x, top, self.place.z + part.z * self.extent.z);
                        if let Some(touch) = ground.cast(above, Vec3::NEG_Y, DEEP_M) {
                            *height = top - touch.distance;
                        }
                    }
                }
            }
            let above = self.place + Vec3::Y * 0.3;
            let open = (0..SKYWARD).filter(|number| ground.cast(above, skyward(*number), 1e4).is_none()).count();
            Around { floor, openness: open as f32 / SKYWARD as f32 }
        });
    }

    /// The height of the ground beneath a place; far below until it was looked at.
    #[must_use]
    pub fn floor(&self, x: f32, z: f32) -> f32 {
        let Some(around) = &self.around else { return self.place.y - DEEP_M };
        let part = |v: f32, place: f32, extent: f32| {
            let cell = (v - place + extent) / (2.0 * extent).max(1e-3) * (SIDE - 1) as f32;
            (cell + 0.5).clamp(0.0, (SIDE - 1) as f32) as usize
        };
        around.floor[part(z, self.place.z, self.extent.z)][part(x, self.place.x, self.extent.x)]
    }

    /// Heights of the ground beneath, row by row along Z from its least corner on; far below until it was looked at.
    #[must_use]
    pub fn floors(&self) -> [f32; SIDE * SIDE] {
        let unknown = [self.place.y - DEEP_M; SIDE * SIDE];
        let known = self.around.as_ref().and_then(|around| around.floor.as_flattened().try_into().ok());
        known.unwrap_or(unknown)
    }

    /// How wide it is, metres to each side.
    #[must_use]
    pub fn width_m(&self) -> f32 {
        self.extent.x.max(self.extent.z).max(0.02)
    }

    /// The volume of the box, cubic metres.
    #[must_use]
    pub fn volume_m3(&self) -> f32 {
        (2.0 * self.extent).element_product()
    }

    /// The box of what it gives.
    #[must_use]
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let (low, high) = (self.place - self.extent, self.place + self.extent);
        let (wide, size) = (self.width_m(), self.size);
        match self.kind {
            ParticleKind::Dust => (low, high),
            ParticleKind::Fire => {
                let margin = Vec3::splat(2.0 * wide * size.max(1.0));
                (low - margin, high + margin + Vec3::Y * super::plume::flame_m(self))
            }
            ParticleKind::Smoke => {
                let side = 2.0 * size.max(1.0);
                (low - side, high + side + Vec3::Y * 7.0)
            }
            ParticleKind::Sparks => {
                let reach = 3.0 * size.sqrt().max(1.0);
                (low - reach, high + reach)
            }
            ParticleKind::Water => {
                // not known yet, it is deep: what is never in sight is never looked around
                let unknown = self.place.y - DEEP_M;
                let floor = self
                    .around
                    .as_ref()
                    .map_or(unknown, |around| around.floor.as_flattened().iter().copied().fold(low.y, f32::min));
                (Vec3 { y: floor, ..low } - 0.6, high + 0.6)
            }
        }
    }
}

/// The directions of a spiral over the upper half of the sphere, each of the same solid angle.
fn skyward(number: u32) -> Vec3 {
    let height = (number as f32 + 0.5) / SKYWARD as f32;
    // the golden angle
    let (sin, cos) = (number as f32 * 2.399_963).sin_cos();
    let across = (1.0 - height * height).sqrt();
    unit_or(Vec3::new(across * cos, height, across * sin), Vec3::Y)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A source of a kind at a place.
    pub fn source(kind: ParticleKind, place: Vec3) -> Source {
        Source {
            name: "source".to_owned(),
            kind,
            place,
            extent: Vec3::splat(0.2),
            density: 1.0,
            size: 1.0,
            seed: 3,
            span: Span::ALWAYS,
            around: None,
        }
    }

    #[test]
    fn water_is_in_sight_below_its_place_before_its_ground_is_known() {
        let source = source(ParticleKind::Water, Vec3::Y * 20.0);
        assert!(source.bounds().0.y < 0.0);
    }

    #[test]
    fn a_source_without_anything_around_is_under_the_open_sky() {
        let mut source = source(ParticleKind::Water, Vec3::Y);
        source.look_around(&Ground::default());
        assert_eq!(source.around.as_ref().map(|around| around.openness), Some(1.0));
        assert!(source.floor(0.0, 0.0) < -50.0);
    }
}
