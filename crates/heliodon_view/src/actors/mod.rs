//! What moves: actors, lit in every frame by the visibility matrix and the sun, shaded by the monument, and shading it.
//!
//! M. Sattler, R. Sarlette, G. Zachmann, R. Klein: "Hardware-accelerated ambient occlusion computation", VMV 2004. [`figure`] poses an actor and asks which
//! directions of the sky reach the vertices that a camera sees; [`levels`] says how many directions; [`course`] where it stands. The sky that it stands
//! under is the moment's, less what the monument hides of it there: the bundle's light grid says how much. [`shade`] is what it takes from
//! the stone's light.

pub mod course;
pub mod direction;
pub mod figure;
pub mod levels;
mod load;
pub mod render;
pub mod shade;
pub mod solid;
mod sun_field;

use crate::costs::FrameTold;
use crate::covering::gpu::{Sight, Worn};
use crate::covering::{Covering, SettleCovers};
use crate::daylight::DaylightCamera;
use crate::daylight::layout::octahedral;
use crate::lamps::Lamps;
use crate::stage::Stage;
use crate::stage::background::Background;
use crate::stage::frame::StageFrame;
use crate::time_lapse::{Now, SettleMoment};
use bevy::camera::Camera;
use bevy::core_pipeline::schedule::camera_driver;
use bevy::prelude::*;
use bevy::render::extract_resource::ExtractResourcePlugin;
use bevy::render::renderer::{RenderAdapterInfo, RenderDevice, RenderGraph};
use bevy::render::{Render, RenderApp, RenderSystems};
use course::Course;
use direction::Direction;
use figure::{Asked, FOLLOW_S, Figure, Surroundings};
use glam::Affine3A;
use half::f16;
use heliodon_bundle::BundleReader;
use heliodon_bundle::grid::{AXES, AmbientCube, Grid};
use heliodon_bundle::moment::Moment;
use heliodon_gpu::MovingPipelines;
use heliodon_math::sh;
use heliodon_mesh::motion::{MovingMesh, Palette};
use heliodon_rays::EyeView;
use levels::Directions;
use load::Loaded;
use render::{ActorsFrame, ActorsGpu, Look, OnGpu, Shown};
use shade::Caster;
use solid::Solid;
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;
use sun_field::SunField;

/// WGSL of what actors take from the stone's light.
pub(crate) const SHADE_WGSL: &str = include_str!("shade.wgsl");

/// Frames farther apart than this are pictures on their own: nothing is carried over.
const APART_S: f64 = 0.5;

/// The actors of the bundle on the stage.
#[derive(Resource)]
pub struct Actors {
    /// Seconds since they began; flows with the app's time, also while the hour stands still.
    pub seconds: f64,
    /// How they are lit.
    pub options: ActorsOptions,
    /// What a story tells some of them, and of the impostors, by name.
    pub directions: HashMap<String, Direction>,
    stage: u64,
    loading: Option<Background<Loaded>>,
    /// Added by the app, not yet on the stage.
    added: Vec<(Person, Look)>,
    people: Vec<Person>,
    grid: Option<Grid>,
    lit_s: Option<f64>,
    /// Actors that deformed in the last frame.
    deforming: usize,
    told: Told,
}

/// How actors are lit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActorsOptions {
    /// Who asks for their light.
    pub backend: Backend,
    /// From how many directions.
    pub directions: Directions,
}

impl Default for ActorsOptions {
    fn default() -> Self {
        // A third of a frame of thirty a second; at rest as the monument's own sky.
        Self { backend: Backend::Auto, directions: Directions::Budget { ms: 12.0, finest: 4 } }
    }
}

/// Who poses actors and asks for their light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Backend {
    /// The GPU that draws, unless it is a processor: that one's own rays are ten times as fast as it is as a GPU.
    #[default]
    Auto,
    /// The processor, by rays, for the vertices that the cameras see.
    Cpu,
    /// The GPU that draws: nothing comes back from it. What it refuses is left to the processor.
    Gpu,
}

