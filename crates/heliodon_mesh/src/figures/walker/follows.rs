//! What vertices follow: shares of joints.

use crate::figures::shape::smoothstep;

/// What a piece follows: shares of joints, which sum to 1, at its beginning and at its end; smooth between.
#[derive(Clone, Copy)]
pub struct Follows {
    begin: [(usize, f32); 2],
    end: [(usize, f32); 2],
}

impl Follows {
    pub fn one(joint: usize) -> Self {
        Self::mix(joint, joint, 0.0)
    }

    /// `share` of `b`, the rest of `a`.
    pub fn mix(a: usize, b: usize, share: f32) -> Self {
        let both = [(a, 1.0 - share), (b, share)];
        Self { begin: both, end: both }
    }

    pub fn from_to(begin: Self, end: Self) -> Self {
        Self { begin: begin.begin, end: end.begin }
    }

    /// The four joints and weights of a vertex.
    pub fn at(self, along: f32) -> ([u8; 4], [f32; 4]) {
        let x = smoothstep(along);
        let mut shares: Vec<(usize, f32)> = Vec::with_capacity(4);
        for ((joint, share), weight) in self.begin.into_iter().map(|s| (s, 1.0 - x)).chain(self.end.into_iter().map(|s| (s, x)))
        {
            match shares.iter_mut().find(|(known, _)| *known == joint) {
                Some((_, sum)) => *sum += share * weight,
                None => shares.push((joint, share * weight)),
            }
        }
        four(&shares)
    }
}

/// The first four joints and their shares, not all 0, as a vertex of glTF has them.
pub fn four(shares: &[(usize, f32)]) -> ([u8; 4], [f32; 4]) {
    let shares = &shares[..shares.len().min(4)];
    let sum: f32 = shares.iter().map(|(_, share)| share).sum();
    // glTF wants joint 0 where the weight is 0
    let get = |i: usize| shares.get(i).copied().filter(|(_, share)| *share > 0.0).unwrap_or((0, 0.0));
    (std::array::from_fn(|i| get(i).0 as u8), std::array::from_fn(|i| get(i).1 / sum))
}
