//! Meshes compressed by Draco, as its own encoder wrote them: what they are of is known.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::{Vec2, Vec3};
use heliodon_mesh::Mesh;
use heliodon_mesh::import::{Format, ImportError, ImportOptions, ImportReport, from_bytes, read_reporting};
use heliodon_testkit::draco::{self, Compressed};
use heliodon_testkit::hostile::files::{self, glb};
use serde_json::Value;
use std::path::Path;

fn read_with(json: &str, stream: &[u8], options: &ImportOptions) -> Result<Mesh, ImportError> {
    let mut report = ImportReport::default();
    from_bytes(&glb(json, stream), Format::Gltf, Path::new("it.glb"), options, &mut report)
}

fn read(mesh: &Compressed) -> Mesh {
    let decoded = read_with(&mesh.json(), mesh.stream, &ImportOptions::default()).unwrap();
    decoded.validate().unwrap();
    decoded
}

fn seams() -> Compressed {
    draco::all()[0]
}

#[test]
fn what_is_decoded_is_what_was_encoded() {
    for compressed in draco::all() {
        let mesh = read(&compressed);
        let name = compressed.name;
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (compressed.points, compressed.triangles), "{name}");
        // half a step of the longest side along each axis
        let half_step = 0.5 / ((1 << compressed.position_bits) - 1) as f32;
        for (i, p) in mesh.positions.iter().enumerate() {
            assert!((p.z - draco::height(p.x, p.y)).abs() < 1.5 * half_step, "{name}: {p} lies off the surface");
            if compressed.is_colored {
                let expected = Vec3::new((p.x * 255.0).round() / 255.0, (p.y * 255.0).round() / 255.0, 0.2);
                assert!(mesh.colors_linear[i].abs_diff_eq(expected, 1e-6), "{name}: {p} {}", mesh.colors_linear[i]);
            } else {
                assert!(mesh.normals[i].dot(draco::normal(p.x, p.y)) > 0.9998, "{name}: {p} {}", mesh.normals[i]);
            }
        }
        let mut area = 0.0;
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = mesh.corners(t).map(|p| Vec2::new(p.x, p.y));
            // they face upwards as they did, and cover the square once
            let twice = (b - a).perp_dot(c - a);
            assert!(twice > 0.0, "{name}: triangle {t} is turned over");
            area += 0.5 * twice;
            if !compressed.is_colored {
                let is_right = (a + b + c).x / 3.0 > 0.5;
                for (corner, place) in triangle.iter().zip([a, b, c]) {
                    let uv = mesh.uvs[*corner as usize];
                    assert!(uv.abs_diff_eq(draco::uv(place.x, place.y, is_right), 1e-3), "{name}: {place} has {uv}");
                }
            }
        }
        assert!((area - 1.0).abs() < 1e-4, "{name}: {area}");
    }
}

#[test]
fn what_its_accessors_say_wrongly_does_not_matter() {
    let compressed = seams();
    for (from, to) in [
        ("\"count\":90,\"type\":\"VEC3\"", "\"count\":89,\"type\":\"VEC3\""),
        ("\"count\":384", "\"count\":387"),
        ("\"type\":\"VEC2\"", "\"type\":\"VEC3\""),
        ("5126", "5123"),
        ("5123", "5121"),
        // some leave them out
        ("\"indices\":3,", ""),
        // what lies in the file where another reader would look is not this mesh
        ("{\"componentType\"", "{\"bufferView\":0,\"componentType\""),
    ] {
        let json = compressed.json();
        assert!(json.contains(from), "{from}");
        let mesh = read_with(&json.replace(from, to), compressed.stream, &ImportOptions::default()).unwrap();
        let expected = read(&compressed);
        assert_eq!((&mesh.positions, &mesh.triangles), (&expected.positions, &expected.triangles), "{from} to {to}");
        assert_eq!((&mesh.uvs, &mesh.normals), (&expected.uvs, &expected.normals), "{from} to {to}");
    }
}

#[test]
fn what_cannot_be_decoded_is_told() {
    let compressed = seams();
    let named = "\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":1,\"NORMAL\":2}}}";
    for (from, to, told) in [
        (named, "\"attributes\":{\"POSITION\":7}}}", "POSITION of its Draco data is not there, as its attribute 7"),
        (named, "\"attributes\":{\"NORMAL\":2}}}", "has no POSITION"),
        ("\"indices\":3", "\"indices\":3,\"mode\":5", "not made of plain triangles"),
        ("\"bufferView\":0", "\"bufferView\":4", "bufferViews[4]"),
        ("\"POSITION\":0", "\"POSITION\":9", "accessors[9]"),
        ("\"byteLength\":733}]", "\"byteLength\":700}]", "cannot be decoded"),
    ] {
        let json = compressed.json();
        assert!(json.contains(from), "{from}");
        let error = read_with(&json.replace(from, to), compressed.stream, &ImportOptions::default()).unwrap_err();
        assert!(error.to_string().contains(told) && !error.remedy().is_empty(), "{from} to {to}: {error}");
    }
}

