//! Followed hits: surfaces met from so near that the light of their cell does not speak for them.
//!
//! A cell shows the light of its vertices. Seen from afar that is right on average; in a joint between two stones it is not: the
//! stone's face within has lit corners, all of them at the joint's rim, and is black. So what a ray meets nearer than half the
//! length of the cell is not kept as a hit: a path goes on from the very place, as a path tracer's would, until it escapes, meets a
//! cell from far enough, or has been followed [`MAX_FOLLOWED`] times. (Renderers that gather from a cache of light do the same
//! where the cache is too coarse: H. W. Jensen, "Realistic Image Synthesis Using Photon Mapping", 2001, section 8.5.)
//!
//! What paths bring is kept for the bounces as the hits are: with each contribution goes the bounce at which it arrives, so that
//! light that has bounced at most B times is the same sum as without paths.

use crate::gather::UNIT;
use crate::params::{Channels, MAX_SUN_STEPS};
use crate::{Layout, LightError, LightParams, Surfaces};
use glam::Vec3;
use heliodon_math::color::{luminance, rgb9e5_from_linear};
use heliodon_math::random::{hash3_u32, unit_f32};
use heliodon_math::sh::basis9;
use heliodon_math::sphere::sample_cosine_hemisphere;
use heliodon_rays::{Hit, NO_HIT, Ray};
use rayon::prelude::*;
use std::f32::consts::FRAC_1_PI;

/// How often a path is followed before its cell's light is taken all the same.
pub(crate) const MAX_FOLLOWED: usize = 8;

/// Rays to suns from the first place of a path; half as many from each further one.
const SUN_RAYS: usize = 2;

/// What followed paths bring to a run of points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Followed {
    /// Which point, and at which bounce, the sky's light of `sky` arrives: the point in
    /// its run in the lowest 10 bits, the sun's step in the next 10, the bounces made above.
    pub sky_keys: Vec<u32>,
    /// `C * channels` sums for each of `sky_keys`, coefficient-major.
    pub sky: Vec<f32>,
    /// Sunlight that arrives: key and packed colour (RGB9E5, light of a unit sun).
    pub sun: Vec<[u32; 2]>,
    /// Paths that end in a cell: key, packed share of the cell's light, cell (the highest bit tells the back).
    pub ends: Vec<[u32; 3]>,
}

/// Where and when something arrives: the point in its run, how many bounces the path has made, the sun's step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Arrival {
    pub point: usize,
    /// 1 to [`MAX_FOLLOWED`].
    pub bounce: usize,
    /// 0 but for sunlight.
    pub step: usize,
}

const POINT_BITS: u32 = UNIT.ilog2();
const STEP_BITS: u32 = MAX_SUN_STEPS.ilog2();

impl Arrival {
    /// Bounce above step above point, so that sorted keys go bounce by bounce.
    pub fn key(self) -> u32 {
        (self.bounce as u32) << (POINT_BITS + STEP_BITS) | (self.step as u32) << POINT_BITS | self.point as u32
    }

    pub fn of(key: u32) -> Self {
        Self {
            point: (key & ((1 << POINT_BITS) - 1)) as usize,
            step: (key >> POINT_BITS & ((1 << STEP_BITS) - 1)) as usize,
            bounce: (key >> (POINT_BITS + STEP_BITS)) as usize,
        }
    }
}

/// A hit that is to be followed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Near {
    /// In its run.
    pub point: u32,
    /// Cosine at the point.
    pub cos: f32,
    pub direction: Vec3,
    pub hit: Hit,
}

/// The suns whose light bounces.
pub(crate) struct LiveSuns {
    /// Step and unit direction.
    suns: Vec<(usize, Vec3)>,
    /// Consecutive picks lie this many suns apart, so that few picks spread over the day.
    stride: usize,
}

impl LiveSuns {
    pub fn new(suns: &[Vec3]) -> Self {
        let suns: Vec<(usize, Vec3)> =
            suns.iter().copied().enumerate().filter(|(_, s)| s.is_finite() && *s != Vec3::ZERO).collect();
        let coprime = |stride: &usize| {
            let (mut a, mut b) = (suns.len(), *stride);
            while b != 0 {
                (a, b) = (b, a % b);
            }
            a == 1
        };
        // nearly the golden section of the day, and every sun is picked in turn
        let stride = (suns.len() * 618 / 1000..suns.len()).find(coprime).unwrap_or(1);
        Self { suns, stride }
    }

    fn pick(&self, number: usize) -> (usize, Vec3) {
        self.suns[number % self.suns.len() * self.stride % self.suns.len()]
    }
}

/// One path at a place where it is followed.
struct Path {
    point: u32,
    /// The how-maniest of its point.
    index: u32,
    /// Cosine and albedos so far.
    share: Vec3,
    origin: Vec3,
    normal: Vec3,
}

