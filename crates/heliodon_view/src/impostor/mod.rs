//! Image-based people: whole crowds in a few draws, lit by the hour.
//!
//! `heliodon_bundle::impostor` says what an impostor is and where the paper says so. Each person is a quad that faces the eye, on which the views around it are blended in one
//! pass; both eyes of a head see the same views. The light grid tells what sky and sun reach them: six sides of light, and the sun at feet, middle and head. They are drawn last, from the
//! farthest on, over stone and guests, and go softly into what is before them.

mod load;
pub(crate) mod outline;
mod render;
pub(crate) mod uniform;

pub use load::Kind;
pub(crate) use render::draw;
#[cfg(test)]
pub(crate) use render::{Draws, ImpostorKey};
pub use uniform::{KIND_BYTES, PERSON_BYTES, SEEN_BYTES};

use crate::actors::course::Course;
use crate::actors::direction::{self, Direction, Performed};
use crate::actors::{Actors, light_at};
use crate::costs::FrameTold;
use crate::covering::{Covering, SettleCovers, pulse};
use crate::daylight::{DaylightCamera, StereoPair};
use crate::lamps::reaching::Reach;
use crate::lamps::uniform::lit;
use crate::lamps::{Lamp, Lamps, SettleLamps};
use crate::over_stone::let_depth_be_read;
use crate::stage::Stage;
use crate::stage::background::Background;
use crate::stage::frame::StageFrame;
use crate::stage::ground::Ground;
use crate::time_lapse::{Now, SettleMoment};
use bevy::camera::Camera;
use bevy::core_pipeline::core_3d::{main_opaque_pass_3d, main_transparent_pass_3d};
use bevy::core_pipeline::schedule::{Core3d, Core3dSystems};
use bevy::math::Vec4;
use bevy::prelude::*;
use bevy::render::extract_resource::{ExtractResource, ExtractResourcePlugin};
use bevy::render::{Render, RenderApp, RenderSystems};
use glam::Affine3A;
use heliodon_bundle::BundleReader;
use heliodon_bundle::grid::{AXES, AmbientCube, Grid};
use heliodon_bundle::impostor::{Choice, Impostor, ImpostorInfo};
use heliodon_bundle::moment::Moment;
use load::Loaded;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;
use uniform::{PersonUniform, SeenUniform};

/// WGSL of impostors.
pub(crate) const IMPOSTOR_WGSL: &str = include_str!("impostor.wgsl");

/// The impostors of the bundle on the stage.
#[derive(Resource, Default)]
pub struct Impostors {
    /// How they are shown.
    pub options: ImpostorOptions,
    stage: u64,
    loading: Option<Background<Loaded>>,
    /// Added by the app, not yet on the stage.
    added: Vec<(Arc<Kind>, Vec<Course>)>,
    kinds: Vec<Arc<Kind>>,
    people: Vec<Person>,
    told: Told,
}

/// How impostors are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImpostorOptions {
    /// Which views.
    pub views: Views,
    /// How many times a view is looked for by its depths, 0 to 3: the fewer, the more views of a coarse ring part from one another.
    pub steps: u32,
    /// How many of them cast shadows at most: those nearest to each head. On software Vulkan 500 take a sixth of a frame.
    pub casters: u32,
}

/// Which views of an impostor are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Views {
    /// Those around the eye, blended.
    #[default]
    Blended,
    /// The nearest alone: a quarter of the work, and it jumps from view to view.
    Nearest,
}

impl Default for ImpostorOptions {
    fn default() -> Self {
        Self { views: Views::Blended, steps: 2, casters: u32::MAX }
    }
}

/// The sine of the sun's height from which it casts shadows: below they would be longer than thirty times what casts them.
const LEAST_RISE: f32 = 0.03;
/// The longest shadows, metres.
const LONGEST_M: f32 = 30.0;

/// What the impostors of a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Told {
    /// People.
    pub people: usize,
    /// Quads of all cameras' heads.
    pub shown: usize,
    /// Milliseconds that the processor took.
    pub ms: f32,
}

