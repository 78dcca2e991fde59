//! Details and covers on every kind of stone, in one pass for both eyes and in two.

use super::*;

/// The wall with a detail, of every kind of stone, and whether its detail goes by texture coordinates.
fn detailed_walls(layout: LightLayout) -> [(&'static str, LitChunk, Option<SrgbImage>, Detail); 5] {
    let stone = || Detail { size_m: Some(3.0), near_m: 1.35, strength: 0.9, ..Detail::of_kind(DetailPattern::Stone) };
    let uvs = |wall: &LitChunk| wall.positions.iter().map(|p| Vec2::new(1.0 + p.x, 1.0 - p.y) * 0.5).collect::<Vec<_>>();
    let textured =
        |wall: LitChunk| LitChunk { texture: Some(0), uvs: uvs(&wall), albedo: vec![Vec3::ONE; wall.positions.len()], ..wall };
    // with 2.9 texels a pixel, where the detail has 3.8: half as dense would be full, as dense would be none
    let dense = Some(SrgbImage::filled(384, 384, [188, 150, 120, 255]));
    let coarse = Some(SrgbImage::filled(32, 32, [120, 150, 188, 255]));
    let by_uv = Detail { mapping: DetailMapping::Uv, size_m: None, repeat: Some(2.0), ..stone() };
    let wood =
        Detail { along: Along::X, seed: Some(5), texels: Some(128), size_m: Some(1.0), ..Detail::of_kind(DetailPattern::Wood) };
    [
        ("plain", wall(layout), None, stone()),
        ("along x", wall(layout), None, wood),
        ("by coordinates", textured(wall(layout)), dense, by_uv),
        ("textured", textured(wall(layout)), coarse, stone()),
        ("texels", wall_of_texels(layout), None, Detail { along: Along::Z, ..stone() }),
    ]
}

/// What the reference says of a wall's detail at a pixel's place.
fn factor_at(shown: &ShownDetail, chunk: &LitChunk, image: Option<&SrgbImage>, by_uv: bool, at: Vec2) -> f32 {
    let eye = Vec3::new(0.0, 0.0, 1.25);
    let pixel_m = 2.0 * 1.25 * 30f32.to_radians().tan() / SIZE as f32;
    let place = at.extend(0.0);
    shown.factor(&ShownPlace {
        place,
        normal: heliodon_math::frame::unit_or(mixed(&chunk.normals, at), Vec3::Z),
        uv: Vec2::new(1.0 + at.x, 1.0 - at.y) * 0.5,
        distance_m: eye.distance(place),
        // a unit of the coordinates is two metres
        pixel: if by_uv { pixel_m * 0.5 } else { pixel_m },
        base_texels: image.map_or(0.0, |image| pixel_m * 0.5 * image.width as f32),
    })
}

#[test]
fn details_are_the_references_on_every_kind_of_stone_beside_lamps_too_and_go_at_a_key() {
    let layout = LightLayout { sun_steps: 5, coefficients: 4, channels: 1, sun_bounce_functions: 3 };
    let lamp =
        Lamp { place: Vec3::new(0.4, 0.3, 1.5), intensity: Vec3::new(2.0, 1.5, 1.0), cone: None, reach_m: 8.0, shadows: false };
    for (name, chunk, image, detail) in detailed_walls(layout) {
        let folder = tempfile::tempdir().unwrap();
        let bundle = folder.path().join("wall");
        write_detailed(&bundle, layout, &chunk, image.as_ref(), Some(&detail));
        let reader = BundleReader::open(&bundle).unwrap();
        let info = reader.manifest().parts[0].detail.clone().unwrap();
        let texture = reader.read_detail(&info).unwrap();
        let shown = ShownDetail::new(info, &texture);
        let mut renderer = Renderer::new(&bundle, SIZE, SIZE, RenderOptions { samples: 1 }).unwrap();
        let pose = Pose::looking(Vec3::new(0.0, 0.0, 1.25), Vec3::ZERO);
        let shot = Shot { pose, fov_deg: 60.0, ..renderer.home_shot(6.0 * 3600.0) };
        let half = 1.25 * 30f32.to_radians().tan();
        for lamps in [Vec::new(), vec![lamp]] {
            let beside = !lamps.is_empty();
            renderer.app_mut().world_mut().resource_mut::<Lamps>().lamps = lamps;
            let mut picture = |without: bool| {
                renderer.app_mut().world_mut().resource_mut::<StageFrame>().without_details = without;
                // what a lamp needs comes in the frame after it
                renderer.render_linear(&shot).unwrap();
                renderer.render_linear(&shot).unwrap()
            };
            let (with, without) = (picture(false), picture(true));
            let mean = without.pixels.iter().sum::<Vec3>().element_sum() / (3.0 * without.pixels.len() as f32);
            let (mut squares, mut sums) = (0.0f64, [0.0f64; 2]);
            for (x, y) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))) {
                let screen = (Vec2::new(x as f32, y as f32) + 0.5) / SIZE as f32 * 2.0 - 1.0;
                let at = Vec2::new(screen.x, -screen.y) * half;
                let by_uv = detail.mapping == DetailMapping::Uv;
                let factor = factor_at(&shown, &chunk, image.as_ref(), by_uv, at);
                let (got, wanted) = (with.pixel(x, y), without.pixel(x, y) * factor);
                let off = (got - wanted).abs().max_element();
                let allowed = 0.015 * wanted.max_element() + 0.002 * mean;
                assert!(off <= allowed, "{name}, {x} {y}, lamps {beside}: {got} for {wanted}, factor {factor}");
                squares += f64::from(factor - 1.0).powi(2);
                sums[0] += f64::from(got.element_sum());
                sums[1] += f64::from(without.pixel(x, y).element_sum());
            }
            let contrast = (squares / f64::from(SIZE * SIZE)).sqrt();
            assert!(contrast > 0.015, "{name}: {contrast} is hardly a detail");
            let brighter = sums[0] / sums[1] - 1.0;
            assert!(brighter.abs() < 0.01, "{name}: {brighter} brighter with its detail");
        }
        if name == "by coordinates" {
            // an eye that comes no nearer, but to texels that are no denser than those of the image
            let far = Shot { pose: Pose::looking(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO), ..shot };
            let mut picture = |without: bool| {
                renderer.app_mut().world_mut().resource_mut::<StageFrame>().without_details = without;
                renderer.render_linear(&far).unwrap()
            };
            assert!(picture(false) == picture(true), "beyond twice near_m there is none");
        }
    }
}

