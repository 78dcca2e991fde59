//! Films in the scene: people who were filmed before a screen, on upright quads, and films on parts of the site.
//!
//! G. Papaioannou, A. Gaitatzes, D. Christopoulos, "Enhancing Virtual Reality Walkthroughs of Archaeological Sites", VAST 2003, section 2.2. A thread of
//! its own decodes ahead (`heliodon_film`), image and mask as one picture, so that they cannot part. Each film has one clock: its sound's where that is heard (`voice`), else time itself; the picture of
//! that time is shown. A film that was not lit by the place would glow at dusk: what it shows is taken for the colour of somebody, and multiplied by the light that
//! reaches an upright half cylinder that faces whoever looks, as far as its `lit` says.
//!
//! The paper's two passes and one pass of premultiplied alpha give the same picture, but for the rounding of the target between the two ([`Passes`]). Both work behind the tone curve, on what the display shows: what is
//! there has gone through the curve already, and a curve of a sum is not the sum of curves; so the film's own light goes through the curve first, and is
//! weighted then. On software Vulkan two passes cost twice the pixels, so that one is the default.
//!
//! Films are drawn after stone, guests and impostors, from the farthest on; between a film and an impostor that overlap the film is in front. Their shadows are those
//! of what is seen of them, as impostors' are, on what has been drawn by then; lamps cast none of them.
//! Where there is neither a room nor an actor the bundle has no light grid, and a film is lit by the open sky.

mod clock;
mod lead;
mod light;
mod load;
mod made;
mod render;
mod screen;
mod surface;
#[cfg(test)]
mod tests;
mod uniform;
mod voice;

pub use lead::Leader;
pub(crate) use render::FilmsGpu;
#[cfg(test)]
pub(crate) use render::{FilmKey, Step};
#[cfg(test)]
pub(crate) use uniform::FILM_BYTES;

use crate::actors::Actors;
use crate::costs::FrameTold;
use crate::daylight::{DaylightCamera, StereoPair};
use crate::impostor::heads;
use crate::lamps::reaching::Reach;
use crate::lamps::uniform::lit as lit_lamps;
use crate::lamps::{Lamp, Lamps, SettleLamps};
use crate::navigation::Visitor;
use crate::over_stone::let_depth_be_read;
use crate::sound::Sounds;
use crate::stage::Stage;
use crate::stage::background::Background;
use crate::stage::frame::StageFrame;
use crate::story::{Story, Wishes};
use crate::time_lapse::{Now, SettleMoment, TimeLapse};
use bevy::camera::Camera;
use bevy::core_pipeline::core_3d::{main_opaque_pass_3d, main_transparent_pass_3d};
use bevy::core_pipeline::schedule::{Core3d, Core3dSystems};
use bevy::prelude::*;
use bevy::render::extract_resource::{ExtractResource, ExtractResourcePlugin};
use bevy::render::{Render, RenderApp, RenderSystems};
use heliodon_bundle::BundleReader;
use heliodon_bundle::moment::Moment;
use heliodon_bundle::site::{Faces, Film};
use heliodon_film::Frame;
use heliodon_math::frame::unit_or;
use heliodon_script::action::Action;
use heliodon_script::event::Event;
use light::{Light, Reached, unhindered};
use load::{Loaded, Pixels};
use screen::{Passing, Screen};
use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;
use surface::Surface;
use uniform::FilmUniform;

/// WGSL of films.
pub(crate) const FILM_WGSL: &str = include_str!("film.wgsl");

/// Films that scripts may start and whose first pictures are decoded before: each takes 30 MB at 640x1280, and a process.
const MOST_PREPARED: usize = 4;
/// Where a film's light is asked for, as parts of its height: its feet, a hand above the ground, for points within stone get none, and its head.
const HEIGHTS: [f32; 2] = [0.1, 1.0];
/// A lower sun casts no shadows of films, and how long they are at the most, metres.
const LEAST_RISE: f32 = 0.03;
const LONGEST_M: f32 = 20.0;

/// How films are put into the picture.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FilmOptions {
    /// In how many passes.
    pub passes: Passes,
    /// Whether the films of bundles that are opened from now on are left out, for those who measure what films take.
    pub without: bool,
}

/// In how many passes a film is put over what is there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Passes {
    /// In one, by premultiplied alpha.
    #[default]
    Single,
    /// As in the paper: what is there is multiplied by the inverted mask, then the image is added.
    Two,
}

