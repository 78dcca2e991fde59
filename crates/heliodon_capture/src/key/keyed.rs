//! The image and the inverted mask.

use super::pyramid::fill;
use super::space::{code_from_linear, linear_from_code, linear_from_encoded};
use super::{Blending, Picture, ScreenKind};
use rayon::prelude::*;

/// A keyed frame: what the two passes draw.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Keyed {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` premultiplied pixels, encoded as [`Blending`] says; black where nothing is. The fourth component is `255 - mask`.
    pub image: Vec<[u8; 4]>,
    /// `width * height` numbers: 255 where nothing is, 0 where the foreground hides everything.
    pub mask: Vec<u8>,
}

/// Alpha below which a pixel's own colour is lost in rounding, and its neighbours' is taken.
const MIN_STRAIGHT: u8 = 24;

impl Keyed {
    /// A picture that carries its own straight alpha, as it is; where it was keyed before some `screen`, no more of that colour is left than of
    /// the others.
    #[must_use]
    pub fn of_alpha(picture: &Picture<'_>, screen: Option<ScreenKind>, blending: Blending) -> Self {
        let premultiplied = |[r, mut g, mut b, a]: [u8; 4]| {
            match screen {
                Some(ScreenKind::Green) => g = g.min(r.max(b)),
                Some(ScreenKind::Blue) => b = b.min(r.max(g)),
                Some(ScreenKind::Other) | None => {}
            }
            let alpha = f32::from(a) / 255.0;
            let [r, g, b] = [r, g, b].map(|code| match blending {
                Blending::Linear => code_from_linear(alpha * linear_from_code(code)),
                Blending::Encoded => (alpha * f32::from(code) + 0.5) as u8,
            });
            [r, g, b, a]
        };
        let image: Vec<[u8; 4]> = picture.pixels.par_iter().map(|&pixel| premultiplied(pixel)).collect();
        let mask = picture.pixels.par_iter().map(|pixel| 255 - pixel[3]).collect();
        Self { width: picture.width, height: picture.height, image, mask }
    }

    /// Whether sizes agree, the fourth component is what it should be, and nothing is brighter than its alpha lets it be.
    #[must_use]
    pub fn validate(&self, blending: Blending) -> bool {
        let count = self.width * self.height;
        let most: Vec<u8> = (0..=255_u8)
            .map(|alpha| match blending {
                Blending::Linear => code_from_linear(f32::from(alpha) / 255.0 + 0.5 / 255.0).saturating_add(1),
                Blending::Encoded => alpha.saturating_add(1),
            })
            .collect();
        self.image.len() == count
            && self.mask.len() == count
            && self.image.iter().zip(&self.mask).all(|(pixel, &mask)| {
                pixel[3] == 255 - mask && pixel[..3].iter().all(|&code| code <= most[usize::from(pixel[3])])
            })
    }

    /// Over a background of `(x, y)`, sRGB codes: `image + background * mask`.
    #[must_use]
    pub fn over(&self, blending: Blending, background: impl Fn(usize, usize) -> [u8; 3] + Sync) -> Vec<[u8; 4]> {
        let mut out = vec![[0, 0, 0, 255]; self.image.len()];
        out.par_chunks_mut(self.width.max(1)).enumerate().for_each(|(y, row)| {
            for (x, out) in row.iter_mut().enumerate() {
                let (image, behind) = (self.image[y * self.width + x], background(x, y));
                let share = f32::from(self.mask[y * self.width + x]) / 255.0;
                for c in 0..3 {
                    out[c] = match blending {
                        Blending::Linear => code_from_linear(linear_from_code(image[c]) + linear_from_code(behind[c]) * share),
                        Blending::Encoded => (f32::from(image[c]) + f32::from(behind[c]) * share + 0.5).min(255.0) as u8,
                    };
                }
            }
        });
        out
    }

