//! Points in free space, where no surface is: what lights a figure that passes there.
//!
//! They are receivers only: nothing bounces off them, and the light of the surfaces is the same, bit for bit, with and without them.
//! They are gathered, asked for the suns and solved by the very code that serves vertices, as points behind all others of a layout.

use crate::points::Place;
use crate::{Channels, GatherBlock, Layout, LightError, LightParams, SunBounce, SunMasks, VertexLight};
use glam::Vec3;
use std::ops::Range;

/// Light of points in free space, P of them, in the order in which [`Layout::add_free_points`] was given them.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeLight {
    /// `P * C * channels` numbers, as [`VertexLight::sky_transfer`].
    pub sky_transfer: Vec<f32>,
    /// `P * R * channels` numbers, as [`SunBounce::coefficients`]; empty where no sun bounces.
    pub sun_bounce: Vec<f32>,
    /// The part of each point's view that insides of things fill, as [`GatherBlock::back`]; 1 where it has no direction to look in.
    pub back: Vec<f32>,
}

impl Layout {
    /// Adds points in free space, each a position in metres and a unit normal, behind all others, and returns their range. To be called
    /// at most once, after the last round of [`Layout::add_back_sides`]; the points must be gathered before [`crate::solve_all`], be it
    /// with another layout of the same surfaces that had no back sides yet.
    ///
    /// Their rays start at the positions themselves: there is no surface that they could meet by mistake.
    pub fn add_free_points(&mut self, places: &[(Vec3, Vec3)]) -> Range<usize> {
        let place = |(site, &(position, normal)): (usize, &(Vec3, Vec3))| Place {
            position,
            normal,
            inward: Vec3::ZERO,
            site: site as u32,
        };
        self.append_free(places.iter().enumerate().map(place))
    }

    /// The masks of the points in free space, in the order in which they were added, from those of their range.
    #[must_use]
    pub fn free_masks(&self, masks: &SunMasks) -> SunMasks {
        let first = self.free_range().start as u32;
        masks.pick(self.free_points().iter().map(|point| point - first))
    }

    fn free_range(&self) -> Range<usize> {
        self.points().len() - self.free_points().len()..self.points().len()
    }
}

/// Takes the light of the points in free space out of that of all points: the sky's own, `sky` coefficients a point, and what has
/// bounced, `lanes` numbers a point, the first `sky_lanes` of the sky.
pub(crate) fn free_light(
    layout: &Layout,
    blocks: &[GatherBlock],
    sky: &[f32],
    (bounced, lanes, sky_lanes): (&[f32], usize, usize),
    params: &LightParams,
) -> FreeLight {
    let (coefficients, channels) = (params.coefficients, params.channels.count());
    let range = layout.free_range();
    let of_range = |value: fn(&GatherBlock, usize) -> f32| -> Vec<f32> {
        let all = blocks.iter().flat_map(|block| block.range.clone().enumerate().map(move |(i, point)| (block, i, point)));
        all.filter(|&(_, _, point)| point >= range.start).map(|(block, i, _)| value(block, i)).collect()
    };
    let (back, scale) = (of_range(|block, i| block.back[i]), of_range(|block, i| block.scale[i]));
    let mut light = FreeLight { sky_transfer: Vec::new(), sun_bounce: Vec::new(), back: Vec::new() };
    for &point in layout.free_points() {
        let point = point as usize;
        let bounced = &bounced[point * lanes..(point + 1) * lanes];
        light.sky_transfer.extend((0..sky_lanes).map(|l| sky[point * coefficients + l / channels] + bounced[l]));
        light.sun_bounce.extend_from_slice(&bounced[sky_lanes..]);
        let i = point - range.start;
        light.back.push(if scale[i] > 0.0 { back[i] } else { 1.0 });
    }
    light
}

impl FreeLight {
    /// Points, P.
    #[must_use]
    pub fn point_count(&self) -> usize {
        self.back.len()
    }

    /// Whether shapes agree with a solved light of vertices and all numbers are finite.
    ///
    /// # Errors
    /// What is wrong.
    pub fn validate(&self, of_vertices: &VertexLight) -> Result<(), LightError> {
        let (count, channels): (usize, Channels) = (self.point_count(), of_vertices.channels);
        let functions = of_vertices.sun_bounce.as_ref().map_or(0, |sun: &SunBounce| sun.functions.len());
        let right = [
            (&self.sky_transfer, of_vertices.coefficients * channels.count()),
            (&self.sun_bounce, functions * channels.count()),
            (&self.back, 1),
        ];
        if right.iter().any(|(list, of_point)| list.len() != count * of_point) {
            return Err(LightError::Mismatch("light and points in free space do not agree".into()));
        }
        if right.iter().any(|(list, _)| list.iter().any(|x| !x.is_finite())) {
            return Err(LightError::Mismatch("light of free space that is not finite".into()));
        }
        Ok(())
    }
}
