//! The text in the corner, and the help.

use super::{FAINT, HudVisibility, INK, PANEL, clock_text};
use crate::actors::{Actors, Told};
use crate::control::Control;
use crate::culling::{Amount, Culling, CullingTold, Saved};
use crate::input::{Input, Trigger, WandInput};
use crate::navigation::Visitor;
use crate::particles::{Particles, ParticlesTold};
use crate::sky::SkyMaps;
use crate::stage::frame::StageFrame;
use crate::stage::{Stage, StageStatus};
use crate::time_lapse::exposure::Exposure;
use crate::time_lapse::{Blend, Now, TimeLapse};
use crate::tonemap::ToneCurve;
use crate::tracking::{PictureLatency, Trackers};
use bevy::prelude::*;
use bevy::window::PrimaryWindow;
use heliodon_bundle::display::Navigation;
use heliodon_track::follow::State;

/// The hour, in large letters.
#[derive(Component)]
pub(super) struct HourText;
/// Everything else.
#[derive(Component)]
pub(super) struct DetailText;
/// What Tab hides.
#[derive(Component)]
pub(super) struct HudRoot;
/// What H shows.
#[derive(Component)]
pub(super) struct HelpRoot;

/// What is bound, and what it does.
#[derive(Component, Clone, Copy, PartialEq, Eq)]
pub(super) enum HelpColumn {
    Bound,
    Does,
}

/// Lists what is bound: what a desk has, and what of the rest is there.
pub(super) fn list_help(input: Res<Input>, wand: Res<WandInput>, mut columns: Query<(&HelpColumn, &mut Text)>) {
    if !input.is_changed() && !wand.is_changed() {
        return;
    }
    let lines = input.bindings.help(|trigger| match trigger {
        Trigger::Pad(_) | Trigger::Stick(..) => input.has_pad,
        Trigger::Wand(_) | Trigger::WandStick(..) | Trigger::WandFlick(_) => wand.present,
        Trigger::Flick(_) => input.settings.air_mouse,
        _ => true,
    });
    let (bound, does): (Vec<String>, Vec<&str>) = lines.into_iter().unzip();
    for (column, mut text) in &mut columns {
        text.set_if_neq(Text(match column {
            HelpColumn::Bound => bound.join("\n"),
            HelpColumn::Does => does.join("\n"),
        }));
    }
}

/// The smallest window that has room for text and timeline.
const LEAST_PX: Vec2 = Vec2::new(300.0, 230.0);

/// The narrowest window in which text and help stand side by side.
const BOTH_PX: f32 = 1000.0;

/// How often the frame time is told, in seconds: figures that change with every frame cannot be read.
pub(super) const TELL_EVERY_S: f32 = 0.4;

pub(super) fn text(size: f32, color: Color) -> (Text, TextFont, TextColor) {
    (Text::default(), TextFont::from_font_size(size), TextColor(color))
}

pub(super) fn spawn(mut commands: Commands) {
    commands
        .spawn((
            HudRoot,
            Node {
                position_type: PositionType::Absolute,
                top: px(14),
                left: px(14),
                padding: UiRect::axes(px(12), px(8)),
                flex_direction: FlexDirection::Column,
                border_radius: BorderRadius::all(px(6)),
                ..default()
            },
            BackgroundColor(PANEL),
        ))
        .with_children(|parent| {
            parent.spawn((HourText, text(26.0, INK)));
            parent.spawn((DetailText, text(13.0, INK)));
            parent.spawn(super::costs::block());
        });
    commands
        .spawn((
            HelpRoot,
            Visibility::Hidden,
            Node {
                position_type: PositionType::Absolute,
                top: px(14),
                right: px(14),
                padding: UiRect::axes(px(16), px(12)),
                column_gap: px(18),
                border_radius: BorderRadius::all(px(6)),
                ..default()
            },
            BackgroundColor(PANEL),
        ))
        .with_children(|parent| {
            parent.spawn((HelpColumn::Bound, text(13.0, INK)));
            parent.spawn((HelpColumn::Does, text(13.0, FAINT)));
        });
}

pub(super) fn show_parts(
    visibility: Res<HudVisibility>,
    windows: Query<&Window, With<PrimaryWindow>>,
    mut hud: Query<&mut Visibility, (With<HudRoot>, Without<HelpRoot>)>,
    mut help: Query<&mut Visibility, (With<HelpRoot>, Without<HudRoot>)>,
) {
    // In a window too small for both, text and timeline would lie on each other.
    let room = windows.iter().all(|window| window.width() >= LEAST_PX.x && window.height() >= LEAST_PX.y);
    let narrow = windows.iter().any(|window| window.width() < BOTH_PX);
    let seen = |shown: bool| if shown { Visibility::Inherited } else { Visibility::Hidden };
    hud.iter_mut().for_each(|mut part| {
        part.set_if_neq(seen(visibility.shown && room && !(visibility.help && narrow)));
    });
    help.iter_mut().for_each(|mut part| {
        part.set_if_neq(seen(visibility.help));
    });
}

