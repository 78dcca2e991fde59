//! Calls of handlers within their limits, and what is told of those that fail.

use super::Runtime;
use crate::desk::{Desk, lock};
use crate::diagnostic::{Place, Severity, Wrong};
use crate::engine::{TOO_LONG, TOO_MANY_OPERATIONS};
use crate::limits::Limits;
use rhai::{Dynamic, EvalAltResult, Map, Position, Scope};
use std::sync::Arc;
use std::time::Duration;

/// Failures that are further apart are forgiven.
const FAILURES_WITHIN_S: f64 = 60.0;

impl Runtime {
    /// Runs the top level of a script; answers with the operations that it took.
    pub(super) fn start(&mut self, script: usize) -> u64 {
        lock(&self.desk).speaker = script;
        self.meter.begin(self.limits.start_operations, self.time());
        let mut scope = Scope::new();
        let ended = self.engine.run_ast_with_scope(&mut scope, &self.scripts[script].tree);
        let used = self.meter.used();
        let mut desk = lock(&self.desk);
        let sheet = &mut desk.sheets[script];
        (sheet.statistics.calls, sheet.statistics.operations) =
            (sheet.statistics.calls + 1, sheet.statistics.operations + used);
        // handlers see what stands at the top as it is now
        for (name, _, value) in scope.iter() {
            sheet.globals.insert(name.to_owned(), value);
        }
        if let Err(error) = ended {
            desk.failed(script, Place(None), &error, self.limits.start_operations);
        }
        used
    }

    /// Calls what is first in a script's queue; answers with the operations that it took, with none where nothing waits.
    pub(super) fn run_next(&mut self, script: usize) -> Option<u64> {
        let delivery = {
            let mut desk = lock(&self.desk);
            if desk.sheets[script].off {
                return None;
            }
            desk.speaker = script;
            desk.sheets[script].queue.pop_front()?
        };
        self.meter.begin(self.limits.handler_operations, self.time());
        let (task, tree) = (&delivery.task, &self.scripts[script].tree);
        let ended = if task.wants_event {
            let mut event: Map = Arc::unwrap_or_clone(delivery.event);
            event.insert("given".into(), task.given.clone());
            task.function.call::<Dynamic>(&self.engine, tree, (event,))
        } else {
            task.function.call::<Dynamic>(&self.engine, tree, ())
        };
        // an operation is counted for the call itself: a handler that does nothing is not free
        let used = self.meter.used() + 1;
        let mut desk = lock(&self.desk);
        let sheet = &mut desk.sheets[script];
        (sheet.statistics.calls, sheet.statistics.operations) =
            (sheet.statistics.calls + 1, sheet.statistics.operations + used);
        if let Err(error) = ended {
            desk.failed(script, task.place, &error, self.limits.handler_operations);
        }
        Some(used)
    }

    fn time(&self) -> Option<Duration> {
        self.limits.handler_ms.map(|ms| Duration::from_millis(u64::from(ms)))
    }
}

impl Desk {
    /// Tells why a handler failed, and switches a script off that fails again and again.
    fn failed(&mut self, script: usize, registered: Place, error: &EvalAltResult, operations: u64) {
        let (wrong, position) = explain(error, &self.limits, operations);
        let place = if position.is_none() { registered } else { position.into() };
        self.tell(script, Severity::Error, place, wrong.message, wrong.remedy);
        let (most, now_s) = (self.limits.failures, self.now_s);
        let sheet = &mut self.sheets[script];
        sheet.statistics.failures += 1;
        sheet.failures.push_back(now_s);
        if sheet.failures.len() > most {
            sheet.failures.pop_front();
        }
        let recent = sheet.failures.front().is_some_and(|first| now_s - first <= FAILURES_WITHIN_S);
        if sheet.failures.len() >= most && recent {
            sheet.off = true;
            sheet.queue.clear();
            sheet.timers.clear();
            let message = format!("the script has failed {most} times within a minute and is switched off; the others go on");
            self.tell(
                script,
                Severity::Error,
                place,
                message,
                "mend what was told of it; it starts again when it is saved".to_owned(),
            );
        }
    }
}

