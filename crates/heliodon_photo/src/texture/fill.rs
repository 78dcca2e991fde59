//! Colours between charts, where no surface is: what lies about them goes on smoothly, by pulling colours up a pyramid and pushing them back down
//! (S. Gortler et al., "The Lumigraph", SIGGRAPH 1996, section 3.6.3).

use glam::{Vec3, Vec4};

/// Fills what is none of a picture; all stays none where nothing is known.
pub(super) fn filled(pixels: &mut [Option<Vec3>], width: usize, height: usize) {
    if pixels.iter().all(Option::is_none) || pixels.iter().all(Option::is_some) {
        return;
    }
    let known: Vec<Vec4> = pixels.iter().map(|pixel| pixel.map_or(Vec4::ZERO, |color| color.extend(1.0))).collect();
    let mut levels = vec![(width, height, known)];
    while let Some((w, h, fine)) = levels.last().filter(|(w, h, _)| *w > 1 || *h > 1) {
        let (half_w, half_h) = (w.div_ceil(2), h.div_ceil(2));
        let mut coarse = vec![Vec4::ZERO; half_w * half_h];
        for y in 0..*h {
            for x in 0..*w {
                coarse[y / 2 * half_w + x / 2] += fine[y * w + x];
            }
        }
        // colours are kept times their weight, which is no more than 1
        coarse.iter_mut().for_each(|sum| *sum /= sum.w.max(1.0));
        levels.push((half_w, half_h, coarse));
    }
    for upper in (1..levels.len()).rev() {
        let (below, above) = levels.split_at_mut(upper);
        let (Some((w, h, fine)), Some((coarse_w, coarse_h, coarse))) = (below.last_mut(), above.first()) else { return };
        for y in 0..*h {
            for x in 0..*w {
                let weight = fine[y * *w + x].w;
                if weight < 1.0 {
                    let from_above = bilinear(coarse, *coarse_w, *coarse_h, x, y);
                    fine[y * *w + x] += from_above * ((1.0 - weight) / from_above.w.max(f32::MIN_POSITIVE));
                }
            }
        }
    }
    for (pixel, color) in pixels.iter_mut().zip(&levels[0].2) {
        if pixel.is_none() && color.w > 0.0 {
            *pixel = Some(color.truncate() / color.w);
        }
    }
}

/// A coarser level at a fine pixel's middle.
fn bilinear(coarse: &[Vec4], width: usize, height: usize, x: usize, y: usize) -> Vec4 {
    let taps = |fine: usize, count: usize| {
        let near = fine / 2;
        let far = if fine % 2 == 1 { (near + 1).min(count - 1) } else { near.saturating_sub(1) };
        (near, far)
    };
    let ((x0, x1), (y0, y1)) = (taps(x, width), taps(y, height));
    let at = |x: usize, y: usize| coarse[y * width + x];
    (at(x0, y0) * 0.75 + at(x1, y0) * 0.25) * 0.75 + (at(x0, y1) * 0.75 + at(x1, y1) * 0.25) * 0.25
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_take_the_colours_about_them_and_what_is_known_stays() {
        let (width, height) = (13, 9);
        let mut pixels: Vec<Option<Vec3>> = vec![None; width * height];
        filled(&mut pixels, width, height);
        assert!(pixels.iter().all(Option::is_none));
        let (red, blue) = (Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 0.0, 1.0));
        for y in 0..height {
            pixels[y * width] = Some(red);
            pixels[y * width + width - 1] = Some(blue);
        }
        filled(&mut pixels, width, height);
        for y in 0..height {
            let row: Vec<Vec3> = (0..width).map(|x| pixels[y * width + x].unwrap()).collect();
            assert!((row[0], row[width - 1]) == (red, blue));
            assert!(row.iter().all(|color| (color.x + color.z - 1.0).abs() < 1e-5 && color.y == 0.0), "{row:?}");
            assert!(row[2].x > 0.6 && row[width - 3].z > 0.6, "{row:?}");
        }
    }
}
