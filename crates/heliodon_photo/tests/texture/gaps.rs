//! What no photograph saw is filled from what was seen about it, over the surface.

use crate::scene::look;
use crate::{BENCH, code, probes};
use glam::Vec3;
use heliodon_photo::texture::{GUESSED, Survey, TextureParams, Textured};

/// The parts, by their index.
const BLOCK: usize = 0;
const COLUMN: usize = 1;
const FLOOR: usize = 2;

/// A model whose texels have the colours of a function of part and place, which knows nothing of some.
fn painted(name: &str, known: impl Fn(usize, Vec3) -> Option<Vec3>) -> Textured {
    let bench = &*BENCH;
    let photographs = bench.photographs();
    let params = TextureParams { most_side: 1024, ..TextureParams::default() };
    let survey = Survey::new(&bench.parts, &[&bench.panel], &photographs, &params).unwrap();
    let mut part_of = vec![0; survey.places().len()];
    survey.faces().for_each(|(part, texels)| part_of[texels].fill(part));
    let colors: Vec<Option<Vec3>> = part_of.into_iter().zip(survey.places()).map(|(part, (p, _))| known(part, p)).collect();
    let textured = survey.painted(&colors, Vec::new());
    look(name, &textured.atlas.image);
    look(&format!("evidence-{name}"), &textured.evidence.image());
    let guessed = textured.evidence.codes.iter().filter(|code| **code == GUESSED).count();
    assert_eq!(guessed, colors.iter().filter(|color| color.is_none()).count(), "what was filled is marked");
    textured
}

/// The linear colours of a part's guessed places.
fn guessed(textured: &Textured, part: usize) -> Vec<(Vec3, Vec3)> {
    let [width, height] = [textured.evidence.width, textured.evidence.height];
    let cell = |x: f32, count: u32| ((x * count as f32) as u32).min(count - 1);
    let of_part = probes(textured).into_iter().filter(|probe| probe.2 == part && code(textured, probe.1) == GUESSED);
    of_part.map(|(p, uv, _)| (p, textured.linear[(cell(uv.y, height) * width + cell(uv.x, width)) as usize])).collect()
}

/// How far colours are off at most, and how many were looked at.
fn off(found: &[(Vec3, Vec3)], truth: impl Fn(Vec3) -> Vec3) -> (f32, usize) {
    (found.iter().map(|(p, found)| (*found - truth(*p)).abs().max_element()).fold(0.0, f32::max), found.len())
}

/// The length of the way around the block from its left front edge, and its height: both are straight where the block is laid flat.
fn around_block(p: Vec3) -> Vec3 {
    let sides = [0.4 - p.z, -p.x, p.z + 1.2, p.x + 2.4].map(f32::abs);
    let nearest = (0..4).min_by(|&a, &b| sides[a].total_cmp(&sides[b])).unwrap();
    let way = [p.x + 2.4, 2.4 + 0.4 - p.z, 4.0 - p.x, 6.4 + p.z + 1.2][nearest];
    Vec3::new(0.3 * way, 0.2 + 0.4 * p.y, 0.5)
}

#[test]
fn a_slope_goes_on_through_a_hole_over_an_edge() {
    // over the edge of the front and the right side, which are two charts
    let hole = Vec3::new(0.0, 0.8, 0.4);
    let known = |part: usize, p: Vec3| {
        let is_side = p.y > 0.051 && p.y < 1.549;
        (part != BLOCK || p.distance(hole) > 0.5)
            .then(|| if part == BLOCK && is_side { around_block(p) } else { Vec3::splat(0.5) })
    };
    let textured = painted("gap-slope.png", known);
    let found = guessed(&textured, BLOCK);
    let (worst, count) = off(&found, around_block);
    println!("a slope over an edge: off by {worst:.4} at most, {count} places");
    let (low, high) = found.iter().fold((f32::MAX, 0.0_f32), |(low, high), (_, c)| (low.min(c.x), high.max(c.x)));
    assert!(count > 500 && high - low > 0.25, "{count} {low} {high}");
    assert!(worst < 0.01, "{worst}");
}

#[test]
fn a_gap_around_a_column_closes_behind_it() {
    const HALF_M: f32 = 0.35;
    let angle = |p: Vec3| libm::atan2f(p.z - 0.3, p.x - 1.3);
    let wave = |p: Vec3, times: f32| Vec3::new(0.5 + times * libm::cosf(angle(p)), 0.5 + times * libm::sinf(angle(p)), 0.5);
    let is_band = |p: Vec3| (p.y - 1.2).abs() < HALF_M;
    let textured = painted("gap-column.png", |part, p| (part != COLUMN || !is_band(p)).then(|| wave(p, 0.4)));
    // a film between two rings on a cylinder of the column's radius there
    let radius_m = 0.45 - 0.09 * (1.2 - 0.05) / 2.45;
    let sag = |p: Vec3| libm::coshf((p.y - 1.2) / radius_m) / libm::coshf(HALF_M / radius_m);
    let (worst, count) = off(&guessed(&textured, COLUMN), |p| wave(p, 0.4 * sag(p)));
    println!("around a column: off by {worst:.4} at most, {count} places");
    assert!(count > 500 && worst < 0.03, "{count} {worst}");
}

#[test]
fn charts_that_merely_lie_side_by_side_know_nothing_of_one_another() {
    let (red, green) = (Vec3::X, Vec3::Y);
    let known = |part: usize, p: Vec3| match part {
        BLOCK => None,
        COLUMN => ((p.y - 1.0).abs() > 0.4).then_some(red),
        _ => (p.distance(Vec3::new(2.0, 0.0, 2.0)) > 0.6).then_some(green),
    };
    let textured = painted("gap-apart.png", known);
    for (part, color) in [(COLUMN, red), (FLOOR, green)] {
        let (worst, count) = off(&guessed(&textured, part), |_| color);
        assert!(count > 300 && worst < 1.0e-3, "part {part}: {worst}");
    }
    // nothing is known of the block: plainly the mean of all
    let block = guessed(&textured, BLOCK);
    let plain = block[0].1;
    assert!((plain.x + plain.y - 1.0).abs() < 1.0e-3 && plain.x > 0.02 && plain.y > 0.02, "{plain}");
    assert!(off(&block, |_| plain).0 < 1.0e-4);
}
