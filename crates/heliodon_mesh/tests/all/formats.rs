//! What each format means, checked on small files written here.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::{Vec2, Vec3};
use heliodon_mesh::export;
use heliodon_mesh::import::{Format, ImportOptions, ImportReport, NormalSource, from_bytes, read_reporting};
use heliodon_mesh::place::{Placement, Unit, Up};
use heliodon_mesh::{Mesh, TextureWrap};
use heliodon_testkit::hostile::files::{self, glb};
use std::path::Path;

fn read(format: Format, bytes: &[u8]) -> Mesh {
    read_with(format, bytes, &ImportOptions::default()).0
}

fn read_with(format: Format, bytes: &[u8], options: &ImportOptions) -> (Mesh, ImportReport) {
    let mut report = ImportReport::default();
    let mesh = from_bytes(bytes, format, Path::new("test"), options, &mut report).unwrap();
    mesh.validate().unwrap();
    (mesh, report)
}

fn good(name: &str) -> Mesh {
    let file = files::good().into_iter().find(|f| f.name == format!("good: {name}")).unwrap();
    read(Format::of_name(Path::new(&format!("x.{}", file.ending))).unwrap(), &file.bytes)
}

#[test]
fn byte_orders_and_text_read_alike() {
    let expected = [Vec3::ZERO, Vec3::X, Vec3::Y];
    for name in ["PLY as text", "PLY, little-endian", "PLY, big-endian", "glTF", "GLB", "STL as text"] {
        let mesh = good(name);
        assert_eq!((mesh.positions.as_slice(), mesh.triangles.as_slice()), (&expected[..], &[[0, 1, 2]][..]), "{name}");
        assert_eq!(mesh.normals, [Vec3::Z; 3], "{name}");
    }
}

#[test]
fn strips_turn_every_other_triangle_and_begin_anew_after_minus_one() {
    let mesh = good("PLY of strips");
    assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 3], [4, 2, 5]]);
}

#[test]
fn every_width_of_list_and_index_is_read() {
    for (count, count_bytes) in [("uchar", 1), ("ushort", 2), ("int", 4), ("uint64", 8)] {
        for (item, item_bytes) in
            [("char", 1), ("uint8", 1), ("short", 2), ("uint16", 2), ("int32", 4), ("uint", 4), ("int64", 8)]
        {
            let mut bytes = format!(
                "ply\nformat binary_little_endian 1.0\nelement junk 2\nproperty list {count} double odd\nproperty char c\nelement vertex 3\n\
                 property short x\nproperty uchar extra\nproperty double y\nproperty float z\nelement face 1\nproperty float quality\n\
                 property list {count} {item} vertex_index\nend_header\n"
            )
            .into_bytes();
            let number = |n: u64, width: usize| n.to_le_bytes()[..width].to_vec();
            for length in [0, 2] {
                bytes.extend(number(length, count_bytes));
                bytes.extend(vec![1; 8 * length as usize + 1]);
            }
            for [x, y, z] in [[0.0, 0.0, 0.0], [-7.0, 0.5, 0.0], [0.0, 0.0, 9.25]] {
                bytes.extend((x as i16).to_le_bytes());
                bytes.push(77);
                bytes.extend(f64::to_le_bytes(y));
                bytes.extend((z as f32).to_le_bytes());
            }
            bytes.extend([0; 4]);
            bytes.extend(number(3, count_bytes));
            [2, 0, 1].iter().for_each(|&i| bytes.extend(number(i, item_bytes)));
            let mesh = read(Format::Ply, &bytes);
            assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::new(-7.0, 0.5, 0.0), Vec3::Z * 9.25], "{count} {item}");
            assert_eq!(mesh.triangles, [[2, 0, 1]]);
        }
    }
}

#[test]
fn meshlab_s_corner_coordinates_split_only_seams() {
    let text = "ply\nformat ascii 1.0\ncomment TextureFile a.png\ncomment TextureFile b.png\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n\
        property int texnumber\nend_header\n0 0 0 255 0 0\n1 0 0 0 0 0\n1 1 0 0 0 0\n0 1 0 0 0 255\n3 0 1 2 6 0 0 1 0 1 1 0\n3 0 2 3 6 0 0 .5 .5 0 1 1\n";
    let (mesh, report) = read_with(Format::Ply, text.as_bytes(), &ImportOptions::default());
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 4, 3]]);
    assert_eq!(mesh.uvs, [[0., 1.], [1., 1.], [1., 0.], [0., 0.], [0.5, 0.5]].map(Vec2::from));
    assert_eq!(mesh.positions[4], mesh.positions[2]);
    assert_eq!(mesh.triangle_material, [0, 1]);
    assert_eq!(mesh.colors_linear[0], Vec3::X);
    assert!(report.warnings.iter().any(|w| w.contains("a.png")), "{report:?}");
}

