//! Does what scripts ask for: moves, shows, lets perform, sets the hour and the light.

use super::Story;
use crate::actors::Actors;
use crate::actors::course::Course;
use crate::actors::direction::Performed;
use crate::impostor::Impostors;
use crate::lamps::Lamps;
use crate::navigation::Visitor;
use crate::navigation::pose::Pose;
use crate::time_lapse::TimeLapse;
use crate::time_lapse::exposure::Exposure;
use bevy::prelude::*;
use glam::Affine3A;
use heliodon_bundle::site::{DEFAULT_WALK_SPEED, Walk};
use heliodon_script::action::{Action, Easing};
use heliodon_script::event::Event;
use std::collections::HashMap;

/// What scripts have asked for in this frame.
#[derive(Resource, Clone, Debug, Default)]
pub struct Wishes {
    /// Of sounds.
    pub sounds: Vec<Action>,
    /// Of films.
    pub films: Vec<Action>,
    /// Of what is in the air.
    pub particles: Vec<Action>,
    /// Of materials, transparency, and marks.
    pub looks: Vec<Action>,
    /// Of what is in the visitor's hands.
    pub hands: Vec<Action>,
    /// Of ways that the visitor is shown.
    pub guides: Vec<Action>,
    /// Of everything else.
    pub(super) others: Vec<Action>,
}

impl Wishes {
    /// Lays a wish where whoever carries it out looks for it.
    pub(super) fn sort(&mut self, wish: &Action) {
        let carried_out_by = match wish {
            Action::PlaySound { .. } | Action::StopSound { .. } => &mut self.sounds,
            Action::PlayFilm { .. } | Action::StopFilm { .. } => &mut self.films,
            Action::StartParticles { .. } | Action::StopParticles { .. } => &mut self.particles,
            Action::Material { .. } | Action::Bare { .. } | Action::Fade { .. } | Action::Highlight { .. } => &mut self.looks,
            Action::Give { .. } | Action::Take { .. } | Action::Drop { .. } => &mut self.hands,
            Action::Guide { .. } | Action::NoGuide => &mut self.guides,
            _ => &mut self.others,
        };
        carried_out_by.push(wish.clone());
    }
}

/// What is going on.
#[derive(Debug, Default)]
pub struct StageHand {
    moves: HashMap<String, Movement>,
    /// Who performs a clip once, and when it ends.
    performs: Vec<(String, f64)>,
    hour: Option<Glide>,
    exposure: Option<Glide>,
    view: Option<(Pose, Pose, f32, f32)>,
    /// By number of the lamp: its brightness, and what the bundle gives it.
    lamps: HashMap<usize, (Glide, Vec3)>,
}

impl StageHand {
    /// Lets something rest where it is.
    pub(super) fn forget(&mut self, what: &str) {
        self.moves.remove(what);
    }
}

/// A number on its way to another.
#[derive(Clone, Copy, Debug)]
struct Glide {
    from: f64,
    to: f64,
    passed_s: f32,
    in_s: f32,
}

impl Glide {
    fn new(from: f64, to: f64, in_s: f32) -> Self {
        Self { from, to, passed_s: 0.0, in_s }
    }

    /// Where it is so much later, and whether it has arrived.
    fn pass(&mut self, seconds: f32) -> (f64, bool) {
        self.passed_s += seconds;
        let along = if self.in_s > 0.0 { (self.passed_s / self.in_s).min(1.0) } else { 1.0 };
        (self.from + (self.to - self.from) * f64::from(Easing::Smooth.at(along)), along >= 1.0)
    }
}

/// Somebody or something on its way.
#[derive(Debug)]
enum Movement {
    /// Carried from one stand to another, and turned about the vertical.
    Carried { from: Affine3A, to: Vec3, turn_rad: f32, passed_s: f32, in_s: f32, easing: Easing },
    /// Walks by itself, since so many seconds.
    Walks { course: Course, passed_s: f32, in_s: f32 },
}

impl Movement {
    /// Where it is so much later, and whether it has arrived.
    fn pass(&mut self, seconds: f32) -> (Affine3A, bool) {
        match self {
            Self::Carried { from, to, turn_rad, passed_s, in_s, easing } => {
                *passed_s += seconds;
                let along = if *in_s > 0.0 { (*passed_s / *in_s).min(1.0) } else { 1.0 };
                let eased = easing.at(along);
                let turned = Affine3A::from_rotation_y(*turn_rad * eased);
                let mut at = *from;
                at.matrix3 = turned.matrix3 * from.matrix3;
                at.translation = from.translation.lerp((*to).into(), eased);
                (at, along >= 1.0)
            }
            Self::Walks { course, passed_s, in_s } => {
                *passed_s += seconds;
                (course.at(*passed_s), *passed_s >= *in_s)
            }
        }
    }
}

/// What is moved and lit.
type Props<'w, 's> = (ResMut<'w, Actors>, Res<'w, Impostors>, Option<ResMut<'w, Lamps>>, Query<'w, 's, &'static mut Visitor>);

