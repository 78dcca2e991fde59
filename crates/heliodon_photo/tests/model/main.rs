//! Shapes fitted to points and edges that were made up from known ones, with noise.
#![expect(clippy::unwrap_used, reason = "helpers of tests: a test that cannot go on has failed")]

#[path = "../common/mod.rs"]
mod common;
mod edges;

use common::around;
use glam::{DMat3, DVec2, DVec3};
use heliodon_math::random::Pcg32;
use heliodon_mesh::topology::{Edges, places};
use heliodon_photo::camera::Camera;
use heliodon_photo::model::table::ShapeRow;
use heliodon_photo::model::{Model, NamedPoint, Part, build};
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    shape: Vec<ShapeRow>,
}

fn rows(text: &str) -> Vec<ShapeRow> {
    toml::from_str::<Table>(text).unwrap().shape
}

/// Noise with this standard deviation, which is also what points are said to have.
const SIGMA_M: f64 = 0.004;

struct Yard {
    points: Vec<NamedPoint>,
    photographs: Vec<(String, Camera)>,
    random: Pcg32,
}

impl Yard {
    fn new() -> Self {
        let cameras = around(6, 14.0, 2.0, DVec3::new(0.0, 2.0, 0.0), [3000, 2000], 2600.0);
        let photographs = cameras.into_iter().enumerate().map(|(i, camera)| (format!("{i}.jpg"), camera)).collect();
        Self { points: Vec::new(), photographs, random: Pcg32::new(5, 8) }
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| f64::from(self.random.next_f32())).sum::<f64>() - 6.0
    }

    fn mark(&mut self, name: &str, place: DVec3) {
        let noise = DVec3::new(self.normal(), self.normal(), self.normal()) * SIGMA_M;
        let covariance = DMat3::from_diagonal(DVec3::splat(SIGMA_M * SIGMA_M));
        let eye = |i: &usize| (self.photographs[*i].1.centre() - place).length();
        let mut seen_in: Vec<usize> = (0..self.photographs.len()).collect();
        seen_in.sort_by(|a, b| eye(a).total_cmp(&eye(b)));
        seen_in.truncate(2);
        self.points.push(NamedPoint { name: name.into(), position: place + noise, covariance, seen_in });
    }

    fn build(&self, text: &str) -> Model {
        let model = build(&rows(text), &self.points, &self.photographs);
        assert_eq!(model.refused, [], "{text}");
        model
    }
}

fn measured(model: &Model, name: &str) -> (f64, f64) {
    let measure = model.shapes[0].measures.iter().find(|m| m.name == name).unwrap();
    (measure.value, measure.sigma)
}

fn assert_near(model: &Model, name: &str, truth: f64, most_m: f64) {
    let (value, sigma) = measured(model, name);
    assert!((value - truth).abs() < most_m, "{name}: {value} +- {sigma}, truly {truth}");
    assert!(sigma > 0.0 && (value - truth).abs() < 4.0 * sigma, "{name}: {value} +- {sigma}, truly {truth}");
}

/// Closed, wound alike everywhere, and outwards.
fn assert_solid(part: &Part, volume_m3: f64, tolerance: f64) {
    part.mesh.validate().unwrap();
    assert_eq!(part.open_edges, 0, "{}", part.name);
    let at = places(&part.mesh.positions, 0.0);
    Edges::new(&part.mesh.triangles, &at, |_| true).for_each(|ends, sides| {
        let ways: Vec<bool> = sides.map(|side| side.down).collect();
        assert!(ways.len() == 2 && ways[0] != ways[1], "{}: edge {ends:?} {ways:?}", part.name);
    });
    let corner = |v: u32| part.mesh.positions[v as usize].as_dvec3();
    let six: f64 = part.mesh.triangles.iter().map(|t| t.map(corner)).map(|[a, b, c]| a.dot(b.cross(c))).sum();
    assert!((six / 6.0 / volume_m3 - 1.0).abs() < tolerance, "{}: {} m3, not {volume_m3}", part.name, six / 6.0);
    // laid flat, faces keep their size
    for (t, flat) in part.flat.iter().enumerate() {
        let [a, b, c] = part.mesh.corners(t);
        let truth = (b - a).cross(c - a).length();
        let laid = (flat[1] - flat[0]).perp_dot(flat[2] - flat[0]).abs();
        assert!((laid / truth - 1.0).abs() < 0.3, "{}: triangle {t} is {truth} and laid flat {laid}", part.name);
    }
}

