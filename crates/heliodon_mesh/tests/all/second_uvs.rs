//! Models with a second set of texture coordinates, read back from what was written.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::{Vec2, Vec3};
use heliodon_image::SrgbImage;
use heliodon_mesh::export::{LightTextures, UnwrappedPart, glb_with_second_uvs, write_glb_with_second_uvs};
use heliodon_mesh::import::{ImportOptions, read};
use heliodon_mesh::{Material, Mesh, Texture, TextureWrap};
use heliodon_testkit::gltf::{Glb, assert_valid};
use serde_json::Value;
use std::sync::Arc;

const FILES: &str = "light-1.exr light-2.exr";

fn material(name: &str, texture: Option<Arc<Texture>>) -> Material {
    Material { name: name.to_owned(), base_color_linear: Vec3::splat(0.5), texture }
}

/// A strip of so many triangles.
fn strip(triangles: u32) -> Mesh {
    let positions: Vec<Vec3> = (0..triangles + 2).map(|i| Vec3::new(i as f32, 0.0, -((i % 2) as f32))).collect();
    let triangle = |i: u32| if i.is_multiple_of(2) { [i, i + 2, i + 1] } else { [i, i + 1, i + 2] };
    let (normals, triangles) = (vec![Vec3::Y; positions.len()], (0..triangles).map(triangle).collect());
    Mesh { positions, normals, triangles, ..Mesh::default() }
}

/// A floor of two materials on two textures of light, a bench that no light map lights, a wall without coordinates of its own.
fn parts() -> Vec<UnwrappedPart> {
    let image = SrgbImage::filled(2, 2, [200, 100, 50, 255]);
    let tiles = Arc::new(Texture { source: "tiles.png".to_owned(), image, wrap: [TextureWrap::Repeat; 2] });
    let uvs_of = |mesh: &Mesh, scale: f32| mesh.positions.iter().map(|p| Vec2::new(p.x, -p.z) * scale).collect::<Vec<_>>();
    let mut floor = Mesh {
        triangle_material: vec![1, 0, 1, 1],
        materials: vec![material("grout", None), material("tile", Some(tiles.clone()))],
        ..strip(4)
    };
    floor.uvs = uvs_of(&floor, 3.0);
    let mut bench = Mesh { materials: vec![material("oak", Some(tiles))], ..strip(1) };
    bench.uvs = uvs_of(&bench, 7.0);
    let wall = strip(2);
    let lit = |name: &str, mesh: Mesh, sheet: &[u16]| {
        let second_uvs = uvs_of(&mesh, 0.125);
        UnwrappedPart { name: name.to_owned(), mesh, second_uvs, sheet: sheet.to_vec() }
    };
    let bench = UnwrappedPart { name: "bench".to_owned(), mesh: bench, ..UnwrappedPart::default() };
    vec![lit("floor", floor, &[0, 0, 1, 0]), bench, lit("wall", wall, &[1, 1])]
}

fn written(parts: &[UnwrappedPart], light: LightTextures) -> Glb {
    let mut bytes = Vec::new();
    glb_with_second_uvs(&mut bytes, parts, light).unwrap();
    Glb::new(&bytes)
}

/// The mesh of a node, and its primitives.
fn mesh(glb: &Glb, node: usize) -> (&Value, &Vec<Value>) {
    let mesh = &glb.json["meshes"][glb.json["nodes"][node]["mesh"].as_u64().unwrap() as usize];
    (mesh, mesh["primitives"].as_array().unwrap())
}

fn material_of<'a>(glb: &'a Glb, primitive: &Value) -> &'a Value {
    &glb.json["materials"][primitive["material"].as_u64().unwrap() as usize]
}

#[test]
fn parts_come_back_as_they_were() {
    let parts = parts();
    let files: Vec<String> = FILES.split(' ').map(str::to_owned).collect();
    let images = [SrgbImage::filled(2, 2, [9, 9, 9, 255]), SrgbImage::filled(2, 2, [1, 2, 3, 255])];
    for light in [LightTextures::Beside { files: &files, encoding: "linear" }, LightTextures::Multiplied(&images)] {
        let glb = written(&parts, light);
        let nodes = glb.json["nodes"].as_array().unwrap();
        assert_eq!(nodes.iter().map(|node| node["name"].as_str().unwrap()).collect::<Vec<_>>(), ["floor", "bench", "wall"]);
        assert_eq!(glb.json["scenes"][0]["nodes"], serde_json::json!([0, 1, 2]));
        for (node, part) in parts.iter().enumerate() {
            let (written, primitives) = mesh(&glb, node);
            assert_eq!(written["name"], part.name.as_str());
            let own = &part.mesh;
            for primitive in primitives {
                let attributes = &primitive["attributes"];
                let triples = |values: &[Vec3]| values.iter().map(Vec3::to_array).collect::<Vec<_>>();
                assert_eq!(glb.floats(&attributes["POSITION"]), triples(&own.positions));
                assert_eq!(glb.floats(&attributes["NORMAL"]), triples(&own.normals));
                let pairs = |values: &[Vec2]| values.iter().map(Vec2::to_array).collect::<Vec<_>>();
                let first = if own.uvs.is_empty() { &part.second_uvs } else { &own.uvs };
                assert_eq!(glb.floats(&attributes["TEXCOORD_0"]), pairs(first));
                if part.sheet.is_empty() {
                    assert!(attributes["TEXCOORD_1"].is_null());
                } else {
                    assert_eq!(glb.floats(&attributes["TEXCOORD_1"]), pairs(&part.second_uvs));
                }
            }
        }
    }
}

