//! Receivers against the vertices in whose places they lie.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use crate::common;
use crate::common::{Lit, params};
use glam::Vec3;
use heliodon_light::{
    BouncedSun, CellLight, Channels, GatherBlock, KeptBounces, Layout, LightParams, RayVertices, Received, Receiving,
    SurfacePlace, VertexLight, gather, solve_all,
};
use heliodon_testkit::scenes::{cuboid, ground};
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A block on the ground, lit by a low sun and a high one.
fn lit() -> Lit {
    Lit::new(ground(6.0, 24).and(cuboid(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 2.0, 1.0), 6)), 0.5)
}

struct Solved {
    light: VertexLight,
    cells: CellLight,
    layout: Layout,
    sun: Option<BouncedSun>,
}

fn solve(lit: &Lit, suns: &[Vec3], params: &LightParams) -> Solved {
    solve_keeping(lit, suns, params, None)
}

fn solve_keeping(lit: &Lit, suns: &[Vec3], params: &LightParams, kept: Option<&dyn KeptBounces>) -> Solved {
    solve_blocks(lit, suns, params, kept).0
}

fn solve_blocks(lit: &Lit, suns: &[Vec3], params: &LightParams, kept: Option<&dyn KeptBounces>) -> (Solved, Vec<GatherBlock>) {
    let surfaces = lit.surfaces();
    let mut layout = Layout::new(&surfaces, params).unwrap();
    let sun = BouncedSun::new(&surfaces, &layout, suns, params).unwrap();
    let mut blocks = vec![gather(&surfaces, &layout, sun.as_ref(), 0..layout.points().len(), params).unwrap()];
    let backs = layout.add_back_sides(&surfaces, &blocks, params);
    blocks.push(gather(&surfaces, &layout, sun.as_ref(), backs, params).unwrap());
    let mut cells = CellLight::default();
    let (light, _) = solve_all(&surfaces, &layout, &blocks, sun.as_ref(), params, Some(&mut cells), kept).unwrap();
    (Solved { light, cells, layout, sun }, blocks)
}

/// A triangle's corner for each vertex that a triangle uses.
fn corners(lit: &Lit) -> Vec<(usize, SurfacePlace)> {
    let surfaces = lit.surfaces();
    let mut corners: Vec<Option<SurfacePlace>> = vec![None; surfaces.positions.len()];
    for (t, vertices) in surfaces.triangles.iter().enumerate() {
        for (vertex, (u, v)) in vertices.iter().zip([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]) {
            corners[*vertex as usize].get_or_insert(SurfacePlace { triangle: t as u32, u, v });
        }
    }
    corners.into_iter().enumerate().filter_map(|(vertex, place)| Some((vertex, place?))).collect()
}

/// Keeps what it is offered, up to a number of times, and hears how far light is.
#[derive(Default)]
struct Shelf {
    kept: Mutex<BTreeMap<usize, Vec<u8>>>,
    left: AtomicUsize,
    heard: Mutex<Vec<u64>>,
    /// Blocks with all hits, and how often one was asked for.
    blocks: Vec<Vec<u8>>,
    asked: AtomicUsize,
}

impl KeptBounces for Shelf {
    fn block(&self, number: usize) -> Option<Vec<u8>> {
        self.asked.fetch_add(1, Ordering::Relaxed);
        self.blocks.get(number).cloned()
    }

    fn take(&self, number: usize) -> Option<Vec<u8>> {
        self.kept.lock().unwrap().get(&number).cloned()
    }

    fn is_due(&self) -> bool {
        self.left.load(Ordering::Relaxed) > 0
    }

    fn keep(&self, number: usize, runs: &[&[u8]]) {
        self.left.fetch_sub(1, Ordering::Relaxed);
        self.kept.lock().unwrap().insert(number, runs.concat());
    }

    fn told(&self, done: u64) {
        self.heard.lock().unwrap().push(done);
    }
}

const SUNS: [Vec3; 3] = [Vec3::Y, Vec3::new(0.8, 0.6, 0.0), Vec3::new(0.0, 0.6, -0.8)];

#[test]
fn light_goes_on_bouncing_from_wherever_it_was_broken_off() {
    let lit = lit();
    // 4 coefficients and 3 functions of 3 channels: 16 lanes and 5 more
    let params = LightParams { channels: Channels::Rgb, bounces: 3, ..params(64, 4) };
    let whole = solve(&lit, &SUNS, &params);
    let passes = params.bounce_passes(whole.sun.as_ref().unwrap().function_count());
    assert_eq!(passes, 6);
    let is_same = |other: &Solved| other.light == whole.light && other.cells == whole.cells;
    for kept in 1..=passes as usize {
        let shelf = Shelf { left: kept.into(), ..Shelf::default() };
        let heard = || std::mem::take(&mut *shelf.heard.lock().unwrap());
        solve_keeping(&lit, &SUNS, &params, Some(&shelf));
        assert_eq!(heard(), [0, 1, 2, 3, 3, 4, 5, 6]);
        let again = solve_keeping(&lit, &SUNS, &params, Some(&shelf));
        assert!(is_same(&again), "broken off after {kept} passes");
        let heard = heard();
        assert_eq!(heard.len() as u64, 2 + passes - kept as u64, "{heard:?}");
        shelf.kept.lock().unwrap().values_mut().for_each(|bytes| bytes.truncate(bytes.len() / 2));
        assert!(is_same(&solve_keeping(&lit, &SUNS, &params, Some(&shelf))), "what is damaged is done again");
    }
}

