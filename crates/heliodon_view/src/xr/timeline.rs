//! The day as a bar in space: on the left wrist, or on the floor before the visitor.
//!
//! A panel, the bar, what of it has the sun up with a mark and an hour at sunrise and sunset, a knob, and the hour above it. All of it is of Bevy's
//! meshes in plain colours: they are drawn over the stage and share its depth. The model is one long; the root's scale makes it metres.

use super::controllers::ControllerSet;
use super::hands::XrHands;
use super::play::PlaySpace;
use super::reach::{Reach, reach};
use super::{HeadsetSettings, digits};
use crate::hud::{HudVisibility, INK, SUN, clock_text};
use crate::time_lapse::TimeLapse;
use bevy::light::{NotShadowCaster, NotShadowReceiver};
use bevy::prelude::*;
use bevy_mod_xr::session::XrTrackingRoot;
use heliodon_bundle::display::HeadsetTimeline;
use heliodon_math::frame::unit_or;
use heliodon_track::pose::Pose;

/// Width and height of the panel, and how far its middle is above the bar, in lengths of the bar.
pub(super) const PANEL: Vec2 = Vec2::new(1.18, 0.44);
pub(super) const PANEL_UP: f32 = 0.07;

/// How long the bar is, metres.
const ON_WRIST_M: f32 = 0.16;
const ON_FLOOR_M: f32 = 1.2;

/// Where it stands on the floor, as a desk does: before the feet, so far that a glance down finds it, and leaning back.
const FLOOR: Vec3 = Vec3::new(0.0, 0.3, -1.8);
const LEANS_RAD: f32 = 0.9;

/// Where it lies on a wrist, from where the hand grips: behind the hand and above its back.
const WRIST: Vec3 = Vec3::new(-0.045, 0.09, 0.0);

/// Heights of the hour, and of those at sunrise and sunset.
const HOUR: f32 = 0.15;
const MARK: f32 = 0.055;

/// Half of the ray's thickness, metres.
const RAY_M: f32 = 0.002;

/// Where a time line is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placed {
    /// +X along the day, +Z towards who looks at it.
    pub play_from_line: Pose,
    /// How long the bar is, metres.
    pub length_m: f32,
}

/// Where the time line is in the play space; nowhere if it is hidden or the hand that has it is not seen.
pub(super) fn placed(settings: &HeadsetSettings, hands: &XrHands, play: &PlaySpace) -> Option<Placed> {
    match settings.comfort.timeline {
        HeadsetTimeline::Hidden => None,
        HeadsetTimeline::Floor => {
            let platform_from_line = Pose { position: FLOOR, orientation: Quat::from_rotation_x(-LEANS_RAD) };
            Some(Placed { play_from_line: play.platform_from_play.inverse() * platform_from_line, length_m: ON_FLOOR_M })
        }
        // As a watch is read: the forearm before the chest, the back of the hand up. Of the grip pose (section 6.3.2 of the OpenXR specification) +X, out of
        // the palm, is down then, -Z, the thumb's side, is towards the reader, and -Y, where the fingers point, is to the right.
        HeadsetTimeline::Wrist => {
            let hand_from_line = Mat3::from_cols(Vec3::NEG_Y, Vec3::Z, Vec3::NEG_X);
            let at_wrist = Pose { position: WRIST, orientation: Quat::from_mat3(&hand_from_line) };
            Some(Placed { play_from_line: hands.left? * at_wrist, length_m: ON_WRIST_M })
        }
    }
}

/// The model's root.
#[derive(Component)]
struct Model;
/// What moves of it.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    SunUp,
    Knob,
    Hour,
    SunriseMark,
    SunsetMark,
    SunriseHour,
    SunsetHour,
}
/// What digits show.
#[derive(Component, Clone, Debug, Default, PartialEq)]
struct Shown(String);
/// The ray from the right hand.
#[derive(Component)]
struct Ray;

/// Shows and drags the time line.
#[derive(Default)]
pub(super) struct TimelinePlugin;

impl Plugin for TimelinePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Reach>()
            .add_systems(Startup, spawn)
            .add_systems(PreUpdate, reach.after(ControllerSet::Read).before(ControllerSet::HandOn))
            .add_systems(PostUpdate, (tell, place, point).before(bevy::transform::TransformSystems::Propagate));
    }
}

/// A colour that neither sun nor shade changes.
fn plain(color: Color) -> StandardMaterial {
    StandardMaterial { base_color: color, unlit: true, ..default() }
}