/// What films took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FilmTold {
    /// Films that are to be seen.
    pub films: usize,
    /// Pictures that were shown since the bundle was opened, each once.
    pub shown: u64,
    /// Pictures that were not decoded when their time had come.
    pub missed: u64,
    /// Milliseconds of the last frame that the processor took for all of them, decoding aside.
    pub ms: f32,
}

impl FilmTold {
    /// The same, with the pictures since then only.
    #[must_use]
    pub fn since(self, before: &Self) -> Self {
        Self { shown: self.shown.saturating_sub(before.shown), missed: self.missed.saturating_sub(before.missed), ..self }
    }
}

/// The films of the bundle on the stage.
#[derive(Resource, Default)]
pub struct Films {
    stage: u64,
    loading: Option<Background<Loaded>>,
    /// Added by the app, not yet on the stage.
    added: Vec<(PathBuf, Film)>,
    screens: Vec<Screen>,
    missing: HashSet<String>,
    lit: Vec<Lit>,
    told: FilmTold,
    /// What is odd or missing, for programs that show no log.
    problems: Vec<String>,
    /// Whether frames wait for their pictures: for pictures that must be right, not quick. Then no sound is heard.
    pub(crate) wait: bool,
    /// The second at which all films are, for pictures that depend on nothing before them.
    pub(crate) at_s: Option<f64>,
}

impl Films {
    /// Puts a film on the stage beside the bundle's own, until another bundle is opened; its files are in `folder`.
    pub fn add(&mut self, folder: impl Into<PathBuf>, film: Film) {
        self.added.push((folder.into(), film));
    }

    /// Starts a film from its beginning; whether there is one of that name.
    pub fn play(&mut self, name: &str) -> bool {
        let found = self.screens.iter_mut().find(|screen| screen.name() == name);
        found.map(|screen| screen.begin(false)).is_some()
    }

    /// Whether a film plays.
    #[must_use]
    pub fn is_playing(&self, name: &str) -> bool {
        self.screens.iter().any(|screen| screen.name() == name && screen.is_playing())
    }

    /// The second of a film that is shown, and where the middle of its lower edge is.
    #[must_use]
    pub fn whereabouts(&self, name: &str) -> Option<(f64, Vec3)> {
        self.screens.iter().find(|screen| screen.name() == name).map(|screen| (screen.seconds(), screen.place()))
    }

    /// What they took.
    #[must_use]
    pub fn told(&self) -> FilmTold {
        self.told
    }

    /// What was odd or missing since this was asked last.
    pub fn take_problems(&mut self) -> Vec<String> {
        std::mem::take(&mut self.problems)
    }

    /// Each is told once, for a film breaks once.
    fn tell(&mut self, problem: String) {
        warn!("{problem}");
        self.problems.push(problem);
    }

    /// Whether all films that there are have been looked into.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.loading.is_none() && self.added.is_empty()
    }
}

/// What the render world is told of a frame's films.
#[derive(Resource, Clone, Default, ExtractResource)]
pub(crate) struct FilmsFrame {
    /// Changes with the films.
    serial: u64,
    passes: Passes,
    pictures: Arc<[Picture]>,
    heads: Arc<[FilmHead]>,
    /// Where shadows come from.
    shadow: Vec3,
}

/// What a film shows.
#[derive(Clone)]
struct Picture {
    /// Which film.
    slot: usize,
    frame: Arc<Frame>,
    /// The part that shows it, and the light of its vertices.
    surface: Option<(Arc<Surface>, Arc<[Vec3]>)>,
}

/// What a head sees of them.
#[derive(Clone, Default)]
struct FilmHead {
    cameras: Vec<Entity>,
    /// From the farthest on.
    films: Vec<FilmUniform>,
    order: Vec<Drawn>,
}

/// A film as it is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Drawn {
    slot: usize,
    on_part: bool,
    casts: bool,
    straight: bool,
}

/// Shows films.
#[derive(Default)]
pub struct FilmPlugin;

