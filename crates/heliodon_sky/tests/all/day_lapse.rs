//! The lapse of a day, from a model and from probes.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

use glam::Vec3;
use heliodon_image::HdrImage;
use heliodon_math::color::luminance;
use heliodon_sky::day::{
    Between, BuiltLapse, LapseNote, LapseParams, ModelDay, ProbeFile, ProbeSeries, Skies, SkyKeeper, SkyMap, SkyRecord,
    SkySource, build, build_keeping, sky_at, table,
};
use heliodon_sky::mapping::Mapping;
use heliodon_sky::model::ModelParams;
use std::path::Path;

fn athens() -> LapseParams {
    let day = ModelDay {
        model: ModelParams::default(),
        latitude_deg: 37.9715,
        longitude_deg: 23.7267,
        utc_offset_hours: 2.0,
        date: "-0437-08-01".parse().unwrap(),
    };
    LapseParams { sun_steps: 12, sky_steps: 24, map_width: 64, ..LapseParams::new(SkySource::Model(day)) }
}

fn run(params: &LapseParams) -> (BuiltLapse, Vec<(String, HdrImage)>) {
    let mut maps = Vec::new();
    let built = build(params, &mut |map| {
        assert_eq!(map.index as usize, maps.len());
        maps.push((map.name.to_string(), map.image.clone()));
        Ok(())
    })
    .unwrap();
    (built, maps)
}

#[test]
fn a_model_day_runs_from_dawn_over_noon_to_dusk() {
    let (built, maps) = run(&athens());
    let steps = &built.lapse.steps;
    assert_eq!((steps.len(), maps.len(), built.suns.len(), built.sun_steps), (24, 24, 12, 12));
    // twilight, then the sun
    assert!(steps[0].sun.is_none() && steps[12].sun.is_some());
    assert!(built.suns.iter().filter(|s| s.is_some()).count() >= 9);
    let level = |i: usize| luminance(Vec3::from_array(steps[i].sky[0]));
    let noon_sun = steps[12].sun.unwrap();
    assert!(Vec3::from_array(noon_sun.direction).y > 0.9, "early August in Athens: {noon_sun:?}");
    let noon = luminance(Vec3::from_array(noon_sun.irradiance));
    assert!((60.0..110.0).contains(&noon), "direct sun in klx: {noon}");
    // civil dawn: some 3.4 lux on level ground against some 100,000
    let dawn = level(0) * 0.282 * std::f32::consts::PI;
    assert!((0.001..0.01).contains(&dawn), "klx at dawn: {dawn}");
    assert!(level(12) > 500.0 * level(0));
    // the morning sun stands in the east and is redder than the noon sun
    let morning = steps.iter().find_map(|s| s.sun).unwrap();
    assert!(morning.direction[0] > 0.8 && morning.direction[1] < 0.35);
    let warmth = |s: [f32; 3]| s[0] / s[2].max(1e-3);
    assert!(warmth(morning.irradiance) > 1.2 * warmth(noon_sun.irradiance));
    for (i, step) in steps.iter().enumerate() {
        assert_eq!(step.mask_bit as usize, i / 2);
        assert_eq!(step.sky_map, format!("sky/{:04}.hdr", i + 1));
        assert!(!step.sun_in_map);
        assert_eq!(step.sun, steps[i / 2 * 2].sun, "odd entries keep their sun step's sun");
        if let Some(sun) = step.sun {
            assert!(sun.direction[1] > 0.0 && (Vec3::from_array(sun.direction).length() - 1.0).abs() < 1e-5);
        }
    }
    assert!(maps.iter().all(|(_, m)| m.pixels.iter().all(|p| p.is_finite() && p.min_element() >= 0.0)));
    // exposure: dawn is exposed longer, yet stays darker; no jumps against the light's own changes
    assert!(steps[0].exposure_stops > steps[12].exposure_stops + 3.0);
    assert!(level(0) * steps[0].exposure_stops.exp2() < 0.5 * level(12) * steps[12].exposure_stops.exp2());
    let text = table(&built.lapse, 0.0);
    assert_eq!(text.lines().count(), 26);
    assert!(text.contains("no sun") && text.contains(&steps[12].time));
}

