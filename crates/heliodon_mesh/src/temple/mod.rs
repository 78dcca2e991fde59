//! A procedural Doric temple with the Parthenon's measures, whole or in ruins, on its rock.
//!
//! Every stone is a closed solid of its own: drums, capitals, beams, blocks of the walls, triglyphs, boulders. They reach a
//! few millimetres into their neighbours, so that no two faces coincide and no light leaks through joints. How fine a stone
//! is cut follows its size in the picture that the visitor sees ([`sizing`]); a single length in pixels is found for which
//! the total meets [`TempleParams::triangles`].
//!
//! Why stones and not one carved mass: joints, chipped edges and shifted drums are what raking light shows of the scanned
//! monument, and stones are cut in parallel, each knowing which of its faces can be seen; a level set would need cells as small
//! as an arris everywhere.
//!
//! +Y up, the long axis along X, west is -X; height zero is the top of the euthynteria, the lowest levelled course.

pub use crate::part::{PartRole, SitePart};
use glam::Vec3;
use rayon::prelude::*;

mod block;
mod cella;
mod column;
mod contact;
mod debris;
mod entablature;
mod figures;
mod finish;
mod ground;
mod ground_cut;
mod halve;
mod krepis;
mod marble;
pub mod measures;
pub(crate) mod noise;
mod pediment;
mod peristyle;
pub mod projected;
mod relief;
mod roof;
pub mod sizing;
pub(crate) mod solid;
#[cfg(test)]
mod tests;
mod tube;
mod visible;
mod yard;

use ground::Ground;
use ground_cut::GroundCut;
use sizing::{Grain, View};
use solid::{SolidMesh, join};
use yard::{Element, Yard};

/// How much of the temple there is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// As it was finished in 432 BCE, without its colours.
    Intact,
    /// As it was scanned: no roof, the middle thrown down, the west front nearly whole.
    Ruined,
}

/// Triangles for which those in the visitor's picture, 1024 x 768 pixels with 50 degrees, are no larger than four square
/// pixels.
pub const DEMO_TRIANGLES: usize = 1_200_000;

/// What the temple is to be like.
#[derive(Clone, Debug)]
pub struct TempleParams {
    /// Decides every irregularity; the measures stay.
    pub seed: u32,
    /// Triangles in all, met within a few per cent between 50 thousand and 50 million. More cost memory (about 35 bytes each
    /// while they are made, twice that at the peak) and time, fewer cost sharpness of shadows.
    pub triangles: usize,
    /// Whole or in ruins.
    pub state: State,
    /// Weathering, from 0 (as the masons left it) to 1 (worse than it is today).
    pub erosion: f32,
    /// Plan position of the middle of the visitor's room; its height is found from the ground.
    pub eye: Vec3,
}

impl Default for TempleParams {
    fn default() -> Self {
        Self { seed: 1687, triangles: DEMO_TRIANGLES, state: State::Ruined, erosion: 0.55, eye: Vec3::new(-68.0, 0.0, -36.0) }
    }
}

/// A built site.
#[derive(Clone, Debug)]
pub struct Temple {
    /// Its meshes: krepis, peristyle, entablature, cella, blocks, ground.
    pub parts: Vec<SitePart>,
    /// The box of the visitor's eyes, its least and greatest corner.
    pub room: (Vec3, Vec3),
    /// What a visitor looks at from there.
    pub look_at: Vec3,
}

impl Temple {
    /// Triangles of all parts.
    pub fn triangle_count(&self) -> usize {
        self.parts.iter().map(|part| part.mesh.triangles.len()).sum()
    }
}

/// Stones that no eye sees are cut that much coarser.
const HIDDEN_COARSER: f32 = 3.0;
/// Guesses at the length in pixels for a number of triangles, at most.
const FIT_ROUNDS: usize = 9;
/// Half the size of the visitor's room.
const ROOM_HALF: Vec3 = Vec3::new(1.25, 0.4, 1.25);
/// Height of its middle over the ground: a person's eyes.
const ROOM_OVER_GROUND: f32 = 1.72;

