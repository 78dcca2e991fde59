//! Seams: where a smooth surface goes on in another chart, both sides are to show the same.
//!
//! Along every border both charts are filtered on grids of their own. Values of texels are changed, each as little as may be, until at four places on a texel's length both
//! filtered values are equal (S. Kaczmarz: "Angenäherte Auflösung von Systemen linearer Gleichungen", 1937: begun at the values that were found, it comes to those
//! nearest to them that fit). Texels that only filtering asks for change more easily than those that lie on the surface. At creases light changes, and nothing
//! is matched. Where charts are much narrower than a texel rounds come together slowly: `settle` takes what they leave of it.

mod choose;
mod settle;

use crate::charts::for_each_pair;
use crate::texels::{Texel, cell};
use crate::unwrap::Unwrapped;
use glam::{Vec2, Vec3};
use heliodon_math::frame::unit_or;
use heliodon_mesh::topology::HalfEdge;
use rayon::prelude::*;
use settle::Terms;
use std::collections::BTreeMap;

/// Places that are matched for a texel's length.
const A_TEXEL: f32 = 4.0;
/// How much more easily a texel changes that does not lie on the surface.
const EASY: f32 = 2.0;
/// Normals with a lesser cosine between them are a crease.
const SMOOTH: f32 = 0.999;
/// Rounds over seams before what is left is settled, where one value of each texel counts and where there are dozens, and from one over all of them to the next.
const MOST_ROUNDS: usize = 512;
const FEW_ROUNDS: usize = 128;
const ALONE: usize = 64;
/// How often nets grow while they are settled, where one value counts and where there are dozens.
const MOST_TIMES: usize = 16;
const FEW_TIMES: usize = 3;
/// How often what rounds leave is settled at most: the second time where texels may not become brighter.
const TURNS: usize = 8;

/// One place on a border: what it takes from the texels around it on one side is to be what it takes on the other.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Match {
    /// Numbers of [`Seams::touched`].
    texels: [u32; 8],
    /// Positive on one side, negative on the other; each side's are 1 together.
    weights: [f32; 8],
}

/// When two sides are near enough.
struct Near<F> {
    /// The most that they may be apart.
    tolerance: f32,
    /// Those that are no further apart than this are left.
    enough: f32,
    /// What a difference of 1 counts, of the place, how large the difference is and the mean of both sides.
    shown: F,
}

/// All borders at which a surface goes on smoothly.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seams {
    matches: Vec<Match>,
    /// How many places are known that are not matched.
    left: usize,
    /// The texels that matches know, ascending.
    touched: Vec<u32>,
    /// How easily each of them changes, and which become no brighter.
    ease: Vec<f32>,
    is_capped: Vec<bool>,
    /// All texels.
    texels: usize,
}

impl Seams {
    /// Of an unwrapped surface: `positions`, `normals` and `triangles` as they were before, `texels` as of [`crate::texels::texels`] with these sides. Without
    /// normals, those of the triangles tell creases.
    ///
    /// # Panics
    /// When the arrays contradict one another.
    #[must_use]
    pub fn new(unwrapped: &Unwrapped, surface: (&[Vec3], &[Vec3], &[[u32; 3]]), texels: &[Texel], sides: [u32; 2]) -> Self {
        Self::with_places(unwrapped, surface, texels, sides, A_TEXEL)
    }

