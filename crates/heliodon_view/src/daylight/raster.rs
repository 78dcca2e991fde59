//! What an eye sees, found on the processor where a processor draws.
//!
//! A driver on the processor puts triangles through its front end one after the other on one thread, 0.4 us each, whether they show or
//! not. Here the picture is cut into bands, which threads draw as item buffers: groups of triangles come near ones first, and those behind
//! what is drawn are passed over. Then each pixel knows its triangle, and with it the three vertices whose light it takes, their
//! weights and its albedo; the GPU lights vertices and pixels (relight.rs). An eye at rest keeps what its pixels show while the day passes.

use super::layout::{BLOCK, GROUP};
use super::pages::GpuChunk;
use super::parts::PART_TRIANGLES;
use super::seen::LightGroup;
use super::view::ClusterRef;
use crate::covering::gpu::Worn;
use glam::{DMat3, DVec3, Mat4, UVec2, UVec3, Vec4, Vec4Swizzles};
use heliodon_raster::{Extent, ItemBuffer, MAX_SIDE, NOTHING, Perspective, TILE_PX, Weights};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};

/// What a pixel without stone holds.
const NO_STONE: [u32; 4] = [u32::MAX; 4];
/// Bits of a vertex's number.
pub const NUMBER_BITS: u32 = 22;
/// Bands for each thread: what they take differs.
const BANDS_A_THREAD: usize = 2;
/// Triangles whose weights a band remembers, a power of two.
const REMEMBERED: usize = 256;

/// A camera in perspective.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    perspective: Perspective,
    /// Depth is the first, and the second times 1 / distance.
    depth: [f32; 2],
}

impl Lens {
    /// None for parallel projections, and for those whose near plane is oblique.
    #[must_use]
    pub fn new(clip_from_world: &Mat4) -> Option<Self> {
        let rows = clip_from_world.as_dmat4().transpose();
        let [x, y, z, w] = [rows.x_axis, rows.y_axis, rows.z_axis, rows.w_axis];
        // where x, y and w are nothing
        let from = DMat3::from_cols(x.xyz(), y.xyz(), w.xyz()).transpose();
        let eye = from.inverse() * -DVec3::new(x.w, y.w, w.w);
        let to_depth = z.xyz().dot(w.xyz()) / w.xyz().length_squared();
        let constant = z.w - to_depth * w.w;
        let near_m = constant / (1.0 - to_depth);
        let is_oblique = (z.xyz() - to_depth * w.xyz()).length() > 1e-4 * w.xyz().length();
        if !eye.is_finite() || is_oblique || !(near_m > 0.0 && near_m.is_finite()) {
            return None;
        }
        let axes = [x, y, w].map(|row| row.xyz().as_vec3());
        let perspective = Perspective { eye: eye.as_vec3(), axes, near_m: near_m as f32 };
        Some(Self { perspective, depth: [to_depth as f32, constant as f32] })
    }
}

/// Stone, as the picture knows it.
#[derive(Clone, Copy, Debug)]
pub struct Stone<'a> {
    /// All chunks.
    pub chunks: &'a [GpuChunk],
    /// The row of [`BLOCK`] vertices at which each page begins, in the numbering of all vertices.
    pub page_rows: &'a [u32],
    /// What each part wears, as far as anything is worn.
    pub worn: &'a [Worn],
}

/// What each pixel shows.
#[derive(Debug, Default)]
pub struct Raster {
    size: UVec2,
    bands: Vec<Band>,
    queue: Vec<Queued>,
    /// For each pixel, row after row from the top: the numbers of three vertices and ten bits each of the root of the albedo; the weights of the second
    /// and the third.
    pub words: Vec<[u32; 4]>,
    /// For each pixel its depth.
    pub depth: Vec<f32>,
    /// The vertices whose light it takes.
    pub groups: Vec<LightGroup>,
}

/// A part of a chunk that may show.
#[derive(Clone, Copy, Debug)]
struct Queued {
    /// None where it reaches before the near plane.
    extent: Option<Extent>,
    chunk: u32,
    part: u32,
}

/// Some rows of the picture, and what drawing them needs.
#[derive(Debug)]
struct Band {
    items: ItemBuffer,
    /// Triangles that were met last, each at its place in the table.
    remembered: Vec<(u32, Surface)>,
}

/// A triangle that shows.
#[derive(Clone, Copy, Debug)]
struct Surface {
    weights: Weights,
    vertices: [u32; 3],
    /// Of the first corner, and how far those of the others are from it; all times 1023 squared.
    albedo: [Vec4; 3],
}

impl Raster {
    /// Whether a picture of this size can be drawn.
    #[must_use]
    pub fn can_be(size: UVec2) -> bool {
        size.min_element() > 0 && size.max_element() as usize <= MAX_SIDE
    }

