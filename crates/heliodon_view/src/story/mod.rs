//! What happens: a site's scripts, told of what the visitor does, and what they ask for done.
//!
//! `heliodon_script` runs them; here is what it knows nothing of. `watch` sees what the visitor enters and looks at, `stage_hand` moves, shows and lights,
//! `board` tells: tasks, hints, subtitles, a darkened picture. Scripts that change on disk are taken up while the visit goes on.

mod board;
mod letters;
mod stage_hand;
#[cfg(test)]
pub(crate) mod tests;
mod watch;

use crate::actors::{Actors, direction::Direction};
use crate::costs::FrameTold;
use crate::navigation::Travel;
use crate::stage::Stage;
use crate::time_lapse::TimeLapse;
use bevy::prelude::*;
use bevy::time::TimeUpdateStrategy;
use heliodon_bundle::BundleReader;
use heliodon_bundle::site::{Actor, Living};
use heliodon_script::action::{Action, Filling, Hand};
use heliodon_script::book::{Book, written};
use heliodon_script::event::Event;
use heliodon_script::limits::Limits;
use heliodon_script::memory::Memory;
use heliodon_script::runtime::Runtime;
use heliodon_script::texts::Texts;
use heliodon_script::value::Value;
use heliodon_script::world::World as ScriptWorld;
pub use letters::Lettered;
use stage_hand::StageHand;
pub use stage_hand::Wishes;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Instant, SystemTime};

/// How often it is looked whether scripts were written anew, seconds.
const LOOK_EVERY_S: f32 = 0.5;
/// How often what is remembered is written, where it has changed, seconds.
const SAVE_EVERY_S: f64 = 5.0;

/// Where a story comes from and goes to.
#[derive(Resource, Clone, Debug, Default)]
pub struct StoryPlaces {
    /// The site's folder, for those who write scripts while they visit; without, the bundle's own copies are read.
    pub site: Option<PathBuf>,
    /// Where what scripts remember is kept between visits; without, nothing is kept.
    pub memory: Option<PathBuf>,
    /// The visitor's language, as in the table of texts; without, the story's own.
    pub language: Option<String>,
}

/// The story of the bundle on the stage.
#[derive(Resource, Default)]
pub struct Story {
    stage: u64,
    play: Option<Play>,
    told: Told,
    /// Everything that was asked for since it was last taken, for whoever looks on.
    asked: Vec<Action>,
    /// What happened elsewhere and is still to be told.
    pending: Vec<Event>,
}

/// What the scripts of a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Told {
    /// Milliseconds that the step took.
    pub ms: f32,
    /// Things that it asked for.
    pub actions: usize,
}

/// A story at work.
struct Play {
    runtime: Runtime,
    texts: Option<Texts>,
    language: String,
    world: ScriptWorld,
    seconds: f64,
    /// What the files are read from and what of the bundle they name.
    folder: PathBuf,
    living: Living,
    bundle: Arc<BundleReader>,
    written: Vec<Option<SystemTime>>,
    memory: Option<PathBuf>,
    saved_s: f64,
    seen: watch::Seen,
    hand: StageHand,
}

impl Story {
    /// Tells scripts of something, in the next frame; without any, nobody.
    pub fn tell(&mut self, event: Event) {
        if self.play.is_some() {
            self.pending.push(event);
        }
    }

    /// Whether any script waits for such an event, other than looks.
    #[must_use]
    pub fn waits_for(&self, event: &Event) -> bool {
        self.play.as_ref().is_some_and(|play| play.runtime.waits_for(event))
    }

    /// Scripts learn what a hand holds.
    pub(crate) fn set_held(&mut self, hand: Hand, thing: Option<&str>) {
        self.play.iter_mut().for_each(|play| play.world.set_held(hand, thing));
    }

    /// Scripts learn that something is there, or is not.
    pub(crate) fn set_shown(&mut self, what: &str, shown: bool) {
        self.play.iter_mut().for_each(|play| play.world.set_shown(what, shown));
    }

    /// Whatever moved it does so no longer, and nobody hears that it arrived.
    pub(crate) fn stop_moving(&mut self, what: &str) {
        self.play.iter_mut().for_each(|play| play.hand.forget(what));
    }

    /// What somebody or something is called in the visitor's language, where the story's texts have its name as a key.
    #[must_use]
    pub fn called(&self, name: &str) -> String {
        let text = self.play.as_ref().and_then(|play| play.texts.as_ref()?.show(name, &play.language, &Filling::new()));
        text.unwrap_or_else(|| name.to_owned())
    }

