//! From `photos.toml` to `cameras.json`.

use glam::DVec3;
use heliodon_photo::camera::{Camera, Intrinsics, Pose};
use heliodon_photo::formats::cameras_file::CamerasFile;
use heliodon_photo::project::{PROJECT_FILE_NAME, Project, ProjectFile};
use heliodon_photo::report::describe;
use heliodon_photo::solve::solve;
use std::fmt::Write;
use std::path::Path;

/// A project of four photographs of twenty points, whose files are not there; one mark is off by 50 px.
fn text() -> String {
    let lens = Intrinsics::pinhole(2000, 1500, 1700.0);
    let mut text = "[project]\nname = \"Box\"\n\n[[lens]]\nname = \"l\"\nfocal = \"free\"\ndistortion = \"none\"\n".to_owned();
    let mut cameras = Vec::new();
    for i in 0..4 {
        let a = f64::from(i) * 0.4;
        let pose = Pose::look_at(DVec3::new(10.0 * a.sin(), 2.0, 10.0 * a.cos()), DVec3::ZERO).unwrap();
        cameras.push(Camera { intrinsics: lens, pose });
        writeln!(text, "\n[[photo]]\nfile = \"images/{i}.jpg\"\nlens = \"l\"\nsize_px = [2000, 1500]").unwrap();
    }
    for p in 0..20 {
        let t = f64::from(p);
        let at = DVec3::new((t * 1.3).sin() * 2.0, (t * 0.7).cos() * 1.5, (t * 2.1).sin() * 2.0);
        writeln!(text, "\n[[point]]\nname = \"p{p}\"\n[point.marks]").unwrap();
        for (i, camera) in cameras.iter().enumerate() {
            let pixel = camera.project(at).unwrap();
            let wrong = if (p, i) == (7, 2) { 50.0 } else { 0.0 };
            writeln!(text, "\"{i}.jpg\" = [{:.2}, {:.2}]", pixel.x, pixel.y + wrong).unwrap();
        }
    }
    text + "\n[[distance]]\nbetween = [\"p0\", \"p1\"]\nmetres = 2.5\n"
}

#[test]
fn a_project_is_solved_and_told_and_kept() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join(PROJECT_FILE_NAME), text()).unwrap();
    let project = Project::read(folder.path()).unwrap();
    let loaded = project.load().unwrap();
    assert!(loaded.notes.iter().any(|n| n.contains("0.jpg")), "{:?}", loaded.notes);
    let solution = solve(&loaded.problem, &project.params());
    let file = CamerasFile::new(&loaded.problem, &solution);
    let told = describe(&file);
    assert!(told.starts_with("4 of 4 photographs and 20 of 20 points are solved"), "{told}");
    assert!(told.contains("\n  p7 in 2.jpg is off by 50 px\n"), "{told}");
    assert!(told.contains("focal length 1700"), "{told}");
    let kept = CamerasFile::parse(&file.text().unwrap()).unwrap();
    assert_eq!(kept, file);
    assert!(kept.metric && kept.photos[1].camera.unwrap().camera() == solution.camera(1));
    let later = file.text().unwrap().replace("\"version\": 1", "\"version\": 9");
    assert!(CamerasFile::parse(&later).unwrap_err().contains("version 9"));
    assert!(CamerasFile::parse("{}").is_err());
}

#[test]
fn a_saved_project_reads_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(PROJECT_FILE_NAME);
    std::fs::write(&path, text()).unwrap();
    let project = Project::read(&path).unwrap();
    project.save().unwrap();
    let once = std::fs::read_to_string(&path).unwrap();
    Project::read(&path).unwrap().save().unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), once);
    let error = Project::read(folder.path().join("nothing")).unwrap_err().to_string();
    assert!(error.contains("photos.toml"), "{error}");
}

#[test]
fn the_committed_schema_is_current() {
    let path = Path::new("../../schema/photos.schema.json");
    let current = ProjectFile::json_schema();
    if std::env::var_os("HELIODON_BLESS").is_some() {
        std::fs::write(path, &current).unwrap();
    }
    let committed = std::fs::read_to_string(path).unwrap_or_default();
    assert!(
        committed == current,
        "schema/photos.schema.json is old: HELIODON_BLESS=1 cargo test -p heliodon_photo --test all project::"
    );
    // Editors go by it: what can be chosen from is listed, and slips of the pen are seen.
    let schema: serde_json::Value = serde_json::from_str(&committed).unwrap();
    assert_eq!(schema["additionalProperties"], false);
    for word in ["north", "exif", "radial-2", "openmvg", "column", "revolution", "mark_sigma_px", "between"] {
        assert!(committed.contains(&format!("\"{word}\"")), "{word}");
    }
}
