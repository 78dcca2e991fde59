//! The texels of an unwrapped surface, and the places on it that they stand for.
//!
//! A texel stands for the place at its middle; one whose middle lies beside all triangles is still asked for by filtering, and stands for the place of its
//! chart that is nearest to it. So nothing is ever taken from what no surface has.

use crate::unwrap::Unwrapped;
use glam::{Vec2, Vec3};
use heliodon_mesh::packing::cover;
use rayon::prelude::*;

/// A texel and its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texel {
    /// Along u.
    pub x: u16,
    /// Along v.
    pub y: u16,
    /// Its texture.
    pub sheet: u16,
    /// Whether its middle lies on its triangle.
    pub is_covered: bool,
    /// The triangle on which its place lies.
    pub triangle: u32,
    /// The weights of that triangle's corners, at least 0, together 1.
    pub weights: Vec3,
}

impl Texel {
    /// What its place has of something that corners have, as positions and normals.
    #[must_use]
    pub fn mix(&self, corners: [Vec3; 3]) -> Vec3 {
        corners[0] * self.weights.x + corners[1] * self.weights.y + corners[2] * self.weights.z
    }
}

/// All texels that filtering may ask for, chart by chart, each chart's row by row. `width` and `height` are those that were unwrapped for.
#[must_use]
pub fn texels(unwrapped: &Unwrapped, width: u32, height: u32) -> Vec<Texel> {
    let size = Vec2::new(width as f32, height as f32);
    let of_chart = |chart: usize| {
        let corners = |t: u32| unwrapped.triangles[t as usize].map(|v| unwrapped.uvs[v as usize] * size);
        of_chart(&unwrapped.charts[chart].triangles, corners, unwrapped.packing.placements[chart].sheet as u16, [width, height])
    };
    (0..unwrapped.charts.len()).into_par_iter().flat_map_iter(of_chart).collect()
}

/// The place of a texel in a list of all cells of all textures of these sides, row by row, sheet by sheet.
pub(crate) fn cell([width, height]: [u32; 2], sheet: u16, x: u32, y: u32) -> usize {
    (usize::from(sheet) * height as usize + y as usize) * width as usize + x as usize
}

/// By how much coordinates may come back off what they were packed at, as a part of the texture's side: they are scaled, moved, divided by the side and multiplied
/// by it again, and each step rounds by half of [`f32::EPSILON`]. Charts lie beside one another without a margin, so no texel is claimed for less.
const ROUNDED: f32 = 4.0 * f32::EPSILON;

/// The best place for a texel so far.
#[derive(Clone, Copy)]
struct Nearest {
    distance_squared: f32,
    triangle: u32,
    weights: Vec3,
}

fn of_chart(triangles: &[u32], corners: impl Fn(u32) -> [Vec2; 3], sheet: u16, size: [u32; 2]) -> Vec<Texel> {
    let all = triangles.iter().flat_map(|&t| corners(t));
    let (low, high) = all.fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    if low.x > high.x {
        return Vec::new();
    }
    let first = (low - 1.0).floor().max(Vec2::ZERO).as_uvec2();
    let end = (high + 2.0).ceil().as_uvec2().min(size.into());
    let (width, height) = ((end.x - first.x) as usize, (end.y - first.y) as usize);
    let none = Nearest { distance_squared: f32::INFINITY, triangle: 0, weights: Vec3::ZERO };
    let mut nearest = vec![none; width * height];
    let reach = 1.0 - ROUNDED * size[0].max(size[1]) as f32;
    for &t in triangles {
        let triangle = corners(t).map(|p| p - first.as_vec2());
        cover(&triangle, reach, height, |y, begin, end| {
            for x in begin..end.min(width) {
                let middle = Vec2::new(x as f32, y as f32) + 0.5;
                let weights = closest(&triangle, middle);
                let place = triangle[0] * weights.x + triangle[1] * weights.y + triangle[2] * weights.z;
                let distance_squared = place.distance_squared(middle);
                let best = &mut nearest[y * width + x];
                if distance_squared < best.distance_squared {
                    *best = Nearest { distance_squared, triangle: t, weights };
                }
            }
        });
    }
    let texel = |(place, best): (usize, &Nearest)| Texel {
        x: (first.x as usize + place % width) as u16,
        y: (first.y as usize + place / width) as u16,
        sheet,
        is_covered: best.distance_squared <= ON * ON,
        triangle: best.triangle,
        weights: best.weights,
    };
    nearest.iter().enumerate().filter(|(_, best)| best.distance_squared < f32::INFINITY).map(texel).collect()
}

/// A middle that is nearer than this lies on the triangle, texels: coordinates are rounded.
const ON: f32 = 1.0e-3;

