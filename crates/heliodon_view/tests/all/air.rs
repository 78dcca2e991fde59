//! What is in the air, in pictures of the GPU (a software one will do).

#![expect(clippy::unwrap_used, reason = "a test ends where something fails")]

use crate::common;
use glam::Vec3;
use heliodon_bundle::site::{ParticleKind, Particles as Table};
use heliodon_image::HdrImage;
use heliodon_script::action::Action;
use heliodon_view::Pose;
use heliodon_view::headless::{RenderOptions, Renderer, Shot};
use heliodon_view::lamps::{Cone, Lamp, Lamps};
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

/// The court with dust before its columns, without and with a lamp, and the lamp alone.
struct Dusty {
    scene: Scene,
    /// What dust adds to the picture without a lamp.
    unlit: Vec3,
    bare: HdrImage,
}

impl Dusty {
    fn new() -> Self {
        let bare = Scene::new().picture(5.0);
        let mut scene = Scene::new();
        scene.add(ParticleKind::Dust, Vec3::new(1.0, 0.8, 1.0));
        let unlit = changed(&bare, &scene.picture(5.0)).1;
        Self { scene, unlit, bare }
    }

    /// What dust adds under a lamp, beyond what it adds without.
    fn under(&mut self, lamp: Lamp) -> (Vec3, HdrImage) {
        let mut alone = Scene::new();
        for scene in [&mut alone, &mut self.scene] {
            scene.renderer.app_mut().world_mut().resource_mut::<Lamps>().lamps = vec![lamp];
        }
        let (alone, dusty) = (alone.picture(5.0), self.scene.picture(5.0));
        (changed(&alone, &dusty).1 - self.unlit, dusty)
    }
}

#[test]
fn dust_takes_lamps_light_within_their_cones_and_not_behind_stone() {
    let mut dusty = Dusty::new();
    let white = dusty.bare.pixels.iter().map(|pixel| pixel.max_element()).fold(0.0, f32::max);
    let cone = |direction| Some(Cone { direction, half_angle_rad: 0.35, edge: 0.3 });
    let above = Lamp {
        place: PLACE + Vec3::Y * 3.0,
        intensity: Vec3::new(30.0, 20.0, 10.0) * white,
        cone: cone(Vec3::NEG_Y),
        reach_m: 12.0,
        shadows: true,
    };
    let (lit, first) = dusty.under(above);
    assert!(lit.x > lit.y && lit.y > lit.z && lit.z > 0.0, "{lit}");
    let (away, _) = dusty.under(Lamp { cone: cone(Vec3::Y), ..above });
    assert!(away.abs().max_element() < 0.01 * lit.x, "it shines elsewhere: {away} of {lit}");
    // the same from below the court's floor
    let below = Lamp { place: PLACE - Vec3::Y * 4.0, cone: cone(Vec3::Y), ..above };
    let (hidden, _) = dusty.under(below);
    let (through, _) = dusty.under(Lamp { shadows: false, ..below });
    println!("lit {lit}, lamp turned away {away}, behind stone {hidden}, without shadows {through}");
    assert!(through.x > 0.2 * lit.x, "{through} of {lit}");
    assert!(hidden.abs().max_element() < 0.02 * through.x, "{hidden} of {through}");
    assert_eq!(changed(&first, &dusty.under(above).1).0, 0, "a function of the time");
}

#[test]
fn smoke_takes_lamps_light_and_not_behind_stone() {
    let grey = |lamps: &[Lamp]| {
        let mut scene = Scene::new();
        scene.add(ParticleKind::Smoke, Vec3::splat(0.2));
        scene.renderer.app_mut().world_mut().resource_mut::<Lamps>().lamps = lamps.to_vec();
        scene.picture(5.0)
    };
    let alone = |lamps: &[Lamp]| {
        let mut scene = Scene::new();
        scene.renderer.app_mut().world_mut().resource_mut::<Lamps>().lamps = lamps.to_vec();
        scene.picture(5.0)
    };
    let (bare, unlit) = (alone(&[]), grey(&[]));
    let before = changed(&bare, &unlit).1;
    let intensity = Vec3::splat(40.0 * bare.pixels.iter().map(|pixel| pixel.max_element()).fold(0.0, f32::max));
    let near = Lamp { place: PLACE + Vec3::new(0.0, 4.0, 0.0), intensity, cone: None, reach_m: 5.0, shadows: true };
    let below = Lamp { place: PLACE - Vec3::Y * 2.5, reach_m: 8.0, ..near };
    let more = |lamps: &[Lamp]| changed(&alone(lamps), &grey(lamps)).1 - before;
    let (lit, hidden, through) = (more(&[near]), more(&[below]), more(&[Lamp { shadows: false, ..below }]));
    println!("lit {lit}, behind stone {hidden}, without shadows {through}");
    assert!(through.x > 10.0 * hidden.x.abs() && through.x > 0.0, "{hidden} of {through}");
    assert!(lit.x > 0.0, "{lit}");
}