#[test]
fn colours_in_files_are_srgb() {
    let ply = |kind: &str, full: &str, half: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty {kind} diffuse_red\nproperty {kind} diffuse_green\n\
             property {kind} diffuse_blue\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 {full} {half} 0\n1 0 0 0 0 0\n0 1 0 0 0 0\n3 0 1 2\n"
        )
    };
    for (kind, full, half) in
        [("uchar", "255", "188"), ("ushort", "65535", "48316"), ("float", "1", "0.73725"), ("float", "255", "188")]
    {
        let color = read(Format::Ply, ply(kind, full, half).as_bytes()).colors_linear[0];
        assert!(color.distance(Vec3::new(1.0, 0.5029, 0.0)) < 1e-3, "{kind}: {color}");
    }
    let obj = read(Format::Obj, b"v 0 0 0 1 .73725 0\nv 1 0 0 0 0 0\nv 0 1 0 0 0 0\nf 1 2 3");
    assert!(obj.colors_linear[0].distance(Vec3::new(1.0, 0.5029, 0.0)) < 1e-3);
}

#[test]
fn an_obj_without_seams_keeps_its_own_vertices() {
    let mesh = read(Format::Obj, b"v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 8 8 8\nf 2 3 4\n");
    assert_eq!(mesh.positions.len(), 5);
    assert_eq!(mesh.triangles, [[1, 2, 3]]);
    assert_eq!((mesh.normals[2], mesh.normals[0]), (Vec3::Z, Vec3::Y));
}

#[test]
fn obj_corners_become_vertices_behind_the_file_s_own() {
    let mesh = good("OBJ with everything");
    // the second face says something else of two positions, and the same of the third
    assert_eq!(mesh.positions.len(), 6);
    assert_eq!(mesh.triangles[2], [0, 4, 5]);
    assert_eq!(mesh.triangles[..2], [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.normals[3], Vec3::Y);
    assert_eq!(mesh.uvs[0], Vec2::new(0.0, 1.0));
}

#[test]
fn materials_give_colours_and_textures() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    heliodon_image::SrgbImage::filled(2, 2, [188, 188, 188, 255]).write_png(at("Wall 1.PNG")).unwrap();
    std::fs::write(at("my lib.mtl"), "newmtl wall\r\nKd 1 1 1\r\nmap_Kd -clamp on C:\\Users\\x\\wall 1.png\r\nnewmtl red paint\nKd 1 0 0\nd 0.5\nnewmtl none\n").unwrap();
    std::fs::write(
        at("a.obj"),
        "mtllib my lib.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nf 1 2 3\nusemtl wall\nf 1/1 2/2 3/3\nusemtl red paint\nf 3 2 1\nusemtl none\nf 1 2 3\n",
    )
    .unwrap();
    let mut report = ImportReport::default();
    let mesh = read_reporting(&at("a.obj"), &ImportOptions::default(), &mut report).unwrap();
    mesh.validate().unwrap();
    assert_eq!(mesh.triangle_material, [0, 1, 2, 3]);
    let look: Vec<(&str, Vec3)> = mesh.materials.iter().map(|m| (m.name.as_str(), m.base_color_linear)).collect();
    assert_eq!(look, [("", Vec3::splat(0.5)), ("wall", Vec3::ONE), ("red paint", Vec3::X), ("none", Vec3::splat(0.5))]);
    let texture = mesh.materials[1].texture.as_ref().unwrap();
    assert_eq!((texture.image.width, texture.wrap), (2, [TextureWrap::Clamp; 2]));
    assert_eq!(report.warnings.len(), 1, "{report:?}");
    assert!(report.warnings[0].contains("transparent"));
}

/// Writes a file below a folder.
fn put(folder: &Path, name: &str, content: &str) {
    let path = folder.join(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, content).unwrap();
}

