//! A membrane over a graph: what is unknown takes the mean of what it is linked to, by the links' weights, as a soap film that hangs in a frame does.
//!
//! Conjugate gradients with a W-cycle before each step. Its coarser graphs come from joining each node with the neighbour that it is linked to most, twice, so
//! that four nodes become one (Y. Notay, "An aggregation-based algebraic multigrid method", Electronic Transactions on Numerical Analysis 37, 2010): it
//! asks for links alone, and is indifferent to charts, seams and holes. What joined nodes say of smooth errors is too small by about half (D. Braess,
//! "Towards algebraic multigrid for elliptic problems of second order", Computing 55, 1995), hence [`OVERCORRECTION`]. Seven steps do for 5,000 nodes
//! and for 120,000, where a prototype's V-cycles took 14 and 19.

use glam::{DVec3, Vec3};
use heliodon_mesh::topology::Buckets;
use rayon::prelude::*;

/// Nodes whose colours are unknown, with all that holds them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Membrane {
    /// Where each node's links begin, and where the last one's end.
    pub starts: Vec<u32>,
    /// The other node and the link's weight, above 0; each link stands at both its nodes.
    pub links: Vec<(u32, f32)>,
    /// For each node the weight of its links to what is known. Above 0 for some node of all that hang together.
    pub held: Vec<f32>,
    /// For each node the sum of weight times colour of what is known.
    pub pull: Vec<Vec3>,
}

/// A graph of the hierarchy.
struct Level {
    starts: Vec<u32>,
    links: Vec<(u32, f32)>,
    held: Vec<f32>,
    /// Of all links and what holds it, for each node.
    diagonal: Vec<f32>,
    /// The node of the next coarser level that each belongs to, or [`ALONE`]; nothing at the coarsest.
    joined: Vec<u32>,
}

/// A node without links: no other knows anything of it.
const ALONE: u32 = u32::MAX;

/// How much coarse corrections are drawn out: from 1.4 to 1.8 it takes as many steps, and at 2 errors of joined nodes would not shrink.
const OVERCORRECTION: f32 = 1.5;
/// Jacobi steps are shortened to this part, so that they damp what changes from node to node.
const DAMPING: f32 = 0.7;
/// So few nodes are solved by smoothing alone.
const FEW: usize = 64;
/// Smoothing at the coarsest level.
const LAST_SWEEPS: usize = 32;
/// The rest in the energy's norm at which it is done, as a part of the beginning's: far below a step of 8 bits.
const DONE: f64 = 1.0e-5;
/// More steps are not taken.
const MOST_STEPS: usize = 100;
/// Nodes that a task takes together; sums are made in blocks of these, whatever the number of threads.
const BLOCK: usize = 4096;

impl Membrane {
    /// The colour of each node.
    pub fn solved(self) -> Vec<Vec3> {
        self.solved_in_steps().0
    }

    fn solved_in_steps(self) -> (Vec<Vec3>, usize) {
        let mut rest = self.pull;
        let levels = hierarchy(Level::new(self.starts, self.links, self.held));
        let mut colors = vec![Vec3::ZERO; rest.len()];
        let Some(finest) = levels.first() else { return (colors, 0) };
        let mut better = cycle(&levels, &rest);
        let mut along = better.clone();
        let mut size = dot(&rest, &better);
        let enough = size * (DONE * DONE);
        let mut steps = 0;
        while steps < MOST_STEPS && size.cmpgt(enough).any() {
            let moved = finest.times(&along);
            let step = over(size, dot(&along, &moved)).as_vec3();
            add(&mut colors, &along, step);
            add(&mut rest, &moved, -step);
            better = cycle(&levels, &rest);
            let next = dot(&rest, &better);
            let keep = over(next, size).as_vec3();
            along.par_iter_mut().zip(&better).for_each(|(along, better)| *along = *better + *along * keep);
            size = next;
            steps += 1;
        }
        (colors, steps)
    }
}

/// Each colour's quotient; 0 where it is solved already and both are 0.
fn over(above: DVec3, below: DVec3) -> DVec3 {
    let quotient = |a: f64, b: f64| if b > 0.0 { a / b } else { 0.0 };
    DVec3::new(quotient(above.x, below.x), quotient(above.y, below.y), quotient(above.z, below.z))
}

fn dot(a: &[Vec3], b: &[Vec3]) -> DVec3 {
    let block = |(a, b): (&[Vec3], &[Vec3])| a.iter().zip(b).map(|(a, b)| a.as_dvec3() * b.as_dvec3()).sum::<DVec3>();
    a.par_chunks(BLOCK).zip(b.par_chunks(BLOCK)).map(block).collect::<Vec<DVec3>>().into_iter().sum()
}

