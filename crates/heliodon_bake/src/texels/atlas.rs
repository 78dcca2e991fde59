//! The atlas: where the surfaces lie that are lit by texels, and which texels they have.

use super::kept::{decode_unwrapped, encode_unwrapped};
use crate::cache::Cache;
use crate::error::BakeError;
use crate::key::{Digest, TOOL};
use crate::rooms::distance_m;
use crate::scene::Scene;
use glam::{Vec2, Vec3};
use heliodon_bundle::site::{LightStorage, Room, Site};
use heliodon_bundle::texels::{BOUNCE_BLOCK, MAX_TEXEL_SIDE, TEXEL_LEVELS, TexelInfo};
use heliodon_light::SurfacePlace;
use heliodon_lightmap::charts::ChartParams;
use heliodon_lightmap::packing::{PackError, PackParams};
use heliodon_lightmap::refine::{Grid, Place};
use heliodon_lightmap::seams::Seams;
use heliodon_lightmap::texels::{Texel, texels};
use heliodon_lightmap::unwrap::{UnwrapParams, Unwrapped, unwrap};
use std::ops::Range;

/// Surfaces farther from all rooms than this have fewer texels, in proportion: a texel of theirs is seen as large, metres.
const NEAR_M: f32 = 4.0;
/// But no fewer than this part of the densest.
const SPARSEST: f32 = 1.0 / 64.0;
/// Texels of the finest surface for a metre at most: at a metre's distance the sun's disc blurs a shadow over nine millimetres.
const MOST_PER_M: f32 = 128.0;

/// The surfaces that are lit by texels, unwrapped.
#[derive(Debug)]
pub struct Atlas {
    /// Which parts of the site they are.
    parts: Vec<usize>,
    /// Triangles of the scene for those of each part that are drawn, in the order of `parts`.
    triangles: Vec<Range<usize>>,
    /// Over the scene's vertices and those that were split off.
    unwrapped: Unwrapped,
    /// Texels along a side.
    side: u32,
    /// What its block is called where it is kept.
    name: String,
}

/// The texels of one resolution of an atlas.
#[derive(Debug)]
pub struct Texels {
    /// They.
    pub texels: Vec<Texel>,
    /// Along a side of the atlas.
    pub side: u32,
    /// What lies beside what.
    pub grid: Grid,
}

impl Texels {
    /// What holds for the texels of a coarser level, for those of this one that lie within them; `elsewhere` for the others.
    pub fn of_coarser(&self, coarser: &Self, values: &[bool], elsewhere: bool) -> Vec<bool> {
        let shift = self.side.ilog2() - coarser.side.ilog2();
        let at = |texel: &Texel, shift: u32| (texel.y >> shift) as usize * coarser.side as usize + (texel.x >> shift) as usize;
        let mut all = vec![elsewhere; (coarser.side * coarser.side) as usize];
        coarser.texels.iter().zip(values).for_each(|(texel, &value)| all[at(texel, 0)] = value);
        self.texels.iter().map(|texel| all[at(texel, shift)]).collect()
    }
}

impl Atlas {
    /// The atlas of a scene's parts that want one; none where no part does. What `cache` holds of the same surfaces is taken from there, and what it does not
    /// is kept in it.
    ///
    /// # Errors
    /// A size that cannot hold all charts, a cache that cannot be written.
    pub fn new(site: &Site, scene: &Scene, cache: Option<&Cache>) -> Result<Option<Self>, BakeError> {
        let parts: Vec<usize> = (0..scene.parts.len()).filter(|&part| scene.parts[part].by_texels).collect();
        let triangles: Vec<Range<usize>> = parts.iter().map(|&part| scene.parts[part].drawn_triangles()).collect();
        let of_parts: Vec<[u32; 3]> =
            triangles.iter().flat_map(|range| &scene.mesh.triangles[range.clone()]).copied().collect();
        if of_parts.is_empty() {
            return Ok(None);
        }
        let density = texel_density(site, scene, &parts);
        let side = site.bake.effective_texels();
        let name = {
            let mut digest = Digest::default();
            digest.run(TOOL.as_bytes());
            digest.run(&side.to_le_bytes());
            digest.run(bytemuck::cast_slice(&scene.mesh.positions));
            digest.run(bytemuck::cast_slice(&of_parts));
            digest.run(bytemuck::cast_slice(&density));
            format!("charts-{}", digest.digits())
        };
        if let Some(cache) = cache {
            cache.adopt(std::slice::from_ref(&name))?;
        }
        let kept = cache.and_then(|cache| decode_unwrapped(&cache.load(&name, 0)?, of_parts.len()));
        if let (Some(unwrapped), Some(cache)) = (kept, cache) {
            cache.taken("charts", 1, 1);
            return Ok(Some(Self { parts, triangles, unwrapped, side, name }));
        }
        // whole squares of the coarsest level: what is apart there is apart on all
        let blocks = side / BOUNCE_BLOCK;
        let most_per_m = MOST_PER_M / BOUNCE_BLOCK as f32;
        let pack = PackParams { width: blocks, height: blocks, margin: 0, sheets: 1, most_per_m };
        let params = UnwrapParams { charts: ChartParams::default(), pack };
        let unwrapped = unwrap(&scene.mesh.positions, &of_parts, &density, &params).map_err(|error| {
            let (message, remedy) = match error {
                PackError::TooSmall { charts, smallest, .. } => {
                    let squares = format!("squares of {BOUNCE_BLOCK} x {BOUNCE_BLOCK} of its own");
                    let message = format!("{charts} charts do not fit into {side} x {side} texels, for each has {squares}");
                    (message, remedy(side, smallest))
                }
                other => (format!("the parts that are lit by texels cannot be laid flat: {other}"), FEWER.to_owned()),
            };
            BakeError::from(site.error_at(&["bake", "texels"], message, remedy))
        })?;
        if let Some(cache) = cache {
            cache.store(&name, 0, &encode_unwrapped(&unwrapped))?;
        }
        Ok(Some(Self { parts, triangles, unwrapped, side, name }))
    }

