//! What a view draws: whole clusters, or the triangles that matter.

use super::layout::GROUP;
use super::pages::GpuChunk;
use super::view::ClusterRef;
use glam::Vec3;
use std::ops::Range;

/// One indexed draw.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Draw {
    /// Index of the chunk.
    pub chunk: u32,
    /// Range of the chunk's indices, or of [`Seen::indices`] where single triangles are drawn.
    pub indices: Range<u32>,
}

impl Draw {
    fn triangles(&self) -> u64 {
        self.indices.len() as u64 / 3
    }
}

/// A group of vertices whose light is needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightGroup {
    /// Index of the chunk.
    pub chunk: u32,
    /// Number of the group in it.
    pub group: u16,
}

/// What a view draws.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Seen {
    /// In the order of drawing.
    pub draws: Vec<Draw>,
    /// The light that they need; some more than once.
    pub groups: Vec<LightGroup>,
    /// Where single triangles are drawn, their numbers in their chunks; a draw's indices are three for each.
    pub single: Option<Vec<u32>>,
}

/// Neighbouring triangles of a draw, and the box that they lie in.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// A part of the draw's indices.
    pub indices: Range<u32>,
    /// Least and greatest corner.
    pub bounds: (Vec3, Vec3),
}

/// Runs between two that are drawn specially are drawn so as well where they are fewer indices: that costs less than other draws.
const SPECIAL_BRIDGED_INDICES: u32 = 3 * 256;

/// A draw's runs in as few parts as pay, each with whether any of it is `special`.
pub fn split(runs: &[Run], special: impl Fn((Vec3, Vec3)) -> bool) -> Vec<(Range<u32>, bool)> {
    let mut parts: Vec<(Range<u32>, bool)> = Vec::new();
    for run in runs {
        let is_special = special(run.bounds);
        match parts.last_mut() {
            Some((indices, last)) if *last == is_special => indices.end = run.indices.end,
            _ => parts.push((run.indices.clone(), is_special)),
        }
        // A short plain part between two special ones goes with them.
        if let [.., (before, true), (plain, false), (after, true)] = &mut parts[..]
            && plain.len() < SPECIAL_BRIDGED_INDICES as usize
        {
            before.end = after.end;
            parts.truncate(parts.len() - 2);
        }
    }
    parts
}

/// Clusters that are not drawn although between two that are: fewer than these indices cost less than another draw.
const BRIDGED_INDICES: u32 = 3 * 128;

impl Seen {
    /// Draws of whole clusters, neighbours in one; what is bridged between two of them is drawn as well, but for clusters that are `left_out` (of each chunk;
    /// empty for none): what does not show is as good as not drawn, but they would show, and their light is not asked for.
    #[must_use]
    pub fn clusters(chunks: &[GpuChunk], clusters: &[ClusterRef], left_out: &[NumberSet]) -> Self {
        let mut seen = Self::default();
        let mut last_cluster = 0;
        for &ClusterRef { chunk, cluster: number } in clusters {
            let cluster = &chunks[chunk as usize].kept.clusters[number as usize];
            let next = cluster.indices.clone();
            seen.groups.extend(cluster.groups.iter().map(|&group| LightGroup { chunk, group }));
            let is_bridge = |from: u32| {
                let out = left_out.get(chunk as usize);
                out.is_none_or(|out| !(from..number).any(|between| out.contains(between)))
            };
            match seen.draws.last_mut() {
                Some(last)
                    if last.chunk == chunk
                        && next.start.checked_sub(last.indices.end).is_some_and(|gap| gap <= BRIDGED_INDICES)
                        && is_bridge(last_cluster + 1) =>
                {
                    last.indices.end = next.end;
                }
                _ => seen.draws.push(Draw { chunk, indices: next }),
            }
            last_cluster = number;
        }
        seen
    }

