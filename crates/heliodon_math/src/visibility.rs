//! The visibility matrix: which of k directions reach which of n points.
//!
//! M. Sattler, R. Sarlette, G. Zachmann, R. Klein: "Hardware-accelerated ambient occlusion computation", VMV 2004. The paper's
//! `M_ij` is `n_i . l_j` where the light of direction j reaches point i, and 0 elsewhere. Here one bit says which, and the cosine is
//! computed anew where it is needed: M takes a thirty-second of the memory, and is read faster than floats would be.
//!
//! Under a radiance that is each direction itself, the light of a point is its bent normal, but for its length: the mean direction that
//! light comes from.
//!
//! Whoever computes a matrix chooses the order of its rows ([`VisibilityMatrix::order`]), and may leave out points that nobody looks at; what is
//! computed from it is in the order of the points, and 0 for those without a row.

use glam::Vec3;
use rayon::prelude::*;

/// Points whose bits lie together.
pub const BLOCK: usize = 512;
/// Words of a block's column.
pub const BLOCK_WORDS: usize = BLOCK / 64;
/// Lanes that are worked on at once.
const LANES: usize = 8;

/// Which directions reach which points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VisibilityMatrix {
    points: usize,
    order: Vec<u32>,
    normals: Vec<Vec3>,
    directions: Vec<Vec3>,
    words: Vec<u64>,
}

/// Two matrices that cannot be joined, or one whose parts contradict one another.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("visibility matrix: {0}")]
pub struct VisibilityError(pub &'static str);

/// Whatever computes the visibility matrix of a mesh: rays on the processor, or depth maps on a GPU. All vertices ask, and all triangles
/// occlude, from both sides.
pub trait VisibilityBackend {
    /// What can go wrong.
    type Error: std::error::Error + Send + Sync + 'static;

    /// Takes a mesh; the matrix of the one before is gone. A vertex sees nothing that has no normal, or a position that is not finite.
    ///
    /// # Errors
    /// Indices beyond the vertices, not one normal for each, or more than the backend holds.
    fn set_mesh(&mut self, positions: &[Vec3], normals: &[Vec3], triangles: &[[u32; 3]]) -> Result<(), Self::Error>;

    /// The same mesh, moved or deformed: as many vertices as before. The matrix is to be computed anew.
    ///
    /// # Errors
    /// No mesh, or another number of vertices.
    fn move_vertices(&mut self, positions: &[Vec3], normals: &[Vec3]) -> Result<(), Self::Error>;

    /// Computes the matrix of the unit `directions` to the light, and keeps it.
    ///
    /// # Errors
    /// No mesh, or more than the backend holds.
    fn compute(&mut self, directions: &[Vec3]) -> Result<(), Self::Error>;

    /// [`Self::compute`] for the `wanted` points, at least. What is known of the mesh as it stands is kept: rows of other points under the same
    /// directions, and columns of a coarser light sphere.
    ///
    /// # Errors
    /// As [`Self::compute`], or not one answer for each point.
    fn compute_for(&mut self, wanted: &[bool], directions: &[Vec3]) -> Result<(), Self::Error>;

    /// Waits until the matrix is there; whoever asks for anything waits anyway.
    ///
    /// # Errors
    /// A backend that fails.
    fn wait(&mut self) -> Result<(), Self::Error>;

    /// What the matrix makes of one radiance from each direction.
    ///
    /// # Errors
    /// No matrix, or not one weight and one radiance for each of its directions.
    fn light(&mut self, weights: &[f32], radiance: &[Vec3]) -> Result<PointLight, Self::Error>;

    /// The matrix itself.
    ///
    /// # Errors
    /// No matrix, or a backend that fails.
    fn matrix(&mut self) -> Result<VisibilityMatrix, Self::Error>;

    /// How many directions fit into one [`Self::compute`] for so many points.
    fn most_directions(&self, points: usize) -> usize;
}

/// The light at each point, from all directions or from some of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointLight {
    /// Irradiance / pi: `1/pi sum w_j M_ij L_j`.
    pub light: Vec<Vec3>,
    /// Ambient occlusion of these directions: `sum w_j M_ij / open`; exactly 1 where all that face a point reach it, 0 where none faces it.
    pub ambient_occlusion: Vec<f32>,
    /// `sum w_j max(n_i.l_j, 0)`.
    pub open: Vec<f32>,
}

