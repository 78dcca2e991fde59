//! What falls and what holds: things that a hand lets go of fall, meet the stone and one another and come to rest; visitors on foot are held by all of it.
//!
//! [`space`] is the world in which avian's schedule runs in fixed steps; [`hull`] what a thing is there, [`stone`] what the stage is there, `crowd` who else
//! stands about. `walk` moves visitors on foot. Until a hand or a body touches it, a thing stays where the site and its scripts put it, asleep.
//!
//! Why avian and not a few rays: the rays that feet and shoulders are content with know nothing of what lies on what. Why a step waits for stone that is
//! still built, and not a floor at the thing's feet: the same inputs then give the same bits, however fast the machine is.

mod crowd;
pub mod hull;
mod place;
pub mod space;
pub mod stone;
#[cfg(test)]
mod tests;
mod walk;

use crate::actors::Actors;
use crate::costs::FrameTold;
use crate::hands::{BOTH, Hands, HandsSet};
use crate::impostor::Impostors;
use crate::navigation::Visitor;
use crate::navigation::walk::Fall;
use crate::stage::Stage;
use crate::stage::background::Background;
use crate::stage::ground::Ground;
use crate::story::Story;
use avian3d::prelude::Collider;
use bevy::prelude::*;
use bevy::time::TimeUpdateStrategy;
use crowd::Crowd;
use glam::Affine3A;
use heliodon_script::event::Event;
use hull::Hull;
pub use space::Impact;
use space::{FASTEST_M_S, Motion, STEP_S, Space};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;
use stone::{Bounds, Stone};

/// What a frame counts for at most, seconds: after a longer one bodies fall behind the clock, not through the floor.
const LONGEST_FRAME_S: f32 = 0.1;
/// What goes on hitting the same thing is one hit until it has been quiet for so long, seconds.
const RATTLES_S: f32 = 0.12;
/// Stone this near a body must be there before it moves, metres; and what it flies in [`AHEAD_S`].
const NEAR_M: f32 = 0.3;
/// Seconds of flight for which stone must be there.
const AHEAD_S: f32 = 2.0 * LONGEST_FRAME_S;
/// Stone this near a visitor is built, metres: a second's walk.
const AROUND_VISITOR_M: f32 = 2.0;
/// What falls so far below the stage and its own place comes back, metres.
const LOST_M: f32 = 10.0;

/// The bodies of the things on the stage.
#[derive(Resource, Default)]
pub struct Bodies {
    stage: u64,
    learning: Learning,
    things: BTreeMap<String, Thing>,
    /// Whose hulls were made, or tried to.
    hulled: BTreeSet<String>,
    asked: BTreeMap<String, Asked>,
    space: Option<Space>,
    stone: Option<Stone>,
    crowd: Crowd,
    /// Where visitors walk.
    walkers: Vec<Bounds>,
    /// Seconds that no step has taken yet.
    behind_s: f32,
    impacts: Vec<Impact>,
    told: Told,
}

/// How far the bundle's things are known.
#[derive(Default)]
enum Learning {
    #[default]
    Nothing,
    Hulls(Background<Vec<Learned>>),
    Done,
}

/// A thing's name, where it belongs, its hull, where it has one, and whether it is shown by pictures.
type Learned = (String, Affine3A, Option<Hull>, bool);

/// Who is on the stage.
#[derive(Clone, Copy)]
struct Scene<'a> {
    actors: &'a Actors,
    impostors: &'a Impostors,
}

impl Scene<'_> {
    fn is_complete(self) -> bool {
        self.actors.is_complete() && self.impostors.is_complete()
    }

    /// Where somebody is whom nobody directs, what their hull goes around, and whether they are shown by pictures.
    fn learn(self, name: &str) -> Option<(Affine3A, Vec<Vec3>, bool)> {
        let model = || Some((self.actors.undirected(name)?, self.actors.at_rest(name)?, false));
        let pictures = || Some((self.impostors.undirected(name, self.actors)?, self.impostors.corners(name)?, true));
        model().or_else(pictures)
    }
}

