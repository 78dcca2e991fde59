//! What the rays of texels have met, kept for the bounces that ask again: a ray is looked up in a nanosecond or two, and traced in hundreds.

use super::directions::{EVEN, Lookouts};
use super::links::Link;
use super::stage::{Met, Stage};
use heliodon_rays::{Hit, Ray};
use rayon::prelude::*;

/// Bytes that are kept at most, but for one batch of texels: rays of further ones are traced anew by each bounce.
const MOST_BYTES: usize = 2 << 30;

const ESCAPED: u32 = u32::MAX;
/// Set in what is no texel's number but that of one of `others`.
const OTHER: u32 = 1 << 31;
/// Set beside it in the number of a link.
const LINKED: u32 = OTHER | 1 << 30;

/// What a ray has met, and how far away.
#[derive(Clone, Copy, Debug)]
struct Look {
    met: u32,
    distance_m: f32,
}

/// What the rays of one texel have met, block after block, in the even directions that it faces.
#[derive(Clone, Debug, Default)]
pub(super) struct Looks {
    /// Where each block's begin.
    starts: Vec<u32>,
    all: Vec<Look>,
    /// What is no front of a texel.
    others: Vec<Hit>,
}

/// A ray's end as it is kept.
#[derive(Clone, Copy, Debug)]
pub(super) enum End {
    Escaped,
    Texel {
        texel: u32,
        distance_m: f32,
    },
    /// What has no texel, where its path was not followed yet.
    Other(Hit),
    /// Or where it was.
    Link {
        link: u32,
        distance_m: f32,
    },
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
        self.starts.push(self.all.len() as u32);
        self.all.reserve(EVEN as usize / 2);
    }

    pub fn push(&mut self, end: End) {
        let (met, distance_m) = match end {
            End::Escaped => (ESCAPED, f32::INFINITY),
            End::Texel { texel, distance_m } => (texel, distance_m),
            End::Other(hit) => {
                self.others.push(hit);
                (OTHER | (self.others.len() - 1) as u32, hit.t)
            }
            End::Link { link, distance_m } => (LINKED | link, distance_m),
        };
        self.all.push(Look { met, distance_m });
    }

    /// How many rays of the last block there are.
    pub fn of_block(&self) -> u32 {
        self.all.len() as u32 - self.starts.last().copied().unwrap_or(0)
    }

    /// The ends of a block's rays, in the order of the directions.
    pub fn block(&self, number: usize) -> impl Iterator<Item = End> + '_ {
        let to = self.starts.get(number + 1).map_or(self.all.len(), |next| *next as usize);
        self.all[self.starts[number] as usize..to].iter().map(|&Look { met, distance_m }| match met {
            ESCAPED => End::Escaped,
            texel if texel & OTHER == 0 => End::Texel { texel, distance_m },
            link if link & LINKED == LINKED => End::Link { link: link & !LINKED, distance_m },
            other => End::Other(self.others[(other & !OTHER) as usize]),
        })
    }

    fn bytes(&self) -> usize {
        size_of::<Self>()
            + size_of::<u32>() * self.starts.capacity()
            + size_of::<Look>() * self.all.capacity()
            + size_of::<Hit>() * self.others.capacity()
    }
}

/// One look of a texel whose path was followed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Followed {
    pub texel: u32,
    /// Which block, and which of the directions in it that the texel faces.
    pub block: u32,
    pub look: u32,
    /// The number of its link among those that were found with it.
    pub link: u32,
}

/// What all texels have met, as far as there is room.
#[derive(Debug, Default)]
pub(super) struct Kept {
    /// Texel by texel; empty before the first are kept.
    of: Vec<Option<Box<Looks>>>,
    links: Vec<Link>,
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

