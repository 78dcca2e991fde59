//! Radiance pictures (.hdr, .pic): Ward, "Real Pixels", Graphics Gems II, 1991, and the Radiance reference manual.
//!
//! A component is `mantissa * 2^(exponent - 136)`, as most programs have it, so that 1.0 survives exactly; Radiance itself adds
//! half a step to the mantissa. Pixels are divided by `EXPOSURE` and `COLORCORR`, so that a series of pictures keeps one scale.
//! `PRIMARIES` is not heeded: Photoshop writes eight zeros there, and what programs call RGB in these files is Rec. 709.

mod decode;
mod encode;
mod header;

pub(crate) use decode::decode;
pub(crate) use encode::encode;
