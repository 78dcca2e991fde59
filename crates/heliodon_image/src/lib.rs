//! HDR and 8-bit images: read, write, resample.
//!
//! Pixels are row-major from the top left. HDR pixels are linear Rec. 709 radiance in any consistent unit.
//!
//! What the `image` crate does not do for Radiance pictures is done here, in the module `radiance`: XYZE, `EXPOSURE` and `COLORCORR`,
//! the seven other orientations, files that begin with `#?RGBE`, and writing with run lengths. OpenEXR goes through the `exr`
//! crate, PNG and JPEG through `image`, TIFF through `tiff`, TGA through a module of its own. [`ktx2`] holds textures of numbers, [`texture`] makes them of pictures,
//! [`view_layers`] are what several photographs saw of a surface.

mod bc6h;
mod bc7;
mod contact_sheet;
pub mod detail;
mod error;
mod hdr_image;
pub mod ktx2;
mod openexr;
mod picture;
mod primaries;
mod radiance;
mod resample;
mod rgbe;
mod srgb_image;
pub mod texture;
mod texture_wrap;
mod tga;
mod tiff;
pub mod view_layers;

pub use bc6h::{Bc6h, decode_bc6h, encode_bc6h};
pub use bc7::{Bc7Quality, decode_bc7, encode_bc7};
pub use contact_sheet::{SheetLayout, contact_sheet};
pub use error::ImageError;
pub use hdr_image::{HdrImage, PixelRepairs};
pub use ktx2::{ktx2_bc6h, ktx2_of_bc6h};
pub use openexr::ExrSamples;
pub use picture::{Picture, PictureFile};
pub use resample::Wrap;
pub use rgbe::{from_rgbe8, rgbe8, rgbe8_step};
pub use srgb_image::SrgbImage;
pub use texture_wrap::TextureWrap;

/// The most pixels that an HDR image may have: 16,384 x 8,192, a probe of 16k (1.6 GB in memory as floats).
pub const MAX_PIXELS: u64 = 1 << 27;

/// The most pixels that an 8-bit image may have: 16,384 x 16,384, the largest atlas that programs for photogrammetry write (1 GB in
/// memory).
pub const MAX_SRGB_PIXELS: u64 = 1 << 28;
