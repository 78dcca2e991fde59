//! Where the sun reaches within a box: a depth map as the sun sees it, drawn on the processor.
//!
//! Dust shows the sun's beams only if their edges are there, and a light grid's points stand too far apart for the beam of a window. Rays would
//! do it one by one; but thousands of motes share one direction, and 39,000 triangles are drawn into such a map in the time of some hundred rays. It holds for
//! one direction of the sun, and knows which.

use crate::stage::ground::Ground;
use glam::{UVec2, Vec2, Vec3};
use heliodon_math::frame::orthonormal_basis;

/// The width of a texel where the box is not too large for it, metres.
const TEXEL_M: f32 = 0.025;
/// Texels along a side at most.
pub const MOST_TEXELS: u32 = 256;
/// How much nearer to the sun something must be to shade, as a part of a texel: a surface at 45 degrees spans as much within one.
const BIAS_TEXELS: f32 = 1.5;
/// Depth of a texel before which nothing stands.
pub(super) const OPEN: f32 = -1e30;

/// What stands between a box and the sun.
#[derive(Clone, Debug, PartialEq)]
pub struct SunMap {
    /// Unit direction to the sun.
    pub sun: Vec3,
    /// Across it, to the right and up.
    right: Vec3,
    up: Vec3,
    /// Of the first texel's outer corner along those.
    corner: Vec2,
    texel_m: f32,
    size: UVec2,
    /// Metres along `sun` of what stands nearest to it, row by row.
    depths: Vec<f32>,
}

impl SunMap {
    /// The map of the box from `low` to `high` under a sun in the unit direction `sun`.
    #[must_use]
    pub fn new(ground: &Ground, (low, high): (Vec3, Vec3), sun: Vec3) -> Self {
        let (right, up) = orthonormal_basis(sun);
        let (least, most) = extent(low, high, [right, up]);
        let sides = most - least;
        let texel_m = TEXEL_M.max(sides.max_element() / (MOST_TEXELS - 2) as f32);
        // one more at each side, which the four around a place may need
        let size = ((sides / texel_m).ceil().as_uvec2() + 2).min(UVec2::splat(MOST_TEXELS));
        let corner = least - texel_m;
        let mut map = Self { sun, right, up, corner, texel_m, size, depths: vec![OPEN; (size.x * size.y) as usize] };
        let lowest = Vec3::select(sun.cmpgt(Vec3::ZERO), low, high).dot(sun);
        map.draw(ground, lowest);
        map
    }

    /// Draws what rises above `lowest` towards the sun.
    fn draw(&mut self, ground: &Ground, lowest: f32) {
        let whole = (self.corner, self.corner + self.size.as_vec2() * self.texel_m);
        for chunk in ground.chunks() {
            let (low, high) = chunk.bounds;
            let (least, most) = extent(low, high, [self.right, self.up]);
            let highest = Vec3::select(self.sun.cmpgt(Vec3::ZERO), high, low).dot(self.sun);
            if !(least.cmple(whole.1).all() && most.cmpge(whole.0).all() && highest >= lowest) {
                continue;
            }
            for cluster in &chunk.clusters {
                let center = Vec2::new(cluster.center.dot(self.right), cluster.center.dot(self.up));
                let off = (center - center.clamp(whole.0, whole.1)).length();
                if off > cluster.radius || cluster.center.dot(self.sun) + cluster.radius < lowest {
                    continue;
                }
                let range = cluster.indices.start as usize..cluster.indices.end as usize;
                for triangle in chunk.indices[range].chunks_exact(3) {
                    self.draw_triangle([0, 1, 2].map(|k| chunk.positions[usize::from(triangle[k])]));
                }
            }
        }
    }

