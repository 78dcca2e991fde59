//! How different two pictures look.

use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8, FlipPool, flip};

/// The mean FLIP error of two pictures of sRGB pixels, 0 to 1 (P. Andersson and others: "FLIP: A Difference Evaluator for Alternating Images", HPG 2020), at the authors' own distance from the
/// screen.
///
/// # Panics
/// If there are not `width * height` pixels in each.
#[must_use]
pub fn mean_flip(reference: &[[u8; 3]], test: &[[u8; 3]], width: u32, height: u32) -> f32 {
    assert!(
        [reference, test].iter().all(|pixels| pixels.len() == width as usize * height as usize),
        "two pictures of one size"
    );
    let image = |pixels: &[[u8; 3]]| FlipImageRgb8::with_data(width, height, pixels.as_flattened());
    FlipPool::from_image(&flip(image(reference), image(test), DEFAULT_PIXELS_PER_DEGREE)).mean()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_the_same_does_not_differ_and_black_from_white_does() {
        let [black, white] = [[0; 3], [255; 3]].map(|pixel| vec![pixel; 32 * 32]);
        assert!(mean_flip(&white, &white, 32, 32) < 1e-6);
        assert!(mean_flip(&black, &white, 32, 32) > 0.9);
    }
}
