//! The commands, one file each: raw arguments (`Args`), and `run`, which first makes a plan of them that holds together.

pub mod arrays;
pub mod bake;
pub mod bench;
pub mod check;
pub mod convert;
pub mod demo;
pub mod detail;
#[cfg(feature = "viewer")]
pub mod display;
pub mod export;
pub mod figures;
pub mod impostor;
pub mod inspect;
pub mod key;
pub mod lightmap;
pub mod merge;
pub mod new;
pub mod prepare;
#[cfg(feature = "viewer")]
pub mod render;
pub mod script;
pub mod sky;
pub mod sound;
#[cfg(feature = "viewer")]
pub mod view;
pub mod visibility;