    /// As [`Seams::new`], with so many places for a texel's length.
    fn with_places(
        unwrapped: &Unwrapped,
        (positions, normals, triangles): (&[Vec3], &[Vec3], &[[u32; 3]]),
        texels: &[Texel],
        sides: [u32; 2],
        a_texel: f32,
    ) -> Self {
        let [width, height] = sides;
        let mut texel_at = vec![NOBODY; cell(sides, unwrapped.packing.sheets as u16, 0, 0)];
        for (index, texel) in texels.iter().enumerate() {
            texel_at[cell(sides, texel.sheet, u32::from(texel.x), u32::from(texel.y))] = index as u32;
        }
        let own = |triangle: usize, x: u32, y: u32| {
            let texel = texel_at[cell(sides, unwrapped.sheet[triangle], x.min(width - 1), y.min(height - 1))];
            let chart = |triangle: usize| unwrapped.chart[triangle];
            let is_own = texel != NOBODY && chart(texels[texel as usize].triangle as usize) == chart(triangle);
            if is_own { texel } else { NOBODY }
        };
        let surface = Surface {
            unwrapped,
            positions,
            normals,
            triangles,
            size: Vec2::new(width as f32, height as f32),
            a_texel,
            filter: &|triangle, at| filter(at, |x, y| own(triangle, x, y)),
        };
        let mut matches = Vec::new();
        let has_area = |t: usize| unwrapped.charts[unwrapped.chart[t] as usize].scale > 0.0;
        for_each_pair(positions, triangles, has_area, |a, b| surface.match_sides(a, b, &mut matches));
        let mut number = vec![NOBODY; texels.len()];
        matches.iter().flat_map(|matched| matched.texels).for_each(|texel| number[texel as usize] = 0);
        let touched: Vec<u32> = (0..texels.len() as u32).filter(|&texel| number[texel as usize] == 0).collect();
        touched.iter().zip(0..).for_each(|(&texel, own)| number[texel as usize] = own);
        matches.iter_mut().for_each(|matched| matched.texels = matched.texels.map(|texel| number[texel as usize]));
        let ease = touched.iter().map(|&texel| if texels[texel as usize].is_covered { 1.0 } else { EASY }).collect();
        let is_capped = vec![false; touched.len()];
        Self { matches, left: 0, touched, ease, is_capped, texels: texels.len() }
    }

    /// Texels become no brighter where it is so marked; of all texels.
    pub(crate) fn cap(&mut self, is_capped: &[bool]) {
        assert_eq!(is_capped.len(), self.texels, "a mark for each texel");
        self.is_capped = self.touched.iter().map(|&texel| is_capped[texel as usize]).collect();
    }

    /// Leaves places open, of [`Seams::places`] those with `false`.
    ///
    /// # Panics
    /// When there is not a mark for each place.
    pub fn keep(&mut self, keep: &[bool]) {
        assert_eq!(keep.len(), self.matches.len(), "a mark for each place");
        let mut marks = keep.iter();
        self.matches.retain(|_| marks.next() == Some(&true));
        self.left += keep.len() - self.matches.len();
    }

    /// How many places were left open.
    #[must_use]
    pub fn left(&self) -> usize {
        self.left
    }

    /// How many texels there are, those that no place knows counted.
    #[must_use]
    pub fn texel_count(&self) -> usize {
        self.texels
    }

    /// How many places are matched.
    #[must_use]
    pub fn len(&self) -> usize {
        self.matches.len()
    }

