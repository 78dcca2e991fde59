//! What parts, things and impostors wear, in pictures of the GPU (a software one will do).

#![expect(clippy::unwrap_used, reason = "a test ends where something fails")]

use crate::common;
use bevy::prelude::{Entity, With};
use bevy::time::TimeUpdateStrategy;
use glam::Vec3;
use heliodon_bundle::site::Material;
use heliodon_capture::impostor::{CaptureParams, capture};
use heliodon_image::HdrImage;
use heliodon_mesh::Mesh;
use heliodon_mesh::motion::MovingMesh;
use heliodon_script::action::Action;
use heliodon_testkit::scenes::cuboid;
use heliodon_view::actors::Actors;
use heliodon_view::actors::course::Course;
use heliodon_view::covering::Covering;
use heliodon_view::culling::Culling;
use heliodon_view::headless::{RenderOptions, Renderer, Shot, ShotExposure};
use heliodon_view::impostor::Impostors;
use heliodon_view::lamps::{Lamp, Lamps};
use heliodon_view::story::Wishes;
use heliodon_view::{DaylightCamera, ExactAtRest, Pose, Stage};
use std::path::PathBuf;
use std::time::Duration;
use tempfile::TempDir;

const SIZE: [u32; 2] = [200, 150];
const NOON_S: f64 = 12.0 * 3600.0;
const IVORY: [f64; 3] = [0.85, 0.78, 0.62];

/// A court of columns.
struct Scene {
    _folder: TempDir,
    bundle: PathBuf,
    renderer: Renderer,
    shot: Shot,
}

fn material(name: &str, albedo: [f64; 3]) -> Material {
    Material { name: name.to_owned(), albedo, grain: 0.0, metal: 0.0 }
}

impl Scene {
    fn new() -> Self {
        Self::of(common::Court { quads: 40, sun_steps: 4, sky_columns: 64, ..common::Court::small() })
    }

    fn of(court: common::Court) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let bundle = folder.path().join("court");
        court.write(&bundle).unwrap();
        let renderer = Renderer::new(&bundle, SIZE[0], SIZE[1], RenderOptions { samples: 1 }).unwrap();
        let pose = Pose::looking(Vec3::new(3.0, 4.5, 13.0), Vec3::new(0.0, 4.0, 0.0));
        let shot = Shot { pose, fov_deg: 50.0, ..renderer.home_shot(NOON_S) };
        Self { _folder: folder, bundle, renderer, shot }
    }

    fn world(&mut self) -> &mut bevy::prelude::World {
        self.renderer.app_mut().world_mut()
    }

    fn covering(&mut self) -> bevy::prelude::Mut<'_, Covering> {
        self.world().resource_mut::<Covering>()
    }

    fn picture(&mut self) -> HdrImage {
        // normals and pipelines are there in the frames after something is worn first
        for _ in 0..4 {
            self.renderer.render_linear(&self.shot).unwrap();
        }
        self.renderer.render_linear(&self.shot).unwrap()
    }

    /// Lets time pass, of which Bevy takes no more than a quarter of a second a frame.
    fn pass(&mut self, tenths: u32) {
        self.world().insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(100)));
        for _ in 0..tenths {
            self.renderer.render_linear(&self.shot).unwrap();
        }
        self.world().insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
    }

    fn covered(&mut self, material: Material) -> HdrImage {
        self.covering().cover("shafts", material, 0.0);
        self.picture()
    }
}

/// Numbers of the pixels that differ.
fn changed(a: &HdrImage, b: &HdrImage) -> Vec<usize> {
    a.pixels.iter().zip(&b.pixels).enumerate().filter(|(_, (a, b))| a != b).map(|(number, _)| number).collect()
}

fn mean(image: &HdrImage, pixels: &[usize]) -> Vec3 {
    pixels.iter().map(|&pixel| image.pixels[pixel]).sum::<Vec3>() / pixels.len().max(1) as f32
}

