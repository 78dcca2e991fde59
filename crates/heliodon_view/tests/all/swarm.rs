//! Sources of very many particles, simulated and drawn by the device (a software one will do).

#![expect(clippy::unwrap_used, reason = "a test ends where something fails")]

use crate::common;
use bevy::prelude::{App, Entity, Msaa, Plugin, With};
use bevy::render::RenderApp;
use bevy::render::render_resource::PipelineCache;
use bevy::render::renderer::{RenderAdapter, RenderDevice};
use bevy_hanabi::HanabiPlugin;
use glam::Vec3;
use heliodon_bundle::site::{ParticleKind, Particles as Table};
use heliodon_image::HdrImage;
use heliodon_script::action::Action;
use heliodon_view::headless::{RenderOptions, Renderer, Shot};
use heliodon_view::particles::{Particles, ParticlesBy, ParticlesTold};
use heliodon_view::story::Wishes;
use heliodon_view::{DaylightCamera, Pose};
use std::time::Duration;
use tempfile::TempDir;

const SIZE: [u32; 2] = [200, 150];
const NOON_S: f64 = 12.0 * 3600.0;
/// Before the court's columns.
const PLACE: Vec3 = Vec3::new(0.0, 1.0, 8.0);
/// Frames in which pipelines are there, and the particles with them.
const SOON: u32 = 60;

/// A court of columns.
struct Scene {
    _folder: TempDir,
    renderer: Renderer,
    shot: Shot,
}

impl Scene {
    fn new(by: ParticlesBy) -> Self {
        Self::with(by, |_| {})
    }

    fn with(by: ParticlesBy, before: impl FnOnce(&mut App)) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let bundle = folder.path().join("court");
        common::Court { quads: 40, sun_steps: 4, sky_columns: 64, ..common::Court::small() }.write(&bundle).unwrap();
        let options = RenderOptions { samples: 1 };
        let prepare = |app: &mut App| {
            before(app);
            by.prepare(app, &[]);
        };
        let renderer = Renderer::with(&bundle, SIZE, options, prepare).unwrap();
        let pose = Pose::looking(PLACE + Vec3::new(0.4, 0.6, 4.0), PLACE + Vec3::Y * 0.4);
        let shot = Shot { pose, fov_deg: 50.0, actors_s: 5.0, ..renderer.home_shot(NOON_S) };
        Self { _folder: folder, renderer, shot }
    }

    fn add(&mut self, table: &Table) {
        self.particles(|particles| particles.add(table));
    }

    fn particles<T>(&mut self, act: impl FnOnce(&mut Particles) -> T) -> T {
        act(&mut self.renderer.app_mut().world_mut().resource_mut::<Particles>())
    }

    fn told(&mut self) -> ParticlesTold {
        self.particles(|particles| particles.told())
    }

    fn wish(&mut self, action: Action) {
        let world = self.renderer.app_mut().world_mut();
        world.init_resource::<Wishes>();
        world.resource_mut::<Wishes>().particles.push(action);
    }

    /// A picture, once what was asked for is there and depth can be read.
    fn picture(&mut self, actors_s: f64) -> HdrImage {
        self.shot.actors_s = actors_s;
        for _ in 0..4 {
            self.renderer.render_linear(&self.shot).unwrap();
        }
        self.renderer.render_linear(&self.shot).unwrap()
    }

    /// A picture, once the device has taken over.
    fn swarming(&mut self, actors_s: f64) -> HdrImage {
        self.shot.actors_s = actors_s;
        let soon = (0..SOON).find(|_| {
            self.renderer.render_linear(&self.shot).unwrap();
            self.told().by_device > 0
        });
        assert!(soon.is_some(), "the device takes over: {:?}", self.told());
        self.picture(actors_s)
    }
}

/// Pipelines are there some frames after they were asked for, as in windows.
struct Unhurried;

impl Plugin for Unhurried {
    fn build(&self, _: &mut App) {}

