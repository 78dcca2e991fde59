//! How far a step is, for whoever waits for it.
//!
//! Steps tell the part of them that is done, by rough shares of its time: not exact, but it never
//! goes back, and the time left that follows from it is of use. What is told changes no result.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Tells a listener how much of a step is done, from 0 to 1; any thread may call it, some at once.
#[derive(Clone, Copy)]
pub struct Tell<'a> {
    listener: Option<&'a (dyn Fn(f64) + Sync)>,
    from: f64,
    to: f64,
}

impl<'a> Tell<'a> {
    /// Nobody listens.
    pub const NOBODY: Tell<'static> = Tell { listener: None, from: 0.0, to: 1.0 };

    /// For a listener that sorts out what comes late from another thread.
    #[must_use]
    pub fn new(listener: &'a (dyn Fn(f64) + Sync)) -> Self {
        Self { listener: Some(listener), from: 0.0, to: 1.0 }
    }

    /// A part of this is done, in [0, 1].
    pub fn done(self, share: f64) {
        if let Some(listener) = self.listener {
            listener(self.from + (self.to - self.from) * share.clamp(0.0, 1.0));
        }
    }

    /// What is told of a piece of the step, which lies between two shares of it.
    #[must_use]
    pub fn within(self, from: f64, to: f64) -> Self {
        let at = |share: f64| self.from + (self.to - self.from) * share;
        Self { from: at(from), to: at(to), ..self }
    }

    /// Tells by counting up to a total.
    pub(crate) fn count(self, total: usize) -> Count<'a> {
        Count { tell: self, total, done: AtomicUsize::new(0) }
    }
}

/// Counts what threads do.
pub(crate) struct Count<'a> {
    tell: Tell<'a>,
    total: usize,
    done: AtomicUsize,
}

impl Count<'_> {
    /// So many more are done.
    pub fn add(&self, more: usize) {
        let done = self.done.fetch_add(more, Ordering::Relaxed) + more;
        self.tell.done(done as f64 / self.total.max(1) as f64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clean::{CleanParams, clean_telling};
    use crate::purge::{PurgeParams, Surface, purge_telling};
    use crate::shapes::grid;
    use crate::simplify::{SimplifyParams, measure_telling, nearest_triangles_telling, simplify_telling};
    use crate::split::split_telling;
    use crate::{Screen, ViewCell, Views};
    use glam::Vec3;
    use heliodon_rays::{BuildParams, TriangleScene};
    use std::sync::Mutex;

    #[test]
    fn pieces_lie_within_their_step() {
        let heard = Mutex::new(Vec::new());
        let listen = |share| heard.lock().unwrap().push(share);
        let tell = Tell::new(&listen).within(0.5, 1.0);
        tell.done(0.0);
        tell.within(0.5, 0.9).done(1.0);
        let count = tell.count(2);
        count.add(1);
        count.add(1);
        tell.done(7.0);
        Tell::NOBODY.done(0.5);
        assert_eq!(*heard.lock().unwrap(), [0.5, 0.95, 0.75, 1.0, 1.0]);
    }

    /// Each step tells often, from its beginning to its end: more than a jump from nothing to all.
    #[test]
    fn every_step_tells_on_its_way() {
        let told = |work: &dyn Fn(Tell)| {
            let heard = Mutex::new(Vec::new());
            work(Tell::new(&|share| heard.lock().unwrap().push(share)));
            let mut heard = heard.into_inner().unwrap();
            heard.dedup();
            assert!(heard.iter().all(|share| (0.0..=1.0).contains(share)), "{heard:?}");
            assert!(heard.last().is_some_and(|&last| last > 0.99), "{heard:?}");
            assert!(heard.iter().any(|&share| (0.05..0.5).contains(&share)), "{heard:?}");
            assert!(heard.iter().any(|&share| (0.5..0.97).contains(&share)), "{heard:?}");
        };
        let mesh = grid(180, |x, z| 0.02 * (9.0 * x).sin() * (7.0 * z).cos());
        let cell = ViewCell { low: Vec3::new(0.2, 0.5, 0.2), high: Vec3::new(0.4, 0.6, 0.4), windows: Vec::new() };
        let screen = Screen { width_px: 320, height_px: 240, fov_rad: 1.0 };
        let views = Views { cells: vec![cell], screen };
        let params = SimplifyParams { nearest_m: 0.1, ..SimplifyParams::screen() };
        told(&|tell| drop(clean_telling(&mut mesh.clone(), &CleanParams::default(), tell)));
        told(&|tell| {
            split_telling(&mut mesh.clone(), |_, _| 0.004, 10_000_000, tell).unwrap();
        });
        told(&|tell| drop(simplify_telling(&mesh, &views, &params, tell)));
        let simple = simplify_telling(&mesh, &views, &params, Tell::NOBODY).mesh;
        assert!(simple.triangles.len() < mesh.triangles.len());
        told(&|tell| drop(measure_telling(&mesh, &simple, &views, &params, tell)));
        told(&|tell| drop(nearest_triangles_telling(&mesh, &simple, &views, &params, tell)));
        let rays = TriangleScene::build(&mesh.positions, &mesh.triangles, &BuildParams::default()).unwrap();
        let surface = Surface { positions: &mesh.positions, triangles: &mesh.triangles, single_sided: &[] };
        told(&|tell| drop(purge_telling(&rays, &surface, &views, &PurgeParams::preview(), tell)));
    }
}
