//! Where the sun shines, more finely than vertices tell.
//!
//! A cell lit by the mean of its vertices is right on average; the shade beside a patch of sunlight is lit by that patch alone, and errs
//! as much as its edge. So triangles are divided into patches (those that fill much of the points' views the most finely) and each is
//! asked at its centre which suns reach it. What a ray meets is then lit by the sun at the place that it meets. Near a vertex it is the
//! vertex that was asked: rays that leave a vertex on rough ground meet the triangles beside it within millimetres, where the sun is
//! what it is at the vertex, whatever it is at their centres.

use crate::cells::Split;
use crate::masks::{MaskParams, SunMasks, bake_sun_masks, run_masks};
use crate::refine::patches_by_sight;
use crate::surfaces::reflected;
use crate::{Layout, LightError, LightParams, Surfaces};
use glam::Vec3;
use heliodon_math::color::{linear_from_rgb9e5, rgb9e5_from_linear};
use heliodon_rays::{Hit, beam_order};
use rayon::prelude::*;
use std::f32::consts::FRAC_1_PI;

/// Triangles whose patches are asked together.
const TOGETHER: usize = 1024;

/// Suns of one word of a mask.
const WORD: usize = 32;

/// The part of a patch's edge, from a vertex, within which the vertex speaks for the sun: half-way to the centre of the patch.
const CORNER: f32 = 1.0 / 3.0;

/// Which suns reach which patch of the surfaces.
pub(crate) struct SunPatches {
    /// Components of the unit directions to the suns, in groups of a word, zero beyond the last.
    suns: Vec<[[f32; WORD]; 3]>,
    /// The division of each triangle; `first` counts patches.
    splits: Vec<Split>,
    /// For each patch its albedo (RGB9E5), then a word for each group of suns.
    ///
    /// A sun lights one side of a triangle only, the one that it stands before: its bit is that side's.
    records: Vec<u32>,
    /// Which suns reach the front of each vertex; none where it lies inside something.
    corners: SunMasks,
    channels: usize,
    /// The instructions that there are.
    pub arch: pulp::Arch,
    /// Rays that were traced.
    pub rays: u64,
}

impl SunPatches {
    /// `suns` are unit directions; those that are zero or not finite light nothing.
    ///
    /// # Errors
    /// Too many suns.
    pub fn new(surfaces: &Surfaces, layout: &Layout, suns: &[Vec3], params: &LightParams) -> Result<Self, LightError> {
        let component =
            |suns: &[Vec3], k: usize| std::array::from_fn(|i| suns.get(i).filter(|s| s.is_finite()).map_or(0.0, |s| s[k]));
        let suns_by_word = suns.chunks(WORD).map(|suns| [0, 1, 2].map(|k| component(suns, k))).collect();
        let parts = patches_by_sight(surfaces, &layout.seen(surfaces, params), params);
        let centres: Vec<Vec3> = (0..parts.len()).map(|t| centre_of(surfaces, t as u32)).collect();
        let normals: Vec<Vec3> = (0..parts.len()).map(|t| surfaces.face_normal(t as u32)).collect();
        let order = beam_order(&centres, Some(&normals));
        let mut splits = vec![Split { triangle: 0, parts: 1, first: 0 }; parts.len()];
        let mut first = 0;
        for &triangle in &order {
            let parts = parts[triangle as usize];
            splits[triangle as usize] = Split { triangle, parts, first };
            first += parts * parts;
        }
        let of_some = |triangles: &[u32]| {
            let splits = triangles.iter().map(|&t| splits[t as usize]);
            records(surfaces, splits, suns, params)
        };
        let (records, rays): (Vec<Vec<u32>>, Vec<u64>) = order.par_chunks(TOGETHER).map(of_some).unzip();
        let fronts = bake_sun_masks(surfaces, layout.points(), suns, 0..layout.front_count(), &MaskParams::default())?;
        let corners = fronts.pick((0..layout.vertex_count() as u32).map(|vertex| layout.front_point(vertex)));
        let rays = rays.into_iter().sum::<u64>() + corners.rays;
        let (records, channels) = (records.concat(), params.channels.count());
        Ok(Self { suns: suns_by_word, records, corners, splits, channels, arch: pulp::Arch::new(), rays })
    }

    /// How many patches there are.
    pub fn count(&self) -> usize {
        self.records.len() / (1 + self.suns.len())
    }

    /// Colour channels that bounce.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Numbers of a curve over the day for all channels: whole words of each.
    pub fn curve_len(&self) -> usize {
        self.channels * self.suns.len() * WORD
    }

    /// Numbers of such a curve that are of suns which can light something.
    pub fn live_numbers(&self) -> usize {
        let live = |[x, y, z]: &[[f32; WORD]; 3]| (0..WORD).filter(|&i| [x[i], y[i], z[i]] != [0.0; 3]).count();
        self.channels * self.suns.iter().map(live).sum::<usize>().max(1)
    }

