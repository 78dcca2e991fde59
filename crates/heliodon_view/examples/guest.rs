//! A Bevy program with a stage of Heliodon's in it: its own entities stand among the columns, occlude and are occluded, and
//! are lit by the same hour.
//!
//! `cargo run -p heliodon_view --example guest [BUNDLE]`; without a bundle, a small court of columns is made.

#[path = "common/mod.rs"]
mod common;

use bevy::prelude::*;
use heliodon_view::navigation::Visitor;
use heliodon_view::{DaylightCamera, HeliodonPlugins, Stage, VisitPlugins};

/// Goes round and round.
#[derive(Component)]
struct Wanderer;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let bundle = match std::env::args().nth(1) {
        Some(path) => path.into(),
        None => {
            let path = folder.path().join("court");
            common::Court::small().write(&path)?;
            path
        }
    };
    let mut app = App::new();
    app.add_plugins((DefaultPlugins, HeliodonPlugins, VisitPlugins))
        .add_systems(Startup, spawn_guests)
        .add_systems(Update, wander);
    app.world_mut().resource_mut::<Stage>().open(bundle)?;
    app.run();
    Ok(())
}

fn spawn_guests(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut materials: ResMut<Assets<StandardMaterial>>) {
    commands.spawn((Visitor::default(), DaylightCamera));
    let matte = |color: Color| StandardMaterial { base_color: color, perceptual_roughness: 1.0, reflectance: 0.0, ..default() };
    commands.spawn((
        Wanderer,
        Mesh3d(meshes.add(Capsule3d::new(0.5, 1.4))),
        MeshMaterial3d(materials.add(matte(Color::srgb(0.75, 0.2, 0.15)))),
    ));
    commands.spawn((
        Mesh3d(meshes.add(Cuboid::from_length(1.5))),
        MeshMaterial3d(materials.add(matte(Color::srgb(0.3, 0.5, 0.75)))),
        Transform::from_xyz(-2.0, 0.75, 4.0),
    ));
}

fn wander(time: Res<Time>, mut wanderers: Query<&mut Transform, With<Wanderer>>) {
    for mut transform in &mut wanderers {
        let (sin, cos) = (time.elapsed_secs() * 0.5).sin_cos();
        transform.translation = Vec3::new(sin * 5.0, 1.2, -4.0 + cos * 8.0);
    }
}