    /// Single triangles by chunk and their numbers in it, in the order of drawing.
    #[must_use]
    pub fn triangles<'a>(chunks: &[GpuChunk], groups: impl IntoIterator<Item = (u32, &'a [u32])>) -> Self {
        let (mut draws, mut lit, mut single): (Vec<Draw>, Vec<LightGroup>, Vec<u32>) = Default::default();
        for (chunk, numbers) in groups.into_iter().filter(|(_, numbers)| !numbers.is_empty()) {
            let kept = &chunks[chunk as usize].kept;
            let from = 3 * single.len() as u32;
            single.extend_from_slice(numbers);
            let to = 3 * single.len() as u32;
            match draws.last_mut() {
                Some(last) if last.chunk == chunk => last.indices.end = to,
                _ => draws.push(Draw { chunk, indices: from..to }),
            }
            let mut needed = vec![false; kept.positions.len().div_ceil(GROUP as usize)];
            let vertices = numbers.iter().flat_map(|&number| kept.triangle(number));
            vertices.for_each(|vertex| needed[usize::from(vertex) / GROUP as usize] = true);
            let needed = (0u16..).zip(needed).filter_map(|(group, needed)| needed.then_some(group));
            lit.extend(needed.map(|group| LightGroup { chunk, group }));
        }
        Self { draws, groups: lit, single: Some(single) }
    }

    /// Of what is drawn, the triangles that `shown` says, by their number in the order of drawing.
    #[must_use]
    pub fn only(&self, chunks: &[GpuChunk], shown: &NumberSet) -> Self {
        let mut drawn = 0..;
        let groups: Vec<(u32, Vec<u32>)> = self
            .numbers()
            .map(|(chunk, numbers)| {
                let shown = numbers.zip(&mut drawn).filter(|&(_, place)| shown.contains(place));
                (chunk, shown.map(|(number, _)| number).collect())
            })
            .collect();
        Self::triangles(chunks, groups.iter().map(|(chunk, numbers)| (*chunk, &numbers[..])))
    }

    /// Each draw's chunk, and the numbers in it of the triangles that are drawn.
    fn numbers(&self) -> impl Iterator<Item = (u32, impl Iterator<Item = u32>)> {
        self.draws.iter().map(|draw| {
            let numbers = draw.indices.start / 3..draw.indices.end / 3;
            (draw.chunk, numbers.map(|number| self.single.as_ref().map_or(number, |single| single[number as usize])))
        })
    }

    /// Chunk and number in it of each triangle in the order of drawing.
    pub fn shown(&self) -> impl Iterator<Item = (u32, u32)> {
        self.numbers().flat_map(|(chunk, numbers)| numbers.map(move |number| (chunk, number)))
    }

    /// For each of `chunks` chunks, the triangles that are drawn.
    #[must_use]
    pub fn sets(&self, chunks: usize) -> Vec<NumberSet> {
        let mut sets = vec![NumberSet::default(); chunks];
        self.numbers().for_each(|(chunk, numbers)| sets[chunk as usize].extend(numbers));
        sets
    }

    /// The vertices of single triangles, as an index buffer holds them; nothing where whole clusters are drawn.
    #[must_use]
    pub fn indices(&self, chunks: &[GpuChunk]) -> Vec<u16> {
        let groups = self.numbers().filter(|_| self.single.is_some());
        groups
            .flat_map(|(chunk, numbers)| numbers.flat_map(move |number| chunks[chunk as usize].kept.triangle(number)))
            .collect()
    }

    /// The runs of each draw: of one cluster's triangles each.
    #[must_use]
    pub fn runs(&self, chunks: &[GpuChunk]) -> Vec<Vec<Run>> {
        let of_draw = |(draw, (chunk, numbers)): (&Draw, (u32, _))| {
            let clusters = &chunks[chunk as usize].kept.clusters;
            let mut runs: Vec<Run> = Vec::new();
            let mut known = 0..0;
            for (first, number) in (draw.indices.start..).step_by(3).zip(numbers) {
                let at = 3 * number;
                match runs.last_mut().filter(|_| known.contains(&at)) {
                    Some(run) => run.indices.end = first + 3,
                    None => {
                        let cluster = &clusters[clusters.partition_point(|cluster| cluster.indices.end <= at)];
                        known = cluster.indices.clone();
                        let bounds = (cluster.center - cluster.half, cluster.center + cluster.half);
                        runs.push(Run { indices: first..first + 3, bounds });
                    }
                }
            }
            runs
        };
        self.draws.iter().zip(self.numbers()).map(of_draw).collect()
    }

    /// The draws in their order, in parts of about `triangles` at most; an empty part if there are none.
    pub fn parts(&self, triangles: u64) -> impl Iterator<Item = &[Draw]> {
        let mut rest = Some(&self.draws[..]);
        std::iter::from_fn(move || {
            let draws = rest?;
            let mut count = 0;
            let end = draws.iter().take_while(|draw| {
                let fits = count == 0 || count + draw.triangles() <= triangles;
                count += draw.triangles();
                fits
            });
            let (part, left) = draws.split_at(end.count());
            rest = (!left.is_empty()).then_some(left);
            Some(part)
        })
    }

    /// Triangles that are drawn.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        self.draws.iter().map(Draw::triangles).sum()
    }
}

/// A set of small numbers, as those of a chunk's triangles or clusters.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NumberSet {
    bits: Vec<u64>,
}

impl NumberSet {
    /// Whether `number` is in the set.
    #[must_use]
    pub fn contains(&self, number: u32) -> bool {
        self.bits.get(number as usize / 64).is_some_and(|word| word >> (number % 64) & 1 == 1)
    }
}

