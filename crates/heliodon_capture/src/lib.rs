//! What is captured from pictures: people that were filmed before a screen.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`key`] | a film before a blue or green screen becomes an image and an inverted mask |
//!
//! Functions here take pictures as slices and return pictures; they open no file and print nothing. They use all of rayon's threads, and the
//! number of threads changes no bit of their results.

pub mod key;
