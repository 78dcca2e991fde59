//! Whoever and whatever else stands about: actors, which hold visitors and falling things and are moved by neither.
//!
//! Somebody is an upright capsule, anything else that is not too large the box around it; both follow their whereabouts. What is larger than a room's furniture
//! is left out: the box around a crane or an arch would hold those who stand under it.

use super::space::Space;
use crate::actors::Actors;
use avian3d::prelude::Collider;
use bevy::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Lower is nobody, metres: a child of three years.
const SHORTEST_M: f32 = 0.9;
/// Somebody is at most so much of their height wide, on their narrower side: arms swing along the other.
const SLIM: f32 = 0.6;
/// How wide somebody is, metres.
const WIDTH_M: (f32, f32) = (0.3, 0.7);
/// What is larger is left out, metres.
const LARGEST_M: f32 = 3.0;
/// What has no such size was not posed yet, metres.
const SMALLEST_M: f32 = 0.02;
/// Sizes are rounded to this, metres: somebody's box breathes as they walk.
const GRAIN_M: f32 = 0.1;

/// Who stands about, by name.
#[derive(Default)]
pub struct Crowd(BTreeMap<String, (Entity, Form)>);

/// What stands for somebody or something; sizes in numbers of [`GRAIN_M`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    Capsule { width: u32, height: u32 },
    Cuboid([u32; 3]),
}

impl Form {
    /// None for what is left out.
    fn of(size: Vec3) -> Option<Self> {
        if !size.is_finite() || size.max_element() < SMALLEST_M || size.max_element() > LARGEST_M {
            return None;
        }
        let grains = |metres: f32| (metres / GRAIN_M).round().max(1.0) as u32;
        let narrow = size.x.min(size.z);
        Some(if size.y >= SHORTEST_M && narrow <= SLIM * size.y {
            Self::Capsule { width: grains(narrow.clamp(WIDTH_M.0, WIDTH_M.1)), height: grains(size.y) }
        } else {
            Self::Cuboid(size.to_array().map(grains))
        })
    }

    fn collider(self) -> Collider {
        match self {
            Self::Capsule { width, height } => {
                let [width, height] = [width, height].map(|grains| grains as f32 * GRAIN_M);
                Collider::capsule(0.5 * width, (height - width).max(0.0))
            }
            Self::Cuboid(size) => {
                let [x, y, z] = size.map(|grains| grains as f32 * GRAIN_M);
                Collider::cuboid(x, y, z)
            }
        }
    }
}

impl Crowd {
    /// Puts all to where they are now, but for those that are things or hidden.
    pub fn follow(&mut self, space: &mut Space, actors: &Actors, is_thing: impl Fn(&str) -> bool) {
        let hidden = |name: &str| actors.directions.get(name).is_some_and(|direction| direction.hidden);
        let mut there: BTreeSet<&str> = BTreeSet::new();
        let mut moved = false;
        for (name, _, (low, high)) in actors.everybody().filter(|(name, ..)| !is_thing(name) && !hidden(name)) {
            let Some(form) = Form::of(high - low) else { continue };
            there.insert(name);
            let middle = (low + high) * 0.5;
            match self.0.get(name) {
                Some((entity, known)) if *known == form => moved |= space.move_actor(*entity, middle),
                known => {
                    known.into_iter().for_each(|(entity, _)| space.remove(*entity));
                    let entity = space.add_actor(name, form.collider(), middle);
                    self.0.insert(name.to_owned(), (entity, form));
                }
            }
        }
        self.0.retain(|name, (entity, _)| {
            let stays = there.contains(name.as_str());
            if !stays {
                space.remove(*entity);
            }
            stays
        });
        if moved {
            space.find_moved();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_are_slim_and_arches_are_left_out() {
        assert!(matches!(Form::of(Vec3::new(1.6, 1.8, 0.4)), Some(Form::Capsule { width: 4, height: 18 })));
        assert!(matches!(Form::of(Vec3::new(1.6, 0.8, 0.7)), Some(Form::Cuboid([16, 8, 7]))));
        assert_eq!(Form::of(Vec3::new(6.0, 5.0, 1.0)), None);
        assert_eq!(Form::of(Vec3::ZERO), None);
        assert_eq!(Form::of(Vec3::NAN), None);
    }
}