#[test]
fn a_cover_is_its_albedo_in_the_light_of_what_it_covers() {
    for textured in [false, true] {
        let mut scene =
            Scene::of(common::Court { textured, quads: 40, sun_steps: 4, sky_columns: 64, ..common::Court::small() });
        let bare = scene.picture();
        let white = scene.covered(material("white", [1.0; 3]));
        let ivory = scene.covered(material("ivory", IVORY));
        assert_eq!(scene.covering().of("shafts"), Some(("ivory", 1.0)));
        assert_eq!(scene.covering().of("ground"), None);
        let shafts = changed(&bare, &white);
        assert!(shafts.len() > 4000, "{}", shafts.len());
        let albedo = Vec3::from(IVORY.map(|v| v as f32));
        for &pixel in &shafts {
            let (wanted, got) = (white.pixels[pixel] * albedo, ivory.pixels[pixel]);
            assert!((got - wanted).abs().max_element() <= 1.5e-3 * wanted.max_element() + 1e-4, "{got} for {wanted}");
            // of no stone comes more light than reaches it
            assert!(bare.pixels[pixel].cmple(white.pixels[pixel] + 1e-3).all());
        }
        // beside the shafts nothing is another
        let others = (0..bare.pixels.len()).filter(|pixel| shafts.binary_search(pixel).is_err());
        assert!(others.clone().count() > 4000 && others.clone().all(|pixel| ivory.pixels[pixel] == bare.pixels[pixel]));
        // With grain the shades stay, and the mean is the material's.
        let grained = scene.covered(Material { grain: 1.0, ..material("grained", [0.4, 0.3, 0.2]) });
        let luminance = |color: Vec3| color.dot(Vec3::new(0.2126, 0.7152, 0.0722));
        let of_own = |pixel: usize| luminance(grained.pixels[pixel]) / luminance(bare.pixels[pixel]);
        let lit: Vec<usize> = shafts.iter().copied().filter(|&pixel| luminance(bare.pixels[pixel]) > 0.02).collect();
        let middle = lit.iter().map(|&pixel| of_own(pixel)).sum::<f32>() / lit.len() as f32;
        assert!(lit.iter().all(|&pixel| (of_own(pixel) - middle).abs() < 0.02 * middle), "textured {textured}");
        let [cover, own] = [luminance(Vec3::new(0.4, 0.3, 0.2)), luminance(mean(&bare, &lit)) / luminance(mean(&white, &lit))];
        assert!((middle * own / cover - 1.0).abs() < 0.15, "textured {textured}: {middle} of {own} for {cover}");
    }
}

#[test]
fn a_cover_rises_or_spreads_from_where_it_was_applied() {
    let mut scene = Scene::new();
    let bare = scene.picture();
    let whole = scene.covered(material("white", [1.0; 3]));
    let shafts = changed(&bare, &whole);
    for applied in [None, Some(Vec3::new(0.0, 10.0, 1.0))] {
        let mut scene = Scene::new();
        scene.picture();
        if let Some(place) = applied {
            scene.covering().begin_at("shafts", place);
        }
        scene.covering().cover("shafts", material("white", [1.0; 3]), 1.0);
        scene.pass(5);
        let (name, amount) = scene.covering().of("shafts").map(|(name, amount)| (name.to_owned(), amount)).unwrap();
        assert!(name == "white" && (amount - 0.5).abs() < 1e-3, "{name} {amount}");
        let half = scene.picture();
        let (mut there, mut bare_still, mut between) = (Vec::new(), Vec::new(), 0);
        for &pixel in &shafts {
            let near = |other: &HdrImage| (half.pixels[pixel] - other.pixels[pixel]).abs().max_element() < 2e-3;
            match (near(&whole), near(&bare)) {
                (true, _) => there.push(pixel),
                (_, true) => bare_still.push(pixel),
                _ => between += 1,
            }
        }
        let part = there.len() as f32 / shafts.len() as f32;
        assert!((0.2..0.8).contains(&part), "{part} at {applied:?}");
        assert!(between * 8 < shafts.len(), "a narrow edge: {between} of {}", shafts.len());
        // rows are counted from the top
        let row =
            |pixels: &[usize]| pixels.iter().map(|pixel| (pixel / SIZE[0] as usize) as f32).sum::<f32>() / pixels.len() as f32;
        let rises = row(&there) > row(&bare_still) + 10.0;
        assert_eq!(rises, applied.is_none(), "{applied:?}: {} and {}", row(&there), row(&bare_still));
        scene.pass(6);
        assert_eq!(scene.picture().pixels, whole.pixels, "at the end it is the material and nothing else");
    }
}

