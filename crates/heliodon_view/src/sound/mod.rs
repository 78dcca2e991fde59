//! What is heard: the site's sounds at their places, behind what hides them, in rooms with an echo, and its ambience by the hour.
//!
//! `heliodon_sound` mixes them for two ears on a thread of its own; here it is told where the visitor's head is, what stands between it and a source,
//! and what scripts ask for. `HELIODON_AUDIO` names a device, or `off`.

mod load;

use crate::actors::Actors;
use crate::impostor::Impostors;
use crate::navigation::Visitor;
use crate::stage::Stage;
use crate::stage::background::Background;
use crate::stage::ground::Ground;
use crate::story::{Story, Wishes};
use crate::time_lapse::TimeLapse;
use bevy::platform::cell::SyncCell;
use bevy::prelude::*;
use heliodon_bundle::BundleReader;
use heliodon_bundle::site::{Echo, SoundSource, Walls as SiteWalls};
use heliodon_math::frame::unit_or;
use heliodon_script::action::Action;
use heliodon_script::event::Event;
use heliodon_sound::feed::FeedReader;
use heliodon_sound::mixer::DayCurve;
use heliodon_sound::output::{Output, OutputSettings};
use heliodon_sound::room::{Room, Walls};
use heliodon_sound::{BedId, Clip, Clock, Content, Control, ControlError, MixerSettings, SourceId, SourceSettings, Travel};
use std::sync::Arc;

/// The environment's word on where sound goes.
pub const AUDIO_VARIABLE: &str = "HELIODON_AUDIO";
/// Sources of which it is asked in a frame what hides them.
const ASKED_A_FRAME: usize = 2;
/// How far beside a source rays go to tell whether it is partly hidden, metres.
const BESIDE_M: f32 = 0.4;
/// What lies so near to a source is what it lies on, metres.
const OFF_M: f32 = 0.25;
/// Sounds of scripts that may sound at once.
const MOST_PLAYED: usize = 256;

/// What the visitor hears.
#[derive(Resource, Default)]
pub struct Sounds {
    stage: u64,
    loading: Option<Background<load::Loaded>>,
    /// A mixer's queues have one teller at a time.
    hall: Option<SyncCell<Hall>>,
}

/// A mixer at work.
struct Hall {
    control: Control,
    /// Plays the mixer while it is there.
    output: Option<Output>,
    sounds: Vec<(SoundSource, Arc<Clip>)>,
    playing: Vec<Playing>,
    /// Ambience, and which of the sounds it is.
    beds: Vec<(usize, BedId)>,
    /// What comes from outside, such as films' sounds, and where.
    feeds: Vec<(SourceId, Vec3)>,
    /// Whose turn it is to be asked for.
    turn: usize,
}

/// Something that sounds.
struct Playing {
    id: SourceId,
    /// Which of the sounds.
    sound: usize,
    /// Where; none goes with the head.
    place: Option<Vec3>,
    /// Whether the place is that of whom the sound comes from.
    follows: bool,
    gain: f32,
    curve: Option<DayCurve>,
    /// Whether a script hears of its end.
    asked: bool,
}

/// Lets sounds be heard.
#[derive(Default)]
pub struct SoundPlugin;

impl Plugin for SoundPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Sounds>().init_resource::<Wishes>().init_resource::<Story>();
        app.add_systems(PostUpdate, (follow_stage, play, hear).chain());
    }
}

impl Sounds {
    /// What a test's own mixer is told by.
    #[cfg(test)]
    pub(crate) fn heard_by(control: Control) -> Self {
        let hall = Hall::new(control, None, Vec::new(), &[]);
        Self { hall: Some(SyncCell::new(hall)), ..Self::default() }
    }

    /// Whether it is not known yet what can be heard.
    pub(crate) fn is_loading(&self) -> bool {
        self.loading.is_some()
    }

    /// Lets something from outside be heard at a place, in step with its picture. None where nothing is heard.
    pub(crate) fn join(&mut self, reader: FeedReader, place: Vec3, gain: f32) -> Option<SourceId> {
        let hall = self.hall.as_mut().map(SyncCell::get)?;
        let (gain, travel) = (gain.clamp(0.0, 64.0), Travel::Immediate);
        let settings = SourceSettings { place, gain, travel, ..SourceSettings::default() };
        let id = told("of a film", hall.control.add(Content::Feed(Box::new(reader)), &settings))?;
        hall.feeds.push((id, place));
        Some(id)
    }