#[test]
fn hits_that_lie_beside_are_not_traced_again_and_change_nothing() {
    let lit = lit();
    let params = params(64, 4);
    let (whole, blocks) = solve_blocks(&lit, &SUNS, &params, None);
    let in_little_room = LightParams { hit_budget_bytes: 1 << 10, ..params };
    let beside = Shelf { blocks: blocks.iter().map(GatherBlock::to_bytes).collect(), ..Shelf::default() };
    let nowhere = Shelf::default();
    for shelf in [&beside, &nowhere] {
        let (light, few) = solve_blocks(&lit, &SUNS, &in_little_room, Some(shelf));
        let left = few.iter().flat_map(|block| &block.hits).filter(|hits| hits.is_some()).count();
        assert_eq!(left, 0, "no hits fit");
        assert!(light.light == whole.light && light.cells == whole.cells);
        let passes = in_little_room.bounce_passes(light.sun.as_ref().unwrap().function_count()) as usize;
        assert_eq!(shelf.asked.load(Ordering::Relaxed), passes * few.len());
    }
    // it is these hits that light comes from
    let mut blind = blocks;
    let hits = blind.iter_mut().flat_map(|block| block.hits.iter_mut().flatten());
    hits.for_each(|hits| {
        hits.cells.clear();
        hits.met.fill(0);
    });
    let blind = Shelf { blocks: blind.iter().map(GatherBlock::to_bytes).collect(), ..Shelf::default() };
    assert!(solve_keeping(&lit, &SUNS, &in_little_room, Some(&blind)).light != whole.light);
}

#[test]
fn receivers_are_lit_as_the_vertices_in_whose_places_they_lie() {
    let lit = lit();
    let params = LightParams { offset_m: 1e-3, ..params(512, 4) };
    let solved = solve(&lit, &SUNS, &params);
    let surfaces = lit.surfaces();
    let (vertices, places): (Vec<usize>, Vec<SurfacePlace>) = corners(&lit).into_iter().unzip();
    let receiving = Receiving::new(&surfaces, &solved.layout, &params);
    let receivers = receiving.at(&places);
    let all = 0..receivers.points().len();
    let received = receivers.receive(&solved.cells, solved.sun.as_ref(), all.clone()).unwrap();
    let functions = solved.light.sun_bounce.as_ref().unwrap().functions.len();
    received.validate(places.len(), functions, &params).unwrap();
    let transfer = receivers.in_order_of_places(&received.sky_transfer, 4);
    let bounce = receivers.in_order_of_places(&received.sun_bounce, functions);
    let valid = receivers.in_order_of_places(&received.valid, 1);
    let (mut compared, mut squares, mut sum) = (0, 0.0_f64, 0.0_f64);
    for (place, &vertex) in vertices.iter().enumerate() {
        assert_eq!(valid[place], solved.light.validity.valid[vertex], "vertex {vertex}");
        if valid[place] == 0 {
            continue;
        }
        compared += 1;
        let own = &solved.light.sky_transfer[vertex * 4..(vertex + 1) * 4];
        for (a, b) in transfer[place * 4..(place + 1) * 4].iter().zip(own) {
            // paths are random: of others' numbers
            assert!((a - b).abs() < 0.02, "vertex {vertex}: {a} and {b}");
        }
        let own = &solved.light.sun_bounce.as_ref().unwrap().coefficients[vertex * functions..(vertex + 1) * functions];
        for (a, b) in bounce[place * functions..(place + 1) * functions].iter().zip(own) {
            squares += f64::from(a - b).powi(2);
            sum += f64::from(*b).powi(2);
        }
    }
    assert!(compared > 500, "{compared}");
    assert!((squares / sum).sqrt() < 0.03, "{}", (squares / sum).sqrt());

    // the sky alone, and in parts
    let parts: Vec<Received> = [0..100, 100..1024, 1024..1025, 1025..all.end.max(1025)]
        .into_iter()
        .filter(|range| range.end <= all.end)
        .map(|range| receivers.receive(&solved.cells, solved.sun.as_ref(), range).unwrap())
        .collect();
    let mut together = Received::default();
    parts.into_iter().for_each(|part| together.append(part));
    assert_eq!(together.sky_transfer, received.sky_transfer[..together.sky_transfer.len()]);
    let sky = receivers.receive(&solved.cells, None, all).unwrap();
    sky.validate(places.len(), 0, &params).unwrap();
    for (a, b) in sky.sky_transfer.iter().zip(&received.sky_transfer) {
        assert!((a - b).abs() < 0.02, "{a} and {b}");
    }
}