/// What is asked of a thing until the next step.
#[derive(Clone, Copy, Debug)]
enum Asked {
    /// By whoever has no hands; what is in one is known from them.
    Hold,
    Release(Affine3A, Vec3, Vec3),
}

/// What the last frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Told {
    /// Things that are known.
    pub things: usize,
    /// Things that move.
    pub awake: usize,
    /// Triangles of stone that are built.
    pub triangles: usize,
    /// Steps.
    pub steps: usize,
    /// Milliseconds that all of it took.
    pub ms: f32,
}

/// A thing.
struct Thing {
    /// Its number among the actors, where it is one.
    number: Option<usize>,
    hull: Hull,
    /// Whether it stays upright, as pictures do.
    upright: bool,
    collider_scale: Vec3,
    collider: Collider,
    reach_m: f32,
    /// Where it belongs, and comes back to.
    home: Affine3A,
    /// Where it is: what bodies wrote last into the actors' directions, or found where the actor is.
    at: Affine3A,
    /// None where nobody needs its body, or while somebody holds or moves it.
    body: Option<Entity>,
    held: bool,
    /// Whether it moved in the last frame, and its last two steps.
    moved: bool,
    before: Motion,
    now: Motion,
}

impl Thing {
    fn new(hull: Hull, home: Affine3A) -> Self {
        let (scale, ..) = home.to_scale_rotation_translation();
        Self {
            number: None,
            upright: false,
            collider_scale: scale,
            collider: hull.collider(scale),
            reach_m: hull.reach_m(scale),
            hull,
            home,
            at: home,
            body: None,
            held: false,
            moved: false,
            before: Motion::default(),
            now: Motion::default(),
        }
    }

    fn scale_to(&mut self, scale: Vec3) {
        if !scale.abs_diff_eq(self.collider_scale, 1e-4) {
            (self.collider_scale, self.collider) = (scale, self.hull.collider(scale));
            self.reach_m = self.hull.reach_m(scale);
        }
    }

    /// Where the actor is whom nobody directs.
    fn undirected(&self, name: &str, scene: Scene<'_>) -> Option<Affine3A> {
        match self.number {
            Some(number) => scene.actors.on_course(number),
            None if self.upright => scene.impostors.undirected(name, scene.actors),
            None => scene.actors.undirected(name),
        }
    }

    /// A motion as its body can have it.
    fn held_upright(&self, motion: Motion) -> Motion {
        if !self.upright {
            return motion;
        }
        let forward = motion.turn * Vec3::Z;
        let turn = Quat::from_rotation_y(libm::atan2f(forward.x, forward.z));
        Motion { turn, spin: Vec3::Y * motion.spin.y, ..motion }
    }

    fn add_body(&mut self, name: &str, motion: Motion, asleep: bool, space: &mut Space) {
        let body = space.add_thing(name, &self.collider, motion, asleep);
        if self.upright {
            space.keep_upright(body);
        }
        self.body = Some(body);
        (self.before, self.now) = (motion, motion);
    }

    fn lose_body(&mut self, space: &mut Space) {
        self.moved = false;
        self.body.take().into_iter().for_each(|body| space.remove(body));
    }

    /// The stone that has to be there before it moves.
    fn needs(&self, at: &Motion) -> Bounds {
        let far = self.reach_m + NEAR_M + at.velocity.length().min(FASTEST_M_S) * AHEAD_S;
        (at.place - far, at.place + far)
    }
}

impl Bodies {
    /// Makes something a thing beside the bundle's own, until another bundle is opened: an actor that the app added, with the vertices that its hull goes
    /// around, in the model's space. Nothing comes of it where none is finite.
    pub fn add(&mut self, name: &str, positions: &[Vec3], world_from_model: Affine3A) {
        if let Some(hull) = Hull::around(positions).filter(|_| parts(world_from_model).is_some()) {
            self.things.insert(name.to_owned(), Thing::new(hull, world_from_model));
        }
    }