#[test]
fn metal_shines_where_the_sun_is_and_is_its_own_colour() {
    let mut scene = Scene::new();
    // A low sun, whose light upright columns send to the eye.
    scene.shot.clock_s = 6.75 * 3600.0;
    let bare = scene.picture();
    let yellow = scene.covered(material("yellow", [1.0, 0.78, 0.34]));
    let gold = scene.covered(Material { metal: 1.0, ..material("gold", [1.0, 0.78, 0.34]) });
    let shafts = changed(&bare, &yellow);
    assert!(gold.pixels.iter().all(|pixel| pixel.is_finite() && pixel.min_element() >= 0.0));
    let all = mean(&gold, &shafts);
    assert!(all.x > all.y && all.y > 1.4 * all.z, "{all}");
    // It has lights that plaster has not, and is darker beside them.
    let contrast = |image: &HdrImage| {
        let mut values: Vec<f32> = shafts.iter().map(|&pixel| image.pixels[pixel].y).collect();
        values.sort_unstable_by(f32::total_cmp);
        values[values.len() * 98 / 100] / values[values.len() / 2]
    };
    assert!(contrast(&gold) > 1.5 * contrast(&yellow), "{} and {}", contrast(&gold), contrast(&yellow));
    // Under a lamp it shines, where it is seen in it.
    let lamp = Lamp { place: Vec3::new(2.0, 4.5, 6.0), intensity: Vec3::splat(30.0), cone: None, reach_m: 20.0, shadows: true };
    scene.world().resource_mut::<Lamps>().lamps = vec![lamp];
    let lit = scene.picture();
    let brightest = |image: &HdrImage| shafts.iter().map(|&pixel| image.pixels[pixel].y).fold(0.0, f32::max);
    assert!(brightest(&lit) > 2.0 * brightest(&gold), "{} and {}", brightest(&lit), brightest(&gold));
}

#[test]
fn what_is_covered_is_the_same_where_it_is_lit_pixel_by_pixel() {
    let mut exact = Scene::new();
    let mut by_pixel = Renderer::new(&exact.bundle, SIZE[0], SIZE[1], RenderOptions { samples: 1 }).unwrap();
    let world = by_pixel.app_mut().world_mut();
    let camera = world.query_filtered::<Entity, With<DaylightCamera>>().single(world).unwrap();
    world.entity_mut(camera).remove::<ExactAtRest>();
    let bare = exact.renderer.render(&exact.shot).unwrap();
    let steps: [&dyn Fn(&mut Covering); 4] = [
        &|covering| covering.cover("shafts", Material { grain: 0.6, ..material("ivory", IVORY) }, 0.0),
        &|covering| covering.cover("ground", material("red", [0.6, 0.1, 0.05]), 0.0),
        &|covering| covering.fade("shafts", 0.0, 0.0),
        &|covering| covering.fade("shafts", 1.0, 0.0),
    ];
    let mut before = bare;
    for (number, step) in steps.iter().enumerate() {
        let [drawn, lit] = [&mut exact.renderer, &mut by_pixel].map(|renderer| {
            step(&mut renderer.app_mut().world_mut().resource_mut::<Covering>());
            for _ in 0..4 {
                renderer.render(&exact.shot).unwrap();
            }
            renderer.render(&exact.shot).unwrap()
        });
        let codes = drawn.pixels.as_flattened().iter().zip(lit.pixels.as_flattened());
        let off = codes.clone().filter(|(a, b)| a.abs_diff(**b) > 2).count();
        assert!(off * 500 < codes.count(), "step {number}: {off} codes are off");
        assert!(drawn != before, "step {number} shows");
        before = drawn;
    }
}

