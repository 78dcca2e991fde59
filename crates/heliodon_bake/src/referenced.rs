//! The files that mesh files name: materials, textures, buffers; and those of a `views.json`.
//!
//! Only to notice that one of them has changed since the last bake; what they mean is the importers' business. Names are looked up as the
//! importers do ([`locate`]); where a line may be read in several ways, each file that it may mean is taken. A file that is
//! not there is left out, for the importers tell of it.

use heliodon_image::view_layers::layer_files;
use heliodon_mesh::import::{locate, percent_decoded};
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// The longest line of an OBJ or MTL file that can name a file.
const MAX_LINE_BYTES: u64 = 64 << 10;
/// The largest glTF JSON that is looked into.
const MAX_JSON_BYTES: u64 = 1 << 30;

/// The files that a mesh file, or a `views.json`, names, those that these name included, each once, in the order of their names.
#[must_use]
pub fn referenced_files(mesh: &Path) -> Vec<PathBuf> {
    let folder = mesh.parent().unwrap_or(Path::new(""));
    let ending = mesh.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let mut files: Vec<PathBuf> = match ending.as_str() {
        "obj" => {
            let libraries = named_in_lines(mesh, &["mtllib"], None);
            let libraries = libraries.iter().flat_map(|names| std::iter::once(names.as_str()).chain(names.split_whitespace()));
            libraries.filter_map(|name| locate(folder, name)).flat_map(|library| with_maps(library, folder)).collect()
        }
        "ply" => {
            let names = named_in_lines(mesh, &["comment TextureFile"], Some("end_header"));
            names.iter().filter_map(|name| locate(folder, name)).collect()
        }
        "gltf" | "glb" => {
            let found = |uri: String| locate(folder, &percent_decoded(&uri)).or_else(|| locate(folder, &uri));
            gltf_uris(mesh).into_iter().filter_map(found).collect()
        }
        "json" => named_views(mesh).iter().filter_map(|name| locate(folder, name)).collect(),
        _ => Vec::new(),
    };
    files.sort();
    files.dedup();
    files
}

/// The images of a `views.json`.
fn named_views(file: &Path) -> Vec<String> {
    let layers = fs::read(file).ok().and_then(|bytes| layer_files(&bytes, "").ok()).unwrap_or_default();
    layers.into_iter().flat_map(|layer| [layer.colors, layer.directions]).collect()
}

/// A material library and the images that it names, beside it or in the mesh's folder.
fn with_maps(library: PathBuf, mesh_folder: &Path) -> Vec<PathBuf> {
    let folder = library.parent().unwrap_or(Path::new("")).to_owned();
    let maps = named_in_lines(&library, &["map_Kd", "map_kd"], None);
    // options come first, and the name, which may hold blanks, last
    let names = maps.iter().flat_map(|rest| {
        let starts = rest.char_indices().filter(|&(i, _)| i == 0 || rest[..i].ends_with(char::is_whitespace));
        starts.map(|(i, _)| &rest[i..])
    });
    let found: Vec<PathBuf> =
        names.flat_map(|name| [folder.as_path(), mesh_folder].map(|folder| locate(folder, name))).flatten().collect();
    std::iter::once(library).chain(found).collect()
}

/// What follows one of `words` at the beginning of a line, up to the line `end`.
fn named_in_lines(path: &Path, words: &[&str], end: Option<&str>) -> Vec<String> {
    let Ok(file) = File::open(path) else { return Vec::new() };
    let mut reader = BufReader::with_capacity(1 << 20, file);
    let (mut names, mut line) = (Vec::new(), Vec::new());
    loop {
        line.clear();
        match reader.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut line) {
            Ok(0) | Err(_) => return names,
            Ok(_) => {}
        }
        // most lines are numbers
        if line.first().is_some_and(|first| b"0123456789vf".contains(first)) {
            continue;
        }
        let text = String::from_utf8_lossy(&line);
        let text = text.trim_start_matches('\u{feff}').trim();
        if end == Some(text) {
            return names;
        }
        let named = words.iter().find_map(|word| text.strip_prefix(word)).filter(|rest| rest.starts_with([' ', '\t']));
        names.extend(named.map(|rest| rest.trim().to_owned()));
    }
}

