//! Cameras, models and textures from photographs. One program, so that what the tests share is compiled and linked once.

#![cfg(test)]

mod accuracy;
mod bundle;
mod castle;
mod castle_model;
mod colmap;
mod degenerate;
mod formats;
mod project;
mod temple;
