//! Keying: people filmed before a blue or green screen become the image and the inverted mask of
//!
//! > Papaioannou, Gaitatzes, Christopoulos, "Enhancing Virtual Reality Walkthroughs of Archaeological Sites", VAST 2003, section 2.2,
//!
//! which is drawn in two passes: `multiply by the mask, then add the image`. For any background these give `image + background * mask`, which is
//! exact where the image is *premultiplied* (black where nothing is) and the mask is `1 - alpha` (white where nothing is).
//!
//! # Which space
//!
//! The viewer composites in **linear light**, so what is stored is such that `linear(image) + linear(background) * mask` is right: `image` is the sRGB
//! encoding of `alpha * linear foreground`, `mask` is the plain number `255 * (1 - alpha)`, which is no colour and is not decoded. Passes over a
//! frame buffer of encoded values, as the paper's own, want [`Blending::Encoded`]: `alpha * encoded foreground`.
//! How foreground and screen were *mixed* on an edge is another matter ([`Mixing`]): light adds up in a lens, codes add up in
//! programs that compose, scale or sharpen pictures. Which of the two a film has is found from its edges.
//!
//! # The matte
//!
//! 1. The screen's colour: the strongest green or blue hue, most of all at the border; then a smooth map of it over the picture from several frames,
//!    holes under the actor filled from around them, and for each frame how much lighter or darker it is than that ([`plate`](Keyer)).
//! 2. The **colour difference** `d` of Vlahos ("Composite color photography", US patent 3,158,477, 1964; Smith and Blinn, "Blue Screen Matting",
//!    SIGGRAPH 1996, section 2): for a green screen `G - max(R, B)`. In the plane of colours that is a wedge of 120 degrees around green; turned onto the
//!    screen's own hue (van den Bergh and Lalioti, "Software chroma keying in an immersive virtual environment", South African Computer Journal 24,
//!    1999) it keys before any wall with a colour. `a0 = 1 - d / d(screen)`.
//! 3. `a0` is exact for foregrounds that are grey along the wedge's edge. Before anything else it hardens or softens edges: skin before green in linear
//!    light reads 0.87 where half of a pixel is covered. So where `a0` is sure, the foreground's colour F is spread over the edges (push-pull, Gortler
//!    et al. 1996), and at each of their pixels C = p F + q B is solved in least squares, B being the screen, with a weak pull to p + q = 1: F may be darker or
//!    lighter there than where it came from, its hue may not. `alpha = 1 - q`. Where that explains the pixel badly, `a0` stays.
//!    Films with fewer samples of colour than of brightness count brightness more.
//! 4. Black and white points lie where the screen's own noise ends; between them nothing is stretched.
//! 5. The image is `C - (1 - alpha) B`, less whatever is left of the screen's colour in it.
//!
//! Measured against known alpha in `tests/composites`; the figures stand in `docs/decisions/032-films.md`.

mod edges;
mod error;
mod figure;
mod keyed;
mod keyer;
mod matte;
mod mixing;
mod params;
mod plate;
mod pyramid;
mod screen;
mod space;
mod spill;

pub use error::KeyError;
pub use keyed::Keyed;
pub use keyer::{Keyer, Tally};
pub use params::{Blending, KeyParams, Mixing, Region, ScreenChoice};
pub use screen::{Screen, ScreenKind};

/// A picture: sRGB-encoded RGB and straight alpha, 8 bits, row-major from the top left.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` pixels.
    pub pixels: &'a [[u8; 4]],
}

impl<'a> Picture<'a> {
    /// A picture of pixels that are there.
    ///
    /// # Errors
    /// If it is empty, or its size and its pixels disagree.
    pub fn new(width: u32, height: u32, pixels: &'a [[u8; 4]]) -> Result<Self, KeyError> {
        let picture = Self { width: width as usize, height: height as usize, pixels };
        if pixels.is_empty() || pixels.len() != picture.width * picture.height {
            return Err(KeyError::Picture { width, height, pixels: pixels.len() });
        }
        Ok(picture)
    }
}
