//! Light in texels, for what is modelled with few polygons: charts, packing, lights and the texel solve.

pub mod lights;
