//! The atlas: where the surfaces lie that are lit by texels, and which texels they have.

use crate::error::BakeError;
use crate::key::Digest;
use crate::scene::Scene;
use glam::{Vec2, Vec3};
use heliodon_bundle::site::{LightStorage, Room, Site};
use heliodon_bundle::texels::{BOUNCE_BLOCK, TEXEL_LEVELS, TexelInfo};
use heliodon_light::SurfacePlace;
use heliodon_lightmap::charts::ChartParams;
use heliodon_lightmap::packing::PackParams;
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
/// Parts whose triangles have longer edges are lit by texels unless told otherwise, metres: some ten texels of a room's atlas.
const AUTO_EDGE_M: f32 = 0.3;

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

impl Atlas {
    /// The atlas of a scene's parts that want one; none where no part does.
    ///
    /// # Errors
    /// A size that cannot hold all charts.
    pub fn new(site: &Site, scene: &Scene) -> Result<Option<Self>, BakeError> {
        let parts: Vec<usize> = (0..site.parts.len()).filter(|&part| wants_texels(site, scene, part)).collect();
        let triangles: Vec<Range<usize>> = parts.iter().map(|&part| scene.parts[part].drawn_triangles()).collect();
        let of_parts: Vec<[u32; 3]> =
            triangles.iter().flat_map(|range| &scene.mesh.triangles[range.clone()]).copied().collect();
        if of_parts.is_empty() {
            return Ok(None);
        }
        let density = |(&part, range): (&usize, &Range<usize>)| {
            let own = site.parts[part].texels as f32;
            let of = move |corners: [Vec3; 3]| own * nearness(&site.rooms, corners);
            range.clone().map(|t| of(scene.mesh.triangles[t].map(|v| scene.mesh.positions[v as usize]))).collect::<Vec<_>>()
        };
        let density: Vec<f32> = parts.iter().zip(&triangles).flat_map(density).collect();
        let side = site.bake.effective_texels();
        // whole squares of the coarsest level: what is apart there is apart on all
        let blocks = side / BOUNCE_BLOCK;
        let most_per_m = MOST_PER_M / BOUNCE_BLOCK as f32;
        let pack = PackParams { width: blocks, height: blocks, margin: 0, sheets: 1, most_per_m };
        let params = UnwrapParams { charts: ChartParams::default(), pack };
        let unwrapped = unwrap(&scene.mesh.positions, &of_parts, &density, &params).map_err(|error| {
            let remedy =
                format!("write texels = N in [bake], {BOUNCE_BLOCK} times as many as it says, or light fewer parts by texels");
            BakeError::from(site.error_at(
                &["bake", "texels"],
                format!("squares of {BOUNCE_BLOCK} x {BOUNCE_BLOCK} texels: {error}"),
                remedy,
            ))
        })?;
        Ok(Some(Self { parts, triangles, unwrapped, side }))
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

/// Whether any part of a site is lit by texels.
#[must_use]
pub fn expects_texels(site: &Site, scene: &Scene) -> bool {
    (0..site.parts.len()).any(|part| wants_texels(site, scene, part))
}

/// Whether a part is lit by texels. Left to itself, where the site has an atlas, it is where its triangles are larger, as seen from the rooms, than light at
/// their corners can be told from.
fn wants_texels(site: &Site, scene: &Scene, part: usize) -> bool {
    match site.parts[part].light {
        LightStorage::Vertex => false,
        LightStorage::Texel => true,
        LightStorage::Auto => site.bake.texels.is_some() && usual_edge_m(&site.rooms, scene, part) > AUTO_EDGE_M,
    }
}

/// The longest edge that triangles of a part have, metres in a room, or as large as they look from there: the median by the area that they show.
fn usual_edge_m(rooms: &[Room], scene: &Scene, part: usize) -> f32 {
    let mesh = &scene.mesh;
    let of = |t: &[u32; 3]| {
        let corners = t.map(|v| mesh.positions[v as usize]);
        let [a, b, c] = corners;
        let near = nearness(rooms, corners);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        (longest * near, 0.5 * (b - a).cross(c - a).length() * near * near)
    };
    let triangles = &mesh.triangles[scene.parts[part].drawn_triangles()];
    let mut edges: Vec<(f32, f32)> =
        triangles.iter().map(of).filter(|(edge, area)| edge.is_finite() && area.is_finite()).collect();
    edges.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all: f64 = edges.iter().map(|edge| f64::from(edge.1)).sum();
    let mut so_far = 0.0;
    let middle = edges.iter().find(|edge| {
        so_far += f64::from(edge.1);
        so_far > 0.5 * all
    });
    middle.map_or(0.0, |edge| edge.0)
}

/// How many texels a triangle has along a metre, beside one in a room.
fn nearness(rooms: &[Room], corners: [Vec3; 3]) -> f32 {
    let low = corners.into_iter().fold(Vec3::INFINITY, Vec3::min);
    let high = corners.into_iter().fold(Vec3::NEG_INFINITY, Vec3::max);
    // between the boxes of room and triangle
    let distance = |room: &Room| {
        let (min, max) = (Vec3::from(room.min.map(|x| x as f32)), Vec3::from(room.max.map(|x| x as f32)));
        (min - high).max(low - max).max(Vec3::ZERO).length()
    };
    let nearest = rooms.iter().map(distance).fold(f32::INFINITY, f32::min);
    if rooms.is_empty() { 1.0 } else { (NEAR_M / nearest.max(NEAR_M)).max(SPARSEST) }
}