/// The URIs of buffers and images in a glTF file that are files.
fn gltf_uris(path: &Path) -> Vec<String> {
    let Some(json) = gltf_json(path) else { return Vec::new() };
    let Ok(root) = serde_json::from_slice::<serde_json::Value>(&json) else { return Vec::new() };
    let objects = ["buffers", "images"].into_iter().filter_map(|key| root.get(key)?.as_array()).flatten();
    objects
        .filter_map(|object| object.get("uri")?.as_str())
        .filter(|uri| !uri.starts_with("data:"))
        .map(str::to_owned)
        .collect()
}

fn gltf_json(path: &Path) -> Option<Vec<u8>> {
    let length = fs::metadata(path).ok()?.len();
    let mut file = File::open(path).ok()?;
    let mut head = [0; 20];
    let binary = file.read_exact(&mut head).is_ok() && head.starts_with(b"glTF");
    if !binary {
        return (length <= MAX_JSON_BYTES).then(|| fs::read(path).ok())?;
    }
    let json_bytes = u64::from(u32::from_le_bytes(head[12..16].try_into().ok()?));
    let mut json = Vec::new();
    file.take(json_bytes.min(MAX_JSON_BYTES)).read_to_end(&mut json).ok()?;
    Some(json)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path, mesh: &str) -> Vec<String> {
        let files = referenced_files(&folder.join(mesh));
        files.iter().map(|file| file.strip_prefix(folder).unwrap().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn materials_textures_and_buffers_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, content: &[u8]| fs::write(folder.path().join(name), content).unwrap();
        for name in ["stone.png", "a b.jpg", "data.bin", "skin.jpg", "wood.png"] {
            write(name, b"");
        }
        write("scan.obj", b"v 0 0 0\nmtllib scan.mtl\r\nmtllib missing.mtl\nf 1 1 1\n");
        write("scan.mtl", b"newmtl a\nmap_Kd -s 1 1 1 stone.png\nmap_Kd a b.jpg\nmap_Ks gloss.png\n");
        assert_eq!(names(folder.path(), "scan.obj"), ["a b.jpg", "scan.mtl", "stone.png"]);
        fs::create_dir(folder.path().join("maps")).unwrap();
        write("maps/inner.png", b"");
        write("maps/sub.mtl", b"newmtl a\nmap_Kd inner.png\nmap_Kd -s 1 1 1 C:\\disk\\A B.JPG\n");
        write("far.obj", "\u{feff}mtllib maps/sub.mtl\n".as_bytes());
        assert_eq!(names(folder.path(), "far.obj"), ["a b.jpg", "maps/inner.png", "maps/sub.mtl"]);
        write("scan.ply", b"ply\ncomment TextureFile skin.jpg\nend_header\ncomment TextureFile stone.png\n");
        assert_eq!(names(folder.path(), "scan.ply"), ["skin.jpg"]);
        let json = br#"{"buffers":[{"uri":"data.bin"},{"uri":"data:x"}],"images":[{"uri":"wood.png"},{"bufferView":1}]}"#;
        write("scan.gltf", json);
        assert_eq!(names(folder.path(), "scan.gltf"), ["data.bin", "wood.png"]);
        let mut binary = [&b"glTF\x02\0\0\0\0\0\0\0"[..], &(json.len() as u32).to_le_bytes(), b"JSON", json].concat();
        binary.extend([0; 9]);
        write("scan.glb", &binary);
        assert_eq!(names(folder.path(), "scan.glb"), ["data.bin", "wood.png"]);
        write("stein (ä).bin", b"");
        write("escaped.gltf", r#"{"buffers":[{"uri":"stein%20(%C3%A4).bin"},{"uri":"Elsewhere/DATA.BIN"}]}"#.as_bytes());
        assert_eq!(names(folder.path(), "escaped.gltf"), ["data.bin", "stein (ä).bin"]);
        write("scan.stl", b"solid");
        assert!(names(folder.path(), "scan.stl").is_empty() && names(folder.path(), "nothing.obj").is_empty());
        write("noise.gltf", &[0xFF; 64]);
        assert!(names(folder.path(), "noise.gltf").is_empty());
    }
}