/// Writes an image of one colour below a folder.
fn put_image(folder: &Path, name: &str, srgb: u8) {
    let path = folder.join(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    heliodon_image::SrgbImage::filled(1, 1, [srgb, srgb, srgb, 255]).write_png(path).unwrap();
}

#[test]
fn maps_lie_beside_the_library_that_names_them() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let faces = "usemtl one\nf 1/1 2/1 3/1\nusemtl two\nf 1/1 2/1 3/1\nusemtl three\nf 1/1 2/1 3/1\n";
    put(at, "a.obj", &format!("mtllib a/lib.mtl\nmtllib b/lib.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\n{faces}"));
    // the same name in two folders, and one beside the mesh only
    put(at, "a/lib.mtl", "newmtl one\nmap_Kd wall.png\nnewmtl three\nmap_Kd floor.png\n");
    put(at, "b/lib.mtl", "newmtl two\nmap_Kd wall.png\n");
    put_image(at, "a/wall.png", 10);
    put_image(at, "b/wall.png", 20);
    put_image(at, "wall.png", 30);
    put_image(at, "floor.png", 40);
    let mut report = ImportReport::default();
    let mesh = read_reporting(&at.join("a.obj"), &ImportOptions::default(), &mut report).unwrap();
    let shown: Vec<u8> = mesh.materials.iter().map(|m| m.texture.as_ref().unwrap().image.pixel(0, 0)[0]).collect();
    assert_eq!((shown.as_slice(), report.warnings.len()), (&[10, 20, 40][..], 0), "{report:?}");
}

#[test]
fn a_texture_is_not_darkened_by_the_colours_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    put(at, "a.mtl", "newmtl stone\nmap_Kd stone.png\nnewmtl bare\n");
    let coloured = "mtllib a.mtl\nv 0 0 0 0.5 0.5 0.5\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0 0.5 0.5 0.5\n";
    put(at, "a.obj", &format!("{coloured}vt 0 0\nusemtl stone\nf 1/1 2/1 3/1\nusemtl bare\nf 1 2 3\n"));
    let read = || {
        let mut report = ImportReport::default();
        let mesh = read_reporting(&at.join("a.obj"), &ImportOptions::default(), &mut report).unwrap();
        mesh.validate().unwrap();
        let albedo = heliodon_mesh::albedo::MeshAlbedo::new(&mesh, 0.0);
        let looks: Vec<f32> = (0..mesh.triangles.len() as u32).map(|t| (albedo.mean(t).x * 1000.0).round()).collect();
        (looks, report.warnings)
    };
    // without the image the colours say all
    let (looks, warnings) = read();
    assert_eq!(looks, [214.0; 2]);
    assert!(warnings.len() == 1 && warnings[0].contains("stone.png"), "{warnings:?}");
    put_image(at, "stone.png", 188);
    let (looks, warnings) = read();
    assert_eq!(looks, [503.0, 500.0], "the texture alone, and what is said of nothing");
    assert!(warnings.len() == 1 && warnings[0].contains("the texture is used"), "{warnings:?}");
    // without texture coordinates the image cannot be laid on, and the colours stay
    put(at, "a.obj", &format!("{coloured}usemtl stone\nf 1 2 3\n"));
    assert_eq!(read().0, [214.0]);
}

#[test]
fn texts_may_begin_with_a_byte_order_mark() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    put(at, "a.obj", "\u{feff}mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n");
    put(at, "a.mtl", "\u{feff}newmtl red\nKd 1 0 0\n");
    let mesh = read_reporting(&at.join("a.obj"), &ImportOptions::default(), &mut ImportReport::default()).unwrap();
    assert_eq!(mesh.materials[0].base_color_linear, Vec3::X);
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nf 1 2 3\n";
    assert_eq!(
        read(Format::Obj, format!("\u{feff}{vertices}").as_bytes()).positions,
        read(Format::Obj, vertices.as_bytes()).positions
    );
    for file in files::good().into_iter().filter(|file| matches!(file.ending, "ply" | "stl" | "gltf")) {
        let format = Format::of_name(Path::new(&format!("x.{}", file.ending))).unwrap();
        // of binary files, STL has a count at a fixed place and no mark
        if std::str::from_utf8(&file.bytes).is_ok() {
            let marked = [b"\xef\xbb\xbf", file.bytes.as_slice()].concat();
            assert_eq!(read(format, &marked).positions, read(format, &file.bytes).positions, "{}", file.name);
            let path = at.join("marked.unknown");
            std::fs::write(&path, &marked).unwrap();
            let told = read_reporting(&path, &ImportOptions::default(), &mut ImportReport::default());
            assert_eq!(told.is_ok(), file.ending == "ply", "only PLY shows what it is");
        }
    }
}

