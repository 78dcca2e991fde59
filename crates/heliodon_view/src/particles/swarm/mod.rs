//! Swarms: sources of so many particles that a processor would have to thin them, simulated and drawn by the GPU through bevy_hanabi.
//!
//! What is handed over is decided once for all of a bundle's sources, not by what is in sight, so that nothing changes as one looks around. It is a fact of a visit, never of a still or a
//! film: such particles live on the GPU from frame to frame and are not the same twice. Whoever has no device for it, or not yet its pipelines, sees the processor's particles, thinned.
//!
//! bevy_hanabi gives the buffers, the dead and the living, the births and the draws; the shaders within are ours (effect.rs), the clock is the visit's, births are counted here, as the
//! processor's are, and what it draws goes as light into the air's own picture instead of onto the camera's (render.rs).

mod effect;
pub(super) mod render;

use super::births::{Births, Span};
use super::light::Reached;
use super::source::Source;
use super::sun_map::{MOST_TEXELS, SunMap};
use super::{ArrangeAir, Particles, dust, plume};
use crate::actors::Actors;
use crate::costs::FrameTold;
use crate::lamps::Lamp;
use crate::lamps::reaching::Reach;
use crate::stage::ground::Ground;
use bevy::asset::RenderAssetUsages;
use bevy::camera::visibility::RenderLayers;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::render_resource::{Extent3d, TextureDimension, TextureFormat};
use bevy::render::renderer::{RenderAdapterInfo, RenderDevice};
use bevy_hanabi::{
    CompiledParticleEffect, EffectAsset, EffectMaterial, EffectProperties, EffectSimulation, EffectSimulationTime,
    EffectSpawner, EffectSystems, HanabiPlugin, ParticleEffect,
};
use effect::{BORN, EXTENT, FLOORS, PLACE, is_swarm_kind, of_vector};
use heliodon_bundle::site::{ParticleKind, Particles as Table};
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use wgpu::DeviceType;

/// Particles that all sources of a bundle together may want before any of them is a swarm.
const MANY: f64 = 20_000.0;
/// A source with fewer than this is none: each swarm takes some passes of its own.
const LEAST: f64 = 2_000.0;
/// Swarms at most, the largest.
const MOST_SWARMS: usize = 32;
/// Particles of a swarm at most; where there would be more, as many fewer are born. Each takes some 80 bytes, and portable storage buffers end at 128 MiB.
const MOST: f64 = 1_000_000.0;
/// Particles of all swarms together at most, some 350 MB: a source that would be beyond is none.
const MOST_TOGETHER: f64 = 4_000_000.0;
/// The longest that a frame may take before all begins anew, seconds; so it does where the time goes back.
const LONGEST_S: f64 = 1.0;
/// Nothing lives so long, seconds.
const GONE_S: f64 = 60.0;
/// Storage buffers that bevy_hanabi binds in a stage, and bind groups.
const MOST_BUFFERS: u32 = 8;
const GROUPS: u32 = 4;

/// Who simulates and draws the particles of sources that want very many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ParticlesBy {
    /// A GPU in visits; the processor in stills and films, and where a processor draws.
    #[default]
    Auto,
    /// The processor, which thins them.
    Processor,
    /// Whatever device draws, in stills too, which are then not the same twice.
    Device,
}

impl ParticlesBy {
    /// Adds what such a visit needs, [`SwarmPlugin`], to an app that is not yet running, if any of these sources may be a swarm: nothing is added, and costs, for others. [`Self::Device`] adds
    /// it whatever the sources are, for those that come later. From then on all of the app's effects of bevy_hanabi go by the visit's clock.
    ///
    /// # Panics
    /// If the app has no [`ParticlesPlugin`](super::ParticlesPlugin).
    pub fn prepare(self, app: &mut App, tables: &[Table]) {
        app.world_mut().resource_mut::<Particles>().options.by = self;
        let sources: Vec<Source> = tables.iter().zip(0..).map(|(table, number)| Source::new(table, number)).collect();
        let wanted = match self {
            Self::Auto => !swarms_of(&sources).is_empty(),
            Self::Processor => false,
            Self::Device => true,
        };
        if wanted && !app.is_plugin_added::<SwarmPlugin>() {
            app.add_plugins(SwarmPlugin);
        }
    }

