//! What lies beside a figure in its pictures: its own colours, going on.

use glam::Vec4;

/// A picture whose texels are `numbers`, each times how much of it counts, and that.
pub struct Counted<'a, const N: usize> {
    /// Sides.
    pub size: [usize; 2],
    /// Numbers times what counts.
    pub numbers: &'a mut [[Vec4; N]],
    /// What counts, 0 to 1.
    pub counts: &'a [f32],
}

/// Sides, and what its texels add up to, with how much of that counts.
type Summed<const N: usize> = ([usize; 2], Vec<([Vec4; N], f32)>);

/// Divides by what counts, and puts into what does not count the mean of what does around it: of the smallest square of 2, 4, 8 … texels of a side that has any (S. Gortler and others,
/// "The Lumigraph", SIGGRAPH 1996, section 3.4: pull and push).
pub fn fill<const N: usize>(Counted { size, numbers, counts }: Counted<'_, N>) {
    /// Less than this of a texel says nothing.
    const LEAST: f32 = 1.0 / 512.0;
    let mut levels: Vec<Summed<N>> = Vec::new();
    levels.push((size, numbers.iter().copied().zip(counts.iter().copied()).collect()));
    while let Some(([width, height], finer)) = levels.last().filter(|(size, _)| size[0] > 1 || size[1] > 1) {
        let half = [width.div_ceil(2), height.div_ceil(2)];
        let mut coarser = vec![([Vec4::ZERO; N], 0.0); half[0] * half[1]];
        for (i, (texel, count)) in finer.iter().enumerate() {
            let into = &mut coarser[i / width / 2 * half[0] + i % width / 2];
            into.0.iter_mut().zip(texel).for_each(|(into, texel)| *into += *texel);
            into.1 += count;
        }
        levels.push((half, coarser));
    }
    for k in (0..levels.len()).rev() {
        let (finer, coarser) = levels.split_at_mut(k + 1);
        let ([width, _], texels) = &mut finer[k];
        for (i, (texel, count)) in texels.iter_mut().enumerate() {
            if *count >= LEAST {
                let whole = 1.0 / *count;
                texel.iter_mut().for_each(|number| *number *= whole);
            } else if let Some(([wide, _], above)) = coarser.first() {
                *texel = above[i / *width / 2 * wide + i % *width / 2].0;
            }
        }
    }
    let filled = levels.swap_remove(0).1;
    numbers.iter_mut().zip(filled).for_each(|(number, (texel, _))| *number = texel);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_count_takes_what_does() {
        let (width, height) = (9, 7);
        let mut counts = vec![0.0; width * height];
        let mut numbers = vec![[Vec4::ZERO]; width * height];
        for (x, y, count, value) in [(2, 3, 1.0, 0.25), (3, 3, 0.5, 0.75)] {
            counts[y * width + x] = count;
            numbers[y * width + x] = [Vec4::splat(value * count)];
        }
        fill(Counted { size: [width, height], numbers: &mut numbers, counts: &counts });
        assert!((numbers[3 * width + 2][0].x - 0.25).abs() < 1e-6 && (numbers[3 * width + 3][0].x - 0.75).abs() < 1e-6);
        // between the two everywhere
        assert!(numbers.iter().all(|n| (0.249..0.751).contains(&n[0].x)));
        // their mean far away
        assert!((numbers[8][0].x - 0.625 / 1.5).abs() < 1e-5, "{}", numbers[8][0].x);
    }

    #[test]
    fn nothing_stays_nothing() {
        let mut numbers = vec![[Vec4::ZERO; 2]; 6];
        fill(Counted { size: [3, 2], numbers: &mut numbers, counts: &[0.0; 6] });
        assert!(numbers.iter().flatten().all(|n| *n == Vec4::ZERO));
    }
}
