//! What scripts wait for: events, timers, messages.

use super::{Argument, ArgumentKind, Call, Group, Word};
use crate::desk::{Handler, Posted, Task, Trigger};
use crate::diagnostic::Wrong;
use crate::names::Kind;
use crate::value::Value;
use rhai::{Dynamic, Map};
use std::sync::Arc;

const HANDLER: Argument = Argument { name: "handler", kind: ArgumentKind::Handler };
const GIVEN: Argument = Argument { name: "given", kind: ArgumentKind::Data };
const TARGETS: &[Kind] = &[Kind::Thing, Kind::Part];
const SEEN: &[Kind] = &[Kind::Thing, Kind::Part, Kind::Actor];

const fn pattern(name: &'static str, kinds: &'static [Kind]) -> Argument {
    Argument { name, kind: ArgumentKind::Pattern(kinds) }
}

const fn seconds(most: f64) -> Argument {
    Argument { name: "seconds", kind: ArgumentKind::Number(0.0, most) }
}

/// A handler, and what is handed on to it: the two last arguments, of which the second may be missing.
fn task(call: &mut Call<'_>, at: usize) -> Result<Arc<Task>, Wrong> {
    let (function, given, place) = (call.handler(at)?, call.data(at + 1), call.place);
    call.desk.task(function, given, place)
}

/// Waits for something of one name.
fn listen(call: &mut Call<'_>, trigger: Trigger) -> Result<Dynamic, Wrong> {
    let task = task(call, 1)?;
    let first = call.text(0);
    call.desk.listen(trigger, first, Handler { task, second: "*".to_owned(), seconds: 0.0 })?;
    Ok(Dynamic::UNIT)
}

/// Waits for something of two names.
fn listen_for_two(call: &mut Call<'_>, trigger: Trigger) -> Result<Dynamic, Wrong> {
    let task = task(call, 2)?;
    let (first, second) = (call.text(0), call.text(1));
    call.desk.listen(trigger, first, Handler { task, second, seconds: 0.0 })?;
    Ok(Dynamic::UNIT)
}

fn start_timer(call: &mut Call<'_>, repeat: bool) -> Result<Dynamic, Wrong> {
    let task = task(call, 1)?;
    let (seconds, script) = (call.number_or(0, 0.0), call.desk.speaker);
    let period_s = repeat.then_some(seconds);
    call.desk.start_timer(script, seconds, period_s, task, Arc::new(Map::new()), None).map(Dynamic::from)
}

