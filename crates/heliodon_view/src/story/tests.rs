//! A visit to a hall in which something happens, without a GPU.

use super::*;
use crate::impostor::Impostors;
use crate::navigation::Visitor;
use crate::navigation::pose::Pose;
use crate::stage::StagePlugin;
use crate::stage::frame::StageFrame;
use crate::time_lapse::exposure::Exposure;
use bevy::time::TimeUpdateStrategy;
use heliodon_bundle::site::Site;
use heliodon_bundle::{BundleMeta, BundleWriter, LightLayout, LitChunk, VertexLight};
use heliodon_sky::lapse::{Lapse, LapseStep};
use std::time::Duration;
use tempfile::TempDir;

const SITE: &str = r#"
[site]
name = "Hall"
[[part]]
file = "hall.obj"
[sky]
probes = "*.hdr"
mapping = "lat-long"
[[region]]
name = "hall"
min = [-2.0, -1.0, -2.0]
max = [2.0, 3.0, 2.0]
[[view]]
name = "door"
place = [0.0, 1.7, 9.0]
look_at = [0.0, 1.7, 0.0]
[[material]]
name = "gold"
albedo = [0.9, 0.7, 0.3]
[story]
scripts = ["story.rhai"]
texts = "texts.toml"
"#;

const TEXTS: &str = "languages = [\"en\", \"de\"]\n[texts.welcome]\nen = \"Welcome, visitor {n}\"\nde = \"Willkommen, Gast {n}\"\n[texts.go]\nen = \"Go on\"\nde = \"Weiter\"\n";

const SCRIPT: &str = r#"
state.visits = recall("visits", 0);
when_enter("hall", || {
    state.visits += 1;
    remember("visits", state.visits);
    subtitle("welcome", 2, #{ n: state.visits });
    task("go");
    set_hour("13:00", 1);
});
when_leave("hall", || { no_task(); go_to("door"); });
"#;

struct Visit {
    folder: TempDir,
    app: App,
}

impl Visit {
    fn new(language: Option<&str>) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("story.rhai"), SCRIPT).unwrap();
        std::fs::write(folder.path().join("texts.toml"), TEXTS).unwrap();
        write_bundle(folder.path());
        let mut visit = Self { folder, app: App::new() };
        visit.begin(language);
        visit
    }

    /// Comes in by the door.
    fn begin(&mut self, language: Option<&str>) {
        self.app = App::new();
        self.app
            .add_plugins((MinimalPlugins, StagePlugin, StoryPlugin))
            .init_resource::<StageFrame>()
            .init_resource::<TimeLapse>()
            .init_resource::<Exposure>()
            .init_resource::<Actors>()
            .init_resource::<Impostors>()
            .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)))
            .insert_resource(StoryPlaces {
                site: Some(self.folder.path().to_owned()),
                memory: Some(self.folder.path().join("memory.json")),
                language: language.map(str::to_owned),
            });
        self.app.world_mut().spawn(Visitor::default());
        self.stand(Vec3::new(0.0, 1.7, 9.0));
        self.app.world_mut().resource_mut::<Stage>().open(self.folder.path().join("bundle")).unwrap();
        self.frames(5);
    }

    fn stand(&mut self, eye: Vec3) {
        let world = self.app.world_mut();
        world.query::<&mut Visitor>().single_mut(world).unwrap().pose = Pose::looking(eye, Vec3::ZERO);
    }

    fn eye(&mut self) -> Vec3 {
        let world = self.app.world_mut();
        world.query::<&Visitor>().single(world).unwrap().pose.eye
    }

    fn frames(&mut self, count: usize) {
        (0..count).for_each(|_| self.app.update());
    }

    fn board(&self) -> &board::Board {
        self.app.world().resource()
    }
}

/// Writes the hall, with the scripts and texts that lie in `folder`.
pub(crate) fn write_bundle(folder: &Path) {
    write_bundle_of(folder, SITE);
}

