//! Both eyes of a head leave out the same, which is found once a frame.

use super::{Culler, ViewCulling};
use crate::daylight::StereoPair;
use crate::daylight::pages::GpuChunk;
use crate::daylight::view::{ClusterRef, Look, cull};
use std::collections::HashMap;

/// The two cameras of a pair in this frame, and what they draw once one of them has asked.
#[derive(Debug, Default)]
struct Pair {
    looks: Vec<Look>,
    culling: ViewCulling,
    found: Option<Vec<ClusterRef>>,
}

/// All pairs.
#[derive(Debug, Default)]
pub struct Pairs(HashMap<StereoPair, Pair>);

impl Pairs {
    /// A frame begins, with these cameras of pairs. Those that are gone are forgotten.
    pub fn begin(&mut self, cameras: impl Iterator<Item = (StereoPair, Look)>) {
        for pair in self.0.values_mut() {
            pair.looks.clear();
            pair.found = None;
        }
        for (number, look) in cameras {
            self.0.entry(number).or_default().looks.push(look);
        }
        self.0.retain(|_, pair| !pair.looks.is_empty());
    }

    /// The cameras of a pair, of which `own` is one; that alone where there is no pair.
    #[must_use]
    pub fn looks(&self, number: Option<StereoPair>, own: Look) -> Vec<Look> {
        let pair = number.and_then(|number| self.0.get(&number));
        pair.map_or_else(|| vec![own], |pair| pair.looks.clone())
    }

    /// What a camera draws, which is all that any of its pair does: found by the first that asks. `own` takes what is left out.
    #[must_use]
    pub fn clusters(
        &mut self,
        number: Option<StereoPair>,
        own: &mut ViewCulling,
        culler: &Culler,
        chunks: &[GpuChunk],
        looks: &[Look],
    ) -> Vec<ClusterRef> {
        let Some(pair) = number.and_then(|number| self.0.get_mut(&number)) else {
            return own.thin(culler, chunks, looks, cull(chunks, looks));
        };
        let Pair { looks, culling, found } = pair;
        let found = found.get_or_insert_with(|| culling.thin(culler, chunks, looks, cull(chunks, looks)));
        own.share(culling);
        found.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::culling::Culling;
    use crate::daylight::view::Eye;
    use glam::{Mat4, Vec2, Vec3};

    #[test]
    fn both_eyes_get_the_same_found_once_a_frame() {
        let eye = |x: f32| Look { clip_from_world: Mat4::IDENTITY, eye: Eye::At(Vec3::X * x), size: Vec2::ONE };
        let culler = Culler { scene: None, settings: Culling::default(), remembers: true, faded: &[] };
        let (number, mut pairs) = (StereoPair(3), Pairs::default());
        pairs.begin([(number, eye(-1.0)), (number, eye(1.0))].into_iter());
        assert_eq!(pairs.looks(Some(number), eye(1.0)), [eye(-1.0), eye(1.0)]);
        assert_eq!(pairs.looks(None, eye(5.0)), [eye(5.0)]);
        let (mut left, mut right) = (ViewCulling::default(), ViewCulling::default());
        let looks = pairs.looks(Some(number), eye(1.0));
        let first = pairs.clusters(Some(number), &mut left, &culler, &[], &looks);
        // Found by the first: the second does not look again.
        pairs.0.get_mut(&number).unwrap().found.as_mut().unwrap().push(ClusterRef { chunk: 7, cluster: 9 });
        let second = pairs.clusters(Some(number), &mut right, &culler, &[], &looks);
        assert!(first.is_empty() && second.len() == 1);
        pairs.begin([(number, eye(0.0))].into_iter());
        assert_eq!(pairs.looks(Some(number), eye(0.0)), [eye(0.0)], "one eye alone");
        assert!(pairs.clusters(Some(number), &mut left, &culler, &[], &[]).is_empty());
        pairs.begin(std::iter::empty());
        assert!(pairs.0.is_empty(), "a pair that is gone is forgotten");
    }
}