fn spawn(
    roots: Query<Entity, With<XrTrackingRoot>>,
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let Ok(root) = roots.single() else { return };
    let square = meshes.add(Rectangle::new(1.0, 1.0));
    let [dark, grey, sun, ink] =
        [Color::srgb(0.05, 0.055, 0.07), Color::srgb(0.33, 0.34, 0.37), SUN, INK].map(|color| materials.add(plain(color)));
    let unshaded = || (NotShadowCaster, NotShadowReceiver);
    let flat = |middle: Vec3, size: Vec2| Transform::from_translation(middle).with_scale(size.extend(1.0));
    let model = commands.spawn((Model, Transform::default(), Visibility::Hidden, ChildOf(root))).id();
    let mut quad = |material: &Handle<StandardMaterial>, transform: Transform| {
        commands.spawn((Mesh3d(square.clone()), MeshMaterial3d(material.clone()), transform, unshaded(), ChildOf(model))).id()
    };
    quad(&dark, flat(Vec3::new(0.0, PANEL_UP, -0.01), PANEL));
    quad(&grey, flat(Vec3::ZERO, Vec2::new(1.0, 0.03)));
    let sun_up = quad(&sun, flat(Vec3::Z * 0.002, Vec2::new(1.0, 0.03)));
    let [rise, set] = [(); 2].map(|()| quad(&sun, flat(Vec3::Z * 0.002, Vec2::new(0.008, 0.09))));
    commands.entity(sun_up).insert(Part::SunUp);
    commands.entity(rise).insert(Part::SunriseMark);
    commands.entity(set).insert(Part::SunsetMark);
    let disc = meshes.add(Circle::new(0.045));
    commands.spawn((Part::Knob, Mesh3d(disc), MeshMaterial3d(ink.clone()), Transform::default(), unshaded(), ChildOf(model)));
    for part in [Part::Hour, Part::SunriseHour, Part::SunsetHour] {
        let mesh = meshes.add(digits::mesh("", 1.0));
        let material = if part == Part::Hour { &ink } else { &sun };
        let parts = (Mesh3d(mesh), MeshMaterial3d(material.clone()), Transform::default());
        commands.spawn((part, Shown::default(), parts, unshaded(), ChildOf(model)));
    }
    let beam = meshes.add(Cuboid::new(RAY_M * 2.0, RAY_M * 2.0, 1.0));
    commands.spawn((
        Ray,
        Mesh3d(beam),
        MeshMaterial3d(ink),
        Transform::default(),
        Visibility::Hidden,
        unshaded(),
        ChildOf(root),
    ));
}

/// Where along the bar an hour is, from its middle.
fn along(lapse: &TimeLapse, clock_s: f64) -> f32 {
    let (first, last) = lapse.span_s();
    if last > first { (((clock_s - first) / (last - first)) as f32).clamp(0.0, 1.0) - 0.5 } else { -0.5 }
}

/// A part, and the digits that it shows.
type MovingPart = (&'static Part, &'static mut Transform, Option<(&'static mut Shown, &'static Mesh3d)>);

/// Moves what moves along the bar and tells the hours.
fn tell(lapse: Res<TimeLapse>, mut parts: Query<MovingPart>, mut meshes: ResMut<Assets<Mesh>>) {
    if !lapse.is_changed() {
        return;
    }
    let sun_up = lapse.sun_up_s();
    let [rise, set] = [sun_up.map(|(rise, _)| rise), sun_up.map(|(_, set)| set)];
    let [from, to] = [rise, set].map(|at| at.map_or(-0.5, |clock_s| along(&lapse, clock_s)));
    let of_sun = |at: Option<f64>| at.map_or_else(String::new, clock_text);
    // Hours that would stand on each other, and marks of a day that has none, are left out.
    let apart = to - from > 0.3;
    let gone = Vec3::splat(1e-6);
    for (part, mut transform, digits) in &mut parts {
        let (middle, scale, text) = match part {
            Part::SunUp => {
                (Vec3::new((from + to) * 0.5, 0.0, 0.002), Vec3::new((to - from).max(1e-6), 0.03, 1.0), String::new())
            }
            Part::Knob => (Vec3::new(along(&lapse, lapse.clock_s), 0.0, 0.006), Vec3::ONE, String::new()),
            Part::Hour => (Vec3::new(0.0, 0.17, 0.0), Vec3::ONE, clock_text(lapse.clock_s)),
            Part::SunriseMark | Part::SunsetMark => {
                let at = if *part == Part::SunriseMark { from } else { to };
                let size = if sun_up.is_some() { Vec3::new(0.008, 0.09, 1.0) } else { gone };
                (Vec3::new(at, 0.0, 0.003), size, String::new())
            }
            Part::SunriseHour => (Vec3::new(from.max(-0.42), -0.09, 0.0), Vec3::ONE, of_sun(rise)),
            Part::SunsetHour => {
                let text = if apart { of_sun(set) } else { String::new() };
                (Vec3::new(to.min(0.42), -0.09, 0.0), Vec3::ONE, text)
            }
        };
        transform.set_if_neq(Transform::from_translation(middle).with_scale(scale));
        if let Some((mut shown, mesh)) = digits
            && shown.0 != text
        {
            let height = if *part == Part::Hour { HOUR } else { MARK };
            if meshes.insert(&mesh.0, digits::mesh(&text, height)).is_ok() {
                shown.0 = text;
            }
        }
    }
}