    fn draw_triangle(&mut self, corners: [Vec3; 3]) {
        let placed = corners.map(|p| (Vec2::new(p.dot(self.right), p.dot(self.up)) - self.corner) / self.texel_m);
        let depths = corners.map(|p| p.dot(self.sun));
        let [a, b, c] = placed;
        let area = (b - a).perp_dot(c - a);
        if !area.is_normal() {
            return;
        }
        let last = self.size.as_vec2() - 1.0;
        let low = (a.min(b).min(c) - 0.5).ceil().max(Vec2::ZERO);
        let high = (a.max(b).max(c) - 0.5).floor().min(last);
        if !(low.x <= high.x && low.y <= high.y) {
            return;
        }
        let (low, high) = (low.as_uvec2(), high.as_uvec2());
        for y in low.y..=high.y {
            for x in low.x..=high.x {
                let at = Vec2::new(x as f32, y as f32) + 0.5;
                let (of_c, of_b) = ((b - a).perp_dot(at - a) / area, (at - a).perp_dot(c - a) / area);
                let of_a = 1.0 - of_b - of_c;
                if of_a >= 0.0 && of_b >= 0.0 && of_c >= 0.0 {
                    let depth = of_a * depths[0] + of_b * depths[1] + of_c * depths[2];
                    let texel = &mut self.depths[(y * self.size.x + x) as usize];
                    *texel = texel.max(depth);
                }
            }
        }
    }

    /// The part of the sun that reaches a place, 0 to 1, between the four texels around it. Beside the box the sun shines.
    #[must_use]
    pub fn at(&self, place: Vec3) -> f32 {
        let at = (Vec2::new(place.dot(self.right), place.dot(self.up)) - self.corner) / self.texel_m - 0.5;
        if !(at.cmpge(Vec2::ZERO).all() && at.cmplt(self.size.as_vec2() - 1.0).all()) {
            return 1.0;
        }
        let depth = place.dot(self.sun) + BIAS_TEXELS * self.texel_m;
        let (low, part) = (at.as_uvec2(), at.fract());
        let lit = |x: u32, y: u32| f32::from(depth >= self.depths[((low.y + y) * self.size.x + low.x + x) as usize]);
        let across = |y: u32| lit(0, y) + (lit(1, y) - lit(0, y)) * part.x;
        across(0) + (across(1) - across(0)) * part.y
    }

    /// Whether any of the sun reaches what is within `radius` of a place, as far as a few samples tell.
    #[must_use]
    pub fn reaches(&self, place: Vec3, radius: f32) -> bool {
        const SIDES: [Vec2; 9] = [
            Vec2::ZERO,
            Vec2::new(0.5, 0.0),
            Vec2::new(-0.5, 0.0),
            Vec2::new(0.0, 0.5),
            Vec2::new(0.0, -0.5),
            Vec2::new(0.7, 0.7),
            Vec2::new(-0.7, 0.7),
            Vec2::new(0.7, -0.7),
            Vec2::new(-0.7, -0.7),
        ];
        SIDES.iter().any(|side| self.at(place + (self.right * side.x + self.up * side.y) * radius) > 0.0)
    }

    /// Texels along both sides.
    #[must_use]
    pub fn size(&self) -> UVec2 {
        self.size
    }

    /// Depths, row by row.
    #[must_use]
    pub fn depths(&self) -> &[f32] {
        &self.depths
    }

    /// Rows that take a place to texels, counted from their middles, and to the depth that is compared with [`Self::depths`].
    #[must_use]
    pub fn texels_from_world(&self) -> [glam::Vec4; 3] {
        let row = |axis: Vec3, corner: f32| (axis / self.texel_m).extend(-corner / self.texel_m - 0.5);
        [row(self.right, self.corner.x), row(self.up, self.corner.y), self.sun.extend(BIAS_TEXELS * self.texel_m)]
    }
}

