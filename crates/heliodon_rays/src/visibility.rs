//! The visibility matrix by rays: exact, for any mesh that fits in memory.
//!
//! What the paper does with a depth buffer for each direction (M. Sattler, R. Sarlette, G. Zachmann, R. Klein: "Hardware-accelerated
//! ambient occlusion computation", VMV 2004), parallel rays do without its resolution and without its offset: all rays of one
//! direction share their way, and neighbouring directions the top of the hierarchy ([`TriangleScene::occluded_fan`]).

use crate::beam::usable;
use crate::build::{BuildError, BuildParams};
use crate::order::beam_order;
use crate::scene::TriangleScene;
use glam::Vec3;
use heliodon_math::frame::unit_or;
use heliodon_math::visibility::{BLOCK, BLOCK_WORDS, PointLight, VisibilityBackend, VisibilityMatrix};
use rayon::prelude::*;

/// Bits of a matrix that are kept at once, in bytes.
const MATRIX_BYTES: u64 = 1 << 30;

/// The part of the scene's diagonal by which rays start off the surface: enough for the facets of a smooth surface, and too little to
/// lose a contact that its triangles could show.
const OFFSET_PER_DIAGONAL: f32 = 1e-4;

/// Directions that are asked for together: each asks for a bit of 512 points, and their answers must stay in the cache.
const TOGETHER: usize = 64;

/// The visibility matrix of a mesh, by rays on the current rayon pool.
#[derive(Default)]
pub struct VisibilityCpu {
    offset_m: Option<f32>,
    mesh: Option<Mesh>,
    matrix: Option<VisibilityMatrix>,
}

struct Mesh {
    rays: TriangleScene,
    /// Of all vertices, as they lay when the mesh was set: neighbours stay neighbours.
    order: Vec<u32>,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

/// Why there is no visibility.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum VisibilityCpuError {
    /// The mesh cannot be asked.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// What was given does not go together.
    #[error("{0}")]
    Input(&'static str),
}

const NO_MESH: VisibilityCpuError = VisibilityCpuError::Input("there is no mesh yet");
const NOT_EACH: VisibilityCpuError = VisibilityCpuError::Input("which points are wanted must be said of each");
const NO_MATRIX: VisibilityCpuError = VisibilityCpuError::Input("the matrix is not computed yet");

impl VisibilityCpu {
    /// Rays start `offset_m` metres off the surface; `None` for a ten-thousandth of the mesh's diagonal, or what rounding asks for
    /// where that is more ([`TriangleScene::start_offset`]).
    #[must_use]
    pub fn new(offset_m: Option<f32>) -> Self {
        Self { offset_m, ..Self::default() }
    }

    /// Which of the `wanted` vertices the light of one more unit direction reaches, the sun's for example; no part of the matrix.
    ///
    /// # Errors
    /// No mesh, or not one answer for each point.
    pub fn seen_from(&self, wanted: &[bool], direction: Vec3) -> Result<Vec<bool>, VisibilityCpuError> {
        let mesh = self.mesh.as_ref().ok_or(NO_MESH)?;
        if wanted.len() != mesh.positions.len() {
            return Err(NOT_EACH);
        }
        let order = mesh.order.iter().copied().filter(|&point| wanted[point as usize]).collect();
        let column = mesh.rays.visibility_of(order, &mesh.positions, &mesh.normals, &[direction], self.offset_m());
        let mut seen = vec![false; wanted.len()];
        column.order().iter().enumerate().for_each(|(row, &point)| seen[point as usize] = column.is_visible(row, 0));
        Ok(seen)
    }

    /// How far off the surface rays start, in metres; 0 without a mesh.
    #[must_use]
    pub fn offset_m(&self) -> f32 {
        let of_mesh = |mesh: &Mesh| {
            let (low, high) = mesh.rays.bounds().unwrap_or_default();
            (low.distance(high) * OFFSET_PER_DIAGONAL).max(mesh.rays.start_offset())
        };
        self.offset_m.or_else(|| self.mesh.as_ref().map(of_mesh)).unwrap_or(0.0)
    }
}

impl VisibilityBackend for VisibilityCpu {
    type Error = VisibilityCpuError;