    /// Whether there is nothing to match.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.matches.is_empty()
    }

    /// Changes `N` values of each texel at once until no two sides differ by more than their place's tolerance, all above 0, or what is apart was settled a few times; returns how many times as
    /// far they still differ at most. What counts is how long the difference is (the root of the sum of the squares of all `N`). A place whose sides are nearer than half of that changes nothing.
    ///
    /// # Panics
    /// When there are not as many values as texels, and tolerances as places.
    pub fn close<const N: usize>(&self, values: &mut [[f32; N]], tolerances: &[f32]) -> f32 {
        assert_eq!(tolerances.len(), self.matches.len(), "a tolerance for each place");
        // texels change as easily as what asks most of them lets them
        let mut finest = vec![f32::INFINITY; self.touched.len()];
        for (matched, most) in self.matches.iter().zip(tolerances) {
            matched.asked().for_each(|(texel, _)| finest[texel as usize] = finest[texel as usize].min(*most));
        }
        let any = |_| [f32::NEG_INFINITY, f32::INFINITY];
        let near = Near { tolerance: 1.0, enough: 0.5, shown: |place: usize, _, _: [f32; N]| 1.0 / tolerances[place] };
        let terms = Terms {
            shown: |place: usize, _: [f32; N]| 1.0 / tolerances[place],
            held: |texel: usize, _: [f32; N]| 1.0 / (finest[texel] * finest[texel]),
            bounds: any,
        };
        let mut own = self.of_touched(values);
        self.bring_together(&mut own, any, FEW_ROUNDS, &near);
        self.settle(&mut own, 1.0, FEW_TIMES, &terms);
        self.put(&own, values);
        self.lengths(&own).zip(tolerances).map(|(apart, most)| apart / most).fold(0.0, f32::max)
    }

    /// The sum over all places of the squares of how long the difference of `N` values of both sides is, beside their tolerances.
    ///
    /// # Panics
    /// As [`Seams::close`].
    #[must_use]
    pub fn squares_apart<const N: usize>(&self, values: &[[f32; N]], tolerances: &[f32]) -> f64 {
        assert_eq!(tolerances.len(), self.matches.len(), "a tolerance for each place");
        self.lengths(&self.of_touched(values)).zip(tolerances).map(|(apart, most)| f64::from(apart / most).powi(2)).sum()
    }

    /// How long the differences between both sides are.
    fn lengths<const N: usize>(&self, own: &[[f32; N]]) -> impl Iterator<Item = f32> {
        self.matches.iter().map(|matched| length(matched.apart(own)))
    }

    /// Changes several values of each texel, one after the other in `values`, all at least 0 and some (where what is dark lies beside what is lit) no greater than they were, until both sides of all places are
    /// shown within `codes` of one another ([`shown_codes`]), or it does not get better. A place that is nearer than half of that already changes nothing: where charts are a few texels wide, all their borders make one net in which equality
    /// everywhere asks for what nobody sees. `white` and `codes` are above 0; where they are not, nothing is changed.
    ///
    /// # Panics
    /// As [`Seams::close`].
    pub fn close_shown(&self, values: &mut [f32], white: f32, codes: f32) {
        if !(white > 0.0 && codes > 0.0) {
            return;
        }
        let shown = |_: usize, off: f32, [middle]: [f32; 1]| {
            // no code is narrower than those of what is darkest: most places are near enough by these
            let least = shown_codes(1.0, 0.0, white);
            if off * least <= 0.5 * codes { least } else { shown_codes(1.0, middle, white) }
        };
        let near = Near { tolerance: codes, enough: 0.5 * codes, shown };
        if self.texels > 0 {
            values.par_chunks_mut(self.texels).for_each(|values| {
                let values = values.as_chunks_mut::<1>().0;
                let mut own = self.of_touched(values);
                let caps: Vec<f32> =
                    own.iter().zip(&self.is_capped).map(|([own], capped)| if *capped { *own } else { f32::INFINITY }).collect();
                let bounds = |texel: usize| [0.0, caps[texel]];
                let shown = |middle| shown_codes(1.0, middle, white);
                let held = |_: usize, [value]: [f32; 1]| shown(value) * shown(value);
                let terms = Terms { shown: |_, [middle]: [f32; 1]| shown(middle), held, bounds };
                for _ in 0..TURNS {
                    self.bring_together(&mut own, bounds, MOST_ROUNDS, &near);
                    if self.settle(&mut own, codes, MOST_TIMES, &terms) {
                        break;
                    }
                }
                self.put(&own, values);
            });
        }
    }

    /// So many of Kaczmarz's rounds over the values of touched texels, each of which stays within its `bounds`.
    fn bring_together<const N: usize>(
        &self,
        own: &mut [[f32; N]],
        bounds: impl Fn(usize) -> [f32; 2],
        rounds: usize,
        near: &Near<impl Fn(usize, f32, [f32; N]) -> f32>,
    ) {
        let mut apart: Vec<(&Match, f32)> = Vec::new();
        for round in 0..rounds {
            // most places come together at once: what is still apart is asked alone between rounds over all of them
            let is_whole = round % ALONE == 0;
            if is_whole {
                let shown =
                    |(place, matched): (usize, &Match)| (near.shown)(place, length(matched.apart(own)), matched.middle(own));
                let counted = self.matches.iter().enumerate().map(|place| (place.1, shown(place)));
                apart = counted.collect();
            }
            apart.retain(|(matched, shown)| {
                let off = matched.apart(own);
                let apart = length(off) * shown;
                if apart > near.enough {
                    let ease = |i: usize| self.ease[matched.texels[i] as usize];
                    let sum: f32 = (0..8).map(|i| ease(i) * matched.weights[i] * matched.weights[i]).sum();
                    let beyond = 1.0 - near.enough / apart;
                    for i in (0..8).filter(|_| sum > 0.0) {
                        let texel = matched.texels[i] as usize;
                        let [least, most] = bounds(texel);
                        let by = beyond * ease(i) * matched.weights[i] / sum;
                        own[texel].iter_mut().zip(off).for_each(|(own, off)| *own = (*own - off * by).min(most).max(least));
                    }
                }
                apart > near.tolerance
            });
            if is_whole && apart.is_empty() {
                break;
            }
        }
    }

    fn put<T: Copy>(&self, own: &[T], values: &mut [T]) {
        self.touched.iter().zip(own).for_each(|(&texel, value)| values[texel as usize] = *value);
    }

    fn of_touched<T: Copy>(&self, values: &[T]) -> Vec<T> {
        assert_eq!(values.len(), self.texels, "a value for each texel");
        self.touched.iter().map(|&texel| values[texel as usize]).collect()
    }

    /// The mean of both sides of each place, of one value of each texel.
    ///
    /// # Panics
    /// When there are not as many values as texels.
    #[must_use]
    pub fn middles(&self, values: &[f32]) -> Vec<f32> {
        let own = self.of_touched(values.as_chunks().0);
        self.matches.iter().map(|matched| matched.middle::<1>(&own)[0]).collect()
    }

    /// Gives texels that are not `known` the mean of what the other sides of their borders show, of several values of each texel; from sides of which every texel is known. Returns those that it
    /// gave something to, ascending; they are not known yet.
    ///
    /// # Panics
    /// When there is not a mark for each texel, and as many values of each.
    pub fn carry(&self, values: &mut [f32], known: &[bool]) -> Vec<u32> {
        assert_eq!(known.len(), self.texels, "a mark for each texel");
        let width = values.len() / self.texels.max(1);
        assert_eq!(values.len(), width * self.texels, "as many values of each texel");
        let mut given: BTreeMap<u32, (f32, Vec<f32>)> = BTreeMap::new();
        for matched in &self.matches {
            let side = |first: usize| (first..first + 4).filter(|&i| matched.weights[i] != 0.0);
            let texel = |i: usize| self.touched[matched.texels[i] as usize];
            for [to, from] in [[0, 4], [4, 0]].into_iter().filter(|[_, from]| side(*from).all(|i| known[texel(i) as usize])) {
                for taker in side(to).filter(|&i| !known[texel(i) as usize]) {
                    let counts = matched.weights[taker].abs();
                    let (sum, sums) = given.entry(texel(taker)).or_insert_with(|| (0.0, vec![0.0; width]));
                    *sum += counts;
                    for giver in side(from) {
                        let shown = &values[texel(giver) as usize * width..][..width];
                        let counts = counts * matched.weights[giver].abs();
                        sums.iter_mut().zip(shown).for_each(|(sum, value)| *sum += counts * value);
                    }
                }
            }
        }
        for (texel, (sum, sums)) in &given {
            let of_texel = &mut values[*texel as usize * width..][..width];
            of_texel.iter_mut().zip(sums).for_each(|(value, of_all)| *value = of_all / sum);
        }
        given.into_keys().collect()
    }

    /// By how much both sides differ at most.
    ///
    /// # Panics
    /// As [`Seams::close`].
    #[must_use]
    pub fn widest(&self, values: &[f32]) -> f32 {
        self.lengths::<1>(&self.of_touched(values.as_chunks().0)).fold(0.0, f32::max)
    }

    /// By how many codes of eight bits both sides are shown apart at most ([`shown_codes`]), of one value of each texel.
    ///
    /// # Panics
    /// As [`Seams::close`].
    #[must_use]
    pub fn widest_shown(&self, values: &[f32], white: f32) -> f32 {
        self.shown_apart(values, white).into_iter().fold(0.0, f32::max)
    }

    /// By how many codes both sides are shown apart, place by place.
    ///
    /// # Panics
    /// As [`Seams::close`].
    #[must_use]
    pub fn shown_apart(&self, values: &[f32], white: f32) -> Vec<f32> {
        let own = self.of_touched(values.as_chunks().0);
        let shown = |matched: &Match| shown_codes(length::<1>(matched.apart(&own)), matched.middle::<1>(&own)[0], white);
        self.matches.iter().map(shown).collect()
    }

    /// The texels that each place is filtered from, on both sides.
    pub fn places(&self) -> impl Iterator<Item = impl Iterator<Item = u32> + Clone + '_> + '_ {
        let touched = self.touched.as_slice();
        self.matches.iter().map(move |matched| matched.asked().map(move |(texel, _)| touched[texel as usize]))
    }
}

