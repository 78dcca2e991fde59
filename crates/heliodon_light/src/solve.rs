//! From gathered blocks to the light of vertices.

use crate::bounce::{CellLight, Lanes, Transport, find_validity};
use crate::free::free_light;
use crate::gather::Lattice;
use crate::{
    BouncedSun, Channels, FreeLight, GatherBlock, KeptBounces, Layout, LightError, LightParams, MaskParams, SunMasks, Surfaces,
    Validity, bake_sun_masks, gather,
};
use glam::Vec3;

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
    /// Median relative error of the compression over a sample of points; see [`crate::DayFunctions`].
    pub median_error: f32,
    /// The same, 95th percentile.
    pub p95_error: f32,
}

/// Solves the bounces and hands out the light of the vertices.
///
/// `blocks` are all of the layout's points in order, gathered with the same `sun` where its light bounces.
///
/// # Errors
/// Blocks that do not belong to the layout and the parameters.
pub fn solve(
    surfaces: &Surfaces,
    layout: &Layout,
    blocks: &[GatherBlock],
    sun: Option<&BouncedSun>,
    params: &LightParams,
) -> Result<VertexLight, LightError> {
    solve_all(surfaces, layout, blocks, sun, params, None, None).map(|(of_vertices, _)| of_vertices)
}

/// As [`solve`], with the light of the layout's points in free space; where it is asked for, what the cells reflect is kept for [`crate::Receivers`].
/// Light goes on bouncing from what was `kept` of an earlier run, if anything was.
///
/// # Errors
/// As [`solve`].
pub fn solve_all(
    surfaces: &Surfaces,
    layout: &Layout,
    blocks: &[GatherBlock],
    sun: Option<&BouncedSun>,
    params: &LightParams,
    mut keep: Option<&mut CellLight>,
    kept: Option<&dyn KeptBounces>,
) -> Result<(VertexLight, FreeLight), LightError> {
    params.validate()?;
    let functions = sun.map_or(0, BouncedSun::function_count);
    check_blocks(layout, blocks, functions, params)?;
    let validity = find_validity(surfaces, layout, blocks);
    let lattice = Lattice::new(params);
    let transport = Transport::new(surfaces, layout, blocks, &validity, &lattice, params.channels);

    let channels = params.channels.count();
    let sky = point_sky(layout, blocks, params.coefficients);
    let lanes = Lanes::new(params, functions);
    let sky_lanes = lanes.sky();
    if let Some(keep) = &mut keep {
        **keep = CellLight { groups: Vec::new(), bounces: params.bounces, functions };
    }
    let bounced = transport.bounced(lanes, params.bounces, keep, kept);

    let lanes = lanes.count();
    let free = free_light(layout, blocks, &sky, (&bounced, lanes, sky_lanes), params);
    let of_vertex = |v: usize| layout.front_point(validity.source[v]) as usize;
    let sky_transfer = (0..layout.vertex_count())
        .flat_map(|v| {
            let p = of_vertex(v);
            let (sky, bounced) = (&sky[p * params.coefficients..], &bounced[p * lanes..]);
            (0..sky_lanes).map(move |l| sky[l / channels] + bounced[l])
        })
        .collect();
    let sun_bounce = sun.map(|sun| SunBounce {
        coefficients: (0..layout.vertex_count())
            .flat_map(|v| bounced[of_vertex(v) * lanes + sky_lanes..(of_vertex(v) + 1) * lanes].iter().copied())
            .collect(),
        functions: sun.day.functions.clone(),
        median_error: sun.day.median_error,
        p95_error: sun.day.p95_error,
    });
    let of_vertices =
        VertexLight { coefficients: params.coefficients, channels: params.channels, sky_transfer, validity, sun_bounce };
    Ok((of_vertices, free))
}

/// Masks of the vertices in their own order from those of the layout's points on fronts ([`Layout::front_count`] are enough); invalid
/// vertices take what they borrow.
#[must_use]
pub fn vertex_masks(layout: &Layout, masks: &SunMasks, validity: &Validity) -> SunMasks {
    masks.pick(validity.source.iter().map(|&v| layout.front_point(v)))
}

fn check_blocks(layout: &Layout, blocks: &[GatherBlock], functions: usize, params: &LightParams) -> Result<(), LightError> {
    let mut next = 0;
    for block in blocks {
        if block.range.start != next {
            return Err(LightError::Mismatch(format!("block {:?} where point {next} should follow", block.range)));
        }
        block.validate(layout, functions, params)?;
        next = block.range.end;
    }
    if next != layout.points().len() {
        return Err(LightError::Mismatch(format!("blocks of {next} points, the layout has {}", layout.points().len())));
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
    let sun = if sun_bounce { BouncedSun::new(surfaces, &layout, suns, params)? } else { None };
    let sun = sun.as_ref();
    let mut blocks = vec![gather(surfaces, &layout, sun, 0..layout.points().len(), params)?];
    loop {
        let more = layout.add_back_sides(surfaces, &blocks, params);
        if more.is_empty() {
            break;
        }
        blocks.push(gather(surfaces, &layout, sun, more, params)?);
    }
    let masks = bake_sun_masks(surfaces, layout.points(), suns, 0..layout.front_count(), &MaskParams::default())?;
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