impl Backend {
    fn is_gpu(self, adapter: Option<&RenderAdapterInfo>, device: Option<&RenderDevice>) -> bool {
        let wanted = match self {
            Self::Cpu => false,
            Self::Gpu => true,
            Self::Auto => adapter.is_some_and(|adapter| adapter.device_type != wgpu::DeviceType::Cpu),
        };
        wanted && device.is_some_and(|device| MovingPipelines::supports(device.wgpu_device()))
    }
}

/// What the actors of a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Told {
    /// Actors.
    pub actors: usize,
    /// The most directions that one of them was asked from.
    pub directions: usize,
    /// Vertices for which anything was asked.
    pub vertices: usize,
    /// Milliseconds that the processor took for all of it.
    pub ms: f32,
}

/// An actor on its course.
pub(crate) struct Person {
    name: String,
    figure: Figure,
    course: Course,
    clip: Option<usize>,
    speed: f32,
    duration_s: f32,
    /// Where it was in the last frame, and the box around it.
    stands: Affine3A,
    bounds: (Vec3, Vec3),
    /// What a GPU poses it by, and the number of poses so far.
    pose: Option<Arc<Palette>>,
    poses: u64,
}

impl Default for Actors {
    fn default() -> Self {
        Self {
            seconds: 0.0,
            options: ActorsOptions::default(),
            directions: HashMap::new(),
            stage: 0,
            loading: None,
            added: Vec::new(),
            people: Vec::new(),
            grid: None,
            lit_s: None,
            deforming: 0,
            told: Told::default(),
        }
    }
}

impl Actors {
    /// Puts somebody on the stage beside the bundle's own actors, until another bundle is opened: `clip` is performed, the first unless another is named, on a
    /// course. A clip's speed is 1 where it is played as it was made.
    pub fn add(&mut self, name: &str, moving: MovingMesh, clip: Option<usize>, speed: f32, course: Course) {
        self.added.push(load::person(name, moving, clip, speed, course, None));
    }

    /// Whether all of the bundle's actors are there.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.loading.is_none()
    }

    /// What the last frame took.
    #[must_use]
    pub fn told(&self) -> Told {
        self.told
    }

    /// Where somebody was in the last frame, from their model's space to the world, and the box around them, its least and greatest corner.
    #[must_use]
    pub fn whereabouts(&self, name: &str) -> Option<(Affine3A, (Vec3, Vec3))> {
        self.people.iter().find(|person| person.name == name).map(|person| (person.stands, person.bounds))
    }

    /// What of somebody could be touched in the last frame; nothing before the first.
    #[must_use]
    pub fn solid(&self, name: &str) -> Option<Solid<'_>> {
        let person = self.people.iter().find(|person| person.name == name)?;
        (person.bounds.0 != person.bounds.1).then(|| person.figure.solid())
    }

    /// Where somebody whom nobody directs is now.
    #[must_use]
    pub fn undirected(&self, name: &str) -> Option<Affine3A> {
        self.people.iter().find(|person| person.name == name).map(|person| person.course.at(self.seconds as f32))
    }

    /// How long a clip of somebody takes as they perform it, seconds.
    #[must_use]
    pub fn clip_s(&self, name: &str, clip: &str) -> Option<f32> {
        let person = self.people.iter().find(|person| person.name == name)?;
        person.figure.model().moving().clips().iter().find(|known| known.name == clip).map(|clip| clip.duration_s)
    }

    /// The number of somebody among those that are shown.
    pub(crate) fn number(&self, name: &str) -> Option<usize> {
        self.people.iter().position(|person| person.name == name)
    }

    /// The light of a place: what the monument leaves of it, or the open sky's where nothing is known of that.
    pub(crate) fn light_at(&self, moment: &Moment, place: Vec3) -> AmbientCube {
        light_at(self.grid(), moment, place)
    }

    /// Where the actor of a number is whom nobody directs.
    pub(crate) fn on_course(&self, number: usize) -> Option<Affine3A> {
        self.people.get(number).map(|person| person.course.at(self.seconds as f32))
    }

    /// Everybody: their names, where they were in the last frame, and the boxes around them.
    pub(crate) fn everybody(&self) -> impl Iterator<Item = (&str, Affine3A, (Vec3, Vec3))> {
        self.people.iter().map(|person| (person.name.as_str(), person.stands, person.bounds))
    }

    /// The vertices of somebody at rest, in their model's space.
    pub(crate) fn at_rest(&self, name: &str) -> Option<Vec<Vec3>> {
        let person = self.people.iter().find(|person| person.name == name)?;
        Some(person.figure.model().moving().rest().positions.clone())
    }

    /// What the monument leaves of the light where anybody is.
    pub(crate) fn grid(&self) -> Option<&Grid> {
        self.grid.as_ref()
    }
}

