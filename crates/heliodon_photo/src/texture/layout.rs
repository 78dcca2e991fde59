//! How large each face is in the atlas, where it lies there, and which texel shows which place.

use super::eye::{shown, to_camera};
use super::surface::Surface;
use super::{TextureError, TextureParams};
use crate::camera::Camera;
use crate::model::Part;
use glam::{Vec2, Vec3};
use heliodon_math::sphere::sample_cosine_hemisphere;
use heliodon_mesh::packing::{FlatChart, PackParams, Packing, pack};
use heliodon_rays::{Hit, Ray};
use rayon::prelude::*;

/// A texel of the atlas that shows something.
#[derive(Clone, Copy, Debug)]
pub(super) struct Texel {
    /// Column and row.
    pub at: [u16; 2],
    pub triangle: u32,
    pub place: Vec3,
    /// Whether its middle is on the face; else it is beside, and shows the face's nearest place for the sake of filtering.
    pub inside: bool,
}

pub(super) struct Layout {
    /// Columns and rows of the atlas.
    pub size: [u32; 2],
    /// Texels of all faces, face by face, rows from the top.
    pub texels: Vec<Texel>,
    /// Where each face's texels begin, and where the last one's end.
    pub starts: Vec<usize>,
    /// For each face, texels for a metre.
    pub per_m: Vec<f32>,
    /// For each face, whether it lies inside of something, so that nobody will ever see it.
    pub buried: Vec<bool>,
    /// For each triangle, where its corners lie in the atlas, texels.
    pub corners: Vec<[Vec2; 3]>,
    pub utilisation: f32,
}

/// Places that are looked at to know how finely photographs show a face, at least, and at most.
const LEAST_PROBES: usize = 64;
const MOST_PROBES: usize = 1024;
/// The part of a face that is shown at full resolution: what lies nearest to a camera may be shown less finely than it could be.
const PERCENTILE: f32 = 0.9;
/// What no photograph shows gets this part of the others' mean resolution: there is nothing to see.
const UNSEEN: f32 = 0.125;
/// And so much of it what nobody will see either.
const BURIED: f32 = 0.01;
/// From so many places of a face, and in so many directions from each, rays meet nothing but backs where it is buried.
const BURIED_PROBES: usize = 8;
const BURIED_RAYS: usize = 32;

impl Layout {
    pub fn new(surface: &Surface, parts: &[Part], cameras: &[Camera], params: &TextureParams) -> Result<Self, TextureError> {
        let finest: Vec<Option<f32>> =
            surface.faces.par_iter().map(|face| probed(surface, &face.triangles, cameras, params)).collect();
        let seen: Vec<f32> = finest.iter().copied().flatten().collect();
        if seen.is_empty() {
            return Err(TextureError::NothingSeen);
        }
        let mean = seen.iter().sum::<f32>() / seen.len() as f32;
        let buried: Vec<bool> = (surface.faces.par_iter().zip(&finest))
            .map(|(face, finest)| finest.is_none() && is_buried(surface, &face.triangles, params))
            .collect();
        let wanted = |(finest, buried): (&Option<f32>, &bool)| {
            let unseen = if *buried { BURIED } else { UNSEEN };
            (finest.unwrap_or(unseen * mean) * params.oversampling).min(params.most_per_m)
        };
        let wanted: Vec<f32> = finest.iter().zip(&buried).map(wanted).collect();
        let flat = |t: u32| {
            let part = surface.starts.partition_point(|start| *start <= t) - 1;
            parts[part].flat[(t - surface.starts[part]) as usize]
        };
        let charts = || {
            let chart = |(face, scale): (&super::surface::Face, &f32)| FlatChart {
                first_triangle: face.triangles[0],
                triangles: face.triangles.iter().map(|&t| flat(t).map(|p| p * *scale)).collect(),
            };
            surface.faces.iter().zip(&wanted).map(chart).collect::<Vec<_>>()
        };
        let (size, packing) = packed(&charts, params)?;
        let mut corners = vec![[Vec2::ZERO; 3]; surface.triangles.len()];
        for (index, (face, scale)) in surface.faces.iter().zip(&wanted).enumerate() {
            for &t in &face.triangles {
                corners[t as usize] = flat(t).map(|p| packing.texel(index, p * *scale));
            }
        }
        let of_faces: Vec<Vec<Texel>> =
            surface.faces.par_iter().map(|face| texels(surface, &face.triangles, &corners, size)).collect();
        let mut starts = vec![0];
        starts.extend(of_faces.iter().scan(0, |sum, texels| {
            *sum += texels.len();
            Some(*sum)
        }));
        let per_m = wanted.iter().map(|scale| scale * packing.per_m).collect();
        let texels = of_faces.into_iter().flatten().collect();
        Ok(Self { size, texels, starts, per_m, buried, corners, utilisation: packing.utilisation })
    }

