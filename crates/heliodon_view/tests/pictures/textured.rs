//! Images on stone: as they hang, what was guessed of them, what photographs saw in their place.

use super::*;

/// The wall with a picture on it, white but for that, and the light of its vertices.
pub fn textured_wall(folder: &Path, texture: &SrgbImage) -> (LitChunk, Vec<Vec3>) {
    textured_wall_with(folder, texture, |_| {})
}

fn textured_wall_with(folder: &Path, texture: &SrgbImage, more: impl FnOnce(&mut BundleWriter)) -> (LitChunk, Vec<Vec3>) {
    let layout = LightLayout { sun_steps: 5, coefficients: 4, channels: 1, sun_bounce_functions: 0 };
    let plain = wall(layout);
    let chunk = LitChunk {
        texture: Some(0),
        // glTF's: the picture's first row is at v = 0.
        uvs: plain.positions.iter().map(|p| Vec2::new(1.0 + p.x, 1.0 - p.y) * 0.5).collect(),
        albedo: vec![Vec3::ONE; plain.positions.len()],
        ..plain
    };
    write_with(folder, layout, &chunk, Some(texture), more);
    let reader = BundleReader::open(folder).unwrap();
    let light = chunk_light(&Day::new(reader.lapse()).at(6.0 * 3600.0, Blend::Smooth), &chunk);
    (chunk, light)
}

#[test]
fn a_texture_hangs_upright_and_is_decoded() {
    let folder = tempfile::tempdir().unwrap();
    let bundle = folder.path().join("wall");
    let quadrants = [[[200, 10, 10, 255], [10, 188, 10, 255]], [[10, 10, 99, 255], [188, 188, 188, 255]]];
    let pixels = (0..64 * 64).map(|i| quadrants[i / 64 / 32][i % 64 / 32]).collect();
    let (chunk, light) = textured_wall(&bundle, &SrgbImage { width: 64, height: 64, pixels });
    let (picture, at) = picture_of_wall(&bundle, 1.0);
    let mut seen = 0;
    for (x, y) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))) {
        let at = at(x, y);
        if at.abs().min_element() < 0.06 {
            continue;
        }
        let [r, g, b, _] = quadrants[usize::from(at.y < 0.0)][usize::from(at.x > 0.0)];
        let colour = Vec3::from([r, g, b].map(|code| linear_from_srgb(f32::from(code) / 255.0)));
        let wanted = lit_wall(&chunk, &light, at) * colour;
        let got = picture.pixel(x, y);
        assert!((got - wanted).abs().max_element() <= 0.01 * wanted.max_element() + 2e-3, "{at}: {got} for {wanted}");
        seen += usize::from(wanted.max_element() > 0.05);
    }
    assert!(seen > 5000, "{seen} pixels are lit");
}

