//! What is in the air: dust in the sun's beams, smoke, fire, sparks, water.
//!
//! A source's particles are a closed function of the time since the visit began (births.rs), worked out on the processor in every frame: a picture of any moment is the same whatever was
//! drawn before, and nothing has to be kept, told or read back. Some thousands are a millisecond. They are drawn as soft quads that face the eye, after
//! everything else, as light rather than as display values (render.rs), and are lit as what stands beside them is: by the light grid or the sky that is
//! open there, and by the sun where its own map of the monument says that it shines (sun_map.rs).

mod births;
mod dust;
mod light;
mod plume;
pub(crate) mod quad;
pub(crate) mod render;
mod shower;
mod source;
mod sun_map;
mod swarm;

use crate::actors::Actors;
use crate::costs::FrameTold;
use crate::daylight::view::frustum_planes;
use crate::daylight::{DaylightCamera, StereoPair};
use crate::impostor::{Head, heads};
use crate::lamps::{Lamp, Lamps, SettleLamps, uniform};
use crate::over_stone::let_depth_be_read;
use crate::stage::Stage;
use crate::stage::background::Background;
use crate::stage::frame::StageFrame;
use crate::story::Wishes;
use crate::time_lapse::{Now, SettleMoment};
use bevy::camera::Camera;
use bevy::core_pipeline::schedule::{Core3d, Core3dSystems};
use bevy::prelude::*;
use bevy::render::extract_resource::ExtractResourcePlugin;
use bevy::render::{Render, RenderApp, RenderSystems};
use births::Births;
use heliodon_bundle::site::ParticleKind;
use heliodon_script::action::Action;
use light::{AirLight, Reached, ambient};
use quad::Quad;
use rayon::prelude::*;
use render::{AirFrame, AirHead};
use source::Source;
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;
use sun_map::SunMap;
use swarm::Swarms;
pub use swarm::{ParticlesBy, SwarmPlugin};

/// Sources that have a map of the sun at most: the nearest.
const MOST_MAPS: usize = 12;
/// How far the sun goes on until a map is made anew, as the cosine: a quarter of a degree, half the sun's width.
const SAME_SUN: f32 = 0.999_990_5;
/// Fires that light what is around them at most: each costs six maps of its shadows.
const MOST_FIRES: usize = 4;
/// Sources that are looked around in a frame, each by some fifty rays.
const LOOKS_A_FRAME: usize = 4;
/// Where a source is smaller than this, pixels, it has as much fewer particles,
const WHOLE_PX: f32 = 90.0;
/// but never less than this share.
const LEAST_SHARE: f32 = 0.12;

/// What is in the air of the bundle on the stage.
#[derive(Resource, Default)]
pub struct Particles {
    /// How it is shown.
    pub options: ParticlesOptions,
    stage: u64,
    sources: Vec<Source>,
    /// Radiance of white at the day's brightest hour.
    white: f32,
    maps: HashMap<usize, Arc<SunMap>>,
    making: Option<(usize, Background<SunMap>)>,
    told: ParticlesTold,
}

/// How particles are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParticlesOptions {
    /// Particles of a frame at most; where there would be more, all sources have as much fewer, and those that are left out cost nothing. A thousand take about a tenth of a millisecond of a
    /// processor's core, and of a GPU's as much.
    pub most: usize,
    /// Whether a frame waits for what it needs, as stills and films do.
    pub wait: bool,
    /// Who simulates sources that want very many; what it needs is added by [`ParticlesBy::prepare`].
    pub by: ParticlesBy,
}

impl Default for ParticlesOptions {
    fn default() -> Self {
        Self { most: 12_000, wait: false, by: ParticlesBy::Auto }
    }
}

impl ParticlesOptions {
    /// Whether a device is asked to take swarms over.
    fn asks_device(self) -> bool {
        self.by == ParticlesBy::Device || (self.by == ParticlesBy::Auto && !self.wait)
    }
}

/// What the particles of a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ParticlesTold {
    /// Sources that a camera may see.
    pub sources: usize,
    /// Particles that were drawn.
    pub particles: usize,
    /// How many of them by the device, as far as is known here: they are counted where they live.
    pub by_device: usize,
    /// Maps of the sun that they were lit by.
    pub maps: usize,
    /// Milliseconds that the processor took.
    pub ms: f32,
}