/// Moves, lights and draws actors.
#[derive(Default)]
pub struct ActorsPlugin;

impl Plugin for ActorsPlugin {
    fn build(&self, app: &mut App) {
        let told = FrameTold::in_app(app);
        app.init_resource::<Actors>()
            .init_resource::<ActorsFrame>()
            .add_plugins(ExtractResourcePlugin::<ActorsFrame>::default())
            // what a story directs from its beginning is not forgotten with the bundle before
            .add_systems(
                Update,
                (told.of("actors", follow_stage), told.of("actors", flow)).chain().before(crate::story::StorySet),
            )
            .add_systems(
                PostUpdate,
                told.of("actors", light_actors)
                    .after(SettleMoment)
                    .after(SettleCovers)
                    .after(crate::lamps::SettleLamps)
                    .after(bevy::transform::TransformSystems::Propagate)
                    .after(bevy::camera::CameraUpdateSystems),
            );
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_resource::<ActorsGpu>()
            .add_systems(
                Render,
                told.of("actors", render::prepare_actors)
                    .in_set(RenderSystems::PrepareResources)
                    .after(crate::daylight::prepare::receive)
                    .before(crate::daylight::prepare::prepare_views),
            )
            .add_systems(RenderGraph, render::cast_shadows.before(camera_driver));
    }
}

/// Loads the actors of another bundle, and takes them when they are there.
fn follow_stage(stage: Res<Stage>, mut actors: ResMut<Actors>, mut frame: ResMut<ActorsFrame>) {
    let actors = &mut *actors;
    if actors.stage != stage.serial() {
        actors.stage = stage.serial();
        (actors.people, actors.grid, actors.loading, actors.lit_s) = (Vec::new(), None, None, None);
        actors.told = Told::default();
        actors.directions.clear();
        actors.seconds = 0.0;
        *frame = ActorsFrame { serial: frame.serial + 1, ..default() };
        let acts = |bundle: &&Arc<BundleReader>| !bundle.actors().is_empty() || bundle.manifest().grid.is_some();
        if let Some(bundle) = stage.bundle().filter(acts) {
            let bundle = Arc::clone(bundle);
            actors.loading = Some(Background::start(move || load::run(&bundle)));
        }
    }
    if !actors.added.is_empty() && actors.loading.is_none() {
        let mut looks: Vec<Arc<Look>> = frame.looks.to_vec();
        for (person, look) in actors.added.drain(..) {
            actors.people.push(person);
            looks.push(Arc::new(look));
        }
        *frame = ActorsFrame { serial: frame.serial + 1, looks: looks.into(), shown: Arc::default() };
    }
    let Some(loaded) = actors.loading.as_ref().and_then(Background::take) else { return };
    let loaded =
        loaded.unwrap_or_else(|_| Loaded { failures: vec!["the actors' loading thread broke off".to_owned()], ..default() });
    loaded.failures.iter().for_each(|failure| warn!("{failure}"));
    actors.loading = None;
    (actors.people, actors.grid) = (loaded.people, loaded.grid);
    *frame = ActorsFrame {
        serial: frame.serial + 1,
        looks: loaded.looks.into_iter().map(Arc::new).collect(),
        shown: Arc::default(),
    };
}

