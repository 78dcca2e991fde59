//! What is kept of each sky of a day, so that a day that was interrupted can go on.

use super::{Sink, SkyMap};
use crate::lapse::{Fitted, Sun};
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// What a day takes from one sky, a probe or a model's moment, beside its map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SkyRecord {
    /// Its sun.
    pub sun: Option<Sun>,
    /// Coefficients without the sun.
    pub sky: Vec<[f32; 3]>,
    /// What is shaded with, where that is something else.
    pub fitted: Option<Fitted>,
    /// Components that were NaN, infinite and negative, and were mended.
    pub repairs: [u64; 3],
    /// Whether its brightest spot is clipped and may be a sun, but too little is left of it to be taken for one.
    pub dim_spot: bool,
}

impl SkyRecord {
    pub(super) fn coefficients(&self) -> impl Iterator<Item = Vec3> {
        self.sky.iter().map(|&s| Vec3::from_array(s))
    }

    /// What it is shaded with: fitted or not.
    pub(super) fn shaded(&self) -> Fitted {
        self.fitted.clone().unwrap_or_else(|| Fitted { glow: [0.0; 3], sky: self.sky.clone() })
    }
}

/// Keeps the skies of a day as they are made; each is asked for before it is made.
pub trait SkyKeeper {
    /// What an earlier run of the same day kept of sky `number`, whose map has the index `map` where it has one.
    fn kept(&mut self, number: u32, map: Option<u32>) -> Option<SkyRecord>;

    /// Takes a sky that was made; what it answers with ends the work.
    ///
    /// # Errors
    /// Why it cannot be kept.
    fn keep(&mut self, number: u32, record: &SkyRecord, map: Option<SkyMap<'_>>) -> Result<(), String>;
}

/// Hands the maps on and keeps nothing.
pub(super) struct MapsOnly<'a>(pub Sink<'a>);

impl SkyKeeper for MapsOnly<'_> {
    fn kept(&mut self, _number: u32, _map: Option<u32>) -> Option<SkyRecord> {
        None
    }

    fn keep(&mut self, _number: u32, _record: &SkyRecord, map: Option<SkyMap<'_>>) -> Result<(), String> {
        map.map_or(Ok(()), |map| (self.0)(map))
    }
}