impl Particles {
    /// What the last frame took.
    #[must_use]
    pub fn told(&self) -> ParticlesTold {
        self.told
    }

    /// Adds a source to those of the bundle, until another is opened.
    pub fn add(&mut self, table: &heliodon_bundle::site::Particles) {
        self.sources.push(Source::new(table, self.sources.len() as u32));
    }

    /// Starts sources of a name, at a time in seconds as [`Actors::seconds`] has it; whether there is any.
    pub fn start(&mut self, name: &str, now_s: f64) -> bool {
        self.each(name, |source| source.span.start(now_s))
    }

    /// Stops them: what is there dies out.
    pub fn stop(&mut self, name: &str, now_s: f64) -> bool {
        self.each(name, |source| source.span.stop(now_s))
    }

    fn each(&mut self, name: &str, act: impl Fn(&mut Source)) -> bool {
        let mut named = self.sources.iter_mut().filter(|source| source.name == name).peekable();
        let any = named.peek().is_some();
        named.for_each(act);
        any
    }
}

/// Quads that others lay into the air, anew in every frame before [`ArrangeAir`].
#[derive(Resource, Default)]
pub(crate) struct AlsoInTheAir(pub Vec<Quad>);

/// Settles what is in the air of a frame.
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub struct ArrangeAir;

/// Shows what is in the air.
#[derive(Default)]
pub struct ParticlesPlugin;

impl Plugin for ParticlesPlugin {
    fn build(&self, app: &mut App) {
        let told = FrameTold::in_app(app);
        app.init_resource::<Particles>()
            .init_resource::<AlsoInTheAir>()
            .init_resource::<AirFrame>()
            .add_plugins(ExtractResourcePlugin::<AirFrame>::default())
            .add_systems(Update, follow_stage)
            .add_systems(
                PostUpdate,
                (
                    let_depth_be_read,
                    (told.of("air", obey), told.of("air", burn).in_set(SettleLamps), told.of("air", arrange))
                        .chain()
                        .in_set(ArrangeAir)
                        .after(SettleMoment)
                        .after(bevy::transform::TransformSystems::Propagate)
                        .after(bevy::camera::CameraUpdateSystems),
                ),
            );
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_resource::<render::AirGpu>()
            .add_systems(
                Render,
                told.of("air", render::prepare)
                    .in_set(RenderSystems::PrepareResources)
                    .after(crate::daylight::prepare::prepare_views),
            )
            .add_systems(Core3d, render::draw.in_set(Core3dSystems::EarlyPostProcess));
    }
}

/// Takes up the sources of another bundle.
fn follow_stage(stage: Res<Stage>, swarms: Option<Res<Swarms>>, mut particles: ResMut<Particles>) {
    if particles.stage == stage.serial() {
        return;
    }
    *particles = Particles { options: particles.options, stage: stage.serial(), ..default() };
    let Some(bundle) = stage.bundle() else { return };
    particles.white = light::brightest_white(bundle.lapse());
    particles.sources = bundle.living().particles.iter().zip(0..).map(|(table, number)| Source::new(table, number)).collect();
    if swarms.is_none() && !particles.options.wait && particles.has_swarms() {
        warn!(
            "very many particles are thinned, and drawn by the processor: `ParticlesBy::prepare` knew of none when the visit began"
        );
    }
}

/// Starts and stops what scripts ask for.
fn obey(wishes: Option<ResMut<Wishes>>, actors: Res<Actors>, mut particles: ResMut<Particles>) {
    let Some(mut wishes) = wishes.filter(|wishes| !wishes.particles.is_empty()) else { return };
    for wish in std::mem::take(&mut wishes.particles) {
        let (name, known) = match &wish {
            Action::StartParticles { particles: name } => (name, particles.start(name, actors.seconds)),
            Action::StopParticles { particles: name } => (name, particles.stop(name, actors.seconds)),
            _ => continue,
        };
        if !known {
            warn_once!("there are no particles {name}");
        }
    }
}

