//! Progress on standard error: bars with the time left on a terminal, plain lines elsewhere.

use crate::output::{count, duration};
use heliodon_bake::report::Reporter;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Seconds between two lines about the same stage where there is no terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(5);
/// The estimate of the time left means little before this.
const ESTIMATE_AFTER: Duration = Duration::from_secs(1);

/// Tells a person what the pipeline does.
pub struct Progress {
    quiet: bool,
    terminal: bool,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    stage: Option<Stage>,
    warnings: Vec<String>,
}

struct Stage {
    name: String,
    total: u64,
    begun: Instant,
    /// What had been done when the first progress came: finished by an earlier run, so it says nothing of the speed.
    head_start: Option<u64>,
    done: u64,
    told: Instant,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// Bars or lines on standard error; `quiet` leaves only notes and warnings.
    pub fn new(quiet: bool) -> Self {
        Self { quiet, terminal: std::io::stderr().is_terminal(), state: Mutex::default() }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The warnings once more, now that the screen is quiet.
    pub fn tell_warnings(&self) {
        let state = self.state();
        for warning in &state.warnings {
            line(&format!("warning: {warning}"));
        }
    }
}

/// One line on standard error; that nobody can read it is no reason to fail.
fn line(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

impl Stage {
    fn seconds_left(&self) -> Option<f64> {
        let elapsed = self.begun.elapsed();
        let done = self.done.checked_sub(self.head_start?)?;
        (elapsed >= ESTIMATE_AFTER && done > 0 && self.total > 0)
            .then(|| elapsed.as_secs_f64() * self.total.saturating_sub(self.done) as f64 / done as f64)
    }
}

impl Reporter for Progress {
    fn stage(&self, name: &str, total: u64) {
        let now = Instant::now();
        let bar = (self.terminal && !self.quiet).then(|| {
            let bar = ProgressBar::with_draw_target((total > 0).then_some(total), ProgressDrawTarget::stderr());
            let template =
                if total > 0 { "{prefix:>18} [{bar:32}] {percent:>3} %  {msg}" } else { "{prefix:>18} {spinner} {elapsed}" };
            bar.set_style(
                ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "),
            );
            bar.set_prefix(name.to_owned());
            bar.enable_steady_tick(Duration::from_millis(200));
            bar
        });
        if bar.is_none() && !self.quiet && total == 0 {
            // nothing else will be heard of it until it is over
            line(&format!("{name} ..."));
        }
        self.state().stage =
            Some(Stage { name: name.to_owned(), total, begun: now, head_start: None, done: 0, told: now, bar });
    }

    fn progress(&self, done: u64) {
        let mut state = self.state();
        let Some(stage) = &mut state.stage else { return };
        stage.head_start.get_or_insert(done);
        stage.done = done;
        let left = stage.seconds_left().map_or_else(String::new, |seconds| format!("{} left", duration(seconds)));
        if let Some(bar) = &stage.bar {
            bar.set_position(done);
            bar.set_message(left);
        } else if !self.quiet && stage.told.elapsed() >= LINE_INTERVAL && stage.total > 0 {
            stage.told = Instant::now();
            let percent = done * 100 / stage.total;
            line(&format!("{}: {percent} %{}{left}", stage.name, if left.is_empty() { "" } else { ", " }));
        }
    }

    fn finished(&self) {
        let Some(stage) = self.state().stage.take() else { return };
        if let Some(bar) = &stage.bar {
            bar.finish_and_clear();
        }
        if !self.quiet {
            let of = if stage.total > 1 { format!(" ({})", count(stage.total)) } else { String::new() };
            line(&format!("{}{of}: {}", stage.name, duration(stage.begun.elapsed().as_secs_f64())));
        }
    }

    fn note(&self, text: &str) {
        let state = self.state();
        match state.stage.as_ref().and_then(|stage| stage.bar.as_ref()) {
            Some(bar) => bar.suspend(|| line(text)),
            None => line(text),
        }
    }

    fn warning(&self, text: &str) {
        self.state().warnings.push(text.to_owned());
    }
}