/// Follows the hits of a run of points that begins at `first`; returns what they bring and the number of rays.
pub(crate) fn follow(
    surfaces: &Surfaces,
    layout: &Layout,
    suns: &LiveSuns,
    params: &LightParams,
    first: usize,
    mut near: Vec<Near>,
) -> (Followed, u64) {
    // rays of one point together: they start near each other
    near.sort_by_key(|n| n.point);
    // some points see nothing but what is near, so that runs differ by a hundred times in what there is to follow
    let groups: Vec<&[Near]> = near.chunk_by(|a, b| a.point / GROUP == b.point / GROUP).collect();
    let follow_group = |near: &[Near]| {
        let sky = vec![None; MAX_FOLLOWED * GROUP as usize];
        Run { surfaces, layout, suns, params, first, sky, out: Followed::default(), rays: 0 }.follow(near)
    };
    let done: Vec<(Followed, u64)> = groups.into_par_iter().map(follow_group).collect();
    let (mut followed, mut rays) = (Followed::default(), 0);
    for (part, more) in done {
        followed.sky_keys.extend(part.sky_keys);
        followed.sky.extend(part.sky);
        followed.sun.extend(part.sun);
        followed.ends.extend(part.ends);
        rays += more;
    }
    (followed, rays)
}

/// Points whose paths are followed together.
const GROUP: u32 = 32;

/// Nine coefficients of up to three channels; with one channel, the first nine numbers.
type SkySums = [[f32; 9]; 3];

struct Run<'a> {
    surfaces: &'a Surfaces<'a>,
    layout: &'a Layout,
    suns: &'a LiveSuns,
    params: &'a LightParams,
    /// The layout's point that the first of the points is.
    first: usize,
    /// By bounce and point of the group.
    sky: Vec<Option<Box<SkySums>>>,
    out: Followed,
    rays: u64,
}

impl Run<'_> {
    /// Follows the hits of a group of points.
    fn follow(mut self, near: &[Near]) -> (Followed, u64) {
        let (mut paths, mut last, mut index) = (Vec::with_capacity(near.len()), u32::MAX, 0);
        for n in near {
            index = if n.point == last { index + 1 } else { 0 };
            last = n.point;
            paths.extend(self.reflected(n.point, index, Vec3::splat(n.cos), n.direction, &n.hit));
        }
        let most = MAX_FOLLOWED.min(self.params.bounces as usize);
        for bounce in 1..=most {
            self.add_suns(bounce, &paths);
            paths = self.go_on(bounce, most, paths);
        }
        let width = self.params.coefficients * self.params.channels.count();
        let group = near.first().map_or(0, |n| n.point / GROUP * GROUP) as usize;
        for (slot, sums) in self.sky.iter().enumerate() {
            if let Some(sums) = sums {
                let (point, bounce) = (group + slot % GROUP as usize, slot / GROUP as usize + 1);
                self.out.sky_keys.push(Arrival { point, bounce, step: 0 }.key());
                self.out.sky.extend_from_slice(&sums.as_flattened()[..width]);
            }
        }
        (self.out, self.rays)
    }

    /// The path that goes on from a hit, unless the surface reflects nothing.
    fn reflected(&self, point: u32, index: u32, share: Vec3, direction: Vec3, hit: &Hit) -> Option<Path> {
        let albedo = self.surfaces.reflected_at(hit);
        let share = share * if self.params.channels == Channels::Mono { Vec3::splat(luminance(albedo)) } else { albedo };
        let (origin, normal) = self.surfaces.leave(direction, hit, self.params.offset_m);
        (share != Vec3::ZERO).then_some(Path { point, index, share, origin, normal })
    }

    /// Direct sunlight at the places: few suns from each, all of them in turn from those that a point sees.
    fn add_suns(&mut self, bounce: usize, paths: &[Path]) {
        let count = self.suns.suns.len();
        let each = (SUN_RAYS >> (bounce - 1)).max(1).min(count);
        if count == 0 {
            return;
        }
        let (mut rays, mut carried) = (Vec::new(), Vec::new());
        for path in paths {
            let start = hash3_u32(self.params.seed, self.first as u32 + path.point, bounce as u32) as usize;
            for k in 0..each {
                let (step, sun) = self.suns.pick(start % count + path.index as usize * each + k);
                let cos = path.normal.dot(sun);
                if cos > 0.0 {
                    rays.push(Ray { origin: path.origin, direction: sun, t_min: 0.0, t_max: f32::INFINITY });
                    let arrival = Arrival { point: path.point as usize, bounce, step };
                    carried.push((arrival, path.share * (cos * FRAC_1_PI * count as f32 / each as f32)));
                }
            }
        }
        let mut occluded = vec![0_u64; rays.len().div_ceil(64)];
        self.surfaces.rays.occluded(&rays, &mut occluded);
        self.rays += rays.len() as u64;
        for (i, (arrival, light)) in carried.into_iter().enumerate() {
            if occluded[i / 64] >> (i % 64) & 1 == 0 {
                self.out.sun.push([arrival.key(), rgb9e5_from_linear(light)]);
            }
        }
    }

    /// One further direction of every path; returns those that are followed again.
    fn go_on(&mut self, bounce: usize, most: usize, paths: Vec<Path>) -> Vec<Path> {
        let directions: Vec<Vec3> = paths
            .iter()
            .map(|path| {
                let turn = hash3_u32(self.params.seed ^ 0x5EED, self.first as u32 + path.point, bounce as u32);
                sample_cosine_hemisphere(path.normal, numbers(turn, path.index))
            })
            .collect();
        let rays: Vec<Ray> = paths
            .iter()
            .zip(&directions)
            .map(|(path, &direction)| Ray { origin: path.origin, direction, t_min: 0.0, t_max: f32::INFINITY })
            .collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        self.surfaces.rays.closest(&rays, &mut hits);
        self.rays += rays.len() as u64;
        let mut next = Vec::new();
        for ((path, direction), hit) in paths.into_iter().zip(directions).zip(&hits) {
            if hit.triangle == NO_HIT {
                self.add_sky(bounce, &path, direction);
            } else if bounce < most && self.layout.is_near(hit) {
                next.extend(self.reflected(path.point, path.index, path.share, direction, hit));
            } else {
                let key = Arrival { point: path.point as usize, bounce, step: 0 }.key();
                self.out.ends.push([key, rgb9e5_from_linear(path.share), self.layout.cell_of_hit(hit)]);
            }
        }
        next
    }

    fn add_sky(&mut self, bounce: usize, path: &Path, direction: Vec3) {
        let sums = self.sky[(bounce - 1) * GROUP as usize + (path.point % GROUP) as usize].get_or_insert_with(Box::default);
        let channels = self.params.channels.count();
        let basis = basis9(direction);
        for (i, y) in basis[..self.params.coefficients].iter().enumerate() {
            for c in 0..channels {
                sums.as_flattened_mut()[i * channels + c] += y * path.share[c];
            }
        }
    }
}

