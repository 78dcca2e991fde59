//! What is not drawn although it lies in view: what large occluders hide, and what is too small to matter.
//!
//! Georgios Papaioannou, Athanasios Gaitatzes, Dimitrios Christopoulos: "Enhancing Virtual Reality Walkthroughs of Archaeological
//! Sites", VAST 2003, section 3.2. Both are decided for clusters, on the processor, after the view's frustum and the clusters' cones. Shadow culling
//! (`shadow`) changes no pixel: occluders are found inside the stone (`solids`) or on its flat faces (`faces`), and only those that a site
//! places itself (`[[matte]]`) may hide what could be seen. Contribution culling (`contribution`) leaves out objects (`objects`) that are smaller than a
//! threshold in pixels. What both save is told; what they cost and gain is in docs/decisions/025-shadow-culling.md.

pub mod contribution;
mod eye;
mod faces;
pub mod objects;
pub mod pair;
mod rectangles;
pub mod shadow;
mod slice;
pub mod solids;

use crate::daylight::chunk::KeptChunk;
use crate::daylight::closed::Bodies;
use crate::daylight::pages::GpuChunk;
use crate::daylight::seen::NumberSet;
use crate::daylight::view::{ClusterRef, Eye, Look, frustum_planes};
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::extract_resource::{ExtractResource, ExtractResourcePlugin};
use contribution::{LeftOut, Scale};
use eye::Solid;
use glam::Mat4;
use heliodon_bundle::site::Matte;
use objects::Objects;
use rayon::prelude::*;
use shadow::{Kind, Lies, Occluder, Onlooker, Shadow};
use solids::Stone;
use std::sync::{Arc, Mutex, PoisonError};

/// What is culled; the same for all cameras. Keys O and C of the head-up display switch it.
#[derive(Resource, Clone, Copy, Debug, PartialEq, ExtractResource)]
pub struct Culling {
    /// Whether what large occluders hide is left out: the pictures are the same.
    pub shadow: bool,
    /// Whether what is small is left out.
    pub contribution: bool,
    /// How small, in pixels across: more saves more and shows more of it.
    pub threshold_px: f32,
}

impl Default for Culling {
    fn default() -> Self {
        Self { shadow: true, contribution: true, threshold_px: 1.0 }
    }
}

impl Culling {
    /// Nothing is left out.
    #[must_use]
    pub fn none() -> Self {
        Self { shadow: false, contribution: false, ..Self::default() }
    }

    /// Only what leaves the pictures as they are.
    #[must_use]
    pub fn exact() -> Self {
        Self { contribution: false, ..Self::default() }
    }
}

/// Clusters and triangles of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Amount {
    /// Clusters.
    pub clusters: u64,
    /// Their triangles.
    pub triangles: u64,
}

impl Amount {
    fn add(&mut self, more: Self) {
        self.clusters += more.clusters;
        self.triangles += more.triangles;
    }
}

/// What culling saved, in all views of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Saved {
    /// What frustum and cones left.
    pub met: Amount,
    /// What of that is too small.
    pub small: Amount,
    /// What of the rest lies in shadows.
    pub hidden: Amount,
    /// Occluders that cast them.
    pub occluders: u64,
}

impl Saved {
    /// Adds what another view saved.
    pub fn add(&mut self, more: &Self) {
        self.met.add(more.met);
        self.small.add(more.small);
        self.hidden.add(more.hidden);
        self.occluders += more.occluders;
    }
}

/// What the last frame saved, as the render world tells it.
#[derive(Resource, Clone, Debug, Default)]
pub struct CullingTold(Arc<Mutex<(Saved, bool)>>);

impl CullingTold {
    /// What the last frame saved.
    #[must_use]
    pub fn last(&self) -> Saved {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).0
    }

    /// Whether it is known what can be culled of the bundle: that is found out after all of it is shown.
    #[must_use]
    pub fn is_ready(&self) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).1
    }

    pub(crate) fn tell(&self, saved: Saved, is_ready: bool) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = (saved, is_ready);
    }
}

