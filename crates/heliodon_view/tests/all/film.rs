//! Films in pictures of the GPU (a software one will do), through the real ffmpeg; where it is not installed, every test here says that it is skipped.

#![expect(clippy::unwrap_used, reason = "a test ends where something fails")]

use crate::common;
use glam::Vec3;
use heliodon_bundle::site::{Film, Site};
use heliodon_capture::impostor::{CaptureParams, capture};
use heliodon_film::{FilmFormat, FilmWriter, Rate, WriteParams};
use heliodon_image::HdrImage;
use heliodon_mesh::Mesh;
use heliodon_mesh::motion::MovingMesh;
use heliodon_testkit::scenes::cuboid;
use heliodon_view::Pose;
use heliodon_view::actors::course::Course;
use heliodon_view::film::{FilmOptions, Films, Passes};
use heliodon_view::headless::{RenderOptions, Renderer, Shot, ShotExposure};
use heliodon_view::impostor::Impostors;
use heliodon_view::lamps::{Lamp, Lamps};
use heliodon_view::particles::Particles;
use std::process::Command;
use tempfile::TempDir;

const SIZE: [u32; 2] = [160, 120];
const HOUR_S: f64 = 3600.0;
const RATE: Rate = Rate { numerator: 30, denominator: 1 };
/// Films' own pixels.
const SIDE: u32 = 64;

#[expect(clippy::print_stdout, reason = "a test that is skipped says so")]
fn ffmpeg() -> bool {
    let there = Command::new("ffmpeg").arg("-version").output().is_ok();
    if !there {
        println!("skipped: ffmpeg is not installed");
    }
    there
}

/// A court, and a folder for films.
struct Scene {
    folder: TempDir,
    renderer: Renderer,
    shot: Shot,
}

impl Scene {
    fn new(textured: bool, samples: u32) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let bundle = folder.path().join("court");
        let court =
            common::Court { shafts: (1, 5), textured, quads: 40, sun_steps: 4, sky_columns: 64, ..common::Court::small() };
        court.write(&bundle).unwrap();
        let renderer = Renderer::new(&bundle, SIZE[0], SIZE[1], RenderOptions { samples }).unwrap();
        let pose = Pose::looking(Vec3::new(0.0, 1.7, 14.0), Vec3::new(0.0, 1.7, 0.0));
        let shot = Shot { pose, fov_deg: 50.0, exposure: ShotExposure::Stops(0.0), ..renderer.home_shot(12.0 * HOUR_S) };
        Self { folder, renderer, shot }
    }

    /// Writes a film of pictures with alpha as a pair, premultiplied in linear light.
    fn pair(&self, name: &str, count: u64, pixel: impl Fn(u64, u32, u32) -> [u8; 2]) {
        let params = WriteParams { format: FilmFormat::H264, quality: 2, ..WriteParams::archival(SIDE, SIDE, RATE) };
        let path = |kind: &str| self.folder.path().join(format!("{name}.{kind}.mp4"));
        let mut image = FilmWriter::grey(&path("image"), &params).unwrap();
        let mut mask = FilmWriter::grey(&path("mask"), &params).unwrap();
        for number in 0..count {
            let pixels: Vec<[u8; 2]> = (0..SIDE * SIDE).map(|i| pixel(number, i % SIDE, i / SIDE)).collect();
            image.write_grey(&pixels.iter().map(|[image, _]| *image).collect::<Vec<_>>()).unwrap();
            mask.write_grey(&pixels.iter().map(|[_, mask]| *mask).collect::<Vec<_>>()).unwrap();
        }
        image.finish().unwrap();
        mask.finish().unwrap();
    }

    fn add(&mut self, settings: &str) {
        let text = format!(
            "[site]\nname = \"a\"\n[[part]]\nfile = \"a.obj\"\n[[part]]\nfile = \"shafts.obj\"\n[sky]\nprobes = \"*.hdr\"\n\
             mapping = \"lat-long\"\n[[film]]\n{settings}\n"
        );
        let film: Film = Site::parse(&text, "site.toml").unwrap().file().films[0].clone();
        let folder = self.folder.path().to_owned();
        self.renderer.app_mut().world_mut().resource_mut::<Films>().add(folder, film);
        self.settle();
    }

    fn settle(&mut self) {
        while !self.renderer.app_mut().world().resource::<Films>().is_complete() {
            self.renderer.app_mut().update();
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
    }

    fn passes(&mut self, passes: Passes) {
        self.renderer.app_mut().world_mut().insert_resource(FilmOptions { passes, ..FilmOptions::default() });
    }

    fn at(&mut self, actors_s: f64) -> HdrImage {
        self.renderer.render_linear(&Shot { actors_s, ..self.shot }).unwrap()
    }
}

