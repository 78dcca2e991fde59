//! The way that a visitor is shown: discs of light on the ground that flow to its end.
//!
//! Each is laid onto whatever the picture shows at its place (air.wgsl), so steps and rubble carry it as a lantern's light; only its height is looked for, by one ray, where the way is first shown.

use crate::actors::Actors;
use crate::costs::FrameTold;
use crate::daylight::DaylightCamera;
use crate::particles::quad::{Quad, Shape};
use crate::particles::{AlsoInTheAir, ArrangeAir};
use crate::stage::Stage;
use crate::stage::ground::Ground;
use crate::story::Wishes;
use bevy::prelude::*;
use heliodon_script::action::Action;

/// From one disc to the next, metres.
const APART_M: f32 = 0.55;
/// Half the width of a disc.
const RADIUS_M: f32 = 0.17;
/// How fast they flow, metres a second.
const FLOW_M_PER_S: f32 = 0.6;
/// How far above and below the way's points the ground is looked for, metres.
const ABOVE_M: f32 = 1.5;
const BELOW_M: f32 = 4.0;
/// Heights are looked for so far apart.
const HEIGHT_M: f32 = 0.4;
/// From how far away discs fade out, and where none is left, metres.
const FAR_M: f32 = 22.0;
const FARTHEST_M: f32 = 34.0;
/// Nearer to the eye than this, seen from above, they fade.
const NEAR_M: f32 = 0.5;
/// How long a way takes to come and to go.
const FADE_S: f64 = 0.8;
/// Discs at most.
const MOST: usize = 2000;
/// What they look like: a cool light that no lamp of those days has.
const COLOR: Vec3 = Vec3::new(0.30, 0.75, 1.0);

/// The way that is shown.
#[derive(Resource, Default)]
pub struct GuideWay {
    stage: u64,
    shown: Option<Shown>,
}

/// A way, and when it came and went.
#[derive(Clone, Debug)]
struct Shown {
    name: String,
    way: Way,
    since_s: f64,
    until_s: f64,
}

/// A way upon the ground.
#[derive(Clone, Debug, Default, PartialEq)]
struct Way {
    /// Points on the ground, no farther apart than [`HEIGHT_M`], with the length up to each.
    points: Vec<(Vec3, f32)>,
}

impl GuideWay {
    /// The name of the path that is shown.
    #[must_use]
    pub fn shown(&self) -> Option<&str> {
        self.shown.as_ref().filter(|shown| shown.until_s == f64::INFINITY).map(|shown| shown.name.as_str())
    }

    /// Shows the path of a name through `points`, from a time on as [`Actors::seconds`] has it.
    pub fn show(&mut self, name: &str, points: &[Vec3], ground: &Ground, now_s: f64) {
        if self.shown() != Some(name) {
            let way = Way::new(points, ground);
            self.shown = Some(Shown { name: name.to_owned(), way, since_s: now_s, until_s: f64::INFINITY });
        }
    }

    /// Shows none any more.
    pub fn hide(&mut self, now_s: f64) {
        if let Some(shown) = &mut self.shown {
            shown.until_s = shown.until_s.min(now_s);
        }
    }
}

/// Shows ways.
#[derive(Default)]
pub struct GuideWayPlugin;

impl Plugin for GuideWayPlugin {
    fn build(&self, app: &mut App) {
        let told = FrameTold::in_app(app);
        app.init_resource::<GuideWay>().add_systems(
            PostUpdate,
            (told.of("ways", obey), told.of("ways", lay))
                .chain()
                .after(bevy::transform::TransformSystems::Propagate)
                .before(ArrangeAir),
        );
    }
}

/// Shows what scripts ask for.
fn obey(stage: Res<Stage>, wishes: Option<ResMut<Wishes>>, actors: Res<Actors>, mut guide: ResMut<GuideWay>) {
    if guide.stage != stage.serial() {
        *guide = GuideWay { stage: stage.serial(), shown: None };
    }
    // heights are known once all of the ground is there; until then the wish waits
    let Some((mut wishes, ground)) = wishes.filter(|wishes| !wishes.guides.is_empty()).zip(stage.footing()) else { return };
    let Some(bundle) = stage.bundle() else { return };
    for wish in std::mem::take(&mut wishes.guides) {
        match &wish {
            Action::Guide { path } => match bundle.living().paths.iter().find(|way| way.name == *path) {
                Some(way) => {
                    let points: Vec<Vec3> = way.points.iter().map(|point| Vec3::from(point.map(|v| v as f32))).collect();
                    guide.show(path, &points, ground, actors.seconds);
                }
                None => warn_once!("there is no path {path}"),
            },
            _ => guide.hide(actors.seconds),
        }
    }
}

/// Lays the discs of a frame.
fn lay(
    actors: Res<Actors>,
    mut guide: ResMut<GuideWay>,
    mut air: ResMut<AlsoInTheAir>,
    cameras: Query<(&Camera, &GlobalTransform), With<DaylightCamera>>,
) {
    let Some(shown) = &guide.shown else { return };
    let now_s = actors.seconds;
    if now_s > shown.until_s + FADE_S {
        guide.shown = None;
        return;
    }
    let come = ((now_s - shown.since_s) / FADE_S).clamp(0.0, 1.0);
    let left = ((shown.until_s + FADE_S - now_s) / FADE_S).clamp(0.0, 1.0);
    let eyes: Vec<Vec3> =
        cameras.iter().filter(|(camera, _)| camera.is_active).map(|(_, transform)| transform.translation()).collect();
    let presence = come.min(left) as f32;
    air.0.extend(shown.way.discs(now_s, &eyes).map(|(place, strength)| {
        let shown = strength * presence;
        // a display's brightness, whatever the hour: it is a sign, not a lamp
        Quad::new(Shape::Mark, place, RADIUS_M, 0.0).glowing(COLOR * (0.9 * shown), 0.45 * shown)
    }));
}