/// Fires light what is around them, the nearest first: there are but few lamps at a time.
fn burn(
    (particles, actors, stage_frame): (Res<Particles>, Res<Actors>, Res<StageFrame>),
    lamps: Option<ResMut<Lamps>>,
    cameras: Eyes<'_, '_>,
) {
    let Some(mut lamps) = lamps else { return };
    let eyes: Vec<Vec3> =
        cameras.iter().filter(|(_, camera, ..)| camera.is_active).map(|(_, _, transform, _)| transform.translation()).collect();
    let off = |source: &Source| eyes.iter().map(|eye| eye.distance(source.place)).fold(f32::INFINITY, f32::min);
    let fires = particles.sources.iter().filter(|source| source.kind == ParticleKind::Fire);
    let mut fires: Vec<(f32, &Source)> = fires.map(|source| (off(source), source)).collect();
    fires.sort_by(|a, b| a.0.total_cmp(&b.0));
    let radiance = light::flame_radiance(particles.white, stage_frame.exposure_stops.exp2());
    let lit = fires.into_iter().filter_map(|(_, source)| plume::fire_light(source, actors.seconds, radiance));
    let lit: Vec<_> = lit.take(MOST_FIRES).collect();
    if lamps.fires != lit {
        lamps.fires = lit;
    }
}