/// Somebody.
#[derive(Clone, Debug)]
pub struct Person {
    name: Arc<str>,
    kind: usize,
    clip: usize,
    course: Course,
    /// How long it has been on its way when the actors begin, seconds.
    ahead_s: f32,
    speed: f32,
    phase_s: f32,
    scale: f32,
    reach: Reach,
}

impl Impostors {
    /// Puts somebody of a name on the stage, without texels.
    #[cfg(test)]
    pub(crate) fn place(&mut self, name: &str, info: ImpostorInfo, course: Course) {
        let texture = heliodon_image::ktx2::Ktx2 {
            format: heliodon_image::ktx2::TexelFormat::Bc7,
            width: info.frame_px[0],
            height: info.frame_px[1],
            layers: 2 * info.rings.iter().map(|ring| ring.views).sum::<u32>(),
            levels: Vec::new(),
        };
        self.kinds.push(Arc::new(Kind::new(Impostor { info, texture })));
        self.people.push(Person { name: name.into(), ..Person::alone(self.kinds.len() - 1, course) });
    }

    /// Puts people on the stage beside the bundle's own, until another bundle is opened: one on each course, all with the impostor's first clip.
    pub fn add(&mut self, impostor: Impostor, courses: Vec<Course>) {
        self.added.push((Arc::new(Kind::new(impostor)), courses));
    }

    /// Where the first of that name is, from its model's space to the world, and the box around it, its least and greatest corner.
    #[must_use]
    pub fn whereabouts(&self, name: &str, actors: &Actors) -> Option<(Affine3A, (Vec3, Vec3))> {
        let person = self.people.iter().find(|person| *person.name == *name)?;
        let stands = person.stands(actors.seconds as f32, actors.directions.get(name));
        let info = self.kinds[person.kind].info();
        let ([low, high], around) = (info.heights_m.map(|height| height * person.scale), info.around_m * person.scale);
        let at = Vec3::from(stands.translation);
        Some((stands, (at + Vec3::new(-around, low, -around), at + Vec3::new(around, high, around))))
    }

    /// Where the first of that name is now whom nobody directs.
    #[must_use]
    pub(crate) fn undirected(&self, name: &str, actors: &Actors) -> Option<Affine3A> {
        self.people.iter().find(|person| *person.name == *name).map(|person| person.stands(actors.seconds as f32, None))
    }

    /// The corners of the prism that the first of that name fills, about where it stands, at its scale.
    #[must_use]
    pub(crate) fn corners(&self, name: &str) -> Option<Vec<Vec3>> {
        let person = self.people.iter().find(|person| *person.name == *name)?;
        let corners = outline::corners(self.kinds[person.kind].info());
        Some(corners.into_iter().map(|corner| corner * person.scale).collect())
    }

    /// How long a clip of somebody takes, seconds.
    #[must_use]
    pub fn clip_s(&self, name: &str, clip: &str) -> Option<f32> {
        let person = self.people.iter().find(|person| *person.name == *name)?;
        self.kinds[person.kind].info().clips.iter().find(|known| known.name == clip).map(|clip| clip.duration_s)
    }

    /// Whether all of the bundle's impostors are there.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.loading.is_none()
    }

    /// What the last frame took.
    #[must_use]
    pub fn told(&self) -> Told {
        self.told
    }

    /// How many people there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.people.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.people.is_empty()
    }
}

/// What the render world is told of a frame's impostors.
#[derive(Resource, Clone, Default, ExtractResource)]
pub(crate) struct ImpostorsFrame {
    /// Changes with the kinds.
    serial: u64,
    kinds: Arc<[Arc<Kind>]>,
    people: Arc<Vec<PersonUniform>>,
    heads: Arc<Vec<Head>>,
    options: ImpostorOptions,
    /// Direction, and exposed irradiance at normal incidence.
    sun: (Vec3, Vec3),
    /// Where shadows come from.
    shadow: Vec3,
}

/// What a head sees of them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Head {
    /// Between its eyes.
    pub(crate) place: Vec3,
    /// Its eyes.
    pub(crate) cameras: Vec<Entity>,
    /// From the farthest on.
    order: Vec<SeenUniform>,
    /// Which of these are of one kind.
    runs: Vec<(usize, Range<u32>)>,
}

