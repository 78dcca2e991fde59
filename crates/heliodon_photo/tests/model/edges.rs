//! Edges as witnesses of what no point tells well enough.

use super::*;

/// Says that a point was marked badly, and marks it so.
fn blur(yard: &mut Yard, name: &str, off: DVec3, sigma_m: f64) {
    let point = yard.points.iter_mut().find(|point| point.name == name).unwrap();
    point.position += off;
    point.covariance = DMat3::from_diagonal(DVec3::splat(sigma_m * sigma_m));
}

/// An `edges` entry through the pictures of two places.
fn edge(yard: &Yard, photograph: usize, ends: [DVec3; 2], more: &str) -> String {
    let [from, to] = ends.map(|place| yard.photographs[photograph].1.project(place).unwrap().to_array());
    format!("{{ photograph = \"{photograph}.jpg\", from = {from:?}, to = {to:?}{more} }}")
}

#[test]
fn they_move_a_corner_that_two_polygons_share() {
    let mut yard = Yard::new();
    let corners = [[-1.0, 0.0, 2.0], [1.0, 0.0, 2.0], [1.0, 2.0, 2.0], [-1.0, 2.0, 2.0], [1.0, 0.0, -1.0], [1.0, 2.0, -1.0]];
    let corners = corners.map(DVec3::from);
    for (name, corner) in ["a", "b", "c", "d", "e", "f"].into_iter().zip(corners) {
        yard.mark(name, corner);
    }
    blur(&mut yard, "c", DVec3::new(0.06, -0.1, 0.05), 0.1);
    let ends = |from: usize, to: usize| [0.1, 0.9].map(|part| corners[from].lerp(corners[to], part));
    let front: Vec<String> = [1, 2].map(|photograph| edge(&yard, photograph, ends(1, 2), ", between = [1, 2]")).to_vec();
    let top: Vec<String> = [1, 2].map(|photograph| edge(&yard, photograph, ends(2, 3), ", between = [2, 3]")).to_vec();
    let text = |edges: &str| {
        format!(
            "[[shape]]\nname = \"front\"\npart = \"hut\"\nkind = \"polygon\"\npoints = [\"a\", \"b\", \"c\", \"d\"]\nedges = [{edges}]\n\
             [[shape]]\nname = \"side\"\npart = \"hut\"\nkind = \"polygon\"\npoints = [\"b\", \"e\", \"f\", \"c\"]"
        )
    };
    let nearest = |model: &Model| {
        let off = |p: &glam::Vec3| p.as_dvec3().distance(corners[2]);
        model.parts[0].mesh.positions.iter().map(off).fold(f64::INFINITY, f64::min)
    };
    let model = yard.build(&text(&[front, top].concat().join(", ")));
    assert!(nearest(&model) < 0.015, "{} m off", nearest(&model));
    assert_eq!(model.parts[0].mesh.positions.len(), 6, "both polygons have the corner where the edges have it");
    let edges = &model.shapes[0].edges;
    assert!(edges.len() == 4 && edges.iter().all(|edge| edge.off_px < 2.0), "{edges:?}");
    let without = nearest(&yard.build(&text("")));
    assert!(without > 0.08, "the edges are what tells: {without}");
    let wrong = edge(&yard, 1, ends(1, 2), ", between = [1, 9]");
    let refused = build(&rows(&text(&wrong)), &yard.points, &yard.photographs).refused;
    assert!(refused[0].to_string().contains("between the corners 1 and 9"), "{}", refused[0]);
}

#[test]
fn they_tell_what_an_extrusion_is_drawn_from() {
    let mut yard = Yard::new();
    let profile = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.5));
    for (i, corner) in profile.into_iter().enumerate() {
        yard.mark(&format!("s{i}"), corner);
    }
    yard.mark("far", profile[0] - DVec3::Z * 3.0);
    for name in ["s2", "s3"] {
        blur(&mut yard, name, DVec3::Y * 0.12, 0.1);
    }
    let edges = [1, 2].map(|photograph| edge(&yard, photograph, [profile[2], profile[3]], ", between = [2, 3]"));
    let text = format!(
        "[[shape]]\nname = \"step\"\nkind = \"extrusion\"\nwatertight = true\npoints = [\"s0\", \"s1\", \"s2\", \"s3\"]\n\
         along = [\"s0\", \"far\"]\nedges = [{}]",
        edges.join(", ")
    );
    let model = yard.build(&text);
    assert_solid(&model.parts[0], 6.0, 0.02);
}

