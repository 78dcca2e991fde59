//! What is let go in the air falls onto what is below it, and comes to lie upright there.
//!
//! No bodies: nothing rolls, tips over or pushes anything. A thing goes on as fast as the hand went, stops at walls, and rights itself as it falls, so that it lies as things do.

use super::Hands;
use super::reach::Scene;
use crate::actors::Actors;
use crate::impostor::Impostors;
use crate::stage::Stage;
use bevy::prelude::*;
use glam::{Affine3A, Mat3A};

const GRAVITY_M_S2: f32 = 9.81;
/// How fast a thing rights itself, seconds to a third of what is left.
const RIGHTS_S: f32 = 0.07;
/// Nearer than this to upright it is, radians.
const UPRIGHT_RAD: f32 = 0.01;
/// A frame counts for no more, seconds.
const LONGEST_FRAME_S: f32 = 0.05;
/// Below what has fallen for so long there is nothing, seconds: 44 m.
const LONGEST_S: f32 = 3.0;
/// What begins so deep in something is lifted onto it, metres.
const LIFT_M: f32 = 0.25;
/// Steeper than this a surface is a wall (the cosine).
const WALL: f32 = 0.6;

/// What falls.
#[derive(Resource, Debug, Default)]
pub(super) struct Falling {
    stage: u64,
    things: Vec<Fall>,
}

#[derive(Debug)]
struct Fall {
    name: String,
    at: Affine3A,
    velocity_m_s: Vec3,
    for_s: f32,
}

/// Lets things fall on.
pub(super) fn fall(
    time: Res<Time>,
    (stage, impostors): (Res<Stage>, Res<Impostors>),
    hands: Res<Hands>,
    mut actors: ResMut<Actors>,
    mut falling: ResMut<Falling>,
) {
    if falling.stage != stage.serial() {
        *falling = Falling { stage: stage.serial(), things: Vec::new() };
    }
    falling.things.retain(|fall| !hands.taken_up.contains(&fall.name) && hands.holder(&fall.name).is_none());
    for let_go in &hands.let_go {
        falling.things.retain(|fall| fall.name != let_go.name);
        let (name, at, velocity_m_s) = (let_go.name.clone(), let_go.world_from_model, let_go.velocity_m_s);
        falling.things.push(Fall { name, at, velocity_m_s, for_s: 0.0 });
    }
    let seconds = time.delta_secs().min(LONGEST_FRAME_S);
    falling.things.retain_mut(|fall| {
        let without = [fall.name.clone()];
        let scene = Scene { stage: &stage, actors: &actors, impostors: &impostors };
        let lies = fall.pass(seconds, &scene, &without);
        let place = (fall.for_s < LONGEST_S).then_some(fall.at);
        actors.directions.entry(fall.name.clone()).or_default().world_from_model = place;
        !lies && place.is_some()
    });
}

impl Fall {
    /// Falls on; answers whether it lies.
    fn pass(&mut self, seconds: f32, scene: &Scene<'_>, without: &[String]) -> bool {
        self.for_s += seconds;
        let upright = self.right(seconds);
        let Some(solid) = scene.actors.solid(&self.name) else { return true };
        let turned = |p: &Vec3| (self.at.matrix3 * glam::Vec3A::from(*p)).y;
        let lowest = solid.positions.iter().map(turned).fold(f32::INFINITY, f32::min);
        self.velocity_m_s.y -= GRAVITY_M_S2 * seconds;
        let along = Vec3::new(self.velocity_m_s.x, 0.0, self.velocity_m_s.z);
        let origin = Vec3::from(self.at.translation);
        if let Some(ahead) = along.try_normalize() {
            let way = along.length() * seconds;
            let wall = scene.cast(origin, ahead, way + 0.5 * lowest.abs(), without).filter(|met| met.normal.y < WALL);
            match wall {
                Some(_) => (self.velocity_m_s.x, self.velocity_m_s.z) = (0.0, 0.0),
                None => self.at.translation += glam::Vec3A::from(along * seconds),
            }
        }
        let down = (-self.velocity_m_s.y * seconds).max(0.0);
        let foot = Vec3::from(self.at.translation) + Vec3::Y * lowest;
        let met = scene.cast(foot + Vec3::Y * LIFT_M, Vec3::NEG_Y, LIFT_M + down, without);
        match met {
            Some(met) => {
                self.at.translation.y = met.place.y - lowest;
                self.velocity_m_s = Vec3::ZERO;
                upright
            }
            None => {
                self.at.translation.y -= down;
                false
            }
        }
    }

    /// Turns it upright, as far as it gets; answers whether it is.
    fn right(&mut self, seconds: f32) -> bool {
        let (scale, turn, _) = self.at.to_scale_rotation_translation();
        let up = turn * Vec3::Y;
        let lean_rad = up.angle_between(Vec3::Y);
        if lean_rad < UPRIGHT_RAD {
            return true;
        }
        let part = 1.0 - libm::expf(-seconds / RIGHTS_S);
        // the rest at once, where little is left
        let part = if lean_rad * (1.0 - part) < UPRIGHT_RAD { 1.0 } else { part };
        let righted = Quat::IDENTITY.slerp(Quat::from_rotation_arc(up, Vec3::Y), part) * turn;
        self.at.matrix3 = Mat3A::from_quat(righted) * Mat3A::from_diagonal(scale);
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_leans_rights_itself_and_keeps_its_size() {
        let at = Affine3A::from_scale_rotation_translation(Vec3::splat(2.0), Quat::from_rotation_x(1.2), Vec3::ONE);
        let mut fall = Fall { name: "mallet".into(), at, velocity_m_s: Vec3::ZERO, for_s: 0.0 };
        let frames = (0..100).position(|_| fall.right(0.02)).unwrap();
        assert!((5..40).contains(&frames), "{frames}");
        assert!(fall.at.transform_vector3(Vec3::Y).abs_diff_eq(2.0 * Vec3::Y, 0.05));
    }
}
