//! `heliodon visibility`, driven as its users would.

use crate::{done, json, read_npy_f32, run};
use glam::Vec3;
use heliodon_image::HdrImage;
use heliodon_mesh::import::{ImportOptions, read};
use heliodon_mesh::motion::pc2;
use std::path::PathBuf;

struct Desk(tempfile::TempDir);

impl Desk {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        std::fs::write(self.path(name), text).unwrap();
        self.path(name)
    }

    /// A square of two triangles on the ground, and behind its four vertices one that nothing uses.
    fn square(&self) -> PathBuf {
        self.write("square.obj", "v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nv 0 9 0\nf 1 2 3 4\n")
    }

    /// A long, high wall at the square's eastern edge.
    fn wall(&self) -> PathBuf {
        self.write("wall.obj", "v 1.01 -1 -900\nv 1.01 -1 900\nv 1.01 1800 900\nv 1.01 1800 -900\nf 1 2 3 4\n")
    }
}

#[test]
fn occlusion_is_in_the_order_of_the_files_own_vertices() {
    let desk = Desk::new();
    let out = desk.path("ao.npy");
    let report = json(&[&"visibility", &desk.square(), &"--level", &"2", &"-o", &out]);
    assert_eq!((&report["vertices"], &report["directions"]), (&5.into(), &66.into()));
    assert_eq!(report["mean_ambient_occlusion"], 1.0);
    for phase in ["reading", "hierarchy", "visibility", "light", "writing"] {
        assert!(report["seconds"][phase].as_f64().is_some(), "{phase}");
    }
    assert_eq!(read_npy_f32(&out), (vec![5], vec![1.0; 5]));

    // Corners with texture coordinates of their own are split; the file's vertices stay as many.
    let split =
        desk.write("split.obj", "v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nvt 0 0\nvt 1 1\nf 1/1 2/1 3/1\nf 1/2 3/2 4/2\n");
    assert_eq!(json(&[&"visibility", &split, &desk.square(), &"-o", &out])["vertices"], 11);
    assert_eq!(read_npy_f32(&out).0, [9]);
}

#[test]
fn several_meshes_occlude_one_another() {
    let desk = Desk::new();
    let (square, wall, out) = (desk.square(), desk.wall(), desk.path("ao.npy"));
    done(&[&"visibility", &square, &wall, &"--level", &"4", &"-o", &out]);
    let (shape, ao) = read_npy_f32(&out);
    assert_eq!(shape, [9]);
    // East corners have the wall beside them, west ones see it from afar: it hides all of the east from both, as high as it is.
    for corner in &ao[..4] {
        assert!((corner - 0.5).abs() < 0.05, "{ao:?}");
    }
    assert_eq!(ao[4], 1.0);
    let bent = desk.path("bent.npy");
    done(&[&"visibility", &square, &wall, &"--bent", &"-o", &bent]);
    let (shape, bent) = read_npy_f32(&bent);
    assert_eq!(shape, [9, 3]);
    assert!(bent[0] < -0.3 && bent[1] > 0.7, "away from the wall: {bent:?}");
}

#[test]
fn survey_coordinates_change_nothing() {
    let desk = Desk::new();
    let moved = |name: &str, file: PathBuf| {
        let text = std::fs::read_to_string(file).unwrap();
        let lines = text.lines().map(|line| match line.strip_prefix("v ") {
            Some(numbers) => {
                let [x, y, z] = numbers.split(' ').map(|n| n.parse::<f64>().unwrap()).collect::<Vec<_>>()[..] else { panic!() };
                format!("v {} {} {}\n", x + 476_312.0, y + 151.0, z - 4_202_187.0)
            }
            None => format!("{line}\n"),
        });
        desk.write(name, &lines.collect::<String>())
    };
    let low = desk.write("low.obj", "v 1.3 0 -4\nv 1.3 0 4\nv 1.3 8 4\nv 1.3 8 -4\nf 1 2 3 4\n");
    let (far, far_low) = (moved("far.obj", desk.square()), moved("far_low.obj", low.clone()));
    let out = desk.path("ao.npy");
    let answers = [[desk.square(), low], [far, far_low]].map(|[square, wall]| {
        let ran = done(&[&"visibility", &square, &wall, &"-o", &out]);
        assert!(!ran.err.contains("warning"), "{}", ran.err);
        read_npy_f32(&out).1
    });
    assert_eq!(answers[0], answers[1]);
}

