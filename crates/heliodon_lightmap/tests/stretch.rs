//! How far charts are from what they are of: lengths on the surface and in its texture.

use glam::Vec3;
use heliodon_lightmap::charts::{ChartParams, charts};
use heliodon_mesh::Mesh;
use heliodon_mesh::temple::{self, TempleParams};
use heliodon_mesh::workshop::{WorkshopParams, workshop};
use heliodon_testkit::scenes::{Scene, ball, cuboid, ground};

fn of_meshes(meshes: impl Iterator<Item = Mesh>) -> Scene {
    let scene = |mesh: Mesh| Scene { positions: mesh.positions, normals: mesh.normals, triangles: mesh.triangles };
    meshes.map(scene).fold(Scene::default(), Scene::and)
}

/// A ground of waves, some of them steep.
fn waves(parts: u32, height: f32) -> Scene {
    let mut scene = ground(4.0, parts);
    for p in &mut scene.positions {
        p.y = height * libm::sinf(2.3 * p.x + 0.4) * libm::cosf(1.9 * p.z);
    }
    scene
}

/// Of a surface's charts: the mean of lengths' least stretch beside the greatest, by area, how much of the area has less than charts' usual cone allows, and the worst of all; the mean
/// by which lengths are off what was wanted, and the greatest stretch.
fn stretch(scene: &Scene) -> ([f32; 3], [f32; 2]) {
    let (mut area, mut steep, mut even, mut off) = (0.0_f64, 0.0, 0.0, 0.0);
    let (mut worst, mut greatest) = (1.0_f32, 1.0_f32);
    let params = ChartParams::default();
    // normals of the smallest triangles are rounded
    let usual = libm::cosf(params.cone_deg.to_radians()) - 0.01;
    for chart in charts(&scene.positions, &scene.triangles, &[], &params) {
        for &t in &chart.triangles {
            let corners = scene.triangles[t as usize].map(|v| scene.positions[v as usize]);
            let Some([most, least]) = chart.stretch(corners, 1.0) else { continue };
            let of = f64::from(0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length());
            area += of;
            even += of * f64::from(least / most);
            off += 0.5 * of * f64::from((most - 1.0).abs() + (least - 1.0).abs());
            steep += if least < usual * most { of } else { 0.0 };
            (worst, greatest) = (worst.min(least / most), greatest.max(most));
        }
    }
    let part = |sum: f64| (sum / area) as f32;
    ([part(even), part(steep), worst], [part(off), greatest])
}

#[test]
fn charts_keep_lengths_nearly() {
    let temple = |triangles: usize| {
        of_meshes(temple::build(&TempleParams { triangles, ..TempleParams::default() }).parts.into_iter().map(|part| part.mesh))
    };
    let scenes = [
        ("box", cuboid(Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0), 3)),
        ("ball", ball(1.0, 40)),
        ("coarse ball", ball(1.0, 8)),
        ("hills", waves(60, 0.6)),
        ("cliffs", waves(60, 3.0)),
        ("temple", temple(20_000)),
        ("finer temple", temple(100_000)),
        ("workshop", of_meshes(workshop(&WorkshopParams::default()).parts.into_iter().map(|part| part.mesh))),
    ];
    for (name, scene) in scenes {
        let ([even, steep, worst], [off, greatest]) = stretch(&scene);
        println!("{name}: {even:.3} even, {steep:.4} steep, {worst:.3} worst, {off:.3} off, {greatest:.3} greatest");
        assert!(even > 0.9 && steep < 0.01 && off < 0.1, "{name}");
        // the cone of small charts
        assert!(worst > libm::cosf(70.0_f32.to_radians()) - 0.01 && greatest < 1.6, "{name}");
    }
}
