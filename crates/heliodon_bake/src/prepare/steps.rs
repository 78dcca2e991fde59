//! What each step of preparation takes.

use crate::memory::peak_resident_bytes;
use crate::report::Reporter;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// What a step took.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Step {
    /// What was done.
    pub name: String,
    /// How long it took.
    pub seconds: f64,
    /// The most memory that the process had needed by its end, where the system tells.
    pub peak_memory_bytes: Option<u64>,
}

/// Runs steps one after the other, and notes what they take.
pub(super) struct Steps<'a> {
    pub reporter: &'a dyn Reporter,
    pub taken: Vec<Step>,
}

impl<'a> Steps<'a> {
    pub fn new(reporter: &'a dyn Reporter) -> Self {
        Self { reporter, taken: Vec::new() }
    }

    pub fn run<T>(&mut self, name: &str, work: impl FnOnce() -> T) -> T {
        self.reporter.stage(name, 0);
        let begun = Instant::now();
        let done = work();
        let (name, seconds) = (name.to_owned(), begun.elapsed().as_secs_f64());
        self.taken.push(Step { name, seconds, peak_memory_bytes: peak_resident_bytes() });
        self.reporter.finished();
        done
    }
}