/// The innermost error, and the innermost place that is known of it. Rhai tells none of what was ended or went too deep: the place
/// is then that where the handler was registered.
fn innermost(error: &EvalAltResult) -> (&EvalAltResult, Position) {
    let mut place = error.position();
    let mut error = error;
    while let EvalAltResult::ErrorInFunctionCall(_, _, inner, _) = error {
        error = inner;
        if !error.position().is_none() {
            place = error.position();
        }
    }
    (error, place)
}

/// In plain English.
fn explain(error: &EvalAltResult, limits: &Limits, operations: u64) -> (Wrong, Position) {
    use EvalAltResult as E;
    let (error, position) = innermost(error);
    let wrong = match error {
        E::ErrorTerminated(token, _) => match token.as_immutable_string_ref().as_deref().map(|token| token.as_str()) {
            Ok(TOO_LONG) => {
                let ms = limits.handler_ms.unwrap_or(0);
                Wrong::new(
                    format!("what begins here took longer than {ms} ms and is ended"),
                    "do less at once, or spread it with after()",
                )
            }
            Ok(TOO_MANY_OPERATIONS) | Ok(_) | Err(_) => Wrong::new(
                format!("what begins here is ended after {operations} operations"),
                "does a loop never end? otherwise do less at once, or spread it with after()",
            ),
        },
        E::ErrorTooManyOperations(_) => {
            Wrong::new(format!("what begins here is ended after {operations} operations"), "does a loop never end?")
        }
        E::ErrorStackOverflow(_) => Wrong::new(
            format!("in what begins here functions call one another more than {} deep", limits.call_depth),
            "does a function call itself without an end?",
        ),
        E::ErrorDataTooLarge(what, _) => {
            let (what, most) = match what.as_str() {
                "Length of string" => ("a text, or texts together, grow", format!("{} bytes", limits.text_bytes)),
                "Size of object map" => ("a #{ ... } grows", format!("{} entries", limits.table_entries)),
                _ => ("a list grows", format!("{} entries", limits.list_entries)),
            };
            Wrong::new(format!("in what begins here {what} beyond {most}"), "keep less in it, or empty it now and then")
        }
        E::ErrorTooManyVariables(_) => Wrong::new(
            format!("in what begins here a function has more than {} variables", limits.variables),
            "put them into a list",
        ),
        E::ErrorVariableNotFound(name, _) => Wrong::new(
            format!("there is no variable `{name}` here yet"),
            "a function that runs before the top of the script has ended sees only plain values from there",
        ),
        E::ErrorPropertyNotFound(name, _) => {
            Wrong::new(format!("there is no `{name}` in it"), format!("ask first: if \"{name}\" in ... {{ }}"))
        }
        E::ErrorFunctionNotFound(signature, _) => {
            Wrong::new(format!("there is no function {signature}"), "is it given what it can work with?")
        }
        E::ErrorAssignmentToConstant(name, _) => {
            Wrong::new(format!("`{name}` cannot be changed here"), format!("write state.{name}, here and at the top"))
        }
        E::ErrorUnboundThis(_) => Wrong::new("`this` means nothing here", "what lasts of a script is in state"),
        E::ErrorRuntime(value, _) => match value.read_lock::<Wrong>() {
            Some(wrong) => wrong.clone(),
            None if value.is_unit() => Wrong::new("the script gave up", "see its throw"),
            None => Wrong::new(format!("the script gave up: {value}"), "see its throw"),
        },
        other => {
            let text = other.to_string();
            let plain = text.rsplit_once(" (line").map_or(text.as_str(), |(before, _)| before);
            Wrong::new(plain.to_owned(), "look at this place")
        }
    };
    (wrong, position)
}
