//! What is in the air, in pictures of the GPU (a software one will do).

#![expect(clippy::unwrap_used, reason = "a test ends where something fails")]

#[path = "../examples/common/mod.rs"]
mod common;

use glam::Vec3;
use heliodon_bundle::site::{ParticleKind, Particles as Table};
use heliodon_image::HdrImage;
use heliodon_script::action::Action;
use heliodon_view::Pose;
use heliodon_view::headless::{RenderOptions, Renderer, Shot};
use heliodon_view::particles::Particles;
use heliodon_view::story::Wishes;
use tempfile::TempDir;

const SIZE: [u32; 2] = [200, 150];
const NOON_S: f64 = 12.0 * 3600.0;
/// Before the court's columns.
const PLACE: Vec3 = Vec3::new(0.0, 1.0, 8.0);

/// A court of columns.
struct Scene {
    _folder: TempDir,
    renderer: Renderer,
    shot: Shot,
}

impl Scene {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let bundle = folder.path().join("court");
        common::Court { quads: 40, sun_steps: 4, sky_columns: 64, ..common::Court::small() }.write(&bundle).unwrap();
        let renderer = Renderer::new(&bundle, SIZE[0], SIZE[1], RenderOptions { samples: 1 }).unwrap();
        let pose = Pose::looking(PLACE + Vec3::new(0.4, 0.6, 4.0), PLACE + Vec3::Y * 0.4);
        let shot = Shot { pose, fov_deg: 50.0, actors_s: 5.0, ..renderer.home_shot(NOON_S) };
        Self { _folder: folder, renderer, shot }
    }

    fn add(&mut self, kind: ParticleKind, extent: Vec3) {
        let (place, extent) = (PLACE.as_dvec3().to_array(), extent.as_dvec3().to_array());
        let table = Table { name: "source".to_owned(), kind, place, extent, density: 1.0, size: 1.0, plays: true };
        self.renderer.app_mut().world_mut().resource_mut::<Particles>().add(&table);
    }

    fn picture(&mut self, actors_s: f64) -> HdrImage {
        self.shot.actors_s = actors_s;
        // depth can be read in the frame after it was asked for, and pipelines are there some frames later
        for _ in 0..4 {
            self.renderer.render_linear(&self.shot).unwrap();
        }
        self.renderer.render_linear(&self.shot).unwrap()
    }
}

/// Numbers of the pixels that differ, and by how much all of them together became brighter.
fn changed(before: &HdrImage, after: &HdrImage) -> (usize, Vec3) {
    let pairs = || before.pixels.iter().zip(&after.pixels);
    (pairs().filter(|(a, b)| a != b).count(), pairs().map(|(a, b)| *b - *a).sum())
}

#[test]
fn each_kind_is_seen_for_what_it_is_and_the_same_at_the_same_time() {
    let bare = Scene::new().picture(5.0);
    assert!(bare.pixels.iter().all(|pixel| pixel.is_finite()));
    let pixels = bare.pixels.len();
    for kind in [ParticleKind::Dust, ParticleKind::Smoke, ParticleKind::Fire, ParticleKind::Sparks, ParticleKind::Water] {
        let mut scene = Scene::new();
        scene.add(kind, if kind == ParticleKind::Dust { Vec3::new(1.0, 0.8, 1.0) } else { Vec3::splat(0.2) });
        let first = scene.picture(5.0);
        let (count, more) = changed(&bare, &first);
        assert!(count > 20 && first.pixels.iter().all(|pixel| pixel.is_finite()), "{kind:?}: {count}");
        match kind {
            ParticleKind::Dust => assert!(more.min_element() > 0.0 && count > pixels / 8, "{more}, {count}"),
            ParticleKind::Fire | ParticleKind::Sparks => assert!(more.x > more.y && more.y > more.z, "{kind:?}: {more}"),
            // only some of the picture
            _ => assert!(count < pixels / 2, "{kind:?}: {count}"),
        }
        let later = scene.picture(5.4);
        assert!(changed(&first, &later).0 > 10, "{kind:?} moves");
        assert_eq!(changed(&first, &scene.picture(5.0)).0, 0, "{kind:?} is a function of the time");
    }
}

#[test]
fn what_scripts_stop_dies_out() {
    let mut scene = Scene::new();
    let bare = scene.picture(5.0);
    scene.add(ParticleKind::Smoke, Vec3::splat(0.2));
    let wish = |scene: &mut Scene, action: Action| {
        let world = scene.renderer.app_mut().world_mut();
        world.init_resource::<Wishes>();
        world.resource_mut::<Wishes>().particles.push(action);
    };
    let whole = changed(&bare, &scene.picture(5.0)).0;
    wish(&mut scene, Action::StopParticles { particles: "source".to_owned() });
    let soon = changed(&bare, &scene.picture(5.0)).0;
    let dying = changed(&bare, &scene.picture(8.0)).0;
    assert_eq!(whole, soon, "what is there stays");
    assert!(dying > 0 && dying != whole, "{whole}, then {dying}");
    assert_eq!(changed(&bare, &scene.picture(16.0)).0, 0, "all of it is gone");
    wish(&mut scene, Action::StartParticles { particles: "source".to_owned() });
    scene.picture(16.0);
    assert!(changed(&bare, &scene.picture(20.0)).0 > 20, "and there again");
}

#[test]
fn stone_hides_what_is_behind_it() {
    let mut scene = Scene::new();
    let bare = scene.picture(5.0);
    // below the court
    let table = Table {
        name: "below".to_owned(),
        kind: ParticleKind::Sparks,
        place: (PLACE - Vec3::Y * 4.0).as_dvec3().to_array(),
        extent: [0.2; 3],
        density: 1.0,
        size: 1.0,
        plays: true,
    };
    scene.renderer.app_mut().world_mut().resource_mut::<Particles>().add(&table);
    let (count, _) = changed(&bare, &scene.picture(5.0));
    assert_eq!(count, 0);
}

#[test]
fn what_a_frame_takes_is_told_and_bounded() {
    let mut scene = Scene::new();
    let kinds = [ParticleKind::Dust, ParticleKind::Smoke, ParticleKind::Fire, ParticleKind::Sparks, ParticleKind::Water];
    for number in 0..1000 {
        scene.add(kinds[number % 5], Vec3::splat(0.3));
    }
    scene.picture(5.0);
    let particles = scene.renderer.app_mut().world().resource::<Particles>();
    let told = particles.told();
    println!("{told:?}");
    // what splashes is four where it was one
    assert!(told.sources == 1000 && told.particles > 1000 && told.particles < 2 * particles.options.most, "{told:?}");
    assert!(told.ms > 0.0 && told.maps <= 12, "{told:?}");
}