/// Shows impostors.
#[derive(Default)]
pub struct ImpostorPlugin;

impl Plugin for ImpostorPlugin {
    fn build(&self, app: &mut App) {
        let told = FrameTold::in_app(app);
        app.init_resource::<Impostors>()
            .init_resource::<ImpostorsFrame>()
            .add_plugins(ExtractResourcePlugin::<ImpostorsFrame>::default())
            .add_systems(Update, follow_stage)
            .add_systems(
                PostUpdate,
                (
                    let_depth_be_read,
                    told.of("impostors", arrange)
                        .after(SettleMoment)
                        .after(SettleCovers)
                        .after(SettleLamps)
                        .after(bevy::transform::TransformSystems::Propagate)
                        .after(bevy::camera::CameraUpdateSystems),
                ),
            );
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_resource::<render::ImpostorsGpu>()
            .add_systems(
                Render,
                told.of("impostors", render::prepare)
                    .in_set(RenderSystems::PrepareResources)
                    .after(crate::daylight::prepare::prepare_views),
            )
            .add_systems(
                Core3d,
                render::draw.in_set(Core3dSystems::MainPass).after(main_opaque_pass_3d).before(main_transparent_pass_3d),
            );
    }
}

/// Loads the impostors of another bundle, and takes them when they are there.
fn follow_stage(stage: Res<Stage>, mut impostors: ResMut<Impostors>, mut frame: ResMut<ImpostorsFrame>) {
    let impostors = &mut *impostors;
    if impostors.stage != stage.serial() {
        *impostors = Impostors { options: impostors.options, stage: stage.serial(), ..default() };
        *frame = ImpostorsFrame { serial: frame.serial + 1, ..default() };
        let has_any = |bundle: &&Arc<BundleReader>| bundle.actors().iter().any(|actor| actor.is_impostor());
        if let Some(bundle) = stage.bundle().filter(has_any) {
            let bundle = Arc::clone(bundle);
            impostors.loading = Some(Background::start(move || load::run(&bundle)));
        }
    }
    if !impostors.added.is_empty() && impostors.loading.is_none() {
        for (kind, courses) in std::mem::take(&mut impostors.added) {
            let number = impostors.kinds.len();
            impostors.people.extend(courses.into_iter().map(|course| Person::alone(number, course)));
            impostors.kinds.push(kind);
        }
        *frame = ImpostorsFrame { serial: frame.serial + 1, kinds: impostors.kinds.clone().into(), ..default() };
    }
    let Some(loaded) = impostors.loading.as_ref().and_then(Background::take) else { return };
    let loaded =
        loaded.unwrap_or_else(|_| Loaded { failures: vec!["the impostors' loading thread broke off".to_owned()], ..default() });
    loaded.failures.iter().for_each(|failure| warn!("{failure}"));
    impostors.loading = None;
    (impostors.kinds, impostors.people) = (loaded.kinds, loaded.people);
    *frame = ImpostorsFrame { serial: frame.serial + 1, kinds: impostors.kinds.clone().into(), ..default() };
}

