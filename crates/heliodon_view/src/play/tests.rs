//! Somebody walks, looks and presses in a hall, with every device and without a GPU.

use super::*;
use crate::hands::HandsPlugin;
use crate::hands::pose::Poses;
use crate::impostor::Impostors;
use crate::input::Actions;
use crate::navigation::NavigationPlugin;
use crate::stage::frame::StageFrame;
use crate::stage::{StagePlugin, StageStatus};
use crate::story::StoryPlugin;
use crate::story::tests::write_bundle;
use crate::time_lapse::TimeLapse;
use crate::time_lapse::exposure::Exposure;
use crate::tracking::TrackingPlugin;
use bevy::ecs::system::RunSystemOnce;
use tempfile::TempDir;

/// What scripts hear: the hall is entered, and left.
const STORY: &str = r#"
when_enter("hall", || { task("go"); remember("been", "there"); });
when_leave("hall", || no_task());
"#;
const TEXTS: &str = "languages = [\"en\"]\n[texts.welcome]\nen = \"Welcome\"\n[texts.go]\nen = \"Go on\"\n";

const ALL: [Scheme; 3] = [Scheme::Keyboard, Scheme::Pad, Scheme::Hand];

/// What a press of something else, or a wand that is turned too fast, would set off.
const OTHERS: [Asked; 9] = [
    Asked::Play,
    Asked::StepBack,
    Asked::StepOn,
    Asked::Brighter,
    Asked::Darker,
    Asked::Gait,
    Asked::Home,
    Asked::Take,
    Asked::Use,
];

/// How often an action began, and others did.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
struct Begun {
    recentred: f32,
    others: f32,
}

fn count(actions: Res<Actions>, mut begun: ResMut<Begun>) {
    begun.recentred += actions.count(Asked::Recentre);
    begun.others += OTHERS.iter().map(|&other| actions.count(other)).sum::<f32>();
}

fn player(scheme: Scheme, bind: &[(&str, &[&str])]) -> Result<(TempDir, Player), PlayError> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("story.rhai"), STORY).unwrap();
    std::fs::write(folder.path().join("texts.toml"), TEXTS).unwrap();
    write_bundle(folder.path());
    let bind = bind.iter().map(|(action, triggers)| ((*action).to_owned(), triggers.iter().map(|t| (*t).to_owned()).collect()));
    let input = InputSettings { bind: bind.collect(), ..InputSettings::default() };
    let (bindings, faults) = Input::new(&input);
    assert!(faults.is_empty(), "{faults:?}");
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, bevy::input::InputPlugin))
        .add_plugins((crate::input::InputPlugin, NavigationPlugin, StagePlugin, TrackingPlugin, StoryPlugin, HandsPlugin))
        .insert_resource(bindings)
        .init_resource::<StageFrame>()
        .init_resource::<TimeLapse>()
        .init_resource::<Exposure>()
        .init_resource::<Actors>()
        .init_resource::<Impostors>()
        .init_resource::<Begun>()
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO))
        .add_systems(Update, count);
    app.finish();
    app.cleanup();
    app.world_mut().resource_mut::<Stage>().open(folder.path().join("bundle")).unwrap();
    let until = Instant::now() + Duration::from_secs(20);
    while *app.world().resource::<Stage>().status() != StageStatus::Ready {
        assert!(Instant::now() < until, "the hall is not there");
        // nobody draws: what is meant for the GPU is let go
        let feed = app.world().resource::<StageFrame>().feed.clone();
        while feed.as_ref().is_some_and(|feed| feed.next().is_some()) {}
        app.update();
        std::thread::sleep(Duration::from_millis(1));
    }
    let story = StoryPlaces::default();
    let options = PlayOptions { scheme, fps: 30.0, size: (64, 48), films_every: None, input, story };
    let tracker = Player::enter(&mut app, &options)?;
    let player = Player::begin(Stepped::without_gpu(app), None, tracker, &options)?;
    Ok((folder, player))
}

/// Plays lines; nothing is drawn.
fn play(player: &mut Player, text: &str) -> Result<Played, PlayError> {
    let lines = script::parse(text).unwrap();
    let mut take =
        |_: Option<&str>, _: SrgbImage| -> Result<(), PlayError> { Err(std::io::Error::other("a picture of nothing").into()) };
    player.play(&lines, &mut take)
}

/// Where the eyes are, and along what they look.
fn view(player: &mut Player) -> (Vec3, Vec3) {
    let seen = player.stepped.app.world_mut().run_system_once(|poses: Poses| poses.view());
    let (eye, look) = seen.unwrap().unwrap();
    (eye, look * Vec3::NEG_Z)
}

