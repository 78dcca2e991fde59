//! What texels see all around: the sky where nothing is met, and what surfaces reflect where something is.

use super::directions::{Block, Lookouts};
use super::kept::{End, Followed, Kept, Looks};
use super::links::{self, Link, Path};
use super::stage::{Stage, faces};
use super::{Models, SolveParams};
use glam::Vec3;
use heliodon_rays::{Hit, Ray, beam_order, set_bits};
use rayon::prelude::*;

/// Texels that look around together.
const UNIT: usize = 512;
/// Units between which there is a look at how much is kept.
const BATCH: usize = 128;
/// Blocks of directions that every texel looks in, and those beyond a chart's rim, which filtering mixes with others. Where few texels stopped by chance, theirs was most of all error.
const LEAST_BLOCKS: usize = 16;
const LEAST_BEYOND: usize = 8;
/// A texel of whose rays more than this part meets backs lies inside something (as of vertices: rays that escape below the horizon do not count, up to half of all),
/// if next to nothing escapes above it: under a roof that is a single sheet one sees its back as well.
const BACK_LIMIT: f32 = 0.5;
const CLOSED: f32 = 0.005;
const LEAST_COUNTED: f32 = 0.5;
/// One that sees more than this part of backs in its first block, and nothing open, is asked no further.
const ENCLOSED: f32 = 0.9;
/// A texel that sees less than this part of what is open may lie inside something whatever it sees first.
const SHUT: f32 = 0.02;
/// Rays upwards that tell then.
const THROUGH: usize = 32;
const AGREEING: usize = 8;

/// What a texel has found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pub light: Vec3,
    pub valid: bool,
    /// Harmonic mean distance of what it sees.
    pub reach_m: f32,
}

impl Found {
    pub const NOTHING: Self = Self { light: Vec3::ZERO, valid: false, reach_m: f32::INFINITY };
}

/// What is gathered.
#[derive(Clone, Copy)]
pub(super) enum Arriving<'a> {
    /// Light that escapes to the sky, and whether texels are valid.
    Sky,
    /// What surfaces reflect of the last of some lights. Of each light what every texel reflects: that of lamps and sky first, then each as it was reflected from the one before.
    Reflected(&'a [Vec<Vec3>]),
}

/// One question to many texels.
pub(super) struct Gather<'a> {
    pub stage: &'a Stage<'a>,
    pub models: &'a Models<'a>,
    pub params: &'a SolveParams,
    pub lookouts: &'a Lookouts,
    pub arriving: Arriving<'a>,
    /// Light that texels have already, beside which errors are to be seen; none where empty.
    pub beside: &'a [f32],
    /// Which texels lie where light can be; not known where empty.
    pub valid: &'a [bool],
    /// Light that counts as dark.
    pub floor: f32,
}