/// A cube of 12 facets as text.
fn cube_stl() -> String {
    let at = |i: usize| [i & 1, i >> 1 & 1, i >> 2].map(|c| c.to_string()).join(" ");
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let facets = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    facets.fold("solid cube\n".to_owned(), |text, facet| {
        let corners: String = facet.iter().map(|&i| format!("vertex {}\n", at(i))).collect();
        text + "facet normal 0 0 0\nouter loop\n" + &corners + "endloop\nendfacet\n"
    }) + "endsolid\n"
}

#[test]
fn stl_has_hard_edges_where_its_facets_meet_sharply() {
    let with =
        |crease_deg| read_with(Format::Stl, cube_stl().as_bytes(), &ImportOptions { crease_deg, ..ImportOptions::default() }).0;
    let cube = with(None);
    assert_eq!((cube.positions.len(), cube.triangles.len()), (24, 12));
    assert!(cube.normals.iter().all(|n| n.abs().max_element() > 0.999));
    assert_eq!(
        (with(Some(180.0)).positions.len(), with(Some(95.0)).positions.len(), with(Some(80.0)).positions.len()),
        (8, 8, 24)
    );
    // the file's own vertices come first, in their order
    assert_eq!(cube.positions[..8], with(Some(180.0)).positions[..]);
    // other formats say themselves where their vertices part
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    assert_eq!(read(Format::Obj, obj.as_bytes()).positions.len(), 4);
}

/// A scene that shows a mesh of one triangle, of `primitives` primitives, at `nodes` nodes.
fn instances(nodes: usize, primitives: usize) -> Vec<u8> {
    let list: Vec<String> = (0..nodes).map(|i| i.to_string()).collect();
    let primitive = r#"{"attributes":{"POSITION":0},"indices":1}"#;
    // 1,000 triangles of 6 bytes behind three positions of 12
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[{}]}}],"nodes":[{}],"meshes":[{{"primitives":[{}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},{{"bufferView":1,"componentType":5123,"count":3000,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":6000}}],
        "buffers":[{{"byteLength":6036,"uri":"data:application/octet-stream;base64,{}"}}]}}"#,
        list.join(","),
        vec![r#"{"mesh":0}"#; nodes].join(","),
        vec![primitive; primitives].join(","),
        // positions 0, x, y, then indices 0 1 2 again and again
        [&"A".repeat(16), "AACAPwAAAAAAAAAA", "AAAAAAAAgD8AAAAA", &"AAABAAIA".repeat(1000)].concat()
    )
    .into_bytes()
}

#[test]
fn instances_are_counted_before_they_are_made() {
    let few = read(Format::Gltf, &instances(3, 2));
    // primitives of one mesh share their vertices, nodes do not
    assert_eq!((few.triangles.len(), few.positions.len()), (6000, 9));
    let read = |nodes, primitives| {
        let options = ImportOptions::default();
        from_bytes(&instances(nodes, primitives), Format::Gltf, Path::new("test"), &options, &mut ImportReport::default())
    };
    let message = read(11_000, 1).unwrap_err().to_string();
    assert!(message.contains("makes 11000000 triangles of 6036 bytes") && message.contains("at most 10024144"), "{message}");
    let message = read(1, 11_000).unwrap_err().to_string();
    assert!(message.contains("makes 11000000 triangles of 6036 bytes"), "{message}");
    let message = read(400, 400).unwrap_err().to_string();
    assert!(message.contains("has 160000000 triangles, more than the 150000000 that are allowed"), "{message}");
}

#[test]
fn missing_material_files_are_warnings() {
    let text = b"mtllib gone.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3";
    let (mesh, report) = read_with(Format::Obj, text, &ImportOptions::default());
    assert!(mesh.materials.is_empty() && mesh.triangle_material.is_empty());
    assert!(report.warnings[0].contains("gone.mtl"), "{report:?}");
}

#[test]
fn stl_corners_at_one_place_are_one_vertex() {
    let facet = |a: &str, b: &str, c: &str| {
        format!("facet normal 0 0 0\nouter loop\nvertex {a}\nvertex {b}\nvertex {c}\nendloop\nendfacet\n")
    };
    let text = format!("solid\n{}{}endsolid", facet("0 0 0", "1 0 0", "0 1 0"), facet("0 1 0", "1 0 0", "1 1 -0"));
    let mesh = read(Format::Stl, text.as_bytes());
    assert_eq!((mesh.positions.len(), mesh.triangles.as_slice()), (4, &[[0, 1, 2], [2, 1, 3]][..]));
}

#[test]
fn gltf_nodes_place_mirror_and_repeat() {
    let file = files::good().into_iter().find(|f| f.name == "good: glTF").unwrap();
    let text = String::from_utf8(file.bytes).unwrap().replace("\"nodes\":[0]", "\"nodes\":[0,1]").replace(
        "{\"mesh\":0}",
        "{\"children\":[2],\"translation\":[500000.25,0,0]},{\"mesh\":0,\"matrix\":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 500000,0,0,1]},{\"mesh\":0,\"rotation\":[0,0.7071067811865476,0,0.7071067811865476]}",
    );
    let options = ImportOptions {
        placement: Placement { origin: [500_000.0, 0.0, 0.0], ..Placement::default() },
        ..ImportOptions::default()
    };
    let (mesh, _) = read_with(Format::Gltf, text.as_bytes(), &options);
    // the first copy turned by 90 degrees about Y: x becomes -z; its quarter metre survives half a million
    assert!(mesh.positions[1].distance(Vec3::new(0.25, 0.0, -1.0)) < 1e-6, "{}", mesh.positions[1]);
    assert!(mesh.positions[4].distance(Vec3::NEG_X) < 1e-6);
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 5, 4]]);
    assert!(mesh.normals[3].distance(Vec3::Z) < 1e-6);
}

