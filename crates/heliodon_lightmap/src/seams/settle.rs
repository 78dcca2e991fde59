//! What Kaczmarz's rounds leave apart: nets of narrow charts, in which each place that comes together moves others again, and what one chart needs reaches the next a round
//! later.
//!
//! There half the squares of what places are shown apart beyond what is enough are brought to nothing, all of a net at once, by conjugate gradients (E. Polak, G. Ribière: "Note
//! sur la convergence de méthodes de directions conjuguées", 1969). Begun where the rounds have ended, around the places that are still apart alone, and ended as soon as all
//! are near enough: to be exactly equal along a net moves its values far from what was found. There is always an end, for a net whose values are all alike is one.

use super::{Match, NOBODY, Seams, dot, length, weighted};

/// Steps between which it is asked anew what is apart, and what a difference counts.
const STEPS: usize = 512;
/// Texels change so many places around those that are apart, and twice as far each time.
const REACH: usize = 16;
/// How often it becomes twice as far.
const WIDER: usize = 8;
/// Steps to the least along a way; squares that begin somewhere are not one parabola.
const ALONG: usize = 8;

/// How places are brought together.
pub(super) struct Terms<S, E, B> {
    /// What a difference of 1 counts, of the place and the mean of its sides.
    pub shown: S,
    /// By what a texel's ease is divided, of the texel and its value: the square of what a difference of 1 counts there.
    pub held: E,
    /// The least and the most that a texel may become.
    pub bounds: B,
}

impl Seams {
    /// Changes the values of touched texels until no place counts more than `most`, as far as half of that; returns whether none does.
    pub(super) fn settle<const N: usize>(
        &self,
        own: &mut [[f32; N]],
        most: f32,
        times: usize,
        terms: &Terms<impl Fn(usize, [f32; N]) -> f32, impl Fn(usize, [f32; N]) -> f32, impl Fn(usize) -> [f32; 2]>,
    ) -> bool {
        let is_apart = |place: u32, matched: &Match, own: &[[f32; N]]| {
            length(matched.apart(own)) * (terms.shown)(place as usize, matched.middle(own)) > most
        };
        let mut asks: Option<Asks> = None;
        for time in 0..times {
            let apart: Vec<u32> =
                (0..).zip(&self.matches).filter(|(place, matched)| is_apart(*place, matched, own)).map(|(i, _)| i).collect();
            if apart.is_empty() {
                return true;
            }
            let asks = asks.get_or_insert_with(|| Asks::new(&self.matches, own.len()));
            let mut net = Net::around(self, asks, &apart, REACH << time.min(WIDER), own, terms);
            net.hold(&terms.bounds, 0.5 * most);
            net.relax(0.5 * most, most);
            for (texel, value) in net.texels.iter().map(|&texel| texel as usize).zip(&net.values) {
                let [least, most] = (terms.bounds)(texel);
                own[texel] = value.map(|value| value.min(most).max(least));
            }
        }
        false
    }
}

/// Which places ask for a texel.
pub(super) struct Asks {
    /// Where each texel's begin in `places`, and the end of all.
    starts: Vec<u32>,
    places: Vec<u32>,
}

impl Asks {
    pub fn new(matches: &[Match], texels: usize) -> Self {
        let mut pairs: Vec<(u32, u32)> =
            (0..).zip(matches).flat_map(|(place, matched)| matched.asked().map(move |(texel, _)| (texel, place))).collect();
        pairs.sort_unstable();
        let starts = (0..=texels as u32).map(|texel| pairs.partition_point(|pair| pair.0 < texel) as u32).collect();
        Self { starts, places: pairs.into_iter().map(|(_, place)| place).collect() }
    }

    pub fn of(&self, texel: u32) -> &[u32] {
        &self.places[self.starts[texel as usize] as usize..self.starts[texel as usize + 1] as usize]
    }
}

/// A place of a net: what its texels count, and by how many codes its sides are shown apart, with a sign.
struct Row<const N: usize> {
    texels: [u32; 8],
    weights: [f32; 8],
    /// How many of its texels count.
    count: usize,
    apart: [f32; N],
}

