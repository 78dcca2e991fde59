//! From what happens to who is to be called.

use super::Runtime;
use crate::action::Hand;
use crate::desk::{Delivery, Desk, Task, Trigger, lock};
use crate::diagnostic::{Place, Severity};
use crate::event::Event;
use crate::place::Spot;
use rhai::{Dynamic, Map};
use std::sync::Arc;

/// Seconds of a day.
const DAY_S: f64 = 86_400.0;
/// The clock of the site was set, rather than that it ran so far within a frame.
const LEAP_S: f64 = 3600.0;

/// What an event is to handlers.
struct Heard {
    trigger: Trigger,
    first: String,
    second: String,
    fields: Map,
}

fn fields<const N: usize>(fields: [(&str, Dynamic); N]) -> Map {
    fields.into_iter().map(|(name, value)| (name.into(), value)).collect()
}

fn place(place: [f32; 3]) -> Dynamic {
    Dynamic::from(Spot::from_world(place))
}

/// Everything but looks, which begin and end.
fn heard(event: Event) -> Option<Heard> {
    let word = |hand: Hand| Dynamic::from(hand.word());
    let text = |text: &String| Dynamic::from(text.clone());
    let one = |trigger, first: String, fields| Some(Heard { trigger, first, second: String::new(), fields });
    match event {
        Event::Entered { region } => {
            let fields = fields([("region", text(&region))]);
            one(Trigger::Enter, region, fields)
        }
        Event::Left { region } => {
            let fields = fields([("region", text(&region))]);
            one(Trigger::Leave, region, fields)
        }
        Event::Touched { thing, hand } => {
            let fields = fields([("thing", text(&thing)), ("hand", word(hand))]);
            one(Trigger::Touch, thing, fields)
        }
        Event::Grabbed { thing, hand } => {
            let fields = fields([("thing", text(&thing)), ("hand", word(hand))]);
            one(Trigger::Grab, thing, fields)
        }
        Event::Released { thing, hand, place: at } => {
            let fields = fields([("thing", text(&thing)), ("hand", word(hand)), ("place", place(at))]);
            one(Trigger::Release, thing, fields)
        }
        Event::Struck { target, tool, speed, place: at } => {
            let speed = Dynamic::from(f64::from(speed));
            let fields = fields([("target", text(&target)), ("tool", text(&tool)), ("speed", speed), ("place", place(at))]);
            Some(Heard { trigger: Trigger::Struck, first: target, second: tool, fields })
        }
        Event::Hit { thing, on, speed, place: at } => {
            let speed = Dynamic::from(f64::from(speed));
            let fields = fields([("thing", text(&thing)), ("on", text(&on)), ("speed", speed), ("place", place(at))]);
            one(Trigger::Hit, thing, fields)
        }
        Event::Applied { target, material, tool } => {
            let fields = fields([("target", text(&target)), ("material", text(&material)), ("tool", tool.into())]);
            Some(Heard { trigger: Trigger::Applied, first: target, second: material, fields })
        }
        Event::Arrived { what } => {
            let fields = fields([("what", text(&what))]);
            one(Trigger::Arrived, what, fields)
        }
        Event::Ended { what } => {
            let fields = fields([("what", text(&what))]);
            one(Trigger::Ended, what, fields)
        }
        Event::Message { to, name, data } => Some(message(to, name, "outside".into(), data.to_script())),
        Event::LookedAt { .. } | Event::LookedAway { .. } => None,
    }
}

fn message(to: String, name: String, from: Dynamic, data: Dynamic) -> Heard {
    let (to_text, name_text) = (Dynamic::from(to.clone()), Dynamic::from(name.clone()));
    let fields = fields([("to", to_text), ("message", name_text), ("from", from), ("data", data)]);
    Heard { trigger: Trigger::Message, first: to, second: name, fields }
}

impl Desk {
    /// Puts a call into its script's queue.
    pub(super) fn queue(&mut self, script: usize, task: Arc<Task>, event: Arc<Map>) {
        let most = self.limits.queue;
        let sheet = &mut self.sheets[script];
        if sheet.off {
            return;
        }
        if sheet.queue.len() < most {
            sheet.queue.push_back(Delivery { task, event });
            return;
        }
        sheet.statistics.dropped_events += 1;
        let message = format!("more than {most} events wait for this script; what comes now is dropped");
        let remedy = "let its handlers do less, or wait for fewer things";
        self.tell(script, Severity::Warning, Place(None), message, remedy.to_owned());
    }