impl Gather<'_> {
    /// What texels find, in their order, and how many rays it took. What is not kept is traced, and kept as long as there is room.
    pub fn all(&self, kept: &mut Kept, texels: &[u32]) -> (Vec<Found>, u64) {
        let units = self.units(texels);
        let mut found = vec![Found::NOTHING; texels.len()];
        let mut rays = 0;
        for batch in units.chunks(BATCH) {
            let of = |(set, unit): &(u16, Vec<u32>)| {
                self.unit(kept, *set, &unit.iter().map(|&i| texels[i as usize]).collect::<Vec<_>>())
            };
            let units: Vec<OfUnit> = batch.par_iter().map(of).collect();
            let mut at = batch.iter().flat_map(|(_, unit)| unit);
            for unit in units {
                rays += unit.rays;
                for ((one, looks), &i) in unit.found.into_iter().zip(unit.looks).zip(&mut at) {
                    found[i as usize] = one;
                    kept.add(self.stage.places.len(), texels[i as usize], looks);
                }
                if !unit.followed.is_empty() {
                    kept.link(&unit.links, &unit.followed);
                }
            }
        }
        (found, rays)
    }

    /// Which texels look around together: numbers in `texels`, of one set of directions and close to one another.
    fn units(&self, texels: &[u32]) -> Vec<(u16, Vec<u32>)> {
        let of_set = |set: u16| {
            let own: Vec<u32> = (0..texels.len() as u32).filter(|&i| self.lookouts.set(texels[i as usize]) == set).collect();
            let of = |all: &[Vec3]| own.iter().map(|&i| all[texels[i as usize] as usize]).collect::<Vec<_>>();
            let order = beam_order(&of(&self.stage.origins), Some(&of(&self.stage.planes)));
            let unit = |unit: &[u32]| (set, unit.iter().map(|&i| own[i as usize]).collect());
            order.chunks(UNIT).map(unit).collect::<Vec<_>>()
        };
        (0..self.lookouts.sets()).flat_map(of_set).collect()
    }

    fn unit(&self, kept: &Kept, set: u16, texels: &[u32]) -> OfUnit {
        let blocks: &[Block] = match self.arriving {
            Arriving::Sky => self.lookouts.sky(set),
            Arriving::Reflected(_) => self.lookouts.even(set),
        };
        let mut sums = vec![Sums::default(); texels.len()];
        let mut looks = vec![Looks::default(); texels.len()];
        let mut open = Open::new(self.stage, texels);
        let is_kept = kept.has_room();
        let (mut active, mut hits) = (Vec::new(), Vec::new());
        let (mut links, mut followed) = (Vec::new(), Vec::new());
        let mut rays = 0;
        for (number, block) in blocks.iter().enumerate() {
            let mut asked: Vec<Asked> = Vec::new();
            let mut end = |of: u32, look: u32, d: usize, cosine: f32, end: End| {
                let at =
                    Direction { direction: block.directions[d], solid_angle: block.solid_angles[d], escaped: block.escaped[d] };
                if let Some((hit, weight)) = self.add(&mut sums[of as usize], &at, cosine, end, kept.links()) {
                    asked.push(Asked { of, look, direction: d, hit, weight });
                }
            };
            let (known, asking) = open.partition(|of| kept.blocks(texels[of as usize]) > number);
            for (i, &of) in known.numbers.iter().enumerate() {
                let faced = (0..block.even).filter(|&d| known.faces(i, block.directions[d]));
                let ends = kept.block(texels[of as usize], number).into_iter().flatten();
                (0..).zip(faced.zip(ends)).for_each(|(look, (d, met))| {
                    end(of, look, d, known.normals[i].dot(block.directions[d]), met);
                });
            }
            if is_kept {
                asking.numbers.iter().for_each(|&of| looks[of as usize].begin_block());
            }
            for (d, &direction) in block.directions.iter().enumerate() {
                let is_even = d < block.even;
                let asking = if is_even { &asking } else { &open };
                rays += asking.trace(self.stage, direction, &mut active, &mut hits);
                for i in set_bits(&active) {
                    let of = asking.numbers[i];
                    let met = End::of(self.stage, &hits[i]);
                    let look = looks[of as usize].of_block();
                    if is_even && is_kept {
                        looks[of as usize].push(met);
                    }
                    end(of, look, d, asking.normals[i].dot(direction), met);
                }
            }
            rays += self.follow(
                texels,
                (number, block),
                &asked,
                is_kept,
                &mut Following { sums: &mut sums, links: &mut links, followed: &mut followed },
            );
            open.numbers.iter().for_each(|&of| sums[of as usize].end_block());
            open = open
                .partition(|of| {
                    let texel = texels[of as usize] as usize;
                    let least = if self.stage.scene.texels[texel].is_covered { LEAST_BLOCKS } else { LEAST_BEYOND };
                    if number + 1 < least {
                        let is_inside = self.valid.get(texel).map_or_else(|| sums[of as usize].is_enclosed(), |valid| !valid);
                        return !is_inside || sums[of as usize].mean != 0.0;
                    }
                    // what Sobol's points have of evenness is whole at powers of two
                    if !(number + 1).is_power_of_two() {
                        return true;
                    }
                    let beside = self.beside.get(texel).copied().unwrap_or(0.0) + self.floor;
                    // what few blocks tell of their own error is not certain itself
                    let part = 0.5 * number as f32 / (number + 2) as f32;
                    !sums[of as usize].is_certain(part * self.params.error, beside)
                })
                .0;
            if open.numbers.is_empty() {
                break;
            }
        }
        let origins = texels.iter().map(|&texel| self.stage.origins[texel as usize]);
        let found = sums.iter().zip(origins).map(|(sums, origin)| self.found(sums, origin, &mut rays)).collect();
        OfUnit { found, looks, links, followed, rays }
    }

    /// Follows the paths of a block's looks and adds what they bring; returns the number of rays.
    fn follow(
        &self,
        texels: &[u32],
        (number, block): (usize, &Block),
        asked: &[Asked],
        is_kept: bool,
        to: &mut Following,
    ) -> u64 {
        let Arriving::Reflected(reflected) = self.arriving else { return 0 };
        let order = reflected.len() - 1;
        // What lies inside something may be dark, and asked no more: the first bounce tells.
        let is_for_all = |texel: u32| is_kept && (order > 0 || self.valid.get(texel as usize).is_none_or(|valid| *valid));
        let bounces = self.models.illumination.bounces(self.params.bounces);
        let path = |asked: &Asked| {
            let texel = texels[asked.of as usize];
            Path {
                texel,
                key: (number * block.directions.len() + asked.direction) as u32,
                onward: self.stage.goes_on(&asked.hit, block.directions[asked.direction]),
                places: if is_for_all(texel) { bounces } else { order as u32 + 1 },
            }
        };
        let first = to.links.len() as u32;
        let rays = links::find(self, asked.iter().map(path).collect(), to.links);
        for (link, asked) in (first..).zip(asked) {
            let texel = texels[asked.of as usize];
            let radiance = links::reflected(to.links, link, reflected, order);
            let light = self.models.illumination.reflected(radiance, asked.hit.t);
            to.sums[asked.of as usize].of_block.light += light * asked.weight;
            if is_for_all(texel) {
                to.followed.push(Followed { texel, block: number as u32, look: asked.look, link });
            }
        }
        rays
    }

    /// Adds what comes from a direction. Returns what has no texel, and how much its light weighs, where that is asked for and its path was not followed yet.
    fn add(&self, sums: &mut Sums, at: &Direction, cosine: f32, end: End, links: &[Link]) -> Option<(Hit, f32)> {
        let even = cosine * at.solid_angle;
        let weight = self.models.surface.response(cosine) * at.solid_angle;
        sums.of_block.even += even;
        let (distance_m, is_back) = match end {
            End::Escaped => {
                sums.escaped += even;
                sums.sunk += if at.direction.y < 0.0 { even } else { 0.0 };
                sums.take(at.escaped, weight);
                return None;
            }
            End::Texel { distance_m, .. } | End::Link { distance_m, .. } => (distance_m, false),
            End::Other(hit) => (hit.t, hit.back),
        };
        sums.over_distance += even / distance_m.max(f32::MIN_POSITIVE);
        sums.back += if is_back { even } else { 0.0 };
        let illumination = self.models.illumination;
        match (self.arriving, end) {
            (Arriving::Reflected(reflected), End::Texel { texel, .. }) => {
                let radiance = reflected.last().map_or(Vec3::ZERO, |reflected| reflected[texel as usize]);
                sums.take(illumination.reflected(radiance, distance_m), weight);
            }
            (Arriving::Reflected(reflected), End::Link { link, .. }) => {
                let radiance = links::reflected(links, link, reflected, reflected.len() - 1);
                sums.of_block.light += illumination.reflected(radiance, distance_m) * weight;
            }
            (Arriving::Reflected(_), End::Other(hit)) => return Some((hit, weight)),
            (Arriving::Sky, _) => sums.take(illumination.met(distance_m), weight),
            (_, End::Escaped) => {}
        }
        None
    }

    fn found(&self, sums: &Sums, origin: Vec3, rays: &mut u64) -> Found {
        let even = sums.all.even;
        if even <= 0.0 {
            return Found::NOTHING;
        }
        let counted = (1.0 - sums.sunk / even).max(LEAST_COUNTED);
        let is_closed = sums.escaped - sums.sunk <= CLOSED * even;
        let mut valid = !is_closed || sums.back / even <= BACK_LIMIT * counted;
        if valid && matches!(self.arriving, Arriving::Sky) && sums.escaped < SHUT * even {
            valid = !self.is_within(origin, rays);
        }
        Found { light: sums.all.light / even, valid, reach_m: even / sums.over_distance }
    }

    /// Whether most rays upwards leave more surfaces than they enter: the corner of a block within another sees third ones that reach in as well, and may meet
    /// few backs first.
    fn is_within(&self, origin: Vec3, rays: &mut u64) -> bool {
        let upwards = self.lookouts.sky(0).iter().flat_map(|block| &block.directions).filter(|d| d.y > 0.0).take(THROUGH);
        let ray = |&direction: &Vec3| Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
        let through: Vec<Ray> = upwards.map(ray).collect();
        let mut counts = vec![0; through.len()];
        let (mut asked, mut within) = (0, 0);
        // a few that all say the same are enough
        for until in [through.len().min(AGREEING), through.len()] {
            self.stage.scene.rays.enclosures(&through[asked..until], &mut counts[asked..until]);
            *rays += (until - asked) as u64;
            asked = until;
            within = counts[..until].iter().filter(|count| **count > 0).count();
            if [0, until].contains(&within) {
                break;
            }
        }
        2 * within > asked
    }
}

