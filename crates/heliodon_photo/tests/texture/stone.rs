//! Stone's own colour from photographs of three hours, with the sun where a model puts it: a little beside where it was.

use crate::scene::{World, albedo, cameras, encoded, look, model, new_view};
use glam::Vec3;
use heliodon_image::{HdrImage, Picture, SrgbImage, TextureWrap};
use heliodon_math::random::Pcg32;
use heliodon_photo::albedo::{Albedo, AlbedoError, AlbedoParams, solve};
use heliodon_photo::model::Part;
use heliodon_photo::texture::{Photograph, Survey, TextureParams, Textured};
use heliodon_rays::{Hit, Ray};
use heliodon_testkit::flip::mean_flip;

/// Morning, noon and afternoon, and a fourth hour that no photograph shows.
const HOURS: [Vec3; 4] =
    [Vec3::new(0.8, 0.55, 0.3), Vec3::new(0.1, 0.9, 0.45), Vec3::new(-0.7, 0.5, 0.35), Vec3::new(0.45, 0.7, 0.5)];
const SUN: Vec3 = Vec3::new(1.0, 0.93, 0.8);
const SKY: Vec3 = Vec3::new(0.22, 0.27, 0.36);
/// How much of the mean albedo comes back from all around.
const BOUNCE: f32 = 0.25;

fn unit(v: Vec3) -> Vec3 {
    v.try_normalize().unwrap()
}

/// The sun of an hour where the model has it: a quarter of a degree off.
fn modelled(hour: usize) -> Vec3 {
    unit(unit(HOURS[hour]) + Vec3::new(0.003, 0.0, -0.003))
}

/// Irradiance over pi.
fn light(world: &World, place: Vec3, normal: Vec3, sun: Vec3, mean_albedo: Vec3) -> Vec3 {
    let mut occluded = [0];
    let origin = place + normal * 0.002;
    world.scene.occluded(&[Ray { origin, direction: sun, t_min: 0.0, t_max: f32::INFINITY }], &mut occluded);
    let facing = if occluded[0] == 0 { normal.dot(sun).max(0.0) } else { 0.0 };
    SUN * facing + SKY * (0.5 + 0.5 * normal.y) + (SUN + SKY) * mean_albedo * BOUNCE
}

/// The mean albedo of the floor, which is what light bounces off.
fn mean_true_albedo() -> Vec3 {
    let mut random = Pcg32::new(7, 7);
    let mut place = || Vec3::new(random.range_f32(-3.5, 3.5), 0.0, random.range_f32(-3.5, 3.5));
    (0..50_000).map(|_| albedo(place())).sum::<Vec3>() / 50_000.0
}

struct Yard {
    parts: Vec<Part>,
    world: World,
    mean: Vec3,
    pictures: Vec<Picture>,
}

fn normal_of(parts: &[Part], hit: &Hit) -> Vec3 {
    let mut t = hit.triangle as usize;
    for part in parts {
        if t < part.mesh.triangles.len() {
            let [a, b, c] = part.mesh.corners(t);
            return unit((b - a).cross(c - a));
        }
        t -= part.mesh.triangles.len();
    }
    Vec3::Y
}

fn yard() -> Yard {
    let parts = model();
    let world = World::new(&parts, None);
    let mean = mean_true_albedo();
    let mut random = Pcg32::new(4, 4);
    let pictures = cameras()
        .iter()
        .enumerate()
        .map(|(i, camera)| {
            let exposure = [1.0, 1.3, 0.8, 1.1, 0.7, 1.0, 1.2, 0.9][i];
            let sun = unit(HOURS[i % 3]);
            let shade = |hit: &Hit, p: Vec3| albedo(p) * light(&world, p, normal_of(&parts, hit), sun, mean);
            let pixels = world.render(camera, 2, shade).into_iter();
            let noisy = pixels.map(|(color, _)| color * exposure * (1.0 + 0.02 * (random.next_f32() - 0.5))).collect();
            Picture::Hdr(HdrImage { width: camera.intrinsics.width, height: camera.intrinsics.height, pixels: noisy })
        })
        .collect();
    Yard { parts, world, mean, pictures }
}

