//! The right hand's ray on the time line: the trigger takes it, and the hour goes with the hand.

use super::controllers::{Controllers, TRIGGER};
use super::hands::XrHands;
use super::play::PlaySpace;
use super::timeline::Placed;
use super::{HeadsetSettings, timeline};
use crate::hud::HudVisibility;
use crate::time_lapse::TimeLapse;
use bevy::prelude::*;
use heliodon_track::pose::Pose;

/// Farther things are not reached, metres.
const REACH_M: f32 = 6.0;

/// What the right hand has to do with the time line.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Reach {
    /// Where the ray ends that meets it, in the play space.
    pub ray: Option<(Vec3, Vec3)>,
    /// Whether the trigger holds it.
    pub holds: bool,
    was_down: bool,
}

/// Where a ray along the -Z of `aim` meets the plane of a time line from its front: along it, 0 to 1 from its first hour to its last, and above it,
/// in its lengths; and how far that is, metres.
pub(super) fn meet(aim: &Pose, line: &Placed) -> Option<(Vec2, f32)> {
    let line_from_play = line.play_from_line.inverse();
    let origin = line_from_play.point(aim.position);
    let direction = line_from_play.orientation * (aim.orientation * Vec3::NEG_Z);
    if origin.z <= 0.0 || direction.z >= -1e-3 {
        return None;
    }
    let distance_m = -origin.z / direction.z;
    let at = (origin + direction * distance_m).truncate() / line.length_m;
    Some((Vec2::new(at.x + 0.5, at.y), distance_m))
}

/// Whether a place is on the panel.
fn is_on(at: Vec2) -> bool {
    (at - Vec2::new(0.5, timeline::PANEL_UP)).abs().cmple(timeline::PANEL * 0.5).all()
}

/// The hour at a place.
fn hour(lapse: &TimeLapse, along: f32) -> f64 {
    let (first, last) = lapse.span_s();
    first + (last - first) * f64::from(along.clamp(0.0, 1.0))
}

