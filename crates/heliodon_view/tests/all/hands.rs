//! What a visitor sees of what is in the hand, on the GPU (a software one will do): a whole visit without a window.

#![expect(clippy::unwrap_used, reason = "a test ends where something fails")]

use bevy::app::PluginGroup;
use bevy::camera::RenderTarget;
use bevy::image::Image;
use bevy::log::LogPlugin;
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::render_resource::{TextureFormat, TextureUsages};
use bevy::render::settings::{Backends, WgpuSettings};
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured};
use bevy::time::TimeUpdateStrategy;
use bevy::ui::IsDefaultUiCamera;
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use heliodon_bundle::site::{Actor, Albedo, Site, Thing};
use heliodon_bundle::{ActorFile, ActorMeta, BundleMeta, BundleWriter, LightLayout, LitChunk, VertexLight};
use heliodon_image::SrgbImage;
use heliodon_math::sh::open_transfer9;
use heliodon_sky::lapse::{Lapse, LapseStep, Sun};
use heliodon_view::actors::Actors;
use heliodon_view::hands::{Hand, Hands};
use heliodon_view::hud::HudVisibility;
use heliodon_view::navigation::Visitor;
use heliodon_view::{DaylightCamera, HeliodonPlugins, Pose, Stage, StageStatus, TimeLapse, VisitPlugins};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tempfile::TempDir;

const SIZE: UVec2 = UVec2::new(800, 500);
const EYE: Vec3 = Vec3::new(0.0, 1.65, 0.4);
const TABLE_Y: f32 = 0.9;
const MALLET: Vec3 = Vec3::new(0.25, TABLE_Y, -1.1);
const JUG: Vec3 = Vec3::new(-0.35, TABLE_Y, -1.1);
const WALL_Z: f32 = -1.8;

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
[story]
scripts = ["story.rhai"]
"#;

fn sun() -> Vec3 {
    Vec3::new(0.5, 0.7, 0.6).normalize_or(Vec3::Y)
}

/// A sheet of 20 by 20 quads between a corner and the two beside it.
fn sheet(part: u16, corner: Vec3, across: Vec3, up: Vec3, albedo: Vec3) -> LitChunk {
    const N: u32 = 20;
    let normal = across.cross(up).normalize_or(Vec3::Y);
    let layout = layout();
    let at = |i: u32, j: u32| corner + across * (i as f32 / N as f32) + up * (j as f32 / N as f32);
    let positions: Vec<Vec3> = (0..=N).flat_map(|j| (0..=N).map(move |i| at(i, j))).collect();
    let mut light = VertexLight::zeros(layout, positions.len());
    light.sun_mask.fill(u32::from(normal.dot(sun()) > 0.0));
    let open = open_transfer9(normal);
    light.sky_transfer.chunks_exact_mut(layout.transfer_floats()).for_each(|floats| floats.copy_from_slice(&open[..4]));
    let quads = (0..N).flat_map(|j| (0..N).map(move |i| j * (N + 1) + i));
    LitChunk {
        part,
        texture: None,
        detail: None,
        normals: vec![normal; positions.len()],
        uvs: Vec::new(),
        texel_uvs: Vec::new(),
        albedo: vec![albedo; positions.len()],
        triangles: quads.flat_map(|a| [[a, a + 1, a + N + 1], [a + 1, a + N + 2, a + N + 1]]).collect(),
        valid: vec![1; positions.len()],
        light,
        positions,
    }
}

fn layout() -> LightLayout {
    LightLayout { sun_steps: 1, coefficients: 4, channels: 1, sun_bounce_functions: 0 }
}

/// An OBJ of something turned about an axis: its profile as radii and heights.
fn lathe(profile: &[(f32, f32)], place: impl Fn(Vec3) -> Vec3, first: usize) -> String {
    const N: usize = 24;
    let mut text = String::new();
    for &(radius, height) in profile {
        for i in 0..N {
            let (sin, cos) = (i as f32 / N as f32 * std::f32::consts::TAU).sin_cos();
            let p = place(Vec3::new(radius * cos, height, -radius * sin));
            text += &format!("v {} {} {}\n", p.x, p.y, p.z);
        }
    }
    for ring in 0..profile.len() - 1 {
        for i in 0..N {
            let (a, b) = (first + ring * N + i, first + ring * N + (i + 1) % N);
            text += &format!("f {a} {b} {} {}\n", b + N, a + N);
        }
    }
    text
}

