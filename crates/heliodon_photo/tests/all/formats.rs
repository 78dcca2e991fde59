//! Cameras of other programs, made up and real.

use glam::{DQuat, DVec2, DVec3};
use heliodon_photo::camera::{Camera, Intrinsics, Pose};
use heliodon_photo::exif::PhotoFacts;
use heliodon_photo::formats::{
    ImportedCamera, ImportedCameras, ImportedPoint, bundler, colmap, colmap_write, kapture, openmvg, projection,
};
use heliodon_photo::solve::bundle::Free;
use std::path::{Path, PathBuf};

/// A folder of the shared photographs; none, and a word, where it is not there.
fn photoset(name: &str) -> Option<PathBuf> {
    let folder = Path::new("../../../shared/data/photosets").join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: there is no {}", folder.display());
    None
}

fn camera() -> Camera {
    let intrinsics = Intrinsics {
        focal_px: [900.0, 910.0],
        centre_px: [401.0, 299.0],
        radial: [-0.1, 0.02, 0.0],
        tangential: [0.001, -0.002],
        ..Intrinsics::pinhole(800, 600, 900.0)
    };
    Camera { intrinsics, pose: Pose::look_at(DVec3::new(3.0, 1.0, 5.0), DVec3::ZERO).unwrap() }
}

const POINT: DVec3 = DVec3::new(0.3, 0.2, -0.1);

fn check(found: &ImportedCameras, truth: &Camera) {
    let read = &found.cameras[0];
    assert_eq!(read.name, "folder/a b.jpg");
    assert!((read.camera.project(POINT).unwrap() - truth.project(POINT).unwrap()).length() < 1e-6);
    assert!((read.camera.centre() - truth.centre()).length() < 1e-9);
    assert!(found.rms_px().unwrap() < 1e-6);
}

#[test]
fn colmap_in_text_and_binary_is_the_same() {
    let truth = camera();
    let q = truth.pose.rotation;
    let t = truth.pose.translation;
    let pixel = truth.project(POINT).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    write("cameras.txt", b"# cameras\n7 OPENCV 800 600 900 910 401 299 -0.1 0.02 0.001 -0.002\n");
    let line = format!("3 {} {} {} {} {} {} {} 7 folder/a b.jpg\n", q.w, q.x, q.y, q.z, t.x, t.y, t.z);
    let line = format!("# images\n{line}{} {} 11\n4 1 0 0 0 0 0 0 7 empty.jpg\n\n", pixel.x, pixel.y);
    write("images.txt", line.as_bytes());
    write("points3D.txt", b"# points\n11 0.3 0.2 -0.1 1 2 3 0.5 3 0\n");
    let text = colmap::read(folder.path()).unwrap();
    assert_eq!(text.cameras.len(), 2);
    check(&text, &truth);

    let mut cameras = Vec::new();
    cameras.extend(1u64.to_le_bytes());
    cameras.extend(7u32.to_le_bytes());
    cameras.extend(4u32.to_le_bytes());
    cameras.extend([800u64, 600].iter().flat_map(|n| n.to_le_bytes()));
    cameras.extend([900.0f64, 910.0, 401.0, 299.0, -0.1, 0.02, 0.001, -0.002].iter().flat_map(|n| n.to_le_bytes()));
    write("cameras.bin", &cameras);
    let mut images = Vec::new();
    images.extend(1u64.to_le_bytes());
    images.extend(3u32.to_le_bytes());
    images.extend([q.w, q.x, q.y, q.z, t.x, t.y, t.z].iter().flat_map(|n| n.to_le_bytes()));
    images.extend(7u32.to_le_bytes());
    images.extend(b"folder/a b.jpg\0");
    images.extend(1u64.to_le_bytes());
    images.extend([pixel.x, pixel.y].iter().flat_map(|n| n.to_le_bytes()));
    images.extend(11u64.to_le_bytes());
    write("images.bin", &images);
    let mut points = Vec::new();
    points.extend(1u64.to_le_bytes());
    points.extend(11u64.to_le_bytes());
    points.extend(POINT.to_array().iter().flat_map(|n| n.to_le_bytes()));
    points.extend([1u8, 2, 3]);
    points.extend(0.5f64.to_le_bytes());
    points.extend(1u64.to_le_bytes());
    points.extend([3u32, 0].iter().flat_map(|n| n.to_le_bytes()));
    write("points3D.bin", &points);
    let binary = colmap::read(folder.path()).unwrap();
    check(&binary, &truth);
    // Every shorter file is refused, none is read beyond its end.
    for length in 0..images.len() {
        write("images.bin", &images[..length]);
        assert!(colmap::read(folder.path()).is_err(), "{length}");
    }
    write("images.bin", &[0xff; 64]);
    assert!(colmap::read(folder.path()).is_err());
}

