//! Photographs that Heliodon rendered, and what comes of them: cameras, a textured model, the stone's own colour.

#![cfg(test)]

mod albedo;
mod cameras;
mod project;
mod render;
mod temple;
mod view;