/// Two numbers in [0, 1): those of one `turn` fill the square evenly (R2: M. Roberts, "The Unreasonable Effectiveness of
/// Quasirandom Sequences", 2018).
fn numbers(turn: u32, index: u32) -> [f32; 2] {
    // 2^32 over the plastic number and its square; whole numbers wrap where fractions would
    const STEPS: [u32; 2] = [3_242_174_889, 2_447_445_414];
    [0, 1].map(|k| unit_f32(turn.rotate_left(16 * k).wrapping_add(index.wrapping_mul(STEPS[k as usize]))))
}

impl Followed {
    /// Whether lengths and numbers agree with a run of `points` points, `cells` cells and `steps` suns.
    pub(crate) fn validate(&self, points: usize, cells: usize, steps: usize, params: &LightParams) -> Result<(), LightError> {
        let wrong = |what| Err(LightError::Block(what));
        let fits = |key: u32| {
            let at = Arrival::of(key);
            at.point < points && (1..=MAX_FOLLOWED).contains(&at.bounce)
        };
        if self.sky.len() != self.sky_keys.len() * params.coefficients * params.channels.count()
            || !self.sky.iter().all(|x| x.is_finite())
        {
            return wrong("paths' sky and its numbers do not agree");
        }
        let keys = self.sky_keys.iter().copied().chain(self.sun.iter().map(|s| s[0])).chain(self.ends.iter().map(|e| e[0]));
        if !keys.into_iter().all(fits) || self.sun.iter().any(|s| Arrival::of(s[0]).step >= steps) {
            return wrong("paths of points, bounces or suns that are not there");
        }
        if self.ends.iter().any(|end| (end[2] & !crate::cells::BACK) as usize >= cells) {
            return wrong("paths to cells that the layout has not");
        }
        Ok(())
    }

    /// Bytes that it takes.
    pub(crate) fn bytes(&self) -> usize {
        4 * (self.sky_keys.len() + self.sky.len() + 2 * self.sun.len() + 3 * self.ends.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_hold_what_they_are_made_of() {
        for (point, bounce, step) in [(0, 1, 0), (UNIT - 1, MAX_FOLLOWED, MAX_SUN_STEPS - 1), (513, 2, 91)] {
            let arrival = Arrival { point, bounce, step };
            assert_eq!(Arrival::of(arrival.key()), arrival);
        }
    }

    #[test]
    fn every_sun_is_picked_in_turn() {
        for count in [1, 2, 3, 12, 92, 1024] {
            let suns = LiveSuns::new(&vec![Vec3::Y; count]);
            let mut picked: Vec<usize> = (0..count).map(|n| suns.pick(7 + n).0).collect();
            picked.sort_unstable();
            assert!(picked.iter().enumerate().all(|(i, &p)| i == p), "{count} suns");
        }
        assert!(LiveSuns::new(&[Vec3::ZERO, Vec3::NAN]).suns.is_empty());
    }

    #[test]
    fn numbers_fill_the_square() {
        let all: Vec<[f32; 2]> = (0..256).map(|i| numbers(0x1234_5678, i)).collect();
        for cell in 0..16 {
            let (x, y) = ((cell % 4) as f32 / 4.0, (cell / 4) as f32 / 4.0);
            let count = all.iter().filter(|n| (x..x + 0.25).contains(&n[0]) && (y..y + 0.25).contains(&n[1])).count();
            assert!((12..=20).contains(&count), "{count} of 256 in a sixteenth");
        }
    }
}