/// The weights of the corners at the place of a triangle that is closest to a point.
fn closest(triangle: &[Vec2; 3], p: Vec2) -> Vec3 {
    let [a, b, c] = *triangle;
    let twice = (b - a).perp_dot(c - a);
    if twice != 0.0 {
        let weights = Vec3::new((c - b).perp_dot(p - b), (a - c).perp_dot(p - c), (b - a).perp_dot(p - a)) / twice;
        if weights.min_element() >= 0.0 && weights.is_finite() {
            return weights / weights.element_sum();
        }
    }
    let on_side = |i: usize| {
        let (from, to) = (triangle[i], triangle[(i + 1) % 3]);
        let along = to - from;
        let length_squared = along.length_squared();
        let share = if length_squared > 0.0 { ((p - from).dot(along) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
        let mut weights = [0.0; 3];
        (weights[i], weights[(i + 1) % 3]) = (1.0 - share, share);
        ((from + along * share).distance_squared(p), Vec3::from(weights))
    };
    let nearest = (0..3).map(on_side).min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.map_or(Vec3::X, |(_, weights)| weights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packing::PackParams;
    use crate::unwrap::{UnwrapParams, unwrap};
    use std::collections::HashMap;

    /// A wavy sheet of so many squares a side.
    fn waves(parts: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let at = |i: u32| {
            let (x, y) = ((i % (parts + 1)) as f32 / parts as f32, (i / (parts + 1)) as f32 / parts as f32);
            Vec3::new(x, y, 0.3 * libm::sinf(7.0 * x) * libm::cosf(5.0 * y))
        };
        let squares = (0..parts * parts).map(|i| i / parts * (parts + 1) + i % parts);
        let triangles = squares.flat_map(|v| [[v, v + 1, v + parts + 2], [v, v + parts + 2, v + parts + 1]]);
        ((0..(parts + 1) * (parts + 1)).map(at).collect(), triangles.collect())
    }

    #[test]
    fn filtering_finds_a_texel_of_its_chart_everywhere() {
        [0, 2].into_iter().for_each(check_filtering);
    }

    fn check_filtering(margin: u32) {
        let (positions, triangles) = waves(20);
        let pack = PackParams { width: 200, height: 150, margin, ..PackParams::default() };
        let params = UnwrapParams { pack, ..UnwrapParams::default() };
        let unwrapped = unwrap(&positions, &triangles, &[], &params).unwrap();
        assert!(unwrapped.charts.len() > 4);
        let texels = texels(&unwrapped, 200, 150);
        let at: HashMap<(u16, u16), &Texel> = texels.iter().map(|texel| ((texel.x, texel.y), texel)).collect();
        assert_eq!(at.len(), texels.len(), "each texel once");
        let (mut worst_m, mut covered) = (0.0_f32, 0);
        for (t, of_chart) in unwrapped.triangles.iter().enumerate() {
            let [a, b, c] = of_chart.map(|v| unwrapped.uvs[v as usize] * Vec2::new(200.0, 150.0));
            let [d, e, f] = triangles[t].map(|v| positions[v as usize]);
            for (u, v) in (0..=8_u8).flat_map(|i| (0..=8 - i).map(move |j| (f32::from(i) / 8.0, f32::from(j) / 8.0))) {
                let p = a + (b - a) * u + (c - a) * v - 0.5;
                let place = d + (e - d) * u + (f - d) * v;
                let from = p.floor();
                let share = p - from;
                let mut filtered = Vec3::ZERO;
                for corner in [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE] {
                    let weight = (Vec2::ONE - (share - corner).abs()).element_product();
                    if weight < 1e-3 {
                        continue;
                    }
                    let texel = at[&((from.x + corner.x) as u16, (from.y + corner.y) as u16)];
                    assert_eq!(unwrapped.chart[texel.triangle as usize], unwrapped.chart[t]);
                    filtered += weight * texel.mix(triangles[texel.triangle as usize].map(|v| positions[v as usize]));
                    covered += u32::from(texel.is_covered);
                }
                worst_m = worst_m.max(filtered.distance(place));
            }
        }
        // positions themselves filtered: a texel's side off at borders at most, and hardly inside
        let texel_m = 1.0 / unwrapped.packing.per_m;
        assert!(covered > 1000 && worst_m < 1.2 * texel_m, "{worst_m} of {texel_m}");
    }

    #[test]
    fn charts_without_a_margin_share_no_texel() {
        // three hundred loose squares, a few texels large, in textures in which coordinates are rounded more and more
        let square = |i: u32| [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y].map(|p| p + Vec3::X * 2.3 * i as f32);
        let positions: Vec<Vec3> = (0..300).flat_map(square).collect();
        let triangles: Vec<[u32; 3]> =
            (0..300).flat_map(|i| [[0, 1, 2], [0, 2, 3]].map(|t: [u32; 3]| t.map(|v| v + 4 * i))).collect();
        for side in [131, 509] {
            let pack = PackParams { width: side, height: side, margin: 0, ..PackParams::default() };
            let unwrapped = unwrap(&positions, &triangles, &[], &UnwrapParams { pack, ..UnwrapParams::default() }).unwrap();
            for finer in [1, 4] {
                let texels = texels(&unwrapped, finer * side, finer * side);
                let at: std::collections::HashSet<(u16, u16)> = texels.iter().map(|texel| (texel.x, texel.y)).collect();
                assert_eq!(at.len(), texels.len(), "{side}: each texel once");
            }
        }
    }

    #[test]
    fn what_is_smaller_than_a_texel_has_one() {
        let positions =
            [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(5.0, 5.0, 0.0), Vec3::new(5.001, 5.0, 0.0), Vec3::new(5.0, 5.001, 0.0)];
        let params =
            UnwrapParams { pack: PackParams { width: 64, height: 64, ..PackParams::default() }, ..UnwrapParams::default() };
        let unwrapped = unwrap(&positions, &[[0, 1, 2], [3, 4, 5], [0, 0, 1]], &[], &params).unwrap();
        let texels = texels(&unwrapped, 64, 64);
        let of = |t: u32| texels.iter().filter(|texel| texel.triangle == t).count();
        assert!(of(0) > 500 && (1..=4).contains(&of(1)) && of(2) == 1, "{} {} {}", of(0), of(1), of(2));
        assert!(
            texels.iter().all(|texel| (texel.weights.element_sum() - 1.0).abs() < 1e-6 && texel.weights.min_element() >= 0.0)
        );
    }
}