/// Takes and drags the time line; what takes it is no button for anything else.
pub(super) fn reach(
    hands: Res<XrHands>,
    play: Res<PlaySpace>,
    settings: Res<HeadsetSettings>,
    visibility: Res<HudVisibility>,
    mut controllers: ResMut<Controllers>,
    mut lapse: ResMut<TimeLapse>,
    mut reach: ResMut<Reach>,
) {
    let is_down = controllers.buttons & TRIGGER != 0;
    // There is a day to be taken, once its line is shown.
    let is_shown = visibility.shown && lapse.span_s().1 > 0.0;
    let placed = timeline::placed(&settings, &hands, &play).filter(|_| is_shown);
    let met = hands.right_aim.zip(placed).and_then(|(aim, line)| Some((aim, meet(&aim, &line)?)));
    let hovers = met.filter(|(_, (at, distance_m))| is_on(*at) && *distance_m < REACH_M);
    let mut now = Reach {
        was_down: is_down,
        holds: is_down && placed.is_some() && (reach.holds || (!reach.was_down && hovers.is_some())),
        ray: None,
    };
    if now.holds
        && let Some((_, (at, _))) = met
    {
        let clock_s = hour(&lapse, at.x);
        lapse.playing = false;
        lapse.scrub(clock_s);
    }
    let shown = if now.holds { met } else { hovers };
    now.ray = shown.map(|(aim, (_, distance_m))| (aim.position, aim.point(Vec3::NEG_Z * distance_m.min(REACH_M))));
    if now.holds {
        controllers.buttons &= !TRIGGER;
    }
    reach.set_if_neq(now);
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_bundle::display::{DisplayFile, Headset, HeadsetTimeline};

    fn line() -> Placed {
        Placed { play_from_line: Pose { position: Vec3::new(0.0, 1.0, -2.0), orientation: Quat::IDENTITY }, length_m: 0.5 }
    }

    fn aim(x: f32) -> Pose {
        Pose { position: Vec3::new(x, 1.0, 0.0), orientation: Quat::IDENTITY }
    }

    #[test]
    fn rays_meet_the_line_from_its_front() {
        let (at, distance) = meet(&aim(0.125), &line()).unwrap();
        assert!(at.distance(Vec2::new(0.75, 0.0)) < 1e-6 && (distance - 2.0).abs() < 1e-6);
        let turned = Pose { orientation: Quat::from_rotation_y(1.6), ..aim(0.0) };
        assert!(meet(&turned, &line()).is_none(), "past it");
        let behind = Pose { position: Vec3::new(0.0, 1.0, -3.0), orientation: Quat::from_rotation_y(std::f32::consts::PI) };
        assert!(meet(&behind, &line()).is_none(), "from behind");
        assert!(is_on(Vec2::new(0.0, 0.0)) && is_on(Vec2::new(1.0, 0.1)) && !is_on(Vec2::new(0.5, 0.6)));
    }

    /// An app with a time line on the floor, and the aim that meets it at a place along it.
    fn app() -> (App, impl Fn(&mut App, f32, bool)) {
        let mut app = App::new();
        let comfort = Headset { timeline: HeadsetTimeline::Floor, ..Headset::default() };
        let settings = HeadsetSettings { comfort, ..HeadsetSettings::new(&DisplayFile::default(), 1) };
        app.init_resource::<XrHands>()
            .init_resource::<PlaySpace>()
            .init_resource::<Controllers>()
            .insert_resource(crate::time_lapse::tests::lapse())
            .init_resource::<HudVisibility>()
            .init_resource::<Reach>()
            .insert_resource(settings)
            .add_systems(Update, reach);
        let point = move |app: &mut App, along: f32, down: bool| {
            let placed = timeline::placed(&settings, &XrHands::default(), &PlaySpace::default()).unwrap();
            let target = placed.play_from_line.point(Vec3::X * (along - 0.5) * placed.length_m);
            let from = Vec3::new(0.2, 1.2, -0.3);
            let orientation = Quat::from_rotation_arc(Vec3::NEG_Z, heliodon_math::frame::unit_or(target - from, Vec3::NEG_Z));
            app.insert_resource(XrHands { right_aim: Some(Pose { position: from, orientation }), ..XrHands::default() });
            app.insert_resource(Controllers { buttons: if down { 0b11 } else { 0b10 }, ..Controllers::default() });
            app.update();
        };
        (app, point)
    }

    #[test]
    fn the_trigger_takes_the_line_and_nothing_else_while_it_holds() {
        let (mut app, point) = app();
        let buttons = |app: &App| app.world().resource::<Controllers>().buttons;
        let holds = |app: &App| app.world().resource::<Reach>().holds;
        point(&mut app, 0.5, false);
        assert!(!holds(&app) && app.world().resource::<Reach>().ray.is_some(), "it hovers");
        point(&mut app, 0.5, true);
        assert!(holds(&app) && buttons(&app) == 0b10 && !app.world().resource::<TimeLapse>().playing);
        point(&mut app, 3.0, true);
        assert!(holds(&app) && buttons(&app) == 0b10, "held beyond its end");
        point(&mut app, 3.0, false);
        assert!(!holds(&app) && app.world().resource::<Reach>().ray.is_none());
        point(&mut app, 3.0, true);
        point(&mut app, 0.5, true);
        assert!(!holds(&app) && buttons(&app) == 0b11, "pressed beside it, the trigger is the wand's");
        point(&mut app, 0.5, false);
        let lapse = std::mem::take(&mut *app.world_mut().resource_mut::<TimeLapse>());
        point(&mut app, 0.5, true);
        assert!(!holds(&app) && app.world().resource::<TimeLapse>().playing, "there is no day yet");
        point(&mut app, 0.5, false);
        app.insert_resource(lapse).world_mut().resource_mut::<HudVisibility>().shown = false;
        point(&mut app, 0.5, true);
        assert!(!holds(&app) && buttons(&app) == 0b11, "hidden");
    }
}