/// Puts everybody where they are, into the light that is there, and chooses what each head sees of them.
fn arrange(
    now: Res<Now>,
    stage_frame: Res<StageFrame>,
    (actors, covering, time): (Res<Actors>, Option<Res<Covering>>, Res<Time>),
    (lamps, stage): (Option<Res<Lamps>>, Res<Stage>),
    mut impostors: ResMut<Impostors>,
    mut frame: ResMut<ImpostorsFrame>,
    cameras: Query<(Entity, &Camera, &GlobalTransform, Option<&StereoPair>), With<DaylightCamera>>,
) {
    let Some(moment) = &now.moment else { return };
    if impostors.people.is_empty() {
        return;
    }
    let start = Instant::now();
    let Impostors { options, kinds, people, told, .. } = &mut *impostors;
    let exposure = stage_frame.exposure_stops.exp2();
    let high = now.has_sun && moment.sun_direction.y > LEAST_RISE;
    let shadow = if high { moment.sun_direction } else { Vec3::Y };
    let lamps = lamps.map_or_else(Vec::new, |lamps| lit(lamps.all()));
    let light = Light { moment, grid: actors.grid(), exposure, shadow, lamps: &lamps, ground: stage.ground() };
    let (seconds, pulse) = (actors.seconds as f32, pulse(&time));
    let placed: Vec<PersonUniform> = people
        .par_iter_mut()
        .with_min_len(32)
        .map(|person| {
            let direction = if actors.directions.is_empty() { None } else { actors.directions.get(&*person.name) };
            let mut at = person.at(seconds, direction, &kinds[person.kind], &light);
            if let Some(covering) = &covering {
                at.worn = covering.of_impostor(&person.name, pulse);
            }
            at
        })
        .collect();
    let mut heads = heads(cameras.iter().filter(|(_, camera, ..)| camera.is_active));
    for head in &mut heads {
        head.look(people, &placed, kinds, options.views);
    }
    let sun = if now.has_sun { moment.shading.sun_irradiance * exposure } else { Vec3::ZERO };
    *told = Told {
        people: people.len(),
        shown: heads.iter().map(|head| head.order.len()).sum(),
        ms: start.elapsed().as_secs_f32() * 1e3,
    };
    *frame = ImpostorsFrame {
        people: Arc::new(placed),
        heads: Arc::new(heads),
        options: *options,
        sun: (moment.sun_direction, sun),
        shadow,
        ..frame.clone()
    };
}

/// The light that everybody is under.
struct Light<'a> {
    moment: &'a Moment,
    grid: Option<&'a Grid>,
    exposure: f32,
    /// Where shadows come from.
    shadow: Vec3,
    /// Those that are lit.
    lamps: &'a [Lamp],
    /// What hides them.
    ground: &'a Ground,
}

impl Light<'_> {
    /// What reaches a place.
    fn at(&self, place: Vec3) -> AmbientCube {
        light_at(self.grid, self.moment, place)
    }

    /// What lamps add on surfaces that face +X -X +Y -Y +Z -Z: somebody is small beside how far lamps are.
    fn of_lamps(&self, place: Vec3, reach: &mut Reach) -> [Vec3; 6] {
        let mut sides = [Vec3::ZERO; 6];
        for (to, irradiance) in reach.of(place, self.lamps, self.ground) {
            for (side, axis) in sides.iter_mut().zip(AXES) {
                *side += irradiance * axis.dot(to).max(0.0);
            }
        }
        sides
    }
}

impl Person {
    /// Somebody as the impostor was made, on a course.
    fn alone(kind: usize, course: Course) -> Self {
        Self {
            name: "".into(),
            kind,
            clip: 0,
            course,
            ahead_s: 0.0,
            speed: 1.0,
            phase_s: 0.0,
            scale: 1.0,
            reach: Reach::default(),
        }
    }

    /// Where it is at a time.
    fn stands(&self, seconds: f32, direction: Option<&Direction>) -> Affine3A {
        let told = direction.and_then(|direction| direction.world_from_model);
        told.unwrap_or_else(|| self.course.at(seconds + self.ahead_s))
    }