impl Extend<u32> for NumberSet {
    fn extend<I: IntoIterator<Item = u32>>(&mut self, numbers: I) {
        for number in numbers {
            let word = number as usize / 64;
            if word >= self.bits.len() {
                self.bits.resize(word + 1, 0);
            }
            self.bits[word] |= 1 << (number % 64);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::daylight::cluster::Cluster;
    use crate::daylight::view::tests::quad_at;
    use glam::Vec3;
    use std::sync::Arc;

    #[test]
    fn neighbours_are_joined_over_small_gaps_and_only_forwards() {
        let mut chunk = quad_at(Vec3::ZERO, 100);
        let mut kept = (*chunk.kept).clone();
        let starts = [0, 30, 60, 90 + BRIDGED_INDICES + 60];
        kept.clusters = starts.map(|start| Cluster { indices: start..start + 30, ..kept.clusters[0].clone() }).into();
        chunk.kept = Arc::new(kept);
        let clusters = [0, 2, 3, 0].map(|cluster| ClusterRef { chunk: 0, cluster });
        let ranges = |left_out: &[NumberSet]| -> Vec<Range<u32>> {
            let seen = Seen::clusters(std::slice::from_ref(&chunk), &clusters, left_out);
            seen.draws.into_iter().map(|draw| draw.indices).collect()
        };
        assert_eq!(ranges(&[]), [0..90, starts[3]..30 + starts[3], 0..30]);
        let mut left_out = NumberSet::default();
        left_out.extend([1]);
        assert_eq!(ranges(&[left_out]), [0..30, 60..90, starts[3]..30 + starts[3], 0..30], "what is left out is not drawn");
    }

    #[test]
    fn parts_hold_all_draws_in_their_order() {
        let draws: Vec<Draw> = [10, 20, 300, 5, 5].map(|n| Draw { chunk: n, indices: 0..3 * n }).into();
        let mut seen = Seen { draws, ..Seen::default() };
        let lengths = |seen: &Seen, triangles| seen.parts(triangles).map(<[Draw]>::len).collect::<Vec<_>>();
        assert_eq!(lengths(&seen, 30), [2, 1, 2], "a draw that is too large has a part of its own");
        assert_eq!(lengths(&seen, 1), [1; 5]);
        assert_eq!(lengths(&seen, u64::MAX), [5]);
        assert_eq!(seen.parts(30).flatten().collect::<Vec<_>>(), seen.draws.iter().collect::<Vec<_>>());
        seen.draws.clear();
        assert_eq!(lengths(&seen, 30), [0], "the sky needs a pass");
    }

    #[test]
    fn single_triangles_keep_their_order_and_their_light() {
        let chunks = [quad_at(Vec3::ZERO, 0), quad_at(Vec3::Z, 6), quad_at(Vec3::X, 12)];
        let all = Seen::clusters(&chunks, &[2, 0, 1].map(|chunk| ClusterRef { chunk, cluster: 0 }), &[]);
        let mut shown = NumberSet::default();
        shown.extend([5, 1, 4]);
        let seen = all.only(&chunks, &shown);
        // The second triangle of chunk 2, nothing of chunk 0, all of chunk 1.
        assert_eq!(seen.draws, [Draw { chunk: 2, indices: 0..3 }, Draw { chunk: 1, indices: 3..9 }]);
        let indices: Vec<u16> = [&chunks[2].kept.indices[3..], &chunks[1].kept.indices].concat();
        assert_eq!((seen.indices(&chunks), all.indices(&chunks)), (indices, Vec::new()));
        let sets = seen.sets(3);
        assert!(sets[2].contains(1) && !sets[2].contains(0) && sets[1].contains(1) && sets[0] == NumberSet::default());
        assert_eq!(seen.groups, [2, 1].map(|chunk| LightGroup { chunk, group: 0 }));
        assert_eq!((all.triangle_count(), seen.triangle_count()), (6, 3));
        // Of those three, the second.
        let mut shown = NumberSet::default();
        shown.extend([1]);
        let fewer = seen.only(&chunks, &shown);
        assert_eq!((&fewer.draws[..], fewer.single), (&[Draw { chunk: 1, indices: 0..3 }][..], Some(vec![0])));
    }

    #[test]
    fn runs_hold_their_triangles_and_nothing_between_them_is_lost() {
        let chunks = [quad_at(Vec3::ZERO, 0), quad_at(Vec3::X * 9.0, 6)];
        let seen = Seen::triangles(&chunks, [(1, &[1][..]), (0, &[0, 1])]);
        let runs = seen.runs(&chunks);
        assert_eq!(runs.iter().flatten().map(|run| run.indices.clone()).collect::<Vec<_>>(), [0..3, 3..9]);
        for (draw, runs) in seen.draws.iter().zip(&runs) {
            let (low, high) = runs[0].bounds;
            let kept = &chunks[draw.chunk as usize].kept;
            assert!(kept.positions.iter().all(|p| p.cmpge(low - 1e-5).all() && p.cmple(high + 1e-5).all()));
        }
        let run = |indices: Range<u32>, x: f32| Run { indices, bounds: (Vec3::X * x, Vec3::X * x) };
        let special = |(low, _): (Vec3, Vec3)| low.x > 0.0;
        let far = 3 * 1000;
        let runs =
            [run(0..3, -1.0), run(3..6, 1.0), run(6..9, -1.0), run(9..12, 1.0), run(12..far, -1.0), run(far..far + 3, 2.0)];
        assert_eq!(split(&runs, special), [(0..3, false), (3..12, true), (12..far, false), (far..far + 3, true)]);
        assert_eq!(split(&[], special), []);
    }
}
