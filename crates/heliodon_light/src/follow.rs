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

use crate::cells::Among;
use crate::gather::UNIT;
use crate::traces::{KeptHit, MISSED, Rays, kept, of_kept};
use crate::{BouncedSun, LightError, LightParams, Surfaces};
use glam::Vec3;
use heliodon_math::color::rgb9e5_from_linear;
use heliodon_math::random::{hash3_u32, unit_f32};
use heliodon_math::sh::basis9;
use heliodon_math::sphere::sample_cosine_hemisphere;
use heliodon_rays::{Hit, NO_HIT, Ray};
use rayon::prelude::*;

/// How often a path is followed before its cell's light is taken all the same.
pub const MAX_FOLLOWED: usize = 8;

/// What followed paths bring to a run of points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Followed {
    /// Which point, and at which bounce, the numbers of `light` arrive: the point in its run in the lowest 10 bits, the bounces
    /// made above.
    pub keys: Vec<u32>,
    /// For each of `keys` the sums of all lanes: C coefficients of the sky with their channels, then R functions of the sun with theirs.
    pub light: Vec<f32>,
    /// Paths that end in a cell, by bounce and cell: key, packed share of the cell's light (RGB9E5), cell (the highest bit tells the back). What the sun
    /// itself lights there, and at all places on the way, is in `light` and in the gather's own sums.
    pub ends: Vec<[u32; 3]>,
}

/// Where and when something arrives: the point in its run, how many bounces the path has made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Arrival {
    pub point: usize,
    /// 1 to [`MAX_FOLLOWED`], and one more for the sun on the cell in which a path ends.
    pub bounce: usize,
}

const POINT_BITS: u32 = UNIT.ilog2();

impl Arrival {
    /// Bounce above point, so that sorted keys go bounce by bounce.
    pub fn key(self) -> u32 {
        (self.bounce as u32) << POINT_BITS | self.point as u32
    }

