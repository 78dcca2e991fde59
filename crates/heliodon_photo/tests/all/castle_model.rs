//! Real photographs: four of the castle of Maupertuis, whose cameras come from OpenMVG by way of kapture. Four corners of its walls were marked by eye.
//! Skipped where the photographs are not there.

use glam::{DMat3, DQuat, DVec2, DVec3, Vec3};
use heliodon_image::{Picture, PictureFile, TextureWrap};
use heliodon_math::color::srgb_from_linear;
use heliodon_photo::camera::{Camera, Intrinsics, Pose};
use heliodon_photo::model::table::ShapeRow;
use heliodon_photo::model::{Model, NamedPoint, build};
use heliodon_photo::texture::{GUESSED, Photograph, TextureParams, Textured, texture};
use heliodon_rays::{BuildParams, Hit, Ray, TriangleScene};
use std::path::Path;

/// sensors.txt and trajectories.txt of the data set: qw, qx, qy, qz, tx, ty, tz.
const LENS: Intrinsics = Intrinsics {
    width: 1600,
    height: 1200,
    focal_px: [1_668.793_830_1; 2],
    centre_px: [827.298_962_7, 602.768_243_6],
    radial: [-0.150_638_589_7, 0.197_757_460_1, 0.0],
    tangential: [0.0; 2],
};
const POSES: [[f64; 7]; 4] = [
    [0.999_993_568, 0.000_431_284, 0.003_344_584, -0.001_221_753, -0.028_390_493, 0.002_557_753, 0.024_730_733],
    [-0.998_910_462, -0.004_536_567, 0.044_695_289, 0.012_634_880, -0.051_924_421, 0.003_359_523, 0.023_251_648],
    [0.999_409_309, 0.014_523_314, 0.014_628_603, -0.027_497_444, -0.285_315_632, 0.041_677_393, 0.164_947_361],
    [0.996_972_863, 0.037_987_632, 0.061_301_992, -0.029_053_680, -0.416_841_635, 0.048_597_603, 0.237_398_006],
];
/// About how many metres the reconstruction's unit is, which has none of its own.
const UNIT_M: f64 = 12.0;

/// A photograph, and a pixel of it.
type Mark = (usize, [f64; 2]);

/// Where four corners of the walls are.
const MARKS: [(&str, &[Mark]); 4] = [
    ("near top", &[(0, [1274.2, 189.5]), (1, [1066.0, 173.0]), (2, [848.8, 227.1]), (3, [775.2, 180.3])]),
    ("left top", &[(0, [308.7, 573.4]), (1, [113.3, 568.4]), (2, [166.4, 585.4]), (3, [223.7, 522.9])]),
    ("right top", &[(1, [1523.9, 492.7]), (2, [1451.3, 476.4]), (3, [1460.4, 405.0])]),
    ("near foot", &[(0, [1338.6, 1192.9]), (2, [881.2, 1112.6])]),
];

#[derive(serde::Deserialize)]
struct Table {
    shape: Vec<ShapeRow>,
}

fn cameras() -> Vec<Camera> {
    // the reconstruction has y down
    let up = DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0);
    let camera = |p: &[f64; 7]| {
        let rotation = DQuat::from_xyzw(p[1], p[2], p[3], p[0]) * up;
        let rotation = rotation * (1.0 / rotation.length());
        Camera { intrinsics: LENS, pose: Pose { rotation, translation: DVec3::new(p[4], p[5], p[6]) * UNIT_M } }
    };
    POSES.iter().map(camera).collect()
}

/// Where rays come nearest to one another.
fn back_projected(cameras: &[Camera], marks: &[Mark]) -> DVec3 {
    let (mut matrix, mut right) = (DMat3::ZERO, DVec3::ZERO);
    for (camera, pixel) in marks {
        let (origin, d) = cameras[*camera].ray(DVec2::from(*pixel));
        let across = DMat3::IDENTITY - DMat3::from_cols(d * d.x, d * d.y, d * d.z);
        matrix += across;
        right += across * origin;
    }
    matrix.inverse() * right
}

fn modelled(cameras: &[Camera], names: &[String]) -> Model {
    let point = |(name, marks): &(&str, &[Mark])| NamedPoint {
        name: (*name).into(),
        position: back_projected(cameras, marks),
        covariance: DMat3::from_diagonal(DVec3::splat(0.02 * 0.02)),
        seen_in: marks.iter().map(|mark| mark.0).collect(),
    };
    let points: Vec<NamedPoint> = MARKS.iter().map(point).collect();
    let rows = toml::from_str::<Table>(
        r#"
        [[shape]]
        name = "walls"
        kind = "box"
        points = ["-", "near foot", "-", "-", "left top", "near top", "right top", "-"]
        "#,
    );
    let photographs: Vec<(String, Camera)> = names.iter().cloned().zip(cameras.iter().copied()).collect();
    build(&rows.unwrap().shape, &points, &photographs)
}

