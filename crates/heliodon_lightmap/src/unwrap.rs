//! A second set of texture coordinates in which no two places of a surface share a texel: charts, packed, and the vertices split where charts meet.

use crate::charts::{Chart, ChartParams, charts};
use crate::packing::{PackError, PackParams, Packing, pack};
use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// How a surface is unwrapped.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct UnwrapParams {
    /// How charts are cut.
    pub charts: ChartParams,
    /// How they are packed.
    pub pack: PackParams,
}

/// A surface unwrapped. Positions, the order of triangles and everything else that vertices have stay: only the second coordinates are new, and the vertices
/// that stand on both sides of a chart's border.
#[derive(Clone, Debug)]
pub struct Unwrapped {
    /// For each vertex that it was before; the first ones are those of the original, in their order, and those behind them are split off.
    pub original_vertex: Vec<u32>,
    /// Triangles over these, in their order.
    pub triangles: Vec<[u32; 3]>,
    /// Where each vertex lies in its texture, [0, 1], the origin at the first texel's outer corner; zero where no triangle uses it.
    pub uvs: Vec<Vec2>,
    /// The texture of each triangle.
    pub sheet: Vec<u16>,
    /// The chart of each triangle.
    pub chart: Vec<u32>,
    /// Which charts there are, and where they lie.
    pub charts: Vec<Chart>,
    /// How they are packed.
    pub packing: Packing,
}

/// Unwraps a surface; `density` as of [`charts`], each finite and at least 0.
///
/// # Errors
/// As [`pack`].
///
/// # Panics
/// As [`charts`].
pub fn unwrap(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    density: &[f32],
    params: &UnwrapParams,
) -> Result<Unwrapped, PackError> {
    let is_known = |t: &usize| {
        let is_dense = density.get(*t).is_none_or(|density| density.is_finite() && *density >= 0.0);
        is_dense && triangles[*t].iter().all(|&v| positions[v as usize].is_finite())
    };
    if let Some(triangle) = (0..triangles.len()).find(|t| !is_known(t)) {
        return Err(PackError::NotFinite { triangle: triangle as u32 });
    }
    let charts = charts(positions, triangles, density, &params.charts);
    let corners = |t: u32| triangles[t as usize].map(|v| positions[v as usize]);
    let packing = pack(&charts, corners, &params.pack)?;
    let mut split = Split {
        chart_of: vec![NOBODY; positions.len()],
        more: HashMap::new(),
        original_vertex: (0..positions.len() as u32).collect(),
        uvs: vec![Vec2::ZERO; positions.len()],
    };
    let size = Vec2::new(params.pack.width as f32, params.pack.height as f32);
    let (mut of_charts, mut sheet, mut chart_of) = (triangles.to_vec(), vec![0; triangles.len()], vec![0; triangles.len()]);
    for (index, chart) in charts.iter().enumerate() {
        for &t in &chart.triangles {
            let vertex = |v: u32| {
                let texel = || packing.texel(index, chart.coordinates(positions[v as usize])) / size;
                split.vertex(v, index as u32, texel)
            };
            of_charts[t as usize] = triangles[t as usize].map(vertex);
            sheet[t as usize] = packing.placements[index].sheet as u16;
            chart_of[t as usize] = index as u32;
        }
    }
    let Split { original_vertex, uvs, .. } = split;
    Ok(Unwrapped { original_vertex, triangles: of_charts, uvs, sheet, chart: chart_of, charts, packing })
}

const NOBODY: u32 = u32::MAX;

/// Vertices, while charts take them one after the other.
struct Split {
    /// The first chart that took each of the original's.
    chart_of: Vec<u32>,
    /// Those of further ones.
    more: HashMap<(u32, u32), u32>,
    original_vertex: Vec<u32>,
    uvs: Vec<Vec2>,
}