    fn set_mesh(&mut self, positions: &[Vec3], normals: &[Vec3], triangles: &[[u32; 3]]) -> Result<(), Self::Error> {
        (self.mesh, self.matrix) = (None, None);
        if positions.len() != normals.len() {
            return Err(VisibilityCpuError::Input("there must be one normal for each vertex"));
        }
        let rays = TriangleScene::build(positions, triangles, &BuildParams::default())?;
        let order = beam_order(positions, Some(normals));
        let (positions, normals, triangles) = (positions.to_vec(), normals.to_vec(), triangles.to_vec());
        self.mesh = Some(Mesh { rays, order, positions, normals, triangles });
        Ok(())
    }

    fn move_vertices(&mut self, positions: &[Vec3], normals: &[Vec3]) -> Result<(), Self::Error> {
        let mesh = self.mesh.as_mut().ok_or(NO_MESH)?;
        if [positions.len(), normals.len()] != [mesh.positions.len(); 2] {
            return Err(VisibilityCpuError::Input("a mesh that moves keeps its number of vertices"));
        }
        self.matrix = None;
        mesh.positions.copy_from_slice(positions);
        mesh.normals.copy_from_slice(normals);
        mesh.rays.refit(positions, &mesh.triangles, &BuildParams::default())?;
        Ok(())
    }

    fn compute(&mut self, directions: &[Vec3]) -> Result<(), Self::Error> {
        self.matrix = None;
        let points = self.mesh.as_ref().ok_or(NO_MESH)?.positions.len();
        self.compute_for(&vec![true; points], directions)
    }

    fn compute_for(&mut self, wanted: &[bool], directions: &[Vec3]) -> Result<(), Self::Error> {
        let offset_m = self.offset_m();
        let mesh = self.mesh.as_ref().ok_or(NO_MESH)?;
        if wanted.len() != mesh.positions.len() {
            return Err(NOT_EACH);
        }
        let ask = |order: Vec<u32>, directions: &[Vec3]| {
            mesh.rays.visibility_of(order, &mesh.positions, &mesh.normals, directions, offset_m)
        };
        let mut missing = wanted.to_vec();
        let nested = |m: &VisibilityMatrix| directions.starts_with(m.directions());
        let together = |_| VisibilityCpuError::Input("the matrix does not go together");
        let mut matrix = self.matrix.take().filter(nested);
        if let Some(matrix) = &mut matrix {
            if let more @ [_, ..] = &directions[matrix.directions().len()..] {
                matrix.append(&ask(matrix.order().to_vec(), more)).map_err(together)?;
            }
            matrix.order().iter().for_each(|&point| missing[point as usize] = false);
        }
        let order: Vec<u32> = mesh.order.iter().copied().filter(|&point| missing[point as usize]).collect();
        self.matrix = Some(match matrix {
            Some(matrix) if order.is_empty() => matrix,
            Some(mut matrix) => {
                matrix.append_rows(&ask(order, directions)).map_err(together)?;
                matrix
            }
            None => ask(order, directions),
        });
        Ok(())
    }

    fn wait(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }

    fn light(&mut self, weights: &[f32], radiance: &[Vec3]) -> Result<PointLight, Self::Error> {
        let matrix = self.matrix.as_ref().ok_or(NO_MATRIX)?;
        let count = matrix.directions().len();
        if weights.len() != count || radiance.len() != count {
            return Err(VisibilityCpuError::Input(
                "the light needs one weight and one radiance for each direction of the matrix",
            ));
        }
        Ok(matrix.light(weights, radiance))
    }

    fn matrix(&mut self) -> Result<VisibilityMatrix, Self::Error> {
        self.matrix.clone().ok_or(NO_MATRIX)
    }

    fn most_directions(&self, points: usize) -> usize {
        (MATRIX_BYTES / VisibilityMatrix::bytes(points, 1).max(1)).max(1) as usize
    }
}

impl TriangleScene {
    /// Which of the unit `directions` to the light reach points with `normals` (made unit): those that face it (`n.l > 0`) and whose ray, from
    /// `offset_m` off the surface, meets nothing. Points or normals that are not finite, and zero normals, see nothing.
    ///
    /// Uses the current rayon pool; the answer does not depend on it. Memory beyond the matrix: 28 bytes a point.
    ///
    /// # Panics
    /// If there are not as many normals as positions.
    #[must_use]
    pub fn visibility(&self, positions: &[Vec3], normals: &[Vec3], directions: &[Vec3], offset_m: f32) -> VisibilityMatrix {
        self.visibility_of(beam_order(positions, Some(normals)), positions, normals, directions, offset_m)
    }