/// What a photograph that was left out shows of the model, and what its texture says it should: pairs of sRGB-encoded colours.
fn foretold(textured: &Textured, camera: &Camera, picture: &Picture) -> Vec<(Vec3, Vec3)> {
    let mesh = &textured.meshes[0];
    let scene = TriangleScene::build(&mesh.positions, &mesh.triangles, &BuildParams::default()).unwrap();
    let Picture::Eight(image) = picture else { panic!("photographs of eight bits") };
    let pixels: Vec<(u32, u32)> = (0..1200).step_by(3).flat_map(|y| (0..1600).step_by(3).map(move |x| (x, y))).collect();
    let ray = |&(x, y): &(u32, u32)| {
        let (origin, along) = camera.ray(DVec2::new(f64::from(x), f64::from(y)) + 0.5);
        Ray { origin: origin.as_vec3(), direction: along.as_vec3(), t_min: 0.0, t_max: f32::INFINITY }
    };
    let rays: Vec<Ray> = pixels.iter().map(ray).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    scene.closest(&rays, &mut hits);
    let pair = |((x, y), hit): (&(u32, u32), &Hit)| {
        let [a, b, c] = mesh.triangles[hit.triangle as usize].map(|v| mesh.uvs[v as usize]);
        let uv = a + (b - a) * hit.u + (c - a) * hit.v;
        let evidence = &textured.evidence;
        let cell = |x: f32, count: u32| ((x * count as f32) as u32).min(count - 1);
        let code = evidence.codes[(cell(uv.y, evidence.height) * evidence.width + cell(uv.x, evidence.width)) as usize];
        let color = textured.atlas.image.sample_bilinear(uv.x, uv.y, [TextureWrap::Clamp; 2]).truncate();
        (code != GUESSED).then(|| (color, image.linear(*x, *y).truncate()))
    };
    let met = pixels.iter().zip(&hits).filter(|(_, hit)| hit.is_some());
    let pairs: Vec<(Vec3, Vec3)> = met.filter_map(pair).collect();
    // nobody can foretell how long it was exposed
    let ratio = |channel: usize| {
        let told = pairs.iter().filter(|(a, b)| a.min_element() > 0.01 && b.max_element() < 0.9);
        let mut ratios: Vec<f32> = told.map(|(a, b)| b[channel] / a[channel]).collect();
        ratios.sort_by(f32::total_cmp);
        ratios[ratios.len() / 2]
    };
    let gain = Vec3::new(ratio(0), ratio(1), ratio(2));
    let encode = |color: Vec3| color.clamp(Vec3::ZERO, Vec3::ONE).map(srgb_from_linear);
    pairs.into_iter().map(|(a, b)| (encode(a * gain), encode(b))).collect()
}

#[test]
fn a_castle_from_four_marks() {
    let folder = Path::new("../../../shared/data/photosets/kapture_maupertuis/images");
    let names: Vec<String> = (1..=4).map(|i| format!("MaupertuisTest_0{i}.jpg")).collect();
    if !folder.join(&names[0]).exists() {
        println!("skipped: {} is not there", folder.display());
        return;
    }
    let cameras = cameras();
    let model = modelled(&cameras, &names);
    assert_eq!(model.refused, []);
    // its walls stand at right angles: a box agrees with four marks that tell more than one needs
    let off_px =
        model.shapes[0].points.iter().flat_map(|point| &point.photographs).map(|shown| shown.off_px).fold(0.0, f64::max);
    println!("walls: at most {off_px:.1} px off; {:?}", model.shapes[0].measures);
    assert!(off_px < 6.0, "{off_px}");
    let pictures: Vec<Picture> = names.iter().map(|name| PictureFile::read(&folder.join(name)).unwrap().picture).collect();
    let of = |i: usize| Photograph { name: &names[i], camera: cameras[i], picture: &pictures[i] };
    let params = TextureParams { most_side: 2048, oversampling: 0.8, ..TextureParams::default() };
    let left_out = 2;
    let others: Vec<Photograph> = (0..4).filter(|&i| i != left_out).map(of).collect();
    let textured = texture(&model.parts, &[], &others, &params).unwrap();
    println!("gains {:?}", textured.gains.iter().map(|gain| (gain.gain, gain.residual)).collect::<Vec<_>>());
    assert!(textured.gains.iter().all(|gain| gain.residual < 0.05 && gain.compared_with == 2));
    let walls: Vec<_> = textured.faces.iter().filter(|face| face.seen > 0.9).collect();
    assert_eq!(walls.len(), 2, "{:?}", textured.faces);
    let pairs = foretold(&textured, &cameras[left_out], &pictures[left_out]);
    let square: f64 =
        pairs.iter().map(|(a, b)| f64::from((*a - *b).length_squared())).sum::<f64>() / (3.0 * pairs.len() as f64);
    let db = -10.0 * libm::log10(square);
    println!("the photograph that was left out: {db:.1} dB over {} pixels", pairs.len());
    assert!(pairs.len() > 50_000 && db > 18.0, "{db:.1} dB over {} pixels", pairs.len());
}
