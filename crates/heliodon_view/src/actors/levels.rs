//! How many directions are asked: fewer while things move, more when they rest (M. Sattler, R. Sarlette, G. Zachmann, R. Klein: "Hardware-accelerated
//! ambient occlusion computation", VMV 2004, section 4.2).

use heliodon_math::light_sphere::LightSphere;

/// The directions that actors' light is asked from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Directions {
    /// Always the light sphere of this level.
    Fixed(u32),
    /// As many as can be asked in so many milliseconds a frame while an actor deforms, and level after level more while it does not.
    Budget {
        /// Milliseconds of a frame for all actors that deform, in even parts.
        ms: f32,
        /// The level at which an actor at rest is exact.
        finest: u32,
    },
}

impl Directions {
    /// For one of so many that share a budget.
    #[must_use]
    pub fn shared(self, by: usize) -> Self {
        match self {
            Self::Budget { ms, finest } => Self::Budget { ms: ms / by.max(1) as f32, finest },
            Self::Fixed(_) => self,
        }
    }

    /// The level where a GPU asks, which does not say how long it takes: of a budget the level that one is thought to keep while an actor deforms.
    #[must_use]
    pub fn on_gpu(self, deforming: bool) -> u32 {
        match self {
            Self::Fixed(level) => level,
            Self::Budget { finest, .. } if deforming => finest.min(MOVING_ON_GPU),
            Self::Budget { finest, .. } => finest,
        }
    }
}

/// The level of what deforms, where a GPU asks: 258 directions.
const MOVING_ON_GPU: u32 = 3;

/// While things move no level below this is used: with 18 directions and fewer light jumps from vertex to vertex.
const COARSEST: u32 = 2;

/// A level is left for a finer one only if that is expected to take so much less than the budget: it must not be left again in the next frame.
const ROOM: f32 = 0.7;

/// Chooses the level of an actor from what its last frames have taken.
#[derive(Clone, Debug)]
pub struct LevelChoice {
    level: u32,
    /// Milliseconds for a vertex and a direction, the mean over the last frames.
    ms_an_entry: Option<f32>,
}

impl Default for LevelChoice {
    fn default() -> Self {
        Self { level: COARSEST, ms_an_entry: None }
    }
}

impl LevelChoice {
    /// The level for this frame's vertices; `deforming` if what was asked before is of no use.
    pub fn next(&mut self, directions: Directions, vertices: usize, deforming: bool) -> u32 {
        let (ms, finest) = match directions {
            Directions::Fixed(level) => {
                self.level = level;
                return level;
            }
            Directions::Budget { ms, finest } => (ms, finest),
        };
        let expected = |level: u32| self.ms_an_entry.unwrap_or(0.0) * vertices as f32 * LightSphere::count(level) as f32;
        let coarsest = COARSEST.min(finest);
        if !deforming {
            // One level more in each frame; its columns are three quarters of all.
            self.level = (self.level + 1).clamp(coarsest, finest);
        } else if self.level > coarsest && expected(self.level) > ms {
            self.level = (coarsest..self.level).rev().find(|&level| expected(level) <= ms).unwrap_or(coarsest);
        } else if self.level < finest && self.ms_an_entry.is_some() && expected(self.level + 1) <= ROOM * ms {
            self.level += 1;
        }
        self.level = self.level.clamp(coarsest, finest);
        self.level
    }

    /// Tells what a frame has taken.
    pub fn took(&mut self, ms: f32, vertices: usize, directions: usize) {
        let entries = vertices as f32 * directions as f32;
        // What is asked of a few vertices is mostly what asking takes at all.
        if entries >= 1e4 {
            let now = ms / entries;
            self.ms_an_entry = Some(self.ms_an_entry.map_or(now, |before| before + 0.2 * (now - before)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_budget_is_kept_while_things_move_and_rest_makes_exact() {
        let budget = Directions::Budget { ms: 10.0, finest: 4 };
        let mut choice = LevelChoice::default();
        // A million entries in ten milliseconds: 8,000 vertices afford 66 directions, 1,000 afford 258.
        let frame = |choice: &mut LevelChoice, vertices: usize, deforming: bool| {
            let level = choice.next(budget, vertices, deforming);
            let k = LightSphere::count(level);
            choice.took(1e-5 * vertices as f32 * k as f32, vertices, k);
            level
        };
        let many: Vec<u32> = (0..30).map(|_| frame(&mut choice, 8000, true)).collect();
        assert_eq!(many, vec![2; 30]);
        let few: Vec<u32> = (0..30).map(|_| frame(&mut choice, 1000, true)).collect();
        assert_eq!((few[1], few[29]), (3, 3));
        assert_eq!([0; 3].map(|_| frame(&mut choice, 8000, false)), [4, 4, 4]);
        assert_eq!(frame(&mut choice, 8000, true), 2);
        assert_eq!([0; 3].map(|_| frame(&mut choice, 8000, false)), [3, 4, 4]);
        assert_eq!(choice.next(Directions::Fixed(1), 10, true), 1);
        // Three share it: what one affords alone none of them does.
        let mut choice = LevelChoice::default();
        let shares = (0..30).map(|_| {
            let level = choice.next(budget.shared(3), 1000, true);
            choice.took(1e-5 * 1000.0 * LightSphere::count(level) as f32, 1000, LightSphere::count(level));
            level
        });
        assert!(shares.collect::<Vec<_>>().iter().all(|&level| level == 2));
        assert_eq!((budget.shared(0), Directions::Fixed(4).shared(3)), (budget, Directions::Fixed(4)));
    }

    #[test]
    fn a_level_at_its_edge_does_not_swing() {
        let mut choice = LevelChoice::default();
        let budget = Directions::Budget { ms: 10.0, finest: 5 };
        let mut changes = 0;
        let mut last = 2;
        for frame in 0..200 {
            let level = choice.next(budget, 3600 + frame % 7 * 50, true);
            changes += u32::from(level != last);
            last = level;
            let k = LightSphere::count(level);
            choice.took(1e-5 * 3900.0 * k as f32 * if frame % 2 == 0 { 0.9 } else { 1.1 }, 3900, k);
        }
        assert!(changes <= 1, "{changes}");
    }
}
