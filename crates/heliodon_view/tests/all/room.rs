//! Pictures of a room's screens against what geometry says of them.

#![expect(clippy::unwrap_used, reason = "a test ends where something fails")]

use crate::common;
use bevy::prelude::*;
use bevy::render::renderer::{RenderAdapterInfo, RenderDevice};
use glam::DVec3;
use heliodon_bundle::display::{Display, Passes, Preset};
use heliodon_image::SrgbImage;
use heliodon_math::screen::Screen;
use heliodon_view::display::place::WorldFromRoom;
use heliodon_view::display::{Room, RoomEye};
use heliodon_view::headless::room::{RoomPictures, RoomRenderer};
use heliodon_view::headless::{RenderOptions, Shot, ShotExposure};
use heliodon_view::{Blend, OnePassPairs, Pose, StereoPasses, ToneCurve};
use std::path::Path;
use std::sync::Arc;

fn shot() -> Shot {
    Shot {
        clock_s: 43_200.0,
        pose: Pose { eye: Vec3::ZERO, yaw_rad: 0.0, pitch_rad: 0.0 },
        fov_deg: 50.0,
        // Black, so that nothing is seen but what shines by itself.
        exposure: ShotExposure::Stops(-30.0),
        curve: ToneCurve::Clamp,
        blend: Blend::Smooth,
        actors_s: 0.0,
    }
}

/// FlatWorld with small pictures, and a recording in which its head stands still at `head`.
fn flatworld(folder: &Path, head: Vec3, change: impl FnOnce(String) -> String) -> Arc<Display> {
    let text = change(Preset::Flatworld.file().to_toml_string().replace("[1024, 768]", "[640, 480]"));
    let recording = folder.join("still.poses");
    std::fs::write(&recording, format!("0 0 {} {} {} 0 0 0 1\n", head.x, head.y, head.z)).unwrap();
    Arc::new(Display::parse(&text, "display.toml").unwrap_or_else(|error| panic!("{error}")).with_recording(&recording, false))
}

struct Stage {
    renderer: RoomRenderer,
    screens: Vec<Screen>,
    world_from_room: WorldFromRoom,
    _folder: tempfile::TempDir,
}

/// A court of columns seen through a display.
fn stage(head: Vec3, of: RoomPictures, change: impl FnOnce(String) -> String) -> Stage {
    sampled_stage(head, of, 2, change)
}

fn sampled_stage(head: Vec3, of: RoomPictures, samples: u32, change: impl FnOnce(String) -> String) -> Stage {
    let folder = tempfile::tempdir().unwrap();
    let bundle = folder.path().join("court");
    common::Court::small().write(&bundle).unwrap();
    let display = flatworld(folder.path(), head, change);
    let mut renderer = RoomRenderer::new(&bundle, &display, of, None, RenderOptions { samples }).unwrap();
    renderer.render(&shot(), 0.0).unwrap();
    let visitor = renderer.visitor().unwrap();
    let screens = Room::new(Arc::clone(&display)).unwrap().screens().to_vec();
    Stage { renderer, screens, world_from_room: WorldFromRoom::new(&display, &visitor), _folder: folder }
}

impl Stage {
    /// Puts something white that shines into the room's coordinates.
    fn shine(&mut self, mesh: impl Into<Mesh>, in_room: Transform) {
        let placed = Transform {
            translation: self.world_from_room.point(in_room.translation),
            rotation: self.world_from_room.rotation * in_room.rotation,
            scale: in_room.scale,
        };
        let world = self.renderer.app_mut().world_mut();
        let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh.into());
        let white = StandardMaterial { base_color: Color::WHITE, unlit: true, ..Default::default() };
        let material = world.resource_mut::<Assets<StandardMaterial>>().add(white);
        world.spawn((Mesh3d(mesh), MeshMaterial3d(material), placed));
    }

    /// The pictures once all that shines is there: meshes and pipelines take frames to arrive.
    fn pictures(&mut self) -> Vec<(String, SrgbImage)> {
        let names: Vec<String> = self.renderer.pictures().map(|(name, _)| name.to_owned()).collect();
        let mut made = Vec::new();
        for _ in 0..4 {
            made = self.renderer.render(&shot(), 0.0).unwrap();
        }
        names.into_iter().zip(made).collect()
    }
}

/// Linear light of a pixel, 0 to 1.
fn light(picture: &SrgbImage, x: u32, y: u32) -> f64 {
    f64::from(heliodon_math::color::linear_from_srgb(f32::from(picture.pixel(x, y)[1]) / 255.0))
}

