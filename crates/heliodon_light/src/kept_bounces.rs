//! Light on its way through the bounces, kept between them: long bakes that are killed go on from there.
//!
//! The bytes are in the order of this machine's memory, no format for others; whoever keeps them sees to it that they stay whole.

use crate::bounce::Reflected;
use crate::follow::MAX_FOLLOWED;
use bytemuck::{Pod, bytes_of, cast_slice, pod_collect_to_vec};
use std::collections::VecDeque;

/// Who looks on while light bounces, and keeps how far it is. Lanes that bounce together have a number, under which their last state is enough. What was
/// kept is handed out for the same blocks and parameters only; then it changes no bit.
pub trait KeptBounces: Sync {
    /// The bytes of a block ([`crate::GatherBlock::to_bytes`]) with all hits, of those of the solve the one with this number, where some of its hits are not
    /// at hand; without it they are traced again.
    fn block(&self, number: usize) -> Option<Vec<u8>>;

    /// What was kept under a number, whole and its runs in one, or nothing.
    fn take(&self, number: usize) -> Option<Vec<u8>>;

    /// Whether so much time has passed since anything was kept that it is worth while again.
    fn is_due(&self) -> bool;

    /// Keeps runs of bytes under a number, in place of what was there, or does not: light bounces on all the same.
    fn keep(&self, number: usize, runs: &[&[u8]]);

    /// Hears that so many passes are done, of [`crate::LightParams::bounce_passes`].
    fn told(&self, done: u64);
}

/// Lanes that bounce together, between two bounces.
pub(crate) struct Bouncing<const W: usize> {
    /// Bounces that are done.
    pub done: usize,
    /// Light of the points.
    pub points: Vec<[f32; W]>,
    /// Light of the cells.
    pub reflected: Reflected<W>,
}

impl<const W: usize> Bouncing<W> {
    /// Before light has bounced.
    pub fn new((points, cells): (usize, usize)) -> Self {
        let reflected = Reflected { newest: vec![[0.0; W]; cells], older: VecDeque::new() };
        Self { done: 0, points: vec![[0.0; W]; points], reflected }
    }

    /// Its memory, run after run; what cells reflected only where somebody asks for it later.
    pub fn runs(&self, cells_too: bool) -> Vec<&[u8]> {
        let Self { done, points, reflected: Reflected { newest, older } } = self;
        let mut runs = vec![bytes_of(done), cast_slice(points)];
        if cells_too {
            runs.push(cast_slice(newest));
            runs.extend(older.iter().map(|cells| cast_slice::<_, u8>(cells)));
        }
        runs
    }

    /// From the runs, one after the other, of as many points and cells after no more than `most` bounces; nothing where they are of something else.
    pub fn of_runs(mut bytes: &[u8], (points, cells): (usize, usize), most: usize, cells_too: bool) -> Option<Self> {
        let rest = &mut bytes;
        let done = *taken::<usize>(rest, 1)?.first()?;
        let points = taken(rest, points)?;
        let (newest, older) = match cells_too {
            true => (taken(rest, cells)?, done.checked_sub(1)?.min(MAX_FOLLOWED)),
            false => (vec![[0.0; W]; cells], 0),
        };
        let older = (0..older).map(|_| taken(rest, cells)).collect::<Option<_>>()?;
        (rest.is_empty() && (1..=most).contains(&done)).then_some(Self { done, points, reflected: Reflected { newest, older } })
    }
}

/// The first so many of what the bytes are.
fn taken<T: Pod>(rest: &mut &[u8], count: usize) -> Option<Vec<T>> {
    let (run, others) = rest.split_at_checked(count.checked_mul(size_of::<T>())?)?;
    *rest = others;
    Some(pod_collect_to_vec(run))
}

#[cfg(test)]
mod tests {
    use super::*;
    use half::f16;

    fn bouncing() -> Bouncing<4> {
        let reflected = Reflected { newest: vec![[0.25; 4]; 3], older: vec![vec![[f16::from_f32(0.5); 4]; 3]].into() };
        Bouncing { done: 2, points: vec![[1.0; 4], [2.0; 4]], reflected }
    }

    #[test]
    fn what_is_kept_comes_back_and_nothing_else_is_taken() {
        let bytes = bouncing().runs(true).concat();
        let again = Bouncing::<4>::of_runs(&bytes, (2, 3), 4, true).unwrap();
        assert_eq!((again.done, &again.points), (2, &bouncing().points));
        assert_eq!(
            (&again.reflected.newest, &again.reflected.older),
            (&bouncing().reflected.newest, &bouncing().reflected.older)
        );
        for (sizes, most, cells_too) in [((3, 3), 4, true), ((2, 2), 4, true), ((2, 3), 1, true), ((2, 3), 4, false)] {
            assert!(Bouncing::<4>::of_runs(&bytes, sizes, most, cells_too).is_none(), "{sizes:?} {most} {cells_too}");
        }
        assert!(Bouncing::<8>::of_runs(&bytes, (1, 1), 4, true).is_none());
        for cut in 0..bytes.len() {
            assert!(Bouncing::<4>::of_runs(&bytes[..cut], (2, 3), 4, true).is_none(), "cut at {cut}");
        }
        let points_alone = bouncing().runs(false).concat();
        let again = Bouncing::<4>::of_runs(&points_alone, (2, 3), 4, false).unwrap();
        assert_eq!((again.points, again.reflected.newest), (bouncing().points, vec![[0.0; 4]; 3]));
        assert!(Bouncing::<4>::of_runs(&points_alone, (2, 3), 4, true).is_none(), "what cells reflected is asked for");
    }
}
