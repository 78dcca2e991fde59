//! A site's geometry, what has texels first.

use anyhow::Result;
use glam::Vec2;
use heliodon_bake::report::Reporter;
use heliodon_bake::scene::{PartRange, Scene, read_with_uvs};
use heliodon_bake::texels_first;
use heliodon_bundle::site::{InputFile, Part, Site};
use heliodon_lightmap::parts::{PartOf, parts};
use heliodon_lightmap::unwrap::Unwrapped;
use heliodon_mesh::Mesh;
use heliodon_mesh::albedo::MeshAlbedo;
use heliodon_mesh::export::UnwrappedPart;
use heliodon_rays::{BuildParams, TriangleScene};

/// All parts in one mesh.
pub struct SiteScene {
    pub mesh: Mesh,
    pub rays: TriangleScene,
    /// How densely each of the triangles that have texels has them, beside the others.
    pub density: Vec<f32>,
    /// The site's parts, in its order: their names, where they lie in the mesh, and the texture coordinates of their files.
    parts: Vec<(String, PartRange, Vec<Vec2>)>,
}

impl SiteScene {
    /// Reads and places all parts. Texels have those that a bake gives some, or `every` one but those with light = "vertex".
    ///
    /// # Errors
    /// Files that cannot be read, and a site without anything to light.
    pub fn read(site: &Site, files: &[InputFile], every: bool, reporter: &dyn Reporter) -> Result<Self> {
        let (scene, uvs) = read_with_uvs(site, files, reporter)?;
        let (Scene { mesh, parts: ranges, .. }, density) = texels_first(site, scene, every);
        anyhow::ensure!(
            !density.is_empty(),
            "{}: no part has texels: write light = \"texel\" to those that are to have a light map",
            site.path().display()
        );
        let rays = TriangleScene::build(&mesh.positions, &mesh.triangles, &BuildParams::asked_for_long(mesh.triangles.len()))?;
        let names = site.parts.iter().map(Part::display_name);
        let parts = names.zip(ranges).zip(uvs).map(|((name, range), uvs)| (name, range, uvs)).collect();
        Ok(Self { mesh, rays, density, parts })
    }

    /// The triangles that have texels.
    pub fn with_texels(&self) -> &[[u32; 3]] {
        &self.mesh.triangles[..self.density.len()]
    }

    /// The site's parts as their files have them, vertices split where charts meet.
    pub fn parts(&self, unwrapped: &Unwrapped) -> Vec<UnwrappedPart> {
        let of_mesh = self.parts.iter().map(|(name, range, uvs)| {
            let PartRange { vertices, triangles, .. } = range.clone();
            PartOf { name, vertices, triangles, uvs }
        });
        parts(&self.mesh, unwrapped, &of_mesh.collect::<Vec<_>>())
    }

    /// What the triangles reflect.
    pub fn albedo(&self) -> MeshAlbedo<'_> {
        MeshAlbedo::new(&self.mesh, 0.0)
    }
}
