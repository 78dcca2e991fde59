//! Both sides of borders between an atlas's charts are brought together, as those of light maps are ([`heliodon_lightmap::seams`]).
//!
//! A light map is shown under one exposure. Texels of a day are shown at all hours, and a visitor in a dim room raises the exposure: so both sides may be apart by a part of the light
//! that there is itself. How much each number counts in it depends on the hour, and light that is kept serves any sky: what counts is how long the difference of all numbers of a channel is, which
//! are those of orthonormal functions.

use super::atlas::{Atlas, Texels};
use super::stage::{Asked, TexelValues};
use super::walls::is_dark;
use heliodon_lightmap::refine::Grid;
use heliodon_lightmap::seams::{Seams, shown_codes};
use rayon::prelude::*;

/// By how many codes of eight bits a place may be shown apart, exposed so that all light that is there is white. Half of a code is to be seen by nobody; a sky that is not even, and an hour at which
/// there is less than in the mean, show more of it.
const CODES: f32 = 0.4;
/// Numbers that are brought together at once.
const BLOCK: usize = 8;
/// Where there is less than this part of the brightest light, tolerances are those of as much: as a part of it noise of what is as good as dark has no end.
const DIMMEST: f32 = 2e-3;
/// How many charts deep light is carried into what lies inside of something.
const DEEP: usize = 4;

/// Gives charts of which no texel lies where light can be what is shown beside them, where a surface goes on in them: a sliver of them may be seen all the same.
pub fn carry(seams: &Seams, grid: &Grid, found: &mut TexelValues) {
    let nearest =
        |known: &[bool]| (0..).zip(grid.nearest_valid(known)).filter(|(own, of)| own != of).collect::<Vec<(u32, u32)>>();
    let mut known = found.valid.clone();
    nearest(&found.valid).into_iter().for_each(|(texel, _)| known[texel as usize] = true);
    let width = found.values.len() / known.len().max(1);
    for _ in 0..DEEP {
        let given = seams.carry(&mut found.values, &known);
        if given.is_empty() {
            break;
        }
        seams.carry(&mut found.ambient, &known);
        given.iter().for_each(|&texel| known[texel as usize] = true);
        for (texel, of) in nearest(&known) {
            let (texel, of) = (texel as usize, of as usize);
            found.values.copy_within(of * width..(of + 1) * width, texel * width);
            found.ambient[texel] = found.ambient[of];
            known[texel] = true;
        }
    }
}

/// The values of texels with both sides of seams brought together.
///
/// Left open are places where what walls have darkened, or what lies within something, is filtered beside what is lit: there light would come into a dark room. Of other texels that lie within something
/// a little shows beside what they lie in.
pub fn closed(
    mut seams: Seams,
    (atlas, texels): (&Atlas, &Texels),
    found: &TexelValues,
    darkened: &[u32],
    (asked, channels): (Asked, usize),
) -> Vec<f32> {
    let width = found.values.len() / texels.texels.len().max(1);
    let mut whole = found.valid.clone();
    darkened.iter().for_each(|&texel| whole[texel as usize] = false);
    let beside = Beside::new(atlas, texels);
    let span = |texels: &mut dyn Iterator<Item = u32>| {
        texels
            .map(|texel| found.ambient[texel as usize])
            .fold([f32::INFINITY, 0.0], |[least, most], ambient| [least.min(ambient), most.max(ambient)])
    };
    let keep = seams.places().map(|place| {
        let [least, most] = span(&mut place.clone().flat_map(|texel| beside.around(texel)));
        place.clone().all(|texel| whole[texel as usize]) || !is_dark(least, most)
    });
    let keep: Vec<bool> = keep.collect();
    seams.keep(&keep);
    let light = brightness(found, width, asked);
    let brightest = light.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
    let part = CODES / shown_codes(1.0, 1.0, 1.0);
    let tolerances: Vec<f32> = seams.middles(&light).into_iter().map(|light| part * light.max(DIMMEST * brightest)).collect();
    let mut values = found.values.clone();
    for channel in 0..channels {
        close(&seams, &mut values, &tolerances, &(channel..width).step_by(channels).collect::<Vec<_>>());
    }
    values
}

