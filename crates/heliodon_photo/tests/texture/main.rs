//! A simulated model is photographed, textured, and compared with what it was.
#![expect(clippy::unwrap_used, reason = "helpers of tests: a test that cannot go on has failed")]

#[path = "../common/mod.rs"]
mod common;
mod gaps;
mod scene;
mod stone;
mod turns;
mod views;

use glam::{Vec2, Vec3};
use heliodon_image::{Picture, SrgbImage, TextureWrap};
use heliodon_math::random::Pcg32;
use heliodon_mesh::Mesh;
use heliodon_photo::camera::Camera;
use heliodon_photo::model::Part;
use heliodon_photo::texture::{GUESSED, OUTSIDE, Photograph, SEEN, Survey, TextureError, TextureParams, Textured, texture};
use scene::{MAGENTA, World, albedo, cameras, encoded, look, model, new_view, panel, psnr_db, textured_color, true_gains};
use std::sync::LazyLock;

struct Bench {
    parts: Vec<Part>,
    panel: Mesh,
    cameras: Vec<Camera>,
    pictures: Vec<Picture>,
    /// The common factor that cannot be known: the mean of all gains.
    mean_gain: Vec3,
}

impl Bench {
    fn photographs(&self) -> Vec<Photograph<'_>> {
        let names = ["0", "1", "2", "3", "4", "5", "6", "7"];
        let all = names.iter().zip(&self.cameras).zip(&self.pictures);
        all.map(|((name, camera), picture)| Photograph { name, camera: *camera, picture }).collect()
    }

    fn textured(&self) -> Textured {
        let params = TextureParams { most_side: 1024, ..TextureParams::default() };
        texture(&self.parts, &[&self.panel], &self.photographs(), &params).unwrap()
    }
}

static BENCH: LazyLock<Bench> = LazyLock::new(|| {
    let (parts, panel, cameras) = (model(), panel(), cameras());
    let world = World::new(&parts, Some(&panel));
    let gains = true_gains();
    let pictures: Vec<Picture> = cameras.iter().zip(&gains).map(|(camera, gain)| world.photograph(camera, *gain)).collect();
    for (i, picture) in pictures.iter().enumerate() {
        if let Picture::Eight(image) = picture {
            look(&format!("photo-{i}.png"), image);
        }
    }
    let logs: Vec<Vec3> = gains.iter().map(|gain| gain.map(libm::logf)).collect();
    let mean_gain = (logs.iter().sum::<Vec3>() / logs.len() as f32).map(libm::expf);
    Bench { parts, panel, cameras, pictures, mean_gain }
});

static TEXTURED: LazyLock<Textured> = LazyLock::new(|| {
    let textured = BENCH.textured();
    look("atlas.png", &textured.atlas.image);
    look("evidence.png", &textured.evidence.image());
    textured
});

/// Places on the model, each with its texture coordinates and part.
fn probes(textured: &Textured) -> Vec<(Vec3, Vec2, usize)> {
    let mut random = Pcg32::new(11, 2);
    let mut all = Vec::new();
    for (part, mesh) in textured.meshes.iter().enumerate() {
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = mesh.corners(t);
            let count = (0.5 * (b - a).cross(c - a).length() * 1500.0) as usize + 1;
            let [p, q, r] = triangle.map(|v| mesh.uvs[v as usize]);
            for _ in 0..count {
                let (mut u, mut v) = (random.next_f32(), random.next_f32());
                if u + v > 1.0 {
                    (u, v) = (1.0 - u, 1.0 - v);
                }
                all.push((a + (b - a) * u + (c - a) * v, p + (q - p) * u + (r - p) * v, part));
            }
        }
    }
    all
}

fn code(textured: &Textured, uv: Vec2) -> u8 {
    let evidence = &textured.evidence;
    let cell = |x: f32, count: u32| ((x * count as f32) as u32).min(count - 1);
    evidence.codes[(cell(uv.y, evidence.height) * evidence.width + cell(uv.x, evidence.width)) as usize]
}

fn color(textured: &Textured, uv: Vec2) -> Vec3 {
    textured.atlas.image.sample_bilinear(uv.x, uv.y, [TextureWrap::Clamp; 2]).truncate()
}

