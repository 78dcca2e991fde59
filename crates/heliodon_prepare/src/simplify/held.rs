//! Places at which vertices stay.

use glam::Vec3;

/// Places at which simplification leaves every vertex that a face uses, and with two neighbouring ones the edge between them: a border that another
/// mesh shares stays what it is on both sides.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Held(Vec<[u32; 3]>);

impl Held {
    /// None.
    pub const NOTHING: Self = Self(Vec::new());

    /// These places.
    pub fn new(places: impl IntoIterator<Item = Vec3>) -> Self {
        Self::of_bits(places.into_iter().map(place_bits).collect())
    }

    /// Those whose coordinates have these bits, as [`Held::bits`] tells them.
    #[must_use]
    pub fn of_bits(mut bits: Vec<[u32; 3]>) -> Self {
        bits.sort_unstable();
        bits.dedup();
        Self(bits)
    }

    /// The bits of their coordinates, in an order of their own: what tells one set of places from another.
    #[must_use]
    pub fn bits(&self) -> &[[u32; 3]] {
        &self.0
    }

    /// Whether there is no such place.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether a vertex stays that is at this place.
    #[must_use]
    pub fn holds(&self, place: Vec3) -> bool {
        !self.0.is_empty() && self.0.binary_search(&place_bits(place)).is_ok()
    }
}

/// The same for the same place: adding zero turns -0 into 0, which has other bits.
pub(crate) fn place_bits(place: Vec3) -> [u32; 3] {
    (place + Vec3::ZERO).to_array().map(f32::to_bits)
}