impl Split {
    /// A chart's own vertex for one of the original.
    fn vertex(&mut self, v: u32, chart: u32, uv: impl Fn() -> Vec2) -> u32 {
        let first = &mut self.chart_of[v as usize];
        if *first == NOBODY {
            *first = chart;
            self.uvs[v as usize] = uv();
        }
        if *first == chart {
            return v;
        }
        *self.more.entry((v, chart)).or_insert_with(|| {
            self.original_vertex.push(v);
            self.uvs.push(uv());
            self.uvs.len() as u32 - 1
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn small() -> UnwrapParams {
        UnwrapParams { pack: PackParams { width: 128, height: 96, ..PackParams::default() }, ..UnwrapParams::default() }
    }

    /// A box of so many squares a side, with the given corner.
    fn cube(parts: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        let sides = [
            (Vec3::X, Vec3::Y, Vec3::Z),
            (Vec3::Y, Vec3::X, Vec3::ZERO),
            (Vec3::Y, Vec3::Z, Vec3::X),
            (Vec3::Z, Vec3::Y, Vec3::ZERO),
            (Vec3::Z, Vec3::X, Vec3::Y),
            (Vec3::X, Vec3::Z, Vec3::ZERO),
        ];
        for (u, v, from) in sides {
            let first = positions.len() as u32;
            for j in 0..=parts {
                for i in 0..=parts {
                    positions.push(from + u * (i as f32 / parts as f32) + v * (j as f32 / parts as f32));
                }
            }
            for j in 0..parts {
                for i in 0..parts {
                    let a = first + j * (parts + 1) + i;
                    triangles.extend([[a, a + 1, a + parts + 2], [a, a + parts + 2, a + parts + 1]]);
                }
            }
        }
        (positions, triangles)
    }

    /// What holds of every unwrapped surface.
    fn check(positions: &[Vec3], triangles: &[[u32; 3]], unwrapped: &Unwrapped, params: &UnwrapParams) {
        let PackParams { width, height, margin, .. } = params.pack;
        assert_eq!(unwrapped.triangles.len(), triangles.len());
        for (before, after) in triangles.iter().zip(&unwrapped.triangles) {
            assert_eq!(after.map(|v| unwrapped.original_vertex[v as usize]), *before, "the order stays");
        }
        assert!((0..positions.len()).all(|v| unwrapped.original_vertex[v] == v as u32));
        let size = Vec2::new(width as f32, height as f32);
        let at = |t: usize| unwrapped.triangles[t].map(|v| unwrapped.uvs[v as usize] * size);
        // who is asked for a texel by filtering, chart by chart
        let mut owner = vec![[NOBODY]; (width * height) as usize * params.pack.sheets as usize];
        let mut turned_over = 0;
        for t in 0..triangles.len() {
            let [a, b, c] = at(t);
            for p in [a, b, c] {
                assert!(
                    p.cmpge(Vec2::splat(0.499)).all() && p.cmple(size - 0.499).all(),
                    "{p} is filtered from inside of the texture"
                );
            }
            let twice = (b - a).perp_dot(c - a);
            turned_over += usize::from(twice < -1e-3);
            for i in 0..=24_u32 {
                for j in 0..=24 - i {
                    let p = a + (b - a) * (i as f32 / 24.0) + (c - a) * (j as f32 / 24.0) - 0.5;
                    for corner in [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE] {
                        let texel = p.floor() + corner;
                        let weight = Vec2::ONE - (p - texel).abs();
                        if weight.min_element() > 1e-3 {
                            let place = texel.y as usize * width as usize + texel.x as usize;
                            let owner = &mut owner[place + unwrapped.sheet[t] as usize * (width * height) as usize][0];
                            assert!(*owner == NOBODY || *owner == unwrapped.chart[t], "two charts share a texel");
                            *owner = unwrapped.chart[t];
                        }
                    }
                }
            }
        }
        assert_eq!(turned_over, 0, "no triangle is turned over");
        for t in 0..triangles.len().min(200) {
            let [a, b, c] = at(t);
            let shares = |i: u32, j: u32| (i as f32 / 10.0, j as f32 / 10.0);
            let places =
                (1..10).flat_map(|i| (1..10 - i).map(move |j| shares(i, j))).map(|(u, v)| a + (b - a) * u + (c - a) * v);
            let same = |other: &usize| *other != t && unwrapped.chart[*other] == unwrapped.chart[t];
            for other in (0..triangles.len()).filter(same) {
                let [d, e, f] = at(other);
                let inside = |p: Vec2| [(d, e), (e, f), (f, d)].iter().all(|(from, to)| (to - from).perp_dot(p - from) > 0.05);
                assert!(!places.clone().any(inside), "{t} covers {other}");
            }
        }
        if margin == 0 {
            return;
        }
        // texels of two charts are further apart than the margin
        for (place, [chart]) in owner.iter().enumerate().filter(|(_, [chart])| *chart != NOBODY) {
            let (x, y) = (place % width as usize, place / width as usize);
            let right = (1..=margin as usize).filter(|dx| x + dx < width as usize).map(|dx| owner[place + dx][0]);
            let down = (1..=margin as usize).filter(|dy| (y + dy) % height as usize > y % height as usize);
            let down = down.map(|dy| owner[place + dy * width as usize][0]);
            assert!(right.chain(down).all(|other| other == NOBODY || other == *chart), "the margin holds");
        }
    }

    #[test]
    fn a_box_has_six_charts_as_large_as_the_texture_allows() {
        let (positions, triangles) = cube(3);
        let unwrapped = unwrap(&positions, &triangles, &[], &small()).unwrap();
        check(&positions, &triangles, &unwrapped, &small());
        assert_eq!(unwrapped.charts.len(), 6);
        assert_eq!(unwrapped.uvs.len(), positions.len(), "its edges are split already");
        // three squares by two in 128 by 96 texels, a texel more each and two between: 40 and no more
        assert!(unwrapped.packing.per_m > 38.5 && unwrapped.packing.per_m <= 40.0, "{}", unwrapped.packing.per_m);
        let mut bounded = small();
        bounded.pack.most_per_m = 12.0;
        let unwrapped = unwrap(&positions, &triangles, &[], &bounded).unwrap();
        check(&positions, &triangles, &unwrapped, &bounded);
        assert_eq!(unwrapped.packing.per_m, 12.0);
    }

    #[test]
    fn what_no_texture_can_hold_is_refused_with_the_size_that_can() {
        let (positions, triangles) = cube(1);
        let mut params = small();
        (params.pack.width, params.pack.height) = (3, 3);
        let refused = unwrap(&positions, &triangles, &[], &params).unwrap_err();
        assert_eq!(refused, PackError::TooSmall { charts: 6, width: 3, height: 3, smallest: 7 });
        (params.pack.width, params.pack.height) = (7, 7);
        check(&positions, &triangles, &unwrap(&positions, &triangles, &[], &params).unwrap(), &params);
        params.pack.width = 0;
        assert_eq!(unwrap(&positions, &triangles, &[], &params).unwrap_err(), PackError::Size { width: 0, height: 7 });
        params.pack = PackParams { width: 16, height: 16, sheets: 6, ..PackParams::default() };
        let several = unwrap(&positions, &triangles, &[], &params).unwrap();
        check(&positions, &triangles, &several, &params);
        assert_eq!(several.packing.sheets, 6);
    }

    #[test]
    fn what_is_not_finite_or_out_of_range_is_refused() {
        let (positions, triangles) = cube(1);
        let refused = |positions: &[Vec3], density: &[f32], params: &UnwrapParams| {
            unwrap(positions, &triangles, density, params).unwrap_err()
        };
        for wrong in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut moved = positions.clone();
            moved[0].y = wrong;
            assert_eq!(refused(&moved, &[], &small()), PackError::NotFinite { triangle: 0 }, "{wrong}");
        }
        for wrong in [f32::NAN, f32::INFINITY, -1.0] {
            let mut density = vec![1.0; triangles.len()];
            density[3] = wrong;
            assert_eq!(refused(&positions, &density, &small()), PackError::NotFinite { triangle: 3 }, "{wrong}");
        }
        for far in [1.0e12, 1.0e18, 1.0e25, f32::MAX] {
            let mut moved = positions.clone();
            moved[0].y = far;
            // whatever comes of it, it comes
            let _ = unwrap(&moved, &triangles, &[], &small());
        }
        // a vertex that no triangle names may be anything
        let more = [positions.as_slice(), &[Vec3::NAN]].concat();
        assert!(unwrap(&more, &triangles, &[], &small()).is_ok());
        assert!(unwrap(&positions, &triangles, &vec![0.0; triangles.len()], &small()).is_ok());
        let with = |change: fn(&mut PackParams)| {
            let mut params = small();
            change(&mut params.pack);
            refused(&positions, &[], &params)
        };
        assert_eq!(with(|pack| pack.margin = u32::MAX), PackError::Margin { margin: u32::MAX });
        assert!(matches!(with(|pack| pack.margin = 16_384), PackError::TooSmall { .. }));
        assert_eq!(with(|pack| pack.sheets = 0), PackError::Sheets { sheets: 0 });
        assert_eq!(with(|pack| pack.sheets = 65_536), PackError::Sheets { sheets: 65_536 });
        assert!(matches!(with(|pack| pack.most_per_m = f32::NAN), PackError::MostPerM));
    }

    #[test]
    fn denser_parts_have_more_texels() {
        let (positions, triangles) = cube(2);
        let density: Vec<f32> = (0..triangles.len()).map(|t| if t < 8 { 3.0 } else { 1.0 }).collect();
        let unwrapped = unwrap(&positions, &triangles, &density, &small()).unwrap();
        check(&positions, &triangles, &unwrapped, &small());
        let size = Vec2::new(128.0, 96.0);
        let side = |t: usize| {
            let [a, b, _] = unwrapped.triangles[t].map(|v| unwrapped.uvs[v as usize] * size);
            a.distance(b)
        };
        assert!((side(0) / side(20) - 3.0).abs() < 1e-3, "{} and {}", side(0), side(20));
    }

    #[test]
    fn the_number_of_threads_does_not_matter() {
        let scene = heliodon_testkit::scenes::ball(1.0, 20);
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| unwrap(&scene.positions, &scene.triangles, &[], &small()).unwrap())
        };
        let [one, three] = [1, 3].map(with);
        assert!(one.charts.len() > 6);
        assert_eq!((one.uvs, one.charts, one.packing), (three.uvs, three.charts, three.packing));
    }