#[test]
fn texels_have_the_colours_of_what_was_photographed() {
    let (bench, textured) = (&*BENCH, &*TEXTURED);
    textured.meshes.iter().for_each(|mesh| mesh.validate().unwrap());
    let seen: Vec<(Vec3, Vec2, usize)> = probes(textured).into_iter().filter(|p| code(textured, p.1) == SEEN).collect();
    let pairs = seen.iter().map(|(place, uv, _)| (color(textured, *uv), albedo(*place) * bench.mean_gain));
    let of_all = psnr_db(pairs);
    for part in 0..bench.parts.len() {
        let own = seen.iter().filter(|p| p.2 == part);
        let db = psnr_db(own.map(|(place, uv, _)| (color(textured, *uv), albedo(*place) * bench.mean_gain)));
        println!("{}: {db:.1} dB over its seen texels", bench.parts[part].name);
        assert!(db >= 28.0, "{}: {db:.1} dB", bench.parts[part].name);
    }
    println!("all: {of_all:.1} dB over {} seen places", seen.len());
    assert!(of_all >= 30.0, "{of_all:.1} dB");
}

#[test]
fn gains_are_recovered() {
    let (bench, textured) = (&*BENCH, &*TEXTURED);
    for (found, truth) in textured.gains.iter().zip(true_gains()) {
        let ratio = found.gain * bench.mean_gain / truth;
        assert!((ratio - Vec3::ONE).abs().max_element() < 0.01, "{}: {ratio}", found.photograph);
        assert!(found.compared_with >= 4 && found.residual < 0.01, "{found:?}");
    }
}

#[test]
fn a_new_view_looks_as_it_truly_does() {
    let (bench, textured) = (&*BENCH, &*TEXTURED);
    let camera = new_view();
    let world = World::new(&bench.parts, None);
    let truth = world.render(&camera, 3, |_, p| albedo(p) * bench.mean_gain);
    let found = world.render(&camera, 3, |hit, _| textured_color(&textured.meshes, hit));
    let image = |pixels: &[(Vec3, bool)]| SrgbImage {
        width: camera.intrinsics.width,
        height: camera.intrinsics.height,
        pixels: pixels.iter().map(|p| encoded(p.0)).collect(),
    };
    look("new-view.png", &image(&found));
    look("new-view-true.png", &image(&truth));
    let model = truth.iter().zip(&found).filter(|(truth, _)| truth.1);
    let db = psnr_db(model.map(|(truth, found)| (truth.0, found.0)));
    println!("new view: {db:.1} dB");
    assert!(db >= 28.0, "{db:.1} dB");
}

#[test]
fn what_stands_in_the_way_leaves_no_colour_behind() {
    let (bench, textured) = (&*BENCH, &*TEXTURED);
    let towards = |color: Vec3, place: Vec3| {
        let truth = albedo(place) * bench.mean_gain;
        // how far the colour is on the way from the truth to the panel's
        (color - truth).dot(MAGENTA - truth) / (MAGENTA - truth).length_squared()
    };
    let seen = probes(textured).into_iter().filter(|p| code(textured, p.1) == SEEN);
    let worst = seen.map(|(place, uv, _)| towards(color(textured, uv), place)).fold(0.0, f32::max);
    assert!(worst < 0.25, "{worst}");
    // the panel is in the pictures, before the block's front
    let panel_px: usize = bench
        .pictures
        .iter()
        .filter_map(|picture| match picture {
            Picture::Eight(image) => Some(image),
            Picture::Hdr(_) => None,
        })
        .map(|image| image.pixels.iter().filter(|p| p[0] > p[1].saturating_add(120) && p[2] > p[1].saturating_add(120)).count())
        .sum();
    assert!(panel_px > 3000, "{panel_px}");
    // if nobody knew of it, it would leave its colour: three see the front, and one of them through it
    let without = texture(&bench.parts, &[], &bench.photographs()[..3], &TextureParams::preview()).unwrap();
    let left = probes(&without).into_iter().filter(|p| code(&without, p.1) == SEEN);
    let left = left.filter(|(place, uv, _)| towards(color(&without, *uv), *place) > 0.5).count();
    assert!(left > 20, "the test would notice: {left}");
}