impl Plugin for FilmPlugin {
    fn build(&self, app: &mut App) {
        let told = FrameTold::in_app(app);
        app.init_resource::<Films>()
            .init_resource::<FilmOptions>()
            .init_resource::<FilmsFrame>()
            .init_resource::<Wishes>()
            .init_resource::<Story>()
            .add_plugins(ExtractResourcePlugin::<FilmsFrame>::default())
            .add_systems(
                PostUpdate,
                (
                    let_depth_be_read,
                    told.of("films", follow_stage),
                    told.of("films", carry_out),
                    told.of("films", go_on),
                    told.of("films", arrange)
                        .after(SettleMoment)
                        .after(SettleLamps)
                        .after(bevy::transform::TransformSystems::Propagate)
                        .after(bevy::camera::CameraUpdateSystems),
                )
                    .chain(),
            );
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_resource::<render::FilmsGpu>()
            .add_systems(
                Render,
                told.of("films", render::prepare)
                    .in_set(RenderSystems::PrepareResources)
                    .after(crate::daylight::prepare::prepare_views),
            )
            .add_systems(
                Core3d,
                render::draw
                    .in_set(Core3dSystems::MainPass)
                    .after(main_opaque_pass_3d)
                    .after(crate::impostor::draw)
                    .before(main_transparent_pass_3d),
            );
    }
}

/// Looks into the films of another bundle, and begins with those that play from the beginning.
fn follow_stage(
    (stage, options): (Res<Stage>, Res<FilmOptions>),
    mut films: ResMut<Films>,
    mut frame: ResMut<FilmsFrame>,
    mut sounds: Option<ResMut<Sounds>>,
) {
    let films = &mut *films;
    if films.stage != stage.serial() {
        films.screens.iter_mut().for_each(|screen| screen.stop(sounds.as_deref_mut()));
        let added = std::mem::take(&mut films.added);
        *films = Films { stage: stage.serial(), added, wait: films.wait, at_s: films.at_s, ..Films::default() };
        *frame = FilmsFrame { serial: frame.serial + 1, ..default() };
        let has_any = |bundle: &&Arc<BundleReader>| !bundle.living().films.is_empty() && !options.without;
        if let Some(bundle) = stage.bundle().filter(has_any) {
            let bundle = Arc::clone(bundle);
            films.loading = Some(Background::start(move || load::run(&bundle)));
        }
    }
    if films.loading.is_none() && !films.added.is_empty() {
        let (added, bundle) = (std::mem::take(&mut films.added), stage.bundle().cloned());
        films.loading = Some(Background::start(move || {
            let mut loaded = Loaded::default();
            for (folder, film) in &added {
                loaded.take(folder, film, bundle.as_deref());
            }
            loaded
        }));
    }
    let Some(loaded) = films.loading.as_ref().and_then(Background::take) else { return };
    films.loading = None;
    let Ok(loaded) = loaded else {
        films.tell("the films' loading thread broke off".to_owned());
        return;
    };
    loaded.told.into_iter().for_each(|told| films.tell(told));
    films.missing.extend(loaded.missing);
    let paths = stage.bundle().map_or(&[][..], |bundle| &bundle.living().paths);
    let mut prepared = 0;
    for opened in loaded.films {
        let ahead = !opened.settings.plays && prepared < MOST_PREPARED;
        prepared += usize::from(ahead);
        let (screen, problem) = Screen::new(opened, paths, ahead);
        if let Some(problem) = problem {
            films.tell(format!("the film {} is not shown: {problem}", screen.name()));
        }
        films.screens.push(screen);
    }
}

/// Does what scripts ask for.
fn carry_out(
    mut films: ResMut<Films>,
    mut wishes: ResMut<Wishes>,
    mut story: ResMut<Story>,
    mut sounds: Option<ResMut<Sounds>>,
) {
    if wishes.films.is_empty() || !films.is_complete() {
        // what is asked for while films are looked into is done then
        return;
    }
    for wish in std::mem::take(&mut wishes.films) {
        let (name, plays) = match &wish {
            Action::PlayFilm { film } => (film, true),
            Action::StopFilm { film } => (film, false),
            _ => continue,
        };
        match films.screens.iter_mut().find(|screen| screen.name() == name) {
            Some(screen) => {
                screen.stop(sounds.as_deref_mut());
                if plays {
                    screen.begin(true);
                }
            }
            // what cannot be seen has ended
            None if plays => {
                if !films.missing.contains(name) {
                    warn_once!("there is no film {name}");
                }
                story.tell(Event::Ended { what: name.clone() });
            }
            None => {}
        }
    }
}