/// The middle of what shines in a column of pixels, in rows from above, where there is any that ends within the picture.
fn middle_of_column(picture: &SrgbImage, x: u32) -> Option<f64> {
    let rows = picture.height;
    let column: Vec<f64> = (0..rows).map(|y| light(picture, x, y)).collect();
    let sum: f64 = column.iter().sum();
    let inside = column[0] < 1e-3 && column[rows as usize - 1] < 1e-3;
    (sum > 0.5 && inside).then(|| column.iter().enumerate().map(|(y, v)| (y as f64 + 0.5) * v).sum::<f64>() / sum)
}

#[test]
fn a_straight_line_across_two_walls_is_straight_from_the_eyes_place() {
    let mut measured = Vec::new();
    for head in [Vec3::new(0.0, 1.65, 0.0), Vec3::new(0.7, 1.4, -0.6), Vec3::new(-0.5, 1.8, 0.5)] {
        let mut stage = stage(head, RoomPictures::Eyes, |text| {
            text.replace("stereo = \"pair\"", "stereo = \"mono\"")
                .replace("output_right = { size_px = [640, 480] }", "# no second")
        });
        // From far left below to far right above, behind the walls.
        let (from, to) = (Vec3::new(-14.0, -1.0, -14.0), Vec3::new(16.0, 5.0, -11.0));
        let along = to - from;
        let rotation = Quat::from_rotation_arc(Vec3::X, along / along.length());
        stage.shine(
            Cuboid::new(along.length(), 0.12, 0.12),
            Transform { translation: (from + to) * 0.5, rotation, scale: Vec3::ONE },
        );
        let pictures = stage.pictures();
        assert_eq!(pictures.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["left", "right"]);
        // The eye and the line span a plane.
        let normal = (from - head).as_dvec3().cross((to - head).as_dvec3());
        for (screen, (name, picture)) in stage.screens.iter().zip(&pictures) {
            let (columns, rows) = (picture.width, picture.height);
            let mut seen = 0;
            for x in 0..columns {
                let Some(y) = middle_of_column(picture, x) else { continue };
                let u = (f64::from(x) + 0.5) / f64::from(columns);
                let on_wall = |v: f64| normal.dot(screen.point(u, v) - head.as_dvec3());
                // Where the plane meets this column of the wall: what is on it is linear in v.
                let v = on_wall(0.0) / (on_wall(0.0) - on_wall(1.0));
                let wanted = (1.0 - v) * f64::from(rows);
                measured.push((y - wanted).abs());
                assert!((y - wanted).abs() < 0.5, "{name}, column {x}: {y} for {wanted}");
                seen += 1;
            }
            assert!(seen > columns / 6, "{name}: the line is seen in {seen} columns");
        }
    }
    // Perspective makes one side of a bar thicker than the other, so that its middle is a little off its axis.
    let mean = measured.iter().sum::<f64>() / measured.len() as f64;
    let most = measured.iter().copied().fold(0.0, f64::max);
    assert!(mean < 0.2, "{mean} pixels off in the mean of {}, {most} at most", measured.len());
}

#[test]
fn eyes_differ_by_the_parallax_that_geometry_predicts() {
    let head = Vec3::new(0.1, 1.6, 0.2);
    let mut stage = stage(head, RoomPictures::Eyes, |text| text);
    let ball = Vec3::new(-4.0, 1.4, -3.5);
    stage.shine(Sphere::new(0.25), Transform::from_translation(ball));
    let pictures = stage.pictures();
    let names: Vec<&str> = pictures.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["left-left", "left-right", "right-left", "right-right"]);
    let middle = |picture: &SrgbImage| {
        let mut sum = [0.0; 3];
        for y in 0..picture.height {
            for x in 0..picture.width {
                let v = light(picture, x, y);
                sum = [sum[0] + v, sum[1] + v * (f64::from(x) + 0.5), sum[2] + v * (f64::from(y) + 0.5)];
            }
        }
        assert!(sum[0] > 20.0, "the ball is seen");
        [sum[1] / sum[0], sum[2] / sum[0]]
    };
    let screen = &stage.screens[0];
    let predicted = [-0.5, 0.5].map(|side| {
        let eye = head.as_dvec3() + DVec3::X * (0.063 * side);
        let [u, v] = screen.seen_at(eye, ball.as_dvec3()).unwrap();
        [u * f64::from(pictures[0].1.width), (1.0 - v) * f64::from(pictures[0].1.height)]
    });
    let [left, right] = [middle(&pictures[0].1), middle(&pictures[1].1)];
    let parallax = right[0] - left[0];
    let wanted = predicted[1][0] - predicted[0][0];
    assert!(wanted.abs() > 2.0, "{wanted} pixels are too few to measure");
    assert!((parallax - wanted).abs() < 0.1, "{parallax} for {wanted} pixels");
    // A ball's picture off the axis is an ellipse whose middle is not the ball's.
    assert!((left[0] - predicted[0][0]).abs() < 1.0 && (left[1] - predicted[0][1]).abs() < 1.0, "{left:?} {predicted:?}");
}

