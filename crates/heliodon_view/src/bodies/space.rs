//! The space that bodies fall in: a world of its own, in which avian's schedule runs in fixed steps.
//!
//! A world apart, not avian's plugins in the app's: its entities come in an order that no renderer changes, so that the same inputs give the same bits;
//! another bundle begins in a new one; and where nothing falls and nobody walks there is none, and it costs nothing. Bodies asleep cost nothing either: a step
//! is made only while one is awake.

use avian3d::collider_tree::{ColliderTreeOptimization, update_moved_collider_aabbs};
use avian3d::dynamics::solver::SolverConfig;
use avian3d::dynamics::solver::islands::{BodyIslandNode, SleepBody, WakeBody};
use avian3d::physics_transform::PhysicsTransformConfig;
use avian3d::prelude::*;
use bevy::ecs::message::Messages;
use bevy::ecs::schedule::{ScheduleLabel, SingleThreadedExecutor};
use bevy::ecs::system::{Command, SystemState};
use bevy::prelude::*;
use bevy::tasks::{AsyncComputeTaskPool, ComputeTaskPool, TaskPool};
use glam::Affine3A;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// Steps a second: a hand's throw of 6 m/s goes a hand's breadth in each.
const STEPS_PER_S: f32 = 60.0;
/// What a step takes.
pub const STEP_S: f32 = 1.0 / STEPS_PER_S;
/// Substeps of a step, for the solver: with avian's own six a heap of 200 trembles for ever, with these it sleeps after 4 s (measured), at an eighth more a step.
const SUBSTEPS: u32 = 12;
/// Standard gravity.
const GRAVITY_M_S2: f32 = 9.81;
/// Air-dry oak and beech; tools and vessels of wood, clay and thin metal, hollow as they are, weigh about as much as such a hull.
const DENSITY_KG_M3: f32 = 700.0;
/// Wood on stone: 0.5 to 0.6 in tables of engineering.
const FRICTION: f32 = 0.55;
/// Wood and stone hardly rebound: a wooden ball dropped on a stone floor comes back to a tenth of its height.
const RESTITUTION: f32 = 0.25;
/// Faster is no throw: a fall from 20 m, or a spoilt velocity.
pub const FASTEST_M_S: f32 = 20.0;
/// Five turns a second.
const FASTEST_RAD_S: f32 = 30.0;
/// What begins in another comes out of it at this speed: seen as a push, not as a shot.
const PARTING_M_S: f32 = 1.0;
/// What takes the spin out of round things within some seconds, a second, as rolling on a rough floor does.
const SPIN_LOSS_PER_S: f32 = 0.6;
/// Slower creeps, metres and radians a second: what is left of it in a heap is the solver's doing, and would keep the heap awake for ever.
const CREEPS: (f32, f32) = (0.1, 0.25);
/// What is left of a creeping body's speed after a step: a thing that tips over still does, for gravity adds more.
const CREEP_LEFT: f32 = 0.9;
/// What has been slow for so long sleeps, seconds: avian's own half second, and as long again.
const SLOW_S: f32 = 1.0;
/// Slower is no sound, m/s: gravity alone gives a body at rest 0.16 in a step.
const LEAST_IMPACT_M_S: f32 = 0.5;
/// Things whose boxes are nearer than this rest on one another, metres.
const NEIGHBOUR_M: f32 = 0.03;

/// Layers of colliders.
pub mod layer {
    /// The stage's stone.
    pub const STONE: u32 = 1;
    /// Things.
    pub const THING: u32 = 2;
    /// Whoever else stands about.
    pub const ACTOR: u32 = 4;
    /// All of them.
    pub const ALL: u32 = STONE | THING | ACTOR;
}

/// Whose collider it is.
#[derive(Component, Clone, Debug)]
struct Whose(Arc<str>);

/// The schedule that one step is.
#[derive(ScheduleLabel, Clone, Debug, PartialEq, Eq, Hash)]
struct Step;

/// A body met something.
#[derive(Clone, Debug, PartialEq)]
pub struct Impact {
    /// Whose body.
    pub name: String,
    /// The other thing or actor; none is the stage's stone.
    pub with: Option<String>,
    /// How fast they came together, along the normal.
    pub speed_m_s: f32,
    /// Where, in the world.
    pub place: Vec3,
}

