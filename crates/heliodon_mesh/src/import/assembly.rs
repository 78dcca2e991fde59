//! What all readers do with what they read: place it, and make a valid mesh of it at the end.

use super::error::{ImportError, ImportReport, Place};
use super::{FARTHEST_M, ImportOptions, NormalSource};
use crate::place::Affine;
use crate::{Material, Mesh, normals};
use glam::{DVec3, Vec2, Vec3};
use std::path::Path;

/// Where `f32` positions are coarser than this, an origin nearer to the site is worth a warning (from 8.4 km away).
const COARSE_POSITIONS_M: f32 = 1.0e-3;

pub(crate) struct Assembly<'a> {
    pub file: &'a Path,
    pub options: &'a ImportOptions,
    pub report: &'a mut ImportReport,
    pub mesh: Mesh,
    /// From the file's space to the site's.
    pub site_from_file: Affine,
    /// The format's own angle for hard edges, where it has one.
    pub own_crease_deg: Option<f32>,
    /// Vertices before seams split some; all of them, if none did.
    pub file_vertices: Option<u64>,
    /// For each vertex behind the file's own the one that it repeats.
    pub appended: Vec<u32>,
    bad_colors: u64,
}

/// A mesh, and which of its vertices are the file's.
pub(crate) struct Imported {
    pub mesh: Mesh,
    /// For each vertex behind the file's own, which stand first and in the file's order, the one of those that it repeats.
    pub appended: Vec<u32>,
}

impl Imported {
    /// How many of the mesh's vertices are the file's own.
    pub fn file_vertices(&self) -> usize {
        self.mesh.positions.len() - self.appended.len()
    }
}

impl<'a> Assembly<'a> {
    pub fn new(file: &'a Path, options: &'a ImportOptions, report: &'a mut ImportReport) -> Result<Self, ImportError> {
        let site_from_file = options.placement.affine().map_err(|error| {
            ImportError::new(file, Place::File, format!("cannot be placed: {error}"), "mend the part's placement")
        })?;
        Ok(Self {
            file,
            options,
            report,
            mesh: Mesh::default(),
            site_from_file,
            own_crease_deg: None,
            file_vertices: None,
            appended: Vec::new(),
            bad_colors: 0,
        })
    }

    /// Appends a vertex at a position of the file; one that is out of reach is remembered as NaN.
    #[inline]
    pub fn push_position(&mut self, p_file: DVec3) {
        self.mesh.positions.push(rounded(self.site_from_file.position(p_file)));
    }

    #[inline]
    pub fn push_normal(&mut self, n_file: DVec3) {
        self.mesh.normals.push(self.site_from_file.normal(n_file));
    }

    /// Appends a linear colour; what is no albedo is clamped to one.
    #[inline]
    pub fn push_color(&mut self, linear: Vec3) {
        let clean = if linear.is_nan() { Vec3::splat(0.5) } else { linear.clamp(Vec3::ZERO, Vec3::ONE) };
        self.bad_colors += u64::from(clean != linear);
        self.mesh.colors_linear.push(clean);
    }

    /// Appends a triangle unless two of its corners are one vertex; turned round where the placement mirrors.
    #[inline]
    pub fn push_triangle(&mut self, corners: [u32; 3], material: Option<u16>) {
        let [a, b, c] = corners;
        if a == b || b == c || c == a {
            self.report.collapsed_triangles += 1;
            return;
        }
        self.mesh.triangles.push(if self.site_from_file.mirrors() { [a, c, b] } else { corners });
        if let Some(material) = material {
            self.mesh.triangle_material.push(material);
        }
    }

    /// Gives the mesh its materials. Where none says what it reflects there is nothing to keep but names, if those are asked for.
    pub fn keep_materials(&mut self, materials: Vec<Material>, said_anything: bool) {
        let named = self.options.material_names && materials.iter().any(|material| !material.name.is_empty());
        if said_anything || named {
            self.mesh.materials = materials;
        } else {
            self.mesh.triangle_material = Vec::new();
        }
    }

    pub fn warn(&mut self, message: impl std::fmt::Display) {
        self.report.warn(self.file, message);
    }

    /// Refuses more elements than the options allow.
    pub fn check_count(&self, count: u64, what: &str) -> Result<(), ImportError> {
        let most = self.options.most_elements;
        if count <= u64::from(most) {
            return Ok(());
        }
        let problem = format!("has {count} {what}, more than the {most} that are allowed");
        Err(ImportError::new(self.file, Place::File, problem, "split it into several files or simplify it"))
    }

