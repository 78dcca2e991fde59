//! What each step of preparation takes.

use crate::report::Reporter;
use heliodon_bundle::memory::peak_resident_bytes;
use heliodon_prepare::Tell;
use serde::{Deserialize, Serialize};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Reporters hear of a step at most so often.
const TOLD: u64 = 1000;

/// What a step took.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Step {
    /// What was done.
    pub name: String,
    /// How long it took; where it went on within itself after a kill, the last run's part of that.
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

    /// Runs a step over `total` triangles (of reading: bytes), which tells the part of them that it has done.
    pub fn run<T>(&mut self, name: &str, total: u64, work: impl FnOnce(Tell) -> T) -> T {
        self.reporter.stage(name, total);
        self.reporter.progress(0);
        let begun = Instant::now();
        let told = Mutex::new(0);
        let listen = |share: f64| {
            let done = (share * total as f64) as u64;
            // whoever panicked while it was told has noted what it told
            let mut told = told.lock().unwrap_or_else(PoisonError::into_inner);
            if done >= *told + (total / TOLD).max(1) {
                *told = done;
                self.reporter.progress(done);
            }
        };
        let done = work(Tell::new(&listen));
        let (name, seconds) = (name.to_owned(), begun.elapsed().as_secs_f64());
        self.taken.push(Step { name, seconds, peak_memory_bytes: peak_resident_bytes() });
        self.reporter.finished();
        done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Keeps what is told, and whether two threads ever told at once.
    #[derive(Default)]
    struct Heard(Mutex<Vec<u64>>);

    impl Reporter for Heard {
        fn stage(&self, _name: &str, total: u64) {
            self.0.lock().unwrap().push(total);
        }
        fn progress(&self, done: u64) {
            self.0.try_lock().expect("one thread at a time").push(done);
        }
        fn finished(&self) {}
        fn note(&self, _text: &str) {}
        fn warning(&self, _text: &str) {}
    }

    #[test]
    fn what_threads_tell_comes_in_order_and_not_too_often() {
        let heard = Heard::default();
        let mut steps = Steps::new(&heard);
        steps.run("counting", 1_000_000, |tell| {
            std::thread::scope(|scope| {
                for thread in 0..4 {
                    scope.spawn(move || (0..=50_000).for_each(|i| tell.done(f64::from(4 * i + thread) / 200_004.0)));
                }
            });
        });
        assert_eq!(steps.taken.len(), 1);
        let heard = heard.0.lock().unwrap();
        assert_eq!(heard[..2], [1_000_000, 0]);
        assert!(heard[1..].is_sorted() && heard.len() > 100 && heard.len() <= TOLD as usize + 2, "{}", heard.len());
        assert!(*heard.last().unwrap() > 990_000);
    }
}