/// Mean frame time since it was last told.
#[derive(Default)]
pub(super) struct FrameTimes {
    frames: u32,
    seconds: f32,
    told_ms: f32,
    told_actors: Told,
    told_air: ParticlesTold,
    told_saved: Saved,
    told_trackers: String,
}

/// A line for each tracker, and one for orders from outside.
fn told_trackers(trackers: Option<&Trackers>, picture_ms: Option<f64>, control: Option<&Control>) -> String {
    let mut text = String::new();
    for (name, statistics, bodies) in trackers.into_iter().flat_map(Trackers::told) {
        let seen = bodies.iter().map(|(body, state)| match state {
            State::Tracked => format!("{} followed", body.name()),
            State::Lost { for_s } => format!("{} lost for {for_s:.0} s", body.name()),
            State::Never => format!("{} not seen yet", body.name()),
        });
        let seen = seen.collect::<Vec<_>>().join(", ");
        // A screen has no room for a long name.
        text += &format!("\n{:<9.9} {seen}", name);
        if let Some(latency_s) = statistics.latency_s.filter(|_| bodies.iter().any(|(_, state)| *state == State::Tracked)) {
            text += &format!(", {:.0} ms ago", latency_s * 1e3);
        }
        let dropped = statistics.malformed + statistics.invalid;
        if dropped > 0 {
            text += &format!(", {dropped} dropped");
        }
        if statistics.refused_jumps > 0 {
            text += &format!(", {} jumps", statistics.refused_jumps);
        }
    }
    if let Some(ms) = picture_ms.filter(|_| trackers.is_some()) {
        text += &format!("\nlatency   {ms:.0} ms from tracker to picture");
    }
    for fault in trackers.into_iter().flat_map(Trackers::faults) {
        text += &format!("\n{fault}");
    }
    if let Some(control) = control {
        let counted = control.counted();
        text += &format!("\norders    {} done, {} refused", counted.done, counted.refused);
    }
    text
}

#[expect(clippy::too_many_arguments, reason = "a system's arguments are its resources")]
pub(super) fn tell(
    time: Res<Time<Real>>,
    stage: Res<Stage>,
    now: Res<Now>,
    lapse: Res<TimeLapse>,
    exposure: Res<Exposure>,
    frame: Res<StageFrame>,
    maps: Res<SkyMaps>,
    (actors, particles): (Res<Actors>, Option<Res<Particles>>),
    (culling, saved): (Res<Culling>, Res<CullingTold>),
    (trackers, control): (Option<Res<Trackers>>, Option<Res<Control>>),
    latency: Option<Res<PictureLatency>>,
    visitors: Query<&Visitor>,
    mut times: Local<FrameTimes>,
    mut hours: Query<&mut Text, (With<HourText>, Without<DetailText>)>,
    mut details: Query<&mut Text, (With<DetailText>, Without<HourText>)>,
) {
    times.frames += 1;
    times.seconds += time.delta_secs();
    if times.seconds >= TELL_EVERY_S {
        let told_ms = times.seconds * 1e3 / times.frames as f32;
        let told_trackers =
            told_trackers(trackers.as_deref(), latency.and_then(|latency| latency.median_ms()), control.as_deref());
        let told_air = particles.map_or_else(default, |particles| particles.told());
        let (told_actors, told_saved) = (actors.told(), saved.last());
        *times = FrameTimes { told_ms, told_actors, told_air, told_saved, told_trackers, ..default() };
    }
    let hour = if now.moment.is_some() { clock_text(lapse.clock_s) } else { "no bundle".to_owned() };
    for mut text in &mut hours {
        text.set_if_neq(Text(hour.clone()));
    }
    let told = Detail {
        sun_height_deg: now.moment.as_ref().filter(|_| now.has_sun).map(|m| m.sun_direction.y.asin().to_degrees()),
        exposure: *exposure,
        frame_ms: times.told_ms,
        actors: times.told_actors,
        air: times.told_air,
        culling: *culling,
        saved: times.told_saved,
        is_culling_known: saved.is_ready(),
        lapse: &lapse,
        curve: frame.curve,
        status: stage.status(),
        sky_failure: maps.first_failure(),
        visitor: visitors.iter().next(),
        trackers: &times.told_trackers,
    }
    .to_string();
    for mut text in &mut details {
        text.set_if_neq(Text(told.clone()));
    }
}

/// What the smaller letters say.
struct Detail<'a> {
    sun_height_deg: Option<f32>,
    exposure: Exposure,
    frame_ms: f32,
    actors: Told,
    air: ParticlesTold,
    culling: Culling,
    saved: Saved,
    is_culling_known: bool,
    lapse: &'a TimeLapse,
    curve: ToneCurve,
    status: &'a StageStatus,
    sky_failure: Option<&'a str>,
    visitor: Option<&'a Visitor>,
    trackers: &'a str,
}