#[test]
fn the_same_day_has_the_same_bits_for_any_number_of_threads() {
    let params = LapseParams { sun_steps: 3, sky_steps: 3, ..athens() };
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (built, maps) = pool.install(|| run(&params));
        (serde_json::to_string(&built.lapse).unwrap(), maps)
    };
    let (one, four) = (with(1), with(4));
    assert_eq!(one.0, four.0);
    assert!(one.1 == four.1);
}

/// A uniform sky of `radiance` with a patch of sun at a column.
fn write_probe(path: &Path, radiance: f32, sun_column: u32) {
    let mut image = HdrImage::filled(256, 128, Vec3::splat(radiance));
    for y in 40..42 {
        for x in sun_column..sun_column + 2 {
            image.pixels[(y * 256 + x) as usize] = Vec3::splat(radiance * 5000.0);
        }
    }
    image.write_hdr(path).unwrap();
}

fn series(dir: &Path, names: &[(&str, f32, u32)], between: Between) -> LapseParams {
    let files = names
        .iter()
        .map(|&(name, radiance, column)| {
            let path = dir.join(name);
            write_probe(&path, radiance, column);
            ProbeFile { path, time: None }
        })
        .collect();
    let source = SkySource::Probes(ProbeSeries { between, ..ProbeSeries::new(files, Mapping::LatLong) });
    LapseParams { sun_steps: 3, sky_steps: 5, map_width: 64, ..LapseParams::new(source) }
}

#[test]
fn a_sparse_series_is_interpolated_or_taken_from_the_nearest() {
    let dir = tempfile::tempdir().unwrap();
    let names = [("sky_0800.hdr", 1.0, 100), ("sky_1200.hdr", 2.0, 140)];
    let (built, maps) = run(&series(dir.path(), &names, Between::Interpolate));
    let steps = &built.lapse.steps;
    let times: Vec<&str> = steps.iter().map(|s| s.time.as_str()).collect();
    assert_eq!(times, ["08:00", "09:00", "10:00", "11:00", "12:00"]);
    assert_eq!(steps.iter().map(|s| s.mask_bit).collect::<Vec<_>>(), [0, 0, 1, 1, 2]);
    let level = |i: usize| steps[i].sky[0][0] * 0.282_094_8;
    for (i, expected) in [1.0, 1.25, 1.5, 1.75, 2.0].into_iter().enumerate() {
        assert!((level(i) / expected - 1.0).abs() < 0.01, "{i}: {}", level(i));
    }
    assert_eq!(
        steps.iter().map(|s| s.sky_map.as_str()).collect::<Vec<_>>()[1..4],
        ["sky/0001.hdr", "sky/0002.hdr", "sky/0002.hdr"]
    );
    assert_eq!(maps.len(), 2);
    assert!(steps[0].sun_in_map && maps[0].1.width == 64);
    let x = |i: usize| Vec3::from_array(steps[i].sun.unwrap().direction).x;
    assert!(x(0) < x(2) && x(2) < x(4));

    let (built, _) = run(&series(dir.path(), &names, Between::Nearest));
    let level = |i: usize| built.lapse.steps[i].sky[0][0] * 0.282_094_8;
    assert!((level(1) - 1.0).abs() < 0.01 && (level(3) - 2.0).abs() < 0.01);
}