fn code(linear: f64) -> u8 {
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}

/// A column of cover from none at the left to all at the right, of a grey that gets brighter upwards.
fn ramp(_: u64, x: u32, y: u32) -> [u8; 2] {
    let cover = f64::from(x) / f64::from(SIDE - 1);
    let bright = 0.1 + 0.8 * f64::from(SIDE - 1 - y) / f64::from(SIDE - 1);
    [code(cover * bright), (255.0 * (1.0 - cover)).round() as u8]
}

const RAMP: &str =
    "name = \"ramp\"\nfile = \"ramp.image.mp4\"\nmask = \"ramp.mask.mp4\"\nplace = [0.0, 0.7, 11.5]\nheight_m = 2.0\nlit = 0.0";

#[test]
fn two_passes_are_one_and_both_are_image_plus_background_times_mask() {
    if !ffmpeg() {
        return;
    }
    for samples in [1, 2] {
        let mut scene = Scene::new(false, samples);
        let bare = scene.at(0.5);
        scene.pair("ramp", 30, ramp);
        scene.add(RAMP);
        let one = scene.at(0.5);
        let codes_of_one = scene.renderer.render(&Shot { actors_s: 0.5, ..scene.shot }).unwrap();
        scene.passes(Passes::Two);
        let two = scene.at(0.5);
        let codes_of_two = scene.renderer.render(&Shot { actors_s: 0.5, ..scene.shot }).unwrap();
        let worst = one.pixels.iter().zip(&two.pixels).map(|(a, b)| (a - b).abs().max_element()).fold(0.0, f32::max);
        assert!(worst < 2e-3, "{worst} in linear light");
        let apart = |a: &[u8; 4], b: &[u8; 4]| a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max();
        let worst = codes_of_one.pixels.iter().zip(&codes_of_two.pixels).filter_map(|(a, b)| apart(a, b)).max();
        assert!(worst <= Some(1), "{worst:?} codes");
        // at the middle row the film is 64 of its pixels wide and 2 m; from its cover follows what is seen
        let metres = 2.0 * f64::from(SIZE[1] / 2) / (2.5 * f64::tan(25.0_f64.to_radians())) / 2.0;
        let (mut most, mut seen) = (0.0_f32, 0);
        for x in 0..SIZE[0] {
            let across = (f64::from(x) + 0.5 - f64::from(SIZE[0] / 2)) / metres / 2.0 + 0.5;
            if !(0.05..0.95).contains(&across) {
                continue;
            }
            let y = SIZE[1] / 2;
            let down = 0.5 + 0.5 / metres / 2.0;
            let pixels = f64::from(SIDE);
            let cover = (across * pixels - 0.5) / (pixels - 1.0);
            let bright = 0.1 + 0.8 * (1.0 - (down * pixels - 0.5) / (pixels - 1.0));
            let wanted = Vec3::splat((cover * bright) as f32) + bare.pixel(x, y) * (1.0 - cover) as f32;
            most = most.max((one.pixel(x, y) - wanted).abs().max_element());
            seen += 1;
        }
        assert!(seen > 50 && most < 0.02, "{most} off over {seen} pixels");
    }
}

