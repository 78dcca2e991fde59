//! The scan itself, beside what is drawn of it: all of the cleaned original that stands behind what is drawn, with its own light at each of its vertices.
//!
//! The original is what rays meet anyway, so its vertices take their light from the solved cells like texels do ([`crate::panorama`]), every one of them for itself
//! (`light`). It stands in the bundle's folder as a bundle of its own (`write`).
//!
//! Its geometry waits on the disk until somebody asks for it: of ten million triangles it takes a tenth of what a bake may take, and while the drawn vertices are solved nobody needs it.
//!
//! Parts that are lit by texels, and those of which anything drawn has a texture, are left out whole: what the original has of them are places and normals, no coordinates.

mod light;
mod write;

pub use light::BakedScan;

use crate::cache::{Cache, CacheError};
use crate::error::BakeError;
use crate::key::{Digest, TOOL};
use crate::prepare::{load_array, store_array};
use crate::report::Reporter;
use crate::scene::{Original, PartRange, Scene};
use bytemuck::Pod;
use glam::Vec3;
use heliodon_bundle::site::{Site, SiteFile};
use heliodon_mesh::{Material, Mesh};
use std::mem::take;

/// The geometry of the scan, part by part; its arrays are in the cache.
#[derive(Debug)]
pub struct Scan<'a> {
    cache: &'a Cache,
    /// All of them is drawn.
    parts: Vec<PartRange>,
    materials: Vec<Material>,
    counts: [u64; 2],
    digest: [u8; 32],
}

/// No number of a vertex.
const NONE: u32 = u32::MAX;

/// What the arrays are called in the cache.
const POSITIONS: &str = "scan-positions";
const NORMALS: &str = "scan-normals";
const COLORS: &str = "scan-colors";
const TRIANGLES: &str = "scan-triangles";
const MATERIALS: &str = "scan-materials";

impl<'a> Scan<'a> {
    /// Puts what [`of_site`] has found into the cache.
    ///
    /// # Errors
    /// A cache that cannot be written.
    pub fn new(Scene { mesh, parts, .. }: Scene, cache: &'a Cache) -> Result<Self, CacheError> {
        let mut digest = Digest::default();
        digest.run(TOOL.as_bytes());
        digest.run(bytemuck::cast_slice(&mesh.positions));
        digest.run(bytemuck::cast_slice(&mesh.normals));
        digest.run(bytemuck::cast_slice(&mesh.triangles));
        store_array(cache, POSITIONS, &mesh.positions)?;
        store_array(cache, NORMALS, &mesh.normals)?;
        store_array(cache, COLORS, &mesh.colors_linear)?;
        store_array(cache, TRIANGLES, &mesh.triangles)?;
        store_array(cache, MATERIALS, &mesh.triangle_material)?;
        let [vertices, triangles] = [mesh.positions.len(), mesh.triangles.len()].map(|count| count as u64);
        Ok(Self { cache, parts, counts: [vertices, triangles], materials: mesh.materials, digest: digest.bytes() })
    }

    /// Vertices and triangles.
    #[must_use]
    pub fn counts(&self) -> [u64; 2] {
        self.counts
    }

    /// What decides where its light is asked for, for names of blocks.
    #[must_use]
    pub fn digest(&self) -> [u8; 32] {
        self.digest
    }

    /// One of its arrays.
    fn array<T: Pod>(&self, name: &str) -> Result<Vec<T>, BakeError> {
        load_array(self.cache, name).ok_or_else(|| BakeError::Lost { path: self.cache.folder().join(name) })
    }

    /// All of it.
    fn scene(&self) -> Result<Scene, BakeError> {
        let mesh = Mesh {
            positions: self.array(POSITIONS)?,
            normals: self.array(NORMALS)?,
            colors_linear: self.array(COLORS)?,
            triangles: self.array(TRIANGLES)?,
            triangle_material: self.array(MATERIALS)?,
            materials: self.materials.clone(),
            ..Mesh::default()
        };
        Ok(Scene { mesh, parts: self.parts.clone(), warnings: Vec::new(), original: None, prepared: None })
    }
}

