//! sRGB pixels to the planes that H.264 takes: ITU-R BT.709 Y'CbCr, video range, 4:2:0.

use heliodon_image::SrgbImage;
use rayon::prelude::*;

/// A picture's planes; chroma has half the columns and half the rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Planes {
    /// Luma, 16 for black to 235 for white.
    pub y: Vec<u8>,
    /// Blue difference, 128 for grey.
    pub cb: Vec<u8>,
    /// Red difference, 128 for grey.
    pub cr: Vec<u8>,
}

/// Weights of red and blue in BT.709's luma.
const RED: f32 = 0.2126;
const BLUE: f32 = 0.0722;
const GREEN: f32 = 1.0 - RED - BLUE;

/// The planes of an image of even width and height.
///
/// Chroma lies where H.264 has it by default: on the even columns, half-way between two rows.
#[must_use]
pub fn planes(image: &SrgbImage) -> Planes {
    let (width, height) = (image.width as usize, image.height as usize);
    let y = image.pixels.par_iter().map(|&pixel| (16.5 + 219.0 * luma(rgb(pixel))) as u8).collect();
    let chroma: Vec<[u8; 2]> = (0..height / 2 * (width / 2))
        .into_par_iter()
        .map(|index| {
            let (column, row) = (index % (width / 2) * 2, index / (width / 2) * 2);
            let mut mean = [0.0; 3];
            for row in [row, row + 1] {
                // 1 2 1 around the even column, mirrored at the left edge
                for (column, weight) in [(column.max(1) - 1, 0.125), (column, 0.25), (column + 1, 0.125)] {
                    let colour = rgb(image.pixels[row * width + column]);
                    for channel in 0..3 {
                        mean[channel] += weight * colour[channel];
                    }
                }
            }
            let luma = luma(mean);
            let difference = |channel: f32, weight: f32| (128.5 + 224.0 * 0.5 * (channel - luma) / (1.0 - weight)) as u8;
            [difference(mean[2], BLUE), difference(mean[0], RED)]
        })
        .collect();
    let (cb, cr) = chroma.into_iter().map(|[cb, cr]| (cb, cr)).unzip();
    Planes { y, cb, cr }
}

fn rgb([r, g, b, _]: [u8; 4]) -> [f32; 3] {
    [r, g, b].map(|code| f32::from(code) / 255.0)
}

fn luma([r, g, b]: [f32; 3]) -> f32 {
    RED * r + GREEN * g + BLUE * b
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(pixel: [u8; 4]) -> Planes {
        planes(&SrgbImage { width: 4, height: 2, pixels: vec![pixel; 8] })
    }

    #[test]
    fn the_published_codes_come_out() {
        // BT.709, 8 bits: black, white and grey have no colour; the primaries of the standard's colour bars at 100 %.
        for (pixel, y, cb, cr) in [
            ([0, 0, 0, 255], 16, 128, 128),
            ([255, 255, 255, 255], 235, 128, 128),
            ([255, 0, 0, 255], 63, 102, 240),
            ([0, 255, 0, 255], 173, 42, 26),
            ([0, 0, 255, 255], 32, 240, 118),
        ] {
            let planes = flat(pixel);
            assert_eq!((planes.y[0], planes.cb[0], planes.cr[0]), (y, cb, cr), "{pixel:?}");
            assert_eq!((planes.y.len(), planes.cb.len(), planes.cr.len()), (8, 2, 2));
        }
    }
}
