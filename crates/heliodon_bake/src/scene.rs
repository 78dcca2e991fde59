//! The geometry of a site: all parts in one mesh, so that everything occludes everything.

use crate::albedo::SceneAlbedo;
use crate::error::BakeError;
use crate::evidence;
use crate::prepare::Surfacing;
use crate::report::Reporter;
use crate::texels::Choice;
use glam::{Vec2, Vec3};
use heliodon_bundle::lineage::Prepared;
use heliodon_bundle::site::{Albedo, InputFile, InputKind, Part, Site};
use heliodon_image::SrgbImage;
use heliodon_light::{Detail, Surfaces, median_edge_m};
use heliodon_mesh::import::{ImportOptions, ImportReport, NormalSource, read_telling};
use heliodon_mesh::{Material, Mesh, Texture, TextureWrap};
use heliodon_rays::{BuildParams, KeptTiles, TriangleScene};
use std::cell::Cell;
use std::fs;
use std::mem::take;
use std::ops::Range;
use std::sync::Arc;

/// All parts of a site in one mesh.
#[derive(Debug)]
pub struct Scene {
    /// Vertices, triangles and materials of all parts, one after the other. Normals are there for all.
    pub mesh: Mesh,
    /// Which of them belong to each part of the site.
    pub parts: Vec<PartRange>,
    /// What was left out or looked odd in the files.
    pub warnings: Vec<String>,
    /// What the mesh is a simplification of; none where nothing was simplified.
    pub original: Option<Original>,
    /// What preparation made of the parts, for the manifest; none where they are as they were read.
    pub prepared: Option<Prepared>,
}

/// The geometry that rays meet where less of it is drawn.
#[derive(Debug, Default)]
pub struct Original {
    /// Its vertices, metres; none once [`Scene::take_rays`] has used them, but where `looks` are wanted.
    pub positions: Vec<Vec3>,
    /// Its triangles, likewise.
    pub triangles: Vec<[u32; 3]>,
    /// For each of them the triangle of the scene's mesh that stands for it.
    pub stands_for: Vec<u32>,
    /// For each vertex of the scene's mesh how far the original departs from the triangles around it, metres.
    pub clearance_m: Vec<f32>,
    /// What its vertices look like, where a panorama or the scan itself is to show it.
    pub(crate) looks: Surfacing,
    /// Of each part then whether its vertices have colours of their own: 1 or 0.
    pub(crate) colored: Vec<u8>,
}

impl Original {
    /// Bytes of what is kept of it once rays are taken.
    pub(crate) fn memory_bytes(&self) -> usize {
        let Self { positions, triangles, stands_for, clearance_m, looks, colored: _ } = self;
        let of_looks = size_of_val(looks.colors.as_slice()) + size_of_val(looks.normals.as_slice());
        let of_mesh = size_of_val(positions.as_slice()) + size_of_val(triangles.as_slice());
        of_mesh + size_of_val(stands_for.as_slice()) + size_of_val(clearance_m.as_slice()) + of_looks
    }

    /// Gives up what only those need who show it.
    pub(crate) fn forget_looks(&mut self) {
        let Self { stands_for, clearance_m, .. } = self;
        *self = Self { stands_for: take(stands_for), clearance_m: take(clearance_m), ..Self::default() };
    }
}

impl Scene {
    /// Builds what answers rays: over the original where there is one, whose geometry is then given up, for it is in the answer.
    ///
    /// # Errors
    /// More geometry than the ray engine holds.
    pub fn take_rays(&mut self) -> Result<TriangleScene, BakeError> {
        self.build_rays(None)
    }

    /// As [`Scene::take_rays`], and keeps on the way what is built.
    pub(crate) fn build_rays(&mut self, kept: Option<&dyn KeptTiles>) -> Result<TriangleScene, BakeError> {
        let (positions, triangles) = match &self.original {
            None => (&self.mesh.positions, &self.mesh.triangles),
            Some(original) => (&original.positions, &original.triangles),
        };
        let params = BuildParams::asked_for_long(triangles.len());
        let rays = match kept {
            None => TriangleScene::build(positions, triangles, &params)?,
            Some(kept) => TriangleScene::build_keeping(positions, triangles, &params, kept)?,
        };
        self.give_up_original();
        Ok(rays)
    }

    /// Gives up the original's geometry, which is in what answers rays; not where it is to be shown.
    pub(crate) fn give_up_original(&mut self) {
        if let Some(original) = self.original.as_mut().filter(|original| original.looks.is_empty()) {
            original.forget_looks();
        }
    }
}

/// A scene made ready to be asked for light: what a bake and its estimate both begin with.
pub struct Traceable<'a> {
    scene: &'a Scene,
    /// What rays meet.
    pub rays: TriangleScene,
    albedo: SceneAlbedo<'a>,
    drawn: Vec<Range<usize>>,
}

