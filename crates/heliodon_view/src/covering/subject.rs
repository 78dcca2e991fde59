//! What one part, thing or actor wears, and how that changes.

use glam::Vec3;
use heliodon_bundle::site::Material;
use heliodon_script::action::Easing;

/// Materials that are there at one time: while one spreads, the one before is below it.
pub const LAYERS: usize = 2;

/// How long a mark takes to come and to go, seconds.
const MARK_S: f32 = 0.3;

/// Steps of eight bits: what is nearer to its end is there.
const LEAST: f32 = 1e-4;

/// A number on its way to another.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Glide {
    from: f32,
    to: f32,
    passed_s: f32,
    in_s: f32,
}

impl Glide {
    fn at(value: f32) -> Self {
        Self { from: value, to: value, passed_s: 0.0, in_s: 0.0 }
    }

    fn go(&mut self, to: f32, in_s: f32) {
        *self = Self { from: self.value(), to, passed_s: 0.0, in_s };
    }

    fn pass(&mut self, seconds: f32) {
        self.passed_s = (self.passed_s + seconds).min(self.in_s);
    }

    fn value(&self) -> f32 {
        let along = if self.in_s > 0.0 { (self.passed_s / self.in_s).min(1.0) } else { 1.0 };
        let value = self.from + (self.to - self.from) * Easing::Smooth.at(along);
        if (value - self.to).abs() < LEAST { self.to } else { value }
    }
}

/// A material on something.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// What it is.
    pub material: Material,
    /// Where it began to spread, in the space of what it covers; else it rises from the lowest point.
    pub origin: Option<Vec3>,
    amount: Glide,
}

impl Layer {
    /// How far it has spread, 0 to 1.
    #[must_use]
    pub fn amount(&self) -> f32 {
        self.amount.value()
    }
}

/// What one part, thing or actor wears.
#[derive(Clone, Debug, PartialEq)]
pub struct Subject {
    /// The lower one first.
    pub layers: [Option<Layer>; LAYERS],
    opacity: Glide,
    mark: Glide,
}

impl Default for Subject {
    fn default() -> Self {
        Self { layers: [const { None }; LAYERS], opacity: Glide::at(1.0), mark: Glide::at(0.0) }
    }
}

impl Subject {
    /// Lets a material spread over it. One that is below it already is there at once.
    pub fn cover(&mut self, material: Material, origin: Option<Vec3>, in_s: f32) {
        if let Some(top) = self.layers.iter_mut().flatten().next_back().filter(|top| top.material.name == material.name) {
            if top.amount.to < 1.0 {
                top.amount.go(1.0, in_s);
            }
            return;
        }
        let mut amount = Glide::at(0.0);
        amount.go(1.0, in_s);
        let layer = Layer { material, origin, amount };
        self.settle();
        self.layers = match std::mem::take(&mut self.layers) {
            [None, _] => [Some(layer), None],
            [below, None] => [below, Some(layer)],
            // Two are still spreading: the one that came later is what is seen most of from here on.
            [_, Some(upper)] => [Some(upper), Some(layer)],
        };
    }

    /// Lets its materials go the way that they came.
    pub fn bare(&mut self, in_s: f32) {
        self.layers.iter_mut().flatten().for_each(|layer| layer.amount.go(0.0, in_s));
        self.settle();
    }

    /// Makes it more or less transparent.
    pub fn fade(&mut self, opacity: f32, in_s: f32) {
        self.opacity.go(opacity.clamp(0.0, 1.0), in_s);
    }

    /// Marks it, or no longer.
    pub fn highlight(&mut self, on: bool) {
        self.mark.go(if on { 1.0 } else { 0.0 }, MARK_S);
    }

    /// So much later.
    pub fn pass(&mut self, seconds: f32) {
        self.layers.iter_mut().flatten().for_each(|layer| layer.amount.pass(seconds));
        self.opacity.pass(seconds);
        self.mark.pass(seconds);
        self.settle();
    }

    /// What is wholly covered is forgotten, and what has gone.
    fn settle(&mut self) {
        for layer in &mut self.layers {
            layer.take_if(|layer| layer.amount.to == 0.0 && layer.amount() == 0.0);
        }
        if self.layers[0].is_none() {
            self.layers.swap(0, 1);
        }
        if self.layers[1].as_ref().is_some_and(|upper| upper.amount() >= 1.0) {
            self.layers[0] = self.layers[1].take();
        }
    }

    /// How much of it is there, 0 to 1.
    #[must_use]
    pub fn opacity(&self) -> f32 {
        self.opacity.value()
    }

    /// How much it is marked, 0 to 1.
    #[must_use]
    pub fn mark(&self) -> f32 {
        self.mark.value()
    }