    /// Draws `clusters` as they are seen through `lens`.
    ///
    /// # Panics
    /// With a size that [`Self::can_be`] refuses.
    pub fn draw(&mut self, size: UVec2, lens: &Lens, stone: Stone, clusters: &[ClusterRef]) {
        let chunks = stone.chunks;
        let mut ends = 0;
        let group_begins: Vec<u32> = chunks
            .iter()
            .map(|chunk| {
                let begin = ends;
                ends += chunk.lit_at.len() as u32;
                begin
            })
            .collect();
        let group_words = (ends as usize).div_ceil(64);
        let numbers = || Paged { stone, group_begins: &group_begins, seen: vec![0; group_words] };
        let told = self.draw_by(size, lens, stone, (clusters, &AtomicBool::new(false)), numbers);
        self.groups.clear();
        for (number, chunk) in chunks.iter().enumerate() {
            for group in 0..chunk.lit_at.len() as u32 {
                let at = group_begins[number] + group;
                let is_seen = |band: &Paged| band.seen[at as usize / 64] >> (at % 64) & 1 == 1;
                if told.iter().any(is_seen) {
                    self.groups.push(LightGroup { chunk: number as u32, group: group as u16 });
                }
            }
        }
    }

    /// As [`Self::draw`], but pixels number the vertices as they are met first, whatever page they are in; returns chunk and number in it of each. None where `is_off` became
    /// true meanwhile, or there are more than pixels can tell apart.
    ///
    /// # Panics
    /// With a size that [`Self::can_be`] refuses.
    pub fn draw_numbered(
        &mut self,
        size: UVec2,
        lens: &Lens,
        stone: Stone,
        clusters: &[ClusterRef],
        is_off: &AtomicBool,
    ) -> Option<Vec<(u32, u16)>> {
        let met = self.draw_by(size, lens, stone, (clusters, is_off), Met::default);
        if is_off.load(Ordering::Relaxed) {
            return None;
        }
        let mut all: Vec<(u32, u16)> = Vec::with_capacity(met.iter().map(|band| band.vertices.len()).sum());
        let begins: Vec<u32> = met
            .into_iter()
            .map(|band| {
                let begin = all.len() as u32;
                all.extend(band.vertices);
                begin
            })
            .collect();
        if all.len() > 1 << NUMBER_BITS {
            return None;
        }
        let band_pixels = self.band_pixels();
        self.words.par_rchunks_mut(band_pixels).zip(&begins).for_each(|(words, begin)| {
            for pixel in words.iter_mut().filter(|pixel| **pixel != NO_STONE) {
                pixel[..3].iter_mut().for_each(|word| *word += begin);
            }
        });
        Some(all)
    }

    /// Pixels of a band; the highest may have fewer. Bands are counted from the lowest row, pixels from the top.
    fn band_pixels(&self) -> usize {
        self.bands[0].items.held().len() * self.size.x as usize
    }

    /// Finds what each pixel shows, band by band with numbers of their own; of no use if the flag became true meanwhile.
    fn draw_by<N: Numbers + Send>(
        &mut self,
        size: UVec2,
        lens: &Lens,
        stone: Stone,
        (clusters, is_off): (&[ClusterRef], &AtomicBool),
        numbers: impl Fn() -> N + Sync,
    ) -> Vec<N> {
        if self.size != size {
            *self = Self::new(size, rayon::current_num_threads());
        }
        let [width, height] = size.to_array().map(|side| side as usize);
        let chunks = stone.chunks;
        let goes_on = || !is_off.load(Ordering::Relaxed);
        clusters.par_chunk_by(|a, b| a.chunk == b.chunk).filter(|_| goes_on()).for_each(|of_chunk| {
            chunks[of_chunk[0].chunk as usize].parts();
        });
        if !goes_on() {
            return Vec::new();
        }
        self.queue.clear();
        for &ClusterRef { chunk, cluster } in clusters {
            let parts = chunks[chunk as usize].parts();
            self.queue.extend(parts.of_cluster(cluster).map(|part| Queued { extent: None, chunk, part }));
        }
        self.queue.par_iter_mut().with_min_len(512).for_each(|queued| {
            let bounds = chunks[queued.chunk as usize].parts().part(queued.part).bounds;
            queued.extent = Extent::new(&lens.perspective, bounds, [width, height]);
        });
        // Those before the near plane first, then by how near they are.
        self.queue.sort_by(|a, b| {
            let near = |queued: &Queued| queued.extent.map_or(f32::INFINITY, |extent| extent.nearness);
            near(b).total_cmp(&near(a))
        });
        let band_pixels = self.band_pixels();
        let view = View { lens, stone, queue: &self.queue, size: [width, height] };
        let pixels = self.words.par_rchunks_mut(band_pixels).zip(self.depth.par_rchunks_mut(band_pixels));
        let bands = self.bands.par_iter_mut().zip(pixels).with_max_len(1);
        let told = bands.map(|(band, (words, depth))| {
            let mut numbers = numbers();
            band.draw(&view, is_off);
            if goes_on() {
                band.tell(&view, &mut numbers, words, depth);
            }
            numbers
        });
        told.collect()
    }