    /// Which of the atlas' pixels a texel is, rows from the top.
    pub fn cell(&self, texel: usize) -> usize {
        let [x, y] = self.texels[texel].at.map(usize::from);
        y * self.size[0] as usize + x
    }
}

/// A place of a triangle, and the area that it stands for, square metres.
#[derive(Clone, Copy)]
struct Probe {
    triangle: u32,
    place: Vec3,
    area_m2: f32,
}

/// Places spread evenly over a face: at least so many, or one of each triangle, and at most so many.
fn probes(surface: &Surface, triangles: &[u32], least: usize, most: usize) -> Vec<Probe> {
    let each = (least / triangles.len()).clamp(1, least);
    let stride = (triangles.len() * each).div_ceil(most);
    let weights = |k: usize| {
        let [u, v] = spread(k);
        if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] }
    };
    let of_triangle = |&triangle: &u32| {
        let [a, b, c] = surface.triangles[triangle as usize].corners;
        let area_m2 = 0.5 * (b - a).cross(c - a).length() / each as f32;
        (0..each).map(move |k| {
            let [u, v] = weights(k);
            Probe { triangle, place: a + (b - a) * u + (c - a) * v, area_m2 }
        })
    };
    triangles.iter().step_by(stride).flat_map(of_triangle).collect()
}

/// The k-th of places that fill a square evenly, however many there are.
fn spread(k: usize) -> [f32; 2] {
    [0.754_877_7, 0.569_840_3].map(|step: f64| (step * (k as f64 + 0.5)).fract() as f32)
}

/// Whether a face lies inside of other bodies, or of its own: whatever its places see is a back. What stands in photographs' way without being part of the
/// model counts as open air.
fn is_buried(surface: &Surface, triangles: &[u32], params: &TextureParams) -> bool {
    probes(surface, triangles, BURIED_PROBES, MOST_PROBES).iter().all(|probe| {
        let normal = surface.triangles[probe.triangle as usize].normal;
        let origin = probe.place + normal * (params.offset_m + surface.scene.start_offset());
        let ray =
            |k: usize| Ray { origin, direction: sample_cosine_hemisphere(normal, spread(k)), t_min: 0.0, t_max: f32::INFINITY };
        let rays: [Ray; BURIED_RAYS] = std::array::from_fn(ray);
        let mut hits = [Hit::MISS; BURIED_RAYS];
        surface.scene.closest(&rays, &mut hits);
        let is_back = |(ray, hit): (&Ray, &Hit)| {
            surface.triangles.get(hit.triangle as usize).is_some_and(|met| met.normal.dot(ray.direction) > 0.0)
        };
        normal != Vec3::ZERO && rays.iter().zip(&hits).all(is_back)
    })
}

/// The finest that photographs show most of a face, pixels for a metre; none where none shows it.
fn probed(surface: &Surface, triangles: &[u32], cameras: &[Camera], params: &TextureParams) -> Option<f32> {
    let finest = |probe: &Probe| {
        let normal = surface.triangles[probe.triangle as usize].normal;
        let of_camera = |camera: &Camera| {
            let shown = shown(camera, probe.place, normal)?;
            if shown.cosine < params.least_cosine() {
                return None;
            }
            let ray = to_camera(camera, probe.place, normal, params.offset_m + surface.scene.start_offset());
            let mut occluded = [0];
            surface.scene.occluded(&[ray], &mut occluded);
            (occluded[0] == 0).then_some(shown.px_per_m)
        };
        cameras.iter().filter_map(of_camera).max_by(f32::total_cmp).map(|px_per_m| (px_per_m, probe.area_m2))
    };
    let mut best: Vec<(f32, f32)> = probes(surface, triangles, LEAST_PROBES, MOST_PROBES).iter().filter_map(finest).collect();
    best.sort_by(|a, b| a.0.total_cmp(&b.0));
    let whole: f32 = best.iter().map(|(_, area)| area).sum();
    let mut sum = 0.0;
    best.iter()
        .find(|(_, area)| {
            sum += area;
            sum >= PERCENTILE * whole
        })
        .map(|(px_per_m, _)| *px_per_m)
        .filter(|px_per_m| px_per_m.is_finite() && *px_per_m > 0.0)
}