/// What is seen from.
type Eyes<'w, 's> =
    Query<'w, 's, (Entity, &'static Camera, &'static GlobalTransform, Option<&'static StereoPair>), With<DaylightCamera>>;

/// Works out what every head sees.
fn arrange(
    (stage, now, stage_frame): (Res<Stage>, Res<Now>, Res<StageFrame>),
    (actors, lamps): (Res<Actors>, Option<Res<Lamps>>),
    (mut particles, mut swarms): (ResMut<Particles>, Option<ResMut<Swarms>>),
    mut also: ResMut<AlsoInTheAir>,
    mut frame: ResMut<AirFrame>,
    cameras: Eyes<'_, '_>,
) {
    let start = Instant::now();
    let Some(moment) = &now.moment else { return };
    let particles = &mut *particles;
    let mut quads = std::mem::take(&mut also.0);
    let mut boxes: Vec<(Vec3, Vec3)> = quad::bounds(&quads).into_iter().collect();
    if particles.sources.is_empty() && quads.is_empty() {
        if !(frame.quads.is_empty() && frame.swarms.is_empty() && frame.unready.is_empty()) {
            *frame = AirFrame::default();
        }
        particles.told = ParticlesTold::default();
        return;
    }
    let now_s = actors.seconds;
    let active = || cameras.iter().filter(|(_, camera, ..)| camera.is_active);
    let heads = heads(active());
    let mut seen = particles.seen(&cameras, &heads, now_s);
    particles.look_around(&stage, &seen);
    let air = AirLight::new(moment, now.has_sun, stage_frame.exposure_stops, particles.white);
    let lit: Vec<usize> = if now.has_sun { particles.follow_sun(&stage, &seen, moment.sun_direction) } else { Vec::new() };
    let flies = |swarms: &Option<ResMut<Swarms>>, number: usize| swarms.as_ref().is_some_and(|swarms| swarms.flies(number));
    seen.iter_mut().for_each(|seen| seen.flies = flies(&swarms, seen.source));
    particles.share(&mut seen);
    let maps: Vec<Arc<SunMap>> = lit.iter().filter_map(|number| particles.maps.get(number)).cloned().collect();
    let lamps: Vec<Lamp> = lamps.map_or_else(Vec::new, |lamps| uniform::lit(lamps.all()));
    let reached = |seen: &Seen| {
        let source = &particles.sources[seen.source];
        let openness = source.around.as_ref().map_or(1.0, |around| around.openness);
        let map = lit.iter().position(|number| *number == seen.source);
        // smoke is where it has risen to
        let risen = if source.kind == ParticleKind::Smoke { Vec3::Y * 1.5 } else { Vec3::ZERO };
        let (mean, brightest) = ambient(moment, actors.grid(), source.place + risen, openness);
        Reached {
            air,
            ambient: mean * air.exposure,
            brightest: brightest * air.exposure,
            map: map.map(|map| (&*maps[map], map as u32)),
            lamps: &lamps,
        }
    };
    let made: Vec<Vec<Quad>> = seen
        .par_iter()
        .map(|seen| {
            let (source, reached) = (&particles.sources[seen.source], reached(seen));
            let mut out = Vec::new();
            match source.kind {
                ParticleKind::Dust => dust::dust(source, (seen.share, seen.flies), now_s, &reached, &mut out),
                _ if seen.flies => {}
                ParticleKind::Smoke => plume::smoke(source, seen.share, now_s, &reached, &mut out),
                ParticleKind::Fire => plume::fire(source, seen.share, now_s, &reached, &mut out),
                ParticleKind::Sparks => shower::sparks(source, seen.share, now_s, &reached, &mut out),
                ParticleKind::Water => shower::water(source, seen.share, now_s, &reached, &mut out),
            }
            out
        })
        .collect();
    let (mut shown, mut unready) = (Vec::new(), Vec::new());
    let mut by_device = 0;
    if let Some(swarms) = &mut swarms {
        unready.extend(swarms.unready());
        for seen in seen.iter().filter(|seen| seen.flies) {
            let (source, reached) = (&particles.sources[seen.source], reached(seen));
            let map = reached.map.map(|(_, number)| &maps[number as usize]);
            let light = (&reached, map, moment.sun_direction);
            shown.extend(swarms.shown((seen.source, source), now_s, light, stage.footing()));
            by_device += Swarms::living(source, now_s);
            boxes.push(swarm::drawn_bounds(source));
        }
    }
    boxes.extend(made.iter().filter_map(|quads| quad::bounds(quads)));
    made.into_iter().for_each(|mut more| quads.append(&mut more));
    particles.told =
        ParticlesTold { sources: seen.len(), particles: quads.len() + by_device, by_device, maps: maps.len(), ms: 0.0 };
    let heads = heads.iter().map(|head| {
        let (haze, order) = from_afar(head.place, &quads);
        AirHead { cameras: head.cameras.clone(), order, haze }
    });
    let (heads, fine) = (Arc::new(heads.collect()), particles.options.wait);
    let (quads, boxes, swarms, unready) = (Arc::new(quads), Arc::new(boxes), Arc::new(shown), Arc::new(unready));
    *frame = AirFrame { quads, boxes, heads, maps, sun_direction: moment.sun_direction, fine, swarms, unready };
    particles.told.ms = start.elapsed().as_secs_f32() * 1e3;
}

/// Numbers of quads: first of those of haze, which is light that is added and has no order, and how many they are; then of the others from the farthest on.
fn from_afar(eye: Vec3, quads: &[Quad]) -> (u32, Vec<u32>) {
    let (mut haze, mut far): (Vec<u32>, Vec<(f32, u32)>) = (Vec::new(), Vec::new());
    for (quad, number) in quads.iter().zip(0..) {
        if quad.is_haze() {
            haze.push(number);
        } else {
            far.push((quad.middle().distance_squared(eye), number));
        }
    }
    far.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let count = haze.len() as u32;
    haze.extend(far.into_iter().map(|(_, number)| number));
    (count, haze)
}

/// A source that a camera may see.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Seen {
    source: usize,
    /// To the nearest head, metres.
    distance_m: f32,
    /// The share of its particles that is shown.
    share: f32,
    /// Whether the device has them: all but what dust is a haze of.
    flies: bool,
}

impl Particles {
    /// The sources that cameras may see, from the nearest on.
    fn seen(&self, cameras: &Eyes<'_, '_>, heads: &[Head], now_s: f64) -> Vec<Seen> {
        let looks: Vec<([Vec4; 5], f32)> = cameras
            .iter()
            .filter(|(_, camera, ..)| camera.is_active)
            .map(|(_, camera, transform, _)| {
                let clip_from_view = camera.clip_from_view();
                let clip_from_world = clip_from_view * transform.to_matrix().inverse();
                let rows = camera.physical_viewport_size().map_or(1080.0, |size| size.y as f32);
                (frustum_planes(&clip_from_world), clip_from_view.y_axis.y * 0.5 * rows)
            })
            .collect();
        let pixels = looks.iter().map(|look| look.1).fold(0.0, f32::max);
        let mut seen: Vec<Seen> = Vec::new();
        for (number, source) in self.sources.iter().enumerate() {
            let (low, high) = source.bounds();
            let (center, half) = ((low + high) * 0.5, (high - low) * 0.5);
            let is_in = |planes: &[Vec4; 5]| {
                planes.iter().all(|plane| {
                    let normal = plane.truncate();
                    normal.dot(center) + plane.w >= -normal.abs().dot(half)
                })
            };
            if !(source.span.is_seen(now_s, life_s(source)) && looks.iter().any(|look| is_in(&look.0))) {
                continue;
            }
            let distance = |head: &Head| head.place.distance(head.place.clamp(low, high));
            let distance_m = heads.iter().map(distance).fold(f32::INFINITY, f32::min);
            let shown_px = half.length() * pixels / distance_m.max(0.1);
            let share = (shown_px / WHOLE_PX).clamp(LEAST_SHARE, 1.0);
            seen.push(Seen { source: number, distance_m, share, flies: false });
        }
        seen.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
        seen
    }