    /// The material that is on it or comes, and how far it has spread.
    #[must_use]
    pub fn material(&self) -> Option<(&str, f32)> {
        self.layers.iter().flatten().next_back().map(|layer| (layer.material.name.as_str(), layer.amount()))
    }

    /// Whether it wears nothing, and is going to wear nothing.
    #[must_use]
    pub fn is_bare(&self) -> bool {
        self.layers.iter().all(Option::is_none)
            && [(self.opacity, 1.0), (self.mark, 0.0)].iter().all(|(glide, end)| glide.value() == *end && glide.to == *end)
    }

    /// Whether any of its materials shines.
    #[must_use]
    pub fn shines(&self) -> bool {
        self.layers.iter().flatten().any(|layer| layer.material.metal > 0.0)
    }

    /// The material that is all there is of its colour, where nothing else is on it and nothing changes.
    #[must_use]
    pub fn coat(&self) -> Option<&Material> {
        match &self.layers {
            [Some(only), None] if only.amount() >= 1.0 => Some(&only.material),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn material(name: &str) -> Material {
        Material { name: name.to_owned(), albedo: [0.5; 3], grain: 0.0, metal: 0.0 }
    }

    #[test]
    fn a_material_spreads_over_the_one_before_and_takes_its_place() {
        let mut subject = Subject::default();
        assert!(subject.is_bare() && subject.material().is_none());
        subject.cover(material("ivory"), None, 2.0);
        assert_eq!(subject.material(), Some(("ivory", 0.0)));
        subject.pass(1.0);
        assert!((subject.material().unwrap().1 - 0.5).abs() < 1e-5 && subject.coat().is_none());
        subject.pass(1.5);
        assert_eq!((subject.material(), subject.coat().map(|coat| coat.name.as_str())), (Some(("ivory", 1.0)), Some("ivory")));
        subject.cover(material("gold"), Some(Vec3::ONE), 1.0);
        subject.pass(0.5);
        assert_eq!(subject.layers[0].as_ref().map(Layer::amount), Some(1.0), "ivory stays below");
        subject.pass(0.5);
        assert_eq!(subject.coat().map(|coat| coat.name.as_str()), Some("gold"));
        assert!(subject.layers[1].is_none() && !subject.is_bare());
        // asked for again it does not begin anew
        subject.cover(material("gold"), None, 5.0);
        assert_eq!(subject.material(), Some(("gold", 1.0)));
    }

    #[test]
    fn one_that_comes_at_once_is_there_at_once() {
        let mut subject = Subject::default();
        subject.cover(material("ivory"), None, 0.0);
        assert_eq!(subject.material(), Some(("ivory", 1.0)));
        subject.cover(material("gold"), None, 0.0);
        assert_eq!(subject.material(), Some(("gold", 1.0)));
    }

    #[test]
    fn a_third_covers_what_still_spreads() {
        let mut subject = Subject::default();
        ["wood", "ivory", "gold"].into_iter().for_each(|name| {
            subject.cover(material(name), None, 4.0);
            subject.pass(1.0);
        });
        let names: Vec<&str> = subject.layers.iter().flatten().map(|layer| layer.material.name.as_str()).collect();
        assert_eq!(names, ["ivory", "gold"]);
        subject.pass(9.0);
        assert_eq!(subject.coat().map(|coat| coat.name.as_str()), Some("gold"));
    }

    #[test]
    fn what_is_taken_off_goes_as_it_came_and_may_come_again() {
        let mut subject = Subject::default();
        subject.cover(material("gold"), None, 1.0);
        subject.pass(2.0);
        subject.bare(1.0);
        subject.pass(0.5);
        assert_eq!(subject.material(), Some(("gold", 0.5)));
        // put on again half way
        subject.cover(material("gold"), None, 1.0);
        subject.pass(1.0);
        assert_eq!(subject.material(), Some(("gold", 1.0)));
        subject.cover(material("ivory"), None, 4.0);
        subject.pass(1.0);
        subject.bare(1.0);
        subject.pass(1.0);
        assert!(subject.is_bare() && subject.material().is_none());
        // what was bare stays it
        subject.bare(1.0);
        assert!(subject.is_bare());
    }

    #[test]
    fn what_has_faded_and_come_back_is_bare() {
        let mut subject = Subject::default();
        subject.fade(0.0, 1.0);
        assert!(!subject.is_bare(), "it is going to fade");
        subject.pass(0.5);
        assert!((subject.opacity() - 0.5).abs() < 1e-5);
        // turned back half way
        subject.fade(1.0, 1.0);
        assert!((subject.opacity() - 0.5).abs() < 1e-5 && !subject.is_bare());
        subject.pass(2.0);
        assert!(subject.is_bare());
        subject.highlight(true);
        subject.pass(1.0);
        assert!(subject.mark() == 1.0 && !subject.is_bare());
        subject.highlight(false);
        subject.pass(1.0);
        assert!(subject.is_bare());
    }
}
