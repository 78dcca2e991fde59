//! Mesh files that are wrong, or right in an unkind way, as bytes, and small good ones to damage.

use crate::draco;

/// A mesh file.
#[derive(Clone, Debug)]
pub struct File {
    /// What is the matter with it, or what it is.
    pub name: String,
    /// The ending that it would have: `ply`, `obj`, `gltf`, `glb` or `stl`.
    pub ending: &'static str,
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// What must come of it.
    pub outcome: Outcome,
}

/// What an importer must make of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// An error that names the file and what to do.
    Refused,
    /// A valid mesh of so many triangles.
    Triangles(usize),
}

use Outcome::{Refused, Triangles};

fn file(ending: &'static str, outcome: Outcome, name: &str, bytes: impl Into<Vec<u8>>) -> File {
    File { name: name.to_owned(), ending, bytes: bytes.into(), outcome }
}

/// The whole corpus: every format, good files among the bad.
#[must_use]
pub fn all() -> Vec<File> {
    [good(), ply(), obj(), gltf(), stl()].concat()
}

const TRIANGLE: &str = "0 0 0\n1 0 0\n0 1 0\n";

fn ply_text(vertices: &str, faces: &str, vertex_rows: &str, face_rows: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list uchar int vertex_indices\nend_header\n{vertex_rows}{face_rows}"
    )
}

fn ply_binary(big: bool, vertices: u64, faces: u64, list: &str, data: &[u8]) -> Vec<u8> {
    let order = if big { "big" } else { "little" };
    let mut bytes = format!(
        "ply\nformat binary_{order}_endian 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list {list} vertex_indices\nend_header\n"
    )
    .into_bytes();
    bytes.extend_from_slice(data);
    bytes
}

fn floats(values: &[f32], big: bool) -> Vec<u8> {
    values.iter().flat_map(|v| if big { v.to_be_bytes() } else { v.to_le_bytes() }).collect()
}

const CORNERS: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

fn binary_triangle(big: bool) -> Vec<u8> {
    let mut data = floats(&CORNERS, big);
    data.push(3);
    data.extend([0_i32, 1, 2].iter().flat_map(|i| if big { i.to_be_bytes() } else { i.to_le_bytes() }));
    data
}

