//! Animations. A channel that cannot be used is left out and told; the others go on.

use super::accessor::Values;
use super::buffers::{Buffers, no_such};
use super::model::{Animation, Channel, Document, Index, Motion};
use super::{Failure, Outcome, fail, size};
use crate::import::assembly::Assembly;
use crate::motion::rig::{RigClip, Target};
use crate::motion::track::{Interpolation, Track};
use std::collections::HashMap;
use std::sync::Arc;

/// What of the document can be driven.
pub(super) struct Driven {
    /// For each of the document's nodes the rig's; none where no vertex hangs on it.
    pub nodes: Vec<Option<usize>>,
    /// For a mesh at a node, where its morph weights begin and how many they are.
    pub weights: HashMap<(Index, Option<Index>), (usize, usize)>,
}

impl Driven {
    pub fn node(&self, node: Index) -> Option<usize> {
        self.nodes.get(node as usize).copied().flatten()
    }
}

pub(super) fn read<'d>(
    document: &'d Document,
    motion: &Motion,
    buffers: &Buffers<'d>,
    assembly: &mut Assembly,
    driven: &Driven,
) -> Vec<RigClip> {
    let mut reader = Reader { document, buffers, driven, numbers: 0 };
    let mut clips = Vec::new();
    for (k, animation) in motion.animations.iter().enumerate() {
        let mut tracks = HashMap::new();
        let mut channels = Vec::new();
        let mut duration_s = 0.0_f32;
        let mut usable = false;
        for (c, channel) in animation.channels.iter().enumerate() {
            match reader.channel(animation, channel, &format!("animations[{k}].channels[{c}]"), &mut tracks) {
                Ok(Some((target, track))) => {
                    usable = true;
                    duration_s = duration_s.max(track.last_s());
                    channels.extend(target.map(|target| (target, track)));
                }
                Ok(None) => {}
                Err(failure) => assembly.warn(format_args!("{failure}; the channel is left out")),
            }
        }
        if !usable {
            assembly.warn(format_args!("animations[{k}] has no channel that can be used and is left out"));
            continue;
        }
        let name = if animation.name.is_empty() { format!("animation {k}") } else { animation.name.clone() };
        clips.push(RigClip { name, duration_s, channels, moves: Vec::new(), rigid: Default::default() });
    }
    clips
}

struct Reader<'b, 'd> {
    document: &'d Document,
    buffers: &'b Buffers<'d>,
    driven: &'b Driven,
    /// Numbers in tracks so far.
    numbers: u64,
}

/// By sampler, width, and whether they turn.
type Tracks = HashMap<(Index, usize, bool), Arc<Track>>;

impl Reader<'_, '_> {
    /// What a channel drives, which is nothing where no vertex hangs on its node, and by which track; none where it drives nothing by
    /// the format's own rule.
    fn channel(
        &mut self,
        animation: &Animation,
        channel: &Channel,
        item: &str,
        tracks: &mut Tracks,
    ) -> Outcome<Option<(Option<Target>, Arc<Track>)>> {
        let nodes = &self.document.nodes;
        let Some(index) = channel.target.node else { return Ok(None) };
        let node = nodes.get(index as usize).ok_or_else(|| no_such("nodes", index, nodes.len()))?;
        let rig = self.driven.node(index);
        let path = channel.target.path.as_str();
        let (target, width) = match path {
            "translation" => (rig.map(Target::Translation), 3),
            "rotation" => (rig.map(Target::Rotation), 4),
            "scale" => (rig.map(Target::Scale), 3),
            "weights" => {
                let weights = node.mesh.and_then(|mesh| self.driven.weights.get(&(mesh, Some(index))));
                let Some(&(first, count)) = weights else {
                    return fail(item, "drives the morph weights of a node without morph targets", "export the file again");
                };
                (Some(Target::Weights(first, count)), count)
            }
            other => return fail(item, format!("drives \"{other}\", which is not read here"), "bake it to nodes and weights"),
        };
        if node.matrix.is_some() && path != "weights" {
            return fail(item, "drives a node that has a matrix", "export the file again");
        }
        let key = (channel.sampler, width, path == "rotation");
        let track = match tracks.get(&key) {
            Some(track) => track.clone(),
            None => {
                let track = Arc::new(self.track(animation, channel.sampler, width, path == "rotation", item)?);
                tracks.insert(key, track.clone());
                track
            }
        };
        Ok(Some((target, track)))
    }

    fn track(&mut self, animation: &Animation, sampler: Index, width: usize, turns: bool, item: &str) -> Outcome<Track> {
        let samplers = &animation.samplers;
        let Some(keyframes) = samplers.get(sampler as usize) else {
            let problem = format!("names sampler {sampler} of its animation's {}", samplers.len());
            return fail(item, problem, "export the file again");
        };
        let interpolation = match keyframes.interpolation.as_deref() {
            None | Some("LINEAR") => Interpolation::Linear,
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::Cubic,
            Some(other) => return fail(item, format!("has the unknown interpolation \"{other}\""), "export the file again"),
        };
        let times = Values::open(self.document, self.buffers, keyframes.input, &[1])?;
        let scalars = matches!(width, 3 | 4);
        // morph weights are scalars, as many in a row as there are targets; they may be three or four, too
        let widths: &[usize] = if scalars { &[1, width] } else { &[1] };
        let values = Values::open(self.document, self.buffers, keyframes.output, widths)?;
        for accessor in [&times, &values] {
            if !accessor.is_backed() && accessor.count > 1 << 16 {
                return fail(
                    item,
                    format!("has {} keyframes without data behind them", accessor.count),
                    "export the file again",
                );
            }
        }
        self.numbers += (times.count + values.count * values.width) as u64;
        let most = size::warranted(self.buffers);
        if self.numbers > most {
            let problem = format!("uses the same keyframes again and again; at most {most} are read");
            return fail(item, problem, "export the file again");
        }
        let times_s = (0..times.count).map(|i| times.get(i)[0] as f32).collect();
        let components = |i: usize| values.get(i).into_iter().take(values.width).map(|v| v as f32);
        let numbers = (0..values.count).flat_map(components).collect();
        Track::new(times_s, numbers, width, interpolation, turns)
            .map_err(|problem| Failure::new(item, problem, "export the file again"))
    }
}
