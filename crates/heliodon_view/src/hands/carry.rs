//! Where a thing is while a hand holds it, and how it gets out of the hand again.

use super::pose::{HandPose, Scheme};
use super::reach::{Met, Scene};
use super::shape::Shape;
use super::{BOTH, Hand, Hands, LetGo, REACH_M, Site, act};
use bevy::prelude::*;
use glam::Affine3A;
use heliodon_bundle::site::Thing;
use heliodon_math::frame::unit_or;
use heliodon_script::event::Event;

/// In so many seconds a thing comes into the hand from where it was.
const COMES_IN_S: f32 = 0.2;
/// How long a blow takes, there and back, seconds.
pub(super) const SWING_S: f32 = 0.35;
/// When it lands.
pub(super) const LANDS_S: f32 = 0.2;
/// When it begins to go forward: before, the arm is drawn back.
const DRAWN_S: f32 = 0.09;
/// How far the hand goes forward, as a part of how far before the eyes it is, and how far the head of a tool turns.
const FORWARD: f32 = 0.4;
const TURNS_RAD: f32 = 1.1;
/// Something before a wall is drawn nearer to the eyes, and smaller as it is nearer, so that it looks the same: down to this part of it, or what is nearest to the
/// eyes would be cut away.
const LEAST_NEAR: f32 = 0.2;
/// A surface is flat enough to put something on it: less steep than 45 degrees.
const FLAT: f32 = 0.7;

/// What a hand holds.
pub(super) struct Held {
    pub name: String,
    pub thing: Thing,
    pub shape: Shape,
    /// How it lies in a tracked hand that has gone where it was; else it lies as is fit.
    pub hand_from_model: Option<Affine3A>,
    /// Where it was when it was taken, and how long ago.
    from: Affine3A,
    since_s: f32,
    /// Where it is shown.
    world_from_model: Affine3A,
}

/// A blow on its way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Swing {
    passed_s: f32,
}

impl Swing {
    /// How far forward the hand is: 1 where it lands, a little less than 0 while it is drawn back.
    fn forward(self) -> f32 {
        let smooth = |t: f32| t * t * (3.0 - 2.0 * t);
        let t = self.passed_s;
        if t < DRAWN_S {
            -0.2 * smooth(t / DRAWN_S)
        } else if t < LANDS_S {
            let along = (t - DRAWN_S) / (LANDS_S - DRAWN_S);
            -0.2 + 1.2 * along * along
        } else {
            1.0 - smooth(((t - LANDS_S) / (SWING_S - LANDS_S)).min(1.0))
        }
    }
}

impl Held {
    /// A thing that is taken from where it stands.
    fn new(name: &str, thing: Thing, shape: Shape, stands: Affine3A) -> Self {
        let name = name.to_owned();
        Self { name, thing, shape, hand_from_model: None, from: stands, since_s: 0.0, world_from_model: stands }
    }

    /// Whether it has arrived in the hand.
    pub fn arrived(&self) -> bool {
        self.since_s >= COMES_IN_S
    }

    /// How it lies in a tracked hand.
    pub fn in_hand(&self) -> Affine3A {
        self.hand_from_model.unwrap_or_else(|| self.shape.in_hand())
    }

    /// Where it belongs in a hand, walls aside.
    fn goal(&self, hand: Hand, pose: &HandPose, swing: Option<Swing>) -> Affine3A {
        if pose.scheme == Scheme::Tracked {
            return pose.world_from_hand * self.in_hand();
        }
        let side = if hand == Hand::Left { -1.0 } else { 1.0 };
        let rests = self.shape.before(pose.view, side);
        let forward = swing.map_or(0.0, Swing::forward);
        let (eye, look) = pose.view;
        let grip = rests.transform_point3(self.shape.grip);
        let far = grip.distance(eye);
        // towards the middle of the view, in which it lands
        let step = look * (Vec3::new(-0.35 * side, 0.5, -1.0) * (FORWARD * far * forward));
        let turn = Quat::from_axis_angle(look * Vec3::X, -TURNS_RAD * forward * f32::from(u8::from(self.shape.long.is_some())));
        Affine3A::from_translation(grip + step) * Affine3A::from_quat(turn) * Affine3A::from_translation(-grip) * rests
    }
}