#[test]
fn the_matrix_says_what_occlusion_sums() {
    let desk = Desk::new();
    let (square, wall, out) = (desk.square(), desk.wall(), desk.path("m.npy"));
    let report = json(&[&"visibility", &square, &wall, &"--level", &"1", &"--matrix", &"-o", &out]);
    let (shape, m) = read_npy_f32(&out);
    assert_eq!(shape, [9, 18]);
    let (shape, directions) = read_npy_f32(&desk.path("m.directions.npy"));
    assert_eq!(shape, [18, 3]);
    let (shape, weights) = read_npy_f32(&desk.path("m.weights.npy"));
    assert_eq!(shape, [18]);
    assert_eq!(m.iter().filter(|&&entry| entry > 0.0).count() as u64, report["visible"].as_u64().unwrap());
    done(&[&"visibility", &square, &wall, &"--level", &"1", &"-o", &out]);
    let ao = read_npy_f32(&out).1;
    for corner in 0..4 {
        let sum = |entry: &dyn Fn(usize) -> f32| (0..18).map(|j| weights[j] * entry(j)).sum::<f32>();
        // The ground looks up, so n.l is the direction's y.
        let open = sum(&|j| directions[3 * j + 1].max(0.0));
        assert!((sum(&|j| m[18 * corner + j]) / open - ao[corner]).abs() < 1e-6);
    }
}

#[test]
fn an_environment_lights_what_it_reaches() {
    let desk = Desk::new();
    let (square, wall) = (desk.square(), desk.wall());
    let (sky, out, ply) = (desk.path("grey.hdr"), desk.path("light.npy"), desk.path("lit.ply"));
    HdrImage::filled(32, 16, Vec3::new(2.0, 1.0, 0.5)).write_hdr(&sky).unwrap();
    done(&[&"visibility", &square, &wall, &"--level", &"4", &"--env", &sky, &"-o", &out]);
    let (shape, light) = read_npy_f32(&out);
    assert_eq!(shape, [9, 3]);
    for (channel, radiance) in [2.0, 1.0, 0.5].into_iter().enumerate() {
        assert!((light[channel] - 0.5 * radiance).abs() < 0.05 * radiance, "{light:?}");
    }
    // Albedo 0.5, one stop brighter: as bright as the light.
    done(&[&"visibility", &square, &"--level", &"4", &"--env", &sky, &"--exposure", &"-1", &"-o", &ply]);
    let lit = read(&ply, &ImportOptions::default()).unwrap();
    assert!((lit.colors_linear[0] - Vec3::new(0.5, 0.25, 0.125)).abs().max_element() < 0.01, "{}", lit.colors_linear[0]);
}

#[test]
fn what_does_not_go_together_is_refused() {
    let desk = Desk::new();
    let (square, npy, ply) = (desk.square(), desk.path("a.npy"), desk.path("a.ply"));
    let wrong: [&[&dyn AsRef<std::ffi::OsStr>]; 7] = [
        &[&"visibility"],
        &[&"visibility", &square, &"--level", &"9"],
        &[&"visibility", &square, &"--matrix"],
        &[&"visibility", &square, &"--matrix", &"-o", &ply],
        &[&"visibility", &square, &"--mapping", &"angular", &"-o", &npy],
        &[&"visibility", &square, &"--blur", &"5"],
        &[&"visibility", &square, &"-o", &"a.jpg"],
    ];
    for arguments in wrong {
        assert_eq!(run(arguments).code, 2, "{}", run(arguments).err);
    }
    let missing = run(&[&"visibility", &desk.path("nothing.ply"), &"-o", &npy]);
    assert!(missing.code == 1 && missing.err.contains("nothing.ply"), "{}", missing.err);
    let over = run(&[&"visibility", &square, &"--env", &desk.path("no.hdr"), &"-o", &ply]);
    assert!(over.code == 1 && over.err.contains("no.hdr"), "{}", over.err);
    done(&[&"visibility", &square, &"-o", &ply]);
    let before = std::fs::read(&ply).unwrap();
    let over = run(&[&"visibility", &ply, &"-o", &ply]);
    assert!(over.code == 1 && over.err.contains("written over"), "{}", over.err);
    assert_eq!(std::fs::read(&ply).unwrap(), before);
}

