//! What a light map takes of a site: its parts with all that their files have, those with texels first.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::{Vec2, Vec3};
use heliodon_bake::report::Silent;
use heliodon_bake::scene::{Scene, read, read_with_uvs};
use heliodon_bake::texels_first;
use heliodon_bundle::site::Site;
use std::fs;
use tempfile::TempDir;

/// A square at a height, as OBJ, with texture coordinates or without.
fn square(height: u32, has_uvs: bool) -> String {
    let vertices = format!("v 0 {height} 0\nv 1 {height} 0\nv 1 {height} -1\nv 0 {height} -1\n");
    let rest = if has_uvs { "vt 0 0\nvt 2 0\nvt 2 2\nvt 0 2\nf 1/1 2/2 3/3 4/4\n" } else { "f 1 2 3 4\n" };
    vertices + rest
}

/// A part of two files of which one has coordinates, a part that says where its light is, one without coordinates, and one whose image needs them.
fn site() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let parts = "[[part]]\nfile = \"pair-*.obj\"\nalbedo = [0.5, 0.4, 0.3]\n\
                 [[part]]\nfile = \"post.obj\"\nlight = \"vertex\"\nalbedo = [0.1, 0.2, 0.3]\n\
                 [[part]]\nfile = \"bare.obj\"\n";
    let text = format!("[site]\nname = \"Parts\"\n{parts}[sky]\nprobes = \"sky.hdr\"\nmapping = \"lat-long\"\n");
    fs::write(folder.path().join("site.toml"), text).unwrap();
    for (height, (name, has_uvs)) in
        [("pair-1", false), ("pair-2", true), ("post", true), ("bare", false)].into_iter().enumerate()
    {
        fs::write(folder.path().join(format!("{name}.obj")), square(height as u32, has_uvs)).unwrap();
    }
    fs::write(folder.path().join("sky.hdr"), "unread").unwrap();
    folder
}

fn corners(scene: &Scene, part: usize) -> Vec<[Vec3; 3]> {
    scene.parts[part].triangles.clone().map(|t| scene.mesh.corners(t)).collect()
}

#[test]
fn coordinates_are_kept_beside_a_plain_albedo_and_a_bake_s_scene_stays() {
    let folder = site();
    let site = Site::read(folder.path()).unwrap();
    let files = site.input_files().unwrap();
    let (scene, uvs) = read_with_uvs(&site, &files, &Silent).unwrap();
    let own = [Vec2::new(0.0, 1.0), Vec2::new(2.0, 1.0), Vec2::new(2.0, -1.0), Vec2::new(0.0, -1.0)];
    assert_eq!(uvs[0], [[Vec2::ZERO; 4], own].concat(), "zero where another file of the part has some");
    assert_eq!(uvs[1], own);
    assert!(uvs[2].is_empty());
    let of_bake = read(&site, &files, &Silent).unwrap();
    assert!(scene.mesh.uvs.is_empty() && of_bake.mesh.uvs.is_empty());
    assert_eq!((scene.mesh.positions, scene.parts), (of_bake.mesh.positions, of_bake.parts));
}

#[test]
fn triangles_with_texels_stand_first_and_parts_in_the_site_s_order() {
    let folder = site();
    let site = Site::read(folder.path()).unwrap();
    let scene = || read(&site, &site.input_files().unwrap(), &Silent).unwrap();
    let before = scene();
    let (after, density) = texels_first(&site, scene(), false);
    assert_eq!(density, [1.0; 6]);
    let ranges: Vec<_> =
        after.parts.iter().map(|part| (part.vertices.clone(), part.triangles.clone(), part.by_texels)).collect();
    assert_eq!(ranges, [(0..8, 0..4, true), (8..12, 6..8, false), (12..16, 4..6, true)]);
    for part in 0..3 {
        assert_eq!(corners(&after, part), corners(&before, part));
        let material = |scene: &Scene| -> Vec<u16> {
            scene.parts[part].triangles.clone().map(|t| scene.mesh.triangle_material[t]).collect()
        };
        assert_eq!(material(&after), material(&before));
    }
}
