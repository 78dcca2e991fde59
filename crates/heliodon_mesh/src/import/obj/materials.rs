//! Which material each triangle of an OBJ file has, and what its libraries say of it.

use super::mtl::{self, Definition};
use crate::import::assembly::Assembly;
use crate::import::material::{Textures, UNSAID_ALBEDO, keep_colors_without, locate};
use crate::{Material, Texture, TextureWrap};
use glam::Vec3;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// A triangle's material is a `u16`.
const MOST_MATERIALS: usize = 65_535;

#[derive(Default)]
pub(super) struct Materials {
    libraries: Vec<String>,
    /// In the order in which faces first use them; an empty name stands for faces before any `usemtl`.
    used: Vec<String>,
    number: HashMap<String, u16>,
    chosen: Option<String>,
    current: Option<u16>,
    overflowed: bool,
}

impl Materials {
    pub fn add_library(&mut self, names: &[u8]) {
        self.libraries.push(String::from_utf8_lossy(names).into_owned());
    }

    pub fn choose(&mut self, name: &[u8]) {
        self.chosen = Some(String::from_utf8_lossy(name).into_owned());
        self.current = None;
    }

    /// The material of the next triangle; `None` throughout while the file has not chosen one.
    pub fn current(&mut self, triangles: usize) -> Option<u16> {
        if self.current.is_some() {
            return self.current;
        }
        let name = match &self.chosen {
            Some(name) => name.clone(),
            None if self.used.is_empty() => return None,
            None => String::new(),
        };
        if self.used.is_empty() && triangles > 0 {
            // Triangles came before the first material: they keep a nameless one, filled in by `finish`.
            self.insert(String::new());
        }
        self.current = Some(self.insert(name));
        self.current
    }

    fn insert(&mut self, name: String) -> u16 {
        if let Some(&number) = self.number.get(&name) {
            return number;
        }
        if self.used.len() == MOST_MATERIALS {
            self.overflowed = true;
            return 0;
        }
        let number = self.used.len() as u16;
        self.used.push(name.clone());
        self.number.insert(name, number);
        number
    }

    /// Reads the libraries and gives the mesh its materials. What cannot be read is a warning.
    pub fn finish(self, folder: Option<&Path>, assembly: &mut Assembly) {
        if self.used.is_empty() {
            return;
        }
        if self.overflowed {
            assembly.warn(format_args!("has more than {MOST_MATERIALS} materials; those beyond take the first one's look"));
        }
        // Triangles before the first `usemtl` were pushed without a material: they are the first ones.
        let missing = assembly.mesh.triangles.len() - assembly.mesh.triangle_material.len();
        if missing > 0 {
            let mut all = vec![0; missing];
            all.append(&mut assembly.mesh.triangle_material);
            assembly.mesh.triangle_material = all;
        }
        let defined = self.read_libraries(folder, assembly);
        let mut textures = Textures::default();
        let mut texture = |name: &String| {
            let Definition { map, folder: library, .. } = defined.get(name.as_str())?;
            let map = map.as_ref()?;
            let wrap = if map.clamp { TextureWrap::Clamp } else { TextureWrap::Repeat };
            let folders: Vec<&Path> = [Some(library.as_path()), folder].into_iter().flatten().collect();
            textures.load(&folders, &map.file, [wrap; 2], assembly)
        };
        let textures: Vec<Option<Arc<Texture>>> = self.used.iter().map(&mut texture).collect();
        let has_colors = keep_colors_without(textures.iter().any(Option::is_some), assembly);
        let mut unknown = Vec::new();
        let mut said_anything = false;
        let mut materials = Vec::with_capacity(self.used.len());
        for (name, texture) in self.used.iter().zip(textures) {
            let definition = defined.get(name.as_str());
            if definition.is_none() && !name.is_empty() {
                unknown.push(format!("\"{name}\""));
            }
            let diffuse = definition.and_then(|d| d.diffuse_linear);
            said_anything |= diffuse.is_some() || texture.is_some();
            let base_color_linear = match (diffuse, texture.is_some()) {
                // Exporters write a black Kd beside a map; black stone with a texture is no one's wish.
                (Some(kd), true) if kd == Vec3::ZERO => Vec3::ONE,
                (Some(kd), _) => kd,
                (None, true) => Vec3::ONE,
                (None, false) => Vec3::splat(if has_colors { 1.0 } else { UNSAID_ALBEDO }),
            };
            materials.push(Material { name: name.clone(), base_color_linear, texture });
        }
        if !unknown.is_empty() && !self.libraries.is_empty() {
            unknown.truncate(8);
            assembly.warn(format_args!("its material libraries do not define {}", unknown.join(", ")));
        }
        assembly.keep_materials(materials, said_anything);
    }

    fn read_libraries(&self, folder: Option<&Path>, assembly: &mut Assembly) -> HashMap<String, Definition> {
        let mut defined = HashMap::new();
        for names in &self.libraries {
            // One name with spaces in it, or several names.
            let whole = folder.and_then(|folder| locate(folder, names)).map(|path| vec![path]);
            let paths = whole.or_else(|| {
                let found = names.split_ascii_whitespace().filter_map(|name| folder.and_then(|folder| locate(folder, name)));
                Some(found.collect::<Vec<_>>()).filter(|paths| !paths.is_empty())
            });
            let Some(paths) = paths else {
                assembly
                    .warn(format_args!("its material library \"{names}\" is not there; its surfaces take the constant colour"));
                continue;
            };
            for path in paths {
                match mtl::read(&path, assembly.report) {
                    Ok(definitions) => {
                        for (name, definition) in definitions {
                            defined.entry(name).or_insert(definition);
                        }
                    }
                    Err(error) => assembly.warn(format_args!("its materials cannot be read: {error}")),
                }
            }
        }
        defined
    }
}