/// Switches and tells culling; the stone's passes do it.
#[derive(Default)]
pub struct CullingPlugin;

impl Plugin for CullingPlugin {
    fn build(&self, app: &mut App) {
        let told = CullingTold::default();
        app.init_resource::<Culling>().insert_resource(told.clone()).add_plugins(ExtractResourcePlugin::<Culling>::default());
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            render_app.init_resource::<Culling>().insert_resource(told);
        }
    }
}

/// What a bundle says of the part of a chunk.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OfChunk {
    /// Whether it is ground, behind which nothing hides.
    pub is_ground: bool,
    /// Objects of it below so many pixels are small, in place of [`Culling::threshold_px`].
    pub least_px: Option<f32>,
}

/// What culling knows of a bundle.
#[derive(Debug)]
pub struct CullingScene {
    /// Mattes first, then the largest.
    pub occluders: Vec<Occluder>,
    solid: Vec<Solid>,
    objects: Objects,
}

impl CullingScene {
    /// Of all chunks of a bundle, in their order, each with what is said of it, and its mattes.
    #[must_use]
    pub fn new(chunks: &[Arc<KeptChunk>], of_chunks: &[OfChunk], bodies: &Bodies, mattes: &[Matte]) -> Self {
        let corners = |matte: &Matte| matte.corners.iter().map(|corner| Vec3::from(corner.map(|v| v as f32))).collect();
        let stone = Stone { chunks, bodies, of_chunks };
        let mut occluders: Vec<Occluder> = mattes.iter().map(|matte| Occluder::new(corners(matte), Kind::Matte)).collect();
        occluders.extend(solids::occluders(stone));
        occluders.extend(faces::occluders(stone));
        occluders.par_iter_mut().for_each(|occluder| occluder.parts = parts(occluder, chunks));
        let solid =
            chunks.iter().zip(&bodies.of_vertex).map(|(chunk, of_vertex)| solid_triangles(chunk, of_vertex, &bodies.closed));
        Self { occluders, solid: solid.collect(), objects: Objects::new(chunks, of_chunks, bodies) }
    }
}

/// The parts of all triangles that lie on both sides of an occluder's plane, cluster by cluster.
fn parts(occluder: &Occluder, chunks: &[Arc<KeptChunk>]) -> [f32; 2] {
    let (normal, corner) = (occluder.normal(), occluder.corners.first().copied().unwrap_or_default());
    let mut counts = [0_u64; 2];
    for cluster in chunks.iter().flat_map(|chunk| &*chunk.clusters) {
        counts[usize::from(normal.dot(cluster.center - corner) <= 0.0)] += cluster.indices.len() as u64;
    }
    let all = (counts[0] + counts[1]).max(1);
    counts.map(|count| count as f32 / all as f32)
}

fn solid_triangles(chunk: &KeptChunk, of_vertex: &[u32], closed: &[bool]) -> Solid {
    let is_closed = |triangle: &[u16]| closed[of_vertex[usize::from(triangle[0])] as usize];
    let triangles = || chunk.indices.chunks_exact(3);
    if triangles().all(is_closed) {
        return Solid::All;
    }
    let mut some = NumberSet::default();
    some.extend((0u32..).zip(triangles()).filter(|(_, triangle)| is_closed(triangle)).map(|(number, _)| number));
    if some == NumberSet::default() { Solid::None } else { Solid::Some(some) }
}

/// How a view culls.
#[derive(Clone, Copy, Debug)]
pub struct Culler<'a> {
    /// What is known of the bundle, once all of it is there.
    pub scene: Option<&'a Arc<CullingScene>>,
    /// What is culled.
    pub settings: Culling,
    /// Whether small things that were left out come back late. Where a picture must not depend on those before it, they do not.
    pub remembers: bool,
    /// Boxes around what has faded: nothing that lies in it hides anything.
    pub faded: &'a [(Vec3, Vec3)],
}