    /// Where it is at a time, and in what light.
    fn at(&mut self, seconds: f32, direction: Option<&Direction>, kind: &Kind, light: &Light) -> PersonUniform {
        let info = kind.info();
        let stands = self.stands(seconds, direction);
        // of no size, they cover nothing
        let scale = if direction.is_some_and(|direction| direction.hidden) { 0.0 } else { self.scale };
        let [low, high] = info.heights_m;
        let middle = stands.transform_point3(info.middle() * self.scale);
        let height = |metres: f32| stands.transform_point3(Vec3::Y * (metres * self.scale));
        let around = light.at(middle);
        // a hand above the ground: below are points within stone
        let feet = light.at(height(low + 0.1 * (high - low))).sun_visible;
        let head = light.at(height(high)).sun_visible;
        let forward = stands.matrix3.z_axis;
        let performed = direction.and_then(|direction| direction.clip.as_ref());
        let known = |performed: &Performed| {
            let clip = info.clips.iter().position(|clip| clip.name == performed.clip)?;
            let passed_s = seconds - performed.since_s as f32;
            Some((clip, direction::within(info.clips[clip].duration_s, passed_s, performed.repeat)))
        };
        let (clip, clip_s) = performed.and_then(known).unwrap_or((self.clip, seconds * self.speed + self.phase_s));
        let ([frame, next], part) = info.frames_at(clip, clip_s);
        let corner = info.frame_corner(if part < 0.5 { frame } else { next });
        let suns = [feet, around.sun_visible, head, 0.0, 0.0, 0.0];
        let mut sides = [Vec4::ZERO; 6];
        let of_lamps = light.of_lamps(middle, &mut self.reach);
        for (((side, lit), of_lamps), sun) in sides.iter_mut().zip(around.sky_and_bounce).zip(of_lamps).zip(suns) {
            *side = ((lit + of_lamps) * light.exposure).extend(sun);
        }
        let to_model = |v: Vec3| Vec3::new(forward.z * v.x - forward.x * v.z, v.y, forward.x * v.x + forward.z * v.z);
        let (view, toward) = kind.nearest(to_model(light.shadow));
        let upward =
            |toward: Vec3| 0.5 * (high - low) * (1.0 - toward.y * toward.y).max(0.0).sqrt() + info.around_m * toward.y.abs();
        // along the light from the middle to the ground where the head's shadow falls, and on to ground half a metre lower
        let rise = light.shadow.y.max(LEAST_RISE);
        let feet_m = self.scale * (info.center[1] - low);
        let reach = feet_m * rise + (self.scale * (high - low) * (1.0 - rise * rise) + 0.5) / rise;
        let shadow = Vec4::new(view as f32, upward(toward), upward(light.shadow), reach.min(LONGEST_M));
        PersonUniform {
            shadow,
            place: middle.extend(scale),
            turn: Vec4::new(forward.x, forward.z, corner.x, corner.y),
            light: sides,
            worn: Vec4::new(1.0, 0.0, 0.0, 0.0),
        }
    }
}

/// The heads that look, each with its cameras: both eyes of a pair are one, and so are cameras in the same place.
pub(crate) fn heads<'a>(
    cameras: impl Iterator<Item = (Entity, &'a Camera, &'a GlobalTransform, Option<&'a StereoPair>)>,
) -> Vec<Head> {
    const SAME_M: f32 = 1e-3;
    let mut pairs: Vec<(StereoPair, Vec<(Entity, Vec3)>)> = Vec::new();
    let mut places: Vec<(Vec<Entity>, Vec3)> = Vec::new();
    for (entity, _, transform, pair) in cameras {
        let eye = transform.translation();
        match pair {
            None => places.push((vec![entity], eye)),
            Some(pair) => match pairs.iter_mut().find(|(known, _)| known == pair) {
                Some((_, eyes)) => eyes.push((entity, eye)),
                None => pairs.push((*pair, vec![(entity, eye)])),
            },
        }
    }
    for (_, eyes) in pairs {
        let middle = eyes.iter().map(|(_, eye)| *eye).sum::<Vec3>() / eyes.len() as f32;
        places.push((eyes.into_iter().map(|(entity, _)| entity).collect(), middle));
    }
    let mut heads: Vec<Head> = Vec::new();
    for (cameras, place) in places {
        match heads.iter_mut().find(|head| head.place.distance(place) < SAME_M) {
            Some(head) => head.cameras.extend(cameras),
            None => heads.push(Head { place, cameras, ..Head::default() }),
        }
    }
    heads
}

/// How much of each view is spared so far away, metres of the model's own scale: what is seen smaller than it was captured for shows fewer of them.
fn spared(info: &ImpostorInfo, away_m: f32) -> f32 {
    let beyond = (away_m / info.distance_m.max(1e-3) - 1.0).clamp(0.0, 2.0) * 0.5;
    Choice::MOST_SPARED * beyond * beyond * (3.0 - 2.0 * beyond)
}

