//! Meshes that move: skinned, morphed and animated glTF scenes, and meshes with a vertex cache.
//!
//! A [`MovingMesh`] is a mesh at rest, of which triangles, texture coordinates, colours and materials hold for every pose, and clips that
//! say where its vertices are at a time. Its vertices are those of [`crate::import::read`], in the same order; vertices that the importer
//! appended (texture seams, hard edges) move with those that they repeat, and the placement applies to every pose.
//!
//! Of glTF: node animations, skins (any number of joints up to sixteen a vertex), morph targets of positions and normals; steps, straight
//! lines and cubic splines between keyframes. Normals are carried by the inverse transpose of what carries the position; where a morph
//! target says positions only they are computed from the pose. What of an animation cannot be used is left out and told in the report; a
//! broken skin is an error, because the mesh would have no shape.
//!
//! A pose of 8,325 vertices with four joints each takes 0.2 ms, one of a cache of 3,249 vertices 0.25 ms, most of it for normals (one
//! core); `cargo test -p heliodon_mesh --test motion -- --ignored --nocapture` tells for the machine at hand.

mod cache;
pub(crate) mod part;
pub mod pc2;
mod renewal;
pub(crate) mod rig;
mod rigid;
pub mod rules;
pub(crate) mod track;

use crate::Mesh;
use crate::import::{self, Format, ImportError, ImportOptions, ImportReport, Place, Source};
use cache::Cache;
use glam::{DAffine3, Vec3};
use rig::{Rig, Scratch};
use rigid::Rigid;
use std::path::Path;

pub use rules::{Palette, PoseRules};

/// Frames a second that a vertex cache is taken to have, since its file does not say: those of European television and of
/// [`mod@crate::figures::cloth`]. Film and what Blender exports untouched have 24, American television and 3ds Max 30.
pub const CACHE_FRAMES_PER_S: f32 = 25.0;

/// A motion that a mesh can perform.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// Its name in the file, `animation 3` where that has none, or `cache`.
    pub name: String,
    /// How long it lasts, in seconds; 0 where it is one pose.
    pub duration_s: f32,
}

/// Where the vertices are at a time; reuse it from pose to pose, and nothing is allocated after the first.
#[derive(Clone, Debug, Default)]
pub struct Pose {
    /// Vertex positions in metres, in the site's space; as many as the rest mesh has, finite.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals, as many.
    pub normals: Vec<Vec3>,
    scratch: Scratch,
}

/// A mesh and what moves it.
#[derive(Clone, Debug)]
pub struct MovingMesh {
    rest: Mesh,
    clips: Vec<Clip>,
    motion: Motion,
}

#[derive(Clone, Debug)]
enum Motion {
    Still,
    Rig(Box<Rig>),
    Cache(Box<Cache>),
}

impl MovingMesh {
    /// A mesh that nothing moves. One without normals gets computed ones.
    #[must_use]
    pub fn still(mut mesh: Mesh) -> Self {
        if mesh.normals.len() != mesh.positions.len() {
            crate::normals::compute(&mut mesh);
        }
        Self { rest: mesh, clips: Vec::new(), motion: Motion::Still }
    }

    fn rigged(mesh: Mesh, rig: Option<Rig>) -> Self {
        let Some(rig) = rig else { return Self::still(mesh) };
        let clips = rig.clips.iter().map(|clip| Clip { name: clip.name.clone(), duration_s: clip.duration_s }).collect();
        Self { rest: mesh, clips, motion: Motion::Rig(Box::new(rig)) }
    }

    /// The mesh in its default pose: skins applied, nodes and morph weights as the file has them where nothing is animated. A cached
    /// mesh's own pose is that of its mesh file.
    #[must_use]
    pub fn rest(&self) -> &Mesh {
        &self.rest
    }

    /// What it can perform; empty where nothing moves.
    #[must_use]
    pub fn clips(&self) -> &[Clip] {
        &self.clips
    }

    /// The first clip of that name.
    #[must_use]
    pub fn clip_named(&self, name: &str) -> Option<usize> {
        self.clips.iter().position(|clip| clip.name == name)
    }

    /// Sets how many frames of a vertex cache make a second, instead of [`CACHE_FRAMES_PER_S`]; finite and above 0, else nothing is
    /// changed. Without a cache nothing is changed either.
    pub fn set_cache_frames_per_s(&mut self, frames_per_s: f32) {
        if let Motion::Cache(cache) = &mut self.motion
            && frames_per_s > 0.0
            && frames_per_s.is_finite()
        {
            cache.set_frames_per_s(frames_per_s);
            self.clips = vec![cache.clip()];
        }
    }

    /// Fills a pose with where the vertices are `time_s` seconds into a clip. The time is clamped to the clip's duration (the caller
    /// wraps it where the clip goes round; NaN is the beginning); for a clip that does not exist, the rest.
    pub fn pose(&self, clip: usize, time_s: f32, pose: &mut Pose) {
        let time_s = self.clamped(clip, time_s);
        match &self.motion {
            Motion::Rig(rig) if clip < rig.clips.len() => rig.pose(rig.clips.get(clip), time_s, &self.rest, pose),
            Motion::Cache(cache) if clip == 0 => cache.pose(time_s, &self.rest, pose),
            _ => {
                pose.positions.clone_from(&self.rest.positions);
                pose.normals.clone_from(&self.rest.normals);
            }
        }
    }

    fn clamped(&self, clip: usize, time_s: f32) -> f32 {
        let duration_s = self.clips.get(clip).map_or(0.0, |clip| clip.duration_s);
        // max and min take the number where the other is NaN
        time_s.max(0.0).min(duration_s)
    }