fn flow(time: Res<Time>, mut actors: ResMut<Actors>) {
    actors.seconds += time.delta_secs_f64();
}

/// Poses and lights what the cameras see.
fn light_actors(
    now: Res<Now>,
    stage_frame: Res<StageFrame>,
    mut actors: ResMut<Actors>,
    mut frame: ResMut<ActorsFrame>,
    (lamps, covering): (Option<Res<Lamps>>, Option<Res<Covering>>),
    (adapter, device): (Option<Res<RenderAdapterInfo>>, Option<Res<RenderDevice>>),
    cameras: Query<(&Camera, &GlobalTransform), With<DaylightCamera>>,
) {
    let Some(moment) = &now.moment else { return };
    if actors.people.is_empty() {
        return;
    }
    let start = Instant::now();
    let eyes: Vec<EyeView> = cameras
        .iter()
        .filter(|(camera, _)| camera.is_active)
        .filter_map(|(camera, transform)| {
            let clip_from_mesh = camera.clip_from_view() * transform.to_matrix().inverse();
            Some(EyeView { clip_from_mesh, size_px: camera.physical_viewport_size()? })
        })
        .collect();
    let Actors { seconds, options, people, grid, lit_s, deforming, told, directions: told_to, .. } = &mut *actors;
    let directions = options.directions.shared(*deforming);
    *deforming = 0;
    let on_gpu = options.backend.is_gpu(adapter.as_deref(), device.as_deref());
    let passed_s = lit_s.replace(*seconds).map(|lit_s| *seconds - lit_s).filter(|&s| s > 0.0 && s < APART_S);
    let exposure = stage_frame.exposure_stops.exp2();
    let sun = now.has_sun.then(|| (moment.sun_direction, moment.shading.sun_irradiance * exposure));
    *told = Told { actors: people.len(), ..default() };
    let lamps = lamps.is_some_and(|lamps| lamps.all().next().is_some());
    let hour = Hour { moment, grid: grid.as_ref(), exposure, sun, lamps };
    let mut shown = Vec::with_capacity(people.len());
    for (i, person) in people.iter_mut().enumerate() {
        let direction = told_to.get(&person.name);
        let worn = covering.as_ref().map_or(Worn::NOTHING, |covering| covering.worn(&person.name));
        if direction.is_some_and(|direction| direction.hidden) || worn.sight == Sight::Hidden {
            shown.push(Shown::default());
            continue;
        }
        let on_gpu = on_gpu && frame.looks.get(i).is_some_and(|look| !look.refused.load(Ordering::Relaxed));
        let at = (*seconds as f32, passed_s.map(|s| s as f32));
        // What shines needs its normals, as what lamps light does.
        let hour = Hour { lamps: hour.lamps || worn.slot > 0, ..hour };
        match person.act(at, direction, (!on_gpu).then_some(&eyes[..]), directions, &hour) {
            Ok((mut one, asked)) => {
                one.worn = worn;
                one.caster.faded = covering.as_ref().map_or(0.0, |covering| 1.0 - covering.opacity(&person.name));
                told.directions = told.directions.max(asked.directions);
                told.vertices += asked.vertices;
                *deforming += usize::from(asked.deforms);
                shown.push(one);
            }
            Err(error) => {
                warn_once!("an actor cannot be lit: {}: {error}", person.name);
                shown.push(Shown::default());
            }
        }
    }
    told.ms = start.elapsed().as_secs_f32() * 1e3;
    frame.shown = Arc::new(shown);
}

/// The light that everybody is under.
#[derive(Clone, Copy)]
struct Hour<'a> {
    moment: &'a Moment,
    grid: Option<&'a Grid>,
    exposure: f32,
    sun: Option<(Vec3, Vec3)>,
    /// Whether normals are needed.
    lamps: bool,
}

