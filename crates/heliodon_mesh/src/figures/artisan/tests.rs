use super::*;
use crate::figures::shape::is_closed;
use crate::figures::tests::{assert_loops, glb_bytes};
use crate::import::{Format, ImportOptions, ImportReport};
use crate::motion::from_bytes;
use crate::motion::{MovingMesh, Pose};
use std::path::Path;

fn moving(who: Artisan) -> MovingMesh {
    let bytes = glb_bytes(&artisan(who));
    let mut report = ImportReport::default();
    let model = from_bytes(&bytes, Format::Gltf, Path::new("artisan.glb"), &ImportOptions::default(), &mut report).unwrap();
    assert!(report.warnings.is_empty(), "{:?}", report.warnings);
    model
}

#[test]
fn people_are_of_closed_pieces_and_of_a_grown_up_s_size() {
    for who in Artisan::ALL {
        let scene = artisan(who);
        scene.validate().unwrap();
        let mesh = &scene.meshes[0].mesh;
        assert!(is_closed(&mesh.triangles), "{who:?}");
        assert!((4_000..14_000).contains(&mesh.positions.len()), "{who:?}: {}", mesh.positions.len());
        let (low, high) = mesh.bounds().unwrap();
        assert!(low.y > -0.005 && low.y < 0.01 && (1.72..1.8).contains(&high.y), "{who:?}: {low} {high}");
        for sums in scene.meshes[0].weights.iter().map(|w| w.iter().sum::<f32>()) {
            assert!((sums - 1.0).abs() < 1e-5, "{who:?}");
        }
        assert_eq!(glb_bytes(&scene), glb_bytes(&artisan(who)));
    }
}

#[test]
fn clips_loop_and_nobody_sinks_into_the_floor() {
    for who in Artisan::ALL {
        let mut scene = artisan(who);
        let model = moving(who);
        let names: Vec<&str> = scene.clips.iter().map(|clip| clip.name.as_str()).collect();
        assert_eq!(names.len(), if who == Artisan::Porter { 2 } else { 3 });
        let mut pose = Pose::default();
        for (number, clip) in model.clips().iter().enumerate() {
            let mut before: Option<Vec<Vec3>> = None;
            for tick in 0..=40 {
                model.pose(number, clip.duration_s * tick as f32 / 40.5, &mut pose);
                let lowest = pose.positions.iter().map(|p| p.y).fold(f32::MAX, f32::min);
                assert!((-0.03..0.03).contains(&lowest), "{who:?} {}: {lowest}", clip.name);
                if let Some(before) = &before {
                    let leap = before.iter().zip(&pose.positions).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
                    assert!(leap < 0.35, "{who:?} {}: {leap}", clip.name);
                }
                before = Some(pose.positions.clone());
            }
        }
        // who points stays so
        scene.clips.retain(|clip| clip.name != "point");
        assert_loops(&scene);
    }
}

#[test]
fn a_blow_brings_the_mallet_down_onto_the_chisel() {
    let model = moving(Artisan::Carver);
    let rest = model.rest();
    // the pieces that were added last: handle, head, chisel
    let count = rest.positions.len();
    let head = |pose: &Pose| {
        let wood = count - (4 * 8 + 2) - (4 * 16 + 2)..count - (4 * 8 + 2);
        pose.positions[wood.clone()].iter().sum::<Vec3>() / wood.len() as f32
    };
    let mut pose = Pose::default();
    model.pose(0, 0.0, &mut pose);
    let down = head(&pose);
    let chisel_top = pose.positions[count - (4 * 8 + 2)..].iter().map(|p| p.y).fold(f32::MIN, f32::max);
    model.pose(0, 0.54 * HAMMER_LOOP_S, &mut pose);
    let up = head(&pose);
    println!("down {down} up {up} chisel's top {chisel_top}");
    assert!(up.y - down.y > 0.15, "{up} {down}");
    assert!((down.y - chisel_top).abs() < 0.2, "{down} {chisel_top}");
}

/// `HELIODON_ARTISANS=folder cargo test` writes them there, to look at.
#[test]
#[ignore = "writes files to look at"]
fn write_them() {
    let folder = std::path::PathBuf::from(std::env::var("HELIODON_ARTISANS").unwrap());
    for who in Artisan::ALL {
        std::fs::write(folder.join(format!("{who:?}.glb").to_lowercase()), glb_bytes(&artisan(who))).unwrap();
    }
}
