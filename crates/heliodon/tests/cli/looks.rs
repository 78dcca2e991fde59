//! What surfaces look like in the bundle: each as its file says, whatever stands beside it.

use crate::sites::TestSite;
use crate::{done, json};
use heliodon_image::SrgbImage;

/// The different values of an array of three floats a vertex, in thousandths, per part.
fn values(site: &TestSite, array: &str) -> Vec<Vec<[i32; 3]>> {
    let (bundle, arrays) = (site.path("bundle"), site.path("arrays"));
    done(&[&"bake", &site.folder(), &"-o", &bundle, &"--quiet"]);
    done(&[&"arrays", &bundle, &arrays]);
    let data = |name: &str| {
        let bytes = std::fs::read(arrays.join(name)).unwrap();
        let header = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        bytes[header..].to_vec()
    };
    let floats: Vec<f32> = data(array).chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
    let parts: Vec<u16> = data("part.npy").chunks_exact(2).map(|b| u16::from_le_bytes(b.try_into().unwrap())).collect();
    let mut found = vec![Vec::new(); usize::from(parts.iter().copied().max().unwrap()) + 1];
    for (value, part) in floats.chunks_exact(3).zip(parts) {
        found[usize::from(part)].push([0, 1, 2].map(|k| (value[k] * 1000.0).round() as i32));
    }
    for values in &mut found {
        values.sort_unstable();
        values.dedup();
    }
    found
}

const SQUARES: &str = "v 0 0 0\nv 1 0 0\nv 1 0 -1\nv 0 0 -1\nv 1 0 -2\nv 0 0 -2\nvt 0.5 0.5\n";

#[test]
fn parts_keep_their_looks_beside_one_another() {
    let site = TestSite::smallest(&format!("{SQUARES}f 1 2 3 4\n"));
    site.write("two.mtl", "newmtl wall\nKd 1 1 1\nnewmtl roof\nKd 1 0 0\n");
    site.write("two.obj", format!("mtllib two.mtl\n{SQUARES}usemtl wall\nf 1 2 3 4\nusemtl roof\nf 4 3 5 6\n"));
    // two tints of one image, both in a folder of their own
    std::fs::create_dir(site.path("mat")).unwrap();
    SrgbImage::filled(2, 2, [188, 188, 188, 255]).write_png(site.path("mat/stone.png")).unwrap();
    let tints = "newmtl light\nKd 1 1 1\nmap_Kd stone.png\nnewmtl dark\nKd 0.5 0.5 0.5\nmap_Kd stone.png\n";
    site.write("mat/tints.mtl", tints);
    let faces = "usemtl light\nf 1/1 2/1 3/1 4/1\nusemtl dark\nf 4/1 3/1 5/1 6/1\n";
    site.write("tints.obj", format!("mtllib mat/tints.mtl\n{SQUARES}{faces}"));
    let parts = ["two.obj", "mesh.obj", "tints.obj"].map(|file| format!("[[part]]\nfile = \"{file}\"\n")).concat();
    site.edit("[[part]]\nfile = \"mesh.obj\"\nrole = \"scan\"\nalbedo = [0.5, 0.5, 0.5]\n", &parts);
    assert_eq!(values(&site, "albedo.npy"), [vec![[1000, 0, 0], [1000, 1000, 1000]], vec![[500; 3]], vec![[108; 3], [503; 3]]]);
    let told = json(&[&"inspect", &site.path("bundle")]);
    assert_eq!(told["counts"]["triangles"], 10);
}

#[test]
fn edges_are_as_hard_as_the_site_says() {
    let roof = "v 0 0 0\nv 1 0 0\nv 1 1 -1\nv 0 1 -1\nv 1 0 -2\nv 0 0 -2\nf 1 2 3 4\nf 4 3 5 6\n";
    let site = TestSite::smallest(roof);
    assert!(values(&site, "normals.npy")[0].contains(&[0, 1000, 0]), "a round ridge");
    site.edit("role = \"scan\"", "crease_deg = 45.0");
    assert_eq!(values(&site, "normals.npy"), [vec![[0, 707, -707], [0, 707, 707]]]);
    site.edit("crease_deg = 45.0", "crease_deg = 100.0");
    assert!(values(&site, "normals.npy")[0].contains(&[0, 1000, 0]));
}