    /// Where it is now.
    pub(crate) fn move_feed(&mut self, id: SourceId, place: Vec3) {
        let Some(hall) = self.hall.as_mut().map(SyncCell::get) else { return };
        for (_, at) in hall.feeds.iter_mut().filter(|(known, at)| *known == id && *at != place) {
            *at = place;
            told("of a film", hall.control.place(id, place).or_else(gone));
        }
    }

    /// Whether it stands still.
    pub(crate) fn pause_feed(&mut self, id: SourceId, paused: bool) {
        let Some(hall) = self.hall.as_mut().map(SyncCell::get) else { return };
        let change = if paused { hall.control.stop(id) } else { hall.control.start(id) };
        told("of a film", change.or_else(gone));
    }

    /// It is heard no more.
    pub(crate) fn leave(&mut self, id: SourceId) {
        let Some(hall) = self.hall.as_mut().map(SyncCell::get) else { return };
        hall.feeds.retain(|(known, _)| *known != id);
        told("of a film", hall.control.remove(id).or_else(gone));
    }

    /// Which moment is heard; none where nothing is.
    pub(crate) fn clock(&mut self) -> Option<Clock> {
        self.hall.as_mut().map(|hall| hall.get().control.clock())
    }
}

/// Reads the sounds of another bundle, and begins with those that are there from the beginning.
fn follow_stage(stage: Res<Stage>, mut sounds: ResMut<Sounds>) {
    if sounds.stage != stage.serial() {
        *sounds = Sounds { stage: stage.serial(), ..Sounds::default() };
        let has_any = |bundle: &&Arc<BundleReader>| {
            let living = bundle.living();
            !living.sounds.is_empty() || living.films.iter().any(|film| film.volume > 0.0)
        };
        if let Some(bundle) = stage.bundle().filter(has_any) {
            let bundle = Arc::clone(bundle);
            sounds.loading = Some(Background::start(move || load::run(&bundle)));
        }
    }
    let Some(loaded) = sounds.loading.as_ref().and_then(Background::take) else { return };
    sounds.loading = None;
    let Ok(loaded) = loaded else {
        warn!("the sounds' loading thread broke off");
        return;
    };
    loaded.failures.iter().for_each(|failure| warn!("{failure}"));
    let (control, mixer) = MixerSettings::default().build();
    let settings = OutputSettings::from_setting(std::env::var(AUDIO_VARIABLE).ok().as_deref());
    let output = Output::start(mixer, &settings).map_err(|error| warn!("nothing is heard: {error}")).ok();
    let echoes = stage.bundle().map_or(&[][..], |bundle| &bundle.living().echoes);
    sounds.hall = Some(SyncCell::new(Hall::new(control, output, loaded.sounds, echoes)));
}

/// A box with an echo as the mixer knows it.
fn room(echo: &Echo) -> Room {
    let [min, max] = [echo.min, echo.max].map(|corner| Vec3::from(corner.map(|v| v as f32)));
    let walls = match echo.walls {
        SiteWalls::Stone => Walls::Stone,
        SiteWalls::Plaster => Walls::Plaster,
        SiteWalls::Wood => Walls::Wood,
        SiteWalls::Soft => Walls::Soft,
    };
    Room { wet: echo.level as f32, ..Room::with_walls(&echo.name, min, max, walls) }
}

/// A sound's level through the day.
fn curve(sound: &SoundSource) -> Option<DayCurve> {
    let points: Vec<(f32, f32)> =
        sound.hours.iter().map(|(time, level)| (time.seconds() as f32 / 3600.0, (*level as f32).min(4.0))).collect();
    if points.is_empty() {
        return None;
    }
    DayCurve::new(&points).map_err(|error| warn!("the hours of the sound {}: {error}", sound.name)).ok()
}

/// Tells what could not be done, the first time: a full mixer is no reason to stop.
fn told<T>(what: &str, result: Result<T, ControlError>) -> Option<T> {
    result.map_err(|error| warn_once!("the sound {what}: {error}")).ok()
}

