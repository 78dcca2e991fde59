//! A site's geometry, what has texels first.

use anyhow::Result;
use heliodon_bake::report::Reporter;
use heliodon_bake::texel_density;
use heliodon_bundle::site::{InputFile, LightStorage, Site};
use heliodon_mesh::Mesh;
use heliodon_mesh::albedo::MeshAlbedo;
use heliodon_rays::{BuildParams, TriangleScene};

/// All parts in one mesh.
pub struct SiteScene {
    pub mesh: Mesh,
    pub rays: TriangleScene,
    /// How densely each of the triangles that have texels has them, beside the others.
    pub density: Vec<f32>,
}

impl SiteScene {
    /// Reads and places all parts.
    ///
    /// # Errors
    /// Files that cannot be read, and a site without anything to light.
    pub fn read(site: &Site, files: &[InputFile], reporter: &dyn Reporter) -> Result<Self> {
        let scene = heliodon_bake::scene::read(site, files, reporter)?;
        let all = || 0..scene.parts.len();
        let by_texels: Vec<usize> = all().filter(|&part| scene.parts[part].by_texels).collect();
        // a site whose light a bake would store at vertices alone
        let not_by_vertices = || all().filter(|&part| site.parts[part].light != LightStorage::Vertex).collect();
        let chosen: Vec<usize> = if by_texels.is_empty() { not_by_vertices() } else { by_texels };
        let others: Vec<usize> = all().filter(|part| !chosen.contains(part)).collect();
        let of =
            |parts: &[usize]| -> Vec<usize> { parts.iter().flat_map(|&part| scene.parts[part].triangles.clone()).collect() };
        let (lit, others) = (of(&chosen), of(&others));
        let density = texel_density(site, &scene, &chosen);
        anyhow::ensure!(
            !lit.is_empty(),
            "{}: no part has texels: write light = \"texel\" to those that are to have a light map",
            site.path().display()
        );
        let mut mesh = scene.mesh;
        let order: Vec<usize> = lit.iter().chain(&others).copied().collect();
        mesh.triangles = order.iter().map(|&t| mesh.triangles[t]).collect();
        if !mesh.triangle_material.is_empty() {
            mesh.triangle_material = order.iter().map(|&t| mesh.triangle_material[t]).collect();
        }
        let rays = TriangleScene::build(&mesh.positions, &mesh.triangles, &BuildParams::default())?;
        Ok(Self { mesh, rays, density })
    }

    /// The triangles that have texels.
    pub fn with_texels(&self) -> &[[u32; 3]] {
        &self.mesh.triangles[..self.density.len()]
    }

    /// What the triangles reflect.
    pub fn albedo(&self) -> MeshAlbedo<'_> {
        MeshAlbedo::new(&self.mesh, 0.0)
    }
}