fn add(to: &mut [Vec3], what: &[Vec3], times: Vec3) {
    to.par_iter_mut().with_min_len(BLOCK).zip(what).for_each(|(to, what)| *to += *what * times);
}

impl Level {
    fn new(starts: Vec<u32>, links: Vec<(u32, f32)>, held: Vec<f32>) -> Self {
        let mut level = Self { starts, links, held, diagonal: Vec::new(), joined: Vec::new() };
        let weight = |node: usize| level.links(node).iter().fold(level.held[node], |sum, (_, weight)| sum + weight);
        level.diagonal = (0..level.held.len()).map(weight).collect();
        level
    }

    fn links(&self, node: usize) -> &[(u32, f32)] {
        &self.links[self.starts[node] as usize..self.starts[node + 1] as usize]
    }

    fn row(&self, node: usize, values: &[Vec3]) -> Vec3 {
        let pulled = |sum: Vec3, (other, weight): &(u32, f32)| sum - values[*other as usize] * *weight;
        self.links(node).iter().fold(values[node] * self.diagonal[node], pulled)
    }

    fn times(&self, values: &[Vec3]) -> Vec<Vec3> {
        (0..values.len()).into_par_iter().with_min_len(BLOCK).map(|node| self.row(node, values)).collect()
    }

    /// One step towards the colours at which nothing is left of `right`.
    fn smoothed(&self, values: &[Vec3], right: &[Vec3]) -> Vec<Vec3> {
        let step = |node: usize| values[node] + (right[node] - self.row(node, values)) * (DAMPING / self.diagonal[node]);
        (0..values.len()).into_par_iter().with_min_len(BLOCK).map(step).collect()
    }
}

/// About what colours leave nothing of `right`: linear in it, symmetric and positive, as conjugate gradients ask for.
fn cycle(levels: &[Level], right: &[Vec3]) -> Vec<Vec3> {
    let Some((level, coarser)) = levels.split_first() else { return Vec::new() };
    let first = |(right, diagonal): (&Vec3, &f32)| *right * (DAMPING / diagonal);
    let mut values: Vec<Vec3> = right.par_iter().zip(&level.diagonal).map(first).collect();
    if coarser.is_empty() {
        for _ in 1..LAST_SWEEPS {
            values = level.smoothed(&values, right);
        }
        return values;
    }
    let mut rest = vec![Vec3::ZERO; coarser[0].diagonal.len()];
    let left = level.times(&values);
    for (node, joined) in level.joined.iter().enumerate().filter(|(_, joined)| **joined != ALONE) {
        rest[*joined as usize] += right[node] - left[node];
    }
    let mut correction = cycle(coarser, &rest);
    // a second time, of what that left
    let left = coarser[0].times(&correction);
    rest.iter_mut().zip(&left).for_each(|(rest, left)| *rest -= *left);
    add(&mut correction, &cycle(coarser, &rest), Vec3::ONE);
    let corrected = |(value, joined): (&mut Vec3, &u32)| {
        *value += correction.get(*joined as usize).map_or(Vec3::ZERO, |correction| *correction * OVERCORRECTION);
    };
    values.par_iter_mut().with_min_len(BLOCK).zip(&level.joined).for_each(corrected);
    level.smoothed(&values, right)
}

fn hierarchy(finest: Level) -> Vec<Level> {
    let mut levels = vec![finest];
    while let Some(level) = levels.last_mut().filter(|level| level.held.len() > FEW) {
        let (pair_of, pairs) = paired(level);
        let halved = joined(level, &pair_of, pairs);
        let (four_of, fours) = paired(&halved);
        let linked = pair_of.iter().filter(|pair| **pair != ALONE).count();
        if fours == 0 || fours * 4 > linked * 3 {
            // stars, whose middles have one partner each: nothing would get much coarser
            break;
        }
        level.joined = pair_of.into_iter().map(|pair| four_of.get(pair as usize).copied().unwrap_or(ALONE)).collect();
        levels.push(joined(&halved, &four_of, fours));
    }
    levels
}

