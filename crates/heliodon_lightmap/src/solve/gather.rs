//! What texels see all around: the sky where nothing is met, and what surfaces reflect where something is.

use super::directions::Block;
use super::follow::{Path, follow};
use super::stage::{Met, Stage};
use super::{Models, SolveParams};
use glam::Vec3;
use heliodon_rays::{Hit, Ray, beam_order, set_bits};
use rayon::prelude::*;

/// Texels that look around together.
const UNIT: usize = 512;
/// Blocks of directions that every texel looks in.
const LEAST_BLOCKS: u32 = 4;
/// A texel of whose rays more than this part meets backs lies inside something (as of vertices: rays that escape below the horizon do not count, up to half of all),
/// if next to nothing escapes above it: under a roof that is a single sheet one sees its back as well.
const BACK_LIMIT: f32 = 0.5;
const CLOSED: f32 = 0.005;
const LEAST_COUNTED: f32 = 0.5;
/// A texel that sees less than this part of what is open may lie inside something whatever it sees first.
const SHUT: f32 = 0.02;
/// Rays upwards that tell then.
const THROUGH: usize = 32;

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
    /// What surfaces reflect of the last of these lights, texel by texel; the others are those that it was reflected from before, the first the lights' and the sky's.
    Reflected(&'a [Vec<Vec3>]),
}

/// One question to many texels.
pub(super) struct Gather<'a> {
    pub stage: &'a Stage<'a>,
    pub models: &'a Models<'a>,
    pub params: &'a SolveParams,
    pub blocks: &'a [Block],
    pub arriving: Arriving<'a>,
    /// Light that texels have already, beside which errors are to be seen; none where empty.
    pub beside: &'a [f32],
    /// Light that counts as dark.
    pub floor: f32,
}

