//! The mathematics that every part of Heliodon shares: directions on the sphere, spherical harmonics, colour, units of
//! length and deterministic random numbers.
//!
//! Spaces: right-handed, metres, **+Y up, +X east, -Z north**. Directions to light point from the surface to the light.
//! Whatever ends up in a file is computed with [`libm`] and plain multiplications and additions, so that every platform
//! and every SIMD width stores the same bits.

pub mod color;
pub mod dome;
pub mod frame;
pub mod light_sphere;
pub mod random;
pub mod screen;
pub mod sh;
pub mod sphere;
pub mod unit;
pub mod visibility;

pub use glam;
