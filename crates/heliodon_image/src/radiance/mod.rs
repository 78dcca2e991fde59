//! Radiance pictures (.hdr, .pic): Ward, "Real Pixels", Graphics Gems II, 1991, and the Radiance reference manual.
//!
//! A component is `mantissa * 2^(exponent - 136)`, as most programs have it, so that 1.0 survives exactly; Radiance itself adds
//! half a step to the mantissa. Pixels are divided by `EXPOSURE` and `COLORCORR`, so that a series of pictures keeps one scale.

mod decode;
mod encode;
mod header;

pub(crate) use decode::decode;
pub(crate) use encode::encode;
