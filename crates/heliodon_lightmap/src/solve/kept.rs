//! What the rays of texels have met, kept for the bounces that ask again: a ray is looked up in a nanosecond or two, and traced in hundreds.

use super::directions::Lookouts;
use super::stage::{Met, Stage};
use heliodon_rays::{Hit, Ray};
use rayon::prelude::*;

/// Bytes that are kept at most, but for one batch of texels: rays of further ones are traced anew by each bounce.
const MOST_BYTES: usize = 1 << 30;

const ESCAPED: u32 = u32::MAX;
/// Set in what is no texel's number but that of one of `others`.
const OTHER: u32 = 1 << 31;

/// What the rays of one texel have met, block after block, in the even directions that it faces.
#[derive(Clone, Debug, Default)]
pub(super) struct Looks {
    /// Where each block's begin.
    starts: Vec<u32>,
    met: Vec<u32>,
    distance_m: Vec<f32>,
    /// What is no front of a texel.
    others: Vec<Hit>,
}

/// A ray's end as it is kept.
#[derive(Clone, Copy, Debug)]
pub(super) enum End {
    Escaped,
    Texel { texel: u32, distance_m: f32 },
    Other(Hit),
}

impl End {
    pub fn of(stage: &Stage, hit: &Hit) -> Self {
        if !hit.is_some() {
            return Self::Escaped;
        }
        match stage.met(hit) {
            Met::Texel(texel) => Self::Texel { texel, distance_m: hit.t },
            Met::Other => Self::Other(*hit),
        }
    }
}

impl Looks {
    pub fn begin_block(&mut self) {
        self.starts.push(self.met.len() as u32);
    }

    pub fn push(&mut self, end: End) {
        let (met, distance_m) = match end {
            End::Escaped => (ESCAPED, f32::INFINITY),
            End::Texel { texel, distance_m } => (texel, distance_m),
            End::Other(hit) => {
                self.others.push(hit);
                (OTHER | (self.others.len() - 1) as u32, hit.t)
            }
        };
        self.met.push(met);
        self.distance_m.push(distance_m);
    }

    /// The ends of a block's rays, in the order of the directions.
    pub fn block(&self, number: usize) -> impl Iterator<Item = End> + '_ {
        let to = self.starts.get(number + 1).map_or(self.met.len(), |next| *next as usize);
        let range = self.starts[number] as usize..to;
        self.met[range.clone()].iter().zip(&self.distance_m[range]).map(|(&met, &distance_m)| match met {
            ESCAPED => End::Escaped,
            texel if texel & OTHER == 0 => End::Texel { texel, distance_m },
            other => End::Other(self.others[(other & !OTHER) as usize]),
        })
    }

    fn bytes(&self) -> usize {
        size_of::<Self>()
            + 4 * (self.starts.capacity() + self.met.capacity() + self.distance_m.capacity())
            + size_of::<Hit>() * self.others.capacity()
    }
}

/// What all texels have met, as far as there is room.
#[derive(Debug, Default)]
pub(super) struct Kept {
    /// Texel by texel; empty before the first are kept.
    of: Vec<Option<Box<Looks>>>,
    bytes: usize,
}

impl Kept {
    /// What a texel has met in the block of this number, if that is known.
    pub fn block(&self, texel: u32, number: usize) -> Option<impl Iterator<Item = End> + '_> {
        let looks = self.of.get(texel as usize)?.as_deref()?;
        (number < looks.starts.len()).then(|| looks.block(number))
    }

    /// How many blocks of a texel are known.
    pub fn blocks(&self, texel: u32) -> usize {
        self.of.get(texel as usize).and_then(Option::as_deref).map_or(0, |looks| looks.starts.len())
    }

    pub fn has_room(&self) -> bool {
        self.bytes < MOST_BYTES
    }

    /// Adds the blocks after those that are known of a texel.
    pub fn add(&mut self, texels: usize, texel: u32, more: Looks) {
        if more.starts.is_empty() {
            return;
        }
        self.of.resize_with(texels, || None);
        let place = &mut self.of[texel as usize];
        match place {
            None => {
                self.bytes += more.bytes();
                *place = Some(Box::new(more));
            }
            Some(looks) => {
                self.bytes -= looks.bytes();
                for block in 0..more.starts.len() {
                    looks.begin_block();
                    more.block(block).for_each(|end| looks.push(end));
                }
                self.bytes += looks.bytes();
            }
        }
    }

    /// Asks again which texel was met where it stands for both sides of a wall, since this is known; returns the number of rays.
    pub fn part(&mut self, stage: &Stage, lookouts: &Lookouts) -> u64 {
        let part_one = |(texel, looks): (usize, &mut Option<Box<Looks>>)| {
            let Some(looks) = looks else { return 0 };
            let is_parted = |met: u32| stage.is_parted(met);
            if !looks.met.iter().any(|&met| is_parted(met)) {
                return 0;
            }
            let blocks = &lookouts.sky(lookouts.set(texel as u32))[..looks.starts.len()];
            let directions = blocks.iter().flat_map(|block| &block.directions[..block.even]);
            let faced = directions.filter(|direction| stage.faces(texel as u32, **direction));
            let (mut at, mut rays, mut asked) = (Vec::new(), Vec::new(), Vec::new());
            for (i, &direction) in faced.enumerate().filter(|(i, _)| is_parted(looks.met[*i])) {
                let origin = stage.origins[texel];
                match stage.on_this_side(looks.met[i], origin + direction * looks.distance_m[i]) {
                    Some(whole) => asked.push((i, whole)),
                    // a path goes on from there: this asks for the triangle
                    None => {
                        at.push(i);
                        rays.push(Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY });
                    }
                }
            }
            asked.drain(..).for_each(|(i, whole)| looks.met[i] = whole);
            let mut hits = vec![Hit::MISS; rays.len()];
            stage.scene.rays.closest(&rays, &mut hits);
            for (i, hit) in at.into_iter().zip(hits) {
                looks.met[i] = OTHER | looks.others.len() as u32;
                looks.others.push(hit);
            }
            rays.len() as u64
        };
        self.of.par_iter_mut().enumerate().map(part_one).sum()
    }
}