impl Hall {
    fn new(mut control: Control, output: Option<Output>, sounds: Vec<(SoundSource, Arc<Clip>)>, echoes: &[Echo]) -> Self {
        let rooms: Vec<Room> = echoes.iter().map(room).collect();
        told("of rooms", control.rooms(&rooms));
        let mut hall = Self { control, output, sounds, playing: Vec::new(), beds: Vec::new(), feeds: Vec::new(), turn: 0 };
        for sound in 0..hall.sounds.len() {
            let settings = &hall.sounds[sound].0;
            match (settings.plays, settings.repeat && settings.place.is_none() && settings.from.is_none()) {
                (true, true) => hall.surround(sound),
                (true, false) => hall.begin(sound, None, 1.0, false),
                (false, _) => {}
            }
        }
        hall
    }

    /// Begins a sound: at a place, its own unless another is given, or with the head.
    fn begin(&mut self, sound: usize, at: Option<Vec3>, volume: f32, asked: bool) {
        let (settings, clip) = &self.sounds[sound];
        let own = settings.place.map(|place| Vec3::from(place.map(|v| v as f32)));
        // until it is known where they are
        let elsewhere = settings.from.as_ref().map(|_| Vec3::ZERO);
        let place = at.or(own).or(elsewhere);
        let gain = settings.volume as f32 * volume;
        let source = SourceSettings {
            place: place.unwrap_or_default(),
            gain: gain.clamp(0.0, 64.0),
            reference_m: settings.reference_m as f32,
            // what goes with the head is as loud everywhere
            rolloff: if place.is_some() { 1.0 } else { 0.0 },
            looping: settings.repeat,
            ..SourceSettings::default()
        };
        let (follows, curve) = (at.is_none() && settings.from.is_some(), curve(settings));
        let added = self.control.add(Content::Clip(Arc::clone(clip)), &source);
        if let Some(id) = told(&settings.name, added) {
            self.playing.push(Playing { id, sound, place, follows, gain, curve, asked });
        }
    }

    /// Begins what goes on all around, each ear its own.
    fn surround(&mut self, sound: usize) {
        let (settings, clip) = &self.sounds[sound];
        let curve = curve(settings).unwrap_or_else(|| DayCurve::constant(1.0));
        let gain = (settings.volume as f32).min(4.0);
        let added = self.control.add_bed(Content::Clip(Arc::clone(clip)), curve, gain, true);
        self.beds.extend(told(&settings.name, added).map(|id| (sound, id)));
    }

    /// Does what a script asks for.
    fn carry_out(&mut self, action: &Action) {
        let number = |name: &str| self.sounds.iter().position(|(sound, _)| sound.name == name);
        match action {
            Action::PlaySound { sound, at, volume } => {
                if self.playing.len() < MOST_PLAYED
                    && let Some(number) = number(sound)
                {
                    self.begin(number, at.map(Vec3::from), *volume, true);
                }
            }
            Action::StopSound { sound } => {
                let number = number(sound);
                for playing in self.playing.iter_mut().filter(|playing| Some(playing.sound) == number) {
                    playing.asked = false;
                    // one that has ended in the meantime is as silent
                    self.control.remove(playing.id).ok();
                }
                for (_, bed) in self.beds.extract_if(.., |(sound, _)| Some(*sound) == number) {
                    told(sound, self.control.remove_bed(bed));
                }
            }
            _ => {}
        }
    }

    /// The names of the sounds that have come to their end.
    fn ended(&mut self) -> Vec<String> {
        self.control.collect();
        let over = self.control.take_finished();
        let mut names = Vec::new();
        self.playing.retain(|playing| {
            let ended = over.contains(&playing.id) || !self.control.exists(playing.id);
            if ended && playing.asked {
                names.push(self.sounds[playing.sound].0.name.clone());
            }
            !ended
        });
        names
    }

    /// Lets what comes from somebody go with them.
    fn go_along(&mut self, whereabouts: impl Fn(&str) -> Option<Vec3>) {
        for playing in self.playing.iter_mut().filter(|playing| playing.follows) {
            let from = self.sounds[playing.sound].0.from.as_deref();
            if let Some(place) = from.and_then(&whereabouts).filter(|place| playing.place != Some(*place)) {
                playing.place = Some(place);
                told("of whom it comes from", self.control.place(playing.id, place).or_else(gone));
            }
        }
    }