pub(super) const WORDS: &[Word] = &[
    Word {
        name: "when_enter",
        group: Group::Events,
        arguments: &[pattern("region", &[Kind::Region]), HANDLER, GIVEN],
        required: 2,
        fields: &[("region", "the region")],
        what: "Waits for the visitor to enter a region.",
        example: r#"when_enter("workshop", || { subtitle("welcome"); task("take-mallet"); });"#,
        run: |call| listen(call, Trigger::Enter),
    },
    Word {
        name: "when_leave",
        group: Group::Events,
        arguments: &[pattern("region", &[Kind::Region]), HANDLER, GIVEN],
        required: 2,
        fields: &[("region", "the region")],
        what: "Waits for the visitor to leave a region.",
        example: r#"when_leave("workshop", || { subtitle("farewell"); no_task(); });"#,
        run: |call| listen(call, Trigger::Leave),
    },
    Word {
        name: "when_look",
        group: Group::Events,
        arguments: &[pattern("what", SEEN), seconds(600.0), HANDLER, GIVEN],
        required: 3,
        fields: &[("thing", "what is looked at")],
        what: "Waits for the visitor's eyes to rest on something for so many seconds; after they have left it, it waits for the next time.",
        example: r#"when_look("zeus/face", 2.0, || hint("the-face"));"#,
        run: |call| {
            let task = task(call, 2)?;
            let (first, seconds) = (call.text(0), call.number_or(1, 0.0));
            call.desk.listen(Trigger::Look, first, Handler { task, second: "*".to_owned(), seconds })?;
            Ok(Dynamic::UNIT)
        },
    },
    Word {
        name: "when_touch",
        group: Group::Events,
        arguments: &[pattern("what", SEEN), HANDLER, GIVEN],
        required: 2,
        fields: &[("thing", "what was touched"), ("hand", "\"right\" or \"left\"")],
        what: "Waits for a hand of the visitor to touch something.",
        example: r#"when_touch("mallet", |e| give(e.thing, e.hand));"#,
        run: |call| listen(call, Trigger::Touch),
    },
    Word {
        name: "when_grab",
        group: Group::Events,
        arguments: &[pattern("thing", &[Kind::Thing]), HANDLER, GIVEN],
        required: 2,
        fields: &[("thing", "what was taken"), ("hand", "\"right\" or \"left\"")],
        what: "Waits for the visitor to take a thing into a hand.",
        example: r#"when_grab("mallet", |e| { play_sound("wood", e.thing); task("take-chisel"); });"#,
        run: |call| listen(call, Trigger::Grab),
    },
    Word {
        name: "when_release",
        group: Group::Events,
        arguments: &[pattern("thing", &[Kind::Thing]), HANDLER, GIVEN],
        required: 2,
        fields: &[("thing", "what was let go"), ("hand", "\"right\" or \"left\""), ("place", "where")],
        what: "Waits for the visitor to let a thing go.",
        example: r#"when_release("*", |e| if e.place.y < 0.5 { move_to(e.thing, "bench", 1.0); });"#,
        run: |call| listen(call, Trigger::Release),
    },
    Word {
        name: "when_struck",
        group: Group::Events,
        arguments: &[pattern("target", TARGETS), pattern("tool", &[Kind::Thing]), HANDLER, GIVEN],
        required: 3,
        fields: &[
            ("target", "what was struck"),
            ("tool", "with what"),
            ("speed", "how fast, metres a second"),
            ("place", "where"),
        ],
        what: "Waits for the visitor to strike something with a tool.",
        example: r#"
state.blows = 0;
when_struck("zeus/face", "chisel", |e| {
    if e.speed < 1.0 { hint("harder"); return; }
    state.blows += 1;
    start_particles("dust");
});"#,
        run: |call| listen_for_two(call, Trigger::Struck),
    },
    Word {
        name: "when_hit",
        group: Group::Events,
        arguments: &[pattern("thing", &[Kind::Thing]), HANDLER, GIVEN],
        required: 2,
        fields: &[
            ("thing", "what has hit something"),
            ("on", "what it has hit, a thing or an actor; \"\" is the ground or a wall"),
            ("speed", "how fast, metres a second"),
            ("place", "where"),
        ],
        what: "Waits for a thing that was dropped or pushed to hit something, faster than half a metre a second.",
        example: r#"when_hit("*", |e| if e.speed > 1.5 { play_sound("wood", e.thing); });"#,
        run: |call| listen(call, Trigger::Hit),
    },
    Word {
        name: "when_applied",
        group: Group::Events,
        arguments: &[pattern("target", TARGETS), pattern("material", &[Kind::Material]), HANDLER, GIVEN],
        required: 3,
        fields: &[("target", "what was covered"), ("material", "with what"), ("tool", "by what: a tool, or \"hand\"")],
        what: "Waits for the visitor to bring a material onto something.",
        example: r#"
when_applied("zeus/robe", "*", |e| {
    if e.material == "gold" { material(e.target, "gold", 2.0); } else { hint("not-that"); }
});"#,
        run: |call| listen_for_two(call, Trigger::Applied),
    },
    Word {
        name: "when_hour",
        group: Group::Events,
        arguments: &[Argument { name: "hour", kind: ArgumentKind::Hour }, HANDLER, GIVEN],
        required: 2,
        fields: &[("hour", "the hour, a number from 0 to below 24")],
        what: "Waits for the site's clock to reach an hour, every day; setting the clock past it is not reaching it.",
        example: r#"when_hour("12:00", || play_sound("noon-bell"));"#,
        run: |call| {
            let task = task(call, 1)?;
            let seconds = call.number_or(0, 0.0);
            call.desk.listen(Trigger::Hour, String::new(), Handler { task, second: "*".to_owned(), seconds })?;
            Ok(Dynamic::UNIT)
        },
    },
    Word {
        name: "when_arrived",
        group: Group::Events,
        arguments: &[pattern("what", &[Kind::Thing, Kind::Actor]), HANDLER, GIVEN],
        required: 2,
        fields: &[("what", "what has arrived")],
        what: "Waits for a movement (move_to, walk_to, follow) to come to its end.",
        example: r#"when_arrived("guide", || animate("guide", "point"));"#,
        run: |call| listen(call, Trigger::Arrived),
    },
    Word {
        name: "when_ended",
        group: Group::Events,
        arguments: &[pattern("what", &[Kind::Film, Kind::Sound, Kind::Actor, Kind::Thing]), HANDLER, GIVEN],
        required: 2,
        fields: &[("what", "the film or sound, or who was animated")],
        what: "Waits for a film, a sound or an animation that does not repeat to come to its end.",
        example: r#"when_ended("casting", || task("take-ladle"));"#,
        run: |call| listen(call, Trigger::Ended),
    },
    Word {
        name: "after",
        group: Group::Time,
        arguments: &[seconds(86_400.0), HANDLER, GIVEN],
        required: 2,
        fields: &[],
        what: "Does something once, so many seconds from now. Answers with a number for cancel().",
        example: r#"after(2.5, || hide("ladder"));"#,
        run: |call| start_timer(call, false),
    },
    Word {
        name: "every",
        group: Group::Time,
        arguments: &[Argument { name: "seconds", kind: ArgumentKind::Number(0.02, 86_400.0) }, HANDLER, GIVEN],
        required: 2,
        fields: &[],
        what: "Does something again and again, so many seconds apart, at most once a frame. Answers with a number for cancel().",
        example: r#"
state.watch = every(1.0, || {
    if distance("visitor", "fire") < 1.0 { subtitle("too-hot"); cancel(state.watch); }
});"#,
        run: |call| start_timer(call, true),
    },
    Word {
        name: "cancel",
        group: Group::Time,
        arguments: &[Argument { name: "timer", kind: ArgumentKind::Number(0.0, f64::INFINITY) }],
        required: 1,
        fields: &[],
        what: "Ends a timer of after() or every(); nothing where it is over.",
        example: "let timer = after(10.0, || hint(\"hurry\"));\ncancel(timer);",
        run: |call| {
            #[expect(clippy::cast_possible_truncation, reason = "the number of a timer, counted from 1")]
            let number = call.number_or(0, 0.0) as i64;
            call.desk.sheet().timers.retain(|timer| timer.number != number);
            Ok(Dynamic::UNIT)
        },
    },
    Word {
        name: "send",
        group: Group::Messages,
        arguments: &[
            Argument { name: "to", kind: ArgumentKind::Key },
            Argument { name: "message", kind: ArgumentKind::Key },
            Argument { name: "data", kind: ArgumentKind::Data },
        ],
        required: 2,
        fields: &[],
        what: "Sends a message, to whatever waits for it in any script. It is heard in the next frame.",
        example: r#"send("guide", "come", #{ to: "bench" });"#,
        run: |call| {
            let (to, name, data) = (call.text(0), call.text(1), call.data(2));
            let most = call.desk.limits.message_bytes;
            Value::from_script(&data, most)?;
            let most = call.desk.limits.messages;
            let sheet = call.desk.sheet();
            if sheet.sent >= most {
                sheet.statistics.dropped_messages += 1;
                let remedy = "send fewer: one that says everything, or spread them with after()";
                return Err(Wrong::new(format!("more than {most} messages in a frame"), remedy));
            }
            sheet.sent += 1;
            let from = sheet.name.clone();
            call.desk.posted.push(Posted { to, name, from, data });
            Ok(Dynamic::UNIT)
        },
    },
    Word {
        name: "when_message",
        group: Group::Messages,
        arguments: &[
            Argument { name: "to", kind: ArgumentKind::Key },
            Argument { name: "message", kind: ArgumentKind::Key },
            HANDLER,
            GIVEN,
        ],
        required: 3,
        fields: &[
            ("to", "to whom"),
            ("message", "its name"),
            ("from", "the script that sent it, or \"outside\""),
            ("data", "what was sent with it"),
        ],
        what: "Waits for a message. \"*\" stands for any.",
        example: r#"when_message("guide", "come", |e| walk_to("guide", e.data.to));"#,
        run: |call| listen_for_two(call, Trigger::Message),
    },
];
