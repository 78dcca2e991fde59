//! Light in texels, for what is modelled with few polygons: charts, packing, lights, the texel solve and weathering.

pub mod charts;
pub mod lights;
pub mod packing;
pub mod parts;
pub mod refine;
pub mod seams;
pub mod solve;
pub mod texels;
pub mod unwrap;
pub mod walls;
pub mod weathering;
