//! How far simplification may go in each part, growing until about as many triangles are drawn as the site wants.

use heliodon_prepare::simplify::SimplifyParams;

/// What is drawn fits where it is no more than so many times what is asked for.
const FITS: f64 = 1.05;
/// Limits grow by at least this much in each round.
const LEAST_GROWTH: f64 = 1.1;
/// Ground gives way before stone does, until its limits are so many times as large, where with the same limits both would have as many triangles.
/// Beneath and around a room without windows it takes more than all that stands on it, for an eye that looks down is nearer to it than to anything;
/// then it gives more, by the fourth root: for a number of triangles of two kinds the sum of the squares of their limits is least so.
const GROUND_GIVES: f64 = 8.0;

/// A part, as far as its limits are concerned.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grained {
    pub is_ground: bool,
    /// How many times longer than asked for its edges were let be when it was split: until its limits are as much larger, they change nothing.
    pub times_split: f64,
}

/// The limits of all parts.
pub(super) struct Limits {
    /// Part by part.
    pub params: Vec<SimplifyParams>,
    parts: Vec<Grained>,
    so_far: Growth,
}

/// By how much limits grow.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Growth {
    stone: f64,
    ground: f64,
}

impl Limits {
    /// As the site asks for them.
    pub fn new(asked: &SimplifyParams, parts: Vec<Grained>) -> Self {
        let split = |ground: bool| {
            let of_kind = parts.iter().filter(|part| part.is_ground == ground);
            of_kind.map(|part| part.times_split).fold(1.0, f64::max)
        };
        let so_far = Growth { stone: split(false), ground: split(true) };
        Self { params: vec![asked.clone(); parts.len()], parts, so_far }
    }

    /// Grows them, if more than so many triangles would be drawn of the parts; tells which then have other limits, or none if these fit.
    pub fn grow(&mut self, drawn: &[f64], wanted: f64) -> Option<Vec<usize>> {
        let of = |ground: bool| {
            let of_kind = self.parts.iter().zip(drawn).filter(|(part, _)| part.is_ground == ground);
            of_kind.map(|(_, drawn)| drawn).sum()
        };
        let growth = growth(of(false), of(true), wanted, self.so_far)?;
        self.so_far = Growth { stone: self.so_far.stone * growth.stone, ground: self.so_far.ground * growth.ground };
        let mut grown = Vec::with_capacity(self.parts.len());
        for (index, (part, params)) in self.parts.iter_mut().zip(&mut self.params).enumerate() {
            let times = if part.is_ground { growth.ground } else { growth.stone };
            if times != 1.0 {
                // only the first time: what splitting gave away is given
                *params = coarser(params, (times * std::mem::replace(&mut part.times_split, 1.0)) as f32);
                grown.push(index);
            }
        }
        Some(grown)
    }
}

/// By how much limits must grow so that so many triangles of stone and of ground become as many as are wanted; none where they fit. Triangles have
/// areas, so their number falls with the square.
fn growth(stone: f64, ground: f64, wanted: f64, so_far: Growth) -> Option<Growth> {
    if stone + ground <= FITS * wanted {
        return None;
    }
    let ground_of_stone = ground * so_far.ground.powi(2) / (stone * so_far.stone.powi(2)).max(1.0);
    let gives = GROUND_GIVES * ground_of_stone.max(1.0).powf(0.25) * so_far.stone / so_far.ground;
    let asked = (ground / (wanted - stone).max(1.0)).sqrt().max(LEAST_GROWTH);
    let alone = if ground > 0.0 { asked.min(gives).max(1.0) } else { 1.0 };
    let left = (stone + ground / (alone * alone)) / wanted;
    let stone = if alone > 1.0 && left <= FITS { 1.0 } else { left.sqrt().max(LEAST_GROWTH) };
    Some(Growth { stone, ground: alone * stone })
}

/// As `params`, with limits so many times as large.
pub(super) fn coarser(params: &SimplifyParams, times: f32) -> SimplifyParams {
    SimplifyParams {
        error_px: times * params.error_px,
        edge_px: times * params.edge_px,
        error_m: times * params.error_m,
        edge_m: times * params.edge_m,
        ..params.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BEGIN: Growth = Growth { stone: 1.0, ground: 1.0 };

    #[test]
    fn ground_gives_way_before_stone() {
        assert_eq!(growth(300.0, 700.0, 1000.0, BEGIN), None);
        // a quarter of the ground is enough
        assert_eq!(growth(300.0, 2800.0, 1000.0, BEGIN), Some(Growth { stone: 1.0, ground: 2.0 }));
        // all that it gives is not: the rest is taken from both
        let both = growth(1200.0, 1200.0, 1200.0 * (1.0 + 1.0 / 64.0) / 2.0, BEGIN).unwrap();
        assert!(
            (both.stone - 2.0_f64.sqrt()).abs() < 1e-9 && (both.ground - GROUND_GIVES * both.stone).abs() < 1e-9,
            "{both:?}"
        );
        // what it has given it does not give again
        let more = growth(900.0, 12.0, 600.0, Growth { stone: 1.5, ground: 1.5 * GROUND_GIVES }).unwrap();
        assert!((more.stone - (912.0_f64 / 600.0).sqrt()).abs() < 1e-9 && more.ground == more.stone, "{more:?}");
        // for a little stone that would not help ground gives more
        let vast = growth(10.0, 1e6, 1010.0, BEGIN).unwrap();
        assert!(vast.stone == 1.0 && (vast.ground - 1e3_f64.sqrt()).abs() < 1e-9, "{vast:?}");
    }

    #[test]
    fn stone_alone_grows_as_it_must() {
        let alone = growth(1600.0, 0.0, 400.0, BEGIN).unwrap();
        assert_eq!(alone.stone, 2.0);
        assert_eq!(growth(420.1, 0.0, 400.0, BEGIN).unwrap().stone, LEAST_GROWTH);
    }

    #[test]
    fn limits_grow_from_what_splitting_gave_already() {
        let stone = Grained { is_ground: false, times_split: 1.0 };
        let ground = Grained { is_ground: true, times_split: 4.0 };
        let mut limits = Limits::new(&SimplifyParams::screen(), vec![stone, ground]);
        assert_eq!(limits.grow(&[100.0, 900.0], 1000.0), None);
        assert_eq!(limits.params, vec![SimplifyParams::screen(); 2]);
        // a quarter is wanted: twice what it was split to
        assert_eq!(limits.grow(&[100.0, 3600.0], 1000.0), Some(vec![1]));
        assert_eq!([limits.params[0].edge_px, limits.params[1].edge_px], [5.0, 40.0]);
        // what splitting gave does not count again
        assert_eq!(limits.grow(&[100.0, 3600.0], 1000.0), Some(vec![1]));
        assert_eq!([limits.params[0].edge_px, limits.params[1].edge_px], [5.0, 80.0]);
    }
}
