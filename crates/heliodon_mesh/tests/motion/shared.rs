//! Models of others, where this machine has them.

#![expect(clippy::print_stdout, clippy::unwrap_used, reason = "helpers of tests")]

use glam::Vec3;
use heliodon_mesh::import::{Format, ImportOptions, ImportReport, read_reporting};
use heliodon_mesh::motion::{MovingMesh, Pose, read_moving};
use std::path::{Path, PathBuf};

/// All glTF files below a folder of the shared data; none, and a word, where there is no such folder.
fn shared(folder: &str) -> Vec<PathBuf> {
    let root = Path::new("../../../shared/data").join(folder);
    if !root.is_dir() {
        println!("skipped: no {}", root.display());
        return Vec::new();
    }
    let (mut folders, mut files) = (vec![root], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if Format::of_name(&path) == Some(Format::Gltf) {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

fn read(path: &Path, report: &mut ImportReport) -> Option<MovingMesh> {
    match read_moving(path, &ImportOptions::default(), report) {
        Ok(moving) => {
            moving.validate().unwrap();
            Some(moving)
        }
        Err(error) => {
            assert!(!error.problem().is_empty() && !error.remedy().is_empty());
            None
        }
    }
}

/// The mean length of the triangles' edges.
fn mean_edge(positions: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
    let edge = |t: &[u32; 3]| positions[t[0] as usize].distance(positions[t[1] as usize]);
    triangles.iter().map(edge).sum::<f32>() / triangles.len() as f32
}

#[test]
fn characters_keep_their_shape() {
    for path in shared("characters") {
        let mut report = ImportReport::default();
        let moving = read(&path, &mut report).unwrap();
        let still = read_reporting(&path, &ImportOptions::default(), &mut ImportReport::default()).unwrap();
        assert_eq!(moving.rest().positions.len(), still.positions.len(), "{}", path.display());
        assert_eq!(moving.rest().triangles.len(), still.triangles.len());
        let (name, rest) = (path.file_name().unwrap().to_string_lossy(), moving.rest());
        let own = mean_edge(&rest.positions, &rest.triangles);
        let mut pose = Pose::default();
        println!("{name}: {} vertices, {:?}", rest.positions.len(), report.warnings);
        for (k, clip) in moving.clips().iter().enumerate() {
            let (mut least, mut most) = (f32::INFINITY, 0.0_f32);
            for step in 0..20 {
                moving.pose(k, clip.duration_s * step as f32 / 19.0, &mut pose);
                let ratio = mean_edge(&pose.positions, &rest.triangles) / own;
                (least, most) = (least.min(ratio), most.max(ratio));
            }
            println!("  {} {:.3} s, rigid {}, edges {least:.3} to {most:.3}", clip.name, clip.duration_s, moving.rigid(k));
            let figure = ["Fox", "CesiumMan", "knight", "RobotExpressive"].iter().any(|figure| name.starts_with(figure));
            assert!(!figure || (least > 0.7 && most < 1.4), "{name}: {}", clip.name);
        }
    }
}

#[test]
fn damaged_files_of_others_do_no_harm() {
    let files = shared("malformed");
    let read = files.iter().filter(|path| read(path, &mut ImportReport::default()).is_some()).count();
    println!("{read} of {} read", files.len());
}