/// Time passes for all films.
fn go_on(
    time: Res<Time>,
    lapse: Res<TimeLapse>,
    mut films: ResMut<Films>,
    mut story: ResMut<Story>,
    mut sounds: Option<ResMut<Sounds>>,
    visitors: Query<&Visitor>,
    cameras: Query<&Camera, With<DaylightCamera>>,
) {
    if films.screens.is_empty() {
        return;
    }
    let start = Instant::now();
    let Films { screens, told, wait, at_s, .. } = &mut *films;
    let mut problems = Vec::new();
    let passing = Passing {
        seconds: time.delta_secs_f64(),
        hour_stands: !lapse.playing,
        waits: *wait,
        at_s: *at_s,
        seen: cameras.iter().any(|camera| camera.is_active),
        visitor: visitors.iter().next().map(|visitor| visitor.pose.eye),
    };
    let (mut shown, mut missed) = (0, 0);
    for screen in screens {
        let outcome = screen.pass(&passing, sounds.as_deref_mut());
        if let Some(problem) = outcome.problem {
            problems.push(format!("the film {} is not shown: {problem}", screen.name()));
        }
        if outcome.ended {
            story.tell(Event::Ended { what: screen.name().to_owned() });
        }
        let (own_shown, own_missed) = screen.counted();
        (shown, missed) = (shown + own_shown, missed + own_missed);
    }
    *told = FilmTold { shown, missed, ms: start.elapsed().as_secs_f32() * 1e3, ..*told };
    problems.into_iter().for_each(|problem| films.tell(problem));
}

/// Puts every film where it is and into the light that is there, for each head.
fn arrange(
    (now, stage, stage_frame): (Res<Now>, Res<Stage>, Res<StageFrame>),
    options: Res<FilmOptions>,
    (actors, lamps): (Res<Actors>, Option<Res<Lamps>>),
    mut films: ResMut<Films>,
    mut frame: ResMut<FilmsFrame>,
    cameras: Query<(Entity, &Camera, &GlobalTransform, Option<&StereoPair>), With<DaylightCamera>>,
) {
    let Some(moment) = &now.moment else { return };
    if films.screens.is_empty() {
        return;
    }
    let start = Instant::now();
    let lit_now = lamps.as_ref().map_or_else(Vec::new, |lamps| lit_lamps(lamps.all()));
    // fires flicker, and what is on a part is lit vertex by vertex
    let lamps = lamps.as_ref().map_or(&[][..], |lamps| &lamps.lamps);
    let shadow = if now.has_sun && moment.sun_direction.y > LEAST_RISE { moment.sun_direction } else { Vec3::Y };
    let light = Light {
        shadow,
        actors: &actors,
        moment,
        exposure: stage_frame.exposure_stops.exp2(),
        has_sun: now.has_sun,
        lamps: &lit_now,
        ground: stage.ground(),
    };
    let Films { screens, lit, .. } = &mut *films;
    lit.resize_with(screens.len(), Lit::default);
    let mut pictures: Vec<Picture> = Vec::new();
    let mut placed: Vec<Placed<'_>> = Vec::new();
    for (slot, (screen, lit)) in screens.iter().zip(lit).enumerate() {
        let Some(shown) = screen.picture() else { continue };
        let surface = screen.opened.surface.as_ref();
        let surface = surface.map(|surface| (Arc::clone(surface), lit.surface(surface, (moment, &actors, lamps))));
        let height_m = screen.opened.settings.height_m as f32;
        let reached = std::array::from_fn(|end| {
            let place = screen.place() + Vec3::Y * (HEIGHTS[end] * height_m);
            light.at(place, &mut lit.ends[end])
        });
        placed.push(Placed::new(slot, screen, shown, reached));
        pictures.push(Picture { slot, frame: Arc::clone(shown), surface });
    }
    let heads = heads(cameras.iter().filter(|(_, camera, ..)| camera.is_active));
    let heads: Vec<FilmHead> = heads
        .into_iter()
        .map(|head| {
            let mut order: Vec<&Placed<'_>> = placed.iter().collect();
            // what is on parts lies behind whoever stands before them
            let far =
                |placed: &Placed<'_>| if placed.on_part { f32::INFINITY } else { placed.middle().distance_squared(head.place) };
            order.sort_by(|a, b| far(b).total_cmp(&far(a)));
            FilmHead {
                cameras: head.cameras,
                films: order.iter().map(|placed| placed.seen_from(head.place, &light)).collect(),
                order: order
                    .iter()
                    .map(|placed| Drawn {
                        slot: placed.slot,
                        on_part: placed.on_part,
                        casts: placed.casts(),
                        straight: placed.straight,
                    })
                    .collect(),
            }
        })
        .collect();
    films.told.films = pictures.len();
    films.told.ms += start.elapsed().as_secs_f32() * 1e3;
    let (pictures, heads) = (pictures.into(), heads.into());
    *frame = FilmsFrame { serial: frame.serial, passes: options.passes, pictures, heads, shadow };
}

