//! Fills what no texel has: with what the nearest one has, ring after ring, so that around every chart lie its own values.

use glam::Vec3;
use heliodon_image::HdrImage;

/// Gives every pixel that is not known what the nearest known one has, over the fewest steps to one of eight neighbours; black where none is known.
pub(super) fn fill(image: &mut HdrImage, mut known: Vec<bool>) {
    let (width, height) = (image.width as usize, image.height as usize);
    image.pixels.iter_mut().zip(&known).filter(|(_, known)| !**known).for_each(|(pixel, _)| *pixel = Vec3::ZERO);
    let around = |at: usize| {
        let (x, y) = (at % width, at / width);
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        rows.flat_map(move |y| (x.saturating_sub(1)..(x + 2).min(width)).map(move |x| y * width + x))
    };
    // those that have somebody to give to
    let mut rim: Vec<usize> = (0..known.len()).filter(|&at| known[at] && around(at).any(|beside| !known[beside])).collect();
    while !rim.is_empty() {
        let mut next = Vec::new();
        for &at in &rim {
            for beside in around(at) {
                if !known[beside] {
                    (image.pixels[beside], known[beside]) = (image.pixels[at], true);
                    next.push(beside);
                }
            }
        }
        rim = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_take_what_is_nearest_and_the_known_stays() {
        let mut image = HdrImage::from_fn(13, 7, |x, _| if x < 4 { Vec3::ONE } else { Vec3::splat(3.0) });
        let known: Vec<bool> = (0..13 * 7).map(|i| (i % 13 < 3) || (i % 13 > 9)).collect();
        image.pixels.iter_mut().zip(&known).filter(|(_, known)| !**known).for_each(|(pixel, _)| *pixel = Vec3::splat(-9.0));
        fill(&mut image, known);
        for y in 0..7 {
            assert_eq!(
                (0..13).map(|x| image.pixel(x, y).x).collect::<Vec<_>>(),
                [[1.0; 6].as_slice(), &[1.0, 3.0], &[3.0; 5]].concat()
            );
        }
        let mut nothing = HdrImage::filled(5, 5, Vec3::ONE);
        fill(&mut nothing, vec![false; 25]);
        assert_eq!(nothing.pixels, [Vec3::ZERO; 25]);
    }
}
