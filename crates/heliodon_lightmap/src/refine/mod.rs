//! Refinement in the space of the light map: few texels are asked for their light first, and more where it changes.
//!
//! G. Papaioannou, A. Gaitatzes, D. Christopoulos: "Enhancing Virtual Reality Walkthroughs of Archaeological Sites", VAST 2003, section 4: "an iterative,
//! adaptive lightmap-space ray-tracing algorithm". Texels of a lattice are sampled, then those half way between them, and so on. A texel is interpolated from its
//! two or four neighbours of the coarser lattice where these lie on the same smooth surface, their light agrees (or changes so evenly that a straight line
//! follows it), and nothing is so near that light may change between them (G. Ward, F. Rubinstein, R. Clear: "A Ray Tracing Solution for Diffuse
//! Interreflection", SIGGRAPH 1988, eq. 4). Where a sample differs from what its neighbours had promised, texels around it that were interpolated are sampled
//! after all, and so on from there: what is narrow but long, as a shadow of a pole, is followed once any part of it is found.
//!
//! It knows nothing of light: values are numbers that somebody else samples, a whole lattice at once.

mod borrow;
mod grid;

pub use grid::{Grid, Place};

use borrow::borrow;
use rayon::prelude::*;

/// How far refinement goes.
#[derive(Clone, Debug, PartialEq)]
pub struct RefineParams {
    /// Texels between samples of the first lattice, a power of two, 1 to 64; 1 samples every texel. Light that is seen only in what is narrower and shorter
    /// than this may be missed.
    pub first_stride: u32,
    /// The error that interpolation may have, as a part of the values around; at least 0. Noise that is stronger than this has all texels sampled.
    pub error: f32,
    /// Added to the values around for that, so that what is as good as dark costs nothing; at least 0.
    pub floor: f32,
    /// Added as well, a number for each texel: other light that is there already, beside which errors of this one are to be seen; empty adds nothing.
    pub beside: Vec<f32>,
    /// Texels that are interpolated from are no further from each other than so many times the harmonic mean distance that they see; infinite ignores it.
    pub reach: f32,
    /// The least cosine between the normals of texels that are interpolated from and the texel's own.
    pub least_cosine: f32,
    /// Texels that are not valid take the values of valid ones up to so many texels away; those further inside keep what was sampled.
    pub borrowed_from: u32,
    /// Numbers of a texel that share a scale, run by run, as the coefficients of one function do; empty has one run of all.
    pub runs: Vec<usize>,
}

impl Default for RefineParams {
    fn default() -> Self {
        Self {
            first_stride: 8,
            error: 0.02,
            floor: 1.0e-3,
            beside: Vec::new(),
            reach: 0.5,
            least_cosine: 0.9,
            borrowed_from: u32::MAX,
            runs: Vec::new(),
        }
    }
}

/// What was found for the texels that were asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Sampled {
    /// Texel by texel, each the same count of numbers.
    pub values: Vec<f32>,
    /// Whether each texel lies where light can be; those that do not are not interpolated from.
    pub valid: Vec<bool>,
    /// Harmonic mean distance of what each sees, metres; infinite where nothing is near or nobody knows.
    pub reach_m: Vec<f32>,
}

/// The values of all texels.
#[derive(Clone, Debug, PartialEq)]
pub struct Refined {
    /// Texel by texel; those that are not valid have what the nearest valid ones of their chart have, if these are near enough.
    pub values: Vec<f32>,
    /// Which texels were sampled.
    pub sampled: Vec<bool>,
    /// Which texels lie where light can be.
    pub valid: Vec<bool>,
    /// How many were sampled.
    pub samples: usize,
}