fn solved(yard: &Yard, survey: &Survey, params: &AlbedoParams, asked: &mut u32) -> Result<Albedo, AlbedoError> {
    let places: Vec<(Vec3, Vec3)> = survey.places().collect();
    let bake = |albedo: &[Vec3]| {
        *asked += 1;
        let floor = places.iter().zip(albedo).filter(|((place, _), _)| place.y.abs() < 1e-4).map(|(_, albedo)| *albedo);
        let mean = floor.clone().sum::<Vec3>() / floor.count() as f32;
        let of_photograph = |(i, own): (usize, &Vec<heliodon_photo::texture::Sample>)| {
            let at = |sample: &heliodon_photo::texture::Sample| {
                let (place, normal) = places[sample.texel as usize];
                light(&yard.world, place, normal, modelled(i % 3), mean)
            };
            own.iter().map(at).collect()
        };
        Ok(survey.samples().iter().enumerate().map(of_photograph).collect())
    };
    solve(places.len(), survey.samples(), survey.names(), &survey.around(0.06), params, bake)
}

/// How far albedo is off, as a part, of all texels and of those by the edge of a shadow in any photograph.
fn errors(yard: &Yard, survey: &Survey, found: &Albedo) -> [Vec<f32>; 2] {
    let places: Vec<(Vec3, Vec3)> = survey.places().collect();
    let around = survey.around(0.06);
    let shadow = |hour: usize| -> Vec<bool> {
        let at = |(place, normal): &(Vec3, Vec3)| {
            light(&yard.world, *place, *normal, modelled(hour), Vec3::ZERO).x
                < 0.5 * SUN.x * normal.dot(modelled(hour)).max(0.0)
        };
        places.iter().map(at).collect()
    };
    let shadows = [0, 1, 2].map(shadow);
    let mut all = [Vec::new(), Vec::new()];
    for (i, found) in found.albedo.iter().enumerate().filter_map(|(i, found)| found.map(|found| (i, found))) {
        let truth = albedo(places[i].0);
        let error = ((found - truth).abs() / truth).max_element();
        all[0].push(error);
        if shadows.iter().any(|shadow| around.of(i).iter().any(|&other| shadow[other as usize] != shadow[i])) {
            all[1].push(error);
        }
    }
    all.iter_mut().for_each(|errors| errors.sort_by(f32::total_cmp));
    all
}

fn at(errors: &[f32], part: f32) -> f32 {
    errors[((errors.len() - 1) as f32 * part) as usize]
}

#[test]
fn albedo_is_found_and_shadows_leave_no_edge() {
    let yard = yard();
    let cameras = cameras();
    let names: Vec<String> = (0..8).map(|i| format!("{i}.jpg")).collect();
    let all = names.iter().zip(&cameras).zip(&yard.pictures);
    let photographs: Vec<Photograph> =
        all.map(|((name, camera), picture)| Photograph { name, camera: *camera, picture }).collect();
    let params = TextureParams { most_side: 1024, oversampling: 1.0, ..TextureParams::default() };
    let survey = Survey::new(&yard.parts, &[], &photographs, &params).unwrap();
    let mut asked = 0;
    // somebody measured the mean of what was seen
    let places: Vec<(Vec3, Vec3)> = survey.places().collect();
    let mut is_seen = vec![false; places.len()];
    survey.samples().iter().flatten().for_each(|sample| is_seen[sample.texel as usize] = true);
    let seen = places.iter().zip(is_seen).filter(|(_, is_seen)| *is_seen).map(|(place, _)| albedo(place.0));
    let mean = seen.clone().sum::<Vec3>() / seen.count() as f32;
    let params = AlbedoParams { exposures_unknown: true, mean: Some(mean), ..AlbedoParams::default() };
    let found = solved(&yard, &survey, &params, &mut asked).unwrap();
    let [all, edges] = errors(&yard, &survey, &found);
    let of_naive = AlbedoParams { most_change: f32::INFINITY, pixel_error: 100.0, ..params.clone() };
    let naive = solved(&yard, &survey, &of_naive, &mut 0).unwrap();
    let [naive_all, naive_edges] = errors(&yard, &survey, &naive);
    println!(
        "albedo: median {:.4}, 95 % {:.4}; by shadows' edges {:.4}, {:.4} ({} texels); all photographs alike {:.4}, {:.4}; {:.4}, {:.4}",
        at(&all, 0.5),
        at(&all, 0.95),
        at(&edges, 0.5),
        at(&edges, 0.95),
        edges.len(),
        at(&naive_all, 0.5),
        at(&naive_all, 0.95),
        at(&naive_edges, 0.5),
        at(&naive_edges, 0.95)
    );
    println!("{:?}", found.agreement.iter().map(|a| (a.median, a.percentile_95, a.by_edges)).collect::<Vec<_>>());
    let painted = survey.painted(&found.albedo, found.gains.clone());
    look("albedo.png", &painted.atlas.image);
    look("albedo-naive.png", &survey.painted(&naive.albedo, Vec::new()).atlas.image);
    assert!(at(&all, 0.5) < 0.05 && at(&all, 0.95) < 0.15, "{} {}", at(&all, 0.5), at(&all, 0.95));
    assert!(edges.len() > 1000);
    assert!(at(&edges, 0.5) < 0.05 && at(&edges, 0.95) < 0.1, "{} {}", at(&edges, 0.5), at(&edges, 0.95));
    assert!(at(&naive_edges, 0.95) > 1.6 * at(&edges, 0.95), "the test would notice");
    assert_eq!(asked, found.rounds);
    assert!(found.rounds > 1 && found.rounds < 8 && found.change < params.settled, "{} {}", found.rounds, found.change);
    assert!(found.agreement.iter().all(|a| a.median < 0.03 && a.texels > 1000), "{:?}", found.agreement);
    assert!(found.agreement.iter().any(|a| a.by_edges > 100));
    let flip = relit(&yard, &painted);
    println!("relit at a fourth hour: mean FLIP {flip:.4}");
    assert!(flip < 0.08, "{flip}");
}