    /// What its block in a cache is called.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Texels along a side.
    #[must_use]
    pub fn side(&self) -> u32 {
        self.side
    }

    /// How the surfaces are unwrapped: triangles over the scene's vertices and those split off.
    #[must_use]
    pub fn unwrapped(&self) -> &Unwrapped {
        &self.unwrapped
    }

    /// The unwrapped triangles of a part of the site that are drawn; none where it is lit at its vertices.
    #[must_use]
    pub fn of_part(&self, part: usize) -> Option<&[[u32; 3]]> {
        let index = self.parts.iter().position(|&known| known == part)?;
        let first: usize = self.triangles[..index].iter().map(Range::len).sum();
        Some(&self.unwrapped.triangles[first..first + self.triangles[index].len()])
    }

    /// The scene's vertex that one of the unwrapped ones is.
    #[must_use]
    pub fn vertex(&self, unwrapped: u32) -> usize {
        self.unwrapped.original_vertex[unwrapped as usize] as usize
    }

    /// Where an unwrapped vertex lies.
    #[must_use]
    pub fn uv(&self, unwrapped: u32) -> Vec2 {
        self.unwrapped.uvs[unwrapped as usize].clamp(Vec2::ZERO, Vec2::ONE)
    }

    /// The scene's number of an unwrapped triangle.
    fn triangle_of_scene(&self, triangle: u32) -> u32 {
        let mut left = triangle as usize;
        for range in &self.triangles {
            if left < range.len() {
                return (range.start + left) as u32;
            }
            left -= range.len();
        }
        triangle
    }

    /// The chart of a triangle of the scene; none where it has no texels.
    #[must_use]
    pub fn chart(&self, triangle: u32) -> Option<u32> {
        let mut first = 0;
        for range in &self.triangles {
            if range.contains(&(triangle as usize)) {
                return self.unwrapped.chart.get(first + triangle as usize - range.start).copied();
            }
            first += range.len();
        }
        None
    }

    /// The part of the site that an unwrapped triangle belongs to.
    #[must_use]
    pub fn part_of_triangle(&self, triangle: u32) -> usize {
        let triangle = self.triangle_of_scene(triangle) as usize;
        let index = self.triangles.iter().position(|range| range.contains(&triangle));
        index.map_or(0, |index| self.parts[index])
    }

    /// The texels of a level: 0 is the finest, [`TEXEL_LEVELS`] - 1 that of the bounce.
    #[must_use]
    pub fn texels(&self, scene: &Scene, level: u32) -> Texels {
        let side = self.side >> level;
        let texels = texels(&self.unwrapped, side, side);
        let mesh = &scene.mesh;
        let place = |texel: &Texel| {
            let corners = mesh.triangles[self.triangle_of_scene(texel.triangle) as usize];
            let of = |values: &[Vec3]| texel.mix(corners.map(|vertex| values[vertex as usize]));
            Place { position: of(&mesh.positions), normal: of(&mesh.normals).normalize_or_zero() }
        };
        let grid = Grid::new(&texels, &self.unwrapped.chart, texels.iter().map(place).collect());
        Texels { texels, side, grid }
    }

    /// The place of a texel on the scene's surfaces.
    #[must_use]
    pub fn place(&self, texel: &Texel) -> SurfacePlace {
        SurfacePlace { triangle: self.triangle_of_scene(texel.triangle), u: texel.weights.y, v: texel.weights.z }
    }

    /// The seams of some texels.
    #[must_use]
    pub fn seams(&self, scene: &Scene, texels: &Texels) -> Seams {
        let mesh = &scene.mesh;
        let triangles: Vec<[u32; 3]> =
            self.triangles.iter().flat_map(|range| &mesh.triangles[range.clone()]).copied().collect();
        let surface = (mesh.positions.as_slice(), mesh.normals.as_slice(), triangles.as_slice());
        Seams::new(&self.unwrapped, surface, &texels.texels, [texels.side; 2])
    }

    /// What a manifest tells; `texels` are those of the finest level.
    #[must_use]
    pub fn info(&self, texels: u64) -> TexelInfo {
        let packing = &self.unwrapped.packing;
        let per_m = packing.per_m * BOUNCE_BLOCK as f32;
        TexelInfo { width: self.side, height: self.side, per_m, utilisation: packing.utilisation, texels }
    }

