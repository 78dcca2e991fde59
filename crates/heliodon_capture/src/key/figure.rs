//! The garbage matte: regions that are kept, and the largest figure.

use super::Region;

/// Which pixels lie in one of the regions.
pub(super) fn inside(regions: &[Region], width: usize, height: usize) -> Vec<bool> {
    let mut inside = vec![false; width * height];
    for region in regions {
        for y in 0..height {
            let crossings = crossings(&region.points, y as f32 + 0.5);
            for pair in crossings.chunks_exact(2) {
                // pixels whose centres lie between both
                let first = (pair[0] - 0.5).ceil().clamp(0.0, width as f32) as usize;
                let end = (pair[1] - 0.5).ceil().clamp(0.0, width as f32) as usize;
                if first < end {
                    inside[y * width + first..y * width + end].fill(true);
                }
            }
        }
    }
    inside
}

/// Where a polygon's sides cross a row, in order.
fn crossings(points: &[[f32; 2]], y: f32) -> Vec<f32> {
    let mut found: Vec<f32> = (0..points.len())
        .filter_map(|k| {
            let ([ax, ay], [bx, by]) = (points[k], points[(k + 1) % points.len()]);
            ((ay <= y) != (by <= y)).then(|| ax + (y - ay) / (by - ay) * (bx - ax))
        })
        .collect();
    found.sort_by(f32::total_cmp);
    found
}

/// Alpha below which nothing hangs together.
const LINK: f32 = 0.04;

/// Removes all but the figure with the largest sum of alpha; returns how much alpha went, in pixels.
pub(super) fn keep_largest(alpha: &mut [f32], width: usize) -> f32 {
    let mut label = vec![0_u32; alpha.len()];
    let (mut sums, mut open) = (vec![0.0_f64], Vec::new());
    for start in 0..alpha.len() {
        if label[start] != 0 || alpha[start] < LINK {
            continue;
        }
        let name = sums.len() as u32;
        let mut sum = 0.0;
        label[start] = name;
        open.push(start);
        while let Some(k) = open.pop() {
            sum += f64::from(alpha[k]);
            let (x, y) = (k % width, k / width);
            for other_y in y.saturating_sub(1)..(y + 2).min(alpha.len() / width) {
                for other_x in x.saturating_sub(1)..(x + 2).min(width) {
                    let other = other_y * width + other_x;
                    if label[other] == 0 && alpha[other] >= LINK {
                        label[other] = name;
                        open.push(other);
                    }
                }
            }
        }
        sums.push(sum);
    }
    // the first of equals, so that the choice is the same each time
    let largest = (1..sums.len()).fold(0, |best, k| if sums[k] > sums[best] { k } else { best }) as u32;
    let mut gone = 0.0;
    for (alpha, label) in alpha.iter_mut().zip(label) {
        if label != largest || largest == 0 {
            gone += *alpha;
            *alpha = 0.0;
        }
    }
    gone
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_cover_the_pixels_whose_centres_they_hold() {
        let count = |region: &Region| inside(std::slice::from_ref(region), 16, 16).iter().filter(|&&i| i).count();
        assert_eq!(count(&Region::rectangle(2.0, 3.0, 5.0, 4.0)), 20);
        assert_eq!(count(&Region::rectangle(-100.0, -100.0, 1000.0, 1000.0)), 256);
        assert_eq!(count(&Region { points: vec![[0.0, 0.0], [16.0, 0.0], [0.0, 16.0]] }), 120);
        assert_eq!(count(&Region { points: vec![[5.0, 5.0], [5.0, 5.0], [5.0, 5.0]] }), 0);
    }

    #[test]
    fn only_the_largest_figure_stays() {
        let mut alpha = vec![0.0; 20 * 10];
        for y in 2..8 {
            alpha[y * 20 + 3..y * 20 + 9].fill(1.0);
            alpha[y * 20 + 15] = 0.9;
        }
        let gone = keep_largest(&mut alpha, 20);
        assert!((gone - 5.4).abs() < 1e-4 && alpha.iter().sum::<f32>() == 36.0);
        assert_eq!(keep_largest(&mut [0.0; 4], 2), 0.0);
    }
}