#[test]
fn a_chunk_shows_the_detail_that_it_names() {
    let layout = LightLayout { sun_steps: 5, coefficients: 4, channels: 1, sun_bounce_functions: 3 };
    let stone = Detail { size_m: Some(3.0), ..Detail::of_kind(DetailPattern::Stone) };
    let wood = Detail { size_m: Some(1.0), ..Detail::of_kind(DetailPattern::Wood) };
    let picture = |chunk: &LitChunk, all: Option<&Detail>, some: &[&Detail]| {
        let folder = tempfile::tempdir().unwrap();
        write_with(folder.path().join("wall").as_path(), layout, chunk, None, |writer| {
            let made = |detail: &Detail| DetailTexture::generate(&detail.generated().unwrap()).unwrap();
            all.into_iter().for_each(|detail| writer.add_detail(0, &made(detail), detail).unwrap());
            some.iter().for_each(|detail| writer.add_material_detail(0, &made(detail), detail).unwrap());
        });
        let mut renderer = Renderer::new(folder.path().join("wall"), SIZE, SIZE, RenderOptions { samples: 1 }).unwrap();
        let pose = Pose::looking(Vec3::new(0.0, 0.0, 1.25), Vec3::ZERO);
        let shot = Shot { pose, fov_deg: 60.0, ..renderer.home_shot(6.0 * 3600.0) };
        renderer.render_linear(&shot).unwrap();
        renderer.render_linear(&shot).unwrap()
    };
    for wall in [wall(layout), wall_of_texels(layout)] {
        let says = |detail| LitChunk { detail, ..wall.clone() };
        let of_all = [None, Some(&stone), Some(&wood)].map(|all| picture(&wall, all, &[]));
        assert!(of_all[0] != of_all[1] && of_all[1] != of_all[2] && of_all[0] != of_all[2]);
        let of_one = [None, Some(0), Some(1)].map(|detail| picture(&says(detail), None, &[&stone, &wood]));
        assert!(of_all == of_one, "as if all of the part had it");
    }
}

/// Another eye beside the renderer's, which sees the same picture: together they are a pair.
fn with_another_eye(renderer: &mut Renderer) {
    let world = renderer.app_mut().world_mut();
    let (own, target) = world.query_filtered::<(Entity, &RenderTarget), With<DaylightCamera>>().single(world).unwrap();
    let RenderTarget::Image(target) = target.clone() else { panic!("it draws an image") };
    let mut images = world.resource_mut::<Assets<Image>>();
    let image = images.get(&target.handle).unwrap().clone();
    let image = images.add(image);
    let (pose, projection) = (*world.get::<Transform>(own).unwrap(), world.get::<Projection>(own).unwrap().clone());
    world.entity_mut(own).insert(StereoPair(7));
    world.spawn((DaylightCamera, ExactAtRest, RenderTarget::from(image), StereoPair(7), pose, projection));
}

/// Lets the wall wear some of everything: half of its own material beneath gold, a mark, and holes.
fn wear(renderer: &mut Renderer) {
    let mut covering = renderer.app_mut().world_mut().resource_mut::<Covering>();
    let gold = Material { name: "gold".to_owned(), albedo: [1.0, 0.78, 0.34], grain: 0.5, metal: 0.7 };
    covering.cover("wall", gold, 0.4);
    covering.fade("wall", 0.8, 0.0);
    covering.highlight("wall", true);
    // a quarter of a second, in which most of the mark comes and half of the gold
    let passes = TimeUpdateStrategy::ManualDuration(Duration::from_millis(250));
    renderer.app_mut().insert_resource(passes);
    renderer.app_mut().update();
    renderer.app_mut().insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
}

