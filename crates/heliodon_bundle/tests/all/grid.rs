//! The light grid and the actors of a bundle: what is written is read, what is damaged is refused, and what lies between points.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use crate::common;
use crate::common::{MONO, RGB, actor, grid, meta, write_moving};
use glam::Vec3;
use heliodon_bundle::moment::{Blend, Day, Moment};
use heliodon_bundle::shade::vertex_light;
use heliodon_bundle::{ActorFile, BundleReader, BundleWriter, Grid, GridPoints, LightLayout};
use std::f32::consts::FRAC_1_PI;
use std::fs;
use std::path::Path;

#[test]
fn grids_and_actors_read_back() {
    let folder = tempfile::tempdir().unwrap();
    for (i, layout) in [MONO, RGB, LightLayout { sun_bounce_functions: 0, ..MONO }].into_iter().enumerate() {
        let target = folder.path().join(i.to_string());
        let manifest = write_moving(&target, layout, &folder.path().join("files"));
        let reader = BundleReader::open(&target).unwrap();
        reader.verify().unwrap();
        assert_eq!((reader.manifest(), manifest.version), (&manifest, 2));
        assert_eq!(*reader.read_grid().unwrap().unwrap().points(), grid(layout));
        let info = manifest.grid.unwrap();
        assert_eq!((info.points, info.invalid_points, info.cells), (23, 4, [4, 3, 2]));
        assert_eq!(reader.actors()[0].file, "actors/walker/walker.glb");
        assert_eq!(fs::read(target.join("actors/walker/maps/skin.png")).unwrap(), b"its skin");
        // a bundle is replaced with all that is in it
        write_moving(&target, layout, &folder.path().join("files"));
    }
}

#[test]
fn a_large_grid_is_written_in_pieces() {
    let layout = LightLayout { sun_steps: 1, coefficients: 4, channels: 1, sun_bounce_functions: 0 };
    let mut points = grid(layout);
    points.cells = (0..25_000).map(|i| [i / 1000, i / 10 % 100, i % 10]).collect();
    points.valid = (0..25_000).map(|i| u8::from(i != 12_345)).collect();
    points.light.sky_transfer = (0..600_000).map(|i| i as f32).collect();
    points.light.sun_mask = (0..150_000).map(|i| u32::from(i / 6 % 3 == 0)).collect();
    points.origin = [1.0e5 + 0.19, -7.0, 33.0];
    points.spacing_m = 0.1;
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    let mut writer = BundleWriter::create(&target, meta(layout)).unwrap();
    common::chunks(layout, None).iter().for_each(|chunk| writer.push_chunk(chunk).unwrap());
    writer.add_grid(&points).unwrap();
    assert!(writer.add_grid(&points).unwrap_err().to_string().contains("already"));
    for i in 0..2 {
        writer.add_sky_map(&format!("sky/{i:04}.hdr"), b"unread").unwrap();
    }
    writer.finish(&common::lapse(layout)).unwrap();
    let read = BundleReader::open(&target).unwrap().read_grid().unwrap().unwrap();
    assert_eq!(*read.points(), points);
}

#[test]
fn files_of_two_actors_are_there_once() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    fs::write(folder.path().join("walker.glb"), "a model").unwrap();
    fs::write(folder.path().join("skin.png"), "its skin").unwrap();
    let mut writer = BundleWriter::create(&target, meta(MONO)).unwrap();
    common::chunks(MONO, None).iter().for_each(|chunk| writer.push_chunk(chunk).unwrap());
    for name in ["walker", "runner"] {
        let mut meta = actor(folder.path());
        meta.actor.name = Some(name.to_owned());
        writer.add_actor(&meta).unwrap();
    }
    for i in 0..2 {
        writer.add_sky_map(&format!("sky/{i:04}.hdr"), b"unread").unwrap();
    }
    writer.finish(&common::lapse(MONO)).unwrap();
    let reader = BundleReader::open(&target).unwrap();
    reader.verify().unwrap();
    assert_eq!(reader.actors().iter().map(|actor| actor.file.as_str()).collect::<Vec<_>>(), ["actors/walker/walker.glb"; 2]);
    assert!(!target.join("actors/runner").exists());
}