#[test]
fn vertices_of_what_rays_meet_receive_what_they_do_as_places_however_many_at_a_time() {
    let lit = lit();
    let params = LightParams { offset_m: 1e-3, ..params(512, 2) };
    let solved = solve(&lit, &SUNS, &params);
    let surfaces = lit.surfaces();
    let receiving = Receiving::new(&surfaces, &solved.layout, &params);
    let vertices = RayVertices::new(surfaces.positions, surfaces.normals, surfaces.triangles);
    let count = surfaces.positions.len();
    let functions = solved.sun.as_ref().unwrap().function_count();
    let (corner_of, places): (Vec<usize>, Vec<SurfacePlace>) = corners(&lit).into_iter().unzip();
    let at_corners = receiving.at(&places);
    let own = at_corners.receive(&solved.cells, solved.sun.as_ref(), 0..places.len()).unwrap();
    let own_valid = at_corners.in_order_of_places(&own.valid, 1);
    let numbers = [(4, &own.sky_transfer), (functions, &own.sun_bounce)];
    let own = numbers.map(|(width, numbers)| at_corners.in_order_of_places(numbers, width));
    for at_once in [count, 300] {
        let mut light = [4, functions].map(|width| vec![f32::NAN; count * width]);
        let mut valid = vec![2; count];
        for first in (0..count).step_by(at_once) {
            let receivers = vertices.receivers(&receiving, first..(first + at_once).min(count));
            let all = 0..receivers.points().len();
            let some = receivers.receive(&solved.cells, solved.sun.as_ref(), all.clone()).unwrap();
            receivers.put(all.clone(), &some.sky_transfer, 4, &mut light[0]);
            receivers.put(all.clone(), &some.sun_bounce, functions, &mut light[1]);
            receivers.put(all, &some.valid, 1, &mut valid);
        }
        assert!(corner_of.iter().zip(&own_valid).all(|(&vertex, own)| valid[vertex] == *own));
        for ((light, own), width) in light.iter().zip(&own).zip([4, functions]) {
            let (mut squares, mut sum) = (0.0_f64, 0.0_f64);
            for (place, &vertex) in corner_of.iter().enumerate().filter(|(place, _)| own_valid[*place] == 1) {
                for number in 0..width {
                    let (a, b) = (light[vertex * width + number], own[place * width + number]);
                    squares += f64::from(a - b).powi(2);
                    sum += f64::from(b).powi(2);
                }
            }
            // paths are random: of others' numbers
            let off = (squares / sum).sqrt();
            assert!(sum > 0.0 && off < 0.015, "{at_once} at once, {width} numbers: {off}");
        }
    }
}

#[test]
fn between_vertices_receivers_find_the_shadow_that_vertices_miss() {
    // two triangles, in whose middle a block stands
    let lit = Lit::new(ground(6.0, 1).and(cuboid(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 2.0, 1.0), 1)), 0.0);
    let params = LightParams { offset_m: 1e-3, ..params(2048, 1) };
    let solved = solve(&lit, &SUNS, &params);
    let surfaces = lit.surfaces();
    // from the ground's edge to its middle
    let is_middle = |&(u, v): &(f32, f32)| surfaces.position_at(0, u, v).length() < 1e-3;
    let (u, v) = [(0.5, 0.5), (0.5, 0.0), (0.0, 0.5)].into_iter().find(is_middle).unwrap();
    let along = |i: u8| SurfacePlace { triangle: 0, u: u * f32::from(i) / 40.0, v: v * f32::from(i) / 40.0 };
    let places: Vec<SurfacePlace> = (1..40).map(along).collect();
    let receiving = Receiving::new(&surfaces, &solved.layout, &params);
    let receivers = receiving.at(&places);
    let received = receivers.receive(&solved.cells, None, 0..places.len()).unwrap();
    let transfer = receivers.in_order_of_places(&received.sky_transfer, 4);
    let valid = receivers.in_order_of_places(&received.valid, 1);
    let reach = receivers.in_order_of_places(&received.reach_m, 1);
    let uniform = common::UNIFORM_SKY;
    for (i, place) in places.iter().enumerate() {
        let at = surfaces.position_at(place.triangle, place.u, place.v);
        let beneath = at.x.abs() < 1.0 && at.z.abs() < 1.0;
        assert_eq!(valid[i] == 0, beneath, "{at}");
        if !beneath {
            let sky = transfer[i * 4] * uniform;
            assert!(sky > 0.4 && sky <= 1.001 && reach[i] > 0.1, "{at}: {sky}, {}", reach[i]);
            // two of the block's sides are seen from here, as from nowhere at a vertex of the ground
            let near = at.x.abs() < 1.3;
            assert!(if near { sky < 0.85 } else { sky > 0.8 }, "{at}: {sky}");
        }
    }
    assert!(valid.contains(&0) && valid.contains(&1));
}
