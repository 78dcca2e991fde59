//! The world as scripts see it: a snapshot that the host keeps up to date and that a step reads.

use crate::action::Hand;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// What scripts can ask about. Cheap to clone; changed in place by whoever alone holds it, which between two steps the host does.
#[derive(Clone, Debug, Default)]
pub struct World(Arc<Snapshot>);

#[derive(Clone, Debug, Default)]
pub(crate) struct Snapshot {
    pub visitor: [f32; 3],
    pub hour_s: f64,
    pub places: HashMap<String, [f32; 3]>,
    pub held: [Option<String>; 2],
    pub inside: HashSet<String>,
    pub hidden: HashSet<String>,
    pub materials: HashMap<String, String>,
    pub language: String,
}

impl World {
    /// An empty world at midnight.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    pub(crate) fn read(&self) -> &Snapshot {
        &self.0
    }

    fn change(&mut self) -> &mut Snapshot {
        Arc::make_mut(&mut self.0)
    }

    /// Where the visitor stands, metres of the world.
    pub fn set_visitor(&mut self, place: [f32; 3]) {
        self.change().visitor = place;
    }

    /// The hour of the day, seconds since midnight, from 0 to below 86,400.
    pub fn set_hour_s(&mut self, hour_s: f64) {
        self.change().hour_s = hour_s;
    }

    /// Where a thing, part, actor, region or view is.
    pub fn set_place(&mut self, name: &str, place: [f32; 3]) {
        match self.change().places.get_mut(name) {
            Some(old) => *old = place,
            None => drop(self.change().places.insert(name.to_owned(), place)),
        }
    }

    /// What a hand holds.
    pub fn set_held(&mut self, hand: Hand, thing: Option<&str>) {
        self.change().held[hand as usize] = thing.map(str::to_owned);
    }

    /// Whether the visitor is in a region.
    pub fn set_inside(&mut self, region: &str, inside: bool) {
        set(&mut self.change().inside, region, inside);
    }

    /// Whether a thing or actor is shown; it is until something else is said.
    pub fn set_shown(&mut self, what: &str, shown: bool) {
        set(&mut self.change().hidden, what, !shown);
    }

    /// What a thing or part is covered with; "" is nothing.
    pub fn set_material(&mut self, target: &str, material: &str) {
        self.change().materials.insert(target.to_owned(), material.to_owned());
    }

    /// The visitor's language, as in the table of texts: "en".
    pub fn set_language(&mut self, language: &str) {
        self.change().language = language.to_owned();
    }
}

fn set(names: &mut HashSet<String>, name: &str, there: bool) {
    if there {
        names.insert(name.to_owned());
    } else {
        names.remove(name);
    }
}