/// The smallest square of a power of two, or half of one, in which faces are as fine as is wanted; or the largest that is allowed, and all faces coarser.
fn packed(charts: &dyn Fn() -> Vec<FlatChart>, params: &TextureParams) -> Result<([u32; 2], Packing), TextureError> {
    let area = |[a, b, c]: &[Vec2; 3]| f64::from(0.5 * (*b - *a).perp_dot(*c - *a).abs());
    let needed: f64 = charts().iter().flat_map(|chart| &chart.triangles).map(area).sum();
    let most = params.most_side;
    let (mut width, mut height) = (64.min(most), 32.min(most));
    loop {
        let is_last = width == most && height == most;
        if is_last || f64::from(width) * f64::from(height) >= 1.05 * needed {
            let pack_params = PackParams { width, height, margin: params.margin, sheets: 1, most_per_m: 1.0 };
            match pack(charts(), &pack_params) {
                // a hundredth coarser is not worth twice the memory
                Ok(packing) if packing.per_m >= 0.99 || is_last => return Ok(([width, height], packing)),
                Err(error) if is_last => return Err(error.into()),
                _ => (),
            }
        }
        (width, height) = if height < width { (width, width) } else { ((2 * width).min(most), height) };
    }
}

/// A texel whose middle is no farther from a face, texels, is read when the face is filtered.
const REACH: f32 = 1.5;

/// A face's texels, each with the place that it shows.
fn texels(surface: &Surface, triangles: &[u32], corners: &[[Vec2; 3]], size: [u32; 2]) -> Vec<Texel> {
    let all = triangles.iter().flat_map(|&t| corners[t as usize]);
    let (low, high) = all.fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let bound = |x: f32| x.max(0.0) as u32;
    let (x0, y0) = (bound(low.x - REACH), bound(low.y - REACH));
    let (x1, y1) = (bound((high.x + REACH).ceil()).min(size[0]), bound((high.y + REACH).ceil()).min(size[1]));
    let width = (x1 - x0) as usize;
    let mut nearest = vec![(f32::INFINITY, 0, [0.0; 2]); width * (y1 - y0) as usize];
    for &t in triangles {
        let of_triangle = &corners[t as usize];
        let low = of_triangle.iter().fold(Vec2::INFINITY, |low, p| low.min(*p)) - REACH;
        let high = of_triangle.iter().fold(Vec2::NEG_INFINITY, |high, p| high.max(*p)) + REACH;
        for y in bound(low.y).max(y0)..bound(high.y.ceil()).min(y1) {
            for x in bound(low.x).max(x0)..bound(high.x.ceil()).min(x1) {
                let (distance, weights) = nearest_place(of_triangle, Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                let cell = &mut nearest[(y - y0) as usize * width + (x - x0) as usize];
                if distance < cell.0 {
                    *cell = (distance, t, weights);
                }
            }
        }
    }
    let texel = |(i, (distance, t, [u, v])): (usize, (f32, u32, [f32; 2]))| {
        let triangle = &surface.triangles[t as usize];
        let [a, b, c] = triangle.corners;
        Texel {
            at: [(x0 as usize + i % width) as u16, (y0 as usize + i / width) as u16],
            triangle: t,
            place: a + (b - a) * u + (c - a) * v,
            inside: distance <= 0.0,
        }
    };
    nearest.into_iter().enumerate().filter(|(_, (distance, ..))| *distance <= REACH).map(texel).collect()
}

/// How far a place is from a triangle, 0 inside, and the weights of the second and third corner at the triangle's nearest place.
fn nearest_place(corners: &[Vec2; 3], p: Vec2) -> (f32, [f32; 2]) {
    let [a, b, c] = *corners;
    let twice = (b - a).perp_dot(c - a);
    if twice != 0.0 {
        let (u, v) = ((p - a).perp_dot(c - a) / twice, (b - a).perp_dot(p - a) / twice);
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
            return (0.0, [u, v]);
        }
    }
    let on_side = |k: usize| {
        let (from, to) = (corners[k], corners[(k + 1) % 3]);
        let along = to - from;
        let t = ((p - from).dot(along) / along.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        let weights = [[t, 0.0], [1.0 - t, t], [0.0, 1.0 - t]][k];
        ((p - from - along * t).length(), weights)
    };
    let sides = [on_side(0), on_side(1), on_side(2)];
    sides.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f32::INFINITY, [0.0; 2]))
}
