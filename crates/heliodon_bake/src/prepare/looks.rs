//! Coloured meshes that one can look at: what was found in each part, and what of it is drawn.

use crate::error::BakeError;
use glam::Vec3;
use heliodon_bundle::site::Site;
use heliodon_mesh::Mesh;
use heliodon_mesh::export::write_ply;
use heliodon_prepare::clean::{CleanReport, paint};
use heliodon_prepare::solids::{self, SolidsReport};
use std::path::{Path, PathBuf};

/// Stone that is drawn, and stone that nobody sees.
const SEEN: Vec3 = Vec3::new(0.6, 0.6, 0.55);
const UNSEEN: Vec3 = Vec3::new(0.5, 0.04, 0.03);

/// Characters of a part's name in a file's: in any script it fits into the 255 bytes that file systems allow.
const LONGEST_NAME: usize = 48;

/// Where coloured meshes are written, if at all.
pub(super) struct Looks {
    folder: Option<PathBuf>,
    names: Vec<String>,
}

impl Looks {
    pub fn new(site: &Site, folder: Option<&Path>) -> Self {
        let file_name = |(index, name): (usize, String)| {
            let plain = |c: char| if c.is_alphanumeric() || "-_".contains(c) { c } else { '_' };
            format!("{:02}-{}", index + 1, name.chars().take(LONGEST_NAME).map(plain).collect::<String>())
        };
        let names = site.parts.iter().map(heliodon_bundle::site::Part::display_name).enumerate().map(file_name);
        Self { folder: folder.map(Path::to_owned), names: names.collect() }
    }

    /// Whether anybody wants them.
    pub fn wanted(&self) -> bool {
        self.folder.is_some()
    }

    fn path(&self, part: usize, what: &str) -> Option<PathBuf> {
        Some(self.folder.as_ref()?.join(format!("{}-{what}.ply", self.names[part])))
    }

    /// A part as it was read, each triangle in the colour of what was found of it.
    pub fn found(&self, part: usize, as_read: &Mesh, report: &CleanReport) -> Result<(), BakeError> {
        let Some(path) = self.path(part, "found") else { return Ok(()) };
        Ok(write_ply(&path, &paint(as_read, &report.marks), None)?)
    }

    /// A part before its solids were united, each triangle in the colour of its fate.
    pub fn united(&self, part: usize, before: &Mesh, report: &SolidsReport) -> Result<(), BakeError> {
        let Some(path) = self.path(part, "solids") else { return Ok(()) };
        Ok(write_ply(&path, &solids::paint(before, &report.fates), None)?)
    }

    /// A part as it was simplified: what is drawn light, what nobody sees red.
    pub fn kept(&self, part: usize, mesh: &Mesh, keep: &[bool]) -> Result<(), BakeError> {
        let Some(path) = self.path(part, "drawn") else { return Ok(()) };
        let which = |kept: bool| -> Vec<u32> { (0..keep.len() as u32).filter(|&t| keep[t as usize] == kept).collect() };
        let mut painted = Mesh::default();
        for (kept, color) in [(true, SEEN), (false, UNSEEN)] {
            let (some, _) = mesh.with_triangles(&which(kept));
            let colors_linear = vec![color; some.positions.len()];
            let some = Mesh { positions: some.positions, triangles: some.triangles, colors_linear, ..Mesh::default() };
            painted.append(&some)?;
        }
        Ok(write_ply(&path, &painted, None)?)
    }
}
