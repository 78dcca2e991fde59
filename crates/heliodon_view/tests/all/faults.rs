//! What goes wrong ends in an error, never in a wrong picture or in a wait without end.

#![expect(clippy::unwrap_used, reason = "a test ends where something fails")]

use crate::common;
use bevy::asset::Assets;
use bevy::core_pipeline::prepass::DepthPrepass;
use bevy::prelude::*;
use bevy::render::renderer::RenderDevice;
use bevy::render::view::ViewTarget;
use bevy::render::{Render, RenderApp, RenderSystems};
use heliodon_bundle::BundleReader;
use heliodon_bundle::moment::Day;
use heliodon_view::bench::{BenchError, FrameBench, frame_times};
use heliodon_view::headless::{HeadlessError, RenderOptions, Renderer, Shot};
use heliodon_view::{DaylightCamera, Pose, Stage};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use tempfile::TempDir;
use wgpu::{BufferDescriptor, BufferUsages};

/// A court that is quickly made and has hidden clusters.
fn court(folder: &Path) {
    common::Court { sun_steps: 2, sky_columns: 64, ..common::Court::small() }.write(folder).unwrap();
}

fn renderer(folder: &Path) -> Renderer {
    Renderer::new(folder, 80, 60, RenderOptions { samples: 1 }).unwrap()
}

/// A court that is drawn, with the folder that holds it.
fn drawn_court() -> (TempDir, Renderer) {
    let folder = tempfile::tempdir().unwrap();
    court(folder.path());
    let renderer = renderer(folder.path());
    (folder, renderer)
}

/// Adds a system to the render world that is told when the count comes down to nothing.
fn count_down<M>(renderer: &mut Renderer, set: RenderSystems, system: impl IntoSystem<(), (), M>) -> Countdown {
    let due = Countdown(Arc::new(AtomicU32::new(0)));
    let world = renderer.app_mut().sub_app_mut(RenderApp);
    world.insert_resource(due.clone()).add_systems(Render, IntoSystem::into_system(system).in_set(set));
    due
}

/// Frames until something happens in the render world.
#[derive(Resource, Clone)]
struct Countdown(Arc<AtomicU32>);

impl Countdown {
    fn is_due(&self) -> bool {
        self.0.fetch_update(Ordering::AcqRel, Ordering::Acquire, |left| Some(left.saturating_sub(1))) == Ok(1)
    }
}

#[test]
fn a_picture_in_which_the_gpu_fails_is_none() {
    let (_folder, mut renderer) = drawn_court();
    let due = count_down(&mut renderer, RenderSystems::Cleanup, |due: Res<Countdown>, device: Res<RenderDevice>| {
        if due.is_due() {
            // A buffer for nothing is an error on every device.
            device.create_buffer(&BufferDescriptor {
                label: Some("faulty"),
                size: 16,
                usage: BufferUsages::empty(),
                mapped_at_creation: false,
            });
        }
    });
    let shot = renderer.home_shot(12.0 * 3600.0);
    renderer.render(&shot).unwrap();
    due.0.store(1, Ordering::Release);
    let error = renderer.render(&shot).map(|_| ()).unwrap_err();
    assert!(matches!(&error, HeadlessError::Device(what) if what.contains("faulty")), "{error}");
}

#[test]
fn a_damaged_texture_ends_a_measurement() {
    let folder = tempfile::tempdir().unwrap();
    let bundle = folder.path().join("court");
    let court =
        common::Court { shafts: (1, 1), quads: 8, ground_quads: 0, sun_steps: 1, sky_columns: 16, ..common::Court::small() };
    common::Court { textured: true, ..court }.write(&bundle).unwrap();
    let mut damaged = 0;
    for entry in std::fs::read_dir(&bundle).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_file()) {
        let mut bytes = std::fs::read(&entry).unwrap();
        while let Some(at) = bytes.windows(4).position(|four| four == b"IHDR") {
            bytes[at] = b'?';
            damaged += 1;
        }
        std::fs::write(&entry, bytes).unwrap();
    }
    assert_eq!(damaged, 1);
    let error = frame_times(Some(&bundle), FrameBench { width: 32, height: 32, ..FrameBench::default() }).unwrap_err();
    assert!(matches!(error, BenchError::Loading(_)), "{error}");
}