/// Stones not yet cut, and how they will be.
struct Site {
    stones: Vec<(&'static str, PartRole, Vec<Element>)>,
    ground: Ground,
    cut: GroundCut,
    view: View,
    room: (Vec3, Vec3),
    look_at: Vec3,
}

impl Site {
    fn plan(params: &TempleParams) -> Self {
        // few triangles make fewer, larger stones
        let merge = match params.triangles {
            0..150_000 => 4,
            150_000..400_000 => 2,
            _ => 1,
        };
        let ground = Ground::new(params.seed, params.eye);
        let room = room(&ground, params.eye);
        let middle = (room.0 + room.1) * 0.5;
        let look_at = look_at(middle);
        let view = View::new(room, look_at);
        let erosion = params.erosion.clamp(0.0, 1.0);
        let yard = |stream: u32| Yard::new(params.seed, stream, erosion, merge);
        let mut krepis = yard(1);
        krepis::build(&mut krepis);
        let mut peristyle = yard(2);
        peristyle::build(&mut peristyle, params.state);
        let mut entablature = yard(3);
        entablature::build(&mut entablature, params.state);
        pediment::build(&mut entablature, params.state);
        if params.state == State::Intact {
            roof::build(&mut entablature);
        }
        let mut cella = yard(4);
        cella::build(&mut cella, params.state);
        let mut blocks = yard(5);
        debris::build(&mut blocks, params.state, &ground, middle, view.forward());
        let mut stones = vec![
            ("krepis", PartRole::Scan, krepis.elements),
            ("peristyle", PartRole::Scan, peristyle.elements),
            ("entablature", PartRole::Scan, entablature.elements),
            ("cella", PartRole::Scan, cella.elements),
            ("blocks", PartRole::Filling, blocks.elements),
        ];
        let standing = stones.iter_mut().filter(|(_, role, _)| *role == PartRole::Scan);
        contact::note_contacts(&mut standing.map(|(_, _, elements)| elements.as_mut_slice()).collect::<Vec<_>>());
        let cut = GroundCut::new(&ground, &view);
        let coarse_ground = cut.shape(&ground, &Grain { view: &view, px: 8.0, ornaments: true });
        let parts: Vec<&[Element]> = stones.iter().map(|(_, _, elements)| elements.as_slice()).collect();
        let seen = visible::seen_faces(&parts, &coarse_ground, &view);
        for ((_, _, elements), seen) in stones.iter_mut().zip(seen) {
            for (stone, seen) in elements.iter_mut().zip(seen) {
                if let Some(seen) = seen {
                    stone.note_seen(seen, HIDDEN_COARSER);
                }
            }
        }
        Self { stones, ground, cut, view, room, look_at }
    }

    fn grain(&self, px: f32) -> Grain<'_> {
        Grain { view: &self.view, px, ornaments: false }
    }

    /// Triangles of the stones (exact) and of the ground (before its edges are halved).
    fn counts(&self, px: f32) -> (usize, usize) {
        let grain = self.grain(px);
        let stones =
            self.stones.iter().map(|(_, _, elements)| elements.par_iter().map(|e| e.count(&grain)).sum::<usize>()).sum();
        (stones, self.cut.base_count(px))
    }

    /// The length in pixels for which the total is nearest to `triangles`, and that total.
    fn fit(&self, triangles: usize) -> (f32, usize) {
        let target = libm::logf(triangles.max(1) as f32);
        // logarithms of the length and of the total it gave: the total falls with a power of the length that changes slowly
        let mut px = 3.0_f32;
        let (mut power, mut last): (f32, Option<(f32, f32)>) = (1.7, None);
        let mut best = (f32::MAX, px, 0);
        // the ground is cut to know how much halving adds; that share changes slowly
        let mut growth: Option<(f32, f32)> = None;
        for _ in 0..FIT_ROUNDS {
            let (stones, ground) = self.counts(px);
            let near = growth.filter(|(at, _)| (0.96..1.04).contains(&(px / at)));
            let (at, share) = near.unwrap_or_else(|| (px, self.cut.growth(&self.ground, &self.grain(px))));
            growth = Some((at, share));
            let total = stones + (ground as f32 * share) as usize;
            let now = (libm::logf(px), libm::logf(total.max(1) as f32));
            if let Some(before) = last
                && (now.0 - before.0).abs() > 1e-4
            {
                power = (-(now.1 - before.1) / (now.0 - before.0)).clamp(0.35, 2.2);
            }
            let off = (now.1 - target).abs();
            if off < best.0 {
                best = (off, px, total);
            }
            if off < 0.006 {
                break;
            }
            last = Some(now);
            px = (px * libm::expf((now.1 - target) / power)).clamp(0.02, 400.0);
        }
        (best.1, best.2)
    }
}

/// The box of a visitor's eyes who stands at a place of the plan.
fn room(ground: &Ground, place: Vec3) -> (Vec3, Vec3) {
    let middle = ground.point(place.x, place.z) + Vec3::Y * ROOM_OVER_GROUND;
    (middle - ROOM_HALF, middle + ROOM_HALF)
}

/// The middle of the temple as seen from a place, raised so that the picture holds it with some ground and sky.
fn look_at(from: Vec3) -> Vec3 {
    let to = Vec3::new(-from.x * 0.72, 0.0, -from.z * 0.94);
    let distance = to.length().max(1.0);
    from + to + Vec3::Y * (0.135 * distance)
}

/// The longest leg of a triangle, in pixels of the picture that [`sizing`] names, for which `params.triangles` suffice, and
/// the total within a per cent. Nothing is cut but a sample of the ground.
pub fn estimate(params: &TempleParams) -> (f32, usize) {
    Site::plan(params).fit(params.triangles)
}

/// Builds the site.
pub fn build(params: &TempleParams) -> Temple {
    let site = Site::plan(params);
    let (px, _) = site.fit(params.triangles);
    let grain = site.grain(px);
    let mut parts: Vec<SitePart> = site
        .stones
        .iter()
        .map(|(name, role, elements)| {
            let solids: Vec<SolidMesh> = elements.par_iter().map(|element| element.mesh(&grain)).collect();
            SitePart { name, role: *role, mesh: join(solids) }
        })
        .collect();
    let ground = site.cut.mesh(&site.ground, &grain);
    parts.push(SitePart { name: "ground", role: PartRole::Ground, mesh: join(vec![ground]) });
    finish::finish(&mut parts.iter_mut().map(|part| &mut part.mesh).collect::<Vec<_>>(), &site.view, site.look_at, px);
    Temple { parts, room: site.room, look_at: site.look_at }
}