impl<const N: usize> Row<N> {
    fn texels(&self) -> &[u32] {
        &self.texels[..self.count]
    }

    fn weights(&self) -> &[f32] {
        &self.weights[..self.count]
    }
}

/// Texels that may change, and all places that ask for any of them.
struct Net<const N: usize> {
    /// Numbers of [`Seams::touched`].
    texels: Vec<u32>,
    values: Vec<[f32; N]>,
    /// How easily each changes: a code there is worth a code elsewhere.
    ease: Vec<f32>,
    rows: Vec<Row<N>>,
}

impl<const N: usize> Net<N> {
    fn around<B>(
        seams: &Seams,
        asks: &Asks,
        apart: &[u32],
        reach: usize,
        own: &[[f32; N]],
        terms: &Terms<impl Fn(usize, [f32; N]) -> f32, impl Fn(usize, [f32; N]) -> f32, B>,
    ) -> Self {
        let mut number = vec![NOBODY; own.len()];
        let mut is_row = vec![false; seams.matches.len()];
        let (mut texels, mut places) = (Vec::new(), apart.to_vec());
        for _ in 0..reach {
            let before = texels.len();
            for (texel, _) in places.drain(..).flat_map(|place: u32| seams.matches[place as usize].asked()) {
                if number[texel as usize] == NOBODY {
                    number[texel as usize] = texels.len() as u32;
                    texels.push(texel);
                }
            }
            for &place in texels[before..].iter().flat_map(|&texel| asks.of(texel)) {
                if !std::mem::replace(&mut is_row[place as usize], true) {
                    places.push(place);
                }
            }
        }
        let row = |(place, matched): (usize, &Match)| {
            let counts = (terms.shown)(place, matched.middle(own));
            let apart = matched.apart(own).map(|apart| counts * apart);
            let mut row = Row { texels: [0; 8], weights: [0.0; 8], count: 0, apart };
            for (texel, weight) in matched.asked().filter(|(texel, _)| number[*texel as usize] != NOBODY) {
                (row.texels[row.count], row.weights[row.count]) = (number[texel as usize], counts * weight);
                row.count += 1;
            }
            row
        };
        let rows = seams.matches.iter().enumerate().filter(|(place, _)| is_row[*place]).map(row).collect();
        let values: Vec<[f32; N]> = texels.iter().map(|&texel| own[texel as usize]).collect();
        let ease = |(&texel, &value): (&u32, &[f32; N])| seams.ease[texel as usize] / (terms.held)(texel as usize, value);
        let ease = texels.iter().zip(&values).map(ease).collect();
        Self { texels, values, ease, rows }
    }

    /// Leaves texels as they are that are as bright as they may be and would become brighter.
    fn hold(&mut self, bounds: &impl Fn(usize) -> [f32; 2], enough: f32) {
        let gradient = self.gradient(enough);
        for (i, texel) in self.texels.iter().enumerate() {
            let most = bounds(*texel as usize)[1];
            if self.values[i].iter().zip(gradient[i]).any(|(value, gradient)| *value >= most && gradient < 0.0) {
                self.ease[i] = 0.0;
            }
        }
    }

    /// What half the squares of what places are apart beyond what is enough become greater by, for a texel's value.
    fn gradient(&self, enough: f32) -> Vec<[f32; N]> {
        let mut gradient = vec![[0.0; N]; self.values.len()];
        for row in &self.rows {
            let beyond = beyond(length(row.apart), enough);
            for (texel, weight) in row.texels().iter().zip(row.weights()).filter(|_| beyond > 0.0) {
                let by = beyond * weight;
                gradient[*texel as usize].iter_mut().zip(row.apart).for_each(|(gradient, apart)| *gradient += by * apart);
            }
        }
        gradient
    }