    /// Looks at what surrounds those that are seen, once all of the stone is there; where a device may be asked, at what is beneath all water, for that says how much of it falls at a time.
    fn look_around(&mut self, stage: &Stage, seen: &[Seen]) {
        let Some(ground) = stage.footing() else { return };
        let most = if self.options.wait { usize::MAX } else { LOOKS_A_FRAME };
        let is_unknown = |number: &usize| self.sources[*number].around.is_none();
        let unknown: Vec<usize> = seen.iter().map(|seen| seen.source).filter(is_unknown).collect();
        let asked = self.options.asks_device();
        let water = (0..self.sources.len()).filter(|&number| asked && self.sources[number].kind == ParticleKind::Water);
        let unseen = water.filter(is_unknown).filter(|number| !unknown.contains(number));
        let unknown: Vec<usize> = unknown.iter().copied().chain(unseen).take(most).collect();
        unknown.into_iter().for_each(|number| self.sources[number].look_around(ground));
    }

    /// Whether it is known how far all water falls.
    fn knows_water(&self) -> bool {
        self.sources.iter().all(|source| source.kind != ParticleKind::Water || source.around.is_some())
    }

    /// Makes maps of the sun for the nearest sources that need one, a frame at a time; answers the sources that have one.
    fn follow_sun(&mut self, stage: &Stage, seen: &[Seen], sun: Vec3) -> Vec<usize> {
        let Some(ground) = stage.footing() else { return Vec::new() };
        if let Some((number, made)) = self.making.as_ref().and_then(|(number, making)| Some((*number, making.take()?))) {
            self.making = None;
            match made {
                Ok(map) => {
                    self.maps.insert(number, Arc::new(map));
                }
                Err(_) => warn_once!("a map of the sun could not be made: its thread broke off"),
            }
        }
        let needs = |kind: ParticleKind| matches!(kind, ParticleKind::Dust | ParticleKind::Smoke | ParticleKind::Water);
        let wanted = seen.iter().map(|seen| seen.source).filter(|&number| needs(self.sources[number].kind));
        let wanted: Vec<usize> = wanted.take(MOST_MAPS).collect();
        self.maps.retain(|number, _| wanted.contains(number));
        // the one that is farthest from where the sun is now
        let behind = |number: usize| self.maps.get(&number).map_or(-2.0, |map| map.sun.dot(sun));
        let mut stale: Vec<usize> = wanted.iter().copied().filter(|&number| behind(number) < SAME_SUN).collect();
        stale.sort_by(|&a, &b| behind(a).total_cmp(&behind(b)));
        if self.options.wait {
            // to the bit as if nothing had been drawn before
            let exact = |&number: &usize| self.maps.get(&number).is_none_or(|map| map.sun != sun);
            let stale: Vec<usize> = wanted.iter().copied().filter(exact).collect();
            let made: Vec<(usize, SunMap)> =
                stale.par_iter().map(|&number| (number, SunMap::new(ground, self.sources[number].bounds(), sun))).collect();
            self.maps.extend(made.into_iter().map(|(number, map)| (number, Arc::new(map))));
        } else if let (None, Some(&number)) = (&self.making, stale.first()) {
            let (ground, bounds) = (ground.clone(), self.sources[number].bounds());
            self.making = Some((number, Background::start(move || SunMap::new(&ground, bounds, sun))));
        }
        wanted.into_iter().filter(|number| self.maps.contains_key(number)).collect()
    }

