//! A site's geometry, what has texels first.

use anyhow::Result;
use heliodon_bake::report::Reporter;
use heliodon_bake::texels_first;
use heliodon_bundle::site::{InputFile, Site};
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
        let (mesh, density) = texels_first(site, heliodon_bake::scene::read(site, files, reporter)?);
        anyhow::ensure!(
            !density.is_empty(),
            "{}: no part has texels: write light = \"texel\" to those that are to have a light map",
            site.path().display()
        );
        let rays = TriangleScene::build(&mesh.positions, &mesh.triangles, &BuildParams::asked_for_long(mesh.triangles.len()))?;
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