#[test]
fn what_no_photograph_saw_is_marked_and_plain() {
    let (bench, textured) = (&*BENCH, &*TEXTURED);
    assert_eq!(textured.evidence.codes.len(), textured.atlas.image.pixels.len());
    let has = |code: u8| textured.evidence.codes.contains(&code);
    assert!(has(OUTSIDE) && has(GUESSED) && has(SEEN));
    let face = |part: usize, downwards: bool| {
        let of_part = textured.faces.iter().filter(move |face| face.part == part);
        of_part
            .filter(|face| {
                let t = bench.parts[part].face.iter().position(|f| *f == face.face).unwrap();
                let [a, b, c] = bench.parts[part].mesh.corners(t);
                let normal = (b - a).cross(c - a);
                downwards == (normal.y < -0.9 * normal.length())
            })
            .collect::<Vec<_>>()
    };
    for part in [0, 1] {
        assert_eq!(face(part, true).len(), 1);
        assert!(face(part, true).iter().all(|face| face.seen == 0.0), "undersides lie on the floor");
        // the column's top is above most cameras, and seen too flatly by the others
        let seen = face(part, false).into_iter().filter(|face| face.seen > 0.85).count();
        assert_eq!(seen, face(part, false).len() - part, "{:?}", face(part, false));
    }
    assert!(textured.seen > 0.75 && textured.seen < 0.99, "{}", textured.seen);
    for (_, uv, part) in probes(textured).into_iter().filter(|p| code(textured, p.1) == GUESSED) {
        let guessed = color(textured, uv);
        assert!((guessed - Vec3::new(0.55, 0.45, 0.33)).abs().max_element() < 0.35, "{part}: {guessed}");
    }
}

/// A small block in the middle of the large one, and one that stands halfway out of it to the east.
#[test]
fn what_lies_inside_of_something_gets_no_texels() {
    let bench = &*BENCH;
    let photographs = bench.photographs();
    let made = |shift_m: Option<f32>| {
        let mut parts = bench.parts.clone();
        if let Some(shift_m) = shift_m {
            let mut small = parts[0].clone();
            let middle = small.mesh.positions.iter().sum::<Vec3>() / small.mesh.positions.len() as f32;
            let to = middle + Vec3::new(shift_m, 0.0, 0.0);
            small.mesh.positions.iter_mut().for_each(|p| *p = to + (*p - middle) * 0.5);
            small.flat.iter_mut().flatten().for_each(|p| *p *= 0.5);
            small.name = "small".into();
            parts.push(small);
        }
        let params = TextureParams { most_side: 512, ..TextureParams::default() };
        texture(&parts, &[&bench.panel], &photographs, &params).unwrap()
    };
    let (alone, inside, out) = (made(None), made(Some(0.0)), made(Some(1.2)));
    let buried =
        |textured: &Textured| textured.faces.iter().filter(|face| face.buried).map(|face| face.part).collect::<Vec<_>>();
    assert_eq!((buried(&alone), buried(&inside), buried(&out)), (vec![], vec![3; 6], vec![3]));
    assert!((inside.seen - alone.seen).abs() < 0.002, "{} {}", inside.seen, alone.seen);
    let per_m = |textured: &Textured| {
        textured.faces.iter().filter(|f| f.part == 0 && f.seen > 0.0).map(|f| f.texels_per_m).fold(0.0, f32::max)
    };
    assert!(per_m(&inside) > 0.98 * per_m(&alone), "{} {}", per_m(&inside), per_m(&alone));
}

#[test]
fn who_walked_by_is_outvoted() {
    // the panel is not told: a few photographs show it, most do not
    let bench = &*BENCH;
    let params = TextureParams { most_side: 1024, ..TextureParams::default() };
    let textured = texture(&bench.parts, &[], &bench.photographs(), &params).unwrap();
    let front = probes(&textured).into_iter().filter(|(place, ..)| place.z > 0.39 && place.z < 0.41 && place.y > 0.1);
    let pink = |(place, uv, _): &(Vec3, Vec2, usize)| {
        let truth = albedo(*place) * bench.mean_gain;
        (color(&textured, *uv) - truth).dot(MAGENTA - truth) / (MAGENTA - truth).length_squared()
    };
    let mut all: Vec<f32> = front.map(|probe| pink(&probe)).collect();
    all.sort_by(f32::total_cmp);
    let [most, worst] = [0.95, 0.99].map(|part| all[((all.len() - 1) as f32 * part) as usize]);
    println!("of a panel nobody told of: {most:.3} at 95 %, {worst:.3} at 99 %");
    assert!(most < 0.1, "{most} {worst}");
}