/// How near to the eyes something before a view is drawn so that no wall hides it, as a part of how far it is.
fn nearness(scene: Scene<'_>, eye: Vec3, goal: Affine3A, shape: &Shape, without: &[String]) -> f32 {
    let (low, high) = shape.bounds;
    let corners = (0..8).map(|i| Vec3::select(BVec3::new(i & 1 == 0, i & 2 == 0, i & 4 == 0), low, high));
    let places = corners.chain([(low + high) * 0.5]).map(|p| goal.transform_point3(p));
    let near = places.filter_map(|place| {
        let far = place.distance(eye);
        let met = scene.cast(eye, unit_or(place - eye, Vec3::NEG_Z), far, without)?;
        // a hair before the wall
        Some(0.97 * met.distance / far)
    });
    near.fold(1.0, f32::min).max(LEAST_NEAR)
}

/// Puts what is held where it is held, and lets blows land.
pub(super) fn carry(time: Res<Time>, mut site: Site, mut hands: ResMut<Hands>) {
    let seconds = time.delta_secs();
    let without = hands.in_hand();
    for hand in BOTH {
        let one = &mut hands.of[hand as usize];
        let (Some(held), Some(pose)) = (&mut one.held, one.pose) else {
            one.swing = None;
            continue;
        };
        held.since_s += seconds;
        if held.shape.radius() == 0.0 {
            // what was hidden until now has been posed since
            held.shape = Shape::of(site.scene(), &held.name).unwrap_or_else(|| held.shape.clone());
        }
        let lands = one.swing.as_mut().is_some_and(|swing| {
            let before_s = swing.passed_s;
            swing.passed_s += seconds;
            before_s < LANDS_S && swing.passed_s >= LANDS_S
        });
        one.swing = one.swing.filter(|swing| swing.passed_s < SWING_S && pose.scheme == Scheme::View);
        let mut shown = held.goal(hand, &pose, one.swing);
        if !held.arrived() {
            shown = between(held.from, shown, held.since_s / COMES_IN_S);
        }
        if pose.scheme == Scheme::View {
            let eye = pose.view.0;
            let near = nearness(site.scene(), eye, shown, &held.shape, &without);
            let nearer = Affine3A::from_translation(eye) * Affine3A::from_scale(Vec3::splat(near));
            shown = nearer * Affine3A::from_translation(-eye) * shown;
        }
        held.world_from_model = shown;
        site.put(&held.name, shown);
        if lands && let Some(met) = site.scene().cast(pose.aim.0, pose.aim.1, REACH_M, &without) {
            let (name, thing) = (held.name.clone(), held.thing.clone());
            act::land(&mut site, (&name, &thing), &met);
        }
    }
}

/// On the way from one place to another.
fn between(from: Affine3A, to: Affine3A, along: f32) -> Affine3A {
    let along = along * along * (3.0 - 2.0 * along);
    let (_, turn, place) = from.to_scale_rotation_translation();
    let (_, to_turn, to_place) = to.to_scale_rotation_translation();
    Affine3A::from_rotation_translation(turn.slerp(to_turn, along), place.lerp(to_place, along))
}

/// Takes a thing into a hand; whatever that held falls. False where there is no such thing.
pub(super) fn grab(hands: &mut Hands, site: &mut Site<'_>, hand: Hand, name: &str) -> bool {
    let scene = site.scene();
    let stands = scene.actors.whereabouts(name).or_else(|| scene.impostors.whereabouts(name, scene.actors));
    let (Some(thing), Some((stands, _)), Some(shape)) = (site.thing(name), stands, Shape::of(scene, name)) else {
        return false;
    };
    match hands.holder(name) {
        Some(holder) if holder == hand => return true,
        Some(other) => {
            hands.of[other as usize].held = None;
            site.story.set_held(other, None);
        }
        None => {}
    }
    drop_held(hands, site, hand, true);
    let mut held = Held::new(name, thing, shape, stands);
    let one = &mut hands.of[hand as usize];
    let touched = one.met.as_ref().is_some_and(|met| met.touched && met.name == name);
    if let Some(pose) = one.pose.as_ref().filter(|_| touched) {
        held.hand_from_model = Some(pose.world_from_hand.inverse() * stands);
    }
    (one.held, one.swing) = (Some(held), None);
    hands.take_up(name);
    site.story.stop_moving(name);
    site.story.set_held(hand, Some(name));
    true
}