    pub fn of(key: u32) -> Self {
        Self { point: (key & ((1 << POINT_BITS) - 1)) as usize, bounce: (key >> POINT_BITS) as usize }
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

/// What following has brought, and what its rays met.
#[derive(Default)]
pub(crate) struct Done {
    pub followed: Followed,
    pub rays: Rays,
    /// Rays of each group of points, in order.
    pub counts: Vec<u32>,
    /// What they met.
    pub paths: Vec<KeptHit>,
}

/// Follows the hits of a run of points that begins at `first`; `known` are counts and hits of an earlier [`Done`] of the same hits among
/// surfaces of the same albedo, with the same bounces.
pub(crate) fn follow(
    surfaces: &Surfaces,
    among: Among,
    sun: Option<&BouncedSun>,
    params: &LightParams,
    (first, mut near): (usize, Vec<Near>),
    known: Option<(&[u32], &[KeptHit])>,
) -> Done {
    // rays of one point together: they start near each other
    near.sort_by_key(|n| n.point);
    // some points see nothing but what is near, so that runs differ by a hundred times in what there is to follow
    let groups: Vec<&[Near]> = near.chunk_by(|a, b| a.point / GROUP == b.point / GROUP).collect();
    let mut known_of: Vec<&[KeptHit]> = vec![&[]; groups.len()];
    if let Some((counts, mut rest)) = known.filter(|(counts, _)| counts.len() == groups.len()) {
        for (known, &count) in known_of.iter_mut().zip(counts) {
            let (of_group, others) = rest.split_at(rest.len().min(count as usize));
            (*known, rest) = (of_group, others);
        }
    }
    let follow_group = |(near, known): (&[Near], &[KeptHit])| {
        let sums = (0..(MAX_FOLLOWED + 1) * GROUP as usize).map(|_| None).collect();
        let (ends, met, rays) = (Vec::new(), Vec::new(), Rays::default());
        Run { surfaces, among, sun, params, first, sums, ends, known, met, rays }.follow(near)
    };
    let of_groups: Vec<Done> = groups.into_par_iter().zip(known_of).map(follow_group).collect();
    let mut done = Done::default();
    for more in of_groups {
        done.followed.keys.extend(more.followed.keys);
        done.followed.light.extend(more.followed.light);
        done.followed.ends.extend(more.followed.ends);
        done.rays.all += more.rays.all;
        done.rays.traced += more.rays.traced;
        done.counts.push(more.paths.len() as u32);
        done.paths.extend(more.paths);
    }
    // bounces read cells in this order: what follows one another lies beside one another in memory
    done.followed.ends.sort_unstable_by_key(|&[key, share, cell]| (Arrival::of(key).bounce, cell, key, share));
    done
}

/// Points whose paths are followed together.
const GROUP: u32 = 32;

/// What arrives at a point at one bounce.
struct Sums {
    /// Nine coefficients of the sky for up to three channels, coefficient-major.
    sky: [f32; 27],
    /// Curves of the sun over the day, one a channel.
    sun: Vec<f32>,
}

struct Run<'a> {
    surfaces: &'a Surfaces<'a>,
    among: Among<'a>,
    sun: Option<&'a BouncedSun>,
    params: &'a LightParams,
    /// The point that the first of the run is.
    first: usize,
    /// By bounce and point of the group.
    sums: Vec<Option<Box<Sums>>>,
    ends: Vec<[u32; 3]>,
    /// What the rays to come meet, as far as it is known, and what those so far have met.
    known: &'a [KeptHit],
    met: Vec<KeptHit>,
    rays: Rays,
}

impl Run<'_> {
    /// Follows the hits of a group of points.
    fn follow(mut self, near: &[Near]) -> Done {
        let (mut paths, mut last, mut index) = (Vec::with_capacity(near.len()), u32::MAX, 0);
        for n in near {
            index = if n.point == last { index + 1 } else { 0 };
            last = n.point;
            paths.extend(self.reflected((n.point, index), Vec3::splat(n.cos), n.direction, &n.hit));
        }
        let most = MAX_FOLLOWED.min(self.params.bounces as usize);
        for bounce in 1..=most {
            paths = self.go_on(bounce, most, paths);
        }
        let sky_lanes = self.params.coefficients * self.params.channels.count();
        let group = near.first().map_or(0, |n| n.point / GROUP * GROUP) as usize;
        let mut followed = Followed { ends: self.ends, ..Followed::default() };
        for (slot, sums) in self.sums.iter().enumerate() {
            if let Some(sums) = sums {
                let (point, bounce) = (group + slot % GROUP as usize, slot / GROUP as usize + 1);
                followed.keys.push(Arrival { point, bounce }.key());
                followed.light.extend_from_slice(&sums.sky[..sky_lanes]);
                if let Some(sun) = self.sun {
                    sun.project(&sums.sun, &mut followed.light);
                }
            }
        }
        Done { followed, rays: self.rays, counts: Vec::new(), paths: self.met }
    }

    /// What rays meet, which are traced only where that is not known.
    fn closest(&mut self, rays: &[Ray]) -> Vec<Hit> {
        let begin = self.met.len();
        match self.known.split_at_checked(rays.len()) {
            Some((known, rest)) => {
                self.met.extend_from_slice(known);
                self.known = rest;
                self.rays.all += rays.len() as u64;
            }
            None => {
                let mut raw = vec![Hit::MISS; rays.len()];
                self.surfaces.rays.closest(rays, &mut raw);
                self.met.extend(raw.iter().map(|hit| kept(hit).unwrap_or(MISSED)));
                self.known = &[];
                self.rays.add(rays.len() as u64);
            }
        }
        let told = |(ray, &hit): (&Ray, &KeptHit)| match hit {
            MISSED => Hit::MISS,
            hit => self.surfaces.told(ray.origin, ray.direction, of_kept(hit)),
        };
        rays.iter().zip(&self.met[begin..]).map(told).collect()
    }

    /// The path that goes on from a hit, unless the surface reflects nothing.
    fn reflected(&self, (point, index): (u32, u32), share: Vec3, direction: Vec3, hit: &Hit) -> Option<Path> {
        let share = share * self.surfaces.reflected_at(hit, self.params.channels);
        let (origin, normal) = self.surfaces.leave(direction, hit, self.params.offset_m);
        (share != Vec3::ZERO).then_some(Path { point, index, share, origin, normal })
    }

