//! Where the sun shines, more finely than vertices tell.
//!
//! A cell lit by the mean of its vertices is right on average; the shade beside a patch of sunlight is lit by that patch alone, and errs
//! as much as its edge. So triangles are divided into patches (those that fill much of the points' views the most finely) and each is
//! asked at its centre which suns reach it. What a ray meets is then lit by the sun at the place that it meets. Near a vertex it is the
//! vertex that was asked: rays that leave a vertex on rough ground meet the triangles beside it within millimetres, where the sun is
//! what it is at the vertex, whatever it is at their centres.

use crate::cells::Split;
use crate::change::Change;
use crate::masks::{Earlier, SunMasks, check_sun_count, run_masks};
use crate::refine::patches_by_sight;
use crate::surfaces::reflected;
use crate::traces::Rays;
use crate::{Layout, LightError, LightParams, Surfaces};
use glam::Vec3;
use heliodon_math::color::{linear_from_rgb9e5, rgb9e5_from_linear};
use heliodon_rays::{Hit, beam_order};
use rayon::prelude::*;
use std::f32::consts::FRAC_1_PI;
use std::ops::Range;

/// Triangles whose patches are asked together.
const TOGETHER: usize = 1024;

/// Suns of one word of a mask.
const WORD: usize = 32;

/// The part of a patch's edge, from a vertex, within which the vertex speaks for the sun: half-way to the centre of the patch.
const CORNER: f32 = 1.0 / 3.0;

/// How the surfaces are divided into patches. Ranges of their triangles may be asked for the suns apart, in any order.
#[derive(Clone, Debug)]
pub struct PatchPlan {
    /// The triangles in an order in which neighbours lie together.
    order: Vec<u32>,
    /// The division of each triangle; `first` counts patches in that order.
    splits: Vec<Split>,
}

impl PatchPlan {
    /// Divides the surfaces: what fills much of the points' views the most finely.
    #[must_use]
    pub fn new(surfaces: &Surfaces, layout: &Layout, params: &LightParams) -> Self {
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
        Self { order, splits }
    }

    /// Triangles; ranges count them in the plan's own order.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.order.len()
    }

    /// Its triangles in its order, each with the parts of its edges: patches of the triangles follow one another so.
    #[must_use]
    pub fn parts(&self) -> Vec<[u32; 2]> {
        self.of(0..self.order.len()).map(|split| [split.triangle, split.parts]).collect()
    }

    /// Patches of a range of the triangles.
    #[must_use]
    pub fn patch_count(&self, range: Range<usize>) -> usize {
        self.of(range).map(|split| (split.parts * split.parts) as usize).sum()
    }

    /// Ranges of all triangles, in order, of about so many patches each.
    #[must_use]
    pub fn ranges(&self, patches: usize) -> Vec<Range<usize>> {
        let (mut ranges, mut first, mut held) = (Vec::new(), 0, 0);
        for i in 0..self.order.len() {
            held += self.patch_count(i..i + 1);
            if held >= patches || i + 1 == self.order.len() {
                ranges.push(first..i + 1);
                (first, held) = (i + 1, 0);
            }
        }
        ranges
    }

    fn of(&self, range: Range<usize>) -> impl Iterator<Item = Split> + '_ {
        self.order[range].iter().map(|&triangle| self.splits[triangle as usize])
    }
}

/// Which suns reach the patches of some triangles.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SunlitPatches {
    /// The triangles, in the order of their [`PatchPlan`].
    pub range: Range<usize>,
    /// For each patch a word for each 32 suns.
    pub words: Vec<u32>,
    /// Rays that were traced.
    pub rays: u64,
}

impl SunlitPatches {
    /// Whether shapes agree with a plan and so many suns.
    ///
    /// # Errors
    /// What is wrong.
    pub fn validate(&self, plan: &PatchPlan, suns: usize) -> Result<(), LightError> {
        let fits = self.range.start <= self.range.end && self.range.end <= plan.triangle_count();
        if !fits || self.words.len() != plan.patch_count(self.range.clone()) * suns.div_ceil(WORD) {
            return Err(LightError::Mismatch("sunlit patches of another division or day".into()));
        }
        Ok(())
    }
}

/// Asks the patches of a range of a plan's triangles which suns (unit directions) reach them. Every number is the same however the
/// triangles are divided into ranges.
///
/// # Errors
/// Too many suns, or a range beyond the triangles.
pub fn light_patches(
    surfaces: &Surfaces,
    plan: &PatchPlan,
    suns: &[Vec3],
    range: Range<usize>,
    params: &LightParams,
) -> Result<SunlitPatches, LightError> {
    light_patches_knowing(surfaces, plan, suns, range, params, None).map(|(lit, _)| lit)
}

/// What patches of the same suns were before surfaces changed.
#[derive(Debug)]
pub struct PatchesBefore<'a> {
    /// What has changed.
    pub change: &'a Change,
    /// For each triangle of now that was there before: into how many parts each edge was divided, and its first patch among `words`.
    pub splits: Vec<Option<(u32, usize)>>,
    /// The words of each patch of before.
    pub words: Vec<u32>,
}