    /// Steps until no place is further apart than `most`, as far as `enough`.
    fn relax(&mut self, enough: f32, most: f32) {
        let count = self.values.len();
        let (mut way, mut gradient) = (vec![[0.0_f32; N]; count], vec![[0.0_f32; N]; count]);
        let (mut moved, mut lines) = (vec![[0.0_f32; N]; self.rows.len()], vec![Line::default(); self.rows.len()]);
        let mut last = f64::INFINITY;
        for _ in 0..STEPS {
            let before = std::mem::replace(&mut gradient, self.gradient(enough));
            let along = |other: &[[f32; N]]| -> f64 {
                let products = self.ease.iter().zip(&gradient).zip(other);
                products.map(|((ease, gradient), other)| f64::from(*ease) * f64::from(dot(*gradient, *other))).sum()
            };
            let (square, with_before) = (along(&gradient), along(&before));
            // nothing is left, or it is no number
            if !(square > 0.0 && square.is_finite()) {
                break;
            }
            let share = ((square - with_before) / last).max(0.0) as f32;
            last = square;
            for ((way, ease), by) in way.iter_mut().zip(&self.ease).zip(&gradient) {
                way.iter_mut().zip(by).for_each(|(way, by)| *way = share * *way - ease * by);
            }
            for ((moved, line), row) in moved.iter_mut().zip(&mut lines).zip(&self.rows) {
                *moved = weighted(row.texels(), row.weights(), &way);
                *line = Line::new(row.apart, *moved);
            }
            let step = least_along(&lines, enough);
            let further = |to: &mut [f32; N], by: &[f32; N]| to.iter_mut().zip(by).for_each(|(to, by)| *to += step * by);
            self.values.iter_mut().zip(&way).for_each(|(value, way)| further(value, way));
            self.rows.iter_mut().zip(&moved).for_each(|(row, moved)| further(&mut row.apart, moved));
            if self.rows.iter().all(|row| length(row.apart) <= most) {
                break;
            }
        }
    }
}

/// How long what is apart becomes along a way.
#[derive(Clone, Copy, Default)]
struct Line {
    /// The square of what is apart at its beginning, what it has of the way, and the square of the way.
    apart: f32,
    both: f32,
    moved: f32,
}

impl Line {
    fn new<const N: usize>(apart: [f32; N], moved: [f32; N]) -> Self {
        Self { apart: dot(apart, apart), both: dot(apart, moved), moved: dot(moved, moved) }
    }
}

/// How far along a way half the squares of what places are apart beyond what is enough are least (Newton's steps).
fn least_along(lines: &[Line], enough: f32) -> f32 {
    let mut step = 0.0_f64;
    for _ in 0..ALONG {
        let (mut slope, mut bend) = (0.0, 0.0);
        let by = step as f32;
        for line in lines {
            let square = line.apart + by * (2.0 * line.both + by * line.moved);
            if square > enough * enough {
                let along = line.both + by * line.moved;
                let beyond = beyond(square.sqrt(), enough);
                slope += f64::from(beyond * along);
                // what is apart turns while it becomes shorter
                let straight = along * along / square;
                bend += f64::from(straight + beyond * (line.moved - straight).max(0.0));
            }
        }
        if bend <= 0.0 {
            break;
        }
        step -= slope / bend;
        if slope.abs() <= 1.0e-3 * bend * step.abs() {
            break;
        }
    }
    step as f32
}