#[test]
fn a_camera_half_a_pixel_off_does_little_harm() {
    let bench = &*BENCH;
    let mut photographs = bench.photographs();
    for (i, photograph) in photographs.iter_mut().enumerate() {
        let off = [0.5, -0.5][i % 2] / photograph.camera.intrinsics.focal_px[0];
        let turn = glam::DQuat::from_scaled_axis(glam::DVec3::new(off, -off, 0.5 * off));
        photograph.camera.pose.rotation = turn * photograph.camera.pose.rotation;
        photograph.camera.pose.translation = turn * photograph.camera.pose.translation;
    }
    let params = TextureParams { most_side: 1024, ..TextureParams::default() };
    let textured = texture(&bench.parts, &[&bench.panel], &photographs, &params).unwrap();
    look("atlas-half-a-pixel-off.png", &textured.atlas.image);
    let seen = probes(&textured).into_iter().filter(|p| code(&textured, p.1) == SEEN);
    let db = psnr_db(seen.map(|(place, uv, _)| (color(&textured, uv), albedo(place) * bench.mean_gain)));
    println!("half a pixel off: {db:.1} dB");
    assert!(db >= 28.0, "{db:.1} dB");
}

#[test]
fn from_a_photographs_own_place_its_word_counts() {
    let bench = &*BENCH;
    let photographs = bench.photographs();
    // not made equally bright, so that each photograph's own brightness tells whose word it is
    let survey = Survey::new(&bench.parts, &[&bench.panel], &photographs, &TextureParams::preview()).unwrap();
    let places: Vec<(Vec3, Vec3)> = survey.places().collect();
    let gains = true_gains();
    for photograph in [0, 5] {
        let eye = bench.cameras[photograph].centre().as_vec3();
        let colors = survey.blended_from(eye);
        let own = survey.samples()[photograph].iter().filter(|sample| sample.tells && sample.weight > 0.0);
        let off = own.filter_map(|sample| {
            let truth = albedo(places[sample.texel as usize].0) * gains[photograph];
            colors[sample.texel as usize].map(|found| ((found - truth) / truth).abs().max_element())
        });
        let mut off: Vec<f32> = off.collect();
        off.sort_by(f32::total_cmp);
        let median = off[off.len() / 2];
        assert!(median < 0.06, "{photograph}: {median}");
    }
}

#[test]
fn a_mesh_from_elsewhere_is_textured_too() {
    let bench = &*BENCH;
    let parts: Vec<Part> = bench.parts.iter().map(|part| Part::from_mesh(&part.name, &part.mesh).unwrap()).collect();
    assert_eq!(parts[0].smooth.len(), 6);
    assert!(parts[0].watertight && parts[1].watertight && !parts[2].watertight);
    assert!(parts[1].smooth.len() < 16, "a column of 24 sides and two ends: {}", parts[1].smooth.len());
    let params = TextureParams { most_side: 1024, ..TextureParams::default() };
    let textured = texture(&parts, &[&bench.panel], &bench.photographs(), &params).unwrap();
    let seen = probes(&textured).into_iter().filter(|p| code(&textured, p.1) == SEEN);
    let db = psnr_db(seen.map(|(place, uv, _)| (color(&textured, uv), albedo(place) * bench.mean_gain)));
    println!("a mesh from elsewhere: {db:.1} dB");
    assert!(db >= 30.0, "{db:.1} dB");
}

#[test]
fn the_same_comes_out_whatever_the_threads() {
    let bench = &*BENCH;
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| texture(&bench.parts, &[&bench.panel], &bench.photographs()[..4], &TextureParams::preview()).unwrap())
    };
    let (one, three) = (run(1), run(3));
    assert_eq!(one.linear, three.linear);
    assert_eq!(one.evidence, three.evidence);
    assert_eq!(one.gains, three.gains);
}

#[test]
fn bad_input_is_refused_in_words() {
    let bench = &*BENCH;
    let params = TextureParams::preview();
    let photographs = bench.photographs();
    let told = |result: Result<Textured, TextureError>| result.unwrap_err().to_string();
    assert!(told(texture(&[], &[], &photographs, &params)).contains("no triangles"));
    assert!(told(texture(&bench.parts, &[], &[], &params)).contains("no photograph"));
    let wrong = TextureParams { grazing_deg: 90.0, ..params.clone() };
    assert!(told(texture(&bench.parts, &[], &photographs, &wrong)).contains("grazing_deg"));
    let mut scaled = photographs[..1].to_vec();
    scaled[0].camera.intrinsics.width = 100;
    assert!(told(texture(&bench.parts, &[], &scaled, &params)).contains("100 x 405"));
    let mut away = photographs[..1].to_vec();
    away[0].camera.pose.translation.z -= 1000.0;
    assert!(told(texture(&bench.parts, &[], &away, &params)).contains("no photograph sees"));
    let mut broken = bench.parts.clone();
    broken[0].flat.pop();
    assert!(told(texture(&broken, &[], &photographs, &params)).contains("block"));
}