#[test]
fn a_picture_without_its_sky_is_none() {
    let folder = tempfile::tempdir().unwrap();
    let bundle = folder.path().join("court");
    court(&bundle);
    let reader = BundleReader::open(&bundle).unwrap();
    let times = Day::new(reader.lapse()).entry_seconds().to_vec();
    std::fs::remove_file(reader.sky_map_path(1)).unwrap();
    let mut renderer = renderer(&bundle);
    for (clock_s, whole) in [(times[0], true), (times[1], false), (times[0].midpoint(times[1]), false), (times[2], true)] {
        let shot = renderer.home_shot(clock_s);
        match renderer.render(&shot) {
            Ok(_) => assert!(whole, "a sky at {clock_s}"),
            Err(error) => assert!(!whole && matches!(error, HeadlessError::Sky(_)), "{error} at {clock_s}"),
        }
    }
}

/// An eye at home that came from a hair beside it.
fn come_home(renderer: &mut Renderer) -> Shot {
    let home = renderer.home_shot(12.0 * 3600.0);
    let beside = Shot { pose: Pose { eye: home.pose.eye + Vec3::X * 0.01, ..home.pose }, ..home };
    for _ in 0..5 {
        renderer.render(&beside).unwrap();
    }
    home
}

#[test]
fn what_no_frame_asked_is_not_answered() {
    let (_folder, mut renderer) = drawn_court();
    let due = count_down(
        &mut renderer,
        RenderSystems::PrepareBindGroups,
        |due: Res<Countdown>, views: Query<Entity, With<ViewTarget>>, mut commands: Commands| {
            // As in a minimised window, for which there is no texture.
            if due.is_due() {
                views.iter().for_each(|view| {
                    commands.entity(view).remove::<ViewTarget>();
                });
            }
        },
    );
    let home = come_home(&mut renderer);
    let whole = renderer.render(&home).unwrap();
    // The first frame at rest decides what a moving eye sees, the second asks what one at rest does; neither is drawn.
    for undrawn in [1, 2] {
        come_home(&mut renderer);
        due.0.store(undrawn, Ordering::Release);
        for _ in 0..undrawn {
            renderer.render(&home).unwrap();
        }
        for frame in 0..8 {
            assert!(renderer.render(&home).unwrap() == whole, "frame {frame} after frame {undrawn}");
        }
    }
}

#[test]
fn stone_behind_guests_is_there_when_they_go() {
    let (_folder, mut renderer) = drawn_court();
    let home = come_home(&mut renderer);
    let whole = renderer.render(&home).unwrap();
    let world = renderer.app_mut().world_mut();
    let mesh = world.resource_mut::<Assets<Mesh>>().add(Cuboid::from_length(2.0));
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(StandardMaterial::default());
    let before_the_eye = home.pose.transform() * (Vec3::NEG_Z * 3.0);
    let guest = world.spawn((Mesh3d(mesh), MeshMaterial3d(material), Transform::from_translation(before_the_eye))).id();
    let camera = world.query_filtered::<Entity, With<DaylightCamera>>().single(world).unwrap();
    world.entity_mut(camera).insert(DepthPrepass);
    let home = come_home(&mut renderer);
    for _ in 0..6 {
        assert!(renderer.render(&home).unwrap() != whole, "the guest is seen");
    }
    renderer.app_mut().world_mut().despawn(guest);
    renderer.render(&home).unwrap();
    assert!(renderer.render(&home).unwrap() == whole);
}

#[test]
fn a_camera_may_leave_the_stage() {
    let folder = tempfile::tempdir().unwrap();
    let [first, second] = ["first", "second"].map(|name| folder.path().join(name));
    court(&first);
    court(&second);
    let mut renderer = renderer(&first);
    let shot = renderer.home_shot(12.0 * 3600.0);
    let before = renderer.render(&shot).unwrap();
    assert!(renderer.triangles_drawn() > 0);
    let app = renderer.app_mut();
    let camera = app.world_mut().query_filtered::<Entity, With<DaylightCamera>>().single(app.world()).unwrap();
    app.world_mut().entity_mut(camera).remove::<DaylightCamera>();
    app.world_mut().resource_mut::<Stage>().open(&second).unwrap();
    app.update();
    assert_eq!(renderer.triangles_drawn(), 0, "of a bundle that is gone");
    let app = renderer.app_mut();
    while !app.world().resource::<Stage>().is_complete() {
        app.update();
    }
    app.world_mut().entity_mut(camera).insert(DaylightCamera);
    app.update();
    assert!(renderer.render(&shot).unwrap() == before, "the same court again");
}