    /// What scripts remember under a name.
    #[must_use]
    pub fn remembered(&mut self, name: &str) -> Option<Value> {
        self.play.as_mut()?.runtime.with_memory(|memory| memory.get(name).cloned())
    }

    /// What the last frame took.
    #[must_use]
    pub fn told(&self) -> Told {
        self.told
    }

    /// Everything that scripts have asked for since this was called last.
    pub fn take_asked(&mut self) -> Vec<Action> {
        std::mem::take(&mut self.asked)
    }
}

/// When scripts hear what has happened and what they ask for is laid out or done, in `Update`.
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub struct StorySet;

/// Lets a site's scripts run.
#[derive(Default)]
pub struct StoryPlugin;

impl Plugin for StoryPlugin {
    fn build(&self, app: &mut App) {
        let told = FrameTold::in_app(app);
        app.init_resource::<Story>()
            .init_resource::<StoryPlaces>()
            .init_resource::<board::Board>()
            .init_resource::<letters::Letters>()
            .init_resource::<stage_hand::Wishes>()
            .add_systems(Startup, board::spawn)
            .add_systems(
                Update,
                (
                    told.of("story", open),
                    told.of("story", look),
                    told.of("story", watch::watch),
                    told.of("story", step),
                    told.of("story", stage_hand::move_on),
                    letters::put,
                    told.of("story", board::show),
                )
                    .chain()
                    .in_set(StorySet)
                    .after(Travel),
            );
    }
}

/// Takes up the story of another bundle.
fn open(
    (stage, places, clock): (Res<Stage>, Res<StoryPlaces>, Option<Res<TimeUpdateStrategy>>),
    mut story: ResMut<Story>,
    mut board: ResMut<board::Board>,
    mut wishes: ResMut<stage_hand::Wishes>,
    mut actors: ResMut<Actors>,
    (mut letters, mut fonts): (ResMut<letters::Letters>, Option<ResMut<Assets<Font>>>),
) {
    if story.stage != stage.serial() {
        *story = Story { stage: stage.serial(), ..Story::default() };
        (*board, *wishes) = (board::Board::default(), stage_hand::Wishes::default());
        letters.open(stage.bundle().map(Arc::as_ref), fonts.as_deref_mut());
        let Some(bundle) = stage.bundle() else { return };
        for actor in bundle.actors().iter().filter(|actor| actor.thing.as_ref().is_some_and(|thing| thing.hidden)) {
            let hidden = Direction { hidden: true, ..Direction::default() };
            actors.directions.insert(actor.display_name().to_owned(), hidden);
        }
        // whoever steps time by hand wants the same of every run, however busy the machine is
        let is_stepped = clock.is_some_and(|clock| matches!(*clock, TimeUpdateStrategy::ManualDuration(_)));
        let limits = if is_stepped { Limits::deterministic() } else { Limits::default() };
        story.play = Play::begin(bundle, &places, limits);
    }
}

/// Looks now and then whether scripts were written anew.
fn look(time: Res<Time>, mut since_s: Local<f32>, mut story: ResMut<Story>) {
    *since_s += time.delta_secs();
    if *since_s >= LOOK_EVERY_S {
        *since_s = 0.0;
        story.play.as_mut().into_iter().for_each(Play::look);
    }
}

/// What a bundle's scripts are compiled against.
fn book(folder: &Path, living: &Living, bundle: &BundleReader) -> Book {
    let manifest = bundle.manifest();
    let parts = manifest.parts.iter().map(|part| part.name.as_str());
    Book::read(folder, living, bundle.actors(), &manifest.lamps, parts)
}