    /// What has arrived so far at a point at a bounce.
    fn sums(&mut self, bounce: usize, point: u32) -> &mut Sums {
        let curves = self.sun.map_or(0, |sun| sun.patches.curve_len());
        let empty = || Box::new(Sums { sky: [0.0; 27], sun: vec![0.0; curves] });
        self.sums[(bounce - 1) * GROUP as usize + (point % GROUP) as usize].get_or_insert_with(empty)
    }

    /// One further direction of every path; returns those that are followed again.
    fn go_on(&mut self, bounce: usize, most: usize, paths: Vec<Path>) -> Vec<Path> {
        let directions: Vec<Vec3> = paths
            .iter()
            .map(|path| {
                let point = self.among.label_of(self.first as u32 + path.point);
                let turn = hash3_u32(self.params.seed ^ 0x5EED, point, bounce as u32);
                sample_cosine_hemisphere(path.normal, numbers(turn, path.index))
            })
            .collect();
        let rays: Vec<Ray> = paths
            .iter()
            .zip(&directions)
            .map(|(path, &direction)| Ray { origin: path.origin, direction, t_min: 0.0, t_max: f32::INFINITY })
            .collect();
        let hits = self.closest(&rays);
        let surfaces = self.surfaces;
        let mut next = Vec::new();
        for ((path, direction), hit) in paths.into_iter().zip(directions).zip(&hits) {
            if hit.triangle == NO_HIT {
                self.add_sky(bounce, &path, direction);
                continue;
            }
            if let Some(sun) = self.sun {
                sun.patches.add_reflected(surfaces, hit, path.share, &mut self.sums(bounce + 1, path.point).sun);
            }
            if bounce < most && self.among.layout.is_near(hit) {
                next.extend(self.reflected((path.point, path.index), path.share, direction, hit));
            } else {
                let key = Arrival { point: path.point as usize, bounce }.key();
                self.ends.push([key, rgb9e5_from_linear(path.share), self.among.layout.cell_of_hit(hit)]);
            }
        }
        next
    }

    fn add_sky(&mut self, bounce: usize, path: &Path, direction: Vec3) {
        let (coefficients, channels) = (self.params.coefficients, self.params.channels.count());
        let sums = self.sums(bounce, path.point);
        for (i, y) in basis9(direction)[..coefficients].iter().enumerate() {
            for c in 0..channels {
                sums.sky[i * channels + c] += y * path.share[c];
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
    /// Whether lengths and numbers agree with a run of `points` points, `cells` cells and so many lanes.
    pub(crate) fn validate(&self, points: usize, cells: usize, lanes: usize) -> Result<(), LightError> {
        let wrong = |what| Err(LightError::Block(what));
        if self.light.len() != self.keys.len() * lanes || !self.light.iter().all(|x| x.is_finite()) {
            return wrong("paths' light and its numbers do not agree");
        }
        let fits = |key: u32| {
            let at = Arrival::of(key);
            at.point < points && (1..=MAX_FOLLOWED + 1).contains(&at.bounce)
        };
        if !self.keys.iter().copied().chain(self.ends.iter().map(|e| e[0])).all(fits) {
            return wrong("paths of points or bounces that are not there");
        }
        if self.ends.iter().any(|end| (end[2] & !crate::cells::BACK) as usize >= cells) {
            return wrong("paths to cells that the layout has not");
        }
        Ok(())
    }

    /// Bytes that it takes.
    pub(crate) fn bytes(&self) -> usize {
        4 * (self.keys.len() + self.light.len() + 3 * self.ends.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_hold_what_they_are_made_of() {
        for (point, bounce) in [(0, 1), (UNIT - 1, MAX_FOLLOWED + 1), (513, 2)] {
            let arrival = Arrival { point, bounce };
            assert_eq!(Arrival::of(arrival.key()), arrival);
        }
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