/// A document whose primitives go by the accessors that are given for them, and by a view each.
fn of_primitives(first: &Compressed, count: usize, change: impl Fn(usize, &mut Value)) -> Value {
    let mut document: Value = serde_json::from_str(&first.json()).unwrap();
    let primitives = document["meshes"][0]["primitives"].as_array_mut().unwrap();
    *primitives = vec![primitives[0].clone(); count];
    primitives.iter_mut().enumerate().for_each(|(k, primitive)| change(k, primitive));
    document
}

#[test]
fn primitives_that_share_accessors_are_told_apart() {
    let [first, second, _] = draco::all();
    let mut document = of_primitives(&first, 3, |k, primitive| {
        primitive["extensions"]["KHR_draco_mesh_compression"]["bufferView"] = (k % 2).into();
    });
    let (begin, length) = (first.stream.len(), second.stream.len());
    let view = serde_json::json!({"buffer": 0, "byteOffset": begin, "byteLength": length});
    document["bufferViews"].as_array_mut().unwrap().push(view);
    document["buffers"][0]["byteLength"] = (begin + length).into();
    let bin = [first.stream, second.stream].concat();
    let mesh = read_with(&document.to_string(), &bin, &ImportOptions::default()).unwrap();
    let (one, other) = (read(&first), read(&second));
    // the third primitive is the first once more, over its vertices
    assert_eq!(mesh.positions, [&one.positions[..], &other.positions].concat());
    let moved = |triangles: &[[u32; 3]], by: u32| triangles.iter().map(|t| t.map(|v| v + by)).collect::<Vec<_>>();
    let triangles = [moved(&one.triangles, 0), moved(&other.triangles, 90), moved(&one.triangles, 0)].concat();
    assert_eq!(mesh.triangles, triangles);
}

