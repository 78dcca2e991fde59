//! What a runtime and the words of its scripts share: the world that is asked about, actions that are asked for, handlers, state.

use crate::action::Action;
use crate::diagnostic::{Diagnostic, Place, Severity, Wrong};
use crate::limits::Limits;
use crate::memory::Memory;
use crate::names::Names;
use crate::place::Spot;
use crate::value::Value;
use crate::vocabulary::VISITOR;
use crate::world::World;
use heliodon_math::random::Pcg32;
use rhai::{Dynamic, FnPtr, Map};
use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The desk as natives of the engine hold it.
pub(crate) type SharedDesk = Arc<Mutex<Desk>>;

/// Locks it. Never held while a script runs: a word locks it for as long as it takes.
pub(crate) fn lock(desk: &Mutex<Desk>) -> MutexGuard<'_, Desk> {
    // nothing is left half done by a panic of ours that another word could trip over
    desk.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What a handler waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Trigger {
    Enter,
    Leave,
    Look,
    Touch,
    Grab,
    Release,
    Struck,
    Hit,
    Applied,
    Hour,
    Arrived,
    Ended,
    Message,
}

/// What is to be called, and with what.
#[derive(Clone, Debug)]
pub(crate) struct Task {
    pub function: FnPtr,
    /// Whether it wants the event.
    pub wants_event: bool,
    /// What the script handed over when it registered it.
    pub given: Dynamic,
    /// Where it was registered.
    pub place: Place,
}

#[derive(Clone, Debug)]
pub(crate) struct Handler {
    pub task: Arc<Task>,
    /// The second thing that it asks for, "*" for any: a tool, a material, a message's name.
    pub second: String,
    /// Seconds, for looks and hours.
    pub seconds: f64,
}

#[derive(Clone, Debug)]
pub(crate) struct Timer {
    pub number: i64,
    pub due_s: f64,
    pub period_s: Option<f64>,
    pub task: Arc<Task>,
    /// The event that it tells: what is looked at, for looks.
    pub event: Arc<Map>,
    /// It ends when eyes leave this.
    pub look: Option<String>,
}

/// A call that waits for its turn.
#[derive(Clone, Debug)]
pub(crate) struct Delivery {
    pub task: Arc<Task>,
    pub event: Arc<Map>,
}

/// A message on its way; it is heard in the next step.
#[derive(Debug)]
pub(crate) struct Posted {
    pub to: String,
    pub name: String,
    pub from: String,
    pub data: Dynamic,
}

/// What the runtime holds of one script.
#[derive(Debug, Default)]
pub(crate) struct Sheet {
    pub name: String,
    /// Numbers of parameters of its functions, by name.
    pub functions: Arc<HashMap<String, Vec<usize>>>,
    pub globals: HashMap<String, Dynamic>,
    pub state: BTreeMap<String, (Dynamic, usize)>,
    pub state_weight: usize,
    /// What an earlier version of the script kept.
    pub inherited: BTreeMap<String, Dynamic>,
    pub keeps: BTreeSet<String>,
    pub handlers: Vec<Handler>,
    pub timers: Vec<Timer>,
    pub queue: VecDeque<Delivery>,
    pub random: Option<Pcg32>,
    pub failures: VecDeque<f64>,
    pub off: bool,
    pub acted: usize,
    pub sent: usize,
    pub noted: usize,
    pub statistics: crate::runtime::Statistics,
    /// What was told already: it is counted and not told again.
    pub told: BTreeSet<(Option<(usize, usize)>, String)>,
}

#[derive(Debug)]
pub(crate) struct Desk {
    pub names: Names,
    pub limits: Limits,
    pub world: World,
    pub memory: Memory,
    pub now_s: f64,
    /// The script that runs.
    pub speaker: usize,
    pub sheets: Vec<Sheet>,
    pub index: HashMap<(Trigger, String), Vec<(usize, usize)>>,
    pub actions: Vec<Action>,
    pub posted: Vec<Posted>,
    pub told: Vec<Diagnostic>,
    pub timers_made: i64,
}

impl Desk {
    /// The sheet of the script that runs.
    pub fn sheet(&mut self) -> &mut Sheet {
        &mut self.sheets[self.speaker]
    }

    /// Where something is.
    pub fn place_of(&self, name: &str) -> Result<Spot, Wrong> {
        let world = self.world.read();
        let place = if name == VISITOR { Some(&world.visitor) } else { world.places.get(name) };
        place
            .map(|place| Spot::from_world(*place))
            .ok_or_else(|| Wrong::new(format!("nobody knows where `{name}` is"), "give a place: at(x, y, z)"))
    }