    fn finish(&self, app: &mut App) {
        let world = app.sub_app_mut(RenderApp).world_mut();
        let (device, adapter) = (world.resource::<RenderDevice>().clone(), world.resource::<RenderAdapter>().clone());
        world.insert_resource(PipelineCache::new(device, adapter, false));
    }
}

/// A source of some 30,000 particles.
fn many(kind: ParticleKind, place: Vec3) -> Table {
    let (extent, density) = match kind {
        ParticleKind::Dust => (Vec3::new(1.5, 1.2, 1.5), 54.0),
        ParticleKind::Smoke => (Vec3::splat(0.3), 370.0),
        ParticleKind::Water => (Vec3::new(0.4, 0.1, 0.4), 160.0),
        _ => (Vec3::splat(0.2), 430.0),
    };
    let [place, extent] = [place, extent].map(|point| point.as_dvec3().to_array());
    // motes large enough to be seen before their haze
    let size = if kind == ParticleKind::Dust { 8.0 } else { 1.0 };
    Table { name: "source".to_owned(), kind, place, extent, density, size, plays: true }
}

/// Numbers of the pixels that differ, and by how much all of them together became brighter.
fn changed(before: &HdrImage, after: &HdrImage) -> (usize, Vec3) {
    let pairs = || before.pixels.iter().zip(&after.pixels);
    (pairs().filter(|(a, b)| a != b).count(), pairs().map(|(a, b)| *b - *a).sum())
}

/// How much all pixels together differ from those beside them: motes, one by one, and no haze.
fn speckle(picture: &HdrImage) -> f32 {
    let rows = picture.pixels.chunks_exact(SIZE[0] as usize);
    let of_row =
        |row: &[Vec3]| row.windows(3).map(|three| (three[1] - (three[0] + three[2]) * 0.5).abs().max_element()).sum::<f32>();
    rows.map(of_row).sum()
}

/// The light of all that is not as it was.
fn light(before: &HdrImage, after: &HdrImage) -> f32 {
    let pairs = before.pixels.iter().zip(&after.pixels).filter(|(a, b)| a != b);
    pairs.map(|(_, b)| b.element_sum()).sum()
}

#[test]
fn a_swarm_gives_the_light_that_as_many_of_the_processors_particles_give() {
    let bare = Scene::new(ParticlesBy::Processor).picture(5.0);
    for kind in [ParticleKind::Sparks, ParticleKind::Water, ParticleKind::Dust, ParticleKind::Smoke] {
        let table = many(kind, PLACE);
        let mut scene = Scene::new(ParticlesBy::Processor);
        scene.particles(|particles| particles.options.most = 1_000_000);
        scene.add(&table);
        let one_by_one = scene.picture(5.0);
        let (count, more) = changed(&bare, &one_by_one);
        let told = scene.told();
        let mut scene = Scene::new(ParticlesBy::Device);
        scene.add(&table);
        let first = scene.swarming(5.0);
        let (swarm_count, swarm_more) = changed(&bare, &first);
        let swarm_told = scene.told();
        println!(
            "{kind:?}: {count} pixels, {more}, {told:?}; by the device {swarm_count} pixels, {swarm_more}, {swarm_told:?}"
        );
        assert!(first.pixels.iter().all(|pixel| pixel.is_finite()), "{kind:?}");
        assert!(swarm_told.by_device > 15_000 && told.by_device == 0 && told.particles > 15_000, "{kind:?}");
        assert!(swarm_count > 100 && (swarm_count as f32 / count as f32 - 1.0).abs() < 0.3, "{kind:?}");
        // smoke takes as much light away as it gives: of that, all of it
        let off = match kind {
            ParticleKind::Smoke => (light(&bare, &first) / light(&bare, &one_by_one) - 1.0).abs(),
            _ => (swarm_more - more).abs().max_element() / more.abs().max_element(),
        };
        let [plain, speckled, swarm_speckled] = [&bare, &one_by_one, &first].map(speckle);
        println!("{kind:?}: {off} off; speckle {plain}, {speckled}, {swarm_speckled}");
        assert!(off < 0.15, "{kind:?}: {off}");
        if kind == ParticleKind::Dust {
            assert!(speckled > 1.2 * plain, "motes are seen: {plain} and {speckled}");
            assert!((swarm_speckled / speckled - 1.0).abs() < 0.1, "{speckled} and {swarm_speckled}");
        }
        assert!(changed(&first, &scene.picture(5.1)).0 > 100, "{kind:?} moves");
        // the device keeps them in no order: what is laid over what may change, and nothing else does
        let (still, again) = (scene.picture(5.1), scene.picture(5.1));
        let shimmer = still.pixels.iter().zip(&again.pixels).map(|(a, b)| (*b - *a).abs().max_element()).sum::<f32>();
        println!("{kind:?} shimmers by {} of its light", shimmer / more.abs().max_element());
        assert!(shimmer < 0.15 * more.abs().max_element(), "{kind:?} stands where the visit's time does: {shimmer}");
    }
}

