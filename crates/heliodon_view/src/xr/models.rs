//! What one sees of one's own hands: a grip for each, lit by the same hour as the stone.

use super::hands::XrHands;
use bevy::light::NotShadowCaster;
use bevy::prelude::*;
use bevy_mod_xr::session::XrTrackingRoot;

/// As wide, high and long as what a fist holds, metres.
const GRIP_M: Vec3 = Vec3::new(0.035, 0.035, 0.11);

/// The model of a hand.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
enum Hand {
    Left,
    Right,
}

/// Shows where hands are.
#[derive(Default)]
pub(super) struct ModelsPlugin;

impl Plugin for ModelsPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(Startup, spawn).add_systems(PostUpdate, follow.before(bevy::transform::TransformSystems::Propagate));
    }
}

fn spawn(
    roots: Query<Entity, With<XrTrackingRoot>>,
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let Ok(root) = roots.single() else { return };
    let mesh = meshes.add(Capsule3d::new(GRIP_M.x * 0.5, GRIP_M.z - GRIP_M.x));
    let color = Color::srgb(0.32, 0.33, 0.36);
    let matte = materials.add(StandardMaterial { base_color: color, perceptual_roughness: 1.0, reflectance: 0.0, ..default() });
    for hand in [Hand::Left, Hand::Right] {
        let parts = (Mesh3d(mesh.clone()), MeshMaterial3d(matte.clone()), Transform::default());
        commands.spawn((hand, parts, Visibility::Hidden, NotShadowCaster, ChildOf(root)));
    }
}

fn follow(hands: Res<XrHands>, mut models: Query<(&Hand, &mut Transform, &mut Visibility)>) {
    for (hand, mut transform, mut seen) in &mut models {
        let pose = if *hand == Hand::Left { hands.left } else { hands.right };
        seen.set_if_neq(if pose.is_some() { Visibility::Inherited } else { Visibility::Hidden });
        if let Some(pose) = pose {
            // A capsule stands along y, what is held lies along the grip's z.
            let rotation = pose.orientation * Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
            transform.set_if_neq(Transform { translation: pose.position, rotation, ..default() });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_track::pose::Pose;

    #[test]
    fn hands_are_shown_where_they_are_seen() {
        let mut app = App::new();
        let right = Pose { position: Vec3::new(0.3, 1.1, -0.4), orientation: Quat::IDENTITY };
        app.add_systems(Update, follow).insert_resource(XrHands { right: Some(right), ..XrHands::default() });
        let spawn = |app: &mut App, hand| app.world_mut().spawn((hand, Transform::default(), Visibility::Hidden)).id();
        let (left, right) = (spawn(&mut app, Hand::Left), spawn(&mut app, Hand::Right));
        app.update();
        assert_eq!(app.world().get::<Visibility>(left), Some(&Visibility::Hidden));
        assert_eq!(app.world().get::<Visibility>(right), Some(&Visibility::Inherited));
        let model = app.world().get::<Transform>(right).unwrap();
        assert!(model.translation == Vec3::new(0.3, 1.1, -0.4) && (model.rotation * Vec3::Y).distance(Vec3::Z) < 1e-6);
    }
}