#[test]
fn what_is_guessed_is_blue_where_a_bundle_tells_it_and_only_when_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    // the left half was guessed, says its alpha
    let pixels = (0..64 * 64).map(|i| [188, 150, 100, if i % 64 < 32 { 128 } else { 255 }]).collect();
    let image = SrgbImage { width: 64, height: 64, pixels };
    for tells in [true, false] {
        let bundle = folder.path().join(if tells { "told" } else { "untold" });
        let (chunk, light) = textured_wall(&bundle, &image);
        if tells {
            let manifest = bundle.join("manifest.json");
            let text = std::fs::read_to_string(&manifest).unwrap();
            let (name, version) = ("\"name\": \"colours\",", "\"version\": 1,");
            assert!(text.contains(name) && text.contains(version), "{text}");
            let told = text.replace(name, &format!("{name} \"evidence\": true,")).replace(version, "\"version\": 6,");
            std::fs::write(&manifest, told).unwrap();
        }
        let mut renderer = Renderer::new(&bundle, SIZE, SIZE, RenderOptions { samples: 1 }).unwrap();
        let pose = Pose::looking(Vec3::new(0.0, 0.0, 1.25), Vec3::ZERO);
        let shot = Shot { pose, fov_deg: 60.0, ..renderer.home_shot(6.0 * 3600.0) };
        let mut picture = |shows: bool| {
            renderer.app_mut().world_mut().resource_mut::<StageFrame>().shows_guessed = shows;
            renderer.render_linear(&shot).unwrap()
        };
        let (asked, plain) = (picture(true), picture(false));
        assert!(picture(false) == plain);
        let half = 1.25 * 30f32.to_radians().tan();
        let colour = Vec3::from([188u8, 150, 100].map(|code| linear_from_srgb(f32::from(code) / 255.0)));
        for (x, y) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))) {
            let screen = (Vec2::new(x as f32, y as f32) + 0.5) / SIZE as f32 * 2.0 - 1.0;
            let at = Vec2::new(screen.x, -screen.y) * half;
            let lit = lit_wall(&chunk, &light, at);
            let close = |got: Vec3, wanted: Vec3| (got - wanted).abs().max_element() <= 0.01 * wanted.max_element() + 2e-3;
            assert!(close(plain.pixel(x, y), lit * colour), "{at}");
            if at.x.abs() > 0.06 {
                let guessed = tells && at.x < 0.0;
                let wanted = if guessed { colour.lerp(Vec3::new(0.03, 0.12, 0.55), 0.85) } else { colour };
                assert!(
                    close(asked.pixel(x, y), lit * wanted),
                    "{at}, told {tells}: {} for {}",
                    asked.pixel(x, y),
                    lit * wanted
                );
            }
        }
    }
}

/// What a photograph from a place saw of the wall: one colour, but nothing of the wall's left quarter.
fn photographed(color: [u8; 3], camera: Vec3) -> ViewLayer {
    let at = |i: u32| Vec2::new((i % 64) as f32 + 0.5, (i / 64) as f32 + 0.5) / 32.0 - 1.0;
    let toward = |i: u32| unit_or(camera - Vec3::new(at(i).x, -at(i).y, 0.0), Vec3::Z);
    let alpha = |i: u32| if i % 64 < 16 { 0 } else { 255 };
    let image = |pixel: &dyn Fn(u32) -> [u8; 4]| SrgbImage { width: 64, height: 64, pixels: (0..64 * 64).map(pixel).collect() };
    let [r, g, b] = color;
    ViewLayer { colors: image(&|i| [r, g, b, alpha(i)]), directions: image(&|i| direction_code(toward(i))) }
}

/// The direction of a layer at a place of the wall, read as a device reads it: the mean of the four nearest texels by how near they are.
fn direction_at(layer: &ViewLayer, at: Vec2) -> Vec3 {
    let texel = Vec2::new(1.0 + at.x, 1.0 - at.y) * 32.0 - 0.5;
    let (first, part) = (texel.floor(), texel - texel.floor());
    let taps = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| {
        let weight = (1.0 - part.x - x as f32 * (1.0 - 2.0 * part.x)) * (1.0 - part.y - y as f32 * (1.0 - 2.0 * part.y));
        let [x, y] = [first.x as i32 + x, first.y as i32 + y].map(|i| i.rem_euclid(64) as u32);
        let [a, b, c, _] = layer.directions.pixel(x, y);
        Vec3::new(f32::from(a), f32::from(b), f32::from(c)) * weight
    });
    unit_or(taps.into_iter().sum::<Vec3>() / 127.5 - 1.0, Vec3::Z)
}

