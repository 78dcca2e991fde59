//! Samples of many photographs to one colour, in two bands.
//!
//! Where photographs meet, their large patches of light are blended over a wide border and their detail over a narrow one (P. Burt, E. Adelson, "A
//! Multiresolution Spline with Application to Image Mosaics", ACM Transactions on Graphics 2(4), 1983, with two bands as M. Brown and D. Lowe use for
//! panoramas, 2007): a wide border alone would blur what two photographs show a pixel apart, a narrow one alone would show as a seam.

use super::layers::Sample;
use super::layout::Texel;
use glam::Vec3;

/// A face's texels of one photograph, on the face's rectangle.
struct Patch {
    /// Which texel of the rectangle each sample is.
    cells: Vec<usize>,
    colors: Vec<Vec3>,
    weights: Vec<f32>,
    low: Vec<Vec3>,
}

/// The rectangle about texels.
struct Grid {
    x: usize,
    y: usize,
    width: usize,
    height: usize,
}

impl Grid {
    fn around(texels: &[Texel]) -> Self {
        let fold = |(x0, y0, x1, y1): (u16, u16, u16, u16), t: &Texel| {
            (x0.min(t.at[0]), y0.min(t.at[1]), x1.max(t.at[0]), y1.max(t.at[1]))
        };
        let (x0, y0, x1, y1) = texels.iter().fold((u16::MAX, u16::MAX, 0, 0), fold);
        let (width, height) = (usize::from(x1 - x0) + 1, usize::from(y1 - y0) + 1);
        Self { x: x0.into(), y: y0.into(), width, height }
    }

    fn cell(&self, texel: &Texel) -> usize {
        (usize::from(texel.at[1]) - self.y) * self.width + usize::from(texel.at[0]) - self.x
    }
}

/// What is left of a word against which the others agree, at this difference in logarithms: half.
const DISSENT: f32 = 0.25;
/// Detail is taken from who is best: weights to this power.
const SHARPNESS: i32 = 6;

/// The colour of each of a face's texels that any photograph sees, all divided by their photograph's gain already. `first` is the number of the first
/// texel; `layers` have the face's samples only.
pub(super) fn blended(texels: &[Texel], first: usize, layers: &[&[Sample]], band_texels: usize) -> Vec<Option<Vec3>> {
    let mut result = vec![None; texels.len()];
    if layers.iter().all(|layer| layer.is_empty()) || texels.is_empty() {
        return result;
    }
    let grid = Grid::around(texels);
    let patch = |layer: &&[Sample]| {
        let cells: Vec<usize> = layer.iter().map(|s| grid.cell(&texels[s.texel as usize - first])).collect();
        let colors: Vec<Vec3> = layer.iter().map(|s| s.color).collect();
        let low = smoothed(&grid, &cells, &colors, band_texels);
        Patch { cells, colors, weights: layer.iter().map(|s| s.weight).collect(), low }
    };
    let mut patches: Vec<Patch> = layers.iter().filter(|layer| !layer.is_empty()).map(patch).collect();
    let cells = grid.width * grid.height;
    distrust(&mut patches, cells);
    // the best weight first, so that powers of weights stay in range whatever the unit
    let mut best = vec![0.0_f32; cells];
    for patch in &patches {
        patch.cells.iter().zip(&patch.weights).for_each(|(&cell, &weight)| best[cell] = best[cell].max(weight));
    }
    let mut sums = vec![(Vec3::ZERO, 0.0_f32, Vec3::ZERO, 0.0_f32); cells];
    for patch in &patches {
        for (i, &cell) in patch.cells.iter().enumerate() {
            if best[cell] > 0.0 {
                let wide = patch.weights[i] / best[cell];
                let narrow = (0..SHARPNESS).fold(1.0, |power, _| power * wide);
                let sum = &mut sums[cell];
                sum.0 += patch.low[i] * wide;
                sum.1 += wide;
                sum.2 += (patch.colors[i] - patch.low[i]) * narrow;
                sum.3 += narrow;
            }
        }
    }
    for (texel, result) in texels.iter().zip(&mut result) {
        let (low, wide, detail, narrow) = sums[grid.cell(texel)];
        *result = (wide > 0.0).then(|| (low / wide + detail / narrow).max(Vec3::ZERO));
    }
    result
}

/// Where three photographs or more see a texel, those count less that differ from the median: somebody who walked by, a branch that nobody modelled.
fn distrust(patches: &mut [Patch], cells: usize) {
    if patches.len() < 3 {
        return;
    }
    let log = |color: Vec3| color.max(Vec3::splat(1.0e-4)).map(libm::logf);
    let mut words: Vec<Vec<Vec3>> = vec![Vec::new(); cells];
    for patch in patches.iter() {
        for (i, &cell) in patch.cells.iter().enumerate().filter(|(i, _)| patch.weights[*i] > 0.0) {
            words[cell].push(log(patch.low[i]));
        }
    }
    let median = |words: &[Vec3], channel: usize| {
        let mut values: Vec<f32> = words.iter().map(|word| word[channel]).collect();
        values.sort_by(f32::total_cmp);
        let n = values.len();
        0.5 * (values[(n - 1) / 2] + values[n / 2])
    };
    let medians: Vec<Option<Vec3>> = words
        .iter()
        .map(|words| (words.len() >= 3).then(|| Vec3::new(median(words, 0), median(words, 1), median(words, 2))))
        .collect();
    for patch in patches {
        for (i, &cell) in patch.cells.iter().enumerate() {
            if let Some(median) = medians[cell] {
                let off = ((log(patch.low[i]) - median).abs().max_element() / DISSENT).min(100.0);
                patch.weights[i] /= 1.0 + off * off * off * off;
            }
        }
    }
}

/// The samples' mean about each of them over two boxes, of what is seen only.
fn smoothed(grid: &Grid, cells: &[usize], colors: &[Vec3], radius: usize) -> Vec<Vec3> {
    let mut sums = vec![glam::Vec4::ZERO; grid.width * grid.height];
    cells.iter().zip(colors).for_each(|(&cell, color)| sums[cell] = color.extend(1.0));
    for _ in 0..2 {
        box_sums(&mut sums, grid.width, 1, grid.height, grid.width, radius);
        box_sums(&mut sums, grid.height, grid.width, grid.width, 1, radius);
    }
    cells.iter().map(|&cell| sums[cell].truncate() / sums[cell].w.max(f32::MIN_POSITIVE)).collect()
}

/// Each value of lines becomes the sum of those no farther than `radius`. A line's values are `step` apart, lines `stride`.
fn box_sums(values: &mut [glam::Vec4], count: usize, step: usize, lines: usize, stride: usize, radius: usize) {
    let mut line = vec![glam::DVec4::ZERO; count + 1];
    for start in (0..lines).map(|line| line * stride) {
        for i in 0..count {
            line[i + 1] = line[i] + values[start + i * step].as_dvec4();
        }
        for i in 0..count {
            let sum = line[(i + radius + 1).min(count)] - line[i.saturating_sub(radius)];
            values[start + i * step] = sum.as_vec4();
        }
    }
}
