//! Places in scripts: `at(x, y, z)`, metres, +Y up.

use rhai::Engine;
use std::fmt;

/// A place or an offset of the world, metres: a script's `at(x, y, z)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spot(pub [f64; 3]);

impl Spot {
    pub(crate) fn from_world(place: [f32; 3]) -> Self {
        Self(place.map(f64::from))
    }

    /// As actions carry it.
    pub(crate) fn to_world(self) -> [f32; 3] {
        #[expect(clippy::cast_possible_truncation, reason = "a place in the scene, where f32 is what there is")]
        self.0.map(|number| number as f32)
    }

    pub(crate) fn distance(self, other: Self) -> f64 {
        let sum: f64 = (0..3).map(|i| (self.0[i] - other.0[i]) * (self.0[i] - other.0[i])).sum();
        sum.sqrt()
    }

    fn zip(self, other: Self, with: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|i| with(self.0[i], other.0[i])))
    }
}

impl fmt::Display for Spot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at({}, {}, {})", self.0[0], self.0[1], self.0[2])
    }
}

/// `x`, `y` and `z`, sums, differences and multiples of places.
pub(crate) fn register(engine: &mut Engine) {
    engine
        .register_type_with_name::<Spot>("place")
        .register_get_set("x", |spot: &mut Spot| spot.0[0], |spot: &mut Spot, value: f64| spot.0[0] = value)
        .register_get_set("y", |spot: &mut Spot| spot.0[1], |spot: &mut Spot, value: f64| spot.0[1] = value)
        .register_get_set("z", |spot: &mut Spot| spot.0[2], |spot: &mut Spot, value: f64| spot.0[2] = value)
        .register_set("x", |spot: &mut Spot, value: i64| spot.0[0] = value as f64)
        .register_set("y", |spot: &mut Spot, value: i64| spot.0[1] = value as f64)
        .register_set("z", |spot: &mut Spot, value: i64| spot.0[2] = value as f64)
        .register_fn("+", |a: Spot, b: Spot| a.zip(b, |a, b| a + b))
        .register_fn("-", |a: Spot, b: Spot| a.zip(b, |a, b| a - b))
        .register_fn("*", |a: Spot, b: f64| Spot(a.0.map(|a| a * b)))
        .register_fn("*", |a: Spot, b: i64| Spot(a.0.map(|a| a * b as f64)))
        .register_fn("==", |a: Spot, b: Spot| a == b)
        .register_fn("!=", |a: Spot, b: Spot| a != b)
        .register_fn("to_string", |spot: &mut Spot| spot.to_string())
        .register_fn("to_debug", |spot: &mut Spot| spot.to_string());
}
