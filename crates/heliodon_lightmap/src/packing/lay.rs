//! Laying charts at one scale.

use super::mask::{INSET, Mask};
use super::sheet::Sheet;
use super::{PackParams, Placement, turned};
use crate::charts::Chart;
use glam::{Vec2, Vec3};
use std::cmp::Reverse;

/// A chart's triangles in its own coordinates.
pub(super) struct Shape {
    triangles: Vec<[Vec2; 3]>,
    pub area: f64,
    size: Vec2,
}

impl Shape {
    pub fn new(chart: &Chart, corners: &impl Fn(u32) -> [Vec3; 3]) -> Self {
        let triangles: Vec<[Vec2; 3]> = chart.triangles.iter().map(|&t| corners(t).map(|p| chart.coordinates(p))).collect();
        let area = triangles.iter().map(|[a, b, c]| f64::from(0.5 * (b - a).perp_dot(c - a).abs())).sum();
        let (low, high) =
            triangles.iter().flatten().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
        Self { triangles, area, size: (high - low).max(Vec2::ZERO) }
    }

    /// Its mask at a scale, turned, and what then is to be added to its coordinates for the mask's least corner to be at zero.
    pub fn mask(&self, scale: f32, quarters: u8, most: u32) -> Option<(Mask, Vec2)> {
        let mut triangles: Vec<[Vec2; 3]> = self.triangles.iter().map(|t| t.map(|p| turned(p * scale, quarters))).collect();
        let low = triangles.iter().flatten().fold(Vec2::INFINITY, |low, p| low.min(*p));
        let offset = Vec2::splat(INSET) - low;
        triangles.iter_mut().flatten().for_each(|p| *p += offset);
        Some((Mask::new(&triangles, most)?, offset))
    }
}

/// What comes of laying.
pub(super) enum Laid {
    /// All charts, and where they lie.
    All(Vec<Placement>),
    /// What is left is so small and so little that it will find room.
    Likely,
    /// There was no room for one.
    No,
}

/// Charts are small that are no longer than this part of a texture's side ...
const SMALL_PART: f32 = 1.0 / 64.0;
/// ... and find room if together they take no more than this part of what is free.
const LIKELY: f64 = 0.7;

/// Lays all shapes at a scale. `demand` has the texels that each will take; with it, laying ends as soon as it is likely what comes of it.
pub(super) fn lay(shapes: &[Shape], scale: f32, params: &PackParams, demand: Option<&[f64]>) -> Laid {
    let PackParams { width, height, margin, .. } = *params;
    let longest = |i: &usize| shapes[*i].size.max_element() * scale;
    let mut order: Vec<usize> = (0..shapes.len()).collect();
    order.sort_by_key(|i| (Reverse(longest(i).ceil() as u64), Reverse((shapes[*i].area * 1e6) as u64), *i));
    let mut left: f64 = demand.map_or(0.0, |demand| demand.iter().sum());
    let most_sheets = params.sheets.max(1);
    let mut sheets = vec![Sheet::new(width, height)];
    let mut placements = vec![Placement { sheet: 0, quarters: 0, offset: Vec2::ZERO }; shapes.len()];
    for index in order {
        if let Some(demand) = demand {
            let unused = (most_sheets - sheets.len() as u32) as f64 * f64::from(width) * f64::from(height);
            let free = sheets.iter().map(|sheet| sheet.free() as f64).sum::<f64>() + unused;
            if left > free {
                return Laid::No;
            }
            if longest(&index) <= SMALL_PART * width.min(height) as f32 && left <= LIKELY * free {
                return Laid::Likely;
            }
            left -= demand[index];
        }
        let mut masks: Vec<(u8, Mask, Vec2)> = Vec::with_capacity(4);
        for quarters in 0..4 {
            if let Some((mask, offset)) = shapes[index].mask(scale, quarters, width.max(height))
                && masks.iter().all(|(_, other, _)| *other != mask)
            {
                masks.push((quarters, mask, offset));
            }
        }
        let mut sheet = 0;
        let (place, quarters, offset, mask) = loop {
            let found = masks.iter().filter_map(|(quarters, mask, offset)| {
                let place = sheets[sheet as usize].find(mask)?;
                Some((place, *quarters, *offset, mask))
            });
            match found.min_by_key(|([x, y], quarters, _, mask)| (y + mask.height, *x, *quarters)) {
                Some(found) => break found,
                None if sheet + 1 < most_sheets => {
                    sheet += 1;
                    if sheets.len() <= sheet as usize {
                        sheets.push(Sheet::new(width, height));
                    }
                }
                None => return Laid::No,
            }
        };
        sheets[sheet as usize].put(mask, place, margin);
        let [x, y] = place.map(|x| x as f32);
        placements[index] = Placement { sheet, quarters, offset: offset + Vec2::new(x, y) };
    }
    Laid::All(placements)
}