    /// Why a device does not take swarms over, if so.
    fn refusal(self, info: &RenderAdapterInfo, limits: &wgpu::Limits) -> Option<String> {
        let lacks = |what, has: u32, needs: u32| {
            (has < needs).then(|| format!("{} has {has} {what} where {needs} are needed", info.name))
        };
        let software = self == Self::Auto && info.device_type == DeviceType::Cpu;
        software
            .then(|| format!("{} is a processor", info.name))
            .or_else(|| lacks("bind groups", limits.max_bind_groups, GROUPS))
            .or_else(|| lacks("storage buffers a stage", limits.max_storage_buffers_per_shader_stage, MOST_BUFFERS))
            .or_else(|| lacks("invocations a work group", limits.max_compute_invocations_per_workgroup, 64))
    }
}

/// Hands swarms over to the GPU. It is added by [`ParticlesBy::prepare`], and adds bevy_hanabi's [`HanabiPlugin`] unless the app has it: whoever wants effects of their own adds that before, not
/// afterwards. The clock of such effects is then the visit's, too: it stands and jumps with that.
#[derive(Default)]
pub struct SwarmPlugin;

impl Plugin for SwarmPlugin {
    fn build(&self, app: &mut App) {
        let told = FrameTold::in_app(app);
        if !app.is_plugin_added::<HanabiPlugin>() {
            app.add_plugins(HanabiPlugin);
        }
        app.init_resource::<Swarms>()
            .add_systems(PostUpdate, told.of("air", hand_over).after(EffectSystems::TickSpawners).before(ArrangeAir));
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            render::build(render_app);
        }
    }
}

/// How many of a source's particles a device would take over.
fn count(source: &Source) -> f64 {
    if !is_swarm_kind(source.kind) {
        return 0.0;
    }
    let births = births(source);
    (births.per_s * births.most_s).min(MOST)
}

/// The box of all that the device draws of a source: motes and puffs go beyond where they are looked for.
pub(super) fn drawn_bounds(source: &Source) -> (Vec3, Vec3) {
    match source.kind {
        ParticleKind::Dust => dust::mote_bounds(source),
        ParticleKind::Smoke => plume::puff_bounds(source),
        _ => source.bounds(),
    }
}

/// When the device's particles of a source are born. Motes always are: they come and go by their light.
fn births(source: &Source) -> Births {
    let births = super::births(source).unwrap_or_else(|| {
        let most_s = f64::from(dust::MOTE_S);
        let per_s = f64::from(dust::mote_count(source)) / most_s;
        Births { seed: source.seed, per_s, most_s, share: 1.0, span: Span::ALWAYS }
    });
    Births { per_s: births.per_s.min(MOST / births.most_s), ..births }
}

/// Numbers of those sources that are swarms.
fn swarms_of(sources: &[Source]) -> Vec<usize> {
    if sources.iter().map(super::count).sum::<f64>() <= MANY {
        return Vec::new();
    }
    let mut large: Vec<(f64, usize)> = sources.iter().map(count).zip(0..).filter(|(count, _)| *count >= LEAST).collect();
    large.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut room = MOST_TOGETHER;
    let fitting = large.into_iter().filter(|(count, _)| {
        let fits = *count <= room;
        room -= if fits { *count } else { 0.0 };
        fits
    });
    fitting.take(MOST_SWARMS).map(|(_, number)| number).collect()
}

impl Particles {
    /// Whether a device would be asked to take any of the sources over.
    pub(super) fn has_swarms(&self) -> bool {
        self.options.by != ParticlesBy::Processor && !swarms_of(&self.sources).is_empty()
    }
}

/// What is on the device.
#[derive(Resource, Default)]
pub struct Swarms {
    stage: u64,
    /// Whether the device takes any, once that is known.
    carries: Option<bool>,
    last_s: Option<f64>,
    flights: HashMap<usize, Flight>,
}

/// A source's particles on the device.
struct Flight {
    entity: Entity,
    /// What its shader knows of its light.
    light: Handle<Image>,
    capacity: u32,
    /// Whether those are there that were born before this frame.
    filled: bool,
    /// Whether the render world has all that draws it.
    drawable: Arc<AtomicBool>,
    /// Which lamps reach its middle.
    reach: Reach,
}