/// What of the triangles in view culling leaves out, and how much in how many clusters. While occluders and objects are still
/// sought, nothing is left out.
fn write_culling(f: &mut std::fmt::Formatter<'_>, culling: Culling, saved: &Saved, is_known: bool) -> std::fmt::Result {
    if is_known && saved.met.triangles == 0 {
        return Ok(());
    }
    let part = |amount: Amount| {
        let percent = 100.0 * amount.triangles as f64 / saved.met.triangles as f64;
        format!("{percent:.0} % ({} triangles, {} clusters)", amount.triangles, amount.clusters)
    };
    match (culling.shadow, is_known) {
        (true, true) => write!(f, "\nhidden    {}, {} occluders", part(saved.hidden), saved.occluders)?,
        (true, false) => write!(f, "\nhidden    not yet known")?,
        (false, _) => write!(f, "\nhidden    drawn")?,
    }
    match (culling.contribution, is_known) {
        (true, true) => write!(f, "\nsmall     {}, below {} px", part(saved.small), culling.threshold_px),
        (true, false) => write!(f, "\nsmall     not yet known"),
        (false, _) => write!(f, "\nsmall     drawn"),
    }
}

impl std::fmt::Display for Detail<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.sun_height_deg {
            Some(height) => writeln!(f, "sun       {height:+.1} deg")?,
            None => writeln!(f, "sun       none")?,
        }
        write!(f, "exposure  {:+.2} stops", self.exposure.stops())?;
        if self.exposure.held {
            write!(f, ", held")?;
        } else if self.exposure.manual_stops != 0.0 {
            write!(f, " ({:+.2} by hand)", self.exposure.manual_stops)?;
        }
        write!(f, "\nframe     {:.1} ms\nday       ", self.frame_ms)?;
        if self.lapse.playing {
            write!(f, "{:.0} s", self.lapse.day_seconds / self.lapse.speed.abs())?;
        } else {
            write!(f, "paused")?;
        }
        if self.lapse.blend == Blend::Hard {
            write!(f, ", hard steps")?;
        }
        if self.curve == ToneCurve::Filmic {
            write!(f, ", filmic")?;
        }
        if let Some(visitor) = self.visitor {
            let gait = match visitor.gait {
                Navigation::Window => "window",
                Navigation::Walk => "walk",
                Navigation::Fly => "fly",
                Navigation::Guided => "guided",
            };
            let place = if visitor.in_room { ", in the room" } else { "" };
            write!(f, "\n{gait:<10}{:.1} m/s{place}", visitor.pace_m_s)?;
        }
        let Told { actors, directions, vertices, ms } = self.actors;
        if actors > 0 {
            write!(f, "\nactors    {actors}: k {directions}, {vertices} vertices, {ms:.1} ms")?;
        }
        let ParticlesTold { sources, particles, ms, .. } = self.air;
        if sources > 0 {
            write!(f, "\nair       {sources}: {particles} particles, {ms:.1} ms")?;
        }
        write!(f, "{}", self.trackers)?;
        // of what is not yet shown there is nothing to cull
        if self.is_culling_known || matches!(self.status, StageStatus::Ready) {
            write_culling(f, self.culling, &self.saved, self.is_culling_known)?;
        }
        if let Some(why) = self.sky_failure {
            write!(f, "\n{why}")?;
        }
        match self.status {
            StageStatus::Loading { done, total } => write!(f, "\nloading   {done} of {total}"),
            StageStatus::Failed(what) => write!(f, "\n{what}"),
            StageStatus::Empty | StageStatus::Ready => write!(f, "\nH         help"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Lines(Culling, Saved, bool);

    impl std::fmt::Display for Lines {
        fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            write_culling(f, self.0, &self.1, self.2)
        }
    }

    #[test]
    fn what_is_left_out_is_told_once_it_is_known() {
        let of = |triangles: u64| Amount { clusters: triangles / 10, triangles };
        let saved = Saved { met: of(400), small: of(0), hidden: of(100), occluders: 12 };
        let told = |culling: Culling, saved: Saved, is_known: bool| Lines(culling, saved, is_known).to_string();
        let known = told(Culling::exact(), saved, true);
        assert_eq!(known, "\nhidden    25 % (100 triangles, 10 clusters), 12 occluders\nsmall     drawn");
        let sought = told(Culling::default(), Saved::default(), false);
        assert_eq!(sought, "\nhidden    not yet known\nsmall     not yet known");
        assert_eq!(told(Culling::none(), Saved::default(), false), "\nhidden    drawn\nsmall     drawn");
        assert_eq!(told(Culling::default(), Saved::default(), true), "", "nothing in view");
    }
}
