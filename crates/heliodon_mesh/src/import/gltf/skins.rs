//! Skins: joints, and which of them carry which vertices.

use super::accessor::Values;
use super::buffers::{Buffers, no_such};
use super::model::{Document, Index, Motion, Primitive};
use super::{Failure, Outcome, fail};
use crate::import::assembly::Assembly;
use crate::motion::part::Influences;
use crate::place::Affine;
use glam::{DMat3, DVec3};

/// Four joints each; files with more than sixteen to a vertex are not in use.
const MOST_SETS: usize = 4;

/// What was mended in the skins' weights, told once.
#[derive(Default)]
pub(super) struct Tally {
    beyond: u64,
    weightless: u64,
    unbound: u64,
    more_sets: u64,
}

impl Tally {
    pub fn tell(&self, assembly: &mut Assembly) {
        let Self { beyond, weightless, unbound, more_sets } = *self;
        if beyond > 0 {
            assembly.warn(format_args!("{beyond} weights are for joints beyond their skin, or NaN, and are left out"));
        }
        if weightless > 0 {
            assembly.warn(format_args!("{weightless} skinned vertices have no weight and move with the skin's first joint"));
        }
        if unbound > 0 {
            assembly.warn(format_args!("{unbound} primitives of skinned meshes name no joints and move with their node"));
        }
        if more_sets > 0 {
            let most = 4 * MOST_SETS;
            assembly.warn(format_args!(
                "{more_sets} primitives have more than {most} joints a vertex; the further ones are left out"
            ));
        }
    }
}

/// The nodes of a skin's joints, and their inverse bind matrices.
pub(super) fn read(
    document: &Document,
    motion: &Motion,
    buffers: &Buffers,
    index: Index,
) -> Outcome<(Vec<Index>, Vec<Affine>)> {
    let skin = motion.skins.get(index as usize).ok_or_else(|| no_such("skins", index, motion.skins.len()))?;
    let item = format!("skins[{index}]");
    let count = skin.joints.len();
    if count == 0 || count > usize::from(u16::MAX) + 1 {
        return fail(&item, format!("has {count} joints"), "export the file again");
    }
    let Some(accessor) = skin.inverse_bind_matrices else {
        return Ok((skin.joints.clone(), vec![Affine::IDENTITY; count]));
    };
    let values = Values::open(document, buffers, accessor, &[16])?;
    if values.count < count {
        let problem = format!("has {} inverse bind matrices for {count} joints", values.count);
        return fail(&item, problem, "export the file again");
    }
    let bind = |i: usize| {
        let m: [f64; 16] = values.components(i);
        if m.iter().any(|v| !v.is_finite()) {
            return Err(Failure::new(&item, format!("its inverse bind matrix {i} is not finite"), "export the file again"));
        }
        let column = |k: usize| DVec3::new(m[4 * k], m[4 * k + 1], m[4 * k + 2]);
        Ok(Affine::new(DMat3::from_cols(column(0), column(1), column(2)), column(3)))
    };
    Ok((skin.joints.clone(), (0..count).map(bind).collect::<Outcome<_>>()?))
}

/// The joints and weights of a primitive's vertices; none where it names none.
pub(super) fn influences(
    document: &Document,
    buffers: &Buffers,
    primitive: &Primitive,
    count: usize,
    joints: usize,
    item: &str,
    tally: &mut Tally,
) -> Outcome<Option<Influences>> {
    let mut sets = Vec::new();
    let attribute = |name: &str, set: usize| primitive.attributes.get(&format!("{name}_{set}")).copied();
    while let Some((joints, weights)) = attribute("JOINTS", sets.len()).zip(attribute("WEIGHTS", sets.len())) {
        if sets.len() == MOST_SETS {
            tally.more_sets += 1;
            break;
        }
        let joints = Values::open(document, buffers, joints, &[4])?;
        let weights = Values::open(document, buffers, weights, &[4])?;
        for (values, name) in [(&joints, "joints"), (&weights, "weights")] {
            if values.count < count {
                let problem = format!("has {name} of {} vertices for {count} positions", values.count);
                return fail(item, problem, "export the file again");
            }
        }
        if !joints.is_unsigned() {
            return fail(item, "its joints are no unsigned numbers", "export the file again");
        }
        sets.push((joints, weights));
    }
    if sets.is_empty() {
        tally.unbound += 1;
        return Ok(None);
    }
    let mut influences = Influences { starts: Vec::with_capacity(count + 1), pairs: Vec::with_capacity(count) };
    influences.starts.push(0);
    for i in 0..count {
        let begin = influences.pairs.len();
        let mut sum = 0.0;
        for (joint, weight) in sets.iter().flat_map(|(j, w)| j.get(i).into_iter().zip(w.get(i))) {
            if weight == 0.0 {
                continue;
            }
            // NaN and less than nothing among them
            if !(weight > 0.0 && weight.is_finite()) || joint as usize >= joints {
                tally.beyond += 1;
                continue;
            }
            sum += weight;
            influences.pairs.push((joint as u16, weight as f32));
        }
        for (_, weight) in &mut influences.pairs[begin..] {
            *weight = (f64::from(*weight) / sum) as f32;
        }
        if influences.pairs.len() == begin {
            tally.weightless += 1;
            influences.pairs.push((0, 1.0));
        }
        influences.starts.push(influences.pairs.len() as u32);
    }
    Ok(Some(influences))
}