impl PointLight {
    /// Adds the light of other directions.
    ///
    /// # Panics
    /// If it is of another number of points.
    pub fn add(&mut self, other: &Self) {
        assert_eq!(self.light.len(), other.light.len(), "light of as many points");
        self.light.iter_mut().zip(&other.light).for_each(|(sum, &more)| *sum += more);
        let sums = self.ambient_occlusion.iter_mut().zip(&mut self.open);
        for ((ao, open), (&more, &more_open)) in sums.zip(other.ambient_occlusion.iter().zip(&other.open)) {
            let (seen, sum) = (*ao * *open + more * more_open, *open + more_open);
            (*ao, *open) = (if sum > 0.0 { seen / sum } else { 0.0 }, sum);
        }
    }
}

impl VisibilityMatrix {
    /// A matrix in which nothing is visible yet. Row r is of point `order[r]`, each named at most once; `normals` are of all points, unit or zero: a
    /// point without one sees nothing.
    ///
    /// # Panics
    /// If `order` names points without a normal.
    #[must_use]
    pub fn new(order: Vec<u32>, normals: &[Vec3], directions: &[Vec3]) -> Self {
        let points = normals.len();
        let normals: Vec<Vec3> = order.iter().map(|&point| normals[point as usize]).collect();
        let words = vec![0; order.len().div_ceil(BLOCK) * BLOCK_WORDS * directions.len()];
        Self { points, order, normals, directions: directions.to_vec(), words }
    }

    /// Bytes of the bits of a matrix.
    #[must_use]
    pub fn bytes(points: usize, directions: usize) -> u64 {
        (points.div_ceil(BLOCK) * BLOCK_WORDS * 8) as u64 * directions as u64
    }

    /// How many points there are, with a row or without.
    #[must_use]
    pub fn points(&self) -> usize {
        self.points
    }

    /// The point of each row.
    #[must_use]
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// The normal of each row.
    #[must_use]
    pub fn normals(&self) -> &[Vec3] {
        &self.normals
    }

    /// Unit directions to the light, one a column.
    #[must_use]
    pub fn directions(&self) -> &[Vec3] {
        &self.directions
    }

    /// Bits of the block from row `block * BLOCK` on: for each direction [`BLOCK_WORDS`] words, of which bit i % 64 of word i / 64 is that of
    /// the block's row i.
    pub fn blocks_mut(&mut self) -> impl IndexedParallelIterator<Item = &mut [u64]> {
        let length = (BLOCK_WORDS * self.directions.len()).max(1);
        self.words.par_chunks_exact_mut(length)
    }

    /// Whether the light of a direction reaches a row's point.
    #[must_use]
    pub fn is_visible(&self, row: usize, direction: usize) -> bool {
        let block = row / BLOCK * BLOCK_WORDS * self.directions.len();
        let word = self.words[block + direction * BLOCK_WORDS + row % BLOCK / 64];
        word >> (row % 64) & 1 == 1
    }

    /// Entries that are not 0.
    #[must_use]
    pub fn visible_count(&self) -> u64 {
        self.words.par_iter().map(|word| u64::from(word.count_ones())).sum()
    }