#[test]
fn scripts_stop_and_start_swarms() {
    let bare = Scene::new(ParticlesBy::Processor).picture(5.0);
    let mut scene = Scene::new(ParticlesBy::Device);
    scene.add(&many(ParticleKind::Sparks, PLACE));
    let whole = changed(&bare, &scene.swarming(5.0)).0;
    scene.wish(Action::StopParticles { particles: "source".to_owned() });
    scene.picture(5.0);
    let dying = changed(&bare, &scene.picture(5.8)).0;
    assert!(dying > 0 && dying < whole, "{whole}, then {dying}");
    assert_eq!(changed(&bare, &scene.picture(7.0)).0, 0, "all of it is gone");
    assert_eq!(scene.told().by_device, 0);
    scene.wish(Action::StartParticles { particles: "source".to_owned() });
    scene.picture(7.0);
    scene.swarming(7.2);
    let again = changed(&bare, &scene.picture(8.0)).0;
    assert!(again > whole / 3, "and there again: {again}");
    // the visit goes on elsewhere in time, and back
    for actors_s in [300.0, 20.0] {
        let after = changed(&bare, &scene.picture(actors_s)).0;
        assert!(after.abs_diff(whole) < whole / 4, "at {actors_s}: {after} where it was {whole}");
    }
}

#[test]
fn stone_hides_swarms_whatever_the_samples_of_a_pixel() {
    for samples in [1, 4] {
        let scene = |below: f32| {
            let mut scene = Scene::new(ParticlesBy::Device);
            let world = scene.renderer.app_mut().world_mut();
            let camera = world.query_filtered::<Entity, With<DaylightCamera>>().single(world).unwrap();
            world.entity_mut(camera).insert(Msaa::from_samples(samples));
            let bare = scene.picture(5.0);
            scene.add(&many(ParticleKind::Sparks, PLACE - Vec3::Y * below));
            (bare, scene)
        };
        let (bare, mut below) = scene(4.0);
        assert_eq!(changed(&bare, &below.swarming(5.0)).0, 0, "below the court, {samples} samples");
        let (bare, mut above) = scene(0.0);
        let (count, more) = changed(&bare, &above.swarming(5.0));
        assert!(count > 200 && more.x > more.y && more.y > more.z, "{samples} samples: {count}, {more}");
    }
}

#[test]
fn without_a_device_they_are_thinned_and_the_visit_goes_on() {
    // forced, and as stills have it
    for by in [ParticlesBy::Processor, ParticlesBy::Auto] {
        let mut scene = Scene::new(by);
        let bare = scene.picture(5.0);
        scene.add(&many(ParticleKind::Sparks, PLACE));
        let first = scene.picture(5.0);
        let (told, most) = (scene.told(), scene.particles(|particles| particles.options.most));
        assert!(told.by_device == 0 && told.particles > most / 2 && told.particles <= most, "{told:?}");
        assert!(changed(&bare, &first).0 > 100);
        assert_eq!(changed(&first, &scene.picture(5.0)).0, 0, "a function of the time");
    }
}