/// Values of `count` numbers for all texels of a grid, of which `sample` is asked for as few as may be, in ascending order. The same for any number of
/// threads, if `sample`'s answers are.
///
/// # Panics
/// When `sample` answers with other counts than it was asked for, runs are not `count` numbers together, or `beside` has not a number for each texel.
pub fn refine(grid: &Grid, count: usize, params: &RefineParams, sample: &mut dyn FnMut(&[u32]) -> Sampled) -> Refined {
    let runs = if params.runs.is_empty() { vec![count] } else { params.runs.clone() };
    assert_eq!(runs.iter().sum::<usize>(), count, "runs are all of a texel's numbers");
    assert!([0, grid.len()].contains(&params.beside.len()), "nothing beside, or a number for each texel");
    let mut work = Work {
        grid,
        count,
        params,
        runs,
        state: vec![State::Unknown; grid.len()],
        values: vec![0.0; grid.len() * count],
        valid: vec![true; grid.len()],
        reach_m: vec![f32::INFINITY; grid.len()],
        off: vec![false; grid.len()],
    };
    let first = params.first_stride.clamp(1, 64).next_power_of_two() as i32;
    let strides = std::iter::successors(Some(first), |stride| (*stride > 1).then_some(stride / 2));
    for stride in strides.clone() {
        let (between, asked) = work.between(grid.of_stride(stride, stride == first), stride);
        work.set(&between, State::Interpolated);
        // what only filtering asks for waits for what lies on the surface beside it
        let (rim, asked) = asked.into_iter().partition(|texel| stride == 1 && first > 1 && !grid.covered[*texel as usize]);
        work.ask_all(asked, stride, sample);
        let (beside, asked) = work.beside_surface(rim);
        work.set(&beside, State::Interpolated);
        work.ask_all(asked, stride, sample);
    }
    // what was sampled after all may have been interpolated from
    for stride in strides.skip(1) {
        let known = |texel: &u32| work.state[*texel as usize] == State::Interpolated;
        let again: Vec<u32> = grid.of_stride(stride, false).into_iter().filter(known).collect();
        let values: Vec<_> =
            again.into_par_iter().filter_map(|texel| Some((texel, work.promised(texel, stride)?.values))).collect();
        work.set(&values, State::Interpolated);
    }
    let Work { state, mut values, valid, .. } = work;
    borrow(grid, &mut values, count, &valid, params.borrowed_from);
    let sampled: Vec<bool> = state.iter().map(|state| *state == State::Sampled).collect();
    let samples = sampled.iter().filter(|sampled| **sampled).count();
    Refined { values, sampled, valid, samples }
}

#[derive(Clone, Copy, PartialEq)]
enum State {
    Unknown,
    Interpolated,
    Sampled,
}

/// What neighbours promise.
struct Promise {
    values: Vec<f32>,
    /// Whether it is to be believed.
    is_sure: bool,
}

struct Work<'a> {
    grid: &'a Grid,
    count: usize,
    params: &'a RefineParams,
    runs: Vec<usize>,
    state: Vec<State>,
    values: Vec<f32>,
    valid: Vec<bool>,
    reach_m: Vec<f32>,
    /// Whose sample was not what neighbours had promised.
    off: Vec<bool>,
}

/// A straight line through the neighbours half a line's length away is off by an eighth of their second difference; so much for what it knows of it only roughly.
const CURVATURE_TO_ERROR: f32 = 0.25;
/// However evenly light seems to change, neighbours differ by no more than so many errors.
const STEEPEST: f32 = 8.0;
/// How far off the middle of its neighbours a texel's place may lie, as a part of their distance: a sheet has no folds between them.
const OFF_MIDDLE: f32 = 0.1;