/// Where a body is and how it moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// The model's origin in the world.
    pub place: Vec3,
    /// How it is turned.
    pub turn: Quat,
    /// Metres a second.
    pub velocity: Vec3,
    /// Radians a second, about the axis that it points along.
    pub spin: Vec3,
}

impl Motion {
    /// At rest.
    #[must_use]
    pub fn rest(place: Vec3, turn: Quat) -> Self {
        Self { place, turn, ..Self::default() }
    }

    /// Whether all of it is numbers.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.place.is_finite() && self.turn.is_finite() && self.velocity.is_finite() && self.spin.is_finite()
    }

    /// From the model's space to the world, at a scale.
    #[must_use]
    pub fn world_from_model(&self, scale: Vec3) -> Affine3A {
        Affine3A::from_scale_rotation_translation(scale, self.turn, self.place)
    }
}

/// What a capsule that goes about meets.
type Sweep = SystemState<MoveAndSlide<'static, 'static>>;

/// The space.
pub struct Space {
    world: World,
    sweep: Sweep,
    awake: QueryState<Entity, Awake>,
    speeds: QueryState<(&'static mut LinearVelocity, &'static mut AngularVelocity), Awake>,
    tired: QueryState<(Entity, &'static SleepTimer, &'static BodyIslandNode), Awake>,
}

/// Things that are awake.
type Awake = (With<Falls>, Without<Sleeping>);

/// On things: what may fall.
#[derive(Component)]
struct Falls;

impl Default for Space {
    fn default() -> Self {
        // Where there is an app they are there already.
        ComputeTaskPool::get_or_init(TaskPool::default);
        AsyncComputeTaskPool::get_or_init(TaskPool::default);
        let mut app = App::new();
        app.init_resource::<Time>()
            // What is drawn between steps is this module's business.
            .add_plugins(PhysicsPlugins::new(Step).build().disable::<PhysicsInterpolationPlugin>())
            .insert_resource(SubstepCount(SUBSTEPS))
            .insert_resource(Gravity(Vec3::NEG_Y * GRAVITY_M_S2))
            .insert_resource(SolverConfig { max_overlap_solve_speed: PARTING_M_S, ..default() })
            .insert_resource(ColliderTreeOptimization { use_async_tasks: false, optimize_in_place: true, ..default() })
            .edit_schedule(Step, |schedule| {
                schedule.set_executor(SingleThreadedExecutor::new());
            });
        app.finish();
        app.cleanup();
        let mut world = std::mem::take(app.world_mut());
        // Nobody draws this world's transforms.
        world.insert_resource(PhysicsTransformConfig {
            propagate_before_physics: false,
            transform_to_position: false,
            position_to_transform: false,
            transform_to_collider_scale: false,
        });
        let (sweep, awake) = (SystemState::new(&mut world), QueryState::new(&mut world));
        let (speeds, tired) = (QueryState::new(&mut world), QueryState::new(&mut world));
        Self { world, sweep, awake, speeds, tired }
    }
}

impl Space {
    /// Adds a part of the stone, in the world's space.
    pub fn add_stone(&mut self, collider: Collider) -> Entity {
        let layers = CollisionLayers::from_bits(layer::STONE, layer::ALL);
        self.add(Motion::default(), (RigidBody::Static, collider, layers, surface()))
    }

    /// Adds a thing: awake with a motion, or asleep until something touches it.
    pub fn add_thing(&mut self, name: &str, collider: &Collider, motion: Motion, asleep: bool) -> Entity {
        let layers = CollisionLayers::from_bits(layer::THING, layer::ALL);
        let moves = (
            LinearVelocity(motion.velocity.clamp_length_max(FASTEST_M_S)),
            AngularVelocity(motion.spin.clamp_length_max(FASTEST_RAD_S)),
            MaxLinearSpeed(FASTEST_M_S),
            MaxAngularSpeed(FASTEST_RAD_S),
            AngularDamping(SPIN_LOSS_PER_S),
            SleepThreshold { angular: CREEPS.1, ..SleepThreshold::default() },
        );
        let what = (RigidBody::Dynamic, collider.clone(), ColliderDensity(DENSITY_KG_M3), layers, surface());
        let body = self.add(motion, (what, moves, Falls, Whose(name.into())));
        if asleep {
            // It cannot fail on a body; and were it awake it would only fall a hair onto what it lies on.
            SleepBody(body).apply(&mut self.world).ok();
        }
        body
    }