impl<'a> Traceable<'a> {
    /// Of a scene and its [`Scene::take_rays`].
    #[must_use]
    pub fn new(scene: &'a Scene, rays: TriangleScene) -> Self {
        let mesh = &scene.mesh;
        let albedo = SceneAlbedo::new(mesh, median_edge_m(&mesh.positions, &mesh.triangles));
        let drawn = scene.parts.iter().map(PartRange::drawn_triangles).collect();
        Self { scene, rays, albedo, drawn }
    }

    /// As the solver takes it.
    #[must_use]
    pub fn surfaces(&self) -> Surfaces<'_> {
        let mesh = &self.scene.mesh;
        let detail =
            |Original { stands_for, clearance_m, .. }: &'a Original| Detail { stands_for, clearance_m, shown: &self.drawn };
        Surfaces {
            rays: &self.rays,
            positions: &mesh.positions,
            normals: &mesh.normals,
            triangles: &mesh.triangles,
            albedo: &self.albedo,
            detail: self.scene.original.as_ref().map(detail),
        }
    }
}

/// Where a part lies in a [`Scene`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PartRange {
    /// Its vertices.
    pub vertices: Range<usize>,
    /// Its triangles.
    pub triangles: Range<usize>,
    /// How many of them, from the first on, are drawn; the others only reflect light.
    pub drawn: usize,
    /// The files it was read from.
    pub files: usize,
    /// Whether it is lit by texels, as its triangles decided when they were read.
    pub by_texels: bool,
}

impl PartRange {
    /// Its triangles that are drawn.
    #[must_use]
    pub fn drawn_triangles(&self) -> Range<usize> {
        self.triangles.start..self.triangles.start + self.drawn
    }
}

/// Reads and places every part of a site; what was left out of the files is told as warnings once all are read.
///
/// # Errors
/// Files that cannot be read, and an albedo image without texture coordinates to lay it on.
pub fn read(site: &Site, files: &[InputFile], reporter: &dyn Reporter) -> Result<Scene, BakeError> {
    read_all(site, files, None, reporter)
}

/// As [`read`]; returns the texture coordinates of the files of each part as well, one for each of its vertices, also where `site.toml` gives an albedo that needs
/// none and the scene has none therefore. None where no file of a part has any; zero for the vertices of those of its files that have none.
///
/// # Errors
/// As [`read`].
pub fn read_with_uvs(site: &Site, files: &[InputFile], reporter: &dyn Reporter) -> Result<(Scene, Vec<Vec<Vec2>>), BakeError> {
    let mut uvs = vec![Vec::new(); site.parts.len()];
    let scene = read_all(site, files, Some(&mut uvs), reporter)?;
    Ok((scene, uvs))
}

fn read_all(
    site: &Site,
    files: &[InputFile],
    mut uvs: Option<&mut [Vec<Vec2>]>,
    reporter: &dyn Reporter,
) -> Result<Scene, BakeError> {
    reporter.stage("reading", (0..site.parts.len()).map(|part| part_bytes(files, part)).sum());
    reporter.progress(0);
    let mut scene = Scene { mesh: Mesh::default(), parts: Vec::new(), warnings: Vec::new(), original: None, prepared: None };
    let mut report = ImportReport::default();
    let mut done = 0;
    for index in 0..site.parts.len() {
        let (first_vertex, first_triangle) = (scene.mesh.positions.len(), scene.mesh.triangles.len());
        let of_part = uvs.as_deref_mut().map(|uvs| &mut uvs[index]);
        read_files(site, files, index, (&mut scene.mesh, of_part), &mut report, &|read| reporter.progress(done + read))?;
        done += part_bytes(files, index);
        let (mesh, choice) = (&scene.mesh, Choice::of(site, index));
        let by_texels = choice.is_texels(&site.rooms, &mesh.positions, &mesh.triangles[first_triangle..]);
        scene.parts.push(PartRange {
            vertices: first_vertex..scene.mesh.positions.len(),
            triangles: first_triangle..scene.mesh.triangles.len(),
            drawn: scene.mesh.triangles.len() - first_triangle,
            files: files_of(files, index).count(),
            by_texels,
        });
    }
    reporter.finished();
    report.warnings.iter().for_each(|warning| reporter.warning(warning));
    scene.warnings = report.warnings;
    Ok(scene)
}

/// The geometry files of a part.
pub(crate) fn files_of(files: &[InputFile], part: usize) -> impl Iterator<Item = &InputFile> {
    files.iter().filter(move |file| file.kind == InputKind::Geometry(part))
}

/// The bytes of the geometry files of a part; what cannot be found any more counts for nothing, and fails when it is read.
pub(crate) fn part_bytes(files: &[InputFile], part: usize) -> u64 {
    files_of(files, part).map(|file| fs::metadata(&file.path).map_or(0, |data| data.len())).sum()
}