#[test]
fn the_picture_of_a_time_is_the_same_whenever_it_is_asked_for() {
    if !ffmpeg() {
        return;
    }
    let mut scene = Scene::new(false, 1);
    scene.pair("count", 60, |number, _, _| [(number * 4) as u8, 0]);
    scene.add("name = \"a\"\nfile = \"count.image.mp4\"\nmask = \"count.mask.mp4\"\nplace = [0.0, 0.7, 11.5]\nlit = 0.0");
    let mut seen = |seconds: f64| {
        let picture = scene.renderer.render(&Shot { actors_s: seconds, ..scene.shot }).unwrap();
        i32::from(picture.pixel(SIZE[0] / 2, SIZE[1] / 2)[0])
    };
    for number in [3_i32, 55, 20, 21, 3, 60 + 7] {
        let wanted = number % 60 * 4;
        let found = seen((f64::from(number) + 0.5) / 30.0);
        assert!((found - wanted).abs() <= 2, "{found} for {wanted}");
    }
}

#[test]
fn a_lit_film_goes_with_the_hour_and_the_lamps_and_one_that_shines_does_not() {
    if !ffmpeg() {
        return;
    }
    let mut scene = Scene::new(false, 1);
    scene.pair("white", 10, |_, _, _| [255, 0]);
    let white = "file = \"white.image.mp4\"\nmask = \"white.mask.mp4\"\nheight_m = 1.0";
    scene.add(&format!("name = \"lit\"\n{white}\nplace = [-0.6, 1.2, 11.5]"));
    scene.add(&format!("name = \"shines\"\n{white}\nplace = [0.6, 1.2, 11.5]\nlit = 0.0"));
    let seen = |scene: &mut Scene, clock_s: f64| {
        scene.shot = Shot { clock_s, exposure: ShotExposure::Stops(-3.0), ..scene.shot };
        let picture = scene.at(0.1);
        // 0.6 m aside at 2.5 m
        let aside = (0.6 / 2.5 / f64::tan(25.0_f64.to_radians()) * f64::from(SIZE[1] / 2)) as u32;
        [SIZE[0] / 2 - aside, SIZE[0] / 2 + aside].map(|x| picture.pixel(x, SIZE[1] / 2))
    };
    let [morning, noon] = [6.5, 12.0].map(|hour| seen(&mut scene, hour * HOUR_S));
    let own = [morning[1], noon[1]].map(|seen| seen.min_element());
    assert!(own[0] > 0.98 && own[0] == own[1], "{own:?}");
    assert!(noon[0].max_element() < 0.9 && noon[0].min_element() > 0.01, "{noon:?}");
    assert!((noon[0] - morning[0]).abs().max_element() > 0.1 * noon[0].max_element(), "{morning:?} {noon:?}");
    let lamp = Lamp {
        place: Vec3::new(-0.6, 1.7, 13.5),
        intensity: Vec3::new(8.0, 4.0, 1.0),
        cone: None,
        reach_m: 20.0,
        shadows: true,
    };
    scene.renderer.app_mut().world_mut().resource_mut::<Lamps>().lamps = vec![lamp];
    let by_lamp = seen(&mut scene, 12.0 * HOUR_S);
    let more = by_lamp[0] - noon[0];
    assert!(more.x > 0.03 && (more.x / more.y - 2.0).abs() < 0.2, "the lamp's own colour: {more}");
    assert_eq!(by_lamp[1], noon[1]);
}

#[test]
fn stone_hides_films_and_films_go_softly_into_the_ground() {
    if !ffmpeg() {
        return;
    }
    let mut scene = Scene::new(false, 1);
    let bare = scene.at(0.1);
    scene.pair("white", 10, |_, _, _| [255, 0]);
    let white = "file = \"white.image.mp4\"\nmask = \"white.mask.mp4\"\nlit = 0.0";
    // behind everything and within the ground
    scene.add(&format!("name = \"under\"\n{white}\nplace = [0.0, -3.0, 10.0]\nheight_m = 2.0"));
    let with = scene.at(0.1);
    assert_eq!(bare.pixels, with.pixels, "what is under the ground is not seen");
    scene.add(&format!("name = \"stands\"\n{white}\nplace = [0.0, -0.3, 10.0]\nheight_m = 1.3"));
    let with = scene.at(0.1);
    let column: Vec<f32> = (0..SIZE[1]).map(|y| with.pixel(SIZE[0] / 2, y).x).collect();
    let first = column.iter().position(|&red| red == 1.0).unwrap();
    let last = column.iter().rposition(|&red| red == 1.0).unwrap();
    // from 1 m above the ground down to it: 4 m away, seen from 1.7 m
    let row = |up_m: f64| f64::from(SIZE[1] / 2) * (1.0 + (1.7 - up_m) / 4.0 / f64::tan(25.0_f64.to_radians()));
    assert!((first as f64 - row(1.0)).abs() < 2.0, "{first} for {}", row(1.0));
    assert!((last as f64 - row(0.0)).abs() < 4.0, "{last} for {}", row(0.0));
}

