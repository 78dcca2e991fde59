//! Both sides of borders between an atlas's charts are brought together, as those of light maps are ([`heliodon_lightmap::seams`]).
//!
//! A light map is shown under one exposure. Texels of a day are shown at all hours, and a visitor in a dim room raises the exposure: so both sides may be apart by a part of the light
//! that there is itself. How much each number counts in it depends on the hour, and light that is kept serves any sky: all numbers of a texel are matched alike.

use super::atlas::{Atlas, Texels};
use super::stage::{Asked, TexelValues};
use super::walls::is_dark;
use crate::scene::Scene;
use heliodon_lightmap::seams::shown_codes;

/// By how many codes of eight bits a place may be shown apart because of one number, exposed so that all light that is there is white. Half of a code is to be seen by nobody, and what several
/// numbers are apart by adds up.
const CODES: f32 = 0.125;
/// Where there is less than this part of the brightest light, tolerances are those of as much: as a part of it noise of what is as good as dark has no end.
const DIMMEST: f32 = 2e-3;

/// The values of texels with both sides of seams brought together.
///
/// Left open are places where what walls have darkened, or what lies within something, is filtered beside what is lit: there light would come into a dark room. Of other texels that lie within something
/// a little shows beside what they lie in.
pub fn closed(
    (scene, atlas, texels): (&Scene, &Atlas, &Texels),
    found: &TexelValues,
    darkened: &[u32],
    asked: Asked,
) -> Vec<f32> {
    let count = texels.texels.len();
    let width = found.values.len() / count.max(1);
    let mut whole = found.valid.clone();
    darkened.iter().for_each(|&texel| whole[texel as usize] = false);
    let mut seams = atlas.seams(scene, texels);
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
    let mut apart: Vec<f32> = (0..width).flat_map(|i| found.values.iter().skip(i).step_by(width)).copied().collect();
    seams.close_all(&mut apart, &tolerances);
    let values = (0..count).flat_map(|texel| (0..width).map(move |i| (texel, i)));
    values.map(|(texel, i)| apart[i * count + texel]).collect()
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
