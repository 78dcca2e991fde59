//! The room itself, seen from outside: its screens with what they show, and the visitor before them. A set-up is checked so without
//! its hardware.

use super::outputs::{eye_size, spawn_eye};
use super::{Room, RoomEye, Showing, Side};
use crate::input::{Action, Actions};
use crate::navigation::MouseLook;
use bevy::asset::RenderAssetUsages;
use bevy::camera::visibility::RenderLayers;
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::input::mouse::AccumulatedMouseMotion;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;
use bevy::render::view::Msaa;
use bevy::window::PrimaryWindow;
use heliodon_math::frame::unit_or;
use heliodon_math::screen::Screen;

/// The layer of everything in the preview.
const LAYER: usize = 30;
/// Drawn after all eyes.
const ORDER: isize = 1000;
/// Half of a wire's thickness, metres.
const WIRE_M: f32 = 0.006;
/// From the middle of the head to the front of the face.
const HEAD_M: f32 = 0.11;
/// Opening angle of the view from outside.
const FOV_RAD: f32 = 0.7;

/// The eye outside: it goes round the room.
#[derive(Component, Clone, Copy, Debug)]
pub struct PreviewCamera {
    /// Where around the room it is, from its back, clockwise from above.
    pub around_rad: f32,
    /// How high.
    pub above_rad: f32,
    /// How far, in multiples of the distance from which all is in view.
    pub distance: f32,
    middle: Vec3,
    radius: f32,
}

/// The visitor's head and what belongs to it.
#[derive(Component)]
pub(super) struct HeadModel;
/// The visitor's body below the head.
#[derive(Component)]
pub(super) struct BodyModel;
/// The wand.
#[derive(Component)]
pub(super) struct WandModel;
/// A wire from the visitor's eye to a corner of a screen.
#[derive(Component)]
pub(super) struct Sight {
    screen: usize,
    corner: usize,
}

/// The screen's face: it shows a picture as it is.
fn face(screen: &Screen) -> Mesh {
    let positions = screen.corners().map(|corner| corner.as_vec3().to_array());
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::RENDER_WORLD)
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions.to_vec())
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, vec![screen.normal().as_vec3().to_array(); 4])
        .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]])
        .with_inserted_indices(Indices::U32(vec![0, 1, 2, 0, 2, 3]))
}

/// A bar from one point to another, of a bar of length 1 along z.
fn bar(from: Vec3, to: Vec3) -> Transform {
    let along = to - from;
    let direction = unit_or(along, Vec3::NEG_Z);
    let rotation = Quat::from_rotation_arc(Vec3::NEG_Z, direction);
    Transform { translation: (from + to) * 0.5, rotation, scale: Vec3::new(1.0, 1.0, along.length().max(1e-4)) }
}

/// The least and the greatest corner of all that stands in the room.
fn bounds(room: &Room) -> (Vec3, Vec3) {
    let rest = room.rest().position;
    let start = (rest.min(rest * Vec3::new(1.0, 0.0, 1.0)), rest);
    let corners = room.screens().iter().flat_map(Screen::corners).map(|corner| corner.as_vec3());
    corners.fold(start, |(low, high), corner| (low.min(corner), high.max(corner)))
}

/// What the preview draws in what colour.
fn matte(color: Color) -> StandardMaterial {
    StandardMaterial { base_color: color, perceptual_roughness: 1.0, reflectance: 0.0, ..default() }
}

/// Spawns the room's model in the program's own window.
pub(crate) fn open(world: &mut World, room: &Room, samples: u32) {
    let window = world.query_filtered::<Entity, With<PrimaryWindow>>().iter(world).next();
    if let Some(window) = window {
        spawn(world, room, &Showing::Window(window), samples);
    }
}

/// Spawns the room's model, its eyes and the camera that sees it. Answers each screen's camera and picture.
pub(crate) fn spawn(world: &mut World, room: &Room, showing: &Showing, samples: u32) -> Vec<(Entity, Handle<Image>)> {
    let pictures: Vec<(Entity, Handle<Image>)> = (0..room.screens().len())
        .map(|screen| {
            let entry = &room.display().screens[screen];
            // One eye's is enough to see how a screen stands.
            let side = Side::of(entry.stereo)[0];
            spawn_eye(world, RoomEye { screen, side }, eye_size(entry.stereo, entry.output.size_px()), samples)
        })
        .collect();
    let images: Vec<Handle<Image>> = pictures.iter().map(|(_, image)| image.clone()).collect();
    spawn_model(world, room, &images);
    spawn_camera(world, room, showing);
    pictures
}