/// Reads the files of one part into a mesh of their own; `tell` hears how many of their bytes are read.
///
/// # Errors
/// As [`read`].
pub(crate) fn read_part(
    site: &Site,
    files: &[InputFile],
    part: usize,
    report: &mut ImportReport,
    tell: &dyn Fn(u64),
) -> Result<Mesh, BakeError> {
    let mut mesh = Mesh::default();
    read_files(site, files, part, (&mut mesh, None), report, tell)?;
    Ok(mesh)
}

/// Adds the files of one part to a mesh, and their texture coordinates as they are to what is to hold those of the part; `tell` hears how many of their bytes are read.
fn read_files(
    site: &Site,
    files: &[InputFile],
    index: usize,
    (into, mut uvs): (&mut Mesh, Option<&mut Vec<Vec2>>),
    report: &mut ImportReport,
    tell: &dyn Fn(u64),
) -> Result<(), BakeError> {
    let options = import_options(&site.parts[index], site.site.origin);
    let albedo = part_albedo(site, index, files)?;
    let (mut before, mut has_uvs) = (0, false);
    for file in files_of(files, index) {
        let last = Cell::new(0);
        let of_file = |read| {
            last.set(read);
            tell(before + read);
        };
        let mut mesh = read_telling(&file.path, &options, report, &of_file)?;
        before += last.get();
        if let Some(uvs) = &mut uvs {
            has_uvs |= !mesh.uvs.is_empty();
            let all = uvs.len() + mesh.positions.len();
            uvs.extend_from_slice(&mesh.uvs);
            uvs.resize(all, Vec2::ZERO);
        }
        if let Some(albedo) = &albedo {
            set_albedo(&mut mesh, albedo, site, index, file)?;
        }
        if into.positions.is_empty() {
            *into = mesh;
        } else {
            into.append(&mesh)?;
        }
    }
    if let Some(uvs) = uvs.filter(|_| !has_uvs) {
        uvs.clear();
    }
    Ok(())
}

/// How `site.toml` wants a part's files read.
fn import_options(part: &Part, origin: [f64; 3]) -> ImportOptions {
    ImportOptions {
        placement: part.placement(origin),
        // who names an angle wants it on normals that the file has, too
        normals: if part.crease_deg.is_some() { NormalSource::Computed } else { NormalSource::FileOrComputed },
        crease_deg: part.crease_deg.map(|degrees| degrees as f32),
        material_names: part.has_material_details(),
        ..ImportOptions::default()
    }
}

/// The material that `site.toml` gives a part in place of what its files say.
fn part_albedo(site: &Site, part: usize, files: &[InputFile]) -> Result<Option<Material>, BakeError> {
    Ok(match &site.parts[part].albedo {
        None => None,
        Some(Albedo::Rgb(rgb)) => {
            Some(Material { name: String::new(), base_color_linear: glam::DVec3::from(*rgb).as_vec3(), texture: None })
        }
        Some(Albedo::Image(name)) => {
            let file = files.iter().find(|file| file.kind == InputKind::Albedo(part));
            let path = file.map_or_else(|| site.folder().join(name), |file| file.path.clone());
            let mut image = SrgbImage::read(&path).map_err(|error| {
                let remedy = "an albedo is a PNG or JPEG image, or [r, g, b]";
                site.error_at(&["part", &part.to_string(), "albedo"], error.to_string(), remedy)
            })?;
            if let Some(file) = files.iter().find(|file| file.kind == InputKind::Evidence(part)) {
                let read = SrgbImage::read(&file.path).map_err(|error| error.to_string());
                read.and_then(|evidence| evidence::lay(&mut image, &evidence)).map_err(|error| {
                    let remedy =
                        "evidence is a PNG or JPEG image as large as the albedo, as `heliodon photo texture` writes it";
                    site.error_at(&["part", &part.to_string(), "evidence"], error, remedy)
                })?;
            }
            let texture = Texture { source: name.clone(), image, wrap: [TextureWrap::Repeat; 2] };
            Some(Material { name: name.clone(), base_color_linear: glam::Vec3::ONE, texture: Some(Arc::new(texture)) })
        }
    })
}

fn set_albedo(mesh: &mut Mesh, material: &Material, site: &Site, part: usize, file: &InputFile) -> Result<(), BakeError> {
    if material.texture.is_some() && mesh.uvs.is_empty() {
        return Err(site
            .error_at(
                &["part", &part.to_string(), "albedo"],
                format!("an image needs texture coordinates, and {} has none", file.name),
                "give the albedo as [r, g, b], or export the mesh with texture coordinates",
            )
            .into());
    }
    mesh.colors_linear = Vec::new();
    mesh.triangle_material = Vec::new();
    mesh.materials = vec![material.clone()];
    if material.texture.is_none() {
        mesh.uvs = Vec::new();
    }
    Ok(())
}