#[test]
fn what_fades_leaves_its_part_of_the_pixels_and_hides_nothing() {
    let mut scene = Scene::new();
    let whole = scene.picture();
    scene.covering().fade("shafts", 0.0, 0.0);
    let without = scene.picture();
    let shafts = changed(&whole, &without);
    assert!(shafts.len() > 4000, "{}", shafts.len());
    for opacity in [0.25, 0.5, 0.75] {
        scene.covering().fade("shafts", opacity, 0.0);
        let faded = scene.picture();
        assert_eq!(scene.picture().pixels, faded.pixels, "it stands still");
        // Where one shaft stands behind another either may be seen, and both are there.
        let gone = shafts.iter().filter(|&&pixel| faded.pixels[pixel] == without.pixels[pixel]).count();
        let part = 1.0 - gone as f32 / shafts.len() as f32;
        assert!((part - opacity).abs() < 0.03, "{part} of {opacity}");
        let others = (0..whole.pixels.len()).filter(|pixel| shafts.binary_search(pixel).is_err());
        others.for_each(|pixel| assert_eq!(faded.pixels[pixel], whole.pixels[pixel]));
    }
    // No occluder stands in what is not there: with all culling the pictures are the same.
    scene.renderer.wait_for_culling().unwrap();
    for opacity in [0.0, 0.5, 1.0] {
        scene.covering().fade("shafts", opacity, 0.0);
        let [all, culled] = [Culling::none(), Culling::exact()].map(|culling| {
            scene.world().insert_resource(culling);
            scene.picture()
        });
        assert!(all.pixels == culled.pixels, "at {opacity}");
    }
    assert_eq!(scene.picture().pixels, whole.pixels, "back again");
}

#[test]
fn a_mark_shows_in_the_dark_and_in_the_sun_and_has_an_outline() {
    let mut scene = Scene::new();
    // The background of the shafts, to know where they are.
    let bare = scene.picture();
    scene.covering().fade("shafts", 0.0, 0.0);
    let without = scene.picture();
    let shafts = changed(&bare, &without);
    scene.covering().fade("shafts", 1.0, 0.0);
    for stops in [-6.0, 0.0, 2.0] {
        scene.shot.exposure = ShotExposure::Lapse(stops);
        let plain = scene.picture();
        scene.covering().highlight("shafts", true);
        scene.pass(5);
        assert_eq!(scene.covering().mark("shafts"), 1.0);
        let shown = |image: &HdrImage, pixel: usize| (image.pixels[pixel] * stops.exp2()).clamp(Vec3::ZERO, Vec3::ONE);
        let marked = scene.picture();
        let differ = |pixels: &[usize], least: f32| {
            let differs = |pixel: &&usize| (shown(&marked, **pixel) - shown(&plain, **pixel)).abs().max_element() > least;
            pixels.iter().filter(differs).count()
        };
        assert!(differ(&shafts, 0.02) * 4 > shafts.len() * 3, "{} of {} at {stops}", differ(&shafts, 0.02), shafts.len());
        let outside: Vec<usize> = changed(&plain, &marked).into_iter().filter(|p| shafts.binary_search(p).is_err()).collect();
        assert!(outside.len() > 150 && outside.len() * 5 < shafts.len(), "{} pixels of outline at {stops}", outside.len());
        // not by its colour alone: there are brighter and darker ones in it
        let values: Vec<f32> = outside.iter().map(|&pixel| shown(&marked, pixel).y).collect();
        assert!(values.iter().any(|&value| value > 0.3) && values.iter().any(|&value| value < 0.1), "at {stops}");
        scene.covering().highlight("shafts", false);
        scene.pass(5);
        assert_eq!(scene.picture().pixels, plain.pixels, "it goes without a trace");
    }
}