/// What a view leaves out, or both views of a pair.
#[derive(Debug, Default)]
pub struct ViewCulling {
    scene: Option<Arc<CullingScene>>,
    left_out: LeftOut,
    /// Of each chunk, the clusters that the last view left out; empty for none.
    pub removed: Vec<NumberSet>,
    /// What the last view saved.
    pub saved: Saved,
}

impl ViewCulling {
    /// Leaves nothing out.
    pub fn nothing(&mut self) {
        self.removed.clear();
        self.saved = Saved::default();
    }

    /// Takes over what was found for a pair.
    pub fn share(&mut self, pair: &Self) {
        self.removed.clone_from(&pair.removed);
        self.saved = pair.saved;
    }

    /// Of the clusters that any of these views meets, those that are drawn, in their order: all that one of them sees, unless it is small in all.
    #[must_use]
    pub fn thin(
        &mut self,
        culler: &Culler,
        chunks: &[GpuChunk],
        looks: &[Look],
        mut clusters: Vec<ClusterRef>,
    ) -> Vec<ClusterRef> {
        let triangles =
            |one: &ClusterRef| chunks[one.chunk as usize].kept.clusters[one.cluster as usize].indices.len() as u64 / 3;
        let amount = |clusters: &[ClusterRef]| Amount {
            clusters: clusters.len() as u64,
            triangles: clusters.iter().map(triangles).sum(),
        };
        let met = amount(&clusters);
        self.saved = Saved { met, ..Saved::default() };
        self.removed.clear();
        let Some(scene) = culler.scene.filter(|scene| scene.solid.len() == chunks.len()) else { return clusters };
        if !self.scene.as_ref().is_some_and(|before| Arc::ptr_eq(before, scene)) {
            self.left_out.clear();
            self.scene = Some(Arc::clone(scene));
        }
        let mut removed: Vec<NumberSet> = Vec::new();
        let mut remove = |one: &ClusterRef| {
            removed.resize(chunks.len(), NumberSet::default());
            removed[one.chunk as usize].extend([one.cluster]);
        };
        if culler.settings.contribution {
            let scales: Vec<Scale> = looks.iter().map(|look| Scale::new(&look.clip_from_world, look.size, look.eye)).collect();
            let mut view = self.left_out.next_view(&scene.objects, &scales, culler.settings.threshold_px, culler.remembers);
            clusters.retain(|one| {
                let is_small = view.has_all(scene.objects.of_cluster(one.chunk, one.cluster));
                if is_small {
                    remove(one);
                }
                !is_small
            });
        } else {
            self.left_out.clear();
        }
        let large = amount(&clusters);
        self.saved.small = Amount { clusters: met.clusters - large.clusters, triangles: met.triangles - large.triangles };
        let shadows: Vec<Vec<Shadow>> = looks
            .iter()
            .map(|look| match look.eye {
                Eye::At(eye) if culler.settings.shadow => scene.shadows(chunks, look, eye, culler.faded),
                // A parallel view casts no frusta; plans are drawn from above, where little hides.
                _ => Vec::new(),
            })
            .collect();
        // What one eye sees is hidden from neither.
        if !shadows.iter().any(Vec::is_empty) {
            let mut of_chunks: Vec<Option<Vec<u32>>> = vec![None; chunks.len()];
            clusters.retain(|one| {
                let kept = &chunks[one.chunk as usize].kept;
                let partly = of_chunks[one.chunk as usize]
                    .get_or_insert_with(|| shadows.iter().map(|shadows| partly_in(shadows, kept.bounds)).collect());
                let cluster = &kept.clusters[one.cluster as usize];
                let is_hidden = shadows.iter().zip(&*partly).all(|(shadows, partly)| {
                    let mut shadows = shadows.iter().enumerate().filter(|(number, _)| partly >> number & 1 == 1);
                    shadows.any(|(_, shadow)| shadow.holds(cluster.center, cluster.half) == Lies::Within)
                });
                if is_hidden {
                    remove(one);
                }
                !is_hidden
            });
        }
        let drawn = amount(&clusters);
        self.saved.hidden = Amount { clusters: large.clusters - drawn.clusters, triangles: large.triangles - drawn.triangles };
        self.saved.occluders = shadows.iter().map(|shadows| shadows.len() as u64).sum();
        self.removed = removed;
        clusters
    }
}

