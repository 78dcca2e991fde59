//! Runs a program: what happens goes in, once a frame actions come out.

mod deliver;
mod run;

use crate::action::Action;
use crate::desk::{Desk, SharedDesk, Sheet, lock};
use crate::diagnostic::Diagnostic;
use crate::engine::{self, Meter};
use crate::event::Event;
use crate::limits::Limits;
use crate::memory::Memory;
use crate::program::{Program, Script};
use crate::world::World;
use heliodon_math::random::Pcg32;
use rhai::Engine;
use serde::Serialize;
use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Mutex};
use std::time::Instant;
use thiserror::Error;

/// Events that may wait for a step.
const MAX_EVENTS: usize = 4096;

/// What a script has done and what was refused it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Statistics {
    /// Handlers that were called.
    pub calls: u64,
    /// Operations that they took.
    pub operations: u64,
    /// Handlers that failed.
    pub failures: u64,
    /// Events, timers and messages that found the queue full.
    pub dropped_events: u64,
    /// Messages that were too many.
    pub dropped_messages: u64,
    /// Lines that it printed and nobody was told.
    pub dropped_notes: u64,
    /// It was switched off.
    pub off: bool,
}

/// Why a program was not taken over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("a script of the new program has errors; the old one goes on")]
pub struct Unsound;

/// Scripts at work.
///
/// It reads no file and, with [`Limits::deterministic`], no clock: the same program, seed, memory, events, worlds and times make
/// the same actions. It is `Send`; one thread at a time steps it.
pub struct Runtime {
    engine: Engine,
    desk: SharedDesk,
    meter: Arc<Meter>,
    scripts: Vec<Script>,
    seed: u64,
    /// Scripts whose top level has not run yet.
    fresh: VecDeque<usize>,
    events: VecDeque<Event>,
    dropped: u64,
    /// Whose turn is first in the next step.
    turn: usize,
    last_hour_s: Option<f64>,
    limits: Limits,
}

impl std::fmt::Debug for Runtime {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Runtime")
            .field("scripts", &self.scripts.len())
            .field("events", &self.events.len())
            .finish_non_exhaustive()
    }
}

impl Runtime {
    /// Takes a program up; its scripts start with the first step. `seed` is what `random()` draws from.
    #[must_use]
    pub fn new(program: Program, memory: Memory, limits: Limits, seed: u64) -> Self {
        let desk = Desk {
            names: crate::names::Names::default(),
            limits: limits.clone(),
            world: World::new(),
            memory,
            now_s: 0.0,
            speaker: 0,
            sheets: Vec::new(),
            index: HashMap::new(),
            actions: Vec::new(),
            posted: Vec::new(),
            told: Vec::new(),
            timers_made: 0,
        };
        let (desk, meter) = (Arc::new(Mutex::new(desk)), Arc::new(Meter::default()));
        let engine = engine::whole(&desk, &meter, &limits);
        let mut runtime = Self {
            engine,
            desk,
            meter,
            scripts: Vec::new(),
            seed,
            fresh: VecDeque::new(),
            events: VecDeque::new(),
            dropped: 0,
            turn: 0,
            last_hour_s: None,
            limits,
        };
        runtime.take_up(program);
        runtime
    }

    /// Puts another program in the place of the one that runs. The memory stays; of each script of the same name what it
    /// `keep`s, too. Timers and what is queued are gone. The scripts start with the next step.
    ///
    /// # Errors
    /// A program of which scripts were left out is refused, and the old one goes on as if nothing had been said.
    pub fn reload(&mut self, program: Program) -> Result<(), Unsound> {
        if !program.is_sound() {
            return Err(Unsound);
        }
        self.take_up(program);
        Ok(())
    }