    /// `M_ij` for a row and each direction.
    pub fn row(&self, row: usize) -> impl Iterator<Item = f32> + '_ {
        let normal = self.normals[row];
        let entry = move |(j, &l): (usize, &Vec3)| if self.is_visible(row, j) { normal.dot(l).max(0.0) } else { 0.0 };
        self.directions.iter().enumerate().map(entry)
    }

    /// Adds the columns of further directions, as of a finer light sphere.
    ///
    /// # Errors
    /// Another order of rows.
    pub fn append(&mut self, more: &Self) -> Result<(), VisibilityError> {
        if self.order != more.order {
            return Err(VisibilityError("columns of other rows cannot be added"));
        }
        let [own, new] = [self.directions.len(), more.directions.len()].map(|k| k * BLOCK_WORDS);
        let block = |b: usize| [&self.words[b * own..(b + 1) * own], &more.words[b * new..(b + 1) * new]];
        self.words = (0..self.order.len().div_ceil(BLOCK)).flat_map(block).flatten().copied().collect();
        self.directions.extend_from_slice(&more.directions);
        Ok(())
    }

    /// Adds rows of further points.
    ///
    /// # Errors
    /// Other directions, other points, or a point that has a row already.
    pub fn append_rows(&mut self, more: &Self) -> Result<(), VisibilityError> {
        if self.directions != more.directions || self.points != more.points {
            return Err(VisibilityError("rows of other directions or points cannot be added"));
        }
        let mut known = vec![false; self.points];
        self.order.iter().for_each(|&point| known[point as usize] = true);
        if more.order.iter().any(|&point| known[point as usize]) {
            return Err(VisibilityError("a point has a row already"));
        }
        let (first, k) = (self.order.len(), self.directions.len());
        self.order.extend_from_slice(&more.order);
        self.normals.extend_from_slice(&more.normals);
        self.words.resize(self.order.len().div_ceil(BLOCK) * BLOCK_WORDS * k, 0);
        for (i, &bits) in more.words.iter().enumerate().filter(|(_, bits)| **bits != 0) {
            let (block, direction, word) = (i / (BLOCK_WORDS * k), i / BLOCK_WORDS % k, i % BLOCK_WORDS);
            let row = first + block * BLOCK + word * 64;
            let at = |row: usize| row / BLOCK * BLOCK_WORDS * k + direction * BLOCK_WORDS + row % BLOCK / 64;
            self.words[at(row)] |= bits << (row % 64);
            // What runs over goes into the next word.
            if !row.is_multiple_of(64) && bits >> (64 - row % 64) != 0 {
                self.words[at(row + 64)] |= bits >> (64 - row % 64);
            }
        }
        Ok(())
    }

    /// Whether the parts agree: no point twice, and no bits where there are no points.
    ///
    /// # Errors
    /// What is wrong.
    pub fn validate(&self) -> Result<(), VisibilityError> {
        let points = self.order.len();
        let mut met = vec![false; self.points];
        if self.order.iter().any(|&p| met.get_mut(p as usize).is_none_or(|met| std::mem::replace(met, true))) {
            return Err(VisibilityError("rows that are not each of another point"));
        }
        let length = BLOCK_WORDS * self.directions.len();
        if self.normals.len() != points || self.words.len() != points.div_ceil(BLOCK) * length {
            return Err(VisibilityError("parts of different sizes"));
        }
        let last = points % BLOCK;
        let rows_in = |word: usize| last.saturating_sub(64 * word).min(64) as u32;
        let stray = |(word, bits): (usize, u64)| rows_in(word) < 64 && bits >> rows_in(word) != 0;
        let columns = self.words[self.words.len() - length.min(self.words.len())..].chunks_exact(BLOCK_WORDS);
        if last != 0 && columns.into_iter().any(|column| column.iter().copied().enumerate().any(stray)) {
            return Err(VisibilityError("bits behind the last row"));
        }
        Ok(())
    }

    /// `sum_j M_ij q_j` for each point i.
    ///
    /// # Panics
    /// If there is not one quantity for each direction.
    #[must_use]
    pub fn gather<const C: usize>(&self, quantities: &[[f32; C]]) -> Vec<[f32; C]> {
        self.sum(quantities, |words, direction| words[direction])
    }

    /// The same where nothing occludes: `sum_j max(n_i.l_j, 0) q_j`. Where all is visible, the bits of both are equal.
    ///
    /// # Panics
    /// If there is not one quantity for each direction.
    #[must_use]
    pub fn gather_open<const C: usize>(&self, quantities: &[[f32; C]]) -> Vec<[f32; C]> {
        self.sum(quantities, |_, _| [u64::MAX; BLOCK_WORDS])
    }

    fn sum<const C: usize>(
        &self,
        quantities: &[[f32; C]],
        bits: impl Fn(&[[u64; BLOCK_WORDS]], usize) -> [u64; BLOCK_WORDS] + Sync,
    ) -> Vec<[f32; C]> {
        assert_eq!(quantities.len(), self.directions.len(), "one quantity for each direction");
        let mut sums = vec![[0.0; C]; self.points];
        let length = BLOCK_WORDS * self.directions.len();
        let by_row: Vec<[f32; C]> = self
            .normals
            .par_chunks(BLOCK)
            .enumerate()
            .flat_map_iter(|(block, normals)| {
                let (words, _) = self.words[block * length..(block + 1) * length].as_chunks();
                block_sums(normals, &self.directions, quantities, |direction| bits(words, direction))
            })
            .collect();
        for (&point, sum) in self.order.iter().zip(by_row) {
            sums[point as usize] = sum;
        }
        sums
    }

    /// The light of each point under one radiance from each direction. An open point under radiance 1 from everywhere has light 1 but for
    /// what k directions cannot say; [`PointLight::ambient_occlusion`] is free of that.
    ///
    /// # Panics
    /// If there is not one weight and one radiance for each direction.
    #[must_use]
    pub fn light(&self, weights: &[f32], radiance: &[Vec3]) -> PointLight {
        assert_eq!(weights.len(), radiance.len(), "one weight for each radiance");
        let share = |(&w, &l): (&f32, &Vec3)| (l * (w * std::f32::consts::FRAC_1_PI)).extend(w).to_array();
        let quantities: Vec<[f32; 4]> = weights.iter().zip(radiance).map(share).collect();
        let open = self.gather_open(&weights.iter().map(|&w| [w]).collect::<Vec<_>>());
        let seen = self.gather(&quantities);
        let part = |([.., seen], [open]): (&[f32; 4], &[f32; 1])| if *open > 0.0 { seen / open } else { 0.0 };
        PointLight {
            light: seen.iter().map(|&[r, g, b, _]| Vec3::new(r, g, b)).collect(),
            ambient_occlusion: seen.iter().zip(&open).map(part).collect(),
            open: open.into_iter().map(|[open]| open).collect(),
        }
    }

    /// Ambient occlusion of each point: `sum w_j M_ij / sum w_j max(n_i.l_j, 0)`, exactly 1 where nothing occludes, 0 where no direction
    /// faces a point.
    ///
    /// # Panics
    /// If there is not one weight for each direction.
    #[must_use]
    pub fn ambient_occlusion(&self, weights: &[f32]) -> Vec<f32> {
        self.light(weights, &vec![Vec3::ZERO; weights.len()]).ambient_occlusion
    }
}

