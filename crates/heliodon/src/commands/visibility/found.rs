//! What was found, and how it is written.

use super::scene::Scene;
use super::{Args, Form};
use crate::files;
use anyhow::Result;
use glam::Vec3;
use heliodon_bundle::npy;
use heliodon_math::light_sphere::LightSphere;
use heliodon_math::visibility::{PointLight, VisibilityMatrix};
use heliodon_mesh::Mesh;
use heliodon_mesh::albedo::MeshAlbedo;
use heliodon_mesh::export::{self, write_glb, write_ply};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// What was found, by vertex.
pub struct Found {
    pub light: PointLight,
    /// Unit mean directions that light comes from, if they were asked for.
    pub bent: Vec<Vec3>,
    /// The whole matrix, if it was asked for.
    pub matrix: Option<VisibilityMatrix>,
}

impl Found {
    /// A vertex that no face uses is nowhere on a surface: nothing occludes it.
    pub fn open_unused(&mut self, scene: &Scene) {
        for (ao, _) in self.light.ambient_occlusion.iter_mut().zip(&scene.used).filter(|(_, used)| !**used) {
            *ao = 1.0;
        }
    }
}

/// Writes a NumPy array of f32.
fn write_npy(path: &Path, shape: &[u64], data: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    files::write_whole(path, |file| {
        let mut out = BufWriter::with_capacity(1 << 18, file);
        out.write_all(&npy::header("<f4", shape))?;
        data(&mut out)?;
        out.flush()
    })
}

fn write_floats(path: &Path, shape: &[u64], mut floats: impl Iterator<Item = f32>) -> Result<()> {
    write_npy(path, shape, |out| floats.try_for_each(|float| out.write_all(&float.to_le_bytes())))
}

/// Writes M, and its directions and weights beside it; answers with all three files.
///
/// # Errors
/// What the operating system says.
pub fn write_matrix(path: &Path, scene: &Scene, sphere: &LightSphere, matrix: &VisibilityMatrix) -> Result<Vec<PathBuf>> {
    let k = sphere.directions().len() as u64;
    let (directions, weights) = (path.with_extension("directions.npy"), path.with_extension("weights.npy"));
    write_npy(path, &[scene.own_count() as u64, k], |out| scene.write_rows(out, matrix))?;
    write_floats(&directions, &[k, 3], sphere.directions().iter().flat_map(|l| l.to_array()))?;
    write_floats(&weights, &[k], sphere.weights().iter().copied())?;
    Ok(vec![path.to_owned(), directions, weights])
}

/// Writes what the form asks for.
///
/// # Errors
/// What the operating system says.
pub fn write_found(path: &Path, form: Form, scene: &Scene, found: &Found, args: &Args) -> Result<Vec<PathBuf>> {
    let count = scene.own_count() as u64;
    let vectors = if args.bent { Some(&found.bent) } else { args.env.is_some().then_some(&found.light.light) };
    match (form, vectors) {
        (Form::Ply, _) => write_ply(path, &lit_mesh(scene.mesh.clone(), found, args), Some(&found.light.ambient_occlusion))?,
        (Form::Npy, Some(vectors)) => {
            write_floats(path, &[count, 3], scene.own_of(vectors).flat_map(|v| v.to_array()))?;
        }
        (Form::Glb, _) => write_glb(path, &export::scene::Scene::of_mesh("lit", lit_mesh(scene.mesh.clone(), found, args)))?,
        (Form::Npy, None) => write_floats(path, &[count], scene.own_of(&found.light.ambient_occlusion).copied())?,
    }
    Ok(vec![path.to_owned()])
}

/// The mesh with what was found as its colours, and as its normals where bent ones were asked for.
fn lit_mesh(mut mesh: Mesh, found: &Found, args: &Args) -> Mesh {
    mesh.colors_linear = if args.env.is_some() {
        lit_colors(&found.light.light, &vertex_albedo(&mesh), args.exposure)
    } else {
        found.light.ambient_occlusion.iter().map(|&ao| Vec3::splat(ao)).collect()
    };
    if args.bent {
        mesh.normals.clone_from(&found.bent);
    }
    mesh
}

/// What lit vertices show, linear, as far as a display can.
pub fn lit_colors(light: &[Vec3], albedo: &[Vec3], exposure_stops: f32) -> Vec<Vec3> {
    let shown = |(&light, &albedo): (&Vec3, &Vec3)| (light * albedo * exposure_stops.exp2()).clamp(Vec3::ZERO, Vec3::ONE);
    light.iter().zip(albedo).map(shown).collect()
}

/// The albedo of each vertex, as the first of its triangles has it there.
pub fn vertex_albedo(mesh: &Mesh) -> Vec<Vec3> {
    let albedo = MeshAlbedo::new(mesh, 0.0);
    let mut of_vertex = vec![None; mesh.positions.len()];
    for (triangle, corners) in (0..).zip(&mesh.triangles) {
        for (&vertex, [u, v]) in corners.iter().zip([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]) {
            of_vertex[vertex as usize].get_or_insert_with(|| albedo.albedo(triangle, u, v));
        }
    }
    of_vertex.into_iter().map(|albedo| albedo.unwrap_or(Mesh::UNSAID_ALBEDO)).collect()
}