/// What the render world is told of a swarm that is in sight.
#[derive(Clone, Debug)]
pub struct SwarmShown {
    /// Its effect in the main world.
    pub entity: Entity,
    /// Where its shader looks its light up.
    pub light: AssetId<Image>,
    /// What is to be found there: see [`SwarmLight`].
    pub numbers: SwarmLight,
    /// And below it.
    pub map: Option<Arc<SunMap>>,
}

/// What the render world is told of a swarm of which nothing is there yet.
#[derive(Clone, Debug)]
pub struct SwarmUnready {
    /// Its effect in the main world.
    pub entity: Entity,
    /// To be told once it can be drawn.
    pub drawable: Arc<AtomicBool>,
}

/// The first row of a swarm's texture: rows of the map of the sun and its size (x, y, z: what reaches where it says nothing), the sun's exposed radiance and how much of the dust is
/// there, the direction to the sun, the exposed radiance from around and that of fire.
pub type SwarmLight = [Vec4; 7];

impl Swarms {
    /// Whether a source's particles are on the device.
    #[must_use]
    pub fn flies(&self, source: usize) -> bool {
        self.flights.get(&source).is_some_and(|flight| flight.filled)
    }

    /// Those of which nothing is there yet.
    pub fn unready(&self) -> impl Iterator<Item = SwarmUnready> {
        let unready = self.flights.values().filter(|flight| !flight.filled);
        unready.map(|flight| SwarmUnready { entity: flight.entity, drawable: Arc::clone(&flight.drawable) })
    }

    /// How many of a source's particles live there now, on the average.
    #[must_use]
    pub fn living(source: &Source, now_s: f64) -> usize {
        let births = births(source);
        let there_s = births.span.until_s.min(now_s) - births.span.since_s.max(now_s - births.most_s);
        // as each kind's lives are spread
        let part = match source.kind {
            ParticleKind::Sparks => 0.675,
            ParticleKind::Smoke => 0.85,
            _ => 1.0,
        };
        (births.per_s * there_s.max(0.0) * part) as usize
    }