    /// Lets go of a thing: it falls from there, at so many metres and, about the axis that `spin` points along, radians a second.
    pub fn release(&mut self, name: &str, world_from_model: Affine3A, velocity: Vec3, spin: Vec3) {
        self.asked.insert(name.to_owned(), Asked::Release(world_from_model, velocity, spin));
    }

    /// Takes a thing in hand: no body moves it until it is released.
    pub fn hold(&mut self, name: &str) {
        self.asked.insert(name.to_owned(), Asked::Hold);
    }

    /// Whether a thing is on its way to where it comes to rest.
    #[must_use]
    pub fn is_falling(&self, name: &str) -> bool {
        match self.asked.get(name) {
            Some(Asked::Hold) => false,
            Some(Asked::Release(..)) => true,
            None => {
                let body = self.things.get(name).and_then(|thing| thing.body);
                body.zip(self.space.as_ref()).is_some_and(|(body, space)| space.is_awake(body))
            }
        }
    }

    /// What met in the last frame, faster than half a metre a second; one of each pair.
    #[must_use]
    pub fn impacts(&self) -> &[Impact] {
        &self.impacts
    }

    /// What the last frame took.
    #[must_use]
    pub fn told(&self) -> Told {
        self.told
    }

    /// Where an eye on foot gets among bodies; none until the stone around it is built. As [`crate::navigation::walk::walk`].
    pub(crate) fn walk(
        &mut self,
        (stage, ground): (&Stage, &Ground),
        eye: Vec3,
        wish: Vec3,
        seconds: f32,
        fall: &mut Fall,
    ) -> Option<Vec3> {
        let (low, high) = walk::around(eye, wish);
        if !(low.is_finite() && high.is_finite()) {
            return None;
        }
        self.walkers.push((low - AROUND_VISITOR_M, high + AROUND_VISITOR_M));
        let (space, stone) = (self.space.as_mut()?, self.stone.as_ref()?);
        let built = self.stage == stage.serial() && stone.is_built(&[(low, high)]);
        built.then(|| walk::walk(space, ground, eye, wish, seconds, fall))
    }

    /// Learns what things there are, once they are there.
    fn learn(&mut self, stage: &Stage, scene: Scene<'_>, patient: bool) {
        match &self.learning {
            Learning::Nothing if scene.is_complete() => {
                let bundle = stage.bundle().into_iter().flat_map(|bundle| bundle.actors());
                let carried = bundle.filter(|actor| actor.thing.as_ref().is_some_and(|thing| thing.carried));
                let names: BTreeSet<&str> = carried.map(|actor| actor.display_name()).collect();
                self.learn_hulls(scene, names.into_iter());
            }
            Learning::Hulls(hulls) => {
                let hulls = if patient { Some(hulls.wait()) } else { hulls.take() };
                let Some(hulls) = hulls else { return };
                let hulls = hulls.unwrap_or_else(|_| {
                    warn_once!("things stay where they are: their hulls could not be made");
                    Vec::new()
                });
                for (name, home, hull, upright) in hulls {
                    if let Some(hull) = hull.filter(|_| parts(home).is_some()) {
                        let number = scene.actors.number(&name);
                        self.things.insert(name, Thing { number, upright, ..Thing::new(hull, home) });
                    }
                }
                self.learning = Learning::Done;
            }
            // A script puts into hands what the site does not mean for them.
            Learning::Done => {
                let unknown = self.asked.keys().filter(|name| !self.things.contains_key(*name));
                let names: Vec<String> = unknown.filter(|name| scene.learn(name).is_some()).cloned().collect();
                self.learn_hulls(scene, names.iter().map(String::as_str));
            }
            Learning::Nothing => {}
        }
    }