impl Match {
    /// Its texels and their weights, without those that count nothing.
    fn asked(&self) -> impl Iterator<Item = (u32, f32)> + Clone + use<> {
        let Self { texels, weights } = *self;
        (0..8).filter(move |&i| weights[i] != 0.0).map(move |i| (texels[i], weights[i]))
    }

    /// What is filtered on one side and on the other, the other's below 0.
    fn sides<const N: usize>(&self, values: &[[f32; N]]) -> [[f32; N]; 2] {
        [0, 4].map(|first| weighted(&self.texels[first..first + 4], &self.weights[first..first + 4], values))
    }

    /// By how much both sides are apart.
    fn apart<const N: usize>(&self, values: &[[f32; N]]) -> [f32; N] {
        let [one, other] = self.sides(values);
        std::array::from_fn(|i| one[i] + other[i])
    }

    /// The mean of both sides.
    fn middle<const N: usize>(&self, values: &[[f32; N]]) -> [f32; N] {
        let [one, other] = self.sides(values);
        std::array::from_fn(|i| 0.5 * (one[i] - other[i]))
    }
}

/// The sum of what some texels have, as much as each counts.
fn weighted<const N: usize>(texels: &[u32], weights: &[f32], values: &[[f32; N]]) -> [f32; N] {
    let mut sum = [0.0; N];
    for (texel, weight) in texels.iter().zip(weights) {
        sum.iter_mut().zip(values[*texel as usize]).for_each(|(sum, value)| *sum += weight * value);
    }
    sum
}

