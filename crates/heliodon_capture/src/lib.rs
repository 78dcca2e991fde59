//! From models to what stands for them where they are not looked at closely.

pub mod impostor;