    /// Learns the hulls of some actors; who has none is asked for no more.
    fn learn_hulls<'a>(&mut self, scene: Scene<'_>, names: impl Iterator<Item = &'a str>) {
        let known: Vec<_> = names
            .filter(|name| self.hulled.insert((*name).to_owned()))
            .filter_map(|name| scene.learn(name).map(|learned| (name.to_owned(), learned)))
            .collect();
        let hull = |(name, (home, positions, upright)): (String, (Affine3A, Vec<Vec3>, bool))| {
            (name, home, Hull::around(&positions), upright)
        };
        self.learning = match known.is_empty() {
            true => Learning::Done,
            false => Learning::Hulls(Background::start(move || known.into_iter().map(hull).collect())),
        };
    }

    /// Takes what hands have let go, and leaves what they have taken up.
    fn follow(&mut self, hands: &Hands) {
        for name in &hands.taken_up {
            self.asked.remove(name);
        }
        for let_go in &hands.let_go {
            self.release(&let_go.name, let_go.world_from_model, let_go.velocity_m_s, let_go.spin_rad_s);
        }
    }

    /// Follows what hands, scripts and whoever hides a thing want of it.
    fn obey(
        &mut self,
        actors: &mut Actors,
        impostors: &Impostors,
        in_hands: [Option<&str>; 2],
        eyes: &[Vec3],
        (space, stone): (&mut Space, &Stone),
    ) {
        if matches!(self.learning, Learning::Done) {
            let things = &self.things;
            self.asked.retain(|name, _| {
                let known = things.contains_key(name);
                if !known {
                    warn_once!("{name} is no thing that could fall");
                }
                known
            });
        }
        for (name, thing) in &mut self.things {
            let direction = actors.directions.get(name);
            let hidden = direction.is_some_and(|direction| direction.hidden);
            let told = direction.and_then(|direction| direction.world_from_model);
            let is_at = told
                .or_else(|| thing.undirected(name, Scene { actors, impostors }))
                .filter(|at| parts(*at).is_some())
                .unwrap_or(thing.at);
            let in_hand = in_hands.iter().flatten().any(|held| held == name);
            let moved_by_others = is_at != thing.at;
            if hidden || in_hand || moved_by_others {
                thing.lose_body(space);
            }
            thing.at = is_at;
            match self.asked.get(name).copied() {
                Some(Asked::Hold) => {
                    thing.lose_body(space);
                    thing.held = true;
                    self.asked.remove(name);
                }
                Some(Asked::Release(world_from_model, velocity, spin)) => {
                    thing.held = false;
                    let known = parts(world_from_model).map(|parts| (world_from_model, parts));
                    let (at, (scale, turn, place)) = known.unwrap_or_else(|| {
                        warn_once!("{name} was let go nowhere, and comes back to where it belongs");
                        (thing.home, thing.home.to_scale_rotation_translation())
                    });
                    let [velocity, spin] = [velocity, spin].map(|v| if v.is_finite() { v } else { Vec3::ZERO });
                    let mut motion = thing.held_upright(Motion { place, turn, velocity, spin });
                    thing.lose_body(space);
                    if hidden || !stone.is_built(&[thing.needs(&motion)]) {
                        continue;
                    }
                    thing.scale_to(scale);
                    motion.place = place::free(space, &thing.collider, motion, eyes);
                    thing.add_body(name, motion, false, space);
                    (thing.at, thing.moved) = (at, true);
                    actors.directions.entry(name.clone()).or_default().world_from_model = Some(at);
                    self.asked.remove(name);
                }
                // What is still being moved gets its body when it stands still.
                None if !(hidden || thing.held || in_hand || moved_by_others) && thing.body.is_none() => {
                    let (scale, turn, place) = thing.at.to_scale_rotation_translation();
                    thing.scale_to(scale);
                    let motion = thing.held_upright(Motion::rest(place, turn));
                    place::tell_of_overlap(space, name, &thing.collider, motion);
                    thing.add_body(name, motion, true, space);
                }
                None => {}
            }
        }
    }

    /// The stone that has to be there before anything moves.
    fn needs(&self, space: &Space) -> Vec<Bounds> {
        let awake = |thing: &&Thing| thing.body.is_some_and(|body| space.is_awake(body));
        self.things.values().filter(awake).map(|thing| thing.needs(&thing.now)).collect()
    }

    /// As many steps as fit into what has passed.
    fn step(&mut self, seconds: f32, space: &mut Space) {
        self.behind_s += seconds;
        while self.behind_s >= STEP_S {
            self.behind_s -= STEP_S;
            self.told.steps += 1;
            space.step(&mut self.impacts);
            for thing in self.things.values_mut() {
                let awake = |body: &Entity| space.is_awake(*body);
                if let Some(body) = thing.body.filter(|body| thing.moved || awake(body)) {
                    (thing.before, thing.now) = (thing.now, space.motion(body).unwrap_or(thing.now));
                    thing.moved = true;
                    if !thing.now.is_finite() {
                        // the next step must not see it
                        thing.lose_body(space);
                    }
                }
            }
        }
    }

    /// Shows what has moved where it is between its last two steps.
    fn show(&mut self, actors: &mut Actors, impostors: &Impostors, lowest_m: Option<f32>, space: &mut Space) {
        let along = self.behind_s / STEP_S;
        for (name, thing) in &mut self.things {
            let lowest_m = lowest_m.unwrap_or(f32::INFINITY).min(thing.home.translation.y) - LOST_M;
            if !thing.now.is_finite() || (thing.moved && thing.now.place.y < lowest_m) {
                warn_once!("{name} fell out of the stage, and is back where it belongs");
                thing.lose_body(space);
                (thing.now, thing.before) = (Motion::default(), Motion::default());
                let course = thing.undirected(name, Scene { actors, impostors });
                thing.at = course.unwrap_or(thing.home);
                let direction = actors.directions.entry(name.clone()).or_default();
                direction.world_from_model = course.is_none().then_some(thing.home);
            } else if let Some(body) = thing.body.filter(|_| thing.moved) {
                thing.moved = space.is_awake(body);
                let along = if thing.moved { along } else { 1.0 };
                let place = thing.before.place.lerp(thing.now.place, along);
                let turn = thing.before.turn.lerp(thing.now.turn, along);
                thing.at = Affine3A::from_scale_rotation_translation(thing.collider_scale, turn, place);
                actors.directions.entry(name.clone()).or_default().world_from_model = Some(thing.at);
            }
        }
    }
}