#[test]
fn small_sources_stay_with_the_processor() {
    let mut scene = Scene::new(ParticlesBy::Device);
    scene.add(&Table { density: 1.0, ..many(ParticleKind::Sparks, PLACE) });
    let bare = scene.picture(5.0);
    let still = scene.picture(5.0);
    assert!(scene.told().by_device == 0 && scene.told().particles > 10);
    assert_eq!(changed(&bare, &still).0, 0, "a function of the time");
    // beside a swarm, too
    scene.add(&Table { name: "many".to_owned(), ..many(ParticleKind::Water, PLACE + Vec3::X) });
    scene.swarming(5.0);
    let told = scene.told();
    assert!(told.particles > told.by_device && told.by_device > 15_000, "{told:?}");
}

#[test]
fn nothing_is_missing_while_the_device_takes_over() {
    let mut scene = Scene::with(ParticlesBy::Device, |app| {
        app.add_plugins(Unhurried);
    });
    let patiently = |scene: &mut Scene, is_there: &dyn Fn(&HdrImage) -> bool| {
        let there = (0..600).find_map(|_| {
            std::thread::sleep(Duration::from_millis(10));
            Some(scene.renderer.render_linear(&scene.shot).unwrap()).filter(is_there)
        });
        there.unwrap()
    };
    // the stone, and what draws the processor's particles
    patiently(&mut scene, &|picture| picture.pixels.iter().filter(|pixel| **pixel != picture.pixels[0]).count() > 10_000);
    let bare = scene.picture(5.0);
    scene.add(&Table { density: 2.0, ..many(ParticleKind::Sparks, PLACE) });
    patiently(&mut scene, &|picture| changed(&bare, picture).0 > 0);
    let few = scene.picture(5.0);
    scene.add(&Table { name: "many".to_owned(), ..many(ParticleKind::Sparks, PLACE) });
    let mut last = Vec::new();
    for frame in 0..SOON * 10 {
        let picture = scene.renderer.render_linear(&scene.shot).unwrap();
        let (told, count) = (scene.told(), changed(&few, &picture).0);
        assert!(count > 200, "frame {frame}: {count} pixels, {told:?}");
        if told.by_device > 0 {
            last.push(count);
        }
        if last.len() == 8 {
            break;
        }
    }
    assert_eq!(last.len(), 8, "the device takes over: {:?}", scene.told());
}

#[test]
fn water_out_of_sight_changes_nothing_that_is_in_sight() {
    // behind the eye, a metre above the ground: if it fell as deep as the ground is looked for it would be very many
    let table = many(ParticleKind::Water, PLACE + Vec3::Z * 9.0);
    let water = Table { name: "water".to_owned(), density: 30.0, ..table };
    let few = Table { density: 100.0, ..many(ParticleKind::Sparks, PLACE) };
    let mut scene = Scene::new(ParticlesBy::Device);
    scene.add(&water);
    scene.add(&few);
    for _ in 0..SOON / 4 {
        scene.picture(5.0);
        assert_eq!(scene.told().by_device, 0, "all together are not many");
        assert!(scene.told().sources == 1 && scene.told().particles > 1000, "{:?}", scene.told());
    }
    let mut scene = Scene::new(ParticlesBy::Device);
    scene.add(&many(ParticleKind::Sparks, PLACE));
    scene.swarming(5.0);
    scene.add(&water);
    for _ in 0..5 {
        scene.renderer.render_linear(&scene.shot).unwrap();
        assert!(scene.told().by_device > 15_000, "it stays while the ground is looked for");
    }
}

#[test]
fn an_app_may_have_effects_of_its_own() {
    let mut scene = Scene::with(ParticlesBy::Device, |app| {
        app.add_plugins(HanabiPlugin);
    });
    let bare = scene.picture(5.0);
    scene.add(&many(ParticleKind::Sparks, PLACE));
    assert!(changed(&bare, &scene.swarming(5.0)).0 > 100);
}