/// What is known of the light of a film from frames before.
#[derive(Debug, Default)]
struct Lit {
    /// At its feet and its head.
    ends: [Reach; 2],
    surface: Option<LitSurface>,
}

/// The light of a part's vertices, of which moment, and by which lamps.
#[derive(Debug)]
struct LitSurface {
    moment: Arc<Moment>,
    lamps: Vec<Lamp>,
    light: Arc<[Vec3]>,
}

impl Lit {
    /// The light of a part's vertices, not exposed; worked out where moment or lamps are others than before.
    fn surface(&mut self, surface: &Surface, (moment, actors, lamps): (&Arc<Moment>, &Actors, &[Lamp])) -> Arc<[Vec3]> {
        let kept = self.surface.as_ref().filter(|kept| Arc::ptr_eq(&kept.moment, moment) && kept.lamps == lamps);
        if let Some(kept) = kept {
            return Arc::clone(&kept.light);
        }
        let by_day = surface.light(moment, |place, normal| actors.light_at(moment, place).light(moment, normal));
        let by_lamps = surface.positions().zip(surface.normals()).map(|(place, normal)| unhindered(lamps, place, normal));
        let light: Arc<[Vec3]> = by_day.into_iter().zip(by_lamps).map(|(day, lamps)| day + lamps).collect();
        self.surface = Some(LitSurface { moment: Arc::clone(moment), lamps: lamps.to_vec(), light: Arc::clone(&light) });
        light
    }
}

/// A film at its place.
struct Placed<'a> {
    slot: usize,
    on_part: bool,
    settings: &'a Film,
    place: Vec3,
    /// Half of its width, and its height, metres.
    half_m: f32,
    height_m: f32,
    size: Vec2,
    opaque: bool,
    straight: bool,
    /// The light at its feet and its head.
    reached: [Reached; 2],
}

impl<'a> Placed<'a> {
    fn new(slot: usize, screen: &'a Screen, shown: &Frame, reached: [Reached; 2]) -> Self {
        let settings = &screen.opened.settings;
        let (place, height_m) = (screen.place(), settings.height_m as f32);
        let size = Vec2::new(shown.width as f32, shown.height as f32);
        Self {
            slot,
            on_part: screen.opened.surface.is_some(),
            settings,
            place,
            half_m: 0.5 * height_m * size.x / size.y.max(1.0),
            height_m,
            size,
            opaque: screen.opened.pixels == Pixels::Opaque,
            straight: screen.opened.pixels == Pixels::Straight,
            reached,
        }
    }

    /// Whether it casts a shadow: what is on a part does so as the part, and what shines by itself is no body.
    fn casts(&self) -> bool {
        !self.on_part && self.settings.lit > 0.0
    }

    fn middle(&self) -> Vec3 {
        self.place + Vec3::Y * (0.5 * self.height_m)
    }

    /// As a head sees it.
    fn seen_from(&self, head: Vec3, light: &Light<'_>) -> FilmUniform {
        let turned = (self.settings.turn_deg as f32).to_radians();
        let fixed = Vec3::new(libm::sinf(turned), 0.0, libm::cosf(turned));
        let to_head = (head - self.place) * Vec3::new(1.0, 0.0, 1.0);
        let facing = match self.settings.faces {
            Faces::Visitor => unit_or(to_head, fixed),
            Faces::Fixed => fixed,
        };
        let right = Vec3::new(facing.z, 0.0, -facing.x);
        // whoever stands behind a fixed film is lit from there
        let seen_side = if facing.dot(to_head) < 0.0 { -facing } else { facing };
        let lit = self.settings.lit as f32;
        let [feet, head] =
            self.reached.each_ref().map(|reached| Vec3::ONE.lerp(light.on_half_cylinder(reached, seen_side), lit));
        let [sky, sun] = light.on_ground(&self.reached[0]);
        FilmUniform {
            place: self.place.extend(0.0),
            right: (right * self.half_m).extend(if self.opaque { 0.0 } else { 1.0 }),
            up: Vec4::new(0.0, self.height_m, 0.0, 0.0),
            sky: sky.extend((self.height_m / light.shadow.y.max(LEAST_RISE)).min(LONGEST_M)),
            sun: sun.extend(if self.casts() { lit } else { 0.0 }),
            feet: feet.extend(lit),
            head: head.extend(light.exposure),
            size: self.size.extend(if self.on_part { 1.0 } else { 0.0 }).extend(0.0),
        }
    }
}
