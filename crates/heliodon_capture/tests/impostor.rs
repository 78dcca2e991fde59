//! Captured models against the models themselves.

#![expect(clippy::unwrap_used, reason = "a test ends where something fails")]

use glam::{Vec2, Vec3};
use heliodon_bundle::impostor::{Choice, Impostor, ImpostorInfo, Look, Ring, axes};
use heliodon_capture::impostor::{CaptureError, CaptureParams, MARGIN, capture, plan};
use heliodon_image::Bc7Quality;
use heliodon_mesh::Mesh;
use heliodon_mesh::export::write_glb;
use heliodon_mesh::figures::walker;
use heliodon_mesh::import::{ImportOptions, ImportReport};
use heliodon_mesh::motion::{MovingMesh, Pose, read_moving};
use heliodon_rays::{BuildParams, Hit, Ray, TriangleScene};
use heliodon_testkit::flip::mean_flip;
use heliodon_testkit::scenes::ball;

/// Few samples, few rays, drafts of blocks.
fn quick(rings: Vec<Ring>) -> CaptureParams {
    CaptureParams { rings, samples: 3, openness_rays: 0, quality: Bc7Quality::Draft, ..CaptureParams::crowd() }
}

fn walking() -> MovingMesh {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("walker.glb");
    write_glb(&file, &walker()).unwrap();
    read_moving(&file, &ImportOptions::default(), &mut ImportReport::default()).unwrap()
}

fn still_ball(radius: f32) -> MovingMesh {
    let scene = ball(radius, 64).moved(Vec3::Y);
    MovingMesh::still(Mesh {
        positions: scene.positions,
        normals: scene.normals,
        triangles: scene.triangles,
        ..Mesh::default()
    })
}

fn captured(model: &MovingMesh, params: &CaptureParams) -> Impostor {
    let impostor = capture(model, "model", params, &|_| ()).unwrap();
    let bytes = impostor.to_bytes("model").unwrap();
    assert_eq!(Impostor::from_bytes(&bytes, "model").unwrap(), impostor);
    impostor
}

#[test]
fn a_ball_is_as_round_from_everywhere() {
    let params = CaptureParams {
        frame_px: Some([64, 64]),
        quality: Bc7Quality::Usual,
        ..quick(vec![Ring::around(0.0, 16), Ring::around(40.0, 12), Ring::around(80.0, 8)])
    };
    let look = Look::new(&captured(&still_ball(0.5), &params));
    assert!((look.info().radius_m - 0.5).abs() < 0.01 && look.info().middle().abs_diff_eq(Vec3::Y, 1e-3));
    for (elevation, azimuth) in [(0.0, 0.0), (0.0, 22.5), (30.0, 10.0), (60.0, 45.0), (20.0, 200.0)] {
        let [right, up, toward] = axes(elevation, azimuth);
        let eye = look.info().middle() + toward * 6.0;
        let choice = look.info().choose(toward);
        let (mut covered, mut texels) = (0.0, 0.0);
        let step = 0.02;
        for (i, j) in (-40..=40).flat_map(|i| (-40..=40).map(move |j| (i, j))) {
            // through a plane before the ball, so that all rays meet it as its silhouette is wide
            let target = look.info().middle() + right * (i as f32 * step) + up * (j as f32 * step);
            let ray = (target - eye).normalize_or_zero();
            let Some(seen) = look.at(0, &choice, eye, ray, 3) else { continue };
            covered += seen.cover;
            // well within the silhouette place and normal are the ball's
            if Vec2::new(i as f32, j as f32).length() * step < 0.4 {
                texels += 1.0;
                assert!(seen.cover > 0.7, "{elevation} {azimuth}: {seen:?}");
                let from_middle = seen.place - look.info().middle();
                assert!((from_middle.length() - 0.5).abs() < 0.045, "{elevation} {azimuth}: {from_middle}");
                assert!(seen.normal.dot(from_middle.normalize_or_zero()) > 0.95, "{elevation} {azimuth}: {seen:?}");
                assert!(seen.albedo.abs_diff_eq(Mesh::UNSAID_ALBEDO, 0.03) && seen.openness > 0.97, "{seen:?}");
            }
        }
        // between views edges are covered by some of them only; from 6 m the silhouette of a ball of 0.5 is a little larger than it
        let area = covered * step * step;
        let wanted = std::f32::consts::PI * 0.25 / (1.0 - 0.25 / 36.0);
        assert!(texels > 1000.0 && (area / wanted - 1.0).abs() < 0.07, "{elevation} {azimuth}: {area} for {wanted}");
    }
}