/// What a unit has found, and what its texels' rays have met that was not known before.
struct OfUnit {
    found: Vec<Found>,
    looks: Vec<Looks>,
    links: Vec<Link>,
    followed: Vec<Followed>,
    rays: u64,
}

/// A look at what has no texel: whose, which of its block's and in which of the directions, what it met, and how much its light weighs.
struct Asked {
    of: u32,
    look: u32,
    direction: usize,
    hit: Hit,
    weight: f32,
}

/// Where what paths bring goes to.
struct Following<'a> {
    sums: &'a mut [Sums],
    links: &'a mut Vec<Link>,
    followed: &'a mut Vec<Followed>,
}

/// Some texels of a unit, close together: a ray that nobody asks for costs as well.
#[derive(Default)]
struct Open {
    /// Which of the unit each is.
    numbers: Vec<u32>,
    origins: Vec<Vec3>,
    planes: Vec<Vec3>,
    normals: Vec<Vec3>,
}

impl Open {
    fn new(stage: &Stage, texels: &[u32]) -> Self {
        let finite = |(_, texel): &(u32, &u32)| stage.places[**texel as usize].normal.is_finite();
        let (numbers, texels): (Vec<u32>, Vec<u32>) = (0..).zip(texels).filter(finite).map(|(i, &texel)| (i, texel)).unzip();
        let of = |all: &[Vec3]| texels.iter().map(|&texel| all[texel as usize]).collect();
        let normals = texels.iter().map(|&texel| stage.places[texel as usize].normal).collect();
        Self { numbers, origins: of(&stage.origins), planes: of(&stage.planes), normals }
    }