fn ply() -> Vec<File> {
    let no = |name: &str, bytes: Vec<u8>| file("ply", Refused, &format!("PLY: {name}"), bytes);
    let text = |name: &str, v: &str, f: &str, rows: &str, faces: &str| no(name, ply_text(v, f, rows, faces).into_bytes());
    let header = |name: &str, text: &str| no(name, text.as_bytes().to_vec());
    let huge = "18446744073709551615";
    let mut index_out = binary_triangle(false);
    index_out[37] = 200;
    let mut list_long = floats(&CORNERS, false);
    list_long.extend_from_slice(&[255, 255, 255, 255, 0, 0, 0, 0, 1, 0, 0, 0]);
    vec![
        header("nothing", ""),
        header("a word", "ply"),
        header("not PLY", "polygon\n"),
        header("no format", "ply\nend_header\n"),
        header("unknown format", "ply\nformat binary_middle_endian 1.0\nend_header\n"),
        header("no end of header", "ply\nformat ascii 1.0\nelement vertex 3\n"),
        header("a property before elements", "ply\nformat ascii 1.0\nproperty float x\nend_header\n"),
        header("a type that is none", "ply\nformat ascii 1.0\nelement vertex 1\nproperty quad x\nend_header\n"),
        header("a list counted in floats", "ply\nformat ascii 1.0\nelement face 1\nproperty list float int a\nend_header\n"),
        header("a count that is none", "ply\nformat ascii 1.0\nelement vertex many\nend_header\n"),
        header("a negative count", "ply\nformat ascii 1.0\nelement vertex -3\nend_header\n"),
        header("no vertex element", "ply\nformat ascii 1.0\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n"),
        header("a count without properties", &format!("ply\nformat ascii 1.0\nelement vertex {huge}\nend_header\n")),
        header("endless rows of nothing", "ply\nformat ascii 1.0\nelement a 999999999999999999\nelement vertex 0\nend_header\n"),
        header("bytes", "ply\n\0\u{1}\u{2}\nformat"),
        text("more vertices than a file can hold", "4294967295", "1", TRIANGLE, "3 0 1 2\n"),
        text("more faces than a file can hold", "3", "999999999999", TRIANGLE, "3 0 1 2\n"),
        text("cut off in its vertices", "3", "1", "0 0 0\n1 0 0\n0", ""),
        text("cut off in its faces", "3", "1", TRIANGLE, "3 0 1"),
        text("a word where a number belongs", "3", "1", "0 0 0\n1 zero 0\n0 1 0\n", "3 0 1 2\n"),
        text("an index too high", "3", "1", TRIANGLE, "3 0 1 3\n"),
        text("a negative index", "3", "1", TRIANGLE, "3 0 1 -1\n"),
        text("a list of minus one", "3", "1", TRIANGLE, "-1 0 1 2\n"),
        text("a list that goes beyond the end", "3", "1", TRIANGLE, "250 0 1 2\n"),
        text("points only", "3", "0", TRIANGLE, ""),
        text("no vertices", "0", "0", "", ""),
        text("only a line", "3", "1", TRIANGLE, "2 0 1\n"),
        text("only a point thrice", "3", "1", TRIANGLE, "3 1 1 1\n"),
        text("all vertices NaN", "3", "1", "nan nan nan\nnan 0 0\n0 nan 0\n", "3 0 1 2\n"),
        text("all beyond f32", "3", "1", "1e300 0 0\n0 1e300 0\n0 0 1e300\n", "3 0 1 2\n"),
        no("a binary index too high", ply_binary(false, 3, 1, "uchar int", &index_out)),
        no("a binary list too long", ply_binary(false, 3, 1, "uint int", &list_long)),
        no("binary, cut off", ply_binary(true, 3, 1, "uchar int", &binary_triangle(true)[..40])),
        no("binary with a count for all memory", ply_binary(false, 3_000_000_000, 1, "uchar int", &binary_triangle(false))),
        no("a range image", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nelement range_grid 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0\n0\n".to_vec()),
        file("ply", Triangles(1), "PLY: a vertex that is not a number", ply_text("4", "2", "0 0 0\n1 0 0\n0 1 0\nnan 1 1\n", "3 0 1 2\n3 1 3 2\n")),
        file("ply", Triangles(1), "PLY: an infinite vertex", ply_text("4", "2", "0 0 0\n1 0 0\n0 1 0\ninf 1 1\n", "3 0 1 2\n3 1 3 2\n")),
        file("ply", Triangles(1), "PLY: lines that end as on DOS", ply_text("3", "1", TRIANGLE, "3 0 1 2\n").replace('\n', "\r\n")),
        file("ply", Triangles(1), "PLY: everything on one line", ply_text("3", "1", "0 0 0 1 0 0 0 1 0 ", "3 0 1 2")),
    ]
}

fn obj() -> Vec<File> {
    let no = |name: &str, text: &str| file("obj", Refused, &format!("OBJ: {name}"), text);
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";
    let with = |faces: &str| format!("{vertices}{faces}");
    let yes = |count, name: &str, text: String| file("obj", Triangles(count), &format!("OBJ: {name}"), text);
    vec![
        no("nothing", ""),
        no("another text", "The quick brown fox\njumps over\n"),
        no("points only", vertices),
        no("index zero", &with("f 0 1 2\n")),
        no("an index too high", &with("f 1 2 5\n")),
        no("an index for all memory", &with("f 1 2 4294967295\n")),
        no("an index beyond 64 bits", &with("f 1 2 99999999999999999999\n")),
        no("too far from the end", &with("f -1 -2 -5\n")),
        no("an index that is no number", &with("f 1 2 x\n")),
        no("a coordinate that is no number", "v 0 0 0\nv 1 o 0\nv 0 1 0\nf 1 2 3\n"),
        no("too few coordinates", "v 0 0\nf 1 1 1\n"),
        no("a texture coordinate too high", &with("vt 0 0\nf 1/1 2/1 3/2\n")),
        no("a normal too high", &with("vn 0 0 1\nf 1//1 2//1 3//9\n")),
        no("a normal without a vertex", &with("f //1 //2 //3\n")),
        no("lines only", &with("l 1 2\nl 3 4\n")),
        no("faces of two", &with("f 1 2\n")),
        no("faces of one vertex", &with("f 1 1 1\nf 2 2 2 2\n")),
        no("all NaN", "v nan nan nan\nv nan nan nan\nv nan nan nan\nf 1 2 3\n"),
        no("zero bytes", "\0\0\0\0\0\0\0\0\0\0"),
        yes(1, "faces before vertices", format!("f 1 2 3\n{vertices}")),
        yes(1, "continued lines", with("f 1 \\\n2 \\\r\n3\n")),
        yes(2, "negative indices and spaces", with("  f   -4 -3\t-1 \nf -4 -1 -2")),
        yes(1, "an empty texture coordinate", with("vn 0 0 1\nf 1//1 2//1 3//1\n")),
        yes(1, "a library that is not there", with("mtllib nowhere.mtl\nusemtl gone\nf 1 2 3\n")),
        yes(1, "a continued end", with("f 1 2 3\\")),
        yes(1, "NaN in normals and texture", with("vn nan nan nan\nvt inf nan\nf 1/1/1 2/1/1 3/1/1\n")),
        yes(1, "colours that are none", "v 0 0 0 nan nan nan\nv 1 0 0 9 -9 0\nv 0 1 0\nf 1 2 3\n".to_owned()),
        yes(1, "line ends of old Macs", with("f 1 2 3\n").replace('\n', "\r")),
        yes(2998, "a polygon of thousands, all over itself", with(&format!("f{}\n", " 1 2 3".repeat(1000)))).or_fewer(),
    ]
}

impl File {
    /// For files whose triangles partly collapse: any number is right.
    fn or_fewer(mut self) -> Self {
        self.outcome = Triangles(usize::MAX);
        self
    }
}

/// A glTF document whose buffer holds three positions and three 16-bit indices.
fn document(change: impl Fn(String) -> String) -> String {
    let mut buffer = floats(&CORNERS, false);
    buffer.extend([0_u16, 1, 2].iter().flat_map(|i| i.to_le_bytes()));
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},{{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":6}}],
"buffers":[{{"byteLength":42,"uri":"data:application/octet-stream;base64,{}"}}]}}"#,
        base64(&buffer)
    );
    change(json)
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::new();
    for group in bytes.chunks(3) {
        let word = group.iter().enumerate().fold(0_u32, |word, (k, byte)| word | u32::from(*byte) << (16 - 8 * k));
        for k in 0..4 {
            let digit = char::from(DIGITS[(word >> (18 - 6 * k) & 63) as usize]);
            out.push(if k <= group.len() { digit } else { '=' });
        }
    }
    out
}