#[test]
fn the_sky_at_a_time_has_its_sun_apart_and_lies_between_two_probes() {
    let dir = tempfile::tempdir().unwrap();
    let names = [("0800.hdr", 1.0, 100), ("1200.hdr", 2.0, 140), ("1600.hdr", 3.0, 160)];
    let params = LapseParams { map_width: 256, ..series(dir.path(), &names, Between::Interpolate) };
    let (built, _) = run(&params);
    let at = |time: &str| sky_at(&params, time.parse().unwrap()).unwrap();
    for (time, level, nearest) in [("08:00", 1.0, true), ("09:00", 1.25, false), ("10:00", 1.5, false), ("16:00", 3.0, true)] {
        let sky = at(time);
        assert!(sky.map.pixels.iter().all(|p| (p.x / level - 1.0).abs() < 0.02), "{time}: the sun is not in it");
        assert!(sky.notes.is_empty() && sky.time.to_string() == time, "{:?}", sky.notes);
        let step = built.lapse.steps.iter().find(|step| step.time == time);
        assert!(!nearest || step.unwrap().sun == sky.sun, "{time}");
    }
    let (late, last) = (at("18:00"), at("16:00"));
    assert_eq!((late.sun, late.map, late.time), (last.sun, last.map, last.time));
    assert!(matches!(late.notes[..], [LapseNote::Outside { .. }]) && late.notes[0].to_string().contains("late as 18:00"));
    let x = |time: &str| Vec3::from_array(at(time).sun.unwrap().direction).x;
    assert!(x("08:00") < x("10:00") && x("10:00") < x("12:00"));

    // a model's, at a time that is an entry's
    let params = athens();
    let (built, maps) = run(&params);
    let noon = &built.lapse.steps[12];
    let sky = sky_at(&params, noon.time.parse().unwrap()).unwrap();
    assert!(sky.sun == noon.sun && sky.map == maps[12].1 && sky.time.to_string() == noon.time);
}

#[test]
fn a_dense_series_leaves_probes_out_and_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let all: Vec<(String, f32, u32)> = (0..13)
        .filter(|i| !(7..10).contains(i))
        .map(|i| (format!("{:02}-{:02}.hdr", 8 + i / 6, i % 6 * 10), 1.0 + i as f32, 100))
        .collect();
    let names: Vec<(&str, f32, u32)> = all.iter().map(|(n, r, c)| (n.as_str(), *r, *c)).collect();
    let (built, _) = run(&series(dir.path(), &names, Between::Nearest));
    assert!(built.notes.iter().any(|n| matches!(n, LapseNote::Unused { .. })), "{:?}", built.notes);
    let gap = built.notes.iter().find_map(|n| match n {
        LapseNote::Gap { from, to, entries } => Some((from.to_string(), to.to_string(), *entries)),
        _ => None,
    });
    assert_eq!(gap, Some(("09:00".into(), "09:40".into(), 1)), "{:?}", built.notes);
    assert!(built.notes[0].to_string().contains("09:40"));
}

#[test]
fn a_single_probe_stands_for_noon() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("grey.hdr");
    HdrImage::filled(64, 32, Vec3::ONE).write_hdr(&path).unwrap();
    let source = SkySource::Probes(ProbeSeries::new(vec![ProbeFile { path, time: None }], Mapping::LatLong));
    let (built, maps) = run(&LapseParams::new(source));
    assert_eq!((built.sun_steps, built.suns.len(), maps.len()), (1, 1, 1));
    let step = &built.lapse.steps[0];
    assert_eq!((step.time.as_str(), step.sun, step.mask_bit), ("12:00", None, 0));
    let s0 = (4.0 * std::f32::consts::PI).sqrt();
    assert!((step.sky[0][1] - s0).abs() < 1e-5 && step.sky[1..].iter().flatten().all(|c| c.abs() < 1e-5));
    assert!(maps[0].1.pixels.iter().all(|&p| p == Vec3::ONE));
    assert!(serde_json::to_string(&built.lapse).unwrap().contains("\"sun\":null"));
}

/// 40 degrees up.
fn at_bearing(bearing_deg: f32) -> Vec3 {
    let (sin, cos) = bearing_deg.to_radians().sin_cos();
    Vec3::new(0.766_044_4 * sin, 0.642_787_6, -0.766_044_4 * cos)
}