    /// Those that something is true of, and the others.
    fn partition(&self, is_so: impl Fn(u32) -> bool) -> (Self, Self) {
        let mut parts = (Self::default(), Self::default());
        for (i, &number) in self.numbers.iter().enumerate() {
            let part = if is_so(number) { &mut parts.0 } else { &mut parts.1 };
            part.numbers.push(number);
            part.origins.push(self.origins[i]);
            part.planes.push(self.planes[i]);
            part.normals.push(self.normals[i]);
        }
        parts
    }

    /// Whether a direction is above both a texel's surface and what it is shaded as.
    fn faces(&self, i: usize, direction: Vec3) -> bool {
        faces(self.normals[i], self.planes[i], direction)
    }

    /// Traces a ray from each that faces a direction, marks those as active, and returns their number.
    fn trace(&self, stage: &Stage, direction: Vec3, active: &mut Vec<u64>, hits: &mut Vec<Hit>) -> u64 {
        active.clear();
        active.resize(self.numbers.len().div_ceil(64), 0);
        hits.resize(self.numbers.len(), Hit::MISS);
        for i in 0..self.numbers.len() {
            active[i / 64] |= u64::from(self.faces(i, direction)) << (i % 64);
        }
        stage.scene.rays.closest_parallel(&self.origins, direction, active, hits);
        active.iter().map(|word| u64::from(word.count_ones())).sum()
    }
}

struct Direction {
    direction: Vec3,
    solid_angle: f32,
    escaped: Vec3,
}

/// Light, and what an even light of 1 would be.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    light: Vec3,
    even: f32,
}

#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    all: Part,
    of_block: Part,
    /// How many blocks there were, the mean of their light, and the squares of what they are off it.
    blocks: f32,
    mean: f32,
    squares: f32,
    /// How many rays there were, and the least and the greatest light that one brought.
    rays: f32,
    span: Option<[f32; 2]>,
    /// Cosines times solid angles: of what escaped, of that the part below the horizon, of what met backs, and over the distances of all that was met.
    escaped: f32,
    sunk: f32,
    back: f32,
    over_distance: f32,
}

impl Sums {
    /// Adds the light of one ray.
    fn take(&mut self, light: Vec3, weight: f32) {
        self.of_block.light += light * weight;
        let light = light.element_sum();
        self.rays += 1.0;
        self.span = Some(self.span.map_or([light; 2], |[least, most]| [least.min(light), most.max(light)]));
    }

    /// Whether it sees next to nothing but backs: it lies inside something, whatever more directions would tell.
    fn is_enclosed(&self) -> bool {
        self.escaped == 0.0 && self.back >= ENCLOSED * self.all.even
    }

    fn end_block(&mut self) {
        let Part { light, even } = std::mem::take(&mut self.of_block);
        self.all.light += light;
        self.all.even += even;
        if even > 0.0 {
            let light = light.element_sum() / even;
            self.blocks += 1.0;
            let off = light - self.mean;
            self.mean += off / self.blocks;
            self.squares += off * (light - self.mean);
        }
    }

    /// Whether the mean's standard error is no more than this part of it and of what is beside it.
    fn is_certain(&self, error: f32, beside: f32) -> bool {
        let most = error * (self.mean.abs() + 3.0 * beside);
        // Rays that count the same come in whole numbers: blocks that agree to the ray are still off by part of one (a step's variance is a twelfth of its square).
        let step = self.span.map_or(0.0, |[least, most]| (most - least) * self.blocks / self.rays);
        let further = (self.blocks - 1.0).max(0.0);
        self.squares + further * step * step / 12.0 <= most * most * self.blocks * further
    }
}