impl Person {
    /// Poses it, and lights what the eyes see; without eyes it says what a GPU needs for both.
    fn act(
        &mut self,
        (seconds, passed_s): (f32, Option<f32>),
        direction: Option<&Direction>,
        eyes: Option<&[EyeView]>,
        directions: Directions,
        hour: &Hour<'_>,
    ) -> Result<(Shown, Asked), heliodon_rays::VisibilityCpuError> {
        let told = direction.and_then(|direction| direction.world_from_model);
        let mut place = told.unwrap_or_else(|| self.course.at(seconds));
        self.stands = place;
        let performed = direction.and_then(|direction| direction.clip.as_ref());
        let clips = self.figure.model().moving().clips();
        let (mut clip, clip_s) = match performed.and_then(|performed| performed.at(clips, seconds)) {
            Some((clip, clip_s)) => (Some(clip), clip_s),
            None => (self.clip, direction::within(self.duration_s, seconds * self.speed, true)),
        };
        // What moves as a whole needs no new questions: its matrix goes with it.
        if let Some(moved) = clip.and_then(|clip| self.figure.model().moving().rigid_at(clip, clip_s)) {
            place *= Affine3A::from_mat4(moved.as_affine3().into());
            clip = None;
        }
        let deforms = self.figure.go(clip, clip_s, place);
        let positions: Vec<Vec3> = self.figure.world_positions().collect();
        let (low, high) = positions.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |b, &p| (b.0.min(p), b.1.max(p)));
        self.bounds = (low, high);
        let field = hour
            .grid
            .and_then(|grid| grid.light_at(hour.moment, (low + high) * 0.5))
            .map(|around| Field::new(&around.sky_and_bounce));
        let suns = hour.grid.map(|grid| SunField::new(grid, hour.moment, low, high));
        let radiance = |direction| match &field {
            Some(field) => field.from(direction) * hour.exposure,
            None => sh::radiance(&hour.moment.sky, direction).max(Vec3::ZERO) * hour.exposure,
        };
        let bounds = ((low + high) * 0.5).extend(low.distance(high) * 0.5);
        let caster = Caster { bounds, lumps: self.figure.lumps(), faded: 0.0 };
        let Some(eyes) = eyes else {
            let level = directions.on_gpu(deforms);
            let pose = self.posed(clip, clip_s, deforms);
            let turn = self.figure.turn();
            let sphere = self.figure.sphere(level);
            let vertices = if deforms { positions.len() } else { 0 };
            let asked = Asked { directions: sphere.directions().len(), vertices, deforms };
            let on_gpu = OnGpu {
                pose,
                world_from_mesh: place,
                directions: sphere.directions().to_vec(),
                weights: sphere.weights().to_vec(),
                radiance: sphere.directions().iter().map(|&direction| radiance(turn * direction)).collect(),
                sun: hour.sun.map(|(direction, irradiance)| (turn.transpose() * direction, irradiance)),
                sun_field: suns,
                follow: heliodon_gpu::moving::follow(passed_s, FOLLOW_S),
            };
            return Ok((Shown { on_gpu: Some(on_gpu), caster, ..Shown::default() }, asked));
        };
        self.pose = None;
        let surroundings = Surroundings {
            radiance: &radiance,
            sun: hour.sun,
            sun_reaches: &|place| suns.as_ref().map_or(1.0, |suns| suns.at(place)),
        };
        let asked = self.figure.illuminate(eyes, directions, deforms, &surroundings, passed_s)?;
        let half =
            |(light, sun): (&Vec3, &f32)| light.extend(*sun).to_array().map(|v| f16::from_f32(v.clamp(0.0, 65504.0)).to_bits());
        let light = self.figure.light().iter().zip(self.figure.sun()).map(half).collect();
        let normals = if hour.lamps { self.figure.world_normals().map(octahedral).collect() } else { Vec::new() };
        Ok((Shown { positions, normals, light, on_gpu: None, caster, worn: Worn::NOTHING }, asked))
    }

    /// What a GPU poses it by.
    fn posed(&mut self, clip: Option<usize>, clip_s: f32, anew: bool) -> (u64, Arc<Palette>) {
        if let Some(pose) = self.pose.as_ref().filter(|_| !anew) {
            return (self.poses, Arc::clone(pose));
        }
        self.poses += 1;
        let mut palette = Palette::default();
        // Beyond its clips it is at rest.
        self.figure.model().moving().palette(clip.unwrap_or(usize::MAX), clip_s, &mut palette);
        (self.poses, Arc::clone(self.pose.insert(Arc::new(palette))))
    }
}

