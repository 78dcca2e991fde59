//! What shows what is before a hand where a view has no middle: a small light in the scene itself, for rooms with screens and for headsets.

use super::act::offers;
use super::pose::Scheme;
use super::{BOTH, Hand, Hands, Site};
use bevy::light::NotShadowCaster;
use bevy::prelude::*;

/// How large it looks, radians: a third of a degree is seen and hides nothing.
const SEEN_RAD: f32 = 0.006;
/// It floats before what it is on, as a part of its size.
const BEFORE: f32 = 1.5;

/// The light of a hand.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Marker(Hand);

/// Makes one for each hand, where there is anything that draws.
pub(super) fn spawn(
    mut commands: Commands,
    meshes: Option<ResMut<Assets<Mesh>>>,
    materials: Option<ResMut<Assets<StandardMaterial>>>,
) {
    let (Some(mut meshes), Some(mut materials)) = (meshes, materials) else { return };
    let mesh = meshes.add(Sphere::new(1.0).mesh().uv(16, 8));
    // it shines by itself at any hour
    let material = materials.add(StandardMaterial { base_color: Color::srgb(1.0, 0.85, 0.5), unlit: true, ..default() });
    for hand in BOTH {
        let looks = (Mesh3d(mesh.clone()), MeshMaterial3d(material.clone()), NotShadowCaster);
        commands.spawn((Marker(hand), looks, Transform::default(), Visibility::Hidden));
    }
}

/// Puts the lights on what can be taken, touched or worked on.
pub(super) fn show(site: Site, hands: Res<Hands>, mut markers: Query<(&Marker, &mut Transform, &mut Visibility)>) {
    for (&Marker(hand), mut transform, mut visibility) in &mut markers {
        let one = &hands.of[hand as usize];
        let held = one.held.as_ref().map(|held| (held.name.as_str(), &held.thing));
        // the right hand alone points with the eyes
        let points =
            one.pose.as_ref().filter(|pose| !pose.in_window && (pose.scheme == Scheme::Tracked || hand == Hand::Right));
        let met = one.met.as_ref().filter(|_| hands.alive);
        let shown =
            points.zip(met).filter(|(_, met)| !offers(&site.story, met, held, site.thing(&met.name).as_ref()).is_empty());
        visibility.set_if_neq(if shown.is_some() { Visibility::Inherited } else { Visibility::Hidden });
        if let Some((pose, met)) = shown {
            let radius = SEEN_RAD * pose.view.0.distance(met.place).max(0.1);
            let translation = met.place + met.normal * (BEFORE * radius);
            transform.set_if_neq(Transform { translation, scale: Vec3::splat(radius), ..default() });
        }
    }
}
