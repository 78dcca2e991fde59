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

/// Numbers what hangs together of the pixels that are `linked`, from 1 on, 0 for the others; and how many numbers there are, 0 included.
fn labels(count: usize, width: usize, linked: impl Fn(usize) -> bool) -> (Vec<u32>, usize) {
    let mut label = vec![0_u32; count];
    let (mut names, mut open) = (1, Vec::new());
    for start in 0..count {
        if label[start] != 0 || !linked(start) {
            continue;
        }
        label[start] = names;
        open.push(start);
        while let Some(k) = open.pop() {
            let (x, y) = (k % width, k / width);
            for other_y in y.saturating_sub(1)..(y + 2).min(count / width) {
                for other_x in x.saturating_sub(1)..(x + 2).min(width) {
                    let other = other_y * width + other_x;
                    if label[other] == 0 && linked(other) {
                        label[other] = names;
                        open.push(other);
                    }
                }
            }
        }
        names += 1;
    }
    (label, names as usize)
}

/// Removes all but the figure with the largest sum of alpha; returns how much alpha went, in pixels.
pub(super) fn keep_largest(alpha: &mut [f32], width: usize) -> f32 {
    let (label, names) = labels(alpha.len(), width, |k| alpha[k] >= LINK);
    let mut sums = vec![0.0_f64; names];
    alpha.iter().zip(&label).filter(|(_, label)| **label != 0).for_each(|(&a, &label)| sums[label as usize] += f64::from(a));
    // the first of equals, so that the choice is the same each time
    let largest = (1..names).fold(0, |best, k| if sums[k] > sums[best] { k } else { best }) as u32;
    let mut gone = 0.0;
    for (alpha, label) in alpha.iter_mut().zip(label) {
        if label != largest || largest == 0 {
            gone += *alpha;
            *alpha = 0.0;
        }
    }
    gone
}

/// What is this opaque encloses.
const OPAQUE: f32 = 0.98;
/// The largest hole that is closed: one pixel in so many. A hand at arm's length, filmed in full, has about as many.
const HOLE: usize = 400;

/// Closes small holes in what is opaque, if none of their pixels looks like screen: highlights and glasses, not the gap beside an arm.
pub(super) fn close_holes(alpha: &mut [f32], width: usize, is_screen: impl Fn(usize) -> bool) {
    let height = alpha.len() / width;
    let (label, names) = labels(alpha.len(), width, |k| alpha[k] < OPAQUE);
    let mut sizes = vec![0_usize; names];
    for (k, &label) in label.iter().enumerate() {
        let (x, y) = (k % width, k / width);
        let open = x == 0 || y == 0 || x + 1 == width || y + 1 == height || is_screen(k);
        let size = &mut sizes[label as usize];
        *size = if open { usize::MAX } else { size.saturating_add(1) };
    }
    for (alpha, label) in alpha.iter_mut().zip(label) {
        if label != 0 && sizes[label as usize] <= width * height / HOLE {
            *alpha = 1.0;
        }
    }
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

    #[test]
    fn highlights_are_closed_and_gaps_are_not() {
        let mut alpha = vec![1.0; 60 * 60];
        for (x, y) in [(10, 10), (10, 11), (30, 30), (0, 40)] {
            alpha[y * 60 + x] = 0.4;
        }
        alpha[40 * 60 + 20..40 * 60 + 40].fill(0.5);
        close_holes(&mut alpha, 60, |k| k == 30 * 60 + 30);
        let left = |x: usize, y: usize| alpha[y * 60 + x] < 1.0;
        assert!(!left(10, 10) && !left(10, 11), "closed");
        assert!(left(30, 30) && left(0, 40) && left(25, 40), "screen shows, open to the border, too large");
    }
}
