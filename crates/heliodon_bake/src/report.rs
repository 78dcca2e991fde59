//! What the pipeline tells while it works.
//!
//! Nothing here prints. The program decides what a stage looks like on a terminal, tests collect, libraries stay silent.

use std::sync::{Mutex, PoisonError};

/// Listens to the pipeline. Called from one thread at a time, never from inside a solver's inner loops.
pub trait Reporter: Sync {
    /// A stage begins: its name, and how many units of work it has (0 where that is not known).
    fn stage(&self, name: &str, total: u64);

    /// `done` of the stage's units are finished. Never decreases within a stage.
    fn progress(&self, done: u64);

    /// The stage is over.
    fn finished(&self);

    /// Something worth knowing that does not change the result, such as what an earlier run had left.
    fn note(&self, text: &str);

    /// A part of the work did not go as asked, and the rest goes on. To be told again at the end.
    fn warning(&self, text: &str);
}

/// Hears nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Reporter for Silent {
    fn stage(&self, _name: &str, _total: u64) {}
    fn progress(&self, _done: u64) {}
    fn finished(&self) {}
    fn note(&self, _text: &str) {}
    fn warning(&self, _text: &str) {}
}

/// Hands everything on, and keeps the warnings.
pub(crate) struct WarningsKept<'a> {
    to: &'a dyn Reporter,
    kept: Collector,
}

impl<'a> WarningsKept<'a> {
    pub(crate) fn new(to: &'a dyn Reporter) -> Self {
        Self { to, kept: Collector::default() }
    }

    /// The warnings so far, in order.
    pub(crate) fn warnings(&self) -> Vec<String> {
        self.kept.heard().warnings
    }
}

impl Reporter for WarningsKept<'_> {
    fn stage(&self, name: &str, total: u64) {
        self.to.stage(name, total);
    }
    fn progress(&self, done: u64) {
        self.to.progress(done);
    }
    fn finished(&self) {
        self.to.finished();
    }
    fn note(&self, text: &str) {
        self.to.note(text);
    }
    fn warning(&self, text: &str) {
        self.kept.warning(text);
        self.to.warning(text);
    }
}

/// Makes one stage of several that follow one another: it begins and ends with whoever uses this.
pub(crate) struct Batches<'a> {
    to: &'a dyn Reporter,
    /// Units of the stages before, and of this one so far.
    done: Mutex<[u64; 2]>,
}

impl<'a> Batches<'a> {
    pub(crate) fn new(to: &'a dyn Reporter) -> Self {
        Self { to, done: Mutex::new([0; 2]) }
    }
}

impl Reporter for Batches<'_> {
    fn stage(&self, _name: &str, _total: u64) {}
    fn progress(&self, now: u64) {
        let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        done[1] = now;
        self.to.progress(done[0] + now);
    }
    fn finished(&self) {
        let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        *done = [done[0] + done[1], 0];
    }
    fn note(&self, text: &str) {
        self.to.note(text);
    }
    fn warning(&self, text: &str) {
        self.to.warning(text);
    }
}

/// Keeps stages, notes and warnings for whoever asks later.
#[derive(Debug, Default)]
pub struct Collector {
    heard: Mutex<Heard>,
}

/// What a [`Collector`] has heard.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Heard {
    /// Stages in order, with their totals.
    pub stages: Vec<(String, u64)>,
    /// Notes in order.
    pub notes: Vec<String>,
    /// Warnings in order.
    pub warnings: Vec<String>,
}

impl Collector {
    /// Everything heard so far.
    #[must_use]
    pub fn heard(&self) -> Heard {
        self.lock().clone()
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Heard> {
        // A panic elsewhere while a line was pushed leaves a list that is still a list.
        self.heard.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

impl Reporter for Collector {
    fn stage(&self, name: &str, total: u64) {
        self.lock().stages.push((name.to_owned(), total));
    }
    fn progress(&self, _done: u64) {}
    fn finished(&self) {}
    fn note(&self, text: &str) {
        self.lock().notes.push(text.to_owned());
    }
    fn warning(&self, text: &str) {
        self.lock().warnings.push(text.to_owned());
    }
}