/// Scale, turn and place; none where any of it is no number or the scale is nothing.
fn parts(world_from_model: Affine3A) -> Option<(Vec3, Quat, Vec3)> {
    let (scale, turn, place) = world_from_model.to_scale_rotation_translation();
    let is_sound = scale.is_finite() && turn.is_finite() && place.is_finite() && scale.abs().min_element() > 1e-6;
    is_sound.then(|| (scale, turn.normalize(), place))
}

/// Lets things fall, and holds visitors on foot.
#[derive(Default)]
pub struct BodiesPlugin;

impl Plugin for BodiesPlugin {
    fn build(&self, app: &mut App) {
        let told = FrameTold::in_app(app);
        // After hands and scripts have had their say, and before actors are lit where they are.
        app.init_resource::<Bodies>()
            .init_resource::<Actors>()
            .init_resource::<Impostors>()
            .add_systems(Update, (told.of("bodies", fall), told.of("bodies", tell)).chain().after(HandsSet));
    }
}

/// Scripts hear what has hit what, in the next frame: of each two things both, and of what rattles once in [`RATTLES_S`].
fn tell(time: Res<Time>, bodies: Res<Bodies>, story: Option<ResMut<Story>>, mut heard: Local<BTreeMap<(String, String), f32>>) {
    heard.retain(|_, left_s| {
        *left_s -= time.delta_secs();
        *left_s > 0.0
    });
    let Some(mut story) = story.filter(|_| !bodies.impacts.is_empty()) else { return };
    for impact in &bodies.impacts {
        let Impact { name, with, speed_m_s, place } = impact;
        let on = with.as_deref().unwrap_or_default();
        let back = Some((on, name.as_str())).filter(|(on, _)| bodies.things.contains_key(*on));
        for (thing, on) in [(name.as_str(), on)].into_iter().chain(back) {
            if heard.insert((thing.to_owned(), on.to_owned()), RATTLES_S).is_none() {
                let (thing, on) = (thing.to_owned(), on.to_owned());
                story.tell(Event::Hit { thing, on, speed: *speed_m_s, place: place.to_array() });
            }
        }
    }
}