#[test]
fn what_is_written_for_colmap_is_read_back() {
    // A turn whose square is 1 to the bit, since readers make it so.
    let pose = Pose { rotation: DQuat::from_xyzw(0.5, 0.5, 0.5, 0.5), translation: DVec3::new(0.1, 0.2, 6.0) };
    let whole = Camera { pose, ..camera() };
    let one = |lens: Intrinsics| Camera { intrinsics: lens, ..whole };
    let square = Intrinsics { focal_px: [900.0; 2], tangential: [0.0; 2], ..whole.intrinsics };
    // Each of the six models: what a lens does not need is not written, unless it shall be free.
    let lenses = [
        whole.intrinsics,
        Intrinsics { radial: [-0.1, 0.02, 0.003], ..whole.intrinsics },
        square,
        Intrinsics { radial: [-0.1, 0.0, 0.0], ..square },
        Intrinsics { radial: [0.0; 3], ..square },
        Intrinsics { radial: [0.0; 3], tangential: [0.0; 2], ..whole.intrinsics },
    ];
    let mut model = ImportedCameras::default();
    for (index, lens) in lenses.into_iter().enumerate() {
        let name = format!("côté nord/a {index}.jpg");
        model.cameras.push(ImportedCamera { name, lens: index as u64 + 1, camera: one(lens), centred: false });
    }
    let seen = model.cameras.iter().enumerate().map(|(i, c)| (i, c.camera.project(POINT).unwrap())).collect();
    model.points.push(ImportedPoint { position: POINT, seen });
    let folder = tempfile::tempdir().unwrap();
    for free in [Free::default(), Free { radial: 2, ..Free::default() }] {
        let folder = folder.path().join(free.radial.to_string());
        colmap_write::write(&folder, &model, free).unwrap();
        assert_eq!(colmap::read(&folder).unwrap(), model);
    }
    let parameters =
        |radial: u8| colmap_write::LensModel::of(&lenses[4], Free { radial, ..Free::default() }).parameters(&lenses[4]);
    assert_eq!((parameters(0).len(), parameters(1).len(), parameters(2).len()), (3, 4, 5));
}

#[test]
fn lenses_that_ours_cannot_express_are_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |camera: &str| {
        std::fs::write(folder.path().join("cameras.txt"), camera).unwrap();
        std::fs::write(folder.path().join("images.txt"), "").unwrap();
        colmap::read(folder.path()).unwrap_err().to_string()
    };
    assert!(refused("1 FULL_OPENCV 8 6 9 9 4 3 0 0 0 0 0 0.1 0 0").contains("k4"));
    assert!(refused("1 OPENCV_FISHEYE 8 6 9 9 4 3 0 0 0 0").contains("not supported"));
    assert!(refused("\n1 PINHOLE 8 6 9 9 4").contains("cameras.txt:2"));
    assert!(refused("1 PINHOLE 8 x 9 9 4 3").contains("HEIGHT"));
    std::fs::write(folder.path().join("cameras.txt"), "1 FULL_OPENCV 8 6 9 9 4 3 .1 .2 0 0 .3 0 0 0").unwrap();
    assert!(colmap::read(folder.path()).unwrap().cameras.is_empty());
}

