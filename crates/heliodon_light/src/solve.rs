//! From gathered blocks to the light of vertices.

use crate::bounce::{Lanes, Transport, find_validity};
use crate::follow::Arrival;
use crate::gather::{Lattice, bits};
use crate::params::MAX_SUN_STEPS;
use crate::sun_basis::{DayFunctions, day_functions};
use crate::{
    Channels, GatherBlock, Layout, LightError, LightParams, MaskParams, SunMasks, Surfaces, Validity, bake_sun_masks, gather,
};
use glam::Vec3;
use heliodon_math::color::{linear_from_rgb9e5, luminance};
use rayon::prelude::*;
use std::f32::consts::FRAC_1_PI;

/// Points whose curves over the day decide the functions of bounced sunlight.
const CURVES: usize = 2048;

/// The light of all vertices, N of them, in their own order. Invalid vertices hold what they borrowed.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexLight {
    /// Coefficients of the sky, C.
    pub coefficients: usize,
    /// Colour channels of transfer and bounced sunlight.
    pub channels: Channels,
    /// `N * C * channels` numbers, coefficient-major, then channel: light (irradiance / pi) is `max(0, sum_i T_i S_i)`.
    pub sky_transfer: Vec<f32>,
    /// Which vertices are valid, and where the others' light is from.
    pub validity: Validity,
    /// Bounced sunlight, where it was asked for.
    pub sun_bounce: Option<SunBounce>,
}

/// Bounced sunlight of all vertices for a sun of unit irradiance at normal incidence.
#[derive(Clone, Debug, PartialEq)]
pub struct SunBounce {
    /// R functions of T values, orthonormal.
    pub functions: Vec<Vec<f32>>,
    /// `N * R * channels` numbers, function-major, then channel: light at step t is `max(0, sum_r b_r f_r(t))`.
    pub coefficients: Vec<f32>,
    /// Median relative error of the compression over a sample of points; see [`DayFunctions`].
    pub median_error: f32,
    /// The same, 95th percentile.
    pub p95_error: f32,
}

/// The suns whose light bounces, and the masks of all the layout's points for them.
#[derive(Clone, Copy)]
pub struct SunInput<'a> {
    /// Unit directions to the sun.
    pub suns: &'a [Vec3],
    /// Masks in the order of [`Layout::points`].
    pub masks: &'a SunMasks,
}

/// Solves the bounces and hands out the light of the vertices.
///
/// `blocks` are all of the layout's points in order, gathered with the same suns where there are any.
///
/// # Errors
/// Blocks or masks that do not belong to the layout and the parameters.
pub fn solve(
    surfaces: &Surfaces,
    layout: &Layout,
    blocks: &[GatherBlock],
    sun: Option<SunInput>,
    params: &LightParams,
) -> Result<VertexLight, LightError> {
    params.validate()?;
    check_blocks(layout, blocks, sun.map(|sun| sun.suns.len()), params)?;
    if let Some(sun) = sun {
        check_masks(layout, &sun)?;
    }
    let validity = find_validity(surfaces, layout, blocks);
    let lattice = Lattice::new(params);
    let transport = Transport::new(surfaces, layout, blocks, &validity, &lattice, params.channels);

    let channels = params.channels.count();
    let sky = point_sky(layout, blocks, params.coefficients);
    let day = sun.map(|sun| day_functions_of(&transport, &sun, params));
    let direct = match (&sun, &day) {
        (Some(sun), Some(day)) => projected_sun(layout, sun, day),
        _ => Vec::new(),
    };
    let day_functions = day.as_ref().map_or(&[][..], |d| &d.functions);
    let lanes = Lanes { coefficients: params.coefficients, functions: day_functions, channels: params.channels };
    let functions = day_functions.len();
    let sky_lanes = lanes.sky();
    let bounced = transport.bounced(lanes, params.bounces, |point, first, out| {
        for (lane, out) in (first..).zip(out) {
            *out = match lane.checked_sub(sky_lanes) {
                None => sky[point * params.coefficients + lane / channels],
                Some(lane) => direct[point * functions + lane / channels],
            };
        }
    });

    let lanes = lanes.count();
    let of_vertex = |v: usize| layout.front_point(validity.source[v]) as usize;
    let sky_transfer = (0..layout.vertex_count())
        .flat_map(|v| {
            let p = of_vertex(v);
            let (sky, bounced) = (&sky[p * params.coefficients..], &bounced[p * lanes..]);
            (0..sky_lanes).map(move |l| sky[l / channels] + bounced[l])
        })
        .collect();
    let sun_bounce = day.map(|day| SunBounce {
        coefficients: (0..layout.vertex_count())
            .flat_map(|v| bounced[of_vertex(v) * lanes + sky_lanes..(of_vertex(v) + 1) * lanes].iter().copied())
            .collect(),
        functions: day.functions,
        median_error: day.median_error,
        p95_error: day.p95_error,
    });
    Ok(VertexLight { coefficients: params.coefficients, channels: params.channels, sky_transfer, validity, sun_bounce })
}

