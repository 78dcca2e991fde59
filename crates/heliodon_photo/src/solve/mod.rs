//! Cameras and points from marks.

pub mod bundle;
mod five_point;
mod polynomial;
pub mod random;
mod resect;
mod triangulate;
mod two_view;