fn dot<const N: usize>(a: [f32; N], b: [f32; N]) -> f32 {
    a.into_iter().zip(b).map(|(a, b)| a * b).sum()
}

fn length<const N: usize>(v: [f32; N]) -> f32 {
    dot(v, v).sqrt()
}

/// By how many of the 255 steps of eight bits something white is shown apart under two lights that differ by `off` about `middle`: exposed so that light of `white`, and wherever there is more, that,
/// is shown as white, and encoded as sRGB is. What is darker than white is shown apart by less: the code's steps are the wider the brighter it is, and no brighter than white.
#[must_use]
pub fn shown_codes(off: f32, middle: f32, white: f32) -> f32 {
    let exposed = white.max(middle).max(f32::MIN_POSITIVE);
    let at = middle.max(0.0) / exposed;
    // the slope of the curve (IEC 61966-2-1)
    let slope = if at <= 0.003_130_8 { 12.92 } else { 1.055 / 2.4 * libm::powf(at, 1.0 / 2.4 - 1.0) };
    255.0 * slope * off.abs() / exposed
}

const NOBODY: u32 = u32::MAX;

/// The four texels that a place is filtered from, and their weights, together 1; what has no texel is left out: rounding alone asks for it.
fn filter(at: Vec2, texel: impl Fn(u32, u32) -> u32) -> Option<[(u32, f32); 4]> {
    let from = (at - 0.5).floor().max(Vec2::ZERO);
    let share = (at - 0.5 - from).clamp(Vec2::ZERO, Vec2::ONE);
    let one = |dx: u32, dy: u32| {
        let along = |share: f32, d: u32| if d == 1 { share } else { 1.0 - share };
        (texel(from.x as u32 + dx, from.y as u32 + dy), along(share.x, dx) * along(share.y, dy))
    };
    let mut four = [one(0, 0), one(1, 0), one(0, 1), one(1, 1)];
    let known = four.iter().find(|(texel, _)| *texel != NOBODY)?.0;
    four.iter_mut().filter(|(texel, _)| *texel == NOBODY).for_each(|one| *one = (known, 0.0));
    let sum: f32 = four.iter().map(|(_, weight)| weight).sum();
    (sum > 0.0).then(|| four.map(|(texel, weight)| (texel, weight / sum)))
}