#[test]
fn gltf_sparse_strips_and_mirrors() {
    let mesh = good("glTF, sparse, turned and mirrored");
    // the sparse element 1 repeats (1, 0, 0); turned by 180 degrees about Z after y is mirrored
    assert!(mesh.positions[1].distance(Vec3::new(0.0, 2.0, 3.0)) < 1e-6);
    assert!(mesh.positions[2].distance(Vec3::new(1.0, 3.0, 3.0)) < 1e-6);
    assert_eq!(mesh.triangles, [[0, 2, 1]]);
    assert_eq!(mesh.materials[0].base_color_linear, Vec3::splat(0.5));
}

#[test]
fn gltf_quantised_attributes_and_texture_transforms() {
    let mut bin: Vec<u8> = Vec::new();
    // positions i16 normalised in rows of 8, normals i8 normalised in rows of 4, colours u8 normalised, coordinates u16
    for p in [[0_i16, 0, 0, 0], [32767, 0, 0, 0], [0, 32767, -32767, 0]] {
        bin.extend(p.iter().flat_map(|c| c.to_le_bytes()));
    }
    bin.extend([0, 0, 127, 0].repeat(3));
    bin.extend([255, 51, 0, 255].repeat(3));
    for uv in [[0_u16, 0], [65535, 0], [0, 65535]] {
        bin.extend(uv.iter().flat_map(|c| c.to_le_bytes()));
    }
    let json = r#"{"asset":{"version":"2.0"},"extensionsRequired":["KHR_mesh_quantization"],"meshes":[{"primitives":[{"attributes":
        {"POSITION":0,"NORMAL":1,"COLOR_0":2,"TEXCOORD_1":3},"material":0}]}],
        "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0,"extensions":{"KHR_texture_transform":{"offset":[0.5,0.25],"rotation":1.5707963267948966,"scale":[2,1],"texCoord":1}}}}}],
        "textures":[{}],
        "accessors":[{"bufferView":0,"componentType":5122,"normalized":true,"count":3,"type":"VEC3"},{"bufferView":1,"componentType":5120,"normalized":true,"count":3,"type":"VEC3"},
        {"bufferView":2,"componentType":5121,"normalized":true,"count":3,"type":"VEC4"},{"bufferView":3,"componentType":5123,"normalized":true,"count":3,"type":"VEC2"}],
        "bufferViews":[{"buffer":0,"byteLength":24,"byteStride":8},{"buffer":0,"byteOffset":24,"byteLength":12,"byteStride":4},
        {"buffer":0,"byteOffset":36,"byteLength":12},{"buffer":0,"byteOffset":48,"byteLength":12}],"buffers":[{"byteLength":60}]}"#;
    let mesh = read(Format::Gltf, &glb(json, &bin));
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::new(0.0, 1.0, -1.0)]);
    assert_eq!(mesh.normals, [Vec3::Z; 3]);
    assert!(mesh.colors_linear[0].distance(Vec3::new(1.0, 0.2, 0.0)) < 1e-6);
    let expected = [[0.5, 0.25], [0.5, -1.75], [1.5, 0.25]].map(Vec2::from);
    assert!(mesh.uvs.iter().zip(expected).all(|(a, b)| a.distance(b) < 1e-6), "{:?}", mesh.uvs);
}