#[test]
fn who_stands_where_a_photograph_was_taken_sees_what_it_saw() {
    let folder = tempfile::tempdir().unwrap();
    let bundle = folder.path().join("wall");
    let (front, beside) = (Vec3::new(0.0, 0.0, 1.25), Vec3::new(0.25, 0.1, 1.25));
    let cameras = [([200, 60, 30], front), ([20, 90, 210], beside)];
    let views = ViewLayers { layers: cameras.map(|(color, camera)| photographed(color, camera)).into() };
    let image = SrgbImage::filled(64, 64, [150, 150, 150, 255]);
    let (chunk, light) = textured_wall_with(&bundle, &image, |writer| writer.add_views(0, &views).unwrap());
    let linear = |[r, g, b]: [u8; 3]| Vec3::from([r, g, b].map(|code| linear_from_srgb(f32::from(code) / 255.0)));
    let mut renderer = Renderer::new(&bundle, SIZE, SIZE, RenderOptions { samples: 1 }).unwrap();
    let mut means = Vec::new();
    for (eye, patterns) in
        [(front, true), (beside, false), (front.lerp(beside, 0.5), true), (Vec3::new(-0.25, -0.2, 1.25), true)]
    {
        // what photographs saw is shown although details are switched off
        renderer.app_mut().world_mut().resource_mut::<StageFrame>().without_details = !patterns;
        let shot = Shot { pose: Pose::looking(eye, eye - Vec3::Z), fov_deg: 60.0, ..renderer.home_shot(6.0 * 3600.0) };
        let picture = renderer.render_linear(&shot).unwrap();
        let half = eye.z * 30f32.to_radians().tan();
        let mut mean = Vec3::ZERO;
        for (x, y) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))) {
            let screen = (Vec2::new(x as f32, y as f32) + 0.5) / SIZE as f32 * 2.0 - 1.0;
            let at = eye.truncate() + Vec2::new(screen.x, -screen.y) * half;
            let toward_eye = unit_or(eye - at.extend(0.0), Vec3::Z);
            // llvmpipe rounds filtered directions to codes again: either layer may be a code nearer to the eye or farther off
            let seen = |codes: [f32; 2]| {
                let layer = |i: usize| {
                    let direction = direction_at(&views.layers[i], at);
                    let moved = direction + unit_or(direction - toward_eye, Vec3::ZERO) * codes[i] / 127.5;
                    ViewSample { color: linear(cameras[i].0), weight: 1.0, direction: unit_or(moved, Vec3::Z) }
                };
                let both = [0, 1].map(layer);
                color(linear([150; 3]), if at.x < -0.5 { &[] } else { &both }, toward_eye)
            };
            let light = lit_wall(&chunk, &light, at);
            let nearly = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]].map(|codes| light * seen(codes));
            let (low, high) = nearly[1..].iter().fold((nearly[0], nearly[0]), |(low, high), c| (low.min(*c), high.max(*c)));
            mean += seen([0.0; 2]);
            // alpha is filtered over a texel
            if (at.x + 0.5).abs() > 0.06 {
                let (got, off) = (picture.pixel(x, y), 0.01 * high.max_element() + 2e-3);
                assert!(got.cmpge(low - off).all() && got.cmple(high + off).all(), "{eye}, {at}: {got} for {low} to {high}");
            }
        }
        means.push(mean / (SIZE * SIZE) as f32);
    }
    assert!(means[0].x > 2.0 * means[0].z && means[1].z > 2.0 * means[1].x, "{means:?}");
}

#[test]
fn a_texture_finer_than_pixels_is_averaged_in_linear_light() {
    let folder = tempfile::tempdir().unwrap();
    let bundle = folder.path().join("wall");
    let side = 1024;
    let pixels = (0..side * side).map(|i| if (i / side + i % side) % 2 == 0 { [0, 0, 0, 255] } else { [255; 4] }).collect();
    let (chunk, light) = textured_wall(&bundle, &SrgbImage { width: side, height: side, pixels });
    let (picture, at) = picture_of_wall(&bundle, 1.0);
    for (x, y) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))) {
        let wanted = lit_wall(&chunk, &light, at(x, y)) * linear_from_srgb(188.0 / 255.0);
        let got = picture.pixel(x, y);
        assert!((got - wanted).abs().max_element() <= 0.01 * wanted.max_element() + 2e-3, "{x} {y}: {got} for {wanted}");
    }
}