/// Brings some numbers of each texel together, block by block: each may have as much of the tolerance as it has of the differences.
fn close(seams: &Seams, values: &mut [f32], tolerances: &[f32], numbers: &[usize]) {
    let width = values.len() / seams.texel_count().max(1);
    let block = |numbers: &[usize]| -> Vec<[f32; BLOCK]> {
        let of = |texel: &[f32]| std::array::from_fn(|i| numbers.get(i).map_or(0.0, |&number| texel[number]));
        values.chunks_exact(width.max(1)).map(of).collect()
    };
    let mut blocks: Vec<_> = numbers.par_chunks(BLOCK).map(block).collect();
    let squares: Vec<f64> = blocks.par_iter().map(|block| seams.squares_apart(block, tolerances)).collect();
    let all: f64 = squares.iter().sum();
    blocks.par_iter_mut().zip(&squares).filter(|(_, square)| **square > 0.0).for_each(|(block, square)| {
        let share = (square / all).sqrt() as f32;
        let tolerances: Vec<f32> = tolerances.iter().map(|most| share * most).collect();
        seams.close(block, &tolerances);
    });
    for (numbers, block) in numbers.chunks(BLOCK).zip(&blocks) {
        for (texel, block) in values.chunks_exact_mut(width.max(1)).zip(block) {
            numbers.iter().zip(block).for_each(|(&number, value)| texel[number] = *value);
        }
    }
}

/// How bright texels are, beside one another and their numbers. Of the bounced sun with the sky's light added, which in the mean is about as much.
fn brightness(found: &TexelValues, width: usize, asked: Asked) -> Vec<f32> {
    if asked == Asked::Sky {
        return found.ambient.clone();
    }
    let mean_square = |numbers: &[f32]| numbers.iter().map(|number| number * number).sum::<f32>() / width as f32;
    let bounced: Vec<f32> = found.values.chunks_exact(width.max(1)).map(|numbers| mean_square(numbers).sqrt()).collect();
    let sum = |of: &[f32]| of.iter().map(|&light| f64::from(light)).sum::<f64>();
    let of_sky = (sum(&bounced) / sum(&found.ambient).max(f64::MIN_POSITIVE)) as f32;
    bounced.iter().zip(&found.ambient).map(|(bounced, ambient)| bounced + of_sky * ambient).collect()
}

/// What lies beside what in the charts of an atlas.
struct Beside<'a> {
    atlas: &'a Atlas,
    texels: &'a Texels,
    /// Row by row the texel of each cell.
    at: Vec<u32>,
}

const NOBODY: u32 = u32::MAX;

impl<'a> Beside<'a> {
    fn new(atlas: &'a Atlas, texels: &'a Texels) -> Self {
        let side = texels.side as usize;
        let mut at = vec![NOBODY; side * side];
        for (own, texel) in (0..).zip(&texels.texels) {
            at[usize::from(texel.y) * side + usize::from(texel.x)] = own;
        }
        Self { atlas, texels, at }
    }

    /// A texel, and those around it that are of its chart.
    fn around(&self, texel: u32) -> impl Iterator<Item = u32> {
        let side = self.texels.side as usize;
        let chart = |texel: u32| self.atlas.unwrapped().chart[self.texels.texels[texel as usize].triangle as usize];
        let own = &self.texels.texels[texel as usize];
        let (x, y) = (usize::from(own.x), usize::from(own.y));
        let cells = (y.saturating_sub(1)..(y + 2).min(side))
            .flat_map(move |y| (x.saturating_sub(1)..(x + 2).min(side)).map(move |x| y * side + x));
        cells.map(|cell| self.at[cell]).filter(move |&other| other != NOBODY && chart(other) == chart(texel))
    }
}
