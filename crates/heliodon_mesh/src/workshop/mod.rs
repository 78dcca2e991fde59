//! A procedural sculptor's workshop with the plan of the workshop of Pheidias at Olympia, and in it the seated god.
//!
//! The counterpart of [`crate::temple`]: few large polygons as reconstructions have them, an interior that lives from bounced
//! light, sun through high windows, lamps. Every piece is a closed solid; pieces reach a few millimetres into what carries
//! them, and no two faces coincide.
//!
//! It is modelled with about 39,000 triangles. Light at vertices wants more than the shapes do, so longer edges are halved where
//! [`WorkshopParams::triangles`] asks for it; light in texels does not need that.
//!
//! +Y up, the long axis along X, the door in the east (+X); height zero is the floor.

pub use crate::part::{PartRole, SitePart};

use crate::temple::solid::{SolidMesh, join};
use glam::Vec3;

mod building;
mod columns;
mod furnishing;
pub mod measures;
mod palette;
mod pieces;
mod props;
mod roof;
mod scaffold;
mod slab;
mod split;
mod stations;
mod statue;
#[cfg(test)]
mod tests;
mod throne;

use measures::{BASE_TOP, STATUE_PLACE};
use palette::Palette;
pub use stations::WorkshopThing;

/// What the workshop is to be like.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkshopParams {
    /// Decides the shades of single pieces and what lies about; the measures stay.
    pub seed: u32,
    /// About how many triangles, at the most; 0 for as many as the shapes need, which are never fewer. More cost about 70 bytes
    /// each and make the light at their vertices finer.
    pub triangles: usize,
}

impl Default for WorkshopParams {
    fn default() -> Self {
        Self { seed: 438, triangles: 0 }
    }
}

/// A built site.
#[derive(Clone, Debug)]
pub struct Workshop {
    /// Its meshes: walls, roof, floor, columns, statue, scaffold, benches and what else is of wood, wares, ground.
    pub parts: Vec<SitePart>,
    /// The box of the visitors' eyes, its least and greatest corner: the middle of the hall.
    pub room: (Vec3, Vec3),
    /// What a visitor looks at from there: the statue.
    pub look_at: Vec3,
    /// Flames of the oil lamps, in free air.
    pub lamps: Vec<Vec3>,
    /// What visitors take and work on, upon the benches.
    pub things: Vec<WorkshopThing>,
}

impl Workshop {
    /// Triangles of all parts.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.parts.iter().map(|part| part.mesh.triangles.len()).sum()
    }
}

/// The box of the visitors' eyes.
const ROOM: (Vec3, Vec3) = (Vec3::new(-3.6, 1.45, -2.2), Vec3::new(12.6, 1.9, 2.2));
/// The statue's hands.
const LOOK_AT: Vec3 = Vec3::new(STATUE_PLACE, 5.2, 0.0);

/// One part before its solids become one mesh.
type Solids = (&'static str, PartRole, Vec<SolidMesh>);

/// All parts, piece by piece.
fn solids(seed: u32) -> Vec<Solids> {
    // a stream for each part, so that a change of one leaves the others as they were
    let palette = |stream: u64| Palette::new(seed, stream);
    let furnishing = furnishing::furnishing(&mut palette(7));
    let mut all = vec![
        ("walls", PartRole::Filling, building::walls(&mut palette(1))),
        ("roof", PartRole::Filling, roof::roof(&mut palette(2))),
        ("floor", PartRole::Filling, building::floor(&mut palette(3))),
        ("columns", PartRole::Filling, columns::columns(&mut palette(4))),
        ("scaffold", PartRole::Prop, scaffold::scaffold(&mut palette(6))),
        ("benches", PartRole::Prop, furnishing.wooden),
        ("wares", PartRole::Prop, furnishing.wares),
        ("coals", PartRole::Prop, furnishing.coals),
        ("ground", PartRole::Ground, building::ground(&mut palette(8))),
    ];
    all.extend(seated_god(&mut palette(5)));
    all
}

/// The statue on its throne and base, looking to the door.
fn seated_god(palette: &mut Palette) -> Vec<Solids> {
    let yaw_rad = std::f32::consts::FRAC_PI_2;
    let at = Vec3::new(STATUE_PLACE, 0.0, 0.0);
    let lift = Vec3::Y * (BASE_TOP + throne::FOOTSTOOL_HEIGHT);
    let on_base = |solids: Vec<SolidMesh>| pieces::placed(solids, at + lift, yaw_rad).collect::<Vec<_>>();
    let mut all: Vec<Solids> =
        statue::figure(palette).into_iter().map(|(name, solids)| (name, PartRole::Filling, on_base(solids))).collect();
    let mut throne = on_base(throne::throne(palette));
    throne.extend(pieces::placed(throne::base(palette), at, yaw_rad));
    all.push(("throne", PartRole::Filling, throne));
    all
}

/// The longest edge that is tried first, metres, and what it shrinks by from one try to the next: about 19 % more triangles.
const LONGEST_EDGE_M: f32 = 16.0;
const EDGE_STEP: f32 = 0.917;
/// Edges are not cut finer than this, metres.
const SHORTEST_EDGE_M: f32 = 0.02;
/// Edges of the ground, which nobody stands near, may be so many times longer.
const GROUND_COARSER: f32 = 4.0;

/// Halves long edges of all parts as far as `triangles` allow.
fn refine(parts: &mut Vec<SitePart>, triangles: usize) {
    let mut longest_m = LONGEST_EDGE_M;
    while longest_m > SHORTEST_EDGE_M {
        let mut finer = parts.clone();
        for part in &mut finer {
            let coarser = if part.role == PartRole::Ground { GROUND_COARSER } else { 1.0 };
            split::split_edges(&mut part.mesh, longest_m * coarser);
        }
        if finer.iter().map(|part| part.mesh.triangles.len()).sum::<usize>() > triangles {
            return;
        }
        *parts = finer;
        longest_m *= EDGE_STEP;
    }
}

/// Builds the site.
#[must_use]
pub fn workshop(params: &WorkshopParams) -> Workshop {
    let mut parts: Vec<SitePart> =
        solids(params.seed).into_iter().map(|(name, role, solids)| SitePart { name, role, mesh: join(solids) }).collect();
    if params.triangles > parts.iter().map(|part| part.mesh.triangles.len()).sum() {
        refine(&mut parts, params.triangles);
    }
    Workshop { parts, room: ROOM, look_at: LOOK_AT, lamps: furnishing::lamps(), things: stations::things(params.seed) }
}