impl Way {
    /// The way through points, upon the ground.
    fn new(points: &[Vec3], ground: &Ground) -> Self {
        let mut way = Self::default();
        let mut length_m = 0.0;
        for pair in points.windows(2) {
            let span = pair[0].distance(pair[1]);
            let pieces = (span / HEIGHT_M).ceil().max(1.0);
            for piece in 0..pieces as u32 {
                let part = piece as f32 / pieces;
                way.points.push((upon(ground, pair[0].lerp(pair[1], part)), length_m + part * span));
            }
            length_m += span;
        }
        if let Some(last) = points.last() {
            way.points.push((upon(ground, *last), length_m));
        }
        way
    }

    /// The length of the way, metres.
    fn length_m(&self) -> f32 {
        self.points.last().map_or(0.0, |(_, length_m)| *length_m)
    }

    /// The place so far along it.
    fn at(&self, along_m: f32) -> Vec3 {
        let next = self.points.partition_point(|(_, length_m)| *length_m <= along_m);
        match (self.points.get(next.wrapping_sub(1)), self.points.get(next)) {
            (Some((a, from)), Some((b, to))) => a.lerp(*b, (along_m - from) / (to - from).max(1e-6)),
            (Some((only, _)), None) | (None, Some((only, _))) => *only,
            (None, None) => Vec3::ZERO,
        }
    }

    /// Where discs lie at a time, and how strong each is, from 0 to 1; none where nobody of `eyes` sees it.
    fn discs(&self, now_s: f64, eyes: &[Vec3]) -> impl Iterator<Item = (Vec3, f32)> {
        let length_m = self.length_m();
        let first = (now_s * f64::from(FLOW_M_PER_S)).rem_euclid(f64::from(APART_M)) as f32;
        let count = ((length_m - first) / APART_M).max(0.0) as usize + 1;
        (0..count.min(MOST)).filter_map(move |number| {
            let along = first + number as f32 * APART_M;
            let place = self.at(along.min(length_m));
            let off = |eye: &Vec3| (place - *eye).with_y(0.0).length();
            let nearest = eyes.iter().map(off).fold(f32::INFINITY, f32::min);
            let far = ((FARTHEST_M - nearest) / (FARTHEST_M - FAR_M)).clamp(0.0, 1.0);
            let near = ((nearest - 0.2) / NEAR_M).clamp(0.0, 1.0);
            // they come out of nothing at the beginning, and go into the goal
            let ends = (along / APART_M).min((length_m - along) / APART_M).clamp(0.0, 1.0);
            let strength = far * near * ends;
            (strength > 0.0).then_some((place, strength))
        })
    }
}

/// The ground at a point of a way, or the point itself where there is none.
fn upon(ground: &Ground, point: Vec3) -> Vec3 {
    let touch = ground.cast(point + Vec3::Y * ABOVE_M, Vec3::NEG_Y, ABOVE_M + BELOW_M);
    touch.map_or(point, |touch| point + Vec3::Y * (ABOVE_M - touch.distance))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn way() -> Way {
        Way::new(&[Vec3::ZERO, Vec3::X * 10.0, Vec3::new(10.0, 0.0, 5.0)], &Ground::default())
    }

    #[test]
    fn discs_flow_to_the_end_of_the_way() {
        let way = way();
        assert!((way.length_m() - 15.0).abs() < 1e-4);
        assert!(way.at(12.0).abs_diff_eq(Vec3::new(10.0, 0.0, 2.0), 1e-4));
        let eye = [Vec3::new(3.0, 1.7, 4.0)];
        let at = |now_s: f64| way.discs(now_s, &eye).map(|(place, _)| place).collect::<Vec<_>>();
        let (before, after) = (at(7.0), at(7.1));
        assert!((20..=28).contains(&before.len()), "{}", before.len());
        // the ones along X have gone on by what flows in a tenth of a second
        let flowed = before
            .iter()
            .filter(|a| a.x > 1.0 && a.x < 9.0)
            .all(|a| after.iter().any(|b| (b.x - a.x - 0.1 * FLOW_M_PER_S).abs() < 1e-3));
        assert!(flowed);
    }

    #[test]
    fn discs_fade_far_away_and_under_the_feet() {
        let way = way();
        let strongest = |eye: Vec3| way.discs(3.0, &[eye]).map(|(_, strength)| strength).fold(0.0, f32::max);
        assert_eq!(strongest(Vec3::new(5.0, 1.7, 60.0)), 0.0);
        assert!(strongest(Vec3::new(5.0, 1.7, 30.0)) < 0.75);
        assert_eq!(strongest(Vec3::new(5.0, 1.7, 3.0)), 1.0);
        let under = way.at(5.0);
        let near = way.discs(3.0, &[under + Vec3::Y * 1.7]).find(|(place, _)| place.distance(under) < 0.3);
        assert!(near.is_none_or(|(_, strength)| strength < 0.3), "{near:?}");
    }

    #[test]
    fn a_way_is_shown_until_none_is() {
        let mut guide = GuideWay::default();
        guide.show("round", &[Vec3::ZERO, Vec3::X], &Ground::default(), 1.0);
        assert_eq!(guide.shown(), Some("round"));
        guide.hide(5.0);
        assert_eq!(guide.shown(), None);
    }
}