impl Head {
    /// Chooses views of everybody, from the farthest on.
    fn look(&mut self, people: &[Person], placed: &[PersonUniform], kinds: &[Arc<Kind>], views: Views) {
        let mut far: Vec<(f32, u32)> =
            placed.iter().zip(0..).map(|(person, i)| (person.place.truncate().distance_squared(self.place), i)).collect();
        far.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        for (_, number) in far {
            let (person, at) = (&people[number as usize], &placed[number as usize]);
            let to_eye = self.place - at.place.truncate();
            let (sin, cos) = (at.turn.x, at.turn.y);
            let toward = Vec3::new(cos * to_eye.x - sin * to_eye.z, to_eye.y, sin * to_eye.x + cos * to_eye.z);
            let kind = &kinds[person.kind];
            let choice = match views {
                Views::Blended => kind.info().choose(toward).sparing(spared(kind.info(), to_eye.length() / at.place.w)),
                Views::Nearest => Choice { views: [kind.nearest(toward).0; 4], weights: [1.0, 0.0, 0.0, 0.0] },
            };
            let next = self.order.len() as u32;
            self.order.push(SeenUniform::new(number, &choice));
            match self.runs.last_mut().filter(|(kind, _)| *kind == person.kind) {
                Some((_, run)) => run.end = next + 1,
                None => self.runs.push((person.kind, next..next + 1)),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_bundle::impostor::{ImpostorClip, Ring};
    use heliodon_image::ktx2::{Ktx2, TexelFormat};

    fn info() -> ImpostorInfo {
        ImpostorInfo {
            version: 1,
            name: "somebody".to_owned(),
            center: [0.0, 0.9, 0.0],
            radius_m: 1.0,
            around_m: 0.4,
            heights_m: [0.0, 1.8],
            rings: vec![Ring::around(5.0, 8)],
            windows_m: vec![[-0.5, -1.0, 0.5, 1.0]; 8],
            frame_px: [16, 32],
            grid: [1, 1],
            clips: vec![ImpostorClip { name: "rest".to_owned(), duration_s: 0.0, first: 0, frames: 1 }],
            distance_m: 10.0,
        }
    }

    #[test]
    fn views_are_spared_only_beyond_the_distance_that_they_were_made_for() {
        let info = info();
        let [near, made_for, beyond, far] = [2.0, 10.0, 20.0, 90.0].map(|away_m| spared(&info, away_m));
        assert!(near == 0.0 && made_for == 0.0 && beyond > 0.05 && beyond < far, "{beyond} {far}");
        assert_eq!(far, Choice::MOST_SPARED);
    }

    #[test]
    fn the_eyes_of_a_head_see_the_same_views_from_the_farthest_on() {
        let mut world = World::new();
        let camera = Camera::default();
        let [left, right] = [-0.03, 0.03].map(|x| (world.spawn_empty().id(), GlobalTransform::from_xyz(x, 1.6, 0.0)));
        let alone = (world.spawn_empty().id(), GlobalTransform::from_xyz(0.0, 1.6, 0.0));
        let pair = StereoPair(3);
        let seen = [(left, Some(&pair)), (alone, None), (right, Some(&pair))];
        let mut heads = heads(seen.iter().map(|((entity, transform), pair)| (*entity, &camera, transform, *pair)));
        // who looks from the middle between both eyes sees what they see
        assert_eq!(heads.len(), 1);
        assert_eq!(heads[0].cameras.len(), 3);
        let texture = Ktx2 { format: TexelFormat::Bc7, width: 16, height: 32, layers: 16, levels: Vec::new() };
        let kind = Arc::new(Kind::new(Impostor { info: info(), texture }));
        let people: Vec<Person> =
            [3.0, 9.0, 6.0].map(|z| Person::alone(0, Course::stands(Vec3::new(0.0, 0.0, -z), 0.0))).to_vec();
        let placed: Vec<PersonUniform> = [3.0, 9.0, 6.0]
            .map(|z| PersonUniform { place: Vec4::new(0.0, 0.9, -z, 1.0), turn: Vec4::new(0.0, 1.0, 0.0, 0.0), ..default() })
            .to_vec();
        heads[0].look(&people, &placed, std::slice::from_ref(&kind), Views::Nearest);
        // before all of them: the view from +Z, which is the first
        let front = kind.info().nearest(Vec3::Z);
        let wanted: Vec<SeenUniform> = [1, 2, 0].map(|person| SeenUniform::new(person, &front)).to_vec();
        assert_eq!(heads[0].order, wanted);
        assert_eq!(heads[0].runs, [(0, 0..3)]);
    }
}