    /// Whether the clip moves the whole mesh as one rigid body, so that what was found out about its own shape (a visibility matrix) holds
    /// in every pose: no skin, no morphing, no change of scale, and all of it on one moving node. True where it moves nothing.
    #[must_use]
    pub fn rigid(&self, clip: usize) -> bool {
        match &self.motion {
            Motion::Still => true,
            Motion::Rig(rig) => rig.clips.get(clip).is_none_or(|clip| clip.rigid != Rigid::No),
            Motion::Cache(_) => clip != 0,
        }
    }

    /// For a [`MovingMesh::rigid`] clip the motion `site_at_time_from_site_at_rest`, a rotation and a shift in metres; none for others.
    /// The time is clamped as in [`MovingMesh::pose`].
    #[must_use]
    pub fn rigid_at(&self, clip: usize, time_s: f32) -> Option<DAffine3> {
        let time_s = self.clamped(clip, time_s);
        let still = self.rigid(clip).then_some(DAffine3::IDENTITY);
        let Motion::Rig(rig) = &self.motion else { return still };
        match rig.clips.get(clip).map(|clip| (clip, clip.rigid)) {
            Some((clip, Rigid::Node(node))) => rigid::motion(rig, clip, node, time_s),
            _ => still,
        }
    }

    /// Checks that the rest mesh keeps the promises of [`Mesh`], and that the first, middle and last pose of each clip are finite and unit.
    ///
    /// # Errors
    /// The first promise that is broken, in words.
    pub fn validate(&self) -> Result<(), String> {
        self.rest.validate().map_err(|error| error.to_string())?;
        let mut pose = Pose::default();
        for (k, clip) in self.clips.iter().enumerate() {
            if !(clip.duration_s >= 0.0 && clip.duration_s.is_finite()) {
                return Err(format!("the clip \"{}\" lasts {} s", clip.name, clip.duration_s));
            }
            for time_s in [0.0, 0.5 * clip.duration_s, clip.duration_s] {
                self.pose(k, time_s, &mut pose);
                let Pose { positions, normals, .. } = &mut pose;
                let mesh = Mesh { positions: std::mem::take(positions), normals: std::mem::take(normals), ..Mesh::default() };
                if mesh.positions.len() != self.rest.positions.len() {
                    return Err(format!("the clip \"{}\" poses {} vertices", clip.name, mesh.positions.len()));
                }
                mesh.validate().map_err(|error| format!("the clip \"{}\" at {time_s} s: {error}", clip.name))?;
            }
        }
        Ok(())
    }
}

/// Reads a mesh with what moves it: of a `.glb` or `.gltf` its skins, morph targets and animations. Meshes of every other format, and
/// scenes without animations, are [`MovingMesh::still`]. Adds to `report` what was left out or mended.
///
/// # Errors
/// As [`crate::import::read_reporting`], and where a skin is broken.
pub fn read_moving(path: &Path, options: &ImportOptions, report: &mut ImportReport) -> Result<MovingMesh, ImportError> {
    let (mut source, format) = import::open(path)?;
    read_source(&mut source, format, path.parent(), options, report)
}

/// Reads a mesh with what moves it from the bytes of a file; `name` is for messages. Files that it names are not read.
///
/// # Errors
/// As [`read_moving`].
pub fn from_bytes(
    bytes: &[u8],
    format: Format,
    name: &Path,
    options: &ImportOptions,
    report: &mut ImportReport,
) -> Result<MovingMesh, ImportError> {
    read_source(&mut Source::from_bytes(name, bytes), format, None, options, report)
}

fn read_source(
    source: &mut Source,
    format: Format,
    folder: Option<&Path>,
    options: &ImportOptions,
    report: &mut ImportReport,
) -> Result<MovingMesh, ImportError> {
    if format != Format::Gltf {
        let imported = import::read_source(source, format, folder, options, report)?;
        return Ok(MovingMesh::still(imported.mesh));
    }
    let mut own = ImportReport::default();
    let result = import::read_moving_gltf(source, folder, options, &mut own);
    report.add(own);
    result.map(|(mesh, rig)| MovingMesh::rigged(mesh, rig))
}

/// Reads a mesh and a PC2 vertex cache (see [`pc2`]) that moves it: one clip, named `cache`, of [`CACHE_FRAMES_PER_S`] unless
/// [`MovingMesh::set_cache_frames_per_s`] says otherwise, which begins at the cache's first sample whatever its first frame is.
///
/// The cache holds the mesh file's own vertices in the file's order, unit and axes; of a glTF scene those of its nodes one after the
/// other, in the scene's space. STL has no vertices of its own. Between samples vertices go straight; normals are computed for each pose.
///
/// # Errors
/// As [`crate::import::read_reporting`] and [`pc2::read`], and where the cache has not as many points as the mesh has vertices.
pub fn read_cached(
    mesh: &Path,
    cache: &Path,
    options: &ImportOptions,
    report: &mut ImportReport,
) -> Result<MovingMesh, ImportError> {
    let (mut source, format) = import::open(mesh)?;
    if format == Format::Stl {
        return Err(source.fail("has no vertices that a cache could move", "write the mesh as OBJ or PLY"));
    }
    let site_from_file = options.placement.affine().map_err(|error| {
        ImportError::new(mesh, Place::File, format!("cannot be placed: {error}"), "mend the part's placement")
    })?;
    let points = pc2::read(cache)?;
    let imported = import::read_source(&mut source, format, mesh.parent(), options, report)?;
    let (mesh, moving, bad) = Cache::new(points, CACHE_FRAMES_PER_S, imported, &site_from_file, cache)?;
    if bad > 0 {
        report.warn(cache, format_args!("{bad} positions are NaN, infinite or out of reach; those vertices are at rest there"));
    }
    Ok(MovingMesh { rest: mesh, clips: vec![moving.clip()], motion: Motion::Cache(Box::new(moving)) })
}