#[test]
fn gltf_compressed_by_meshopt_is_read() {
    let positions: Vec<[f32; 3]> = (0..400).map(|i| [(i % 20) as f32, (i / 20) as f32, (i * 7 % 5) as f32]).collect();
    let indices: Vec<u32> = (0..380).filter(|i| i % 20 < 19).flat_map(|i| [i, i + 1, i + 20, i + 1, i + 21, i + 20]).collect();
    let vertices = meshopt::encode_vertex_buffer(&positions).unwrap();
    let faces = meshopt::encode_index_buffer(&indices, 400).unwrap();
    let normals: Vec<[i8; 4]> = meshopt::encode_filter_oct(&vec![[0.6, 0.0, 0.8, 0.0]; 400], 8);
    let encoded_normals = meshopt::encode_vertex_buffer(&normals).unwrap();
    let bin = [vertices.as_slice(), &faces, &encoded_normals].concat();
    let view = |stride: usize, count: usize, mode: &str, offset: usize, length: usize, filter: &str| {
        format!(
            r#"{{"buffer":1,"byteLength":{},"byteStride":{stride},"extensions":{{"EXT_meshopt_compression":{{"buffer":0,"byteOffset":{offset},"byteLength":{length},"byteStride":{stride},"count":{count},"mode":"{mode}","filter":"{filter}"}}}}}}"#,
            stride * count
        )
    };
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"extensionsRequired":["EXT_meshopt_compression"],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":2}},"indices":1}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":400,"type":"VEC3"}},{{"bufferView":1,"componentType":5125,"count":{},"type":"SCALAR"}},
        {{"bufferView":2,"componentType":5120,"normalized":true,"count":400,"type":"VEC3"}}],
        "bufferViews":[{},{},{}],"buffers":[{{"byteLength":{}}},{{"byteLength":9999}}]}}"#,
        indices.len(),
        view(12, 400, "ATTRIBUTES", 0, vertices.len(), "NONE"),
        view(4, indices.len(), "TRIANGLES", vertices.len(), faces.len(), "NONE"),
        view(4, 400, "ATTRIBUTES", vertices.len() + faces.len(), encoded_normals.len(), "OCTAHEDRAL"),
        bin.len()
    );
    let mesh = read(Format::Gltf, &glb(&json, &bin));
    assert_eq!(mesh.positions, positions.iter().copied().map(Vec3::from).collect::<Vec<_>>());
    assert_eq!(mesh.triangles.len() * 3, indices.len());
    assert!(mesh.normals[7].distance(Vec3::new(0.6, 0.0, 0.8)) < 0.02, "{}", mesh.normals[7]);
}

#[test]
fn placement_is_applied_before_rounding_in_every_format() {
    let options = ImportOptions {
        placement: Placement {
            unit: Unit::Millimetre,
            up: Up::Z,
            origin: [476_000.0, 0.0, -4_202_000.0],
            ..Placement::default()
        },
        ..ImportOptions::default()
    };
    let rows = ["476000123 4202000456 7", "476001123 4202000456 7", "476000123 4202001456 7"];
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\nelement face 1\n\
         property list uchar int vertex_indices\nend_header\n{}\n3 0 1 2\n",
        rows.join("\n")
    );
    let obj = rows.map(|row| format!("v {row}\n")).concat() + "f 1 2 3\n";
    let stl = format!(
        "solid\nfacet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n",
        rows.map(|row| format!("vertex {row}\n")).concat()
    );
    for (format, text) in [(Format::Ply, ply), (Format::Obj, obj), (Format::Stl, stl)] {
        let (mesh, report) = read_with(format, text.as_bytes(), &options);
        assert!(mesh.positions[0].distance(Vec3::new(0.123, 0.007, -0.456)) < 1e-6, "{format:?}: {}", mesh.positions[0]);
        assert!(mesh.positions[2].distance(Vec3::new(0.123, 0.007, -1.456)) < 1e-6);
        assert!(mesh.normals[0].distance(Vec3::Y) < 1e-6);
        assert!(report.warnings.is_empty());
    }
}