/// A binary glTF file of a document and its buffer.
#[must_use]
pub fn glb(json: &str, bin: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bin = bin.to_vec();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let word = |n: usize| (n as u32).to_le_bytes();
    let length = 12 + 8 + json.len() + 8 + bin.len();
    [&b"glTF"[..], &word(2), &word(length), &word(json.len()), b"JSON", &json, &word(bin.len()), b"BIN\0", &bin].concat()
}

fn gltf() -> Vec<File> {
    let changed = |name: &str, from: &str, to: &str| {
        let text = document(|json| {
            assert!(json.contains(from), "{name}");
            json.replace(from, to)
        });
        file("gltf", Refused, &format!("glTF: {name}"), text)
    };
    let mut bin = floats(&CORNERS, false);
    bin.extend([0_u8, 0, 1, 0, 2, 0]);
    let binary = document(|json| {
        let uri = json.find(",\"uri\"").unwrap_or(0);
        format!("{}}}]}}", &json[..uri])
    });
    let whole = glb(&binary, &bin);
    let mut version_1 = whole.clone();
    version_1[4] = 1;
    let mut long = whole.clone();
    long[8..12].copy_from_slice(&[255; 4]);
    let mut chunk = whole.clone();
    chunk[12..16].copy_from_slice(&[255; 4]);
    let deep = "[".repeat(100_000);
    vec![
        file("gltf", Refused, "glTF: nothing", ""),
        file("gltf", Refused, "glTF: no JSON", "hello"),
        file("gltf", Refused, "glTF: brackets without end", deep),
        file("gltf", Refused, "glTF: an empty document", "{}"),
        changed("version 1", "\"2.0\"", "\"1.0\""),
        changed("version 3 at least", "\"version\":\"2.0\"", "\"version\":\"2.0\",\"minVersion\":\"3.0\""),
        changed("a scene that is not there", "\"scene\":0", "\"scene\":7"),
        changed("a node that is not there", "\"nodes\":[0]", "\"nodes\":[4]"),
        changed("a node that is its own child", "{\"mesh\":0}", "{\"mesh\":0,\"children\":[0]}"),
        changed("nodes in a ring", "{\"mesh\":0}", "{\"mesh\":0,\"children\":[1]},{\"children\":[0]}"),
        changed("a mesh that is not there", "\"mesh\":0", "\"mesh\":9"),
        changed("no positions", "\"POSITION\":0", "\"NORMAL\":0"),
        changed("an accessor that is not there", "\"POSITION\":0", "\"POSITION\":9"),
        changed("positions of indices", "\"POSITION\":0", "\"POSITION\":1"),
        changed("indices of floats", "\"indices\":1", "\"indices\":0"),
        changed("a material that is not there", "\"indices\":1", "\"indices\":1,\"material\":3"),
        changed("an unknown component type", "5126", "5130"),
        changed("a count beyond the view", "\"count\":3,\"type\":\"VEC3\"", "\"count\":4,\"type\":\"VEC3\""),
        changed("a count for all memory", "\"count\":3,\"type\":\"VEC3\"", "\"count\":18446744073709551615,\"type\":\"VEC3\""),
        changed(
            "positions from nothing",
            "\"bufferView\":0,\"componentType\":5126,\"count\":3",
            "\"componentType\":5126,\"count\":4294967295",
        ),
        changed("indices from nothing", "\"bufferView\":1,", ""),
        changed("an offset that overflows", "\"byteOffset\":36", "\"byteOffset\":18446744073709551610"),
        changed("a negative offset", "\"byteOffset\":36", "\"byteOffset\":-1"),
        changed("a view beyond its buffer", "\"byteLength\":36", "\"byteLength\":999"),
        changed("a view of a buffer that is not there", "\"buffer\":0,\"byteLength\":36", "\"buffer\":5,\"byteLength\":36"),
        changed("elements that overlap", "\"byteLength\":36", "\"byteLength\":36,\"byteStride\":1"),
        changed("an index too high", "AAABAAIA", "AAABAAkA"),
        changed("a buffer that is not there", "data:application/octet-stream;base64,", "nowhere.bin?"),
        changed("a buffer on a network", "data:application/octet-stream;base64,", "https://example.org/"),
        changed("base 64 that is none", "base64,", "base64,*"),
        changed("points only", "\"indices\":1", "\"mode\":0"),
        changed("scaled to nothing", "{\"mesh\":0}", "{\"mesh\":0,\"scale\":[0,0,0]}"),
        changed("scaled beyond numbers", "{\"mesh\":0}", "{\"mesh\":0,\"scale\":[1e200,1e200,1e200]}"),
        changed(
            "meshopt of rubbish",
            "\"byteLength\":36",
            "\"byteLength\":36,\"extensions\":{\"EXT_meshopt_compression\":{\"buffer\":0,\"byteLength\":42,\"byteStride\":12,\"count\":3,\"mode\":\"ATTRIBUTES\"}}",
        ),
        changed(
            "meshopt for all memory",
            "\"byteLength\":36",
            "\"byteLength\":36,\"extensions\":{\"EXT_meshopt_compression\":{\"buffer\":0,\"byteLength\":42,\"byteStride\":12,\"count\":9999999999,\"mode\":\"ATTRIBUTES\"}}",
        ),
        changed(
            "meshopt indices not in threes",
            "\"byteOffset\":36,\"byteLength\":6",
            "\"byteLength\":6,\"extensions\":{\"EXT_meshopt_compression\":{\"buffer\":0,\"byteLength\":42,\"byteStride\":2,\"count\":4,\"mode\":\"TRIANGLES\"}}",
        ),
        changed(
            "sparse indices that fall",
            "\"count\":3,\"type\":\"VEC3\"",
            "\"count\":3,\"type\":\"VEC3\",\"sparse\":{\"count\":2,\"indices\":{\"bufferView\":1,\"byteOffset\":2,\"componentType\":5121},\"values\":{\"bufferView\":0}}",
        ),
        file("gltf", Refused, "glTF: Draco of rubbish", document(|json| draco_beside(&json).replace("\"bufferView\":1,", ""))),
        file(
            "gltf",
            Triangles(1),
            "glTF: Draco of rubbish beside the same without compression",
            document(|json| draco_beside(&json)),
        ),
        file("glb", Refused, "GLB: a header", &b"glTF\x02\0\0\0"[..]),
        file("glb", Refused, "GLB: version 1", version_1),
        file("glb", Refused, "GLB: a length beyond the file", long),
        file("glb", Refused, "GLB: a chunk beyond the file", chunk),
        file("glb", Refused, "GLB: without its buffer", glb(&binary, &[])),
        file("glb", Triangles(1), "GLB: bytes behind its end", [whole.as_slice(), b"more"].concat()),
        file(
            "gltf",
            Triangles(1),
            "glTF: no scenes",
            document(|json| json.replace("\"scene\":0,\"scenes\":[{\"nodes\":[0]}],", "")),
        ),
        file(
            "gltf",
            Triangles(1),
            "glTF: a texture that is not there",
            document(|json| {
                json.replace("\"indices\":1", "\"indices\":1,\"material\":0").replace("\"scene\":0", "\"materials\":[{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}}],\"textures\":[{\"source\":0}],\"images\":[{\"uri\":\"gone.png\"}],\"scene\":0")
            }),
        ),
        file(
            "gltf",
            Triangles(1),
            "glTF: a rotation of zero",
            document(|json| json.replace("{\"mesh\":0}", "{\"mesh\":0,\"rotation\":[0,0,0,0]}")),
        ),
    ]
}