/// What each byte means for eight lanes: all bits or none.
static MASKS: [[u32; LANES]; 256] = {
    let mut masks = [[0; LANES]; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut lane = 0;
        while lane < LANES {
            masks[byte][lane] = if byte >> lane & 1 == 1 { u32::MAX } else { 0 };
            lane += 1;
        }
        byte += 1;
    }
    masks
};

/// The sums of a block's rows, in the order of the directions: the same for any width of vectors.
fn block_sums<const C: usize>(
    normals: &[Vec3],
    directions: &[Vec3],
    quantities: &[[f32; C]],
    bits: impl Fn(usize) -> [u64; BLOCK_WORDS],
) -> Vec<[f32; C]> {
    let mut lanes = [[[0.0f32; LANES]; 3]; BLOCK / LANES];
    for (i, normal) in normals.iter().enumerate() {
        for (axis, value) in normal.to_array().into_iter().enumerate() {
            lanes[i / LANES][axis][i % LANES] = value;
        }
    }
    let mut sums = [[[0.0f32; LANES]; C]; BLOCK / LANES];
    for (direction, (l, quantity)) in directions.iter().zip(quantities).enumerate() {
        for (word, of_word) in bits(direction).into_iter().zip(0..) {
            if word == 0 {
                continue;
            }
            for (byte, &mask) in word.to_le_bytes().iter().enumerate() {
                let group = of_word * (64 / LANES) + byte;
                let ([x, y, z], sums) = (&lanes[group], &mut sums[group]);
                let mask = &MASKS[usize::from(mask)];
                let mut entry = [0.0f32; LANES];
                for lane in 0..LANES {
                    let cosine = (x[lane] * l.x + y[lane] * l.y + z[lane] * l.z).max(0.0);
                    entry[lane] = f32::from_bits(cosine.to_bits() & mask[lane]);
                }
                for (sum, &q) in sums.iter_mut().zip(quantity) {
                    for lane in 0..LANES {
                        sum[lane] += entry[lane] * q;
                    }
                }
            }
        }
    }
    (0..normals.len()).map(|i| std::array::from_fn(|c| sums[i / LANES][c][i % LANES])).collect()
}