/// How much a new view at a new hour differs from the truth.
fn relit(yard: &Yard, painted: &Textured) -> f32 {
    let camera = new_view();
    let sun = unit(HOURS[3]);
    let color = |hit: &Hit| {
        let mut t = hit.triangle as usize;
        for mesh in &painted.meshes {
            if t < mesh.triangles.len() {
                let [a, b, c] = mesh.triangles[t].map(|v| mesh.uvs[v as usize]);
                let uv = a + (b - a) * hit.u + (c - a) * hit.v;
                return painted.atlas.image.sample_bilinear(uv.x, uv.y, [TextureWrap::Clamp; 2]).truncate();
            }
            t -= mesh.triangles.len();
        }
        Vec3::ZERO
    };
    let of_light = |hit: &Hit, p: Vec3| light(&yard.world, p, normal_of(&yard.parts, hit), sun, yard.mean);
    let truth = yard.world.render(&camera, 2, |hit, p| albedo(p) * of_light(hit, p));
    let found = yard.world.render(&camera, 2, |hit, p| color(hit) * of_light(hit, p));
    let [width, height] = [camera.intrinsics.width, camera.intrinsics.height];
    let [truth, found] = [truth, found].map(|pixels| pixels.iter().map(|p| encoded(p.0)).collect::<Vec<[u8; 4]>>());
    look("relit.png", &SrgbImage { width, height, pixels: found.clone() });
    look("relit-true.png", &SrgbImage { width, height, pixels: truth.clone() });
    let [truth, found] = [truth, found].map(|pixels| pixels.iter().map(|p| [p[0], p[1], p[2]]).collect::<Vec<[u8; 3]>>());
    mean_flip(&truth, &found, width, height)
}

#[test]
fn light_that_is_none_is_refused() {
    let sample = |texel| heliodon_photo::texture::Sample { texel, color: Vec3::splat(0.4), weight: 1.0, tells: true };
    let samples = vec![vec![sample(0), sample(2)]];
    let around = heliodon_photo::texture::Around { starts: vec![0; 4], texels: Vec::new() };
    let params = AlbedoParams::default();
    let run = |samples: &[Vec<_>], light: Vec<Vec<Vec3>>| solve(3, samples, &["a"], &around, &params, |_| Ok(light.clone()));
    let found = run(&samples, vec![vec![Vec3::splat(0.8), Vec3::splat(0.2)]]).unwrap();
    assert!((found.albedo[0].unwrap() - Vec3::splat(0.5)).abs().max_element() < 1e-5);
    assert_eq!((found.albedo[1], found.albedo[2], found.above_one), (None, Some(Vec3::ONE), 1));
    assert!(matches!(run(&samples, vec![vec![Vec3::ONE]]), Err(AlbedoError::Length { .. })));
    assert!(matches!(run(&samples, vec![vec![Vec3::ONE, Vec3::NAN]]), Err(AlbedoError::Light { photograph: 0, sample: 1 })));
    assert!(matches!(run(&samples, vec![vec![Vec3::ZERO; 2]]), Err(AlbedoError::Nothing)));
    assert!(matches!(run(&[vec![sample(2), sample(1)]], vec![]), Err(AlbedoError::Order { photograph: 0 })));
    let bake = solve(3, &samples, &["a"], &around, &params, |_| Err("no sky".into()));
    assert_eq!(bake, Err(AlbedoError::Bake("no sky".into())));
}