/// Puts it on the wrist or on the floor.
fn place(
    settings: Res<HeadsetSettings>,
    hands: Res<XrHands>,
    play: Res<PlaySpace>,
    visibility: Res<HudVisibility>,
    lapse: Res<TimeLapse>,
    mut models: Query<(&mut Transform, &mut Visibility), With<Model>>,
) {
    let placed = placed(&settings, &hands, &play).filter(|_| visibility.shown && lapse.span_s().1 > 0.0);
    for (mut transform, mut seen) in &mut models {
        seen.set_if_neq(if placed.is_some() { Visibility::Inherited } else { Visibility::Hidden });
        if let Some(Placed { play_from_line: at, length_m }) = placed {
            transform.set_if_neq(Transform {
                translation: at.position,
                rotation: at.orientation,
                scale: Vec3::splat(length_m),
            });
        }
    }
}

/// Shows the ray while it is on the time line.
fn point(reach: Res<Reach>, mut rays: Query<(&mut Transform, &mut Visibility), With<Ray>>) {
    for (mut transform, mut seen) in &mut rays {
        seen.set_if_neq(if reach.ray.is_some() { Visibility::Inherited } else { Visibility::Hidden });
        if let Some((from, to)) = reach.ray {
            let rotation = Quat::from_rotation_arc(Vec3::NEG_Z, unit_or(to - from, Vec3::NEG_Z));
            let scale = Vec3::new(1.0, 1.0, from.distance(to).max(1e-3));
            transform.set_if_neq(Transform { translation: (from + to) * 0.5, rotation, scale });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_bundle::display::{DisplayFile, Headset};

    fn settings(timeline: HeadsetTimeline) -> HeadsetSettings {
        let comfort = Headset { timeline, ..Headset::default() };
        HeadsetSettings { comfort, ..HeadsetSettings::new(&DisplayFile::default(), 1) }
    }

    #[test]
    fn on_the_floor_it_lies_before_the_visitor_and_is_read_from_above() {
        let mut play = PlaySpace::default();
        let head = Pose { position: Vec3::new(1.0, 1.7, 1.0), orientation: Quat::from_rotation_y(-1.0) };
        play.recentre(&head);
        let line = placed(&settings(HeadsetTimeline::Floor), &XrHands::default(), &play).unwrap().play_from_line;
        let head_from_line = play.platform_from_play * line;
        assert!(head_from_line.position.distance(FLOOR) < 1e-5);
        assert!((head_from_line.orientation * Vec3::X).distance(Vec3::X) < 1e-5, "the day goes to the right");
        let to_head = unit_or(Vec3::Y * 1.7 - head_from_line.position, Vec3::Y);
        assert!((head_from_line.orientation * Vec3::Z).dot(to_head) > 0.95, "it looks at the face");
        assert!(
            (head_from_line.orientation * Vec3::Y).y > 0.0 && (head_from_line.orientation * Vec3::Y).z < 0.0,
            "its top is up and away"
        );
    }

    #[test]
    fn on_the_wrist_it_is_read_like_a_watch() {
        let hidden = XrHands::default();
        assert!(placed(&settings(HeadsetTimeline::Wrist), &hidden, &PlaySpace::default()).is_none());
        // The left forearm before the chest, fingers to the right, the back of the hand up: out of the palm (+X) is down, the thumb's side (-Z) towards the
        // reader, so that -Y, across both, is where the fingers point.
        let orientation = Quat::from_mat3(&Mat3::from_cols(Vec3::NEG_Y, Vec3::NEG_X, Vec3::NEG_Z));
        let hand = Pose { position: Vec3::new(0.0, 1.2, -0.35), orientation };
        let hands = XrHands { left: Some(hand), ..XrHands::default() };
        let line = placed(&settings(HeadsetTimeline::Wrist), &hands, &PlaySpace::default()).unwrap().play_from_line;
        assert!((line.orientation * Vec3::X).distance(Vec3::X) < 1e-5, "the day goes to the right");
        assert!((line.orientation * Vec3::Z).distance(Vec3::Y) < 1e-5, "it looks up");
        assert!(line.position.y > hand.position.y + 0.03 && line.position.x < hand.position.x - 0.05, "above the wrist");
        assert!(placed(&settings(HeadsetTimeline::Hidden), &hands, &PlaySpace::default()).is_none());
    }
}