/// For each node the number of the pair that it is in, with itself if it must, or [`ALONE`]; and how many there are.
fn paired(level: &Level) -> (Vec<u32>, usize) {
    let mut pair_of = vec![ALONE; level.held.len()];
    let mut pairs = 0;
    for node in 0..pair_of.len() {
        if pair_of[node] == ALONE && !level.links(node).is_empty() {
            let free = level.links(node).iter().filter(|(other, _)| pair_of[*other as usize] == ALONE);
            // the first of equals, so that rows of an image pair along themselves and then with one another
            let best = free.fold(None, |best: Option<(u32, f32)>, link| best.filter(|best| best.1 >= link.1).or(Some(*link)));
            pair_of[node] = pairs;
            if let Some((other, _)) = best {
                pair_of[other as usize] = pairs;
            }
            pairs += 1;
        }
    }
    (pair_of, pairs as usize)
}

/// The graph of joined nodes: links between two of them become one, links inside of one go.
fn joined(level: &Level, joined_of: &[u32], count: usize) -> Level {
    let members = Buckets::new(count, |give| {
        let kept = joined_of.iter().enumerate().filter(|(_, joined)| **joined != ALONE);
        kept.for_each(|(node, &joined)| give(joined, node as u32));
    });
    let (mut starts, mut links, mut held) = (vec![0], Vec::<(u32, f32)>::new(), Vec::with_capacity(count));
    let mut place_of = vec![usize::MAX; count];
    for (own, nodes) in members.iter() {
        let begin = links.len();
        for &node in nodes {
            for &(other, weight) in level.links(node as usize) {
                let to = joined_of[other as usize];
                match links.get_mut(place_of[to as usize]).filter(|_| place_of[to as usize] >= begin) {
                    _ if to == own => (),
                    Some(link) => link.1 += weight,
                    None => {
                        place_of[to as usize] = links.len();
                        links.push((to, weight));
                    }
                }
            }
        }
        held.push(nodes.iter().map(|&node| level.held[node as usize]).sum());
        starts.push(links.len() as u32);
    }
    Level::new(starts, links, held)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rectangle of unknown nodes in a frame of known ones.
    fn framed(width: usize, height: usize, known: impl Fn(i32, i32) -> Vec3) -> Membrane {
        let mut membrane = Membrane { starts: vec![0], ..Membrane::default() };
        for y in 0..height as i32 {
            for x in 0..width as i32 {
                let (mut held, mut pull) = (0.0, Vec3::ZERO);
                for (x, y) in [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)] {
                    if (0..width as i32).contains(&x) && (0..height as i32).contains(&y) {
                        membrane.links.push(((y as usize * width + x as usize) as u32, 1.0));
                    } else {
                        held += 1.0;
                        pull += known(x, y);
                    }
                }
                membrane.starts.push(membrane.links.len() as u32);
                membrane.held.push(held);
                membrane.pull.push(pull);
            }
        }
        membrane
    }

    #[test]
    fn harmonic_colours_are_restored_in_few_steps_whatever_the_size() {
        for (width, height) in [(1, 1), (7, 5), (61, 90), (400, 300)] {
            // slopes, and x y, are their neighbours' mean everywhere
            let (w, h) = (width as f32, height as f32);
            let truth = |x: i32, y: i32| {
                let (u, v) = (x as f32 / w, y as f32 / h);
                Vec3::new(0.2 + 0.6 * u, 0.9 - 0.5 * v, 0.3 + 0.4 * u * v)
            };
            let (found, steps) = framed(width, height, truth).solved_in_steps();
            let off = |(i, found): (usize, &Vec3)| (*found - truth((i % width) as i32, (i / width) as i32)).abs().max_element();
            let worst = found.iter().enumerate().map(off).fold(0.0, f32::max);
            println!("{width} x {height}: {steps} steps, off by {worst:.6}");
            assert!(worst < 1.0e-3, "{width} x {height}: {worst}");
            assert!(steps < 16, "{width} x {height}: {steps}");
        }
    }

    #[test]
    fn weights_share_as_springs_do_and_nothing_unknown_is_nothing() {
        // 0 -1- a -3- b -1- 1, each colour alone
        let chain = Membrane {
            starts: vec![0, 1, 2],
            links: vec![(1, 3.0), (0, 3.0)],
            held: vec![1.0, 1.0],
            pull: vec![Vec3::ZERO, Vec3::new(1.0, 0.0, 0.5)],
        };
        let found = chain.solved();
        let truth = [3.0 / 7.0, 4.0 / 7.0].map(|x| Vec3::new(x, 0.0, 0.5 * x));
        assert!(found.iter().zip(truth).all(|(found, truth)| (*found - truth).abs().max_element() < 1e-5), "{found:?}");
        assert_eq!(Membrane { starts: vec![0], ..Membrane::default() }.solved(), []);
    }
}
