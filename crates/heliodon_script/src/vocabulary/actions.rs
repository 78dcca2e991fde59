//! What scripts can do: each word becomes an [`Action`] for the host.

use super::{Argument, ArgumentKind, Call, Group, Word};
use crate::action::{Action, Easing, Hand};
use crate::diagnostic::Wrong;
use crate::names::Kind;
use crate::place::Spot;

const MOVABLE: ArgumentKind = ArgumentKind::Name(&[Kind::Thing, Kind::Actor]);
const VISIBLE: ArgumentKind = ArgumentKind::Name(&[Kind::Thing, Kind::Part, Kind::Actor]);
const SECONDS: Argument = Argument { name: "seconds", kind: ArgumentKind::Number(0.0, 3600.0) };
const VALUES: Argument = Argument { name: "values", kind: ArgumentKind::Filling };

fn spot(call: &Call<'_>, i: usize) -> Result<[f32; 3], Wrong> {
    call.spot(i).map(Spot::to_world).ok_or_else(|| Wrong::new("the place is missing", "give a place: at(x, y, z)"))
}

pub(super) const WORDS: &[Word] = &[
    Word {
        name: "move_to",
        group: Group::Actions,
        arguments: &[
            Argument { name: "what", kind: MOVABLE },
            Argument { name: "to", kind: ArgumentKind::Place },
            SECONDS,
            Argument { name: "easing", kind: ArgumentKind::OneOf(Easing::WORDS) },
        ],
        required: 2,
        fields: &[],
        what: r#"Moves a thing or actor to a place, in so many seconds (1) and smoothly: "smooth", "even", "start" (slow at first) or "end" (slow at last). Its arrival can be waited for."#,
        example: r#"move_to("mallet", at(1.0, 0.9, -2.0), 1.5, "end");"#,
        run: |call| {
            let to = spot(call, 1)?;
            let easing = Easing::from_word(&call.text(3));
            let (what, seconds) = (call.text(0), call.single_or(2, 1.0));
            call.act(Action::Move { what, to, seconds, easing })
        },
    },
    Word {
        name: "turn",
        group: Group::Actions,
        arguments: &[
            Argument { name: "what", kind: MOVABLE },
            Argument { name: "degrees", kind: ArgumentKind::Number(-36_000.0, 36_000.0) },
            SECONDS,
            Argument { name: "easing", kind: ArgumentKind::OneOf(Easing::WORDS) },
        ],
        required: 2,
        fields: &[],
        what: "Turns a thing or actor about the vertical, by so many degrees to the left as seen from above, in so many seconds (1).",
        example: r#"turn("door", 90, 2);"#,
        run: |call| {
            let easing = Easing::from_word(&call.text(3));
            let (what, degrees, seconds) = (call.text(0), call.single_or(1, 0.0), call.single_or(2, 1.0));
            call.act(Action::Turn { what, degrees, seconds, easing })
        },
    },
    Word {
        name: "show",
        group: Group::Actions,
        arguments: &[Argument { name: "what", kind: VISIBLE }],
        required: 1,
        fields: &[],
        what: "Shows a thing, part or actor.",
        example: r#"show("ladder");"#,
        run: |call| {
            let what = call.text(0);
            call.act(Action::Show { what })
        },
    },
    Word {
        name: "hide",
        group: Group::Actions,
        arguments: &[Argument { name: "what", kind: VISIBLE }],
        required: 1,
        fields: &[],
        what: "Hides it: it can be neither seen nor touched.",
        example: r#"hide("ladder");"#,
        run: |call| {
            let what = call.text(0);
            call.act(Action::Hide { what })
        },
    },
    Word {
        name: "fade",
        group: Group::Actions,
        arguments: &[
            Argument { name: "what", kind: VISIBLE },
            Argument { name: "opacity", kind: ArgumentKind::Number(0.0, 1.0) },
            SECONDS,
        ],
        required: 2,
        fields: &[],
        what: "Makes it more or less transparent in so many seconds (1): 1 is solid, 0 not there.",
        example: r#"fade("zeus", 0.3, 2);"#,
        run: |call| {
            let (what, opacity, seconds) = (call.text(0), call.single_or(1, 1.0), call.single_or(2, 1.0));
            call.act(Action::Fade { what, opacity, seconds })
        },
    },
    Word {
        name: "highlight",
        group: Group::Actions,
        arguments: &[Argument { name: "what", kind: VISIBLE }, Argument { name: "on", kind: ArgumentKind::Flag }],
        required: 1,
        fields: &[],
        what: "Marks what is meant, so that the visitor finds it; with false no longer.",
        example: r#"highlight("mallet");
when_grab("mallet", || highlight("mallet", false));"#,
        run: |call| {
            let (what, on) = (call.text(0), call.flag_or(1, true));
            call.act(Action::Highlight { what, on })
        },
    },
    Word {
        name: "animate",
        group: Group::Actions,
        arguments: &[
            Argument { name: "what", kind: MOVABLE },
            Argument { name: "animation", kind: ArgumentKind::Name(&[Kind::Animation]) },
            Argument { name: "repeat", kind: ArgumentKind::Flag },
        ],
        required: 2,
        fields: &[],
        what: "Plays an animation of an actor or thing once, or with true until it is stopped.",
        example: r#"animate("worker", "hammer", true);"#,
        run: |call| {
            let (what, animation, repeat) = (call.text(0), call.text(1), call.flag_or(2, false));
            call.act(Action::Animate { what, animation, repeat })
        },
    },
    Word {
        name: "stop_animation",
        group: Group::Actions,
        arguments: &[Argument { name: "what", kind: MOVABLE }],
        required: 1,
        fields: &[],
        what: "Stops its animation.",
        example: r#"stop_animation("worker");"#,
        run: |call| {
            let what = call.text(0);
            call.act(Action::StopAnimation { what })
        },
    },
    Word {
        name: "walk_to",
        group: Group::Actions,
        arguments: &[
            Argument { name: "actor", kind: ArgumentKind::Name(&[Kind::Actor]) },
            Argument { name: "to", kind: ArgumentKind::Place },
        ],
        required: 2,
        fields: &[],
        what: "Lets an actor walk to a place. Its arrival can be waited for.",
        example: r#"walk_to("guide", "bench");"#,
        run: |call| {
            let to = spot(call, 1)?;
            let actor = call.text(0);
            call.act(Action::Walk { actor, to })
        },
    },
    Word {
        name: "follow",
        group: Group::Actions,
        arguments: &[
            Argument { name: "actor", kind: ArgumentKind::Name(&[Kind::Actor]) },
            Argument { name: "path", kind: ArgumentKind::Name(&[Kind::Path]) },
        ],
        required: 2,
        fields: &[],
        what: "Lets an actor walk along a path. Its arrival can be waited for.",
        example: r#"follow("guide", "to-the-statue");"#,
        run: |call| {
            let (actor, path) = (call.text(0), call.text(1));
            call.act(Action::Follow { actor, path })
        },
    },
    Word {
        name: "play_film",
        group: Group::Actions,
        arguments: &[Argument { name: "film", kind: ArgumentKind::Name(&[Kind::Film]) }],
        required: 1,
        fields: &[],
        what: "Plays a film from its beginning. Its end can be waited for.",
        example: r#"play_film("casting");"#,
        run: |call| {
            let film = call.text(0);
            call.act(Action::PlayFilm { film })
        },
    },
    Word {
        name: "stop_film",
        group: Group::Actions,
        arguments: &[Argument { name: "film", kind: ArgumentKind::Name(&[Kind::Film]) }],
        required: 1,
        fields: &[],
        what: "Stops a film.",
        example: r#"stop_film("casting");"#,
        run: |call| {
            let film = call.text(0);
            call.act(Action::StopFilm { film })
        },
    },
    Word {
        name: "play_sound",
        group: Group::Actions,
        arguments: &[
            Argument { name: "sound", kind: ArgumentKind::Name(&[Kind::Sound]) },
            Argument { name: "at", kind: ArgumentKind::Place },
            Argument { name: "volume", kind: ArgumentKind::Number(0.0, 10.0) },
        ],
        required: 1,
        fields: &[],
        what: "Plays a sound, from a place or, where none is given, everywhere; volume 1 is as recorded. Its end can be waited for.",
        example: r#"play_sound("wood", "bench", 0.5);"#,
        run: |call| {
            let at = call.spot(1).map(Spot::to_world);
            let (sound, volume) = (call.text(0), call.single_or(2, 1.0));
            call.act(Action::PlaySound { sound, at, volume })
        },
    },
    Word {
        name: "stop_sound",
        group: Group::Actions,
        arguments: &[Argument { name: "sound", kind: ArgumentKind::Name(&[Kind::Sound]) }],
        required: 1,
        fields: &[],
        what: "Stops a sound.",
        example: r#"stop_sound("wood");"#,
        run: |call| {
            let sound = call.text(0);
            call.act(Action::StopSound { sound })
        },
    },
    Word {
        name: "start_particles",
        group: Group::Actions,
        arguments: &[Argument { name: "particles", kind: ArgumentKind::Name(&[Kind::Particles]) }],
        required: 1,
        fields: &[],
        what: "Lights a fire, lets dust or smoke rise.",
        example: r#"start_particles("dust");
after(1.0, || stop_particles("dust"));"#,
        run: |call| {
            let particles = call.text(0);
            call.act(Action::StartParticles { particles })
        },
    },
    Word {
        name: "stop_particles",
        group: Group::Actions,
        arguments: &[Argument { name: "particles", kind: ArgumentKind::Name(&[Kind::Particles]) }],
        required: 1,
        fields: &[],
        what: "Lets it go out or settle.",
        example: r#"stop_particles("fire");"#,
        run: |call| {
            let particles = call.text(0);
            call.act(Action::StopParticles { particles })
        },
    },
    Word {
        name: "light",
        group: Group::Actions,
        arguments: &[
            Argument { name: "light", kind: ArgumentKind::Name(&[Kind::Light]) },
            Argument { name: "brightness", kind: ArgumentKind::Number(0.0, 1000.0) },
            SECONDS,
        ],
        required: 2,
        fields: &[],
        what: "Changes a lamp in so many seconds (1): 1 is as the site has it, 0 is out.",
        example: r#"light("oil-lamp", 0, 3);"#,
        run: |call| {
            let (light, brightness, seconds) = (call.text(0), call.single_or(1, 1.0), call.single_or(2, 1.0));
            call.act(Action::Light { light, brightness, seconds })
        },
    },
    Word {
        name: "material",
        group: Group::Actions,
        arguments: &[
            Argument { name: "target", kind: ArgumentKind::Name(&[Kind::Thing, Kind::Part]) },
            Argument { name: "material", kind: ArgumentKind::Name(&[Kind::Material]) },
            SECONDS,
        ],
        required: 2,
        fields: &[],
        what: "Covers a thing or part with a material, in so many seconds (1).",
        example: r#"material("zeus/face", "ivory", 2);"#,
        run: |call| {
            let (target, material, seconds) = (call.text(0), call.text(1), call.single_or(2, 1.0));
            call.act(Action::Material { target, material, seconds })
        },
    },
    Word {
        name: "bare",
        group: Group::Actions,
        arguments: &[Argument { name: "target", kind: ArgumentKind::Name(&[Kind::Thing, Kind::Part]) }, SECONDS],
        required: 1,
        fields: &[],
        what: "Takes the material off a thing or part again, in so many seconds (1).",
        example: r#"bare("zeus/face", 2);"#,
        run: |call| {
            let (target, seconds) = (call.text(0), call.single_or(1, 1.0));
            call.act(Action::Bare { target, seconds })
        },
    },
    Word {
        name: "give",
        group: Group::Actions,
        arguments: &[
            Argument { name: "thing", kind: ArgumentKind::Name(&[Kind::Thing]) },
            Argument { name: "hand", kind: ArgumentKind::OneOf(Hand::WORDS) },
        ],
        required: 1,
        fields: &[],
        what: r#"Puts a thing into a hand of the visitor: "right" where none is named, or "left"."#,
        example: r#"give("mallet", "left");"#,
        run: |call| {
            let (thing, hand) = (call.text(0), call.hand(1));
            call.act(Action::Give { thing, hand })
        },
    },
    Word {
        name: "take",
        group: Group::Actions,
        arguments: &[Argument { name: "thing", kind: ArgumentKind::Name(&[Kind::Thing]) }],
        required: 1,
        fields: &[],
        what: "Takes a thing out of the visitor's hand and puts it back where it belongs.",
        example: r#"take("mallet");"#,
        run: |call| {
            let thing = call.text(0);
            call.act(Action::Take { thing })
        },
    },
    Word {
        name: "drop",
        group: Group::Actions,
        arguments: &[Argument { name: "thing", kind: ArgumentKind::Name(&[Kind::Thing]) }],
        required: 1,
        fields: &[],
        what: "Lets a thing fall out of the visitor's hand.",
        example: r#"drop("mallet");"#,
        run: |call| {
            let thing = call.text(0);
            call.act(Action::Drop { thing })
        },
    },
    Word {
        name: "set_hour",
        group: Group::Actions,
        arguments: &[Argument { name: "hour", kind: ArgumentKind::Hour }, SECONDS],
        required: 1,
        fields: &[],
        what: "Sets the hour of the day: at once, or by a time lapse of so many seconds.",
        example: r#"set_hour("17:30", 5);"#,
        run: |call| {
            let (hour_s, seconds) = (call.single_or(0, 0.0), call.single_or(1, 0.0));
            call.act(Action::SetHour { hour_s, seconds })
        },
    },
    Word {
        name: "pace",
        group: Group::Actions,
        arguments: &[Argument { name: "factor", kind: ArgumentKind::Number(0.0, 86_400.0) }],
        required: 1,
        fields: &[],
        what: "How fast the day passes: 1 as in life, 60 a minute in a second, 0 stands still.",
        example: "pace(60);",
        run: |call| {
            let factor = call.single_or(0, 1.0);
            call.act(Action::Pace { factor })
        },
    },
    Word {
        name: "exposure",
        group: Group::Actions,
        arguments: &[Argument { name: "stops", kind: ArgumentKind::Number(-16.0, 16.0) }, SECONDS],
        required: 1,
        fields: &[],
        what: "Makes the picture brighter or darker than the sky asks for, in stops, in so many seconds (1).",
        example: "exposure(1.5, 2);",
        run: |call| {
            let (stops, seconds) = (call.single_or(0, 0.0), call.single_or(1, 1.0));
            call.act(Action::Exposure { stops, seconds })
        },
    },
    Word {
        name: "subtitle",
        group: Group::Visitor,
        arguments: &[Argument { name: "text", kind: ArgumentKind::Name(&[Kind::Text]) }, SECONDS, VALUES],
        required: 1,
        fields: &[],
        what: "Says a text in the visitor's language, for so many seconds; where none are given, as long as it takes to read.",
        example: r#"subtitle("welcome");
subtitle("blows-left", 3, #{ n: 2 });"#,
        run: |call| {
            let (text, seconds, values) = (call.text(0), call.single_or(1, 0.0), call.filling(2));
            call.act(Action::Subtitle { text, seconds, values })
        },
    },
    Word {
        name: "task",
        group: Group::Visitor,
        arguments: &[Argument { name: "text", kind: ArgumentKind::Name(&[Kind::Text]) }, VALUES],
        required: 1,
        fields: &[],
        what: "Says what to do next. It stays on the screen until there is another task, or none.",
        example: r#"task("take-mallet");"#,
        run: |call| {
            let (text, values) = (call.text(0), call.filling(1));
            call.act(Action::Task { text, values })
        },
    },
    Word {
        name: "no_task",
        group: Group::Visitor,
        arguments: &[],
        required: 0,
        fields: &[],
        what: "Takes the task from the screen.",
        example: "no_task();",
        run: |call| call.act(Action::NoTask),
    },
    Word {
        name: "hint",
        group: Group::Visitor,
        arguments: &[Argument { name: "text", kind: ArgumentKind::Name(&[Kind::Text]) }, SECONDS, VALUES],
        required: 1,
        fields: &[],
        what: "Says how to do it, for so many seconds (5), beside the task.",
        example: r#"hint("harder", 4);"#,
        run: |call| {
            let (text, seconds, values) = (call.text(0), call.single_or(1, 5.0), call.filling(2));
            call.act(Action::Hint { text, seconds, values })
        },
    },
    Word {
        name: "guide",
        group: Group::Visitor,
        arguments: &[Argument { name: "path", kind: ArgumentKind::Name(&[Kind::Path]) }],
        required: 1,
        fields: &[],
        what: "Shows a path on the ground, for the visitor to follow.",
        example: r#"guide("to-the-statue");"#,
        run: |call| {
            let path = call.text(0);
            call.act(Action::Guide { path })
        },
    },
    Word {
        name: "no_guide",
        group: Group::Visitor,
        arguments: &[],
        required: 0,
        fields: &[],
        what: "Shows no path any more.",
        example: "no_guide();",
        run: |call| call.act(Action::NoGuide),
    },
    Word {
        name: "go_to",
        group: Group::Visitor,
        arguments: &[Argument { name: "view", kind: ArgumentKind::Name(&[Kind::View]) }, SECONDS],
        required: 1,
        fields: &[],
        what: "Takes the visitor to a view: at once, or by a flight of so many seconds.",
        example: r#"go_to("before-the-statue", 4);"#,
        run: |call| {
            let (view, seconds) = (call.text(0), call.single_or(1, 0.0));
            call.act(Action::GoTo { view, seconds })
        },
    },
    Word {
        name: "fade_screen",
        group: Group::Visitor,
        arguments: &[Argument { name: "darkness", kind: ArgumentKind::Number(0.0, 1.0) }, SECONDS],
        required: 1,
        fields: &[],
        what: "Darkens the whole picture in so many seconds (1): 0 is clear, 1 is black.",
        example: r#"fade_screen(1, 2);
after(2, || { go_to("before-the-statue"); fade_screen(0); });"#,
        run: |call| {
            let (darkness, seconds) = (call.single_or(0, 0.0), call.single_or(1, 1.0));
            call.act(Action::FadeScreen { darkness, seconds })
        },
    },
];