    /// What decides where the texels lie on the surfaces, for names of blocks.
    #[must_use]
    pub fn digest(&self) -> [u8; 32] {
        let mut digest = Digest::default();
        digest.run(&[self.side.to_le_bytes(), TEXEL_LEVELS.to_le_bytes()].concat());
        digest.run(bytemuck::cast_slice(self.unwrapped.triangles.as_flattened()));
        digest.run(bytemuck::cast_slice(&self.unwrapped.uvs));
        for range in &self.triangles {
            digest.run(&[range.start.to_le_bytes(), range.end.to_le_bytes()].concat());
        }
        digest.bytes()
    }
}

/// What helps whatever the atlas is like.
const FEWER: &str = "light fewer parts by texels: give others light = \"vertex\"";

/// What helps where charts are too many for an atlas; one of `smallest` squares a side has one for each.
fn remedy(side: u32, smallest: u64) -> String {
    // more than there are in any case, and so at least the least that a site may ask for
    let needed = (smallest * u64::from(BOUNCE_BLOCK)).max(u64::from(side + BOUNCE_BLOCK));
    if needed > u64::from(MAX_TEXEL_SIDE) {
        return format!("the largest atlas, texels = {MAX_TEXEL_SIDE}, has too few for them as well; {FEWER}");
    }
    format!("write texels = {needed} or more in [bake], or {FEWER}")
}

/// Whether any part of a scene is lit by texels.
#[must_use]
pub fn expects_texels(scene: &Scene) -> bool {
    scene.parts.iter().any(|part| part.by_texels)
}

/// How many texels the drawn triangles of some parts are to have along a metre, beside one another, part by part: as many times as each part says, and fewer away
/// from all rooms.
///
/// # Panics
/// If there is no such part.
fn texel_density(site: &Site, scene: &Scene, parts: &[usize]) -> Vec<f32> {
    let mesh = &scene.mesh;
    let of = |&part: &usize| {
        let own = site.parts[part].texels as f32;
        let corners = |t: usize| mesh.triangles[t].map(|v| mesh.positions[v as usize]);
        scene.parts[part].drawn_triangles().map(move |t| own * nearness(&site.rooms, corners(t)))
    };
    parts.iter().flat_map(of).collect()
}

/// A scene whose triangles stand first that a light map is for, part by part and each part's in their order, and how densely each of those has texels beside the others: of
/// the parts that a bake lights by texels, or where there are none or `every` part is asked for, of all but those whose light is stored at vertices. The scene's parts stay in
/// the site's order and tell where their triangles are now, and whether they are among those.
#[must_use]
pub fn texels_first(site: &Site, mut scene: Scene, every: bool) -> (Scene, Vec<f32>) {
    let all = every || !expects_texels(&scene);
    for (part, of_site) in scene.parts.iter_mut().zip(&site.parts) {
        part.by_texels |= all && of_site.light != LightStorage::Vertex;
    }
    let is_chosen = |part: &usize| scene.parts[*part].by_texels;
    let (chosen, others): (Vec<usize>, Vec<usize>) = (0..scene.parts.len()).partition(is_chosen);
    let density = if chosen.is_empty() { Vec::new() } else { texel_density(site, &scene, &chosen) };
    let mut order: Vec<usize> = Vec::with_capacity(scene.mesh.triangles.len());
    for part in chosen.into_iter().chain(others) {
        let range = &mut scene.parts[part].triangles;
        let first = order.len();
        order.extend(range.clone());
        *range = first..order.len();
    }
    let mesh = &mut scene.mesh;
    mesh.triangles = order.iter().map(|&t| mesh.triangles[t]).collect();
    if !mesh.triangle_material.is_empty() {
        mesh.triangle_material = order.iter().map(|&t| mesh.triangle_material[t]).collect();
    }
    (scene, density)
}

/// How many texels a triangle has along a metre, beside one in a room.
pub(super) fn nearness(rooms: &[Room], corners: [Vec3; 3]) -> f32 {
    let low = corners.into_iter().fold(Vec3::INFINITY, Vec3::min);
    let high = corners.into_iter().fold(Vec3::NEG_INFINITY, Vec3::max);
    let nearest = rooms.iter().map(|room| distance_m(room, [low, high])).fold(f32::INFINITY, f32::min);
    if rooms.is_empty() { 1.0 } else { (NEAR_M / nearest.max(NEAR_M)).max(SPARSEST) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_atlas_larger_than_the_largest_is_not_asked_for() {
        assert!(remedy(64, 19).contains("texels = 76 "), "{}", remedy(64, 19));
        assert!(remedy(64, 16).contains("texels = 68 "), "more than was too little");
        assert!(remedy(2048, 4096).contains("texels = 16384 or more"));
        for (side, smallest) in [(2048, 4097), (16_384, 4096), (16_384, 1 << 40)] {
            let told = remedy(side, smallest);
            assert!(!told.contains("write") && told.contains("fewer parts"), "{told}");
        }
    }
}
