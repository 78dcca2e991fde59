//! The meshes that are asked about.

use crate::App;
use anyhow::{Context, Result};
use glam::{DVec3, Vec3};
use heliodon_bake::report::Reporter;
use heliodon_math::visibility::VisibilityMatrix;
use heliodon_mesh::Mesh;
use heliodon_mesh::import::{ImportOptions, ImportReport, read_reporting};
use heliodon_mesh::place::Placement;
use std::io::{self, Write};
use std::ops::Range;
use std::path::PathBuf;

/// All meshes in one.
pub struct Scene {
    pub mesh: Mesh,
    /// By vertex; zero where no face uses one.
    pub normals: Vec<Vec3>,
    pub used: Vec<bool>,
    /// The vertices that the files themselves have, file after file.
    own: Vec<Range<usize>>,
}

/// A scene that is farther away than this many times its size is read again about its own middle: f32 would leave it less than 14 bits.
const FAR: f32 = 1000.0;

/// Reads the meshes, and tells what was left out of them. What lies far from the origin, as survey coordinates do, is moved to it.
///
/// # Errors
/// What keeps one from being read.
pub fn read_scene(app: &App, paths: &[PathBuf]) -> Result<Scene> {
    let (mut scene, mut report) = read_about(app, paths, DVec3::ZERO)?;
    let corners = scene.mesh.triangles.as_flattened().iter().map(|&i| scene.mesh.positions[i as usize]);
    let (low, high) = corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let farthest = low.abs().max(high.abs()).max_element();
    if farthest > FAR * (high - low).max_element() {
        let origin = (0.5 * (low.as_dvec3() + high.as_dvec3())).round();
        (scene, report) = read_about(app, paths, origin)?;
        let [x, y, z] = origin.to_array();
        app.progress
            .note(&format!("the scene lies far from the origin; it is computed, and written as a mesh, about [{x}, {y}, {z}]"));
    }
    report.warnings.iter().for_each(|warning| app.progress.warning(warning));
    Ok(scene)
}

fn read_about(app: &App, paths: &[PathBuf], origin: DVec3) -> Result<(Scene, ImportReport)> {
    let placement = Placement { origin: origin.to_array(), ..Placement::default() };
    let options = ImportOptions { placement, ..ImportOptions::default() };
    let mut all = Mesh::default();
    let mut own = Vec::new();
    let mut told = ImportReport::default();
    for (path, number) in paths.iter().zip(1..) {
        let mut report = ImportReport::default();
        let mesh = read_reporting(path, &options, &mut report)?;
        let first = all.positions.len();
        own.push(first..first + report.file_vertices as usize);
        told.add(report);
        if first == 0 {
            all = mesh
        } else {
            all.append(&mesh).with_context(|| path.display().to_string())?
        }
        if origin == DVec3::ZERO {
            app.progress.progress(number);
        }
    }
    Ok((Scene::new(all, own), told))
}

impl Scene {
    fn new(mesh: Mesh, own: Vec<Range<usize>>) -> Self {
        let mut used = vec![false; mesh.positions.len()];
        mesh.triangles.as_flattened().iter().for_each(|&i| used[i as usize] = true);
        let normals = mesh.normals.iter().zip(&used).map(|(&n, &used)| if used { n } else { Vec3::ZERO }).collect();
        Self { mesh, normals, used, own }
    }

    /// One mesh, all of whose vertices are its file's own.
    pub fn of(mesh: Mesh) -> Self {
        let all = 0..mesh.positions.len();
        Self::new(mesh, vec![all])
    }

    /// How many vertices the files have.
    pub fn own_count(&self) -> usize {
        self.own.iter().map(Range::len).sum()
    }

    /// The entries of the files' own vertices.
    pub fn own_of<'a, T>(&'a self, values: &'a [T]) -> impl Iterator<Item = &'a T> {
        self.own.iter().flat_map(|range| &values[range.clone()])
    }

    /// The rows of M of the files' own vertices, in their order.
    pub fn write_rows(&self, out: &mut dyn Write, matrix: &VisibilityMatrix) -> io::Result<()> {
        let mut row_of = vec![0; matrix.order().len()];
        matrix.order().iter().enumerate().for_each(|(row, &vertex)| row_of[vertex as usize] = row);
        let mut bytes = Vec::with_capacity(4 * matrix.directions().len());
        for &row in self.own_of(&row_of) {
            bytes.clear();
            matrix.row(row).for_each(|entry| bytes.extend(entry.to_le_bytes()));
            out.write_all(&bytes)?;
        }
        Ok(())
    }
}