/// The light of a place at a moment, by a grid where one knows it, else the open sky's.
pub(crate) fn light_at(grid: Option<&Grid>, moment: &Moment, place: Vec3) -> AmbientCube {
    grid.and_then(|grid| grid.light_at(moment, place)).unwrap_or_else(|| {
        let open = |axis: Vec3| {
            let transfer = sh::open_transfer9(axis);
            let all = moment.sky.iter().zip(transfer).map(|(sky, transfer)| *sky * transfer);
            all.sum::<Vec3>().max(Vec3::ZERO)
        };
        AmbientCube { sky_and_bounce: AXES.map(open), sun_visible: 1.0 }
    })
}

/// Radiance that reaches a place from each direction, made of what surfaces there receive from it: the smoothest with which the six sides of a cube get just the light that the grid says,
/// so that an actor whose parts did not hide one another would be lit as the stone beside it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Field {
    mean: Vec3,
    /// By axis.
    slope: [Vec3; 3],
    bend: [Vec3; 3],
}

impl Field {
    /// Irradiance / pi takes the bands 0, 1 and 2 of radiance by 1, 2/3 and 1/4 (R. Ramamoorthi, P. Hanrahan: "An Efficient Representation for Irradiance
    /// Environment Maps", SIGGRAPH 2001): here they are given back.
    pub(crate) fn new(light: &[Vec3; 6]) -> Self {
        let mean = light.iter().sum::<Vec3>() / 6.0;
        let of_axis = |axis: usize| [light[2 * axis], light[2 * axis + 1]];
        let slope = [0, 1, 2].map(|axis| {
            let [ahead, behind] = of_axis(axis);
            (ahead - behind) * (0.5 * 3.0 / 2.0)
        });
        let bend = [0, 1, 2].map(|axis| {
            let [ahead, behind] = of_axis(axis);
            ((ahead + behind) * 0.5 - mean) * 4.0
        });
        Self { mean, slope, bend }
    }

    /// The mean, and by axis how it rises and how it bends: radiance from `d` is their sum, each rise times `d` of its axis and each bend times its square.
    pub(crate) fn terms(&self) -> [Vec3; 7] {
        let ([a, b, c], [d, e, f]) = (self.slope, self.bend);
        [self.mean, a, b, c, d, e, f]
    }

    fn from(&self, direction: Vec3) -> Vec3 {
        let of_axis = |axis: usize| (self.slope[axis] + self.bend[axis] * direction[axis]) * direction[axis];
        (self.mean + of_axis(0) + of_axis(1) + of_axis(2)).max(Vec3::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::light_sphere::LightSphere;

    #[test]
    fn a_cube_gets_back_the_light_that_it_was_made_of() {
        // a sky above a darker ground, with a bright side
        let light = [2.0, 1.2, 2.6, 0.9, 1.5, 1.4].map(|v: f32| Vec3::new(v, 0.9 * v, 1.3 * v));
        let field = Field::new(&light);
        let sphere = LightSphere::new(4);
        for (axis, wanted) in AXES.into_iter().zip(light) {
            let all = sphere.directions().iter().zip(sphere.weights());
            let sum: Vec3 = all.map(|(&l, &w)| field.from(l) * (w * l.dot(axis).max(0.0))).sum();
            let got = sum / std::f32::consts::PI;
            assert!((got - wanted).abs().max_element() < 0.01 * wanted.max_element(), "{axis}: {got} for {wanted}");
        }
        let even = Field::new(&[Vec3::ONE; 6]);
        assert!(sphere.directions().iter().all(|&l| even.from(l).abs_diff_eq(Vec3::ONE, 1e-6)));
    }
}