/// One wall with both eyes, shown in some way.
fn one_wall(how: &str) -> impl FnOnce(String) -> String + use<> {
    let how = how.to_owned();
    move |text| {
        let right = text.find("[[screen]]\nname = \"right\"").unwrap();
        let tracker = text.find("# [[tracker]]").unwrap();
        let (left, rest) = (&text[..right], &text[tracker..]);
        let left = left.replace("stereo = \"pair\"", &how).replace("output_right = { size_px = [640, 480] }", "# no second");
        format!("{left}{rest}")
    }
}

/// Whether two pixels are the same but for rounding.
fn close(a: [u8; 4], b: [u8; 4]) -> bool {
    (0..3).all(|c| a[c].abs_diff(b[c]) <= 1)
}

/// A ball that stands far enough to the side for both eyes' pictures to differ.
fn with_ball(how: &str, of: RoomPictures) -> Vec<(String, SrgbImage)> {
    let mut stage = stage(Vec3::new(0.0, 1.65, 0.0), of, one_wall(how));
    stage.shine(Sphere::new(0.9), Transform::from_xyz(-2.6, 1.4, -3.0));
    stage.pictures()
}

#[test]
fn both_eyes_share_an_output_as_its_stereo_says() {
    for (how, pick) in [
        ("rows", (|_x, y| y % 2 == 1) as fn(u32, u32) -> bool),
        ("columns", |x, _y| x % 2 == 1),
        ("checkerboard", |x, y| (x + y) % 2 == 1),
    ] {
        // Samples of an output's pixel are pixels of the projector's own: patterns are of those.
        let eyes = with_ball(&format!("stereo = \"{how}\""), RoomPictures::Eyes);
        let change = one_wall(&format!("stereo = \"{how}\""));
        let mut stage = sampled_stage(Vec3::new(0.0, 1.65, 0.0), RoomPictures::Outputs, 1, change);
        stage.shine(Sphere::new(0.9), Transform::from_xyz(-2.6, 1.4, -3.0));
        let output = stage.pictures().remove(0).1;
        let (mut asked, mut differ) = (0, 0);
        for y in 0..480 {
            for x in 0..640 {
                let [left, right] = [&eyes[0].1, &eyes[1].1].map(|eye| eye.pixel(x, y));
                // Where an eye's picture has edges, one sample is not the mean of four.
                if !close(left, [0, 0, 0, 255]) && !close(left, [255; 4])
                    || !close(right, [0, 0, 0, 255]) && !close(right, [255; 4])
                {
                    continue;
                }
                let wanted = if pick(x, y) { right } else { left };
                asked += 1;
                differ += u32::from(!close(output.pixel(x, y), wanted));
            }
        }
        assert!(differ * 1000 < asked, "{how}: {differ} of {asked} pixels are the other eye's");
        assert!((0..480).any(|y| (0..640).any(|x| eyes[0].1.pixel(x, y) != eyes[1].1.pixel(x, y))));
    }
    let anaglyph = with_ball("stereo = \"anaglyph\"", RoomPictures::Outputs).remove(0).1;
    let eyes = with_ball("stereo = \"anaglyph\"", RoomPictures::Eyes);
    for y in (0..480).step_by(3) {
        for x in (0..640).step_by(3) {
            let ([red, ..], [_, green, blue, _]) = (eyes[0].1.pixel(x, y), eyes[1].1.pixel(x, y));
            assert!(close(anaglyph.pixel(x, y), [red, green, blue, 255]), "{x} {y}");
        }
    }
}

#[test]
fn halves_hold_the_eyes_pictures() {
    for (how, right_at) in [("side-by-side", [320, 0]), ("top-bottom", [0, 240])] {
        let output = with_ball(&format!("stereo = \"{how}\""), RoomPictures::Outputs).remove(0).1;
        let eyes = with_ball(&format!("stereo = \"{how}\""), RoomPictures::Eyes);
        let (width, height) = (eyes[0].1.width, eyes[0].1.height);
        assert_eq!([width, height], [640 - right_at[0], 480 - right_at[1]]);
        for y in (0..height).step_by(5) {
            for x in (0..width).step_by(5) {
                assert!(close(output.pixel(x, y), eyes[0].1.pixel(x, y)), "{how}: {x} {y}");
                assert!(close(output.pixel(x + right_at[0], y + right_at[1]), eyes[1].1.pixel(x, y)), "{how}: {x} {y}");
            }
        }
    }
}