/// As [`light_patches`], which traces only rays of which nothing is known from `before` or that the change may reach; with the patches, how many
/// these were. They are the same whatever is known.
///
/// # Errors
/// As [`light_patches`].
pub fn light_patches_knowing(
    surfaces: &Surfaces,
    plan: &PatchPlan,
    suns: &[Vec3],
    range: Range<usize>,
    params: &LightParams,
    before: Option<&PatchesBefore>,
) -> Result<(SunlitPatches, u64), LightError> {
    check_sun_count(suns.len())?;
    if range.start > range.end || range.end > plan.triangle_count() {
        return Err(LightError::Mismatch(format!("triangles {range:?} of {}", plan.triangle_count())));
    }
    let firsts = range.clone().into_par_iter().step_by(TOGETHER);
    let of_run = |first: usize| {
        let splits: Vec<Split> = plan.of(first..(first + TOGETHER).min(range.end)).collect();
        words(surfaces, &splits, suns, params, before)
    };
    let (words, rays): (Vec<Vec<u32>>, Vec<Rays>) = firsts.map(of_run).unzip();
    let rays = rays.into_iter().fold(Rays::default(), Rays::plus);
    Ok((SunlitPatches { range, words: words.concat(), rays: rays.all }, rays.traced))
}

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
    /// Rays that the patches were asked with.
    pub rays: u64,
}

impl SunPatches {
    /// `suns` are unit directions; those that are zero or not finite light nothing. `lit` are all of the plan's triangles in order, `fronts`
    /// the masks of the layout's points on fronts.
    ///
    /// # Errors
    /// Parts that do not belong together.
    pub fn new(
        surfaces: &Surfaces,
        layout: &Layout,
        plan: PatchPlan,
        suns: &[Vec3],
        lit: Vec<SunlitPatches>,
        fronts: &SunMasks,
        params: &LightParams,
    ) -> Result<Self, LightError> {
        let component =
            |suns: &[Vec3], k: usize| std::array::from_fn(|i| suns.get(i).filter(|s| s.is_finite()).map_or(0.0, |s| s[k]));
        let suns_by_word = suns.chunks(WORD).map(|suns| [0, 1, 2].map(|k| component(suns, k))).collect();
        let (mut next, mut rays) = (0, 0);
        for part in &lit {
            part.validate(&plan, suns.len())?;
            if part.range.start != next {
                return Err(LightError::Mismatch(format!("patches of {:?} where triangle {next} should follow", part.range)));
            }
            next = part.range.end;
            rays += part.rays;
        }
        fronts.validate()?;
        if next != plan.triangle_count() || fronts.steps as usize != suns.len() || fronts.point_count() < layout.front_count() {
            return Err(LightError::Mismatch("patches or masks that do not cover the surfaces and the day".into()));
        }
        let width = suns.len().div_ceil(WORD);
        let mut records = Vec::with_capacity(plan.patch_count(0..plan.triangle_count()) * (1 + width));
        // one part after the other goes, so that they never lie in memory twice
        for part in lit {
            let albedos = albedos(surfaces, &plan, part.range, params);
            for (albedo, words) in albedos.into_iter().zip(part.words.chunks_exact(width.max(1))) {
                records.push(albedo);
                records.extend_from_slice(words);
            }
        }
        let corners = fronts.pick((0..layout.vertex_count() as u32).map(|vertex| layout.front_point(vertex)));
        let channels = params.channels.count();
        Ok(Self { suns: suns_by_word, records, corners, splits: plan.splits, channels, arch: pulp::Arch::new(), rays })
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

/// What the patches of a range of a plan's triangles reflect (RGB9E5), in order.
fn albedos(surfaces: &Surfaces, plan: &PatchPlan, range: Range<usize>, params: &LightParams) -> Vec<u32> {
    let of_triangle = |split: Split| {
        split.centres().map(move |(u, v)| {
            let albedo = match split.parts {
                1 => surfaces.albedo.mean(split.triangle),
                _ => surfaces.albedo.albedo(split.triangle, u, v),
            };
            rgb9e5_from_linear(reflected(albedo, params.channels))
        })
    };
    let splits: Vec<Split> = plan.of(range).collect();
    splits.into_par_iter().flat_map_iter(of_triangle).collect()
}

/// Which suns reach some triangles' patches, in order, and the number of rays.
fn words(
    surfaces: &Surfaces,
    splits: &[Split],
    suns: &[Vec3],
    params: &LightParams,
    before: Option<&PatchesBefore>,
) -> (Vec<u32>, Rays) {
    let (mut above, mut below, mut normals) = (Vec::new(), Vec::new(), Vec::new());
    let width = suns.len().div_ceil(WORD);
    let (mut words_before, mut known) = (Vec::new(), Vec::new());
    for split in splits {
        if let Some(before) = before {
            let same = before.splits[split.triangle as usize].filter(|&(parts, _)| parts == split.parts);
            let patches = (split.parts * split.parts) as usize;
            known.resize(known.len() + patches, same.is_some());
            match same {
                Some((_, first)) => words_before.extend_from_slice(&before.words[first * width..(first + patches) * width]),
                None => words_before.resize(words_before.len() + patches * width, 0),
            }
        }
        let normal = surfaces.face_normal(split.triangle);
        let offset_m = params.offset_m + surfaces.clearance_m(split.triangle);
        for (u, v) in split.centres() {
            let place = surfaces.position_at(split.triangle, u, v);
            let (place, normal) =
                if place.is_finite() && normal.is_finite() { (place, normal) } else { (Vec3::ZERO, Vec3::ZERO) };
            above.push(place + normal * offset_m);
            below.push(place - normal * offset_m);
            normals.push(normal);
        }
    }
    // a sun that stands before one side of a patch stands behind the other, so its bit is that of the side which asks
    let earlier = before.map(|before| Earlier { change: before.change, words: &words_before, known: &known });
    let (mut front, mut back) = (vec![0; normals.len() * width], vec![0; normals.len() * width]);
    let rays = run_masks(surfaces, (&above, &normals), suns, earlier, &mut front);
    normals.iter_mut().for_each(|n| *n = -*n);
    let rays = rays.plus(run_masks(surfaces, (&below, &normals), suns, earlier, &mut back));
    (front.into_iter().zip(back).map(|(f, b)| f | b).collect(), rays)
}