    /// Makes a task of a function of the running script.
    pub fn task(&mut self, function: FnPtr, given: Dynamic, place: Place) -> Result<Arc<Task>, Wrong> {
        let counts = self.sheet().functions.get(function.fn_name()).cloned().unwrap_or_default();
        let wants_event = if counts.contains(&1) {
            true
        } else if counts.contains(&0) {
            false
        } else {
            let name = function.fn_name().to_owned();
            let message = counts.first().map_or_else(
                || format!("`{name}` is no function of this script"),
                |count| format!("the handler takes {count} arguments"),
            );
            return Err(Wrong::new(message, "a handler takes none, || { ... }, or the event, |e| { ... }"));
        };
        let most = self.limits.message_bytes;
        Value::from_script(&given, most)?;
        Ok(Arc::new(Task { function, wants_event, given, place }))
    }

    /// Registers a handler.
    pub fn listen(&mut self, trigger: Trigger, first: String, handler: Handler) -> Result<(), Wrong> {
        let (most, speaker) = (self.limits.handlers, self.speaker);
        let sheet = self.sheet();
        if sheet.handlers.len() >= most {
            let remedy = "register handlers once, at the top of the script, not in a handler or timer";
            return Err(Wrong::new(format!("the script has {most} handlers already"), remedy));
        }
        sheet.handlers.push(handler);
        let place = (speaker, sheet.handlers.len() - 1);
        self.index.entry((trigger, first)).or_default().push(place);
        Ok(())
    }

    /// Starts a timer of a script; answers with its number.
    pub fn start_timer(
        &mut self,
        script: usize,
        seconds: f64,
        period_s: Option<f64>,
        task: Arc<Task>,
        event: Arc<Map>,
        look: Option<String>,
    ) -> Result<i64, Wrong> {
        let most = self.limits.timers;
        if self.sheets[script].timers.len() >= most {
            let remedy = "cancel() those that are no longer needed, or start them less often";
            return Err(Wrong::new(format!("the script has {most} timers already"), remedy));
        }
        self.timers_made += 1;
        let number = self.timers_made;
        let due_s = self.now_s + seconds;
        self.sheets[script].timers.push(Timer { number, due_s, period_s, task, event, look });
        Ok(number)
    }

    /// Tells something of a script; the same at the same place only once.
    pub fn tell(&mut self, script: usize, severity: Severity, place: Place, message: String, remedy: String) {
        let most = self.limits.notes;
        let sheet = &mut self.sheets[script];
        // what is printed is told every time: it says something else each time
        if severity != Severity::Note {
            // a bounded set: a message may hold numbers and so be another each time
            if sheet.told.len() >= 256 || !sheet.told.insert((place.0, message.clone())) {
                return;
            }
        }
        if severity == Severity::Note {
            sheet.noted += 1;
            if sheet.noted > most {
                sheet.statistics.dropped_notes += 1;
                return;
            }
        }
        let diagnostic = Diagnostic::new(&sheet.name, place, message, remedy).with_severity(severity);
        // a host that never asks for what is told does not run out of memory
        if self.told.len() < 1000 {
            self.told.push(diagnostic);
        }
    }

    /// Reads a script's `state`.
    pub fn state(&self, script: usize, key: &str) -> Result<Dynamic, Wrong> {
        let state = &self.sheets[script].state;
        state.get(key).map(|(value, _)| value.clone()).ok_or_else(|| {
            let meant = crate::diagnostic::nearest(key, state.keys().map(String::as_str));
            let remedy = match meant {
                Some(word) => format!("did you mean `state.{word}`?"),
                None => format!("give it a value at the top of the script: state.{key} = 0;"),
            };
            Wrong::new(format!("`state.{key}` has no value yet"), remedy)
        })
    }

    /// Writes a script's `state`.
    pub fn set_state(&mut self, script: usize, key: &str, value: Dynamic) -> Result<(), Wrong> {
        let most = self.limits.state_bytes;
        let weight = 16 + key.len() + Value::from_script(&value, most)?.weight();
        let sheet = &mut self.sheets[script];
        let total = sheet.state_weight - sheet.state.get(key).map_or(0, |(_, old)| *old) + weight;
        if total > most {
            return Err(Wrong::new(format!("`state` holds more than {} KiB", most / 1024), "keep less in it"));
        }
        sheet.state_weight = total;
        sheet.state.insert(key.to_owned(), (value, weight));
        Ok(())
    }
}