/// Takes up what was asked for, and goes on with what was begun.
pub(super) fn move_on(
    time: Res<Time>,
    mut wishes: ResMut<Wishes>,
    mut story: ResMut<Story>,
    (mut actors, impostors, mut lamps, mut visitors): Props<'_, '_>,
    mut lapse: ResMut<TimeLapse>,
    mut exposure: ResMut<Exposure>,
) {
    let Story { play: Some(play), pending, .. } = &mut *story else { return };
    let visitor = visitors.iter_mut().next();
    let mut eye = visitor.as_ref().map(|visitor| visitor.pose);
    for wish in wishes.others.drain(..) {
        match &wish {
            Action::SetHour { hour_s, seconds } if *seconds > 0.0 => {
                lapse.playing = false;
                play.hand.hour = Some(Glide::new(lapse.clock_s, f64::from(*hour_s), *seconds));
            }
            Action::SetHour { hour_s, .. } => {
                play.hand.hour = None;
                lapse.scrub(f64::from(*hour_s));
            }
            Action::Pace { factor } => pace(&mut lapse, *factor),
            Action::Exposure { stops, seconds } => {
                play.hand.exposure = Some(Glide::new(exposure.manual_stops.into(), (*stops).into(), *seconds));
            }
            Action::GoTo { view, seconds } => {
                let views = &play.living.views;
                let Some((view, from)) = views.iter().find(|known| known.name == *view).zip(eye) else { continue };
                let [place, target] = [view.place, view.look_at].map(|point| Vec3::from(point.map(|v| v as f32)));
                play.hand.view = Some((from, Pose::looking(place, target), 0.0, *seconds));
            }
            Action::Light { light, brightness, seconds } => {
                let Some(lamps) = &lamps else { continue };
                let known = play.bundle.manifest().lamps.iter().enumerate();
                for (i, lamp) in known.filter(|(_, lamp)| lamp.name.as_deref() == Some(light)) {
                    let whole = Vec3::from(lamp.intensity.map(|v| v as f32));
                    let Some(now) = lamps.lamps.get(i) else { continue };
                    let from = now.intensity.max_element() / whole.max_element().max(f32::MIN_POSITIVE);
                    play.hand.lamps.insert(i, (Glide::new(from.into(), (*brightness).into(), *seconds), whole));
                }
            }
            other => direct(play, &mut actors, &impostors, other),
        }
    }
    let seconds = time.delta_secs();
    let hand = &mut play.hand;
    hand.moves.retain(|name, movement| {
        let (at, arrived) = movement.pass(seconds);
        actors.directions.entry(name.clone()).or_default().world_from_model = Some(at);
        if arrived {
            pending.push(Event::Arrived { what: name.clone() });
        }
        !arrived
    });
    let now_s = actors.seconds;
    hand.performs.retain(|(name, end_s)| {
        let ended = now_s >= *end_s;
        if ended {
            pending.push(Event::Ended { what: name.clone() });
        }
        !ended
    });
    if let Some((clock_s, arrived)) = hand.hour.as_mut().map(|glide| glide.pass(seconds)) {
        lapse.scrub(clock_s);
        hand.hour = hand.hour.filter(|_| !arrived);
    }
    if let Some((stops, arrived)) = hand.exposure.as_mut().map(|glide| glide.pass(seconds)) {
        exposure.manual_stops = stops as f32;
        hand.exposure = hand.exposure.filter(|_| !arrived);
    }
    if let Some(lamps) = &mut lamps {
        hand.lamps.retain(|number, (glide, whole)| {
            let (brightness, arrived) = glide.pass(seconds);
            if let Some(lamp) = lamps.lamps.get_mut(*number) {
                lamp.intensity = *whole * brightness as f32;
            }
            !arrived
        });
    }
    if let Some((from, to, passed_s, in_s)) = &mut hand.view {
        *passed_s += seconds;
        let along = if *in_s > 0.0 { (*passed_s / *in_s).min(1.0) } else { 1.0 };
        eye = Some(between(from, to, Easing::Smooth.at(along)));
        if along >= 1.0 {
            hand.view = None;
        }
        if let (Some(mut visitor), Some(eye)) = (visitor, eye) {
            visitor.pose = eye;
        }
    }
}

/// Seconds of the day that pass in one.
fn pace(lapse: &mut TimeLapse, factor: f32) {
    let (first, last) = lapse.span_s();
    let length = (last - first) as f32;
    lapse.playing = factor != 0.0 && length > 0.0;
    if lapse.playing {
        lapse.speed = factor * lapse.day_seconds / length;
    }
}

/// An eye on its way, round the shorter side.
fn between(from: &Pose, to: &Pose, along: f32) -> Pose {
    use std::f32::consts::{PI, TAU};
    let turn = (to.yaw_rad - from.yaw_rad + PI).rem_euclid(TAU) - PI;
    Pose {
        eye: from.eye.lerp(to.eye, along),
        yaw_rad: from.yaw_rad + turn * along,
        pitch_rad: from.pitch_rad + (to.pitch_rad - from.pitch_rad) * along,
    }
}

