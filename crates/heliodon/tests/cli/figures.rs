//! Objects that move.

use crate::{contents, done, json, run};
use heliodon_mesh::import::{ImportOptions, read};

#[test]
fn figures_are_written_and_replaced_only_where_nobody_has_changed_them() {
    let home = tempfile::tempdir().unwrap();
    let dir = home.path().join("moving");
    let report = json(&[&"figures", &dir]);
    let files: Vec<_> = report["files"]
        .as_array()
        .unwrap()
        .iter()
        .map(|f| (f["file"].as_str().unwrap(), f["vertices"].as_u64().unwrap()))
        .collect();
    let written = ["walker.glb", "stoneyard.glb", "master.glb", "carver.glb", "porter.glb", "cloth.ply", "cloth.pc2"];
    assert_eq!(files.iter().map(|f| f.0).collect::<Vec<_>>(), written);
    assert_eq!(report["walk_speed_m_s"], 1.25);
    for (file, vertices) in &files[..6] {
        let mesh = read(&dir.join(file), &ImportOptions::default()).unwrap();
        assert_eq!(mesh.positions.len() as u64, *vertices, "{file}");
    }
    let first = contents(&dir);
    let pc2 = &first.iter().find(|(name, _)| name == "cloth.pc2").unwrap().1;
    assert!(pc2.starts_with(b"POINTCACHE2\0") && pc2.len() == 32 + 101 * 3249 * 12);

    let told = done(&[&"figures", &dir, &"--threads", &"1"]).out;
    assert!(told.contains("3,249") && told.contains("1.25 m/s"), "{told}");
    assert_eq!(contents(&dir), first, "the same bits");

    std::fs::write(dir.join("notes.txt"), "mine").unwrap();
    let refused = run(&[&"figures", &dir]);
    assert!(refused.code == 1 && refused.err.contains("notes.txt"), "{}", refused.err);
    std::fs::remove_file(dir.join("notes.txt")).unwrap();
    std::fs::write(dir.join("cloth.ply"), "mine").unwrap();
    let refused = run(&[&"figures", &dir]);
    assert!(refused.code == 1 && refused.err.contains("cloth.ply"), "{}", refused.err);
    assert_eq!(std::fs::read(dir.join("cloth.ply")).unwrap(), b"mine");
    let refused = run(&[&"figures", &home.path().join("none/moving")]);
    assert!(refused.code == 1 && refused.err.contains("there is no folder"), "{}", refused.err);
    assert_eq!(std::fs::read_dir(home.path()).unwrap().count(), 1, "nothing is left beside it");
}