/// Writes a site of one triangle, with the files of its story that lie in `folder`.
pub(crate) fn write_bundle_of(folder: &Path, site: &str) {
    let site = Site::parse(site, folder.join("site.toml")).unwrap();
    let layout = LightLayout { sun_steps: 1, coefficients: 4, channels: 1, sun_bounce_functions: 0 };
    let mut writer = BundleWriter::create(folder.join("bundle"), BundleMeta::from_site(site.file(), layout, 1e-4)).unwrap();
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Z];
    writer
        .push_chunk(&LitChunk {
            part: 0,
            texture: None,
            detail: None,
            normals: vec![Vec3::Y; 3],
            uvs: Vec::new(),
            texel_uvs: Vec::new(),
            albedo: vec![Vec3::splat(0.5); 3],
            triangles: vec![[0, 2, 1]],
            valid: vec![1; 3],
            light: VertexLight::zeros(layout, 3),
            positions,
        })
        .unwrap();
    let map = heliodon_image::HdrImage::from_fn(4, 2, |_, _| Vec3::ONE);
    writer.add_sky_map("sky/0.hdr", &map.to_hdr_bytes()).unwrap();
    writer.add_living(folder).unwrap();
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
fn a_visit_is_told_of_shown_and_remembered() {
    let mut visit = Visit::new(None);
    assert_eq!(*visit.board(), board::Board::default());
    visit.app.world_mut().resource_mut::<TimeLapse>().playing = false;
    visit.stand(Vec3::new(0.0, 1.7, 1.0));
    visit.frames(2);
    assert_eq!(visit.board().subtitle(), Some("Welcome, visitor 1"));
    assert_eq!(visit.board().task.as_deref(), Some("Go on"));
    visit.frames(60);
    let clock_s = visit.app.world().resource::<TimeLapse>().clock_s;
    assert!((clock_s - 13.0 * 3600.0).abs() < 1.0, "{clock_s}");
    visit.stand(Vec3::new(0.0, 1.7, 5.0));
    visit.frames(3);
    assert_eq!(visit.board().task, None);
    assert!(visit.eye().abs_diff_eq(Vec3::new(0.0, 1.7, 9.0), 1e-4));
    let asked = visit.app.world_mut().resource_mut::<Story>().take_asked();
    assert_eq!(asked.len(), 5, "{asked:?}");
    // the second visit, in another language, goes on from the first
    visit.begin(Some("de"));
    visit.stand(Vec3::new(0.0, 1.7, 1.0));
    visit.frames(2);
    assert_eq!(visit.board().subtitle(), Some("Willkommen, Gast 2"));
}

#[test]
fn scripts_know_what_is_covered_and_what_is_bare_again() {
    const COVERS: &str = r#"
material("hall", "gold");
after(0.1, || {
    if material_of("hall") == "gold" { task("go"); }
    bare("hall", 0);
    after(0.1, || if material_of("hall") == "" { no_task(); });
});
"#;
    let mut visit = Visit::new(None);
    std::fs::write(visit.folder.path().join("story.rhai"), COVERS).unwrap();
    visit.begin(None);
    visit.frames(3);
    assert_eq!(visit.board().task.as_deref(), Some("Go on"));
    visit.frames(10);
    assert_eq!(visit.board().task, None);
}

#[test]
fn scripts_that_are_written_anew_are_taken_up() {
    let mut visit = Visit::new(None);
    let script = visit.folder.path().join("story.rhai");
    let write = |text: &str, ahead_s: u64| {
        std::fs::write(&script, text).unwrap();
        let file = std::fs::File::options().write(true).open(&script).unwrap();
        file.set_modified(SystemTime::now() + Duration::from_secs(ahead_s)).unwrap();
    };
    // an unsound one leaves the old one at work
    write("when_enter(\"hal\", || no_task());", 10);
    visit.frames(30);
    visit.stand(Vec3::new(0.0, 1.7, 1.0));
    visit.frames(2);
    assert_eq!(visit.board().task.as_deref(), Some("Go on"));
    write("no_task(); when_leave(\"hall\", || task(\"welcome\"));", 20);
    let start = Instant::now();
    visit.frames(30);
    assert!(start.elapsed() < Duration::from_millis(500), "{:?}", start.elapsed());
    assert_eq!(visit.board().task, None);
    visit.stand(Vec3::new(0.0, 1.7, 5.0));
    visit.frames(3);
    assert_eq!(visit.board().task.as_deref(), Some("Welcome, visitor {n}"));
}
