//! What scripts hear, do, keep and ask.

use crate::common::*;
use heliodon_script::action::{Action, Easing, Hand};
use heliodon_script::event::Event;
use heliodon_script::limits::Limits;
use heliodon_script::value::Value;

#[test]
fn a_handler_does_what_it_says_each_time() {
    let mut stage =
        Stage::new(&[("yard.rhai", r#"when_enter("workshop", || { subtitle("welcome"); task("take-mallet"); });"#)]);
    assert_eq!(stage.step(), []);
    for _ in 0..2 {
        assert_eq!(said(&stage.after(entered("workshop"))), ["subtitle welcome", "task take-mallet"]);
    }
    assert_eq!(stage.after(entered("yard")), []);
    assert_eq!(stage.told(), "");
}

#[test]
fn state_lasts_and_is_each_scripts_own() {
    let count = r#"
        state.blows = 0;
        state.list = [];
        when_struck("*", "chisel", |e| {
            state.blows += 1;
            state.list.push(e.target);
            if state.blows == 3 { subtitle("blows-left", 2, #{ n: state.blows, parts: state.list.len(), speed: e.speed }); }
        });"#;
    let mut stage = Stage::new(&[("a.rhai", count), ("b.rhai", "state.blows = 100;")]);
    stage.step();
    for _ in 0..2 {
        assert_eq!(stage.after(struck("zeus/face", "chisel", 2.0)), []);
    }
    assert_eq!(stage.after(struck("zeus/face", "mallet", 2.0)), []);
    let actions = stage.after(struck("zeus/hand", "chisel", 2.5));
    let values = [("n", "3"), ("parts", "3"), ("speed", "2.5")].map(|(k, v)| (k.to_owned(), v.to_owned())).into();
    assert_eq!(actions, [Action::Subtitle { text: "blows-left".into(), seconds: 2.0, values }], "{}", stage.told());
    assert_eq!(stage.told(), "");
}

#[test]
fn functions_see_the_top_and_what_they_are_handed() {
    let text = r#"
        const TOOL = "mallet";
        let hint_of = "take-" + TOOL;
        fn show_it(thing, seconds) { highlight(thing); hint(hint_of, seconds); }
        fn on_enter(e) { show_it(TOOL, 2); if e.region == "workshop" { state.inside = true; } }
        when_enter("workshop", on_enter);
        for part in ["zeus/face", "zeus/robe"] {
            when_touch(part, |e| { if e.given == e.thing { give(TOOL, e.hand); } }, part);
        }
        after(1, |e| subtitle(e.given), "welcome");"#;
    let mut stage = Stage::new(&[("a.rhai", text)]);
    stage.step();
    let actions = stage.after(entered("workshop"));
    assert_eq!(actions[0], Action::Highlight { what: "mallet".into(), on: true }, "{}", stage.told());
    assert_eq!(said(&actions), ["hint take-mallet"]);
    assert_eq!(stage.after(touched("zeus/robe")), [Action::Give { thing: "mallet".into(), hand: Hand::Right }]);
    assert_eq!(said(&stage.wait(1.1)), ["subtitle welcome"]);
    assert_eq!(stage.told(), "");
}

#[test]
fn places_are_names_lists_and_sums() {
    let text = r#"
        when_touch("mallet", || {
            move_to("mallet", place("bench") + at(0, 0.5, 0), 2, "even");
            move_to("chisel", [1, 2.5, 3]);
            play_sound("wood", "bench");
            let p = visitor();
            p.y += 1;
            walk_to("guide", p);
        });"#;
    let mut stage = Stage::new(&[("a.rhai", text)]);
    stage.world.set_visitor([3.0, 0.0, 4.0]);
    stage.step();
    let actions = stage.after(touched("mallet"));
    let expected = [
        Action::Move { what: "mallet".into(), to: [1.0, 0.5, 2.0], seconds: 2.0, easing: Easing::Even },
        Action::Move { what: "chisel".into(), to: [1.0, 2.5, 3.0], seconds: 1.0, easing: Easing::Smooth },
        Action::PlaySound { sound: "wood".into(), at: Some([1.0, 0.0, 2.0]), volume: 1.0 },
        Action::Walk { actor: "guide".into(), to: [3.0, 1.0, 4.0] },
    ];
    assert_eq!(actions, expected, "{}", stage.told());
}

#[test]
fn questions_are_answered_by_the_world() {
    let text = r#"
        when_enter("yard", || {
            print(`${hour()} ${is_held("mallet")} ${held()} ${held("left")} ${is_inside("yard")} ${is_shown("ladder")}`);
            print(`${material_of("zeus/robe")} ${distance("visitor", "fire")} ${language()} ${place("bench")}`);
        });"#;
    let mut stage = Stage::new(&[("a.rhai", text)]);
    stage.step();
    stage.world.set_hour_s(49_500.0);
    stage.world.set_visitor([5.0, 0.0, 3.0]);
    stage.world.set_held(Hand::Right, Some("mallet"));
    stage.world.set_inside("yard", true);
    stage.world.set_shown("ladder", false);
    stage.world.set_material("zeus/robe", "gold");
    stage.after(entered("yard"));
    let told = stage.told();
    assert!(told.contains("13.75 true mallet  true false"), "{told}");
    assert!(told.contains("gold 3.0 en at(1, 0, 2)"), "{told}");
}

#[test]
fn timers_ring_and_are_cancelled() {
    let text = r#"
        after(0.6, || subtitle("welcome"));
        state.ticks = 0;
        state.timer = every(0.25, || {
            state.ticks += 1;
            hint("hurry");
            if state.ticks == 3 { cancel(state.timer); }
        });
        cancel(after(0.1, || subtitle("farewell")));"#;
    let mut stage = Stage::new(&[("a.rhai", text)]);
    stage.step();
    let said = said(&stage.wait(3.0));
    assert_eq!(said, ["hint hurry", "hint hurry", "subtitle welcome", "hint hurry"], "{}", stage.told());
    // a viewer that was held up for long does not make up for it
    let mut late = Stage::new(&[("a.rhai", r#"every(0.1, || hint("hurry"));"#)]);
    late.step();
    late.now_s += 100.0;
    assert_eq!(late.step().len(), 1);
}

#[test]
fn looks_last_as_long_as_they_are_asked_for() {
    let mut stage =
        Stage::new(&[("a.rhai", r#"when_look("zeus/face", 1.0, |e| { if e.thing == "zeus/face" { hint("the-face"); } });"#)]);
    stage.step();
    let (at, away) = (Event::LookedAt { thing: "zeus/face".into() }, Event::LookedAway { thing: "zeus/face".into() });
    stage.after(at.clone());
    stage.wait(0.8);
    stage.after(away);
    assert_eq!(stage.wait(1.0), []);
    stage.after(at);
    assert_eq!(said(&stage.wait(3.0)), ["hint the-face"]);
}

#[test]
fn hours_are_reached_by_running_not_by_setting() {
    let mut stage =
        Stage::new(&[("a.rhai", r#"when_hour("12:00", || play_sound("noon-bell")); when_hour(0.0, || hint("hurry"));"#)]);
    let mut at = |hour_s: f64| {
        stage.world.set_hour_s(hour_s);
        stage.step().len()
    };
    assert_eq!(at(43_199.0), 0, "nothing is reached in the first frame");
    assert_eq!(at(43_201.0), 1);
    assert_eq!(at(43_202.0), 0);
    assert_eq!(at(43_190.0), 0, "the clock goes back");
    assert_eq!(at(60_000.0), 0, "the clock is set");
    assert_eq!(at(86_399.0), 0);
    assert_eq!(at(3.0), 1, "midnight");
    assert_eq!(at(f64::NAN), 0);
}

#[test]
fn messages_are_heard_in_the_next_frame() {
    let guide = r#"when_message("guide", "come", |e| { walk_to("guide", e.data.to); print(e.from); });"#;
    let workshop = r#"when_enter("workshop", || send("guide", "come", #{ to: "bench" }));"#;
    let mut stage = Stage::new(&[("guide.rhai", guide), ("workshop.rhai", workshop)]);
    stage.step();
    assert_eq!(stage.after(entered("workshop")), []);
    assert_eq!(stage.step(), [Action::Walk { actor: "guide".into(), to: [1.0, 0.0, 2.0] }]);
    assert!(stage.told().contains("workshop.rhai"));
    let data = Value::Table([("to".to_owned(), Value::from("bench"))].into());
    assert_eq!(stage.after(Event::Message { to: "guide".into(), name: "come".into(), data }).len(), 1);
    assert!(stage.told().contains("outside"));
}

#[test]
fn what_is_remembered_is_recalled_by_all() {
    let a = r#"when_grab("mallet", || { remember("has-mallet", true); remember("where", [1, "a", #{ b: 2.5 }]); });"#;
    let b = r#"if recall("has-mallet") { task("strike"); } else { task("take-mallet"); }
        when_enter("yard", || { print(recall("has-mallet")); print(recall("where", [])[2].b); print(recall("no-such", 5)); forget("where"); });"#;
    let mut stage = Stage::new(&[("a.rhai", a), ("b.rhai", b)]);
    assert_eq!(said(&stage.step()), ["task take-mallet"]);
    stage.after(grabbed("mallet"));
    stage.after(entered("yard"));
    let told = stage.told();
    assert!(told.contains("b.rhai: true") && told.contains("b.rhai: 2.5") && told.contains("b.rhai: 5"), "{told}");
    let memory = stage.runtime.with_memory(|memory| memory.clone());
    assert_eq!(memory.get("has-mallet"), Some(&Value::Flag(true)));
    assert!(memory.changed() && memory.validate() && memory.get("where").is_none());
}

#[test]
fn what_is_drawn_by_chance_is_drawn_again() {
    let text = r#"when_enter("yard", || print(random(2, 5)));"#;
    let draw = |others: &[(&str, &str)]| {
        let mut scripts = vec![("a.rhai", text)];
        scripts.extend_from_slice(others);
        let mut stage = Stage::new(&scripts);
        stage.step();
        stage.after(entered("yard"));
        stage.told().lines().find(|line| line.starts_with("a.rhai")).unwrap().to_owned()
    };
    assert_eq!(draw(&[]), draw(&[("b.rhai", text)]), "another script changes nothing");
    let drawn: f64 = draw(&[]).rsplit(' ').next().unwrap().parse().unwrap();
    assert!((2.0..5.0).contains(&drawn));
}

#[test]
fn a_reload_keeps_memory_and_what_is_kept() {
    let first = r#"
        state.blows = 0; keep("blows");
        state.other = 0;
        when_touch("mallet", || { state.blows += 1; state.other += 1; remember("touched", true); });
        every(1, || hint("hurry"));"#;
    let second = r#"
        state.blows = 0; keep("blows");
        state.other = 0;
        when_enter("yard", || print(`${state.blows} ${state.other} ${recall("touched")}`));"#;
    let mut stage = Stage::new(&[("a.rhai", first)]);
    stage.step();
    for _ in 0..4 {
        stage.after(touched("mallet"));
    }
    let broken = heliodon_script::program::Source::new("a.rhai", "when_enter(\"yard\" || {");
    let (broken, told) = heliodon_script::program::Program::compile(&[broken], &names());
    assert!(!broken.is_sound() && told.len() == 1);
    assert!(stage.runtime.reload(broken).is_err());
    assert_eq!(said(&stage.wait(1.1)), ["hint hurry"], "the old one goes on");
    stage.runtime.reload(program(&[("a.rhai", second)])).unwrap();
    // and again at once: nothing that was kept is lost by a reload that comes before the scripts have run
    stage.runtime.reload(program(&[("a.rhai", second)])).unwrap();
    assert_eq!(stage.wait(2.0), [], "timers are gone");
    stage.after(entered("yard"));
    assert!(stage.told().contains("4 0 true"));
}

#[test]
fn wrong_values_are_told_with_their_place() {
    let text = r#"
        when_enter("yard", || {
            let part = "zeus/" + "hed";
            material(part, "gold");
        });
        when_enter("workshop", || move_to("mallet", "ladder"));
        when_touch("mallet", |e| fade("mallet", e.hand));
        when_touch("chisel", || fade("mallet", 1 + 1));
        when_touch("ladle", || print(state.blow));
        when_touch("door", || { state.f = |x| x; });
        state.blows = 1;"#;
    let mut stage = Stage::new(&[("a.rhai", text)]);
    stage.step();
    stage.after(entered("yard"));
    assert_eq!(stage.told(), "a.rhai:4:13: material: there is no thing or part `zeus/hed`; did you mean `zeus/hand`?\n");
    let mut told = |event| {
        stage.after(event);
        stage.told()
    };
    assert!(told(entered("workshop")).contains("nobody knows where `ladder` is"));
    assert!(told(touched("mallet")).contains("its `opacity` is a text; give a number from 0 to 1"));
    assert!(told(touched("chisel")).contains("its `opacity` is 2; give a number from 0 to 1"));
    assert!(told(touched("ladle")).contains("did you mean `state.blows`?"));
    let function = told(touched("door"));
    assert!(function.contains("a function cannot be kept or sent"), "{function}");
}

#[test]
fn a_host_learns_what_is_waited_for() {
    let bench = r#"
        when_touch("door", || subtitle("welcome"));
        when_struck("zeus/face", "chisel", || subtitle("the-face"));
        when_applied("zeus/robe", "*", || subtitle("well-done"));
        when_struck("*", "mallet", || throw "enough");"#;
    let mut stage = Stage::new(&[("bench.rhai", bench)]);
    let struck = |target, tool| struck(target, tool, 2.0);
    let waits = |stage: &Stage, event: &Event| stage.runtime.waits_for(event);
    assert!(!waits(&stage, &touched("door")), "before the first frame scripts wait for nothing");
    stage.step();
    for event in
        [touched("door"), struck("zeus/face", "chisel"), struck("bench", "mallet"), applied("zeus/robe", "gold", "ladle")]
    {
        assert!(waits(&stage, &event), "{event:?}");
    }
    for event in [touched("bench"), struck("zeus/hand", "chisel"), applied("zeus/face", "gold", "ladle"), entered("yard")] {
        assert!(!waits(&stage, &event), "{event:?}");
    }
    // a script that fails again and again is switched off, and waits for nothing any more
    for _ in 0..Limits::deterministic().failures {
        stage.after(struck("bench", "mallet"));
    }
    assert!(stage.told().contains("is switched off"));
    assert!(!waits(&stage, &touched("door")));
}
