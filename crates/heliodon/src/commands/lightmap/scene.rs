//! A site's geometry, what has texels first.

use anyhow::Result;
use heliodon_bake::report::Reporter;
use heliodon_bundle::site::{InputFile, LightStorage, Site};
use heliodon_mesh::Mesh;
use heliodon_mesh::albedo::MeshAlbedo;
use heliodon_rays::{BuildParams, TriangleScene};

/// All parts in one mesh.
pub struct SiteScene {
    pub mesh: Mesh,
    pub rays: TriangleScene,
    with_texels: usize,
}

impl SiteScene {
    /// Reads and places all parts.
    ///
    /// # Errors
    /// Files that cannot be read, and a site without anything to light.
    pub fn read(site: &Site, files: &[InputFile], reporter: &dyn Reporter) -> Result<Self> {
        let scene = heliodon_bake::scene::read(site, files, reporter)?;
        let asked = |storage: LightStorage| site.parts.iter().any(|part| part.light == storage);
        let has_texels = |part: usize| match site.parts[part].light {
            LightStorage::Texel => true,
            LightStorage::Vertex => false,
            LightStorage::Auto => !asked(LightStorage::Texel),
        };
        let of = |wanted: bool| {
            let parts = scene.parts.iter().enumerate().filter(move |(part, _)| has_texels(*part) == wanted);
            parts.flat_map(|(_, range)| range.triangles.clone()).collect::<Vec<usize>>()
        };
        let (lit, others) = (of(true), of(false));
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
        Ok(Self { mesh, rays, with_texels: lit.len() })
    }

    /// The triangles that have texels.
    pub fn with_texels(&self) -> &[[u32; 3]] {
        &self.mesh.triangles[..self.with_texels]
    }

    /// What the triangles reflect.
    pub fn albedo(&self) -> MeshAlbedo<'_> {
        MeshAlbedo::new(&self.mesh, 0.0)
    }
}