#[test]
fn triangles_stay_in_their_order_and_looks_where_they_are_first_seen() {
    let parts = parts();
    let files: Vec<String> = FILES.split(' ').map(str::to_owned).collect();
    let glb = written(&parts, LightTextures::Beside { files: &files, encoding: "linear" });
    let looks = |glb: &Glb, node: usize| -> Vec<(String, Value, Vec<[u32; 3]>)> {
        let of = |primitive: &Value| {
            let material = material_of(glb, primitive);
            let name = material["name"].as_str().unwrap().to_owned();
            (name, material["extras"]["lightMap"]["file"].clone(), glb.triangles(&primitive["indices"]))
        };
        mesh(glb, node).1.iter().map(of).collect()
    };
    let triangles = |node: usize, which: &[usize]| which.iter().map(|&t| parts[node].mesh.triangles[t]).collect::<Vec<_>>();
    assert_eq!(
        looks(&glb, 0),
        [
            ("tile".to_owned(), Value::from("light-1.exr"), triangles(0, &[0, 3])),
            ("grout".to_owned(), Value::from("light-1.exr"), triangles(0, &[1])),
            ("tile".to_owned(), Value::from("light-2.exr"), triangles(0, &[2])),
        ]
    );
    assert_eq!(looks(&glb, 1), [("oak".to_owned(), Value::Null, triangles(1, &[0]))], "no light map, and no word of one");
    assert_eq!(looks(&glb, 2), [("stone".to_owned(), Value::from("light-2.exr"), triangles(2, &[0, 1]))]);
    assert_eq!(glb.json["images"].as_array().unwrap().len(), 1, "parts share an image");
}

#[test]
fn multiplied_textures_have_no_smaller_versions_and_what_has_no_light_keeps_its_material() {
    let images = [SrgbImage::filled(2, 2, [9, 9, 9, 255]), SrgbImage::filled(2, 2, [1, 2, 3, 255])];
    let glb = written(&parts(), LightTextures::Multiplied(&images));
    assert_eq!(glb.json["extensionsUsed"][0], "KHR_materials_unlit");
    let filter = |material: &Value, set: u64| {
        let texture = &material["pbrMetallicRoughness"]["baseColorTexture"];
        assert_eq!(texture["texCoord"].as_u64().unwrap(), set);
        let sampler = &glb.json["textures"][texture["index"].as_u64().unwrap() as usize]["sampler"];
        glb.json["samplers"][sampler.as_u64().unwrap() as usize]["minFilter"].as_u64().unwrap()
    };
    let (_, floor) = mesh(&glb, 0);
    let floor: Vec<&Value> = floor.iter().map(|primitive| material_of(&glb, primitive)).collect();
    assert_eq!(floor.iter().map(|material| material["name"].as_str().unwrap()).collect::<Vec<_>>(), ["light 0", "light 1"]);
    for material in floor {
        assert!(material["extensions"]["KHR_materials_unlit"].is_object());
        assert_eq!(filter(material, 1), 9729, "linear: charts would mix in smaller versions");
    }
    let oak = material_of(&glb, &mesh(&glb, 1).1[0]);
    assert_eq!((oak["name"].as_str(), filter(oak, 0)), (Some("oak"), 9987));
    assert!(oak["extensions"].is_null());
    assert_eq!(glb.json["materials"].as_array().unwrap().len(), 3, "a texture of light is one material, whoever shows it");
    assert!(written(&parts()[1..2], LightTextures::Multiplied(&[])).json["extensionsUsed"].is_null());
}

#[test]
fn what_was_written_is_valid_and_is_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let (model, lit) = (folder.path().join("model.glb"), folder.path().join("lit.glb"));
    let files: Vec<String> = FILES.split(' ').map(str::to_owned).collect();
    let images = [SrgbImage::filled(2, 2, [9, 9, 9, 255]), SrgbImage::filled(2, 2, [1, 2, 3, 255])];
    let parts = parts();
    write_glb_with_second_uvs(&model, &parts, LightTextures::Beside { files: &files, encoding: "linear" }).unwrap();
    write_glb_with_second_uvs(&lit, &parts, LightTextures::Multiplied(&images)).unwrap();
    let expected: usize = parts.iter().map(|part| part.mesh.triangles.len()).sum();
    for file in [&model, &lit] {
        assert_eq!(read(file, &ImportOptions::default()).unwrap().triangles.len(), expected);
    }
    assert_valid(&[model, lit]);
    let nothing = [UnwrappedPart { name: "nothing".to_owned(), ..UnwrappedPart::default() }];
    let glb = written(&nothing, LightTextures::Multiplied(&[]));
    assert!(glb.json["nodes"][0]["name"] == "nothing" && glb.json["meshes"].is_null() && glb.json["buffers"].is_null());
}

#[test]
fn arrays_that_contradict_one_another_are_refused() {
    let image = [SrgbImage::filled(2, 2, [9, 9, 9, 255])];
    let refused = |change: fn(&mut UnwrappedPart)| {
        let mut parts = vec![parts().remove(2)];
        parts[0].sheet.fill(0);
        change(&mut parts[0]);
        let mut out = Vec::new();
        let error = glb_with_second_uvs(&mut out, &parts, LightTextures::Multiplied(&image)).unwrap_err().to_string();
        assert!(out.is_empty() && error.starts_with("wall: "), "{error}");
        error
    };
    assert!(refused(|part| part.sheet.truncate(1)).contains("1 textures for 2 triangles"));
    assert!(refused(|part| part.second_uvs.clear()).contains("0 second texture coordinates for 4 vertices"));
    assert!(refused(|part| part.sheet[1] = 1).contains("names texture 1 of 1"));
    assert!(refused(|part| part.mesh.triangles[0][0] = 9).contains("names vertex 9 of 4"));
}