/// Least and greatest coordinates of a box along two axes.
fn extent(low: Vec3, high: Vec3, axes: [Vec3; 2]) -> (Vec2, Vec2) {
    let (center, half) = ((low + high) * 0.5, (high - low) * 0.5);
    let [x, y] = axes;
    let middle = Vec2::new(center.dot(x), center.dot(y));
    let reach = Vec2::new(half.dot(x.abs()), half.dot(y.abs()));
    (middle - reach, middle + reach)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::daylight::chunk::KeptChunk;
    use crate::daylight::cluster::cluster;
    use heliodon_math::frame::unit_or;
    use heliodon_math::random::Pcg32;
    use std::sync::Arc;

    /// A ceiling at two metres with a window of one metre in its middle.
    fn ceiling() -> Ground {
        let at = |i: u32, j: u32| Vec3::new(f32::from(i as u16) - 4.5, 2.0, f32::from(j as u16) - 4.5);
        let positions: Vec<Vec3> = (0..100).map(|v| at(v % 10, v / 10)).collect();
        let cells = (0..81).filter(|cell| *cell != 40).map(|cell| cell / 9 * 10 + cell % 9);
        let triangles: Vec<[u32; 3]> = cells.flat_map(|a| [[a, a + 1, a + 10], [a + 1, a + 11, a + 10]]).collect();
        let made = cluster(&positions, &triangles);
        let positions: Vec<Vec3> = made.vertices.iter().map(|&v| positions[v as usize]).collect();
        let bounds = (Vec3::new(-4.5, 2.0, -4.5), Vec3::new(4.5, 2.0, 4.5));
        let kept = KeptChunk { positions, indices: made.indices, clusters: made.clusters, bounds, albedo: Vec::new() };
        let mut ground = Ground::default();
        ground.push(Arc::new(kept));
        ground
    }

    #[test]
    fn it_tells_what_rays_tell() {
        let ground = ceiling();
        let sun = unit_or(Vec3::new(0.4, 1.0, -0.2), Vec3::Y);
        let (low, high) = (Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 2.5, 2.0));
        let map = SunMap::new(&ground, (low, high), sun);
        let mut random = Pcg32::new(7, 0);
        let (mut lit, mut dark, mut wrong) = (0, 0, 0);
        for _ in 0..4000 {
            let place = low + (high - low) * Vec3::new(random.next_f32(), random.next_f32(), random.next_f32());
            let ray = ground.cast(place, sun, 100.0).is_none();
            let told = map.at(place);
            (lit, dark) = (lit + u32::from(ray), dark + u32::from(!ray));
            // where the map is between the two, it is at an edge
            wrong += u32::from((told - f32::from(ray)).abs() > 0.5);
        }
        assert!(lit > 400 && dark > 1000, "{lit} lit, {dark} dark");
        // besides, what is just below the ceiling counts as lit: the bias is 1.5 hundredths of the box's height
        assert!(wrong < 120, "{wrong} of 4000");
    }

    #[test]
    fn the_rows_tell_what_the_map_tells() {
        let map = SunMap::new(&ceiling(), (Vec3::ZERO, Vec3::ONE), Vec3::Y);
        let rows = map.texels_from_world();
        let place = Vec3::new(0.31, 0.2, 0.84);
        let [x, y, depth] = rows.map(|row| row.dot(place.extend(1.0)));
        let texel = map.depths()[(y as u32 * map.size().x + x as u32) as usize];
        assert_eq!(map.at(place) > 0.5, depth >= texel);
        assert!(map.size().max_element() <= MOST_TEXELS);
        assert!(map.reaches(Vec3::new(0.2, 0.5, 0.2), 0.1) && !map.reaches(Vec3::new(0.9, 0.5, 0.9), 0.1));
    }

    #[test]
    fn without_anything_the_sun_shines_everywhere() {
        let map = SunMap::new(&Ground::default(), (Vec3::ZERO, Vec3::splat(400.0)), unit_or(Vec3::ONE, Vec3::Y));
        assert!(map.depths().iter().all(|depth| *depth == OPEN));
        assert_eq!((map.at(Vec3::ONE), map.at(Vec3::splat(-900.0))), (1.0, 1.0));
    }
}