#[test]
fn positions_far_from_the_origin_are_told_with_an_origin_to_write() {
    let text = b"v 476000 120 -4202000\nv 476001 120 -4202000\nv 476000 120 -4202001\nf 1 2 3\n";
    let (_, report) = read_with(Format::Obj, text, &ImportOptions::default());
    assert!(report.warnings[0].contains("write origin = [476001.0, 120.0, -4202001.0] in [site]"), "{report:?}");
}

#[test]
fn normals_are_the_file_s_or_computed_as_asked() {
    let text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 3 4\nvn 0 0 0\nf 1//1 2//1 3//2\n";
    let with = |normals| read_with(Format::Obj, text, &ImportOptions { normals, ..ImportOptions::default() });
    let (mesh, report) = with(NormalSource::FileOrComputed);
    assert!(mesh.normals[0].distance(Vec3::new(0.0, 0.6, 0.8)) < 1e-6 && mesh.normals[2] == Vec3::Z);
    assert_eq!(report.mended_normals, 1);
    assert_eq!(with(NormalSource::Computed).0.normals, [Vec3::Z; 3]);
}

#[test]
fn what_is_written_is_read_back() {
    let mut mesh = good("PLY with everything");
    mesh.materials.clear();
    mesh.triangle_material.clear();
    let folder = tempfile::tempdir().unwrap();
    let (ply, obj) = (folder.path().join("a.ply"), folder.path().join("a.obj"));
    let quality: Vec<f32> = (0..mesh.positions.len()).map(|i| i as f32 / 7.0).collect();
    export::write_ply(&ply, &mesh, Some(&quality)).unwrap();
    export::write_obj(&obj, &mesh).unwrap();
    for path in [&ply, &obj] {
        let back = read_reporting(path, &ImportOptions::default(), &mut ImportReport::default()).unwrap();
        assert_eq!(
            (&back.positions, &back.normals, &back.uvs, &back.triangles),
            (&mesh.positions, &mesh.normals, &mesh.uvs, &mesh.triangles)
        );
        if path == &ply {
            assert_eq!(back.colors_linear, mesh.colors_linear);
        }
    }
    assert!(export::write_ply(&ply, &mesh, Some(&[1.0])).is_err());
    assert!(
        export::write_obj(&folder.path().join("no/such/folder.obj"), &mesh).unwrap_err().to_string().contains("folder.obj")
    );
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "no half-written file is left");
    assert!(
        read_reporting(&ply, &ImportOptions::default(), &mut ImportReport::default()).is_ok(),
        "the good file is still there"
    );
}

#[test]
fn a_texture_that_is_seen_through_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let mut image = heliodon_image::SrgbImage { width: 2, height: 1, pixels: vec![[9, 9, 9, 255]; 2] };
    std::fs::write(folder.path().join("leaf.mtl"), "newmtl leaf\nmap_Kd leaf.png\n").unwrap();
    let obj = "mtllib leaf.mtl\nusemtl leaf\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";
    std::fs::write(folder.path().join("leaf.obj"), obj).unwrap();
    for (alpha, told) in [(255, 0), (200, 0), (0, 1)] {
        image.pixels[1][3] = alpha;
        image.write_png(folder.path().join("leaf.png")).unwrap();
        let mut report = heliodon_mesh::import::ImportReport::default();
        let options = heliodon_mesh::import::ImportOptions::default();
        heliodon_mesh::import::read_reporting(&folder.path().join("leaf.obj"), &options, &mut report).unwrap();
        assert_eq!(
            report.warnings.iter().filter(|w| w.contains("transparent in places")).count(),
            told,
            "{:?}",
            report.warnings
        );
    }
}
