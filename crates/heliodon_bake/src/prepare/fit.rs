//! About as many triangles as the site wants.

use super::Work;
use super::arrays::{Reader, Writer, textures_of};
use super::borders::Border;
use super::dropped::look_around;
use super::limits::{Grained, Limits};
use super::part::{count as triangles, piece_name, simplifies, simplify_params};
use super::pieces::{PIECE, Piece};
use super::steps::{Step, Steps};
use crate::cache::CacheError;
use crate::error::BakeError;
use glam::Vec3;
use heliodon_mesh::Mesh;
use heliodon_prepare::purge::PurgeParams;
use heliodon_prepare::simplify::{SimplifyParams, simplify_further};
use heliodon_prepare::{Interim, Tell};

/// Rounds at most.
pub(super) const MOST_ROUNDS: usize = 6;
/// How many triangles would be drawn.
struct Count {
    /// Part by part.
    drawn: Vec<u64>,
    steps: Vec<Step>,
}

/// A part simplified once more.
struct Again {
    mesh: Mesh,
    steps: Vec<Step>,
}

/// Simplifies further until about as many triangles are drawn as the site wants; returns the limits of each part with which they do, and what that
/// took. `parts` tell how each part was split and what of it is held, `ends` where the vertices of its original end among all of `original`.
///
/// # Errors
/// More geometry than the ray engine holds, or a cache that cannot be written.
pub(super) fn fit(
    work: &Work,
    meshes: &mut [Mesh],
    (parts, borders): (Vec<Grained>, &[Border]),
    original: &[Vec3],
    ends: &[usize],
) -> Result<(Vec<SimplifyParams>, Vec<Step>), BakeError> {
    let asked = simplify_params(work.settings);
    let (mut limits, mut steps) = (Limits::new(&asked, parts), Vec::new());
    if work.settings.triangles == 0 || !simplifies(&asked, &work.views) {
        return Ok((limits.params, steps));
    }
    for round in 1..=MOST_ROUNDS {
        let mut count = work.pieces.kept_or(&format!("{PIECE}count{round}"), &[], || count(work, meshes))?;
        steps.append(&mut count.steps);
        let drawn: Vec<f64> = count.drawn.iter().map(|&drawn| drawn as f64).collect();
        let Some(grown) = limits.grow(&drawn, work.settings.triangles as f64) else { break };
        for index in grown {
            let mesh = &mut meshes[index];
            let name = piece_name(index, &format!("again{round}"));
            let begin = if index == 0 { 0 } else { ends[index - 1] };
            let tiles = format!("{name}-tiles");
            let make = || {
                let interim = work.pieces.interim(tiles.clone());
                Ok(again(work, mesh, &borders[index], &original[begin..ends[index]], &limits.params[index], &interim))
            };
            let mut again = work.pieces.kept_or(&name, &textures_of(&mesh.materials), make)?;
            work.pieces.remove(&tiles);
            steps.append(&mut again.steps);
            *mesh = again.mesh;
        }
    }
    Ok((limits.params, steps))
}

fn count(work: &Work, meshes: &[Mesh]) -> Result<Count, BakeError> {
    if !work.purges() {
        return Ok(Count { drawn: meshes.iter().map(|mesh| mesh.triangles.len() as u64).collect(), steps: Vec::new() });
    }
    let params = PurgeParams { ring: work.settings.ring, max_checks: 1, ..PurgeParams::preview() };
    let seen = look_around(work, meshes, &params)?;
    let mut keep = seen.keep.as_slice();
    let of_part = |mesh: &Mesh| {
        let (of_part, rest) = keep.split_at(mesh.triangles.len());
        keep = rest;
        of_part.iter().filter(|kept| **kept).count() as u64
    };
    Ok(Count { drawn: meshes.iter().map(of_part).collect(), steps: seen.steps })
}

fn again(
    work: &Work,
    mesh: &Mesh,
    border: &Border,
    original: &[Vec3],
    params: &SimplifyParams,
    interim: &dyn Interim,
) -> Again {
    let mut steps = Steps::new(work.reporter);
    let further = |tell: Tell| simplify_further(mesh, &border.held, original, &work.views, params, (interim, tell));
    let mesh = steps.run("simplifying to the number wanted", triangles(mesh), further).mesh;
    Again { mesh, steps: steps.taken }
}

impl Piece for Count {
    fn write(&self, into: &mut Writer) -> Result<(), CacheError> {
        into.told(&self.drawn);
        into.told(&self.steps);
        Ok(())
    }

    fn read(from: &mut Reader) -> Option<Self> {
        Some(Self { drawn: from.told()?, steps: from.told()? })
    }
}

impl Piece for Again {
    fn write(&self, into: &mut Writer) -> Result<(), CacheError> {
        into.mesh("mesh", &self.mesh)?;
        into.told(&self.steps);
        Ok(())
    }

    fn read(from: &mut Reader) -> Option<Self> {
        Some(Self { mesh: from.mesh("mesh")?, steps: from.told()? })
    }
}