#[test]
fn a_covered_wall_has_the_albedo_of_its_cover_whatever_lights_it() {
    let ivory = Vec3::new(0.85, 0.78, 0.62);
    for chunk in [wall(GREY), wall_of_texels(GREY)] {
        let folder = tempfile::tempdir().unwrap();
        let bundle = folder.path().join("wall");
        write_chunk(&bundle, GREY, &chunk, None);
        let mut renderer = Renderer::new(&bundle, SIZE, SIZE, RenderOptions { samples: 1 }).unwrap();
        let material = Material { name: "ivory".to_owned(), albedo: ivory.to_array().map(f64::from), grain: 0.0, metal: 0.0 };
        renderer.app_mut().world_mut().resource_mut::<Covering>().cover("wall", material, 0.0);
        let pose = Pose::looking(Vec3::new(0.0, 0.0, 1.25), Vec3::ZERO);
        let shot = Shot { pose, fov_deg: 60.0, ..renderer.home_shot(6.0 * 3600.0) };
        for _ in 0..4 {
            renderer.render_linear(&shot).unwrap();
        }
        let picture = renderer.render_linear(&shot).unwrap();
        let reader = BundleReader::open(&bundle).unwrap();
        let moment = Day::new(reader.lapse()).at(shot.clock_s, shot.blend);
        let covered = LitChunk { albedo: vec![ivory; chunk.positions.len()], ..reader.read_chunk(0).unwrap() };
        let expected = expected(&reader, &covered, &moment);
        let (rounded, of_mean) = if chunk.texel_uvs.is_empty() { (0.004, 0.003) } else { (0.012, 0.015) };
        let mean = picture.pixels.iter().sum::<Vec3>().element_sum() / (3.0 * picture.pixels.len() as f32);
        let half = 1.25 * 30f32.to_radians().tan();
        for (x, y) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))) {
            let screen = (Vec2::new(x as f32, y as f32) + 0.5) / SIZE as f32 * 2.0 - 1.0;
            let (wanted, got) = (expected(Vec2::new(screen.x, -screen.y) * half), picture.pixel(x, y));
            let off = (got - wanted).abs().max_element();
            assert!(off <= rounded * wanted.max_element() + of_mean * mean, "{x} {y}: {got} for {wanted}");
        }
    }
}

#[test]
fn every_kind_of_stone_is_the_same_in_one_pass_for_both_eyes() {
    let layout = LightLayout { sun_steps: 5, coefficients: 4, channels: 1, sun_bounce_functions: 3 };
    let lamp =
        Lamp { place: Vec3::new(0.4, 0.3, 1.5), intensity: Vec3::new(2.0, 1.5, 1.0), cone: None, reach_m: 8.0, shadows: true };
    for (name, chunk, image, detail) in detailed_walls(layout) {
        let folder = tempfile::tempdir().unwrap();
        let bundle = folder.path().join("wall");
        write_detailed(&bundle, layout, &chunk, image.as_ref(), Some(&detail));
        let mut renderer = Renderer::new(&bundle, SIZE, SIZE, RenderOptions { samples: 1 }).unwrap();
        let pose = Pose::looking(Vec3::new(0.0, 0.0, 1.25), Vec3::ZERO);
        let shot = Shot { pose, fov_deg: 60.0, ..renderer.home_shot(6.0 * 3600.0) };
        renderer.render(&shot).unwrap();
        with_another_eye(&mut renderer);
        let plain = [(Vec::new(), true), (Vec::new(), false), (vec![lamp], true), (vec![lamp], false)].map(|all| (all, false));
        let worn = plain.clone().map(|(all, _)| (all, true));
        for ((lamps, without_details), worn) in plain.into_iter().chain(worn) {
            if worn {
                wear(&mut renderer);
            }
            let beside = !lamps.is_empty();
            renderer.app_mut().world_mut().resource_mut::<Lamps>().lamps = lamps;
            renderer.app_mut().world_mut().resource_mut::<StageFrame>().without_details = without_details;
            let mut picture = |passes: Passes| {
                renderer.app_mut().insert_resource(StereoPasses(passes));
                let mut made = Vec::new();
                for _ in 0..4 {
                    made = renderer.render(&shot).unwrap().pixels;
                }
                let world = renderer.app_mut().world();
                (made, world.resource::<OnePassPairs>().count(), world.resource::<RenderAdapterInfo>().driver_info.clone())
            };
            let ((two, none, driver), (one, pairs, _)) = (picture(Passes::Two), picture(Passes::One));
            assert_eq!((none, pairs), (0, 1), "{name}: in one pass on {driver}");
            // llvmpipe's own transfer function is a code or two off, with which two passes are not drawn there.
            let differ = one.iter().zip(&two).filter(|(a, b)| (0..3).any(|c| a[c].abs_diff(b[c]) > 2)).count();
            assert!(differ == 0, "{name}, lamps {beside}, details {}, worn {worn}: {differ} pixels differ", !without_details);
            let shades: HashSet<[u8; 4]> = two.into_iter().collect();
            assert!(shades.len() > 50, "{name}: {} colours are no picture", shades.len());
        }
    }
}