#[test]
fn a_film_throws_its_shadow_on_the_ground_and_no_light() {
    if !ffmpeg() {
        return;
    }
    let mut scene = Scene::new(false, 1);
    scene.shot = Shot { exposure: ShotExposure::Stops(-1.5), clock_s: 10.0 * HOUR_S, ..scene.shot };
    scene.shot.pose = Pose::looking(Vec3::new(0.0, 5.0, 14.0), Vec3::new(0.0, 0.0, 7.0));
    let bare = scene.at(0.1);
    // somebody as wide as a third of the film
    scene.pair("body", 10, |_, x, _| if (21..43).contains(&x) { [128, 0] } else { [0, 255] });
    scene.add("name = \"body\"\nfile = \"body.image.mp4\"\nmask = \"body.mask.mp4\"\nplace = [0.0, 0.0, 7.0]\nheight_m = 1.8");
    let with = scene.at(0.1);
    let ratio: Vec<f32> = bare.pixels.iter().zip(&with.pixels).map(|(bare, with)| with.y / bare.y.max(1e-3)).collect();
    // the film itself is a grey of its own everywhere; its shadow is darker ground, and sharp: most of the sun is gone
    let dark = ratio.iter().filter(|&&ratio| ratio < 0.6).count();
    assert!((60..2500).contains(&dark), "{dark} pixels in the shadow");
    let kept = ratio.iter().filter(|&&ratio| ratio == 1.0).count();
    assert!(kept > ratio.len() * 7 / 10, "{kept} pixels as before");
}

#[test]
fn a_part_shows_a_film_in_place_of_its_own_colour() {
    if !ffmpeg() {
        return;
    }
    let mut scene = Scene::new(true, 1);
    scene.shot.pose = Pose::looking(Vec3::new(3.0, 4.5, 13.0), Vec3::new(0.0, 4.0, 0.0));
    scene.shot.exposure = ShotExposure::Stops(-2.0);
    let bare = scene.at(0.1);
    scene.pair("white", 10, |_, x, _| if x < SIDE / 2 { [255, 0] } else { [0, 255] });
    let white = "file = \"white.image.mp4\"\nmask = \"white.mask.mp4\"\nplace = [0.0, 0.0, 0.0]\nsurface = \"shafts\"";
    scene.add(&format!("name = \"on shafts\"\n{white}"));
    let with = scene.at(0.1);
    // lit as the same stone without its image, whose albedo in green is 0.38 to 0.56
    let mut plain = Scene::new(false, 1);
    plain.shot = scene.shot;
    let plain = plain.at(0.1);
    let changed: Vec<usize> =
        (0..bare.pixels.len()).filter(|&i| (bare.pixels[i] - with.pixels[i]).abs().max_element() > 1e-4).collect();
    assert!(changed.len() > 2000, "{} pixels", changed.len());
    let albedo = |&i: &usize| plain.pixels[i].y / with.pixels[i].y;
    // beside the film's edges, where half of a pixel is stone
    let whole: Vec<usize> =
        changed.iter().copied().filter(|i| changed.contains(&(i - 1)) && changed.contains(&(i + 1))).collect();
    let within = whole.iter().map(albedo).filter(|albedo| (0.37..0.57).contains(albedo)).count();
    assert!(whole.len() > 1000 && within > whole.len() * 95 / 100, "{within} of {}", whole.len());
    // half of the film is nothing: there the part stays what it is
    let kept = bare.pixels.iter().zip(&with.pixels).zip(&plain.pixels).filter(|((a, b), plain)| a == b && a != plain).count();
    assert!(kept > changed.len() / 2, "{kept} kept");
}

