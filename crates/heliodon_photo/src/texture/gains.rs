//! Exposure and white balance: one factor for each photograph and colour, so that what two photographs show is as bright in both.
//!
//! Of each pair of photographs the median of the logarithm of their ratio over common texels is taken, which wrong places and moved things leave alone;
//! all pairs together give the photographs' factors by least squares. They are known up to a common factor, which is set for their mean to be 1.

use super::layers::Sample;
use crate::model::solved;
use glam::Vec3;
use rayon::prelude::*;

/// Texels that a pair's median is taken over, at most: its error is then a thousandth of the colours' scatter.
const MOST: usize = 40_000;
/// Fewer say nothing.
const FEWEST: usize = 16;
/// What ties a photograph to no change where no other shares a texel with it; next to a pair's weight of one or more it is nothing.
const TIE: f64 = 1.0e-7;

/// What was found of a photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct PhotoGain {
    /// The photograph.
    pub photograph: String,
    /// Its pixels are so many times as bright as the mean of all, for each colour.
    pub gain: Vec3,
    /// How far it then still is off the others, as a factor's logarithm: the median over pairs; 0 where there are none.
    pub residual: f32,
    /// Photographs that it could be compared with.
    pub compared_with: usize,
}

/// How two photographs differ.
struct Pair {
    photographs: [usize; 2],
    /// Median logarithm of the second's colour over the first's.
    ratio: [f64; 3],
    weight: f64,
}

fn pair(a: &[Sample], b: &[Sample], photographs: [usize; 2]) -> Option<Pair> {
    let (mut i, mut j) = (0, 0);
    let mut common: Vec<(Vec3, Vec3)> = Vec::new();
    while i < a.len() && j < b.len() {
        match a[i].texel.cmp(&b[j].texel) {
            std::cmp::Ordering::Less => i += 1,
            std::cmp::Ordering::Greater => j += 1,
            std::cmp::Ordering::Equal => {
                if a[i].tells && b[j].tells && a[i].color.min_element() > 0.0 && b[j].color.min_element() > 0.0 {
                    common.push((a[i].color, b[j].color));
                }
                (i, j) = (i + 1, j + 1);
            }
        }
    }
    if common.len() < FEWEST {
        return None;
    }
    let stride = common.len().div_ceil(MOST);
    let used: Vec<&(Vec3, Vec3)> = common.iter().step_by(stride).collect();
    let mut scatter = 0.0;
    let ratio = [0, 1, 2].map(|channel| {
        let mut logs: Vec<f64> =
            used.iter().map(|(a, b)| libm::log(f64::from(b[channel])) - libm::log(f64::from(a[channel]))).collect();
        let middle = median(&mut logs);
        logs.iter_mut().for_each(|x| *x = (*x - middle).abs());
        scatter += median(&mut logs) / 3.0;
        middle
    });
    // many texels that agree count more, but no pair so much that others do not
    let weight = (used.len() as f64).sqrt() / (0.02 + scatter);
    Some(Pair { photographs, ratio, weight })
}

fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The factors of all photographs, in their order.
pub(crate) fn gains(layers: &[Vec<Sample>], names: &[&str]) -> Vec<PhotoGain> {
    let n = layers.len();
    let couples: Vec<[usize; 2]> = (0..n).flat_map(|a| (a + 1..n).map(move |b| [a, b])).collect();
    let pairs: Vec<Pair> = couples.par_iter().filter_map(|&[a, b]| pair(&layers[a], &layers[b], [a, b])).collect();
    let of_channel = |channel: usize| {
        let (mut matrix, mut right) = (vec![0.0; n * n], vec![0.0; n]);
        (0..n).for_each(|i| matrix[i * n + i] = TIE);
        for Pair { photographs: [a, b], ratio, weight } in &pairs {
            matrix[a * n + a] += weight;
            matrix[b * n + b] += weight;
            matrix[a * n + b] -= weight;
            matrix[b * n + a] -= weight;
            right[*b] += weight * ratio[channel];
            right[*a] -= weight * ratio[channel];
        }
        solved(matrix, right).unwrap_or_else(|| vec![0.0; n])
    };
    let logs = [0, 1, 2].map(of_channel);
    let gain = |i: usize| {
        let of_photograph = pairs.iter().filter(|pair| pair.photographs.contains(&i));
        let off = |pair: &Pair| {
            let [a, b] = pair.photographs;
            let off = |channel: usize| (logs[channel][b] - logs[channel][a] - pair.ratio[channel]).abs();
            off(0).max(off(1)).max(off(2))
        };
        let mut residuals: Vec<f64> = of_photograph.map(off).collect();
        PhotoGain {
            photograph: names[i].to_string(),
            gain: Vec3::from(logs.each_ref().map(|of_channel| libm::exp(of_channel[i]) as f32)),
            residual: if residuals.is_empty() { 0.0 } else { median(&mut residuals) as f32 },
            compared_with: residuals.len(),
        }
    };
    (0..n).map(gain).collect()
}
