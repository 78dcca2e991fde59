//! The mixer on a device, on a thread of its own; and the visit that goes on where there is none.
//!
//! Where no device opens, or one vanishes, the mixer's time goes on all the same, unheard, so that films and cues stay right;
//! that is told once, and a device is tried again every few seconds. `HELIODON_AUDIO=off` (see
//! [`OutputSettings::from_setting`]) leaves devices alone.

mod device;

use crate::clock::Clock;
use crate::mixer::Mixer;
use crate::{RATE_HZ, SLICE};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How often the thread looks whether its device still plays and whether it is to stop.
const LOOK: Duration = Duration::from_millis(20);

/// A device that has asked for nothing for so long is gone, whatever it says.
const STANDS_STILL: Duration = Duration::from_secs(3);

/// Where sound goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutputSettings {
    /// Whether a device is to play at all.
    pub on: bool,
    /// The device's name, or a part of it; none: the system's own choice.
    pub device: Option<String>,
    /// Frames that the device asks for at once, where it can be told. More: later. Less: a busy machine stutters.
    pub buffer_frames: u32,
    /// How long after a failure a device is tried again.
    pub again: Duration,
}

impl Default for OutputSettings {
    fn default() -> Self {
        Self { on: true, device: None, buffer_frames: 512, again: Duration::from_secs(5) }
    }
}

impl OutputSettings {
    /// By a word, as `HELIODON_AUDIO` has one: `off`, `none` or `0` plays nothing, nothing or `default` the system's device, anything
    /// else the device whose name contains it.
    #[must_use]
    pub fn from_setting(word: Option<&str>) -> Self {
        match word.map(str::trim) {
            Some("off" | "none" | "0") => Self { on: false, ..Self::default() },
            None | Some("" | "default" | "on" | "1") => Self::default(),
            Some(name) => Self { device: Some(name.to_owned()), ..Self::default() },
        }
    }
}

/// Whether anything is heard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum OutputState {
    /// Nothing has been tried yet.
    Starting,
    /// It was told not to.
    Off,
    /// A device plays.
    Playing {
        /// Its name.
        device: String,
        /// Its rate, hertz.
        rate_hz: u32,
    },
    /// None does, and it is tried again.
    Silent {
        /// Why.
        why: String,
    },
}

#[derive(Debug)]
struct Shared {
    state: Mutex<OutputState>,
    news: Mutex<Vec<String>>,
    stop: AtomicBool,
    /// Set by the device when it can play no more.
    lost: AtomicBool,
    /// Frames that devices have asked for.
    asked: AtomicU64,
    why_lost: Mutex<String>,
}

fn held<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shared {
    fn is(&self, state: OutputState) {
        *held(&self.state) = state;
    }

    fn tell(&self, news: String) {
        held(&self.news).push(news);
    }
}

/// Plays a mixer until it is dropped.
#[derive(Debug)]
pub struct Output {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Output {
    /// Begins. Returns at once: devices are opened on the thread, and what comes of it is [news](Self::take_news).
    ///
    /// # Errors
    ///
    /// Where the operating system gives no thread.
    pub fn start(mixer: Mixer, settings: &OutputSettings) -> std::io::Result<Self> {
        let shared = Arc::new(Shared {
            state: Mutex::new(OutputState::Starting),
            news: Mutex::default(),
            stop: AtomicBool::new(false),
            lost: AtomicBool::new(false),
            asked: AtomicU64::new(0),
            why_lost: Mutex::default(),
        });
        let (theirs, settings) = (Arc::clone(&shared), settings.clone());
        let thread =
            std::thread::Builder::new().name("sound".to_owned()).spawn(move || run(&theirs, &settings, Box::new(mixer)))?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Whether anything is heard.
    #[must_use]
    pub fn state(&self) -> OutputState {
        held(&self.shared.state).clone()
    }

    /// What happened since this was last asked, each once: for the log or the visitor.
    #[must_use]
    pub fn take_news(&self) -> Vec<String> {
        std::mem::take(&mut *held(&self.shared.news))
    }

    /// Frames that devices have asked for so far.
    #[must_use]
    pub fn asked_frames(&self) -> u64 {
        self.shared.asked.load(Ordering::Relaxed)
    }
}

impl Drop for Output {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // whatever it met has been told
            let _ = thread.join();
        }
    }
}

fn run(shared: &Arc<Shared>, settings: &OutputSettings, mixer: Box<Mixer>) {
    let (mut mixer, mut told) = (Some(mixer), None::<String>);
    while !shared.stop.load(Ordering::Relaxed) {
        let Some(waiting) = mixer.take() else {
            shared.is(OutputState::Silent { why: "the device kept the mixer".to_owned() });
            shared
                .tell("the audio device ended without giving back the mixer: there is no more sound in this visit".to_owned());
            return;
        };
        if !settings.on {
            shared.is(OutputState::Off);
            mixer = Some(pass(shared, waiting, None));
            continue;
        }
        shared.lost.store(false, Ordering::Relaxed);
        let why = match device::open(shared, settings, waiting) {
            Ok(playing) => {
                shared.is(OutputState::Playing { device: playing.name.clone(), rate_hz: playing.rate_hz });
                if told.take().is_some() {
                    shared.tell(format!("sound is heard again, on {}", playing.name));
                }
                watch(shared);
                mixer = playing.end();
                if shared.stop.load(Ordering::Relaxed) {
                    return;
                }
                held(&shared.why_lost).clone()
            }
            Err((waiting, why)) => {
                mixer = waiting;
                why
            }
        };
        if told.as_ref() != Some(&why) {
            let again = settings.again.as_secs();
            shared.tell(format!(
                "no sound: {why}; the visit goes on in silence, and a device is tried again every {again} s (HELIODON_AUDIO=off leaves it alone)"
            ));
        }
        shared.is(OutputState::Silent { why: why.clone() });
        told = Some(why);
        mixer = mixer.map(|waiting| pass(shared, waiting, Some(settings.again)));
    }
}

/// Waits while a device plays.
fn watch(shared: &Shared) {
    let (mut asked, mut since) = (0, Instant::now());
    while !shared.stop.load(Ordering::Relaxed) && !shared.lost.load(Ordering::Relaxed) {
        std::thread::sleep(LOOK);
        let now = shared.asked.load(Ordering::Relaxed);
        if now != asked {
            (asked, since) = (now, Instant::now());
        } else if since.elapsed() > STANDS_STILL {
            *held(&shared.why_lost) = "the audio device asks for nothing any more".to_owned();
            return;
        }
    }
}

/// Lets time go by for the mixer, unheard.
fn pass(shared: &Shared, mut mixer: Box<Mixer>, least: Option<Duration>) -> Box<Mixer> {
    let (clock, began, mut passed): (Clock, _, u64) = (mixer.clock(), Instant::now(), 0);
    while !shared.stop.load(Ordering::Relaxed) && least.is_none_or(|least| began.elapsed() < least) {
        std::thread::sleep(LOOK / 2);
        let due = (began.elapsed().as_secs_f64() * f64::from(RATE_HZ)) as u64;
        // a machine that slept does not make up for hours
        if due.saturating_sub(passed) > u64::from(RATE_HZ) {
            passed = due - SLICE as u64;
        }
        let first = mixer.frame();
        passed += mixer.pass((due - passed) as usize) as u64;
        clock.taken(first, mixer.frame(), Instant::now(), Duration::ZERO);
    }
    mixer
}