    /// Straight colours with alpha, for formats that carry it: colours go on into what is transparent, so that codecs and scaling blur nothing dark
    /// into edges.
    #[must_use]
    pub fn straight(&self, blending: Blending) -> Vec<[u8; 4]> {
        let own = |[r, g, b, a]: [u8; 4]| {
            let alpha = f32::from(a.max(1)) / 255.0;
            [r, g, b].map(|code| match blending {
                Blending::Linear => (linear_from_code(code) / alpha).min(1.0),
                Blending::Encoded => linear_from_encoded(f32::from(code) / 255.0 / alpha),
            })
        };
        let cells = self.image.par_iter().map(|&p| (own(p), if p[3] >= MIN_STRAIGHT { 1.0 } else { 0.0 })).collect();
        let Some(grid) = fill(self.width, self.height, cells) else { return vec![[0; 4]; self.image.len()] };
        let joined = grid.colors.par_iter().zip(&self.mask);
        joined
            .map(|(color, mask)| {
                let [r, g, b] = color.map(code_from_linear);
                [r, g, b, 255 - mask]
            })
            .collect()
    }

    /// A larger frame with transparent columns at the right and rows below, for codecs that need even sides.
    #[must_use]
    pub fn padded(self, width: usize, height: usize) -> Self {
        let (width, height) = (width.max(self.width), height.max(self.height));
        if (width, height) == (self.width, self.height) {
            return self;
        }
        let (mut image, mut mask) = (vec![[0; 4]; width * height], vec![255; width * height]);
        for y in 0..self.height {
            image[y * width..][..self.width].copy_from_slice(&self.image[y * self.width..][..self.width]);
            mask[y * width..][..self.width].copy_from_slice(&self.mask[y * self.width..][..self.width]);
        }
        Self { width, height, image, mask }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alpha_is_taken_as_it_is_and_both_passes_give_the_blend() {
        let pixels: Vec<[u8; 4]> = (0..=255).map(|a| [200, 100, 50, a]).collect();
        let picture = Picture::new(16, 16, &pixels).unwrap();
        for blending in [Blending::Linear, Blending::Encoded] {
            let keyed = Keyed::of_alpha(&picture, None, blending);
            assert!(keyed.validate(blending));
            assert_eq!(
                (keyed.image[0], keyed.mask[0], keyed.image[255], keyed.mask[255]),
                ([0; 4], 255, [200, 100, 50, 255], 0)
            );
            let over = keyed.over(blending, |_, _| [30, 60, 200]);
            for (a, out) in over.iter().enumerate() {
                let alpha = a as f32 / 255.0;
                let blend = |own: u8, behind: u8| match blending {
                    Blending::Linear => {
                        code_from_linear(alpha * linear_from_code(own) + (1.0 - alpha) * linear_from_code(behind))
                    }
                    Blending::Encoded => (alpha * f32::from(own) + (1.0 - alpha) * f32::from(behind)).round() as u8,
                };
                for (out, want) in out.iter().zip([blend(200, 30), blend(100, 60), blend(50, 200)]) {
                    assert!(out.abs_diff(want) <= 1, "{blending:?} {a}: {out} {want}");
                }
            }
            let straight = keyed.straight(blending);
            assert!(straight.iter().enumerate().all(|(a, p)| usize::from(p[3]) == a));
            assert!(
                straight[40..].iter().all(|p| p[0].abs_diff(200) <= 4 && p[1].abs_diff(100) <= 4 && p[2].abs_diff(50) <= 4)
            );
            assert!(straight[0][0] > 150, "colours go on into what is transparent");
        }
        let padded = Keyed::of_alpha(&picture, None, Blending::Linear).padded(17, 18);
        assert_eq!((padded.width, padded.mask.len(), padded.mask[16], padded.image[16]), (17, 17 * 18, 255, [0; 4]));
        assert!(padded.validate(Blending::Linear));
        let green = [[90, 200, 60, 255]];
        let clean = Keyed::of_alpha(&Picture::new(1, 1, &green).unwrap(), Some(ScreenKind::Green), Blending::Linear);
        assert_eq!(clean.image, [[90, 90, 60, 255]]);
    }
}