/// A cube on the ground before the court, and where it stands.
fn with_cube() -> (Scene, Vec3) {
    let mut scene = Scene::new();
    let place = Vec3::new(2.0, 0.0, 2.5);
    let cube = cuboid(Vec3::new(-0.6, 0.8, -0.6), Vec3::new(0.6, 2.0, 0.6), 6);
    let mesh = Mesh { positions: cube.positions, normals: cube.normals, triangles: cube.triangles, ..Mesh::default() };
    scene.world().resource_mut::<Actors>().add("cube", MovingMesh::still(mesh), None, 1.0, Course::stands(place, 0.4));
    (scene, place)
}

#[test]
fn things_are_covered_faded_and_marked_as_parts_are() {
    let mut empty = Scene::new();
    let empty = empty.picture();
    let (mut scene, _) = with_cube();
    let bare = scene.picture();
    let touched = changed(&empty, &bare);
    assert!(scene.world().resource::<Actors>().whereabouts("cube").is_some());
    scene.covering().cover("cube", material("white", [1.0; 3]), 0.0);
    let white = scene.picture();
    let cube = changed(&bare, &white);
    assert!(cube.len() > 200 && cube.len() < touched.len(), "{} of {}", cube.len(), touched.len());
    scene.covering().cover("cube", material("ivory", IVORY), 0.0);
    let ivory = scene.picture();
    let albedo = Vec3::from(IVORY.map(|v| v as f32));
    for &pixel in &cube {
        let (wanted, got) = (white.pixels[pixel] * albedo, ivory.pixels[pixel]);
        assert!((got - wanted).abs().max_element() <= 1.5e-3 * wanted.max_element() + 1e-4, "{got} for {wanted}");
        // its own is half
        assert!(
            (bare.pixels[pixel] * 2.0 - white.pixels[pixel]).abs().max_element() <= 4e-3 * white.pixels[pixel].max_element()
        );
    }
    // Its shadow pales with it, and is gone when it is.
    let shadow: Vec<usize> = touched.iter().copied().filter(|pixel| cube.binary_search(pixel).is_err()).collect();
    scene.covering().fade("cube", 0.5, 0.0);
    let half = scene.picture();
    let [without, faded, with] = [&empty, &half, &ivory].map(|image| mean(image, &shadow).element_sum());
    assert!(shadow.len() > 100 && with < 0.97 * without, "{with} of {without} on {} pixels", shadow.len());
    assert!((faded - 0.5 * (with + without)).abs() < 0.2 * (without - with), "{faded} between {with} and {without}");
    let gone = cube.iter().filter(|&&pixel| half.pixels[pixel] != ivory.pixels[pixel]).count() as f32 / cube.len() as f32;
    assert!((gone - 0.5).abs() < 0.06, "{gone}");
    scene.covering().fade("cube", 0.0, 0.0);
    let none = scene.picture();
    let left = changed(&none, &empty);
    assert!(left.is_empty(), "{} pixels", left.len());
    scene.covering().fade("cube", 1.0, 0.0);
    scene.covering().highlight("cube", true);
    scene.pass(5);
    let marked = scene.picture();
    assert!(changed(&marked, &ivory).len() > cube.len(), "the cube and its outline");
}

#[test]
fn strangers_and_another_bundle_do_no_harm() {
    let mut scene = Scene::new();
    let bare = scene.picture();
    scene.covering().cover("nobody", material("white", [1.0; 3]), 0.0);
    scene.covering().fade("", 0.5, f32::NAN);
    scene.covering().highlight("nobody", true);
    assert_eq!(scene.picture().pixels, bare.pixels);
    scene.covering().cover("shafts", material("odd", [f64::NAN, -1.0, 7.0]), -3.0);
    scene.covering().fade("ground", f32::NAN, f32::INFINITY);
    scene.picture();
    let bundle = scene.bundle.clone();
    scene.world().resource_mut::<Stage>().open(&bundle).unwrap();
    let shot = scene.shot;
    while !scene.renderer.stage().is_complete() {
        scene.renderer.render(&shot).unwrap();
    }
    assert_eq!(scene.picture().pixels, bare.pixels, "opened again, all is as it was");
    assert_eq!(scene.covering().of("shafts"), None);
}