fn write_bundle(folder: &Path) {
    std::fs::write(folder.join("story.rhai"), "when_struck(\"wall\", \"mallet\", || no_task());").unwrap();
    let site = Site::parse(SITE, folder.join("site.toml")).unwrap();
    let mut writer = BundleWriter::create(folder.join("bundle"), BundleMeta::from_site(site.file(), layout(), 1e-4)).unwrap();
    let [stone, wood] = [Vec3::new(0.62, 0.56, 0.46), Vec3::new(0.35, 0.22, 0.12)];
    writer.push_chunk(&sheet(0, Vec3::new(-6.0, 0.0, 6.0), Vec3::X * 12.0, Vec3::NEG_Z * 12.0, stone * 0.6)).unwrap();
    writer.push_chunk(&sheet(1, Vec3::new(-3.0, 0.0, WALL_Z), Vec3::X * 6.0, Vec3::Y * 3.0, stone)).unwrap();
    writer.push_chunk(&sheet(2, Vec3::new(-1.0, TABLE_Y, -0.8), Vec3::X * 2.0, Vec3::NEG_Z * 0.7, wood)).unwrap();
    // lying along x, its head to the right
    let lying = |p: Vec3| Vec3::new(p.y, 0.045 - p.x, p.z);
    let mut mallet = lathe(&[(0.0, -0.02), (0.014, -0.02), (0.012, 0.2), (0.016, 0.24)], lying, 1);
    let head = [(0.0, -0.08), (0.04, -0.08), (0.045, 0.0), (0.04, 0.08), (0.0, 0.08)];
    mallet += &lathe(&head, |p| Vec3::new(p.x + 0.24, 0.045 - p.z, p.y), 4 * 24 + 1);
    let jug = [(0.0, 0.0), (0.05, 0.0), (0.085, 0.07), (0.08, 0.14), (0.04, 0.2), (0.05, 0.24), (0.0, 0.235)];
    let things = [
        ("mallet", MALLET, Thing { carried: true, tool: true, ..Thing::default() }, mallet, [0.45, 0.3, 0.16]),
        ("jug", JUG, Thing { carried: true, ..Thing::default() }, lathe(&jug, |p| p, 1), [0.55, 0.22, 0.1]),
    ];
    for (name, place, thing, text, albedo) in things {
        let source = folder.join(format!("{name}.obj"));
        std::fs::write(&source, text).unwrap();
        let files = vec![ActorFile { source, name: format!("{name}.obj") }];
        let place = place.as_dvec3().to_array();
        let actor = Actor { thing: Some(thing), albedo: Some(Albedo::Rgb(albedo)), ..Actor::at(format!("{name}.obj"), place) };
        writer.add_actor(&ActorMeta { actor, files }).unwrap();
    }
    let map = heliodon_image::HdrImage::from_fn(8, 4, |_, _| Vec3::new(0.3, 0.4, 0.6));
    writer.add_sky_map("sky/0.hdr", &map.to_hdr_bytes()).unwrap();
    writer.add_living(folder).unwrap();
    let step = |time: &str| LapseStep {
        time: time.to_owned(),
        sun: Some(Sun { direction: sun().to_array(), irradiance: [2.4, 2.2, 1.9], clipped: false }),
        // a sky that is one colour everywhere
        sky: vec![[1.06, 1.42, 2.13], [0.0; 3], [0.0; 3], [0.0; 3]],
        fitted: None,
        exposure_stops: 0.0,
        sky_map: "sky/0.hdr".to_owned(),
        mask_bit: 0,
        sun_in_map: false,
    };
    writer.finish(&Lapse { steps: vec![step("08:00"), step("16:00")], sun_bounce_basis: None }).unwrap();
}

struct Visit {
    _folder: TempDir,
    app: App,
    target: Handle<Image>,
}