    /// How a swarm is to be shown in the light that reaches it.
    pub fn shown(
        &mut self,
        (number, source): (usize, &Source),
        now_s: f64,
        (reached, map, sun): (&Reached<'_>, Option<&Arc<SunMap>>, Vec3),
        ground: Option<&Ground>,
    ) -> Option<SwarmShown> {
        let flight = self.flights.get_mut(&number)?;
        let of_lamps: Vec3 = match ground {
            Some(ground) => {
                let lamps: &[Lamp] = reached.lamps;
                flight.reach.of(source.place, lamps, ground).map(|(_, irradiance)| irradiance).sum()
            }
            None => Vec3::ZERO,
        };
        let of_lamps = of_lamps * (0.25 * reached.air.exposure);
        let (around, presence) = match source.kind {
            // scattered more than once, the light of the brightest side is that of all
            ParticleKind::Smoke => (reached.ambient.lerp(reached.brightest, 0.4) + of_lamps, 1.0),
            ParticleKind::Water => (reached.brightest + of_lamps, 1.0),
            _ => (Vec3::ZERO, source.span.presence(now_s, dust::SETTLES_S)),
        };
        // until it is known where the sun shines, there would be dust in the shade
        let unknown = if source.kind == ParticleKind::Dust { 0.0 } else { 1.0 };
        let size = map.map_or(Vec3::new(0.0, 0.0, unknown), |map| map.size().as_vec2().extend(1.0));
        let [x, y, depth] = map.map_or([Vec4::ZERO; 3], |map| map.texels_from_world());
        let light = [reached.air.sun.extend(presence), sun.extend(0.0), around.extend(reached.air.flame)];
        let [of_sun, sunward, around] = light;
        let numbers = [x, y, depth, size.extend(0.0), of_sun, sunward, around];
        Some(SwarmShown { entity: flight.entity, light: flight.light.id(), numbers, map: map.cloned() })
    }
}

/// What `hand_over` makes.
type Made<'w> = (ResMut<'w, Assets<EffectAsset>>, ResMut<'w, Assets<Image>>);

/// Begins and ends swarms, and counts this frame's births.
fn hand_over(
    mut commands: Commands,
    (mut swarms, particles, actors): (ResMut<Swarms>, Res<Particles>, Res<Actors>),
    (info, device): (Option<Res<RenderAdapterInfo>>, Option<Res<RenderDevice>>),
    mut time: ResMut<Time<EffectSimulation>>,
    (mut effects, mut images): Made<'_>,
    mut flying: Query<(&CompiledParticleEffect, &mut EffectSpawner, &mut EffectProperties)>,
) {
    let swarms = &mut *swarms;
    let by = particles.options.by;
    let carries = *swarms.carries.get_or_insert_with(|| {
        let (Some(info), Some(device)) = (info, device) else { return false };
        let refusal = by.refusal(&info, &device.limits());
        if let Some(why) = &refusal {
            warn!("very many particles are thinned, and drawn by the processor: {why}");
        }
        refusal.is_none()
    });
    let now_s = actors.seconds;
    let renewed = swarms.stage != particles.stage;
    swarms.stage = particles.stage;
    let wanted: Vec<usize> = match carries && particles.options.asks_device() {
        false => Vec::new(),
        true if particles.knows_water() => swarms_of(&particles.sources),
        // until it is known how much of it there is at a time, all stays as it is
        true if renewed => Vec::new(),
        true => swarms.flights.keys().copied().collect(),
    };
    let seen = |number: &usize| {
        let source = &particles.sources[*number];
        source.span.is_seen(now_s, super::life_s(source))
    };
    let wanted: Vec<usize> = wanted.into_iter().filter(seen).collect();
    swarms.flights.retain(|number, flight| {
        let kept = !renewed && wanted.contains(number);
        if !kept {
            commands.entity(flight.entity).despawn();
        }
        kept
    });
    for &number in &wanted {
        swarms
            .flights
            .entry(number)
            .or_insert_with(|| Flight::start(&particles.sources[number], &mut commands, &mut effects, &mut images));
    }
    // the clock is the visit's: it stands and jumps with that
    let passed_s = swarms.last_s.map_or(0.0, |last_s| now_s - last_s);
    let jumped = !(0.0..=LONGEST_S).contains(&passed_s);
    time.pause();
    time.advance_by(Duration::from_secs_f64(if jumped { GONE_S } else { passed_s }));
    swarms.last_s = Some(now_s);
    for (number, flight) in &mut swarms.flights {
        let Ok((compiled, mut spawner, properties)) = flying.get_mut(flight.entity) else { continue };
        let source = &particles.sources[*number];
        let births = births(source);
        let since_s = if flight.filled { now_s - passed_s } else { now_s - births.most_s };
        // what was there is gone by this frame's end, and what were born in it
        let is_ready = || compiled.is_ready() && flight.drawable.load(Ordering::Relaxed);
        flight.filled = !jumped && (flight.filled || is_ready());
        let (count, ages) = if flight.filled { born(&births, since_s, now_s) } else { (0, Vec2::ZERO) };
        spawner.active = false;
        spawner.spawn_count = count.min(flight.capacity);
        tell(source, now_s, ages, properties);
    }
}

/// How many are born from one time until another, and of what ages they are then.
fn born(births: &Births, since_s: f64, now_s: f64) -> (u32, Vec2) {
    let (from_s, until_s) = (since_s.max(births.span.since_s), now_s.min(births.span.until_s));
    if from_s >= until_s {
        return (0, Vec2::ZERO);
    }
    let count = (until_s * births.per_s).floor() - (from_s * births.per_s).floor();
    (count as u32, Vec2::new((now_s - until_s) as f32, (now_s - from_s) as f32))
}

/// Tells a swarm's shaders of its source.
fn tell(source: &Source, now_s: f64, ages: Vec2, mut properties: Mut<'_, EffectProperties>) {
    // numbers that single precision has to the millisecond
    let (hour_s, salt) = (now_s.rem_euclid(3600.0) as f32, (source.seed & 0xffff) as f32);
    let mut set = |name: &str, value: Vec4| {
        if properties.get_stored(name) != Some(of_vector(value)) {
            properties.set(name, of_vector(value));
        }
    };
    set(PLACE, source.place.extend(source.size));
    set(EXTENT, source.extent.extend(source.width_m()));
    set(BORN, Vec4::new(ages.x, ages.y, hour_s, salt));
    for (name, heights) in FLOORS.iter().zip(source.floors().chunks(4)) {
        set(name, Vec4::from_array(std::array::from_fn(|k| heights.get(k).copied().unwrap_or_default())));
    }
}

impl Flight {
    fn start(source: &Source, commands: &mut Commands, effects: &mut Assets<EffectAsset>, images: &mut Assets<Image>) -> Self {
        let capacity = (count(source) * 1.05) as u32 + 64;
        let effect = effects.add(effect::effect(source, capacity));
        let size = Extent3d { width: MOST_TEXELS, height: MOST_TEXELS + 1, depth_or_array_layers: 1 };
        let (usage, format) = (RenderAssetUsages::RENDER_WORLD, TextureFormat::Rgba8Unorm);
        let light = images.add(Image::new_fill(size, TextureDimension::D2, &[0; 4], format, usage));
        let spawner = effects.get(&effect).map(|effect| EffectSpawner::new(&effect.spawner).with_active(false));
        let mut made = commands.spawn((
            ParticleEffect { handle: effect, prng_seed: Some(source.seed) },
            EffectMaterial { images: vec![light.clone()] },
            EffectProperties::default(),
            // no camera looks at it: swarms are seen in views of our own (render.rs)
            RenderLayers::none(),
        ));
        if let Some(spawner) = spawner {
            made.insert(spawner);
        }
        Self { entity: made.id(), light, capacity, filled: false, drawable: Arc::default(), reach: Reach::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::source::tests::source;

    fn sources(kinds: &[(ParticleKind, f32)]) -> Vec<Source> {
        kinds.iter().map(|&(kind, density)| Source { density, ..source(kind, Vec3::ZERO) }).collect()
    }

    #[test]
    fn only_what_is_large_among_very_many_is_a_swarm() {
        let few = vec![(ParticleKind::Sparks, 1.0); 250];
        assert!(swarms_of(&sources(&few)).is_empty(), "all together are not many");
        let small = vec![(ParticleKind::Sparks, 1.0); 1000];
        assert!(swarms_of(&sources(&small)).is_empty(), "a thousand small ones");
        let fire = (ParticleKind::Fire, 500.0);
        let mixed = [(ParticleKind::Sparks, 1.0), (ParticleKind::Sparks, 50.0), (ParticleKind::Smoke, 250.0), fire];
        assert_eq!(swarms_of(&sources(&mixed)), [2, 1], "from the largest on, and fire is none");
        assert!(swarms_of(&sources(&mixed[..2])).is_empty());
    }

    #[test]
    fn all_swarms_together_have_room() {
        let dust = |density| Source { density, extent: Vec3::splat(9.0), ..source(ParticleKind::Dust, Vec3::ZERO) };
        let sparks = |density| Source { density, ..source(ParticleKind::Sparks, Vec3::ZERO) };
        assert_eq!(swarms_of(&vec![dust(500.0); 6]), [0, 1, 2, 3], "a million each");
        let all = [sparks(500.0), dust(500.0), dust(500.0), dust(380.0), dust(500.0), sparks(100.0)];
        let swarms = swarms_of(&all);
        assert_eq!(swarms, [1, 2, 4, 3, 5], "36,000 are beyond, and what is smaller still fits");
        let together: f64 = swarms.iter().map(|&number| count(&all[number])).sum();
        assert!(together <= MOST_TOGETHER && together + count(&all[0]) > MOST_TOGETHER, "{together}");
    }

    #[test]
    fn births_of_frames_are_those_of_all_their_time() {
        let mut source = source(ParticleKind::Sparks, Vec3::ZERO);
        (source.density, source.span) = (300.0, Span { since_s: 2.0, until_s: 4.0 });
        let births = births(&source);
        let times: Vec<f64> = (0..=60).map(|frame| 1.0 + f64::from(frame) / 12.0).collect();
        let all: u32 = times.windows(2).map(|pair| born(&births, pair[0], pair[1]).0).sum();
        assert_eq!(f64::from(all), (4.0 * births.per_s).floor() - (2.0 * births.per_s).floor());
        let (count, ages) = born(&births, 3.0, 5.0);
        assert!(count > 0 && ages == Vec2::new(1.0, 2.0), "{ages}");
        assert_eq!(born(&births, 5.0, 6.0).0, 0);
        assert_eq!(born(&births, 3.0, 3.0).0, 0, "time stands still");
    }

    #[test]
    fn no_source_has_more_than_a_buffer_holds() {
        let source = Source { density: 500.0, extent: Vec3::splat(9.0), ..source(ParticleKind::Dust, Vec3::ZERO) };
        assert!(f64::from(dust::mote_count(&source)) > MOST && count(&source) < MOST + 1.0);
    }
}
