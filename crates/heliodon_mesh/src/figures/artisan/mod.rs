//! People of a workshop of the fifth century BC: the master in a long tunic and a cloak, a carver in the working man's tunic that leaves
//! the right shoulder bare, a porter with a chest.
//!
//! They stand on the walker's joints and walk as he does; flesh and cloth are closed pieces whose vertices follow several joints. Made to be
//! captured as impostors, from some metres away: a face is some thirty pixels.

mod acts;
mod body;
mod dress;
mod face;
mod sewn;
#[cfg(test)]
mod tests;

use super::walker::rig;
use super::walker::{WALK_LOOP_S, clip, figure, gait, keyed};
use crate::export::scene::{Clip, Scene};
use glam::Vec3;
use sewn::Sewn;

/// Who it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Artisan {
    /// The sculptor himself, old, bald, bearded: clips "idle", "walk" and, once and staying, "point".
    Master,
    /// With mallet and chisel: clips "hammer", "idle", "cheer".
    Carver,
    /// Carries a chest before him: clips "walk" and "idle".
    Porter,
}

/// The length of "idle", seconds.
pub const IDLE_LOOP_S: f32 = 2.5;
/// The length of "hammer", seconds: of one blow.
pub const HAMMER_LOOP_S: f32 = 1.0;
/// The length of "cheer", seconds.
pub const CHEER_LOOP_S: f32 = 1.2;
/// The length of "point", seconds; its last pose is held.
pub const POINT_S: f32 = 1.2;
/// Keys a second.
const KEYS_PER_S: f32 = 40.0;

/// What somebody looks like; colours are linear albedos.
struct Look {
    skin: Vec3,
    hair: Vec3,
    cloth: Vec3,
    /// Along the hem.
    border: Vec3,
    is_bald: bool,
    /// How long the beard is, metres.
    beard_m: f32,
}

impl Artisan {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Master, Self::Carver, Self::Porter];

    /// What a file of this figure is called.
    #[must_use]
    pub fn file_name(self) -> &'static str {
        match self {
            Self::Master => "master.glb",
            Self::Carver => "carver.glb",
            Self::Porter => "porter.glb",
        }
    }

    fn look(self) -> Look {
        let tanned = Vec3::new(0.40, 0.225, 0.145);
        match self {
            Self::Master => Look {
                skin: Vec3::new(0.46, 0.28, 0.19),
                hair: Vec3::new(0.48, 0.46, 0.43),
                cloth: Vec3::new(0.62, 0.57, 0.47),
                border: Vec3::new(0.30, 0.055, 0.05),
                is_bald: true,
                beard_m: 0.05,
            },
            Self::Carver => Look {
                skin: tanned,
                hair: Vec3::new(0.035, 0.024, 0.018),
                cloth: Vec3::new(0.43, 0.34, 0.22),
                border: Vec3::new(0.20, 0.13, 0.075),
                is_bald: false,
                beard_m: 0.02,
            },
            Self::Porter => Look {
                skin: tanned * 1.06,
                hair: Vec3::new(0.10, 0.055, 0.03),
                cloth: Vec3::new(0.27, 0.105, 0.065),
                border: Vec3::new(0.46, 0.38, 0.26),
                is_bald: false,
                beard_m: 0.0,
            },
        }
    }
}

/// Makes somebody: one mesh with a skin of the walker's 30 joints, feet on y = 0, about 1.75 m high, facing +Z. All clips but "point" loop.
#[must_use]
pub fn artisan(who: Artisan) -> Scene {
    let look = who.look();
    let mut sewn = Sewn::default();
    face::head(&mut sewn, &look);
    body::trunk(&mut sewn, &look);
    body::limbs(&mut sewn, &look);
    match who {
        Artisan::Master => dress::robe(&mut sewn, &look),
        Artisan::Carver => {
            dress::tunic(&mut sewn, &look);
            body::tools(&mut sewn);
        }
        Artisan::Porter => {
            dress::tunic(&mut sewn, &look);
            body::chest(&mut sewn);
        }
    }
    figure("artisan", sewn.finish("artisan"), clips(who))
}

fn clips(who: Artisan) -> Vec<Clip> {
    let rest = rig::rest();
    let keys = |length_s: f32| (length_s * KEYS_PER_S) as usize + 1;
    let looped =
        |name: &str, length_s: f32, pose: fn(&[rig::Rest], f64) -> rig::Pose| clip(name, length_s, keys(length_s), &rest, pose);
    match who {
        Artisan::Master => {
            let last = keys(POINT_S) - 1;
            let poses: Vec<_> = (0..=last).map(|i| acts::point(&rest, i as f64 / last as f64)).collect();
            vec![
                looped("idle", IDLE_LOOP_S, acts::stand),
                looped("walk", WALK_LOOP_S, gait::walk),
                keyed("point", POINT_S, &rest, &poses),
            ]
        }
        Artisan::Carver => vec![
            looped("hammer", HAMMER_LOOP_S, acts::hammer),
            looped("idle", IDLE_LOOP_S, acts::hold),
            looped("cheer", CHEER_LOOP_S, acts::cheer),
        ],
        Artisan::Porter => {
            vec![looped("walk", WALK_LOOP_S, acts::carry), looped("idle", IDLE_LOOP_S, acts::carry_standing)]
        }
    }
}