#[test]
fn blended_edges_add_up_and_colours_are_corrected() {
    let how = "stereo = \"mono\"\nblend = { left = 0.25, right = 0.25, gamma = 2.2 }\ncolour = { gain = [1.0, 0.5, 1.0] }";
    let mut stage = stage(Vec3::new(0.0, 1.65, 0.0), RoomPictures::Outputs, one_wall(how));
    // All around the visitor.
    stage.shine(Cuboid::new(0.02, 40.0, 40.0), Transform::from_xyz(-3.0, 0.0, 0.0));
    stage.shine(Cuboid::new(40.0, 40.0, 0.02), Transform::from_xyz(0.0, 0.0, -3.0));
    let picture = stage.pictures().remove(0).1;
    assert!(close(picture.pixel(320, 240), [255, 128, 255, 255]));
    // What the projector makes of a code, and what its neighbour makes of the same place.
    let shown = |x: u32| (f64::from(picture.pixel(x, 240)[0]) / 255.0).powf(2.2);
    for x in 0..160 {
        let sum = shown(x) + shown(640 - 160 + x);
        assert!((sum - 1.0).abs() < 0.02, "{x}: {sum}");
    }
    assert!(shown(0) < 0.01 && shown(159) > 0.98);
}

#[test]
fn both_eyes_in_one_pass_are_as_in_two() {
    let ball = Transform::from_xyz(-2.6, 1.4, -6.0);
    let head = Vec3::new(0.2, 1.6, 0.1);
    for samples in [Msaa::Off, Msaa::Sample4] {
        let pictures = |passes: Passes| {
            let mut stage = sampled_stage(head, RoomPictures::Eyes, 1, |text| text);
            stage.shine(Sphere::new(0.9), ball);
            let world = stage.renderer.app_mut().world_mut();
            world.insert_resource(StereoPasses(passes));
            let eyes: Vec<Entity> = world.query_filtered::<Entity, With<RoomEye>>().iter(world).collect();
            for eye in eyes {
                world.entity_mut(eye).insert(samples);
            }
            let shot = Shot { exposure: ShotExposure::Lapse(0.0), clock_s: 36_000.0, ..shot() };
            let mut made = Vec::new();
            for _ in 0..5 {
                made = stage.renderer.render(&shot, 0.0).unwrap();
            }
            let world = stage.renderer.app_mut().world();
            let device = world.resource::<RenderDevice>();
            let can = StereoPasses(Passes::One).is_one(device, true, samples.samples());
            let driver = world.resource::<RenderAdapterInfo>().driver_info.clone();
            (made, world.resource::<OnePassPairs>().count(), can, driver)
        };
        let ((two, none, can, driver), (one, pairs, ..)) = (pictures(Passes::Two), pictures(Passes::One));
        assert_eq!((none, pairs), (0, if can { 2 } else { 0 }), "{samples:?}: pairs in one pass, of two walls");
        assert!(can || !driver.contains("Mesa"), "{driver} has multiview since version 21");
        if !can {
            warn!("{samples:?}: {driver} has no multiview: nothing is compared");
        }
        assert_ne!(two[0], two[1], "eyes differ");
        // llvmpipe of Mesa 22 draws in the first layer alone what has no indices, which is the sky, and clips a little otherwise.
        let old = driver.contains("Mesa 22.");
        let is_nothing = |codes: &[u8; 4]| old && codes[..3] == [43, 44, 47];
        for (number, (one, two)) in one.iter().zip(&two).enumerate() {
            let codes = one.pixels.iter().zip(&two.pixels).filter(|(one, _)| !is_nothing(one));
            let off = |a: &[u8; 4], b: &[u8; 4]| (0..3).any(|c| a[c].abs_diff(b[c]) > 2);
            let (compared, differ) = codes.fold((0, 0), |(all, differ), (a, b)| (all + 1, differ + usize::from(off(a, b))));
            assert!(compared > 100_000, "{samples:?}, picture {number}: {compared} pixels are compared");
            let most = if old { compared / 50 } else { 0 };
            assert!(differ <= most, "{samples:?}, picture {number}: {differ} of {compared} pixels differ");
        }
    }
}