fn spawn_camera(world: &mut World, room: &Room, showing: &Showing) {
    let (low, high) = bounds(room);
    let camera = PreviewCamera {
        around_rad: 0.22,
        above_rad: 0.55,
        distance: 1.0,
        middle: (low + high) * 0.5,
        radius: ((high - low).length() * 0.5).max(0.5),
    };
    let layers = RenderLayers::layer(LAYER);
    world.spawn((
        Camera3d::default(),
        Tonemapping::None,
        Msaa::Sample4,
        Camera { order: ORDER, clear_color: ClearColorConfig::Custom(Color::srgb(0.055, 0.06, 0.07)), ..default() },
        Projection::Perspective(PerspectiveProjection { fov: FOV_RAD, ..default() }),
        AmbientLight { color: Color::WHITE, brightness: 700.0, ..default() },
        showing.target(),
        camera,
        layers.clone(),
    ));
    let sun = DirectionalLight { illuminance: 3000.0, ..default() };
    world.spawn((sun, Transform::default().looking_to(Vec3::new(-0.4, -1.0, -0.3), Vec3::Y), layers));
}

fn spawn_model(world: &mut World, room: &Room, images: &[Handle<Image>]) {
    let layers = RenderLayers::layer(LAYER);
    let mesh = |world: &mut World, mesh: Mesh| world.resource_mut::<Assets<Mesh>>().add(mesh);
    let paint = |world: &mut World, material: StandardMaterial| world.resource_mut::<Assets<StandardMaterial>>().add(material);
    let wire = mesh(world, Cuboid::new(2.0 * WIRE_M, 2.0 * WIRE_M, 1.0).into());
    let [frame, line, grid] = [Color::srgb(0.75, 0.72, 0.62), Color::srgb(0.95, 0.7, 0.25), Color::srgb(0.22, 0.23, 0.25)]
        .map(|color| paint(world, StandardMaterial { base_color: color, unlit: true, ..default() }));
    let back = paint(world, matte(Color::srgb(0.13, 0.14, 0.16)));

    for (number, screen) in room.screens().iter().enumerate() {
        let front = StandardMaterial { base_color_texture: images.get(number).cloned(), unlit: true, ..default() };
        let (face_mesh, front) = (mesh(world, face(screen)), paint(world, front));
        world.spawn((Mesh3d(face_mesh), MeshMaterial3d(front), layers.clone()));
        // Its back is a hair behind it, so that neither shows through the other.
        let corners = screen.corners().map(|corner| corner.as_vec3());
        let turned = Screen::from_corners(
            [corners[1], corners[0], corners[2]].map(|corner| corner.as_dvec3() - screen.normal() * f64::from(2.0 * WIRE_M)),
        );
        if let Ok(turned) = turned {
            let mesh = mesh(world, face(&turned));
            world.spawn((Mesh3d(mesh), MeshMaterial3d(back.clone()), layers.clone()));
        }
        for corner in 0..4 {
            let (from, to) = (corners[corner], corners[(corner + 1) % 4]);
            world.spawn((Mesh3d(wire.clone()), MeshMaterial3d(frame.clone()), bar(from, to), layers.clone()));
            let sight = Sight { screen: number, corner };
            world.spawn((Mesh3d(wire.clone()), MeshMaterial3d(line.clone()), Transform::default(), sight, layers.clone()));
        }
    }

    // The floor, in metres.
    let (low, high) = bounds(room);
    let (low, high) = ((low - 0.5).floor(), (high + 0.5).ceil());
    for x in low.x as i32..=high.x as i32 {
        let at = |z: f32| Vec3::new(x as f32, -0.01, z);
        world.spawn((Mesh3d(wire.clone()), MeshMaterial3d(grid.clone()), bar(at(low.z), at(high.z)), layers.clone()));
    }
    for z in low.z as i32..=high.z as i32 {
        let at = |x: f32| Vec3::new(x, -0.01, z as f32);
        world.spawn((Mesh3d(wire.clone()), MeshMaterial3d(grid.clone()), bar(at(low.x), at(high.x)), layers.clone()));
    }

    let [skin, coat] = [Color::srgb(0.78, 0.6, 0.48), Color::srgb(0.25, 0.38, 0.5)].map(|color| paint(world, matte(color)));
    let head = mesh(world, Sphere::new(HEAD_M).mesh().uv(24, 16));
    let nose = mesh(world, Cone { radius: 0.03, height: 0.07 }.into());
    let body = mesh(world, ConicalFrustum { radius_top: 0.13, radius_bottom: 0.22, height: 1.0 }.into());
    let wand = mesh(world, Cuboid::new(0.03, 0.03, 0.3).into());
    world.spawn((HeadModel, Mesh3d(head), MeshMaterial3d(skin.clone()), layers.clone())).with_children(|parent| {
        let ahead = Transform::from_xyz(0.0, 0.0, -HEAD_M).with_rotation(Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2));
        parent.spawn((Mesh3d(nose), MeshMaterial3d(skin), ahead, layers.clone()));
    });
    world.spawn((BodyModel, Mesh3d(body), MeshMaterial3d(coat.clone()), layers.clone()));
    world.spawn((WandModel, Mesh3d(wand), MeshMaterial3d(coat), Visibility::Hidden, layers));
}