    #[test]
    fn triangles_without_area_have_a_texel() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X * 2.0];
        let triangles = [[0, 1, 2], [0, 1, 3], [2, 2, 2]];
        let unwrapped = unwrap(&positions, &triangles, &[], &small()).unwrap();
        check(&positions, &triangles, &unwrapped, &small());
        assert_eq!(unwrapped.charts.len(), 2);
        assert!(unwrap(&[], &[], &[], &small()).unwrap().uvs.is_empty());
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

        #[test]
        fn any_soup_is_unwrapped(
            places in proptest::collection::vec((0_i8..6, 0_i8..6, 0_i8..6), 3..30),
            corners in proptest::collection::vec((0_usize..30, 0_usize..30, 0_usize..30), 1..50),
            margin in 0_u32..4,
        ) {
            let positions: Vec<Vec3> =
                places.iter().map(|&(x, y, z)| Vec3::new(f32::from(x), f32::from(y), f32::from(z))).collect();
            let index = |v: usize| (v % positions.len()) as u32;
            let triangles: Vec<[u32; 3]> = corners.iter().map(|&(a, b, c)| [index(a), index(b), index(c)]).collect();
            let mut params = small();
            params.pack.margin = margin;
            let unwrapped = unwrap(&positions, &triangles, &[], &params).unwrap();
            check(&positions, &triangles, &unwrapped, &params);
        }
    }
}