    /// Lets a thing turn about the vertical alone: what is shown by pictures has none of it lying.
    pub fn keep_upright(&mut self, body: Entity) {
        if let Ok(mut body) = self.world.get_entity_mut(body) {
            body.insert(LockedAxes::new().lock_rotation_x().lock_rotation_z());
        }
    }

    /// Adds somebody who stands in the way and is moved by nobody here.
    pub fn add_actor(&mut self, name: &str, collider: Collider, place: Vec3) -> Entity {
        let layers = CollisionLayers::from_bits(layer::ACTOR, layer::THING);
        let motion = Motion::rest(place, Quat::IDENTITY);
        self.add(motion, (RigidBody::Kinematic, collider, layers, surface(), Whose(name.into())))
    }

    fn add(&mut self, motion: Motion, bundle: impl Bundle) -> Entity {
        let entity = self.world.spawn((Position(motion.place), Rotation(motion.turn), bundle)).id();
        self.world.flush();
        entity
    }

    /// Moves somebody who was added by [`Space::add_actor`]; answers whether they were elsewhere.
    pub fn move_actor(&mut self, actor: Entity, place: Vec3) -> bool {
        let position = self.world.get_mut::<Position>(actor);
        position.is_some_and(|mut position| position.set_if_neq(Position(place)))
    }

    /// Lets sweeps find actors where they were moved to, without a step.
    pub fn find_moved(&mut self) {
        if self.world.run_system_cached(update_moved_collider_aabbs::<Collider>).is_err() {
            warn_once!("visitors meet people where they were");
        }
    }

    /// Takes something away; what lay on it wakes.
    pub fn remove(&mut self, entity: Entity) {
        let around = self.world.get::<ColliderAabb>(entity).copied();
        let is_thing = self.world.get::<Falls>(entity).is_some();
        self.world.despawn(entity);
        if let Some(around) = around.filter(|_| is_thing) {
            self.wake_near(around);
        }
        self.world.flush();
    }

    fn wake_near(&mut self, around: ColliderAabb) {
        let (low, high) = (around.min - NEIGHBOUR_M, around.max + NEIGHBOUR_M);
        let mut sleeping = self.world.query_filtered::<(Entity, &ColliderAabb), (With<Falls>, With<Sleeping>)>();
        let near = |(_, aabb): &(Entity, &ColliderAabb)| aabb.min.cmple(high).all() && aabb.max.cmpge(low).all();
        let near: Vec<Entity> = sleeping.iter(&self.world).filter(near).map(|(entity, _)| entity).collect();
        near.into_iter().for_each(|body| drop(WakeBody(body).apply(&mut self.world)));
    }

    /// Whether a body is awake.
    #[must_use]
    pub fn is_awake(&self, body: Entity) -> bool {
        self.world.get_entity(body).is_ok_and(|body| !body.contains::<Sleeping>())
    }

    /// How many things are awake.
    #[must_use]
    pub fn awake(&mut self) -> usize {
        self.awake.iter(&self.world).count()
    }

    /// Where a body is and how it moves.
    #[must_use]
    pub fn motion(&self, body: Entity) -> Option<Motion> {
        let body = self.world.get_entity(body).ok()?;
        let (velocity, spin) = (body.get::<LinearVelocity>(), body.get::<AngularVelocity>());
        Some(Motion {
            place: body.get::<Position>()?.0,
            turn: body.get::<Rotation>()?.0,
            velocity: velocity.map_or(Vec3::ZERO, |v| v.0),
            spin: spin.map_or(Vec3::ZERO, |v| v.0),
        })
    }

    /// The box around something.
    #[must_use]
    pub fn bounds(&self, entity: Entity) -> Option<(Vec3, Vec3)> {
        self.world.get::<ColliderAabb>(entity).map(|aabb| (aabb.min, aabb.max))
    }