#[test]
fn no_frame_touches_its_border_and_none_is_smaller_than_it_need_be() {
    let params = CaptureParams { frames_per_s: 4.0, ..quick(vec![Ring::around(5.0, 5), Ring::around(50.0, 3)]) };
    let impostor = captured(&walking(), &params);
    let ([width, height], [columns, _]) = (impostor.info.frame_px, impostor.info.grid);
    for view in 0..impostor.info.views() {
        // how near to each border any frame comes
        let mut nearest = [u32::MAX; 4];
        let ([side, _], texels) = impostor.layer(2 * view, 0);
        for frame in 0..impostor.info.frames() {
            let [left, top] = [frame % columns * width, frame / columns * height];
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                if texels[((top + y) * side + left + x) as usize][3] > 8 {
                    let off = [x, y, width - 1 - x, height - 1 - y];
                    nearest = [0, 1, 2, 3].map(|k| nearest[k].min(off[k]));
                }
            }
        }
        assert!(nearest.iter().all(|&off| off >= MARGIN), "view {view}: {nearest:?}");
        // all frames together come as near to opposite borders as a texel and a half more
        assert!(
            nearest[0].max(nearest[2]) <= MARGIN + 2 && nearest[1].max(nearest[3]) <= MARGIN + 2,
            "view {view}: {nearest:?}"
        );
    }
}

#[test]
fn colours_go_on_beyond_the_edge() {
    // a red ball: no texel anywhere is darker or of another colour
    let scene = ball(0.5, 64);
    let colors_linear = vec![Vec3::new(0.81, 0.16, 0.04); scene.positions.len()];
    let mesh = Mesh {
        positions: scene.positions,
        normals: scene.normals,
        triangles: scene.triangles,
        colors_linear,
        ..Mesh::default()
    };
    let params = CaptureParams { frame_px: Some([48, 48]), quality: Bc7Quality::Usual, ..quick(vec![Ring::around(0.0, 2)]) };
    let impostor = captured(&MovingMesh::still(mesh), &params);
    for level in 0..impostor.texture.levels.len() {
        for texel in impostor.layer(0, level).1 {
            let [r, g, b] = [texel[0], texel[1], texel[2]];
            assert!(r.abs_diff(230) <= 6 && g.abs_diff(102) <= 6 && b.abs_diff(51) <= 6, "level {level}: {texel:?}");
        }
    }
}

#[test]
fn the_same_whatever_the_number_of_threads() {
    let model = walking();
    let params =
        CaptureParams { frames_per_s: 2.0, openness_rays: 8, frame_px: Some([32, 64]), ..quick(vec![Ring::around(5.0, 3)]) };
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(|| captured(&model, &params));
    assert_eq!(alone, captured(&model, &params));
}

#[test]
fn what_cannot_be_captured_is_refused_in_words() {
    let plain = quick(vec![Ring::around(0.0, 4)]);
    let refused = |model: &MovingMesh, params: CaptureParams| plan(model, "model", &params).unwrap_err();
    let no_faces = MovingMesh::still(Mesh { positions: vec![Vec3::ZERO, Vec3::X], ..Mesh::default() });
    assert!(matches!(refused(&no_faces, plain.clone()), CaptureError::Model(what) if what.contains("no faces")));
    let point = MovingMesh::still(Mesh { positions: vec![Vec3::ONE; 3], triangles: vec![[0, 1, 2]], ..Mesh::default() });
    assert!(matches!(refused(&point, plain.clone()), CaptureError::Model(what) if what.contains("nothing to see")));
    let ball = still_ball(0.5);
    type Wrong = fn(&mut CaptureParams);
    let wrongs: [(Wrong, &str); 7] = [
        (|p| p.rings.clear(), "0 views"),
        (|p| p.rings[0].views = 129, "129 views"),
        (|p| p.frame_px = Some([20, 16]), "20 x 16"),
        (|p| p.distance_m = 0.0, "a distance"),
        (|p| p.samples = 9, "9 samples"),
        (|p| p.clips = vec![3], "clip 3 of 0"),
        (|p| p.distance_m = 1e-3, "texels"),
    ];
    for (wrong, words) in wrongs {
        let mut params = plain.clone();
        wrong(&mut params);
        let error = refused(&ball, params).to_string();
        assert!(error.contains(words) && error.contains(';'), "{error}");
    }
    let long = CaptureParams { frames_per_s: 100.0, frame_px: Some([2048, 2048]), ..plain };
    assert!(refused(&walking(), long).to_string().contains("do not fit on a layer"));
}

const SIZE: [u32; 2] = [176, 272];
/// Of a pixel, radians: 768 pixels over 50 degrees.
const PX_PER_RADIAN: f32 = 823.5;

/// A picture of a figure from an eye that looks at its middle, over a sky; `shade` tells a ray's albedo times light, and how much it covers.
fn picture(info: &ImpostorInfo, eye: Vec3, samples: u32, shade: impl Fn(Vec3) -> Option<(Vec3, f32)>) -> Vec<[u8; 3]> {
    let forward = (info.middle() - eye).normalize_or_zero();
    let right = forward.cross(Vec3::Y).normalize_or_zero();
    let up = right.cross(forward);
    let sky = Vec3::new(0.2, 0.42, 0.85);
    let mut pixels = Vec::new();
    for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
        let mut sum = Vec3::ZERO;
        for k in 0..samples * samples {
            let sub = Vec2::new((k % samples) as f32 + 0.5, (k / samples) as f32 + 0.5) / samples as f32;
            let at = (Vec2::new(x as f32, y as f32) + sub - Vec2::new(SIZE[0] as f32, SIZE[1] as f32) * 0.5) / PX_PER_RADIAN;
            let (color, cover) = shade((forward + right * at.x - up * at.y).normalize_or_zero()).unwrap_or((Vec3::ZERO, 0.0));
            sum += color * cover + sky * (1.0 - cover);
        }
        let mean = sum / (samples * samples) as f32;
        pixels.push(mean.to_array().map(heliodon_math::color::srgb8_from_linear));
    }
    pixels
}