const _: () = assert!(shadow::MOST_OCCLUDERS <= 32, "a bit each");

/// A bit for each shadow in which a part of the box may lie.
fn partly_in(shadows: &[Shadow], (low, high): (Vec3, Vec3)) -> u32 {
    let (center, half) = ((low + high) * 0.5, (high - low) * 0.5);
    let bits = shadows.iter().enumerate().filter(|(_, shadow)| shadow.holds(center, half) != Lies::Without);
    bits.fold(0, |bits, (number, _)| bits | 1 << number)
}

impl CullingScene {
    /// The shadows that an eye casts.
    fn shadows(&self, chunks: &[GpuChunk], look: &Look, eye: Vec3, faded: &[(Vec3, Vec3)]) -> Vec<Shadow> {
        let (clip_from_world, size) = (&look.clip_from_world, look.size);
        let planes = frustum_planes(clip_from_world);
        let near_m = near_corner_m(clip_from_world, eye);
        // Of the largest pixels, those in the middle.
        let rows = clip_from_world.transpose();
        let forward = rows.w_axis.truncate();
        let focal = [rows.x_axis, rows.y_axis].map(|row| (row.truncate() - forward * row.truncate().dot(forward)).length());
        let margin_rad = (2.0 / (focal[0] * size.x)).max(2.0 / (focal[1] * size.y));
        if self.occluders.is_empty() || !(near_m.is_finite() && margin_rad.is_finite()) {
            return Vec::new();
        }
        let any_solid = self.occluders.iter().any(|occluder| occluder.kind == Kind::Solid && occluder.meets(&planes));
        let kept = chunks.iter().map(|chunk| &*chunk.kept);
        let open = any_solid && eye::is_in_the_open(kept.zip(&self.solid), eye, near_m);
        let occluders = self.occluders.iter().filter(|occluder| open || occluder.kind != Kind::Solid);
        // Mattes hide whatever is there.
        let in_faded =
            |occluder: &&Occluder| occluder.kind != Kind::Matte && faded.iter().any(|bounds| occluder.touches(*bounds));
        let occluders = occluders.filter(|occluder| !in_faded(occluder));
        let directions = directions(clip_from_world, eye);
        shadow::choose(occluders, Onlooker { eye, planes: &planes, margin_rad, near_m, directions: &directions })
    }
}

/// Directions from the eye, evenly over its picture.
fn directions(clip_from_world: &Mat4, eye: Vec3) -> Vec<Vec3> {
    let world_from_clip = clip_from_world.inverse();
    let [across, down] = shadow::LOOKS;
    let at = |i: u32, count: u32| (i as f32 + 0.5) / count as f32 * 2.0 - 1.0;
    let near = |i: u32| Vec3::new(at(i % across, across), at(i / across, down), 1.0);
    (0..across * down).map(|i| world_from_clip.project_point3(near(i)) - eye).collect()
}

/// How far from the eye the near plane's corners are.
fn near_corner_m(clip_from_world: &Mat4, eye: Vec3) -> f32 {
    let world_from_clip = clip_from_world.inverse();
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    corners.into_iter().map(|[x, y]| world_from_clip.project_point3(Vec3::new(x, y, 1.0)).distance(eye)).fold(0.0, f32::max)
}