/// The visitor and the wires of sight, where the head is now.
type Models<'w, 's> = (
    Query<'w, 's, &'static mut Transform, With<HeadModel>>,
    Query<'w, 's, &'static mut Transform, With<BodyModel>>,
    Query<'w, 's, (&'static mut Transform, &'static mut Visibility), With<WandModel>>,
    Query<'w, 's, (&'static mut Transform, &'static Sight)>,
);

/// Moves the model of the visitor.
pub(super) fn follow(room: Res<Room>, mut models: ParamSet<Models>) {
    let head = room.head;
    for mut transform in &mut models.p0() {
        (transform.translation, transform.rotation) = (head.position + head.orientation * Vec3::Z * HEAD_M, head.orientation);
    }
    let shoulders = (head.position.y - 0.25).max(0.1);
    for mut transform in &mut models.p1() {
        transform.translation =
            Vec3::new(head.position.x, shoulders * 0.5, head.position.z) + head.orientation * Vec3::Z * HEAD_M;
        transform.scale = Vec3::new(1.0, shoulders, 1.0);
    }
    for (mut transform, mut visibility) in &mut models.p2() {
        visibility.set_if_neq(if room.wand.is_some() { Visibility::Inherited } else { Visibility::Hidden });
        if let Some(wand) = room.wand {
            (transform.translation, transform.rotation) = (wand.position, wand.orientation);
        }
    }
    for (mut transform, sight) in &mut models.p3() {
        if let Some(screen) = room.screens().get(sight.screen) {
            let drawn = bar(head.position, screen.corners()[sight.corner].as_vec3());
            // Thinner than the screens' frames.
            *transform = Transform { scale: drawn.scale * Vec3::new(0.35, 0.35, 1.0), ..drawn };
        }
    }
}

/// Goes round the room with the mouse, nearer and farther with the wheel.
pub(super) fn orbit(
    mouse: Res<MouseLook>,
    motion: Res<AccumulatedMouseMotion>,
    actions: Res<Actions>,
    mut cameras: Query<&mut PreviewCamera>,
) {
    let nearer = actions.count(Action::PaceUp) - actions.count(Action::PaceDown);
    for mut camera in &mut cameras {
        if mouse.captured {
            camera.around_rad = (camera.around_rad - motion.delta.x * 0.005) % std::f32::consts::TAU;
            camera.above_rad = (camera.above_rad + motion.delta.y * 0.005).clamp(-0.2, 1.5);
        }
        camera.distance = (camera.distance * 0.9_f32.powf(nearer)).clamp(0.3, 4.0);
    }
}

/// Sets the eye outside where it is.
pub(super) fn aim(mut cameras: Query<(&PreviewCamera, &mut Transform)>) {
    for (camera, mut transform) in &mut cameras {
        let turn = Quat::from_rotation_y(camera.around_rad) * Quat::from_rotation_x(-camera.above_rad);
        // A room fills its sphere badly: from less than the distance all of it is in view.
        let away = 0.85 * camera.distance * camera.radius / libm::sinf(FOV_RAD * 0.5);
        *transform = Transform { translation: camera.middle + turn * Vec3::Z * away, rotation: turn, ..default() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_reach_from_end_to_end() {
        for (from, to) in [(Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0)), (Vec3::X, Vec3::new(1.0, -4.0, 0.0)), (Vec3::Y, Vec3::Y)] {
            let bar = bar(from, to);
            assert!(
                bar.transform_point(Vec3::Z * 0.5).distance(from) < 1e-3
                    && bar.transform_point(Vec3::Z * -0.5).distance(to) < 1e-3
            );
        }
    }
}