/// A sky of one colour with a disc of the sun's size, cut at `ceiling`.
fn write_disc(path: &Path, sun: Vec3, ceiling: f32) {
    let (width, height) = (1024, 512);
    let image = HdrImage::from_fn(width, height, |x, y| {
        let away = |k: u32| {
            let at = |pixel: u32, k: u32| pixel as f32 + (k as f32 + 0.5) / 8.0;
            let bearing = (at(x, k % 8) / width as f32 - 0.5) * std::f32::consts::TAU;
            let height = (0.5 - at(y, k / 8) / height as f32) * std::f32::consts::PI;
            let look = Vec3::new(height.cos() * bearing.sin(), height.sin(), -height.cos() * bearing.cos());
            (look - sun).length().to_degrees()
        };
        let looks = if away(36) < 1.0 { 0..64 } else { 0..0 };
        let covered = looks.filter(|&k| away(k) < 0.27).count() as f32 / 64.0;
        (Vec3::new(0.2, 0.3, 0.5) + Vec3::splat(50_000.0 * covered)).min(Vec3::splat(ceiling))
    });
    image.write_hdr(path).unwrap();
}

fn single(path: &Path, sun_irradiance: Option<Vec3>) -> LapseParams {
    let files = vec![ProbeFile { path: path.to_owned(), time: None }];
    let series = ProbeSeries { sun_irradiance, ..ProbeSeries::new(files, Mapping::LatLong) };
    LapseParams { map_width: 64, ..LapseParams::new(SkySource::Probes(series)) }
}

#[test]
fn a_hard_clipped_sun_is_told_and_takes_the_irradiance_that_the_site_gives() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("clipped.hdr");
    // on an edge of pixels, within one, and between
    for bearing_deg in [90.0, 120.2, 251.37] {
        let towards = at_bearing(bearing_deg);
        write_disc(&path, towards, 37.0);
        let (built, _) = run(&single(&path, None));
        assert_eq!(built.lapse.steps[0].sun, None);
        assert!(matches!(built.notes[..], [LapseNote::ClippedSpot { .. }]), "{bearing_deg}: {:?}", built.notes);
        let (built, _) = run(&single(&path, Some(Vec3::new(3.0, 2.5, 2.0))));
        let sun = built.lapse.steps[0].sun.unwrap();
        assert_eq!((sun.irradiance, sun.clipped), ([3.0, 2.5, 2.0], true));
        assert!((Vec3::from_array(sun.direction) - towards).length() < 0.2_f32.to_radians(), "{bearing_deg}: {sun:?}");
        assert!(matches!(built.notes[..], [LapseNote::Clipped { replaced: true, .. }]), "{:?}", built.notes);
    }
}

#[test]
fn an_irradiance_of_the_sun_that_goes_unused_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("sky.hdr");
    let notes = |sun: bool| {
        if sun {
            write_disc(&path, at_bearing(90.0), f32::MAX);
        } else {
            HdrImage::filled(64, 32, Vec3::ONE).write_hdr(&path).unwrap();
        }
        run(&single(&path, Some(Vec3::ONE))).0.notes
    };
    let unused = |sunless, unclipped| vec![LapseNote::IrradianceUnused { probes: 1, sunless, unclipped }];
    assert_eq!((notes(false), notes(true)), (unused(1, 0), unused(0, 1)));
}

#[test]
fn numbers_of_images_are_not_taken_for_times_unsaid() {
    let dir = tempfile::tempdir().unwrap();
    let told = |names: &[&str]| {
        let names: Vec<(&str, f32, u32)> = names.iter().map(|&name| (name, 1.0, 100)).collect();
        let params = LapseParams { sun_steps: 2, sky_steps: 2, ..series(dir.path(), &names, Between::Nearest) };
        run(&params).0.notes.iter().any(|note| matches!(note, LapseNote::Numbered { .. }))
    };
    assert!(told(&["DSC_0001.hdr", "DSC_0002.hdr", "DSC_0003.hdr"]));
    assert!(!told(&["DSC_0758.hdr", "DSC_0759.hdr", "DSC_0800.hdr"]));
    assert!(!told(&["0800.hdr", "0805.hdr", "0810.hdr"]));
    // one alone stands for all times
    let path = dir.path().join("venice_2048.hdr");
    write_probe(&path, 1.0, 100);
    assert_eq!(run(&single(&path, None)).0.lapse.steps[0].time, "12:00");
}