#[test]
fn what_moves_is_filmed_and_cached() {
    let desk = Desk::new();
    done(&[&"figures", &desk.path("moving")]);
    let (walker, cloth) = (desk.path("moving/walker.glb"), desk.path("moving/cloth.ply"));
    let (film, cache) = (desk.path("walk.mp4"), desk.path("waving.pc2"));
    let report = json(&[&"visibility", &walker, &"--animation", &"walk", &"--frames", &"3", &"--level", &"1", &"-o", &film]);
    assert_eq!(report["directions"], 18);
    for phase in ["pose", "hierarchy", "visibility", "light", "picture"] {
        assert!(report["seconds"][phase].as_f64().is_some(), "{phase}");
    }
    assert_eq!(&std::fs::read(&film).unwrap()[4..8], b"ftyp");

    let of_cloth = desk.path("moving/cloth.pc2");
    let waving: [&dyn AsRef<std::ffi::OsStr>; 11] =
        [&"visibility", &cloth, &"--cache", &of_cloth, &"--animation", &"cache", &"--frames", &"4", &"--level", &"2", &"-o"];
    done(&waving.into_iter().chain([&cache as &dyn AsRef<std::ffi::OsStr>]).collect::<Vec<_>>());
    let [values, places] = [cache.clone(), cache.with_extension("positions.pc2")].map(|path| pc2::read(&path).unwrap());
    assert_eq!((values.points, values.samples(), places.points, places.samples()), (3249, 4, 3249, 4));
    // ambient occlusion, thrice; the second moment is not the first
    assert!(values.positions.iter().all(|v| v.x == v.y && v.y == v.z && (0.0..=1.0).contains(&v.x)));
    assert_ne!(values.positions[..3249], values.positions[3249..6498]);
    // the positions are those of the clip: its first moment is the cache's first sample
    let first = pc2::read(&of_cloth).unwrap();
    let off = places.positions[..3249].iter().zip(&first.positions).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
    assert!(off < 1e-5, "{off}");

    let lit = desk.path("lit.glb");
    done(&[&"visibility", &walker, &"--level", &"1", &"-o", &lit]);
    assert_eq!(read(&lit, &ImportOptions::default()).unwrap().positions.len(), 8415);
    let wrong: [&[&dyn AsRef<std::ffi::OsStr>]; 4] = [
        &[&"visibility", &walker, &"--animation", &"walk"],
        &[&"visibility", &walker, &"--animation", &"walk", &"-o", &lit],
        &[&"visibility", &walker, &"-o", &film],
        &[&"visibility", &walker, &"--frames", &"3", &"-o", &lit],
    ];
    for arguments in wrong {
        assert_eq!(run(arguments).code, 2, "{}", run(arguments).err);
    }
    let unknown = run(&[&"visibility", &walker, &"--animation", &"fly", &"-o", &film]);
    assert!(unknown.code == 1 && unknown.err.contains("walk, idle"), "{}", unknown.err);
    let two = run(&[&"visibility", &walker, &cloth, &"--animation", &"walk", &"-o", &film]);
    assert!(two.code == 1 && two.err.contains("one model"), "{}", two.err);
}

#[cfg(feature = "gpu")]
#[test]
fn a_gpu_answers_as_the_processor_does() {
    use crate::{heliodon, ran};

    let desk = Desk::new();
    let (square, wall) = (desk.square(), desk.write("low.obj", "v 1.3 0 -4\nv 1.3 0 4\nv 1.3 8 4\nv 1.3 8 -4\nf 1 2 3 4\n"));
    let out = desk.path("ao.npy");
    let report = json(&[&"visibility", &square, &wall, &"--backend", &"cpu", &"-o", &out]);
    assert_eq!((&report["backend"], &report["method"]), (&"cpu".into(), &"rays".into()));
    let (exact, offset_m) = (read_npy_f32(&out).1, report["offset_m"].as_f64().unwrap());
    for (method, most) in [("rays", 1e-5), ("maps", 0.05)] {
        let by = [&"--backend" as &dyn AsRef<std::ffi::OsStr>, &"gpu", &"--gpu-method", &method];
        let arguments: [&dyn AsRef<std::ffi::OsStr>; 3] = [&"visibility", &square, &wall];
        let report = json(&[&arguments[..], &by, &[&"-o" as &dyn AsRef<std::ffi::OsStr>, &out]].concat());
        assert_eq!((&report["backend"], &report["method"]), (&"gpu".into(), &method.into()));
        let told = report["offset_m"].as_f64();
        assert_eq!(told.is_some_and(|told| (told - offset_m).abs() < 1e-5 * offset_m), method == "rays");
        for (exact, found) in exact.iter().zip(&read_npy_f32(&out).1) {
            assert!((exact - found).abs() < most, "{method}: {found} for {exact}");
        }
    }
    for wrong in [
        ["--backend", "gpu", "--gpu-method", "maps", "--offset", "0.1"],
        ["--backend", "cpu", "--gpu-method", "rays", "--level", "1"],
    ] {
        let arguments: Vec<&dyn AsRef<std::ffi::OsStr>> =
            [&"visibility" as &dyn AsRef<std::ffi::OsStr>, &square].into_iter().chain(wrong.iter().map(|w| w as _)).collect();
        assert_eq!(run(&arguments).code, 2, "{wrong:?}");
    }
    assert_eq!(run(&[&"visibility", &square, &"--backend", &"gpu", &"--offset", &"0.1"]).code, 0);

    let arguments: [&dyn AsRef<std::ffi::OsStr>; 4] = [&"visibility", &square, &"--backend", &"gpu"];
    let nowhere = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"].map(|name| (name, "/nowhere.json"));
    let none = ran(heliodon(&arguments).envs(nowhere).output().unwrap());
    assert!(!cfg!(target_os = "linux") || none.code == 1 && none.err.contains("no GPU"), "{}", none.err);
}