#[test]
fn they_tell_the_rims_of_an_arch() {
    let mut yard = Yard::new();
    let frame = turned(0.3);
    let at = |angle: f64, radius: f64, back: f64| {
        DVec3::new(0.0, 2.0, 0.0) + frame * DVec3::new(radius * libm::cos(angle), radius * libm::sin(angle), -back)
    };
    let pi = std::f64::consts::PI;
    for (i, angle) in [0.0, 0.5, 1.0].into_iter().enumerate() {
        yard.mark(&format!("in{i}"), at(angle * pi, 1.5, 0.0));
    }
    yard.mark("out", at(0.5 * pi, 2.0, 0.0));
    blur(&mut yard, "out", DVec3::Y * 0.15, 0.1);
    let seen = |of: &str, radius: f64| {
        let ends = [[0.15, 0.3], [0.6, 0.85]].map(|ends| ends.map(|angle| at(angle * pi, radius, 0.0)));
        let each = ends.iter().flat_map(|&ends| [1, 2].map(|photograph| (photograph, ends)));
        each.map(|(photograph, ends)| edge(&yard, photograph, ends, &format!(", of = \"{of}\""))).collect::<Vec<_>>().join(", ")
    };
    let text = |edges: &str| {
        format!(
            "[[shape]]\nname = \"gate\"\nkind = \"arch\"\ninner = [\"in0\", \"in1\", \"in2\"]\nouter = [\"out\"]\ndepth_m = 0.6\nedges = [{edges}]"
        )
    };
    let model = yard.build(&text(&[seen("inner", 1.5), seen("outer", 2.0)].join(", ")));
    assert_near(&model, "inner_radius_m", 1.5, 0.008);
    assert_near(&model, "outer_radius_m", 2.0, 0.015);
    assert_eq!(model.shapes[0].edges.len(), 8);
    let (without, _) = measured(&yard.build(&text("")), "outer_radius_m");
    assert!(without > 2.1, "the edges are what tells: {without}");
    let unnamed = text(&edge(&yard, 1, [at(0.5, 2.0, 0.0), at(0.9, 2.0, 0.0)], ""));
    assert!(build(&rows(&unnamed), &yard.points, &yard.photographs).refused[0].to_string().contains("\"inner\" or \"outer\""));
}

#[test]
fn they_tell_the_radii_of_a_vase() {
    let mut yard = Yard::new();
    let foot = DVec3::new(1.0, 1.0, 0.5);
    let profile = [(0.0, 0.4), (0.5, 0.7), (1.5, 0.5), (1.8, 0.55)];
    let radius = |height: f64| {
        let above = profile.partition_point(|&(h, _)| h < height).clamp(1, 3);
        let ((h0, a), (h1, b)) = (profile[above - 1], profile[above]);
        if (0.0..=1.8).contains(&height) { a + (b - a) * (height - h0) / (h1 - h0) } else { 0.0 }
    };
    yard.mark("axis foot", foot);
    yard.mark("axis head", foot + DVec3::Y * 1.8);
    for (ring, (height, radius)) in profile.into_iter().enumerate() {
        yard.mark(&format!("r{ring}"), foot + DVec3::new(radius, height, 0.0));
    }
    // nobody could say where on its belly a point is
    blur(&mut yard, "r1", DVec3::X * 0.15, 0.1);
    let mut edges = Vec::new();
    for photograph in [0, 2, 4] {
        let camera = yard.photographs[photograph].1;
        for side in [-1.0, 1.0] {
            for (low, high) in [(0.15, 0.45), (0.6, 1.4)] {
                let [from, to] = [low, high].map(|height| edge_pixel(&camera, foot, radius, height, side).to_array());
                edges.push(format!("{{ photograph = \"{photograph}.jpg\", from = {from:?}, to = {to:?} }}"));
            }
        }
    }
    let text = |edges: &str| {
        format!(
            "[[shape]]\nname = \"vase\"\nkind = \"revolution\"\naxis = [\"axis foot\", \"axis head\"]\nupright = true\n\
             rings = [[\"r0\"], [\"r1\"], [\"r2\"], [\"r3\"]]\nedges = [{edges}]"
        )
    };
    let radii = |model: &Model| model.shapes[0].measures.iter().map(|m| m.value).collect::<Vec<f64>>();
    let model = yard.build(&text(&edges.join(", ")));
    let found = radii(&model);
    assert!(profile.iter().zip(&found).all(|((_, truth), radius)| (truth - radius).abs() < 0.015), "{found:?}");
    assert!(model.shapes[0].edges.iter().all(|edge| edge.off_px < 3.0), "{:?}", model.shapes[0].edges);
    assert!((radii(&yard.build(&text("")))[1] - 0.7).abs() > 0.1, "the edges are what tells");
}