/// The scan, of a scene whose rays were taken; none where the site wants none, or no part can be in it. The original's own mesh is given up for it.
pub fn of_site(site: &Site, scene: &mut Scene, reporter: &dyn Reporter) -> Option<Scene> {
    let wanted = is_wanted(site).then_some(scene.original.as_mut()?)?;
    let original = Original {
        positions: take(&mut wanted.positions),
        triangles: take(&mut wanted.triangles),
        looks: take(&mut wanted.looks),
        colored: take(&mut wanted.colored),
        ..Original::default()
    };
    let stands_for = scene.original.as_ref().map_or(&[][..], |original| &original.stands_for);
    let scan = behind_drawn(scene, original, stands_for);
    if scan.mesh.triangles.is_empty() {
        reporter.warning(
            "[prepare] scan: what is drawn is lit by texels or has textures, and such parts are not in the scan: there is none",
        );
        return None;
    }
    Some(scan)
}

/// Whether a site wants the scan itself.
#[must_use]
pub fn is_wanted(site: &SiteFile) -> bool {
    site.prepare.as_ref().is_some_and(|prepare| prepare.scan)
}

/// What of the original stands behind what is drawn, in the order that it has there, which is that of the parts.
fn behind_drawn(scene: &Scene, original: Original, stands_for: &[u32]) -> Scene {
    let Original { mut positions, mut triangles, looks, colored, .. } = original;
    let drawn = &scene.mesh;
    let can_be_in: Vec<bool> = scene.parts.iter().map(|part| !part.by_texels && !is_textured(drawn, part)).collect();
    let part_of = |stand_in: usize| scene.parts.partition_point(|part| part.triangles.end <= stand_in);
    // parts follow one another in the original too, so that counts tell all of them
    let mut counts = vec![0; scene.parts.len()];
    let mut materials = Vec::new();
    let mut numbers = vec![NONE; positions.len()];
    let mut number = 0;
    triangles.retain(|triangle| {
        let stand_in = stands_for[number] as usize;
        number += 1;
        let part = part_of(stand_in);
        let is_shown = can_be_in[part] && scene.parts[part].drawn_triangles().contains(&stand_in);
        if is_shown {
            counts[part] += 1;
            materials.extend(drawn.triangle_material.get(stand_in));
            triangle.iter().for_each(|&vertex| numbers[vertex as usize] = 0);
        }
        is_shown
    });
    triangles.shrink_to_fit();
    let used: Vec<u32> = (0..positions.len() as u32).filter(|&vertex| numbers[vertex as usize] != NONE).collect();
    (0..).zip(&used).for_each(|(number, &vertex)| numbers[vertex as usize] = number);
    triangles.iter_mut().flatten().for_each(|vertex| *vertex = numbers[*vertex as usize]);
    let mut vertex = 0;
    positions.retain(|_| {
        vertex += 1;
        numbers[vertex - 1] != NONE
    });
    positions.shrink_to_fit();
    drop(numbers);

    let (mut parts, mut first, mut first_vertex) = (Vec::with_capacity(counts.len()), 0, 0);
    for (part, &count) in scene.parts.iter().zip(&counts) {
        let own = first..first + count;
        let end = triangles[own.clone()].as_flattened().iter().max().map_or(first_vertex, |&last| last as usize + 1);
        parts.push(PartRange {
            vertices: first_vertex..end,
            triangles: own.clone(),
            drawn: count,
            files: part.files,
            by_texels: false,
        });
        (first, first_vertex) = (own.end, end);
    }
    let normals = used.iter().map(|&vertex| looks.of(vertex)[1].try_normalize().unwrap_or(Vec3::ZERO)).collect();
    let mut colors_linear = Vec::new();
    if !drawn.colors_linear.is_empty() {
        for ((of_scan, part), &colored) in parts.iter().zip(&scene.parts).zip(&colored) {
            let own = |&vertex: &u32| match colored {
                1 => looks.of(vertex)[0],
                _ => drawn.colors_linear[part.vertices.start],
            };
            colors_linear.extend(used[of_scan.vertices.clone()].iter().map(own));
        }
    }
    let mesh = Mesh {
        positions,
        normals,
        colors_linear,
        triangles,
        triangle_material: materials,
        materials: drawn.materials.clone(),
        ..Mesh::default()
    };
    Scene { mesh, parts, warnings: Vec::new(), original: None, prepared: None }
}

/// Whether anything that is drawn of a part has a texture.
fn is_textured(mesh: &Mesh, part: &PartRange) -> bool {
    let has_texture =
        |material: u16| mesh.materials.get(usize::from(material)).is_some_and(|material| material.texture.is_some());
    match mesh.triangle_material.get(part.drawn_triangles()) {
        Some(own) => own.iter().any(|&material| has_texture(material)),
        None => has_texture(0),
    }
}