/// Tells somebody what to do.
fn direct(play: &mut super::Play, actors: &mut Actors, impostors: &Impostors, action: &Action) {
    let stands =
        |name: &str| actors.whereabouts(name).or_else(|| impostors.whereabouts(name, actors)).map(|(stands, _)| stands);
    match action {
        Action::Show { what } | Action::Hide { what } => {
            let hidden = matches!(action, Action::Hide { .. });
            actors.directions.entry(what.clone()).or_default().hidden = hidden;
            play.world.set_shown(what, !hidden);
        }
        Action::Move { what, to, seconds, easing } => {
            let Some(from) = stands(what) else { return };
            let (to, in_s, easing) = (Vec3::from(*to), *seconds, *easing);
            play.hand.moves.insert(what.clone(), Movement::Carried { from, to, turn_rad: 0.0, passed_s: 0.0, in_s, easing });
        }
        Action::Turn { what, degrees, seconds, easing } => {
            let Some(from) = stands(what) else { return };
            let (to, turn_rad, in_s, easing) = (from.translation.into(), degrees.to_radians(), *seconds, *easing);
            play.hand.moves.insert(what.clone(), Movement::Carried { from, to, turn_rad, passed_s: 0.0, in_s, easing });
        }
        Action::Walk { actor, to } => {
            let from = stands(actor);
            walk(play, actor, from.map(|from| vec![from.translation.into(), Vec3::from(*to)]));
        }
        Action::Follow { actor, path } => {
            let way = play.living.paths.iter().find(|way| way.name == *path);
            let points = way.map(|way| way.points.iter().map(|point| Vec3::from(point.map(|v| v as f32))).collect());
            walk(play, actor, points);
        }
        Action::Animate { what, animation, repeat } => {
            let length_s = actors.clip_s(what, animation).or_else(|| impostors.clip_s(what, animation));
            let Some(length_s) = length_s else {
                warn_once!("{what} has no animation {animation}");
                return;
            };
            let since_s = actors.seconds;
            let performed = Performed { clip: animation.clone(), since_s, repeat: *repeat };
            actors.directions.entry(what.clone()).or_default().clip = Some(performed);
            play.hand.performs.retain(|(name, _)| name != what);
            if !repeat {
                play.hand.performs.push((what.clone(), since_s + f64::from(length_s)));
            }
        }
        Action::StopAnimation { what } => {
            actors.directions.entry(what.clone()).or_default().clip = None;
            play.hand.performs.retain(|(name, _)| name != what);
        }
        other => warn_once!("this viewer does not do this yet: {other:?}"),
    }
}

/// Lets an actor walk through points at its own pace.
fn walk(play: &mut super::Play, actor: &str, points: Option<Vec<Vec3>>) {
    let Some(points) = points else { return };
    let known = play.bundle.actors().iter().find(|known| known.display_name() == actor);
    let speed = known.map_or(DEFAULT_WALK_SPEED, |actor| actor.walk_speed) as f32;
    let length: f32 = points.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    let course = Course::walks(points, speed, Walk::Once, 0.0);
    play.hand.moves.insert(actor.to_owned(), Movement::Walks { course, passed_s: 0.0, in_s: length / speed });
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::{FRAC_PI_2, PI};

    #[test]
    fn what_is_carried_arrives_where_it_was_asked_to() {
        let from = Affine3A::from_rotation_translation(Quat::from_rotation_y(0.3), Vec3::X);
        let to = Vec3::new(3.0, 1.0, 0.0);
        let mut movement = Movement::Carried { from, to, turn_rad: FRAC_PI_2, passed_s: 0.0, in_s: 2.0, easing: Easing::Even };
        let (half, arrived) = movement.pass(1.0);
        assert!(!arrived && Vec3::from(half.translation).abs_diff_eq(Vec3::new(2.0, 0.5, 0.0), 1e-5));
        let (end, arrived) = movement.pass(5.0);
        assert!(arrived && Vec3::from(end.translation).abs_diff_eq(to, 1e-5));
        // to the left as seen from above: what looked along +Z looks along +X
        let wanted = Quat::from_rotation_y(0.3 + FRAC_PI_2) * Vec3::Z;
        assert!(end.transform_vector3(Vec3::Z).abs_diff_eq(wanted, 1e-5));
    }

    #[test]
    fn an_eye_turns_round_the_shorter_side() {
        let pose = |yaw_rad| Pose { eye: Vec3::ZERO, yaw_rad, pitch_rad: 0.0 };
        let half = between(&pose(0.9 * PI), &pose(-0.9 * PI), 0.5);
        assert!((half.yaw_rad - PI).abs() < 1e-5, "{}", half.yaw_rad);
    }

    #[test]
    fn the_day_passes_as_fast_as_it_is_told() {
        let mut lapse = TimeLapse::default();
        pace(&mut lapse, 60.0);
        assert!(!lapse.playing, "there is no day");
    }
}