/// Keeps all that it is given, and counts what was made anew.
#[derive(Default)]
struct Shelf {
    records: std::collections::BTreeMap<u32, SkyRecord>,
    made: usize,
}

impl SkyKeeper for Shelf {
    fn kept(&mut self, number: u32, _map: Option<u32>) -> Option<SkyRecord> {
        // as from a file
        self.records.get(&number).map(|record| serde_json::from_str(&serde_json::to_string(record).unwrap()).unwrap())
    }

    fn keep(&mut self, number: u32, record: &SkyRecord, _map: Option<SkyMap<'_>>) -> Result<(), String> {
        self.made += 1;
        self.records.insert(number, record.clone());
        Ok(())
    }
}

#[test]
fn a_day_goes_on_from_the_skies_that_were_kept() {
    let dir = tempfile::tempdir().unwrap();
    let probes =
        series(dir.path(), &[("0800.hdr", 1.0, 100), ("0900.hdr", 2.0, 120), ("1200.hdr", 2.0, 140)], Between::Interpolate);
    for params in [LapseParams { sun_steps: 5, sky_steps: 10, ..athens() }, probes] {
        let mut shelf = Shelf::default();
        let whole = build_keeping(&params, &mut shelf).unwrap();
        let count = params.sky_count().unwrap() as usize;
        assert_eq!((shelf.made, shelf.records.len()), (count, count));
        shelf.records.retain(|number, _| number % 3 != 1);
        let (kept, made) = (shelf.records.len(), shelf.made);
        let again = build_keeping(&params, &mut shelf).unwrap();
        assert_eq!(shelf.made - made, count - kept);
        assert!(kept < count && again.lapse == whole.lapse && again.notes == whole.notes);

        // two machines share the skies
        let mut shelf = Shelf::default();
        let skies = Skies::new(params.clone()).unwrap();
        let (even, odd): (Vec<u32>, Vec<u32>) = (0..count as u32).rev().partition(|number| number % 2 == 0);
        skies.make(&odd, &mut shelf).unwrap();
        assert_eq!(shelf.made, odd.len());
        skies.make(&even, &mut shelf).unwrap();
        let shared = build_keeping(&params, &mut shelf).unwrap();
        assert_eq!((shelf.made, &shared.lapse), (count, &whole.lapse));
        let known = skies.known_suns().unwrap();
        assert!(known.is_none_or(|suns| suns == whole.suns));
    }
}

#[test]
fn what_cannot_be_is_refused_with_its_name() {
    let dir = tempfile::tempdir().unwrap();
    let said = |params: &LapseParams| build(params, &mut |_| Ok(())).unwrap_err().to_string();
    let nameless = series(dir.path(), &[("a.hdr", 1.0, 9), ("b.hdr", 1.0, 9)], Between::Nearest);
    assert!(said(&nameless).contains("a.hdr") && said(&nameless).contains("sky.times"));
    let twice = series(dir.path(), &[("x_0800.hdr", 1.0, 9), ("y_0800.hdr", 1.0, 9)], Between::Nearest);
    assert!(said(&twice).contains("y_0800.hdr"), "{}", said(&twice));
    let missing = SkySource::Probes(ProbeSeries::new(vec![ProbeFile { path: "no.hdr".into(), time: None }], Mapping::LatLong));
    assert!(said(&LapseParams::new(missing)).contains("no.hdr"));
    let path = dir.path().join("square.hdr");
    HdrImage::filled(30, 30, Vec3::ONE).write_hdr(&path).unwrap();
    let cross = SkySource::Probes(ProbeSeries::new(vec![ProbeFile { path, time: None }], Mapping::CubeCross));
    assert!(said(&LapseParams::new(cross)).contains("square.hdr"));
    assert!(said(&LapseParams { sun_steps: 1025, sky_steps: 4000, ..athens() }).contains("1024"));
    assert!(said(&LapseParams { sun_steps: 20, sky_steps: 10, ..athens() }).contains("sky_steps"));
    let refused = build(&athens(), &mut |_| Err("disk full".into())).unwrap_err().to_string();
    assert!(refused.contains("sky/0001.hdr") && refused.contains("disk full"));
}