/// Which part of what is apart lies beyond what is enough.
fn beyond(apart: f32, enough: f32) -> f32 {
    if apart > enough { 1.0 - enough / apart } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::{Near, shown_codes};
    use super::*;
    use crate::packing::PackParams;
    use crate::solve::match_seams;
    use crate::texels::{Texel, texels};
    use crate::unwrap::{UnwrapParams, unwrap};
    use glam::Vec3;
    use heliodon_math::random::Pcg32;

    const FOLDS: u32 = 120;

    /// A curtain of folds, each side of one a chart of its own that is as wide as a texel: its vertices, triangles and texels, and its borders.
    fn curtain() -> (Vec<Vec3>, Vec<[u32; 3]>, Vec<Texel>, Seams) {
        let corner = |i: u32| {
            let [x, y] = [i / 2, i / 2 % 2].map(|n| n as f32);
            Vec3::new(0.1 * x, 0.15 * y, (i % 2) as f32)
        };
        let positions: Vec<Vec3> = (0..2 * FOLDS + 2).map(corner).collect();
        let triangles: Vec<[u32; 3]> =
            (0..FOLDS).flat_map(|i| [[0, 1, 3], [0, 3, 2]].map(|t: [u32; 3]| t.map(|v| v + 2 * i))).collect();
        let normals = vec![Vec3::Y; positions.len()];
        let sides = [64; 2];
        let pack = PackParams { width: sides[0], height: sides[1], ..PackParams::default() };
        let unwrapped = unwrap(&positions, &triangles, &[], &UnwrapParams { pack, ..UnwrapParams::default() }).unwrap();
        assert_eq!(unwrapped.charts.len(), FOLDS as usize);
        let texels = texels(&unwrapped, sides[0], sides[1]);
        let seams = Seams::new(&unwrapped, (&positions, &normals, &triangles), &texels, sides);
        (positions, triangles, texels, seams)
    }

    #[test]
    fn what_little_is_lit_stays_lit() {
        let (_, _, texels, seams) = curtain();
        // four sides of 120: less than a twentieth
        let is_lit = |texel: &Texel| (40..48).contains(&texel.triangle);
        let mut rng = Pcg32::new(3, 3);
        let before: Vec<Vec3> =
            texels.iter().map(|texel| if is_lit(texel) { Vec3::splat(rng.range_f32(0.5, 1.0)) } else { Vec3::ZERO }).collect();
        let mut light = before.clone();
        let widest = match_seams(&seams, &mut light);
        assert!(widest.codes <= 0.5, "{widest:?}");
        let sum = |light: &[Vec3]| light.iter().map(|light| light.x).sum::<f32>();
        assert!(sum(&light) > 0.5 * sum(&before), "{} of {}", sum(&light), sum(&before));
    }

    /// Under noise that no neighbour shares.
    #[test]
    fn nets_of_narrow_charts_come_together_and_stay_what_they_were() {
        let (positions, triangles, texels, seams) = curtain();
        let mut rng = Pcg32::new(7, 7);
        let place = |t: u32, weights: Vec3| {
            let corners = triangles[t as usize].map(|v| positions[v as usize]);
            corners[0] * weights.x + corners[1] * weights.y + corners[2] * weights.z
        };
        let smooth = |p: Vec3| 0.5 + 0.3 * libm::sinf(p.x) * libm::cosf(2.0 * p.z);
        let before: Vec<f32> =
            texels.iter().map(|texel| smooth(place(texel.triangle, texel.weights)) + rng.range_f32(-0.1, 0.1)).collect();
        let near = Near { tolerance: 0.5, enough: 0.25, shown: |_, _, [middle]: [f32; 1]| shown_codes(1.0, middle, 1.0) };
        let mut own = seams.of_touched(before.as_chunks().0);
        seams.bring_together(&mut own, |_| [0.0, f32::INFINITY], super::super::MOST_ROUNDS, &near);
        let mut rounds = before.clone();
        seams.put(&own, rounds.as_chunks_mut().0);
        assert!(seams.widest_shown(&rounds, 1.0) > 1.0, "{}", seams.widest_shown(&rounds, 1.0));
        let mut values = before.clone();
        seams.close_shown(&mut values, 1.0, 0.5);
        assert!(seams.widest_shown(&values, 1.0) <= 0.5, "{}", seams.widest_shown(&values, 1.0));
        // no further from what was found than the noise was
        let noise = 0.1 / 3.0_f32.sqrt();
        let moved = |values: &[f32]| {
            let squares: f32 = values.iter().zip(&before).map(|(a, b)| (a - b) * (a - b)).sum();
            (squares / values.len() as f32).sqrt()
        };
        assert!(moved(&values) < noise, "{} of {noise}", moved(&values));
        assert!(moved(&values) < 1.1 * moved(&rounds), "{} and {}", moved(&values), moved(&rounds));
        assert!(values.iter().all(|value| *value >= 0.0));
    }
}