fn turned(angle: f64) -> DMat3 {
    DMat3::from_cols(
        DVec3::new(libm::cos(angle), 0.0, -libm::sin(angle)),
        DVec3::Y,
        DVec3::new(libm::sin(angle), 0.0, libm::cos(angle)),
    )
}

#[test]
fn a_box_needs_not_all_of_its_corners() {
    let mut yard = Yard::new();
    let frame = turned(0.4);
    let corner = |x: f64, y: f64, z: f64| DVec3::new(1.0, 2.0, 3.0) + frame * DVec3::new(x * 2.0, y, z * 1.5);
    for (name, [x, y, z]) in [("a", [-1, -1, 1]), ("b", [1, -1, 1]), ("c", [1, -1, -1]), ("e", [-1, 1, 1]), ("f", [1, 1, 1])] {
        yard.mark(name, corner(f64::from(x), f64::from(y), f64::from(z)));
    }
    yard.mark("on top", corner(0.3, 1.0, -0.6));
    let text = r#"
        [[shape]]
        name = "altar"
        kind = "box"
        points = ["a", "b", "c", "-", "e", "f", "-", "-"]
        on = { top = ["on top"] }
        watertight = true
    "#;
    let model = yard.build(text);
    assert_near(&model, "length_m", 4.0, 0.015);
    assert_near(&model, "height_m", 2.0, 0.015);
    assert_near(&model, "width_m", 3.0, 0.02);
    assert_solid(&model.parts[0], 24.0, 0.02);
    assert_eq!(model.parts[0].mesh.triangles.len(), 12);
    let residuals = &model.shapes[0].points;
    assert_eq!(residuals.len(), 6);
    assert!(residuals.iter().all(|r| r.off_m < 5.0 * SIGMA_M && r.photographs.len() == 2));
    assert!(residuals.iter().flat_map(|r| &r.photographs).all(|p| p.off_px > 0.0 && p.off_px < 6.0));
    // in the wrong order it would be inside out
    let wrong = text.replace(r#"["a", "b", "c", "-", "e", "f", "-", "-"]"#, r#"["b", "a", "-", "c", "f", "e", "-", "-"]"#);
    let refused = build(&rows(&wrong), &yard.points, &yard.photographs).refused;
    assert!(refused[0].to_string().contains("another order"), "{}", refused[0]);
}

#[test]
fn edges_in_a_photograph_tell_a_size_that_no_corner_does() {
    let mut yard = Yard::new();
    let sign = |bit: usize| if bit == 1 { 1.0 } else { -1.0 };
    let corner = |c: [usize; 3]| DVec3::new(sign(c[0]) * 2.0, 1.0 + sign(c[1]), sign(c[2]) * 1.5);
    // a coarse mark of the top, and the top's edges in two photographs
    for (name, c) in [("a", [0, 0, 1]), ("b", [1, 0, 1]), ("c", [1, 0, 0]), ("t", [1, 1, 1])] {
        yard.mark(name, corner(c));
    }
    yard.points[3].position += DVec3::new(0.02, 0.15, 0.02);
    yard.points[3].covariance = DMat3::from_diagonal(DVec3::splat(0.1 * 0.1));
    let mut edges = Vec::new();
    for photograph in [1, 2] {
        let camera = yard.photographs[photograph].1;
        for (between, ends) in [([4, 5], [[0, 1, 1], [1, 1, 1]]), ([5, 6], [[1, 1, 1], [1, 1, 0]])] {
            let [a, b] = ends.map(corner);
            let [from, to] = [0.2, 0.7].map(|part| camera.project(a.lerp(b, part)).unwrap().to_array());
            edges.push(format!("{{ photograph = \"{photograph}.jpg\", from = {from:?}, to = {to:?}, between = {between:?} }}"));
        }
    }
    let text = |edges: &str| {
        format!(
            "[[shape]]\nname = \"block\"\nkind = \"box\"\npoints = [\"a\", \"b\", \"c\", \"-\", \"-\", \"t\", \"-\", \"-\"]\nedges = [{edges}]"
        )
    };
    let with = yard.build(&text(&edges.join(", ")));
    assert_near(&with, "height_m", 2.0, 0.02);
    assert_eq!(with.shapes[0].edges.len(), 4);
    assert!(with.shapes[0].edges.iter().all(|edge| edge.off_px < 3.0), "{:?}", with.shapes[0].edges);
    let (without, _) = measured(&yard.build(&text("")), "height_m");
    assert!((without - 2.0).abs() > 0.05, "the edges are what tells: {without}");
    let unnamed = text(&edges[0].replace(", between = [4, 5]", ""));
    assert!(build(&rows(&unnamed), &yard.points, &yard.photographs).refused[0].to_string().contains("between which"));
}

#[test]
fn a_wrong_mark_is_named_and_hardly_counts() {
    let mut yard = Yard::new();
    let sign = |bit: usize, i: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    let order = [[0, 0, 1], [1, 0, 1], [1, 0, 0], [0, 0, 0], [0, 1, 1], [1, 1, 1], [1, 1, 0], [0, 1, 0]];
    for (i, c) in order.iter().enumerate() {
        yard.mark(&format!("p{i}"), DVec3::new(sign(0, c[0]), sign(0, c[1]), sign(0, c[2])) * DVec3::new(2.0, 1.0, 1.0));
    }
    yard.points[6].position += DVec3::new(0.3, -0.2, 0.4);
    let names: Vec<String> = (0..8).map(|i| format!("\"p{i}\"")).collect();
    let model = yard.build(&format!("[[shape]]\nname = \"block\"\nkind = \"box\"\npoints = [{}]", names.join(", ")));
    assert_near_loose(&model, "length_m", 4.0, 0.02);
    assert_near_loose(&model, "width_m", 2.0, 0.02);
    let notes = &model.shapes[0].notes;
    assert!(notes.len() == 1 && notes[0].contains("\"p6\""), "{notes:?}");
}

fn assert_near_loose(model: &Model, name: &str, truth: f64, most_m: f64) {
    let (value, sigma) = measured(model, name);
    assert!((value - truth).abs() < most_m, "{name}: {value} +- {sigma}, truly {truth}");
}

#[test]
fn a_roof_of_two_slopes_stands_upright() {
    let mut yard = Yard::new();
    let frame = turned(-0.7);
    let at = |x: f64, y: f64, z: f64| DVec3::new(0.0, 4.0, 0.0) + frame * DVec3::new(x * 3.0, y * 0.8, z * 2.0);
    for (name, [x, y, z]) in
        [("e0", [-1, -1, 1]), ("e1", [1, -1, 1]), ("e2", [1, -1, -1]), ("r0", [-1, 1, 0]), ("r1", [1, 1, 0])]
    {
        yard.mark(name, at(f64::from(x), f64::from(y), f64::from(z)));
    }
    let model = yard.build(
        r#"[[shape]]
        name = "roof"
        kind = "gable"
        upright = true
        points = ["e0", "e1", "e2", "-", "r0", "r1"]"#,
    );
    assert_near(&model, "length_m", 6.0, 0.015);
    assert_near(&model, "height_m", 1.6, 0.015);
    assert_near(&model, "width_m", 4.0, 0.02);
    assert_solid(&model.parts[0], 0.5 * 6.0 * 1.6 * 4.0, 0.02);
    assert_eq!(model.parts[0].mesh.triangles.len(), 8);
}

/// A pixel of a column's left or right edge at a height: the ray that just touches it, found from outside.
fn edge_pixel(camera: &Camera, foot: DVec3, radius: impl Fn(f64) -> f64, height: f64, side: f64) -> DVec2 {
    let middle = camera.project(foot + DVec3::Y * height).unwrap();
    let meets = |offset: f64| {
        let (origin, along) = camera.ray(middle + DVec2::new(side * offset, 0.0));
        let distance = (foot - origin).length();
        (0..2000).any(|i| {
            let p = origin + along * (distance - 1.5 + 3.0 * f64::from(i) / 2000.0);
            let out = p - foot;
            DVec2::new(out.x, out.z).length() < radius(out.y)
        })
    };
    let (mut within, mut without) = (0.0, 600.0);
    for _ in 0..40 {
        let between = 0.5 * (within + without);
        if meets(between) { within = between } else { without = between }
    }
    middle + DVec2::new(side * within, 0.0)
}

#[test]
fn a_column_is_found_from_its_edges_and_stands_eight_times() {
    let mut yard = Yard::new();
    let foot = DVec3::new(2.0, 0.5, -1.0);
    let radius = |height: f64| 0.5 - 0.1 * height / 4.0 + 4.0 * 0.02 * (height / 4.0) * (1.0 - height / 4.0);
    yard.mark("base", foot + DVec3::new(0.5, 0.0, 0.0));
    yard.mark("neck", foot + DVec3::new(0.0, 4.0, 0.4));
    yard.mark("axis foot", DVec3::new(0.0, 0.0, 0.0));
    yard.mark("axis head", DVec3::new(0.0, 3.0, 0.0));
    let mut edges = Vec::new();
    for photograph in [0, 2, 4] {
        let camera = yard.photographs[photograph].1;
        for side in [-1.0, 1.0] {
            for (low, high) in [(0.2, 2.0), (2.0, 3.8)] {
                let [from, to] = [low, high].map(|height| edge_pixel(&camera, foot, radius, height, side));
                let shaken = [from, to].map(|p| [p.x + 0.5 * yard.normal(), p.y]);
                edges.push(format!("{{ photograph = \"{photograph}.jpg\", from = {:?}, to = {:?} }}", shaken[0], shaken[1]));
            }
        }
    }
    let text = format!(
        "[[shape]]\nname = \"column\"\nkind = \"column\"\nbottom = [\"base\"]\ntop = [\"neck\"]\nentasis = true\nwatertight = true\n\
         sides = 20\nedges = [{}]\nrepeat = {{ count = 8, around = [\"axis foot\", \"axis head\"] }}",
        edges.join(", ")
    );
    let model = yard.build(&text);
    assert_near(&model, "lower_radius_m", 0.5, 0.006);
    assert_near(&model, "upper_radius_m", 0.4, 0.006);
    assert_near(&model, "swelling_m", 0.02, 0.006);
    assert_near(&model, "height_m", 4.0, 0.02);
    assert_eq!(model.shapes[0].edges.len(), 12);
    assert!(model.shapes[0].edges.iter().all(|edge| edge.off_px < 2.0));
    let one: f64 = (0..1000).map(|i| radius(4.0 * (f64::from(i) + 0.5) / 1000.0).powi(2) * std::f64::consts::PI * 0.004).sum();
    assert_solid(&model.parts[0], 8.0 * one, 0.02);
    let (low, high) = model.parts[0].mesh.bounds().unwrap();
    // two metres and one from the middle, turned by eighths
    assert!((low.x + 5.0_f32.sqrt() + 0.45).abs() < 0.1 && (high.x - 5.0_f32.sqrt() - 0.45).abs() < 0.1, "{low} {high}");
}

#[test]
fn a_cylinder_is_found_from_points_alone() {
    let mut yard = Yard::new();
    let axis = DVec3::new(0.05, 1.0, -0.03) / DVec3::new(0.05, 1.0, -0.03).length();
    let (x, z) = axis.any_orthonormal_pair();
    let at = |angle: f64, height: f64| {
        DVec3::new(1.0, 0.0, 2.0) + axis * height + (x * libm::cos(angle) + z * libm::sin(angle)) * 0.7
    };
    for i in 0..4 {
        yard.mark(&format!("low {i}"), at(f64::from(i), 0.0));
        yard.mark(&format!("high {i}"), at(f64::from(i) + 0.5, 3.0));
    }
    let model = yard.build(
        r#"[[shape]]
        name = "drum"
        kind = "cylinder"
        bottom = ["low 0", "low 1", "low 2", "low 3"]
        top = ["high 0", "high 1", "high 2", "high 3"]
        watertight = true"#,
    );
    assert_near(&model, "lower_radius_m", 0.7, 0.012);
    assert_near(&model, "height_m", 3.0, 0.012);
    assert_solid(&model.parts[0], std::f64::consts::PI * 0.49 * 3.0, 0.03);
}

#[test]
fn an_arch_has_its_radii_and_closes() {
    let mut yard = Yard::new();
    let frame = turned(0.3);
    let at = |angle: f64, radius: f64, back: f64| {
        DVec3::new(0.0, 2.0, 0.0) + frame * DVec3::new(radius * libm::cos(angle), radius * libm::sin(angle), -back)
    };
    let pi = std::f64::consts::PI;
    for (i, angle) in [0.0, 0.3, 0.5, 0.8, 1.0].into_iter().enumerate() {
        yard.mark(&format!("in{i}"), at(angle * pi, 1.5, 0.0));
        yard.mark(&format!("out{i}"), at(angle * pi, 2.0, 0.0));
    }
    yard.mark("behind", at(0.2 * pi, 1.5, 0.6));
    let text = r#"[[shape]]
        name = "gate"
        kind = "arch"
        inner = ["in0", "in1", "in2", "in3", "in4"]
        outer = ["out1", "out2", "out3"]
        back = ["behind"]
        sides = 24"#;
    for text in
        [text.to_string(), text.replace(r#"["in0", "in1", "in2", "in3", "in4"]"#, r#"["in4", "in3", "in2", "in1", "in0"]"#)]
    {
        let model = yard.build(&text);
        assert_near(&model, "inner_radius_m", 1.5, 0.01);
        assert_near(&model, "outer_radius_m", 2.0, 0.01);
        assert_near(&model, "depth_m", 0.6, 0.02);
        assert_solid(&model.parts[0], 0.5 * pi * (4.0 - 2.25) * 0.6, 0.03);
        let (low, high) = model.parts[0].mesh.bounds().unwrap();
        assert!((low.y - 2.0).abs() < 0.05 && (high.y - 4.0).abs() < 0.05, "the half with the marks stands");
    }
}

#[test]
fn a_vase_is_turned_about_the_axis_of_its_rings() {
    let mut yard = Yard::new();
    let profile = [(0.0, 0.4), (0.3, 0.7), (0.9, 0.5), (1.0, 0.55)];
    for (ring, (height, radius)) in profile.into_iter().enumerate() {
        for i in 0..4 {
            let angle = 1.7 * f64::from(i) + ring as f64;
            let out = DVec3::new(libm::cos(angle), 0.0, libm::sin(angle)) * radius;
            yard.mark(&format!("{ring}-{i}"), DVec3::new(3.0, 1.0, 3.0) + out + DVec3::Y * height);
        }
    }
    let rings: Vec<String> = (0..4).map(|r| format!("[\"{r}-0\", \"{r}-1\", \"{r}-2\", \"{r}-3\"]")).collect();
    let model = yard.build(&format!(
        "[[shape]]\nname = \"vase\"\nkind = \"revolution\"\nwatertight = true\nsides = 32\nrings = [{}]",
        rings.join(", ")
    ));
    let radii: Vec<f64> = model.shapes[0].measures.iter().map(|m| m.value).collect();
    assert!(profile.iter().zip(&radii).all(|((_, truth), radius)| (truth - radius).abs() < 0.012), "{radii:?}");
    let cone = |[(h0, a), (h1, b)]: [(f64, f64); 2]| std::f64::consts::PI / 3.0 * (h1 - h0) * (a * a + a * b + b * b);
    let volume: f64 = profile.windows(2).map(|w| cone([w[0], w[1]])).sum();
    assert_solid(&model.parts[0], volume, 0.05);
}

#[test]
fn an_extrusion_and_its_mirror_image_face_outwards() {
    let mut yard = Yard::new();
    let profile = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)];
    for (i, (x, y)) in profile.into_iter().enumerate() {
        yard.mark(&format!("s{i}"), DVec3::new(x + 1.0, y, 0.0));
    }
    yard.mark("far", DVec3::new(1.0, 0.0, -3.0));
    yard.mark("image", DVec3::new(-1.0, 0.0, 0.0));
    for order in ["\"s0\", \"s1\", \"s2\", \"s3\", \"s4\", \"s5\"", "\"s5\", \"s4\", \"s3\", \"s2\", \"s1\", \"s0\""] {
        let model = yard.build(&format!(
            "[[shape]]\nname = \"stairs\"\nkind = \"extrusion\"\nwatertight = true\npoints = [{order}]\nalong = [\"s0\", \"far\"]\n\
             mirror = [\"s0\", \"image\"]"
        ));
        assert_solid(&model.parts[0], 2.0 * 9.0, 0.02);
        let low = model.parts[0].mesh.bounds().unwrap().0;
        assert!((low.x + 3.0).abs() < 0.05);
    }
}

#[test]
fn polygons_of_a_part_share_vertices_and_close() {
    let mut yard = Yard::new();
    let corners = [("a", -1, -1), ("b", 1, -1), ("c", 1, 1), ("d", -1, 1)];
    for (name, x, z) in corners {
        yard.mark(name, DVec3::new(f64::from(x), 0.0, f64::from(z)));
    }
    yard.mark("apex", DVec3::new(0.0, 1.5, 0.0));
    // whichever way they are drawn
    let rings = [["a", "b", "apex"], ["c", "b", "apex"], ["c", "d", "apex"], ["a", "d", "apex"]];
    let mut text = String::from(
        "[[shape]]\nname = \"floor\"\nkind = \"polygon\"\npart = \"pyramid\"\npoints = [\"a\", \"b\", \"c\", \"d\"]\nwatertight = true\n",
    );
    for ring in rings {
        text += &format!("[[shape]]\nname = \"side {}\"\nkind = \"polygon\"\npart = \"pyramid\"\npoints = {ring:?}\n", ring[0]);
    }
    let model = yard.build(&text);
    assert_eq!(model.parts.len(), 1);
    assert_eq!(model.parts[0].mesh.positions.len(), 5);
    assert_solid(&model.parts[0], 2.0, 0.02);
    // without its floor it is open
    let open = yard.build(&text[text.find("[[shape]]\nname = \"side").unwrap()..]);
    assert_eq!(open.parts[0].open_edges, 4);
}

#[test]
fn a_bent_polygon_is_told_and_faces_its_photographs() {
    let mut yard = Yard::new();
    for (name, x, y, z) in [("a", -1.0, 0.0, 2.0), ("b", -1.0, 2.0, 2.0), ("c", 1.0, 2.0, 2.3), ("d", 1.0, 0.0, 2.0)] {
        yard.mark(name, DVec3::new(x, y, z));
    }
    for point in &mut yard.points {
        point.seen_in = vec![1];
    }
    let model = yard.build("[[shape]]\nname = \"wall\"\nkind = \"polygon\"\npoints = [\"a\", \"b\", \"c\", \"d\"]");
    let notes = model.shapes[0].notes.join("; ");
    assert!(notes.contains("is not flat") && notes.contains(" m off"), "{notes}");
    let [a, b, c] = model.parts[0].mesh.corners(0).map(|p| p.as_dvec3());
    assert!((b - a).cross(c - a).dot(yard.photographs[1].1.centre() - a) > 0.0);
    for (order, toward) in [("\"a\", \"b\", \"c\", \"d\"", -1.0), ("\"d\", \"c\", \"b\", \"a\"", 1.0)] {
        let listed =
            yard.build(&format!("[[shape]]\nname = \"wall\"\nkind = \"polygon\"\npoints = [{order}]\nas_listed = true"));
        let [a, b, c] = listed.parts[0].mesh.corners(0).map(|p| p.as_dvec3());
        assert!((b - a).cross(c - a).z * toward > 0.0, "its front is as its points run, whoever saw it");
    }
    let flat =
        yard.build("[[shape]]\nname = \"wall\"\nkind = \"polygon\"\npoints = [\"a\", \"b\", \"c\", \"d\"]\nflatten = true");
    let positions: Vec<DVec3> = flat.parts[0].mesh.positions.iter().map(|p| p.as_dvec3()).collect();
    let normal = (positions[1] - positions[0]).cross(positions[2] - positions[0]).try_normalize().unwrap();
    assert!(normal.dot(positions[3] - positions[0]).abs() < 1e-5);
}

#[test]
fn what_is_missing_is_said_and_the_rest_is_kept() {
    let mut yard = Yard::new();
    for (name, x) in [("a", 0.0), ("b", 1.0), ("c", 2.0)] {
        yard.mark(name, DVec3::new(x, x * x, 0.0));
    }
    for (name, x, y) in [("x", 0.0, 0.0), ("y", 1.0, 0.1), ("z", 1.1, 1.0), ("w", 0.0, 1.2)] {
        yard.mark(name, DVec3::new(x, y, 0.0));
    }
    yard.points.push(NamedPoint { name: "lost".into(), position: DVec3::NAN, covariance: DMat3::IDENTITY, seen_in: vec![] });
    let text = r#"
        [[shape]]
        name = "good"
        kind = "polygon"
        points = ["a", "b", "c"]
        [[shape]]
        name = "1"
        kind = "polygon"
        points = ["a", "b", "nowhere"]
        [[shape]]
        name = "2"
        kind = "polygon"
        points = ["a", "b"]
        [[shape]]
        name = "3"
        kind = "polygon"
        points = ["a", "b", "lost"]
        [[shape]]
        name = "4"
        kind = "column"
        bottom = ["a"]
        top = ["b"]
        [[shape]]
        name = "5"
        kind = "column"
        bottom = ["a"]
        top = ["b"]
        edges = [{ photograph = "none.jpg", from = [1.0, 2.0], to = [3.0, 4.0] }]
        [[shape]]
        name = "6"
        kind = "polygon"
        points = ["a", "b", "c"]
        entasis = true
        [[shape]]
        name = "7"
        kind = "box"
        points = ["a", "b", "c", "-", "-", "-", "-", "-"]
        [[shape]]
        name = "crossed"
        kind = "polygon"
        points = ["x", "z", "y", "w"]
        [[shape]]
        name = "8"
        kind = "polygon"
        points = ["a", "b", "c"]
        repeat = { count = 3 }
    "#;
    let model = build(&rows(text), &yard.points, &yard.photographs);
    assert_eq!(model.parts.len(), 1);
    let told: Vec<String> = model.refused.iter().map(ToString::to_string).collect();
    let words = [
        "nowhere",
        "needs three",
        "not finite",
        "needs one of these",
        "none.jpg",
        "entasis",
        "height",
        "sides cross",
        "step, span",
    ];
    assert_eq!(told.len(), words.len());
    for (told, word) in told.iter().zip(words) {
        assert!(told.contains(word), "{told} does not say {word}");
    }
    assert!(toml::from_str::<Table>("[[shape]]\nname = \"x\"\nkind = \"polygon\"\ncolour = 3").is_err());
}