#[test]
fn every_device_walks_looks_and_presses() {
    for scheme in ALL {
        let (_folder, mut player) = player(scheme, &[]).unwrap();
        play(&mut player, "walk 3 -4\n").unwrap_or_else(|error| panic!("{scheme:?}: {error}"));
        let (eye, _) = view(&mut player);
        assert!(Vec2::new(eye.x - 3.0, eye.z + 4.0).length() < 0.4, "{scheme:?} {eye}");
        // behind, and above; a wand's wearer looks up by themselves
        let target = Vec3::new(4.0, eye.y + 2.0, 1.0);
        play(&mut player, &format!("look {} {} {}\n", target.x, target.y, target.z)).unwrap();
        let (eye, look) = view(&mut player);
        let off_rad = look.angle_between(target - eye);
        assert!(off_rad < 0.03, "{scheme:?} is {off_rad} off");
        // once, though it is held
        play(&mut player, "press recentre 0.3\npress look.recentre\n").unwrap();
        let begun = *player.stepped.app.world().resource::<Begun>();
        // who points sets nothing else off
        assert_eq!(begun, Begun { recentred: 2.0, others: 0.0 }, "{scheme:?}");
    }
}

#[test]
fn what_scripts_hear_and_keep_is_expected() {
    for scheme in ALL {
        let (_folder, mut player) = player(scheme, &[]).unwrap();
        let played = play(
            &mut player,
            "walk 5 5\nuntil task none\nwalk hall within 0.6\nuntil task go within 2\nexpect memory been there\nsay \"on\"\nwalk -5 -5\nuntil task none",
        );
        let played = played.unwrap_or_else(|error| panic!("{scheme:?}: {error}"));
        // whoever begins in the hall is told so, too
        let (task, second) = played.tasks.last().unwrap();
        assert!(task == "go" && *second > 2.0 && *second < played.seconds && played.lines == 8, "{scheme:?} {played:?}");
        let frames = player.frame_times();
        assert!(frames.frames > 60 && frames.most_ms >= frames.p95_ms && frames.p95_ms > 0.0, "{frames:?}");
        let costs = player.costs();
        let story = costs.iter().find(|(name, _)| *name == "story").unwrap().1;
        assert!(story.mean_ms > 0.0 && story.most_ms >= story.mean_ms, "{story:?}");
    }
}

#[test]
fn what_does_not_come_about_is_told_with_its_line() {
    let (_folder, mut player) = player(Scheme::Pad, &[]).unwrap();
    for (text, wanted) in [
        ("wait 0.1\n\nexpect held mallet", "line 3, `expect held mallet`"),
        ("until task stop within 0.3", "it is none"),
        ("look \"nobody\"", "no actor, region, view or part `nobody`"),
        ("press jump", "no action `jump`"),
        ("press up", "no action `up`"),
        ("press view.picture", "nothing on this device"),
    ] {
        let told = play(&mut player, text).unwrap_err().to_string();
        assert!(told.contains(wanted), "{text}: {told}");
    }
    assert!(matches!(player.still(), Ok(None)), "nothing can be drawn");
}

#[test]
fn a_visitors_own_keys_are_used() {
    let bind: [(&str, &[&str]); 3] = [("move.forward", &["I"]), ("look.mouse", &["M"]), ("look.recentre", &["Numpad5"])];
    let (_folder, mut player) = player(Scheme::Keyboard, &bind).unwrap();
    play(&mut player, "walk 1 -1\npress recentre").unwrap();
    assert_eq!(player.stepped.app.world().resource::<Begun>().recentred, 1.0);
    // what nothing sets off is told at once
    let (_folder, mut player) = self::player(Scheme::Pad, &[("move.forward", &["W"])]).unwrap();
    let told = play(&mut player, "walk 1 -1").unwrap_err().to_string();
    assert!(told.contains("nothing on this device sets move.forward off"), "{told}");
    let refused = self::player(Scheme::Keyboard, &[("look.mouse", &[])]).err().map(|error| error.to_string());
    assert!(refused.is_some_and(|told| told.contains("bind look.mouse")));
}

#[test]
fn two_visits_are_alike_however_fast_this_machine_is() {
    let visit = |pause: Duration| {
        let (_folder, mut player) = player(Scheme::Hand, &[]).unwrap();
        let mut seen = Vec::new();
        for line in ["walk 2 -2", "look 4 3 1", "wait 0.5"] {
            let played = play(&mut player, line).unwrap();
            std::thread::sleep(pause);
            let (eye, look) = view(&mut player);
            seen.push((eye, look, played.seconds));
        }
        seen
    };
    assert_eq!(visit(Duration::ZERO), visit(Duration::from_millis(300)));
}