    /// The mesh, every promise of [`Mesh`] kept.
    pub fn finish(mut self) -> Result<Imported, ImportError> {
        self.report.file_vertices = self.file_vertices.unwrap_or(self.mesh.positions.len() as u64);
        self.drop_bad_vertices()?;
        if self.mesh.triangles.is_empty() {
            let (problem, remedy) = if self.mesh.positions.is_empty() {
                ("has no vertices", "check that the export was not empty")
            } else if self.report.collapsed_triangles > 0 {
                ("has no triangle with three different corners", "check the export")
            } else {
                ("has points but no triangles", "make a surface of the points first (for example in MeshLab or CloudCompare)")
            };
            return Err(ImportError::new(self.file, Place::File, problem, remedy));
        }
        let collapsed = self.report.collapsed_triangles;
        if collapsed > 0 {
            self.warn(format_args!("{collapsed} triangles name one vertex twice and are left out"));
        }
        if self.bad_colors > 0 {
            let count = self.bad_colors;
            self.warn(format_args!("{count} vertex colours were NaN or outside of [0, 1] and are clamped"));
        }
        self.mend_uvs();
        self.warn_of_coarse_positions();
        self.finish_normals();
        let mut mesh = self.mesh;
        mesh.positions.shrink_to_fit();
        mesh.normals.shrink_to_fit();
        mesh.uvs.shrink_to_fit();
        mesh.colors_linear.shrink_to_fit();
        mesh.triangles.shrink_to_fit();
        mesh.triangle_material.shrink_to_fit();
        debug_assert_eq!(mesh.validate(), Ok(()));
        Ok(Imported { mesh, appended: self.appended })
    }

    fn drop_bad_vertices(&mut self) -> Result<(), ImportError> {
        let mesh = &mut self.mesh;
        let Some(first_bad) = mesh.positions.iter().position(|p| p.is_nan()) else { return Ok(()) };
        let bad = mesh.positions.iter().filter(|p| p.is_nan()).count() as u64;
        self.report.bad_vertices += bad;
        let Some(&good) = mesh.positions.iter().find(|p| !p.is_nan()) else {
            let problem =
                format!("not one of its {bad} vertices is finite and within {:.0} km of the origin", FARTHEST_M / 1000.0);
            let remedy = "check the export, the unit, and the site's origin for survey coordinates";
            return Err(ImportError::new(self.file, Place::File, problem, remedy));
        };
        let keep: Vec<bool> = mesh.triangles.iter().map(|t| t.iter().all(|&i| !mesh.positions[i as usize].is_nan())).collect();
        let before = mesh.triangles.len();
        let mut kept = keep.iter();
        mesh.triangles.retain(|_| kept.next().is_some_and(|&k| k));
        let mut kept = keep.iter();
        mesh.triangle_material.retain(|_| kept.next().is_some_and(|&k| k));
        for p in mesh.positions.iter_mut().filter(|p| p.is_nan()) {
            *p = good;
        }
        let (dropped, left) = ((before - mesh.triangles.len()) as u64, mesh.triangles.len());
        self.report.dropped_triangles += dropped;
        let whole = format!(
            "{bad} vertices are NaN, infinite or farther than {:.0} km from the origin (the first is vertex {first_bad}, counted from 0)",
            FARTHEST_M / 1000.0
        );
        if left == 0 && dropped > 0 {
            let remedy = "check the export, the unit, and the site's origin for survey coordinates";
            return Err(ImportError::new(self.file, Place::File, format!("{whole}, and every triangle uses one"), remedy));
        }
        self.warn(format_args!("{whole}; the {dropped} triangles that use them are left out"));
        Ok(())
    }

    fn mend_uvs(&mut self) {
        let mut mended = 0_u64;
        for uv in self.mesh.uvs.iter_mut().filter(|uv| !uv.is_finite()) {
            *uv = Vec2::ZERO;
            mended += 1;
        }
        if mended > 0 {
            self.warn(format_args!("{mended} texture coordinates were NaN or infinite and are set to 0"));
        }
    }

    fn warn_of_coarse_positions(&mut self) {
        let Some((low, high)) = self.mesh.bounds() else { return };
        let farthest = low.abs().max(high.abs()).max_element();
        let step = farthest * f32::EPSILON;
        if step <= COARSE_POSITIONS_M {
            return;
        }
        let middle = (low.as_dvec3() + high.as_dvec3()) * 0.5 + DVec3::from(self.options.placement.origin);
        let [x, y, z] = middle.to_array().map(|v| v.round());
        self.warn(format_args!(
            "positions lie up to {:.0} m from the origin, where they can only be {:.1} mm exact; write origin = [{x:?}, {y:?}, {z:?}] in [site]",
            farthest,
            step * 1000.0
        ));
    }

    fn finish_normals(&mut self) {
        let mesh = &mut self.mesh;
        if self.options.normals == NormalSource::Computed {
            mesh.normals.clear();
        }
        if mesh.normals.is_empty() {
            match self.options.crease_deg.or(self.own_crease_deg).filter(|&degrees| degrees < 180.0) {
                Some(crease_deg) => {
                    let own = mesh.positions.len() - self.appended.len();
                    for repeated in normals::split_creases(mesh, crease_deg.to_radians()) {
                        // a repeated vertex may itself be a repeated one, which stands before it
                        let before = (repeated as usize).checked_sub(own);
                        self.appended.push(before.map_or(repeated, |k| self.appended[k]));
                    }
                }
                None => normals::compute(mesh),
            }
            return;
        }
        let mended = normals::mend(mesh);
        self.report.mended_normals += mended;
        if mended > 0 {
            self.warn(format_args!("{mended} normals had no direction and are computed from the triangles"));
        }
    }
}

/// To `f32`; NaN where it is not finite or out of reach.
#[inline]
pub(crate) fn rounded(p_site: DVec3) -> Vec3 {
    // false for NaN
    if p_site.abs().max_element() <= FARTHEST_M && !p_site.is_nan() { p_site.as_vec3() } else { Vec3::NAN }
}