fn fall(
    time: Res<Time>,
    clock: Option<Res<TimeUpdateStrategy>>,
    stage: Res<Stage>,
    hands: Option<Res<Hands>>,
    (mut actors, impostors): (ResMut<Actors>, Res<Impostors>),
    bodies: ResMut<Bodies>,
    visitors: Query<&Visitor>,
) {
    let bodies = bodies.into_inner();
    if bodies.stage != stage.serial() {
        *bodies = Bodies { stage: stage.serial(), ..Bodies::default() };
    }
    let walkers = std::mem::take(&mut bodies.walkers);
    bodies.impacts.clear();
    bodies.told = Told { things: bodies.things.len(), ..Told::default() };
    hands.iter().for_each(|hands| bodies.follow(hands));
    let Some(ground) = stage.footing().filter(|_| !time.delta().is_zero()) else { return };
    // Where time is counted out by hand, what comes of it does not depend on how fast the machine is.
    let patient = clock.is_some_and(|clock| !matches!(*clock, TimeUpdateStrategy::Automatic));
    bodies.learn(&stage, Scene { actors: &actors, impostors: &impostors }, patient);
    if bodies.things.is_empty() && walkers.is_empty() {
        bodies.asked.retain(|_, _| !matches!(bodies.learning, Learning::Done));
        return;
    }
    let start = Instant::now();
    // Nothing that moves, and nobody whom it could hold.
    let at_rest = bodies.space.is_none() && bodies.asked.is_empty();
    if at_rest && walkers.is_empty() {
        return;
    }
    let mut space = bodies.space.take().unwrap_or_default();
    let mut stone = bodies.stone.take().unwrap_or_else(|| Stone::new(ground));
    let eyes: Vec<Vec3> = visitors.iter().map(|visitor| visitor.pose.eye).collect();
    let in_hands = hands.as_ref().map_or([None; 2], |hands| BOTH.map(|hand| hands.held(hand)));
    bodies.obey(&mut actors, &impostors, in_hands, &eyes, (&mut space, &stone));
    let needs = bodies.needs(&space);
    let released = bodies.asked.iter().filter_map(|(name, asked)| match asked {
        Asked::Release(at, velocity, _) if at.is_finite() && velocity.is_finite() => {
            let motion = Motion { velocity: *velocity, ..Motion::rest(at.translation.into(), Quat::IDENTITY) };
            bodies.things.get(name).map(|thing| thing.needs(&motion))
        }
        _ => None,
    });
    let boxes: Vec<Bounds> = needs.iter().copied().chain(released).chain(walkers.iter().copied()).collect();
    if !boxes.is_empty() {
        stone.need(&mut space, &boxes, patient);
    }
    if !needs.is_empty() || !walkers.is_empty() {
        let things = &bodies.things;
        let is_thing =
            |name: &str| things.get(name).is_some_and(|thing| thing.body.is_some()) || in_hands.contains(&Some(name));
        bodies.crowd.follow(&mut space, &actors, is_thing);
    }
    if needs.is_empty() {
        bodies.behind_s = 0.0;
    } else if stone.is_built(&needs) {
        bodies.step(time.delta_secs().min(LONGEST_FRAME_S), &mut space);
        let lowest_m = ground.bounds().map(|(low, _)| low.y);
        bodies.show(&mut actors, &impostors, lowest_m, &mut space);
    }
    let told = Told { awake: needs.len(), triangles: stone.built().1, ms: start.elapsed().as_secs_f32() * 1e3, ..bodies.told };
    bodies.told = told;
    (bodies.space, bodies.stone) = (Some(space), Some(stone));
}