#[test]
fn what_does_not_fit_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = BundleWriter::create(folder.path().join("bundle"), meta(MONO)).unwrap();
    let mut refuse = |change: &dyn Fn(&mut GridPoints), words: &str| {
        let mut points = grid(MONO);
        change(&mut points);
        let error = writer.add_grid(&points).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    refuse(&|points| points.cells.swap(0, 1), "not in order");
    refuse(&|points| points.cells[22] = [1 << 20, 0, 0], "farther out");
    refuse(&|points| points.cells.clear(), "0 points");
    refuse(&|points| points.valid[3] = 2, "neither 0 nor 1");
    refuse(&|points| points.light.sky_transfer[7] = f32::NAN, "not finite");
    refuse(&|points| points.light.sun_mask[2] ^= 1, "masks of a point differ");
    refuse(&|points| points.spacing_m = 0.0, "no lattice");
    refuse(&|points| points.light.sun_bounce.truncate(3), "sun_bounce has");
    refuse(&|points| *points = grid(RGB), "the grid's light is");

    fs::write(folder.path().join("walker.glb"), "a model").unwrap();
    fs::write(folder.path().join("skin.png"), "its skin").unwrap();
    writer.add_actor(&actor(folder.path())).unwrap();
    let mut other = actor(folder.path());
    assert!(writer.add_actor(&other).unwrap_err().to_string().contains("two actors are called `walker`"));
    let mut refuse = |name: &str, file: &str, words: &str| {
        other.actor.name = Some(name.to_owned());
        other.files[1] = ActorFile { source: folder.path().join("skin.png"), name: file.to_owned() };
        let error = writer.add_actor(&other).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    refuse("a", "../skin.png", "plain name");
    refuse("b", "walker.glb", "two of its files");
    other.files[1].source = folder.path().join("nothing.png");
    other.actor.name = Some("c".to_owned());
    other.files[1].name = "nothing.png".to_owned();
    assert!(writer.add_actor(&other).unwrap_err().to_string().contains("nothing.png"));
}

fn edit(path: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(path).unwrap();
    assert!(text.contains(from), "{from}");
    fs::write(path, text.replacen(from, to, 1)).unwrap();
}

#[test]
fn damaged_grids_and_actors_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    let manifest = target.join("manifest.json");
    let read = || BundleReader::open(&target).and_then(|reader| reader.read_grid().map(drop));
    for (from, to) in [
        ("\"version\": 2", "\"version\": 1"),
        ("\"points\": 23", "\"points\": 24"),
        ("\"points\": 23", "\"points\": 23000000000"),
        ("\"file\": \"grid.glb\"", "\"file\": \"../grid.glb\""),
        ("\"file\": \"grid.glb\"", "\"file\": \"site.glb\""),
        ("\"spacing_m\": 0.5", "\"spacing_m\": 0.3"),
        ("\"spacing_m\": 0.5", "\"spacing_m\": 0.0"),
        ("\"spacing_m\": 0.5", "\"spacing_m\": -1e300"),
        ("\"file\": \"actors/walker/walker.glb\"", "\"file\": \"/etc/passwd\""),
        ("\"walk_speed\": 1.3", "\"walk_speed\": 0.0"),
        ("\"walk\": \"circle\"", "\"walk\": \"round\""),
    ] {
        fs::remove_dir_all(&target).ok();
        write_moving(&target, MONO, &folder.path().join("files"));
        read().unwrap();
        edit(&manifest, from, to);
        assert!(read().is_err(), "{from} as {to}");
    }
    fs::remove_dir_all(&target).unwrap();
    write_moving(&target, MONO, &folder.path().join("files"));
    let whole = fs::read(target.join("grid.glb")).unwrap();
    for cut in [0, 11, 30, whole.len() / 2, whole.len() - 1] {
        fs::write(target.join("grid.glb"), &whole[..cut]).unwrap();
        assert!(read().is_err(), "cut at {cut}");
    }
    for at in (0..whole.len()).step_by(7) {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x55;
        fs::write(target.join("grid.glb"), &bytes).unwrap();
        // must not panic or ask for memory without bound; values may change silently
        let _ = read();
    }
}

/// A line of four points along +X, the third of them in stone; of the first two the sun reaches the second.
fn line() -> Grid {
    let layout = LightLayout { sun_steps: 5, coefficients: 4, channels: 1, sun_bounce_functions: 0 };
    let mut points = grid(layout);
    points.cells = (0..4).map(|x| [x, 0, 0]).collect();
    points.valid = vec![1, 1, 0, 1];
    points.origin = [0.0; 3];
    points.spacing_m = 1.0;
    points.light.sky_transfer = (0..4 * 24).map(|i| if i % 4 == 0 { (i / 24 * 10 + i / 4 % 6) as f32 } else { 0.0 }).collect();
    points.light.sun_mask = (0..24).map(|i| u32::from(i / 6 != 0) * 0b11111).collect();
    points.light.sun_bounce = Vec::new();
    Grid::new(points).unwrap()
}