    /// Where the head is, what hides the sources from it, and how loud the hour is.
    fn listen(&mut self, head: Vec3, orientation: Quat, ground: Option<&Ground>, hour: f32) {
        told("of the head", self.control.listener(head, orientation));
        told("of the hour", self.control.hour(hour));
        for playing in &self.playing {
            if let Some(curve) = &playing.curve {
                told("of the hour", self.control.gain(playing.id, playing.gain * curve.at(hour)).or_else(gone));
            }
            if playing.place.is_none() {
                told("of the head", self.control.place(playing.id, head).or_else(gone));
            }
        }
        let Some(ground) = ground else { return };
        let count = self.playing.len() + self.feeds.len();
        for _ in 0..ASKED_A_FRAME.min(count) {
            self.turn = (self.turn + 1) % count;
            let playing = self.playing.get(self.turn).map(|playing| (playing.id, playing.place));
            let feed = || self.feeds.get(self.turn - self.playing.len()).map(|(id, place)| (*id, Some(*place)));
            if let Some((id, Some(place))) = playing.or_else(feed) {
                let hidden = hidden(ground, head, place);
                told("of what hides it", self.control.occlusion(id, hidden).or_else(gone));
            }
        }
    }
}

/// A source that has ended in the meantime is no fault.
fn gone(error: ControlError) -> Result<(), ControlError> {
    if error == ControlError::Gone { Ok(()) } else { Err(error) }
}

/// The share of rays from a head to a source and beside it that something stops.
fn hidden(ground: &Ground, head: Vec3, source: Vec3) -> f32 {
    let away = source - head;
    if away.length() <= OFF_M {
        return 0.0;
    }
    let side = away.cross(Vec3::Y).normalize_or(Vec3::X) * BESIDE_M;
    let points = [source, source + side, source - side, source + Vec3::Y * BESIDE_M];
    let stopped = points.iter().filter(|&&point| {
        let along = point - head;
        let reach = along.length() - OFF_M;
        reach > 0.0 && ground.cast(head, unit_or(along, Vec3::Y), reach).is_some()
    });
    stopped.count() as f32 / points.len() as f32
}

/// Does what scripts ask for, and tells them what has ended.
fn play(mut sounds: ResMut<Sounds>, mut wishes: ResMut<Wishes>, mut story: ResMut<Story>) {
    if wishes.sounds.is_empty() && sounds.hall.is_none() {
        return;
    }
    let asked = std::mem::take(&mut wishes.sounds);
    let Some(hall) = sounds.hall.as_mut().map(SyncCell::get) else {
        // what cannot be heard has ended
        for action in asked {
            if let Action::PlaySound { sound, .. } = action {
                story.tell(Event::Ended { what: sound });
            }
        }
        return;
    };
    asked.iter().for_each(|action| hall.carry_out(action));
    hall.ended().into_iter().for_each(|what| story.tell(Event::Ended { what }));
    hall.output.iter().flat_map(Output::take_news).for_each(|news| warn!("{news}"));
}

