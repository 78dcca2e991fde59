//! Which clips move the whole mesh as one rigid body.

use super::part::Drive;
use super::rig::{Rig, RigClip, Target};
use crate::place::Affine;
use glam::{DAffine3, DMat3};

/// How a clip moves the mesh as a whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Rigid {
    /// Not as one rigid body.
    #[default]
    No,
    /// Not at all.
    Still,
    /// As this node does.
    Node(usize),
}

/// How far a rotation's columns may be from orthonormal: keyframes are rounded to 2^-24 and made unit, chains of a hundred nodes add up.
const RIGID_TOLERANCE: f64 = 1.0e-5;

/// More times than this are not looked at: what shears does so between any two keys.
const MOST_TIMES: usize = 64;

pub(crate) fn rigid(rig: &Rig, clip: &RigClip) -> Rigid {
    if !clip.moves.contains(&true) {
        return Rigid::Still;
    }
    let scales = |(target, track): &(Target, std::sync::Arc<super::track::Track>)| {
        matches!(target, Target::Scale(_)) && !track.is_constant()
    };
    let moved = rig.moved_nodes(clip);
    let weighs = clip.channels.iter().any(|(target, _)| matches!(target, Target::Weights(..)));
    if weighs || clip.moves.contains(&false) {
        return Rigid::No;
    }
    let driven = |node: usize| clip.channels.iter().any(|(target, _)| target.node() == Some(node));
    let mut body = None;
    for part in &rig.parts {
        let Drive::Node(mut node) = part.drive else { return Rigid::No };
        // up to the nearest node that is driven; `moves` says that there is one
        while !driven(node) {
            match rig.nodes[node].parent.filter(|&parent| moved[parent]) {
                Some(parent) => node = parent,
                None => return Rigid::No,
            }
        }
        if *body.get_or_insert(node) != node {
            return Rigid::No;
        }
    }
    let Some(node) = body else { return Rigid::Still };
    // the nodes that it hangs on, itself among them
    let chain: Vec<usize> = std::iter::successors(Some(node), |&node| rig.nodes[node].parent).collect();
    if clip.channels.iter().any(|channel| scales(channel) && channel.0.node().is_some_and(|node| chain.contains(&node))) {
        return Rigid::No;
    }
    let mut times: Vec<f32> = clip.channels.iter().flat_map(|(_, track)| track.times_s()).copied().collect();
    times.sort_unstable_by(f32::total_cmp);
    times.dedup();
    let between: Vec<f32> = times.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    times.extend(between);
    let step = times.len().div_ceil(MOST_TIMES).max(1);
    let node_from_site_at_rest = matrix(rig.node_at(node, None, 0.0)).inverse();
    let places = rig.node_at_times(node, clip, times.into_iter().step_by(step));
    let stays = places.into_iter().all(|place| is_rotation((matrix(place) * node_from_site_at_rest).matrix3));
    if stays { Rigid::Node(node) } else { Rigid::No }
}

fn matrix(a: Affine) -> DAffine3 {
    DAffine3 { matrix3: a.linear(), translation: a.offset() }
}

/// `site_at_time_from_site_at_rest` of what hangs on a node of a rigid clip; none where it is not finite.
pub(crate) fn motion(rig: &Rig, clip: &RigClip, node: usize, time_s: f32) -> Option<DAffine3> {
    let node_from_site_at_rest = matrix(rig.node_at(node, None, 0.0)).inverse();
    let motion = matrix(rig.node_at(node, Some(clip), time_s)) * node_from_site_at_rest;
    motion.is_finite().then_some(motion)
}

fn is_rotation(m: DMat3) -> bool {
    let error = m * m.transpose() - DMat3::IDENTITY;
    error.to_cols_array().iter().all(|e| e.abs() <= RIGID_TOLERANCE) && m.determinant() > 0.0
}
