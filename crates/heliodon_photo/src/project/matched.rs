//! What automatic matching needs of a project, and what it leaves there.

use super::{CameraFormat, LensEntry, LoadError, Loaded, Project};
use crate::matching::COLMAP_FOLDER;
use std::collections::BTreeMap;

impl Project {
    /// The project without the cameras of an earlier matching. Photographs of one size that tell nothing of their lens are taken to share one:
    /// sixteen unknown lenses are not found by matches, one is. The notes say so.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn load_for_matching(&self) -> Result<Loaded, LoadError> {
        let mut project = self.clone();
        project.forget_matched();
        let facts = project.facts();
        let mut alike: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
        for (index, (photo, facts)) in project.file.photo.iter().zip(&facts).enumerate() {
            let size = photo.size_px.or(facts.size_px);
            if let Some(size) = size.filter(|_| photo.lens.is_none() && facts.lens_key().is_none()) {
                alike.entry(size).or_default().push(index);
            }
        }
        let mut notes = Vec::new();
        // Cameras taken over bring their lenses.
        alike.retain(|_, photos| photos.len() > 1 && project.file.cameras.is_empty());
        for ([width, height], photos) in alike {
            let name = format!("one lens of {width} x {height} pixels");
            notes.push(format!(
                "{} photographs of {width} x {height} pixels tell nothing of their lens and are taken to share one: where that is wrong, give \
                 them [[lens]] of their own",
                photos.len()
            ));
            photos.iter().for_each(|photo| project.file.photo[*photo].lens = Some(name.clone()));
            project.file.lens.push(LensEntry { name, ..LensEntry::default() });
        }
        let imported = project.imported()?;
        let problem = project.problem(&facts, &imported)?;
        notes.extend(imported.iter().flat_map(|i| i.notes.clone()));
        Ok(Loaded { problem, imported, notes })
    }

    /// Takes the cameras of a matching over, in place of those of an earlier one.
    pub fn take_over_matched(&mut self, model: &str) {
        self.forget_matched();
        self.take_over(model, CameraFormat::Colmap);
    }

    fn forget_matched(&mut self) {
        self.file.cameras.retain(|cameras| {
            let ours = cameras.file.strip_prefix(COLMAP_FOLDER).is_some_and(|rest| rest.starts_with('/'));
            !(ours && cameras.format == CameraFormat::Colmap)
        });
    }
}