#[test]
fn what_nobody_uses_may_be_broken() {
    let compressed = seams();
    let mut document = of_primitives(&compressed, 1, |_, _| ());
    let mut broken = document["meshes"][0].clone();
    broken["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["bufferView"] = 9.into();
    document["meshes"].as_array_mut().unwrap().push(broken);
    let read = |document: &Value| read_with(&document.to_string(), compressed.stream, &ImportOptions::default());
    assert_eq!(read(&document).unwrap().triangles.len(), 128);
    document["nodes"][0]["mesh"] = 1.into();
    assert!(read(&document).unwrap_err().to_string().contains("bufferViews[9]"));
}

#[test]
fn what_lies_beside_it_without_compression_is_read_where_it_fails() {
    let file = files::all().into_iter().find(|file| file.name.ends_with("beside the same without compression")).unwrap();
    let (mut report, options) = (ImportReport::default(), ImportOptions::default());
    let mesh = from_bytes(&file.bytes, Format::Gltf, Path::new("it.gltf"), &options, &mut report).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert!(report.warnings[0].contains("without compression is read"), "{:?}", report.warnings);
    let required = String::from_utf8(file.bytes).unwrap();
    let required = required.replacen('{', "{\"extensionsRequired\":[\"KHR_draco_mesh_compression\"],", 1);
    assert!(from_bytes(required.as_bytes(), Format::Gltf, Path::new("it.gltf"), &options, &mut report).is_err());
}

#[test]
fn no_more_is_decoded_than_is_allowed() {
    let compressed = seams();
    // told apart by a further attribute, which nobody reads
    let twice = of_primitives(&compressed, 2, |k, primitive| primitive["attributes"][format!("_{k}")] = 1.into());
    for (json, enough) in [(compressed.json(), 128), (twice.to_string(), 256)] {
        let allowed = |most_elements| {
            let options = ImportOptions { most_elements, ..ImportOptions::default() };
            read_with(&json, compressed.stream, &options)
        };
        assert_eq!(allowed(enough).unwrap().triangles.len(), enough as usize);
        let error = allowed(enough - 1).unwrap_err().to_string();
        assert!(error.contains("more than the 127 vertices or triangles"), "{error}");
    }
}

#[test]
fn a_small_file_does_not_make_much_by_naming_a_stream_again_and_again() {
    let valence = draco::all()[1];
    let read = |document: &Value| read_with(&document.to_string(), valence.stream, &ImportOptions::default());
    let many = |count| of_primitives(&valence, count, |k, primitive| primitive["attributes"][format!("_{k}")] = 1.into());
    assert_eq!(read(&many(800)).unwrap().triangles.len(), 800 * 1152);
    let error = read(&many(1000)).unwrap_err().to_string();
    assert!(error.contains("may still be decoded"), "{error}");
    // nor by views of the same bytes
    let mut views = of_primitives(&valence, 1000, |k, primitive| {
        primitive["extensions"]["KHR_draco_mesh_compression"]["bufferView"] = k.into();
    });
    let view = views["bufferViews"][0].clone();
    views["bufferViews"] = vec![view; 1000].into();
    assert!(read(&views).unwrap_err().to_string().contains("may still be decoded"));
    // one attribute under two hundred thousand names is held once
    let mut names = of_primitives(&valence, 1, |_, _| ());
    let primitive = &mut names["meshes"][0]["primitives"][0];
    for k in 0..200_000 {
        primitive["attributes"][format!("_{k}")] = 0.into();
        primitive["extensions"]["KHR_draco_mesh_compression"]["attributes"][format!("_{k}")] = 0.into();
    }
    let before = heliodon_testkit::process::peak_bytes().unwrap_or(0);
    assert_eq!(read(&names).unwrap().triangles.len(), 1152);
    // as many copies would be 1.5 GB
    assert!(heliodon_testkit::process::peak_bytes().unwrap_or(0) < before + (1 << 30));
}

#[test]
fn numbers_are_parts_of_one_where_the_file_or_the_stream_says_so() {
    let colors = draco::all()[2];
    let read_as = |accessor: &str| {
        let json = colors.json().replace("\"componentType\":5121,\"normalized\":true", accessor);
        read_with(&json, colors.stream, &ImportOptions::default()).unwrap().colors_linear
    };
    let expected = read(&colors).colors_linear;
    // an accessor of floats over a stream of bytes
    assert_eq!(read_as("\"componentType\":5126"), expected);
    assert_eq!(read_as("\"componentType\":5126,\"normalized\":true"), expected);
    // and one that says it of floats, whose coordinates may be beyond one
    let seams = seams();
    let json = seams.json().replace("\"componentType\":5126", "\"componentType\":5123,\"normalized\":true");
    let mesh = read_with(&json, seams.stream, &ImportOptions::default()).unwrap();
    assert_eq!((mesh.uvs, mesh.positions), (read(&seams).uvs, read(&seams).positions));
}

#[test]
fn an_attribute_that_gltf_does_not_know_is_left_out() {
    let compressed = seams();
    let mut document = of_primitives(&compressed, 1, |_, primitive| {
        primitive["attributes"]["_AGE"] = 1.into();
        primitive["extensions"]["KHR_draco_mesh_compression"]["attributes"]["_AGE"] = 77.into();
    });
    let mut report = ImportReport::default();
    let bytes = glb(&document.to_string(), compressed.stream);
    let mesh = from_bytes(&bytes, Format::Gltf, Path::new("it.glb"), &ImportOptions::default(), &mut report).unwrap();
    assert_eq!(mesh.positions, read(&compressed).positions);
    assert!(report.warnings[0].contains("_AGE of its Draco data is not there"), "{:?}", report.warnings);
    document["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["attributes"]["NORMAL"] = 78.into();
    assert!(read_with(&document.to_string(), compressed.stream, &ImportOptions::default()).is_err());
}

#[test]
fn damaged_streams_do_no_harm() {
    let mut refused = 0;
    for compressed in draco::all() {
        let json = compressed.json();
        for at in 0..compressed.stream.len() {
            for change in [|_| 0, |_| 255, |byte: u8| byte ^ 1, |byte: u8| byte ^ 0x80, |byte: u8| byte.wrapping_add(3)] {
                let mut stream = compressed.stream.to_vec();
                stream[at] = change(stream[at]);
                match read_with(&json, &stream, &ImportOptions::default()) {
                    Ok(mesh) => mesh.validate().unwrap(),
                    Err(error) => {
                        assert!(!error.problem().is_empty() && !error.remedy().is_empty());
                        refused += 1;
                    }
                }
            }
        }
    }
    assert!(refused > 1000, "{refused}");
}

#[test]
fn a_real_scan_is_what_another_decoder_made_of_it() {
    let folder = Path::new("../../../shared/data/meshes/heritage/aton_venus_cc0");
    if !folder.is_dir() {
        println!("skipped: no {}", folder.display());
        return;
    }
    let read =
        |name: &str| read_reporting(&folder.join(name), &ImportOptions::default(), &mut ImportReport::default()).unwrap();
    let (here, there) = (read("venus.gltf"), read("venus_600k_decoded.glb"));
    assert_eq!(here.triangles, there.triangles);
    assert_eq!(here.positions, there.positions);
    assert_eq!(here.normals, there.normals);
    assert_eq!(here.uvs, there.uvs);
}