struct Surface<'a, F> {
    unwrapped: &'a Unwrapped,
    positions: &'a [Vec3],
    normals: &'a [Vec3],
    triangles: &'a [[u32; 3]],
    size: Vec2,
    a_texel: f32,
    filter: &'a F,
}

impl<F: Fn(usize, Vec2) -> Option<[(u32, f32); 4]>> Surface<'_, F> {
    /// Adds the places along an edge whose two triangles run along it in opposite ways.
    fn match_sides(&self, a: HalfEdge, b: HalfEdge, matches: &mut Vec<Match>) {
        let (one, other) = (a.triangle as usize, b.triangle as usize);
        if self.unwrapped.chart[one] == self.unwrapped.chart[other] || !self.is_smooth(a, b) {
            return;
        }
        let ends = |side: HalfEdge| {
            let corners = self.unwrapped.triangles[side.triangle as usize];
            let corner = usize::from(side.corner);
            [corners[corner], corners[(corner + 1) % 3]].map(|v| self.unwrapped.uvs[v as usize] * self.size)
        };
        let (of_one, [last, first]) = (ends(a), ends(b));
        let of_other = [first, last];
        let length = of_one[0].distance(of_one[1]).max(of_other[0].distance(of_other[1]));
        let steps = (self.a_texel * length).ceil().clamp(1.0, 65_536.0) as u32;
        for step in 0..=steps {
            let at = |ends: [Vec2; 2]| ends[0].lerp(ends[1], step as f32 / steps as f32);
            let sides = ((self.filter)(one, at(of_one)), (self.filter)(other, at(of_other)));
            if let (Some(one), Some(other)) = sides {
                let mut matched = Match { texels: [0; 8], weights: [0.0; 8] };
                for (place, (texel, weight)) in one.into_iter().chain(other).enumerate() {
                    matched.texels[place] = texel;
                    matched.weights[place] = if place < 4 { weight } else { -weight };
                }
                matches.push(matched);
            }
        }
    }

    fn is_smooth(&self, a: HalfEdge, b: HalfEdge) -> bool {
        let normals = |side: HalfEdge| {
            let corners = self.triangles[side.triangle as usize];
            let corner = usize::from(side.corner);
            let [a, b, c] = corners.map(|v| self.positions[v as usize]);
            let plane = unit_or((b - a).cross(c - a), Vec3::ZERO);
            // a normal that is no direction says nothing of creases
            let shading = |v: u32| self.normals.get(v as usize).map_or(plane, |normal| unit_or(*normal, plane));
            [corners[corner], corners[(corner + 1) % 3]].map(shading)
        };
        let ([first, last], [last_beside, first_beside]) = (normals(a), normals(b));
        let alike = |a: Vec3, b: Vec3| a.dot(b) >= SMOOTH;
        alike(first, first_beside) && alike(last, last_beside)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packing::PackParams;
    use crate::texels::texels;
    use crate::unwrap::{UnwrapParams, unwrap};
    use heliodon_testkit::scenes::ball;

    const SIDES: [u32; 2] = [300, 200];

    fn params() -> UnwrapParams {
        let [width, height] = SIDES;
        UnwrapParams { pack: PackParams { width, height, ..PackParams::default() }, ..UnwrapParams::default() }
    }

    #[test]
    fn both_sides_of_a_ball_s_seams_show_the_same() {
        let ball = ball(1.0, 24);
        let unwrapped = unwrap(&ball.positions, &ball.triangles, &[], &params()).unwrap();
        let texels = texels(&unwrapped, SIDES[0], SIDES[1]);
        let seams = Seams::new(&unwrapped, (&ball.positions, &ball.normals, &ball.triangles), &texels, SIDES);
        assert!(seams.len() > 1000, "{}", seams.len());
        let dense = Seams::with_places(&unwrapped, (&ball.positions, &ball.normals, &ball.triangles), &texels, SIDES, 19.7);
        let place = |texel: &Texel| texel.mix(ball.triangles[texel.triangle as usize].map(|v| ball.positions[v as usize]));
        let smooth = |p: Vec3| 0.5 + 0.3 * p.y + 0.2 * p.x * p.z;
        let with_shadow = |p: Vec3| smooth(p) + if p.x + 0.3 * p.z > 0.1 { 0.3 } else { 0.0 };
        let lights: [(&dyn Fn(Vec3) -> f32, f32); 2] = [(&smooth, 0.5 / 255.0), (&with_shadow, 3.0 / 255.0)];
        for (light, most) in lights {
            let before: Vec<f32> = texels.iter().map(|texel| light(place(texel))).collect();
            assert!(dense.widest(&before) > 1.5 * most, "{}", dense.widest(&before));
            let mut values = before.clone();
            let tolerances = vec![0.1 / 255.0; seams.len()];
            let left = seams.close::<1>(values.as_chunks_mut().0, &tolerances) * tolerances[0];
            // between the places that were matched as well
            assert!(left <= most && dense.widest(&values) <= most, "{left} and {}", dense.widest(&values));
            let covered = texels.iter().zip(before.iter().zip(&values)).filter(|(texel, _)| texel.is_covered);
            let moved: Vec<f32> = covered.map(|(_, (before, after))| (before - after).abs()).collect();
            let mean = moved.iter().sum::<f32>() / moved.len() as f32;
            assert!(mean < 0.004, "{mean}");
            // several at once, of which some are equal already: those move by no more than may be apart
            let mut three: Vec<[f32; 3]> = before.iter().map(|&value| [value, 0.2, 2.0 * value]).collect();
            let left = seams.close(&mut three, &tolerances) * tolerances[0];
            let moved = three.iter().map(|values| (values[1] - 0.2).abs()).fold(0.0, f32::max);
            assert!(left <= most && moved <= most, "{left} and {moved}");
            for i in [0, 2] {
                let of_one: Vec<f32> = three.iter().map(|values| values[i]).collect();
                assert!(dense.widest(&of_one) <= most, "{}", dense.widest(&of_one));
            }
        }
    }

    #[test]
    fn creases_stay() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        let triangles = [[0, 1, 2], [1, 0, 3]];
        let unwrapped = unwrap(&positions, &triangles, &[], &params()).unwrap();
        assert_eq!(unwrapped.charts.len(), 2);
        let texels = texels(&unwrapped, SIDES[0], SIDES[1]);
        assert!(Seams::new(&unwrapped, (&positions, &[], &triangles), &texels, SIDES).is_empty());
    }

    /// Six squares in a row, each in a chart of its own.
    fn row() -> (Vec<Vec3>, Vec<[u32; 3]>, Unwrapped) {
        let positions: Vec<Vec3> = (0..7_u8).flat_map(|x| [0.0, 1.0].map(|y| Vec3::new(f32::from(x), y, 0.0))).collect();
        let triangles: Vec<[u32; 3]> =
            (0..6).flat_map(|i| [[0, 2, 3], [0, 3, 1]].map(|t: [u32; 3]| t.map(|v| v + 2 * i))).collect();
        let mut cut = params();
        cut.charts.longest = 0.5;
        let unwrapped = unwrap(&positions, &triangles, &[], &cut).unwrap();
        assert!(unwrapped.charts.len() >= 6);
        (positions, triangles, unwrapped)
    }

    #[test]
    fn places_that_are_left_open_tie_nothing_together() {
        let (positions, triangles, unwrapped) = row();
        let texels = texels(&unwrapped, SIDES[0], SIDES[1]);
        let place = |texel: &Texel| texel.mix(triangles[texel.triangle as usize].map(|v| positions[v as usize])).x;
        // bright, a wall from 2.5 to 3.5, and dark behind it
        let before: Vec<f32> =
            texels.iter().map(|texel| if place(texel) < 2.7 { 1.0 + 0.1 * place(texel) } else { 0.0 }).collect();
        let valid: Vec<bool> = texels.iter().map(|texel| !(2.5..=3.5).contains(&place(texel))).collect();
        let surface = (positions.as_slice(), &[][..], triangles.as_slice());
        let mut seams = Seams::new(&unwrapped, surface, &texels, SIDES);
        let keep: Vec<bool> = seams.places().map(|mut place| place.all(|texel| valid[texel as usize])).collect();
        seams.keep(&keep);
        let mut after = before.clone();
        seams.close::<1>(after.as_chunks_mut().0, &vec![1e-4; seams.len()]);
        for (((texel, valid), before), after) in texels.iter().zip(&valid).zip(&before).zip(&after) {
            assert!(place(texel) < 3.5 || *after == 0.0, "dark stays dark: {after}");
            assert!(*valid || before == after);
        }
        assert!(before != after && seams.widest(&after) <= 1e-4);
    }

    #[test]
    fn what_is_not_known_takes_what_is_shown_beside_it() {
        let (positions, triangles, unwrapped) = row();
        let texels = texels(&unwrapped, SIDES[0], SIDES[1]);
        let seams = Seams::new(&unwrapped, (&positions, &[], &triangles), &texels, SIDES);
        // the third of the squares, between what is bright and what is dim
        let known: Vec<bool> = texels.iter().map(|texel| texel.triangle / 2 != 2).collect();
        let of = |texel: &Texel| match texel.triangle / 2 {
            2 => [0.0, 0.0],
            square => [if square < 2 { 3.0 } else { 1.0 }, 0.5],
        };
        let before: Vec<f32> = texels.iter().flat_map(of).collect();
        let mut values = before.clone();
        let given = seams.carry(&mut values, &known);
        assert!(!given.is_empty() && given.is_sorted());
        for (texel, values) in (0..).zip(values.chunks_exact(2)) {
            let is_given = given.binary_search(&texel).is_ok();
            assert!(is_given || values == &before[2 * texel as usize..][..2], "{texel} was known, or lies at no border");
            assert!(!is_given || (!known[texel as usize] && values[0] > 0.99 && values[0] < 3.01), "{values:?}");
            assert!(!is_given || (values[1] - 0.5).abs() < 1e-5, "{values:?}");
        }
        let has = |light: f32| given.iter().any(|&texel| (values[2 * texel as usize] - light).abs() < 1e-5);
        assert!(has(3.0) && has(1.0), "of both neighbours");
    }

    #[test]
    fn slivers_without_area_tie_no_borders_together() {
        let (mut positions, mut triangles, _) = row();
        let corner = positions.len() as u32;
        // far from the row, and slivers whose sides are sides of both
        positions.extend([Vec3::new(20.0, 0.0, 0.0), Vec3::new(21.0, 0.0, 0.0), Vec3::new(20.0, 1.0, 0.0)]);
        triangles.push([corner, corner + 1, corner + 2]);
        let seams = |triangles: &[[u32; 3]]| {
            let unwrapped = unwrap(&positions, triangles, &[], &params()).unwrap();
            let texels = texels(&unwrapped, SIDES[0], SIDES[1]);
            let sheets: Vec<u32> = texels.iter().map(|texel| texel.triangle).collect();
            let seams = Seams::new(&unwrapped, (&positions, &[], triangles), &texels, SIDES);
            seams.touched.iter().map(|&texel| sheets[texel as usize]).collect::<Vec<_>>()
        };
        assert!(!seams(&triangles).contains(&(triangles.len() as u32 - 1)));
        let far = triangles.len() as u32 - 1;
        // (12, 0) and (20, 0) and (21, 0) lie on one line
        triangles.extend([[12, corner + 1, corner], [12, corner, corner + 1], [0, 2, 12], [2, 0, 12]]);
        let with_slivers = seams(&triangles);
        assert!(!with_slivers.contains(&far) && with_slivers.iter().all(|&t| t < far), "{with_slivers:?}");
    }
}
