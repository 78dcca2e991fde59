//! Skies: probe mappings, sun detection, solar position, sky models, the day lapse.

pub mod lapse;