    /// [`Self::visibility`] of the points that `order` names, a row each, fastest in their [`beam_order`].
    ///
    /// # Panics
    /// If there are not as many normals as positions, or `order` names others.
    #[must_use]
    pub fn visibility_of(
        &self,
        order: Vec<u32>,
        positions: &[Vec3],
        normals: &[Vec3],
        directions: &[Vec3],
        offset_m: f32,
    ) -> VisibilityMatrix {
        assert_eq!(positions.len(), normals.len(), "one normal for each position");
        // A point that is nowhere has no normal.
        let clean = |(p, &n): (&Vec3, &Vec3)| if usable(*p) { unit_or(n, Vec3::ZERO) } else { Vec3::ZERO };
        let normals: Vec<Vec3> = positions.par_iter().zip(normals).map(clean).collect();
        let mut matrix = VisibilityMatrix::new(order, &normals, directions);
        let origins: Vec<Vec3> =
            matrix.order().par_iter().map(|&i| positions[i as usize] + normals[i as usize] * offset_m).collect();
        let (rows, order) = (matrix.normals().to_vec(), direction_order(directions));
        matrix.blocks_mut().zip(origins.par_chunks(BLOCK)).zip(rows.par_chunks(BLOCK)).for_each(
            |((words, origins), normals)| {
                let width = origins.len().div_ceil(64);
                let (mut active, mut occluded) = ([0; TOGETHER * BLOCK_WORDS], [0; TOGETHER * BLOCK_WORDS]);
                for order in order.chunks(TOGETHER) {
                    let toward: Vec<Vec3> = order.iter().map(|&j| directions[j as usize]).collect();
                    let (active, occluded) = (&mut active[..width * order.len()], &mut occluded[..width * order.len()]);
                    for (&l, active) in toward.iter().zip(active.chunks_exact_mut(width)) {
                        facing(normals, l, active);
                    }
                    self.occluded_fan(origins, &toward, active, occluded);
                    let answers = active.chunks_exact(width).zip(occluded.chunks_exact(width));
                    for (&j, (active, occluded)) in order.iter().zip(answers) {
                        let column = &mut words[j as usize * BLOCK_WORDS..][..width];
                        for (word, (asked, met)) in column.iter_mut().zip(active.iter().zip(occluded)) {
                            *word = asked & !met;
                        }
                    }
                }
            },
        );
        matrix
    }
}

/// Sets the bit of every point whose surface faces `direction` (bit i % 64 of word i / 64), clears the others, and returns how many there
/// are.
pub fn facing(normals: &[Vec3], direction: Vec3, active: &mut [u64]) -> u32 {
    let mut count = 0;
    for (word, normals) in active.iter_mut().zip(normals.chunks(64)) {
        *word = normals.iter().enumerate().fold(0, |bits, (bit, n)| bits | u64::from(n.dot(direction) > 0.0) << bit);
        count += word.count_ones();
    }
    count
}

/// The indices of the bits that are set, ascending: bit i % 64 of word i / 64, as batches of rays are asked for and answered.
#[inline]
pub fn set_bits(words: &[u64]) -> impl Iterator<Item = usize> {
    words.iter().enumerate().flat_map(|(i, &word)| {
        let mut rest = word;
        std::iter::from_fn(move || {
            (rest != 0).then(|| {
                let bit = rest.trailing_zeros() as usize;
                rest &= rest - 1;
                i * 64 + bit
            })
        })
    })
}

/// An order of directions in which neighbours are alike: by the axis that they follow most, then along a Z-curve over the slopes.
fn direction_order(directions: &[Vec3]) -> Vec<u32> {
    let key = |d: Vec3| {
        let magnitude = d.abs();
        let k = if magnitude.x >= magnitude.y && magnitude.x >= magnitude.z {
            0
        } else if magnitude.y >= magnitude.z {
            1
        } else {
            2
        };
        let cell = |axis: usize| ((d[axis] / magnitude[k] * 0.5 + 0.5) * 1023.0) as u32;
        let (u, v) = (cell((k + 1) % 3), cell((k + 2) % 3));
        let interleaved = (0..10).fold(0, |bits, b| bits | (u >> b & 1) << (2 * b) | (v >> b & 1) << (2 * b + 1));
        (k, d[k] < 0.0, interleaved)
    };
    let mut order: Vec<u32> = (0..directions.len() as u32).collect();
    order.sort_by_key(|&j| key(directions[j as usize]));
    order
}