/// With compressed data that is none; what is not compressed is still there.
fn draco_beside(json: &str) -> String {
    let extension = "\"extensions\":{\"KHR_draco_mesh_compression\":{\"bufferView\":0,\"attributes\":{\"POSITION\":0}}}";
    json.replace("\"indices\":1", &format!("\"indices\":1,{extension}"))
}

fn binary_stl(header: &[u8], count: u32, corners: &[[f32; 9]]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, b' ');
    bytes.extend_from_slice(&count.to_le_bytes());
    for corners in corners {
        bytes.extend_from_slice(&[0; 12]);
        bytes.extend_from_slice(&floats(corners, false));
        bytes.extend_from_slice(&[0; 2]);
    }
    bytes
}

fn stl() -> Vec<File> {
    let no = |name: &str, bytes: Vec<u8>| file("stl", Refused, &format!("STL: {name}"), bytes);
    let text = |name: &str, text: &str| no(name, text.as_bytes().to_vec());
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    vec![
        text("nothing", ""),
        text("an empty solid", "solid nothing\nendsolid nothing\n"),
        text(
            "a facet of two",
            "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\nendsolid\n",
        ),
        text("a facet of four", &format!("solid\n{}", facet.replace("endloop", "vertex 1 1 0\nendloop"))),
        text("cut off", &format!("solid\n{}", &facet[..60])),
        text("a coordinate that is no number", &format!("solid\n{}", facet.replace("1 0 0", "1 x 0"))),
        text("another text", "solid as a rock, said the fox\nand ran away\n"),
        no("a short header", vec![b'x'; 83]),
        no("a count for all memory", binary_stl(b"x", u32::MAX - 1, &[CORNERS])),
        no("cut off in a facet", binary_stl(b"x", 1, &[CORNERS])[..130].to_vec()),
        no("no facets", binary_stl(b"x", 0, &[])),
        no("all NaN", binary_stl(b"x", 1, &[[f32::NAN; 9]])),
        no("facets of one place", binary_stl(b"x", 2, &[[0.0; 9]; 2])),
        file("stl", Triangles(1), "STL: binary that begins with solid", binary_stl(b"solid or so it says", 1, &[CORNERS])),
        file("stl", Triangles(2), "STL: no count", binary_stl(b"x", 0, &[CORNERS, CORNERS])),
        file("stl", Triangles(2), "STL: all ones for a count", binary_stl(b"x", u32::MAX, &[CORNERS, CORNERS])),
        file("stl", Triangles(1), "STL: bytes behind its end", [binary_stl(b"x", 1, &[CORNERS]).as_slice(), b"more"].concat()),
        file("stl", Triangles(1), "STL: a facet that is not a number", binary_stl(b"x", 2, &[CORNERS, [f32::NAN; 9]])),
        file(
            "stl",
            Triangles(2),
            "STL: two solids with words for names",
            format!("SOLID vertex facet\r\n{facet}endsolid\r\nsolid 2\n{facet}endsolid loop\n"),
        ),
    ]
}