/// Masks of the vertices in their own order from those of the layout's points; invalid vertices take what they borrow.
#[must_use]
pub fn vertex_masks(layout: &Layout, masks: &SunMasks, validity: &Validity) -> SunMasks {
    masks.pick(validity.source.iter().map(|&v| layout.front_point(v)))
}

/// `suns`: how many there are, where their light bounces.
fn check_blocks(layout: &Layout, blocks: &[GatherBlock], suns: Option<usize>, params: &LightParams) -> Result<(), LightError> {
    let mut next = 0;
    for block in blocks {
        if block.range.start != next {
            return Err(LightError::Mismatch(format!("block {:?} where point {next} should follow", block.range)));
        }
        // without suns to bounce, what was followed to some does not matter
        block.validate(layout, suns.unwrap_or(MAX_SUN_STEPS), params)?;
        next = block.range.end;
    }
    if next != layout.points().len() {
        return Err(LightError::Mismatch(format!("blocks of {next} points, the layout has {}", layout.points().len())));
    }
    Ok(())
}

fn check_masks(layout: &Layout, sun: &SunInput) -> Result<(), LightError> {
    sun.masks.validate()?;
    let (steps, points) = (sun.masks.steps as usize, layout.points().len());
    if steps != sun.suns.len() || (steps > 0 && sun.masks.point_count() != points) {
        return Err(LightError::Mismatch(format!(
            "masks of {steps} steps and {} points for {} suns and {points} points",
            sun.masks.point_count(),
            sun.suns.len()
        )));
    }
    Ok(())
}

/// The sky's own light at all points.
fn point_sky(layout: &Layout, blocks: &[GatherBlock], coefficients: usize) -> Vec<f32> {
    let mut sky = Vec::with_capacity(layout.points().len() * coefficients);
    for block in blocks {
        sky.extend_from_slice(&block.sky);
    }
    sky
}

/// Adds to `curve` the direct light (irradiance / pi, unit sun) of a point at every step, times `weight`.
fn add_direct(layout: &Layout, sun: &SunInput, point: usize, weight: f32, curve: &mut [f32]) {
    let normal = layout.points().normals[point];
    for (word, &mask) in sun.masks.of_point(point).iter().enumerate() {
        for bit in bits(&[u64::from(mask)]) {
            let step = word * 32 + bit;
            curve[step] += weight * normal.dot(sun.suns[step]).max(0.0) * FRAC_1_PI;
        }
    }
}

/// The functions over the day, from the first bounce at a sample of the points that do not lie inside something.
fn day_functions_of(transport: &Transport, sun: &SunInput, params: &LightParams) -> DayFunctions {
    let steps = sun.suns.len();
    let points = transport.layout.points();
    let stride = points.len().div_ceil(CURVES).max(1);
    let curves: Vec<Vec<f32>> = transport
        .units()
        .par_iter()
        .map(|unit| {
            let offset = unit.range.start - unit.block.range.start;
            let picked: Vec<usize> = (0..unit.range.len())
                .filter(|i| (unit.range.start + i).is_multiple_of(stride))
                .filter(|i| unit.block.scale[offset + i] > 0.0 && unit.block.back[offset + i] <= crate::BACK_LIMIT)
                .collect();
            let mut curves = vec![0.0; picked.len() * steps];
            if picked.is_empty() {
                return curves;
            }
            let slot = |point: usize| picked.binary_search(&point).ok();
            let hits = transport.hits_of(unit);
            let mut next = hits.cells.iter();
            for (met, &direction) in hits.met.chunks_exact(unit.range.len().div_ceil(64)).zip(&transport.lattice.directions) {
                for (point, &cell) in bits(met).zip(&mut next) {
                    let (Some(slot), Some(cell)) = (slot(point), transport.cell_index(cell)) else { continue };
                    let cos = points.normals[unit.range.start + point].dot(direction) * unit.block.scale[offset + point];
                    let (lit_by, albedo) = transport.cell(cell);
                    let lit_by: Vec<usize> = lit_by.collect();
                    let weight = cos * luminance(albedo) / lit_by.len().max(1) as f32;
                    for lit in lit_by {
                        add_direct(transport.layout, sun, lit, weight, &mut curves[slot * steps..(slot + 1) * steps]);
                    }
                }
            }
            for &[key, light] in &unit.followed().sun {
                let Arrival { point, bounce, step } = Arrival::of(key);
                if bounce == 1
                    && let Some(slot) = slot(point)
                {
                    curves[slot * steps + step] += luminance(linear_from_rgb9e5(light)) * unit.block.scale[offset + point];
                }
            }
            curves
        })
        .collect();
    day_functions(&curves.concat(), steps, params.sun_functions, params.sun_error)
}