    /// Triangles that show.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        let mut ids: Vec<u32> = self.bands.iter().flat_map(|band| band.items.rows()).flatten().copied().collect();
        ids.sort_unstable();
        ids.dedup();
        ids.iter().filter(|&&id| id != NOTHING).count() as u64
    }

    fn new(size: UVec2, threads: usize) -> Self {
        let [width, height] = size.to_array().map(|side| side as usize);
        let tiles = height.div_ceil(TILE_PX);
        let rows = tiles.div_ceil(threads * BANDS_A_THREAD) * TILE_PX;
        let band = |first: usize| Band {
            items: ItemBuffer::band([width, height], first..(first + rows).min(height)),
            remembered: vec![(NOTHING, Surface::NONE); REMEMBERED],
        };
        Self {
            size,
            bands: (0..height).step_by(rows).map(band).collect(),
            words: vec![NO_STONE; width * height],
            depth: vec![0.0; width * height],
            ..Self::default()
        }
    }
}

/// What bands are drawn from.
struct View<'a> {
    lens: &'a Lens,
    stone: Stone<'a>,
    queue: &'a [Queued],
    size: [usize; 2],
}

/// How the vertices of a picture are numbered.
trait Numbers {
    /// Whether a triangle that no two pixels side by side can show takes all its light from its nearest corner: half of the vertices are to be lit then.
    const NEAREST: bool;

    /// The number of a chunk's vertex, whose light some pixel takes.
    fn number(&mut self, chunk: u32, vertex: u16) -> u32;
}

/// By their places in the pages; which groups of them are seen is noted.
struct Paged<'a> {
    stone: Stone<'a>,
    group_begins: &'a [u32],
    /// A bit for each group of vertices of all chunks.
    seen: Vec<u64>,
}

impl Numbers for Paged<'_> {
    const NEAREST: bool = false;

    fn number(&mut self, chunk: u32, vertex: u16) -> u32 {
        let group = self.group_begins[chunk as usize] + u32::from(vertex) / GROUP;
        self.seen[group as usize / 64] |= 1 << (group % 64);
        let chunk = &self.stone.chunks[chunk as usize];
        self.stone.page_rows[chunk.page] * BLOCK + chunk.base_vertex + u32::from(vertex)
    }
}

/// As they are met.
#[derive(Default)]
struct Met {
    numbers: HashMap<(u32, u16), u32>,
    vertices: Vec<(u32, u16)>,
}

impl Numbers for Met {
    const NEAREST: bool = true;

    fn number(&mut self, chunk: u32, vertex: u16) -> u32 {
        let next = self.vertices.len() as u32;
        let number = *self.numbers.entry((chunk, vertex)).or_insert(next);
        if number == next {
            self.vertices.push((chunk, vertex));
        }
        number
    }
}

/// The bits of an item's number that say which triangle of its part it is.
const TRIANGLE_BITS: u32 = PART_TRIANGLES.ilog2();
const _: () = assert!(PART_TRIANGLES.is_power_of_two());

impl Band {
    fn draw(&mut self, view: &View, is_off: &AtomicBool) {
        let items = &mut self.items;
        items.clear();
        let held = items.held();
        for (at, queued) in view.queue.iter().enumerate() {
            if is_off.load(Ordering::Relaxed) {
                return;
            }
            if queued.extent.is_some_and(|extent| !extent.meets(&held) || items.hides(&extent)) {
                continue;
            }
            let chunk = &view.stone.chunks[queued.chunk as usize];
            let parts = chunk.parts();
            let id = |number: usize| (at << TRIANGLE_BITS | number) as u32;
            items.draw(&view.lens.perspective, parts.group(parts.part(queued.part)), id, |_| chunk.closed);
        }
    }

