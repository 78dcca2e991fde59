//! Walls thinner than texels: what lies on both sides of one is dark where one side is ([`heliodon_lightmap::walls`]).
//!
//! Only between what is dark and what is lit rays are asked, once all light is known: where no room is dark there are none, and kept blocks hold what they held.

use super::atlas::{Atlas, Texels};
use super::stage::{Lit, SolvedScene, TexelValues};
use heliodon_lightmap::walls::{Footing, Walls, Wanted, asked, is_dark_beside, take_from};

/// What has less than this part of the even sky on the other side of a wall is dark. More than of light maps: cells of the vertices' solve have light of both sides of a wall that stands on
/// them, and bring up to a hundredth of what is outside into a closed room; and sun at the foot of a wall is seen in a dim one, too.
const DARK: f32 = 1.0 / 50.0;

/// Whether what has so much of an even sky is dark beside what has as much as the other.
pub fn is_dark(ambient: f32, other: f32) -> bool {
    is_dark_beside(ambient, other, DARK)
}

/// A level of an atlas on which walls may stand.
#[derive(Clone, Copy)]
pub struct Walled<'a> {
    /// What it takes its light from.
    pub solved: &'a SolvedScene<'a>,
    /// The atlas.
    pub atlas: &'a Atlas,
    /// Its texels.
    pub texels: &'a Texels,
}

impl Walled<'_> {
    /// Walls between wanted texels, none of which something lies on, and the number of rays.
    fn walls(&self, valid: &[bool], wanted: Wanted) -> (Walls, u64) {
        let Self { solved, atlas, texels } = *self;
        let some = asked(&texels.grid, valid, wanted);
        if some.is_empty() {
            return (Walls::default(), 0);
        }
        let receivers = (atlas, texels).receivers(solved.receiving, &some);
        let points = receivers.points();
        let origins = receivers.in_order_of_places(&points.origins, 1);
        let normals = receivers.in_order_of_places(&points.normals, 1);
        let start = |texel: u32| {
            // no other is asked
            let at = some.binary_search(&texel).unwrap_or_default();
            (origins[at], normals[at])
        };
        let surfaces = &solved.input.surfaces;
        let is_own = |triangle: u32, texel: u32| {
            let shown = surfaces.detail.map_or(triangle, |detail| detail.stands_for[triangle as usize]);
            atlas.chart(shown) == Some(atlas.unwrapped().chart[texels.texels[texel as usize].triangle as usize])
        };
        let footing = Footing { rays: surfaces.rays, grid: &texels.grid, start: &start, is_own: &is_own };
        let (lain_on, rays) = footing.lain_on(&some);
        let mut stands = valid.to_vec();
        some.iter().zip(lain_on).for_each(|(&texel, lain_on)| stands[texel as usize] &= !lain_on);
        let (walls, more) = Walls::find(&footing, &stands, wanted);
        (walls, rays + more)
    }

    /// Darkens texels that a wall parts from such as no sky reaches, and counts the rays; returns which they are.
    pub fn darken(&self, found: &mut TexelValues) -> Vec<u32> {
        let width = found.values.len() / self.texels.texels.len().max(1);
        let of = |texel: u32| found.ambient[texel as usize];
        let wanted = |a: u32, b: u32| is_dark(of(a), of(b)) || is_dark(of(b), of(a));
        let (walls, rays) = self.walls(&found.valid, &wanted);
        let darkened = walls.darkened(DARK, of);
        found.rays += rays;
        take_from(&darkened, &mut found.ambient, 1);
        take_from(&darkened, &mut found.values, width);
        darkened.iter().map(|(texel, _)| *texel).collect()
    }

    /// Darkens the masks, so many words each, of texels that are lit where a wall parts them from what is dark and has no sun: beside walls in the open there is sky. `dark` says
    /// where there is none. Those that are not valid have the sun of any side of their wall, and it is the dark one. Returns the number of rays.
    pub fn darken_masks(&self, masks: &mut [u32], words: usize, valid: &[bool], dark: &[bool]) -> u64 {
        let is_lit: Vec<bool> = masks.chunks_exact(words.max(1)).map(|mask| mask.iter().any(|word| *word != 0)).collect();
        let lit = |texel: u32| is_lit[texel as usize];
        let no_sun = |texel: u32| dark[texel as usize] && !lit(texel);
        let (walls, rays) = self.walls(valid, &|a, b| (no_sun(a) && lit(b)) || (no_sun(b) && lit(a)));
        let of_walls = walls.darkened(DARK, |texel| f32::from(u8::from(lit(texel)))).into_iter().map(|(texel, _)| texel);
        let within = (0..valid.len() as u32).filter(|&texel| dark[texel as usize] && !valid[texel as usize]);
        for texel in of_walls.chain(within) {
            masks[texel as usize * words..(texel as usize + 1) * words].fill(0);
        }
        rays
    }
}
