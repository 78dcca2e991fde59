//! The stage's stone as bodies meet it: triangle meshes of some thousand triangles each, made in the background and only near what needs them.
//!
//! One mesh over a monument of 700,000 triangles would take a second and 100 MB. Here the clusters that culling keeps anyway are joined, in their order, which
//! is one of neighbours, to pieces; those whose boxes meet a body or a visitor are built on a thread of their own, and the ones that nobody has needed for
//! longest go when there are too many. Bodies wait for the pieces around them: nothing falls through a floor that is still to come.

use super::space::Space;
use crate::daylight::chunk::KeptChunk;
use crate::stage::background::Background;
use crate::stage::ground::Ground;
use avian3d::prelude::Collider;
use bevy::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// Triangles of a piece, at most, unless a single cluster has more: built in some milliseconds.
const PIECE_TRIANGLES: usize = 4096;
/// Triangles that stay built: 100 bytes each.
const KEPT_TRIANGLES: usize = 400_000;
/// Pieces that one thread builds before it hands them over.
const PIECES_AT_ONCE: usize = 8;
/// A triangle of less area has no normal that could be trusted, square metres: a needle of a metre by two nanometres.
const LEAST_AREA_M2: f32 = 1e-9;

/// A box, its least and greatest corner.
pub type Bounds = (Vec3, Vec3);

/// The stone.
pub struct Stone {
    pieces: Vec<Piece>,
    building: Option<(Vec<usize>, Background<Built>)>,
    /// Triangles that are built.
    triangles: usize,
    /// Counts what was asked.
    turn: u64,
}

/// Pieces' triangle meshes, where they have any.
type Built = Vec<Option<Collider>>;

struct Piece {
    chunk: Arc<KeptChunk>,
    clusters: Range<usize>,
    bounds: Bounds,
    triangles: usize,
    state: State,
    /// When it was needed last.
    needed: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Absent,
    Building,
    /// None where not one of its triangles is sound.
    Built(Option<Entity>),
}

impl Stone {
    /// The pieces of a stage's ground, none built.
    #[must_use]
    pub fn new(ground: &Ground) -> Self {
        let mut pieces = Vec::new();
        for chunk in ground.chunks() {
            let mut first = 0;
            let mut triangles = 0;
            for (i, cluster) in chunk.clusters.iter().enumerate() {
                let more = cluster.indices.len() / 3;
                if triangles > 0 && triangles + more > PIECE_TRIANGLES {
                    pieces.push(Piece::new(chunk, first..i, triangles));
                    (first, triangles) = (i, 0);
                }
                triangles += more;
            }
            if triangles > 0 {
                pieces.push(Piece::new(chunk, first..chunk.clusters.len(), triangles));
            }
        }
        Self { pieces, building: None, triangles: 0, turn: 0 }
    }

    /// Whether all that boxes meet is built.
    #[must_use]
    pub fn is_built(&self, boxes: &[Bounds]) -> bool {
        self.met_by(boxes).all(|i| matches!(self.pieces[i].state, State::Built(_)))
    }

    /// Pieces and triangles that are built.
    #[must_use]
    pub fn built(&self) -> (usize, usize) {
        (self.pieces.iter().filter(|piece| matches!(piece.state, State::Built(Some(_)))).count(), self.triangles)
    }

    /// Takes what has been built, and has built what boxes meet. Who is patient waits until all of that is there.
    pub fn need(&mut self, space: &mut Space, boxes: &[Bounds], patient: bool) {
        self.turn += 1;
        self.take(space, patient);
        let needed: Vec<usize> = self.met_by(boxes).collect();
        needed.iter().for_each(|&i| self.pieces[i].needed = self.turn);
        while self.building.is_none() {
            let absent = needed.iter().copied().filter(|&i| self.pieces[i].state == State::Absent);
            let next: Vec<usize> = absent.take(PIECES_AT_ONCE).collect();
            if next.is_empty() {
                break;
            }
            next.iter().for_each(|&i| self.pieces[i].state = State::Building);
            let parts: Vec<_> = next.iter().map(|&i| self.pieces[i].part()).collect();
            let build = move || parts.into_iter().map(|(chunk, clusters)| mesh(&chunk, clusters)).collect();
            self.building = Some((next, Background::start(build)));
            if patient {
                self.take(space, true);
            }
        }
        self.forget(space);
    }

    fn met_by(&self, boxes: &[Bounds]) -> impl Iterator<Item = usize> {
        let meets = |a: Bounds| boxes.iter().any(|b| a.0.cmple(b.1).all() && a.1.cmpge(b.0).all());
        (0..self.pieces.len()).filter(move |&i| meets(self.pieces[i].bounds))
    }

    fn take(&mut self, space: &mut Space, patient: bool) {
        let built = |(_, building): &(_, Background<Built>)| if patient { Some(building.wait()) } else { building.take() };
        let Some(built) = self.building.as_ref().and_then(built) else { return };
        let Some((which, _)) = self.building.take() else { return };
        let built = built.unwrap_or_else(|_| {
            warn_once!("some stone could not be made solid: bodies fall through it");
            Vec::new()
        });
        for (i, collider) in which.into_iter().zip(built.into_iter().chain(std::iter::repeat(None))) {
            self.pieces[i].state = State::Built(collider.map(|collider| space.add_stone(collider)));
            self.triangles += self.pieces[i].triangles;
        }
    }

    /// Takes away what nobody has needed for longest, while there is too much.
    fn forget(&mut self, space: &mut Space) {
        while self.triangles > KEPT_TRIANGLES {
            let (turn, pieces) = (self.turn, self.pieces.iter_mut());
            let unneeded = pieces.filter(|piece| matches!(piece.state, State::Built(_)) && piece.needed < turn);
            let Some(oldest) = unneeded.min_by_key(|piece| piece.needed) else { return };
            if let State::Built(Some(entity)) = std::mem::replace(&mut oldest.state, State::Absent) {
                space.remove(entity);
            }
            self.triangles -= oldest.triangles;
        }
    }
}

impl Piece {
    fn new(chunk: &Arc<KeptChunk>, clusters: Range<usize>, triangles: usize) -> Self {
        let boxes = chunk.clusters[clusters.clone()].iter().map(|c| (c.center - c.half, c.center + c.half));
        let bounds = boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or(chunk.bounds);
        Self { chunk: Arc::clone(chunk), clusters, bounds, triangles, state: State::Absent, needed: 0 }
    }

    fn part(&self) -> (Arc<KeptChunk>, Range<usize>) {
        (Arc::clone(&self.chunk), self.clusters.clone())
    }
}

/// The triangle mesh of some clusters, without triangles that are none.
fn mesh(chunk: &KeptChunk, clusters: Range<usize>) -> Option<Collider> {
    let mut numbers: Vec<Option<u32>> = vec![None; chunk.positions.len()];
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for cluster in &chunk.clusters[clusters] {
        let range = cluster.indices.start as usize..cluster.indices.end as usize;
        for triangle in chunk.indices[range].chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|k| chunk.positions[usize::from(triangle[k])]);
            let twice_area = (b - a).cross(c - a).length();
            // false, too, where a corner is no number
            let is_sound = twice_area > 2.0 * LEAST_AREA_M2 && twice_area.is_finite();
            if !is_sound {
                continue;
            }
            triangles.push([0, 1, 2].map(|k| {
                let vertex = usize::from(triangle[k]);
                *numbers[vertex].get_or_insert_with(|| {
                    positions.push(chunk.positions[vertex]);
                    positions.len() as u32 - 1
                })
            }));
        }
    }
    Collider::try_trimesh(positions, triangles).ok()
}