impl Gather<'_> {
    /// What texels find, in their order, and how many rays it took.
    pub fn all(&self, texels: &[u32]) -> (Vec<Found>, u64) {
        let origins: Vec<Vec3> = texels.iter().map(|&texel| self.stage.origins[texel as usize]).collect();
        let normals: Vec<Vec3> = texels.iter().map(|&texel| self.stage.planes[texel as usize]).collect();
        let order = beam_order(&origins, Some(&normals));
        let units: Vec<(Vec<Found>, u64)> = order
            .par_chunks(UNIT)
            .map(|unit| self.unit(&unit.iter().map(|&i| texels[i as usize]).collect::<Vec<_>>()))
            .collect();
        let rays = units.iter().map(|(_, rays)| rays).sum();
        let mut found = vec![Found::NOTHING; texels.len()];
        for (&i, one) in order.iter().zip(units.iter().flat_map(|(found, _)| found)) {
            found[i as usize] = *one;
        }
        (found, rays)
    }

    fn unit(&self, texels: &[u32]) -> (Vec<Found>, u64) {
        let mut sums = vec![Sums::default(); texels.len()];
        let mut open = Open::new(self.stage, texels);
        let (mut active, mut hits) = (Vec::new(), Vec::new());
        let mut rays = 0;
        for (number, block) in self.blocks.iter().enumerate() {
            let mut paths = Vec::new();
            active.resize(open.numbers.len().div_ceil(64), 0_u64);
            hits.resize(open.numbers.len(), Hit::MISS);
            for (d, &direction) in block.directions.iter().enumerate() {
                active.fill(0);
                for (i, (normal, plane)) in open.normals.iter().zip(&open.planes).enumerate() {
                    let faces = normal.dot(direction) > 0.0 && plane.dot(direction) > 0.0;
                    active[i / 64] |= u64::from(faces) << (i % 64);
                }
                rays += active.iter().map(|word| u64::from(word.count_ones())).sum::<u64>();
                self.stage.scene.rays.closest_parallel(&open.origins, direction, &active, &mut hits);
                let at = Direction { direction, solid_angle: block.solid_angles[d], escaped: block.escaped[d] };
                for i in set_bits(&active) {
                    let cosine = open.normals[i].dot(direction);
                    let key = (number * block.directions.len() + d) as u32;
                    let of = open.numbers[i];
                    self.add(&mut sums[of as usize], &at, cosine, &hits[i], |path| {
                        paths.push(Path { of, key, texel: texels[of as usize], ..path })
                    });
                }
            }
            rays += follow(self, paths, |of, light| sums[of as usize].of_block.light += light);
            open.numbers.iter().for_each(|&of| sums[of as usize].end_block());
            if number + 1 >= LEAST_BLOCKS as usize {
                open.retain(|of| {
                    let beside = self.beside.get(texels[of as usize] as usize).copied().unwrap_or(0.0) + self.floor;
                    !sums[of as usize].is_certain(0.5 * self.params.error, beside)
                });
            }
            if open.numbers.is_empty() {
                break;
            }
        }
        let origins = texels.iter().map(|&texel| self.stage.origins[texel as usize]);
        let found = sums.iter().zip(origins).map(|(sums, origin)| self.found(sums, origin, &mut rays)).collect();
        (found, rays)
    }

    /// Adds what comes from a direction.
    fn add(&self, sums: &mut Sums, at: &Direction, cosine: f32, hit: &Hit, follow: impl FnOnce(Path)) {
        let even = cosine * at.solid_angle;
        let weight = self.models.surface.response(cosine) * at.solid_angle;
        sums.of_block.even += even;
        if !hit.is_some() {
            sums.escaped += even;
            sums.sunk += if at.direction.y < 0.0 { even } else { 0.0 };
            sums.of_block.light += at.escaped * weight;
            return;
        }
        sums.over_distance += even / hit.t.max(f32::MIN_POSITIVE);
        sums.back += if hit.back { even } else { 0.0 };
        match self.arriving {
            Arriving::Sky => sums.of_block.light += self.models.illumination.met(hit.t) * weight,
            Arriving::Reflected(lights) => match self.stage.met(hit, at.direction) {
                Met::Texel(texel) => {
                    let light = lights.last().map_or(Vec3::ZERO, |light| light[texel as usize]);
                    let radiance = self.stage.albedo[texel as usize] * light;
                    sums.of_block.light += self.models.illumination.reflected(radiance, hit.t) * weight;
                }
                Met::Other { origin, normal, albedo } => {
                    let throughput = self.models.illumination.reflected(albedo, hit.t) * weight;
                    if throughput != Vec3::ZERO {
                        follow(Path { origin, normal, throughput, order: lights.len() as u32 - 1, of: 0, texel: 0, key: 0 });
                    }
                }
            },
        }
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
        let upwards = self.blocks.iter().flat_map(|block| &block.directions).filter(|d| d.y > 0.0).take(THROUGH);
        let ray = |&direction: &Vec3| Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
        let through: Vec<Ray> = upwards.map(ray).collect();
        let mut counts = vec![0; through.len()];
        self.stage.scene.rays.enclosures(&through, &mut counts);
        *rays += through.len() as u64;
        2 * counts.iter().filter(|count| **count > 0).count() > through.len()
    }
}

/// The texels of a unit that still look around, close together: a ray that nobody asks for costs as well.
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

    fn retain(&mut self, is_open: impl Fn(u32) -> bool) {
        let open: Vec<bool> = self.numbers.iter().map(|&of| is_open(of)).collect();
        fn kept<T: Copy>(all: &mut Vec<T>, open: &[bool]) {
            let mut next = 0..;
            all.retain(|_| next.next().is_some_and(|i: usize| open[i]));
        }
        kept(&mut self.numbers, &open);
        kept(&mut self.origins, &open);
        kept(&mut self.planes, &open);
        kept(&mut self.normals, &open);
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
    /// Cosines times solid angles: of what escaped, of that the part below the horizon, of what met backs, and over the distances of all that was met.
    escaped: f32,
    sunk: f32,
    back: f32,
    over_distance: f32,
}

impl Sums {
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
        self.squares <= most * most * self.blocks * (self.blocks - 1.0).max(0.0)
    }
}