impl Visit {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        write_bundle(folder.path());
        let backends = Some(Backends::from_env().unwrap_or(Backends::PRIMARY));
        let graphics = RenderPlugin {
            render_creation: WgpuSettings { backends, ..default() }.into(),
            synchronous_pipeline_compilation: true,
            ..default()
        };
        let mut app = App::new();
        app.add_plugins(
            DefaultPlugins
                .set(WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() })
                .set(graphics)
                .disable::<PipelinedRenderingPlugin>()
                .disable::<WinitPlugin>()
                .disable::<LogPlugin>(),
        )
        .add_plugins((HeliodonPlugins, VisitPlugins))
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)));
        let mut image = Image::new_target_texture(SIZE.x, SIZE.y, TextureFormat::Rgba8UnormSrgb, None);
        image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
        let target = app.world_mut().resource_mut::<Assets<Image>>().add(image);
        app.world_mut().spawn((Visitor::default(), DaylightCamera, IsDefaultUiCamera, RenderTarget::from(target.clone())));
        app.finish();
        app.cleanup();
        app.world_mut().resource_mut::<Stage>().open(folder.path().join("bundle")).unwrap();
        let mut visit = Self { _folder: folder, app, target };
        let until = Instant::now() + Duration::from_secs(60);
        let ready = |visit: &Self| {
            let world = visit.app.world();
            let stage = world.resource::<Stage>();
            let loaded = stage.is_complete() && world.resource::<Actors>().solid("mallet").is_some();
            assert!(!matches!(stage.status(), StageStatus::Failed(_)), "{:?}", stage.status());
            loaded
        };
        while !ready(&visit) {
            assert!(Instant::now() < until, "the workshop is not there");
            visit.frames(1);
        }
        visit.app.world_mut().resource_mut::<TimeLapse>().playing = false;
        visit
    }

    /// Leaves out text and ring, so that pictures differ by what is in the hand alone.
    fn without_text(&mut self) {
        self.app.world_mut().resource_mut::<HudVisibility>().shown = false;
        self.frames(1);
    }

    fn frames(&mut self, count: usize) {
        (0..count).for_each(|_| self.app.update());
    }

    fn look(&mut self, eye: Vec3, target: Vec3) {
        let world = self.app.world_mut();
        world.query::<&mut Visitor>().single_mut(world).unwrap().pose = Pose::looking(eye, target);
        self.frames(2);
    }

    fn press(&mut self, key: KeyCode) {
        self.app.world_mut().resource_mut::<ButtonInput<KeyCode>>().press(key);
        self.frames(1);
        self.app.world_mut().resource_mut::<ButtonInput<KeyCode>>().release(key);
    }

    fn held(&self) -> Option<&str> {
        self.app.world().resource::<Hands>().held(Hand::Right)
    }

    /// What the visitor sees; with `HELIODON_PICTURES` it is written there, for people to look at.
    fn picture(&mut self, name: &str) -> SrgbImage {
        let taken: Arc<Mutex<Option<SrgbImage>>> = Arc::default();
        let slot = Arc::clone(&taken);
        let shot = self.app.world_mut().spawn(Screenshot::image(self.target.clone())).id();
        self.app.world_mut().entity_mut(shot).observe(move |captured: On<ScreenshotCaptured>| {
            let bytes = captured.image.data.as_deref().unwrap_or_default();
            let pixels = bytes.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect();
            *slot.lock().unwrap() = Some(SrgbImage { width: SIZE.x, height: SIZE.y, pixels });
        });
        let until = Instant::now() + Duration::from_secs(30);
        loop {
            self.frames(1);
            if let Some(picture) = taken.lock().unwrap().take() {
                if let Some(folder) = std::env::var_os("HELIODON_PICTURES") {
                    picture.write_png(Path::new(&folder).join(format!("{name}.png"))).unwrap();
                }
                return picture;
            }
            assert!(Instant::now() < until, "no picture came");
        }
    }
}