/// Small good files of every format and variant, to be read, cut off and damaged.
#[must_use]
pub fn good() -> Vec<File> {
    let mut bin = floats(&CORNERS, false);
    bin.extend([0_u8, 0, 1, 0, 2, 0]);
    let binary = document(|json| format!("{}}}]}}", &json[..json.find(",\"uri\"").unwrap_or(0)]));
    let rich_ply = "ply\nformat ascii 1.0\ncomment TextureFile gone.png\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n\
        property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
        property list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty int texnumber\nelement edge 1\nproperty int a\nend_header\n\
        0 0 0 0 0 1 255 0 0\n1 0 0 0 0 1 0 255 0\n1 1 0 0 0 1 0 0 255\n0 1 0 0 0 1 9 9 9\n4 0 1 2 3 8 0 0 1 0 1 1 0 1 0\n7\n";
    let strips = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\nelement tristrips 1\n\
        property list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n8 0 1 2 3 -1 4 2 5\n";
    let rich_obj = "mtllib a.mtl\no thing\ng a b\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\nvt 0 0\nvt 1 0\nvt 1 1\n\
        vn 0 0 1\nvn 0 1 0\nusemtl stone\ns off\nf 1/1/1 2/2/1 3/3/1 4/1/2\nusemtl wood # not stone\nf -4/-3/-2 -2/-1/-1 -3/-2/-1\nl 1 2\n";
    let rich_gltf = document(|json| {
        json.replace("{\"mesh\":0}", "{\"mesh\":0,\"translation\":[1,2,3],\"rotation\":[0,0,1,0],\"scale\":[1,-1,1]}")
            .replace("\"indices\":1", "\"indices\":1,\"mode\":5,\"material\":0")
            .replace("\"scene\":0", "\"materials\":[{\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.5,0.5,0.5,1]}}],\"scene\":0")
            .replace("\"count\":3,\"type\":\"VEC3\"", "\"count\":3,\"type\":\"VEC3\",\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":1,\"byteOffset\":2,\"componentType\":5121},\"values\":{\"bufferView\":0,\"byteOffset\":12}}")
    });
    let compressed = draco::all().map(|mesh| {
        let bytes = glb(&mesh.json(), mesh.stream);
        file("glb", Triangles(mesh.triangles), &format!("good: GLB, Draco, {}", mesh.name), bytes)
    });
    let text_stl = "solid a\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 0 1 0\n endloop\nendfacet\nendsolid a\n";
    let mut files = vec![
        file("ply", Triangles(1), "good: PLY as text", ply_text("3", "1", TRIANGLE, "3 0 1 2\n")),
        file("ply", Triangles(1), "good: PLY, little-endian", ply_binary(false, 3, 1, "uchar int", &binary_triangle(false))),
        file("ply", Triangles(1), "good: PLY, big-endian", ply_binary(true, 3, 1, "uchar int", &binary_triangle(true))),
        file("ply", Triangles(2), "good: PLY with everything", rich_ply),
        file("ply", Triangles(3), "good: PLY of strips", strips),
        file("obj", Triangles(3), "good: OBJ with everything", rich_obj),
        file("gltf", Triangles(1), "good: glTF", document(|json| json)),
        file("gltf", Triangles(1), "good: glTF, sparse, turned and mirrored", rich_gltf),
        file("glb", Triangles(1), "good: GLB", glb(&binary, &bin)),
        file("stl", Triangles(1), "good: STL as text", text_stl),
        file("stl", Triangles(2), "good: STL, binary", binary_stl(b"made by hand", 2, &[CORNERS, CORNERS.map(|x| x + 1.0)])),
    ];
    files.extend(compressed);
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_base_64_is_right() {
        let mut names: Vec<String> = all().into_iter().map(|f| f.name).collect();
        let count = names.len();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), count);
        assert_eq!([base64(b"heliodon"), base64(b"abc")], ["aGVsaW9kb24=", "YWJj"]);
    }
}