    fn deliver(&mut self, heard: Heard) {
        let mut found: Vec<(usize, usize)> = Vec::new();
        // the order in which they were registered, script by script
        let mut key = (heard.trigger, heard.first);
        found.extend(self.index.get(&key).into_iter().flatten());
        key.1 = "*".to_owned();
        found.extend(self.index.get(&key).into_iter().flatten());
        if found.is_empty() {
            return;
        }
        found.sort_unstable();
        let event = Arc::new(heard.fields);
        for (script, number) in found {
            let handler = &self.sheets[script].handlers[number];
            if handler.second == "*" || handler.second == heard.second {
                let task = Arc::clone(&handler.task);
                self.queue(script, task, Arc::clone(&event));
            }
        }
    }

    /// Whether any handler would hear of it.
    pub(super) fn waits_for(&self, event: &Event) -> bool {
        let Some(heard) = heard(event.clone()) else { return false };
        [heard.first, "*".to_owned()].into_iter().any(|first| {
            self.index.get(&(heard.trigger, first)).into_iter().flatten().any(|&(script, number)| {
                let sheet = &self.sheets[script];
                let second = &sheet.handlers[number].second;
                !sheet.off && (second == "*" || *second == heard.second)
            })
        })
    }

    fn look_at(&mut self, thing: &str) {
        let mut found: Vec<(usize, usize)> = Vec::new();
        for first in [thing, "*"] {
            found.extend(self.index.get(&(Trigger::Look, first.to_owned())).into_iter().flatten());
        }
        found.sort_unstable();
        let event = Arc::new(fields([("thing", Dynamic::from(thing.to_owned()))]));
        for (script, number) in found {
            let handler = &self.sheets[script].handlers[number];
            let (task, seconds) = (Arc::clone(&handler.task), handler.seconds);
            let place = task.place;
            let started = self.start_timer(script, seconds, None, task, Arc::clone(&event), Some(thing.to_owned()));
            if let Err(wrong) = started {
                self.tell(script, Severity::Warning, place, wrong.message, wrong.remedy);
            }
        }
    }

    fn look_away(&mut self, thing: &str) {
        for sheet in &mut self.sheets {
            sheet.timers.retain(|timer| timer.look.as_deref() != Some(thing));
        }
    }

    /// Timers whose time has come, the earliest first. One that repeats and was late comes once, not once for each time that
    /// it missed.
    fn ring(&mut self) {
        let now_s = self.now_s;
        for script in 0..self.sheets.len() {
            let sheet = &mut self.sheets[script];
            if sheet.off {
                continue;
            }
            let mut due: Vec<(f64, i64, Arc<Task>, Arc<Map>)> = Vec::new();
            sheet.timers.retain_mut(|timer| {
                if timer.due_s > now_s {
                    return true;
                }
                due.push((timer.due_s, timer.number, Arc::clone(&timer.task), Arc::clone(&timer.event)));
                let Some(period_s) = timer.period_s else { return false };
                timer.due_s += period_s;
                if timer.due_s <= now_s {
                    timer.due_s = now_s + period_s;
                }
                true
            });
            due.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            for (_, _, task, event) in due {
                self.queue(script, task, event);
            }
        }
    }

    /// Hours that the clock has run past.
    fn strike_hours(&mut self, from_s: f64, to_s: f64) {
        let ran = (to_s - from_s).rem_euclid(DAY_S);
        if ran <= 0.0 || ran > LEAP_S {
            return;
        }
        let listed = self.index.get(&(Trigger::Hour, String::new())).cloned().unwrap_or_default();
        for (script, number) in listed {
            let handler = &self.sheets[script].handlers[number];
            let after = (handler.seconds - from_s).rem_euclid(DAY_S);
            if after > 0.0 && after <= ran {
                let event = Arc::new(fields([("hour", Dynamic::from(handler.seconds / 3600.0))]));
                let task = Arc::clone(&handler.task);
                self.queue(script, task, event);
            }
        }
    }
}

impl Runtime {
    /// Fills the queues with what has happened since the last step: messages, timers, hours, then what the host has told.
    pub(super) fn gather(&mut self) {
        let mut desk = lock(&self.desk);
        let posted = std::mem::take(&mut desk.posted);
        for post in posted {
            let heard = message(post.to, post.name, post.from.into(), post.data);
            desk.deliver(heard);
        }
        desk.ring();
        let hour_s = desk.world.read().hour_s;
        if let Some(last) = self.last_hour_s.replace(hour_s)
            && hour_s.is_finite()
            && last.is_finite()
        {
            desk.strike_hours(last, hour_s);
        }
        for event in self.events.drain(..) {
            match event {
                Event::LookedAt { thing } => desk.look_at(&thing),
                Event::LookedAway { thing } => desk.look_away(&thing),
                event => {
                    if let Some(heard) = heard(event) {
                        desk.deliver(heard);
                    }
                }
            }
        }
    }
}