/// Empties a hand; who asked for it puts the thing somewhere.
pub(super) fn empty(hands: &mut Hands, site: &mut Site<'_>, hand: Hand) -> Option<Held> {
    let one = &mut hands.of[hand as usize];
    (one.swing, one.contact) = Default::default();
    let held = one.held.take()?;
    site.story.set_held(hand, None);
    Some(held)
}

/// Lets what a hand holds fall, or flies on what a tracked hand throws.
pub(super) fn drop_held(hands: &mut Hands, site: &mut Site<'_>, hand: Hand, told: bool) {
    let pose = hands.of[hand as usize].pose;
    let without = hands.in_hand();
    let Some(held) = empty(hands, site, hand) else { return };
    let (world_from_model, velocity_m_s, spin_rad_s) = match pose {
        Some(pose) if pose.scheme == Scheme::Tracked => (held.world_from_model, pose.velocity_m_s, pose.spin_rad_s),
        Some(pose) => (before_walls(site.scene(), pose.view.0, &held, &without), Vec3::ZERO, Vec3::ZERO),
        None => (held.world_from_model, Vec3::ZERO, Vec3::ZERO),
    };
    release(hands, site, hand, LetGo { name: held.name, world_from_model, velocity_m_s, spin_rad_s }, told);
}

/// Puts what a hand holds onto a surface that it points at, upright; elsewhere it falls.
pub(super) fn put_down(hands: &mut Hands, site: &mut Site<'_>, hand: Hand, on: Option<&Met>) {
    let points = hands.pose(hand).is_some_and(|pose| pose.scheme == Scheme::View);
    let Some(on) = on.filter(|on| points && on.normal.y > FLAT) else { return drop_held(hands, site, hand, true) };
    let Some(held) = empty(hands, site, hand) else { return };
    let world_from_model = held.shape.upright_on(on.place, held.world_from_model);
    let let_go = LetGo { name: held.name, world_from_model, velocity_m_s: Vec3::ZERO, spin_rad_s: Vec3::ZERO };
    release(hands, site, hand, let_go, true);
}

fn release(hands: &mut Hands, site: &mut Site<'_>, hand: Hand, let_go: LetGo, told: bool) {
    site.put(&let_go.name, let_go.world_from_model);
    if told {
        let place = Vec3::from(let_go.world_from_model.translation).to_array();
        site.tell(Event::Released { thing: let_go.name.clone(), hand, place });
    }
    hands.release(let_go);
}

/// Where a thing that is shown before a view is in truth: in its own size, before whatever stands in its way.
fn before_walls(scene: Scene<'_>, eye: Vec3, held: &Held, without: &[String]) -> Affine3A {
    let (low, high) = held.shape.bounds;
    let (scale, turn, _) = held.world_from_model.to_scale_rotation_translation();
    let middle = (low + high) * 0.5;
    let shown = held.world_from_model.transform_point3(middle);
    let (along, radius) = (unit_or(shown - eye, Vec3::NEG_Z), held.shape.radius());
    let far = shown.distance(eye) / scale.x.abs().max(f32::MIN_POSITIVE);
    let free = scene.cast(eye, along, far + radius, without).map_or(far, |met| (met.distance - radius).clamp(0.0, far));
    Affine3A::from_rotation_translation(turn, eye + along * free - turn * middle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blow_goes_there_and_back() {
        let at = |passed_s| Swing { passed_s }.forward();
        assert_eq!((at(0.0), at(LANDS_S)), (0.0, 1.0));
        assert!(at(DRAWN_S) < -0.15 && at(SWING_S).abs() < 1e-5);
        let steps: Vec<f32> = (0..=350).map(|i| at(i as f32 / 1000.0)).collect();
        assert!(steps.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.03), "no jumps");
    }

    #[test]
    fn what_comes_into_the_hand_begins_and_ends_where_it_should() {
        let from = Affine3A::from_rotation_translation(Quat::from_rotation_x(1.0), Vec3::X);
        let to = Affine3A::from_rotation_translation(Quat::from_rotation_y(-0.5), Vec3::Z);
        assert!(between(from, to, 0.0).abs_diff_eq(from, 1e-5) && between(from, to, 1.0).abs_diff_eq(to, 1e-5));
    }
}