#[test]
fn bundlers_cameras_look_the_other_way() {
    let lens = Intrinsics { radial: [-0.1, 0.02, 0.0], centre_px: [400.0, 300.0], ..Intrinsics::pinhole(800, 600, 900.0) };
    let truth = Camera { intrinsics: lens, ..camera() };
    // What Bundler would write: R and t with y and z turned round, pixels from the middle with y up.
    let m = glam::DMat3::from_quat(truth.pose.rotation);
    let rows: Vec<String> = [1.0, -1.0, -1.0]
        .iter()
        .enumerate()
        .map(|(i, s)| format!("{} {} {}", s * m.row(i).x, s * m.row(i).y, s * m.row(i).z))
        .collect();
    let t = truth.pose.translation;
    let pixel = truth.project(POINT).unwrap() - DVec2::new(400.0, 300.0);
    let text = format!(
        "# Bundle file v0.3\n2 1\n900 -0.1 0.02\n{}\n{} {} {}\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n0.3 0.2 -0.1\n1 2 3\n1 0 5 {} {}\n",
        rows.join("\n"),
        t.x,
        -t.y,
        -t.z,
        pixel.x,
        -pixel.y
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bundle.out");
    std::fs::write(&path, text).unwrap();
    let found = bundler::read(&path, &["a.jpg".to_owned(), "b.jpg".to_owned()]).unwrap();
    assert_eq!(found.cameras.len(), 1);
    assert_eq!(found.notes, ["b.jpg has no camera in the bundle"]);
    let read = Camera { intrinsics: found.cameras[0].intrinsics([800, 600]), ..found.cameras[0].camera };
    assert!((read.project(POINT).unwrap() - truth.project(POINT).unwrap()).length() < 1e-6);
    assert!(found.rms_px().unwrap() < 1e-6);
}

#[test]
fn a_matrix_gives_its_camera_whatever_its_factor() {
    let lens = Intrinsics { focal_px: [900.0, 910.0], centre_px: [401.0, 299.0], ..Intrinsics::pinhole(800, 600, 900.0) };
    let truth = Camera { intrinsics: lens, ..camera() };
    let m = glam::DMat3::from_quat(truth.pose.rotation);
    let t = truth.pose.translation;
    let rt = |i: usize| [m.row(i).x, m.row(i).y, m.row(i).z, t[i]];
    for factor in [1.0, -3.0] {
        let p: [f64; 12] = std::array::from_fn(|i| {
            let column = i % 4;
            factor
                * match i / 4 {
                    0 => 900.0 * rt(0)[column] + 401.0 * rt(2)[column],
                    1 => 910.0 * rt(1)[column] + 299.0 * rt(2)[column],
                    _ => rt(2)[column],
                }
        });
        let found = projection::from_matrix(&p).unwrap();
        assert!((found.project(POINT).unwrap() - truth.project(POINT).unwrap()).length() < 1e-9);
        assert!((found.centre() - truth.centre()).length() < 1e-12);
    }
    assert!(projection::from_matrix(&[0.0; 12]).is_err());
    let mut leaning = [900.0, 40.0, 400.0, 0.0, 0.0, 900.0, 300.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    assert!(projection::from_matrix(&leaning).unwrap_err().contains("skew"));
    leaning[1] = 0.0;
    assert!(projection::from_matrix(&leaning).is_ok());
}

#[test]
fn the_castles_cameras_agree_in_openmvg_and_kapture() {
    let Some(folder) = photoset("kapture_maupertuis") else { return };
    let mvg = openmvg::read(&folder.join("sfm_data.json")).unwrap();
    let kap = kapture::read(&folder).unwrap();
    assert_eq!((mvg.cameras.len(), kap.cameras.len(), mvg.points.len()), (4, 4, 365));
    for (a, b) in mvg.cameras.iter().zip(&kap.cameras) {
        assert!(b.name.ends_with(&a.name));
        assert!((a.camera.centre() - b.camera.centre()).length() < 1e-9);
        let turn: DQuat = a.camera.pose.rotation * b.camera.pose.rotation.conjugate();
        assert!(turn.w.abs() > 1.0 - 1e-12);
    }
    let rms = mvg.rms_px().unwrap();
    println!("Maupertuis: OpenMVG's own points lie {rms:.3} px from their pixels");
    assert!(rms < 1.5);
    let facts = PhotoFacts::read(&folder.join("images/MaupertuisTest_01.jpg"));
    let focal = facts.focal_px([1600, 1200]);
    println!("EXIF: {facts:?}, {focal:?} px");
    assert_eq!(facts.size_px, Some([1600, 1200]));
}

#[test]
fn middleburys_temple_lies_in_its_pictures() {
    let Some(folder) = photoset("middlebury_templeSparseRing") else { return };
    let found = projection::read(&folder.join("templeSR_par.txt")).unwrap();
    assert_eq!(found.cameras.len(), 16);
    assert!(found.cameras.iter().all(|c| c.lens == 0));
    let (min, max) = (DVec3::new(-0.073568, 0.021728, -0.012445), DVec3::new(0.028855, 0.181892, 0.062736));
    for camera in &found.cameras {
        let lens = camera.camera.intrinsics;
        assert!((lens.focal_px[0] - 1520.4).abs() < 1e-3 && (lens.focal_px[1] - 1525.9).abs() < 1e-3);
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { min[axis] } else { max[axis] };
            let pixel = camera.camera.project(DVec3::new(pick(0), pick(1), pick(2))).unwrap();
            assert!(pixel.x > 0.0 && pixel.x < 640.0 && pixel.y > 0.0 && pixel.y < 480.0, "{}: {pixel}", camera.name);
        }
    }
}