#[test]
fn impostors_fade_and_are_marked() {
    let model = {
        let cube = cuboid(Vec3::new(-0.4, 0.0, -0.4), Vec3::new(0.4, 1.8, 0.4), 6);
        MovingMesh::still(Mesh {
            positions: cube.positions,
            normals: cube.normals,
            triangles: cube.triangles,
            ..Mesh::default()
        })
    };
    let params = CaptureParams { px_per_radian: 300.0, distance_m: 12.0, ..CaptureParams::preview() };
    let impostor = capture(&model, "somebody", &params, &|_| ()).unwrap();
    let mut scene = Scene::new();
    let empty = scene.picture();
    let course = Course::stands(Vec3::new(2.0, 0.0, 3.0), 0.3);
    scene.world().resource_mut::<Impostors>().add(impostor, vec![course]);
    // Those that a program adds have no name.
    for casters in [0, u32::MAX] {
        scene.world().resource_mut::<Impostors>().options.casters = casters;
        scene.covering().fade("", 1.0, 0.0);
        let whole = scene.picture();
        scene.covering().fade("", 0.5, 0.0);
        let half = scene.picture();
        let its = changed(&empty, &whole);
        assert!(its.len() > 200, "{}", its.len());
        for &pixel in &its {
            let [none, all] = [&empty, &whole].map(|image| image.pixels[pixel]);
            let off = (half.pixels[pixel] - (none + all) * 0.5).abs();
            // what is half there stands before half of its own shadow
            let most = if casters > 0 { 0.3 * none.max(all) } else { Vec3::splat(2e-3 * none.max(all).max_element() + 1e-4) };
            assert!(off.cmple(most).all(), "{off} for {none} and {all}, {casters} casting shadows");
        }
    }
    scene.covering().fade("", 1.0, 0.0);
    let whole = scene.picture();
    let its = changed(&empty, &whole);
    scene.covering().fade("", 0.0, 0.0);
    assert_eq!(scene.picture().pixels, empty.pixels);
    scene.covering().fade("", 1.0, 0.0);
    scene.covering().highlight("", true);
    scene.pass(5);
    let marked = scene.picture();
    let brighter = its.iter().filter(|&&pixel| marked.pixels[pixel].x > whole.pixels[pixel].x + 0.02).count();
    assert!(brighter > 100, "{brighter} of {}", its.len());
    // nothing but they
    assert!(changed(&marked, &whole).iter().all(|pixel| its.binary_search(pixel).is_ok()));
}

#[test]
fn wishes_of_scripts_are_carried_out_once() {
    let mut scene = Scene::new();
    let whole = scene.picture();
    scene.world().init_resource::<Wishes>();
    let fade = |opacity| Action::Fade { what: "shafts".to_owned(), opacity, seconds: 0.0 };
    // of a material that the bundle has not nothing comes but a word in the log
    let unknown = Action::Material { target: "ground".to_owned(), material: "cheese".to_owned(), seconds: 0.0 };
    scene.world().resource_mut::<Wishes>().looks = vec![unknown, fade(0.0)];
    let without = scene.picture();
    assert!(changed(&whole, &without).len() > 4000 && scene.covering().opacity("shafts") == 0.0);
    assert!(scene.covering().of("ground").is_none() && scene.world().resource::<Wishes>().looks.is_empty());
    scene.world().resource_mut::<Wishes>().looks = vec![fade(1.0)];
    assert_eq!(scene.picture().pixels, whole.pixels);
}
