//! The scan itself, which eyes at rest see in place of what is drawn of it.

use super::*;

const LAYOUT: LightLayout = LightLayout { sun_steps: 5, coefficients: 4, channels: 3, sun_bounce_functions: 2 };

/// The wall in two triangles, of one colour and in one light.
fn few() -> LitChunk {
    let whole = wall(LAYOUT);
    let side = QUADS + 1;
    let corners = [0, QUADS, side * QUADS, side * side - 1].map(|v| whole.positions[v as usize]);
    let mut light = VertexLight::zeros(LAYOUT, 4);
    light.sky_transfer.iter_mut().step_by(LAYOUT.transfer_floats()).for_each(|ambient| *ambient = 0.5);
    LitChunk {
        positions: corners.to_vec(),
        normals: vec![Vec3::Z; 4],
        albedo: vec![Vec3::splat(0.5); 4],
        triangles: vec![[0, 1, 2], [1, 3, 2]],
        valid: vec![1; 4],
        light,
        ..whole
    }
}

/// A bundle that draws this, and has the whole wall as its scan.
fn write_both(folder: &Path, drawn: &LitChunk) {
    let site = Site::parse(
        "[site]\nname = \"A wall\"\n[[part]]\nfile = \"wall.obj\"\n[sky]\nprobes = \"*.hdr\"\nmapping = \"lat-long\"\n",
        "wall/site.toml",
    )
    .unwrap();
    let meta = BundleMeta::from_site(site.file(), LAYOUT, 1e-4);
    let mut writer = BundleWriter::create(folder, meta.clone()).unwrap();
    writer.push_chunk(drawn).unwrap();
    for which in 0..4 {
        writer.add_sky_map(&format!("sky/{which}.hdr"), &sky_map(which).to_hdr_bytes()).unwrap();
    }
    let mut scan = writer.begin_scan(meta).unwrap();
    scan.push_chunk(&wall(LAYOUT)).unwrap();
    writer.end_scan(scan, &lapse(LAYOUT)).unwrap();
    writer.finish(&lapse(LAYOUT)).unwrap();
}

fn off(a: &SrgbImage, b: &SrgbImage) -> u8 {
    a.pixels.as_flattened().iter().zip(b.pixels.as_flattened()).map(|(a, b)| a.abs_diff(*b)).max().unwrap()
}

#[test]
fn eyes_at_rest_see_the_scan_itself_and_moving_ones_what_is_drawn_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let [both, drawn, scan] = ["both", "drawn", "scan"].map(|name| folder.path().join(name));
    write_both(&both, &few());
    write_chunk(&drawn, LAYOUT, &few(), None);
    write(&scan, LAYOUT);
    let [mut both_exact, mut live, mut drawn, mut scan] =
        [&both, &both, &drawn, &scan].map(|bundle| Renderer::new(bundle, SIZE, SIZE, RenderOptions { samples: 1 }).unwrap());
    let home = drawn.home_shot(0.0);
    let shot = |x: f32, hour: f64| {
        let pose = Pose::looking(Vec3::new(x, 0.1, 1.25), Vec3::ZERO);
        Shot { pose, clock_s: 3600.0 * hour, ..home }
    };
    let first = shot(0.0, 6.2);
    let [of_few, of_scan] = [&mut drawn, &mut scan].map(|renderer| renderer.render(&first).unwrap());
    assert!(off(&of_few, &of_scan) > 20, "they look different");
    assert_eq!(both_exact.render(&first).unwrap(), of_scan, "stills show the scan");
    // opened anew where no still is wanted, it stays in main memory if a processor draws
    light_by_pixel(&mut live);
    live.app_mut().world_mut().resource_mut::<Stage>().open(&both).unwrap();
    while !live.stage().is_complete() {
        live.render(&first).unwrap();
    }
    for (place, x) in [0.0, 0.3, -0.2].into_iter().enumerate() {
        let moved = shot(x, 6.2);
        let [of_few, of_scan] = [&mut drawn, &mut scan].map(|renderer| renderer.render(&moved).unwrap());
        let beside = shot(x + 0.01, 6.2);
        let (begin, of_few_beside) = (live.render(&beside).unwrap(), drawn.render(&beside).unwrap());
        assert!(off(&begin, &of_few_beside) <= 1, "a moving eye sees what is drawn: {}", off(&begin, &of_few_beside));
        let nearly = live.render(&moved).unwrap();
        assert!(off(&nearly, &of_few) <= 1, "and sees it still: {}", off(&nearly, &of_few));
        let settles = (0..2000).any(|_| {
            std::thread::sleep(Duration::from_millis(1));
            off(&live.render(&moved).unwrap(), &of_scan) <= 1
        });
        assert!(settles, "an eye at rest sees the scan, place {place}");
        // its light goes with the day
        for hour in [6.4, 6.1] {
            let later = shot(x, hour);
            let (lit, wanted) = (live.render(&later).unwrap(), scan.render(&later).unwrap());
            assert!(off(&lit, &wanted) <= 1, "{} at {hour}", off(&lit, &wanted));
        }
    }
}

#[test]
fn a_scan_that_was_not_copied_whole_is_told_and_leaves_what_is_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let both = folder.path().join("both");
    write_both(&both, &few());
    std::fs::remove_file(both.join("scan").join("manifest.json")).unwrap();
    let refused = Renderer::new(&both, SIZE, SIZE, RenderOptions { samples: 1 }).map(|_| ()).unwrap_err().to_string();
    assert!(refused.contains("scan") && refused.contains("copy the bundle again"), "{refused}");
}
