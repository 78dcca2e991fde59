//! A light map of `heliodon lightmap` in Bevy 0.19: `lit.glb` as it is, or `model.glb` with `light.ktx2` (BC6H) as the [`Lightmap`] of every mesh.
//!
//!   cargo run -- FOLDER lit|light EYE_X,Y,Z LOOK_X,Y,Z STOPS [PICTURE.png]
//!
//! FOLDER is what `heliodon lightmap --kind ktx2,combined` wrote, as an absolute path. STOPS is for `light`. With PICTURE the window is written to it after ten seconds, and the program ends.

use bevy::camera::Exposure;
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::pbr::Lightmap;
use bevy::prelude::*;
use bevy::render::view::screenshot::{Screenshot, save_to_disk};

#[derive(Resource)]
struct Asked {
    lit: bool,
    eye: Vec3,
    look: Vec3,
    stops: f32,
    picture: Option<String>,
}

fn main() {
    let told: Vec<String> = std::env::args().skip(1).collect();
    let place = |index: usize| {
        let numbers: Vec<f32> = told[index].split(',').map(|number| number.parse().expect("three numbers")).collect();
        Vec3::from_slice(&numbers)
    };
    let asked = Asked {
        lit: told[1] == "lit",
        eye: place(2),
        look: place(3),
        stops: told[4].parse().expect("stops"),
        picture: told.get(5).cloned(),
    };
    App::new()
        .add_plugins(DefaultPlugins.set(AssetPlugin { file_path: told[0].clone(), ..default() }))
        .insert_resource(GlobalAmbientLight::NONE)
        .insert_resource(ClearColor(Color::BLACK))
        .insert_resource(asked)
        .add_systems(Startup, setup)
        .add_systems(Update, (light_up, shoot))
        .run();
}

fn setup(mut commands: Commands, assets: Res<AssetServer>, asked: Res<Asked>) {
    let file = if asked.lit { "lit.glb" } else { "model.glb" };
    commands.spawn(WorldAssetRoot(assets.load(GltfAssetLabel::Scene(0).from_asset(file))));
    commands.spawn((
        Camera3d::default(),
        Projection::Perspective(PerspectiveProjection { fov: 54_f32.to_radians(), near: 0.05, ..default() }),
        Transform::from_translation(asked.eye).looking_at(asked.look, Vec3::Y),
        Tonemapping::None,
        Exposure::default(),
    ));
}

/// Lays the light onto meshes that have a second set of texture coordinates; the others are parts without a light map, for which Bevy's shader would not
/// compile. What the camera's exposure takes away, the material's own gives back.
fn light_up(
    mut commands: Commands,
    unlit: Query<(Entity, &Mesh3d, &MeshMaterial3d<StandardMaterial>), Without<Lightmap>>,
    meshes: Res<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    assets: Res<AssetServer>,
    asked: Res<Asked>,
) {
    if asked.lit {
        return;
    }
    for (entity, mesh, material) in &unlit {
        if !meshes.get(&mesh.0).is_some_and(|mesh| mesh.contains_attribute(Mesh::ATTRIBUTE_UV_1)) {
            continue;
        }
        commands.entity(entity).insert(Lightmap { image: assets.load("light.ktx2"), ..default() });
        if let Some(mut material) = materials.get_mut(&material.0) {
            material.lightmap_exposure = asked.stops.exp2() / Exposure::default().exposure();
        }
    }
}

fn shoot(
    mut commands: Commands,
    time: Res<Time>,
    asked: Res<Asked>,
    mut shot_at: Local<Option<f32>>,
    mut exit: MessageWriter<AppExit>,
) {
    let Some(picture) = &asked.picture else { return };
    let now = time.elapsed_secs();
    match *shot_at {
        None if now > 10.0 => {
            commands.spawn(Screenshot::primary_window()).observe(save_to_disk(picture.clone()));
            *shot_at = Some(now);
        }
        Some(then) if now > then + 5.0 => {
            exit.write(AppExit::Success);
        }
        _ => {}
    }
}
