//! From models and films to what stands for people where they are not looked at closely.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`impostor`] | a model becomes pictures from many sides, which the hour's light falls on |
//! | [`key`] | a film before a blue or green screen becomes an image and an inverted mask |
//!
//! Functions here take meshes and pictures and return pictures; they open no file and print nothing. They use all of rayon's threads, and the
//! number of threads changes no bit of their results.

pub mod impostor;
pub mod key;
