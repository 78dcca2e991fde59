//! The camera of a tracked head: what it sees of the site, without walls to see it on.

use crate::hands::pose::Poses;
use bevy::prelude::*;

/// A camera that is where the visitor's tracked eyes are.
#[derive(Component, Clone, Copy, Debug, Default)]
pub(super) struct TrackedEye;

/// Sets it there.
pub(super) fn follow(poses: Poses, mut cameras: Query<&mut Transform, With<TrackedEye>>) {
    let Some((translation, rotation)) = poses.view() else { return };
    for mut camera in &mut cameras {
        camera.set_if_neq(Transform { translation, rotation, ..default() });
    }
}