impl Play {
    /// None where the bundle has no story.
    fn begin(bundle: &Arc<BundleReader>, places: &StoryPlaces, limits: Limits) -> Option<Self> {
        let mut living = bundle.living().clone();
        let settings = living.story.clone()?;
        let folder = match &places.site {
            Some(site) => {
                // in the site they lie where the bundle's copies have their names from
                let prefix = format!("{}/", heliodon_bundle::LIVING_FOLDER);
                living.files_mut().for_each(|file| *file = file.strip_prefix(&prefix).unwrap_or(file).to_owned());
                site.clone()
            }
            None => bundle.folder().to_owned(),
        };
        let Book { program, texts, told } = book(&folder, &living, bundle);
        told.iter().for_each(|told| warn!("{told}"));
        let memory = places.memory.clone().filter(|_| settings.remembers);
        let (kept, damaged) = memory.as_deref().map_or((Memory::default(), None), Memory::open);
        damaged.iter().for_each(|told| warn!("{told}"));
        let first = || texts.as_ref().and_then(|texts| texts.languages().first().cloned());
        let language = places.language.clone().or(settings.language).or_else(first).unwrap_or_else(|| "en".to_owned());
        let written = written(&folder, &living);
        let mut world = ScriptWorld::new();
        world.set_language(&language);
        for region in &living.regions {
            let middle = [0, 1, 2].map(|axis| (0.5 * (region.min[axis] + region.max[axis])) as f32);
            world.set_place(&region.name, middle);
        }
        living.views.iter().for_each(|view| world.set_place(&view.name, view.place.map(|v| v as f32)));
        let hidden = |actor: &&Actor| actor.thing.as_ref().is_some_and(|thing| thing.hidden);
        bundle.actors().iter().filter(hidden).for_each(|actor| world.set_shown(actor.display_name(), false));
        let runtime = Runtime::new(program, kept, limits, 0);
        Some(Self {
            runtime,
            texts,
            language,
            world,
            seconds: 0.0,
            folder,
            living,
            bundle: Arc::clone(bundle),
            written,
            memory,
            saved_s: 0.0,
            seen: watch::Seen::default(),
            hand: StageHand::default(),
        })
    }

    /// Takes scripts up that were written anew; unsound ones are told, and the old ones go on.
    fn look(&mut self) {
        let now = written(&self.folder, &self.living);
        if now == self.written {
            return;
        }
        self.written = now;
        let Book { program, texts, told } = book(&self.folder, &self.living, &self.bundle);
        told.iter().for_each(|told| warn!("{told}"));
        match self.runtime.reload(program) {
            Ok(()) => self.texts = texts.or(self.texts.take()),
            Err(unsound) => warn!("{unsound}"),
        }
    }

    /// Scripts learn what is covered with what.
    fn wear(&mut self, action: &Action) {
        match action {
            Action::Material { target, material, .. } => self.world.set_material(target, material),
            Action::Bare { target, .. } => self.world.set_material(target, ""),
            _ => {}
        }
    }

    /// Writes what is remembered, now and then.
    fn save(&mut self) {
        let Some(path) = self.memory.clone().filter(|_| self.seconds - self.saved_s >= SAVE_EVERY_S) else { return };
        self.saved_s = self.seconds;
        let saved = self.runtime.with_memory(|memory| if memory.changed() { memory.save(&path) } else { Ok(()) });
        if let Err(error) = saved {
            warn_once!("what was done is not kept: {}: {error}", path.display());
        }
    }
}

impl Drop for Play {
    fn drop(&mut self) {
        self.seconds = f64::INFINITY;
        self.save();
    }
}

/// Lets the scripts hear what has happened, and notes what they ask for.
fn step(
    time: Res<Time>,
    lapse: Res<TimeLapse>,
    mut story: ResMut<Story>,
    mut board: ResMut<board::Board>,
    mut wishes: ResMut<stage_hand::Wishes>,
) {
    let story = &mut *story;
    let Some(play) = &mut story.play else { return };
    let start = Instant::now();
    play.seconds += time.delta_secs_f64();
    play.world.set_hour_s(lapse.clock_s.rem_euclid(86_400.0));
    story.pending.drain(..).for_each(|event| play.runtime.event(event));
    let actions = play.runtime.step(play.seconds, &play.world);
    play.runtime.take_told().iter().for_each(|told| warn!("{told}"));
    play.save();
    for action in &actions {
        let text = |key: &str, values| {
            let shown = play.texts.as_ref().and_then(|texts| texts.show(key, &play.language, values));
            shown.unwrap_or_else(|| key.to_owned())
        };
        match action {
            Action::Subtitle { text: key, seconds, values } => board.say(text(key, values), *seconds),
            Action::Task { text: key, values } => board.task = Some(text(key, values)),
            Action::NoTask => board.task = None,
            Action::Hint { text: key, seconds, values } => board.hint(text(key, values), *seconds),
            Action::FadeScreen { darkness, seconds } => board.fade(*darkness, *seconds),
            other => {
                play.wear(other);
                wishes.sort(other);
            }
        }
    }
    story.told = Told { ms: start.elapsed().as_secs_f32() * 1e3, actions: actions.len() };
    story.asked.extend(actions);
}
