//! A workshop with things on a table before a thin wall, visited with keys, a controller and a wand, without a GPU.

mod fall;

use super::reach::What;
use super::*;
use crate::actors::ActorsPlugin;
use crate::bodies::BodiesPlugin;
use crate::display::Room;
use crate::display::place::WorldFromRoom;
use crate::input::{Actions, WandInput};
use crate::navigation::pose::Pose;
use crate::navigation::{MouseLook, Visitor};
use crate::stage::StagePlugin;
use crate::stage::frame::StageFrame;
use crate::story::{StoryPlaces, StoryPlugin, Wishes};
use crate::time_lapse::TimeLapsePlugin;
use bevy::input::gamepad::{Gamepad, GamepadButton};
use bevy::time::TimeUpdateStrategy;
use heliodon_bundle::display::{Display, Preset};
use heliodon_bundle::site::{Actor, Site as SiteFile, Thing, Walk};
use heliodon_bundle::{ActorFile, ActorMeta, BundleMeta, BundleWriter, LightLayout, LitChunk, VertexLight};
use heliodon_script::action::Action as Wish;
use heliodon_sky::lapse::{Lapse, LapseStep};
use heliodon_track::pose::Pose as TrackedPose;
use std::path::Path;
use std::time::{Duration, Instant};
use tempfile::TempDir;

const SITE: &str = r#"
[site]
name = "Workshop"
[[part]]
file = "floor.obj"
role = "ground"
[[part]]
file = "wall.obj"
[[part]]
file = "table.obj"
[sky]
probes = "*.hdr"
mapping = "lat-long"
[[material]]
name = "gold"
albedo = [0.9, 0.7, 0.3]
[story]
scripts = ["story.rhai"]
texts = "texts.toml"
"#;

const TEXTS: &str = "languages = [\"en\"]\n[texts.told]\nen = \"{what}\"\n";