#[test]
fn who_stands_before_a_film_hides_it() {
    if !ffmpeg() {
        return;
    }
    let mut scene = Scene::new(false, 1);
    let cube = cuboid(Vec3::new(-0.4, 0.0, -0.4), Vec3::new(0.4, 1.8, 0.4), 6);
    let still = Mesh { positions: cube.positions, normals: cube.normals, triangles: cube.triangles, ..Mesh::default() };
    let params = CaptureParams { px_per_radian: 300.0, distance_m: 4.0, ..CaptureParams::preview() };
    let somebody = capture(&MovingMesh::still(still), "somebody", &params, &|_| ()).unwrap();
    let course = Course::stands(Vec3::new(0.0, 0.8, 10.0), 0.0);
    scene.renderer.app_mut().world_mut().resource_mut::<Impostors>().add(somebody, vec![course]);
    let alone = scene.at(0.5);
    scene.pair("white", 30, |_, _, _| [255, 0]);
    scene.add("name = \"white\"\nfile = \"white.image.mp4\"\nmask = \"white.mask.mp4\"\nplace = [0.0, 0.0, 8.0]\nheight_m = 4.0\nlit = 0.0");
    let both = scene.at(0.5);
    let white = |x: u32| both.pixel(x, SIZE[1] / 2).min_element() > 0.9;
    let beside: Vec<u32> = (0..SIZE[0]).filter(|&x| white(x)).collect();
    assert!(beside.len() > 20 && beside.contains(&(SIZE[0] / 2 - 25)) && beside.contains(&(SIZE[0] / 2 + 25)), "{beside:?}");
    for x in SIZE[0] / 2 - 8..SIZE[0] / 2 + 8 {
        let (own, seen) = (alone.pixel(x, SIZE[1] / 2), both.pixel(x, SIZE[1] / 2));
        assert!(seen.abs_diff_eq(own, 0.02) && !white(x), "{x}: {seen}, not {own}");
    }
}

#[test]
fn a_film_hides_the_smoke_behind_it_where_it_is_and_nowhere_else() {
    if !ffmpeg() {
        return;
    }
    let mut scene = Scene::new(false, 1);
    // the left half of it is there
    scene.pair("half", 30, |_, x, _| if x < SIDE / 2 { [128, 0] } else { [0, 255] });
    scene.add("name = \"half\"\nfile = \"half.image.mp4\"\nmask = \"half.mask.mp4\"\nplace = [0.0, 0.0, 10.0]\nheight_m = 3.4\nlit = 0.0");
    let alone = scene.at(4.0);
    let text = "[site]\nname = \"a\"\n[[part]]\nfile = \"a.obj\"\n[sky]\nprobes = \"*.hdr\"\nmapping = \"lat-long\"\n\
                [[particles]]\nname = \"smoke\"\nkind = \"smoke\"\nplace = [0.0, 0.5, 7.0]\nextent = [2.0, 0.5, 0.2]\ndensity = 3.0\n";
    let smoke = Site::parse(text, "site.toml").unwrap().file().particles[0].clone();
    scene.renderer.app_mut().world_mut().resource_mut::<Particles>().add(&smoke);
    let both = scene.at(4.0);
    // between the middle's soft edge and the film's own
    let changed = |columns: std::ops::Range<u32>| {
        let places = columns.flat_map(|x| (20..SIZE[1] - 20).map(move |y| (x, y)));
        places.filter(|&(x, y)| !alone.pixel(x, y).abs_diff_eq(both.pixel(x, y), 0.01)).count()
    };
    let (hidden, seen) = (changed(SIZE[0] / 2 - 25..SIZE[0] / 2 - 3), changed(SIZE[0] / 2 + 3..SIZE[0] / 2 + 25));
    assert!(hidden == 0 && seen > 200, "{hidden} {seen}");
}