    /// Adds to the curves of all channels what a place sends back of the sun's light, as light (irradiance / pi) of unit suns, times `share`.
    pub fn add_reflected(&self, surfaces: &Surfaces, hit: &Hit, share: Vec3, curves: &mut [f32]) {
        let Some(split) = self.splits.get(hit.triangle as usize) else { return };
        let patch = (split.first + split.sub_cell(hit.u, hit.v)) as usize;
        let stride = 1 + self.suns.len();
        let Some((&albedo, at_centre)) = self.records[patch * stride..(patch + 1) * stride].split_first() else { return };
        let words = self.at_corner(surfaces, hit, split.parts).unwrap_or(at_centre);
        if words.iter().all(|&word| word == 0) {
            return;
        }
        let normal = surfaces.normal_at(hit.triangle, hit.u, hit.v);
        let normal = if hit.back { -normal } else { normal };
        let share = share * linear_from_rgb9e5(albedo) * FRAC_1_PI;
        self.arch.dispatch(AddDirect { suns: &self.suns, words, normal, share, curves });
    }

    /// Which suns reach the vertex that a hit of a front is near to, nearer than to the centre of a patch; `None` away from vertices and at
    /// those that no sun ever reaches, which may lie inside something that the hit does not.
    fn at_corner(&self, surfaces: &Surfaces, hit: &Hit, parts: u32) -> Option<&[u32]> {
        let near = 1.0 - CORNER / parts as f32;
        let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
        let corner = weights.iter().position(|&weight| weight > near).filter(|_| !hit.back)?;
        let vertex = surfaces.triangles[hit.triangle as usize][corner];
        Some(self.corners.of_point(vertex as usize)).filter(|words| words.iter().any(|&word| word != 0))
    }
}

/// Adds to curves of channels the direct light of the suns of `words`; compiled for the instructions that there are.
struct AddDirect<'a> {
    suns: &'a [[[f32; WORD]; 3]],
    words: &'a [u32],
    normal: Vec3,
    share: Vec3,
    curves: &'a mut [f32],
}

impl pulp::NullaryFnOnce for AddDirect<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { suns, words, normal, share, curves } = self;
        let of_channel = suns.len() * WORD;
        for (group, (&word, [x, y, z])) in words.iter().zip(suns).enumerate() {
            if word == 0 {
                continue;
            }
            let mut light = [0.0_f32; WORD];
            for (i, light) in light.iter_mut().enumerate() {
                let cos = normal.x * x[i] + normal.y * y[i] + normal.z * z[i];
                *light = if word & 1 << i != 0 && cos > 0.0 { cos } else { 0.0 };
            }
            for (channel, curve) in curves.chunks_exact_mut(of_channel).enumerate() {
                let Some((curve, _)) = curve[group * WORD..].split_first_chunk_mut::<WORD>() else { continue };
                for (sum, light) in curve.iter_mut().zip(light) {
                    *sum += share[channel] * light;
                }
            }
        }
    }
}

fn centre_of(surfaces: &Surfaces, triangle: u32) -> Vec3 {
    let centre = surfaces.position_at(triangle, 1.0 / 3.0, 1.0 / 3.0);
    if centre.is_finite() { centre } else { Vec3::ZERO }
}

/// The records of some triangles' patches, in order, and the number of rays.
fn records(surfaces: &Surfaces, splits: impl Iterator<Item = Split>, suns: &[Vec3], params: &LightParams) -> (Vec<u32>, u64) {
    let (mut above, mut below, mut normals, mut albedos) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for split in splits {
        let normal = surfaces.face_normal(split.triangle);
        let offset_m = params.offset_m + surfaces.clearance_m(split.triangle);
        for (u, v) in split.centres() {
            let place = surfaces.position_at(split.triangle, u, v);
            let (place, normal) =
                if place.is_finite() && normal.is_finite() { (place, normal) } else { (Vec3::ZERO, Vec3::ZERO) };
            above.push(place + normal * offset_m);
            below.push(place - normal * offset_m);
            normals.push(normal);
            let albedo = match split.parts {
                1 => surfaces.albedo.mean(split.triangle),
                _ => surfaces.albedo.albedo(split.triangle, u, v),
            };
            albedos.push(rgb9e5_from_linear(reflected(albedo, params.channels)));
        }
    }
    let width = suns.len().div_ceil(WORD);
    let (mut front, mut back) = (vec![0; normals.len() * width], vec![0; normals.len() * width]);
    let mut rays = run_masks(surfaces, &above, &normals, suns, &mut front);
    normals.iter_mut().for_each(|n| *n = -*n);
    rays += run_masks(surfaces, &below, &normals, suns, &mut back);
    let mut records = Vec::with_capacity(albedos.len() * (1 + width));
    for (patch, albedo) in albedos.into_iter().enumerate() {
        records.push(albedo);
        let words = patch * width..(patch + 1) * width;
        records.extend(front[words.clone()].iter().zip(&back[words]).map(|(f, b)| f | b));
    }
    (records, rays)
}