fn lit(albedo: Vec3, normal: Vec3) -> Vec3 {
    let sun = Vec3::new(0.55, 0.7, 0.45);
    albedo * (0.35 + 0.25 * normal.y + 0.9 * normal.dot(sun).max(0.0))
}

/// The model itself.
fn real(model: &MovingMesh, clip: usize, time_s: f32, info: &ImpostorInfo, eye: Vec3) -> Vec<[u8; 3]> {
    let mut pose = Pose::default();
    model.pose(clip, time_s, &mut pose);
    let triangles = &model.rest().triangles;
    let scene = TriangleScene::build(&pose.positions, triangles, &BuildParams::default()).unwrap();
    picture(info, eye, 4, |direction| {
        let mut hit = [Hit::MISS];
        scene.closest(&[Ray { origin: eye, direction, t_min: 0.0, t_max: f32::INFINITY }], &mut hit);
        let [hit] = hit;
        hit.is_some().then(|| {
            let [a, b, c] = triangles[hit.triangle as usize].map(|vertex| vertex as usize);
            let normal = pose.normals[a] * (1.0 - hit.u - hit.v) + pose.normals[b] * hit.u + pose.normals[c] * hit.v;
            let material = model.rest().triangle_material.get(hit.triangle as usize).copied().unwrap_or(0);
            let color = |vertex| model.rest().corner_albedo(vertex, material);
            let albedo = color(a) * (1.0 - hit.u - hit.v) + color(b) * hit.u + color(c) * hit.v;
            let normal = if hit.back { -normal } else { normal };
            (lit(albedo, normal.normalize_or_zero()), 1.0)
        })
    })
}

fn shown(look: &Look, frame: u32, choice: &Choice, eye: Vec3, steps: u32) -> Vec<[u8; 3]> {
    picture(look.info(), eye, 1, |direction| {
        let seen = look.at(frame, choice, eye, direction, steps)?;
        Some((lit(seen.albedo, seen.normal), seen.cover))
    })
}

#[test]
fn blended_views_look_like_the_model_and_do_not_jump() {
    let model = walking();
    let walk = model.clip_named("walk").unwrap();
    let params = CaptureParams {
        clips: vec![walk],
        frames_per_s: 4.0,
        distance_m: 8.0,
        px_per_radian: PX_PER_RADIAN,
        quality: Bc7Quality::Usual,
        ..quick(CaptureParams::crowd().rings)
    };
    let impostor = captured(&model, &params);
    let look = Look::new(&impostor);
    let info = look.info();
    let time_of = |frame: u32| info.clips[0].duration_s * frame as f32 / info.clips[0].frames as f32;
    let eye_at = |elevation: f32, azimuth: f32| info.middle() + axes(elevation, azimuth)[2] * 8.0;
    let (mut sum, mut count, mut worst) = (0.0, 0, 0.0_f32);
    for (i, (elevation, azimuth)) in
        [(-3.0, 15.0), (2.0, 100.0), (5.0, 190.0), (8.0, 281.0), (14.0, 40.0), (20.0, 131.0), (25.0, 222.0), (29.0, 349.0)]
            .into_iter()
            .enumerate()
    {
        let (eye, frame) = (eye_at(elevation, azimuth), i as u32 % info.frames());
        let reference = real(&model, walk, time_of(frame), info, eye);
        let choice = info.choose(eye - info.middle());
        let error = mean_flip(&reference, &shown(&look, frame, &choice, eye, 2), SIZE[0], SIZE[1]);
        (sum, count, worst) = (sum + error, count + 1, worst.max(error));
    }
    let mean = sum / count as f32;
    // a slow orbit, half a degree a frame, over six views
    let (mut jump, mut jump_of_nearest) = (0.0_f32, 0.0_f32);
    let mut last: Option<[Vec<[u8; 3]>; 2]> = None;
    for step in 0..120 {
        let eye = eye_at(8.0, 30.0 + 0.5 * step as f32);
        let toward = eye - info.middle();
        let now = [info.choose(toward), info.nearest(toward)].map(|choice| shown(&look, 0, &choice, eye, 2));
        if let Some(last) = &last {
            let [blended, nearest] = [0, 1].map(|k| mean_flip(&last[k], &now[k], SIZE[0], SIZE[1]));
            (jump, jump_of_nearest) = (jump.max(blended), jump_of_nearest.max(nearest));
        }
        last = Some(now);
    }
    println!("mean FLIP {mean:.4}, worst {worst:.4}; jump {jump:.4}, of nearest views {jump_of_nearest:.4}");
    assert!(mean < 0.06, "{mean}");
    assert!(jump < jump_of_nearest / 3.0, "{jump} against {jump_of_nearest}");
}