const SCRIPT: &str = r#"
when_touch("*", |e| subtitle("told", 1, #{ what: `touched ${e.thing} ${e.hand}` }));
when_grab("*", |e| subtitle("told", 1, #{ what: `grabbed ${e.thing} ${e.hand}, holds ${held(e.hand)}` }));
when_release("*", |e| subtitle("told", 1, #{ what: `released ${e.thing} ${e.hand}, holds ${held(e.hand)}` }));
when_struck("*", "*", |e| subtitle("told", 1, #{ what: `struck ${e.target} with ${e.tool} at ${e.speed}` }));
when_applied("*", "*", |e| subtitle("told", 1, #{ what: `${e.material} on ${e.target} by ${e.tool}` }));
when_hit("leaf", |e| subtitle("told", 1, #{ what: `${e.thing} hit ${e.on}` }));
when_look("*", 0, |e| subtitle("told", 1, #{ what: `saw ${e.thing}` }));
"#;

/// A frame.
const FRAME_S: f32 = 0.02;
const EYE: Vec3 = Vec3::new(0.0, 1.6, 0.0);
/// Things on the table, and what stands behind it.
const MALLET: Vec3 = Vec3::new(0.0, 1.0, -1.2);
const BRUSH: Vec3 = Vec3::new(0.8, 1.0, -1.2);
const LEAF: Vec3 = Vec3::new(-0.6, 1.0, -1.2);
const URN: Vec3 = Vec3::new(1.8, 1.0, -1.2);
const JUG: Vec3 = Vec3::new(-1.2, 1.0, -1.2);
const WALL_Z: f32 = -2.0;

fn things() -> Vec<(Actor, String)> {
    let mallet = cuboids(&[
        (Vec3::new(-0.05, 0.0, -0.01), Vec3::new(0.25, 0.03, 0.01)),
        (Vec3::new(0.2, 0.0, -0.08), Vec3::new(0.28, 0.08, 0.08)),
        (Vec3::new(0.22, 0.0, -0.08), Vec3::new(0.26, 0.08, 0.08)),
    ]);
    let cube = || cuboids(&[(Vec3::new(-0.06, 0.0, -0.06), Vec3::new(0.06, 0.14, 0.06))]);
    let thing = |name: &str, place: Vec3, thing: Thing| Actor {
        name: Some(name.to_owned()),
        thing: Some(thing),
        ..Actor::at(format!("{name}.obj"), place.as_dvec3().to_array())
    };
    let carried = || Thing { carried: true, ..Thing::default() };
    let gold = || Some("gold".to_owned());
    let walker = Actor {
        place: None,
        path: Some(vec![[-3.0, 0.0, 3.0], [3.0, 0.0, 3.0]]),
        walk: Walk::BackAndForth,
        ..thing("walker", Vec3::ZERO, carried())
    };
    vec![
        (thing("mallet", MALLET, Thing { tool: true, ..carried() }), mallet),
        (thing("brush", BRUSH, Thing { tool: true, brings: gold(), ..carried() }), cube()),
        (thing("leaf", LEAF, Thing { brings: gold(), ..carried() }), cube()),
        (thing("urn", URN, Thing::default()), cube()),
        (thing("jug", JUG, Thing { hidden: true, ..carried() }), cube()),
        (walker, cube()),
    ]
}

/// An OBJ of boxes.
fn cuboids(boxes: &[(Vec3, Vec3)]) -> String {
    let mut text = String::new();
    for (number, (low, high)) in boxes.iter().enumerate() {
        for i in 0..8 {
            let pick = |bit: usize| if i >> bit & 1 == 0 { low[bit] } else { high[bit] };
            text += &format!("v {} {} {}\n", pick(0), pick(1), pick(2));
        }
        for quad in [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]] {
            let [a, b, c, d] = quad.map(|v| v + 8 * number);
            text += &format!("f {a} {b} {c} {d}\n");
        }
    }
    text
}

struct Visit {
    _folder: TempDir,
    app: App,
}

impl Visit {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("story.rhai"), SCRIPT).unwrap();
        std::fs::write(folder.path().join("texts.toml"), TEXTS).unwrap();
        write_bundle(folder.path());
        let mut app = crate::input::tests::app();
        app.add_plugins((StagePlugin, TimeLapsePlugin, ActorsPlugin, StoryPlugin, HandsPlugin, BodiesPlugin))
            .init_resource::<StageFrame>()
            .init_resource::<Impostors>()
            .init_resource::<MouseLook>()
            .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f32(FRAME_S)))
            .insert_resource(StoryPlaces::default());
        app.world_mut().spawn(Visitor { pose: Pose::looking(EYE, Vec3::new(0.0, 1.6, -9.0)), ..Visitor::default() });
        app.world_mut().resource_mut::<Stage>().open(folder.path().join("bundle")).unwrap();
        let mut visit = Self { _folder: folder, app };
        let until = Instant::now() + Duration::from_secs(20);
        let ready = |visit: &Self| {
            let world = visit.app.world();
            let actors = world.resource::<Actors>();
            *world.resource::<Stage>().status() == crate::StageStatus::Ready && actors.solid("mallet").is_some()
        };
        while !ready(&visit) {
            assert!(Instant::now() < until, "the workshop is not there");
            visit.frames(1);
            std::thread::sleep(Duration::from_millis(1));
        }
        visit.frames(2);
        visit.told();
        visit
    }

    fn frames(&mut self, count: usize) {
        for _ in 0..count {
            // nobody draws: what is meant for the GPU is let go
            let feed = self.app.world().resource::<StageFrame>().feed.clone();
            while feed.as_ref().is_some_and(|feed| feed.next().is_some()) {}
            self.app.update();
        }
    }

    fn pass(&mut self, seconds: f32) {
        self.frames((seconds / FRAME_S).round() as usize);
    }

    /// What scripts heard since this was asked last, looks aside.
    fn told(&mut self) -> Vec<String> {
        self.frames(2);
        let asked = self.app.world_mut().resource_mut::<Story>().take_asked();
        let said = asked.into_iter().filter_map(|action| match action {
            Wish::Subtitle { values, .. } => values.get("what").cloned(),
            _ => None,
        });
        said.filter(|told| !told.starts_with("saw ")).collect()
    }

    fn saw(&mut self) -> Vec<String> {
        self.pass(0.6);
        let asked = self.app.world_mut().resource_mut::<Story>().take_asked();
        let said = asked.into_iter().filter_map(|action| match action {
            Wish::Subtitle { values, .. } => values.get("what").cloned(),
            _ => None,
        });
        said.filter_map(|told| told.strip_prefix("saw ").map(str::to_owned)).collect()
    }

    fn visitor(&mut self) -> Mut<'_, Visitor> {
        let world = self.app.world_mut();
        world.query::<&mut Visitor>().single_mut(world).unwrap()
    }

    fn look_at(&mut self, target: Vec3) {
        self.visitor().pose = Pose::looking(EYE, target);
        self.frames(2);
    }

    fn press(&mut self, key: KeyCode) {
        self.app.world_mut().resource_mut::<ButtonInput<KeyCode>>().press(key);
        self.frames(1);
        let mut keys = self.app.world_mut().resource_mut::<ButtonInput<KeyCode>>();
        keys.reset_all();
        self.frames(1);
    }

    fn hands(&self) -> &Hands {
        self.app.world().resource()
    }

    fn held(&self) -> [Option<&str>; 2] {
        BOTH.map(|hand| self.hands().held(hand))
    }

    fn place(&self, name: &str) -> Affine3A {
        let actors = self.app.world().resource::<Actors>();
        actors
            .directions
            .get(name)
            .and_then(|direction| direction.world_from_model)
            .unwrap_or_else(|| actors.undirected(name).unwrap())
    }

    fn wish(&mut self, wish: Wish) {
        self.app.world_mut().resource_mut::<Wishes>().hands.push(wish);
        self.frames(1);
    }

    /// Takes what is on the table by E.
    fn take(&mut self, name: &str, at: Vec3) {
        self.look_at(at);
        assert_eq!(self.hands().met(Hand::Right).map(|met| met.name.as_str()), Some(name));
        self.press(KeyCode::KeyE);
        assert_eq!(self.held()[0], Some(name));
    }

    /// Enters a room with screens, with a wand.
    fn enter_room(&mut self) {
        let display: Display = Display::preset(Preset::Flatworld);
        self.app.insert_resource(Room::new(display.into()).unwrap());
        self.app.insert_resource(WandInput { present: true, ..WandInput::default() });
    }

    /// Moves a tracked hand to a place of the world, and lets a frame pass.
    fn hand(&mut self, hand: Hand, place: Vec3, orientation: Quat) {
        let visitor = self.visitor().clone();
        let mut room = self.app.world_mut().resource_mut::<Room>();
        let from_world = WorldFromRoom::new(room.display(), &visitor);
        let pose =
            TrackedPose { position: from_world.to_room(place), orientation: from_world.rotation.inverse() * orientation };
        let slot = if hand == Hand::Right { &mut room.wand } else { &mut room.left_hand };
        *slot = Some(pose);
        self.frames(1);
    }

    /// Moves the right hand along a way at a speed, without turning it.
    fn sweep(&mut self, from: Vec3, to: Vec3, speed: f32) {
        let count = (from.distance(to) / (speed * FRAME_S)).ceil().max(1.0) as usize;
        for i in 0..=count {
            self.hand(Hand::Right, from.lerp(to, i as f32 / count as f32), Quat::IDENTITY);
        }
    }

    fn buttons(&mut self, buttons: u32) {
        self.app.world_mut().resource_mut::<WandInput>().buttons = buttons;
        self.frames(1);
    }

    fn click(&mut self, button: u32) {
        self.buttons(button);
        self.buttons(0);
    }
}

fn write_bundle(folder: &Path) {
    let site = SiteFile::parse(SITE, folder.join("site.toml")).unwrap();
    let layout = LightLayout { sun_steps: 1, coefficients: 4, channels: 1, sun_bounce_functions: 0 };
    let mut writer = BundleWriter::create(folder.join("bundle"), BundleMeta::from_site(site.file(), layout, 1e-4)).unwrap();
    let table = MALLET.y;
    let quads = [
        [[-9.0, 0.0, 9.0], [9.0, 0.0, 9.0], [9.0, 0.0, -9.0], [-9.0, 0.0, -9.0]],
        [[-3.0, 0.0, WALL_Z], [3.0, 0.0, WALL_Z], [3.0, 3.0, WALL_Z], [-3.0, 3.0, WALL_Z]],
        [[-2.0, table, -0.9], [2.0, table, -0.9], [2.0, table, -1.5], [-2.0, table, -1.5]],
    ];
    for (part, quad) in (0..).zip(quads) {
        let normal = if part == 1 { Vec3::Z } else { Vec3::Y };
        writer
            .push_chunk(&LitChunk {
                part,
                texture: None,
                detail: None,
                positions: quad.map(Vec3::from).to_vec(),
                normals: vec![normal; 4],
                uvs: Vec::new(),
                texel_uvs: Vec::new(),
                albedo: vec![Vec3::splat(0.5); 4],
                triangles: vec![[0, 1, 2], [0, 2, 3]],
                valid: vec![1; 4],
                light: VertexLight::zeros(layout, 4),
            })
            .unwrap();
    }
    let map = heliodon_image::HdrImage::from_fn(4, 2, |_, _| Vec3::ONE);
    writer.add_sky_map("sky/0.hdr", &map.to_hdr_bytes()).unwrap();
    writer.add_living(folder).unwrap();
    for (actor, text) in things() {
        let source = folder.join(&actor.file);
        std::fs::write(&source, text).unwrap();
        let files = vec![ActorFile { source, name: actor.file.clone() }];
        writer.add_actor(&ActorMeta { actor, files }).unwrap();
    }
    let step = |time: &str| LapseStep {
        time: time.to_owned(),
        sun: None,
        sky: vec![[1.0; 3]; 4],
        fitted: None,
        exposure_stops: 0.0,
        sky_map: "sky/0.hdr".to_owned(),
        mask_bit: 0,
        sun_in_map: false,
    };
    writer.finish(&Lapse { steps: vec![step("08:00"), step("16:00")], sun_bounce_basis: None }).unwrap();
}

#[test]
fn a_thing_is_taken_carried_and_put_down() {
    let mut visit = Visit::new();
    visit.take("mallet", MALLET + Vec3::new(0.1, 0.02, 0.0));
    assert_eq!(visit.told(), ["grabbed mallet right, holds mallet"]);
    visit.pass(0.4);
    let in_view = |visit: &mut Visit| {
        let pose = visit.visitor().pose;
        pose.rotation().inverse() * (Vec3::from(visit.place("mallet").translation) - pose.eye)
    };
    let at = in_view(&mut visit);
    assert!(at.x > 0.0 && at.y < 0.0 && at.z < -0.2, "at the lower right: {at}");
    // it goes along, and is put on the table
    visit.look_at(Vec3::new(-9.0, 1.6, 3.0));
    assert!(in_view(&mut visit).abs_diff_eq(at, 1e-3), "{}", in_view(&mut visit));
    visit.look_at(Vec3::new(-0.9, 1.0, -1.2));
    let mut let_go = Vec::new();
    visit.app.world_mut().resource_mut::<ButtonInput<KeyCode>>().press(KeyCode::KeyE);
    visit.frames(1);
    let_go.extend(visit.hands().let_go.clone());
    visit.app.world_mut().resource_mut::<ButtonInput<KeyCode>>().reset_all();
    assert_eq!(visit.held(), [None, None]);
    assert_eq!(let_go.len(), 1);
    assert!(let_go[0].name == "mallet" && let_go[0].velocity_m_s == Vec3::ZERO);
    let stands = let_go[0].world_from_model;
    assert!(stands.transform_vector3(Vec3::Y).abs_diff_eq(Vec3::Y, 1e-5), "upright");
    assert!((stands.translation.y - 1.0).abs() < 0.02 && (stands.translation.x + 0.9).abs() < 0.3, "{stands:?}");
    assert_eq!(visit.told(), ["released mallet right, holds "]);
    assert!(visit.hands().let_go.is_empty(), "for one frame");
}

#[test]
fn another_thing_lets_go_of_the_first_and_hidden_ones_are_not_met() {
    let mut visit = Visit::new();
    visit.take("mallet", MALLET + Vec3::new(0.1, 0.02, 0.0));
    visit.take("brush", BRUSH + Vec3::Y * 0.07);
    let told = visit.told();
    assert_eq!(
        told,
        ["grabbed mallet right, holds mallet", "released mallet right, holds brush", "grabbed brush right, holds brush"]
    );
    visit.look_at(JUG + Vec3::Y * 0.07);
    assert_eq!(visit.hands().met(Hand::Right).map(|met| (met.name.as_str(), met.what)), Some(("table", What::Part)));
    // what is not carried is touched
    visit.press(KeyCode::KeyE);
    visit.look_at(URN + Vec3::Y * 0.07);
    visit.press(KeyCode::KeyE);
    visit.press(KeyCode::KeyV);
    let told = visit.told();
    assert_eq!(told, ["released brush right, holds ", "touched urn right", "touched urn right"]);
}

#[test]
fn a_blow_lands_on_what_is_before_it() {
    let mut visit = Visit::new();
    visit.app.world_mut().spawn(Gamepad::default());
    visit.take("mallet", MALLET + Vec3::new(0.1, 0.02, 0.0));
    visit.pass(0.4);
    visit.look_at(Vec3::new(0.0, 1.6, WALL_Z));
    visit.told();
    let rests = visit.place("mallet").translation;
    let press = |visit: &mut Visit, down: bool| {
        let world = visit.app.world_mut();
        let mut pad = world.query::<&mut Gamepad>().single_mut(world).unwrap();
        if down {
            pad.digital_mut().press(GamepadButton::RightTrigger)
        } else {
            pad.digital_mut().release_all()
        };
        visit.frames(1);
    };
    press(&mut visit, true);
    press(&mut visit, false);
    visit.pass(0.06);
    assert_eq!(visit.told(), [""; 0], "not before it lands");
    let mut farthest = 0.0_f32;
    for _ in 0..8 {
        visit.frames(1);
        farthest = farthest.max(rests.z - visit.place("mallet").translation.z);
    }
    assert!(farthest > 0.1, "it goes forward: {farthest}");
    assert_eq!(visit.told(), ["struck wall with mallet at 3.0"]);
    visit.pass(0.4);
    assert!(visit.place("mallet").translation.abs_diff_eq(rests, 1e-4), "and back");
    // into the air
    visit.look_at(Vec3::new(0.0, 1.6, 9.0));
    press(&mut visit, true);
    press(&mut visit, false);
    visit.pass(0.5);
    assert_eq!(visit.told(), [""; 0]);
}

#[test]
fn materials_are_brought_by_tools_and_by_hand() {
    let mut visit = Visit::new();
    visit.take("brush", BRUSH + Vec3::Y * 0.07);
    visit.look_at(URN + Vec3::Y * 0.07);
    visit.told();
    visit.press(KeyCode::KeyQ);
    visit.pass(0.5);
    assert_eq!(visit.told(), ["struck urn with brush at 3.0", "gold on urn by brush"]);
    visit.take("leaf", LEAF + Vec3::Y * 0.07);
    visit.look_at(Vec3::new(-1.5, 1.0, -1.2));
    visit.told();
    // a click while the mouse looks around uses, too
    visit.app.world_mut().resource_mut::<MouseLook>().captured = true;
    visit.app.world_mut().resource_mut::<ButtonInput<MouseButton>>().press(MouseButton::Left);
    visit.frames(1);
    visit.app.world_mut().resource_mut::<ButtonInput<MouseButton>>().reset_all();
    visit.pass(0.5);
    assert_eq!(visit.told(), ["gold on table by hand"]);
}

#[test]
fn whoever_walks_can_be_taken() {
    let mut visit = Visit::new();
    visit.visitor().pose = Pose::looking(Vec3::new(0.0, 0.7, 3.8), Vec3::new(0.0, 0.07, 3.0));
    let until = 400;
    let meets = |visit: &Visit| visit.hands().met(Hand::Right).is_some_and(|met| met.name == "walker");
    for frame in 0.. {
        visit.frames(1);
        if meets(&visit) {
            break;
        }
        assert!(frame < until, "it walks by");
    }
    visit.press(KeyCode::KeyE);
    assert_eq!(visit.held()[0], Some("walker"));
    visit.pass(0.4);
    let stays = visit.place("walker");
    visit.pass(0.5);
    assert_eq!(visit.place("walker"), stays, "it walks no more");
    visit.visitor().pose = Pose::looking(Vec3::new(0.0, 0.7, 6.0), Vec3::new(0.0, 0.7, 9.0));
    visit.frames(2);
    assert!(visit.place("walker").translation.z > 6.0, "it is carried");
}

#[test]
fn a_tool_that_is_swung_strikes_once_and_does_not_tunnel() {
    let mut visit = Visit::new();
    visit.enter_room();
    let grip = MALLET + Vec3::new(0.0, 0.05, 0.0);
    visit.hand(Hand::Right, grip, Quat::IDENTITY);
    visit.hand(Hand::Right, grip, Quat::IDENTITY);
    assert!(visit.hands().met(Hand::Right).is_some_and(|met| met.touched && met.name == "mallet"));
    assert_eq!(visit.told(), ["touched mallet right"]);
    // the wand's second button takes while there is something to take
    visit.click(0b10);
    assert_eq!(visit.held()[0], Some("mallet"));
    let before = visit.place("mallet");
    assert!(Vec3::from(before.translation).distance(MALLET) < 1e-4, "it stays as it lies in the hand");
    visit.pass(0.3);
    visit.told();
    // up from the table, then fast through the wall: 0.16 m a frame
    visit.sweep(grip, grip + Vec3::Y * 0.5, 0.5);
    let from = Vec3::new(0.0, 1.6, -1.5);
    visit.sweep(grip + Vec3::Y * 0.5, from, 0.5);
    assert_eq!(visit.told(), [""; 0], "slowly");
    visit.sweep(from, from - Vec3::Z * 1.6, 8.0);
    let told = visit.told();
    assert_eq!(told.len(), 1, "{told:?}");
    let speed: f32 = told[0].strip_prefix("struck wall with mallet at ").unwrap().parse().unwrap();
    assert!((speed - 8.0).abs() < 0.3, "{speed}");
    // whoever is carried through it strikes nothing
    visit.pass(0.5);
    let back = visit.visitor().pose;
    visit.visitor().pose.eye += Vec3::Z * 3.0;
    visit.frames(2);
    visit.visitor().pose = back;
    visit.frames(2);
    assert_eq!(visit.told(), [""; 0]);
    // thrown, it flies on
    visit.sweep(from, from + Vec3::X * 1.0, 2.0);
    visit.app.world_mut().resource_mut::<WandInput>().buttons = 0b1_0000;
    visit.hand(Hand::Right, from + Vec3::X * 1.04, Quat::IDENTITY);
    let thrown = visit.hands().let_go.first().cloned().unwrap();
    assert!(thrown.velocity_m_s.abs_diff_eq(Vec3::X * 2.0, 0.3), "{}", thrown.velocity_m_s);
}

#[test]
fn what_is_held_on_something_for_a_while_covers_it() {
    let mut visit = Visit::new();
    visit.enter_room();
    visit.wish(Wish::Give { thing: "leaf".to_owned(), hand: Hand::Right });
    let before = Vec3::new(0.0, 1.6, WALL_Z + 0.4);
    let on = Vec3::new(0.0, 1.6, WALL_Z + 0.08);
    visit.hand(Hand::Right, before, Quat::IDENTITY);
    visit.pass(0.4);
    visit.sweep(before, on, 0.4);
    visit.pass(0.1);
    assert_eq!(visit.told(), [""; 0], "not yet");
    visit.pass(0.3);
    assert_eq!(visit.told(), ["gold on wall by hand"]);
    visit.pass(0.6);
    assert_eq!(visit.told(), [""; 0], "once");
    visit.sweep(on, before, 0.4);
    visit.sweep(before, on, 0.4);
    visit.pass(0.4);
    assert_eq!(visit.told(), ["gold on wall by hand"]);
}

#[test]
fn a_bare_hand_touches_once_and_each_hand_holds_its_own() {
    let mut visit = Visit::new();
    visit.enter_room();
    let before = Vec3::new(1.0, 1.8, WALL_Z + 0.3);
    visit.sweep(before, Vec3::new(1.0, 1.8, WALL_Z + 0.05), 0.5);
    visit.pass(0.3);
    assert_eq!(visit.told(), ["touched wall right"]);
    visit.sweep(Vec3::new(1.0, 1.8, WALL_Z + 0.05), before, 0.5);
    visit.sweep(before, Vec3::new(1.0, 1.8, WALL_Z - 0.5), 9.0);
    assert_eq!(visit.told(), ["touched wall right"], "in a frame through it");
    visit.hand(Hand::Left, LEAF + Vec3::Y * 0.07, Quat::IDENTITY);
    visit.hand(Hand::Left, LEAF + Vec3::Y * 0.07, Quat::IDENTITY);
    visit.click(0b10_0000);
    assert_eq!(visit.held(), [None, Some("leaf")]);
    // from afar, by pointing: the first button of a wand that points at it touches, the fifth takes
    let aim = Quat::from_rotation_arc(Vec3::NEG_Z, Vec3::new(0.0, -0.6, -0.8));
    let from = MALLET + Vec3::new(0.24, 0.04, 0.0) + Vec3::new(0.0, 0.6, 0.8) * 0.8;
    visit.hand(Hand::Right, from, aim);
    visit.hand(Hand::Right, from, aim);
    visit.told();
    visit.click(0b1);
    visit.click(0b1_0000);
    let told = visit.told();
    assert_eq!(told, ["touched mallet right", "grabbed mallet right, holds mallet"]);
    assert_eq!(visit.held(), [Some("mallet"), Some("leaf")]);
    visit.pass(0.4);
    let head = visit.place("mallet").transform_point3(Vec3::new(0.24, 0.04, 0.0)) - from;
    assert!(head.dot(aim * Vec3::NEG_Z) > 0.1, "its head is ahead: {head}");
    assert!(!visit.app.world().resource::<Actions>().begins(crate::input::Action::Play));
}

#[test]
fn eyes_rest_on_parts_and_do_not_see_through_them() {
    let mut visit = Visit::new();
    visit.saw();
    visit.look_at(Vec3::new(0.0, 2.5, WALL_Z));
    visit.saw();
    visit.look_at(URN + Vec3::Y * 0.07);
    assert_eq!(visit.saw(), ["urn"]);
    visit.look_at(Vec3::new(0.5, 1.0, -1.0));
    assert_eq!(visit.saw(), ["table"]);
    // from behind the wall
    visit.visitor().pose = Pose::looking(Vec3::new(1.8, 1.6, -4.0), URN + Vec3::Y * 0.07);
    assert_eq!(visit.saw(), ["wall"]);
}

#[test]
fn the_ring_tells_what_can_be_done() {
    let mut visit = Visit::new();
    let label = |visit: &mut Visit| {
        let world = visit.app.world_mut();
        let (text, seen) = world.query_filtered::<(&Text, &Visibility), With<reticle::Label>>().single(world).unwrap();
        (*seen == Visibility::Inherited).then(|| text.0.clone())
    };
    visit.look_at(MALLET + Vec3::new(0.1, 0.02, 0.0));
    assert_eq!(label(&mut visit).as_deref(), Some("mallet: E takes it, V touches it"));
    visit.press(KeyCode::KeyE);
    visit.look_at(URN + Vec3::Y * 0.07);
    assert_eq!(label(&mut visit).as_deref(), Some("urn: Q strikes it with the mallet"));
    visit.look_at(Vec3::new(0.0, 9.0, 9.0));
    assert_eq!(label(&mut visit), None);
}
