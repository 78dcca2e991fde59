//! Light in texels, for what is modelled with few polygons: charts, packing, lights and the texel solve.

pub mod charts;
mod cover;
pub mod lights;
pub mod packing;
pub mod refine;
pub mod seams;
pub mod solve;
pub mod texels;
pub mod unwrap;