/// Tells the mixer of the visitor and of the hour.
fn hear(
    stage: Res<Stage>,
    lapse: Res<TimeLapse>,
    (actors, impostors): (Res<Actors>, Res<Impostors>),
    mut sounds: ResMut<Sounds>,
    visitors: Query<&Visitor>,
) {
    let hall = sounds.hall.as_mut().map(SyncCell::get);
    let (Some(hall), Some(visitor)) = (hall, visitors.iter().next()) else { return };
    let hour = (lapse.clock_s / 3600.0) as f32;
    hall.go_along(|name| {
        let (_, (low, high)) = actors.whereabouts(name).or_else(|| impostors.whereabouts(name, &actors))?;
        Some(0.5 * (low + high))
    });
    hall.listen(visitor.pose.eye, visitor.pose.rotation(), stage.footing(), hour);
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_sound::Mixer;

    /// A hall of one fire at three metres to the left, unheard but mixed.
    fn hall(sound: &str) -> (Hall, Mixer) {
        hall_of(&format!("{sound}\nname = \"fire\"\nkind = \"fire\"\nplace = [-3.0, 0.0, 0.0]\n"))
    }

    fn hall_of(text: &str) -> (Hall, Mixer) {
        let site = format!(
            "[site]\nname = \"s\"\n[[part]]\nfile = \"a.obj\"\n[sky]\nprobes = \"g.hdr\"\nmapping = \"lat-long\"\n[[sound]]\n{text}"
        );
        let site = heliodon_bundle::site::Site::parse(&site, "site.toml").unwrap();
        let sounds = load::made(&site.sounds[0]).map(|clip| vec![(site.sounds[0].clone(), clip)]).unwrap();
        let (control, mixer) = MixerSettings::default().build();
        (Hall::new(control, None, sounds, &[]), mixer)
    }

    /// The root mean square at both ears of half a second.
    fn heard(hall: &mut Hall, mixer: &mut Mixer, hour: f32) -> [f32; 2] {
        let mut sum = [0.0; 2];
        let mut block = vec![0.0; 2 * 800];
        for frame in 0..60 {
            hall.listen(Vec3::ZERO, Quat::IDENTITY, None, hour);
            mixer.render(&mut block);
            if frame >= 30 {
                block.chunks_exact(2).for_each(|pair| (0..2).for_each(|ear| sum[ear] += pair[ear] * pair[ear]));
            }
        }
        sum.map(|sum: f32| (sum / (30.0 * 800.0)).sqrt())
    }

    #[test]
    fn a_fire_on_the_left_is_heard_on_the_left_at_its_hours() {
        let (mut hall, mut mixer) = hall("plays = true\nrepeat = true\nhours = [[\"06:00\", 0.0], [\"18:00\", 1.0]]");
        let [left, right] = heard(&mut hall, &mut mixer, 18.0);
        assert!(left > 1.2 * right && right > 1e-4, "{left} {right}");
        let [morning, _] = heard(&mut hall, &mut mixer, 6.0);
        assert!(morning < 0.05 * left, "{morning} {left}");
    }

    #[test]
    fn ambience_is_all_around_until_it_is_stopped() {
        let (mut hall, mut mixer) = hall_of(
            "name = \"wind\"\nkind = \"wind\"\nplays = true\nrepeat = true\nhours = [[\"06:00\", 0.0], [\"18:00\", 1.0]]",
        );
        assert!(hall.playing.is_empty() && hall.beds.len() == 1);
        // beds take seconds to follow
        for _ in 0..8 {
            heard(&mut hall, &mut mixer, 18.0);
        }
        let [left, right] = heard(&mut hall, &mut mixer, 18.0);
        assert!(left > 1e-4 && right > 1e-4 && left != right, "{left} {right}");
        hall.carry_out(&Action::StopSound { sound: "wind".into() });
        assert!(hall.beds.is_empty());
        for _ in 0..30 {
            heard(&mut hall, &mut mixer, 18.0);
        }
        assert!(heard(&mut hall, &mut mixer, 18.0)[0] < 0.01 * left);
    }

    #[test]
    fn what_comes_from_somebody_goes_with_them() {
        let (mut hall, mut mixer) = hall_of(
            "name = \"steps\"\nkind = \"fire\"\nfrom = \"guide\"\nplays = true\nrepeat = true\n[[actor]]\nname = \"guide\"\nfile = \"guide.glb\"\nplace = [0, 0, 0]",
        );
        let mut at = |x: f32| {
            hall.go_along(|name| (name == "guide").then_some(Vec3::new(x, 0.0, 0.0)));
            (0..4).for_each(|_| _ = heard(&mut hall, &mut mixer, 12.0));
            heard(&mut hall, &mut mixer, 12.0)
        };
        let [left, right] = at(-3.0);
        assert!(left > 1.2 * right, "{left} {right}");
        let [left, right] = at(3.0);
        // fires crackle
        assert!(right > 1.2 * left, "{left} {right}");
    }

    #[test]
    fn scripts_start_and_stop_sounds() {
        let (mut hall, mut mixer) = hall("seed = 1");
        assert!(hall.playing.is_empty());
        hall.carry_out(&Action::PlaySound { sound: "fire".into(), at: Some([1.0, 0.0, 0.0]), volume: 1.0 });
        let [left, right] = heard(&mut hall, &mut mixer, 12.0);
        assert!(right > left && left > 0.0);
        hall.carry_out(&Action::StopSound { sound: "fire".into() });
        heard(&mut hall, &mut mixer, 12.0);
        assert_eq!(hall.ended(), [""; 0], "a script that stops a sound knows that it has ended");
        assert_eq!(heard(&mut hall, &mut mixer, 12.0), [0.0; 2]);
        // a thousand at once are bounded
        (0..1000).for_each(|_| hall.carry_out(&Action::PlaySound { sound: "fire".into(), at: None, volume: 1.0 }));
        assert_eq!(hall.playing.len(), MOST_PLAYED);
        heard(&mut hall, &mut mixer, 12.0);
    }
}