    /// One step of [`STEP_S`]; what met is added to `impacts`, the hardest of each pair.
    pub fn step(&mut self, impacts: &mut Vec<Impact>) {
        self.world.resource_mut::<Time>().advance_by(Duration::from_secs_f32(STEP_S));
        self.world.run_schedule(Step);
        self.world.resource_mut::<Messages<CollisionStart>>().update();
        self.world.resource_mut::<Messages<CollisionEnd>>().update();
        self.world.clear_trackers();
        self.world.check_change_ticks();
        self.brake();
        self.lull();
        self.note_impacts(impacts);
    }

    /// Lets those sleep who touch one another and have all been slow for long. avian itself waits until no contact among them is lost, and in a heap one
    /// always is.
    fn lull(&mut self) {
        let mut least_s: BTreeMap<u32, f32> = BTreeMap::new();
        for (_, timer, island) in self.tired.iter(&self.world) {
            let least_s = least_s.entry(island.island_id().0).or_insert(f32::INFINITY);
            *least_s = least_s.min(timer.0);
        }
        if least_s.values().all(|&slow_s| slow_s < SLOW_S) {
            return;
        }
        let tired = self.tired.iter(&self.world).filter(|(_, _, island)| least_s[&island.island_id().0] >= SLOW_S);
        let tired: Vec<Entity> = tired.map(|(body, ..)| body).collect();
        tired.into_iter().for_each(|body| drop(SleepBody(body).apply(&mut self.world)));
    }

    fn brake(&mut self) {
        for (mut velocity, mut spin) in self.speeds.iter_mut(&mut self.world) {
            if velocity.length() < CREEPS.0 && spin.length() < CREEPS.1 {
                velocity.0 *= CREEP_LEFT;
                spin.0 *= CREEP_LEFT;
            }
        }
    }

    fn note_impacts(&self, impacts: &mut Vec<Impact>) {
        let name_of = |body: Option<Entity>| body.and_then(|body| self.world.get::<Whose>(body)).map(|whose| &*whose.0);
        let is_thing = |body: Option<Entity>| body.is_some_and(|body| self.world.get::<Falls>(body).is_some());
        for pair in self.world.resource::<ContactGraph>().iter_active_touching() {
            let points = pair.manifolds.iter().flat_map(|manifold| &manifold.points);
            // Without an impulse it is a meeting foreseen that has not come.
            let met = points.filter(|point| point.normal_impulse > 0.0);
            let Some(hardest) = met.min_by(|a, b| a.normal_speed.total_cmp(&b.normal_speed)) else { continue };
            let speed_m_s = -hardest.normal_speed;
            if speed_m_s < LEAST_IMPACT_M_S {
                continue;
            }
            let (mut one, mut other) = (pair.body1, pair.body2);
            if !is_thing(one) {
                std::mem::swap(&mut one, &mut other);
            }
            let Some(name) = name_of(one).filter(|_| is_thing(one)) else { continue };
            let with = name_of(other);
            match impacts.iter_mut().find(|known| known.name == name && known.with.as_deref() == with) {
                Some(known) if known.speed_m_s >= speed_m_s => {}
                Some(known) => (known.speed_m_s, known.place) = (speed_m_s, hardest.point),
                None => {
                    let (name, with) = (name.to_owned(), with.map(str::to_owned));
                    impacts.push(Impact { name, with, speed_m_s, place: hardest.point });
                }
            }
        }
    }

    /// Asks what a shape meets.
    pub fn ask<T>(&mut self, question: impl FnOnce(&MoveAndSlide) -> T) -> Option<T> {
        let Self { world, sweep, .. } = self;
        sweep.get(world).ok().map(|sweep| question(&sweep))
    }

    /// Where the upper side of a thing at rest is straight below a place, within a reach.
    #[must_use]
    pub fn resting_below(&mut self, from: Vec3, reach_m: f32) -> Option<f32> {
        let Self { world, sweep, .. } = self;
        let asleep = |entity: Entity| world.get::<Sleeping>(entity).is_some();
        let filter = SpatialQueryFilter::from_mask(layer::THING);
        let sweep = sweep.get(world).ok()?;
        let hit = sweep.spatial_query.cast_ray_predicate(from, Dir3::NEG_Y, reach_m, true, &filter, &asleep);
        // A place within a thing is below nothing.
        hit.filter(|hit| hit.distance > 0.0).map(|hit| from.y - hit.distance)
    }
}

/// What all surfaces are like.
fn surface() -> impl Bundle {
    (Friction::new(FRICTION), Restitution::new(RESTITUTION))
}