/// Which pixels of two pictures differ.
fn changed(a: &SrgbImage, b: &SrgbImage) -> Vec<bool> {
    let differ = |(a, b): (&[u8; 4], &[u8; 4])| (0..3).any(|k| a[k].abs_diff(b[k]) > 12);
    a.pixels.iter().zip(&b.pixels).map(differ).collect()
}

/// The middle of what has changed, as parts of width and height, and how many of a thousand pixels it is.
fn told(changed: &[bool]) -> (Vec2, f32) {
    let places = changed.iter().enumerate().filter(|(_, changed)| **changed);
    let places = places.map(|(i, _)| UVec2::new(i as u32 % SIZE.x, i as u32 / SIZE.x).as_vec2() / SIZE.as_vec2());
    let (sum, count) = places.fold((Vec2::ZERO, 0.0), |(sum, count), place| (sum + place, count + 1.0));
    (sum / f32::max(count, 1.0), 1e3 * count / changed.len() as f32)
}

#[test]
fn what_is_in_the_hand_is_seen_at_the_lower_side_of_the_view_and_in_no_wall() {
    let mut visit = Visit::new();
    visit.look(EYE, MALLET + Vec3::new(0.24, 0.05, 0.0));
    visit.picture("before-taking");
    visit.without_text();
    let away = Vec3::new(0.3, 1.5, -9.0);
    visit.look(EYE, away);
    let empty = visit.picture("empty-hand");
    visit.look(EYE, MALLET + Vec3::new(0.24, 0.05, 0.0));
    visit.press(KeyCode::KeyE);
    assert_eq!(visit.held(), Some("mallet"));
    visit.look(EYE, away);
    visit.frames(30);
    let with = visit.picture("mallet-in-hand");
    let mallet = changed(&empty, &with);
    let (at, much) = told(&mallet);
    assert!(at.x > 0.55 && at.y > 0.5, "at the lower right: {at}");
    assert!(much > 10.0, "large enough to be seen: {much} of 1000");
    // close to the wall the picture of it is the same
    let close = Vec3::new(0.3, 1.65, WALL_Z + 0.3);
    visit.look(close, close + Vec3::NEG_Z);
    let before_wall = visit.picture("mallet-before-a-wall");
    visit.press(KeyCode::KeyE);
    visit.frames(10);
    assert_eq!(visit.held(), None);
    visit.app.world_mut().resource_mut::<Actors>().directions.get_mut("mallet").unwrap().hidden = true;
    visit.frames(2);
    let wall = visit.picture("wall");
    let plain = wall.pixels[0];
    assert!(wall.pixels.iter().all(|pixel| (0..3).all(|k| pixel[k].abs_diff(plain[k]) < 12)), "what is hidden is not seen");
    let same = changed(&wall, &before_wall).into_iter().zip(&mallet).filter(|(now, then)| *now && **then).count();
    let of = mallet.iter().filter(|then| **then).count();
    // but for its shadow on the table
    assert!(same * 10 > of * 7, "{same} of {of} pixels");
    visit.look(EYE, JUG + Vec3::Y * 0.12);
    visit.press(KeyCode::KeyE);
    assert_eq!(visit.held(), Some("jug"));
    visit.look(EYE, away);
    visit.frames(30);
    let (at, much) = told(&changed(&visit.picture("jug-in-hand"), &empty));
    assert!(at.x > 0.3 && at.y > 0.5 && much > 10.0, "{at}, {much}");
}

#[test]
fn a_blow_is_seen_to_go_forward() {
    let mut visit = Visit::new();
    visit.without_text();
    visit.look(EYE, MALLET + Vec3::new(0.24, 0.05, 0.0));
    visit.press(KeyCode::KeyE);
    visit.look(EYE, Vec3::new(0.3, 1.5, -9.0));
    visit.frames(30);
    let rests = visit.picture("mallet-rests");
    visit.press(KeyCode::KeyQ);
    visit.frames(8);
    let forward = visit.picture("mallet-strikes");
    assert!(told(&changed(&rests, &forward)).1 > 5.0, "it moves");
    visit.frames(20);
    assert!(told(&changed(&rests, &visit.picture("mallet-rests-again"))).1 < 3.0, "and comes back");
}