    /// Says of each pixel what it shows.
    fn tell(&mut self, view: &View, numbers: &mut impl Numbers, words: &mut [[u32; 4]], depth: &mut [f32]) {
        let [width, _] = view.size;
        let Self { items, remembered } = self;
        // Items have other numbers in each frame.
        remembered.iter_mut().for_each(|(known, _)| *known = NOTHING);
        let [to_depth, constant] = view.lens.depth;
        let held = items.held();
        for (nearness, depth) in items.nearness().zip(depth.rchunks_exact_mut(width)) {
            for (depth, &nearness) in depth.iter_mut().zip(nearness) {
                *depth = if nearness == 0.0 { 0.0 } else { to_depth + constant * nearness };
            }
        }
        // Tile by tile: of few triangles, which are remembered.
        for bottom in (0..held.len()).step_by(TILE_PX) {
            for left in (0..width).step_by(TILE_PX) {
                for row in bottom..(bottom + TILE_PX).min(held.len()) {
                    let to = (held.len() - 1 - row) * width;
                    let columns = left..(left + TILE_PX).min(width);
                    let ids = &items.row(row)[columns.clone()];
                    for ((column, &id), words) in columns.clone().zip(ids).zip(&mut words[to + left..to + columns.end]) {
                        if id == NOTHING {
                            *words = NO_STONE;
                            continue;
                        }
                        let (known, surface) = &mut remembered[id as usize % REMEMBERED];
                        if *known != id {
                            (*known, *surface) = (id, Surface::new(view, items, (id, [column, held.start + row]), numbers));
                        }
                        *words = surface.words(column, held.start + row);
                    }
                }
            }
        }
    }
}

impl Surface {
    const NONE: Self = Self { weights: Weights::NONE, vertices: [0; 3], albedo: [Vec4::ZERO; 3] };

    /// Of an item, and a pixel that shows it.
    fn new<N: Numbers>(view: &View, items: &ItemBuffer, (id, pixel): (u32, [usize; 2]), numbers: &mut N) -> Self {
        let queued = &view.queue[(id >> TRIANGLE_BITS) as usize];
        let chunk = &view.stone.chunks[queued.chunk as usize];
        let first = chunk.parts().part(queued.part).first_triangle;
        let corners = chunk.kept.triangle(first + (id & (PART_TRIANGLES as u32 - 1)));
        let [a, b, c] = corners.map(|vertex| {
            let word = chunk.kept.albedo[usize::from(vertex)];
            let root = (UVec3::new(word, word >> 10, word >> 20) & 1023).as_vec3();
            let own = root * root;
            let coat = view.stone.worn.get(usize::from(chunk.part)).and_then(|worn| worn.coat);
            const WHOLE: f32 = 1023.0 * 1023.0;
            coat.map_or(own, |coat| coat.over(own / WHOLE) * WHOLE).extend(0.0)
        });
        let weights = items.weights(&view.lens.perspective, corners.map(|vertex| chunk.kept.positions[usize::from(vertex)]));
        let vertices = match nearest(&weights, pixel).filter(|_| N::NEAREST) {
            Some(corner) => [numbers.number(queued.chunk, corners[corner]); 3],
            None => corners.map(|vertex| numbers.number(queued.chunk, vertex)),
        };
        Self { weights, vertices, albedo: [a, b - a, c - a] }
    }

    /// Of a pixel.
    #[inline(always)]
    fn words(&self, column: usize, row: usize) -> [u32; 4] {
        let [to_b, to_c] = self.weights.at(column, row);
        let albedo = self.albedo[0] + self.albedo[1] * to_b + self.albedo[2] * to_c;
        let root = albedo.clamp(Vec4::ZERO, Vec4::splat(1023.0 * 1023.0)).sqrt();
        let codes = (Vec4::new(to_b, to_c, 0.0, 0.0) + 0.5).clamp(Vec4::ZERO, Vec4::splat(2.0)) * (0.5 * 65535.0);
        // Of a number below it, this one's last bits are the nearest whole number.
        let whole = Vec4::splat((1 << 23) as f32);
        let [root, codes] = [root, codes].map(|numbers| (numbers + whole).to_array().map(|number| number.to_bits() & 0xffff));
        let [a, b, c] = self.vertices;
        [a | root[0] << NUMBER_BITS, b | root[1] << NUMBER_BITS, c | root[2] << NUMBER_BITS, codes[0] | codes[1] << 16]
    }
}

/// The corner nearest to a pixel's middle of a triangle that is shown by neither the pixel beside it nor the one above it, however it lies: some weight
/// changes by one on the way to each.
fn nearest(weights: &Weights, [column, row]: [usize; 2]) -> Option<usize> {
    let all = |[to_b, to_c]: [f32; 2]| [1.0 - to_b - to_c, to_b, to_c];
    let here = all(weights.at(column, row));
    let is_out = |there: [f32; 3]| here.iter().zip(there).any(|(here, there)| (here - there).abs() >= 1.0);
    let is_alone = [[column + 1, row], [column, row + 1]].iter().all(|&[x, y]| is_out(all(weights.at(x, y))));
    (0..3).filter(|_| is_alone).max_by(|&a, &b| here[a].total_cmp(&here[b]))
}