fn noon(layout: LightLayout) -> Moment {
    let lapse = common::lapse(layout);
    Day::new(&lapse).at(7.0 * 3600.0, Blend::Hard)
}

#[test]
fn light_between_points_is_mixed_and_stone_gives_none() {
    let grid = line();
    let moment = noon(grid.points().light.layout());
    let scale = moment.shading.sky[0];
    let at = |x: f32, y: f32, z: f32| grid.light_at(&moment, Vec3::new(x, y, z));
    let near =
        |light: Vec3, expected: f32| assert!((light - scale * expected).abs().max_element() < 1e-4, "{light} {expected}");
    let first = at(0.0, 0.0, 0.0).unwrap();
    (0..6).for_each(|axis| near(first.sky_and_bounce[axis], axis as f32));
    assert_eq!((first.sun_visible, at(1.0, 0.0, 0.0).unwrap().sun_visible), (0.0, 1.0));
    let quarter = at(0.25, 0.0, 0.0).unwrap();
    near(quarter.sky_and_bounce[2], 4.5);
    assert!((quarter.sun_visible - 0.25).abs() < 1e-6);
    let sample = grid.sample(Vec3::new(0.25, 0.0, 0.0)).unwrap();
    assert!((grid.sun_fraction(&sample, 3) - 0.25).abs() < 1e-6);
    // the third point lies in stone: beside it the second and the fourth are all there is
    near(at(1.9, 0.0, 0.0).unwrap().sky_and_bounce[0], 10.0);
    near(at(2.1, 0.0, 0.0).unwrap().sky_and_bounce[0], 30.0);
    near(at(2.0, 0.0, 0.0).unwrap().sky_and_bounce[0], 20.0);
    // off the lattice, as far as two cells
    near(at(-0.5, 0.0, 0.0).unwrap().sky_and_bounce[0], 0.0);
    near(at(-1.5, 0.0, 0.0).unwrap().sky_and_bounce[0], 0.0);
    near(at(4.9, 0.0, 0.0).unwrap().sky_and_bounce[0], 30.0);
    let above = at(0.5, 1.5, 0.0).unwrap();
    near(above.sky_and_bounce[0], 5.0);
    assert!(at(-2.1, 0.0, 0.0).is_none() && at(0.0, 0.0, 2.1).is_none() && at(1e30, 0.0, 0.0).is_none());
    assert!(at(f32::NAN, 0.0, 0.0).is_none());

    // all in stone: what they have borrowed
    let mut points = grid.points().clone();
    points.valid.fill(0);
    let stone = Grid::new(points).unwrap();
    near(stone.light_at(&moment, Vec3::new(0.5, 0.0, 0.0)).unwrap().sky_and_bounce[0], 5.0);
}

#[test]
fn light_is_that_of_vertices_and_the_cube_mixes_it_by_squares() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("bundle");
    write_moving(&target, RGB, folder.path());
    let reader = BundleReader::open(&target).unwrap();
    let grid = reader.read_grid().unwrap().unwrap();
    let day = Day::new(reader.lapse());
    for minutes in [417.0, 430.0, 503.0, 641.0] {
        let moment = day.at(60.0 * minutes, Blend::Smooth);
        for point in (0..grid.point_count()).filter(|&point| grid.points().valid[point] == 1) {
            let cube = grid.light_at(&moment, grid.position(point)).unwrap();
            for (axis, normal) in heliodon_bundle::grid::AXES.into_iter().enumerate() {
                let own = vertex_light(&moment, &grid.points().light, 6 * point + axis, normal);
                assert!((cube.sky_and_bounce[axis] - (own.sky + own.bounce)).abs().max_element() < 1e-4);
                assert!((cube.light(&moment, normal) - own.total()).abs().max_element() < 1e-4);
            }
            let [a, b] = [cube.sky_and_bounce[1], cube.sky_and_bounce[4]];
            let mixed = cube.ambient(Vec3::new(-0.6, 0.0, 0.8));
            assert!((mixed - (a * 0.36 + b * 0.64)).abs().max_element() < 1e-4);
            let sun = cube.light(&moment, moment.sun_direction) - cube.ambient(moment.sun_direction);
            assert!((sun - moment.shading.sun_irradiance * cube.sun_visible * FRAC_1_PI).abs().max_element() < 1e-4);
        }
    }
}