/// The ways to the texels around one.
const AROUND: [[i32; 2]; 8] = [[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];

impl Work<'_> {
    fn value(&self, texel: u32) -> &[f32] {
        &self.values[texel as usize * self.count..][..self.count]
    }

    fn set(&mut self, values: &[(u32, Vec<f32>)], state: State) {
        for (texel, values) in values {
            self.values[*texel as usize * self.count..][..self.count].copy_from_slice(values);
            self.state[*texel as usize] = state;
        }
    }

    /// Of some texels those whose neighbours' promise is to be believed, with it, and those that are to be sampled.
    fn between(&self, texels: Vec<u32>, stride: i32) -> (Vec<(u32, Vec<f32>)>, Vec<u32>) {
        let promised =
            texels.into_par_iter().map(|texel| (texel, self.promised(texel, stride).filter(|promise| promise.is_sure)));
        promised.partition_map(|(texel, promise)| match promise {
            Some(promise) => rayon::iter::Either::Left((texel, promise.values)),
            None => rayon::iter::Either::Right(texel),
        })
    }

    /// Of a chart's rim beyond the surface, those whose neighbours on the surface are valid, agree and are what was promised, with the mean of these, and
    /// those that are to be sampled. Beside what lies within a wall there may be a strip before it that is narrower than a texel, which the rim alone tells of.
    fn beside_surface(&self, texels: Vec<u32>) -> (Vec<(u32, Vec<f32>)>, Vec<u32>) {
        let is_known = |texel: &u32| self.grid.covered[*texel as usize] && self.state[*texel as usize] != State::Unknown;
        let beside = |texel: u32| -> Option<(u32, Vec<f32>)> {
            let around: Vec<u32> = AROUND.iter().filter_map(|&[x, y]| self.grid.beside(texel, x, y)).filter(is_known).collect();
            let of_all: Vec<&[f32]> = around.iter().map(|&other| self.value(other)).collect();
            let alike =
                |&other: &u32| self.valid[other as usize] && !self.off[other as usize] && self.faces_alike(texel, other);
            let share = 1.0 / around.len() as f32;
            let mean = (0..self.count).map(|i| of_all.iter().map(|values| values[i]).sum::<f32>() * share);
            let agrees = !around.is_empty() && around.iter().all(alike) && self.agree(texel, &of_all, 1.0);
            agrees.then(|| (texel, mean.collect()))
        };
        let found = texels.into_par_iter().map(|texel| beside(texel).ok_or(texel));
        found.partition_map(|found| found.map_or_else(rayon::iter::Either::Right, rayon::iter::Either::Left))
    }

    fn ask_all(&mut self, mut asked: Vec<u32>, stride: i32, sample: &mut dyn FnMut(&[u32]) -> Sampled) {
        while !asked.is_empty() {
            asked = self.ask(&asked, stride, sample);
        }
    }

    /// Samples texels; returns those around them that were interpolated and are to be sampled too.
    fn ask(&mut self, asked: &[u32], stride: i32, sample: &mut dyn FnMut(&[u32]) -> Sampled) -> Vec<u32> {
        let Sampled { values, valid, reach_m } = sample(asked);
        let counts = [values.len(), valid.len(), reach_m.len()];
        assert_eq!(counts, [asked.len() * self.count, asked.len(), asked.len()], "an answer for each texel");
        let is_off = |(i, &texel): (usize, &u32)| {
            let promise = match self.state[texel as usize] {
                State::Interpolated => Some(self.value(texel).to_vec()),
                // beyond the surface nothing is followed
                _ if !self.grid.covered[texel as usize] => None,
                _ => self.promised(texel, stride).map(|promise| promise.values),
            };
            let found = &values[i * self.count..][..self.count];
            promise.is_some_and(|promise| !self.agree(texel, &[&promise, found], 1.0))
        };
        let off: Vec<bool> = asked.par_iter().enumerate().map(is_off).collect();
        for (i, &texel) in asked.iter().enumerate() {
            let texel = texel as usize;
            self.values[texel * self.count..][..self.count].copy_from_slice(&values[i * self.count..][..self.count]);
            (self.state[texel], self.valid[texel], self.reach_m[texel]) = (State::Sampled, valid[i], reach_m[i]);
            self.off[texel] = off[i];
        }
        let of_interest = asked.iter().zip(&off).zip(&valid).filter(|((_, off), valid)| **off || !**valid);
        let around = of_interest.flat_map(|((&texel, _), _)| AROUND.map(|step| (texel, step)));
        let beside = around.filter_map(|(texel, [dx, dy])| self.grid.beside(texel, dx * stride, dy * stride));
        let mut next: Vec<u32> = beside.filter(|&texel| self.state[texel as usize] == State::Interpolated).collect();
        next.sort_unstable();
        next.dedup();
        next
    }

    /// What the neighbours of the coarser lattice promise for a texel; nothing where one is missing, or lies on another surface or inside of something.
    fn promised(&self, texel: u32, stride: i32) -> Option<Promise> {
        let lines: &[[i32; 2]] = match self.grid.on_lattice(texel, 2 * stride) {
            [true, true] => return None,
            [false, true] => &[[1, 0]],
            [true, false] => &[[0, 1]],
            [false, false] => &[[1, 1], [1, -1]],
        };
        let beside = |[x, y]: [i32; 2], steps: i32| self.grid.beside(texel, x * steps * stride, y * steps * stride);
        let known = |parent: u32| self.state[parent as usize] != State::Unknown && self.valid[parent as usize];
        // at a chart's corner one of two lines is enough
        let is_whole = |line: &[i32; 2]| beside(*line, -1).is_some() && beside(*line, 1).is_some();
        let one = lines.iter().position(is_whole).map_or(0..lines.len(), |at| at..at + 1);
        let lines = if lines.iter().all(is_whole) { lines } else { &lines[one] };
        let parents = lines.iter().flat_map(|&line| [beside(line, -1), beside(line, 1)]);
        let Some(parents) = parents.collect::<Option<Vec<u32>>>() else {
            // A chart's rim, beyond the surface, goes on as the surface before it does.
            let inward = lines.iter().flat_map(|&line| [(line, -1), (line, 1)]);
            let inward = inward.filter_map(|(line, side)| beside(line, side).zip(beside(line, 3 * side)));
            let inward: Vec<(u32, u32)> = inward.filter(|&(near, far)| known(near) && known(far)).collect();
            return if self.grid.covered[texel as usize] { None } else { self.continued(texel, &inward) };
        };
        if !parents.iter().all(|&parent| known(parent)) || !self.is_smooth(texel, &parents) {
            return None;
        }
        let of_parents: Vec<&[f32]> = parents.iter().map(|&parent| self.value(parent)).collect();
        let share = 1.0 / parents.len() as f32;
        let values = (0..self.count).map(|i| of_parents.iter().map(|values| values[i]).sum::<f32>() * share).collect();
        let is_even = || {
            let outer = |line: [i32; 2], steps: i32| beside(line, steps).filter(|&o| known(o) && self.faces_alike(texel, o));
            lines.iter().zip(of_parents.chunks_exact(2)).all(|(&line, pair)| {
                let outer = outer(line, -3).zip(outer(line, 3));
                outer.is_some_and(|(a, b)| self.is_straight(texel, [self.value(a), pair[0], pair[1], self.value(b)]))
            })
        };
        let agree = self.agree(texel, &of_parents, 1.0) || (self.agree(texel, &of_parents, STEEPEST) && is_even());
        Some(Promise { values, is_sure: agree && self.sees_far(&parents) })
    }

    /// What a texel gets that has neighbours on one side only: a near one, and one three times as far.
    fn continued(&self, texel: u32, inward: &[(u32, u32)]) -> Option<Promise> {
        if inward.is_empty() || !inward.iter().all(|&(near, far)| self.faces_alike(texel, near) && self.faces_alike(near, far))
        {
            return None;
        }
        let share = 1.0 / inward.len() as f32;
        let went_on = |near: &[f32], far: &[f32], i: usize| near[i] + 0.5 * (near[i] - far[i]);
        let of_pairs: Vec<(&[f32], &[f32])> = inward.iter().map(|&(near, far)| (self.value(near), self.value(far))).collect();
        let values = (0..self.count).map(|i| of_pairs.iter().map(|(near, far)| went_on(near, far, i)).sum::<f32>() * share);
        let all: Vec<&[f32]> = of_pairs.iter().flat_map(|&(near, far)| [near, far]).collect();
        let pairs: Vec<u32> = inward.iter().flat_map(|&(near, far)| [near, far]).collect();
        Some(Promise { values: values.collect(), is_sure: self.agree(texel, &all, 1.0) && self.sees_far(&pairs) })
    }

    fn faces_alike(&self, texel: u32, other: u32) -> bool {
        let [a, b] = [texel, other].map(|texel| self.grid.places[texel as usize].normal);
        a.dot(b) >= self.params.least_cosine
    }

    /// Whether a texel lies in the middle of its parents, on a surface without edges.
    fn is_smooth(&self, texel: u32, parents: &[u32]) -> bool {
        let position = |texel: u32| self.grid.places[texel as usize].position;
        let own = position(texel);
        let pairs = parents.chunks_exact(2).all(|pair| {
            let [a, b] = [position(pair[0]), position(pair[1])];
            a.midpoint(b).distance(own) <= OFF_MIDDLE * a.distance(b)
        });
        pairs && parents.iter().all(|&parent| self.faces_alike(texel, parent))
    }

    /// Whether what a texel's parents see is far against their distance.
    fn sees_far(&self, parents: &[u32]) -> bool {
        let position = |texel: u32| self.grid.places[texel as usize].position;
        let reach_m = parents.iter().map(|&parent| self.reach_m[parent as usize]).fold(f32::INFINITY, f32::min);
        let spacing_m = parents.chunks_exact(2).map(|pair| position(pair[0]).distance(position(pair[1]))).fold(0.0, f32::max);
        spacing_m <= self.params.reach * reach_m
    }

    /// Whether values differ by no more than so many errors.
    fn agree(&self, texel: u32, values: &[&[f32]], errors: f32) -> bool {
        self.each_run(texel, values, |tolerance, i| {
            let (low, high) =
                values.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), v| (low.min(v[i]), high.max(v[i])));
            high - low <= errors * tolerance
        })
    }

    /// Whether four values at equal distances lie on a line, as far as the error asks for.
    fn is_straight(&self, texel: u32, [a, b, c, d]: [&[f32]; 4]) -> bool {
        self.each_run(texel, &[a, b, c, d], |tolerance, i| {
            let second = (a[i] - 2.0 * b[i] + c[i]).abs().max((b[i] - 2.0 * c[i] + d[i]).abs());
            CURVATURE_TO_ERROR * second <= tolerance
        })
    }

    /// Whether something holds of every number, with the error that its run may have.
    fn each_run(&self, texel: u32, values: &[&[f32]], holds: impl Fn(f32, usize) -> bool) -> bool {
        let mut begin = 0;
        let least = self.params.floor + self.params.beside.get(texel as usize).copied().unwrap_or(0.0);
        self.runs.iter().all(|&run| {
            let numbers = begin..begin + run;
            begin += run;
            let mean = |i: usize| values.iter().map(|values| values[i].abs()).sum::<f32>() / values.len() as f32;
            let scale = numbers.clone().map(mean).fold(0.0, f32::max) + least;
            numbers.into_iter().all(|i| holds(self.params.error * scale, i))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packing::PackParams;
    use crate::texels::{Texel, texels};
    use crate::unwrap::{UnwrapParams, unwrap};
    use glam::Vec3;
    use heliodon_testkit::scenes::{Scene, ball, cuboid, rectangle};

    const SIDE: u32 = 256;

    fn grid(scene: &Scene) -> Grid {
        let pack = PackParams { width: SIDE, height: SIDE, ..PackParams::default() };
        let unwrapped =
            unwrap(&scene.positions, &scene.triangles, &[], &UnwrapParams { pack, ..UnwrapParams::default() }).unwrap();
        let texels = texels(&unwrapped, SIDE, SIDE);
        let place = |texel: &Texel| {
            let corners = scene.triangles[texel.triangle as usize];
            let mix = |of: &[Vec3]| texel.mix(corners.map(|v| of[v as usize]));
            Place { position: mix(&scene.positions), normal: mix(&scene.normals).normalize_or(Vec3::Y) }
        };
        let places = texels.iter().map(place).collect();
        Grid::new(&texels, &unwrapped.chart, places)
    }

    fn sheet() -> Scene {
        rectangle(Vec3::ZERO, Vec3::Z, Vec3::X, 1)
    }

    /// Refines a function of the place, and answers with what was found, the greatest and the mean error.
    fn refined(grid: &Grid, params: &RefineParams, light: impl Fn(Place) -> f32) -> (Refined, f32, f32) {
        let mut before = None;
        let found = refine(grid, 1, params, &mut |asked| {
            assert!(asked.is_sorted(), "in order, none twice");
            before = before.max(asked.last().copied());
            let values = asked.iter().map(|&texel| light(grid.places()[texel as usize])).collect();
            Sampled { values, valid: vec![true; asked.len()], reach_m: vec![f32::INFINITY; asked.len()] }
        });
        let errors = grid.places().iter().zip(&found.values).map(|(&place, value)| (light(place) - value).abs());
        let (most, sum) = errors.fold((0.0_f32, 0.0_f32), |(most, sum), error| (most.max(error), sum + error));
        (found, most, sum / grid.len() as f32)
    }

    /// Whether every texel of the surface has its own light, and of those that only filtering asks for all but one or two where an edge leaves the chart.
    fn has_edges(grid: &Grid, found: &Refined, light: impl Fn(Place) -> f32) -> bool {
        let off = |texel: &usize| found.values[*texel] != light(grid.places()[*texel]);
        let (surface, rim): (Vec<usize>, Vec<usize>) = (0..grid.len()).filter(off).partition(|&texel| grid.covered[texel]);
        surface.is_empty() && rim.len() <= 4
    }

    #[test]
    fn the_edge_of_a_shadow_is_found_to_the_texel() {
        let grid = grid(&sheet());
        let shadow = |place: Place| if place.position.x + 0.37 * place.position.z > 0.7 { 1.0 } else { 0.1 };
        let (found, ..) = refined(&grid, &RefineParams::default(), shadow);
        assert!(has_edges(&grid, &found, shadow));
        assert!(found.samples * 6 < grid.len(), "{} of {}", found.samples, grid.len());
    }

    #[test]
    fn what_is_narrow_is_followed_from_where_it_is_found() {
        let grid = grid(&sheet());
        // two texels wide
        let pole = |place: Place| if (place.position.x - 0.3 * place.position.z - 0.411).abs() < 0.004 { 0.2 } else { 1.0 };
        let (found, ..) = refined(&grid, &RefineParams::default(), pole);
        assert!(has_edges(&grid, &found, pole));
        assert!(found.samples * 5 < grid.len(), "{} of {}", found.samples, grid.len());
    }

    #[test]
    fn light_that_changes_evenly_costs_few_samples() {
        let grid = grid(&sheet());
        let ramp = |place: Place| 0.5 + place.position.x + 0.5 * place.position.z;
        let (found, most, _) = refined(&grid, &RefineParams::default(), ramp);
        assert!(found.samples * 12 < grid.len() && most < 0.01, "{} of {}, {most}", found.samples, grid.len());
        let lamp = |place: Place| 0.3 / (0.09 + place.position.distance_squared(Vec3::new(0.4, 0.0, 0.6)));
        for error in [0.05, 0.02, 0.005] {
            let params = RefineParams { error, ..RefineParams::default() };
            let (found, most, mean) = refined(&grid, &params, lamp);
            // relative to at most 3.34; neighbours' agreement promises about that, and how the sheet lies in the texture decides the rest
            assert!(most < 1.25 * 3.34 * error && mean < 0.3 * error, "{error}: {most}, {mean}");
            assert!(found.samples * 5 < grid.len(), "{} of {}", found.samples, grid.len());
        }
    }

    #[test]
    fn nothing_is_interpolated_across_edges_of_the_surface() {
        let light = |place: Place| place.normal.dot(Vec3::new(0.2, 0.5, 0.8)).max(0.0) * (1.0 + 0.2 * place.position.x);
        for scene in [cuboid(Vec3::ZERO, Vec3::new(1.0, 0.6, 0.4), 2), ball(1.0, 32)] {
            let grid = grid(&scene);
            let (found, most, mean) = refined(&grid, &RefineParams::default(), light);
            assert!(most < 0.03 && mean < 0.004, "{most}, {mean}");
            assert!(found.samples * 3 < grid.len(), "{} of {}", found.samples, grid.len());
        }
    }

    #[test]
    fn what_is_near_is_looked_at_closely() {
        let grid = grid(&sheet());
        let near = |place: Place| 0.01 + (place.position.x - 0.5).abs();
        let asked = |reach: f32| {
            let params = RefineParams { reach, ..RefineParams::default() };
            refine(&grid, 1, &params, &mut |asked| {
                let reach_m = asked.iter().map(|&texel| near(grid.places()[texel as usize])).collect();
                Sampled { values: vec![1.0; asked.len()], valid: vec![true; asked.len()], reach_m }
            })
        };
        let (far, near) = (asked(f32::INFINITY), asked(0.5));
        assert!(near.samples > far.samples + 500 && near.samples * 4 < grid.len(), "{} and {}", near.samples, far.samples);
    }

    #[test]
    fn what_lies_inside_of_something_borrows_from_beside_it() {
        let grid = grid(&sheet());
        let inside = |place: Place| place.position.distance(Vec3::new(0.5, 0.0, 0.5)) < 0.2;
        let light = |place: Place| 1.0 + place.position.x;
        let found = refine(&grid, 2, &RefineParams::default(), &mut |asked| {
            let places = || asked.iter().map(|&texel| grid.places()[texel as usize]);
            let values = places().flat_map(|place| if inside(place) { [0.0; 2] } else { [light(place), 3.0] });
            Sampled {
                values: values.collect(),
                valid: places().map(|place| !inside(place)).collect(),
                reach_m: vec![f32::INFINITY; asked.len()],
            }
        });
        for (texel, &place) in grid.places().iter().enumerate() {
            let [value, three] = [found.values[2 * texel], found.values[2 * texel + 1]];
            assert_eq!(found.valid[texel], !inside(place), "{place:?}");
            assert!((three - 3.0).abs() < 1e-4);
            let most = if inside(place) { 0.25 } else { 0.01 };
            assert!((value - light(place)).abs() < most, "{value} at {place:?}");
        }
        let nearest = grid.nearest_valid(&found.valid);
        for (texel, &place) in grid.places().iter().enumerate() {
            let source = grid.places()[nearest[texel] as usize];
            assert!(!inside(source) && (inside(place) || nearest[texel] == texel as u32));
            let wanted = if inside(place) { 0.2 - place.position.distance(Vec3::new(0.5, 0.0, 0.5)) } else { 0.0 };
            assert!(place.position.distance(source.position) < 1.5 * wanted + 0.02, "{place:?} from {source:?}");
        }
        assert_eq!(grid.nearest_valid(&vec![false; grid.len()])[7], 7);
        let none = refine(&grid, 1, &RefineParams::default(), &mut |asked| Sampled {
            values: vec![7.0; asked.len()],
            valid: vec![false; asked.len()],
            reach_m: vec![0.0; asked.len()],
        });
        assert!(
            none.values.iter().all(|value| *value == 7.0)
                && none.samples >= grid.covered.iter().filter(|covered| **covered).count()
        );
    }

    #[test]
    fn a_strip_before_a_wall_that_only_a_rim_tells_of_borrows_nothing_from_behind_it() {
        let grid = grid(&sheet());
        // a wall on most of the sheet, bright before it and dark in what is left behind it, which no middle of a texel lies on
        let (in_front, behind) = (|place: Place| place.position.x < 0.3, |place: Place| place.position.x > 1.0 - 1e-5);
        assert!(grid.places().iter().zip(&grid.covered).all(|(place, covered)| !(*covered && behind(*place))));
        let found = refine(&grid, 1, &RefineParams::default(), &mut |asked| {
            let places = || asked.iter().map(|&texel| grid.places()[texel as usize]);
            Sampled {
                values: places().map(|place| f32::from(u8::from(in_front(place)))).collect(),
                valid: places().map(|place| in_front(place) || behind(place)).collect(),
                reach_m: vec![f32::INFINITY; asked.len()],
            }
        });
        for (texel, place) in grid.places().iter().enumerate() {
            assert!(found.valid[texel] || (0.3..1.0).contains(&place.position.x));
            let wanted = if place.position.x < 0.6 { 1.0 } else { 0.0 };
            let between = (0.6..0.7).contains(&place.position.x);
            assert!(between || found.values[texel] == wanted, "{} at {place:?}", found.values[texel]);
        }
    }

    #[test]
    fn numbers_of_several_functions_have_scales_of_their_own() {
        let grid = grid(&sheet());
        let params = |runs: Vec<usize>| RefineParams { runs, ..RefineParams::default() };
        let step = |place: Place| f32::from(u8::from(place.position.x > 0.5));
        let asked = |runs: Vec<usize>| {
            refine(&grid, 2, &params(runs), &mut |asked| Sampled {
                values: asked.iter().flat_map(|&texel| [100.0, step(grid.places()[texel as usize])]).collect(),
                valid: vec![true; asked.len()],
                reach_m: vec![f32::INFINITY; asked.len()],
            })
        };
        let (together, apart) = (asked(Vec::new()), asked(vec![1, 1]));
        assert!(apart.samples > together.samples + 500, "{} and {}", apart.samples, together.samples);
        let all = refined(&grid, &RefineParams { first_stride: 1, ..RefineParams::default() }, |_| 1.0).0;
        assert!(all.samples == grid.len() && all.sampled.iter().all(|sampled| *sampled));
        let none = super::tests::grid(&Scene::default());
        assert!(refined(&none, &RefineParams::default(), |_| 1.0).0.values.is_empty());
    }
}
