//! Laying charts at one scale.

use super::bitmap::{Bitmap, INSET};
use super::inner::Inner;
use super::mask::Mask;
use super::sheet::Sheet;
use super::{PackParams, Placement};
use glam::Vec2;
use std::cmp::Reverse;

/// A chart's triangles in its own coordinates.
pub(super) struct Shape {
    triangles: Vec<[Vec2; 3]>,
    pub area: f64,
    low: Vec2,
    size: Vec2,
}

/// A mask, by how many quarters it is turned, and what then is to be added to its chart's coordinates for the mask's least corner to be at zero.
pub(super) struct Turned {
    mask: Mask,
    quarters: u8,
    offset: Vec2,
}

impl Shape {
    pub fn new(triangles: Vec<[Vec2; 3]>) -> Self {
        let area = triangles.iter().map(|[a, b, c]| f64::from(0.5 * (b - a).perp_dot(c - a).abs())).sum();
        let (low, high) =
            triangles.iter().flatten().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
        Self { triangles, area, low, size: (high - low).max(Vec2::ZERO) }
    }

    /// Whether it can be laid.
    pub fn is_finite(&self) -> bool {
        self.area.is_finite() && self.low.is_finite() && self.size.is_finite()
    }

    /// Its texels at a scale, and what then is to be added to its coordinates.
    pub fn bitmap(&self, scale: f32, most: u32) -> Option<(Bitmap, Vec2)> {
        let offset = Vec2::splat(INSET) - self.low * scale;
        let triangles: Vec<[Vec2; 3]> = self.triangles.iter().map(|t| t.map(|p| p * scale + offset)).collect();
        Some((Bitmap::new(&triangles, most)?, offset))
    }

    /// Its masks at a scale, turned by quarters, but for those that are the same.
    fn masks(&self, scale: f32, most: u32) -> Vec<Turned> {
        let Some((bitmap, offset)) = self.bitmap(scale, most) else { return Vec::new() };
        let [width, height] = [bitmap.width, bitmap.height].map(|side| side as f32);
        let upright = Mask::new(&bitmap);
        let inner = Inner::of(&bitmap, &upright);
        let sideways = if upright.is_full() { Mask::full(bitmap.height, bitmap.width) } else { Mask::new(&bitmap.turned()) };
        // a mask turns about its middle, so texels stay texels
        let offsets = [
            offset,
            offset.perp() + Vec2::new(height, 0.0),
            Vec2::new(width, height) - offset,
            Vec2::new(0.0, width) - offset.perp(),
        ];
        let over = [upright.upside_down(), sideways.upside_down()];
        let mut turned: Vec<Turned> = Vec::with_capacity(4);
        let [over_upright, over_sideways] = over;
        let mut inner = inner;
        for (quarters, (mask, offset)) in [upright, sideways, over_upright, over_sideways].into_iter().zip(offsets).enumerate()
        {
            let (of_mask, below) = (inner, mask.height);
            inner = inner.turned(below);
            let mask = mask.with_inner(of_mask);
            if turned.iter().all(|other| !other.mask.is_alike(&mask)) {
                turned.push(Turned { mask, quarters: quarters as u8, offset });
            }
        }
        turned
    }
}

/// What comes of laying.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Laid {
    /// All charts lie.
    All,
    /// What is left is so small and so little that it will find room.
    Likely,
    /// There was no room for one.
    No,
}

/// Charts are small that are no longer than this part of a texture's side ...
const SMALL_PART: f32 = 1.0 / 64.0;
/// ... and find room if together they take no more than this part of what is free.
const LIKELY: f64 = 0.7;

/// Charts while they are laid at a scale.
pub(super) struct Laying<'a> {
    shapes: &'a [Shape],
    pub scale: f32,
    params: &'a PackParams,
    /// All shapes, the longest first, and how many of them lie.
    order: Vec<usize>,
    done: usize,
    sheets: Vec<Sheet>,
    pub placements: Vec<Placement>,
}

impl<'a> Laying<'a> {
    pub fn new(shapes: &'a [Shape], scale: f32, params: &'a PackParams) -> Self {
        let longest = |i: &usize| f64::from(shapes[*i].size.max_element()) * f64::from(scale);
        let mut order: Vec<usize> = (0..shapes.len()).collect();
        order.sort_by_cached_key(|i| (Reverse(longest(i).ceil() as u64), Reverse((shapes[*i].area * 1e6) as u64), *i));
        let placements = vec![Placement { sheet: 0, quarters: 0, offset: Vec2::ZERO }; shapes.len()];
        Self { shapes, scale, params, order, done: 0, sheets: vec![Sheet::new(params.width, params.height)], placements }
    }

    /// Lays those that are left. `demand` has the texels that each will take; with it, laying ends as soon as it is likely what comes of it.
    pub fn run(&mut self, demand: Option<&[f64]>) -> Laid {
        let sheet_texels = f64::from(self.params.width) * f64::from(self.params.height);
        let small = SMALL_PART * self.params.width.min(self.params.height) as f32;
        let mut left: f64 = demand.map_or(0.0, |demand| self.order[self.done..].iter().map(|i| demand[*i]).sum());
        while let Some(&index) = self.order.get(self.done) {
            if let Some(demand) = demand {
                let unused = (self.params.sheets - self.sheets.len() as u32) as f64 * sheet_texels;
                let free = self.sheets.iter().map(|sheet| sheet.free() as f64).sum::<f64>() + unused;
                if left > free {
                    return Laid::No;
                }
                if self.shapes[index].size.max_element() * self.scale <= small && left <= LIKELY * free {
                    return Laid::Likely;
                }
                left -= demand[index];
            }
            if !self.lay(index) {
                return Laid::No;
            }
            self.done += 1;
        }
        Laid::All
    }

    /// Lays a shape in the first sheet that has room, turned so that it ends lowest. Whether one has.
    fn lay(&mut self, index: usize) -> bool {
        let PackParams { width, height, margin, sheets, .. } = *self.params;
        let masks = self.shapes[index].masks(self.scale, width.max(height));
        for number in 0..sheets as usize {
            if self.sheets.len() <= number {
                self.sheets.push(Sheet::new(width, height));
            }
            let sheet = &mut self.sheets[number];
            let mut best: Option<([u32; 3], &Turned)> = None;
            for turned in &masks {
                let lowest = best.map_or(height, |([end, ..], _)| end);
                let Some(last) = lowest.checked_sub(turned.mask.height) else { continue };
                if let Some([x, y]) = sheet.find(&turned.mask, last)
                    && best.is_none_or(|([end, left, _], _)| (y + turned.mask.height, x) < (end, left))
                {
                    best = Some(([y + turned.mask.height, x, y], turned));
                }
            }
            if let Some(([_, x, y], Turned { mask, quarters, offset })) = best {
                sheet.put(mask, [x, y], margin);
                let offset = *offset + Vec2::new(x as f32, y as f32);
                self.placements[index] = Placement { sheet: number as u32, quarters: *quarters, offset };
                return true;
            }
        }
        false
    }
}