    fn take_up(&mut self, program: Program) {
        let mut desk = lock(&self.desk);
        let mut old: HashMap<String, Sheet> = desk.sheets.drain(..).map(|sheet| (sheet.name.clone(), sheet)).collect();
        desk.index.clear();
        desk.posted.clear();
        desk.names = program.names;
        for (i, script) in program.scripts.iter().enumerate() {
            let inherited = old.remove(&script.name).map(|sheet| {
                let keeps = sheet.keeps;
                let kept = sheet.state.into_iter().filter(|(name, _)| keeps.contains(name));
                // what was inherited and not asked for again yet was not lost by a reload that came too soon
                sheet.inherited.into_iter().chain(kept.map(|(name, (value, _))| (name, value))).collect()
            });
            desk.sheets.push(Sheet {
                name: script.name.clone(),
                functions: Arc::clone(&script.functions),
                globals: literals(script),
                inherited: inherited.unwrap_or_default(),
                // each script draws for itself: what another one does changes nothing
                random: Some(Pcg32::new(self.seed, i as u64)),
                ..Sheet::default()
            });
        }
        drop(desk);
        self.fresh = (0..program.scripts.len()).collect();
        self.scripts = program.scripts;
        self.events.clear();
        self.turn = 0;
    }

    /// Tells what has happened; scripts hear of it in the next step. What is more than a step can hold is dropped and counted.
    pub fn event(&mut self, event: Event) {
        if self.events.len() < MAX_EVENTS {
            self.events.push_back(event);
        } else {
            self.dropped += 1;
        }
    }

    /// Lets scripts do what there is to do, and answers with what they ask for, in order.
    ///
    /// `now_s` are seconds since the visit began, by a clock that does not go back; `world` is as it is now. Once a frame.
    pub fn step(&mut self, now_s: f64, world: &World) -> Vec<Action> {
        let began = self.limits.step_ms.map(|ms| (Instant::now(), u128::from(ms)));
        {
            let mut desk = lock(&self.desk);
            // a clock that goes back would stop every timer for as long
            desk.now_s = if now_s.is_finite() { desk.now_s.max(now_s) } else { desk.now_s };
            desk.world = world.clone();
            for sheet in &mut desk.sheets {
                (sheet.acted, sheet.sent, sheet.noted) = (0, 0, 0);
            }
        }
        let mut operations = 0;
        while let Some(script) = self.fresh.pop_front() {
            operations += self.start(script);
        }
        self.gather();
        let count = self.scripts.len();
        let mut idle = 0;
        while idle < count {
            let late = began.is_some_and(|(began, most)| began.elapsed().as_millis() >= most);
            if late || operations >= self.limits.step_operations {
                break;
            }
            let script = self.turn % count;
            self.turn = (self.turn + 1) % count;
            match self.run_next(script) {
                Some(used) => (operations, idle) = (operations + used, 0),
                None => idle += 1,
            }
        }
        let mut desk = lock(&self.desk);
        // the host alone holds the world again, and changes it in place
        desk.world = World::new();
        std::mem::take(&mut desk.actions)
    }

    /// Whether any script waits for such an event (looks are not asked for): so that a host can show what there is to do.
    #[must_use]
    pub fn waits_for(&self, event: &Event) -> bool {
        lock(&self.desk).waits_for(event)
    }

    /// What there is to tell authors since this was last asked: failures, limits, what scripts print.
    pub fn take_told(&mut self) -> Vec<Diagnostic> {
        std::mem::take(&mut lock(&self.desk).told)
    }

    /// What each script has done, by its name.
    #[must_use]
    pub fn statistics(&self) -> Vec<(String, Statistics)> {
        let desk = lock(&self.desk);
        desk.sheets
            .iter()
            .map(|sheet| (sheet.name.clone(), Statistics { off: sheet.off, ..sheet.statistics.clone() }))
            .collect()
    }

    /// Events that came faster than steps could take them.
    #[must_use]
    pub fn dropped_events(&self) -> u64 {
        self.dropped
    }

    /// Whether something waits for the next step because this one had no more time.
    #[must_use]
    pub fn is_behind(&self) -> bool {
        lock(&self.desk).sheets.iter().any(|sheet| !sheet.off && !sheet.queue.is_empty())
    }

    /// Does something with what is remembered: look at it, save it, forget it.
    pub fn with_memory<T>(&mut self, f: impl FnOnce(&mut Memory) -> T) -> T {
        f(&mut lock(&self.desk).memory)
    }
}

/// Top-level variables that are known before anything runs.
fn literals(script: &Script) -> HashMap<String, rhai::Dynamic> {
    script.tree.iter_literal_variables(true, true).map(|(name, _, value)| (name.to_owned(), value)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_and_runtimes_go_from_thread_to_thread() {
        fn sent<T: Send>() {}
        fn shared<T: Send + Sync>() {}
        sent::<Runtime>();
        shared::<Program>();
        shared::<World>();
    }
}
