//! `heliodon figures`: objects that move, to try light on.

use crate::App;
use crate::files::{NewFolder, find_foreign};
use crate::output::{bytes, count, table};
use anyhow::{Context, Result, bail, ensure};
use heliodon_bake::report::Reporter;
use heliodon_bundle::StoredFile;
use heliodon_mesh::export::scene::Scene;
use heliodon_mesh::export::{write_glb, write_pc2, write_ply};
use heliodon_mesh::figures::walker::WALK_SPEED_M_S;
use heliodon_mesh::figures::{self, Artisan, cloth};
use heliodon_mesh::motion::pc2::PointCache;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};

/// Makes objects that move: a skeleton that walks, a curtain in the wind, a mason's yard at work, people of a workshop.
///
/// walker.glb: a skin, clips "walk" and "idle"; cloth.ply and cloth.pc2: 25 frames a second; stoneyard.glb: nodes, clip "day"; master.glb, carver.glb, porter.glb: a
/// skin, clips "idle", "walk", "hammer", "cheer", "point".
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  heliodon figures moving")]
pub struct Args {
    /// The folder to make; one that this command has made and nobody has changed is made anew
    dir: PathBuf,
}

#[derive(Serialize)]
struct FiguresReport {
    dir: PathBuf,
    /// How fast the walker walks: who moves it at this speed sees no foot slide.
    walk_speed_m_s: f32,
    /// Frames a second of the curtain.
    cloth_fps: f32,
    files: Vec<Written>,
}

#[derive(Serialize)]
struct Written {
    file: &'static str,
    vertices: u64,
    triangles: u64,
    bytes: u64,
}

/// What a run has written: only that, as it was, may a later run replace.
#[derive(Serialize, Deserialize)]
struct Mark {
    figures: Vec<StoredFile>,
}

const MARK_FILE: &str = "made-from.json";

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    refuse_foreign(&args.dir)?;
    app.progress.stage("building", 0);
    let made = make(&args.dir);
    app.progress.finished();
    let report = FiguresReport { dir: args.dir.clone(), walk_speed_m_s: WALK_SPEED_M_S, cloth_fps: cloth::FPS, files: made? };
    app.output.result(&report, |report| {
        let row = |w: &Written| vec![w.file.to_owned(), count(w.vertices), count(w.triangles), bytes(w.bytes)];
        let rows: Vec<_> = report.files.iter().map(row).collect();
        let table = table(&["file", "vertices", "triangles", "size"], &rows);
        let (dir, speed, fps) = (report.dir.display(), report.walk_speed_m_s, report.cloth_fps);
        format!("{table}\nIn {dir}. The walker walks {speed} m/s along +Z; the curtain has {fps} frames a second.\n")
    })
}

/// Looks whether all that is in the folder was made by this command.
fn refuse_foreign(dir: &Path) -> Result<()> {
    const REMEDY: &str = "move it away, or name another folder";
    if !dir.exists() {
        let home = dir.parent().filter(|home| !home.as_os_str().is_empty()).unwrap_or(Path::new("."));
        ensure!(
            home.is_dir(),
            "cannot make {}: there is no folder {}; make it, or name another place",
            dir.display(),
            home.display()
        );
        return Ok(());
    }
    ensure!(dir.is_dir(), "{} is a file; {REMEDY}", dir.display());
    let mark: Option<Mark> = fs::read(dir.join(MARK_FILE)).ok().and_then(|text| serde_json::from_slice(&text).ok());
    let files = mark.map(|mark| mark.figures).unwrap_or_default();
    let ours = |name: &str| files.iter().any(|file| file.path == name) || (name == MARK_FILE && !files.is_empty());
    if let Some(name) = find_foreign(dir, ours)? {
        bail!("{} in {} was not made by heliodon figures; {REMEDY}", name.display(), dir.display());
    }
    for file in &files {
        let path = dir.join(&file.path);
        if path.exists() {
            let now = StoredFile::hash(&path, &file.path).with_context(|| format!("cannot read {}", path.display()))?;
            ensure!(now == *file, "{} was changed since heliodon figures made it; {REMEDY}", path.display());
        }
    }
    Ok(())
}

/// Makes the folder, whole or not at all.
fn make(dir: &Path) -> Result<Vec<Written>> {
    let folder = NewFolder::create(dir)?;
    let place = |name: &str| folder.path().join(name);
    let mut written = Vec::new();
    let mut note = |file: &'static str, vertices: usize, triangles: usize| -> Result<()> {
        let bytes = fs::metadata(folder.path().join(file)).with_context(|| format!("cannot read {file}"))?.len();
        written.push(Written { file, vertices: vertices as u64, triangles: triangles as u64, bytes });
        Ok(())
    };
    let artisans = Artisan::ALL.map(|who| (who.file_name(), figures::artisan(who)));
    for (file, scene) in
        [("walker.glb", figures::walker()), ("stoneyard.glb", figures::stoneyard())].into_iter().chain(artisans)
    {
        write_glb(&place(file), &scene)?;
        let total =
            |size: fn(&heliodon_mesh::Mesh) -> usize, scene: &Scene| scene.meshes.iter().map(|part| size(&part.mesh)).sum();
        note(file, total(|mesh| mesh.positions.len(), &scene), total(|mesh| mesh.triangles.len(), &scene))?;
    }
    let cloth = figures::cloth();
    let (vertices, triangles) = (cloth.mesh.positions.len(), cloth.mesh.triangles.len());
    write_ply(&place("cloth.ply"), &cloth.mesh, None)?;
    note("cloth.ply", vertices, triangles)?;
    write_pc2(&place("cloth.pc2"), &PointCache::of_frames(&cloth.frames))?;
    note("cloth.pc2", vertices, triangles)?;
    let hashes = written.iter().map(|w| StoredFile::hash(&place(w.file), w.file));
    let mark = Mark { figures: hashes.collect::<Result<_, _>>().context("the figures' files")? };
    let path = place(MARK_FILE);
    fs::write(&path, serde_json::to_vec_pretty(&mark)?).with_context(|| format!("cannot write {}", path.display()))?;
    folder.commit(|| Ok(()))?;
    Ok(written)
}