    /// Divides the particles that a frame has among those that are seen.
    fn share(&self, seen: &mut [Seen]) {
        let here = |seen: &Seen| {
            let source = &self.sources[seen.source];
            match (seen.flies, source.kind) {
                (false, _) => count(source),
                (true, ParticleKind::Dust) => slices(source),
                (true, _) => 0.0,
            }
        };
        let wanted: f64 = seen.iter().map(|seen| f64::from(seen.share) * here(seen)).sum();
        let part = (self.options.most as f64 / wanted.max(1.0)).min(1.0) as f32;
        seen.iter_mut().for_each(|seen| seen.share *= part);
    }
}

fn births(source: &Source) -> Option<Births> {
    match source.kind {
        ParticleKind::Dust => None,
        ParticleKind::Smoke => Some(plume::smoke_births(source, 1.0)),
        ParticleKind::Fire => Some(plume::fire_births(source, 1.0)),
        ParticleKind::Sparks => Some(shower::spark_births(source, 1.0)),
        ParticleKind::Water => Some(shower::drop_births(source, 1.0)),
    }
}

/// How long anything of a source lives, seconds.
fn life_s(source: &Source) -> f64 {
    births(source).map_or(dust::SETTLES_S, |births| births.most_s)
}

/// How many particles a source has at the most.
fn count(source: &Source) -> f64 {
    births(source).map_or_else(|| f64::from(dust::mote_count(source)) + slices(source), |births| births.per_s * births.most_s)
}

/// How many slices of haze dust has at the most.
fn slices(source: &Source) -> f64 {
    dust::cells(source, 1.0).0.iter().map(|&n| f64::from(n)).product()
}

#[cfg(test)]
mod tests {
    use super::*;
    use source::tests::source;

    #[test]
    fn a_thousand_sources_share_what_a_frame_has() {
        let kinds = [ParticleKind::Dust, ParticleKind::Smoke, ParticleKind::Fire, ParticleKind::Sparks, ParticleKind::Water];
        let place = |number: usize| Vec3::new(number as f32, 0.0, 0.0);
        let sources = (0..1000).map(|number| source(kinds[number % 5], place(number))).collect();
        let particles = Particles { sources, ..default() };
        let mut seen: Vec<Seen> = (0..1000).map(|source| Seen { source, distance_m: 1.0, share: 1.0, flies: false }).collect();
        particles.share(&mut seen);
        let light = light::tests::noon();
        let mut out = Vec::new();
        for seen in &seen {
            let source = &particles.sources[seen.source];
            match source.kind {
                ParticleKind::Dust => dust::dust(source, (seen.share, false), 3.0, &light, &mut out),
                ParticleKind::Smoke => plume::smoke(source, seen.share, 3.0, &light, &mut out),
                ParticleKind::Fire => plume::fire(source, seen.share, 3.0, &light, &mut out),
                ParticleKind::Sparks => shower::sparks(source, seen.share, 3.0, &light, &mut out),
                ParticleKind::Water => shower::water(source, seen.share, 3.0, &light, &mut out),
            }
        }
        // what splashes is four where it was one
        assert!(out.len() > 2000 && out.len() < 2 * particles.options.most, "{}", out.len());
    }

    #[test]
    fn the_farthest_come_first() {
        let quads = [1.0, 5.0, 3.0].map(|z| Quad::new(quad::Shape::Mote, Vec3::Z * z, 0.1, 0.0));
        assert_eq!(from_afar(Vec3::ZERO, &quads), (0, vec![1, 2, 0]));
        // haze has no order and comes first
        let hazy = [quads[0], Quad::new(quad::Shape::Haze, Vec3::X, 0.1, 0.0), quads[1]];
        assert_eq!(from_afar(Vec3::ZERO, &hazy), (1, vec![1, 2, 0]));
    }

    #[test]
    fn scripts_start_and_stop_what_they_name() {
        let mut particles = Particles { sources: vec![source(ParticleKind::Fire, Vec3::ZERO)], ..default() };
        assert!(particles.stop("source", 4.0) && !particles.start("sauce", 4.0));
        assert!(!particles.sources[0].span.is_seen(9.0, 2.0));
        assert!(particles.start("source", 10.0) && particles.sources[0].span.is_seen(10.0, 2.0));
    }
}