/// The direct sunlight of all points, projected to the functions.
fn projected_sun(layout: &Layout, sun: &SunInput, day: &DayFunctions) -> Vec<f32> {
    let (steps, functions) = (sun.suns.len(), day.functions.len());
    let mut projected = vec![0.0; layout.points().len() * functions];
    if functions == 0 {
        return projected;
    }
    projected.par_chunks_mut(functions).enumerate().for_each_init(
        || vec![0.0; steps],
        |curve, (point, out)| {
            curve.fill(0.0);
            add_direct(layout, sun, point, 1.0, curve);
            for (out, function) in out.iter_mut().zip(&day.functions) {
                *out = curve.iter().zip(function).map(|(c, f)| c * f).sum();
            }
        },
    );
    projected
}

/// Light and masks of one whole bake.
#[derive(Clone, Debug, PartialEq)]
pub struct Baked {
    /// Transfer and bounced sunlight.
    pub light: VertexLight,
    /// Sun masks of the vertices.
    pub masks: SunMasks,
    /// Rays of the gather.
    pub gather_rays: u64,
}

/// Everything in one call, for scenes that need not be saved half-way; sun bounce only where `sun_bounce` says so.
///
/// # Errors
/// Invalid surfaces or parameters, or more than 1,024 suns.
pub fn bake(surfaces: &Surfaces, suns: &[Vec3], sun_bounce: bool, params: &LightParams) -> Result<Baked, LightError> {
    let mut layout = Layout::new(surfaces, params)?;
    let bouncing = if sun_bounce { suns } else { &[] };
    let mut blocks = vec![gather(surfaces, &layout, bouncing, 0..layout.points().len(), params)?];
    loop {
        let more = layout.add_back_sides(surfaces, &blocks, params);
        if more.is_empty() {
            break;
        }
        blocks.push(gather(surfaces, &layout, bouncing, more, params)?);
    }
    let masks = bake_sun_masks(surfaces, layout.points(), suns, 0..layout.points().len(), &MaskParams::default())?;
    let sun = (sun_bounce && !suns.is_empty()).then_some(SunInput { suns, masks: &masks });
    let light = solve(surfaces, &layout, &blocks, sun, params)?;
    let masks = vertex_masks(&layout, &masks, &light.validity);
    Ok(Baked { masks, light, gather_rays: blocks.iter().map(|b| b.rays).sum() })
}

impl VertexLight {
    /// Vertices, N.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.validity.valid.len()
    }

    /// Sky light (irradiance / pi) of a vertex under the sky of `C` coefficients per colour, as a viewer shades it.
    #[must_use]
    pub fn sky_light(&self, vertex: usize, sky: &[Vec3]) -> Vec3 {
        let channels = self.channels.count();
        let transfer = &self.sky_transfer[vertex * self.coefficients * channels..];
        let of = |c: usize| -> f32 {
            (0..self.coefficients).map(|i| transfer[i * channels + c.min(channels - 1)] * sky[i][c]).sum::<f32>().max(0.0)
        };
        Vec3::new(of(0), of(1), of(2))
    }

    /// Bounced sunlight (irradiance / pi, unit sun) of a vertex at a step; 0 where none was solved.
    #[must_use]
    pub fn bounced_sun(&self, vertex: usize, step: usize) -> Vec3 {
        let Some(bounce) = &self.sun_bounce else { return Vec3::ZERO };
        let (channels, functions) = (self.channels.count(), bounce.functions.len());
        let b = &bounce.coefficients[vertex * functions * channels..];
        let of = |c: usize| -> f32 {
            let lane = |r: usize| b[r * channels + c.min(channels - 1)];
            bounce.functions.iter().enumerate().map(|(r, f)| lane(r) * f[step]).sum::<f32>().max(0.0)
        };
        Vec3::new(of(0), of(1), of(2))
    }

    /// Whether shapes agree and all numbers are finite.
    ///
    /// # Errors
    /// What is wrong.
    pub fn validate(&self) -> Result<(), LightError> {
        let wrong = |what: &str| Err(LightError::Mismatch(what.into()));
        let n = self.vertex_count();
        let finite = |numbers: &[f32]| numbers.iter().all(|x| x.is_finite());
        if self.sky_transfer.len() != n * self.coefficients * self.channels.count() || self.validity.source.len() != n {
            return wrong("transfer and vertices do not agree");
        }
        if !finite(&self.sky_transfer) {
            return wrong("transfer that is not finite");
        }
        let Some(sun) = &self.sun_bounce else { return Ok(()) };
        if sun.coefficients.len() != n * sun.functions.len() * self.channels.count() {
            return wrong("bounced sunlight and vertices do not agree");
        }
        if sun.functions.windows(2).any(|f| f[0].len() != f[1].len()) {
            return wrong("functions of unequal days");
        }
        if !finite(&sun.coefficients) || !sun.functions.iter().all(|f| finite(f)) {
            return wrong("bounced sunlight that is not finite");
        }
        Ok(())
    }
}