    /// The places of all paths that were followed.
    pub fn links(&self) -> &[Link] {
        &self.links
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

    /// Adds links, and says which looks of texels whose blocks are known they belong to.
    pub fn link(&mut self, links: &[Link], followed: &[Followed]) {
        let before = self.links.len() as u32;
        self.links.extend(links.iter().map(|link| link.after(before)));
        self.bytes += size_of_val(links);
        for followed in followed {
            if let Some(looks) = &mut self.of[followed.texel as usize] {
                let start = looks.starts[followed.block as usize];
                looks.all[(start + followed.look) as usize].met = LINKED | (before + followed.link);
            }
        }
    }

    /// Asks again which texel was met where it stands for both sides of a wall, since this is known; returns the number of rays. No path may have been followed yet.
    pub fn part(&mut self, stage: &Stage, lookouts: &Lookouts) -> u64 {
        let part_one = |(texel, looks): (usize, &mut Option<Box<Looks>>)| {
            let Some(looks) = looks else { return 0 };
            let is_parted = |look: &Look| stage.is_parted(look.met);
            if !looks.all.iter().any(is_parted) {
                return 0;
            }
            let blocks = &lookouts.sky(lookouts.set(texel as u32))[..looks.starts.len()];
            let directions = blocks.iter().flat_map(|block| &block.directions[..block.even]);
            let faced = directions.filter(|direction| stage.faces(texel as u32, **direction));
            let origin = stage.origins[texel];
            let (mut at, mut rays) = (Vec::new(), Vec::new());
            for (i, (look, &direction)) in looks.all.iter_mut().zip(faced).enumerate().filter(|(_, (look, _))| is_parted(look))
            {
                match stage.on_this_side(look.met, origin + direction * look.distance_m) {
                    Some(whole) => look.met = whole,
                    // a path goes on from there: this asks for the triangle
                    None => {
                        at.push(i);
                        rays.push(Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY });
                    }
                }
            }
            let mut hits = vec![Hit::MISS; rays.len()];
            stage.scene.rays.closest(&rays, &mut hits);
            for (i, hit) in at.into_iter().zip(hits) {
                looks.all[i].met = OTHER | looks.others.len() as u32;
                looks.others.push(hit);
            }
            rays.len() as u64
        };
        self.of.par_iter_mut().enumerate().map(part_one).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::links::Next;
    use super::*;
    use glam::Vec3;

    #[test]
    fn what_is_kept_comes_back_and_a_followed_path_takes_the_place_of_its_look() {
        let hit = |triangle: u32| Hit { triangle, t: 2.0, u: 0.25, v: 0.5, back: true };
        let mut kept = Kept::default();
        let mut looks = Looks::default();
        looks.begin_block();
        [End::Escaped, End::Other(hit(3))].into_iter().for_each(|end| looks.push(end));
        looks.begin_block();
        [End::Other(hit(4)), End::Texel { texel: 9, distance_m: 1.5 }].into_iter().for_each(|end| looks.push(end));
        kept.add(6, 5, looks);
        let link = |next: Next| Link { albedo: Vec3::ONE, direct: Vec3::ZERO, next };
        kept.link(&[link(Next::Nothing)], &[]);
        let before = kept.bytes;
        let followed = [Followed { texel: 5, block: 1, look: 0, link: 0 }, Followed { texel: 4, block: 0, look: 0, link: 0 }];
        kept.link(&[link(Next::Link(1)), link(Next::Texel(7))], &followed);
        assert_eq!(kept.bytes - before, 2 * size_of::<Link>());
        let of = |block: usize| kept.block(5, block).unwrap().collect::<Vec<_>>();
        assert!(matches!(of(0)[..], [End::Escaped, End::Other(Hit { triangle: 3, .. })]), "{:?}", of(0));
        assert!(matches!(of(1)[..], [End::Link { link: 1, distance_m: 2.0 }, End::Texel { texel: 9, distance_m: 1.5 }]));
        // and the link names the one that came with it
        assert_eq!(
            kept.links().iter().map(|link| link.next).collect::<Vec<_>>(),
            [Next::Nothing, Next::Link(2), Next::Texel(7)]
        );
    }
}
