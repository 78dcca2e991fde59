//! Colours that depend on the view: a surface whose colours turn with the eye.

use crate::scene::{World, albedo, cameras, encoded, look, model, psnr_db};
use glam::{Vec2, Vec3};
use heliodon_image::view_layers::{MOST_LAYERS, ViewLayer, ViewLayers, ViewSample, color};
use heliodon_image::{Picture, SrgbImage};
use heliodon_math::frame::unit_or;
use heliodon_photo::camera::Camera;
use heliodon_photo::model::Part;
use heliodon_photo::texture::{PhotoGain, Photograph, Survey, TextureParams, Textured};
use heliodon_rays::Hit;

/// Stone with ribs whose two sides have two tones, more than anything else differs: which of them an eye sees turns with it.
fn seen_from(eye: Vec3, p: Vec3) -> Vec3 {
    let toward = unit_or(eye - p, Vec3::Y);
    let across = libm::sinf(4.0 * (p.x + 0.7 * p.y - p.z));
    let side = (toward.x + 0.6 * toward.z) * across;
    // bright enough to be seen, not so bright that a photograph would end
    albedo(p) * (Vec3::splat(0.75) + Vec3::new(0.4, 0.0, -0.4) * side.clamp(-1.0, 1.0))
}

struct Ribs {
    parts: Vec<Part>,
    world: World,
    cameras: Vec<Camera>,
    pictures: Vec<Picture>,
}

impl Ribs {
    fn new() -> Self {
        let (parts, cameras) = (model(), cameras());
        let world = World::new(&parts, None);
        let picture = |camera: &Camera| {
            let eye = camera.centre().as_vec3();
            let pixels = world.render(camera, 3, |_, p| seen_from(eye, p)).into_iter().map(|(c, _)| encoded(c)).collect();
            Picture::Eight(SrgbImage { width: camera.intrinsics.width, height: camera.intrinsics.height, pixels })
        };
        let pictures = cameras.iter().map(picture).collect();
        Self { parts, world, cameras, pictures }
    }

    /// How well what is drawn is what each photograph's eye sees of the model, decibels: of the worst, in the mean and of the best. Photographs are taken to be
    /// so many times as bright as what is drawn.
    fn judged(&self, name: &str, gains: &[PhotoGain], drawn: impl Fn(Vec3, &Hit, Vec3) -> Vec3 + Sync) -> [f64; 3] {
        let one = |(i, camera): (usize, &Camera)| {
            let eye = camera.centre().as_vec3();
            let truth = self.world.render(camera, 1, |_, p| seen_from(eye, p) / gains[i].gain);
            let found = self.world.render(camera, 1, |hit, p| drawn(eye, hit, p));
            let [width, height] = [camera.intrinsics.width, camera.intrinsics.height];
            look(
                &format!("{name}-{i}.png"),
                &SrgbImage { width, height, pixels: found.iter().map(|p| encoded(p.0)).collect() },
            );
            let model = truth.iter().zip(&found).filter(|(truth, _)| truth.1);
            psnr_db(model.map(|(truth, found)| (truth.0, found.0)))
        };
        let mut all: Vec<f64> = self.cameras.iter().enumerate().map(one).collect();
        all.sort_by(f64::total_cmp);
        [all[0], all.iter().sum::<f64>() / all.len() as f64, all[all.len() - 1]]
    }
}

/// Where a hit is in the atlas, from 0 to 1.
fn uv(textured: &Textured, hit: &Hit) -> Vec2 {
    let mut t = hit.triangle as usize;
    for mesh in &textured.meshes {
        if t < mesh.triangles.len() {
            let [a, b, c] = mesh.triangles[t].map(|v| mesh.uvs[v as usize]);
            return a + (b - a) * hit.u + (c - a) * hit.v;
        }
        t -= mesh.triangles.len();
    }
    panic!("a hit of the model");
}

/// A layer between the texels about a place, as a graphics card reads it.
fn filtered(layer: &ViewLayer, uv: Vec2) -> ViewSample {
    let size = Vec2::new(layer.colors.width as f32, layer.colors.height as f32);
    let at = (uv * size - 0.5).clamp(Vec2::ZERO, size - 1.001);
    let (first, part) = (at.floor(), at.fract());
    let mut sum = ViewSample { color: Vec3::ZERO, weight: 0.0, direction: Vec3::ZERO };
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let sample = layer.sample(first.x as u32 + dx, first.y as u32 + dy);
        let share = [1.0 - part.x, part.x][dx as usize] * [1.0 - part.y, part.y][dy as usize];
        sum.color += sample.color * share;
        sum.weight += sample.weight * share;
        sum.direction += sample.direction * share;
    }
    ViewSample { direction: unit_or(sum.direction, Vec3::Z), ..sum }
}

fn shown(textured: &Textured, views: &ViewLayers, eye: Vec3, hit: &Hit, p: Vec3) -> Vec3 {
    let uv = uv(textured, hit);
    let plain = textured.atlas.image.sample_bilinear(uv.x, uv.y, textured.atlas.wrap).truncate();
    let samples: Vec<ViewSample> = views.layers.iter().map(|layer| filtered(layer, uv)).collect();
    color(plain, &samples, unit_or(eye - p, Vec3::Y))
}

#[test]
fn from_a_photographs_place_layers_show_what_it_saw_and_the_atlas_does_not() {
    let ribs = Ribs::new();
    let names: Vec<String> = (0..8).map(|i| i.to_string()).collect();
    let all = names.iter().zip(&ribs.cameras).zip(&ribs.pictures);
    let photographs: Vec<Photograph> =
        all.map(|((name, camera), picture)| Photograph { name, camera: *camera, picture }).collect();
    let params = TextureParams { most_side: 1024, ..TextureParams::default() };
    let mut survey = Survey::new(&ribs.parts, &[], &photographs, &params).unwrap();
    let gains = survey.equalize();
    let textured = survey.painted(&survey.blended(), gains.clone());
    let plain = ribs.judged("views-0", &gains, |eye, hit, p| shown(&textured, &ViewLayers::default(), eye, hit, p));
    println!("the atlas alone, from photographs' places: {plain:.1?} dB");
    let mut last = plain[1];
    for count in [1, 2, 4, MOST_LAYERS] {
        let views = survey.view_layers(count);
        views.validate().unwrap();
        assert!(views.layers.len() <= count);
        assert_eq!(views.size(), [textured.atlas.image.width, textured.atlas.image.height]);
        for (i, layer) in views.layers.iter().enumerate() {
            let opaque = |p: &[u8; 4]| [p[0], p[1], p[2], 255];
            let pixels = layer.colors.pixels.iter().map(opaque).collect();
            look(&format!("layer-{i}-of-{count}-colors.png"), &SrgbImage { pixels, ..layer.colors });
            look(&format!("layer-{i}-of-{count}-directions.png"), &layer.directions);
        }
        let found = ribs.judged(&format!("views-{count}"), &gains, |eye, hit, p| shown(&textured, &views, eye, hit, p));
        println!("{count} layers: {found:.1?} dB");
        assert!(found[1] > last, "more layers know more");
        last = found[1];
        if count == MOST_LAYERS {
            // all that see a face: each photograph's own colours are there, and the atlas' are not
            assert!(found[0] > 30.0 && found[0] > plain[2], "{found:?} {plain:?}");
        }
    }
}
